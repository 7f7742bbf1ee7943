"""Benchmarks: the cost of sound on this machine, and whether it is ready in time."""
