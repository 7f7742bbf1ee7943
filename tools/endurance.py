"""Dense random playing for minutes while Python is busy: lost frames, faults, stuck notes, growth of memory.

    .venv/bin/python tools/endurance.py [--minutes 10] [--seed 1]

Starts a JACK server of its own with the dummy driver (Debian: jackd2), and in this process what `livebass play` runs.
Ten times over, nobody plays and Python sleeps for a while; then nobody plays and another process keeps a processor
busy, which on a shared machine alone costs frames; then a thread plays notes, controllers, bends and programs, and two
more keep the interpreter busy: no more may be lost than in the worse of the other phases, and half of that for chance.
In the end all notes are cut off, and the sound has to end. Prints what was measured; status 1 where something is wrong,
or where too much is lost with nobody playing to tell. The server asks for real-time scheduling; without the right to
it, any other work on the machine costs frames.
"""

from __future__ import annotations

import argparse
import logging
import os
import re
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager, nullcontext
from dataclasses import dataclass
from typing import Any

import numpy as np

PERIOD, RATE = 256, 48000
WARM_UP = 15.0  # s of playing, most presets in it, before memory counts
SETTLING = 3.0  # s in which the last program is put on and the one before let go
GROWTH = 20.0  # MB that memory may grow by
# Of what is lost with nobody playing, and of the time: so much may be lost while playing, as other machines come and go
MORE, SLACK = 1.5, 0.0002
TELLING = 0.01  # where more of the time is lost with nobody playing, nothing can be told


@dataclass
class Lost:
    """Frames of the server that the bass did not play, since this was made."""

    client: Any
    synth: Any

    def __post_init__(self) -> None:
        self.began, self.frame, self.stolen = self._server(), self._played(), stolen()

    def _server(self) -> int:
        return int(self.client.last_frame_time)

    def _played(self) -> int:
        return self.synth.frame

    def read(self) -> tuple[float, float, float]:
        """(s lost, s passed, s that other machines took from this one)."""
        passed = (self._server() - self.began) % (1 << 32)
        lost = passed - (self._played() - self.frame)
        return max(0, lost - PERIOD) / RATE, passed / RATE, stolen() - self.stolen


def main() -> int:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--minutes", type=float, default=10.0)
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    name = f"livebass-endurance-{os.getpid()}"
    os.environ["JACK_DEFAULT_SERVER"], os.environ["JACK_NO_AUDIO_RESERVATION"] = name, "1"
    command = ["jackd", "-n", name, "-d", "dummy", "-r", str(RATE), "-p", str(PERIOD)]
    try:
        server = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    except OSError as error:
        print(f"jackd: {error.strerror}; on Debian: sudo apt install jackd2", file=sys.stderr)
        return 1
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(143))
    try:
        return play(60.0 * options.minutes, options.seed)
    except OSError as error:
        print(f"endurance: {error}", file=sys.stderr)
        return 1
    finally:
        server.terminate()
        try:
            server.wait(5)
        except subprocess.TimeoutExpired:
            server.kill()


def play(seconds: float, seed: int) -> int:
    """All phases; the exit status."""
    import jack

    from livebass import QUALITIES, load_preset
    from livebass.live.session import Session, Settings

    wait_for_server(jack)
    settings = Settings(load_preset("slap"), QUALITIES["live"], "slap", backend="jack", keyboard=False)
    logging.basicConfig(level=logging.INFO, format="%(message)s", stream=sys.stdout)
    session = Session(settings)
    outcome: list[int] = []
    thread = threading.Thread(target=lambda: outcome.append(judged(jack, session, seconds, seed)), daemon=True)
    thread.start()
    summary = session.run()
    thread.join(10)
    if summary.lost:
        print(f"FAILED: {summary.lost}")
    return 1 if summary.lost or not outcome else outcome[0]


