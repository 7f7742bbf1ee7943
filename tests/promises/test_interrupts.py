"""Signals at difficult moments: while modules load, while kernels compile, while the interpreter ends."""

from __future__ import annotations

import contextlib
import os
import random
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import pytest
from support.command import assert_one_clear_line, python
from support.jack import wait_for

LOAD = "import os, signal, sys, time\nfrom livebass.cli import main as cli\n"
INTERRUPT = "os.kill(os.getpid(), signal.SIGINT)"
NOTE = ("render", "--note", "G2", "--duration", "0.1", "--tail", "0", "-q", "live", "-o")


def assert_interrupted(code: str, *arguments: object, **environment: str) -> None:
    """Runs a program that ends as after Ctrl-C, with one line."""
    done = python(code, *arguments, env=environment)
    assert_one_clear_line(done.returncode, done.stderr, (130,))


def test_an_interrupt_while_modules_load() -> None:
    """`__main__` answers Ctrl-C before the command line is imported."""
    code = (
        "import os, signal, sys\n"
        "class Finder:\n"
        "    def find_spec(self, name, *_):\n"
        "        if name == 'click': os.kill(os.getpid(), signal.SIGINT)\n"
        "sys.meta_path.insert(0, Finder())\n"
        "from livebass.__main__ import main\n"
        "main()"
    )
    assert_interrupted(code, "--version")


def test_an_interrupt_that_is_lost_in_a_destructor_comes_again() -> None:
    code = (
        "import os, signal, sys, time\n"
        "from livebass.cli import main as cli\n"
        "class Odd:\n"
        "    def __del__(self): os.kill(os.getpid(), signal.SIGINT); time.sleep(0.01)\n"
        "def lose(*_, **__):\n"
        "    odd = Odd(); del odd; time.sleep(5)\n"
        "cli.livebass.main = lose\n"
        "cli.main()"
    )
    assert_interrupted(code)


def test_an_import_is_not_interrupted(tmp_path: Path) -> None:
    """It may catch or convert the exception, so the signal waits until the import is done."""
    (tmp_path / "fragile.py").write_text(
        "import os, signal, time\n"
        "try:\n"
        f"    {INTERRUPT}; time.sleep(0.1)\n"
        "except BaseException:\n"
        "    raise ImportError('half of it')\n"
    )
    code = LOAD + "def load(*_, **__):\n    import fragile; time.sleep(20)\ncli.livebass.main = load\ncli.main()"
    assert_interrupted(code, PYTHONPATH=os.pathsep.join([str(tmp_path), os.environ.get("PYTHONPATH", "")]))


@pytest.mark.parametrize("where", ["in the main thread", "in another"])
def test_what_runs_aside_is_left_at_once(where: str) -> None:
    """The side task notices nothing, and the program does not wait for it."""
    code = LOAD + (
        "from concurrent.futures import ThreadPoolExecutor\n"
        "from livebass.system.interrupts import aside\n"
        "def work():\n"
        f"    {INTERRUPT}\n"
        "    for _ in range(600):\n"
        "        try: time.sleep(1)\n"
        "        except BaseException: raise ValueError('a state half made')\n"
        "def main(*_, **__):\n"
        "    if 'main' in sys.argv[1]: return aside(work)\n"
        "    with ThreadPoolExecutor(1) as pool: return pool.submit(aside, work).result()\n"
        "cli.livebass.main = main\n"
        "cli.main()"
    )
    assert_interrupted(code, where)


def test_what_runs_aside_gives_its_result_and_its_error() -> None:
    code = (
        "from livebass.system.interrupts import aside\n"
        "assert aside(divmod, 7, 2) == (3, 1) == aside(lambda: aside(divmod, 7, 2))\n"
        "try: aside(int, 'x')\n"
        "except ValueError: print('good')\n"
    )
    assert python(code).stdout == "good\n"


def test_a_signal_lost_at_the_very_end_does_not_kill() -> None:
    """A timer would send it again after its handler is gone."""
    code = LOAD + (
        "class Odd:\n"
        f"    def __del__(self): {INTERRUPT}; time.sleep(0.001)\n"
        "class Slow:\n"
        "    def __del__(self, sleep=time.sleep): sleep(0.2)\n"
        "slow = Slow()\n"
        "def lose(*_, **__):\n"
        "    odd = Odd(); del odd\n"
        "cli.livebass.main = lose\n"
        "cli.main()"
    )
    done = python(code)
    assert done.returncode in (0, 130) and "Traceback" not in done.stderr, done


@contextlib.contextmanager
def compiling(place: Path, sound: Path) -> Iterator[subprocess.Popen[str]]:
    """A render that compiles the kernels into the cache `place` first."""
    env = os.environ | {"NUMBA_CACHE_DIR": str(place)}
    line = [sys.executable, "-m", "livebass", *NOTE, str(sound)]
    with subprocess.Popen(line, stderr=subprocess.PIPE, text=True, env=env) as process:
        try:
            assert process.stderr and process.stderr.readline().startswith("compiling the kernels")
            yield process
        finally:
            process.kill()


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGKILL], ids=str)
def test_the_process_that_compiles_ends_with_the_one_that_waits_for_it(tmp_path: Path, number: int) -> None:
    place = tmp_path / "cache"
    with compiling(place, tmp_path / "a.wav") as process:
        wait_for(lambda: compilers(place), 30)
        process.send_signal(number)
        _, err = process.communicate(timeout=60)
    if number != signal.SIGKILL:
        assert_one_clear_line(process.returncode, err, (128 + number,))
    wait_for(lambda: not compilers(place), 30)
    assert not list(tmp_path.rglob("*.o")) and not list(tmp_path.glob("*.wav*"))


def compilers(place: Path) -> list[int]:
    """The processes that compile kernels for the cache `place`. Linux only; elsewhere the test sees none."""
    found = []
    for status in Path("/proc").glob("[0-9]*"):
        with contextlib.suppress(OSError):
            settings = (status / "environ").read_bytes().split(b"\0")
            if b"livebass.compiling." in (status / "cmdline").read_bytes():  # emitter, and lowering in its processes
                found += [int(status.name)] * (f"NUMBA_CACHE_DIR={place}".encode() in settings)
    return found


@pytest.mark.slow
def test_compiling_is_left_at_any_moment(tmp_path: Path) -> None:
    chance = random.Random(11)
    for number in range(5):
        with compiling(tmp_path / f"cache-{number}", tmp_path / "a.wav") as process:
            time.sleep(15 * chance.random() ** 2)
            process.send_signal(signal.SIGINT)
            _, err = process.communicate(timeout=120)
        if process.returncode == 0:  # a fast machine
            assert err.count("\n") == 1
        else:
            assert_one_clear_line(process.returncode, err, (130,))
            assert not (tmp_path / "a.wav").exists()


def test_the_end_does_not_search_all_objects_for_garbage() -> None:
    code = (
        "import atexit, gc; from livebass.system.interrupts import leave\n"
        "atexit.register(lambda: print(len(gc.get_objects()) < gc.get_freeze_count()))\n"
        "leave(3)"
    )
    done = python(code)
    assert (done.returncode, done.stdout, done.stderr) == (3, "True\n", "")
