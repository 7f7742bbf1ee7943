"""Reads MusicXML, score-partwise: strings and frets where the file gives them, else the lowest fret for each pitch."""

from __future__ import annotations

from dataclasses import dataclass, field
from fractions import Fraction
from typing import Any

from livebass.tab import model
from livebass.tab.model import MOST_BARS, Bar, Beat, Curve, Grace, Note, Tab, Tempo, Track, UnreadableTab, velocity_of
from livebass.tab.needs import parsed_xml
from livebass.tab.order import sign_of

STEPS = {"C": 0, "D": 2, "E": 4, "F": 5, "G": 7, "A": 9, "B": 11}
TYPES = {"whole": 1, "half": 2, "quarter": 4, "eighth": 8, "16th": 16, "32nd": 32, "64th": 64}
USUAL = (28, 33, 38, 43)  # strings of a bass, for a part without strings of its own
FIFTH_STRING = 23
MOST_STRINGS = 12
PERCUSSION = "10"  # channel
GRACE = Fraction(1, 8)  # quarter notes
TRILL, TRILL_FRETS = Fraction(1, 4), 2
BRUSH = Fraction(1, 8)
LONGEST = 1024  # quarter notes in a bar
# Signs of a note, by the elements of its notations
SLIDES = {"slide": model.SHIFT, "glissando": model.SHIFT, "scoop": model.IN_BELOW, "plop": model.IN_ABOVE,
          "falloff": model.OUT_DOWN, "doit": model.OUT_UP}  # fmt: skip
ORNAMENTS = ("mordent", "inverted-mordent", "turn", "inverted-turn")
UNPLAYED = {**dict.fromkeys(ORNAMENTS, "ornament"), "golpe": "golpe", "fermata": "fermata"}


def read_musicxml(data: bytes) -> Tab:
    """The piece in a MusicXML file. Raises UnreadableTab, or LookupError without defusedxml."""
    root = parsed_xml(data)
    if root.tag != "score-partwise":
        raise UnreadableTab("is MusicXML by time; livebass reads score-partwise, which other programs write")
    try:
        names = {part.get("id"): part for part in root.iterfind("part-list/score-part")}
        parts = [_Part(part, names.get(part.get("id"))) for part in root.iterfind("part")]
        return Tab(parts[0].bars if parts else [], [part.track() for part in parts])
    except (AttributeError, IndexError, KeyError, TypeError, ValueError, ZeroDivisionError) as error:
        if isinstance(error, UnreadableTab):
            raise
        raise UnreadableTab(f"is damaged: a part of its score is missing or has a wrong value ({error})") from None


@dataclass
class _Voice:
    beats: list[Beat] = field(default_factory=list)
    graces: list[tuple[int, Grace]] = field(default_factory=list)  # (string, note), before the next beat


