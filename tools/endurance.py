"""Plays dense random notes for minutes while Python is busy; prints lost frames, faults, stuck notes, memory growth.

    python tools/endurance.py [--minutes 10] [--seed 1]

Starts its own JACK server with the dummy driver (Debian: jackd2) and a session as in `livebass play`, and cycles ten
times through three phases: nobody plays; nobody plays and another process keeps a processor busy, which alone costs
frames on a shared machine; a thread plays notes, controllers, bends and programs, and two more keep the interpreter
busy. The server requests real-time scheduling; without permission, any other work on the machine costs frames.

The phases with notes may lose at most the frames that the phases without notes lose, plus half as many for chance. The
exit status is 1 if a check fails, or if the phases without notes lose too many frames to tell.
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
from typing import Any

import numpy as np

from livebass.lab.bench.jack import Lost, LostFrames, end_process, new_client, wait_for
from livebass.lab.bench.measure import OtherLoad
from livebass.live.jack import jack_server
from livebass.live.presets import return_freed_memory
from livebass.live.session import Session
from livebass.live.settings import Settings
from livebass.live.synth import Synth
from livebass.live.worst import CONTROL, NOTE_OFF, NOTE_ON
from livebass.model.quality import QUALITIES
from livebass.preset.load import load_preset
from livebass.preset.programs import PROGRAMS, program_of
from livebass.report.progress import Say

PERIOD, RATE = 256, 48_000  # frames, Hz
PRESET = "slap"
PROGRAM, BEND = 0xC0, 0xE0  # status bytes
OTHER = next(number for number, name in PROGRAMS.items() if name != PRESET)
BASSES = range(32, 40)  # General MIDI's bass programs, counted from 0; the last two choose no preset
CONTROLLERS = (7, 11, 16, 64, 1, 121, 123)
CYCLES = 10
WARM_UP = 15.0  # s of playing before memory is compared, after each preset has played; 0: skip both
MIN_PHASE = 3.0  # s, the shortest phase in which nobody plays
START = 60.0  # s for the server
SETTLING = 180.0  # s at most, until a program plays and the previous bass is released
GROWTH = 20.0  # MB, allowed growth of memory
# Lost frames allowed while playing, as a part of the time: MORE times the worse of the other phases, as the load of
# other machines varies, plus SLACK. If these phases lose more than TELLING, the run is inconclusive.
MORE, SLACK, TELLING = 1.5, 0.0002, 0.01


def endurance(seconds: float, seed: int, say: Say) -> bool:
    """Runs all phases, `seconds` of playing in total; returns True if every check passes.

    `say` gets a line per check. Raises Lost if there is no JACK, and the errors of `Session.run`. [main thread]
    """
    with _dummy_server():
        session = Session(Settings(load_preset(PRESET), QUALITIES["live"], PRESET, backend="jack", keyboard=False))
        passed: list[bool] = []
        beside = threading.Thread(target=lambda: passed.append(_judged(session, seconds, seed, say)), daemon=True)
        beside.start()
        summary = session.run()
        beside.join(10)
    if summary.lost:
        say(f"FAILED: {summary.lost}")
    return not summary.lost and passed == [True]


@contextmanager
def _dummy_server() -> Iterator[None]:
    """Runs a separate JACK server with the dummy driver; clients made meanwhile find it."""
    name = f"livebass-endurance-{os.getpid()}"
    os.environ["JACK_DEFAULT_SERVER"], os.environ["JACK_NO_AUDIO_RESERVATION"] = name, "1"
    command = ["jackd", "-n", name, "-d", "dummy", "-r", str(RATE), "-p", str(PERIOD)]
    try:
        server = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    except OSError as error:
        raise Lost(f"jackd: {error.strerror}; on Debian: sudo apt install jackd2") from None
    try:
        if not wait_for(jack_server, START):
            raise Lost("the JACK server did not start")
        yield
    finally:
        end_process(server, 5.0)


def _judged(session: Session, seconds: float, seed: int, say: Say) -> bool:
    """Plays on a session that is starting, ends it, and returns True if every check passes."""
    try:
        while session.synth is None:
            time.sleep(0.05)
        client = new_client("endurance")
        try:
            checks = _checks(session.synth, client, seconds, seed, say)
        finally:
            client.close(ignore_errors=True)  # while the server runs: closed later it can crash
        for text, passed in checks:
            say(f"{'ok' if passed else 'FAILED'}: {text}")
        return all(passed for _, passed in checks)
    except Lost as error:
        say(f"FAILED: {error}")
        return False
    finally:
        session.stop.set()


def _checks(synth: Synth, client: Any, seconds: float, seed: int, say: Say) -> list[tuple[str, bool]]:
    """Runs the phases; returns a line for each check, and True if it passes."""
    say(f"{seconds:.0f} s, {'with' if client.realtime else 'without'} real-time scheduling")
    rng = np.random.default_rng(seed)
    for program in PROGRAMS if WARM_UP else ():
        _settle(synth, program)
    random_playing(synth, rng, WARM_UP)
    memory = highest = _settled_memory(synth)
    before = synth.meters()
    totals = {name: np.zeros(4) for name in PHASES}  # frames elapsed, frames lost, s stolen, xruns
    for _ in range(CYCLES):
        for name, phase in PHASES.items():
            frames, load, underruns = LostFrames(client, synth), OtherLoad(), synth.meters().underruns
            with phase():
                if name == "playing":
                    highest = max(highest, random_playing(synth, rng, seconds / CYCLES))
                else:
                    time.sleep(max(MIN_PHASE, 0.5 * seconds / CYCLES))
            passed, lost = frames.read()
            xruns = synth.meters().underruns - underruns
            totals[name] += passed, max(0, lost - PERIOD), load.stolen_seconds(), xruns
        synth.panic()
        time.sleep(1.0)
    grown = _settled_memory(synth) - memory
    synth.meters()
    time.sleep(1.0)
    after = synth.meters()
    stuck = after.peak > 0 or any(sounding for _, _, sounding, _ in synth.bass.fingers()) if synth.bass else False
    rates = {name: lost / passed for name, (passed, lost, _, _) in totals.items()}
    allowed = MORE * min(max(rates[name] for name in PHASES if name != "playing"), TELLING) + SLACK
    return [
        *(
            (f"{name}: {lost / RATE:.3f} s of {passed / RATE:.0f} s lost, {60 * xruns * RATE / passed:.1f} xruns a "
             f"minute ({taken:.2f} s of processor time stolen by other machines)",
             bool(name != "playing" or rates[name] <= allowed))
            for name, (passed, lost, taken, xruns) in totals.items()
        ),
        (f"{after.messages} messages, {after.late - before.late} of {after.blocks - before.blocks} blocks late",
         after.messages > 10 * seconds),
        (f"frames that were NaN or far too large: {after.faults}", after.faults == 0),
        (f"after panic: peak {after.peak:g}", not stuck),
        (f"memory {memory:.0f} MB, at most {highest:.0f}, grown by {grown:.1f} in the end", grown < GROWTH),
    ]  # fmt: skip


def _settled_memory(synth: Synth) -> float:
    """Memory, always with the same bass, MB."""
    for program in (OTHER, program_of(PRESET) or 0):
        _settle(synth, program)
    return_freed_memory()
    return _memory()


def _settle(synth: Synth, program: int) -> None:
    """Changes to a program's preset; waits until it plays and the previous bass is released. May raise Lost."""
    preset = PROGRAMS[program]
    instrument = load_preset(preset)
    synth.panic()  # stop ringing strings
    synth.send(PROGRAM, program - 1)
    if not wait_for(
        lambda: not synth.ringing and synth.bass is not None and synth.bass.engine.instrument == instrument, SETTLING
    ):
        raise Lost(f"program {program}, {preset}, does not play after {SETTLING:.0f} s")


