"""From the messages of a MIDI file to lines: who plays what, at which frame.

A line is a channel of a port. If tracks share a channel and each sets a program of its own, as some software writes
files, each of these tracks is a line. The channels of a zone, which a mode assigns to the strings or the notes of one
instrument, or which sound like one (spread.py), belong together.
"""

from __future__ import annotations

from bisect import bisect_right
from collections import Counter, defaultdict
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import NamedTuple

from livebass import tracknames
from livebass.kits import BANK, DRUMS, GM2_DRUMS, GM2_MELODIC, MELODIC, XG_DRUMS
from livebass.score.score import CHANNELS, CONTROL, LONGEST, NOTE_OFF, NOTE_ON, PROGRAM, RELEASE, Event, note_off
from livebass.score.smf import Message, Smf, SmfError
from livebass.score.spread import spread
from livebass.techniques import BEND_STARTS, FUNCTION_ROWS

BASS_PROGRAMS = range(32, 40)  # General MIDI, counted from 0: the eight basses
DEFAULT_TEMPO = 500_000  # us per quarter note, until a file sets another
LONGEST_REST = 60  # s from the last note to the end of a file; a longer rest is cut off
LAST_NOTE = 10  # s that a note without end lasts there
PORTAMENTO_TIME = FUNCTION_ROWS["bend"].controllers[0]  # a controller; livebass takes bend with it


class Line(NamedTuple):
    """A channel of a port, or one track of it: messages that belong together."""

    port: int  # from 0
    channel: int  # from 0
    track: int | None = None  # from 0; None: all tracks


class Note(NamedTuple):
    """A note-on among cleaned events."""

    place: int  # in the list of events
    track: int  # from 0
    line: int
    note: int
    program: int | None  # of its line or zone at its beginning, from 0; None: not yet set
    bank: int | None  # its most significant byte
    drums: bool
    frame: int


@dataclass
class Lines:
    """The messages of a file by lines."""

    lines: list[Line]
    events: list[Event]  # by time
    exclusive: list[tuple[int, int, bytes]]  # (frame, first line of the port, data) by time
    end: int  # frame
    zone: frozenset[int] = frozenset()  # lines that form one instrument
    remarks: tuple[str, ...] = ()
    marks: tuple[tuple[int, str], ...] = ()  # (frame, text) of a take: the bass from there on
    basses: frozenset[int] = frozenset()  # tracks called bass that are no drums, even on channel 10

    def notes(self, events: list[Event]) -> list[Note]:
        """The notes among `events`, with their programs.

        A line with only one program has it from its first note on. A line of the zone without a program has the zone's.
        """
        programs = _only_programs(events)
        zones = {program for line, program in programs.items() if line in self.zone}
        of_zone = zones.pop() if len(zones) == 1 and all(line in programs for line in self._changed(events)) else None
        banks: dict[int, int] = {}
        kits = _Kits(self)
        found = []
        for place, event in enumerate(events):
            m, line = event.message, event.line
            if m.kind == PROGRAM:
                programs[line] = m.first
                of_zone = m.first if line in self.zone else of_zone
            elif m.kind == CONTROL and m.first == BANK:
                banks[line] = m.second
            elif m.kind == NOTE_ON:
                program = programs.get(line)
                if program is None and line in self.zone:
                    program = of_zone
                drums = line not in self.zone and kits.has(line, event.frame, banks.get(line), event.track)
                found.append(Note(place, event.track, line, m.first, program, banks.get(line), drums, event.frame))
        return found

    def _changed(self, events: list[Event]) -> set[int]:
        """The lines of the zone that set a program."""
        return {e.line for e in events if e.message.kind == PROGRAM and e.line in self.zone}


def _only_programs(events: list[Event]) -> dict[int, int]:
    """The program of each line with only one."""
    found: dict[int, set[int]] = defaultdict(set)
    for event in events:
        if event.message.kind == PROGRAM:
            found[event.line].add(event.message.first)
    return {line: next(iter(programs)) for line, programs in found.items() if len(programs) == 1}


