"""The page's WebAssembly module without a browser: in wasmtime, with the records used by engine.js."""

from __future__ import annotations

import functools
import hashlib
import json
from typing import Any

import numpy as np
import wasmtime

from livebass.compiling import Entry
from livebass.kernels.bass.change import CHANGE
from livebass.kernels.bass.check import GOOD
from livebass.kernels.bass.instrument import COARSE, LIVE
from livebass.kernels.bass.pool import POOL
from livebass.kernels.bass.setup import BUILDING
from livebass.kernels.string.preparing import DONE
from livebass.live.thread.records import SYNTH
from livebass.rows.arrays import Floats
from livebass.web import build
from livebass.web.layout import CALLED
from support.places import TESTS

RATE = 48000
# The score of the pinned sound: hard notes on all strings
HARD = [(0.06 * k, 0.25, 28 + 5 * (k % 4) + 5 * (k // 4) % 12, 127 - 5 * k) for k in range(12)]
PINS = TESTS / "unit" / "web" / "pinned.json"
PINNED = json.loads(PINS.read_text())  # by preset: length (s), hash of the tests' own bass, and of the shipped one
QUANTUM, MESSAGES, LINE, PAGE = 128, 4096, 64, 65536


@functools.cache
def compiled_module() -> tuple[Any, Any]:
    """wasmtime's engine, and the module compiled for it."""
    engine = wasmtime.Engine()
    return engine, wasmtime.Module(engine, build.module())


class Bare:
    """The module without a bass."""

    def __init__(self) -> None:
        engine, module = compiled_module()
        self.store = wasmtime.Store(engine)
        self.x = wasmtime.Instance(self.store, module, []).exports(self.store)
        self.end = int(self.x["__heap_base"].value(self.store))

    def call(self, name: Entry | str, *arguments: float) -> Any:
        return self.x[f"lb_{name}"](self.store, *arguments)

    def place(self, size: int) -> int:
        """The address of new memory, zeros."""
        at = -(-self.end // LINE) * LINE
        self.end = at + size
        memory = self.x["memory"]
        missing = self.end - memory.data_len(self.store)
        if missing > 0:
            memory.grow(self.store, -(-missing // PAGE))
        return at

    def bytes(self, at: int, size: int) -> np.ndarray:
        """A view of the memory, valid until more is made."""
        memory = self.x["memory"]
        whole = np.ctypeslib.as_array(memory.data_ptr(self.store), (memory.data_len(self.store),))
        return whole[at : at + size]

    def record(self, of: np.dtype[np.void], at: int) -> Any:
        return self.bytes(at, of.itemsize).view(of)[0]

    def set(self, of: np.dtype[np.void], at: int, **values: float) -> None:
        for name, value in values.items():
            self.record(of, at)[name] = value

    def changed(self, file: bytes, values: list[float]) -> bytes | int:
        """The image of a bass changed by its sliders, as in engine.js, or the status of the failure."""
        place = self.place(len(file))
        self.bytes(place, len(file))[:] = np.frombuffer(file, np.uint8)
        at = self.place(CHANGE.itemsize)
        self.set(CHANGE, at, file=place, size=len(file))
        self.record(CHANGE, at)["value"][:] = values
        assert self.call("measure_change", at) == GOOD
        self.set(CHANGE, at, memory=self.place(int(self.record(CHANGE, at)["bytes"])))
        if state := self.call("make_change", at):
            return int(state)
        change = self.record(CHANGE, at)
        return bytes(self.bytes(int(change["made"]), 8 * int(change["words"])))


class Module(Bare):
    """A synth with one bass, from its instrument file, at `rate`."""

    def __init__(
        self, file: bytes, rate: int = 48000, tier: int = LIVE, adaptive: bool = False, response: Floats | None = None,
        reports: int = 0,
    ) -> None:  # fmt: skip
        super().__init__()
        table = self.x["__indirect_function_table"]
        numbers = {e.name: table.grow(self.store, 1, self.x[f"lb_{e.name}"]) for e in CALLED}
        self.file = self.place(len(file))
        self.bytes(self.file, len(file))[:] = np.frombuffer(file, np.uint8)
        assert self.call("check_file", self.file, len(file)) == GOOD
        building = self.building = self.place(BUILDING.itemsize)
        self.pools = []
        for k, which in enumerate((tier, COARSE)):
            pool = self.place(POOL.itemsize)
            self.pools.append(pool)
            self.set(POOL, pool, file=self.file, tier=which, rate=rate)
            self.call("measure_pool", pool)
            self.set(POOL, pool, memory=self.place(int(self.record(POOL, pool)["bytes"])))
            assert self.call("fill_pool", pool) == DONE
            self.record(BUILDING, building)["operators"][k] = self.record(POOL, pool)["memory"]
        called = {name: numbers[name] for name in ("over_frets", "over_board", "play_string")}
        self.set(BUILDING, building, file=self.file, tier=tier, rate=rate, report_room=reports, **called)
        if response is not None:
            place = self.place(response.nbytes)
            self.bytes(place, response.nbytes)[:] = response.view(np.uint8)
            self.set(BUILDING, building, response=place, response_count=len(response), response_rate=rate)
        self.bass = self.new_bass()
        self.synth, self.sound = self.place(SYNTH.itemsize), self.place(4 * QUANTUM)
        rings = self.place(self.call("ring_bytes", MESSAGES))
        self.call("fill_synth", self.synth, rings, MESSAGES, float(rate), -1, 1.0, numbers["process"])
        self.set(SYNTH, self.synth, next_bass=self.bass, adaptive=adaptive)

    def new_bass(self) -> int:
        """The address of a fresh bass."""
        self.call("measure_bass", self.building)
        bass = self.place(int(self.record(BUILDING, self.building)["bytes"]))
        self.set(BUILDING, self.building, memory=bass)
        self.call("fill_bass", self.building)
        return bass

    def field(self, name: str) -> Any:
        return self.record(SYNTH, self.synth)[name]

    def send(self, frame: int, status: int, first: int, second: int) -> None:
        rings = int(self.field("midi_ring")[0])
        assert self.call("push_message", rings, MESSAGES, frame, status, first, second)

    def play(self, n: int) -> Floats:
        """The next n frames, in whole quanta, float32."""
        out = np.empty(n, np.float32)
        for k in range(0, n, QUANTUM):
            self.call("process", self.synth, self.sound, QUANTUM)
            out[k : k + QUANTUM] = self.bytes(self.sound, 4 * QUANTUM).view(np.float32)
        return out


def sound_hash(sound: Floats) -> str:
    return hashlib.sha256(sound.astype("<f4").tobytes()).hexdigest()[:16]
