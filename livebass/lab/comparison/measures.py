"""Measures one note: its attack, touch, pitch and decay as players hear them, as named figures.

Times are in s from the attack, where the sound first comes within 30 dB of its peak. Spectra use Hann windows unless
stated otherwise, centroids are weighted with power (eq. 14 of C. Issanchou et al., 2018), and bands are cut out of the
Fourier transform of the whole note. A figure that the note is too short for, or does not show, is NaN with a reason:
never a guess.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from livebass.lab.comparison.floor import SHAPE, density, typical
from livebass.lab.comparison.ringing import HIGHEST, NO_RINGING, Ringing, partials, ringing
from livebass.lab.comparison.ringing import OCTAVES as T60_OCTAVES
from livebass.rows.arrays import Complexes, Floats, Ints
from livebass.rows.bounds import one_of, refusal, within
from livebass.rows.units import cents
from livebass.sound.analysis import partial

PITCH = (20.0, 700.0)  # Hz, of a note
ATTACK = 30.0  # dB below the peak
BEGUN = 0.3  # of the peak: a file that begins as loud begins within its note
SHORTEST = 0.05  # s of a note
PEAK = 0.5  # s to search for the peak
LEVEL = 0.05  # s, averaged for the level after 1 s and 2 s
BODY = 0.3  # s, to compare bands
WINDOW = 0.04  # s, for a centroid
EDGES = (300.0, 700.0, 1500.0, 3000.0, 6000.0)  # Hz, of the bands; the first begins at 1.5 f0
OCTAVES = (31.25, 62.5, 125.0, 250.0, 500.0, 1000.0, 2000.0, 4000.0, 8000.0)  # Hz, centres
GAPS = (200.0, 500.0, 1500.0, 4000.0)  # Hz: between partials
AT_ONCE = 6  # periods in a window at 50 ms
GLIDING = 5  # partials
EARLY, LATE, STEADY = (0.05, 0.11), (0.13, 0.23), (0.8, 1.5)  # s, of glides
GLIDE_PERIODS = 4.5  # in a window of a glide, at least
STABLE, WILDEST = 15.0, 200.0  # cents: between halves of the steady part; of a glide
WAVER = (0.1, 0.6)  # s
WAVERING = (5, 12)  # partials
FRAME = 0.01  # s, for the level of a high band
TURNING = 6  # periods in a window that follows the fundamental, at least 50 ms
DIP, DRIFT = (0.15, 2.4), (0.15, 1.2)  # s, in which the fundamental dips and drifts
FADED = 40.0  # dB below its loudest: there the fundamental is too faint to dip
LINES, APART = (60.0, 700.0), 0.2  # Hz, of lines between partials; fundamentals from every partial
RATTLING = (1500.0, 6000.0)  # Hz, the band that bends and returns
BEND = ((0.03, 0.25), (0.5, 1.4))  # s, its early and late fall
RETURN = (0.12, 1.5)  # s, in which it rises again
BURST, BURST_HOP = 0.03, 0.01  # s, of a window on it
FLOOR = 65.0  # dB below its loudest: fainter bursts count as that
HISS, MUSIC = (10_000.0, 16_000.0), (30.0, 8000.0)  # Hz
HISSING = (0.4, 0.6)  # s
KNOWN = 0.47  # of the rate: recordings have no higher frequencies
# Hz, bands of the noise floor
FLOORS = ((200.0, 500.0), (500.0, 1500.0), (1500.0, 4000.0), (4000.0, 8000.0), HISS)
FALL = 20.0  # dB, by which a muted note falls

LEVEL_KEYS = ("level_1s", "level_2s")
BAND_KEYS = ("band_low", "band_300", "band_700", "band_1500", "band_3000")
GLIDE_KEYS = tuple(f"glide_{when}" for when in ("early", "late"))
NOISE_KEYS = ("between_200", "between_500", "between_1500")
FLOOR_KEYS = tuple(f"floor_{low:.0f}" for low, _ in FLOORS)
FUNDAMENTAL_KEYS = ("dip", "drift")
BURST_KEYS = ("bend", "returns")
HIGH_KEYS = ("high_100", "high_200", "high_400")
T60_KEYS = tuple(f"t60_{low:.0f}" for low in T60_OCTAVES[:-1])
SHARE_KEYS = tuple(f"octave_{middle:.0f}" for middle in OCTAVES)


@dataclass(frozen=True)
class Measures(Mapping[str, float]):
    """The figures of a note by name, as a mapping; NaN where `missing` has a reason."""

    figures: dict[str, float]
    missing: dict[str, str]
    pitch: float  # Hz, of the fundamental
    ringing: Ringing  # its partials

    def __getitem__(self, key: str) -> float:
        return self.figures[key]

    def __iter__(self) -> Iterator[str]:
        return iter(self.figures)

    def __len__(self) -> int:
        return len(self.figures)


class _Unknown(Exception):
    """The reason why a note does not show a figure."""


@dataclass(frozen=True)
class _Note:
    """A note from its attack on."""

    sound: Floats
    rate: float  # Hz
    pitch: float  # Hz
    begun: bool  # the attack is cut off
    numbers: Ints  # of the partials found
    partials: Floats  # Hz

    def until(self, end: float) -> None:
        """Raises _Unknown if the note ends before `end` (s)."""
        if self.sound.size < math.floor(end * self.rate):
            raise _Unknown(f"{self.sound.size / self.rate:.2f} s long: {end:.2g} s are needed")

    def attacked(self) -> None:
        """Raises _Unknown if the attack is cut off."""
        if self.begun:
            raise _Unknown("the recording begins within the note")

    def part(self, begin: float, end: float) -> Floats:
        """Returns the samples from `begin` to `end` (s), which must exist."""
        self.until(end)
        return self.sound[round(begin * self.rate) : round(end * self.rate)]

    @cached_property
    def spectrum(self) -> Complexes:
        """The Fourier transform of the whole note, with at least 0.1 s of silence behind it."""
        size = 1 << (self.sound.size + round(0.1 * self.rate) - 1).bit_length()
        return np.asarray(np.fft.rfft(self.sound, size))

    def band(self, low: float, high: float) -> tuple[Floats, float]:
        """Returns the part from `low` to `high` Hz, (n,), and its rate, Hz: that of the note over a power of two."""
        size = 2 * (self.spectrum.size - 1)
        first, last = (min(math.ceil(edge * size / self.rate), size // 2) for edge in (low, high))
        short = max(2, 1 << (2 * last).bit_length())  # more than two samples in a period of `high`
        short = min(short, size)
        kept = np.zeros(short // 2 + 1, np.complex128)
        kept[first:last] = self.spectrum[first:last]
        fewer = size // short
        return np.fft.irfft(kept, short)[: math.ceil(self.sound.size / fewer)] / fewer, self.rate / fewer

    @cached_property
    def low(self) -> _Note:
        """The note up to its sixteenth partial, at least 1 kHz, at a low rate."""
        return self.below(max(1000.0, 16 * self.pitch))

    def below(self, high: float) -> _Note:
        """Returns the note up to `high` Hz, at a rate that holds it."""
        sound, rate = self.band(0.0, high)
        return replace(self, sound=sound, rate=rate)

    def around(self, middle: float, length: float) -> Floats:
        """Returns the samples of a window; 0 before the attack."""
        n = round(length * self.rate)
        first = round(middle * self.rate) - n // 2
        self.until((first + n) / self.rate)
        return np.concatenate([np.zeros(max(0, -first)), self.sound[max(0, first) : first + n]])


def measure(sound: ArrayLike, rate: float, pitch: float, only: Collection[str] | None = None) -> Measures:
    """Measures `sound` (n,), full scale 1, `rate` in Hz: one note of `pitch` (Hz, to 3 %), with any lead-in.

    Returns figures by name (explained in `rows.ROWS`); a figure that the note does not show is NaN, with its reason in
    `missing`. `only` names the wanted figures: others are skipped if that saves time, and partials are followed only
    for T60. Raises ValueError for a sound that is silent, not finite, shorter than 50 ms or of more than one
    dimension, for an invalid rate or pitch, and for an unknown figure.
    """
    for key in sorted(only or ()):
        one_of("figure", key, sorted(KEYS))
    wanted = [(keys, function) for keys, function in PARTS if only is None or set(keys) & set(only)]
    note = _note(sound, rate, pitch)
    followed = any(function is _t60 for _, function in wanted)
    rings = NO_RINGING
    if followed:
        fewer = note.below(HIGHEST + note.pitch)
        rings = ringing(fewer.sound, fewer.rate, note.pitch, (note.numbers, note.partials))
    values: dict[str, float] = {}
    missing: dict[str, str] = {}
    for keys, function in wanted:
        try:
            found = function(note, rings)
        except _Unknown as reason:
            found = dict.fromkeys(keys, str(reason))
        for key in keys:
            value = found[key]
            values[key] = math.nan if isinstance(value, str) else float(value)
            if isinstance(value, str):
                missing[key] = value
    return Measures(values, missing, note.pitch, rings)


def attack(sound: Floats, rate: float) -> int:
    """Returns the first sample of a note: the first within 30 dB of the peak of its first half second."""
    loud = np.abs(sound)
    peak = float(loud[: round(PEAK * rate)].max())
    return int(np.argmax(loud >= peak * 10 ** (-ATTACK / 20)))


def begins_late(sound: Floats, rate: float) -> bool:
    """Returns whether a sound begins within its note: its attack is cut off."""
    return attack(sound, rate) == 0 and abs(sound[0]) > BEGUN * float(np.abs(sound[: round(PEAK * rate)]).max())


def _note(sound: ArrayLike, rate: float, pitch: float) -> _Note:
    samples = np.asarray(sound, np.float64)
    if samples.ndim != 1:
        raise refusal("sound", "of one dimension", f"of shape {samples.shape}: sum over strings or choose one")
    if not 8000 <= rate < math.inf:
        raise refusal("rate", "at least 8000 Hz", f"{rate:g} Hz")
    within("pitch", pitch, *PITCH, "Hz")
    if not np.isfinite(samples).all():
        raise ValueError("the sound has samples that are not finite numbers")
    if not samples.size or not np.abs(samples).max() > 0:
        raise ValueError("nothing sounds: there is nothing to measure")
    start = attack(samples, rate)
    begun = begins_late(samples, rate)
    samples = samples[start:]
    if samples.size < SHORTEST * rate:
        raise ValueError(f"{samples.size / rate:.3g} s of sound: at least {SHORTEST:g} s are needed")
    note = _Note(samples, float(rate), float(pitch), begun, np.zeros(0, np.int64), np.zeros(0))
    refined = _refine_pitch(note.low)
    numbers, found = partials(samples, rate, refined)
    completed = replace(note, pitch=refined, numbers=numbers, partials=found)
    completed.__dict__["spectrum"] = note.spectrum
    return completed


def _refine_pitch(low: _Note) -> float:
    """Returns the frequency of the fundamental (Hz) from 0.1 to 1 s, or the pitch of the note if none is found."""
    piece = low.sound[round(0.1 * low.rate) : round(1.0 * low.rate)]
    if piece.size * low.pitch < 8 * low.rate:
        return low.pitch
    found = partial(piece, low.rate, low.pitch)[0]
    return found if abs(found / low.pitch - 1) < 0.04 else low.pitch


def _db(power: float) -> float:
    """Returns 10 log10 of a power; raises _Unknown for zero."""
    if not power > 0:
        raise _Unknown("nothing sounds there")
    return 10 * math.log10(power)


def _power(sound: Floats) -> float:
    return float(np.mean(sound**2)) if sound.size else 0.0


def _spectrum(sound: Floats, rate: float, window: Floats, minimum: float = 1.0) -> tuple[Floats, Floats]:
    """Returns frequencies (bins,), at most `minimum` Hz apart, and power (bins,) of a windowed sound."""
    size = max(sound.size, math.ceil(rate / minimum))
    size = 1 << (size - 1).bit_length()
    return np.arange(size // 2 + 1) * rate / size, np.abs(np.fft.rfft(sound * window, size)) ** 2


def _hann(n: int) -> Floats:
    return np.asarray(np.hanning(n + 1)[:-1])


def _fade_window(n: int, fade: int) -> Floats:
    """Returns a window that is 1 and falls in its last `fade` samples."""
    window = np.ones(n)
    fade = min(fade, n)
    window[n - fade :] = 0.5 + 0.5 * np.cos(np.pi * (np.arange(fade) + 1) / (fade + 1))
    return window


def _levels(note: _Note, rings: Ringing) -> dict[str, Any]:
    """Peak and mean level, and the decay of the level after 1 s and 2 s."""
    start = note.sound[: round(PEAK * note.rate)]
    found: dict[str, Any] = {
        "peak": 20 * math.log10(float(np.abs(start).max())),
        "level": _db(_power(note.sound[: round(BODY * note.rate)])),
    }
    n = round(LEVEL * note.rate)
    total = np.cumsum(np.concatenate([[0.0], note.sound**2]))
    mean = (total[n:] - total[:-n]) / n
    if not mean.size:
        return found | dict.fromkeys((*LEVEL_KEYS, "fall_time"), "shorter than 50 ms")
    top = int(np.argmax(mean[: round(PEAK * note.rate)]))
    period = round(max(0.02, 1 / note.pitch) * note.rate)  # shorter than LEVEL, as a muted note may be
    swift = total[period:] - total[:-period]
    loudest = int(np.argmax(swift[: round(PEAK * note.rate)]))
    fallen = swift[loudest:] < swift[loudest] * 10 ** (-FALL / 10)
    found["fall_time"] = float(np.argmax(fallen)) / note.rate if fallen.any() else (
        f"it falls by less than {FALL:g} dB in {note.sound.size / note.rate:.2g} s"
    )  # fmt: skip
    for key, seconds in zip(LEVEL_KEYS, (1.0, 2.0), strict=True):
        k = top + round(seconds * note.rate)
        if k < mean.size and mean[k] > 0:
            found[key] = 10 * math.log10(mean[k] / mean[top])
        else:
            found[key] = f"{note.sound.size / note.rate:.2f} s long: {(k + n) / note.rate:.2g} s are needed"
    return found


def _t60(note: _Note, rings: Ringing) -> dict[str, Any]:
    """Median T60 of the partials of each octave, and their scatter from one to the next."""
    note.until(0.6)
    found: dict[str, Any] = {}
    for key, (low, high) in zip(T60_KEYS, pairwise(T60_OCTAVES), strict=True):
        inside = rings.between(low, high)
        found[key] = float(np.median(inside)) if inside.size else "no partial that decays clearly over the noise"
    steps = np.diff(np.log(rings.t60))
    found["t60_scatter"] = float(np.std(steps)) / math.sqrt(2) if steps.size >= 5 else "fewer than six partials"
    return found


def _bands(note: _Note, rings: Ringing) -> dict[str, Any]:
    """Levels of bands in the first 0.3 s relative to the fundamental."""
    piece = note.part(0.0, BODY)
    nu, power = _spectrum(piece, note.rate, _fade_window(piece.size, round(0.03 * note.rate)))
    base = float(power[(nu > 0.5 * note.pitch) & (nu < 1.5 * note.pitch)].sum())
    if not base > 0:
        raise _Unknown("no fundamental")

    def level(low: float, high: float) -> float | str:
        if high > 0.45 * note.rate:
            return f"rate {note.rate:g} Hz: nothing is known up to {high:g} Hz"
        inside = float(power[(nu >= low) & (nu < high)].sum())
        return 10 * math.log10(inside / base) if inside > 0 else "nothing sounds there"

    found: dict[str, Any] = {"growth": level(700.0, 3000.0)}
    edges = (1.5 * note.pitch, *EDGES)
    for key, (low, high) in zip(BAND_KEYS, pairwise(edges), strict=True):
        found[key] = level(low, high) if low < 0.9 * high else "the fundamental is in it"
    return found


def _centroids(note: _Note, rings: Ringing) -> dict[str, Any]:
    """Centroids at 20 and at 100 ms."""
    note.attacked()
    found: dict[str, Any] = {}
    for key, middle in (("centroid_20", 0.02), ("centroid_100", 0.1)):
        piece = note.around(middle, WINDOW)
        nu, power = _spectrum(piece, note.rate, _hann(piece.size), 10.0)
        found[key] = float(power @ nu / power.sum())
    found["centroid_fall"] = found["centroid_20"] / found["centroid_100"]
    return found


def _fundamental(note: _Note, rings: Ringing) -> dict[str, Any]:
    """Level of the fundamental at 100 ms over 20 ms, in windows of two periods, whose zeros lie on other partials."""
    note.attacked()
    n = round(2 * note.rate / note.pitch)
    turn = np.exp(-2j * math.pi * note.pitch * np.arange(n) / note.rate) * _hann(n)
    middle = max(0.02, 1 / note.pitch)
    before, after = (abs(np.sum(note.around(at, n / note.rate)[:n] * turn)) for at in (middle, 0.1))
    return {"fundamental_fall": _db(float(after) ** 2) - _db(float(before) ** 2)}


def _glides(note: _Note, rings: Ringing) -> dict[str, Any]:
    """Cents of partials 1 to 5, early and late, relative to 0.8 to 1.5 s."""
    note.until(STEADY[1])
    note = note.low
    each: dict[str, list[float]] = {key: [] for key in GLIDE_KEYS}
    half = (STEADY[0] + STEADY[1]) / 2
    step = 1.5 / note.pitch  # two thirds of the window are whole periods: its zeros lie on the other partials
    steady = note.part(*STEADY)
    found: dict[str, Any] = {}
    lines = [(j, *partial(steady, note.rate, j * note.pitch)) for j in range(1, GLIDING + 1)]
    loudest = max(level for _, _, level in lines)
    for j, nu, level in lines:
        clear = level > 1e-3 * loudest and abs(nu - j * note.pitch) < 0.1 * note.pitch
        halves = [
            partial(note.part(*ends), note.rate, nu)[0] for ends in ((STEADY[0], half), (half, STEADY[1]))
        ] if clear else []  # fmt: skip
        stable = bool(halves) and min(halves) > 0 and abs(cents(halves[1] / halves[0])) < STABLE
        for key, (begin, end) in zip(GLIDE_KEYS, (EARLY, LATE), strict=True):
            found[f"{key}_{j}"] = "the partial is faint or beats"
            if stable:
                length = step * math.ceil(max(end - begin, GLIDE_PERIODS / note.pitch) / step - 1e-6)
                first = max(0.0, (begin + end - length) / 2)  # a longer window, for a low note, has the same middle
                at = partial(note.part(first, first + length), note.rate, nu)[0]
                if at > 0 and abs(cents(at / nu)) < WILDEST:
                    found[f"{key}_{j}"] = cents(at / nu)
                    each[key].append(cents(at / nu))
    for key, values in each.items():
        found[key] = float(np.median(values)) if len(values) > 1 else "fewer than two steady partials"
    return found


def _fundamental_later(note: _Note, rings: Ringing) -> dict[str, Any]:
    """Deepest dip of the fundamental off a straight decay, and how far its frequency strays.

    In windows of six periods, whose zeros lie on the other partials, every 10 ms.
    """
    note.until(DRIFT[1])
    low, rate = note.low.sound, note.low.rate
    n = round(max(TURNING / note.pitch, 0.05) * rate)
    starts = np.round(np.arange(0.0, (low.size - n) / rate, 0.01) * rate).astype(np.int64)
    t = np.arange(n) / rate
    line = low[starts[:, None] + np.arange(n)] @ (_hann(n) * np.exp(-2j * math.pi * note.pitch * t))
    line *= np.exp(-2j * math.pi * note.pitch * starts / rate)
    middle = (starts + n / 2) / rate
    inside = (middle > DIP[0]) & (middle < DIP[1])
    level = 20 * np.log10(np.abs(line[inside]) + 1e-30)
    count = int(np.flatnonzero(level > level.max() - FADED)[-1]) + 1
    level, seconds, line = level[:count], middle[inside][:count], line[inside][:count]
    if seconds[-1] < 0.8:
        raise _Unknown("the fundamental dies within 0.8 s")
    off = level - np.polyval(np.polyfit(seconds, level, 1), seconds)
    early = seconds < DRIFT[1]
    frequency = np.diff(np.unwrap(np.angle(line[early]))) / (2 * math.pi * np.diff(seconds[early]))
    return {"dip": float(off.min()), "drift": 1200 / math.log(2) * float(np.std(frequency)) / note.pitch}


def _wobble(note: _Note, rings: Ringing) -> dict[str, Any]:
    """Median distance of the levels of partials 5 to 12 from a straight line over 0.1 to 0.6 s.

    In windows of eight periods, for partials 15 dB above the sound between partials.
    """
    note.until(WAVER[1])
    note = note.low
    found = note.partials[(note.numbers >= WAVERING[0]) & (note.numbers <= WAVERING[1])]
    n = round(8 * note.rate / note.pitch)
    hop = max(1, n // 16)
    starts = np.arange(round(WAVER[0] * note.rate), round(WAVER[1] * note.rate) - n + 1, hop)
    if starts.size < 6:
        raise _Unknown("too low a note")
    if not found.size:
        raise _Unknown("no partials 5 to 12")
    frames = note.sound[starts[:, None] + np.arange(n)] * _hann(n)
    t = np.arange(n) / note.rate

    def level(nu: Floats) -> Floats:
        return np.asarray(20 * np.log10(np.abs(frames @ np.exp(-2j * math.pi * np.outer(t, nu))) + 1e-30))

    tones, gaps = level(found), np.median(level(found + note.pitch / 2), axis=0)
    tones = tones[:, np.median(tones, axis=0) > gaps + 15]
    if not tones.size:
        raise _Unknown("partials 5 to 12 do not stand out of the noise")
    x = np.vander(np.arange(starts.size, dtype=np.float64), 2)
    off = tones - x @ np.linalg.lstsq(x, tones, rcond=None)[0]
    return {"wobble": float(np.median(np.median(np.abs(off), axis=0)))}


def _between(note: _Note, rings: Ringing) -> dict[str, Any]:
    """Sound between partials at 0.4 s: in three bands relative to the whole note then, and its level in all three."""
    length = max(0.2, 12 / note.pitch)
    piece = note.around(0.4, length)
    nu, power = _spectrum(piece, note.rate, np.kaiser(piece.size, SHAPE), 2.0)
    free = _free(note, nu, 0.3)
    step = nu[1]
    whole = float(power[nu > 0.5 * note.pitch].sum())
    found: dict[str, Any] = {}
    for key, (low, high) in zip(NOISE_KEYS, pairwise(GAPS), strict=True):
        inside = free & (nu >= low) & (nu < high)
        density = float(np.median(power[inside])) if inside.any() else 0.0
        found[key] = 10 * math.log10(density * (high - low) / step / whole) if density > 0 else "no gap in it"
    loud = 10 * math.log10(_power(piece))
    known = [10 ** (found[key] / 10) for key in NOISE_KEYS if not isinstance(found[key], str)]
    found["between_level"] = _db(sum(known)) + loud if len(known) == len(NOISE_KEYS) else "no gap in one of its bands"
    return found


def _floors(note: _Note, rings: Ringing) -> dict[str, Any]:
    """Noise floor from 0.8 to 1.5 s: power per kHz between partials, by band, relative to the note's first 0.3 s."""
    nu, power = density(note.part(*STEADY), note.rate)
    free = _free(note, nu, 0.3)
    loud = _db(_power(note.part(0.0, BODY)))
    found: dict[str, Any] = {}
    for key, (low, high) in zip(FLOOR_KEYS, FLOORS, strict=True):
        inside = free & (nu >= low) & (nu < high)
        level = 1000 * typical(power[inside])
        if high > KNOWN * note.rate:
            found[key] = f"rate {note.rate:g} Hz: nothing is known up to {high:g} Hz"
        else:
            found[key] = _db(level) - loud if level > 0 else "no gap in it, or silence"
    return found


