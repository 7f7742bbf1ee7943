"""A take sounds as heard: live playing, recorded as MIDI, read and rendered, to the last bit.

Covers all channel modes, keys struck again before their note-off, release velocities and changes of bass.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import mido
import numpy as np
import pytest
from support.costs import quick, slow
from support.live import RATE, performer_of, run_ahead
from support.messages import messages_of
from support.tabs import hard_score

from livebass import Quality, load_preset, read_score, render_to_array
from livebass.cli.hands import SOUND, Loader
from livebass.cli.render import render
from livebass.cli.score_bass import basses_of
from livebass.cli.take_bass import load_take_basses
from livebass.engine.engine import scaled
from livebass.engine.render import mix_strings, single
from livebass.kernels.player.words import STATUS, Row
from livebass.kernels.score.memory import PROGRAM
from livebass.live.fake import FakeDevice
from livebass.live.parameters import NUMBERS
from livebass.live.recording import Given, MidiRecorder
from livebass.live.synth import LiveBass, Synth
from livebass.model.instrument import Instrument
from livebass.preset.load import kept_text
from livebass.preset.revisions import with_revision
from livebass.rows.arrays import Floats
from livebass.rows.techniques import LEARNED
from livebass.score.reading import TAKE
from livebass.score.score import Score

LIGHT = Quality("light", 60, 192e3)
Message = Row  # of MIDI, or of a tablature
MODES: dict[str, list[tuple[int, int, int]]] = {
    "alike": [(0xB0, 127, 0)],
    "a string each": [(0xB0, 126, 4)],
    "more channels than strings": [(0xB0, 126, 6)],
    "a note each": [(0xB0, 101, 0), (0xB0, 100, 6), (0xB0, 6, 5)],
    "a note each, from the top": [(0xBF, 101, 0), (0xBF, 100, 6), (0xBF, 6, 15)],
}


def live(
    path: Path, messages: Sequence[Message], frames: int, size: int = 256, changes: Sequence[tuple[int, str]] = (),
    first: str = "jazz-finger", load: Callable[[str], Instrument] = load_preset, given: Given = lambda preset: {},
) -> tuple[Floats, Synth]:  # fmt: skip
    """Plays messages live for `frames` frames and records them as a MIDI file at `path`; returns the sound.

    It begins with the preset `first`. `changes` are (frame, preset): the first block from that frame on begins with
    that bass. `load` loads them, with the options `given`.
    """
    synth = Synth(RATE, adaptive=False)
    run_ahead(synth, "never")
    synth.switch_to(LiveBass(load(first), LIGHT, RATE))
    device, heard, coming = FakeDevice(synth), [], list(changes)
    with MidiRecorder(path, synth, first, given) as take:
        for frame, status, first, second in messages:
            if status < STATUS:
                assert synth.set_value(status, first, second, frame)
            else:
                assert synth.send(status, first, second, frame)
        while synth.frame < frames:
            synth.release_faded()
            if coming and coming[0][0] <= synth.frame:
                bass = LiveBass(load(coming[0][1]), LIGHT, RATE)
                synth.switch_to(bass)
                take.choose(coming.pop(0)[1], bass)
            heard.append(device.block(min(size, frames - synth.frame)))
            take.turn()
    return np.concatenate(heard), synth


def rendered(score: Score, frames: int) -> Floats:
    """The sound of `livebass render`, cut at full scale like the synth's."""
    tail = max(frames - score.end_frame, 0) / RATE + 0.1
    score, load = load_take_basses(score, Loader(dict.fromkeys(SOUND)), "jazz-finger", render)
    first, basses = basses_of(score, "jazz-finger", load)
    sound = render_to_array(first, score, LIGHT, tail=tail, basses=basses)
    return np.clip(mix_strings(single(sound)), -1.0, 1.0)[:frames]


