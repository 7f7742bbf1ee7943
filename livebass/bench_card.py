"""A sound card without sound, and what it is given to play: the worst a player does.

`Card` calls the callback that PortAudio calls, through its C pointer, block after block without a pause, and reads
how long each took from the stage's own meter, which is inside the callback: Python's time between two blocks does
not count. A message is sent just before the block it falls into, as from a keyboard, never ahead. [main thread]
"""

from __future__ import annotations

import ctypes
import gc
import time
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from livebass.callbacks import PORTAUDIO, portaudio
from livebass.instrument import Instrument
from livebass.live_layout import STRETCH
from livebass.stage import Stage

SIGNATURE = ctypes.CFUNCTYPE(
    ctypes.c_int, ctypes.c_void_p, ctypes.c_void_p, ctypes.c_ulong, ctypes.c_void_p, ctypes.c_ulong, ctypes.c_void_p
)
NOTE_ON, NOTE_OFF, CONTROL, ALL_SOUND_OFF = 0x90, 0x80, 0xB0, 120
POPPED = (0.0, 0.5)  # s, all open strings at velocity 127 at once; the second time while they sound
LINE_FROM = 1.0  # s
SIXTEENTH = 60 / 110 / 4  # s
# One row a round over the strings: from one to the next never up by a fourth or two, so that no note of the new
# fret is one that another string still plays from the old one, which would take it.
ROUNDS = ((0, 127), (3, 100), (7, 127), (2, 115))  # fret, velocity
REST = 0.3  # s of silence after each run
Message = tuple[int, int, int, int]  # frame, status, first, second


@dataclass(frozen=True)
class Script:
    """Messages in the order of their frames, from frame 0 on."""

    rate: int
    messages: tuple[Message, ...]
    popped: int  # frames of it with nothing but all strings popped at once
    frames: int


def worst_case(bass: Instrument, rate: int, strings: int, line: float = len(ROUNDS) * 4 * SIXTEENTH) -> Script:
    """The first `strings` strings of `bass` popped at once, again, then `line` s of sixteenths round over them."""
    keys = [string.open_note for string in bass.strings[:strings]]
    messages: list[Message] = [
        (round(beat * rate), NOTE_ON, key, 127) for beat in POPPED for key in keys
    ]  # fmt: skip
    playing = list(keys)
    count = int(line / SIXTEENTH + 1e-9)
    for k in range(count):
        frame, i = round((LINE_FROM + k * SIXTEENTH) * rate), k % strings
        fret, velocity = ROUNDS[k // strings % len(ROUNDS)]
        messages.append((frame, NOTE_OFF, playing[i], 0))
        playing[i] = keys[i] + fret
        messages.append((frame, NOTE_ON, playing[i], velocity))
    return Script(rate, tuple(messages), round(LINE_FROM * rate), round((LINE_FROM + count * SIXTEENTH) * rate))


class Card:
    """Asks `stage` for blocks of `block` frames, one channel."""

    def __init__(self, stage: Stage, block: int) -> None:
        self.stage, self.block = stage, block
        self._mono = np.zeros(STRETCH, np.float32)
        self._out = np.zeros(block, np.float32)
        self._record = np.zeros(1, PORTAUDIO)
        self._record["stage"], self._record["channels"] = stage.address, 1
        self._record["mono"] = self._mono.ctypes.data
        self._call = SIGNATURE(portaudio())

    def next(self) -> NDArray[np.float32]:
        """The next block, (block,); the array is used again."""
        self._call(None, self._out.ctypes.data, self.block, None, 0, self._record.ctypes.data)
        return self._out

    def play(self, script: Script) -> NDArray[np.int64]:
        """Times of the blocks of `script` from the next one on, ns; `silence` first, for runs that are alike."""
        stage, messages, block, call = self.stage, script.messages, self.block, self._call
        out, record = self._out.ctypes.data, self._record.ctypes.data
        metered, busy, begin = bool(stage.record["clock"][0]), stage.record["busy"], int(stage.record["frame"][0])
        times = np.zeros(-(-script.frames // block), np.int64)
        sent, collected = 0, gc.isenabled()
        gc.disable()
        try:
            for k in range(len(times)):
                end = (k + 1) * block
                while sent < len(messages) and messages[sent][0] < end:
                    frame, status, first, second = messages[sent]
                    stage.send(status, first, second, begin + frame)
                    sent += 1
                began = time.perf_counter_ns()
                call(None, out, block, None, 0, record)
                times[k] = busy[0] if metered else time.perf_counter_ns() - began
        finally:
            if collected:
                gc.enable()
        return times

    def silence(self) -> None:
        """Ends all sound and waits for it, in blocks."""
        self.stage.send(CONTROL, ALL_SOUND_OFF, 0)
        for _ in range(-(-round(REST * self.stage.rate) // self.block)):
            self.next()
