"""The synth: plays a bass from MIDI messages on the audio thread; Python controls and meters it. [main thread]

`Synth` owns the audio thread's record, the rings of messages and the recorder's ring of sound. Its basses are
`LiveBass`es; one may fade out while the next one plays. `Gauge` makes the meters readable.
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

from livebass.engine.engine import Engine
from livebass.kernels.bass.records import WORD
from livebass.kernels.player.performer import ANY, CHANNEL
from livebass.kernels.player.words import Row
from livebass.live.desk import Desk
from livebass.live.priority import make_realtime
from livebass.live.thread import ahead, arrival, block, helpers, setup
from livebass.live.thread.desk import take_controller
from livebass.live.thread.records import MAX_HELPERS, RINGS, STOP, SYNTH, field_offset
from livebass.live.thread.ring import (
    DATA,
    ENTRY,
    NOW,
    new_message_ring,
    new_sound_ring,
    pop_messages,
    pop_sound,
    push_event,
    push_message,
    read_word,
    write_word,
)
from livebass.model.instrument import Instrument
from livebass.model.quality import Quality
from livebass.rows.techniques import EFFECT, FUNCTION_ROWS, PARAMETER, PARAMETER_ROWS, SETTING, SWITCHED, event
from livebass.rows.units import note_name

COARSE = Quality("coarse", 150, 192e3, on_board=Quality("coarse", 250, 384e3))  # for strings under overload
RING = 4096  # messages
CAPTURE_SECONDS = 20.0
RECENT = 0.2  # s of sound that `recent` keeps
QUIETEST = -99.0  # dB
CELLS, METER = 12, 60.0  # of the peak bar: characters, dB from its empty end to full scale
FIELDS = {row.number: row.field for row in FUNCTION_ROWS.values() if row.field}  # of the performer's controls
KEPT = (
    "program", "program_count", "blocks", "messages", "late", "underruns", "clipped", "faults", "capture_lost",
    "parameters", "effects",
)  # fmt: skip
COUNTS = ("frame", "blocks", "late", "underruns", "messages", "faults", "overload", "clipped")  # counts of `Meters`
PAGE = 4096  # bytes, no more than any system's


@dataclass(frozen=True)
class Meters:
    """Counters of the audio thread. Loads are relative to a block's duration, without running ahead."""

    frame: int  # the next to compute
    blocks: int
    late: int  # blocks that took longer than their duration
    underruns: int  # reported by the driver
    messages: int
    worst: float  # load since the last reading
    peak: float  # since the last reading; 1 is full scale
    faults: int  # frames of a string that were NaN or far too large, played as silence
    overload: int  # strings on coarse operators
    lost: int  # frames that the recorder lost
    clipped: int  # frames above full scale


def touch(array: NDArray[Any]) -> None:
    """Writes to every page without changing values, so the audio thread is not the first to touch it."""
    memory = array.reshape(-1).view(np.uint8)
    memory[::PAGE] += 0
    memory[-1:] += 0


class _AheadEngine(Engine):
    """An engine whose strings can run ahead of the clock, and continue in the coarse quality."""

    coarse = COARSE
    contacts, events = 512, 256
    takes_values = False

    @property
    def play_string(self) -> int:  # type: ignore[override]
        return ahead.play_string.address


class LiveBass:
    """An instrument prepared for the audio thread. Raises ValueError for one that `Engine` cannot play. [any thread]"""

    def __init__(self, instrument: Instrument, quality: Quality, rate: int, seed: int = 0) -> None:
        self.engine = _AheadEngine(instrument, quality, rate, seed)
        self.memory, self.record = self.engine.bass.memory, self.engine.bass.record
        self._share = float(self.record["share"][0])
        self.record["frame"] = -1  # until it begins

    @property
    def address(self) -> int:
        return self.engine.bass.address

    def run_ahead(self, wanted: bool) -> None:
        """Lets strings run ahead of the clock, or not."""
        self.record["share"] = self._share if wanted else 0.0

    @property
    def began(self) -> int | None:
        """The synth's frame at which it began; None: it has not begun."""
        frame = int(self.record["frame"][0])
        return None if frame < 0 else frame

    @property
    def dropped(self) -> int:
        """Number of notes so far that no string could play."""
        return int(self.engine.performer["dropped"][0])

    @property
    def coarse_strings(self) -> list[int]:
        """The strings that overload has moved to the coarse operators, by index."""
        return [i for i in range(self.engine.strings) if int(self.record["coarse"][0]) >> i & 1]

    def fingers(self) -> list[tuple[str, int, bool, bool]]:
        """(string, fret, sounding, has touched a fret since the pluck) for each string."""
        p = self.engine.performer[0]
        out = []
        for i, (string, v) in enumerate(zip(self.engine.instrument.strings, self.engine.voices, strict=True)):
            slot = v.slots[int(v.record["slot"][0])]
            out.append((string.name, int(p["hands"]["fret"][i]), bool(slot["on"]), bool(slot["touching"])))
        return out


