"""Audio outputs: a PortAudio device, a JACK client with its own MIDI port, and a fake device. [main thread]"""

from __future__ import annotations

import atexit
import ctypes
import importlib
import logging
import os
import sys
import time
from collections.abc import Callable
from contextlib import suppress
from typing import Any

import numpy as np
from numpy.typing import NDArray

from livebass.extras import install
from livebass.kernels.player.performer import MOST_STRINGS
from livebass.live.desk import Desk
from livebass.live.guards import (
    JACK_HANGS,
    answer_of,
    call_with_timeout,
    never_release,
    open_jack_client,
    silenced_stderr,
)
from livebass.live.priority import make_realtime
from livebass.live.synth import Synth
from livebass.live.thread import callbacks
from livebass.live.thread.records import CHUNK
from livebass.model.quality import BLOCK

LOG = logging.getLogger(__name__)
FIRST_BLOCK = 0.5  # s that a device may take to ask for it
PA_STREAM_CALLBACK = ctypes.CFUNCTYPE(
    ctypes.c_int, ctypes.c_void_p, ctypes.c_void_p, ctypes.c_ulong, ctypes.c_void_p, ctypes.c_ulong, ctypes.c_void_p
)


class OutputLost(OSError):
    """An audio output cannot be opened or has gone away; one line."""


class PortAudioOutput:
    """Plays through a PortAudio device, by index or name; None: the system's default. Raises OutputLost."""

    def __init__(self, synth: Synth, device: int | str | None, block: int, latency: str | float) -> None:
        sd = _sounddevice()
        self.synth, self.block = synth, block
        try:
            with silenced_stderr():
                info = sd.query_devices(device, "output")
        except (sd.PortAudioError, ValueError) as error:
            raise _no_output(device, error) from None
        with suppress(OutputLost):  # PortAudio may use JACK
            _silence(_jack())
        _silence_alsa()
        self.name = str(info["name"])
        self.channels = min(callbacks.MOST_CHANNELS, int(info["max_output_channels"]))
        try:
            with silenced_stderr():
                self._stream = _NativeStream(sd, synth, device, self.channels, block, latency)
        except (sd.PortAudioError, ValueError) as error:
            usual = f"; its usual rate is {info['default_samplerate']:.0f} Hz (--rate)"
            raise OutputLost(f"audio output {self.name} at {synth.rate} Hz: {_one_line(error)}{usual}") from None
        self._exit, self._errors, self._closed = sd._exit_handler, sd.PortAudioError, False
        self.latency = float(self._stream.stream.latency)
        host = str(sd.query_hostapis(info["hostapi"])["name"])
        self.full_name = f"{self.name}, {host}"  # which names this device alone
        # A sound card may come back; what plays through a JACK server, by alsa-lib's plugin too, crashes when closed
        # after the server has gone.
        self.can_return = "jack" not in f"{host} {self.name}".casefold()

    @property
    def rate(self) -> int:
        return self.synth.rate

    def start(self) -> None:
        """Begins to play, in a thread that gets real-time priority if the system allows it."""
        with silenced_stderr():
            try:
                self._stream.stream.start()
            except self._errors as error:
                raise OutputLost(f"audio output {self.name}: {_one_line(error)}") from None
        if (thread := self._stream.data.thread()) and (refused := make_realtime(thread)):
            LOG.info("no real-time priority for the sound: %s", refused)

    @property
    def alive(self) -> bool:
        return bool(self._stream.stream.active)

    def advice(self) -> str:
        """Returns what helps against underruns while the load is low."""
        block = f"--block {2 * self.block} or " if 2 * self.block <= BLOCK[1] else ""
        return f"take {block}--latency {min(max(2e3 * self.latency, 20.0), 1e3):.0f}ms"

    def abandon(self) -> None:
        """Leaves behind a stream whose server is gone: PortAudio would hang or crash when it closes it."""
        if not self._closed:
            self._closed = True
            never_release(self)
            atexit.unregister(self._exit)  # closes all streams

    def close(self) -> bool:
        """Stops playback; safe to call twice. If PortAudio hangs, it is left behind, and False."""
        if self._closed:
            return True
        self._closed = True
        if call_with_timeout(self._end, self):
            return True
        atexit.unregister(self._exit)  # would hang as well
        return False

    def _end(self) -> None:
        self._stream.stream.abort(ignore_errors=True)
        self._stream.stream.close(ignore_errors=True)


