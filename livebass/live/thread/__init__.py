"""The audio thread's code: compiled, without allocations, locks or files."""
