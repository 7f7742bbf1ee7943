"""A tablature as an export writes it."""

from __future__ import annotations

from pathlib import Path

from support.command import Run
from support.pages import page_of
from support.tabs import as_gp5, beats, note, song, tab

from livebass.cli.hands import SOUND, Loader
from livebass.preset.load import load_preset
from livebass.web.tab import Opener

LOAD = Loader(dict.fromkeys(SOUND))


def test_a_page_is_exported_with_its_tablature_and_bass(run: Run, tmp_path: Path) -> None:
    (tmp_path / "song.gp5").write_bytes(as_gp5(song()))
    status, _, err = run("export", "web", "--tab", str(tmp_path / "song.gp5"), "-o", str(tmp_path / "page"), "--single")
    assert status == 0 and "plays track 1" in err, err
    data = page_of(tmp_path / "page" / "livebass.html")
    assert [bass["name"] for bass in data["basses"]] == ["jazz-finger"]
    assert [string["note"] for string in data["basses"][0]["strings"]] == [26, 33, 38, 43]
    assert data["tab"]["bars"][1] == [1.0, 2, "Riff"] and data["tab"]["strokes"][1] == [0.25, 0.5, 0, 5, "pluck"]
    status, _, err = run("export", "web", "--track", "2", "-o", str(tmp_path / "other"))
    assert status == 2 and "--track is for a --tab" in err


def test_the_bass_of_the_page_plays_a_tablature_in_its_tuning() -> None:
    basses = {"jazz-finger": load_preset("jazz-finger")}
    files: dict[str, bytes] = {}
    opener = Opener(basses, files, LOAD)
    assert opener.open(as_gp5(tab(beats(note(0, 3)))), "a.gp5")["bass"] == "jazz-finger" and not files
    assert opener.open(as_gp5(song()), "b.gp5")["shown"]["title"].endswith("D1 A1 D2 G2")
    assert opener.open(as_gp5(song()), "b.gp5")["bass"] == "jazz-finger-2" and len(files) == 1