class _CallbackData:
    """The user data of PortAudio's callback, kept alive with the buffer it points to."""

    def __init__(self, synth: Synth, channels: int) -> None:
        self._mono = np.zeros(CHUNK, np.float32)
        self._record = np.zeros(1, callbacks.PORTAUDIO)
        self._record["synth"], self._record["channels"] = synth.address, channels
        self._desk = synth.desk  # kept alive
        self._record["desk"] = synth.desk.address if synth.desk else 0
        self._record["mono"] = self._mono.ctypes.data
        self._record["gettid"] = _gettid()
        self.address = int(self._record.ctypes.data)

    def thread(self) -> int:
        """Returns the number of the thread that plays, once it has begun to; 0 if it is not known."""
        end = time.monotonic() + FIRST_BLOCK
        while not self._record["thread"][0] and self._record["gettid"][0] and time.monotonic() < end:
            time.sleep(0.005)
        return int(self._record["thread"][0])


def _gettid() -> int:
    """Address of the C function that numbers a thread as the scheduler does; 0 on systems without."""
    if sys.platform != "linux":
        return 0
    try:
        return int(ctypes.cast(ctypes.CDLL(None).gettid, ctypes.c_void_p).value or 0)
    except (AttributeError, OSError):
        return 0


class FakeDevice:
    """An audio device without hardware: calls PortAudio's callback through its C pointer, block by block."""

    def __init__(self, synth: Synth, channels: int = 1) -> None:
        self.synth, self.channels = synth, channels
        self._data = _CallbackData(synth, channels)
        self._call = PA_STREAM_CALLBACK(callbacks.portaudio.address)

    def block(self, frames: int, flags: int = 0) -> NDArray[np.float32]:
        """The next `frames` frames, (frames,) or (frames, channels); `flags` are PaStreamCallbackFlags."""
        shape = frames if self.channels == 1 else (frames, self.channels)
        return self.fill(np.full(shape, np.nan, np.float32), flags)

    def fill(self, out: NDArray[np.float32], flags: int = 0) -> NDArray[np.float32]:
        """`block` into the contiguous array `out`, which is also returned."""
        if self._call(None, out.ctypes.data, len(out), None, flags, self._data.address):
            raise OutputLost("the callback has ended the stream")
        return out


class _NativeStream:
    """A sounddevice stream with a C function as its callback, which sounddevice supports for library authors."""

    def __init__(
        self, sd: Any, synth: Synth, device: int | str | None, channels: int, block: int, latency: str | float
    ) -> None:
        self.data = _CallbackData(synth, channels)
        function = sd._ffi.cast("PaStreamCallback *", callbacks.portaudio.address)
        data = sd._ffi.cast("void *", self.data.address)
        self.stream: Any = sd._StreamBase(
            kind="output", wrap_callback=None, callback=function, userdata=data, samplerate=synth.rate,
            blocksize=block, device=device, channels=channels, dtype="float32", latency=latency,
        )  # fmt: skip


