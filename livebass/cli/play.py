"""`livebass play` and `livebass devices`: playing live, and the devices to play through."""

from __future__ import annotations

import logging
import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from datetime import datetime
from pathlib import Path
from typing import Any

import click

from livebass.cli.render import DEFAULT_PRESET, announce_kernels, clipping, preset_for
from livebass.cli.values import RATE, Number, Quantity
from livebass.files import OutputError, output_error
from livebass.interrupts import stop_instead
from livebass.model.quality import BLOCK, QUALITIES

LOG = logging.getLogger("livebass")
CONTROLLERS = """\
  1-16 channels     --channel takes one; without it all are played
  note-on, -off     the velocity is the force of the pluck; string and fret follow from the note
  pitch bend        2 semitones, or as RPN 0 says, up to 96
  controller 1      vibrato
  controller 7      volume
  controller 9      palm mute, from loose (1) to tight (127)
  controller 11     expression
  controller 16     plucking point, from the neck (0) to the bridge (127)
  controller 64     sustain
  65, 68            from 64 on: overlapping notes slide; are hammered on and pulled off
  program           33 to 38 of General MIDI choose a preset, see `livebass presets list`
  6, 38, 100, 101   RPN 0, the range of the pitch bend
  120, 121, 123     all sound off, reset all controllers, all notes off

Key switches, below the notes of the bass, as MODO BASS has them; held, but 13 and 18, which last, and 8:

  0 9 11 14 16 19   play on the string C, A, B, D, E, G
  10  12  17        ghost notes; hammer-on and pull-off (overlap the notes); harmonics
  2  3  4  6        tapping; palm mute; slides (overlap the notes); vibrato
  13  18            fingers; thumb and pops
  8                 damp all strings

When a block takes more than three quarters of its time, strings change to 150 modes and contact steps at 192 kHz, one
after the other: first those that have touched a fret, the one plucked last before the others; then those that only
sound, the oldest first. They change back one by one when the load has stayed below 35 % for half a second."""


