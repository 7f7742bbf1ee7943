"""Compares the load of playing live by kernels compiled ahead of time and by the same kernels that numba compiles.

    .venv/bin/python tools/ahead_of_time.py --runs 10

Four strings are popped hard and play sixteenths, as in `livebass bench live`; the load is the processor time of the
audio thread over the time played. Each way has a process of its own, as numba reads its settings once; they take turns,
so that all have the same share of a busy machine. numba compiles for a minute first, each time.
"""

from __future__ import annotations

import argparse
import os
import statistics
import subprocess
import sys
import time
from dataclasses import replace
from typing import Any

FROM_SOURCE = {"LIVEBASS_FROM_SOURCE": "1"}
WAYS: dict[str, dict[str, str]] = {  # settings of the environment
    "ahead of time, x86-64-v3": {"LIVEBASS_LEVEL": "x86-64-v3"},
    "ahead of time, x86-64-v2": {"LIVEBASS_LEVEL": "x86-64-v2"},
    "numba, this processor": FROM_SOURCE,
    "numba, x86-64-v3": FROM_SOURCE | {"NUMBA_CPU_NAME": "x86-64-v3", "NUMBA_CPU_FEATURES": ""},
}
BLOCK, SECONDS = 128, 8.0


def play_when_asked() -> None:
    """Plays once for each line of standard input, and prints the load. The library is numba's if it compiles here."""
    from livebass.bench.live import play_script, silence, worst_case
    from livebass.compiling import FROM_SOURCE, library
    from livebass.live.outputs import FakeDevice
    from livebass.live.synth import LiveBass, Synth
    from livebass.model.quality import QUALITIES
    from livebass.preset.load import load_preset

    if FROM_SOURCE:
        library._loaded.append(ByNumba())
    bass = load_preset("jazz-finger")
    script = worst_case(bass, 48000, len(bass.strings), SECONDS)
    synth = Synth(script.rate, adaptive=False)
    synth.switch_to(LiveBass(bass, QUALITIES["live"], script.rate))
    device = FakeDevice(synth)
    play_script(device, replace(script, frames=script.popped), BLOCK)
    print("ready", flush=True)
    for _ in sys.stdin:
        silence(device, BLOCK)
        began = time.thread_time()
        play_script(device, script, BLOCK)
        print((time.thread_time() - began) * script.rate / script.frames, flush=True)


class ByNumba:
    """The library of kernels as numba compiles it in this process, each entry by itself."""

    def __init__(self) -> None:
        self._kept: list[Any] = []

    def address(self, name: str) -> int:
        """The address of an entry."""
        import numba as nb

        from livebass.compiling import ENTRIES

        entry = ENTRIES[name]
        options: dict[str, Any] = {"nopython": True, "error_model": "numpy", "_nrt": False}
        self._kept.append(nb.cfunc(entry.signature, **options)(entry.function))
        return int(self._kept[-1].address)


def main() -> None:
    """Lets all ways play in turns, and prints the median and the least load of each."""
    parser = argparse.ArgumentParser(description="Compares kernels compiled ahead of time with numba's own compile.")
    parser.add_argument("--runs", type=int, default=10, help="default: 10")
    runs = parser.parse_args().runs
    players, loads = {}, {way: [] for way in WAYS}  # type: ignore[var-annotated]
    for way, settings in WAYS.items():
        print(f"{way} ...", file=sys.stderr)
        players[way] = player = subprocess.Popen(
            [sys.executable, __file__, "play"], env=os.environ | settings, text=True,
            stdin=subprocess.PIPE, stdout=subprocess.PIPE,
        )  # fmt: skip
        assert player.stdout
        if player.stdout.readline() != "ready\n":
            sys.exit(f"{way}: cannot play")
    for _ in range(runs):
        for way, player in players.items():
            assert player.stdin and player.stdout
            print("play", file=player.stdin, flush=True)
            loads[way].append(float(player.stdout.readline()))
    for player in players.values():
        player.communicate()
    usual = statistics.median(loads["numba, this processor"])
    print(f"{'':26}{'median':>9}{'least':>9}   (% of a core, {runs} runs)")
    for way, found in loads.items():
        middle = statistics.median(found)
        print(f"{way:26}{100 * middle:8.2f}%{100 * min(found):8.2f}%   {100 * (middle / usual - 1):+.0f} %")


if __name__ == "__main__":
    play_when_asked() if sys.argv[1:] == ["play"] else main()
