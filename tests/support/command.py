"""Small MIDI files, runs of the command line, and the form required of every error."""

from __future__ import annotations

import os
import resource
import subprocess
import sys
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from support.places import TESTS

Run = Callable[..., tuple[int, str, str]]  # arguments -> status, stdout, stderr

HEAD = b"MThd\x00\x00\x00\x06\x00\x00\x00\x01\x01\xe0"  # type 0, one track, 480 ticks a quarter


def song(*events: bytes, head: bytes = HEAD) -> bytes:
    track = b"".join(events) + b"\x00\xff\x2f\x00"
    return head + b"MTrk" + len(track).to_bytes(4) + track


BASS = b"\x00\xc0\x21"
NOTE = b"\x00\x90\x28\x64\x81\x70\x80\x28\x40"  # a quarter of a second
GOOD = song(BASS, NOTE)
CHORD = b"".join(b"\x00\x90" + bytes([n, 100]) for n in range(128))


def command(*arguments: object, **options: Any) -> subprocess.CompletedProcess[Any]:
    """Runs the command line in a process of its own."""
    given = {"capture_output": True, "text": True, "timeout": 300} | options
    return subprocess.run([sys.executable, "-m", "livebass", *map(str, arguments)], check=False, **given)


@contextmanager
def rendering_for_long(out: Path) -> Iterator[subprocess.Popen[str]]:
    """Renders an hour of sound into `out` and files for the strings; killed in the end."""
    line = [sys.executable, "-m", "livebass", "render", "--note", "E1", "--duration", "3600s", "--stems", "-o"]
    with subprocess.Popen([*line, str(out)], stderr=subprocess.PIPE, text=True) as process:
        try:
            yield process
        finally:
            process.kill()


def run_python(*arguments: object, env: Mapping[str, object] = {}, **options: Any) -> subprocess.CompletedProcess[str]:
    """Runs Python with `arguments`, and `env` added to its environment; it need not succeed."""
    line = [sys.executable, *map(str, arguments)]
    around = os.environ | {name: str(value) for name, value in env.items()}
    return subprocess.run(line, env=around, **{"capture_output": True, "text": True, "timeout": 300} | options)


def python_output(*arguments: object, **options: Any) -> str:
    """What Python prints, which must succeed, run by `run_python`."""
    done = run_python(*arguments, **options)
    assert done.returncode == 0, done.stderr[-3000:]
    return done.stdout


def module_paths(*first: Path) -> dict[str, str]:
    """The environment in which another Python finds the modules that this one finds, those in `first` before others."""
    return {"PYTHONPATH": os.pathsep.join([*map(str, first), str(TESTS), *filter(None, sys.path)])}


def python(
    code: str, *arguments: object, env: Mapping[str, object] = {}, **options: Any
) -> subprocess.CompletedProcess[str]:
    """Runs a program, which finds what tests import, by `run_python`."""
    return run_python("-c", code, *arguments, env=module_paths() | dict(env), **{"timeout": 600} | options)


@contextmanager
def small_files(size: int = 20_000) -> Iterator[None]:
    """No file of this process may exceed `size` bytes, as on a full disk."""
    default = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, default[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, default)


def assert_one_clear_line(status: int, err: str, allowed: tuple[int, ...] = (1, 2)) -> None:
    """The command failed with one line of error, perhaps after a line about compiling kernels."""
    lines = [line for line in err.splitlines() if not line.startswith("compiling the kernels")]
    assert status in allowed, err
    assert len(lines) == 1 and lines[0].startswith("livebass: error: "), err
    assert "Traceback" not in err and "internal error" not in err, err


def refusal(run: Run, *arguments: object, status: int | None = None) -> str:
    """The error of a command that must fail in one clear line, with `status` or, by default, 1 or 2."""
    found, out, err = run(*arguments)
    assert_one_clear_line(found, err, (1, 2) if status is None else (status,))
    assert not out
    return err


def cli_text(run: Run, *arguments: object) -> str:
    """The output of a command that must succeed."""
    status, out, err = run(*arguments)
    assert status == 0, err
    return out
