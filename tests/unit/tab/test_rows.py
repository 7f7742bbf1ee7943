"""Strokes as rows of a score, and the events that a performer makes from them: by string, whatever the key map."""

from __future__ import annotations

import functools
from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray
from support.tabs import beats, hard_tab, note, play, tab

from livebass.cli.hands import SOUND, Loader
from livebass.engine.engine import Engine
from livebass.kernels.player import controls, words
from livebass.kernels.player.performer import FREE, HELD
from livebass.kernels.string.records import EVENT, PLUCK, STRIKE_EVENT, THROW, TOUCH_EVENT
from livebass.model.keymap import MODO, MODO_12, KeyMap
from livebass.model.quality import QUALITIES
from livebass.rows.techniques import DYNAMICS, PARAMETER, PICKED, TECHNIQUE, TECHNIQUE_ROWS
from livebass.score.takes import strokes_of, text_of_stroke
from livebass.tab.model import ARTIFICIAL, NATURAL, OUT_UP, SHIFT, Tab
from livebass.tab.rows import to_rows

RATE = 48000
LOAD = Loader(dict.fromkeys(SOUND))
BASS = LOAD("jazz-finger")
NO_KEYS = KeyMap("none", (), ())


@functools.cache
def engine_with(keys: KeyMap) -> Engine:
    return Engine(replace(BASS, player=replace(BASS.player, keys=keys)), QUALITIES["live"], RATE)


def prepare(keys: KeyMap = MODO) -> Engine:
    """A fresh engine of a bass with a key map."""
    return engine_with(keys).another()


def events_of(piece: Tab, engine: Engine, dynamics: float = 0.0) -> NDArray[np.void]:
    """The events that a tablature becomes."""
    performance = play(piece)
    rows, _ = to_rows(performance, BASS.frets, dynamics)
    frames = [performance.tempos.frame(at, RATE) for at, _ in rows]
    return engine.play_words(np.array(frames), np.array([words.word_of(*event) for _, event in rows]))


def kinds_on(events: NDArray[np.void], string: int) -> set[int]:
    return set(events["kind"][events["string"] == string].tolist())


def test_a_stroke_has_its_string_fret_and_force_and_ends() -> None:
    piece = tab(beats(note(1, 3, velocity=80), note(2, 0)))
    rows, lacks = to_rows(play(piece), 20, 0.0)
    (at, (kind, number, value)), (end, ended), (after, _), _ = rows
    assert (at, end, after) == (0, 3840, 3840) and (kind, ended[0]) == (words.STROKE, words.STROKE_END) and not lacks
    assert [words.field(number, place) for place in (words.STRING, words.FRET, words.VELOCITY)] == [1, 3, 80]
    assert words.field(int(value), words.LOUDER) == words.NO_DYNAMICS and words.field(ended[1], words.STRING) == 1


def test_the_left_hand_leads_on_without_an_end() -> None:
    piece = tab(beats(note(1, 3, hammer=True), note(1, 5)), beats(note(3, 9, slides=frozenset([OUT_UP]))))
    kinds = [event[0] for _, event in to_rows(play(piece), 20, 0.0)[0]]
    assert kinds == [words.STROKE, words.STROKE, words.STROKE_END, words.STROKE, words.STROKE_END], (
        "the last end slides off"
    )


def test_a_stroke_repeats_what_a_jump_would_miss() -> None:
    """A string that stays bent for two notes, so that a loop may begin with either."""
    bent = ((0.0, 2.0), (1.0, 2.0))
    piece = tab(beats(note(2, 5, bend=bent), note(2, 5, bend=bent), note(2, 5)))
    rows = to_rows(play(piece), 20, 0.0)[0]
    assert [(at, event[2]) for at, event in rows if event[0] == words.STRING_WHEEL] == [
        (0, 1365),
        (3840, 1365),
        (7680, 0),
    ]


