"""The neck as a string meets it: the admittance of its moving end, and the surface below, which it may hit.

Admittance. Convention: exp(+i omega t), and Y is the velocity of the neck over the force of the string on it, m/s/N:
its real part is never negative. A string of impedance Z = mu c that ends there obeys tan(k L) = i Z Y; a small Z Y
shifts mode j by i Z Y / (j pi) of its angular frequency. Hence eq. 9 of Issanchou et al. (2018), and eq. 8 with a minus
sign: the plus in print is for exp(-i omega t). A neck that yields like a spring (Im Y > 0) makes the string longer and
flatter; a neck that yields like a mass makes it sharper.

Surface. The board of a neck, with or without frets, is a table of (m from the nut, m relative to the open string at
rest), ascending in the first, with straight lines between. Each grid point stands for one step of the string: it is as
high as the surface there, or as a crown within its step.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import ArrayLike, NDArray

from livebass.kernels.string import law, note
from livebass.rows.arrays import Complexes, Floats

FREE_PART = 0.6  # of the scale length, from nut to body, unless a preset says otherwise
MAX_SHAPE = 40  # number of the highest bending mode
CROWN = 1e-3  # m, half the width of a crown at its foot
BOW_STEP = 2e-3  # m, length of a bow's straight segments

Surface = tuple[tuple[float, float], ...]  # (m from the nut, m above the open string at rest), ascending; or none: ()


@dataclass(frozen=True)
class Resonance:
    """One vibration of the neck as the string feels it: a mass on a spring and a damper."""

    frequency: float  # Hz
    quality: float  # Q
    mass: float  # kg, effective where the string ends
    shape: int = 1  # number of the bending mode, 1 the lowest; 0: the whole bass moves, the same everywhere


@dataclass(frozen=True)
class Admittance:
    """Y at the end of the string: a sum of resonances, or a measured table, zero outside. Empty: a rigid neck.

    `stop` adds to either.
    """

    resonances: tuple[Resonance, ...] = ()
    table: tuple[tuple[float, float, float], ...] = ()  # (Hz, Re Y, Im Y), m/s/N, ascending
    stop: float = 0.0  # m/s/N, Re Y at every frequency: of the fret and the finger behind it

    def __bool__(self) -> bool:
        return bool(self.resonances or self.table or self.stop)

    def at(self, frequency: ArrayLike) -> Complexes:
        """Y at `frequency` (Hz, any shape), m/s/N.

        A resonance adds (i omega / m) / (omega_r^2 - omega^2 + i omega omega_r / Q).
        """
        nu = np.asarray(frequency, np.float64)
        y: Complexes = np.full(nu.shape, self.stop, np.complex128)
        if self.resonances:
            f, q, mass = np.array([(r.frequency, r.quality, r.mass) for r in self.resonances]).T
            real, imaginary = law.resonance(f, q, mass, nu[..., None])
            y = y + nu * (np.sum(real, axis=-1) + 1j * np.sum(imaginary, axis=-1))
        if self.table:
            known, real, imaginary = np.array(self.table).T
            y = y + np.interp(nu, known, real, 0.0, 0.0) + 1j * np.interp(nu, known, imaginary, 0.0, 0.0)
        return y

    def parts(self, place: float, free_length: float) -> tuple[float, ...]:
        """Fraction by which a force `place` (m) from the nut moves the nut: for each resonance, then for the table.

        The neck is free over `free_length` (m) from the nut. A resonance counts by its bending shape; a table, whose
        vibrations are unknown, by the first shape. Bending ends at the body.
        """
        return tuple(bending_shape(k, place / free_length) for k in (*(r.shape for r in self.resonances), 1))


def detuning(y: ArrayLike, impedance: float, mode: ArrayLike) -> Floats:
    """Relative shift of a mode by the neck, a term of nu_j / (j f0): -(mu c / (j pi)) Im Y.

    Eq. 8 with the sign for exp(+i omega t). y: Y at omega_{0,j}, m/s/N; impedance: mu c, kg/s; mode: j. Shaped as y.
    """
    return np.asarray(law.detuning(np.imag(y), impedance, np.asarray(mode)))


def neck_damping(y: ArrayLike, impedance: float, fundamental: float) -> Floats:
    """Damping of a mode by the neck, a term of sigma_j: (mu c^2 / L) Re Y, 1/s; eq. 9 times pi nu_j.

    y: Y at omega_j, m/s/N; impedance: mu c, kg/s; fundamental: f0, Hz, as c / L = 2 f0. Shaped as y.
    """
    return np.asarray(law.neck_damping(np.real(y), impedance, fundamental))


@lru_cache(maxsize=1 << 12)  # all strings meet the same places
def bending_shape(number: int, place: float) -> float:
    """Displacement at `place` of a beam, free at 0 and clamped at 1, in its bending mode `number`; 1 at 0.

    It is 0 beyond the clamp, in the body. Number 0 means no bending: 1 everywhere. Euler-Bernoulli: cosh - cos
    - s (sinh - sin) of beta times the distance from the clamp, written to avoid cancelling large numbers.
    """
    if number == 0:
        return 1.0
    if place >= 1:
        return 0.0
    beta = _root(number)
    z = beta * (1 - place)
    grows = (math.exp(-beta) + math.cos(beta) + math.sin(beta)) / (math.cosh(beta) + math.cos(beta))  # 1 - s
    value = grows / 2 * math.exp(z) + (1 - grows / 2) * math.exp(-z) - math.cos(z) + (1 - grows) * math.sin(z)
    return value / (2 if number % 2 else -2)


@lru_cache
def _root(number: int) -> float:
    """The root beta of cos(beta) + 1 / cosh(beta) near (number - 1/2) pi, by Newton's method."""
    beta = (number - 0.5) * math.pi
    for _ in range(8):
        value = math.cos(beta) + 1 / math.cosh(beta)
        beta += value / (math.sin(beta) + math.tanh(beta) / math.cosh(beta))
    return beta


