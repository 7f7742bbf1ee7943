"""What each command needs besides livebass: it names the extras of the handbook's table, and works with no others."""

from __future__ import annotations

import importlib.metadata
import re
import subprocess
import sys
from pathlib import Path

import pytest
from support.command import Run, assert_one_clear_line, python, refusal
from support.costs import quick
from support.places import GROWLY, RECORDINGS
from support.tabs import as_gp5, beats, note, tab

from livebass.system.extras import REFERENCE, USES, install, requirements

RECORDING = str(RECORDINGS / "picked-g.flac")
TWO = ("--vary", "pluck.apex=1mm:2mm:2", "--duration", "10ms", "-q", "live", "-o", "sweep")
EXTRAS = ("analysis", "cluster", "export", "fit", "hear", "live", "osc", "plots", "tab")
NEEDED = [  # (extras, a distribution or all of the extras' that the command needs, command line)
    ("analysis", "scipy tomlkit", ("identify", RECORDING)),
    ("analysis", "scipy", ("study", "claims", "b-first-contact")),
    ("analysis", "scipy jinja2", ("study", "claims", "-o", "claims")),
    ("analysis,plots", "scipy matplotlib jinja2", ("study", "b", "-o", "paper")),
    ("plots", "", ("study", "sweep", *TWO)),
    ("plots", "", ("compare", RECORDING, "-o", "compared.html")),
    ("hear", "", ("compare", RECORDING, "--hear")),
    ("plots", "", ("map", "-o", "neck.png")),
    ("plots", "", ("bench", "live", "--plot", "bench.png")),
    ("analysis,fit,plots", "cmaes scipy matplotlib jinja2", ("fit", RECORDING, "-o", "mine.toml")),
    ("analysis,fit", "cmaes scipy", ("fit", RECORDING, "--no-page", "-o", "mine.toml")),
    ("cluster", "distributed", ("study", "sweep", *TWO, "--no-picture", "--scheduler", "tcp://127.0.0.1:1")),
    ("tab", "PyGuitarPro", ("render", "song.gp5", "--list")),
    ("tab", "defusedxml", ("export", "midi", "song.musicxml")),
    ("export", "", ("export", "lv2", "-p", "slap", "--system", "windows-x86_64", "-o", "plugins")),
    ("live", "sounddevice", ("play", "--backend", "portaudio")),
    ("live", "sounddevice", ("fit", "--guide", "--record", "notes")),
]
NOTES = (str(GROWLY / "C2_f_rr1.flac"), str(GROWLY / "C2_ff_rr1.flac"))
WORKS = [  # (extras, command line, a file it writes)
    ("", ("compare", *NOTES), None),
    ("", ("study", "sweep", *TWO, "--no-picture"), "sweep/sweep.csv"),
    ("analysis", ("simulate", "--analyse", "--duration", "50ms", "-q", "live", "-o", "pluck"), "pluck/result.npz"),
    ("plots", ("study", "sweep", *TWO), "sweep/sweep.png"),
    ("tab", ("export", "midi", "song.gp5", "-o", "song.mid"), "song.mid"),
]
SLOWLY = [
    ("analysis", ("identify", RECORDING, "-o", "g.toml", "--modes", "12"), "g.toml"),
    ("analysis", ("study", "claims", "b-first-contact", "--plucks", "0", "-o", "claims"), "claims/claims.html"),
    ("plots", ("compare", *NOTES, "-o", "a.html"), "a.html"),
    ("analysis,plots", ("study", "b", "--duration", "0.1", "-o", "paper"), "paper/index.html"),
    ("analysis,fit", ("fit", str(GROWLY), "--no-page", "--evaluations", "12", "-o", "mine.toml"), "mine.toml"),
    ("analysis,fit,plots", ("fit", str(GROWLY), "--evaluations", "12", "-o", "mine.toml"), "mine.html"),
]
BLOCKED = """
import sys
class Blocked:
    def find_spec(self, name, *_):
        if name.partition(".")[0] in {blocked!r}:
            raise ModuleNotFoundError(f"No module named {{name!r}}", name=name)
sys.meta_path.insert(0, Blocked())
from livebass.cli import main
main.main(sys.argv[1:])
"""


def distributions(extras: str) -> list[str]:
    """The distributions of `extras`, without versions."""
    return [re.split(r"[^\w.-]", one)[0] for one in requirements(extras.split(","))] if extras else []


