"""Releases: what must agree before, files without words of this machine, builds that do not depend on place or user."""

from __future__ import annotations

import argparse
import base64
import gzip
import hashlib
import io
import os
import re
import shutil
import subprocess
import sys
import tarfile
import zipfile
from pathlib import Path

import pytest
from support.places import ROOT
from support.programs import load

from livebass import __version__

INSIDE, TOOL = load("inside"), load("release")
HOME = "/home/anna"
GIT = ["git", "-c", "user.name=a", "-c", "user.email=a@b.c"]

pytestmark = pytest.mark.skipif(not shutil.which("git"), reason="needs git")
needs_checkout = pytest.mark.skipif(not (ROOT / ".git").exists(), reason="needs a checkout")


@pytest.fixture
def tree(tmp_path: Path) -> Path:
    """A clean checkout of version 1.2.3, released on 2026-11-28."""
    root = tmp_path / "checkout"
    (root / "livebass").mkdir(parents=True)
    (root / "livebass" / "__init__.py").write_text('"""Strings."""\n\n__version__ = "1.2.3"\n')
    (root / "CHANGELOG.md").write_text(
        "# Changelog\n\n## [1.2.3] - 2026-11-28\n\nMore.\n\n## [1.2.2] - 2026-01-02\n\nLess.\n"
    )
    (root / "CITATION.cff").write_text('title: livebass\nversion: 1.2.3\ndate-released: "2026-11-28"\n')
    (root / "pyproject.toml").write_text('[project.urls]\nSource = "https://github.com/anna/livebass"\n')
    (root / "run").write_text("#!/bin/sh\n")
    (root / "run").chmod(0o755)
    for command in (["init", "-q"], ["add", "-A"], ["commit", "-q", "-m", "a"]):
        subprocess.run([*GIT, *command], cwd=root, check=True)
    return root


def change(root: Path, name: str, old: str, new: str) -> None:
    """Replaces text in a file of the checkout, and commits."""
    text = (root / name).read_text()
    assert old in text
    (root / name).write_text(text.replace(old, new))
    subprocess.run([*GIT, "commit", "-q", "-a", "-m", "b"], cwd=root, check=True)


def test_a_clean_tree_whose_versions_agree_can_be_released(tree: Path) -> None:
    assert TOOL.problems(tree) == TOOL.problems(tree, "v1.2.3") == []
    assert TOOL.changes(tree, "1.2.3") == "More.\n"
    (tree / "CITATION.cff").unlink()
    subprocess.run([*GIT, "commit", "-q", "-a", "-m", "b"], cwd=tree, check=True)
    assert TOOL.problems(tree) == [], "there need be none"


@pytest.mark.parametrize(
    ("name", "old", "new", "said"),
    [
        ("CHANGELOG.md", "2026-11-28", "unreleased", "the date of 1.2.3 must be like 2026-11-28, not unreleased"),
        ("CHANGELOG.md", "2026-11-28", "2026-11-31", "not 2026-11-31"),
        ("CHANGELOG.md", "[1.2.3]", "[1.3.0]", "CHANGELOG.md begins with 1.3.0, but livebass/__init__.py has 1.2.3"),
        ("CITATION.cff", "version: 1.2.3", "version: 1.2.2", "CITATION.cff has version 1.2.2"),
        ("CITATION.cff", "2026-11-28", "2026-11-27", "CITATION.cff must have date-released: 2026-11-28"),
        ("CITATION.cff", 'date-released: "2026-11-28"', "", "CITATION.cff must have date-released: 2026-11-28"),
        ("pyproject.toml", "github.com/anna", "example.org", "[project.urls] has placeholders"),
    ],
)
def test_versions_that_disagree_are_refused(tree: Path, name: str, old: str, new: str, said: str) -> None:
    change(tree, name, old, new)
    assert any(said in line for line in TOOL.problems(tree))


def test_changes_and_other_tags_are_refused(tree: Path) -> None:
    assert TOOL.problems(tree, "v1.2.4") == ["the tag must be v1.2.3, not v1.2.4"]
    (tree / "new.txt").touch()
    assert TOOL.problems(tree) == ["the tree has changes that are not committed: ?? new.txt"]
    (tree / "run").write_text("")
    assert TOOL.problems(tree)[0].endswith("M run and 1 more")


def test_a_trial_allows_changes_and_an_unreleased_version_and_nothing_else(tree: Path) -> None:
    change(tree, "CHANGELOG.md", "2026-11-28", "unreleased")
    (tree / "new.txt").touch()
    assert TOOL.problems(tree, trial=True) == []
    change(tree, "CHANGELOG.md", "unreleased", "soon")
    assert TOOL.problems(tree, trial=True) == ["CHANGELOG.md: the date of 1.2.3 must be like 2026-11-28, not soon"]


