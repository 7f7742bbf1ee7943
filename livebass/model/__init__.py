"""The physics of a bass in SI units: strings, necks, pickups, player; modes and dampings; a pluck and its motion."""
