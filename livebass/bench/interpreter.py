"""`livebass bench python`: why the callback is native.

A client of a running JACK server plays the slap phrase, with the native callback and with one in Python that asks the
same engine for the same blocks, while the main thread keeps the interpreter busy. Counted are the blocks that passed on
the server and that the synth did not play.
"""

from __future__ import annotations

import gc
import re
import time
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from livebass.bench.jack import LostFrames, in_child, new_client, server
from livebass.bench.measure import OtherLoad, Result, Row, heading, load_lines
from livebass.live.guards import call_with_timeout
from livebass.live.outputs import FakeDevice, JackOutput
from livebass.live.synth import LiveBass, Synth
from livebass.model.quality import QUALITIES
from livebass.preset.load import load_preset
from livebass.report.picture import figure, image
from livebass.report.progress import Say, silent
from livebass.report.text import columns
from livebass.score.phrases import demo_score

PRESET, QUALITY, STYLE = "slap", "live", "slap"
LONGEST = 90.0  # s for a process, besides the measuring itself
Work = Callable[[], object]


@dataclass(frozen=True)
class Extent:
    """How much is measured."""

    seconds: float = 2.0  # each load with each callback
    settle: float = 0.5  # s after a client has joined, before that
    objects: int = 1_000_000  # that the garbage collector goes through


FULL = Extent()


class PythonOutput:
    """A JACK client with a callback in Python; otherwise like `JackOutput`."""

    def __init__(self, name: str) -> None:
        self.client = new_client(name)
        try:
            self._prepare()
        except BaseException:
            self.client.close(ignore_errors=True)
            raise

    def _prepare(self) -> None:
        self.synth = Synth(int(self.client.samplerate))
        self._device = FakeDevice(self.synth)
        self._out = np.zeros(int(self.client.blocksize), np.float32)
        self._port = self.client.outports.register("out")
        self.client.set_process_callback(self._process)
        self.client.set_xrun_callback(lambda _delay: self.synth.count_underrun())

    def _process(self, _frames: int) -> None:
        self._port.get_array()[:] = self._device.fill(self._out)

    def start(self) -> None:
        self.client.activate()

    def close(self) -> None:
        """Ends the client, or leaves it behind: a server that had to wait for it so often may not answer."""
        call_with_timeout(lambda: self.client.deactivate(ignore_errors=True), self)
        call_with_timeout(lambda: self.client.close(ignore_errors=True), self)


CALLBACKS: dict[str, Callable[[str], JackOutput | PythonOutput]] = {
    "native": lambda name: JackOutput(name, Synth, connect=False),
    "Python": PythonOutput,
}


def _collector(objects: int) -> Work:
    kept: list[list[int]] = []

    def collect() -> None:
        if not kept:
            kept.extend([] for _ in range(objects))
        gc.collect()

    return collect


# Work for the main thread, some milliseconds a call; made for a number of objects for the garbage collector.
LOADS: dict[str, Callable[[int], Work]] = {
    "idle": lambda _: lambda: time.sleep(0.05),
    "Python loop": lambda _: lambda: sum(k & 1 for k in range(200_000)),
    "regular expression": lambda _: lambda: re.match(r"(a+)+$", "a" * 20 + "b"),
    "garbage collector": _collector,
}


def bench_python(progress: Say = silent, extent: Extent = FULL) -> Result:
    """Measures both callbacks under each load in two thirds of a minute. `progress` is told what comes next.

    "rows" has one for each load and callback: blocks of the server's time, and how many of them were lost. Raises
    Lost if no JACK server runs. [main thread]
    """
    result, other_load = heading(), OtherLoad()
    found = in_child(LONGEST, server)
    rows = []
    for load in LOADS:
        for callback in CALLBACKS:
            progress(f"{load}, {callback} callback")
            rows.append(in_child(LONGEST + 2 * extent.seconds, _row, load, callback, found["block"], extent))
    return result | {
        **other_load.shares(),
        "preset": PRESET,
        "quality": QUALITY,
        "rate_hz": found["rate"],
        "block": found["block"],
        "server": found,
        "seconds": extent.seconds,
        "rows": rows,
    }


def _row(load: str, callback: str, block: int, extent: Extent) -> Row:
    work = LOADS[load](extent.objects)
    output = CALLBACKS[callback]("livebass-bench")
    synth = output.synth
    try:
        synth.switch_to(LiveBass(load_preset(PRESET), QUALITIES[QUALITY], synth.rate))
        synth.feed(demo_score(synth.rate, STYLE), 0, synth.rate // 10)
        output.start()
        time.sleep(extent.settle)
        frames, before = LostFrames(output.client, synth), synth.meters().underruns
        wanted, end = extent.seconds * synth.rate, time.monotonic() + LONGEST / 2
        while frames.read()[0] < wanted and time.monotonic() < end:  # the server's time stands still while it stalls
            work()
        passed, lost = (count / block for count in frames.read())
        xruns = synth.meters().underruns - before
    finally:
        output.close()
    blocks = max(1, round(passed))
    gone = min(blocks, max(0, round(lost)))
    return {"load": load, "callback": callback, "blocks": blocks, "lost": gone, "share": gone / blocks, "xruns": xruns}


HEAD = ("interpreter", "callback", "blocks", "lost", "share", "xruns")


def table(result: Result) -> str:
    """Returns the figures of `bench_python` as text."""
    cells = [
        (row["load"], row["callback"], str(row["blocks"]), str(row["lost"]), f"{row['share']:.1%}", str(row["xruns"]))
        for row in result["rows"]
    ]
    return "\n".join(
        [
            f"the same engine behind two callbacks of a JACK server, {result['block']} frames at "
            f"{result['rate_hz'] / 1e3:g} kHz, {result['seconds']:g} s each; lost: blocks of the server without sound",
            *columns([HEAD, *cells], left=2),
            "",
            *load_lines(result),
        ]
    )


def picture(result: Result) -> bytes:
    """Returns a PNG: the share of lost blocks of both callbacks, side by side for each load."""
    rows = result["rows"]
    shares = {(row["load"], row["callback"]): 100 * row["share"] for row in rows}
    loads = list(dict.fromkeys(row["load"] for row in rows))
    drawn = figure(8, 4)
    axis = drawn.subplots()
    for k, callback in enumerate(dict.fromkeys(row["callback"] for row in rows)):
        places = np.arange(len(loads)) + 0.4 * k - 0.2
        bars = axis.bar(places, [shares[load, callback] for load in loads], 0.38, label=callback)
        axis.bar_label(bars, fmt="%.1f", fontsize="small")
    axis.set_xticks(np.arange(len(loads)), loads)
    axis.set(ylabel="blocks that missed their deadline, %", ylim=(0, 110), title=f"{result['block']} frames")
    axis.legend()
    return image(drawn)
