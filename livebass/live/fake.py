"""An audio device without hardware, for tests and measurements."""

from __future__ import annotations

import ctypes

import numpy as np
from numpy.typing import NDArray

from livebass.live.device_errors import OutputLost
from livebass.live.portaudio import CallbackData
from livebass.live.synth import Synth
from livebass.live.thread import callbacks

PA_STREAM_CALLBACK = ctypes.CFUNCTYPE(
    ctypes.c_int, ctypes.c_void_p, ctypes.c_void_p, ctypes.c_ulong, ctypes.c_void_p, ctypes.c_ulong, ctypes.c_void_p
)


class FakeDevice:
    """An audio device without hardware: calls PortAudio's callback through its C pointer, block by block."""

    def __init__(self, synth: Synth, channels: int = 1) -> None:
        self.synth, self.channels = synth, channels
        self._data = CallbackData(synth, channels)
        self._call = PA_STREAM_CALLBACK(callbacks.portaudio.address)

    def block(self, frames: int, flags: int = 0) -> NDArray[np.float32]:
        """The next `frames` frames, (frames,) or (frames, channels); `flags` are PaStreamCallbackFlags."""
        shape = frames if self.channels == 1 else (frames, self.channels)
        return self.fill(np.full(shape, np.nan, np.float32), flags)

    def fill(self, out: NDArray[np.float32], flags: int = 0) -> NDArray[np.float32]:
        """Renders a `block` into the contiguous array `out`; returns it."""
        if self._call(None, out.ctypes.data, len(out), None, flags, self._data.address):
            raise OutputLost("the callback has ended the stream")
        return out
