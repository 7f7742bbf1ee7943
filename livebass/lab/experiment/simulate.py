"""One string, one pluck: as a `Solved` in Python, or as the three files of `livebass simulate`.

`displacement.wav` is the displacement at the sensor, float32, scaled to a peak of -1 dBFS, with two channels, u and v,
after an oblique pluck; `contacts.csv` has `time_s,fret,position_m`, fret 0 for wood; `result.npz` has everything, with
pitch, characteristic frequency, energies, T60 and shapes on request. All three are written, or none.
"""

from __future__ import annotations

import io
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, Unpack

import numpy as np

from livebass.files.whole import Transaction, checked_place
from livebass.lab.analysis.motion import Solved, can_resample, columns, shape_columns, state_samples
from livebass.lab.reference.plan import static_compliance
from livebass.model.instrument import Instrument
from livebass.model.modes import CARRIED, carried_modes, dampings, frequencies
from livebass.model.quality import CONTACT_RATE
from livebass.model.rest import lies_on
from livebass.model.trial import (
    Motion,
    PluckOptions,
    PluckRequest,
    Trial,
    checked_trial,
    in_quality,
    initial_amplitudes,
    initial_amplitudes_across,
    speaking_string,
)
from livebass.report.text import csv_text
from livebass.rows.bounds import one_of
from livebass.sound.audiofile import AudioWriter, encoding
from livebass.system.extras import install

FILES = ("displacement.wav", "contacts.csv", "result.npz")
PEAK = 10 ** (-1 / 20)  # of the WAV file, -1 dBFS


def simulate(
    instrument: Instrument,
    *,
    rate: int = 44_100,
    solver: str = "engine",
    shape_at: Sequence[float] = (),
    **pluck: Unpack[PluckOptions],
) -> Solved:
    """Plucks one string once, and returns its motion with everything that can be measured in it.

    Call it in the main thread.

    Args:
        instrument: The bass.
        rate: Output rate of the motion, Hz.
        solver: "engine", or "reference": brute force, without energies and shapes.
        shape_at: Times of the shapes that `Solved.shapes` returns, s.

    Keyword Args:
        string: Name of the string ("G").
        fret: 0 is open (0).
        apex: Height of the pull, m; below 0: towards the frets (3.6e-3).
        at: Place of the pluck, m from the nut or the pressed fret (0.64).
        angle: From straight up towards across, rad (0).
        duration: Length of the motion, s (1).
        quality: One of `QUALITIES` (reference).
        modes: Number of modes of the stopped string, instead of the quality's. Contact cannot follow modes above 0.45
            of the contact rate.

    Raises:
        ValueError: A value out of its limits.

    Example:
        >>> from livebass import QUALITIES, load_preset
        >>> moved = simulate(load_preset("paper-g"), duration=0.05, quality=QUALITIES["live"])
        >>> moved.displacement().shape, moved.contacts.fret.size > 100
        ((2206,), True)
    """
    trial = _trial(instrument, PluckRequest(**pluck), rate, solver, tuple(shape_at), states=True)
    return Solved(trial, _solve(trial, solver))


def simulate_to_directory(
    instrument: Instrument,
    requested: PluckRequest,
    directory: Path,
    rate: int = 44_100,
    solver: str = "engine",
    analyse: bool = False,
    shape_at: Sequence[float] = (),
) -> str:
    """Plucks a string as `requested`, writes the three files, and returns a one-line summary.

    rate: Hz; solver: "engine" or "reference". `analyse` adds the `columns` of `analysis.motion` to result.npz;
    `shape_at` (s) adds the string's shape at these times, with the engine only. Raises ValueError, one line, for values
    out of their limits, before computing or writing anything, and OSError if the files cannot be written; the directory
    is then unchanged. [main thread]
    """
    trial = _trial(instrument, requested, rate, solver, shape_at, states=analyse or bool(shape_at))
    directory = Path(directory)
    with Transaction() as files:
        files.directory(directory)
        for name in FILES:
            checked_place(directory / name)  # now, not after seconds of work
        solved = Solved(trial, _solve(trial, solver))
        found = columns(solved) if analyse else {}
        _write(files, directory, solved, found | shape_columns(solved, shape_at))
    s, contacts, first = trial.speaking, solved.contacts, ""
    neck = instrument.neck(requested.string)
    on = lies_on(s.string, neck, s.fret)
    lies = f" (frets out: it lies on {neck.fret_text(on)})" if on != s.fret else ""
    if contacts.fret.size:
        where = f"on fret {contacts.fret[0]}"
        if neck.fretless or not contacts.fret[0]:
            where = f"on the wood {solved.contact_place[0] * 1e3:.0f} mm from the stop"
        first = f", the first at {contacts.time_s[0] * 1e3:.3f} ms {where}"
    kept, left = carried_modes(trial.speaking, trial.modes, trial.contact_rate), ""
    if kept < trial.modes:
        over = f"modes {kept + 1} to {trial.modes} lie above {CARRIED:g} of the contact rate, too high for contact"
        left = f"; {over}: --modes {kept} leaves them out"
    if analyse and not can_resample(trial):
        left += f"; without the characteristic frequency, which needs SciPy: {install('analysis')}"
    return (
        f"string {s.string.name} {neck.note_text(s.fret)}{lies}, "
        f"{requested.apex * 1e3:g} mm at {requested.at * 1e3:g} mm, {trial.modes} modes, "
        f"{trial.contact_rate / 1e6:g} MHz: {contacts.fret.size} contacts{first}{left}; "
        f"{requested.duration:g} s in {solved.motion.wall_s:.2f} s -> {directory}"
    )


