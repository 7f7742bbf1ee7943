"""What a solver is asked, `Trial`, and what it answers, `Motion`: one string, one pluck, released at rest.

Every solver has the signature `solve(trial: Trial) -> Motion`, so that one can be held against another.

A pluck of an instrument's string as people ask for it, checked: what `simulate` and `sweep` solve.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from livebass.arrays import Floats
from livebass.model import modes
from livebass.model import modes as modal
from livebass.model import quality as limits
from livebass.model.instrument import Instrument, Pluck, Speaking, for_modes, speaking

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


LEAST_SINE = 1e-6  # of omega_d dt: at 0 two fine steps do not tell how a mode moves between them


def speaking_string(instrument: Instrument, string: str, fret: int) -> Speaking:
    """The string called `string` stopped at `fret`; ValueError says which there are."""
    try:
        index = instrument.string_index(string)
    except LookupError as error:
        raise ValueError(error.args[0]) from None
    return speaking(instrument.strings[index], instrument.necks[index], fret)


def checked_trial(
    instrument: Instrument,
    s: Speaking,
    apex: float,
    at: float,
    duration: float,
    modes: int | None,
    contact_rate: float,
    rate: int,
    angle: float,
) -> Trial:
    """What to solve, every number checked: ValueError says what is allowed.

    apex m, at m from the stop, angle rad, duration s, contact_rate and rate Hz; modes None for all. The corner is as
    round as the player's finger, the sensors are those of the preset's output.
    """
    limits.APEX.check("apex", apex)
    if not limits.AT.least <= at < s.length:
        least, below = limits.AT.least * 1e3, s.length * 1e3
        raise ValueError(f"pluck at {at * 1e3:g} mm: allowed are {least:g} mm to below {below:g} mm from the stop")
    limits.ANGLE.check("angle", angle)
    limits.DURATION.check("duration", duration)
    limits.RATE.check("rate", rate)
    if contact_rate < rate:
        raise ValueError(f"contact rate {contact_rate:.10g} Hz: allowed is at least the output rate, {rate} Hz")
    most = s.grid_points - 1
    count = most if modes is None else modes
    if not 1 <= count <= most:
        raise ValueError(f"{count} modes: 1 to {most} for this string and fret")
    _check_aliasing(s, count, contact_rate)
    s = for_modes(s, count)
    places = instrument.output.sensor, instrument.output.sensor_v
    for place in places:
        if not 0 < place < s.length:
            raise ValueError(f"sensor {place * 1e3:g} mm from the saddle: between 0 and {s.length * 1e3:g} mm")
    pluck = Pluck(apex, at, instrument.player.rounding, angle)
    sensor, sensor_v = (s.length - place for place in places)
    return Trial(s, pluck, int(count), float(contact_rate), float(rate), float(duration), sensor, sensor_v=sensor_v)


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
