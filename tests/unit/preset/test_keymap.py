"""Custom key maps: the allowed file contents, and the messages about wrong ones."""

from __future__ import annotations

from pathlib import Path

import pytest
from support.command import Run

from livebass import PresetError, load_preset
from livebass.model.keymap import COUNTING, MAPS, MODO, named_keys
from livebass.preset.keymap import key_map_text, load_key_map
from livebass.preset.load import preset_text


def write(tmp_path: Path, text: str) -> str:
    path = tmp_path / "mine.toml"
    path.write_text(text)
    return str(path)


@pytest.mark.parametrize("name", MAPS)
def test_what_is_printed_is_read_again(name: str, tmp_path: Path, run: Run) -> None:
    status, out, err = run("presets", "keymap", name)
    assert (status, err) == (0, "") and out == key_map_text(MAPS[name])
    again = load_key_map(write(tmp_path, out))
    assert sorted(again.keys) == sorted(MAPS[name].keys) and again.over_notes == MAPS[name].over_notes
    assert sorted(again.controllers) == sorted(MAPS[name].controllers)


def test_a_file_says_what_it_changes(tmp_path: Path) -> None:
    keys = load_key_map(write(tmp_path, "[keys]\nghost = [22, 100]\nhand = 120\n[strings]\nBb = 3\n"))
    assert keys.keys[:1] == ((3, "string", 10),) and keys.over_notes
    assert set(keys.keys[1:]) == {(22, "ghost", 0), (100, "ghost", 0), *((119 + k, "hand", k) for k in range(1, 9))}
    assert keys.controllers == MODO.controllers
    keys = load_key_map(write(tmp_path, "[controllers]\nvibrato = 20\nplace = [3, 16]\n"))
    assert keys.keys == MODO.keys and keys.over_notes is False
    assert keys.controllers == ((20, "vibrato"), (3, "place"), (16, "place"))


WRONG = [
    ("", ["empty; a key map needs [strings], [keys] or [controllers]"]),
    ("[keys", ["not TOML"]),
    ("[kees]\nghost = 1", ["kees: unknown; nearest: keys"]),
    ("over_notes = 1", ["over_notes must be true or false"]),
    ("keys = 3", ["keys must be a table, [keys], not 3"]),
    ("[keys]\ngohst = 10", ["keys.gohst = 10: unknown technique; nearest: ghost"]),
    ("[keys]\nstring = 10", ["keys.string = 10: unknown technique"]),
    *(
        (f"[keys]\nghost = {bad}", ["keys.ghost must be a key from 0 to 127, or a list of them"])
        for bad in ("128", "-1", "1.0", "true", '"C1"', "[3, 200]", "{}")
    ),
    ("[keys]\nghost = 10\npalm_mute = [3, 10]", ["keys.palm_mute = 10: is keys.ghost already; a key does one thing"]),
    ("[strings]\nE = 89\n[keys]\nhand = 80", ["keys.hand = 89: is strings.E already"]),
    ("[strings]\nH = 3", ["strings.H = 3: unknown string; strings are open notes such as E or Bb"]),
    ("[controllers]\nvibarto = 1", ["controllers.vibarto = 1: unknown function; nearest: vibrato"]),
    *(
        (f"[controllers]\nvibrato = {bad}", ["controllers.vibrato must be a controller from 0 to 119 except 6, 38"])
        for bad in ("6", "38", "100", "120", "127", "-1", "[1, 101]")
    ),
    ("[controllers]\nvibrato = 9\npalm_mute = 9", ["controllers.palm_mute = 9: is controllers.vibrato already"]),
]


@pytest.mark.parametrize(("text", "said"), WRONG, ids=[text.replace("\n", " ") or "empty" for text, _ in WRONG])
def test_a_wrong_file_is_one_line(text: str, said: list[str], tmp_path: Path, run: Run) -> None:
    path = write(tmp_path, text)
    for command in (("presets", "keymap", path), ("render", "--note", "E1", "--keys", path, "-o", tmp_path / "a.wav")):
        status, out, err = run(*command)
        assert status != 0 and not out and err.count("\n") == 1 and "mine.toml: " in err
        assert all(part in err for part in said), err


def test_maps_that_there_are_not(tmp_path: Path, run: Run) -> None:
    with pytest.raises(PresetError, match=r'key map "mod": unknown; nearest: modo.*; a file needs a path'):
        load_key_map("mod")
    status, _, err = run("presets", "keymap", str(tmp_path / "no.toml"))
    assert status != 0 and "no such file; shipped key maps: modo, modo-12" in err and err.count("\n") == 1


def test_a_preset_names_its_map_from_where_it_is(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, run: Run) -> None:
    (tmp_path / "bass").mkdir()
    own = tmp_path / "bass" / "own.toml"
    text = preset_text("jazz-finger")
    own.write_text(text.replace("[player]\n", '[player]\nkeys = "mine.toml"\nvelocity_curve = [[1, 20], [127, 127]]\n'))
    write(tmp_path / "bass", "[keys]\nghost = 99\n")
    monkeypatch.chdir(tmp_path)
    player = load_preset("bass/own.toml").player
    assert player.keys.keys == ((99, "ghost", 0),) and player.velocity_curve == ((1.0, 20.0), (127.0, 127.0))
    status, out, _ = run("presets", "check", "bass/own.toml")
    assert status == 0 and "good" in out
    (tmp_path / "bass" / "mine.toml").unlink()
    with pytest.raises(PresetError, match=r"^bass/own.toml: player.keys: bass/mine.toml: no such file"):
        load_preset("bass/own.toml")


@pytest.mark.parametrize(
    "bad", ['"sofd"', "0.1", "6", "true", "[]", "[[1, 1], [1, 2]]", "[[0, 1]]", "[[1, 128]]", "[1]"]
)
def test_a_curve_that_is_none(bad: str, tmp_path: Path) -> None:
    path = write(tmp_path, preset_text("jazz-finger").replace("[player]\n", f"[player]\nvelocity_curve = {bad}\n"))
    with pytest.raises(PresetError, match=r"player\.velocity_curve must be linear, soft, hard, an exponent"):
        load_preset(path)


@pytest.mark.parametrize("bad", ["9", "0", "loud", "1:1,64:x", "1:1:1", "64:1,1:64"])
def test_a_curve_of_the_command_line_that_is_none(bad: str, tmp_path: Path, run: Run) -> None:
    status, _, err = run("render", "--note", "E1", "--velocity-curve", bad, "-o", tmp_path / "a.wav")
    assert status == 2 and err.count("\n") == 1 and "must be linear, soft, hard" in err and bad in err


def test_keys_have_names_and_numbers() -> None:
    """By the counting in which key 60 is C4; a sentence gives the other, of half of the DAWs."""
    assert named_keys((28,)) == "E1 (28)" and named_keys((20, 113)) == "G#0 F8 (20 113)" and named_keys(()) == ""
    assert named_keys(range(89, 113)) == "F6 to E8 (89 to 112)" and named_keys((89, 90)) == "F6 F#6 (89 90)"
    assert COUNTING == "C4 is key 60; DAWs that call it C3 show names an octave lower: E1 as E0"
    text = key_map_text(load_key_map("modo"))
    assert COUNTING in text.splitlines()[0] and "\nE = 16  # E0\n" in text and "\npick = 15  # D#0, press: " in text
    assert "\nthumb_on_all = [20, 113]  # G#0 F8, press: " in text and "\nplace = 3  # plucking" in text
