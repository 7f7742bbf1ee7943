"""What plays live, seen from Python: the synth's record, its rings, and the basses on it. [main thread]

How it goes, in a line: load, overload, underruns, level, and what each string plays. [main thread]
"""

from __future__ import annotations

import ctypes
import math
import threading
import time
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from livebass.engine.engine import Engine, prepare
from livebass.engine.prepare import Rates, whole_contact_rate
from livebass.kernels import records as at
from livebass.live.thread import ahead, block
from livebass.live.thread.records import (
    AHEAD,
    BASS,
    ENTRIES,
    EVENT_ROOM,
    EVENT_WORDS,
    NOW,
    SAVES,
    SOUND_RING,
    SYNTH,
    TAIL,
    kept,
    new_ring,
)
from livebass.model.instrument import Instrument
from livebass.model.quality import QUALITIES, Quality
from livebass.score import Score

COARSE = Quality("coarse", 150, 192e3)  # where strings go under overload
# Running ahead: share of a block's time, and frames between looks at the clock. What is no heavier than `live` leaves
# most of the time to others; a heavier one needs what there is.
AHEAD_LIGHT, AHEAD_HEAVY = (0.35, 4), (0.7, 1)
RING = 4096  # messages
RECORD_SECONDS = 20.0


@dataclass(frozen=True)
class Meters:
    """What the audio thread counted; loads are parts of the time a block lasts, without running ahead."""

    frame: int
    blocks: int
    late: int
    underruns: int
    messages: int
    worst: float  # since the meters were read last
    peak: float  # the same; 1 is full scale
    faults: int
    overload: int  # strings on coarse operators
    lost: int  # frames the recorder lost


def touch(array: NDArray[Any]) -> None:
    """Writes zeros to every page, so that the audio thread is not the first to."""
    array.reshape(-1).view(np.uint8).fill(0)


class Ahead:
    """What one string keeps to run ahead of the clock and come back."""

    def __init__(self, points: int) -> None:
        self.voice = np.zeros(SAVES, at.VOICE)
        self.slots = np.zeros((SAVES, at.VOICE_SLOTS), at.SLOT)
        self.memory = np.zeros((SAVES, at.POLARISATIONS * at.VOICE_SLOTS, kept(points)))
        self.sound = np.zeros(SOUND_RING)
        self.record = np.zeros(1, AHEAD)
        self.record["kept"] = kept(points)
        for name in ("voice", "slots", "memory", "sound"):
            self.record[name] = getattr(self, name).ctypes.data
            touch(getattr(self, name))


class LiveBass:
    """An instrument made ready for the audio thread; raises ValueError for what `Engine` cannot play."""

    def __init__(self, instrument: Instrument, quality: Quality, rate: int, seed: int = 0) -> None:
        self.engine = Engine(instrument, quality, rate, seed)
        coarse = Rates(rate, whole_contact_rate(COARSE.contact_rate, rate))
        self.coarse = prepare(instrument, COARSE, coarse, self.engine.frets)
        self.events = np.zeros((2, EVENT_ROOM), at.EVENT)
        self.record = np.zeros(1, BASS)
        b = self.record
        b["address"], b["play_string"] = b.ctypes.data, ahead.play_string()
        b["strings"], b["frets"] = self.engine.strings, self.engine.frets
        for k, pool in enumerate((self.engine.pool, self.coarse)):
            b["operators"][0, k] = pool.records.ctypes.data
            b["pool"][0, k], b["pool_size"][0, k] = pool.memory.ctypes.data, pool.memory.size
        for i, v in enumerate(self.engine.voices):
            b["string"][0, i] = v.string.ctypes.data
        b["performer"], b["settings"] = self.engine.performer.ctypes.data, self.engine.settings.ctypes.data
        b["events"], b["mine"] = self.events[0].ctypes.data, self.events[1].ctypes.data
        light = QUALITIES["live"]
        heavy = quality.modes is None or quality.modes > (light.modes or 0) or quality.contact_rate > light.contact_rate
        b["share"], b["stride"] = AHEAD_HEAVY if heavy else AHEAD_LIGHT
        points = np.maximum(*(pool.records["points"].max(axis=1) for pool in (self.engine.pool, self.coarse)))
        self.ahead = [Ahead(int(n)) for n in points]
        b["ahead"][0, : self.engine.strings] = [a.record.ctypes.data for a in self.ahead]
        for v in self.engine.voices:
            touch(v.work)
        touch(self.events)

    @property
    def address(self) -> int:
        return int(self.record.ctypes.data)

    def fingers(self) -> list[tuple[str, int, bool, bool]]:
        """(string, fret, sounding, touching a fret since the pluck) for each string."""
        p = self.engine.performer[0]
        out = []
        for i, (string, v) in enumerate(zip(self.engine.instrument.strings, self.engine.voices, strict=True)):
            slot = v.slots[int(v.record["slot"][0])]
            out.append((string.name, int(p["fret"][i]), bool(slot["on"]), bool(slot["touching"])))
        return out


