"""Errors of any kind: one clear line on stderr, status 1 or 2, no traceback, no half-written file."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
import soundfile
from support.command import (
    BASS,
    CHORD,
    GOOD,
    HEAD,
    NOTE,
    Run,
    assert_one_clear_line,
    cli_text,
    command,
    refusal,
    rendering_for_long,
    small_files,
    song,
)
from support.costs import quick
from support.engine import FakeEngine
from support.jack import wait_for
from support.needs import CLOSED, HANGUP

from livebass.compiling import library
from livebass.files.whole import OutputError, checked_place

OF_A_NOTE = [
    "--velocity 0", "--velocity 1.5", "--duration nan", "--duration -1", "--duration inf", "--duration 3kg",
    "--modes 1e9", "--modes -1", "--modes nan", "--modes 12.5", "--contact-rate 1e30", "--rate 22049", "--rate 1e9",
    "--gain nan", "--gain 999", "--tail -1", "--seed -1", "--quality best", "--format mp3", "--channel 17",
    "--channel auto", "--bars 1-2", "--dynamics 0", "-o a.mp3", "-o a.wav --format ogg", "--format ogg --bits 16",
    "--format flac --bits float", "--format flac --rate 96001",
]  # fmt: skip
OF_SIMULATE = [
    "--apex 1e9mm", "--apex 31mm", "--at nan", "--duration 61s", "--contact-rate 8.0000001MHz", "--solver magic",
]  # fmt: skip
USAGE = [
    "render", "render a.mid --note G2", "render --all-presets demos -o a.wav", "render --note H2", "render --note 128",
    *(f"render --note G2 {options}" for options in OF_A_NOTE), "render --demo --velocity 100",
    "render --demo --duration 3s", "render --demo --track Bass", "render --nonsense", "simulate",
    *(f"simulate -o d {options}" for options in OF_SIMULATE), "presets show", "nonsense",
]  # fmt: skip


@pytest.mark.parametrize("line", USAGE)
def test_wrong_usage(run: Run, tmp_path: Path, line: str) -> None:
    refusal(run, *line.split(), status=2)
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (["song.mid"], "`livebass render song.mid` renders a file, `livebass play --file song.mid` plays it"),
        (["render", "song.mid", "out.wav"], "out.wav: one argument too many; -o names the sound file"),
        (["play", "song.mid"], "song.mid: one argument too many; --file plays a file"),
    ],
)
def test_a_file_in_the_wrong_place(run: Run, tmp_path: Path, arguments: list[str], says: str) -> None:
    (tmp_path / "song.mid").write_bytes(GOOD)
    assert says in refusal(run, *arguments, status=2)


BAD_FILES = {
    "empty": b"",
    "text": b"not midi",
    "truncated": GOOD[:-7],
    "no track": HEAD,
    "no notes": song(BASS),
    "no bass notes": song(NOTE, b"\x00\xc1\x00\x00\x91\x48\x64\x81\x70\x81\x48\x40", b"\x00\xc0\x00"),
}


@pytest.mark.parametrize("name", BAD_FILES)
def test_bad_midi_files(fake: type[FakeEngine], run: Run, tmp_path: Path, name: str) -> None:
    path = tmp_path / "bad \n\x1b.mid"
    path.write_bytes(BAD_FILES[name])
    refusal(run, "render", path, "-o", "out.wav", status=1)
    assert list(tmp_path.iterdir()) == [path]


ODD_NAME = "a\nb\x1b[2J\r\u2028"
ESCAPED = r"a\nb\x1b[2J\r\u2028"


@pytest.mark.parametrize(
    "arguments",
    [
        ["render", f"{ODD_NAME}.mid"],
        ["render", "--note", "E1", "-o", f"none/{ODD_NAME}.wav"],
        ["render", "--note", "E1", "-o", f"{ODD_NAME}.mp3"],
        ["render", "--note", "E1", "--preset", f"{ODD_NAME}.toml"],
        ["render", "--note", "E1", "--preset", ODD_NAME],
        ["render", "--note", "E1", "--keys", f"{ODD_NAME}.toml"],
        ["render", "--all-presets", f"file/{ODD_NAME}"],
        ["presets", "check", f"{ODD_NAME}.toml"],
        ["play", "--file", f"{ODD_NAME}.mid"],
        ["identify", f"{ODD_NAME}.wav"],
        ["help", ODD_NAME],
        [ODD_NAME],
    ],
    ids=lambda arguments: " ".join(arguments[:-1]) or "command",
)
def test_line_ends_in_names_are_written_out(fake: type[FakeEngine], run: Run, arguments: list[str]) -> None:
    Path("file").touch()
    err = refusal(run, *arguments)
    assert ESCAPED in err.replace(r"\\", "\\"), err
    assert err.count("\n") == 1 and err[:-1].isprintable()


def test_what_is_said_of_a_good_file_is_one_line_too(fake: type[FakeEngine], run: Run) -> None:
    Path(f"{ODD_NAME}.mid").write_bytes(GOOD)
    status, _, err = run("render", f"{ODD_NAME}.mid", "-p", "slap", "-o", f"{ODD_NAME}.wav")
    assert status == 0 and Path(f"{ODD_NAME}.wav").exists()
    assert all(line.isprintable() for line in err[:-1].split("\n")) and f"\n{ESCAPED}.wav: " in f"\n{err}"


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (["render", "."], "is a directory"),
        (["render", "none.mid"], "No such file"),
        (["render", "file.wav"], "is a RIFF file, not a MIDI file"),  # not as the output, for which it might be taken
        (["render", "--note", "G2", "-o", "dir.wav"], "is a directory"),
        (["render", "--note", "G2", "-o", "none/out.wav"], "there is no directory"),
        (["render", "--note", "G2", "-o", "/dev/full", "--format", "wav"], "not a regular file"),
        (["render", "--note", "G2", "-o", f"{CLOSED}/out.wav"], "cannot be written"),
        (["render", "--all-presets", "file"], "not a directory"),
        (["render", "--all-presets", "file/deeper"], "Not a directory"),
        (["render", "--note", "G2", "--preset", "none"], "none"),
        (["render", "--note", "G2", "--preset", "nan.toml"], "nan.toml"),
        (["presets", "check", "nan.toml"], "nan.toml"),
        (["presets", "show", "none"], "none"),
        (["simulate", "-o", "d", "--string", "X"], "string 'X'"),
        (["simulate", "-o", "d", "--preset", "none"], "none"),
    ],
    ids=str,
)
def test_bad_data(fake: type[FakeEngine], run: Run, tmp_path: Path, arguments: list[str], says: str) -> None:
    (tmp_path / "dir.wav").mkdir()
    (tmp_path / "file").touch()
    (tmp_path / "file.wav").write_bytes(b"RIFF")
    text = cli_text(run, "presets", "show", "jazz-finger")
    (tmp_path / "nan.toml").write_text(text.replace('relief = "0.3 mm"', "relief = nan", 1))
    assert says in refusal(run, *arguments, status=1)
    assert sorted(p.name for p in tmp_path.iterdir()) == ["dir.wav", "file", "file.wav", "nan.toml"]


ODD_FILES = {
    "zero length": song(BASS, b"\x00\x90\x28\x64\x00\x80\x28\x40"),
    "orphan offs": song(BASS, b"\x00\x80\x20\x40\x00\x90\x21\x00", NOTE),
    "never ends": song(BASS, b"\x00\x90\x28\x64"),
    "a chord of 128": song(BASS, CHORD, b"\x10\xb0\x7b\x00"),
}


@pytest.mark.parametrize("name", ODD_FILES)
def test_odd_files_through_the_real_engine(run: Run, tmp_path: Path, name: str) -> None:
    (tmp_path / "odd.mid").write_bytes(ODD_FILES[name])
    options = ["-q", "live", "--tail", "0.2", "--bits", "float"]
    status, _, err = run("render", tmp_path / "odd.mid", "-o", tmp_path / "o.wav", *options)
    assert status == 0, err
    sound, _ = soundfile.read(tmp_path / "o.wav")
    assert np.isfinite(sound).all() and np.abs(sound).max() > 1e-6


def test_a_defect_is_one_line_too(fake: type[FakeEngine], run: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(fake, "report", lambda self: 1 / 0)
    status, _, err = run("render", "--note", "G2")
    assert status == 1 and err.count("\n") == 1
    assert "internal error, ZeroDivisionError" in err and "LIVEBASS_TRACEBACK" in err


def test_a_full_stdout_and_a_closed_pipe() -> None:
    with open("/dev/full", "w") as full:
        done = command("presets", "list", capture_output=False, stdout=full, stderr=subprocess.PIPE)
        assert_one_clear_line(done.returncode, done.stderr, (1,))
        assert "standard output: cannot be written" in done.stderr
    process = subprocess.Popen(
        [sys.executable, "-m", "livebass", "presets", "keys"], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    )
    assert process.stdout and process.stderr
    process.stdout.close()
    assert process.stderr.read() == ""
    assert process.wait(60) != 0
    process.stderr.close()


def test_a_full_disk_leaves_nothing(run: Run, tmp_path: Path) -> None:
    library.library()  # The kernels' files exceed the limit.
    with small_files():
        err = refusal(
            run, *["render", "--note", "G2", "--duration", "1", "-q", "live", "--stems", "-o", "a.wav"], status=1
        )
    assert "File too large" in err and not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    ("number", "status", "again"),
    quick(
        [
            (number, status, again)
            for number, status in ((signal.SIGINT, 130), (signal.SIGTERM, 143), (HANGUP, 128 + HANGUP))
            for again in ((), (0.05,), (0.002, 0.2, 0.1))
        ],
        always=[(signal.SIGINT, 130, ()), (signal.SIGTERM, 143, (0.002, 0.2, 0.1)), (HANGUP, 128 + HANGUP, ())],
    ),
)
def test_an_interrupt_leaves_nothing(tmp_path: Path, number: int, status: int, again: tuple[float, ...]) -> None:
    """Nor do several: more come `again` s after the first."""
    out = tmp_path / "long.wav"
    with rendering_for_long(out) as process:
        wait_for(lambda: list(tmp_path.iterdir()), process=process)
        time.sleep(0.3)
        process.send_signal(number)
        for pause in again:
            time.sleep(pause)
            process.send_signal(signal.SIGINT)
        _, err = process.communicate(timeout=60)
    # Of two signals waiting for the interpreter, it takes the lower number first: SIGINT before SIGTERM.
    assert process.returncode in ({status, 130} if again else {status}) and "Traceback" not in err
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("moment", ["in the second", "when all are there"])
def test_all_presets_or_none(
    fake: type[FakeEngine], run: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, moment: str
) -> None:
    if moment == "in the second":
        plays = []

        def play(self: FakeEngine, *_: object) -> Iterator[np.ndarray]:
            plays.append(1)
            if len(plays) == 2:
                raise KeyboardInterrupt
            yield np.zeros((4, 100))

        monkeypatch.setattr(fake, "play", play)
    else:
        replace = os.replace

        def replace_(*names: Path) -> None:
            signal.raise_signal(signal.SIGINT)
            replace(*names)

        monkeypatch.setattr(os, "replace", replace_)
    status, _, err = run("render", "--all-presets", "a/demos")
    assert status == 130
    if moment == "in the second":
        assert "interrupted, nothing written" in err and not list(tmp_path.iterdir())
    else:
        assert "interrupted, but complete: a/demos" in err and len(list(tmp_path.glob("a/demos/*.wav"))) > 4


def test_a_place_is_tried_before_the_work() -> None:
    """A file system that refuses files says so only on a try."""
    with pytest.raises(OutputError, match=rf"{CLOSED}/out\.wav: cannot be written"):
        checked_place(CLOSED / "out.wav")
