"""What the benchmarks share: a clock, a row of figures, and case B of the paper."""

from __future__ import annotations

import statistics
import time
from typing import Any

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
