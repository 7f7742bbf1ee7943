"""Shows an onlooker the strings of a playing bass: shapes, contacts, notes. [any thread of Python]

The audio thread is unaware of it: it keeps its last contacts and events in rings anyway (kernels/string/reports.py),
and a reader who collides with a write reads again. Strings that run ahead of the clock are shown as computed;
contacts and notes are reported once they are heard, as they may be revoked before.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from livebass.kernels.string.records import HAMMER, PLUCK, PULL_OFF, STRIKE_EVENT, THROW
from livebass.live.synth import LiveBass
from livebass.live.thread.sight import SIGHT, see_bass, see_contact

TRIES = 8  # attempts to read a bass between two of its frames
STRUCK = (STRIKE_EVENT, THROW, HAMMER, PULL_OFF)  # events that begin a note at once


@dataclass(frozen=True)
class View:
    """The state of a bass at a frame of the synth, and the events since the last look."""

    frame: int
    sights: NDArray[np.void]  # SIGHT (strings,)
    contacts: list[tuple[int, float, float, float]]  # string; fret, or m from the nut on a fretless board; frame; m/s
    notes: list[tuple[int, int, int]]  # string, fret, and the frame of its release or strike


class Watcher:
    """Looks at one bass; the reader must keep it from being freed, as this does."""

    def __init__(self, bass: LiveBass) -> None:
        self.bass = bass
        engine = bass.engine
        self._voices = [voice.record[0] for voice in engine.voices]
        self._logs = [voice.log for voice in engine.voices]
        self._reports = [engine.bass.ring_of_events(i) for i in range(engine.strings)]
        self._last = np.zeros(engine.strings, SIGHT)
        self._contacts = [int(v["logged"]) for v in self._voices]  # the number reported so far
        self._events = [(int(reports["from_frame"][0]), 0) for reports, _ in self._reports]

    def look(self, frame: int) -> View | None:
        """Returns the news up to `frame` of the synth; None: the bass has not begun."""
        began = self.bass.began
        if began is None:
            return None
        contacts: list[tuple[int, float, float, float]] = []
        notes: list[tuple[int, int, int]] = []
        for i in range(len(self._voices)):
            self._take_contacts(i, began, frame, contacts)
            self._take_notes(i, began, frame, notes)
        return View(frame, self._sights(), contacts, notes)

    def _sights(self) -> NDArray[np.void]:
        """The shapes; each string's is from one moment."""
        sights = np.zeros(len(self._voices), SIGHT)
        for _ in range(TRIES):  # if it plays meanwhile, the last shapes stay
            before = [int(v["frame"]) for v in self._voices]
            see_bass(self.bass.address, sights.ctypes.data)
            if before == [int(v["frame"]) for v in self._voices]:
                self._last = sights
                break
        return self._last

    def _take_contacts(self, i: int, began: int, end: int, found: list[tuple[int, float, float, float]]) -> None:
        voice, log = self._voices[i], self._logs[i]
        logged = int(voice["logged"])
        first = max(min(self._contacts[i], logged), logged - len(log) // 2)  # older ones may be overwritten meanwhile
        steps = int(voice["numerator"]) / int(voice["denominator"])
        for k in range(first, logged):
            contact = log[k % len(log) :][:1].copy()
            at = began + int(contact["step"][0]) / steps
            if at > end:
                logged = k
                break
            place = see_contact(self.bass.address, i, contact.ctypes.data)
            found.append((i, place, at, float(contact["speed"][0])))
        self._contacts[i] = logged

    def _take_notes(self, i: int, began: int, end: int, found: list[tuple[int, int, int]]) -> None:
        voice, (reports, events) = self._voices[i], self._reports[i]
        from_frame, count = int(reports["from_frame"][0]), int(voice["report_count"])
        before, taken = self._events[i]
        first = max(min(taken if before == from_frame else 0, count), count - len(events) // 2)
        for k in range(first, count):
            event = events[k % len(events)].copy()
            at = began + int(event["frame"])
            if at > end:
                count = k
                break
            if event["kind"] == PLUCK:
                found.append((i, int(event["fret"]), at + int(voice["wait"]) + int(voice["pull"])))
            elif event["kind"] in STRUCK:
                found.append((i, int(event["fret"]), at))
        self._events[i] = from_frame, count