class _Kits:
    """Finds lines that play drums: channel 10, unless names, banks and system exclusive messages say otherwise.

    Banks: 120 and 121 of General MIDI 2; 126 and 127 of XG, but not after a GS reset. System exclusive: rhythm parts of
    GS, part modes of XG.
    """

    def __init__(self, lines: Lines) -> None:
        self._lines, self._basses = lines.lines, lines.basses
        self._first = {line.port: k for k, line in enumerate(lines.lines) if line.channel == 0 and line.track is None}
        self._coming = list(reversed(lines.exclusive))
        self._set: dict[int, bool] = {}  # by line
        self._system: dict[int, str] = {}  # "gs", "xg" or "", by the first line of a port

    def has(self, line: int, frame: int, bank: int | None, track: int) -> bool:
        """True if a note of `line` and `track` at `frame`, in ascending order, plays drums in `bank`."""
        while self._coming and self._coming[-1][0] <= frame:
            self._take(*self._coming.pop()[1:])
        port, channel, _ = self._lines[line]
        first = self._first[port]
        system = self._system.get(first, "")
        if bank == GM2_DRUMS or (bank in XG_DRUMS and system != "gs"):
            return True
        if bank == GM2_MELODIC or (system == "xg" and bank is not None):
            return False
        return self._set.get(first + channel, channel == DRUMS and track not in self._basses)

    def _take(self, first: int, data: bytes) -> None:
        system = None
        if data[:1] == b"\x7e" and data[2:3] == b"\x09":  # General MIDI
            system = ""
        elif data[:1] == b"\x41" and data[2:4] == b"\x42\x12":  # Roland GS
            address = data[4:7]
            if address == b"\x40\x00\x7f":
                system = "gs"
            elif len(data) > 7 and address[:1] == b"\x40" and address[1] & 0xF0 == 0x10 and address[2] == 0x15:
                part = address[1] & 0x0F
                self._set[first + (DRUMS if part == 0 else part - 1 if part <= DRUMS else part)] = data[7] != 0
        elif data[:1] == b"\x43" and data[2:3] == b"\x4c":  # Yamaha XG
            if data[3:6] == b"\x00\x00\x7e":
                system = "xg"
            elif len(data) > 6 and data[3] == 0x08 and data[4] < CHANNELS and data[5] == 0x07:
                self._set[first + data[4]] = data[6] != 0
        if system is not None:
            self._system[first] = system
            for channel in range(CHANNELS):
                self._set.pop(first + channel, None)


def lines_of(smf: Smf, rate: int, take: bool) -> Lines:
    """The lines of a file, at `rate` Hz; a take keeps every message. Raises SmfError if it lasts too long.

    Note-ons with velocity 0 become note-offs. Drops controller 5: files use it as portamento time, and only a livebass
    bends by it. Drops channel modes that the file cannot mean.
    """
    frame = _frame_of(smf, rate)
    ports = sorted({m.port for m in smf.messages}) or [0]
    lines = [Line(port, channel) for port in ports for channel in range(CHANNELS)]
    first = {port: CHANNELS * rank for rank, port in enumerate(ports)}
    events = []
    for tick, m, track, port in smf.messages:
        off = m.kind == NOTE_ON and m.second == 0
        message = note_off(m.channel, m.first, RELEASE) if off else m
        events.append(Event(frame(tick), message, track, first[port] + m.channel))
    end = max(frame(smf.end_tick), max((e.frame for e in events), default=0))
    last = max((e.frame for e in events if is_note(e.message)), default=0)
    if last > LONGEST * rate:
        raise SmfError(f"lasts {last / rate / 3600:.1f} hours, more than {LONGEST // 3600}")
    if end - last > LONGEST_REST * rate:
        events = [event for event in events if event.frame <= last + LONGEST_REST * rate]
        left = Counter(e.message.kind for e in events)
        rings = LAST_NOTE * rate if left[NOTE_ON] > left[NOTE_OFF] else 0
        end = max((event.frame for event in events), default=0) + rings
    exclusive = [(frame(tick), first[port], data) for tick, data, port in smf.exclusive if port in first]
    found = Lines(lines, events, exclusive, end)
    if take:
        found.zone = frozenset(range(len(lines)))
        found.marks = tuple((frame(tick), text) for tick, text in smf.marks)
        return found
    found.basses = _basses(smf, events)
    found.zone, found.events = _zone(found)
    found.remarks = tuple(_tunings(smf))
    one = None if found.zone else spread(found.events, rate)
    if one is not None:
        found.zone, found.events = one.lines, [*one.mode, *found.events]
        low, *_, high = sorted(found.lines[line].channel + 1 for line in one.lines)
        kind = "a channel a note" if one.mode else "a channel a string"
        found.remarks += (f"plays channels {low} to {high} as one instrument, {kind}",)
    kept = [e for e in found.events if not (e.message.kind == CONTROL and e.message.first == PORTAMENTO_TIME)]
    if bends := _bends_by_portamento(found.events):
        found.remarks += (f"ignored controller 5 (portamento time, {bends} times): it bends only in takes of livebass",)
    found.events = _ended_by_others(_apart(found, kept))
    return found


