"""Numbers, tables, spectrograms and sounds of a motion, shared by several studies."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from livebass.lab.analysis.motion import HOP, WINDOW, Solved, first_mode, state_samples, string_shape
from livebass.lab.paper.cases import CASES
from livebass.lab.paper.figures.study import Findings, Sound, Table, curve
from livebass.lab.paper.solving import Job
from livebass.model.trial import initial_amplitudes
from livebass.report.text import runs
from livebass.rows.arrays import Floats
from livebass.sound.analysis import PAPER_RATE, Spectrogram, relative_variation, resample, spectrogram_db

STATES = 200  # times at which the state of the modes is saved
WAV_RATE = 44_100  # Hz, of the paper's sounds


def case_job(name: str, duration: float | None = None) -> Job:
    """A case of the paper at 51.2 kHz, with the states of its modes at `STATES` times and at the end."""
    case = CASES[name] if duration is None else replace(CASES[name], duration=duration)
    trial = case.trial()
    return Job(replace(trial, states=state_samples(trial, STATES)))


def spectrum(solved: Solved, across: bool = False) -> Spectrogram:
    """The spectrogram as in the paper, in dB below the loudest."""
    return spectrogram_db(solved.at_paper_rate(across), PAPER_RATE, WINDOW, HOP)


def variation(solved: Solved) -> tuple[Floats, Floats]:
    """Times, s, and the fundamental by YIN over the first eigenfrequency, minus 1, as in figure 7."""
    return solved.pitch.time_s, relative_variation(solved.pitch.frequency_hz, first_mode(solved))


def initial_shape(solved: Solved) -> Floats:
    """u on the grid before the release, m, (N + 1,), with both ends."""
    s = solved.speaking
    return string_shape(s, initial_amplitudes(solved.trial), np.linspace(0, s.length, s.grid_points + 1))


def sound(name: str, caption: str, solved: Solved, across: bool = False) -> Sound:
    """The displacement at its sensor at 44.1 kHz, the rate of the paper's sounds."""
    return Sound(name, caption, resample(solved.displacement(across), round(solved.rate), WAV_RATE), WAV_RATE)


def sets_of(solved: Solved) -> list[tuple[float, float, list[int]]]:
    """Each set of contacts: its first and last time, s, and its contact points (into Speaking.contact_*), ascending."""
    time_s, point = solved.contacts.time_s, solved.motion.contact_index
    return [(float(time_s[s[0]]), float(time_s[s[-1]]), sorted(set(point[s].tolist()))) for s in solved.sets]


def set_times(motions: Iterable[Solved], number: int) -> tuple[float, float] | None:
    """A time window around set `number`, from 0, of all `motions`, s; None if none has so many."""
    sets = [found[number] for found in map(sets_of, motions) if len(found) > number]
    if not sets:
        return None
    first, last = min(s[0] for s in sets), max(s[1] for s in sets)
    room = max(0.1 * (last - first), 5e-5)
    return first - room, last + room


def ranges(frets: list[int]) -> str:
    """Ascending numbers as "1-3, 7"."""
    return ", ".join(str(run[0]) if len(run) == 1 else f"{run[0]}-{run[-1]}" for run in runs(frets))


def places(solved: Solved, points: list[int]) -> str:
    """Contact points in words: fret numbers, or over a board the stretch in mm."""
    s = solved.speaking
    if not solved.over_board:
        return ranges([s.contact_fret[point] for point in points])
    return f"{s.contact_position[points[0]] * 1e3:.0f} to {s.contact_position[points[-1]] * 1e3:.0f} mm"


def sets_table(motions: Mapping[str, Solved], maximum: int = 12) -> Table:
    """The first `maximum` sets of contacts of each motion."""
    rows = [
        (title, k + 1, round(first * 1e3, 3), round(last * 1e3, 3), len(points), places(solved, points))
        for title, solved in motions.items()
        for k, (first, last, points) in enumerate(sets_of(solved)[:maximum])
    ]
    columns = "case", "set", "first contact (ms)", "last contact (ms)", "frets or points", "which"
    return Table(
        "contact-sets", f"The first {maximum} sets of contacts: 4 ms without a new one end a set", columns, rows
    )


