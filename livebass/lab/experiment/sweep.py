"""A sweep: computes the points of a grid, in Python or each kept in its own file, with a table and a picture.

`sweep` returns them all. `livebass study sweep` keeps them as files: DIR/points/DIGEST.json is one point, named after
everything it depends on. So a killed sweep resumes where it was, and another one in the same DIR uses equal points and
disturbs none. The picture is a curve over one parameter, a map over two, or a row of maps over three.
"""

from __future__ import annotations

import json
import math
import os
import time
from collections.abc import Callable, Collection, Generator, Iterable, Iterator, Sequence
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Unpack

import numpy as np
from numpy.typing import NDArray

from livebass.files.whole import OutputError, Transaction, checked_place
from livebass.lab.experiment.grid import USAGE, Axis, Point, Settings, axis, grid, program
from livebass.lab.experiment.quantities import QUANTITIES, Quantity
from livebass.model.trial import PluckOptions
from livebass.report.picture import figure, image, shown_text
from livebass.report.text import csv_text, json_text, plain
from livebass.rows.arrays import Floats
from livebass.rows.bounds import one_of, within

if TYPE_CHECKING:
    from livebass.lab.experiment.workers import Compute, Task

Results = dict[str, dict[str, float]]  # by digest
TABLE, PICTURES, POINTS = "sweep.csv", ("sweep.png", "sweep.svg"), "points"
STALE = 60.0  # s after which a half-written point counts as left by a killed process
MAX_PANELS = 12  # in a row
MAX_AXES = 3
MAX_WORKERS = 1024


@dataclass(frozen=True)
class Sweep:
    """All points of a sweep and their results. `sweep` returns it."""

    axes: tuple[Axis, ...]  #: the parameters: `at.dotted`, `unit`, and `numbers` in that unit
    points: tuple[Point, ...]  #: every combination, the last parameter fastest
    results: Results

    def values(self, quantity: str) -> Floats:
        """Returns a quantity at every point, in SI units, NaN if missing.

        Args:
            quantity: A row of the table in `livebass study sweep --help`, such as "contacts".

        Returns:
            float64; its shape has the length of each axis.

        Raises:
            ValueError: An unknown quantity.
        """
        one_of("quantity", quantity, QUANTITIES)
        each = np.array([self.results[point.digest][quantity] for point in self.points])
        return each.reshape([len(axis.numbers) for axis in self.axes])

    def table(self) -> str:
        """Returns the points as CSV, the last parameter fastest.

        A row has the parameters in their units and every quantity, nan if missing.
        """
        head = [*(axis.title for axis in self.axes), *(row.title for row in QUANTITIES.values())]
        found = [self.results[point.digest] for point in self.points]
        rows = [
            [*(f"{x:.12g}" for x in point.numbers), *(_shortest_text(each[name]) for name in QUANTITIES)]
            for point, each in zip(self.points, found, strict=True)
        ]
        return csv_text(head, rows)

    def described(self, settings: Settings) -> dict[str, Any]:
        """The whole sweep for programs; a quantity without a value is NaN, null in JSON."""
        keys = [a.at.dotted for a in self.axes]
        return {
            "preset": settings.preset,
            "string": settings.string,
            "program": program(),
            "vary": [{"key": a.at.dotted, "unit": a.unit, "log": a.log, "values": list(a.numbers)} for a in self.axes],
            "quantities": {row.name: {"unit": row.unit, "meaning": row.meaning} for row in QUANTITIES.values()},
            "points": [
                {"at": dict(zip(keys, p.numbers, strict=True)), "digest": p.digest} | self.results[p.digest]
                for p in self.points
            ],
        }


