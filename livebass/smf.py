"""Standard MIDI Files: from bytes to messages with ticks. An error names the track and the byte.

Real files have harmless damage, which only causes a warning: a header with the wrong number of tracks, wrong track
lengths, stray bytes before the header or between chunks, data bytes above 0x7F, real-time messages within a track,
impossible tempos. From a RIFF file (.rmi) it reads the file inside.
"""

from __future__ import annotations

from collections import defaultdict
from dataclasses import dataclass
from typing import NamedTuple

from livebass.kinds import HEAD, SCORES, TEXT_TAB, kind_of, kind_of_name
from livebass.tracknames import decode

SMPTE_RATES = {24: (24, 1), 25: (25, 1), 29: (30_000, 1001), 30: (30, 1)}  # frames/s as a fraction
META_TEXT, META_TRACK_NAME, META_INSTRUMENT, META_CHANNEL, META_PORT = 0x01, 0x03, 0x04, 0x20, 0x21
META_END, META_TEMPO = 0x2F, 0x51
LONGEST_NAME = 40  # characters of a track's name that are kept
CHUNK_HEAD = 8  # bytes: name and length
HEADER, TRACK = b"MThd", b"MTrk"
MOST_BEFORE = 4096  # bytes before the header: a MacBinary file has 128
NO_CHANNEL = -1
MARK = "livebass plays "  # begins the text in a take that names its bass
SYSTEM_COMMON = {0xF1: 1, 0xF2: 2, 0xF3: 1}  # data bytes; system messages from 0xF4 on have none


class SmfError(ValueError):
    """Bytes are not a Standard MIDI File, or not a playable one. The message names the place."""


class Message(NamedTuple):
    """A channel message."""

    status: int
    first: int  # data byte: a note, a controller or a program ...
    second: int = 0  # ... a velocity or a value

    @property
    def kind(self) -> int:
        return self.status & 0xF0

    @property
    def channel(self) -> int:
        return self.status & 0x0F


class SmfMessage(NamedTuple):
    """A channel message of a file."""

    tick: int
    message: Message
    track: int  # from 0
    port: int  # from 0


class SystemExclusive(NamedTuple):
    """A system exclusive message of a file."""

    tick: int
    data: bytes  # without F0 and F7
    port: int  # from 0


@dataclass(frozen=True)
class Smf:
    """The content of a Standard MIDI File. Ticks count from the start of the file."""

    ticks_per_quarter: int  # 0 if time is in SMPTE frames
    ticks_per_second: tuple[int, int]  # numerator, denominator; (0, 1) if time is in quarter notes
    messages: tuple[SmfMessage, ...]  # by tick, track and place in the track
    tempos: tuple[tuple[int, int], ...]  # (tick, us per quarter note) by tick
    names: tuple[str, ...]  # of the tracks; "": it has none
    instruments: tuple[str, ...]  # the tracks' instruments by name; "": it has none
    channel_names: dict[tuple[int, int], str]  # by (track, channel), both from 0, after a channel prefix
    exclusive: tuple[SystemExclusive, ...]  # by tick
    end_tick: int  # of the last track to end
    warnings: tuple[str, ...]  # a line each, about harmless damage
    texts: frozenset[str] = frozenset()  # at tick 0, beside the names
    marks: tuple[tuple[int, str], ...] = ()  # (tick, text) of texts that begin with MARK, by tick


class _Bytes:
    """A cursor over `data` up to `end`. Its errors name `place` and the byte."""

    def __init__(self, data: bytes, start: int, end: int, place: str) -> None:
        self.data, self.at, self.end, self.place = data, start, end, place

    def fail(self, what: str, at: int | None = None) -> SmfError:
        return SmfError(f"{self.place}, byte {self.at if at is None else at}: {what}")

    def take(self, count: int, what: str) -> bytes:
        """Reads `count` bytes; `what`: their name in an error."""
        if self.at + count > self.end:
            left = self.end - self.at
            raise self.fail(f"{what} of {count} bytes, {left} left: the file is truncated or damaged")
        self.at += count
        return self.data[self.at - count : self.at]

    def number(self, what: str) -> int:
        """Reads a variable-length quantity, of at most 4 bytes."""
        start, value = self.at, 0
        for _ in range(4):
            byte = self.take(1, what)[0]
            value = value << 7 | byte & 0x7F
            if byte < 0x80:
                return value
        raise self.fail(f"{what} longer than 4 bytes", start)


