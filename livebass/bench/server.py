"""From a MIDI note-on to the first sample: `bench_latency` measures, `bench_live_table.latency_table` shows.

Through a running JACK server, both ways there are: the native client with its own MIDI port, and PortAudio's JACK host
with rtmidi. The note's frame is the one at which `MidiProbe` put it into a period; what comes out at frame f is heard
one period and the sound card's own delay later, with any program. Without a server only the synth's queue is measured.

Why the callback is native: `bench_python` measures, `bench_live_table.python_table` shows.

One client of a running JACK server plays the demo phrase, first with the native callback, then with an ordinary one in
Python that asks the same engine for the same blocks, while the main thread keeps the interpreter busy. Lost is what
the server's frame time went on by and the synth did not play.

Two clients of a running JACK server measure another one: `MidiProbe` plays notes, `AudioProbe` hears when they sound.

Both count in frames of the server, so what the measuring side loses in periods cannot pass for latency: `AudioProbe`
knows of every gap. Two clients and not one, as a loop through one client would cost a period. Methods: [main thread].
"""

from __future__ import annotations

import gc
import os
import re
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass
from datetime import UTC, datetime
from typing import Any

import numpy as np
from numpy.typing import NDArray

from livebass import __version__
from livebass.bench.live import ALL_SOUND_OFF, CONTROL, NOTE_ON, silence
from livebass.bench.measure import Lost, Neighbours, Row, apart, machine
from livebass.bench.player import NAME
from livebass.live.guards import call_with_timeout, silenced_stderr
from livebass.live.outputs import FakeDevice, JackOutput
from livebass.live.synth import LiveBass, Synth
from livebass.model.quality import QUALITIES
from livebass.preset.load import load_preset
from livebass.report.progress import Say, silent
from livebass.score import demo_score

PRESET, VELOCITY = "jazz-finger", 100
SETTLE = 0.5  # s after a client has joined
LOOK = 30.0  # s for a server to answer
PATIENCE = 2.0  # s for a note to sound or to be silent
START = 90.0  # s for the other process, which may compile
QUEUE_BLOCK, QUEUE_RATE = 128, 48_000


@dataclass(frozen=True)
class Extent:
    """How much is measured."""

    notes: int = 40  # each way through the server
    queued: int = 200
    ways: tuple[str, ...] = ("jack", "portaudio")
    quality: str = "live"


USUAL = Extent()


def bench_latency(progress: Say | None = None, extent: Extent | None = None) -> dict[str, Any]:
    """All ways, in half a minute: numbers and text, as JSON has them. `progress` hears what comes next.

    "rows" has one for each way, with the times in ms or an "error"; "server" is None, and "missing" says why, where no
    JACK server runs. A note during which `AudioProbe` lost a period is not counted but "discarded". [main thread]
    """
    extent = extent or USUAL
    say = progress or silent
    where, neighbours = machine(), Neighbours()
    found, missing = None, ""
    try:
        found = apart(say, LOOK, server)
    except Lost as error:
        missing = str(error)
    say("the synth's queue")
    rows = [_queue(found["rate"] if found else QUEUE_RATE, found["block"] if found else QUEUE_BLOCK, extent)]
    if found:
        for way in extent.ways:
            name, _ = WAYS[way]
            say(name)
            row: Row = {"way": way, "name": name, "block": found["block"]}
            try:
                row |= apart(say, START + 3 * PATIENCE * extent.notes, _through, way, found, extent)
            except Lost as error:
                row["error"] = str(error)
            rows.append(row)
    return {
        "livebass": __version__,
        "date": datetime.now(UTC).isoformat(timespec="seconds"),
        "machine": where,
        **neighbours.shares(),
        "preset": PRESET,
        "quality": extent.quality,
        "rate_hz": found["rate"] if found else QUEUE_RATE,
        "server": found,
        "missing": missing,
        "rows": rows,
    }


def latency_figures(frames: list[float], rate: int) -> dict[str, Any]:
    """Least, median and most of latencies in frames, ms, and their jitter: the standard deviation."""
    ms = np.array(frames) / rate * 1e3
    return {
        "notes": len(ms),
        "least_ms": float(ms.min()),
        "median_ms": float(np.median(ms)),
        "most_ms": float(ms.max()),
        "jitter_ms": float(ms.std()),
        "each_ms": ms.tolist(),
    }


