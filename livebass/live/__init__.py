"""Playing live: devices, stage, session."""
