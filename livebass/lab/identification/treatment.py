"""Finds later processing of a recording: loops of samplers, cuts, fades and compression.

Each finding is a sentence with its evidence. Sound spoilt by a loop or a fade is left out; a compressor cannot be
undone, and a cut can only be named.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from livebass.lab.identification.esprit import WIDTH, band
from livebass.lab.identification.lines import BEAT, MAX_SAMPLES, until
from livebass.lab.identification.partials import Partial, Recording, Take
from livebass.rows.arrays import Floats

PIECE = 0.12  # s of sound to search for earlier in the take
SHORTEST_LOOP, LONGEST_LOOP = 0.008, 2.0  # s
EXACT = 45.0  # dB below the sound: a loop differs from itself by less ...
GROWS = 6.0  # dB: ... and by hardly more REPEATS turns earlier, where a string's partials have drifted apart
REPEATS = 3
OF_NOISE = 0.9  # self-correlation of a loop's noise, too
ORDER = 32  # of the prediction whose remainder is the noise


def without_loops(takes: Sequence[Take]) -> tuple[list[Take], list[str]]:
    """Returns `takes`, each up to the point where it repeats itself, and a sentence for each that does."""
    kept, said = [], []
    for take in takes:
        loop = loop_of(take.sound, take.rate)
        if loop is None:
            kept.append(take)
            continue
        first, length = loop
        said.append(
            f"{take.place} repeats itself every {length / take.rate:.4g} s from {first / take.rate:.2f} s "
            "on, noise included: the loop of a sampler; that part is left out"
        )
        kept.append(replace(take, sound=take.sound[:first]))
    return kept, said


def loop_of(sound: Floats, rate: float) -> tuple[int, int] | None:
    """Returns the sample of `sound` (n,) that begins a repetition, and the length of the loop; or None.

    A string also repeats after a period, but not after several as well as after one: its partials drift apart. And the
    noise beside them never repeats.
    """
    piece = round(PIECE * rate)
    longest = min(round(LONGEST_LOOP * rate), (sound.size - piece) // REPEATS)
    shortest = round(SHORTEST_LOOP * rate)
    if longest <= shortest:
        return None
    last = sound[-piece:]
    if float(np.abs(last).max()) < 1e-3 * float(np.abs(sound).max()):
        return None
    before = sound[-piece - longest :]
    energy = np.cumsum(np.concatenate([[0.0], before**2]))
    energies = (energy[piece:] - energy[:-piece])[::-1]  # by lag from 0
    size = 2 ** math.ceil(math.log2(before.size + piece))
    product = np.fft.irfft(np.fft.rfft(before, size) * np.conj(np.fft.rfft(last, size)), size)[: longest + 1][::-1]
    left = 1 - product**2 / np.maximum(energies * energies[0], 1e-300)
    left[:shortest] = 1.0
    exact = np.flatnonzero(left < 10 ** (-EXACT / 10))
    for lag in map(int, exact[:50]):
        # the best lag near this one
        lag += int(np.argmin(left[lag : lag + 4]))
        if _repeats(sound, piece, lag) and _noise_repeats(sound, piece, lag):
            return _beginning(sound, piece, lag), lag
    return None


def _unexplained(sound: Floats, begin: int, end: int, lag: int) -> float:
    """Returns the part of sound[begin:end] (dB) not explained by the sound `lag` earlier."""
    a, b = sound[begin:end], sound[begin - lag : end - lag]
    maximum = float(a @ a) * float(b @ b)
    return 10 * math.log10(max(1 - float(a @ b) ** 2 / maximum, 1e-16)) if maximum > 0 else 0.0


def _repeats(sound: Floats, piece: int, lag: int) -> bool:
    end = sound.size
    once = _unexplained(sound, end - piece, end, lag)
    often = _unexplained(sound, end - piece, end, REPEATS * lag)
    return often < max(once + GROWS, -2 * EXACT) and often < -EXACT + GROWS


def _noise_repeats(sound: Floats, piece: int, lag: int) -> bool:
    """True if the remainder of a linear prediction repeats after `lag` samples."""
    region = sound[-(piece + lag + ORDER) :]
    rows = np.lib.stride_tricks.sliding_window_view(region, ORDER + 1)
    past, now = rows[:, :-1], rows[:, -1]
    scale = float(np.abs(now).max()) or 1.0
    gram = past.T @ past / scale**2 + 1e-13 * len(rows) * np.eye(ORDER)
    noise = now - past @ np.linalg.solve(gram, past.T @ now / scale**2)
    a, b = noise[-piece:], noise[-piece - lag : noise.size - lag]
    maximum = math.sqrt(float(a @ a) * float(b @ b))
    return maximum > 0 and float(a @ b) > OF_NOISE * maximum


def _beginning(sound: Floats, piece: int, lag: int) -> int:
    """The first sample that repeats the one `lag` earlier."""
    end, step = sound.size, max(1, piece // 8)
    while end - step - lag - piece >= 0 and _unexplained(sound, end - step - piece, end - step, lag) < -EXACT + GROWS:
        end -= step
    return end - piece


AT_ONCE = 0.001  # s after the beginning of a file
BEGUN = 6.0  # dB below the loudest of its first frames: a note as loud at the beginning began before
ATTACK, FRAME = 0.05, 0.005  # s
LONG_ENOUGH = 2.0  # s of a note; shorter ones leave slow decays a guess
TAIL, FADED = 0.01, 10.0  # s; dB: a note whose end is this far below the tenth of a second before is no cut


def cuts(recording: Recording, take: Take, skip: float) -> list[str]:
    """Reports whether `take`, of `recording` from `skip` (s) after an attack, lacks its beginning or its end."""
    said = []
    sound, rate = recording.sound, recording.rate
    if take.start_s - skip < FRAME:
        frame = max(1, round(FRAME * rate))
        head = sound[: round(ATTACK * rate)]
        loudest = max(_level(head[k : k + frame]) for k in range(0, max(1, head.size - frame), frame))
        down = max(0.0, loudest - _level(sound[: max(2, round(AT_ONCE * rate))]))
        if down < BEGUN:
            said.append(
                f"{take.place} begins {down:.0f} dB below its loudest: its attack is cut off, and with it what "
                "tells of the pluck"
            )
    at_end = sound.size / rate - take.start_s - take.duration_s < FRAME
    tail, before = take.sound[-round(TAIL * rate) :], take.sound[-round(0.1 * rate) : -round(TAIL * rate)]
    if at_end and take.duration_s < LONG_ENOUGH and before.size and _level(before) - _level(tail) < FADED:
        fallen = _level(take.sound[: before.size]) - _level(before)
        said.append(
            f"{take.place} is cut after {take.duration_s:.2g} s, where it has fallen by {fallen:.0f} dB: longer decays "
            "than that are guessed"
        )
    return said


def _level(sound: Floats) -> float:
    return 10 * math.log10(float(np.mean(sound**2)) + 1e-20)


MAX_PARTIALS = 24  # the strongest
FEWEST = 6  # partials needed for a gain
SHALLOW = 35.0  # dB down to which a partial is followed
SAMPLES = 24  # of a partial's level, at least
PLACES = np.linspace(0.12, 0.92, 33)  # fractions of the duration of most partials: a bend is looked for here
STEEPER, FADING = 1.5, 8.0  # dB/s, least increase of the partials' decay after a bend; after a late one in a fade
LATE = 0.55  # of the take
SURE = 5.0  # standard deviations of the median over partials


@dataclass(frozen=True)
class Gain:
    """A bend common to the levels of all partials of a take: from then on they fall faster."""

    bend: float  # s, in the take
    steeper: float  # dB/s, median
    alike: int  # partials that fall faster ...
    partials: int  # ... of those examined


def shared_gain(take: Take, partials: Sequence[Partial], f0: float) -> Gain | None:
    """Returns the bend that `partials` of `take` share, or None.

    A string's partials are sums of exponentials: they beat, each in its own time, and fall straight or more and more
    slowly. If all of them fall faster at once, there is a gain: a compressor that lets go, a fade, or a hand.
    """
    loud = sorted(partials, key=lambda p: -p.amplitude)[:MAX_PARTIALS]
    levels = [level for p in loud if (level := _levels(take, p.frequency, f0)) is not None]
    if len(levels) < FEWEST:
        return None
    count = sorted(level.size for level in levels)[-max(FEWEST, len(levels) // 2)]
    rows = np.array([level[:count] for level in levels if level.size >= count])
    seconds = np.arange(count) / (WIDTH * f0) + 0.5 * FILTER / f0
    best: tuple[float, Gain] | None = None
    for place in PLACES:
        hinge = np.maximum(seconds - seconds[int(place * count)], 0.0)
        columns = np.column_stack([np.ones(count), seconds, hinge])
        fitted = np.linalg.lstsq(columns, rows.T, rcond=None)[0]
        left = float(np.sum(np.std(rows.T - columns @ fitted, axis=0)))
        slopes = -fitted[2]
        middle = float(np.median(slopes))
        spread = 1.4826 * float(np.median(np.abs(slopes - middle))) * 1.25 / math.sqrt(slopes.size)
        if middle > max(STEEPER, SURE * spread) and (best is None or left < best[0]):
            alike = int(np.count_nonzero(slopes > middle / 2))
            best = left, Gain(float(seconds[int(place * count)]), middle, alike, len(rows))
    return best[1] if best else None


FILTER = 10.7  # periods that the filter of a band lasts


def _levels(take: Take, frequency: float, f0: float) -> Floats | None:
    """Levels (n,), dB, of a partial down to SHALLOW below its beginning; None if too few."""
    b = band(take.sound, take.rate, frequency, WIDTH * f0, MAX_SAMPLES)
    if b is None:
        return None
    level = 20 * np.log10(np.abs(b.samples) + 1e-300)
    count = until(level > level[:3].max() - SHALLOW, max(3, round(BEAT * WIDTH * f0)))
    return level[:count] if count >= SAMPLES else None


def is_fade(gain: Gain, take: Take) -> bool:
    """True if `gain` bends late and strongly, like a fade or a hand."""
    return gain.bend > LATE * take.duration_s and gain.steeper > FADING


def without_fade(take: Take, gain: Gain) -> tuple[Take, str]:
    """Returns `take` up to its fade, and a sentence about it."""
    said = f"{_bend(take, gain)}: a fade, or a hand; that part is left out"
    return replace(take, sound=take.sound[: round(gain.bend * take.rate)]), said


def compressor_doubt(take: Take, gain: Gain) -> str:
    """Says that `take` went through a compressor."""
    return f"{_bend(take, gain)}: a compressor that lets go there, or frets touched until then; T60 come out wrong"


def _bend(take: Take, gain: Gain) -> str:
    return (
        f"{take.place}: partials fall {gain.steeper:.1f} dB/s faster from {gain.bend:.2f} s on, {gain.alike} of "
        f"{gain.partials} alike"
    )
