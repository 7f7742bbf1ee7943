"""The synth on a fake device that calls the native callback by its C pointer; needs no sound card."""

from __future__ import annotations

import itertools
import threading
import time
from dataclasses import replace

import numpy as np
import pytest
from support.command import module_paths, python_output
from support.costs import quick
from support.hands import of_any
from support.jack import PATIENCE
from support.live import (
    QUICK,
    RATE,
    Load,
    bass_of,
    feed,
    offline,
    performer_of,
    play,
    played_ahead,
    run_ahead,
    synth_and_device,
)
from support.messages import messages_of
from support.played import FRETS_OUT, made_of
from support.quiet import without_noise
from support.scores import busy_score

from livebass import QUALITIES, demo_score, load_preset
from livebass.compiling import store
from livebass.compiling.library import library
from livebass.kernels.player.performer import FADE
from livebass.live.fake import FakeDevice
from livebass.live.synth import CAPTURE_SECONDS, LiveBass, Synth
from livebass.live.thread import block
from livebass.live.thread.load import FORGOTTEN, MAX_SHARE
from livebass.model.quality import quality_with


@pytest.mark.parametrize(
    ("sizes", "ahead"),
    quick(
        itertools.product([(64,), (1, 500, 33), (4096,)], ["never", "as time allows", "far"]),
        always=[((64,), "as time allows"), ((1, 500, 33), "far"), ((4096,), "never"), ((4096,), "far")],
    ),
)
def test_a_score_sounds_as_rendered_bit_for_bit(sizes: tuple[int, ...], ahead: str) -> None:
    score = demo_score(RATE, "slap")
    synth, device = synth_and_device(adaptive=False)
    run_ahead(synth, ahead)
    blocks, fed = [], 0
    while synth.frame < 2 * RATE:
        fed = feed(synth, score, fed)
        blocks.append(device.block(sizes[len(blocks) % len(sizes)]))
    heard = np.concatenate(blocks)[: 2 * RATE]
    assert np.array_equal(heard, offline("slap", messages_of(score), 2 * RATE))
    assert np.abs(heard).max() > 0.1


@pytest.mark.parametrize("preset", ["slap-impulse", "slap", "jazz-finger", "jazz-finger" + FRETS_OUT])
def test_techniques_sound_the_same_on_strings_that_ran_ahead(preset: str) -> None:
    """All the techniques' key switches and controllers, each sent in its own block; also where notes fret out."""
    messages, total, bass = messages_of(busy_score(RATE)), 2 * RATE, made_of(preset)
    assert np.array_equal(played_ahead(bass, messages, total), offline(bass, messages, total))


