"""Estimates straight from the notes: inharmonicity, losses, the floor and the knock of a release.

Losses come from the T60 of partials alone (eqs. 9 to 11 of C. Issanchou et al., 2018, and the stop); no note is
played for them. They are where a search begins; the other estimates stand in the new preset as found.
"""

from __future__ import annotations

import math
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import soundfile

from livebass.engine.engine import Engine
from livebass.kernels.bass.floor import HARMONICS
from livebass.lab.comparison.floor import density, typical
from livebass.lab.comparison.measures import HISSING, attack, hiss
from livebass.lab.comparison.notes import AFTER, RELEASED, Note
from livebass.lab.comparison.ringing import ringing
from livebass.lab.fitting.bounds import FACTOR, Free
from livebass.lab.fitting.notes import Place, Recorded, string_of
from livebass.lab.fitting.playing import DEFAULT_RATE, play_note
from livebass.lab.fitting.problem import Problem
from livebass.lab.identification.identify import identify
from livebass.lab.identification.partials import RecordingError
from livebass.model.instrument import Instrument, speaking
from livebass.model.modes import dampings
from livebass.model.quality import QUALITIES
from livebass.rows.arrays import Floats, Ints
from livebass.rows.units import OFF

MAXIMUM = 3.0  # times the base preset's inharmonicity, or one by this: farther is another string
NOTES = 10  # whose losses are fitted
PARTIALS = 40  # of each
STEPS = 40  # of least squares
LOSSES = ("thermoelastic", "relaxation", "viscoelastic_angle", "stop_conductance")
FLOORS = (-90.0, -30.0)  # dB
CUTOFF, WIDTH = 20e3, 18e3  # Hz, of the floor; the width of white noise that is as loud
LEVEL = (2e3, 16e3)  # Hz, where every floor is level, or nearly so
FLICKERS, HIGHEST_CORNER = (200.0, 500.0), 5e3  # Hz, where it rises
KNOCKS = (-20.0, 20.0)  # dB
QUIETER = 40.0  # dB: what precedes a note by so much is the floor
LEAD = 0.02  # s of it, at least
VELOCITY = 90  # of a medium note
KNOCKED = 5  # notes that are released
LOUD_KNOCK = 10.0  # dB
MAINS = (50.0, 60.0)  # Hz
NEAR = 1.0  # Hz: mains drift less
LINES_APART = 1.0  # s of silence that tell a line from what is beside it
STANDS_OUT, FEWEST_LINES = 4.0, 3
FAINTEST = -90.0  # dB over a medium note: a hum that nobody hears


@dataclass(frozen=True, eq=False)
class Open:
    """The open notes of one string; a task that finds its inharmonicity."""

    bass: Instrument
    string: str
    notes: tuple[Note, ...]
    digest: str

    @property
    def name(self) -> str:
        """For messages."""
        return f"string {self.string}"

    @property
    def work(self) -> Open:
        """Itself: a worker solves it."""
        return self

    def solve(self) -> dict[str, float]:
        """The inharmonicity; NaN if the notes do not tell it."""
        with tempfile.TemporaryDirectory() as folder:
            paths = [Path(folder) / f"{k}.wav" for k in range(len(self.notes))]
            for path, note in zip(paths, self.notes, strict=True):
                soundfile.write(path, note.sound, note.rate, subtype="FLOAT")
            try:
                found = identify(paths, self.bass, string=self.string, only_string=True)
            except RecordingError:
                return {"inharmonicity": math.nan}
        own = self.bass.strings[self.bass.string_index(self.string)].inharmonicity
        own_value = found.string.inharmonicity
        return {"inharmonicity": own_value if own / MAXIMUM < own_value < own * MAXIMUM else math.nan}


