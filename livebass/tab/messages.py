"""Exports strokes as a MIDI file: mode 4, a channel for each string, with the key switches of the bass's key map.

What the map has no key for is left out and counted.
"""

from __future__ import annotations

import io
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import mido
from mido import Message, MetaMessage

from livebass.kernels.player.controls import DATA, DATA_FINE, RPN, RPN_FINE
from livebass.rows import techniques
from livebass.score.reading import TAKE
from livebass.tab import moves, perform
from livebass.tab.model import Bar
from livebass.tab.tempos import TICKS, Tempos, nearest_tick

MODE_4 = 126  # a controller
# Controllers that set the range of a channel's wheel: RPN 0, and then none, which no later data can change
WHEEL_CONTROLLERS = (
    (RPN, 0), (RPN_FINE, 0), (DATA, round(moves.WHEEL_RANGE)), (DATA_FINE, 0), (RPN, 127), (RPN_FINE, 127)
)  # fmt: skip
SEMITONES = {2: 12, 3: 19, 4: 24, 5: 28, 6: 31, 7: 34, 8: 36}  # of natural harmonics over the open string, by partial
ARTIFICIAL = {2: "artificial", 3: "artificial_12th", 4: "artificial_15th"}  # techniques by partial
TECHNIQUE_CC, DYNAMICS_CC = techniques.LEARNED + techniques.TECHNIQUE, techniques.LEARNED + techniques.DYNAMICS
PALM_CC, SLIDE_CC, SLIDE_TIME_CC, FADE_CC = (
    techniques.FUNCTION_ROWS[name].controllers[0] for name in ("palm_mute", "slide", "slide_time", "expression")
)
PALM = techniques.FUNCTION_ROWS["palm_mute"].pressed
Event = tuple[int, int, Message | MetaMessage]  # tick, rank among those of a tick, message
LOW = 2  # strings that a thumb on two strikes
SWITCH_VELOCITY = RELEASE = 64


class Way(NamedTuple):
    """How livebass plays a kind of stroke: by techniques, whose keys the bass's key map may lack."""

    hold: str = ""  # its key is held as the note begins
    press: str = ""  # its key is pressed first; without a key or a name ...
    technique: int = techniques.OWN  # ... this value of the parameter `technique` is set


WAYS = {
    perform.PLUCK: Way(), perform.HAMMER: Way(), perform.PULL: Way(), perform.SLIDE: Way(),
    perform.DEAD: Way("ghost"), perform.TAP: Way("tap"), perform.HARMONIC: Way("harmonic"),
    perform.PINCH: Way("pinch"), "slap": Way(technique=techniques.THUMB_ON_ALL),
    "pop": Way(press="pop_on_all", technique=techniques.THUMB_ON_TWO), "left slap": Way("left_slap"),
    perform.OFF_DOWN: Way("slide_off_down"), perform.OFF_UP: Way("slide_off_up"),
}  # fmt: skip


@dataclass(frozen=True)
class Strings:
    """The bass that plays."""

    opens: Sequence[int]  # notes of the open strings, lowest first
    frets: int
    switches: Mapping[str, int]  # keys, by the symbols of techniques
    program: int  # of General MIDI, from 1, for other programs


def to_midi(
    performance: perform.Performance, bars: Sequence[Bar], strings: Strings, texts: Iterable[str], dynamics: float
) -> tuple[bytes, Counter[str]]:
    """A Standard MIDI File of a performance, and how many of each sign it leaves out.

    `texts` stand at its beginning; `dynamics`, dB, change the force of every note.
    """
    writer = _Writer(performance.tempos, strings)
    writer.lacks.update(performance.lacks)
    if dynamics:
        part = (dynamics - techniques.MINIMUM[techniques.DYNAMICS]) / (
            techniques.MAXIMUM[techniques.DYNAMICS] - techniques.MINIMUM[techniques.DYNAMICS]
        )
        writer.control(0.0, DYNAMICS_CC, round(127 * part))
    for stroke, after in moves.following(performance.strokes):
        writer.play(stroke, after)
    return file_of(conductor(performance, bars, (TAKE, *texts)), writer.track()), writer.lacks


def file_of(*tracks: mido.MidiTrack) -> bytes:
    """A Standard MIDI File."""
    file, out = mido.MidiFile(ticks_per_beat=TICKS, tracks=tracks), io.BytesIO()
    file.save(file=out)
    return out.getvalue()


