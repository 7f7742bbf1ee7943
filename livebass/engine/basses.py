"""Plays several basses in turn as one: program changes of a score choose them."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from concurrent.futures import ThreadPoolExecutor
from dataclasses import astuple, dataclass

import numpy as np
from numpy.typing import NDArray

from livebass.engine.engine import Block, Engine, Playing, Report, mix_strings, single
from livebass.kernels.player.performer import FADE, OVER
from livebass.kernels.player.words import row_of
from livebass.kernels.score.memory import PROGRAM
from livebass.model.instrument import Instrument


@dataclass
class _Member:
    """A bass that plays or rings out."""

    engine: Engine
    began: int  # frame
    fades: int | None = None  # from this frame on; None: never
    level: float = 0.0  # of its last sample


class Basses(Playing):
    """Plays on `first` until a program change among the messages chooses another bass.

    The new bass begins at the frame of the program change, in its initial state but with the current controllers. The
    old bass starts no more notes and rings out, each string until the new bass plays it; another program change fades
    it out. `livebass play` and plugins do the same, but the new bass begins once it is prepared.
    """

    def __init__(self, first: Engine, basses: Mapping[int, Instrument]) -> None:
        """`basses` by program, from 0; other programs change nothing. [main thread]

        `strings` is the largest number of strings of any bass; a smaller bass uses the first ones. Raises ValueError
        for a bass that cannot play at the rate of `first`.
        """
        self.rate, self.workers, self.frame = first.rate, first.workers, 0
        self.strings = max([first.strings, *(len(bass.strings) for bass in basses.values())])
        self._seed, self._basses = first.seed, basses
        self._prepared = {id(first.instrument): first}
        for bass in basses.values():
            if id(bass) not in self._prepared:
                self._prepared[id(bass)] = Engine(bass, first.quality, first.rate, first.seed, first.workers)
        self._members = [_Member(first, 0)]  # the one that plays first
        self._ended: list[Report] = []

    def send_words(self, frames: NDArray[np.int64], words: NDArray[np.int64]) -> None:
        for k, (frame, word) in enumerate(zip(frames.tolist(), words.tolist(), strict=True)):
            kind, first, _ = row_of(word)
            if kind & 0xF0 == PROGRAM:
                self._change(frame, first)
                continue
            member, *before = self._members
            received = member.engine.play_words(frames[k : k + 1] - member.began, words[k : k + 1])
            for other in before:
                other.engine.ring_on(frame - other.began, word, member.engine, received)

    def _change(self, frame: int, program: int) -> None:
        """Starts the bass of a program at `frame`, unless it is already playing or does not exist."""
        bass, member = self._basses.get(program), self._members[0]
        if bass is None or bass is member.engine.instrument:
            return
        new = self._prepared[id(bass)].another(self._seed)
        new.follow(member.engine)
        member.engine.close_floor(frame - member.began)
        for other in self._members[1:]:
            other.fades = frame if other.fades is None else other.fades
        self._members.insert(0, _Member(new, frame))

    def process(self, count: int, pool: ThreadPoolExecutor | None = None) -> NDArray[np.float64]:
        return self._process(count, lambda engine, n: (engine.process(n, pool), None))[0]

    def process_with_mix(self, count: int, pool: ThreadPoolExecutor | None = None) -> Block:
        def process(engine: Engine, n: int) -> Block:
            strings, mix = engine.process_with_mix(n, pool)
            return strings, mix_strings(single(strings)) if mix is None else mix

        return self._process(count, process)

    def _process(self, count: int, process: Callable[[Engine, int], Block]) -> Block:
        """Sums the results of `process` for each bass that plays or rings out, and the mixes, if any."""
        out, whole = np.zeros((self.strings, count)), int(FADE * self.rate)
        mix = np.zeros(count, np.float32)
        mixes = False
        self.floor = None
        for member in self._members:
            first = max(member.began - self.frame, 0)
            if first >= count:
                continue
            sound, own = process(member.engine, count - first)
            floor = member.engine.floor
            if member.fades is not None:
                since = np.arange(self.frame + first, self.frame + count) - member.fades
                shape = np.clip((whole - since) / whole, 0.0, 1.0)
                sound *= shape
                own = own if own is None else single(own * shape)
                floor = None if floor is None else floor * shape
            out[: len(sound), first:] += sound
            if floor is not None:
                self.floor = np.zeros(count) if self.floor is None else self.floor
                self.floor[first:] += floor
            if own is not None:
                mix[first:] += own
                mixes = True
            member.level = float(np.abs(sound[:, -1]).max())
        self.frame += count
        for member in self._members[1:]:
            faded = member.fades is not None and self.frame >= member.fades + whole
            if faded or not (member.engine.sounding() or member.engine.floor_open() or member.level > OVER):
                self._ended.append(member.engine.report())
                self._members.remove(member)
        return out, mix if mixes else None

    def sounding(self) -> bool:
        return any(member.engine.sounding() for member in self._members)

    def report(self) -> Report:
        reports = [*self._ended, *(member.engine.report() for member in self._members)]
        return Report(*(sum(counts) for counts in zip(*map(astuple, reports), strict=True)))
