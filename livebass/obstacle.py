"""What lies under a string where it may touch anywhere: the board of a neck, with or without frets, on a grid.

A surface is a table of (m from the nut, m relative to the open string at rest), ascending, straight lines between. On a
grid of N steps each grid point has a step of it to itself, and is as high as the surface there, or as a crown in that.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Surface = tuple[tuple[float, float], ...]

CROWN = 1e-3  # m, half the foot of a crown on the wood
BOW_STEP = 2e-3  # m, of the lines that make a bow


def fretted_surface(positions: tuple[float, ...], heights: tuple[float, ...], above: float, end: float) -> Surface:
    """Wood from the nut to `end` with crowns `above` it at `positions`: triangles, CROWN wide to either side."""
    x, crown = np.asarray(positions), np.asarray(heights)
    feet = np.concatenate([[0.0], x - CROWN, x, x + CROWN, [end]])
    wood = np.interp(feet, x, crown - above)
    wood[len(x) + 1 : 2 * len(x) + 1] += above
    return _table(feet, wood)


def wooden_surface(positions: tuple[float, ...], heights: tuple[float, ...], end: float, bowed: bool) -> Surface:
    """A board through the given places, from the nut to `end`, straight on before the first and after the last.

    bowed: they lie on a parabola, as those by geometry do, and the board follows it; otherwise it goes straight from
    one to the next.
    """
    x, h = np.asarray(positions), np.asarray(heights)
    inner = x
    if bowed and x.size > 2:
        inner = np.linspace(x[0], x[-1], max(2, math.ceil((x[-1] - x[0]) / BOW_STEP)))
        h = np.polynomial.Polynomial.fit(x, h, 2)(inner)
    first, last = (float(h[0]), float(h[0])) if x.size == 1 else _ends(inner, h, end)
    return _table(np.concatenate([[0.0], inner, [end]]), np.concatenate([[first], h, [last]]))


def _ends(x: Floats, h: Floats, end: float) -> tuple[float, float]:
    """Heights at the nut and at `end`, straight on from the first two and the last two places."""
    first = h[0] - (h[1] - h[0]) / (x[1] - x[0]) * x[0]
    last = h[-1] + (h[-1] - h[-2]) / (x[-1] - x[-2]) * (end - x[-1])
    return float(first), float(last)


def _table(x: Floats, height: Floats) -> Surface:
    order = np.argsort(x, kind="stable")
    keep = np.concatenate([[True], np.diff(x[order]) > 0])
    return tuple((float(a), float(b)) for a, b in zip(x[order][keep], height[order][keep], strict=True))


def height_at(surface: Surface, place: float) -> float:
    """m, at `place` (m from the nut)."""
    table = np.array(surface)
    return float(np.interp(place, table[:, 0], table[:, 1]))


def under(surface: Surface, stop: float, height: float, total: float) -> Surface:
    """The same seen from a string that is stopped at `stop`, `height` (m), and goes to the saddle at `total`.

    From the stop, relative to the straight line to the saddle; only what lies beyond the stop.
    """
    length = total - stop
    rest = [(x - stop, h - height * (total - x) / length) for x, h in surface if stop < x < total]
    if not rest:
        return ()
    return ((0.0, height_at(surface, stop) - height), *rest) if stop >= surface[0][0] else tuple(rest)


def on_grid(surface: Surface, length: float, points: int) -> tuple[Floats, Floats]:
    """Places (m from the stop) and heights (m) of the grid points that have some surface under them.

    The grid has `points` steps over `length` (m); surface as from `under`.
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
    """Which places stand no lower than their neighbours: crowns. The first is none, and no place on a slope."""
    before, after = np.concatenate([[np.inf], height[:-1]]), np.concatenate([height[1:], [-np.inf]])
    return (height >= before) & (height >= after)
