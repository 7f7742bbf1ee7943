"""The stage: what the native callback plays, called by its C pointer; no sound card is needed."""

from __future__ import annotations

import ctypes
import dataclasses
import threading
import time
from collections.abc import Callable

import numpy as np
import pytest
from support.live import CLOCK, QUICK, RATE, Player, offline, run_ahead, staged

from livebass import QUALITIES, demo_score, load_preset
from livebass import compiling as kernels
from livebass.kernels import board
from livebass.live.stage import LiveBass, Stage
from livebass.live.thread import block as relief
from livebass.live.thread import callbacks


@pytest.mark.parametrize("ahead", ["never", "as time allows", "far"])
@pytest.mark.parametrize("sizes", [[64], [1, 500, 33], [4096]])
def test_a_score_sounds_as_rendered_bit_for_bit(sizes: list[int], ahead: str) -> None:
    score = demo_score(RATE, "slap")
    stage, player = staged(shelter=False)
    run_ahead(stage, ahead)
    blocks, fed = [], 0
    while stage.record["frame"][0] < 3 * RATE:
        fed = stage.feed(score, fed, 0)
        blocks.append(player.block(sizes[len(blocks) % len(sizes)]))
    heard = np.concatenate(blocks)[: 3 * RATE]
    messages = [(int(f), *map(int, m)) for f, m in zip(score.frames, score.messages, strict=True)]
    assert np.array_equal(heard, offline("slap", messages, 3 * RATE))
    assert np.abs(heard).max() > 0.1


