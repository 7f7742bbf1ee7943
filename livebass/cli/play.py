"""`livebass play` and `livebass devices`: playing live, and the devices to play through."""

from __future__ import annotations

import functools
import logging
import os
import re
import secrets
import sys
from collections.abc import Callable, Iterator, Mapping
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import dataclass, replace
from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from livebass.cli.effects import Behind, effects_options
from livebass.cli.groups import GroupedCommand
from livebass.cli.hands import SOUND, Hands, Loader, hands_options
from livebass.cli.options import file_option, preset_option, quality_option
from livebass.cli.remembered import DamagedSettings, Remembered, forget, load, save, settings_file
from livebass.cli.render import DEFAULT_PRESET, DEMOS, clipping, demo_for, have_kernels, ready_for
from livebass.cli.said import filled, say, width
from livebass.cli.tuning import TUNING_KEYS, load_tuned, tuning_of_options, tuning_options
from livebass.cli.values import RATE, Learn, Number, Quantity, Span
from livebass.files import OutputError, output_error
from livebass.interrupts import stop_instead
from livebass.model.quality import AUTO, BLOCK, CORES, QUALITIES
from livebass.units import is_number, one_line

if TYPE_CHECKING:
    from livebass.live.session import Session, Summary
    from livebass.model.instrument import Instrument
    from livebass.score.score import Score

LOG = logging.getLogger("livebass")


NARROW, BAR = 60, re.compile(r"\[[# ]*\] *")  # columns of a terminal without room for the bar of a meter
GROUPS = {
    "Sound": "--preset --quality --gain --tuning --capo --a4 --temperament",
    "Hands": "--keys --velocity-curve --wheel --no-noise --learn --controllers",
    "Effects": "--compression --drive --response --response-level",
    "Song": "--file --demo --loop --tempo --metronome --tuner",
    "Take": "--record --record-midi --log",
    "Devices": "--backend --audio --midi --channel --rate --block --latency --cores --osc",
    "JACK": "--transport --metronome-port --strings --client-name --no-connect",
    "Session": "--watch --no-settings --forget --quiet --help",
}


