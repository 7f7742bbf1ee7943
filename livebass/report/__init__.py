"""Writes results, for every room: tables, CSV, JSON, pictures and HTML pages."""