def numbers(solved: Solved) -> dict[str, Any]:
    """A motion in a few numbers; None for missing ones, such as a first contact."""
    trial, contacts, sets = solved.trial, solved.contacts, sets_of(solved)
    nu = solved.characteristic()[1]
    change = variation(solved)[1]
    met = contacts.time_s.size > 0
    return {
        "apex_mm": trial.pluck.apex * 1e3,
        "position_m": trial.pluck.position,
        "angle_deg": math.degrees(trial.pluck.angle),
        "duration_s": trial.duration,
        "modes": trial.modes,
        "contact_rate_hz": trial.contact_rate,
        "contacts": int(contacts.time_s.size),
        "first_contact_ms": float(contacts.time_s[0] * 1e3) if met else None,
        "first_fret": int(contacts.fret[0]) or None if met else None,
        "first_place_mm": float(solved.contact_place[0] * 1e3) if met else None,
        "points_first_set": len(sets[0][2]) if sets else 0,
        "last_contact_s": float(contacts.time_s[-1]) if met else None,
        "greatest_displacement_mm": float(np.abs(solved.motion.displacement_m).max() * 1e3),
        "greatest_characteristic_frequency_hz": float(np.nanmax(nu)),
        "last_characteristic_frequency_hz": float(nu[-1]),
        "greatest_frequency_variation": None if np.isnan(change).all() else float(np.nanmax(change)),
        "wall_s": solved.motion.wall_s,
    }


def numbers_table(by_title: Mapping[str, dict[str, Any]]) -> Table:
    """`numbers` of several motions, one row each."""
    columns = {
        "contacts": "contacts", "first contact (ms)": "first_contact_ms", "on fret": "first_fret",
        "at (mm)": "first_place_mm",
        "frets or points of the first set": "points_first_set", "last contact (s)": "last_contact_s",
        "greatest |u| at the sensor (mm)": "greatest_displacement_mm",
        "greatest nu_c (Hz)": "greatest_characteristic_frequency_hz",
        "last nu_c (Hz)": "last_characteristic_frequency_hz",
        "greatest variation of f0": "greatest_frequency_variation",
        "contact rate (MHz)": "contact_rate_hz",
    }  # fmt: skip
    rows = [
        (name, *(n[key] / 1e6 if key == "contact_rate_hz" else n[key] for key in columns.values()))
        for name, n in by_title.items()
    ]
    return Table("numbers", "In numbers", ("case", *columns), rows)


def add_data(found: Findings, name: str, title: str, solved: Solved) -> None:
    """Add a motion to `found`: its sound, its arrays and curves with names that begin with `name`, its numbers."""
    for across in (False, True)[: 1 if solved.motion.across_m is None else 2]:
        axis = "v" if across else "u"
        place = solved.trial.sensor_v if across else solved.trial.sensor
        where = (solved.speaking.length - (place or solved.trial.sensor)) * 1e3
        found.sounds.append(
            sound(f"{name}-{axis}", f"{title}: {axis} at {where:.0f} mm from the bridge", solved, across)
        )
        time_s, nu = solved.characteristic(across)
        found.arrays |= {
            f"{name}_{axis}_m": solved.displacement(across),
            f"{name}_{axis}_characteristic_frequency_hz": nu,
            f"{name}_characteristic_time_s": time_s,
        }
        found.tables.append(
            curve(f"{name}-{axis}-characteristic-frequency", "Eq. 14", time_s=time_s, characteristic_frequency_hz=nu)
        )
    time_s, change = variation(solved)
    found.tables.append(curve(f"{name}-pitch", "YIN", time_s=time_s, relative_frequency_variation=change))
    met, where_met = solved.contacts, solved.contact_place
    found.tables.append(curve(f"{name}-contacts", "Contacts", time_s=met.time_s, fret=met.fret, position_m=where_met))
    found.arrays |= {
        f"{name}_time_s": solved.motion.time_s,
        f"{name}_contact_time_s": met.time_s,
        f"{name}_contact_fret": met.fret,
        f"{name}_contact_place_m": where_met,
        f"{name}_pitch_time_s": time_s,
        f"{name}_frequency_variation": change,
        f"{name}_initial_u_m": initial_shape(solved),
        f"{name}_obstacle_positions_m": np.asarray(solved.speaking.contact_position),
        f"{name}_obstacle_heights_m": np.asarray(solved.speaking.contact_height),
    }
    found.numbers[name] = numbers(solved)


def gather(motions: Mapping[str, Solved]) -> Findings:
    """Data, sounds and numbers of several cases of the paper, by name."""
    found = Findings()
    for name, solved in motions.items():
        add_data(found, name, CASES[name].title, solved)
    by_title = {CASES[name].title: row for name, row in found.numbers.items()}
    found.tables.insert(0, numbers_table(by_title))
    return found