def sweep(
    preset: str | os.PathLike[str],
    vary: str | Sequence[str],
    *,
    workers: int = 1,
    progress: Callable[[float], None] | None = None,
    **pluck: Unpack[PluckOptions],
) -> Sweep:
    """Plucks a string for every combination of the parameters that `vary` lists. It writes nothing.

    Call it in the main thread.

    Args:
        preset: Name of a bass, or a TOML file.
        vary: "KEY=FROM:TO:N" or "KEY=FROM:TO:N:log", one or several, such as "pluck.apex=1mm:7mm:13". KEY is a number
            of a preset file, or pluck.apex, pluck.at, pluck.angle or pluck.fret.
        workers: 1 computes in this process, more in as many new ones. A script must then have its own code under
            ``if __name__ == "__main__":``.
        progress: Called with the fraction done, 0 to 1.
        **pluck: The keyword arguments of `simulate` that describe the pluck.

    Raises:
        ValueError: An invalid key, value or pluck. It is raised before anything is computed.
        ChildProcessError: Processes died.

    Example:
        >>> from livebass import QUALITIES
        >>> found = sweep("paper-g", "pluck.fret=0:2:3", duration=0.01, quality=QUALITIES["live"])
        >>> found.values("contacts").shape
        (3,)
    """
    texts = [vary] if isinstance(vary, str) else list(vary)
    if not texts:
        raise ValueError(f"vary: {USAGE}")
    within("workers", workers, 1, MAX_WORKERS, whole=True)
    axes = tuple(axis(text) for text in texts)
    settings = Settings(preset=os.fspath(preset), **pluck)
    points = tuple(grid(settings, axes))
    different = list({point.digest: point for point in points}.values())
    results: Results = {}
    with closing(_compute(different, workers)) as done:
        for number, (point, result) in enumerate(done, 1):
            results[point.digest] = result
            if progress:
                progress(number / len(different))
    return Sweep(axes, points, results)


def _compute(points: Sequence[Point], workers: int) -> Generator[tuple[Point, dict[str, float]]]:
    """Computes `points` here, or in processes."""
    from livebass.compiling.library import library
    from livebass.lab.experiment.point import measure_point
    from livebass.lab.experiment.workers import compute_points

    if workers > 1:
        library()  # compiled here once, not in every process
        yield from compute_points(points, workers, lambda _: None)
        return
    for point in points:
        try:
            yield point, measure_point(point.work)
        except ValueError as error:
            raise ValueError(f"{point.name}: {error}") from None


def prepare(made: Transaction, directory: Path, file: Path | None = None) -> None:
    """Make `directory` and its `points` if needed, in a transaction, which removes them again if it fails.

    Raises OSError if a file of the sweep could not be written.
    """
    made.directory(directory)
    made.directory(directory / POINTS)
    own = [checked_place(directory / name) for name in (TABLE, *PICTURES, f"{POINTS}/0.json")]
    if file is not None and checked_place(file) in own:
        raise OutputError(f"{file}: is one of the files a sweep writes; name another")
    for left in (directory / POINTS).glob(".*.tmp-*"):  # from a killed process
        if time.time() - left.stat().st_mtime > STALE:
            left.unlink(missing_ok=True)


def read_points(directory: Path, points: Iterable[Task], names: Collection[str] = QUANTITIES) -> Results:
    """Read the existing results; a file that is damaged or belongs to another point counts as missing.

    names: the quantities of each point.
    """
    results: Results = {}
    for digest in dict.fromkeys(point.digest for point in points):
        try:
            kept = json.loads(_file(directory, digest).read_bytes())
            values = {name: _number(kept["quantities"][name]) for name in names}
        except (OSError, ValueError, KeyError, TypeError):
            continue
        if kept["digest"] == digest:
            results[digest] = values
    return results


def compute_missing(
    directory: Path, points: Sequence[Task], results: Results, compute: Compute
) -> Iterator[int]:  # fmt: skip
    """Compute the points missing in `results`, keep each in its file and in `results`; yields the number done.

    Points of equal digest are the same and are computed once.
    """
    missing = list({point.digest: point for point in points if point.digest not in results}.values())
    if not missing:
        return
    with closing(compute(missing)) as done:
        for number, (point, result) in enumerate(done, 1):
            with Transaction() as files:
                files.write(_file(directory, point.digest), _point_text(point, result))
            results[point.digest] = {name: _number(plain(value)) for name, value in result.items()}  # as when read
            yield number


