"""`livebass render`: renders a MIDI file, a tablature, a note or a demo phrase to a sound file."""

from __future__ import annotations

import math
import os
import shutil
import sys
from collections.abc import Callable
from dataclasses import dataclass, fields, replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any

import click

from livebass.cli.demos import demo_for, demo_option, ready_for
from livebass.cli.effects import OPTIONS, effects_options
from livebass.cli.groups import GroupedCommand
from livebass.cli.hands import Loader, hands_options
from livebass.cli.messages import clipping, say, say_choked
from livebass.cli.options import (
    DEFAULT_PRESET,
    PATH,
    count_option,
    file_option,
    flag,
    is_given,
    option,
    preset_option,
    rendered_quality,
    seed_option,
)
from livebass.cli.progress import have_kernels, shown_progress
from livebass.cli.tabs import TabOptions, tab_options
from livebass.cli.tuning import tuning_options
from livebass.cli.values import CONTACT_RATE, MODES, NOTE, RATE, Note, Number, Parsed, Quantity, channel
from livebass.rows.units import one_line

if TYPE_CHECKING:
    from livebass.cli.song import Song
    from livebass.engine.render import RenderReport
    from livebass.files.whole import Transaction
    from livebass.model.instrument import Instrument
    from livebass.score.score import Score

STREAM = Path("-")  # standard input or output
FORMATS, BITS = ("wav", "flac", "ogg"), ("16", "24", "float")


@dataclass(frozen=True)
class Options:
    """Options that apply to every render."""

    quality: str
    modes: int | None
    contact_rate: float | None  # Hz
    rate: int  # Hz
    format: str | None
    bits: str | None
    stems: bool
    tail: float | None  # s
    gain: float  # dB
    normalize: float | None  # LUFS
    seed: int


GROUPS = {
    "Music": "--note --velocity --duration --demo --all-presets --channel --track --bars --dynamics --list --tail",
    "Sound": "--preset --quality --gain --normalize --tuning --capo --a4 --temperament --modes --contact-rate --seed",
    "Hands": "--keys --velocity-curve --wheel --no-noise",
    "Effects": OPTIONS,
    "File": "--output --format --bits --rate --stems",
    "Help": "--help",
}


@click.command(cls=GroupedCommand, groups=GROUPS, surplus="-o names the sound file")
@click.argument("midi", required=False, type=PATH)
@option("--note", NOTE, "Play one note instead of a MIDI file: G2, C#1, 43; C4 is 60.")
@demo_option("Play")
@file_option("--all-presets directory", "Play the demo phrase with every preset, into DIR.", metavar="DIR")
@option(
    "-o --output",
    PATH,
    "Sound file to write; - for standard output.  "
    "[default: the name of the MIDI file or note, in the current directory]",
)
@preset_option(
    f"The bass: a name from `livebass presets list`, or your own file.  "
    f"[default: {DEFAULT_PRESET}, or the basses that the MIDI file asks for]"
)
@tuning_options
@rendered_quality
@hands_options
@effects_options
@count_option(
    "--velocity",
    127,
    "Velocity of --note. Soft notes miss the frets, hard notes hit them.",
    default=100,
    metavar="1-127",
)
@option("--duration", Quantity("time", 1e-3, 3600.0), "Length of --note, 1ms to 3600s.", default="3s")
@option(
    "--channel",
    Parsed("channel", channel),
    "MIDI channel to play. auto: the parts with a bass program, 33 to 40; else tracks called bass; else a MIDI guitar "
    "or MPE keyboard; else the only part, or the lowest without a program. all: everything but drums.",
    metavar="[auto|all|1-16]",
    default="auto",
)
@tab_options
@flag("--list listing", "Write no sound; list the parts or tracks of the file and which would play.")
@option("--rate", RATE, "Sample rate, 22050 to 192000 Hz.", default=48000)
@option("--format", click.Choice(FORMATS), "File format.  [default: by the name of OUTPUT, or wav]")
@option("--bits", click.Choice(BITS), "Bits per sample: 16, 24, float for wav; 16, 24 for flac.  [default: 24]")
@flag("--stems", "Also write a file per string, song.E.wav ...; they add up to the mix.")
@option(
    "--tail",
    Quantity("time", 0.0, 600.0),
    "Sound after the last event, 0 to 600 s.  [default: until the strings are still]",
)
@option("--gain", Number("db", -60, 40, unit="dB"), "Level in dB, -60 to 40.", default=0.0)
@option(
    "--normalize",
    Number("LUFS", -60, 0),
    "Integrated loudness, -60 to 0, such as -16, instead of --gain; lower if the peak would exceed -1 dBFS.",
)
@option("--modes", MODES, "Number of modes of an open string; replaces the quality's.")
@option(
    "--contact-rate",
    CONTACT_RATE,
    "Steps a second while a string touches a fret, such as 4MHz; replaces the quality's.",
)
@seed_option(2**32 - 1)
def render(output: Path | None, preset: str | None, directory: Path | None, listing: bool, **rest: Any) -> None:
    """Render a MIDI file, tablature, note or demo to a sound file.

    MIDI is a MIDI file of any type, a Guitar Pro or MusicXML file, or - for standard input. The new file replaces an
    old one when it is complete; an interrupted render leaves nothing behind.

    \b
    Examples:
      livebass render song.mid -o song.flac --preset precision-finger
      livebass render song.mid --list
      livebass render song.mid --channel 2 --stems --bits float
      livebass render song.gp5 --track Bass --bars 9-16
      livebass render --note E1 --velocity 127 --duration 5s --quality reference
      livebass render --demo --preset slap --tuning drop-d --a4 442
      livebass render --demo techniques -o techniques.wav
      livebass render --all-presets demos/
      livebass render song.mid --normalize -16
      livebass render --note E1 -o - | aplay
    """
    tab, load = TabOptions.from_options(rest, rest), Loader(rest)
    music = Music.from_options(rest)
    options = Options(**rest)
    check_together(music, output, directory, options)
    song = None
    if music.midi is not None:
        from livebass.cli.song import Song

        song = Song(music.midi, music.channel, preset, tab, load)
    if listing:
        if song is None:
            raise click.UsageError("--list needs a MIDI file or a tablature")
        click.echo(song.table(render))
    elif directory is not None:
        if output is not None or preset is not None:
            raise click.UsageError("--all-presets takes neither --output nor --preset")
        _render_presets(directory, options, load)
    else:
        output = output or Path(f"{music.name}.{options.format or 'wav'}")
        say(_render_music(music, song, output, preset, options, load))


