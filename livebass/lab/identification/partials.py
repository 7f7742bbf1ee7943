"""Partials of a plucked string: notes cut from recordings, the damped sines in them, and medians over several notes.

A take is a note, cut from a little after its attack to where it is stopped. Partial j of a take is looked for near
j f0 (1 + B j^2 / 2), eq. 8 of C. Issanchou et al. (2018), with f0 and B from the last twelve partials found, which also
follows strings of the other stiffness law, in a band that suits its decay. Partials may be missing if the string was
plucked or is heard at a node. `combine` merges the partials of several takes into one list: medians and their scatter.

esprit.py finds the damped sines of a band; lines.py decides whether a partial is one of them or two, and its audible
decay.
"""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from livebass.lab.analysis.motion import t60
from livebass.lab.identification.esprit import WIDTH, Component, band, components, shortest
from livebass.lab.identification.lines import MIN_DAMPING, Line, decay, envelope, late_spectrum
from livebass.rows.arrays import Floats
from livebass.rows.units import one_line
from livebass.sound.analysis import fundamental
from livebass.sound.audiofile import SoundError, read_sound

LONGEST = 1200.0  # s of recording
RATES = (8_000, 400_000)  # Hz
SILENCE = 1e-7  # of full scale: below one bit of 24
FRAME, HOP = 0.030, 0.005  # s, for the level: a frame holds a period of the low E, 24 ms
BEFORE, RISE = 0.05, 10.0  # s, dB: a note begins where the level rises by RISE within BEFORE ...
DEEPEST = 40.0  # dB ... to no more than this below the loudest
CUT = 20.0  # dB below the loudest: a file that begins louder begins within a note
APART = 0.2  # s, from one note to the next
MARGIN = 0.02  # s, skipped before the next note
# A note is stopped where it falls by STOPPED dB in 0.1 s, and STEEPER times as fast as in the 0.1 s before.
STOPPED, STEEPER = 12.0, 4.0


class RecordingError(ValueError):
    """A recording cannot be used; one line with the name of the file and the reason."""


@dataclass(frozen=True)
class Recording:
    """One channel of a sound file."""

    name: str
    sound: Floats  # (n,), full scale 1
    rate: int  # Hz


@dataclass(frozen=True)
class Take:
    """One note of a recording, without its attack."""

    name: str  # of the file
    start_s: float  # in the file
    sound: Floats  # (n,)
    rate: int  # Hz

    @property
    def duration_s(self) -> float:
        return self.sound.size / self.rate

    @property
    def place(self) -> str:
        """File and time, for a sentence."""
        return f"{one_line(self.name)}: the note at {self.start_s:.2f} s"


def read_recording(path: Path, channel: int | None = None, silent: bool = False) -> Recording:
    """Reads one channel of a sound file (WAV, FLAC, Ogg ...), `channel` from 1, or the loudest; removes its mean.

    Channels are not mixed: they may hold two polarisations or two pickups, out of phase. `silent`: it may be silent.
    Raises RecordingError.
    """
    name = str(path)
    try:
        read = read_sound(path, "recording", LONGEST, RATES)
    except SoundError as error:
        raise RecordingError(str(error)) from None
    sound, rate = read.samples, read.rate
    if channel is not None and channel > sound.shape[1]:
        raise RecordingError(f"{name}: no channel {channel}, it has {sound.shape[1]}")
    if not np.isfinite(sound).all():
        raise RecordingError(f"{name}: has samples that are not finite numbers")
    if not sound.size:
        raise RecordingError(f"{name}: is empty")
    sound -= sound.mean(axis=0)  # a displacement sensor has an offset
    if np.max(np.abs(sound)) < SILENCE:
        if not silent:
            raise RecordingError(f"{name}: is silent")
        sound[:] = 0.0  # no mean is exact
    chosen = int(np.argmax(np.sum(sound**2, axis=0))) if channel is None else channel - 1
    return Recording(name, np.ascontiguousarray(sound[:, chosen]), rate)


def find_takes(recording: Recording, skip: float, longest: float) -> list[Take]:
    """Cuts out the notes of a recording, each from `skip` (s) after its attack, and at most `longest` (s) long."""
    sound, rate = recording.sound, recording.rate
    level = _levels(sound, rate)
    begins = _attacks(sound, rate, level)
    found = []
    for k, begin in enumerate(begins):
        end = begins[k + 1] - MARGIN if k + 1 < len(begins) else sound.size / rate
        start = begin + skip
        end = min(end, _stop_time(level, begin, end), start + longest)
        piece = sound[round(start * rate) : max(0, round(end * rate))]
        if piece.size:
            found.append(Take(recording.name, start, piece, rate))
    return found


def pitch_of(take: Take, low: float, high: float) -> float | None:
    """Returns the median pitch (Hz), from `low` to `high`, of the first 1.5 s of a take; None if there is none."""
    try:
        heard = fundamental(take.sound[: round(1.5 * take.rate)], take.rate, low, high, threshold=0.2).frequency_hz
    except ValueError:  # too short
        return None
    heard = heard[np.isfinite(heard)]
    return float(np.median(heard)) if heard.size else None


