"""A host of LV2 plugins: loads one by ctypes, plays a score, works, and keeps states as hosts do."""

from __future__ import annotations

import ctypes as c
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np

from livebass.live.parameters import PARAMETERS
from livebass.rows.arrays import Floats
from livebass.score.score import Score
from support.scores import blocks
from support.structures import struct

CONTROLS = (*(p.symbol for p in PARAMETERS), "freewheeling", "overload")
EXTENSIONS, MIDNAM_URI = "http://lv2plug.in/ns/ext/", "http://ardour.org/lv2/midnam"
ROOM = 1 << 16  # bytes of MIDI per block
U32, I32, P, S = c.c_uint32, c.c_int32, c.c_void_p, c.c_char_p
RESPOND = c.CFUNCTYPE(I32, P, U32, P)
STORE = c.CFUNCTYPE(I32, P, U32, P, c.c_size_t, U32, U32)
RETRIEVE = c.CFUNCTYPE(P, P, U32, c.POINTER(c.c_size_t), c.POINTER(U32), c.POINTER(U32))


FEATURE = struct(uri=S, data=P)
DESCRIPTOR = struct(
    uri=S, instantiate=c.CFUNCTYPE(P, P, c.c_double, S, P), connect=c.CFUNCTYPE(None, P, U32, P),
    activate=c.CFUNCTYPE(None, P), run=c.CFUNCTYPE(None, P, U32), deactivate=c.CFUNCTYPE(None, P),
    cleanup=c.CFUNCTYPE(None, P), extension=c.CFUNCTYPE(P, S),
)  # fmt: skip
WORKER = struct(work=c.CFUNCTYPE(I32, P, RESPOND, P, U32, P), respond=c.CFUNCTYPE(I32, P, U32, P), end=P)
MIDNAM = struct(document=c.CFUNCTYPE(P, P), model=c.CFUNCTYPE(P, P), free=c.CFUNCTYPE(None, P))
STATE = struct(save=c.CFUNCTYPE(I32, P, STORE, P, U32, P), restore=c.CFUNCTYPE(I32, P, RETRIEVE, P, U32, P))


