"""`livebass bench render`: seconds of work per second of sound.

Case B of the paper (the open G string of `paper-g`, 3.6 mm at 0.64 m, first second) by brute force, by the engine in
each quality, and over a fretless board; then four strings at once and a slap line through `Engine`, as in `livebass
render`, and a held string beside what this machine can do (limit.py). One run measures everything, so the ratios belong
to one machine in one state. A figure is the minimum of its runs, shown with the median and the processor time: if the
latter is much less than the wall time on one core, or no more on several, something else was running.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from livebass.engine.engine import Engine
from livebass.engine.solve import solve_trial
from livebass.lab.bench.limit import limit_lines, measure_limit
from livebass.lab.bench.measure import CASE_B, RATES, Clock, Result, Row, case_trial, heading, machine_line, row
from livebass.lab.reference.solver import solve
from livebass.model.instrument import Instrument
from livebass.model.quality import QUALITIES
from livebass.model.trial import Motion, Trial
from livebass.preset.load import load_preset
from livebass.report.progress import Say, silent
from livebass.report.text import columns
from livebass.rows.units import note_number
from livebass.score.score import Score, score_of

AGREE_FOR = 0.06  # s: contacts amplify rounding, so later the two solutions differ in detail
BEAT = 0.5  # s between the chords of four strings
SIXTEENTH = 60 / 110 / 4  # s
# Thumb on E and A, pops on D and G; velocities up to 70 miss most frets.
SLAP_BAR = (
    ("E1", 112), ("E1", 70), ("E2", 118), ("E1", 45), ("D2", 112), ("E2", 120), ("E1", 90), ("G2", 122),
    ("A1", 115), ("A1", 60), ("A2", 118), ("E1", 100), ("G1", 50), ("D2", 80), ("E2", 124), ("E1", 127),
)  # fmt: skip


@dataclass(frozen=True)
class Extent:
    """Extent of a measurement."""

    sound: float = 1.0  # s of case B, from the release
    brute: float = 1.0  # s of case B by brute force, once
    chords: float = 2.0  # s of four strings at once
    line: float = 15.0  # s of the slap line
    runs: int = 5  # of case B
    long_runs: int = 3  # of chords and line
    pieces: int = 20  # of a held string


def bench_render(progress: Say = silent, extent: Extent = Extent()) -> Result:
    """Measures everything in about a minute; run nothing else meanwhile. `progress` gets each next step.

    "measurements" holds a row for each, with `seconds_per_second` of work per second of sound, their `median`,
    `processor` (its least time, all threads together) and `runs`; "ratios" holds the `RATIOS`; "agreement" the distance
    of the engine from brute force; "limit" what `measure_limit` returns; "machine" the machine. [main thread]
    """
    result = heading()
    bass = load_preset("paper-g")
    progress("loading the kernels")
    _warm(bass)
    rows: dict[str, Row] = {}
    for quality in QUALITIES:
        for rate in RATES:
            progress(f"case B, {quality}, {rate // 1000} kHz")
            trial = case_trial("b", quality, rate, extent.sound)
            figures, motion = _trial_row(f"engine, {quality}", trial, solve_trial, extent.runs)
            rows[f"engine_{quality}_{rate // 1000}k"] = figures
            if quality == "reference" and rate == RATES[0]:
                fast = motion
    progress("case B, fretless, reference")
    fretless = case_trial("fretless", "reference", RATES[0], extent.sound)
    rows["fretless"], _ = _trial_row("fretless, reference", fretless, solve_trial, extent.runs)
    jazz = load_preset("jazz-finger")
    chords = _chords(jazz, extent.chords)
    for key, workers in (("one_core", 1), ("all_cores", None)):
        progress(f"four strings, live, {key.replace('_', ' ')}")
        figures = _engine_row("four strings, live", jazz, "live", chords, workers, extent.long_runs)
        rows[f"strings_live_{key}"] = figures
    slap, line = load_preset("slap"), _slap_line(extent.line)
    for quality in ("live", "studio"):
        progress(f"slap line, {quality}")
        rows[f"slap_{quality}"] = _engine_row(f"slap line, {quality}", slap, quality, line, None, extent.long_runs)
    progress("a held string, and the limit of this machine")
    limit = measure_limit(pieces=extent.pieces)
    memory = _peak_memory()
    progress("brute force")
    trial = case_trial("b", "reference", RATES[0], extent.brute)
    rows["brute_force"], slow = _trial_row("brute force", trial, solve, 1)
    result["machine"]["peak_resident_bytes"] = memory
    return result | {
        "case_b": f"open G of paper-g, {CASE_B.apex * 1e3:g} mm at {CASE_B.position:g} m, first {extent.sound:g} s",
        "measurements": rows,
        "agreement": _agreement(slow, fast, min(AGREE_FOR, extent.brute, extent.sound)),
        "ratios": {key: _ratio(rows, upper, lower) for key, _, _, upper, lower in RATIOS},
        "limit": limit,
    }


def _ratio(rows: dict[str, Row], upper: str, lower: str | None) -> float:
    if lower is None:
        return float(1 / rows[upper]["seconds_per_second"])
    return float(rows[upper]["processor"] / rows[lower]["processor"])


def _trial_row(name: str, trial: Trial, solver: Callable[[Trial], Motion], runs: int) -> tuple[Row, Motion]:
    """One string, one pluck; includes the solver's preparation, about 1 ms."""
    clock = Clock()
    for _ in range(runs):
        with clock:
            motion = solver(trial)
    figures = row(
        name,
        trial.duration,
        clock,
        modes=trial.modes,
        contact_rate_hz=int(trial.contact_rate),
        rate_hz=int(trial.output_rate),
        cores=1,
        contacts=int(motion.contact_step.size),
    )
    return figures, motion


