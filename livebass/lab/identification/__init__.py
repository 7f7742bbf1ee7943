"""Identifies a string from recordings."""
