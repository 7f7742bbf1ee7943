"""What it costs on this machine."""
