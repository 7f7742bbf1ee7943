"""Measures a phrase: ends of notes, ghost notes, what sounds between notes, and the spread of repeated notes.

Levels are those of windows of 20 ms, every 2.5 ms. A stroke is a rise by 10 dB, of the whole or of 0.7 to 6 kHz. It is
a note if it holds for 0.1 s. Shorter strokes are ghost notes, unless they end a note that still sounds: then they are
its release. A note ends where its level falls by 12 dB within 60 ms before the next stroke. All levels are relative to
a medium note: the median over the notes of the mean level of their first 0.15 s.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np

from livebass.lab.identification.partials import Take, pitch_of
from livebass.rows.arrays import Floats
from livebass.rows.units import cents

WINDOW, HOP = 0.02, 0.0025  # s
STROKES, HIGHS = (700.0, 6000.0), (1500.0, 4000.0)  # Hz
RISE, APART = 10.0, 0.05  # dB of a stroke over what sounded before; s between strokes
BEFORE = (0.06, 0.015)  # s before a stroke that tell what sounded
DEEPEST = 70.0  # dB below the loudest: nothing
HELD, HOLDS = 0.1, 12.0  # s for which a note holds its loudest level, within dB
BODY = 0.15  # s of a note that tell its level
FAINTEST = 20.0  # dB below the loudest notes: softer strokes are no notes
FADED = 30.0  # dB below the loudest notes: there nothing sounds that could end
GHOST = 18.0  # dB below a medium note: softer short sounds lie between notes
FALL, WITHIN = 12.0, 0.06  # dB and s: so fast ends a note
FITTED = (5.0, 25.0)  # dB below a note's last level, over which its end is fitted
OVER = 6.0  # dB over what is left after an end
BURST = 0.03  # s, of the peak of an end in HIGHS
SETTLED, AHEAD = 0.03, 0.03  # s after an end and before a stroke that do not count as between notes
SHORTEST, BRIEFEST = 0.06, 0.01  # s, between notes, and of a sound there
STANDS = 8.0  # dB over the quiet before it: a sound of its own
CENTROID = 0.04  # s
PITCHES = (25.0, 500.0)  # Hz
REPEATED = 3  # notes of one key


@dataclass(frozen=True)
class End:
    """How a note ends."""

    rate: float  # dB/s, of its fall
    burst: float  # dB re a medium note, the peak of HIGHS over 30 ms
    jump: float  # dB, that peak over the level of HIGHS before


@dataclass(frozen=True)
class Short:
    """A ghost note, or a sound between notes."""

    level: float  # dB re a medium note, its loudest 20 ms
    centroid: float  # Hz, over 40 ms
    length: float  # s, within 12 dB of its loudest


@dataclass(frozen=True)
class Struck:
    """A note of a phrase."""

    start: float  # s
    key: int  # MIDI, 0 if no pitch is heard
    level: float  # dBFS
    centroid: float  # Hz, of its first 40 ms


@dataclass(frozen=True)
class Phrase:
    """The figures of one recorded phrase."""

    notes: tuple[Struck, ...]
    ends: tuple[End, ...] = ()
    ghosts: tuple[Short, ...] = ()
    between: tuple[Short, ...] = ()
    gaps: int = 0  # long enough to hear what sounds between notes


@dataclass
class _Levels:
    """Levels of a sound over time, dB, every HOP from half a window on."""

    sound: Floats
    rate: int
    whole: Floats = field(init=False)
    strokes: Floats = field(init=False)
    highs: Floats = field(init=False)

    def __post_init__(self) -> None:
        size = 1 << (self.sound.size - 1).bit_length()
        spectrum, nu = np.fft.rfft(self.sound, size), np.arange(size // 2 + 1) * self.rate / size

        def band(low: float, high: float) -> Floats:
            return np.fft.irfft(spectrum * ((nu >= low) & (nu < high)), size)[: self.sound.size]

        self.whole = self._level(self.sound, WINDOW)
        self.strokes = self._level(band(*STROKES), WINDOW / 2)
        self.highs = self._level(band(*HIGHS), BURST)

    def _level(self, sound: Floats, window: float) -> Floats:
        n, count = round(window * self.rate), int(self.sound.size / self.rate / HOP)
        total = np.cumsum(np.concatenate([[0.0], np.pad(sound, (n // 2, n)) ** 2]))
        first = np.round(np.arange(count) * HOP * self.rate).astype(np.int64)
        level = 10 * np.log10((total[first + n] - total[first]) / n + 1e-14)
        return np.maximum(level, level.max() - DEEPEST)

    def centroid(self, middle: float) -> float:
        """The centroid of CENTROID around a time (s), weighted with power, Hz."""
        n = round(CENTROID * self.rate)
        first = min(max(0, round(middle * self.rate) - n // 2), max(0, self.sound.size - n))
        piece = self.sound[first : first + n]
        power = np.abs(np.fft.rfft(piece * np.hanning(piece.size), 4 * n)) ** 2
        nu = np.arange(power.size) * self.rate / (4 * n)
        return float(power @ nu / max(float(power.sum()), 1e-30))


def measure_phrase(sound: Floats, rate: int) -> Phrase:
    """Measures a phrase: `sound` (n,), full scale 1, of one voice, at `rate` (Hz).

    Raises ValueError for a sound that is silent, not finite or shorter than 0.3 s.
    """
    if sound.size < 0.3 * rate or not np.isfinite(sound).all() or not sound.any():
        raise ValueError("a phrase is at least 0.3 s of sound")
    levels = _Levels(np.asarray(sound, np.float64), rate)
    starts = _strokes(levels)
    limits = [*starts, levels.whole.size]
    notes, shorts = _sorted(levels, limits)
    struck = tuple(_struck(levels, starts[k], limits[k + 1]) for k in notes)
    if not struck:
        return Phrase(())
    medium = float(np.median([note.level for note in struck]))
    heard = [(starts[k], _short(levels, starts[k], limits[k + 1], medium)) for k in shorts]
    loud = [(at, short) for at, short in heard if short.level > -GHOST]  # softer ones are found between notes
    ghosts = [(at, short) for at, short in loud if short.length >= BRIEFEST]
    begins = sorted([*(starts[k] for k in notes), *(at for at, _ in ghosts)])
    ends, between, gaps = [], [], 0
    for k in notes:
        stop = next((b for b in begins if b > starts[k]), levels.whole.size)
        end = _end(levels, starts[k], stop, medium)
        if end is not None:
            ends.append(end[0])
            first, last = end[1] + _frames(SETTLED), stop - _frames(AHEAD)
            if last - first >= _frames(SHORTEST):
                gaps += 1
                found = _between(levels, first, last, medium)
                if found and found.level > -GHOST:
                    ghosts.append((first, found))
                elif found:
                    between.append(found)
    return Phrase(struck, tuple(ends), tuple(short for _, short in ghosts), tuple(between), gaps)


def _frames(seconds: float) -> int:
    return round(seconds / HOP)


def _sorted(levels: _Levels, limits: Sequence[int]) -> tuple[list[int], list[int]]:
    """Returns the indices of strokes that are notes, and of short ones; `limits` are their frames and the last one."""
    held = _frames(HELD)
    first = [levels.whole[at : min(at + held, stop)] for at, stop in pairwise(limits)]
    reference = float(np.percentile([part.max() for part in first], 80)) if first else 0.0
    notes: list[int] = []
    shorts: list[int] = []
    for k, part in enumerate(first):
        lasts = part.size >= 0.8 * held and part[-(held // 4) :].mean() > part.max() - HOLDS
        if lasts and part.max() > reference - FAINTEST:
            notes.append(k)
        elif not (notes and notes[-1] == k - 1 and _ends(levels, limits[k], reference)):
            shorts.append(k)
    return notes, shorts


def _strokes(levels: _Levels) -> list[int]:
    """Returns the frames in which strokes begin."""
    far, near = map(_frames, BEFORE)

    def rises(level: Floats) -> Floats:
        padded = np.concatenate([np.full(far, level.min()), level])
        return level - np.median(np.lib.stride_tricks.sliding_window_view(padded, far - near)[: level.size], axis=1)

    rise = np.maximum(rises(levels.strokes), rises(levels.whole))
    found: list[int] = []
    for k in np.flatnonzero((rise[1:-1] >= RISE) & (rise[1:-1] >= rise[:-2]) & (rise[1:-1] > rise[2:])) + 1:
        if found and k - found[-1] < _frames(APART):
            continue
        found.append(int(k))
    return found


def _ends(levels: _Levels, at: int, loud: float) -> bool:
    """Returns whether a rise of the highs is the end of a note: the whole still sounds before it, and falls."""
    before = float(levels.whole[max(0, at - _frames(BEFORE[0])) : max(1, at - _frames(BEFORE[1]))].mean())
    after = levels.whole[at + _frames(WITHIN) : at + 2 * _frames(WITHIN)]
    return before > loud - FADED and after.size > 0 and float(after.mean()) < before - FALL / 2


def _struck(levels: _Levels, at: int, stop: int) -> Struck:
    rate, start = levels.rate, at * HOP
    until = min(stop * HOP, start + 0.5)
    piece = levels.sound[round(start * rate) : round(until * rate)]
    body = piece[: round(BODY * rate)]
    pitch = pitch_of(Take("", start, piece, rate), *PITCHES) if piece.size > 0.1 * rate else None
    key = round(69 + cents(pitch / 440) / 100) if pitch else 0
    level = 10 * math.log10(float(np.mean(body**2)) + 1e-14)
    return Struck(start, key, level, levels.centroid(start + CENTROID / 2))


def _end(levels: _Levels, at: int, stop: int, medium: float) -> tuple[End, int] | None:
    """Returns the end of a note that begins at a frame, and the frame where it is over; None if it rings on."""
    whole, span = levels.whole, _frames(WITHIN)
    places = np.arange(at + _frames(HELD) // 2, max(at, stop - span))
    falls = whole[places] - whole[places + span] if places.size else np.zeros(0)
    if not falls.size or falls.max() < FALL:
        return None
    first = int(places[np.argmax(falls >= FALL)])
    last_level = float(np.mean(whole[max(at, first - _frames(0.02)) : first + 1]))
    rest = whole[first:stop]
    left = float(rest.min())
    low = max(last_level - FITTED[1], left + OVER)
    below = int(np.argmax(rest <= low)) if (rest <= low).any() else rest.size - 1
    above = int(np.flatnonzero(rest[: below + 1] >= last_level - FITTED[0])[-1]) if below else 0
    if below - above < 3:
        return None
    rate = -float(np.polyfit(np.arange(above, below + 1) * HOP, rest[above : below + 1], 1)[0])
    around = levels.highs[max(0, first - _frames(0.01)) : min(first + below + _frames(BURST), stop)]
    before = levels.highs[max(at, first - _frames(0.08)) : max(at + 1, first - _frames(BURST))]
    burst = float(around.max())
    return End(rate, burst - medium, burst - float(np.median(before))), first + below


def _between(levels: _Levels, first: int, last: int, medium: float) -> Short | None:
    """Returns the loudest sound of a gap between notes that stands out of it; None without any."""
    part = levels.whole[first:last]
    rise = part - np.minimum.accumulate(part)
    k = first + int(np.argmax(rise))
    if rise.max() < STANDS or k == last - 1:
        return None
    found = _shape(levels, k, first, last, medium)
    return found if found.length >= BRIEFEST else None  # else it is the edge of the next stroke


def _short(levels: _Levels, at: int, stop: int, medium: float) -> Short:
    first, last = max(0, at - _frames(APART) // 2), max(at + 1, min(at + _frames(APART), stop - _frames(AHEAD)))
    k = first + int(np.argmax(levels.whole[first:last]))
    return _shape(levels, k, first, max(last, stop - _frames(AHEAD)), medium)


def _shape(levels: _Levels, peak: int, first: int, last: int, medium: float) -> Short:
    """Returns a short sound whose loudest frame is `peak`."""
    loud = levels.whole[first:last] > levels.whole[peak] - HOLDS
    begin, end = peak - first, peak - first
    while begin > 0 and loud[begin - 1]:
        begin -= 1
    while end + 1 < loud.size and loud[end + 1]:
        end += 1
    return Short(float(levels.whole[peak]) - medium, levels.centroid(peak * HOP), (end - begin + 1) * HOP)


def spreads(notes: Sequence[Struck]) -> tuple[float, float]:
    """Returns the scatter of repeated notes: of their level, dB, and of their centroid, %; NaN without any.

    Medians over the keys with at least REPEATED notes, of standard deviations.
    """
    by_key = [[n for n in notes if n.key == key] for key in sorted({n.key for n in notes} - {0})]
    found = [same for same in by_key if len(same) >= REPEATED]
    if not found:
        return math.nan, math.nan
    level = float(np.median([np.std([n.level for n in same], ddof=1) for same in found]))
    bright = float(np.median([np.std([math.log(n.centroid) for n in same], ddof=1) for same in found]))
    return level, 100 * bright
