"""The player: turns MIDI messages into string events."""
