"""Everything numba compiles for playing: the string's motion and the hands' actions. Imports only the compiler."""
