"""How a string moves: its modes, what it touches, and how its end travels. Equations: Issanchou et al. (2018)."""
