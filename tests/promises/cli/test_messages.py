"""Output of commands: lines broken between words at a terminal's width, tables that fit, errors naming the option."""

from __future__ import annotations

import os
import sys
from pathlib import Path

import pytest
import soundfile
from support.command import Run, cli_text, refusal
from support.engine import FakeEngine

from livebass.cli import messages

LONG = "song.mid: 12 notes are below the lowest string of the bass, an E1, and are played an octave higher"


def in_a_terminal(monkeypatch: pytest.MonkeyPatch, columns: int) -> None:
    monkeypatch.setattr(sys.stderr, "isatty", lambda: True)
    monkeypatch.setattr(sys.stderr, "fileno", lambda: 2)
    monkeypatch.setattr(os, "get_terminal_size", lambda *_: os.terminal_size((columns, 24)))


def test_a_terminal_gets_lines_that_end_between_words(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    messages.say(LONG)
    assert capsys.readouterr().err == LONG + "\n", "a pipe gets one line"
    for columns in (40, 79):
        in_a_terminal(monkeypatch, columns)
        messages.say(LONG)
        lines = capsys.readouterr().err.splitlines()
        assert len(lines) > 1 and all(len(line) <= columns for line in lines)
        assert " ".join(line.strip() for line in lines) == LONG


def test_a_long_path_stays_whole(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    in_a_terminal(monkeypatch, 30)
    path = "/tmp/a-folder/" + "long-" * 12 + "name.wav"
    messages.say(f"{path}: is read-only")
    assert path in capsys.readouterr().err


def test_the_list_of_presets_has_headings_and_fits(run: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("COLUMNS", "80")
    lines = cli_text(run, "presets", "list").splitlines()
    assert lines[0].split() == ["NAME", "GM", "BASS"] and max(map(len, lines)) <= 80
    begin = lines[0].index("BASS")
    for line in lines[1:]:
        assert line[begin - 1] == " " and line[begin] != " ", "the last column goes on below itself"
    assert any(line.split()[:2] == ["slap", "37"] for line in lines)


@pytest.mark.parametrize(
    ("option", "value"),
    [
        ("--tuning", "E1 A1"), ("--capo", "20"), ("--capo", "99"), ("--a4", "12"), ("--temperament", "none"),
        ("--response", "none.wav"), ("--keys", "none"), ("--keys", "none.toml"), ("--velocity-curve", "steep"),
        ("--compression", "2"), ("--drive", "loud"), ("--wheel", "left"),
    ],
)  # fmt: skip
def test_an_error_names_the_option(run: Run, tmp_path: Path, option: str, value: str) -> None:
    err = refusal(run, "render", "--note", "E1", option, value, "-o", tmp_path / "a.wav")
    assert option in err and value in err and not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    ("note", "name"), [("Bb1", "Bb1"), ("bb1", "Bb1"), ("A#1", "A#1"), ("34", "A#1"), ("e1", "E1")]
)
def test_the_file_of_a_note_is_called_as_the_note_was_written(
    fake: type[FakeEngine], run: Run, note: str, name: str
) -> None:
    assert run("render", "--note", note)[0] == 0
    assert [path.name for path in Path().iterdir()] == [f"{name}.wav"] and soundfile.info(f"{name}.wav").frames
