"""Drags a file over an X11 screen and drops it, as a file manager does (XDND, freedesktop.org)."""

from __future__ import annotations

import ctypes as c
from contextlib import closing
from pathlib import Path
from typing import Any
from urllib.parse import quote

from support.jack import wait_for

EVENT = c.c_long * 24  # an XEvent of 64 bits
MESSAGE, REQUEST, ANSWER = 33, 30, 31  # types: ClientMessage, SelectionRequest, SelectionNotify
TYPE, WINDOW, KIND, FORMAT, DATA = 0, 4, 5, 6, 7  # places in a message
ATOM, REPLACE, BYTES = 4, 0, 8
VERSION = 5
FILES = "text/uri-list"
Window, Atom = c.c_ulong, c.c_ulong


class Drag:
    """A window that drags files, and owns their addresses."""

    def __init__(self, types: tuple[str, ...] = (FILES,)) -> None:
        self._x = c.CDLL("libX11.so.6")
        self._x.XOpenDisplay.restype = c.c_void_p
        for name in ("XDefaultRootWindow", "XCreateSimpleWindow", "XInternAtom"):
            getattr(self._x, name).restype = c.c_ulong
        self._display = c.c_void_p(self._x.XOpenDisplay(None))
        self._root = self._x.XDefaultRootWindow(self._display)
        self._window = self._x.XCreateSimpleWindow(self._display, Window(self._root), 0, 0, 1, 1, 0, 0, 0)
        self._x.XSetSelectionOwner(self._display, Atom(self.atom("XdndSelection")), Window(self._window), 0)
        self._types = types
        self._addresses = b""

    def close(self) -> None:
        self._x.XCloseDisplay(self._display)

    def atom(self, name: str) -> int:
        """The number of a name."""
        return int(self._x.XInternAtom(self._display, name.encode(), 0))

    def _target(self, x: int, y: int) -> int:
        """The deepest window at a place of the screen that takes drags; 0: there is none."""
        at, found = self._root, 0
        while at:
            if self._takes_drags(at):
                found = at
            child, x_in, y_in = Window(), c.c_int(), c.c_int()
            self._x.XTranslateCoordinates(
                self._display, Window(self._root), Window(at), x, y, *map(c.byref, (x_in, y_in, child))
            )
            at = child.value
        return found

    def _takes_drags(self, window: int) -> bool:
        kind, form, count, left, data = Atom(), c.c_int(), c.c_ulong(), c.c_ulong(), c.POINTER(c.c_long)()
        self._x.XGetWindowProperty(
            self._display, Window(window), Atom(self.atom("XdndAware")), c.c_long(0), c.c_long(1), 0, Atom(ATOM),
            *map(c.byref, (kind, form, count, left, data)),
        )  # fmt: skip
        return count.value == 1 and data[0] >= VERSION

    def _send(self, to: int, kind: str, *data: int) -> None:
        event = EVENT()
        event[TYPE], event[WINDOW], event[KIND], event[FORMAT] = MESSAGE, to, self.atom(kind), 32
        event[DATA : DATA + 1 + len(data)] = [self._window, *data]
        self._x.XSendEvent(self._display, Window(to), 0, c.c_long(0), c.byref(event))
        self._x.XFlush(self._display)

    def _wait(self, kind: str) -> list[int]:
        """The data of the next message of a kind; hands out the addresses meanwhile."""
        event, found = EVENT(), list[int]()

        def came() -> bool:
            while not found and self._x.XPending(self._display):
                self._x.XNextEvent(self._display, c.byref(event))
                if event[TYPE] & 0xFF == REQUEST:
                    self._hand_out(event)
                if event[TYPE] & 0xFF == MESSAGE and event[KIND] == self.atom(kind):
                    found.extend(event[DATA : DATA + 5])
            return bool(found)

        wait_for(came)
        return found

    def _hand_out(self, request: Any) -> None:
        requestor, selection, target, place, time = request[5:10]
        self._x.XChangeProperty(
            self._display, Window(requestor), Atom(place), Atom(target), BYTES, REPLACE, self._addresses,
            len(self._addresses),
        )  # fmt: skip
        event = EVENT()
        event[TYPE], event[4:9] = ANSWER, [requestor, selection, target, place, time]
        self._x.XSendEvent(self._display, Window(requestor), 0, c.c_long(0), c.byref(event))
        self._x.XFlush(self._display)

    def drop(self, file: Path, x: int, y: int) -> bool:
        """Drops a file at a place of the screen; returns whether a window there takes it."""
        self._addresses = f"file://{quote(str(file))}\r\n".encode()
        to = self._target(x, y)
        if not to:
            return False
        types = [self.atom(name) for name in self._types[:3]]
        self._send(to, "XdndEnter", VERSION << 24 | (len(self._types) > 3), *types)
        self._send(to, "XdndPosition", 0, x << 16 | y, 0, self.atom("XdndActionCopy"))
        taken = self._wait("XdndStatus")[1] & 1
        self._send(to, "XdndDrop", 0, 0)
        finished = self._wait("XdndFinished")
        assert finished[1] == taken
        return bool(taken)


def dropped(file: Path, x: int, y: int, types: tuple[str, ...] = (FILES,)) -> bool:
    """Drops a file at a place of the screen; returns whether a window there takes it."""
    with closing(Drag(types)) as drag:
        return drag.drop(file, x, y)
