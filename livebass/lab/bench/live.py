"""`livebass bench live`: times of the native callback's blocks under the worst-case script.

The script (livebass/live/worst.py) is played in each quality and block size, several times over.

All figures are parts of a block's deadline, its duration. "plain" ones are over all blocks of all runs, with all
disturbances of the machine; "quiet" ones take each block's least time over the runs: the same work, undisturbed. The
best run is the one with the fastest worst block.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from livebass.engine.prepare import whole_contact_rate
from livebass.lab.bench.fidelity import (
    GROUPS,
    KINDS,
    PLUCKS,
    WITHIN,
    Note,
    distance,
    forces,
    guest_notes,
    play_plucks,
    representative_notes,
    waveforms,
)
from livebass.lab.bench.measure import OtherLoad, Result, Row, heading, load_lines
from livebass.live.worst import HAND_NAMES, LINE, block_times, even, hand_blocks, worst_case
from livebass.model.instrument import Instrument, speaking
from livebass.model.quality import QUALITIES, Quality, modes_for, quality_with
from livebass.preset.load import load_preset
from livebass.report.picture import figure, image, shown_text
from livebass.report.progress import Say, silent
from livebass.report.text import columns
from livebass.system.cores import core_count

RATE = 48_000  # Hz
EDGES = 10.0 ** np.linspace(-2.0, 1.5, 71)  # of the histograms, parts of the deadline; the outer bins take the rest
NULL = "reference, again"
# A quality's allowed error of the characteristic frequency beyond that of `reference` against itself: mean, worst note.
MAX_BIAS, MAX_BIAS_FREE = (0.02, 0.15), (0.001, 0.001)  # of notes with and without contacts
# dB, of waveforms over lossy frets, median and worst; pops and boards are shown without a promise.
MAX_WAVEFORM, PROMISED = (-45.0, -35.0), ("frets with loss", "thumb")
TEAM_BLOCK = 64  # frames, for strings side by side
ALONE_PRESET, ALONE_BLOCK, ALONE_RATE = "paper-g", 128, 4e6  # Hz, of the contact steps


@dataclass(frozen=True)
class Extent:
    """Extent of a measurement."""

    blocks: tuple[int, ...] = (32, 64, 128, 256, 512, 1024)  # frames
    qualities: tuple[str, ...] = tuple(QUALITIES)
    runs: int = 5  # in `live`
    other_runs: int = 3  # in the other qualities
    fit_runs: int = 3  # with fewer strings
    line: float = LINE  # s of sixteenths
    notes: tuple[Note, ...] | None = None  # to compare qualities with; None: representative and guests' notes
    plucks: int = PLUCKS  # per note


FULL = Extent()


def bench_live(preset: str = "jazz-finger", progress: Say = silent, extent: Extent = FULL) -> Result:
    """Measures everything in about six minutes; run nothing else meanwhile. `progress` gets each next step.

    "rows" has one row per quality ("tier") and block size, "team" one per quality with strings side by side on all
    cores, if there are several, "moonshot" one of a single string at full fidelity, "fidelity" the `distance` from
    `reference` of each quality, and of `reference` by other plucks, over all presets, "waveforms" the `waveforms` of
    each quality against `reference`; "wanted" the targets.
    Raises the errors of `load_preset` and `Engine`. [main thread]
    """
    bass = even(load_preset(preset))
    result, load = heading(), OtherLoad()
    rows, team = [], []
    for quality in extent.qualities:
        for block in extent.blocks:
            progress(f"{quality}, {block} frames")
            rows.append(_quality_row(bass, quality, block, extent))
    every = min(core_count(), len(bass.strings))
    for name in extent.qualities if every > 1 else ():
        progress(f"{name}, {TEAM_BLOCK} frames, {every} cores")
        tier = QUALITIES[name]
        team.append(_row(bass, tier, TEAM_BLOCK, len(bass.strings), extent.other_runs, extent.line, every))
    progress("one string, all modes, 4 MHz")
    alone = _alone_row(extent)
    result |= load.shares()
    fidelity, near = _fidelity(extent, progress)
    return result | {
        "preset": preset,
        "rate_hz": RATE,
        "strings": len(bass.strings),
        "rows": rows,
        "team": team,
        "moonshot": alone,
        "fidelity": fidelity,
        "waveforms": near,
        "wanted": _targets(rows, alone, fidelity, near),
        "histogram_edges": EDGES.tolist(),
    }


def block_figures(times: NDArray[np.int64], block: int, rate: int) -> dict[str, float]:
    """Returns figures of block times (runs, blocks), ns, as parts of the deadline: plain, best run, quiet."""
    loads = times * 1e-9 * rate / block
    quiet = loads.min(axis=0)
    return {
        "median": float(np.median(loads)),
        "p999": float(np.quantile(loads, 0.999)),
        "worst": float(loads.max()),
        "late": float((loads > 1.0).mean()),
        "best_run_worst": float(loads.max(axis=1).min()),
        "quiet_p999": float(np.quantile(quiet, 0.999)),
        "quiet_worst": float(quiet.max()),
        "quiet_worst_at_s": float(quiet.argmax() * block / rate),
    }


def _row(bass: Instrument, quality: Quality, block: int, strings: int, runs: int, line: float, cores: int = 1) -> Row:
    quality = quality.for_contact(bass.loss, bass.over_board)
    script = worst_case(bass, RATE, strings, line)
    times = block_times(bass, quality, block, script, runs, cores)
    loads = times * 1e-9 * RATE / block
    counts = np.histogram(np.clip(loads, EDGES[0], EDGES[-1]), EDGES)[0]
    return {
        "tier": quality.name,
        "modes": quality.modes,
        "contact_rate_hz": whole_contact_rate(quality.contact_rate, RATE),
        "block": block,
        "deadline_us": block / RATE * 1e6,
        "strings": strings,
        "cores": cores,
        "runs": runs,
        "blocks": int(times.size),
        **block_figures(times, block, RATE),
        "popped": block_figures(times[:, : script.popped // block], block, RATE),
        "hands": block_figures(times[:, script.hands // block :], block, RATE),
        "each_hand": {
            name: block_figures(times[:, hand_blocks(script, k, block)], block, RATE)
            for k, name in enumerate(HAND_NAMES)
        },
        "histogram": counts.tolist(),
    }


def _quality_row(bass: Instrument, quality: str, block: int, extent: Extent) -> Row:
    runs = extent.runs if quality == "live" else extent.other_runs
    every = len(bass.strings)
    tried = {every: _row(bass, QUALITIES[quality], block, every, runs, extent.line)}

    def load(key: str, strings: int) -> float:
        if strings not in tried:
            tried[strings] = _row(bass, QUALITIES[quality], block, strings, extent.fit_runs, extent.line)
        return float(tried[strings][key])

    fits = {key: max_that_fit(every, partial(load, key)) for key in ("worst", "quiet_worst")}
    return tried[every] | {"fit": fits["worst"], "quiet_fit": fits["quiet_worst"]}


def max_that_fit(maximum: int, load: Callable[[int], float]) -> int:
    """The largest number up to `maximum` whose `load`, an increasing function, is below 1; 0 if there is none."""
    if load(maximum) < 1.0:
        return maximum
    fits, fails = 0, maximum
    while fails - fits > 1:
        middle = (fits + fails) // 2
        if load(middle) < 1.0:
            fits = middle
        else:
            fails = middle
    return fits


def _alone_row(extent: Extent) -> Row:
    """One string with all modes of the grid, and contact steps half as fine as in `reference`."""
    bass = even(load_preset(ALONE_PRESET))
    quality = quality_with("reference", contact_rate=ALONE_RATE)
    part = speaking(bass.strings[0], bass.necks[0], 0)
    modes = modes_for(quality, part.length, part.length, part.grid_points)
    row = _row(bass, quality, ALONE_BLOCK, 1, extent.runs, extent.line)
    return row | {"tier": f"one string, {ALONE_PRESET}", "modes": modes}


def _fidelity(extent: Extent, progress: Say) -> tuple[dict[str, Result], dict[str, dict[str, Row]]]:
    """The distance from `reference` of each other quality, and of itself by other plucks; waveforms of the former."""
    notes = [*representative_notes(), *guest_notes()] if extent.notes is None else extent.notes
    reference = QUALITIES["reference"]
    others = [quality for quality in extent.qualities if quality != reference.name]
    if not others:
        return {}, {}
    plucks = forces(extent.plucks)
    progress(f"{len(notes)} notes, {len(plucks)} plucks each, in reference")
    wanted = play_plucks(notes, reference, plucks)
    found, near = {}, {}
    for quality in others:
        progress(f"{quality} against reference")
        sounds = play_plucks(notes, QUALITIES[quality], plucks)
        found[quality], near[quality] = distance(notes, sounds, wanted), waveforms(notes, sounds, wanted)
    progress("reference against itself")
    found[NULL] = distance(notes, play_plucks(notes, reference, forces(extent.plucks, other=True)), wanted)
    return found, near


def allowed_error(group: str, null: Row) -> tuple[float, float]:
    """Returns a quality's allowed error in a group, mean and worst note: the `null`'s error plus the allowed bias."""
    mean, worst = MAX_BIAS_FREE if group == "no contact" else MAX_BIAS
    return null["frequency"] + mean, null["worst_frequency"] + worst


def _targets(
    rows: list[Row], alone: Row, fidelity: dict[str, Any], near: dict[str, dict[str, Row]]
) -> list[dict[str, Any]]:
    """Targets and values of everything measured; "met" judges the plain figure."""
    out = []
    for row in rows:
        if (row["tier"], row["block"]) == ("live", 64):
            every = ("popped", row["popped"], 0.1), ("popped, hammered, slid and pulled off", row["hands"], 0.12)
            for name, figures, median in (*every, *((*hand, None) for hand in row["each_hand"].items())):
                label = f"live, 64 frames, all strings {name} at once"
                out.append(_target(f"{label}: worst block", 0.5, figures["worst"], figures))
                if median is not None:
                    out.append(_target(f"{label}: median block", median, figures["median"]))
    for quality in [name for name in fidelity if name != NULL]:
        for group, far in fidelity[quality]["groups"].items():
            mean, worst = allowed_error(group, fidelity[NULL]["groups"][group])
            label = f"{quality} from reference, {group}: characteristic frequency"
            out.append(_target(f"{label}, mean", mean, far["frequency"]))
            out.append(_target(f"{label}, worst note", worst, far["worst_frequency"]))
    for quality, kinds in near.items():
        for kind in [kind for kind in PROMISED if kind in kinds]:
            label = f"{quality} from reference, {kind}: waveform of hard notes"
            for name, limit, key in zip(("median", "worst"), MAX_WAVEFORM, ("median_db", "worst_db"), strict=True):
                out.append(_target(f"{label}, {name}", limit, kinds[kind][key], unit="dB"))
    label = f"one string at full fidelity, {ALONE_BLOCK} frames: worst block"
    return [*out, _target(label, 1.0, alone["worst"], alone)]


def _target(label: str, limit: float, value: float, row: Row | None = None, unit: str = "%") -> dict[str, Any]:
    """`limit` and `value` are fractions if `unit` is "%"; `row` has the other figures of a worst block."""
    more = {"best_run": row and row["best_run_worst"], "quiet": row and row["quiet_worst"]}
    return {"what": label, "unit": unit, "limit": limit, "value": value, **more, "met": value <= limit}


HEAD = (
    "quality", "modes", "contact", "frames", "deadline", "median", "99.9 %", "worst", "quiet 99.9 %", "quiet worst",
    "fit",
)  # fmt: skip
FIDELITY_HEAD = (
    "from reference", "group", "notes", "frequency", "95 %", "worst", "brighter", "spectrum", "audible", "worst note",
)  # fmt: skip
WAVEFORM_HEAD = ("hard notes from reference", "kind", "notes", "waveform, median", "worst", "worst note")
WAVEFORM_EXPLAINED = (
    "waveform: the difference over the reference, root mean squares of 0.3 s of each pluck of hard notes that touched",
    *(f"{kind}: {meaning}" for kind, meaning in KINDS.items()),
)
EXPLAINED = (
    f"medians of several plucks of each note, with forces within {WITHIN:.1%} of its own: no ear tells them apart",
    "frequency: the characteristic frequency of the first 0.3 s, eq. 14: mean over notes; 95 % of them; worst",
    "brighter: the same with its sign, mean over notes",
    *(f"{group}: {meaning}" for group, meaning in GROUPS.items()),
    f"{NULL}: as many plucks beside those; contacts amplify the smallest difference, whatever the quality",
    f"wanted of a quality: at most {MAX_BIAS[0]:.0%} more than these in the mean, {MAX_BIAS[1]:.0%} in the worst",
)
TARGET_HEAD = ("wanted", "plain", "best run", "quiet", "at most", "")
TARGET_KEYS = ("value", "best_run", "quiet", "limit")


def table(result: Result) -> str:
    """Returns the figures of `bench_live` as text."""
    targets = [
        (w["what"], *(_value(w[key], w["unit"]) for key in TARGET_KEYS), "" if w["met"] else "missed")
        for w in result["wanted"]
    ]
    return "\n".join(
        [
            f"{result['preset']}, {result['strings']} strings popped at once at velocity 127, again, then sixteenths; "
            f"{result['rate_hz'] / 1e3:g} kHz; times of a block in parts of its deadline",
            *columns([HEAD, *map(_cells, [*result["rows"], *result["team"], result["moonshot"]])]),
            "quiet: the best run of each block, without what else the machine did",
            "fit: how many strings can be popped at once with every block in time, plain / quiet",
            "",
            *comparison_lines(result),
            *columns([TARGET_HEAD, *targets]),
            "",
            *load_lines(result),
        ]
    )


def comparison_lines(result: Result) -> list[str]:
    """Returns the tables of "fidelity" and "waveforms" of a result."""
    fidelity = [
        (quality, group, str(far["notes"]), f"{far['frequency']:.1%}", f"{far['frequency_95']:.1%}",
         f"{far['worst_frequency']:.1%}", f"{far['brighter']:+.1%}",
         f"{far['spectrum_db']:.2f} dB", f"{far['heard_db']:.2f} dB", far["worst"])
        for quality, found in result["fidelity"].items()
        for group, far in found["groups"].items()
    ]  # fmt: skip
    waveform = [
        (quality, kind, str(row["notes"]), f"{row['median_db']:.1f} dB", f"{row['worst_db']:.1f} dB", row["worst"])
        for quality, kinds in result["waveforms"].items()
        for kind, row in kinds.items()
    ]
    return [
        *([*columns([FIDELITY_HEAD, *fidelity], left=2), *EXPLAINED, ""] if fidelity else []),
        *([*columns([WAVEFORM_HEAD, *waveform], left=2), *WAVEFORM_EXPLAINED, ""] if waveform else []),
    ]


def _cells(row: Row) -> tuple[str, ...]:
    return (
        row["tier"] + (f", {row['cores']} cores" if row["cores"] > 1 else ""),
        "all" if row["modes"] is None else str(row["modes"]),
        _rate(row["contact_rate_hz"]),
        str(row["block"]),
        f"{row['deadline_us'] / 1e3:.2f} ms",
        *(f"{row[key]:.1%}" for key in ("median", "p999", "worst", "quiet_p999", "quiet_worst")),
        f"{row['fit']} / {row['quiet_fit']}" if "fit" in row else "",
    )


def _value(x: float | None, unit: str) -> str:
    if x is None:
        return ""
    return f"{x:.1%}" if unit == "%" else f"{x:.2f} {unit}"


def _rate(hz: float) -> str:
    return f"{hz / 1e6:.3g} MHz" if hz >= 1e6 else f"{hz / 1e3:.3g} kHz"


def picture(result: Result) -> bytes:
    """Returns a PNG: histograms of the block times, one axis per block size and one curve per quality."""
    edges = np.array(result["histogram_edges"])
    by_size: dict[int, list[Row]] = {}
    for row in sorted(result["rows"], key=lambda row: row["block"]):
        by_size.setdefault(row["block"], []).append(row)
    across = min(3, len(by_size))
    down = -(-len(by_size) // 3)
    drawn = figure(4 * across, 3 * down + 0.6)
    axes = np.ravel(drawn.subplots(down, across, sharex=True, sharey=True, squeeze=False))
    for axis, (size, rows) in zip(axes, by_size.items(), strict=False):
        for row in rows:
            share = np.array(row["histogram"]) / row["blocks"]
            axis.stairs(share, edges, label=f"{row['tier']}, worst {row['worst']:.0%}")
        axis.axvline(1.0, color="black", linewidth=1)
        axis.set(xscale="log", yscale="log", title=f"{size} frames, {rows[0]['deadline_us'] / 1e3:.2f} ms")
        axis.legend(fontsize="x-small")
    for axis in axes[len(by_size) :]:
        axis.set_visible(False)
    drawn.supxlabel("time of a block, 1: its deadline")
    drawn.supylabel("share of the blocks")
    drawn.suptitle(shown_text(f"{result['preset']}, {result['strings']} strings popped at once, then sixteenths"))
    return image(drawn)
