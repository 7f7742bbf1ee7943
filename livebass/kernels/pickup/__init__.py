"""From string motion to voltage: the coil's circuit and its tone pot."""