def _chords(bass: Instrument, duration: float) -> Score:
    """All open strings at once, as hard as possible, on every beat."""
    return score_of(
        [
            (beat * BEAT, min(BEAT, duration - beat * BEAT), string.open_note, 127)
            for beat in range(int(np.ceil(duration / BEAT)))
            for string in bass.strings
        ],
        RATES[1],
    )


def _slap_line(duration: float) -> Score:
    notes = []
    for k in range(max(1, int(duration / SIXTEENTH))):
        name, velocity = SLAP_BAR[k % len(SLAP_BAR)]
        notes.append((k * SIXTEENTH, 0.8 * SIXTEENTH, note_number(name), velocity))
    return score_of(notes, RATES[1])


def _engine_row(name: str, bass: Instrument, quality: str, score: Score, workers: int | None, runs: int) -> Row:
    """Plays `score` in a prepared `Engine`, from the first message to the last sample, without the strings' tail."""
    preparation, clock = Clock(), Clock()
    for _ in range(runs):
        with preparation:
            engine = Engine(bass, QUALITIES[quality], score.rate, workers=workers)
        with clock:
            frames = sum(block.shape[1] for block in engine.play(score, tail=0.0))
    return row(
        name,
        frames / score.rate,
        clock,
        modes=QUALITIES[quality].modes,
        contact_rate_hz=engine.rates.contact_rate,
        rate_hz=score.rate,
        cores=engine.workers,
        notes=engine.report().notes,
        prepare_s=min(preparation.wall),
    )


def _warm(bass: Instrument) -> None:
    """Compiles or loads the kernels and runs them for a moment."""
    for solver in (solve_trial, solve):
        solver(case_trial("b", "live", RATES[0], 0.01))
    score = score_of([(0.0, 0.02, bass.strings[0].open_note, 100)], RATES[1])
    for _ in Engine(bass, QUALITIES["live"], RATES[1]).play(score, tail=0.0):
        pass