class _Track:
    """The content of one track, as far as it is read."""

    def __init__(self) -> None:
        self.at = 0  # the byte after the last one read
        self.ended = False  # by its End of Track
        self.tick = 0  # of the last event read
        self.messages: list[SmfMessage] = []
        self.exclusive: list[SystemExclusive] = []
        self.tempos: list[tuple[int, int]] = []
        self.names: dict[tuple[int, int], bytes] = {}  # by channel or NO_CHANNEL, and kind of meta event
        self.texts: list[bytes] = []
        self.marks: list[tuple[int, str]] = []
        self.oddities: list[tuple[str, int]] = []  # what, with {} for their number, and the byte


def parse_smf(data: bytes, name: str = "") -> Smf:
    """Parses a Standard MIDI File. Raises SmfError, with track and byte, for any other or too damaged bytes.

    name: of the file, for an error about other bytes.
    """
    if not data:
        raise SmfError("the file is empty (0 bytes)")
    warnings = []
    if data[:4] == b"RIFF" and data[8:12] == b"RMID":
        data = _in_riff(data)
    start = data.find(HEADER, 0, MOST_BEFORE)
    if start < 0:
        raise SmfError(_other_kind(data, name))
    if start > 0:
        warnings.append(f"skipped {start} bytes before the header")
        data = data[start:]
    file = _Bytes(data, 4, len(data), "header")
    size = int.from_bytes(file.take(4, "header length"))
    if size < 6:
        raise SmfError(f"header, byte 4: the header's length must be 6 or more, not {size}")
    body = file.take(size, "header")
    kind, count, division = (int.from_bytes(body[i : i + 2]) for i in (0, 2, 4))
    if kind not in (0, 1, 2):
        raise SmfError(f"its type must be 0 (one track), 1 (tracks together) or 2 (patterns), not {kind}")
    per_quarter, per_second = _division(division)
    tracks: list[_Track] = []
    odd: dict[str, list[str]] = defaultdict(list)  # places of harmless oddities, by kind
    while _seek_track(file, len(tracks) + 1, count, odd):
        tracks.append(_read_next_track(file, len(tracks)))
        for what, at in tracks[-1].oddities:
            odd[what].append(f"{file.place}, byte {at}")
    if not tracks:
        file.at = 8 + size
        file.take(4, "chunk name")
        raise file.fail("no track chunk (MTrk) behind it: the file is damaged")
    for what, places in odd.items():
        count_of = what.format(len(places), s="s" * (len(places) > 1))
        where = f"{'first at ' * (len(places) > 1)}{places[0]}"
        warnings.append(f"{count_of} ({where})" if "{}" in what else what)
    if len(tracks) < count:
        warnings.append(f"has {len(tracks)} of the {count} tracks that its header promises")
    elif len(tracks) > count:
        warnings.append(f"has {len(tracks)} tracks, not {count} as its header says: plays all")
    if kind == 2 and len(tracks) > 1:
        played = next((number for number, track in enumerate(tracks) if track.messages), 0)
        warnings.append(f"has {len(tracks)} patterns (type 2): plays number {played + 1}")
        tracks = [track if number == played else _Track() for number, track in enumerate(tracks)]
    names = [(number, *which) for number, track in enumerate(tracks) for which in track.names]
    texts = decode([*(data for t in tracks for data in t.names.values()), *(data for t in tracks for data in t.texts)])
    called = dict(zip(names, map(_shown, texts[: len(names)]), strict=True))
    titles, instruments = (
        [called.get((number, NO_CHANNEL, meta), "") for number in range(len(tracks))]
        for meta in (META_TRACK_NAME, META_INSTRUMENT)
    )
    return Smf(
        ticks_per_quarter=per_quarter,
        ticks_per_second=per_second,
        messages=tuple(sorted((m for t in tracks for m in t.messages), key=lambda m: m.tick)),
        tempos=tuple(sorted((m for t in tracks for m in t.tempos), key=lambda m: m[0])),
        names=tuple(title or instrument for title, instrument in zip(titles, instruments, strict=True)),
        instruments=tuple(instruments),
        channel_names={(n, channel): text for (n, channel, _), text in called.items() if channel != NO_CHANNEL},
        exclusive=tuple(sorted((m for t in tracks for m in t.exclusive), key=lambda m: m.tick)),
        end_tick=max(track.tick for track in tracks),
        warnings=tuple(warnings),
        texts=frozenset(map(_shown, texts[len(names) :])),
        marks=tuple(sorted((m for t in tracks for m in t.marks), key=lambda m: m[0])),
    )


