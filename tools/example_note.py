"""Renders a soft, a medium and a hard note to arrays, and prints how much the frets add above 2 kHz.

python tools/example_note.py [preset]
"""

from __future__ import annotations

import sys

import numpy as np

import livebass

RATE = 48000  # Hz

try:
    bass = livebass.load_preset(sys.argv[1] if len(sys.argv) > 1 else "jazz-finger")
except (ValueError, LookupError, OSError) as error:
    sys.exit(f"example_note.py: {error}")
for velocity in (30, 70, 127):
    score = livebass.single_note(43, velocity, 1.0, RATE)  # G2 for a second
    strings = livebass.render_to_array(bass, score, livebass.QUALITIES["live"])  # (n_strings, n_frames)
    mix = strings.sum(axis=0)
    spectrum = np.abs(np.fft.rfft(mix)) ** 2
    high = np.fft.rfftfreq(len(mix), 1 / RATE) > 2000
    share = 10 * np.log10(spectrum[high].sum() / spectrum.sum())
    print(f"velocity {velocity:3}: peak {np.abs(mix).max():.3f} of full scale, {share:6.1f} dB above 2 kHz")
