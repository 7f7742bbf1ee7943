"""What a visitor of the repository meets: README, addresses, citation, security, issue forms, compatibility."""

from __future__ import annotations

import ast
import re
import shutil
import tomllib
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import pytest
from support.places import ROOT
from support.programs import load

import livebass
from livebass.rows.techniques import BUTTONS, TECHNIQUE_ROWS

README = (ROOT / "README.md").read_text("utf-8")
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]
WHERE = load("where")
FORMS = sorted((ROOT / ".github" / "ISSUE_TEMPLATE").glob("*.yml"))
SCREEN = 50  # lines up to the end of the three doors
# Extras for work on livebass itself: programs of tools install them
OF_TOOLS = {"test", "real", "check", "wheel", "site"}


def doors() -> dict[str, str]:
    """README's three doors by title, in order."""
    return dict(re.findall(r"^## (I .+)\n((?:(?!## ).*\n)+)", README, re.MULTILINE))


# --- README ---


def test_the_first_screen_has_the_page_four_sounds_and_three_doors() -> None:
    screen = README.partition("\n## Play live")[0]
    assert len(screen.splitlines()) <= SCREEN
    assert list(doors()) == ["I have a DAW", "I have a terminal", "I study strings"]
    assert screen.index("[the page](") < screen.index("docs/sounds/") < screen.index("## I have a DAW")
    table = tomllib.loads((ROOT / "docs" / "sounds" / "sounds.toml").read_text("utf-8"))["sound"]
    shown = re.findall(r"^- \[\*\*(.+)\.\*\*\]\(docs/sounds/(.+)\) (.+)$", screen, re.MULTILINE)
    assert shown == [(sound["title"], sound["file"], sound["text"]) for sound in table]


def test_the_low_e_has_a_name_in_both_countings() -> None:
    low = livebass.load_preset("jazz-finger").strings[0].open_note
    text = " ".join(doors()["I have a DAW"].split())
    assert f"MIDI key {low}:" in text
    named = re.findall(r"\b(E\d) if it calls key 60 (C\d)", text)
    assert named == [(f"E{low // 12 - 5 + middle}", f"C{middle}") for middle in (4, 3)]


def test_keys_have_names_in_both_countings() -> None:
    table = README.partition("### Techniques")[2].partition("\n## ")[0]
    cells = [[cell.strip() for cell in row.split("|")[1:-1]] for row in table.splitlines() if row.startswith("|")]
    rows = {row[0]: row for row in cells}
    names = ["C", "C#", "D", "D#", "E", "F", "F#", "G", "G#", "A", "A#", "B"]
    for row in (TECHNIQUE_ROWS[button.symbol] for button in BUTTONS):
        _, key, c4, c3, _ = rows[row.name]
        if row.modo:
            assert key == f"{row.trigger} {row.modo[0]}"
            assert (c4, c3) == tuple(f"{names[row.modo[0] % 12]}{row.modo[0] // 12 - below}" for below in (1, 2))


def test_the_table_of_extras_has_all_for_users_and_texts_install_them_editable() -> None:
    table = README.partition("## Extras")[2].partition("\n## ")[0]
    named = dict(re.findall(r"^\| `(\w+)` \| (.*?) \|", table, re.MULTILINE))
    assert set(named) == set(PROJECT["optional-dependencies"]) - OF_TOOLS
    texts = [README, *(file.read_text("utf-8") for file in (ROOT / "livebass" / "help").glob("*.md"))]
    commands = [line for text in texts for line in re.findall(r"pip install [^`\n]*", text)]
    assert len(commands) > 5
    for line in commands:
        (extras,) = re.findall(r"^pip install -e '\.\[([\w,]+)\]'", line)
        assert set(extras.split(",")) <= set(named)
    called = set()
    for file in (ROOT / "livebass").rglob("*.py"):
        for node in ast.walk(ast.parse(file.read_text("utf-8"))):
            if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id == "install":
                called |= {str(a.value) for a in node.args if isinstance(a, ast.Constant)}
    assert called and called <= set(named), "what messages tell to install is in the table"


