"""`livebass export lv2|clap|vst3|instrument`: bundles appear whole, and each error is one line."""

from __future__ import annotations

import os
import shutil
import socket
from collections.abc import Callable
from pathlib import Path

import platformdirs
import pytest
from support.command import Run, assert_one_clear_line, cli_text, refusal, small_files
from support.kept import image_made
from support.needs import CLOSED

from livebass import preset_names
from livebass.compiling import store
from livebass.engine.image import image_of
from livebass.plugin import build
from livebass.plugin.build import binary, name_of
from livebass.plugin.systems import FOLDERS, SYSTEMS, System, own_folder_of_plugins, this_system
from livebass.preset.sounds import sound_title, sounds_of
from livebass.system.extras import install

BUNDLES = {"lv2": "livebass.lv2", "clap": "livebass-clap", "vst3": "livebass.vst3"}
KINDS = [pytest.param(kind, id=kind) for kind in BUNDLES]


@pytest.fixture(autouse=True)
def elsewhere(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The working directory, empty except for the user's data directory."""
    binary(this_system())  # built before the tests restrict the environment
    monkeypatch.setenv("XDG_DATA_HOME", str(tmp_path / "data"))
    if "NUMBA_CACHE_DIR" not in os.environ:
        monkeypatch.setenv("NUMBA_CACHE_DIR", str(platformdirs.user_cache_path("livebass")))
    monkeypatch.setenv("HOME", str(tmp_path / "home"))
    return tmp_path


def contents(folder: Path) -> dict[str, bytes]:
    return {str(file.relative_to(folder)): file.read_bytes() for file in folder.rglob("*") if file.is_file()}


def own_preset(run: Run, file: Path) -> Path:
    file.write_text(cli_text(run, "presets", "show", "slap"))
    return file


@pytest.mark.parametrize("kind", KINDS)
def test_a_bundle_holds_every_preset_and_says_where_it_goes(run: Run, elsewhere: Path, kind: str) -> None:
    status, out, err = run("export", kind)
    assert status == 0 and not out, err
    written, advice = err.splitlines()
    assert written.startswith(f"{BUNDLES[kind]}: {len(preset_names())} basses") and this_system().name in written
    assert FOLDERS["linux"][kind] in advice
    files = contents(elsewhere / f"{BUNDLES[kind]}")
    assert {Path(name).stem for name in files if name.endswith(".lbass")} == set(preset_names())
    assert any(data == binary(this_system()) for data in files.values())
    assert [p.name for p in elsewhere.iterdir()] == [f"{BUNDLES[kind]}"]


@pytest.mark.parametrize("kind", KINDS)
def test_presets_are_chosen_and_an_older_bundle_is_replaced(run: Run, elsewhere: Path, kind: str) -> None:
    own_preset(run, elsewhere / "mine.toml")
    for presets, names in [
        (["-p", "fretless"], {"fretless"}),
        (["-p", "slap", "./mine.toml"], {"slap", "mine"}),
        (["-p", "slap", "-p", "jazz-finger"], {"slap", "jazz-finger"}),
    ]:
        status, _, err = run("export", kind, *presets, "-o", "made/here")
        assert status == 0, err
        files = contents(elsewhere / "made/here" / f"{BUNDLES[kind]}")
        assert {Path(name).stem for name in files if name.endswith(".lbass")} == names
    assert len(list((elsewhere / "made/here").iterdir())) == 1


@pytest.mark.parametrize("kind", KINDS)
def test_a_plugin_is_installed_where_hosts_look(run: Run, elsewhere: Path, kind: str) -> None:
    home = elsewhere / "home"
    folder = home / f".{kind}" / BUNDLES[kind]
    for preset in "slap", "fretless":  # the older one is replaced
        status, out, err = run("export", kind, "--install", "-p", preset, "--quality", "live")
        assert status == 0 and not out, err
        assert err.startswith(f"{folder}: 1 bass, ") and "copy" not in err and "let your host look" in err
        assert {Path(name).stem for name in contents(folder) if name.endswith(".lbass")} == {preset}
    assert list(elsewhere.iterdir()) == [home] and list(home.iterdir()) == [folder.parent]
    presets = home / ".vst3" / "presets"
    assert set(folder.parent.iterdir()) == ({folder, presets} if kind == "vst3" else {folder})
    for plugin in ("livebass", "livebass strings") if kind == "vst3" else ():
        found = {file.stem for file in (presets / "livebass" / plugin).iterdir()}
        assert found == {sound_title(name) for name in sounds_of("fretless")} and found


def test_an_installed_plugin_begins_in_the_quality_that_is_carried(
    run: Run, elsewhere: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    listed = elsewhere / "home/.clap/livebass-clap/instruments.txt"
    for found, says, lines in [
        (("studio", "live"), "best quality for this machine: studio for slap, else live", "slap studio\nmuted\n"),
        (("live", "live"), "best quality for this machine: live;", "slap\nmuted\n"),
        (("studio", "studio"), "best quality for this machine: studio;", "slap studio\nmuted studio\n"),
    ]:
        best = dict(zip(("slap", "muted"), found, strict=True))
        monkeypatch.setattr("livebass.live.best_quality.best_qualities", lambda basses, rate, best=best: best)
        status, _, err = run("export", "clap", "--install", "-p", "slap", "muted")
        assert status == 0 and says in err.splitlines()[0], err
        assert listed.read_text() == lines
    assert run("export", "clap", "-p", "slap")[0] == 0
    assert (elsewhere / "livebass-clap/instruments.txt").read_text() == "slap\n", "not for this machine alone"
    assert run("export", "clap", "-p", "slap", "-q", "studio")[0] == 0
    assert (elsewhere / "livebass-clap/instruments.txt").read_text() == "slap studio\n"


@pytest.mark.parametrize("system", ["linux", "macos", "windows"])
def test_each_system_has_its_place_for_plugins(system: str, monkeypatch: pytest.MonkeyPatch, elsewhere: Path) -> None:
    monkeypatch.setattr("livebass.plugin.systems.this_system", lambda: SYSTEMS[f"{system}-x86_64"])
    for kind, written in FOLDERS[system].items():
        if system != "windows":
            assert own_folder_of_plugins(kind) == elsewhere / "home" / written.removeprefix("~/")
            continue
        with pytest.raises(OSError, match="is not set"):
            own_folder_of_plugins(kind)


TAKEN = [
    ("", "home"), (".lv2", ".lv2"), (".lv2/livebass.lv2", "is not a directory"),
    (".lv2/livebass.lv2/notes.txt", "holds other files, such as notes.txt"),
]  # fmt: skip


@pytest.mark.parametrize(("place", "says"), TAKEN, ids=str)
def test_a_place_that_cannot_be_written_is_one_line(run: Run, elsewhere: Path, place: str, says: str) -> None:
    taken = elsewhere / "home" / place
    taken.parent.mkdir(parents=True, exist_ok=True)
    taken.touch()
    before = sorted(elsewhere.rglob("*"))
    err = refusal(run, "export", "lv2", "--install", "-p", "slap", "-q", "live", status=1)
    assert says in err and sorted(elsewhere.rglob("*")) == before


def test_the_usual_bass_comes_first(run: Run, elsewhere: Path) -> None:
    assert run("export", "lv2")[0] == 0
    assert (elsewhere / "livebass.lv2" / "instruments.txt").read_text().split()[:2] == ["jazz-finger", "drop-d"]


def test_help_names_every_system(run: Run, elsewhere: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(SYSTEMS, "beos-ppc", this_system())
    for kind in BUNDLES:
        words = " ".join(cli_text(run, "export", kind, "--help").split()).replace("- ", "-")  # lines break at hyphens
        assert f"{', '.join(list(SYSTEMS)[:-1])} or beos-ppc. [default: this one]" in words


def test_an_instrument_goes_where_plugins_look(run: Run, elsewhere: Path) -> None:
    own_preset(run, elsewhere / "mine.toml")
    status, out, err = run("export", "instrument", "./mine.toml")
    assert status == 0 and not out, err
    file = elsewhere / "data" / "livebass" / "mine.lbass"
    assert err.startswith(f"{file}: ") and err.count("\n") == 1
    assert image_of(image_made(file.read_bytes())).name == "Slap"
    assert "plugins list it" in err
    _, _, err = run("export", "instrument", "fretless")
    assert "a bass called fretless lists its own" in err
    status, _, err = run("export", "instrument", "fretless", "-o", "other.lbass")
    assert status == 0 and f"plugins look for it in {file.parent}" in err
    assert image_of(image_made((elsewhere / "other.lbass").read_bytes())).name == "Fretless jazz bass"
    assert run("export", "instrument", "fretless", "-o", "other.lbass")[0] == 0, "an older one is replaced"


def test_where_the_lv2_plugin_is_installed_an_instrument_is_a_preset_too(
    run: Run, elsewhere: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder = elsewhere / "home" / FOLDERS["linux"]["lv2"].removeprefix("~/")
    monkeypatch.setattr("livebass.plugin.systems.this_system", lambda: SYSTEMS["linux-x86_64"])
    assert run("export", "lv2", "-p", "slap", "-o", folder)[0] == 0
    own_preset(run, elsewhere / "mine.toml")
    for _ in "once", "again":
        status, _, err = run("export", "instrument", "./mine.toml")
        assert status == 0 and str(folder / "livebass-mine.lv2") in err.splitlines()[1], err
    made = contents(folder / "livebass-mine.lv2")
    assert set(made) == {"manifest.ttl", "presets.ttl"} and b'"mine"' in made["presets.ttl"]
    assert (elsewhere / "data" / "livebass" / "mine.lbass").is_file()


def test_no_export_needs_the_network(run: Run, elsewhere: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(*_: object, **__: object) -> None:
        raise AssertionError("the network is used")

    monkeypatch.setattr(socket, "socket", refuse)
    monkeypatch.setattr(socket, "getaddrinfo", refuse)
    assert run("export", "lv2", "-p", "slap")[0] == 0
    assert run("export", "instrument", "slap")[0] == 0


USAGE = [
    (["export", "vst2", "-p", "slap"], "vst2"),
    (["export", "lv2", "slap"], "name presets with -p"),
    (["export", "lv2", "-p", "slap", "-p", "slap"], "two basses called slap"),
    (["export", "lv2", "-p", "slap", "--system", "solaris"], ", ".join([*SYSTEMS][:-1]) + f" or {[*SYSTEMS][-1]}"),
    (["export", "lv2", "-p", "slap", "--quality"], "--quality"),
    (["export", "lv2", "-p", "slap", "--install", "-o", "here"], "--install and -o"),
    (["export", "lv2", "-p", "slap", "--install", "--system", "windows-x86_64"], "--install and --system"),
    (["export", "instrument"], "NAME|FILE"),
    (["export", "instrument", "slap", "-o", "slap.wav"], ".lbass"),
]


@pytest.mark.parametrize(("arguments", "says"), USAGE, ids=str)
def test_wrong_usage(run: Run, elsewhere: Path, arguments: list[str], says: str) -> None:
    assert says in refusal(run, *arguments, status=2) and not list(elsewhere.iterdir())


BAD = [
    (["-p", "none"], "none"), (["-p", "none.toml"], "none.toml"), (["-p", "odd.toml"], "odd.toml"),
    (["-p", "./two words.toml"], "two words"), (["-p", "slap", "-o", "file"], "file"),
    (["-p", "slap", "-o", "file/deeper"], "file/deeper"), (["-p", "slap", "-o", "/dev/full"], "/dev/full"),
    (["-p", "slap", "-o", f"{CLOSED}/here"], f"{CLOSED}/here"),
    (["-p", "slap", "-o", "taken"], "holds other files, such as notes.txt"),
    (["-p", "slap", "-o", "bad"], "is not a directory"),
]  # fmt: skip


@pytest.mark.parametrize(("arguments", "says"), BAD, ids=str)
@pytest.mark.parametrize("kind", KINDS)
def test_bad_data_and_targets(run: Run, elsewhere: Path, kind: str, arguments: list[str], says: str) -> None:
    (elsewhere / "file").touch()
    (elsewhere / "odd.toml").write_text("name = 3")
    own_preset(run, elsewhere / "two words.toml")
    (elsewhere / "taken" / f"{BUNDLES[kind]}").mkdir(parents=True)
    (elsewhere / "taken" / f"{BUNDLES[kind]}" / "notes.txt").write_text("mine")
    (elsewhere / "bad").mkdir()
    (elsewhere / "bad" / f"{BUNDLES[kind]}").touch()
    before = sorted(elsewhere.rglob("*"))
    assert says in refusal(run, "export", kind, *arguments, status=1)
    assert sorted(elsewhere.rglob("*")) == before


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (["none"], "none"),
        (["slap", "-o", "none/slap.lbass"], "there is no directory"),
        (["slap", "-o", f"{CLOSED}/slap.lbass"], "cannot be written"),
        (["slap", "-o", "dir.lbass"], "is a directory"),
        (["./two words.toml"], "two words"),
        (["slap"], "Not a directory"),
    ],
    ids=str,
)
def test_bad_instruments(run: Run, elsewhere: Path, arguments: list[str], says: str) -> None:
    (elsewhere / "dir.lbass").mkdir()
    (elsewhere / "data").touch()  # not a directory
    own_preset(run, elsewhere / "two words.toml")
    before = sorted(elsewhere.rglob("*"))
    assert says in refusal(run, "export", "instrument", *arguments, status=1)
    assert sorted(elsewhere.rglob("*")) == before


@pytest.mark.parametrize("kind", KINDS)
def test_a_full_disk_leaves_nothing_and_the_older_bundle(run: Run, elsewhere: Path, kind: str) -> None:
    assert run("export", kind, "-p", "slap")[0] == 0
    before = contents(elsewhere)
    for output in (".", "new"):
        with small_files():
            status, _, err = run("export", kind, "-p", "fretless", "-o", output)
        assert_one_clear_line(status, err, (1,))
        assert f"{BUNDLES[kind]}" in err and "File too large" in err
        assert contents(elsewhere) == before and not (elsewhere / "new").exists()
    with small_files():
        status, _, err = run("export", "instrument", "fretless", "-o", "mine.lbass")
    assert_one_clear_line(status, err, (1,))
    assert "mine.lbass" in err and contents(elsewhere) == before


def cut(data: bytes) -> bytes:
    return data[:-1000]


def flip(data: bytes) -> bytes:
    return data[:5000] + bytes([data[5000] ^ 1]) + data[5001:]


@pytest.fixture
def package(tmp_path_factory: pytest.TempPathFactory, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The contents of an installed package: only this system's binary."""
    folder = tmp_path_factory.mktemp("built")
    (folder / name_of(this_system())).write_bytes(store.seal(binary(this_system())))
    monkeypatch.setattr(store, "BUILT", folder)
    return folder


def test_a_binary_that_came_with_the_package_is_taken(
    run: Run, elsewhere: Path, package: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(build, "_built_here", lambda *_: 1 / 0)
    monkeypatch.setattr(build, "_kept_file", lambda *_: None)
    assert run("export", "lv2", "-p", "slap")[0] == 0
    assert binary(this_system()) in contents(elsewhere).values()


@pytest.mark.parametrize("damage", [cut, flip, lambda _: b""])
def test_a_damaged_one_is_refused_by_name(
    run: Run, elsewhere: Path, package: Path, damage: Callable[[bytes], bytes]
) -> None:
    (file,) = package.iterdir()
    file.write_bytes(damage(file.read_bytes()))
    err = refusal(run, "export", "lv2", "-p", "slap", status=1)
    assert f"{file}: is damaged" in err and not list(elsewhere.iterdir())


def test_one_of_another_version_is_refused_by_name(run: Run, elsewhere: Path, package: Path) -> None:
    (file,) = package.iterdir()
    old = file.rename(file.with_name(file.name.replace(build.digest(), "0" * 16)))
    err = refusal(run, "export", "lv2", "-p", "slap", status=1)
    assert f"{old}: belongs to another version" in err and not list(elsewhere.iterdir())


def test_one_in_the_cache_that_is_damaged_is_built_again(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    made, system, cache = binary(this_system()), this_system(), tmp_path / "cache"
    (cache / f"plugin-{build.digest()}").mkdir(parents=True)
    kept = cache / f"plugin-{build.digest()}" / name_of(system)
    kept.write_bytes(flip(store.seal(made)))
    monkeypatch.setattr(build, "_kept_file", lambda _: kept)
    monkeypatch.setattr(build, "_built_here", lambda system, folder: made)
    assert binary(system) == made == store.whole(kept)
    assert str(kept) in caplog.text and "damaged" in caplog.text


def test_without_a_compiler_it_says_what_to_install(run: Run, elsewhere: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def not_built(system: System) -> None:
        return None

    monkeypatch.setattr(build, "_kept_file", not_built)
    monkeypatch.setattr(shutil, "which", lambda _: None)
    monkeypatch.setattr("importlib.util.find_spec", lambda _: None)
    for system in SYSTEMS:
        status, _, err = run("export", "lv2", "-p", "slap", "--system", system)
        assert_one_clear_line(status, err, (1,))  # before anything is compiled
        assert f"plugins for {system} needs " in err and "ziglang" in err and install("export") in err
        assert not list(elsewhere.iterdir())
