"""The command `livebass`: its parts, its errors and its exit statuses. Only cli*.py print.

0 done; 1 something in the data or on the disk; 2 wrong usage; 130 and 143 interrupted. An error is one line.
"""

from __future__ import annotations

import contextlib
import math
import os
import signal
import sys
import time
import traceback
from collections.abc import Sequence
from pathlib import Path
from types import FrameType
from typing import NoReturn

import click

from livebass import __version__
from livebass.cli.bench import bench
from livebass.cli.help import help_
from livebass.cli.play import devices, play
from livebass.cli.presets import identify, presets
from livebass.cli.render import render
from livebass.cli.study import simulate, study
from livebass.files import STOPS, written

INTERRUPTED, TERMINATED, BROKEN_PIPE = 130, 143, 141
MANY = 8  # files that an interrupt still names
EXPECTED = (ValueError, OSError, MemoryError)  # what the package raises on purpose, and LookupError itself


@click.group(context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 110})
@click.version_option(__version__, package_name="livebass")
def livebass() -> None:
    """A physical-model electric bass whose strings hit their frets.

    \b
    Examples:
      livebass play                                  live, from a MIDI or the computer keyboard
      livebass render --note G2 --velocity 120       one hard note into G2.wav
      livebass render song.mid -o song.wav           the bass part of a MIDI file
      livebass presets list                          the basses there are
    """


for command in (play, render, presets, devices, simulate, study, identify, bench, help_):
    livebass.add_command(command)


def main(arguments: Sequence[str] | None = None) -> NoReturn:
    """Run the command line (`sys.argv` by default) and exit."""
    heeded = [number for number in STOPS if signal.getsignal(number) is not signal.SIG_IGN]  # nohup: not SIGHUP
    for number in heeded:
        signal.signal(number, _Stop())
    sys.unraisablehook = _lost
    try:
        status = run(arguments)
    finally:
        for number in heeded:
            signal.signal(number, signal.SIG_IGN)  # only the interpreter's end is left
    sys.exit(status)


def run(arguments: Sequence[str] | None = None) -> int:
    """Run the command line; the exit status. Whatever goes wrong becomes one line on stderr."""
    before = len(written)
    try:
        status = livebass.main(args=arguments, prog_name="livebass", standalone_mode=False)
        sys.stdout.flush()
        return status if isinstance(status, int) else 0
    except click.exceptions.NoArgsIsHelpError as help_text:
        click.echo(help_text.format_message(), err=True)
        return help_text.exit_code
    except click.ClickException as error:
        _complain(error.format_message())
        return error.exit_code
    except (click.Abort, KeyboardInterrupt):
        complete = _named(written[before:])
        _complain(f"interrupted, but complete: {complete}" if complete else "interrupted, nothing written")
        return INTERRUPTED
    except BrokenPipeError:
        _silence_stdout()
        return BROKEN_PIPE
    except Exception as error:
        if os.environ.get("LIVEBASS_TRACEBACK"):
            traceback.print_exc()
        if (isinstance(error, EXPECTED) or type(error) is LookupError) and str(error):
            _complain(str(error))
        else:
            _complain(f"internal error, {type(error).__name__}: {error} (LIVEBASS_TRACEBACK=1 shows where)")
        _silence_stdout()
        return 1


def _named(files: list[Path]) -> str:
    """Some files by name, many by their directories."""
    if len(files) <= MANY:
        return ", ".join(map(str, files))
    return ", ".join(dict.fromkeys(str(file.parent) for file in files))


def _complain(message: str) -> None:
    """One line, whatever is in it: file names may hold line ends and terminal codes."""
    line = " ".join("".join(c if c.isprintable() else " " for c in message).split())
    with contextlib.suppress(OSError):
        click.echo(f"livebass: error: {line}", err=True)


def _silence_stdout() -> None:
    """Keep the interpreter from complaining, at its end, that stdout cannot be flushed."""
    with contextlib.suppress(OSError, ValueError):
        sys.stdout.flush()
        return
    with contextlib.suppress(OSError, ValueError):
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


class _Stop:
    """A signal's handler: stops the program in order, and is deaf while that goes on, but not for ever."""

    PATIENCE = 2.0  # s
    latest = -math.inf  # s, when one was heeded last
    number = signal.SIGINT  # which it was

    def __call__(self, number: int, frame: FrameType | None) -> None:
        now = time.monotonic()
        if now - _Stop.latest > self.PATIENCE:
            _Stop.latest, _Stop.number = now, signal.Signals(number)
            raise KeyboardInterrupt if number == signal.SIGINT else SystemExit(128 + number)


def _lost(what: sys.UnraisableHookArgs) -> None:
    """An exception nobody can catch, such as one in the compiler's callbacks: if it is ours, again a bit later."""
    if isinstance(what.exc_value, KeyboardInterrupt | SystemExit):
        signal.signal(signal.SIGALRM, _again)
        signal.setitimer(signal.ITIMER_REAL, 0.01)
    else:
        sys.__unraisablehook__(what)


def _again(number: int, frame: FrameType | None) -> None:
    _Stop.latest = -math.inf
    signal.raise_signal(_Stop.number)
