"""Reads MusicXML: strings and frets where the file gives them, else the lowest fret for each pitch."""

from __future__ import annotations

import re
from bisect import bisect_left
from collections import Counter
from collections.abc import Sequence
from copy import deepcopy
from dataclasses import dataclass, field, replace
from fractions import Fraction
from itertools import accumulate, zip_longest
from typing import Any

from livebass.kernels.score.programs import BASS_PROGRAMS
from livebass.score import tracknames
from livebass.tab import model
from livebass.tab.needs import checked_reading, exact, number, parsed_xml
from livebass.tab.order import JUMPS, sign_of
from livebass.tab.tempos import DEFAULT_TEMPO, FASTEST, SLOWEST

STEPS = {"C": 0, "D": 2, "E": 4, "F": 5, "G": 7, "A": 9, "B": 11}
TYPES = {"whole": 1, "half": 2, "quarter": 4, "eighth": 8, "16th": 16, "32nd": 32, "64th": 64}
DEFAULT_STRINGS = (28, 33, 38, 43)  # strings of a bass, for a part without strings of its own
FIFTH_STRING = 23
MAX_STRINGS = 12
PERCUSSION = "10"  # channel
GRACE = Fraction(1, 8)  # quarter notes
BRUSH = Fraction(1, 8)
# Signs of a note, by the elements of its notations
SLIDES = {"slide": model.SHIFT, "glissando": model.SHIFT, "scoop": model.IN_BELOW, "plop": model.IN_ABOVE,
          "falloff": model.OUT_DOWN, "doit": model.OUT_UP}  # fmt: skip
ORNAMENTS = {"trill-mark": "trill", "mordent": "mordent", "inverted-mordent": "inverted mordent", "turn": "turn",
             "inverted-turn": "inverted turn"}  # fmt: skip
HOLDS = {"angled": 1.5, "square": 4.0}  # of fermatas by shape, as Guitar Pro holds short and long ones ...
HOLD = 2.0  # ... and the usual ones
# Programs of sounds, for parts without a program
SOUNDS = {"pluck.bass": 33, "pluck.bass.acoustic": 32, "pluck.bass.electric": 33, "pluck.bass.fretless": 35,
          "strings.contrabass": 32}  # fmt: skip
HAIRPINS = "crescendo", "diminuendo"
PALM, RING = "palm mute", "let ring"
# Words that begin a line over the notes that are played so
TECHNIQUES = {PALM: re.compile(r"p\.?\s?m\.?|palm[ -]mut(?:e|es|ed|ing)"), RING: re.compile(r"let ring")}
UNMEASURED = 3  # strokes of a tremolo without a speed
FULL = 90  # velocity of dynamics="100"
MAX_ENDINGS = MAX_PLAYS = 99
MAX_NOTES = 30_000  # with rests; of a score with more, only the parts that a bass may play are read
MAX_DIRECTIONS = 60_000  # with tempos
MAX_IN_CHORD = 24
# Pieces of the text of a large score
DESCRIPTION = re.compile(rb"""<score-part\s[^<>]*?id=["'](?P<id>[^"'<>]*).*?</score-part>""", re.DOTALL)
PART = re.compile(rb"""<part\s[^<>]*?id=["'](?P<id>[^"'<>]*)""")
NOTE = re.compile(rb"<note(?:\s[^<>]*)?>")
*SAID, DURATION = (
    re.compile(rb"<%b>([^<]*)</%b>" % (tag, tag)) for tag in (b"part-name", b"midi-program", b"duration")
)
TIMES = re.compile(
    r"\(?(?:play |repeat )?(?:[x\u00d7] ?(\d+)|(\d+) ?(?:[x\u00d7]|times))\)?"
)  # such as "4x" at a repeat
TEMPO = re.compile(
    r"(?:\u2669|(?<!\w)q|(?<!dotted )quarter|tempo|bpm) ?[=:] ?(\d+(?:\.\d+)?)|(\d+(?:\.\d+)?) ?bpm"
)  # such as "q = 90"
PER_MINUTE = re.compile(r"\d+(?:\.\d+)?")  # in a text such as "ca. 120"
ROUNDING = Fraction(1, 32)  # quarter notes by which a bar may be too long