def modules(distribution: str) -> set[str]:
    """The top-level modules of a distribution; skips the test if it is not installed."""
    try:
        files = importlib.metadata.files(distribution) or []
    except importlib.metadata.PackageNotFoundError:
        pytest.skip(f"{distribution} is not installed")
    tops = {file.parts[0].partition(".")[0] for file in files if file.suffix in (".py", ".so", ".pyd")}
    return {top for top in tops if top.isidentifier() and not top.startswith("__")}


@pytest.fixture(autouse=True)
def _here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    Path("song.gp5").write_bytes(as_gp5(tab(beats(note(0, 3)))))
    Path("song.musicxml").write_text('<?xml version="1.0"?><score-partwise/>')


def test_the_table_has_every_extra_and_every_case_has_its_row() -> None:
    listed = {extras for _, extras in USES}
    assert {extra for extras in listed for extra in extras.split(",")} == {*EXTRAS, REFERENCE}
    assert {extras for extras, *_ in (*NEEDED, *WORKS, *SLOWLY)} - {""} <= listed
    assert listed - {extras for extras, *_ in NEEDED} == {"live,osc", REFERENCE}, "test_rig.py, and below"


CASES = [
    pytest.param(extras, missing, line, id=f"{' '.join(line[:2])} without {missing}")
    for extras, needed, line in NEEDED
    for missing in needed.split() or distributions(extras)
]


@pytest.mark.parametrize(("extras", "missing", "line"), CASES)
def test_a_missing_package_gets_one_line_with_exactly_the_needed_extras(
    run: Run, monkeypatch: pytest.MonkeyPatch, extras: str, missing: str, line: tuple[str, ...]
) -> None:
    for top in modules(missing):
        for name in [top, *(name for name in sys.modules if name.startswith(f"{top}."))]:
            monkeypatch.setitem(sys.modules, name, None)
    monkeypatch.setattr("livebass.plugin.build.is_built", lambda _: False)
    if missing != "sounddevice":  # which play needs when it opens its device
        monkeypatch.setattr("livebass.compiling.library.is_cached", lambda: pytest.fail("it works"))
    err = refusal(run, *line, status=1)
    assert err.rstrip("\n").partition("; --no-picture")[0].endswith(install(extras)), err


def without_numba(*line: str) -> subprocess.CompletedProcess[str]:
    """Runs a command as an installation from a wheel would: kernels are compiled, and nothing can compile others."""
    return python(BLOCKED.format(blocked=["llvmlite", "numba"]), *line)


@pytest.mark.parametrize("line", [
    ("simulate", "--duration", "50ms", "-q", "live", "-o", "pluck"),
    ("study", "sweep", *TWO, "--no-picture"),
    ("render", "--demo", "-q", "live", "-o", "demo.wav"),
    ("--version",),
])  # fmt: skip
def test_compiled_kernels_need_no_compiler(line: tuple[str, ...]) -> None:
    done = without_numba(*line)
    assert done.returncode == 0, done.stderr


@pytest.mark.parametrize("line", [
    ("simulate", "--solver", "reference", "--duration", "50ms", "-o", "pluck"),
    ("study", "claims", "b-first-contact"),
    ("bench", "render"),
])  # fmt: skip
def test_the_reference_solver_says_that_it_needs_numba(line: tuple[str, ...]) -> None:
    done = without_numba(*line)
    assert_one_clear_line(done.returncode, done.stderr, (1,))
    assert done.stderr.rstrip().endswith(f"the reference solver needs numba: {install(REFERENCE)}")
    assert not Path("pluck").exists()


@pytest.mark.parametrize(("extras", "line", "written"), quick([*WORKS, *SLOWLY], WORKS))
def test_a_command_works_with_exactly_these_extras(extras: str, line: tuple[str, ...], written: str | None) -> None:
    """With the packages of `extras` alone it succeeds, and finds nothing missing."""
    others = set(distributions(",".join(EXTRAS))) - set(distributions(extras))
    blocked = set().union(*map(modules, others))
    done = python(BLOCKED.format(blocked=sorted(blocked)), *line, env={"LIVEBASS_TRACEBACK": "1"})
    assert done.returncode == 0, done.stderr
    assert "install" not in done.stderr and (written is None or Path(written).stat().st_size)
