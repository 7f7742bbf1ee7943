"""Points of a sweep by processes of this machine; a process that dies costs the point it was at, and is replaced."""

from __future__ import annotations

import multiprocessing
import os
import signal
import threading
from collections.abc import Callable, Generator, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from dataclasses import replace
from itertools import islice
from typing import Any

from livebass.sweep_point import Result, measured
from livebass.sweep_work import Point

MOST_DEATHS = 3  # of processes that had nothing but the same point to do
# Sums of several threads can be rounded otherwise than those of one.
ONE_THREAD = ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS", "VECLIB_MAXIMUM_THREADS")
DEAF = {signal.SIGINT, signal.SIGHUP}  # in the workers: Ctrl-C reaches the whole group, and the parent ends them


def compile_kernels(point: Point) -> None:
    """Once, before several processes do it: an instant of `point`."""
    trial = point.work.trial
    measured(replace(point.work, trial=replace(trial, duration=1 / trial.output_rate)))


def computed(points: Sequence[Point], workers: int, say: Callable[[str], None]) -> Generator[tuple[Point, Result]]:
    """Each of `points` with its result, as they are done. Closing the iterator ends the processes at once.

    Raises ValueError, naming the point, for one that cannot be solved, and ChildProcessError for one whose process
    died `MOST_DEATHS` times with nothing else to do.
    """
    left = dict.fromkeys(points)
    while left:
        lost = yield from _together(list(left), workers, left)
        if lost:
            say(f"{len(lost)} of the points were lost with a process that died; they are computed again")
        for point in lost:  # one by one, to know which it was
            deaths = 0
            while point in left:
                deaths += len((yield from _together([point], 1, left)))
                if deaths == MOST_DEATHS:
                    raise ChildProcessError(f"{point.name}: the process that computes it has died {deaths} times")


def _together(
    points: Sequence[Point], workers: int, left: dict[Point, None]
) -> Generator[tuple[Point, Result], None, list[Point]]:
    """Results, taken out of `left`, until all are there or a process dies; then the points that were lost."""
    waiting = iter(points)
    running: dict[Future[Result], Point] = {}
    with _pool(min(workers, len(points))) as submit:
        while True:
            broken = False
            for point in islice(waiting, workers - len(running)):
                try:
                    running[submit(point)] = point
                except BrokenProcessPool:
                    broken = True
                    break
            if not running:
                return []
            done, _ = wait(running, return_when=FIRST_COMPLETED)
            if broken or any(isinstance(future.exception(), BrokenProcessPool) for future in done):
                done, broken = wait(running).done, True
            for future in done:
                if isinstance(future.exception(), BrokenProcessPool):
                    continue
                point = running.pop(future)
                del left[point]
                yield point, _result(point, future)
            if broken:
                return list(running.values())


def _result(point: Point, future: Future[Result]) -> Result:
    try:
        return future.result()
    except ValueError as error:
        raise ValueError(f"{point.name}: {error}") from None


@contextmanager
def _pool(workers: int) -> Iterator[Callable[[Point], Future[Result]]]:
    """A function that hands a point to the next free process. In the end, whatever the end, none is left."""
    before = set(multiprocessing.active_children())
    environment = {name: os.environ.get(name) for name in ONE_THREAD}
    executor = ProcessPoolExecutor(workers, multiprocessing.get_context("spawn"), _begin)

    def submit(point: Point) -> Future[Result]:
        mask = signal.pthread_sigmask(signal.SIG_BLOCK, DEAF)  # new processes and threads inherit it
        try:
            return executor.submit(measured, point.work)
        finally:
            signal.pthread_sigmask(signal.SIG_SETMASK, mask)

    os.environ.update(dict.fromkeys(ONE_THREAD, "1"))
    try:
        yield submit
    finally:
        for process in set(multiprocessing.active_children()) - before:
            process.kill()
        executor.shutdown(wait=True, cancel_futures=True)
        for name, value in environment.items():
            if value is None:
                os.environ.pop(name, None)
            else:
                os.environ[name] = value


def _begin() -> None:
    """In a new process: end with the parent, even where that was killed."""
    parent: Any = multiprocessing.parent_process()

    def follow() -> None:
        parent.join()
        os._exit(1)

    threading.Thread(target=follow, daemon=True).start()
