"""Unexpected names and places: every command works, or names the culprit in one line, and leaves nothing behind.

Most calls run in this process; calls that depend on streams, limits or signals get their own.
"""

from __future__ import annotations

import io
import json
import os
import resource
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
import soundfile
from support.command import BASS, GOOD, NOTE, Run, assert_one_clear_line, cli_text, command, refusal, song
from support.engine import FakeEngine

from livebass.cli.play_settings import PlaySettings
from livebass.files.whole import Transaction
from livebass.preset.keymap import key_map_text, load_key_map
from livebass.preset.load import preset_source

NAMES = [os.fsdecode(name) for name in (b"caf\xe9", b"\xff\n\x1b[2J", b"-x", b"$x$ %s{}", b"\xe9" * 200)]
NAME = NAMES[0]
ENDS = {".mid", ".wav", ".toml", ".keys.toml", ".scl"}


def tone() -> bytes:
    """A plucked G2 of 1 s, as a WAV file."""
    t, file = np.arange(48_000) / 48_000, io.BytesIO()
    sound = sum(np.exp(-t * (2 + j)) * np.sin(2 * np.pi * 98 * j * t) / j for j in range(1, 12))
    soundfile.write(file, 0.1 * np.asarray(sound), 48_000, format="WAV")
    return file.getvalue()


@pytest.fixture(scope="module")
def contents() -> dict[str, bytes]:
    """A good file of each kind, by extension."""
    scale = "x\n12\n" + "".join(f"{100 * k}.0\n" for k in range(1, 13))
    keys = key_map_text(load_key_map("modo-12"))
    texts = {".toml": preset_source("jazz-finger")[1], ".keys.toml": keys, ".scl": scale}
    return {".mid": GOOD, ".wav": tone()} | {end: text.encode() for end, text in texts.items()}


@pytest.fixture
def there(fake: type[FakeEngine], contents: dict[str, bytes]) -> None:
    """Puts the files, under every name, into the current directory, and a folder with the bare name."""
    for name in NAMES:
        os.mkdir(name)
        for end, data in contents.items():
            Path(name + end).write_bytes(data)


def path_of(name: str) -> str:
    """The name in a form that no command takes for an option."""
    return f"./{name}" if name.startswith("-") else name


GOOD_CALLS: dict[str, tuple[list[str], list[str]]] = {  # arguments and the files they write, X: the name
    "midi": (["render", "X.mid", "-o", "X.flac"], ["X.flac"]),
    "midi to its own name": (["render", "X.mid", "--format", "ogg"], ["X.ogg"]),
    "stems": (["render", "X.mid", "--stems", "-o", "X/X.wav"], ["X/X.wav", "X/X.E.wav"]),
    "list": (["render", "X.mid", "--list"], []),
    "preset": (["render", "--note", "E2", "-p", "X.toml", "-o", "X/a.wav"], ["X/a.wav"]),
    "keys and scale": (["render", "--note", "E2", "--keys", "X.keys.toml", "--temperament", "X.scl"], ["E2.wav"]),
    "presets": (["presets", "check", "X.toml"], []),
    "show": (["presets", "show", "X.toml"], []),
    "key map": (["presets", "keymap", "X.keys.toml"], []),
    "simulate": (["simulate", "-q", "live", "--duration", "1ms", "-p", "X.toml", "-o", "X/X"], ["X/X/result.npz"]),
    "compare": (["compare", "X.wav", "--beside", "X.wav", "--json", "X.json", "-o", "X.html"], ["X.json", "X.html"]),
    "bass for plugins": (["export", "instrument", "X.toml", "-o", "X/bass.lbass"], ["X/bass.lbass"]),
    "claims": (["study", "claims", "neck-measured", "--plucks", "0", "--json", "X.json"], ["X.json"]),
}
SHORT = ("midi", "preset", "presets", "key map", "list")  # these run with all names, the others with one


