"""The cases of Issanchou et al. (2018), by name: string, neck, pluck and contact rate, as in the paper.

The string is the one of preset `paper-g`. Its displacement is taken at 9 mm (u) and 18 mm (v) from the saddle, at
51.2 kHz, as in the measurements (section 3.1).
"""

from __future__ import annotations

import functools
import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from livebass.engine.prepare import whole_contact_rate
from livebass.model.instrument import Neck, Pluck, Speaking, String, speaking
from livebass.model.modes import dampings
from livebass.model.trial import Trial
from livebass.preset.load import load_preset
from livebass.sound.analysis import PAPER_RATE

PRESET = "paper-g"
DEFAULT_PLACE = 0.64  # m from the nut
OBLIQUE = (3.1e-3, 2.2e-3)  # m along u and v


_bass = functools.cache(load_preset)  # a shipped bass, read once


@dataclass(frozen=True)
class Case:
    """One pluck of the paper: its differences from the usual string, neck and place."""

    name: str
    title: str
    section: str
    apex: float  # m, the string's greatest displacement before rounding
    contact_rate: float  # Hz
    position: float = DEFAULT_PLACE  # m from the nut
    angle: float = 0.0  # rad
    duration: float = 1.0  # s
    string: Callable[[String], String] = lambda string: string
    neck: Callable[[Neck], Neck] = lambda neck: neck
    preset: str = PRESET
    rounding: float | None = None  # m, of the corner before the release; None: the preset's

    def speaking(self) -> Speaking:
        """The open string over its neck."""
        bass = _bass(self.preset)
        return speaking(self.string(bass.strings[0]), self.neck(bass.necks[0]), 0)

    def trial(self, rate: int = PAPER_RATE) -> Trial:
        """The trial to solve, with all modes, at output rate `rate` (Hz)."""
        bass = _bass(self.preset)
        s = self.speaking()
        rounding = bass.player.rounding if self.rounding is None else self.rounding
        pluck = Pluck(self.apex, self.position, rounding, self.angle)
        sensors = s.length - bass.output.sensor, s.length - bass.output.sensor_v
        return Trial(
            s, pluck, s.grid_points - 1, whole_contact_rate(self.contact_rate, rate), rate, self.duration, sensors[0],
            sensor_v=sensors[1],
        )  # fmt: skip


def without_dispersion(string: String) -> String:
    """`string` with harmonic frequencies (B = 0 in eq. 8) and the same dampings (section 4.2.1)."""
    bass = _bass(PRESET)
    s = speaking(string, bass.necks[0], 0)
    count = s.grid_points - 1
    harmonics = tuple(float(f) for f in s.fundamental * np.arange(1, count + 1))
    return replace(string, measured_frequencies=harmonics, measured_dampings=tuple(map(float, dampings(s, count))))


def straighten(gap: float | None = None) -> Callable[[Neck], Neck]:
    """A neck whose inner frets are raised towards the line from its first to its last (section 4.2.3).

    All move by the same fraction of the way, so fret 12 ends `gap` (m) under the string at rest; None: up to the line.
    """

    def changed(neck: Neck) -> Neck:
        x, h = np.array(neck.fret_positions), np.array(neck.fret_heights)
        way = np.interp(x, x[[0, -1]], h[[0, -1]]) - h
        part = 1.0 if gap is None else (-gap - h[11]) / way[11]
        return replace(neck, fret_heights=tuple(map(float, h + part * way)))

    return changed


def raise_fret(fret: int, by: float) -> Callable[[Neck], Neck]:
    """A neck with one fret raised by `by` (m)."""

    def changed(neck: Neck) -> Neck:
        heights = list(neck.fret_heights)
        heights[fret - 1] += by
        return replace(neck, fret_heights=tuple(heights))

    return changed


def soften(stiffness: float) -> Callable[[Neck], Neck]:
    """A neck with frets of another stiffness, K (section 4.2.4)."""
    return lambda neck: replace(neck, contact_stiffness=stiffness)


PLAYED = ("a", "b", "c")  # cases played and shown on the page
CASES = {
    case.name: case
    for case in (
        Case("a", "Case A: no contact, 0.87 mm", "4.1", 0.87e-3, 51_200),
        Case("b", "Case B: 3.6 mm", "4.1.1", 3.6e-3, 8e6),
        Case("c", "Case C: 7.8 mm", "4.1.2", 7.8e-3, 16e6),
        Case(
            "oblique", "Oblique pluck: 3.1 mm up, 2.2 mm across", "4.1.3", math.hypot(*OBLIQUE), 8e6,
            angle=math.atan2(OBLIQUE[1], OBLIQUE[0]),
        ),
        Case("harmonic", "Case B without dispersion", "4.2.1", 3.6e-3, 8e6, string=without_dispersion),
        Case("near-bridge", "Plucked at L - 0.1 m", "4.2.2", 3.6e-3, 4e6, position=0.763),
        Case("middle", "Plucked at L/2", "4.2.2", 3.6e-3, 4e6, position=0.4315),
        Case("near-nut", "Plucked at 0.1 m", "4.2.2", 3.6e-3, 4e6, position=0.1),
        Case("neck", "Softly over the measured neck, 1.8 mm", "4.2.3", 1.8e-3, 2e6, position=0.6),
        Case(
            "half-straight", "The neck straightened to 2 mm", "4.2.3", 1.8e-3, 2e6, 0.6,
            neck=straighten(2e-3),
        ),
        Case("straight", "The neck straight", "4.2.3", 1.8e-3, 2e6, 0.6, neck=straighten()),
        Case("sixth-fret", "The sixth fret up by 0.5 mm", "4.2.3", 1.8e-3, 2e6, 0.6, neck=raise_fret(6, 0.5e-3)),
        Case("soft", "Case B, frets of K = 1e9", "4.2.4", 3.6e-3, 4e6, neck=soften(1e9)),
        Case("fretless", "A fretless bass, plucked as in case B", "5", 3.6e-3, 8e6, preset="paper-fretless"),
        Case("one-contact", "Laboratory string over one point", "2", 1e-3, 4e6, 0.7515, preset="one-contact"),
    )
}  # fmt: skip
