"""A host of VST3 plugins at interface level, for what pedalboard cannot reach."""

from __future__ import annotations

import ctypes as c
import threading
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from livebass.rows.arrays import Floats
from support.structures import struct

P, I16, I32, I64, U32, U64, D, F = (
    c.c_void_p, c.c_int16, c.c_int32, c.c_int64, c.c_uint32, c.c_uint64, c.c_double, c.c_float,
)  # fmt: skip
TEXT = I16 * 128
COMPONENT = "E831FF31F2D54301928EBBEE25697802"
PROCESSOR = "42043F99B7DA453CA569E79D9AAEC33D"
CONTROLLER = "DCD7BBE37742448DA874AACC979C759E"
UNITS = "3D4BD6B5913A4FD2A886E768A5EB92C1"
SWITCHES = "1F2F76D3BFFB4B96B99527A55EBCCEF4"
EXPRESSIONS = "B7F8F85941234872911695814F3721A3"
HANDLER = "93A0BEA30BD045DB8E890B0CC1E46AC6"
VALUES_CHANGED, SWITCHES_CHANGED = 1 << 2, 1 << 10  # flags of its restarts
MONO, STRINGS = 0, 1  # classes
MONO_SPEAKER, STEREO_SPEAKERS = 1 << 19, 3
REAL_TIME, OFFLINE = 0, 2
TUNING, EXPRESSION_VIBRATO, BRIGHTNESS = 2, 3, 5
RELIEF = 11  # a parameter
MAPPING, CONTEXT = "DF0FF9F749B74669B63AB7327ADBF5E5", "2A654303EF764E3D95B5FE83730EF6D0"
PHYSICAL = "B03078FF94D24AC890CCD303D4133324"
CAN_AUTOMATE, IS_READ_ONLY, IS_LIST, IS_PROGRAM_CHANGE, IS_HIDDEN = 1, 1 << 1, 1 << 3, 1 << 15, 1 << 4


On = struct(channel=I16, key=I16, tuning=F, velocity=F, length=I32, id=I32)
Off = struct(channel=I16, key=I16, velocity=F, id=I32, tuning=F)
Expression = struct(type=U32, id=I32, value=D)


class Kinds(c.Union):
    _fields_ = [("on", On), ("off", Off), ("expression", Expression), ("room", c.c_uint8 * 24)]


# A note, or (type 4) a note's expression
Event = struct(bus=I32, offset=I32, quarters=D, flags=c.c_uint16, type=c.c_uint16, of=Kinds)
Buffers = struct(channels=I32, silence=U64, data=P)
Setup = struct(mode=I32, size=I32, maximum=I32, rate=D)
Data = struct(
    mode=I32, size=I32, frames=I32, ins=I32, outs=I32, inputs=P, outputs=P, changes=P, out_changes=P, events=P,
    out_events=P, context=P,
)  # fmt: skip
Info = struct(type=U32, title=TEXT, short=TEXT, unit_name=TEXT, unit=I32, default=D)
Parameter = struct(id=U32, title=TEXT, short=TEXT, unit_name=TEXT, steps=I32, default=D, unit=I32, flags=I32)
Parameter.usual = property(lambda self: self.default)  # its name in scripts that were written for earlier checkouts
Bus = struct(media=I32, direction=I32, channels=I32, name=TEXT, type=I32, flags=U32)
Unit = struct(id=I32, parent=I32, name=TEXT, programs=I32)
Programs = struct(id=I32, name=TEXT, count=I32)
Switch = struct(
    type=U32, title=TEXT, short=TEXT, minimum=I32, maximum=I32, remapped=I32, unit=I32, flags=I32
)  # fmt: skip


class Given:
    """An object of the host: functions from the fourth place of its table on."""

    def __init__(self, *functions: Any) -> None:
        self.functions = functions
        self.table = (P * (3 + len(functions)))(None, None, None, *(c.cast(f, P) for f in functions))
        self.pointer = P(c.addressof(self.table))
        self.address = c.addressof(self.pointer)


def wide(text: Any) -> str:
    return bytes(text).decode("utf-16").split("\0")[0]


def answering(iid: str, given: Given) -> Given:
    """An object of the host that also answers with its interface."""

    def query(_: Any, wanted: int, to: int) -> int:
        found = c.string_at(wanted, 16) == bytes.fromhex(iid)
        P.from_address(to).value = given.address if found else None
        return 0 if found else -1

    given.kept = c.CFUNCTYPE(I32, P, P, P)(query), *[c.CFUNCTYPE(U32, P)(lambda _: 1)] * 2  # type: ignore[attr-defined]
    given.table[:3] = [c.cast(function, P).value for function in given.kept]  # type: ignore[attr-defined]
    return given


