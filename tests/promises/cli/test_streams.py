"""Standard streams: sound and MIDI through pipes, closed streams, and the remains of killed renders."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import soundfile
from support.command import GOOD, Run, assert_one_clear_line, python, refusal, rendering_for_long
from support.costs import quick
from support.engine import FakeEngine
from support.jack import wait_for

from livebass.compiling import library
from livebass.files.whole import Transaction
from livebass.system.extras import install

HOW = ("--tail", "0", "-q", "live")
NOTE = ("render", "--note", "G2", "--duration", "0.1", *HOW)


def shell(line: str, folder: Path) -> subprocess.CompletedProcess[bytes]:
    """Runs a shell line in `folder`, with this `livebass` as the command."""
    text = f'livebass() {{ "{sys.executable}" -m livebass "$@"; }}\n{line}'
    return subprocess.run(["/bin/sh", "-c", text], cwd=folder, capture_output=True, timeout=300)


@pytest.mark.parametrize("kind", quick(["", "--bits float", "--format flac", "--format ogg"], [""]))
def test_sound_goes_to_standard_output(run: Run, tmp_path: Path, kind: str) -> None:
    """The same bytes as in a file, and nothing else."""
    file = tmp_path / f"a.{kind.removeprefix('--format ') if '--format' in kind else 'wav'}"
    assert run(*NOTE, *kind.split(), "-o", file)[0] == 0
    piped = shell(f"livebass {' '.join(NOTE)} {kind} -o - | cat", tmp_path)
    assert piped.stdout == file.read_bytes()
    assert piped.stderr.decode().splitlines()[-1].startswith("-: 1 note ")
    assert list(tmp_path.iterdir()) == [file]


def test_a_midi_file_from_standard_input(run: Run, tmp_path: Path) -> None:
    (tmp_path / "song.mid").write_bytes(GOOD)
    options = " ".join(HOW)
    assert run("render", tmp_path / "song.mid", "-o", tmp_path / "a.wav", *HOW)[0] == 0
    done = shell(f"cat song.mid | livebass render - {options}", tmp_path)
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "stdin.wav").read_bytes() == (tmp_path / "a.wav").read_bytes()
    piped = shell(f"livebass render - -o - {options} < song.mid", tmp_path)
    assert piped.stdout == (tmp_path / "a.wav").read_bytes()
    for bad in ("< /dev/null", "<&-"):
        done = shell(f"livebass render - -o - {options} {bad}", tmp_path)
        assert_one_clear_line(done.returncode, done.stderr.decode(), (1,))
        assert "-: " in done.stderr.decode() and not done.stdout


def test_pipes_that_cannot_take_it(run: Run, tmp_path: Path) -> None:
    note = f"livebass {' '.join(NOTE)} -o -"
    done = shell(f"{note} > /dev/full", tmp_path)
    assert_one_clear_line(done.returncode, done.stderr.decode(), (1,))
    assert b"-: cannot be written: No space left on device" in done.stderr
    done = shell(f"{{ {note}; echo $? >&2; }} | true", tmp_path)
    assert done.stderr.decode().splitlines()[-1] == "141" and b"Traceback" not in done.stderr
    refusal(run, *NOTE, "-o", "-", "--stems", status=2)
    assert not list(tmp_path.iterdir())


def test_sound_does_not_go_to_a_terminal(fake: type[FakeEngine], run: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys.stdout, "isatty", lambda: True)
    assert "terminal" in refusal(run, "render", "--note", "G2", "-o", "-", status=2)


@pytest.mark.parametrize(
    "closed", quick([">&-", "2>&-", ">&- 2>&- <&-", "2>/dev/full"], [">&- 2>&- <&-", "2>/dev/full"])
)
def test_closed_streams_cost_no_file(run: Run, tmp_path: Path, closed: str) -> None:
    assert run(*NOTE, "-o", tmp_path / "wanted.wav")[0] == 0
    done = shell(f"livebass {' '.join(NOTE)} -o a.wav {closed}", tmp_path)
    assert done.returncode == 0 and b"Traceback" not in done.stderr and not done.stdout
    assert (tmp_path / "a.wav").read_bytes() == (tmp_path / "wanted.wav").read_bytes()
    assert len(list(tmp_path.iterdir())) == 2


def test_nobody_need_read_what_is_said(tmp_path: Path) -> None:
    """A closed pipe does not cost a table-printing command its files either."""
    done = shell(f"{{ livebass {' '.join(NOTE)} -o a.wav; echo $? > status; }} 2>&1 | true", tmp_path)
    assert (tmp_path / "a.wav").exists() and (tmp_path / "status").read_text() == "0\n"
    done = shell("livebass study claims neck-measured --plucks 0 --json claims.json | true", tmp_path)
    assert (tmp_path / "claims.json").exists() and b"Traceback" not in done.stderr
    for command_ in ("presets keys", "presets list 2>&-"):
        done = shell(f"livebass {command_} | head -1", tmp_path)
        assert done.stderr == b""


INTERRUPTED_WRITE = """
import sys
from livebass.__main__ import open_streams
open_streams()
def interrupt(frame, event, argument):
    if frame.f_code.co_name == "write" and event == "return":
        sys.settrace(None)
        raise KeyboardInterrupt
    return interrupt
