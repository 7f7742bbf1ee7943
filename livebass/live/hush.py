"""Libraries that write to stderr on their own, kept quiet, and those that hang, left alone. [any thread]"""

from __future__ import annotations

import ctypes
import os
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress

PATIENCE = 2.0  # s, with a call that may never come back
_lock = threading.Lock()
_hushed = 0  # how many want it quiet
_kept = -1  # stderr meanwhile


@contextmanager
def hushed() -> Iterator[None]:
    """What C libraries print to file descriptor 2 meanwhile is lost; exceptions say what matters."""
    _hush(1)
    try:
        yield
    finally:
        _hush(-1)


def patiently(call: Callable[[], object], used: object) -> bool:
    """Whether `call` came back in time; if not it is left alone, with stderr given back and `used` never let go."""
    thread = threading.Thread(target=call, daemon=True)
    thread.start()
    thread.join(PATIENCE)
    if thread.is_alive():
        keep_for_ever(used)
        _hush(0)
    return not thread.is_alive()


def keep_for_ever(used: object) -> None:
    """Lets go of it not even at the interpreter's end, where that would hang."""
    ctypes.pythonapi.Py_IncRef(ctypes.py_object(used))


def _hush(change: int) -> None:
    """One more or one fewer; 0: nobody any more."""
    global _hushed, _kept
    with suppress(OSError, ValueError):
        sys.stderr.flush()
    with _lock:
        before, _hushed = _hushed, max(_hushed + change, 0) if change else 0
        with suppress(OSError):
            if not before and _hushed:
                _kept = os.dup(2)
                nowhere = os.open(os.devnull, os.O_WRONLY)
                os.dup2(nowhere, 2)
                os.close(nowhere)
            elif before and not _hushed and _kept >= 0:
                os.dup2(_kept, 2)
                os.close(_kept)
                _kept = -1
