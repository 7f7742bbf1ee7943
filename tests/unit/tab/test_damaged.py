"""Damaged tablature of every format: played, or refused in one line, soon."""

from __future__ import annotations

import random
import re
import time
from collections.abc import Callable
from fractions import Fraction as F
from functools import partial
from math import isfinite
from pathlib import Path

import pytest
from hypothesis import settings
from support.costs import quick
from support.tabs import WRITERS, as_gpif, as_musicxml, beats, note, tab, zip_files

from livebass.cli.hands import SOUND, Loader
from livebass.files.kinds import is_tab
from livebass.score.reading import ScoreError
from livebass.tab.model import LEGATO, NATURAL, Beat, Grace, Tempo, UnreadableTab
from livebass.tab.needs import parsed_xml
from livebass.tab.reading import Arrangement, TabRequest, arrange, table

# Words of Python and of libraries, which tell a player nothing
FOREIGN = re.compile(r"PyGuitarPro|unpack|literal|NoneType|Error|object|argument|codec|index|Fraction|convert|integer")
COUNT = 30 if settings().max_examples < 400 else 1000  # of each format; tools/test --all: 1000
LONGEST = 5.0  # s
HARMONIC = {"harmonic": NATURAL, "node": 12.0}
PIECE = tab(
    beats(note(0, 3, hammer=True), note(0, 5, slides=frozenset([LEGATO])), note(0, 7), note(3, 12, **HARMONIC)),
    [Beat(F(0), F(3), [note(1, 2, bend=((0.0, 0.0), (1.0, 2.0))), note(2, 4)], brush=F(1, 8)), Beat(F(3), F(1), [])],
    beats(note(2, 5, graces=[Grace(4, F(1, 8))]), note(2, 5, tie=True), note(2, 5, trill=(7, F(1, 4)))),
)  # fmt: skip
PIECE.bars[0].opens = True
PIECE.bars[1].plays, PIECE.bars[1].endings = 3, frozenset([1, 2])
PIECE.bars[2].signs = frozenset(["da capo"])
PIECE.bars[2].tempos.append(Tempo(F(0), 90.0, F(2)))
NUMBERS = "0123456789-"


def flip(data: bytes, chance: random.Random) -> bytes:
    """Bytes changed, left out, doubled, or cut off."""
    out = bytearray(data)
    for _ in range(chance.choice((1, 1, 2, 5, 20))):
        at, size = chance.randrange(len(out)), chance.choice((1, 1, 1, 2, 4, 40))
        what = chance.randrange(6)
        if what < 3:
            out[at : at + 1] = chance.choice((b"\xff", b"\0", b"\x7f", bytes([chance.randrange(256)])))
        elif what == 3:
            del out[at : at + size]
        elif what == 4:
            out[at:at] = out[at : at + size]
        elif len(out) > 100:
            del out[max(at, 100) :]
    return bytes(out)


def miswritten(text: bytes, chance: random.Random) -> bytes:
    """XML with other numbers, or elements missing or doubled."""
    parts = text.decode().split(">")
    for _ in range(chance.choice((1, 1, 2, 5))):
        at = chance.randrange(1, len(parts))
        what = chance.randrange(4)
        if what < 2:
            digits = [k for k, c in enumerate(parts[at]) if c in NUMBERS]
            if digits:
                k = chance.choice(digits)
                number = chance.choice(("", "-1", "0", "99999999999", "1e9", "1e400", "nan", "9" * 5000, "x", "7"))
                parts[at] = parts[at][:k] + number + parts[at][k + 1 :]
        elif what == 2:
            del parts[at : at + 2]
        else:
            parts[at:at] = parts[at : at + 2]
    return ">".join(parts).encode()


def read(data: bytes, track: str | None = None) -> Arrangement:
    return arrange(data, Path("a.tab"), TabRequest(track), Loader(dict.fromkeys(SOUND)))


def files() -> dict[str, Callable[[random.Random], bytes]]:
    found: dict[str, Callable[[random.Random], bytes]] = {
        kind: partial(flip, write(PIECE)) for kind, write in WRITERS.items()
    }
    gpif, musicxml = as_gpif(PIECE), as_musicxml(PIECE)
    found["gpif"] = lambda chance: zip_files({"Content/score.gpif": miswritten(gpif, chance)})
    found["xml"] = lambda chance: miswritten(musicxml, chance)
    return found


FILES = files()