class JackOutput:
    """Plays as a client of a running JACK server, with two output ports and a MIDI input. Raises OutputLost.

    With `connect`, outputs are connected to the speakers and the MIDI input to what sends MIDI. PipeWire, which gives
    each client a period as it asks, is asked for `period` (frames, Hz). The synth's desk, if it has one, plays along;
    with `click_port` its metronome is heard in a port of its own, `metronome`.
    """

    def __init__(
        self,
        name: str,
        make_synth: Callable[[int], Synth],
        connect: bool = True,
        period: tuple[int, int] | None = None,
        click_port: bool = False,
    ) -> None:
        if period:
            os.environ.setdefault("PIPEWIRE_LATENCY", f"{period[0]}/{period[1]}")
        jack = _jack()
        self._jack = jack
        self.pipewire = "PipeWire" in _jack_version(jack)
        _silence(jack)
        try:
            self.client = open_jack_client(jack, name)
        except jack.JackError as error:
            raise _no_server(_one_line(error)) from None
        try:
            self._prepare(make_synth)
            if click_port:
                self.click = self.client.outports.register("metronome")
                self.record["click"] = self._address(self.click._ptr)
        except BaseException:
            self.client.close(ignore_errors=True)
            raise
        self._connect = connect
        self._strings: list[Any] = []  # ports of single strings, the lowest first
        self._seen: set[str] = set()
        self._speakers: list[str] = []  # ports that the outputs were connected to
        self._silent: Synth | None = None  # played before; the audio thread may still be in it

    def _prepare(self, make_synth: Callable[[int], Synth]) -> None:
        """Makes the synth for the server's rate, the ports and the callbacks. Raises what `make_synth` raises."""
        self.name = f"JACK client {self.client.name}"
        self.block = int(self.client.blocksize)
        self.rate = 0  # of the server: `play` follows it
        self.client.set_samplerate_callback(self._change_rate)
        end = time.monotonic() + FIRST_BLOCK
        while self.pipewire and not self.rate and time.monotonic() < end:
            time.sleep(0.005)  # until then PipeWire's library gives the rate of PIPEWIRE_LATENCY for the server's
        self.rate = self.rate or int(self.client.samplerate)
        self.synth = make_synth(self.rate)
        self.outputs = [self.client.outports.register(f"out_{k}") for k in (1, 2)]
        self.midi = self.client.midi_inports.register("midi_in")
        self.record = np.zeros(1, callbacks.JACK)
        ffi, lib, r, address = self._jack._ffi, self._jack._lib, self.record, self._address
        r["synth"], r["outputs"] = self.synth.address, len(self.outputs)
        r["desk"] = self.synth.desk.address if self.synth.desk else 0
        r["get_buffer"] = address(lib.jack_port_get_buffer)
        r["event_count"] = address(lib.jack_midi_get_event_count)
        r["event_get"] = address(lib.jack_midi_event_get)
        for k, port in enumerate(self.outputs):
            r["output"][0, k] = address(port._ptr)
        r["midi"] = address(self.midi._ptr)
        function = ffi.cast("JackProcessCallback", callbacks.jack.address)
        if lib.jack_set_process_callback(self.client._ptr, function, ffi.cast("void *", r.ctypes.data)):
            raise OutputLost("JACK: the server refuses the callback")
        self._gone = self._closed = False
        self.client.set_shutdown_callback(self._shut_down)
        self.client.set_xrun_callback(self._xrun)
        self.client.set_blocksize_callback(self._resize)

    def _address(self, value: Any) -> int:
        """Returns the address in a C pointer of the JACK library."""
        return int(self._jack._ffi.cast("intptr_t", value))

    def open_strings(self, count: int) -> None:
        """Opens a port for each of so many strings, the lowest first, `string_1` and so on, beside the mix."""
        while len(self._strings) < min(count, MOST_STRINGS):
            port = self.client.outports.register(f"string_{len(self._strings) + 1}")
            self._strings.append(port)
            self.record["string"][0, len(self._strings) - 1] = self._address(port._ptr)
            self.record["strings"] = len(self._strings)

    def follow_transport(self, desk: Desk) -> None:
        """Has the score of `desk` start, stop and go where JACK's transport does."""
        desk.follows_transport = True
        desk.record["transport_query"] = self._address(self._jack._lib.jack_transport_query)
        desk.record["client"] = self._address(self.client._ptr)

    def roll(self, rolling: bool) -> None:
        """Starts or stops JACK's transport."""
        (self.client.transport_start if rolling else self.client.transport_stop)()

    def locate(self, seconds: float) -> None:
        """Moves JACK's transport."""
        self.client.transport_frame = round(seconds * self.rate)

    def _shut_down(self, _status: object, _reason: str) -> None:
        self._gone = True

    def _xrun(self, _delay: float) -> None:
        self.synth.count_underrun()

    def _resize(self, frames: int) -> None:
        self.block = frames

    def _change_rate(self, rate: int) -> None:
        self.rate = rate

    def start(self) -> None:
        """Begins to play, connected to the speakers if there are any."""
        try:
            self.client.activate()
            self._connect_speakers()
        except self._jack.JackError as error:
            raise OutputLost(f"JACK: {_one_line(error)}") from None

    def play(self, synth: Synth) -> None:
        """Plays `synth` from the next block on, in place of the one before."""
        self._silent, self.synth = self.synth, synth
        self.record["synth"] = synth.address

    def _connect_speakers(self) -> list[str]:
        """Connects the outputs to the speakers unless they were connected before; returns the ports."""
        if not self._connect or self._speakers:
            return []
        speakers = self.client.get_ports(is_physical=True, is_input=True, is_audio=True)[: len(self.outputs)]
        self._speakers = [port.name for port in speakers]
        for mine, port in zip(self.outputs, speakers, strict=False):
            self.client.connect(mine, port)
        return self._speakers

    def look(self) -> list[str]:
        """Connects to other speakers if those connected have vanished; returns lines about it.

        A connection that somebody has removed stays removed.
        """
        if self._gone:
            return []
        try:
            there = {port.name for port in self.client.get_ports(is_input=True, is_audio=True)}
            gone = [name for name in self._speakers if name not in there]
            lines = [f"{_device(gone)} is gone"] if gone else []
            if gone:
                self._speakers = []
            if found := self._connect_speakers():
                lines.append(f"playing into {_device(found)}")
        except self._jack.JackError:
            return []
        return lines

    def advice(self) -> str:
        """Returns what helps against underruns while the load is low."""
        if self.pipewire:
            block = f", or take --block {2 * self.block}" if 2 * self.block <= BLOCK[1] else ""
            return f"set PIPEWIRE_LATENCY={2 * self.block}/{self.rate}{block}"
        return f"give the JACK server a larger period than {self.block} frames (jackd -p), and real-time priority (-R)"

    def connect_midi(self, wanted: str | None = None) -> tuple[list[str], list[str]]:
        """Connects MIDI sources that have appeared since the last call; returns their names, and those of the lost.

        `wanted` is a part of a name; None means hardware. A source that somebody has disconnected stays disconnected.
        """
        if not self._connect or self._gone:
            return [], []
        try:
            ports = {p.name: p for p in self.client.get_ports(is_physical=wanted is None, is_output=True, is_midi=True)}
            heard = {p.name for p in self.client.get_all_connections(self.midi)}
            fitting = [name for name in ports if (wanted or "").casefold() in name.casefold()]
            new = [name for name in fitting if name not in self._seen]
            for name in new:
                if name not in heard:
                    self.client.connect(ports[name], self.midi)
        except self._jack.JackError:
            return [], []
        gone, self._seen = self._seen - set(fitting), set(fitting)
        return new, sorted(gone)

    @property
    def alive(self) -> bool:
        return not self._gone

    @property
    def latency(self) -> float:
        return self.block / self.synth.rate

    def abandon(self) -> None:
        """Notes that the server is gone, before it tells: there is nothing to deactivate."""
        self._gone = True

    def close(self) -> None:
        """Stops playback; safe to call twice. A server that does not answer is left behind."""
        if self._closed:
            return
        self._closed = True
        call_with_timeout(self._end, self)

    def _end(self) -> None:
        if not self._gone:
            self.client.deactivate(ignore_errors=True)
        self.client.close(ignore_errors=True)