def open_notes(recorded: Recorded, bass: Instrument) -> dict[str, tuple[Note, ...]]:
    """Up to two takes of each string that is known to be open, medium ones first."""
    found: dict[str, list[tuple[int, Note]]] = {}
    middle = _middle(recorded)
    for place, notes in recorded.takes.items():
        i = string_of(bass, place)
        known = bool(place.string) or any(n.open for n in notes)
        if known and i is not None and bass.strings[i].open_note == place.key:
            found.setdefault(bass.strings[i].name, []).extend((abs(place.rank - middle), n) for n in notes)
    return {name: tuple(n for _, n in sorted(notes, key=lambda pair: pair[0])[:2]) for name, notes in found.items()}


def losses(bass: Instrument, recorded: Recorded, free: Sequence[Free]) -> dict[str, float]:
    """The losses that explain the T60 of the softer notes, by key, in the units of `free`; {} if they tell none.

    Needs SciPy.
    """
    from scipy.optimize import least_squares

    numbers = [f for f in free if f.key in LOSSES]
    notes = _decays(bass, recorded)
    if not numbers or sum(t60.size for _, _, _, t60 in notes) < 4 * len(numbers):
        return {}

    def off(scaled: Floats) -> Floats:
        given = {f.key: f.value(float(u)) * (1 if f.section == FACTOR else f.size)
                 for f, u in zip(numbers, scaled, strict=True)}  # fmt: skip
        return np.concatenate([
            np.log(_t60(bass, string, fret, given)[number - 1] / t60) for string, fret, number, t60 in notes
        ])  # fmt: skip

    begin = [min(max(f.on_scale(f.read(bass)), 0.05), 0.95) for f in numbers]
    try:
        found = least_squares(off, begin, bounds=(0, 1), loss="soft_l1", diff_step=0.02, max_nfev=STEPS)
    except ValueError:  # a mode damped beyond critical
        return {}
    return {f.key: f.value(float(u)) for f, u in zip(numbers, found.x, strict=True)}


def _decays(bass: Instrument, recorded: Recorded) -> list[tuple[int, int, Ints, Floats]]:
    """String, fret, numbers of partials and their T60 (s) of some notes, the softest first."""
    found = []
    by_force = sorted(recorded.takes.items(), key=lambda pair: (pair[0].rank, pair[0]))
    softer = [pair for pair in by_force if pair[0].rank <= (len(recorded.layers) - 1) / 2]
    for k in sorted({round(x) for x in np.linspace(0, len(softer) - 1, min(NOTES, len(softer)))}):
        place, takes = softer[k]
        string = string_of(bass, place)
        if string is not None:
            note = takes[0]
            rings = ringing(note.sound[attack(note.sound, note.rate) :], note.rate, note.pitch)
            few = rings.number <= PARTIALS
            found.append((string, place.key - bass.strings[string].open_note, rings.number[few], rings.t60[few]))
    return found


def _t60(bass: Instrument, string: int, fret: int, given: dict[str, float]) -> Floats:
    """T60 (s) of the first PARTIALS of a note with other losses."""
    s, neck = bass.strings[string], bass.necks[string]
    s = replace(
        s, thermoelastic=given.get("thermoelastic", s.thermoelastic), relaxation=given.get("relaxation", s.relaxation)
    )
    if "viscoelastic_angle" in given:
        s = replace(s, viscoelastic_angle=min(s.viscoelastic_angle * given["viscoelastic_angle"], 0.5))
    if "stop_conductance" in given:
        neck = replace(neck, stop_conductance=given["stop_conductance"])
    return np.asarray(math.log(1000) / np.maximum(dampings(speaking(s, neck, fret), PARTIALS), 1e-6))