@pytest.mark.parametrize(
    ("preset", "angle"), [("slap", 0.0), ("slap", 0.7), ("jazz-finger", 0.7), ("paper-bass", 0.0), ("fretless", 0.7)]
)
def test_strings_that_ran_ahead_come_back_for_what_they_did_not_know(preset: str, angle: float) -> None:
    """Dense notes, bends, pedal and volume, each sent in its own block, to strings far ahead."""
    rng = np.random.default_rng(5)
    frames, total = np.sort(rng.integers(0, RATE, 160)), RATE + 5000
    messages = []
    for frame in frames.tolist():
        kind = int(rng.integers(0, 12))
        key, value = int(rng.integers(28, 60)), int(rng.integers(1, 128))
        choices = {0: (0xE0, 0, value), 1: (0xB0, 7, 64 + value // 2), 2: (0xB0, 64, value), 3: (0xB0, 120, 0)}
        messages.append((frame, *choices.get(kind, (0x80 if kind < 6 else 0x90, key, value))))
    bass = load_preset(preset)
    bass = replace(bass, player=replace(bass.player, pluck_angle=angle))
    heard = played_ahead(bass, messages, total, rng.choice([1, 17, 64, 129], 1000).tolist())
    assert np.array_equal(heard, offline(bass, messages, total))
    assert np.abs(heard).max() > 0.05


@pytest.mark.parametrize("preset", ["jazz-finger", "slap", "precision-pick"])
def test_strings_that_ran_ahead_take_back_what_had_begun_to_answer(preset: str) -> None:
    """Bends soon after notes whose answers begin at once, on strings that are far ahead."""
    bass = load_preset(preset)
    bass = replace(bass, player=replace(bass.player, answering="always"))
    messages = []
    for k, key in enumerate([33, 40, 45, 28, 50, 35]):
        on = 4000 * k + 7
        messages += [(on, 0x90, key, 100), *((on + 130 * n, 0xE0, 0, 64 + n) for n in range(1, 8))]
        messages += [(on + 3000, 0x80, key, 64)]
    heard = played_ahead(bass, messages, 26000)
    assert np.array_equal(heard, offline(bass, messages, 26000))


def test_a_very_loud_bass_is_cut_as_the_test_of_bits_cuts_it() -> None:
    bass = load_preset("jazz-finger")
    bass = replace(bass, output=replace(bass.output, gain=30 * bass.output.gain))
    synth, device = synth_and_device(bass, adaptive=False)
    synth.send(0x90, 40, 110)
    heard = device.block(4000)
    assert np.array_equal(heard, offline(bass, [(0, 0x90, 40, 110)], 4000)) and np.abs(heard).max() == 1.0


def test_messages_at_their_frames_and_now() -> None:
    synth, device = synth_and_device("jazz-finger", adaptive=False)
    first = device.block(100)
    assert not first.any()
    synth.send(0x90, 40, 100)
    synth.send(0x90, 45, 90, frame=333)
    synth.send(0x80, 40, 0, frame=120)  # too late for its frame: plays as soon as possible, and in order
    heard = play(device, 60 * 64)
    messages = [(100, 0x90, 40, 100), (333, 0x90, 45, 90), (333, 0x80, 40, 0)]
    assert np.array_equal(heard, offline("jazz-finger", messages, 100 + len(heard))[100:])


def test_two_channels_hear_the_same() -> None:
    synth, _ = synth_and_device(adaptive=False)
    synth.send(0x90, 40, 100)
    both = FakeDevice(synth, channels=2).block(3000)
    assert np.array_equal(both[:, 0], both[:, 1])
    assert np.array_equal(both[:, 0], offline("slap", [(0, 0x90, 40, 100)], 3000))


def test_a_held_note_rings_on_in_the_bass_that_was_replaced() -> None:
    """It rings as if nothing had changed until its note-off; then the old bass is released."""
    sounds = []
    for replaced in (False, True):
        synth, device = synth_and_device(without_noise("jazz-finger"), adaptive=False)
        synth.send(0x90, 40, 60)
        blocks = [play(device, 200 * 64)]
        if replaced:
            synth.switch_to(LiveBass(load_preset("flatwound"), QUICK, RATE))
        blocks.append(play(device, 200 * 64))
        for message in ((0xE0, 0, 96), (0x80, 40, 0)):
            synth.send(*message)
            blocks.append(play(device, 200 * 64))
        sounds.append(np.concatenate(blocks))
    assert np.array_equal(*sounds) and np.abs(sounds[0][30000:38000]).max() > 0.001
    while synth.ringing:
        device.block(256)
        synth.release_faded()
        assert synth.frame < 10 * RATE
    assert len(synth._basses) == 1
    synth.send(0x90, 40, 60)
    assert np.abs(play(device, 100 * 64)).max() > 0.005


def test_a_vibrato_goes_on_in_the_next_bass() -> None:
    """It equals a vibrato that began there: the first bass plays nothing."""
    sounds = []
    for first in ("flatwound", "jazz-finger"):
        synth, device = synth_and_device(first, adaptive=False)
        synth.send(0xB0, 1, 127)
        device.block(64)
        if first == "flatwound":
            synth.switch_to(LiveBass(load_preset("jazz-finger"), QUICK, RATE))
            device.block(64)
        synth.send(0x90, 40, 60)
        sounds.append(play(device, 600 * 64))
        synth.send(0xB0, 1, 0)
    still, device = synth_and_device("jazz-finger", adaptive=False)
    device.block(128)
    still.send(0x90, 40, 60)
    unmoved = play(device, 600 * 64)
    jumps = [float(np.abs(sound - unmoved).max()) for sound in sounds]
    assert min(jumps) > 0.1 * np.abs(unmoved).max()


@pytest.mark.parametrize("preset", ["flatwound", "slap-impulse", "slap"])
def test_a_new_note_takes_the_string_from_the_bass_that_was_replaced(preset: str) -> None:
    """Only one bass is played, whatever its preset: a string has one note. The other strings ring on."""
    synth, device = synth_and_device("jazz-finger", adaptive=False)
    old = bass_of(synth)
    for key in (28, 43):  # E and G, open
        synth.send(0x90, key, 60)
    device.block(4800)
    synth.switch_to(LiveBass(load_preset(preset), QUICK, RATE))
    device.block(64)
    synth.send(0x90, 30, 60)
    device.block(RATE)
    assert [sounding for _, _, sounding, _ in old.fingers()] == [False, False, False, True]
    assert [sounding for _, _, sounding, _ in bass_of(synth).fingers()] == [True, False, False, False]


def test_overload_ends_the_bass_that_rings_out() -> None:
    synth, device = synth_and_device("jazz-finger")
    load = Load(synth)  # no overload yet, whatever the machine's other work
    synth.send(0x90, 40, 60)
    device.block(2400)
    synth.switch_to(LiveBass(load_preset("flatwound"), QUICK, RATE))
    device.block(64)
    synth.release_faded()
    assert synth.ringing
    load.share = 1.0
    play(device, (int(FADE * RATE / 64) + 2) * 64)
    synth.release_faded()
    assert not synth.ringing


def test_many_basses_one_after_the_other() -> None:
    synth, device = synth_and_device("jazz-finger")
    basses = [LiveBass(load_preset(name), QUICK, RATE) for name in ("slap", "muted", "flatwound")]
    done = threading.Event()

    def swap() -> None:
        for bass in basses:
            synth.switch_to(bass)
        done.set()

    threading.Thread(target=swap, daemon=True).start()
    end = time.monotonic() + PATIENCE
    while not done.is_set() and time.monotonic() < end:
        synth.send(0x90, 40, 90)
        device.block(256)
    assert done.is_set()
    synth.panic()
    for _ in range(160):  # the last one may still wait for the previous fade-out, which waits for its filters
        device.block(256)
        synth.release_faded()
    assert synth._basses == basses[-1:]


def test_program_changes_are_noted() -> None:
    synth, device = synth_and_device()
    for message in ((0xB0, 0, 1), (0xB0, 32, 2), (0xC0, 5)):
        synth.send(*message)
    device.block(64)
    assert synth.program == (1, 5)


def test_programs_of_drums_choose_no_bass() -> None:
    """On channel 10, except in a melody bank, and in banks of kits on other channels: as in files."""
    synth, device = synth_and_device()
    rows = (
        (9, None, False), (9, 121, True), (9, 120, False), (3, None, True), (3, 120, False), (3, 127, False),
        (3, 126, False), (3, 0, True), (4, None, True),
    )  # fmt: skip
    chosen = 0
    for program, (channel, bank, is_bass) in enumerate(rows):
        if bank is not None:
            synth.send(0xB0 | channel, 0, bank)
        synth.send(0xC0 | channel, program)
        device.block(64)
        chosen += is_bass
        assert synth.program[0] == chosen and (not is_bass or synth.program[1] == program), (channel, bank)


def test_one_channel_only() -> None:
    synth, device = synth_and_device(channel=2)
    synth.receive(0x90, 40, 100)
    assert not device.block(2000).any()
    synth.receive(0x92, 40, 100)
    assert device.block(2000).any()


def test_scores_and_keys_are_heard_whatever_the_channel() -> None:
    synth, device = synth_and_device(channel=2)
    synth.send(0x90, 40, 100)
    assert device.block(2000).any()


def test_what_comes_after_a_stall_is_not_late_by_it() -> None:
    synth, device = synth_and_device()
    play(device, 10 * 64)
    time.sleep(0.5)
    assert synth.frame_now(64) <= synth.frame + 2 * 64
    synth.send(0x90, 40, 120, synth.frame_now(64))
    assert play(device, 20 * 64).any()


@pytest.mark.parametrize("size", quick([1, 64, 1000, 3000], [1, 1000]))
def test_a_bass_fades_out_at_the_same_frames_in_any_blocks(size: int) -> None:
    """A ringing bass fades from the start of a block, as soon as a third bass waits."""
    sounds = []
    for n in (240, size):
        synth, device = synth_and_device("jazz-finger", adaptive=False)
        synth.send(0x90, 40, 120)
        device.block(6000)
        synth.switch_to(LiveBass(load_preset("slap"), QUICK, RATE))
        device.block(6000)
        synth.switch_to(LiveBass(load_preset("muted"), QUICK, RATE))
        sounds.append(np.concatenate([device.block(n) for _ in range(-(-3000 // n))])[:3000])
    assert np.abs(sounds[0][:1000]).max() > 0.01
    assert np.array_equal(*sounds)
    assert not sounds[0][1440:].any()


def test_strings_run_ahead_for_as_long_as_their_contact_lasts() -> None:
    for preset, quality, share in (
        ("slap", "live", 0.1), ("slap-impulse", "live", 0.38), ("fretless", "live", 0.38), ("slap", "studio", 0.3),
        ("fretless", "studio", 0.7),
    ):  # fmt: skip
        bass = LiveBass(load_preset(preset), quality_with(quality, modes=60 if quality == "live" else 460), RATE)
        assert bass.record["share"][0] == share, preset
        bass.run_ahead(False)
        assert bass.record["share"][0] == 0.0


def test_they_run_ahead_for_as_long_as_the_costliest_block_took() -> None:
    """A long block without contacts was held up by the system."""
    synth, device = synth_and_device("slap", adaptive=False)
    record, load = bass_of(synth).record, Load(synth)
    minimum = float(record["share"][0])
    load.share = 0.5
    device.block(64)
    assert record["share_now"][0] == minimum, "nothing sounds"
    synth.send(0x90, 28, 127)
    load.share = 0.0
    device.block(4800)
    load.share = 0.5
    for wheel in (66, 64):
        synth.send(0xE0, 0, wheel)
        device.block(64)
    assert record["share_now"][0] == minimum, "no string can do the work of events ahead"
    shares = []
    for took in (0.01, 0.4, 0.3, 0.35, 5.0, 5.0, 0.01):
        load.share = took
        device.block(64)
        shares.append(float(record["share_now"][0]))
    forgotten = FORGOTTEN * 64 / RATE
    wanted = [minimum, minimum, 0.3, 0.35, 0.4, MAX_SHARE, MAX_SHARE]  # set by two blocks, not by one
    assert shares == pytest.approx(wanted, abs=4 * forgotten) and shares[-1] < shares[-2]
    load.share = 0.0
    for _ in range(round(1.01 * (MAX_SHARE - minimum) / FORGOTTEN)):
        device.block(RATE)
    assert record["share_now"][0] == minimum
    record["share"] = record["share_now"] = 0.0  # they do not run ahead
    load.share = 0.5
    device.block(64)
    assert record["share_now"][0] == 0.0


def test_panic_ends_everything() -> None:
    synth, device = synth_and_device()
    for key in (28, 33, 38, 43):
        synth.send(0x90, key, 120)
    assert device.block(4000).any()
    synth.panic()
    device.block(RATE)
    assert not device.block(RATE).any()


def test_recording_is_what_was_heard() -> None:
    synth, device = synth_and_device()
    synth.start_recording()
    synth.send(0x90, 40, 110)
    heard, kept = [], []
    for k in range(400):
        heard.append(device.block(97))
        if k % 50 == 0:
            kept.append(synth.recorded())
    kept.append(synth.recorded())
    assert np.array_equal(np.concatenate(kept), np.concatenate(heard))
    assert synth.meters().lost == 0


def test_a_recorder_that_sleeps_loses_sound_and_counts_it() -> None:
    synth, device = synth_and_device()
    synth.start_recording()
    size = int(CAPTURE_SECONDS * RATE)
    for _ in range(size // 4096 + 2):
        device.block(4096)
    assert synth.meters().lost == (size // 4096 + 2) * 4096 - size
    assert len(synth.recorded()) == size


def test_samples_beyond_full_scale_are_counted() -> None:
    """The count is the count of `render` at the same gain."""
    gain = 20.0
    synth, device = synth_and_device(adaptive=False, gain=gain)
    synth.send(0x90, 40, 127)
    heard = device.block(RATE // 2)
    beyond = int(np.count_nonzero(np.abs(offline("slap", [(0, 0x90, 40, 127)], RATE // 2, ceiling=np.inf)) * gain > 1))
    assert synth.meters().clipped == pytest.approx(beyond, abs=1) and beyond > 100
    assert np.abs(heard).max() == 1


def test_messages_are_kept_as_they_are_played() -> None:
    synth, device = synth_and_device()
    synth.keep_messages()
    for frame, key in ((333, 40), (5, 41), (40, 42)):  # one ring keeps the order
        synth.send(0x90, key, 100, frame=frame)
    device.block(128)
    assert synth.played() == []
    device.block(512)
    assert synth.played() == [(333, 0x90, 40, 100), (333, 0x90, 41, 100), (333, 0x90, 42, 100)]
    assert synth.played() == []


def test_bends_of_eight_octaves_stay_finite() -> None:
    """The bend range set by RPN 0, on every string at once."""
    synth, device = synth_and_device()
    for message in ((0xB0, 101, 0), (0xB0, 100, 0), (0xB0, 6, 96)):
        synth.send(*message)
    for key in (28, 33, 38, 43):
        synth.send(0x90, key, 127)
    sounds = []
    for wheel in (127, 0, 64, 127, 0):
        synth.send(0xE0, 0, wheel)
        sounds.append(device.block(RATE // 2))
    assert of_any(performer_of(synth))["range"] == 96
    assert np.isfinite(np.concatenate(sounds)).all() and synth.meters().faults == 0
    synth.send(0xE0, 0, 64)
    device.block(RATE // 2)
    assert {float(v.record["tuned"][0]) for v in bass_of(synth).engine.voices} == {1.0}


def test_nothing_is_compiled_once_it_plays() -> None:
    """Runs in its own process: a compiler, or a late import, would delay the first notes."""
    program = """
import sys
from support.live import feed, synth_and_device
from livebass import score_of
from livebass.compiling import library
from livebass.live.synth import Gauge

synth, device = synth_and_device()
assert library._loaded
known = set(sys.modules)
synth.start_recording(); synth.keep_messages()
score = score_of([(0.0, 0.1, 40, 100)], 48000)
gauge = Gauge(synth)
for k in range(50):
    feed(synth, score, 0 if k == 0 else len(score.frames))
    synth.receive(0xB0, 7, 100, synth.frame_now(64)); synth.send(0x90, 45, 50)
    device.block(64)
    synth.recorded(); synth.played(); synth.release_faded(); gauge.read(); synth.frame; synth.program
synth.panic()
print(sorted({"numba"} & set(sys.modules) | (set(sys.modules) - known)))
"""
    assert python_output("-c", program, env=module_paths()) == "[]\n"


def test_overload_coarsens_strings_and_calm_brings_them_back() -> None:
    synth, device = synth_and_device("jazz-finger", QUALITIES["live"])
    load, bass = Load(synth), bass_of(synth)
    for key in (28, 33, 38, 43):
        synth.send(0x90, key, 127)
    device.block(2400)
    load.share = 0.9
    before = device.block(64)
    assert synth.meters().overload == 1
    assert bass.coarse_strings == [3], "the newest contact first"
    sound = np.concatenate([before, play(device, 3 * 64)])
    assert bass.coarse_strings == [0, 1, 2, 3]
    assert np.isfinite(sound).all() and np.abs(sound).max() > 0.05
    assert np.abs(np.diff(sound)).max() < 0.2, "no jump"
    load.share = 0.1
    play(device, 4 * RATE)
    assert bass.coarse_strings == [] and synth.meters().overload == 0


def test_offline_strings_are_with_the_clock_and_fine() -> None:
    """After `stay` no string is ahead or coarse, and the sound goes on as if none had run ahead."""
    notes = [(0, 0x90, 33, 120), (100, 0x90, 40, 110), (9000, 0x90, 47, 127), (15000, 0x80, 33, 0)]
    wanted = offline("slap", notes, 24000)
    synth, device = synth_and_device("slap")
    bass = bass_of(synth)
    for frame, *message in notes:
        synth.send(*message, frame=frame)
    run_ahead(synth, "far")
    first = play(device, 200 * 64)
    assert max(int(v.record["frame"][0]) for v in bass.engine.voices) > synth.frame
    block.return_to_clock(synth.address)
    assert [int(v.record["frame"][0]) for v in bass.engine.voices] == [synth.frame] * 4
    run_ahead(synth, "never")
    assert np.array_equal(np.concatenate([first, device.block(24000 - 200 * 64)]), wanted)
    fine = {int(v.record["numerator"][0]) for v in bass.engine.voices}
    synth.send(0x90, 40, 127)
    device.block(64)
    Load(synth).share = 0.9
    play(device, 4 * 64)
    assert bass.coarse_strings and synth.meters().overload
    block.return_to_clock(synth.address)
    assert not bass.coarse_strings and not synth.meters().overload
    assert {int(v.record["numerator"][0]) for v in bass.engine.voices} == fine


def test_coarse_strings_go_on_in_tune() -> None:
    """Operators exchanged in mid-note, and back, give the same motion up to the effect of contacts."""
    quality = QUALITIES["live"]
    sounds = []
    for exchanged in (False, True):
        synth, device = synth_and_device("jazz-finger", quality)
        load, bass = Load(synth), bass_of(synth)
        synth.send(0x90, 40, 50)
        blocks = [device.block(4800)]
        load.share = 0.9 * exchanged
        blocks.append(play(device, 4 * 64))
        assert bass.coarse_strings == [2] * exchanged
        load.share = 0.0
        blocks.append(device.block(4800))
        block.return_to_clock(synth.address)
        assert not bass.coarse_strings
        blocks.append(device.block(4800))
        sounds.append(np.concatenate(blocks))
    plain, changed = sounds
    assert np.array_equal(plain[:4800], changed[:4800])
    assert np.abs(plain - changed).max() < 0.03 * np.abs(plain).max()


@pytest.mark.parametrize("preset", ["slap", "fretless"])
def test_changing_operators_in_the_midst_of_contact_is_no_blow(preset: str) -> None:
    """Operators exchanged to and fro during the first contacts leave the padding of a block of modes at rest."""
    synth, device = synth_and_device(preset, QUALITIES["live"])
    load, bass = Load(synth), bass_of(synth)
    string = bass.engine.strings - 1
    synth.send(0x90, bass.engine.instrument.strings[-1].open_note + 7, 127)
    device.block(544)
    for k in range(50):
        load.share = 0.9 * (k % 2 == 0)
        device.block(5 + 8 * (k % 5))
        if load.share:
            assert bass.coarse_strings == [string]
        else:
            block.return_to_clock(synth.address)
    voice, op = bass.engine.voices[string], bass.engine.pool.records[string, 7]
    rest = np.stack(voice.modal_state())[..., op["modes"] : op["padded"]]
    assert op["modes"] < op["padded"] and not rest.any()
    meters = synth.meters()
    assert meters.faults == 0 and 0.01 < meters.peak < 0.9


def test_wild_messages_leave_sound_that_is_finite() -> None:
    synth, device = synth_and_device("slap")
    rng = np.random.default_rng(1)
    for _ in range(300):
        for _ in range(int(rng.integers(0, 40))):
            synth.send(*(int(x) for x in rng.integers(0, 256, 3)))
        sound = device.block(int(rng.integers(1, 300)))
        assert np.isfinite(sound).all() and np.abs(sound).max() <= 1
    synth.panic()
    device.block(RATE)
    assert not device.block(RATE).any()
    assert synth.meters().faults == 0


def test_denormal_numbers_stay_what_they_were_outside() -> None:
    _, device = synth_and_device()
    device.block(64)
    assert 5e-324 * 1.0 > 0.0 and float(np.float64(2e-308) / 4) > 0.0


def test_a_full_ring_refuses() -> None:
    synth = Synth(RATE)
    sent = sum(synth.send(0x90, 40, 100) for _ in range(5000))
    assert sent == 4096


def test_kernels_of_the_audio_thread_cannot_allocate() -> None:
    """Their machine code refers neither to Python, numba's reference counts, nor the C library's allocator."""
    library()
    code = store.whole(store.built_library()) or store.whole(store.kept_library())
    assert code is not None
    for name in (b"lb_process", b"lb_play_string", b"lb_over_frets", b"lb_over_board", b"lb_portaudio", b"lb_jack"):
        assert name in code
    for word in (b"NRT_", b"Py_", b"numba", b"malloc"):
        assert word not in code, word.decode()
