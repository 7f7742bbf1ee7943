"""Each notation in each format: time, string, fret and kind of its strokes, without sound."""

from __future__ import annotations

from fractions import Fraction as F
from itertools import pairwise, product

import pytest
from support.tabs import WRITERS, as_gp, beats, note, play, tab

from livebass.files.kinds import is_tab
from livebass.tab.model import ARTIFICIAL, IN_BELOW, LEGATO, NATURAL, OUT_DOWN, SHIFT, Beat, Grace, Tab, Tempo
from livebass.tab.perform import Stroke, partial_at, perform
from livebass.tab.reading import parse

Row = tuple[float, str, int, int]  # s, kind, string, fret
XML = {"musicxml", "mxl"}
A_FRET = 0.022  # s of a slide over a fret
# Notations: beats of a quarter (0.5 s), and what they play
NOTATIONS: dict[str, tuple[Tab, list[Row]]] = {
    "plain": (
        tab(beats(note(0, 3), None, note(3, 12), [note(1, 2), note(2, 4)])),
        [(0.0, "pluck", 0, 3), (1.0, "pluck", 3, 12), (1.5, "pluck", 1, 2), (1.5, "pluck", 2, 4)],
    ),
    "hammer-on and pull-off": (
        tab(beats(note(0, 3, hammer=True), note(0, 5, hammer=True), note(0, 3), note(0, 3))),
        [(0.0, "pluck", 0, 3), (0.5, "hammer", 0, 5), (1.0, "pull", 0, 3), (1.5, "pluck", 0, 3)],
    ),
    "legato slide arrives on its beat": (
        tab(beats(note(1, 2, slides=frozenset([LEGATO])), note(1, 7))),
        [(0.0, "pluck", 1, 2), (0.375, "slide", 1, 7)],
    ),
    "far slide": (
        tab(beats(note(1, 2, slides=frozenset([LEGATO])), note(1, 9))),
        [(0.0, "pluck", 1, 2), (0.5 - 7 * A_FRET, "slide", 1, 9)],
    ),
    "shift slide ends with a stroke": (
        tab(beats(note(1, 7, slides=frozenset([SHIFT])), note(1, 5))),
        [(0.0, "pluck", 1, 7), (0.375, "slide", 1, 5), (0.5, "pluck", 1, 5)],
    ),
    "slide in": (
        tab(beats(None, note(1, 7, slides=frozenset([IN_BELOW])))),
        [(0.5, "pluck", 1, 4), (0.52, "slide", 1, 7)],
    ),
    "slide out": (
        tab(beats(note(1, 9, slides=frozenset([OUT_DOWN])))),
        [(0.0, "pluck", 1, 9), (0.5 - 5 * A_FRET, "slide off down", 1, 4)],
    ),
    "tie": (
        tab(beats(note(0, 3), note(0, 3, tie=True), None, note(0, 3))),
        [(0.0, "pluck", 0, 3), (1.5, "pluck", 0, 3)],
    ),
    "tie over a bar line": (
        tab(beats(None, None, None, note(0, 3)), beats(note(0, 3, tie=True), note(0, 3))),
        [(1.5, "pluck", 0, 3), (2.5, "pluck", 0, 3)],
    ),
    "dead and tapped notes": (
        tab(beats(note(0, 3, dead=True), note(2, 12, technique="tap"))),
        [(0.0, "dead", 0, 3), (0.5, "tap", 2, 12)],
    ),
    "slap and pop on any string": (
        tab(beats(note(0, 3, technique="slap"), note(3, 5, technique="slap"), note(0, 7, technique="pop"))),
        [(0.0, "slap", 0, 3), (0.5, "slap", 3, 5), (1.0, "pop", 0, 7)],
    ),
    "trill": (
        tab(beats(note(2, 5, trill=(7, F(1, 4))))),
        [(0.0, "pluck", 2, 5), (0.125, "hammer", 2, 7), (0.25, "pull", 2, 5), (0.375, "hammer", 2, 7)],
    ),
    "tremolo": (
        tab(beats(note(2, 5, tremolo=F(1, 2)))),
        [(0.0, "pluck", 2, 5), (0.25, "pluck", 2, 5)],
    ),
    "grace note before the beat": (
        tab(beats(None, note(2, 5, graces=[Grace(4, F(1, 8), joined="hammer")]))),
        [(0.4375, "pluck", 2, 4), (0.5, "hammer", 2, 5)],
    ),
    "grace note at the very beginning": (
        tab(beats(note(2, 5, graces=[Grace(4, F(1, 8), joined="slide")]))),
        [(0.0, "pluck", 2, 4), (0.0625, "slide", 2, 5)],
    ),
    "dead grace note on the beat": (
        tab(beats(None, note(2, 5, graces=[Grace(4, F(1, 8), dead=True, on_beat=True)]))),
        [(0.5, "dead", 2, 4), (0.5625, "pluck", 2, 5)],
    ),
    "natural harmonics": (
        tab(beats(note(3, 12, harmonic=NATURAL, node=12.0), note(3, 7, harmonic=NATURAL, node=7.0))),
        [(0.0, "harmonic", 3, 0), (0.5, "harmonic", 3, 0)],
    ),
    "artificial harmonic": (
        tab(beats(note(3, 5, harmonic=ARTIFICIAL, node=12.0))),
        [(0.0, "harmonic", 3, 5)],
    ),
    "brush": (
        tab([Beat(F(0), F(1), [note(0, 3), note(1, 5), note(2, 5)], brush=F(1, 8))]),
        [(0.0, "pluck", 0, 3), (0.03125, "pluck", 1, 5), (0.0625, "pluck", 2, 5)],
    ),
    "dotted notes and triplets": (
        tab([Beat(at, length, [note(0, fret)]) for fret, (at, length) in enumerate([
            (F(0), F(3, 2)), (F(3, 2), F(1, 2)), (F(2), F(1, 3)), (F(7, 3), F(1, 3)), (F(8, 3), F(1, 3)), (F(3), F(1)),
        ])]),
        [(at / 2, "pluck", 0, fret) for fret, at in enumerate([0, 1.5, 2, 7 / 3, 8 / 3, 3])],
    ),
}  # fmt: skip
LACKING = {  # what formats cannot say
    "gp3": {
        "legato slide arrives on its beat", "far slide", "slide in", "slide out", "trill", "tremolo",
        "dead grace note on the beat",
    },
    "gp4": {"dead grace note on the beat"},
}  # fmt: skip


