"""The functions by which long work reports its progress."""

from __future__ import annotations

from collections.abc import Callable

Say = Callable[[str], None]  # is given a line for people: what comes next, or what went wrong
Progress = Callable[[float], None]  # is given the fraction done, ascending to 1


def silent(_: str) -> None:
    """A `Say` that drops every line."""


def steps(progress: Progress | None, total: int) -> Callable[[], None]:
    """A function to be called after each of `total` steps, which passes the fraction done to `progress`."""
    done = 0

    def step() -> None:
        nonlocal done
        done += 1
        if progress:
            progress(done / total)

    return step