def conductor(performance: perform.Performance, bars: Sequence[Bar], texts: Iterable[str] = ()) -> mido.MidiTrack:
    """The track with texts, tempos, time signatures and names of sections."""
    events = [(0, 0, MetaMessage("text", text=text)) for text in texts]
    events += [(nearest_tick(at), 1, MetaMessage("set_tempo", tempo=us)) for at, us in performance.tempos.steps]
    last: tuple[int, int] | None = None
    for begin, number in performance.bars:
        bar, at = bars[number], nearest_tick(begin)
        ratio = int(bar.length / bar.beat), int(4 / bar.beat)
        power = ratio[1] > 0 and ratio[1] & ratio[1] - 1 == 0  # of two, as MIDI needs it
        if ratio != last and 0 < ratio[0] < 256 and power:
            events.append((at, 1, MetaMessage("time_signature", numerator=ratio[0], denominator=ratio[1])))
            last = ratio
        if bar.name:
            events.append((at, 2, MetaMessage("marker", text=bar.name.encode("ascii", "replace").decode())))
    end = [(nearest_tick(performance.end), 3, MetaMessage("end_of_track"))]
    return track_of([*events, *end])


def track_of(events: Iterable[Event]) -> mido.MidiTrack:
    """A track of (tick, rank, message), in any order."""
    track, last = mido.MidiTrack(), 0
    for tick, _, message in sorted(events, key=lambda event: event[:2]):
        track.append(message.copy(time=tick - last))
        last = tick
    return track


def beginning(program: int, channels: Iterable[int], *between: Event) -> list[Event]:
    """The track's name, and what other programs need before the notes of `channels`: program and range of the wheel.

    `between`: events behind the programs, which come first: @tonejs/midi 2.0.28 moves controllers that stand before a
    program to channel 1.
    """
    at = (0, moves.CONTROL)
    name = MetaMessage("track_name", name="Bass")
    programs = [Message("program_change", channel=channel, program=program - 1) for channel in channels]
    ranges = [
        Message("control_change", channel=channel, control=number, value=value)
        for channel in channels
        for number, value in WHEEL_CONTROLLERS
    ]
    return [(0, 0, name), *((*at, m) for m in programs), *between, *((*at, m) for m in ranges)]


