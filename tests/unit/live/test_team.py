"""Sharing a job's strings between audio thread and helpers: each is played once, and none after the job.

The functions of helpers.py run as Python, one thread at a time. The thread may change at every access to shared words:
in all orders with up to CHANGES unforced changes, and in random orders. Then the compiled functions run in parallel,
with rests.
"""

from __future__ import annotations

import ctypes
import threading
import time
from collections import Counter
from collections.abc import Callable, Iterator
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from support.live import QUICK, synth_and_device

from livebass.kernels.player.performer import MAX_STRINGS
from livebass.live.thread import helpers
from livebass.live.thread.records import DONE, HELPED, HELPERS, JOB

AUDIO = 0  # number of the audio thread
JOBS = ((7, 64), (8, 128), (7, 192))  # bass and end of each
CHANGES = 2  # unforced changes of thread


class Stopped(Exception):
    """Ends a thread of an abandoned order."""


class Order:
    """Runs the audio thread and helpers through JOBS, one at a time, in one order of their accesses.

    `choose(enabled, running)` returns the next thread; `faults` collects the errors.
    """

    def __init__(self, strings: int, helping: int, choose: Callable[[list[int], int], int]) -> None:
        self.words = {JOB: 0, DONE: 0, HELPERS: helping, HELPED: 0}
        self.team: dict[str, int] = {}
        self.choose, self.strings, self.count = choose, strings, 1 + helping
        self.turns = [threading.Semaphore(0) for _ in range(self.count)]
        self.all_done = threading.Semaphore(0)
        self.seen: list[tuple[int, int] | None] = [None] * self.count  # address and value of the load just before
        self.next: list[int | None] = [None] * self.count  # address of the next load
        self.ended = [False] * self.count
        self.job: tuple[int, int] | None = None
        self.over = self.stopped = False
        self.played: Counter[tuple[int, int]] = Counter()
        self.faults: list[str] = []
        self.local = threading.local()

    def waits(self, k: int) -> bool:
        """True for a thread that would reread the value it has just seen."""
        seen = self.seen[k]
        return seen is not None and self.next[k] == seen[0] and self.words[seen[0]] == seen[1] and not self.over

    def step(self, load: int | None = None) -> None:
        """Lets some thread run, before this one does anything visible to others or loads the word at `load`."""
        me = self.local.number
        self.next[me] = load
        self.hand_over(me)
        self.turns[me].acquire()
        if self.stopped:
            raise Stopped

    def hand_over(self, me: int) -> None:
        enabled = [k for k in range(self.count) if not self.ended[k] and not self.waits(k)]
        if not enabled:
            if not all(self.ended):
                self.faults.append("all wait")
            self.stopped = True
            for turn in self.turns:
                turn.release()
            self.all_done.release()
            return
        self.turns[self.choose(enabled, me)].release()

    # The calls made by kernels

    def load(self, address: int) -> int:
        me = self.local.number
        self.step(address)
        value = self.words[address]
        self.seen[me] = (address, value)
        return value

    def store(self, address: int, value: int) -> None:
        self.step()
        self.seen[self.local.number] = None
        self.words[address] = int(value)

    def replace(self, address: int, old: int, new: int) -> int:
        self.step()
        self.seen[self.local.number] = None
        if self.words[address] != old:
            return 0
        self.words[address] = int(new)
        return 1

    def get(self, name: str) -> int:
        self.step()
        return self.team[name]

    def put(self, name: str, value: int) -> None:
        self.step()
        self.team[name] = int(value)

    def play_to(self, bass: int, string: int, end: int) -> None:
        self.step()
        if self.job != (bass, end):
            self.faults.append(f"string {string} to frame {end} of bass {bass} while the job is {self.job}")
        self.played[int(end), int(string)] += 1
        self.step()

    # The threads

    def audio(self, play_strings: Any, synth: Any) -> None:
        for bass, end in JOBS:
            self.job = (bass, end)
            play_strings(synth, SimpleNamespace(strings=self.strings, address=bass), (1 << self.strings) - 1, end)
            self.job = None
        self.over = True

    def help(self, help_once: Any) -> None:
        while not self.over:
            help_once(0)

    def run(self, play_strings: Any, help_once: Any, synth: Any) -> None:
        works = [lambda: self.audio(play_strings, synth), *[lambda: self.help(help_once)] * (self.count - 1)]

        def work(k: int) -> None:
            self.local.number = k
            self.turns[k].acquire()
            try:
                if not self.stopped:
                    works[k]()
            except Stopped:
                return
            self.ended[k] = True
            self.hand_over(k)

        threads = [threading.Thread(target=work, args=(k,)) for k in range(self.count)]
        for thread in threads:
            thread.start()
        self.turns[AUDIO].release()
        self.all_done.acquire()
        for thread in threads:
            thread.join()
        wanted = {(end, i) for _, end in JOBS for i in range(self.strings)}
        if set(self.played) != wanted or set(self.played.values()) != {1}:
            self.faults.append(f"played: {self.played}")


class Team:
    """Fields of TEAM, read and written directly."""

    pool = owner = 0

    def __init__(self, order: Callable[[], Order]) -> None:
        object.__setattr__(self, "order", order)

    def __getattr__(self, name: str) -> int:
        return self.order().get(name)

    def __setattr__(self, name: str, value: int) -> None:
        self.order().put(name, value)


