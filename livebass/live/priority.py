"""Real-time priority for the playing thread: from the scheduler, or else from rtkit, as on desktops."""

from __future__ import annotations

import os
import shutil
import signal
import subprocess
import sys
from contextlib import suppress

PRIORITY = 70  # of 99, requested from the scheduler; JACK's clients have about as much
RTKIT_PRIORITY = 20  # the most that rtkit grants
# rtkit requires limits to the uninterrupted processor time of real-time threads, us: at the first the thread loses its
# priority, at the second the kernel ends the process.
SLOW, ENDED = 100_000, 200_000
TIMEOUT = 2.0  # s
RTKIT = "org.freedesktop.RealtimeKit1"
_requested: set[int] = set()  # threads for which rtkit was asked


def make_realtime(thread: int) -> str | None:
    """Requests real-time priority for a thread of this process, by number; returns the reason of a refusal, or None."""
    if sys.platform != "linux":
        return None
    try:
        policy = os.sched_getscheduler(thread) & ~os.SCHED_RESET_ON_FORK
        if policy not in (os.SCHED_FIFO, os.SCHED_RR):
            os.sched_setscheduler(thread, os.SCHED_FIFO | os.SCHED_RESET_ON_FORK, os.sched_param(PRIORITY))
        return None
    except ProcessLookupError:
        return None  # it has ended
    except OSError as error:
        refused = _ask_rtkit(thread)
        return refused and f"{(error.strerror or str(error)).lower()}, and {refused}; install rtkit, or allow rtprio"


def _ask_rtkit(thread: int) -> str | None:
    """Asks rtkit, through systemd's busctl; returns the reason of a refusal, or None."""
    busctl = shutil.which("busctl")
    if not busctl:
        return "rtkit cannot be asked without busctl"
    import resource  # Windows has none

    _requested.add(thread)
    before = resource.getrlimit(resource.RLIMIT_RTTIME)
    with suppress(OSError, ValueError):
        resource.setrlimit(resource.RLIMIT_RTTIME, (SLOW, ENDED))
        signal.signal(signal.SIGXCPU, lambda number, frame: _default_priorities())
    command = [busctl, "--system", "call", RTKIT, "/org/freedesktop/RealtimeKit1", RTKIT, "MakeThreadRealtimeWithPID"]
    command += ["ttu", str(os.getpid()), str(thread), str(RTKIT_PRIORITY)]
    try:
        done = subprocess.run(command, capture_output=True, text=True, timeout=TIMEOUT, check=False)
    except (OSError, subprocess.TimeoutExpired):
        why = "rtkit does not answer"
    else:
        if done.returncode == 0:
            return None
        why = f"rtkit says: {' '.join(done.stderr.split()) or 'no'}"
    with suppress(OSError, ValueError):
        resource.setrlimit(resource.RLIMIT_RTTIME, (before[0], resource.getrlimit(resource.RLIMIT_RTTIME)[1]))
    return why


def _default_priorities() -> None:
    """Takes real-time priority from all threads for which rtkit was asked."""
    for thread in _requested:
        with suppress(OSError):
            os.sched_setscheduler(thread, os.SCHED_OTHER, os.sched_param(0))
    _requested.clear()
