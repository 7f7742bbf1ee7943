"""Pictures of a sweep, as PNG and SVG: a curve over one parameter, maps over two, a row of maps over three."""

from __future__ import annotations

import io
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from livebass.sweep_grid import Axis
from livebass.sweep_quantities import QUANTITIES, Quantity

NEEDED = "the picture needs matplotlib: pip install 'livebass[plots]'; --no-picture does without"
MOST_PANELS = 12  # in a row
MOST_AXES = 3


def check() -> None:
    """LookupError where there is no matplotlib."""
    try:
        import matplotlib.figure  # noqa: F401
    except ImportError:
        raise LookupError(NEEDED) from None


def drawable(axes: Sequence[Axis]) -> bool:
    """Whether a picture shows so many parameters and values."""
    wide = _wide(axes)
    return 1 <= len(wide) <= MOST_AXES and (len(wide) < MOST_AXES or len(wide[0].numbers) <= MOST_PANELS)


def pictures(
    axes: Sequence[Axis], values: dict[str, NDArray[np.float64]], title: str
) -> tuple[bytes, bytes]:
    """PNG and SVG of `values`: by quantity, each of the shape of the grid, NaN where there is none.

    The first of three parameters goes from panel to panel, the last two are up and across.
    """
    import matplotlib as mpl
    from matplotlib.figure import Figure

    wide = _wide(axes)
    shape = tuple(len(axis.numbers) for axis in wide)
    columns = shape[0] if len(wide) == MOST_AXES else 1
    figure = Figure(figsize=(2.5 + 4.5 * columns, 0.6 + 3.4 * len(values)), layout="constrained")
    grid = figure.subplots(len(values), columns, squeeze=False)
    for row, (name, all_values) in zip(grid, values.items(), strict=True):
        quantity, each = QUANTITIES[name], all_values.reshape(shape)
        if len(wide) == 1:
            _curve(row[0], wide[0], quantity, each)
        else:
            _maps(figure, row, wide, quantity, each)
    figure.suptitle(title, fontsize="medium")
    png, svg = io.BytesIO(), io.BytesIO()
    figure.savefig(png, format="png", dpi=110)
    with mpl.rc_context({"svg.hashsalt": "livebass"}):  # the same picture, the same file
        figure.savefig(svg, format="svg", metadata={"Date": None})
    return png.getvalue(), svg.getvalue()


def _wide(axes: Sequence[Axis]) -> list[Axis]:
    """Those with more than one value."""
    return [axis for axis in axes if len(axis.numbers) > 1]


def _curve(panel: Any, axis: Axis, quantity: Quantity, values: NDArray[np.float64]) -> None:
    panel.plot(axis.numbers, values, marker="o", markersize=4)
    panel.set(xlabel=axis.title, ylabel=quantity.title, xscale="log" if axis.log else "linear")
    panel.grid(alpha=0.3)
    if not np.isfinite(values).any():
        panel.text(0.5, 0.5, "none", transform=panel.transAxes, ha="center")


def _maps(
    figure: Any, row: Sequence[Any], wide: Sequence[Axis], quantity: Quantity, values: NDArray[np.float64]
) -> None:
    """One map for each value of the first of three parameters, or one of two; all in the same colours."""
    *first, up, across = wide
    seen = values[np.isfinite(values)]
    ends = (float(seen.min()), float(seen.max())) if seen.size else (0.0, 1.0)
    mesh = None
    for k, (panel, each) in enumerate(zip(row, values.reshape(len(row), *values.shape[-2:]), strict=True)):
        mesh = panel.pcolormesh(
            edges(across), edges(up), np.ma.masked_invalid(each), vmin=ends[0], vmax=ends[1], rasterized=True,
        )  # fmt: skip
        panel.set(
            xlabel=across.title, ylabel=up.title,
            xscale="log" if across.log else "linear", yscale="log" if up.log else "linear",
        )  # fmt: skip
        if first:
            panel.set_title(first[0].shown(first[0].numbers[k]), fontsize="small")
    figure.colorbar(mesh, ax=list(row), label=quantity.title)


def edges(axis: Axis) -> NDArray[np.float64]:
    """Ends of the cells about each value, half way to the next, by ratios on a logarithmic axis."""
    numbers = np.log(axis.numbers) if axis.log else np.asarray(axis.numbers, np.float64)
    half = np.diff(numbers) / 2
    edges = np.concatenate([[numbers[0] - half[0]], numbers[:-1] + half, [numbers[-1] + half[-1]]])
    return np.exp(edges) if axis.log else edges