@pytest.mark.parametrize(
    ("call", "name"),
    [(call, name) for call in GOOD_CALLS for name in (NAMES if call in SHORT else NAMES[:1])],
    ids=ascii,
)
def test_files_of_any_name(there: None, run: Run, call: str, name: str) -> None:
    arguments, wanted = GOOD_CALLS[call]
    status, out, err = run(*(a.replace("X", name) if "/" in a else path_of(a.replace("X", name)) if "X" in a else a
                             for a in arguments))  # fmt: skip
    assert status == 0, err
    assert all(line.isprintable() for line in [*out.splitlines(), *err.splitlines()] if "\t" not in line)
    for file in wanted:
        assert Path(file.replace("X", name)).stat().st_size > 100, file
    if "X.json" in wanted:
        json.loads(Path(f"{name}.json").read_bytes())
    assert not [file for folder in (".", name) for file in os.listdir(folder) if file.startswith(".")]


FOLDERS = [
    ["render", "X"], ["render", "--note", "E2", "-o", "X", "--format", "wav"], ["identify", "X"],
    ["presets", "check", "X/"],
    ["render", "--note", "E2", "--response", "X"], ["render", "--note", "E2", "--keys", "X/"],
    ["render", "--note", "E2", "--temperament", "X/"], ["play", "--file", "X", "--no-settings"],
    ["study", "claims", "neck-measured", "--plucks", "0", "--json", "X"], ["bench", "render", "--json", "X"],
]  # fmt: skip
FILES = [
    ["simulate", "-o", "X.mid"], ["render", "--all-presets", "X.mid"], ["export", "instrument", "X.toml"],
    ["study", "sweep", "--vary", "pluck.apex=1mm:2mm:2", "-o", "X.mid"],
    ["export", "sfz", "-o", "X.mid"], ["export", "web", "-p", "slap", "-o", "X.mid"],
    ["identify", "X.mid"], ["compare", "X.mid"], ["render", "--note", "E2", "--response", "X.mid"], ["render", "X.wav"],
    ["export", "lv2", "-p", "X.toml", "-o", "new"], ["identify", "none-X"],
    ["help", "X"], ["X"], ["play", "--client-name", "X", "--no-settings"], ["render", "--note", "E2", "-p", "none-X"],
]  # fmt: skip


@pytest.mark.parametrize("arguments", FOLDERS + FILES, ids=" ".join)
def test_a_folder_for_a_file_and_a_file_for_a_folder(there: None, run: Run, arguments: list[str]) -> None:
    before = sorted(Path().rglob("*"))
    err = refusal(run, *(a.replace("X", NAME) for a in arguments))
    assert err[:-1].isprintable() and ("caf\\udce9" in err.replace("\\\\", "\\") or "client-name" in err)
    assert sorted(Path().rglob("*")) == before


EMPTY = [
    ["render", ""], ["render", "--note", "E2", "-o", ""], ["render", "--all-presets", ""], ["simulate", "-o", ""],
    ["identify", ""], ["compare", ""], ["compare", "a", "--beside", ""], ["bench", "render", "--json", ""],
    ["play", "--record", ""], ["play", "--file", ""], ["play", "--log", ""], ["export", "sfz", "-o", ""],
    ["render", "--note", "E2", "--response", ""],
]  # fmt: skip


@pytest.mark.parametrize("arguments", EMPTY, ids=" ".join)
def test_an_empty_name(fake: type[FakeEngine], run: Run, arguments: list[str]) -> None:
    assert "'': is not a file name" in refusal(run, *arguments, status=2) and not os.listdir()


LOOPS = [
    ["render", "loop"], ["render", "--note", "E2", "-o", "loop", "--format", "wav"], ["simulate", "-o", "loop"],
    ["render", "--all-presets", "loop"], ["export", "web", "-p", "slap", "-o", "loop"], ["export", "sfz", "-o", "loop"],
    ["study", "sweep", "--vary", "pluck.apex=1mm:2mm:2", "-o", "loop"], ["presets", "check", "./loop"],
    ["identify", "loop"], ["render", "--note", "E2", "--response", "loop"],
    ["study", "claims", "neck-measured", "--plucks", "0", "-o", "loop"],
]  # fmt: skip


