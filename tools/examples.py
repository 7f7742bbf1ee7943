"""Writes the files that README.md's commands use: song.mid, a bass line, and cabinet.wav, an impulse response.

python tools/examples.py [folder]
"""

from __future__ import annotations

import sys
from pathlib import Path

import mido
import numpy as np
import soundfile

LINE = (28, 28, 40, 38, 28, 31, 33, 34) * 4  # MIDI notes: E1 E1 E2 D2 E1 G1 A1 A#1
EIGHTH, TEMPO, PROGRAM = 240, 96, 33  # ticks; beats a minute; General MIDI's fingered bass, from 0
RATE, LENGTH = 48_000, 0.05  # Hz, s


def song(place: Path) -> None:
    """Writes four bars of eighth notes, ten seconds, getting louder."""
    track = mido.MidiTrack()
    track.append(mido.MetaMessage("set_tempo", tempo=mido.bpm2tempo(TEMPO)))
    track.append(mido.MetaMessage("track_name", name="Bass"))
    track.append(mido.Message("program_change", program=PROGRAM))
    for k, key in enumerate(LINE):
        track.append(mido.Message("note_on", note=key, velocity=50 + 2 * k, time=EIGHTH // 8 if k else 0))
        track.append(mido.Message("note_off", note=key, velocity=64, time=EIGHTH * 7 // 8))
    mido.MidiFile(tracks=[track], ticks_per_beat=2 * EIGHTH, type=0).save(place)


def cabinet(place: Path) -> None:
    """Writes a rough single-speaker cabinet response: resonances at 70 and 900 Hz, nothing above 4 kHz."""
    t = np.arange(round(LENGTH * RATE)) / RATE
    found = sum(
        level * np.exp(-decay * t) * np.sin(2 * np.pi * hertz * t)
        for hertz, decay, level in ((70, 180, 0.1), (900, 2500, 0.5), (2600, 6000, 0.5))
    )
    soundfile.write(place, 0.2 * found, RATE, subtype="FLOAT")


def main() -> None:
    folder = Path(sys.argv[1]) if len(sys.argv) > 1 else Path()
    song(folder / "song.mid")
    cabinet(folder / "cabinet.wav")


if __name__ == "__main__":
    main()
