"""Work for a child process that `bench.jack.in_child` must survive. Imports little, as the child imports it."""

from __future__ import annotations

import os
import time


def sleep(seconds: float) -> str:
    os.write(2, b"a library has something to say\n")
    time.sleep(seconds)
    return "done"


def die() -> None:
    os._exit(3)


def fail() -> None:
    raise RuntimeError("no\nway")
