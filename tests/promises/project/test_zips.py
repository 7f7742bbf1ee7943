"""The archives for users without Python: the same bytes each time, whole plugins, a binary for two processors."""

from __future__ import annotations

import io
import re
import shutil
import struct
import sys
import zipfile
from contextlib import closing
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest
from support.clap import Library, Plugin, midi, note_on, value
from support.jack import wait_for
from support.places import ROOT
from support.plugins import hard_score, mono
from support.programs import load
from support.screen import needs_screen, running_screen
from support.window import Window, different

from livebass import load_preset
from livebass.arrays import Floats
from livebass.model.keymap import COUNTING
from livebass.plugin import clap, lv2, vst3
from livebass.plugin.build import binary
from livebass.plugin.bundle import instrument_files
from livebass.plugin.systems import FOLDERS, SYSTEMS, this_system
from livebass.preset.sounds import sound_title, sounds_of
from livebass.techniques import SLIDER_ROWS

BUNDLES = {"LV2/livebass.lv2": lv2, "CLAP/livebass-clap": clap, "VST3/livebass.vst3": vst3}
X86, ARM = 0x01000007, 0x0100000C  # from <mach/machine.h>
MAC = {
    "macos-x86_64": struct.pack("<III", 0xFEEDFACF, X86, 3) + b"x" * 50_000,
    "macos-arm64": struct.pack("<III", 0xFEEDFACF, ARM, 0) + b"a" * 9,
}
BINARIES = {"linux-x86_64": b"\x7fELF", "linux-aarch64": b"\x7fELF arm", **MAC, "windows-x86_64": b"MZ"}
PAGE = b"<!DOCTYPE html>"


@pytest.fixture(scope="module")
def zips() -> ModuleType:
    return load("zips")


def archive(zips: ModuleType, name: str, binaries: dict[str, bytes]) -> bytes:
    """An archive of one bass."""
    basses = {"slap": load_preset("slap")}
    made = zips.archive(name, binaries, basses, instrument_files(basses), PAGE)
    assert isinstance(made, bytes)
    return made


def test_each_system_has_an_archive_and_macos_one_for_both_processors(zips: ModuleType) -> None:
    assert zips.archives(BINARIES) == {
        **{name: {name: BINARIES[name]} for name in ("linux-x86_64", "linux-aarch64", "windows-x86_64")},
        "macos": MAC,
    }
    assert not zips.archives({"macos-arm64": b""}), "half of one"


@pytest.mark.parametrize("name", ["linux-x86_64", "linux-aarch64", "windows-x86_64", "macos"])
def test_an_archive_holds_plugins_page_licence_and_three_lines(zips: ModuleType, name: str, tmp_path: Path) -> None:
    of = zips.archives(BINARIES)[name]
    data = archive(zips, name, of)
    assert data == archive(zips, name, of), "two builds give the same bytes"
    with zipfile.ZipFile(io.BytesIO(data)) as packed:
        entries = packed.infolist()
        packed.extractall(tmp_path)
    assert {entry.date_time for entry in entries} == {(1980, 1, 1, 0, 0, 0)}
    assert [entry.filename for entry in entries] == sorted(entry.filename for entry in entries)
    (folder,) = tmp_path.iterdir()
    assert f"{folder.name}.zip" == f"{zips.title(name)}.zip" and folder.name.endswith(name)
    assert {path.name for path in folder.iterdir()} == {
        "LV2", "CLAP", "VST3", "VST3 Presets", "INSTALL.txt", "LICENSE.txt", "LICENSE-DejaVu.txt", "livebass.html",
    }  # fmt: skip
    code = zips.universal(list(MAC.values())) if name == "macos" else BINARIES[name]
    for place, module in BUNDLES.items():
        bundle = folder / place
        assert module.is_bundle(sorted(bundle.iterdir())), "an export replaces it"
        files = [path for path in bundle.rglob("*") if path.is_file()]
        programs = [path for path in files if path.read_bytes() == code]
        assert len(programs) == 1 and any(path.name == "slap.lbass" for path in files)
    presets = {path.stem for path in (folder / "VST3 Presets" / "livebass").iterdir()}
    assert presets == {sound_title(name) for name in sounds_of("slap")} and presets
    for entry in entries:
        program = (tmp_path / entry.filename).read_bytes() == code
        assert entry.external_attr >> 16 & 0o777 == (0o755 if program else 0o644)
    assert (folder / "livebass.html").read_bytes() == PAGE
    assert (folder / "LICENSE.txt").read_bytes() == (ROOT / "LICENSE").read_bytes()
    lines = (folder / "INSTALL.txt").read_text().splitlines()
    said = {"linux": "", "windows": "under Wine only", "macos": "nobody has run them on a Mac"}[name.partition("-")[0]]
    assert said in lines[0] and (said or "Wine" not in lines[0])
    assert len(lines) == 3 and all(place in lines[0] for place in FOLDERS[name.partition("-")[0]].values())
    assert all(place in lines[0] for place in BUNDLES)
    assert "Play MIDI notes from E1 (28) up" in lines[2] and COUNTING in lines[2]


