"""The commands that README and the handbook quote."""

from __future__ import annotations

import re
import shlex
from collections.abc import Iterator
from pathlib import Path

import click

from livebass.cli.main import livebass as program
from support.places import ROOT

README = ROOT / "README.md"
PAGES = sorted((ROOT / "livebass" / "help").glob("*.md"))


def quoted_commands(text: str) -> Iterator[tuple[str, bool]]:
    """(command line, True if in a runnable block) for each `livebass ...` of a Markdown text."""
    fences = re.findall(r"^```sh\n(.*?)^```", text, re.DOTALL | re.MULTILINE)
    blocks = [*"".join(fences).splitlines(), *re.findall(r"^ {4}(\S.*)", text, re.MULTILINE)]
    for line in blocks:
        if match := re.match(r"(?:\.venv/bin/)?livebass (.*)", line):
            yield match[1], True
    for line in re.findall(r"`livebass ([^`]+)`", text):
        yield line, False


def every_command() -> Iterator[tuple[Path, str, bool]]:
    """The file, line and kind (as `quoted_commands`) of every command in README and the handbook."""
    for file in (README, *PAGES):
        for line, whole in quoted_commands(file.read_text(encoding="utf-8")):
            if not line.startswith(("COMMAND ", "help PAGE")):
                yield file, line, whole


def context(command: click.Command, arguments: list[str]) -> click.Context:
    """What a command makes of its arguments, as within the program. Raises click's errors."""
    return command.make_context("livebass", arguments.copy(), parent=click.Context(program, **program.context_settings))


def command_of(line: str) -> tuple[click.Command, list[str]]:
    """The command of a line, and its arguments."""
    arguments = shlex.split(re.split(r"\s[>|]\s", line)[0], comments=True)
    command: click.Command = program
    while isinstance(command, click.Group) and arguments and not arguments[0].startswith("-"):
        if arguments[0] not in command.commands and "run" in command.commands:
            arguments = ["run", *arguments]
        command, arguments = command.commands[arguments[0]], arguments[1:]
    return command, arguments