def _queue(rate: int, block: int, extent: Extent) -> Row:
    """From `Synth.send`, for a frame of the next block, to the first sample: the call's time and the frames between."""
    synth = Synth(rate, adaptive=False)
    bass = LiveBass(load_preset(PRESET), QUALITIES[extent.quality], rate)
    synth.switch_to(bass)
    device, rng = FakeDevice(synth), np.random.default_rng(0)
    key = bass.engine.instrument.strings[-1].open_note
    frames, calls = [], []
    silence(device, block)  # the first message loads a kernel
    for _ in range(extent.queued):
        start = int(synth.record["frame"][0])
        wanted = start + int(rng.integers(block))
        began = time.perf_counter_ns()
        synth.send(NOTE_ON, key, VELOCITY, wanted)
        calls.append((time.perf_counter_ns() - began) * 1e-9 * rate)
        while not (loud := np.flatnonzero(np.abs(device.block(block)) > HEARD)).size:
            start += block
        frames.append(start + int(loud[0]) - wanted + calls[-1])
        silence(device, block)
    return {
        "way": "queue",
        "name": "queue to block, no server",
        "block": block,
        "discarded": 0,
        "send_us": float(np.median(calls)) / rate * 1e6,
        **latency_figures(frames, rate),
    }


@contextmanager
def _native(found: dict[str, Any], quality: str) -> Iterator[tuple[str, str]]:
    """`livebass play --backend jack`, in this process: its MIDI port and its output."""
    output = JackOutput("livebass-bench", lambda rate: Synth(rate), connect=False)
    try:
        output.synth.switch_to(LiveBass(load_preset(PRESET), QUALITIES[quality], output.synth.rate))
        output.start()
        yield output.midi.name, output.outputs[0].name
    finally:
        output.close()


@contextmanager
def _portaudio(found: dict[str, Any], quality: str) -> Iterator[tuple[str, str]]:
    """`livebass play --backend portaudio`, in another process."""
    looking = AudioProbe()  # only to look at ports
    command = [sys.executable, "-m", "livebass.bench.player", PRESET, quality, str(found["rate"]), str(found["block"])]
    before = {port.name for port in looking.client.get_ports(is_audio=True, is_output=True)}
    child = subprocess.Popen(
        command, stdin=subprocess.PIPE, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True
    )
    try:

        def ports() -> tuple[str, str] | None:
            if child.poll() is not None:
                why = (child.stderr.read() if child.stderr else "").strip().splitlines()
                raise Lost(why[-1] if why else f"the player ended with status {child.returncode}")
            midi = [port.name for port in looking.client.get_ports(f"^{NAME}:", is_midi=True, is_input=True)]
            sound = [p.name for p in looking.client.get_ports(is_audio=True, is_output=True) if p.name not in before]
            return (midi[0], sound[0]) if midi and sound else None

        if not wait_for(ports, START):
            raise Lost(f"no ports of PortAudio and rtmidi after {START:g} s")
        found_ports = ports()
        assert found_ports is not None
        yield found_ports
    finally:
        looking.close()
        child.kill()
        child.communicate()


WAYS: dict[str, tuple[str, Callable[[dict[str, Any], str], AbstractContextManager[tuple[str, str]]]]] = {
    "jack": ("JACK client, its own MIDI port", _native),
    "portaudio": ("PortAudio and rtmidi", _portaudio),
}


def _through(_say: Say, way: str, found: dict[str, Any], extent: Extent) -> Row:
    """Notes at random offsets into the MIDI port and out of the output of `way`."""
    _, opened = WAYS[way]
    with opened(found, extent.quality) as (midi, sound):
        keys, ears = MidiProbe(), None
        try:
            ears = AudioProbe()
            for client in (keys.client, ears.client):
                client.activate()
            keys.client.connect(keys.port, midi)
            ears.client.connect(sound, ears.port)
            time.sleep(SETTLE)
            frames, discarded = _notes(keys, ears, found["block"], extent.notes)
        finally:
            keys.close()
            if ears:
                ears.close()
    if not frames:
        raise Lost(f"none of {extent.notes} notes was heard without a gap")
    return {"discarded": discarded, **latency_figures(frames, found["rate"])}


