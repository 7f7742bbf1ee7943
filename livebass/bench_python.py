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
from livebass.hush import patiently
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
        """Or not: now and then the server does not answer a client that it had to wait for so often."""
        patiently(lambda: self.client.deactivate(ignore_errors=True), self)
        patiently(lambda: self.client.close(ignore_errors=True), self)


def bench_python(progress: Say | None = None, extent: Extent | None = None) -> dict[str, Any]:
    """Both callbacks under each load, in two thirds of a minute: numbers and text, as JSON has them.

    "rows" has one for each load and callback: blocks of the server's time, and how many of them were lost. Raises
    Lost where no JACK server runs. [main thread]
    """
    extent = extent or USUAL
    say = progress or (lambda what: None)
    where, neighbours = machine(), Neighbours()
    found = apart(say, LONGEST, server)
    rows = []
    for load in LOADS:
        for callback in ("native", "Python"):
            say(f"{load}, {callback} callback")
            rows.append(apart(say, LONGEST + 2 * extent.seconds, _row, load, callback, found["block"], extent))
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


def _collector(objects: int) -> Work:
    kept: list[list[int]] = []

    def collect() -> None:
        if not kept:
            kept.extend([] for _ in range(objects))
        gc.collect()

    return collect


# Work for the main thread, each call some milliseconds; made of the number of objects for the garbage collector
LOADS: dict[str, Callable[[int], Work]] = {
    "idle": lambda _: lambda: time.sleep(0.05),
    "Python loop": lambda _: lambda: sum(k & 1 for k in range(200_000)),
    "regular expression": lambda _: lambda: re.match(r"(a+)+$", "a" * 20 + "b"),
    "garbage collector": _collector,
}


def _native(name: str, make_stage: Callable[[int], Stage]) -> JackOutput:
    return JackOutput(name, make_stage, connect=False)


def _row(_say: Say, load: str, callback: str, block: int, extent: Extent) -> Row:
    work = LOADS[load](extent.objects)
    make: Callable[..., Any] = PythonOutput if callback == "Python" else _native
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
