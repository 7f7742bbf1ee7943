"""Integrated loudness by ITU-R BS.1770-4, of sound that comes in blocks: pyloudnorm's filters and blocks of 400 ms.

pyloudnorm takes a sound as a whole. Here it gets pieces of a minute that overlap, and the loudness of their blocks is
gated together, as section 5.1 of the recommendation has it: first at -70 LUFS, then 10 LU below the mean of the rest.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from livebass.extras import install

LEAD, PIECE = 1, 60  # s: what the filters settle in, and a piece with it
BLOCK, STEP = 0.4, 0.1  # s, of BS.1770
SILENCE, BELOW = -70.0, 10.0  # LUFS; LU: the two gates


class LoudnessMeter:
    """Measures mono sound of `rate` Hz. Raises ValueError, with how to install it, if there is no pyloudnorm."""

    def __init__(self, rate: int) -> None:
        try:
            import pyloudnorm
        except ImportError as error:
            raise ValueError(f"loudness: {error}; {install('loudness')}") from None
        self.rate = rate
        self._meter: Any = pyloudnorm.Meter(rate, block_size=BLOCK, overlap=1 - STEP / BLOCK)
        self._held = [np.zeros(LEAD * rate)]  # not measured yet, after a LEAD that was
        self._count = LEAD * rate  # samples in it
        self._blocks: list[float] = []  # LUFS

    def add(self, sound: NDArray[Any]) -> None:
        """Goes on with `sound` (n,), full scale 1."""
        self._held.append(np.array(sound, np.float64))
        self._count += len(sound)
        if self._count < PIECE * self.rate:
            return
        held = np.concatenate(self._held)
        while len(held) >= PIECE * self.rate:
            # The last blocks of a piece are the next one's: they reach beyond its end.
            self._blocks += self._measured(held[: PIECE * self.rate])[: round((PIECE - 2 * LEAD) / STEP)]
            held = held[(PIECE - 2 * LEAD) * self.rate :]
        self._held, self._count = [held], len(held)

    def _measured(self, piece: NDArray[np.float64]) -> list[float]:
        """The loudness of the blocks of a piece that begin after its LEAD."""
        self._meter.integrated_loudness(piece)
        return [float(block) for block in self._meter.blockwise_loudness[round(LEAD / STEP) :]]

    def loudness(self) -> float:
        """Integrated loudness so far, LUFS; -inf for silence. A sound shorter than a block counts as one."""
        held = np.concatenate(self._held)
        least = math.ceil((LEAD + BLOCK) * self.rate)
        if not self._blocks and len(held) < least:
            held = np.pad(held, (0, least - len(held)))
        blocks = np.array(self._blocks + self._measured(held))
        blocks = blocks[blocks >= SILENCE]
        return _mean(blocks[blocks > _mean(blocks) - BELOW])


def _mean(blocks: NDArray[np.float64]) -> float:
    """The loudness of the mean power of blocks (n,), LUFS; -inf for none."""
    return 10 * math.log10(float(np.mean(10 ** (blocks / 10)))) if blocks.size else -math.inf
