"""Strokes as messages of MIDI mode 4: the keys and controllers of each kind, and their order."""

from __future__ import annotations

import io
from fractions import Fraction as F

import mido
import pytest
from support.tabs import beats, note, play, tab

from livebass.tab.messages import SEMITONES, Strings, to_midi
from livebass.tab.model import ARTIFICIAL, LEGATO, NATURAL, OUT_DOWN, OUT_UP, SHIFT, Beat, Tab

OPENS = (28, 33, 38, 43)
KEYS = {
    "ghost": 10, "tap": 2, "harmonic": 17, "pop_on_all": 114, "down_stroke": 1, "up_stroke": 5, "artificial": 115,
    "artificial_12th": 116, "artificial_15th": 117, "pinch": 118, "slide_off_down": 119, "slide_off_up": 120,
}  # fmt: skip
ON, OFF, CONTROL, PROGRAM = "note_on", "note_off", "control_change", "program_change"
RANGE = ((101, 0), (100, 0), (6, 12), (38, 0), (101, 127), (100, 127))  # of the wheel, semitones; then no RPN
Row = tuple[str, int, int, int]  # kind, channel, number, value


def write(piece: Tab, keys: dict[str, int] = KEYS, frets: int = 20) -> tuple[list[tuple[float, Row]], dict[str, int]]:
    """The messages (s, message) behind the programs, the mode and the ranges, and what is left out."""
    midi, lacks = to_midi(play(piece), piece.bars, Strings(OPENS, frets, keys, 34), [], 0.0)
    file = mido.MidiFile(file=io.BytesIO(midi))
    found, ticks = [], 0
    for m in file.tracks[1]:
        ticks += m.time
        if m.is_meta:
            continue
        data = m.bytes()[1:]
        value = m.pitch if m.type == "pitchwheel" else data[-1]
        found.append((ticks / file.ticks_per_beat / 2, (m.type, m.channel, data[0] if len(data) == 2 else 0, value)))
    head = [(PROGRAM, channel, 0, 33) for channel in range(4)] + [(CONTROL, 0, 126, 4)]
    head += [(CONTROL, channel, *each) for channel in range(4) for each in RANGE]
    assert found[: len(head)] == [(0.0, row) for row in head], "what another program needs before the first note"
    return found[len(head) :], dict(lacks)


def rows(piece: Tab, keys: dict[str, int] = KEYS) -> list[Row]:
    return [row if row[0] != ON else (*row[:3], 1) for _, row in write(piece, keys)[0]]


def test_each_string_has_its_channel_and_plucks_do_not_overlap() -> None:
    assert rows(tab(beats(note(0, 3), note(0, 5), note(3, 2)))) == [
        (ON, 3, 31, 1), (OFF, 3, 31, 64), (ON, 3, 33, 1), (OFF, 3, 33, 64), (ON, 0, 45, 1), (OFF, 0, 45, 64),
    ]  # fmt: skip


def test_a_hammered_note_overlaps_the_one_before() -> None:
    assert rows(tab(beats(note(1, 3, hammer=True), note(1, 5)))) == [
        (ON, 2, 36, 1), (ON, 2, 38, 1), (OFF, 2, 36, 64), (OFF, 2, 38, 64),
    ]  # fmt: skip


def test_a_shift_slide_ends_its_note_before_the_stroke() -> None:
    assert rows(tab(beats(note(1, 3, slides=frozenset([SHIFT])), note(1, 5)))) == [
        (CONTROL, 0, 19, 0), (CONTROL, 0, 65, 0), (ON, 2, 36, 1), (CONTROL, 0, 19, 5), (CONTROL, 0, 65, 127),
        (ON, 2, 38, 1), (CONTROL, 0, 65, 0), (OFF, 2, 36, 64), (OFF, 2, 38, 64), (ON, 2, 38, 1), (OFF, 2, 38, 64),
    ]  # fmt: skip


def test_a_slide_from_a_long_note_is_slow_and_the_next_one_is_not() -> None:
    slides = {"slides": frozenset([LEGATO])}
    piece = tab([Beat(F(0), F(4), [note(1, 3, **slides)])], beats(note(1, 5, **slides), note(1, 12)))
    found = [(at, row[2:]) for at, row in write(piece)[0] if row[2] == 19]
    assert found == [(0.0, (19, 0)), (1.5, (19, 20)), (pytest.approx(2.5 - 7 * 0.022, abs=1e-4), (19, 0))]


