"""How it goes, in a line: load, overload, underruns, level, and what each string plays. [main thread]"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from livebass.stage import Meters, Stage

QUIETEST = -99.0  # dB


@dataclass(frozen=True)
class Reading:
    """The meters since the last reading, and the median load of the blocks since (0 where there was none)."""

    meters: Meters
    median: float

    @property
    def troubles(self) -> tuple[int, int, int, int]:
        """What somebody who reads a log wants to hear of when it changes."""
        m = self.meters
        return m.underruns, m.overload, m.faults, m.lost

    def text(self) -> str:
        """Load first, then trouble if there is any."""
        m = self.meters
        parts = [f"load {self.median:.0%} (worst {m.worst:.0%})"]
        if m.overload:
            parts.append(f"OVERLOAD: {m.overload} string{'s' * (m.overload > 1)} coarse")
        parts.append(f"underruns {m.underruns}")
        if m.faults:
            parts.append(f"faults {m.faults}")
        if m.lost:
            parts.append(f"{m.lost} frames not recorded")
        parts.append(f"{decibels(m.peak):.0f} dB")
        return ", ".join(parts)


class Gauge:
    """Reads the meters of `stage`."""

    def __init__(self, stage: Stage) -> None:
        self.stage = stage
        self.worst = 0.0  # load of a block so far
        self._counts = stage.record["histogram"][0].copy()

    def read(self) -> Reading:
        meters = self.stage.meters()
        self.worst = max(self.worst, meters.worst)
        counts = self.stage.record["histogram"][0].copy()
        since, self._counts = counts - self._counts, counts
        return Reading(meters, median_load(since))


def median_load(counts: np.ndarray) -> float:
    """The load that half of the blocks stay below, from a histogram with 4 bins an octave, bin 32 from 1 on."""
    total = int(counts.sum())
    if not total:
        return 0.0
    k = int(np.searchsorted(np.cumsum(counts), 0.5 * total))
    return float(2.0 ** ((k - 31.5) / 4.0))


def strings(stage: Stage) -> str:
    """`E0 A3* D- G-`: the fret of each string that sounds, with a star where it has touched a fret since the pluck."""
    bass = stage.bass
    if bass is None:
        return ""
    return " ".join(
        f"{name}{fret}{'*' * touching}" if sounding else f"{name}-" for name, fret, sounding, touching in bass.fingers()
    )


def decibels(peak: float) -> float:
    """Of full scale, not below `QUIETEST`."""
    return max(QUIETEST, 20.0 * math.log10(peak)) if peak > 0.0 else QUIETEST
