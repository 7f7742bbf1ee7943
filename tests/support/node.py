"""The page's modules in node, without a browser: its benches, worker and audio thread, and others with the kernels."""

from __future__ import annotations

import base64
import json
import subprocess
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from livebass.model.instrument import Instrument
from livebass.rows.arrays import Floats
from livebass.score.score import Score
from livebass.web import build
from livebass.web.export import page_files
from livebass.web.modules import NONE, join_modules
from support.messages import messages_of
from support.needs import tool
from support.wasm import QUANTUM

# Carries out scripts, one a line, and answers each in a line
SERVE = """
globalThis.require = require;
const lines = require("readline").createInterface({input: process.stdin});
const asynchronous = (async () => {}).constructor;
lines.on("line", async line => {
  const {script, given} = JSON.parse(line), begun = asynchronous(script).apply(null, given);
  const answer = await begun.then(value => ({value}), error => ({error: error.message}));
  process.stdout.write(JSON.stringify(answer) + "\\n");
});
"""
# What the page's worker and audio thread find in a browser
THREADS = """
globalThis.answers = [];
globalThis.postMessage = message => answers.push(message);
globalThis.onmessage = undefined;
globalThis.currentFrame = 0;
globalThis.AudioWorkletProcessor = class { constructor() { this.port = {postMessage() {}}; } };
globalThis.registerProcessor = (_, of) => { globalThis.Processor = of; };
"""
# The benches of the page's basses, and what its worker makes of them. In `base64` bytes go to Python
PAGE = """
const [page, files, wasm] = arguments;
Object.assign(globalThis, tested);
globalThis.benches = new Map();
for (const bass of page.basses) if (bass.bench) benches.set(bass.name, new Bench(bass, page));
globalThis.base64 = bytes => Buffer.from(bytes).toString("base64");
globalThis.module = new WebAssembly.Module(require("fs").readFileSync(wasm));
globalThis.ask = message => {
  onmessage({data: {id: 0, ...message}});
  const {built, error} = answers.pop();
  if (error) throw new Error(error);
  return built;
};
ask({module});
globalThis.changed = (name, values) => {
  const bench = benches.get(name), file = Uint8Array.from(Buffer.from(files[name], "base64")).buffer;
  bench.slots = {A: {}, B: {}};
  bench.setAll(values);
  return ask({change: bench.moved(), file, neck: bench.bass});
};
globalThis.fileOf = (name, values) => changed(name, values).file;
globalThis.build = (name, values, rate) => {
  const built = ask({name, file: fileOf(name, values), tier: page.tier, rate});
  onmessage({data: {free: built.bass}});
  return built;
};
globalThis.play = (name, values, score, frames, rate) => {
  globalThis.sampleRate = rate;
  const thread = new Processor({processorOptions: {module, bass: build(name, values, rate), score}});
  const sound = new Float32Array(frames);
  for (let at = 0; at < frames; at += 128) thread.process([], [[sound.subarray(at, at + 128)]]);
  return sound;
};
"""


class Node:
    """A process of node whose scripts know the exports of a page's module."""

    def __init__(self, process: subprocess.Popen[str]) -> None:
        self.process = process

    def run(self, script: str, *given: Any) -> Any:
        """Returns the value of a function's body, which may wait, for `arguments`. Raises ValueError if it throws."""
        assert self.process.stdin and self.process.stdout
        self.process.stdin.write(json.dumps({"script": script, "given": given}) + "\n")
        self.process.stdin.flush()
        answer = json.loads(self.process.stdout.readline())
        if "error" in answer:
            raise ValueError(answer["error"])
        return answer.get("value")


@contextmanager
def node(entry: str, more: Mapping[str, str] = NONE) -> Iterator[Node]:
    """Runs a module of the page, with `more` as for `join_modules`; its exports are global. Skips without node."""
    with subprocess.Popen(
        [tool("node"), "-e", SERVE], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, encoding="utf-8"
    ) as process:
        try:
            found = Node(process)
            found.run(f"{THREADS}const made = {join_modules(entry, more)}Object.assign(globalThis, made);")
            yield found
        finally:
            process.kill()


class Page(Node):
    """A page with these basses: its benches, and the sound of its audio thread."""

    def made(self, name: str, values: Mapping[str, float]) -> tuple[str, bytes]:
        """The saved preset of a bass with these values, and its instrument file. Raises ValueError if there is none."""
        toml, file = self.run(
            "const [name, values] = arguments, file = fileOf(name, values);"
            "return [benches.get(name).toml(), base64(file)]", name, values,
        )  # fmt: skip
        return toml, base64.b64decode(file)

    def rests(self, name: str, values: Mapping[str, float]) -> list[dict[str, int]]:
        """For each string of a bass with these values, the frets at which it frets out, and the one it lies on."""
        return list(self.run("return changed(...arguments).rests", name, values))

    def toml(self, name: str, values: Mapping[str, float]) -> str:
        """The saved preset of a bass with these values."""
        script = (
            "const [name, values] = arguments, bench = benches.get(name); bench.setAll(values); return bench.toml()"
        )
        return str(self.run(script, name, values))

    def sound(self, name: str, values: Mapping[str, float], score: Score, frames: int) -> Floats:
        """What the audio thread plays of a score, in whole quanta."""
        whole = frames // QUANTUM * QUANTUM
        script = "return base64(new Uint8Array(play(...arguments).buffer))"
        found = self.run(script, name, values, messages_of(score), whole, score.rate)
        return np.frombuffer(base64.b64decode(found), np.float32)


# A module that exports what tests ask of the page's
TESTED = """import {Bench} from "./bench.js";
import "./worker.js";
import "./worklet.js";
export const tested = {Bench};
"""


@contextmanager
def page(basses: Mapping[str, Instrument], folder: Path) -> Iterator[Page]:
    """A page of `basses` in node; `folder` holds its kernels."""
    files = page_files(dict(basses), "live")
    data = json.loads(files["index.html"].decode().split('id="page">')[1].split("</script>")[0])
    images = {name: base64.b64encode(files[f"basses/{name}.lbass"]).decode() for name in basses}
    wasm = folder / "kernels.wasm"
    wasm.write_bytes(build.module())
    with node("tested.js", {"tested.js": TESTED}) as found:
        found.run(PAGE, data, images, str(wasm))
        yield Page(found.process)


RUN = """
const [bytes, ...given] = arguments, module = new WebAssembly.Module(Buffer.from(bytes, "base64"));
return run(() => new WebAssembly.Instance(module), ...given);
"""


def run(source: str, *arguments: Any) -> Any:
    """Returns the result of `run` in the module `source` for a function that makes an instance of the kernels.

    `run` gets that function and `arguments`. The module may import the page's modules. Arguments and result are JSON.
    Skips the test without node.
    """
    with node("test.js", {"test.js": source}) as found:
        return found.run(RUN, base64.b64encode(build.module()).decode(), *arguments)