@pytest.mark.parametrize(
    "signs, key, sounds",
    [
        ({"dead": True}, "ghost", 5), ({"technique": "tap"}, "tap", 5),
        ({"harmonic": NATURAL, "node": 7.0}, "harmonic", 19), ({"harmonic": NATURAL, "node": 2.7}, "harmonic", 34),
        ({"harmonic": ARTIFICIAL, "node": 12.0}, "artificial", 5),
        ({"harmonic": ARTIFICIAL, "node": 7.0}, "artificial_12th", 5),
        ({"harmonic": ARTIFICIAL, "node": 5.0}, "artificial_15th", 5),
        ({"harmonic": "pinch", "node": 12.0}, "pinch", 5),
    ],
)  # fmt: skip
def test_a_technique_holds_its_key_as_the_note_begins(signs: dict[str, object], key: str, sounds: int) -> None:
    found, lacks = write(tab(beats(note(2, 5, **signs))))
    assert [row[:3] for _, row in found] == [
        (ON, 1, KEYS[key]), (ON, 1, 38 + sounds), (OFF, 1, KEYS[key]), (OFF, 1, 38 + sounds),
    ]  # fmt: skip
    assert found[0][0] == found[1][0] and not lacks


def test_pops_and_slaps_last_until_another_stroke() -> None:
    pops = beats(note(0, 5, technique="pop"), note(3, 5, technique="pop"), note(0, 5), note(0, 5, technique="slap"))
    switches = [row for row in rows(tab(pops)) if row[2] in (114, 106) and row[0] != OFF]
    pop, pluck, slap = (ON, 0, 114, 1), (CONTROL, 0, 106, 0), (CONTROL, 0, 106, 127)
    assert switches == [pluck, pop, pop, pluck, slap], "a pop presses its key, a loop begins with plucks"


def test_a_map_without_a_key_plays_what_it_can_and_counts() -> None:
    piece = tab(
        beats(note(0, 5, technique="pop"), note(3, 5, technique="pop"), note(1, 5, dead=True)),
        beats(note(1, 12, harmonic=ARTIFICIAL, node=12.0), note(1, 5, harmonic="pinch", node=12.0)),
        beats(note(3, 9, slides=frozenset([OUT_UP]))),
    )
    keys = {"harmonic": 17}
    found, lacks = write(piece, keys)
    assert lacks == {"pop on a low string": 1, "ghost": 1, "harmonic other than the octave": 1}
    assert (CONTROL, 0, 106, 85) in [row for _, row in found]
    assert [row[2] for _, row in found if row[0] == ON and row[1] == 2] == [38, 17, 33 + SEMITONES[4], 17, 38]
    assert [row[2] for _, row in found if row[0] == ON and row[1] == 0] == [48, 52, 57]


def test_a_slide_off_releases_the_note_under_its_key() -> None:
    found = [row[:3] for _, row in write(tab(beats(note(1, 9, slides=frozenset([OUT_DOWN])))))[0]]
    assert found == [(ON, 2, 42), (ON, 2, 119), (OFF, 2, 42), (OFF, 2, 119)]


def test_pick_directions_hold_their_keys() -> None:
    strokes = beats(note(1, 5), note(1, 5))
    strokes[0].stroke, strokes[1].stroke = "down", "up"
    assert [row[2] for row in rows(tab(strokes)) if row[0] == ON] == [1, 38, 5, 38]


def test_a_bend_moves_the_strings_own_wheel_and_the_next_note_is_straight() -> None:
    found, _ = write(tab(beats(note(2, 5, bend=((0.0, 0.0), (0.5, 2.0), (1.0, 2.0))), note(2, 5))))
    wheel = [(at, row[3]) for at, row in found if row[0] == "pitchwheel"]
    assert {row[1] for _, row in found if row[0] == "pitchwheel"} == {1}
    assert wheel[-1] == (0.5, 0) and wheel[-2][1] == round(2 / 12 * 8191)
    assert all(abs(value - 2 / 12 * 8191 * at / 0.25) < 35 for at, value in wheel[:-1])


def test_a_fade_moves_the_strings_own_expression() -> None:
    fading = beats(note(2, 5), note(2, 5))
    fading[0].signs = ("fade in",)
    found = [(at, row) for at, row in write(tab(fading))[0] if row[2] == 11]
    assert found[0] == (0.0, (CONTROL, 1, 11, 0)) and found[-1][1] == (CONTROL, 1, 11, 127)
    assert [row[3] for _, row in found] == sorted(row[3] for _, row in found)


def test_palm_and_vibrato_are_on_for_their_notes_only() -> None:
    found = rows(tab(beats(note(2, 5, palm=True, vibrato=0.5), note(2, 5))))
    moved = [row for row in found if row[0] in (CONTROL, "aftertouch")]
    assert moved == [(CONTROL, 0, 9, 76), ("aftertouch", 1, 0, 64), (CONTROL, 0, 9, 0), ("aftertouch", 1, 0, 0)]
