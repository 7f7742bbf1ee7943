"""Preset files (TOML): keys.py lists every key, as neck.action; checks, build and load make an instrument of them."""
