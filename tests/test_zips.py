"""The archives for those without Python: the same bytes each time, whole plugins, a binary for two processors."""

from __future__ import annotations

import importlib.util
import io
import struct
import sys
import zipfile
from contextlib import closing
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest
from support.clap import Plugin
from support.plugins import hard_score, mono

from livebass import load_preset
from livebass.plugin import clap, lv2, vst3
from livebass.plugin.build import binary
from livebass.plugin.bundle import instrument_files
from livebass.plugin.systems import FOLDERS, SYSTEMS, this_system

ROOT = Path(__file__).parents[1]
BUNDLES = {"LV2/livebass.lv2": lv2, "CLAP/livebass-clap": clap, "VST3/livebass.vst3": vst3}
X86, ARM = 0x01000007, 0x0100000C  # of <mach/machine.h>
MAC = {
    "macos-x86_64": struct.pack("<III", 0xFEEDFACF, X86, 3) + b"x" * 50_000,
    "macos-arm64": struct.pack("<III", 0xFEEDFACF, ARM, 0) + b"a" * 9,
}
BINARIES = {"linux-x86_64": b"\x7fELF", "linux-aarch64": b"\x7fELF arm", **MAC, "windows-x86_64": b"MZ"}
PAGE = b"<!DOCTYPE html>"


@pytest.fixture(scope="module")
def zips() -> ModuleType:
    """The module tools/zips.py."""
    spec = importlib.util.spec_from_file_location("zips", ROOT / "tools" / "zips.py")
    assert spec and spec.loader
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


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
        "LV2", "CLAP", "VST3", "README.txt", "LICENSE.txt", "LICENSE-DejaVu.txt", "livebass.html",
    }  # fmt: skip
    code = zips.universal(list(MAC.values())) if name == "macos" else BINARIES[name]
    for place, module in BUNDLES.items():
        bundle = folder / place
        assert module.is_bundle(sorted(bundle.iterdir())), "an export replaces it"
        files = [path for path in bundle.rglob("*") if path.is_file()]
        programs = [path for path in files if path.read_bytes() == code]
        assert len(programs) == 1 and any(path.name == "slap.lbass" for path in files)
    for entry in entries:
        program = (tmp_path / entry.filename).read_bytes() == code
        assert entry.external_attr >> 16 & 0o777 == (0o755 if program else 0o644)
    assert (folder / "livebass.html").read_bytes() == PAGE
    assert (folder / "LICENSE.txt").read_bytes() == (ROOT / "LICENSE").read_bytes()
    lines = (folder / "README.txt").read_text().splitlines()
    assert len(lines) == 3 and all(place in lines[0] for place in FOLDERS[name.partition("-")[0]].values())
    assert all(place in lines[0] for place in BUNDLES)


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
def test_what_is_unpacked_plays(zips: ModuleType, tmp_path: Path) -> None:
    name = this_system().name
    with zipfile.ZipFile(io.BytesIO(archive(zips, name, {name: binary(this_system())}))) as packed:
        packed.extractall(tmp_path)
    score = hard_score(notes=2)
    with closing(Plugin(tmp_path / zips.title(name) / "CLAP" / "livebass-clap")) as plugin:
        sound = mono("slap", score)
        assert np.array_equal(plugin.play(score, len(sound)), sound)
    assert set(SYSTEMS) == set(BINARIES)
