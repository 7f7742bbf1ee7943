"""Measures many CLAP plugin instances in one process, some with windows: memory, load, opening time.

    python tools/instances.py [COUNT [WINDOWS]]        # 20 and 4, as in a large project

Needs Xvfb. The host is the tests' host, in Python; it causes nearly all the load of silent instances. Loads are
fractions of one core: processor time over the sound's duration. Memory is the process's PSS, as the kernel counts it.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
import time
from contextlib import ExitStack, closing
from pathlib import Path

import numpy as np

from livebass import load_preset, preset_names
from livebass.plugin import clap

sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))
from support.clap import Plugin, note_on
from support.screen import running_screen
from support.window import Window

RATE = 48_000  # Hz
BLOCKS = (64, 256)  # frames
SECONDS = 8.0  # of each measurement
KEYS = (28, 33, 38, 43)  # one for each string
MB = 1e6


def memory() -> float:
    """Returns this process's PSS, bytes."""
    lines = Path("/proc/self/smaps_rollup").read_text().splitlines()
    return next(1024.0 * int(line.split()[1]) for line in lines if line.startswith("Pss:"))


def load(plugins: list[Plugin], block: int, sounding: bool, in_real_time: bool = False) -> tuple[float, float]:
    """Plays all for SECONDS; returns their total load: its mean, and its maximum over blocks."""
    loads, began, used = [], time.perf_counter(), time.process_time()
    for k in range(round(SECONDS * RATE / block)):
        events = [note_on(key, 0.7) for key in KEYS] if sounding and k % (RATE // block) == 0 else []
        start = time.thread_time()
        for plugin in plugins:
            plugin.block(block, events)
        loads.append((time.thread_time() - start) * RATE / block)
        if in_real_time:
            time.sleep(max(0.0, began + (k + 1) * block / RATE - time.perf_counter()))
    mean = (time.process_time() - used) / SECONDS if in_real_time else float(np.mean(loads))
    return mean, float(np.max(loads))


def main(count: int, windows: int) -> None:
    with tempfile.TemporaryDirectory() as made, running_screen(), ExitStack() as stack:
        folder = Path(made) / "livebass"
        clap.write_bundle({name: load_preset(name) for name in preset_names()}, folder)
        before, plugins, took = memory(), [], []
        for _ in range(count):
            start = time.perf_counter()
            plugins.append(stack.enter_context(closing(Plugin(folder))))
            took.append(time.perf_counter() - start)
        each = (memory() - before) / count
        print(f"{count} instances: {each / MB:.1f} MB each, loaded in {1e3 * np.median(took):.0f} ms (median)")
        for sounding in (False, True):
            for block in BLOCKS:
                mean, worst = load(plugins, block, sounding)
                what = "four strings sounding" if sounding else "silent"
                print(f"{block} frames, {what}: {mean:.1%} of a core, {mean / count:.2%} each; worst block {worst:.0%}")
        alone, _ = load(plugins[:1], BLOCKS[1], True, True)
        before = memory()
        with ExitStack() as shown:
            opened = [shown.enter_context(closing(Window(plugin))).opened_in for plugin in plugins[:windows]]
            more = (memory() - before) / windows
            print(f"{windows} windows: {more / MB:.1f} MB each, opened in {1e3 * np.median(opened):.0f} ms (median)")
            mean, _ = load(plugins[:windows], BLOCKS[1], True, True)
        without, _ = load(plugins[:windows], BLOCKS[1], True, True)
        drawn = (mean - without) / windows
        print(f"in real time, strings moving: one plays for {alone:.1%} of a core; each window draws for {drawn:.1%}")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("count", type=int, nargs="?", default=20)
    parser.add_argument("windows", type=int, nargs="?", default=4)
    given = parser.parse_args()
    if not 1 <= given.windows <= given.count:
        parser.error("1 <= WINDOWS <= COUNT")
    main(given.count, given.windows)
