"""Prepares the memory of kernels, plays messages, solves one pluck, renders a score."""