class Plugin:
    """One instance of plugin `index` of a bundle at `rate`. Raises RuntimeError, with its log, if it refuses.

    Its `outputs` are ports 1 and up.
    """

    def __init__(self, bundle: Path, rate: int = 48000, worker: bool = True, index: int = 0, outputs: int = 1) -> None:
        self.outputs = outputs
        self.uris: list[str] = []
        self.logged: list[str] = []
        self.jobs: list[bytes] = []
        self.renamed = 0  # times it reported new key names
        library = c.CDLL(str(bundle / "livebass.so"))
        library.lv2_descriptor.restype = c.POINTER(DESCRIPTOR)
        self.plugin: Any = library.lv2_descriptor(index).contents
        self.calls = [
            c.CFUNCTYPE(U32, P, S)(lambda _, uri: self.number(uri.decode())),
            c.CFUNCTYPE(I32, P, U32, P)(lambda _, size, data: self.jobs.append(c.string_at(data, size)) or 0),
            c.CFUNCTYPE(I32, P, U32, S, S)(
                lambda _, kind, form, line: self.logged.append(line.decode(errors="replace")) or 0
            ),
            c.CFUNCTYPE(None, P)(lambda _: self.rename()),
        ]
        names = [f"{EXTENSIONS}{name}" for name in ("urid#map", *(["worker#schedule"] if worker else []), "log#log")]
        names.append(f"{MIDNAM_URI}#update")
        tables = [(P * 2)(None, c.cast(call, P)) for call in self.calls]
        if not worker:
            del tables[1]
        given = [FEATURE(name.encode(), c.addressof(table)) for name, table in zip(names, tables, strict=True)]
        self.kept = given, tables, (list_ := (P * (len(given) + 1))(*map(c.addressof, given)))
        self.handle = self.plugin.instantiate(c.addressof(self.plugin), rate, f"{bundle}/".encode(), list_)
        if not self.handle:
            raise RuntimeError("; ".join(self.logged))
        self.midi, self.controls = c.create_string_buffer(ROOM), {name: c.c_float() for name in CONTROLS}
        self.plugin.connect(self.handle, 0, c.addressof(self.midi))
        for k, control in enumerate(self.controls.values(), 1 + outputs):
            self.plugin.connect(self.handle, k, c.addressof(control))
        self.controls["bass"].value = self.controls["relief"].value = 0.0  # tests do not run in real time
        self.plugin.activate(self.handle)

    def number(self, uri: str) -> int:
        if uri not in self.uris:
            self.uris.append(uri)
        return self.uris.index(uri) + 1

    def extension(self, name: str, kind: Any) -> Any:
        return kind.from_address(self.plugin.extension(f"{EXTENSIONS}{name}#interface".encode()))

    def rename(self) -> None:
        self.renamed += 1

    def midnam(self, what: str = "document") -> str:
        """The document with the names of its keys, or the "model" name in it."""
        names = MIDNAM.from_address(self.plugin.extension(f"{MIDNAM_URI}#interface".encode()))
        place = getattr(names, what)(self.handle)
        text = c.string_at(place).decode()
        names.free(place)
        return text

    def block(self, frames: int, messages: Iterable[tuple[int, bytes]] = ()) -> Floats:
        """Plays a block with `messages`, (frame in it, bytes): (frames,), or (outputs, frames) for several outputs."""
        outs = self._run([(frame, MIDI, message) for frame, message in messages], frames)
        return outs if self.outputs > 1 else outs[0]

    def _run(self, atoms: Iterable[tuple[int, str, bytes]], frames: int) -> Floats:
        """Plays a block with atoms, (frame in it, type, body): (outputs, frames)."""
        events = b""
        for frame, uri, body in atoms:
            head = np.array([frame], np.int64).tobytes() + np.array([len(body), self.number(uri)], "u4").tobytes()
            events += head + body.ljust((len(body) + 7) // 8 * 8, b"\0")
        sequence = np.array([8 + len(events), self.number("sequence"), 0, 0], "u4").tobytes() + events
        c.memmove(self.midi, sequence, len(sequence))
        outs = np.full((self.outputs, frames), np.nan, np.float32)
        for k, out in enumerate(outs, 1):
            self.plugin.connect(self.handle, k, out.ctypes.data)
        self.plugin.run(self.handle, frames)
        return outs

    def send(self, atoms: Iterable[tuple[str, bytes]], frames: int = 64) -> list[tuple[str, bytes]]:
        """Plays a block with a window's atoms, (type, body); returns those sent back to a window."""
        room = c.create_string_buffer(1 << 17)
        c.memmove(room, np.array([len(room) - 8, 0], "u4").tobytes(), 8)
        look = 1 + self.outputs + len(CONTROLS)
        self.plugin.connect(self.handle, look, c.addressof(room))
        self._run([(0, uri, body) for uri, body in atoms], frames)
        self.plugin.connect(self.handle, look, None)
        found, at, end = [], 16, 8 + int(np.frombuffer(room, "u4", 1)[0])
        while at < end:
            size, kind = (int(n) for n in np.frombuffer(room, "u4", 2, at + 8))
            found.append((self.uris[kind - 1], room.raw[at + 16 : at + 16 + size]))
            at += 16 + (size + 7) // 8 * 8
        return found

    def work(self) -> None:
        """Does the waiting jobs."""
        while self.jobs:
            job = self.jobs.pop(0)
            self.extension("worker", WORKER).work(self.handle, RESPOND(lambda *_: 0), None, len(job), job)

    def play(self, score: Score, frames: int, sizes: Iterable[int] = (512,), start: int = 0) -> Floats:
        """Plays `frames` of a score from `start` on in blocks of `sizes`, in turn; the last block is whole."""
        out = []
        for begin, size in blocks(frames, sizes, start):
            first, until = np.searchsorted(score.frames, (begin, begin + size))
            messages = [(int(score.frames[k]) - begin, score.messages[k].tobytes()) for k in range(first, until)]
            out.append(self.block(size, messages))
        return np.concatenate(out, axis=-1)[..., :frames]

    def save(self) -> dict[int, tuple[bytes, int]]:
        """Its state: (value, type) by key."""
        found: dict[int, tuple[bytes, int]] = {}
        store = STORE(
            lambda _, key, value, size, kind, flags: found.update({key: (c.string_at(value, size), kind)}) or 0
        )
        assert self.extension("state", STATE).save(self.handle, store, None, 0, None) == 0
        return found

    def restore(self, state: dict[int, tuple[bytes, int]]) -> int:
        held = {key: (c.create_string_buffer(value, len(value)), kind) for key, (value, kind) in state.items()}

        def get(_: Any, key: int, size: Any, kind: Any, flags: Any) -> int | None:
            if key not in held:
                return None
            value, kind[0] = held[key]
            size[0] = len(value)
            return c.addressof(value)

        return int(self.extension("state", STATE).restore(self.handle, RETRIEVE(get), None, 0, None))

    def close(self) -> None:
        self.plugin.deactivate(self.handle)
        self.plugin.cleanup(self.handle)


MIDI = "http://lv2plug.in/ns/ext/midi#MidiEvent"
