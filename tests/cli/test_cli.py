"""The command line as people use it, and the public interface."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
import soundfile
from support.command import GOOD, Run, assert_one_clear_line, cli_text, command
from support.engine import FakeEngine

ROOT = Path(__file__).parents[2]


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
        (
            ["song.mid", "--bits", "float", "--channel", "1", "-q", "live", "--tail", "100ms"],
            "song.wav",
            "FLOAT",
        ),
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
    from livebass.preset.load import preset_names

    status, _, err = run("render", "--all-presets", "demos", "--format", "flac", "--rate", 22050)
    assert status == 0
    assert sorted(p.name for p in (tmp_path / "demos").iterdir()) == sorted(f"{n}.flac" for n in preset_names())
    assert err.count("\n") == len(preset_names())


def test_presets(run: Run, tmp_path: Path) -> None:
    listed = cli_text(run, "presets", "list")
    assert "jazz-finger" in listed and "slap" in listed
    (tmp_path / "mine.toml").write_text(cli_text(run, "presets", "show", "slap"))
    assert "good" in cli_text(run, "presets", "check", tmp_path / "mine.toml")
    assert cli_text(run, "presets", "check", "paper-g").endswith(", string G, 20 frets\n")
    assert "scale_length" in cli_text(run, "presets", "keys")


def test_simulate(run: Run, tmp_path: Path) -> None:
    arguments = ["--apex", "3.6mm", "--at", "0.64", "--duration", "20 ms", "-q", "live", "-o", tmp_path / "d"]
    status, _, err = run("simulate", *arguments)
    assert status == 0, err
    assert {p.name for p in (tmp_path / "d").iterdir()} == {"displacement.wav", "contacts.csv", "result.npz"}


def test_bench(monkeypatch: pytest.MonkeyPatch, run: Run, tmp_path: Path) -> None:
    bench = SimpleNamespace(bench_render=lambda _: {"engine": 0.2}, table=lambda result: f"table {result}")
    monkeypatch.setitem(sys.modules, "livebass.bench.render", bench)
    monkeypatch.setattr("livebass.compiling.cached", lambda: True)
    assert "table" in cli_text(run, "bench", "render", "--json", tmp_path / "b.json")
    assert json.loads((tmp_path / "b.json").read_text()) == {"engine": 0.2}
    status, _, err = run("bench", "render", "--json", tmp_path)
    assert_one_clear_line(status, err, (1,))


@pytest.mark.parametrize("arguments", [["--help"], ["render", "--help"], ["--version"], ["presets", "list"]])
def test_help_starts_fast_and_without_kernels(arguments: list[str]) -> None:
    code = (
        "import sys; from livebass.cli import main as cli; status = cli.run(sys.argv[1:]);"
        "sys.exit(status or ('numba' in sys.modules) * 9)"
    )
    done = subprocess.run([sys.executable, "-c", code, *arguments], capture_output=True, text=True, timeout=60)
    assert (done.returncode, done.stderr) == (0, "") and done.stdout


def test_the_module_runs() -> None:
    done = command("render", "--note", "H2")
    assert_one_clear_line(done.returncode, done.stderr, (2,))
    done = command()
    assert done.returncode == 2 and "Commands:" in done.stderr


@pytest.mark.parametrize("script", ["example_note.py", "example_song.py"])
def test_examples_run(tmp_path: Path, script: str) -> None:
    line = [sys.executable, str(ROOT / "tools" / script)]
    done = subprocess.run(line, cwd=tmp_path, capture_output=True, text=True, timeout=300)
    assert (done.returncode, done.stderr) == (0, "")
    assert done.stdout


def test_spectrogram(tmp_path: Path) -> None:
    soundfile.write(tmp_path / "a.wav", np.random.default_rng(1).normal(0, 0.1, 48000), 48000)
    line = [sys.executable, str(ROOT / "tools" / "spectrogram.py"), str(tmp_path / "a.wav")]
    subprocess.run(line, check=True, timeout=120)
    assert (tmp_path / "a.png").read_bytes().startswith(b"\x89PNG")
    (tmp_path / "b.wav").write_text("not sound")
    done = subprocess.run([*line[:2], str(tmp_path / "b.wav")], capture_output=True, text=True, timeout=120)
    assert done.returncode == 1
    assert "Traceback" not in done.stderr
