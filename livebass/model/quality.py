"""Computing precision: the quality tiers, and the limits of a requested pluck.

The command line reads its ranges here, so this file imports nothing slow.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import NamedTuple

from livebass.rows.bounds import one_of, refusal, within
from livebass.rows.units import DIMENSIONS, readable_quantity

MAX_MODES = 1024
BLOCK = 16, 1024  # frames in a block of live sound, least and most
CORES = 1, 64  # used in live playing, least and most
MIN_CONTACT_RATE, MAX_CONTACT_RATE = 44_100.0, 64e6  # Hz
# Loss c of Hunt and Crossley (`Neck.loss`: contact_loss over contact_stiffness), s/m: contact parts no faster than at
# 1 / c. From this value on lower contact rates are about as close to `reference`, for a K of 3e8 to 3e10.
ENDS_SOON = 5.0


@dataclass(frozen=True)
class Quality:
    """A tier of precision: number of modes, and contact rate. The same kernels compute all tiers.

    Contact with enough loss ends soon and is not chaotic: then `damped_rates` suffice. Over a lossless board contact
    goes on from point to point, and needs the modes and the rate of `on_board`.
    """

    name: str
    modes: int | None  #: of the open string, proportionally fewer on stopped ones; None: all that the grid carries
    contact_rate: float  #: Hz, 1/dt of eq. 12; the engine takes the next whole multiple of the audio rate
    on_board: Quality | None = None  #: for strings over a lossless board; None: the same

    #: Hz, contact rates over frets and over a board with a loss of ENDS_SOON or more; None: the same
    damped_rates: tuple[float, float] | None = None
    exact: bool = False  #: all modes in float64, not the lowest alone

    def for_contact(self, loss: float, board: bool) -> Quality:
        """Returns the quality for contact with a `board` or with frets whose loss c is `loss`, s/m."""
        if board and loss == 0.0 and self.on_board is not None:
            return self.on_board
        if loss >= ENDS_SOON and self.damped_rates is not None:
            return replace(self, contact_rate=self.damped_rates[board])
        return self


#: The three tiers by name, "live", "studio" and "reference", from the coarsest to the finest. `livebass help cost` and
#: docs/notes/quality.md say how far apart they are.
QUALITIES = {
    "live": Quality("live", 450, 672e3, on_board=Quality("live", None, 2.5e6), damped_rates=(336e3, 240e3)),
    "studio": Quality("studio", 600, 4e6, on_board=Quality("studio", None, 4e6), damped_rates=(1.344e6, 672e3)),
    "reference": Quality("reference", None, 8e6, exact=True),
}
AUTO = "auto"  # in place of a name: the quality this machine can run (livebass/live/best_quality.py)


def quality_with(name: str, modes: int | None = None, contact_rate: float | None = None) -> Quality:
    """Returns the tier `name` with other modes or another contact rate, also over a board.

    Args:
        name: "live", "studio" or "reference".
        modes: Number of modes of the open string, 1 to 1024; by default the tier's.
        contact_rate: Fine steps a second during contact, 44 100 to 64 000 000 Hz; by default the tier's.

    Raises:
        ValueError: An unknown tier, or a value out of these limits.

    Example:
        >>> quality_with("studio", modes=64).modes
        64
    """
    one_of("quality", name, QUALITIES)
    quality = QUALITIES[name]
    if modes is not None:
        within("modes", modes, 1, MAX_MODES, whole=True)
        board = quality.on_board and replace(quality.on_board, modes=modes)
        quality = replace(quality, modes=modes, on_board=board)
    if contact_rate is not None:
        within("contact rate", contact_rate, MIN_CONTACT_RATE, MAX_CONTACT_RATE, "Hz")
        board = quality.on_board and replace(quality.on_board, contact_rate=contact_rate)
        quality = replace(quality, contact_rate=contact_rate, on_board=board, damped_rates=None)
    return quality


def modes_for(quality: Quality, length: float, open_length: float, grid_points: int) -> int:
    """Number of modes of a speaking `length` (m) on a string of `open_length` (m).

    At least 1, at most as many as a grid of `grid_points` steps carries.
    """
    full = min(grid_points - 1, MAX_MODES)
    if quality.modes is None:
        return full
    return max(1, min(full, round(quality.modes * length / open_length)))


class Limits(NamedTuple):
    """The values a quantity may have: `minimum` to `maximum` in SI, both included."""

    dimension: str  # a key of units.DIMENSIONS
    minimum: float
    maximum: float
    whole: bool = False  # whole numbers of the SI unit only

    def check(self, name: str, value: float) -> None:
        """Raises ValueError that says what is allowed if `value` (SI) is outside or NaN."""
        if not self.minimum <= value <= self.maximum or (self.whole and value != int(value)):
            unit = next(unit for unit, size in DIMENSIONS[self.dimension].units.items() if size == 1.0)
            raise refusal(name, str(self), f"{value:.10g} {unit}")

    def __str__(self) -> str:
        kind = "a whole number of Hz " if self.whole else ""
        minimum, maximum = (
            readable_quantity(end, self.dimension) if end else "0" for end in (self.minimum, self.maximum)
        )
        return f"{kind}from {minimum} to {maximum}"


# For a single pluck in `simulate`, `sweep` and studies.
APEX = Limits("length", -0.030, 0.030)  # below 0: towards the frets
MIN_APEX = 1e-6  # m, either way
ANGLE = Limits("angle", -1.56, 1.56)  # from straight up
AT = Limits("length", 1e-3, 2.0)  # from the stop; it must also be on the string
DURATION = Limits("time", 1e-4, 60.0)
RATE = Limits("frequency", 22050, 192_000, whole=True)
CONTACT_RATE = Limits("frequency", MIN_CONTACT_RATE, MAX_CONTACT_RATE, whole=True)
