"""Work in a process of its own, which tells how far it is, says why it fails, and ends with the one that started it.

It writes lines with the part that is done, an empty one, and its result.
"""

from __future__ import annotations

import os
import subprocess
import sys
import threading
from collections.abc import Callable, Mapping
from typing import NoReturn

from livebass.compiling import store

END = b"\n"  # of the lines with the part that is done
Progress = Callable[[float], None]
NOTHING: Mapping[str, str] = {}


class Failed(OSError):
    """A process failed; the message is what it said last."""


def silent(done: float) -> None:
    """Tells nobody what part is `done`."""


def result_of(
    module: str, *arguments: str, settings: Mapping[str, str] = NOTHING, progress: Progress = silent
) -> bytes:
    """Runs `module`, a program that calls `serve`, with `settings` of the environment; returns its result.

    `progress` is called with the part that is done. Raises Failed.
    """
    paths = [str(store.PACKAGE.parent), *filter(None, [os.environ.get("PYTHONPATH")])]
    with subprocess.Popen(
        # -P: the working directory may hold files that are called like modules of Python
        [sys.executable, "-P", "-m", module, *arguments],
        env=os.environ | settings | {"PYTHONPATH": os.pathsep.join(paths)},
        stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL,
        start_new_session=True,  # Ctrl-C is for this process alone
    ) as process:  # fmt: skip
        assert process.stdout
        for line in iter(process.stdout.readline, END):
            if not line:  # it has ended before its time
                break
            progress(float(line))
        said = process.stdout.read()
        if process.wait():
            lines = said.decode(errors="replace").strip().splitlines() or [f"exit status {process.returncode}"]
            raise Failed(lines[-1])
    return said


def serve(work: Callable[[Progress], bytes]) -> NoReturn:
    """Writes what `work` returns to standard output, and meanwhile what it tells; or why it failed, and exits with 1.

    Ends when the process that started this one ends: standard input ends then.
    """
    out = os.dup(1)
    os.dup2(2, 1)  # whatever is printed is no part of it

    def watch() -> None:
        while os.read(0, 4096):
            pass
        os._exit(1)

    threading.Thread(target=watch, daemon=True).start()
    try:
        data, status = work(lambda done: void(os.write(out, b"%.3f\n" % done))), 0
    except Failed as error:
        data, status = str(error).encode(), 1
    except Exception as error:
        data, status = f"{type(error).__name__}: {error}".encode(), 1
    with open(out, "wb") as file:
        file.write(END + data)
    os._exit(status)  # the thread waits


def void(_: object) -> None:
    """Drops a value."""
