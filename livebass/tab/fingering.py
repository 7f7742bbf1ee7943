"""Chooses strings and frets for the pitches of a score without tablature, over all that sounds.

Notes that sound at once, or that a slide or a hammer-on joins, are chosen together. The best choice loses the fewest
notes, then leaves the fewest beyond the frets, then cuts the fewest short, then parts the fewest joined ones, then has
the lowest frets, and then the highest notes on the highest strings. It is the best of the BEAM best beginnings, which
are completed note by note.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from fractions import Fraction
from heapq import nsmallest
from itertools import accumulate
from operator import attrgetter
from typing import NamedTuple

from livebass.tab.model import Bar, Beat, Note

DEFAULT_STRINGS = (28, 33, 38, 43)  # of a bass, for a part without strings of its own
FIFTH_STRING = 23
MAX_TIED = 24  # notes back to the one that a tie continues
BEAM = 24
FRETS = 20  # of most basses
TOGETHER = Fraction(1, 32)  # quarter notes by which notes may overlap


@dataclass(eq=False)
class Sounding:
    """A note as long as it sounds, with its ties."""

    begin: Fraction  # quarter notes
    end: Fraction
    pitch: int  # MIDI note over the capo
    given: tuple[int, int] | None = None  # string and fret by the score
    wish: int | None = None  # a string that the score names without a fret
    origin: Sounding | None = None  # an earlier note, whose string it takes if it can: one that leads to it
    place: tuple[int, int] = (-1, 0)  # the string and fret chosen; -1: no string has it


class _Cost(NamedTuple):
    """The faults of a choice, the worst first."""

    lost: int = 0  # by another one on its string
    far: int = 0  # beyond FRETS
    cut: int = 0
    parted: int = 0
    frets: int = 0
    squares: int = 0  # of frets: least with high notes on high strings


@dataclass
class _Choice:
    """A choice for the notes of a group up to one of them."""

    cost: _Cost
    before: _Choice | None
    place: tuple[int, int]
    strings: tuple[Sounding | None, ...]  # the last note on each
    origins: dict[Sounding, int]  # the strings of notes that lead to later ones


def choose_strings(notes: Sequence[Sounding], tuning: Sequence[int]) -> None:
    """Gives each note its place on strings with these open notes, lowest first."""
    leading = {note.origin for note in notes if note.origin is not None}
    for group in _groups(sorted(notes, key=lambda note: note.begin)):
        beam = 1 if _sound_at_once(group, len(tuning) + 1) else BEAM
        earlier = {note.origin: note.origin.place[0] for note in group if note.origin is not None}
        choices = [_Choice(_Cost(), None, (-1, 0), (None,) * len(tuning), earlier)]
        for note in group:
            places = _places(note, tuning)
            found = [_chosen(choice, note, place, note in leading) for choice in choices for place in places]
            choices = nsmallest(beam, found, key=attrgetter("cost"))
        last = choices[0]
        for note in reversed(group):
            note.place = last.place
            last = last.before or last


def _groups(notes: Sequence[Sounding]) -> Iterator[list[Sounding]]:
    """The notes, in order, in groups whose choices do not depend on each other."""
    group, members, end = list[Sounding](), set[Sounding](), Fraction(0)
    for note in notes:
        if group and note.begin > end - TOGETHER and note.begin > group[-1].begin and note.origin not in members:
            yield group
            group, members, end = [], set(), note.end
        group.append(note)
        members.add(note)
        end = max(end, note.end)
    if group:
        yield group


def _sound_at_once(group: Sequence[Sounding], count: int) -> bool:
    """True if `count` notes sound together."""
    ends = list[Fraction]()
    for note in group:
        ends = [end for end in ends if end - TOGETHER > note.begin]
        ends.append(note.end)
        if len(ends) >= count:
            return True
    return False


def _places(note: Sounding, tuning: Sequence[int]) -> list[tuple[int, int]]:
    """The places where a note can be played; the given or wished one alone, if there is one."""
    if note.given is not None:
        return [note.given]
    places = [(string, note.pitch - opened) for string, opened in enumerate(tuning) if note.pitch >= opened]
    return [place for place in places if place[0] == note.wish] or places or [(-1, 0)]


def _chosen(choice: _Choice, note: Sounding, place: tuple[int, int], leads: bool) -> _Choice:
    """A choice with one more note."""
    string, fret = place
    cost, strings, origins = choice.cost, choice.strings, choice.origins
    if 0 <= string < len(strings):
        held = strings[string]
        overlaps = held is not None and held.end - TOGETHER > note.begin
        together = held is not None and held.begin == note.begin
        cost = _Cost(
            cost.lost + together,
            cost.far + (fret > FRETS),
            cost.cut + (overlaps and not together),
            cost.parted + (note.origin in origins and origins[note.origin] != string),
            cost.frets + fret,
            cost.squares + fret * fret,
        )
        strings = (*strings[:string], note, *strings[string + 1 :])
    if leads or note.origin in origins:
        origins = {each: on for each, on in origins.items() if each is not note.origin}
        origins |= {note: string} if leads else {}
    return _Choice(cost, choice, place, strings, origins)


def goes_below(pitches: Iterable[int]) -> bool:
    """True if a part of these MIDI notes needs the fifth string."""
    return FIFTH_STRING <= min(pitches, default=127) < DEFAULT_STRINGS[0]


def place_by_pitch(bars: Sequence[Bar], voices: Sequence[Sequence[Sequence[Beat]]]) -> tuple[int, ...]:
    """Gives the notes of a track without strings their places, in bars and voices. Their frets are MIDI notes before.

    Returns the notes of the open strings, those of a bass.
    """
    notes: list[tuple[Note, Sounding]] = []
    begins = accumulate((bar.length for bar in bars), initial=Fraction(0))
    last: dict[int, tuple[Note, Sounding]] = {}  # of each voice
    for begin, each in zip(begins, voices, strict=False):
        for number, beats in enumerate(each):
            for beat in beats:
                at = begin + beat.at
                for note in beat.notes:
                    sounding = Sounding(at, at + beat.length, note.fret)
                    before = last.get(number)
                    if before and (before[0].hammer or before[0].slides):
                        sounding.origin = before[1]
                    tied = (own for other, own in reversed(notes[-MAX_TIED:]) if own.pitch == note.fret)
                    if note.tie and (found := next(tied, None)) and abs(found.end - at) < TOGETHER:
                        sounding = found
                        sounding.end = at + beat.length
                    notes.append((note, sounding))
                if beat.notes:
                    last[number] = notes[-1]
    tuning = (FIFTH_STRING,) * goes_below(note.fret for note, _ in notes) + DEFAULT_STRINGS
    choose_strings(list(dict.fromkeys(sounding for _, sounding in notes)), tuning)
    for note, sounding in notes:
        note.string, note.fret = sounding.place
    return tuning
