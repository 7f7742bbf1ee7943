"""A pluck as an instrument's output gives it: through pickups, coil and tone circuit, or its displacement sensor."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from livebass import layout as at
from livebass import voice
from livebass.instrument import Instrument, Output, Player
from livebass.motion import Trial
from livebass.operators import Rates, operator, pickup_rows, sensor_rows
from livebass.state import instrument_voice


def heard(trial: Trial, output: Output) -> NDArray[np.float64]:
    """The signal of `trial`, (trial.samples,), full scale 1: as `Engine` gives it, but released without a pull.

    Raises ValueError where a sample is not a whole number of fine steps.
    """
    if trial.output_rate != int(trial.output_rate) or trial.contact_rate % trial.output_rate:
        raise ValueError(f"contact rate {trial.contact_rate:g} Hz: no whole multiple of {trial.output_rate:g} Hz")
    s, pluck, count = trial.speaking, trial.pluck, trial.modes
    rates = Rates(int(trial.output_rate), int(trial.contact_rate))
    if output.kind == "displacement":
        across = trial.sensor if trial.sensor_v is None else trial.sensor_v
        taps = sensor_rows(s, (trial.sensor, across), count, rates.rate)
    else:
        taps = pickup_rows(s, output, count, rates.rate)
    op = operator(s, count, rates, taps, lossless=trial.lossless)
    records = np.zeros(1, at.OPERATOR)
    records[0] = op.record
    bass = Instrument("", "", (s.string,), (), output, Player(pull_time=0.0))
    state = instrument_voice(bass, s.string, rates, over_board=len(s.contact_position) > at.MOST_NEAR)
    events = np.zeros(1, at.EVENT)
    events[0] = (0, at.PLUCK, 0, 0, pluck.apex, pluck.position)
    settings = np.array([pluck.rounding, 0.02, pluck.angle])
    out = np.zeros(trial.samples)
    voice.run(
        state.string[0], records, op.memory.ravel(), events, 1, settings, state.log, False, out, out[:0],
    )  # fmt: skip
    return out
