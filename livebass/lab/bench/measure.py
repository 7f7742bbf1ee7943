"""Shared by the benchmarks: a clock, rows of figures, the paper's cases, the machine and other programs' load."""

from __future__ import annotations

import os
import platform
import statistics
import time
from contextlib import suppress
from dataclasses import replace
from datetime import UTC, datetime
from typing import Any

import numpy as np

from livebass import __version__
from livebass.engine.prepare import whole_contact_rate
from livebass.lab.paper.cases import CASES
from livebass.model.quality import QUALITIES
from livebass.model.trial import Trial, in_quality
from livebass.system.cores import core_count
from livebass.system.extras import installed_version

CASE_B = CASES["b"]
RATES = (50_000, 48_000)  # Hz, of the output; the 8 MHz of case B are an integer multiple of the first
Row = dict[str, Any]
Result = dict[str, Any]  # of a benchmark: numbers and text, ready for JSON


class Clock:
    """Wall time and processor time of each `with` block, s."""

    def __init__(self) -> None:
        self.wall: list[float] = []
        self.processor: list[float] = []

    def __enter__(self) -> None:
        self._used, self._began = time.process_time(), time.perf_counter()

    def __exit__(self, *_: object) -> None:
        self.wall.append(time.perf_counter() - self._began)
        self.processor.append(time.process_time() - self._used)


def row(name: str, sound: float, clock: Clock, **more: Any) -> Row:
    """Returns the figures of several runs that each made `sound` s of sound: s of work per s of sound."""
    each = [w / sound for w in clock.wall]
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
    """Returns a case of the paper with the modes and the contact rate that `quality` gives an instrument.

    `rate` is the output's, Hz; `duration` in s.
    """
    trial = replace(CASES[name], duration=duration).trial(rate)
    count, contact_rate = in_quality(trial.speaking, QUALITIES[quality])
    return replace(trial, modes=count, contact_rate=whole_contact_rate(contact_rate, rate))


def heading() -> Result:
    """Returns the version, the date and the machine, to begin a result. Call before the work."""
    return {
        "livebass": __version__,
        "date": datetime.now(UTC).isoformat(timespec="seconds"),
        "machine": _machine(),
    }


def _machine() -> dict[str, Any]:
    name = platform.processor() or platform.machine()
    with suppress(OSError), open("/proc/cpuinfo", encoding="utf-8") as lines:
        name = next((line.partition(":")[2].strip() for line in lines if line.startswith("model name")), name)
    load = None
    with suppress(OSError, AttributeError):
        load = os.getloadavg()[0]
    return {
        "cpu": name,
        "cores": core_count(),
        "system": f"{platform.system()} {platform.machine()}",
        "python": platform.python_version(),
        "numpy": np.__version__,
        "numba": installed_version("numba"),
        "load_before": load,  # by processes already running
    }


def machine_line(result: Result) -> str:
    """Returns the version and the machine of a result as a table line."""
    machine = result["machine"]
    return (
        f"livebass {result['livebass']}, {machine['cpu']}, {machine['cores']} cores, {machine['system']}, Python "
        f"{machine['python']}, numpy {machine['numpy']}, numba {machine['numba']}"
    )


class OtherLoad:
    """Processor time taken by others since creation."""

    IDLE, WAITING, STOLEN = 3, 4, 7  # columns of /proc/stat

    def __init__(self) -> None:
        self._before, self._own = _ticks(), _own_time()

    def shares(self) -> dict[str, float | None]:
        """Returns shares of all processors' time, or None on systems that do not count it.

        "stolen" went to other guests of a virtual machine's host, "others" to other processes of this machine.
        """
        now = _ticks()
        if not self._before or not now or sum(now) <= sum(self._before):
            return {"stolen": None, "others": None}
        spent = [b - a for a, b in zip(self._before, now, strict=True)]
        total, stolen = sum(spent), spent[self.STOLEN]
        own = (_own_time() - self._own) * os.sysconf("SC_CLK_TCK")
        others = total - spent[self.IDLE] - spent[self.WAITING] - stolen - own
        return {"stolen": stolen / total, "others": max(0.0, others / total)}

    def stolen_seconds(self) -> float:
        """Returns the time stolen since creation, s, of all processors together; 0 without /proc/stat."""
        now = _ticks()
        return (now[self.STOLEN] - self._before[self.STOLEN]) / os.sysconf("SC_CLK_TCK") if now else 0.0


def load_lines(result: Result) -> list[str]:
    """Returns the last lines of a table: the machine, and its use by others."""
    jack = f", JACK {result['server']['version']}" if result.get("server") else ""
    lines = [machine_line(result) + jack]
    stolen, others = result["stolen"], result["others"]
    if stolen is not None:
        lines.append(f"share of all processors' time: stolen by the host {stolen:.1%}, other processes {others:.1%}")
    return lines


def _own_time() -> float:
    """Processor time of this process and its ended children, s."""
    return sum(os.times()[:4])


def _ticks() -> list[int]:
    """User, nice, system, idle, iowait, irq, softirq and steal time of all processors; [] without /proc/stat."""
    with suppress(OSError, ValueError), open("/proc/stat", encoding="ascii") as lines:
        fields = lines.readline().split()[1:9]
        if len(fields) == 8:
            return [int(field) for field in fields]
    return []
