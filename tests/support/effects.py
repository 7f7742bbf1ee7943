"""The effects of a bass, alone in memory, played block by block."""

from __future__ import annotations

from typing import Any

import numpy as np

from livebass.compiling import jit
from livebass.kernels.bass.instrument import INSTRUMENT
from livebass.kernels.effects import chain
from livebass.kernels.effects.records import EFFECTS, effects_at
from livebass.kernels.machine.native import record_at
from livebass.rows.techniques import CABINETS, LIMITING

RATE = 44_100
CHOICES = {"cabinet": CABINETS, "limiter": LIMITING}
instrument_at = record_at(INSTRUMENT)


@jit
def play_chain(address: int, sound: Any, flags: Any, frame: int, knobs: int, stride: int) -> None:
    chain.play_effects(effects_at(address), sound, flags, frame, knobs, stride, len(sound))


@jit
def equip(address: int, numbers: int) -> None:
    chain.take_amp(address, instrument_at(numbers))


class InMemory:
    """The effects of a bass, with a response of samples at the rate `given`, and the number of frames they played."""

    def __init__(self, rate: int, compression: float, drive: float, response: Any = (), given: int = 0) -> None:
        taps, given = np.array(response, float), given or rate
        size = chain.bytes_of_effects(len(taps), float(given), float(rate))
        self.memory, self.frame, self.rate = np.zeros(size // 8), 0, rate
        self.address = self.memory.ctypes.data
        chain.make_effects(self.address, float(rate), compression, drive, taps.ctypes.data, len(taps), float(given))

    @property
    def record(self) -> np.void:
        return self.memory.view(np.uint8)[: EFFECTS.itemsize].view(EFFECTS)[0]

    def play(self, sound: Any, sizes: Any = (), knobs: Any = None) -> np.ndarray:
        """Processes `sound` in blocks of `sizes`, with `knobs` (KNOBS, n); the flags are kept."""
        out = np.array(sound, np.float32)
        self.flags = np.zeros_like(out)
        at, stride = 0, 0 if knobs is None else knobs.shape[1]
        for size in [*sizes, len(out) - sum(sizes)]:
            where = 0 if knobs is None else knobs.ctypes.data + 8 * at
            play_chain(self.address, out[at : at + size], self.flags[at : at + size], self.frame, where, stride)
            at += size
            self.frame += size
        return out


class Amp(InMemory):
    """Effects with these knobs of the bass."""

    def __init__(self, rate: int = RATE, /, compression: float = 0.0, drive: float = 0.0, **own: Any) -> None:
        super().__init__(rate, compression, drive)
        numbers = np.zeros(1, INSTRUMENT)
        for name, value in own.items():
            numbers[name] = CHOICES[name].index(value) if name in CHOICES else value
        equip(self.address, numbers.ctypes.data)

    def gain(self, hertz: np.ndarray, size: float = 1e-3) -> np.ndarray:
        """The complex gain at these frequencies, by an impulse of `size`."""
        impulse = np.zeros(self.rate)
        impulse[0] = size
        out = self.play(impulse).astype(float) / size
        return np.array([np.sum(out * np.exp(-2j * np.pi * f / self.rate * np.arange(len(out)))) for f in hertz])
