"""Work for another process: what `bench_apart.apart` must bear. Light, as that process imports it."""

from __future__ import annotations

import os
import time
from collections.abc import Callable


def sleep(say: Callable[[str], None], seconds: float) -> str:
    say("sleeping")
    os.write(2, b"a library has something to say\n")
    time.sleep(seconds)
    return "done"


def die(say: object) -> None:
    os._exit(3)


def fail(say: object) -> None:
    raise RuntimeError("no\nway")
