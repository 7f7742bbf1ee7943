"""Takes that name their basses, on the command line: the sound, the messages, and the names not trusted."""

from __future__ import annotations

import json
import os
import re
import struct
import time
import tomllib
from pathlib import Path
from typing import Any

import mido
import numpy as np
import pytest
from support.command import Run, assert_one_clear_line
from support.engine import FakeEngine

from livebass.live.settings import Settings
from livebass.model.instrument import Instrument
from livebass.preset.load import kept_text, load_preset
from livebass.preset.revisions import toml_of
from livebass.score.reading import TAKE, read_score
from livebass.score.score import MIN_RATE
from livebass.score.smf import MARK
from livebass.score.takes import LONGEST, text_of, text_of_stroke

PRESETS = ["paper-fretless", "jazz-finger", "flatwound", "slap"]  # General MIDI has the second and the fourth


def take(*texts: tuple[int, str], of: str = TAKE) -> Path:
    """Writes a take with a note a second, and texts (s, text), as take.mid; two of them also change the program."""
    track = mido.MidiTrack([mido.MetaMessage("text", text=of)])
    events = [(0.0, mido.Message("program_change", program=33)), (9.0, mido.Message("program_change", program=36))]
    events += [(second, mido.MetaMessage("text", text=text)) for second, text in texts]
    for second in range(12):
        events += [(second + 0.1, mido.Message("note_on", note=40)), (second + 0.5, mido.Message("note_off", note=40))]
    last = 0
    for second, message in sorted(events, key=lambda event: event[0]):
        track.append(message.copy(time=round(1000 * second) - last))
        last = round(1000 * second)
    mido.MidiFile(type=0, ticks_per_beat=500, tracks=[track]).save("take.mid")
    return Path("take.mid").absolute()


@pytest.fixture
def played(fake: type[FakeEngine], monkeypatch: pytest.MonkeyPatch) -> list[Instrument]:
    """The basses that a render prepares: the first one and those chosen by programs."""
    found: list[Instrument] = []
    begin = fake.__init__

    def begin_(self: FakeEngine, instrument: Instrument, *rest: Any, **more: Any) -> None:
        found.append(instrument)
        begin(self, instrument, *rest, **more)

    def several(first: FakeEngine, basses: dict[int, Instrument]) -> FakeEngine:
        found.extend(basses.values())
        return first

    monkeypatch.setattr(fake, "__init__", begin_)
    monkeypatch.setattr("livebass.engine.render.Basses", several)
    mixed = lambda self, *given: ((block, None) for block in self.play(*given))  # noqa: E731
    monkeypatch.setattr(fake, "play_with_mix", mixed, raising=False)
    return found


def test_each_bass_of_a_take_has_a_program(fake: type[FakeEngine]) -> None:
    """Several basses with one program in other software stay distinct."""
    path = take(*((3 * k, text_of(name, {})) for k, name in enumerate([*PRESETS[:3], PRESETS[0]])))
    score = read_score(path, MIN_RATE)
    assert [(bass.frame / MIN_RATE, bass.preset) for bass in score.basses] == [
        (0.0, "paper-fretless"), (3.0, "jazz-finger"), (6.0, "flatwound"), (9.0, "paper-fretless"),
    ]  # fmt: skip
    assert score.program == 33 and [program for _, program in score.changes] == [127, 126, 33]
    assert score.on_one_bass().basses == () and score.on_one_bass().changes == []
    assert all((score.frames[1:] >= score.frames[:-1]).tolist())
    old = read_score(take(), MIN_RATE)
    assert old.basses == () and old.program == 33 and [program for _, program in old.changes] == [36]
    foreign = read_score(take((0, text_of("slap", {})), of="by somebody"), MIN_RATE)
    assert foreign.basses == () and foreign.program == 33


def test_render_plays_what_the_take_names(played: list[Instrument], run: Run) -> None:
    take((0, text_of("paper-fretless", {"capo": "2", "no_noise": "True"})), (3, text_of("flatwound", {"capo": "2"})))
    status, _, err = run("render", "take.mid")
    assert status == 0 and err.splitlines()[:2] == [
        "take.mid: played on paper-fretless (capo 2, no-noise)",
        "take.mid: played on flatwound (capo 2) from 3.0 s on",
    ]
    assert [bass.name for bass in played] == [load_preset(name).name for name in ("paper-fretless", "flatwound")]
    lowest = [load_preset(name).note_range[0] for name in ("paper-fretless", "flatwound")]
    assert [bass.note_range[0] for bass in played] == [note + 2 for note in lowest]
    status, out, _ = run("render", "take.mid", "--list")
    assert status == 0 and out.splitlines()[-1] == "paper-fretless, flatwound from 3.0 s"