@dataclass(frozen=True)
class Music:
    """The music to render: a MIDI file or tablature, a note or a demo."""

    midi: Path | None
    channel: str | int
    note: Note | None
    velocity: int
    duration: float  # s
    demo: str | None

    @classmethod
    def from_options(cls, options: dict[str, Any]) -> Music:
        """Takes its options out of a command's `options`."""
        return cls(**{f.name: options.pop(f.name) for f in fields(cls)})

    @property
    def name(self) -> str:
        """The name of its sound file, without extension."""
        if self.midi is not None:
            return "stdin" if self.midi == STREAM else self.midi.stem
        return self.note.written if self.note is not None else "demo"


def check_together(music: Music, output: Path | None, directory: Path | None, options: Options) -> None:
    """Raises UsageError for options that exclude each other."""
    source = click.get_current_context().get_parameter_source("gain")
    if options.normalize is not None and source is click.core.ParameterSource.COMMANDLINE:
        raise click.UsageError("--normalize sets the gain itself: leave out --gain")
    if output == STREAM and options.stems:
        raise click.UsageError("-o - writes one file: leave out --stems")
    if output == STREAM and sys.stdout.isatty():
        raise click.UsageError("-o - writes to a pipe or file, not to a terminal")
    if sum(one is not None for one in (music.midi, music.note, music.demo, directory)) != 1:
        raise click.UsageError("give one of: a MIDI file or tablature, --note, --demo, --all-presets")
    for names, wanted, what in (
        (("velocity", "duration"), music.note, "--note"),
        (("channel",), music.midi, "a MIDI file"),
        (("track", "bars", "dynamics"), music.midi, "a tablature"),
    ):
        if unused := [name for name in names if wanted is None and is_given(name)]:
            raise click.UsageError(f"--{unused[0]} is for {what}")


def _render_music(
    music: Music, song: Song | None, output: Path, preset: str | None, options: Options, load: Loader
) -> str:
    """Renders a MIDI file, a tablature, a note or a demo; returns the summary."""
    from livebass.cli.score_bass import basses_of, beyond_range, check_range, remarks
    from livebass.cli.take_bass import load_take_basses
    from livebass.files.whole import checked_place
    from livebass.score.score import single_note

    if output != STREAM:
        checked_place(output)
    score: Score | None = None
    loaded: Callable[[str], Instrument] = load
    basses = None
    if song is not None:
        score, preset = song.read(options.rate)
        if output.exists() and song.path.exists() and os.path.samefile(song.path, output):
            raise click.UsageError(f"{output}: is the file to play itself; name another file with -o")
        if preset is None:
            score, loaded = load_take_basses(score, load, DEFAULT_PRESET, render)
        for remark in remarks(score, preset, DEFAULT_PRESET):
            say(f"{song.path}: {remark}")
    elif music.note is not None:
        have_kernels()
        score = single_note(music.note, music.velocity, music.duration, options.rate)
    if score is not None and preset is None:
        bass, basses = basses_of(score, DEFAULT_PRESET, loaded)
    else:
        bass = load(preset or DEFAULT_PRESET)
    bass = ready_for(music.demo, bass)
    say_choked([bass, *(basses or {}).values()])
    if music.note is not None:
        check_range(bass, music.note, DEFAULT_PRESET)
    score = score or demo_for(bass, options.rate, music.demo)
    if output == STREAM:
        line = _render_to_stdout(bass, score, options, basses)
    else:
        line = _render_one(bass, score, output, options, basses=basses)
    return ", ".join([line, *(beyond_range(bass, score, DEFAULT_PRESET) if music.midi is not None else [])])