def test_the_statements_of_the_paper_that_hold_are_as_measured() -> None:
    """README, handbook and notes name those of figures.py, which tests/unit/paper/test_claims.py measures."""
    from livebass.lab.paper.claims import expect, figures
    from livebass.lab.paper.claims.check import CLAIMS

    def named(ids: Sequence[str], verb: str) -> str:
        return f"{' and '.join(f'`{name}`' for name in ids)} {verb}{'s' * (len(ids) == 1)}"

    count = sum(claim.bound not in (expect.AXIS, expect.SETUP) for claim in CLAIMS.values())
    hold = count - len(figures.FAILING)
    notes, handbook = (
        " ".join(file.read_text("utf-8").split())
        for file in (ROOT / "docs/notes/claims.md", ROOT / "livebass/help/studies.md")
    )
    for text in (README, notes):
        assert re.findall(r"(\d+) of (\d+) statements", text) == [(str(hold), str(count))]
    assert f"checks {count} statements" in handbook and f"{hold} hold;" in handbook
    for text in (notes, handbook):
        assert named(figures.FAILING, "fail") in text and all(f"`{name}`" in text for name in figures.MISSED)
    assert f"pluck alone (`--plucks 0`), {named(figures.FAILING_ALONE, 'fail')}, and all others hold" in notes


def test_the_folder_for_a_plugin_is_that_of_the_archive() -> None:
    from livebass.plugin.systems import SYSTEMS, folder_of_plugins

    rows = dict(re.findall(r"^\| (Windows|macOS|Linux) \| `(.+?)`", README.partition("### Plugins")[2], re.MULTILINE))
    for title, name in (("Windows", "windows-x86_64"), ("macOS", "macos-arm64"), ("Linux", "linux-x86_64")):
        assert rows[title] == folder_of_plugins(SYSTEMS[name], "vst3")


# --- addresses ---


def test_all_places_agree_on_the_addresses() -> None:
    urls = PROJECT["urls"]
    assert urls | WHERE.derived(urls["Source"], urls["Site"]) == urls
    placeholder = bool(WHERE.PLACEHOLDER.match(urls["Source"]))
    assert (WHERE.NOTE in README) == placeholder
    assert f"git clone {urls['Source']} " in README
    for name in WHERE.PLACES:
        text = (ROOT / name).read_text("utf-8")
        found = re.findall(r"https://[^\s\"')`>]+", text)
        assert any(address.startswith(urls["Source"]) for address in found), name
        for address in found:
            assert not WHERE.PLACEHOLDER.match(address) or address.startswith((urls["Source"], urls["Site"])), name


def test_no_other_file_names_an_address_of_the_project() -> None:
    places = {ROOT / "pyproject.toml", *(ROOT / name for name in WHERE.PLACES)}
    globs = ("*.md", "docs/**/*.md", "livebass/help/*.md", ".github/**/*.*")
    for file in {file for glob in globs for file in ROOT.glob(glob)} - places:
        text = file.read_text("utf-8")
        assert PROJECT["urls"]["Source"] not in text and PROJECT["urls"]["Site"] not in text, file


@pytest.fixture
def checkout(tmp_path: Path) -> Path:
    for name in ("pyproject.toml", *WHERE.PLACES):
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(ROOT / name, tmp_path / name)
    return tmp_path


def with_source(checkout: Path, address: str) -> None:
    file = checkout / "pyproject.toml"
    file.write_text(re.sub(r'(?m)^Source = ".*"$', f'Source = "{address}"', file.read_text("utf-8")), "utf-8")


def test_one_line_sets_all_addresses(checkout: Path) -> None:
    assert WHERE.write(checkout) == [], "nothing to do"
    with_source(checkout, "https://github.com/Someone/bass.git")
    assert set(WHERE.write(checkout)) == {"pyproject.toml", *WHERE.PLACES}
    urls = WHERE.urls(checkout)
    assert urls["Source"] == "https://github.com/Someone/bass" and urls["Issues"] == urls["Source"] + "/issues"
    assert urls["Site"] == "https://someone.github.io/bass" and urls["Paper"] == PROJECT["urls"]["Paper"]
    for name in ("pyproject.toml", *WHERE.PLACES):
        text = (checkout / name).read_text("utf-8")
        assert "example.org" not in text and urls["Source"] in text, name
    assert "git clone https://github.com/Someone/bass && cd" in (checkout / "README.md").read_text("utf-8")
    assert WHERE.write(checkout) == [], "and once more nothing"