@needs_checkout
def test_this_tree_has_one_version() -> None:
    assert TOOL.problems(ROOT, f"v{__version__}", trial=True) == []


def test_what_is_built_is_what_git_tracks_under_any_umask(tree: Path, tmp_path: Path) -> None:
    (tree / "untracked.txt").touch()
    before = os.umask(0o077)
    try:
        TOOL.write(TOOL.tracked(tree), tmp_path / "copy")
    finally:
        os.umask(before)
    copied = {str(file.relative_to(tmp_path / "copy")) for file in (tmp_path / "copy").rglob("*") if file.is_file()}
    assert copied == {"livebass/__init__.py", "CHANGELOG.md", "CITATION.cff", "pyproject.toml", "run"}
    assert os.access(tmp_path / "copy" / "run", os.X_OK) and not os.access(tmp_path / "copy" / "CHANGELOG.md", os.X_OK)


def test_only_a_release_is_replaced(tmp_path: Path) -> None:
    made, output = tmp_path / "made", tmp_path / "dist" / "1.2.3"
    made.mkdir()
    output.parent.mkdir()
    (made / "a.whl").write_bytes(b"a")
    (made / TOOL.SUMS).write_text(TOOL.sums(made))
    assert (made / TOOL.SUMS).read_text() == f"{hashlib.sha256(b'a').hexdigest()}  a.whl\n"
    for _ in range(2):
        assert TOOL.replaceable(output)
        TOOL.put(made, output)
        assert {file.name for file in output.iterdir()} == {"a.whl", TOOL.SUMS}
        assert [entry.name for entry in output.parent.iterdir()] == ["1.2.3"]
    (output / "mine.txt").touch()
    assert not TOOL.replaceable(output)
    (tmp_path / "file").touch()
    assert not TOOL.replaceable(tmp_path / "file")
    (tmp_path / "empty").mkdir()
    assert TOOL.replaceable(tmp_path / "empty")


def test_a_build_that_differs_is_refused_and_leaves_nothing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    count = 0

    def built(_: object, place: Path, *more: object) -> Path:
        nonlocal count
        count += 1
        (place / "files").mkdir(parents=True)
        with zipfile.ZipFile(place / "files" / "a.whl", "w") as packed:
            packed.writestr(zipfile.ZipInfo("same.py"), "same")
            packed.writestr(zipfile.ZipInfo("other.py"), f"build {count}")
        return place / "files"

    monkeypatch.setattr(TOOL, "built", built)
    monkeypatch.setattr(TOOL, "problems", lambda *_: [])
    given = argparse.Namespace(output=tmp_path / "out", trial=True, tag=None, no_tests=True, once=False, systems=[])
    with pytest.raises(TOOL.Refused, match=r"^a\.whl: two builds differ, first in a\.whl: other\.py$"):
        TOOL.release(given)
    assert count == 2 and not list(tmp_path.iterdir())


def machine(*names: str) -> object:
    return INSIDE.Machine(frozenset({HOME}), frozenset({"/var/tmp7"}), frozenset(names))


def pack(data: bytes) -> dict[str, bytes]:
    """`data` as the files of a release may hold it, by the file's name."""
    zipped, tar = io.BytesIO(), io.BytesIO()
    with zipfile.ZipFile(zipped, "w", zipfile.ZIP_DEFLATED) as to:
        to.writestr("a/plugin.so", data)
    with tarfile.open(fileobj=tar, mode="w:gz") as to:
        head = tarfile.TarInfo("a/program.ll.gz")
        inner = gzip.compress(data) + b"checksum of 32 bytes"
        head.size = len(inner)
        to.addfile(head, io.BytesIO(inner))
    page = b"<script>'" + base64.b64encode(gzip.compress(os.urandom(600).hex().encode() + data)) + b"'</script>"
    return {"a.txt": data, "a.whl": zipped.getvalue(), "a.tar.gz": tar.getvalue(), "a.html": page}


@pytest.mark.parametrize(
    "word", [f"{HOME}/x", f"file://{HOME}/x", f'"{HOME}"', f"\0{HOME}\0", "/var/tmp7/x.o", "anna7@"]
)
@pytest.mark.parametrize("code", ["utf-8", "utf-16-le"])
@pytest.mark.parametrize("kind", ["a.txt", "a.whl", "a.tar.gz", "a.html"])
def test_a_planted_word_of_the_machine_is_found(tmp_path: Path, word: str, code: str, kind: str) -> None:
    (tmp_path / kind).write_bytes(pack(b"\x7fELF " + word.encode(code) + b"\0 more")[kind])
    (found,) = INSIDE.leaks(tmp_path, machine("anna7"), [b"source"])
    assert re.match(rf"{kind}.*: has (/home/anna|/var/tmp7|anna7), a word of this machine", found)


