"""All strings and the neck between them by brute force: modes and resonances, along both axes, in linear systems.

Along each axis of the neck, a string moves by its modes between fixed ends and with the neck:
u = sum q_m phi_m + b (L - x) / L. Mass, damping and stiffness of the whole follow from kinetic and potential energy;
nothing is assumed small. What a string does along u and v is turned to the axes.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from livebass.model.instrument import Instrument, Neck, Speaking, speaking
from livebass.model.modes import dampings, frequencies
from livebass.model.neck import FREE_PART, Admittance, Resonance, bending_shape
from livebass.rows.arrays import Floats
from support.whole import eigenmotions, rigid

NEAR = 20.0  # Hz: what other partials force farther away is no answer


class Coupled:
    """String `first` at `fret` and `others`, open, on a neck with resonances; `modes` of each."""

    def __init__(self, bass: Instrument, first: int, fret: int, others: Sequence[int], modes: int = 40):
        self.modes, self.turned = modes, bass.necks[first].axes_turned
        frets = {first: fret, **dict.fromkeys(others, 0)}
        self.axes = [_Axis(bass, frets, modes, across) for across in (False, True)]

    def answers(self, u: tuple[Floats, Floats], v: tuple[Floats, Floats], seconds: float) -> Floats:
        """Amplitudes (m^1.5) of the other strings' modes: `phasors` without their phases."""
        return np.abs(self.phasors(u, v, seconds))

    def phasors(self, u: tuple[Floats, Floats], v: tuple[Floats, Floats], seconds: float) -> Floats:
        """q - i dq/dt / omega (m^1.5) of the other strings' modes along a and b, (strings, 2, modes), after `seconds`.

        u, v: displacements and velocities of the first string's modes at the beginning, (modes,) each. Only motion
        within NEAR of a mode's own frequency counts.
        """
        c, s = math.cos(self.turned), math.sin(self.turned)
        along = [(c * x + s * y, c * y - s * x) for x, y in zip(u, v, strict=True)]
        found = [axis.phasors(*(pair[k] for pair in along), seconds) for k, axis in enumerate(self.axes)]
        return np.stack(found, axis=1)


class _Axis:
    """The strings at `frets`, by number, the sounding one first, along one axis of the neck."""

    def __init__(self, bass: Instrument, frets: dict[int, int], modes: int, across: bool):
        self.modes = n = modes
        resonances = _resonances(bass.necks[next(iter(frets))], across)
        self.size = size = len(frets) * n + len(resonances)
        mass, loss, spring = (np.zeros((size, size)) for _ in range(3))
        neck = slice(len(frets) * n, size)
        for r, one in enumerate(resonances, neck.start):
            omega = 2 * math.pi * one.frequency
            mass[r, r], loss[r, r] = one.mass, one.mass * omega / one.quality
            spring[r, r] = one.mass * omega**2
        pitches = []
        for k, (i, at) in enumerate(frets.items()):
            s = replace(speaking(bass.strings[i], bass.necks[i], at), axes_turned=0.0)
            free = bass.necks[i].free_length
            place = (s.string.length - s.length) / (free or FREE_PART * s.string.length)
            shape = np.array([bending_shape(one.shape, place) for one in resonances])
            mu, j, own = s.string.linear_density, np.arange(1.0, n + 1), slice(k * n, k * n + n)
            line = math.sqrt(2 * s.length) / (math.pi * j)  # the projection of (L - x) / L
            omega, _ = rigid(s, n, across)
            mass[own, own] += mu * np.eye(n)
            loss[own, own] += np.diag(2 * mu * _without_neck(s, n, across))
            spring[own, own] += np.diag(mu * omega**2)
            mass[own, neck] += mu * np.outer(line, shape)
            mass[neck, own] += mu * np.outer(shape, line)
            mass[neck, neck] += mu * s.length / 3 * np.outer(shape, shape)
            spring[neck, neck] += mu * (2 * s.length * s.fundamental) ** 2 / s.length * np.outer(shape, shape)
            pitches.append(frequencies(s, n, across=across))
        self.values, self.vectors = eigenmotions(mass, loss, spring)
        self.nu = np.concatenate(pitches[1:])

    def phasors(self, q: Floats, v: Floats, seconds: float) -> Floats:
        """q - i dq/dt / omega (m^1.5) of the other strings' modes, (strings, modes): Coupled.phasors."""
        state, n = np.zeros(2 * self.size), self.modes
        state[:n], state[self.size : self.size + n] = q[:n], v[:n]
        parts = np.linalg.solve(self.vectors, state)
        others = self.vectors[n : n + self.nu.size] * (parts * np.exp(self.values * seconds))
        near = np.abs(self.values.imag / (2 * math.pi) - self.nu[:, None]) < NEAR  # half of each pair of eigenvalues
        return np.asarray(2 * np.sum(others * near, axis=1).reshape(-1, n))


def _resonances(neck: Neck, across: bool) -> list[Resonance]:
    """The neck's resonances along a, or along b: those that bend it are higher there."""
    higher = math.sqrt(neck.stiffness_across) if across and neck.own_across else 1.0
    return [
        replace(one, frequency=one.frequency * (higher if one.shape else 1.0)) for one in neck.admittance.resonances
    ]


def _without_neck(s: Speaking, n: int, across: bool) -> Floats:
    """Dampings of the modes of `s` along an axis without the neck's share; the stop's own loss stays."""
    u, v = (Admittance(stop=s.felt(axis).stop) for axis in (False, True))
    return dampings(replace(s, admittance=u, admittance_across=v), n, across=across)
