"""One point of a sweep: solves its trial and measures every quantity of `quantities.QUANTITIES`."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np

from livebass.engine.solve import output_signal, solve_trial
from livebass.lab.analysis.motion import (
    Solved,
    contact_energy,
    energy,
    first_mode,
    first_of,
    modal_energies,
    states_of,
    t60,
)
from livebass.lab.experiment.grid import Work
from livebass.model.modes import dampings, grazing_apex
from livebass.model.trial import initial_amplitudes, initial_amplitudes_across
from livebass.rows.arrays import Floats
from livebass.sound.analysis import PAPER_RATE, WINDOW, characteristic_frequencies, relative_variation

Result = dict[str, float]  # NaN for a missing quantity, such as the first contact of a pluck without any
PERIODS = 3  # without a contact that end the contact phase
START = 0.1  # s, to measure the glide


def measure_point(work: Work) -> Result:
    """Every quantity of `work`, by name. Raises ValueError if its rates or modes cannot be solved."""
    trial = replace(work.trial, states=(work.trial.samples - 1,))
    solved, output = Solved(trial, solve_trial(trial)), output_signal(work.trial, work.output)
    result = {name: float(read(solved)) for name, read in OF_MOTION.items()}
    result |= {name: read(output) for name, read in OF_OUTPUT.items()}
    start, left = _energies(solved)
    return result | {"energy": start, "energy_left": left / start}


def _characteristic(sound: Floats, frames: int | None = None) -> float:
    """Mean of eq. 14 over the first `frames`, all by default; NaN for less than a window, and for silence."""
    if sound.size < round(WINDOW * PAPER_RATE / 48_000):
        return math.nan
    each = characteristic_frequencies(sound, PAPER_RATE)[:frames]
    sounding = each[np.isfinite(each)]
    return float(sounding.mean()) if sounding.size else math.nan


def _contact_phase(solved: Solved) -> float:
    """Time of the last contact before `PERIODS` periods of the first mode without contact, s."""
    times = np.concatenate([[0.0], solved.motion.contact_time_s])
    if times.size == 1:
        return math.nan
    gaps = np.flatnonzero(np.diff(times) > PERIODS / first_mode(solved))
    return float(times[gaps[0]] if gaps.size else times[-1]) or math.nan  # 0: no contact so soon after the release


def _hardness(solved: Solved) -> float:
    pluck = solved.trial.pluck
    return pluck.apex / grazing_apex(solved.speaking, pluck.position)


def _glide(solved: Solved) -> float:
    """(nu - nu_1) / nu_1, median of the first `START`; NaN without a pitch, or with too little sound for one."""
    try:
        pitch = solved.pitch
    except ValueError:
        return math.nan
    good = np.isfinite(pitch.frequency_hz) & (pitch.time_s < START)
    variation = relative_variation(pitch.frequency_hz[good], first_mode(solved))
    return float(np.median(variation)) if good.any() else math.nan


def _energies(solved: Solved) -> tuple[float, float]:
    """Energy at the release and in the last sample, J, both polarisations summed."""
    s, states = solved.speaking, states_of(solved)
    q, across = initial_amplitudes(solved.trial), initial_amplitudes_across(solved.trial)
    start = energy(s, q, 0 * q) + modal_energies(s, across, 0 * across, across=True).sum()
    end = contact_energy(s, states[0, 0, 0])
    for i, (now, velocity) in enumerate(states[0]):
        end += modal_energies(s, now, velocity, across=i == 1).sum()
    return float(start), float(end)


OF_MOTION: dict[str, Callable[[Solved], float]] = {
    "contacts": lambda solved: solved.motion.contact_step.size,
    "frets": lambda solved: np.unique(solved.contacts.fret).size,
    "first_fret": lambda solved: first_of(solved.contacts.fret.astype(np.float64)),
    "first_contact": lambda solved: first_of(solved.motion.contact_time_s),
    "last_contact": lambda solved: first_of(solved.motion.contact_time_s[::-1]),
    "contact_phase": _contact_phase,
    "hardness": _hardness,
    "characteristic_frequency": lambda solved: _characteristic(solved.motion.displacement_m),
    "characteristic_start": lambda solved: _characteristic(solved.motion.displacement_m, 1),
    "peak": lambda solved: float(np.abs(solved.motion.displacement_m).max()),
    "rms": lambda solved: math.sqrt(float(np.mean(solved.motion.displacement_m**2))),
    "glide": _glide,
    "t60": lambda solved: float(t60(dampings(solved.speaking, 1))[0]),
}
OF_OUTPUT: dict[str, Callable[[Floats], float]] = {  # of the instrument's signal, full scale 1
    "heard_peak": lambda output: float(np.abs(output).max()),
    "heard_characteristic_frequency": _characteristic,
}
