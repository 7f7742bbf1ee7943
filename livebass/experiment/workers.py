"""Points of a sweep by processes of this machine; a process that dies costs the point it was at, and is replaced.

Points of a sweep on a Dask cluster, whose workers must have this very livebass; Dask computes again what is lost.
"""

from __future__ import annotations

import asyncio
import logging
import multiprocessing
import os
import re
import socket
import threading
import warnings
from collections.abc import Callable, Generator, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, CancelledError, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from dataclasses import replace
from itertools import islice
from typing import Any

from livebass.experiment.grid import Point, Work, program
from livebass.experiment.point import Result, measured
from livebass.interrupts import hidden_from_children

MOST_DEATHS = 3  # of processes that had nothing but the same point to do
# Sums of several threads can be rounded otherwise than those of one.
ONE_THREAD = ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS", "VECLIB_MAXIMUM_THREADS")


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
        with hidden_from_children():
            return executor.submit(measured, point.work)

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


CONNECT = 5.0  # s for the scheduler to answer
HIRE = 15.0  # s for a first worker to be there
IDLE = 30.0  # s without a result and without a worker end a sweep
AHEAD = 3  # points handed out for each thread of the cluster, so that none waits for the next
LOUD = ("distributed", "distributed.client", "distributed.core", "distributed.comm", "tornado.application")
ADDRESS = re.compile(r"((tcp|tls|ws|wss)://)?(\[[0-9a-fA-F:]+\]|[\w.-]+):[0-9]{1,5}")


@contextmanager
def connected(address: str) -> Iterator[Callable[[Sequence[Point]], Generator[tuple[Point, Result]]]]:
    """A function that gives each point with its result, as they are done by the cluster of the scheduler at `address`.

    Raises OSError where no scheduler or no worker answers, or the scheduler is lost, ValueError for what is no address,
    and, naming the point, for one that cannot be solved, ChildProcessError for one that Dask gives up as its workers
    die, and LookupError without the library.
    """
    try:
        import dask
        import distributed
        from distributed.comm.core import CommClosedError
    except ImportError:
        raise LookupError("--scheduler needs Dask: pip install 'livebass[cluster]'") from None
    if not ADDRESS.fullmatch(address):
        raise ValueError(f"scheduler {address}: is no address such as tcp://host:8786")
    for name in LOUD:
        logging.getLogger(name).setLevel(logging.CRITICAL + 1)
    times = {"distributed.comm.timeouts.connect": f"{CONNECT}s", "distributed.comm.retry.count": 0}
    with warnings.catch_warnings(), dask.config.set(times):
        warnings.simplefilter("ignore")  # of versions that differ: what matters is compared by the worker
        asyncio.run(_shake_hands(address))
        try:
            client = distributed.Client(address, timeout=CONNECT, set_as_default=False)
        except OSError:
            raise OSError(f"scheduler {address}: does not answer") from None
        try:
            _check(client, address)
            with client.as_current():
                yield lambda points: _computed(client, points, address)
        except (CancelledError, CommClosedError):
            raise _gone(address, "lost") from None
        finally:
            client.close(timeout=CONNECT)


def measured_there(work: Work, wanted: str) -> Result:
    """`sweep_point.measured` in a worker. Raises OSError where another program than the `wanted` one runs there."""
    import threadpoolctl

    if program() != wanted:
        raise OSError(f"the worker on {socket.gethostname()} has {program()}; needed is {wanted}")
    with threadpoolctl.threadpool_limits(1):  # as in the processes of `sweep_local`, for the same rounding
        return measured(work)


async def _shake_hands(address: str) -> None:
    """Raises OSError where nobody answers, or something else than Dask: its own dashboard, with port 8787, say.

    A client that meets such a thing raises whatever its bytes happen to mean, and keeps a thread that asks again.
    """
    from distributed import Security
    from distributed.comm.core import connect

    secrets = Security().get_connection_args("client")
    try:
        comm = await asyncio.wait_for(connect(address, timeout=CONNECT, **secrets), 2 * CONNECT)
    except OSError:
        raise OSError(f"scheduler {address}: does not answer") from None
    except Exception:
        raise OSError(f"scheduler {address}: is no Dask scheduler; those listen on port 8786 mostly") from None
    await comm.close()


def _check(client: Any, address: str) -> None:
    """A worker is there, and what it is to compute with; one that meets unknown names in a task would leave."""
    try:
        client.wait_for_workers(1, timeout=HIRE)
        for run in (client.run_on_scheduler, client.run):
            run(exec, f"import {__name__}")
    except ImportError as error:
        raise OSError(f"scheduler {address}: it or a worker does not have this livebass: {error}") from None
    except TimeoutError:
        raise OSError(f"scheduler {address}: has no workers; start some: dask worker {address}") from None


def _computed(client: Any, points: Sequence[Point], address: str) -> Generator[tuple[Point, Result]]:

    waiting = iter(points)
    handed_out: dict[str, Point] = {}

    def more() -> list[Any]:
        """As many as the workers there are now need."""
        futures = []
        wanted = AHEAD * sum(client.nthreads().values()) - len(handed_out)
        for point in islice(waiting, max(wanted, not handed_out)):
            key = f"livebass-{point.digest}"
            handed_out[key] = point
            futures.append(client.submit(measured_there, point.work, program(), key=key))
        return futures

    running = set(more())
    while running:
        done = _some(client, running, address)
        for future in done:
            point = handed_out[future.key]
            result = _cluster_result(point, future)
            if result is not None:
                running.remove(future)
                del handed_out[future.key]
                yield point, result
        running |= set(more())


def _some(client: Any, running: set[Any], address: str) -> set[Any]:
    """Those of `running` that are done, at least one. OSError where scheduler or workers are gone."""
    import distributed

    while True:
        try:
            return set(distributed.wait(list(running), timeout=IDLE, return_when="FIRST_COMPLETED").done)
        except TimeoutError:
            if not client.nthreads():
                raise _gone(address, "has no workers any more") from None


def _gone(address: str, what: str) -> OSError:
    return OSError(f"scheduler {address}: {what}; finished points stay, the same command goes on")


def _cluster_result(point: Point, future: Any) -> Result | None:
    """None where the worker that had it died just now: it is computed again."""
    import distributed

    try:
        result: Result = future.result(timeout=CONNECT)
        return result
    except TimeoutError:
        return None
    except distributed.scheduler.KilledWorker:
        raise ChildProcessError(f"{point.name}: the workers that compute it die") from None
    except ValueError as error:
        raise ValueError(f"{point.name}: {error}") from None
