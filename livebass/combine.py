"""One list of partials from several takes of the same string: medians, and how far the takes differ."""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from livebass.modal_motion import t60
from livebass.partials import Partial

NORMAL_95 = 1.959964


@dataclass(frozen=True)
class Found:
    """A partial over all takes. Uncertainties are expanded, 95 %."""

    number: int  # j
    frequency: float  # Hz, median
    damping: float  # 1/s, median
    frequency_u: float  # Hz
    damping_u: float  # 1/s
    level_db: float  # of its amplitude below that of the strongest partial, median
    takes: int  # in which it was found
    twin_frequency: float  # Hz, of a weaker one beside it, NaN if there is none; as is the next
    twin_damping: float  # 1/s

    @property
    def t60(self) -> float:
        """Time in which it falls by 60 dB, s."""
        return float(t60(self.damping))


def combine(tracks: Sequence[Sequence[Partial]]) -> list[Found]:
    """One list of partials from those of several takes: medians of what half of the takes or more have.

    The uncertainty comes from the scatter over the takes (Student's t, 95 %), and with one take from the noise in it.
    """
    loudest = [max(p.amplitude for p in partials) for partials in tracks]
    seen: dict[int, list[tuple[Partial, float]]] = defaultdict(list)
    for partials, top in zip(tracks, loudest, strict=True):
        for p in partials:
            seen[p.number].append((p, 20 * math.log10(p.amplitude / top)))
    found: list[Found] = []
    for j in sorted(seen):
        if 2 * len(seen[j]) < len(tracks):
            continue
        group = [p for p, _ in seen[j]]
        frequency, u_frequency = _median([p.frequency for p in group], [p.frequency_sd for p in group])
        damping, u_damping = _median([p.damping for p in group], [p.damping_sd for p in group])
        twins = [p.twin for p in group if p.twin is not None]
        both = len(twins) * 2 >= len(group) and bool(twins)
        if found and frequency <= found[-1].frequency:
            continue
        level = float(np.median([level for _, level in seen[j]]))
        found.append(Found(
            j, frequency, damping, u_frequency, u_damping, level, len(group),
            float(np.median([t.frequency for t in twins])) if both else math.nan,
            float(np.median([t.damping for t in twins])) if both else math.nan,
        ))  # fmt: skip
    return found


def _median(values: list[float], bounds: list[float]) -> tuple[float, float]:
    """Median and its expanded uncertainty, 95 %."""
    n = len(values)
    if n == 1:
        return values[0], NORMAL_95 * bounds[0]
    from scipy.special import stdtrit

    efficiency = math.sqrt(math.pi / 2) if n > 2 else 1.0  # of a median; that of two is their mean
    spread = efficiency * float(np.std(values, ddof=1)) / math.sqrt(n)
    return float(np.median(values)), float(stdtrit(n - 1, 0.975)) * spread
