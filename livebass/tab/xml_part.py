"""One part of a MusicXML file. musicxml.py tells the order in which it is read."""

from __future__ import annotations

import re
from bisect import bisect_left, bisect_right
from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from fractions import Fraction
from itertools import accumulate, zip_longest
from operator import itemgetter
from typing import Any

from livebass.kernels.score.programs import BASS_PROGRAMS
from livebass.score import tracknames
from livebass.tab import model
from livebass.tab.fingering import DEFAULT_STRINGS, FIFTH_STRING, TOGETHER, Sounding, choose_strings, goes_below
from livebass.tab.model import (
    HIGHEST_LOWEST,
    LONGEST,
    MAX_BARS,
    Bar,
    Beat,
    Hold,
    Note,
    Tempo,
    Track,
    UnreadableTab,
    put_graces,
    velocity_of,
)
from livebass.tab.needs import exact, number, whole
from livebass.tab.order import JUMPS, inner_repeats, sign_of
from livebass.tab.tempos import DEFAULT_TEMPO, FASTEST, SLOWEST
from livebass.tab.xml_signs import (
    LEADING,
    SLASH,
    TYPES,
    force_of,
    mark_beat,
    note_of,
    pitch_of,
    staff_of,
    ties_of,
    transposition,
    written_length,
)

LOWEST_STRING = 18  # F#0, of basses with nine strings: a lower one shows that a tab staff has sounding pitches
MAX_STRINGS = 12
PERCUSSION = "10"  # channel
GRACE = Fraction(1, 8)  # quarter notes
GRACE_STEP = Fraction(1, 1024)  # quarter notes before the beat, where strings are chosen
HOLDS = {"angled": 1.5, "square": 4.0}  # of fermatas by shape, as Guitar Pro holds short and long ones ...
HOLD = 2.0  # ... and ordinary ones
# Programs of sounds, for parts without a program
SOUNDS = {"pluck.bass": 33, "pluck.bass.acoustic": 32, "pluck.bass.electric": 33, "pluck.bass.fretless": 35,
          "strings.contrabass": 32}  # fmt: skip
HAIRPINS = "crescendo", "diminuendo"
PALM, RING = "palm mute", "let ring"
# Words that begin a line over the notes that are played so
TECHNIQUES = {PALM: re.compile(r"p\.?\s?m\.?|palm[ -]mut(?:e|es|ed|ing)"), RING: re.compile(r"let ring")}
MAX_ENDINGS = MAX_PLAYS = 99
MAX_IN_CHORD = 24
MAX_WAITING = 64  # notes of a pitch, or of a part, for the one to which a tie or a slide leads
TIMES = re.compile(
    r"\(?(?:play |repeat )?(?:[x\u00d7] ?(\d+)|(\d+) ?(?:[x\u00d7]|times))\)?"
)  # such as "4x" at a repeat
TEMPO = re.compile(
    r"(?:\u2669|(?<!\w)q|(?<!dotted )quarter|tempo|bpm) ?[=:] ?(\d+(?:\.\d+)?)|(\d+(?:\.\d+)?) ?bpm"
)  # such as "q = 90"
PER_MINUTE = re.compile(r"\d+(?:\.\d+)?")  # in a text such as "ca. 120"
ROUNDING = Fraction(1, 32)  # quarter notes by which a bar may be too long

Moment = tuple[int, Fraction]  # number of a bar, from 0, and the place in it


@dataclass(eq=False)
class _Written:
    """A note that sounds, as the file has it."""

    element: Any
    bar: int
    at: Fraction
    length: Fraction
    voice: str
    pitch: int  # MIDI note over the capo; -1: none
    higher: float  # semitones beside it
    back: int = 0  # of a grace note: its number before the beat
    sounding: Sounding = field(init=False)

    @property
    def key(self) -> tuple[str, int]:
        """Names its staff and pitch, which the note that continues it shares."""
        return staff_of(self.element), self.pitch


@dataclass
class _Grace:
    """Grace notes that begin together."""

    length: Fraction
    on_beat: bool
    notes: list[_Written]


