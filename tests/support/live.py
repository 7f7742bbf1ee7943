"""A synth on a fake device, the same notes rendered offline, clocks for running ahead, and whole sessions."""

from __future__ import annotations

import ctypes
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import numpy as np

from livebass import Instrument, Quality, load_preset
from livebass.engine.engine import Engine
from livebass.engine.render import mix_strings, single
from livebass.kernels.player.words import Row, word_of
from livebass.live.fake import FakeDevice
from livebass.live.presets import PresetSwitch
from livebass.live.session import Session
from livebass.live.settings import Settings, Summary
from livebass.live.synth import RING, LiveBass, Synth
from livebass.live.thread.ring import push_message, unread
from livebass.rows.arrays import Floats
from livebass.score.score import Score
from support.jack import PATIENCE, wait_for
from support.scores import blocks

RATE = 48000


QUICK = Quality("quick", 150, 384e3)
ON, OFF = [0x90, 40, 100], [0x80, 40, 0]  # messages of a note


def synth_and_device(
    preset: str | Instrument = "slap", quality: Quality = QUICK, **more: object
) -> tuple[Synth, FakeDevice]:
    synth = Synth(RATE, **more)  # type: ignore[arg-type]
    bass = load_preset(preset) if isinstance(preset, str) else preset
    synth.switch_to(LiveBass(bass, quality, RATE))
    return synth, FakeDevice(synth)


def bass_of(synth: Synth) -> LiveBass:
    """The bass that plays."""
    assert synth.bass is not None
    return synth.bass


def performer_of(synth: Synth) -> np.void:
    """The performer's numbers of the bass that plays."""
    return bass_of(synth).engine.performer[0]


def play(device: FakeDevice, frames: int, size: int = 64) -> Floats:
    """Plays `frames` frames, in blocks of `size` and a rest."""
    sizes = [size] * (frames // size) + [frames % size] * (frames % size > 0)
    return np.concatenate([device.block(n) for n in sizes])


def next_line(changes: PresetSwitch, device: FakeDevice) -> str:
    """Plays until `changes` has a line to show, and returns it."""
    said: list[str] = []

    def turn() -> bool:
        device.block(64)
        said.extend(line for line in [changes.turn()] if line)
        return bool(said)

    wait_for(turn)
    return said[0]


def feed(synth: Synth, score: Score, first: int = 0) -> int:
    """Sends a score from message `first` on while there is room, aligned with the synth's frame 0; returns the next."""
    ring = synth.rings[1].ctypes.data
    for k in range(first, len(score.frames)):
        if not push_message(ring, RING, int(score.frames[k]), *score.messages[k].tolist()):
            return k
    return len(score.frames)


def offline(
    preset: str | Instrument,
    messages: Sequence[Row],
    frames: int,
    quality: Quality = QUICK,
    ceiling: float = 1.0,
) -> Floats:
    """Renders messages with the engine, (frames,), cut as the synth cuts."""
    engine = Engine(load_preset(preset) if isinstance(preset, str) else preset, quality, RATE)
    engine.send_words(np.array([m[0] for m in messages]), np.array([word_of(*m[1:]) for m in messages]))
    return np.clip(mix_strings(single(engine.process(frames))), -ceiling, ceiling)


CLOCK = ctypes.CFUNCTYPE(ctypes.c_int, ctypes.c_int, ctypes.POINTER(ctypes.c_int64))


def address_of(clock: Any) -> int:
    """The address of a clock, for a synth's clock."""
    return int(ctypes.cast(clock, ctypes.c_void_p).value or 0)


@CLOCK
def stopped_clock(_kind: int, spec: ctypes.POINTER(ctypes.c_int64)) -> int:  # type: ignore[valid-type]
    """A clock that stands still, so every block takes no time."""
    spec[0], spec[1] = 1, 0  # type: ignore[index]
    return 0


class Load:
    """A clock by which each block takes `share` of 64 frames' time, none at first: overload at will."""

    def __init__(self, synth: Synth) -> None:
        self.share, self._now = 0.0, 0
        self._clock = CLOCK(self._tell)
        synth.record["clock"] = address_of(self._clock)

    def _tell(self, _kind: int, spec: ctypes.POINTER(ctypes.c_int64)) -> int:  # type: ignore[valid-type]
        self._now += round(self.share * 64 / RATE * 1e9)
        spec[0], spec[1] = self._now // 10**9, self._now % 10**9 + 1  # type: ignore[index]
        return 0


def run_ahead(synth: Synth, how: str) -> None:
    """Lets strings run ahead of the clock as far as possible ("far"), "never", or "as time allows"."""
    if how == "far":
        synth.record["clock"] = address_of(stopped_clock)
    elif how == "never":
        synth.record["clock"] = 0


def played_ahead(
    preset: str | Instrument, messages: Sequence[tuple[int, int, int, int]], frames: int, sizes: Sequence[int] = (64,)
) -> Floats:
    """Plays messages in blocks of `sizes`, in turn, to strings far ahead; returns `frames` frames.

    Each message is sent before its own block: strings learn of it when they are past it.
    """
    synth, device = synth_and_device(preset, adaptive=False)
    run_ahead(synth, "far")
    assert synth.bass is not None
    heard, lead = [], 0
    for begin, size in blocks(frames, sizes):
        for frame, *message in messages:
            assert not begin <= frame < begin + size or synth.send(*message, frame=frame)
        heard.append(device.block(size))
        lead = max(lead, *(int(v.record["frame"][0]) - begin - size for v in synth.bass.engine.voices))
    assert lead >= 700, "nothing ran ahead"
    return np.concatenate(heard)[:frames]


def jack_session(preset: str, quality: Quality = QUICK, **more: Any) -> Session:
    """A session of a preset through JACK, without the computer keyboard."""
    return Session(Settings(load_preset(preset), quality, preset, backend="jack", keyboard=False, **more))


def session_of(session: Session, play: Callable[[Synth], None]) -> Summary:
    """Runs the session with `play` in a thread; ends it when `play` ends, and returns its summary.

    A busy machine makes no string coarse and fades no bass early.
    """

    def play_and_end() -> None:
        try:
            wait_for(lambda: session.synth)
            assert session.synth is not None
            session.synth.record["adaptive"] = 0
            play(session.synth)
        finally:
            session.stop.set()

    with ThreadPoolExecutor(1) as beside:
        playing = beside.submit(play_and_end)
        try:
            summary = session.run()
        finally:
            session.stop.set()
        playing.result(PATIENCE)
    return summary


def played_on(synth: Synth, seconds: float) -> None:
    """Waits until the synth has played `seconds` more."""
    end = synth.frame + seconds * synth.rate
    wait_for(lambda: synth.frame >= end)


def waiting_messages(synth: Synth) -> list[list[int]]:
    """The messages waiting in the synth's rings of Python and JACK."""
    return [message for ring in (0, 2) for _, *message in unread(synth.rings[ring])]