def fretted_surface(positions: tuple[float, ...], heights: tuple[float, ...], above: float, end: float) -> Surface:
    """A board from the nut to `end` with frets on it, all in m.

    The crowns are triangles at `positions`, CROWN wide to either side, with their tops at `heights` and `above` the
    wood.
    """
    x, crown = np.asarray(positions), np.asarray(heights)
    feet = np.concatenate([[0.0], x - CROWN, x, x + CROWN, [end]])
    wood = np.interp(feet, x, crown - above)
    wood[len(x) + 1 : 2 * len(x) + 1] += above
    return _table(feet, wood)


def wooden_surface(positions: tuple[float, ...], heights: tuple[float, ...], end: float, bowed: bool) -> Surface:
    """A bare board from the nut to `end` through `positions` and `heights`, all in m.

    It is straight before the first and after the last. bowed: between them it follows the parabola through them, as by
    geometry; otherwise it is straight from point to point.
    """
    x, h = np.asarray(positions), np.asarray(heights)
    inner = x
    if bowed and x.size > 2:
        inner = np.linspace(x[0], x[-1], max(2, math.ceil((x[-1] - x[0]) / BOW_STEP)))
        rows = np.column_stack([x, h]).ravel()
        h = np.asarray(note.bow_through(rows, 0, x.size, inner))
    first, last = (float(h[0]), float(h[0])) if x.size == 1 else _ends(inner, h, end)
    return _table(np.concatenate([[0.0], inner, [end]]), np.concatenate([[first], h, [last]]))


def _ends(x: Floats, h: Floats, end: float) -> tuple[float, float]:
    """Heights at the nut and at `end`, extrapolated from the first two and the last two places."""
    first = h[0] - (h[1] - h[0]) / (x[1] - x[0]) * x[0]
    last = h[-1] + (h[-1] - h[-2]) / (x[-1] - x[-2]) * (end - x[-1])
    return float(first), float(last)


def _table(x: Floats, height: Floats) -> Surface:
    """The surface through the sorted points; at each place the first point counts."""
    order = np.argsort(x, kind="stable")
    keep = np.concatenate([[True], np.diff(x[order]) > 0])
    return tuple((float(a), float(b)) for a, b in zip(x[order][keep], height[order][keep], strict=True))


def height_at(surface: Surface, place: float) -> float:
    """Height (m) of `surface` at `place` (m from the nut)."""
    table = np.array(surface)
    return float(np.interp(place, table[:, 0], table[:, 1]))


def surface_beyond(surface: Surface, stop: float, height: float, total: float) -> Surface:
    """The part of `surface` beyond a stop, relative to the stopped string.

    stop: m from the nut, at `height` (m); total: m from the nut to the saddle. Places in the result count from the
    stop, heights from the straight line between stop and saddle.
    """
    lists = [0.0] * (2 * len(surface) + 2)
    end = note.surface_beyond(flat(surface), 0, len(surface), stop, height, total, lists, 0)
    return rows_of(lists, 0, end // 2)


def flat(rows: Iterable[tuple[float, ...]]) -> list[float]:
    """The numbers of `rows`, one after the other."""
    return [number for row in rows for number in row]


def rows_of(numbers: Sequence[float], first: int, count: int) -> tuple[tuple[float, float], ...]:
    """The `count` pairs from index `first`."""
    return tuple((float(numbers[k]), float(numbers[k + 1])) for k in range(first, first + 2 * count, 2))


def surface_on_grid(surface: Surface, length: float, points: int) -> tuple[Floats, Floats]:
    """Places (m from the stop) and heights (m), each (n,), of the n grid points above the surface.

    surface: as from `surface_beyond`; the grid has `points` steps over `length` (m).
    """
    if not surface:
        return np.zeros(0), np.zeros(0)
    table, step = np.array(surface), length / points
    first = max(1, math.ceil(table[0, 0] / step - 1e-9))
    place = np.arange(first, min(points - 1, math.floor(table[-1, 0] / step + 1e-9)) + 1) * step
    height = np.interp(place, table[:, 0], table[:, 1])
    cell = np.rint(table[:, 0] / step).astype(int) - first
    peak = (cell >= 0) & (cell < place.size) & _peaks(table[:, 1])
    np.maximum.at(height, cell[peak], table[peak, 1])
    return place, height


def _peaks(height: Floats) -> NDArray[np.bool_]:
    """Mask of crowns: places no lower than their neighbours. The first place is never one."""
    before, after = np.concatenate([[np.inf], height[:-1]]), np.concatenate([height[1:], [-np.inf]])
    return (height >= before) & (height >= after)
