"""Notes with times: from a Standard MIDI File, from a list of notes, or demo phrases."""
