"""`livebass bench latency`: the time from a MIDI note-on to the first sample.

Measured through a running JACK server in two ways to play live: the native client with its own MIDI port, and
PortAudio's JACK host beside a client that hears MIDI. A note's frame is the one at which `MidiProbe` puts it into a
period; output at frame f is heard one period and the sound card's own delay later, with any program. Without a server
only the way from the synth's queue into a block is measured.
"""

from __future__ import annotations

import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass
from typing import Any

import numpy as np

from livebass.lab.bench.jack import HEARD, AudioProbe, Lost, MidiProbe, in_child, new_client, server, since, wait_for
from livebass.lab.bench.measure import OtherLoad, Result, Row, heading, load_lines
from livebass.lab.bench.player import NAME
from livebass.live.fake import FakeDevice
from livebass.live.jack import JackOutput
from livebass.live.synth import LiveBass, Synth
from livebass.live.worst import ALL_SOUND_OFF, CONTROL, NOTE_ON, even, silence
from livebass.model.quality import QUALITIES
from livebass.preset.load import load_preset
from livebass.report.picture import figure, image
from livebass.report.progress import Say, silent
from livebass.report.text import columns

PRESET, VELOCITY = "jazz-finger", 100
SETTLE = 0.5  # s after a client joins
ANSWER = 30.0  # s for a server to answer
PATIENCE = 2.0  # s for a note to sound or fall silent
START = 90.0  # s for the other process, which may compile
QUEUE_BLOCK, QUEUE_RATE = 128, 48_000  # used without a server


@dataclass(frozen=True)
class Extent:
    """Extent of a measurement."""

    notes: int = 40  # per way through the server
    queued: int = 200
    ways: tuple[str, ...] = ("jack", "portaudio")
    quality: str = "live"


def bench_latency(progress: Say = silent, extent: Extent = Extent()) -> Result:
    """Measures all ways from a key to the sound in half a minute.

    Args:
        progress: Gets each next step, a line.
        extent: How many notes, by which ways.

    "rows" has one row per way, with the times in ms or an "error"; "server" is None, and "missing" says why, if no
    JACK server runs. A note during which `AudioProbe` lost a period is "discarded". [main thread]
    """
    result, load = heading(), OtherLoad()
    found, missing = None, ""
    try:
        found = in_child(ANSWER, server)
    except Lost as error:
        missing = str(error)
    rate, block = (found["rate"], found["block"]) if found else (QUEUE_RATE, QUEUE_BLOCK)
    progress("the synth's queue")
    rows = [_queue_row(rate, block, extent)]
    for way in extent.ways if found else ():
        name, _ = WAYS[way]
        progress(name)
        row: Row = {"way": way, "name": name, "block": block}
        try:
            row |= in_child(START + 3 * PATIENCE * extent.notes, _server_row, way, rate, block, extent)
        except Lost as error:
            row["error"] = str(error)
        rows.append(row)
    return result | {
        **load.shares(),
        "preset": PRESET,
        "quality": extent.quality,
        "rate_hz": rate,
        "server": found,
        "missing": missing,
        "rows": rows,
    }


def latency_figures(frames: list[float], rate: int) -> dict[str, Any]:
    """Returns minimum, median and maximum of latencies in frames, ms; jitter is their standard deviation."""
    ms = np.array(frames) / rate * 1e3
    return {
        "notes": len(ms),
        "least_ms": float(ms.min()),
        "median_ms": float(np.median(ms)),
        "most_ms": float(ms.max()),
        "jitter_ms": float(ms.std()),
        "each_ms": ms.tolist(),
    }


def _queue_row(rate: int, block: int, extent: Extent) -> Row:
    """From `Synth.send`, for a frame of the next block, to the first sample: the call's time and the frames between."""
    synth = Synth(rate, adaptive=False)
    bass = LiveBass(even(load_preset(PRESET)), QUALITIES[extent.quality], rate)
    synth.switch_to(bass)
    device, rng = FakeDevice(synth), np.random.default_rng(0)
    key = bass.engine.instrument.strings[-1].open_note
    frames, calls = [], []
    silence(device, block)  # the first message loads a kernel
    for _ in range(extent.queued):
        start = synth.frame
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
def _native(rate: int, block: int, quality: str) -> Iterator[tuple[str, str]]:
    """`livebass play --backend jack`, in this process: its MIDI port and its output."""
    output = JackOutput("livebass-bench", Synth, connect=False)
    try:
        output.synth.switch_to(LiveBass(even(load_preset(PRESET)), QUALITIES[quality], rate))
        output.start()
        yield output.midi.name, output.outputs[0].name
    finally:
        output.close()


