"""tools/run.py sets up .venv: editable, package by package if not all can be had; tools/bare hides what is here."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path
from types import ModuleType

import pytest
from support import needs
from support.places import ROOT
from support.programs import load

PROJECT = """
[project.optional-dependencies]
live = ["sounddevice>=0.5", "none-has-this"]
test = ["livebass[live]", "pytest>=8"]
"""


@pytest.fixture
def run(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> ModuleType:
    """The module tools/run.py for a project in `tmp_path`, whose pip finds all but `none-has-this`; run.calls lists."""
    module = load("run")
    (tmp_path / ".venv/lib/livebass-0.1.0.dist-info").mkdir(parents=True)
    (tmp_path / "pyproject.toml").write_text(PROJECT)
    for name, value in {"ROOT": tmp_path, "VENV": tmp_path / ".venv"}.items():
        monkeypatch.setattr(module, name, value)
    for name in ("INSTALLED", "LOG"):
        monkeypatch.setattr(module, name, tmp_path / ".venv" / getattr(module, name).name)
    calls: list[list[str]] = []
    module.calls = calls  # type: ignore[attr-defined]

    def pip(*arguments: str) -> bool:
        calls.append(list(arguments))
        if "--editable" in arguments:
            install(tmp_path, editable=True)
        more = module.requirements(module.project(), ["test"]) if "[" in arguments[-1] else []
        return "none-has-this" not in [*arguments, *more]

    monkeypatch.setattr(module, "pip", pip)
    return module


def install(project: Path, editable: bool) -> None:
    """Writes what pip notes about an installation from a folder."""
    stated = {"url": project.as_uri(), "dir_info": {"editable": True} if editable else {}}
    (project / ".venv/lib/livebass-0.1.0.dist-info/direct_url.json").write_text(json.dumps(stated))


def test_a_package_that_cannot_be_installed_takes_no_other_away(run: ModuleType) -> None:
    assert run.install("test") == ["none-has-this"]
    one_by_one = [["none-has-this"], ["pytest>=8"], ["sounddevice>=0.5"]]
    assert run.calls == [["--editable", ".[test]"], ["--editable", "."], *one_by_one]
    run.calls.clear()
    assert run.install("test", "live") == ["none-has-this"] and run.calls[0] == ["--editable", ".[live]"]
    run.calls.clear()
    assert run.install("live") == ["none-has-this"] and not run.calls, "it is known"


def test_a_copy_of_livebass_is_replaced(run: ModuleType, tmp_path: Path) -> None:
    """`pip install .` puts a copy in place of an editable install: tests would check old code."""
    run.install("live")
    run.calls.clear()
    install(tmp_path, editable=False)
    run.install("live")
    assert run.calls[0] == ["--editable", ".[live]"] and run.is_editable()


def test_python_starts_in_a_folder_with_umlauts_under_the_posix_locale(run: ModuleType, tmp_path: Path) -> None:
    """Python 3.11 and 3.12 read .pth files by the locale, and end if they cannot; pip names the folder there."""
    place = tmp_path / ".venv/lib/python3.11/site-packages"
    place.mkdir(parents=True)
    file = place / "_editable_impl_livebass.pth"
    file.write_text("/home/jörg/bässe", encoding="utf-8")
    run.install("test")
    assert (place / file.read_text(encoding="ascii").strip()).resolve() == tmp_path.resolve()


def test_other_requirements_are_installed(run: ModuleType, tmp_path: Path) -> None:
    run.install("live")
    run.calls.clear()
    (tmp_path / "pyproject.toml").write_text(PROJECT.replace("pytest>=8", "pytest>=9"))
    run.install("live")
    assert run.calls


def test_without_the_network_it_says_why(run: ModuleType, monkeypatch: pytest.MonkeyPatch) -> None:
    def pip(*arguments: str) -> bool:
        run.LOG.write_text("WARNING: retrying\nERROR: No matching distribution found for hatchling>=1.24\n")
        return False

    monkeypatch.setattr(run, "pip", pip)
    with pytest.raises(run.Failed, match="No matching distribution found for hatchling"):
        run.install("live")
    assert not run.INSTALLED.exists()


def test_extras_name_all_their_packages(run: ModuleType) -> None:
    assert run.requirements(run.project(), ["test"]) == ["none-has-this", "pytest>=8", "sounddevice>=0.5"]


def test_an_unknown_command_is_one_line() -> None:
    done = subprocess.run([sys.executable, ROOT / "tools/run.py", "tset"], capture_output=True, text=True, check=False)
    assert done.returncode == 1 and done.stderr.count("\n") == 1 and "must be demo, test, check" in done.stderr


@pytest.mark.skipif(os.name != "posix", reason="a shell script")
def test_without_python_it_says_what_to_install(tmp_path: Path) -> None:
    """An older Python and a broken one are passed over."""
    for name, text in (("python3", "exit 1"), ("dirname", f'{shutil.which("dirname")} "$@"'), ("cat", "/bin/cat")):
        (tmp_path / name).write_text(f"#!/bin/sh\n{text}\n")
        (tmp_path / name).chmod(0o755)
    done = subprocess.run(
        ["/bin/sh", ROOT / "tools/python.sh", "test"], capture_output=True, text=True, env={"PATH": str(tmp_path)}
    )
    assert done.returncode == 1 and "sudo apt install python3 python3-venv" in done.stderr and not done.stdout


def test_a_package_whose_library_is_missing_skips_by_name(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """JACK-Client raises OSError at import where there is no libjack, and importorskip catches ImportError only."""
    (tmp_path / "jack.py").write_text("raise OSError('JACK library not found')")
    (tmp_path / "pysfizz.py").write_text("raise ImportError('libatomic.so.1: cannot open shared object file')")
    monkeypatch.syspath_prepend(tmp_path)
    for name in ("jack", "pysfizz"):
        monkeypatch.delitem(sys.modules, name, raising=False)
    monkeypatch.delenv("LIVEBASS_NEEDS_JACK", raising=False)
    for name in ("jack", "pysfizz"):
        with pytest.raises(pytest.skip.Exception, match=needs.LIBRARIES[name][1]):
            needs.package(name)
    assert {needs.LIBRARIES["jack"], needs.LIBRARIES["pysfizz"]} <= set(needs.absent())
    monkeypatch.setenv("LIVEBASS_NEEDS_JACK", "1")
    with pytest.raises(AssertionError, match="JACK's library is missing"):
        needs.package("jack")


WITHOUT_COMPILER = """
import pytest
class BuildError(Exception): pass
@pytest.fixture(scope="module")
def bundle(): raise BuildError
def test_one(bundle): pass
def test_two(bundle): pass
def test_three(): raise BuildError
"""


def test_every_test_of_a_fixture_that_no_compiler_builds_is_skipped(tmp_path: Path) -> None:
    (tmp_path / "test_it.py").write_text(WITHOUT_COMPILER)
    env = {**os.environ, "PATH": str(tmp_path), "PYTHONPATH": str(ROOT / "tests")}
    line = [sys.executable, "-m", "pytest", "-p", "support.needs", "-p", "no:cacheprovider", "-q", "-rs", tmp_path]
    done = subprocess.run(line, env=env, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert "3 skipped" in done.stdout and "needs a C compiler (Debian: gcc libc6-dev)" in done.stdout, done.stdout
