"""A whole bass as numbers: the instrument file, and what is made of it."""