def _lines(note: _Note, rings: Ringing) -> dict[str, Any]:
    """The strongest line between partials from 60 to 700 Hz, 0.3 to 1.3 s, relative to the whole note then."""
    note.until(1.3)
    piece = note.low.part(0.3, 1.3)
    window = np.kaiser(piece.size, SHAPE)
    nu, power = _spectrum(piece, note.low.rate, window)
    free = (nu > LINES[0]) & (nu < LINES[1]) & _free(note, nu, APART)
    free &= np.abs(nu / note.pitch - np.round(nu / note.pitch)) > APART
    if not free.any():
        raise _Unknown("no gap in it")
    lobe = float(np.sum(window**2)) * 2 * (nu.size - 1) / float(np.sum(window)) ** 2  # bins that share a line's power
    return {"lines": _db(float(power[free].max()) * lobe) - _db(float(power[nu > 0.5 * note.pitch].sum()))}


def hiss(piece: Floats, rate: float) -> float:
    """Returns the level of HISS in a piece of sound, (n,), relative to MUSIC, dB; NaN if `rate`, Hz, has no HISS."""
    if HISS[1] > KNOWN * rate:
        return math.nan
    nu, power = _spectrum(piece, rate, _hann(piece.size), 5.0)
    noise, music = (float(power[(nu > low) & (nu < high)].sum()) for low, high in (HISS, MUSIC))
    return _db(noise) - _db(music)