@click.command(cls=GroupedCommand, groups=GROUPS)
@preset_option(f"The bass.  [default: the last one, at first {DEFAULT_PRESET}; or the bass that --file asks for]")
@tuning_options
@quality_option(
    AUTO,
    "Precision of the strings. auto: studio if this machine can play it, else live. See `livebass help cost`.",
    among=(AUTO, *QUALITIES),
)
@click.option(
    "--backend",
    type=click.Choice(["auto", "portaudio", "jack"]),
    default="auto",
    show_default=True,
    help="auto: JACK if a server runs, else PortAudio.",
)
@click.option("--audio", metavar="NUMBER|NAME", help="PortAudio output; see `livebass devices`.")
@click.option("--midi", metavar="NUMBER|NAME", help="MIDI input.  [default: the first, or a virtual port]")
@click.option(
    "--rate", type=RATE, default=48000, show_default=True, help="Sample rate for PortAudio; a JACK server has its own."
)
@click.option(
    "--block",
    type=Number("frames", *BLOCK, whole=True),
    default=128,
    show_default=True,
    help="Block size for PortAudio and PipeWire, 16 to 1024; a JACK server has its own.",
)
@click.option(
    "--latency", type=Quantity("time", 0.0, 1.0), help="Latency for PortAudio, up to 1 s.  [default: the lowest]"
)
@click.option(
    "--cores",
    type=Number("cores", *CORES, whole=True),
    help="Processor cores that play strings; 1: the audio thread alone.  [default: all, at most one per string]",
)
@click.option(
    "--channel", type=Number("channel", 1, 16, whole=True), help="Listen to this MIDI channel only.  [default: all]"
)
@hands_options
@effects_options
@click.option("--gain", type=Number("dB", -60, 20), default=0.0, show_default=True, help="Output level.")
@file_option("--file", "song", metavar="SONG.MID", help="Also play the bass part of this MIDI file.")
@click.option(
    "--demo",
    is_flag=False,
    flag_value="preset",
    type=DEMOS,
    help="Also play a nine-second demo phrase of the preset, or with `techniques` a phrase for each technique.",
)
@click.option(
    "--loop",
    type=Span(),
    is_flag=False,
    flag_value="all",
    help="Repeat the --file, or a part of it, such as 4s:12s.",
)
@click.option(
    "--tempo",
    type=Number("percent", 10, 400, unit="%"),
    default=100,
    show_default=True,
    help="Tempo of the --file, 10 to 400 %.",
)
@click.option("--transport", is_flag=True, help="The --file follows JACK's transport.")
@click.option("--metronome", type=Number("BPM", 20, 400), help="Clicks per minute, 20 to 400.")
@click.option("--metronome-port", is_flag=True, help="Send the click to the JACK port `metronome` only.")
@click.option("--tuner", is_flag=True, help="Show the pitch and how many cents it is off.")
@click.option(
    "--learn",
    multiple=True,
    type=Learn(),
    help="Let a MIDI controller move a parameter: tone=74; tone: the next control you move; tone=off: none.",
)
@click.option(
    "--osc", type=Number("port", 1, 65535, whole=True), help="Listen to OSC on this UDP port, from this machine only."
)
@click.option("--client-name", metavar="NAME", help="Name of the JACK client.  [default: livebass]")
@click.option("--no-connect", is_flag=True, help="Connect no JACK ports.")
@click.option("--strings", is_flag=True, help="Add a JACK port per string; string_1 is the lowest.")
@file_option("--record", metavar="TAKE.WAV", help="Record the sound into this file.")
@file_option("--record-midi", metavar="TAKE.MID", help="Record the notes as a MIDI file.")
@file_option("--log", help="Append messages and load to this file.")
@click.option(
    "--watch", is_flag=True, help="Print the address of a page that shows the strings, for this machine only."
)
@click.option("--no-settings", is_flag=True, help="Neither use nor change the remembered settings.")
@click.option("--forget", "forgotten", is_flag=True, help="Delete the remembered settings first.")
@click.option("--controllers", is_flag=True, help="Explain the MIDI messages and exit.")
@click.option("--quiet", is_flag=True, help="Show no status line and no summary.")
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

    livebass remembers bass, tuning, capo, A, temperament, gain, devices and learned controllers.
    """
    command, asked = click.get_current_context().command, {name: options[name] for name in SOUND}
    hands, behind = Hands.taken(options), Behind.taken(options)
    if options["controllers"]:
        from livebass.cli.messages import controllers_text
        from livebass.preset.keymap import key_map_text

        keys = hands.changes.get("keys")
        click.echo(key_map_text(keys).rstrip("\n") if keys else controllers_text())
        return
    from livebass.cli.song import later_presets, preset_of, programs_of, remarks, too_low
    from livebass.cli.taken import told, with_loaded
    from livebass.compiling.library import cached
    from livebass.live.guards import own_stderr
    from livebass.live.inputs import HELP, SCORE_HELP, interactive
    from livebass.live.outputs import OutputLost, check_output
    from livebass.live.session import Session, Settings
    from livebass.live.synth import decibels
    from livebass.preset.load import load_preset
    from livebass.score.low_keys import with_low_notes
    from livebass.score.reading import read_score

    check_together(options)
    memory = recall(options)
    options |= memory.used
    tuning = tuning_of_options(options)

    loaded: Callable[[str], Instrument] = load_preset
    of_take: dict[str, Mapping[str, str]] = {}  # presets that a take names, and their options

    def load(preset: str) -> Instrument:
        if preset in of_take:
            return loaded(preset)
        return ready_for(demo, behind.put(hands.play(load_tuned(preset, tuning, memory.given))))

    demo = options["demo"]
    song, device, channel = options["song"], options["audio"], options["channel"]
    if "audio" in memory.used:
        try:
            check_output("portaudio", device)
        except OutputLost as error:
            say(f"as remembered: {error}; the usual output is taken")
            device = None

    def read_song(rate: int) -> Score:
        """Reads the file; its program changes change the bass unless one was asked for."""
        nonlocal loaded
        score = read_score(song, rate)
        if options["preset"]:
            return score.on_one_bass()
        if score.basses:
            score, loaded = with_loaded(score, Loader(asked.copy()), DEFAULT_PRESET, command)
        return score

    def set_for(preset: str) -> Mapping[str, str]:
        """The options that change a preset, for a take."""
        if preset in of_take:
            return {**of_take[preset], **told(asked)}
        found = told(asked | dict.fromkeys(TUNING_KEYS) | tuning)
        return found | {"keys": "modo"} if demo == "techniques" else found

    def read_for_bass(rate: int) -> Score:
        return with_low_notes(read_song(rate), bass)

    score = read_song(options["rate"]) if song else None  # errors in the file are reported now
    if score:
        of_take |= {bass.preset: bass.given for bass in score.basses}
    preset, bass = first_bass(options["preset"] or preset_of(score, DEFAULT_PRESET), load, tuning, memory)
    if score:
        for remark in remarks(score, options["preset"], DEFAULT_PRESET) + too_low(bass, score, DEFAULT_PRESET):
            say(f"{song}: {remark}")
    read: Callable[[int], Score] | None = None
    if song:
        read = read_for_bass
    elif demo:
        read = functools.partial(demo_for, bass, demo=demo)
    settings = Settings(
        instrument=bass,
        load=load,
        quality=QUALITIES.get(options["quality"]),
        preset=preset,
        backend=options["backend"],
        audio=int(device) if device and is_number(device) else device,
        midi=options["midi"],
        rate=options["rate"],
        block=options["block"],
        latency="low" if options["latency"] is None else options["latency"],
        asked=tuple(name for name in ("rate", "block", "latency") if given(name)),
        channel=-1 if channel is None else channel - 1,
        gain=10 ** (options["gain"] / 20),
        record=options["record"],
        record_midi=options["record_midi"],
        given=set_for,
        programs=programs_of(score) if score else {},
        read=read,
        midi_if_there="midi" in memory.used,
        client=options["client_name"] or "livebass",
        connect=not options["no_connect"],
        strings=options["strings"],
        transport=options["transport"],
        loop=options["loop"],
        tempo=options["tempo"] / 100,
        controllers=memory.controllers(options["learn"]),
        learn=tuple(symbol for symbol, controller in options["learn"] if controller is None),
        osc=options["osc"],
        metronome=options["metronome"] or 0.0,
        metronome_port=options["metronome_port"],
        tuner=options["tuner"],
        cores=options["cores"],
    )
    console = Console(options["quiet"])
    with own_stderr(), logged(console, options["log"]), ExitStack() as stack:
        if not cached():
            check_output(settings.backend, settings.audio)
            have_kernels()
        session = Session(settings, console.status if console.terminal else None)
        if options["watch"]:
            stack.enter_context(watching(session, bass))
        stop_instead(session.stop, lambda: session.synth is not None)
        if memory.used and (said := memory.said()):
            console.show(f"as the last time: {said}")
        if interactive():
            console.show(HELP)
            if read:
                console.show(SCORE_HELP)
        summary = session.run()
        of_file = {name for _, _, name in later_presets(score, DEFAULT_PRESET)} if score else set()
        memory.keep(summary, {preset, *of_file}, session.desk.learned)
        m = summary.meters
        LOG.info(
            f"played {summary.seconds:.1f} s, {m.messages} messages, worst block {summary.worst:.0%} of its time, "
            f"{m.late} late, {m.underruns} underruns"
            + (f", {summary.dropped} note{'s' * (summary.dropped != 1)} dropped" if summary.dropped else "")
            + (f", {m.faults} faults" if m.faults else "")
            + (f", {m.lost} frames not recorded" if m.lost else "")
            + (clipping(m.clipped, options["gain"], decibels(summary.peak)) if m.clipped else "")
            + (f"; {' and '.join(map(str, summary.recorded))}" if summary.recorded else "")
        )
        if summary.lost:
            LOG.debug(summary.lost)
            files = " and ".join(map(str, summary.recorded))
            kept = f"; {files} {'is' if len(summary.recorded) == 1 else 'are'} complete" if files else ""
            raise OutputGone(f"{summary.lost}{kept}")
        if summary.short:
            raise OutputError(f"not all was recorded: {summary.short}")


@contextmanager
def watching(session: Session, bass: Instrument) -> Iterator[None]:
    """Serves the page that watches the session, which begins with `bass`; prints its address."""
    from livebass.web.serve import PageServer
    from livebass.web.watch import STREAM, stream, watch_files

    streams = {STREAM: functools.partial(stream, lambda: session.output.synth if session.synth else None)}
    with PageServer(watch_files(bass), streams=streams, token=secrets.token_urlsafe()) as server:
        click.echo(server.address)
        yield


def first_bass(
    preset: str, load: Callable[[str], Instrument], tuning: dict[str, Any], memory: Memory
) -> tuple[str, Instrument]:
    """Loads `preset`; returns the name of what plays, and the bass.

    What is remembered and does not fit is said and left out, of the `tuning` that `load` uses, too. Raises PresetError.
    """
    recalled = [name for name in tuning if name in memory.used]
    try:
        return preset, load(preset)
    except ValueError as error:
        if not recalled and ("preset" not in memory.used or tuning):
            raise
        problem = error
    for name in recalled:
        del tuning[name], memory.used[name]
    try:
        bass = load(preset)
        say(f"as remembered: {problem}; {', '.join(recalled)} left out")
        return preset, bass
    except ValueError:
        if "preset" not in memory.used or tuning:
            raise
    left = f", {', '.join(recalled)} left out" if recalled else ""
    say(f"as remembered: {problem}; {DEFAULT_PRESET} plays{left}")
    return DEFAULT_PRESET, load(DEFAULT_PRESET)


JACK_ONLY = ("transport", "metronome_port", "client_name", "no_connect", "strings")  # options


def check_together(options: dict[str, Any]) -> None:
    """Raises UsageError for options that do not go together; JACK's own make JACK the backend."""
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
            if options[name] and (name != "tempo" or given(name)):
                raise click.UsageError(f"--{name} is for a --file, or a --demo: name one")
    if options["transport"] and options["loop"]:
        raise click.UsageError("--loop repeats the file, --transport moves it as JACK does: leave one out")
    if options["metronome_port"] and not options["metronome"]:
        raise click.UsageError("--metronome-port: say how fast, by --metronome BPM")
    if options["no_connect"] and options["midi"] is not None:
        raise click.UsageError("--midi names what to connect, --no-connect connects nothing: leave one out")
    if options["client_name"] is not None and not is_client_name(options["client_name"]):
        raise click.UsageError("--client-name: allowed are 1 to 32 characters, of which none is a colon")
    chosen = [controller for _, controller in options["learn"] if isinstance(controller, int)]
    if len({symbol for symbol, _ in options["learn"]}) < len(options["learn"]) or len(set(chosen)) < len(chosen):
        raise click.UsageError("--learn: one controller for each parameter, and one parameter for each controller")


