"""From modal amplitudes to the string: its shape, its energy, that of each mode, and how fast that decays.

Everything here takes q (..., modes), m^1.5, and its rate of change (..., modes), m^1.5/s, in the basis of eq. 3 of
Issanchou et al. (2018), phi_j(x) = sqrt(2/L) sin(j pi x / L), whoever computed them. As the basis is orthonormal a mode
has the mass of the string per metre, mu.

What is found in a motion: spectral centre, pitch, energies, shapes, T60; columns of the outputs, with units.

Sources: C. Issanchou et al. (2018), eq. 14 (spectral centre) and figures 6 to 8; YIN (module `yin`).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from livebass.analysis.sound import PAPER_RATE, Pitch, characteristic_frequencies, frame_times, fundamental, resampled
from livebass.arrays import Floats
from livebass.model import modes
from livebass.model.instrument import Speaking
from livebass.model.trial import Motion, Trial

T60_NEPERS = 3 * math.log(10)  # 60 dB


def string_shape(s: Speaking, q: ArrayLike, x: ArrayLike) -> Floats:
    """Displacement u(x), m, shape (..., len(x)): eq. 3. x (n,), m from the stop."""
    amplitude = np.asarray(q, np.float64)
    return amplitude @ modes.shapes(s, amplitude.shape[-1], np.asarray(x, np.float64)).T


def shape_at(s: Speaking, q: ArrayLike, velocity: ArrayLike, time_s: ArrayLike, x: ArrayLike) -> Floats:
    """u(x, t), m, shape (len(time_s), len(x)), of a string free of contact: eq. 4 without force, solved exactly.

    q and velocity (modes,) are those at t = 0; between two contacts, those just after the first one.
    """
    q0, v0, t = (np.asarray(a, np.float64) for a in (q, velocity, time_s))
    sigma = modes.dampings(s, q0.size)
    omega = np.sqrt((2 * math.pi * modes.frequencies(s, q0.size)) ** 2 - sigma**2)  # of the damped motion
    turn = np.outer(t, omega)
    free = np.exp(-np.outer(t, sigma)) * (q0 * np.cos(turn) + (v0 + sigma * q0) / omega * np.sin(turn))
    return string_shape(s, free, x)


def modal_energies(s: Speaking, q: ArrayLike, velocity: ArrayLike) -> Floats:
    """mu/2 (q'^2 + omega^2 q^2) of each mode, J, shape (..., modes)."""
    amplitude, rate = np.asarray(q, np.float64), np.asarray(velocity, np.float64)
    omega = 2 * math.pi * modes.frequencies(s, amplitude.shape[-1])
    return np.asarray(s.string.linear_density / 2 * (rate**2 + (omega * amplitude) ** 2))


def contact_energy(s: Speaking, q: ArrayLike) -> Floats:
    """dx sum_m psi(eta_m), J, shape (...,): the potential of eq. 6 at the frets, eta = g - u."""
    u = string_shape(s, q, np.asarray(s.contact_position))
    depth = np.maximum(np.asarray(s.contact_height) - u, 0.0)
    power = s.contact_exponent + 1
    return np.asarray(s.step * s.contact_stiffness / power * np.sum(depth**power, axis=-1))


def energy(s: Speaking, q: ArrayLike, velocity: ArrayLike) -> Floats:
    """All there is in the string and in its contacts, J, shape (...,)."""
    return np.asarray(modal_energies(s, q, velocity).sum(axis=-1) + contact_energy(s, q))


def decay_rates(time_s: ArrayLike, energies: ArrayLike) -> Floats:
    """sigma of each mode, 1/s, (modes,): minus half the slope of the logarithm of its energy, by least squares.

    time_s (times,); energies (times, modes), J. The energy of a damped mode swings by sigma / omega about its trend;
    over many periods that averages out. NaN where less than two energies are positive.
    """
    t, e = np.asarray(time_s, np.float64), np.asarray(energies, np.float64)
    out = np.full(e.shape[1], np.nan)
    for j, column in enumerate(e.T):
        good = column > 0
        if np.count_nonzero(good) > 1:
            out[j] = -np.polyfit(t[good], np.log(column[good]), 1)[0] / 2
    return out


def t60(damping: ArrayLike) -> Floats:
    """Time in which a mode of damping sigma (1/s) falls by 60 dB, s: 3 ln(10) / sigma; infinite for sigma = 0."""
    sigma = np.asarray(damping, np.float64)
    return np.divide(T60_NEPERS, sigma, out=np.full(sigma.shape, np.inf), where=sigma > 0)


WINDOW, HOP = 2048, 128  # samples at 51.2 kHz: 40 ms, every 2.5 ms
PITCHES = (0.92, 1.53)  # of the first eigenfrequency: where the pitch is sought; a rattle raises it by up to a half
PITCH_HOP = 1e-3  # s
LOW, ORDER = 5.0, 4  # of the first eigenfrequency: the glide is "mostly below 500 Hz" (4.1.1); of a Butterworth filter
STATES = 100  # times at which energies are told


def looked_at(trial: Trial, count: int = STATES, more: Sequence[float] = ()) -> tuple[int, ...]:
    """Output samples, ascending: `count` + 1 over the whole trial, and those nearest to the times `more` (s).

    For `Trial.states`. Raises ValueError for a time outside the trial.
    """
    for time in more:
        if not 0 <= time <= trial.duration:
            raise ValueError(f"shape at {time * 1e3:g} ms: allowed are 0 ms to {trial.duration * 1e3:g} ms")
    even = np.linspace(0, trial.samples - 1, count + 1).round().astype(int)
    return tuple(sorted({*map(int, even), *(_sample(trial, time) for time in more)}))


def at_paper_rate(trial: Trial, moved: Floats) -> Floats:
    """A displacement of `trial` at 51.2 kHz. Needs SciPy where the trial has another rate."""
    return moved if trial.output_rate == PAPER_RATE else resampled(moved, round(trial.output_rate))


def characteristic(trial: Trial, moved: Floats) -> tuple[Floats, Floats]:
    """Times, s, and eq. 14, Hz, of a displacement at 51.2 kHz. ValueError for less than 40 ms."""
    nu = characteristic_frequencies(at_paper_rate(trial, moved), PAPER_RATE, WINDOW, HOP)
    return frame_times(nu.size, PAPER_RATE, WINDOW, HOP), nu


def pitch(trial: Trial, moved: Floats) -> Pitch:
    """The fundamental of a displacement by YIN over a period and the longest lag, or the steps of a glide would blur.

    Of what is below `LOW`: near the bridge the overtones have most of the power, and they are not quite harmonic. The
    deepest dip counts: where a string rattles none may be below a threshold. ValueError for less than two periods.
    """
    first = float(modes.frequencies(trial.speaking, 1)[0])
    least, most = (part * first for part in PITCHES)
    low = _low_passed(moved, LOW * first / trial.output_rate)
    return fundamental(low, trial.output_rate, least, most, PITCH_HOP, 1 / first, threshold=None)


def energies(trial: Trial, motion: Motion) -> tuple[Floats, Floats, Floats]:
    """Times of `Trial.states`, s; energy of each mode, J, (times, modes), u and v together; all, contacts too, J."""
    states = _states(motion)
    s, q, velocity = trial.speaking, states[:, :, 0], states[:, :, 1]
    each = modal_energies(s, q, velocity).sum(axis=1)
    total = each.sum(axis=1) + contact_energy(s, q[:, 0])
    return np.asarray(trial.states) / trial.output_rate, each, np.asarray(total)


def shapes(trial: Trial, motion: Motion, times: Sequence[float]) -> tuple[Floats, Floats, Floats]:
    """Times of the nearest samples, s; the grid with both ends, m, (N + 1,); u and v, m, (polarisations, times, N + 1).

    The samples must be among `Trial.states`: see `looked_at`.
    """
    states = _states(motion)
    s, samples = trial.speaking, [_sample(trial, time) for time in times]
    x = np.linspace(0, s.length, s.grid_points + 1)
    q = states[[trial.states.index(i) for i in samples], :, 0]
    return np.asarray(samples) / trial.output_rate, x, np.moveaxis(string_shape(s, q, x), 1, 0)


def columns(trial: Trial, motion: Motion) -> dict[str, NDArray[Any]]:
    """All but shapes under names with units, for result.npz, as far as it can be had.

    Left out are the characteristic frequency without SciPy, what a motion is too short for, and energies where the
    solver tells no states.
    """
    out: dict[str, NDArray[Any]] = {
        "t60_s": t60(np.zeros(trial.modes) if trial.lossless
                                  else modes.dampings(trial.speaking, trial.modes))
    }  # fmt: skip
    first = float(modes.frequencies(trial.speaking, 1)[0])
    if trial.duration > 1 / first + 1 / (PITCHES[0] * first) + 3 / trial.output_rate:
        found = pitch(trial, motion.displacement_m)
        out |= {"pitch_time_s": found.time_s, "pitch_hz": found.frequency_hz, "pitch_aperiodicity": found.aperiodicity}
    if trial.duration > WINDOW / PAPER_RATE and _can_resample(trial):
        time_s, nu = characteristic(trial, motion.displacement_m)
        out |= {"characteristic_time_s": time_s, "characteristic_frequency_hz": nu}
    if motion.states is not None:
        time_s, each, total = energies(trial, motion)
        out |= {"energy_time_s": time_s, "energy_j": total, "modal_energies_j": each}
    return out


def shape_columns(trial: Trial, motion: Motion, times: Sequence[float]) -> dict[str, NDArray[Any]]:
    """`shapes` for result.npz; nothing without times."""
    if not times:
        return {}
    time_s, x, moved = shapes(trial, motion, times)
    across = {"shapes_across_m": moved[1]} if len(moved) > 1 else {}
    return {"shape_time_s": time_s, "shape_x_m": x, "shapes_m": moved[0], **across}


def _low_passed(sound: Floats, cutoff: float) -> Floats:
    """By a Butterworth filter forwards and backwards, which delays nothing; cutoff in parts of the sampling rate."""
    room = min(sound.size - 1, round(10 / cutoff))
    turned = 2 * sound[0] - sound[room:0:-1], sound, 2 * sound[-1] - sound[-2 : -room - 2 : -1]  # odd about the ends
    padded = np.concatenate(turned)
    gain = 1 / (1 + (np.fft.rfftfreq(padded.size) / cutoff) ** (2 * ORDER))
    return np.asarray(np.fft.irfft(np.fft.rfft(padded) * gain, padded.size)[room : room + sound.size])


def _can_resample(trial: Trial) -> bool:
    """Whether the motion can be had at 51.2 kHz."""
    try:
        import scipy.signal  # noqa: F401
    except ImportError:
        return trial.output_rate == PAPER_RATE
    return True


def _states(motion: Motion) -> Floats:
    if motion.states is None:
        raise ValueError("the motion has no states: none were asked for, or the solver tells none")
    return motion.states


def _sample(trial: Trial, time: float) -> int:
    return min(round(time * trial.output_rate), trial.samples - 1)