def _hiss(note: _Note, rings: Ringing) -> dict[str, Any]:
    """Level of 10 to 16 kHz in HISSING, relative to everything up to 8 kHz then."""
    if HISS[1] > KNOWN * note.rate:
        raise _Unknown(f"rate {note.rate:g} Hz: nothing is known up to {HISS[1]:g} Hz")
    return {"hiss": hiss(note.part(*HISSING), note.rate)}


def _free(note: _Note, nu: Floats, near: float) -> NDArray[np.bool_]:
    """Returns the mask of frequencies (bins,) farther than `near` fundamentals from every partial."""
    free = nu > 0.5 * note.pitch
    for each in note.partials:
        free &= np.abs(nu - each) > near * note.pitch
    return free


def _between_at_once(note: _Note, rings: Ringing) -> dict[str, Any]:
    """Sound halfway between partials at 50 ms, 0.5 to 4 kHz, relative to them; for low notes about 20 ms later.

    In a window of six periods, whose zeros lie on the partials.
    """
    note.attacked()
    note = note.below(1.25 * 4000)
    n = round(AT_ONCE * note.rate / note.pitch)
    piece = note.around(max(0.05, AT_ONCE / 2 / note.pitch), n / note.rate)[:n]
    found = note.partials[(note.partials >= 500) & (note.partials < 4000)]
    if found.size < 5:
        raise _Unknown("fewer than five partials from 0.5 to 4 kHz")
    t = np.arange(piece.size) / note.rate
    windowed = piece * _hann(piece.size)
    tones, gaps = (
        np.abs(np.exp(-2j * math.pi * np.outer(nu, t)) @ windowed) ** 2 for nu in (found, found + note.pitch / 2)
    )
    return {"between_50ms": _db(float(np.mean(gaps))) - _db(float(np.mean(tones)))}


