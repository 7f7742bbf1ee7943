"""The command `livebass`: its subcommands, errors and exit statuses. Only the files of this package print.

Status 0: done; 1: an error in the data or on the disk; 2: wrong usage; 128 + n: ended by signal n (`interrupts`).
An error is one line on stderr.
"""

from __future__ import annotations

import contextlib
import errno
import importlib
import os
import platform
import re
import sys
import traceback
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, NoReturn

import click

from livebass import __version__
from livebass.cli.messages import say
from livebass.files.whole import Output, noted_output
from livebass.system.interrupts import INTERRUPTED, handle_signals, leave

BROKEN_PIPE = 141  # exit status
MANY = 8  # an interrupt names up to so many files one by one
EXPECTED = (ValueError, OSError, MemoryError)  # raised by the package on purpose, besides LookupError itself


# Commands whose file is not called like them, or whose function is not: the file of this package and the function
ELSEWHERE = {
    "simulate": ("study", "simulate"),
    "map": ("map", "map_"),
    "identify": ("presets", "identify"),
    "help": ("help", "help_"),
}
COMMANDS = (
    "play", "page", "render", "presets", "devices", "export", "simulate", "map", "study", "identify", "compare", "fit",
    "bench", "help",
)  # fmt: skip


class LoadedAtUse(Mapping[str, click.Command]):
    """The commands by name. A command's file is imported when it is first asked for."""

    def __getitem__(self, name: str) -> click.Command:
        if name not in COMMANDS:
            raise KeyError(name)
        file, function = ELSEWHERE.get(name, (name, name))
        found: click.Command = getattr(importlib.import_module(f"livebass.cli.{file}"), function)
        return found

    def __iter__(self) -> Iterator[str]:
        return iter(COMMANDS)

    def __len__(self) -> int:
        return len(COMMANDS)


class Commands(click.Group):
    """A group that leaves messages for Ctrl-C and the status of a broken pipe to `run`."""

    def resolve_command(
        self, ctx: click.Context, args: list[str]
    ) -> tuple[str | None, click.Command | None, list[str]]:
        if args and args[0] not in self.commands and os.path.isfile(args[0]):
            name = args[0]
            hint = f"`livebass render {name}` renders a file, `livebass play --file {name}` plays it"
            raise click.UsageError(f"{name}: is a file, not a command; {hint}", ctx)
        return super().resolve_command(ctx, args)

    def invoke(self, ctx: click.Context) -> Any:
        try:
            return super().invoke(ctx)
        except KeyboardInterrupt:
            raise click.Abort from None
        except BrokenPipeError:
            _silence_stdout()
            raise click.exceptions.Exit(BROKEN_PIPE) from None


def _show_version(context: click.Context, _: click.Parameter, requested: bool) -> None:
    if requested and not context.resilient_parsing:
        click.echo(version_text())
        context.exit()


@click.group(cls=Commands, context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 110})
@click.option(
    "--version",
    is_flag=True,
    expose_value=False,
    is_eager=True,
    callback=_show_version,
    help="Show the version, the system and the packages, and exit.",
)
def livebass() -> None:
    """A physical-model electric bass whose strings hit their frets.

    \b
    Examples:
      livebass play                                  live, from a MIDI or computer keyboard
      livebass page                                  in a browser, on a page that shows the strings
      livebass render --note G2 --velocity 120       one hard note into G2.wav
      livebass render song.mid -o song.wav           the bass part of a MIDI file
      livebass presets list                          the basses
      livebass export sfz -p slap -o slap-bass       a sample pack for other programs
      livebass help                                  the handbook
    """


livebass.commands = LoadedAtUse()  # type: ignore[assignment]


def version_text() -> str:
    """Returns three lines: the version; system, Python and kernels; the installed packages of livebass."""
    from livebass.compiling.store import level
    from livebass.files.formats import SOUND

    try:
        kernels = f"kernels {level()}, sound {SOUND}"
    except ValueError as error:  # a processor without kernels, or a bad LIVEBASS_LEVEL
        kernels = f"no kernels: {error}"
    system = f"{platform.platform()}, Python {platform.python_version()}, {kernels}"
    return "\n".join([f"livebass, version {__version__}", system, ", ".join(_packages())])


def _packages() -> Iterator[str]:
    """Names and versions of the installed packages that livebass or its extra `live` requires."""
    from importlib import metadata  # imports csv and zipfile, which a render does not need

    with contextlib.suppress(metadata.PackageNotFoundError):
        for requirement in metadata.requires("livebass") or ():
            package, _, condition = requirement.partition(";")
            name = re.split(r"[^\w.-]", package.strip(), maxsplit=1)[0]
            if "extra" not in condition or re.search(r"extra == ['\"]live['\"]", condition):
                with contextlib.suppress(metadata.PackageNotFoundError):
                    yield f"{name} {metadata.version(name)}"


def main(arguments: Sequence[str] | None = None) -> NoReturn:
    """Runs the command line (`sys.argv` by default) and exits."""
    with handle_signals():
        status = run(arguments)
    leave(status)


def run(arguments: Sequence[str] | None = None) -> int:
    """Runs the command line; returns the exit status. Any error becomes one line on stderr."""
    with noted_output() as output:
        return _run(arguments, output)


def _run(arguments: Sequence[str] | None, output: Output) -> int:
    try:
        status = livebass.main(args=arguments, prog_name="livebass", standalone_mode=False)
        sys.stdout.flush()
        return status if isinstance(status, int) else 0
    except click.exceptions.NoArgsIsHelpError as help_text:
        click.echo(help_text.format_message(), err=True)
        return help_text.exit_code
    except click.MissingParameter as error:
        _complain(" ".join(error.format_message().split()))  # lists choices on separate lines
        return error.exit_code
    except click.ClickException as error:
        _complain(error.format_message())
        return error.exit_code
    except (click.Abort, KeyboardInterrupt):
        if sys.stderr.isatty():  # the terminal shows ^C
            click.echo(err=True)
        _complain(f"interrupted{_list_kept(output)}")
        return INTERRUPTED
    except BrokenPipeError:
        _silence_stdout()
        return BROKEN_PIPE
    except Exception as error:
        if os.environ.get("LIVEBASS_TRACEBACK"):
            traceback.print_exc()
        if isinstance(error, OSError) and error.errno == errno.ENOSPC and error.filename is None:
            _complain(f"standard output: cannot be written: {error.strerror}")  # errors of other files name them
        elif (isinstance(error, EXPECTED) or type(error) is LookupError) and str(error):
            _complain(str(error))
        else:
            why = " ".join(str(error).split())
            _complain(f"internal error, {type(error).__name__}: {why} (LIVEBASS_TRACEBACK=1 shows where)")
        _silence_stdout()
        return 1


def _list_kept(output: Output) -> str:
    """Tells which files an interrupt leaves; says nothing of files to a user who asked for none."""
    if output.completed:
        return f", but complete: {_list_files(output.completed)}"
    return ", nothing written" if output.requested else ""


def _list_files(files: list[Path]) -> str:
    """Names a few files one by one, many by their directories."""
    if len(files) <= MANY:
        return ", ".join(map(str, files))
    return ", ".join(dict.fromkeys(str(file.parent) for file in files))


def _complain(message: str) -> None:
    with contextlib.suppress(OSError):
        say(f"livebass: error: {message}")


def _silence_stdout() -> None:
    """Keeps the interpreter from complaining at exit that it cannot flush stdout."""
    with contextlib.suppress(OSError, ValueError):
        sys.stdout.flush()
        return
    with contextlib.suppress(OSError, ValueError):
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
