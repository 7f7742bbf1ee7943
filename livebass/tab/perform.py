"""From written notes to strokes: when, on which string and fret, and how each one is played.

Strokes know nothing of MIDI, nor of what livebass can play: rows.py makes a score of them, messages.py a MIDI file.
"""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace
from fractions import Fraction
from itertools import cycle, islice, pairwise, zip_longest
from math import ceil, gcd, log2

from livebass.rows.techniques import SLIDE_STEP
from livebass.tab import model
from livebass.tab.order import order
from livebass.tab.tempos import DEFAULT_TEMPO, Tempos

# Kinds of strokes; slap, pop and tap are called like the techniques of the model
PLUCK, DEAD, HARMONIC, PINCH, TAP, HAMMER, PULL, SLIDE, OFF_DOWN, OFF_UP = (
    "pluck", "dead", "harmonic", "pinch", "tap", "hammer", "pull", "slide", "slide off down", "slide off up"
)  # fmt: skip
TIED = (HAMMER, PULL, SLIDE, OFF_DOWN, OFF_UP)  # by the left hand: they need the note before
A_FRET = 22e-3  # s in which a slide passes a fret ...
SLIDE_PART = 0.25  # ... unless this part of the note before, in whole SLIDE_STEPs, is longer
MIN_BEFORE = 30e-3  # s that a note sounds before a slide leaves it
MIN_GRACE, MAX_GRACE = 0.02, 0.08  # s
MIN_TRILL = 0.04  # s of each note; the last one may be shorter ...
MIN_PART = 0.1  # ... but this part of the others
ORNAMENT = Fraction(1, 4)  # quarter notes of the notes before the written one ...
MIN_ORNAMENTED = 1.5  # ... in a note so many times as long, or longer
IN_FRETS, OUT_FRETS = 3, 5  # of slides from and to nowhere
IN_TIME = 0.02  # s before a slide into a note leaves its first fret
MIN_OUT = 0.06  # s of a note that slides out
GHOST_SOFTER, ACCENT = 24, 16  # velocities
TOGETHER = Fraction(1, 32)  # quarter notes between a note and its tied or joined successor
MAX_FRET = 36
FADES: dict[str, model.Curve] = {"fade in": ((0.0, 0.0), (1.0, 1.0)), "fade out": ((0.0, 1.0), (1.0, 0.0)),
                           "volume swell": ((0.0, 0.0), (0.5, 1.0), (1.0, 0.0))}  # fmt: skip  # signs of a beat
MAX_STROKES = 20_000
MAX_BEATS = 200_000  # as played
PARTIALS = range(2, 9)
NEAR_NODE = 0.35  # frets


@dataclass
class Stroke:
    """A note as it is played."""

    time: float  # s
    end: float
    string: int  # from the lowest, 0
    fret: int
    velocity: int
    kind: str = PLUCK
    partial: int = 1  # of a harmonic, over the stopped string
    palm: bool = False
    vibrato: float = 0.0  # 0 to 1
    bend: model.Curve = ()  # (s, semitones)
    direction: str = ""  # up, down: of the pick
    fade: model.Curve = ()  # (s, part of the volume)
    slow: float = 0.0  # s that a slow slide takes; 0: it is not slow


@dataclass
class Performance:
    """A track as it sounds."""

    strokes: list[Stroke]
    tempos: Tempos
    bars: list[tuple[Fraction, int]]  # (where it begins, number from 0) of each bar
    end: Fraction
    lacks: Counter[str]  # signs that are not played

    def beats(self, bars: Sequence[model.Bar]) -> list[tuple[float, bool]]:
        """The time of each beat, s, and whether a bar begins there."""
        return [
            (self.tempos.seconds(begin + beat * bars[number].beat), beat == 0)
            for begin, number in self.bars
            for beat in range(ceil(bars[number].length / bars[number].beat))
        ]


@dataclass
class _Written:
    """A note where it sounds, in quarter notes from the beginning."""

    begin: Fraction
    end: Fraction
    bar_end: Fraction
    note: model.Note
    beat: model.Beat
    ties: list[_Written] = field(default_factory=list)  # its continuations

    @property
    def parts(self) -> list[_Written]:
        return [self, *self.ties]


