"""Plays live: devices, synth, session."""