def write(
    directory: Path, text: str, pictures: Sequence[bytes], file: Path | None, description: dict[str, Any]
) -> None:
    """Write table, pictures (none, or as `PICTURES`) and JSON together, replacing an earlier sweep's."""
    with Transaction() as files:
        files.write_text(directory / TABLE, text)
        for name, data in zip(PICTURES, pictures, strict=False):
            files.write(directory / name, data)
        if file is not None:
            files.write_text(file, json_text(description, indent=2))
    for name in PICTURES if not pictures else ():
        (directory / name).unlink(missing_ok=True)


def _file(directory: Path, digest: str) -> Path:
    return directory / POINTS / f"{digest}.json"


def _point_text(point: Task, result: dict[str, float]) -> bytes:
    kept = {
        "digest": point.digest, "point": point.name, "program": program(),
        "quantities": result,
    }  # fmt: skip
    return json_text(kept).encode()


def _number(value: Any) -> float:
    """A quantity from a file, NaN for null; ValueError for anything else that is not a number."""
    if value is None:
        return math.nan
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise ValueError(f"{value!r}: not a number")
    return float(value)


def _shortest_text(value: float) -> str:
    """The shortest text that restores the number."""
    return repr(int(value)) if value.is_integer() and abs(value) < 1e15 else repr(value)


def drawable(axes: Sequence[Axis]) -> bool:
    """True if a picture can show so many parameters and values."""
    wide = _wide(axes)
    return 1 <= len(wide) <= MAX_AXES and (len(wide) < MAX_AXES or len(wide[0].numbers) <= MAX_PANELS)


def pictures(axes: Sequence[Axis], values: dict[str, NDArray[np.float64]], title: str) -> tuple[bytes, bytes]:
    """PNG and SVG of `values`, by quantity, each with the shape of the grid, NaN if missing.

    The first of three parameters varies between panels; the last two run up and across.
    """
    wide = _wide(axes)
    shape = tuple(len(axis.numbers) for axis in wide)
    across = shape[0] if len(wide) == MAX_AXES else 1
    drawn = figure(2.5 + 4.5 * across, 0.6 + 3.4 * len(values))
    grid = drawn.subplots(len(values), across, squeeze=False)
    for row, (name, all_values) in zip(grid, values.items(), strict=True):
        quantity, each = QUANTITIES[name], all_values.reshape(shape)
        if len(wide) == 1:
            _curve(row[0], wide[0], quantity, each)
        else:
            _maps(drawn, row, wide, quantity, each)
    drawn.suptitle(shown_text(title), fontsize="medium")
    return image(drawn), image(drawn, "svg", dpi=100)


def _wide(axes: Sequence[Axis]) -> list[Axis]:
    """The axes with more than one value."""
    return [axis for axis in axes if len(axis.numbers) > 1]


def _curve(panel: Any, axis: Axis, quantity: Quantity, values: NDArray[np.float64]) -> None:
    panel.plot(axis.numbers, values, marker="o", markersize=4)
    panel.set(xlabel=axis.title, ylabel=quantity.title, xscale="log" if axis.log else "linear")
    panel.grid(alpha=0.3)
    if not np.isfinite(values).any():
        panel.text(0.5, 0.5, "none", transform=panel.transAxes, ha="center")


def _maps(
    drawn: Any, row: Sequence[Any], wide: Sequence[Axis], quantity: Quantity, values: NDArray[np.float64]
) -> None:
    """One map per value of the first of three parameters, or one for two; all with the same colours."""
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
    drawn.colorbar(mesh, ax=list(row), label=quantity.title)


def edges(axis: Axis) -> NDArray[np.float64]:
    """Edges of the cells around the values, halfway to the next one, by ratio on a logarithmic axis."""
    numbers = np.log(axis.numbers) if axis.log else np.asarray(axis.numbers, np.float64)
    half = np.diff(numbers) / 2
    ends = np.concatenate([[numbers[0] - half[0]], numbers[:-1] + half, [numbers[-1] + half[-1]]])
    return np.exp(ends) if axis.log else ends
