"""The cores that this process may use: a container or `taskset` may leave it only some of the processor's."""

from __future__ import annotations

import os

# Environment variables: numpy reads them when it is imported. Sums over several threads may round differently from sums
# in one, and on matrices as small as ours threads mostly wait for each other.
ONE_THREAD = dict.fromkeys(
    ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS", "VECLIB_MAXIMUM_THREADS"), "1"
)


def core_count() -> int:
    """Number of cores this process may use, at least 1."""
    if hasattr(os, "sched_getaffinity"):  # Linux
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1
