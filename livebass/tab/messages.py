"""From strokes to the messages of MIDI mode 4, a channel for each string, with the key switches of the map `modo`.

This is the only part of the room that knows what livebass can play; the rest is counted.
"""

from __future__ import annotations

import io
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import NamedTuple

import mido
from mido import Message, MetaMessage

from livebass.score.reading import TAKE
from livebass.tab.model import Bar
from livebass.tab.perform import (
    DEAD,
    HAMMER,
    HARMONIC,
    PINCH,
    PLUCK,
    PULL,
    SLIDE,
    TAP,
    TIED,
    Performance,
    Stroke,
)
from livebass.tab.tempos import Tempos
from livebass.techniques import (
    DYNAMICS,
    FUNCTION_ROWS,
    LEARNED,
    LEAST,
    MOST,
    OWN,
    TECHNIQUE,
    THUMB_ON_ALL,
    THUMB_ON_TWO,
)

TICKS = 3840  # in a quarter note
MODE_4, PRESSURE, WHEEL = 126, 127, 8191  # a controller, the most of a channel's pressure and of its wheel
WHEEL_RANGE = 12.0  # semitones of a string's wheel
BEND_STEP = 5e-3  # s ...
MOST_BENDS = 2000  # ... unless a bend has more steps
SEMITONES = {2: 12, 3: 19, 4: 24, 5: 28, 6: 31}  # of natural harmonics over the open string, by partial
TECHNIQUE_CC, DYNAMICS_CC = LEARNED + TECHNIQUE, LEARNED + DYNAMICS
PALM_CC, SLIDE_CC = (FUNCTION_ROWS[name].controllers[0] for name in ("palm_mute", "slide"))
PALM = FUNCTION_ROWS["palm_mute"].pressed
LOW = 2  # strings that a thumb on two strikes
SWITCH_VELOCITY = RELEASE = 64
# Order of what happens at once: notes end, controllers move, notes begin, and what a tied note leaves ends
END, CONTROL, PRESS, BEGIN, LATER = range(5)


class Way(NamedTuple):
    """How livebass plays a kind of stroke."""

    switch: str = ""  # the technique whose key is held as the note begins
    technique: int = OWN  # value of the parameter `technique`


WAYS = {
    PLUCK: Way(), HAMMER: Way(), PULL: Way(), SLIDE: Way(), DEAD: Way("ghost"), TAP: Way("tap"),
    HARMONIC: Way("harmonic"), PINCH: Way("harmonic"), "slap": Way(technique=THUMB_ON_ALL),
    "pop": Way(technique=THUMB_ON_TWO),
}  # fmt: skip


@dataclass(frozen=True)
class Strings:
    """The bass that plays."""

    opens: Sequence[int]  # notes of the open strings, lowest first
    frets: int
    switches: Mapping[str, int]  # keys, by the symbols of techniques


def to_midi(
    performance: Performance, bars: Sequence[Bar], strings: Strings, texts: Iterable[str], dynamics: float
) -> tuple[bytes, Counter[str]]:
    """A Standard MIDI File of a performance, and how many of each sign it leaves out.

    `texts` stand at its beginning; `dynamics`, dB, change the force of every note.
    """
    writer = _Writer(performance.tempos, strings)
    writer.lacks.update(performance.lacks)
    if dynamics:
        part = (dynamics - LEAST[DYNAMICS]) / (MOST[DYNAMICS] - LEAST[DYNAMICS])
        writer.control(0.0, DYNAMICS_CC, round(127 * part))
    after: dict[int, Stroke] = {}
    following: dict[int, Stroke] = {}  # the next stroke on its string, by id
    for stroke in reversed(performance.strokes):
        if stroke.string in after:
            following[id(stroke)] = after[stroke.string]
        after[stroke.string] = stroke
    for stroke in performance.strokes:
        writer.play(stroke, following.get(id(stroke)))
    file = mido.MidiFile(ticks_per_beat=TICKS)
    file.tracks += [_conductor(performance, bars, texts), writer.track()]
    out = io.BytesIO()
    file.save(file=out)
    return out.getvalue(), writer.lacks


def _conductor(performance: Performance, bars: Sequence[Bar], texts: Iterable[str]) -> mido.MidiTrack:
    """The track with texts, tempos, time signatures and names of sections."""
    events = [(0, 0, MetaMessage("text", text=text)) for text in (TAKE, *texts)]
    events += [(_tick(at), 1, MetaMessage("set_tempo", tempo=us)) for at, us in performance.tempos.steps]
    last: tuple[int, int] | None = None
    for begin, number in performance.bars:
        bar = bars[number]
        ratio = int(bar.length / bar.beat), int(4 / bar.beat)
        if ratio != last and 0 < ratio[0] < 256:
            events.append((_tick(begin), 1, MetaMessage("time_signature", numerator=ratio[0], denominator=ratio[1])))
            last = ratio
        if bar.name:
            events.append((_tick(begin), 2, MetaMessage("marker", text=bar.name.encode("ascii", "replace").decode())))
    end = [(_tick(performance.end), 3, MetaMessage("end_of_track"))]
    return _track([*events, *end])


def _tick(quarters: Fraction | float) -> int:
    return max(round(quarters * TICKS), 0)


def _track(events: Iterable[tuple[int, int, Message | MetaMessage]]) -> mido.MidiTrack:
    """A track of (tick, rank, message), in any order."""
    track, last = mido.MidiTrack(), 0
    for tick, _, message in sorted(events, key=lambda event: event[:2]):
        track.append(message.copy(time=tick - last))
        last = tick
    return track


