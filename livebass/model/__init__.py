"""What a bass is, in SI values: strings, necks, pickups, player; its modes; a pluck and its motion."""