def _notes(keys: MidiProbe, ears: AudioProbe, block: int, notes: int) -> tuple[list[float], int]:
    """Latencies in frames, and how many notes were lost or came with a gap."""
    rng = np.random.default_rng(0)
    key = load_preset(PRESET).strings[-1].open_note
    frames: list[float] = []
    discarded = 0
    for _ in range(notes):
        if not wait_for(lambda: ears.silent > 1, PATIENCE):
            raise Lost("the bass does not become silent, or the server has stopped")
        ears.listen()
        time.sleep(float(rng.uniform(0.0, 2e-3)))
        keys.send(int(rng.integers(block)), NOTE_ON, key, VELOCITY)
        heard = wait_for(lambda: keys.sent is not None and ears.first is not None, PATIENCE)
        if heard and not ears.gaps and keys.sent is not None and ears.first is not None:
            frames.append(since(ears.first, keys.sent))
        else:
            discarded += 1
        keys.send(0, CONTROL, ALL_SOUND_OFF, 0)
        wait_for(lambda: keys.sent is not None, PATIENCE)
    return frames, discarded


PYTHON_PRESET, PYTHON_QUALITY = "slap", "live"
LONGEST = 90.0  # s, without the measuring itself
Work = Callable[[], object]


@dataclass(frozen=True)
class PythonExtent:
    """How much is measured."""

    seconds: float = 2.0  # each load with each callback
    settle: float = 0.5  # s after a client has joined, before that
    objects: int = 1_000_000  # that the garbage collector goes through


PYTHON_USUAL = PythonExtent()


class PythonOutput:
    """What `JackOutput` does, with a callback in Python."""

    def __init__(self, name: str, make_synth: Callable[[int], Synth]) -> None:
        self.client = new_client(name)
        self.synth = make_synth(int(self.client.samplerate))
        self._device = FakeDevice(self.synth)
        self._out = np.zeros(int(self.client.blocksize), np.float32)
        self._port = self.client.outports.register("out")
        self.client.set_process_callback(self._process)
        self.client.set_xrun_callback(self._xrun)

    def _process(self, _frames: int) -> None:
        self._port.get_array()[:] = self._device.fill(self._out)

    def _xrun(self, _delay: float) -> None:
        self.synth.record["underruns"] += 1

    def start(self) -> None:
        self.client.activate()

    def close(self) -> None:
        """Or not: now and then the server does not answer a client that it had to wait for so often."""
        call_with_timeout(lambda: self.client.deactivate(ignore_errors=True), self)
        call_with_timeout(lambda: self.client.close(ignore_errors=True), self)


def bench_python(progress: Say | None = None, extent: PythonExtent | None = None) -> dict[str, Any]:
    """Both callbacks under each load, in two thirds of a minute: numbers and text, as JSON has them.

    "rows" has one for each load and callback: blocks of the server's time, and how many of them were lost. Raises
    Lost where no JACK server runs. [main thread]
    """
    extent = extent or PYTHON_USUAL
    say = progress or silent
    where, neighbours = machine(), Neighbours()
    found = apart(say, LONGEST, server)
    rows = []
    for load in LOADS:
        for callback in ("native", "Python"):
            say(f"{load}, {callback} callback")
            rows.append(apart(say, LONGEST + 2 * extent.seconds, _python_row, load, callback, found["block"], extent))
    return {
        "livebass": __version__,
        "date": datetime.now(UTC).isoformat(timespec="seconds"),
        "machine": where,
        **neighbours.shares(),
        "preset": PYTHON_PRESET,
        "quality": PYTHON_QUALITY,
        "rate_hz": found["rate"],
        "block": found["block"],
        "server": found,
        "seconds": extent.seconds,
        "rows": rows,
    }


def _collector(objects: int) -> Work:
    kept: list[list[int]] = []

    def collect() -> None:
        if not kept:
            kept.extend([] for _ in range(objects))
        gc.collect()

    return collect


# Work for the main thread, each call some milliseconds; made of the number of objects for the garbage collector
LOADS: dict[str, Callable[[int], Work]] = {
    "idle": lambda _: lambda: time.sleep(0.05),
    "Python loop": lambda _: lambda: sum(k & 1 for k in range(200_000)),
    "regular expression": lambda _: lambda: re.match(r"(a+)+$", "a" * 20 + "b"),
    "garbage collector": _collector,
}


def _native_client(name: str, make_synth: Callable[[int], Synth]) -> JackOutput:
    return JackOutput(name, make_synth, connect=False)


