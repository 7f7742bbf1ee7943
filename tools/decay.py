"""Prints a preset's T60 by octave, for open and stopped notes, beside recordings: sound files, or folders of them.

python tools/decay.py jazz-finger ~/notes-of-a-real-bass
"""

from __future__ import annotations

import argparse
import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

import numpy as np
from errors import clear_errors

from livebass.engine.solve import output_signal
from livebass.lab.comparison.ringing import OCTAVES, ringing
from livebass.lab.identification.partials import find_takes, pitch_of, read_recording
from livebass.model.instrument import Instrument, Pluck, speaking
from livebass.model.modes import frequencies, grazing_apex
from livebass.model.trial import Trial
from livebass.preset.load import load_preset
from livebass.report.text import columns
from livebass.rows.arrays import Floats
from livebass.rows.units import cents

FRETS = (2, 4, 5, 7, 9, 12)  # stopped notes of a preset
RATE, CONTACT_RATE = 48_000, 384_000  # Hz
SECONDS, MINIMUM = 3.0, 1.0  # s: the length of a preset's note; the least of a recording's
SOFT, FARTHEST = 0.3, 1e-3  # of the grazing apex; m at most: no note touches a fret
PITCHES = (30.0, 400.0)  # Hz, for recordings
SOUNDS = {".wav", ".flac", ".ogg", ".aif", ".aiff"}


@dataclass(frozen=True)
class Note:
    """A note's partials: frequencies (Hz) and T60 (s), (n,) each, and whether its string is open."""

    open: bool
    frequency: Floats
    t60: Floats


def preset_notes(bass: Instrument, frets: Sequence[int] = FRETS, seconds: float = SECONDS) -> list[Note]:
    """Plucks `bass` softly on every string, open and at `frets`, for `seconds`; returns the notes."""
    notes = []
    for string, neck in zip(bass.strings, bass.necks, strict=True):
        for fret in (0, *(k for k in frets if k <= len(neck.fret_positions))):
            s = speaking(string, neck, fret)
            at = s.length - (1 - bass.player.pluck_position) * string.length
            apex = min(SOFT * grazing_apex(s, at), FARTHEST)
            nu = frequencies(s, s.grid_points - 1)
            count = max(1, int(np.searchsorted(nu, RATE / 2)))
            pluck = Pluck(apex, at, bass.player.rounding)
            sensor = s.length - bass.output.sensor
            trial = Trial(s, pluck, min(count, nu.size), CONTACT_RATE, RATE, seconds, sensor)
            notes.append(Note(fret == 0, *_rings(output_signal(trial, bass.output), RATE, float(nu[0]))))
    return notes


def recorded_notes(paths: Sequence[Path], bass: Instrument) -> list[Note]:
    """Returns the notes of recordings, files or folders of them.

    A recording does not name its string, so "open" is a note with the pitch of an open string of `bass`. Files
    without a pitched note of `MINIMUM` seconds are skipped. Raises RecordingError for a file that cannot be read.
    """
    files = []
    for path in paths:
        inside = sorted(p for p in path.rglob("*") if p.suffix.lower() in SOUNDS) if path.is_dir() else [path]
        files += inside
    opens = [s.frequency(s.open_note) for s in bass.strings]
    notes = []
    for file in files:
        for take in find_takes(read_recording(file), 0.0, 10.0):
            if take.duration_s < MINIMUM:
                continue
            pitch = pitch_of(take, *PITCHES)
            if pitch is None:
                continue
            like_open = any(abs(cents(pitch / hertz)) < 60 for hertz in opens)
            notes.append(Note(like_open, *_rings(take.sound, take.rate, pitch)))
    return notes


def _rings(sound: Floats, rate: float, f0: float) -> tuple[Floats, Floats]:
    """Returns frequencies (Hz) and T60 (s), (n,) each, of a note's partials."""
    found = ringing(sound, rate, f0)
    return found.frequency, found.t60


def by_octave(notes: Sequence[Note]) -> Floats:
    """Returns the median T60 (s) of the partials in each octave, (7,); NaN if there are fewer than three."""
    if not notes:
        return np.full(len(OCTAVES) - 1, np.nan)
    nu, t60 = (np.concatenate([getattr(note, name) for note in notes]) for name in ("frequency", "t60"))
    inside = [t60[(nu >= low) & (nu < high)] for low, high in pairwise(OCTAVES)]
    return np.array([np.median(each) if each.size >= 3 else math.nan for each in inside])


def table(groups: Sequence[tuple[str, Sequence[Note]]]) -> str:
    """Returns a table of T60 (s) by octave for named groups of notes: open, stopped and their ratio."""
    rows = [("T60, s", "notes", *(f"{low:g}-{high:g} Hz" for low, high in pairwise(OCTAVES)))]
    for name, notes in groups:
        parts = [n for n in notes if n.open], [n for n in notes if not n.open]
        seconds = [by_octave(part) for part in parts]
        for kind, part, each in zip(("open", "stopped"), parts, seconds, strict=True):
            rows.append((f"{name}, {kind}", str(len(part)), *(_shown(v) for v in each)))
        rows.append((f"{name}, stopped / open", "", *(_shown(v, 2) for v in seconds[1] / seconds[0])))
    return "\n".join(columns(rows))


def _shown(value: float, digits: int = 1) -> str:
    return "-" if math.isnan(value) else f"{value:.{digits}f}"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("preset", nargs="?", default="jazz-finger", help="name or file; default: jazz-finger")
    parser.add_argument("recordings", nargs="*", type=Path, help="sound files of single notes, or folders")
    options = parser.parse_args()
    with clear_errors("decay.py"):
        bass = load_preset(options.preset)
        groups = [(bass.name, preset_notes(bass))]
        if options.recordings:
            groups.append(("recordings", recorded_notes(options.recordings, bass)))
    print(table(groups))
    if options.recordings:
        print("of recordings, open is what sounds like an open string: they do not tell their string")


if __name__ == "__main__":
    main()
