"""`livebass play`: plays live."""

from __future__ import annotations

import functools
import logging
import secrets
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from typing import TYPE_CHECKING, Any

import click

from livebass.cli.console import Console, OutputGone, log_to
from livebass.cli.demos import demo_option
from livebass.cli.effects import OPTIONS, EffectOptions, effects_options
from livebass.cli.groups import GroupedCommand
from livebass.cli.hands import SOUND, Hands, hands_options
from livebass.cli.messages import clipping, say
from livebass.cli.options import (
    DEFAULT_PRESET,
    file_option,
    files_to_write,
    flag,
    is_given,
    option,
    preset_option,
    quality_option,
)
from livebass.cli.play_settings import recall
from livebass.cli.progress import have_kernels
from livebass.cli.tabs import tab_options
from livebass.cli.tuning import tuning_options
from livebass.cli.values import RATE, Number, Parsed, Quantity, beats, learn, span
from livebass.files.whole import OutputError
from livebass.model.quality import AUTO, BLOCK, CORES, QUALITIES
from livebass.rows.units import is_number
from livebass.system.interrupts import stop_instead

if TYPE_CHECKING:
    from livebass.live.session import Session
    from livebass.live.settings import Summary
    from livebass.model.instrument import Instrument

LOG = logging.getLogger("livebass")


GROUPS = {
    "Sound": "--preset --quality --gain --tuning --capo --a4 --temperament",
    "Hands": "--keys --velocity-curve --wheel --no-noise --learn --controllers",
    "Effects": OPTIONS,
    "Song": "--file --track --bars --dynamics --demo --loop --tempo --metronome --count-in --tuner",
    "Take": "--record --record-midi --log",
    "Devices": "--backend --audio --midi --channel --rate --block --latency --cores --osc",
    "JACK": "--transport --metronome-port --strings --client-name --no-connect",
    "Session": "--watch --no-settings --forget --quiet --help",
}


class Setting(click.Option):
    """An option that sets a field of a session's Settings, converted by `value`."""

    def __init__(self, *names: Any, field: str = "", value: Callable[[Any], Any] = lambda given: given, **more: Any):
        super().__init__(*names, **more)
        self.field, self.value = field or str(self.name), value


setting, switch = functools.partial(option, cls=Setting), functools.partial(flag, cls=Setting)


