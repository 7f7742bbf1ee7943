"""Finds sound that must not enter a preset: clipping, other notes, and partials that no string can have.

Each finding is a sentence for the user; the sound in question is left out. No note of a shipped preset exceeds the
limits; the margin is stated beside each.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from livebass.lab.identification.fit import Law, rigid_neck
from livebass.lab.identification.lines import late_spectrum
from livebass.lab.identification.partials import Found, Partial, Recording, Take, find
from livebass.model import modes
from livebass.model.instrument import String, speaking
from livebass.model.neck import neck_damping
from livebass.rows.arrays import Floats, Ints
from livebass.rows.units import note_name

FLAT, SIDES = 1e-4, 16.0  # of the peak: depth of a flat top, and of its flanks as multiples of that
STEEP = 1.5  # flanks widen a clipped top by less than this factor; a round one, a parabola, by 4
MIN_FLAT, MIN_TOPS = 3, 3  # samples of a flat top; flat tops of a clipped recording
SETTLE = 0.005  # s skipped after the last clipped sample


def without_clipping(recording: Recording, takes: Sequence[Take]) -> tuple[list[Take], list[str]]:
    """Returns the takes of `recording`, each from the end of its clipping, and a sentence for each that was cut.

    A take that clips up to its end is left out.
    """
    tops = clipped_tops(recording.sound)
    kept: list[Take] = []
    said: list[str] = []
    for take in takes:
        first = round(take.start_s * take.rate)
        inside = tops[(tops >= first) & (tops < first + take.sound.size)]
        if not inside.size:
            kept.append(take)
            continue
        cut = int(inside[-1]) - first + round(SETTLE * take.rate)
        said.append(f"{take.place} clips for {cut / take.rate:.2g} s: that part is left out")
        if cut < take.sound.size:
            kept.append(replace(take, start_s=take.start_s + cut / take.rate, sound=take.sound[cut:]))
    return kept, said


def clipped_tops(sound: Floats) -> Ints:
    """Returns the last samples of all flat tops of `sound` (n,), ascending; none for fewer than `MIN_TOPS`.

    The sound is clipped if it stays at its maximum or minimum and gets there with a kink: around a round top it spends
    four times as long within 16 times the depth.
    """
    found: list[int] = []
    for x in (sound, -sound):
        top = float(x.max())
        levels = np.unique(x[x > 0.9 * top])
        if levels.size < 2:
            continue  # a constant, or less than 10 steps of the file high: undecidable
        depth = max(FLAT * top, float(np.diff(levels).min()))
        flanks = x >= top - SIDES * depth
        edges = np.flatnonzero(np.diff(np.concatenate([[0], flanks.astype(np.int8), [0]])))
        for begin, end in edges.reshape(-1, 2):
            flat = np.flatnonzero(x[begin:end] >= top - depth)
            if flat.size >= MIN_FLAT and end - begin < STEEP * flat.size:
                found.append(int(begin + flat[-1]))
    return np.array(sorted(found) if len(found) >= MIN_TOPS else [], np.int64)


LOUD = 25.0  # dB below the loudest: weaker lines may be hum, sympathetic strings or the body
HIGHEST_LINE = 12.5  # of f0: the search for another note ends here
AWAY = 0.15  # of f0: a line farther than this from every partial is foreign
MIN_LINES, MAX_LINES = 3, 12  # lines that make another note; lines examined
IN_TUNE = 0.02  # of its fundamental: tolerance for a line of the other note
LOWEST_NOTE = 25.0  # Hz


def other_note(take: Take, partials: Sequence[Partial], f0: float) -> float | None:
    """Returns the pitch (Hz) of another note that sounds in `take` beside the string of `partials`; None without one.

    It has at least `MIN_LINES` decaying sines that are not partials of the string but harmonics of one pitch. A note
    whose partials all coincide with the string's, an octave above it, is not found.
    """
    sound, rate = take.sound[: round(2 * take.rate)], take.rate
    level = np.abs(np.fft.rfft(sound * np.blackman(sound.size)))
    number = np.array([p.number for p in partials], np.float64)
    ratio = np.array([p.frequency for p in partials]) / number
    every = np.arange(1, math.ceil(HIGHEST_LINE) + 1)
    own = every * np.interp(every, number, ratio)
    line = np.flatnonzero((level[1:-1] > level[:-2]) & (level[1:-1] >= level[2:])) + 1
    line = line[level[line] > level.max() * 10 ** (-LOUD / 20)]
    hertz = line * rate / sound.size
    foreign = (np.min(np.abs(hertz[:, None] - own), axis=1) > AWAY * f0) & (hertz > LOWEST_NOTE)
    foreign &= hertz < HIGHEST_LINE * f0
    line = line[foreign]
    loudest = line[np.argsort(-level[line])][:MAX_LINES] * rate / sound.size
    late = late_spectrum(take.sound, rate)
    seen = [find(take.sound, rate, float(nu), f0, late) for nu in loudest]  # hum does not decay and is ignored
    sines = np.array([p.frequency for p in seen if p is not None])
    best: tuple[int, float] = (0, 0.0)
    for pitch in (nu / k for nu in sines for k in range(1, 5) if nu / k > LOWEST_NOTE):
        harmonic = np.maximum(np.round(sines / pitch), 1)
        best = max(best, (int(np.count_nonzero(np.abs(sines - harmonic * pitch) < IN_TUNE * pitch)), float(pitch)))
    return best[1] if best[0] >= MIN_LINES else None


def left_out(take: Take, pitch: float | None, beside: bool) -> str:
    """Says that `take` is another note of `pitch` (Hz), has none (None), or has one beside the string's."""
    if pitch is None:
        return f"{take.place} has no clear pitch: left out"
    note = f"{note_name(round(69 + 12 * math.log2(pitch / 440)))} ({pitch:.1f} Hz)"
    what = f"has another note, {note}, beside the string's" if beside else f"is another note, {note}"
    return f"{take.place} {what}: left out"


