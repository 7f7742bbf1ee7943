"""The handbook: every page prints, and README and pages quote only existing commands, options, keys and files."""

from __future__ import annotations

import json
import re
import struct
import subprocess
import sys
import tomllib
from collections.abc import Iterator
from pathlib import Path

import click
import pytest
from support.command import Run, cli_text, python, refusal
from support.helps import commands
from support.programs import load
from support.quoted import PAGES, README, ROOT, command_of, context, every_command, quoted_commands

from livebass.cli import help as handbook
from livebass.cli.groups import GroupedCommand
from livebass.cli.main import livebass as program
from livebass.lab.bench import waveform_figures
from livebass.lab.bench.fidelity import KINDS, THINNEST, VISITED
from livebass.lab.bench.live import MAX_WAVEFORM, PROMISED
from livebass.model.keymap import COUNTING
from livebass.rows.techniques import FUNCTION_ROWS, ON_STRING, TECHNIQUE_ROWS

FILES = (README, *PAGES)
FIRST_SCREEN = 40  # lines
WIDEST = 100  # characters per line of a page, for terminals
LARGEST_PICTURE = 150_000  # bytes
OTHER_OPTIONS = {"--all", "--without", "--sdist"}  # of tools/test, tools/fit_neck.py, and the program build


@pytest.mark.parametrize("page", handbook.PAGES)
def test_a_page_prints_and_begins_with_its_title(run: Run, page: str) -> None:
    text = cli_text(run, "help", page)
    assert re.match(rf"# {page.capitalize()}: \w.*\n\n", text)
    assert text.isascii() and max(map(len, text.splitlines())) <= WIDEST
    assert text == (ROOT / "livebass" / "help" / f"{page}.md").read_text()


def test_help_alone_lists_the_pages(run: Run) -> None:
    lines = cli_text(run, "help").splitlines()
    for page, line in zip(handbook.PAGES, lines, strict=False):
        assert re.fullmatch(rf"livebass help {page} +\w.*", line) and len(line) <= WIDEST
    assert {file.stem for file in FILES[1:]} == set(handbook.PAGES)


@pytest.mark.parametrize("page", ["no-such-page", "render", "../../README", ""])
def test_an_unknown_page_is_one_line_that_names_those_there_are(run: Run, page: str) -> None:
    assert ", ".join(handbook.PAGES) in refusal(run, "help", page, status=2)


@pytest.mark.parametrize(
    ("word", "page"), [("play", "playing"), ("PLAY", "playing"), ("pre", "presets"), ("ph", "physics"), ("l", "live")]
)
def test_the_beginning_of_a_name_opens_its_page(run: Run, word: str, page: str) -> None:
    assert cli_text(run, "help", word) == handbook.page_text(page)


@pytest.mark.parametrize(
    ("word", "page"),
    [
        ("pyhsics", "physics"),
        ("exprot", "export"),
        ("Preset-s", "presets"),
        ("p", "playing or presets or physics"),
        ("midi", None),
    ],
)
def test_a_name_that_is_misspelt_is_answered_with_the_nearest(run: Run, word: str, page: str | None) -> None:
    err = refusal(run, "help", word, status=2)
    assert f"did you mean {page}?" in err if page else "did you mean" not in err


GROUPED = [path for path, command in commands() if isinstance(command, GroupedCommand)]


@pytest.mark.parametrize("path", GROUPED, ids=" ".join)
def test_every_option_of_a_command_with_many_stands_under_one_heading(run: Run, path: tuple[str, ...]) -> None:
    text, command = cli_text(run, *path, "--help"), dict(commands())[path]
    assert isinstance(command, GroupedCommand)
    sections = dict(re.findall(r"^(\w+):\n((?:  .*\n)+)", text, re.MULTILINE))
    assert list(sections) == list(command.groups) and len(sections) > 3
    listed = [option for rows in sections.values() for option in re.findall(r"^  (?:-\w, )?(--[\w-]+)", rows, re.M)]
    parameters = command.get_params(click.Context(command))
    long = [max(p.opts, key=len) for p in parameters if isinstance(p, click.Option)]  # click 8.2: in any order
    assert sorted(listed) == sorted(long)
    columns = {len(row) - len(row.lstrip()) for rows in sections.values() for row in rows.splitlines()}
    assert columns == {2, 34}, "one column of texts under all headings"


