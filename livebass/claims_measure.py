"""What claims measure in solved runs: contact phases, sets of contacts, levels of bands, fundamental, energies.

Times in s, frequencies in Hz, levels in dB. Where something is not there to be measured, NaN, which no claim passes.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from livebass import modes
from livebass.analysis import spectrogram
from livebass.claims_runs import Run
from livebass.modal_motion import modal_energies

Floats = NDArray[np.float64]

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
