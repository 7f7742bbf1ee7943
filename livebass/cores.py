"""Counts the cores this process may use: a container or `taskset` may leave it only some of the processor's."""

from __future__ import annotations

import os


def core_count() -> int:
    """Number of cores this process may use, at least 1."""
    if hasattr(os, "sched_getaffinity"):  # Linux
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1
