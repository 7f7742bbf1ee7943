"""Operators and memory for the kernels, a bass as an object, one pluck solved, a score rendered."""
