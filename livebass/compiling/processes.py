"""Work in a separate process that reports its progress and the reason of a failure, and ends with its parent.

It writes lines with the fraction done, an empty line, and its result.
"""

from __future__ import annotations

import os
import subprocess
import sys
import threading
from collections.abc import Callable, Mapping
from typing import NoReturn

from livebass.compiling import store

END = b"\n"  # of the lines with the fraction done
Progress = Callable[[float], None]
NOTHING: Mapping[str, str] = {}


class Failed(OSError):
    """A process failed; its last output is the message."""


def silent(done: float) -> None:
    """Ignores the fraction `done`."""


def result_of(
    module: str, *arguments: str, settings: Mapping[str, str] = NOTHING, progress: Progress = silent
) -> bytes:
    """Runs `module`, a program that calls `serve`, with `settings` in the environment; returns its result.

    `progress` gets the fraction done. Raises Failed.
    """
    paths = [str(store.PACKAGE.parent), *filter(None, [os.environ.get("PYTHONPATH")])]
    with subprocess.Popen(
        # -P: the working directory may hold files named like Python modules
        [sys.executable, "-P", "-m", module, *arguments],
        env=os.environ | settings | {"PYTHONPATH": os.pathsep.join(paths)},
        stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL,
        start_new_session=True,  # Ctrl-C is for this process alone
    ) as process:  # fmt: skip
        assert process.stdout
        for line in iter(process.stdout.readline, END):
            if not line:  # it ended too early
                break
            progress(float(line))
        said = process.stdout.read()
        if process.wait():
            lines = said.decode(errors="replace").strip().splitlines() or [f"exit status {process.returncode}"]
            raise Failed(lines[-1])
    return said


def serve(work: Callable[[Progress], bytes]) -> NoReturn:
    """Writes progress and result of `work` to standard output; on failure the reason, and exits with 1.

    Ends with its parent process: standard input ends then.
    """
    out = os.dup(1)
    os.dup2(2, 1)  # keeps printed text out of it

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