def swelling(*rows: tuple[int, str]) -> Tab:
    """Quarter notes of these velocities under these hairpins, and two bars with a rest before the last note."""
    first = beats(*[note(0, 3, velocity=velocity) for velocity, _ in rows])
    for beat, (_, hairpin) in zip(first, rows, strict=True):
        beat.hairpin = hairpin
    return tab(first, beats(None, note(0, 5, velocity=rows[-1][0])))


@pytest.mark.parametrize("kind", ["gpx", "gp", "musicxml"])
def test_a_hairpin_leads_evenly_to_the_next_dynamic(kind: str) -> None:
    swell, fall = "crescendo", "diminuendo"
    for rows, heard in [
        ([(47, swell), (47, swell), (79, ""), (79, "")], [47, 63, 79, 79, 79]),
        ([(95, fall), (95, fall), (95, fall), (47, "")], [95, 79, 63, 47, 47]),
        ([(63, swell), (63, swell), (63, ""), (63, "")], [63, 71, 63, 63, 63]),  # no dynamic: a mark louder
        ([(95, fall), (63, fall), (63, fall), (31, "")], [95, 63, 47, 31, 31]),  # a dynamic on the way
        ([(127, swell), (127, swell), (127, swell), (127, swell)], [127] * 5),
    ]:
        strokes = play(parse(WRITERS[kind](swelling(*rows)))).strokes
        assert [stroke.velocity for stroke in strokes] == heard, rows


def test_a_hairpin_lasts_over_rests_and_bars() -> None:
    piece = tab(beats(note(0, 3, velocity=15), None, None, note(0, 3, velocity=15)), beats(note(0, 3, velocity=79)))
    for beat in piece.tracks[0].bars[0][0]:
        beat.hairpin = "crescendo"
    assert [stroke.velocity for stroke in play(parse(as_gp(piece))).strokes] == [15, 63, 79]


