"""The public interface: its names, a score starts at the engine's frame, bad values are refused."""

from __future__ import annotations

import math
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from support.command import python
from support.quiet import without_noise

import livebass
from livebass.model.quality import quality_with

RATE = 22050
QUICK = quality_with("live", modes=40, contact_rate=100e3)
NAN, INF = math.nan, math.inf
LINE = [(0.0, 0.1, 28, 100), (0.15, 0.1, 43, 60), (0.2, 0.05, 33, 127)]


@pytest.fixture(scope="module")
def bass() -> livebass.Instrument:
    """Without unevenness and noise: the same line sounds the same twice."""
    return without_noise("jazz-finger", unevenness=0.0)


def engine(bass: livebass.Instrument, rate: int = RATE) -> livebass.Engine:
    return livebass.Engine(bass, QUICK, rate)


def play(engine: livebass.Engine, score: livebass.Score, tail: float | None = 0.1) -> np.ndarray:
    return np.concatenate(list(engine.play(score, tail)), axis=1)


def test_public_names_are_there_and_documented() -> None:
    """test_interface.py: they are those that were kept."""
    assert set(livebass.__all__) <= set(dir(livebass)) & set(re.findall(r"\w+", livebass.__doc__ or ""))
    with pytest.raises(AttributeError, match="No livebass attribute nothing"):
        livebass.nothing  # noqa: B018


def test_presets_and_scores_load_without_the_kernels() -> None:
    code = "import sys, livebass; livebass.load_preset, livebass.read_score; sys.exit('numba' in sys.modules)"
    assert python(code).returncode == 0


@pytest.mark.parametrize("tail", [0.0, 0.1, None])
def test_a_second_play_begins_where_the_first_ended(bass: livebass.Instrument, tail: float | None) -> None:
    score, bare = livebass.score_of(LINE, RATE), engine(bass)
    first = play(bare, score, tail)
    assert np.array_equal(first, play(engine(bass), score, tail)), "a fresh engine always plays the same"
    while bare.sounding():
        bare.process(RATE)
    start = bare.frame
    second = play(bare, score, tail)
    assert bare.frame - start >= second.shape[1] >= score.end_frame
    longest = min(first.shape[1], second.shape[1])
    loud = np.abs(first).max()
    assert np.abs(first[:, :longest] - second[:, :longest]).max() < 1e-3 * loud  # some old current in the coil
    assert bare.report().notes == 2 * len(LINE)


def test_two_plays_are_the_two_lines_in_a_row(bass: livebass.Instrument) -> None:
    score = livebass.score_of(LINE, RATE)
    late = score.end_frame / RATE
    both = livebass.score_of([*LINE, *((at + late, length, *note) for at, length, *note in LINE)], RATE)
    twice = engine(bass)
    list(twice.play(score, 0.0))
    second = play(twice, score, 0.1)
    whole = play(engine(bass), both, 0.1)
    assert np.array_equal(second, whole[:, score.end_frame :])


def test_a_note_that_ends_with_the_score_is_not_held_into_the_next(bass: livebass.Instrument) -> None:
    one = engine(bass)
    list(one.play(livebass.single_note(28, 100, 0.1, RATE), 0.0))
    one.process(RATE)
    assert not one.sounding()


def test_play_refuses_at_once(bass: livebass.Instrument, tmp_path: Path) -> None:
    one, score = engine(bass), livebass.single_note(28, 100, 0.1, RATE)
    with pytest.raises(ValueError, match=r"22050 Hz, the engine in 44100 Hz"):
        engine(bass, 44100).play(score)
    for tail in (NAN, INF, -1.0, -1e-9, 1e9):
        with pytest.raises(ValueError, match="tail must be from 0 to 86400 s"):
            one.play(score, tail)
        with pytest.raises(ValueError, match="tail must be from 0 to 86400 s"):
            livebass.render_to_array(bass, score, QUICK, tail=tail)
        with pytest.raises(ValueError, match="tail must be from 0 to 86400 s"):
            livebass.render_to_file(bass, score, str(tmp_path / "a.wav"), quality=QUICK, rate=RATE, tail=tail)
    assert one.frame == 0


BAD_RATES: list[Any] = [0, -1, 1, 100, 7999, 192_001, 48000.5, NAN, INF, "48000", None]


@pytest.mark.parametrize("rate", BAD_RATES)
def test_rates(bass: livebass.Instrument, tmp_path: Path, rate: Any) -> None:
    for call in (
        lambda: livebass.single_note(43, 100, 1.0, rate),
        lambda: livebass.score_of([], rate),
        lambda: livebass.demo_score(rate),
        lambda: livebass.read_score(tmp_path / "none.mid", rate),
        lambda: livebass.Engine(bass, QUICK, rate),
    ):
        with pytest.raises(ValueError, match="rate must be a whole number from 8000 to 192000 Hz"):
            call()


def test_rates_of_numpy() -> None:
    assert livebass.single_note(np.int64(43), np.int32(100), 1.0, np.int64(RATE)).notes == 1  # type: ignore[arg-type]


@pytest.mark.parametrize("channel", ["foo", "", "1", 0, 17, -1, None, 1.5])
def test_channels(tmp_path: Path, channel: Any) -> None:
    with pytest.raises(ValueError, match='channel must be "auto", "all" or a number from 1 to 16'):
        livebass.read_score(tmp_path / "none.mid", RATE, channel)


@pytest.mark.parametrize(
    "note",
    [
        *[(at, 1.0, 43, 100) for at in (-1.0, NAN, INF, 1e9)],
        *[(0.0, length, 43, 100) for length in (-1.0, NAN, INF, 1e9)],
        *[(0.0, 1.0, key, 100) for key in (-1, 128, 43.5, NAN)],
        *[(0.0, 1.0, 43, velocity) for velocity in (0, 128, 99.5, NAN)],
    ],
)
def test_notes(note: Any) -> None:
    with pytest.raises(ValueError, match=r"note|velocity must be (a whole number )?from "):
        livebass.score_of([note], RATE)
    if note[0] == 0:
        with pytest.raises(ValueError, match=r"note|velocity must be (a whole number )?from "):
            livebass.single_note(note[2], note[3], note[1], RATE)


@pytest.mark.parametrize(
    "bend", [*[(at, 0.0) for at in (-0.1, NAN, INF, 1e9)], *[(0.0, to) for to in (-1.01, 1.01, NAN, INF)]]
)
def test_bends(bend: tuple[float, float]) -> None:
    with pytest.raises(ValueError, match=r"bend must be from (-1 to 1|0 to 86400 s), not"):
        livebass.score_of([(0.0, 1.0, 43, 100)], RATE, [bend])
