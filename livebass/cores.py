"""Counts the processor's cores that may be used: a container or `taskset` may leave a process fewer than there are."""

from __future__ import annotations

import os


def core_count() -> int:
    """How many cores this process may use, 1 at least."""
    if hasattr(os, "sched_getaffinity"):  # Linux
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1
