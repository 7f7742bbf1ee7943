"""From modal amplitudes to the string: its shape, its energy, that of each mode, and how fast that decays.

Everything here takes q (..., modes), m^1.5, and its rate of change (..., modes), m^1.5/s, in the basis of eq. 3 of
Issanchou et al. (2018), phi_j(x) = sqrt(2/L) sin(j pi x / L), whoever computed them. As the basis is orthonormal a mode
has the mass of the string per metre, mu.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike, NDArray

from livebass import modes
from livebass.instrument import Speaking

Floats = NDArray[np.float64]

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
