"""Handles SIGINT (Ctrl-C), SIGTERM and SIGHUP (a closed terminal): one function for each phase of the program.

    exit_while_loading    modules load: SIGINT ends the process at once, with one line
    handled               a command runs: SIGINT raises KeyboardInterrupt, the others SystemExit(128 + number), a little
                          later if a module is loading; the interpreter ends: all are ignored
    aside                 kernels compile in a thread of their own: threads that wait for it get the exception
    leave                 the program ends: at once, if kernels still compile
    uninterrupted         files are moved: the signal waits until they are in place or gone
    stop_instead          a session plays: the signal sets its StopFlag, and the session ends in order
    hidden_from_children  worker processes compute: they never see SIGINT and SIGHUP; their parent ends them

A signal ignored at the start, as SIGHUP under nohup, stays ignored. The exit status is 128 plus the signal's number.
This file imports nothing from livebass: `__main__` loads it first.
"""

from __future__ import annotations

import gc
import math
import os
import signal
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from types import FrameType
from typing import Any, NoReturn, TypeVar

T = TypeVar("T")

STOPS = tuple(getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name))
INTERRUPTED = 128 + signal.SIGINT  # exit status
PATIENCE = 2.0  # s in which further signals are ignored: the program is already stopping
AGAIN = 0.01  # s after which a signal whose exception was lost is sent again
ASIDE = "livebass-aside"  # name of threads that run what an exception must not interrupt


class StopFlag:
    """Asks a loop to end. Not a threading.Event: a signal handler could deadlock on its lock."""

    def __init__(self) -> None:
        self._set = False

    def set(self) -> None:
        self._set = True

    def is_set(self) -> bool:
        return self._set


_ended = StopFlag()  # set by the signal that ends the program


def _handled_signals() -> list[int]:
    """The signals of STOPS that are not ignored and whose handler Python knows."""
    return [number for number in STOPS if signal.getsignal(number) not in (signal.SIG_IGN, None)]


def exit_while_loading() -> None:
    """Handles Ctrl-C while modules load: an exception in an import could be lost, or show a traceback."""
    if signal.SIGINT in _handled_signals():
        signal.signal(signal.SIGINT, _exit_at_once)


def _exit_at_once(number: int, frame: FrameType | None) -> NoReturn:
    with suppress(OSError):
        os.write(2, b"livebass: error: interrupted\n")
    os._exit(INTERRUPTED)


@contextmanager
def handle_signals() -> Iterator[None]:
    """Turns signals into exceptions within the block, and ignores them for the rest of the process."""
    heeded, handler = _handled_signals(), _Handler()
    for number in heeded:
        signal.signal(number, handler)
    sys.unraisablehook = handler.raise_again
    try:
        yield
    finally:
        for number in heeded:
            signal.signal(number, signal.SIG_IGN)
        sys.unraisablehook = sys.__unraisablehook__
        if hasattr(signal, "setitimer"):
            signal.signal(signal.SIGALRM, signal.SIG_IGN)  # one may be on its way
            signal.setitimer(signal.ITIMER_REAL, 0)


class _Handler:
    """Raises the exception of a signal, and ignores signals that follow within PATIENCE."""

    def __init__(self) -> None:
        self._latest = -math.inf  # s, time of the last signal heeded
        self._number: int = signal.SIGINT  # its number

    def __call__(self, number: int, frame: FrameType | None) -> None:
        now = time.monotonic()
        if now - self._latest > PATIENCE:
            self._latest, self._number = now, number
            if _loading(frame):
                self._send_later()
                return
            _ended.set()
            raise KeyboardInterrupt if number == signal.SIGINT else SystemExit(128 + number)

    def raise_again(self, lost: sys.UnraisableHookArgs) -> None:
        """Python's hook for exceptions that nothing can catch, as in a destructor; raises ours again a bit later."""
        if isinstance(lost.exc_value, KeyboardInterrupt | SystemExit):
            self._send_later()
        else:
            sys.__unraisablehook__(lost)

    def _send_later(self) -> None:
        signal.signal(signal.SIGALRM, self._send_again)
        signal.setitimer(signal.ITIMER_REAL, AGAIN)

    def _send_again(self, number: int, frame: FrameType | None) -> None:
        self._latest = -math.inf
        signal.raise_signal(self._number)


def _loading(frame: FrameType | None) -> bool:
    """True if `frame` is part of an import, which may catch the exception or leave half a module behind."""
    while frame is not None:
        if frame.f_code.co_filename == "<frozen importlib._bootstrap>":
            return True
        frame = frame.f_back
    return False


def aside(work: Callable[..., T], *arguments: Any) -> T:
    """Runs `work(*arguments)` in a thread of its own and returns the result.

    For long work, such as numba's, that an exception must not interrupt: it would be lost or leave a wrong state. A
    signal that ends the program ends the waiting here, in any thread; the work goes on until `leave`. Nested calls run
    in the same thread.
    """
    if threading.current_thread().name == ASIDE:
        return work(*arguments)
    thread = Beside(lambda: work(*arguments), ASIDE)
    thread.start()
    while thread.is_alive():
        thread.join(0.1)  # a signal to another thread may not wake this one
        if _ended.is_set() and thread.is_alive():
            raise KeyboardInterrupt
    return thread.answer()


class Beside(threading.Thread):
    """A thread that runs `work` and keeps what it returns or raises."""

    def __init__(self, work: Callable[[], Any], name: str | None = None, daemon: bool = False) -> None:
        super().__init__(name=name, daemon=daemon)
        self._work, self._result = work, None
        self._error: BaseException | None = None

    def run(self) -> None:
        try:
            self._result = self._work()
        except BaseException as error:
            self._error = error

    def answer(self) -> Any:
        """Returns the result of `work`, or raises its error. Call it once the thread has ended."""
        if self._error is not None:
            raise self._error
        return self._result


def leave(status: int) -> NoReturn:
    """Exits, at once if work still runs `aside`: the interpreter would wait for it.

    It does not look for garbage once more.
    """
    if any(thread.name == ASIDE for thread in threading.enumerate()):
        for stream in (sys.stdout, sys.stderr):
            with suppress(OSError, ValueError):
                stream.flush()
        os._exit(status)
    gc.freeze()
    sys.exit(status)


@contextmanager
def hold_signals() -> Iterator[None]:
    """Holds signals back until the block ends. Has no effect outside the main thread."""
    late: list[int] = []
    before = {}
    try:
        if threading.current_thread() is threading.main_thread():
            for number in _handled_signals():
                before[number] = signal.signal(number, lambda number, _: late.append(number))
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
        for number in late[:1]:
            signal.raise_signal(number)


def stop_instead(flag: StopFlag, playing: Callable[[], bool]) -> None:
    """Makes signals set `flag` for the rest of the process; until `playing()` is true they also act as before."""
    for number in _handled_signals():
        before = signal.getsignal(number)

        def stop(number: int, frame: FrameType | None, before: object = before) -> None:
            flag.set()
            if not playing():
                if not callable(before):
                    raise SystemExit(128 + number)
                before(number, frame)

        signal.signal(number, stop)


@contextmanager
def hidden_from_children() -> Iterator[None]:
    """Blocks SIGINT and SIGHUP in processes and threads that start within the block.

    Ctrl-C reaches the whole process group; the parent ends its workers in order. Windows has no such signals.
    """
    if not hasattr(signal, "pthread_sigmask"):
        yield
        return
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT, signal.SIGHUP})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)
