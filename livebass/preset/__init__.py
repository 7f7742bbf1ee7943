"""Preset files (TOML): every key, its checks, and the way to an instrument and back."""
