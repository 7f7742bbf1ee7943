"""The plugin window's picture without a window: its C by ctypes, with an instance or made-up looks."""

from __future__ import annotations

import ctypes as c
import functools
import subprocess
import tempfile
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from livebass import load_preset
from livebass.live.parameters import PARAMETERS
from livebass.live.thread.look import LOOK, PLACES
from livebass.plugin import build
from livebass.plugin.instrument import write_instrument
from livebass.plugin.systems import this_system
from livebass.score.score import Score
from support.plugins import kept_product, sources
from support.structures import struct

MOVE, PRESS, RELEASE, LEAVE, DOUBLE, UP, DOWN = range(7)
BEGIN, MOVED, END = range(3)
ROLL, LOOP, PUT_AWAY = range(3)
WIDTH, HEIGHT = 900, 460
PLAY, BENCH, TONE, SETTINGS = range(4)  # pages
PAGES = 4
GUARD = 64  # numbers around the pixels that must not be written
Pixels = NDArray[np.uint32]

VALUE = c.CFUNCTYPE(c.c_double, c.c_void_p, c.c_int)
SET = c.CFUNCTYPE(None, c.c_void_p, c.c_int, c.c_double, c.c_int)
TEXT = c.CFUNCTYPE(None, c.c_void_p, c.c_int, c.c_double, c.POINTER(c.c_char), c.c_size_t)
READ = c.CFUNCTYPE(c.c_int, c.c_void_p, c.c_int, c.c_char_p, c.POINTER(c.c_double))
NOTE = c.CFUNCTYPE(None, c.c_void_p, c.c_int, c.c_int, c.c_int, c.c_double)
SWITCHED = c.CFUNCTYPE(c.c_void_p, c.c_void_p, c.c_int)


# Filled by the C of an instance, for a picture of it
OPTIONAL = {
    "undo": "lb_undo", "swap": "lb_swap_sides", "side": "lb_side", "kept": "host_is_kept", "update": "host_update",
    "copy": "lb_copy_side", "learn": None,
    "controller": None, "title": "lb_title", "playing": "lb_playing_sound", "group": "host_group",
    "list": "lb_list_sounds", "sound": "lb_sound_name", "is_own": "lb_sound_is_own",
    "save": "lb_save_sound", "load": "lb_load_sound", "remove": "lb_remove_sound",
    "response": "lb_response_title", "responses": None, "response_name": None, "respond": None,
    "zoom": None, "paste": "lb_take_text", "drop": "lb_take_dropped", "song": "lb_view_song",
    "steer": "lb_steer_song", "stopped": "lb_last_stop", "fault": "lb_fault_to_text",
}  # fmt: skip


# lb_face
Face = struct(
    owner=c.c_void_p, look=c.c_void_p, value=VALUE, maximum=VALUE, set=SET, text=TEXT, read=READ, note=NOTE,
    own=c.c_void_p, switched=SWITCHED, **dict.fromkeys(OPTIONAL, c.c_void_p),
)  # fmt: skip


class Stop(c.Structure):
    """lb_stop, with its lb_fault."""

    _fields_ = [
        *((name, c.c_int) for name in ("count", "parameter", "open", "fret")), ("height", c.c_double)
    ]  # fmt: skip


Move = struct(parameter=c.c_int, phase=c.c_int, value=c.c_double)  # lb_move


@functools.cache
def library() -> Any:
    """The C of picture and instance with the kernels, built like the plugins."""
    return load_product("picture")