@click.command(cls=GroupedCommand, groups=GROUPS, surplus="--file plays a file")
@preset_option(f"The bass.  [default: the last one, at first {DEFAULT_PRESET}; or the bass that --file asks for]")
@tuning_options
@quality_option(
    AUTO,
    "Precision of the strings. auto: studio if this machine can play it, else live. See `livebass help cost`.",
    among=(AUTO, *QUALITIES),
)
@setting(
    "--backend",
    click.Choice(["auto", "portaudio", "jack"]),
    "auto: JACK if a server runs, else PortAudio.",
    default="auto",
)
@setting(
    "--audio",
    str,
    "PortAudio output; see `livebass devices`.",
    metavar="NUMBER|NAME",
    value=lambda name: int(name) if name and is_number(name) else name,
)
@setting("--midi", str, "MIDI input.  [default: the first, or a virtual port]", metavar="NUMBER|NAME")
@setting("--rate", RATE, "Sample rate for PortAudio; a JACK server has its own.", default=48000)
@setting(
    "--block",
    Number("frames", *BLOCK, whole=True),
    "Block size for PortAudio and PipeWire, 16 to 1024; a JACK server has its own.",
    default=128,
)
@setting(
    "--latency",
    Quantity("time", 0.0, 1.0),
    "Latency for PortAudio, up to 1 s.  [default: the lowest]",
    value=lambda seconds: "low" if seconds is None else seconds,
)
@setting(
    "--cores",
    Number("cores", *CORES, whole=True),
    "Processor cores that play strings; 1: the audio thread alone.  [default: all, at most one per string]",
)
@setting(
    "--channel",
    Number("channel", 1, 16, whole=True),
    "Listen to this MIDI channel only.  [default: all]",
    value=lambda number: -1 if number is None else number - 1,
)
@hands_options
@effects_options
@setting("--gain", Number("dB", -60, 20), "Output level.", default=0.0, value=lambda decibels: 10 ** (decibels / 20))
@file_option("--file song", "Also play the bass part of this MIDI file or tablature.", metavar="SONG")
@tab_options
@demo_option("Also play")
@setting(
    "--loop",
    Parsed("[from:to]", span),
    "Repeat the --file, or a part of it, such as 4s:12s.",
    is_flag=False,
    flag_value="all",
)
@setting(
    "--tempo",
    Number("percent", 10, 400, unit="%"),
    "Tempo of the --file, 10 to 400 %.",
    default=100,
    value=lambda percent: percent / 100,
)
@switch("--transport", "The --file follows JACK's transport.")
@setting(
    "--metronome",
    Parsed("metronome", beats),
    "Clicks per minute, 20 to 400; file: the beats of the tablature's bars.",
    metavar="BPM|file",
    value=lambda beats: -1.0 if beats == "file" else beats or 0.0,  # FILE of live/desk.py
)
@flag("--count-in", "Click a bar before the tablature; with --metronome file.")
@switch("--metronome-port", "Send the click to the JACK port `metronome` only.")
@switch("--tuner", "Show the pitch and how many cents it is off.")
@option(
    "--learn",
    Parsed("parameter[=n]", learn),
    "Let a MIDI controller move a parameter: tone=74; tone: the next control you move; tone=off: none.",
    multiple=True,
)
@setting("--osc", Number("port", 1, 65535, whole=True), "Listen to OSC on this UDP port, from this machine only.")
@setting(
    "--client-name",
    str,
    "Name of the JACK client.  [default: livebass]",
    metavar="NAME",
    field="client",
    value=lambda name: name or "livebass",
)
@switch("--no-connect", "Connect no JACK ports.", field="connect", value=lambda unconnected: not unconnected)
@switch("--strings", "Add a JACK port per string; string_1 is the lowest.")
@file_option("--record", "Record the sound into this file.", metavar="TAKE.WAV", cls=Setting)
@file_option("--record-midi", "Record the notes as a MIDI file.", metavar="TAKE.MID", cls=Setting)
@file_option("--log", "Append messages and load to this file.")
@flag("--watch", "Print the address of a page that shows the strings, for this machine only.")
@flag("--no-settings", "Neither use nor change the remembered settings.")
@flag("--forget forgotten", "Delete the remembered settings first.")
@flag("--controllers", "Explain the MIDI messages and exit.")
@flag("--quiet", "Show no status line and no summary.")
def play(**options: Any) -> None:
    """Play the bass live.

    From a MIDI keyboard, the computer keyboard or a file.

    \b
    Examples:
      livebass play                                  default output, first MIDI input
      livebass play --audio 2 --midi keystation      as `livebass devices` lists them
      livebass play -p slap --tuning half-step-down --file song.mid --record take.wav
      livebass play --demo -p fretless               a phrase, through the sound card
      livebass play --file song.mid --loop 4s:12s --tempo 80%
      livebass play --learn tone --metronome 100 --tuner
      livebass play --keys mine.toml --velocity-curve soft --wheel slide

    livebass remembers bass, tuning, capo, pitch, temperament, gain, devices and learned controllers.
    """
    requested = {name: options[name] for name in SOUND}
    hands, behind = Hands.from_options(options), EffectOptions.from_options(options)
    if options["controllers"]:
        from livebass.cli.midi_help import controllers_text
        from livebass.preset.keymap import key_map_text

        keys = hands.changes.get("keys")
        click.echo(key_map_text(keys).rstrip("\n") if keys else controllers_text())
        return
    from livebass.cli.music import Music
    from livebass.compiling.library import is_cached
    from livebass.live.device_errors import OutputLost
    from livebass.live.guards import own_stderr
    from livebass.live.keyboard import HELP, SCORE_HELP
    from livebass.live.outputs import check_output
    from livebass.live.session import Session
    from livebass.live.settings import Settings
    from livebass.live.terminal import interactive

    check_together(options)
    files_to_write({"--record": options["record"], "--record-midi": options["record_midi"]})
    memory = recall(options)
    options |= memory.used
    if "audio" in memory.used:
        try:
            check_output("portaudio", options["audio"])
        except OutputLost as error:
            say(f"as remembered: {error}; uses the default output")
            options["audio"] = None
    music = Music(options, requested, hands, behind, memory)
    settings = Settings(
        instrument=music.bass,
        load=music.load,
        quality=QUALITIES.get(options["quality"]),
        preset=music.preset,
        requested=tuple(name for name in ("rate", "block", "latency") if is_given(name)),
        given=music.given,
        programs=music.programs,
        read=music.read,
        midi_if_there="midi" in memory.used,
        controllers=memory.controllers(options["learn"]),
        learn=tuple(symbol for symbol, controller in options["learn"] if controller is None),
        **fields_of(options),
    )
    console = Console(options["quiet"])
    with own_stderr(), log_to(console, options["log"]), ExitStack() as stack:
        if not is_cached():
            check_output(settings.backend, settings.audio)
            have_kernels()
        session = Session(settings, console.status if console.terminal else None)
        if options["watch"]:
            stack.enter_context(watching(session, music.bass))
        stop_instead(session.stop, lambda: session.synth is not None)
        if memory.used and (said := memory.summary()):
            console.show(f"as the last time: {said}")
        if interactive():
            console.show(HELP)
            if music.read:
                console.show(SCORE_HELP)
        summary = session.run()
        memory.keep(summary, music.unchosen, session.desk.learned)
        LOG.info(summary_line(summary, options["gain"]))
        if summary.lost:
            LOG.debug(summary.lost)
            files = " and ".join(map(str, summary.recorded))
            kept = f"; {files} {'is' if len(summary.recorded) == 1 else 'are'} complete" if files else ""
            raise OutputGone(f"{summary.lost}{kept}")
        if summary.short:
            raise OutputError(f"not all was recorded: {summary.short}")


