"""Prepares the kernels' memory, plays messages, solves one pluck, renders a score."""
