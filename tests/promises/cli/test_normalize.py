"""`render --normalize`: the requested loudness for mix and stems, and no peak beyond the ceiling."""

from __future__ import annotations

import io
import tracemalloc
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import soundfile
from support.command import Run, refusal
from support.engine import FakeEngine

from livebass import loudness
from livebass.cli import main as cli
from livebass.engine import render
from livebass.rows.arrays import Floats
from livebass.sound.meter import LoudnessMeter

NOTE = ("render", "--note", "E1", "--velocity", "110", "--duration", "1s", "-q", "live")


def test_the_sound_gets_the_loudness_and_its_strings_the_same_gain(run: Run, tmp_path: Path) -> None:
    plain, there = tmp_path / "plain.wav", tmp_path / "there.wav"
    assert run(*NOTE, "--bits", "float", "-o", plain)[0] == 0
    status, _, err = run(*NOTE, "--bits", "float", "--stems", "--normalize", "-30", "-o", there)
    assert status == 0
    (before, rate), (after, _) = (soundfile.read(file, dtype="float32") for file in (plain, there))
    assert loudness(after, rate) == pytest.approx(-30, abs=1e-4)
    gain = -30 - loudness(before, rate)
    assert np.allclose(after, before * 10 ** (gain / 20), rtol=1e-5, atol=1e-9)
    assert f", -30.0 LUFS by {gain:+.1f} dB\n" in err
    strings = [soundfile.read(tmp_path / f"there.{name}.wav", dtype="float32")[0] for name in "EADG"]
    assert np.array_equal(render.mix_strings(np.array(strings)), after)
    assert sorted(file.name for file in tmp_path.iterdir()) == [
        "plain.wav", "there.A.wav", "there.D.wav", "there.E.wav", "there.G.wav", "there.wav"
    ]  # fmt: skip


@pytest.mark.parametrize("bits", ["16", "float"])
def test_no_peak_goes_beyond_the_ceiling(run: Run, tmp_path: Path, bits: str) -> None:
    status, _, err = run(*NOTE, "--bits", bits, "--normalize", "-3", "-o", tmp_path / "a.wav")
    sound, rate = soundfile.read(tmp_path / "a.wav")
    assert status == 0 and 20 * np.log10(np.abs(sound).max()) == pytest.approx(-1, abs=1e-3)
    assert f", {loudness(sound, rate):.1f} LUFS by " in err and "clipped" not in err
    assert err.endswith(": -3 LUFS would bring the peak beyond -1 dBFS\n")


def test_a_pipe(capfdbinary: pytest.CaptureFixture[bytes]) -> None:
    assert cli.run([*NOTE, "--normalize", "-24", "--bits", "float", "-o", "-"]) == 0
    sound, rate = soundfile.read(io.BytesIO(capfdbinary.readouterr().out))
    assert loudness(sound, rate) == pytest.approx(-24, abs=1e-4)


def test_all_presets(fake: type[FakeEngine], run: Run, tmp_path: Path) -> None:
    status, _, err = run("render", "--all-presets", "d", "--normalize", "-40", "--bits", "float")
    assert status == 0
    for line, file in zip(err.splitlines(), sorted(Path("d").iterdir()), strict=True):
        sound, rate = soundfile.read(file)
        assert loudness(sound, rate) == pytest.approx(-40, abs=0.01) and ", -40.0 LUFS by " in line


def test_silence_stays_silence(fake: type[FakeEngine], run: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(FakeEngine, "peak", 1e-6)
    status, _, err = run("render", "--note", "E1", "--normalize", "-16", "--bits", "float", "-o", "a.wav")
    assert status == 0 and err.endswith(", too quiet to be normalized\n")
    assert 0 < np.abs(soundfile.read("a.wav")[0]).max() <= 4e-6


@pytest.mark.parametrize(
    "arguments", [("-61",), ("1",), ("nan",), ("loud",), ("-16", "--gain", "0"), ("",)], ids=" ".join
)
def test_what_is_not_a_loudness_is_one_line(fake: type[FakeEngine], run: Run, arguments: tuple[str, ...]) -> None:
    err = refusal(run, "render", "--note", "E1", "--normalize", *arguments, status=2)
    assert "--normalize" in err and not list(Path().iterdir())


def test_a_disk_without_room_for_what_is_measured(
    fake: type[FakeEngine], run: Run, monkeypatch: pytest.MonkeyPatch
) -> None:
    class Full(io.BytesIO):
        def write(self, data: Any) -> int:
            raise OSError(28, "No space left on device")

    monkeypatch.setattr(render.tempfile, "TemporaryFile", lambda **_: Full())
    err = refusal(run, "render", "--note", "E1", "--normalize", "-16", "-o", "a.wav", status=1)
    assert "a.wav: cannot be written: No space left on device" in err and not list(Path().iterdir())


def test_a_long_sound_is_not_held_in_memory(tmp_path: Path) -> None:
    """Four minutes of four strings are 184 MB."""
    rate, block = 48_000, np.full((4, 48_000), 0.01, np.float32)
    block[:, ::2] *= -1

    def blocks() -> Iterator[tuple[Floats, None]]:
        for _ in range(240):
            yield block.copy(), None

    frames = 0
    tracemalloc.start()
    try:
        with render._normalize(blocks(), LoudnessMeter(rate), -20.0, tmp_path / "a.wav") as (again, gain):  # type: ignore[arg-type]
            for one, _ in again:
                frames += one.shape[1]
        peak = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    assert frames == 240 * rate and gain < 40 and peak < 130e6
