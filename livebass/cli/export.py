"""`livebass export`: exports a bass for other programs."""

from __future__ import annotations

import os
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from livebass.cli.effects import effects_options
from livebass.cli.hands import Hands, Loader, hands_options, velocity_curve_option
from livebass.cli.messages import say
from livebass.cli.options import (
    DEFAULT_PRESET,
    PATH,
    count_option,
    file_option,
    flag,
    folder_option,
    folder_to_write,
    option,
    preset_option,
    presets_option,
    quality_option,
    rendered_quality,
    seed_option,
)
from livebass.cli.practice import page_basses, page_tab_options
from livebass.cli.progress import have_kernels, shown_progress
from livebass.cli.shelf import basses_of, page_ready
from livebass.cli.tabs import TabOptions, tab_options
from livebass.cli.tuning import load_tuned, tuning_of_options, tuning_options
from livebass.cli.values import RATE, Quantity
from livebass.model.quality import AUTO, QUALITIES
from livebass.plugin.export import BUNDLES
from livebass.rows.bounds import either
from livebass.rows.units import one_line

if TYPE_CHECKING:
    from livebass.model.instrument import Instrument

LENGTH = (0.1, 60.0)  # s
RATE_OF_HOSTS = 48000  # Hz, assumed when measuring this machine


class SystemOption(click.Option):
    """The option that names a system; its help lists them from a file that other commands need not load."""

    def get_help_record(self, ctx: click.Context) -> tuple[str, str] | None:
        from livebass.plugin.systems import SYSTEMS

        *maximum, last = SYSTEMS
        self.help = f"System to build for: {', '.join(maximum)} or {last}.  [default: this one]"
        return super().get_help_record(ctx)


@click.group()
def export() -> None:
    """Export plugins, a web page, sample packs, or tablature as MIDI.

    Export needs no network.
    """


def plugin_command(kind: str) -> click.Command:
    """The command that writes plugins of one format, a key of BUNDLES."""

    @click.command(
        kind,
        short_help=f"Write a plugin for {kind.upper()} hosts.",
        help=f"""
        Write a plugin for {kind.upper()} hosts that plays presets without Python.

        The plugin is a folder, {BUNDLES[kind]}. --install puts it where hosts look for your plugins. Otherwise copy it
        there; the command prints where. Delete the folder to uninstall it. An interrupted export leaves nothing behind.

        From a release wheel this takes a second or two. A checkout first builds the plugin, once, in about a minute,
        with the C compiler of your system or of the extra `export`.

        \b
        Examples:
          livebass export {kind} --install
          livebass export {kind} --install -p slap -p ./mine.toml
          livebass export {kind} --system windows-x86_64 -o for-windows
        """,
    )
    @presets_option
    @hands_options
    @effects_options
    @folder_option(
        f"Folder to write {BUNDLES[kind]} into; created if missing. An older one is replaced.  "
        "[default: the current directory]"
    )
    @flag("--install", "Write the plugin where hosts on this system look for it.")
    @click.option("--system", cls=SystemOption, metavar="NAME")
    @quality_option(
        AUTO,
        "Quality of a new track. auto: with --install, studio if this machine can play the bass in it; else live.",
        among=(AUTO, "live", "studio"),
    )
    @tuning_options
    @click.argument("more", nargs=-1, metavar="")
    def write(
        presets: tuple[str, ...], output: Path | None, install: bool, system: str | None, quality: str,
        more: tuple[str, ...], **options: Any,
    ) -> None:  # fmt: skip
        if install and (output is not None or system is not None):
            raise click.UsageError(f"--install and {'-o' if output is not None else '--system'}: give one of them")
        _write_plugin(kind, basses_of(presets, more, Loader(options)), output, install, system, quality)

    return write


for format_ in BUNDLES:
    export.add_command(plugin_command(format_))


