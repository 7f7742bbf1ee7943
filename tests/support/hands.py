"""The performer alone, messages in and events out, and basses for it."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace
from functools import cache

import numpy as np
from numpy.typing import NDArray

from livebass.engine.engine import Engine
from livebass.engine.prepare import bass_numbers, new_performer, take_message
from livebass.kernels.player import performer
from livebass.kernels.string import records as at
from livebass.model.instrument import Instrument
from livebass.model.quality import Quality
from livebass.rows import techniques
from support.messages import off, on
from support.own_basses import load_preset

FEW = Quality("few", 30, 192e3)  # modes do not matter here
FREE = performer.FREE
STRINGS = "EADG"


# Reading and checking a preset takes 0.1 s, and random tests ask for one in every example.
loaded = cache(load_preset)


@cache
def engine_of(instrument: Instrument) -> Engine:
    """An engine of few modes: only its operators are used."""
    return Engine(instrument, FEW, 48000)


def bass(preset: str = "jazz-finger", **player: object) -> Instrument:
    """The bass of `preset`, played evenly unless the fields of `player` say otherwise."""
    instrument = loaded(preset)
    return replace(instrument, player=replace(instrument.player, **{"unevenness": 0.0, **player}))  # type: ignore[arg-type]


def bass_tuned(open_notes: Sequence[int], frets: int = 20, **player: object) -> Instrument:
    """Strings like the jazz bass's E, tuned to `open_notes`."""
    model = bass(**player)
    strings = tuple(replace(model.strings[0], name=f"S{n}", open_note=n) for n in open_notes)
    neck = model.necks[0]
    neck = replace(neck, fret_positions=neck.fret_positions[:frets], fret_heights=neck.fret_heights[:frets])
    return replace(model, strings=strings, necks=(neck,) * len(strings))


def of_any(performer_record: NDArray[np.void]) -> np.void:
    """The settings last made by any channel, from the record of a performer, (1,) or a single one."""
    return np.atleast_1d(performer_record)[0]["controls"]["channel"][performer.ANY]


class Hands:
    """The performer alone, messages in, events out."""

    def __init__(self, instrument: Instrument | None = None, string: int | None = None, switches: bool = False):
        """Plays `instrument`, or only its string `string`, so that a key is a fret. `switches`: low keys switch."""
        instrument = instrument or bass()
        engine = engine_of(replace(instrument, player=loaded("jazz-finger").player))
        self.ops = engine.pool.records
        record = new_performer(bass_numbers(instrument, [], engine.frets))
        if string is not None:
            self.ops = self.ops[string : string + 1]
            record["strings"], record["open"][0, 0] = 1, instrument.strings[string].open_note
            record["slapped"] = max(0, int(record["slapped"][0]) - string)
        if not switches:
            record["key_map"]["action"] = techniques.NO_SWITCH
        self.record, self.p = record, record[0]
        self.frame = 0

    def __call__(self, *messages: Sequence[int]) -> NDArray[np.void]:
        """The events of `messages`."""
        events = np.zeros(1000, at.EVENT)
        count = 0
        for message in messages:
            before = count
            count = take_message(self.record, self.ops, self.frame, message, events, count)
            assert before <= count <= before + performer.MAX_EVENTS
        return events[:count]

    def first(self, key: int, velocity: int = 90) -> np.void:
        """The event of a note, as uneven as the first of a performance."""
        self.p["notes"] = 0
        (event,) = self(on(key, velocity))
        return event

    def plays(self, key: int, velocity: int = 90) -> tuple[int, int]:
        """The string and fret chosen for `key`."""
        (event,) = self(on(key, velocity))
        assert event["kind"] in (at.PLUCK, at.STRIKE_EVENT)
        return int(event["string"]), int(event["fret"])

    def tab(self, keys: Iterable[int], overlap: bool = False) -> str:
        """The places of keys, such as E0 A2; a note ends before the next begins, or just after (`overlap`)."""
        said, last = [], None
        for key in keys:
            if last is not None and not overlap:
                self(off(last))
            string, fret = self.plays(key)
            said.append(f"{STRINGS[string]}{fret}")
            if last is not None and overlap:
                self(off(last))
            last = key
        return " ".join(said)

    def strings(self, field: str) -> list[int]:
        return [int(x) for x in self.p["hands"][field][: self.p["strings"]]]

    @property
    def any(self) -> np.void:
        """The settings last made by any channel."""
        return of_any(self.record)

    def string_of(self, key: int) -> int:
        (i,) = [i for i, (k, s) in enumerate(zip(self.strings("key"), self.strings("state"), strict=True))
                if k == key and s != FREE]  # fmt: skip
        return i
