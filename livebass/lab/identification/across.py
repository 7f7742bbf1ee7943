"""Finds the tuning and damping of the motion across the neck, v, relative to u, away from it.

It uses the partials with two lines. In the terms of eqs. 8 and 9 of C. Issanchou et al. (2018) the neck has another
admittance for v: the difference of dampings gives the difference of conductances, the detuning the difference of
susceptances.

A preset has two keys for that: how much stiffer the neck is across, and by how much the string is longer. The audible
decay of u and v together also depends on the level of v.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from livebass.engine.prepare import pickups_under
from livebass.lab.identification.lines import DOWN
from livebass.lab.identification.partials import Found
from livebass.model.instrument import Instrument, Neck, Speaking, String, speaking
from livebass.model.modes import dampings_across, frequencies_across
from livebass.model.neck import neck_damping
from livebass.rows.arrays import Floats

FEWEST = 3  # partials of two lines needed for a law of v
BEATEN = 0.9  # of the misfit of a v equal to u: a law that leaves more is rejected
AS_GOOD = 1.01  # ratio of misfits that are equally good: the stiffness nearest to 1 wins
FAINTER = 0.3  # power of a line's amplitude that gives its weight: 20 dB fainter, half as much
STIFFEST, LONGEST = 100.0, 10e-3  # limits of a preset's keys: times as stiff, or 1/10 as stiff; m, to either side
SOFTEST = 0.1
COARSE, FINE = 61, 21  # stiffness values tried
HEARD = math.log(10) * DOWN / 20  # nepers of decay that are heard
U_OVER_HEARD, TRIED = (0.5, 5.0), 161  # dampings of u tried, over the audible one of both; their number
BY_ITSELF, ELSE = 0.5, 0.05  # weight of u's own damping beside the audible damping of both; the same for one line
INSTANTS = 200  # in a decay
STEEPEST = math.radians(80)  # angle of a pluck: even one straight across moves u a little


@dataclass(frozen=True)
class Double:
    """A partial of two lines: v relative to u."""

    number: int  # j
    frequency: float  # Hz, of u
    detuning: float  # of v over u, minus 1
    damping: float  # 1/s, of v minus u: never above 0
    conductance: float  # m/s/N, of the neck, for v minus u
    susceptance: float  # m/s/N, the same


@dataclass(frozen=True)
class Across:
    """The law of v: constants, as medians over the partials with two lines, and the values of each."""

    detuning: float  # relative to u
    detuning_spread: float  # median distance from it
    damping: float  # 1/s, of v minus u
    damping_spread: float  # 1/s, median distance from it
    partials: tuple[Double, ...]


def across(found: Sequence[Found], impedance: float, fundamental: float) -> Across | None:
    """Returns the law of v for partials `found` of a string of `impedance` (kg/s) and f0 (Hz); None without two lines.

    Im Y detunes by -mu c / (j pi), and Re Y damps by 2 f0 mu c.
    """
    lost = float(neck_damping(1.0, impedance, fundamental))  # 1/s for 1 m/s/N
    double = []
    for p in found:
        if p.v is None:
            continue
        detuning, damping = p.v.frequency / p.u.frequency - 1, p.v.damping - p.u.damping
        double.append(Double(p.number, p.u.frequency, detuning, damping, damping / lost,
                             -detuning * p.number * math.pi / impedance))  # fmt: skip
    if not double:
        return None
    detunings, dampings = np.array([(d.detuning, d.damping) for d in double]).T
    middle = float(np.median(detunings)), float(np.median(dampings))
    spread = (float(np.median(np.abs(x - m))) for x, m in zip((detunings, dampings), middle, strict=True))
    detuning_spread, damping_spread = spread
    return Across(middle[0], detuning_spread, middle[1], damping_spread, tuple(double))


@dataclass(frozen=True)
class Own:
    """The law of v for a preset."""

    stiffness: float  # neck.stiffness_across
    longer: float  # m, neck.longer_across
    misfit: float  # its error in detunings and dampings, weighted mean, over the error of a v equal to u


def fit_own(string: String, neck: Neck, found: Sequence[Found]) -> Own | None:
    """Fits `neck.stiffness_across` and `neck.longer_across` to the partials `found` of two lines of an open string.

    string: with fitted f0, tension and losses; neck: with the admittance that u meets. For each stiffness the length is
    the weighted median of the lengths that fit the detunings; the stiffness minimises the error of detunings and
    dampings, averaged. None for fewer than `FEWEST` such partials, or if no law leaves less than `BEATEN` of them.
    """
    double = [p for p in found if p.v is not None]
    if len(double) < FEWEST:
        return None
    problem = _Problem(string, neck, double)
    bends = bool(neck.admittance.table) or any(r.shape for r in neck.admittance.resonances)
    tried = [problem.best(h) for h in (np.geomspace(SOFTEST, STIFFEST, COARSE) if bends else [1.0])]
    good = [own for own in tried if own.misfit <= AS_GOOD * min(o.misfit for o in tried)]
    own = min(good, key=lambda o: abs(math.log(o.stiffness)))
    if bends:
        step = (STIFFEST / SOFTEST) ** (1 / (COARSE - 1))
        near = np.clip(own.stiffness * np.geomspace(1 / step, step, FINE), SOFTEST, STIFFEST)
        own = min((own, *map(problem.best, near.tolist())), key=lambda o: o.misfit)
    return own if own.misfit < BEATEN else None


class _Problem:
    """Partials (n,) of two lines, and the law that a stiffness gives."""

    def __init__(self, string: String, neck: Neck, double: Sequence[Found]) -> None:
        self.neck, self.string = neck, string
        lines = [(p.u, p.v) for p in double if p.v is not None]
        self.number = np.array([float(p.number) for p in double])
        self.nu, self.sigma = np.array([(u.frequency, u.damping) for u, _ in lines]).T
        self.ratio = np.array([v.frequency / u.frequency for u, v in lines])
        self.less = np.array([u.damping - v.damping for u, v in lines])
        self.weight = np.array([min(u.amplitude, v.amplitude) for u, v in lines]) ** FAINTER

    def best(self, stiffness: float) -> Own:
        """Returns the law with this stiffness and its best length."""
        neck = replace(self.neck, stiffness_across=float(stiffness), longer_across=0.0)
        s = speaking(self.string, neck, 0)
        moved = frequencies_across(s, self.number, self.nu) / self.nu
        requested = moved / self.ratio - 1
        longer = float(np.clip(_median(requested, self.weight) * s.length, -LONGEST, LONGEST))
        off = self.ratio - moved / (1 + longer / s.length)
        left = self.less - (self.sigma - dampings_across(s, self.number, self.nu, self.nu, self.sigma))
        parts = (self._share(off, self.ratio - 1), self._share(left, self.less))
        return Own(float(stiffness), longer, float(np.mean(parts)))

    def _share(self, left: Floats, of: Floats) -> float:
        """Weighted mean size of the remainder `left`, relative to `of`."""
        return float(np.sum(self.weight * np.abs(left)) / (np.sum(self.weight * np.abs(of)) + 1e-300))


def _median(values: Floats, weight: Floats) -> float:
    """The weighted median."""
    order = np.argsort(values)
    share = np.cumsum(weight[order]) / np.sum(weight)
    return float(values[order[int(np.argmax(share >= 0.5))]])


def heard_of_both(s: Speaking, found: Sequence[Found], level: float, own: bool) -> Floats:
    """Dampings of u (n,), 1/s, with which u and v of open string `s` together sound as damped as `found`.

    level: of v over u as the note begins. The audible damping is the slope of a line through the level
    over `DOWN` dB. own: the law of v comes from these partials, and u stays near its own damping where v was found.
    """
    nu, heard = np.array([(p.frequency, p.damping) for p in found]).T
    if level == 0 or not s.own_across:
        return np.asarray(heard)
    number = np.array([float(p.number) for p in found])
    both_found = np.array([own and p.v is not None for p in found])
    alone = np.array([p.u.damping if two else p.damping for p, two in zip(found, both_found, strict=True)])
    nu_across = frequencies_across(s, number, nu)
    tried = heard * np.geomspace(*U_OVER_HEARD, TRIED)[:, None]  # (tried, n)
    other = np.array([dampings_across(s, number, nu, nu_across, sigma) for sigma in tried])
    t = np.linspace(0.0, 1.0, INSTANTS)[:, None, None] * HEARD / heard  # (instants, 1, n)
    both = np.log(np.abs(np.exp(-tried * t) + level * np.exp((2j * math.pi * (nu_across - nu) - other) * t)) + 1e-300)
    centred = t - t.mean(axis=0)
    slope = -np.sum(centred * both, axis=0) / np.sum(centred**2, axis=0)
    off = np.abs(np.log(np.maximum(slope, 1e-3 * heard) / heard))
    best = np.argmin(off + np.where(both_found, BY_ITSELF, ELSE) * np.abs(np.log(tried / alone)), axis=0)
    return np.asarray(np.take_along_axis(tried, best[None], axis=0)[0])


def level_across(bass: Instrument, name: str) -> float:
    """The level of v over u on string `name` of `bass` at the beginning of a note, plucked at medium force.

    0 where v is inaudible: on a slapped bass, or one plucked straight upwards.
    """
    player = bass.player
    if player.technique == "slap":
        return 0.0
    angle = player.pluck_angle + player.angle_when_hard / 2
    if player.stroke == "pick":
        angle = player.pick.angle or player.pluck_angle
    if bass.output.kind == "displacement":
        sensed = abs(bass.output.across)
    else:
        under = pickups_under(bass.output, name)
        whole = sum(abs(p.level) for p in under)
        sensed = sum(abs(p.level * p.across) for p in under) / whole if whole else 0.0
    return sensed * math.tan(min(abs(angle), STEEPEST))
