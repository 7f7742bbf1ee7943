"""One string, one pluck, to files: what `livebass simulate` does.

Writes `displacement.wav` (float32, the sensor's displacement scaled to a peak of -1 dBFS), `contacts.csv`
(`time_s,fret`) and `result.npz`, all three or none: they are made in a directory beside the one asked for.
"""

from __future__ import annotations

import io
import math
import os
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import soundfile

from livebass import modes as modal
from livebass.instrument import Instrument, Pluck, Speaking, speaking
from livebass.motion import Floats, Motion, Trial, initial_amplitudes
from livebass.reference import static_compliance

GREATEST_APEX = 0.030  # m
GREATEST_CONTACT_RATE = 64e6  # Hz
GREATEST_DURATION = 60.0  # s
LEAST_RATE, GREATEST_RATE = 8000, 192000  # Hz
LEAST_SINE = 1e-6  # of omega_d dt: at 0 two fine steps do not tell how a mode moves between them
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
) -> str:
    """Pluck `string` stopped at `fret` with corner `apex` (m) at `at` (m from the stop); a one-line summary.

    duration s; modes None for all; contact_rate and rate Hz; solver "engine" or "reference". Raises
    ValueError, one line that says what is allowed, before anything is computed or written, and OSError
    where the files cannot be written; the directory is then as it was. [main thread]
    """
    if solver not in ("engine", "reference"):
        raise ValueError(f"solver {solver!r}: engine or reference")
    s = _speaking(instrument, string, fret)
    trial = _trial(instrument, s, apex, at, duration, modes, contact_rate, rate)
    with _replacing(Path(directory)) as place:
        motion = _solve(trial, solver)
        _write(place, trial, motion)
    first = ""
    if motion.contact_step.size:
        when, where = motion.contact_time_s[0], s.contact_fret[motion.contact_index[0]]
        first = f", the first at {when * 1e3:.3f} ms on fret {where}"
    return (
        f"string {s.string.name} fret {s.fret}, {apex * 1e3:g} mm at {at * 1e3:g} mm, {trial.modes} modes, "
        f"{contact_rate / 1e6:g} MHz: {motion.contact_step.size} contacts{first}; "
        f"{duration:g} s in {motion.wall_s:.2f} s -> {directory}"
    )


def _speaking(instrument: Instrument, string: str, fret: int) -> Speaking:
    """The speaking string, or ValueError."""
    try:
        index = instrument.string_index(string)
    except LookupError as error:
        raise ValueError(error.args[0]) from None
    return speaking(instrument.strings[index], instrument.necks[index], fret)


def _within(name: str, value: float, least: float, most: float, unit: str, scale: float = 1.0) -> None:
    """Raise ValueError unless least < value <= most (a NaN never is); shown in `unit` = 1 / `scale`."""
    if not least < value <= most:
        raise ValueError(
            f"{name} {value * scale:g} {unit}: above {least * scale:g} and up to {most * scale:g} {unit}"
        )


def _trial(
    instrument: Instrument,
    s: Speaking,
    apex: float,
    at: float,
    duration: float,
    modes: int | None,
    contact_rate: float,
    rate: int,
) -> Trial:
    """What to solve, every number checked: ValueError says what is allowed."""
    _within("apex", apex, 0.0, GREATEST_APEX, "mm", 1e3)
    if not 0 < at < s.length:
        raise ValueError(f"pluck at {at * 1e3:g} mm: between 0 and {s.length * 1e3:g} mm from the stop")
    _within("duration", duration, 0.0, GREATEST_DURATION, "s")
    if not LEAST_RATE <= rate <= GREATEST_RATE:
        raise ValueError(f"rate {rate} Hz: {LEAST_RATE} to {GREATEST_RATE} Hz")
    if not rate <= contact_rate <= GREATEST_CONTACT_RATE:
        raise ValueError(
            f"contact rate {contact_rate:g} Hz: from the output rate {rate} to {GREATEST_CONTACT_RATE:g} Hz"
        )
    most = s.grid_points - 1
    count = most if modes is None else modes
    if not 1 <= count <= most:
        raise ValueError(f"{count} modes: 1 to {most} for this string and fret")
    _check_aliasing(s, count, contact_rate)
    sensor = instrument.output.sensor
    if not 0 < sensor < s.length:
        raise ValueError(f"sensor {sensor * 1e3:g} mm from the saddle: between 0 and {s.length * 1e3:g} mm")
    pluck = Pluck(apex, at, instrument.player.rounding)
    return Trial(s, pluck, int(count), float(contact_rate), float(rate), float(duration), s.length - sensor)