class _Part:
    """A part, read bar by bar."""

    def __init__(self, part: Any, description: Any) -> None:
        self.description = description
        self.bars: list[Bar] = []
        self.voices: list[list[list[Beat]]] = []
        self.divisions, self.transpose, self.capo, self.velocity = 1, 0, 0, model.FORTE
        self.beat, self.length = Fraction(1), Fraction(4)
        self.strings: dict[int, int] = {}  # MIDI notes by number of string, 1 the highest
        self.endings: frozenset[int] = frozenset()
        self.tabbed = part.find(".//technical/fret") is not None
        for note in part.iterfind(".//note"):  # the strings, before the first note needs them
            self._see_string(note)
        measures = part.findall("measure")
        if len(measures) > MOST_BARS:
            raise UnreadableTab(f"has {len(measures)} bars, more than {MOST_BARS}")
        details = part.findall(".//staff-details")
        for each in details:
            self._details(each)
        self.tuning = self._tuning()
        for measure in measures:
            self._measure(measure)

    def track(self) -> Track:
        description = self.description
        if description is None:
            return Track("", self.tuning, self.capo, None, False, self.voices)
        program, channel = (description.findtext(f"midi-instrument/midi-{name}") for name in ("program", "channel"))
        number = int(program) - 1 if program else None
        name = (description.findtext("part-name") or "").strip()
        return Track(name, self.tuning, self.capo, number, channel == PERCUSSION, self.voices)

    def _see_string(self, note: Any) -> None:
        """Learns the open note of a string from the pitch of its first note."""
        string, fret, pitch = (
            note.findtext(".//technical/string"),
            note.findtext(".//technical/fret"),
            note.find("pitch"),
        )
        if string and fret and pitch is not None:
            self.strings.setdefault(int(string), _pitch(pitch, "") - int(fret))

    def _details(self, details: Any) -> None:
        lines = int(details.findtext("staff-lines") or 0)
        self.capo = int(details.findtext("capo") or self.capo)
        for tuning in details.iterfind("staff-tuning"):
            self.strings[1 + lines - int(tuning.get("line"))] = _pitch(tuning, "tuning-")

    def _tuning(self) -> tuple[int, ...]:
        """The notes of the open strings, lowest first; strings that the file does not name are those of a bass."""
        count = max(self.strings, default=len(USUAL))
        if count > MOST_STRINGS:
            raise UnreadableTab(f"is damaged: {count} strings")
        usual = dict(enumerate([*reversed(USUAL), FIFTH_STRING], 1))
        found = {number: self.strings.get(number, usual.get(number)) for number in range(1, count + 1)}
        if None in found.values():
            raise UnreadableTab(f"has {count} strings, but not the tuning of each")
        return tuple(found[number] or 0 for number in range(count, 0, -1))

    def _measure(self, measure: Any) -> None:
        at = Fraction(0)
        end = at
        bar = Bar(self.length, self.beat, endings=self.endings)
        voices: dict[str, _Voice] = {}
        self.bars.append(bar)
        signs: list[str] = []
        for each in measure:
            if each.tag == "attributes":
                self._attributes(each, bar)
            elif each.tag == "note":
                at = self._note(each, at, voices)
            elif each.tag in ("backup", "forward"):
                at += self._duration(each) * (1 if each.tag == "forward" else -1)
            elif each.tag in ("direction", "sound"):
                self._direction(each, at, bar, signs)
            elif each.tag == "barline":
                self._barline(each, bar)
            end = max(end, at)
        if measure.get("implicit") == "yes" and 0 < end < bar.length:  # an upbeat, or the rest of a split bar
            bar.length = end
        bar.signs = frozenset(filter(None, map(sign_of, signs)))
        self.voices.append([voice.beats for voice in voices.values()])

    def _duration(self, element: Any) -> Fraction:
        found = Fraction(element.findtext("duration") or 0) / self.divisions
        if not 0 <= found <= LONGEST:
            raise UnreadableTab(f"is damaged: a note of {float(found):g} quarter notes")
        return found

    def _attributes(self, attributes: Any, bar: Bar) -> None:
        self.divisions = int(attributes.findtext("divisions") or self.divisions)
        numerator, denominator = attributes.findtext("time/beats"), attributes.findtext("time/beat-type")
        if numerator and denominator:
            beats = sum(map(int, numerator.split("+")))
            self.beat = Fraction(4, int(denominator))
            self.length = beats * self.beat
            if not 0 < self.length <= LONGEST:
                raise UnreadableTab(f"is damaged: a bar of {numerator}/{denominator}")
            bar.beat, bar.length = self.beat, self.length
        transpose = attributes.find("transpose")
        if transpose is not None:
            octaves = int(transpose.findtext("octave-change") or 0)
            self.transpose = int(transpose.findtext("chromatic") or 0) + 12 * octaves

    def _direction(self, direction: Any, at: Fraction, bar: Bar, signs: list[str]) -> None:
        for sound in direction.iter("sound"):
            if sound.get("tempo"):
                bar.tempos.append(Tempo(at, float(sound.get("tempo"))))
            if sound.get("dynamics"):  # in percent of forte, which is 90
                self.velocity = min(max(round(0.9 * float(sound.get("dynamics"))), 1), 127)
            goal = " al fine" if "fine" in _words(direction) else " al coda" if "coda" in _words(direction) else ""
            jumps = {"dacapo": f"da capo{goal}", "dalsegno": f"da segno{goal}", "tocoda": "da coda"}
            signs += [jumps.get(name, name) for name in sound.keys()]  # noqa: SIM118
        for each in direction.iterfind("direction-type/*"):
            if each.tag in ("segno", "coda"):
                signs.append(each.tag)
            elif each.tag == "rehearsal":
                bar.name = (each.text or "").strip()
            elif each.tag == "dynamics" and len(each):
                self.velocity = velocity_of(each[0].tag)

    def _barline(self, barline: Any, bar: Bar) -> None:
        repeat, ending = barline.find("repeat"), barline.find("ending")
        if repeat is not None and repeat.get("direction") == "forward":
            bar.opens = True
        elif repeat is not None:
            bar.plays = max(int(repeat.get("times") or 2), 1)
        if ending is not None:
            numbers = (ending.get("number") or "").replace(",", " ").split()
            bar.endings = self.endings = frozenset(int(number) for number in numbers if number.isdecimal())
            if ending.get("type") != "start":
                self.endings = frozenset()

    def _note(self, element: Any, at: Fraction, voices: dict[str, _Voice]) -> Fraction:
        """Reads a note at `at`; returns where the next one begins."""
        voice = voices.setdefault(element.findtext("voice") or "1", _Voice())
        chord, length = element.find("chord") is not None, self._duration(element)
        note = self._read(element)
        if element.find("grace") is not None:
            if note is not None:
                voice.graces.append((note.string, self._grace(element, note)))
            return at
        if chord and voice.beats:
            beat = voice.beats[-1]
            at -= length
        else:
            beat = Beat(at, length, [])
            voice.beats.append(beat)
        if note is not None:
            note.graces = [grace for string, grace in voice.graces if string == note.string]
            beat.notes.append(note)
            _mark_beat(element, beat)
        if not chord:
            voice.graces = [] if note is not None else voice.graces
        return at + length

    def _grace(self, element: Any, note: Note) -> Grace:
        joined = "hammer" if note.hammer else "slide" if note.slides else ""
        number = TYPES.get(element.findtext("type") or "")
        on_beat = element.find("grace").get("steal-time-following") is not None
        return Grace(note.fret, Fraction(4, number) / 2 if number else GRACE, note.dead, joined, on_beat)

    def _read(self, element: Any) -> Note | None:
        """The note; None for a rest, or a note that has no string in a part with strings."""
        technical = element.findall("notations/technical")
        string, fret = (
            next((t.findtext(name) for t in technical if t.findtext(name)), None) for name in ("string", "fret")
        )
        if string and fret:
            note = Note(len(self.tuning) - int(string), int(fret), self.velocity)
        elif self.tabbed or element.find("pitch") is None:
            return None
        else:
            sounds = _pitch(element.find("pitch"), "") + self.transpose - self.capo
            having = [k for k, opened in enumerate(self.tuning) if opened <= sounds]
            note = Note(having[-1], sounds - self.tuning[having[-1]], self.velocity) if having else Note(-1, 0)
        note.tie = any(tie.get("type") == "stop" for tie in element.iterfind("tie"))
        note.dead = (element.findtext("notehead") or "") == "x"
        note.ghost = element.find("notehead[@parentheses='yes']") is not None
        note.palm = element.findtext("play/mute") == "palm"
        for each in element.iterfind("notations/*"):
            _mark(note, each)
            for sign in each:
                _mark(note, sign)
        return note


