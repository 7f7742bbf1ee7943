"""Finds the place of the pluck, the roundness of the finger, the pickup positions and the setting of the tone pot.

These shape the initial levels of the partials. Partial j of a string plucked `a` from the saddle, over a pickup `p`
from it, has sin(j pi a / L) sin(j pi p / L) / j of the level, times the effects of the finger's width and release, the
pickup's aperture and the circuit (model/modes.py, kernels/pickup). Pluck and pickup have the same comb: only the preset
tells them apart, as it decides wherever the levels leave a choice. All values stay near the preset's, within `SPREADS`,
unless the levels contradict.

Each third octave has the same weight, by the partials found in it and by its whole level, which includes partials too
faint to be found.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise, product

import numpy as np

from livebass.engine.prepare import coil_filter, pickups_under
from livebass.lab.identification.partials import Found, Take
from livebass.model import modes
from livebass.model.instrument import Instrument, Pickup, Player, Pluck, Speaking
from livebass.rows.arrays import Floats

RATE = 48_000.0  # Hz, of the filter that represents the circuit
LOWEST, BANDS = 40.0, 24  # Hz, centre of the first third octave; their number, up to 8 kHz
EDGES = LOWEST * 2 ** ((np.arange(BANDS + 1) - 0.5) / 3)
WINDOW = 0.4  # s of the take, to measure third octaves
DEPTH = 50.0  # dB below the loudest partial or third octave: fainter ones are left out
FEWEST = 8  # partials needed
SURE = 1.0, 4.0  # dB, limits of the standard deviation of a level
ROBUST = 2.0  # standard deviations beyond which a level weighs less
MIX_TRIED, DARK_TRIED = 1.5, -2.0  # standard deviations of the mix of pickups, and of the tone
NOTCH = 30.0  # dB below its neighbours: the deepest cut of the comb
# Bounds, and standard deviations of the prior around the preset's values.
PLACES = (0.015, 0.45)  # m from the saddle, of the pluck ...
PICKUPS = (0.015, 0.25)  # ... and of pickups
WIDTHS, RELEASES = (0.5e-3, 30e-3), (5e-6, 3e-3)  # m, s
MIXED = 20.0  # dB, the most that one pickup may gain
LOUDEST = 10.0  # the limit of a preset for a pickup's level
SPREADS = {"place": 0.08, "rounding": 0.6, "release": 0.8, "position": 0.025, "level": 1.0, "tone": 1.0}  # m, or of the
# logarithm
NEARLY_CLOSED = 0.02  # of the tone pot, whose tone follows its logarithm
TONES_TRIED = 0.02, 0.2, 1.0  # the levels may not tell these apart
GRID = 0.015  # m between the places of the pluck that are tried
KEPT = 12  # number of starts that are refined
APART, ALIKE = 0.02, 1.1  # m between two places, and ratio of misfits, too close for the levels to decide


@dataclass(frozen=True)
class Onset:
    """The player and electronics that explain the levels of partials."""

    place: float  # m from the saddle, of the pluck
    rounding: float  # m, of the finger, halfway from the softest to the hardest force
    release: float  # s, the same
    pickups: tuple[Pickup, ...]  # the ones under the string, moved and remixed
    tone: float  # of the pot
    gain: float  # of the output relative to the preset, to keep the string's loudness
    misfit: float  # dB, root mean square error ...
    before: float  # ... and of the unchanged preset
    doubts: tuple[str, ...]  # a sentence each: where the levels leave a choice


@dataclass(frozen=True)
class _Values:
    place: float
    rounding: float
    release: float
    positions: tuple[float, ...]
    levels: tuple[float, ...]
    tone: float


def can_be_fitted(bass: Instrument, name: str) -> bool:
    """True if string `name` of `bass` is plucked by a finger and heard through pickups."""
    player = bass.player
    fingers = player.technique == "pluck" and player.stroke == "finger"
    return fingers and bass.output.kind == "pickups" and bool(pickups_under(bass.output, name))


def middle_pluck(player: Player) -> tuple[float, float]:
    """Rounding (m) and release (s) of a pluck halfway from the softest to the hardest force."""
    pairs = (player.rounding, player.rounding_soft), (player.release_time, player.release_time_soft)
    width, release = (math.sqrt(hard * soft) if hard and soft else hard for hard, soft in pairs)
    return width, release


def third_octaves(takes: Sequence[Take]) -> Floats:
    """Median levels (BANDS,), dB, of the beginning of `takes`; NaN above their range."""
    seen = []
    for take in takes:
        sound = take.sound[: round(WINDOW * take.rate)]
        power = np.abs(np.fft.rfft(sound * np.hanning(sound.size), 8 * sound.size)) ** 2
        nu = np.fft.rfftfreq(8 * sound.size, 1 / take.rate)
        level = [
            10 * math.log10(power[(nu >= a) & (nu < b)].sum() + 1e-20) if b < 0.45 * take.rate else math.nan
            for a, b in pairwise(EDGES)
        ]
        seen.append(np.array(level) - np.nanmax(level))
    return np.asarray(np.median(seen, axis=0))


class _Levels:
    """The levels of a string's partials as a function of the unknowns, beside the measured ones."""

    def __init__(self, s: Speaking, bass: Instrument, found: Sequence[Found], bands: Floats, since: float) -> None:
        self.s, self.output = s, bass.output
        self.pickups = pickups_under(bass.output, s.string.name)
        count = s.grid_points - 1
        self.nu = modes.frequencies(s, count)
        inside = int(np.searchsorted(self.nu, min(float(EDGES[-1]), 0.45 * RATE)))
        self.nu, count = self.nu[:inside], inside
        self.number = np.arange(1, count + 1)
        sigma = modes.dampings(s, s.grid_points - 1)[:count]
        for p in found:
            if p.number <= count:
                sigma[p.number - 1] = p.damping  # audible damping of u and v together; those of `s` belong to u
        t = since + np.linspace(0, WINDOW, 200)
        window = np.hanning(t.size) ** 2
        self.energy = np.exp(-2 * np.outer(sigma, t)) @ window / window.sum()
        self.which = np.searchsorted(EDGES, self.nu) - 1
        top = max(p.level_db for p in found)
        used = [p for p in found if p.level_db > top - DEPTH and p.number <= count]
        self.partial = np.array([p.number - 1 for p in used])
        self.level = np.array([p.level_db + 20 / math.log(10) * p.damping * since for p in used])  # at the attack
        own = self.which[self.partial]
        self.share = 1 / np.sqrt(np.array([np.count_nonzero(own == b) for b in own]))
        full = np.array([np.count_nonzero(self.which == b) for b in range(BANDS)]) > 0
        heard = np.isfinite(bands) & (bands > np.nanmax(bands) - DEPTH)
        self.band = np.flatnonzero(full & heard)
        self.band_level = bands[self.band]
        self.both = np.flatnonzero(np.isin(self.band, own))  # indices into `band` of those with partials in use
        self.filters: dict[float, Floats] = {}

    def circuit(self, tone: float) -> Floats:
        """Gain of coil and pots at the partials."""
        if tone not in self.filters:
            b, a = coil_filter(replace(self.output.coil, tone=tone), RATE)
            z = np.exp(-2j * math.pi * np.outer(self.nu / RATE, np.arange(len(b))))
            self.filters = {tone: np.abs(z @ b) / np.abs(z @ a)}
        return self.filters[tone]

    def amplitudes(self, v: _Values) -> Floats:
        """Returns the output at each partial, for an apex of 1 m."""
        length, count = self.s.length, self.number.size
        held = modes.pluck_amplitudes(self.s, count, Pluck(1.0, length - v.place, v.rounding))
        q = held / modes.release_loss(self.nu, v.release)
        heard = np.zeros(count)
        for pickup, position, level in zip(self.pickups, v.positions, v.levels, strict=True):
            wide = self.number * (math.pi / length) * pickup.aperture
            tap = modes.shapes(self.s, count, np.array([length - position]))[0] * np.exp(-(wide**2) / 24)
            heard += level * tap
        return np.asarray(np.abs(q * 2 * math.pi * self.nu * heard) * self.circuit(v.tone))

    def off(self, v: _Values) -> Floats:
        """Returns levels minus the measured ones, weighted, dB; equally loud in the mean."""
        power = self.amplitudes(v) ** 2
        wider = np.concatenate([power[:1], power[:1], power, power[-1:], power[-1:]])
        around = np.convolve(wider, np.full(5, 0.2), mode="valid")
        power = power + around * 10 ** (-NOTCH / 10) + 1e-30
        partials = 10 * np.log10(power[self.partial]) - self.level
        whole = np.bincount(self.which, power * self.energy, BANDS)[self.band]
        bands = 10 * np.log10(whole) - self.band_level
        weight = self.share**2
        partials = partials - (weight @ partials) / weight.sum()
        # the third octaves are as loud as the partials in those that contain both
        common = bands[self.both] if self.both.size else bands
        bands = bands - (common.mean() if common.size else 0.0)
        return np.concatenate([self.share * partials, bands])

    def misfit(self, v: _Values) -> float:
        """Returns the root mean square of `off`, third octaves equally weighted, dB."""
        off = self.off(v)
        return float(np.sqrt(np.sum(off**2) / (np.sum(self.share**2) + self.band.size)))


