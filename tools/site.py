"""Builds the project's site: first page, handbook, Python interface, the live page, sounds, notes.

tools/site [-o build/site]     in .venv with the extra `site`, which tools/run.py installs

Its pages are the repository's own Markdown files, which `assembled` puts together with docs/site. Sphinx builds them,
with warnings as errors, and tools/links.py looks for dead links. The same sources give the same bytes.
"""

from __future__ import annotations

import argparse
import importlib.util
import os
import re
import shutil
import subprocess
import sys
import tempfile
import tomllib
from collections.abc import Callable, Iterator
from html import escape
from itertools import groupby
from operator import itemgetter
from pathlib import Path
from urllib.parse import unquote, urljoin

from links import check

from livebass.cli.help import PAGES
from livebass.files.whole import OutputError, whole_directory
from livebass.web.modules import text as page_source
from livebass.web.public import ICON

ROOT = Path(__file__).resolve().parents[1]
SITE = ROOT / "docs" / "site"  # configuration, and the pages that only the site has
FIRST, START = "index.md", "start.md"  # START is README.md
PLAY, SOUNDS, FILES = "play", "sounds", "files"
NEEDED = ("sphinx", "myst_parser", "pydata_sphinx_theme")  # the extra `site`
MADE = "objects.inv"  # Sphinx writes it into every site
LEFT = (".buildinfo", "_static/webpack-macros.html")  # for a later build, and a template of the theme
LINK = re.compile(r"(!?)\[([^\]]*)\]\(([^)\s]+)\)")
HELP = re.compile(rf"`livebass help ({'|'.join(PAGES)})`")
PAGE = re.compile(r"(?<![\w`([/.-])(docs/[\w/-]+\.md)\b")  # a page named in a text without a link
HEADING = re.compile(r"(#+) +(.+?) *#*")
TITLE = re.compile(r"# (\w+): (.+)")
MARK = re.compile(r"<!-- README: (.+) -->")
HEAR = "<!-- sounds -->"
DOOR = re.compile(r"I \w+")  # README's sections for three kinds of readers: I have a DAW, I have a terminal, I study


class SiteError(Exception):
    """The site cannot be built; one line."""