def _agreement(slow: Motion, fast: Motion, until: float) -> dict[str, Any]:
    """Compares contacts and displacement of two solutions over the first `until` s."""
    lists = []
    for x in (slow, fast):
        listed = x.contact_time_s <= until
        lists.append(list(zip(x.contact_step[listed].tolist(), x.contact_index[listed].tolist(), strict=True)))
    count = round(until * RATES[0])
    one, other = slow.displacement_m[:count], fast.displacement_m[:count]
    return {
        "until_s": until,
        "contacts_brute_force": len(lists[0]),
        "contacts_engine": len(lists[1]),
        "contacts_equal": lists[0] == lists[1],
        "displacement": float(np.abs(one - other).max() / np.abs(one).max()),
    }


def _peak_memory() -> int | None:
    """The peak memory of this process, bytes; None on systems that do not report it."""
    try:
        import resource
    except ImportError:
        return None
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * (1 if sys.platform == "darwin" else 1024)


# Key of a ratio, its label, its target, and its two measurements: processor time of the first over the second, which
# other work on the machine hardly changes; without a second, real time over the first.
RATIOS: tuple[tuple[str, str, str, str, str | None], ...] = (
    ("reference_to_real_time", "reference over real time", "4, aim 20", "engine_reference_50k", None),
    ("reference_to_brute_force", "reference over brute force", "", "brute_force", "engine_reference_50k"),
    ("fretless_to_fretted", "cost of fretless over fretted", "at most 10", "fretless", "engine_reference_50k"),
    ("strings_one_core", "four strings live, one core", "5", "strings_live_one_core", None),
    ("strings_all_cores", "four strings live, all cores", "5", "strings_live_all_cores", None),
    ("slap_live", "slap line live, all cores", "5", "slap_live", None),
    ("slap_studio", "slap line studio, all cores", "2", "slap_studio", None),
)
HEAD = ("s of work per s of sound", "modes", "contact", "output", "cores", "runs", "best", "median", "cpu", "speed")
FIRST = "brute_force"  # first row of the table; the others follow in the order of measurement


def table(result: Result) -> str:
    """Returns the figures of `bench_render` as text; "cpu" is processor time, "speed" in times real time."""
    rows, agreement = result["measurements"], result["agreement"]
    order = [FIRST, *(key for key in rows if key != FIRST)]
    memory = result["machine"]["peak_resident_bytes"]
    same = "the same" if agreement["contacts_equal"] else f"{agreement['contacts_brute_force']} and"
    return "\n".join(
        [
            f"case B, brute force to fretless: {result['case_b']}",
            *columns([HEAD, *(_cells(rows[key]) for key in order)]),
            "",
            *(_ratio_line(label, wanted, result["ratios"][key]) for key, label, wanted, _, _ in RATIOS),
            "",
            *limit_lines(result["limit"]),
            f"engine and brute force over {agreement['until_s'] * 1e3:g} ms: {same} {agreement['contacts_engine']} "
            f"contacts, displacement within {agreement['displacement']:.1e}",
            machine_line(result) + (f", {memory / 1e6:.0f} MB at most" if memory else ""),
        ]
    )


def _cells(row: Row) -> tuple[str, ...]:
    contact, output = row["contact_rate_hz"], row["rate_hz"]
    return (
        row["name"],
        str(row["modes"]),
        f"{contact / 1e6:g} MHz",
        f"{output / 1e3:g} kHz",
        str(row["cores"]),
        str(len(row["runs"])),
        *map(_figure, (row["seconds_per_second"], row["median"], row["processor"], 1 / row["seconds_per_second"])),
    )


def _figure(x: float) -> str:
    """Three digits, without powers of ten above one."""
    return f"{x:.0f}" if x >= 100 else f"{x:.3g}"


def _ratio_line(label: str, wanted: str, value: float) -> str:
    return f"{label:33}{_figure(value):>8}" + (f"   wanted {wanted}" if wanted else "")
