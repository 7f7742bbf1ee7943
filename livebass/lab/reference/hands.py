"""Hands for the brute-force solver: a finger that touches (dashpot), a stop that moves (stiff spring), a mass (thumb).

A hand lies on the string at `place` with the half-width `width`: it feels u(place) = sum_j s_j q_j and pushes mode j by
s_j times its force, s_j = phi_j(place) exp(-(k_j width)^2 / 2). Places are in m from the stop of the speaking string,
heights in m above the string at rest, times in s from the release of the pluck. A hand comes at the fine step nearest
to its start; an immediate force acts from half a step before.

`livebass.lab.reference.playing.play` plays them; livebass.lab.reference.stepping has their equations.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from livebass.rows.arrays import Floats
from livebass.rows.bounds import one_of, refusal

# Heights (n,), m, at the times (n,), s since it began, of a path that begins at the string: at its height (m) and
# velocity (m/s).
Path = Callable[[Floats, float, float], Floats]
Forces = Callable[[Floats], Floats]  # N, (n,), upwards, at the times (n,), s since it began

WAYS = 0.25e-3, 32e-3  # s, shortest and longest way of a hammer
DENSE, REACH = 0.5, 2.5  # standard deviations between dashpots of `spread`, and to the last one


@dataclass(frozen=True)
class Finger:
    """A finger that touches: a dashpot at a place, in both polarisations.

    The resistance grows linearly over `landing` from `start`, and falls linearly to 0 over `lifting` from `end`.
    """

    place: float  # m
    resistance: float  # R, N s/m
    width: float = 5e-3  # m, half-width a
    start: float = 0.0  # s
    end: float = math.inf  # s
    landing: float = 5e-3  # s
    lifting: float = 15e-3  # s

    def __post_init__(self) -> None:
        _check_hand(self, ("resistance", "landing", "lifting"))

    def resistances(self, time: Floats) -> Floats:
        """R (N s/m), (n,), at `time` (s), (n,)."""
        landed = (time - self.start) / self.landing if self.landing else 1.0 * (time >= self.start)
        lifted = (time - self.end) / self.lifting if self.lifting else 1.0 * (time >= self.end)
        return self.resistance * np.clip(landed, 0, 1) * np.clip(1 - lifted, 0, 1)


def spread(finger: Finger, length: float) -> list[Finger]:
    """A finger as point dashpots side by side; their resistances are a Gaussian of standard deviation `width`.

    A `Finger` itself feels the mean motion along its width. A spread finger feels every wave locally. Dashpots beyond
    the ends of the string, of that `length` (m), are omitted.
    """
    z = np.arange(-REACH, REACH + DENSE, DENSE)
    weights = np.exp(-(z**2) / 2)
    parts = finger.resistance * weights / weights.sum()
    return [
        replace(finger, place=finger.place + float(x), resistance=float(r), width=0.0)
        for x, r in zip(z * finger.width, parts, strict=True)
        if 0 < finger.place + x < length
    ]


@dataclass(frozen=True)
class Stop:
    """A moving stop: a spring between the string and a point that follows a path, from `start` until it is removed.

    side: 0 holds the string from both sides, 1 presses from above only, like a finger, -1 from below, like a fret.
    across: the path of v, the second polarisation, held from both sides; None leaves v alone.
    """

    place: float  # m
    path: Path
    start: float = 0.0  # s
    end: float = math.inf  # s
    stiffness: float = 1e8  # N/m
    width: float = 0.0  # m, half-width
    side: int = 0
    across: Path | None = None

    def __post_init__(self) -> None:
        _check_hand(self, ("stiffness",))
        one_of("side of a Stop", self.side, (-1, 0, 1))


@dataclass(frozen=True)
class Mass:
    """A mass that strikes the string from above (thumb): contact with the loss of Hunt and Crossley, along u alone.

    Contact of eq. 6, f = K [eta]_+^alpha (1 + beta d(eta)/dt), never below 0, as a force at a point. The mass begins at
    `height`, moving down at `speed`, and is removed at `end`.
    """

    place: float  # m
    speed: float  # m/s, downwards
    mass: float = 0.03  # kg
    stiffness: float = 7e5  # K, N/m^alpha
    exponent: float = 1.5  # alpha
    loss: float = 0.35  # beta, s/m
    width: float = 5e-3  # m, half-width
    start: float = 0.0  # s
    end: float = math.inf  # s
    height: float | None = None  # m; None: where the string is
    force: Forces | None = None  # of the hand that holds the mass; None: 0 N

    def __post_init__(self) -> None:
        _check_hand(self, ("stiffness", "loss"))
        if not self.mass > 0 or not self.exponent >= 1:
            rule = "more than 0 kg with an exponent of at least 1"
            raise refusal("Mass", rule, f"{self.mass:g} kg with {self.exponent:g}")


Hand = Finger | Stop | Mass


def _check_hand(hand: Hand, positive: tuple[str, ...]) -> None:
    """Raises ValueError that names an invalid value of `hand`."""
    kind = type(hand).__name__
    for name in (*positive, "width", "start"):
        value = getattr(hand, name)
        if not 0 <= value < math.inf:
            raise refusal(f"{name} of a {kind}", "0 or more", f"{value:g}")
    if not hand.end > hand.start:
        raise refusal(f"end of a {kind}", f"after its start, {hand.start:g} s", f"{hand.end:g} s")


def hold_still(height: float) -> Path:
    """Path of a stop that stays at `height` (m)."""
    return lambda time, _begin, _velocity: np.full(time.shape, height)


def follow(times: Floats, heights: Floats) -> Path:
    """Path straight between `heights` (n,), m, at `times` (n,), s since it began; it stays at the last one."""
    return lambda time, _begin, _velocity: np.interp(time, times, heights)


def landing(height: float, seconds: float) -> Path:
    """Path from the string's position and velocity to rest at `height` (m) after `seconds`: a cubic."""

    def path(time: Floats, begin: float, velocity: float) -> Floats:
        z = np.minimum(time / seconds, 1.0)
        return begin + (height - begin) * z * z * (3 - 2 * z) + velocity * seconds * z * (1 - z) ** 2

    return path


def hammer(height: float, speed: float) -> Path:
    """Path of a hammer-on: down to `height` (m), where it arrives at `speed` (m/s) and stops dead.

    It begins with the string's velocity; from rest, the acceleration is constant. Its duration lies between the two
    times of WAYS. A string below `height` is lifted there in the same way.
    """

    def path(time: Floats, begin: float, velocity: float) -> Floats:
        seconds = min(max(2 * abs(height - begin) / speed, WAYS[0]), WAYS[1])
        z = np.minimum(time / seconds, 1.0)
        return height + (begin - height) * (1 - z) * (1 + z) + velocity * seconds * z * (1 - z) ** 2

    return path


def lift(force: float, after: float) -> Forces:
    """Force (N, upwards) of a hand that pulls its mass away from `after` s after it began."""
    return lambda time: np.where(time >= after, force, 0.0)
