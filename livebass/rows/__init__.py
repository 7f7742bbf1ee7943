"""Tables of a bass, its player and its controls: one row for each number, with unit and bounds."""