def judged(jack: Any, session: Any, seconds: float, seed: int) -> int:
    """Plays on a session that is starting and ends it; the number of laws that were broken, at most 1."""
    try:
        while session.synth is None:
            time.sleep(0.05)
        synth = session.synth
        client = jack.Client("endurance", no_start_server=True)
        print(f"{seconds:.0f} s, {'with' if client.realtime else 'without'} real-time scheduling", flush=True)
        rng, cycles = np.random.default_rng(seed), 10
        random_playing(synth, rng, WARM_UP)
        memory = highest = settled(synth)
        before = synth.meters()
        totals = np.zeros((len(PHASES), 4))  # s lost, s passed, s stolen, xruns
        for _ in range(cycles):
            for number, phase in enumerate(PHASES):
                began, underruns = Lost(client, synth), synth.meters().underruns
                with PHASES[phase]():
                    if phase == "playing":
                        highest = max(highest, random_playing(synth, rng, seconds / cycles))
                    else:
                        time.sleep(max(3.0, 0.5 * seconds / cycles))
                totals[number] += [*began.read(), synth.meters().underruns - underruns]
            synth.panic()
            time.sleep(1.0)
        grown = settled(synth) - memory
        synth.meters()
        time.sleep(1.0)
        after = synth.meters()
        stuck = after.peak > 0 or any(sounding for _, _, sounding, _ in synth.bass.fingers())
        rates = dict(zip(PHASES, totals[:, 0] / totals[:, 1], strict=True))
        alone = max(rate for phase, rate in rates.items() if phase != "playing")
        allowed = MORE * min(alone, TELLING) + SLACK
        laws = [
            *(
                (f"{name}: {lost:.3f} s of {passed:.0f} s lost, {60 * xruns / passed:.1f} xruns a minute"
                 f" ({taken:.2f} s of the processors stolen by other machines)",
                 name != "playing" or lost <= allowed * passed)
                for name, (lost, passed, taken, xruns) in zip(PHASES, totals, strict=True)
            ),
            (f"{after.messages} messages, {after.late - before.late} of {after.blocks - before.blocks} blocks late",
             after.messages > 10 * seconds),
            (f"frames that were no number: {after.faults}", after.faults == 0),
            (f"after panic: peak {after.peak:g}", not stuck),
            (f"memory {memory:.0f} MB, at most {highest:.0f}, grown by {grown:.1f} in the end", grown < GROWTH),
        ]  # fmt: skip
        for text, good in laws:
            print(f"{'ok' if good else 'FAILED'}: {text}", flush=True)
        return int(not all(good for _, good in laws))
    finally:
        session.stop.set()


def settled(synth: Any) -> float:
    """Memory, MB, with one bass on the synth, always the same."""
    from livebass import preset_names

    for program in (0, preset_names().index("slap")):
        synth.send(0xC0, program)
        time.sleep(SETTLING)
    return resident()


def random_playing(synth: Any, rng: np.random.Generator, seconds: float) -> float:
    """Some 100 messages a second, a program every 2 s; the most memory meanwhile, MB."""
    end, next_program, most = time.monotonic() + seconds, 0.0, 0.0
    while time.monotonic() < end:
        synth.send(0x90, int(rng.integers(24, 72)), int(rng.integers(1, 128)))
        synth.send(0x80, int(rng.integers(24, 72)))
        if rng.random() < 0.3:
            synth.send(0xB0, int(rng.choice([7, 11, 16, 64, 1, 121, 123])), int(rng.integers(128)))
            synth.send(0xE0, int(rng.integers(128)), int(rng.integers(128)))
        if time.monotonic() > next_program:
            synth.send(0xC0, int(rng.integers(128)))
            next_program, most = time.monotonic() + 2.0, max(most, resident())
        time.sleep(float(rng.exponential(0.02)))
    return most


@contextmanager
def others_busy() -> Iterator[None]:
    """Another process keeps a processor busy, as long as this one is there."""
    code = f"import os\nwhile os.getppid() == {os.getpid()}: pass"
    other = subprocess.Popen([sys.executable, "-c", code])
    try:
        yield
    finally:
        other.kill()
        other.wait()


@contextmanager
def python_busy() -> Iterator[None]:
    """Two threads hold the interpreter: with bytecode, and with a regular expression that does not let go."""
    stop = threading.Event()

    def hog(work: Callable[[], object]) -> None:
        while not stop.is_set():
            work()

    for work in (lambda: sum(k * k for k in range(10_000)), lambda: re.match(r"(a+)+$", "a" * 16 + "b")):
        threading.Thread(target=hog, args=(work,), daemon=True).start()
    try:
        yield
    finally:
        stop.set()


PHASES: dict[str, Callable[[], AbstractContextManager[None]]] = {
    "idle": nullcontext,
    "others busy": others_busy,
    "playing": python_busy,
}


def wait_for_server(jack: Any) -> None:
    """Raises OSError where none comes."""
    for _ in range(100):
        try:
            jack.Client("probe", no_start_server=True).close()
            return
        except jack.JackError:
            time.sleep(0.1)
    raise OSError("the JACK server did not start")


def resident() -> float:
    """Memory of this process, MB."""
    with open("/proc/self/status") as file:
        return next(int(line.split()[1]) for line in file if line.startswith("VmRSS")) / 1024


def stolen() -> float:
    """Processor time that this virtual machine wanted and did not get, s, of all processors."""
    with open("/proc/stat") as file:
        return int(file.readline().split()[8]) / os.sysconf("SC_CLK_TCK")


if __name__ == "__main__":
    sys.exit(main())
