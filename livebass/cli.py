"""The command `livebass`: its parts, its errors and its exit statuses. Only cli*.py print.

0 done; 1 something in the data or on the disk; 2 wrong usage; 130 and 143 interrupted. An error is one line.
"""

from __future__ import annotations

import contextlib
import os
import signal
import sys
import traceback
from collections.abc import Sequence
from typing import NoReturn

import click

from livebass import __version__
from livebass.cli_presets import presets
from livebass.cli_render import render
from livebass.cli_study import bench, simulate

INTERRUPTED, TERMINATED, BROKEN_PIPE = 130, 143, 141
EXPECTED = (ValueError, OSError, MemoryError)  # what the package raises on purpose, and LookupError itself


@click.group(context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 110})
@click.version_option(__version__, package_name="livebass")
def livebass() -> None:
    """A physical-model electric bass whose strings hit their frets.

    \b
    Examples:
      livebass render --note G2 --velocity 120       one hard note into G2.wav
      livebass render song.mid -o song.wav           the bass part of a MIDI file
      livebass presets list                          the basses there are
    """


for command in (render, presets, simulate, bench):
    livebass.add_command(command)


def main(arguments: Sequence[str] | None = None) -> NoReturn:
    """Run the command line (`sys.argv` by default) and exit."""
    for name in ("SIGTERM", "SIGHUP"):
        if hasattr(signal, name):
            signal.signal(getattr(signal, name), _terminated)
    sys.exit(run(arguments))


def run(arguments: Sequence[str] | None = None) -> int:
    """Run the command line; the exit status. Whatever goes wrong becomes one line on stderr."""
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
        _complain("interrupted, nothing written")
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


def _terminated(number: int, frame: object) -> NoReturn:
    sys.exit(128 + number)
