"""What is seen in a sound or a motion: spectra, pitch, shapes, energies."""