def _write_plugin(
    kind: str, basses: dict[str, Instrument], output: Path | None, install: bool, wanted: str | None, quality: str
) -> None:
    from livebass.files.whole import checked_directory
    from livebass.plugin import build
    from livebass.plugin.export import export_plugin
    from livebass.plugin.systems import SYSTEMS, VST3_PRESETS, folder_of_plugins, own_folder_of_plugins, this_system

    if wanted is not None and wanted not in SYSTEMS:
        raise click.UsageError(f"--system must be {either(SYSTEMS)}, not {wanted}")
    system = SYSTEMS[wanted] if wanted else this_system()
    plugin: Any = import_module(f"livebass.plugin.{kind}")
    folder = (own_folder_of_plugins(kind) if install else output or Path()) / BUNDLES[kind]
    checked_directory(folder, plugin.is_bundle)  # now, not after a minute of work
    missing = not build.is_built(system)
    if missing:
        build.compiler(system)  # raises now if the compiler is missing
    have_kernels()
    if missing:
        say(f"building the plugins for {system.name}, once (about {build.BUILD_TIME} s) ...")
    export_plugin(kind, basses, folder.parent, system.name, _qualities(basses, install, quality))
    say(f"{folder}: {_content(basses, folder)}, for {system.name}")
    if install and kind == "vst3":
        plugin.write_presets(basses, own_folder_of_plugins(VST3_PRESETS))
    copy = "" if install else f"copy it into {folder_of_plugins(system, kind)} and "
    say(f"{copy}let your host look for new plugins")


def _qualities(basses: dict[str, Instrument], install: bool, quality: str) -> dict[str, str]:
    """The initial quality of each plugin, by name of its bass; prints the choice."""
    if quality != AUTO or not install:
        return dict.fromkeys(basses, quality)
    from livebass.live.best_quality import best_qualities

    found = best_qualities(basses, RATE_OF_HOSTS)
    fine = [name for name, best in found.items() if best != "live"]
    chosen = "live" if not fine else "studio" if len(fine) == len(found) else f"studio for {', '.join(fine)}, else live"
    say(f"new tracks begin in the best quality for this machine: {chosen}; --quality sets another")
    return found


@export.command()
@presets_option
@hands_options
@effects_options
@folder_option(
    "Folder to write; created if missing. It may be empty or hold an older page, which is replaced.", required=True
)
@flag("--single", "Write one HTML file, livebass.html, which also plays from disk.")
@option("--address", str, "Public address of the page, for its links, pictures and previews.", metavar="URL")
@page_tab_options
@quality_option("live", "Precision of the strings; studio needs a fast computer.", among=("live", "studio"))
@tuning_options
@click.argument("more", nargs=-1, metavar="")
def web(
    presets: tuple[str, ...], output: Path, single: bool, address: str | None, quality: str, more: tuple[str, ...],
    **options: Any,
) -> None:  # fmt: skip
    """Write a web page that plays presets, by keys, touch or MIDI.

    The page is a folder for a web server, over https or on localhost. With --single it is one file that also plays from
    disk. It plays without a network, in Chrome 97, Edge 97, Firefox 113, Safari 16.4 or later.

    From a release wheel this takes a second. A checkout first compiles the kernels for browsers, once, in about half a
    minute.

    \b
    Examples:
      livebass export web -o page --single
      livebass export web -p slap -p fretless -o page
      livebass export web -p ./mine.toml -o site/bass -q studio
      livebass export web --tab song.gp5 -o page --single
      livebass export web -o site/bass --address https://example.org/bass/
    """
    from livebass.files.whole import checked_directory
    from livebass.web.export import export_page, is_page
    from livebass.web.public import checked_address

    try:
        public = {"address": checked_address(address)} if address is not None else {}
    except ValueError as error:
        raise click.UsageError(f"--address: {error}") from None
    basses, sources, data = page_basses(presets, more, options)
    checked_directory(output, is_page)  # now, not after a minute of work
    page_ready()
    page = export_page(basses, output, single, quality, sources, data | public)
    where = "open it in a browser" if single else "put the folder on a web server"
    say(f"{page}: {_content(basses, output)}; {where}")


