"""A host of CLAP plugins: loads one by ctypes, plays scores and events into it, and serves its requests."""

from __future__ import annotations

import ctypes as c
import subprocess
import time
from collections.abc import Iterable, Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np

from livebass.plugin import build
from livebass.plugin.systems import this_system
from livebass.rows.arrays import Floats
from livebass.score.score import Score
from support.scores import blocks
from support.structures import function, struct

MONO, STRINGS = "org.livebass.bass", "org.livebass.strings"
RELIEF = 11  # a parameter
NOTE_ON, NOTE_OFF, NOTE_CHOKE, EXPRESSION, VALUE, MIDI = 0, 1, 2, 4, 5, 10
TUNING, EXPRESSION_VIBRATO, BRIGHTNESS, PRESSURE = 2, 3, 5, 6
CONTINUE, SLEEP = 1, 4
PRESETS_IN_FILES, PRESETS_OF_PLUGIN = 0, 1
NO_ID = 0xFFFFFFFF
U16, U32, U64, I16, I32, I64, D, B = (
    c.c_uint16, c.c_uint32, c.c_uint64, c.c_int16, c.c_int32, c.c_int64, c.c_double, c.c_bool,
)  # fmt: skip
P, S = c.c_void_p, c.c_char_p


def counting_host(folder: Path) -> Path:
    """Compiles claphost.c, which counts allocations and locks, into `folder`; returns the program."""
    host, source = folder / "claphost", Path(__file__).parent / "claphost.c"
    command = [*build.compiler(this_system()), "-O1", "-rdynamic", "-DCOUNT", f"-I{build.C}", source, "-o", host, "-lm"]
    subprocess.run([*command, "-ldl", "-lpthread"], check=True)
    return host


VERSION = U32 * 3
HEAD: dict[str, Any] = {"size": U32, "time": U32, "space": U16, "type": U16, "flags": U32}
NOTE = struct(**HEAD, id=I32, port=I16, channel=I16, key=I16, velocity=D)
NOTE_EXPRESSION = struct(**HEAD, expression=I32, id=I32, port=I16, channel=I16, key=I16, value=D)
PARAM_VALUE = struct(**HEAD, param=U32, cookie=P, id=I32, port=I16, channel=I16, key=I16, value=D)
GESTURE = struct(**HEAD, param=U32)
MIDI_EVENT = struct(**HEAD, port=U16, data=c.c_uint8 * 3)
IN_EVENTS = struct(data=P, size=function(U32, P), get=function(P, P, U32))
OUT_EVENTS = struct(data=P, push=function(B, P, P))
BUFFER = struct(data32=P, data64=P, channels=U32, latency=U32, constant=U64)
PROCESS = struct(
    steady=I64, frames=U32, transport=P, inputs=P, outputs=P, input_count=U32, output_count=U32, in_events=P,
    out_events=P,
)  # fmt: skip
DESCRIPTOR = struct(
    version=VERSION, id=S, name=S, vendor=S, url=S, manual=S, support=S, release=S, description=S,
    features=c.POINTER(S),
)  # fmt: skip
PLUGIN = struct(
    descriptor=c.POINTER(DESCRIPTOR), data=P, init=function(B, P), destroy=function(None, P),
    activate=function(B, P, D, U32, U32), deactivate=function(None, P), start=function(B, P), stop=function(None, P),
    reset=function(None, P), process=function(I32, P, P), extension=function(P, P, S),
    on_main_thread=function(None, P),
)  # fmt: skip
HOST = struct(
    version=VERSION, data=P, name=S, vendor=S, url=S, release=S, extension=function(P, P, S),
    restart=function(None, P), process=function(None, P), callback=function(None, P),
)  # fmt: skip
ENTRY = struct(version=VERSION, init=function(B, S), deinit=function(None), factory=function(P, S))
FACTORY = struct(
    count=function(U32, P), descriptor=function(c.POINTER(DESCRIPTOR), P, U32), create=function(P, P, P, S),
)  # fmt: skip
PARAM_INFO = struct(
    id=U32, flags=U32, cookie=P, name=c.c_char * 256, module=c.c_char * 1024, minimum=D, maximum=D, default=D,
)  # fmt: skip
PARAMS = struct(
    count=function(U32, P), info=function(B, P, U32, P), value=function(B, P, U32, P),
    to_text=function(B, P, U32, D, P, U32), from_text=function(B, P, U32, S, P), flush=function(None, P, P, P),
)  # fmt: skip
AUDIO_PORT = struct(id=U32, name=c.c_char * 256, flags=U32, channels=U32, type=S, pair=U32)
NOTE_PORT = struct(id=U32, supported=U32, preferred=U32, name=c.c_char * 256)
PORTS = struct(count=function(U32, P, B), get=function(B, P, U32, B, P))
NOTE_NAME = struct(name=c.c_char * 256, port=I16, key=I16, channel=I16)
NOTE_NAMES = struct(count=function(U32, P), get=function(B, P, U32, P))
REMOTE_PAGE = struct(section=c.c_char * 256, id=U32, name=c.c_char * 256, parameters=U32 * 8, of_preset=B)
REMOTE_CONTROLS = struct(count=function(U32, P), get=function(B, P, U32, P))
STREAM = struct(data=P, go=function(I64, P, P, U64))
STATE = struct(save=function(B, P, P), load=function(B, P, P))
RENDER = struct(needs=function(B, P), set=function(B, P, I32))
PRESET_LOAD = struct(from_location=function(B, P, U32, S, S))
THREAD_POOL = struct(exec=function(None, P, U32))
POOL_OF_HOST = struct(request=function(B, P, U32))
LOG = struct(log=function(None, P, I32, S))
PARAMS_OF_HOST = struct(rescan=function(None, P, U32), clear=P, request_flush=function(None, P))
PROVIDER = struct(
    descriptor=P, data=P, init=function(B, P), destroy=function(None, P), metadata=function(B, P, U32, S, P),
    extension=P,
)  # fmt: skip
LOCATION = struct(flags=U32, name=S, kind=U32, path=S)
INDEXER = struct(
    version=VERSION, name=S, vendor=S, url=S, release=S, data=P, filetype=function(B, P, c.POINTER(S * 3)),
    location=function(B, P, c.POINTER(LOCATION)), soundpack=P, extension=P,
)  # fmt: skip
RECEIVER = struct(
    data=P, error=function(None, P, I32, S), begin=function(B, P, S, S), plugin=function(None, P, c.POINTER(S * 2)),
    **dict.fromkeys(("soundpack", "flags", "creator", "description", "times"), function(None, P, P)),
    feature=function(None, P, S), extra=P,
)  # fmt: skip