def floor(recorded: Recorded, problem: Problem) -> float | None:
    """The white noise of the electronics over a medium note, dB; None if nothing tells it.

    A recorded silence tells it, or what precedes the notes, or else the hiss of the softest notes.
    """
    if problem.bass.output.kind != "pickups":
        return None
    notes = _medium(recorded)
    quiet = [_noise(n.sound, n.rate) for n in recorded.quiet] or _before(notes)
    if quiet:
        found = 20 * math.log10(float(np.median(quiet) / _level(notes)))
    else:
        by_hiss = _floor_by_hiss(recorded, problem)
        if by_hiss is None:
            return None
        found = by_hiss
    return min(max(found, FLOORS[0]), FLOORS[1])


def corner(recorded: Recorded, bass: Instrument) -> float | None:
    """The corner of the floor's flicker, Hz, by recorded silences; None if nothing tells it."""
    if not recorded.quiet or bass.output.kind != "pickups":
        return None
    found = []
    for n in recorded.quiet:
        nu, power = density(n.sound, n.rate)
        low, high = ((nu > band[0]) & (nu < min(band[1], 0.45 * n.rate)) for band in (FLICKERS, LEVEL))
        over = typical(power[low]) / max(typical(power[high]), 1e-30)
        slope = float(np.mean(1 / nu[low])) - over * float(np.mean(1 / nu[high]))  # over: 1 + corner / nu, low to high
        found.append((over - 1) / slope if slope > 0 else HIGHEST_CORNER)
    return min(max(float(np.median(found)), 0.0), HIGHEST_CORNER)


def floor_keys(level: float) -> dict[str, str]:
    """The keys of a floor whose white part has so many dB."""
    return {"floor_noise": f"{level:.1f} dB", "floor_cutoff": f"{CUTOFF / 1e3:g} kHz"}


