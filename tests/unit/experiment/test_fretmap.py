"""`livebass map`: every note of a neck, with its contacts; a high fret and notes that fret out show in it."""

from __future__ import annotations

import csv
from collections.abc import Generator, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from support.command import Run, cli_text, refusal

from livebass import QUALITIES, load_preset
from livebass.lab.experiment.fretmap import (
    FretMap,
    Note,
    fret_map,
    fret_maps,
    in_threads,
    notes_of,
    picture,
    solve_note,
    table,
)
from livebass.model.bench import change_bass

SEVENTH = 7


def lifted(folder: Path, height: float, fret: int = SEVENTH) -> Path:
    """A preset: jazz-finger with one fret so many mm too high."""
    file = folder / f"high-{fret}.toml"
    file.write_text(f'like = "jazz-finger"\nname = "High"\n[bench]\nfret = {fret}\nfret_height = {height}\n')
    return file


@pytest.fixture(scope="module")
def plain() -> FretMap:
    return fret_map(load_preset("jazz-finger"), duration=0.1)


def test_a_map_has_every_note_and_progress() -> None:
    done: list[float] = []
    made = fret_map(load_preset("jazz-finger"), velocity=20, duration=0.02, progress=done.append)
    assert [len(row) for row in made.strings] == [21] * 4 and len(done) == 84 and done[-1] == 1.0
    assert [(row[0].string, row[3].fret) for row in made.strings] == [(name, 3) for name in "EADG"]
    assert not made.values("contacts").any(), "soft notes touch nothing"


def test_hard_notes_hit_frets_beyond_their_own(plain: FretMap) -> None:
    for row in plain.strings:
        for cell in row[:-1]:
            assert cell.contacts and cell.hardest > cell.fret and 0 < cell.lasts < 0.1 and cell.on == cell.fret
        assert not row[-1].contacts, "nothing lies beyond the last fret"


def test_the_same_bass_gives_the_same_map(plain: FretMap) -> None:
    assert fret_map(load_preset("jazz-finger"), duration=0.1) == plain


def test_a_high_seventh_fret_shows(plain: FretMap, tmp_path: Path) -> None:
    """Notes just below it fret out on it, others below it change; it buzzes least; notes above it are as before."""
    high = fret_map(load_preset(lifted(tmp_path, 0.35)), duration=0.1)
    on, before, after = high.values("on"), plain.values("contacts"), high.values("contacts")
    assert (on[:, SEVENTH - 1] == SEVENTH).all() and set(np.unique(on - plain.values("on"))) <= {0, 1, 2}
    assert (before[:, 2:SEVENTH] != after[:, 2:SEVENTH]).mean() > 0.8
    assert after[:, SEVENTH].sum() < 0.6 * before[:, SEVENTH].sum()
    for old, new in zip(plain.strings, high.strings, strict=True):
        assert new[SEVENTH + 1 :] == old[SEVENTH + 1 :]


def test_contacts_of_a_choked_note_are_those_of_the_string_from_the_pressed_fret(tmp_path: Path) -> None:
    """Pressed below a high 12th fret and plucked hard, every string leaves it and hits it or others again."""
    made = fret_map(load_preset(lifted(tmp_path, 0.3, fret=12)), velocity=127, duration=0.1)
    choked = [cell for row in made.strings for cell in row if cell.on != cell.fret]
    assert {cell.on for cell in choked} == {12}
    hit = [cell for cell in choked if cell.contacts]
    assert len(hit) > 0.9 * len(choked) and all(cell.hardest > cell.fret for cell in hit)


def test_a_board_is_hit_at_a_place_on_it_however_little_lies_beyond() -> None:
    """Beyond the last stops it has fewer points than a neck has frets."""
    bass = change_bass(load_preset("fretless"), {"action": -1.15})
    notes = [Note(bass, 0, fret, 127, 0.02, QUALITIES["live"]) for fret in (11, 17, 20)]
    found = [solve_note(note)["hardest"] for note in notes]
    assert all(bass.necks[0].fret_positions[10] < place < bass.strings[0].length for place in found), found