def _bursts(note: _Note, rings: Ringing) -> dict[str, Any]:
    """Early against late fall of 1.5 to 6 kHz, and how far they rise again after 0.12 s."""
    if RATTLING[1] > 0.45 * note.rate:
        raise _Unknown(f"rate {note.rate:g} Hz: nothing is known up to {RATTLING[1]:g} Hz")
    high, rate = note.band(*RATTLING)
    total = np.cumsum(np.concatenate([[0.0], high**2]))
    n = round(BURST * rate)
    starts = np.arange(0.0, (high.size - n) / rate, BURST_HOP)
    first = np.floor(starts * rate).astype(np.int64)
    level = 10 * np.log10((total[first + n] - total[first]) / n + 1e-14)
    found: dict[str, Any] = {}

    def fall(begin: float, end: float) -> float:
        note.until(end)
        inside = (starts >= begin - 1e-9) & (starts < end - BURST)
        return -float(np.polyfit(starts[inside], level[inside], 1)[0])

    try:
        note.attacked()
        found["bend"] = fall(*BEND[0]) - fall(*BEND[1])
    except _Unknown as reason:
        found["bend"] = str(reason)
    if starts[-1] < RETURN[0] + 0.5:
        found["returns"] = f"{note.sound.size / note.rate:.2f} s long: {RETURN[0] + 0.55:.2g} s are needed"
    else:
        later = level[(starts >= RETURN[0] - 1e-9) & (starts < RETURN[1])]
        later = np.maximum(later, level.max() - FLOOR)
        found["returns"] = float((later - np.minimum.accumulate(later)).max())
    return found


