"""Issanchou et al. (2018) computed anew."""