ASTRAY = 0.1  # of f0, from its neighbours' line: the necks of the presets pull a partial by 0.014
BESIDE = 4  # neighbours on each side
FEWEST = 6  # partials needed to judge one of them
# A string loses more than AIR times the loss to the air: an ideal string once, the presets' strings at least 1.8
# times. The diameter of a recorded string is known only roughly.
AIR = 0.7
LONG, RATIO = 60.0, 0.1  # s, T60, and of the neighbours' damping: a partial beyond both is hum
MAX_CONDUCTANCE = 0.1  # m/s/N, of a neck: 2.5 times the highest of figure 3 (c)


def doubtful(found: Sequence[Found], string: String, law: Law) -> tuple[set[int], list[str]]:
    """Returns the numbers of the partials that no string has, and a sentence for each kind.

    They are farther from the `law` than a neck can pull them, ring longer than the air alone lets the `string`, or ten
    times as long as their neighbours, or die faster than these by more than a neck can cause.
    """
    if len(found) < FEWEST:
        return set(), []
    nu = np.array([p.frequency for p in found])
    damping, unsure = (np.array(values) for values in zip(*((p.damping, p.damping_u) for p in found), strict=True))
    expected = law.frequency(np.array([p.number for p in found]))
    expected += _neighbours(nu - expected)
    typical = _neighbours(damping)
    bare = replace(
        string, viscoelastic_angle=0.0, thermoelastic=0.0, relaxation=0.0,
        measured_frequencies=(), measured_dampings=(),
    )  # fmt: skip
    s = speaking(bare, rigid_neck(bare), 0)
    air = math.pi * nu * modes.loss_factor(s, nu)
    minimum = np.maximum(AIR * air, np.minimum(RATIO * typical, math.log(1000) / LONG))
    maximum = typical + neck_damping(MAX_CONDUCTANCE, modes.impedance(s), law.fundamental)
    kinds = (
        ("off the law", np.abs(nu - expected) > ASTRAY * law.fundamental, expected, "Hz expected"),
        ("ringing longer than a string can, hum perhaps", damping + unsure < minimum, damping, "/s"),
        ("dying faster than a neck can make them", damping - unsure > maximum, damping, "/s"),
    )
    numbers: set[int] = set()
    said = []
    for what, bad, values, unit in kinds:
        which = [i for i in map(int, np.flatnonzero(bad)) if found[i].number not in numbers]
        numbers |= {found[i].number for i in which}
        if which:
            each = ", ".join(f"{found[i].number} ({nu[i]:.2f} Hz, {values[i]:.4g} {unit})" for i in which)
            said.append(f"partials {what}: {each}: left out")
    return numbers, said


def _neighbours(values: Floats) -> Floats:
    """The median of the `BESIDE` values on each side of each of `values` (n,), without itself."""
    around = (np.r_[max(0, i - BESIDE) : i, i + 1 : i + 1 + BESIDE] for i in range(values.size))
    return np.array([np.median(values[k[k < values.size]]) for k in around])