@dataclass
class _Chord:
    """Notes of a voice that begin together, or a rest, with the grace notes before."""

    at: Fraction
    length: Fraction
    notes: list[_Written] = field(default_factory=list)
    graces: list[_Grace] = field(default_factory=list)
    signs: tuple[str, ...] = ()  # of notes that livebass does not play, by name


@dataclass
class _Voice:
    chords: list[_Chord] = field(default_factory=list)
    graces: list[_Grace] = field(default_factory=list)  # before the next chord


def is_bass(name: str, program: str) -> bool:
    """True for the name or the program, from 1, of a bass."""
    return tracknames.is_bass(name) or (program.strip().isdecimal() and int(program[:9]) - 1 in BASS_PROGRAMS)


class Part:
    """A part: its bars when it is made, its notes by `track`."""

    def __init__(self, part: Any, description: Any, divisions: Fraction) -> None:
        self.description, self.name = description, part.get("id")
        self.bars: list[Bar] = []
        self.voices: list[dict[str, _Voice]] = []  # by bar
        self.divisions, self.capo, self.bpm = divisions, 0, DEFAULT_TEMPO
        self.forces: list[tuple[Moment, int]] = []  # dynamics, as velocities
        self.beat, self.length = Fraction(1), Fraction(4)
        self.endings: frozenset[int] = frozenset()
        self.fifths = 0
        self.swing: tuple[Fraction, Fraction] | None = None
        # Hairpins and lines of a technique that are open, by number: where they begin, and their kind
        self.wedges: dict[str, tuple[Moment, str]] = {}
        self.lines: dict[tuple[str, str], tuple[Moment, str]] = {}
        self.spans: list[tuple[Moment, Moment, str]] = []  # all that are complete
        measures = part.findall("measure")
        if len(measures) > MAX_BARS:
            raise UnreadableTab(f"has {len(measures)} bars, more than {MAX_BARS}")
        self._see_strings(part)
        self.latest: _Chord | None = None  # to which a chord's notes belong
        self.counted: set[int] = set()  # numbers of the bars, from 1, whose repeats say how often they play
        self.times: dict[int, int] = {}  # how often words tell to play, by the number of their bar
        self.simile = 0  # bars back to the one that sounds
        self.is_free = False  # bars are as long as their notes
        self.filled: list[Fraction] = []  # length of the notes and rests of each bar ...
        self.stated: list[Fraction] = []  # ... without rests that fill any bar
        self.is_slashed = False  # notes stand for a rhythm
        for measure, after in zip_longest(measures, measures[1:]):
            self._measure(measure, _is_part(after))
        self._find_goals()
        self._count_passes()

    # --- strings ---

    def _see_strings(self, part: Any) -> None:
        """Learns the staves that sound, the transpositions and the open strings, which the first note needs."""
        self.strings: dict[int, int] = {}  # MIDI notes by number of string, 1 the highest
        self.transposes: dict[str, int] = {}  # semitones to the sounding pitch, by staff; "": of all
        self.sounding: set[str] = set()  # staves whose pitches are the sounding ones
        notes = part.findall("measure/note")
        tabs = {clef.get("number") or "1" for clef in part.iterfind(".//clef") if clef.findtext("sign") == "TAB"}
        fretted = {staff_of(note) for note in notes if note.find(".//technical/fret") is not None}
        self.staves = fretted or tabs & {staff_of(note) for note in notes}  # with tablature; other ones show it again
        for transpose in part.iterfind(".//transpose"):
            self.transposes.setdefault(transpose.get("number") or "", transposition(transpose))
        for each in part.iterfind(".//staff-details"):
            self._details(each)
        self._see_open_notes(notes)
        self._lower()
        self.tabbed = bool(self.strings)
        self.tuning = self._tuning(notes)

    def _details(self, details: Any) -> None:
        tunings = {
            whole(tuning.get("line")): pitch_of(tuning, "tuning-")[0] for tuning in details.iterfind("staff-tuning")
        }
        lines = whole(details.findtext("staff-lines") or 0) or len(tunings)
        self.capo = whole(details.findtext("capo") or self.capo)
        if len(DEFAULT_STRINGS) <= len(tunings) < lines:  # lines beyond the strings: only those with a tuning count
            tunings = dict(enumerate((tunings[line] for line in sorted(tunings)), 1))
            lines = len(tunings)
        for line, opened in tunings.items():
            self.strings.setdefault(1 + lines - line, opened)

    def _see_open_notes(self, notes: Sequence[Any]) -> None:
        """Learns the open note of each string from the pitch of its first note.

        The pitches of a tab staff are the sounding ones, whatever else the part says, if its strings would be too low.
        """
        found: dict[int, tuple[int, str]] = {}  # with the staff
        for note in notes:
            string, fret = _technical(note)
            pitch = note.find("pitch")
            if string is not None and fret is not None and pitch is not None:
                opened = pitch_of(pitch)[0] + self._transposed(note) - fret - self.capo
                found.setdefault(string, (opened, staff_of(note)))
        if not self.strings and found and min(found.values())[0] < LOWEST_STRING:
            found = {string: (opened - self.transposes_of(staff), staff) for string, (opened, staff) in found.items()}
            self.sounding |= {staff for _, staff in found.values()}
        for string, (opened, _) in found.items():
            self.strings.setdefault(string, opened)

    def transposes_of(self, staff: str) -> int:
        """Semitones from the written to the sounding pitch on a staff."""
        return 0 if staff in self.sounding else self.transposes.get(staff, self.transposes.get("", 0))

    def _transposed(self, note: Any) -> int:
        return self.transposes_of(staff_of(note))

    def _lower(self) -> None:
        """Lowers a bass whose strings are tuned as its notes are written, an octave higher than they sound."""
        if self.description is None or min(self.strings.values(), default=0) <= HIGHEST_LOWEST:
            return
        tags = "part-name", "midi-instrument/midi-program"
        if is_bass(*(self.description.findtext(tag) or "" for tag in tags)):
            self.strings = {number: note - 12 for number, note in self.strings.items()}
            self.transposes = {staff: by or -12 for staff, by in ({"": 0} | self.transposes).items()}

    def _tuning(self, notes: Sequence[Any]) -> tuple[int, ...]:
        """The notes of the open strings, lowest first; strings that the file does not name are those of a bass."""
        count = max(self.strings, default=0)
        if not count:
            sounds = (pitch_of(p)[0] + self._transposed(note) for note in notes for p in note.iterfind("pitch"))
            wishes = {_technical(note)[0] for note in notes}
            fifth = goes_below(sounds) or len(DEFAULT_STRINGS) + 1 in wishes
            count = len(DEFAULT_STRINGS) + fifth
        if count > MAX_STRINGS:
            raise UnreadableTab(f"is damaged: {count} strings")
        default = dict(enumerate([*reversed(DEFAULT_STRINGS), FIFTH_STRING], 1))
        found = {number: self.strings.get(number, default.get(number)) for number in range(1, count + 1)}
        if None in found.values():
            raise UnreadableTab(f"has {count} strings, but not the tuning of each")
        return tuple(found[number] or 0 for number in range(count, 0, -1))

    # --- bars ---

    def _measure(self, measure: Any, goes_on: bool) -> None:
        """Reads a measure; `goes_on`: the next one is the rest of this one."""
        at = end = stated = Fraction(0)
        bar = Bar(self.length, self.beat, endings=self.endings, fifths=self.fifths, swing=self.swing)
        voices: dict[str, _Voice] = {}
        self.bars.append(bar)
        self.voices.append(voices)
        signs: list[str] = []
        for each in measure:
            if each.tag == "attributes":
                self._attributes(each, bar)
            elif each.tag == "note":
                at = self._note(each, at, voices)
                stated = stated if each.find("rest[@measure='yes']") is not None else max(stated, at)
            elif each.tag in ("backup", "forward"):
                at = max(at + self._duration(each) * (1 if each.tag == "forward" else -1), Fraction(0))
            elif each.tag in ("direction", "sound"):
                self._direction(each, at, bar, signs)
            elif each.tag == "barline":
                self._barline(each, bar)
            end = max(end, at)
            stated = max(stated, at) if each.tag == "forward" else stated
        known = set(filter(None, map(sign_of, signs)))
        bar.signs = frozenset(sign for sign in known if not any(other.startswith(f"{sign} al ") for other in known))
        goes_back = bar.plays > 1 or any(sign in JUMPS for sign in known)
        fills = goes_back and abs(bar.length - end - self.bars[0].length) <= ROUNDING  # the upbeat completes it
        shortens = _is_part(measure) or goes_on or fills or self.is_free
        if end > bar.length + ROUNDING or (shortens and 0 < end < bar.length):
            bar.length = end
        for voice in voices.values():
            if voice.graces:  # after the last note
                voice.chords.append(_Chord(end, Fraction(0), graces=voice.graces))
        self._repeat_simile()
        self.filled.append(end)
        self.stated.append(stated)

    def _repeat_simile(self) -> None:
        """A bar without notes plays an earlier one again, where signs say so."""
        here, voices = len(self.bars) - 1, self.voices[-1]
        if 0 < self.simile <= here and not any(chord.notes for voice in voices.values() for chord in voice.chords):
            earlier = self.voices[here - self.simile]
            self.voices[-1] = {name: _moved(voice, here) for name, voice in earlier.items()}

    def _find_goals(self) -> None:
        """Jumps that name no goal lead to the coda or the fine that the part has."""
        signs = frozenset[str]().union(*(bar.signs for bar in self.bars))
        goal = " al coda" if "da coda" in signs else " al fine" if "fine" in signs else ""
        for bar in self.bars:
            bar.signs = frozenset(sign + goal if JUMPS.get(sign, ("", "-"))[1] == "" else sign for sign in bar.signs)

    def _count_passes(self) -> None:
        """Repeats that do not say how often they play do it for all of their endings, or as often as words tell."""
        times, inner = 0, inner_repeats(self.bars)
        for n, (bar, after) in enumerate(zip_longest(self.bars, self.bars[1:]), 1):
            times = self.times.get(n, 0 if bar.opens else times)
            if bar.plays > 1 and not bar.endings and n not in self.counted and times > 1:
                bar.plays = times
            times = 0 if bar.plays > 1 else times
            if bar.plays > 1 and bar.endings and n not in self.counted and n - 1 not in inner:
                follows = after is not None and max(after.endings, default=0) > max(bar.endings)
                bar.plays = max(max(bar.endings) + follows, 2)

    def _duration(self, element: Any) -> Fraction:
        found = exact(element.findtext("duration") or "0") / self.divisions
        if not 0 <= found <= LONGEST:
            raise UnreadableTab(f"is damaged: a note of {float(found):g} quarter notes")
        return found

    def _attributes(self, attributes: Any, bar: Bar) -> None:
        self.divisions = exact(attributes.findtext("divisions") or str(self.divisions))
        self.fifths = bar.fifths = whole(attributes.findtext("key/fifths") or self.fifths)
        time = attributes.find("time")  # of the first staff; others have their own, usually the same
        beats, units = list[str](), list[Fraction]()
        if time is not None:
            self.is_free = time.find("senza-misura") is not None
            beats = [each.text or "" for each in time.iterfind("beats")]
            units = [Fraction(4, whole(each.text)) for each in time.iterfind("beat-type")]
        if beats and units:
            self.beat = min(units)
            rows = zip(beats, units, strict=True)
            self.length = sum((sum(map(whole, text.split("+"))) * unit for text, unit in rows), Fraction(0))
            if not 0 < self.length <= LONGEST or self.beat <= 0:
                raise UnreadableTab(f"is damaged: a bar of {float(self.length):g} quarter notes")
            bar.beat, bar.length = self.beat, self.length
        for each in attributes.iterfind("measure-style/measure-repeat"):
            self.simile = whole(each.text or 1) if each.get("type") == "start" else 0
        for each in attributes.iterfind("measure-style/slash"):
            self.is_slashed = each.get("type") == "start"
        for each in attributes.iterfind("transpose"):
            self.transposes[each.get("number") or ""] = transposition(each)

    def _direction(self, direction: Any, at: Fraction, bar: Bar, signs: list[str]) -> None:
        at = max(at + self._offset(direction), Fraction(0))
        here = len(self.bars) - 1, at
        words = _words(direction)
        goal = " al fine" if "fine" in words else " al coda" if "coda" in words else ""
        for sound in direction.iter("sound"):
            if sound.get("tempo"):
                self.bpm = number(sound.get("tempo"))
                own = Fraction(0) if sound is direction else self._offset(sound)
                bar.tempos.append(Tempo(max(at + own, Fraction(0)), self.bpm))
            self._set_force(here, force_of(sound))
            swing = sound.find("swing")
            if swing is not None:
                self.swing = bar.swing = _swing(swing)
            jumps = {"dacapo": f"da capo{goal}", "dalsegno": f"da segno{goal}", "tocoda": "da coda"}
            signs += [jumps.get(name, name) for name in sound.keys()]  # noqa: SIM118
        signs.append(words)
        if times := TIMES.fullmatch(words.strip()):
            self.times[len(self.bars)] = min(whole(times[1] or times[2]), MAX_PLAYS)
        technique = next((kind for kind, text in TECHNIQUES.items() if text.fullmatch(words.strip())), "")
        stated = direction.find("sound[@tempo]") is not None
        by_words = TEMPO.search(words)
        if by_words and not stated and direction.find("direction-type/metronome") is None:
            self.bpm = number(by_words[1] or by_words[2])
            bar.tempos.append(Tempo(at, self.bpm))
        for each in direction.iterfind("direction-type/*"):
            if each.tag in ("segno", "coda"):
                signs.append(each.tag)
            elif each.tag == "rehearsal":
                bar.name = (each.text or "").strip()
            elif each.tag == "dynamics" and len(each):
                self._set_force(here, velocity_of(each[0].tag))
            elif each.tag == "metronome" and not stated:
                self.bpm = _tempo(each, self.bpm)
                bar.tempos.append(Tempo(at, self.bpm))
            elif each.tag == "wedge":
                self._wedge(each, here)
            elif each.tag in ("dashes", "bracket"):
                self._line(each, here, technique)
                technique = ""
        if technique:  # without a line: for this beat
            self.spans.append((here, here, technique))

    def _offset(self, direction: Any) -> Fraction:
        """How much later a direction sounds than it stands: most offsets are only for the eye."""
        offset = direction.find("offset")
        sounds = offset is not None and (direction.tag == "sound" or offset.get("sound") == "yes")
        return exact(offset.text or "0") / self.divisions if sounds else Fraction(0)

    def _set_force(self, moment: Moment, velocity: int) -> None:
        if velocity:
            self.forces.append((moment, velocity))

    def _wedge(self, wedge: Any, at: Moment) -> None:
        number, kind = wedge.get("number") or "1", wedge.get("type")
        if kind in HAIRPINS:
            self.wedges[number] = at, kind
        elif kind == "stop" and number in self.wedges:
            begin, kind = self.wedges.pop(number)
            self.spans.append((begin, at, kind))

    def _line(self, line: Any, at: Moment, technique: str) -> None:
        """Begins a line of a `technique`, if the words before it name one, or ends one."""
        name = line.tag, line.get("number") or "1"
        if line.get("type") == "start" and technique:
            self.lines[name] = at, technique
        elif line.get("type") == "stop" and name in self.lines:
            begin, kind = self.lines.pop(name)
            self.spans.append((begin, at, kind))

    def _barline(self, barline: Any, bar: Bar) -> None:
        repeat, ending = barline.find("repeat"), barline.find("ending")
        if repeat is not None and repeat.get("direction") == "forward":
            bar.opens = True
        elif repeat is not None:
            bar.plays = max(whole(repeat.get("times") or 0), 2)
            bar.after_jump = repeat.get("after-jump") == "yes"
            self.counted |= {len(self.bars)} if repeat.get("times") else set()
        if ending is not None:
            bar.endings = self.endings = _passes(ending.get("number") or ending.text or "") or self.endings
            if ending.get("type") != "start":
                self.endings = frozenset()

    # --- notes ---

    def _note(self, element: Any, at: Fraction, voices: dict[str, _Voice]) -> Fraction:
        """Reads a note at `at`; returns where the next one begins."""
        name = element.findtext("voice") or "1"
        voice = voices.setdefault(name, _Voice())
        grace, chord = element.find("grace"), element.find("chord") is not None and self.latest is not None
        measured = grace is not None or element.find("duration") is not None
        length = self._duration(element) if measured else written_length(element)
        begin = self.latest.at if chord and self.latest and grace is None else at
        note = self._written(element, begin, length, name)
        if grace is not None:
            if chord and voice.graces and note is not None:
                voice.graces[-1].notes.append(note)
            elif note is not None:
                kind = TYPES.get(element.findtext("type") or "")
                own = Fraction(2, kind) if kind else GRACE
                voice.graces.append(_Grace(own, grace.get("steal-time-following") is not None, [note]))
            return at
        if not chord or self.latest is None:
            self.latest = _Chord(at, length)
            voice.chords.append(self.latest)
            if note is not None:
                self.latest.graces, voice.graces = voice.graces, []
                for back, before in enumerate(reversed(self.latest.graces), 1):
                    for each in before.notes:
                        each.back = back
        if note is not None:
            if len(self.latest.notes) == MAX_IN_CHORD:
                raise UnreadableTab(f"is damaged: a chord of more than {MAX_IN_CHORD} notes")
            self.latest.notes.append(note)
            shape = next((each.text or "" for each in element.iterfind("notations/fermata")), None)
            if shape is not None:
                self.bars[-1].holds.append(Hold(self.latest.at, self.latest.length, HOLDS.get(shape.strip(), HOLD)))
        elif sign := self._lacks(element):
            self.latest.signs += (sign,)
        return at if chord else at + length

    def _is_shown_again(self, element: Any) -> bool:
        """True for a note of a staff beside one with tablature."""
        return bool(self.staves) and staff_of(element) not in self.staves

    def _is_slash(self, element: Any) -> bool:
        """True for a note that only shows a rhythm."""
        return self.is_slashed or (element.findtext("notehead") or "").strip() == SLASH

    def _lacks(self, element: Any) -> str:
        """Names a note that is not played; "" for one that shows another again, and for a rest."""
        if self._is_shown_again(element) or any(element.find(tag) is not None for tag in ("rest", "cue")):
            return ""
        return "slash note" if self._is_slash(element) else "note without a pitch"

    def _written(self, element: Any, at: Fraction, length: Fraction, voice: str) -> _Written | None:
        """The note of an element; None for a rest, and for what shows another note again or only a rhythm."""
        if self._is_shown_again(element):
            return None
        if element.find("cue") is not None or self._is_slash(element):
            return None
        pitch, place = element.find("pitch"), _technical(element)
        number, higher = (-1, 0.0) if pitch is None else pitch_of(pitch)
        sounds = -1 if pitch is None else number + self._transposed(element) - self.capo
        if sounds < 0 and None in place:
            return None
        dynamics = element.find("notations/dynamics")
        if dynamics is not None and len(dynamics):
            self._set_force((len(self.bars) - 1, at), velocity_of(dynamics[0].tag))
        return _Written(element, len(self.bars) - 1, at, length, voice, sounds, higher if place[1] is None else 0.0)

    def _choose_strings(self, begins: Sequence[Fraction]) -> None:
        """Gives each note its string and fret, over all voices."""
        chords = [chord for voices in self.voices for voice in voices.values() for chord in voice.chords]
        notes = [note for chord in chords for grace in chord.graces for note in grace.notes]
        notes += [note for chord in chords for note in chord.notes]
        notes.sort(key=lambda note: (begins[note.bar] + note.at, -note.back))
        found: list[Sounding] = []
        together: dict[tuple[Fraction, int], _Written] = {}  # which voices may share
        held: dict[tuple[str, int], deque[_Written]] = {}  # which wait for the note tied to them, the last MAX_WAITING
        leading: dict[tuple[str, str], _Written] = {}  # which lead to another one, by the sign and its number
        last: dict[int, _Written] = {}  # of each pitch
        for note in notes:
            begin = begins[note.bar] + note.at
            begin, end = begin - note.back * GRACE_STEP, begin + note.length
            string, fret = _technical(note.element)
            lower = None if string is None else len(self.tuning) - string
            given = None if lower is None or fret is None else (lower, fret)
            ties = {tie.get("type") for tie in ties_of(note.element)}
            tied = _tied(held.get(note.key, deque()), begin) if "stop" in ties else None
            twin = together.get((begin, note.pitch)) if note.pitch >= 0 else None
            if twin is not None and (twin.voice == note.voice or given or twin.sounding.given):
                twin = None
            same = tied if tied is not None and given in (None, tied.sounding.given) else twin
            if same is not None:
                note.sounding = same.sounding
                note.sounding.end = max(note.sounding.end, end)
            else:
                note.sounding = Sounding(begin, end, note.pitch, given, None if given else lower)
                if "stop" in ties and note.pitch in last:  # in an ending that does not follow the first note
                    note.sounding.origin = last[note.pitch].sounding
                found.append(note.sounding)
            together[begin, note.pitch] = last[note.pitch] = note
            if "start" in ties:
                held.setdefault(note.key, deque(maxlen=MAX_WAITING)).append(note)
            for sign in (*note.element.iterfind("notations/*"), *note.element.iterfind("notations/technical/*")):
                if sign.tag in LEADING:
                    name = sign.tag, sign.get("number") or "1"
                    if sign.get("type") == "stop" and name in leading and same is None:
                        note.sounding.origin = leading.pop(name).sounding
                    elif sign.get("type") == "start":
                        leading[name] = note
                        if len(leading) > MAX_WAITING:
                            del leading[next(iter(leading))]
        choose_strings(found, self.tuning)

    def track(self, left: int) -> Track:
        """The part with strings and frets, after its bars have their lengths; `left` notes are not read."""
        begins = list(accumulate((bar.length for bar in self.bars), initial=Fraction(0)))
        self.forces.sort(key=itemgetter(0))
        self._choose_strings(begins)
        voices = [[self._beats(voice) for voice in each.values()] for each in self.voices]
        self._put_spans(begins, voices)
        description = self.description
        if description is None:
            return Track("", self.tuning, self.capo, None, False, voices, self.tabbed, left)
        program, channel = (description.findtext(f"midi-instrument/midi-{name}") for name in ("program", "channel"))
        sound = (description.findtext("score-instrument/instrument-sound") or "").strip()
        kind = whole(program) - 1 if program else SOUNDS.get(sound)
        name = (description.findtext("part-name") or "").strip()
        drums = (channel or "").strip() == PERCUSSION
        return Track(name, self.tuning, self.capo, kind, drums, voices, self.tabbed, left)

    def _beats(self, voice: _Voice) -> list[Beat]:
        """The beats of a voice in a bar."""
        beats: list[Beat] = []
        slurs: set[str] = set()  # that are open
        for chord in voice.chords:
            beat = Beat(chord.at, chord.length, [], signs=chord.signs)
            before = beats[-1].notes if beats else []
            for written in chord.notes:
                note = self._made(written)
                beat.notes.append(note)
                mark_beat(written.element, beat)
                slurs = self._slur(written.element, note, before, slurs)
            if chord.notes or chord.length or chord.signs:
                beats.append(beat)
            graces = [
                (Beat(chord.at, grace.length, list(map(self._made, grace.notes))), grace.on_beat)
                for grace in chord.graces
            ]
            beats += put_graces(graces, beat)
        return beats

    def _made(self, written: _Written) -> Note:
        """The note of the model."""
        k = bisect_right(self.forces, (written.bar, written.at), key=itemgetter(0))
        force = self.forces[k - 1][1] if k else model.FORTE
        note = note_of(written.element, *written.sounding.place, force, written.higher)
        note.passes = _passes(written.element.get("time-only") or "")
        return note

    def _slur(self, element: Any, note: Note, before: Sequence[Note], slurs: set[str]) -> set[str]:
        """In tablature a slur from a note to the next one on its string is a hammer-on or a pull-off.

        `slurs` are open before the note; returns those open after it.
        """
        for other in before if slurs and staff_of(element) in self.staves else []:
            other.hammer |= other.string == note.string and other.fret != note.fret and not other.slides
        for slur in element.iterfind("notations/slur"):
            name = slur.get("number") or "1"
            slurs = slurs | {name} if slur.get("type") == "start" else slurs - {name}
        return slurs

    def _put_spans(self, begins: Sequence[Fraction], voices: Sequence[Sequence[Sequence[Beat]]]) -> None:
        """Marks the beats under each hairpin and each line of a technique."""
        bars = zip(begins, voices, strict=False)
        beats = [(begin + beat.at, beat) for begin, voices in bars for voice in voices for beat in voice]
        beats.sort(key=itemgetter(0))
        after: dict[str, list[int]] = {}  # by group of kinds: from each beat, a later one up to which all are marked
        for (first, at), (last, until), kind in reversed(self.spans):  # the last one counts
            begin, end = begins[first] + at, begins[last] + until
            marked = after.setdefault("" if kind in HAIRPINS else kind, list(range(len(beats) + 1)))
            k = _unmarked(marked, bisect_left(beats, begin, key=itemgetter(0)))
            while k < len(beats) and (beats[k][0] < end or beats[k][0] == begin):
                beat = beats[k][1]
                if kind in HAIRPINS:
                    beat.hairpin = kind
                for note in beat.notes:
                    note.palm, note.let_ring = note.palm or kind == PALM, note.let_ring or kind == RING
                marked[k] = k + 1
                k = _unmarked(marked, k)


