"""`livebass help`: the pages of the handbook, the same files that README.md links to."""

from __future__ import annotations

from importlib import resources

import click

PAGES = ("playing", "presets", "live", "physics", "studies", "cost", "export")  # in reading order


def page_text(page: str) -> str:
    """The Markdown text of one of PAGES; its first line is "# Name: one line about it"."""
    return (resources.files("livebass") / "help" / f"{page}.md").read_text(encoding="utf-8")


def contents() -> str:
    """One line for each page: its name and the title without that name."""
    titles = {page: page_text(page).splitlines()[0].partition(": ")[2] for page in PAGES}
    return "".join(f"livebass help {page:8}  {title}\n" for page, title in titles.items())


@click.command("help")
@click.argument("page", required=False, metavar="[PAGE]")
def help_(page: str | None) -> None:
    """Read a page of the handbook.

    Without PAGE, list the pages.

    In a terminal a page opens in the pager (PAGER, such as less); into a file or a pipe it is printed.

    \b
    Examples:
      livebass help
      livebass help playing
      livebass help physics > physics.md
    """
    if page is None:
        click.echo(contents() + "\nlivebass COMMAND --help explains one command.")
    elif page in PAGES:
        click.echo_via_pager(page_text(page).removesuffix("\n"))  # which the pager adds
    else:
        pages = ", ".join(PAGES)
        raise click.UsageError(f"help {page}: there is no such page; the pages are {pages}")