def fit_onset(s: Speaking, bass: Instrument, found: Sequence[Found], bands: Floats, since: float) -> Onset | None:
    """Fits pluck, pickups and tone of `bass` to the levels of partials `found` of its open string `s`.

    bands: from `third_octaves`, from `since` (s) after the attack on, like the levels of `found`. None for too few
    partials, or if `can_be_fitted` says no. Needs SciPy.
    """
    from scipy.optimize import least_squares

    if not can_be_fitted(bass, s.string.name):
        return None
    problem = _Levels(s, bass, found, bands, since)
    if problem.partial.size < FEWEST:
        return None
    width, release = middle_pluck(bass.player)
    prior = _Values(
        (1 - bass.player.pluck_position) * s.length, width, max(release, 30e-6),
        tuple(p.position for p in problem.pickups), tuple(p.level for p in problem.pickups), bass.output.coil.tone,
    )  # fmt: skip
    space = _Space(prior)

    sure = SURE[1]

    def residuals(x: Floats) -> Floats:
        return np.concatenate([problem.off(space.values(x)) / sure, x])

    def cost(x: Floats) -> float:
        return float(np.sum(2 * ROBUST**2 * (np.sqrt(1 + (residuals(x) / ROBUST) ** 2) - 1)))

    def refined(x: Floats, ends: tuple[Floats, Floats] = (space.low, space.high)) -> Floats:
        return np.asarray(least_squares(residuals, x, bounds=ends, loss="soft_l1", f_scale=ROBUST, max_nfev=60).x)

    ends = sorted((refined(x) for x in sorted(space.starts(), key=cost)[:KEPT]), key=cost)
    sure = min(max(problem.misfit(space.values(ends[0])), SURE[0]), SURE[1])  # the levels determine their own weight
    ends = sorted(map(refined, ends), key=cost)
    best = space.values(ends[0])
    others = [space.values(x) for x in ends[1:]]
    # the same comb with pluck and pickup exchanged, wherever the preset has them
    others += [space.values(refined(space.inside(x))) for x in space.exchanged(ends[0])]
    misfit, before = problem.misfit(best), problem.misfit(prior)
    tones = [space.values(refined(*space.with_tone(ends[0], other))) for other in TONES_TRIED]
    doubts = _doubts(problem, best, misfit, others, tones)
    power = [float(np.sum((problem.amplitudes(v) ** 2) * problem.energy)) for v in (prior, best)]
    pickups = tuple(
        replace(p, position=x, level=level)
        for p, x, level in zip(problem.pickups, best.positions, best.levels, strict=True)
    )
    gain = math.sqrt(power[0] / power[1])
    return Onset(best.place, best.rounding, best.release, pickups, best.tone, gain, misfit, before, doubts)


