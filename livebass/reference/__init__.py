"""Brute force, written from the equations: shares nothing with the engine."""
