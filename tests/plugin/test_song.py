"""A score given to the plugin plays beside the host's notes: as rendered, once or looped, in blocks of any length."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from support.picture import Host, shelf
from support.plugins import PRESETS, RATE, hard_score, midi_score, mono

from livebass.arrays import Floats
from livebass.plugin.systems import this_system
from livebass.score.score import score_of

pytestmark = pytest.mark.skipif(this_system().name != "linux-x86_64", reason="hosts by ctypes")
HELD = score_of([(0.0, 3.0, 33, 100)], RATE)
TUNE = score_of([(0.1 * k, 0.08, 30 + 3 * k, 110) for k in range(4)], RATE, bends=[(0.25, 0.5)])


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return shelf(tmp_path_factory.mktemp("song"), PRESETS[:2])


@pytest.fixture
def host(folder: Path) -> Iterator[Host]:
    made = unrelieved(folder)
    yield made
    made.close()


def unrelieved(folder: Path) -> Host:
    """A host whose sound does not depend on the load of the machine."""
    host = Host(folder)
    host.set("relief", 0)
    return host


def in_blocks(host: Host, count: int, sizes: tuple[int, ...]) -> Floats:
    """Plays `count` frames in blocks of these sizes, in turn."""
    blocks, left = [], count
    while left > 0:
        for size in sizes:
            blocks.append(host.play(min(size, left), min(size, left)) if left > 0 else np.zeros(0, np.float32))
            left -= len(blocks[-1])
    return np.concatenate(blocks)


@pytest.mark.parametrize("sizes", [(256,), (1000, 1, 77), (5000,)])
def test_it_sounds_as_rendered_in_blocks_of_any_length(host: Host, sizes: tuple[int, ...]) -> None:
    score = hard_score()
    host.give(score)
    host.roll()
    wanted = mono(PRESETS[0], score)
    assert np.array_equal(in_blocks(host, len(wanted), sizes), wanted)
    assert not host.rolls()


def test_its_controllers_bends_and_pedals_are_those_of_a_render(host: Host, tmp_path: Path) -> None:
    score = midi_score(tmp_path / "controls.mid")
    host.give(score)
    host.roll()
    wanted = mono(PRESETS[0], score)[: score.end_frame]
    assert np.array_equal(host.play(len(wanted)), wanted)


def test_a_loop_begins_again_at_its_frame(folder: Path) -> None:
    """Every turn sends the same messages at the same places, in blocks of any length."""
    heard = []
    for sizes in ((256,), (999, 1), (20_000,)):
        host = unrelieved(folder)
        host.give(TUNE, round(0.5 * RATE))
        host.roll(loops=True)
        heard.append(in_blocks(host, 2 * RATE, sizes))
        assert host.rolls() and not host.may_sleep()
        host.close()
    assert all(np.array_equal(heard[0], other) for other in heard[1:])
    turns = [np.abs(heard[0][at : at + RATE // 10]).max() for at in range(0, 2 * RATE, RATE // 2)]
    assert min(turns) > 0.5 * max(turns) > 0.01


def test_to_stop_ends_its_notes_and_rewinds(host: Host) -> None:
    host.give(HELD)
    host.roll()
    loud = np.abs(host.play(RATE // 2)).max()
    host.roll(False)
    host.play(RATE)
    assert np.abs(host.play(256)).max() < 1e-3 * loud
    host.roll()
    assert np.abs(host.play(RATE // 4)).max() > 0.3 * loud


def test_the_hosts_own_notes_play_beside_it_and_stay(folder: Path) -> None:
    """A song that stops, or is replaced, ends its own notes alone."""
    levels = []
    for given in (None, score_of([(0.0, 3.0, 28, 100)], RATE)):
        host = unrelieved(folder)
        if given:
            host.give(given)
            host.roll()
        host.note(True, 43)
        host.play(RATE // 4)
        host.roll(False)
        host.play(RATE)
        levels.append(np.abs(host.play(2048)).max())
        host.close()
    assert levels[0] > 0.01 and levels[1] > 0.5 * levels[0]


def test_another_song_replaces_it_between_two_blocks(host: Host) -> None:
    host.give(HELD)
    host.roll()
    host.play(RATE // 4)
    for _ in range(3):  # only the last one is heard
        host.give(TUNE)
    host.play(RATE)
    assert not host.rolls()
    host.play(RATE)
    assert np.abs(host.play(256)).max() < 1e-3


def test_a_reset_stops_it(host: Host) -> None:
    host.give(HELD)
    host.roll()
    host.play(1000)
    host.library.lb_reset_instance(host.address)
    assert not host.rolls() and not host.play(RATE // 4).any()
    host.roll()
    assert np.array_equal(host.play(RATE // 4), mono(PRESETS[0], HELD)[: RATE // 4])
