"""A synth on a fake device, the same notes rendered offline, and clocks for running ahead."""

from __future__ import annotations

import ctypes
from typing import Any

import numpy as np

from livebass import Instrument, Quality, load_preset
from livebass.arrays import Floats
from livebass.engine.engine import Engine
from livebass.engine.render import mixed
from livebass.live.outputs import FakeDevice
from livebass.live.synth import LiveBass, Synth

RATE = 48000


QUICK = Quality("quick", 150, 384e3)


def synth_and_device(preset: str = "slap", quality: Quality = QUICK, **more: object) -> tuple[Synth, FakeDevice]:
    synth = Synth(RATE, **more)  # type: ignore[arg-type]
    synth.switch_to(LiveBass(load_preset(preset), quality, RATE))
    return synth, FakeDevice(synth)


def offline(
    preset: str | Instrument, messages: list[tuple[int, int, int, int]], frames: int, quality: Quality = QUICK
) -> Floats:
    """Renders messages (frame, status, first, second) with the engine, (frames,)."""
    engine = Engine(load_preset(preset) if isinstance(preset, str) else preset, quality, RATE)
    engine.send(np.array([m[0] for m in messages]), np.array([m[1:] for m in messages], np.uint8))
    return mixed(engine.process(frames).astype(np.float32))


CLOCK = ctypes.CFUNCTYPE(ctypes.c_int, ctypes.c_int, ctypes.POINTER(ctypes.c_int64))


def address_of(clock: Any) -> int:
    """The address of a clock, for `Synth.set_clock`."""
    return int(ctypes.cast(clock, ctypes.c_void_p).value or 0)


@CLOCK
def stopped(_kind: int, spec: ctypes.POINTER(ctypes.c_int64)) -> int:  # type: ignore[valid-type]
    """A clock that stands still: every block takes no time."""
    spec[0], spec[1] = 1, 0  # type: ignore[index]
    return 0


def run_ahead(synth: Synth, how: str) -> None:
    """Lets strings run ahead of the clock as far as they can ("far"), "never", or "as time allows"."""
    if how == "far":
        synth.set_clock(address_of(stopped))
    elif how == "never":
        synth.set_clock(0)
