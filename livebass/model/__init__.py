"""The physics of a bass in SI values: strings, necks, pickups, player; modes and dampings; a pluck and its motion."""
