"""Controls everything beside the synth: the score, learned controllers, the metronome, MIDI learn. [main thread]

A `Desk` owns the record that the audio thread works on (thread/desk.py), whatever the output and synth.
"""

from __future__ import annotations

import logging
from collections.abc import Iterable, Mapping
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from livebass.kernels.player.constants import CONTROLLERS
from livebass.live.parameters import NUMBERS, PARAMETERS
from livebass.live.thread.desk import BEAT, BY_SCORE, DESK, MOVED_BITS, load_desk
from livebass.live.thread.records import field_offset
from livebass.live.thread.ring import write_word
from livebass.rows.bounds import between, refusal
from livebass.rows.techniques import CHANNEL_MODES, RESERVED
from livebass.score.score import Score

LOG = logging.getLogger(__name__)
LEAD = 0.2  # s before a score begins
SHORTEST_LOOP = 0.1  # s
TEMPOS = (0.1, 4.0)  # parts of the score's own tempo
BEATS = (20.0, 400.0)  # of the metronome, per minute
FILE = -1.0  # beats of a metronome that clicks at those of the score
CLICK_LENGTH, CLICK_PITCH, CLICK_LEVEL, CLICK_DECAY = 0.03, 1500.0, 0.25, 0.006  # s, Hz, of full scale, s


class Desk:
    """The score, the learned controllers and the metronome beside a synth."""

    def __init__(self) -> None:
        self.record = np.zeros(1, DESK)
        self.record["speed"] = 1.0
        self.score: Score | None = None
        self.follows_transport = False
        self.beats = 0.0  # of the metronome, per minute; 0: off
        self.looped_last = (0.0, 0.0)  # s of the score; (0, 0): the whole
        self._arrays: list[np.ndarray] = []  # the record points to these

    @property
    def address(self) -> int:
        return int(self.record.ctypes.data)

    # ---- the score

    def load(self, score: Score) -> None:
        """Loads `score`, LEAD before its beginning; it starts once it is `rolling`. A desk has one score."""
        frames, words = score.words
        room = np.zeros(2 * len(words) + 1, np.int64)
        self._arrays += [frames, words, room]
        self.score = score
        self.record["position"] = -LEAD * score.rate
        program = -1 if score.program is None else score.program
        addresses = [each.ctypes.data for each in (frames, words, room)]
        load_desk(self.address, addresses[0], addresses[1], len(words), addresses[2], program, score.rate)

    def _write(self, field: str, value: int) -> None:
        write_word(self.address + field_offset(DESK, field), value)

    @property
    def position(self) -> float:
        """Time of the score, s; below 0 before it begins."""
        return float(self.record["position"][0]) / self.score.rate if self.score else 0.0

    @property
    def length(self) -> float:
        """Length of the score, s; of the whole file, if it comes from a file."""
        return max(self.score.end_frame, self.score.file_end) / self.score.rate if self.score else 0.0

    @property
    def rolling(self) -> bool:
        """True while the score runs; with JACK's transport, while the transport does."""
        return bool(self.record["running" if self.follows_transport else "rolling"][0])

    @rolling.setter
    def rolling(self, value: bool) -> None:
        self._write("rolling", int(value))

    def seek(self, seconds: float) -> None:
        """Moves to a time of the score."""
        if self.score:
            self.record["seek"] = round(min(max(seconds, -LEAD), self.length) * self.score.rate)
            self._write("seek_count", int(self.record["seek_count"][0]) + 1)

    @property
    def tempo(self) -> float:
        """Playing speed, as a part of the score's own tempo."""
        return float(self.record["speed"][0])

    @tempo.setter
    def tempo(self, value: float) -> None:
        self.record["speed"] = min(max(value, TEMPOS[0]), TEMPOS[1])

    @property
    def loop(self) -> tuple[float, float] | None:
        """The repeated part of the score, s from its beginning."""
        return self.looped_last if self.record["loop_to"][0] else None

    @loop.setter
    def loop(self, part: tuple[float, float] | None) -> None:
        """Repeats a `part`, (0, 0) the whole; None ends the loop, and the score goes on.

        A score that has not begun, or is past the part, goes to its beginning.

        Raises ValueError for a part that is too short or outside the score.
        """
        self.record["loop_to"] = 0.0
        if part is None or self.score is None:
            return
        begin, end = part if part[1] else (part[0], self.length)
        end = min(end, self.length)
        if not 0 <= begin <= end - SHORTEST_LOOP:
            rule = f"a part of {SHORTEST_LOOP:g} s or more within the {self.length:.1f} s of the file"
            raise refusal("loop", rule, f"{begin:g} to {end:g} s")
        self.looped_last = begin, end
        self.record["loop_from"] = round(begin * self.score.rate)
        self.record["loop_to"] = round(end * self.score.rate)
        if self.position >= end or (self.position < 0 < begin):
            self.seek(begin)

    # ---- controllers

    @property
    def learned(self) -> dict[str, int]:
        """The learned controllers, by parameter symbol."""
        numbers = self.record["learned"][0]
        return {PARAMETERS[int(numbers[c]) - 1].symbol: c for c in np.flatnonzero(numbers).tolist()}

    def learn(self, symbol: str, controller: int | None) -> None:
        """Assigns a `controller`, or None, to the parameter `symbol`; ends earlier assignments of either."""
        number, learned = NUMBERS[symbol] + 1, self.record["learned"][0]
        learned[learned == number] = 0
        if controller is not None:
            learned[controller] = number

    @property
    def moved(self) -> tuple[int, int]:
        """The number of controller moves so far, and the last one's number."""
        word = int(self.record["moved"][0])
        return word >> 2 * MOVED_BITS, word >> MOVED_BITS & (1 << MOVED_BITS) - 1

    # ---- the metronome

    def click(self, beats: float, rate: int, frame: int) -> None:
        """Clicks `beats` times a minute from `frame` of the synth, which runs at `rate` Hz; 0: off, FILE: the score."""
        self.record["click_period"] = 0.0
        self.beats = beats
        if not beats:
            return
        if self.record["click_frames"][0] != round(CLICK_LENGTH * rate):
            sound = click_sound(rate)
            self._arrays.append(sound)
            self.record["click_frames"] = 0
            self.record["click"] = sound.ctypes.data
            self.record["click_frames"] = len(sound)
        by_score = beats == FILE
        self.record["click_start"], self.record["click_level"] = -rate if by_score else frame, 1.0
        self.record["click_period"] = BY_SCORE if by_score else 60.0 / beats * rate