class Handler:
    """The host's handler for a plugin's controls: `edits` and `restarts` record the calls and their threads."""

    def __init__(self, plugin: Plugin) -> None:
        self.edits: list[tuple[str, int, float]] = []
        self.restarts: list[tuple[int, int]] = []  # flags, thread
        one, two = c.CFUNCTYPE(I32, P, U32), c.CFUNCTYPE(I32, P, U32, D)
        self.given = answering(
            HANDLER,
            Given(
                one(lambda _, k: self.edits.append(("begin", k, 0)) or 0),
                two(lambda _, k, v: self.edits.append(("to", k, v)) or 0),
                one(lambda _, k: self.edits.append(("end", k, 0)) or 0),
                c.CFUNCTYPE(I32, P, I32)(lambda _, flags: self.restarts.append((flags, threading.get_ident())) or 0),
            ),
        )
        plugin.controller.call(16, P(self.given.address))


class Object:
    """An interface of the plugin."""

    def __init__(self, address: int) -> None:
        self.address = address

    def call(self, place: int, *arguments: Any, result: Any = I32) -> Any:
        """Calls the function at a place of its table; arguments are integers, floats or ctypes objects."""
        kinds = [type(a) if isinstance(a, c._SimpleCData) else D if isinstance(a, float) else P for a in arguments]
        table = P.from_address(self.address).value or 0
        return c.CFUNCTYPE(result, P, *kinds)(P.from_address(table + 8 * place).value)(self.address, *arguments)

    def query(self, interface: str) -> Object:
        found = P()
        assert self.call(0, c.create_string_buffer(bytes.fromhex(interface), 16), c.addressof(found)) == 0
        return Object(found.value or 0)


