"""Any input: the sound stays finite and within full scale, and panic ends it."""

from __future__ import annotations

import numpy as np
from support.costs import KINDS
from support.fakejack import PERIOD, fake_jack
from support.live import QUICK, RATE, synth_and_device

from livebass import Quality, load_preset
from livebass.live.fake import FakeDevice
from livebass.live.jack import JackOutput
from livebass.live.synth import LiveBass, Synth
from livebass.live.systemmidi import SystemMidi
from livebass.live.thread.ring import NOW, unread
from livebass.rows.arrays import Floats

LIGHT = Quality("light", 60, 192e3)
BLOCK = 64
PANIC = 32  # messages


def assert_sane(synth: Synth, sound: np.ndarray) -> None:
    assert np.isfinite(sound).all()
    assert np.abs(sound).max() <= 1
    assert synth.meters().faults == 0


def assert_panic_silences(synth: Synth, device: FakeDevice) -> None:
    while any(unread(ring) for ring in synth.rings):  # earlier messages come first
        device.block(512)
    synth.panic()
    device.block(RATE)
    assert not device.block(RATE).any(), "a note is stuck"
    assert not any(sounding for _, _, sounding, _ in synth.bass.fingers())  # type: ignore[union-attr]


def random_messages(rng: np.random.Generator, count: int) -> list[list[int]]:
    """(count, 3): mostly messages a bass answers to, some not MIDI at all."""
    kinds = rng.choice([0x80, 0x90, 0x90, 0x90, 0xA0, 0xB0, 0xB0, 0xC0, 0xD0, 0xE0, 0xF0, 0x00], count)
    numbers = rng.choice([0, 6, 7, 11, 16, 32, 38, 64, 98, 100, 101, 120, 121, 123, 127], count)
    messages = np.stack([kinds | rng.integers(16, size=count), *rng.integers(-300, 300, (2, count))], axis=1)
    default = (kinds == 0xB0) & (rng.random(count) < 0.7)
    messages[default, 1] = numbers[default]
    return messages.tolist()


def test_a_hundred_thousand_messages() -> None:
    """A thousand blocks with a hundred messages each, at all sorts of frames."""
    synth, device = synth_and_device("slap", LIGHT)
    rng = np.random.default_rng(7)
    sent = 0
    while sent < 100_000:
        now = synth.frame
        frames = rng.choice([NOW, now, now + rng.integers(BLOCK), now - 1000, now + 2 * BLOCK, -5], 100)
        for frame, message in zip(frames.tolist(), random_messages(rng, 100), strict=True):
            sent += synth.send(*message, frame=frame)
        assert_sane(synth, device.block(BLOCK))
    assert_panic_silences(synth, device)


def test_what_rtmidi_hands_over() -> None:
    """Lists of any length with any bytes, as its callback might receive them."""
    synth, device = synth_and_device("jazz-finger", LIGHT)
    port = SystemMidi.__new__(SystemMidi)
    port.synth, port.delay = synth, 64
    rng = np.random.default_rng(8)
    for _ in range(100):
        for _ in range(100):
            length = int(rng.choice([0, 1, 2, 3, 3, 3, 4, 40]))
            port._heard([int(x) for x in rng.integers(0, 256, length)], float(rng.normal()), None)
        assert_sane(synth, device.block(BLOCK))
    assert_panic_silences(synth, device)


def test_everything_jumps_each_block() -> None:
    """Gain, controllers, bend, pedal, programs, panic, and another bass whenever one has faded out."""
    synth, device = synth_and_device("slap", QUICK)
    basses = [LiveBass(load_preset(name), quality, RATE) for name in KINDS for quality in (LIGHT, QUICK)]
    rng = np.random.default_rng(9)
    swaps = 0
    for k in range(700):
        synth.record["gain_target"] = float(rng.choice([0.0, 1.0, 10.0, 1e-9, rng.random()]))
        for number in (7, 11, 16, 64, 6, 38, 101, 100):
            synth.send(0xB0, number, int(rng.choice([0, 127, rng.integers(128)])))
        synth.send(0xE0, int(rng.integers(128)), int(rng.integers(128)))
        synth.send(0xC0, int(rng.integers(128)))
        synth.send(0x90, int(rng.integers(128)), int(rng.integers(1, 128)))
        if k % 97 == 0:
            synth.panic()
        synth.release_faded()
        if basses and not synth.switching:
            synth.switch_to(basses.pop())
            swaps += 1
        assert_sane(synth, device.block(int(rng.choice([1, 31, 64, 256]))))
    assert swaps == 2 * len(KINDS)
    synth.record["gain_target"] = 1.0
    assert_panic_silences(synth, device)


def through_jack(periods: list[list[bytes]]) -> tuple[Synth, Floats]:
    """The synth of a JACK client, after these messages, each at frame 0 of its period, and its sound."""
    with fake_jack() as server:
        output = JackOutput("livebass", lambda rate: Synth(rate), connect=False)
        output.synth.switch_to(LiveBass(load_preset("slap"), LIGHT, output.synth.rate))
        output.start()
        sounds = []
        for period in periods:
            server.midi = [(0, data) for data in period]
            sounds.append(server.play(PERIOD / RATE)["out_1"])
        output.synth.panic()
        server.play(1.0)
        assert not server.play(0.5)["out_1"].any() and output.alive
        output.close()
    return output.synth, np.concatenate(sounds)


def test_truncated_messages_through_jack_are_no_messages() -> None:
    truncated = [b"\x90", b"\x90\x28", b"\x80\x28", b"\xe0\x40", b"\xc0", b"\xb0\x07", b"\x90\xc8\x40"]
    synth, sound = through_jack([truncated, [*truncated, b"\x90\x28\x40", b"\xc0\x05"], truncated])
    assert synth.program == (1, 5) and sound.any()
    assert synth.meters().messages == 2 + PANIC


def test_bytes_through_jack() -> None:
    """Bytes truncated, too long, without a status, or system exclusive: the bass survives them all."""
    rng = np.random.default_rng(10)
    periods = []
    for _ in range(200):
        period = [bytes(x & 0xFF for x in message) for message in random_messages(rng, 10)]
        period += [bytes((m[0] & 0xFF, m[1] & 0x7F, m[2] & 0x7F)) for m in random_messages(rng, 10)]
        period += [rng.bytes(int(rng.integers(1, 9))) for _ in range(10)]
        period += [b"\xf0" + rng.bytes(30) + b"\xf7", b"\x90", b"\x40\x40", b"\x90\x28", b"\xf0", b"\xff"]
        periods.append(period)
    synth, sound = through_jack(periods)
    assert synth.meters().messages > 1000
    assert_sane(synth, sound)
    assert not any(sounding for _, _, sounding, _ in synth.bass.fingers())  # type: ignore[union-attr]
