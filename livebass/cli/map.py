"""`livebass map`: plucks every note of a bass and shows where the neck buzzes."""

from __future__ import annotations

from pathlib import Path

import click

from livebass.cli import options
from livebass.cli.progress import have_kernels, shown_progress
from livebass.cli.values import Quantity
from livebass.model.quality import QUALITIES
from livebass.rows.units import one_line

PICTURES = ("png", "svg")


@click.command("map")
@options.preset_option("The bass.", default=options.DEFAULT_PRESET, show_default=True)
@options.option("--beside", str, "Another bass or set-up, to compare.", metavar="NAME|FILE")
@options.count_option("--velocity", 127, "Velocity of the plucks.", default=100, metavar="1-127")
@options.option("--duration", Quantity("time", 0.01, 10.0), "Time in which contacts count.", default="0.5s")
@options.quality_option("live", "Precision of the strings.")
@options.file_option("-o --output", "Draw the map; needs matplotlib.", metavar="FILE.png|FILE.svg")
@options.file_option("--csv csv_file", "Write the map as CSV.")
def map_(
    preset: str, beside: str | None, velocity: int, duration: float, quality: str, output: Path | None,
    csv_file: Path | None,
) -> None:  # fmt: skip
    """Pluck every note of a bass, and show where the neck buzzes.

    The bass's player plays each fret of each string once, on strings at rest. The table has, for each note, the number
    of contacts with frets or board from the release on, and when the last one comes: buzz that lasts. A note that frets
    out, as the string lies on a higher fret at rest, has that fret instead.

    \b
    Examples:
      livebass map -p mine.toml -o neck.png
      livebass map -p jazz-finger --beside mine.toml --velocity 110 --csv neck.csv
    """
    if output is not None and output.suffix.lower().removeprefix(".") not in PICTURES:
        raise click.UsageError(f"{output}: a picture's name ends in .png or .svg")
    options.files_to_write({"--output": output, "--csv": csv_file})
    from livebass.lab.experiment import fretmap
    from livebass.preset.load import load_preset
    from livebass.report.picture import check_plots

    basses = [load_preset(name) for name in (preset, beside) if name is not None]
    if output is not None:
        check_plots("map -o")
    have_kernels()
    maps = []
    for bass in basses:
        with shown_progress(f"plucking {one_line(bass.name)}") as progress:
            made = fretmap.fret_map(
                bass, velocity=velocity, duration=duration, quality=QUALITIES[quality], progress=progress
            )
        maps.append(made)
    options.write_results(
        [
            (output, lambda: fretmap.picture(maps, output.suffix.lower().removeprefix(".") if output else "png")),
            (csv_file, lambda: fretmap.csv(maps)),
        ],
        fretmap.table(maps),
    )
