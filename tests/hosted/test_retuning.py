"""The plugins follow a master of MTS-ESP: each note sounds as if the host had bent it."""

from __future__ import annotations

import ctypes as c
import shutil
import subprocess
from collections.abc import Iterator
from contextlib import closing
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from support import picture
from support.clap import Plugin, midi, note_off, note_on, tuning
from support.picture import Host, shelf
from support.places import SUPPORT

from livebass import load_preset
from livebass.plugin import clap
from livebass.plugin.build import compiler
from livebass.plugin.systems import this_system
from livebass.rows.arrays import Floats
from livebass.rows.techniques import PICKED

SOURCE = SUPPORT / "master.c"
KEY, OTHER = 40, 45
ON = 2  # the string that plays KEY
PICK = 15  # the key that chooses it
pytestmark = pytest.mark.skipif(this_system().ending != "so", reason="the library is built for Linux")


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    made = tmp_path_factory.mktemp("retuning") / "livebass"
    clap.write_bundle({"jazz-finger": load_preset("jazz-finger")}, made)
    with closing(Plugin(made)):  # it looks for a library once, before `master` names one
        return made


@pytest.fixture
def master(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Any:
    """The library; its master tunes every key as usual."""
    file = tmp_path / "master.so"
    subprocess.run([*compiler(this_system()), "-shared", "-fPIC", "-o", file, SOURCE], check=True)
    monkeypatch.setenv("LIVEBASS_MTS", str(file))
    library = c.CDLL(str(file))
    for name in ("hertz", "of_second"):
        (c.c_double * 128).in_dll(library, name)[:] = [440 * 2 ** ((key - 69) / 12) for key in range(128)]
    return library


@pytest.fixture
def plugin(folder: Path, master: Any, tmp_path: Path) -> Iterator[Plugin]:
    """A plugin whose code has looked for the library after the fixture `master` named it."""
    with closing(Plugin(shutil.copytree(folder, tmp_path / "own"))) as made:
        yield made


@pytest.fixture
def bent(folder: Path) -> Iterator[Plugin]:
    """A plugin without a master."""
    with closing(Plugin(folder)) as made:
        yield made


def retune(master: Any, key: int, semitones: float, table: str = "hertz") -> None:
    (c.c_double * 128).in_dll(master, table)[key] = 440 * 2 ** ((key + semitones - 69) / 12)


def set_number(master: Any, name: str, value: int) -> None:
    c.c_int.in_dll(master, name).value = value


def near(one: Floats, other: Floats) -> bool:
    """Logarithms round: the bends differ in the last digits."""
    return bool(np.abs(one - other).max() < 1e-5 * np.abs(other).max())


def test_notes_begin_and_go_on_as_the_master_tunes_them(plugin: Plugin, bent: Plugin, master: Any) -> None:
    """On top of the host's own bend; also a note that is held while the scale changes, or the master leaves."""
    set_number(master, "has_master", 1)
    retune(master, KEY, 0.31)
    start = note_on(KEY, 0.8)
    assert near(plugin.block(4096, [start]), bent.block(4096, [start, tuning(0.31, KEY)]))
    assert near(plugin.block(4096, [tuning(1.0, KEY)]), bent.block(4096, [tuning(1.31, KEY)]))
    retune(master, KEY, -0.4)
    assert near(plugin.block(4096), bent.block(4096, [tuning(0.6, KEY)]))
    set_number(master, "has_master", 0)
    changed, wanted = plugin.block(4096), bent.block(4096, [tuning(1.0, KEY)])
    assert near(changed, wanted) and not near(changed, 0 * changed + wanted[::-1])


def test_a_channel_may_have_a_scale_of_its_own(plugin: Plugin, bent: Plugin, master: Any) -> None:
    for name in ("has_master", "uses_second"):
        set_number(master, name, 1)
    retune(master, KEY, 0.5, "of_second")
    notes = [midi(bytes([0x91, KEY, 100])), midi(bytes([0x90, OTHER, 100]))]
    assert near(plugin.block(8192, notes), bent.block(8192, [notes[0], tuning(0.5, KEY, channel=1), notes[1]]))


def test_keys_outside_the_scale_are_silent(plugin: Plugin, master: Any) -> None:
    set_number(master, "has_master", 1)
    set_number(master, "left_out", KEY)
    for start in (note_on(KEY, 0.8), midi(bytes([0x90, KEY, 100]))):
        assert not plugin.block(2048, [start]).any() and not plugin.block(2048, [note_off(KEY)]).any()
    assert plugin.block(2048, [note_on(OTHER, 0.8)]).any()


def test_the_windows_own_notes_follow_the_master(master: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """As the host's do, while they are held, too; keys outside the scale are silent, but switches work."""
    fresh = picture.library.__wrapped__()  # it has not looked for a master's library yet
    monkeypatch.setattr(picture, "library", lambda: fresh)
    shelf(tmp_path, ["jazz-finger"])
    with closing(Host(tmp_path)) as window, closing(Host(tmp_path)) as host:
        set_number(master, "has_master", 1)
        for semitones in (0.31, -0.4):
            retune(master, KEY, semitones)
            if semitones > 0:
                window.touch(True, ON, KEY)
                host.midi(0x90, KEY, 95)
            assert np.array_equal(window.play(4096), host.play(4096))
        set_number(master, "left_out", OTHER)
        window.touch(True, 0, OTHER)
        assert np.array_equal(window.play(4096), host.play(4096))
        set_number(master, "left_out", PICK)
        for one, other in ((True, 0x90), (False, 0x80)):
            window.touch(one, 255, PICK)
            host.midi(other, PICK, 95)
            assert np.array_equal(window.play(4096), host.play(4096))
        for each in (window, host):
            each.midi(0x90, OTHER, 95)  # on the string of its choice
        assert np.array_equal(window.play(4096), host.play(4096))
        assert window.value("technique") == host.value("technique") == PICKED


def test_without_a_master_nothing_changes_and_each_instance_is_a_client(
    plugin: Plugin, bent: Plugin, master: Any
) -> None:
    retune(master, KEY, 0.5)
    clients = c.c_int.in_dll(master, "clients")
    assert clients.value == 1
    assert np.array_equal(plugin.block(4096, [note_on(KEY, 0.8)]), bent.block(4096, [note_on(KEY, 0.8)]))
    with closing(Plugin(plugin.library.file.parent)):
        assert clients.value == 2
    assert clients.value == 1
