"""Two strings and the neck between them by brute force: all modes and resonances in one linear system.

A string moves by its modes between fixed ends and with the neck: u = sum q_m phi_m + b (L - x) / L. Mass, damping and
stiffness of the whole follow from kinetic and potential energy; nothing is assumed small.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from livebass.model.instrument import Instrument, Speaking, speaking, stretch_ratio
from livebass.model.modes import dampings, frequencies
from livebass.model.neck import FREE_PART, Admittance, bending_shape
from livebass.rows.arrays import Floats

AROUND = 0.05  # s


class Coupled:
    """String `first` at `fret` and `second`, open, on a neck with resonances; `modes` of each."""

    def __init__(self, bass: Instrument, first: int, fret: int, second: int, modes: int = 80):
        self.modes = n = modes
        resonances = bass.necks[first].admittance.resonances
        size = 2 * n + len(resonances)
        mass, loss, spring = (np.zeros((size, size)) for _ in range(3))
        neck = slice(2 * n, size)
        for r, one in enumerate(resonances, 2 * n):
            omega = 2 * math.pi * one.frequency
            mass[r, r], loss[r, r] = one.mass, one.mass * omega / one.quality
            spring[r, r] = one.mass * omega**2
        for k, (i, at) in enumerate(((first, fret), (second, 0))):
            s, free = speaking(bass.strings[i], bass.necks[i], at), bass.necks[i].free_length
            place = (s.string.length - s.length) / (free or FREE_PART * s.string.length)
            shape = np.array([bending_shape(one.shape, place) for one in resonances])
            mu, j, own = s.string.linear_density, np.arange(1.0, n + 1), slice(k * n, k * n + n)
            line = math.sqrt(2 * s.length) / (math.pi * j)  # the projection of (L - x) / L
            omega = 2 * math.pi * j * s.fundamental * stretch_ratio(s.string.stiffness_law, s.inharmonicity, j)
            mass[own, own] += mu * np.eye(n)
            loss[own, own] += np.diag(2 * mu * _without_neck(s, n))
            spring[own, own] += np.diag(mu * omega**2)
            mass[own, neck] += mu * np.outer(line, shape)
            mass[neck, own] += mu * np.outer(shape, line)
            mass[neck, neck] += mu * s.length / 3 * np.outer(shape, shape)
            spring[neck, neck] += mu * (2 * s.length * s.fundamental) ** 2 / s.length * np.outer(shape, shape)
        flow = np.block(
            [[np.zeros((size, size)), np.eye(size)], [-np.linalg.solve(mass, spring), -np.linalg.solve(mass, loss)]]
        )
        self.size = size
        self.values, self.vectors = np.linalg.eig(flow)
        self.nu = frequencies(speaking(bass.strings[second], bass.necks[second], 0), n)

    def answers(self, q: Floats, v: Floats, seconds: float) -> Floats:
        """Amplitudes (m^1.5) of the second string's modes, (modes,), `seconds` after the first one had q and v.

        Root mean square over AROUND, after the motion forced by other partials has passed.
        """
        state = np.zeros(2 * self.size)
        state[: self.modes], state[self.size : self.size + self.modes] = q, v
        parts = np.linalg.solve(self.vectors, state)
        times = seconds + np.linspace(-0.5, 0.5, 40) * AROUND
        now = (self.vectors @ (parts[:, None] * np.exp(np.outer(self.values, times)))).real
        second = slice(self.modes, 2 * self.modes)
        moving = now[self.size :][second] / (2 * math.pi * self.nu[:, None])
        return np.asarray(np.sqrt(np.mean(now[: self.size][second] ** 2 + moving**2, axis=1)))


def _without_neck(s: Speaking, n: int) -> Floats:
    """Dampings of the modes of `s` without the neck's share; the stop's own loss stays."""
    return dampings(replace(s, admittance=Admittance(stop=s.admittance.stop)), n)