class Library:
    """The file livebass.clap of a folder, with the calls a host makes before it has a plugin."""

    def __init__(self, folder: Path) -> None:
        self.file = folder / "livebass.clap"
        self.entry = ENTRY.in_dll(c.CDLL(str(self.file)), "clap_entry")
        assert self.entry.init(str(self.file).encode())

    def factory(self) -> tuple[Any, int]:
        address = self.entry.factory(b"clap.plugin-factory")
        return FACTORY.from_address(address), address

    def plugins(self) -> list[tuple[str, str]]:
        """(id, name) of its plugins."""
        factory, address = self.factory()
        found = [factory.descriptor(address, k).contents for k in range(factory.count(address))]
        return [(one.id.decode(), one.name.decode()) for one in found]

    def presets(self) -> list[tuple[str, str | None, list[str]]]:
        """(name, key, plugin ids) of the presets offered to a browser: basses, then files, which have no key.

        Its errors about other presets are in `refused`.
        """
        address = self.entry.factory(b"clap.preset-discovery-factory/2")
        factory, found = FACTORY.from_address(address), []
        locations: list[tuple[int, int, str]] = []
        endings: list[str] = []
        self.refused: list[str] = []

        def locate(_: Any, place: Any) -> bool:
            said = place.contents
            locations.append((said.flags, said.kind, (said.path or b"").decode()))
            return True

        indexer_kinds, kinds = dict(INDEXER._fields_), dict(RECEIVER._fields_)
        indexer = INDEXER(
            VERSION(1, 2, 2), b"tests", b"", b"", b"1",
            filetype=indexer_kinds["filetype"](lambda _, kind: endings.append(kind.contents[2].decode()) is None),
            location=indexer_kinds["location"](locate),
        )  # fmt: skip
        name = c.cast(factory.descriptor(address, 0), c.POINTER(struct(version=VERSION, id=S))).contents.id
        made = factory.create(address, c.addressof(indexer), name)
        provider = PROVIDER.from_address(made)
        assert provider.init(made) and locations[0] == (1, PRESETS_OF_PLUGIN, "")
        receiver = RECEIVER(
            error=kinds["error"](lambda _, number, line: self.refused.append(line.decode())),
            begin=kinds["begin"](
                lambda _, title, key: found.append((title.decode(), key and key.decode(), [])) is None
            ),
            plugin=kinds["plugin"](lambda _, user: found[-1][2].append(user.contents[1].decode())),
            feature=kinds["feature"](lambda *_: None),
        )
        assert provider.metadata(made, PRESETS_OF_PLUGIN, None, c.addressof(receiver))
        for flags, kind, path in locations[1:]:
            assert flags in (1, 2) and kind == PRESETS_IN_FILES
            for file in sorted(file for file in Path(path).glob("*") if file.suffix[1:] in endings):
                provider.metadata(made, kind, str(file).encode(), c.addressof(receiver))
        provider.destroy(made)
        return found


