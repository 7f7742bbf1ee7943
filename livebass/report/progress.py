"""Functions that report the progress of long work."""

from __future__ import annotations

from collections.abc import Callable

Say = Callable[[str], None]  # gets a line for people: the next step, or a problem
Progress = Callable[[float], None]  # gets the fraction done, ascending to 1


def silent(_: str) -> None:
    """A `Say` that drops every line."""


def steps(progress: Progress | None, total: int) -> Callable[[], None]:
    """A function to call after each of `total` steps; it passes the fraction done to `progress`."""
    done = 0

    def step() -> None:
        nonlocal done
        done += 1
        if progress:
            progress(done / total)

    return step