@contextmanager
def _portaudio(rate: int, block: int, quality: str) -> Iterator[tuple[str, str]]:
    """`livebass play --backend portaudio`, in another process: its MIDI port and its output."""
    client = new_client("livebass-look")
    before = {port.name for port in client.get_ports(is_audio=True, is_output=True)}
    command = [sys.executable, "-m", "livebass.lab.bench.player", PRESET, quality, str(rate), str(block)]
    child = subprocess.Popen(
        command, stdin=subprocess.PIPE, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True
    )

    def ports() -> tuple[str, str] | None:
        if child.poll() is not None:
            why = (child.stderr.read() if child.stderr else "").strip().splitlines()
            raise Lost(why[-1] if why else f"the player ended with status {child.returncode}")
        midi = [port.name for port in client.get_ports(f"^{NAME}:", is_midi=True, is_input=True)]
        sound = [p.name for p in client.get_ports(is_audio=True, is_output=True) if p.name not in before]
        return (midi[0], sound[0]) if midi and sound else None

    try:
        if not wait_for(ports, START):
            raise Lost(f"no ports of PortAudio and its MIDI client after {START:g} s")
        found = ports()
        assert found is not None
        yield found
    finally:
        client.close(ignore_errors=True)
        child.kill()
        child.communicate()


# Name of each way; function that opens its MIDI port and output at a rate (Hz), block (frames) and quality.
WAYS: dict[str, tuple[str, Callable[[int, int, str], AbstractContextManager[tuple[str, str]]]]] = {
    "jack": ("JACK client, its own MIDI port", _native),
    "portaudio": ("PortAudio, MIDI from JACK", _portaudio),
}


def _server_row(way: str, rate: int, block: int, extent: Extent) -> Row:
    """Sends notes at random offsets into `way`, and listens to its output."""
    _, opened = WAYS[way]
    with opened(rate, block, extent.quality) as (midi, sound):
        keys, listener = MidiProbe(), None
        try:
            listener = AudioProbe()
            for client in (keys.client, listener.client):
                client.activate()
            keys.client.connect(keys.port, midi)
            listener.client.connect(sound, listener.port)
            time.sleep(SETTLE)
            frames, discarded = _notes(keys, listener, block, extent.notes)
        finally:
            keys.close()
            if listener:
                listener.close()
    if not frames:
        raise Lost(f"none of {extent.notes} notes was heard without a gap")
    return {"discarded": discarded, **latency_figures(frames, rate)}


def _notes(keys: MidiProbe, listener: AudioProbe, block: int, notes: int) -> tuple[list[float], int]:
    """Latencies in frames, and the number of notes that were lost or came with a gap."""
    rng = np.random.default_rng(0)
    key = load_preset(PRESET).strings[-1].open_note
    frames: list[float] = []
    discarded = 0
    for _ in range(notes):
        if not wait_for(lambda: listener.silent > 1, PATIENCE):
            raise Lost("the bass does not become silent, or the server has stopped")
        listener.listen()
        time.sleep(float(rng.uniform(0.0, 2e-3)))
        keys.send(int(rng.integers(block)), NOTE_ON, key, VELOCITY)
        heard = wait_for(lambda: keys.sent is not None and listener.first is not None, PATIENCE)
        if heard and not listener.gaps and keys.sent is not None and listener.first is not None:
            frames.append(since(listener.first, keys.sent))
        else:
            discarded += 1
        keys.send(0, CONTROL, ALL_SOUND_OFF, 0)
        wait_for(lambda: keys.sent is not None, PATIENCE)
    return frames, discarded


HEAD = ("way", "block", "notes", "minimum", "median", "maximum", "jitter", "not counted")


def table(result: Result) -> str:
    """Returns the figures of `bench_latency` as text."""
    rows: list[tuple[str, ...]] = [HEAD]
    errors = []
    for row in result["rows"]:
        if "error" in row:
            errors.append(f"{row['name']}: {row['error']}")
            continue
        times = (f"{row[key]:.3f} ms" for key in ("least_ms", "median_ms", "most_ms", "jitter_ms"))
        rows.append((row["name"], str(row["block"]), str(row["notes"]), *times, str(row["discarded"])))
    head = f"MIDI note-on to the first sample, {result['rate_hz'] / 1e3:g} kHz"
    if result["server"]:
        head += f", JACK server of {result['server']['block']} frames; the sound card's own delay is not included"
    else:
        head += f"; {result['missing']}: only the way from the queue into a block, no latency of a real output"
    return "\n".join(
        [
            head,
            *columns(rows),
            "jitter: standard deviation; not counted: notes during which the measuring client lost a period",
            *errors,
            "",
            *load_lines(result),
        ]
    )


def picture(result: Result) -> bytes:
    """Returns a PNG: a histogram of the latencies of each way, with a line at a block's duration."""
    rows = [row for row in result["rows"] if "error" not in row]
    drawn = figure(8, 2.4 * len(rows))  # the queue's row is always there
    axes = np.ravel(drawn.subplots(len(rows), 1, squeeze=False))
    for axis, row in zip(axes, rows, strict=True):
        block = row["block"] / result["rate_hz"] * 1e3
        axis.hist(row["each_ms"], np.linspace(0.0, max(1.2 * block, 1.1 * row["most_ms"]), 81))
        axis.axvline(block, color="black", linewidth=1, label=f"a block, {block:.2f} ms")
        axis.set(title=f"{row['name']}, {row['notes']} notes", ylabel="notes")
        axis.legend(fontsize="small")
    axes[-1].set_xlabel("note-on to first sample, ms")
    return image(drawn)
