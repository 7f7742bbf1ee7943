"""Computes the points of a sweep in parallel: in processes of this machine, or on a Dask cluster.

A process that dies loses only its current point, which a new one computes again; Dask does the same. The workers of a
cluster must run the same livebass.
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
from concurrent.futures import (
    FIRST_COMPLETED,
    CancelledError,
    Executor,
    Future,
    ProcessPoolExecutor,
    ThreadPoolExecutor,
    as_completed,
    wait,
)
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from itertools import islice
from typing import Any, Protocol, TypeVar

from livebass.lab.experiment.grid import Point, program
from livebass.lab.experiment.point import Result, measure_point
from livebass.report.progress import Say
from livebass.system.cores import ONE_THREAD
from livebass.system.extras import install
from livebass.system.interrupts import hidden_from_children


class Task(Protocol):
    """One point of a sweep, or of other work that `solve` does on its `work`."""

    @property
    def name(self) -> str: ...
    @property
    def work(self) -> Any: ...
    @property
    def digest(self) -> str: ...


AnyTask = TypeVar("AnyTask", bound=Task)
Solve = Callable[[Any], Result]  # a function of a module: processes find it by its name
Compute = Callable[[Sequence[Any]], Generator[tuple[Any, Result]]]

MAX_DEATHS = 3  # of processes that had only the same single point to compute


def compute_points(points: Sequence[Point], workers: int, say: Say) -> Generator[tuple[Point, Result]]:
    """Compute `points` in `workers` processes; yields each with its result when done.

    Closing the iterator ends the processes at once.
    Raises ValueError with the name of a point that cannot be solved, and ChildProcessError for one whose process died
    `MAX_DEATHS` times with nothing else to do.
    """
    left = dict.fromkeys(points)
    while left:
        lost = yield from _together(list(left), workers, left, say)
        if lost:
            say(f"{len(lost)} of the points were lost with a process that died; they are computed again")
        for point in lost:  # one by one, to find the one that kills its process
            deaths = 0
            while point in left:
                deaths += len((yield from _together([point], 1, left, say)))
                if deaths == MAX_DEATHS:
                    raise ChildProcessError(f"{point.name}: the process that computes it has died {deaths} times")


def _together(
    points: Sequence[Point], workers: int, left: dict[Point, None], say: Say
) -> Generator[tuple[Point, Result], None, list[Point]]:
    """Yield results and take their points out of `left`, until all are done or a process dies.

    Returns the points that were lost with it.
    """
    waiting = iter(points)
    running: dict[Future[Result], Point] = {}
    with _pool(min(workers, len(points)), say) as submit:
        while True:
            broken = False
            for point in islice(waiting, workers - len(running)):
                try:
                    running[submit(measure_point, point.work)] = point
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


def _result(point: Task, future: Future[Result]) -> Result:
    try:
        return future.result()
    except ValueError as error:
        raise ValueError(f"{point.name}: {error}") from None


@contextmanager
def lasting(workers: int, solve: Solve, say: Say) -> Iterator[Compute]:
    """A function like that of `connect`, for processes that last from one call of it to the next.

    It raises ChildProcessError with the name of a point whose process dies.
    """
    with _pool(workers, say) as submit:

        def compute(points: Sequence[AnyTask]) -> Generator[tuple[AnyTask, Result]]:
            running = {submit(solve, point.work): point for point in points}
            for future in as_completed(running):
                try:
                    yield running[future], _result(running[future], future)
                except BrokenProcessPool:
                    raise ChildProcessError(f"{running[future].name}: the process that computes it has died") from None

        yield compute


@contextmanager
def _pool(workers: int, say: Say) -> Iterator[Callable[[Solve, Any], Future[Result]]]:
    """A function that hands work to the next free process. No process outlives the block, however it ends."""
    before = set(multiprocessing.active_children())
    environment = {name: os.environ.get(name) for name in ONE_THREAD}
    made: list[Executor] = []

    def submit(solve: Solve, work: Any) -> Future[Result]:
        if not made:
            made.append(_executor(workers, say))
        with hidden_from_children():
            return made[0].submit(solve, work)

    os.environ.update(ONE_THREAD)
    try:
        yield submit
    finally:
        for process in set(multiprocessing.active_children()) - before:
            process.kill()
        for executor in made:
            executor.shutdown(wait=True, cancel_futures=True)
        for name, value in environment.items():
            if value is None:
                os.environ.pop(name, None)
            else:
                os.environ[name] = value


def _executor(workers: int, say: Say) -> Executor:
    """Makes the processes; where there can be none, as without /dev/shm, one thread of this process."""
    try:
        return ProcessPoolExecutor(workers, multiprocessing.get_context("spawn"), _begin)
    except OSError as error:  # of a semaphore
        say(f"this system lets processes share no memory ({error.strerror}): one computes everything")
        return ThreadPoolExecutor(1)


def _begin() -> None:
    """Watch the parent of this new process, and end with it even if it is killed."""
    parent: Any = multiprocessing.parent_process()

    def follow() -> None:
        parent.join()
        os._exit(1)

    threading.Thread(target=follow, daemon=True).start()


CONNECT = 5.0  # s for the scheduler to answer
FIRST_WORKER = 15.0  # s for the cluster to find a worker
IDLE = 30.0  # s without a result or a worker that end the sweep
AHEAD = 3  # points handed out per thread of the cluster, so none waits for the next
LOGGERS = ("distributed", "distributed.client", "distributed.core", "distributed.comm", "tornado.application")
ADDRESS = re.compile(r"((tcp|tls|ws|wss)://)?(\[[0-9a-fA-F:]+\]|[\w.-]+):[0-9]{1,5}")


@contextmanager
def connect(address: str, solve: Solve = measure_point) -> Iterator[Compute]:
    """A function that computes points, by `solve`, on the cluster of the scheduler at `address`; see `compute_points`.

    Raises OSError if no scheduler or no worker answers, or the scheduler is lost; ValueError for a malformed address,
    and with the name of a point that cannot be solved; ChildProcessError for a point that Dask gives up because its
    workers die; LookupError without the library.
    """
    try:
        import dask
        import distributed
        from distributed.comm.core import CommClosedError
    except ImportError:
        raise LookupError(f"--scheduler needs Dask: {install('cluster')}") from None
    if not ADDRESS.fullmatch(address):
        raise ValueError(f"scheduler {address}: must be an address such as tcp://host:8786")
    for name in LOGGERS:
        logging.getLogger(name).setLevel(logging.CRITICAL + 1)
    times = {"distributed.comm.timeouts.connect": f"{CONNECT}s", "distributed.comm.retry.count": 0}
    with warnings.catch_warnings(), dask.config.set(times):
        warnings.simplefilter("ignore")  # about different versions: `solved_there` compares the relevant ones
        asyncio.run(_shake_hands(address))
        try:
            client = distributed.Client(address, timeout=CONNECT, set_as_default=False)
        except OSError:
            raise OSError(f"scheduler {address}: does not answer") from None
        try:
            _check(client, address)
            with client.as_current():
                yield lambda points: _on_cluster(client, points, address, solve)
        except (CancelledError, CommClosedError):
            raise _connection_error(address, "lost") from None
        finally:
            client.close(timeout=CONNECT)


def solved_there(solve: Solve, work: Any, wanted: str) -> Result:
    """`solve(work)` in a worker of the cluster. Raises OSError if that runs a program other than `wanted`."""
    import threadpoolctl

    if program() != wanted:
        raise OSError(f"the worker on {socket.gethostname()} has {program()}; it needs {wanted}")
    with threadpoolctl.threadpool_limits(1):  # rounds as in the processes of `_pool`
        return solve(work)


async def _shake_hands(address: str) -> None:
    """Raise OSError if nothing answers, or anything but a scheduler, such as Dask's dashboard on port 8787.

    At such an address, a client raises an arbitrary error from the bytes, and leaves a thread that retries.
    """
    from distributed import Security
    from distributed.comm.core import connect

    secrets = Security().get_connection_args("client")
    try:
        comm = await asyncio.wait_for(connect(address, timeout=CONNECT, **secrets), 2 * CONNECT)
    except OSError:
        raise OSError(f"scheduler {address}: does not answer") from None
    except Exception:
        raise OSError(f"scheduler {address}: is not a Dask scheduler; they usually listen on port 8786") from None
    await comm.close()


def _check(client: Any, address: str) -> None:
    """Raise OSError unless there is a worker and it can import this module; without it, it would quit at a task."""
    try:
        client.wait_for_workers(1, timeout=FIRST_WORKER)
        for run in (client.run_on_scheduler, client.run):
            run(exec, f"import {__name__}")
    except ImportError as error:
        raise OSError(f"scheduler {address}: it or a worker does not have this livebass: {error}") from None
    except TimeoutError:
        raise OSError(f"scheduler {address}: has no workers; start some: dask worker {address}") from None


def _on_cluster(
    client: Any, points: Sequence[AnyTask], address: str, solve: Solve
) -> Generator[tuple[AnyTask, Result]]:
    """Compute `points` on the cluster of `client`; see `compute_points`."""
    waiting = iter(points)
    handed_out: dict[str, AnyTask] = {}

    def more() -> list[Any]:
        """Hand out as many points as the present workers need."""
        futures = []
        wanted = AHEAD * sum(client.nthreads().values()) - len(handed_out)
        for point in islice(waiting, max(wanted, not handed_out)):
            key = f"livebass-{point.digest}"
            handed_out[key] = point
            futures.append(client.submit(solved_there, solve, point.work, program(), key=key))
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
    """Wait for at least one of `running` and return the finished ones. Raises OSError once no worker is left."""
    import distributed

    while True:
        try:
            return set(distributed.wait(list(running), timeout=IDLE, return_when="FIRST_COMPLETED").done)
        except TimeoutError:
            if not client.nthreads():
                raise _connection_error(address, "has no workers any more") from None


def _connection_error(address: str, what: str) -> OSError:
    return OSError(f"scheduler {address}: {what}; finished points stay, the same command goes on")


def _cluster_result(point: Task, future: Any) -> Result | None:
    """The result, or None if the worker that had it has just died: Dask computes it again."""
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