class Synth:
    """Plays one bass at `rate` Hz, on MIDI `channel` (0-15; -1: all), with a linear `gain`.

    With `adaptive`, overload moves strings to coarse operators for a while. Controllers learned by `desk` move
    parameters.
    """

    def __init__(
        self, rate: int, channel: int = -1, gain: float = 1.0, adaptive: bool = True, desk: Desk | None = None
    ) -> None:
        self.rate, self.desk = rate, desk
        self._gain_db = decibels(gain)
        self._values: dict[str, float] = {}  # of the present bass's parameters, by symbol
        self.record = np.zeros(1, SYNTH)
        rings = np.zeros((RINGS, setup.ring_bytes(RING) // RINGS // WORD), np.int64)
        setup.fill_synth(self.address, rings.ctypes.data, RING, rate, channel, gain, block.process.address)
        self.rings = [ring[: DATA + ENTRY * RING] for ring in rings]
        self._capture = np.zeros(0, np.int64)  # the recorder's ring of sound
        self._played = np.zeros(0, np.int64)  # the ring of played messages
        self.recent = np.zeros(0, np.float32)  # the latest sound returned by `recorded`, up to RECENT
        self._runs_ahead = True
        self._writer = threading.Lock()  # guards the first ring between Python's threads
        self._helpers: list[threading.Thread] = []
        self._cores: int | None = None  # requested during play
        self._basses: list[LiveBass] = []
        self._dropped = 0  # by released basses
        r = self.record
        r["adaptive"] = adaptive
        r["clock"], r["clock_id"] = _clock()
        r["work_clock_id"] = r["clock_id"]

    @property
    def address(self) -> int:
        return int(self.record.ctypes.data)

    def start_helpers(self, count: int) -> str | None:
        """Starts up to MAX_HELPERS threads that play strings beside the audio thread; returns why they have no
        real-time priority, or None.

        They look for work until `stop_helpers`. None start on systems without `usleep`. [main thread]
        """
        usleep = c_function("usleep")
        for _ in range(min(count, MAX_HELPERS) if usleep else 0):
            thread = threading.Thread(
                target=helpers.help_out, args=(self.address, usleep), daemon=True, name="livebass helper"
            )
            self._helpers.append(thread)
            thread.start()
        refused = [make_realtime(thread.native_id or 0) for thread in self._helpers]
        return next((why for why in refused if why), None)

    def stop_helpers(self) -> None:
        """Ends the helper threads after their current work. [any thread]"""
        write_word(self.address + STOP, 1)
        for thread in self._helpers:
            thread.join()
        self._helpers.clear()
        write_word(self.address + STOP, 0)

    @property
    def cores(self) -> int:
        """Number of threads that play strings, audio thread included."""
        return 1 + len(self._helpers)

    def ask_for_cores(self, count: int) -> None:
        """Requests `count` cores; `follow_cores` carries it out. [any thread]"""
        self._cores = count

    def follow_cores(self) -> None:
        """Starts or ends helper threads, if a new number was requested. [main thread]"""
        cores, self._cores = self._cores, None
        if cores not in (None, self.cores):
            self.stop_helpers()
            self.start_helpers(cores - 1)

    @property
    def helped(self) -> int:
        """The number of times a helper thread has played a string for the audio thread."""
        return int(self.record["team"]["helped"][0])

    @property
    def frame(self) -> int:
        """The next frame to compute."""
        return int(self.record["frame"][0])

    @property
    def program(self) -> tuple[int, int]:
        """The number of program changes so far, and the last program, 0 to 127."""
        return int(self.record["program_count"][0]), int(self.record["program"][0])

    def _read(self, field: str) -> int:
        return int(read_word(self.address + field_offset(SYNTH, field)))

    def _write(self, field: str, value: int) -> None:
        write_word(self.address + field_offset(SYNTH, field), value)

    def switch_to(self, bass: LiveBass) -> None:
        """Plays `bass` from the next block on; the previous one starts no more notes and rings out.

        Waits while a bass that is already ringing out fades to make room.
        """
        self.release_faded()
        while self._read("next_bass") or self._read("faded_bass"):
            time.sleep(0.005)
            self.release_faded()
        self._basses.append(bass)
        bass.run_ahead(self._runs_ahead)
        self._write("next_bass", bass.address)
        self._play_by(dict(bass.engine.instrument.played))

    def _play_by(self, values: dict[str, float]) -> None:
        """Sets the values of the parameters that play a bass; those of the bass before become 0 again."""
        for symbol in {**self._values, **values}:
            kind, number = event(PARAMETER_ROWS[symbol]) or (0, 0)
            value = values.get(symbol, 0.0) + (self._gain_db if symbol == "gain" else 0.0)
            self.set_value(kind, number, value)
        self._values = values

    @property
    def switching(self) -> bool:
        """True while `switch_to` would wait."""
        return any(self.record[name][0] for name in ("next_bass", "faded_bass"))

    @property
    def ringing(self) -> bool:
        """True from `switch_to` until the previous bass has rung out and is released."""
        return self.switching or bool(self.record["old_bass"][0])

    def release_faded(self) -> None:
        """Releases a bass that has rung out; call it now and then."""
        faded = self._read("faded_bass")
        if faded:
            self._dropped += sum(b.dropped for b in self._basses if b.address == faded)
            self._basses = [b for b in self._basses if b.address != faded]
            self._write("faded_bass", 0)

    @property
    def dropped(self) -> int:
        """Number of notes so far that no string could play."""
        return self._dropped + sum(bass.dropped for bass in self._basses)

    @property
    def bass(self) -> LiveBass | None:
        """The bass of the last `switch_to`."""
        return self._basses[-1] if self._basses else None

    def send(self, status: int, first: int = 0, second: int = 0, frame: int = NOW) -> bool:
        """Sends a MIDI message to play at `frame`, or at once; False if the ring is full. [any thread]"""
        with self._writer:
            return bool(push_message(self.rings[0].ctypes.data, RING, frame, status, first, second))

    def receive(self, status: int, first: int = 0, second: int = 0, frame: int = NOW) -> bool:
        """Sends a message from a MIDI port, unless it is for another channel than the synth's. [any thread]

        A learned controller moves its parameter instead.
        """
        channel = int(self.record["channel"][0])
        if channel >= 0 and status & 0x0F != channel:
            return True
        if self.desk is not None and status & 0xF0 == 0xB0:
            with self._writer:
                ring = self.rings[0].ctypes.data
                if take_controller(self.desk.address, ring, RING, frame, status & 0x0F, first, second):
                    return True
        return self.send(status, first, second, frame)

    def set_value(self, kind: int, number: int, value: float, frame: int = NOW) -> bool:
        """Sets a parameter, amount or knob of the effects (`parameters.event`) from a frame on. [any thread]

        False if the ring is full.
        """
        with self._writer:
            return bool(push_event(self.rings[0].ctypes.data, RING, frame, kind, number, value))

    def value(self, kind: int, number: int) -> float:
        """The last value set by `set_value` or a controller; 0: the bass's own. [any thread]"""
        if kind in (PARAMETER, EFFECT):
            return float(self.record["effects" if kind == EFFECT else "parameters"][0, number])
        if self.bass is None:
            return 0.0
        controls = self.bass.engine.performer["controls"][0]
        if kind in (SWITCHED, SETTING):
            return float(controls["latched" if kind == SWITCHED else "settings"][number])
        field = FIELDS[number]
        return float(controls["channel"][ANY][field] if field in (CHANNEL.names or ()) else controls[field])

    @property
    def runs_ahead(self) -> bool:
        """True if strings may run ahead of the clock, in every bass."""
        return self._runs_ahead

    @runs_ahead.setter
    def runs_ahead(self, wanted: bool) -> None:
        self._runs_ahead = wanted
        for bass in self._basses:
            bass.run_ahead(wanted)

    def frame_now(self, delay: int) -> int:
        """Returns the frame for a message that arrives now, `delay` frames late: the same delay for all messages.

        After a stall of the sound it is a frame of the block after the next: a stall delays no later note.
        """
        return int(arrival.arrival(self.address, delay))

    def take_over(self, old: Synth) -> None:
        """Continues `old` at this synth's rate, with its time, counts and parameters. Call before it plays."""
        self.record["frame"] = round(old.frame * self.rate / old.rate)
        self._dropped = old.dropped
        for name in KEPT:
            self.record[name] = old.record[name]

    def panic(self) -> None:
        """Cuts off all sound and resets the controllers."""
        self._write("panic", 1)

    def start_recording(self) -> None:
        """Keeps the sound from the next block on, for `recorded`, up to CAPTURE_SECONDS."""
        size = int(CAPTURE_SECONDS * self.rate)
        self._capture = new_sound_ring(size)
        touch(self._capture)
        self.record["capture_size"] = size
        self._write("capture_ring", self._capture.ctypes.data)

    def recorded(self) -> NDArray[np.float32]:
        """Returns the sound since the last call, (n,)."""
        sound = pop_sound(self._capture, int(self.record["capture_size"][0]))
        self.recent = np.concatenate([self.recent, sound])[-round(RECENT * self.rate) :]
        return sound

    def keep_messages(self) -> None:
        """Keeps the messages played from the next block on, for `played`, up to RING."""
        self._played = new_message_ring(RING)
        touch(self._played)
        self.record["played_size"] = RING
        self._write("played_ring", self._played.ctypes.data)

    def played(self) -> list[Row]:
        """Returns the messages and the strokes played since the last call."""
        return pop_messages(self._played) if self._played.size else []

    def meters(self) -> Meters:
        """Returns the counters; resets `worst` and `peak`."""
        r = self.record[0]
        counts = {name: int(r[name]) for name in COUNTS}
        meters = Meters(**counts, worst=float(r["load_worst"]), peak=float(r["peak"]), lost=int(r["capture_lost"]))
        r["load_worst"], r["peak"] = 0.0, 0.0
        return meters

    def load_histogram(self) -> NDArray[np.int64]:
        """Returns a copy of the block counts by load: 4 bins an octave; bin 32 begins at load 1."""
        return self.record["histogram"][0].copy()


def _clock() -> tuple[int, int]:
    """The address of clock_gettime and the number of the monotonic clock; zeros on systems without."""
    function = c_function("clock_gettime")
    return (function, time.CLOCK_MONOTONIC) if function else (0, 0)


def c_function(name: str) -> int:
    """The address of a function of the C library; 0 on systems without."""
    try:
        return int(ctypes.cast(getattr(ctypes.CDLL(None), name), ctypes.c_void_p).value or 0)
    except (AttributeError, OSError, TypeError):
        return 0


@dataclass(frozen=True)
class Reading:
    """The meters since the last reading, and the median load of the blocks since (0: no block)."""

    meters: Meters
    median: float

    @property
    def troubles(self) -> tuple[int, int, int, int]:
        """Underruns, coarse strings, faults and unrecorded frames: logged when they change."""
        m = self.meters
        return m.underruns, m.overload, m.faults, m.lost

    def text(self) -> str:
        """One line: load, trouble if any, level."""
        return f"{self.load_text()}, {level_text(self.meters.peak)}"

    def meter(self) -> str:
        """The peak since the last reading, as a bar of CELLS characters over METER dB and in dBFS."""
        peak = self.meters.peak
        cells = math.ceil(CELLS * (1 + decibels(peak) / METER))
        return f"[{'#' * min(max(cells, 0), CELLS):{CELLS}}] {level_text(peak):>8}"

    def load_text(self) -> str:
        """One line: load, and trouble if any."""
        m = self.meters
        parts = [f"load {self.median:.0%} (worst {m.worst:.0%})"]
        if m.overload:
            parts.append(f"OVERLOAD: {m.overload} string{'s' * (m.overload > 1)} coarse")
        parts.append(f"underruns {m.underruns}")
        if m.clipped:
            parts.append(f"clipped {m.clipped}")
        if m.faults:
            parts.append(f"faults {m.faults}")
        if m.lost:
            parts.append(f"{m.lost} frames not recorded")
        return ", ".join(parts)


def level_text(peak: float) -> str:
    """A peak in dBFS; 1 is full scale."""
    found = decibels(peak)
    return f"{found:.0f} dBFS" if found > QUIETEST else "silent"


class Gauge:
    """Reads the meters of `synth` and keeps the worst load."""

    def __init__(self, synth: Synth) -> None:
        self.synth = synth
        self.worst = 0.0  # load of a block so far
        self.peak = 0.0  # so far; 1 is full scale
        self._counts = synth.load_histogram()

    def follow(self, synth: Synth) -> None:
        """Switches to another synth, which goes on where the previous one ended."""
        self.synth, self._counts = synth, synth.load_histogram()

    def read(self) -> Reading:
        meters = self.synth.meters()
        self.worst, self.peak = max(self.worst, meters.worst), max(self.peak, meters.peak)
        counts = self.synth.load_histogram()
        since, self._counts = counts - self._counts, counts
        return Reading(meters, median_load(since))


def median_load(counts: np.ndarray) -> float:
    """Returns the median load of the blocks, from a `load_histogram`."""
    total = int(counts.sum())
    if not total:
        return 0.0
    k = int(np.searchsorted(np.cumsum(counts), 0.5 * total))
    return float(2.0 ** ((k - 31.5) / 4.0))


def strings(synth: Synth) -> str:
    """`A2(G:2*) D3(A:5)`: note, string and fret of each sounding string.

    A star: it has touched a fret since the pluck.
    """
    bass = synth.bass
    if bass is None:
        return ""
    return " ".join(
        f"{note_name(string.open_note + fret)}({name}:{fret}{'*' * touching})"
        for string, (name, fret, sounding, touching) in zip(bass.engine.instrument.strings, bass.fingers(), strict=True)
        if sounding
    )


def decibels(peak: float) -> float:
    """`peak` in dB of full scale, at least QUIETEST."""
    return max(QUIETEST, 20.0 * math.log10(peak)) if peak > 0.0 else QUIETEST
