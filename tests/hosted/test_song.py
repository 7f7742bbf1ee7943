"""A MIDI file dropped on the plugin plays beside the host's notes: as rendered, once or looped, in any blocks."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import mido
import numpy as np
import pytest
from support.picture import LOOP, PUT_AWAY, ROLL, Host, Picture
from support.plugins import PRESETS, RATE, hard_score, midi_score, mono
from support.scores import blocks
from support.song import midi_file, notes_of

from livebass import load_preset
from livebass.plugin.systems import this_system
from livebass.rows.arrays import Floats
from livebass.score.low_keys import with_low_notes
from livebass.score.reading import TAKE, read_score
from livebass.score.score import score_of

pytestmark = pytest.mark.skipif(this_system().name != "linux-x86_64", reason="hosts by ctypes")
BASSES = PRESETS[:2]
HELD = score_of([(0.0, 3.0, 33, 100)], RATE)
TUNE = score_of([(0.1 * k, 0.08, 30 + 3 * k, 110) for k in range(4)], RATE, bends=[(0.25, 0.5)])


@pytest.fixture
def another(instruments: Path, lend: Any) -> Callable[[], Host]:
    """Makes hosts whose sound does not depend on the load of the machine."""

    def make() -> Host:
        made: Host = lend(Host(instruments))
        made.set("relief", 0)
        return made

    return make


@pytest.fixture
def host(another: Callable[[], Host]) -> Host:
    return another()


def in_blocks(host: Host, count: int, sizes: tuple[int, ...]) -> Floats:
    """Plays `count` frames in blocks of these sizes, in turn."""
    parts = ((begin, min(size, count - begin)) for begin, size in blocks(count, sizes))
    return np.concatenate([host.play(size, size) for _, size in parts])


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


def test_a_loop_begins_again_at_its_frame(another: Callable[[], Host]) -> None:
    """Every turn sends the same messages at the same places, in blocks of any length."""
    heard = []
    for sizes in ((256,), (999, 1), (20_000,)):
        host = another()
        host.give(TUNE, round(0.5 * RATE))
        host.roll(loops=True)
        heard.append(in_blocks(host, 2 * RATE, sizes))
        assert host.rolls() and not host.may_sleep()
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


def test_the_hosts_own_notes_play_beside_it_and_stay(another: Callable[[], Host]) -> None:
    """A song that stops, or is replaced, ends its own notes alone."""
    levels = []
    for given in (None, score_of([(0.0, 3.0, 28, 100)], RATE)):
        host = another()
        if given:
            host.give(given)
            host.roll()
        host.note(True, 43)
        host.play(RATE // 4)
        host.roll(False)
        host.play(RATE)
        levels.append(np.abs(host.play(2048)).max())
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


# --- files ---


def write(path: Path, *tracks: tuple[str, list[mido.Message | mido.MetaMessage]]) -> Path:
    """Writes a MIDI file of named tracks at 120 quarter notes a minute, 480 ticks each."""
    named = ([mido.MetaMessage("track_name", name=name), *events] for name, events in tracks)
    path.write_bytes(midi_file(*named))
    return path


def bass_and_drums(folder: Path, *keys: int) -> Path:
    """A file with a track called Bass, and drums."""
    return write(folder / "A song.mid", ("Drums", notes_of([36, 38, 42], channel=9)), ("Bass", notes_of([*keys])))


def wanted(path: Path, rate: int = RATE, preset: str = PRESETS[0]) -> Floats:
    """What `livebass render` plays of a file, up to the end of the last note."""
    score = with_low_notes(read_score(path, rate).on_one_bass(), load_preset(preset))
    return mono(preset, score)[: max(score.end_frame, score.file_end)]


def test_a_dropped_file_plays_as_rendered_and_tells_what_it_plays(host: Host, tmp_path: Path) -> None:
    file = bass_and_drums(tmp_path, 28, 31, 33, 26)
    assert host.drop(file) is None
    view = host.song()
    assert (view.there, view.rolls, view.loops, view.wrong) == (1, 1, 0, 0)
    assert view.text == (
        "A song.mid: plays track 2 called Bass, 4 notes; left out 1 other part; "
        'no channel has a bass program, 33 to 40: plays the track called "Bass"'
    )
    sound = wanted(file)
    assert np.abs(sound).max() > 0.01 and np.array_equal(host.play(len(sound)), sound)
    host.play(64)
    assert not host.rolls() and host.song().part == 0


def test_a_take_plays_as_recorded(host: Host, tmp_path: Path) -> None:
    """Every message stays, in its order: overlapping notes of one key, controllers behind notes, key switches."""
    sent = [
        (0x90, 12, 9, 0), (0x90, 40, 100, 0), (0xB0, 5, 0, 0), (0xB0, 5, 90, 30), (0x90, 40, 60, 90), (0x80, 40, 0, 90),
        (0x80, 12, 0, 0), (0xE0, 0, 80, 60), (0x90, 45, 127, 0), (0x80, 45, 0, 99),
    ]  # fmt: skip
    events = [mido.Message.from_bytes(message, time=time) for *message, time in sent]
    file = write(tmp_path / "take.mid", ("", [mido.MetaMessage("text", text=TAKE), *events]))
    assert host.drop(file) is None
    assert host.song().text == "take.mid: plays a take of livebass, 4 notes"
    sound = wanted(file)
    assert np.array_equal(host.play(len(sound)), sound)


def test_files_that_cannot_play_are_told_of_in_a_line(host: Host, tmp_path: Path) -> None:
    """The last good file plays on."""
    file = bass_and_drums(tmp_path, *[28] * 40)
    (tmp_path / "empty.mid").write_bytes(b"")
    (tmp_path / "notes.txt").write_text("no music")
    (tmp_path / "cut.mid").write_bytes(file.read_bytes()[:-20])
    with (tmp_path / "large.mid").open("wb") as large:
        large.truncate((64 << 20) + (1 << 20))
    write(tmp_path / "drums.mid", ("Drums", notes_of([36, 38], channel=9)))
    faults = {
        "empty.mid": "the file is empty (0 bytes)",
        "notes.txt": "not a Standard MIDI File (it does not begin with MThd)",
        "large.mid": "has 65 MB, more than 64 MB",
        "drums.mid": "no bass notes: no channel has a bass program, 33 to 40, and no track is called bass",
        "none.mid": "cannot be read",
    }
    for name, why in faults.items():
        assert host.drop(tmp_path / name) == f"{name}: {why}"[:190]
        view = host.song()
        assert (view.there, view.wrong, view.text) == (0, 1, f"{name}: {why}")
    assert "the file is truncated or damaged" in (host.drop(tmp_path / "cut.mid") or "")
    assert host.drop(file) is None
    host.play(1000)
    assert host.drop(tmp_path / "empty.mid")
    view = host.song()
    assert view.there and view.rolls and view.wrong and "empty" in view.text
    host.steer(PUT_AWAY)
    assert host.rolls() and host.song().text.startswith("A song.mid: plays") and not host.song().wrong
    host.steer(PUT_AWAY)
    view = host.song()
    assert not view.there and not view.rolls and not view.text
    host.play(2 * RATE)
    assert np.abs(host.play(256)).max() < 1e-3


def test_buttons_loop_stop_and_start_again(host: Host, tmp_path: Path) -> None:
    file = bass_and_drums(tmp_path, 28, 31)
    host.drop(file)
    host.steer(LOOP)
    host.play(2 * RATE)
    assert host.rolls() and host.song().loops
    host.steer(ROLL)
    host.play(64)
    assert not host.rolls() and host.song().part == 0
    host.steer(LOOP)
    host.steer(ROLL)
    host.play(RATE)
    assert not host.rolls()


def test_at_another_rate_it_is_read_again(host: Host, tmp_path: Path) -> None:
    file = bass_and_drums(tmp_path, 28, 31, 33)
    host.drop(file)
    host.play(1000)
    host.restart(44100)
    assert not host.rolls()
    host.steer(ROLL)
    sound = wanted(file, 44100)
    assert np.array_equal(host.play(len(sound)), sound)


def test_low_keys_are_those_of_the_bass_that_plays(another: Callable[[], Host], tmp_path: Path) -> None:
    """On another bass the file is fitted again, and goes on where it was."""
    file = bass_and_drums(tmp_path, 20, 33, 21, 35)
    host = another()
    host.drop(file)
    assert "moved up by octaves" in host.song().text
    sound = wanted(file)
    assert np.array_equal(host.play(len(sound)), sound)
    host = another()
    host.drop(bass_and_drums(tmp_path, *[33] * 8))
    host.play(RATE)
    host.set("bass", 1)
    for _ in range(40):
        host.play(256)
    part = host.song().part
    assert host.rolls() and 400 < part < 700
    host.play(2 * RATE)
    assert not host.rolls()


def test_the_state_does_not_keep_it(host: Host, tmp_path: Path) -> None:
    before = host.save()
    host.drop(bass_and_drums(tmp_path, 28, 31))
    host.play(1000)
    assert host.save() == before


@pytest.mark.parametrize("size", [(900, 460), (640, 320), (1300, 800)])
def test_its_bar_lies_in_the_picture(host: Host, tmp_path: Path, size: tuple[int, int]) -> None:
    """It comes with the file, has two buttons and a cross, and goes with the file."""
    with_bar = Picture(host, size, optional=("song", "steer", "drop"))
    with_bar.draw()
    bare = with_bar.pixels.copy()
    host.drop(bass_and_drums(tmp_path, *[28] * 30))
    with_bar.draw()
    assert (with_bar.pixels != bare).any()
    rolling = with_bar.pixels[74:98].copy()
    with_bar.press(38, 84)
    assert not host.rolls() and (with_bar.pixels[74:98] != rolling).any()
    with_bar.press(90, 84)
    assert host.song().loops
    with_bar.press(size[0] - 24, 84)
    assert not host.song().there
