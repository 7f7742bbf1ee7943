"""What the audio thread runs: compiled, without allocation, lock or file."""