def perform(tab: model.Tab, track: model.Track, bars: range | None = None) -> Performance:
    """The strokes of a track; of `bars` only, numbered from 0, once each. Raises UnreadableTab."""
    played = order(tab.bars) if bars is None else list(bars)
    begins, at = list[tuple[Fraction, int]](), Fraction(0)
    for number in played:
        begins.append((at, number))
        at += tab.bars[number].length
    if sum(map(ceil, (tab.bars[number].length / tab.bars[number].beat for number in played))) > MAX_BEATS:
        raise model.UnreadableTab(f"has more than {MAX_BEATS} beats")
    holds = [(begin, hold) for begin, number in begins for hold in tab.bars[number].holds]
    performer = _Performer(Tempos(_tempos(tab.bars, begins), holds))
    performer.lacks.update(track.signs)
    strings: dict[int, list[_Written]] = defaultdict(list)
    turns = Counter[int]()
    for begin, number in begins:
        turns[number] += 1
        if number < len(track.bars):
            performer.read_bar(begin, tab.bars[number], _heard(track.bars[number], turns[number]), strings)
    for string in sorted(strings):
        if 0 <= string < len(track.tuning):
            joined, lost = _join_ties(strings[string])
            performer.lacks.update(["note on a string that plays another"] * lost)
            performer.play_string(joined)
        else:
            performer.lacks["note beyond the strings"] += len(strings[string])
    strokes = sorted(performer.strokes, key=lambda stroke: (stroke.time, stroke.string))
    return Performance(strokes, performer.tempos, begins, at, performer.lacks)


def _heard(voices: Sequence[Sequence[model.Beat]], turn: int) -> Sequence[Sequence[model.Beat]]:
    """The beats of a bar with the notes that sound when it is played for the `turn`th time."""
    if not any(note.passes for voice in voices for beat in voice for note in beat.notes):
        return voices
    return [
        [replace(beat, notes=[n for n in beat.notes if not n.passes or turn in n.passes]) for beat in voice]
        for voice in voices
    ]


def _tempos(bars: Sequence[model.Bar], begins: Sequence[tuple[Fraction, int]]) -> list[tuple[Fraction, model.Tempo]]:
    """The tempos as they come. After a jump the tempo is the one that the written bar has."""
    bpm, change, at_bar = DEFAULT_TEMPO, model.Tempo(Fraction(0), DEFAULT_TEMPO), list[list[model.Tempo]]()
    for bar in bars:
        at_bar.append([model.Tempo(Fraction(0), bpm), replace(change, at=Fraction(0))])
        for tempo in [*bar.tempos, None]:
            passed = (tempo.at if tempo else bar.length) - change.at
            bpm = bpm + (change.bpm - bpm) * float(passed / change.over) if 0 <= passed < change.over else change.bpm
            change = tempo or model.Tempo(Fraction(0), change.bpm, max(change.over - passed, Fraction(0)))
    found, last = list[tuple[Fraction, model.Tempo]](), -1
    for begin, number in begins:
        if number != last + 1:
            found += [(begin, tempo) for tempo in at_bar[number]]
        found += [(begin + tempo.at, tempo) for tempo in bars[number].tempos]
        last = number
    return found


def _swung(at: Fraction, swing: tuple[Fraction, Fraction] | None) -> Fraction:
    """The times at which a place of a bar sounds."""
    if swing is None:
        return at
    pair, first = swing
    rest, half = at % pair, pair / 2
    late = rest * first / half if rest <= half else first + (rest - half) * (pair - first) / half
    return at - rest + late


def _join_ties(notes: list[_Written]) -> tuple[list[_Written], int]:
    """The notes of a string in order: ties joined, and of notes that begin together only the longest.

    Also returns how many others are lost, on other frets.
    """
    found, lost = list[_Written](), 0
    for written in sorted(notes, key=lambda each: (each.begin, -each.end)):
        before = found[-1] if found else None
        tied = written.note.tie and not written.note.graces
        if before and tied and written.note.fret == before.note.fret and written.begin - before.end < TOGETHER:
            before.end, before.bar_end = max(before.end, written.end), written.bar_end
            before.ties.append(written)
        elif before and before.begin == written.begin:
            lost += written.note.fret != before.note.fret
        else:
            found.append(written)
    return found, lost


def _tuplet(length: Fraction) -> Fraction:
    """How long the notes of a note's tuplet last, against written ones: 2/3 in a triplet, 1 in none."""
    odd = length.denominator // (length.denominator & -length.denominator)
    return Fraction(1 << odd.bit_length() - 1, odd)


