"""Sounds that are saved in the plugin's window: files in the user's folder, whole or not at all."""

from __future__ import annotations

import resource
import shutil
import signal
from collections.abc import Iterator
from contextlib import closing
from dataclasses import replace
from pathlib import Path

import pytest
from support.clap import Plugin
from support.picture import Host, library, number, shelf

from livebass import load_preset
from livebass.live.parameters import PARAMETERS
from livebass.plugin import clap
from livebass.plugin.instrument import write_instrument

NAMES = ("slap", "five-string")
OF_NO_SOUND = ("bass", "quality", "running_ahead", "relief", "cores")
ENDING = ".lbsound"
GAIN, BASS, QUALITY = number("gain"), number("bass"), number("quality")


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return shelf(tmp_path_factory.mktemp("sounds"), NAMES)


@pytest.fixture
def own(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The user's folder; it and those above it are made when something is written."""
    monkeypatch.setenv("XDG_DATA_HOME", str(tmp_path / "a" / "b"))
    return tmp_path / "a" / "b" / "livebass"


@pytest.fixture
def host(folder: Path, own: Path) -> Iterator[Host]:
    made = Host(folder)
    yield made
    made.close()


def test_a_sound_is_the_bass_and_all_that_is_no_matter_of_the_processor(host: Host, folder: Path, own: Path) -> None:
    changed = {
        p.symbol: (p.least if p.least != p.usual else p.most) for p in PARAMETERS if p.symbol not in ("bass", "cores")
    }
    for symbol, value in {**changed, "bass": 1.0}.items():
        host.set(symbol, value)
    assert host.save_sound() == f"{load_preset('five-string').name} 1"
    assert not any(file.suffix != ENDING for file in own.iterdir())
    other = Host(folder)
    other.set("quality", 0.0)
    before = {p.symbol: other.value(p.symbol) for p in PARAMETERS}
    assert other.sounds() == [f"{load_preset('five-string').name} 1"]
    assert library().lb_load_sound(other.address, 0)
    for p in PARAMETERS:
        wanted = before[p.symbol] if p.symbol in OF_NO_SOUND else changed[p.symbol]
        assert other.value(p.symbol) == (1 if p.symbol == "bass" else wanted), p.symbol
    library().lb_undo(other.address)
    assert {p.symbol: other.value(p.symbol) for p in PARAMETERS} == before
    other.close()


def test_undo_brings_back_a_bass_that_is_not_installed(host: Host, folder: Path, tmp_path: Path, own: Path) -> None:
    """What was taken in its place is not saved for it."""
    other = shutil.copytree(folder, tmp_path / "other")
    (other / "slap.lbass").rename(other / "lost.lbass")
    (other / "instruments.txt").write_text("lost\n")
    there = Host(other)
    state = there.save()
    there.close()
    assert b"lost\0" in state and host.save_sound() and host.load(state) and host.save() == state
    assert host.sounds() and library().lb_load_sound(host.address, 0)
    assert b"slap\0" in host.save()
    library().lb_undo(host.address)
    assert host.save() == state


def test_names_are_the_basss_title_and_the_next_number(host: Host, own: Path) -> None:
    """Nothing is written over; files that the user renames are listed by their names, numbers in order."""
    assert [host.save_sound() for _ in range(3)] == ["Slap 1", "Slap 2", "Slap 3"]
    first = (own / f"Slap 1{ENDING}").read_bytes()
    host.set("gain", -5.0)
    (own / f"Slap 2{ENDING}").rename(own / f"Verse, très doux 10{ENDING}")
    assert [host.save_sound(), host.save_sound()] == ["Slap 2", "Slap 4"]
    (own / f"Slap 4{ENDING}").rename(own / f"Slap 10{ENDING}")
    assert host.sounds() == ["Slap 1", "Slap 2", "Slap 3", "Slap 10", "Verse, très doux 10"]
    assert (own / f"Slap 1{ENDING}").read_bytes() == first
    library().lb_remove_sound(host.address, 0)
    assert host.sounds() == ["Slap 2", "Slap 3", "Slap 10", "Verse, très doux 10"]


def test_titles_become_names_of_files_of_any_system(own: Path, tmp_path: Path) -> None:
    titles = ['.a/b\\c:d*e?f"g<h>i|j', "é" * 31]
    for k, title in enumerate(titles):
        write_instrument(replace(load_preset("slap"), name=title), tmp_path / f"{k}.lbass")
    (tmp_path / "instruments.txt").write_text("0\n1\n")
    host = Host(tmp_path)
    assert host.save_sound() == "-a-b-c-d-e-f-g-h-i-j 1"
    host.set("bass", 1.0)
    assert host.save_sound() == f"{titles[1]} 1"
    assert len(host.sounds()) == 2
    host.close()


def test_what_is_no_sound_is_left_out_with_a_line(
    host: Host, folder: Path, own: Path, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    """Damaged, of a later version, a state of a session, or of a bass that is not there: nothing changes."""
    host.set("gain", -6.0)
    host.save_sound()
    good = (own / f"Slap 1{ENDING}").read_bytes()
    wrong = {
        "cut": (good[:-8], "is damaged"), "changed": (good[:120] + b"?" + good[121:], "is damaged"),
        "empty": (b"", "is not one of this plugin"), "huge": (good + bytes(1 << 17), "is damaged"),
        "later": (good[:8] + b"\7" + good[9:], "was written by another version of the plugin"),
        "session": (host.save(), "is not one of this plugin"),
    }  # fmt: skip
    for name, (data, _) in wrong.items():
        (own / f"{name}{ENDING}").write_bytes(data)
    (own / "mine.lbass.txt").write_text("no sound")
    (own / f"folder{ENDING}").mkdir()
    capfd.readouterr()
    assert host.sounds() == ["Slap 1"]
    lines = sorted(capfd.readouterr().err.splitlines())
    expected = [f"{own}/{name}{ENDING}: the sound {why}" for name, (_, why) in wrong.items()]
    expected.append(f"{own}/folder{ENDING}: the sound is not one of this plugin")
    assert lines == sorted(expected)
    host.set("gain", 2.0)
    (own / f"Slap 1{ENDING}").write_bytes(wrong["cut"][0])  # since it was listed
    before = host.save()
    assert not library().lb_load_sound(host.address, 0) and host.save() == before
    assert not library().lb_load_sound(host.address, 1) and not library().lb_load_sound(host.address, -1)
    (own / f"Slap 1{ENDING}").write_bytes(good)
    (tmp_path / "other").mkdir()
    write_instrument(load_preset("five-string"), tmp_path / "other" / "five-string.lbass")
    (tmp_path / "other" / "instruments.txt").write_text("five-string\n")
    other = Host(tmp_path / "other")
    capfd.readouterr()
    assert not other.sounds()
    assert f"{own}/Slap 1{ENDING}: the sound has a bass that is not installed" in capfd.readouterr().err
    other.close()


def test_a_folder_that_cannot_be_written_is_told_in_one_line(
    host: Host, own: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "a").write_text("a file in place of a folder")
    capfd.readouterr()
    assert host.save_sound() is None
    assert capfd.readouterr().err == f"{own}: the sound cannot be written\n"
    monkeypatch.delenv("XDG_DATA_HOME")
    monkeypatch.delenv("HOME")
    assert host.save_sound() is None and not host.sounds()
    assert capfd.readouterr().err.count("\n") == 1


def test_a_file_that_cannot_be_written_whole_is_not_there(host: Host, own: Path) -> None:
    host.save_sound()
    limit, before = resource.getrlimit(resource.RLIMIT_FSIZE), sorted(own.iterdir())
    old = signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    resource.setrlimit(resource.RLIMIT_FSIZE, (100, limit[1]))
    try:
        name = host.save_sound()
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limit)
        signal.signal(signal.SIGXFSZ, old)
    assert name is None and sorted(own.iterdir()) == before and host.sounds() == ["Slap 1"]


def test_browsers_of_clap_hosts_have_them(host: Host, folder: Path, own: Path, tmp_path: Path) -> None:
    """By their names; they are loaded in a plugin without a window, too."""
    host.set("gain", -6.0)
    host.set("bass", 1.0)
    host.save_sound()
    file = own / f"{load_preset('five-string').name} 1{ENDING}"
    file = file.rename(own / f"Low. End{ENDING}")
    (own / f"damaged{ENDING}").write_bytes(file.read_bytes()[:-8])
    clap.write_bundle({name: load_preset(name) for name in NAMES}, tmp_path / "livebass")
    with closing(Plugin(tmp_path / "livebass")) as plugin:
        presets = plugin.library.presets()
        assert [key for _, key, _ in presets] == [*NAMES, None] and presets[-1][0] == "Low. End"
        assert len(presets[-1][2]) == 2 and plugin.library.refused == ["is damaged"]
        plugin.set(QUALITY, 1.0)
        plugin.rescanned = 0
        assert plugin.load_sound(file) and plugin.rescanned == 1
        assert [plugin.value(k) for k in (GAIN, BASS, QUALITY)] == [-6, 1, 1]
        plugin.set(GAIN, 0.0)
        assert not plugin.load_sound(own / f"damaged{ENDING}") and not plugin.load_sound(own / "none")
        assert plugin.value(GAIN) == 0 and plugin.rescanned == 1