def load_product(product: str, *more: str) -> Any:
    """The same under a name of its own, built with `more` arguments."""
    system = this_system()

    def make(folder: Path) -> bytes:
        flags = [flag for flag in build.FLAGS if flag not in ("-fvisibility=hidden", "-s")] + ["-DLB_CHECK_THREADS"]
        command = [*build.compiler(system), *flags, *more, *sources(folder, "picturehost")]
        subprocess.run([*command, *build.LINKING[system.ending], "-o", folder / "picture"], check=True)
        return (folder / "picture").read_bytes()

    with tempfile.TemporaryDirectory() as name:
        made = Path(name) / f"picture.{system.ending}"
        made.write_bytes(kept_product(product, make))
        found = c.CDLL(str(made))
    address, whole, real = c.c_void_p, c.c_int, c.c_double
    found.lb_last_stop.restype, found.lb_last_stop.argtypes = Stop, [address]
    # Others take addresses and whole numbers, and give a whole number or nothing, as ctypes expects
    for name, result, arguments in (
        ("lb_new_picture", address, [c.POINTER(Face)]),
        ("lb_draw", None, [address, address, whole, whole, real, whole, real, c.POINTER(c.c_int * 4)]),
        ("lb_drawn_area", whole, [address, whole, c.POINTER(c.c_int * 4)]),
        ("lb_point", whole, [address, whole, real, real, whole]),
        ("lb_text_width", real, [real, c.c_char_p]),
        ("lb_text_to_value", whole, [address, whole, c.c_char_p, c.POINTER(real)]),
        ("lb_title", None, [address, address, c.c_size_t]),
        ("lb_put_look", None, [address, address]),
        ("lb_read_look", whole, [address, whole, address]),
        ("lb_looks_taken", c.c_uint64, [address]),
        ("new_host", address, [c.c_char_p, real]),
        ("look_of_host", address, [address]),
        ("set_host", None, [address, whole, real]),
        ("host_value", real, [address, whole]),
        ("host_max", real, [address, whole]),
        ("host_text", None, [address, whole, real, c.POINTER(c.c_char), c.c_size_t]),
        ("host_switched", address, [address, whole]),
        ("play_host", None, [address, address, c.c_int64]),
        ("read_song", whole, [c.c_char_p, c.c_size_t, whole, address, address, c.c_int64, address]),
        ("view_song", None, [address, address]),
        ("restart_host", whole, [address, real]),
        ("lb_take_dropped", c.c_char_p, [address, c.c_char_p]),
        ("read_name", whole, [c.c_char_p, c.c_size_t, address]),
        ("note_host", None, [address, whole, whole, real]),
        ("song_host", None, [address, address, address, c.c_int64, c.c_int64]),
        ("move_host", whole, [address, address]),
        ("lb_move_value", None, [address, whole, real, whole]),
        ("lb_take_midi", None, [address, c.c_int64, c.c_char_p, c.c_size_t]),
        ("lb_new_state", address, [address, c.POINTER(c.c_size_t)]),
        ("lb_load_state", whole, [address, address, c.c_size_t]),
        ("lb_sound_name", c.c_char_p, [address, whole]),
        ("lb_save_sound", whole, [address, address, c.c_size_t]),
        ("lb_take_text", c.c_char_p, [address, c.c_char_p]),
        ("lb_paste", None, [address, c.c_char_p]),
        ("new_looks", address, []),
        ("size_of_look", c.c_size_t, []),
        ("race", c.c_int64, [c.c_int64]),
    ):
        function = getattr(found, name)
        function.restype, function.argtypes = result, arguments
    return found


def shelf(folder: Path, names: Sequence[str]) -> Path:
    """Writes instruments and their list into `folder` as a plugin finds them; returns the folder."""
    for name in names:
        write_instrument(load_preset(name), folder / f"{name}.lbass")
    (folder / "instruments.txt").write_text("\n".join(names) + "\n")
    return folder


class SongView(c.Structure):
    """lb_song_view."""

    _fields_ = [
        *((name, c.c_int) for name in ("there", "rolls", "loops", "part", "wrong")), ("line", c.c_char * 640)
    ]  # fmt: skip

    @property
    def text(self) -> str:
        """The line."""
        return self.line.decode()