def _levels(sound: Floats, rate: int) -> Floats:
    """Root mean square of frames FRAME long, HOP apart, in dB relative to the loudest, at least -150."""
    frame, hop = round(FRAME * rate), round(HOP * rate)
    padded = np.pad(sound, (0, frame))
    power = np.array([np.mean(part**2) for part in sliding_window_view(padded, frame)[: sound.size : hop]])
    return np.asarray(10 * np.log10(np.maximum(power / power.max(), 1e-15)))


def _attacks(sound: Floats, rate: int, level: Floats) -> list[float]:
    """Times (s) at which notes begin, including 0 if the file begins within a note; `level` is from `_levels`."""
    before = round(BEFORE / HOP)
    padded = np.pad(level, (before, 0), constant_values=-CUT - RISE)
    rise = level - sliding_window_view(padded, before)[: level.size].min(axis=1)
    begins: list[float] = []
    last = -math.inf
    for i in map(int, np.flatnonzero((rise > RISE) & (level > -DEEPEST))):
        if (i - last) * HOP > APART:
            part = np.abs(sound[round(i * HOP * rate) : round((i * HOP + 2 * FRAME) * rate)])
            begins.append(i * HOP + int(np.argmax(part > 0.2 * part.max())) / rate)
        last = i
    return begins


def _stop_time(level: Floats, begin: float, end: float) -> float:
    """Time (s) at which a hand stops the note that sounds from `begin` to `end` (s), or `end`."""
    span = round(0.1 / HOP)
    first, last = round(begin / HOP) + 2 * span, min(round(end / HOP), level.size) - span
    for i in range(first, last):
        before, fall = level[i - span] - level[i], level[i] - level[i + span]
        if fall > STOPPED and fall > STEEPER * max(before, 1.0):
            return i * HOP - FRAME
    return end


SCALES = (0.25, 0.5, 1.0, 2.0, 4.0)  # widths of bands, as multiples of WIDTH
FIT = 25.0  # scale that suits a decay, in damping / f0: SAMPLES then cover about five decay times
NEAR = 0.15  # of f0: largest distance of a partial from its expected place
MIN_ENERGY = 60.0  # over the noise of a sample; noise alone reaches about 20
FAINTEST = 85.0  # dB below the peak of the sound: more than a band's leakage from the rest
MAX_UNSURE = 0.2  # standard deviation over damping
MISSING = 8  # consecutive missing partials that end the search
HIGHEST = 0.45  # frequency of a partial, in sampling rates


@dataclass(frozen=True)
class Partial:
    """One partial of one take."""

    number: int  # j
    frequency: float  # Hz
    damping: float  # 1/s, audible
    amplitude: float  # of both lines, at the beginning of the take, in units of the sound
    frequency_sd: float  # Hz, for this take alone: the Cramer-Rao bound
    damping_sd: float  # 1/s
    u: Line  # the only line, or the one that dies sooner
    v: Line | None = None  # the one that stays


def track(sound: Floats, rate: float, f0: float, maximum: int) -> list[Partial]:
    """Finds partials 1 to `maximum` of the string that sounds in `sound` (n,) from its first sample; f0 (Hz) to 3 %."""
    found: list[Partial] = []
    late = late_spectrum(sound, rate)
    for j in range(1, maximum + 1):
        expected = predict(found, f0, j)
        if expected > HIGHEST * rate or j - (found[-1].number if found else 0) > MISSING:
            break
        partial = find(sound, rate, expected, f0, late, j)
        if partial is not None and (not found or partial.frequency > found[-1].frequency):
            found.append(partial)
    return found


def predict(found: Sequence[Partial], f0: float, j: int) -> float:
    """Returns the frequency (Hz) expected of partial j from those found."""
    if not found:
        return j * f0
    near = found[-12:]
    number = np.array([p.number for p in near], np.float64)
    ratio = np.array([p.frequency for p in near]) / number
    if len(near) < 4:
        return j * float(np.median(ratio))
    slope, at_zero = median_line(number**2, ratio)
    return j * (at_zero + slope * j**2)


def median_line(x: Floats, y: Floats) -> tuple[float, float]:
    """Returns slope and value at 0 of the line through x, y (n,), by medians over pairs (Theil and Sen)."""
    a, b = np.triu_indices(x.size, 1)
    slope = float(np.median((y[b] - y[a]) / (x[b] - x[a])))
    return slope, float(np.median(y - slope * x))