class _Writer:
    def __init__(self, tempos: Tempos, strings: Strings) -> None:
        self.tempos, self.strings = tempos, strings
        self.events: list[tuple[int, int, Message | MetaMessage]] = []
        self.lacks: Counter[str] = Counter()
        self.technique, self.palm = OWN, False
        self.wheels, self.pressures = [0] * len(strings.opens), [0] * len(strings.opens)
        self.control(0.0, MODE_4, len(strings.opens))

    def track(self) -> mido.MidiTrack:
        return _track([(0, 0, MetaMessage("track_name", name="Bass")), *self.events])

    def control(self, time: float, number: int, value: int) -> None:
        """A controller of the whole bass."""
        self._add(time, CONTROL, Message("control_change", control=number, value=value))

    def play(self, stroke: Stroke, after: Stroke | None) -> None:
        """Plays a stroke, before `after` on its string."""
        if stroke.fret > self.strings.frets:
            self.lacks[f"note beyond fret {self.strings.frets}"] += 1
            return
        way, key, channel = WAYS[stroke.kind], self._key(stroke), self._channel(stroke.string)
        if stroke.direction:
            self.lacks[f"{stroke.direction}-stroke"] += 1
        if stroke.kind == "pop" and stroke.string < LOW:
            self.lacks["pop on a low string"] += 1
        if way.technique != self.technique and stroke.kind not in TIED:
            self.technique = way.technique
            self.control(stroke.time, TECHNIQUE_CC, round(127 * way.technique / MOST[TECHNIQUE]))
        if stroke.palm != self.palm:
            self.palm = stroke.palm
            self.control(stroke.time, PALM_CC, PALM if stroke.palm else 0)
        self._pressure(stroke, channel)
        self._bend(stroke, channel)
        tick = _tick(self.tempos.quarters(stroke.time))
        switch = self.strings.switches.get(way.switch)
        if switch is not None:
            self._note(tick, PRESS, channel, switch, SWITCH_VELOCITY)
            self._note(tick + 1, END, channel, switch)
        elif way.switch:
            self.lacks[way.switch.replace("_", " ")] += 1
        if stroke.kind == SLIDE:
            for at, value in ((tick, 127), (tick + 1, 0)):
                self.events.append((at, CONTROL, Message("control_change", control=SLIDE_CC, value=value)))
        self._note(tick, BEGIN, channel, key, stroke.velocity)
        tied = after is not None and after.kind in TIED and after.fret != stroke.fret and after.time - stroke.end < 1e-3
        end = _tick(self.tempos.quarters(after.time if tied and after else stroke.end))
        self._note(max(end, tick + 1) + tied, LATER if tied else END, channel, key)

    def _key(self, stroke: Stroke) -> int:
        """The key of a stroke's note. The key of a harmonic says the partial too."""
        opened = self.strings.opens[stroke.string]
        if stroke.kind not in (HARMONIC, PINCH):
            return opened + stroke.fret
        sounds = stroke.fret + SEMITONES.get(stroke.partial, 0)
        if sounds in SEMITONES.values() and stroke.partial in SEMITONES:
            return opened + sounds
        if stroke.fret == 0:  # a natural one that livebass lacks
            self.lacks["high harmonic"] += 1
            return opened + SEMITONES[max(SEMITONES)]
        if stroke.partial != 2 or stroke.kind == PINCH:
            self.lacks["harmonic other than the octave"] += 1
        return opened + stroke.fret

    def _channel(self, string: int) -> int:
        """The highest string has the first channel."""
        return len(self.strings.opens) - 1 - string

    def _add(self, time: float, rank: int, message: Message) -> None:
        self.events.append((_tick(self.tempos.quarters(time)), rank, message))

    def _note(self, tick: int, rank: int, channel: int, key: int, velocity: int = 0) -> None:
        kind = "note_on" if velocity else "note_off"
        self.events.append((tick, rank, Message(kind, channel=channel, note=key, velocity=velocity or RELEASE)))

    def _pressure(self, stroke: Stroke, channel: int) -> None:
        """The vibrato of a stroke."""
        value = round(PRESSURE * stroke.vibrato)
        if value != self.pressures[stroke.string]:
            self.pressures[stroke.string] = value
            self._add(stroke.time, CONTROL, Message("aftertouch", channel=channel, value=value))

    def _bend(self, stroke: Stroke, channel: int) -> None:
        """The bend of a stroke, from its beginning to its end."""
        times = [stroke.time]
        if stroke.bend:
            length = min(stroke.bend[-1][0], stroke.end) - stroke.time
            count = max(min(int(length / BEND_STEP), MOST_BENDS), 0)
            times += [stroke.time + length * (k + 1) / count for k in range(count)]
        for time in times:
            wheel = round(min(max(_at(stroke.bend, time) / WHEEL_RANGE, -1.0), 1.0) * WHEEL)
            if wheel != self.wheels[stroke.string]:
                self.wheels[stroke.string] = wheel
                self._add(time, CONTROL, Message("pitchwheel", channel=channel, pitch=wheel))


def _at(curve: Sequence[tuple[float, float]], time: float) -> float:
    """The height of a curve, level before its first and after its last point; 0 without points."""
    before = None
    for x, y in curve:
        if x > time:
            return y if before is None else before[1] + (y - before[1]) * (time - before[0]) / (x - before[0])
        before = x, y
    return before[1] if before else 0.0
