"""A synth that plays as fast as the clock, and the page that watches it."""

from __future__ import annotations

import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager

from livebass import Quality, load_preset
from livebass.live.fake import FakeDevice
from livebass.live.synth import Synth
from livebass.web.serve import PageServer
from livebass.web.watch import STREAM, stream, watch_files
from support.live import synth_and_device

FINE = Quality("fine", 150, 240e3)
TOKEN = "a-token"


@contextmanager
def playing(synth: Synth, device: FakeDevice) -> Iterator[None]:
    """Plays in a thread, about as fast as the clock."""
    end = threading.Event()

    def play() -> None:
        while not end.is_set():
            device.block(480)
            time.sleep(0.01)

    thread = threading.Thread(target=play)
    thread.start()
    try:
        yield
    finally:
        end.set()
        thread.join()


@contextmanager
def watched() -> Iterator[tuple[PageServer, Synth]]:
    """A server of the page, and the synth that it shows."""
    synth, device = synth_and_device("jazz-finger", FINE)
    files = watch_files(load_preset("jazz-finger"))
    with (
        PageServer(files, streams={STREAM: lambda: stream(lambda: synth)}, token=TOKEN) as server,
        playing(synth, device),
    ):
        yield server, synth