@pytest.mark.parametrize("arguments", LOOPS, ids=" ".join)
def test_a_link_to_itself(fake: type[FakeEngine], run: Run, arguments: list[str]) -> None:
    """A command neither follows it for ever nor overwrites it."""
    os.symlink("loop", "loop")
    err = refusal(run, *arguments, status=1)
    assert "loop: " in err and "Too many levels of symbolic links" in err
    assert os.listdir() == ["loop"] and os.readlink("loop") == "loop"


def test_links_to_files(fake: type[FakeEngine], run: Run) -> None:
    """Output goes to a link's target; a file's other names keep the old content."""
    Path("old.wav").write_bytes(b"old")
    os.link("old.wav", "hard.wav")
    os.symlink("target.wav", "dangling.wav")
    for name in ("hard.wav", "dangling.wav"):
        assert run("render", "--note", "E2", "-o", name)[0] == 0
    assert Path("old.wav").read_bytes() == b"old" and Path("hard.wav").stat().st_size > 1000
    assert Path("dangling.wav").is_symlink() and Path("target.wav").stat().st_size > 1000


def test_a_folder_that_is_read_only_is_said_before_the_work(
    fake: type[FakeEngine], run: Run, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Even if it holds an older file: a new file replaces that, and the folder must accept it."""
    Path("a.wav").touch()
    access = os.access
    monkeypatch.setattr(os, "access", lambda path, mode: Path(path).name == "a.wav" and access(path, mode))
    monkeypatch.setattr(fake, "play", None)
    assert "the directory . is read-only" in refusal(run, "render", "--note", "E2", "-o", "a.wav", status=1)


NUMBERS = [
    ["play", "--audio", "²"], ["play", "--audio", "9" * 5000], ["play", "--learn", "tone=²"], ["page", "--port", "²"],
    ["play", "--learn", "tone=" + "9" * 5000], ["play", "--tempo", "nan%"], ["play", "--loop", "nan:inf"],
    ["simulate", "-o", "d", "--fret", "²"], ["render", "--note", "²"], ["compare", "x", "--velocities", "nan,3"],
    ["render", "--note", "E2", "--a4", "nan"], ["render", "--note", "E2", "--tuning", "infHz"],
    ["render", "--note", "E2", "--temperament", "inf,0,0,0"], ["render", "--note", "E2", "--velocity-curve", "inf:1"],
    ["render", "--note", "E2", "--seed", "1e30"], ["render", "--note", "E2", "--gain", "-inf"],
    ["study", "sweep", "--vary", "pluck.fret=0:1e99:3", "-o", "d"], ["bench", "live", "--runs", "-1"],
]  # fmt: skip


@pytest.mark.parametrize("arguments", NUMBERS, ids=lambda arguments: ascii(" ".join(arguments)[:40]))
def test_numbers_that_are_none(fake: type[FakeEngine], run: Run, arguments: list[str]) -> None:
    err = refusal(run, *arguments)
    assert "invalid literal" not in err and "Exceeds the limit" not in err and not os.listdir()


def test_text_that_is_written_has_escapes(tmp_path: Path) -> None:
    """In JSON's form: readers get the name back."""
    with Transaction() as files:
        files.write_text(tmp_path / "a.json", f'"{NAME}"')
    assert json.loads((tmp_path / "a.json").read_bytes()) == NAME


def test_settings_do_not_take_a_name_that_they_could_not_give_back() -> None:
    with pytest.raises(ValueError, match="is not UTF-8"):
        PlaySettings(preset=f"/{NAME}.toml").text()


ENVIRONMENTS = [
    {"LC_ALL": "C", "PYTHONUTF8": "0", "PYTHONCOERCECLOCALE": "0"}, {"PYTHONIOENCODING": "latin-1"},
    {"PYTHONIOENCODING": "utf-8:strict"},
]  # fmt: skip


@pytest.mark.parametrize("more", ENVIRONMENTS[:1] + [pytest.param(e, marks=pytest.mark.slow) for e in ENVIRONMENTS[1:]])
def test_streams_that_cannot_take_a_name(tmp_path: Path, more: dict[str, str]) -> None:
    """Neither a file's name nor a track's."""
    if more.get("PYTHONUTF8") == "0" and not sys.prefix.isascii():
        pytest.skip("needs a place of ASCII: soundfile finds its library by its path")
    title = "caf\xe9 ベース".encode()
    data = song(b"\x00\xff\x03" + bytes([len(title)]) + title, BASS, NOTE)
    (tmp_path / f"{NAME}.mid").write_bytes(data)
    how = {"env": os.environ | more, "text": False}
    done = command("render", f"{NAME}.mid", "--list", **how)
    assert done.returncode == 0 and not done.stderr and b"  34 " in done.stdout, done.stderr
    done = command("render", f"{NAME}.mid", "--channel", "9", **how)
    assert done.returncode == 1 and b"caf\\udce9.mid: no notes on channel 9" in done.stderr
    assert done.stderr.count(b"\n") == 1 and not done.stdout


@pytest.fixture
def small_disk(tmp_path: Path) -> Iterator[Path]:
    """A small disk, only for root, who may mount one."""
    place = tmp_path / "disk"
    place.mkdir()
    if os.name != "posix" or os.getuid() or subprocess.run(
        ["mount", "-t", "tmpfs", "-o", "size=64k", "tmpfs", place], check=False, capture_output=True
    ).returncode:  # fmt: skip
        pytest.skip("no disk can be mounted here")
    yield place
    subprocess.run(["umount", place], check=False)


def test_a_disk_that_is_full(small_disk: Path, fake: type[FakeEngine], run: Run) -> None:
    (small_disk / "ballast").write_bytes(bytes(16 << 10))
    calls = [
        "render --note E2 -o disk/a.wav", "render --note E2 --normalize -16 -o disk/a.wav",
        "render --all-presets disk/demos", "simulate -q live --duration 50ms -o disk/d",
        "export sfz -q live --length 0.1s --frets 36 --layers 1 -o disk/pack",
    ]  # fmt: skip
    for call in calls:
        status, _, err = run(*call.split())
        lines = [line for line in err.splitlines() if line.startswith("livebass: error: ")]
        assert status == 1 and len(lines) == 1 and "No space left on device" in lines[0] and "disk/" in lines[0], err
        assert os.listdir(small_disk) == ["ballast"], call


PLACES = [{"HOME": None}, {"HOME": "/proc", "TMPDIR": "/proc"}]


@pytest.mark.parametrize("more", PLACES, ids=str)
def test_no_home_and_no_place_for_temporary_files(tmp_path: Path, more: dict[str, str | None]) -> None:
    environment = {name: value for name, value in (os.environ | more).items() if value is not None}
    for line, status in (("export instrument slap -o slap.lbass --capo 99", 2), ("presets check ./none.toml", 1)):
        done = command(*line.split(), env=environment)
        assert_one_clear_line(done.returncode, done.stderr, (status,))
    assert not list(tmp_path.iterdir())


def test_few_files_may_be_open(tmp_path: Path) -> None:
    """A line says so; no file is left half-written."""

    def few() -> None:
        resource.setrlimit(resource.RLIMIT_NOFILE, (5, 5))

    done = command("render", "--note", "E2", "--stems", "-o", "a.wav", preexec_fn=few)
    assert done.returncode != 0 and not list(tmp_path.iterdir())


def test_a_preset_goes_to_the_shell_in_its_own_bytes(tmp_path: Path, run: Run) -> None:
    """TOML is UTF-8, whatever the terminal's encoding."""
    file = tmp_path / "a.toml"
    file.write_text('like = "slap"\nname = "caf\xe9"\n', "utf-8")
    done = command("presets", "show", file, env=os.environ | {"PYTHONIOENCODING": "latin-1"}, text=False)
    assert done.returncode == 0 and done.stdout.startswith(file.read_bytes().rstrip())
    assert cli_text(run, "presets", "show", file).encode() == done.stdout
