"""The window of the plugins, on a screen that nobody sees: opened, clicked, resized, destroyed; the sound stays."""

from __future__ import annotations

import ctypes as c
import os
import threading
import time
from collections.abc import Iterator
from contextlib import closing, contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from support.clap import Plugin, function, note_on, struct, value
from support.plugins import RATE, hard_score, written
from support.screen import Screen, hand, needs_screen, running_screen, until

from livebass.plugin import clap
from livebass.plugin.systems import this_system

pytestmark = pytest.mark.skipif(not this_system().name.startswith("linux"), reason="windows of X11")
U32, D, B, P, S = c.c_uint32, c.c_double, c.c_bool, c.c_void_p, c.c_char_p
WINDOW = struct(("api", S), ("handle", c.c_ulong))
GUI = struct(
    ("supported", function(B, P, S, B)), ("preferred", function(B, P, P, P)), ("create", function(B, P, S, B)),
    ("destroy", function(None, P)), ("set_scale", function(B, P, D)), ("size", function(B, P, P, P)),
    ("can_resize", function(B, P)), ("hints", function(B, P, P)), ("adjust", function(B, P, P, P)),
    ("set_size", function(B, P, U32, U32)), ("set_parent", function(B, P, P)), ("transient", function(B, P, P)),
    ("title", function(None, P, S)), ("show", function(B, P)), ("hide", function(B, P)),
)  # fmt: skip
BASS, BEGIN, END = 8, 7, 8


@pytest.fixture(scope="module")
def screen_name() -> Iterator[str]:
    needs_screen()
    with running_screen() as name:
        yield name


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return written(clap, tmp_path_factory.mktemp("window") / "livebass")


class Window:
    """The window of a CLAP plugin in one of the host's."""

    def __init__(self, plugin: Plugin, scale: float = 1.0, top: int = 0) -> None:
        self.plugin, self.handle = plugin, plugin.handle
        self.gui = plugin.extension("gui", GUI)
        assert self.gui.supported(self.handle, b"x11", False) and not self.gui.supported(self.handle, b"win32", False)
        assert self.gui.create(self.handle, b"x11", False)
        assert self.gui.set_scale(self.handle, scale)
        self.width, self.height = self.size()
        self.screen = Screen(self.width, self.height, top)
        began = time.perf_counter()
        assert self.gui.set_parent(self.handle, c.addressof(WINDOW(b"x11", self.screen.window)))
        self.opened_in = time.perf_counter() - began
        assert self.gui.show(self.handle)

    def size(self) -> tuple[int, int]:
        width, height = U32(), U32()
        assert self.gui.size(self.handle, c.byref(width), c.byref(height))
        return width.value, height.value

    def picture(self) -> Any:
        return self.screen.picture(*self.size())

    def close(self) -> None:
        self.gui.destroy(self.handle)
        self.screen.close()


@contextmanager
def opened(folder: Path, scale: float = 1.0, top: int = 0) -> Iterator[tuple[Plugin, Window]]:
    with closing(Plugin(folder)) as plugin, closing(Window(plugin, scale, top)) as window:
        yield plugin, window


def different(one: Any, other: Any) -> int:
    """How many pixels are others."""
    return int((np.abs(one.astype(int) - other).max(axis=2) > 24).sum())


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


@pytest.mark.parametrize("scale", [1.0, 2.0])
def test_a_string_that_is_struck_is_seen_to_move(screen_name: str, folder: Path, scale: float) -> None:
    with opened(folder, scale) as (plugin, window):
        plugin.block(512)
        time.sleep(0.2)
        rest = window.picture()
        plugin.block(64, [note_on(28, 1.0)])
        for _ in range(20):
            plugin.block(64)
        until(lambda: different(window.picture(), rest) > 300 * scale)


def test_sliders_tell_the_host_what_a_hand_does(screen_name: str, folder: Path) -> None:
    """A drag begins, moves and ends a gesture; the value is the plugin's, too."""
    with opened(folder) as (plugin, window):
        plugin.block(64)
        time.sleep(0.1)
        plugin.told.clear()
        moved = None
        for y in range(window.height - 20, window.height // 2, -14):  # wherever the first row of sliders is
            hand("mousemove", 120, y, "mousedown", 1, "mousemove", 150, y, "mousemove", 160, y, "mouseup", 1)
            time.sleep(0.08)
            plugin.block(64)
            values = [(param, wanted) for param, wanted in plugin.told if param < 100]
            if values and plugin.gestures:
                moved = values
                break
        assert moved, "no slider was found"
        (param,) = {param for param, _ in plugin.gestures}
        assert (plugin.gestures[0][1], plugin.gestures[-1][1]) == (BEGIN, END)
        assert plugin.value(param) == pytest.approx([wanted for p, wanted in moved if p == param][-1])


def test_a_press_on_the_neck_plays_that_string(screen_name: str, folder: Path) -> None:
    with opened(folder) as (plugin, _):
        plugin.block(64)
        assert not plugin.block(2048).any()
        found = False
        for y in range(70, 240, 8):
            hand("mousemove", 200, y, "mousedown", 1)
            time.sleep(0.06)
            found = bool(np.abs(plugin.block(4096)).max() > 1e-3)
            hand("mouseup", 1)
            time.sleep(0.04)
            if found:
                break
        assert found


def test_it_is_resized_within_what_the_picture_takes(screen_name: str, folder: Path) -> None:
    with opened(folder) as (_, window):
        assert window.gui.can_resize(window.handle)
        assert window.gui.set_size(window.handle, 1200, 600) and window.size() == (1200, 600)
        until(lambda: window.screen.children() == 1)
        assert not window.gui.set_size(window.handle, 10, 10)
        width, height = U32(10), U32(99999)
        assert window.gui.adjust(window.handle, c.byref(width), c.byref(height))
        assert width.value >= 640 and 320 <= height.value <= 8192


def test_a_host_that_takes_its_window_away_first_goes_on(screen_name: str, folder: Path) -> None:
    """X11 answers what is done to a window that is gone with errors that end a program."""
    with opened(folder) as (plugin, window):
        window.screen.destroy_window()
        for _ in range(10):
            plugin.block(512, [note_on(33, 1.0)])
            time.sleep(0.03)
    assert True


def test_the_sound_with_a_window_open_is_that_without(screen_name: str, folder: Path) -> None:
    score, sounds = hard_score(), []
    for seen in (False, True):
        with closing(Plugin(folder)) as plugin:
            window = Window(plugin) if seen else None
            sounds.append(plugin.play(score, RATE, (64, 480, 1)))
            if window:
                window.close()
    assert np.array_equal(*sounds) and np.abs(sounds[0]).max() > 0.01


def test_two_windows_and_changes_of_bass(screen_name: str, folder: Path) -> None:
    with opened(folder) as (one, first), opened(folder, top=600) as (two, second):
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