@export.command()
@click.argument("preset", metavar="NAME|FILE")
@hands_options
@effects_options
@file_option(
    "-o --output", "File to write, NAME.lbass.  [default: where installed plugins look, in your home directory]"
)
@tuning_options
def instrument(preset: str, output: Path | None, **options: Any) -> None:
    """Add a bass to the installed plugins.

    Every livebass plugin lists the bass when the host loads the plugin again. LV2 hosts get a preset, if livebass.lv2
    is in your plugin folder. An older file of the same name is replaced.

    \b
    Examples:
      livebass export instrument ./mine.toml
      livebass export instrument ./mine.toml -o mine.lbass
    """
    from livebass.files.whole import Transaction, checked_place
    from livebass.plugin import lv2
    from livebass.plugin.bundle import checked_name, own_instruments
    from livebass.plugin.instrument import ENDING, write_instrument
    from livebass.plugin.systems import own_folder_of_plugins
    from livebass.preset.load import preset_names

    if output is not None and output.suffix != ENDING:
        raise click.UsageError(f"{output}: the name of an instrument file ends in {ENDING}")
    bass = Loader(options)(preset)
    name = checked_name(output.stem if output else Path(preset).stem)
    file = output or own_instruments() / f"{name}{ENDING}"
    if output is None:  # now, not after compiling
        folder_to_write(file.parent)
    else:
        checked_place(output)
    have_kernels()
    with Transaction() as files:
        if output is None:
            files.directory(file.parent)
        write_instrument(bass, file, files)
    where = "plugins list it when their host loads them again"
    if output is not None and output.parent.resolve() != own_instruments().resolve():
        where = f"plugins look for it in {own_instruments()}"
    elif name in preset_names():
        where = f"a plugin that comes with a bass called {name} lists its own instead: give the file another name"
    say(f"{file}: {bass.name}; {where}")
    if output is None:  # LV2 hosts know only basses in bundles
        folder = own_folder_of_plugins("lv2")
        if (folder / BUNDLES["lv2"]).is_dir():
            lv2.write_preset(name, bass.name, folder / f"livebass-{name}.lv2")
            say(f"{folder / f'livebass-{name}.lv2'}: a preset with it, for the menus of LV2 hosts")


@export.command()
@click.argument("tab", type=PATH)
@file_option("-o --output", "MIDI file to write.  [default: the name of TAB, in the current directory]")
@flag("--plain", "For notation and other synthesizers: without key switches and without controllers of livebass.")
@preset_option("The bass that plays it.  [default: by the strings and the program of the track]")
@hands_options
@effects_options
@tab_options
@tuning_options
def midi(tab: Path, output: Path | None, plain: bool, preset: str | None, **options: Any) -> None:
    """Write a tablature as a MIDI file.

    Each string has its own MIDI channel, the highest string channel 1; key switches call the techniques. The file has
    the tempos, time signatures and section names of the tablature. What the key map has no key for is left out and
    counted. In a DAW put it on one track with a livebass plugin, and choose the same bass and tuning there. For other
    programs each channel has a General MIDI program and a bend range of 12 semitones. Hosts may send the program to the
    plugin, which then plays on that program's bass: remove it if you chose another.

    With --plain notes have the pitch that sounds, all on channel 1; only a note that bends, slides or fades while
    another one sounds has a channel of its own. Slides and bends move the pitch wheel, and the goal of a slide begins
    as it arrives. Vibrato is the modulation wheel. Notes of the left hand and dead notes are softer; dead notes last 60
    ms, palm-muted ones up to 200 ms. Slaps, pops, taps and the pick's direction are plain notes.

    \b
    Examples:
      livebass export midi song.gp5
      livebass export midi song.gp5 --plain -o for-musescore.mid
      livebass export midi song.gp --track Bass --bars 9-16 -o riff.mid
    """
    from livebass.cli.song import AUTO, Song
    from livebass.files.whole import Transaction

    wanted = TabOptions.from_options(options, options)
    data, remark = Song(tab, AUTO, preset, wanted, Loader(options)).arrangement().exported(plain)
    output = output or Path(f"{tab.stem}.mid")
    if output.exists() and os.path.samefile(tab, output):
        raise click.UsageError(f"{output}: is the tablature itself; name another file with -o")
    with Transaction() as files:
        files.write(output, data)
    say(f"{tab}: {remark}")
    say(f"{output}: {len(data) / 1000:.1f} kB")


