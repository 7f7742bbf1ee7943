"""The command line as people use it: results, and one clear line with status 1 or 2 for everything else."""

from __future__ import annotations

import json
import resource
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
import soundfile

from livebass import cli
from livebass import render as render_module
from livebass.score import Score

HEAD = b"MThd\x00\x00\x00\x06\x00\x00\x00\x01\x01\xe0"  # type 0, one track, 480 ticks a quarter


def song(*events: bytes, head: bytes = HEAD) -> bytes:
    track = b"".join(events) + b"\x00\xff\x2f\x00"
    return head + b"MTrk" + len(track).to_bytes(4) + track


BASS = b"\x00\xc0\x21"
NOTE = b"\x00\x90\x28\x64\x81\x70\x80\x28\x40"  # a quarter of a second
GOOD = song(BASS, NOTE)
CHORD = b"".join(b"\x00\x90" + bytes([n, 100]) for n in range(128))


class FakeEngine:
    """A second of a sine for each string, in blocks; the same interface, without kernels."""

    peak = 0.1
    blocks = 10

    def __init__(self, instrument: object, quality: object, rate: int, seed: int = 0) -> None:
        self.rate = rate

    def play(self, score: Score, tail: float | None = None) -> Iterator[np.ndarray]:
        t = np.arange(self.rate // 10) / self.rate
        for _ in range(self.blocks):
            yield np.stack([self.peak * np.sin(2 * np.pi * (40 + 30 * k) * t + k) for k in range(4)])

    def report(self) -> SimpleNamespace:
        return SimpleNamespace(notes=5, transposed=2, dropped=1)


@pytest.fixture
def fake(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> type[FakeEngine]:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(render_module, "Engine", FakeEngine)
    monkeypatch.setattr("livebass.engine.kernels_cached", lambda: True)
    monkeypatch.setattr(FakeEngine, "peak", 0.1)
    return FakeEngine


Run = Callable[..., tuple[int, str, str]]


@pytest.fixture
def run(capfd: pytest.CaptureFixture[str]) -> Run:
    def run_(*arguments: object) -> tuple[int, str, str]:
        status = cli.run([str(a) for a in arguments])
        out, err = capfd.readouterr()
        return status, out, err

    return run_


def command(*arguments: object, **options: object) -> subprocess.CompletedProcess[str]:
    line = [sys.executable, "-m", "livebass", *map(str, arguments)]
    return subprocess.run(line, capture_output=True, text=True, timeout=300, **options)  # type: ignore[call-overload, no-any-return]


def assert_one_clear_line(status: int, err: str, allowed: tuple[int, ...] = (1, 2)) -> None:
    assert status in allowed, err
    assert err.startswith("livebass: error: ") and err.count("\n") == 1, err
    assert "Traceback" not in err and "internal error" not in err, err


def test_render_a_file(fake: type[FakeEngine], run: Run, tmp_path: Path) -> None:
    (tmp_path / "song.mid").write_bytes(GOOD)
    status, out, err = run("render", "song.mid", "-o", "out.wav", "--rate", 44100)
    assert (status, out) == (0, "")
    assert err.startswith("out.wav: 5 notes (2 transposed, 1 dropped), 1.00 s, ") and "times real time" in err
    info = soundfile.info("out.wav")
    assert (info.samplerate, info.channels, info.subtype) == (44100, 1, "PCM_24")


@pytest.mark.parametrize(
    ("arguments", "file", "subtype"),
    [
        (["--note", "G2"], "G2.wav", "PCM_24"),
        (["--note", "c#1", "--format", "flac", "--bits", "16"], "C#1.flac", "PCM_16"),
        (["song.mid", "--format", "ogg"], "song.ogg", "VORBIS"),
        (["song.mid", "--bits", "float", "--channel", "1", "-q", "live", "--tail", "100ms"], "song.wav", "FLOAT"),
        (["song.mid", "-o", "x.FLAC", "--modes", "1e2", "--contact-rate", "1.5MHz"], "x.FLAC", "PCM_24"),
    ],
)
def test_names_and_formats(
    fake: type[FakeEngine], run: Run, tmp_path: Path, arguments: list[str], file: str, subtype: str
) -> None:
    (tmp_path / "song.mid").write_bytes(GOOD)
    assert run("render", *arguments)[0] == 0
    assert soundfile.info(file).subtype == subtype


def test_stems_add_up_to_the_mix_bit_for_bit(fake: type[FakeEngine], run: Run) -> None:
    assert run("render", "--note", "E1", "--stems", "--bits", "float", "--gain", "-3dB", "-o", "e.wav")[0] == 0
    stems = [soundfile.read(f"e.{name}.wav", dtype="float32")[0] for name in "EADG"]
    total = stems[0].copy()
    for stem in stems[1:]:
        total += stem
    assert total.tobytes() == soundfile.read("e.wav", dtype="float32")[0].tobytes()
    assert np.max(np.abs(stems[0])) == pytest.approx(0.1 * 10 ** (-3 / 20), rel=1e-3)


def test_clipping_is_said(fake: type[FakeEngine], run: Run) -> None:
    fake.peak = 1.0
    err = run("render", "--note", "E1", "--gain", "2")[2]
    assert "samples clipped: try --gain -1" in err


def test_a_sound_that_is_not_a_number(fake: type[FakeEngine], run: Run, tmp_path: Path) -> None:
    fake.peak = float("nan")
    status, _, err = run("render", "--note", "E1")
    assert_one_clear_line(status, err, (1,))
    assert "not finite" in err and not list(tmp_path.iterdir())


def test_all_presets(fake: type[FakeEngine], run: Run, tmp_path: Path) -> None:
    from livebass.preset import preset_names

    status, _, err = run("render", "--all-presets", "demos", "--format", "flac", "--rate", 22050)
    assert status == 0
    assert sorted(p.name for p in (tmp_path / "demos").iterdir()) == sorted(f"{n}.flac" for n in preset_names())
    assert err.count("\n") == len(preset_names())


USAGE = [
    ["render"],
    ["render", "a.mid", "--note", "G2"],
    ["render", "--all-presets", "demos", "-o", "a.wav"],
    ["render", "--note", "H2"],
    ["render", "--note", "128"],
    ["render", "--note", "G2", "--velocity", "0"],
    ["render", "--note", "G2", "--velocity", "1.5"],
    ["render", "--note", "G2", "--duration", "nan"],
    ["render", "--note", "G2", "--duration", "-1"],
    ["render", "--note", "G2", "--duration", "inf"],
    ["render", "--note", "G2", "--duration", "3kg"],
    ["render", "--note", "G2", "--modes", "1e9"],
    ["render", "--note", "G2", "--modes", "-1"],
    ["render", "--note", "G2", "--modes", "nan"],
    ["render", "--note", "G2", "--modes", "12.5"],
    ["render", "--note", "G2", "--contact-rate", "1e30"],
    ["render", "--note", "G2", "--rate", "22049"],
    ["render", "--note", "G2", "--rate", "1e9"],
    ["render", "--note", "G2", "--gain", "nan"],
    ["render", "--note", "G2", "--gain", "999"],
    ["render", "--note", "G2", "--tail", "-1"],
    ["render", "--note", "G2", "--seed", "-1"],
    ["render", "--note", "G2", "--quality", "best"],
    ["render", "--note", "G2", "--format", "mp3"],
    ["render", "--note", "G2", "--channel", "17"],
    ["render", "--note", "G2", "-o", "a.mp3"],
    ["render", "--note", "G2", "-o", "a.wav", "--format", "ogg"],
    ["render", "--note", "G2", "--format", "ogg", "--bits", "16"],
    ["render", "--note", "G2", "--format", "flac", "--bits", "float"],
    ["render", "--note", "G2", "--format", "flac", "--rate", "96001"],
    ["simulate"],
    ["simulate", "-o", "d", "--apex", "1e9mm"],
    ["simulate", "-o", "d", "--at", "nan"],
    ["simulate", "-o", "d", "--solver", "magic"],
    ["presets", "show"],
    ["nonsense"],
    ["render", "--nonsense"],
]


@pytest.mark.parametrize("arguments", USAGE, ids=" ".join)
def test_wrong_usage(run: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, arguments: list[str]) -> None:
    monkeypatch.chdir(tmp_path)
    status, _, err = run(*arguments)
    assert_one_clear_line(status, err, (2,))
    assert not list(tmp_path.iterdir())


BAD_FILES = {
    "empty": b"",
    "text": b"not midi",
    "truncated": GOOD[:-7],
    "no track": HEAD,
    "no notes": song(BASS),
    "no bass notes": song(NOTE),
}


@pytest.mark.parametrize("name", BAD_FILES)
def test_bad_midi_files(fake: type[FakeEngine], run: Run, tmp_path: Path, name: str) -> None:
    path = tmp_path / "bad \n\x1b.mid"
    path.write_bytes(BAD_FILES[name])
    status, _, err = run("render", path, "-o", "out.wav")
    assert_one_clear_line(status, err, (1,))
    assert list(tmp_path.iterdir()) == [path]


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (["render", "."], "is a directory"),
        (["render", "none.mid"], "No such file"),
        (["render", "--note", "G2", "-o", "dir.wav"], "is a directory"),
        (["render", "--note", "G2", "-o", "none/out.wav"], "there is no directory"),
        (["render", "--note", "G2", "-o", "/dev/full", "--format", "wav"], "not a regular file"),
        (["render", "--note", "G2", "-o", "/proc/out.wav"], "cannot be written"),
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
    text = cli_text(run, "presets", "show", "jazz-finger")
    (tmp_path / "nan.toml").write_text(text.replace('action = "2 mm"', "action = nan", 1))
    status, _, err = run(*arguments)
    assert_one_clear_line(status, err, (1,))
    assert says in err
    assert sorted(p.name for p in tmp_path.iterdir()) == ["dir.wav", "file", "nan.toml"]


def cli_text(run: Run, *arguments: object) -> str:
    status, out, _ = run(*arguments)
    assert status == 0
    return out


ODD_FILES = {
    "zero length": song(BASS, b"\x00\x90\x28\x64\x00\x80\x28\x40"),
    "orphan offs": song(BASS, b"\x00\x80\x20\x40\x00\x90\x21\x00", NOTE),
    "never ends": song(BASS, b"\x00\x90\x28\x64"),
    "a chord of 128": song(BASS, CHORD, b"\x10\xb0\x7b\x00"),
}


@pytest.mark.parametrize("name", ODD_FILES)
def test_odd_files_through_the_real_engine(run: Run, tmp_path: Path, name: str) -> None:
    (tmp_path / "odd.mid").write_bytes(ODD_FILES[name])
    status, _, err = run("render", tmp_path / "odd.mid", "-o", tmp_path / "o.wav", "-q", "live", "--tail", "0.2",
                         "--bits", "float")  # fmt: skip
    assert status == 0, err
    sound, _ = soundfile.read(tmp_path / "o.wav")
    assert np.isfinite(sound).all() and np.abs(sound).max() > 1e-6


def test_presets(run: Run, tmp_path: Path) -> None:
    listed = cli_text(run, "presets", "list")
    assert "jazz-finger" in listed and "slap" in listed
    (tmp_path / "mine.toml").write_text(cli_text(run, "presets", "show", "slap"))
    assert "good" in cli_text(run, "presets", "check", tmp_path / "mine.toml")
    assert "scale_length" in cli_text(run, "presets", "keys")


def test_simulate(run: Run, tmp_path: Path) -> None:
    arguments = ["--apex", "3.6mm", "--at", "0.64", "--duration", "20 ms", "-q", "live", "-o", tmp_path / "d"]
    status, _, err = run("simulate", *arguments)
    assert status == 0, err
    assert {p.name for p in (tmp_path / "d").iterdir()} == {"displacement.wav", "contacts.csv", "result.npz"}


def test_bench(monkeypatch: pytest.MonkeyPatch, run: Run, tmp_path: Path) -> None:
    bench = SimpleNamespace(bench_render=lambda: {"engine": 0.2}, table=lambda result: f"table {result}")
    monkeypatch.setitem(sys.modules, "livebass.bench", bench)
    monkeypatch.setattr("livebass.engine.kernels_cached", lambda: True)
    assert "table" in cli_text(run, "bench", "render", "--json", tmp_path / "b.json")
    assert json.loads((tmp_path / "b.json").read_text()) == {"engine": 0.2}
    status, _, err = run("bench", "render", "--json", tmp_path)
    assert_one_clear_line(status, err, (1,))


def test_a_defect_is_one_line_too(fake: type[FakeEngine], run: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(fake, "report", lambda self: 1 / 0)
    status, _, err = run("render", "--note", "G2")
    assert status == 1 and err.count("\n") == 1
    assert "internal error, ZeroDivisionError" in err and "LIVEBASS_TRACEBACK" in err


@pytest.mark.parametrize("arguments", [["--help"], ["render", "--help"], ["--version"], ["presets", "list"]])
def test_help_starts_fast_and_without_kernels(arguments: list[str]) -> None:
    code = (
        "import sys; from livebass import cli; status = cli.run(sys.argv[1:]);"
        "sys.exit(status or ('numba' in sys.modules) * 9)"
    )
    done = subprocess.run([sys.executable, "-c", code, *arguments], capture_output=True, text=True, timeout=60)
    assert (done.returncode, done.stderr) == (0, "") and done.stdout


def test_the_module_runs() -> None:
    done = command("render", "--note", "H2")
    assert_one_clear_line(done.returncode, done.stderr, (2,))
    done = command()
    assert done.returncode == 2 and "Commands:" in done.stderr


def test_a_full_stdout_and_a_closed_pipe() -> None:
    with open("/dev/full", "w") as full:
        line = [sys.executable, "-m", "livebass", "presets", "list"]
        done = subprocess.run(line, stdout=full, stderr=subprocess.PIPE, text=True, timeout=60)
        assert_one_clear_line(done.returncode, done.stderr, (1,))
    process = subprocess.Popen(
        [sys.executable, "-m", "livebass", "presets", "keys"], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    )
    assert process.stdout and process.stderr
    process.stdout.close()
    assert process.stderr.read() == ""
    assert process.wait(60) != 0
    process.stderr.close()


def test_a_full_disk_leaves_nothing(tmp_path: Path) -> None:
    def small() -> None:
        resource.setrlimit(resource.RLIMIT_FSIZE, (20_000, 20_000))

    # The kernels' cache must be there before: its files are larger than the limit.
    warm = command("render", "--note", "G2", "--duration", "0.1", "-q", "live", "-o", tmp_path / "warm.wav")
    assert warm.returncode == 0, warm.stderr
    (tmp_path / "warm.wav").unlink()
    done = command(
        "render", "--note", "G2", "--duration", "1", "-q", "live", "--stems", "-o", tmp_path / "a.wav",
        preexec_fn=small,
    )  # fmt: skip
    assert_one_clear_line(done.returncode, done.stderr, (1,))
    assert "File too large" in done.stderr and not list(tmp_path.iterdir())


@pytest.mark.parametrize(("number", "status"), [(signal.SIGINT, 130), (signal.SIGTERM, 143), (signal.SIGHUP, 129)])
def test_an_interrupt_leaves_nothing(tmp_path: Path, number: int, status: int) -> None:
    out = tmp_path / "long.wav"
    process = subprocess.Popen(
        [sys.executable, "-m", "livebass", "render", "--note", "E1", "--duration", "3600s", "-o", str(out), "--stems"],
        stderr=subprocess.PIPE, text=True,
    )  # fmt: skip
    for _ in range(600):
        if list(tmp_path.iterdir()) or process.poll() is not None:
            break
        time.sleep(0.1)
    assert list(tmp_path.iterdir()), "nothing was begun"
    time.sleep(0.3)
    process.send_signal(number)
    _, err = process.communicate(timeout=60)
    assert process.returncode == status and "Traceback" not in err
    assert not list(tmp_path.iterdir())
