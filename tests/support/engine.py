"""A fake engine, for tests that need sound but no physics."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from livebass.engine.engine import Report
from livebass.score.score import Score


class FakeEngine:
    """Plays a one-second sine for each string, in blocks, through the interface of `Engine`."""

    peak = 0.1
    blocks = 10
    weakened = 0

    def __init__(self, instrument: object, quality: object, rate: int, seed: int = 0) -> None:
        self.rate = rate

    def play(self, score: Score, tail: float | None = None) -> Iterator[np.ndarray]:
        t = np.arange(self.rate // 10) / self.rate
        for _ in range(self.blocks):
            yield np.stack([self.peak * np.sin(2 * np.pi * (40 + 30 * k) * t + k) for k in range(4)])

    def report(self) -> Report:
        return Report(notes=5, transposed=2, dropped=1, stolen=0, weakened=self.weakened)
