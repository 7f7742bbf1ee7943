"""Recomputes Issanchou et al. (2018) and checks its statements."""
