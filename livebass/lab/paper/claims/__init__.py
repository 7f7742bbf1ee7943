"""Checks the verifiable statements of Issanchou et al. (2018)."""
