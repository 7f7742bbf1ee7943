"""Reads MusicXML: strings and frets where the file gives them, else the lowest frets for all that sounds.

It reads in this order:
1. of each part, the staves that sound, transpositions and open strings (`Part`, as the next two);
2. its measures: notes of all voices with their times, dynamics, tempos, lines and signs with theirs;
3. its repeats and jumps;
4. over all parts, the lengths of upbeats and of bars that are written as two (here);
5. of each part, ties, and the strings of all notes at once (`Part.track`, fingering.py);
6. the beats of each voice, with the dynamics of their times, then hairpins and lines (`Part.track`);
7. the bars of all parts as one (here).
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Sequence
from fractions import Fraction
from itertools import accumulate, groupby
from typing import Any

from livebass.tab.model import Bar, Tab, UnreadableTab
from livebass.tab.needs import checked_reading, exact, parsed_xml
from livebass.tab.xml_part import ROUNDING, Part, is_bass

MAX_NOTES = 30_000  # with rests; of a score with more, only the parts that a bass may play are read
MAX_DIRECTIONS = 60_000  # with tempos
MAX_PIECES = 3  # measures that are one bar
# Pieces of the text of a large score
DESCRIPTION = re.compile(rb"""<score-part\s[^<>]*?id=["'](?P<id>[^"'<>]*).*?</score-part>""", re.DOTALL)
PART = re.compile(rb"""<part\s[^<>]*?id=["'](?P<id>[^"'<>]*)""")
NOTE = re.compile(rb"<note(?:\s[^<>]*)?>")
*SAID, DURATION = (
    re.compile(rb"<%b>([^<]*)</%b>" % (tag, tag)) for tag in (b"part-name", b"midi-program", b"duration")
)


def read_musicxml(data: bytes) -> Tab:
    """The piece in a MusicXML file. Raises UnreadableTab, or LookupError without defusedxml."""
    left = Counter[str]()  # notes that are not read, by part
    if data.count(b"</note>") > MAX_NOTES:
        data, left = _of_basses(data)
    root = parsed_xml(data)
    with checked_reading():
        if root.tag == "score-timewise":
            _turn_by_part(root)
        if root.tag != "score-partwise":
            raise UnreadableTab(f"is not a score: its XML is {root.tag[:40]!r}, not score-partwise or score-timewise")
        for name, count, maximum in (
            ("notes and rests", _count(root, "note"), MAX_NOTES),
            ("directions", _count(root, "direction") + _count(root, "sound"), MAX_DIRECTIONS),
        ):
            if count > maximum:
                raise UnreadableTab(f"has {count} {name}, more than {maximum}")
        names = {part.get("id"): part for part in root.iterfind("part-list/score-part")}
        divisions = exact(root.findtext(".//divisions") or "1")  # of parts without their own
        parts = [Part(part, names.get(part.get("id")), divisions) for part in root.iterfind("part")]
        _shorten_upbeat(parts)
        _shorten_pieces(parts)
        tracks = [part.track(left[part.name]) for part in parts]
        return Tab(_merge_parts([part.bars for part in parts]), tracks)


def _count(root: Any, tag: str) -> int:
    return sum(1 for _ in root.iter(tag))


def _of_basses(data: bytes) -> tuple[bytes, Counter[str]]:
    """A large score with the notes of its basses only, and the number of the others by part.

    A part is a bass by its tablature, its name or its program. The notes of the others become times that pass.
    """
    basses = set[bytes]()
    for part in DESCRIPTION.finditer(data):
        found = (match[1].decode(errors="replace") if (match := text.search(part[0])) else "" for text in SAID)
        basses |= {part["id"]} if is_bass(*found) else set()
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


def _shorten_upbeat(parts: Sequence[Part]) -> None:
    """Shortens the first bar to its notes if no part fills it, but one fills the next: an upbeat without a mark."""
    long = [part for part in parts if len(part.bars) > 1]
    upbeat, after = (max((part.filled[k] for part in long), default=Fraction(0)) for k in (0, 1))
    if upbeat > 0 and all(upbeat < part.bars[0].length and after >= part.bars[1].length - ROUNDING for part in long):
        for part in long:
            part.bars[0].length = upbeat


def _shorten_pieces(parts: Sequence[Part]) -> None:
    """Shortens measures that are pieces of one bar: no part fills any, and together they are as long as the bar.

    Where all measures are short, none is a piece: their rests are missing.
    """
    count = min((len(part.bars) for part in parts), default=0)
    filled = [max(part.stated[k] for part in parts) for k in range(count)]
    lengths = [max(part.bars[k].length for part in parts) for k in range(count)]
    short = [0 < own < length - ROUNDING for own, length in zip(filled, lengths, strict=True)]
    for is_short, group in groupby(range(count), short.__getitem__):
        pieces = list(group)
        if not is_short or len(pieces) == count:
            continue
        while pieces:
            sums = list(accumulate(filled[k] for k in pieces[:MAX_PIECES]))
            number = sums.index(lengths[pieces[0]]) + 1 if lengths[pieces[0]] in sums else 0
            for k in pieces[:number]:
                for part in parts:
                    part.bars[k].length = filled[k]
            pieces = pieces[number or 1 :]


def _merge_parts(parts: Sequence[list[Bar]]) -> list[Bar]:
    """The bars of all parts as one: as long as the longest, with the tempos and signs of each."""
    bars = max(parts, key=len, default=[])
    tempos = [set(bar.tempos) for bar in bars]
    holds = [{hold.at for hold in bar.holds} for bar in bars]
    for others in parts:
        for bar, other, known, held in zip(bars, others, tempos, holds, strict=False):
            bar.tempos += [tempo for tempo in other.tempos if tempo not in known]
            bar.holds += [hold for hold in other.holds if hold.at not in held]
            known.update(other.tempos)
            held.update(hold.at for hold in other.holds)
            bar.signs, bar.name = bar.signs | other.signs, bar.name or other.name
            bar.length = max(bar.length, other.length)
    for bar in bars:
        bar.tempos.sort(key=lambda tempo: tempo.at)
    return bars
