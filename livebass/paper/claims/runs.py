"""What the claims look at: the paper's cases, and what is varied to answer what it says, each solved once.

What claims measure in solved runs: contact phases, sets of contacts, levels of bands, fundamental, energies.

Times in s, frequencies in Hz, levels in dB. Where something is not there to be measured, NaN, which no claim passes.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from concurrent.futures import ThreadPoolExecutor, as_completed
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from livebass.analysis import motion as motion_analysis
from livebass.analysis.motion import modal_energies
from livebass.analysis.sound import (
    Contactogram,
    Pitch,
    characteristic_frequencies,
    contactogram,
    frame_times,
    spectrogram,
)
from livebass.arrays import Floats
from livebass.engine import solve as engine
from livebass.model import modes
from livebass.model.instrument import Neck
from livebass.model.trial import Motion, Trial
from livebass.paper.cases import CASES, Case, raised
from livebass.reference import solver as reference

STATES_EVERY = 512  # output samples between two looks at the modes, 10 ms
SHORT = 0.02  # s of brute force for the energy: the first two sets of contacts of case B
ENERGY_EVERY = 50  # fine steps


@dataclass(frozen=True)
class Run:
    """One solved trial and what is seen in it."""

    trial: Trial
    motion: Motion

    @property
    def rate(self) -> float:
        """Output rate, Hz."""
        return self.trial.output_rate

    @cached_property
    def contacts(self) -> Contactogram:
        """Which fret is met when."""
        return contactogram(self.motion.contact_time_s, self.motion.contact_index, self.trial.speaking.contact_fret)

    @cached_property
    def sets(self) -> list[Contactogram]:
        """The contacts set by set: a set a period."""
        c, number = self.contacts, self.contacts.sets()
        parts = (number == n for n in range(int(number[-1]) + 1 if number.size else 0))
        return [Contactogram(c.time_s[p], c.fret[p], c.release_s[p]) for p in parts]

    @cached_property
    def centroid(self) -> tuple[Floats, Floats]:
        """Middle of each frame (s) and its characteristic frequency (Hz, eq. 14)."""
        nu = characteristic_frequencies(self.motion.displacement_m, self.rate)
        return frame_times(nu.size, self.rate), nu

    @cached_property
    def pitch(self) -> Pitch:
        """Fundamental frequency every millisecond, the same as in the studies' figures."""
        return motion_analysis.pitch(self.trial, self.motion.displacement_m)


Solver = Callable[[Trial], Motion]


@dataclass(frozen=True)
class Job:
    """A trial to be solved, and by what."""

    trial: Callable[[], Trial]
    solver: Solver

    def run(self) -> Run:
        trial = self.trial()
        return Run(trial, self.solver(trial))


def _engine(case: Case) -> Job:
    """The case as the engine solves it, with a look at its modes every 10 ms."""

    def trial() -> Trial:
        asked = case.trial()
        return replace(asked, states=tuple(range(0, asked.samples, STATES_EVERY)))

    return Job(trial, engine.solve_trial)


def _brute(contact_rate: float, lossless: bool) -> Job:
    """The beginning of case B by brute force, with its energy."""
    case = replace(CASES["b"], contact_rate=contact_rate, duration=SHORT)
    return Job(
        lambda: replace(case.trial(), lossless=lossless),
        lambda trial: reference.solve(trial, energy_every=ENERGY_EVERY),
    )


def _far(neck: Neck) -> Neck:
    """Frets 30 mm lower: out of reach."""
    return replace(neck, fret_heights=tuple(h - 0.03 for h in neck.fret_heights))


def _stiff(stiffness: float) -> Case:
    """The case with soft frets, with other frets."""
    return replace(CASES["soft"], neck=lambda neck: replace(neck, contact_stiffness=stiffness))


B, C = CASES["b"], CASES["c"]
JOBS = {name: _engine(case) for name, case in CASES.items()} | {
    "b-twice": _engine(replace(B, contact_rate=16e6, duration=0.2)),
    "b-coarse": _engine(replace(B, contact_rate=512e3, duration=0.2)),
    "c-twice": _engine(replace(C, contact_rate=32e6, duration=0.4)),
    "c-far": _engine(replace(C, contact_rate=512e3, neck=_far)),
    "b-tilted": _engine(replace(B, angle=math.radians(1))),
    "b-fret-12": _engine(replace(B, duration=0.2, neck=raised(12, 1e-4))),
    "k12": _engine(_stiff(1e12)),
    "k11": _engine(_stiff(1e11)),
    "k10": _engine(_stiff(1e10)),
    "energy": _brute(8e6, lossless=True),
    "energy-losses": _brute(8e6, lossless=False),
    "energy-1MHz": _brute(1.024e6, lossless=True),
    "energy-102kHz": _brute(102_400, lossless=True),
}


def solve(names: Iterable[str], workers: int, done: Callable[[], None] = lambda: None) -> dict[str, Run]:
    """Solve the jobs called `names` on so many threads; `done` hears of each. [main thread]"""
    wanted = sorted(set(names), key=list(JOBS).index)
    if not wanted:
        return {}
    runs: dict[str, Run] = {}
    with ThreadPoolExecutor(workers) as pool:
        futures = {pool.submit(JOBS[name].run): name for name in wanted}
        try:
            for future in as_completed(futures):
                runs[futures[future]] = future.result()
                done()
        except BaseException:
            pool.shutdown(wait=False, cancel_futures=True)
            raise
    return runs


WINDOW = 2048  # samples at 51.2 kHz, 40 ms
HIGH_MODES = 20  # of the energy that contacts bring up: above 2 kHz


def first_contact(run: Run) -> float:
    """Time of the first contact."""
    return float(run.contacts.time_s[0]) if run.contacts.time_s.size else math.nan


