"""Reads the XML of Guitar Pro 6 to 8, GPIF: tables of bars, voices, beats, notes and rhythms that name each other."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping, Sequence
from copy import deepcopy
from dataclasses import replace
from fractions import Fraction
from typing import Any

from livebass.tab import model
from livebass.tab.fingering import place_by_pitch
from livebass.tab.model import (
    MAX_BARS,
    Bar,
    Beat,
    Curve,
    Hold,
    Note,
    Tab,
    Tempo,
    Track,
    UnreadableTab,
    put_graces,
    velocity_of,
)
from livebass.tab.needs import checked_reading, exact, number, parsed_xml, whole
from livebass.tab.order import sign_of

WORDS = {"Long": Fraction(16), "DoubleWhole": Fraction(8), "Whole": Fraction(4), "Half": Fraction(2),
         "Quarter": Fraction(1), "Eighth": Fraction(1, 2)}  # fmt: skip
VALUES = WORDS | {f"{n}{'nd' if n == 32 else 'th'}": Fraction(4, n) for n in (16, 32, 64, 128, 256)}
TEMPO_UNITS = {"1": 0.5, "2": 1.0, "3": 1.5, "4": 2.0, "5": 3.0}  # quarter notes
SLIDES = (
    model.SHIFT, model.LEGATO, model.OUT_DOWN, model.OUT_UP, model.IN_BELOW, model.IN_ABOVE, model.SCRAPE, model.SCRAPE
)  # fmt: skip  # by bit
SWINGS = {
    f"{kind}{name}": model.swing_of(share, note)
    for kind, share in (("Triplet", Fraction(2, 3)), ("Dotted", Fraction(3, 4)), ("Scottish", Fraction(1, 4)))
    for name, note in (("8th", Fraction(1, 2)), ("16th", Fraction(1, 4)))
}
STACCATO, HEAVY, ACCENT = 1, 4, 8  # bits of an accent
OCTAVE = "12"  # fret of an artificial harmonic's node beyond the stop
GRACE = Fraction(1, 4)  # at most, quarter notes
TRILL = Fraction(1, 4)  # each note
BRUSH = Fraction(1, 8)  # without a length of its own
TICKS = 480  # of brushes and trills, in a quarter note
FADES = {"FadeIn": "fade in", "FadeOut": "fade out", "VolumeSwell": "volume swell"}
BRUSH_TICKS, TRILL_TICKS = ("687935489", "687931393"), ("688062467",)  # extended properties
BEND = 50.0  # units of a whole tone are 100
VIBRATO = {"Slight": 0.5, "Wide": 1.0}
# What livebass does not play, by property or element of a beat or note
SIGNS = {"Wah": "wah", "Rasgueado": "rasgueado", "Golpe": "golpe"}
HAIRPINS = {"Crescendo": "crescendo", "Decrescendo": "diminuendo"}
ORNAMENTS = {"UpperMordent": "inverted mordent", "LowerMordent": "mordent", "Turn": "turn",
             "InvertedTurn": "inverted turn"}  # fmt: skip
NO_STRING = -1
MAX_AGAIN = 30_000  # beats and notes beyond those that a file has
SIMILES = {"Simple": 1, "FirstOfDouble": 2, "SecondOfDouble": 2}  # bars back to the one that sounds
# The numbers of a bend
POINTS = (
    "OriginOffset", "OriginValue", "MiddleOffset1", "MiddleOffset2", "MiddleValue", "DestinationOffset",
    "DestinationValue",
)  # fmt: skip


def read_gpif(data: bytes) -> Tab:
    """The piece in a score.gpif. Raises UnreadableTab, or LookupError without defusedxml."""
    root = parsed_xml(data)
    with checked_reading():
        return _Reader(root).tab()


class _Reader:
    def __init__(self, root: Any) -> None:
        self.root = root
        tables = ("Bars", "Voices", "Beats", "Notes", "Rhythms")
        self.bars, self.voices, self.beats, self.notes, self.rhythms = (
            {each.get("id"): each for each in root.iterfind(f"{table}/*")} for table in tables
        )
        for note in root.iterfind("Notes/*"):  # some files have two notes of one number: one has string and fret
            if _is_placed(_properties(note)):
                self.notes[note.get("id")] = note
        self.left = len(self.beats) + len(self.notes) + MAX_AGAIN  # beats and notes that may still be made
        self.masters = root.findall("MasterBars/MasterBar")
        if len(self.masters) > MAX_BARS:
            raise UnreadableTab(f"has {len(self.masters)} bars, more than {MAX_BARS}")
        self.lengths: dict[str, Fraction] = {}

    def tab(self) -> Tab:
        bars = [_bar(master) for master in self.masters]
        tracks, staff = [], 0  # staves of all tracks count through
        for track in self.root.iterfind("Tracks/Track"):
            tracks.append(self._track(track, staff, bars))
            staff += max(len(track.findall("Staves/Staff")), 1)
        if bars and self.root.find("MasterTrack/Anacrusis") is not None:
            whole = [beats[-1].at + beats[-1].length for track in tracks for beats in track.bars[0] if beats]
            bars[0].length = max(whole, default=bars[0].length)
        _put_tempos(bars, self.root.iterfind("MasterTrack/Automations/Automation"))
        for k, (bar, master) in enumerate(zip(bars, self.masters, strict=True)):
            if fermatas := master.findall("Fermatas/Fermata"):
                lengths: dict[Fraction, Fraction] = {}  # of the shortest note, by its place
                for beat in (beat for track in tracks for beats in track.bars[k] for beat in beats if beat.notes):
                    lengths[beat.at] = min(beat.length, lengths.get(beat.at, beat.length))
                bar.holds = [_hold(fermata, lengths, bar) for fermata in fermatas]
        return Tab(bars, tracks)

    def _track(self, track: Any, staff: int, lengths: Sequence[Bar]) -> Track:
        own = track.find("Staves/Staff")
        properties = _properties(track if own is None else own)
        tuning = tuple(whole(word) for word in _text(properties, "Tuning", ".//Pitches").split())
        capo = whole(_text(properties, "CapoFret", "Fret") or 0)
        places = ("GeneralMidi/Program", "Sounds/Sound/MIDI/Program", "MidiConnection/Program")
        program = next((whole(text) for text in map(track.findtext, places) if text), None)
        midi = track.find("GeneralMidi")
        kind = track.findtext("InstrumentSet/Type") or ("" if midi is None else midi.get("table") or "")
        drums = any(word in kind.lower() for word in ("drum", "perc"))
        bars: list[list[list[Beat]]] = []
        opens = None if not tuning and not drums else [note + capo for note in tuning]
        for master in self.masters:
            bar = self.bars[(master.findtext("Bars") or "").split()[staff]]
            back = SIMILES.get(bar.findtext("SimileMark") or "", len(bars) + 1)
            if back <= len(bars):
                self._count(sum(1 + len(beat.notes) for beats in bars[-back] for beat in beats))
                bars.append(deepcopy(bars[-back]))
                continue
            voices = [self._voice(word, opens) for word in (bar.findtext("Voices") or "").split() if word != "-1"]
            bars.append([beats for beats in voices if any(beat.notes for beat in beats)])
        partial = whole(_text(properties, "PartialCapoFret", "Fret") or 0) > 0
        name, signs = (track.findtext("Name") or "").strip(), ("partial capo",) * partial
        if opens is None:  # a keyboard's
            tuning = place_by_pitch(lengths, bars)
        return Track(name, tuning, capo, program, drums, bars, opens is not None, signs=signs)

    def _count(self, made: int) -> None:
        """Counts what is made: a small file can name the same beats again and again."""
        self.left -= made
        if self.left < 0:
            raise UnreadableTab(f"repeats more than {MAX_AGAIN} beats and notes")

    def _voice(self, word: str, opens: list[int] | None) -> list[Beat]:
        at, beats = Fraction(0), list[Beat]()
        waiting: list[tuple[Beat, bool]] = []  # grace notes before the next beat, and whether they begin on it
        for each in (self.voices[word].findtext("Beats") or "").split():
            beat = self.beats[each]
            made = self._beat(beat, at, opens)
            if beat.findtext("GraceNotes"):
                made.length = min(made.length, GRACE)
                waiting.append((made, beat.findtext("GraceNotes") == "OnBeat"))
                continue
            beats += [*put_graces(waiting, made), made]
            waiting = []
            at += made.length
        return beats

    def _beat(self, beat: Any, at: Fraction, opens: list[int] | None) -> Beat:
        properties, dynamic = _properties(beat), beat.findtext("Dynamic") or ""
        notes = [self.notes[word] for word in (beat.findtext("Notes") or "").split()]
        made = Beat(at, self._length(beat.find("Rhythm").get("ref")), [])
        self._count(1 + len(notes))
        for note in notes:
            own = _properties(note)
            if opens is None and (pitch := _pitch(own)) is not None:
                made.notes.append(_note(note, own, velocity_of(dynamic), (0, pitch), ()))
            elif opens and _is_placed(own):
                made.notes.append(_note(note, own, velocity_of(dynamic), _place(own), opens))
        if beat.find("DeadSlapped") is not None and opens:
            made.notes = [Note(k, 0, velocity_of(dynamic), technique="left slap") for k in range(len(opens))]
        technique = "slap" if "Slapped" in properties else "pop" if "Popped" in properties else ""
        tremolo = exact(beat.findtext("Tremolo") or "0")
        vibrato = VIBRATO.get(_text(properties, "VibratoWTremBar", "Strength"), 0.0)
        whammy = _whammy(beat, properties)
        for note in made.notes:
            note.technique = note.technique or technique
            note.tremolo = tremolo if 0 < tremolo <= 1 else None
            note.vibrato = max(note.vibrato, vibrato)
            note.bend = note.bend or whammy
        made.hairpin = HAIRPINS.get(beat.findtext("Hairpin") or "", "")
        made.stroke = _text(properties, "PickStroke", "Direction").lower()
        if brush := _text(properties, "Brush", "Direction") or beat.findtext("Arpeggio"):
            length = _ticks(beat, BRUSH_TICKS) or BRUSH
            made.brush = -length if brush == "Up" else length
        there = {*properties, *(child.tag for each in (beat, *notes) for child in each)}
        made.signs = tuple(sign for name, sign in SIGNS.items() if name in there)
        made.signs += tuple(filter(None, [FADES.get(beat.findtext("Fadding") or "")]))
        return made

    def _length(self, word: str) -> Fraction:
        """The length of a rhythm, in quarter notes."""
        if word not in self.lengths:
            rhythm = self.rhythms[word]
            dot = rhythm.find("AugmentationDot")
            length = VALUES[rhythm.findtext("NoteValue")] * (2 - Fraction(1, 2 ** min(_count(dot), 8)))
            for name in ("PrimaryTuplet", "SecondaryTuplet"):
                tuplet = rhythm.find(name)
                if tuplet is not None:
                    num, den = (whole(tuplet.get(key) or tuplet.findtext(key.title())) for key in ("num", "den"))
                    length *= Fraction(den, num)
            self.lengths[word] = length
        return self.lengths[word]


def _count(dot: Any) -> int:
    return 0 if dot is None else max(whole(dot.get("count") or 1), 0)


def _properties(element: Any) -> dict[str, Any]:
    return {each.get("name"): each for each in element.iterfind("Properties/Property")}


def _text(properties: dict[str, Any], name: str, path: str) -> str:
    """The text at `path` in a property; "" if there is none."""
    return (properties[name].findtext(path) or "") if name in properties else ""


def _number(properties: dict[str, Any], name: str) -> float | None:
    text = _text(properties, name, "Float")
    return number(text) if text else None


def _is_on(properties: dict[str, Any], name: str) -> bool:
    return name in properties and properties[name].find("Enable") is not None


def _bar(master: Any) -> Bar:
    numerator, denominator = map(whole, master.findtext("Time").split("/"))
    length = Fraction(4 * numerator, denominator)
    repeat = master.find("Repeat")
    signs = [each.text or "" for each in master.iterfind("Directions/*")]
    bar = Bar(length, Fraction(4, denominator), signs=frozenset(filter(None, map(sign_of, signs))))
    if repeat is not None:
        bar.opens = repeat.get("start") == "true"
        bar.plays = max(whole(repeat.get("count") or 2), 1) if repeat.get("end") == "true" else 1
    bar.endings = frozenset(map(whole, (master.findtext("AlternateEndings") or "").split()))
    bar.swing = SWINGS.get(master.findtext("TripletFeel") or "")
    bar.fifths = whole(master.findtext("Key/AccidentalCount") or 0)
    bar.name = (master.findtext("Section/Text") or master.findtext("Section/Letter") or "").strip()
    return bar


def _put_tempos(bars: list[Bar], automations: Iterable[Any]) -> None:
    """Puts the tempos into their bars. A linear one changes until the next."""
    found: list[tuple[Fraction, Bar, Tempo, bool]] = []
    begins = [Fraction(0)]
    for each in bars:
        begins.append(begins[-1] + each.length)
    for each in automations:
        bar = whole(each.findtext("Bar") or 0)
        if each.findtext("Type") == "Tempo" and 0 <= bar < len(bars):
            value, unit = (each.findtext("Value") or "").split()
            at = exact(each.findtext("Position") or "0").limit_denominator(1000) * bars[bar].length
            tempo = Tempo(at, number(value) * TEMPO_UNITS.get(unit, 1.0))
            found.append((begins[bar] + at, bars[bar], tempo, each.findtext("Linear") == "true"))
    found.sort(key=lambda row: row[0])
    for k, (begin, own, tempo, linear) in enumerate(found):
        own.tempos.append(tempo)
        if linear and k + 1 < len(found):
            end, _, after, _ = found[k + 1]
            own.tempos.append(replace(after, at=tempo.at, over=end - begin))


def _hold(fermata: Any, lengths: Mapping[Fraction, Fraction], bar: Bar) -> Hold:
    """A fermata: the shortest note that begins there is held, 1.5 to 4 times as long, by its length from 0 to 1."""
    at, length = exact(fermata.findtext("Offset") or "0"), number(fermata.findtext("Length") or "0.5")
    return Hold(at, lengths.get(at, bar.beat), 1.5 - length / 2 + 3 * length**2)


def _is_placed(properties: dict[str, Any]) -> bool:
    """True if a note has a string and a fret."""
    return "String" in properties and "Fret" in properties


def _place(properties: dict[str, Any]) -> tuple[int, int]:
    """The string and the fret of a note. Some programs draw notes of drums between strings: on NO_STRING."""
    string = number(_text(properties, "String", "String"))
    return int(string) if string.is_integer() else NO_STRING, whole(_text(properties, "Fret", "Fret"))


def _pitch(properties: dict[str, Any]) -> int | None:
    """The MIDI note of a note without a string, as Guitar Pro 7 or Guitar Pro 6 says it; None: it has none."""
    if "Midi" in properties:
        return whole(_text(properties, "Midi", "Number"))
    if "Tone" in properties and "Octave" in properties:
        return 12 * whole(_text(properties, "Octave", "Number")) + whole(_text(properties, "Tone", "Step"))
    return None


def _note(note: Any, properties: dict[str, Any], velocity: int, place: tuple[int, int], opens: Sequence[int]) -> Note:
    """A note on the string and fret `place`, on open strings with these MIDI notes."""
    string, _ = place
    made = Note(*place, velocity)
    tie, accent = note.find("Tie"), whole(note.findtext("Accent") or 0)
    made.tie = tie is not None and tie.get("destination") == "true"
    made.dead, made.palm = _is_on(properties, "Muted"), _is_on(properties, "PalmMuted")
    made.hammer, made.hammered = _is_on(properties, "HopoOrigin"), _is_on(properties, "HopoDestination")
    made.technique = "tap" if _is_on(properties, "Tapped") or _is_on(properties, "LeftHandTapped") else ""
    made.ghost, made.let_ring = note.find("AntiAccent") is not None, note.find("LetRing") is not None
    made.staccato, made.accent = bool(accent & STACCATO), 2 if accent & HEAVY else int(bool(accent & ACCENT))
    made.vibrato = VIBRATO.get(note.findtext("Vibrato") or "", 0.0)
    made.ornament = ORNAMENTS.get(note.findtext("Ornament") or "", "")
    slides = whole(_text(properties, "Slide", "Flags") or 0)
    made.slides = frozenset(slide for bit, slide in enumerate(SLIDES) if slides >> bit & 1)
    harmonic = _text(properties, "HarmonicType", "HType")
    if harmonic not in ("", "NoHarmonic"):
        made.harmonic = {"Tap": "tapped"}.get(harmonic, harmonic.lower())
        made.node = number(_text(properties, "HarmonicFret", "HFret") or OCTAVE)
    if _is_on(properties, "Bended"):
        made.bend = _curve([_number(properties, f"Bend{name}") for name in POINTS])
    trill = note.findtext("Trill")
    if trill and 0 <= string < len(opens):
        made.trill = whole(trill) - opens[string], _ticks(note, TRILL_TICKS) or TRILL
    return made


def _curve(points: list[float | None]) -> Curve:
    """A bend by the numbers of POINTS, in percent of the length and of a whole tone."""
    begin, first, *middles, middle, end, last = points
    curve = [(begin or 0.0, first), *((at, middle) for at in middles if at is not None)]
    return tuple((at / 100, (value or 0.0) / BEND) for at, value in [*curve, (100.0 if end is None else end, last)])


def _whammy(beat: Any, properties: dict[str, Any]) -> Curve:
    """The bend of a tremolo bar; empty without one."""
    if "WhammyBar" in properties:  # in .gpx
        return _curve([_number(properties, f"WhammyBar{name}") for name in POINTS])
    found = beat.find("Whammy")
    names = [name[0].lower() + name[1:] for name in POINTS]
    return () if found is None else _curve([number(found.get(name)) if found.get(name) else None for name in names])


def _ticks(element: Any, names: Collection[str]) -> Fraction:
    """The length, in quarter notes, in the first of these extended properties; 0: there is none."""
    own = element.iterfind("XProperties/XProperty")
    return next(
        (Fraction(whole(each.findtext("Int") or 0), TICKS) for each in own if each.get("id") in names), Fraction(0)
    )
