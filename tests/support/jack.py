"""Other clients of the JACK server, and the program as a process of its own."""

from __future__ import annotations

import subprocess
import sys
import time
from collections.abc import Callable
from typing import Any

import numpy as np

JACK_RATE, JACK_PERIOD = 48000, 256


class Ears:
    """A client that hears a port: (frame of the server, samples) for each period."""

    def __init__(self, jack: Any) -> None:
        self.client = jack.Client("ears", no_start_server=True)
        self.port = self.client.inports.register("in")
        self.heard: list[tuple[int, np.ndarray]] = []
        self.client.set_process_callback(self._take)

    def _take(self, frames: int) -> None:
        self.heard.append((self.client.last_frame_time, self.port.get_array().copy()))


class Keys:
    """A client that sends MIDI messages, each at an offset in a period of its own."""

    def __init__(self, jack: Any) -> None:
        self.client = jack.Client("keys", no_start_server=True)
        self.port = self.client.midi_outports.register("out")
        self.wanted: list[tuple[int, tuple[int, ...]]] = []
        self.sent: list[int] = []
        self.client.set_process_callback(self._send)

    def _send(self, frames: int) -> None:
        self.port.clear_buffer()
        if self.wanted:
            offset, message = self.wanted.pop(0)
            self.port.write_midi_event(offset, message)
            self.sent.append(self.client.last_frame_time + offset)


def livebass(*arguments: object, **more: Any) -> subprocess.Popen[str]:
    return subprocess.Popen(
        [sys.executable, "-m", "livebass", *map(str, arguments)], stdout=subprocess.PIPE, stderr=subprocess.PIPE,
        stdin=subprocess.DEVNULL, text=True, **more,
    )  # fmt: skip


def wait_for(what: Callable[[], object], seconds: float = 20.0) -> None:
    """Until `what` is true; an error if that never comes."""
    end = time.monotonic() + seconds
    while not what():
        assert time.monotonic() < end, "waited in vain"
        time.sleep(0.02)
