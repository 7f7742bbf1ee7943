"""What the benchmarks share: a clock, a row of figures, the machine and who else used it, and case B of the paper.

The published method's step: products with full matrices, timed on one thread of the linear algebra.

Work that may never come back, such as a JACK client whose server has died, in a process with a time limit.
"""

from __future__ import annotations

import json
import multiprocessing
import os
import platform
import signal
import statistics
import subprocess
import sys
import time
from collections.abc import Callable
from contextlib import suppress
from dataclasses import replace
from multiprocessing.connection import Connection
from typing import Any

import numba
import numpy as np

from livebass.arrays import Floats
from livebass.engine.prepare import whole_contact_rate
from livebass.model import modes
from livebass.model.quality import QUALITIES, modes_for
from livebass.model.trial import Trial, initial_amplitudes
from livebass.paper.cases import CASES
from livebass.report.progress import Say

CASE_B = CASES["b"]
RATES = (50_000, 48_000)  # Hz, of the output; of 50 kHz, 8 MHz is a whole multiple
Row = dict[str, Any]


class Clock:
    """Time taken and processor time used by each `with` block so far, s."""

    def __init__(self) -> None:
        self.work: list[float] = []
        self.processor: list[float] = []

    def __enter__(self) -> None:
        self._used, self._began = time.process_time(), time.perf_counter()

    def __exit__(self, *_: object) -> None:
        self.work.append(time.perf_counter() - self._began)
        self.processor.append(time.process_time() - self._used)


def row(name: str, sound: float, clock: Clock, **more: Any) -> Row:
    """A measurement: each run of `clock` made `sound` s."""
    each = [w / sound for w in clock.work]
    return {
        "name": name,
        **more,
        "sound_s": sound,
        "seconds_per_second": min(each),
        "median": statistics.median(each),
        "processor": min(clock.processor) / sound,
        "runs": each,
    }


def case_trial(name: str, quality: str, rate: int, duration: float) -> Trial:
    """A case of the paper with the modes and the contact rate of `quality`, as an instrument has them.

    `rate` is that of the output, Hz; `duration` s.
    """
    q = QUALITIES[quality]
    trial = replace(CASES[name], duration=duration).trial(rate)
    s = trial.speaking
    count = modes_for(q, s.length, s.string.length, s.grid_points)
    return replace(trial, modes=count, contact_rate=whole_contact_rate(q.contact_rate, rate))


def machine() -> dict[str, Any]:
    """Where the figures are from."""
    name = platform.processor() or platform.machine()
    with suppress(OSError), open("/proc/cpuinfo", encoding="utf-8") as lines:
        name = next((line.partition(":")[2].strip() for line in lines if line.startswith("model name")), name)
    load = None
    with suppress(OSError, AttributeError):
        load = os.getloadavg()[0]
    blas: Any = np.show_config(mode="dicts")
    return {
        "cpu": name,
        "cores": os.cpu_count(),
        "system": f"{platform.system()} {platform.machine()}",
        "python": platform.python_version(),
        "numpy": np.__version__,
        "blas": blas["Build Dependencies"]["blas"].get("name", "unknown"),
        "numba": numba.__version__,
        "load_before": load,  # processes that ran already
    }


class Neighbours:
    """What others took of the processors since this was made, as parts of all their time; None where nobody counts.

    `stolen` went to other guests of a virtual machine's host, `others` to other processes of this machine.
    """

    IDLE, WAITING, STOLEN = 3, 4, 7  # columns of /proc/stat

    def __init__(self) -> None:
        self._before, self._mine = _ticks(), _own()

    def shares(self) -> dict[str, float | None]:
        now = _ticks()
        if not self._before or not now or sum(now) <= sum(self._before):
            return {"stolen": None, "others": None}
        spent = [b - a for a, b in zip(self._before, now, strict=True)]
        total, stolen = sum(spent), spent[self.STOLEN]
        mine = (_own() - self._mine) * os.sysconf("SC_CLK_TCK")
        others = total - spent[self.IDLE] - spent[self.WAITING] - stolen - mine
        return {"stolen": stolen / total, "others": max(0.0, others / total)}


