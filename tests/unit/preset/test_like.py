"""Presets based on another: their keys replace the base's, and everything else stays."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import soundfile
from support.command import Run, refusal
from support.presets import STRING_A, STRING_G, load_text

from livebass import load_preset
from livebass.model.instrument import Instrument
from livebass.preset.build import PresetError
from livebass.preset.load import preset_tables, preset_text

BASE = f"""\
name = "Base"
[neck]
scale_length = "34 in"
action = ["2.4 mm", "2.2 mm"]
{STRING_A}core_diameter = "0.020 in"
{STRING_G}inharmonicity = 3.5e-5
neck = {{action = "1.9 mm", relief = "0.1 mm"}}
[[pickup]]
position = "150 mm"
level = 0.5
[[pickup]]
position = "60 mm"
[player]
hardest = 4
"""


def like(folder: Path, own: str, base: str = BASE) -> Instrument:
    """The bass of a file based on `base`."""
    (folder / "base.toml").write_text(base)
    return load_text(folder, 'like = "base.toml"\n' + own)


def write(folder: Path, *changes: tuple[str, str]) -> Instrument:
    """The bass of the whole BASE with some text replaced."""
    text = BASE
    for old, new in changes:
        assert text.count(old) == 1
        text = text.replace(old, new)
    return load_text(folder, text, "whole.toml")


def test_a_file_that_says_nothing_more_is_the_other_bass(tmp_path: Path) -> None:
    assert like(tmp_path, "") == write(tmp_path)
    assert load_text(tmp_path, 'like = "slap"\n') == load_preset("slap")


@pytest.mark.parametrize(
    "own, changes",
    [
        ('name = "Mine"\ncapo = 1\n', [('name = "Base"', 'name = "Mine"\ncapo = 1')]),
        ('[neck]\nrelief = "0.2 mm"\n', [('[neck]', '[neck]\nrelief = "0.2 mm"'), (', relief = "0.1 mm"', "")]),
        ('[neck]\naction = "2 mm"\n', [('["2.4 mm", "2.2 mm"]', '"2 mm"'), ('action = "1.9 mm", ', "")]),
        (
            '[[string]]\nname = "g"\nneck.action = "1.8 mm"\nneck.nut_height = "0.6 mm"\n',
            [('action = "1.9 mm"', 'action = "1.8 mm", nut_height = "0.6 mm"')],
        ),
        (
            '[[string]]\nname = "G"\nlevel = 2\n[[string]]\nname = "A"\ninharmonicity = 1e-4\n',
            [
                ("inharmonicity = 3.5e-5", "inharmonicity = 3.5e-5\nlevel = 2"),
                ('core_diameter = "0.020 in"', "inharmonicity = 1e-4"),
            ],
        ),
        ('[[pickup]]\n[[pickup]]\nposition = "70 mm"\n', [('"60 mm"', '"70 mm"')]),
        (
            "[player]\nsoftest = 0.2\n[coil]\ntone = 0.5\n",
            [("hardest = 4", "hardest = 4\nsoftest = 0.2\n[coil]\ntone = 0.5")],
        ),
    ],
    ids=["top", "neck", "neck of all strings", "neck of a string", "strings", "second pickup", "tables"],
)  # fmt: skip
def test_what_a_file_says_takes_the_place_of_what_is_there(
    tmp_path: Path, own: str, changes: list[tuple[str, str]]
) -> None:
    made, wanted = like(tmp_path, own), write(tmp_path, *changes)
    # a string's name stays as spelled in the changing file
    assert repr(made).replace("name='g'", "name='G'") == repr(wanted) and made != write(tmp_path)


def test_a_string_is_added_by_listing_all(tmp_path: Path) -> None:
    low = STRING_A.replace('"A"', '"B"').replace("A1", "B0").replace("215.5 N", "67.88 N")
    own = f'{low}core_diameter = "0.022 in"\n[[string]]\nname = "A"\n[[string]]\nname = "g"\nlevel = 2\n'
    base = BASE.replace('["2.4 mm", "2.2 mm"]', '"2.4 mm"')
    made = like(tmp_path, own, base)
    there = load_preset(tmp_path / "base.toml")
    assert [s.open_note for s in made.strings] == [23, 33, 43]
    assert made.strings[1] == there.strings[0] and made.strings[2].level == 2 and made.necks[2] == there.necks[1]
    assert len(like(tmp_path, own.rpartition("[[string]]")[0], base).strings) == 2  # a string that is not listed goes
    with pytest.raises(PresetError, match="two strings have this name"):
        like(tmp_path, own + '[[string]]\nname = "A"\n', base)


def test_measured_frets_take_the_place_of_geometry_and_the_other_way_round(tmp_path: Path) -> None:
    own = '[neck]\nfret_positions = ["48 mm", "94 mm"]\nfret_heights = ["-1 mm", "-1.25 mm"]\n'
    measured = like(tmp_path, own)
    assert [neck.fret_heights for neck in measured.necks] == [(-1e-3, -1.25e-3)] * 2
    base = BASE.replace('action = ["2.4 mm", "2.2 mm"]', own.removeprefix("[neck]\n"))
    base = base.replace('neck = {action = "1.9 mm", relief = "0.1 mm"}\n', "")
    back = like(tmp_path, '[neck]\naction = "2 mm"\nfrets = 12\n', base)
    assert [len(neck.fret_positions) for neck in back.necks] == [12, 12]
    assert back.necks[0].fret_heights[-1] == pytest.approx(-2e-3, abs=1e-12)


def test_paths_go_from_the_file_that_has_them(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    folder = tmp_path / "basses"
    folder.mkdir()
    soundfile.write(folder / "room.wav", np.r_[1.0, np.zeros(99), 0.5], 48000)
    (folder / "base.toml").write_text(BASE + '[effects]\nresponse = "room.wav"\n')
    (tmp_path / "mine.toml").write_text('like = "basses/base.toml"\n[effects]\ndrive = 0.5\n')
    monkeypatch.chdir("/")
    effects = load_preset(tmp_path / "mine.toml").effects
    assert effects.drive == 0.5 and effects.response and effects.response.count == 101


@pytest.mark.parametrize(
    "own, says",
    [
        ('like = "jaz-finger"', 'mine.toml: like = "jaz-finger": preset "jaz-finger": unknown; nearest: jazz-finger'),
        ('like = "none.toml"', "none.toml: no such file"),
        ("like = 3", "mine.toml: like must be the name of a preset"),
        ('like = "mine.toml"', "a chain of more than 8 presets"),
        ('like = "slap"\n[[string]]\nname = "H"', 'string[1].name = "H": the preset named by like has E, A, D, G'),
        ('like = "slap"\n[[string]]\nlevel = 1', "string[1].name: the preset named by like has E, A, D, G; say which"),
        ('like = "slap"\n' + 5 * "[[pickup]]\n", "5 of them; the preset named by like has"),
        ('like = "slap"\n[neck]\naction = "2"', "mine.toml: neck.action"),
        ('like = "slap"\n[nek]', "mine.toml: nek: unknown key; nearest: neck"),
        ('like = "slap"\nneck = 3', "mine.toml: neck"),
        ('like = "slap"\nstring = 3', "mine.toml: string"),
        ('like = "slap"\npickup = 3', "mine.toml: pickup"),
        ('like = "slap"\n[[string]]\nname = "E"\nneck = 3', "mine.toml: string[E].neck"),
    ],
)  # fmt: skip
def test_faults_are_one_line_that_names_the_file_and_the_key(tmp_path: Path, own: str, says: str) -> None:
    with pytest.raises(PresetError) as caught:
        load_text(tmp_path, own)
    assert says in str(caught.value) and str(caught.value).isprintable()


def test_the_commands_take_such_a_file(run: Run, tmp_path: Path) -> None:
    mine = tmp_path / "mine.toml"
    mine.write_text('like = "jazz-finger"\n[neck]\naction = "1.5 mm"\n')
    status, out, _ = run("presets", "check", mine)
    assert status == 0 and "good; Jazz bass, fingers, strings E A D G, 20 frets" in out
    status, out, _ = run("presets", "show", mine)
    assert status == 0 and out.startswith('like = "jazz-finger"\n')
    assert "neck.frets" not in out and "# Not set above, so at the default:" in out
    assert "like" not in preset_tables(mine)[1] and "#   output.across" in preset_text(mine)
    mine.write_text('like = "jazz-finger"\n[neck]\naction = "1.5 mm"\nfriction = "1 N/mm"\n')
    refusal(run, "presets", "check", mine)
