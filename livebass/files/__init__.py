"""Files: written whole or not at all, their kinds and formats."""
