"""A JACK server for the tests, `livebass` as a process of its own, and waits for what it says and records."""

from __future__ import annotations

import fcntl
import itertools
import os
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from livebass.bench.jack import Lost, new_client

JACK_RATE, JACK_PERIOD = 48000, 256
TURN = 1200.0  # s that other test runs may take
PATIENCE = 180.0  # s: a machine that does much else takes its time, and a wait ends as soon as it can
REGISTRY = Path("/dev/shm/jack-shm-registry")  # has room for eight servers
NUMBERS = itertools.count()


def livebass(*arguments: object, under: str | None = None, **more: Any) -> subprocess.Popen[str]:
    """Starts the command line, by the program `under` if one is given, which must become it."""
    command = [*([under] if under else []), sys.executable, "-m", "livebass", *map(str, arguments)]
    return subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, stdin=subprocess.DEVNULL, text=True, **more
    )


def wait_for(
    what: Callable[[], object], seconds: float = PATIENCE, process: subprocess.Popen[str] | None = None
) -> None:
    """Waits until `what()` is true; fails after `seconds`, and with its last words if `process` ends before."""
    end = time.monotonic() + seconds
    while not what():
        if process is not None and process.poll() is not None and not what():
            raise AssertionError(f"ended with status {process.returncode}: {process.communicate()[1]}")
        assert time.monotonic() < end, "waited in vain"
        time.sleep(0.02)


def wait_for_log(log: Path, *texts: str, times: int = 1, process: subprocess.Popen[str] | None = None) -> None:
    """Waits until each text stands in the log, so many times."""
    wait_for(lambda: log.exists() and all(log.read_text().count(text) >= times for text in texts), process=process)


def wait_for_take(take: Path, seconds: float, more: bool = False, rate: int = JACK_RATE) -> None:
    """Waits until the file that will be the WAV file `take`, of 24 bits, holds so many seconds (`more` than now)."""

    def size() -> int:
        return max((file.stat().st_size for file in take.parent.glob(f".{take.name[:40]}.*")), default=0)

    wanted = 3 * seconds * rate + more * size()
    wait_for(lambda: size() > wanted)


@contextmanager
def alone() -> Iterator[None]:
    """Waits, within limits, while other test runs on this machine have JACK servers.

    JACK clients of one name disturb each other even if their servers differ: see `open_jack_client`.
    """
    end = time.monotonic() + TURN
    with open(Path(tempfile.gettempdir()) / f"livebass-tests-{os.getuid()}.lock", "w") as lock:
        while time.monotonic() < end:
            try:
                fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
                break
            except BlockingIOError:
                time.sleep(0.1)
        yield


@contextmanager
def running_server() -> Iterator[subprocess.Popen[bytes]]:
    """Runs a JACK server with the dummy driver; the environment names it meanwhile. It ends with this process."""
    before = {key: os.environ.get(key) for key in ("JACK_DEFAULT_SERVER", "JACK_NO_AUDIO_RESERVATION")}
    os.environ["JACK_NO_AUDIO_RESERVATION"] = "1"
    process = None
    try:
        # A server that was killed stays in the registry until one of the same name takes its place.
        for name in (f"livebass-test-{os.getpid()}-{next(NUMBERS)}", *server_names()):
            os.environ["JACK_DEFAULT_SERVER"] = name
            if not _answers():
                shutil.rmtree(f"/dev/shm/jack_db-{os.getuid()}", ignore_errors=True)  # see livebass.live.guards
                process = _start(name)
                wait_for(lambda process=process: process.poll() is not None or _answers())  # type: ignore[misc]
                if process.poll() is None:
                    break
        assert process is not None and process.poll() is None, "jackd does not start"
        yield process
    finally:
        if process is not None:
            _end(process)
        for key, value in before.items():
            if value is None:
                os.environ.pop(key, None)
            else:
                os.environ[key] = value


def _start(name: str) -> subprocess.Popen[bytes]:
    command = ["jackd", "--no-realtime", "-n", name, "-d", "dummy", "-r", str(JACK_RATE), "-p", str(JACK_PERIOD)]
    if shutil.which("setpriv"):  # ends it with this process, also if that is killed
        command = ["setpriv", "--pdeathsig", "KILL", *command]
    return subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)


def _end(process: subprocess.Popen[bytes]) -> None:
    process.send_signal(signal.SIGCONT)
    process.send_signal(signal.SIGTERM)
    try:
        process.wait(10)
    except subprocess.TimeoutExpired:
        process.kill()
        process.wait()


def _answers() -> bool:
    """True if the server that the environment names accepts a client."""
    try:
        new_client("probe").close()
    except Lost:
        return False
    return True


def server_names() -> list[str]:
    """The names of this user's servers in JACK's registry; those that were killed stay there."""
    try:
        registry = REGISTRY.read_bytes()
    except OSError:
        return []
    return [name.decode() for name in re.findall(rb"jack-%d:([^:\0]+):" % os.getuid(), registry)]
