"""Small songs in which signs meet: their strokes in each format, worked out by hand."""

from __future__ import annotations

from fractions import Fraction as F
from pathlib import Path

import pytest
from support.musicxml import HEAD, HIGH, TUNING, direction, plain, scored
from support.tabs import WRITERS as ALL
from support.tabs import as_gp, as_gp5, as_gpif, as_musicxml, beats, note, play, tab, zip_files

from livebass.score.reading import ScoreError
from livebass.tab.model import ARTIFICIAL, LEGATO, NATURAL, Beat, Grace, Tab, Tempo
from livebass.tab.perform import Performance
from livebass.tab.reading import TabRequest, parse, table

WRITERS = {"gp5": as_gp5, "gp": as_gp, "musicxml": as_musicxml}
Row = tuple[float, str, int, int]  # s, kind, string, fret
SLIDING = frozenset([LEGATO])
RISE, FALL = ((0.0, 0.0), (1.0, 2.0)), ((0.0, 2.0), (1.0, 0.0))


def repeat(piece: Tab, first: int = 0, last: int | None = None, plays: int = 2) -> Tab:
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
    piece = repeat(tab(*(beats(note(0, fret)) for fret in range(7))), last=2, plays=3)
    piece.bars[1].signs = frozenset(["segno"])
    piece.bars[2].endings, piece.bars[3].endings = frozenset([1, 2]), frozenset([3])
    piece.bars[4].signs, piece.bars[6].signs = frozenset(["da segno al coda"]), frozenset(["coda"])
    piece.bars[3].signs = frozenset(["da coda"])
    return piece


def in_odd_bars() -> Tab:
    first = [Beat(F(0), F(3), [note(0, 3)]), Beat(F(3), F(1, 2), [note(0, 5)])]
    piece = tab(first, [Beat(F(0), F(1), [note(0, 5, tie=True)]), Beat(F(1), F(4), [note(0, 7)])])
    piece.bars[0].length, piece.bars[0].beat, piece.bars[1].length = F(7, 2), F(1, 2), F(5)
    return piece


