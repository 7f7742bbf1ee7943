"""The laboratory: what measures, compares, identifies and fits basses. Nobody needs it to play."""
