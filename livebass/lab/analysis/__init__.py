"""Analyses a sound or a motion: spectra, pitch, shapes, energies."""