def test_a_site_below_the_repository_and_a_move(checkout: Path) -> None:
    with_source(checkout, "https://git.bass.net/live")
    WHERE.write(checkout, "https://git.bass.net/live/site/")
    with_source(checkout, "https://codeberg.org/me/bass")
    WHERE.write(checkout)
    text = (checkout / "CITATION.cff").read_text("utf-8")
    assert 'url: "https://me.codeberg.page/bass"' in text and 'repository-code: "https://codeberg.org/me/bass"' in text
    assert "bass.net" not in (checkout / "README.md").read_text("utf-8")


@pytest.mark.parametrize(
    "address", ["github.com/me/bass", "http://github.com/me/bass", "https://a b.org/c", "https://"]
)
def test_a_bad_address_changes_nothing(checkout: Path, address: str) -> None:
    with_source(checkout, address)
    before = {name: (checkout / name).read_bytes() for name in WHERE.PLACES}
    with pytest.raises(ValueError, match="Source must be an address such as"):
        WHERE.write(checkout)
    assert before == {name: (checkout / name).read_bytes() for name in WHERE.PLACES}


# --- citation, security ---


def read_yaml(file: Path) -> Any:
    return pytest.importorskip("yaml").safe_load(file.read_text("utf-8"))


def test_the_citation_has_this_version_and_the_paper() -> None:
    cited = read_yaml(ROOT / "CITATION.cff")
    assert cited["version"] == livebass.__version__ and cited["license"] == PROJECT["license"]
    assert (cited["repository-code"], cited["url"]) == (PROJECT["urls"]["Source"], PROJECT["urls"]["Site"])
    assert {"cff-version", "message", "title", "authors"} <= set(cited) and cited["type"] == "software"
    (paper,) = cited["references"]
    assert PROJECT["urls"]["Paper"] == f"https://doi.org/{paper['doi']}" and PROJECT["urls"]["Paper"] in README
    named = " ".join(README.split())
    for author in paper["authors"]:
        assert f"{author['family-names']}" in named
    assert paper["title"] in named and f"{paper['journal']} {paper['volume']}, {paper['year']}" in named


def test_security_names_the_commands_that_listen_and_no_address() -> None:
    text = (ROOT / "SECURITY.md").read_text("utf-8")
    assert "livebass page" in text and "livebass play --osc" in text and "livebass --version" in text
    assert not re.search(r"[\w.]+@[\w.]+", text), "reports go to the repository"
    from livebass.live import osc
    from livebass.web import serve

    assert osc.HOST == serve.HOST == "127.0.0.1", "listen on this computer only, as the text says"


# --- issue forms, by the rules of github.com's schema for forms ---

KINDS = {
    "markdown": {"value"},
    "textarea": {"label", "description", "placeholder", "value", "render"},
    "input": {"label", "description", "placeholder", "value"},
    "dropdown": {"label", "description", "multiple", "options", "default"},
    "checkboxes": {"label", "description", "options"},
}
TOP = {"name", "description", "title", "labels", "assignees", "projects", "type", "body"}


def faults(form: Any) -> list[str]:
    """What of a form breaks the rules."""
    body = form.get("body") or []
    ids = [item["id"] for item in body if "id" in item]
    labels = [item["attributes"]["label"] for item in body if "label" in item.get("attributes", {})]
    broken = {
        "unknown key": not set(form) <= TOP,
        **{f"no {key}": not form.get(key) for key in ("name", "description", "body")},
        "two of one id": len(ids) > len(set(ids)),
        "two of one label": len(labels) > len(set(labels)),
        "nothing to fill in": all(item.get("type") == "markdown" for item in body),
    }
    for number, item in enumerate(body, 1):
        kind, attributes = item.get("type"), item.get("attributes", {})
        options = attributes.get("options", [])
        broken |= {
            f"{number}: no such type": kind not in KINDS,
            f"{number}: unknown attribute": not set(attributes) <= KINDS.get(kind, set(attributes)),
            f"{number}: unknown key": not set(item) <= {"type", "id", "attributes", "validations"},
            f"{number}: no text": not attributes.get("value" if kind == "markdown" else "label"),
            f"{number}: id": not re.fullmatch(r"[\w-]+", item.get("id", "a")),
            f"{number}: validations": not set(item.get("validations", {})) <= {"required"},
            f"{number}: no options": kind in ("dropdown", "checkboxes") and not options,
            f"{number}: two equal options": len({str(option) for option in options}) < len(options),
        }
    return [fault for fault, found in broken.items() if found]


