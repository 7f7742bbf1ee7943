"""`livebass help`: shows the pages of the handbook, the same files that README.md links to."""

from __future__ import annotations

import difflib
from importlib import resources

import click

PAGES = ("playing", "tab", "presets", "live", "physics", "studies", "cost", "export", "install")  # in reading order


def page_text(page: str) -> str:
    """The Markdown text of one of PAGES; its first line is "# Name: summary in one line"."""
    return (resources.files("livebass") / "help" / f"{page}.md").read_text(encoding="utf-8")


def contents() -> str:
    """One line per page: its name and the rest of its title."""
    titles = {page: page_text(page).splitlines()[0].partition(": ")[2] for page in PAGES}
    return "".join(f"livebass help {page:8}  {title}\n" for page, title in titles.items())


def begun_by(word: str) -> list[str]:
    """The pages whose names begin with `word`, ignoring case."""
    return [page for page in PAGES if word and page.startswith(word.casefold())]


@click.command("help")
@click.argument("page", required=False, metavar="[PAGE]")
def help_(page: str | None) -> None:
    """Read a page of the handbook.

    Without PAGE, list the pages. You may shorten the name of a page. In a terminal the page opens in the pager (PAGER,
    such as less); otherwise it is printed.

    \b
    Examples:
      livebass help
      livebass help playing
      livebass help physics > physics.md
    """
    if page is None:
        click.echo(contents() + "\nlivebass COMMAND --help explains one command.")
        return
    begun = begun_by(page)
    if len(begun) != 1:
        near = begun or difflib.get_close_matches(page.casefold(), PAGES, 1)
        meant = f"did you mean {' or '.join(near)}? " if near else ""
        raise click.UsageError(f"help {page}: there is no such page; {meant}the pages are {', '.join(PAGES)}")
    click.echo_via_pager(page_text(begun[0]).removesuffix("\n"))  # the pager adds the line end
