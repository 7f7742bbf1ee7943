"""What a study is, and what comes out of one: figures, tables, sounds, arrays and numbers.

What studies measure in a motion: spectrogram, characteristic frequency, pitch, sets of contacts, sounds.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from livebass.analysis import motion as modal_motion
from livebass.analysis import motion as motion_analysis
from livebass.analysis.sound import (
    PAPER_RATE,
    Contactogram,
    Spectrogram,
    contactogram,
    relative_variation,
    resampled,
    spectrogram_db,
)
from livebass.arrays import Floats
from livebass.model import modes
from livebass.model.instrument import Speaking
from livebass.model.trial import Motion, Trial, initial_amplitudes
from livebass.paper.cases import CASES


@dataclass(frozen=True)
class Solved:
    """A trial and how it came out."""

    trial: Trial
    motion: Motion

    @property
    def speaking(self) -> Speaking:
        return self.trial.speaking

    @property
    def contacts(self) -> Contactogram:
        """Which fret was touched when; 0 is wood."""
        return contactogram(self.motion.contact_time_s, self.motion.contact_index, self.speaking.contact_fret)

    @property
    def contact_place(self) -> Floats:
        """Where each of `contacts` was, m from the stop."""
        return np.asarray(self.speaking.contact_position, np.float64)[self.motion.contact_index]

    @property
    def over_board(self) -> bool:
        """Whether the string may touch wood, anywhere, and not frets only."""
        return bool(self.speaking.surface)

    def displacement(self, across: bool = False) -> Floats:
        """u at its sensor, or v at its own, m, (n,); ValueError for v of a pluck along u."""
        if not across:
            return self.motion.displacement_m
        if self.motion.across_m is None:
            raise ValueError("plucked along u: there is no v")
        return self.motion.across_m


@dataclass(frozen=True)
class Picture:
    """A figure; its file is called `name`."""

    name: str
    caption: str
    figure: Any  # matplotlib.figure.Figure


@dataclass(frozen=True)
class Table:
    """Rows under columns, as CSV; on the page too where `shown`."""

    name: str
    caption: str
    columns: tuple[str, ...]
    rows: list[tuple[Any, ...]]
    shown: bool = True


@dataclass(frozen=True)
class Sound:
    """Something to listen to, (n,), in m; its file is called `name`."""

    name: str
    caption: str
    samples: Floats
    rate: int  # Hz


@dataclass
class Findings:
    """All that comes out of a study."""

    pictures: list[Picture] = field(default_factory=list)
    tables: list[Table] = field(default_factory=list)
    sounds: list[Sound] = field(default_factory=list)
    arrays: dict[str, NDArray[Any]] = field(default_factory=dict)  # into result.npz
    numbers: dict[str, Any] = field(default_factory=dict)  # what JSON can hold


@dataclass(frozen=True)
class Study:
    """One question to the model: the motions it needs, and what is made of them."""

    name: str
    title: str
    section: str  # of the paper
    gives: str  # what comes out, in a line
    trials: Callable[[float | None], dict[str, Trial]]  # duration (s) of each, None: its own
    report: Callable[[Mapping[str, Solved]], Findings]  # of the same keys


def curve(name: str, caption: str, **columns: Any) -> Table:
    """A table of arrays of one length, too long to be shown."""
    rows = list(zip(*(np.asarray(column).tolist() for column in columns.values()), strict=True))
    return Table(name, caption, tuple(columns), rows, shown=False)


STATES = 200  # times at which the modes are looked at
WAV_RATE = 44_100  # Hz, as the paper's sounds


def case_trial(name: str, duration: float | None = None) -> Trial:
    """The case of the paper called so, at 51.2 kHz, with the state of its modes `STATES` times and at the end.

    Every study asks for a case here: the same trial is solved once.
    """
    case = CASES[name] if duration is None else replace(CASES[name], duration=duration)
    trial = case.trial()
    return replace(trial, states=motion_analysis.looked_at(trial, STATES))


def spectrum(solved: Solved, across: bool = False) -> Spectrogram:
    """As the paper's, in dB below the loudest."""
    moved = motion_analysis.at_paper_rate(solved.trial, solved.displacement(across))
    return spectrogram_db(moved, PAPER_RATE, motion_analysis.WINDOW, motion_analysis.HOP)


def characteristic(solved: Solved, across: bool = False) -> tuple[Floats, Floats]:
    """Times, s, and eq. 14, Hz."""
    return motion_analysis.characteristic(solved.trial, solved.displacement(across))


def variation(solved: Solved) -> tuple[Floats, Floats]:
    """Times, s, and the fundamental by YIN relative to the first eigenfrequency less 1, as in figure 7."""
    pitch = motion_analysis.pitch(solved.trial, solved.motion.displacement_m)
    reference = float(modes.frequencies(solved.speaking, 1)[0])
    return pitch.time_s, relative_variation(pitch.frequency_hz, reference)


