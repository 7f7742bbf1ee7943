"""Computes Issanchou et al. (2018) anew and checks its statements."""
