"""The guide, and its recording through an input."""

from __future__ import annotations

import math
from collections.abc import Iterator
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from support.command import Run, refusal

from livebass.lab.comparison.notes import measure_notes
from livebass.lab.fitting import recording
from livebass.lab.fitting.guide import Step, steps
from livebass.lab.fitting.recording import BLOCK, RATE, SILENCE_FILE, record
from livebass.preset.load import load_preset
from livebass.rows.arrays import Floats
from livebass.sound.audiofile import read_sound


def test_the_guide_names_every_string_fret_and_force_twice(run: Run) -> None:
    all_steps = steps(load_preset("jazz-finger"))
    assert len(all_steps) == len({s.file for s in all_steps}) == 72
    assert [s.string for s in all_steps[::18]] == ["E", "A", "D", "G"]
    assert all_steps[7].file == "stringE_fret05_soft_take2.flac" and all_steps[7].key == 33
    status, out, _ = run("fit", "--guide")
    assert status == 0 and "72 notes" in out and "stringE_open_soft_take2.flac" in out
    assert all(len(line) <= 100 and line.isascii() for line in out.splitlines())
    status, out, _ = run("fit", "--guide", "--like", "five-string", "--tuning", "standard")
    assert status == 0 and "90 notes" in out and "B string (B0)" in out


def blocks(*sounds: Floats) -> Iterator[Floats]:
    whole = np.concatenate(sounds)
    for first in range(0, whole.size - BLOCK + 1, BLOCK):
        yield whole[first : first + BLOCK]


def note(peak: float, key: int = 28) -> Floats:
    t = np.arange(round(5 * RATE)) / RATE
    f0 = 440 * 2 ** ((key - 69) / 12)
    return np.asarray(peak * np.exp(-t) * np.sin(2 * math.pi * f0 * t))


def test_recording_asks_again_for_bad_notes_and_skips_those_that_are_there(tmp_path: Path) -> None:
    quiet = 1e-5 * np.random.default_rng(1).standard_normal(6 * RATE)
    said: list[str] = []
    wanted = [Step("E", 0, "open", 28, "soft", 1), Step("E", 0, "open", 28, "hard", 1)]
    heard = blocks(quiet, note(1e-3), quiet, note(0.2), quiet, note(1.0), quiet, note(0.5), quiet)
    assert record(wanted, tmp_path, heard.__next__, said.append) == 3
    assert [line for line in said if "again" in line] == [
        "this peaks at -60 dBFS: turn the input up; play it again", "this clips: turn the input down; play it again"
    ]  # fmt: skip
    names = {path.name for path in tmp_path.iterdir()}
    assert names == {SILENCE_FILE, *(step.file for step in wanted)}
    found = measure_notes([tmp_path])
    assert [Path(n.name).name for n in found if n.kind == "silence"] == [SILENCE_FILE]
    assert {(n.dynamic, n.open) for n in found if n.kind == "note"} == {("soft", True), ("hard", True)}
    loud = read_sound(tmp_path / wanted[1].file, "recording", 10, (8000, 96_000)).samples
    assert np.abs(loud).max() == pytest.approx(0.5, abs=0.01)
    assert record(wanted, tmp_path, blocks(quiet).__next__, said.append) == 0


def test_without_an_input_there_is_one_line(run: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    class Lost(Exception):
        pass

    def none(**_: Any) -> None:
        raise Lost("Error querying device -1")

    monkeypatch.setattr(recording, "sounddevice", lambda: SimpleNamespace(PortAudioError=Lost, InputStream=none))
    err = refusal(run, "fit", "--guide", "--record", tmp_path / "d", status=1)
    assert "no audio input to record from" in err and not (tmp_path / "d").exists()
    refusal(run, "fit", "--record", tmp_path / "d", status=2)


def test_ctrl_c_leaves_the_notes_recorded_so_far(run: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    quiet = 1e-5 * np.random.default_rng(1).standard_normal(6 * RATE)
    heard = blocks(quiet, note(0.2), quiet)

    def read(_: int) -> tuple[Floats, bool]:
        for block in heard:
            return block[:, None], False
        raise KeyboardInterrupt

    stream = SimpleNamespace(start=lambda: None, close=lambda: None, read=read)
    fake = SimpleNamespace(PortAudioError=OSError, InputStream=lambda **_: stream)
    monkeypatch.setattr(recording, "sounddevice", lambda: fake)
    status, _, err = run("fit", "--guide", "--record", tmp_path / "d")
    assert status == 130 and "1 of 72 notes are in" in err and "the same command goes on" in err
    assert sorted(p.name for p in (tmp_path / "d").iterdir()) == [SILENCE_FILE, "stringE_open_soft_take1.flac"]
