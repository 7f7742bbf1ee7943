"""What Ctrl-C says: "nothing written" only to a user who asked for a file."""

from __future__ import annotations

import os
import signal
from pathlib import Path
from typing import NoReturn

import pytest
from support.command import GOOD, Run

from livebass.files.whole import Output, noted_output

NOTHING = [
    "play", "play --log log.txt", "play --demo --no-settings", "page -p slap", "render --note E1 -o -", "bench render",
    "study claims", "compare --tell -p slap",
]  # fmt: skip
FILES = [
    "play --record take.wav", "play --record-midi take.mid", "render --note E1", "render song.mid",
    "render --all-presets all", "export instrument slap", "export lv2 -p slap -o plugins", "export sfz -p slap -o pack",
    "export web -p slap -o page", "simulate -o plucks", "study b -o paper", "study claims --json claims.json",
    "study sweep --vary pluck.apex=1mm:2mm:2 --no-picture -o sweep", "bench render --json bench.json",
    "compare --tell -p slap --json told.json",
]  # fmt: skip
REFUSED = [
    "play --record none/take.wav", "play --record-midi none/take.mid", "simulate -o song.mid", "study b -o song.mid",
    "play --record take.wav --record-midi ./take.wav", "study claims -o song.mid",
    "export instrument slap -o none/a.lbass",
]  # fmt: skip


@pytest.fixture(autouse=True)
def _interrupted(monkeypatch: pytest.MonkeyPatch, tmp_path_factory: pytest.TempPathFactory) -> None:
    """Ctrl-C comes when a command asks whether the kernels are compiled."""

    def interrupt() -> NoReturn:
        raise KeyboardInterrupt

    for variable in ("XDG_DATA_HOME", "HOME"):
        monkeypatch.setenv(variable, str(tmp_path_factory.mktemp("home")))
    Path("song.mid").write_bytes(GOOD)
    monkeypatch.setattr("livebass.compiling.library.is_cached", interrupt)
    monkeypatch.setattr("livebass.plugin.build.is_built", lambda _: True)


@pytest.mark.parametrize("line", NOTHING)
def test_a_command_that_writes_no_file_says_nothing_of_files(run: Run, line: str) -> None:
    status, out, err = run(*line.split())
    assert (status, out) == (130, "")
    assert [text for text in err.splitlines() if "samples" not in text] == ["livebass: error: interrupted"]


@pytest.mark.parametrize("line", FILES)
def test_a_command_that_has_written_no_file_says_so(run: Run, tmp_path: Path, line: str) -> None:
    status, out, err = run(*line.split())
    assert (status, out) == (130, "") and err.splitlines()[-1] == "livebass: error: interrupted, nothing written"
    assert os.listdir(tmp_path) == ["song.mid"]


def test_sigterm_says_nothing(run: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    def terminate() -> NoReturn:
        raise SystemExit(128 + signal.SIGTERM)

    monkeypatch.setattr("livebass.compiling.library.is_cached", terminate)
    with pytest.raises(SystemExit, match="143"):
        run("render", "--note", "E1")


def test_what_is_written_inside_is_not_noted_outside() -> None:
    with noted_output() as outer:
        with noted_output() as inner:
            inner.requested = True
        assert outer == Output() != inner


@pytest.mark.parametrize("line", REFUSED)
def test_a_place_is_refused_before_the_kernels_compile(run: Run, line: str) -> None:
    status, _, err = run(*line.split())
    assert status in (1, 2) and "interrupted" not in err
    assert any(word in err for word in ("no directory none", "is not a directory", "the same file")), err
