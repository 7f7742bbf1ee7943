"""The page that watches the bass of `livebass play`: its files, and the stream of what the strings do.

A message of the stream is two lengths, uint32 little-endian, and behind them so many bytes of JSON and of SIGHTs. Its
JSON has the frame, contacts and notes as static/see.js takes them; with another bass than before also what the page
shows of it. Messages come as often as a screen shows pictures while a string sounds, else once a second.
"""

from __future__ import annotations

import json
import struct
import time
from collections.abc import Callable, Iterator
from typing import Any

from livebass.live.onlooker import Onlooker
from livebass.live.synth import Synth
from livebass.model.instrument import Instrument
from livebass.web.export import page_data, shell, shown, with_html

EVERY = 1 / 60  # s, between two pictures
QUIET = 1.0  # s, between two messages of a bass that is silent
LENGTHS = struct.Struct("<II")
STREAM = "watch"  # its place beside the page


def watch_files(bass: Instrument) -> dict[str, bytes]:
    """The files of the page, by their paths; it begins with `bass`."""
    page = page_data([_shown(bass)]) | {"watching": STREAM}
    return with_html(shell(), page)


def _shown(bass: Instrument) -> dict[str, Any]:
    """What the page shows of a bass: nothing there can be changed."""
    return shown(bass.name, bass) | {"bench": None, "cases": []}


def stream(synth: Callable[[], Synth | None]) -> Iterator[bytes]:
    """Yields what the bass of a synth does, or nothing new, every EVERY seconds; `synth` returns the one that plays."""
    onlooker: Onlooker | None = None
    told, sounded, sent = True, False, 0.0
    while True:
        playing = synth()
        bass = playing.bass if playing else None
        message = b""
        if playing is not None and bass is not None and bass.began is not None:
            if onlooker is None or onlooker.bass is not bass:
                onlooker, told = Onlooker(bass), False
            seen = onlooker.look(playing.frame)
            sounds = seen is not None and bool(seen.sights["slot"]["on"].any())
            if seen and (sounds or sounded or not told or time.monotonic() - sent > QUIET):
                said: dict[str, Any] = {"frame": seen.frame, "rate": playing.rate}
                said |= {"contacts": sum(seen.contacts, ()), "notes": sum(seen.notes, ())}
                if not told:
                    said["bass"] = _shown(bass.engine.instrument)
                told, sounded, sent = True, sounds, time.monotonic()
                line, sights = json.dumps(said, separators=(",", ":")).encode(), seen.sights.tobytes()
                message = LENGTHS.pack(len(line), len(sights)) + line + sights
        yield message
        time.sleep(EVERY)
