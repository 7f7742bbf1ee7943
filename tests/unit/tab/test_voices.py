"""MusicXML with several voices and staves, as notation programs write it: everything counts at its own time."""

from __future__ import annotations

from itertools import pairwise

import pytest
from support.musicxml import direction, scored, tuned
from support.tabs import play

from livebass.tab.model import UnreadableTab
from livebass.tab.order import order
from livebass.tab.perform import Performance
from livebass.tab.reading import parse

Written = tuple[float, int, int]  # s, string, fret
TIE = {"start": '<tie type="start"/>', "stop": '<tie type="stop"/>', "both": '<tie type="stop"/><tie type="start"/>'}
WHOLE = "<backup><duration>8</duration></backup>"
RESTS = "<measure><note><rest measure='yes'/><duration>8</duration></note></measure>"
LONG = "<attributes><time><beats>3</beats><beat-type>4</beat-type></time></attributes>"


def note(name: str, length: int, voice: int = 1, more: str = "", staff: int = 1, notations: str = "") -> str:
    """A note such as "E1", two divisions in a quarter note; `more` stands before and behind its pitch."""
    chord, tie = ("<chord/>", more.removeprefix("<chord/>")) if more.startswith("<chord/>") else ("", more)
    return (
        f"<note>{chord}<pitch><step>{name[0]}</step><octave>{name[1]}</octave></pitch><duration>{length}</duration>"
        f"{tie}<voice>{voice}</voice><staff>{staff}</staff><notations>{notations}</notations></note>"
    )


def fret(string: int, number: int) -> str:
    return f"<technical><string>{string}</string><fret>{number}</fret></technical>"


def tab(name: str, length: int, string: int, number: int, more: str = "", notations: str = "") -> str:
    """A note of a tab staff, the second one."""
    return note(name, length, 5, more, 2, fret(string, number) + notations)


def performance(text: str) -> Performance:
    return play(parse(text.encode()))


def written(text: str) -> list[Written]:
    return [(round(s.time, 3), s.string, s.fret) for s in performance(text).strokes]


