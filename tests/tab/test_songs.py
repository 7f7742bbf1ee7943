"""Small songs in which signs meet: their strokes in each format, worked out by hand."""

from __future__ import annotations

from fractions import Fraction as F

import pytest
from support.tabs import as_gp, as_gp5, as_gpif, as_musicxml, beats, note, tab, zipped

from livebass.tab.model import LEGATO, NATURAL, Beat, Grace, Tab, Tempo
from livebass.tab.perform import Performance, perform
from livebass.tab.reading import parsed

WRITERS = {"gp5": as_gp5, "gp": as_gp, "musicxml": as_musicxml}
Row = tuple[float, str, int, int]  # s, kind, string, fret
SLIDING = frozenset([LEGATO])
RISE, FALL = ((0.0, 0.0), (1.0, 2.0)), ((0.0, 2.0), (1.0, 0.0))


def repeated(piece: Tab, first: int = 0, last: int | None = None, plays: int = 2) -> Tab:
    piece.bars[first].opens, piece.bars[-1 if last is None else last].plays = True, plays
    return piece


def drop_a() -> Tab:
    low = note(0, 12, harmonic=NATURAL, node=12.0), note(0, 5, harmonic=NATURAL, node=5.0)
    return tab(beats(note(0, 0), *low, [note(0, 3), note(4, 2)]), tuning=(21, 28, 33, 38, 43), capo=2)


def in_six_eight() -> Tab:
    """A dotted quarter note, a triplet of eighth notes, an eighth note; then three dotted eighth notes."""
    lengths = [F(3, 2), F(1, 3), F(1, 3), F(1, 3), F(1, 2)], [F(3, 4), F(3, 4), F(3, 2)]
    rows = []
    for fret, row in enumerate(lengths):
        places = [sum(row[:k], F(0)) for k in range(len(row))]
        rows.append([Beat(at, length, [note(0, fret)]) for at, length in zip(places, row, strict=True)])
    piece = tab(*rows)
    for bar in piece.bars:
        bar.length, bar.beat = F(3), F(1, 2)
    return piece


def with_endings() -> Tab:
    """Endings 1 and 2, then 3; then a jump to a sign within the repeat, and from there to the coda."""
    piece = repeated(tab(*(beats(note(0, fret)) for fret in range(7))), last=2, plays=3)
    piece.bars[1].signs = frozenset(["segno"])
    piece.bars[2].endings, piece.bars[3].endings = frozenset([1, 2]), frozenset([3])
    piece.bars[4].signs, piece.bars[6].signs = frozenset(["da segno al coda"]), frozenset(["coda"])
    piece.bars[3].signs = frozenset(["da coda"])
    return piece


SONGS: dict[str, tuple[Tab, list[Row]]] = {
    "a tie over a bar line of a repeat": (
        repeated(
            tab(beats(note(0, 3), note(0, 5), None, note(0, 3)), beats(note(0, 3, tie=True), note(0, 7), None, None))
        ),
        [(4.0 * turn + at, "pluck", 0, fret) for turn in (0, 1) for at, fret in ((0, 3), (0.5, 5), (1.5, 3), (2.5, 7))],
    ),
    "a tie into a repeat is struck on the way back": (
        repeated(
            tab(beats(None, None, None, note(0, 3)), beats(note(0, 3, tie=True), note(0, 5), None, note(0, 8))), 1
        ),
        [(at, "pluck", 0, fret) for at, fret in ((1.5, 3), (2.5, 5), (3.5, 8), (4, 3), (4.5, 5), (5.5, 8))],
    ),
    "a grace note before a tie": (
        tab(beats(note(1, 5), note(1, 5, tie=True, graces=[Grace(4, F(1, 8), joined="hammer")]))),
        [(0.0, "pluck", 1, 5), (0.4375, "pluck", 1, 4), (0.5, "hammer", 1, 5)],
    ),
    "a slide into a tied note, and on from it": (
        tab(beats(note(1, 5, slides=SLIDING), note(1, 7), note(1, 7, tie=True, slides=SLIDING), note(1, 5))),
        [(0.0, "pluck", 1, 5), (0.375, "slide", 1, 7), (1.25, "slide", 1, 5)],
    ),
    "tuplets in 6/8": (
        in_six_eight(),
        [(at, "pluck", 0, 0) for at in (0, 0.75, 0.75 + 1 / 6, 0.75 + 1 / 3, 1.25)]
        + [(at, "pluck", 0, 1) for at in (1.5, 1.875, 2.25)],
    ),
    "endings 1 and 2, then 3, and a sign within the repeat": (
        with_endings(),
        [(2.0 * k, "pluck", 0, fret) for k, fret in enumerate([0, 1, 2, 0, 1, 2, 0, 1, 3, 4, 1, 3, 6])],
    ),
    "five strings in drop A, harmonics on the lowest": (
        drop_a(),
        [(0.0, "pluck", 0, 0), (0.5, "harmonic", 0, 0), (1.0, "harmonic", 0, 0), (1.5, "pluck", 0, 3),
         (1.5, "pluck", 4, 2)],
    ),
    "a hammer-on after a dead note, and one over a rest": (
        tab(beats(note(2, 5, dead=True, hammer=True), note(2, 7, hammer=True), None, note(2, 9))),
        [(0.0, "dead", 2, 5), (0.5, "pluck", 2, 7), (1.5, "pluck", 2, 9)],
    ),
}  # fmt: skip


