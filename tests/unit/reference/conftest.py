"""What the tests of hands on the brute-force string share."""

from __future__ import annotations

import pytest

from livebass.lab.reference import playing


@pytest.fixture
def discrete(monkeypatch: pytest.MonkeyPatch) -> None:
    """Hands feel only the grid's modes, which gives the string as many equations as modes."""
    monkeypatch.setattr(playing, "YIELDING", 0)