@click.command()
@click.option(
    "-p",
    "--preset",
    metavar="NAME|FILE",
    help=f"The bass. [default: {DEFAULT_PRESET}, or the bass that --file asks for]",
)
@click.option(
    "-q",
    "--quality",
    type=click.Choice(list(QUALITIES)),
    default="live",
    show_default=True,
    help="How finely strings are computed; see `livebass help cost`.",
)
@click.option(
    "--backend",
    type=click.Choice(["auto", "portaudio", "jack"]),
    default="auto",
    show_default=True,
    help="auto: JACK if a server runs, else PortAudio.",
)
@click.option("--audio", metavar="NUMBER|NAME", help="PortAudio output; see `livebass devices`.")
@click.option("--midi", metavar="NUMBER|NAME", help="MIDI input; default: the first, or a virtual one.")
@click.option(
    "--rate", type=RATE, default=48000, show_default=True, help="Sample rate for PortAudio; a JACK server has its own."
)
@click.option(
    "--block",
    type=Number("frames", *BLOCK, whole=True),
    default=128,
    show_default=True,
    help="Length of a block, for PortAudio and PipeWire; a JACK server has its own.",
)
@click.option("--latency", type=Quantity("time", 0.0, 1.0), help="Latency to ask PortAudio for; default: the lowest.")
@click.option(
    "--channel", type=Number("channel", 1, 16, whole=True), help="Listen to this MIDI channel only.  [default: all]"
)
@click.option("--gain", type=Number("dB", -60, 20), default=0.0, show_default=True, help="Output level.")
@click.option(
    "--file",
    "song",
    type=click.Path(path_type=Path),
    metavar="SONG.MID",
    help="Also play the bass part of this MIDI file.",
)
@click.option("--record", type=click.Path(path_type=Path), metavar="TAKE.WAV", help="Record the sound into this file.")
@click.option(
    "--record-midi", type=click.Path(path_type=Path), metavar="TAKE.MID", help="Record the notes as a MIDI file."
)
@click.option("--log", type=click.Path(path_type=Path), metavar="FILE", help="Append messages and load to this file.")
@click.option("--controllers", is_flag=True, help="Explain what MIDI messages do, and exit.")
@click.option("--quiet", is_flag=True, help="Show no status line and no summary.")
def play(**options: Any) -> None:
    """Play the bass live.

    From a MIDI keyboard, the computer keyboard or a file.

    \b
    Examples:
      livebass play                                  default output, first MIDI input
      livebass play --audio 2 --midi keystation      as `livebass devices` lists them
      livebass play -p slap --file song.mid --record take.wav
    """
    if options["controllers"]:
        click.echo(CONTROLLERS)
        return
    from livebass.cli.song import remarks, too_low
    from livebass.compiling.library import cached
    from livebass.live.guards import own_stderr
    from livebass.live.inputs import HELP, interactive
    from livebass.live.outputs import check_output
    from livebass.live.session import Session, Settings
    from livebass.live.synth import decibels
    from livebass.preset.load import load_preset
    from livebass.score import read_score

    song, device, channel = options["song"], options["audio"], options["channel"]
    if device is not None and options["backend"] == "jack":
        raise click.UsageError("--audio names an output of PortAudio, which --backend jack does not use: leave one out")
    score = read_score(song, options["rate"]) if song else None  # errors in the file are reported now
    preset = options["preset"] or preset_for(score)
    bass = load_preset(preset)
    if score:
        for remark in remarks(score, options["preset"], DEFAULT_PRESET) + too_low(bass, score, DEFAULT_PRESET):
            click.echo(f"{song}: {remark}", err=True)
    settings = Settings(
        instrument=bass,
        quality=QUALITIES[options["quality"]],
        preset=preset,
        backend=options["backend"],
        audio=int(device) if device and device.isdigit() else device,
        midi=options["midi"],
        rate=options["rate"],
        block=options["block"],
        latency="low" if options["latency"] is None else options["latency"],
        asked=tuple(name for name in ("rate", "block", "latency") if given(name)),
        channel=-1 if channel is None else channel - 1,
        gain=10 ** (options["gain"] / 20),
        record=options["record"],
        record_midi=options["record_midi"],
        read=(lambda rate: read_score(song, rate)) if song else None,
    )
    console = Console(options["quiet"])
    with own_stderr(), logged(console, options["log"]):
        if not cached():
            check_output(settings.backend, settings.audio)
            announce_kernels()
        session = Session(settings, console.status if console.terminal else None)
        stop_instead(session.stop, lambda: session.synth is not None)
        if interactive():
            console.show(HELP)
        summary = session.run()
        m = summary.meters
        LOG.info(
            f"played {summary.seconds:.1f} s, {m.messages} messages, worst block {summary.worst:.0%} of its time, "
            f"{m.late} late, {m.underruns} underruns"
            + (f", {m.faults} faults" if m.faults else "")
            + (f", {m.lost} frames not recorded" if m.lost else "")
            + (clipping(m.clipped, options["gain"], decibels(summary.peak)) if m.clipped else "")
            + (f"; {summary.recorded}" if summary.recorded else "")
        )
        if summary.lost:
            LOG.debug(summary.lost)
            kept = f"; {summary.recorded} is complete" if summary.recorded else ""
            raise OutputGone(f"{summary.lost}{kept}")
        if summary.short:
            raise OutputError(f"not all was recorded: {summary.short}")


def given(name: str) -> bool:
    """Returns whether an option was given on the command line."""
    return click.get_current_context().get_parameter_source(name) is click.core.ParameterSource.COMMANDLINE


class OutputGone(OSError):
    """The output went away while it played."""


