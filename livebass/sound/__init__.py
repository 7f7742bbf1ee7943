"""Sound in files, its loudness, pitch and spectra."""
