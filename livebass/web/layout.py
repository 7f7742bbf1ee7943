"""Tells the page's JavaScript the layout of the kernels' records, their numbers and their entries."""

from __future__ import annotations

import json
from typing import Any

import numpy as np

from livebass.compiling import Entry
from livebass.kernels.bass.bench import BENCH, BENCH_STRING
from livebass.kernels.bass.change import BENCH_PLACE, CHANGE, make_change, measure_change
from livebass.kernels.bass.check import GOOD, check_file
from livebass.kernels.bass.instrument import COARSE, FILE
from livebass.kernels.bass.kept import KEPT
from livebass.kernels.bass.pool import POOL, fill_pool, measure_pool
from livebass.kernels.bass.records import BASS
from livebass.kernels.bass.setup import BUILDING, fill_bass, measure_bass
from livebass.kernels.effects.response import cut_response
from livebass.kernels.player import words
from livebass.kernels.player.constants import CONTROLLERS, FINGER, PICK
from livebass.kernels.player.performer import ANY, CHANNEL, CHANNELS, FREE, MAX_STRINGS, PERFORMER
from livebass.kernels.score import choosing, low_keys, memory, reading, remarks, smf
from livebass.kernels.score import records as score
from livebass.kernels.string import frets, records
from livebass.kernels.string.board import over_board
from livebass.kernels.string.note import CROWN_ABOVE, MADE
from livebass.kernels.string.preparing import DONE, NOTE
from livebass.kernels.string.records import CONTACT, EVENT, LINE, OPERATOR, SLOT, STRING, VOICE, WORK
from livebass.kernels.string.reports import REPORTS, begin_again
from livebass.kernels.voice import run_string
from livebass.live.thread import ahead, block, ring, setup, sight
from livebass.live.thread.records import CHUNK, SYNTH
from livebass.rows.techniques import (
    BUTTONS,
    CC_PARAMETER,
    FUNCTION_ROWS,
    GAIN_DB,
    OF_CHANNEL,
    PARAMETER,
    TECHNIQUE_ROWS,
)

RECORDS = {
    "FILE": FILE, "POOL": POOL, "BUILDING": BUILDING, "SYNTH": SYNTH, "BASS": BASS, "PERFORMER": PERFORMER,
    "SIGHT": sight.SIGHT, "SLOT_SIGHT": sight.SLOT_SIGHT, "STRING": STRING, "VOICE": VOICE, "CONTACT": CONTACT,
    "SLOT": SLOT, "WORK": WORK, "REPORTS": REPORTS, "EVENT": EVENT, "BENCH": BENCH, "BENCH_STRING": BENCH_STRING,
    "NOTE": NOTE,
    "CHANGE": CHANGE, "OPERATOR": OPERATOR, "CHANNEL": CHANNEL, "SMF": score.SMF, **score.ROWS,
    "SCORE": memory.SCORE, "LISTED": memory.LISTED, "PLAYED": memory.PLAYED, "FITTING": low_keys.FITTING,
}  # fmt: skip
NUMBERS = {
    "COARSE": COARSE, "GOOD": GOOD, "DONE": DONE, "LINE": LINE, "CHUNK": CHUNK, "NOW": ring.NOW, "FREE": FREE,
    "PARAMETER": PARAMETER, "NOTE_STRING": words.NOTE_STRING,
    "STRING_REST": words.STRING_REST, "MAX_STRINGS": MAX_STRINGS,
    "SEEN": sight.SEEN, "FINGER": FINGER, "PICK": PICK, "GAIN_DB": GAIN_DB,
    "CC_PARAMETER": CC_PARAMETER, "CONTROLLERS": CONTROLLERS, "MADE": MADE, "CROWN_ABOVE": CROWN_ABOVE,
    "CHANNELS": CHANNELS, "ANY": ANY, "BENCH_PLACE": BENCH_PLACE, "NO_CHANNEL": score.NO_CHANNEL,
    "ROWS": {name: kind for kind, name in enumerate(score.ROWS)},
    "FITTING_WORDS": low_keys.FITTING_WORDS,
    **{name: getattr(smf, name) for name in ("META_TEXT", "META_TRACK_NAME", "META_INSTRUMENT")},
    **{name: getattr(choosing, name) for name in ("AUTO", "OF_PART")},
    **{name: getattr(remarks, name) for name in ("CALLED", "ONLY_PART", "LOWEST_PART", "DOUBLES")},
    **{
        name: getattr(memory, name)
        for name in ("IS_BASS", "IS_OTHER", "IS_DRUMS", "BASS_INSTRUMENT", "NAMED", "NAMES", "TRACK_NAME", "TOO_LONG")
    },
    **{kind: getattr(records, kind) for kind in ("PLUCK", "STRIKE_EVENT", "THROW", "HAMMER", "PULL_OFF")},
}  # fmt: skip
# For each way to play: its switch; the performer's field that its controller moves, if any; and whether that
# field belongs to a channel
WAYS = {
    b.symbol: (
        TECHNIQUE_ROWS[b.symbol].number,
        FUNCTION_ROWS[b.symbol].field if b.symbol in FUNCTION_ROWS else "",
        b.symbol in OF_CHANNEL,
    )
    for b in BUTTONS
    if not b.strikes
}
CALLED: tuple[Entry, ...] = (block.process, ahead.play_string, frets.over_frets, over_board)  # by kernels, by address
ENTRIES: tuple[Entry, ...] = (
    check_file, measure_pool, fill_pool, measure_bass, fill_bass, setup.ring_bytes, setup.fill_synth,
    ring.push_message, ring.push_event, block.relieve, sight.see_bass, sight.see_contact, begin_again,
    run_string, measure_change, make_change, cut_response, smf.measure_smf, smf.fill_smf,
    reading.measure_lines, reading.read_lines, reading.read_parts_of, reading.choose_notes, reading.describe_part,
    reading.frame_at_tick, low_keys.leave_switches, low_keys.raise_notes, *CALLED,
)  # fmt: skip


def layout() -> str:
    """Returns a line of JavaScript that defines LAYOUT.

    Its `ways` are WAYS; its `records` hold their bytes and the offset and kind of each field: "i8", "i4", "i2", "f8",
    "f4" or "u1".
    """
    found = {"records": {name: record(of) for name, of in RECORDS.items()}, "numbers": NUMBERS, "ways": WAYS}
    called = [entry.name for entry in CALLED]
    return f"const LAYOUT = {json.dumps(found | {'called': called}, separators=(',', ':'))};\n"


def record(of: np.dtype[np.void]) -> dict[str, Any]:
    """Returns a record's bytes and its fields; a field that is a record or an array of records has an empty kind.

    Fields of an inner record are called "record.field"; of a KEPT only NUMBERS tell a place.
    """
    assert of.fields
    fields: dict[str, list[Any]] = {}
    for name, (kind, offset, *_) in of.fields.items():
        base = kind.subdtype[0] if kind.subdtype else kind
        fields[name] = [offset, "" if base.fields else base.str[1:]]
        if kind.fields and kind != KEPT:
            inner = record(kind)["fields"]
            fields |= {f"{name}.{field}": [offset + at, of_kind] for field, (at, of_kind) in inner.items()}
    return {"bytes": of.itemsize, "fields": fields}