def _basses(smf: Smf, events: list[Event]) -> frozenset[int]:
    """The tracks of one line that are called bass and play at least MELODIC keys.

    Some programs number the channels of their tracks in order, and so give channel 10 to any instrument.
    """
    lines: dict[int, set[int]] = defaultdict(set)
    keys: dict[int, set[int]] = defaultdict(set)
    for event in events:
        if event.message.kind == NOTE_ON:
            lines[event.track].add(event.line)
            keys[event.track].add(event.message.first)
    return frozenset(
        track
        for track, own in lines.items()
        if len(own) == 1
        and len(keys[track]) >= MELODIC
        and any(map(tracknames.is_bass, (smf.names[track], smf.instruments[track])))
    )


def _frame_of(smf: Smf, rate: int) -> Callable[[int], int]:
    """A function from tick to nearest frame. Integers keep times from drifting over hours."""
    if not smf.ticks_per_quarter:
        over, under = smf.ticks_per_second
        return lambda tick: (2 * tick * under * rate + over) // (2 * over)
    ticks, times, tempos = [0], [0], [DEFAULT_TEMPO]  # time in us times ticks per quarter note
    for tick, tempo in smf.tempos:
        times.append(times[-1] + (tick - ticks[-1]) * tempos[-1])
        ticks.append(tick)
        tempos.append(tempo)
    whole = smf.ticks_per_quarter * 1_000_000

    def frame(tick: int) -> int:
        k = bisect_right(ticks, tick) - 1
        return (2 * (times[k] + (tick - ticks[k]) * tempos[k]) * rate + whole) // (2 * whole)

    return frame


def is_note(m: Message) -> bool:
    """True for a note-on or a note-off."""
    return m.kind in (NOTE_ON, NOTE_OFF)


def _modes(events: list[Event]) -> dict[int, frozenset[int]]:
    """The places of mode messages, as the performer reads them, and the lines that each affects."""
    modes: dict[int, frozenset[int]] = {}
    rpn: dict[int, tuple[int, int]] = {}  # selected, by line
    for place, (_, m, _, line) in enumerate(events):
        if m.kind != CONTROL:
            continue
        port = line - m.channel  # its first line
        high, low = rpn.get(port, (127, 127))
        if m.first == 101:
            high = m.second
        elif m.first == 100:
            low = m.second
        elif m.first in (98, 99, 121):
            high = low = 127
        elif m.first == 126 and m.second > 1:
            modes[place] = frozenset(range(line, port + min(m.channel + m.second, CHANNELS)))
        elif m.first == 6 and (high, low) == (0, 6) and m.second > 1:
            members = min(m.second, CHANNELS - 1)
            first = port if m.channel == 0 else port + CHANNELS - 1 - members
            modes[place] = frozenset({line, *range(first, first + members + 1)})
        rpn[port] = high, low
    return modes


def _zone(lines: Lines) -> tuple[frozenset[int], list[Event]]:
    """The lines that modes join into one instrument, and the events without implausible modes.

    Modes are implausible if some notes of these lines have a bass program, and some another.
    """
    modes = _modes(lines.events)
    zone = frozenset[int]().union(*modes.values())
    if not zone:
        return zone, lines.events
    one = Lines(lines.lines, lines.events, lines.exclusive, lines.end, zone)
    programs = {note.program for note in one.notes(lines.events) if note.line in zone} - {None}
    if len({program in BASS_PROGRAMS for program in programs}) < 2:
        return zone, lines.events
    return frozenset(), [event for place, event in enumerate(lines.events) if place not in modes]


def _apart(lines: Lines, events: list[Event]) -> list[Event]:
    """The events; tracks that share a channel but have programs of their own get lines of their own."""
    playing: dict[int, set[int]] = defaultdict(set)  # tracks with notes, by line
    programs: dict[tuple[int, int], set[int]] = defaultdict(set)  # by line and track
    for _, m, track, line in events:
        if m.kind == NOTE_ON:
            playing[line].add(track)
        elif m.kind == PROGRAM:
            programs[line, track].add(m.first)
    own: dict[tuple[int, int], int] = {}  # the new line of each line and track
    for line, tracks in playing.items():
        if line not in lines.zone and len({frozenset(p) for t in tracks if (p := programs.get((line, t)))}) > 1:
            for track in sorted(tracks):
                own[line, track] = len(lines.lines)
                lines.lines.append(lines.lines[line]._replace(track=track))
    return [each for event in events for each in _copies(event, playing, own, programs)] if own else events


