"""`livebass presets`: what basses there are and what a preset file may say."""

from __future__ import annotations

import click


@click.group()
def presets() -> None:
    """List, show or check presets: TOML files that describe a bass and its player."""


@presets.command("list")
def list_() -> None:
    """The presets that come with livebass: basses in the order of MIDI programs, then experiments."""
    from livebass.preset import laboratory_names, load_preset, preset_names

    names = preset_names() + laboratory_names()
    width = max(map(len, names), default=0)
    for name in names:
        click.echo(f"{name:{width}}  {load_preset(name).description}")


@presets.command()
@click.argument("name")
def show(name: str) -> None:
    """The TOML text of a preset, a start for one's own.

    \b
    Example:
      livebass presets show jazz-finger > mine.toml
    """
    from livebass.preset import preset_text

    click.echo(preset_text(name), nl=False)


@presets.command()
@click.argument("file")
def check(file: str) -> None:
    """See whether a preset FILE can be used: an error names key, value and what is allowed."""
    from livebass.preset import load_preset

    bass = load_preset(file)
    strings = " ".join(s.name for s in bass.strings)
    frets = len(bass.necks[0].fret_positions)
    several = "s" * (len(bass.strings) != 1), "s" * (frets != 1)
    click.echo(f"{file}: good; {bass.name}, string{several[0]} {strings}, {frets} fret{several[1]}")


@presets.command()
def keys() -> None:
    """Every key of a preset file with what is allowed, its default and meaning."""
    from livebass.preset import preset_reference

    click.echo(preset_reference(), nl=False)
