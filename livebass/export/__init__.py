"""Exports a bass for other programs: sample packs."""