def _check_aliasing(s: Speaking, count: int, contact_rate: float) -> None:
    """Refuse a rate at which a mode makes a whole number of half turns in a step, see `LEAST_SINE`.

    Modes above half the contact rate are allowed: the paper itself has them, at 2 MHz.
    """
    natural, sigma = 2 * math.pi * modal.frequencies(s, count), modal.dampings(s, count)
    theta = np.sqrt(np.maximum(natural**2 - sigma**2, 0.0)) / contact_rate
    bad = np.flatnonzero((theta > 1) & (np.abs(np.sin(theta)) < LEAST_SINE))
    if bad.size:
        hertz = natural[bad[0]] / (2 * math.pi)
        raise ValueError(
            f"contact rate {contact_rate:g} Hz: twice the {hertz:g} Hz of mode {bad[0] + 1}, over a whole "
            "number; any other rate will do"
        )


def _solve(trial: Trial, solver: str) -> Motion:
    """Run the solver called `solver`; the engine is loaded only if it is asked for."""
    if solver == "reference":
        from livebass.reference import solve

        return solve(trial)
    from livebass.engine import solve_trial

    return solve_trial(trial)


def _write(place: Path, trial: Trial, motion: Motion) -> None:
    """The three files of a result."""
    s = trial.speaking
    loudest = float(np.max(np.abs(motion.displacement_m)))
    metres_per_unit = loudest / PEAK or 1.0
    (place / "displacement.wav").write_bytes(
        _wav_bytes(motion.displacement_m / metres_per_unit, round(trial.output_rate))
    )
    frets = np.asarray(s.contact_fret, dtype=np.int64)
    with open(place / "contacts.csv", "w", encoding="ascii", newline="\n") as table:
        table.write("time_s,fret\n")
        for when, index in zip(motion.contact_time_s, motion.contact_index, strict=True):
            table.write(f"{float(when)!r},{frets[index]}\n")
    np.savez(
        place / "result.npz",
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
    )


def _wav_bytes(samples: Floats, rate: int) -> bytes:
    """A float32 WAV file of `samples`, the same bytes whenever it is made.

    libsndfile puts the time of day into the PEAK chunk: header, size, version, then 4 bytes of time.
    """
    memory = io.BytesIO()
    soundfile.write(memory, samples.astype(np.float32), rate, format="WAV", subtype="FLOAT")
    data = bytearray(memory.getvalue())
    peak = data.find(b"PEAK", 0, data.find(b"data"))
    if peak >= 0:
        data[peak + 12 : peak + 16] = bytes(4)
    return bytes(data)


@contextmanager
def _replacing(directory: Path) -> Iterator[Path]:
    """A new directory whose files end up in `directory` if nothing goes wrong; otherwise all is as before."""
    if directory.exists() and not directory.is_dir():
        raise ValueError(f"{directory}: exists and is not a directory")
    directory = directory.resolve()
    made = [p for p in (directory, *directory.parents) if not p.exists()][1:]  # deepest first
    place = directory.parent / f".{directory.name}.{os.getpid()}.part"
    try:
        place.mkdir(parents=True, exist_ok=True)
        yield place
        if directory.exists():
            for file in sorted(place.iterdir()):
                os.replace(file, directory / file.name)
            place.rmdir()
        else:
            os.replace(place, directory)
    except BaseException:
        shutil.rmtree(place, ignore_errors=True)
        for parent in made:
            if parent.is_dir() and not any(parent.iterdir()):
                parent.rmdir()
        raise