def _other_kind(data: bytes, name: str) -> str:
    """Names a file that is not MIDI, and says what to do."""
    kind = kind_of(data[:HEAD]) or kind_of_name(name)
    if kind is None:
        return "not a Standard MIDI File (it does not begin with MThd)"
    if kind == TEXT_TAB:
        return f"is {kind}, which does not tell the lengths of its notes: livebass reads Guitar Pro and MusicXML files"
    if kind in SCORES:
        return f"is {kind}, not a MIDI file: export MIDI or MusicXML from the program that wrote it"
    return f"is {kind}, not a MIDI file"


def _in_riff(data: bytes) -> bytes:
    """The Standard MIDI File in a RIFF file: its chunk "data"."""
    at = 12
    while at + CHUNK_HEAD <= len(data):
        size = int.from_bytes(data[at + 4 : at + CHUNK_HEAD], "little")
        if data[at : at + 4] == b"data":
            return data[at + CHUNK_HEAD : at + CHUNK_HEAD + size]
        at += CHUNK_HEAD + size + size % 2
    raise SmfError("RIFF file without a chunk of MIDI data: the file is truncated or damaged")


def _division(word: int) -> tuple[int, tuple[int, int]]:
    """Ticks per quarter note and per second (numerator, denominator); the unused one is zero."""
    if word & 0x8000 == 0:
        if word == 0:
            raise SmfError("header, byte 12: ticks per quarter note must be from 1 to 32767, not 0")
        return word, (0, 1)
    frames, ticks = 256 - (word >> 8), word & 0xFF
    if frames not in SMPTE_RATES or ticks == 0:
        rule = "24, 25, 29 or 30 frames of 1 to 255 ticks"
        raise SmfError(f"header, byte 12: the time code must be {rule}, not {frames} of {ticks}")
    over, under = SMPTE_RATES[frames]
    return 0, (over * ticks, under)


def _is_chunk(data: bytes, at: int) -> bool:
    """True if a chunk may begin here: a track, or four printable characters and a length within the file."""
    name, size = data[at : at + 4], int.from_bytes(data[at + 4 : at + CHUNK_HEAD])
    fits = at + CHUNK_HEAD + size <= len(data)
    return name == TRACK or (len(name) == 4 and fits and all(0x20 <= byte < 0x7F for byte in name))


def _seek_track(file: _Bytes, number: int, count: int, odd: dict[str, list[str]]) -> bool:
    """Moves to the next track chunk, `number` of the `count` promised, past other chunks and stray bytes.

    False if there is none, or another file begins first.
    """
    file.place = f"track {number} of {max(number, count)}"
    at, data = file.at, file.data
    while _is_chunk(data, at) and data[at : at + 4] not in (HEADER, TRACK):
        at += CHUNK_HEAD + int.from_bytes(data[at + 4 : at + CHUNK_HEAD])
    if data[at : at + 4] != TRACK:
        another = data.find(HEADER, file.at)
        at = data.find(TRACK, file.at, another if another >= 0 else len(data))
        if at >= 0:
            odd["skipped {} run{s} of stray bytes"].append(f"{file.place}, byte {file.at}")
    if at < 0 or at + CHUNK_HEAD > file.end:
        return False
    file.at = at
    return True


