"""The machine and its system: cores, signals, optional packages."""