def performance(rng: np.random.Generator, mode: str, frames: int, count: int) -> list[Message]:
    """Random playing in a channel mode: keys struck again, offs of all velocities, bends, pressure, places."""
    messages: list[Message] = [(0, *message) for message in MODES[mode]]
    messages.append((0, 0xB0, 68, 127 * int(rng.integers(0, 2))))
    keys = rng.integers(28, 62, 6).tolist()  # few, to be struck again
    for frame in np.sort(rng.integers(0, frames, count)).tolist():
        channel, key, value = int(rng.integers(0, 7)), int(rng.choice(keys)), int(rng.integers(0, 128))
        if mode.endswith("top"):
            channel += 9
        kinds: list[tuple[int, int, int]] = [
            *[(0x90 | channel, key, max(value, 1))] * 5,
            *[(0x80 | channel, key, value)] * 4,
            (0x90 | channel, key, 0),
            (0xE0 | channel, int(rng.integers(0, 128)), value),
            (0xD0 | channel, value, 0),
            (0xB0 | channel, int(rng.choice([1, 9, 64, 64, 65, 68, 74, 74])), value),
            (0xB0 | channel, int(rng.choice([7, 11])), 64 | value),
            (0xB0 | channel, int(rng.choice([120, 121, 123])), 0),
            (int(rng.choice([0x80, 0x90])) | channel, int(rng.choice([2, 3, 10, 12, 16, 17])), 100),
        ]
        if mode == "alike":  # ranges and tunings; elsewhere they would change the mode
            kinds += [(0xB0 | channel, number, x) for number, x in ((101, 0), (100, int(rng.integers(0, 3))))]
            kinds += [(0xB0 | channel, number, int(rng.integers(60, 69))) for number in (6, 38)]
        messages.append((frame, *kinds[int(rng.integers(0, len(kinds)))]))
    return messages


def test_a_take_of_a_tablature_sounds_as_it_was_heard(tmp_path: Path) -> None:
    score = hard_score(tmp_path)
    sound, _ = live(tmp_path / "take.mid", score.strokes, score.end_frame + 1)
    assert np.abs(sound).max() > 0.05
    assert np.array_equal(sound, rendered(score, len(sound)))
    again = read_score(tmp_path / "take.mid", RATE)
    assert again.strokes == score.strokes and again.notes == score.notes and not again.remarks
    assert np.array_equal(sound, rendered(again, len(sound)))


def test_a_take_of_a_tablature_has_the_keys_that_were_played_to_it(tmp_path: Path) -> None:
    score = hard_score(tmp_path)
    keys = [(300, 0x90, 43, 90), (400, 0xB0, 7, 80), (20_000, 0x80, 43, 64), (21_000, 0xE0, 0, 90)]
    played = sorted([*score.strokes, *keys], key=lambda row: row[0])
    sound, _ = live(tmp_path / "take.mid", played, score.end_frame + 1)
    again = read_score(tmp_path / "take.mid", RATE)
    assert again.strokes == score.strokes and len(again.messages) == len(keys)
    assert np.array_equal(sound, rendered(again, len(sound)))


@pytest.mark.parametrize("mode", MODES)
def test_a_take_of_anything_sounds_as_it_was_heard(mode: str, tmp_path: Path) -> None:
    rng = np.random.default_rng([11, *map(ord, mode)])
    messages = performance(rng, mode, RATE, 150)
    sound, synth = live(tmp_path / "take.mid", messages, RATE)
    score = read_score(tmp_path / "take.mid", RATE)
    kept = messages_of(score)
    zeroed = [(f, s & 0x8F, k, 64) if s & 0xF0 == 0x90 and not v else (f, s, k, v) for f, s, k, v in messages]
    assert kept[: len(messages)] == zeroed and {m[1] & 0xE0 for m in kept[len(messages) :]} <= {0x80}
    assert np.abs(sound).max() > 0.05
    assert np.array_equal(sound, rendered(score, len(sound)))
    assert synth.dropped > 0 or mode != "more channels than strings"


def test_a_take_through_all_modes_sounds_as_it_was_heard(tmp_path: Path) -> None:
    """The mode changes in the middle, during notes."""
    rng, messages = np.random.default_rng(5), list[Message]()
    for k, mode in enumerate([*MODES, "alike"]):
        part = performance(rng, mode, 9000, 40)
        messages += [(frame + 9000 * k, *message) for frame, *message in part]  # type: ignore[misc]
    sound, _ = live(tmp_path / "take.mid", messages, 58000, 999)
    assert np.array_equal(sound, rendered(read_score(tmp_path / "take.mid", RATE), len(sound)))


