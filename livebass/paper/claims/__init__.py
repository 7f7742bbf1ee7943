"""Checks the statements of Issanchou et al. (2018) that can be checked."""
