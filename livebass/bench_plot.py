"""Pictures of what `bench_live`, `bench_latency` and `bench_python` measured, as PNG. Needs matplotlib."""

from __future__ import annotations

import io
from typing import Any

import numpy as np

NEEDED = "--plot needs matplotlib: pip install 'livebass[plots]'"


def check() -> None:
    """LookupError where there is no matplotlib."""
    try:
        import matplotlib.figure  # noqa: F401
    except ImportError:
        raise LookupError(NEEDED) from None


def live_png(result: dict[str, Any]) -> bytes:
    """Histograms of the blocks' times against the deadline: one picture a block size, one curve a tier."""
    rows, edges = result["rows"], np.array(result["histogram_edges"])
    sizes = sorted({row["block"] for row in rows})
    figure = _figure(4 * min(3, len(sizes)), 3 * -(-len(sizes) // 3) + 0.6)
    axes = np.ravel(figure.subplots(-(-len(sizes) // 3), min(3, len(sizes)), sharex=True, sharey=True, squeeze=False))
    for axis, size in zip(axes, sizes, strict=False):
        for row in rows:
            if row["block"] == size:
                parts = np.array(row["histogram"]) / row["blocks"]
                axis.stairs(parts, edges, label=f"{row['tier']}, worst {row['worst']:.0%}")
        axis.axvline(1.0, color="black", linewidth=1)
        axis.set(xscale="log", yscale="log", title=f"{size} frames, {row_deadline(rows, size):.2f} ms")
        axis.legend(fontsize="x-small")
    for axis in axes[len(sizes) :]:
        axis.set_visible(False)
    figure.supxlabel("time of a block, 1: its deadline")
    figure.supylabel("part of the blocks")
    figure.suptitle(f"{result['preset']}, {result['strings']} strings popped at once, then sixteenths")
    return _png(figure)


def row_deadline(rows: list[dict[str, Any]], size: int) -> float:
    """ms that a block of `size` frames lasts."""
    return next(float(row["deadline_us"]) / 1e3 for row in rows if row["block"] == size)


def latency_png(result: dict[str, Any]) -> bytes:
    """Histograms of the latencies of each way, with a line where one block ends: its deadline."""
    rows = [row for row in result["rows"] if "error" not in row]
    figure = _figure(8, 2.4 * max(1, len(rows)))
    axes = np.ravel(figure.subplots(max(1, len(rows)), 1, squeeze=False))
    for axis, row in zip(axes, rows, strict=False):
        block = row["block"] / result["rate_hz"] * 1e3
        top = max(1.2 * block, 1.1 * row["most_ms"])
        axis.hist(row["each_ms"], np.linspace(0.0, top, 81))
        axis.axvline(block, color="black", linewidth=1, label=f"a block, {block:.2f} ms")
        axis.set(title=f"{row['name']}, {row['notes']} notes", ylabel="notes")
        axis.legend(fontsize="small")
    axes[-1].set_xlabel("note-on to first sample, ms")
    return _png(figure)


def python_png(result: dict[str, Any]) -> bytes:
    """Lost blocks of both callbacks, side by side for each load."""
    rows = result["rows"]
    loads = list(dict.fromkeys(row["load"] for row in rows))
    figure = _figure(8, 4)
    axis = figure.subplots()
    for k, callback in enumerate(dict.fromkeys(row["callback"] for row in rows)):
        shares = [100 * next(r["share"] for r in rows if (r["load"], r["callback"]) == (x, callback)) for x in loads]
        bars = axis.bar(np.arange(len(loads)) + 0.4 * k - 0.2, shares, 0.38, label=callback)
        axis.bar_label(bars, fmt="%.1f", fontsize="small")
    axis.set_xticks(np.arange(len(loads)), loads)
    axis.set(ylabel="blocks that missed their deadline, %", ylim=(0, 110), title=f"{result['block']} frames")
    axis.legend()
    return _png(figure)


def _figure(width: float, height: float) -> Any:
    from matplotlib.figure import Figure

    return Figure(figsize=(width, height), layout="constrained")  # no display is needed


def _png(figure: Any) -> bytes:
    data = io.BytesIO()
    figure.savefig(data, format="png", dpi=110)
    return data.getvalue()