def pitch_of(sound: Floats, minimum: float, maximum: float) -> float:
    """The loudest frequency between `minimum` and `maximum` (Hz)."""
    size = 1 << 19
    spectrum = np.abs(np.fft.rfft(sound * np.hanning(len(sound)), size))
    near = slice(round(minimum * size / RATE), round(maximum * size / RATE))
    return (near.start + int(np.argmax(spectrum[near]))) * RATE / size


@pytest.mark.parametrize("mode", ["a string each", "a note each"])
def test_strings_bend_apart_in_a_take(mode: str, tmp_path: Path) -> None:
    """G2 rises by 2 semitones through its channel's wheel; E1 stays."""
    low, high = (0x93, 0x90) if mode == "a string each" else (0x92, 0x91)
    wheel = 8192 + round(8191 * 2 / (12 if mode == "a string each" else 48))
    messages = [(0, *message) for message in MODES[mode]]
    messages += [(10, low, 28, 80), (10, high, 43, 80), (4800, 0xE0 | high & 0x0F, wheel & 127, wheel >> 7)]
    sound, _ = live(tmp_path / "take.mid", messages, RATE)
    assert pitch_of(sound[12000:], 105, 115) == pytest.approx(110.0, rel=0.005)
    assert pitch_of(sound[12000:], 38, 44) == pytest.approx(41.2, rel=0.005)
    assert np.array_equal(sound, rendered(read_score(tmp_path / "take.mid", RATE), len(sound)))


@pytest.mark.parametrize("mode", quick(["alike", "a string each", "a note each"], ["alike", "a note each"]))
def test_a_take_with_other_basses_sounds_as_it_was_heard(mode: str, tmp_path: Path) -> None:
    """To the bit where one bass sounds; while another rings out, up to the rounding of the sum.

    Controllers pass to the new bass, amid bends, with volume, pedal, tone, blend, vibrato and palm.
    """
    rng = np.random.default_rng([3, *map(ord, mode)])
    messages = performance(rng, mode, 70_000, 180)
    moved = [*((0xB0, *move) for move in ((17, 30), (18, 90), (7, 100), (9, 30), (1, 70), (64, 127))), (0xE0, 9, 80)]
    messages = sorted([*messages, *((18_000, *message) for message in moved)], key=lambda m: m[0])
    messages += [(72_000, 0xB0 | c, 120, 0) for c in range(16)]  # all sound off: the old bass has ended
    messages += [(72_000 + 2_000 * k, *m[1:]) for k, m in enumerate(performance(rng, "alike", 1, 20)[2:])]
    changes = [(20_000, "slap"), (100_000, "fretless")]
    sound, _ = live(tmp_path / "take.mid", messages, 120_000, 256, changes)
    score = read_score(tmp_path / "take.mid", RATE)
    assert score.changes == [(20_224, 36), (100_096, 35)] and score.program == 33
    assert [(b.frame, b.preset) for b in score.basses] == [
        (0, with_revision("jazz-finger")),
        (20_224, with_revision("slap")),
        (100_096, with_revision("fretless")),
    ]
    again = rendered(score, len(sound))
    assert np.array_equal(sound[:20_224], again[:20_224])
    assert np.allclose(sound, again, rtol=0, atol=3e-7)
    assert np.array_equal(sound[97_000:100_096], again[97_000:100_096])
    for k, (begin, end) in enumerate(((20_224, 72_000), (100_096, 120_000))):
        kept = offline_alone(score, begin)
        assert np.abs(sound[begin:end] - kept[begin:end]).max() > 1e-3, (k, "another bass is heard")


def test_a_take_keeps_the_files_of_its_presets(tmp_path: Path) -> None:
    """As they were when they were chosen."""
    file = tmp_path / "mine.toml"
    file.write_text('like = "slap"\n[neck]\nrelief = "0.5 mm"\n')
    text = kept_text(str(file))
    live(tmp_path / "take.mid", [(100, 0x90, 40, 100)], 4000, 256, [(1000, str(file))])
    file.write_text('like = "slap"\n')
    kept = [(bass.preset, bass.file) for bass in read_score(tmp_path / "take.mid", RATE).basses]
    assert kept == [(with_revision("jazz-finger"), ""), (str(file), text)] and kept_text(str(file)) != text