@pytest.mark.parametrize("kind", FILES)
def test_damage_is_survived_or_said(kind: str) -> None:
    chance, count = random.Random(kind), 0
    for _ in range(COUNT):
        data = FILES[kind](chance)
        if not is_tab(data):
            continue
        began = time.process_time()
        try:
            song = read(data)
            score, (midi, _) = song.score(48000), song.exported()
            assert song.remark.isprintable() and all(map(isfinite, score.frames)) and midi
            count += 1
        except ScoreError as error:
            assert str(error).isprintable() and str(error).startswith("a.tab: "), error
            assert not FOREIGN.search(str(error)) and len(str(error)) < 500, error
        assert time.process_time() - began < LONGEST, data
    assert count, "some damage is harmless"


def test_too_much_of_anything_is_refused() -> None:
    many = as_musicxml(tab(beats(note(0, 3)))).replace(b"</part>", b'<measure number="9"/>' * 6000 + b"</part>")
    with pytest.raises(ScoreError, match="has 6001 bars, more than 5000"):
        read(many)
    nested = b"<score-partwise>" + b"<a>" * 50_000 + b"</a>" * 50_000 + b"</score-partwise>"
    with pytest.raises(ScoreError):
        read(nested)


@pytest.mark.parametrize(
    "piece, said",
    [
        (b'<sound tempo="60"/>' * 11_000, "more than 10000 tempos"),
        (b"<note><rest/><duration>1</duration></note>" * 31_000, "notes and rests, more than 30000"),
        (b"<direction/>" * 61_000, "directions, more than 60000"),
        (b"<a/>" * 600_001, "more than 600000 elements"),
        (b'<a b="" c="" d="" e="" f=""/>' * 120_001, "more than 600000 attributes"),
        (b'a%d=""', "more than 600000 attributes"),
        (b'xmlns:a%d="b"', "more than 600000 attributes"),
        (b'<sound tempo="nan"/>', "is damaged: nan is not finite"),
        (b"<note><rest/><duration>1e99999999</duration></note>", "is not finite"),
        (b'<attributes><divisions>' + b"9" * 5000 + b"</divisions></attributes>", "is damaged"),
        (b"<attributes><staff-details><capo>" + b"9" * 5000 + b"</capo></staff-details></attributes>",
         "damaged: 9+ is not a whole number"),
        (b'<a xmlns="' + b"n" * 100_000 + b'">' + b"<b/>" * 500_000 + b"</a>", "namespace of more than 1000"),
    ],
)  # fmt: skip
def test_floods_and_endless_numbers_are_refused_at_once(piece: bytes, said: str) -> None:
    """A piece with %d becomes the attributes of one element."""
    if b"%d" in piece:
        piece = b"<a " + b" ".join(piece % k for k in range(600_001)) + b"/>"
    text = as_musicxml(tab(beats(note(0, 3)))).replace(b"</measure>", piece + b"</measure>")
    began = time.process_time()
    with pytest.raises(ScoreError, match=said) as error:
        read(text)
    assert time.process_time() - began < LONGEST
    assert len(str(error.value)) < 200


@pytest.mark.parametrize("encoding", ["utf-8", "utf-16"])
def test_long_namespaces_and_default_attributes_are_refused_before_they_cost(encoding: str) -> None:
    """The parser would copy a namespace, and give a default attribute, to each of half a million elements."""
    head = f'<?xml version="1.0" encoding="{encoding}"?>'
    elements = "<x:b/>" * 250_000
    began = time.process_time()
    long = f'{head}<x:a xmlns:x="{"n" * 100_000}">{elements}</x:a>'
    with pytest.raises(UnreadableTab, match="a namespace of more than 1000 characters"):
        parsed_xml(long.encode(encoding))
    default = f'{head}<!DOCTYPE a [<!ATTLIST b c CDATA "{"n" * 100_000}">]><a>{elements}</a>'
    with pytest.raises(UnreadableTab, match="declares default attributes"):
        parsed_xml(default.encode(encoding))
    assert time.process_time() - began < LONGEST
    short = f'{head}<!DOCTYPE a [<!ATTLIST a c CDATA #IMPLIED>]><a xmlns="http://of/scores"><b/></a>'
    assert [each.tag for each in parsed_xml(short.encode(encoding)).iter()] == ["a", "b"]