def first_fret(run: Run) -> int:
    """The fret met first, 0 if none is."""
    return int(run.contacts.fret[0]) if run.contacts.fret.size else 0


def phase(run: Run) -> float:
    """From the first contact to the last."""
    return float(np.ptp(run.contacts.time_s)) if run.contacts.time_s.size else 0.0


def frets(run: Run, start: float = 0.0, end: float = math.inf) -> list[int]:
    """The frets met from `start` to `end`, ascending."""
    c = run.contacts
    return sorted({int(f) for f in c.fret[(c.time_s >= start) & (c.time_s <= end)]})


def set_frets(run: Run, number: int) -> list[int]:
    """The frets met in a set, ascending; 1 is the first set."""
    return sorted({int(f) for f in run.sets[number - 1].fret}) if number <= len(run.sets) else []


def set_sizes(run: Run) -> list[int]:
    """How many frets each set meets."""
    return [len(set(s.fret.tolist())) for s in run.sets]


def set_times(run: Run) -> list[float]:
    """When each set begins."""
    return [float(s.time_s[0]) for s in run.sets]


def fret_times(run: Run, fret: int) -> Floats:
    """Every time a fret is met."""
    return run.contacts.time_s[run.contacts.fret == fret]


def first_time(times: Floats) -> float:
    """The first of them."""
    return float(times[0]) if times.size else math.nan


def count(run: Run, start: float, end: float) -> int:
    """Contacts from `start` to `end`."""
    t = run.contacts.time_s
    return int(np.count_nonzero((t >= start) & (t <= end)))


def longest_pause(run: Run) -> list[float]:
    """Start and end of the longest time between two contacts."""
    t = run.contacts.time_s
    if t.size < 2:
        return [math.nan, math.nan]
    i = int(np.argmax(np.diff(t)))
    return [float(t[i]), float(t[i + 1])]


def fundamental_at(run: Run, times: list[float]) -> list[float]:
    """Fundamental frequency at these times; at the first there is before, which is 12.5 ms."""
    p = run.pitch
    return [float(f) for f in np.interp(times, p.time_s, p.frequency_hz)]


def frets_and_pitch(run: Run) -> float:
    """Correlation of the number of frets of each set but the first with the fundamental then; NaN for few sets."""
    nu = fundamental_at(run, set_times(run)[1:])
    return float(np.corrcoef(set_sizes(run)[1:], nu)[0, 1]) if len(nu) > 2 else math.nan


def glide_end(run: Run, part: float) -> float:
    """When the fundamental is last over its mean from 0.9 s on by more than that part of it."""
    p = run.pitch
    final = float(np.nanmean(p.frequency_hz[p.time_s > 0.9]))
    over = np.flatnonzero(~(p.frequency_hz <= final * (1 + part)))
    return float(p.time_s[over[-1]]) if over.size else 0.0


def centroid_at(run: Run, time: float) -> float:
    """Characteristic frequency (eq. 14) at a time."""
    return float(np.interp(time, *run.centroid))


def contrast(sound: Floats, rate: float, frequency: float, width: float, start: float, end: float) -> float:
    """Level of a band, dB over the mean of the two bands as wide beside it, on average from `start` to `end`."""
    power = spectrogram(sound[round(start * rate) : round(end * rate)], rate, WINDOW, WINDOW // 4) ** 2
    mean, nu = power.mean(axis=0), np.arange(power.shape[1]) * rate / WINDOW

    def level(middle: float) -> float:
        return 10 * math.log10(mean[(nu >= middle - width / 2) & (nu < middle + width / 2)].sum())

    return level(frequency) - (level(frequency - width) + level(frequency + width)) / 2


def partial_levels(run: Run, sound: Floats, partials: int, start: float, end: float) -> tuple[Floats, Floats]:
    """Frequencies (Hz) of the first partials and the levels (dB) of `sound` about them, on average over a time."""
    power = spectrogram(sound[round(start * run.rate) : round(end * run.rate)], run.rate, WINDOW, WINDOW // 4) ** 2
    nu = modes.frequencies(run.trial.speaking, partials + 1)
    edges = np.concatenate([[nu[0] / 2], (nu[1:] + nu[:-1]) / 2]) * WINDOW / run.rate
    sums = np.add.reduceat(power.mean(axis=0), np.ceil(edges).astype(np.int64))[:-1]
    return nu[:-1], np.asarray(10 * np.log10(sums))


def energies(run: Run) -> Floats:
    """Energy of each mode of u every 10 ms, J, (times, modes)."""
    states = run.motion.states
    if states is None:
        raise ValueError("a run without states of its modes")
    return modal_energies(run.trial.speaking, states[:, 0, 0], states[:, 0, 1])


def high_share(run: Run, above: int = HIGH_MODES) -> Floats:
    """Part of the energy in the modes above a number, every 10 ms."""
    e = energies(run)
    return np.asarray(e[:, above:].sum(axis=1) / e.sum(axis=1))


def difference(run: Run, other: Run, start: float, end: float) -> float:
    """Relative error of the displacement at the sensor, in the mean square, `other` being right."""
    here = slice(round(start * run.rate), round(end * run.rate))
    x, y = run.motion.displacement_m[here], other.motion.displacement_m[here]
    return float(np.linalg.norm(x - y) / np.linalg.norm(y))


def energy_drift(run: Run) -> float:
    """Greatest change of the energy, part of the first."""
    e = run.motion.energy_j
    return float(np.abs(e / e[0] - 1).max()) if e is not None else math.nan


def energy_steps(run: Run) -> Floats:
    """Changes of the energy from one look to the next, part of the first."""
    e = run.motion.energy_j
    return np.diff(e) / e[0] if e is not None else np.full(1, math.nan)
