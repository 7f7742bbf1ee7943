"""Benchmarks: what sound costs on this machine, and whether it is ready in time."""
