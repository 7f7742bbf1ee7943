"""Work that may never come back, such as a JACK client whose server has died, in a process with a time limit."""

from __future__ import annotations

import multiprocessing
import os
import signal
from collections.abc import Callable
from multiprocessing.connection import Connection
from typing import Any

Say = Callable[[str], None]
RESULT, SAID, FAILED = "result", "said", "failed"


class Lost(OSError):
    """What was to be measured is not there or has gone; one line."""


def apart(say: Say, seconds: float, work: Callable[..., Any], *arguments: Any) -> Any:
    """What `work(say, *arguments)` gives, a function of a module, in another process that lives `seconds` at most.

    What C libraries print there is lost. Raises Lost with the one line of whatever `work` raises, and where it
    does not end in time. [main thread]
    """
    context = multiprocessing.get_context("spawn")
    mine, theirs = context.Pipe(duplex=False)
    process = context.Process(target=_work, args=(theirs, seconds, work, arguments), daemon=False)
    process.start()
    theirs.close()
    try:
        while mine.poll(seconds):
            kind, what = mine.recv()
            if kind == RESULT:
                return what
            if kind == FAILED:
                raise Lost(what)
            say(what)
        raise Lost("the JACK server does not answer any more")
    except EOFError:
        raise Lost("the JACK server took the measuring process with it") from None
    finally:
        process.kill()
        process.join()
        mine.close()


def limited(seconds: float) -> None:
    """The system ends this process after `seconds`, whatever it does then."""
    if hasattr(signal, "alarm"):
        signal.signal(signal.SIGALRM, signal.SIG_DFL)
        signal.alarm(max(1, round(seconds)))


def _work(answer: Connection, seconds: float, work: Callable[..., Any], arguments: tuple[Any, ...]) -> None:
    limited(seconds)
    nowhere = os.open(os.devnull, os.O_WRONLY)
    os.dup2(nowhere, 2)
    try:
        answer.send((RESULT, work(lambda what: answer.send((SAID, what)), *arguments)))
    except Exception as error:  # JACK-Client has errors of its own
        answer.send((FAILED, " ".join(str(error).split()) or type(error).__name__))