def _pitch(element: Any, prefix: str) -> int:
    """The MIDI note of a pitch or, with the prefix "tuning-", of a string."""
    step, alter, octave = (element.findtext(f"{prefix}{name}") for name in ("step", "alter", "octave"))
    return STEPS[step.strip()] + int(float(alter or 0)) + 12 * (int(octave) + 1)


def _words(direction: Any) -> str:
    return " ".join(each.text or "" for each in direction.iter("words")).lower()


def _mark_beat(element: Any, beat: Beat) -> None:
    """Adds a note's signs that are of the whole beat."""
    there = {each.tag: each for each in element.iterfind("notations/*")} | {
        each.tag: each for each in element.iterfind("notations/*/*")
    }
    beat.stroke = "down" if "down-bow" in there else "up" if "up-bow" in there else beat.stroke
    if "arpeggiate" in there:
        beat.brush = -BRUSH if there["arpeggiate"].get("direction") == "down" else BRUSH
    beat.signs += tuple(sign for tag, sign in UNPLAYED.items() if tag in there)


def _mark(note: Note, sign: Any) -> None:
    """Adds a sign of its notations to a note."""
    begins = sign.get("type") == "start"
    text = (sign.text or "").strip().lower()
    if sign.tag in ("hammer-on", "pull-off"):
        note.hammer, note.hammered = note.hammer or begins, note.hammered or sign.get("type") == "stop"
    elif sign.tag in SLIDES and sign.get("type") != "stop":
        note.slides |= {SLIDES[sign.tag]}
    elif sign.tag == "slur" and begins and model.SHIFT in note.slides:
        note.slides = note.slides - {model.SHIFT} | {model.LEGATO}
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
    elif sign.tag == "bend":
        note.bend = _bent(note.bend, sign)
    elif sign.tag in ("wavy-line", "vibrato"):
        note.vibrato = 0.5
    elif sign.tag == "trill-mark":
        note.trill = note.fret + TRILL_FRETS, TRILL
    elif sign.tag == "tremolo" and sign.get("type", "single") == "single" and text.isdecimal():
        note.tremolo = Fraction(1, 2 ** min(int(text), 5))


def _bent(curve: Curve, bend: Any) -> Curve:
    """A bend after what `curve` has: half of the note's length for each, and the height stays."""
    height = float(bend.findtext("bend-alter") or 0)
    if bend.find("pre-bend") is not None:
        return ((0.0, height),)
    last = curve[-1][1] if curve else 0.0
    goal = 0.0 if bend.find("release") is not None else height
    scaled = tuple((x / 2, y) for x, y in curve) or ((0.0, 0.0),)
    return (*scaled, (0.5 if curve else 0.0, last), (1.0, goal))
