"""Effects after the DI, off by default: compressor, valve stage and impulse response, on a bass's mix."""