def test_the_command_prints_draws_and_writes(run: Run, tmp_path: Path) -> None:
    high, drawn, rows = lifted(tmp_path, 0.5), tmp_path / "neck.svg", tmp_path / "neck.csv"
    found = cli_text(run, "map", "--beside", str(high), "--duration", "20ms", "-o", str(drawn), "--csv", str(rows))
    assert found.startswith("A: Jazz bass, fingers: contacts in 0.02 s at velocity 100")
    head, *lines = found.splitlines()[2:]
    assert head.split() == ["fret", *" ".join(f"{name} {which}" for which in "AB" for name in "EADG").split()]
    assert len(lines) == 21
    assert lines[6].endswith("lies on 7") and lines[6].startswith("6 ")
    assert b"<svg" in drawn.read_bytes()
    with rows.open() as file:
        listed = list(csv.DictReader(file))
    assert len(listed) == 2 * 84 and {row["lies_on"] for row in listed if row["fret"] == "6"} == {"6", "7"}


def test_two_set_ups_of_one_name_are_told_apart(run: Run, tmp_path: Path) -> None:
    copied = tmp_path / "mine.toml"
    copied.write_text('like = "paper-g"\n[bench]\naction = 0.5\n')
    titles = cli_text(run, "map", "-p", "paper-g", "--beside", str(copied), "--duration", "10ms").splitlines()[:2]
    assert [title.split(": contacts")[0].split("(")[-1] for title in titles] == ["paper-g)", "mine.toml)"]


def test_pictures_and_tables_of_one_bass(plain: FretMap) -> None:
    assert picture([plain]).startswith(b"\x89PNG")
    assert table([plain]).splitlines()[1].split() == ["fret", *"EADG"]
    assert plain.values("contacts").shape == (4, 21) and np.isnan(plain.values("hardest")[:, -1]).all()


def test_a_sweep_maps_every_combination(run: Run, tmp_path: Path) -> None:
    """Each map is that of a preset with these values, with any number of threads."""
    short, made, alone = ("--duration", "20ms"), tmp_path / "made.csv", tmp_path / "alone.csv"
    found = cli_text(run, "map", "--vary", "neck.action=0.7mm:2mm:2", *short, "--workers", 2, "--csv", made)
    assert found.startswith("A: Jazz bass, fingers, neck.action = 0.7 mm: contacts")
    low = tmp_path / "low.toml"
    low.write_text('like = "jazz-finger"\n[neck]\naction = "0.7 mm"\n')
    cli_text(run, "map", "-p", low, *short, "--workers", 1, "--csv", alone)
    of_sweep, single = ([row[1:] for row in csv.reader(file.read_text().splitlines())] for file in (made, alone))
    assert len(of_sweep) == 1 + 2 * 84 and of_sweep[:85] == single != of_sweep[:1] + of_sweep[85:]


def test_more_than_two_maps_are_below_each_other(plain: FretMap) -> None:
    maps = [replace(plain, name=name) for name in ("one", "two", "three")]
    assert table(maps) == "\n".join(table([one]) for one in maps)


def test_equal_basses_are_plucked_once() -> None:
    bass, asked = load_preset("jazz-finger"), list[Note]()

    def compute(notes: Sequence[Note]) -> Generator[tuple[Note, dict[str, float]]]:
        asked.extend(notes)
        yield from in_threads(notes)

    same = fret_maps(notes_of([bass, replace(bass)], 20, 0.01), compute)
    assert len(asked) == 84 and same[0] == same[1]


@pytest.mark.parametrize(
    ("given", "why"),
    [
        (("--vary", "pluck.apex=1mm:2mm:2"), "the bass's player plucks here"),
        (("--vary", "neck.height_scale=1:2:3"), "changes nothing in preset jazz-finger"),
        (("--vary", "neck.action=1mm:2mm:2", "--vary", "neck.action=1mm:3mm:2"), "given twice"),
        (("--vary", "neck.action=1mm:2mm:2000"), "number of combinations must be from 1 to 1000"),
        (("--vary", "neck.action=1mm:2mm:2", "--beside", "slap"), "give one of them"),
        (("--vary", "neck.action=1mm:2mm:3", "-o", "neck.png"), "one or two maps, not 3"),
        (("--workers", 2, "--scheduler", "tcp://a:1"), "give one of them"),
        (("--scheduler", "nonsense"), "nonsense: must be an address such as tcp://host"),
    ],
)
def test_a_sweep_that_cannot_be_is_refused(run: Run, given: tuple[object, ...], why: str) -> None:
    assert why in refusal(run, "map", *given)


@pytest.mark.parametrize(
    ("given", "why"),
    [(("--velocity", "0"), "1"), (("-o", "neck.txt"), ".png or .svg"), (("--duration", "20s"), "10 s")],
)
def test_bad_options_are_told(run: Run, given: tuple[str, ...], why: str) -> None:
    status, out, said = run("map", *given)
    assert status == 2 and not out and why in said and said.count("\n") == 1