def _render_presets(directory: Path, options: Options, load: Callable[[str], Instrument]) -> None:
    """Renders the demo phrase with each preset; if one fails, writes no file."""
    from livebass.files.whole import Transaction
    from livebass.preset.load import preset_names

    lines = []
    with Transaction() as files:
        files.directory(directory)
        for name in preset_names():
            bass = load(name)
            say_choked([bass])
            score = demo_for(bass, options.rate)
            output = directory / f"{name}.{options.format or 'wav'}"
            lines.append(_render_one(bass, score, output, options, files))
    for line in lines:
        say(line)


def _render_one(
    bass: Instrument, score: Score, output: Path, options: Options, files: Transaction | None = None,
    basses: dict[int, Instrument] | None = None,
) -> str:  # fmt: skip
    """Renders to `output`, as part of the transaction `files` if given; returns the summary.

    `basses`, by program, are those that program changes choose.
    """
    return summary(_render(bass, score, output, options, files, basses), options.normalize)


def _render_to_stdout(bass: Instrument, score: Score, options: Options, basses: dict[int, Instrument] | None) -> str:
    """Renders to standard output the bytes that a file would have; returns the summary.

    The header of a sound file holds its length, so writing begins when the whole sound is rendered.
    """
    from livebass.files.whole import noted_output, output_error

    with TemporaryDirectory(prefix="livebass-") as folder, noted_output():
        output = Path(folder) / f"stdout.{options.format or 'wav'}"
        report = _render(bass, score, output, options, None, basses)
        try:
            with output.open("rb") as file:
                shutil.copyfileobj(file, sys.stdout.buffer)
            sys.stdout.buffer.flush()
        except BrokenPipeError:
            raise
        except OSError as error:
            raise output_error(STREAM, error) from None
    return summary(replace(report, files=(STREAM,)), options.normalize)


def _render(
    bass: Instrument, score: Score, output: Path, options: Options, files: Transaction | None,
    basses: dict[int, Instrument] | None,
) -> RenderReport:  # fmt: skip
    from livebass.files.whole import checked_place
    from livebass.model.quality import quality_with
    from livebass.sound.audiofile import encoding

    try:
        encoding(output, options.rate, options.format, options.bits)
        quality = quality_with(options.quality, options.modes, options.contact_rate)
    except ValueError as error:
        raise click.UsageError(str(error)) from None
    checked_place(output)
    from livebass.engine.render import render_to_file

    with shown_progress(one_line(output.name)) as progress:
        return render_to_file(
            bass, score, output, quality=quality, rate=options.rate, format=options.format, bits=options.bits,
            stems=options.stems, tail=options.tail, gain_db=options.gain, normalize=options.normalize,
            seed=options.seed, progress=progress, files=files, basses=basses,
        )  # fmt: skip


def summary(report: RenderReport, wanted: float | None = None) -> str:
    """Returns one line about a render; `wanted` is the requested loudness (LUFS)."""
    notes = f"{report.notes} note{'s' * (report.notes != 1)}"
    moved = f" ({report.transposed} transposed, {report.dropped} dropped"
    moved += f", {report.stolen} cut short for another)" if report.stolen else ")"
    if report.switches:
        moved += f", {report.switches} key switch{'es' * (report.switches != 1)}"
    speed = report.duration_s / report.wall_s if report.wall_s else 0.0
    line = (
        f"{report.files[0]}: {notes}{moved}, {report.duration_s:.2f} s, {speed:.2g} times real time, "
        f"peak {report.peak_db:.1f} dBFS"
    )
    if report.clipped:
        line += clipping(report.clipped, report.gain_db, report.peak_db)
    if wanted is not None and report.loudness is not None:
        line += normalizing(report.loudness, report.gain_db, wanted)
    if report.weakened:
        times = f"{report.weakened} time{'s' * (report.weakened != 1)}"
        line += f", {times} a motion was scaled back to what a string bears: please report it"
    return line


def normalizing(loudness: float, gain: float, wanted: float) -> str:
    """Tells the `loudness` (LUFS) that a `gain` (dB) gave, and why it is not the one `wanted`."""
    from livebass.engine.render import CEILING

    if math.isinf(loudness):
        return ", too quiet to be normalized"
    said = f", {loudness:.1f} LUFS by {gain:+.1f} dB"
    return said if loudness > wanted - 0.05 else f"{said}: {wanted:g} LUFS would bring the peak beyond {CEILING:g} dBFS"