@pytest.mark.parametrize("keys", [NO_KEYS, MODO_12])
def test_the_key_map_does_not_matter(keys: KeyMap) -> None:
    """A map without keys and controllers, and one whose keys lie over the notes of the lowest string."""
    techniques = tab(
        beats(note(0, 0, technique="tap"), note(0, 2, technique="pop"), note(1, 5, harmonic="pinch", node=12.0)),
        beats(note(0, 3, technique="left slap"), note(1, 9, slides=frozenset([OUT_UP]))),
        beats(note(0, 3, slides=frozenset([SHIFT])), note(0, 5, palm=True, vibrato=0.5)),
    )
    for piece in (hard_tab(), techniques):
        other = prepare(keys)
        assert np.array_equal(events_of(piece, prepare()), events_of(piece, other))
        assert other.report().dropped == 0


def test_a_technique_reaches_its_own_string_only() -> None:
    events = events_of(
        tab(beats([note(1, 3, dead=True), note(2, 7)], [note(0, 3, technique="slap"), note(3, 7)])), prepare()
    )
    assert TOUCH_EVENT in kinds_on(events, 1) and kinds_on(events, 2) & {TOUCH_EVENT, PLUCK} == {PLUCK}
    assert kinds_on(events, 0) & {THROW, STRIKE_EVENT} and PLUCK in kinds_on(events, 3)
    assert not kinds_on(events, 3) & {THROW, STRIKE_EVENT}, "the thumb is on the lowest string"


def palms_on(events: NDArray[np.void], string: int) -> list[float]:
    """The resistance of a palm's first finger on a string, as it changes."""
    mine = events[(events["string"] == string) & (events["kind"] == TOUCH_EVENT) & (events["finger"] == 0)]
    return [float(x) for x in mine["resistance"]]


def test_in_a_chord_a_palm_mutes_the_strings_of_its_strokes() -> None:
    chord = [note(1, 3, palm=True), note(2, 5), note(3, 5, palm=True)]
    events = events_of(tab(beats([note(0, 3), note(1, 5)], chord)), prepare())
    assert [len(palms_on(events, string)) for string in range(4)] == [0, 1, 0, 1]


def test_the_next_stroke_without_a_palm_lifts_it_from_all_strings() -> None:
    events = events_of(tab(beats(note(1, 3, palm=True, let_ring=True), note(2, 5))), prepare())
    laid, lifted = palms_on(events, 1)
    assert laid > 0 == lifted and palms_on(events, 2) == []


@pytest.mark.parametrize("node, partial", [(12.0, 2), (7.0, 3), (5.0, 4), (4.0, 5), (3.2, 6), (2.7, 7), (2.4, 8)])
@pytest.mark.parametrize("fret, harmonic", [(5, ARTIFICIAL), (12, ARTIFICIAL), (0, NATURAL)])
def test_a_harmonic_is_touched_at_its_node(node: float, partial: int, fret: int, harmonic: str) -> None:
    piece = tab(beats(note(1, fret, harmonic=harmonic, node=node)))
    rows, lacks = to_rows(play(piece), 20, 0.0)
    assert words.field(int(rows[0][1][2]), words.PARTIAL) == partial and not lacks
    engine = prepare()
    events = engine.play_words(np.zeros(1, np.int64), np.array([words.word_of(*rows[0][1])]))
    (touch,) = events[events["kind"] == TOUCH_EVENT]
    length = BASS.strings[1].length / 2 ** (fret / 12)
    assert touch["place"] == pytest.approx(length * (1 - 1 / partial), rel=1e-3)
    assert events["fret"][events["kind"] == PLUCK].tolist() == [fret]


def test_the_players_own_stroke_comes_back_after_a_slap() -> None:
    engine = prepare()
    controls.take_value(engine.performer.ctypes.data, engine.pool.records.ctypes.data, PARAMETER, TECHNIQUE, PICKED)
    before = engine.performer["stroke"][0], engine.performer["slapped"][0]
    events_of(hard_tab(), engine)
    assert (engine.performer["stroke"][0], engine.performer["slapped"][0]) == before
    assert engine.performer["switched"][0].sum() == 0