def crowded(kind: str) -> bytes:
    """A piece with so much of a kind that it must not be compared with all others of its kind."""
    piece = tab(beats(note(0, 3)))
    gpif, musicxml = as_gpif(piece).decode(), as_musicxml(piece).decode()
    if kind == "voices":
        gpif = gpif.replace("</Bars><Voices>", '<Bar id="9"><Voices>-1</Voices></Bar></Bars><Voices>')
        empty = "<MasterBar><Time>4/4</Time><Bars>9</Bars></MasterBar>"
        gpif = gpif.replace("</MasterBars>", f"{empty * 4900}</MasterBars>")
        gpif = gpif.replace("<Voices>0</Voices>", f"<Voices>{'0 ' * 14_000}</Voices>")
    elif kind == "fermatas":
        fermatas = "<Fermata><Offset>1/7</Offset></Fermata>" * 100_000
        gpif = gpif.replace("</MasterBar>", f"<Fermatas>{fermatas}</Fermatas></MasterBar>")
        gpif = gpif.replace("<Voices>0</Voices>", f"<Voices>{'0 ' * 14_000}</Voices>")
    if kind in ("voices", "fermatas"):
        return zip_files({"Content/score.gpif": gpif.encode()})
    if kind == "tempos":
        part = re.search("<part .*</part>", musicxml, re.DOTALL)
        assert part
        parts = ["".join(f'<sound tempo="{at + k / 1000}"/>' for k in range(29_000)) + "</measure>" for at in (30, 90)]
        both = (part[0].replace("</measure>", each) for each in parts)
        return musicxml.replace(part[0], "".join(both)).encode()
    wedge = "<direction><direction-type><wedge type='{}' number='{}'/></direction-type></direction>"
    marks = ("".join(wedge.format(way, k) for k in range(6000)) for way in ("crescendo", "stop"))
    rests = "<note><rest/><duration>0.01</duration></note>" * 8000
    return musicxml.replace("</measure>", f"{rests.join(marks)}</measure>").encode()


@pytest.mark.parametrize("kind", quick(["voices", "fermatas", "tempos", "hairpins"], ["voices", "hairpins"]))
def test_a_crowd_of_one_kind_is_read_soon(kind: str) -> None:
    data, began = crowded(kind), time.process_time()
    try:
        assert read(data).score(48000)
    except ScoreError as error:
        assert "more than 10000 tempos and fermatas" in str(error)
    assert time.process_time() - began < LONGEST


def test_what_a_damaged_guitar_pro_file_says_is_its_place() -> None:
    whole = WRITERS["gp5"](PIECE)
    with pytest.raises(ScoreError, match=r"^a\.tab: is damaged in track 1, measure \d, voice \d, beat \d$"):
        read(whole[: len(whole) - 100])
    with pytest.raises(ScoreError, match=r"^a\.tab: is damaged in its head$"):
        read(whole[:60])


def test_names_in_a_file_are_shown_in_one_line() -> None:
    """A score of the MusicXML working group, ActorPreludeSample, has parts called "1\\n2"."""
    piece = tab(beats(note(0, 3)), name="Bass\n\x1b[31m 1\t2" + 20 * "x")
    song = read(WRITERS["gp5"](piece))
    assert song.remark.isprintable() and len(song.remark) < 250, song.remark
    text = as_musicxml(tab(beats(note(0, 3)), name="NAME")).replace(b"NAME", b"Bass\n1\n 2")
    assert read(text).remark == 'plays track 1 "Bass 1 2", 1 note'
    assert read(text, "Bass 1\n2").remark == read(text, "1").remark == read(text).remark


def test_a_track_without_end_is_not_there() -> None:
    with pytest.raises(ScoreError, match="has no track 9999"):
        read(WRITERS["gp5"](PIECE), "9" * 5000)


def test_a_bar_of_thirds_is_played() -> None:
    text = as_musicxml(tab(beats(note(0, 3)))).replace(b"<beat-type>4", b"<beat-type>3")
    read(text)


def test_of_a_whole_orchestra_only_the_bass_is_read() -> None:
    text = as_musicxml(tab(beats(note(0, 3), note(0, 5), note(0, 7), note(0, 9)))).decode()
    violin = "<note><pitch><step>{}</step><octave>5</octave></pitch><duration>1</duration>{}</note>"
    violins = (
        violin.format("A", "") + 31_000 * "<note><grace/><rest/></note>" + violin.format("C", "<tie type='stop'/>")
    )
    slower = "<direction><sound tempo='60'/></direction>"
    head = "<attributes><divisions>1</divisions></attributes>"
    measure = f"<measure number='1'>{head}{violins}{slower}</measure>"
    text = text.replace("</part-list>", "<score-part id='V'><part-name>Violin</part-name></score-part></part-list>")
    text = text.replace("</score-partwise>", f"<part id='V'>{measure}</part></score-partwise>")
    times = [stroke.time for stroke in read(text.encode()).performance.strokes]
    assert times == pytest.approx([0, 0.5, 1, 2]), "a tempo of the violin"
    assert [row[5] for row in table(text.encode(), Path("a.xml"), TabRequest())] == ["notes", "4", "2"]
    with pytest.raises(ScoreError, match="only its basses, not track 2"):
        read(text.encode(), "Violin")


def test_a_bar_without_length_is_refused() -> None:
    piece = tab(beats(note(0, 3)))
    piece.bars[0].length = F(-1)
    with pytest.raises(ScoreError, match="bar 1 has -1 quarter notes"):
        read(WRITERS["gp5"](piece))