@export.command()
@preset_option(
    "The bass: a name from `livebass presets list`, or your own file.", default=DEFAULT_PRESET, show_default=True
)
@folder_option("Folder to write; created if missing. It may be empty or hold an older pack, which is replaced.")
@tuning_options
@rendered_quality
@velocity_curve_option
@count_option("--frets", 36, "Sample every nth fret, 1 to 36; 1: all.", default=3)
@count_option("--layers", 32, "Number of velocities sampled per note, 1 to 32.", default=5)
@count_option(
    "--robins", 32, "Alternating samples per velocity, 1 to 32; 1 if the preset has no player.unevenness.", default=2
)
@option(
    "--length",
    Quantity("time", *LENGTH),
    "Longest sample, 100ms to 60s. Longer notes fade out over the last quarter.",
    default="8s",
)
@option("--rate", RATE, "Sample rate, 22050 to 192000 Hz.", default=48000)
@seed_option()
@flag("--size", "Write nothing; print the number of samples and their size.")
def sfz(preset: str, output: Path | None, quality: str, velocity_curve: Any, size: bool, **options: Any) -> None:
    """Render a preset into a sample pack for SFZ samplers.

    The pack is a folder with NAME.sfz, 24-bit FLAC samples and LICENSE.txt, which lets anyone use them for anything. An
    interrupted export leaves nothing behind.

    \b
    Examples:
      livebass export sfz -p slap -o slap-bass
      livebass export sfz -p slap --frets 1 --layers 8 --robins 4 --size
      livebass export sfz -p ./mine.toml -o mine -q live --length 4s
    """
    if output is None and not size:
        raise click.UsageError("name the folder to write with -o DIR")
    from livebass.export.sfz import Pack, PackSettings, estimated_size, export_sfz, is_pack
    from livebass.files.whole import checked_directory

    hands = Hands({} if velocity_curve is None else {"velocity_curve": velocity_curve})
    bass = hands.play(load_tuned(preset, tuning_of_options(options)))
    settings = PackSettings(QUALITIES[quality], **options)
    try:
        pack = Pack(bass, Path(preset).stem, settings)
    except ValueError as error:
        raise click.UsageError(str(error)) from None
    if output is not None and not size:
        checked_directory(output, is_pack)  # now, not after seconds of work
    have_kernels()
    several = "ies" if len(pack.velocities) > 1 else "y"
    there = f"{len(pack.samples)} samples at velocit{several} {', '.join(map(str, pack.velocities))}"
    expected = f"{pack.name}: {there}, about {_megabytes(estimated_size(pack))}"
    if output is None or size:
        click.echo(one_line(expected))
        return
    say(expected)
    with shown_progress(output.name) as progress:
        report = export_sfz(bass, output, pack.name, settings, progress)
    say(f"{report.sfz}: {report.samples} samples, {report.duration_s:.0f} s, {_megabytes(report.size)}")


def _content(basses: dict[str, Instrument], folder: Path) -> str:
    """Number of basses, and the size of a folder with them."""
    size = sum(file.stat().st_size for file in folder.rglob("*") if file.is_file())
    return f"{len(basses)} bass{'es' * (len(basses) > 1)}, {_megabytes(size)}"


def _megabytes(size: int) -> str:
    return f"{size / 1e6:.2g} MB" if size < 1e8 else f"{size / 1e6:.0f} MB"