@pytest.mark.parametrize("word", ["/home/annabel", "x/home/anna", "annabella anna7x", "https://a.b/var/tmp77"])
def test_other_words_are_not(tmp_path: Path, word: str) -> None:
    for name, data in pack(word.encode()).items():
        (tmp_path / name).write_bytes(data)
    assert INSIDE.leaks(tmp_path, machine("anna7"), [b"source"]) == []


def test_sources_may_have_a_users_name_but_no_path(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    source = b"the bass of anna7, in /var/tmp7"
    (tmp_path / "copy").write_bytes(source)
    (tmp_path / "page").write_bytes(b"generated by anna7")
    assert INSIDE.leaks(tmp_path, machine("anna7"), [source]) == []
    assert "word of the sources: anna7" in capsys.readouterr().err
    (tmp_path / "copy").write_bytes(HOME.encode())
    assert INSIDE.leaks(tmp_path, machine(), [HOME.encode()]) == [f"copy: has {HOME}, a word of this machine"]


def test_this_machine_has_words(tmp_path: Path) -> None:
    found = INSIDE.Machine.this(str(tmp_path))
    assert str(tmp_path) in found.paths and str(Path.home()) in found.paths | found.common | {"/"}
    assert "/" not in found.paths and found.names


def test_differences_name_the_innermost_place(tmp_path: Path) -> None:
    for name, data in (("a", b"one"), ("b", b"another")):
        (tmp_path / name).mkdir()
        for file, content in pack(data).items():
            if file != "a.html":
                (tmp_path / name / file).write_bytes(content)
        (tmp_path / name / "same").touch()
    (tmp_path / "b" / "more").touch()
    assert INSIDE.differences(tmp_path / "a", tmp_path / "b") == [
        "a.tar.gz: two builds differ, first in a.tar.gz: a/program.ll.gz: unpacked",
        "a.txt: two builds differ, first in a.txt",
        "a.whl: two builds differ, first in a.whl: a/plugin.so",
        "more: only one of two builds has it",
    ]


WHEELS = """
import sys
from pathlib import Path
sys.path.insert(0, "tools")
import wheels
from livebass.compiling import store
from livebass.plugin.systems import SYSTEMS
wheels.library = lambda objects, system, level, out: (out / f"kernels-{level}").write_bytes(b"kernels")
print(wheels.wheel(SYSTEMS["windows-x86_64"], Path(), b"plugin", b"page", Path(sys.argv[1])))
"""


@needs_checkout
def test_a_wheel_does_not_depend_on_place_time_umask_or_hash_seed(tmp_path: Path) -> None:
    """Without the compiled code, which takes minutes; `tools/release` itself compares that."""
    pytest.importorskip("hatchling")
    made = []
    for settings, umask, name in zip(TOOL.SETTINGS, TOOL.UMASKS, TOOL.FOLDERS, strict=True):
        before = os.umask(umask)
        try:
            tree, out = tmp_path / name / "tree", tmp_path / name / "out"
            TOOL.write(TOOL.tracked(ROOT), tree)
            out.mkdir()
            env = os.environ | settings | {"PYTHONPATH": str(tree)}
            done = subprocess.run(
                [sys.executable, "-c", WHEELS, out], cwd=tree, env=env, capture_output=True, text=True
            )
        finally:
            os.umask(before)
        assert done.returncode == 0, done.stderr
        (wheel,) = out.iterdir()
        made.append(wheel)
    assert made[0].name == made[1].name and "win_amd64" in made[0].name
    assert made[0].read_bytes() == made[1].read_bytes()
    with zipfile.ZipFile(made[0]) as packed:
        names = packed.namelist()
        head = packed.read(next(name for name in names if name.endswith("/METADATA"))).decode()
    assert not [name for name in names if "pycache" in name or name.startswith("tests")]
    assert {"livebass/presets/slap.toml", "livebass/py.typed", "livebass/built/kernels-x86-64-v2"} <= set(names)
    assert f"\nVersion: {__version__}\n" in head


@needs_checkout
def test_the_command_refuses_in_one_line(tmp_path: Path) -> None:
    (tmp_path / "mine.txt").touch()
    for arguments, said in (
        (["--trial", "--no-tests", "-o", str(tmp_path)], f"tools/release: {tmp_path}: holds other files"),
        (["--trial", "--tag", "v9"], f"tools/release: the tag must be v{__version__}, not v9"),
        (["--trial", "dos"], "SYSTEM must be linux-x86_64, "),
        (["linux-x86_64"], "SYSTEM needs --trial"),
    ):
        done = subprocess.run([sys.executable, ROOT / "tools/release.py", *arguments], capture_output=True, text=True)
        assert done.returncode and said in done.stderr.splitlines()[-1] and "Traceback" not in done.stderr
    assert [entry.name for entry in tmp_path.iterdir()] == ["mine.txt"]
