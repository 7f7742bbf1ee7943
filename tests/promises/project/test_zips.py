"""The archives for users without Python: the same bytes each time, whole plugins, a binary for two processors."""

from __future__ import annotations

import io
import struct
import zipfile
from pathlib import Path

import pytest
from support.archives import PAGE, archive, zips
from support.places import ROOT

from livebass.model.keymap import COUNTING
from livebass.plugin import clap, lv2, vst3
from livebass.plugin.systems import FOLDERS, SYSTEMS
from livebass.preset.sounds import sound_title, sounds_of

BUNDLES = {"LV2/livebass.lv2": lv2, "CLAP/livebass-clap": clap, "VST3/livebass.vst3": vst3}
X86, ARM = 0x01000007, 0x0100000C  # from <mach/machine.h>
MAC = {
    "macos-x86_64": struct.pack("<III", 0xFEEDFACF, X86, 3) + b"x" * 50_000,
    "macos-arm64": struct.pack("<III", 0xFEEDFACF, ARM, 0) + b"a" * 9,
}
BINARIES = {"linux-x86_64": b"\x7fELF", "linux-aarch64": b"\x7fELF arm", **MAC, "windows-x86_64": b"MZ"}


def test_each_system_has_an_archive_and_macos_one_for_both_processors() -> None:
    assert zips.archives(BINARIES) == {
        **{name: {name: BINARIES[name]} for name in ("linux-x86_64", "linux-aarch64", "windows-x86_64")},
        "macos": MAC,
    }
    assert not zips.archives({"macos-arm64": b""}), "half of one"


@pytest.mark.parametrize("name", ["linux-x86_64", "linux-aarch64", "windows-x86_64", "macos"])
def test_an_archive_holds_plugins_page_licence_and_three_lines(name: str, tmp_path: Path) -> None:
    of = zips.archives(BINARIES)[name]
    data = archive(name, of)
    assert data == archive(name, of), "two builds give the same bytes"
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


def test_a_binary_for_two_processors() -> None:
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


def test_each_system_is_known() -> None:
    assert set(SYSTEMS) == set(BINARIES)
