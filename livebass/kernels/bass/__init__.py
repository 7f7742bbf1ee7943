"""A whole bass as numbers: the instrument file, and everything made from it."""