def fields_of(options: dict[str, Any]) -> dict[str, Any]:
    """The Settings fields that the options give, each by its row."""
    rows = [row for row in click.get_current_context().command.params if isinstance(row, Setting)]
    return {row.field: row.value(options[str(row.name)]) for row in rows}


def summary_line(summary: Summary, gain: float) -> str:
    """Sums up a session played at `gain` (dB)."""
    from livebass.live.synth import decibels

    m, dropped = summary.meters, summary.dropped
    return (
        f"played {summary.seconds:.1f} s, {m.messages} messages, worst block {summary.worst:.0%} of its time, "
        f"{m.late} late, {m.underruns} underruns"
        + (f", {dropped} note{'s' * (dropped != 1)} dropped" if dropped else "")
        + (f", {m.faults} faults" if m.faults else "")
        + (f", {m.lost} frames not recorded" if m.lost else "")
        + (clipping(m.clipped, gain, decibels(summary.peak)) if m.clipped else "")
        + (f"; {' and '.join(map(str, summary.recorded))}" if summary.recorded else "")
    )


@contextmanager
def watching(session: Session, bass: Instrument) -> Iterator[None]:
    """Serves the page that watches the session, which begins with `bass`; prints its address."""
    from livebass.web.serve import PageServer
    from livebass.web.watch import STREAM, stream, watch_files

    streams = {STREAM: functools.partial(stream, lambda: session.output.synth if session.synth else None)}
    with PageServer(watch_files(bass), streams=streams, token=secrets.token_urlsafe()) as server:
        click.echo(server.address)
        yield


JACK_ONLY = ("transport", "metronome_port", "client_name", "no_connect", "strings")  # options


def check_together(options: dict[str, Any]) -> None:
    """Raises UsageError for options that exclude each other; JACK's own options make JACK the backend."""
    jack = [f"--{name.replace('_', '-')}" for name in JACK_ONLY if options[name]]
    if options["audio"] is not None and options["backend"] == "jack":
        raise click.UsageError("--audio names an output of PortAudio, which --backend jack does not use: leave one out")
    if jack and (options["audio"] is not None or options["backend"] == "portaudio"):
        other = "--audio" if options["audio"] is not None else "--backend portaudio"
        raise click.UsageError(f"{jack[0]} is for JACK, which {other} does not use: leave one out")
    if jack:
        options["backend"] = "jack"
    if options["song"] and options["demo"]:
        raise click.UsageError("--file and --demo: give one of them")
    if not options["song"] and not options["demo"]:
        for name in ("loop", "transport", "tempo"):
            if options[name] and (name != "tempo" or is_given(name)):
                raise click.UsageError(f"--{name} is for a --file, or a --demo: name one")
    if options["transport"] and options["loop"]:
        raise click.UsageError("--loop repeats the file, --transport moves it as JACK does: leave one out")
    if options["metronome_port"] and not options["metronome"]:
        raise click.UsageError("--metronome-port: say how fast, by --metronome BPM")
    if options["count_in"] and options["metronome"] != "file":
        raise click.UsageError("--count-in is for --metronome file")
    if options["no_connect"] and options["midi"] is not None:
        raise click.UsageError("--midi names what to connect, --no-connect connects nothing: leave one out")
    if options["client_name"] is not None and not is_client_name(options["client_name"]):
        raise click.UsageError("--client-name must be 1 to 32 characters without a colon")
    chosen = [controller for _, controller in options["learn"] if isinstance(controller, int)]
    if len({symbol for symbol, _ in options["learn"]}) < len(options["learn"]) or len(set(chosen)) < len(chosen):
        raise click.UsageError("--learn: one controller for each parameter, and one parameter for each controller")


def is_client_name(name: str) -> bool:
    """True for a name that every JACK server accepts."""
    return 0 < len(name.encode(errors="replace")) <= 32 and name.isprintable() and ":" not in name