def is_client_name(name: str) -> bool:
    """True for a name that every JACK server takes."""
    return 0 < len(name.encode(errors="replace")) <= 32 and name.isprintable() and ":" not in name


@dataclass(frozen=True)
class Memory:
    """Holds the choices of the last time, and those of them that are used now."""

    path: Path | None  # None: nothing is kept
    before: Remembered
    used: dict[str, Any]  # options
    given: frozenset[str]  # options of the command line

    def said(self) -> str:
        """One line about what is used."""
        return Remembered(**self.used).said()

    def controllers(self, learn: tuple[tuple[str, int | str | None], ...]) -> dict[str, int]:
        """The controllers to begin with: those remembered, but as the options say."""
        controllers = dict(self.before.controllers)
        for symbol, controller in learn:
            controllers = {s: c for s, c in controllers.items() if s != symbol and c != controller}
            if isinstance(controller, int):
                controllers[symbol] = controller
        return controllers

    def keep(self, summary: Summary, unchosen: set[str | None], learned: dict[str, int]) -> None:
        """Remembers what was chosen now, and what was chosen before if nothing else was. A full disk is a warning.

        `unchosen` are presets that the player has not chosen: the first one, and those of a file.
        """
        if self.path is None:
            return
        changes: dict[str, Any] = {"controllers": learned}
        if "preset" in self.given or summary.preset not in unchosen:
            is_file = summary.preset.endswith(".toml") or "/" in summary.preset
            changes["preset"] = os.path.abspath(summary.preset) if is_file else summary.preset
        if "gain" in self.given:
            changes["gain"] = click.get_current_context().params["gain"]
        for name in TUNING_KEYS:
            if name in self.given:
                changes[name] = click.get_current_context().params[name] or None
        if self.given & {"backend", "audio"}:
            wanted = click.get_current_context().params["backend"]
            changes["backend"] = wanted if wanted == "portaudio" else None  # JACK plays anyway where it runs
            changes["audio"] = summary.audio if "audio" in self.given else None
        if "midi" in self.given:
            wanted = click.get_current_context().params["midi"]
            changes["midi"] = summary.midi if is_number(wanted) else wanted
        now = replace(self.before, **changes)
        try:
            if now != self.before:
                save(self.path, now)
        except (OutputError, ValueError) as error:
            LOG.warning("not remembered: %s", error)


