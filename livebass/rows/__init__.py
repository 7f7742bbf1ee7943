"""What a bass, its player and its controls have, a row each, with units and bounds."""
