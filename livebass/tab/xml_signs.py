"""The signs of a note in MusicXML: its pitch, length, techniques, ornaments and bends."""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from math import floor
from typing import Any

from livebass.tab import model
from livebass.tab.model import Beat, Curve, Note
from livebass.tab.needs import number, whole

STEPS = {"C": 0, "D": 2, "E": 4, "F": 5, "G": 7, "A": 9, "B": 11}
TYPES = {"whole": 1, "half": 2, "quarter": 4, "eighth": 8, "16th": 16, "32nd": 32, "64th": 64}
BRUSH = Fraction(1, 8)  # quarter notes
# Signs of a note, by the elements of its notations
SLIDES = {"slide": model.SHIFT, "glissando": model.SHIFT, "scoop": model.IN_BELOW, "plop": model.IN_ABOVE,
          "falloff": model.OUT_DOWN, "doit": model.OUT_UP}  # fmt: skip
LEADING = ("slide", "glissando", "hammer-on", "pull-off")  # from one note to another
ORNAMENTS = {"trill-mark": "trill", "mordent": "mordent", "inverted-mordent": "inverted mordent", "turn": "turn",
             "inverted-turn": "inverted turn"}  # fmt: skip
UNMEASURED = 3  # strokes of a tremolo without a speed
FULL = 90  # velocity of dynamics="100"
SLASH = "slash"  # a notehead that stands for a rhythm; its pitch is only a place for the eye


def written_length(note: Any) -> Fraction:
    """The length of a note without a duration, by its shape."""
    dots, change = len(note.findall("dot")), note.find("time-modification")
    length = Fraction(4, TYPES.get((note.findtext("type") or "").strip(), 4)) * (2 - Fraction(1, 2 ** min(dots, 8)))
    if change is None:
        return length
    actual, normal = (whole(change.findtext(f"{name}-notes") or 1) for name in ("actual", "normal"))
    return length * normal / actual


def pitch_of(element: Any, prefix: str = "") -> tuple[int, float]:
    """The MIDI note of a pitch or, with the prefix "tuning-", of a string, and what it is higher, 0 to 1 semitone."""
    step, alter, octave = (element.findtext(f"{prefix}{name}") for name in ("step", "alter", "octave"))
    semitones = number(alter or "0")
    return STEPS[step.strip()] + floor(semitones) + 12 * (whole(octave) + 1), semitones - floor(semitones)


def note_of(element: Any, string: int, fret: int, velocity: int, higher: float) -> Note:
    """The note of an element, with its signs. It sounds `higher` semitones higher than its fret."""
    tied = any(tie.get("type") == "stop" for tie in ties_of(element))
    note = Note(string, fret, force_of(element) or velocity, tie=tied)
    note.dead = (element.findtext("notehead") or "") == "x"
    note.ghost = element.find("notehead[@parentheses='yes']") is not None
    note.palm = element.findtext("play/mute") == "palm"
    note.bend = _curve(element.findall("notations/technical/bend"))
    if higher:
        note.bend = tuple((x, y + higher) for x, y in note.bend or ((0.0, 0.0), (1.0, 0.0)))
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


def ties_of(element: Any) -> list[Any]:
    """Its ties, by sound and by sight."""
    return [*element.iterfind("tie"), *element.iterfind("notations/tied")]


def staff_of(note: Any) -> str:
    return note.findtext("staff") or "1"


def transposition(transpose: Any) -> int:
    """Semitones from the written to the sounding pitch."""
    if transpose is None:
        return 0
    return int(number(transpose.findtext("chromatic") or "0")) + 12 * whole(transpose.findtext("octave-change") or 0)


def force_of(element: Any) -> int:
    """The velocity of an element's dynamics, in percent of forte; 0: it has none."""
    percent = element.get("dynamics")
    return min(max(round(FULL / 100 * number(percent)), 1), 127) if percent else 0


def mark_beat(element: Any, beat: Beat) -> None:
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


def _mark(note: Note, sign: Any) -> None:
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
    elif sign.tag == "snap-pizzicato":
        note.technique = "pop"
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
        note.tremolo = Fraction(1, 2 ** min(whole(text) or UNMEASURED, 5))


def _curve(bends: Sequence[Any]) -> Curve:
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
