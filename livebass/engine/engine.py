"""A bass as an object: MIDI messages in, one signal per string out. Files and the live synth both use it."""

from __future__ import annotations

import copy
import time
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from livebass.engine import prepare
from livebass.engine.image import image
from livebass.kernels.bass.floor import add_floor
from livebass.kernels.bass.instrument import COARSE, LIVE
from livebass.kernels.effects.chain import add_effects, still_ring
from livebass.kernels.machine.samples import add_sound, scale_sound
from livebass.kernels.player import controls, messages, performer
from livebass.kernels.player.words import row_of
from livebass.kernels.score.lines import LONGEST
from livebass.kernels.string.records import EVENT
from livebass.model.instrument import Effects, Instrument
from livebass.model.quality import Quality
from livebass.rows.bounds import within
from livebass.rows.techniques import PARAMETER_ROWS, event
from livebass.score.score import Score, checked_rate, packed
from livebass.system.cores import core_count

CHUNK = 1.0  # s computed at once
SILENCE = 10 ** (-80 / 20)  # full scale: the tail ends after QUIET_FOR with no string louder
QUIET_FOR = 0.3  # s
LONGEST_TAIL = 12.0  # s
FADE = 0.02  # s, at a cut tail


Block = tuple[NDArray[np.float64], NDArray[np.float32] | None]  # of each string, and the mix behind the effects
Process = Callable[[int, ThreadPoolExecutor | None], Block]


@dataclass(frozen=True)
class Report:
    """Counts of notes so far."""

    notes: int
    transposed: int  #: moved by octaves into the range
    dropped: int  #: that the instrument could not play
    stolen: int  #: that lost their string while sounding
    weakened: int  #: number of times a motion was scaled down to a string's limit: 0 unless something is wrong


