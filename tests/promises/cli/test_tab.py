"""Tablature on the command line: the chosen track and bass, the messages, and files that cannot be played."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from support.command import GOOD, Run, assert_one_clear_line, cli_text, refusal
from support.tabs import as_gp, as_gp5, beats, lock_archive, note, tab, zip_files

from livebass.kernels.player.words import STROKE
from livebass.live.desk import FILE
from livebass.live.settings import Settings
from livebass.live.thread.desk import BEAT
from livebass.score.reading import read_score
from livebass.tab.model import Tab

GUITAR = (40, 45, 50, 55, 59, 64)


def band() -> Tab:
    """A guitar called Bass, drums, two basses; the second bass has more notes."""
    piece = tab(beats(note(0, 3)), name="Bass", tuning=GUITAR, program=30)
    for more in (
        tab(beats(note(0, 3)), name="Kit", drums=True),
        tab(beats(note(0, 3)), name="Marco", program=35),
        tab(beats(note(0, 3), note(0, 5)), name="Track 8", tuning=(23, 28, 33, 38, 43)),
    ):
        piece.tracks += more.tracks
    return piece


def write(data: bytes, name: str = "song.gp5") -> str:
    Path(name).write_bytes(data)
    return name


def test_the_list_names_tracks_strings_and_signs(run: Run) -> None:
    lines = cli_text(run, "render", write(as_gp5(band())), "--list").splitlines()
    assert [line.split()[0] for line in lines] == ["track", "1", "2", "3", "4"]
    assert [line.split()[-1] for line in lines[1:]] == ["no", "no", "no", "yes"]
    assert "B0 E1 A1 D2 G2" in lines[4] and "drums" in lines[2]


@pytest.mark.parametrize(
    "options, played",
    [
        ([], 'track 4 "Track 8", 2 notes, not the bass in track 3'),
        (["--track", "3"], 'track 3 "Marco", 1 note, not the bass in track 4'),
        (["--track", "marco"], 'track 3 "Marco"'),
    ],
)
def test_the_track_is_chosen_by_its_strings_or_asked_for(run: Run, options: list[str], played: str) -> None:
    status, _, err = run("export", "midi", write(as_gp5(band())), *options)
    assert status == 0 and f"song.gp5: plays {played}" in err


@pytest.mark.parametrize(
    "tuning, capo, program, options, said",
    [
        ((28, 33, 38, 43), 0, 33, [], "jazz-finger (tuning E1 A1 D2 G2)"),
        ((24, 31, 36, 41), 2, 34, [], "precision-pick (tuning C1 G1 C2 F2, capo 2)"),
        ((23, 28, 33, 38, 43), 0, 33, [], "five-string (tuning B0 E1 A1 D2 G2)"),
        ((23, 28, 33, 38, 43, 48), 0, 33, [], "six-string (tuning B0 E1 A1 D2 G2 C3)"),
        ((21, 28, 33, 38), 0, 33, [], "five-string (tuning A0 E1 A1 D2 G2)"),
        ((28, 33, 38, 43), 0, 33, ["-p", "flatwound", "--tuning", "drop-d"], "flatwound (tuning drop-d)"),
    ],
)
def test_the_bass_follows_strings_capo_and_program(
    run: Run, fake: Any, tuning: tuple[int, ...], capo: int, program: int, options: list[str], said: str
) -> None:  # fmt: skip
    piece = tab(beats(note(0, 3)), tuning=tuning, capo=capo, program=program)
    status, _, err = run("render", write(as_gp5(piece)), "-o", "a.wav", *options)
    assert status == 0, err
    assert f"song.gp5: played on {said}" in err or (said.startswith("jazz-finger") and "played on" not in err)


def test_frets_keep_their_strings_under_another_tuning(run: Run) -> None:
    song = write(as_gp5(tab(beats(note(0, 3)))))
    cli_text(run, "export", "midi", song, "--tuning", "drop-d", "-o", "a.mid")
    score = read_score("a.mid", 48000)
    assert [int(m[1]) for m in score.messages if m[0] & 0xF0 == 0x90] == [26 + 3]
    assert dict(score.basses[0].given) == {"tuning": "drop-d"}


def test_what_is_not_played_is_counted(run: Run) -> None:
    piece = tab(beats(note(0, 23), note(0, 3, harmonic="semi"), note(0, 5, harmonic="semi")))
    _, _, err = run("export", "midi", write(as_gp(piece), "song.gp"))
    assert "3 notes; 2 semi-harmonics, 1 note beyond fret 20 not played" in err
    hammered = [note(1, fret, hammer=True) for fret in (3, 5)]
    piece = tab(beats(note(0, 23), hammered[0], None, hammered[1]), beats(note(0, 22)))
    _, _, err = run("export", "midi", write(as_gp(piece), "song.gp"))
    assert "4 notes; 2 slides or hammer-ons to nothing, 2 notes beyond fret 20 not played" in err


def test_dynamics_move_the_force_of_all_notes(run: Run) -> None:
    song = write(as_gp5(tab(beats(note(0, 3)))))
    cli_text(run, "export", "midi", song, "--dynamics", "-4dB")
    messages = read_score("song.mid", 48000).messages.tolist()
    assert [0xB0, 105, round(127 * 8 / 24)] in messages


def test_bars_play_alone(run: Run) -> None:
    song = write(as_gp5(tab(*(beats(note(0, fret)) for fret in range(4)))))
    cli_text(run, "export", "midi", song, "--bars", "2-3")
    score = read_score("song.mid", 48000)
    ons = score.messages[:, 0] & 0xF0 == 0x90
    assert score.messages[ons, 1].tolist() == [29, 30] and score.frames[ons].tolist() == [0, 96000]


@pytest.mark.parametrize("preset", ["jazz-finger", "flatwound"])
def test_play_reads_a_tablature_on_the_bass_that_it_tunes(
    run: Run, monkeypatch: pytest.MonkeyPatch, preset: str
) -> None:
    found: list[Settings] = []

    def begin(settings: Settings, *_: object) -> None:
        found.append(settings)
        raise ValueError("stopped")

    monkeypatch.setattr("livebass.live.session.Session", begin)
    monkeypatch.setattr("livebass.compiling.library.is_cached", lambda: True)
    song = write(as_gp5(tab(beats(note(0, 3), note(1, 5)), tuning=(24, 31, 36, 41), capo=2)))
    clicks = ["--metronome", "file", "--count-in"]
    run("play", "--file", song, "--no-settings", *clicks, *(["-p", preset] if preset == "flatwound" else []))
    (settings,) = found
    assert settings.preset == preset and settings.read is not None
    assert [string.open_note for string in settings.instrument.strings] == [26, 33, 38, 43]
    score = settings.read(44100)
    assert score.notes == 2 and settings.metronome == FILE
    assert score.frames[score.messages[:, 0] == BEAT].tolist() == [22050 * k for k in range(8)]
    assert [frame for frame, kind, *_ in score.strokes if kind == STROKE] == [4 * 22050, 5 * 22050]
    assert settings.given(preset) == {"tuning": "C1 G1 C2 F2", "capo": "2"}


def test_a_metronome_of_the_file_is_for_tablature(run: Run) -> None:
    for options, said in [
        (["--file", write(GOOD, "song.mid"), "--metronome", "file"], "a --file with bars: a tablature"),
        (["--metronome", "file"], "a --file with bars"),
        (["--metronome", "90", "--count-in"], "--count-in is for --metronome file"),
        (["--metronome", "bars"], "must be from 20 to 400, or file, not bars"),
    ]:
        assert said in refusal(run, "play", "--no-settings", *options)


@pytest.mark.parametrize("more", [["--list"], []])
def test_a_channel_is_for_midi_files(run: Run, more: list[str]) -> None:
    status, _, err = run("render", write(as_gp5(tab(beats(note(0, 3)))), "song.gp5"), "--channel", "2", *more)
    assert_one_clear_line(status, err)
    assert status == 2 and "--channel is for MIDI files" in err and "--track" in err


def test_standard_input_is_a_tablature_too(run: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("livebass.score.reading._stdin", lambda: as_gp5(tab(beats(note(0, 3)))))
    assert "E1 A1 D2 G2" in cli_text(run, "render", "-", "--list")


def test_bytes_decide_not_the_name(run: Run) -> None:
    assert "E1 A1 D2 G2" in cli_text(run, "render", write(as_gp(tab(beats(note(0, 3)))), "song.mid"), "--list")


REFUSED: dict[str, tuple[Callable[[], bytes], list[str], str]] = {
    "no bass": (lambda: as_gp5(tab(beats(note(0, 3)), name="A", tuning=GUITAR, program=1)), [], "no track is tuned"),
    "no such track": (lambda: as_gp5(band()), ["--track", "Nobody"], 'no track Nobody; there is 1 "Bass"'),
    "no such bars": (lambda: as_gp5(band()), ["--bars", "1-2"], "has 1 bars, not 2"),
    "bars": (lambda: as_gp5(band()), ["--bars", "4-2"], "must be numbers of bars such as 9-16"),
    "too few strings": (lambda: as_gp5(band()), ["-p", "slap"], "has 5 strings, and slap has 4"),
    "guitar": (lambda: as_gp5(band()), ["--track", "1"], "cannot be played on six-string"),
    "for midi": (lambda: GOOD, ["--bars", "1"], "--bars is for tablature"),
    "cut off": (lambda: as_gp5(band())[:1500], [], "is damaged"),
    "no score": (lambda: zip_files({"Content/BinaryStylesheet": b""}), [], "without a score"),
    "password": (lambda: lock_archive(as_gp(band())), [], "is locked with a password"),
    "bomb": (lambda: zip_files({"Content/score.gpif": bytes(60 << 20)}), [], "more than 24 MB"),
    "entities": (
        lambda: b'<?xml version="1.0"?><!DOCTYPE score-partwise [<!ENTITY a "b">]><score-partwise>&a;</score-partwise>',
        [], "declares entities",
    ),
    "outside": (
        lambda: b'<?xml version="1.0"?><!DOCTYPE score-partwise [<!ENTITY a SYSTEM "file:///etc/passwd">]>'
        b"<score-partwise>&a;</score-partwise>",
        [], "declares entities",
    ),
    "other xml": (lambda: b'<?xml version="1.0"?>\n<a><score-timewise version="3.1"/></a>', [], "score-partwise"),
}  # fmt: skip


@pytest.mark.parametrize("case", REFUSED)
def test_other_files_get_one_line(run: Run, case: str) -> None:
    data, options, said = REFUSED[case]
    assert said in refusal(run, "render", write(data()), "-o", "a.wav", *options)
    assert not Path("a.wav").exists()


@pytest.mark.parametrize("write_it, package", [(as_gp5, "PyGuitarPro"), (as_gp, "defusedxml")])
def test_a_missing_package_is_named(
    run: Run, monkeypatch: pytest.MonkeyPatch, write_it: Callable[[Tab], bytes], package: str
) -> None:
    song = write(write_it(tab(beats(note(0, 3)))))

    def without(name: str, *rest: Any) -> Any:
        raise ImportError(name)

    monkeypatch.setattr("livebass.tab.needs.import_module", without)
    err = refusal(run, "render", song, "--list")
    assert f"need{'s' * (package == 'defusedxml')} {package}" in err and "install" in err
