"""Measures how long the partials of plucked notes ring: T60 by octave, of a preset and of recordings, the same way.

A partial's level is read in windows of four periods of the note, whose zeros lie on the other partials, and a straight
line is put through it from 0.1 s on, down to 30 dB below. What stands out of the noise between the partials by less
than 10 dB is left out.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

import numpy as np

from livebass.arrays import Floats
from livebass.engine.solve import heard
from livebass.identification.partials import find_takes, median_line, pitch_of, read_recording
from livebass.model.instrument import Instrument, Pluck, speaking
from livebass.model.modes import frequencies, grazing_apex
from livebass.model.trial import Trial
from livebass.report.text import columns
from livebass.units import cents

OCTAVES = (50.0, 100.0, 200.0, 400.0, 800.0, 1600.0, 3200.0, 6400.0)  # Hz
FRETS = (2, 4, 5, 7, 9, 12)  # stopped notes of a preset
RATE, CONTACT_RATE = 48_000, 384_000  # Hz
SECONDS, LEAST = 3.0, 1.0  # s of a note, of a preset and of a recording at least
SOFT, FARTHEST = 0.3, 1e-3  # of the grazing apex, and m at most: no note touches a fret
PERIODS = 4  # of a note in a window
FROM, DOWN = 0.1, 30.0  # s after the attack; dB
FAINTEST, CLEAR = 60.0, 10.0  # dB below the loudest partial; dB over the noise between partials
NEAR = 0.12  # of f0: a partial is looked for so near to where it is expected
SHORTEST = 0.15  # s of decay, or nothing is said about it
PITCHES = (30.0, 400.0)  # Hz, of recordings
SOUNDS = {".wav", ".flac", ".ogg", ".aif", ".aiff"}


@dataclass(frozen=True)
class Note:
    """A note's partials: frequencies (Hz) and T60 (s), (n,) each, and whether its string is open."""

    open: bool
    frequency: Floats
    t60: Floats


def ringing(sound: Floats, rate: float, f0: float) -> tuple[Floats, Floats]:
    """Returns frequencies (Hz) and T60 (s), (n,) each, of the partials of `sound` (samples,), a note of f0 (Hz) to 3 %.

    The sound begins with the attack. Partials that are too faint, too short or do not decay are left out.
    """
    found = _partials(sound, rate, f0)
    if not found.size:
        return np.zeros(0), np.zeros(0)
    window = min(round(PERIODS * rate / f0), sound.size)
    hop = max(1, window // 8)
    starts = np.arange(round(FROM * rate), sound.size - window + 1, hop)
    frames = sound[starts[:, None] + np.arange(window)] * np.hanning(window + 1)[:-1]
    t = np.arange(window) / rate

    def level(nu: Floats) -> Floats:
        """Returns the levels (frames, nu), dB."""
        return np.asarray(20 * np.log10(np.abs(frames @ np.exp(-2j * math.pi * np.outer(t, nu))) + 1e-30))

    if starts.size < 2:
        return np.zeros(0), np.zeros(0)
    tones, noise = level(found), level(found + f0 / 2)
    kept, seconds = [], []
    for k in range(found.size):
        start = tones[0, k]
        if start < tones[0].max() - FAINTEST:
            continue
        clear = (tones[:, k] > start - DOWN) & (tones[:, k] > np.median(noise[-8:, k]) + CLEAR)
        count = int(np.argmin(clear)) if not clear.all() else clear.size
        if (count - 1) * hop < SHORTEST * rate or count < 4:
            continue
        slope = float(np.polyfit(np.arange(count) * hop / rate, tones[:count, k], 1)[0])  # dB/s
        if slope < -0.1:
            kept.append(found[k])
            seconds.append(-60 / slope)
    return np.array(kept), np.array(seconds)


def _partials(sound: Floats, rate: float, f0: float) -> Floats:
    """Returns the frequencies (Hz) of the partials up to the last octave, each near where those before put it."""
    size = min(sound.size, round(1.0 * rate))
    padded = 4 * 2 ** math.ceil(math.log2(size))
    spectrum = np.abs(np.fft.rfft(sound[:size] * np.hanning(size), padded))
    step = rate / padded
    numbers: list[int] = []
    found: list[float] = []
    for j in range(1, int(min(OCTAVES[-1], 0.45 * rate) / f0) + 1):
        expected = j * f0
        if found:
            number, near = np.array(numbers[-12:], np.float64), np.array(found[-12:])
            slope, at_zero = median_line(number**2, near / number) if near.size > 3 else (0.0, near[-1] / number[-1])
            expected = j * (at_zero + slope * j**2)
        low, high = round((expected - NEAR * f0) / step), round((expected + NEAR * f0) / step) + 1
        if high + 1 >= spectrum.size:
            break
        k = low + int(np.argmax(spectrum[low:high]))
        # a partial is a peak, not the flank of another, and stands out of what lies between the partials
        valley = np.median(spectrum[max(0, round((expected - 0.6 * f0) / step)) : round((expected - 0.4 * f0) / step)])
        if low < k < high - 1 and spectrum[k] > 4 * valley:
            numbers.append(j)
            found.append(k * step)
    return np.array(found)


def preset_notes(bass: Instrument, frets: Sequence[int] = FRETS, seconds: float = SECONDS) -> list[Note]:
    """Plucks `bass` softly on every string, open and at `frets`, for `seconds`, and returns the notes."""
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
            notes.append(Note(fret == 0, *ringing(heard(trial, bass.output), RATE, float(nu[0]))))
    return notes


def recorded_notes(paths: Sequence[Path], bass: Instrument) -> list[Note]:
    """Returns the notes of recordings, files or folders of them.

    A recording does not tell its string, so "open" is what sounds like an open string of `bass`. Files without a note
    of `LEAST` seconds with a pitch are left out. Raises RecordingError for a file that cannot be read.
    """
    files = []
    for path in paths:
        inside = sorted(p for p in path.rglob("*") if p.suffix.lower() in SOUNDS) if path.is_dir() else [path]
        files += inside
    opens = [s.frequency(s.open_note) for s in bass.strings]
    notes = []
    for file in files:
        for take in find_takes(read_recording(file), 0.0, 10.0):
            if take.duration_s < LEAST:
                continue
            pitch = pitch_of(take, *PITCHES)
            if pitch is None:
                continue
            like_open = any(abs(cents(pitch / hertz)) < 60 for hertz in opens)
            notes.append(Note(like_open, *ringing(take.sound, take.rate, pitch)))
    return notes


def by_octave(notes: Sequence[Note]) -> Floats:
    """Returns the median T60 (s) of the partials in each octave, (7,); NaN where there are fewer than three."""
    if not notes:
        return np.full(len(OCTAVES) - 1, np.nan)
    nu, t60 = (np.concatenate([getattr(note, name) for note in notes]) for name in ("frequency", "t60"))
    inside = [t60[(nu >= low) & (nu < high)] for low, high in pairwise(OCTAVES)]
    return np.array([np.median(each) if each.size >= 3 else math.nan for each in inside])


def table(groups: Sequence[tuple[str, Sequence[Note]]]) -> str:
    """Shows T60 (s) by octave of groups of notes, given by name: open, stopped and the ratio of the two."""
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