def _device(ports: list[str]) -> str:
    """Names the client that has these ports."""
    return ports[0].rpartition(":")[0]


def _jack_version(jack: Any) -> str:
    """Returns what the JACK library calls itself; PipeWire's has its name in it."""
    try:
        return str(jack.version_string())
    except (AttributeError, jack.JackError):
        return ""


def check_output(backend: str, device: int | str | None) -> None:
    """Raises OutputLost if `backend` ("auto", "portaudio", "jack") has no output, before anything is compiled."""
    if backend == "jack":
        _jack()  # raises if the library is missing
        if not jack_server():
            raise _no_server("none answers")
        return
    if backend == "auto" and device is None and jack_server():
        return
    sd = _sounddevice()
    try:
        with silenced_stderr():
            sd.query_devices(device, "output")
    except (sd.PortAudioError, ValueError) as error:
        raise _no_output(device, error) from None


def _no_output(device: int | str | None, error: Exception) -> OutputLost:
    if device is None:
        return OutputLost(
            "no audio output: connect a sound card or start a JACK server; `livebass render` needs neither"
        )
    return OutputLost(f"audio output {device!r}: {_one_line(error)}; `livebass devices` lists the outputs")


def _no_server(why: object) -> OutputLost:
    named = f" named {os.environ['JACK_DEFAULT_SERVER']}" if os.environ.get("JACK_DEFAULT_SERVER") else ""
    return OutputLost(
        f"JACK: no server{named} can be reached ({why}): start one, or use --backend portaudio;"
        " `livebass render` needs neither"
    )


