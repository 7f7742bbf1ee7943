"""JACK clients that measure another client, and work that a hanging server cannot hold up.

`MidiProbe` sends notes; `AudioProbe` detects when they sound. Both count the server's frames, so periods lost by the
measuring side cannot pass for latency: `AudioProbe` counts every gap. They are two clients, as a loop through one
would cost a period. Methods: [main thread].
"""

from __future__ import annotations

import multiprocessing
import os
import signal
import subprocess
import time
from collections.abc import Callable
from multiprocessing.connection import Connection
from typing import Any

import numpy as np
from numpy.typing import NDArray

from livebass.live.guards import call_with_timeout, open_jack_client
from livebass.live.synth import Synth
from livebass.system.extras import install

HEARD, SILENT = 2e-6, 1e-6  # of full scale: the first sample of a soft pluck is above, a stopped string below
WRAP = 1 << 32  # of JACK's frame times


class Lost(OSError):
    """The server or the measured client is missing or has gone; one line."""


def since(later: int, earlier: int) -> int:
    """Returns the frames from `earlier` to `later`, two JACK frame times less than half a wrap apart."""
    return (later - earlier + WRAP // 2) % WRAP - WRAP // 2


def wait_for(condition: Callable[[], object], seconds: float) -> bool:
    """Waits until `condition` is true; returns False after `seconds`."""
    end = time.monotonic() + seconds
    while not condition():
        if time.monotonic() > end:
            return False
        time.sleep(0.002)
    return True


def end_process(process: subprocess.Popen[Any], seconds: float) -> None:
    """Asks a process to end; kills it after `seconds`."""
    process.terminate()
    try:
        process.wait(seconds)
    except subprocess.TimeoutExpired:
        process.kill()


def jack_module() -> Any:
    """Imports JACK-Client; raises Lost if it or the JACK library is missing."""
    try:
        import jack
    except (ImportError, OSError) as error:
        why = " ".join(str(error).split())
        raise Lost(f"JACK: {why}; {install('live')}, and a JACK library") from None
    return jack


def new_client(name: str) -> Any:
    """Returns a client of the running server; raises Lost if there is none."""
    jack = jack_module()
    try:
        return open_jack_client(jack, name)
    except jack.JackError:
        server = os.environ.get("JACK_DEFAULT_SERVER", "default")
        raise Lost(
            f"no JACK server {server!r} runs here: start one, such as jackd -d alsa or jackd -d dummy, or PipeWire's"
        ) from None


def server() -> dict[str, Any]:
    """Returns rate (Hz), block (frames), scheduling and version of the running server; raises Lost if there is none."""
    client = new_client("livebass-look")
    try:
        return {
            "rate": int(client.samplerate),
            "block": int(client.blocksize),
            "realtime": bool(client.realtime),
            "version": jack_module().version_string(),
        }
    finally:
        client.close(ignore_errors=True)


class LostFrames:
    """Counts the frames elapsed on the server of `client` since creation, and the ones that `synth` did not play."""

    def __init__(self, client: Any, synth: Synth) -> None:
        self._client, self._synth = client, synth
        self._began, self._first = client.frame_time, synth.frame

    def read(self) -> tuple[int, int]:
        """Returns frames elapsed and frames lost; the latter to within a period, so it may be negative."""
        passed = since(self._client.frame_time, self._began)
        return passed, passed - (self._synth.frame - self._first)


class Probe:
    """A client of the server, `client`."""

    client: Any

    def close(self) -> None:
        """Leaves the server; one that does not answer is abandoned."""
        call_with_timeout(self._end, self)

    def _end(self) -> None:
        self.client.deactivate(ignore_errors=True)
        self.client.close(ignore_errors=True)


class MidiProbe(Probe):
    """A MIDI output; each message goes out at an offset into a period, and its frame is stored in `sent`."""

    def __init__(self) -> None:
        self.client = new_client("bench-midi")
        self.port = self.client.midi_outports.register("out")
        self.sent: int | None = None
        self._next: tuple[int, tuple[int, int, int]] | None = None
        self.client.set_process_callback(self._process)

    def _process(self, _frames: int) -> None:
        self.port.clear_buffer()
        if self._next is not None:
            (offset, message), self._next = self._next, None
            self.port.write_midi_event(offset, message)
            self.sent = self.client.last_frame_time + offset

    def send(self, offset: int, *message: int) -> None:
        status, first, second = message
        self.sent, self._next = None, (offset, (status, first, second))


class AudioProbe(Probe):
    """An audio input that finds the first audible sample, and counts lost periods.

    With `keep`, `periods` holds all sound: (frame, samples) for each period.
    """

    def __init__(self, keep: bool = False) -> None:
        self.client = new_client("bench-audio")
        self.port = self.client.inports.register("in")
        self.first: int | None = None  # frame of the first sample above HEARD since `listen`
        self.gaps = 0  # since `listen`
        self.silent = 0  # consecutive silent periods so far
        self.periods: list[tuple[int, NDArray[np.float32]]] = []
        self._keep = keep
        self._next: int | None = None
        self.client.set_process_callback(self._process)

    def _process(self, frames: int) -> None:
        now = self.client.last_frame_time
        if self._next is not None and now != self._next:
            self.gaps += 1
        self._next = (now + frames) % WRAP
        sound = self.port.get_array()
        if self._keep:
            self.periods.append((now, sound.copy()))
        level = np.abs(sound)
        if self.first is None:
            loud = np.flatnonzero(level > HEARD)
            if loud.size:
                self.first = now + int(loud[0])
        self.silent = self.silent + 1 if level.max() < SILENT else 0

    def listen(self) -> None:
        self.gaps, self.first = 0, None


def in_child(seconds: float, work: Callable[..., Any], *arguments: Any) -> Any:
    """Runs `work(*arguments)`, a module-level function, in another process, and returns its result.

    The process lives `seconds` at most; output of C libraries is dropped. Raises Lost, with one line, if `work` raises
    anything or does not end in time. [main thread]
    """
    context = multiprocessing.get_context("spawn")
    mine, theirs = context.Pipe(duplex=False)
    process = context.Process(target=_child, args=(theirs, seconds, work, arguments), daemon=False)
    process.start()
    theirs.close()
    try:
        if not mine.poll(seconds):
            raise Lost("the JACK server does not answer any more")
        result, error = mine.recv()
    except EOFError:
        raise Lost("the JACK server took the measuring process with it") from None
    finally:
        process.kill()
        process.join()
        mine.close()
    if error:
        raise Lost(error)
    return result


def _child(answer: Connection, seconds: float, work: Callable[..., Any], arguments: tuple[Any, ...]) -> None:
    end_after(seconds)
    os.dup2(os.open(os.devnull, os.O_WRONLY), 2)
    try:
        answer.send((work(*arguments), None))
    except Exception as error:  # JACK-Client has its own errors
        answer.send((None, " ".join(str(error).split()) or type(error).__name__))


def end_after(seconds: float) -> None:
    """Makes the system end this process after `seconds`, whatever it is doing."""
    if hasattr(signal, "alarm"):
        signal.signal(signal.SIGALRM, signal.SIG_DFL)
        signal.alarm(max(1, round(seconds)))