def addresses() -> dict[str, str]:
    """Returns the project's public addresses by name: [project.urls] of pyproject.toml."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    return dict(project.get("urls", {}))


def pages() -> dict[str, Path]:
    """Returns the files of the repository that are pages, by their place on the site, in reading order."""
    handbook = {f"handbook/{page}.md": ROOT / "livebass" / "help" / f"{page}.md" for page in PAGES}
    notes = {f"notes/{file.name}": file for file in sorted((ROOT / "docs" / "notes").glob("*.md"))}
    project = {f"project/{file.stem.lower()}.md": file for file in (*ROOT.glob("*.md"), *(ROOT / "docs").glob("*.md"))}
    project |= {f"project/{file.parent.name}.md": file for file in ROOT.glob("findings/README.md")}
    project.pop("project/readme.md", None)
    return {START: ROOT / "README.md", **handbook, **notes, **dict(sorted(project.items()))}


def unfenced(text: str) -> Iterator[tuple[str, bool]]:
    """Yields each line, and whether it is Markdown rather than code between fences."""
    fence = ""
    for line in text.splitlines(keepends=True):
        mark = re.match(r" {0,3}(```+|~~~+)", line)
        if mark and not fence:
            fence = mark[1]
            yield line, False
        elif mark and mark[1].startswith(fence):
            fence = ""
            yield line, False
        else:
            yield line, not fence


def sections(text: str) -> dict[str, str]:
    """Returns the sections of a Markdown text by heading, without it; "" is what stands before the second heading.

    A section ends at the next heading of its level or above.
    """
    lines = list(unfenced(text))
    heads = [(i, HEADING.fullmatch(line.rstrip("\n"))) for i, (line, prose) in enumerate(lines) if prose]
    found = [(i, len(head[1]), head[2]) for i, head in heads if head]
    parts = {}
    for order, (start, level, title) in enumerate(found):
        later = found[order + 1 :]
        top = order == 0
        end = next((i for i, depth, _ in later if top or depth <= level), len(lines))
        parts["" if top else title] = "".join(line for line, _ in lines[start + 1 : end]).strip("\n")
    return parts


class Assembly:
    """Puts the sources of the site together in a folder."""

    def __init__(self, to: Path) -> None:
        self.to, self.urls, self.pages = to, addresses(), pages()
        self.places = {file: place for place, file in self.pages.items()}

    def assemble(self) -> None:
        """Writes all sources. Raises SiteError for a link that leads nowhere."""
        shutil.copytree(SITE, self.to, dirs_exist_ok=True, ignore=shutil.ignore_patterns("__pycache__"))
        icon = unquote(ICON.findall(page_source("index.html"))[0].partition(",")[2])
        (self.to / "icon.svg").write_text(icon + "\n", encoding="utf-8")
        for place, file in self.pages.items():
            text = file.read_text(encoding="utf-8")
            if place.startswith("handbook/"):  # "Name: contents" is a long title for a narrow screen and for navigation
                text = TITLE.sub(lambda m: f"# {m[1]}\n\n*{m[2][0].upper()}{m[2][1:]}.*", text, count=1)
            elif place == START:
                text = re.sub(r"^# .*$", "# First steps", text, count=1, flags=re.MULTILINE)
            self._write(place, self.linked(text, file, place))
        readme = sections((ROOT / "README.md").read_text(encoding="utf-8"))
        for file in sorted(self.to.rglob("*.md")):
            place = file.relative_to(self.to).as_posix()
            if place not in self.pages:
                self._write(place, self._filled(file.read_text(encoding="utf-8"), readme, place))

    def _filled(self, text: str, readme: dict[str, str], place: str) -> str:
        """Returns a page of docs/site with sections of README.md, or players for sounds, in place of its marks."""
        text = MARK.sub(lambda mark: self._of_readme(mark[1], readme, place), text)
        return text.replace(HEAR, self._players(text, place))

    def _of_readme(self, wanted: str, readme: dict[str, str], place: str) -> str:
        """Returns a section of README.md for a page of docs/site: its "beginning", its "doors", or one by heading."""
        doors = {title: f"## {title}\n\n{text}" for title, text in readme.items() if DOOR.match(title)}
        found = {"beginning": readme[""], "doors": "\n\n".join(doors.values()), **readme}
        if wanted not in found:
            raise SiteError(f"docs/site/{place}: README.md has no section {wanted!r}")
        return self.linked(found[wanted], ROOT / "README.md", place)

    def _players(self, page: str, place: str) -> str:
        """Returns the sounds of docs/sounds/sounds.toml that `page` lacks, each with its text and a player."""
        table = ROOT / "docs" / SOUNDS / "sounds.toml"
        rows = tomllib.loads(table.read_text(encoding="utf-8"))["sound"] if table.exists() else []
        shown = [
            f"[**{row['title']}.**](docs/{SOUNDS}/{row['file']}) {row['text']}"
            for row in rows if f'src="{SOUNDS}/{row["file"]}"' not in page
        ]  # fmt: skip
        return self.linked("\n\n".join(shown), ROOT / "README.md", place)

    def _write(self, place: str, text: str) -> None:
        file = self.to / place
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(text, encoding="utf-8")

    def linked(self, text: str, source: Path, place: str) -> str:
        """Returns `text` of the file `source` as it stands at `place`: links between files become links on the site.

        A link to a sound at the start of a line, an item or a row becomes a player. `livebass help PAGE` leads to that
        page.
        """
        up = "../" * place.count("/")

        def link(match: re.Match[str]) -> str:
            mark, words, target = match.groups()
            path, _, anchor = target.partition("#")
            own = self.urls.get("Site")
            if own and (target == own or target.startswith(own.rstrip("/") + "/")):
                return f'<a href="{up}{target[len(own) :].strip("/") or "index.html"}">{words}</a>'
            if re.match(r"[a-z]+:", path):
                return match[0]
            if not path:  # a section of `source`, which may be part of another page here
                return match[0] if self.places[source] == place else f"[{words}]({up}{self.places[source]}#{anchor})"
            file = (source.parent / unquote(path)).resolve()
            if not file.exists() or not file.is_relative_to(ROOT):
                raise SiteError(f"{source.relative_to(ROOT)}: {target}: there is no such file")
            if file in self.places:
                return f"{mark}[{words}]({up}{self.places[file]}{anchor and '#' + anchor})"
            if file.is_dir():
                return f"[{words}]({self._in_source(file)})"
            inside = file.relative_to(ROOT).as_posix()
            before = match.string[: match.start()].rpartition("\n")[2]
            if file.suffix == ".ogg" and before.strip() in ("", "-", "*", "|"):
                copy = f"{SOUNDS}/{file.name}"
                self._copy(file, copy)
                label = escape(words.strip("*."))
                return f'{words} <audio controls preload="none" aria-label="{label}" src="{up}{copy}"></audio>'
            self._copy(file, f"{FILES}/{inside}")
            at = f"{up}{FILES}/{inside}"
            return f"![{words}]({at})" if mark else f'<a href="{at}">{words}</a>'

        def page(match: re.Match[str]) -> str:
            file = ROOT / match[1]
            return f"[{match[1]}]({up}{self.places[file]})" if file in self.places else match[0]

        def prose(text: str) -> str:
            text = PAGE.sub(page, LINK.sub(link, text))
            at = "" if place.startswith("handbook/") else f"{up}handbook/"
            return HELP.sub(lambda m: f"[{m[0]}]({at}{m[1]}.md)", text)

        code = re.compile(r" {4}|\t")  # indented code; no list of ours has links so deep
        lines = [(line, is_prose and not code.match(line)) for line, is_prose in unfenced(text)]
        blocks = [("".join(line for line, _ in run), is_prose) for is_prose, run in groupby(lines, itemgetter(1))]
        return "".join(prose(block) if is_prose else block for block, is_prose in blocks)

    def _in_source(self, folder: Path) -> str:
        if "Source" not in self.urls:
            raise SiteError("pyproject.toml: [project.urls] has no Source, the repository's address")
        return f"{self.urls['Source'].rstrip('/')}/tree/HEAD/{folder.relative_to(ROOT).as_posix()}"

    def _copy(self, file: Path, place: str) -> None:
        target = self.to / place
        target.parent.mkdir(parents=True, exist_ok=True)
        shutil.copyfile(file, target)


def run(command: list[str], what: str) -> None:
    """Runs a Python module with the arguments `command`. Raises SiteError with its output if it fails."""
    environment = os.environ | {"PYTHONHASHSEED": "0", "SOURCE_DATE_EPOCH": "0"}
    done = subprocess.run(
        [sys.executable, "-m", *command], cwd=ROOT, env=environment, check=False,
        stdout=subprocess.PIPE, stderr=subprocess.STDOUT, encoding="utf-8", errors="backslashreplace",
    )  # fmt: skip
    if done.returncode:
        raise SiteError(f"{what} failed:\n{done.stdout.rstrip()}")


def build(out: Path) -> set[str]:
    """Builds the site as the folder `out`; returns the links that lead elsewhere. Raises SiteError, OutputError."""
    address = addresses().get("Site")
    own: list[str] = ["--address", urljoin(address.rstrip("/") + "/", f"{PLAY}/")] if address else []
    with whole_directory(out, is_site) as new, tempfile.TemporaryDirectory() as scratch:
        source, cache = Path(scratch) / "source", Path(scratch) / "cache"
        Assembly(source).assemble()
        sphinx = ["--quiet", "--fail-on-warning", "--builder=html", "--jobs=auto", f"--doctree-dir={cache}"]
        run(["sphinx", *sphinx, str(source), str(new)], "Sphinx")
        for folder in (SOUNDS, FILES):
            if (source / folder).is_dir():
                shutil.copytree(source / folder, new / folder)
        for name in LEFT:
            (new / name).unlink(missing_ok=True)
        shutil.rmtree(new / "_sources", ignore_errors=True)  # empty
        run(["livebass", "export", "web", "-o", str(new / PLAY), *own], "livebass export web")
        faults, elsewhere = check(new)
        if faults:
            raise SiteError("\n".join(["dead links:", *faults]))
    return elsewhere


def is_site(entries: list[Path]) -> bool:
    """True if these are the entries of a site that this program built: they may be replaced."""
    return {MADE, PLAY, "index.html"} <= {entry.name for entry in entries}


def main(report: Callable[[str], None] = print) -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("-o", "--out", type=Path, default=ROOT / "build" / "site", help="folder (build/site)")
    given = parser.parse_args()
    if missing := [name for name in NEEDED if importlib.util.find_spec(name) is None]:
        print(f"tools/site.py: needs {', '.join(missing)}: tools/run.py site installs them", file=sys.stderr)
        return 1
    try:
        elsewhere = build(given.out.resolve())
    except (SiteError, OutputError) as error:
        print(f"tools/site.py: {error}", file=sys.stderr)
        return 1
    report(f"{given.out / 'index.html'}: no dead link; {len(elsewhere)} links lead elsewhere, which were not followed")
    return 0


if __name__ == "__main__":
    sys.exit(main())
