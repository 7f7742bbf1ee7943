"""A JACK server for the tests, `livebass` as a separate process, and waits for its output and recordings."""

from __future__ import annotations

import ctypes
import fcntl
import itertools
import os
import re
import shutil
import signal
import struct
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import Any

import pytest

JACK_RATE, JACK_PERIOD = 48000, 256
TURN = 1200.0  # s allowed to other test runs
PATIENCE = 180.0  # s: a busy machine is slow, and a wait ends as soon as it can
STARTS = 3  # of a server, until one answers
SHARED = Path("/dev/shm")
# JACK servers share a header, then eight slots for a server each, with its process and "jack-USER:NAME:"
REGISTRY = SHARED / "jack-shm-registry"
MAGIC, HEADER, PLACE, PLACES = b"KCAJ", 24, struct.Struct("i257s3x"), 8
REGISTRY_LOCK = 0x282929  # key of the semaphore that guards it
SEM_UNDO = 0x1000  # released when its process ends
NUMBERS = itertools.count()
PROBE = "from livebass.lab.bench.jack import new_client; new_client('probe').close()"
LASTING: list[subprocess.Popen[bytes]] = []  # the server of this session ...
NAMES: list[str] = []  # ... its name ...
ENDS = ExitStack()  # ... and the lock on which other sessions wait


def livebass(*arguments: object, under: str | None = None, **more: Any) -> subprocess.Popen[str]:
    """Starts the command line, or the program `under`, which must become it."""
    command = [*([under] if under else []), sys.executable, "-m", "livebass", *map(str, arguments)]
    return subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, stdin=subprocess.DEVNULL, text=True, **more
    )


@contextmanager
def playing(*arguments: object, **more: Any) -> Iterator[subprocess.Popen[str]]:
    """`livebass play`, killed in the end unless it has ended."""
    process = livebass("play", *arguments, **more)
    try:
        yield process
    finally:
        process.kill()


def end(process: subprocess.Popen[str], number: int) -> str:
    """Ends a process by a signal; returns what it said on its standard error."""
    process.send_signal(number)
    return process.communicate(timeout=PATIENCE)[1]


def wait_for(what: Callable[[], Any], seconds: float = PATIENCE, process: subprocess.Popen[str] | None = None) -> Any:
    """Waits until `what()` is true, and returns it.

    Fails after `seconds`, or, with its last words, if `process` ends first.
    """
    end = time.monotonic() + seconds
    while not (found := what()):
        if process is not None and process.poll() is not None and not what():
            raise AssertionError(f"ended with status {process.returncode}: {process.communicate()[1]}")
        assert time.monotonic() < end, "waited in vain"
        time.sleep(0.02)
    return found


def wait_for_log(log: Path, *texts: str, times: int = 1, process: subprocess.Popen[str] | None = None) -> None:
    """Waits until the log contains each text `times` times."""
    wait_for(lambda: log.exists() and all(log.read_text().count(text) >= times for text in texts), process=process)


def wait_for_take(take: Path, seconds: float, more: bool = False, rate: int = JACK_RATE) -> None:
    """Waits until the file of the 24-bit WAV `take` holds `seconds` of sound (`more` than now)."""

    def size() -> int:
        return max((file.stat().st_size for file in take.parent.glob(f".{take.name[:40]}.*")), default=0)

    wanted = 3 * seconds * rate + more * size()
    wait_for(lambda: size() > wanted)


@contextmanager
def alone() -> Iterator[None]:
    """Waits, within limits, while other test runs on this machine have JACK servers.

    JACK clients with the same name disturb each other even on different servers: see `open_jack_client`.
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
def _environment() -> Iterator[None]:
    """Restores the environment's variables about servers."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("JACK_DEFAULT_SERVER", "nobody")
        patch.setenv("JACK_NO_AUDIO_RESERVATION", "1")
        yield


@contextmanager
def running_server() -> Iterator[subprocess.Popen[bytes]]:
    """Runs a JACK server with the dummy driver, named in the environment meanwhile. It ends with this process."""
    with _environment():
        process = _answering()
        try:
            yield process
        finally:
            _end(process)
            free_dead_servers()


@contextmanager
def lasting_server() -> Iterator[subprocess.Popen[bytes]]:
    """The server shared by all tests of a session; the environment names it in the block.

    The JACK library may crash in a process whose server has ended.
    """
    with _environment():
        if not LASTING or LASTING[0].poll() is not None:
            LASTING[:] = []
            ENDS.close()
            ENDS.enter_context(alone())
            LASTING.append(_answering())
            NAMES[:] = [os.environ["JACK_DEFAULT_SERVER"]]
        os.environ["JACK_DEFAULT_SERVER"] = NAMES[0]
        yield LASTING[0]