def find(sound: Floats, rate: float, expected: float, f0: float, late: Floats, j: int = 1) -> Partial | None:
    """Finds partial j near `expected` (Hz); None if nothing exceeds the noise. `late`: from `late_spectrum`."""
    scales = [m for m in SCALES if 4 * shortest(WIDTH * f0 * m) < sound.size / rate] or [SCALES[-1]]
    tried: dict[float, list[Component]] = {}
    for first in (1.0, 4.0, 0.25):
        scale, centre = _nearest(first, scales), expected
        while scale not in tried:
            tried[scale] = _near(sound, rate, centre, f0, scale, expected)
            if tried[scale]:
                centre = tried[scale][0].frequency
                scale = _nearest(FIT * tried[scale][0].damping / f0, scales)
        if tried[scale]:
            best = tried[scale][0]
            seen = envelope(sound, rate, best.frequency, f0, late)
            if seen is not None:
                scale = _nearest(FIT * seen.damping / f0, scales)
                if scale not in tried:
                    tried[scale] = _near(sound, rate, best.frequency, f0, scale, expected)
            near = [c for each in tried.values() for c in each]
            heard = decay(best, near, seen, f0)
            deviation = heard.deviation or best.damping_sd
            nu = heard.loudest.frequency
            return Partial(j, nu, heard.damping, heard.amplitude, best.frequency_sd, deviation, heard.u, heard.v)
    return None


def _nearest(scale: float, scales: Sequence[float]) -> float:
    return min(scales, key=lambda m: abs(math.log(m / max(scale, 1e-6))))


def _near(sound: Floats, rate: float, centre: float, f0: float, scale: float, expected: float) -> list[Component]:
    """Components that may be the partial, strongest first."""
    seen = band(sound, rate, centre, WIDTH * f0 * scale)
    faintest = float(np.max(np.abs(sound))) * 10 ** (-FAINTEST / 20)
    return [
        c
        for c in (components(seen) if seen else [])
        if abs(c.frequency - expected) < NEAR * f0
        and c.energy > MIN_ENERGY
        and c.amplitude > faintest
        and c.damping > MIN_DAMPING
        and c.damping_sd < MAX_UNSURE * c.damping
    ]


NORMAL_95 = 1.959964


@dataclass(frozen=True)
class Found:
    """One partial over all takes. Uncertainties are expanded, 95 %."""

    number: int  # j
    frequency: float  # Hz, median
    damping: float  # 1/s, audible, median
    frequency_u: float  # Hz
    damping_u: float  # 1/s
    level_db: float  # relative to the strongest partial of the take, median
    takes: int  # that contain it
    u: Line  # the only line, or the one that dies sooner; amplitudes relative to the strongest partial
    v: Line | None = None  # the one that stays, if at least half of the takes have two

    @property
    def t60(self) -> float:
        """Time of its audible decay by 60 dB, s."""
        return float(t60(self.damping))


def combine(tracks: Sequence[Sequence[Partial]]) -> list[Found]:
    """Combines the partials of several takes: medians of the partials in at least half of the takes.

    The uncertainty comes from the scatter over the takes (Student's t, 95 %), or from the noise in a single take. Needs
    SciPy for several.
    """
    loudest = [max(p.amplitude for p in partials) for partials in tracks]
    seen: dict[int, list[tuple[Partial, float]]] = defaultdict(list)
    for partials, top in zip(tracks, loudest, strict=True):
        for p in partials:
            seen[p.number].append((p, top))
    found: list[Found] = []
    for j in sorted(seen):
        if 2 * len(seen[j]) < len(tracks):
            continue
        group = [p for p, _ in seen[j]]
        frequency, u_frequency = _median([p.frequency for p in group], [p.frequency_sd for p in group])
        damping, u_damping = _median([p.damping for p in group], [p.damping_sd for p in group])
        double = [(p, top) for p, top in seen[j] if p.v is not None]
        both = len(double) * 2 >= len(group)
        if found and frequency <= found[-1].frequency:
            continue
        level = float(np.median([20 * math.log10(p.amplitude / top) for p, top in seen[j]]))
        u = _median_line([(p.u, top) for p, top in (double if both else seen[j])])
        v = _median_line([(p.v, top) for p, top in double if p.v is not None]) if both else None
        found.append(Found(j, frequency, damping, u_frequency, u_damping, level, len(group), u, v))
    return found


def _median_line(lines: Sequence[tuple[Line, float]]) -> Line:
    """Medians of lines, each paired with the amplitude of the strongest partial."""
    rows = [(line.frequency, line.damping, line.amplitude / top) for line, top in lines]
    return Line(*(float(x) for x in np.median(rows, axis=0)))


def _median(values: list[float], bounds: list[float]) -> tuple[float, float]:
    """Median of `values` and its expanded uncertainty, 95 %; `bounds` are standard deviations of each."""
    n = len(values)
    if n == 1:
        return values[0], NORMAL_95 * bounds[0]
    from scipy.special import stdtrit

    efficiency = math.sqrt(math.pi / 2) if n > 2 else 1.0  # of a median; for two it is the mean
    spread = efficiency * float(np.std(values, ddof=1)) / math.sqrt(n)
    return float(np.median(values)), float(stdtrit(n - 1, 0.975)) * spread