class Playing(ABC):
    """Plays messages, and so a score, into one signal per string."""

    rate: int  # Hz
    workers: int  # threads
    strings: int
    frame: int  # the next to be computed
    floor: NDArray[np.float64] | None = None  # (count,): in the last block; None: the bass has none

    def send(self, frames: NDArray[np.int64], messages: NDArray[np.uint8]) -> None:
        """Takes channel messages. Call it from one thread at a time.

        Args:
            frames: Frame of each message from the start, (n,), in order, none before `frame`.
            messages: Status and two data bytes of each, (n, 3).
        """
        self.send_words(frames, packed(messages))

    @abstractmethod
    def send_words(self, frames: NDArray[np.int64], words: NDArray[np.int64]) -> None:
        """Takes messages and other events as words (kernels/player/words.py), (n,), like `send`."""

    @abstractmethod
    def process(self, count: int, pool: ThreadPoolExecutor | None = None) -> NDArray[np.float64]:
        """Computes the next frames of every string. Call it from one thread at a time.

        Args:
            count: Number of frames.
            pool: Threads that compute the strings in parallel; by default this one computes them all.

        Returns:
            float64 of shape (strings, count), full scale 1.
        """

    @abstractmethod
    def process_with_mix(self, count: int, pool: ThreadPoolExecutor | None = None) -> Block:
        """As `process`, and the mix behind the effects, (count,); None: there are no effects. [one thread at a time]"""

    @abstractmethod
    def sounding(self) -> bool:
        """True if any string still moves, or effects still sound; a floor does not count."""

    @abstractmethod
    def report(self) -> Report:
        """Returns the counts so far."""

    def play(self, score: Score, tail: float | None = None) -> Iterator[NDArray[np.float64]]:
        """Renders a score from here on, without effects, in blocks, until the last note has died away.

        The score's frame 0 is the `frame` at the request for the first block; sounding notes go on.

        Args:
            score: The notes.
            tail: Seconds to play after the score's end; by default until silent, at most 12.

        Yields:
            Blocks, float64 of shape (strings, n), full scale 1.

        Raises:
            ValueError: A score at another rate, or a tail that is not a time.
        """
        self._check(score, tail)
        return (strings for strings, _ in self._play(score, tail, lambda *given: (self.process(*given), None)))

    def play_with_mix(self, score: Score, tail: float | None = None) -> Iterator[Block]:
        """As `play`, and the mix behind the effects, (n,), of each block; None: there are no effects."""
        self._check(score, tail)
        return self._play(score, tail, self.process_with_mix)

    def _check(self, score: Score, tail: float | None) -> None:
        """Raises ValueError for invalid arguments of `play`."""
        if score.rate != self.rate:
            raise ValueError(f"the score is in frames of {score.rate} Hz, the engine in {self.rate} Hz: take the same")
        check_tail(tail)

    def _play(self, score: Score, tail: float | None, process: Process) -> Iterator[Block]:
        """Yields block after block, and computes the next one while the caller uses the last.

        A caller that breaks off waits for the block in progress.
        """
        chunk = max(1, int(CHUNK * self.rate))
        longest = LONGEST_TAIL if tail is None else tail
        frames, words = score.words
        frames, end = frames + self.frame, score.end_frame + self.frame
        last = end + int(longest * self.rate)
        sent = 0

        def compute() -> tuple[int, Block]:
            nonlocal sent
            first, count = self.frame, min(chunk, last - self.frame)
            until = int(np.searchsorted(frames, self.frame + count))
            self.send_words(frames[sent:until], words[sent:until])
            sent = until
            return first, process(count, pool)

        with ThreadPoolExecutor(self.workers) as pool, ThreadPoolExecutor(1) as ahead:
            following = ahead.submit(compute) if self.frame < last else None
            while following is not None:
                first, (block, mix) = following.result()
                ended = self.frame >= last
                if tail is None and first >= end and not ended:
                    level = self._loudness(block)
                    quiet = np.flatnonzero((level if mix is None else np.maximum(level, np.abs(mix))) > SILENCE)
                    keep = (int(quiet[-1]) + 1 if quiet.size else 0) + int(QUIET_FOR * self.rate)
                    if keep < block.shape[1] or not self.sounding():
                        block, ended = block[:, : min(keep, block.shape[1])], True
                        mix = mix if mix is None else mix[: block.shape[1]]
                if ended:
                    fade = min(block.shape[1], int(FADE * self.rate))
                    if fade:
                        shape = np.cos(0.5 * np.pi * (np.arange(fade) + 1) / fade) ** 2
                        block[:, -fade:] *= shape
                        if mix is not None:
                            mix[-fade:] = single(mix[-fade:] * shape)
                    rest = slice(sent, int(np.searchsorted(frames, self.frame, "right")))
                    self.send_words(frames[rest], words[rest])  # notes that end here do not last into the next play
                following = None if ended else ahead.submit(compute)
                yield block, mix

    def _loudness(self, block: NDArray[np.float64]) -> NDArray[np.float64]:
        """The loudest string, without the floor, in each frame of the last block: (n,)."""
        if self.floor is None:
            return np.asarray(np.abs(block).max(axis=0))
        strings = block.copy()
        strings[0] -= self.floor
        return np.asarray(np.abs(strings).max(axis=0))


