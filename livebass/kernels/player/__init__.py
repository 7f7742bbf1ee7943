"""Who plays: MIDI messages become events of the strings."""