def random_playing(synth: Synth, rng: np.random.Generator, seconds: float) -> float:
    """Sends about 100 messages a second, and a program every 2 s; returns the peak memory, MB."""
    end, next_program, maximum = time.monotonic() + seconds, 0.0, 0.0
    while time.monotonic() < end:
        synth.send(NOTE_ON, int(rng.integers(24, 72)), int(rng.integers(1, 128)))
        synth.send(NOTE_OFF, int(rng.integers(24, 72)))
        if rng.random() < 0.3:
            synth.send(CONTROL, int(rng.choice(CONTROLLERS)), int(rng.integers(128)))
            synth.send(BEND, int(rng.integers(128)), int(rng.integers(128)))
        if time.monotonic() > next_program:
            synth.send(PROGRAM, int(rng.choice(BASSES)))
            next_program, maximum = time.monotonic() + 2.0, max(maximum, _memory())
        time.sleep(float(rng.exponential(0.02)))
    return maximum


@contextmanager
def _others_busy() -> Iterator[None]:
    """Another process keeps a processor busy; it always ends with this one."""
    code = f"import os\nwhile os.getppid() == {os.getpid()}: pass"
    other = subprocess.Popen([sys.executable, "-c", code])
    try:
        yield
    finally:
        other.kill()
        other.wait()


@contextmanager
def python_busy() -> Iterator[None]:
    """Two threads hold the interpreter: with bytecode, and with a regular expression that does not release it."""
    stop = threading.Event()

    def repeat(work: Callable[[], object]) -> None:
        while not stop.is_set():
            work()

    for work in (lambda: sum(k * k for k in range(10_000)), lambda: re.match(r"(a+)+$", "a" * 16 + "b")):
        threading.Thread(target=repeat, args=(work,), daemon=True).start()
    try:
        yield
    finally:
        stop.set()


PHASES: dict[str, Callable[[], AbstractContextManager[None]]] = {
    "idle": nullcontext,
    "others busy": _others_busy,
    "playing": python_busy,
}


def _memory() -> float:
    """Memory of this process, MB."""
    with open("/proc/self/status", encoding="ascii") as file:
        return next(int(line.split()[1]) for line in file if line.startswith("VmRSS")) / 1024


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--minutes", type=float, default=10.0, help="of playing; default: 10")
    parser.add_argument("--seed", type=int, default=1, help="of the random notes; default: 1")
    options = parser.parse_args()
    logging.basicConfig(level=logging.INFO, format="%(message)s", stream=sys.stdout)
    logging.root.handlers[0].addFilter(lambda record: not record.getMessage().startswith("preset"))
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(143))  # this also ends the server
    try:
        return 0 if endurance(60.0 * options.minutes, options.seed, lambda line: print(line, flush=True)) else 1
    except OSError as error:
        print(f"endurance: {error}", file=sys.stderr)
        return 1


if __name__ == "__main__":
    sys.exit(main())