class Engine(Playing):
    """A bass that plays at an audio rate.

    The same messages at the same frames give the same samples, in blocks of any sizes.

    Example:
        >>> from livebass import QUALITIES, load_preset
        >>> engine = Engine(load_preset("slap"), QUALITIES["live"], 48000)
        >>> engine.send(np.array([0]), np.array([[0x90, 28, 100]], np.uint8))  # the open E string
        >>> engine.process(64).shape, engine.sounding(), engine.frame
        ((4, 64), True, 64)
    """

    coarse: Quality | None = None  # for strings under overload
    play_string = 0  # address of the C function that runs strings ahead of the clock
    contacts, events = 0, 0  # how many each string keeps for inspection
    takes_values = True  # of the instrument's `played`; else its owner sends them

    def __init__(self, instrument: Instrument, quality: Quality, rate: int, seed: int = 0, workers: int | None = None):
        """Prepares all strings and frets. Call it in the main thread.

        Args:
            instrument: The bass.
            quality: One of `QUALITIES`, or from `quality_with`.
            rate: A whole number of Hz from 8000 to 192 000.
            seed: Chooses the small differences from note to note (`Player.unevenness`).
            workers: Threads that compute strings in parallel; by default one for each core that the process may use.
                There is at most one per string.

        Raises:
            ValueError: A rate out of these limits, or a neck that nobody could play.
        """
        checked_rate(rate)
        self.instrument, self.rate, self.strings = instrument, rate, len(instrument.strings)
        self.quality = quality = quality.for_contact(instrument.loss, instrument.over_board)
        coarse = self.coarse and self.coarse.for_contact(instrument.loss, instrument.over_board)
        self.rates = prepare.Rates(rate, prepare.whole_contact_rate(quality.contact_rate, rate))
        self.frets = instrument.frets
        self.image = image(instrument, quality, coarse)
        self.numbers = self.image.numbers
        self.pools = [self.image.pool(tier, rate) for tier in ([LIVE, COARSE] if coarse else [LIVE])]
        self.workers = workers or min(len(instrument.strings), core_count())
        self._begin(seed)

    def _begin(self, seed: int) -> None:
        """Makes everything that changes during play: strings at rest, and a player with that seed."""
        self.seed = seed
        self.bass = self.image.bass(LIVE, self.rate, seed, self.pools, self.play_string, self.contacts, self.events)
        self.voices, self.performer = self.bass.voices, self.bass.performer
        self.frame = 0
        self._pending: list[NDArray[np.void]] = [np.zeros(0, EVENT) for _ in self.voices]
        self._took = [0.0] * len(self.voices)  # s, each string in the last block
        if self.takes_values:
            self._take_values()

    def _take_values(self) -> None:
        """Begins with the values of the parameters that play the bass, as a host sets them at frame 0."""
        events = np.zeros(performer.MAX_EVENTS, EVENT)
        for symbol, value in self.instrument.played:
            kind, number = event(PARAMETER_ROWS[symbol]) or (0, 0)
            self.performer["out"] = 0, events.ctypes.data, 0
            controls.take_value(self.performer.ctypes.data, self.pool.records.ctypes.data, kind, number, value)
            self._take(events[: int(self.performer["out"]["count"][0])])

    @property
    def pool(self) -> prepare.Pool:
        """Its operators in the current quality."""
        return self.pools[0]

    def another(self, seed: int = 0) -> Self:
        """Returns a new engine of the same bass with its own `seed`. It is fast, as both share the operators.

        Each may play in a thread of its own. Call this in the main thread.
        """
        other = copy.copy(self)
        other._begin(seed)
        return other

    def send_words(self, frames: NDArray[np.int64], words: NDArray[np.int64]) -> None:
        self.play_words(frames, words)

    def play_messages(self, frames: NDArray[np.int64], messages: NDArray[np.uint8]) -> NDArray[np.void]:
        """Takes messages like `send`, and returns the resulting events (n,). [main thread]"""
        return self.play_words(frames, packed(messages))

    def play_words(self, frames: NDArray[np.int64], words: NDArray[np.int64]) -> NDArray[np.void]:
        """`play_messages` for words, as `send_words` takes them."""
        events = np.zeros(performer.MAX_EVENTS * max(1, len(frames)), EVENT)
        count = 0
        for frame, word in zip(frames.tolist(), words.tolist(), strict=True):
            count = prepare.take_message(self.performer, self.pool.records, frame, row_of(word), events, count)
        self._take(events[:count])
        return events[:count]

    def ring_on(self, frame: int, word: int, player: Engine, received: NDArray[np.void]) -> None:
        """Takes a word at `frame` that `player`, now playing, turned into the events `received`; starts no note."""
        p, events = self.performer, np.zeros(performer.MAX_EVENTS, EVENT)
        p["out"], player.performer["out"] = (frame, events.ctypes.data, 0), (frame, received.ctypes.data, len(received))
        places = (p.ctypes.data, self.pool.records.ctypes.data, player.performer.ctypes.data)
        messages.take_word_ringing(*places, word & (1 << 32) - 1, row_of(word)[2])
        self._take(events[: int(p["out"]["count"][0])])

    def follow(self, old: Engine) -> None:
        """Copies the controllers of `old` to this engine, which has not played."""
        prepare.follow_performer(self.voices, self.performer, old.performer)
        self._floor["gain_wanted"] = self.voices[0].record["gain_wanted"]

    def _take(self, events: NDArray[np.void]) -> None:
        """Adds events to the strings' pending ones."""
        for i in range(self.strings):
            self._pending[i] = np.concatenate([self._pending[i], events[events["string"] == i]])

    def process(self, count: int, pool: ThreadPoolExecutor | None = None) -> NDArray[np.float64]:
        out, used = np.zeros((self.strings, count)), [0] * self.strings

        def run(i: int) -> None:
            began = time.perf_counter()
            used[i] = self._run(i, out[i])
            self._took[i] = time.perf_counter() - began

        jobs = sorted(range(self.strings), key=lambda i: -self._took[i])  # in parallel, the longest first
        list(pool.map(run, jobs) if pool else map(run, jobs))
        if self._floor["level"][0] + self._floor["hum"][0] > 0:
            self.floor = self._add_floor(out, [self._pending[i][:n] for i, n in enumerate(used)])
        for i, n in enumerate(used):
            self._pending[i] = self._pending[i][n:]
        self.frame += count
        return out

    def process_with_mix(self, count: int, pool: ThreadPoolExecutor | None = None) -> Block:
        first = self.frame
        strings = self.process(count, pool)
        if self.instrument.effects == Effects():
            return strings, None
        mix = mix_strings(single(strings))
        add_effects(self.bass.effects, mix.ctypes.data, first, count)
        return strings, mix

    @property
    def _floor(self) -> NDArray[np.void]:
        """The FLOOR of the bass, (1,)."""
        return self.bass.record["floor"]

    def _add_floor(self, out: NDArray[np.float64], events: list[NDArray[np.void]]) -> NDArray[np.float64]:
        """Adds the floor to a block of the first string, and returns the floor; `events`: each string's, (n,)."""
        floor, received = np.zeros(out.shape[1]), np.concatenate(events)
        received = received[np.argsort(received["frame"], kind="stable")]
        sounds, made, taken = out.ctypes.data, floor.ctypes.data, received.ctypes.data
        add_floor(self.bass.address, sounds, self.strings, made, len(floor), taken, len(received))
        return floor

    def close_floor(self, frame: int) -> None:
        """Fades the floor from `frame` on for good, as another bass takes over. [main thread]"""
        self._floor["closes"] = frame

    def floor_open(self) -> bool:
        """True if the floor sounds or fades."""
        return bool(self._floor["left"][0] > 0)

    def _run(self, i: int, out: NDArray[np.float64]) -> int:
        events = self._pending[i]
        return prepare.play_frames(self.voices[i], self.pool.records[i], events, out)

    def sounding(self) -> bool:
        return any(v.sounding() for v in self.voices) or bool(still_ring(self.bass.effects))

    def report(self) -> Report:
        p = self.performer[0]
        weakened = sum(int(v.record["weakened"][0]) for v in self.voices)
        return Report(int(p["notes"]), int(p["transposed"]), int(p["dropped"]), int(p["stolen"]), weakened)


def check_tail(tail: float | None) -> None:
    """Raises ValueError for a `tail` that `Engine.play` does not accept."""
    if tail is not None:
        within("tail", tail, 0, LONGEST, "s")


def mix_strings(strings: NDArray[np.float32]) -> NDArray[np.float32]:
    """Sums (n_strings, n_frames) string after string in float32, (n_frames,): stems add up to the mix."""
    strings = np.ascontiguousarray(strings, np.float32)
    mix = strings[0].copy()
    for string in strings[1:]:
        add_sound(string.ctypes.data, mix.ctypes.data, len(mix))
    return mix


def single(sound: NDArray[np.float64]) -> NDArray[np.float32]:
    """Converts a sound to float32, with 0 for subnormal numbers, as in the audio thread."""
    return scaled(sound, 1.0)[0]


def scaled(sound: NDArray[Any], gain: float) -> tuple[NDArray[np.float32], bool]:
    """Converts a sound times `gain` like `single`; the second is False if the sound has NaN or infinity."""
    given, out = np.ascontiguousarray(sound, np.float64), np.zeros(sound.shape, np.float32)
    return out, not scale_sound(given.ctypes.data, gain, out.ctypes.data, out.size)