# What a score without tablature plays: s, string from the lowest and fret
CASES: dict[str, tuple[str, list[Written]]] = {
    "a held note under a line: its string stays free": (
        scored(note("C2", 2) + note("D2", 2) + note("C2", 2) + note("D2", 2) + WHOLE + note("A1", 8, 2)),
        [(0, 0, 5), (0, 1, 3), (0.5, 2, 0), (1, 1, 3), (1.5, 2, 0)],
    ),
    "a held note over a line, in the other order": (
        scored(note("D2", 8, 2) + WHOLE + note("E1", 4) + note("E2", 4)),
        [(0, 0, 0), (0, 1, 5), (1, 2, 2)],
    ),
    "a note that two voices share sounds once": (
        scored(note("A1", 2) + note("C2", 6) + WHOLE + note("A1", 8, 2)),
        [(0, 0, 5), (0.5, 1, 3)],
    ),
    "a tied double stop": (
        scored(note("D2", 8, 1, TIE["start"]) + note("F2", 8, 1, "<chord/>" + TIE["start"]),
               note("D2", 8, 1, TIE["both"]) + note("F2", 8, 1, "<chord/>" + TIE["both"]),
               note("D2", 8, 1, TIE["stop"]) + note("F2", 8, 1, "<chord/>" + TIE["stop"])),
        [(0, 1, 5), (0, 2, 3)],
    ),
    "a slide upwards takes the string on which it begins": (
        scored(note("C2", 4, notations='<slide type="start"/>') + note("E2", 4, notations='<slide type="stop"/>')),
        [(0, 1, 3), (0.75, 1, 7), (1, 1, 7)],  # a stroke ends it
    ),
    "a slide downwards begins where it can end": (
        scored(note("E2", 4, notations='<glissando type="start"/>')
               + note("C2", 4, notations='<glissando type="stop"/>')),
        [(0, 1, 7), (0.75, 1, 3), (1, 1, 3)],
    ),
    "a hammer-on keeps its string": (
        scored(note("C2", 4, notations='<technical><hammer-on type="start">H</hammer-on></technical>')
               + note("D2", 4, notations='<technical><hammer-on type="stop"/></technical>')),
        [(0, 1, 3), (1, 1, 5)],
    ),
    "pieces of a bar are one bar": (
        scored(LONG + note("E1", 6), note("A1", 2), note("D2", 4), note("G2", 6)),
        [(0, 0, 0), (1.5, 1, 0), (2, 2, 0), (3, 3, 0)],
    ),
    "pieces of two bars, one after the other": (
        scored(note("E1", 8), note("A1", 2), note("D2", 6), note("A1", 4), note("D2", 4), note("G2", 8)),
        [(0, 0, 0), (2, 1, 0), (2.5, 2, 0), (4, 1, 0), (5, 2, 0), (6, 3, 0)],
    ),
    "pieces of a bar in which another voice rests by a whole bar": (
        scored(note("E1", 8), note("A1", 2), note("D2", 6), note("G2", 8)).replace(
            "</part></score-partwise>", "</part><part id='Q'>" + RESTS * 4 + "</part></score-partwise>"),
        [(0, 0, 0), (2, 1, 0), (2.5, 2, 0), (4, 3, 0)],
    ),
    "short bars without rests are bars": (
        scored(note("E1", 4), note("A1", 4), note("D2", 4), note("G2", 4)),
        [(0, 0, 0), (2, 1, 0), (4, 2, 0), (6, 3, 0)],
    ),
    "a short bar that no neighbour completes is a bar": (
        scored(note("E1", 8), note("A1", 2), note("D2", 8)), [(0, 0, 0), (2, 1, 0), (4, 2, 0)],
    ),
    "a tempo with an offset for the eye changes where it stands": (
        scored(note("E1", 8), '<direction><direction-type/><offset>4</offset><sound tempo="240"/></direction>'
               + note("A1", 4) + note("D2", 4)),
        [(0, 0, 0), (2, 1, 0), (2.5, 2, 0)],
    ),
    "a string without a fret is a wish": (
        scored(note("A1", 4, notations="<technical><string>4</string></technical>")
               + note("G2", 4, notations="<technical><string>2</string></technical>")),
        [(0, 0, 5), (1, 2, 5)],
    ),
    "a wish that the string cannot fulfil": (
        scored(note("A1", 8, notations="<technical><string>1</string></technical>")), [(0, 1, 0)],
    ),
    "a fifth string that only a note names": (
        scored(note("E1", 4, notations="<technical><string>5</string></technical>") + note("A1", 4)),
        [(0, 0, 5), (1, 2, 0)],
    ),
}  # fmt: skip


@pytest.mark.parametrize("case", CASES)
def test_all_that_sounds_is_played_at_its_time(case: str) -> None:
    text, expected = CASES[case]
    found = performance(text)
    assert sorted((round(s.time, 3), s.string, s.fret) for s in found.strokes) == sorted(expected)
    assert not +found.lacks


def test_a_held_note_sounds_to_its_end_beside_a_line() -> None:
    held, *line = performance(CASES["a held note under a line: its string stays free"][0]).strokes
    assert (held.time, held.end) == (0, 2) and all(a.end == b.time for a, b in pairwise(line))


def test_a_note_beside_more_than_the_strings_is_counted() -> None:
    chord = "".join(note(name, 8, 1, "<chord/>" * (k > 0)) for k, name in enumerate(["E1", "F1", "G1"]))
    found = performance(scored(chord))
    assert len(found.strokes) == 1 and found.lacks == {"note on a string that plays another": 2}


