"""Linear algebra on one thread for the tests of identify."""

from __future__ import annotations

from collections.abc import Iterator

import pytest
from threadpoolctl import threadpool_limits


@pytest.fixture(scope="package", autouse=True)
def one_thread() -> Iterator[None]:
    """Runs BLAS on one thread.

    ESPRIT decomposes thousands of matrices of 100 by 101. With two threads each takes half as long again, and on a busy
    machine ten times as long, as the threads wait for each other.
    """
    with threadpool_limits(1, "blas"):
        yield
