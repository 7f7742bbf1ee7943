"""Words for what kernels find in a file: a sentence for each code.

{0}, {1} ... stand for its numbers, {0:+} for one with its sign.
The page has the same table. Of two sentences the first is for a number {0} of one.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from livebass.kernels.score import remarks as choice
from livebass.kernels.score import smf as codes
from livebass.kernels.score.lines import LONGEST, MAX_PARTS

PLACE = "track {0} of {1}, byte {2}"
_IN_HEADER = (codes.HEADER_LENGTH, codes.HEADER)
_PARTS = {
    codes.HEADER_LENGTH: "header length", codes.HEADER: "header", codes.CHUNK_NAME: "chunk name", codes.CHUNK: "chunk",
    codes.DELTA_TIME: "delta time", codes.EVENT: "event", codes.META_EVENT: "meta event",
    codes.META_LENGTH: "meta event length", codes.EXCLUSIVE_LENGTH: "system exclusive length",
    codes.EXCLUSIVE_DATA: "system exclusive", codes.SYSTEM_MESSAGE: "system message", codes.MESSAGE_DATA: "message",
}  # fmt: skip
NO_BASS = "no channel has a bass program, 33 to 40, and no track is called bass"
_CALLED = "no channel has a bass program, 33 to 40: plays the track"
_FRAMES = "24, 25, 29 or 30 frames of 1 to 255 ticks"

ERRORS: dict[int, str] = {
    codes.EMPTY: "the file is empty (0 bytes)",
    codes.NO_MIDI: "RIFF file without a chunk of MIDI data: the file is truncated or damaged",
    codes.FOREIGN: "not a Standard MIDI File (it does not begin with MThd)",
    codes.SHORT_HEADER: "header, byte 4: the header's length must be 6 or more, not {3}",
    codes.BAD_KIND: "its type must be 0 (one track), 1 (tracks together) or 2 (patterns), not {3}",
    codes.NO_TICKS: "header, byte 12: ticks per quarter note must be from 1 to 32767, not 0",
    codes.BAD_TIME_CODE: f"header, byte 12: the time code must be {_FRAMES}, not {{3}} of {{4}}",
    codes.NO_TRACK: f"{PLACE}: no track chunk (MTrk) behind it: the file is damaged",
    codes.NO_STATUS: f"{PLACE}: data byte 0x{{3:02X}} without a status byte before it",
    codes.TOO_MANY: f"has {{3}} events, more than {codes.MAX_EVENTS}",
    **{
        codes.CUT + part: f"{'header, byte {2}' if part in _IN_HEADER else PLACE}: {name} of {{3}} bytes, {{4}} left: "
        "the file is truncated or damaged"
        for part, name in _PARTS.items()
    },
    **{
        codes.LONG + part: f"{PLACE}: {_PARTS[part]} longer than 4 bytes"
        for part in (codes.DELTA_TIME, codes.META_LENGTH, codes.EXCLUSIVE_LENGTH)
    },
}


def _counted(one: str, several: str) -> tuple[str, str]:
    """The sentences about one and several faults; the place of the first is in numbers {1} to {3}."""
    place = "track {1} of {2}, byte {3}"
    return f"{one} ({place})", f"{several} (first at {place})"


REMARKS: dict[int, str | tuple[str, str]] = {
    codes.STRAYS: _counted("skipped {0} run of stray bytes", "skipped {0} runs of stray bytes"),
    codes.BAD_TEMPOS: _counted(
        "ignored {0} tempo event of 0 us or other than 3 bytes",
        "ignored {0} tempo events of 0 us or other than 3 bytes",
    ),
    codes.SYSTEMS: _counted(
        "skipped {0} system message that files cannot have", "skipped {0} system messages that files cannot have"
    ),
    codes.HIGH_BYTES: _counted("took {0} data byte above 0x7F for 0x7F", "took {0} data bytes above 0x7F for 0x7F"),
    codes.BEFORE: "skipped {0} bytes before the header",
    codes.SHORTER: "track {0} of {1} is {2} bytes shorter than it says",
    codes.LONGER: "track {0} of {1} is {2} bytes longer than it says",
    codes.FEWER: "has {0} of the {1} tracks that its header promises",
    codes.MORE: "has {0} tracks, not {1} as its header says: plays all",
    codes.PATTERNS: "has {0} patterns (type 2): plays number {1}",
}
CHOICE: dict[int, str | tuple[str, str]] = {
    choice.STRING_CHANNELS: "plays channels {0} to {1} as one instrument, a channel a string",
    choice.NOTE_CHANNELS: "plays channels {0} to {1} as one instrument, a channel a note",
    choice.PORTAMENTO: "ignored controller 5 (portamento time, {0} times): it bends only in takes of livebass",
    choice.TUNING: "ignored a master tuning of {0:+} cents (system exclusive); --a4 {1}.{2} tunes the bass so",
    choice.TUNINGS: "ignored {0} master tunings (system exclusive), {1:+} to {2:+} cents",
    choice.SCALE_TUNING: "ignored a tuning of single notes (system exclusive); --temperament tunes the bass",
    choice.CALLED: (f"{_CALLED} called {{1}}", f"{_CALLED}s called {{1}}"),  # number of the names; the names
    choice.ONLY_PART: f"{NO_BASS}: plays the only part, {{0}}",  # the part
    choice.LOWEST_PART: f"{NO_BASS}: plays the part that lies in a bass's range, {{0}}",
    choice.DOUBLES: "track {0} (channel {1}) doubles track {2} (channel {3}) and is left out",
    choice.VARIANTS: "is a Yamaha style: of up to {0} variants of its bass for different chords, plays the first",
}
REASONS: dict[int, str] = {
    choice.NO_REASON: "",
    choice.REQUESTED: "as asked for",
    choice.OTHER_CHANNEL: "not channel {0}",  # the one that was requested
    choice.OTHER_PART: "not the chosen part",
    choice.A_TAKE: "a take of livebass",
    choice.DRUMS: "drums",
    choice.BASS_PROGRAM: "bass program",
    choice.NO_BASS_PROGRAM: "no bass program",
    choice.CALLED_BASS: "called bass",
    choice.NOT_CALLED_BASS: "not called bass",
    choice.CHANNEL_A_STRING: "a channel a string, or MPE",
    choice.NOT_OF_INSTRUMENT: "no part of that instrument",
    choice.THE_ONLY_PART: "the only part",
    choice.LOW_PART: "in a bass's range, the lowest",
    choice.HIGHER_PART: "higher, or another program",
    choice.NO_BASS: "no bass program, not called bass",
    choice.DOUBLE: "doubles another part",
    choice.OF_STYLE: "the bass of a style",
    choice.NOT_OF_STYLE: "another part, or another variant of the bass",
    choice.UNLIKE: "called bass, but its program is a voice, wind, mallet or drum",
}
TOO_MUCH = f"its tracks share channels: would make more than {codes.MAX_EVENTS} messages or {MAX_PARTS} parts"
TOO_LONG = f"lasts {{0}} hours, more than {LONGEST // 3600}"


def sentence(of: str | tuple[str, str], numbers: Sequence[Any]) -> str:
    """Puts `numbers`, or words that stand for them, into a sentence of a table."""
    text = of if isinstance(of, str) else of[int(numbers[0] > 1)]
    return text.format(*numbers)