def hum(recorded: Recorded, bass: Instrument) -> tuple[float, float] | None:
    """The mains hum over a medium note, dB, and its frequency, Hz, by a recorded silence; None if it has none."""
    if not recorded.quiet or bass.output.kind != "pickups":
        return None
    found = sorted(map(_hum, recorded.quiet))
    level, mains = found[len(found) // 2]
    if level == 0:
        return None
    over = 20 * math.log10(level / _level(_medium(recorded)))
    return (min(over, FLOORS[1]), mains) if over > FAINTEST else None


def _hum(silence: Note) -> tuple[float, float]:
    """The level of a hum, 0 if there is none, and the mains' frequency, Hz.

    A hum is the mains' harmonics that stand out of what is beside them, if there are several.
    """
    n = silence.sound.size
    if n < LINES_APART * silence.rate:
        return 0.0, MAINS[0]
    window = np.hanning(n)
    lines = 2 * np.abs(np.fft.rfft(silence.sound * window)) / window.sum()
    nu = np.arange(lines.size) * silence.rate / n
    found = []
    for mains in MAINS:
        heard = []
        for k in range(1, HARMONICS + 1):
            off = np.abs(nu - k * mains)
            peak, beside = lines[off < NEAR].max(), np.median(lines[(off > 2 * NEAR) & (off < 0.4 * mains)])
            if peak > STANDS_OUT * beside:
                heard.append(peak)
        level = math.sqrt(0.5 * float(np.sum(np.square(heard)))) if len(heard) >= FEWEST_LINES else 0.0
        found.append((level, mains))
    return max(found)


def _noise(silence: Floats, rate: int) -> float:
    """The level of a floor up to CUTOFF that is as dense as a silence; its lines, a hum, do not count."""
    nu, power = density(silence, rate)
    inside = power[(nu > LEVEL[0]) & (nu < min(LEVEL[1], 0.45 * rate))]
    return math.sqrt(WIDTH * typical(inside)) + 1e-12


def _medium(recorded: Recorded) -> list[Note]:
    """The notes of the middle layer."""
    middle = _middle(recorded)
    return [n for place, takes in recorded.takes.items() if place.rank == middle for n in takes]


def _middle(recorded: Recorded) -> int:
    return (len(recorded.layers) - 1) // 2


def _level(notes: Sequence[Note]) -> float:
    """The median level of the first 0.3 s of notes."""
    return float(np.median([_rms(n.sound[attack(n.sound, n.rate) :][: round(0.3 * n.rate)]) for n in notes]))


def _before(notes: Sequence[Note]) -> list[float]:
    """The level of what precedes each note, where it is quiet."""
    found = []
    for n in notes:
        before = n.sound[: max(0, attack(n.sound, n.rate) - round(0.005 * n.rate))]
        maximum = float(np.abs(n.sound).max()) * 10 ** (-QUIETER / 20)
        if before.size > LEAD * n.rate and 0 < np.abs(before).max() < maximum:
            found.append(_noise(before, n.rate))
    return found


def _floor_by_hiss(recorded: Recorded, problem: Problem) -> float | None:
    places = [p for p in sorted(problem.theirs) if p.rank == min(problem.ranks)]
    theirs = [_hiss(n) for p in places for n in recorded.takes[p]]
    level = problem.bass.player.floor_noise
    if not theirs or any(map(math.isnan, theirs)):
        return None
    level = min(max(level, FLOORS[0]), FLOORS[1])
    for _ in range(2):
        tried = replace(problem, free=(), fixed={"player": floor_keys(level)})
        ours = [_hiss(n) for n in tried.play((), places).values()]
        level = min(max(level + float(np.median(theirs) - np.median(ours)), FLOORS[0]), FLOORS[1])
    return level


def _hiss(note: Note) -> float:
    """The hiss of a note, dB; NaN if the rate is too low for it."""
    begin, end = (attack(note.sound, note.rate) + round(t * note.rate) for t in HISSING)
    return hiss(note.sound[begin:end], note.rate)


def _rms(sound: Floats) -> float:
    """The mean level of a sound."""
    return math.sqrt(float(np.mean(sound**2))) + 1e-12


def knock(recorded: Recorded, bass: Instrument) -> float | None:
    """The preset's release_noise (dB) whose releases peak as the recorded ones do; None if none is recorded."""
    if not recorded.releases or bass.player.release_noise <= OFF or bass.output.kind != "pickups":
        return None
    rest = [_peak(n, RELEASED, RELEASED + 0.1) for n in _medium(recorded)]
    theirs = float(np.median([_peak(n, 0.0, AFTER) for n in recorded.releases]) - np.median(rest))
    places = [p for p in places_of(recorded, bass) if p.rank == _middle(recorded)][:KNOCKED]
    level = LOUD_KNOCK  # from above: a knock below the note's own level is not heard
    for _ in range(3) if places else ():
        player = replace(bass.player, release_noise=level, release_spread=0.0)
        ours = _knocks(replace(bass, player=player), places)
        level = min(max(level + theirs - ours, KNOCKS[0]), KNOCKS[1])
    return level if places else None


def _knocks(bass: Instrument, places: Sequence[Place]) -> float:
    """The peak of a release over the peak of the note after RELEASED, dB, median over places."""
    engine = Engine(bass, QUALITIES["live"], DEFAULT_RATE, workers=1)
    found = []
    for place in places:
        string = string_of(bass, place)
        assert string is not None
        long, short = (
            Note(
                "", play_note(engine.another(place.key), string, place.key, VELOCITY, 1.5, released), DEFAULT_RATE, 0.0
            )
            for released in (None, RELEASED)
        )
        found.append(_peak(short, RELEASED, RELEASED + AFTER) - _peak(long, RELEASED, RELEASED + 0.1))
    return float(np.median(found))


def _peak(note: Note, begin: float, end: float) -> float:
    """The peak from `begin` to `end` (s) of a recording, dB."""
    part = note.sound[round(begin * note.rate) : round(end * note.rate)]
    return 20 * math.log10(float(np.abs(part).max(initial=0.0)) + 1e-9)


def places_of(recorded: Recorded, bass: Instrument) -> list[Place]:
    """The places that a bass can play."""
    return [p for p in recorded.takes if string_of(bass, p) is not None]