class _Space:
    """Vectors x of the unknowns, in standard deviations from the `prior` values: place, rounding, release, tone ...

    ... then the places of the pickups, and the levels of all but the first.
    """

    def __init__(self, prior: _Values) -> None:
        self.prior = prior
        maximum = MIXED * math.log(10) / 20
        closed = prior.tone + NEARLY_CLOSED
        bounds = [
            [(e - prior.place) / SPREADS["place"] for e in PLACES],
            [math.log(e / prior.rounding) / SPREADS["rounding"] for e in WIDTHS],
            [math.log(e / prior.release) / SPREADS["release"] for e in RELEASES],
            [math.log((e + NEARLY_CLOSED) / closed) / SPREADS["tone"] for e in (0.0, 1.0)],
            *([(e - p) / SPREADS["position"] for e in PICKUPS] for p in prior.positions),
            *(
                [-maximum / SPREADS["level"], min(maximum, math.log(LOUDEST / max(abs(v), 1e-3))) / SPREADS["level"]]
                for v in prior.levels[1:]
            ),
        ]
        self.low, self.high = np.array([(min(low, -1e-6), max(high, 1e-6)) for low, high in bounds]).T

    def values(self, x: Floats) -> _Values:
        """Returns the values of `x`."""
        prior, each, count = self.prior, x.tolist(), len(self.prior.positions)
        at, mix = each[4 : 4 + count], [0.0, *each[4 + count :]]
        tone = (prior.tone + NEARLY_CLOSED) * math.exp(each[3] * SPREADS["tone"]) - NEARLY_CLOSED
        return _Values(
            prior.place + each[0] * SPREADS["place"],
            prior.rounding * math.exp(each[1] * SPREADS["rounding"]),
            prior.release * math.exp(each[2] * SPREADS["release"]),
            tuple(p + d * SPREADS["position"] for p, d in zip(prior.positions, at, strict=True)),
            tuple(v * math.exp(d * SPREADS["level"]) for v, d in zip(prior.levels, mix, strict=True)),
            min(max(tone, 0.0), 1.0),
        )

    def inside(self, x: Floats) -> Floats:
        """Returns `x` within the bounds."""
        return np.clip(x, self.low + 1e-7, self.high - 1e-7)

    def starts(self) -> list[Floats]:
        """Returns the initial vectors: places of the pluck and of the pickups, and their mixes."""
        count = len(self.prior.positions)
        found = []
        places = (np.arange(*PLACES, GRID) - self.prior.place) / SPREADS["place"]
        mixes = (-MIX_TRIED, 0.0, MIX_TRIED) if count > 1 else (0.0,)
        moves = list(product((-1.0, 0.0, 1.0), repeat=min(count, 2)))
        for darker, place, mix, moved in product((0.0, DARK_TRIED), places, mixes, moves):
            x = np.zeros(self.low.size)
            x[0], x[3], x[4 : 4 + len(moved)], x[4 + count :] = place, darker, moved, mix
            found.append(self.inside(x))
        return found

    def with_tone(self, x: Floats, tone: float) -> tuple[Floats, tuple[Floats, Floats]]:
        """Returns `x` with another tone, and bounds that hold it there."""
        low, high, at = self.low.copy(), self.high.copy(), x.copy()
        at[3] = math.log((tone + NEARLY_CLOSED) / (self.prior.tone + NEARLY_CLOSED)) / SPREADS["tone"]
        low[3], high[3] = at[3] - 1e-6, at[3] + 1e-6
        return np.clip(at, low + 1e-7, high - 1e-7), (low, high)

    def exchanged(self, x: Floats) -> list[Floats]:
        """Returns `x` with the place of the pluck exchanged with each pickup's."""
        v, found = self.values(x), []
        for k, position in enumerate(v.positions):
            other = x.copy()
            other[0] = (position - self.prior.place) / SPREADS["place"]
            other[4 + k] = (v.place - self.prior.positions[k]) / SPREADS["position"]
            found.append(other)
        return found


