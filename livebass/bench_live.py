"""Whether blocks are ready in time: `bench_live` measures, `bench_live_table.live_table` shows.

The native callback is asked for the blocks of a worst case (`bench_card`) in each tier and block size, several times.
"plain" figures are over all blocks of all runs, with whatever else the machine did. "quiet" ones take of each
block the least time of the runs: the same work, free from what disturbed one run. In between is the best run: the
one whose worst block took least. All are parts of a block's deadline, the time it lasts. Relief under overload is
off: every block is of the full tier. Unevenness is off too, so that runs are alike; nearly, where the callback
computes ahead of its clock.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from livebass import __version__
from livebass.bench_card import Card, Script, worst_case
from livebass.bench_fidelity import SPAN, distance
from livebass.bench_measure import Neighbours, Row, machine
from livebass.instrument import Instrument, speaking
from livebass.operators import whole_contact_rate
from livebass.preset import load_preset
from livebass.quality import QUALITIES, Quality, modes_for, quality_with
from livebass.stage import LiveBass, Stage

RATE = 48_000  # Hz
EDGES = 10.0 ** np.linspace(-2.0, 1.5, 71)  # of the histograms, parts of the deadline; what is beyond is at the ends
MOONSHOT_PRESET, MOONSHOT_BLOCK, MOONSHOT_RATE = "paper-g", 128, 4e6  # Hz, of the contact steps
Say = Callable[[str], None]


@dataclass(frozen=True)
class Extent:
    """How much is measured."""

    blocks: tuple[int, ...] = (32, 64, 128, 256, 512, 1024)  # frames
    tiers: tuple[str, ...] = tuple(QUALITIES)
    runs: int = 5  # of the tier that is made to play live
    other_runs: int = 3  # of the other tiers
    fit_runs: int = 3  # where fewer strings are tried
    line: float = 16 * 60 / 110 / 4  # s of sixteenths
    frets: tuple[int, ...] = (0, 2, 5, 7, 9, 12)  # where tiers are compared


USUAL = Extent()


def bench_live(
    preset: str = "jazz-finger", progress: Say | None = None, extent: Extent | None = None
) -> dict[str, Any]:  # fmt: skip
    """Everything, in about two minutes: numbers and text, as JSON has them. `progress` hears what comes next.

    "rows" has one for each tier and block size, "moonshot" one of a single string, "fidelity" how far each tier is
    from `reference`, "wanted" what is asked of them. Nothing else should run on the machine. Raises what
    `load_preset` and `Engine` raise. [main thread]
    """
    extent = extent or USUAL
    say = progress or (lambda what: None)
    bass = even(load_preset(preset))
    where, neighbours = machine(), Neighbours()
    rows = []
    for tier in extent.tiers:
        for block in extent.blocks:
            say(f"{tier}, {block} frames")
            rows.append(_tier_row(bass, tier, block, extent))
    say("one string, all modes, 4 MHz")
    moonshot = _moonshot(extent)
    shares = neighbours.shares()
    fidelity = {}
    for tier in extent.tiers:
        if tier != "reference":
            say(f"{tier} against reference")
            fidelity[tier] = _fidelity(bass, tier, extent)
    return {
        "livebass": __version__,
        "date": datetime.now(UTC).isoformat(timespec="seconds"),
        "machine": where,
        **shares,
        "preset": preset,
        "rate_hz": RATE,
        "strings": len(bass.strings),
        "rows": rows,
        "moonshot": moonshot,
        "fidelity": fidelity,
        "wanted": _wanted(rows, moonshot, fidelity),
        "histogram_edges": EDGES.tolist(),
    }


def even(bass: Instrument) -> Instrument:
    """`bass` with a player who does the same thing twice."""
    return replace(bass, player=replace(bass.player, unevenness=0.0))


def block_times(bass: Instrument, quality: Quality, block: int, script: Script, runs: int) -> NDArray[np.int64]:
    """ns of each block of `script`, (runs, blocks), after a run that only warms up."""
    stage = Stage(script.rate, shelter=False)
    stage.put_on(LiveBass(bass, quality, script.rate))
    card = Card(stage, block)
    card.play(replace(script, frames=script.popped))
    times = []
    for _ in range(runs):
        card.silence()
        times.append(card.play(script))
    return np.array(times)


def block_figures(times: NDArray[np.int64], block: int, rate: int) -> dict[str, float]:
    """Parts of the deadline: of all blocks, of the run whose worst was the least, and of each block's best run."""
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