class Plugin:
    """One plugin of a folder, active at `rate`. Raises RuntimeError, with its log, if it refuses.

    `pool`: threads the host offers for a plugin's tasks; 0 declines all tasks, -1 lacks the extension. `tasks` lists
    how many were asked for each time; `helped` is the processor time (s) they took.
    """

    def __init__(self, folder: Path, rate: int = 48000, name: str = MONO, active: bool = True, pool: int = -1) -> None:
        self.logged: list[str] = []
        self.requested = self.rescanned = 0
        self.asleep = False  # after the last block
        self.reported: list[tuple[int, float]] = []  # values it reports changed, by itself or by hand
        self.gestures: list[tuple[int, int]] = []  # (parameter, type): changes by hand that began or ended
        self.library = Library(folder)
        self.log = LOG(LOG._fields_[0][1](lambda _, severity, line: self.logged.append(line.decode(errors="replace"))))
        self.params_of_host = PARAMS_OF_HOST(
            PARAMS_OF_HOST._fields_[0][1](self._rescan), None, PARAMS_OF_HOST._fields_[2][1](lambda _: None)
        )
        given = {b"clap.log": c.addressof(self.log), b"clap.params": c.addressof(self.params_of_host)}
        self.threads = ThreadPoolExecutor(pool) if pool > 0 else None
        self.tasks: list[int] = []
        self.helped = 0.0
        self.pool_of_host = POOL_OF_HOST(POOL_OF_HOST._fields_[0][1](self._share))
        if pool >= 0:
            given[b"clap.thread-pool"] = c.addressof(self.pool_of_host)
        kinds = dict(HOST._fields_)
        self.host = HOST(
            VERSION(1, 2, 2), None, b"tests", b"", b"", b"1",
            kinds["extension"](lambda _, wanted: given.get(wanted)),
            kinds["restart"](lambda _: None), kinds["process"](lambda _: None), kinds["callback"](self._ask),
        )  # fmt: skip
        factory, address = self.library.factory()
        self.handle = factory.create(address, c.addressof(self.host), name.encode())
        self.plugin = PLUGIN.from_address(self.handle)
        self.rate, self.frames, self.active, self.processing = rate, 0, False, False
        self.outputs = 8 if name == STRINGS else 1
        if not self.plugin.init(self.handle):
            self.plugin.destroy(self.handle)
            raise RuntimeError("; ".join(self.logged))
        self.set(RELIEF, 0.0)  # tests do not run in real time
        if active:
            self.activate()

    def _ask(self, _: Any) -> None:
        self.requested += 1

    def _share(self, _: Any, tasks: int) -> bool:
        """Runs the tasks of a block on the host's threads, and waits for them."""
        assert self.processing
        self.tasks.append(tasks)
        if self.threads is None:
            return False
        execute = self.extension("thread-pool", THREAD_POOL).exec

        def work(task: int) -> float:
            began = time.thread_time()
            execute(self.handle, task)
            return time.thread_time() - began

        self.helped += sum(self.threads.map(work, range(tasks)))
        return True

    def _hear(self, _: Any, event: int) -> bool:
        said = PARAM_VALUE.from_address(event)
        if said.type == VALUE:
            self.reported.append((said.param, said.value))
        else:
            self.gestures.append((GESTURE.from_address(event).param, said.type))
        return True

    def _rescan(self, _: Any, flags: int) -> None:
        self.rescanned += 1

    def activate(self) -> None:
        if not self.plugin.activate(self.handle, self.rate, 1, 1 << 20):
            self.plugin.destroy(self.handle)
            raise RuntimeError("; ".join(self.logged))
        self.active = self.plugin.start(self.handle)

    def deactivate(self) -> None:
        self.plugin.stop(self.handle)
        self.plugin.deactivate(self.handle)
        self.active = False

    def close(self) -> None:
        if self.active:
            self.deactivate()
        self.plugin.destroy(self.handle)
        if self.threads:
            self.threads.shutdown()

    def extension(self, name: str, kind: Any) -> Any:
        return kind.from_address(self.plugin.extension(self.handle, f"clap.{name}".encode()))

    def work(self) -> None:
        """Does the main-thread work that the plugin asked for."""
        if self.requested:
            self.requested = 0
            self.plugin.on_main_thread(self.handle)

    def block(self, frames: int, events: Sequence[Any] = ()) -> Floats:
        """Plays a block with `events`, ordered by time; returns (frames,), or (outputs, frames)."""
        kinds = dict(IN_EVENTS._fields_)
        given = IN_EVENTS(None, kinds["size"](lambda _: len(events)), kinds["get"](lambda _, k: c.addressof(events[k])))
        taken = OUT_EVENTS(None, OUT_EVENTS._fields_[1][1](self._hear))
        out = np.full((self.outputs, frames), np.nan, np.float32)
        channels = [P(row.ctypes.data) for row in out]
        buffers = (BUFFER * self.outputs)(*(BUFFER(c.addressof(row), None, 1) for row in channels))
        process = PROCESS(
            self.frames, frames, None, None, c.addressof(buffers), 0, self.outputs, c.addressof(given),
            c.addressof(taken),
        )  # fmt: skip
        self.processing = True
        status = self.plugin.process(self.handle, c.addressof(process))
        self.processing = False
        assert status in (CONTINUE, SLEEP)
        self.asleep = status == SLEEP
        self.frames += frames
        return out if self.outputs > 1 else out[0]

    def play(self, given: Iterable[tuple[int, Any]] | Score, frames: int, sizes: Iterable[int] = (512,)) -> Floats:
        """Plays `frames` in blocks of `sizes`, in turn: a score as MIDI, or ordered (frame, event) pairs."""
        if isinstance(given, Score):
            given = [(int(f), midi(m.tobytes())) for f, m in zip(given.frames, given.messages, strict=True)]
        events, out = list(given), []
        for begin, size in blocks(frames, sizes):
            now = [(when - begin, event) for when, event in events if begin <= when < begin + size]
            for when, event in now:
                event.time = when
            out.append(self.block(size, [event for _, event in now]))
        return np.concatenate(out, axis=-1)[..., :frames]

    def params(self) -> list[Any]:
        """Its parameters, PARAM_INFO each."""
        params, found = self.extension("params", PARAMS), []
        for k in range(params.count(self.handle)):
            found.append(PARAM_INFO())
            assert params.info(self.handle, k, c.addressof(found[-1]))
        return found

    def outputs_called(self) -> list[str]:
        """The names of its outputs."""
        ports, port, found = self.extension("audio-ports", PORTS), AUDIO_PORT(), []
        for k in range(ports.count(self.handle, False)):
            assert ports.get(self.handle, k, False, c.addressof(port))
            found.append(port.name.decode())
        return found

    def notes_called(self) -> dict[int, str]:
        """The names of keys, on every port and channel."""
        names, name, found = self.extension("note-name", NOTE_NAMES), NOTE_NAME(), {}
        for k in range(names.count(self.handle)):
            assert names.get(self.handle, k, c.addressof(name)) and name.port == name.channel == -1
            found[name.key] = name.name.decode()
        assert not names.get(self.handle, len(found), c.addressof(name))
        return found

    def pages(self) -> dict[str, list[int]]:
        """The pages of its parameters by name, for hosts with eight knobs."""
        controls, found, ids = self.extension("remote-controls/2", REMOTE_CONTROLS), {}, set()
        for k in range(controls.count(self.handle)):
            page = REMOTE_PAGE()
            assert controls.get(self.handle, k, c.addressof(page)) and not page.of_preset
            assert page.name.startswith(page.section)
            found[page.name.decode()] = [number for number in page.parameters if number != NO_ID]
            ids.add(page.id)
        beyond = REMOTE_PAGE()  # lives through the call, which clears it
        assert not controls.get(self.handle, len(found), c.addressof(beyond)) and len(ids) == len(found)
        return found

    def value(self, param: int) -> float:
        found = D()
        assert self.extension("params", PARAMS).value(self.handle, param, c.addressof(found))
        return found.value

    def text(self, param: int, wanted: float) -> str:
        """The text of a value."""
        text = c.create_string_buffer(256)
        assert self.extension("params", PARAMS).to_text(self.handle, param, wanted, text, 256)
        return text.value.decode()

    def value_of(self, param: int, text: str) -> float | None:
        """The value of a text, None if it has none."""
        found = D()
        good = self.extension("params", PARAMS).from_text(self.handle, param, text.encode(), c.addressof(found))
        return found.value if good else None

    def set(self, param: int, wanted: float) -> None:
        """Sets a parameter outside process()."""
        events = [value(param, wanted)]
        kinds = dict(IN_EVENTS._fields_)
        given = IN_EVENTS(None, kinds["size"](lambda _: 1), kinds["get"](lambda _, k: c.addressof(events[k])))
        self.extension("params", PARAMS).flush(self.handle, c.addressof(given), None)

    def offline(self, on: bool = True) -> None:
        assert self.extension("render", RENDER).set(self.handle, int(on))

    def save(self) -> bytes:
        """Its state, read in small pieces as hosts may."""
        found = bytearray()

        def write(_: Any, data: int, size: int) -> int:
            found.extend(c.string_at(data, min(size, 7)))
            return min(size, 7)

        stream = STREAM(None, STREAM._fields_[1][1](write))
        assert self.extension("state", STATE).save(self.handle, c.addressof(stream))
        return bytes(found)

    def load(self, state: bytes) -> bool:
        """Loads a state in small pieces; returns whether the plugin took it."""
        left = [state]

        def read(_: Any, data: int, size: int) -> int:
            piece = left[0][: min(size, 5)]
            c.memmove(data, piece, len(piece))
            left[0] = left[0][len(piece) :]
            return len(piece)

        stream = STREAM(None, STREAM._fields_[1][1](read))
        return bool(self.extension("state", STATE).load(self.handle, c.addressof(stream)))

    def load_preset(self, key: str) -> bool:
        load = self.extension("preset-load/2", PRESET_LOAD)
        return bool(load.from_location(self.handle, PRESETS_OF_PLUGIN, None, key.encode()))

    def load_sound(self, file: Path) -> bool:
        load = self.extension("preset-load/2", PRESET_LOAD)
        return bool(load.from_location(self.handle, PRESETS_IN_FILES, str(file).encode(), None))


