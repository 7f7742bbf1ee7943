"""Describes a bass in SI units: strings, necks, pickups, player; its modes; a pluck and its motion."""