def linked(
    upper: str, lower: str, details: str = f"<staff-lines>4</staff-lines>{tuned('E1', 'A1', 'D2', 'G2')}"
) -> str:
    """A bar on two staves, the second one with tablature."""
    attributes = f'<staves>2</staves><staff-details number="2">{details}</staff-details>'
    return scored(upper + WHOLE + lower, attributes=attributes)


def test_a_tie_of_the_staff_over_a_tab_staff_is_none_of_its_strokes() -> None:
    upper = note("A1", 4, 1, TIE["start"]) + note("A1", 4, 1, TIE["stop"])
    assert written(linked(upper, tab("A1", 4, 4, 5, TIE["start"]) + tab("A1", 4, 4, 5, TIE["stop"]))) == [(0, 0, 5)]


def test_a_tab_staff_without_frets_sounds_alone() -> None:
    clef = '<clef number="2"><sign>TAB</sign></clef>'
    text = linked(note("A1", 8), note("A1", 8, 5, staff=2)).replace("</attributes>", f"{clef}</attributes>", 1)
    assert written(text) == [(0, 1, 0)]


def test_signs_before_a_backup_count_at_their_time() -> None:
    palm = direction("<words>P.M.</words>") + direction('<dashes type="start"/>'), direction('<dashes type="stop"/>')
    upper = direction("<dynamics><p/></dynamics>") + note("G1", 4) + direction("<dynamics><ff/></dynamics>")
    upper += palm[0] + note("G1", 2) + palm[1] + note("G1", 2)
    strokes = performance(linked(upper, tab("G1", 4, 4, 3) + tab("G1", 2, 4, 3) * 2)).strokes
    assert [(s.velocity, s.palm) for s in strokes] == [(47, False), (111, True), (111, False)]


@pytest.mark.parametrize("octave", [1, 2])
def test_linked_staves_may_differ_by_an_octave(octave: int) -> None:
    """MuseScore 3.2.3 writes an Electric Bass with E2 in staff 1 and E1 in the tab staff, and one transpose."""
    transpose = "<transpose><chromatic>0</chromatic><octave-change>-1</octave-change></transpose>"
    lower = tab(f"E{octave}", 4, 4, 0) + tab(f"B{octave}", 4, 3, 2)
    text = linked(note("E2", 4) + note("B2", 4), lower, "<staff-lines>4</staff-lines>")
    text = text.replace("</attributes>", f"{transpose}</attributes>", 1)
    piece = parse(text.encode())
    assert piece.tracks[0].tuning[:2] == (28, 33) and written(text) == [(0, 0, 0), (1, 1, 2)]


def test_a_staff_has_its_own_transposition() -> None:
    transpose = '<transpose number="{}"><chromatic>0</chromatic><octave-change>{}</octave-change></transpose>'
    text = linked(note("E2", 8), tab("E1", 8, 4, 0), "<staff-lines>4</staff-lines>")
    text = text.replace("</attributes>", f"{transpose.format(1, -1)}{transpose.format(2, 0)}</attributes>", 1)
    assert parse(text.encode()).tracks[0].tuning[0] == 28


@pytest.mark.parametrize("first", [1, 2])
def test_lines_without_a_tuning_are_no_strings(first: int) -> None:
    strings = tuned("E1", "A1", "D2", "G2")
    for line in (4, 3, 2, 1):
        strings = strings.replace(f'line="{line}"', f'line="{line + first - 1}"')
    text = linked("", tab("G1", 4, 4, 3) + tab("A2", 4, 1, 2), f"<staff-lines>5</staff-lines>{strings}")
    assert parse(text.encode()).tracks[0].tuning == (28, 33, 38, 43) and written(text) == [(0, 0, 3), (1, 3, 2)]


def test_a_snap_pizzicato_pops() -> None:
    (stroke,) = performance(scored(note("A1", 4, notations="<technical><snap-pizzicato/></technical>"))).strokes
    assert (stroke.kind, stroke.string) == ("pop", 1)


