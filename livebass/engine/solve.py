"""Solves one pluck with the kernels: a `Trial` in, its `Motion` or its signal out."""

from __future__ import annotations

import time
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from livebass.engine import prepare
from livebass.kernels.string.preparing import PICKUPS, SAMPLED, SENSORS
from livebass.kernels.string.records import EVENT, PLUCK
from livebass.model.instrument import Output, Player, Pluck
from livebass.model.trial import Motion, Trial, initial_amplitudes, initial_amplitudes_across
from livebass.rows.arrays import Floats
from livebass.rows.bounds import refusal

LOG = 1 << 16  # contacts between two reads of the log


def trial_voice(trial: Trial, log: int = LOG) -> tuple[prepare.Voice, prepare.Pool]:
    """A string ready for the pluck of `trial`, with displacement as output, and its operator."""
    if trial.output_rate != int(trial.output_rate) or trial.contact_rate != int(trial.contact_rate):
        raise refusal("rates", "whole numbers of Hz", f"{trial.output_rate:.10g} and {trial.contact_rate:.10g} Hz")
    rates = prepare.Rates(int(trial.output_rate), int(trial.contact_rate))
    note = prepare.Note(trial.speaking, trial.modes, sensors(trial))
    pool = prepare.operators([[note]], SAMPLED, rates, lossless=trial.lossless)
    state = prepare.new_voice(rates, log)
    v = state.record
    v["raw"], v["rounding"], v["angle"] = 1, trial.pluck.rounding, trial.pluck.angle
    v["release"], v["follow"] = trial.pluck.release, trial.follow
    return state, pool


def sensors(trial: Trial) -> prepare.Rows:
    """The taps of u and of v: the place of each sensor, m from the stop."""
    return (trial.sensor,), (trial.sensor if trial.sensor_v is None else trial.sensor_v,)


def pluck_event(pluck: Pluck) -> NDArray[np.void]:
    """`pluck` as an event of the first frame, (1,)."""
    events = np.zeros(1, EVENT)
    events["kind"], events["apex"], events["place"] = PLUCK, pluck.apex, pluck.position
    return events


def solve_trial(trial: Trial) -> Motion:
    """The engine's solution of `trial`, sampled at its output rate; `reference.solver.solve` is the other solver."""
    began = time.perf_counter()
    if trial.states and not 0 <= min(trial.states) <= max(trial.states) < trial.samples:
        raise ValueError(f"state at sample {max(trial.states)}: there are 0 to {trial.samples - 1}")
    state, pool = trial_voice(trial)
    events = pluck_event(trial.pluck)
    out, across = np.zeros(trial.samples), np.zeros(trial.samples)
    contacts, states = [], []
    edges = sorted({*range(0, trial.samples, 4096), *trial.states, trial.samples})
    for first, end in pairwise(edges):
        if first in trial.states:
            states.append(modal_state(state, trial))
        prepare.play_frames(state, pool.records[0], events, out[first:end], across[first:end])
        events = events[:0]
        contacts.append(state.log[: int(state.record[0]["logged"])].copy())
        state.record["logged"] = 0
    logged = np.concatenate(contacts)
    logged = logged[logged["step"] <= trial.steps]
    order = np.lexsort((logged["point"], logged["step"]))
    return Motion(
        time_s=np.arange(trial.samples) / trial.output_rate,
        displacement_m=out,
        contact_step=logged["step"][order],
        contact_index=logged["point"][order],
        contact_rate_hz=trial.contact_rate,
        wall_s=time.perf_counter() - began,
        across_m=across if trial.oblique else None,
        states=np.array(states) if states else None,
    )


def modal_state(state: prepare.Voice, trial: Trial) -> Floats:
    """q and dq/dt of the sounding slot, (polarisations, 2, modes); one polarisation if plucked along u."""
    if state.record[0]["frame"] == 0:  # the pluck is an event of the first frame
        both = initial_amplitudes(trial), initial_amplitudes_across(trial)
        held = np.array(both[: 2 if trial.oblique else 1])
        return np.stack([held, trial.follow * held], axis=1)
    slot = state.slots[int(state.record[0]["slot"])]
    polarisations = [slot["u"], slot["v"]] if trial.oblique else [slot["u"]]
    names = "q", "p", "pace", "sigma"
    rows = ([prepare.modal_row(w, name)[: trial.modes] for w in polarisations] for name in names)
    q, p, pace, sigma = map(np.array, rows)
    return np.stack([q, pace * p - sigma * q], axis=1)


def output_signal(trial: Trial, output: Output) -> NDArray[np.float64]:
    """The signal of `trial`, (trial.samples,), full scale 1: as from `Engine`, but released without a pull.

    Raises ValueError if a sample is not a whole number of fine steps.
    """
    if trial.output_rate != int(trial.output_rate) or trial.contact_rate % trial.output_rate:
        raise ValueError(f"contact rate {trial.contact_rate:g} Hz: no whole multiple of {trial.output_rate:g} Hz")
    s, pluck = trial.speaking, trial.pluck
    rates = prepare.Rates(int(trial.output_rate), int(trial.contact_rate))
    sensed = output.kind == "displacement"
    note = prepare.Note(s, trial.modes, sensors(trial) if sensed else prepare.pickup_taps(s, output))
    pool = prepare.operators([[note]], SENSORS if sensed else PICKUPS, rates, lossless=trial.lossless)
    player = Player(
        pull_time=0.0, rounding=pluck.rounding, pluck_angle=pluck.angle, release_time=pluck.release,
        release_speed=pluck.speed, greatest_apex=pluck.apex,
    )  # fmt: skip
    numbers = prepare.instrument_numbers((s.string,), output, player)
    (state,) = prepare.pickup_voices(numbers, output.coil, rates)
    out = np.zeros(trial.samples)
    prepare.play_frames(state, pool.records[0], pluck_event(pluck), out)
    return out