@pytest.mark.parametrize("kind", ["gp", "musicxml"])
@pytest.mark.parametrize(
    "ornament, fret, fifths, frets",
    [
        ("mordent", 5, 0, [5, 3, 5]), ("mordent", 5, 2, [5, 4, 5]), ("mordent", 7, 0, [7, 5, 7]),
        ("inverted mordent", 7, 0, [7, 8, 7]), ("inverted mordent", 7, 2, [7, 9, 7]),
        ("turn", 7, 0, [8, 7, 5, 7]), ("inverted turn", 7, 0, [5, 7, 8, 7]), ("inverted turn", 1, -2, [0, 1, 3, 1]),
        ("mordent", 0, 0, [0]),
    ],
)  # fmt: skip
def test_an_ornament_turns_to_its_neighbours_in_the_key(
    ornament: str, fret: int, fifths: int, frets: list[int], kind: str
) -> None:
    piece = tab(beats(note(1, fret, ornament=ornament), note(1, 9)))
    piece.bars[0].fifths = fifths
    performance = play(parse(WRITERS[kind](piece)))
    *turns, last = performance.strokes
    assert [stroke.fret for stroke in turns] == frets and last.time == pytest.approx(0.5)
    steps = {1: 0.0, 3: 1 / 16, 4: 1 / 24}
    assert [stroke.time for stroke in turns] == pytest.approx([k * steps[len(frets)] for k in range(len(frets))])
    ways = ["hammer" if after > before else "pull" for before, after in pairwise(frets)]
    assert [stroke.kind for stroke in turns] == ["pluck", *ways] and turns[-1].end == last.time
    assert performance.lacks["ornament"] == (len(frets) == 1)


def rows(strokes: list[Stroke]) -> list[tuple[str, int, int]]:
    return [(stroke.kind, stroke.string, stroke.fret) for stroke in strokes]


@pytest.mark.parametrize(
    "notation, kind", [pair for pair in product(NOTATIONS, WRITERS) if pair[0] not in LACKING.get(pair[1], ())]
)
def test_a_notation_is_played_alike_from_each_format(notation: str, kind: str) -> None:
    piece, expected = NOTATIONS[notation]
    data = WRITERS[kind](piece)
    assert is_tab(data)
    strokes = play(parse(data)).strokes
    assert rows(strokes) == [row[1:] for row in expected]
    assert [stroke.time for stroke in strokes] == pytest.approx([row[0] for row in expected], abs=1e-3)


@pytest.mark.parametrize("kind", [kind for kind in WRITERS if kind != "gp3"])
def test_signs_reach_the_stroke(kind: str) -> None:
    signs = beats(note(0, 3, staccato=True), note(0, 3, palm=True), note(1, 2, vibrato=0.5), note(1, 2, accent=1))
    more = beats(note(1, 2, ghost=True), note(2, 2, let_ring=True), note(3, 2), note(2, 4))
    one, two, three, four, five, six, _, eight = play(parse(WRITERS[kind](tab(signs, more)))).strokes
    assert one.end == pytest.approx(0.25) and two.end == pytest.approx(1.0)
    assert two.palm and not one.palm and three.vibrato == 0.5
    assert (four.velocity, five.velocity) == (three.velocity + 16, three.velocity - 24)
    assert six.end == pytest.approx(eight.time), "it rings on to the next note of its string"


@pytest.mark.parametrize("kind", ["gp4", "gp5", "gpx", "gp"])
def test_a_bend_follows_its_curve(kind: str) -> None:
    bend = ((0.0, 0.0), (0.5, 2.0), (1.0, 1.0))
    (stroke,) = play(parse(WRITERS[kind](tab(beats(note(2, 5, bend=bend)))))).strokes
    assert stroke.bend == ((0.0, 0.0), (0.25, 2.0), (0.5, 1.0))


