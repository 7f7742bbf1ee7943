"""The page knows the frets that a string frets out on: from its bench in node, as Python says."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest
from support import node

from livebass import load_preset
from livebass.model.bench import change_bass
from livebass.model.instrument import Instrument
from livebass.model.rest import choked
from livebass.web.export import bass_data, shown_string

CROWN = """
const [string, length, fret] = arguments;
return See.prototype.crownOf(string, length, fret);
"""


def rests_of(bass: Instrument) -> list[dict[str, int]]:
    found: dict[str, dict[str, int]] = {string.name: {} for string in bass.strings}
    for note in choked(bass):
        found[note.string][str(note.fret)] = note.on
    return list(found.values())


@pytest.fixture(scope="module")
def page(tmp_path_factory: pytest.TempPathFactory) -> Iterator[node.Page]:
    with node.page({"jazz-finger": load_preset("jazz-finger")}, tmp_path_factory.mktemp("page")) as page:
        yield page


@pytest.mark.parametrize(
    "values",
    [{}, {"action": -1.7}, {"action": -1.85}, {"action": -1.9}, {"fret": 7, "fret_height": 0.4, "action": -0.5}],
)
def test_the_worker_finds_them_in_the_engines_notes(page: node.Page, values: dict[str, float]) -> None:
    expected = rests_of(change_bass(load_preset("jazz-finger"), values))
    assert page.rests("jazz-finger", values) == expected
    assert any(expected) == bool(values)


def test_the_export_has_them_for_a_preset() -> None:
    bass = change_bass(load_preset("jazz-finger"), {"action": -1.7})
    made = [shown_string(s, neck, bass.frets)["rests"] for s, neck in zip(bass.strings, bass.necks, strict=True)]
    assert [{str(fret): on for fret, on in rests.items()} for rests in made] == rests_of(bass)


def test_a_string_is_drawn_from_the_place_at_which_it_ends() -> None:
    string = shown_string(load_preset("jazz-finger").strings[3], load_preset("jazz-finger").necks[3], 20)
    with node.node("see.js") as page:
        ends = [page.run(CROWN, string, string["length"] - place, 9) for place in string["frets"]]
        assert ends == list(range(1, 21))
        between = string["length"] - (string["frets"][8] + string["frets"][9]) / 2
        assert page.run(CROWN, string, between, 9) == 9, "a slide"
        assert page.run(CROWN, string, string["length"], 0) == 0


BARE = """
const [bass, capo, hit] = arguments, of = {...bass, capo};
const notes = [noteText(of, 3, 9), noteText(of, 3, 0)];
return [fretText(of, 3, 9), hitText(of, hit), ...notes, spanText(of, 1, 9)];
"""


def test_places_of_a_bare_board_are_named_as_python_does() -> None:
    with node.node("places.js") as page:
        bare = load_preset("fretless").necks[3]
        at = f"{1e3 * bare.fret_positions[8]:.0f} mm"
        assert page.run(BARE, bass_data("fretless", load_preset("fretless")), 0, 0.4123) == [
            bare.fret_text(9), "the board 412 mm from the nut",
            "G string " + bare.fret_text(9, board="at"), "G string, open", f"0 to {at}",
        ]  # fmt: skip
        assert page.run(BARE, bass_data("jazz", load_preset("jazz-finger")), 2, 22) == [
            "fret 11", "fret 24", "G string, fret 11", "G string, open", "Frets 3 to 11",
        ]  # fmt: skip


def test_over_a_board_the_worker_reads_them_too(tmp_path: Path) -> None:
    bass = change_bass(load_preset("fretless"), {"action": -1.15})
    assert any(rests_of(bass))
    with node.page({"fretless": load_preset("fretless")}, tmp_path) as page:
        assert page.rests("fretless", {"action": -1.15}) == rests_of(bass)