def _doubts(
    problem: _Levels, best: _Values, misfit: float, others: Sequence[_Values], tones: Sequence[_Values]
) -> tuple[str, ...]:
    """Describes the choice that the levels leave: `others` have other places, `tones` other tones."""
    said = []
    for other in others:
        if problem.misfit(other) < ALIKE * misfit and abs(other.place - best.place) > APART:
            said.append(
                f"the levels leave a choice: plucked {_mm(best.place)} from the saddle with {_pickups(best)} they are "
                f"{misfit:.1f} dB off, {_mm(other.place)} with {_pickups(other)} {problem.misfit(other):.1f} dB: the "
                "first is nearer to the preset, or the better"
            )
            break
    for other in tones:
        far = abs(math.log((other.tone + NEARLY_CLOSED) / (best.tone + NEARLY_CLOSED))) > 1
        if far and problem.misfit(other) < ALIKE * misfit:
            said.append(
                f"the levels leave a choice: a tone of {other.tone:.2f} under a finger of {_mm(other.rounding)} is as "
                f"dark as {best.tone:.2f} under {_mm(best.rounding)}, which is nearer to the preset"
            )
            break
    at_end = [
        name
        for name, value, (low, high) in (
            ("the place of the pluck", best.place, PLACES),
            *((f"the place of pickup {k}", x, PICKUPS) for k, x in enumerate(best.positions, 1)),
        )
        if not low + 1e-3 < value < high - 1e-3
    ]
    if at_end:
        said.append(
            f"{' and '.join(at_end)} came out at the limit of what is looked for: do not trust the pluck's place"
        )
    return tuple(said)


def _mm(x: float) -> str:
    return f"{x * 1e3:.0f} mm"


def _pickups(v: _Values) -> str:
    places = " and ".join(_mm(x) for x in v.positions)
    return f"pickup{'s' * (len(v.positions) > 1)} at {places}"
