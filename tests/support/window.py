"""The window of a CLAP plugin inside a host's window on an X11 screen, and its pixels."""

from __future__ import annotations

import ctypes as c
import time
from typing import Any

import numpy as np

from support.clap import Plugin
from support.screen import Screen
from support.structures import function, struct

U32, D, B, P, S = c.c_uint32, c.c_double, c.c_bool, c.c_void_p, c.c_char_p
WINDOW = struct(api=S, handle=c.c_ulong)
GUI = struct(
    supported=function(B, P, S, B), preferred=function(B, P, P, P), create=function(B, P, S, B),
    destroy=function(None, P), set_scale=function(B, P, D), size=function(B, P, P, P), can_resize=function(B, P),
    hints=function(B, P, P), adjust=function(B, P, P, P), set_size=function(B, P, U32, U32),
    set_parent=function(B, P, P), transient=function(B, P, P), title=function(None, P, S), show=function(B, P),
    hide=function(B, P),
)  # fmt: skip


class Window:
    """The window of a CLAP plugin inside a host's."""

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


def different(one: Any, other: Any) -> int:
    """The number of pixels that differ."""
    return int((np.abs(one.astype(int) - other).max(axis=2) > 24).sum())