def _trial(
    instrument: Instrument, requested: PluckRequest, rate: int, solver: str, shape_at: Sequence[float], states: bool
) -> Trial:
    """The trial of one pluck, with every value checked; `states`: with modal states, if the solver tells them."""
    one_of("solver", solver, ("engine", "reference"))
    s = speaking_string(instrument, requested.string, requested.fret)
    of_quality, contact_rate = in_quality(s, requested.quality)
    count = of_quality if requested.modes is None else requested.modes
    whole = solver == "engine"  # its contact rate is an integer in Hz
    CONTACT_RATE._replace(whole=whole).check("contact rate", contact_rate)
    trial = checked_trial(instrument, s, requested, count, contact_rate, rate)
    if shape_at and not whole:
        raise ValueError("shapes: only the engine tells them, the reference solver does not")
    return replace(trial, states=state_samples(trial, more=shape_at)) if states and whole else trial


def _solve(trial: Trial, solver: str) -> Motion:
    """Run the solver called `solver`; the engine is loaded only if used."""
    solve: Callable[[Trial], Motion]
    if solver == "reference":
        from livebass.lab.reference.solver import solve
    else:
        from livebass.engine.solve import solve_trial

        solve = solve_trial
    solve(replace(trial, duration=1 / trial.output_rate, states=()))  # compiles, or loads compiled code
    return solve(trial)


def _write(files: Transaction, directory: Path, solved: Solved, found: dict[str, Any]) -> None:
    """Write the three files of a result."""
    sound, table, result = (directory / name for name in FILES)
    trial, motion, s = solved.trial, solved.motion, solved.speaking
    moved = np.column_stack([motion.displacement_m, *([] if motion.across_m is None else [motion.across_m])])
    metres_per_unit = float(np.max(np.abs(moved))) / PEAK or 1.0
    kind = encoding(sound, round(trial.output_rate), bits="float", channels=moved.shape[1])
    writer = AudioWriter(files, sound, kind)
    writer.write((moved / metres_per_unit).astype(np.float32))
    writer.close()
    contacts = solved.contacts
    rows = zip(contacts.time_s.tolist(), contacts.fret.tolist(), solved.contact_place.tolist(), strict=True)
    files.write_text(table, csv_text(("time_s", "fret", "position_m"), rows))
    arrays = io.BytesIO()
    across: dict[str, Any] = {}
    if motion.across_m is not None:
        across = {
            "across_m": motion.across_m,
            "across_sensor_position_m": trial.sensor_v,
            "initial_modal_amplitudes_across": initial_amplitudes_across(trial),
            "friction_n_per_m": s.friction,
            "friction_speed_m_per_s": s.friction_speed,
            "frequencies_across_hz": frequencies(s, trial.modes, across=True),
            "dampings_across_per_s": dampings(s, trial.modes, across=True),
        }
    np.savez(
        arrays,
        **across,
        length_m=s.length,
        linear_density_kg_per_m=s.string.linear_density,
        grid_points=s.grid_points,
        modes=trial.modes,
        frequencies_hz=frequencies(s, trial.modes),
        dampings_per_s=dampings(s, trial.modes),
        contact_frets=np.asarray(s.contact_fret, dtype=np.int64),
        contact_positions_m=np.asarray(s.contact_position, dtype=np.float64),
        contact_heights_m=np.asarray(s.contact_height, dtype=np.float64),
        contact_stiffness=s.contact_stiffness,
        contact_exponent=s.contact_exponent,
        contact_loss_s_per_m=s.contact_loss,
        contact_compliance=static_compliance(trial),  # m per N/m, of the omitted modes
        contact_rate_hz=trial.contact_rate,
        initial_modal_amplitudes=initial_amplitudes(trial),
        sensor_position_m=trial.sensor,
        output_rate_hz=trial.output_rate,
        time_s=motion.time_s,
        displacement_m=motion.displacement_m,
        wav_metres_per_unit=metres_per_unit,
        contact_time_s=motion.contact_time_s,
        contact_index=motion.contact_index,
        wall_s=motion.wall_s,
        **found,
    )
    files.write(result, arrays.getvalue())
