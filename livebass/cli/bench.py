"""`livebass bench`: how fast sound is computed on this machine, and whether it is ready in time."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import click

from livebass.cli.messages import say
from livebass.cli.options import PATH, count_option, files_to_write, flag, option, write_results
from livebass.cli.progress import have_kernels
from livebass.cli.values import Number
from livebass.model.quality import BLOCK, QUALITIES
from livebass.report.progress import Say, silent

Result = dict[str, Any]
JSON = option("--json file", PATH, "Also write the figures to FILE.", metavar="FILE")
PLOT = option("--plot picture", PATH, "Draw the figures into FILE.png.", metavar="FILE.png")


@click.group()
def bench() -> None:
    """Measure how fast this machine is, and whether it can play live."""


@bench.command("render")
@JSON
def render_(file: Path | None) -> None:
    """Measure the seconds of work per second of sound.

    Computes one hard pluck by brute force and by the engine in each quality, then plays four strings at once and a
    slap line. Also says how near a held string comes to the multiplications that a core of this machine can do. Takes
    about a minute; run nothing else meanwhile.
    """
    from livebass.lab.bench.render import bench_render, table

    _report(file, None, bench_render, table, None)


@bench.command("live")
@option("-p --preset", str, "The bass.", metavar="NAME|FILE", default="jazz-finger")
@option(
    "-q --quality qualities",
    click.Choice(list(QUALITIES)),
    "Measure only this quality; repeatable.  [default: all]",
    multiple=True,
)
@option(
    "--block blocks",
    Number("frames", *BLOCK, whole=True),
    "Measure only this block size; repeatable.  [default: 32, 64 ... 1024]",
    multiple=True,
)
@count_option("--runs", 100, "Number of runs.  [default: 5 in quality live, 3 in the others]")
@JSON
@PLOT
def live(preset: str, qualities: tuple[str, ...], blocks: tuple[int, ...], runs: int | None, file: Path | None,
         picture: Path | None) -> None:  # fmt: skip
    """Measure whether each block of sound is ready in time. Needs no sound card.

    Pops four strings at once as hard as possible, pops them again while they ring, then plays sixteenths over all
    strings, in each quality and in blocks of 32 to 1024 frames; then plays one string at full fidelity. Also measures
    how far each quality is from `reference`, over notes of all presets, six plucks each. Takes about six minutes; run
    nothing else meanwhile.
    """
    from dataclasses import replace

    from livebass.lab.bench.live import FULL, bench_live, table
    from livebass.lab.bench.live import picture as draw

    extent = FULL
    if qualities:
        extent = replace(extent, qualities=tuple(q for q in QUALITIES if q in qualities))
    if blocks:
        extent = replace(extent, blocks=tuple(sorted(set(blocks))))
    if runs:
        extent = replace(extent, runs=runs, other_runs=runs)
    _report(file, picture, lambda say: bench_live(preset, say, extent), table, draw)


@bench.command("fidelity")
@option(
    "-p --preset presets",
    str,
    "Compare only this bass; repeatable.  [default: all]",
    metavar="NAME|FILE",
    multiple=True,
)
@option(
    "-q --quality qualities",
    click.Choice([name for name in QUALITIES if name != "reference"]),
    "Compare only this quality; repeatable.  [default: all]",
    multiple=True,
)
@flag("--hear", "Also judge the notes by a model of hearing.")
@JSON
def fidelity(presets: tuple[str, ...], qualities: tuple[str, ...], hear: bool, file: Path | None) -> None:
    """Measure how far each quality is from `reference`.

    Plays notes of all presets, six plucks each, and compares brightness, waveforms, the number of contacts and the
    levels in third-octave bands; with --hear also asks a model of hearing (Zimtohrli) whether anybody hears a
    difference. Takes a few minutes.
    """
    from dataclasses import replace

    from livebass.lab.bench.tiers import ALL, bench_fidelity, table

    extent = replace(ALL, presets=tuple(dict.fromkeys(presets)))
    if qualities:
        extent = replace(extent, qualities=tuple(q for q in QUALITIES if q in qualities))
    if hear:
        from livebass.lab.comparison.hearing import check_hearing

        check_hearing()  # before the kernels and the files
    _report(file, None, lambda say: bench_fidelity(hear, say, extent), table, None)


@bench.command("effects")
@JSON
def effects(file: Path | None) -> None:
    """Measure the part of a block's time that each effect takes.

    Sends noise through compressor, drive, equaliser, cabinets and limiter, in blocks of 64 frames. Takes ten seconds;
    run nothing else meanwhile.
    """
    from livebass.lab.bench.effects import bench_effects, table

    _report(file, None, bench_effects, table, None)


@bench.command("latency")
@JSON
@PLOT
def latency(file: Path | None, picture: Path | None) -> None:
    """Measure the time from a MIDI note to its sound.

    Plays through a running JACK server in two ways: as a JACK client with a MIDI port, and through PortAudio with MIDI
    from JACK. Without a server it measures only the time inside livebass. Takes half a minute.
    """
    from livebass.lab.bench.latency import bench_latency, table
    from livebass.lab.bench.latency import picture as draw

    _report(file, picture, bench_latency, table, draw)


def _report(
    file: Path | None, picture: Path | None, measure: Callable[[Say], Result], table: Callable[[Result], str],
    draw: Callable[[Result], bytes] | None,
) -> None:  # fmt: skip
    """Measures, writes the requested files, and prints the table."""
    from livebass.report.picture import check_plots
    from livebass.report.text import json_text

    files_to_write({"--json": file, "--plot": picture})  # now, not after a minute of work
    if picture is not None:
        if picture.suffix.lower() != ".png":
            raise click.UsageError(f"--plot {os.fspath(picture)}: the picture is a PNG, name it .png")
        check_plots("--plot")
    have_kernels()
    result = measure(_say if sys.stderr.isatty() else silent)
    made: list[tuple[Path | None, Callable[[], str | bytes]]] = [(file, lambda: json_text(result, indent=2))]
    if draw is not None:
        made.append((picture, lambda: draw(result)))
    write_results(made, table(result))


def _say(line: str) -> None:
    say(f"{line} ...")
