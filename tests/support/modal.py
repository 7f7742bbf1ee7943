"""Strings as plain modes, solved by other means than the solvers'; hand-over between lengths; third octaves."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable

import numpy as np

from livebass.model import modes
from livebass.model.instrument import Speaking, speaking
from livebass.rows.arrays import Complexes, Floats
from support.strings import g_neck, g_string


@dataclasses.dataclass(frozen=True)
class Modal:
    """N modes of a string of length L: phi_j = sqrt(2/L) sin(k_j x), x from its own stop."""

    length: float  # m
    density: float  # kg/m
    k: Floats  # (N,) rad/m
    natural: Floats  # (N,) rad/s
    sigma: Floats  # (N,) 1/s

    def shape(self, x: float, width: float = 0.0) -> Floats:
        """phi_j(x) exp(-(k_j width)^2 / 2), (N,)."""
        return math.sqrt(2 / self.length) * np.sin(self.k * x) * np.exp(-((self.k * width) ** 2) / 2)

    def after(self, q: Floats, v: Floats, t: float) -> tuple[Floats, Floats]:
        """q and dq/dt after t s of free motion."""
        omega = np.sqrt(self.natural**2 - self.sigma**2)
        y, shrink = (v + self.sigma * q) / omega, np.exp(-self.sigma * t)
        x = shrink * (q * np.cos(omega * t) + y * np.sin(omega * t))
        y = shrink * (y * np.cos(omega * t) - q * np.sin(omega * t))
        return x, omega * y - self.sigma * x

    def matrix(self, damping: Floats, stiffness: Floats) -> Floats:
        """d/dt (q, v) of the string with dashpots (N s/m) and springs (N/m) between its modes, both (N, N)."""
        count = self.k.size
        below = -np.diag(self.natural**2) - stiffness / self.density
        beside = -2 * np.diag(self.sigma) - damping / self.density
        return np.block([[np.zeros((count, count)), np.eye(count)], [below, beside]])


def modal(s: Speaking, count: int, lossless: bool = False) -> Modal:
    """The modes of `s` as in the solvers."""
    k = np.arange(1, count + 1) * (math.pi / s.length)
    sigma = np.zeros(count) if lossless else modes.dampings(s, count)
    return Modal(s.length, s.string.linear_density, k, 2 * math.pi * modes.frequencies(s, count), sigma)


def shorten(long: Modal, start: float, count: int) -> Modal:
    """`long` from `start` (m) on: wave numbers of the shorter length, frequencies and losses by the long one's law."""
    length = long.length - start
    k = np.arange(1, count + 1) * (math.pi / length)
    square = (long.natural / long.k) ** 2  # c^2 (1 + EI/T k^2), a straight line over k^2
    slope = (square[-1] - square[0]) / (long.k[-1] ** 2 - long.k[0] ** 2)
    natural = k * np.sqrt(square[0] + slope * (k**2 - long.k[0] ** 2))
    return Modal(length, long.density, k, natural, np.interp(natural, long.natural, long.sigma))


def solve_exactly(matrix: Floats, begin: Floats, times: Floats) -> Floats:
    """exp(matrix t) begin at `times`, (n, len(begin)), by eigenvalues."""
    values, vectors = np.linalg.eig(matrix)
    parts: Complexes = np.linalg.solve(vectors, begin.astype(np.complex128))
    return np.asarray((np.exp(np.outer(times, values)) * parts @ vectors.T).real)


def from_rest(s: Modal, matrix: Floats, q: Floats, step: float, times: Floats) -> tuple[Floats, Floats]:
    """q and dq/dt at `times`, (n, N) each, of a string that is free until half a step before 0, then moves by `matrix`.

    The first force of hands already there at step 0 acts from then on.
    """
    begin = np.concatenate(s.after(q, np.zeros(q.size), -step / 2))
    both = solve_exactly(matrix, begin, times + step / 2)
    return both[:, : q.size], both[:, q.size :]


def handover(long: Modal, short: Modal) -> Floats:
    """M (short, long): each mode of the longer length in modes of the shorter one, which ends at the same place."""
    start = long.length - short.length
    k, own = long.k[None, :], short.k[:, None]
    same = np.abs(own**2 - k**2) < 1e-9 * own**2
    apart = np.where(same, 1.0, own**2 - k**2)
    scale = 2 / math.sqrt(long.length * short.length)
    return np.where(
        same, math.sqrt(short.length / long.length) * np.cos(k * start), scale * own * np.sin(k * start) / apart
    )


def hammer_string(
    long: Modal, short: Modal, q: Floats, v: Floats, path: Callable[[Floats, float, float], Floats],
    place: float, samples: int, rate: float,
) -> tuple[Floats, Floats]:  # fmt: skip
    """u and du/dt at `place` (m from the longer stop) after the string (q, v) is stopped along `path`, (samples,) each.

    The modes of the shorter length take over the motion. Their stop moves along a polygon over samples, which kicks the
    modes only at its corners.
    """
    start = long.length - short.length
    begin, velocity = float(long.shape(start) @ q), float(long.shape(start) @ v)
    line = math.sqrt(2 / short.length) / short.k  # of (L - x) / L'
    tap, held = short.shape(place - start), (long.length - place) / short.length
    b = path(np.arange(samples + 1) / rate, begin, velocity)
    slopes = np.diff(b) * rate
    q, v = handover(long, short) @ q - begin * line, handover(long, short) @ v - velocity * line
    last = velocity
    u, pace = np.empty(samples), np.empty(samples)
    for i in range(samples):
        v = v - line * (slopes[i] - last)
        last = slopes[i]
        u[i], pace[i] = tap @ q + held * b[i], tap @ v + held * last
        q, v = short.after(q, v, 1 / rate)
    return u, pace


def third_octaves(signal: Floats, rate: float) -> Floats:
    """Levels of the third octaves from 63 Hz to 12.7 kHz, dB."""
    power = np.abs(np.fft.rfft(signal * np.blackman(signal.size))) ** 2
    frequency = np.fft.rfftfreq(signal.size, 1 / rate)
    centres = 1000 * 2 ** (np.arange(-12, 12) / 3)
    bands = [power[np.abs(np.log2(np.maximum(frequency, 1.0) / c)) <= 1 / 6].sum() for c in centres]
    return 10 * np.log10(np.maximum(bands, 1e-300))


def bare_string(inharmonicity: float = 3.5e-5) -> Speaking:
    """The paper's G string by the law of hinges, without its measured modes."""
    string = dataclasses.replace(
        g_string(), measured_frequencies=(), measured_dampings=(), stiffness_law="hinged", inharmonicity=inharmonicity
    )
    return speaking(string, g_neck(), 0)
