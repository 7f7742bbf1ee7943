"""The motion of a playing string, mode by mode."""

from __future__ import annotations

import numpy as np

from livebass.engine.prepare import Voice, modal_row, play_frames
from livebass.engine.solve import pluck_event, trial_voice
from livebass.kernels.string.records import MAX_ANSWERS, ROW
from livebass.model import modes
from livebass.model.instrument import Speaking
from livebass.model.trial import Trial
from livebass.rows.arrays import Complexes, Floats


def free_modes(s: Speaking, q: Floats, time_s: Floats, across: bool = False) -> Floats:
    """The modal amplitudes (times, modes) of u, or of v, of a string released at rest with `q`, free of contact."""
    nu, sigma = modes.frequencies(s, q.size, across=across), modes.dampings(s, q.size, across=across)
    omega = np.sqrt((2 * np.pi * nu) ** 2 - sigma**2)
    turn = np.outer(time_s, omega)
    return np.asarray(np.exp(-np.outer(time_s, sigma)) * (np.cos(turn) + sigma / omega * np.sin(turn)) * q)


def mode_speeds(string: Voice, count: int) -> Floats:
    """The amplitude of each of the lowest modes (count,), as a velocity (m^1.5/s), of both polarisations."""
    slot, total = string.slots[int(string.record["slot"][0])], np.zeros(count)
    for w, active in ((slot["u"], True), (slot["v"], int(slot["v_active"]) > 0)):
        if active:
            q, p, pace = (modal_row(w, name)[:count] for name in ("q", "p", "pace"))
            sigma, omega = w["sigma"][:count], w["omega"][:count]
            total += (omega * q) ** 2 + (pace * p - sigma * q) ** 2
    return np.sqrt(total)


def answering_lines(string: Voice) -> Complexes:
    """q - i (dq/dt + sigma q) / omega (m^1.5) of the lines that may answer `string`, (MAX_ANSWERS,)."""
    a, n, found = string.string["answers"][0], int(string.record["answering"][0]), np.zeros(MAX_ANSWERS, complex)
    found[a["line"][:n]] = a["q"][:n] - 1j * a["y"][:n]
    return found


def scale_motion(slot: np.void, factor: float) -> None:
    """Multiplies the motion of a slot's modes by `factor`, for both polarisations."""
    for w in (slot["u"], slot["v"]):
        split = int(w["split"])
        for rows, n in ((w["low"], split), (w["high"], ROW - split)):  # which may share memory
            for name in ("q", "p"):
                rows[name][:n] *= factor


def still_modes(w: np.void, first: int) -> None:
    """Sets the motion of the modes from `first` on, of one polarisation, to zero."""
    split = int(w["split"])
    for name in ("q", "p"):
        w["low"][name][first:split] = 0.0
        w["high"][name][max(first - split, 0) : ROW - split] = 0.0


def energies(trial: Trial) -> tuple[Floats, int]:
    """Energies (J) of the frames at which no fret pushes, and the number of frames at which a fret does.

    H = mu / (2 dt^2) sum P^2 + s^2 q^2 with s = exp(-sigma dt) sin(omega dt), of u and, if the pluck has an angle, of
    v. Without losses eq. 12 conserves H.
    """
    state, pool = trial_voice(trial)
    s, n, dt = trial.speaking, trial.modes, 1 / trial.contact_rate
    rows = []
    for i, name in enumerate(("u", "v") if trial.pluck.angle else ("u",)):
        sigma = np.zeros(n) if trial.lossless else modes.dampings(s, n, across=i == 1)
        omega = np.sqrt((2 * np.pi * modes.frequencies(s, n, across=i == 1)) ** 2 - sigma**2)
        w = state.slots[name][0]
        rows.append((np.exp(-sigma * dt) * np.sin(omega * dt), w["low"]["q"][:n], w["low"]["p"][:n]))  # all float64
    events, out = pluck_event(trial.pluck), np.zeros(1)
    values, pushed = [], 0
    for frame in range(trial.samples):
        play_frames(state, pool.records[0], events[: int(frame == 0)], out)
        if state.pressed():
            pushed += 1
        else:
            total = sum(float(np.sum(p**2 + (sine * q) ** 2)) for sine, q, p in rows)
            values.append(s.string.linear_density / (2 * dt**2) * total)
    _, contacts = state.note()
    assert contacts > 20
    return np.array(values), pushed
