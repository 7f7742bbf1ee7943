"""The figures of `bench_live`, `bench_latency` and `bench_python` as text.

Pictures of what `bench_live`, `bench_latency` and `bench_python` measured, as PNG. Needs matplotlib.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from livebass.report.picture import figure, image
from livebass.report.text import columns

LIVE_HEAD = (
    "tier", "modes", "contact", "frames", "deadline", "median", "99.9 %", "worst", "quiet 99.9 %", "quiet worst", "fit",
)  # fmt: skip
NEAR_HEAD = ("from reference", "notes", "characteristic frequency", "worst note", "spectrum", "where heard")
WISH_HEAD = ("wanted", "plain", "best run", "quiet", "at most", "")
WISH_KEYS = ("value", "best_run", "quiet", "limit")
LATENCY_HEAD = ("way", "block", "notes", "least", "median", "most", "jitter", "not counted")
PYTHON_HEAD = ("interpreter", "callback", "blocks", "lost", "share", "xruns")


def live_table(result: dict[str, Any]) -> str:
    """The figures of `bench_live` for people."""
    rows = [LIVE_HEAD, *(_live_cells(row) for row in [*result["rows"], result["moonshot"]])]
    wishes = [
        (w["what"], *(_value(w[key], w["unit"]) for key in WISH_KEYS), "" if w["met"] else "missed")
        for w in result["wanted"]
    ]
    near = [
        (tier, str(far["notes"]), f"{far['frequency']:.1%}", f"{far['worst_frequency']:.1%}",
         f"{far['spectrum_db']:.2f} dB", f"{far['heard_db']:.2f} dB")
        for tier, far in result["fidelity"].items()
    ]  # fmt: skip
    return "\n".join(
        [
            f"{result['preset']}, {result['strings']} strings popped at once at velocity 127, again, then sixteenths; "
            f"{result['rate_hz'] / 1e3:g} kHz; times of a block in parts of its deadline",
            *columns(rows),
            "quiet: of each block its best run, without what else the machine did",
            "fit: strings popped at once whose worst block is in time, plain / quiet",
            "",
            *([*columns([NEAR_HEAD, *near]), ""] if near else []),
            *columns([WISH_HEAD, *wishes]),
            "",
            *_where(result),
        ]
    )


def _live_cells(row: dict[str, Any]) -> tuple[str, ...]:
    fit = f"{row['fit']} / {row['quiet_fit']}" if "fit" in row else ""
    return (
        row["tier"],
        "all" if row["modes"] is None else str(row["modes"]),
        _rate(row["contact_rate_hz"]),
        str(row["block"]),
        f"{row['deadline_us'] / 1e3:.2f} ms",
        *(f"{row[key]:.1%}" for key in ("median", "p999", "worst", "quiet_p999", "quiet_worst")),
        fit,
    )


def latency_table(result: dict[str, Any]) -> str:
    """The figures of `bench_latency` for people."""
    rate = result["rate_hz"]
    rows: list[tuple[str, ...]] = [LATENCY_HEAD]
    for row in result["rows"]:
        if "error" in row:
            continue
        times = (f"{row[key]:.3f} ms" for key in ("least_ms", "median_ms", "most_ms", "jitter_ms"))
        rows.append((row["name"], str(row["block"]), str(row["notes"]), *times, str(row["discarded"])))
    head = f"MIDI note-on to the first sample, {rate / 1e3:g} kHz"
    if result["server"]:
        head += f", JACK server of {result['server']['block']} frames; what the sound card adds is not in it"
    else:
        head += f"; {result['missing']}: only the way from the queue into a block, no latency of a real output"
    return "\n".join(
        [
            head,
            *columns(rows),
            "jitter: standard deviation; not counted: notes during which the measuring client lost a period",
            *(f"{row['name']}: {row['error']}" for row in result["rows"] if "error" in row),
            "",
            *_where(result),
        ]
    )


def python_table(result: dict[str, Any]) -> str:
    """The figures of `bench_python` for people."""
    cells = [
        (row["load"], row["callback"], str(row["blocks"]), str(row["lost"]), f"{row['share']:.1%}", str(row["xruns"]))
        for row in result["rows"]
    ]
    return "\n".join(
        [
            f"the same engine behind two callbacks of a JACK server, {result['block']} frames at "
            f"{result['rate_hz'] / 1e3:g} kHz, {result['seconds']:g} s each; lost: blocks of the server without sound",
            *columns([PYTHON_HEAD, *cells], left=2),
            "",
            *_where(result),
        ]
    )


def _where(result: dict[str, Any]) -> list[str]:
    """Machine, versions, and who else was there."""
    machine, stolen, others = result["machine"], result["stolen"], result["others"]
    jack = f", JACK {result['server']['version']}" if result.get("server") else ""
    lines = [
        f"livebass {result['livebass']}, {machine['cpu']}, {machine['cores']} cores, {machine['system']}, Python "
        f"{machine['python']}, numpy {machine['numpy']}, numba {machine['numba']}{jack}"
    ]
    if stolen is not None:
        lines.append(f"of all processors' time meanwhile: stolen by the host {stolen:.1%}, others' work {others:.1%}")
    return lines


def _value(x: float | None, unit: str) -> str:
    if x is None:
        return ""
    return f"{x:.1%}" if unit == "%" else f"{x:.2f} {unit}"


def _rate(hz: float) -> str:
    return f"{hz / 1e6:.3g} MHz" if hz >= 1e6 else f"{hz / 1e3:.3g} kHz"


NEEDED = "--plot needs matplotlib: pip install 'livebass[plots]'"


def live_png(result: dict[str, Any]) -> bytes:
    """Histograms of the blocks' times against the deadline: one picture a block size, one curve a tier."""
    rows, edges = result["rows"], np.array(result["histogram_edges"])
    sizes = sorted({row["block"] for row in rows})
    drawn = figure(4 * min(3, len(sizes)), 3 * -(-len(sizes) // 3) + 0.6)
    axes = np.ravel(drawn.subplots(-(-len(sizes) // 3), min(3, len(sizes)), sharex=True, sharey=True, squeeze=False))
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
    drawn.supxlabel("time of a block, 1: its deadline")
    drawn.supylabel("part of the blocks")
    drawn.suptitle(f"{result['preset']}, {result['strings']} strings popped at once, then sixteenths")
    return image(drawn)


def row_deadline(rows: list[dict[str, Any]], size: int) -> float:
    """ms that a block of `size` frames lasts."""
    return next(float(row["deadline_us"]) / 1e3 for row in rows if row["block"] == size)


def latency_png(result: dict[str, Any]) -> bytes:
    """Histograms of the latencies of each way, with a line where one block ends: its deadline."""
    rows = [row for row in result["rows"] if "error" not in row]
    drawn = figure(8, 2.4 * max(1, len(rows)))
    axes = np.ravel(drawn.subplots(max(1, len(rows)), 1, squeeze=False))
    for axis, row in zip(axes, rows, strict=False):
        block = row["block"] / result["rate_hz"] * 1e3
        top = max(1.2 * block, 1.1 * row["most_ms"])
        axis.hist(row["each_ms"], np.linspace(0.0, top, 81))
        axis.axvline(block, color="black", linewidth=1, label=f"a block, {block:.2f} ms")
        axis.set(title=f"{row['name']}, {row['notes']} notes", ylabel="notes")
        axis.legend(fontsize="small")
    axes[-1].set_xlabel("note-on to first sample, ms")
    return image(drawn)


def python_png(result: dict[str, Any]) -> bytes:
    """Lost blocks of both callbacks, side by side for each load."""
    rows = result["rows"]
    loads = list(dict.fromkeys(row["load"] for row in rows))
    drawn = figure(8, 4)
    axis = drawn.subplots()
    for k, callback in enumerate(dict.fromkeys(row["callback"] for row in rows)):
        shares = [100 * next(r["share"] for r in rows if (r["load"], r["callback"]) == (x, callback)) for x in loads]
        bars = axis.bar(np.arange(len(loads)) + 0.4 * k - 0.2, shares, 0.38, label=callback)
        axis.bar_label(bars, fmt="%.1f", fontsize="small")
    axis.set_xticks(np.arange(len(loads)), loads)
    axis.set(ylabel="blocks that missed their deadline, %", ylim=(0, 110), title=f"{result['block']} frames")
    axis.legend()
    return image(drawn)