def in_zip(gpif: bytes) -> bytes:
    return zipped({"Content/score.gpif": gpif})


def played(piece: Tab) -> Performance:
    return perform(piece, piece.tracks[0])


@pytest.mark.parametrize("kind", WRITERS)
@pytest.mark.parametrize("song", SONGS)
def test_a_song_is_played_as_it_is_written(song: str, kind: str) -> None:
    piece, expected = SONGS[song]
    strokes = played(parsed(WRITERS[kind](piece))).strokes
    assert [(s.kind, s.string, s.fret) for s in strokes] == [row[1:] for row in expected]
    assert [s.time for s in strokes] == pytest.approx([row[0] for row in expected], abs=1e-3)


@pytest.mark.parametrize("kind", WRITERS)
def test_notes_ring_on_to_the_next_turn_of_a_repeat(kind: str) -> None:
    piece = repeated(tab(beats(note(2, 5, let_ring=True), note(0, 3), note(0, 3))))
    ringing = [s for s in played(parsed(WRITERS[kind](piece))).strokes if s.string == 2]
    assert [(s.time, s.end) for s in ringing] == [(0.0, 2.0), (2.0, 4.0)]


@pytest.mark.parametrize("kind", ["gp5", "gp"])
def test_a_bend_is_released_on_a_tied_note(kind: str) -> None:
    piece = tab(beats(note(2, 5, bend=RISE), note(2, 5, tie=True, bend=FALL), note(2, 5)))
    bent, straight = played(parsed(WRITERS[kind](piece))).strokes
    assert bent.end == 1.0 and bent.bend == ((0.0, 0.0), (0.5, 2.0), (0.5, 2.0), (1.0, 0.0)) and not straight.bend


@pytest.mark.parametrize("kind", WRITERS)
def test_each_turn_of_a_repeat_has_its_own_tempo(kind: str) -> None:
    piece = tab(*(beats(*[note(0, fret)] * 4) for fret in range(3)))
    piece.bars[2].tempos.append(Tempo(F(0), 60.0))
    times = [s.time for s in played(parsed(WRITERS[kind](repeated(piece, 1)))).strokes]
    assert times[::4] == pytest.approx([0, 2, 4, 8, 10])


def test_an_upbeat_is_as_long_as_its_notes() -> None:
    piece = tab(beats(note(0, 3)), beats(note(0, 5)))
    upbeats = {
        "gp": in_zip(as_gpif(piece).replace(b"<MasterTrack>", b"<MasterTrack><Anacrusis/>")),
        "musicxml": as_musicxml(piece).replace(b'number="1"', b'number="0" implicit="yes"', 1),
    }
    for data in upbeats.values():
        assert [s.time for s in played(parsed(data)).strokes] == [0.0, 0.5]


@pytest.mark.parametrize("kind", ["gp", "musicxml"])
def test_a_note_is_hammered_on_from_another_string(kind: str) -> None:
    piece = tab(beats(note(1, 5, hammer=True), note(2, 7), note(2, 7)))
    data = as_musicxml(piece) if kind == "musicxml" else as_gpif(piece)
    marks = {
        "gp": (b'name="Fret"><Fret>7', b'name="HopoDestination"><Enable/></Property><Property name="Fret"><Fret>7'),
        "musicxml": (b"<fret>7</fret>", b'<fret>7</fret><hammer-on type="stop"/>'),
    }
    data = data.replace(*marks[kind], 1)
    strokes = played(parsed(data if kind == "musicxml" else in_zip(data))).strokes
    assert [(s.kind, s.string) for s in strokes] == [("pluck", 1), ("tap", 2), ("pluck", 2)]


def test_similes_repeat_one_bar_or_two() -> None:
    piece = tab(*(beats(note(0, fret)) for fret in range(5)))
    words = as_gpif(piece)
    for number, mark in ((2, b"FirstOfDouble"), (3, b"SecondOfDouble"), (4, b"Simple")):
        bar = f'<Bar id="{number}">'.encode()
        assert bar in words
        words = words.replace(bar, bar + b"<SimileMark>" + mark + b"</SimileMark>")
    strokes = played(parsed(in_zip(words))).strokes
    assert [s.fret for s in strokes] == [0, 1, 0, 1, 1]