def partial_at(node: float) -> int:
    """The partial with the node nearest to fret `node` over the stop, of those in PARTIALS; 1: none is near."""
    nodes = (
        (abs(node - 12 * log2(partial / (partial - k))), partial)
        for partial in PARTIALS
        for k in range(1, partial)
        if gcd(k, partial) == 1
    )
    distance, partial = min(nodes)
    return partial if distance < NEAR_NODE else 1


def _legato_kind(grace: model.Grace | None, fret: int) -> str:
    """The kind of a stroke at `fret` that the left hand plays from a grace note; "": it does not."""
    if grace is None or not grace.joined or grace.fret == fret:
        return ""
    return SLIDE if grace.joined == "slide" else HAMMER if fret > grace.fret else PULL


class _Performer:
    def __init__(self, tempos: Tempos) -> None:
        self.tempos, self.seconds = tempos, tempos.seconds
        self.strokes: list[Stroke] = []
        self.lacks: Counter[str] = Counter()

    def read_bar(
        self,
        begin: Fraction,
        bar: model.Bar,
        voices: Sequence[Sequence[model.Beat]],
        strings: dict[int, list[_Written]],
    ) -> None:
        """Adds the notes of a bar that begins at `begin` to those of their strings."""
        for beat in (beat for voice in voices for beat in voice):
            self.lacks.update(sign for sign in beat.signs if sign not in FADES)
            swing = bar.swing if _tuplet(beat.length) == 1 else None  # tuplets stay even
            first, last = (begin + _swung(at, swing) for at in (beat.at, beat.at + beat.length))
            notes = sorted(beat.notes, key=lambda note: note.string, reverse=beat.brush < 0)
            for number, note in enumerate(notes):
                later = abs(beat.brush) * number / max(len(notes) - 1, 1)
                later = Fraction(0) if note.tie else later
                written = _Written(
                    max(first, Fraction(0)) + later, max(last, first + later), begin + bar.length, note, beat
                )
                strings[note.string].append(written)

    def play_string(self, notes: Sequence[_Written]) -> None:
        """Plays the notes of a string."""
        line: list[Stroke] = []
        joined = ""  # how a note leads to the next
        for written, after in zip_longest(notes, notes[1:]):
            self._play(line, written, after, joined)
            joined = self._leads(written, after)
            if joined:
                line[-1].end = self.seconds(after.begin)
        for stroke, after_it in pairwise(line):
            stroke.end = min(stroke.end, after_it.time)
        self.strokes += [stroke for stroke in line if stroke.end > stroke.time or stroke is line[-1]]
        if len(self.strokes) > MAX_STROKES:
            raise model.UnreadableTab(f"has more than {MAX_STROKES} strokes")

    def _leads(self, written: _Written, after: _Written | None) -> str:
        """How a note leads to the one after it: by hammer, SHIFT or LEGATO slide; "": by a new stroke."""
        signs = {slide for part in written.parts for slide in part.note.slides}
        way = model.LEGATO if model.LEGATO in signs else model.SHIFT if model.SHIFT in signs else ""
        way = way or (HAMMER if any(part.note.hammer for part in written.parts) else "")
        if way and (after is None or after.begin - written.end >= TOGETHER):
            self.lacks["slide or hammer-on to nothing"] += 1
            return ""
        return way

    def _play(self, line: list[Stroke], written: _Written, after: _Written | None, joined: str) -> None:
        """Plays a note to which the last one of its `line` leads by `joined`."""
        note = written.note
        stroke = self._stroke(written, after)
        curves = [part for part in written.parts if part.note.bend]
        stroke.bend = tuple(
            (self.seconds(part.begin + (part.beat.length * Fraction(x))), semitones)
            for part in curves
            for x, semitones in part.note.bend
        )
        if note.graces:
            self._graces(line, stroke, note)
        elif (
            joined
            and line
            and line[-1].fret != note.fret
            and line[-1].kind != DEAD
            and stroke.kind not in (DEAD, HARMONIC, PINCH, TAP)
        ):
            self._join(line, stroke, joined)
        elif note.hammered and not joined and note.fret > 0 and stroke.kind == PLUCK:
            stroke.kind = TAP
        if model.IN_BELOW in note.slides or model.IN_ABOVE in note.slides:
            self._slide_in(line, stroke, -1 if model.IN_BELOW in note.slides else 1)
        line.append(stroke)
        if note.trill and not note.dead:
            self._trill(line, written, *note.trill)
        elif note.turns:
            self._ornament(line, written)
        elif note.tremolo:
            self._tremolo(line, written, note.tremolo)
        slides = {slide for part in written.parts for slide in part.note.slides}
        if model.SCRAPE in slides:
            self.lacks["pick scrape"] += 1
        if model.OUT_DOWN in slides or model.OUT_UP in slides:
            self._slide_out(line, OUT_FRETS if model.OUT_UP in slides else -OUT_FRETS)

    def _stroke(self, written: _Written, after: _Written | None) -> Stroke:
        """The stroke of a note by itself."""
        note, begin, end = written.note, self.seconds(written.begin), self.seconds(written.end)
        if note.let_ring:
            end = max(end, self.seconds(written.bar_end if after is None else after.begin))
        if note.staccato:
            end = begin + (end - begin) / 2
        if after is not None:
            end = min(end, self.seconds(after.begin))
        velocity = note.velocity + ACCENT * note.accent - GHOST_SOFTER * note.ghost
        made = Stroke(begin, end, note.string, note.fret, min(max(velocity, 1), 127), direction=written.beat.stroke)
        made.palm = note.palm
        fade = next((FADES[sign] for sign in written.beat.signs if sign in FADES), ())
        made.fade = tuple((begin + x * (end - begin), y) for x, y in fade)
        made.vibrato = max(part.note.vibrato for part in written.parts)
        made.kind = DEAD if note.dead else note.technique or PLUCK
        if note.harmonic and made.kind != DEAD:
            self._touch(made, note)
        return made

    def _touch(self, stroke: Stroke, note: model.Note) -> None:
        """Makes a stroke a harmonic."""
        if note.harmonic == "semi":
            self.lacks["semi-harmonic"] += 1
            return
        stroke.kind = PINCH if note.harmonic in ("pinch", "feedback") else HARMONIC
        stroke.partial = partial_at(note.node)
        if note.harmonic == model.NATURAL:
            stroke.fret = 0
        if stroke.partial == 1:
            self.lacks["harmonic without a node"] += 1
            stroke.kind = PLUCK

    def _length(self, written: _Written, quarters: Fraction) -> float:
        """The length in seconds of `quarters` in a note."""
        return self.seconds(written.begin + quarters) - self.seconds(written.begin)

    def _join(self, line: list[Stroke], stroke: Stroke, joined: str) -> None:
        """Plays a stroke by the left hand from the last one; a SHIFT slide ends with a stroke."""
        before, way = line[-1], stroke.fret - line[-1].fret
        begun = before.time + before.slow
        if joined == HAMMER:
            stroke.kind = HAMMER if way > 0 else PULL
            return
        latest = stroke.time - 5e-3 if joined == model.SHIFT else stroke.time
        slow = SLIDE_STEP * int(SLIDE_PART * (stroke.time - begun) / SLIDE_STEP + 1e-6)
        slow = slow if slow > A_FRET * abs(way) else 0.0
        begin = max(stroke.time - (slow or A_FRET * abs(way)), min(begun + MIN_BEFORE, latest))
        before.end = begin
        if joined == model.SHIFT:
            line.append(replace(stroke, time=begin, end=stroke.time, kind=SLIDE, bend=(), slow=slow))
        else:
            stroke.time, stroke.kind, stroke.slow = begin, SLIDE, slow

    def _graces(self, line: list[Stroke], stroke: Stroke, note: model.Note) -> None:
        """Plays the grace notes of a stroke before it; if no time is left there, in its place, and the stroke later."""
        room = stroke.time - (line[-1].time + MIN_GRACE if line else 0.0)
        lengths = [min(max(self.tempos.seconds(self.tempos.quarters(stroke.time) + float(grace.length)) - stroke.time,
                           MIN_GRACE), MAX_GRACE) for grace in note.graces]  # fmt: skip
        if note.graces[0].on_beat or sum(lengths) > room:
            scale = min(1.0, (stroke.end - stroke.time) / 2 / sum(lengths))
            lengths = [scale * length for length in lengths]
            stroke.time += sum(lengths)
        at = stroke.time - sum(lengths)
        if line:
            line[-1].end = min(line[-1].end, at)
        before: model.Grace | None = None
        for grace, length in zip(note.graces, lengths, strict=True):
            if grace.joined == "bend" and grace.fret < note.fret and grace is note.graces[-1]:
                bend = (at, 0.0), (stroke.time, float(note.fret - grace.fret))
                stroke.bend = (*bend, *((time, y + note.fret - grace.fret) for time, y in stroke.bend))
                stroke.time, stroke.fret = at, grace.fret
                return
            kind = DEAD if grace.dead else _legato_kind(before, grace.fret) or PLUCK
            line.append(replace(stroke, time=at, end=at + length, fret=grace.fret, kind=kind, bend=()))
            at += length
            before = grace
        if stroke.kind != HARMONIC:
            stroke.kind = _legato_kind(before, note.fret) or stroke.kind

    def _slide_in(self, line: list[Stroke], stroke: Stroke, way: int) -> None:
        """Begins a stroke some frets below (`way` -1) or above it."""
        fret = max(stroke.fret + IN_FRETS * way, min(stroke.fret, 1))
        if stroke.kind in (*TIED, DEAD, HARMONIC) or fret == stroke.fret:
            self.lacks["slide in"] += 1
            return
        line.append(replace(stroke, end=stroke.time + IN_TIME, fret=fret))
        stroke.time, stroke.kind = stroke.time + IN_TIME, SLIDE

    def _slide_out(self, line: list[Stroke], frets: int) -> None:
        """Ends the last stroke with a slide over `frets`."""
        stroke = line[-1]
        fret = min(max(stroke.fret + frets, 1), MAX_FRET)
        if fret == stroke.fret or stroke.fret == 0 or stroke.end - stroke.time < MIN_OUT or stroke.kind == DEAD:
            self.lacks["slide out"] += 1
            return
        begin = max(stroke.end - A_FRET * abs(fret - stroke.fret), (stroke.time + stroke.end) / 2)
        line.append(replace(stroke, time=begin, fret=fret, kind=OFF_UP if frets > 0 else OFF_DOWN, bend=(), slow=0.0))
        stroke.end = begin

    def _trill(self, line: list[Stroke], written: _Written, fret: int, quarters: Fraction) -> None:
        """Plays the last stroke and `fret` in turn until its note ends."""
        if not 0 <= fret <= MAX_FRET:
            self.lacks["trill"] += 1
            return
        begin, left = self._span(line, written)
        step = max(self._length(written, quarters), MIN_TRILL)
        count = ceil(left / step - MIN_PART)
        self._chain(line, islice(cycle([fret, written.note.fret]), max(count - 1, 0)), begin, step)

    def _tremolo(self, line: list[Stroke], written: _Written, quarters: Fraction) -> None:
        """Repeats the last stroke evenly until its note ends: every `quarters` as they count in the note's tuplet."""
        begin, left = self._span(line, written)
        if left > 0:
            whole = sum(part.beat.length / _tuplet(part.beat.length) for part in written.parts)
            part = left / self._length(written, written.end - written.begin)
            count = max(min(round(part * float(whole / quarters) + 1e-6), int(left / MIN_TRILL)), 1)
            self._chain(line, [line[-1].fret] * (count - 1), begin, left / count)

    def _span(self, line: Sequence[Stroke], written: _Written) -> tuple[float, float]:
        """When the note of the last stroke begins, and how long it lasts, s: without its slide and its ring."""
        begin = max(line[-1].time, self.seconds(written.begin))
        return begin, min(line[-1].end, self.seconds(written.end)) - begin

    def _ornament(self, line: list[Stroke], written: _Written) -> None:
        """Plays the turns of a note before the note."""
        stroke, note = line[-1], written.note
        frets = [*note.turns, note.fret]
        step = max(self._length(written, ORNAMENT / len(note.turns)), MIN_TRILL)
        if (
            not all(0 <= fret <= MAX_FRET for fret in frets)
            or stroke.kind in (DEAD, HARMONIC, PINCH)
            or (stroke.kind in TIED and frets[0] != stroke.fret)
            or stroke.end - stroke.time < MIN_ORNAMENTED * step * len(note.turns)
        ):
            self.lacks["ornament"] += 1
            return
        stroke.fret = frets[0]
        self._chain(line, frets[1:], stroke.time, step)

    def _chain(self, line: list[Stroke], frets: Iterable[int], begin: float, step: float) -> None:
        """Goes on at `frets`, every `step` s after `begin`: by the left hand, or by strokes at the same fret."""
        first = last = line[-1]
        end, again = first.end, PLUCK if first.kind in TIED else first.kind
        for k, fret in enumerate(frets, 1):
            kind = again if fret == last.fret else HAMMER if fret > last.fret else PULL
            last.end = begin + k * step
            last = replace(first, time=last.end, fret=fret, kind=kind, slow=0.0)
            line.append(last)
        last.end = end
