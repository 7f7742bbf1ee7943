"""The callback called without a sound card, and the same notes offline."""

from __future__ import annotations

import ctypes

import numpy as np

from livebass import Instrument, Quality, load_preset
from livebass.arrays import Floats
from livebass.engine.engine import Engine
from livebass.engine.render import mixed
from livebass.live.stage import LiveBass, Stage
from livebass.live.thread.callbacks import PORTAUDIO, portaudio
from livebass.live.thread.records import STRETCH

RATE = 48000


QUICK = Quality("quick", 150, 384e3)


SIGNATURE = ctypes.CFUNCTYPE(
    ctypes.c_int, ctypes.c_void_p, ctypes.c_void_p, ctypes.c_ulong, ctypes.c_void_p, ctypes.c_ulong, ctypes.c_void_p
)


class Player:
    """A sound card without sound: asks the callback for blocks."""

    def __init__(self, stage: Stage, channels: int = 1) -> None:
        self.stage, self.channels = stage, channels
        self.mono = np.zeros(STRETCH, np.float32)
        self.record = np.zeros(1, PORTAUDIO)
        self.record["stage"], self.record["channels"] = stage.address, channels
        self.record["mono"] = self.mono.ctypes.data
        self.call = SIGNATURE(portaudio())

    def block(self, n: int, flags: int = 0) -> Floats:
        """n frames, (n,) or (n, channels)."""
        out = np.full(n * self.channels, np.nan, np.float32)
        assert self.call(None, out.ctypes.data, n, None, flags, self.record.ctypes.data) == 0
        return out if self.channels == 1 else out.reshape(n, self.channels)


def staged(preset: str = "slap", quality: Quality = QUICK, **more: object) -> tuple[Stage, Player]:
    stage = Stage(RATE, **more)  # type: ignore[arg-type]
    stage.put_on(LiveBass(load_preset(preset), quality, RATE))
    return stage, Player(stage)


def offline(
    preset: str | Instrument, messages: list[tuple[int, int, int, int]], frames: int, quality: Quality = QUICK
) -> Floats:
    """The same by the engine: (frame, status, first, second)."""
    engine = Engine(load_preset(preset) if isinstance(preset, str) else preset, quality, RATE)
    engine.send(np.array([m[0] for m in messages]), np.array([m[1:] for m in messages], np.uint8))
    return mixed(engine.process(frames).astype(np.float32))


CLOCK = ctypes.CFUNCTYPE(ctypes.c_int, ctypes.c_int, ctypes.POINTER(ctypes.c_int64))


@CLOCK
def stopped(_kind: int, spec: ctypes.POINTER(ctypes.c_int64)) -> int:  # type: ignore[valid-type]
    """A clock by which nothing takes time."""
    spec[0], spec[1] = 1, 0  # type: ignore[index]
    return 0


def run_ahead(stage: Stage, how: str) -> None:
    """Strings run ahead of the clock as far as they can, or never, or as the time allows."""
    if how == "far":
        stage.record["clock"] = ctypes.cast(stopped, ctypes.c_void_p).value  # type: ignore[arg-type]
    elif how == "never":
        stage.record["clock"] = 0
