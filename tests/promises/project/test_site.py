"""`tools/site.py` and `tools/links.py`: what the site shows, how its pages are put together, which links are dead."""

from __future__ import annotations

import inspect
import re
import sys
from pathlib import Path

import pytest
from support.places import ROOT
from support.programs import load
from support.site import build

import livebass
from livebass.cli.help import PAGES

TOOL, LINKS = load("site"), load("links")
SITE = ROOT / "docs" / "site"
API = {file.name: file.read_text("utf-8") for file in sorted((SITE / "api").glob("*.md"))}
SECTION = re.compile(r"^(Args|Keyword Args|Returns|Yields|Raises):$", re.MULTILINE)
FUNCTIONS = [name for name in livebass.__all__ if inspect.isfunction(getattr(livebass, name))]


def write(folder: Path, files: dict[str, str]) -> Path:
    for name, text in files.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_text(text, encoding="utf-8")
    return folder


@pytest.fixture
def project(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A small project with the site's own pages: first page, handbook page "cost", a note; sounds of two rows."""
    root = write(tmp_path / "project", {
        "README.md": (
            "# it\n\nIt sounds, see [cost](livebass/help/cost.md#qualities).\n\n```sh\n# no heading\n```\n\n"
            "[Here](#windows) is [the\npage](https://it.example.org/play/index.html#x) of [it](https://it.example.org).\n\n"
            "## I have a DAW\n\nUse it.\n\n### Windows\n\nCopy.\n\n## In Python\n\n`livebass help cost`\n"
        ),
        "CONTRIBUTING.md": "# Contributing\n\nSee [licence](LICENSE), [tests](tests), [web](https://example.org/a.md).\n",
        "LICENSE": "free\n",
        "tests/test.py": "",
        "docs/notes/physics.md": "# Physics\n\n![neck](../neck.png)\n\n    [code](nowhere.md)\n",
        "docs/neck.png": "picture",
        "docs/words.md": "# Words\n\nSee docs/notes/physics.md and `docs/words.md`.\n",
        "docs/sounds/sounds.toml": (
            '[[sound]]\nfile = "slap.ogg"\ntitle = "Slap"\ntext = "A thumb."\n'
            '[[sound]]\nfile = "pick.ogg"\ntitle = "Pick"\ntext = "A pick."\n'
        ),
        "docs/sounds/slap.ogg": "ogg",
        "docs/sounds/pick.ogg": "ogg",
        "docs/site/index.md": "<!-- README: beginning -->\n\n<!-- sounds -->\n\n<!-- README: doors -->\n",
        "docs/site/api/index.md": "<!-- README: In Python -->\n",
        "pyproject.toml": '[project]\n[project.urls]\nSource = "https://example.org/it/"\n'
        'Site = "https://it.example.org"\n',
        **{f"livebass/help/{page}.md": f"# {page.title()}: all of it\n\n## Qualities\n" for page in PAGES},
    })  # fmt: skip
    monkeypatch.setattr(TOOL, "ROOT", root)
    monkeypatch.setattr(TOOL, "SITE", root / "docs" / "site")
    return root


def assemble(to: Path) -> dict[str, str]:
    """The sources of the site, by place."""
    TOOL.Assembly(to).assemble()
    return {file.relative_to(to).as_posix(): file.read_text("utf-8") for file in sorted(to.rglob("*.md"))}


def test_every_public_name_has_an_entry_and_a_line_in_the_overview() -> None:
    entries = re.findall(r"^\.\. auto(?:function|class|data|exception):: (\w+)$", "".join(API.values()), re.MULTILINE)
    assert sorted(entries) == sorted(livebass.__all__)
    summaries = re.findall(r"^   (\w+)$", API["index.md"], re.MULTILINE)
    overview = [name for name in summaries if name in livebass.__all__]
    assert sorted(overview) == sorted(livebass.__all__)


@pytest.mark.parametrize("name", FUNCTIONS)
def test_docstrings_of_public_functions_describe_every_argument(name: str) -> None:
    call = getattr(livebass, name)
    text = inspect.getdoc(call) or ""
    args = SECTION.split(text)[SECTION.split(text).index("Args") + 1] if "\nArgs:" in text else ""
    described = re.findall(r"^    (\*{0,2}\w+): \S", args, re.MULTILINE)
    if "\nKeyword Args:" in text:  # in place of the one name for them all
        described.append("**")
    kinds = {inspect.Parameter.VAR_KEYWORD: "**"}
    wanted = [kinds.get(p.kind, p.name) for p in inspect.signature(call).parameters.values()]
    assert [arg if not arg.startswith("**") else "**" for arg in described] == wanted
    assert re.match(r"[A-Z][a-z]+s\b", text), "begins with a verb"


@pytest.mark.parametrize("name", sorted(set(livebass.__all__) - set(FUNCTIONS) - {"QUALITIES"}))
def test_public_classes_have_docstrings_of_their_own(name: str) -> None:
    thing = getattr(livebass, name)
    assert thing.__dict__.get("__doc__") and not thing.__doc__.startswith(f"{name}(")


def test_the_navigation_has_every_handbook_page_in_reading_order() -> None:
    listed = re.search(
        r"```{toctree}\n(?::\w+:.*\n)*\n(.*?)```", (SITE / "handbook" / "index.md").read_text(), re.DOTALL
    )
    assert listed and tuple(listed[1].split()) == PAGES
    first = (SITE / "index.md").read_text()
    for section in ("start", "handbook/index", "api/index", "notes/index", "project/index", "page"):
        assert re.search(rf"^(?:.* <)?{section}>?$", first, re.MULTILINE)


def test_all_pages_of_the_repository_are_on_the_site(tmp_path: Path) -> None:
    files = {file.relative_to(ROOT).as_posix() for file in TOOL.pages().values()}
    assert {"README.md", "ARCHITECTURE.md", "CONTRIBUTING.md", "CHANGELOG.md", "docs/words.md"} <= files
    assert {f"livebass/help/{page}.md" for page in PAGES} <= files
    assert {file.relative_to(ROOT).as_posix() for file in (ROOT / "docs" / "notes").iterdir()} <= files
    sources = assemble(tmp_path / "source")  # every link in them leads to a file
    assert set(TOOL.pages()) <= set(sources) and (tmp_path / "source" / "icon.svg").exists()
    assert "<!-- " not in "".join(text for place, text in sources.items() if place.endswith("index.md"))


def test_links_between_pages_follow_them_to_their_places(project: Path, tmp_path: Path) -> None:
    sources = assemble(tmp_path / "source")
    assert "[cost](handbook/cost.md#qualities)" in sources["start.md"]
    assert "[Here](#windows)" in sources["start.md"] and "[Here](start.md#windows)" in sources["index.md"]
    page = '<a href="play/index.html#x">the\npage</a> of <a href="index.html">it</a>.'
    assert page in sources["start.md"] and page in sources["index.md"]
    contributing = sources["project/contributing.md"]
    assert '<a href="../files/LICENSE">licence</a>' in contributing
    assert (tmp_path / "source" / "files" / "LICENSE").read_text() == "free\n"
    assert "[tests](https://example.org/it/tree/HEAD/tests)" in contributing
    assert "[web](https://example.org/a.md)" in contributing
    assert "![neck](../files/docs/neck.png)" in sources["notes/physics.md"]
    assert "    [code](nowhere.md)" in sources["notes/physics.md"], "code stays"
    assert "See [docs/notes/physics.md](../notes/physics.md) and `docs/words.md`." in sources["project/words.md"]
    assert "[`livebass help cost`](../handbook/cost.md)" in sources["api/index.md"]
    assert sources["handbook/cost.md"].startswith("# Cost\n\n*All of it.*\n")


def test_the_first_page_has_the_beginning_of_the_readme_its_doors_and_the_sounds(project: Path, tmp_path: Path) -> None:
    page = assemble(tmp_path / "source")["index.md"]
    assert page.startswith("It sounds, see [cost](handbook/cost.md#qualities).\n\n```sh\n# no heading\n```\n")
    assert page.index("Slap") < page.index("Pick") < page.index("## I have a DAW\n\nUse it.\n\n### Windows\n\nCopy.")
    assert "In Python" not in page
    assert re.findall(r'<audio[^>]* src="(.*?)"', page) == ["sounds/slap.ogg", "sounds/pick.ogg"]
    assert (tmp_path / "source" / "sounds" / "slap.ogg").exists()


@pytest.mark.parametrize(
    "text, players",
    [
        ("- [it](docs/sounds/pick.ogg) sounds", ["pick.ogg", "slap.ogg"]),
        ("| a | b |\n|---|---|\n| [it](docs/sounds/pick.ogg) | sounds |\n", ["pick.ogg", "slap.ogg"]),
        ("Hear [it](docs/sounds/pick.ogg), too.", ["slap.ogg", "pick.ogg"]),  # within a sentence it stays a link
    ],
)
def test_a_sound_of_the_readme_has_one_player(project: Path, tmp_path: Path, text: str, players: list[str]) -> None:
    readme = project / "README.md"
    readme.write_text(readme.read_text().replace("It sounds", f"{text}\n\nIt sounds"))
    page = assemble(tmp_path / "source")["index.md"]
    assert re.findall(r'<audio[^>]* src="sounds/(.*?)"', page) == players
    assert page.count("sounds/pick.ogg") == (2 if text.startswith("Hear") else 1)


def test_a_site_needs_no_sounds(project: Path, tmp_path: Path) -> None:
    for file in (project / "docs" / "sounds").iterdir():
        file.unlink()
    assert "audio" not in assemble(tmp_path / "source")["index.md"]


@pytest.mark.parametrize(
    "file, text, message",
    [
        ("CONTRIBUTING.md", "[a](gone.md)", "CONTRIBUTING.md: gone.md: there is no such file"),
        ("docs/words.md", "[a](../../outside.md)", "docs/words.md: ../../outside.md: there is no such file"),
        ("docs/site/index.md", "<!-- README: Gone -->", "docs/site/index.md: README.md has no section 'Gone'"),
        ("pyproject.toml", "[project]", "pyproject.toml: [project.urls] has no Source, the repository's address"),
    ],
)
def test_a_link_or_section_that_is_missing_is_named(
    project: Path, tmp_path: Path, file: str, text: str, message: str
) -> None:
    (tmp_path / "outside.md").write_text("# Outside")
    write(project, {file: text + "\n"})
    with pytest.raises(TOOL.SiteError) as error:
        assemble(tmp_path / "source")
    assert str(error.value) == message


def test_without_sphinx_a_line_says_what_to_install(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    monkeypatch.setattr(TOOL, "NEEDED", ("re", "no_such_package"))
    monkeypatch.setattr(sys, "argv", ["site.py", "-o", str(tmp_path / "site")])
    assert TOOL.main() == 1 and not (tmp_path / "site").exists()
    assert capsys.readouterr().err == "tools/site.py: needs no_such_package: tools/run.py site installs them\n"


def test_a_folder_of_other_files_is_not_replaced(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    (tmp_path / "mine.txt").touch()
    monkeypatch.setattr(TOOL, "NEEDED", ())
    monkeypatch.setattr(sys, "argv", ["site.py", "-o", str(tmp_path)])
    assert TOOL.main() == 1 and [file.name for file in tmp_path.iterdir()] == ["mine.txt"]
    assert "holds other files, such as mine.txt" in capsys.readouterr().err


GOOD = {
    "index.html": (
        '<head><link rel="stylesheet" href="a.css?v=1"><link rel="canonical" href="https://example.org/"></head>'
        '<a href="sub/">sub</a> <a href="sub/index.html#%C3%A9">e</a> <a href="https://example.org/x">x</a>'
        '<a href="#top" id="top">top</a> <a href="mailto:a@example.org">a</a> <img src="data:image/png;base64,AA">'
        '<audio src="sub/a%20b.ogg"></audio> <style>p { background: url("pic.png") }</style>'
    ),
    "sub/index.html": '<p id="é"></p> <a href="../index.html">up</a> <a href="/pic.png">root</a>',
    "sub/a b.ogg": "",
    "pic.png": "",
    "a.css": '@import "b.css"; /* url(https://example.org/comment.png) */ p { background: url(pic.png#x) }',
    "b.css": "",
}


def test_a_site_without_dead_links_has_no_faults(tmp_path: Path) -> None:
    faults, elsewhere = LINKS.check(write(tmp_path, GOOD))
    assert faults == []
    assert elsewhere == {"https://example.org/x", "mailto:a@example.org"}


@pytest.mark.parametrize(
    "file, planted, fault",
    [
        ("index.html", '<a href="gone.html">', "index.html: gone.html: there is no such file"),
        ("index.html", '<a href="sub/#gone">', "index.html: sub/#gone: the page has no such anchor"),
        ("index.html", '<a href="#gone">', "index.html: #gone: the page has no such anchor"),
        ("sub/index.html", '<a href="pic.png">', "sub/index.html: pic.png: there is no such file"),
        ("index.html", '<a href="../outside.html">', "index.html: ../outside.html: there is no such file"),
        ("index.html", '<audio src="gone.ogg">', "index.html: gone.ogg: there is no such file"),
        ("index.html", '<img srcset="pic.png 1x, gone.png 2x">', "index.html: gone.png: there is no such file"),
        ("index.html", '<p style="background: url(gone.png)">', "index.html: gone.png: there is no such file"),
        ("a.css", "p { background: url('gone.png') }", "a.css: gone.png: there is no such file"),
        ("index.html", '<script src="https://example.org/a.js">', "index.html: loads https://example.org/a.js"),
        ("index.html", '<link rel="preconnect" href="//example.org">', "index.html: loads //example.org"),
        ("index.html", '<iframe src="http://example.org/">', "index.html: loads http://example.org/"),
        ("a.css", '@import "https://example.org/f.css";', "a.css: loads https://example.org/f.css"),
        ("index.html", "<style>@import 'https://a.org/f.css';</style>", "index.html: loads https://a.org/f.css"),
    ],
)
def test_a_planted_fault_is_found(tmp_path: Path, file: str, planted: str, fault: str) -> None:
    site = write(tmp_path / "site", GOOD | {file: planted + GOOD[file]})
    (tmp_path / "outside.html").touch()
    assert LINKS.check(site)[0] == [fault]


@pytest.mark.slow
def test_two_builds_are_equal_byte_for_byte(tmp_path: Path) -> None:
    found = []
    for folder in (build(TOOL, tmp_path / "one"), build(TOOL, tmp_path / "two")):
        files = {file for file in folder.rglob("*") if file.is_file()}
        found.append({file.relative_to(folder).as_posix(): file.read_bytes() for file in files})
    assert found[0] == found[1]
    page = found[0]["api/rendering.html"].decode()
    assert 'id="livebass.render_to_file"' in page and str(tmp_path) not in page
    assert {"index.html", "play/index.html", "handbook/playing.html", "searchindex.js", ".nojekyll"} <= set(found[0])