@contextmanager
def logged(console: Console, path: Path | None) -> Iterator[None]:
    """Sends what livebass logs to `console` and, with its error if there is one, to the file at `path`.

    Raises OutputError if the file cannot be written.
    """
    handlers: list[logging.Handler] = [console, *([LogFile(path)] if path else [])]
    level = LOG.level
    LOG.setLevel(logging.DEBUG)
    for handler in handlers:
        LOG.addHandler(handler)
    try:
        yield
    except BaseException as error:
        if not isinstance(error, OutputGone):
            LOG.debug(str(error) or type(error).__name__)
        raise
    finally:
        for handler in handlers:
            LOG.removeHandler(handler)
            handler.close()
        LOG.setLevel(level)


class Console(logging.Handler):
    """Shows log lines from INFO up on stderr unless `quiet`, above a status line if that is a terminal."""

    def __init__(self, quiet: bool) -> None:
        super().__init__(logging.INFO)
        self.quiet = quiet
        self.terminal = sys.stderr.isatty() and not quiet and os.environ.get("TERM") != "dumb"
        self._unended = False  # the cursor is behind a status line

    def emit(self, record: logging.LogRecord) -> None:
        self.show(record.getMessage())

    def show(self, line: str) -> None:
        """Shows a line that is for the terminal alone."""
        if not self.quiet:
            self._print(line)

    def status(self, line: str) -> None:
        """Shows `line` in place of the status line before, as far as it fits."""
        try:
            width = os.get_terminal_size(sys.stderr.fileno()).columns
        except (OSError, ValueError):
            width = 80
        self._print(line[: max(width - 1, 0)], end="")

    def close(self) -> None:
        """Removes the status line."""
        self._print("", end="")
        super().close()

    def _print(self, line: str, end: str = "\n") -> None:
        self.acquire()  # other threads log, too
        try:
            before = "\r\x1b[K" if self.terminal and self._unended else ""
            self._unended = self.terminal and not end and bool(line)
            if before or line or end:
                with suppress(OSError):  # a closed terminal: the bass plays on until it is told to end
                    click.echo(f"{before}{line}{end}", nl=False, err=True)
        finally:
            self.release()


class LogFile(logging.FileHandler):
    """Appends lines with time stamps to a file; an error ends the file with a warning, not the session.

    Raises OutputError if the file cannot be opened.
    """

    def __init__(self, path: Path) -> None:
        self.path, self._ended = path, False
        try:
            super().__init__(path, encoding="utf-8", errors="replace")
        except OSError as error:
            raise output_error(path, error) from None
        except ValueError:  # a zero byte in the name
            raise output_error(path, OSError("not a file name")) from None

    def format(self, record: logging.LogRecord) -> str:
        when = datetime.fromtimestamp(record.created).astimezone()
        return f"{when.isoformat(' ', 'milliseconds')}  {record.getMessage()}"

    def emit(self, record: logging.LogRecord) -> None:
        if not self._ended:
            super().emit(record)

    def handleError(self, record: logging.LogRecord) -> None:
        error = sys.exc_info()[1]
        if not isinstance(error, OSError):
            super().handleError(record)
            return
        self.close()
        LOG.warning("%s: no more log", output_error(self.path, error))

    def close(self) -> None:
        self._ended = True
        with suppress(OSError):
            super().close()


@click.command()
def devices() -> None:
    """List audio outputs and MIDI inputs.

    `play` takes their numbers, or parts of their names.
    """
    from livebass.live.inputs import MidiLost, port_names
    from livebass.live.outputs import OutputLost, jack_server, output_names

    click.echo(f"JACK server (--backend jack)\n  {jack_server() or 'none'}")
    for title, names, lost in (
        ("audio outputs of PortAudio (--audio)", output_names, OutputLost),
        ("MIDI inputs (--midi)", port_names, MidiLost),
    ):
        click.echo(title)
        try:
            lines = names()
        except lost as error:
            click.echo(f"  none: {error}")
            continue
        for number, name in lines.items() if isinstance(lines, dict) else enumerate(lines):
            click.echo(f"  {number}  {name}")
        if not lines:
            click.echo("  none")
