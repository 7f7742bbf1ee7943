"""What hands do to a string."""
