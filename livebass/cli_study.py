"""`livebass study`: cases, figures and statements of Issanchou et al. (2018) anew, and questions of one's own."""

from __future__ import annotations

import click

from livebass.cli_sweep import sweep


@click.group()
def study() -> None:
    """The paper's cases, figures and statements computed anew; sweeps over any parameter of a preset."""


study.add_command(sweep)