def test_a_binary_for_two_processors(zips: ModuleType) -> None:
    """Checked against <mach-o/fat.h>: numbers big-endian, each part at a multiple of its alignment."""
    made = zips.universal(list(MAC.values()))
    magic, count = struct.unpack_from(">II", made)
    assert (magic, count) == (0xCAFEBABE, 2)
    end = 8 + 20 * count
    for k, (kind, subtype, code) in enumerate([(X86, 3, MAC["macos-x86_64"]), (ARM, 0, MAC["macos-arm64"])]):
        found_kind, found_subtype, start, size, alignment = struct.unpack_from(">5I", made, 8 + 20 * k)
        assert (found_kind, found_subtype, size, alignment) == (kind, subtype, len(code), 14)
        assert start >= end and start % (1 << alignment) == 0 and made[start : start + size] == code
        end = start + size
    assert len(made) == end


@pytest.mark.skipif(sys.platform != "linux", reason="this system's archive is unpacked on Linux")
def test_a_producers_first_ten_minutes(zips: ModuleType, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Unpack, copy as the text says, find, load, look, play, change the action, save, load, automate, bounce."""
    needs_screen()
    name, home = this_system().name, tmp_path / "home"
    data, score = archive(zips, name, {name: binary(this_system())}), hard_score(notes=2)
    sound = mono("slap", score)
    monkeypatch.setenv("HOME", str(home))
    with zipfile.ZipFile(io.BytesIO(data)) as packed:
        packed.extractall(home / "Downloads")
    (unpacked,) = (home / "Downloads").iterdir()
    said = re.search(r"(CLAP/[\w-]+) into ([^\s,]+)", (unpacked / "INSTALL.txt").read_text())
    assert said
    where = Path(said[2]).expanduser()
    shutil.copytree(unpacked / said[1], where / Path(said[1]).name)
    shutil.rmtree(unpacked)

    (found,) = [path for path in (home / ".clap").rglob("*.clap") if path.is_file()]
    assert [key for key, *_ in Library(found.parent).presets()] == ["Slap", "Bright slap", "Slap funk"]
    action = SLIDER_ROWS["action"].parameter.number
    with closing(Plugin(found.parent)) as plugin:
        assert np.array_equal(plugin.play(score, len(sound)), sound), "what `render` makes"
        with running_screen(), closing(Window(plugin)) as window:
            rest = window.picture()
            plugin.block(512, [note_on(28, 1.0)])
            wait_for(lambda: different(window.picture(), rest) > 200)
        plugin.set(action, -0.8)
        state = plugin.save()

    def bounce(events: list[tuple[int, Any]]) -> Floats:
        with closing(Plugin(found.parent, active=False)) as again:
            assert again.load(state) and again.value(action) == -0.8
            again.offline()
            again.activate()
            return again.play(events, len(sound))

    third = len(sound) // 3 // 512 * 512  # between two blocks
    played = [(int(f), midi(m.tobytes())) for f, m in zip(score.frames, score.messages, strict=True)]
    automated = sorted([*played, (third, value(action, 0.5))], key=lambda event: event[0])
    lowered, moved, again = bounce(played), bounce(automated), bounce(automated)
    assert np.array_equal(moved, again)
    assert 0.05 * np.abs(sound).max() < np.abs(lowered - sound).max()
    assert np.array_equal(moved[:third], lowered[:third]) and not np.array_equal(moved[third:], lowered[third:])
    assert sorted(path.name for path in home.iterdir()) == [".clap", "Downloads"], "nothing else is left"


def test_each_system_is_known(zips: ModuleType) -> None:
    assert set(SYSTEMS) == set(BINARIES)
