"""`livebass presets` lists, shows and checks presets; `livebass identify` makes one from recordings of a string."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import click

from livebass.cli import options
from livebass.cli.messages import fretting_out, say, wrap_row
from livebass.cli.tuning import TUNING_KEYS
from livebass.cli.values import NOTE, Number, Quantity
from livebass.lab.identification import limits
from livebass.rows.units import one_line


@click.group()
def presets() -> None:
    """List, show or check presets.

    A preset is a text file (TOML) that describes a bass and its player.
    """


@presets.command("list")
@options.flag("--sounds", "List the factory sounds instead: basses with sliders, effects and a way to play them.")
@options.flag("--revisions", "List the presets' revisions instead: each loads as NAME@REVISION.")
def list_(sounds: bool, revisions: bool) -> None:
    """List the presets that come with livebass.

    Basses come first, then experiments. GM is the General MIDI program, counted from 1, that chooses the bass.
    `-p` takes sounds, too.
    """
    from livebass.preset.load import laboratory_names, load_preset, preset_names
    from livebass.preset.programs import PROGRAMS
    from livebass.preset.revisions import revision_table
    from livebass.preset.sounds import sound_description, sound_names

    if sounds and revisions:
        raise click.UsageError("give one of --sounds and --revisions: sounds have none")
    if revisions:
        click.echo(revision_table(), nl=False)
        return
    if sounds:
        for name in sound_names():
            click.echo(wrap_row(f"{name:{max(map(len, sound_names())) + 2}}", sound_description(name)))
        return
    names = preset_names() + laboratory_names()
    chosen = {name: " ".join(str(n) for n, preset in PROGRAMS.items() if preset == name) for name in names}
    rows = [("NAME", "GM", "BASS"), *((name, chosen[name], load_preset(name).description) for name in names)]
    first, second = (max(len(row[k]) for row in rows) + 2 for k in (0, 1))
    for name, programs, description in rows:
        click.echo(wrap_row(f"{name:{first}}{programs:{second}}", description))


@presets.command()
@click.argument("name")
def show(name: str) -> None:
    """Print a preset, to start your own.

    \b
    Example:
      livebass presets show jazz-finger > mine.toml
    """
    from livebass.preset.load import preset_text

    click.echo(preset_text(name).encode(), nl=False)  # UTF-8, whatever encoding the terminal uses


@presets.command()
@click.argument("file")
def check(file: str) -> None:
    """Check a preset FILE.

    An error names the key, its value and the limits. For a good preset the command names keys that change no note, and
    says why; notes that fret out, as the string lies on a higher fret at rest; and wolves, notes that the neck keeps
    from their pitch.
    """
    from livebass.preset.checks import wolves
    from livebass.preset.idle import idle_keys
    from livebass.preset.load import load_preset, preset_tables, renamed_keys

    bass = load_preset(file)
    strings = " ".join(s.name for s in bass.strings)
    frets = len(bass.necks[0].fret_positions)
    several = "s" * (len(bass.strings) != 1), "s" * (frets != 1)
    click.echo(one_line(f"{file}: good; {bass.name}, string{several[0]} {strings}, {frets} fret{several[1]}"))
    if (response := bass.effects.response) and response.remark:
        click.echo(one_line(response.remark))
    for line in renamed_keys(file):
        click.echo(one_line(f"{file}: {line}"))
    if line := fretting_out(bass):
        click.echo(one_line(f"{file}: {line}"))
    if notes := [
        f"{string} at {bass.neck(string).fret_text(fret, board='')} ({abs(off):.0f} cents {way})"
        for string, fret, off in wolves(bass)
        for way in ["sharp" if off > 0 else "flat"]
    ]:
        why = "the neck resonates at the fundamental and splits it into two lines, none of them at the pitch"
        click.echo(one_line(f"{file}: {', '.join(notes)}: {why}; heavier neck.resonance_masses bring them closer"))
    by_reason: dict[str, list[str]] = {}
    for place, why in idle_keys(preset_tables(file)[1], file):
        by_reason.setdefault(why, []).append(place)
    for why, places in by_reason.items():
        click.echo(one_line(f"{file}: {', '.join(places)} change{'s' * (len(places) == 1)} no note: {why}"))


@presets.command()
def keys() -> None:
    """List the keys of a preset: limits, defaults and meanings."""
    from livebass.preset.load import preset_reference

    click.echo(preset_reference(), nl=False)


@presets.command()
@click.argument("key_map", metavar="NAME|FILE", default="modo")
def keymap(key_map: str) -> None:
    """Print a key map: what MIDI keys and controllers do.

    livebass comes with modo (the default, as in MODO BASS) and modo-12 (an octave higher). The command also checks a
    FILE of your own, for --keys of play, render and export, or player.keys of a preset.

    \b
    Example:
      livebass presets keymap modo > mine.toml
    """
    from livebass.preset.keymap import key_map_text, load_key_map

    click.echo(key_map_text(load_key_map(key_map)).encode(), nl=False)


MAX_RESONANCES = 16


@click.command()
@click.argument("recordings", nargs=-1, required=True, type=options.PATH, metavar="RECORDING...")
@options.preset_option(
    "The bass that has the string; the new preset takes everything else from it.",
    default=options.DEFAULT_PRESET,
    show_default=True,
)
@options.option("--string string", str, "Name of the string.  [default: the one tuned nearest]", metavar="NAME")
@options.option("--note", NOTE, "Its open note.  [default: the note of --string, or the pitch heard]")
@options.option("--f0", Quantity(*limits.F0), "Its pitch in Hz, within a semitone, instead of --note.")
@options.option("--modes", Number("count", *limits.MODES, whole=True), "Number of partials to look for.", default=60)
@options.option(
    "--start",
    Quantity(*limits.START),
    "Time to skip after each attack; more if the string rattles.",
    default="20ms",
)
@options.option("--duration", Quantity(*limits.DURATION), "Longest part of each note to use.", default="5s")
@options.option(
    "--channel",
    Number("number", *limits.CHANNELS, whole=True),
    "Channel of the recordings; 1 is left.  [default: the loudest]",
)
@options.option(
    "--neck",
    click.Choice(["table", "resonances"]),
    "How the preset describes the loss to the neck: by partial, or by resonances (takes about 10 s).",
    default="table",
)
@options.flag("--only-string", "Fit only the string; keep the preset's pluck, pickups and tone.")
@options.file_option("-o --output", "Preset to write.", metavar="FILE.toml")
@options.file_option("--json json_file", "Write all results as JSON.")
@options.file_option("--csv csv_file", "Write the partials as CSV.")
def identify(
    recordings: tuple[Path, ...], preset: str, neck: str, output: Path | None, json_file: Path | None,
    csv_file: Path | None, **how: Any,
) -> None:  # fmt: skip
    """Measure an open string from recordings.

    Pluck the string alone, softly enough to miss the frets. Let each note ring, and damp the other strings. A pluck
    close to the nut and a pickup close to the bridge show the most partials. RECORDINGs (WAV, FLAC, Ogg ...) may hold
    several notes; the command then gives medians and their scatter.

    Prints the frequency and damping of each partial (by ESPRIT), the f0 and B of the law that fits better,
    j f0 sqrt(1 + B j^2) or j f0 (1 + B j^2 / 2), and the losses. The glide of a hard note is removed first. T60 is the
    decay you hear. A partial of two lines shows the string swinging in two directions: the line that dies sooner is u,
    away from the neck, the other is v, across it. If neck.stiffness_across and neck.longer_across explain several such
    partials, the preset gets them. The levels of the partials tell the place of the pluck, the finger, the pickups and
    the tone.

    Lines that begin "doubt:" name what the command leaves out (clipped sound, loops, fades, other notes, partials that
    no string has), and cuts and compression. -o writes a preset for `livebass render`, `play` and `simulate`: the
    preset of -p with this string, pluck, pickups and tone.

    \b
    Examples:
      livebass identify g-string.wav
      livebass identify take1.wav take2.wav take3.wav --string E -o mine.toml
      livebass render --note E1 --preset mine.toml
    """
    if how["note"] is not None and how["f0"] is not None:
        raise click.UsageError("give one of --note and --f0")
    if output is not None and output.suffix != ".toml":
        raise click.UsageError(f"{output}: a preset's name ends in .toml")
    outputs = options.files_to_write({"--output": output, "--json": json_file, "--csv": csv_file}, recordings)
    from livebass.preset.load import load_preset, preset_tables
    from livebass.report.picture import check_installed

    bass = load_preset(preset)
    if output is not None and (keys := [key for key in TUNING_KEYS if key in preset_tables(preset)[1]]):
        raise click.UsageError(
            f"--preset {preset}: its {', '.join(keys)} would tune the new string again: leave out -o"
        )
    check_installed("identify", "analysis", ("scipy.signal", "tomlkit"))
    from livebass.lab.identification.fit import fit_neck
    from livebass.lab.identification.identify import identify as identify_string
    from livebass.lab.identification.preset_text import new_preset
    from livebass.lab.identification.result import with_resonances
    from livebass.lab.identification.tables import identified_json, neck_table, partials_csv, table

    result = identify_string(recordings, bass, **how)
    fit = fit_neck(result.string, maximum=MAX_RESONANCES) if neck == "resonances" else None
    resonances = fit.resonances if fit else ()
    if fit:
        result = with_resonances(result, bass, resonances)
    made: list[tuple[Path | None, Callable[[], str | bytes]]] = [
        (output, lambda: new_preset(preset, result.string.name, result, recordings, resonances)),
        (json_file, lambda: identified_json(result, resonances)),
        (csv_file, lambda: partials_csv(result)),
    ]
    options.write_results(made, table(result) + (neck_table(fit) if fit else ""))
    notes, count = len(result.takes), len(result.partials)
    written = f" -> {', '.join(map(str, outputs))}" if outputs else ""
    left = f", {result.rejected} more not used: of another pitch, short or unclear" if result.rejected else ""
    say(f"string {result.string.name}: {count} partials from {notes} note{'s' * (notes != 1)}{left}{written}")
