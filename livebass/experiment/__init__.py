"""One pluck (`simulate`), or a parameter of a preset or a pluck over a grid (`sweep`)."""
