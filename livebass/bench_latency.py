"""From a MIDI note-on to the first sample: `bench_latency` measures, `bench_live_table.latency_table` shows.

Through a running JACK server, both ways there are: the native client with its own MIDI port, and PortAudio's JACK host
with rtmidi. The note's frame is the one at which `Keys` put it into a period; what comes out at frame f is heard one
period and the card's own delay later, with any program. Without a server only the stage's queue is measured.
"""

from __future__ import annotations

import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass
from datetime import UTC, datetime
from typing import Any

import numpy as np

from livebass import __version__
from livebass.bench_apart import Lost, apart
from livebass.bench_card import ALL_SOUND_OFF, CONTROL, NOTE_ON, Card
from livebass.bench_jack import HEARD, Ears, Keys, server, since, wait_for
from livebass.bench_measure import Neighbours, Row, machine
from livebass.bench_player import NAME
from livebass.outputs import JackOutput
from livebass.preset import load_preset
from livebass.quality import QUALITIES
from livebass.stage import LiveBass, Stage

PRESET, VELOCITY = "jazz-finger", 100
SETTLE = 0.5  # s after a client has joined
LOOK = 30.0  # s for a server to answer
PATIENCE = 2.0  # s for a note to sound or to be silent
START = 90.0  # s for the other process, which may compile
QUEUE_BLOCK, QUEUE_RATE = 128, 48_000
Say = Callable[[str], None]


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
    JACK server runs. A note during which `Ears` lost a period is not counted but "discarded". [main thread]
    """
    extent = extent or USUAL
    say = progress or (lambda what: None)
    where, neighbours = machine(), Neighbours()
    found, missing = None, ""
    try:
        found = apart(say, LOOK, server)
    except Lost as error:
        missing = str(error)
    say("the stage's queue")
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
    """From `Stage.send`, for a frame of the next block, to the first sample: the call's time and the frames between."""
    stage = Stage(rate, shelter=False)
    bass = LiveBass(load_preset(PRESET), QUALITIES[extent.quality], rate)
    stage.put_on(bass)
    card, rng = Card(stage, block), np.random.default_rng(0)
    key = bass.engine.instrument.strings[-1].open_note
    frames, calls = [], []
    card.silence()  # the first message loads a kernel
    for _ in range(extent.queued):
        start = int(stage.record["frame"][0])
        wanted = start + int(rng.integers(block))
        began = time.perf_counter_ns()
        stage.send(NOTE_ON, key, VELOCITY, wanted)
        calls.append((time.perf_counter_ns() - began) * 1e-9 * rate)
        while not (loud := np.flatnonzero(np.abs(card.next()) > HEARD)).size:
            start += block
        frames.append(start + int(loud[0]) - wanted + calls[-1])
        card.silence()
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
    output = JackOutput("livebass-bench", lambda rate: Stage(rate), connect=False)
    try:
        output.stage.put_on(LiveBass(load_preset(PRESET), QUALITIES[quality], output.stage.rate))
        output.start()
        yield output.midi.name, output.outputs[0].name
    finally:
        output.close()


@contextmanager
def _portaudio(found: dict[str, Any], quality: str) -> Iterator[tuple[str, str]]:
    """`livebass play --backend portaudio`, in another process."""
    looking = Ears()  # only to look at ports
    command = [sys.executable, "-m", "livebass.bench_player", PRESET, quality, str(found["rate"]), str(found["block"])]
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
        keys, ears = Keys(), None
        try:
            ears = Ears()
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


def _notes(keys: Keys, ears: Ears, block: int, notes: int) -> tuple[list[float], int]:
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
