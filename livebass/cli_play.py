"""`livebass play` and `livebass devices`: the bass live."""

from __future__ import annotations

import signal
import sys
from pathlib import Path
from typing import Any

import click

from livebass.cli_render import announce_kernels
from livebass.cli_values import RATE, Number, Quantity
from livebass.quality import QUALITIES

CONTROLLERS = """\
  1-16 channels     --channel takes one; all are heard without it
  note-on, -off     velocity is the force of the pop; string and fret follow from the note
  pitch bend        2 semitones, or as RPN 0 says
  controller 7      volume
  controller 11     expression
  controller 16     where the string is plucked, from the neck (0) to the bridge (127)
  controller 64     sustain
  0, 32; program    the preset of that number, in the order of `livebass presets list`
  120, 121, 123     all sound off, controllers as new, all notes off"""


@click.command()
@click.option("-p", "--preset", metavar="NAME|FILE", default="jazz-finger", show_default=True, help="The bass.")
@click.option("-q", "--quality", type=click.Choice(list(QUALITIES)), default="live", show_default=True)
@click.option("--backend", type=click.Choice(["auto", "portaudio", "jack"]), default="auto", show_default=True,
              help="auto: JACK where a server runs.")
@click.option("--audio", metavar="NUMBER|NAME", help="Output of PortAudio; see `livebass devices`.")
@click.option("--midi", metavar="NUMBER|NAME", help="MIDI input; without it the first, or a virtual one.")
@click.option("--rate", type=RATE, default=48000, show_default=True, help="With PortAudio; JACK has its own.")
@click.option("--block", type=Number("frames", 16, 1024, whole=True), default=128, show_default=True,
              help="Frames computed at once, with PortAudio.")
@click.option("--latency", type=Quantity("time", 0.0, 1.0), help="Asked of PortAudio; as low as it goes without it.")
@click.option("--channel", type=Number("channel", 1, 16, whole=True), help="Listen to this MIDI channel only.")
@click.option("--gain", type=Number("dB", -60, 20), default=0.0, show_default=True)
@click.option("--file", "song", type=click.Path(path_type=Path), metavar="SONG.MID", help="Play this as well.")
@click.option("--record", type=click.Path(path_type=Path), metavar="TAKE.WAV", help="Write what is heard.")
@click.option("--controllers", is_flag=True, help="What MIDI messages do, and exit.")
@click.option("--quiet", is_flag=True, help="No status line, no summary.")
def play(**options: Any) -> None:
    """Play the bass live from a MIDI keyboard, the computer keyboard or a file.

    \b
    Examples:
      livebass play                                  default output, first MIDI input
      livebass play -p slap --file song.mid --record take.wav
    """
    if options["controllers"]:
        click.echo(CONTROLLERS)
        return
    from livebass.play import Session, Wish
    from livebass.preset import load_preset
    from livebass.score import read_score
    from livebass.terminal import HELP

    song, device, channel = options["song"], options["audio"], options["channel"]
    bass = load_preset(options["preset"])
    if song:
        read_score(song, options["rate"])  # what is wrong with it is said now
    wish = Wish(
        instrument=bass,
        quality=QUALITIES[options["quality"]],
        backend=options["backend"],
        audio=int(device) if device and device.isdigit() else device,
        midi=options["midi"],
        rate=options["rate"],
        block=options["block"],
        latency="low" if options["latency"] is None else options["latency"],
        channel=-1 if channel is None else channel - 1,
        gain=10 ** (options["gain"] / 20),
        record=options["record"],
        read=(lambda rate: read_score(song, rate)) if song else None,
    )
    quiet = options["quiet"]
    terminal = sys.stderr.isatty() and not quiet
    announce_kernels()

    def say(line: str) -> None:
        if not quiet:
            click.echo(f"\r\x1b[K{line}" if terminal else line, err=True)

    def status(line: str) -> None:
        click.echo(f"\r\x1b[K{line}", nl=False, err=True)

    session = Session(wish, say, status if terminal else None)
    for name in ("SIGINT", "SIGTERM", "SIGHUP"):
        if hasattr(signal, name):
            signal.signal(getattr(signal, name), lambda *_: session.stop.set())
    if sys.stdin.isatty() and not quiet:
        say(HELP)
    summary = session.run()
    m = summary.meters
    say(
        f"played {summary.seconds:.1f} s, {m.messages} messages, worst block {summary.worst:.0%} of its time, "
        f"{m.late} late, {m.underruns} underruns" + (f"; {summary.recorded}" if summary.recorded else "")
    )


@click.command()
def devices() -> None:
    """List audio outputs and MIDI inputs; numbers and parts of names are what `play` takes."""
    from livebass.midi_in import MidiLost, port_names
    from livebass.outputs import OutputLost, output_names

    for title, names, lost in (
        ("audio outputs (--audio)", output_names, OutputLost),
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
