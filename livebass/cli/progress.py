"""Shows the progress of long work, and the compilation that may come first."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager

import click

from livebass.cli.messages import say


def have_kernels(report: Callable[[float], None] = lambda done: None) -> None:
    """Compiles the kernels if needed, with a message: do it first, to keep it out of timings.

    `report` gets the fraction done, from another thread.
    """
    from livebass.compiling.library import duration, is_cached, library

    if not is_cached():
        say(f"compiling the kernels, once, in about {duration()} ...")
        with ExitStack() as shown:
            bar: list[Callable[[float], None] | None] = []

            def progress(done: float) -> None:
                report(done)
                if not bar:  # not while another process compiles
                    bar.append(shown.enter_context(shown_progress("compiling the kernels")))
                if bar[0]:
                    bar[0](done)

            library(progress)


@contextmanager
def shown_progress(label: str) -> Iterator[Callable[[float], None] | None]:
    """Shows a progress bar if stderr is a terminal; yields a function that takes the fraction done, or None."""
    with shown_steps(label) as (progress, _):
        yield progress


@contextmanager
def shown_steps(label: str) -> Iterator[tuple[Callable[[float], None] | None, Callable[[str], None]]]:
    """Like `shown_progress`; also yields a function that reports a step: before the bar, or as a line."""
    if not sys.stderr.isatty():
        yield None, say
        return
    steps = 1000
    with click.progressbar(length=steps, label=label, show_eta=True, file=sys.stderr) as bar:

        def tell(line: str) -> None:
            bar.label = line
            bar.render_progress()

        yield lambda fraction: bar.update(int(fraction * steps) - bar.pos), tell
        bar.update(steps - bar.pos)