def offline_alone(score: Score, frame: int) -> Floats:
    """The score without the program change at `frame`."""
    kept = (score.frames != frame) | (score.messages[:, 0] & 0xF0 != PROGRAM)
    return rendered(replace(score, frames=score.frames[kept], messages=score.messages[kept]), 120_000)


def file_of(path: Path, messages: Sequence[tuple[int, bytes]], *texts: str) -> Score:
    """Writes messages (ms, bytes) as a MIDI file of one track, with texts at its beginning, and reads it."""
    track, last = mido.MidiTrack([mido.MetaMessage("text", text=text) for text in texts]), 0
    for at, data in messages:
        track.append(mido.Message.from_bytes(data, time=at - last))
        last = at
    mido.MidiFile(type=0, ticks_per_beat=500, tracks=[track]).save(path)
    return read_score(path, RATE)


def rows(score: Score) -> list[tuple[int, ...]]:
    return [(frame * 1000 // RATE, *message) for frame, *message in messages_of(score)]


def test_a_pull_off_is_as_hard_as_its_release_velocity(tmp_path: Path) -> None:
    sounds = []
    for velocity in (0, 20, 64, 127):
        strokes = [(0, b"\xc0\x21"), (0, b"\xb0\x44\x7f"), (0, b"\x90\x21\x01"), (100, b"\x90\x23\x01")]
        score = file_of(tmp_path / "a.mid", [*strokes, (300, bytes([0x80, 35, velocity])), (600, b"\x80\x21\x40")])
        sounds.append(rendered(score, RATE // 2))
    apart = [float(np.abs(sound - sounds[0]).max()) for sound in sounds]
    assert 0.0 == apart[0] < apart[1] < apart[2] < apart[3] and apart[1] > 1e-4, apart


def test_a_take_is_left_as_it_is_and_other_files_are_paired(tmp_path: Path) -> None:
    """Live, the first note-off ends a key struck twice; in a written file, each note-on has its own."""
    strokes = [
        (0, b"\xc2\x21"),
        (0, b"\x92\x21\x50"),
        (100, b"\x92\x21\x51"),
        (200, b"\x82\x21\x11"),
        (300, b"\x82\x21\x12"),
    ]
    strokes += [(300, b"\xb2\x07\x40"), (400, b"\x92\x22\x50"), (400, b"\x82\x22\x13"), (500, b"\x92\x23\x50")]
    take = file_of(tmp_path / "take.mid", strokes, TAKE)
    assert rows(take) == [(at, *data, *[0] * (3 - len(data))) for at, data in strokes[1:]] + [(500, 0x82, 0x23, 64)]
    other = file_of(tmp_path / "other.mid", strokes, "as played by somebody")
    assert rows(other) == [
        (0, 0x92, 33, 80), (100, 0x92, 33, 81), (300, 0xB2, 7, 64), (300, 0x82, 33, 18), (400, 0x92, 34, 80),
        (401, 0x82, 34, 19), (500, 0x92, 35, 80), (501, 0x82, 35, 64),
    ]  # fmt: skip
    assert take.program == other.program == 33


def test_what_is_too_soft_for_normal_numbers_is_silence() -> None:
    """As on the audio thread, which flushes denormals to zero: a tail must not differ there."""
    soft = np.array([1e-39, -1e-40, 2e-38, 0.5, 0.0])
    assert single(soft).tolist() == [0.0, 0.0, np.float32(2e-38), 0.5, 0.0]
    assert np.isnan(single(np.array([np.nan]))).all()
    strings = single(np.array([[2.5e-38, 2.5e-38, 0.5], [-2.4e-38, 2.5e-38, 0.25]]))
    assert mix_strings(strings).tolist() == [0.0, np.float32(5e-38), 0.75]


@pytest.mark.parametrize("wrong", [None, np.nan, np.inf, -np.inf])
def test_a_block_of_a_file_is_scaled_and_checked_at_once(wrong: float | None) -> None:
    sound = np.random.default_rng(3).standard_normal((3, 77))
    sound[0, :2] = 1e-38, 1.7e308
    if wrong is not None:
        sound[2, 70] = wrong
    made, finite = scaled(sound, 0.7)
    with np.errstate(over="ignore"):
        np.testing.assert_array_equal(made, single(sound * 0.7))
    assert made.dtype == np.float32 and made[0, 0] == 0.0 and finite == (wrong is None)


@pytest.mark.parametrize("seed", quick(range(100), range(4)))
def test_a_take_has_every_bit_of_its_render(seed: int, tmp_path: Path) -> None:
    """Hands that end one string's sound end the floor that lies under all, and the softest sample is silent in both."""
    mode = list(MODES)[seed % len(MODES)]
    messages = performance(np.random.default_rng([seed, *map(ord, mode)]), mode, RATE // 2, 60)
    sound, _ = live(tmp_path / "take.mid", messages, 3 * RATE // 2)
    again = rendered(read_score(tmp_path / "take.mid", RATE), len(sound))
    assert sound.tobytes() == again.tobytes()


def test_parameters_that_controllers_move_go_over_to_another_bass(tmp_path: Path) -> None:
    """102 to 109, the controllers of learned ones in a take: live and in the take."""
    moved = [(LEARNED + NUMBERS[symbol], 15 + 11 * k) for k, symbol in enumerate(sorted(set(NUMBERS) - {"gain"}))]
    messages = [(1000 + 200 * k, 0xB3, *move) for k, move in enumerate(moved)]
    messages += [(8000 + 5000 * k, 0x93, 28 + 5 * (k % 4), 60 + 9 * k) for k in range(6)]
    sound, synth = live(tmp_path / "take.mid", messages, 42_000, 256, [(16_000, "slap")])
    assert np.allclose(sound, rendered(read_score(tmp_path / "take.mid", RATE), len(sound)), rtol=0, atol=3e-7)
    new, default = performer_of(synth), LiveBass(load_preset("slap"), LIGHT, RATE).engine.performer[0]
    for field in ("dynamics", "hand_damping", "unevenness", "placed", "ranged", "slapped", "tone"):
        assert new[field] != default[field], field


OWN = """
like = "fretless"
name = "Mine"
tuning = "half-step-down"
[[string]]
name = "E"
tension = "170 N"
"""
SET = {
    "tuning": "drop-d", "capo": "2", "a4": "432.0", "temperament": "just", "keys": "modo-12", "wheel": "slide",
    "velocity_curve": "1:1,64:90,127:127", "no_noise": "True",
}  # fmt: skip


@pytest.mark.parametrize(
    "basses", [("mine", "six-string"), slow(("flatwound", "jazz-finger")), ("short-scale", "mine")]
)
def test_a_take_of_basses_outside_general_midi_sounds_as_it_was_heard(tmp_path: Path, basses: tuple[str, str]) -> None:
    """A user's file and presets with as many strings or more; the first case plain, the others with options.

    Other software sees the same program for all of them, an electric bass.
    """
    mine = tmp_path / os.fsdecode(b"mine \xe9.toml")
    mine.write_text(OWN)
    first, second = (str(mine) if name == "mine" else name for name in basses)
    given, requested = {}, dict[str, Any]()
    if second != "six-string":
        given = SET
        requested = SET | {"velocity_curve": ((1.0, 1.0), (64.0, 90.0), (127.0, 127.0)), "capo": 2, "no_noise": True}
    load = Loader(dict.fromkeys(SOUND) | requested)
    messages: list[Message] = [(100 + 2500 * k, 0x90, 40 + k % 9, 50 + 5 * k) for k in range(9)]
    messages += [(4000, 0xB0, 16, 20), (9000, 0xE0, 3, 100)]
    change = [(12_000, second)]
    sound, _ = live(tmp_path / "take.mid", sorted(messages), 25_000, 256, change, first, load, lambda preset: given)
    score = read_score(tmp_path / "take.mid", RATE)
    assert [(bass.preset, bass.given) for bass in score.basses] == [
        (with_revision(first), given),
        (with_revision(second), given),
    ]
    again = rendered(score, len(sound))
    assert np.abs(sound).max() > 0.05 and np.array_equal(sound[:12_000], again[:12_000])
    assert np.allclose(sound, again, rtol=0, atol=3e-7)
    assert np.abs(sound - rendered(replace(score, basses=()), len(sound))).max() > 1e-3
    programs = [m.program for m in mido.MidiFile(tmp_path / "take.mid").tracks[0] if m.type == "program_change"]
    assert programs == [33, 33]