def read_musicxml(data: bytes) -> model.Tab:
    """The piece in a MusicXML file. Raises UnreadableTab, or LookupError without defusedxml."""
    left = Counter[str]()  # notes that are not read, by part
    if data.count(b"</note>") > MAX_NOTES:
        data, left = _of_basses(data)
    root = parsed_xml(data)
    with checked_reading():
        if root.tag == "score-timewise":
            _turn_by_part(root)
        if root.tag != "score-partwise":
            raise model.UnreadableTab(
                f"is not a score: its XML is {root.tag[:40]!r}, not score-partwise or score-timewise"
            )
        for name, count, maximum in (
            ("notes and rests", _count(root, "note"), MAX_NOTES),
            ("directions", _count(root, "direction") + _count(root, "sound"), MAX_DIRECTIONS),
        ):
            if count > maximum:
                raise model.UnreadableTab(f"has {count} {name}, more than {maximum}")
        names = {part.get("id"): part for part in root.iterfind("part-list/score-part")}
        divisions = exact(root.findtext(".//divisions") or "1")  # of parts without their own
        parts = [_Part(part, names.get(part.get("id")), divisions) for part in root.iterfind("part")]
        _shorten_upbeat(parts)
        tracks = [replace(part.track(), left=left[part.name]) for part in parts]
        return model.Tab(_merge_parts([part.bars for part in parts]), tracks)


def _count(root: Any, tag: str) -> int:
    return sum(1 for _ in root.iter(tag))


def _of_basses(data: bytes) -> tuple[bytes, Counter[str]]:
    """A large score with the notes of its basses only, and the number of the others by part.

    A part is a bass by its tablature, its name or its program. The notes of the others become times that pass.
    """
    basses = set[bytes]()
    for part in DESCRIPTION.finditer(data):
        found = (match[1].decode(errors="replace") if (match := text.search(part[0])) else "" for text in SAID)
        basses |= {part["id"]} if _is_bass(*found) else set()
    pieces = data.split(b"</part>")
    names = [match["id"] if (match := PART.search(piece)) else b"" for piece in pieces]
    basses |= {name for name, piece in zip(names, pieces, strict=True) if b"<fret>" in piece}
    left = Counter[str]()
    for k, (name, piece) in enumerate(zip(names, pieces, strict=True)):
        if name not in basses:
            notes = [NOTE.split(each, maxsplit=1) for each in piece.split(b"</note>")]
            left[name.decode(errors="replace")] += sum(b"<pitch>" in text for _, *texts in notes for text in texts)
            pieces[k] = b"".join(before + b"".join(map(_passing, texts)) for before, *texts in notes)
    return b"</part>".join(pieces), left


def _is_bass(name: str, program: str) -> bool:
    """True for the name or the program, from 1, of a bass."""
    return tracknames.is_bass(name) or (program.strip().isdecimal() and int(program[:9]) - 1 in BASS_PROGRAMS)


def _passing(note: bytes) -> bytes:
    """The time in which a note that is not read would sound."""
    duration = None if b"<chord" in note else DURATION.search(note)
    return b"<forward>%b</forward>" % duration[0] if duration else b""


def _turn_by_part(root: Any) -> None:
    """Makes a score by time, whose measures have the parts in them, one by part."""
    parts: dict[str, Any] = {}
    for measure in root.iterfind("measure"):
        for part in measure.findall("part"):
            name = part.get("id")
            if name not in parts:
                parts[name] = root.makeelement("part", {"id": name})
                root.append(parts[name])
            part.tag, part.attrib = "measure", dict(measure.attrib)
            parts[name].append(part)
    root.tag = "score-partwise"


def _shorten_upbeat(parts: Sequence[_Part]) -> None:
    """Shortens the first bar to its notes if no part fills it, but one fills the next: an upbeat without a mark."""
    long = [part for part in parts if len(part.bars) > 1]
    upbeat, after = (max((part.filled[k] for part in long), default=Fraction(0)) for k in (0, 1))
    if upbeat > 0 and all(upbeat < part.bars[0].length and after >= part.bars[1].length - ROUNDING for part in long):
        for part in long:
            part.bars[0].length = upbeat