@pytest.mark.parametrize("kind", ["musicxml", "mxl"])
def test_a_bend_of_musicxml_rises_over_the_note(kind: str) -> None:
    (stroke,) = play(parse(WRITERS[kind](tab(beats(note(2, 5, bend=((0.0, 0.0), (1.0, 2.0)))))))).strokes
    assert (stroke.bend[0][1], stroke.bend[-1]) == (0.0, pytest.approx((0.5, 2.0)))


@pytest.mark.parametrize("kind", ["gp4", "gp5", "gpx", "gp"])
def test_tempos_change_at_once_or_gradually(kind: str) -> None:
    piece = tab(beats(*[note(0, 3)] * 4), beats(*[note(0, 5)] * 4), beats(note(0, 7)))
    piece.bars[0].tempos.append(Tempo(F(2), 60.0))
    piece.bars[1].tempos.append(Tempo(F(0), 120.0, F(4)))
    times = [stroke.time for stroke in play(parse(WRITERS[kind](piece))).strokes]
    assert times[:5] == pytest.approx([0, 0.5, 1.0, 2.0, 3.0])
    gaps = [after - before for before, after in pairwise(times[4:])]
    assert gaps == sorted(gaps, reverse=True) and sum(gaps) == pytest.approx(4 * 0.6931, abs=2e-3)


@pytest.mark.parametrize("kind", WRITERS)
def test_triplet_feel_delays_every_second_eighth(kind: str) -> None:
    piece = tab(beats(*[note(0, 3)] * 8, length=F(1, 2)))
    piece.bars[0].swing = F(1), F(2, 3)
    times = [stroke.time for stroke in play(parse(WRITERS[kind](piece))).strokes]
    swung = [0, 1 / 3, 0.5, 0.5 + 1 / 3] if kind not in XML else [0, 0.25, 0.5, 0.75]
    assert times[:4] == pytest.approx(swung, abs=1e-3)


@pytest.mark.parametrize("kind", WRITERS)
def test_tuning_capo_program_and_names_are_read(kind: str) -> None:
    piece = parse(WRITERS[kind](tab(beats(note(0, 3)), tuning=(23, 28, 33, 38, 43), capo=2, program=34)))
    (track,) = piece.tracks
    assert (track.name, track.tuning, track.capo, track.program) == ("Bass", (23, 28, 33, 38, 43), 2, 34)


@pytest.mark.parametrize("kind", ["gp5", "gpx", "gp", "musicxml"])
def test_repeats_endings_and_jumps_are_read(kind: str) -> None:
    piece = tab(*(beats(*[note(0, fret)] * 4) for fret in range(5)))
    bars = piece.bars
    bars[0].opens = True
    bars[1].endings, bars[1].plays, bars[2].endings = frozenset([1]), 2, frozenset([2])
    bars[3].signs, bars[4].signs = frozenset(["fine"]), frozenset(["da capo al fine"])
    bars[3].name = "Verse"
    found = parse(WRITERS[kind](piece))
    assert [bar.name for bar in found.bars] == ["", "", "", "Verse", ""]
    assert [number for _, number in play(found).bars] == [0, 1, 0, 2, 3, 4, 0, 2, 3]


def test_only_the_bars_asked_for_play_at_their_tempo() -> None:
    piece = tab(*(beats(*[note(0, fret)] * 4) for fret in range(4)))
    piece.bars[1].tempos.append(Tempo(F(0), 60.0))
    strokes = perform(piece, piece.tracks[0], range(2, 3)).strokes
    assert [(stroke.time, stroke.fret) for stroke in strokes] == [(float(k), 2) for k in range(4)]


def test_two_voices_on_a_string_never_overlap() -> None:
    piece = tab(beats(note(0, 3, let_ring=True)))
    piece.tracks[0].bars[0].append([Beat(F(0), F(1, 2), []), Beat(F(1, 2), F(1, 4), [note(0, 5)])])
    one, two = play(piece).strokes
    assert one.end == two.time == 0.25


@pytest.mark.parametrize(
    "node, partial", [(12, 2), (7, 3), (19, 3), (5, 4), (4, 5), (9, 5), (3.2, 6), (2.7, 7), (2.4, 8), (6.4, 1)]
)
def test_the_fret_of_a_harmonic_tells_its_partial(node: float, partial: int) -> None:
    assert partial_at(node) == partial
