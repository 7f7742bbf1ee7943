"""The plugins' window on a hidden screen: opened, clicked, resized, destroyed; the sound stays."""

from __future__ import annotations

import ctypes as c
import os
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import closing, contextmanager
from pathlib import Path
from typing import Any

import mido
import numpy as np
import pytest
import soundfile
from support import lv2, vst3
from support.clap import RELIEF, Plugin, counting_host, midi, note_on, value
from support.drag import dropped
from support.jack import wait_for
from support.picture import SongView
from support.plugins import PRESETS, RATE, mono, write_bundle
from support.screen import LOWEST_STRING, SLIDER, Screen, hand, needs_screen, running_screen
from support.song import midi_file, notes_of
from support.states import file_of
from support.structures import function, struct
from support.window import GUI, WINDOW, Window, different

from livebass import load_preset
from livebass.live.parameters import PARAMETERS
from livebass.live.thread.look import LOOK
from livebass.plugin import clap
from livebass.plugin import lv2 as lv2_plugin
from livebass.plugin import vst3 as vst3_plugin
from livebass.plugin.systems import this_system
from livebass.rows.techniques import PICKED, TECHNIQUE
from livebass.score.reading import read_score

pytestmark = pytest.mark.skipif(not this_system().name.startswith("linux"), reason="windows of X11")
U32, D, B, P, S = c.c_uint32, c.c_double, c.c_bool, c.c_void_p, c.c_char_p
BASS, QUALITY, BEGIN, END = 8, 9, 7, 8
UI = struct(
    uri=S, instantiate=function(P, P, S, S, P, P, P, P), cleanup=function(None, P),
    port_event=function(None, P, U32, U32, U32, P), extension=function(P, S),
)  # fmt: skip
# px in a window of default size
NEXT, SAVE, TITLE = (432, 23), (474, 23), (280, 23)
PASTE = (702, 59)
UNDO, SIDE_A, SIDE_B = (754, 59), (846, 59), (872, 59)
DRAG = ("mousemove", *SLIDER, "mousedown", 1, "mousemove", 700, SLIDER[1], "mousemove", 710, SLIDER[1], "mouseup", 1)
LEARN = ("mousemove", *SLIDER, "click", 3, "mousemove", SLIDER[0] + 20, SLIDER[1] + 70, "click", 1)  # or forget
ZOOM = (24, 206)
SONG_PLAY, SONG_CROSS = (38, 84), (876, 84)  # in the bar of a file
TONE_PAGE = ("mousemove", 222, 58, "click", 1, "sleep", 0.2)
CABINETS = ("mousemove", 804, 402, "click", 1, "sleep", 0.2, "mousemove")  # opens their menu on that page
FIRST_SOUND = (300, 113)  # in the list: below a heading, in the second column
TITLES = [load_preset(name).name for name in PRESETS]
GAIN = 0
LOOK_PORT = 2 + len(PARAMETERS) + 2  # after MIDI, the output, parameters, freewheeling and overload


@pytest.fixture(scope="module")
def screen_name() -> Iterator[str]:
    needs_screen()
    with running_screen() as name:
        yield name


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_bundle(clap, tmp_path_factory.mktemp("window") / "livebass")


