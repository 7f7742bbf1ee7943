"""The figures of `bench_live`, `bench_latency` and `bench_python` as text."""

from __future__ import annotations

from typing import Any

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


def columns(rows: list[tuple[str, ...]], left: int = 1) -> list[str]:
    """Lines of equal length, the first `left` cells to the left."""
    widths = [max(len(row[i]) for row in rows) for i in range(len(rows[0]))]
    return [
        "  ".join(
            cell.ljust(width) if i < left else cell.rjust(width)
            for i, (cell, width) in enumerate(zip(row, widths, strict=True))
        )
        for row in rows
    ]


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
