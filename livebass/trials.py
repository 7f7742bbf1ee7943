"""A pluck of an instrument's string as people ask for it, checked: what `simulate` and `sweep` solve."""

from __future__ import annotations

import math

import numpy as np

from livebass import limits
from livebass import modes as modal
from livebass.instrument import Instrument, Pluck, Speaking, for_modes, speaking
from livebass.motion import Trial

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
