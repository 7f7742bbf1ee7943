"""A brute-force solver, written from the equations, to check the engine."""
