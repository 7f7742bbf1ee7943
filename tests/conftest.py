"""Fixtures for the command line: run it in this process, with or without the kernels."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from cli_cases import Run

from livebass import cli
from livebass import render as render_module
from livebass.score import Score


class FakeEngine:
    """A second of a sine for each string, in blocks; the same interface, without kernels."""

    peak = 0.1
    blocks = 10

    def __init__(self, instrument: object, quality: object, rate: int, seed: int = 0) -> None:
        self.rate = rate

    def play(self, score: Score, tail: float | None = None) -> Iterator[np.ndarray]:
        t = np.arange(self.rate // 10) / self.rate
        for _ in range(self.blocks):
            yield np.stack([self.peak * np.sin(2 * np.pi * (40 + 30 * k) * t + k) for k in range(4)])

    def report(self) -> SimpleNamespace:
        return SimpleNamespace(notes=5, transposed=2, dropped=1, stolen=0)


@pytest.fixture
def fake(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> type[FakeEngine]:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(render_module, "Engine", FakeEngine)
    monkeypatch.setattr("livebass.kernels.cached", lambda: True)
    monkeypatch.setattr(FakeEngine, "peak", 0.1)
    return FakeEngine


@pytest.fixture
def run(capfd: pytest.CaptureFixture[str]) -> Run:
    def run_(*arguments: object) -> tuple[int, str, str]:
        status = cli.run([str(a) for a in arguments])
        out, err = capfd.readouterr()
        return status, out, err

    return run_
