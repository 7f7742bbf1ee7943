"""Quality tiers: how many modes, how fine the contact steps. One kernel runs them all."""

from __future__ import annotations

from dataclasses import dataclass, replace

MOST_MODES = 1024
LEAST_CONTACT_RATE, MOST_CONTACT_RATE = 44_100.0, 64e6


@dataclass(frozen=True)
class Quality:
    """`modes` count for the open string, a stopped one has proportionally fewer; None: all the grid has."""

    name: str
    modes: int | None
    contact_rate: float  # Hz, at least: raised to a whole multiple of the audio rate


QUALITIES = {
    "live": Quality("live", 400, 384e3),
    "studio": Quality("studio", 600, 4e6),
    "reference": Quality("reference", None, 8e6),
}


def quality_with(name: str, modes: int | None = None, contact_rate: float | None = None) -> Quality:
    """The tier `name`, with `modes` or `contact_rate` (Hz) replaced. ValueError says what is allowed."""
    if name not in QUALITIES:
        raise ValueError(f"quality {name!r}: allowed are {', '.join(QUALITIES)}")
    quality = QUALITIES[name]
    if modes is not None:
        if not 1 <= modes <= MOST_MODES:
            raise ValueError(f"modes {modes}: allowed are 1 to {MOST_MODES}")
        quality = replace(quality, modes=modes)
    if contact_rate is not None:
        if not LEAST_CONTACT_RATE <= contact_rate <= MOST_CONTACT_RATE:
            raise ValueError(
                f"contact rate {contact_rate:g} Hz: allowed are {LEAST_CONTACT_RATE:g} to {MOST_CONTACT_RATE:g} Hz"
            )
        quality = replace(quality, contact_rate=contact_rate)
    return quality


def modes_for(quality: Quality, length: float, open_length: float, grid_points: int) -> int:
    """Modes of a speaking length (m), at most what its grid of `grid_points` steps carries."""
    full = min(grid_points - 1, MOST_MODES)
    if quality.modes is None:
        return full
    return max(1, min(full, round(quality.modes * length / open_length)))