def test_the_command_line_goes_before_the_take(played: list[Instrument], run: Run) -> None:
    take((0, text_of("paper-fretless", {"capo": "2", "a4": "432.0"})), (3, text_of("flatwound", {"capo": "2"})))
    assert run("render", "take.mid", "--capo", "0")[0] == 0
    assert played[0].note_range[0] == load_preset("paper-fretless").note_range[0] and played[0].a4 == 432
    played.clear()
    status, _, err = run("render", "take.mid", "-p", "slap")
    assert status == 0 and [bass.name for bass in played] == [load_preset("slap").name]
    assert played[0].a4 == 440 and err.count("\n") == 1


def own_preset() -> tuple[str, str]:
    """A preset file like another one, and its text as a take keeps it."""
    Path("base.toml").write_text('like = "slap"\n[neck]\nrelief = "0.5 mm"\n')
    Path("mine.toml").write_text('like = "base.toml"\nname = "Mine"\n[effects]\ndrive = 0.25\n')
    path = os.path.abspath("mine.toml")
    return path, kept_text(path)


def test_a_take_keeps_a_preset_file(played: list[Instrument], run: Run) -> None:
    """It plays on the bass as it was after the file, or one that it is like, has changed or is gone, with a word."""
    path, text = own_preset()
    take((0, text_of(path, {"capo": "2"}, text)))
    wanted = load_preset(path, capo=2)
    assert wanted.effects.drive == 0.25 and wanted.necks != load_preset("slap", capo=2).necks
    for change, why in (
        (lambda: None, ""),
        (lambda: Path("base.toml").write_text('like = "slap"\n'), "has changed since"),
        (lambda: Path("mine.toml").write_text("is = ["), "has changed since"),
        (lambda: [Path(name).unlink() for name in ("mine.toml", "base.toml")], "is not there any more"),
    ):
        change()
        played.clear()
        status, _, err = run("render", "take.mid")
        assert status == 0 and played[0] == wanted, why
        said = f"take.mid: {path} {why}: the take plays on the bass that it kept"
        assert (said in err.splitlines()) == bool(why) and ("kept" in err) == bool(why)


@pytest.mark.parametrize(
    "change, says",
    [
        ({"effects": {"response": "/etc/passwd"}}, "its response, /etc/passwd, is left out: there is no such file"),
        ({"effects": {"response": "//nowhere/a.wav"}}, "its response, //nowhere/a.wav, is left out"),
        ({"effects": {"response": "here.wav"}}, "its response, here.wav, is left out"),
        ({"player": {"keys": "/etc/passwd"}}, "its keys, /etc/passwd, is left out"),
        ({"player": {"keys": "mine.toml"}}, "its keys, mine.toml, is left out"),
        ({"effects": 3, "player": 4}, "must be a table"),
        ({"neck": {"relief": "9 km"}}, "neck.relief"),
        ("is = [", "not TOML"),
        ('[[string]]\nname = "E"\n', "name: missing"),
        ('like = "/etc/passwd"\n', "name: missing"),
        ('like = "slap"\n', "name: missing"),
    ],
)
def test_a_file_in_a_take_is_not_trusted(
    played: list[Instrument], run: Run, change: dict[str, Any] | str, says: str
) -> None:
    """It plays without the files that it may not name, or another bass does."""
    path, text = own_preset()
    Path("here.wav").write_bytes(b"RIFF")
    tables = tomllib.loads(text)
    Path("mine.toml").write_text("")
    take((0, text_of(path, {}, change if isinstance(change, str) else toml_of(tables | change))))
    status, _, err = run("render", "take.mid")
    assert status == 0 and says in err, err
    assert all(line.isprintable() for line in err.splitlines())
    own = "is left out" in says
    assert [bass.name for bass in played] == ["Mine" if own else load_preset("jazz-finger").name]
    assert own != err.splitlines()[0].endswith(": jazz-finger plays instead")


def test_a_long_preset_file_is_not_kept() -> None:
    assert "file" not in text_of("/a.toml", {}, "#" * LONGEST) and "file" in text_of("/a.toml", {}, "#" * 1000)


OUTSIDE = {
    "gone": ("/nowhere/mine.toml", "which is not there"),
    "a name of another version": ("tomorrow", "which this livebass does not have"),
    "no preset file": ("/etc/passwd", "which is no preset file, .toml"),
    "from where it is called": ("./mine.toml", "which is not there"),
    "another machine": ("//nowhere/mine.toml", "which is not there"),
    "a damaged preset": ("bad.toml", "not TOML"),
    "escapes and lines": ("\x1b[2Ja\nb", "which this livebass does not have"),
}


