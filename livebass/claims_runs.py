"""What the claims look at: the paper's cases, and what is varied to answer what it says, each solved once."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from concurrent.futures import ThreadPoolExecutor, as_completed
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from livebass import engine, motion_analysis, reference
from livebass.analysis import Contactogram, characteristic_frequencies, contactogram, frame_times
from livebass.instrument import Neck
from livebass.motion import Motion, Trial
from livebass.paper_cases import CASES, Case, raised
from livebass.yin import Pitch

Floats = NDArray[np.float64]

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