@pytest.mark.parametrize("file", [file for file in FORMS if file.stem != "config"], ids=lambda file: file.stem)
def test_a_form_is_valid_and_asks_for_the_version(file: Path) -> None:
    form = read_yaml(file)
    assert not faults(form)
    required = [item for item in form["body"] if item.get("validations", {}).get("required")]
    assert any("livebass --version" in item["attributes"].get("description", "") for item in required)
    assert any(item.get("id") == "file" for item in form["body"])


def test_forms_ask_for_devices_bench_system_and_host() -> None:
    requested = {item.get("id") for file in FORMS if file.stem != "config" for item in read_yaml(file)["body"]}
    assert {"version", "devices", "system", "host", "file"} <= requested
    text = "".join(file.read_text("utf-8") for file in FORMS)
    assert "`livebass devices`" in text and "`livebass bench live`" in text


TEXT = {"type": "input", "id": "a", "attributes": {"label": "x"}}


@pytest.mark.parametrize(
    ("body", "fault"),
    [
        ([], "no body"),
        ([TEXT, TEXT], "two of one id"),
        ([TEXT, TEXT | {"id": "b"}], "two of one label"),
        ([TEXT | {"type": "text"}], "1: no such type"),
        ([TEXT | {"attributes": {}}], "1: no text"),
        ([TEXT | {"attributes": {"label": "x", "render": "text"}}], "1: unknown attribute"),
        ([TEXT | {"required": True}], "1: unknown key"),
        ([TEXT | {"id": "a b"}], "1: id"),
        ([{"type": "markdown", "attributes": {"value": "x"}}], "nothing to fill in"),
        ([{"type": "dropdown", "attributes": {"label": "x"}}], "1: no options"),
    ],
)  # fmt: skip
def test_a_broken_form_is_found(body: list[Any], fault: str) -> None:
    form = {"name": "A", "description": "b", "body": body}
    assert fault in faults(form) and not faults(form | {"body": [TEXT]})
    assert "no description" in faults({"name": "A", "body": [TEXT]})


def test_the_chooser_leads_to_handbook_and_private_reports() -> None:
    chooser = read_yaml(ROOT / ".github" / "ISSUE_TEMPLATE" / "config.yml")
    assert set(chooser) == {"blank_issues_enabled", "contact_links"}
    for link in chooser["contact_links"]:
        assert set(link) == {"name", "url", "about"} and link["url"].startswith("https://")
    assert chooser["contact_links"][1]["url"] == PROJECT["urls"]["Source"] + "/security/advisories/new"


# --- compatibility ---


def test_every_row_of_the_compatibility_page_names_a_test() -> None:
    text = (ROOT / "docs" / "compatibility.md").read_text("utf-8")
    tables = re.findall(r"^\| .* \| when \| test \|\n\|[-|]+\|\n((?:\|.*\n)+)", text, re.MULTILINE)
    rows = [[cell.strip() for cell in row.strip("|").split("|")] for table in tables for row in table.splitlines()]
    assert len(tables) == text.count("\n## ") == 5 and len(rows) >= 20
    for row in rows:
        assert row[-2] in ("each change", "by hand"), row
        assert re.fullmatch(r"`(.+)`", row[-1]) and (ROOT / row[-1].strip("`")).is_file(), row
    hosts = {"Ardour": "ardour", "pedalboard": "pedalboard", "jalv": "jalv", "Wine": "wine", "sfizz": "sfizz"}
    for host, word in hosts.items():
        tests = [(ROOT / row[-1].strip("`")).read_text("utf-8") for row in rows if host in " ".join(row[:2])]
        assert tests and all(word in test.lower() for test in tests), host
    assert text.count("**Never tried:**") == 5
