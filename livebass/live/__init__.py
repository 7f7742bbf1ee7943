"""Playing live: devices, synth, session."""
