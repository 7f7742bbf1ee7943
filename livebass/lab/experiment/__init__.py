"""Simulates one pluck, or sweeps any parameter over a grid of plucks."""
