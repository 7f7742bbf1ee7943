"""Everything numba compiles for playing: how a string moves and what hands do to it. Imports only the compiler."""