@pytest.mark.parametrize("angle", [0.0, 0.7])
@pytest.mark.parametrize("preset", ["slap", "jazz-finger", "paper-bass", "fretless"])
def test_strings_that_ran_ahead_come_back_for_what_they_did_not_know(preset: str, angle: float) -> None:
    """Dense notes, bends, pedal and volume, each told in the block it falls into, into strings that are far ahead."""
    rng = np.random.default_rng(5)
    frames, total = np.sort(rng.integers(0, RATE, 160)), RATE + 5000
    messages = []
    for frame in frames.tolist():
        kind = int(rng.integers(0, 12))
        key, value = int(rng.integers(28, 60)), int(rng.integers(1, 128))
        choices = {0: (0xE0, 0, value), 1: (0xB0, 7, 64 + value // 2), 2: (0xB0, 64, value), 3: (0xB0, 120, 0)}
        messages.append((frame, *choices.get(kind, (0x80 if kind < 6 else 0x90, key, value))))
    bass = load_preset(preset)
    bass = dataclasses.replace(bass, player=dataclasses.replace(bass.player, pluck_angle=angle))
    stage = Stage(RATE, shelter=False)
    stage.put_on(LiveBass(bass, QUICK, RATE))
    player = Player(stage)
    run_ahead(stage, "far")
    blocks, done, sent, lead = [], 0, 0, 0
    while done < total:
        n = min(int(rng.choice([1, 17, 64, 129])), total - done)
        while sent < len(messages) and messages[sent][0] < done + n:
            frame, *message = messages[sent]
            assert stage.send(*message, frame=frame)
            sent += 1
        blocks.append(player.block(n))
        done += n
        playing = stage.bass
        assert playing is not None
        lead = max(lead, *(int(v.record["frame"][0]) - done for v in playing.engine.voices))
    assert lead >= 700, "nothing ran ahead"
    heard = np.concatenate(blocks)
    assert np.array_equal(heard, offline(bass, messages, total))
    assert np.abs(heard).max() > 0.05


def test_messages_at_their_frames_and_now() -> None:
    stage, player = staged("jazz-finger", shelter=False)
    first = player.block(100)
    assert not first.any()
    stage.send(0x90, 40, 100)
    stage.send(0x90, 45, 90, frame=333)
    stage.send(0x80, 40, 0, frame=120)  # too late for its frame: as soon as possible, and in order
    heard = np.concatenate([player.block(64) for _ in range(60)])
    messages = [(100, 0x90, 40, 100), (333, 0x90, 45, 90), (333, 0x80, 40, 0)]
    assert np.array_equal(heard, offline("jazz-finger", messages, 100 + len(heard))[100:])


def test_two_channels_hear_the_same() -> None:
    stage, _ = staged(shelter=False)
    stage.send(0x90, 40, 100)
    both = Player(stage, channels=2).block(3000)
    assert np.array_equal(both[:, 0], both[:, 1])
    assert np.array_equal(both[:, 0], offline("slap", [(0, 0x90, 40, 100)], 3000))


def test_another_bass_comes_in_without_a_click() -> None:
    stage, player = staged("jazz-finger", shelter=False)
    stage.send(0x90, 40, 60)
    before = np.concatenate([player.block(64) for _ in range(200)])
    stage.put_on(LiveBass(load_preset("flatwound"), QUICK, RATE))
    after = np.concatenate([player.block(64) for _ in range(100)])
    steps = np.abs(np.diff(np.concatenate([before[-3000:], after]), 2))
    assert steps[2990:].max() < 2 * steps[:2990].max()
    assert not np.any(after[3000:])
    stage.clear_away()
    assert len(stage._basses) == 1
    stage.send(0x90, 40, 60)
    sound = np.concatenate([player.block(64) for _ in range(100)])
    assert np.abs(sound).max() > 0.005


def test_many_basses_one_after_the_other() -> None:
    stage, player = staged("jazz-finger")
    basses = [LiveBass(load_preset(name), QUICK, RATE) for name in ("slap", "muted", "flatwound")]
    done = threading.Event()

    def swap() -> None:
        for bass in basses:
            stage.put_on(bass)
        done.set()

    threading.Thread(target=swap, daemon=True).start()
    end = time.monotonic() + 20
    while not done.is_set() and time.monotonic() < end:
        stage.send(0x90, 40, 90)
        player.block(256)
    assert done.is_set()
    for _ in range(40):  # the last one may still wait for the one before to fade out
        player.block(256)
        stage.clear_away()
    assert stage._basses == basses[-1:]


def test_program_changes_and_banks_are_noted() -> None:
    stage, player = staged()
    for message in ((0xB0, 0, 1), (0xB0, 32, 2), (0xC0, 5)):
        stage.send(*message)
    player.block(64)
    assert stage.record["program"][0] == (1 << 7 | 2) << 8 | 5
    assert stage.record["program_count"][0] == 1


def test_one_channel_only() -> None:
    stage, player = staged(channel=2)
    stage.receive(0x90, 40, 100)
    assert not player.block(2000).any()
    stage.receive(0x92, 40, 100)
    assert player.block(2000).any()


def test_scores_and_keys_are_heard_whatever_the_channel() -> None:
    stage, player = staged(channel=2)
    stage.send(0x90, 40, 100)
    assert player.block(2000).any()


def test_what_comes_after_a_stall_is_not_late_by_it() -> None:
    stage, player = staged()
    for _ in range(10):
        player.block(64)
    time.sleep(0.5)
    assert stage.frame_now(64) <= int(stage.record["frame"][0]) + 2 * 64
    stage.send(0x90, 40, 120, stage.frame_now(64))
    assert np.concatenate([player.block(64) for _ in range(20)]).any()


@pytest.mark.parametrize("size", [1, 64, 1000, 3000])
def test_a_bass_fades_out_at_the_same_frames_in_any_blocks(size: int) -> None:
    """From the frame on at which the next one comes in, which is the start of a block."""
    sounds = []
    for n in (240, size):
        stage, player = staged("jazz-finger", shelter=False)
        stage.send(0x90, 40, 120)
        player.block(6000)
        stage.put_on(LiveBass(load_preset("slap"), QUICK, RATE))
        sounds.append(np.concatenate([player.block(n) for _ in range(-(-3000 // n))])[:3000])
    assert np.abs(sounds[0][:1000]).max() > 0.01
    assert np.array_equal(*sounds)
    assert not sounds[0][1440:].any()


def test_panic_ends_everything() -> None:
    stage, player = staged()
    for key in (28, 33, 38, 43):
        stage.send(0x90, key, 120)
    assert player.block(4000).any()
    stage.panic()
    player.block(RATE)
    assert not player.block(RATE).any()


def test_recording_is_what_was_heard() -> None:
    stage, player = staged()
    stage.start_recording()
    stage.send(0x90, 40, 110)
    heard, kept = [], []
    for k in range(400):
        heard.append(player.block(97))
        if k % 50 == 0:
            kept.append(stage.recorded())
    kept.append(stage.recorded())
    assert np.array_equal(np.concatenate(kept), np.concatenate(heard))
    assert stage.meters().lost == 0


def test_a_recorder_that_sleeps_loses_sound_and_counts_it() -> None:
    stage, player = staged()
    stage.start_recording()
    size = int(stage.record["record_size"][0])
    for _ in range(size // 4096 + 2):
        player.block(4096)
    assert stage.meters().lost == (size // 4096 + 2) * 4096 - size
    assert len(stage.recorded()) == size


def test_overload_coarsens_strings_and_calm_brings_them_back() -> None:
    """The clock tells of time that never passed: each block takes as long as is said."""
    stage, player = staged("jazz-finger", QUALITIES["live"])
    bass = stage.bass
    assert bass is not None
    spans = [0.0]
    now = [0]

    def clock(_kind: int, spec: ctypes.POINTER(ctypes.c_int64)) -> int:  # type: ignore[valid-type]
        now[0] += int(spans[0])
        spec[0], spec[1] = now[0] // 10**9, now[0] % 10**9 + 1  # type: ignore[index]
        return 0

    keep: Callable[..., int] = CLOCK(clock)
    stage.record["clock"] = ctypes.cast(keep, ctypes.c_void_p).value  # type: ignore[arg-type]
    for key in (28, 33, 38, 43):
        stage.send(0x90, key, 127)
    player.block(2400)
    spans[0] = 0.9 * 64 / RATE * 1e9
    before = np.concatenate([player.block(64) for _ in range(1)])
    assert bin(bass.record["coarse"][0]).count("1") == 1 and stage.meters().overload == 1
    assert bass.record["coarse"][0] == 0b1000, "the newest contact first"
    sound = np.concatenate([before, *[player.block(64) for _ in range(3)]])
    assert bass.record["coarse"][0] == 0b1111
    assert np.isfinite(sound).all() and np.abs(sound).max() > 0.05
    assert np.abs(np.diff(sound)).max() < 0.2, "no jump"
    spans[0] = 0.1 * 64 / RATE * 1e9
    for _ in range(4 * RATE // 64):
        player.block(64)
    assert bass.record["coarse"][0] == 0 and stage.meters().overload == 0
    del keep


def test_coarse_strings_go_on_in_tune() -> None:
    """Exchanged in the middle of a note, and back: the same motion, but for what contacts make of it."""
    quality = QUALITIES["live"]
    sounds = []
    for exchanged in (False, True):
        stage, player = staged("jazz-finger", quality, shelter=False)
        bass = stage.bass
        assert bass is not None
        stage.send(0x90, 40, 50)
        blocks = [player.block(4800)]
        for which in (1, 0):
            if exchanged:
                relief.exchange(bass.record[0], 2, which, stage.record["frame"][0])
            blocks.append(player.block(4800))
        sounds.append(np.concatenate(blocks))
    plain, changed = sounds
    assert np.array_equal(plain[:4800], changed[:4800])
    assert np.abs(plain - changed).max() < 0.03 * np.abs(plain).max()


@pytest.mark.parametrize("preset", ["slap", "fretless"])
def test_changing_operators_in_the_midst_of_contact_is_no_blow(preset: str) -> None:
    """To and fro within the first set of contacts: what fills up a block of modes stays at rest."""
    stage, player = staged(preset, QUALITIES["live"], shelter=False)
    run_ahead(stage, "never")
    bass = stage.bass
    assert bass is not None
    string = bass.engine.strings - 1
    stage.send(0x90, bass.engine.instrument.strings[-1].open_note + 7, 127)
    player.block(544)
    for k in range(50):
        relief.exchange(bass.record[0], string, 1 - k % 2, stage.record["frame"][0])
        player.block(5 + 8 * (k % 5))
    voice, op = bass.engine.voices[string], bass.engine.pool.records[string, 7]
    rest = np.stack([voice.work[name][:, op["modes"] : op["padded"]] for name in ("q", "p")])
    assert op["modes"] < op["padded"] and not rest.any()
    meters = stage.meters()
    assert meters.faults == 0 and 0.01 < meters.peak < 0.9


def test_wild_messages_leave_sound_that_is_finite() -> None:
    stage, player = staged("slap")
    rng = np.random.default_rng(1)
    for _ in range(300):
        for _ in range(int(rng.integers(0, 40))):
            stage.send(*(int(x) for x in rng.integers(0, 256, 3)))
        sound = player.block(int(rng.integers(1, 300)))
        assert np.isfinite(sound).all() and np.abs(sound).max() <= 1
    stage.panic()
    player.block(RATE)
    assert not player.block(RATE).any()
    assert stage.meters().faults == 0


def test_denormal_numbers_stay_what_they_were_outside() -> None:
    _, player = staged()
    player.block(64)
    assert 5e-324 * 1.0 > 0.0 and float(np.float64(2e-308) / 4) > 0.0


def test_a_full_ring_refuses() -> None:
    stage = Stage(RATE)
    sent = sum(stage.send(0x90, 40, 100) for _ in range(5000))
    assert sent == 4096


def test_kernels_of_the_audio_thread_cannot_allocate() -> None:
    """No function of numba's that asks for memory is in there."""
    staged()
    callbacks.jack()
    board.player()
    names = "block.block", "ahead.player", "frets.player", "board.player", "callbacks.portaudio", "callbacks.jack"
    for name in names:
        files = list(kernels.DIRECTORY.rglob(f"{name}-*.nbc"))
        assert files, name
        for file in files:
            code = file.read_bytes()
            for word in (b"NRT_Allocate", b"NRT_MemInfo_alloc", b"NRT_Reallocate"):
                assert word not in code, f"{file.name}: {word.decode()}"
