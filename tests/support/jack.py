"""The rate and period of the tests' JACK server, and `livebass` as a process of its own."""

from __future__ import annotations

import subprocess
import sys
import time
from collections.abc import Callable
from typing import Any

JACK_RATE, JACK_PERIOD = 48000, 256


def livebass(*arguments: object, **more: Any) -> subprocess.Popen[str]:
    return subprocess.Popen(
        [sys.executable, "-m", "livebass", *map(str, arguments)], stdout=subprocess.PIPE, stderr=subprocess.PIPE,
        stdin=subprocess.DEVNULL, text=True, **more,
    )  # fmt: skip


def wait_for(what: Callable[[], object], seconds: float = 20.0) -> None:
    """Waits until `what()` is true; fails after `seconds`."""
    end = time.monotonic() + seconds
    while not what():
        assert time.monotonic() < end, "waited in vain"
        time.sleep(0.02)