def recall(options: dict[str, Any]) -> Memory:
    """Reads the choices of the last time, for options not given. A damaged file gets one line, and stays as it is."""
    names = ("preset", "gain", "backend", "audio", "midi", *TUNING_KEYS)
    chosen = frozenset(name for name in names if given(name))
    if options["no_settings"]:
        return Memory(None, Remembered(), {}, chosen)
    path = settings_file()
    if options["forgotten"]:
        forget(path)
    try:
        before = load(path)
    except DamagedSettings as error:
        say(f"{error}; nothing is remembered until `livebass play --forget` deletes the file")
        return Memory(None, Remembered(), {}, chosen)
    wanted = {"preset", "gain", "midi", *TUNING_KEYS} - chosen
    if not chosen & {"backend", "audio"} and options["backend"] == "auto":
        wanted |= {"backend", "audio"}
    if options["song"]:
        wanted -= {"preset", "tuning", "capo"}  # the file asks for a bass
    if options["no_connect"]:
        wanted -= {"midi"}
    used = {name: getattr(before, name) for name in wanted if getattr(before, name)}
    return Memory(path, before, used, chosen)


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
    level, root, none = LOG.level, logging.getLogger(), logging.NullHandler()
    root.addHandler(none)  # a library that logs (python-osc) would give the root one to stderr, and double every line
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
        root.removeHandler(none)


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
            line = one_line(line)
            self._print(filled(line) if self.terminal else line)

    def status(self, line: str) -> None:
        """Shows `line` in place of the last status line, as far as it fits; a narrow terminal has no bar."""
        columns = width()
        shown = one_line(line) if columns >= NARROW else BAR.sub("", one_line(line))
        self._print(shown[: columns - 1], end="")

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
        return f"{when.isoformat(' ', 'milliseconds')}  {one_line(record.getMessage())}"

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
    from livebass.live.guards import own_stderr
    from livebass.live.inputs import MidiLost, port_names
    from livebass.live.outputs import OutputLost, jack_server, output_names

    with own_stderr():  # what C libraries say here is no part of the list
        click.echo(f"JACK server (--backend jack)\n  {jack_server() or 'none'}")
        for title, names, lost in (
            ("audio outputs of PortAudio (--audio)", output_names, OutputLost),
            ("MIDI inputs (--midi)", port_names, MidiLost),
        ):
            click.echo(title)
            try:
                lines = names()
            except lost as error:
                click.echo(f"  none: {one_line(str(error))}")
                continue
            for number, name in lines.items() if isinstance(lines, dict) else enumerate(lines):
                click.echo(f"  {number}  {one_line(name)}")
            if not lines:
                click.echo("  none")