def test_dynamics_are_exact() -> None:
    louder = prepare()
    controls.take_value(louder.performer.ctypes.data, louder.pool.records.ctypes.data, PARAMETER, DYNAMICS, -4.0)
    piece = tab(beats(note(1, 3), note(0, 5, hammer=True), note(0, 7)))
    assert np.array_equal(events_of(piece, prepare(), dynamics=-4.0), events_of(piece, louder))
    assert not np.array_equal(events_of(piece, prepare()), events_of(piece, louder))


def test_a_string_at_rest_has_nothing_left() -> None:
    engine = prepare()
    piece = tab(beats(note(1, 3, palm=True, vibrato=1.0, bend=((0.0, 1.0), (1.0, 1.0)))))
    rows, _ = to_rows(play(piece), BASS.frets, 0.0)
    begun = np.array([words.word_of(*event) for _, event in rows if event[0] != words.STROKE_END])
    engine.play_words(np.zeros(len(begun), np.int64), begun)
    p = engine.performer[0]
    assert p["hands"]["state"][1] == HELD and p["controls"]["string_bend"][1] > 0.9
    assert p["hands"]["palmed"] == 1 << 1 and p["hands"]["string_vibrato"][1] == 127 and p["controls"]["palm"] == 0
    engine.play_words(np.array([10]), np.array([words.word_of(words.STRING_REST, 1, 0.0)]))
    assert p["hands"]["state"][1] == FREE and p["controls"]["string_bend"][1] == 0
    assert p["hands"]["palmed"] == 0 == p["hands"]["string_vibrato"][1]


def test_keys_and_strokes_end_their_own_notes() -> None:
    engine = prepare()
    engine.send(np.array([0]), np.array([[0x90, 36, 90]]))
    string = int(engine.performer["hands"]["latest"][0])
    engine.play_words(
        np.array([5]), np.array([words.word_of(words.STROKE_END, words.joined({words.STRING: string}), 0.0)])
    )
    assert engine.performer["hands"]["state"][0, string] == HELD


def test_any_word_is_harmless() -> None:
    """Takes and pages may hold any bits: no string, fret or technique beyond the bass's is touched."""
    rng, engine = np.random.default_rng(8), prepare()
    sent = rng.integers(0, 1 << 24, 3000) | rng.integers(words.STROKE, words.STRING_REST + 1, 3000) << words.KIND_BIT
    values = rng.integers(0, 1 << 32, 3000, dtype=np.uint32)
    values[::2] = rng.integers(0, 1 << 24, 1500).astype(np.float32).view(np.uint32)
    sent |= values.view(np.int32).astype(np.int64) << 32
    events = engine.play_words(np.sort(rng.integers(0, RATE, 3000)), sent)
    assert len(events) > 250 and (events["string"] < 4).all() and (events["fret"] <= BASS.frets).all()
    assert engine.performer["switched"][0].sum() == 0
    assert all(np.isfinite(events[name]).all() for name in EVENT.names or () if name != "value")


def test_a_row_is_a_word_and_back() -> None:
    for row in [(0x93, 40, 90), (words.STROKE, 0xABCDEF, 1234567.0), (words.STRING_WHEEL, 3, -8192.0)]:
        assert words.row_of(words.word_of(*row)) == row
    with pytest.raises(ValueError, match="3 bits"):
        words.joined({words.STRING: 8})


def test_a_take_keeps_rows_as_texts() -> None:
    rows = [(10, words.STROKE, 48664, 8388611.0), (20, words.STRING_WHEEL, 2, -300.0), (30, words.STROKE_END, 1, 0.0)]
    texts = [(frame, text_of_stroke(*row)) for frame, *row in rows]
    others = [(40, "livebass plays {}"), (50, texts[0][1] + " ")]
    held = words.field(rows[0][2], words.STRING)
    assert strokes_of([*texts, *others], 60) == (*rows, (60, words.STROKE_END, held, 0.0)), (
        "the end of the first stroke"
    )


def test_every_technique_has_its_number() -> None:
    assert all(row.number < 1 << 5 for row in TECHNIQUE_ROWS.values()), "they fit into a stroke"
