"""What the benchmarks share: a clock, a row of figures, the machine and who else used it, and case B of the paper."""

from __future__ import annotations

import os
import platform
import statistics
import time
from contextlib import suppress
from typing import Any

import numba
import numpy as np

from livebass.instrument import Instrument, Pluck, speaking
from livebass.motion import Trial
from livebass.operators import whole_contact_rate
from livebass.quality import QUALITIES, modes_for

APEX, PLACE = 3.6e-3, 0.64  # m, case B
PAPER_RATE = 8_000_000  # Hz, of its contact steps
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


def case_b(bass: Instrument, quality: str, rate: int, duration: float) -> Trial:
    """Case B, the contact rate a whole multiple of the output's, as an instrument has it."""
    q, string = QUALITIES[quality], bass.strings[0]
    s = speaking(string, bass.necks[0], 0)
    return Trial(
        speaking=s,
        pluck=Pluck(APEX, PLACE, bass.player.rounding),
        modes=modes_for(q, s.length, string.length, s.grid_points),
        contact_rate=whole_contact_rate(q.contact_rate, rate),
        output_rate=rate,
        duration=duration,
        sensor=s.length - bass.output.sensor,
    )


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
