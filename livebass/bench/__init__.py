"""Measures what livebass costs on this machine."""
