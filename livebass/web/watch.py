"""The page that watches the bass of `livebass play`: its files, and a stream of the strings' motion.

A message of the stream is two lengths, uint32 little-endian, then that many bytes of JSON and of SIGHTs. The JSON has
the frame, contacts and notes as static/neck/see.js takes them and, after a change of bass, the page's data for the new
bass. Messages come 60 times a second while a string sounds, else once a second.
"""

from __future__ import annotations

import json
import struct
import time
from collections.abc import Callable, Iterator
from typing import Any

from livebass.live.synth import Synth
from livebass.live.watch_stream import Watcher
from livebass.model.instrument import Instrument
from livebass.web.export import bass_data, page_data, shell, with_html

EVERY = 1 / 60  # s, between two pictures
QUIET = 1.0  # s, between two messages of a silent bass
LENGTHS = struct.Struct("<II")
STREAM = "watch"  # its place beside the page


def watch_files(bass: Instrument) -> dict[str, bytes]:
    """Returns the page's files, by path; it begins with `bass`."""
    page = page_data([_bass_data(bass)]) | {"watching": STREAM}
    return with_html(shell(), page)


def _bass_data(bass: Instrument) -> dict[str, Any]:
    """Returns the page's data of a bass; the page cannot change it."""
    return bass_data(bass.name, bass) | {"bench": None, "cases": []}


def stream(synth: Callable[[], Synth | None]) -> Iterator[bytes]:
    """Yields a message about the playing synth's bass, or no bytes, every EVERY seconds; `synth` returns that synth."""
    onlooker: Watcher | None = None
    announced, sounded, sent = True, False, 0.0
    while True:
        playing = synth()
        bass = playing.bass if playing else None
        message = b""
        if playing is not None and bass is not None and bass.began is not None:
            if onlooker is None or onlooker.bass is not bass:
                onlooker, announced = Watcher(bass), False
            seen = onlooker.look(playing.frame)
            sounds = seen is not None and bool(seen.sights["slot"]["on"].any())
            if seen and (sounds or sounded or not announced or time.monotonic() - sent > QUIET):
                said: dict[str, Any] = {"frame": seen.frame, "rate": playing.rate}
                said |= {"contacts": sum(seen.contacts, ()), "notes": sum(seen.notes, ())}
                if not announced:
                    said["bass"] = _bass_data(bass.engine.instrument)
                announced, sounded, sent = True, sounds, time.monotonic()
                line, sights = json.dumps(said, separators=(",", ":")).encode(), seen.sights.tobytes()
                message = LENGTHS.pack(len(line), len(sights)) + line + sights
        yield message
        time.sleep(EVERY)