class _Writer:
    def __init__(self, tempos: Tempos, strings: Strings) -> None:
        self.tempos, self.strings, self.moves = tempos, strings, moves.Moves(tempos)
        self.events: list[Event] = []
        self.lacks: Counter[str] = Counter()
        self.striking, self.palm, self.slow = WAYS[perform.PLUCK], False, 0
        self.control(0.0, MODE_4, len(strings.opens))

    def track(self) -> mido.MidiTrack:
        mode, *others = self.events
        begin = beginning(self.strings.program, range(len(self.strings.opens)), mode)
        return track_of([*begin, *_default(others), *others])

    def control(self, time: float, number: int, value: int) -> None:
        """A controller of the whole bass."""
        self._add(self.tempos.tick(time), moves.CONTROL, Message("control_change", control=number, value=value))

    def play(self, stroke: perform.Stroke, after: perform.Stroke | None) -> None:
        """Plays a stroke, before `after` on its string."""
        if sign := moves.missing(stroke, self.strings.frets):
            self.lacks[sign] += 1
            return
        channel, at = len(self.strings.opens) - 1 - stroke.string, self.tempos.tick(stroke.time)
        way, key = self._way(stroke)
        if stroke.kind not in perform.TIED:
            self._strike(way, stroke)
        if stroke.palm != self.palm:
            self.palm = stroke.palm
            self.control(stroke.time, PALM_CC, PALM if stroke.palm else 0)
        slow = min(round(stroke.slow / techniques.SLIDE_STEP), 127)
        if stroke.kind in (perform.SLIDE, perform.OFF_DOWN, perform.OFF_UP) and slow != self.slow:
            self.slow = slow
            self.control(stroke.time, SLIDE_TIME_CC, slow)
        for move in self.moves.of(stroke):
            self._add(move.tick, moves.CONTROL, _move_message(move.what, channel, move.value))
        for technique in filter(None, (way.hold, stroke.direction and f"{stroke.direction}_stroke")):
            self._switch(at, channel, technique, 2 if stroke.kind in (perform.OFF_DOWN, perform.OFF_UP) else 1)
        if stroke.kind in (perform.OFF_DOWN, perform.OFF_UP):
            return
        if stroke.kind == perform.SLIDE:
            for later, value in ((0, 127), (1, 0)):
                self._add(at + later, moves.CONTROL, Message("control_change", control=SLIDE_CC, value=value))
        self._note(at, moves.BEGIN, channel, key, stroke.velocity)
        end = moves.ending(self.tempos, stroke, after)
        self._note(end.tick, moves.LATER if end.tied else moves.END, channel, key)

    def _way(self, stroke: perform.Stroke) -> tuple[Way, int]:
        """How to play a stroke, and the key of its note. For some harmonics the key tells the partial."""
        way, opened = WAYS[stroke.kind], self.strings.opens[stroke.string]
        if stroke.kind in (perform.OFF_DOWN, perform.OFF_UP) and way.hold not in self.strings.switches:
            stroke.kind = perform.SLIDE
            return WAYS[perform.SLIDE], opened + stroke.fret
        if stroke.kind not in (perform.HARMONIC, perform.PINCH) or (
            stroke.kind == perform.PINCH and way.hold in self.strings.switches
        ):
            return way, opened + stroke.fret
        if stroke.kind == perform.HARMONIC and stroke.fret == 0:
            return way, opened + SEMITONES[stroke.partial]
        artificial = ARTIFICIAL.get(stroke.partial, "")
        if stroke.kind == perform.HARMONIC and artificial in self.strings.switches:
            return Way(artificial), opened + stroke.fret
        if stroke.partial != 2 or stroke.kind == perform.PINCH:
            self.lacks["harmonic other than the octave"] += 1
        octave = stroke.fret + SEMITONES[2]  # where the open string has it, its key would mean the natural one
        return WAYS[perform.HARMONIC], opened + (octave if octave in SEMITONES.values() else stroke.fret)

    def _strike(self, way: Way, stroke: perform.Stroke) -> None:
        """Sets what plucks, if it changes."""
        key = self.strings.switches.get(way.press)
        if stroke.kind == "pop" and key is None and stroke.string < LOW:
            self.lacks["pop on a low string"] += 1
        if key is not None:  # each time: after a jump to another place of the song, too
            self._press(self.tempos.tick(stroke.time), 0, key, 1)
        elif way[1:] != self.striking[1:]:
            self.control(stroke.time, TECHNIQUE_CC, round(127 * way.technique / techniques.THUMB_ON_ALL))
        self.striking = way

    def _switch(self, tick: int, channel: int, technique: str, ticks: int) -> None:
        """Holds the key of a technique from `tick` on."""
        key = self.strings.switches.get(technique)
        if key is None:
            self.lacks[technique.replace("_", " ")] += 1
        else:
            self._press(tick, channel, key, ticks)

    def _press(self, tick: int, channel: int, key: int, ticks: int) -> None:
        self._note(tick, moves.PRESS, channel, key, SWITCH_VELOCITY)
        self._note(tick + ticks, moves.LATER, channel, key)

    def _add(self, tick: int, rank: int, message: Message) -> None:
        self.events.append((tick, rank, message))

    def _note(self, tick: int, rank: int, channel: int, key: int, velocity: int = 0) -> None:
        kind = "note_on" if velocity else "note_off"
        self._add(tick, rank, Message(kind, channel=channel, note=key, velocity=velocity or RELEASE))


def _default(events: Iterable[Event]) -> list[tuple[int, int, Message]]:
    """The default values of all that moves later than at the beginning: a loop has them again."""
    first: dict[tuple[object, ...], tuple[int, Message]] = {}
    for tick, _, m in sorted(events, key=lambda event: event[:2]):
        if m.type in ("control_change", "pitchwheel", "aftertouch"):
            first.setdefault((m.type, m.channel, getattr(m, "control", 0)), (tick, m))
    found = []
    for tick, m in first.values():
        default = moves.rest_of(moves.EXPRESSION) if getattr(m, "control", 0) == FADE_CC else 0
        if tick > 0:
            found.append((0, moves.CONTROL, m.copy(**{"pitch" if m.type == "pitchwheel" else "value": default})))
    return found


def _move_message(what: str, channel: int, value: int) -> Message:
    if what == moves.BEND:
        return Message("pitchwheel", channel=channel, pitch=value)
    if what == moves.VIBRATO:
        return Message("aftertouch", channel=channel, value=value)
    return Message("control_change", channel=channel, control=FADE_CC, value=value)
