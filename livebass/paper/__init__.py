"""Issanchou et al. (2018) computed anew: its cases, its figures and the claims that can be checked."""
