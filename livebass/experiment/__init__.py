"""Simulates one pluck, or any parameter over a grid of plucks."""