class Host:
    """An instance that plays by itself."""

    def __init__(self, folder: Path, rate: float = 48000.0, build: Any = None) -> None:
        """`build`: another than `library`."""
        self.library = build or library()
        self.address = c.c_void_p(self.library.new_host(str(folder).encode(), rate))
        assert self.address
        self.look = c.c_void_p(self.library.look_of_host(self.address))

    def play(self, frames: int, block: int = 256) -> NDArray[np.float32]:
        """Plays in blocks."""
        out = np.zeros(frames, np.float32)
        for at in range(0, frames, block):
            n = min(block, frames - at)
            self.library.play_host(self.address, out[at:].ctypes.data, n)
        return out

    def note(self, on: bool, key: int, velocity: float = 0.8) -> None:
        """Starts or stops a note."""
        self.library.note_host(self.address, on, key, velocity)

    def midi(self, *message: int) -> None:
        """Sends MIDI of three bytes."""
        self.library.lb_take_midi(self.address, 0, bytes(message), 3)

    def drop(self, file: Path) -> str | None:
        """Drops a file on its window; returns the fault."""
        why = self.library.lb_take_dropped(self.address, str(file).encode())
        return None if why is None else why.decode()

    def song(self) -> SongView:
        """What its window shows of the file that plays."""
        view = SongView()
        self.library.view_song(self.address, c.addressof(view))
        return view

    def steer(self, what: int) -> None:
        """A hand presses a button of the file: ROLL, LOOP or PUT_AWAY."""
        self.library.steer_song(self.address, what)

    def restart(self, rate: float) -> None:
        """The host begins again at another rate."""
        assert self.library.restart_host(self.address, rate)

    def give(self, score: Score, end: int = 0) -> None:
        """Gives it the messages of a score to play, up to the frame `end`, or to the score's end."""
        data = score.messages.astype(np.int64)
        frames, words = np.ascontiguousarray(score.frames), data[:, 0] | data[:, 1] << 8 | data[:, 2] << 16
        addresses = frames.ctypes.data, words.ctypes.data
        self.library.song_host(self.address, *addresses, len(words), end or score.end_frame)

    def roll(self, on: bool = True, loops: bool = False) -> None:
        """Starts or stops what it was given."""
        self.library.roll_host(self.address, on, loops)

    def rolls(self) -> bool:
        """True while that plays."""
        return bool(self.library.host_rolls(self.address))

    def may_sleep(self) -> bool:
        """True if the host need not call it until it sends something."""
        return bool(self.library.host_may_sleep(self.address))

    def touch(self, on: bool, string: int, key: int) -> None:
        """A hand in the window presses a string, or releases it."""
        self.library.touch_host(self.address, on, string, key)

    def moves(self) -> list[tuple[int, int, float]]:
        """The changes to report to the host: (parameter, phase, value)."""
        found, move = [], Move()
        while self.library.move_host(self.address, c.addressof(move)):
            found.append((move.parameter, move.phase, move.value))
        return found

    def watch(self, on: bool) -> None:
        """A window opens, or closes."""
        self.library.lb_watch(self.look, on)

    def set(self, symbol: str, value: float) -> None:
        """Sets a parameter."""
        self.library.set_host(self.address, self.number(symbol), value)

    def value(self, symbol: str) -> float:
        """The value of a parameter."""
        return float(self.library.host_value(self.address, self.number(symbol)))

    def save(self) -> bytes:
        """Its state as hosts keep it."""
        count = c.c_size_t()
        place = self.library.lb_new_state(self.address, c.byref(count))
        made = c.string_at(place, count.value)
        c.CDLL(None).free(c.c_void_p(place))
        return made

    def load(self, state: bytes) -> bool:
        """Loads a state; returns whether the instance took it."""
        room = np.frombuffer(state.ljust(len(state) + 16, b"\0")[: (len(state) + 15) // 8 * 8], np.uint64).copy()
        return bool(self.library.lb_load_state(self.address, room.ctypes.data, len(state)))

    def sounds(self) -> list[str]:
        """The names of the user's sounds, from the folder."""
        return [
            self.library.lb_sound_name(self.address, k).decode()
            for k in range(self.library.lb_list_sounds(self.address))
        ]

    def save_sound(self) -> str | None:
        """Saves the current settings as a sound; returns its name."""
        room = c.create_string_buffer(256)
        good = self.library.lb_save_sound(self.address, c.addressof(room), 256)
        return room.value.decode() if good else None

    def title(self) -> str:
        """What its window shows of the bass or the sound that plays."""
        room = c.create_string_buffer(200)
        self.library.lb_title(self.address, c.addressof(room), 200)
        return room.value.decode()

    def number(self, symbol: str) -> int:
        """The number of a parameter."""
        return number(symbol)

    def close(self) -> None:
        """Frees it."""
        self.library.free_host(self.address)


def number(symbol: str) -> int:
    """The number of a parameter."""
    return next(p.number for p in PARAMETERS if p.symbol == symbol)


class Picture:
    """A picture of a host's instance or, without one, of the looks passed to `show`."""

    def __init__(
        self,
        host: Host | None = None,
        size: tuple[int, int] = (WIDTH, HEIGHT),
        scale: float = 1.0,
        optional: Iterable[str] = (),
    ) -> None:
        self.host, self.scale, self.dark, self.seconds = host, scale, True, 0.0
        self.values = {p.number: p.default for p in PARAMETERS}
        self.sets: list[tuple[int, float, int]] = []
        self.notes: list[tuple[int, int, int]] = []
        self.look = host.look if host else c.c_void_p(library().new_looks())
        self.face = Face(
            host.address if host else None, self.look, VALUE(self._value), VALUE(self._maximum), SET(self._set),
            TEXT(self._text), READ(self._read), NOTE(self._note),
            c.cast(library().host_own, c.c_void_p) if host else None,
            SWITCHED(lambda _, key: library().host_switched(host.address, key) if host else None),
        )  # fmt: skip
        for name in optional:
            setattr(self.face, name, c.cast(getattr(library(), str(OPTIONAL[name])), c.c_void_p))
        self.address = c.c_void_p(library().lb_new_picture(self.face))
        self.resize(*size)

    def resize(self, width: int, height: int) -> None:
        """Takes an array of another size, with guards beyond it."""
        self.memory = np.full(width * height + 2 * GUARD, 0x12345678, np.uint32)
        self.pixels: Pixels = self.memory[GUARD:-GUARD].reshape(height, width)

    def _value(self, _: int, k: int) -> float:
        return library().host_value(self.host.address, k) if self.host else self.values[k]

    def _maximum(self, _: int, k: int) -> float:
        return library().host_max(self.host.address, k) if self.host else PARAMETERS[k].maximum

    def _set(self, _: int, k: int, value: float, phase: int) -> None:
        self.sets.append((k, value, phase))
        self.values[k] = value
        if self.host and phase == MOVED:
            library().set_host(self.host.address, k, value)

    def _text(self, _: int, k: int, value: float, text: Any, room: int) -> None:
        if self.host:
            library().host_text(self.host.address, k, value, text, room)
        else:
            said = PARAMETERS[k].points[int(value)] if PARAMETERS[k].points else f"{value:.2f} {PARAMETERS[k].unit}"
            c.memmove(text, said.encode()[: room - 1] + b"\0", min(len(said), room - 1) + 1)

    def _read(self, _: int, k: int, text: bytes, to: Any) -> int:
        if self.host:
            return int(library().lb_text_to_value(self.host.address, k, text, to))
        to[0] = float(text)
        return 1

    def key(self, *keys: int | str, modifiers: int = 0) -> bool:
        """Types keys, or texts; returns whether the window used them all."""
        codes = [code for key in keys for code in (map(ord, key) if isinstance(key, str) else (key,))]
        used = [library().lb_key(self.address, code, modifiers) for code in codes]
        return all(used)

    def _note(self, _: int, on: int, string: int, key: int, velocity: float) -> None:
        self.notes.append((on, string, key))
        if self.host:
            self.host.note(bool(on), key, velocity)

    def show(self, look: NDArray[np.void]) -> None:
        """Makes a look, LOOK (1,), the newest."""
        library().lb_put_look(self.look, look.ctypes.data)

    def draw(self, seconds: float = 1 / 30) -> tuple[int, int, int, int]:
        """Draws the next picture; returns x, y, width and height of the change."""
        self.seconds += seconds
        dirty = (c.c_int * 4)()
        height, width = self.pixels.shape
        library().lb_draw(
            self.address, self.pixels.ctypes.data, width, height, self.scale, self.dark, self.seconds, c.byref(dirty)
        )
        assert (self.memory[:GUARD] == 0x12345678).all() and (self.memory[-GUARD:] == 0x12345678).all()
        return tuple(dirty)

    def drawn_areas(self) -> list[tuple[int, ...]]:
        """The areas that the last picture has drawn, as from `draw`."""
        found, area = list[tuple[int, ...]](), (c.c_int * 4)()
        while library().lb_drawn_area(self.address, len(found), c.byref(area)):
            found.append(tuple(area))
        return found

    def point(self, kind: int, x: float, y: float, modifiers: int = 0) -> int:
        """Moves or clicks the pointer; returns its shape."""
        return int(library().lb_point(self.address, kind, x, y, modifiers))

    def press(self, x: float, y: float, modifiers: int = 0) -> None:
        """Presses and releases the button at a place; then draws."""
        for kind in (PRESS, RELEASE):
            self.point(kind, x, y, modifiers)
        self.draw()

    def turn_to(self, page: int) -> None:
        """Presses a page's tab: the row is found by the pointer."""
        scale, places = self.scale, [14 + 84 * k + 40 for k in range(PAGES)]
        row = next(
            y
            for y in range(int(46 * scale), len(self.pixels), 2)
            if all(self.point(MOVE, x * scale, y) == 1 and not self.point(MOVE, (x + 42) * scale, y) for x in places)
        )
        self.press(places[page] * scale, row)
        self.point(MOVE, 0, 0)
        self.draw()

    def save(self, file: Path) -> None:
        """Writes a PNG."""
        from PIL import Image

        planes = [(self.pixels >> shift & 255).astype(np.uint8) for shift in (16, 8, 0)]
        Image.fromarray(np.dstack(planes)).save(file)

    def close(self) -> None:
        """Frees it."""
        library().lb_free_picture(self.address)


def made_look(
    open_notes: Iterable[int] = (28, 33, 38, 43), fretless: bool = False, length: float = 0.86
) -> NDArray[Any]:
    """A look at a bass at rest, LOOK (1,)."""
    look = np.zeros(1, LOOK)
    notes = list(open_notes)
    look["bass"], look["strings"], look["frets"], look["fretless"], look["forced"] = 1, len(notes), 20, fretless, -1
    look["place"][0] = length * (1 - 2 ** (-np.minimum(np.arange(PLACES), 20) / 12))
    look["position"], look["nearest"], look["default_value"], look["farthest"] = 0.74, 0.55, 0.74, 0.93
    for i, note in enumerate(notes):
        lane = look["string"][0, i]
        lane["open"], lane["length"], lane["key"] = note, length, -1
        lane["speed"] = 2 * length * 440 * 2 ** ((note - 69) / 12)
        lane["pickups"], lane["saddle"], lane["aperture"], lane["mix"] = 2, (0.06, 0.15, 0, 0), 0.02, (1, 1, 0, 0)
    return look