def jack_server() -> str | None:
    """Returns a line about the running JACK server; None if there is none, or no JACK library."""
    try:
        jack = _jack()
    except OutputLost:
        return None
    try:
        client = open_jack_client(jack, "livebass-look")
    except jack.JackError:
        return None
    try:
        ports = client.get_ports(is_output=True, is_midi=True)
        return f"{client.samplerate} Hz, {client.blocksize} frames, {len(ports)} MIDI sources"
    finally:
        client.close(ignore_errors=True)


def output_names() -> dict[int, str]:
    """Returns PortAudio's outputs by number."""
    return {
        int(d["index"]): f"{d['name']} ({d['max_output_channels']} channels)"
        for d in _sounddevice().query_devices()
        if d["max_output_channels"] > 0
    }


def _sounddevice() -> Any:
    try:
        with silenced_stderr():
            return _portaudio_answer(lambda: importlib.import_module("sounddevice"))
    except OutputLost:
        raise
    except ImportError as error:
        raise OutputLost(f"sound output: {_one_line(error)}; {install('live')}") from None
    except OSError as error:
        raise OutputLost(
            f"sound output: {_one_line(error)}; on Debian: sudo apt install libportaudio2; or start a JACK server"
        ) from None


def _portaudio_answer(call: Callable[[], Any]) -> Any:
    """Calls what makes PortAudio look for devices, which alsa-lib also asks JACK for. Raises OutputLost if it hangs."""
    if sys.platform != "linux":  # elsewhere PortAudio wants to be used by one thread
        return call()
    try:
        return answer_of(call)
    except TimeoutError:
        raise OutputLost(f"sound output: PortAudio does not answer; {JACK_HANGS}") from None


def _jack() -> Any:
    try:
        import jack
    except ImportError as error:
        raise OutputLost(f"JACK: {_one_line(error)}; {install('live')}") from None
    except OSError as error:
        raise OutputLost(f"JACK: {_one_line(error)}; on Debian: sudo apt install libjack-jackd2-0") from None
    return jack


def restart_portaudio() -> None:
    """Makes PortAudio look for devices anew; all its streams must be closed. Raises OutputLost."""
    sd = _sounddevice()
    try:
        with silenced_stderr():
            sd._terminate()
            _portaudio_answer(sd._initialize)
    except sd.PortAudioError as error:
        raise OutputLost(f"sound output: {_one_line(error)}") from None


def _silence_alsa() -> None:
    """Stops alsa-lib from printing over the status line, which it does from the audio thread."""
    with suppress(OSError, AttributeError):
        ctypes.CDLL("libasound.so.2").snd_lib_error_set_handler(ctypes.c_void_p(callbacks.no_words.address))


def silence_jack() -> None:
    """Silences JACK again: some libraries reinstall its message handlers."""
    if "jack" in sys.modules:
        _silence(sys.modules["jack"])


def _silence(jack: Any) -> None:
    """Stops JACK from printing to stderr; exceptions say what matters."""
    for quiet in (jack.set_error_function, jack.set_info_function):
        quiet(lambda message: None)


def _one_line(error: BaseException) -> str:
    return " ".join(str(error).split())
