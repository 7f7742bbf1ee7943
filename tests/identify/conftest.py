"""Linear algebra on one thread for these tests."""

from __future__ import annotations

from collections.abc import Iterator

import pytest
from threadpoolctl import threadpool_limits


@pytest.fixture(scope="package", autouse=True)
def one_thread() -> Iterator[None]:
    """Run BLAS on one thread.

    ESPRIT takes singular values of thousands of 100 by 101 matrices. Threads make each slower, and on a machine that is
    busy otherwise many times slower, as they wait for each other.
    """
    with threadpool_limits(1, "blas"):
        yield
