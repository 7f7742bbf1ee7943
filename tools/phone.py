"""Plays four hard strings on the page's audio thread, in node, as on a phone of 2020: a third as fast as this machine.

    .venv/bin/python tools/phone.py jazz-finger slap

For each bass it plays four seconds of chords at full velocity, twice a second: struck at once, then string after
string. The thread's clock is the processor time of this process, times --slower (3); so other programs on the machine
hardly matter. It plays several times, and each quantum of 128 frames counts with the least time: node, too, compiles
and cleans up. It prints the mean load; the worst quantum, relative to its duration, and when it began; the largest
backlog, which the device's output buffer must cover, and when it grew; and the part of the time in which the last run
relieved strings (worklet.js). With --fine no string is ever relieved; with --known the thread knows from the start that
it is slow.
"""

from __future__ import annotations

import argparse
import subprocess
import tempfile
from pathlib import Path

from livebass import load_preset
from livebass.plugin.instrument import image_file
from livebass.web import build
from livebass.web.modules import join_modules

RATE, QUANTUM, SECONDS = 48000, 128, 4
PLAYING = """
const fs = require("fs"), SLOWER = Number(process.argv[2]), how = process.argv[3];
const module_ = new WebAssembly.Module(fs.readFileSync("page.wasm"));
const cpu = () => { const {user, system} = process.cpuUsage(); return SLOWER * (user + system) / 1000; };
global.sampleRate = %(rate)d;
global.currentFrame = 0;
const OVERLOAD = 2; // a load, as in worklet.js
global.AudioWorkletProcessor = class { constructor() { this.port = {postMessage() {}}; } };
let Processor;
global.registerProcessor = (_, of) => { Processor = of; };
Date.now = () => Math.floor(cpu());
const {Engine, pieces} = require("./engine.cjs");
require("./worklet.cjs");

// Plays once; returns the time of each quantum (ms), and whether strings were relieved after it.
function play(file) {
  const maker = new Engine(module_), bass = maker.build(file, 0, sampleRate, maker.home);
  const size = pieces(maker.end - maker.home);
  maker.reserve(maker.home + size);
  currentFrame = 0;
  const packed = maker.pack(maker.home, maker.home + size), p = new Processor({processorOptions: {module: module_}});
  p.hear({bass: {bass, at: maker.home, size, ...packed}});
  p.engine.setField("adaptive", how === "fine" ? 0 : 1);
  if (how === "known") p.highest = OVERLOAD;
  const notes = [];
  for (let k = 0; k < 2 * %(seconds)d; k++) [28, 33, 38, 43].forEach((key, i) => {
    const at = Math.round(sampleRate * (0.05 + 0.5 * k + (k %% 2 ? 0.06 * i : 0))), note = key + k %% 3;
    notes.push([at, 0x90, note, 127], [at + Math.round(0.42 * sampleRate), 0x80, note, 64]);
  });
  notes.sort((a, b) => a[0] - b[0]);
  const times = [], relieved = [];
  for (; currentFrame < %(seconds)d * sampleRate; currentFrame += %(quantum)d) {
    for (; notes.length && notes[0][0] < currentFrame + %(quantum)d; notes.shift())
      p.hear({midi: notes[0].slice(1), frame: notes[0][0]});
    const out = new Float32Array(%(quantum)d), began = cpu();
    p.process([], [[out]]);
    times.push(cpu() - began);
    relieved.push(p.engine.field("overload") > 0);
  }
  return {times, relieved};
}

for (const name of process.argv.slice(4)) {
  const data = fs.readFileSync(name), file = data.buffer.slice(data.byteOffset, data.byteOffset + data.byteLength);
  for (let k = 0; k < 4; k++) play(file); // node compiles busy code better
  const runs = Array.from({length: 8}, () => play(file)), {relieved} = runs.at(-1);
  const times = relieved.map((_, q) => Math.min(...runs.map(run => run.times[q])));
  const full = 1000 * %(quantum)d / sampleRate;
  let owed = 0, most = 0, first = 0, from = 0, until = 0;
  times.forEach((time, q) => {
    if (owed === 0) first = q;
    owed = Math.max(0, owed + time - full);
    if (owed > most) [most, from, until] = [owed, first, q + 1];
  });
  const percent = x => `${Math.round(100 * x)} %%`, mean = x => x.reduce((a, b) => a + b, 0) / x.length;
  const worst = Math.max(...times), at = q => `${(q * full / 1000).toFixed(3)} s`;
  console.log(`${name}: load ${percent(mean(times) / full)}, worst quantum ${percent(worst / full)} at ` +
    `${at(times.indexOf(worst))}, backlog ${most.toFixed(1)} ms from ${at(from)} to ${at(until)}, ` +
    `relieved ${percent(mean(relieved.map(Number)))} of the time`);
}
"""


def main() -> None:
    """Runs node on the page's own modules."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--slower", type=float, default=3.0)
    known = parser.add_mutually_exclusive_group()
    known.add_argument("--fine", action="store_const", dest="how", const="fine", default="relieved")
    known.add_argument("--known", action="store_const", dest="how", const="known")
    parser.add_argument("presets", nargs="+")
    requested = parser.parse_args()
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place)
        (folder / "page.wasm").write_bytes(build.module())
        (folder / "engine.cjs").write_text(f"module.exports = {join_modules('engine.js')}")
        (folder / "worklet.cjs").write_text(join_modules("worklet.js"))
        (folder / "play.cjs").write_text(PLAYING % {"rate": RATE, "quantum": QUANTUM, "seconds": SECONDS})
        for preset in requested.presets:
            (folder / preset).write_bytes(image_file(load_preset(preset)))
        command = ["node", "--single-threaded", "play.cjs", str(requested.slower), requested.how, *requested.presets]
        subprocess.run(command, cwd=folder, check=True)


if __name__ == "__main__":
    main()
