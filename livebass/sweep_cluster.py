"""Points of a sweep on a Dask cluster, whose workers must have this very livebass; Dask computes again what is lost."""

from __future__ import annotations

import asyncio
import logging
import re
import socket
import warnings
from collections.abc import Callable, Generator, Iterator, Sequence
from concurrent.futures import CancelledError
from contextlib import contextmanager
from itertools import islice
from typing import Any

from livebass.sweep_point import Result, measured
from livebass.sweep_work import Point, Work, program

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
            result = _result(point, future)
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


def _result(point: Point, future: Any) -> Result | None:
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