def _row(bass: Instrument, quality: Quality, block: int, strings: int, runs: int, line: float) -> Row:
    script = worst_case(bass, RATE, strings, line)
    times = block_times(bass, quality, block, script, runs)
    loads = times * 1e-9 * RATE / block
    counts = np.histogram(np.clip(loads, EDGES[0], EDGES[-1]), EDGES)[0]
    return {
        "tier": quality.name,
        "modes": quality.modes,
        "contact_rate_hz": whole_contact_rate(quality.contact_rate, RATE),
        "block": block,
        "deadline_us": block / RATE * 1e6,
        "strings": strings,
        "runs": runs,
        "blocks": int(times.size),
        **block_figures(times, block, RATE),
        "popped": block_figures(times[:, : script.popped // block], block, RATE),
        "histogram": counts.tolist(),
    }


def _tier_row(bass: Instrument, tier: str, block: int, extent: Extent) -> Row:
    runs = extent.runs if tier == "live" else extent.other_runs
    every = len(bass.strings)
    tried = {every: _row(bass, QUALITIES[tier], block, every, runs, extent.line)}

    def figure(key: str, strings: int) -> float:
        if strings not in tried:
            tried[strings] = _row(bass, QUALITIES[tier], block, strings, extent.fit_runs, extent.line)
        return float(tried[strings][key])

    fits = {key: most_that_fit(every, partial(figure, key)) for key in ("worst", "quiet_worst")}
    return tried[every] | {"fit": fits["worst"], "quiet_fit": fits["quiet_worst"]}


def most_that_fit(most: int, load: Callable[[int], float]) -> int:
    """The largest number up to `most` whose `load` is below 1, where more is never less; 0: not even one."""
    if load(most) < 1.0:
        return most
    fits, fails = 0, most
    while fails - fits > 1:
        middle = (fits + fails) // 2
        if load(middle) < 1.0:
            fits = middle
        else:
            fails = middle
    return fits


def _moonshot(extent: Extent) -> Row:
    """One string with all modes the grid has and contact steps half as fine as `reference`."""
    bass = even(load_preset(MOONSHOT_PRESET))
    quality = quality_with("reference", contact_rate=MOONSHOT_RATE)
    part = speaking(bass.strings[0], bass.necks[0], 0)
    modes = modes_for(quality, part.length, part.length, part.grid_points)
    row = _row(bass, quality, MOONSHOT_BLOCK, 1, extent.runs, extent.line)
    return row | {"tier": f"one string, {MOONSHOT_PRESET}", "modes": modes}


def _fidelity(bass: Instrument, tier: str, extent: Extent) -> dict[str, Any]:
    far = distance(bass, QUALITIES[tier], rate=RATE, frets=extent.frets)
    return {
        "span_s": SPAN,
        "notes": len(far.notes),
        "frequency": far.frequency,
        "worst_frequency": far.worst_frequency,
        "spectrum_db": far.spectrum_db,
        "heard_db": far.heard_db,
        "each": [vars(note) for note in far.notes],
    }


def _wanted(rows: list[Row], moonshot: Row, fidelity: dict[str, Any]) -> list[dict[str, Any]]:
    """What is asked and what was measured, as far as it was; "met" is judged by the plain figure."""
    out = []
    for row in rows:
        if (row["tier"], row["block"]) == ("live", 64):
            popped = row["popped"]
            what = "live, 64 frames, all strings popped at once"
            out += [
                _wish(f"{what}: worst block", 0.5, popped["worst"], popped),
                _wish(f"{what}: median block", 0.1, popped["median"]),
            ]
    if "live" in fidelity:
        far = fidelity["live"]
        out += [
            _wish("live from reference: characteristic frequency, mean", 0.05, far["frequency"]),
            _wish("live from reference: characteristic frequency, worst note", 0.2, far["worst_frequency"]),
            _wish("live from reference: log-spectral distance", 4.0, far["spectrum_db"], unit="dB"),
        ]
    label = f"moonshot, {MOONSHOT_BLOCK} frames: worst block"
    return [*out, _wish(label, 1.0, moonshot["worst"], moonshot)]


def _wish(what: str, limit: float, value: float, row: Row | None = None, unit: str = "%") -> dict[str, Any]:
    """`unit` "%": `limit` and values are parts of one; `row` has the other figures of a worst block."""
    more = {"best_run": row and row["best_run_worst"], "quiet": row and row["quiet_worst"]}
    return {"what": what, "unit": unit, "limit": limit, "value": value, **more, "met": value <= limit}
