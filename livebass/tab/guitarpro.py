"""Reads Guitar Pro 3 to 5 files by PyGuitarPro. It counts strings from the highest, and bends in quarter tones."""

from __future__ import annotations

import io
import re
from fractions import Fraction
from typing import Any

from livebass.tab import model
from livebass.tab.model import Bar, Beat, Curve, Grace, Note, Tab, Tempo, Track, UnreadableTab
from livebass.tab.needs import checked_reading, require
from livebass.tab.order import sign_of

TECHNIQUES = {"tapping": "tap", "slapping": "slap", "popping": "pop"}
SLIDES = {
    "shiftSlideTo": model.SHIFT, "legatoSlideTo": model.LEGATO, "outDownwards": model.OUT_DOWN,
    "outUpwards": model.OUT_UP, "intoFromBelow": model.IN_BELOW, "intoFromAbove": model.IN_ABOVE,
}  # fmt: skip
HARMONICS = {1: model.NATURAL, 2: model.ARTIFICIAL, 3: "tapped", 4: "pinch", 5: "semi"}
GRACES = ("", "slide", "bend", "hammer")  # how they are joined to their notes, by number
OCTAVE = 12.0  # fret of a harmonic's node beyond the stop ...
NODES = {19: 7.0, 24: 5.0, 28: 4.0, 31: 3.2}  # ... unless it sounds so many semitones higher
AT_FIVE, AT_SEVEN = 24, 19  # PyGuitarPro confuses these two in Guitar Pro 4 files
QUARTER_TONE = 0.5  # semitones
BRUSH = Fraction(1, 8)  # quarter notes, without a length of its own
PLACE = re.compile(r"reading (.+?), got ")  # in an error of PyGuitarPro
SWINGS = {
    "eighth": model.swing_of(Fraction(2, 3), Fraction(1, 2)),
    "sixteenth": model.swing_of(Fraction(2, 3), Fraction(1, 4)),
}


def read_guitarpro(data: bytes) -> Tab:
    """The piece in a .gp3, .gp4 or .gp5 file. Raises UnreadableTab, or LookupError without PyGuitarPro."""
    guitarpro = require("guitarpro")
    try:
        song = guitarpro.parse(io.BytesIO(data))
    except Exception as error:  # of any kind: it reads damaged lengths and numbers as they are
        place = PLACE.match(str(error))
        raise UnreadableTab(f"is damaged in {place[1] if place else 'its head'}") from None
    with checked_reading():
        return _tab(song)


def _tab(song: Any) -> Tab:
    bars = [_bar(header) for header in song.measureHeaders]
    if bars:
        bars[0].tempos.append(Tempo(Fraction(0), float(song.tempo)))
    tempos = [dict.fromkeys(bar.tempos) for bar in bars]
    for track in song.tracks:  # tempos stand in any track
        for known, measure in zip(tempos, track.measures, strict=False):
            known |= dict.fromkeys(tempo for voice in measure.voices for tempo in _tempos(voice))
    for bar, known in zip(bars, tempos, strict=True):
        bar.tempos = sorted(known, key=lambda tempo: tempo.at)
    return Tab(bars, [_track(track, song.versionTuple) for track in song.tracks])


def _bar(header: Any) -> Bar:
    numerator, denominator = header.timeSignature.numerator, header.timeSignature.denominator.value
    signs = [sign.name for sign in (header.direction, header.fromDirection) if sign]
    return Bar(
        length=Fraction(4 * numerator, denominator),
        beat=Fraction(4, denominator),
        opens=header.isRepeatOpen,
        plays=max(header.repeatClose, 0) + 1,
        endings=frozenset(n + 1 for n in range(8) if header.repeatAlternative >> n & 1),
        signs=frozenset(filter(None, map(sign_of, signs))),
        swing=SWINGS.get(header.tripletFeel.name),
        name=header.marker.title if header.marker else "",
    )


def _tempos(voice: Any) -> list[Tempo]:
    at, found = Fraction(0), []
    for beat in voice.beats:
        change = beat.effect.mixTableChange
        if change and change.tempo is not None and change.tempo.value > 0:
            found.append(Tempo(at, float(change.tempo.value), Fraction(max(change.tempo.duration, 0))))
        at += _length(beat.duration)
    return found


def _length(duration: Any) -> Fraction:
    dotted = Fraction(3, 2) if duration.isDotted else 1
    return Fraction(4, duration.value) * dotted * duration.tuplet.times / duration.tuplet.enters


