"""`livebass page`: serves the page that plays and shows the bass, to this machine only."""

from __future__ import annotations

import time
from pathlib import Path
from typing import Any
from urllib.parse import quote

import click

from livebass.cli.effects import effects_options
from livebass.cli.hands import hands_options
from livebass.cli.messages import say
from livebass.cli.options import count_option, flag, option, presets_option, quality_option
from livebass.cli.practice import page_basses, page_tab_options
from livebass.cli.shelf import page_ready
from livebass.cli.tuning import tuning_options
from livebass.system.interrupts import Beside, StopFlag, stop_instead

LOOK_EVERY = 0.2  # s, to check for a signal to stop
STARTS = 2.0  # s, in which a browser starts or fails
TEXT_BROWSERS = ("elinks", "links", "lynx", "w3m", "www-browser")  # run no scripts, and take the terminal


@click.command()
@presets_option
@hands_options
@effects_options
@quality_option("live", "Precision of the strings; studio needs a fast computer.", among=("live", "studio"))
@count_option(
    "--port",
    65535,
    "Port of the server.  [default: any free port]",
    default=0,
    show_default=False,
    minimum=0,
    metavar="port",
)
@page_tab_options
@option(
    "--link", str, "Open a saved link: a bass with its bench settings, story=buzz&step=3, or case=b.", metavar="LINK"
)
@flag("--no-browser", "Print the address only.")
@tuning_options
@click.argument("more", nargs=-1, metavar="")
def page(
    presets: tuple[str, ...],
    quality: str,
    port: int,
    link: str | None,
    no_browser: bool,
    more: tuple[str, ...],
    **options: Any,
) -> None:
    """Open the page that plays the bass and shows its strings.

    This is the page of `livebass export web`, but you can also drop tablature on it. The command prints its address,
    which only this machine can open, until Ctrl-C. LINK is the address of such a page, or the part after its #: a bass
    with its bench settings, a step of a story, or a case of the paper (a, b or c), shown in slow motion.

    \b
    Examples:
      livebass page
      livebass page -p slap -p ./mine.toml
      livebass page --port 8000 --no-browser
      livebass page --link case=b
      livebass page --tab song.gp5
    """
    from livebass.cli.hands import Loader
    from livebass.compiling.library import is_cached as kernels_cached
    from livebass.web.build import is_cached as page_cached
    from livebass.web.export import page_files, waiting_page
    from livebass.web.link import check_link
    from livebass.web.serve import OPENS, PageServer, check_port
    from livebass.web.tab import Opener

    load = Loader(options.copy())
    basses, sources, data = page_basses(presets, more, options)
    if link is not None:
        try:
            check_link(link, basses, sources)
        except ValueError as error:
            raise click.UsageError(f"--link {link}: {error}") from None
    check_port(port)
    stop = StopFlag()
    files: dict[str, bytes] = {}

    def make() -> None:
        page_ready(lambda done: files.update(waiting_page(done)))
        files.update(page_files(basses, quality, sources, {**data, "opens": OPENS}))

    waits = not (kernels_cached() and page_cached())
    if waits:
        files.update(waiting_page(0.0))
    else:
        make()
    with PageServer(files, port, opens=Opener(basses, files, load).open) as server:
        if not waits:
            stop_instead(stop, lambda: True)
        address = server.address
        if link:
            address += "#" + quote(link.rpartition("#")[2], safe="=&%+", errors="surrogateescape")
        click.echo(address)
        if not no_browser and not open_address(address):
            say("no browser could be opened: open the address yourself")
        if waits:  # Ctrl-C ends the compiling
            make()
            stop_instead(stop, lambda: True)
        say("Ctrl-C ends it")
        while not stop.is_set():
            time.sleep(LOOK_EVERY)


def open_address(address: str) -> bool:
    """Opens an address in the user's browser; returns False if no browser that can show the page starts.

    Does not wait for browsers that return only when they are closed.
    """
    import webbrowser

    try:
        if Path(getattr(webbrowser.get(), "name", "")).stem in TEXT_BROWSERS:
            return False
        opening = Beside(lambda: webbrowser.open(address), daemon=True)
        opening.start()
        opening.join(STARTS)
        return opening.is_alive() or bool(opening.answer())
    except webbrowser.Error:
        return False
