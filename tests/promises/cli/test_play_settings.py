"""The memory of `livebass play`: its file, the settings used from it, and options that exclude each other."""

from __future__ import annotations

import logging
import os
import tomllib
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from support.command import GOOD, NOTE, Run, refusal, song

from livebass import load_preset
from livebass.cli import play_settings
from livebass.cli.console import LOG, Console, log_to
from livebass.cli.play_settings import DamagedSettings, PlaySettings, forget, load, save, settings_file
from livebass.files.whole import OutputError
from livebass.live import outputs, session
from livebass.live.device_errors import OutputLost
from livebass.live.settings import Settings
from livebass.live.synth import Meters

ALL = PlaySettings("slap", -6.5, "portaudio", 'Card "1"\\\n\x7f\U0001f3b8, ALSA', "keys", {"tone": 74, "gain": 7})


@pytest.fixture
def file(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Path:
    path = tmp_path / "here" / "play.toml"
    monkeypatch.setenv("LIVEBASS_SETTINGS", str(path))
    return path


class FakeSession:
    """A session that ends at once; `ran` holds the settings of each."""

    ran: list[Settings]
    ends_with: dict[str, Any]

    def __init__(self, settings: Settings, _status: object) -> None:
        self.ran.append(settings)
        self.settings, self.stop, self.synth = settings, None, None
        self.desk = SimpleNamespace(learned=self.ends_with.get("learned", dict(settings.controllers)))

    def run(self) -> session.Summary:
        s = self.settings
        ended = {"preset": s.preset, "audio": "Card, ALSA" if s.audio is not None else None, "midi": "m", "dropped": 0}
        meters = Meters(*[0] * 11)
        more = {name: value for name, value in self.ends_with.items() if name != "learned"}
        return session.Summary(
            output="x", seconds=1.0, meters=meters, worst=0.0, peak=0.0, recorded=(), short=None, lost=None,
            **(ended | more),
        )  # fmt: skip


@pytest.fixture
def played(monkeypatch: pytest.MonkeyPatch, file: Path) -> type[FakeSession]:
    monkeypatch.setattr(session, "Session", FakeSession)
    monkeypatch.setattr("livebass.compiling.library.is_cached", lambda: True)
    monkeypatch.setattr("livebass.cli.play.stop_instead", lambda *_: None)
    monkeypatch.setattr(outputs, "check_output", lambda *_: None)
    FakeSession.ran, FakeSession.ends_with = [], {}
    return FakeSession


def test_what_is_written_is_read_again(file: Path) -> None:
    assert load(file) == PlaySettings()
    for what in (ALL, PlaySettings(), PlaySettings(preset="/a b/mine.toml", controllers={"tone": 1})):
        save(file, what)
        assert load(file) == what
    assert os.listdir(file.parent) == [file.name]
    forget(file)
    forget(file)
    assert not file.exists() and load(file) == PlaySettings()


def test_the_file_is_the_users(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("LIVEBASS_SETTINGS")
    assert settings_file().name == "play.toml" and "livebass" in settings_file().parts


@pytest.mark.parametrize(
    "text",
    ["preset = ", 'gain = "loud"', "gain = 99", "preset = 3", 'backend = "oss"', "controllers = 3", "\0",
     "[controllers]\ntone = 500", "capo = 2.5", "capo = 99", "a4 = 300", 'tuning = "drop-x"', "tuning = [28]",
     'temperament = "x"', "temperament = [1.0]",
     "[controllers]\nnix = 5", "[controllers]\ntone = 5\ngain = 5", "gain = nan"],
)  # fmt: skip
def test_a_damaged_file_is_one_line_and_the_usual_settings(
    played: type[FakeSession], file: Path, run: Run, text: str
) -> None:
    """The file stays unchanged until it is forgotten."""
    file.parent.mkdir()
    file.write_text(text)
    with pytest.raises(DamagedSettings) as caught:
        load(file)
    assert "\n" not in str(caught.value) and str(file) in str(caught.value)
    status, _, err = run("play", "-p", "slap")
    assert status == 0 and err.count(str(file)) == 1 and "--forget" in err.splitlines()[0]
    assert played.ran[-1].preset == "slap" and file.read_text() == text
    run("play", "-p", "slap", "--forget")
    assert tomllib.loads(file.read_text()) == {"preset": "slap"}


def test_notes_without_a_string_are_counted_in_the_last_line(played: type[FakeSession], file: Path, run: Run) -> None:
    for count, says in (
        (0, "0 underruns\n"),
        (1, "0 underruns, 1 note dropped\n"),
        (7, "0 underruns, 7 notes dropped\n"),
    ):
        played.ends_with = {"dropped": count}
        assert run("play", "-p", "slap")[2].endswith(says)


def test_a_bass_that_a_file_chose_is_not_remembered(
    played: type[FakeSession], file: Path, run: Run, tmp_path: Path
) -> None:
    """Neither the bass it begins with nor a later one; a bass chosen by the player is."""
    (tmp_path / "song.mid").write_bytes(song(b"\x00\xc0\x20", NOTE, b"\x00\xc0\x24", NOTE))
    for ended, kept in (("upright", None), ("slap", None), ("muted", "muted")):
        played.ends_with = {"preset": ended}
        assert run("play", "--file", tmp_path / "song.mid")[0] == 0
        assert load(file).preset == kept


TUNED = {"tuning": "drop-d", "capo": 2, "a4": 442.0, "temperament": "just"}


def test_a_tuning_is_used_the_next_time_for_every_bass_of_the_session(
    played: type[FakeSession], file: Path, run: Run, tmp_path: Path
) -> None:
    options = [part for name, value in TUNED.items() for part in (f"--{name}", value)]
    run("play", *options)
    assert load(file) == PlaySettings(**TUNED)  # type: ignore[arg-type]
    status, _, err = run("play")
    assert status == 0
    assert "as the last time: tuning drop-d, capo 2, A 442 Hz, temperament just" in err
    s = played.ran[-1]
    assert s.instrument == load_preset("jazz-finger", **TUNED)  # type: ignore[arg-type]
    assert s.load("precision-finger") == load_preset("precision-finger", **TUNED)  # type: ignore[arg-type]
    song = tmp_path / "a.mid"
    song.write_bytes(GOOD)
    run("play", "--file", song)
    assert played.ran[-1].instrument == load_preset("jazz-finger", a4=442, temperament="just")
    run("play", "--tuning", "D1 A1 D2 G2", "--capo", "0", "--temperament", "-7,0,0,12")
    assert load(file) == PlaySettings(tuning="D1 A1 D2 G2", a4=442.0, temperament="-7,0,0,12")


def test_a_tuning_that_does_not_fit_is_left_out_and_said(played: type[FakeSession], file: Path, run: Run) -> None:
    save(file, PlaySettings(tuning="D1 A1 D2 G2", temperament="just"))
    status, _, err = run("play", "-p", "five-string")
    assert status == 0 and err.count("as remembered: five-string.toml: tuning = ") == 1
    assert "left out" in err and "as the last time" not in err
    assert played.ran[-1].instrument == load_preset("five-string")
    assert load(file) == PlaySettings("five-string", tuning="D1 A1 D2 G2", temperament="just")
    save(file, PlaySettings("./gone.toml", capo=2))
    status, _, err = run("play")
    assert status == 0 and "gone.toml" in err and played.ran[-1].preset == "jazz-finger"
    refusal(run, "play", "--tuning", "dropped", status=2)


def test_bytes_that_are_no_text_are_one_line(file: Path) -> None:
    file.parent.mkdir()
    file.write_bytes(b"\xff\xfe")
    with pytest.raises(DamagedSettings):
        load(file)


def test_what_was_chosen_is_used_the_next_time(played: type[FakeSession], file: Path, run: Run) -> None:
    run("play", "-p", "slap", "--gain", "-6", "--midi", "keys", "--learn", "tone=74", "--audio", "0")
    assert load(file) == PlaySettings("slap", -6.0, None, "Card, ALSA", "keys", {"tone": 74})
    status, _, err = run("play")
    assert status == 0 and "as the last time: preset slap, gain -6 dB, output Card, ALSA, MIDI keys" in err
    s = played.ran[-1]
    assert (s.preset, s.audio, s.midi, s.midi_if_there) == ("slap", "Card, ALSA", "keys", True)
    assert s.gain == pytest.approx(10 ** (-6 / 20)) and s.controllers == {"tone": 74}
    before = file.read_text()
    run("play", "--no-settings")
    s = played.ran[-1]
    assert (s.preset, s.gain, s.audio, s.midi, dict(s.controllers)) == ("jazz-finger", 1.0, None, None, {})
    assert file.read_text() == before
    run("play", "--gain", "0", "--learn", "tone=off", "--backend", "jack")
    assert load(file) == PlaySettings("slap", midi="keys")
    assert played.ran[-1].audio is None
    run("play", "--midi", "2")
    assert load(file).midi == "m", "a number may be another port's the next time"
    run("play", "--forget")
    assert played.ran[-1].preset == "jazz-finger" and not file.exists()


def test_what_changes_while_it_plays_is_remembered(played: type[FakeSession], file: Path, run: Run) -> None:
    played.ends_with = {"preset": "muted", "learned": {"dynamics": 21}}
    run("play")
    assert load(file) == PlaySettings("muted", controllers={"dynamics": 21})


def test_a_bass_of_ones_own_is_remembered_by_its_whole_path(
    played: type[FakeSession], file: Path, run: Run, tmp_path: Path
) -> None:
    (tmp_path / "mine.toml").write_text(run("presets", "show", "slap")[1])
    run("play", "-p", "mine.toml")
    assert load(file).preset == str(tmp_path / "mine.toml")
    (tmp_path / "mine.toml").unlink()
    status, _, err = run("play")
    assert status == 0 and "as remembered" in err and played.ran[-1].preset == "jazz-finger"


def test_the_bass_of_a_file_is_the_files(played: type[FakeSession], file: Path, run: Run, tmp_path: Path) -> None:
    save(file, PlaySettings("slap"))
    song = tmp_path / "a.mid"
    song.write_bytes(GOOD)
    run("play", "--file", song, "--loop", "1s:2.5", "--tempo", "80%")
    s = played.ran[-1]
    assert (s.preset, s.loop, s.tempo) == ("jazz-finger", (1.0, 2.5), 0.8) and load(file).preset == "slap"
    run("play", "--file", song, "--loop", "--quiet")
    assert played.ran[-1].loop == (0.0, 0.0)


def test_an_output_that_is_not_there_is_not_used(
    played: type[FakeSession], file: Path, run: Run, monkeypatch: pytest.MonkeyPatch
) -> None:
    save(file, PlaySettings(audio="Card, ALSA"))

    def gone(_backend: str, device: object) -> None:
        if device == "Card, ALSA":
            raise OutputLost("no Card")

    monkeypatch.setattr(outputs, "check_output", gone)
    status, _, err = run("play")
    assert status == 0 and "as remembered: no Card" in err and played.ran[-1].audio is None
    assert load(file).audio == "Card, ALSA", "it may be there the next time"


def test_a_place_that_cannot_be_written_is_a_warning(
    played: type[FakeSession], run: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "a").write_text("")
    monkeypatch.setenv("LIVEBASS_SETTINGS", str(tmp_path / "a" / "play.toml"))
    monkeypatch.setattr(play_settings, "load", lambda _: PlaySettings())
    monkeypatch.setattr("livebass.cli.play_settings.load", lambda _: PlaySettings())
    status, _, err = run("play", "-p", "slap")
    assert status == 0 and "not remembered" in err
    with pytest.raises(OutputError):
        save(tmp_path / "a" / "play.toml", PlaySettings("slap"))


@pytest.mark.parametrize(
    "arguments",
    [
        ("--loop",), ("--tempo", "50%"), ("--transport",), ("--learn", "nix"), ("--learn", "tone=200"),
        ("--learn", "tone=1", "--learn", "gain=1"), ("--metronome-port",), ("--metronome", "5"),
        ("--no-connect", "--midi", "x"), ("--client-name", "a:b"), ("--client-name", ""), ("--osc", "0"),
        ("--strings", "--backend", "portaudio"), ("--strings", "--audio", "0"), ("--file", "a.mid", "--tempo", "5"),
        ("--file", "a.mid", "--loop", "2s:1s"), ("--file", "a.mid", "--loop", "3"),
        ("--file", "a.mid", "--loop", "--transport"),
    ],
)  # fmt: skip
def test_options_that_do_not_go_together_are_one_line(
    played: type[FakeSession], run: Run, arguments: tuple[str, ...]
) -> None:
    refusal(run, "play", *arguments, status=2)
    assert not played.ran


def test_jacks_own_options_take_jack(played: type[FakeSession], file: Path, run: Run) -> None:
    save(file, PlaySettings(audio="Card, ALSA", midi="keys"))
    run("play", "--client-name", "low end", "--no-connect", "--strings", "--metronome", "90", "--metronome-port")
    s = played.ran[-1]
    assert (s.backend, s.audio, s.client, s.connect, s.strings) == ("jack", None, "low end", False, True)
    assert s.midi is None and s.metronome == 90 and s.metronome_port


def test_a_library_that_logs_doubles_no_line(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """As python-osc does; pytest has its own handlers."""
    monkeypatch.setattr(logging.getLogger(), "handlers", [])
    with log_to(Console(quiet=False), None):
        logging.debug("of a library")
        LOG.info("once")
    assert capsys.readouterr().err == "once\n" and not logging.getLogger().handlers