def _technical(element: Any) -> tuple[int | None, int | None]:
    """The string and the fret of a note, where the file has them."""
    signs = element.findall("notations/technical")
    texts = [next((t.findtext(name) for t in signs if t.findtext(name)), None) for name in ("string", "fret")]
    string, fret = (None if text is None else whole(text) for text in texts)
    if (fret is not None and fret < 0) or (string is not None and string < 1):
        raise UnreadableTab(f"is damaged: string {string}, fret {fret}")
    return string, fret


def _unmarked(after: list[int], k: int) -> int:
    """The first of the beats from `k` on that no span has marked; the way there gets shorter."""
    while after[k] != k:
        after[k] = after[after[k]]
        k = after[k]
    return k


def _tied(waiting: deque[_Written], begin: Fraction) -> _Written | None:
    """The note of these that ends where its tied one begins; it waits no longer."""
    found = next((note for note in waiting if abs(note.sounding.end - begin) < TOGETHER), None)
    if found is not None:
        waiting.remove(found)
    return found


def _moved(voice: _Voice, bar: int) -> _Voice:
    """A voice again, in another bar."""

    def again(notes: Sequence[_Written]) -> list[_Written]:
        return [replace(note, bar=bar) for note in notes]

    return _Voice([
        replace(chord, notes=again(chord.notes), graces=[replace(g, notes=again(g.notes)) for g in chord.graces])
        for chord in voice.chords
    ])  # fmt: skip