def _copies(
    event: Event,
    playing: dict[int, set[int]],
    own: dict[tuple[int, int], int],
    programs: dict[tuple[int, int], set[int]],
) -> Iterator[Event]:
    """The event on its line or its track's own; from a track without notes, on all lines that share the channel.

    The same goes for programs, on tracks without their own.
    """
    tracks = [track for track in sorted(playing[event.line]) if (event.line, track) in own]
    if not tracks:
        yield event
    for track in tracks:
        shared = event.track not in tracks
        without = event.message.kind == PROGRAM and not programs.get((event.line, track))
        if track == event.track or shared or without:
            yield event._replace(line=own[event.line, track])


def _ended_by_others(events: list[Event]) -> list[Event]:
    """The events, with note-offs on the lines whose notes they end.

    A note-off that ends nothing on its line ends a note of the same key on another line that lacks one.
    """
    left: Counter[tuple[int, int]] = Counter()  # by line and key: note-offs less note-ons
    for event in events:
        if is_note(event.message):
            left[event.line, event.message.first] += 1 if event.message.kind == NOTE_OFF else -1
    wanting: dict[int, list[int]] = defaultdict(list)  # lines with more note-ons, by key
    for (line, key), count in left.items():
        if count < 0:
            wanting[key].append(line)
    if not wanting or not any(count > 0 for count in left.values()):
        return events
    held: Counter[tuple[int, int]] = Counter()
    channels = {event.line: event.message.channel for event in events}
    mended = []
    for event in events:
        m, line = event.message, event.line
        if m.kind == NOTE_ON:
            held[line, m.first] += 1
        elif m.kind == NOTE_OFF and held[line, m.first]:
            held[line, m.first] -= 1
        elif (
            m.kind == NOTE_OFF
            and (other := next((o for o in wanting.get(m.first, ()) if held[o, m.first]), None)) is not None
        ):
            held[other, m.first] -= 1
            event = event._replace(message=note_off(channels[other], m.first, m.second), line=other)
        mended.append(event)
    return mended


def _bends_by_portamento(events: list[Event]) -> int:
    """Number of controller 5 messages that would bend a livebass."""
    ready: set[int] = set()
    bends = 0
    for event in events:
        m = event.message
        if m.kind == CONTROL and m.first == PORTAMENTO_TIME:
            if m.second < BEND_STARTS:
                ready.add(event.line)
            bends += event.line in ready and m.second >= BEND_STARTS
    return bends


def _tunings(smf: Smf) -> Iterator[str]:
    """A line for each kind of tuning by system exclusive messages, which livebass ignores."""
    tunings, scales = dict[float, None](), 0  # cents; how many
    for _, data, _ in smf.exclusive:
        cents = 0.0
        if data[:1] == b"\x7f" and data[2:4] == b"\x04\x03" and len(data) >= 6:  # master fine tuning
            cents = (data[4] + 128 * data[5] - 8192) / 8192 * 100
        elif data[:1] == b"\x7f" and data[2:4] == b"\x04\x04" and len(data) >= 6:  # master coarse tuning
            cents = 100.0 * (data[5] - 64)
        elif (data[:1], data[2:7]) == (b"\x41", b"\x42\x12\x40\x00\x00") and len(data) >= 11:  # of GS ...
            cents = (_nibbles(data[7:11]) - 1024) / 10
        elif (data[:1], data[2:6]) == (b"\x43", b"\x4c\x00\x00\x00") and len(data) >= 10:  # ... and of XG
            cents = (_nibbles(data[6:10]) - 1024) / 10
        scales += data[:1] in (b"\x7e", b"\x7f") and data[2:3] == b"\x08"
        if cents:
            tunings[cents] = None
    if len(tunings) == 1:
        (cents,) = tunings
        a4 = 440 * 2 ** (cents / 1200)
        yield f"ignored a master tuning of {cents:+.0f} cents (system exclusive); --a4 {a4:.1f} tunes the bass so"
    elif tunings:
        least, most = min(tunings), max(tunings)
        yield f"ignored {len(tunings)} master tunings (system exclusive), {least:+.0f} to {most:+.0f} cents"
    if scales:
        yield "ignored a tuning of single notes (system exclusive); --temperament tunes the bass"


def _nibbles(data: bytes) -> int:
    """The number in the low halves of these bytes."""
    value = 0
    for byte in data:
        value = value << 4 | byte & 0x0F
    return value
