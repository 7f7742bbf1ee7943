"""From the motion of a string to a voltage: the coil's circuit and its tone pot."""
