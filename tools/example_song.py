"""Renders a line written as numbers, or a MIDI file, to song.wav.

python tools/example_song.py [song.mid]
"""

from __future__ import annotations

import sys
from pathlib import Path

import livebass

RATE = 48000  # Hz
BEAT = 60 / 100  # s

if len(sys.argv) > 1:
    try:
        score = livebass.read_score(sys.argv[1], RATE)
    except (ValueError, OSError) as error:
        sys.exit(f"example_song.py: {error}")
else:
    pitches = (28, 28, 40, 38, 28, 31, 33, 34)  # MIDI notes: E1 E1 E2 D2 E1 G1 A1 A#1
    line = [(k * BEAT / 2, BEAT / 2.2, note, 60 + 8 * k) for k, note in enumerate(pitches)]
    score = livebass.score_of(line, RATE)  # (start s, length s, note, velocity)

report = livebass.render_to_file(
    livebass.load_preset("precision-finger"),
    score,
    Path("song.wav"),
    quality=livebass.quality_with("studio"),
    rate=RATE,
)
print(f"song.wav: {report.notes} notes, {report.duration_s:.1f} s in {report.wall_s:.1f} s")