def note_on(key: int, velocity: float, number: int = -1, channel: int = 0) -> Any:
    return NOTE(c.sizeof(NOTE), 0, 0, NOTE_ON, 0, number, 0, channel, key, velocity)


def note_off(key: int, number: int = -1, channel: int = 0) -> Any:
    return NOTE(c.sizeof(NOTE), 0, 0, NOTE_OFF, 0, number, 0, channel, key, 0.0)


def choke(key: int, channel: int = 0) -> Any:
    return NOTE(c.sizeof(NOTE), 0, 0, NOTE_CHOKE, 0, -1, 0, channel, key, 0.0)


def expression(kind: int, amount: float, key: int = -1, number: int = -1, channel: int = 0) -> Any:
    return NOTE_EXPRESSION(c.sizeof(NOTE_EXPRESSION), 0, 0, EXPRESSION, 0, kind, number, 0, channel, key, amount)


def tuning(semitones: float, key: int = -1, number: int = -1, channel: int = 0) -> Any:
    return expression(TUNING, semitones, key, number, channel)


def value(param: int, wanted: float) -> Any:
    return PARAM_VALUE(c.sizeof(PARAM_VALUE), 0, 0, VALUE, 0, param, None, -1, -1, -1, -1, wanted)


def midi(message: bytes) -> Any:
    return MIDI_EVENT(c.sizeof(MIDI_EVENT), 0, 0, MIDI, 0, 0, (c.c_uint8 * 3)(*message.ljust(3, b"\0")))
