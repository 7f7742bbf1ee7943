"""Random events of all kinds sent live into a bass with helper threads, and the checks of its sound."""

from __future__ import annotations

import threading
import time
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from livebass import QUALITIES
from livebass.live.fake import FakeDevice
from livebass.live.synth import LiveBass, Synth
from livebass.rows.arrays import Ints
from livebass.system.cores import core_count
from support.live import RATE
from support.own_basses import load_preset
from support.scores import SWITCH_KEYS

GAPS = (3, 50, 400)  # average frames between messages, for a while
CHANNELS = (0, 1, 2)
TOGETHER = 25  # messages of one density and one channel
CONTROLLERS = (1, 5, 6, 7, 9, 11, 16, 38, 64, 65, 68, 74, 98, 100, 101, 120, 121, 123, 126, 127)
LOUDEST = 8.0  # times the loudest single hard note: pops lift strings twice as far, and bends tighten them
BLOCKS = (16, 64, 128, 100, 1000)  # frames
WINDOW = RATE // 4  # frames per loudness reading
AFTER = 8  # windows after the last note


def random_message(rng: np.random.Generator, channel: int) -> tuple[int, int, int]:
    """A note on or off, a key switch, a controller, a bend or a pressure."""
    value = int(rng.integers(128))
    kind = rng.random()
    if kind < 0.4:
        return 0x90 | channel, int(rng.integers(20, 72)), max(value, 1)
    if kind < 0.6:
        return 0x80 | channel, int(rng.integers(20, 72)), value
    if kind < 0.8:
        return int(rng.choice([0x90, 0x80])) | channel, int(rng.choice(SWITCH_KEYS)), 100
    if kind < 0.9:
        return 0xB0 | channel, int(rng.choice(CONTROLLERS)), value
    return int(rng.choice([0xE0, 0xE0, 0xD0])) | channel, value, int(rng.integers(128))


def random_events(rng: np.random.Generator) -> tuple[Ints, NDArray[np.uint8]]:
    """Frames from now on (TOGETHER,) and messages (TOGETHER, 3), of one density and one channel."""
    channel, gap = int(rng.choice([0, 0, *CHANNELS])), float(rng.choice(GAPS))
    frames = np.cumsum(rng.exponential(gap, TOGETHER).astype(np.int64))
    return frames, np.array([random_message(rng, channel) for _ in range(TOGETHER)], np.uint8)


@dataclass(frozen=True)
class Borne:
    """The result of a bass under random events."""

    preset: str
    tier: str
    events: int
    seconds: float  # of sound
    took: float  # s
    peak: float  # times the loudest single hard note
    fallen: float  # level of the last of AFTER windows after all notes are off, dB above the first
    helped: int  # strings that helpers played for the audio thread

    def text(self) -> str:
        """One line."""
        return (
            f"{self.preset:18} {self.tier:9} {self.events:6} events, {self.seconds:5.1f} s of sound"
            f" in {self.took:6.1f} s, peak {self.peak:.2f} of {LOUDEST:g},"
            f" {self.fallen:4.0f} dB afterwards, {self.helped} strings helped"
        )


def _level(sound: np.ndarray) -> float:
    """RMS in dB, from -300."""
    return 20 * float(np.log10(max(np.sqrt(np.mean(np.square(sound, dtype=np.float64))), 1e-15)))


def bear(preset: str, tier: str, events: int, seed: int) -> Borne:
    """Plays `events` random events on `preset` in the quality `tier`, on all cores; checks every frame.

    The sound must be finite, bounded and free of faults. Every helper must survive to the end. After all notes are off
    the level must fall, and after all sound is off there must be silence.
    """
    began, bass = time.monotonic(), LiveBass(load_preset(preset), QUALITIES[tier], RATE)
    synth = Synth(RATE, adaptive=False)
    synth.record["ceiling"] = np.inf
    synth.switch_to(bass)
    device, rng, sent = FakeDevice(synth), np.random.default_rng([*map(ord, preset + tier), seed]), 0
    maximum = LOUDEST * _loudest_note(synth, device)
    helpers = max(core_count(), 2) - 1
    synth.start_helpers(helpers)
    peak = 0.0

    def play(frames: int) -> np.ndarray:
        nonlocal peak
        sound = device.block(frames)
        peak = max(peak, float(np.abs(sound).max()))
        assert np.isfinite(sound).all() and peak < maximum, (sent, peak, maximum)
        return sound

    try:
        while sent < events:
            frames, messages = random_events(rng)
            frames += synth.frame
            for frame, (status, first, second) in zip(frames.tolist(), messages.tolist(), strict=True):
                assert synth.send(status, first, second, frame=frame)
            sent += TOGETHER
            while synth.frame <= frames[-1]:
                play(int(rng.choice(BLOCKS)))
        for status, first, second in [(0xB0 | c, n, 0) for c in range(3) for n in (64, 66, 69, 123)]:
            synth.send(status, first, second)
        levels = [_level(play(WINDOW)) for _ in range(AFTER)]
        assert levels[-1] < max(levels[0] - 3.0, -120.0), levels
        synth.panic()
        play(RATE)
        assert not play(RATE // 10).any(), "a note is stuck"
        assert synth.meters().faults == 0 and bass.engine.report().weakened == 0
        assert _helping() == helpers == int(synth.record["team"]["helpers"][0]), "a helper is lost"
    finally:
        synth.stop_helpers()
    assert _helping() == 0 == int(synth.record["team"]["helpers"][0])
    return Borne(
        preset, tier, sent, synth.frame / RATE, time.monotonic() - began, LOUDEST * peak / maximum,
        levels[-1] - levels[0], synth.helped,
    )  # fmt: skip


def _helping() -> int:
    return sum(thread.name == "livebass helper" for thread in threading.enumerate())


def _loudest_note(synth: Synth, device: FakeDevice) -> float:
    """The peak of the strings' open notes and a high one, played as hard as possible; then silences them."""
    instrument = synth.bass.engine.instrument  # type: ignore[union-attr]
    keys = [string.open_note for string in instrument.strings]
    loudest = 0.0
    for key in [*keys, keys[-1] + synth.bass.engine.frets - 1]:  # type: ignore[union-attr]
        synth.send(0x90, key, 127)
        loudest = max(loudest, float(np.abs(device.block(RATE // 10)).max()))
        synth.send(0x80, key, 64)
        device.block(RATE // 10)
    synth.panic()
    device.block(RATE)
    return loudest
