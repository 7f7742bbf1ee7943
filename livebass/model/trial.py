"""One pluck of one string: a `Trial` to solve and the `Motion` that a solver returns.

Every solver is a function `solve(trial: Trial) -> Motion`: any two can be compared. `checked_trial` builds the trial
for `simulate`, `sweep` and the studies, and checks every number. Equation numbers: Issanchou et al. (2018).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TypedDict

import numpy as np

from livebass.kernels.string import law
from livebass.model.instrument import Instrument, Pluck, Speaking, for_modes, speaking
from livebass.model.modes import dampings, frequencies, pluck_amplitudes
from livebass.model.quality import ANGLE, APEX, AT, DURATION, MIN_APEX, QUALITIES, RATE, Quality, modes_for
from livebass.rows.arrays import Floats, Ints
from livebass.rows.bounds import refusal, within

SLACK = 1e-6  # of a step or sample: 0.1 s at 44.1 kHz ends on sample 4410 despite rounding
MIN_SINE = 1e-6  # of omega_d dt: at 0, two fine steps do not tell how a mode moves in between


@dataclass(frozen=True)
class Trial:
    """One pluck of one speaking string, how finely to compute it, and which results to return."""

    speaking: Speaking
    pluck: Pluck
    modes: int  # 1 to speaking.grid_points - 1; static compliance replaces omitted ones
    contact_rate: float  # Hz, 1/dt of eq. 12
    output_rate: float  # Hz, of the displacement returned; need not divide contact_rate
    duration: float  # s
    sensor: float  # m from the stop
    lossless: bool = False  # all sigma_j zero
    sensor_v: float | None = None  # m from the stop, for v, the second polarisation; None: at `sensor`
    states: tuple[int, ...] = ()  # output samples, ascending, at which the engine also returns the modal state

    @property
    def samples(self) -> int:
        """Number of output samples, at t = i / output_rate for i = 0 ... while t <= duration."""
        return math.floor(self.duration * self.output_rate + SLACK) + 1

    @property
    def follow(self) -> float:
        """Modal velocities dq_j/dt(0) over q_j(0), 1/s: the speed of the finger as it lets go, over the apex."""
        return self.pluck.speed / self.pluck.apex if self.pluck.speed else 0.0

    @property
    def oblique(self) -> bool:
        """True if the string moves across as well: plucked at an angle, or with turned axes."""
        return bool(self.pluck.angle or law.are_turned(self.speaking))

    @property
    def steps(self) -> int:
        """The last fine step n with n / contact_rate <= duration: contacts are listed up to it."""
        return math.floor(self.duration * self.contact_rate + SLACK)


@dataclass(frozen=True)
class Motion:
    """Motion of the string: n samples, k contacts sorted by step, then index, and m energies if requested."""

    time_s: Floats  # (n,), 0 is the release
    displacement_m: Floats  # (n,), u at the sensor
    contact_step: Ints  # (k,), the n >= 1 with eta^n > 0 after eta^{n-1} <= 0
    contact_index: Ints  # (k,), into Speaking.contact_*
    contact_rate_hz: float
    wall_s: float  # s, time of the solver without compilation
    energy_j: Floats | None = None  # (m,)
    energy_time_s: Floats | None = None  # (m,)
    across_m: Floats | None = None  # (n,), v at its sensor; None: plucked along u, the string never leaves that plane
    states: Floats | None = None  # (len(Trial.states), polarisations, 2, modes): q, m^1.5, and dq/dt, m^1.5/s

    @property
    def contact_time_s(self) -> Floats:
        """Time of each contact, (k,), s."""
        return self.contact_step / self.contact_rate_hz


def initial_amplitudes(trial: Trial) -> Floats:
    """Modal amplitudes q_j(0) of u, (trial.modes,), m^1.5 in the basis sqrt(2/L) sin(j pi x / L) of eq. 3."""
    return math.cos(trial.pluck.angle) * pluck_amplitudes(trial.speaking, trial.modes, trial.pluck)


def initial_amplitudes_across(trial: Trial) -> Floats:
    """Modal amplitudes of v, the second polarisation, in the form of `initial_amplitudes`."""
    return math.sin(trial.pluck.angle) * pluck_amplitudes(trial.speaking, trial.modes, trial.pluck, across=True)


def speaking_string(instrument: Instrument, string: str, fret: int) -> Speaking:
    """The string called `string` stopped at `fret`. Raises ValueError with the existing strings or frets."""
    try:
        index = instrument.string_index(string)
    except LookupError as error:
        raise ValueError(error.args[0]) from None
    return speaking(instrument.strings[index], instrument.necks[index], fret)


@dataclass(frozen=True)
class PluckRequest:
    """A requested pluck, and how finely to solve it."""

    string: str = "G"
    fret: int = 0  # 0: open
    apex: float = 3.6e-3  # m
    at: float = 0.64  # m from the nut or the pressed fret
    angle: float = 0.0  # rad from straight up towards across
    duration: float = 1.0  # s
    quality: Quality = QUALITIES["reference"]
    modes: int | None = None  # of the stopped string, instead of the quality's


class PluckOptions(TypedDict, total=False):
    """The fields of `PluckRequest`, as keywords of a function."""

    string: str
    fret: int
    apex: float
    at: float
    angle: float
    duration: float
    quality: Quality
    modes: int | None


def checked_trial(
    instrument: Instrument, s: Speaking, requested: PluckRequest, modes: int | None, contact_rate: float, rate: int
) -> Trial:
    """The trial of a pluck as `requested` on `s`, a string of `instrument`. Raises ValueError for values out of limits.

    contact_rate and rate: Hz; modes: None for all. The player's finger rounds the corner and lets go as in the hardest
    notes; the sensors come from the preset's output.
    """
    apex, at = requested.apex, requested.at
    APEX.check("apex", apex)
    if abs(apex) < MIN_APEX:
        raise refusal("apex", f"at least {MIN_APEX * 1e6:g} um either way", f"{apex * 1e6:g} um")
    if not AT.minimum <= at < s.length:
        rule = f"at least {AT.minimum * 1e3:g} mm from the stop and less than {s.length * 1e3:g} mm"
        raise refusal("place of the pluck", rule, f"{at * 1e3:g} mm")
    ANGLE.check("angle", requested.angle)
    lowest = _lowest_apex(s, at) / math.cos(requested.angle)
    if apex < lowest:
        raise refusal("apex", f"at least {lowest * 1e3:.3f} mm there, where the frets are", f"{apex * 1e3:g} mm")
    DURATION.check("duration", requested.duration)
    RATE.check("rate", rate)
    if contact_rate < rate:
        raise refusal("contact rate", f"at least the output rate, {rate} Hz", f"{contact_rate:.10g} Hz")
    maximum = s.grid_points - 1
    count = maximum if modes is None else modes
    within("modes on this string and fret", count, 1, maximum, whole=True)
    _check_aliasing(s, count, contact_rate)
    s = for_modes(s, count)
    places = instrument.output.sensor, instrument.output.sensor_v
    for place in places:
        if not 0 < place < s.length:
            ends = f"between 0 mm and {s.length * 1e3:g} mm from the saddle"
            raise refusal("sensor", ends, f"{place * 1e3:g} mm")
    pluck = Pluck(apex, at, instrument.player.rounding, requested.angle, instrument.player.release_time)
    sensor, sensor_v = (s.length - place for place in places)
    length = float(requested.duration)
    return Trial(s, pluck, int(count), float(contact_rate), float(rate), length, sensor, sensor_v=sensor_v)


def _lowest_apex(s: Speaking, at: float) -> float:
    """The apex (m, below 0) at which a string pulled towards the neck at `at` (m from the stop) meets an obstacle."""
    x, height = np.array(s.contact_position), np.minimum(s.contact_height, 0.0)
    part = np.where(x < at, x / at, (s.length - x) / (s.length - at))
    return float(np.max(height / part, initial=-math.inf))


def in_quality(s: Speaking, quality: Quality) -> tuple[int, float]:
    """Returns number of modes and contact rate (Hz) of `quality` for `s` and its contact."""
    chosen = quality.for_contact(s.contact_loss, bool(s.surface))
    return modes_for(chosen, s.length, s.string.length, s.grid_points), chosen.contact_rate


def _check_aliasing(s: Speaking, count: int, contact_rate: float) -> None:
    """Raises ValueError if a mode makes a whole number of half turns in a fine step, see `MIN_SINE`.

    Modes above half the contact rate are allowed: the paper uses them, at 2 MHz.
    """
    natural, sigma = 2 * math.pi * frequencies(s, count), dampings(s, count)
    theta = np.sqrt(np.maximum(natural**2 - sigma**2, 0.0)) / contact_rate
    bad = np.flatnonzero((theta > 1) & (np.abs(np.sin(theta)) < MIN_SINE))
    if bad.size:
        hertz = natural[bad[0]] / (2 * math.pi)
        raise ValueError(
            f"contact rate {contact_rate:g} Hz: is twice the {hertz:g} Hz of mode {bad[0] + 1}, divided by a whole "
            "number; any other rate will do"
        )
