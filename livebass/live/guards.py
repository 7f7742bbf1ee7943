"""Guards against foreign libraries: output on stderr, calls that hang, JACK clients that fail to open at first.

[any thread]
"""

from __future__ import annotations

import ctypes
import os
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from typing import Any

from livebass.system.interrupts import Beside

TIMEOUT = 2.0  # s, for a call that may never return
PATIENCE = 15.0  # s, for a call that is slow on a busy machine
PAUSE = 0.05  # s, between attempts to open a JACK client
# A server that ends deletes the database shared by all of the user's clients. If a client opens at that moment, the
# remains of the database make every other client wait forever.
JACK_HANGS = f"the JACK library hangs; if it does so again, delete /dev/shm/jack_db-{getattr(os, 'getuid', int)()}"
jack_hangs = threading.Event()  # set once the JACK library has hung


class _Stderr:
    """File descriptor 2, which several threads may silence at once."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._users = 0  # that want it silenced
        self._kept = -1  # a copy of the original descriptor

    def silence(self) -> None:
        self._set(lambda users: users + 1)

    def restore(self) -> None:
        """Ends one `silence`."""
        self._set(lambda users: max(users - 1, 0))

    def restore_for_all(self) -> None:
        """Ends every `silence`, even for calls that hang."""
        self._set(lambda users: 0)

    def _set(self, change: Callable[[int], int]) -> None:
        with suppress(OSError, ValueError):
            sys.stderr.flush()
        with self._lock:
            before, self._users = self._users, change(self._users)
            with suppress(OSError):
                if not before and self._users:
                    self._kept = os.dup(2)
                    nowhere = os.open(os.devnull, os.O_WRONLY)
                    os.dup2(nowhere, 2)
                    os.close(nowhere)
                elif before and not self._users and self._kept >= 0:
                    os.dup2(self._kept, 2)
                    os.close(self._kept)
                    self._kept = -1


_stderr = _Stderr()


@contextmanager
def silenced_stderr() -> Iterator[None]:
    """Drops output of C libraries to file descriptor 2 within the block; exceptions report errors."""
    _stderr.silence()
    try:
        yield
    finally:
        _stderr.restore()


@contextmanager
def own_stderr() -> Iterator[None]:
    """Keeps stderr for Python: drops output of C libraries to file descriptor 2 within the block, from any thread.

    PortAudio and alsa-lib print over the status line, from their own threads, when a device disappears.
    """
    before, ours = sys.stderr, None
    with suppress(AttributeError, OSError, ValueError):  # stderr is missing or closed
        if before.fileno() == 2:
            ours = open(os.dup(2), "w", buffering=1, encoding=before.encoding, errors=before.errors)  # noqa: SIM115
    if ours is None:
        yield
        return
    sys.stderr = ours
    try:
        with silenced_stderr():
            yield
    finally:
        sys.stderr = before
        with suppress(OSError):
            ours.close()


def answer_of(call: Callable[[], Any]) -> Any:
    """Returns or raises the result of `call`; TimeoutError if it has not returned after PATIENCE.

    `call` runs in its own thread, so this one can be interrupted while a C library waits.
    """
    thread = Beside(call, daemon=True)
    thread.start()
    thread.join(PATIENCE)
    if thread.is_alive():
        _stderr.restore_for_all()
        raise TimeoutError
    return thread.answer()


def open_jack_client(jack: Any, name: str) -> Any:
    """Returns a client of the running JACK server. Raises jack.JackError if there is none, or if it refuses.

    Tries again after a server error: a client's socket is named after the client alone, so a client of the same name
    that opens at the same moment on another server of this machine takes it away. Raises JackError, too, if the
    library hangs: see JACK_HANGS.
    """
    end = time.monotonic() + TIMEOUT
    while True:
        try:
            with silenced_stderr():
                return answer_of(lambda: jack.Client(name, no_start_server=True))
        except TimeoutError:
            jack_hangs.set()
            raise jack.JackError(JACK_HANGS) from None
        except jack.JackOpenError as error:
            if not error.status.server_error or time.monotonic() > end:
                raise
        time.sleep(PAUSE)


def call_with_timeout(call: Callable[[], object], used: object) -> bool:
    """Returns whether `call` returned within TIMEOUT; if not, stderr is restored and `used` is never released."""
    thread = threading.Thread(target=call, daemon=True)
    thread.start()
    thread.join(TIMEOUT)
    if thread.is_alive():
        never_release(used)
        _stderr.restore_for_all()
    return not thread.is_alive()


def never_release(used: object) -> None:
    """Keeps `used` alive even when the interpreter ends, if its destructor would hang."""
    ctypes.pythonapi.Py_IncRef(ctypes.py_object(used))
