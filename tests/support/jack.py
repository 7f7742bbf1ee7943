"""The rate and period of the tests' JACK server, and `livebass` as a process of its own."""

from __future__ import annotations

import subprocess
import sys
import time
from collections.abc import Callable
from typing import Any

JACK_RATE, JACK_PERIOD = 48000, 256


def livebass(*arguments: object, under: str | None = None, **more: Any) -> subprocess.Popen[str]:
    """Starts the command line, by the program `under` if one is given, which must become it."""
    command = [*([under] if under else []), sys.executable, "-m", "livebass", *map(str, arguments)]
    return subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, stdin=subprocess.DEVNULL, text=True, **more
    )


def wait_for(what: Callable[[], object], seconds: float = 20.0) -> None:
    """Waits until `what()` is true; fails after `seconds`."""
    end = time.monotonic() + seconds
    while not what():
        assert time.monotonic() < end, "waited in vain"
        time.sleep(0.02)
