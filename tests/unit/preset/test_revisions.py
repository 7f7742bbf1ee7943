"""Revisions: an earlier one of a preset loads for ever, and no preset changes its sound without a new one."""

from __future__ import annotations

import json
import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from support.command import Run
from support.programs import load

from livebass import load_preset, preset_names
from livebass.plugin.instrument import image_digest
from livebass.preset import revisions
from livebass.preset.load import _as_shipped, laboratory_names, own_tables, preset_source, preset_tables, preset_text
from livebass.preset.source import PresetError, shipped_folder

NAMES = [*preset_names(), *laboratory_names()]
EARLIER = {"neck.relief": "0.5 mm", "string.0.level": 0.9, "pick.lift": None, "player.hardest": 2.5}


@pytest.fixture
def second(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """As if jazz-finger had been worked on: the present one is its third revision."""
    present = revisions.revisions()["jazz-finger"]
    changes = {"1": {"neck.frets": 21}, "2": EARLIER}
    before = {number: {"digest": "", "changed": changed} for number, changed in changes.items()}
    made = revisions.revisions() | {"jazz-finger": {**present, "revision": 3, "before": before}}
    monkeypatch.setattr(revisions, "revisions", lambda: made)
    _as_shipped.cache_clear()
    yield
    _as_shipped.cache_clear()


@pytest.mark.parametrize("name", NAMES)
def test_a_preset_that_sounds_otherwise_has_a_new_revision(name: str) -> None:
    """If this fails: .venv/bin/python tools/revise.py, and a line in the changelog."""
    kept = revisions.revisions()[name]
    assert revisions.digest(preset_tables(name)[1]) == kept["digest"]


def test_every_earlier_revision_loads_as_it_was() -> None:
    assert list(revisions.revisions()) == sorted(NAMES)
    for name, kept in revisions.revisions().items():
        assert sorted(map(int, kept.get("before", {}))) == list(range(1, kept["revision"]))
        for number, one in kept.get("before", {}).items():
            assert revisions.digest(preset_tables(f"{name}@{number}")[1]) == one["digest"]
            assert load_preset(f"{name}@{number}").name


def test_the_present_revision_is_the_preset() -> None:
    for name in NAMES:
        assert load_preset(f"{name}@{revisions.present(name)}") == load_preset(name)
        assert preset_source(f"{name}@{revisions.present(name)}")[1] == preset_source(name)[1]


def test_an_earlier_one_differs_in_what_the_file_says(second: None, tmp_path: Path) -> None:
    now, middle, first = (load_preset(name) for name in ("jazz-finger", "jazz-finger@2", "jazz-finger@1"))
    assert middle.player.hardest == first.player.hardest == 2.5 != now.player.hardest
    assert middle.strings[0].level == 0.9 and middle.strings[1].level == now.strings[1].level
    assert (first.frets, middle.frets, now.frets) == (21, 20, 20)
    assert load_preset("jazz-finger@3") == now
    assert len({image_digest(bass) for bass in (now, middle, first)}) == 3
    for like in ("jazz-finger@2", "jazz-finger"):
        (tmp_path / "mine.toml").write_text(f'like = "{like}"\nname = "Mine"\n')
        assert load_preset(tmp_path / "mine.toml").player.hardest == load_preset(like).player.hardest
    assert tomllib.loads(preset_text("jazz-finger@2"))["player"]["hardest"] == 2.5


@pytest.mark.parametrize("name", NAMES)
def test_tables_and_places_say_the_same(name: str) -> None:
    tables = preset_tables(name)[1]
    assert revisions.tables_of(revisions.places_of(tables)) == tables
    assert tomllib.loads(revisions.toml_of(tables)) == tables


@pytest.mark.parametrize(
    "name, says",
    [
        ("paper-g@0", "paper-g has revision 1 only"), ("paper-g@2", "paper-g has revision 1 only"),
        ("paper-g@", "revision 1 only"), ("paper-g@1.0", "revision 1 only"), ("paper-g@-1", "revision 1 only"),
        ("slap@99", "slap has revisions 1 to "), ("slapp@1", "no shipped preset"), ("motown@1", "no shipped preset"),
        ("@1", "no shipped preset"),
    ],
)  # fmt: skip
def test_what_is_no_revision_is_said(name: str, says: str) -> None:
    with pytest.raises(PresetError) as caught:
        load_preset(name)
    assert name in str(caught.value) and says in str(caught.value) and "\n" not in str(caught.value)


def test_a_path_may_have_the_mark(tmp_path: Path) -> None:
    (tmp_path / "mine@home.toml").write_text('like = "slap"\n')
    assert load_preset(tmp_path / "mine@home.toml").name == "Slap"


def test_the_command_lists_and_plays_them(second: None, run: Run, tmp_path: Path) -> None:
    status, out, err = run("presets", "list", "--revisions")
    assert status == 0 and not err
    assert "jazz-finger@3  the present one\n" in out and f"{revisions.with_revision('slap')}  the present one\n" in out
    assert f"jazz-finger@2  differed in {', '.join(EARLIER)}\n" in out
    status, out, err = run("presets", "show", "jazz-finger@1")
    assert status == 0 and tomllib.loads(out)["neck"]["frets"] == 21
    status, out, err = run("presets", "list", "--revisions", "--sounds")
    assert status == 2 and "--revisions" in err


def test_the_tool_gives_a_changed_preset_its_next_revision(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """Presets like it, too; comments and descriptions give none."""
    revise = load("revise")
    kept: dict[str, Any] = json.loads((shipped_folder() / revisions.FILE).read_text("utf-8"))
    assert revise.revised(kept, shipped_folder(), NAMES) == []
    before = {name: preset_tables(name)[1] for name in NAMES}
    changed = json.loads(json.dumps(before))
    changed["slap"]["neck"]["relief"] = "0.35 mm"
    changed["muted"]["description"] = "another one"
    changed["new"] = changed["slap"]
    monkeypatch.setattr(revise, "preset_tables", lambda name: (name, changed[name]))
    last = revisions.present("slap")
    assert revise.revised(kept, shipped_folder(), [*NAMES, "new"]) == [f"slap@{last + 1}: neck.relief", "new@1"]
    assert kept["slap"]["before"][str(last)]["changed"] == {"neck.relief": before["slap"]["neck"]["relief"]}
    monkeypatch.setattr(revisions, "revisions", lambda: kept)
    assert revisions.earlier("slap", last, changed["slap"]) == before["slap"]
    changed["slap"]["neck"]["relief"] = "0.45 mm"
    with pytest.raises(SystemExit, match=f"is not as its revision {last + 1} there"):
        revise.revised(kept, shipped_folder(), NAMES)


def test_own_tables_of_an_earlier_one_are_whole(second: None) -> None:
    label, tables = own_tables("jazz-finger@2")
    assert label == "jazz-finger@2" and "like" not in tables and tables["neck"]["relief"] == "0.5 mm"


def test_numbers_of_thousands_of_digits_are_one_clear_line(tmp_path: Path) -> None:
    """Python advises programmers to raise its limit of digits."""
    with pytest.raises(PresetError, match="slap has revision") as error:
        load_preset("slap@" + "9" * 5000)
    (path := tmp_path / "a.toml").write_text('like = "slap"\nformat = ' + "9" * 5000)
    with pytest.raises(PresetError, match=r"a\.toml: not TOML: a number has thousands of digits$"):
        load_preset(str(path))
    assert "digits;" not in str(error.value)