def test_help_is_the_same_for_every_hash_seed() -> None:
    """Click before 8.5 keeps the names of --help in a set, whose order changes from run to run."""
    code = "from support.helps import main; main()"
    said = [json.loads(python(code, env={"COLUMNS": "80", "PYTHONHASHSEED": seed}).stdout) for seed in "129"]
    assert set(said[0]) == {" ".join(path) for path, _ in commands()} and len(said[0]) > 20
    for path, text in said[0].items():
        assert text.startswith(f"Usage: livebass{path and ' '}{path} ") and text.endswith("status 0\n"), path
        assert all(other[path] == text for other in said)


def test_help_by_a_click_that_orders_the_names_of_help_by_chance(run: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    names, said = click.Command.get_help_option_names, []
    for order in (list, reversed):
        monkeypatch.setattr(click.Command, "get_help_option_names", lambda *of, order=order: [*order(names(*of))])
        for _, command in commands():
            monkeypatch.setattr(command, "_help_option", None, raising=False)  # made once, by some versions
        said.append([cli_text(run, *path, "--help") for path, _ in commands()])
    assert said[0] == said[1]


def test_options_under_headings_are_still_completed() -> None:
    command = program.commands["play"]
    words = [item.value for item in command.shell_complete(click.Context(command), "--metr")]
    assert words == ["--metronome", "--metronome-port"]


def test_a_pager_is_used_in_a_terminal_only(run: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    requested = []
    monkeypatch.setattr(click, "echo_via_pager", requested.append)
    assert cli_text(run, "help", "live") == ""
    assert requested == [handbook.page_text("live").removesuffix("\n")]


COMMANDS = [pytest.param(line, whole, id=f"{file.stem}: {line}") for file, line, whole in every_command()]


@pytest.mark.parametrize(("line", "whole"), COMMANDS)
def test_quoted_commands_exist_with_their_options(line: str, whole: bool) -> None:
    command, arguments = command_of(line)
    if command.name == "run":
        check_studies(arguments)
    if not arguments or "--help" in arguments:
        return
    try:
        made = context(command, arguments)
    except click.MissingParameter:
        assert not whole, "a line to be run as it is lacks something"
        return
    check_values(made)


def check_studies(arguments: list[str]) -> None:
    from livebass.lab.paper.figures.studies import choose_studies

    names = arguments[: next((i for i, a in enumerate(arguments) if a.startswith("-")), None)]
    assert choose_studies(names)


def check_values(context: click.Context) -> None:
    """Checks the names in command values that the parser takes unchecked."""
    from livebass.preset.load import laboratory_names, preset_names
    from livebass.preset.sounds import sound_names

    values = context.params
    preset = values.get("preset") or values.get("name")
    if isinstance(preset, str) and not preset.endswith(".toml"):
        assert preset in preset_names() + laboratory_names() + sound_names()
    if context.command.name == "help" and values["page"]:
        assert values["page"] in handbook.PAGES
    if context.command.name == "claims":
        from livebass.lab.paper.claims.check import choose_claims

        assert choose_claims(values["ids"])
    if context.command.name == "sweep" and values["axes"]:
        from livebass.lab.experiment.grid import Settings, grid
        from livebass.model.quality import quality_with

        rest = {name: values[name] for name in Settings.__dataclass_fields__ if name != "quality"}
        assert grid(Settings(quality=quality_with(values["quality"]), **rest), values["axes"])


def options(command: click.Command) -> Iterator[str]:
    """Every option of `command` and its subcommands."""
    for parameter in command.params:
        yield from (*parameter.opts, *parameter.secondary_opts)
    if isinstance(command, click.Group):
        for below in command.commands.values():
            yield from options(below)


@pytest.mark.parametrize("file", FILES, ids=lambda file: file.stem)
def test_quoted_options_and_keys_exist(file: Path) -> None:
    from livebass.lab.experiment.grid import PLUCK
    from livebass.preset.keys import KEYS

    code = re.findall(r"`([^`\n]+)`", file.read_text())
    named = {word for span in code for word in re.findall(r"(?<![\w-])--[a-z][a-z0-9-]*", span)}
    assert named <= {*options(program), *OTHER_OPTIONS, "--help"}
    known = {f"{key.section}.{key.name}" for key in (*KEYS, *PLUCK.values())}
    sections = "|".join({key.split(".")[0] for key in known} - {""})  # top-level keys have no section
    written = {match[0] for span in code for match in re.finditer(rf"(?<![\w.-])(?:{sections})\.[a-z]\w*", span)}
    assert written - {"neck.lift"} <= known


@pytest.mark.parametrize("file", FILES, ids=lambda file: file.stem)
def test_links_and_named_files_exist(file: Path) -> None:
    text = file.read_text()
    for link in re.findall(r"\]\(([^)#]+)\)", text):
        assert "://" in link or (file.parent / link).is_file(), link
    for tool in re.findall(r"\btools/[\w.]+\w", text):
        assert (ROOT / tool).is_file(), tool


def test_a_preset_that_a_page_shows_can_be_used(tmp_path: Path) -> None:
    from livebass import load_preset

    shown = re.findall(r"^```toml\n(.*?)^```", handbook.page_text("presets"), re.DOTALL | re.MULTILINE)
    assert shown
    for number, text in enumerate(shown):
        (tmp_path / f"{number}.toml").write_text(text)
        assert load_preset(tmp_path / f"{number}.toml").strings


def test_the_page_on_presets_names_every_preset() -> None:
    from livebass.preset.load import laboratory_names, preset_names

    for name in preset_names() + laboratory_names():
        assert f"| `{name}` |" in handbook.page_text("presets")


def test_the_first_screen_of_the_readme_shows_a_picture_and_what_follows_plays() -> None:
    """tests/promises/project/test_project.py has more about it."""
    first, title, after = README.read_text().partition("\n## Play live\n")
    screen = "\n".join(first.splitlines()[:FIRST_SCREEN])
    assert title and screen.index("## I have a DAW") < screen.index("tools/demo") < screen.index("tools/test")
    commands = [line for line, whole in quoted_commands(after) if whole]
    assert [next(c for c in commands if c.startswith(word)) for word in ("play", "page", "presets")]
    pictures = re.findall(r"!\[[^]]+\]\(([^)]+)\)", README.read_text())
    assert len(pictures) == 1 and pictures[0] in first
    data = (ROOT / pictures[0]).read_bytes()
    assert data.startswith(b"\x89PNG") and len(data) < LARGEST_PICTURE


def test_the_architecture_names_every_room_and_the_contract_has_its_floors() -> None:
    """The table of floors in ARCHITECTURE.md, top down, beside the layers of pyproject.toml."""
    text = (ROOT / "ARCHITECTURE.md").read_text().split("\n## ")[1]
    floors = [re.findall(r"`(\w+)`", row.split("|")[2]) for row in re.findall(r"^\| [a-z].*\|.*\|$", text, re.M)]
    rooms = [folder.name for folder in (ROOT / "livebass").glob("[!_]*") if list(folder.glob("[!_]*.py"))]
    layers = tomllib.loads((ROOT / "pyproject.toml").read_text())["tool"]["importlinter"]["contracts"][0]["layers"]
    place = {room: k for k, layer in enumerate(layers) for room in re.findall(r"\w+", layer)}
    named = [room for floor in floors for room in floor if room in rooms]
    assert set(rooms) <= {*named, "help"}
    assert [place[room] for room in named if room in place] == sorted(place[room] for room in named if room in place)


def test_tables_follow_the_rows() -> None:
    """tools/tables.py writes the tables of techniques, controllers and waveforms."""
    made = load("tables")
    for name, tables in made.TABLES.items():
        text = (ROOT / name).read_text()
        assert all(f"\n\n{table()}\n\n" in text for table in tables), name
    for name, sentences in made.SENTENCES.items():
        lines = (ROOT / name).read_text().splitlines()
        assert all(sentence() in lines for sentence in sentences), name


def test_readme_and_handbook_say_of_waveforms_what_was_measured() -> None:
    """They quote no figures but those in waveform_figures.py, and the handbook's claims about them are true."""
    assert set(waveform_figures.WAVEFORMS) == set(waveform_figures.CALLED) == set(KINDS)
    said = re.findall(r"waveform of `reference` to (-\d+) dB \(boards (-\d+), pops (-\d+);", README.read_text())
    medians = [waveform_figures.WAVEFORMS[kind]["live"][0] for kind in ("frets with loss", "boards", "pops")]
    assert [list(map(int, each)) for each in said] == [medians]
    cost = " ".join(handbook.page_text("cost").split())
    assert f"{MAX_WAVEFORM[0]:g} dB in the median and {MAX_WAVEFORM[1]:g} dB for the worst pluck" in cost
    medians = [each[0] for kind in PROMISED for each in waveform_figures.WAVEFORMS[kind].values()]
    assert max(medians) <= MAX_WAVEFORM[0] and "The medians of the first two rows keep to this" in cost
    assert list(KINDS)[:2] == list(PROMISED)
    worst = [each[1] for each in waveform_figures.WAVEFORMS["frets with loss"].values()]
    assert min(worst) > MAX_WAVEFORM[1] and "The worst plucks do not" in cost
    more = [1 + list(KINDS).index(kind) for kind in ("guests", "straight", "thin")]
    assert more == [4, 5, 6] and "the strokes of the fourth to sixth row, which hit the frets more often" in cost
    over = {
        (kind, quality): median[0] - harder
        for kind, harder in waveform_figures.HARDER.items()
        for quality, median in waveform_figures.WAVEFORMS[kind].items()
    }
    assert list(waveform_figures.HARDER) == list(KINDS)[3:6]
    farther = {key: 10 ** (more / 20) for key, more in over.items() if more > 0}
    assert farther == {
        ("guests", "live"): pytest.approx(2, abs=0.3),
        ("thin", "live"): pytest.approx(4, abs=0.3),
        ("thin", "studio"): pytest.approx(1.25, abs=0.1),
    }
    assert "but for `live` with pick and pop, which is twice as far off, and for thin strings: `live` is four" in cost
    assert "times as far off there, `studio` a quarter farther" in cost
    assert set(VISITED) | {THINNEST} == set(re.findall(r"`([a-z-]+)`", " ".join(waveform_figures.CALLED.values())))


def test_controllers_explains_every_technique_and_controller(run: Run) -> None:
    lines = cli_text(run, "play", "--controllers").splitlines()
    assert max(map(len, lines)) <= 120
    for row in TECHNIQUE_ROWS.values():
        found = [line for line in lines if f"{row.trigger}: {row.help}" in line]
        assert len(found) == (len(row.modo) if row.number == ON_STRING else 1)
        assert set(re.findall(r"\d+", " ".join(found))) >= {*map(str, row.modo + row.modo_12[:1])}
    assert any(line.split()[:4] == ["C#0", "(13)", "C#1", "(25)"] for line in lines)
    assert COUNTING in " ".join(lines)
    for row in FUNCTION_ROWS.values():
        for number in row.controllers:
            assert any(re.match(rf"  controller .*\b{number}\b", line) and line.endswith(row.help) for line in lines)


@pytest.mark.slow
def test_the_picture_of_the_readme_can_be_drawn(tmp_path: Path) -> None:
    line = [sys.executable, str(ROOT / "tools" / "soft_and_hard.py"), str(tmp_path / "a.png")]
    subprocess.run(line, check=True, timeout=300)
    drawn, kept = (file.read_bytes() for file in (tmp_path / "a.png", ROOT / "docs" / "soft-and-hard.png"))
    assert struct.unpack(">II", drawn[16:24]) == struct.unpack(">II", kept[16:24])
