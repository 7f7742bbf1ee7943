"""A checkout: git ignores what commands write there, and every document installs it editable."""

from __future__ import annotations

import re
import shutil
import subprocess
from collections.abc import Iterator
from pathlib import Path

import click
import pytest
from support.quoted import ROOT, command_of, context, every_command

from livebass.plugin.export import BUNDLES

# Names that commands choose, and what tools leave
CHOSEN = [*BUNDLES.values(), "demo.wav", "G2.wav", "song.E.wav", "my-bass-points"]
CHOSEN += [".venv", "dist", ".mypy_cache", "build"]
NOT_OURS = ["livebass/new.py", "presets/mine.toml", "tests/new/data.toml", "docs/new.png", "tools/new", ".ci/new",
            ".github/workflows/tests.yml", "findings/new.sh", "NEW.md", "CITATION.cff"]  # fmt: skip


def git(*arguments: str, given: str = "") -> list[str]:
    """The lines that git prints here; skips the test without git or outside a checkout."""
    if not shutil.which("git") or not (ROOT / ".git").exists():
        pytest.skip("this needs git, and a checkout")
    line = ["git", "-c", f"safe.directory={ROOT}", *arguments]
    done = subprocess.run(line, cwd=ROOT, input=given, capture_output=True, text=True, timeout=60)
    assert done.returncode in (0, 1) and not done.stderr, done.stderr
    return done.stdout.splitlines()


def ignored_names(names: list[str]) -> set[str]:
    """Those of `names` that git ignores."""
    return set(git("check-ignore", "--stdin", "--no-index", given="\n".join(names)))


def files_of(line: str) -> Iterator[str]:
    """The files that a quoted command names: those it writes, and those of the user."""
    yield from re.findall(r"\s>\s*(\S+)", line)
    command, arguments = command_of(line)
    if not arguments or "--help" in arguments:
        return
    try:
        values = context(command, arguments).params
    except click.MissingParameter:
        return
    for value in values.values():
        for one in value if isinstance(value, tuple) else (value,):
            if isinstance(one, Path) or (isinstance(one, str) and one.endswith(".toml")):
                yield str(one)


def test_what_readme_and_handbook_write_is_ignored() -> None:
    named = {name for _, line, _ in every_command() for name in files_of(line)}
    tracked = {name for name in named if git("ls-files", name)}
    mine = sorted({str(Path(name)) for name in named - tracked if not name.startswith(("/", "-"))})
    assert {"page", "case-b", "mine.toml", "keys.toml", "compared.html"} <= set(mine) and len(mine) > 30
    assert set(mine) - ignored_names(mine) == set()
    assert set(CHOSEN) - ignored_names(CHOSEN) == set()


def test_what_belongs_to_the_project_is_not_ignored() -> None:
    assert not ignored_names(NOT_OURS)
    assert not git("ls-files", "--cached", "--ignored", "--exclude-standard"), "add these to .gitignore, with a !"


DOCUMENTS = [ROOT, ROOT / "docs", ROOT / "livebass", ROOT / "tools", ROOT / ".github"]


def test_every_document_installs_the_checkout_editable() -> None:
    """An install that is not editable replaces one that is, and tests that start processes then check old code."""
    files = {file for folder in DOCUMENTS for file in folder.glob("*.md" if folder == ROOT else "**/*")}
    texts = {file: file.read_text("utf-8") for file in files if file.suffix in (".md", ".py", ".toml", ".yml", ".sh")}
    found = {
        f"{file.relative_to(ROOT)}: {line.strip()}"
        for file, text in texts.items()
        for line in text.splitlines()
        if re.search(r"\bpip install (?!(?:-\S+ )*(?:-e|--editable) )(?:-\S+ )*['\"]?\.(?:\[|[ '\"`]|$)", line)
    }
    assert not found and len(texts) > 100
