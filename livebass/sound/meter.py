"""Measures integrated loudness by ITU-R BS.1770-4, of sound that arrives in blocks.

The meter K-weights the sound in overlapping pieces of half a minute. It gates all their 400 ms blocks together, as in
section 5.1 of the recommendation: first at -70 LUFS, then 10 LU below the mean of the rest.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

LEAD, PIECE = 1, 30  # s: settling time of the filters; a piece including it
BLOCK, STEP = 0.4, 0.1  # s, of BS.1770
SILENCE, BELOW = -70.0, 10.0  # LUFS; LU: the two gates
FULL = -0.691  # LUFS of a mean square of 1 after K-weighting
SHELF = 1500.0, 1 / math.sqrt(2), 4.0  # Hz, Q, dB: the head
LOW_CUT = 38.0, 0.5  # Hz, Q


class LoudnessMeter:
    """Measures mono sound of `rate` Hz."""

    def __init__(self, rate: int) -> None:
        self.rate = rate
        self._held = [np.zeros(LEAD * rate)]  # not yet measured, after a measured LEAD
        self._count = LEAD * rate  # samples in it
        self._blocks: list[float] = []  # LUFS

    def add(self, sound: NDArray[Any]) -> None:
        """Adds `sound` (n,), full scale 1."""
        self._held.append(np.array(sound, np.float64))
        self._count += len(sound)
        if self._count < PIECE * self.rate:
            return
        held = np.concatenate(self._held)
        while len(held) >= PIECE * self.rate:
            # The last blocks reach beyond the piece: they belong to the next one.
            self._blocks += self._measured(held[: PIECE * self.rate])[: round((PIECE - 2 * LEAD) / STEP)]
            held = held[(PIECE - 2 * LEAD) * self.rate :]
        self._held, self._count = [held], len(held)

    def _measured(self, piece: NDArray[np.float64]) -> list[float]:
        """The loudness of each block of a piece that begins after its LEAD."""
        weighted = k_weighted(piece, self.rate)[LEAD * self.rate :]
        energy = np.concatenate([[0.0], np.cumsum(weighted**2)])
        count = round((len(weighted) / self.rate - BLOCK) / STEP) + 1
        times = np.arange(count) * STEP
        begins, ends = ((at * self.rate + 1e-6).astype(int) for at in (times, times + BLOCK))
        ends = np.minimum(ends, len(weighted))
        powers = (energy[ends] - energy[begins]) / (BLOCK * self.rate)
        with np.errstate(divide="ignore"):
            return [float(block) for block in FULL + 10 * np.log10(np.maximum(powers, 0.0))]

    def loudness(self) -> float:
        """Integrated loudness so far, LUFS; -inf for silence. A sound shorter than a block counts as one."""
        held = np.concatenate(self._held)
        minimum = math.ceil((LEAD + BLOCK) * self.rate)
        if not self._blocks and len(held) < minimum:
            held = np.pad(held, (0, minimum - len(held)))
        blocks = np.array(self._blocks + self._measured(held))
        blocks = blocks[blocks >= SILENCE]
        return _mean(blocks[blocks > _mean(blocks) - BELOW])


def k_weighted(sound: NDArray[np.float64], rate: float) -> NDArray[np.float64]:
    """Applies K-weighting to `sound` (n,) of `rate` Hz: a shelf for the head, and a low cut.

    It filters in the frequency domain: the ringing at the end, a tenth of a second, wraps round to the beginning.
    """
    spectrum = np.fft.rfft(sound)
    z = np.exp(-2j * np.pi * np.arange(len(spectrum)) / max(1, len(sound)))
    for b, a in (_shelf(rate, *SHELF), _low_cut(rate, *LOW_CUT)):
        spectrum *= (b[0] + z * (b[1] + z * b[2])) / (a[0] + z * (a[1] + z * a[2]))
    return np.fft.irfft(spectrum, len(sound)) if len(sound) else sound


Biquad = tuple[tuple[float, float, float], tuple[float, float, float]]  # numerator and denominator, in powers of 1 / z


def _shelf(rate: float, frequency: float, q: float, gain_db: float) -> Biquad:
    """High shelf of R. Bristow-Johnson's cookbook."""
    turn = 2 * math.pi * frequency / rate
    c, alpha, gain = math.cos(turn), math.sin(turn) / (2 * q), 10 ** (gain_db / 40)
    root = 2 * math.sqrt(gain) * alpha
    up, down = gain + 1, gain - 1
    return (
        (gain * (up + down * c + root), -2 * gain * (down + up * c), gain * (up + down * c - root)),
        (up - down * c + root, 2 * (down - up * c), up - down * c - root),
    )


def _low_cut(rate: float, frequency: float, q: float) -> Biquad:
    """High pass of R. Bristow-Johnson's cookbook."""
    turn = 2 * math.pi * frequency / rate
    c, alpha = math.cos(turn), math.sin(turn) / (2 * q)
    return ((1 + c) / 2, -(1 + c), (1 + c) / 2), (1 + alpha, -2 * c, 1 - alpha)


def _mean(blocks: NDArray[np.float64]) -> float:
    """The loudness of the mean power of blocks (n,), LUFS; -inf for none."""
    return 10 * math.log10(float(np.mean(10 ** (blocks / 10)))) if blocks.size else -math.inf