def _answering() -> subprocess.Popen[bytes]:
    """Starts a server that accepts clients. Ends one that does not and starts another, STARTS at most."""
    for start in range(STARTS):
        free_dead_servers()
        os.environ["JACK_DEFAULT_SERVER"] = name = f"livebass-test-{os.getpid()}-{next(NUMBERS)}"
        shutil.rmtree(SHARED / f"jack_db-{os.getuid()}", ignore_errors=True)  # see livebass.live.guards
        process = _start(name)
        try:
            wait_for(lambda: process.poll() is not None or _answers(), PATIENCE / STARTS)  # noqa: B023
            assert process.poll() is None, "jackd does not start"
            return process
        except BaseException as error:
            _end(process)
            if start == STARTS - 1 or not isinstance(error, AssertionError):
                raise
    raise AssertionError


def _start(name: str) -> subprocess.Popen[bytes]:
    command = ["jackd", "--no-realtime", "-n", name, "-d", "dummy", "-r", str(JACK_RATE), "-p", str(JACK_PERIOD)]
    if shutil.which("setpriv"):  # ends it with this process, even if that is killed
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
    """True if the server named in the environment accepts a client, which is another process."""
    return subprocess.run([sys.executable, "-c", PROBE], capture_output=True, check=False).returncode == 0


def servers() -> dict[str, int]:
    """The processes of this user's servers in JACK's registry, by name; killed ones stay there."""
    try:
        registry = REGISTRY.read_bytes()
    except OSError:
        return {}
    found = [PLACE.unpack_from(registry, HEADER + k * PLACE.size) for k in range(PLACES if _is_known(registry) else 0)]
    ours = ((re.match(rb"jack-%d:(.+):\0" % os.getuid(), name), process) for process, name in found)
    return {match[1].decode(): process for match, process in ours if match}


def _is_known(registry: bytes) -> bool:
    """True if these bytes are a registry of JACK 2 in the layout known here."""
    return registry[:4] == MAGIC and len(registry) > HEADER + PLACES * PLACE.size


def _lives(process: int) -> bool:
    try:
        os.kill(process, 0)
    except ProcessLookupError:
        return False
    except PermissionError:
        return True
    return True


@contextmanager
def _registry_locked() -> Iterator[bool]:
    """Keeps servers from the registry, as they do each other; False if they kept it for two seconds."""
    libc = ctypes.CDLL(None)
    lock = libc.semget(REGISTRY_LOCK, 0, 0)
    two_seconds = struct.pack("ll", 2, 0)
    if lock >= 0 and libc.semtimedop(lock, struct.pack("Hhh", 0, -1, SEM_UNDO), ctypes.c_size_t(1), two_seconds):
        yield False
        return
    try:
        yield True
    finally:
        if lock >= 0:
            libc.semtimedop(lock, struct.pack("Hhh", 0, 1, SEM_UNDO), ctypes.c_size_t(1), two_seconds)


def free_dead_servers() -> None:
    """Frees the places in the registry, semaphores and sockets of this user's servers whose processes are gone."""
    with _registry_locked() as locked:
        if not locked:
            return
        if any(not _lives(process) for process in servers().values()):
            with REGISTRY.open("r+b") as file:
                registry = file.read()
                for k in range(PLACES):
                    at = HEADER + k * PLACE.size
                    process, name = PLACE.unpack_from(registry, at)
                    if name.startswith(b"jack-%d:" % os.getuid()) and not _lives(process):
                        file.seek(at)
                        file.write(bytes(PLACE.size))
        user, living = os.getuid(), servers()
        for left in [*SHARED.glob(f"jack_sem.{user}_*"), *SHARED.glob(f"jack_*_{user}_*")]:
            name = left.name.removeprefix(f"jack_sem.{user}_").removeprefix("jack_")
            if not name.startswith(tuple(f"{server}_" for server in living)):
                left.unlink(missing_ok=True)


def leave_nothing() -> None:
    """Ends the lasting server. Removes what servers share, if none lives and no other process looks at it."""
    if not SHARED.is_dir():
        return
    for process in LASTING:
        _end(process)
    ENDS.close()
    free_dead_servers()
    if servers() or not REGISTRY.exists() or any(_looks_at_registry(place) for place in Path("/proc").glob("[1-9]*")):
        return
    for left in [*SHARED.glob(f"jack-{os.getuid()}-*"), REGISTRY]:  # memory of killed servers, and the list
        left.unlink(missing_ok=True)
    shutil.rmtree(SHARED / f"jack_db-{os.getuid()}", ignore_errors=True)


def _looks_at_registry(place: Path) -> bool:
    """True if the process at `place` in /proc, other than this one, has the registry in its memory."""
    try:
        return int(place.name) != os.getpid() and REGISTRY.name in (place / "maps").read_text(errors="replace")
    except OSError:
        return False