class Synth:
    """The record the audio thread works on, at `rate` Hz."""

    def __init__(self, rate: int, channel: int = -1, gain: float = 1.0, adaptive: bool = True) -> None:
        self.rate = rate
        self.record = np.zeros(1, SYNTH)
        self.rings = [new_ring(RING, EVENT_WORDS) for _ in range(3)]
        for ring in self.rings:
            touch(ring)
        self.sound_ring = np.zeros(0, np.int64)
        self._writer = threading.Lock()  # of the live ring, between Python's threads
        self._basses: list[LiveBass] = []
        r = self.record
        r["process"] = block.process()
        r["rate"], r["channel"], r["gain"], r["gain_wanted"] = rate, channel, gain, gain
        r["adaptive"] = adaptive
        for k, ring in enumerate(self.rings):
            r["ring"][0, k], r["ring_size"][0, k] = ring.ctypes.data, RING
        for name in ("time", "next_bass", "free_bass", "record", "panic"):
            r[f"{name.removesuffix('_bass')}_address"] = self._address_of(name)
        r["clock"], r["clock_kind"] = _clock()

    @property
    def address(self) -> int:
        return int(self.record.ctypes.data)

    def _address_of(self, field: str) -> int:
        offset = SYNTH.fields[field][1]  # type: ignore[index]
        return self.address + int(offset)

    def switch_to(self, bass: LiveBass) -> None:
        """`bass` plays from the next block on; the one before fades out. Waits where one is fading already."""
        self.release_faded()
        while block.read(self._address_of("next_bass")) or block.read(self._address_of("free_bass")):
            time.sleep(0.005)
            self.release_faded()
        self._basses.append(bass)
        block.write(self._address_of("next_bass"), bass.address)

    def release_faded(self) -> None:
        """Lets go of a bass that has faded out."""
        free = block.read(self._address_of("free_bass"))
        if free:
            self._basses = [b for b in self._basses if b.address != free]
            block.write(self._address_of("free_bass"), 0)

    @property
    def bass(self) -> LiveBass | None:
        """The last one put on."""
        return self._basses[-1] if self._basses else None

    def send(self, status: int, first: int = 0, second: int = 0, frame: int = NOW) -> bool:
        """A MIDI message for synth frame `frame` or as soon as possible; False where the ring is full. [any thread]"""
        message = status & 0xFF | (first & 0x7F) << 8 | (second & 0x7F) << 16
        with self._writer:
            return bool(block.put(self.rings[0].ctypes.data, RING, frame, message))

    def feed(self, score: Score, first: int, start: int) -> int:
        """Messages of `score` from index `first` on, at `start` + their frames, while there is room; the next index."""
        ring = self.rings[1].ctypes.data
        for k in range(first, len(score.frames)):
            status, one, two = score.messages[k].tolist()
            if status & 0xF0 == 0xC0:
                continue  # programs of a file are somebody else's sounds
            if not block.put(ring, RING, start + int(score.frames[k]), status | one << 8 | two << 16):
                return k
        return len(score.frames)

    def frame_now(self, ahead: int) -> int:
        """The frame that a message of this moment belongs to, `ahead` frames late: the same delay for all.

        Where the sound has stalled it is that of the block after the next: nothing waits for time that was lost.
        """
        began = block.read(self._address_of("time"))
        while True:
            first, frames = int(self.record["time_frame"][0]), int(self.record["time_frames"][0])
            again = block.read(self._address_of("time"))
            if again == began:
                break
            began = again
        if not began:
            return NOW
        since = round((time.clock_gettime_ns(time.CLOCK_MONOTONIC) - began) * 1e-9 * self.rate)
        return first + min(since, 2 * frames) + ahead

    def receive(self, status: int, first: int = 0, second: int = 0, frame: int = NOW) -> bool:
        """`send` for what comes in at a MIDI port: other channels than the synth's are not heard. [any thread]"""
        channel = int(self.record["channel"][0])
        return (channel >= 0 and status & 0x0F != channel) or self.send(status, first, second, frame)

    def panic(self) -> None:
        """All sound off, controllers as new."""
        block.write(self._address_of("panic"), 1)

    def set_gain(self, gain: float) -> None:
        self.record["gain_wanted"] = gain

    def start_recording(self) -> None:
        """From the next block on sound goes into a ring that `recorded` empties."""
        size = int(RECORD_SECONDS * self.rate)
        self.sound_ring = np.zeros(ENTRIES + (size + 1) // 2, np.int64)
        touch(self.sound_ring)
        self.record["record_size"] = size
        block.write(self._address_of("record"), self.sound_ring.ctypes.data)

    def recorded(self) -> NDArray[np.float32]:
        """What has been recorded since the last call, (n,)."""
        size, address = int(self.record["record_size"][0]), self.sound_ring.ctypes.data
        data = self.sound_ring[ENTRIES:].view(np.float32)[:size]
        tail, head = int(self.sound_ring[TAIL]), block.read(address)
        out = data[np.arange(tail, head) % size].copy()
        block.write(address + 8 * TAIL, head)
        return out

    def meters(self) -> Meters:
        """Counters; `worst` and `peak` start anew."""
        r = self.record[0]
        worst, peak = float(r["load_worst"]), float(r["peak"])
        r["load_worst"], r["peak"] = 0.0, 0.0
        return Meters(
            frame=int(r["frame"]), blocks=int(r["blocks"]), late=int(r["late"]), underruns=int(r["underruns"]),
            messages=int(r["messages"]), worst=worst, peak=peak,
            faults=int(r["faults"]), overload=int(r["overload"]), lost=int(r["record_lost"]),
        )  # fmt: skip


def _clock() -> tuple[int, int]:
    """Address of clock_gettime and the number of the monotonic clock; zeros where there is none."""
    try:
        function = ctypes.CDLL(None).clock_gettime
        return int(ctypes.cast(function, ctypes.c_void_p).value or 0), time.CLOCK_MONOTONIC
    except (AttributeError, OSError, TypeError):
        return 0, 0


QUIETEST = -99.0  # dB


@dataclass(frozen=True)
class Reading:
    """The meters since the last reading, and the median load of the blocks since (0 where there was none)."""

    meters: Meters
    median: float

    @property
    def troubles(self) -> tuple[int, int, int, int]:
        """What somebody who reads a log wants to hear of when it changes."""
        m = self.meters
        return m.underruns, m.overload, m.faults, m.lost

    def text(self) -> str:
        """Load first, then trouble if there is any."""
        m = self.meters
        parts = [f"load {self.median:.0%} (worst {m.worst:.0%})"]
        if m.overload:
            parts.append(f"OVERLOAD: {m.overload} string{'s' * (m.overload > 1)} coarse")
        parts.append(f"underruns {m.underruns}")
        if m.faults:
            parts.append(f"faults {m.faults}")
        if m.lost:
            parts.append(f"{m.lost} frames not recorded")
        parts.append(f"{decibels(m.peak):.0f} dB")
        return ", ".join(parts)


class Gauge:
    """Reads the meters of `synth`."""

    def __init__(self, synth: Synth) -> None:
        self.synth = synth
        self.worst = 0.0  # load of a block so far
        self._counts = synth.record["histogram"][0].copy()

    def read(self) -> Reading:
        meters = self.synth.meters()
        self.worst = max(self.worst, meters.worst)
        counts = self.synth.record["histogram"][0].copy()
        since, self._counts = counts - self._counts, counts
        return Reading(meters, median_load(since))


def median_load(counts: np.ndarray) -> float:
    """The load that half of the blocks stay below, from a histogram with 4 bins an octave, bin 32 from 1 on."""
    total = int(counts.sum())
    if not total:
        return 0.0
    k = int(np.searchsorted(np.cumsum(counts), 0.5 * total))
    return float(2.0 ** ((k - 31.5) / 4.0))


def strings(synth: Synth) -> str:
    """`E0 A3* D- G-`: the fret of each string that sounds, with a star where it has touched a fret since the pluck."""
    bass = synth.bass
    if bass is None:
        return ""
    return " ".join(
        f"{name}{fret}{'*' * touching}" if sounding else f"{name}-" for name, fret, sounding, touching in bass.fingers()
    )


def decibels(peak: float) -> float:
    """Of full scale, not below `QUIETEST`."""
    return max(QUIETEST, 20.0 * math.log10(peak)) if peak > 0.0 else QUIETEST
