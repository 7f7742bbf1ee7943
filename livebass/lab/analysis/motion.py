"""Measures the motion of a solved string: shape and energy, contacts, spectral centre and pitch, decay of its modes.

Functions take q (..., modes), m^1.5, and its rate of change (..., modes), m^1.5/s, from any solver, in the basis of
eq. 3 of Issanchou et al. (2018), phi_j(x) = sqrt(2/L) sin(j pi x / L). It is orthonormal: each mode has the string's
mass per metre, mu. `Solved` measures a whole motion as in figures 4 to 8 of that paper.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from livebass.model import modes
from livebass.model.instrument import Speaking
from livebass.model.trial import Motion, Trial
from livebass.rows.arrays import Floats, Ints
from livebass.rows.bounds import within
from livebass.sound.analysis import (
    PAPER_RATE,
    Contactogram,
    Pitch,
    characteristic_frequencies,
    contactogram,
    frame_times,
    fundamental,
    resample,
)

T60_NEPERS = 3 * math.log(10)  # 60 dB


def string_shape(s: Speaking, q: ArrayLike, x: ArrayLike) -> Floats:
    """Returns the displacement u(x) that belongs to modal amplitudes (eq. 3 of the paper).

    Args:
        s: The speaking string.
        q: Modal amplitudes, m^1.5, (..., modes).
        x: Places, m from the stop, (n,).

    Returns:
        u, m, (..., n).

    Example:
        >>> from livebass import load_preset
        >>> from livebass.model.instrument import speaking
        >>> bass = load_preset("paper-g")
        >>> open_g = speaking(bass.strings[0], bass.necks[0], fret=0)
        >>> string_shape(open_g, [1e-3, 0.0, 0.0], [0.0, open_g.length / 2]).round(5)
        array([0.     , 0.00152])
    """
    amplitude = np.asarray(q, np.float64)
    return amplitude @ modes.shapes(s, amplitude.shape[-1], np.asarray(x, np.float64)).T


def shape_at(s: Speaking, q: ArrayLike, velocity: ArrayLike, time_s: ArrayLike, x: ArrayLike) -> Floats:
    """u(x, t), m, shape (len(time_s), len(x)), of a string free of contact: eq. 4 without force, solved exactly.

    q and velocity (modes,) are at t = 0, the release or the end of a contact.
    """
    q0, v0, t = (np.asarray(a, np.float64) for a in (q, velocity, time_s))
    sigma = modes.dampings(s, q0.size)
    omega = np.sqrt((2 * math.pi * modes.frequencies(s, q0.size)) ** 2 - sigma**2)  # of the damped motion
    turn = np.outer(t, omega)
    free = np.exp(-np.outer(t, sigma)) * (q0 * np.cos(turn) + (v0 + sigma * q0) / omega * np.sin(turn))
    return string_shape(s, free, x)


def modal_energies(s: Speaking, q: ArrayLike, velocity: ArrayLike, across: bool = False) -> Floats:
    """mu/2 (q'^2 + omega^2 q^2) of each mode of u, or of v, if `across`, J, shape (..., modes)."""
    amplitude, rate = np.asarray(q, np.float64), np.asarray(velocity, np.float64)
    omega = 2 * math.pi * modes.frequencies(s, amplitude.shape[-1], across=across)
    return np.asarray(s.string.linear_density / 2 * (rate**2 + (omega * amplitude) ** 2))


def contact_energy(s: Speaking, q: ArrayLike) -> Floats:
    """dx sum_m psi(eta_m), J, shape (...,): the potential of eq. 6 at the frets, eta = g - u."""
    u = string_shape(s, q, np.asarray(s.contact_position))
    depth = np.maximum(np.asarray(s.contact_height) - u, 0.0)
    power = s.contact_exponent + 1
    return np.asarray(s.step * s.contact_stiffness / power * np.sum(depth**power, axis=-1))


def energy(s: Speaking, q: ArrayLike, velocity: ArrayLike) -> Floats:
    """Energy of the string and of its contacts, J, shape (...,)."""
    return np.asarray(modal_energies(s, q, velocity).sum(axis=-1) + contact_energy(s, q))


def decay_rates(time_s: ArrayLike, energies: ArrayLike) -> Floats:
    """Fits the decay of each mode: minus half the slope of the logarithm of its energy, by least squares.

    The energy of a damped mode swings by sigma / omega about its trend; many periods average that out.

    Args:
        time_s: Times, s, (times,).
        energies: Energies, J, (times, modes).

    Returns:
        sigma, 1/s, (modes,); NaN where fewer than two energies are positive.

    Example:
        >>> time_s = np.linspace(0, 1, 11)
        >>> decay_rates(time_s, np.exp(-2 * np.outer(time_s, [3.0, 5.0])))
        array([3., 5.])
    """
    t, e = np.asarray(time_s, np.float64), np.asarray(energies, np.float64)
    out = np.full(e.shape[1], np.nan)
    for j, column in enumerate(e.T):
        good = column > 0
        if np.count_nonzero(good) > 1:
            out[j] = -np.polyfit(t[good], np.log(column[good]), 1)[0] / 2
    return out


def t60(damping: ArrayLike) -> Floats:
    """Returns the time in which a mode falls by 60 dB: 3 ln(10) / sigma.

    Args:
        damping: sigma, 1/s, of any shape.

    Returns:
        s, of the same shape; infinite for sigma = 0.

    Example:
        >>> t60([1.0, 3.45])
        array([6.90775528, 2.00224791])
    """
    sigma = np.asarray(damping, np.float64)
    return np.divide(T60_NEPERS, sigma, out=np.full(sigma.shape, np.inf), where=sigma > 0)


WINDOW, HOP = 2048, 128  # samples at 51.2 kHz: 40 ms, every 2.5 ms
PITCHES = (0.92, 1.53)  # of the first eigenfrequency: search range of the pitch; a rattle raises it by up to a half
PITCH_HOP = 1e-3  # s
LOW, ORDER = 5.0, 4  # of the first eigenfrequency: the glide is "mostly below 500 Hz" (4.1.1); of a Butterworth filter
STATES = 100  # times to compute energies at


def state_samples(trial: Trial, count: int = STATES, more: Sequence[float] = ()) -> tuple[int, ...]:
    """Output samples for `Trial.states`, ascending: `count` + 1 over the whole trial, and the nearest to `more` (s).

    Raises ValueError for a time outside the trial.
    """
    for time in more:
        within("time of a shape", time * 1e3, 0, trial.duration * 1e3, "ms")
    even = np.linspace(0, trial.samples - 1, count + 1).round().astype(int)
    return tuple(sorted({*map(int, even), *(_sample(trial, time) for time in more)}))


@dataclass(frozen=True)
class Solved:
    """A pluck and its motion, from any solver, and measurements of them. `simulate` returns it.

    Energies and shapes need the states of the modes (`Trial.states`). Without them they raise ValueError.
    """

    trial: Trial
    motion: Motion

    @property
    def speaking(self) -> Speaking:
        return self.trial.speaking

    @property
    def rate(self) -> float:
        """Output rate, Hz."""
        return self.trial.output_rate

    @property
    def over_board(self) -> bool:
        """True if the string may touch wood anywhere along it, not only frets."""
        return bool(self.speaking.surface)

    def displacement(self, across: bool = False) -> Floats:
        """Returns u, the motion away from the neck, or v, across it, at its sensor: m, (n,).

        Raises:
            ValueError: v of a pluck along u.
        """
        if not across:
            return self.motion.displacement_m
        if self.motion.across_m is None:
            raise ValueError("plucked along u: there is no v")
        return self.motion.across_m

    def at_paper_rate(self, across: bool = False) -> Floats:
        """Returns `displacement` at 51.2 kHz. Needs SciPy if the motion has another rate."""
        moved = self.displacement(across)
        return moved if self.rate == PAPER_RATE else resample(moved, round(self.rate))

    @cached_property
    def contacts(self) -> Contactogram:
        """The fret of each contact, 0 for wood, in the order of `Motion.contact_step`."""
        return contactogram(self.motion.contact_time_s, self.motion.contact_index, self.speaking.contact_fret)

    @property
    def contact_place(self) -> Floats:
        """Place of each of `contacts`, m from the stop."""
        return np.asarray(self.speaking.contact_position, np.float64)[self.motion.contact_index]

    @cached_property
    def sets(self) -> list[Ints]:
        """The contacts by set, one set per period (`Contactogram.sets`).

        For each set, the indices of its `contacts`.
        """
        number = self.contacts.sets()
        return [np.flatnonzero(number == n) for n in range(int(number[-1]) + 1 if number.size else 0)]

    def characteristic(self, across: bool = False) -> tuple[Floats, Floats]:
        """Measures the characteristic frequency over time, at 51.2 kHz: see `characteristic_frequencies`.

        Returns:
            Times, s, and frequencies, Hz, (frames,) each.

        Raises:
            ValueError: A motion of less than 40 ms.
        """
        nu = characteristic_frequencies(self.at_paper_rate(across), PAPER_RATE, WINDOW, HOP)
        return frame_times(nu.size, PAPER_RATE, WINDOW, HOP), nu

    @cached_property
    def pitch(self) -> Pitch:
        """The fundamental of u by YIN, every millisecond.

        The window is one period: a longer one would blur the steps of a glide. Only sound below five times the first
        eigenfrequency counts: near the bridge the overtones, which are not quite harmonic, have most of the power. The
        deepest dip counts: if a string rattles there may be none below a threshold.

        Raises:
            ValueError: A motion of less than two periods.
        """
        first = first_mode(self)
        minimum, maximum = (part * first for part in PITCHES)
        low = _low_passed(self.motion.displacement_m, LOW * first / self.rate)
        return fundamental(low, self.rate, minimum, maximum, PITCH_HOP, 1 / first, threshold=None)

    def energies(self) -> tuple[Floats, Floats, Floats]:
        """Computes energies at the times of `Trial.states`.

        Returns:
            Times, s, (times,); energy of each mode, u and v together, J, (times, modes); total with the contacts, J,
            (times,).

        Raises:
            ValueError: The motion has no states.
        """
        s, states = self.speaking, states_of(self)
        q, velocity = states[:, :, 0], states[:, :, 1]
        both = [modal_energies(s, q[:, i], velocity[:, i], across=i == 1) for i in range(q.shape[1])]
        each = np.sum(both, axis=0)
        total = each.sum(axis=1) + contact_energy(s, q[:, 0])
        return np.asarray(self.trial.states) / self.rate, each, np.asarray(total)

    def shapes(self, times: Sequence[float]) -> tuple[Floats, Floats, Floats]:
        """Computes the shape of the string at the samples nearest to `times`.

        Args:
            times: s; the samples must be among `Trial.states`, as they are if `simulate` got these times as `shape_at`.

        Returns:
            Times of these samples, s, (times,); the grid with both ends, m, (N + 1,); u and v, m, (polarisations,
            times, N + 1).

        Raises:
            ValueError: The motion has no states.
        """
        s, states, samples = self.speaking, states_of(self), [_sample(self.trial, time) for time in times]
        x = np.linspace(0, s.length, s.grid_points + 1)
        q = states[[self.trial.states.index(i) for i in samples], :, 0]
        return np.asarray(samples) / self.rate, x, np.moveaxis(string_shape(s, q, x), 1, 0)


def states_of(solved: Solved) -> Floats:
    """The states of the modes, as in `Motion.states`. Raises ValueError if there are none."""
    if solved.motion.states is None:
        raise ValueError("the motion has no states: none were asked for, or the solver gives none")
    return solved.motion.states


def first_mode(solved: Solved) -> float:
    """The first eigenfrequency of u, Hz."""
    return float(modes.frequencies(solved.speaking, 1)[0])


def columns(solved: Solved) -> dict[str, NDArray[Any]]:
    """All measurements except shapes, for result.npz, under names with units.

    Omits the characteristic frequency without SciPy, measurements that need a longer motion, and energies if it has no
    states.
    """
    trial = solved.trial
    dampings = np.zeros(trial.modes) if trial.lossless else modes.dampings(trial.speaking, trial.modes)
    out: dict[str, NDArray[Any]] = {"t60_s": t60(dampings)}
    first = first_mode(solved)
    if trial.duration > 1 / first + 1 / (PITCHES[0] * first) + 3 / trial.output_rate:
        pitch = solved.pitch
        out |= {"pitch_time_s": pitch.time_s, "pitch_hz": pitch.frequency_hz, "pitch_aperiodicity": pitch.aperiodicity}
    if trial.duration > WINDOW / PAPER_RATE and can_resample(trial):
        time_s, nu = solved.characteristic()
        out |= {"characteristic_time_s": time_s, "characteristic_frequency_hz": nu}
    if solved.motion.states is not None:
        time_s, each, total = solved.energies()
        out |= {"energy_time_s": time_s, "energy_j": total, "modal_energies_j": each}
    return out


def shape_columns(solved: Solved, times: Sequence[float]) -> dict[str, NDArray[Any]]:
    """`Solved.shapes` for result.npz; empty without times."""
    if not times:
        return {}
    time_s, x, moved = solved.shapes(times)
    across = {"shapes_across_m": moved[1]} if len(moved) > 1 else {}
    return {"shape_time_s": time_s, "shape_x_m": x, "shapes_m": moved[0], **across}


def _low_passed(sound: Floats, cutoff: float) -> Floats:
    """`sound` through a Butterworth filter forwards and backwards, without delay; cutoff relative to the rate."""
    room = min(sound.size - 1, round(10 / cutoff))
    turned = 2 * sound[0] - sound[room:0:-1], sound, 2 * sound[-1] - sound[-2 : -room - 2 : -1]  # odd about the ends
    padded = np.concatenate(turned)
    gain = 1 / (1 + (np.fft.rfftfreq(padded.size) / cutoff) ** (2 * ORDER))
    return np.asarray(np.fft.irfft(np.fft.rfft(padded) * gain, padded.size)[room : room + sound.size])


def can_resample(trial: Trial) -> bool:
    """True if the motion is at 51.2 kHz or can be resampled to it."""
    try:
        import scipy.signal  # noqa: F401
    except ImportError:
        return trial.output_rate == PAPER_RATE
    return True


def first_of(values: Floats) -> float:
    """The first of values (n,); NaN for none."""
    return float(values[0]) if values.size else math.nan


def _sample(trial: Trial, time: float) -> int:
    return min(round(time * trial.output_rate), trial.samples - 1)