def _python_row(_say: Say, load: str, callback: str, block: int, extent: PythonExtent) -> Row:
    work = LOADS[load](extent.objects)
    make: Callable[..., Any] = PythonOutput if callback == "Python" else _native_client
    output = make("livebass-bench", lambda rate: Synth(rate))
    synth = output.synth
    try:
        synth.switch_to(LiveBass(load_preset(PYTHON_PRESET), QUALITIES[PYTHON_QUALITY], synth.rate))
        synth.feed(demo_score(synth.rate, "slap"), 0, synth.rate // 10)
        output.start()
        time.sleep(extent.settle)
        began, first = output.client.frame_time, int(synth.record["frame"][0])
        xruns = int(synth.record["underruns"][0])
        end = time.monotonic() + extent.seconds
        while time.monotonic() < end:
            work()
        passed = since(output.client.frame_time, began)
        played = int(synth.record["frame"][0]) - first
        xruns = int(synth.record["underruns"][0]) - xruns
    finally:
        output.close()
    blocks = max(1, round(passed / block))
    lost = min(blocks, max(0, round((passed - played) / block)))
    return {"load": load, "callback": callback, "blocks": blocks, "lost": lost, "share": lost / blocks, "xruns": xruns}


HEARD, SILENT = 2e-6, 1e-6  # full scale: the first sample of a soft pluck is beyond the one, a stopped string below
WRAP = 1 << 32  # JACK's frame times


def since(later: int, earlier: int) -> int:
    """Frames from `earlier` to `later`, frame times of JACK."""
    return (later - earlier + WRAP // 2) % WRAP - WRAP // 2


def jack_module() -> Any:
    """JACK-Client; Lost where it or its library is missing."""
    try:
        import jack
    except (ImportError, OSError) as error:
        why = " ".join(str(error).split())
        raise Lost(f"JACK: {why}; pip install 'livebass[live]', and a JACK library") from None
    return jack


def new_client(name: str) -> Any:
    """A client of the running server; Lost where there is none."""
    jack = jack_module()
    try:
        with silenced_stderr():
            return jack.Client(name, no_start_server=True)
    except jack.JackError:
        server = os.environ.get("JACK_DEFAULT_SERVER", "default")
        raise Lost(
            f"no JACK server {server!r} runs here: start one, such as jackd -d alsa or jackd -d dummy, or PipeWire's"
        ) from None


def server(_say: object = None) -> dict[str, Any]:
    """What the running server is; Lost where there is none."""
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


class MidiProbe:
    """A MIDI output; each message goes out at an offset into some period, and `sent` has its frame."""

    def __init__(self) -> None:
        self.client = new_client("bench-keys")
        self.port = self.client.midi_outports.register("out")
        self.sent: int | None = None
        self._next: tuple[int, tuple[int, int, int]] | None = None
        self.client.set_process_callback(self._send)

    def _send(self, _frames: int) -> None:
        self.port.clear_buffer()
        if self._next is not None:
            (offset, message), self._next = self._next, None
            self.port.write_midi_event(offset, message)
            self.sent = self.client.last_frame_time + offset

    def send(self, offset: int, *message: int) -> None:
        status, first, second = message
        self.sent, self._next = None, (offset, (status, first, second))

    def close(self) -> None:
        self.client.deactivate(ignore_errors=True)
        self.client.close(ignore_errors=True)


class AudioProbe:
    """An audio input that knows the frame of the first sample that is no silence since `listen`, and of every gap.

    With `keep`, `periods` has all that was heard: (frame, samples) for each period.
    """

    def __init__(self, keep: bool = False) -> None:
        self.client = new_client("bench-ears")
        self.port = self.client.inports.register("in")
        self.first: int | None = None
        self.gaps = self.silent = 0  # since `listen`; periods of silence up to now
        self.periods: list[tuple[int, NDArray[np.float32]]] = []
        self._keep = keep
        self._next: int | None = None
        self.client.set_process_callback(self._hear)

    def _hear(self, frames: int) -> None:
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

    def close(self) -> None:
        self.client.deactivate(ignore_errors=True)
        self.client.close(ignore_errors=True)


def wait_for(what: Any, seconds: float) -> bool:
    """Whether the function `what` comes true within `seconds`."""
    end = time.monotonic() + seconds
    while not what():
        if time.monotonic() > end:
            return False
        time.sleep(0.002)
    return True
