"""Plain MIDI files for other programs: notes at sounding pitch, on one channel where none moves beside another."""

from __future__ import annotations

import io
from collections import Counter
from itertools import pairwise

import mido
import pytest
from support.tabs import BEAT, beats, note, play, tab

from livebass.tab.messages import Strings
from livebass.tab.model import ARTIFICIAL, IN_BELOW, LEGATO, NATURAL, OUT_DOWN, SHIFT, Grace, Tab
from livebass.tab.plain import to_plain_midi

OPENS = (28, 33, 38, 43)
RANGE = 12  # semitones of the wheel
GENERAL = {1, 6, 11, 38, 100, 101}  # controllers of General MIDI that a plain file may have
BENT = ((0.0, 0.0), (0.5, 2.0), (1.0, 2.0))
Note = tuple[float, float, int, int, int]  # begin, end (quarter notes), channel, key, velocity


def messages(piece: Tab, dynamics: float = 0.0) -> list[tuple[float, mido.Message]]:
    """(quarter notes, message) of the file's notes and controllers."""
    midi, lacks = to_plain_midi(play(piece), piece.bars, Strings(OPENS, 20, {"ghost": 10}, 35), dynamics)
    assert not lacks
    file, found, ticks = mido.MidiFile(file=io.BytesIO(midi)), [], 0
    assert not any(m.type == "text" for m in file.tracks[0]), "no take: other programs' words are not livebass's"
    for m in file.tracks[1]:
        ticks += m.time
        if not m.is_meta:
            found.append((ticks / file.ticks_per_beat, m))
    assert {m.control for _, m in found if m.type == "control_change"} <= GENERAL
    return found


def notes(piece: Tab, dynamics: float = 0.0) -> list[Note]:
    held: dict[tuple[int, int], tuple[float, int]] = {}
    found = list[Note]()
    for at, m in messages(piece, dynamics):
        if m.type == "note_on":
            assert (m.channel, m.note) not in held, "two notes of one key on a channel"
            held[m.channel, m.note] = at, m.velocity
        elif m.type == "note_off":
            begin, velocity = held.pop((m.channel, m.note))
            found.append((begin, at, m.channel, m.note, velocity))
    assert not held
    return sorted(found)


def wheel(piece: Tab, channel: int = 0) -> list[tuple[float, float]]:
    """(quarter notes, semitones)."""
    wheels = [(at, m) for at, m in messages(piece) if m.type == "pitchwheel" and m.channel == channel]
    return [(at, RANGE * m.pitch / 8191) for at, m in wheels]


def test_notes_share_a_channel_and_begin_behind_its_program_and_its_range() -> None:
    piece = tab(beats(note(0, 3), [note(1, 5), note(3, 2)], note(0, 0)))
    assert [each[2:4] for each in notes(piece)] == [(0, 31), (0, 38), (0, 45), (0, 28)]
    first = [m for _, m in messages(piece)][:7]
    assert (first[0].type, first[0].channel, first[0].program) == ("program_change", 0, 34)
    assert [(m.control, m.value) for m in first[1:]] == [(101, 0), (100, 0), (6, 12), (38, 0), (101, 127), (100, 127)]


@pytest.mark.parametrize(
    "signs, key", [
        ({"harmonic": NATURAL, "node": 7.0}, 33 + 19), ({"harmonic": NATURAL, "node": 2.7}, 33 + 34),
        ({"harmonic": ARTIFICIAL, "node": 12.0}, 33 + 7 + 12), ({"harmonic": "pinch", "node": 5.0}, 33 + 7 + 24),
    ],
)  # fmt: skip
def test_harmonics_have_the_pitch_that_sounds(signs: dict[str, object], key: int) -> None:
    assert [each[3] for each in notes(tab(beats(note(1, 7, **signs))))] == [key]


def test_dead_notes_are_soft_and_short_and_palm_mutes_short() -> None:
    plain, dead, palm, slap = notes(
        tab(beats(note(0, 3), note(0, 3, dead=True), note(0, 3, palm=True), note(0, 3, technique="left slap")))
    )
    assert plain[3:] == palm[3:] == (31, 95) and dead[3:] == slap[3:] == (31, 71)
    assert [round(each[1] - each[0], 2) for each in (plain, dead, palm, slap)] == [1, 0.12, 0.4, 0.12]


