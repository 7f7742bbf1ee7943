"""Option groups: `--help` with headings, for commands with many options."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import click

WIDTH = 30  # of the option column, under every heading


class GroupedCommand(click.Command):
    """A command whose `--help` groups options by heading; `groups` are {heading: options, as "--file --demo"}.

    `surplus`: what to do with an argument too many, for the error.
    """

    def __init__(self, *arguments: Any, groups: Mapping[str, str], surplus: str = "", **more: Any) -> None:
        super().__init__(*arguments, **more)
        self.surplus = surplus
        self.groups = {heading: options.split() for heading, options in groups.items()}

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        left = ctx.allow_extra_args
        ctx.allow_extra_args = True
        super().parse_args(ctx, args)
        ctx.allow_extra_args = left
        if ctx.args and not (left or ctx.resilient_parsing):
            hint = f"; {self.surplus}" if self.surplus else ""
            raise click.UsageError(f"{ctx.args[0]}: one argument too many{hint}", ctx)
        return ctx.args

    def format_options(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        options = {name: parameter for parameter in self.get_params(ctx) for name in parameter.opts}
        for heading, names in self.groups.items():
            with formatter.section(heading):
                rows = [row for name in names if (row := options[name].get_help_record(ctx))]
                formatter.write_dl([(name.ljust(WIDTH), text) for name, text in rows])
