"""What comes after the DI, off by default: compressor, valve stage and impulse response, on the mix of a bass."""
