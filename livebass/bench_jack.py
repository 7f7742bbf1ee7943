"""Two clients of a running JACK server that measure another one: `Keys` plays notes, `Ears` hears when they sound.

Both count in frames of the server, so what the measuring side loses in periods cannot pass for latency: `Ears` knows
of every gap. Two clients and not one, as a loop through one client would cost a period. Methods: [main thread].
"""

from __future__ import annotations

import os
import time
from typing import Any

import numpy as np

from livebass.bench_apart import Lost
from livebass.hush import hushed

HEARD, SILENT = 2e-6, 1e-6  # full scale: the first sample of a soft pluck is beyond the one, a stopped string below
WRAP = 1 << 32  # JACK's frame times


def since(later: int, earlier: int) -> int:
    """Frames from `earlier` to `later`, frame times of JACK."""
    return (later - earlier + WRAP // 2) % WRAP - WRAP // 2


def jack_module() -> Any:
    """JACK-Client; Lost where it or its library is missing."""
    try:
        import jack
    except (ImportError, OSError) as error:
        why = " ".join(str(error).split())
        raise Lost(f"JACK: {why}; pip install 'livebass[live]', and a JACK library") from None
    return jack


def new_client(name: str) -> Any:
    """A client of the running server; Lost where there is none."""
    jack = jack_module()
    try:
        with hushed():
            return jack.Client(name, no_start_server=True)
    except jack.JackError:
        server = os.environ.get("JACK_DEFAULT_SERVER", "default")
        raise Lost(
            f"no JACK server {server!r} runs here: start one, such as jackd -d alsa or jackd -d dummy, or PipeWire's"
        ) from None


def server(_say: object = None) -> dict[str, Any]:
    """What the running server is; Lost where there is none."""
    client = new_client("livebass-look")
    try:
        return {
            "rate": int(client.samplerate),
            "block": int(client.blocksize),
            "realtime": bool(client.realtime),
            "version": jack_module().version_string(),
        }
    finally:
        client.close(ignore_errors=True)


class Keys:
    """A MIDI output; each message goes out at an offset into some period, and `sent` has its frame."""

    def __init__(self) -> None:
        self.client = new_client("bench-keys")
        self.port = self.client.midi_outports.register("out")
        self.sent: int | None = None
        self._next: tuple[int, tuple[int, int, int]] | None = None
        self.client.set_process_callback(self._send)

    def _send(self, _frames: int) -> None:
        self.port.clear_buffer()
        if self._next is not None:
            (offset, message), self._next = self._next, None
            self.port.write_midi_event(offset, message)
            self.sent = self.client.last_frame_time + offset

    def send(self, offset: int, *message: int) -> None:
        status, first, second = message
        self.sent, self._next = None, (offset, (status, first, second))

    def close(self) -> None:
        self.client.deactivate(ignore_errors=True)
        self.client.close(ignore_errors=True)


class Ears:
    """An audio input that knows the frame of the first sample that is no silence since `listen`, and of every gap."""

    def __init__(self) -> None:
        self.client = new_client("bench-ears")
        self.port = self.client.inports.register("in")
        self.first: int | None = None
        self.gaps = self.silent = 0  # since `listen`; periods of silence up to now
        self._next: int | None = None
        self.client.set_process_callback(self._hear)

    def _hear(self, frames: int) -> None:
        now = self.client.last_frame_time
        if self._next is not None and now != self._next:
            self.gaps += 1
        self._next = (now + frames) % WRAP
        level = np.abs(self.port.get_array())
        if self.first is None:
            loud = np.flatnonzero(level > HEARD)
            if loud.size:
                self.first = now + int(loud[0])
        self.silent = self.silent + 1 if level.max() < SILENT else 0

    def listen(self) -> None:
        self.gaps, self.first = 0, None

    def close(self) -> None:
        self.client.deactivate(ignore_errors=True)
        self.client.close(ignore_errors=True)


def wait_for(what: Any, seconds: float) -> bool:
    """Whether the function `what` comes true within `seconds`."""
    end = time.monotonic() + seconds
    while not what():
        if time.monotonic() > end:
            return False
        time.sleep(0.002)
    return True