def _peak(sound: Floats, rate: float) -> tuple[int, float]:
    """Returns the loudest place of a band in its first 0.3 s, in samples, and its mean power there, over 10 ms."""
    n = max(1, round(FRAME * rate))
    total = np.cumsum(np.concatenate([[0.0], np.pad(sound, (n // 2, n - n // 2)) ** 2]))
    mean = (total[n:] - total[:-n]) / n
    k = int(np.argmax(mean[: round(BODY * rate)]))
    return k, float(mean[k])


def _snap(note: _Note, rings: Ringing) -> dict[str, Any]:
    """Prominence of 2 to 4 kHz at the attack: their peak over their level from 100 to 150 ms."""
    note.attacked()
    note.until(0.15)
    high, rate = note.band(2000.0, 4000.0)
    rest = high[round(0.1 * rate) : round(0.15 * rate)]
    return {"snap": _db(_peak(high, rate)[1]) - _db(_power(rest))}


def _highs(note: _Note, rings: Ringing) -> dict[str, Any]:
    """Level of 2 to 8 kHz over 40 ms, 100, 200 and 400 ms after its peak."""
    high, rate = note.band(2000.0, min(8000.0, 0.45 * note.rate))
    k, peak = _peak(high, rate)
    found: dict[str, Any] = {}
    for key, later in zip(HIGH_KEYS, (0.1, 0.2, 0.4), strict=True):
        begin, end = (k + round((later + side) * rate) for side in (-0.02, 0.02))
        if end > high.size:
            found[key] = f"{note.sound.size / note.rate:.2f} s long: {end / rate:.2g} s are needed"
        else:
            found[key] = _db(_power(high[begin:end])) - _db(peak)
    return found


def _thump(note: _Note, rings: Ringing) -> dict[str, Any]:
    """Level of the first 30 ms relative to 100 to 200 ms, and the octaves of the first 30 ms."""
    note.attacked()
    begin = note.part(0.0, 0.03)
    found: dict[str, Any] = {}
    nu, power = _spectrum(begin, note.rate, _fade_window(begin.size, round(0.005 * note.rate)), 2.0)
    total = float(power.sum())
    for key, middle in zip(SHARE_KEYS, OCTAVES, strict=True):
        low, high = middle / math.sqrt(2), middle * math.sqrt(2)
        share = float(power[(nu >= low) & (nu < high)].sum()) / total
        known = low < 0.45 * note.rate and share > 0
        found[key] = 10 * math.log10(share) if known else f"rate {note.rate:g} Hz: nothing is known there"
    try:
        found["thump"] = _db(_power(begin)) - _db(_power(note.part(0.1, 0.2)))
    except _Unknown as reason:
        found["thump"] = str(reason)
    return found


GLIDE_EACH = tuple(f"{key}_{j}" for key in GLIDE_KEYS for j in range(1, GLIDING + 1))
PARTS = (
    (("peak", "level", *LEVEL_KEYS, "fall_time"), _levels),
    ((*T60_KEYS, "t60_scatter"), _t60),
    (("growth", *BAND_KEYS), _bands),
    (("centroid_20", "centroid_100", "centroid_fall"), _centroids),
    (("fundamental_fall",), _fundamental),
    ((*GLIDE_KEYS, *GLIDE_EACH), _glides),
    (FUNDAMENTAL_KEYS, _fundamental_later),
    (("wobble",), _wobble),
    ((*NOISE_KEYS, "between_level"), _between),
    (FLOOR_KEYS, _floors),
    (("lines",), _lines),
    (("hiss",), _hiss),
    (("between_50ms",), _between_at_once),
    (("snap",), _snap),
    (HIGH_KEYS, _highs),
    (BURST_KEYS, _bursts),
    (("thump", *SHARE_KEYS), _thump),
)
ORDER = tuple(key for keys, _ in PARTS for key in keys)
KEYS = frozenset(ORDER)
