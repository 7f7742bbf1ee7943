"""Brute force, written from the equations; it shares nothing with the engine."""