def _merge_parts(parts: Sequence[list[model.Bar]]) -> list[model.Bar]:
    """The bars of all parts as one: as long as the longest, with the tempos and signs of each."""
    bars = max(parts, key=len, default=[])
    for others in parts:
        for bar, other in zip(bars, others, strict=False):
            bar.tempos += [tempo for tempo in other.tempos if tempo not in bar.tempos]
            bar.holds += [hold for hold in other.holds if all(hold.at != own.at for own in bar.holds)]
            bar.signs, bar.name = bar.signs | other.signs, bar.name or other.name
            bar.length = max(bar.length, other.length)
    for bar in bars:
        bar.tempos.sort(key=lambda tempo: tempo.at)
    return bars


@dataclass
class _Voice:
    beats: list[model.Beat] = field(default_factory=list)
    graces: list[tuple[model.Beat, bool]] = field(default_factory=list)  # before the next beat; True: on it
    own: list[tuple[model.Beat, bool]] = field(default_factory=list)  # before the last beat
    slurs: set[str] = field(default_factory=set)  # that are open

    def put_graces(self) -> None:
        """Completes the last beat, when its notes are known."""
        if self.own:
            self.beats += model.put_graces(self.own, self.beats[-1])
            self.own = []


class _Part:
    """A part, read bar by bar."""

    def __init__(self, part: Any, description: Any, divisions: Fraction) -> None:
        self.description, self.name = description, part.get("id")
        self.bars: list[model.Bar] = []
        self.voices: list[list[list[model.Beat]]] = []
        self.divisions, self.capo, self.velocity, self.bpm = divisions, 0, model.FORTE, DEFAULT_TEMPO
        self.transpose = _transposition(part.find(".//transpose"))
        self.beat, self.length = Fraction(1), Fraction(4)
        self.strings: dict[int, int] = {}  # MIDI notes by number of string, 1 the highest
        self.endings: frozenset[int] = frozenset()
        self.begin, self.fifths = Fraction(0), 0
        self.swing: tuple[Fraction, Fraction] | None = None
        # Hairpins and lines of a technique that are open, by number: where they begin, and their kind
        self.wedges: dict[str, tuple[Fraction, str]] = {}
        self.lines: dict[tuple[str, str], tuple[Fraction, str]] = {}
        self.spans: list[tuple[Fraction, Fraction, str]] = []  # all that are complete
        measures = part.findall("measure")
        if len(measures) > model.MAX_BARS:
            raise model.UnreadableTab(f"has {len(measures)} bars, more than {model.MAX_BARS}")
        notes = part.findall("measure/note")
        self.staves = {_staff(note) for note in notes if note.find(".//technical/fret") is not None}  # with tablature
        for each in part.iterfind(".//staff-details"):
            self._details(each)
        for note in notes:  # the strings, before the first note needs them
            self._see_string(note)
        self._lower()
        self.tabbed = bool(self.strings)
        self.tuning = self._tuning(notes)
        self.latest: model.Beat | None = None  # to which a chord's notes belong
        self.sounding: dict[int, tuple[int, int]] = {}  # the string and fret of each pitch
        self.counted: set[int] = set()  # numbers of the bars, from 1, whose repeats say how often they play
        self.times: dict[int, int] = {}  # how often words tell to play, by the number of their bar
        self.simile = 0  # bars back to the one that sounds
        self.is_free = False  # bars are as long as their notes
        self.filled: list[Fraction] = []  # length of the notes and rests of each bar
        for measure, after in zip_longest(measures, measures[1:]):
            self._measure(measure, _is_part(after))
        self._put_spans()
        self._find_goals()
        self._count_passes()

    def track(self) -> model.Track:
        description = self.description
        if description is None:
            return model.Track("", self.tuning, self.capo, None, False, self.voices, self.tabbed)
        program, channel = (description.findtext(f"midi-instrument/midi-{name}") for name in ("program", "channel"))
        sound = (description.findtext("score-instrument/instrument-sound") or "").strip()
        kind = int(program) - 1 if program else SOUNDS.get(sound)
        name = (description.findtext("part-name") or "").strip()
        drums = (channel or "").strip() == PERCUSSION
        return model.Track(name, self.tuning, self.capo, kind, drums, self.voices, self.tabbed)

    def _see_string(self, note: Any) -> None:
        """Learns the open note of a string from the pitch of its first note."""
        string, fret, pitch = (
            note.findtext(".//technical/string"),
            note.findtext(".//technical/fret"),
            note.find("pitch"),
        )
        if string and fret and pitch is not None:
            opened = _pitch(pitch, "") + self.transpose - int(fret) - self.capo
            self.strings.setdefault(int(string), opened)

    def _details(self, details: Any) -> None:
        tunings = details.findall("staff-tuning")
        lines = int(details.findtext("staff-lines") or 0) or len(tunings)
        self.capo = int(details.findtext("capo") or self.capo)
        for tuning in tunings:
            self.strings.setdefault(1 + lines - int(tuning.get("line")), _pitch(tuning, "tuning-"))

    def _lower(self) -> None:
        """Lowers a bass whose strings are tuned as its notes are written, an octave higher than they sound."""
        if self.description is None or min(self.strings.values(), default=0) <= model.HIGHEST_LOWEST:
            return
        tags = "part-name", "midi-instrument/midi-program"
        if _is_bass(*(self.description.findtext(tag) or "" for tag in tags)):
            self.strings = {number: note - 12 for number, note in self.strings.items()}
            self.transpose = self.transpose or -12

    def _tuning(self, notes: Sequence[Any]) -> tuple[int, ...]:
        """The notes of the open strings, lowest first; strings that the file does not name are those of a bass."""
        count = max(self.strings, default=0)
        if not count:
            lowest = min((_pitch(pitch, "") for note in notes for pitch in note.iterfind("pitch")), default=127)
            count = len(DEFAULT_STRINGS) + (FIFTH_STRING <= lowest + self.transpose < DEFAULT_STRINGS[0])
        if count > MAX_STRINGS:
            raise model.UnreadableTab(f"is damaged: {count} strings")
        default = dict(enumerate([*reversed(DEFAULT_STRINGS), FIFTH_STRING], 1))
        found = {number: self.strings.get(number, default.get(number)) for number in range(1, count + 1)}
        if None in found.values():
            raise model.UnreadableTab(f"has {count} strings, but not the tuning of each")
        return tuple(found[number] or 0 for number in range(count, 0, -1))

    def _measure(self, measure: Any, goes_on: bool) -> None:
        """Reads a measure; `goes_on`: the next one is the rest of this one."""
        at = Fraction(0)
        end = at
        bar = model.Bar(self.length, self.beat, endings=self.endings, fifths=self.fifths, swing=self.swing)
        voices: dict[str, _Voice] = {}
        self.bars.append(bar)
        signs: list[str] = []
        for each in measure:
            if each.tag == "attributes":
                self._attributes(each, bar)
            elif each.tag == "note":
                at = self._note(each, at, voices)
            elif each.tag in ("backup", "forward"):
                at = max(at + self._duration(each) * (1 if each.tag == "forward" else -1), Fraction(0))
            elif each.tag in ("direction", "sound"):
                self._direction(each, at, bar, signs)
            elif each.tag == "barline":
                self._barline(each, bar)
            end = max(end, at)
        known = set(filter(None, map(sign_of, signs)))
        bar.signs = frozenset(sign for sign in known if not any(other.startswith(f"{sign} al ") for other in known))
        goes_back = bar.plays > 1 or any(sign in JUMPS for sign in known)
        fills = goes_back and abs(bar.length - end - self.bars[0].length) <= ROUNDING  # the upbeat completes it
        shortens = _is_part(measure) or goes_on or fills or self.is_free
        if end > bar.length + ROUNDING or (shortens and 0 < end < bar.length):
            bar.length = end
        for voice in voices.values():
            voice.put_graces()
            if voice.graces:  # after the last note
                voice.beats += model.put_graces(voice.graces, model.Beat(end, Fraction(0), []))
        found = [voice.beats for voice in voices.values()]
        if 0 < self.simile <= len(self.voices) and not any(beat.notes for beats in found for beat in beats):
            found = deepcopy(self.voices[-self.simile])
        self.voices.append(found)
        self.begin += bar.length
        self.filled.append(end)

    def _find_goals(self) -> None:
        """Jumps that name no goal lead to the coda or the fine that the part has."""
        signs = frozenset[str]().union(*(bar.signs for bar in self.bars))
        goal = " al coda" if "da coda" in signs else " al fine" if "fine" in signs else ""
        for bar in self.bars:
            bar.signs = frozenset(sign + goal if JUMPS.get(sign, ("", "-"))[1] == "" else sign for sign in bar.signs)

    def _count_passes(self) -> None:
        """Repeats that do not say how often they play do it for all of their endings, or as often as words tell."""
        times = 0
        for n, (bar, after) in enumerate(zip_longest(self.bars, self.bars[1:]), 1):
            times = self.times.get(n, 0 if bar.opens else times)
            if bar.plays > 1 and not bar.endings and n not in self.counted and times > 1:
                bar.plays = times
            times = 0 if bar.plays > 1 else times
            if bar.plays > 1 and bar.endings and n not in self.counted:
                follows = after is not None and max(after.endings, default=0) > max(bar.endings)
                bar.plays = max(max(bar.endings) + follows, 2)

    def _put_spans(self) -> None:
        """Marks the beats under each hairpin and each line of a technique."""
        begins = list(accumulate((bar.length for bar in self.bars), initial=Fraction(0)))
        bars = zip(begins, self.voices, strict=False)
        beats = [(begin + beat.at, beat) for begin, voices in bars for voice in voices for beat in voice]
        beats.sort(key=lambda row: row[0])
        for begin, end, kind in self.spans:
            for k in range(bisect_left(beats, begin, key=lambda row: row[0]), len(beats)):
                at, beat = beats[k]
                if at >= end and at > begin:
                    break
                if kind in HAIRPINS:
                    beat.hairpin = kind
                for note in beat.notes:
                    note.palm, note.let_ring = note.palm or kind == PALM, note.let_ring or kind == RING

    def _duration(self, element: Any) -> Fraction:
        found = exact(element.findtext("duration") or "0") / self.divisions
        if not 0 <= found <= model.LONGEST:
            raise model.UnreadableTab(f"is damaged: a note of {float(found):g} quarter notes")
        return found

    def _attributes(self, attributes: Any, bar: model.Bar) -> None:
        self.divisions = exact(attributes.findtext("divisions") or str(self.divisions))
        self.fifths = bar.fifths = int(attributes.findtext("key/fifths") or self.fifths)
        time = attributes.find("time")  # of the first staff; others have their own, usually the same
        beats, units = list[str](), list[Fraction]()
        if time is not None:
            self.is_free = time.find("senza-misura") is not None
            beats = [each.text or "" for each in time.iterfind("beats")]
            units = [Fraction(4, int(each.text)) for each in time.iterfind("beat-type")]
        if beats and units:
            self.beat = min(units)
            rows = zip(beats, units, strict=True)
            self.length = sum((sum(map(int, text.split("+"))) * unit for text, unit in rows), Fraction(0))
            if not 0 < self.length <= model.LONGEST or self.beat <= 0:
                raise model.UnreadableTab(f"is damaged: a bar of {float(self.length):g} quarter notes")
            bar.beat, bar.length = self.beat, self.length
        for each in attributes.iterfind("measure-style/measure-repeat"):
            self.simile = int(each.text or 1) if each.get("type") == "start" else 0
        if attributes.find("transpose") is not None:
            self.transpose = _transposition(attributes.find("transpose"))

    def _direction(self, direction: Any, at: Fraction, bar: model.Bar, signs: list[str]) -> None:
        at = max(at + exact(direction.findtext("offset") or "0") / self.divisions, Fraction(0))
        words = _words(direction)
        goal = " al fine" if "fine" in words else " al coda" if "coda" in words else ""
        for sound in direction.iter("sound"):
            if sound.get("tempo"):
                self.bpm = number(sound.get("tempo"))
                bar.tempos.append(model.Tempo(at, self.bpm))
            self.velocity = _force(sound) or self.velocity
            swing = sound.find("swing")
            if swing is not None:
                self.swing = bar.swing = _swing(swing)
            jumps = {"dacapo": f"da capo{goal}", "dalsegno": f"da segno{goal}", "tocoda": "da coda"}
            signs += [jumps.get(name, name) for name in sound.keys()]  # noqa: SIM118
        signs.append(words)
        if times := TIMES.fullmatch(words.strip()):
            self.times[len(self.bars)] = min(int(times[1] or times[2]), MAX_PLAYS)
        technique = next((kind for kind, text in TECHNIQUES.items() if text.fullmatch(words.strip())), "")
        stated = direction.find("sound[@tempo]") is not None
        by_words = TEMPO.search(words)
        if by_words and not stated and direction.find("direction-type/metronome") is None:
            self.bpm = number(by_words[1] or by_words[2])
            bar.tempos.append(model.Tempo(at, self.bpm))
        for each in direction.iterfind("direction-type/*"):
            if each.tag in ("segno", "coda"):
                signs.append(each.tag)
            elif each.tag == "rehearsal":
                bar.name = (each.text or "").strip()
            elif each.tag == "dynamics" and len(each):
                self.velocity = model.velocity_of(each[0].tag)
            elif each.tag == "metronome" and not stated:
                self.bpm = _tempo(each, self.bpm)
                bar.tempos.append(model.Tempo(at, self.bpm))
            elif each.tag == "wedge":
                self._wedge(each, self.begin + at)
            elif each.tag in ("dashes", "bracket"):
                self._line(each, self.begin + at, technique)
                technique = ""
        if technique:  # without a line: for this beat
            self.spans.append((self.begin + at, self.begin + at, technique))

    def _wedge(self, wedge: Any, at: Fraction) -> None:
        number, kind = wedge.get("number") or "1", wedge.get("type")
        if kind in HAIRPINS:
            self.wedges[number] = at, kind
        elif kind == "stop" and number in self.wedges:
            begin, kind = self.wedges.pop(number)
            self.spans.append((begin, at, kind))

    def _line(self, line: Any, at: Fraction, technique: str) -> None:
        """Begins a line of a `technique`, if the words before it name one, or ends one."""
        name = line.tag, line.get("number") or "1"
        if line.get("type") == "start" and technique:
            self.lines[name] = at, technique
        elif line.get("type") == "stop" and name in self.lines:
            begin, kind = self.lines.pop(name)
            self.spans.append((begin, at, kind))

    def _barline(self, barline: Any, bar: model.Bar) -> None:
        repeat, ending = barline.find("repeat"), barline.find("ending")
        if repeat is not None and repeat.get("direction") == "forward":
            bar.opens = True
        elif repeat is not None:
            bar.plays = max(int(repeat.get("times") or 0), 2)
            self.counted |= {len(self.bars)} if repeat.get("times") else set()
        if ending is not None:
            bar.endings = self.endings = _endings(ending.get("number") or ending.text or "") or self.endings
            if ending.get("type") != "start":
                self.endings = frozenset()

    def _note(self, element: Any, at: Fraction, voices: dict[str, _Voice]) -> Fraction:
        """Reads a note at `at`; returns where the next one begins."""
        voice = voices.setdefault(element.findtext("voice") or "1", _Voice())
        grace, chord = element.find("grace"), element.find("chord") is not None and self.latest is not None
        length = (
            self._duration(element)
            if grace is not None or element.find("duration") is not None
            else _written_length(element)
        )
        note = self._read(element, self.latest.notes if chord and self.latest else [])
        if grace is not None:
            if chord and voice.graces and note is not None:
                voice.graces[-1][0].notes.append(note)
            elif note is not None:
                kind = TYPES.get(element.findtext("type") or "")
                own = model.Beat(at, Fraction(2, kind) if kind else GRACE, [note])
                voice.graces.append((own, grace.get("steal-time-following") is not None))
            return at
        if not chord or self.latest is None:
            voice.put_graces()
            self.latest = model.Beat(at, length, [])
            voice.beats.append(self.latest)
            if note is not None:
                voice.own, voice.graces = voice.graces, []
        if note is not None:
            if len(self.latest.notes) == MAX_IN_CHORD:
                raise model.UnreadableTab(f"is damaged: a chord of more than {MAX_IN_CHORD} notes")
            self.latest.notes.append(note)
            _mark_beat(element, self.latest)
            self._slur(element, note, voice)
            shape = next((each.text or "" for each in element.iterfind("notations/fermata")), None)
            if shape is not None:
                self.bars[-1].holds.append(
                    model.Hold(self.latest.at, self.latest.length, HOLDS.get(shape.strip(), HOLD))
                )
        return at if chord else at + length

    def _slur(self, element: Any, note: model.Note, voice: _Voice) -> None:
        """In tablature a slur from a note to the next one on its string is a hammer-on or a pull-off."""
        before = voice.beats[-2].notes if len(voice.beats) > 1 else []
        for other in before if voice.slurs and _staff(element) in self.staves else []:
            other.hammer |= other.string == note.string and other.fret != note.fret and not other.slides
        for slur in element.iterfind("notations/slur"):
            name = slur.get("number") or "1"
            voice.slurs = voice.slurs | {name} if slur.get("type") == "start" else voice.slurs - {name}

    def _place(self, element: Any, tied: bool, others: Sequence[model.Note]) -> tuple[int, int] | None:
        """The string and fret of a note beside `others`; None for a rest, or a note that the tablature shows, too."""
        technical = element.findall("notations/technical")
        string, fret = (
            next((t.findtext(name) for t in technical if t.findtext(name)), None) for name in ("string", "fret")
        )
        pitch, place = element.find("pitch"), None
        sounds = -1 if pitch is None else _pitch(pitch, "") + self.transpose - self.capo
        if string and fret:
            place = len(self.tuning) - int(string), int(fret)
        elif tied and sounds in self.sounding:
            place = self.sounding[sounds]
        elif sounds >= 0 and (not self.staves or _staff(element) in self.staves):
            lower = len(self.tuning) - int(string or 0)
            place = (lower, sounds - self.tuning[lower]) if string else self._by_pitch(sounds, others)
        if place is not None and sounds >= 0:
            self.sounding[sounds] = place
        return place

    def _by_pitch(self, sounds: int, others: Sequence[model.Note]) -> tuple[int, int]:
        """The highest free string that has a pitch; -1: none has it. A lower one of `others` makes room."""
        taken = {other.string: other for other in others}
        for string in range(len(self.tuning) - 1, -1, -1):
            fret = sounds - self.tuning[string]
            if fret < 0:
                continue
            if string not in taken:
                return string, fret
            other = taken[string]
            if other.fret < fret:
                rest = [each for each in others if each is not other]
                pitch = other.fret + self.tuning[string]
                other.string, other.fret = self._by_pitch(pitch, [*rest, model.Note(string, fret)])
                return string, fret
        return -1, 0

    def _read(self, element: Any, others: Sequence[model.Note]) -> model.Note | None:
        """The note, in a chord with `others`; None for what does not sound."""
        ties = (*element.iterfind("tie"), *element.iterfind("notations/tied"))
        tied = any(tie.get("type") == "stop" for tie in ties)
        place = self._place(element, tied, others) if element.find("cue") is None else None
        if place is None:
            return None
        dynamics = element.find("notations/dynamics")
        if dynamics is not None and len(dynamics):
            self.velocity = model.velocity_of(dynamics[0].tag)
        note = model.Note(*place, _force(element) or self.velocity, tie=tied)
        note.dead = (element.findtext("notehead") or "") == "x"
        note.ghost = element.find("notehead[@parentheses='yes']") is not None
        note.palm = element.findtext("play/mute") == "palm"
        note.bend = _curve(element.findall("notations/technical/bend"))
        for each in element.iterfind("notations/*"):
            _mark(note, each)
            for sign in each:
                _mark(note, sign)
        if note.ornament == "trill":
            note.vibrato = 0.0  # its wavy line is part of the trill
        if model.SHIFT in note.slides and element.find("notations/slur[@type='start']") is not None:
            note.slides = note.slides - {model.SHIFT} | {model.LEGATO}
        if note.tremolo:
            note.tremolo /= max(TYPES.get(element.findtext("type") or "", 0) // 4, 1)
        return note


def _written_length(note: Any) -> Fraction:
    """The length of a note without a duration, by its shape."""
    dots, change = len(note.findall("dot")), note.find("time-modification")
    length = Fraction(4, TYPES.get((note.findtext("type") or "").strip(), 4)) * (2 - Fraction(1, 2 ** min(dots, 8)))
    if change is None:
        return length
    actual, normal = (int(change.findtext(f"{name}-notes") or 1) for name in ("actual", "normal"))
    return length * normal / actual


def _pitch(element: Any, prefix: str) -> int:
    """The MIDI note of a pitch or, with the prefix "tuning-", of a string."""
    step, alter, octave = (element.findtext(f"{prefix}{name}") for name in ("step", "alter", "octave"))
    return STEPS[step.strip()] + int(number(alter or "0")) + 12 * (int(octave) + 1)


def _is_part(measure: Any) -> bool:
    """True for an upbeat, and for the rest of a bar that a repeat splits."""
    return measure is not None and (measure.get("implicit") == "yes" or measure.get("number") == "0")


def _staff(note: Any) -> str:
    return note.findtext("staff") or "1"


def _transposition(transpose: Any) -> int:
    """Semitones from the written to the sounding pitch."""
    if transpose is None:
        return 0
    return int(number(transpose.findtext("chromatic") or "0")) + 12 * int(transpose.findtext("octave-change") or 0)


def _force(element: Any) -> int:
    """The velocity of an element's dynamics, in percent of forte; 0: it has none."""
    percent = element.get("dynamics")
    return min(max(round(FULL / 100 * number(percent)), 1), 127) if percent else 0


def _endings(text: str) -> frozenset[int]:
    """The passes in a text such as "1, 2", "1.-3." or "1-3"."""
    found: set[int] = set()
    for first, last in re.findall(r"(\d+)\.?(?:\s*-\s*(\d+))?", text):
        found.update(range(int(first), min(int(last or first), MAX_ENDINGS) + 1))
    return frozenset(found)


def _words(direction: Any) -> str:
    return " ".join(each.text or "" for each in direction.iter("words")).lower()


def _swing(swing: Any) -> tuple[Fraction, Fraction] | None:
    first, second = (int(swing.findtext(name) or 0) for name in ("first", "second"))
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


def _mark_beat(element: Any, beat: model.Beat) -> None:
    """Adds a note's signs that are of the whole beat."""
    there = {each.tag: each for each in element.iterfind("notations/*")} | {
        each.tag: each for each in element.iterfind("notations/*/*")
    }
    beat.stroke = "down" if "down-bow" in there else "up" if "up-bow" in there else beat.stroke
    if "arpeggiate" in there:
        beat.brush = -BRUSH if there["arpeggiate"].get("direction") == "down" else BRUSH
    beat.signs += ("golpe",) * ("golpe" in there)
    if "tremolo" in there and there["tremolo"].get("type") == "start":
        beat.signs += ("two-note tremolo",)


def _mark(note: model.Note, sign: Any) -> None:
    """Adds a sign of its notations to a note."""
    begins = sign.get("type") == "start"
    text = (sign.text or "").strip().lower()
    if sign.tag in ("hammer-on", "pull-off"):
        note.hammer, note.hammered = note.hammer or begins, note.hammered or sign.get("type") == "stop"
    elif sign.tag in SLIDES and sign.get("type") != "stop":
        note.slides |= {SLIDES[sign.tag]}
    elif sign.tag == "tied" and sign.get("type") == "let-ring":
        note.let_ring = True
    elif sign.tag in ("staccato", "staccatissimo"):
        note.staccato = True
    elif sign.tag in ("accent", "strong-accent"):
        note.accent = 2 if sign.tag == "strong-accent" else 1
    elif sign.tag == "tap":
        note.technique = "tap"
    elif sign.tag == "other-technical" and text in ("slap", "pop", "tap"):
        note.technique = text
    elif sign.tag == "harmonic":
        note.harmonic = model.ARTIFICIAL if sign.find("artificial") is not None else model.NATURAL
        note.node = float(note.fret) if note.harmonic == model.NATURAL else 12.0
    elif sign.tag in ("wavy-line", "vibrato"):
        note.vibrato = 0.5
    elif sign.tag in ORNAMENTS:
        note.ornament = ORNAMENTS[sign.tag]
    elif sign.tag == "tremolo" and sign.get("type", "single") in ("single", "unmeasured") and text.isdecimal():
        note.tremolo = Fraction(1, 2 ** min(int(text) or UNMEASURED, 5))


def _curve(bends: Sequence[Any]) -> model.Curve:
    """The bends of a note, one after the other, each for an equal part of its length. Their heights add up."""
    points, height = list[tuple[float, float]](), 0.0
    for k, bend in enumerate(bends):
        by = number(bend.findtext("bend-alter") or "0")
        if bend.find("release") is not None:
            by = -abs(by)
            height = -by if k == 0 else height
        elif bend.find("pre-bend") is not None:
            height, by = height + abs(by) * (k == 0), 0.0
        goal = max(height + by, 0.0)
        points += [(k / len(bends), height), ((k + 1) / len(bends), goal)]
        height = goal
    return tuple(points)