def _own() -> float:
    """Processor time of this process and of those it started that have ended, s."""
    return sum(os.times()[:4])


def _ticks() -> list[int]:
    """user, nice, system, idle, iowait, irq, softirq and steal time of all processors; empty where there is none."""
    with suppress(OSError, ValueError), open("/proc/stat", encoding="ascii") as lines:
        fields = lines.readline().split()[1:9]
        if len(fields) == 8:
            return [int(field) for field in fields]
    return []


# What the libraries behind numpy's products listen to.
ONE_THREAD = {
    "OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1", "MKL_NUM_THREADS": "1", "BLIS_NUM_THREADS": "1",
    "VECLIB_MAXIMUM_THREADS": "1",
}  # fmt: skip


def dense_row(steps: int, runs: int) -> Row:
    """The published method's two products, in a process of its own where the linear algebra has one thread."""
    program = f"import json, livebass.bench.measure as b; print(json.dumps(b.dense_steps({steps}, {runs})))"
    done = subprocess.run(
        [sys.executable, "-c", program],
        env={**os.environ, **ONE_THREAD, "PYTHONPATH": os.pathsep.join(p or os.curdir for p in sys.path)},
        capture_output=True,
        text=True,
        check=False,
    )
    if done.returncode:
        raise RuntimeError(f"dense products: {(done.stderr.splitlines() or ['no reason given'])[-1]}")
    result = json.loads(done.stdout)
    clock = Clock()
    clock.work, clock.processor = result["step_s"], result["processor_s"]
    return row(
        "dense step, as published",
        1 / CASE_B.contact_rate,
        clock,
        modes=result["modes"],
        contact_rate_hz=int(CASE_B.contact_rate),
        rate_hz=None,
        cores=1,
    )


def dense_steps(steps: int, runs: int) -> dict[str, Any]:
    """What a step of eq. 12 costs with full matrices: u^{n+1} = D u^n - D~ u^{n-1} on the points of the grid.

    The contact force would come on top. "step_s" and "processor_s" have the mean of `steps` steps for each run,
    after one that is not counted. [main thread]
    """
    trial = case_trial("b", "reference", RATES[0], 1.0)
    forward, backward, u = _dense_matrices(trial)
    before, after, taken = u.copy(), np.empty_like(u), np.empty_like(u)
    clock = Clock()
    for _ in range(runs + 1):
        with clock:
            for _ in range(steps):
                np.dot(forward, u, out=after)
                np.dot(backward, before, out=taken)
                after -= taken
                before, u, after = u, after, before
    if not np.abs(u).max() < 2 * CASE_B.apex:
        raise ArithmeticError("the dense products do not swing like a string")
    each = np.array([clock.work[1:], clock.processor[1:]]) / steps
    return {"modes": len(u), "step_s": each[0].tolist(), "processor_s": each[1].tolist()}


def _dense_matrices(trial: Trial) -> tuple[Floats, Floats, Floats]:
    """D = S C S^-1 and D~ of eq. 12, (points, points), and the pluck's u, (points,), m."""
    s, count, dt = trial.speaking, trial.modes, 1 / trial.contact_rate
    sigma = modes.dampings(s, count)
    omega = np.sqrt((2 * np.pi * modes.frequencies(s, count)) ** 2 - sigma**2)
    shape = modes.shapes(s, count, s.step * np.arange(1.0, count + 1))
    inverse = s.step * shape.T
    forward = (shape * (2 * np.exp(-sigma * dt) * np.cos(omega * dt))) @ inverse
    return forward, (shape * np.exp(-2 * sigma * dt)) @ inverse, shape @ initial_amplitudes(trial)


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
