"""Why the callback is native: `bench_python` measures, `bench_live_table.python_table` shows.

One client of a running JACK server plays the demo phrase, first with the native callback, then with an ordinary one in
Python that asks the same engine for the same blocks, while the main thread keeps the interpreter busy. Lost is what
the server's frame time went on by and the stage did not play.
"""

from __future__ import annotations

import gc
import re
import time
from collections.abc import Callable
from dataclasses import dataclass
from datetime import UTC, datetime
from typing import Any

from livebass import __version__
from livebass.bench_apart import apart
from livebass.bench_card import Card
from livebass.bench_jack import new_client, server, since
from livebass.bench_measure import Neighbours, Row, machine
from livebass.demo import demo_score
from livebass.outputs import JackOutput
from livebass.preset import load_preset
from livebass.quality import QUALITIES
from livebass.stage import LiveBass, Stage

PRESET, QUALITY = "slap", "live"
LONGEST = 90.0  # s, without the measuring itself
Say = Callable[[str], None]
Work = Callable[[], object]


@dataclass(frozen=True)
class Extent:
    """How much is measured."""

    seconds: float = 2.0  # each load with each callback
    settle: float = 0.5  # s after a client has joined, before that
    objects: int = 1_000_000  # that the garbage collector goes through


USUAL = Extent()


class PythonOutput:
    """What `JackOutput` does, with a callback in Python."""

    def __init__(self, name: str, make_stage: Callable[[int], Stage]) -> None:
        self.client = new_client(name)
        self.stage = make_stage(int(self.client.samplerate))
        self._card = Card(self.stage, int(self.client.blocksize))
        self._port = self.client.outports.register("out")
        self.client.set_process_callback(self._process)
        self.client.set_xrun_callback(self._xrun)

    def _process(self, _frames: int) -> None:
        self._port.get_array()[:] = self._card.next()

    def _xrun(self, _delay: float) -> None:
        self.stage.record["underruns"] += 1

    def start(self) -> None:
        self.client.activate()

    def close(self) -> None:
        self.client.deactivate(ignore_errors=True)
        self.client.close(ignore_errors=True)


def bench_python(progress: Say | None = None, extent: Extent | None = None) -> dict[str, Any]:
    """Both callbacks under each load, in half a minute: numbers and text, as JSON has them.

    "rows" has one for each load and callback: blocks of the server's time, and how many of them were lost. Raises
    Lost where no JACK server runs. [main thread]
    """
    extent = extent or USUAL
    say = progress or (lambda what: None)
    where, neighbours = machine(), Neighbours()
    found = apart(say, LONGEST, server)
    rows = apart(say, LONGEST + 10 * extent.seconds, _rows, found["block"], extent)
    return {
        "livebass": __version__,
        "date": datetime.now(UTC).isoformat(timespec="seconds"),
        "machine": where,
        **neighbours.shares(),
        "preset": PRESET,
        "quality": QUALITY,
        "rate_hz": found["rate"],
        "block": found["block"],
        "server": found,
        "seconds": extent.seconds,
        "rows": rows,
    }


def _rows(say: Say, block: int, extent: Extent) -> list[Row]:
    rows = []
    for load, work in _loads(extent.objects).items():
        for callback, make in (("native", _native), ("Python", PythonOutput)):
            say(f"{load}, {callback} callback")
            rows.append(_row(load, callback, make, work, block, extent))
    return rows


def _loads(objects: int) -> dict[str, Work]:
    """Work for the main thread, each call some milliseconds."""
    kept: list[list[int]] = []

    def collect() -> None:
        if not kept:
            kept.extend([] for _ in range(objects))
        gc.collect()

    return {
        "idle": lambda: time.sleep(0.05),
        "Python loop": lambda: sum(k & 1 for k in range(200_000)),
        "regular expression": lambda: re.match(r"(a+)+$", "a" * 20 + "b"),
        "garbage collector": collect,
    }


def _native(name: str, make_stage: Callable[[int], Stage]) -> JackOutput:
    return JackOutput(name, make_stage, connect=False)


def _row(load: str, callback: str, make: Callable[..., Any], work: Work, block: int, extent: Extent) -> Row:
    output = make("livebass-bench", lambda rate: Stage(rate))
    stage = output.stage
    try:
        stage.put_on(LiveBass(load_preset(PRESET), QUALITIES[QUALITY], stage.rate))
        stage.feed(demo_score(stage.rate, "slap"), 0, stage.rate // 10)
        output.start()
        time.sleep(extent.settle)
        began, first = output.client.frame_time, int(stage.record["frame"][0])
        xruns = int(stage.record["underruns"][0])
        end = time.monotonic() + extent.seconds
        while time.monotonic() < end:
            work()
        passed = since(output.client.frame_time, began)
        played = int(stage.record["frame"][0]) - first
        xruns = int(stage.record["underruns"][0]) - xruns
    finally:
        output.close()
    blocks = max(1, round(passed / block))
    lost = min(blocks, max(0, round((passed - played) / block)))
    return {"load": load, "callback": callback, "blocks": blocks, "lost": lost, "share": lost / blocks, "xruns": xruns}
