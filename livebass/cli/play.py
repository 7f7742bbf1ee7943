"""`livebass play` and `livebass devices`: the bass live."""

from __future__ import annotations

import os
import signal
import sys
from contextlib import suppress
from pathlib import Path
from types import FrameType
from typing import TYPE_CHECKING, Any, Self

import click

from livebass.cli.render import announce_kernels
from livebass.cli.values import RATE, Number, Quantity
from livebass.files import STOPS
from livebass.model.quality import QUALITIES

if TYPE_CHECKING:
    from livebass.live.session import Session

CONTROLLERS = """\
  1-16 channels     --channel takes one; all are heard without it
  note-on, -off     velocity is the force of the pop; string and fret follow from the note
  pitch bend        2 semitones, or as RPN 0 says
  controller 7      volume
  controller 11     expression
  controller 16     where the string is plucked, from the neck (0) to the bridge (127)
  controller 64     sustain
  0, 32; program    the preset of that number, in the order of `livebass presets list`
  6, 38, 100, 101   RPN 0, the range of the pitch bend
  120, 121, 123     all sound off, controllers as new, all notes off

Where a block takes more than three quarters of its time, strings go over to 150 modes and 192 kHz of contact steps:
first the one plucked last of those that have touched a fret, then the others of these, then those that only sound,
the oldest first. They come back one by one when the load has stayed below 35 % for half a second."""


@click.command()
@click.option("-p", "--preset", metavar="NAME|FILE", default="jazz-finger", show_default=True, help="The bass.")
@click.option("-q", "--quality", type=click.Choice(list(QUALITIES)), default="live", show_default=True)
@click.option(
    "--backend",
    type=click.Choice(["auto", "portaudio", "jack"]),
    default="auto",
    show_default=True,
    help="auto: JACK where a server runs.",
)
@click.option("--audio", metavar="NUMBER|NAME", help="Output of PortAudio; see `livebass devices`.")
@click.option("--midi", metavar="NUMBER|NAME", help="MIDI input; without it the first, or a virtual one.")
@click.option("--rate", type=RATE, default=48000, show_default=True, help="With PortAudio; JACK has its own.")
@click.option(
    "--block",
    type=Number("frames", 16, 1024, whole=True),
    default=128,
    show_default=True,
    help="Frames computed at once, with PortAudio.",
)
@click.option("--latency", type=Quantity("time", 0.0, 1.0), help="Asked of PortAudio; as low as it goes without it.")
@click.option("--channel", type=Number("channel", 1, 16, whole=True), help="Listen to this MIDI channel only.")
@click.option("--gain", type=Number("dB", -60, 20), default=0.0, show_default=True)
@click.option("--file", "song", type=click.Path(path_type=Path), metavar="SONG.MID", help="Play this as well.")
@click.option("--record", type=click.Path(path_type=Path), metavar="TAKE.WAV", help="Write what is heard.")
@click.option("--log", type=click.Path(path_type=Path), metavar="FILE", help="Add to it what is said, and any trouble.")
@click.option("--controllers", is_flag=True, help="What MIDI messages do, and exit.")
@click.option("--quiet", is_flag=True, help="No status line, no summary.")
def play(**options: Any) -> None:
    """Play the bass live from a MIDI keyboard, the computer keyboard or a file.

    \b
    Examples:
      livebass play                                  default output, first MIDI input
      livebass play --audio 2 --midi keystation      as `livebass devices` lists them
      livebass play -p slap --file song.mid --record take.wav
    """
    if options["controllers"]:
        click.echo(CONTROLLERS)
        return
    from livebass import compiling as kernels
    from livebass.live.inputs import HELP, interactive
    from livebass.live.outputs import check_output
    from livebass.live.session import Session, Settings
    from livebass.preset.load import load_preset
    from livebass.score import read_score

    song, device, channel, quiet = options["song"], options["audio"], options["channel"], options["quiet"]
    bass = load_preset(options["preset"])
    if song:
        read_score(song, options["rate"])  # what is wrong with it is said now
    settings = Settings(
        instrument=bass,
        quality=QUALITIES[options["quality"]],
        preset=options["preset"],
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
    with Console(quiet, options["log"]) as desk:
        if not kernels.cached(kernels.LIVE_ENTRY):
            check_output(settings.backend, settings.audio)
            announce_kernels(live=True)
        session = Session(settings, desk.say, desk.status if desk.terminal else None, desk.note)
        heed_signals(session)
        if interactive():
            desk.hint(HELP)
        summary = session.run()
        m = summary.meters
        desk.say(
            f"played {summary.seconds:.1f} s, {m.messages} messages, worst block {summary.worst:.0%} of its time, "
            f"{m.late} late, {m.underruns} underruns"
            + (f", {m.faults} faults" if m.faults else "")
            + (f", {m.lost} frames not recorded" if m.lost else "")
            + (f"; {summary.recorded}" if summary.recorded else "")
        )
        if summary.lost:
            desk.note(summary.lost)
            kept = f"; {summary.recorded} is complete" if summary.recorded else ""
            raise OutputGone(f"{summary.lost}{kept}")


class OutputGone(OSError):
    """The output went away while it played."""


class Console:
    """Where lines go: to stderr unless `quiet`, over a status line if that is a terminal, and to a log."""

    def __init__(self, quiet: bool, log: Path | None) -> None:
        from livebass.live.recording import Journal

        self.quiet = quiet
        self.terminal = sys.stderr.isatty() and not quiet and os.environ.get("TERM") != "dumb"
        self.journal = Journal(log) if log else None
        self._unended = False

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: object, error: BaseException | None, trace: object) -> None:
        self._print("", end="")
        if self.journal:
            if error is not None and not isinstance(error, OutputGone):
                self.note(str(error) or type(error).__name__)
            self.journal.close()

    def hint(self, line: str) -> None:
        """For who sits there."""
        if not self.quiet:
            self._print(line)

    def say(self, line: str) -> None:
        self.hint(line)
        self.note(line)

    def note(self, line: str) -> None:
        """For the log alone."""
        trouble = self.journal.write(line) if self.journal else None
        if trouble:
            self.hint(trouble)

    def status(self, line: str) -> None:
        """In place of the one before; cut where the terminal ends."""
        try:
            width = os.get_terminal_size(2).columns
        except OSError:
            width = 80
        self._print(line[: max(width - 1, 0)], end="")

    def _print(self, line: str, end: str = "\n") -> None:
        before = "\r\x1b[K" if self.terminal and self._unended else ""
        self._unended = self.terminal and not end and bool(line)
        if before or line or end:
            with suppress(OSError):  # a terminal that was closed: the bass plays on until it is told to end
                click.echo(f"{before}{line}{end}", nl=False, err=True)


def heed_signals(session: Session) -> None:
    """What asks the program to end ends the session once it plays; before that, all as usual."""
    for number in STOPS:
        before = signal.getsignal(number)
        if before in (signal.SIG_IGN, None):  # nohup: not SIGHUP
            continue

        def stop(number: int, frame: FrameType | None, before: Any = before) -> None:
            session.stop.set()
            if session.synth is None:
                if not callable(before):
                    raise SystemExit(128 + number)
                before(number, frame)

        signal.signal(number, stop)


@click.command()
def devices() -> None:
    """List audio outputs and MIDI inputs; numbers and parts of names are what `play` takes."""
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