def initial_shape(solved: Solved) -> Floats:
    """u on the grid before the release, m, (N + 1,), both ends included."""
    s = solved.speaking
    return modal_motion.string_shape(s, initial_amplitudes(solved.trial), np.linspace(0, s.length, s.grid_points + 1))


def sound(name: str, caption: str, solved: Solved, across: bool = False) -> Sound:
    """The displacement at its sensor, at 44.1 kHz as the paper's sounds are."""
    rate = round(solved.trial.output_rate)
    return Sound(name, caption, resampled(solved.displacement(across), rate, WAV_RATE), WAV_RATE)


def sets_of(solved: Solved) -> list[tuple[float, float, list[int]]]:
    """Each set of contacts: its first and last time, s, and the contact points (into Speaking.contact_*), ascending."""
    number, time_s = solved.contacts.sets(), solved.motion.contact_time_s
    out = []
    for k in range(int(number.max()) + 1 if number.size else 0):
        times, points = time_s[number == k], solved.motion.contact_index[number == k]
        out.append((float(times[0]), float(times[-1]), sorted({int(point) for point in points})))
    return out


def set_times(motions: Iterable[Solved], number: int) -> tuple[float, float] | None:
    """From before to after the sets of that number, from 0, of all `motions`, s; None where there is none."""
    sets = [found[number] for found in map(sets_of, motions) if len(found) > number]
    if not sets:
        return None
    first, last = min(s[0] for s in sets), max(s[1] for s in sets)
    room = max(0.1 * (last - first), 5e-5)
    return first - room, last + room


def ranges(frets: list[int]) -> str:
    """Ascending numbers in short: "1-3, 7"."""
    parts: list[list[int]] = []
    for fret in frets:
        if parts and fret == parts[-1][-1] + 1:
            parts[-1].append(fret)
        else:
            parts.append([fret])
    return ", ".join(str(p[0]) if len(p) == 1 else f"{p[0]}-{p[-1]}" for p in parts)


def places(solved: Solved, points: list[int]) -> str:
    """Contact points in short: the frets, or over a board the stretch."""
    s = solved.speaking
    if not solved.over_board:
        return ranges([s.contact_fret[point] for point in points])
    return f"{s.contact_position[points[0]] * 1e3:.0f} to {s.contact_position[points[-1]] * 1e3:.0f} mm"


def sets_table(motions: Mapping[str, Solved], most: int = 12) -> Table:
    """The first sets of contacts of each motion."""
    rows = [
        (title, k + 1, round(first * 1e3, 3), round(last * 1e3, 3), len(points), places(solved, points))
        for title, solved in motions.items()
        for k, (first, last, points) in enumerate(sets_of(solved)[:most])
    ]
    columns = "case", "set", "first contact (ms)", "last contact (ms)", "frets or points", "which"
    return Table("contact-sets", f"The first {most} sets of contacts: 4 ms without a new one end a set", columns, rows)


def contacts_table(name: str, solved: Solved) -> Table:
    """All contacts."""
    contacts = solved.contacts
    columns = {"time_s": contacts.time_s, "fret": contacts.fret, "position_m": solved.contact_place}
    return curve(name, "Contacts", **columns)


def numbers(solved: Solved) -> dict[str, Any]:
    """What is told of a motion in a few numbers; None where there is no such thing."""
    trial, contacts, sets = solved.trial, solved.contacts, sets_of(solved)
    nu = characteristic(solved)[1]
    change = variation(solved)[1]
    first = int(np.argmin(contacts.time_s)) if contacts.time_s.size else None
    return {
        "apex_mm": trial.pluck.apex * 1e3,
        "position_m": trial.pluck.position,
        "angle_deg": math.degrees(trial.pluck.angle),
        "duration_s": trial.duration,
        "modes": trial.modes,
        "contact_rate_hz": trial.contact_rate,
        "contacts": int(contacts.time_s.size),
        "first_contact_ms": None if first is None else float(contacts.time_s[first] * 1e3),
        "first_fret": None if first is None else int(contacts.fret[first]) or None,
        "first_place_mm": None if first is None else float(solved.contact_place[first] * 1e3),
        "points_first_set": len(sets[0][2]) if sets else 0,
        "last_contact_s": float(contacts.time_s[-1]) if contacts.time_s.size else None,
        "greatest_displacement_mm": float(np.abs(solved.motion.displacement_m).max() * 1e3),
        "greatest_characteristic_frequency_hz": float(np.nanmax(nu)),
        "last_characteristic_frequency_hz": float(nu[-1]),
        "greatest_frequency_variation": None if np.isnan(change).all() else float(np.nanmax(change)),
        "wall_s": solved.motion.wall_s,
    }


def numbers_table(told: Mapping[str, dict[str, Any]]) -> Table:
    """`numbers` of several motions, a row each."""
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
        for name, n in told.items()
    ]
    return Table("numbers", "In numbers", ("case", *columns), rows)
