"""A sweep: the points of a grid computed, each kept in a file of its own, and a table and a picture of all.

DIR/points/DIGEST.json is one point, named by all it depends on: a sweep that was killed goes on where it was, another
one in the same DIR shares the points that are the same and disturbs nothing.

Pictures of a sweep, as PNG and SVG: a curve over one parameter, maps over two, a row of maps over three.
"""

from __future__ import annotations

import csv
import io
import json
import math
import time
from collections.abc import Callable, Generator, Iterable, Iterator, Sequence
from contextlib import closing
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from livebass.experiment.grid import Axis, Point, Settings, program
from livebass.experiment.quantities import QUANTITIES, Quantity
from livebass.files import OutputError, Transaction, checked_place

Results = dict[str, dict[str, float]]  # by digest
TABLE, PICTURES, POINTS = "sweep.csv", ("sweep.png", "sweep.svg"), "points"
STALE = 60.0  # s after which a half-written point belongs to nobody any more


def places(directory: Path, file: Path | None = None) -> None:
    """Make `directory` if need be, with its points. OSError where what a sweep writes could not be put in place."""
    with Transaction() as files:
        files.directory(directory / POINTS)
        mine = [checked_place(directory / name) for name in (TABLE, *PICTURES, f"{POINTS}/0.json")]
        if file is not None and checked_place(file) in mine:
            raise OutputError(f"{file}: is one of the files a sweep writes; name another")
    for left in (directory / POINTS).glob(".*.tmp-*"):  # of a killed process
        if time.time() - left.stat().st_mtime > STALE:
            left.unlink(missing_ok=True)


def found(directory: Path, points: Iterable[Point]) -> Results:
    """Results that are there already; a file that is not what it should be counts as missing."""
    results: Results = {}
    for digest in dict.fromkeys(point.digest for point in points):
        try:
            kept = json.loads(_file(directory, digest).read_bytes())
            values = {name: _number(kept["quantities"][name]) for name in QUANTITIES}
        except (OSError, ValueError, KeyError, TypeError):
            continue
        if kept["digest"] == digest:
            results[digest] = values
    return results


def completed(
    directory: Path, points: Sequence[Point], results: Results,
    compute: Callable[[Sequence[Point]], Generator[tuple[Point, dict[str, float]]]],
) -> Iterator[int]:  # fmt: skip
    """Compute what `results` lacks, keep each point in its file and in `results`; the number done so far, each time.

    Points that are the same, as their digest is, are computed once.
    """
    missing = list({point.digest: point for point in points if point.digest not in results}.values())
    if not missing:
        return
    with closing(compute(missing)) as done:
        for number, (point, result) in enumerate(done, 1):
            with Transaction() as files:
                files.write(_file(directory, point.digest), _point_text(point, result))
            results[point.digest] = {name: _number(_plain(value)) for name, value in result.items()}  # as if read
            yield number


def table(axes: Sequence[Axis], points: Sequence[Point], results: Results) -> str:
    """The points as CSV, the last parameter fastest: parameters in their units, then every quantity, nan for none."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow([*(axis.title for axis in axes), *(row.title for row in QUANTITIES.values())])
    for point in points:
        values = [results[point.digest][name] for name in QUANTITIES]
        writer.writerow([*(f"{x:.12g}" for x in point.numbers), *(_shown(x) for x in values)])
    return text.getvalue()


def as_json(settings: Settings, axes: Sequence[Axis], points: Sequence[Point], results: Results) -> dict[str, Any]:
    """All of it, for programs; null where a quantity has no value."""
    return {
        "preset": settings.preset,
        "string": settings.string,
        "program": program(),
        "vary": [{"key": a.at.dotted, "unit": a.unit, "log": a.log, "values": list(a.numbers)} for a in axes],
        "quantities": {row.name: {"unit": row.unit, "meaning": row.meaning} for row in QUANTITIES.values()},
        "points": [
            {"at": dict(zip((a.at.dotted for a in axes), point.numbers, strict=True)), "digest": point.digest}
            | {name: _plain(value) for name, value in results[point.digest].items()}
            for point in points
        ],
    }


def write(
    directory: Path, text: str, pictures: Sequence[bytes], file: Path | None, description: dict[str, Any]
) -> None:
    """Table, pictures (none, or as `PICTURES`) and JSON at once, in place of those of an earlier sweep."""
    with Transaction() as files:
        files.write(directory / TABLE, text.encode())
        for name, data in zip(PICTURES, pictures, strict=False):
            files.write(directory / name, data)
        if file is not None:
            files.write(file, (json.dumps(description, indent=2) + "\n").encode())
    for name in PICTURES if not pictures else ():
        (directory / name).unlink(missing_ok=True)


def _file(directory: Path, digest: str) -> Path:
    return directory / POINTS / f"{digest}.json"


def _point_text(point: Point, result: dict[str, float]) -> bytes:
    kept = {
        "digest": point.digest, "point": point.name, "program": program(),
        "quantities": {name: _plain(value) for name, value in result.items()},
    }  # fmt: skip
    return (json.dumps(kept, indent=1) + "\n").encode()


def _plain(value: float) -> float | None:
    return value if math.isfinite(value) else None


def _number(value: Any) -> float:
    """What a file says; ValueError for what no quantity is."""
    if value is None:
        return math.nan
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise ValueError(f"{value!r}: no number")
    return float(value)


def _shown(value: float) -> str:
    """The shortest text that is this number again."""
    return repr(int(value)) if value.is_integer() and abs(value) < 1e15 else repr(value)


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


def pictures(axes: Sequence[Axis], values: dict[str, NDArray[np.float64]], title: str) -> tuple[bytes, bytes]:
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
