"""A hidden X11 screen (Xvfb), a window on it for a plugin's, its pixels, and a hand at its pointer."""

from __future__ import annotations

import ctypes as c
import os
import subprocess
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from support.needs import tool

SIZE = 2000, 1400
# px in the plugin's window of default size, in the corner; the slider is the gain's
LOWEST_STRING, SLIDER = (200, 174), (670, 363)
PATIENCE = 10.0  # s


def needs_screen() -> None:
    """Skips a test if Xvfb or xdotool is not installed; fails where CI promises them."""
    for name in ("Xvfb", "xdotool"):
        tool(name, "WINDOW")


@contextmanager
def running_screen() -> Iterator[str]:
    """A private screen, ended by its process id; DISPLAY names it meanwhile."""
    reading, writing = os.pipe()
    with subprocess.Popen(
        ["Xvfb", "-displayfd", str(writing), "-screen", "0", f"{SIZE[0]}x{SIZE[1]}x24", "-nolisten", "tcp", "-noreset"],
        pass_fds=[writing], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
    ) as server:  # fmt: skip
        os.close(writing)
        try:
            with os.fdopen(reading) as said:
                name = f":{said.readline().strip()}"
            assert name != ":", "Xvfb does not start"
            with pytest.MonkeyPatch.context() as patch:
                patch.setenv("DISPLAY", name)
                patch.delenv("LIVEBASS_THEME", raising=False)
                yield name
        finally:
            server.terminate()
            server.wait(PATIENCE)


class WholeScreen:
    """A connection to the screen and its pixels."""

    def __init__(self) -> None:
        self._x = c.CDLL("libX11.so.6")
        for name in ("XOpenDisplay", "XGetImage"):
            getattr(self._x, name).restype = c.c_void_p
        for name in ("XDefaultRootWindow", "XCreateSimpleWindow"):
            getattr(self._x, name).restype = c.c_ulong
        self._display = c.c_void_p(self._x.XOpenDisplay(None))
        assert self._display
        self.window: int = self._x.XDefaultRootWindow(self._display)

    def close(self) -> None:
        self._x.XCloseDisplay(self._display)

    def picture(self, width: int, height: int) -> NDArray[np.uint8]:
        """The pixels of the window, (height, width, 3)."""
        image = self._x.XGetImage(
            self._display, c.c_ulong(self.window), 0, 0, width, height, c.c_ulong(0xFFFFFFFF), 2
        )  # fmt: skip
        assert image
        data = c.c_void_p.from_address(image + 16).value
        assert data
        pixels = np.ctypeslib.as_array((c.c_uint8 * (width * height * 4)).from_address(data)).copy()
        self._x.XFree(c.c_void_p(data))
        self._x.XFree(c.c_void_p(image))
        return pixels.reshape(height, width, 4)[:, :, 2::-1]


class Screen(WholeScreen):
    """A connection to the screen, and the host's window on it."""

    def __init__(self, width: int, height: int, top: int = 0) -> None:
        super().__init__()
        root = c.c_ulong(self.window)
        self.window = self._x.XCreateSimpleWindow(self._display, root, 0, top, width, height, 0, 0, 0)
        self._x.XMapWindow(self._display, c.c_ulong(self.window))
        self._x.XSync(self._display, 0)

    def resize(self, width: int, height: int) -> None:
        """Resizes the host's window and the only window in it."""
        for window in (self.window, self._inside()[0]):
            self._x.XResizeWindow(self._display, c.c_ulong(window), width, height)
        self._x.XSync(self._display, 0)

    def destroy_window(self) -> None:
        """Destroys the host's window with everything in it."""
        self._x.XDestroyWindow(self._display, c.c_ulong(self.window))
        self._x.XSync(self._display, 0)

    def _inside(self) -> list[int]:
        root, parent, list_, count = c.c_ulong(), c.c_ulong(), c.POINTER(c.c_ulong)(), c.c_uint()
        self._x.XQueryTree(
            self._display, c.c_ulong(self.window), *map(c.byref, (root, parent, list_, count))
        )  # fmt: skip
        return list_[: count.value]

    def children(self) -> int:
        """The number of windows inside the host's."""
        return len(self._inside())


def hand(*commands: Any) -> None:
    """Moves and presses by commands of xdotool: `"mousemove", 10, 20, "click", 1`."""
    subprocess.run(["xdotool", *map(str, commands)], check=True, timeout=PATIENCE)