@pytest.fixture
def follow(monkeypatch: pytest.MonkeyPatch) -> Callable[..., Order]:
    """Follows one order of `strings` strings and `helping` helpers."""
    at: list[Order] = []
    synth = SimpleNamespace(team=Team(lambda: at[-1]))
    plain = {name: getattr(helpers, name).py_func for name in ("play_strings", "help_once", "add_to")}
    native = SimpleNamespace(
        load_acquire=lambda address: at[-1].load(address),
        store_release=lambda address, value: at[-1].store(address, value),
        replace_word=lambda address, old, new: at[-1].replace(address, old, new),
        record_address=lambda record: getattr(record, "address", 0),
    )
    for name, value in {
        "native": native,
        "synth_at": lambda address: synth,
        "bass_at": lambda address: address,
        "add_to": plain["add_to"],
        "ahead": SimpleNamespace(play_to=lambda b, i, end: at[-1].play_to(getattr(b, "address", b), i, end)),
    }.items():
        monkeypatch.setattr(helpers, name, value)

    def follow_(strings: int, helping: int, choose: Callable[[list[int], int], int]) -> Order:
        at.append(Order(strings, helping, choose))
        at[-1].run(plain["play_strings"], plain["help_once"], synth)
        return at.pop()

    return follow_


def orders(follow: Callable[..., Order], strings: int, helping: int, changes: int) -> Iterator[Order]:
    """All orders with at most `changes` switches away from a thread that could go on."""
    waiting: list[tuple[list[int], int]] = [([], 0)]
    while waiting:
        prefix, used = waiting.pop()
        chosen: list[int] = []
        more: list[tuple[list[int], int]] = []

        def choose(
            enabled: list[int], running: int, prefix: list[int] = prefix, used: int = used,
            chosen: list[int] = chosen, more: list[tuple[list[int], int]] = more,
        ) -> int:  # fmt: skip
            default = running if running in enabled else enabled[0]
            if len(chosen) < len(prefix):
                default = prefix[len(chosen)]
            else:
                for other in enabled:
                    cost = used + (running in enabled)
                    if other != default and cost <= changes:
                        more.append(([*chosen, other], cost))
            chosen.append(default)
            return default

        yield follow(strings, helping, choose)
        waiting += more


@pytest.mark.parametrize(("helping", "changes", "minimum"), [(1, CHANGES, 100), (2, CHANGES - 1, 100)])
def test_every_order_plays_each_string_once(
    follow: Callable[..., Order], helping: int, changes: int, minimum: int
) -> None:
    """CHANGES with two helpers gives thousands more orders and takes a minute; none of them has a fault either."""
    count = 0
    for order in orders(follow, 2, helping, changes):
        assert not order.faults, order.faults
        count += 1
    assert count > minimum


@pytest.mark.parametrize(("strings", "helping"), [(3, 2), (4, 3)])
def test_random_orders_play_each_string_once(follow: Callable[..., Order], strings: int, helping: int) -> None:
    for seed in range(150):
        rng = np.random.default_rng(seed)
        order = follow(strings, helping, lambda enabled, running, rng=rng: int(rng.choice(enabled)))
        assert not order.faults, (seed, order.faults)


@pytest.mark.parametrize("fault", ["taken twice", "done too early", "told once"])
def test_a_fault_would_be_found(follow: Callable[..., Order], monkeypatch: pytest.MonkeyPatch, fault: str) -> None:
    """A string two threads may take; a job ended before its last string; the previous job's bass."""
    if fault == "taken twice":
        monkeypatch.setattr(Order, "replace", lambda self, address, old, new: self.store(address, new) or 1)
    elif fault == "done too early":
        load = Order.load

        def hasty(self: Order, address: int) -> int:
            return load(self, address) + 10 * (address == DONE and self.local.number == AUDIO)

        monkeypatch.setattr(Order, "load", hasty)
    else:
        put = Order.put
        monkeypatch.setattr(Order, "put", lambda self, name, value: None if self.words[JOB] else put(self, name, value))
    assert any(order.faults for order in orders(follow, 2, 2, CHANGES))


def test_threads_side_by_side_play_each_string_once_and_none_late() -> None:
    """Each string sometimes rests before it is played, and is counted before and after."""
    synth, device = synth_and_device("five-string", QUICK, adaptive=False)
    synth.record["clock"] = 0
    device.block(16)
    bass = synth.bass
    assert bass is not None
    real = ctypes.CFUNCTYPE(None, *[ctypes.c_int64] * 3)(int(bass.record["play_string"][0]))
    played: Counter[tuple[int, int]] = Counter()
    rng, inside, lock = np.random.default_rng(5), [0], threading.Lock()

    def play(address: int, string: int, end: int) -> None:
        with lock:
            played[end, string] += 1
            inside[0] += 1
            rest = float(rng.choice([0.0, 0.0, 0.0, 1e-5, 2e-4]))
        time.sleep(rest)
        real(address, string, end)
        with lock:
            inside[0] -= 1

    counting = ctypes.CFUNCTYPE(None, *[ctypes.c_int64] * 3)(play)
    bass.record["play_string"] = ctypes.cast(counting, ctypes.c_void_p).value
    synth.start_helpers(4)
    try:
        for _ in range(400):
            for key in rng.choice((23, 28, 33, 38, 43), 2).tolist():
                synth.send(0x90, int(key), int(rng.integers(1, 128)))
            device.block(int(rng.choice([16, 64, 200])))
            assert inside == [0], "a string is played beyond its job"
    finally:
        synth.stop_helpers()
    assert len(played) > 1000 and set(played.values()) == {1}
    assert max(string for _, string in played) < MAX_STRINGS
    assert synth.helped > 100 and synth.meters().faults == 0
