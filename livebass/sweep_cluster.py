"""Points of a sweep on a Dask cluster, whose workers must have this very livebass; Dask computes again what is lost."""

from __future__ import annotations

import logging
import socket
import warnings
from collections.abc import Generator, Iterator, Sequence
from contextlib import contextmanager
from itertools import islice
from typing import Any

from livebass.sweep_point import Result, measured
from livebass.sweep_work import Point, Work, program

CONNECT = 5.0  # s for the scheduler to answer
HIRE = 15.0  # s for a first worker to be there
AHEAD = 3  # points handed out for each thread of the cluster, so that none waits for the next
LOUD = ("distributed", "distributed.client", "distributed.core", "distributed.comm", "tornado.application")


def computed(points: Sequence[Point], address: str) -> Generator[tuple[Point, Result]]:
    """Each of `points` with its result, as they are done by the cluster whose scheduler is at `address`.

    Raises OSError where no scheduler or no worker answers, or the scheduler is lost, ValueError, naming the point, for
    one that cannot be solved, ChildProcessError for one that Dask gives up as its workers die, and LookupError without
    the library.
    """
    try:
        import distributed
    except ImportError:
        raise LookupError("--scheduler needs Dask: pip install 'livebass[cluster]'") from None
    with _client(distributed, address) as client:
        waiting = iter(points)
        futures: dict[str, Point] = {}

        def handed_out() -> list[Any]:
            """As many more as the workers there are now need."""
            handed = []
            threads = sum(client.nthreads().values())
            for point in islice(waiting, max(AHEAD * threads - len(futures), not futures)):
                key = f"livebass-{point.digest}"
                futures[key] = point
                handed.append(client.submit(measured_there, point.work, program(), key=key))
            return handed

        done = distributed.as_completed(handed_out())
        for future in done:
            point = futures.pop(future.key)
            yield point, _result(distributed, point, future, address)
            for more in handed_out():
                done.add(more)


def measured_there(work: Work, wanted: str) -> Result:
    """`sweep_point.measured` in a worker. Raises OSError where another program than the `wanted` one runs there."""
    import threadpoolctl

    if program() != wanted:
        raise OSError(f"the worker on {socket.gethostname()} has {program()}; needed is {wanted}")
    with threadpoolctl.threadpool_limits(1):  # as in the processes of `sweep_local`, for the same rounding
        return measured(work)


@contextmanager
def _client(distributed: Any, address: str) -> Iterator[Any]:
    """Connected, with a worker there, and quiet."""
    import dask

    for name in LOUD:
        logging.getLogger(name).setLevel(logging.CRITICAL + 1)
    times = {"distributed.comm.timeouts.connect": f"{CONNECT}s", "distributed.comm.retry.count": 0}
    with warnings.catch_warnings(), dask.config.set(times):
        warnings.simplefilter("ignore")  # of versions that differ: what matters is compared by the worker
        try:
            client = distributed.Client(address, timeout=CONNECT, set_as_default=False)
        except (OSError, ValueError, TypeError) as error:
            why = "does not answer" if isinstance(error, OSError) else "is no address such as tcp://host:8786"
            raise OSError(f"scheduler {address}: {why}") from None
        try:
            try:
                client.wait_for_workers(1, timeout=HIRE)
            except TimeoutError:
                raise OSError(f"scheduler {address}: has no workers; start some: dask worker {address}") from None
            yield client
        finally:
            client.close(timeout=CONNECT)


def _result(distributed: Any, point: Point, future: Any, address: str) -> Result:
    try:
        result: Result = future.result(timeout=CONNECT)
        return result
    except distributed.scheduler.KilledWorker:
        raise ChildProcessError(f"{point.name}: the workers that compute it die") from None
    except distributed.client.FutureCancelledError:
        raise OSError(f"scheduler {address}: lost; finished points stay, the same command goes on") from None
    except ImportError as error:
        raise OSError(f"a worker of {address} cannot import livebass: {error}") from None
    except ValueError as error:
        raise ValueError(f"{point.name}: {error}") from None
