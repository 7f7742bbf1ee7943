"""What a solver is asked, `Trial`, and what it answers, `Motion`: one string, one pluck, released at rest.

Every solver has the signature `solve(trial: Trial) -> Motion`, so that one can be held against another.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from livebass import modes
from livebass.instrument import Pluck, Speaking

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

SLACK = 1e-6  # of a step or sample: lets 0.1 s at 44.1 kHz end on sample 4410 whatever the rounding


@dataclass(frozen=True)
class Trial:
    """One pluck of one speaking string, and how finely to compute it."""

    speaking: Speaking
    pluck: Pluck
    modes: int  # 1 to speaking.grid_points - 1; fewer act with a static spring in place of the rest
    contact_rate: float  # Hz, 1/dt of eq. 12
    output_rate: float  # Hz, of the displacement; need not divide contact_rate
    duration: float  # s
    sensor: float  # m from the stop
    lossless: bool = False  # all sigma_j zero
    sensor_v: float | None = None  # m from the stop, of v, the second polarisation; None: at `sensor`
    states: tuple[int, ...] = ()  # output samples, ascending, at which the engine also gives the modes' state

    @property
    def samples(self) -> int:
        """Number of output samples, at t = i / output_rate for i = 0 ... while t <= duration."""
        return math.floor(self.duration * self.output_rate + SLACK) + 1

    @property
    def steps(self) -> int:
        """Number of the last fine step n with n / contact_rate <= duration: contacts are listed up to it."""
        return math.floor(self.duration * self.contact_rate + SLACK)


@dataclass(frozen=True)
class Motion:
    """How the string moved. Contacts are ordered by step, then by index."""

    time_s: Floats  # (n,), 0 is the release
    displacement_m: Floats  # (n,), u at the sensor
    contact_step: Ints  # (k,), the n >= 1 with eta^n > 0 after eta^{n-1} <= 0
    contact_index: Ints  # (k,), into Speaking.contact_*
    contact_rate_hz: float
    wall_s: float  # time taken by the solver, without compilation
    energy_j: Floats | None = None  # (m,)
    energy_time_s: Floats | None = None  # (m,)
    across_m: Floats | None = None  # (n,), v at its sensor; None: the string was plucked along u, where it stays
    states: Floats | None = None  # (len(Trial.states), polarisations, 2, modes): q, m^1.5, and dq/dt, m^1.5/s

    @property
    def contact_time_s(self) -> Floats:
        """Time of each contact, (k,), s."""
        return self.contact_step / self.contact_rate_hz


def initial_amplitudes(trial: Trial) -> Floats:
    """Modal amplitudes q_j(0) of u, (trial.modes,), m^1.5 in the basis sqrt(2/L) sin(j pi x / L)."""
    return math.cos(trial.pluck.angle) * modes.pluck_amplitudes(trial.speaking, trial.modes, trial.pluck)


def initial_amplitudes_across(trial: Trial) -> Floats:
    """The same of v."""
    return math.sin(trial.pluck.angle) * modes.pluck_amplitudes(trial.speaking, trial.modes, trial.pluck)
