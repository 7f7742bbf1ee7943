"""Measurements in sounds (`sound`) and in motions of a string (`motion`)."""