@pytest.mark.parametrize("kind", OUTSIDE)
def test_what_cannot_be_had_is_said_and_another_bass_plays(played: list[Instrument], run: Run, kind: str) -> None:
    preset, why = OUTSIDE[kind]
    Path("mine.toml").write_text('like = "slap"\nname = "Mine"\n')
    Path("bad.toml").write_text("is = [")
    if preset == "bad.toml":
        preset = os.path.abspath(preset)
    take((0, text_of(preset, {})), (3, text_of("flatwound", {})), (6, text_of(preset, {})))
    status, _, err = run("render", "take.mid")
    lines = err.splitlines()
    assert status == 0 and all(line.isprintable() for line in lines)
    assert lines[0].startswith("take.mid: was played on ") and why in lines[0]
    assert lines[0].endswith(": jazz-finger plays instead") and sum("was played on" in line for line in lines) == 1
    names = [load_preset("jazz-finger").name, load_preset("flatwound").name]
    assert [bass.name for bass in played[:2]] == names


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("capo", "99"), ("capo", "x"), ("tuning", "Q"), ("a4", "nan"), ("wheel", "up"), ("drive", "7"),
        ("temperament", "/etc/passwd"), ("temperament", "x.scl"), ("response", "/etc/passwd"), ("keys", "/etc/passwd"),
        ("keys", "none"), ("velocity_curve", "9:"), ("output", "/tmp/x.wav"), ("seed", "3"), ("\x1b", "\n"),
    ],
)  # fmt: skip
def test_options_of_a_take_that_do_not_fit_are_left_out(
    played: list[Instrument], run: Run, tmp_path: Path, name: str, value: str
) -> None:
    other = {"wheel": "slide"} if name == "capo" else {"capo": "2"}
    take((0, text_of("flatwound", {name: value} | other)))
    status, _, err = run("render", "take.mid")
    assert status == 0 and "which is left out" in err.splitlines()[0] and all(map(str.isprintable, err.splitlines()))
    assert played[0].name == load_preset("flatwound").name
    assert played[0].note_range[0] == 28 + 2 * (name != "capo")
    assert sorted(file.name for file in tmp_path.iterdir()) == ["take.mid", "take.wav"]


@pytest.mark.parametrize(
    "text",
    [
        "", "{", "[]", "3", "null", '{"preset": 3}', '{"preset": ""}', '{"capo": "2"}', '{"preset": "slap", "capo": 2}',
        "[" * 60_000, json.dumps({"preset": "x" * 100_000}), "1" * 9000,
    ],
    ids=lambda text: text[:30],
)  # fmt: skip
def test_texts_that_name_nothing_are_left_out(played: list[Instrument], run: Run, text: str) -> None:
    take((0, MARK + text))
    status, _, err = run("render", "take.mid")
    assert status == 0 and err.splitlines()[0] == "take.mid: a text at 0.0 s, which names no bass, is left out"
    assert [bass.name for bass in played] == [load_preset("jazz-finger").name, load_preset("slap").name]


def test_a_take_of_more_basses_than_programs(played: list[Instrument], run: Run) -> None:
    take(*((k / 50, text_of(f"bass {k}", {})) for k in range(300)))
    status, _, err = run("render", "take.mid")
    assert status == 0 and len(err.splitlines()) < 110 and re.search("take.mid: and [0-9]+ more remarks", err)
    assert " and 171 other texts, which name no bass, are left out" in err
    score = read_score("take.mid", 48000)
    assert len({bass.program for bass in score.basses}) == len(score.basses) == 128


@pytest.mark.parametrize(
    "text", [MARK, MARK + "{}", text_of("slap", {}), text_of("x" * 2000, {})], ids=lambda text: text[:30]
)
def test_a_take_of_endless_texts_is_told_in_few_lines(played: list[Instrument], run: Run, text: str) -> None:
    take(*((k / 50, text) for k in range(1200)))
    status, _, err = run("render", "take.mid")
    assert status == 0 and len(err.splitlines()) < 110 and len(err) < 110_000
    assert "of 1200 texts that name basses only the first 1000 count" in err.splitlines()[0]


