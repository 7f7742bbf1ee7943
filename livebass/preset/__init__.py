"""Preset files (TOML): keys.py lists every key, as neck.action; checks, build and load turn them into an instrument."""