def _is_part(measure: Any) -> bool:
    """True for an upbeat, and for the rest of a bar that a repeat splits."""
    return measure is not None and (measure.get("implicit") == "yes" or measure.get("number") == "0")


def _passes(text: str) -> frozenset[int]:
    """The passes in a text such as "1, 2", "1.-3." or "1-3"."""
    found: set[int] = set()
    for first, last in re.findall(r"(\d+)\.?(?:\s*-\s*(\d+))?", text):
        found.update(range(whole(first), min(whole(last or first), MAX_ENDINGS) + 1))
    return frozenset(found)


def _words(direction: Any) -> str:
    return " ".join(each.text or "" for each in direction.iter("words")).lower()


def _swing(swing: Any) -> tuple[Fraction, Fraction] | None:
    first, second = (whole(swing.findtext(name) or 0) for name in ("first", "second"))
    if first <= 0 or second <= 0:
        return None
    note = Fraction(1, 4) if swing.findtext("swing-type") == "16th" else Fraction(1, 2)
    return model.swing_of(Fraction(first, first + second), note)


def _tempo(metronome: Any, bpm: float) -> float:
    """The tempo of a metronome mark such as "quarter = 120" or, after `bpm`, "half = quarter"; else `bpm`."""
    units: list[tuple[Fraction, int]] = []  # and their dots
    for each in metronome:
        kind = TYPES.get((each.text or "").strip()) if each.tag == "beat-unit" else None
        if kind:
            units.append((Fraction(4, kind), 0))
        elif each.tag == "beat-unit-dot" and units:
            units[-1] = units[-1][0], min(units[-1][1] + 1, 8)
    lengths = [float(unit * (2 - Fraction(1, 2**dots))) for unit, dots in units]
    if len(lengths) == 2:
        return min(max(bpm * lengths[1] / lengths[0], SLOWEST), FASTEST)
    stated = PER_MINUTE.search(metronome.findtext("per-minute") or "")
    return number(stated[0]) * lengths[0] if stated and len(lengths) == 1 else bpm