def own_cabinet(folder: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A response in a user's folder of its own."""
    monkeypatch.setenv("XDG_DATA_HOME", str(folder))
    file = folder / "livebass" / "responses" / "Old.wav"
    file.parent.mkdir(parents=True)
    soundfile.write(file, np.r_[0.5, np.zeros(99), 0.25], 48000)
    return file


@contextmanager
def open_page(folder: Path, scale: float = 1.0, top: int = 0) -> Iterator[tuple[Plugin, Window]]:
    with closing(Plugin(folder)) as plugin, closing(Window(plugin, scale, top)) as window:
        yield plugin, window


def test_it_opens_at_once_and_leaves_nothing(screen_name: str, folder: Path) -> None:
    with closing(Plugin(folder)) as plugin:
        counts = []
        for _ in range(12):
            with closing(Window(plugin)) as window:
                assert window.screen.children() == 1
                assert len(np.unique(window.picture().reshape(-1, 3), axis=0)) > 50
                assert threading.active_count() < 20 and window.opened_in < 1.0
            counts.append((len(os.listdir("/proc/self/fd")), len(os.listdir("/proc/self/task"))))
        assert counts[-1] == counts[2]


def test_the_audio_thread_allocates_and_locks_nothing_under_an_open_window(
    screen_name: str, folder: Path, tmp_path: Path
) -> None:
    """While it draws, reopens and is played; with an idle pointer the sound is the same as without it."""
    host, sounds = counting_host(tmp_path), []
    with closing(Screen(900, 500)) as screen:
        command = [host, folder / "livebass.clap", "1"]
        with subprocess.Popen(
            [*command, "3", "0", "-", str(screen.window)], stdout=subprocess.PIPE, text=True
        ) as playing:
            presses = 0
            while playing.poll() is None:
                hand(*DRAG, "mousemove", *LOWEST_STRING, "click", 1)
                presses += 1
            said = playing.communicate(timeout=60)[0]
        assert playing.returncode == 0 and presses > 1
        blocks, counted, greatest = said.split()
        assert int(blocks) > 100 and counted == "0" and 0 < float(greatest) < 1000
        for window in ([], [str(screen.window)]):
            out = tmp_path / f"{len(window)}.raw"
            subprocess.run([*command, "2", "0", out, *window], check=True, stdout=subprocess.PIPE)
            sounds.append(out.read_bytes())
    assert len(sounds[0]) > 100_000 and sounds[0] == sounds[1]


def test_in_no_window_of_the_host_there_is_none(screen_name: str, folder: Path) -> None:
    with closing(Plugin(folder)) as plugin:
        gui = plugin.extension("gui", GUI)
        for _ in range(2):
            assert gui.create(plugin.handle, b"x11", False)
            assert not gui.set_parent(plugin.handle, c.addressof(WINDOW(b"x11", 0x7FFFFFFE)))
            assert not gui.show(plugin.handle)
            gui.destroy(plugin.handle)
        with closing(Window(plugin)) as window:
            assert window.screen.children() == 1


@pytest.mark.parametrize("scale", [1.0, 2.0])
def test_a_string_that_is_struck_is_seen_to_move(screen_name: str, folder: Path, scale: float) -> None:
    with open_page(folder, scale) as (plugin, window):
        plugin.block(512)
        time.sleep(0.2)
        rest = window.picture()
        plugin.block(64, [note_on(28, 1.0)])
        for _ in range(20):
            plugin.block(64)
        wait_for(lambda: different(window.picture(), rest) > 300 * scale)


def listen(plugin: Plugin, condition: Callable[[], Any]) -> None:
    """Plays blocks until a condition holds."""
    wait_for(lambda: (plugin.block(64), condition())[1])


def test_sliders_tell_the_host_what_a_hand_does(screen_name: str, folder: Path) -> None:
    """A drag begins, moves and ends a gesture; the plugin has the value too."""
    with open_page(folder) as (plugin, _):
        plugin.block(64)
        plugin.reported.clear()
        hand(*DRAG)
        listen(plugin, lambda: (GAIN, END) in plugin.gestures)
        assert plugin.gestures == [(GAIN, BEGIN), (GAIN, END)]
        assert plugin.value(GAIN) == pytest.approx([wanted for param, wanted in plugin.reported if param == GAIN][-1])
        assert plugin.value(GAIN) < -1


def test_a_press_on_the_neck_plays_that_string(screen_name: str, folder: Path) -> None:
    with open_page(folder) as (plugin, _):
        plugin.block(64)
        assert not plugin.block(2048).any()
        hand("mousemove", *LOWEST_STRING, "mousedown", 1)
        wait_for(lambda: np.abs(plugin.block(4096)).max() > 1e-3)
        hand("mouseup", 1)


def test_it_is_resized_within_what_the_picture_takes(screen_name: str, folder: Path) -> None:
    with open_page(folder) as (_, window):
        assert window.gui.can_resize(window.handle)
        assert window.gui.set_size(window.handle, 1200, 600) and window.size() == (1200, 600)
        wait_for(lambda: window.screen.children() == 1)
        assert not window.gui.set_size(window.handle, 10, 10)
        width, height = U32(10), U32(99999)
        assert window.gui.adjust(window.handle, c.byref(width), c.byref(height))
        assert width.value >= 640 and 320 <= height.value <= 8192


def test_a_host_that_takes_its_window_away_first_goes_on(screen_name: str, folder: Path) -> None:
    """X11 answers calls on a destroyed window with errors that end a program."""
    with open_page(folder) as (plugin, window):
        window.screen.destroy_window()
        for _ in range(10):
            plugin.block(512, [note_on(33, 1.0)])
            time.sleep(0.03)
    assert True


def test_the_handler_of_errors_stays_the_hosts(screen_name: str, folder: Path) -> None:
    """Libraries that replace it in turns would call each other endlessly."""
    x = c.CDLL("libX11.so.6")
    x.XSetErrorHandler.restype = P
    mine = c.CFUNCTYPE(c.c_int, P, P)(lambda _, error: 0)
    before = x.XSetErrorHandler(mine)
    try:
        with open_page(folder):
            assert x.XSetErrorHandler(mine) == c.cast(mine, P).value
    finally:
        x.XSetErrorHandler(P(before))


def test_two_windows_and_changes_of_bass(screen_name: str, folder: Path) -> None:
    with open_page(folder) as (one, first), open_page(folder, top=600) as (two, second):
        pictures = []
        for bass in (0, 1):
            for plugin in (one, two):
                plugin.block(64, [value(BASS, bass)])
                plugin.work()
                for _ in range(40):
                    plugin.block(512)
            time.sleep(0.3)
            pictures.append((first.picture(), second.picture()))
        assert different(pictures[0][0], pictures[1][0]) > 20
        assert different(*pictures[1]) < 2000


# --- VST3 ---

RUN_LOOP = "18C3536697764F1A9C5B83857A871389"


@pytest.mark.parametrize("timed", [True, False])
def test_a_hand_in_the_vst3_window_edits_in_order(screen_name: str, tmp_path: Path, timed: bool) -> None:
    """By the timer of the host's run loop; without one, the window's own thread tells the host."""
    bundle = write_bundle(vst3_plugin, tmp_path / "livebass.vst3")
    timers: list[int] = []
    no = c.CFUNCTYPE(vst3.I32, P, P, vst3.I32)(lambda *_: -1)
    loop = vst3.answering(
        RUN_LOOP,
        vst3.Given(
            no, no, c.CFUNCTYPE(vst3.I32, P, P, vst3.U64)(lambda _, timer, ms: timers.append(timer) or 0),
            c.CFUNCTYPE(vst3.I32, P, P)(lambda _, timer: timers.remove(timer) or 0),
        ),
    )  # fmt: skip
    with closing(vst3.Plugin(bundle)) as plugin:
        handler = vst3.Handler(plugin)
        edits = handler.edits
        view = vst3.Object(plugin.controller.call(17, b"editor", result=P))
        assert view.call(3, b"X11EmbedWindowID") == 0 != view.call(3, b"HWND")
        box = (vst3.I32 * 4)()
        assert view.call(9, box) == 0 and list(box) == [0, 0, 900, 460]
        if timed:
            view.call(12, P(loop.address))
        with closing(Screen(900, 460)) as screen:
            assert view.call(4, P(screen.window), b"X11EmbedWindowID") == 0
            assert len(timers) == timed and screen.children() == 1
            other = vst3.Object(plugin.controller.call(17, b"editor", result=P))
            assert other.call(4, P(screen.window), b"X11EmbedWindowID") != 0  # one at a time
            assert len(timers) == timed and screen.children() == 1 and other.call(2) == 0
            wait_for(lambda: len(np.unique(screen.picture(900, 460).reshape(-1, 3), axis=0)) > 50)
            hand(*DRAG)

            def ended() -> bool:
                for timer in timers:
                    vst3.Object(timer).call(3)
                return bool(edits) and edits[-1][0] == "end"

            wait_for(ended)
            moved = [edit for edit in edits if edit[1] == edits[-1][1]]
            assert moved[0][0] == "begin" and moved[-1][0] == "end" and moved[1][0] == "to"
            values = [value for what, _, value in moved if what == "to"]
            number = moved[0][1]
            assert plugin.controller.call(14, U32(number), result=D) == pytest.approx(values[-1])
            here = len(handler.restarts)
            hand("mousemove", *NEXT, "click", 1)
            wait_for(lambda: ended() and edits[-1][1] == BASS)
            if timed:  # in this thread, the host's; the window's own thread must not do so
                assert handler.restarts == [(vst3.SWITCHES_CHANGED, threading.get_ident())]
            else:
                assert here == len(handler.restarts) == 0
            box[:] = [0, 0, 100, 100]
            assert view.call(14, box) == 0 and list(box) == [0, 0, 640, 320]
            assert view.call(5) == 0 and not timers and screen.children() == 0
            assert view.call(4, P(screen.window), b"X11EmbedWindowID") == 0 and view.call(5) == 0
        assert view.call(2) == 0


# --- LV2 ---


def test_the_lv2_window_knows_the_plugin_by_its_ports_alone(
    screen_name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Atoms carry the view; a hand sends back values and atoms; without a window nothing is sent."""
    file = own_cabinet(tmp_path, monkeypatch)
    bundle = write_bundle(lv2_plugin, tmp_path / "livebass.lv2")
    listed = (bundle / "instruments.txt").read_text().split()
    (bundle / "instruments.txt").write_text("\n".join([listed[0], f"{listed[1]} studio", *listed[2:]]) + "\n")
    with closing(lv2.Plugin(bundle)) as plugin:
        room = c.create_string_buffer(1 << 17)
        looks: list[bytes] = []
        plugin.plugin.connect(plugin.handle, LOOK_PORT, c.addressof(room))

        def run(frames: int, events: Any = ()) -> Any:
            c.memmove(room, np.array([len(room) - 8, 0], "u4").tobytes(), 8)
            sound = plugin.block(frames, events)
            size = int(np.frombuffer(room, "u4", 1)[0])
            if size > 8:
                looks.append(bytes(room)[32 : 32 + LOOK.itemsize])
            return sound

        for _ in range(20):
            run(512)
        assert not looks
        sent: list[tuple[int, int, bytes]] = []
        write = c.CFUNCTYPE(None, P, U32, U32, U32, P)(
            lambda _, port, size, form, data: sent.append((port, form, c.string_at(data, size)))
        )
        library = c.CDLL(str(bundle / "livebass.so"))
        library.lv2ui_descriptor.restype = c.POINTER(UI)
        ui = library.lv2ui_descriptor(0).contents
        with closing(Screen(900, 460)) as screen:
            tables = [(P * 2)(None, c.cast(plugin.calls[0], P))]
            features = [
                lv2.FEATURE(b"http://lv2plug.in/ns/ext/urid#map", c.addressof(tables[0])),
                lv2.FEATURE(b"http://lv2plug.in/ns/extensions/ui#parent", screen.window),
            ]
            listed = (P * 3)(*map(c.addressof, features))
            widget = P()
            handle = ui.instantiate(
                c.addressof(ui), b"urn:livebass:bass", f"{bundle}/".encode(), write, None, c.byref(widget), listed
            )
            assert handle and screen.children() == 1
            idle = struct(idle=function(vst3.I32, P)).from_address(
                ui.extension(b"http://lv2plug.in/ns/extensions/ui#idleInterface")
            )
            assert idle.idle(handle) == 0
            atoms = [data for port, form, data in sent if port == 0 and form]
            kind = int(np.frombuffer(atoms[0], "u4")[1])
            assert plugin.uris[kind - 1] == "urn:livebass:bass#watch"

            def give(data: bytes) -> tuple[int, bytes]:
                """A window's atom as the plugin receives it, with its own type in place of MIDI's."""
                return int(np.frombuffer(data, "u4", 2)[1]), data[8:]

            def play_atoms(found: list[bytes]) -> Any:
                events = b""
                for kind, body in map(give, found):
                    head = np.zeros(1, np.int64).tobytes() + np.array([len(body), kind], "u4").tobytes()
                    events += head + body.ljust((len(body) + 7) // 8 * 8, b"\0")
                sequence = np.array([8 + len(events), 1, 0, 0], "u4").tobytes() + events
                c.memmove(plugin.midi, sequence, len(sequence))
                c.memmove(room, np.array([len(room) - 8, 0], "u4").tobytes(), 8)
                out = np.zeros(512, np.float32)
                plugin.plugin.connect(plugin.handle, 1, out.ctypes.data)
                plugin.plugin.run(plugin.handle, 512)
                return out

            play_atoms(atoms)
            for _ in range(6):
                run(512)
            assert looks and np.frombuffer(looks[-1], LOOK)["strings"][0] == 4
            transfer = plugin.number("http://lv2plug.in/ns/ext/atom#eventTransfer")
            kind = plugin.number("urn:livebass:bass#look")

            def look_atom(look: bytes) -> bytes:
                return np.array([LOOK.itemsize, kind], "u4").tobytes() + look

            rest = screen.picture(900, 460)
            run(512, [(0, bytes([0x90, 28, 127]))])
            for _ in range(4):
                run(512)
                ui.port_event(handle, LOOK_PORT, 8 + LOOK.itemsize, transfer, look_atom(looks[-1]))
            wait_for(lambda: different(screen.picture(900, 460), rest) > 200)
            sent.clear()
            hand(*DRAG)
            wait_for(lambda: idle.idle(handle) == 0 and any(not form for _, form, _ in sent))
            assert any(not form and len(data) == 4 and 2 <= port < 2 + 40 for port, form, data in sent)

            def reported(uri: str) -> list[bytes]:
                """The bodies of the atoms of one type that it sent."""
                number = plugin.number(f"urn:livebass:bass#{uri}")
                return [data[8:] for _, form, data in sent if form and np.frombuffer(data, "u4", 2)[1] == number]

            assert not reported("sides")
            hand("mousemove", *SIDE_B, "click", 1)
            wait_for(lambda: idle.idle(handle) == 0 and reported("sides"))
            sides = np.frombuffer(reported("sides")[-1], "f8")
            gains = [np.frombuffer(data, "f4")[0] for port, form, data in sent if not form and port == 2]
            gain = [value for value in gains if value != 0.0][-1]  # side B has 0 dB
            assert reported("sides")[-1][:8] == (1).to_bytes(8, "little") and sides[1 + GAIN] == pytest.approx(gain)
            sent.clear()
            atom = np.array([sides.nbytes, plugin.number("urn:livebass:bass#sides")], "u4").tobytes()
            ui.port_event(handle, LOOK_PORT, 8 + sides.nbytes, transfer, atom + bytes(8) + sides[1:].tobytes())
            hand("mousemove", *SIDE_B, "click", 1)
            wait_for(lambda: idle.idle(handle) == 0 and reported("sides"))
            assert [body[:8] for body in reported("sides")] == [(1).to_bytes(8, "little")], (
                "the plugin had said that it is A"
            )
            sent.clear()
            hand("mousemove", *NEXT, "click", 1)
            wait_for(lambda: idle.idle(handle) == 0 and len([1 for _, form, _ in sent if not form]) >= 2)
            values = {port - 2: np.frombuffer(data, "f4")[0] for port, form, data in sent if not form}
            assert values == {BASS: 1, QUALITY: 1}, "the quality that the list says of that bass"
            sent.clear()
            run(512, [(0, bytes([0x90, 15, 100]))])  # pick
            run(512)
            ui.port_event(handle, LOOK_PORT, 8 + LOOK.itemsize, transfer, look_atom(looks[-1]))
            wait_for(lambda: idle.idle(handle) == 0 and any(not form for _, form, _ in sent))
            reported_ports = {port - 2: np.frombuffer(data, "f4")[0] for port, form, data in sent if not form}
            assert reported_ports == {TECHNIQUE: PICKED}
            name = b"Of the session".ljust(64, b"\0")
            atom = np.array([len(name), plugin.number("urn:livebass:bass#response")], "u4").tobytes() + name
            ui.port_event(handle, LOOK_PORT, len(atom), transfer, atom)
            hand(*TONE_PAGE, *CABINETS, 700, 347, "click", 1)
            wait_for(lambda: idle.idle(handle) == 0 and reported("response") == [f"{file}\0".encode()])
            hand("mousemove", *UNDO, "click", 1)
            wait_for(lambda: idle.idle(handle) == 0 and reported("response")[1:] == [b":Of the session\0"])
            file = song(tmp_path)
            assert dropped(file, *LOWEST_STRING)
            wait_for(lambda: idle.idle(handle) == 0 and reported("song"))
            assert reported("song") == [(3).to_bytes(4, "little") + f"{file}\0".encode()]
            number = plugin.number("urn:livebass:bass#song")
            play_atoms([data for _, form, data in sent if form and np.frombuffer(data, "u4", 2)[1] == number])
            bare, shown = screen.picture(900, 460), list[bytes]()
            for _ in range(200):
                plugin.work()
                heard_now = run(512)
                if int.from_bytes(bytes(room)[28:32], "little") == number:
                    shown.append(bytes(room)[24 : 32 + c.sizeof(SongView)])
            assert shown and np.abs(heard_now).max() < 1
            view = SongView.from_buffer_copy(shown[-1][8:])
            assert view.there and view.text.startswith("A song.mid: plays track 1 called Bass, 4 notes")
            ui.port_event(handle, LOOK_PORT, len(shown[-1]), transfer, shown[-1])
            wait_for(lambda: different(screen.picture(900, 460)[74:98], bare[74:98]) > 100)
            screen.resize(1300, 800)  # the host resizes the plugin's window itself
            wait_for(lambda: len(np.unique(screen.picture(1300, 800)[500:, 1000:].reshape(-1, 3), axis=0)) > 5)
            ui.cleanup(handle)
            assert screen.children() == 0


# --- other actions of a hand ---


def learned_by(plugin: Plugin, controller: int, amount: int) -> float:
    """The gain after a controller's message."""
    plugin.block(64, [midi(bytes([0xB0, controller, amount]))])
    return plugin.value(GAIN)


def test_undo_sides_and_learning(screen_name: str, folder: Path) -> None:
    """The host hears of every change; a learned controller is kept in a state."""
    with open_page(folder) as (plugin, _):
        plugin.block(64)
        hand("mousemove", *SLIDER, "click", 1)
        listen(plugin, lambda: (GAIN, END) in plugin.gestures)
        moved = plugin.value(GAIN)
        assert moved < -5
        for place, wanted in ((SIDE_B, 0.0), (SIDE_A, moved), (UNDO, 0.0)):
            hand("mousemove", *place, "click", 1)
            listen(plugin, lambda wanted=wanted: plugin.value(GAIN) == wanted and plugin.reported[-1] == (GAIN, wanted))
        hand(*LEARN)
        listen(plugin, lambda: learned_by(plugin, 20, 127) == pytest.approx(0) and learned_by(plugin, 20, 64) < -5)
        learned = plugin.value(GAIN)
        with closing(Plugin(folder)) as other:
            assert other.load(plugin.save())
            other.block(64, [midi(bytes([0xB0, 20, 127]))])
            assert other.value(GAIN) == pytest.approx(0)
        assert learned_by(plugin, 20, 127) == pytest.approx(0) != learned
        hand(*LEARN)
        wait_for(lambda: learned_by(plugin, 20, 64) == learned_by(plugin, 20, 127))


CLIPBOARD = """
import sys, tkinter
root = tkinter.Tk()
root.withdraw()
root.clipboard_clear()
root.clipboard_append(sys.argv[1])
root.update()
print("ready", flush=True)
root.mainloop()
"""


def test_the_link_of_a_page_is_pasted_from_the_clipboard(screen_name: str, folder: Path) -> None:
    """The host is told; a clipboard without text or without a link changes nothing."""
    pytest.importorskip("tkinter")
    action, gauge = (next(p.number for p in PARAMETERS if p.symbol == name) for name in ("action", "gauge"))
    with open_page(folder) as (plugin, window):
        plugin.block(64)
        bare = window.picture()
        hand("mousemove", *PASTE, "click", 1)
        wait_for(lambda: different(window.picture(), bare) > 20)
        assert plugin.value(action) == 0
        link = f"https://example.org/#like={PRESETS[1]}&action=-0.9&gauge=10"
        for text in ("no link", link):
            with subprocess.Popen([sys.executable, "-c", CLIPBOARD, text], stdout=subprocess.PIPE) as owner:
                assert owner.stdout and owner.stdout.readline() == b"ready\n"
                hand("mousemove", *PASTE, "click", 1)
                if text == link:
                    listen(plugin, lambda: plugin.value(action) == -0.9)
                time.sleep(0.2)
                owner.terminate()
        listen(plugin, lambda: (gauge, END) in plugin.gestures)
        assert [plugin.value(k) for k in (action, gauge, BASS)] == [-0.9, 10, 1]
        hand("mousemove", *UNDO, "click", 1)
        listen(plugin, lambda: [plugin.value(k) for k in (action, gauge, BASS)] == [0, 0, 0])


def test_sounds_are_saved_and_loaded(
    screen_name: str, folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Loading sends the host every changed value; Undo reverts it; the audio thread is not disturbed."""
    monkeypatch.setenv("XDG_DATA_HOME", str(tmp_path))
    with open_page(folder) as (plugin, _):
        plugin.block(64)
        hand("mousemove", *SLIDER, "click", 1)
        listen(plugin, lambda: (GAIN, END) in plugin.gestures)
        moved = plugin.value(GAIN)
        hand("mousemove", *SAVE, "click", 1)  # it asks for a name
        hand("click", 1)
        wait_for(lambda: [file.name for file in (tmp_path / "livebass").glob("*")] == [f"{TITLES[0]} 1.toml"])
        hand("mousemove", *NEXT, "click", 1, "click", 1)  # after the last sound come the basses
        listen(plugin, lambda: plugin.value(BASS) == 1 and plugin.reported[-1] == (BASS, 1))
        hand("mousemove", *SIDE_B, "click", 1)
        listen(plugin, lambda: plugin.value(GAIN) == 0 and plugin.reported[-1] == (GAIN, 0))
        plugin.reported.clear()
        plugin.gestures.clear()
        hand("mousemove", *TITLE, "click", 1)
        time.sleep(0.2)
        hand("mousemove", *FIRST_SOUND, "click", 1)
        listen(plugin, lambda: len(plugin.gestures) == 4)
        assert sorted(plugin.reported[:2]) == [(GAIN, pytest.approx(moved)), (BASS, 0)]
        assert plugin.gestures == [(GAIN, BEGIN), (GAIN, END), (BASS, BEGIN), (BASS, END)]
        assert (plugin.value(GAIN), plugin.value(BASS)) == (moved, 0)
        hand("mousemove", *UNDO, "click", 1)
        listen(plugin, lambda: (plugin.value(GAIN), plugin.value(BASS)) == (0, 1))


def test_the_zoom_is_kept_for_the_next_window(
    screen_name: str, folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It opens larger; a damaged file counts as 100 %."""
    monkeypatch.setenv("XDG_DATA_HOME", str(tmp_path))
    with open_page(folder) as (_, window):
        assert window.size() == (900, 460)
        before = window.picture()
        hand("mousemove", *ZOOM, "click", 1)
        wait_for(lambda: different(window.picture(), before) > 1000)
    assert (tmp_path / "livebass" / "window.txt").read_text() == "125\n"
    for text, size in (("125\n", (1125, 575)), ("200", (1800, 920)), ("x", (900, 460)), ("10", (900, 460))):
        (tmp_path / "livebass" / "window.txt").write_text(text)
        with open_page(folder) as (_, window):
            assert window.size() == size, text


def test_a_value_is_typed_with_the_keyboard(screen_name: str, folder: Path) -> None:
    """The window takes the focus for that, and gives it back; before and after, keys are the host's."""
    with open_page(folder) as (plugin, _):
        plugin.block(64)
        hand("key", "7")
        hand("mousemove", SLIDER[0] + 160, SLIDER[1] - 14, "click", 1)
        time.sleep(0.2)
        hand("key", "minus", "1", "2", "Return")
        listen(plugin, lambda: (GAIN, END) in plugin.gestures and plugin.value(GAIN) == -12)
        time.sleep(0.2)
        hand("key", "minus", "3", "Return")
        time.sleep(0.2)
        plugin.block(64)
        assert plugin.value(GAIN) == -12


def test_a_cabinet_is_chosen_in_the_window(
    screen_name: str, folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """On the page Tone, from the files in the user's folder; the state keeps it until none is chosen; Undo."""
    own_cabinet(tmp_path, monkeypatch)
    with open_page(folder) as (plugin, _):
        before = plugin.save()
        hand(*TONE_PAGE, *CABINETS, 700, 347, "click", 1)
        wait_for(lambda: len(plugin.save()) > len(before))
        assert b"Old\0" in file_of(plugin.save(), "response")
        with_file = plugin.save()
        hand(*CABINETS, 700, 327, "click", 1)
        wait_for(lambda: plugin.save() == before)
        for wanted in (with_file, before):
            hand("mousemove", *UNDO, "click", 1)
            wait_for(lambda wanted=wanted: plugin.save() == wanted)


def test_a_cabinet_and_a_sound_are_dropped_on_the_window(
    screen_name: str, folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Other drags are refused; a file that cannot be used is told of; Undo brings back what was."""
    cabinet = own_cabinet(tmp_path, monkeypatch)
    with open_page(folder) as (plugin, window):
        plugin.block(64)
        before, bare = plugin.save(), window.picture()
        assert not dropped(cabinet, *LOWEST_STRING, ("text/plain", "text/html"))
        assert dropped(cabinet, *LOWEST_STRING, ("text/plain", "text/html", "image/png", "text/uri-list"))
        wait_for(lambda: b"Old\0" in file_of(plugin.save(), "response"))
        hand("mousemove", *UNDO, "click", 1)
        wait_for(lambda: plugin.save() == before)
        sound = tmp_path / "a + b 100%.toml"
        sound.write_text(f'like = "{PRESETS[1]}"\n[bench]\naction = -0.5\n')
        assert dropped(sound, *LOWEST_STRING)
        listen(plugin, lambda: plugin.value(BASS) == 1)
        hand("mousemove", *UNDO, "click", 1)
        listen(plugin, lambda: plugin.value(BASS) == 0)
        time.sleep(4.2)  # notices go
        bare = window.picture()
        assert dropped(tmp_path / "none.wav", *LOWEST_STRING)
        wait_for(lambda: different(window.picture()[:46], bare[:46]) > 20)
        assert plugin.save() == before


def song(folder: Path) -> Path:
    """A MIDI file with a track called Bass."""
    file = folder / "A song.mid"
    file.write_bytes(midi_file([mido.MetaMessage("track_name", name="Bass"), *notes_of([28, 33, 35, 38], 200)]))
    return file


def test_a_midi_file_dropped_on_the_window_plays_as_rendered(screen_name: str, folder: Path, tmp_path: Path) -> None:
    """At its own tempo from the next block on, until a hand stops it; the cross puts it away."""
    file = song(tmp_path)
    score = read_score(file, RATE)
    wanted = mono(PRESETS[0], score)[: score.end_frame]
    with open_page(folder) as (plugin, window):
        plugin.set(RELIEF, 0.0)
        bare = window.picture()
        assert dropped(file, *LOWEST_STRING)
        wait_for(lambda: different(window.picture()[74:98], bare[74:98]) > 100)
        sound = np.concatenate([plugin.block(512) for _ in range(len(wanted) // 512)])
        assert np.abs(wanted).max() > 0.01 and np.array_equal(sound, wanted[: len(sound)])
        plugin.block(4096)
        plugin.block(4096)
        for press in ("click", "click"):  # again, and stop
            hand("mousemove", *SONG_PLAY, press, 1)
            listen(plugin, lambda: True)
            time.sleep(0.2)
        hand("mousemove", *SONG_CROSS, "click", 1)
        wait_for(lambda: different(window.picture()[74:98], bare[74:98]) < 100)