sys.settrace(interrupt)
try:
    print("once", file=sys.stderr)
except KeyboardInterrupt:
    print("interrupted", file=sys.stderr)
"""


def test_a_message_that_an_interrupt_follows_is_said_once() -> None:
    done = python(INTERRUPTED_WRITE)
    assert (done.returncode, done.stderr) == (0, "once\ninterrupted\n")


def test_what_a_killed_render_left_is_removed_by_the_next(run: Run, tmp_path: Path) -> None:
    out = tmp_path / "long.wav"
    with rendering_for_long(out):
        wait_for(lambda: len(os.listdir()) == 5)
        left = set(os.listdir())
        # it is alive: its files stay
        assert run(*NOTE, "-o", out)[0] == 0
        assert set(os.listdir()) == left | {"long.wav"}
    (tmp_path / ".other.wav.tmp-01234567").touch()
    (tmp_path / ".long.wav.tmp-mine").touch()
    assert run(*NOTE, "-o", out, "--stems")[0] == 0
    wanted = ["long.wav", *(f"long.{string}.wav" for string in "EADG"), ".other.wav.tmp-01234567", ".long.wav.tmp-mine"]
    assert sorted(file.name for file in tmp_path.iterdir()) == sorted(wanted)


def test_a_recording_that_was_killed_stays(tmp_path: Path) -> None:
    """It cannot be played again."""
    with Transaction("take") as files:
        files.create(tmp_path / "take.wav")
        (left,) = tmp_path.iterdir()
        os.link(left, tmp_path / "left")
    (tmp_path / "left").rename(left)
    for ending in ("take", "tmp"):
        with Transaction(ending) as files:
            files.write(tmp_path / "take.wav", b"another")
    assert left.exists()


@pytest.mark.parametrize("rate", ["44.1kHz", "44.1 kHz", "44100", "0.0441MHz", "44100Hz", "4.41e4"])
def test_rates_have_units(fake: type[FakeEngine], run: Run, rate: str) -> None:
    assert run("render", "--note", "G2", "--rate", rate)[0] == 0
    assert soundfile.info("G2.wav").samplerate == 44100


def test_rates_have_units_everywhere(run: Run, tmp_path: Path) -> None:
    how = ("--apex", "1mm", "--duration", "5ms", "-q", "live", "--rate", "22.05kHz", "-o", tmp_path / "d")
    assert run("simulate", *how)[0] == 0
    assert np.load(tmp_path / "d" / "result.npz")["output_rate_hz"] == 22050
    assert "a whole number of Hz from 22.05 kHz to 192 kHz" in refusal(run, "play", "--rate", "44.1", status=2)


@pytest.mark.parametrize(
    "arguments", [("render", "--note", "G2"), ("simulate", "-q", "live", "-o", "d", "--duration", "1ms")], ids=str
)
def test_compiling_is_announced(
    fake: type[FakeEngine], run: Run, monkeypatch: pytest.MonkeyPatch, arguments: tuple[str, ...]
) -> None:
    status, _, err = run(*arguments)
    assert status == 0 and "compiling" not in err
    monkeypatch.setattr("livebass.compiling.library.is_cached", lambda: False)
    status, _, err = run(*arguments)
    assert status == 0 and err.startswith(f"compiling the kernels, once, in about {library.duration()} ...\n"), err


def test_what_is_left_out_without_scipy_is_said(run: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    how = ("simulate", "--analyse", "--duration", "60ms", "-q", "live", "-o", tmp_path / "d")
    status, _, err = run(*how)
    assert status == 0 and "SciPy" not in err
    monkeypatch.setitem(sys.modules, "scipy.signal", None)
    status, _, err = run(*how)
    assert status == 0
    assert "without the characteristic frequency, which needs SciPy" in err
    assert f"needs SciPy: {install('analysis')}" in err
