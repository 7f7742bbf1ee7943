"""One point of a sweep: its trial solved, and all of `sweep_quantities.QUANTITIES` of it."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from livebass.analysis import motion as modal_motion
from livebass.analysis import motion as motion_analysis
from livebass.analysis import sound as yin
from livebass.analysis.sound import PAPER_RATE, WINDOW, characteristic_frequencies
from livebass.arrays import Floats
from livebass.engine.solve import heard, solve_trial
from livebass.experiment.grid import Work
from livebass.model import modes
from livebass.model.trial import Motion, initial_amplitudes, initial_amplitudes_across

Result = dict[str, float]  # NaN where there is none, such as the first contact of a pluck without
PERIODS = 3  # without a contact end the contact phase
START = 0.1  # s: of the fundamental by YIN


@dataclass(frozen=True)
class Seen:
    """What the quantities are read off."""

    work: Work
    motion: Motion
    output: Floats  # (n,), what the instrument gives


def measured(work: Work) -> Result:
    """Every quantity of `work`, by name. Raises ValueError where its rates or modes cannot be solved."""
    trial = work.trial
    last = replace(trial, states=(trial.samples - 1,))
    seen = Seen(work, solve_trial(last), heard(trial, work.output))
    result = {name: float(read(seen)) for name, read in READ.items()}
    start, left = _energies(seen)
    return result | {"energy": start, "energy_left": left / start}


def _characteristic(sound: Floats, frames: int | None = None) -> float:
    """Mean of eq. 14 over the first `frames`, all of them by default; NaN for less than a window, and for silence."""
    if sound.size < round(WINDOW * PAPER_RATE / 48_000):
        return math.nan
    each = characteristic_frequencies(sound, PAPER_RATE)[:frames]
    heard_ones = each[np.isfinite(each)]
    return float(heard_ones.mean()) if heard_ones.size else math.nan


def _first(values: Floats) -> float:
    return float(values[0]) if values.size else math.nan


def _contact_phase(seen: Seen) -> float:
    """Time of the last contact before `PERIODS` periods of the first mode without any, s."""
    times = np.concatenate([[0.0], seen.motion.contact_time_s])
    if times.size == 1:
        return math.nan
    gaps = np.flatnonzero(np.diff(times) > PERIODS / _first_mode(seen))
    return float(times[gaps[0]] if gaps.size else times[-1]) or math.nan  # 0: none so soon after the release


def _first_mode(seen: Seen) -> float:
    return float(modes.frequencies(seen.work.trial.speaking, 1)[0])


def _frets(seen: Seen) -> NDArray[np.int64]:
    """Fret of each contact, (k,)."""
    return np.asarray(seen.work.trial.speaking.contact_fret, np.int64)[seen.motion.contact_index]


def _hardness(seen: Seen) -> float:
    trial = seen.work.trial
    return trial.pluck.apex / modes.grazing_apex(trial.speaking, trial.pluck.position)


def _glide(seen: Seen) -> float:
    """(nu - nu_1) / nu_1, median of the first `START`; NaN where there is no pitch, or too little sound for one."""
    nu = _first_mode(seen)
    try:
        pitch = motion_analysis.pitch(seen.work.trial, seen.motion.displacement_m)
    except ValueError:
        return math.nan
    good = np.isfinite(pitch.frequency_hz) & (pitch.time_s < START)
    return float(np.median(yin.relative_variation(pitch.frequency_hz[good], nu))) if good.any() else math.nan


def _t60(seen: Seen) -> float:
    return float(modal_motion.t60(modes.dampings(seen.work.trial.speaking, 1))[0])


def _energies(seen: Seen) -> tuple[float, float]:
    """At the release and in the last sample, J, both polarisations together."""
    trial = seen.work.trial
    s, states = trial.speaking, seen.motion.states
    assert states is not None
    q, across = initial_amplitudes(trial), initial_amplitudes_across(trial)
    start = modal_motion.energy(s, q, 0 * q) + modal_motion.modal_energies(s, across, 0 * across).sum()
    end = (
        modal_motion.contact_energy(s, states[0, 0, 0])
        + modal_motion.modal_energies(s, states[0, :, 0], states[0, :, 1]).sum()
    )
    return float(start), float(end)


READ: dict[str, Callable[[Seen], float]] = {
    "contacts": lambda seen: seen.motion.contact_step.size,
    "frets": lambda seen: np.unique(_frets(seen)).size,
    "first_fret": lambda seen: _first(_frets(seen).astype(np.float64)),
    "first_contact": lambda seen: _first(seen.motion.contact_time_s),
    "last_contact": lambda seen: _first(seen.motion.contact_time_s[::-1]),
    "contact_phase": _contact_phase,
    "hardness": _hardness,
    "characteristic_frequency": lambda seen: _characteristic(seen.motion.displacement_m),
    "characteristic_start": lambda seen: _characteristic(seen.motion.displacement_m, 1),
    "peak": lambda seen: float(np.abs(seen.motion.displacement_m).max()),
    "rms": lambda seen: math.sqrt(float(np.mean(seen.motion.displacement_m**2))),
    "glide": _glide,
    "t60": _t60,
    "heard_peak": lambda seen: float(np.abs(seen.output).max()),
    "heard_characteristic_frequency": lambda seen: _characteristic(seen.output),
}