SONGS: dict[str, tuple[Tab, list[Row]]] = {
    "a tie over a bar line of a repeat": (
        repeat(
            tab(beats(note(0, 3), note(0, 5), None, note(0, 3)), beats(note(0, 3, tie=True), note(0, 7), None, None))
        ),
        [(4.0 * turn + at, "pluck", 0, fret) for turn in (0, 1) for at, fret in ((0, 3), (0.5, 5), (1.5, 3), (2.5, 7))],
    ),
    "a tie into a repeat is struck on the way back": (
        repeat(
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
    "grace notes before both notes of a chord": (
        tab(beats(None, [note(1, 5, graces=[Grace(4, F(1, 8), joined="hammer")]),
                         note(2, 7, graces=[Grace(6, F(1, 8))])])),
        [(0.4375, "pluck", 1, 4), (0.4375, "pluck", 2, 6), (0.5, "hammer", 1, 5), (0.5, "pluck", 2, 7)],
    ),
    "a hammer-on over a repeat, from its last note to its first": (
        repeat(tab(beats(note(0, 3, hammer=True), note(0, 5), None, note(0, 7, hammer=True)))),
        [(0.0, "pluck", 0, 3), (0.5, "hammer", 0, 5), (1.5, "pluck", 0, 7), (2.0, "pull", 0, 3), (2.5, "hammer", 0, 5),
         (3.5, "pluck", 0, 7)],
    ),
    "tapped notes are tapped, from hammered ones too": (
        tab(beats(note(2, 5, hammer=True), note(2, 12, technique="tap", hammer=True), note(2, 5, hammer=True),
                  note(2, 8))),
        [(0.0, "pluck", 2, 5), (0.5, "tap", 2, 12), (1.0, "pull", 2, 5), (1.5, "hammer", 2, 8)],
    ),
    "a tie from 7/8 into 5/4": (
        in_odd_bars(),
        [(0.0, "pluck", 0, 3), (1.5, "pluck", 0, 5), (2.25, "pluck", 0, 7)],
    ),
    "a slide into the next bar, and one that a tied note takes there": (
        tab(beats(None, None, None, note(2, 3, slides=SLIDING)),
            beats(note(2, 5), None, None, note(1, 3)), beats(note(1, 3, tie=True, slides=SLIDING), note(1, 5))),
        [(1.5, "pluck", 2, 3), (1.875, "slide", 2, 5), (3.5, "pluck", 1, 3), (4.25, "slide", 1, 5)],
    ),
    "a chain of hammer-ons with a ghost note": (
        tab(beats(note(1, 3, hammer=True), note(1, 5, hammer=True, ghost=True), note(1, 7, hammer=True), note(1, 5))),
        [(0.0, "pluck", 1, 3), (0.5, "hammer", 1, 5), (1.0, "hammer", 1, 7), (1.5, "pull", 1, 5)],
    ),
    "a tremolo on a note of a triplet": (
        tab([Beat(F(0), F(2, 3), [note(0, 1)]), Beat(F(2, 3), F(2, 3), [note(0, 3, tremolo=F(1, 4))]),
             Beat(F(4, 3), F(2, 3), [note(0, 5)])]),
        [(0.0, "pluck", 0, 1), *((1 / 3 + k / 12, "pluck", 0, 3) for k in range(4)), (2 / 3, "pluck", 0, 5)],
    ),
    "a hammer-on after a dead note, and one over a rest": (
        tab(beats(note(2, 5, dead=True, hammer=True), note(2, 7, hammer=True), None, note(2, 9))),
        [(0.0, "dead", 2, 5), (0.5, "pluck", 2, 7), (1.5, "pluck", 2, 9)],
    ),
}  # fmt: skip


def in_zip(gpif: bytes) -> bytes:
    return zip_files({"Content/score.gpif": gpif})


@pytest.mark.parametrize("kind", WRITERS)
@pytest.mark.parametrize("song", SONGS)
def test_a_song_is_played_as_it_is_written(song: str, kind: str) -> None:
    piece, expected = SONGS[song]
    strokes = play(parse(WRITERS[kind](piece))).strokes
    assert [(s.kind, s.string, s.fret) for s in strokes] == [row[1:] for row in expected]
    assert [s.time for s in strokes] == pytest.approx([row[0] for row in expected], abs=1e-3)


# Lengths of a note and of the strokes of its tremolo, quarter notes -> the number of its strokes
TREMOLOS = [
    (F(1), F(1, 4), 4), (F(1, 2), F(1, 4), 2), (F(3, 2), F(1, 4), 6), (F(3, 4), F(1, 8), 6), (F(1, 3), F(1, 4), 2),
    (F(4, 3), F(1, 2), 4), (F(2, 3), F(1, 8), 8), (F(3), F(1, 2), 6), (F(1, 4), F(1, 8), 2),
]  # fmt: skip


@pytest.mark.parametrize("kind", ["gp4", "gp5", "gpx", "gp", "musicxml"])
def test_the_strokes_of_a_tremolo_fill_their_note_evenly(kind: str) -> None:
    for length, step, count in TREMOLOS:
        for more in ({}, {"let_ring": True}):
            rest = Beat(length, min(length, 4 - length), [])
            piece = tab([Beat(F(0), length, [note(1, 7, tremolo=step, **more)]), rest], bpm=60)
            data = ALL[kind](piece)
            if kind == "musicxml":  # its strokes go by the written note
                written = {F(1, 2): 1, F(3, 4): 1, F(1, 3): 1, F(1, 4): 2}.get(length, 0)
                value = f"<type>{('quarter', 'eighth', '16th')[written]}</type></note>".encode()
                marks = b'<tremolo type="single">%d'
                slashes = (1 / step).numerator.bit_length() - 1
                data = data.replace(b"</note>", value).replace(marks % slashes, marks % (slashes - written))
            strokes = play(parse(data)).strokes
            assert [(s.kind, s.fret) for s in strokes] == [("pluck", 7)] * count, length
            assert [s.time for s in strokes] == pytest.approx([float(length * k / count) for k in range(count)])
            assert strokes[-1].end == pytest.approx(4 if more else float(length))


def test_a_tremolo_swings_slides_touches_and_fades_as_one_note() -> None:
    fading = [Beat(F(0), F(1), [note(1, 12, tremolo=F(1, 2), harmonic=NATURAL, node=12.0)], signs=("volume swell",))]
    one, two = play(tab(fading, bpm=60)).strokes
    assert (two.kind, two.fret, two.partial) == ("harmonic", 0, 2)
    assert one.fade == two.fade == ((0.0, 0.0), (0.5, 1.0), (1.0, 0.0))
    swung = tab(beats(note(0, 3), note(0, 5, tremolo=F(1, 4)), length=F(1, 2)), bpm=60)
    swung.bars[0].swing = F(1), F(2, 3)
    assert [s.time for s in play(swung).strokes] == pytest.approx([0, 2 / 3, 5 / 6])
    slid = play(tab(beats(note(1, 5, slides=SLIDING), note(1, 7, tremolo=F(1, 2))), bpm=60)).strokes
    assert [(s.kind, s.time) for s in slid[1:]] == [("slide", 0.75), ("pluck", 1.5)]


@pytest.mark.parametrize("kind", WRITERS)
def test_notes_ring_on_to_the_next_turn_of_a_repeat(kind: str) -> None:
    piece = repeat(tab(beats(note(2, 5, let_ring=True), note(0, 3), note(0, 3))))
    ringing = [s for s in play(parse(WRITERS[kind](piece))).strokes if s.string == 2]
    assert [(s.time, s.end) for s in ringing] == [(0.0, 2.0), (2.0, 4.0)]


@pytest.mark.parametrize("kind", ["gp5", "gp"])
def test_a_bend_is_released_on_a_tied_note(kind: str) -> None:
    piece = tab(beats(note(2, 5, bend=RISE), note(2, 5, tie=True, bend=FALL), note(2, 5)))
    bent, straight = play(parse(WRITERS[kind](piece))).strokes
    assert bent.end == 1.0 and bent.bend == ((0.0, 0.0), (0.5, 2.0), (0.5, 2.0), (1.0, 0.0)) and not straight.bend


@pytest.mark.parametrize("kind", WRITERS)
def test_each_turn_of_a_repeat_has_its_own_tempo(kind: str) -> None:
    piece = tab(*(beats(*[note(0, fret)] * 4) for fret in range(3)))
    piece.bars[2].tempos.append(Tempo(F(0), 60.0))
    times = [s.time for s in play(parse(WRITERS[kind](repeat(piece, 1)))).strokes]
    assert times[::4] == pytest.approx([0, 2, 4, 8, 10])


def test_an_upbeat_is_as_long_as_its_notes() -> None:
    piece = tab(beats(note(0, 3)), beats(note(0, 5)))
    upbeats = {
        "gp": in_zip(as_gpif(piece).replace(b"<MasterTrack>", b"<MasterTrack><Anacrusis/>")),
        "musicxml": as_musicxml(piece).replace(b'number="1"', b'number="0" implicit="yes"', 1),
    }
    for data in upbeats.values():
        assert [s.time for s in play(parse(data)).strokes] == [0.0, 0.5]


@pytest.mark.parametrize("kind", ["gp", "musicxml"])
def test_a_note_is_hammered_on_from_another_string(kind: str) -> None:
    piece = tab(beats(note(1, 5, hammer=True), note(2, 7), note(2, 7)))
    data = as_musicxml(piece) if kind == "musicxml" else as_gpif(piece)
    marks = {
        "gp": (b'name="Fret"><Fret>7', b'name="HopoDestination"><Enable/></Property><Property name="Fret"><Fret>7'),
        "musicxml": (b"<fret>7</fret>", b'<fret>7</fret><hammer-on type="stop"/>'),
    }
    data = data.replace(*marks[kind], 1)
    strokes = play(parse(data if kind == "musicxml" else in_zip(data))).strokes
    assert [(s.kind, s.string) for s in strokes] == [("pluck", 1), ("tap", 2), ("pluck", 2)]


def test_similes_repeat_one_bar_or_two() -> None:
    piece = tab(*(beats(note(0, fret)) for fret in range(5)))
    words = as_gpif(piece)
    for number, mark in ((2, b"FirstOfDouble"), (3, b"SecondOfDouble"), (4, b"Simple")):
        bar = f'<Bar id="{number}">'.encode()
        assert bar in words
        words = words.replace(bar, bar + b"<SimileMark>" + mark + b"</SimileMark>")
    strokes = play(parse(in_zip(words))).strokes
    assert [s.fret for s in strokes] == [0, 1, 0, 1, 1]


@pytest.mark.parametrize("kind", ["gp5", "gp"])
def test_triplets_stay_even_in_a_swung_bar(kind: str) -> None:
    lengths = F(1, 2), F(1, 2), F(1, 3), F(1, 3), F(1, 3), F(2)
    piece = tab([Beat(sum(lengths[:k], F(0)), length, [note(0, k)]) for k, length in enumerate(lengths)])
    piece.bars[0].swing = F(1), F(2, 3)
    times = [stroke.time for stroke in play(parse(WRITERS[kind](piece))).strokes]
    assert times == pytest.approx([0, 1 / 3, 1 / 2, 2 / 3, 5 / 6, 1], abs=1e-3)


def in_musicxml(*measures: str, time: str = "4/4") -> Performance:
    """The performance of a bass on two staves, the upper one without tablature; two divisions in a quarter note."""
    beats, unit = time.split("/")
    first = f"<attributes><divisions>2</divisions><time><beats>{beats}</beats><beat-type>{unit}</beat-type></time>"
    first += (
        f'<staves>2</staves><staff-details number="2"><staff-lines>4</staff-lines>{TUNING}</staff-details></attributes>'
    )
    bars = "".join(f"<measure>{first * (k == 0)}{each}</measure>" for k, each in enumerate(measures))
    return play(parse(f"{HEAD}{bars}</part></score-partwise>".encode()))


def low(fret: int, length: int, more: str = "") -> str:
    """A note on the lowest string."""
    place = f"<notations><technical><string>4</string><fret>{fret}</fret>{more}</technical></notations>"
    pitch = "<pitch><step>G</step><octave>1</octave></pitch>"
    return f"<note>{pitch}<duration>{length}</duration><voice>5</voice><staff>2</staff>{place}</note>"


def test_musicxml_that_only_shows_its_tempo_and_its_jumps_is_played_so() -> None:
    upper = low(3, 6).replace("<notations>", "<!--").replace("</notations>", "-->").replace("<staff>2", "<staff>1")
    upper = upper.replace("<voice>5", "<voice>1") + "<backup><duration>6</duration></backup>"
    mark = "<metronome><beat-unit>quarter</beat-unit><beat-unit-dot/><per-minute>60</per-minute></metronome>"
    measures = [
        direction(mark) + upper + low(3, 3) + low(5, 3) + direction("<words>To Coda</words>"),
        direction("<words>D.C. al Coda</words>") + low(7, 6), direction("<coda/>") + low(9, 6),
    ]  # fmt: skip
    strokes = in_musicxml(*measures, time="6/8").strokes
    assert [(round(s.time, 3), s.fret) for s in strokes] == [(0, 3), (1, 5), (2, 7), (4, 3), (5, 5), (6, 9)]


def test_a_jump_in_sound_and_in_words_is_one_jump() -> None:
    words = '<direction><sound dacapo="yes"/></direction>' + direction("<words>D.C. al Fine</words>")
    performance = in_musicxml(low(3, 8) + direction("<words>Fine</words>"), low(5, 8) + words)
    assert [number for _, number in performance.bars] == [0, 1, 0]


@pytest.mark.parametrize(("mark", "played"), [("", [0, 0, 1, 0, 1]), ('after-jump="yes"', [0, 0, 1, 0, 0, 1])])
def test_a_repeat_is_played_again_after_a_jump_if_it_says_so(mark: str, played: list[int]) -> None:
    close = f'<barline location="right"><repeat direction="backward" {mark}/></barline>'
    performance = in_musicxml(low(3, 8) + close, low(5, 8) + '<sound dacapo="yes"/>')
    assert [number for _, number in performance.bars] == played


def test_a_note_for_some_passes_sounds_only_in_them() -> None:
    note = low(3, 8).replace("<note>", '<note time-only="2, 3">')
    close = '<barline location="right"><repeat direction="backward" times="4"/></barline>'
    strokes = in_musicxml(note + close, low(5, 8)).strokes
    assert [(round(s.time, 3), s.fret) for s in strokes] == [(2, 3), (4, 3), (8, 5)]


def test_musicxml_swings_and_bends_by_steps() -> None:
    swing = "<swing><first>2</first><second>1</second><swing-type>eighth</swing-type></swing>"
    bend = "<bend><bend-alter>{}</bend-alter><{}/></bend>"
    steps = bend.format(-2, "pre-bend") + bend.format(-2, "release")
    up = "<bend><bend-alter>1</bend-alter></bend>"
    strokes = in_musicxml(
        f"<direction><sound>{swing}</sound></direction>" + low(3, 1) * 2 + low(3, 1) * 2 + low(3, 4, steps),
        low(3, 8, up + up),
    ).strokes
    assert [s.time for s in strokes] == pytest.approx([0, 1 / 3, 1 / 2, 5 / 6, 1, 2])
    assert strokes[4].bend == ((1.0, 2.0), (1.5, 2.0), (1.5, 2.0), (2.0, 0.0))
    assert strokes[5].bend == ((2.0, 0.0), (3.0, 1.0), (3.0, 1.0), (4.0, 2.0))


def metronome(content: str) -> str:
    return direction(f"<metronome>{content}</metronome>")


LAST = '<tie type="stop"/>'
OPENED = '<barline location="left"><repeat direction="forward"/></barline>'
AGAIN = '<barline location="right"><repeat direction="backward"/></barline>'
HALF, QUARTER = "<beat-unit>half</beat-unit>", "<beat-unit>quarter</beat-unit>"
ENDING = '<barline location="left"><ending number="{}" type="start"/></barline>'
STOP = '<barline location="right"><ending number="{}" type="stop"/>{}</barline>'
BACK = '<repeat direction="backward"/>'
SIGNATURE = "<attributes><time><beats>4</beats><beat-type>4</beat-type></time></attributes>"
JUMP = '<direction><sound {}="a"/></direction>'
GRACE = "<note><grace/><pitch><step>C</step><octave>2</octave></pitch><type>eighth</type></note>"
# What programs write beyond tablature -> (s, string, fret) of each stroke
WRITTEN: dict[str, tuple[str, list[tuple[float, int, int]]]] = {
    "a fifth string for low pitches": (scored(plain("D", 1, 8) + ""), [(0, 0, 3)]),
    "a chord on strings of its own": (
        scored(plain("G", 2, 4) + plain("B", 2, 4, "<chord/>")), [(0, 2, 5), (0, 3, 4)],
    ),
    "a bass an octave lower than written": (
        scored(plain("E", 2, 8), attributes="<transpose><octave-change>-1</octave-change></transpose>"), [(0, 0, 0)],
    ),
    "notes without a voice, after a backup": (
        scored(plain("G", 2, 4) + "<backup><duration>4</duration></backup>" + plain("E", 1, 4) + plain("F", 1, 4)),
        [(0, 0, 0), (0, 3, 0), (1, 0, 1)],
    ),
    "divisions that change in the middle": (
        scored(plain("G", 2, 2) + "<attributes><divisions>4</divisions></attributes>" + plain("G", 2, 2)
               + plain("A", 2, 10)),
        [(0, 3, 0), (0.5, 3, 0), (0.75, 3, 2)],
    ),
    "a bar of two signatures": (
        scored(plain("G", 2, 4), plain("A", 2, 2), attributes="<time><beats>1</beats><beat-type>4</beat-type><beats>2"
               "</beats><beat-type>8</beat-type></time>"),
        [(0, 3, 0), (1, 3, 2)],
    ),
    "cues are silent": (scored(plain("G", 2, 4, "<cue/>") + plain("A", 2, 4)), [(1, 3, 2)]),
    "a grace note on another string": (scored(plain("G", 2, 4) + GRACE + plain("A", 2, 4)), [
        (0, 3, 0), (0.875, 1, 3), (1, 3, 2)]),
    "an ending for three passes": (
        scored(plain("G", 2, 8), ENDING.format("1.-3.") + plain("A", 2, 8) + STOP.format("1.-3.", BACK),
               ENDING.format("4") + plain("B", 2, 8) + STOP.format("4", "")),
        [(4.0 * k + at, 3, fret) for k in range(4) for at, fret in ((0, 0), (2, 2 if k < 3 else 4))],
    ),
    "a dal segno that only sounds goes to the coda": (
        scored(plain("G", 2, 8) + JUMP.format("tocoda"), plain("A", 2, 8) + JUMP.format("dacapo"),
               JUMP.format("coda") + plain("B", 2, 8)),
        [(0, 3, 0), (2, 3, 2), (4, 3, 0), (6, 3, 4)],
    ),
    "a bar that is repeated by its sign": (
        scored(plain("G", 2, 8), "<attributes><measure-style><measure-repeat type='start'>1</measure-repeat>"
               "</measure-style></attributes><note><rest measure='yes'/><duration>8</duration></note>"),
        [(0, 3, 0), (2, 3, 0)],
    ),
    "a fermata": (
        scored(plain("G", 2, 4).replace("</note>", "<notations><fermata/></notations></note>") + plain("A", 2, 4)),
        [(0, 3, 0), (2, 3, 2)],
    ),
    "a tempo of another part, later than its place": (
        scored(plain("G", 2, 4) + plain("A", 2, 4)).replace(
            "</score-partwise>", "<part id='Q'><measure><direction><direction-type/><offset sound='yes'>2"
            "</offset><sound tempo='60'/></direction></measure></part></score-partwise>"),
        [(0, 3, 0), (1.5, 3, 2)],
    ),
    "divisions in another part only": (
        scored(plain("G", 2, 4) + plain("A", 2, 4)).replace("<divisions>2</divisions>", "").replace("</score-partwise>",
               "<part id='V'><measure><attributes><divisions>4</divisions></attributes></measure></part>"
               "</score-partwise>"),
        [(0, 3, 0), (0.5, 3, 2)],
    ),
    "a repeat from the middle of a bar": (
        scored(plain("G", 2, 4), OPENED + plain("A", 2, 4), plain("B", 2, 8) + AGAIN).replace(
            "<measure>" + OPENED, '<measure number="X1" implicit="yes">' + OPENED),
        [(0, 3, 0), (1, 3, 2), (2, 3, 4), (4, 3, 2), (5, 3, 4)],
    ),
    "an upbeat completes the last bar of a repeat": (
        scored(plain("G", 2, 2), plain("A", 2, 8), plain("B", 2, 6) + AGAIN).replace(
            "<measure>", '<measure implicit="yes">', 1),
        [(t + at, 3, fret) for t in (0, 4) for at, fret in ((0, 0), (0.5, 2), (2.5, 4))],
    ),
    "half = quarter, then quarter = dotted half": (
        scored(plain("G", 2, 2) + metronome(f"{HALF}{QUARTER}") + plain("A", 2, 2),
               metronome(f"{QUARTER}{HALF}<beat-unit-dot/>") + plain("G", 2, 2) + plain("A", 2, 2)),
        [(0, 3, 0), (0.5, 3, 2), (3.5, 3, 0), (3.833, 3, 2)],
    ),
    "half = ca. 30": (
        scored(metronome(f"{HALF}<per-minute>ca. 30</per-minute>") + plain("G", 2, 2) + plain("A", 2, 2)),
        [(0, 3, 0), (1, 3, 2)],
    ),
    "music by time": (
        scored(plain("G", 2, 8)).replace("score-partwise", "score-timewise").replace('<part id="P"><measure>',
               '<measure><part id="P">').replace("</measure></part>", "</part></measure>"),
        [(0, 3, 0)],
    ),
    "an upbeat that is not marked": (
        scored(plain("G", 2, 2), plain("A", 2, 8), plain("B", 2, 8)), [(0, 3, 0), (0.5, 3, 2), (2.5, 3, 4)],
    ),
    "a first bar that another part fills": (
        scored(plain("G", 2, 2), plain("A", 2, 8)).replace(
            "</score-partwise>", "<part id='Q'><measure>" + plain("G", 4, 8) + "</measure></part></score-partwise>"),
        [(0, 3, 0), (2, 3, 2)],
    ),
    "an empty first bar": (scored("", plain("A", 2, 2), plain("B", 2, 8)), [(2, 3, 2), (4, 3, 4)]),
    "a signature for each staff": (
        scored(plain("G", 2, 6), plain("A", 2, 6), attributes="".join(f"<time number='{n}'><beats>3</beats><beat-type>4"
               "</beat-type></time>" for n in (1, 2))),
        [(0, 3, 0), (1.5, 3, 2)],
    ),
    "bars without a signature": (
        scored(plain("G", 2, 8), "<attributes><time><senza-misura/></time></attributes>" + plain("A", 2, 2),
               plain("B", 2, 2) + plain("A", 2, 4),
               SIGNATURE + plain("B", 2, 4) + "<forward><duration>4</duration></forward>", plain("A", 2, 4)),
        [(0, 3, 0), (2, 3, 2), (2.5, 3, 4), (3, 3, 2), (4, 3, 4), (6, 3, 2)],
    ),
    "notes without a duration": (
        scored(*(plain("G", 2, 0).replace("<duration>0</duration>", f"<type>{kind}</type>") + plain("A", 2, 2)
                 for kind in ("half", "quarter</type><dot/><type>", "eighth</type><time-modification><actual-notes>3"
                              "</actual-notes><normal-notes>2</normal-notes></time-modification><type>"))),
        [(0, 3, 0), (1, 3, 2), (2, 3, 0), (2.75, 3, 2), (4, 3, 0), (4.167, 3, 2)],
    ),
    **{f"a repeat with the words {words}": (
        scored(OPENED + plain("G", 2, 8) + direction("<words>4x</words>") * (words == "before"),
               plain("A", 2, 8) + direction(f"<words>{words}</words>") * (words != "before") + AGAIN, plain("B", 2, 8)),
        [(4 * k + at, 3, fret) for k in range(4) for at, fret in ((0, 0), (2, 2))] + [(16, 3, 4)],
    ) for words in ("4x", "x4", "(Play 4 times)", "4 \u00d7", "before")},
    "words after a repeat": (
        scored(plain("G", 2, 8) + AGAIN, plain("A", 2, 8) + direction("<words>4x</words>")), [
            (0, 3, 0), (2, 3, 0), (4, 3, 2)],
    ),
    **{f"a tempo in words, {words}": (
        scored(direction(f"<words>{words}</words>") + plain("G", 2, 4) + plain("A", 2, 4)), [(0, 3, 0), (2, 3, 2)],
    ) for words in ("\u2669 = 60", "Slowly (q=60)", "60 BPM", "Tempo: 60")},
    "words that tell no tempo": (
        scored(direction("<words>Dotted quarter = 60, freq = 60</words>") + plain("G", 2, 4) + plain("A", 2, 4)),
        [(0, 3, 0), (1, 3, 2)],
    ),
    "a namespace": (
        scored(plain("G", 2, 8)).replace("<score-partwise", '<score-partwise xmlns="urn:example"', 1), [(0, 3, 0)],
    ),
    "UTF-8 that claims to be UTF-16": (
        "<?xml version='1.0' encoding='UTF-16'?>" + scored(plain("G", 2, 8)), [(0, 3, 0)],
    ),
}  # fmt: skip


@pytest.mark.parametrize("case", WRITTEN)
def test_musicxml_without_tablature_is_played(case: str) -> None:
    text, expected = WRITTEN[case]
    strokes = play(parse(text.encode())).strokes
    assert [(round(s.time, 3), s.string, s.fret) for s in strokes] == expected


@pytest.mark.parametrize(("sound", "preset"), [("pluck.bass.electric", "yes"), ("pluck.guitar", None)])
def test_a_sound_tells_a_bass_without_a_name(sound: str, preset: str | None) -> None:
    about = f"<score-instrument><instrument-sound>{sound}</instrument-sound></score-instrument></score-part>"
    text = scored(plain("G", 2, 8)).replace("Bass", "Part 1").replace("</score-part>", about, 1)
    if preset:
        assert table(text.encode(), Path("a.xml"), TabRequest())[1][-1] == "yes"
    else:
        with pytest.raises(ScoreError, match="no track is tuned like a bass"):
            table(text.encode(), Path("a.xml"), TabRequest())


def test_tablature_in_musicxml_has_slurs_ties_and_notes_without_strings() -> None:
    slur = '</technical><slur type="{}"/><technical>'
    slurred = low(3, 1, slur.format("start")) + low(5, 1) + low(7, 1, slur.format("stop")) + low(7, 1)
    bare = low(3, 2).split("<notations>")[0] + "</note>"
    tied = low(3, 2) + bare.replace("<duration>", f"{LAST}<duration>")
    strokes = in_musicxml(slurred + tied).strokes
    kinds = [(s.kind, s.fret) for s in strokes]
    assert kinds == [("pluck", 3), ("hammer", 5), ("hammer", 7), ("pluck", 7), ("pluck", 3)]
    assert strokes[-1].end == 2.0


@pytest.mark.parametrize("line", ["dashes", "bracket"])
@pytest.mark.parametrize("words", ["P.M.", "PM", "p. m.", "palm mute", "Palm Muting", "let ring"])
def test_lines_of_a_technique_hold_for_the_notes_under_them(words: str, line: str) -> None:
    """Over a bar line, too; words without a line hold for their beat."""
    begins = f'<words>{words}</words></direction-type><direction-type><{line} number="2" type="start"/>'
    other = f'<words>cresc.</words></direction-type><direction-type><{line} number="1" type="start"/>'
    ends = direction(f'<{line} number="2" type="stop"/>')
    brief = [low(fret, 1) + "<forward><duration>1</duration></forward>" for fret in (3, 5, 7, 8)]
    strokes = in_musicxml(
        brief[0] + direction(begins) + brief[1] + direction(other) + brief[2] + brief[3],
        brief[0] + ends + brief[1] + direction(f"<words>{words}</words>") + brief[2] + brief[3],
    ).strokes
    held = [s.end - s.time > 0.3 if words == "let ring" else s.palm for s in strokes]
    assert held == [False, True, True, True, True, False, True, False]


def test_the_wavy_line_of_a_trill_is_not_a_vibrato() -> None:
    trill = '</technical><ornaments><trill-mark/><wavy-line type="start"/></ornaments><technical>'
    strokes = in_musicxml(low(3, 2, trill) + low(5, 6)).strokes
    assert {s.vibrato for s in strokes} == {0.0} and [s.fret for s in strokes[:2]] == [3, 5]


def test_a_tremolo_without_a_speed_is_fast_and_one_between_notes_is_counted() -> None:
    kinds = '<tremolo type="unmeasured">0</tremolo>', '<tremolo type="start">3</tremolo>'
    ornaments = [f"</technical><ornaments>{kind}</ornaments><technical>" for kind in kinds]
    performance = in_musicxml(low(3, 2, ornaments[0]) + low(5, 6, ornaments[1]))
    assert [s.fret for s in performance.strokes] == [3] * 8 + [5]
    assert performance.lacks == {"two-note tremolo": 1}


def test_a_piano_beside_a_bass_without_tablature_does_not_play() -> None:
    piano = scored(plain("G", 4, 1) * 8).replace("Bass", "Piano")
    bass = "<part id='Q'><measure>" + plain("G", 1, 8) + "</measure></part></score-partwise>"
    name = "<score-part id='Q'><part-name>Electric Bass</part-name></score-part></part-list>"
    text = piano.replace("</score-partwise>", bass).replace("</part-list>", name)
    rows = table(text.encode(), Path("a.xml"), TabRequest())
    assert [row[-1] for row in rows] == ["played", "no", "yes"]


@pytest.mark.parametrize("named, fret", [("music/b.xml", 4), ("c.xml", 2), ("", 2)])
def test_the_container_names_the_score(named: str, fret: int) -> None:
    files = "".join(f'<rootfile full-path="{name}"/>' for name in ("music/b.pdf", named) if named)
    container = f"<container><rootfiles>{files}</rootfiles></container>".encode()
    first, second = (scored(plain(step, 2, 8)).encode() for step in "AB")
    data = zip_files(
        {"music/b.pdf": b"%PDF-", "a.xml": first, "music/b.xml": second, "META-INF/container.xml": container}
    )
    assert [stroke.fret for stroke in play(parse(data)).strokes] == [fret]


def test_fermatas_of_guitar_pro_hold_the_shortest_note() -> None:
    piece = tab(beats(note(0, 3), note(0, 5), note(0, 7)))
    sign = b"<Fermatas><Fermata><Type>Medium</Type><Offset>1/1</Offset><Length>0.5</Length></Fermata></Fermatas>"
    data = in_zip(as_gpif(piece).replace(b"<MasterBar>", b"<MasterBar>" + sign))
    performance = play(parse(data))
    assert [s.time for s in performance.strokes] == pytest.approx([0, 0.5, 1.5]) and not performance.lacks


@pytest.mark.parametrize("name, low", [("Bass", 28), ("Guitar", 40)])
def test_a_bass_tuned_as_it_is_written_sounds_an_octave_lower(name: str, low: int) -> None:
    text = scored(plain("G", 2, 4), attributes=f"<staff-details>{HIGH}</staff-details>").replace("Bass", name)
    piece = parse(text.encode())
    assert piece.tracks[0].tuning[0] == low and [(s.string, s.fret) for s in play(piece).strokes] == [(0, 3)]


@pytest.mark.parametrize("kind", ["gp5", "gp"])
@pytest.mark.parametrize(
    ("tuning", "name", "program", "low"),
    [((40, 45, 50, 55), "x", 33, 28), ((40, 45, 50, 55, 59, 64), "Bass", 0, 28), ((40, 45, 50, 55), "Uke", 0, 40),
     ((40, 45, 50, 55, 59, 64), "Bass", 30, 40),
     ((33, 38, 43, 48), "Bass", 33, 33)],
)  # fmt: skip
def test_a_bass_of_guitar_pro_may_be_tuned_as_it_is_written(
    tuning: tuple[int, ...], name: str, program: int, low: int, kind: str
) -> None:
    piece = tab(beats(note(0, 3)), tuning=tuning, name=name, program=program)
    (track,) = parse(WRITERS[kind](piece)).tracks
    assert [note - low for note in track.tuning] == [note - tuning[0] for note in tuning]


def test_a_partial_capo_is_counted() -> None:
    capo = b'<Property name="PartialCapoFret"><Fret>2</Fret></Property><Property name="CapoFret">'
    data = in_zip(as_gpif(tab(beats(note(0, 3)))).replace(b'<Property name="CapoFret">', capo))
    assert play(parse(data)).lacks == {"partial capo": 1}


def test_a_grace_note_of_guitar_pro_plays_on_another_string() -> None:
    words = as_gpif(tab(beats(None, note(2, 5, graces=[Grace(4, F(1, 8))]))))
    data = in_zip(words.replace(b"<String>2</String>", b"<String>1</String>", 1))
    assert [(s.time, s.string) for s in play(parse(data)).strokes] == [(0.4375, 1), (0.5, 2)]


def test_a_repeat_within_a_gradual_change_begins_at_its_tempo() -> None:
    piece = repeat(tab(*(beats(*[note(0, 3)] * 4) for _ in range(3)), bpm=120.0), 1, 1)
    piece.bars[0].tempos.append(Tempo(F(0), 60.0, F(8)))
    times = [s.time for s in play(piece).strokes]
    assert times[12] - times[8] == pytest.approx(times[8] - times[4], abs=0.01), "from 90 to 60, both times"


@pytest.mark.parametrize("kind", ["gp", "musicxml"])
def test_grace_notes_are_hammered_on_one_after_the_other(kind: str) -> None:
    graces = [Grace(fret, F(1, 8), joined="hammer") for fret in (2, 4)]
    strokes = play(parse(ALL[kind](tab(beats(None, note(2, 3, graces=graces)))))).strokes
    assert [(s.time, s.kind) for s in strokes] == [(0.375, "pluck"), (0.4375, "hammer"), (0.5, "pull")]


@pytest.mark.parametrize("kind, node", [(15, 4), (17, 3), (22, 2)])
def test_artificial_harmonics_of_guitar_pro_4_have_their_partial(kind: int, node: int) -> None:
    data = as_gp5(tab(beats(note(3, 5, harmonic=ARTIFICIAL, node=12.0))), (4, 0, 6))
    at = data.rindex(bytes([22]))
    (stroke,) = play(parse(data[:at] + bytes([kind]) + data[at + 1 :])).strokes
    assert (stroke.kind, stroke.fret, stroke.partial) == ("harmonic", 5, node)
