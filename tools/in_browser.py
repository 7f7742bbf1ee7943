"""Measures the page in headless Chromium: its work compared with the native engine's, and underruns in hard chords.

    LIVEBASS_LEVEL=x86-64-v2 .venv/bin/python tools/in_browser.py jazz-finger slap
    .venv/bin/python tools/in_browser.py --play 60 jazz-finger fretless
    .venv/bin/python tools/in_browser.py --play 60 --line --runs 5 slap

With --runs N it plays N times with pictures and N times without, in turn, and prints the medians of both.

Work is in seconds per second of sound, for eight seconds of chords in quanta of 128 frames; each quantum counts with
the fastest of six runs. The native engine is timed by the thread's clock, the browser's worker by the wall clock.
"""

from __future__ import annotations

import argparse
import functools
import http.server
import os
import shutil
import sys
import tempfile
import threading
import time
from pathlib import Path
from typing import Any

import numpy as np
from selenium import webdriver

from livebass import QUALITIES, load_preset
from livebass.live.synth import LiveBass, Synth
from livebass.live.thread import block
from livebass.web.export import export_page
from livebass.web.modules import join_modules

RATE, SECONDS, QUANTUM, RUNS = 48000, 8, 128, 6
CHORDS = [(28, 35, 40, 47), (31, 38, 43, 50)]
MIN_PEAK = 1e-2  # of full scale; anything quieter did not play
KEEP = 1.2  # s, length of a chord
MESSAGES = sorted(
    (round(RATE * (2 * k + 0.01 * i + KEEP * off)), 0x80 if off else 0x90, key, 0 if off else 125 if k % 2 else 80)
    for k in range(SECONDS // 2)
    for i, key in enumerate(CHORDS[k % 2])
    for off in (0, 1)
)
WORKER = """
import {Engine} from "./engine.js";

onmessage = ({data: o}) => {
  const runs = [];
  for (let r = 0; r < o.runs; r++) {
    const engine = new Engine(o.module), times = [];
    const {bass} = engine.build(o.file, o.tier, o.rate, engine.home);
    engine.begin(o.rate);
    engine.setField("next_bass", bass);
    for (const message of o.messages) engine.send(...message);
    for (let k = 0; k < o.quanta; k++) {
      const began = performance.now();
      engine.play(o.quantum);
      times.push(performance.now() - began);
    }
    runs.push(times);
  }
  postMessage(runs);
};
"""
MEASURE = """
const [name, given, source, done] = arguments;
(async () => {
  while (!player.ready) await new Promise(later => setTimeout(later, 20));
  const worker = new Worker(URL.createObjectURL(new Blob([source], {type: "text/javascript"})));
  worker.onmessage = e => done(e.data);
  worker.postMessage({...given, module: player.module, tier: PAGE.tier, file: await read(`basses/${name}.lbass`)});
})();
"""
PLAY = """
const [name, seconds, strings, line, drawn, done] = arguments;
chooseBass(name);
const underruns = () => player.context.playbackStats?.underrunEvents;
let shown = 0;
const draw = pictures.drawNeck;
pictures.drawNeck = (...all) => { shown++; draw.apply(pictures, all); };
if (!drawn) pictures.draw = () => {};
player.sound().then(() => new Promise(later => setTimeout(later, 2000))).then(() => {
  const loads = [];
  if (!drawn) player.see(false);
  shown = 0;
  const before = underruns();
  let most = 0, peak = 0;
  player.on("report", told => {
    loads.push(told.load);
    most = Math.max(most, told.overload);
    peak = Math.max(peak, told.peak);
  });
  const play = (key, late, long) => {
    player.send(performance.now() + late, [0x90, key, 125]);
    setTimeout(() => player.send(performance.now(), [0x80, key, 0]), long + late);
  };
  let beats = 0;
  const chord = line ? () => play([28, 40][beats++ % 2], 0, 120)
    : () => [31, 38, 43, 50].slice(0, strings).forEach((key, k) => play(key, 10 * k, 1200));
  chord();
  const chords = setInterval(chord, line ? 150 : 1500);
  setTimeout(() => clearInterval(chords), 1000 * seconds - 100);
  let first, last; // underruns by the second chord, and by the time that the last one has decayed
  setTimeout(() => { first = underruns(); }, 1500);
  setTimeout(() => { last = underruns(); }, 1000 * seconds + 1500);
  setTimeout(() => {
    const end = underruns(), pictures = shown / (seconds + 4.5);
    done({loads, most, peak, pictures, first: first - before, then: last - first, after: end - last});
  }, 1000 * seconds + 4500);
});
"""


class Isolated(http.server.SimpleHTTPRequestHandler):
    """Serves files with headers that give them fine clocks in browsers."""

    def end_headers(self) -> None:
        self.send_header("Cross-Origin-Opener-Policy", "same-origin")
        self.send_header("Cross-Origin-Embedder-Policy", "require-corp")
        super().end_headers()

    def log_message(self, *_: Any) -> None:
        pass


def native(preset: str) -> float:
    """Measures the native engine's work."""
    sound, runs = np.zeros(QUANTUM, np.float32), []
    for _ in range(RUNS):
        synth = Synth(RATE)
        synth.switch_to(LiveBass(load_preset(preset), QUALITIES["live"], RATE))
        synth.record["clock"] = 0  # neither running ahead nor relief
        for frame, status, first, second in MESSAGES:
            assert synth.send(status, first, second, frame)
        times = []
        for _ in range(RATE * SECONDS // QUANTUM):
            began = time.thread_time_ns()
            block.process(synth.address, sound.ctypes.data, QUANTUM)
            times.append(time.thread_time_ns() - began)
        runs.append(times)
    return float(np.min(runs, axis=0).sum() * 1e-9 / SECONDS)


def open_page(driver: Any, address: str) -> None:
    """Opens the page and makes its modules' exports global (static/pages/inside.js)."""
    driver.get(address)
    driver.execute_script("dispatchEvent(new CustomEvent('livebass', {detail: all => Object.assign(globalThis, all)}))")


def in_browser(driver: Any, preset: str) -> float:
    """Measures the browser's work."""
    given = {
        "messages": MESSAGES, "rate": RATE, "runs": RUNS, "quantum": QUANTUM, "quanta": RATE * SECONDS // QUANTUM,
    }  # fmt: skip
    runs = driver.execute_async_script(MEASURE, preset, given, join_modules("work.js", {"work.js": WORKER}))
    return float(np.min(runs, axis=0).sum() * 1e-3 / SECONDS)


def played(driver: Any, preset: str, given: argparse.Namespace, drawn: bool = True) -> dict[str, Any]:
    """Plays on the open page once it is warm; returns what it measured."""
    time.sleep(2)
    found: dict[str, Any] = driver.execute_async_script(PLAY, preset, given.play, given.strings, given.line, drawn)
    if found["peak"] < MIN_PEAK:
        sys.exit(f"{preset}: silent: a peak of {found['peak']:.1e}")
    return found


def compare(driver: Any, preset: str, given: argparse.Namespace) -> None:
    """Plays with pictures and without in turn; prints each run, and the medians."""
    address, underruns = driver.current_url, dict[bool, list[int]]({True: [], False: []})
    for _ in range(given.runs):
        for drawn in underruns:
            open_page(driver, address)
            found = played(driver, preset, given, drawn)
            underruns[drawn].append(found["first"] + found["then"] + found["after"])
            print(
                f"{preset}, {'with' if drawn else 'without'} pictures: {underruns[drawn][-1]} underruns,"
                f" {found['pictures']:.0f} pictures a second, load mean {np.mean(found['loads']):.3f},"
                f" machine {os.getloadavg()[0]:.1f}",
                flush=True,
            )
    with_, without = (f"{np.median(underruns[drawn]):g}" for drawn in (True, False))
    print(f"{preset}: median of {given.runs}: {with_} underruns with pictures, {without} without")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("presets", nargs="+", metavar="PRESET")
    parser.add_argument("--play", type=float, metavar="SECONDS", help="play hard chords in real time instead")
    parser.add_argument("--strings", type=int, default=4, metavar="N", help="of the chords that --play plays")
    parser.add_argument("--line", action="store_true", help="--play plays a line of single notes instead of chords")
    parser.add_argument("--runs", type=int, metavar="N", help="of --play with pictures, and as many without")
    given = parser.parse_args()
    options = webdriver.ChromeOptions()
    for option in ("headless=new", "no-sandbox", "disable-gpu", "autoplay-policy=no-user-gesture-required"):
        options.add_argument(f"--{option}")
    with tempfile.TemporaryDirectory() as folder:
        page = export_page({name: load_preset(name) for name in given.presets}, Path(folder), single=True)
        server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), functools.partial(Isolated, directory=folder))
        threading.Thread(target=server.serve_forever, daemon=True).start()
        driver: Any = webdriver.Chrome(options, webdriver.ChromeService(shutil.which("chromedriver")))
        try:
            driver.set_script_timeout(600)
            for preset in given.presets:
                open_page(driver, f"http://127.0.0.1:{server.server_port}/{page.name}")
                if given.play and given.runs:
                    compare(driver, preset, given)
                elif given.play:
                    found = played(driver, preset, given)
                    loads = np.array(found["loads"])
                    print(
                        f"{preset}: load mean {loads.mean():.3f}, worst {loads.max():.2f}; {found['maximum']} strings"
                        f" relieved at most; underruns: {found['first']} in the first chord, {found['then']} in the"
                        f" others, {found['after']} in 3 s after they have decayed"
                    )
                else:
                    here, there = native(preset), in_browser(driver, preset)
                    print(f"{preset}: native {here:.4f}, browser {there:.4f}: {there / here:.2f} times")
        finally:
            driver.quit()
            server.shutdown()


if __name__ == "__main__":
    main()
