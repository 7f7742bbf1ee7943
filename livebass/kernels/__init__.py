"""Everything numba compiles for playing: how a string moves and what hands do. Imports numpy, numba and itself only."""
