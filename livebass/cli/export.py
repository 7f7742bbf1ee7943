"""`livebass export`: a bass as what other programs play."""

from __future__ import annotations

from pathlib import Path

import click

from livebass.cli.render import DEFAULT_PRESET, announce_kernels, quality_option, shown_progress
from livebass.cli.values import RATE, Number, Quantity
from livebass.model.quality import QUALITIES

LENGTH = (0.1, 60.0)  # s


@click.group()
def export() -> None:
    """Turn a preset into what other programs play.

    Nothing here needs the network.
    """


@export.command()
@click.option(
    "-p",
    "--preset",
    metavar="NAME|FILE",
    default=DEFAULT_PRESET,
    show_default=True,
    help="The bass: a name from `livebass presets list`, or your own file.",
)
@click.option(
    "-o",
    "--output",
    type=click.Path(path_type=Path),
    metavar="DIR",
    help="The folder to write; made if missing. It may be empty or hold an older pack, which is replaced.",
)
@quality_option
@click.option(
    "--frets",
    type=Number("count", 1, 36, whole=True),
    default=3,
    show_default=True,
    help="Sample one of so many neighbouring frets; 1: each.",
)
@click.option(
    "--layers",
    type=Number("count", 1, 32, whole=True),
    default=5,
    show_default=True,
    help="Velocities at which each note is sampled.",
)
@click.option(
    "--robins",
    type=Number("count", 1, 32, whole=True),
    default=2,
    show_default=True,
    help="Samples of each note and velocity, which take turns; 1 where the preset has no player.unevenness.",
)
@click.option(
    "--length",
    type=Quantity("time", *LENGTH),
    default=8.0,
    show_default="8s",
    help="Longest sample, 100ms to 60s. One that has not died away by then fades out over its last quarter.",
)
@click.option("--rate", type=RATE, default=48000, show_default=True, help="Samples a second, 22050 to 192000.")
@click.option(
    "--seed",
    type=Number("number", 0, 2**31, whole=True),
    default=0,
    show_default=True,
    help="Seed of the player's small irregularities; the same seed gives the same files.",
)
@click.option("--size", is_flag=True, help="Write nothing: print how many samples there would be, and their size.")
def sfz(
    preset: str, output: Path | None, quality: str, frets: int, layers: int, robins: int, length: float, rate: int,
    seed: int, size: bool,
) -> None:  # fmt: skip
    """Render a preset into a sample pack, for samplers that read SFZ.

    The pack is a folder: NAME.sfz, the samples as FLAC of 24 bits, and LICENSE.txt, which lets anyone use them for
    anything. It appears when it is complete; an interrupted export leaves nothing behind.

    \b
    Examples:
      livebass export sfz -p slap -o slap-bass
      livebass export sfz -p slap --frets 1 --layers 8 --robins 4 --size
      livebass export sfz -p ./mine.toml -o mine -q live --length 4s
    """
    if output is None and not size:
        raise click.UsageError("name the folder to write with -o DIR")
    from livebass.export.sfz import Pack, Settings, estimated_size, export_sfz, is_pack
    from livebass.files import checked_directory
    from livebass.preset.load import load_preset

    bass = load_preset(preset)
    settings = Settings(QUALITIES[quality], rate, frets, layers, robins, length, seed)
    try:
        pack = Pack(bass, Path(preset).stem, settings)
    except ValueError as error:
        raise click.UsageError(str(error)) from None
    if output is not None and not size:
        checked_directory(output, is_pack)  # now, not after seconds of work
    announce_kernels()
    several = "ies" if len(pack.velocities) > 1 else "y"
    there = f"{len(pack.samples)} samples at velocit{several} {', '.join(map(str, pack.velocities))}"
    expected = f"{pack.name}: {there}, about {_megabytes(estimated_size(pack))}"
    if output is None or size:
        click.echo(expected)
        return
    click.echo(expected, err=True)
    with shown_progress(output.name) as progress:
        report = export_sfz(pack, output, progress)
    click.echo(
        f"{report.sfz}: {report.samples} samples, {report.duration_s:.0f} s, {_megabytes(report.size)}", err=True
    )


def _megabytes(size: int) -> str:
    return f"{size / 1e6:.2g} MB" if size < 1e8 else f"{size / 1e6:.0f} MB"
