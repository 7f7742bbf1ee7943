"""`livebass bench`: what things cost, and whether they are ready in time."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import click

from livebass.cli.render import announce_kernels
from livebass.cli.values import Number
from livebass.model.quality import QUALITIES

Command = Callable[..., None]
Result = dict[str, Any]


def filed(command: Command) -> Command:
    """Options --json and --plot."""
    path = click.Path(path_type=Path)
    plot = click.option("--plot", "picture", type=path, metavar="FILE.png", help="Draw the figures into FILE.png.")
    return click.option("--json", "file", type=path, metavar="FILE", help="Write the figures to FILE.")(plot(command))


@click.group()
def bench() -> None:
    """Measure what things cost on this machine."""


@bench.command("render")
@click.option("--json", "file", type=click.Path(path_type=Path), help="Write the figures to FILE as well.")
def render_(file: Path | None) -> None:
    """Seconds of work per second of sound: brute force, the engine in each quality, the published method.

    Takes about a minute; leave the machine alone meanwhile.
    """
    from livebass.bench.render import bench_render, table

    _report(file, None, lambda say: bench_render(**say), table, None)


@bench.command("live")
@click.option("-p", "--preset", metavar="NAME|FILE", default="jazz-finger", show_default=True, help="The bass.")
@click.option(
    "-q",
    "--quality",
    "tiers",
    type=click.Choice(list(QUALITIES)),
    multiple=True,
    help="This tier; may be given again. All without it.",
)
@click.option(
    "--block",
    "blocks",
    type=Number("frames", 16, 1024, whole=True),
    multiple=True,
    help="This block size; may be given again. 32 to 1024 without it.",
)
@click.option("--runs", type=Number("count", 1, 100, whole=True), help="Of the script; 5 (live) or 3 without it.")
@filed
def live(preset: str, tiers: tuple[str, ...], blocks: tuple[int, ...], runs: int | None, file: Path | None,
         picture: Path | None) -> None:  # fmt: skip
    """Times of the live callback's blocks over a worst case, as parts of their deadline. Needs no sound card.

    Four strings popped at velocity 127 at once, again while they sound, then sixteenths over all strings, for block
    sizes from 32 to 1024 frames and each quality; one string at full fidelity; and how far the qualities are from
    `reference` in sound. Takes about two minutes; leave the machine alone meanwhile.
    """
    from dataclasses import replace

    from livebass.bench import live as bench_live
    from livebass.bench.show import live_png, live_table

    extent = bench_live.USUAL
    if tiers:
        extent = replace(extent, tiers=tuple(t for t in QUALITIES if t in tiers))
    if blocks:
        extent = replace(extent, blocks=tuple(sorted(set(blocks))))
    if runs:
        extent = replace(extent, runs=runs, other_runs=runs)
    _report(file, picture, lambda say: bench_live.bench_live(preset, extent=extent, **say), live_table, live_png)


@bench.command("latency")
@filed
def latency(file: Path | None, picture: Path | None) -> None:
    """MIDI note-on to the first sample, through a running JACK server.

    Both ways there are to play live: the native JACK client with its own MIDI port, and PortAudio with rtmidi. Where no
    server runs, only the way from the queue into a block is measured. Takes half a minute.
    """
    from livebass.bench import server as bench_latency
    from livebass.bench.show import latency_png, latency_table

    _report(file, picture, lambda say: bench_latency.bench_latency(**say), latency_table, latency_png)


@bench.command("python")
@filed
def python(file: Path | None, picture: Path | None) -> None:
    """Blocks lost by the native callback and by one in Python while the interpreter is busy.

    The same engine behind both, through a running JACK server. Takes two thirds of a minute.
    """
    from livebass.bench import server as bench_python
    from livebass.bench.show import python_png, python_table

    _report(file, picture, lambda say: bench_python.bench_python(**say), python_table, python_png)


def _report(
    file: Path | None, picture: Path | None, measure: Callable[[Result], Result], table: Callable[[Result], str],
    draw: Callable[[Result], bytes] | None,
) -> None:  # fmt: skip
    """Measures, writes what is wanted of the files, and prints the table."""
    from livebass.bench.show import NEEDED
    from livebass.files import Transaction, checked_place
    from livebass.report.picture import check_matplotlib
    from livebass.report.text import json_text

    places = [checked_place(path) for path in (file, picture) if path is not None]  # now, not after a minute of work
    if len(set(places)) < len(places):
        raise click.UsageError("--json and --plot: the same file")
    if picture is not None:
        if picture.suffix.lower() != ".png":
            raise click.UsageError(f"--plot {os.fspath(picture)}: the picture is a PNG, name it .png")
        check_matplotlib(NEEDED)
    announce_kernels(live=draw is not None)
    result = measure({"progress": _say} if sys.stderr.isatty() else {})
    try:
        if places:
            with Transaction() as files:
                if file is not None:
                    files.write(file, json_text(result, indent=2).encode())
                if picture is not None and draw is not None:
                    files.write(picture, draw(result))
    finally:  # a disk that is full does not lose the figures
        click.echo(table(result))


def _say(what: str) -> None:
    click.echo(f"{what} ...", err=True)
