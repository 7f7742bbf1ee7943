"""Plays through a PortAudio device. [main thread]"""

from __future__ import annotations

import atexit
import ctypes
import importlib
import logging
import sys
import time
from collections.abc import Callable
from contextlib import suppress
from typing import Any

import numpy as np

from livebass.live.device_errors import OutputLost, one_line
from livebass.live.guards import JACK_HANGS, answer_of, call_with_timeout, never_release, silenced_stderr
from livebass.live.jack import jack_library, silence
from livebass.live.priority import make_realtime
from livebass.live.synth import Synth, c_function
from livebass.live.thread import callbacks
from livebass.live.thread.records import CHUNK
from livebass.model.quality import BLOCK
from livebass.system.extras import install

LOG = logging.getLogger(__name__)
FIRST_BLOCK = 0.5  # s to wait for the device to request it


class PortAudioOutput:
    """Plays through a PortAudio device, by index or name; None: the system's default. Raises OutputLost."""

    def __init__(self, synth: Synth, device: int | str | None, block: int, latency: str | float) -> None:
        sd = sounddevice()
        self.synth, self.block = synth, block
        try:
            with silenced_stderr():
                info = sd.query_devices(device, "output")
        except (sd.PortAudioError, ValueError) as error:
            raise no_output(device, error) from None
        with suppress(OutputLost):  # PortAudio may use JACK
            silence(jack_library())
        _silence_alsa()
        self.name = str(info["name"])
        self.channels = min(callbacks.MAX_CHANNELS, int(info["max_output_channels"]))
        self._data = CallbackData(synth, self.channels)
        try:
            with silenced_stderr():
                # a stream with a C callback, which sounddevice supports for library authors
                self._stream: Any = sd._StreamBase(
                    kind="output", wrap_callback=None, samplerate=synth.rate, blocksize=block, device=device,
                    channels=self.channels, dtype="float32", latency=latency,
                    callback=sd._ffi.cast("PaStreamCallback *", callbacks.portaudio.address),
                    userdata=sd._ffi.cast("void *", self._data.address),
                )  # fmt: skip
        except (sd.PortAudioError, ValueError) as error:
            default = f"; its usual rate is {info['default_samplerate']:.0f} Hz (--rate)"
            raise OutputLost(f"audio output {self.name} at {synth.rate} Hz: {one_line(error)}{default}") from None
        self._exit, self._errors, self._closed = sd._exit_handler, sd.PortAudioError, False
        self.latency = float(self._stream.latency)
        host = str(sd.query_hostapis(info["hostapi"])["name"])
        self.full_name = f"{self.name}, {host}"  # identifies this device
        # A sound card may come back. A device on a JACK server, even via alsa-lib's plugin, crashes if closed after the
        # server has gone.
        self.can_return = "jack" not in f"{host} {self.name}".casefold()

    @property
    def rate(self) -> int:
        return self.synth.rate

    def start(self) -> None:
        """Starts playing in a thread with real-time priority, if the system allows it."""
        with silenced_stderr():
            try:
                self._stream.start()
            except self._errors as error:
                raise OutputLost(f"audio output {self.name}: {one_line(error)}") from None
        if (thread := self._data.thread()) and (refused := make_realtime(thread)):
            LOG.info("no real-time priority for the sound: %s", refused)

    @property
    def alive(self) -> bool:
        return bool(self._stream.active)

    def advice(self) -> str:
        """Returns a remedy for underruns at low load."""
        block = f"--block {2 * self.block} or " if 2 * self.block <= BLOCK[1] else ""
        return f"take {block}--latency {min(max(2e3 * self.latency, 20.0), 1e3):.0f}ms"

    def abandon(self) -> None:
        """Abandons a stream whose server is gone: PortAudio would hang or crash closing it."""
        if not self._closed:
            self._closed = True
            never_release(self)
            atexit.unregister(self._exit)  # closes all streams

    def close(self) -> bool:
        """Stops playback; safe to call twice. If PortAudio hangs, abandons it and returns False."""
        if self._closed:
            return True
        self._closed = True
        if call_with_timeout(self._end, self):
            return True
        atexit.unregister(self._exit)  # it would hang as well
        return False

    def _end(self) -> None:
        self._stream.abort(ignore_errors=True)
        self._stream.close(ignore_errors=True)


class CallbackData:
    """The user data of PortAudio's callback; keeps alive the buffer it points to."""

    def __init__(self, synth: Synth, channels: int) -> None:
        self._mono = np.zeros(CHUNK, np.float32)
        self._record = np.zeros(1, callbacks.PORTAUDIO)
        self._record["synth"], self._record["channels"] = synth.address, channels
        self._desk = synth.desk  # kept alive
        self._record["desk"] = synth.desk.address if synth.desk else 0
        self._record["mono"] = self._mono.ctypes.data
        self._record["gettid"] = c_function("gettid") if sys.platform == "linux" else 0
        self.address = int(self._record.ctypes.data)

    def thread(self) -> int:
        """Returns the playing thread's number once it runs; 0 if unknown."""
        end = time.monotonic() + FIRST_BLOCK
        while not self._record["thread"][0] and self._record["gettid"][0] and time.monotonic() < end:
            time.sleep(0.005)
        return int(self._record["thread"][0])


def no_output(device: int | str | None, error: Exception) -> OutputLost:
    """The error of a `device` that PortAudio cannot open or does not have; None: the system's own."""
    if device is None or not output_names():
        return OutputLost(
            "no audio output: connect a sound card or start a JACK server; `livebass render` needs neither"
        )
    return OutputLost(f"audio output {device!r}: {one_line(error)}; `livebass devices` lists the outputs")


def output_names() -> dict[int, str]:
    """Returns PortAudio's outputs by number."""
    return {
        int(d["index"]): f"{d['name']} ({d['max_output_channels']} channels)"
        for d in sounddevice().query_devices()
        if d["max_output_channels"] > 0
    }


def sounddevice() -> Any:
    try:
        with silenced_stderr():
            return _portaudio_answer(lambda: importlib.import_module("sounddevice"))
    except OutputLost:
        raise
    except ImportError as error:
        raise OutputLost(f"sound output: {one_line(error)}; {install('live')}") from None
    except OSError as error:
        raise OutputLost(
            f"sound output: {one_line(error)}; on Debian: sudo apt install libportaudio2; or start a JACK server"
        ) from None


def _portaudio_answer(call: Callable[[], Any]) -> Any:
    """Calls a PortAudio search for devices, which through alsa-lib also asks JACK. Raises OutputLost if it hangs."""
    if sys.platform != "linux":  # elsewhere PortAudio must be used by one thread
        return call()
    try:
        return answer_of(call)
    except TimeoutError:
        raise OutputLost(f"sound output: PortAudio does not answer; {JACK_HANGS}") from None


def restart_portaudio() -> None:
    """Makes PortAudio search for devices again; all its streams must be closed. Raises OutputLost."""
    sd = sounddevice()
    try:
        with silenced_stderr():
            sd._terminate()
            _portaudio_answer(sd._initialize)
    except sd.PortAudioError as error:
        raise OutputLost(f"sound output: {one_line(error)}") from None


def _silence_alsa() -> None:
    """Stops alsa-lib from printing over the status line, from the audio thread."""
    with suppress(OSError, AttributeError):
        ctypes.CDLL("libasound.so.2").snd_lib_error_set_handler(ctypes.c_void_p(callbacks.no_words.address))