def with_beats(score: Score, count_in: bool) -> Score:
    """The score with messages for the metronome at its beats; `count_in` puts a bar of beats before it.

    Before an upbeat, which is shorter than the next bar, only the rest of that bar is counted.
    """
    bars = [frame for frame, begins in score.beats if begins]
    first, second, third, *_ = *bars, score.file_end, score.file_end
    upbeat = len(bars) > 1 and second - first < third - second
    begin, later = (second, third - second - (second - first)) if upbeat else (first, second - first)
    later = later if count_in else 0
    before = [(frame - begin, begins) for frame, begins in score.beats if 0 <= frame - begin < later]
    beats = before + [(frame + later, begins) for frame, begins in score.beats]
    frames = np.concatenate([[frame for frame, _ in beats], score.frames + later]).astype(np.int64)
    rows = np.array([(BEAT, begins, 0) for _, begins in beats], np.uint8)
    order = np.argsort(frames, kind="stable")
    messages = np.concatenate([rows, score.messages])[order]
    strokes = tuple((row[0] + later, *row[1:]) for row in score.strokes)
    end, file_end = score.end_frame + later, score.file_end + later
    return replace(
        score, frames=frames[order], messages=messages, end_frame=end, file_end=file_end, strokes=strokes
    )  # fmt: skip


def click_sound(rate: int) -> NDArray[np.float32]:
    """One click of the metronome, (n,)."""
    time = np.arange(round(CLICK_LENGTH * rate)) / rate
    sound = CLICK_LEVEL * np.sin(2 * np.pi * CLICK_PITCH * time) * np.exp(-time / CLICK_DECAY)
    return np.ascontiguousarray(sound, np.float32)


def check_controllers(controllers: Mapping[str, object]) -> dict[str, int]:
    """The controllers by parameter, each from 0 to 119 and none of RPN. Raises ValueError for others."""
    checked: dict[str, int] = {}
    for symbol, controller in controllers.items():
        if symbol not in NUMBERS:
            raise ValueError(f"{symbol!r}: there is no such parameter; there is {', '.join(NUMBERS)}")
        if not isinstance(controller, int) or isinstance(controller, bool) or not 0 <= controller < CHANNEL_MODES:
            raise refusal(f"controller of {symbol}", between(0, CHANNEL_MODES - 1), repr(controller))
        if controller in RESERVED:
            raise ValueError(f"{symbol}: controller {controller} sets the range of the pitch bend (RPN), and only that")
        if controller in checked.values():
            raise ValueError(f"{symbol}: controller {controller} moves another parameter already")
        checked[symbol] = controller
    assert all(controller < CONTROLLERS for controller in checked.values())
    return checked


class MidiLearn:
    """Waits for a control to move, and assigns it to a parameter.

    The parameters that were `requested` come first; `next_parameter` steps through all.
    """

    def __init__(self, desk: Desk, requested: Iterable[str] = ()) -> None:
        self.desk = desk
        self._requested = list(requested)
        self._symbol: str | None = None  # the parameter that waits for a control
        self._seen = 0
        if self._requested:
            self._wait_for(self._requested.pop(0))

    def next_parameter(self) -> None:
        """Waits for a control for the next parameter, initially the first; stops after the last."""
        symbols = list(NUMBERS)
        place = symbols.index(self._symbol) + 1 if self._symbol else 0
        self._wait_for(symbols[place] if place < len(symbols) else None)

    def _wait_for(self, symbol: str | None) -> None:
        self._symbol, self._seen = symbol, self.desk.moved[0]
        if symbol is None:
            LOG.info("MIDI learn has ended")
        else:
            LOG.info("MIDI learn: move a control for %s", PARAMETERS[NUMBERS[symbol]].name.lower())

    def turn(self) -> None:
        """Checks whether a control has moved."""
        count, controller = self.desk.moved
        if self._symbol is None or count == self._seen:
            return
        if controller >= CHANNEL_MODES or controller in RESERVED:
            self._seen = count
            return
        self.desk.learn(self._symbol, controller)
        LOG.info("controller %d now moves %s", controller, PARAMETERS[NUMBERS[self._symbol]].name.lower())
        self._symbol = None
        if self._requested:
            self._wait_for(self._requested.pop(0))