def test_notes_that_only_show_a_rhythm_are_counted() -> None:
    slash = note("B2", 2).replace("<voice>", "<notehead>slash</notehead><voice>")
    style = '<attributes><measure-style><slash type="{}"/></measure-style></attributes>'
    unpitched = "<note><unpitched/><duration>2</duration></note>"
    found = performance(
        scored(slash + style.format("start") + note("B2", 2) + style.format("stop") + note("A1", 2) + unpitched)
    )
    assert [(s.time, s.string) for s in found.strokes] == [(1, 1)]
    assert found.lacks == {"slash note": 2, "note without a pitch": 1}


@pytest.mark.parametrize(("alter", "key", "bend"), [("0.5", 38, 0.5), ("-0.5", 37, 0.5), ("1.5", 39, 0.5)])
def test_a_quarter_tone_is_a_bend(alter: str, key: int, bend: float) -> None:
    higher = note("D2", 8).replace("<octave>", f"<alter>{alter}</alter><octave>")
    (stroke,) = performance(scored(higher)).strokes
    assert (28, 33, 38, 43)[stroke.string] + stroke.fret == key and {y for _, y in stroke.bend} == {bend}


def test_a_fret_is_no_quarter_tone_higher() -> None:
    """Whatever its pitch says; not even fret 0."""
    notes = (tab("G1", 4, 4, 3) + tab("E1", 4, 4, 0)).replace("<octave>", "<alter>0.5</alter><octave>")
    assert [s.bend for s in performance(linked("", notes)).strokes] == [(), ()]


REPEAT = '<barline><repeat direction="{}"/></barline>'
ENDING = '<barline><ending number="{}" type="{}"/></barline>'
BACK, FORWARD = REPEAT.format("backward"), REPEAT.format("forward")


@pytest.mark.parametrize(
    ("bars", "expected"),
    [
        # The suite of the W3C, 45i
        ([("", ""), (ENDING.format(1, "start"), ""), (FORWARD, BACK), ("", ENDING.format(1, "stop") + BACK),
          (FORWARD + ENDING.format(2, "start"), BACK), ("", ENDING.format(2, "discontinue")), ("", "")],
         "1 2 3 3 4 1 5 5 6 7"),
        ([("", ""), (ENDING.format("1, 2", "start"), ""), (FORWARD, BACK), ("", ENDING.format("1, 2", "stop") + BACK),
          (ENDING.format(3, "start"), ENDING.format(3, "discontinue"))],
         "1 2 3 3 4 1 2 3 3 4 1 5"),
    ],
)  # fmt: skip
def test_a_repeat_within_an_ending_is_played_each_time(bars: list[tuple[str, str]], expected: str) -> None:
    piece = parse(scored(*(left + note("E1", 8) + right for left, right in bars)).encode())
    assert [number + 1 for number in order(piece.bars)] == list(map(int, expected.split()))


@pytest.mark.parametrize(
    ("text", "says"),
    [
        (scored('<attributes><time><beats>1000000</beats><beat-type>1000000</beat-type></time></attributes>'
                + note("E1", 8)), "has more than 200000 beats"),
        (linked("", tab("G1", 8, 4, -3)), "is damaged: string 4, fret -3"),
        (linked("", tab("G1", 8, 0, 3)), "is damaged: string 0, fret 3"),
    ],
)  # fmt: skip
def test_what_a_file_makes_is_bounded(text: str, says: str) -> None:
    with pytest.raises(UnreadableTab, match=says):
        performance(text)


def test_a_tie_into_a_later_ending_keeps_its_string() -> None:
    first = ENDING.format(1, "start") + note("C2", 8, 1, TIE["stop"]) + ENDING.format(1, "stop") + BACK
    second = ENDING.format(2, "start") + note("C2", 8, 1, TIE["stop"]) + ENDING.format(2, "stop")
    assert written(scored(note("C2", 8, 1, TIE["start"]), first, second)) == [(0, 1, 3), (4, 1, 3)]
