"""The code that runs on the audio thread: compiled, without allocation, lock or file."""
