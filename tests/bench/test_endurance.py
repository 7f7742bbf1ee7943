"""Endurance: minutes of dense playing while Python is busy."""

from __future__ import annotations

from types import SimpleNamespace

import pytest

from livebass.bench.endurance import endurance


@pytest.mark.slow
def test_endurance(server: SimpleNamespace) -> None:
    """No NaN, no stuck note, no growing memory. Lost frames are left out: any other work on the machine costs some."""
    lines: list[str] = []
    endurance(20.0, 1, lines.append)
    checks = [line for line in lines if line.startswith(("ok: ", "FAILED: "))]
    assert len(checks) == 7, lines
    assert [line for line in checks if line.startswith("FAILED: ") and "xruns" not in line] == []
