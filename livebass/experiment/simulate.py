"""One string, one pluck, to files: what `livebass simulate` does.

Writes `displacement.wav` (float32, the displacement at the sensor scaled to a peak of -1 dBFS; after an oblique pluck
in two channels, u and v), `contacts.csv` (`time_s,fret,position_m`; fret 0 is wood) and `result.npz`, all three or
none. What is found in the motion (pitch, characteristic frequency, energies, T60, shapes) is in the last if asked for.
"""

from __future__ import annotations

import io
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from livebass.analysis.motion import columns, looked_at, shape_columns
from livebass.audiofile import AudioWriter, encoding
from livebass.files import Transaction, checked_place
from livebass.model import modes as modal
from livebass.model import quality as limits
from livebass.model.instrument import Instrument
from livebass.model.trial import (
    Motion,
    Trial,
    checked_trial,
    initial_amplitudes,
    initial_amplitudes_across,
    speaking_string,
)
from livebass.reference.solver import static_compliance
from livebass.report.text import csv_text

FILES = ("displacement.wav", "contacts.csv", "result.npz")
PEAK = 10 ** (-1 / 20)  # of the WAV file, -1 dBFS


def simulate_to_directory(
    instrument: Instrument,
    *,
    string: str,
    fret: int,
    apex: float,
    at: float,
    duration: float,
    modes: int | None,
    contact_rate: float,
    rate: int,
    solver: str,
    directory: Path,
    angle: float = 0.0,
    analyse: bool = False,
    shape_at: Sequence[float] = (),
) -> str:
    """Pluck `string` stopped at `fret` with corner `apex` (m) at `at` (m from the stop); a one-line summary.

    `angle` rad from straight up towards across; duration s; modes None for all; contact_rate and rate Hz; solver
    "engine" or "reference"; analyse: what `motion_analysis.columns` finds goes into result.npz; shape_at: times, s, at
    which the engine tells the string's shape there too. Raises ValueError, one line that says what is allowed, before
    anything is computed or written, and OSError where the files cannot be written; the directory is then as it was.
    [main thread]
    """
    if solver not in ("engine", "reference"):
        raise ValueError(f"solver {solver!r}: engine or reference")
    s = speaking_string(instrument, string, fret)
    whole = solver == "engine"  # which cuts a sample into whole steps
    limits.CONTACT_RATE._replace(whole=whole).check("contact rate", contact_rate)
    trial = checked_trial(instrument, s, apex, at, duration, modes, contact_rate, rate, angle)
    if shape_at and not whole:
        raise ValueError("shapes: only the engine tells them, the reference solver does not")
    if whole and (analyse or shape_at):
        trial = replace(trial, states=looked_at(trial, more=shape_at))
    directory = Path(directory)
    with Transaction() as files:
        files.directory(directory)
        for name in FILES:
            checked_place(directory / name)  # now, not after seconds of work
        motion = _solve(trial, solver)
        found = columns(trial, motion) if analyse else {}
        _write(files, directory, trial, motion, found | shape_columns(trial, motion, shape_at))
    first = ""
    if motion.contact_step.size:
        when, point = motion.contact_time_s[0], int(motion.contact_index[0])
        fret_hit, place = trial.speaking.contact_fret[point], trial.speaking.contact_position[point]
        where = f"on fret {fret_hit}" if fret_hit else f"on the wood {place * 1e3:.0f} mm from the stop"
        first = f", the first at {when * 1e3:.3f} ms {where}"
    return (
        f"string {s.string.name} fret {s.fret}, {apex * 1e3:g} mm at {at * 1e3:g} mm, {trial.modes} modes, "
        f"{contact_rate / 1e6:g} MHz: {motion.contact_step.size} contacts{first}; "
        f"{duration:g} s in {motion.wall_s:.2f} s -> {directory}"
    )


def _solve(trial: Trial, solver: str) -> Motion:
    """Run the solver called `solver`; the engine is loaded only if it is asked for."""
    solve: Callable[[Trial], Motion]
    if solver == "reference":
        from livebass.reference.solver import solve
    else:
        from livebass.engine.solve import solve_trial

        solve = solve_trial
    solve(replace(trial, duration=1 / trial.output_rate, states=()))  # compiles, or loads what was compiled
    return solve(trial)


def _write(files: Transaction, directory: Path, trial: Trial, motion: Motion, found: dict[str, Any]) -> None:
    """The three files of a result."""
    sound, table, result = (directory / name for name in FILES)
    s = trial.speaking
    moved = np.column_stack([motion.displacement_m, *([] if motion.across_m is None else [motion.across_m])])
    metres_per_unit = float(np.max(np.abs(moved))) / PEAK or 1.0
    kind = encoding(sound, round(trial.output_rate), bits="float", channels=moved.shape[1])
    writer = AudioWriter(files, sound, kind)
    writer.write((moved / metres_per_unit).astype(np.float32))
    writer.close()
    frets = np.asarray(s.contact_fret, dtype=np.int64)
    places = np.asarray(s.contact_position, dtype=np.float64)[motion.contact_index]
    rows = zip(motion.contact_time_s.tolist(), frets[motion.contact_index].tolist(), places.tolist(), strict=True)
    files.write(table, csv_text(("time_s", "fret", "position_m"), rows).encode())
    arrays = io.BytesIO()
    across: dict[str, Any] = {}
    if motion.across_m is not None:
        across = {
            "across_m": motion.across_m,
            "across_sensor_position_m": trial.sensor_v,
            "initial_modal_amplitudes_across": initial_amplitudes_across(trial),
            "friction_n_per_m": s.friction,
            "friction_speed_m_per_s": s.friction_speed,
        }
    np.savez(
        arrays,
        **across,
        length_m=s.length,
        linear_density_kg_per_m=s.string.linear_density,
        grid_points=s.grid_points,
        modes=trial.modes,
        frequencies_hz=modal.frequencies(s, trial.modes),
        dampings_per_s=modal.dampings(s, trial.modes),
        contact_frets=frets,
        contact_positions_m=np.asarray(s.contact_position, dtype=np.float64),
        contact_heights_m=np.asarray(s.contact_height, dtype=np.float64),
        contact_stiffness=s.contact_stiffness,
        contact_exponent=s.contact_exponent,
        contact_compliance=static_compliance(trial),  # m per N/m, of the modes left out
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
