"""Files of a later format are refused in one line, and renamed keys are read, with a word."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import mido
import pytest
from support.command import Run, refusal

from livebass import __version__, load_preset, read_score
from livebass.cli import play_settings
from livebass.files import formats
from livebass.preset.keymap import load_key_map
from livebass.score.reading import TAKE
from livebass.score.takes import text_of

LATER = f"format = 2: made for a later livebass; this one, {__version__}, reads format 1"
PRESET = 'like = "slap"\nname = "Mine"\n'
WRONG = ("0", "-1", "1.5", '"1"', "true", "[]")


def test_a_preset_says_its_format_or_has_the_first(tmp_path: Path, run: Run) -> None:
    file = tmp_path / "mine.toml"
    file.write_text(PRESET)
    wanted = load_preset(file)
    file.write_text(f"format = 1\n{PRESET}")
    assert load_preset(file) == wanted
    file.write_text(f"format = 2\n{PRESET}")
    assert f"{file}: {LATER}" in refusal(run, "presets", "check", file, status=1)
    (tmp_path / "other.toml").write_text('like = "mine.toml"\n')
    with pytest.raises(ValueError, match=r"other.toml: like = .mine.toml.: .*format = 2: made for a later livebass"):
        load_preset(tmp_path / "other.toml")


@pytest.mark.parametrize("value", WRONG)
def test_a_wrong_number_is_refused(value: str, tmp_path: Path) -> None:
    (tmp_path / "mine.toml").write_text(f"format = {value}\n{PRESET}")
    with pytest.raises(ValueError, match=r"mine.toml: format .*a whole number from 1 to 1"):
        load_preset(tmp_path / "mine.toml")


def test_key_maps_and_settings_of_a_later_format(tmp_path: Path) -> None:
    file = tmp_path / "later.toml"
    file.write_text("format = 1\nover_notes = false\n[keys]\npick = 20\n")
    assert load_key_map(str(file)).keys
    file.write_text("format = 2\n[keys]\npick = 20\n")
    with pytest.raises(ValueError, match="format = 2: made for a later livebass"):
        load_key_map(str(file))
    file.write_text('format = 1\npreset = "slap"\n')
    assert play_settings.load(file).preset == "slap"
    file.write_text('format = 2\npreset = "slap"\n')
    with pytest.raises(play_settings.DamagedSettings, match="format = 2: made for a later livebass"):
        play_settings.load(file)


@pytest.mark.parametrize("given, known", [({}, True), ({"format": "1"}, True), ({"format": "2"}, False)])
def test_a_bass_of_a_take_in_a_later_format_is_left_out(given: dict[str, str], known: bool, tmp_path: Path) -> None:
    """The notes play, on the bass of the take's program, and a remark says so."""
    track = mido.MidiTrack(
        [mido.MetaMessage("text", text=TAKE), mido.MetaMessage("text", text=text_of("slap@1", given))]
    )
    track += [mido.Message("note_on", note=40, velocity=v, time=500) for v in (90, 0)]
    mido.MidiFile(type=0, tracks=[track]).save(tmp_path / "take.mid")
    score = read_score(tmp_path / "take.mid", rate=48000)
    assert [bass.preset for bass in score.basses] == ["slap@1"] * known
    assert any("names no bass" in remark for remark in score.remarks) == (not known)


def test_renamed_keys_are_read_and_named(monkeypatch: pytest.MonkeyPatch, tmp_path: Path, run: Run) -> None:
    renamed: dict[str, Any] = {"preset": {"neck.hollow": "neck.relief", "title": "name"}, "key map": {}, "settings": {}}
    monkeypatch.setattr(formats, "RENAMED", renamed)
    file = tmp_path / "mine.toml"
    file.write_text('like = "slap"\ntitle = "Mine"\n[neck]\nhollow = "0.4 mm"\n')
    old = load_preset(file)
    status, out, err = run("presets", "check", file)
    assert status == 0 and not err
    assert "neck.hollow is called neck.relief now" in out and "title is called name now" in out
    file.write_text('like = "slap"\nname = "Mine"\n[neck]\nrelief = "0.4 mm"\n')
    assert load_preset(file) == old
    monkeypatch.setitem(renamed, "preset", {"bench.string_height": "bench.action"})
    made = []
    for symbol in ("string_height", "action"):
        file.write_text(f'like = "slap"\n[bench]\n{symbol} = -0.25\n')
        made.append(load_preset(file))
    assert made[0] == made[1] != load_preset("slap"), "a slider of a plugin, in a saved preset"
    assert "is called" not in run("presets", "check", file)[1]