class Plugin:
    """One object of the bundle's classes, active at `rate`.

    `reported`: parameter values it reported itself, (id, value). `silent`: it flagged all of the last block silent.
    """

    def __init__(
        self, bundle: Path, which: int = MONO, mode: int = REAL_TIME, relief: bool = False, rate: float = 48000.0
    ) -> None:
        library = c.CDLL(str(bundle / "Contents/x86_64-linux/livebass.so"))
        library.GetPluginFactory.restype = P
        factory, found = Object(library.GetPluginFactory()), P()
        names = (c.c_char * 116)()
        assert factory.call(4) == 2
        assert factory.call(5, I32(which), c.addressof(names)) == 0
        interface = c.create_string_buffer(bytes.fromhex(COMPONENT), 16)
        assert factory.call(6, c.addressof(names), c.addressof(interface), c.addressof(found)) == 0
        self.component, self.mode = Object(found.value or 0), mode
        assert self.component.call(3, None) == 0
        self.processor, self.controller = self.component.query(PROCESSOR), self.component.query(CONTROLLER)
        self.outputs = self.component.call(7, I32(0), I32(1))
        self.reported: list[tuple[int, float]] = []
        self.silent = False
        setup = Setup(mode, 0, 4096, rate)
        assert self.processor.call(7, c.addressof(setup)) == 0
        if not relief:  # tests do not run in real time
            self.controller.call(15, U32(RELIEF), 0.0)
        assert self.component.call(11, c.c_uint8(1)) == 0

    def set_speakers(self, speakers: Sequence[int]) -> bool:
        """Asks for speakers, one number per output; returns whether the plugin agrees."""
        requested = (U64 * len(speakers))(*speakers)
        return bool(self.processor.call(3, None, I32(0), c.addressof(requested), I32(len(speakers))) == 0)

    def block(
        self,
        frames: int,
        events: Sequence[Event] = (),
        points: Sequence[tuple[int, int, float]] = (),
        channels: int = 1,
    ) -> Floats:
        """Plays a block with `events`, and `points` of parameters, (id, offset, value); (outputs, channels, frames)."""

        def get(_: Any, k: int, to: int) -> int:
            c.memmove(to, c.addressof(events[k]), c.sizeof(Event))
            return 0

        def point(values: list[tuple[int, float]]) -> Any:
            def tell(_: Any, k: int, offset: int, value: int) -> int:
                I32.from_address(offset).value, D.from_address(value).value = values[k]
                return 0

            return tell

        listed = Given(c.CFUNCTYPE(I32, P)(lambda _: len(events)), c.CFUNCTYPE(I32, P, I32, P)(get))
        ids = list(dict.fromkeys(number for number, *_ in points))
        queues = []
        for number in ids:
            values = [(offset, value) for id_, offset, value in points if id_ == number]
            queues.append(Given(
                c.CFUNCTYPE(U32, P)(lambda _, number=number: number),
                c.CFUNCTYPE(I32, P)(lambda _, values=values: len(values)),
                c.CFUNCTYPE(I32, P, I32, P, P)(point(values)),
            ))  # fmt: skip
        changes = Given(
            c.CFUNCTYPE(I32, P)(lambda _: len(queues)), c.CFUNCTYPE(P, P, I32)(lambda _, k: queues[k].address)
        )
        telling: list[int] = []

        def heard(_: Any, offset: int, value: float, place: int) -> int:
            self.reported.append((telling[-1], value))
            return 0

        def ask(_: Any, number: int, place: int) -> int:
            telling.append(U32.from_address(number).value)
            return hearing.address

        nothing = c.CFUNCTYPE(I32, P)(lambda _: 0)
        hearing = Given(nothing, nothing, nothing, c.CFUNCTYPE(I32, P, I32, D, P)(heard))
        requested = Given(nothing, nothing, c.CFUNCTYPE(P, P, P, P)(ask))
        out = np.full((self.outputs, channels, frames), np.nan, np.float32)
        rows = [(P * channels)(*(row.ctypes.data for row in output)) for output in out]
        buffers = (Buffers * self.outputs)(*(Buffers(channels, 0, c.addressof(row)) for row in rows))
        data = Data(
            self.mode, 0, frames, 0, self.outputs, None, c.addressof(buffers), changes.address, requested.address,
            listed.address,
        )  # fmt: skip
        assert self.processor.call(9, c.addressof(data)) == 0
        self.silent = all(buffer.silence == (1 << channels) - 1 for buffer in buffers)
        return out

    def parameters(self) -> dict[int, Parameter]:
        """Its parameters by id."""
        found = {}
        for k in range(self.controller.call(8)):
            info = Parameter()
            assert self.controller.call(9, I32(k), c.addressof(info)) == 0
            found[info.id] = info
        return found

    def save(self) -> bytes:
        """Its state."""
        found = bytearray()

        def write(_: Any, data: int, size: int, written: int) -> int:
            found.extend(c.string_at(data, size))
            return 0

        stream = Given(c.CFUNCTYPE(I32, P)(lambda _: -1), c.CFUNCTYPE(I32, P, P, I32, P)(write))
        assert self.component.call(13, stream.address) == 0
        return bytes(found)

    def load(self, state: bytes) -> bool:
        """Loads a state in small pieces; returns whether the plugin took it."""
        left = [state]

        def read(_: Any, data: int, size: int, got: int) -> int:
            piece = left[0][: min(size, 100)]
            c.memmove(data, piece, len(piece))
            left[0] = left[0][len(piece) :]
            I32.from_address(got).value = len(piece)
            return 0

        stream = Given(c.CFUNCTYPE(I32, P, P, I32, P)(read))
        return bool(self.component.call(12, stream.address) == 0)

    def set(self, number: int, value: float) -> None:
        """Sets a parameter's control, as the host's window thread does."""
        assert self.controller.call(15, U32(number), value) == 0

    def default(self, number: int) -> float:
        """The default of a parameter, by id; it must be the parameter's value too."""
        default = float(self.parameters()[number].default)
        assert self.controller.call(14, U32(number), result=D) == default
        return default

    def mapped(self, channel: int, number: int) -> int:
        """The id of the parameter for a MIDI controller of a channel."""
        mapping, found = self.component.query(MAPPING), U32()
        assert mapping.call(3, I32(0), I16(channel), I16(number), c.addressof(found)) == 0
        mapping.call(2)
        return found.value

    def physical(self) -> list[int]:
        """The note expressions for movement across and along, and for pressure."""
        mapping, pairs = self.component.query(PHYSICAL), (U32 * 6)(0, 99, 1, 99, 2, 99)
        requested = (U64 * 2)(3, c.addressof(pairs))
        assert mapping.call(3, I32(0), I16(0), c.addressof(requested)) == 0
        mapping.call(2)
        return list(pairs)[1::2]

    def needs(self) -> int:
        """The host transport data it needs, as bits."""
        context = self.processor.query(CONTEXT)
        needed = context.call(3, result=U32)
        context.call(2)
        return int(needed)

    def units(self) -> dict[int, tuple[str, int, int]]:
        """(name, parent, list of programs) of its groups of parameters, by id."""
        units, found = self.component.query(UNITS), {}
        for k in range(units.call(3)):
            unit = Unit()
            assert units.call(4, I32(k), c.addressof(unit)) == 0
            found[unit.id] = wide(unit.name), unit.parent, unit.programs
        units.call(2)
        return found

    def text(self, number: int, value: float) -> str:
        """The plugin's text for a value, 0 to 1, of the parameter with an id."""
        text = TEXT()
        assert self.controller.call(10, U32(number), value, c.addressof(text)) == 0
        return wide(text)

    def value_of(self, number: int, text: str) -> float | None:
        """The value, 0 to 1, of a text of the parameter with an id; None if it has none."""
        given, found = TEXT(*np.frombuffer(text.encode("utf-16-le"), np.int16).tolist(), 0), D()
        good = self.controller.call(11, U32(number), c.addressof(given), c.addressof(found)) == 0
        return found.value if good else None

    def outputs_called(self) -> list[str]:
        """The names of its outputs."""
        found = []
        for k in range(self.outputs):
            bus = Bus()
            assert self.component.call(8, I32(0), I32(1), I32(k), c.addressof(bus)) == 0
            found.append(wide(bus.name))
        return found

    def programs(self) -> list[str]:
        """The names of its programs."""
        units, found, name = self.component.query(UNITS), Programs(), TEXT()
        assert units.call(5) == 1 and units.call(6, I32(0), c.addressof(found)) == 0
        names = []
        for k in range(found.count):
            assert units.call(7, I32(found.id), I32(k), c.addressof(name)) == 0
            names.append(wide(name))
        units.call(2)
        return names

    def switches(self) -> dict[int, str]:
        """The names of the key switches."""
        switches, found = self.component.query(SWITCHES), {}
        for k in range(switches.call(3, I32(0), I16(0))):
            info = Switch()
            assert switches.call(4, I32(0), I16(0), I32(k), c.addressof(info)) == 0
            assert info.minimum == info.maximum and (info.type, info.remapped, info.unit, info.flags) == (0, -1, -1, 0)
            found[info.minimum] = wide(info.title)
        assert switches.call(3, I32(1), I16(0)) == 0
        assert switches.call(4, I32(0), I16(0), I32(len(found)), c.addressof(Switch())) != 0
        switches.call(2)
        return found

    def pitches_called(self, program: int) -> dict[int, str]:
        """The pitch names of a program, by key."""
        units, name = self.component.query(UNITS), TEXT()
        assert units.call(9, I32(1), I32(program)) == 0
        found = {}
        for key in range(-1, 129):
            if units.call(10, I32(1), I32(program), I16(key), c.addressof(name)) == 0:
                found[key] = wide(name)
        units.call(2)
        return found

    def expressions(self) -> list[tuple[int, str]]:
        """(type, title) of the note expressions."""
        expressions = self.component.query(EXPRESSIONS)
        room = (c.c_char * 1024)()
        found = []
        for k in range(expressions.call(3, I32(0), I16(0))):
            assert expressions.call(4, I32(0), I16(0), I32(k), c.addressof(room)) == 0
            info = Info.from_buffer_copy(room)
            found.append((info.type, wide(info.title)))
        expressions.call(2)
        return found

    def close(self) -> None:
        assert self.component.call(11, c.c_uint8(0)) == 0
        self.component.call(4)
        self.processor.call(2)
        self.controller.call(2)
        assert self.component.call(2, result=U32) == 0


def note_on(key: int, velocity: float, number: int, offset: int = 0, channel: int = 0) -> Event:
    event = Event(0, offset, 0.0, 0, 0)
    event.of.on = On(channel, key, 0.0, velocity, 0, number)
    return event


def note_off(key: int, number: int, offset: int = 0, channel: int = 0) -> Event:
    event = Event(0, offset, 0.0, 0, 1)
    event.of.off = Off(channel, key, 0.0, number, 0.0)
    return event


def expression(kind: int, amount: float, number: int, offset: int = 0) -> Event:
    event = Event(0, offset, 0.0, 0, 4)
    event.of.expression = Expression(kind, number, amount)
    return event


def tuning(semitones: float, number: int, offset: int = 0) -> Event:
    return expression(TUNING, semitones / 240 + 0.5, number, offset)