def test_more_texts_than_any_take_has_are_refused(run: Run) -> None:
    text = text_of_stroke(12, 0, 0).encode()
    stroke = b"\0\xff\x01" + bytes([len(text)]) + text
    track = b"\0\xff\x01\x15" + TAKE.encode() + stroke * 500_001 + b"\0\xff\x2f\0"
    head = b"MThd" + struct.pack(">IHHH", 6, 0, 1, 480)
    Path("take.mid").write_bytes(head + b"MTrk" + struct.pack(">I", len(track)) + track)
    began = time.process_time()
    status, _, err = run("render", "take.mid")
    assert_one_clear_line(status, err, (1,))
    assert "500001 texts of livebass, more than 500000" in err and time.process_time() - began < 5


def settings_of(run: Run, monkeypatch: pytest.MonkeyPatch, *arguments: object) -> Settings:
    """The settings `play` uses for these arguments."""
    found: list[Settings] = []

    class Session:
        def __init__(self, settings: Settings, status: object) -> None:
            found.append(settings)
            raise OSError("no sound here")

    monkeypatch.setattr("livebass.live.session.Session", Session)
    status, _, err = run("play", "--quiet", *arguments)
    assert_one_clear_line(status, err.splitlines()[-1], (1,))
    return found[0]


def test_play_takes_the_basses_of_a_take_and_tells_them_on(
    fake: type[FakeEngine], run: Run, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The next take gets them too; the options of the command line change these and all others."""
    path = take((0, text_of("paper-fretless", {"capo": "2"})), (3, text_of("flatwound", {"capo": "2"})))
    settings = settings_of(run, monkeypatch, "--file", path, "--a4", "441", "--wheel", "slide")
    assert settings.preset == "paper-fretless" and settings.programs == {33: "paper-fretless", 127: "flatwound"}
    lowest = load_preset("flatwound").note_range[0]
    bass, other = settings.load("flatwound"), settings.load("slap")
    assert (bass.note_range[0], bass.a4) == (lowest + 2, 441) and (other.note_range[0], other.a4) == (lowest, 441)
    assert settings.given("flatwound") == {"capo": "2", "a4": "441.0", "wheel": "slide"}
    assert settings.given("slap") == {"a4": "441.0", "wheel": "slide"}
    assert settings.read is not None and [bass.frame for bass in settings.read(44_100).basses] == [0, 3 * 44_100]
    alone = settings_of(run, monkeypatch, "--file", path, "-p", "slap")
    assert alone.preset == "slap" and alone.read is not None and alone.read(48_000).changes == []
    assert alone.given("slap") == {} and settings_of(run, monkeypatch, "--demo", "techniques").given("slap") == {
        "keys": "modo"
    }


def test_every_option_that_changes_a_bass_is_told_and_taken(
    played: list[Instrument], run: Run, monkeypatch: pytest.MonkeyPatch
) -> None:
    """In its original form: `play` loads the same bass that `render` builds from the text."""
    import soundfile

    from livebass.preset.keymap import key_map_text, load_key_map

    soundfile.write("room.wav", np.array([0.1, 0.05]), 48_000)
    Path("mine.toml").write_text(key_map_text(load_key_map("modo-12")))
    Path("room.scl").write_text("x\n12\n" + "".join(f"{100 * k}.0\n" for k in range(1, 13)))
    options = ["--tuning", "D1 A1 D2 G2", "--capo", "1", "--a4", "432Hz", "--temperament", "./room.scl", "--no-noise"]
    options += ["--keys", "./mine.toml", "--velocity-curve", "1:1,50:80,127:127", "--wheel", "slide"]
    options += ["--compression", "0.3", "--drive", "0.25", "--response", "room.wav"]
    options += ["--clean-blend", "0.5", "--eq-bass", "-3dB", "--eq-low-mid", "4", "--eq-low-mid-frequency", "0.25kHz"]
    options += ["--cabinet", "closed-8x10", "--limiter", "off"]
    settings = settings_of(run, monkeypatch, "-p", "flatwound", *options)
    given = settings.given("flatwound")
    assert len(given) == 17 and json.loads(text_of("flatwound", given).removeprefix(MARK))["response"].startswith("/")
    take((0, text_of("flatwound", given)))
    os.mkdir("elsewhere")
    monkeypatch.chdir("elsewhere")
    status, _, err = run("render", "../take.mid", "--tail", "0")
    assert status == 0, err
    wanted = settings.instrument
    assert played[0].strings == wanted.strings and played[0].effects == wanted.effects != load_preset("slap").effects
    assert played[0].player.keys.keys == wanted.player.keys.keys
    assert played[0].player.velocity_curve == wanted.player.velocity_curve and played[0].player.wheel == "slide"
    assert (played[0].player.floor_noise, played[0].a4) == (wanted.player.floor_noise, 432)
