"""Option groups: `--help` with headings, for commands with many options."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import click

WIDTH = 30  # of the option column, under every heading


class GroupedCommand(click.Command):
    """A command whose `--help` groups options by heading; `groups` are {heading: options, as "--file --demo"}."""

    def __init__(self, *arguments: Any, groups: Mapping[str, str], **more: Any) -> None:
        super().__init__(*arguments, **more)
        self.groups = {heading: options.split() for heading, options in groups.items()}

    def format_options(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        options = {parameter.opts[-1]: parameter for parameter in self.get_params(ctx)}
        for heading, names in self.groups.items():
            with formatter.section(heading):
                rows = [row for name in names if (row := options[name].get_help_record(ctx))]
                formatter.write_dl([(name.ljust(WIDTH), text) for name, text in rows])
