"""A string identified from recordings."""