def _track(track: Any, version: tuple[int, ...]) -> Track:
    tuning = tuple(string.value for string in sorted(track.strings, key=lambda string: -string.number))
    bars = [
        [_beats(voice, len(tuning), version) for voice in measure.voices if any(beat.notes for beat in voice.beats)]
        for measure in track.measures
    ]
    frets: dict[int, int] = {}  # by string: PyGuitarPro looks for the origin of a tie in the same voice only
    for voices in bars:
        for beat in sorted((beat for beats in voices for beat in beats), key=lambda beat: beat.at):
            for note in beat.notes:
                note.fret = frets.get(note.string, note.fret) if note.tie else note.fret
                frets[note.string] = note.fret
    return Track(track.name, tuning, track.offset, track.channel.instrument, track.isPercussionTrack, bars)


def _beats(voice: Any, strings: int, version: tuple[int, ...]) -> list[Beat]:
    at, beats = Fraction(0), []
    for beat in voice.beats:
        length, effect = _length(beat.duration), beat.effect
        made = Beat(at, length, [_note(n, strings, version) for n in beat.notes if n.type.name != "rest"])
        made.stroke = effect.pickStroke.name.replace("none", "")
        if effect.stroke.direction.name != "none":
            brush = Fraction(4, effect.stroke.value) if effect.stroke.value > 0 else BRUSH
            made.brush = brush if effect.stroke.direction.name == "down" else -brush
        wah = effect.mixTableChange.wah if effect.mixTableChange else None
        there = {"fade in": effect.fadeIn, "rasgueado": effect.hasRasgueado, "wah": wah is not None and wah.value >= 0}
        made.signs = tuple(sign for sign, is_there in there.items() if is_there)
        beats.append(made)
        at += length
    return beats


def _note(note: Any, strings: int, version: tuple[int, ...]) -> Note:
    effect, beat = note.effect, note.beat.effect
    made = Note(strings - note.string, note.value, note.velocity)
    made.tie, made.dead = note.type.name == "tie", note.type.name == "dead"
    made.ghost, made.hammer, made.let_ring = effect.ghostNote, effect.hammer, effect.letRing
    made.staccato, made.palm = effect.staccato, effect.palmMute
    made.technique = TECHNIQUES.get(beat.slapEffect.name, "")
    made.accent = 2 if effect.heavyAccentuatedNote else int(effect.accentuatedNote)
    made.vibrato = 1.0 if beat.vibrato else 0.5 if effect.vibrato else 0.0
    made.slides = frozenset(SLIDES[slide.name] for slide in effect.slides if slide.name in SLIDES)
    if effect.harmonic:
        made.harmonic = HARMONICS[effect.harmonic.type]
        made.node = _node(effect.harmonic, note, version)
    if effect.bend or beat.tremoloBar:
        made.bend = _curve(effect.bend or beat.tremoloBar)
    if effect.trill:
        made.trill = effect.trill.fret, _length(effect.trill.duration)
    if effect.tremoloPicking:
        made.tremolo = _length(effect.tremoloPicking.duration)
    if effect.grace:
        made.graces.append(_grace(effect.grace, note.value, version))
    return made


def _grace(grace: Any, fret: int, version: tuple[int, ...]) -> Grace:
    """A grace note to the note at `fret`; a dead one of Guitar Pro 3 and 4 has no fret of its own."""
    length, joined = 8 - grace.duration.bit_length(), grace.transition.value  # as the file stores them
    if version[0] < 5:  # where PyGuitarPro confuses these two
        length, joined = joined, length
    way = GRACES[joined] if joined in range(len(GRACES)) else ""
    place = grace.fret if grace.fret >= 0 else fret
    return Grace(place, Fraction(4, 1 << max(7 - length, 0)), grace.isDead, way, grace.isOnBeat)


def _node(harmonic: Any, note: Any, version: tuple[int, ...]) -> float:
    """The fret of a harmonic's node, from the stop."""
    kind = HARMONICS[harmonic.type]
    if kind == model.NATURAL:
        return float(note.value)
    if kind == "tapped" and harmonic.fret:
        tapped = float(harmonic.fret - note.value)
        return tapped if tapped in NODES.values() else OCTAVE
    if kind != model.ARTIFICIAL or not harmonic.pitch or not harmonic.octave:
        return OCTAVE
    higher = (harmonic.pitch.value - note.realValue) % 12 + 12 * harmonic.octave.value
    if version[0] == 4:
        higher = {AT_FIVE: AT_SEVEN, AT_SEVEN: AT_FIVE}.get(higher, higher)
    return NODES.get(higher, OCTAVE)


def _curve(bend: Any) -> Curve:
    return tuple((point.position / bend.maxPosition, point.value * QUARTER_TONE) for point in bend.points)