def test_notes_of_the_left_hand_follow_softly_without_an_overlap() -> None:
    first, second, third = notes(tab(beats(note(1, 3, hammer=True), note(1, 5, hammer=True), note(1, 3))))
    assert [each[3:] for each in (first, second, third)] == [(36, 95), (38, 71), (36, 71)]
    assert first[1] == second[0] and second[1] == third[0]


@pytest.mark.parametrize("way, velocity", [(LEGATO, 71), (SHIFT, 95)])
def test_a_slide_bends_its_note_and_its_goal_begins_as_it_arrives(way: str, velocity: int) -> None:
    piece = tab(beats(note(1, 3, slides=frozenset([way])), note(1, 5), note(1, 5)))
    found = notes(piece)
    assert [(round(a, 3), round(b, 3), *rest) for a, b, *rest in found] == [
        (0, 1, 0, 36, 95), (1, 2, 0, 38, velocity), (2, 3, 0, 38, 95),
    ]  # fmt: skip
    moved = wheel(piece)
    assert moved[-1] == (1.0, 0.0) and moved[-2] == (1.0, pytest.approx(2.0, abs=0.002)), "straight for the goal"
    assert [y for _, y in moved[:-1]] == sorted(y for _, y in moved[:-1]) and moved[0][0] > 0.7


def test_a_slide_from_a_bent_note_begins_where_the_bend_is() -> None:
    moved = wheel(tab(beats(note(1, 5, bend=BENT, slides=frozenset([LEGATO])), note(1, 2))))
    assert max(y for _, y in moved) == pytest.approx(2.0, abs=0.002)
    assert moved[-2] == (1.0, pytest.approx(-3.0, abs=0.002)) and moved[-1] == (1.0, 0.0)


def test_slides_from_and_to_nowhere_bend_one_note() -> None:
    piece = tab(beats(note(1, 9, slides=frozenset([IN_BELOW])), note(1, 9, slides=frozenset([OUT_DOWN]))))
    assert [(round(a, 3), round(b, 3), *rest) for a, b, *rest in notes(piece)] == [
        (0, 1, 0, 42, 95), (1, 2, 0, 42, 95),
    ]  # fmt: skip
    moved = wheel(piece)
    assert moved[0] == (0.0, pytest.approx(-3, abs=0.002)) and moved[-1] == (2.0, pytest.approx(-5, abs=0.002))
    assert (0.0 in [y for at, y in moved if at < 1]) and all(-3.01 < y <= 0 for at, y in moved if at <= 1)


def test_a_note_that_moves_beside_another_has_its_own_channel() -> None:
    piece = tab(beats([note(1, 5), note(2, 7, bend=BENT)], [note(0, 5), note(1, 0)], note(2, 5, bend=BENT)))
    assert [each[2:4] for each in notes(piece)] == [(0, 38), (1, 45), (0, 33), (1, 33), (0, 43)], "unisons, too"
    assert wheel(piece)[0][0] >= 2 and wheel(piece, 1)[-1] == (1.0, 0.0)
    setup = Counter((m.type, m.channel) for at, m in messages(piece) if at == 0 and m.type != "note_on")
    assert setup == {(kind, c): n for c in (0, 1) for kind, n in (("program_change", 1), ("control_change", 6))}


def test_vibrato_is_the_modulation_wheel_and_ends_with_its_note() -> None:
    moved = [(at, m.value) for at, m in messages(tab(beats(note(1, 5, vibrato=0.5), note(1, 5)))) if m.is_cc(1)]
    assert moved == [(0.0, 64), (1.0, 0)]


def test_dynamics_change_the_velocities() -> None:
    """General MIDI: 40 dB from a velocity to one ten times as high."""
    assert [each[4] for each in notes(tab(beats(note(1, 5))), -6.0)] == [round(95 * 10 ** (-6 / 40))]
    assert [each[4] for each in notes(tab(beats(note(1, 5))), 12.0)] == [127]


def test_fast_lines_of_slides_and_graces_keep_every_note_apart() -> None:
    """Notes shorter than their slides still begin in order, and none is lost."""
    slid = frozenset([LEGATO])
    line = beats(*(note(1, fret, slides=slid) for fret in (2, 14, 2, 14)), note(1, 2), length=BEAT / 8)
    found = notes(tab(line))
    assert [each[3] for each in found] == [35, 47, 35, 47, 35]
    assert all(a[0] < a[1] and a[1] <= b[0] for a, b in pairwise(found))
    graced = note(1, 7, graces=[Grace(5, BEAT / 8, joined="slide")])
    assert [each[3] for each in notes(tab(beats(note(0, 3), graced)))] == [31, 38, 40]
