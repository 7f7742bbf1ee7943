"""`livebass simulate`: one string and one pluck to look at."""

from __future__ import annotations

from pathlib import Path

import click

from livebass import limits
from livebass.cli_render import announce_kernels
from livebass.cli_values import CONTACT_RATE, MODES, RATE, Number, Quantity
from livebass.quality import QUALITIES


@click.command()
@click.option("-p", "--preset", metavar="NAME|FILE", default="paper-g", show_default=True, help="The bass.")
@click.option("--string", "string", default="G", show_default=True, help="Name of the string.")
@click.option(
    "--fret", type=Number("number", 0, 36, whole=True), default=0, show_default=True, help="0: open."
)
@click.option(
    "--apex",
    type=Quantity(*limits.APEX),
    default=3.6e-3,
    show_default="3.6mm",
    help="Height of the plucked corner.",
)
@click.option(
    "--at",
    "at",
    type=Quantity(*limits.AT),
    default=0.64,
    show_default="0.64m",
    help="Where it is, from the stop (the nut or the fret).",
)
@click.option(
    "--angle", type=Quantity(*limits.ANGLE), default=0.0, show_default="0deg", help="Of the pluck, from straight up."
)
@click.option("--duration", type=Quantity(*limits.DURATION), default=1.0, show_default="1 s")
@click.option("-q", "--quality", type=click.Choice(list(QUALITIES)), default="reference", show_default=True)
@click.option("--modes", type=MODES, help="Modes of the string as stopped, instead of the quality's.")
@click.option("--contact-rate", type=CONTACT_RATE, help="Such as 8MHz, instead of the quality's.")
@click.option("--rate", type=RATE, default=44100, show_default=True, help="Samples a second of the output.")
@click.option(
    "--solver",
    type=click.Choice(["engine", "reference"]),
    default="engine",
    show_default=True,
    help="reference: brute force, step by step, slow.",
)
@click.option("--analyse", is_flag=True, help="Also pitch, characteristic frequency, energies and T60.")
@click.option(
    "--shape-at", type=Quantity("time", 0, 60), multiple=True, metavar="TIME",
    help="Also the string's shape then, such as 3.9ms; may be repeated.",
)  # fmt: skip
@click.option(
    "-o", "--output", type=click.Path(path_type=Path), required=True, metavar="DIR", help="Made if need be."
)
def simulate(
    preset: str, string: str, fret: int, apex: float, at: float, angle: float, duration: float, quality: str,
    modes: int | None, contact_rate: float | None, rate: int, solver: str, analyse: bool, shape_at: tuple[float, ...],
    output: Path,
) -> None:  # fmt: skip
    """Pluck one string once and write what it did.

    Into DIR go displacement.wav (at the sensor, scaled to a peak of -1 dBFS; wav_metres_per_unit in
    result.npz makes metres of it), contacts.csv (time_s,fret,position_m; fret 0: wood) and result.npz
    (all of it): all three or none.

    With --analyse result.npz also has the pitch over time (YIN), the characteristic frequency (eq. 14; needs SciPy),
    T60 by mode and, with the engine, the energy of all and of each mode at some 100 times.

    \b
    Example, case B of Issanchou et al. (2018):
      livebass simulate --preset paper-g --apex 3.6mm --at 0.64 -o case-b
    """
    from livebass.instrument import speaking
    from livebass.preset import load_preset
    from livebass.quality import modes_for, quality_with
    from livebass.simulate import simulate_to_directory

    bass = load_preset(preset)
    chosen = quality_with(quality, modes, contact_rate)
    if modes is None and chosen.modes is not None:
        index = bass.string_index(string)
        part = speaking(bass.strings[index], bass.necks[index], fret)
        modes = modes_for(chosen, part.length, bass.strings[index].length, part.grid_points)
    if solver == "engine":
        announce_kernels()
    line = simulate_to_directory(
        bass, string=string, fret=fret, apex=apex, at=at, duration=duration, modes=modes,
        contact_rate=chosen.contact_rate, rate=rate, solver=solver, directory=output, angle=angle,
        analyse=analyse, shape_at=shape_at,
    )  # fmt: skip
    click.echo(line, err=True)
