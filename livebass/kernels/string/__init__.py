"""The string's motion: its modes, its contacts, and its moving end. Equations: Issanchou et al. (2018)."""
