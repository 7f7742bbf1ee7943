"""Endurance: minutes of dense playing while Python is busy, in a separate process that must not crash."""

from __future__ import annotations

from types import SimpleNamespace

import pytest
from support.command import python
from support.jack import PATIENCE
from support.places import TOOLS

PROGRAM = """
import endurance
endurance.WARM_UP, endurance.CYCLES, endurance.MIN_PHASE = {warm_up}, {cycles}, 0.5
endurance.endurance({seconds}, 1, lambda line: print(line, flush=True))
"""


def checks(seconds: float, warm_up: float, cycles: int) -> list[str]:
    """The lines of the checks, from a process that ended in order."""
    program = PROGRAM.format(seconds=seconds, warm_up=warm_up, cycles=cycles)
    done = python(program, cwd=TOOLS, timeout=4 * PATIENCE)
    assert done.returncode == 0, done.stdout + done.stderr[-2000:]
    assert "Traceback" not in done.stderr, done.stderr
    return [line for line in done.stdout.splitlines() if line.startswith(("ok: ", "FAILED: "))]


@pytest.mark.slow
def test_endurance(server: SimpleNamespace) -> None:
    """No NaN, no stuck note, no growing memory. Lost frames do not count: any other work on the machine costs some."""
    said = checks(6.0, 4.0, 2)
    assert len(said) == 7, said
    assert [line for line in said if line.startswith("FAILED: ") and "xruns" not in line] == []


def test_a_short_run_ends_in_order(server: SimpleNamespace) -> None:
    """All checks run, and its JACK clients close while a server exists: closed later they crash."""
    said = checks(2.0, 0.0, 1)
    assert len(said) == 7, said
    assert "frames that were NaN or far too large: 0" in "\n".join(said)