def _read_next_track(file: _Bytes, number: int) -> _Track:
    """Reads the track chunk at which `file` is, and leaves `file` behind it. `number` counts tracks from 0.

    A track ends with its chunk. If the chunk's length is wrong, as neither a chunk nor the end of the file follows it,
    the track ends at its End of Track, or where the next track begins.
    """
    start = file.at + CHUNK_HEAD
    end = start + int.from_bytes(file.data[start - 4 : start])
    if end == file.end or _is_chunk(file.data, end):
        track = _read_track(_Bytes(file.data, start, end, file.place), number)
        early = track.ended and file.data[track.at : track.at + 4] == TRACK
        file.at = track.at if early else end
    else:
        track = _read_to_its_mark(file, start, end, number)
        file.at = track.at
    if file.at != end:
        off = f"{end - file.at} bytes shorter" if file.at < end else f"{file.at - end} bytes longer"
        track.oddities.append((f"{file.place} is {off} than it says", start - CHUNK_HEAD))
    return track


def _read_to_its_mark(file: _Bytes, start: int, end: int, number: int) -> _Track:
    """Reads a track from `start` whose chunk claims a wrong `end`."""
    following = file.data.find(TRACK, start)
    limit = following if following >= 0 else file.end
    try:
        track = _read_track(_Bytes(file.data, start, limit, file.place), number)
        if track.ended or following >= 0 or end > file.end:
            return track
    except SmfError:
        if end > file.end:
            file.at = start
            file.take(end - start, "chunk")  # raises: cut off within an event
    return _read_track(_Bytes(file.data, start, end, file.place), number)


def _read_track(cursor: _Bytes, number: int) -> _Track:
    """Reads a track up to its End of Track, which may be missing."""
    track, running, port, prefix = _Track(), 0, 0, NO_CHANNEL
    ports: set[int] = set()
    while cursor.at < cursor.end and not track.ended:
        track.tick += cursor.number("delta time")
        start = cursor.at
        status = cursor.take(1, "event")[0]
        if status == 0xFF:
            kind = cursor.take(1, "meta event")[0]
            data = cursor.take(cursor.number("meta event length"), "meta event")
            if kind == META_END:
                track.ended = True
            elif kind == META_TEMPO:
                if len(data) == 3 and any(data):
                    track.tempos.append((track.tick, int.from_bytes(data)))
                else:
                    track.oddities.append(("ignored {} tempo event{s} of 0 us or other than 3 bytes", start))
            elif kind == META_TEXT and data.startswith(MARK.encode()):
                track.marks.append((track.tick, data.decode(errors="replace")))
            elif kind == META_TEXT and track.tick == 0:
                track.texts.append(data)
            elif kind in (META_TRACK_NAME, META_INSTRUMENT):
                track.names.setdefault((prefix, kind), data)
            elif kind == META_CHANNEL and data and data[0] < 16:
                prefix = data[0]
            elif kind == META_PORT and data:
                port = data[0]
                ports.add(port)
        elif status in (0xF0, 0xF7):
            data = cursor.take(cursor.number("system exclusive length"), "system exclusive")
            if status == 0xF0:
                track.exclusive.append(SystemExclusive(track.tick, data.removesuffix(b"\xf7"), port))
        elif status > 0xEF:
            cursor.take(SYSTEM_COMMON.get(status, 0), "system message")
            track.oddities.append(("skipped {} system message{s} that files cannot have", start))
        else:
            if status < 0x80:
                if running == 0:
                    raise cursor.fail(f"data byte 0x{status:02X} without a status byte before it", start)
                cursor.at = start
            else:
                running = status
                prefix = NO_CHANNEL
            data = cursor.take(1 if running >> 4 in (0xC, 0xD) else 2, "message")
            if max(data) > 0x7F:
                track.oddities.append(("took {} data byte{s} above 0x7F for 0x7F", start))
                data = bytes(min(byte, 0x7F) for byte in data)
            track.messages.append(SmfMessage(track.tick, Message(running, *data), number, port))
    track.at = cursor.at
    if len(ports) == 1:  # it holds for the whole track, wherever it appears
        (port,) = ports
        track.messages = [m._replace(port=port) for m in track.messages]
        track.exclusive = [m._replace(port=port) for m in track.exclusive]
    return track


def _shown(text: str) -> str:
    """The printable text of a meta event, cut to LONGEST_NAME."""
    text = "".join(c if c.isprintable() else " " for c in text).strip()
    return text if len(text) <= LONGEST_NAME else f"{text[: LONGEST_NAME - 3]}..."
