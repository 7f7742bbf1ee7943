"""The command line in normal use, and the public interface."""

from __future__ import annotations

import json
import platform
import subprocess
import sys
from importlib import metadata
from pathlib import Path
from types import SimpleNamespace
from typing import NoReturn

import numpy as np
import pytest
import soundfile
from support.command import GOOD, NOTE, Run, assert_one_clear_line, cli_text, command, python, refusal, song
from support.engine import FakeEngine
from support.places import ROOT

from livebass import Instrument, __version__, load_preset
from livebass.compiling import store
from livebass.engine import render as render_module
from livebass.rows.parts import NOISES
from livebass.rows.units import OFF


def test_render_a_file(fake: type[FakeEngine], run: Run, tmp_path: Path) -> None:
    (tmp_path / "song.mid").write_bytes(GOOD)
    status, out, err = run("render", "song.mid", "-o", "out.wav", "--rate", 44100)
    assert (status, out) == (0, "")
    assert err.startswith("out.wav: 5 notes (2 transposed, 1 dropped), 1.00 s, ") and "times real time" in err
    info = soundfile.info("out.wav")
    assert (info.samplerate, info.channels, info.subtype) == (44100, 1, "PCM_24")


@pytest.mark.parametrize(
    ("arguments", "file", "subtype"),
    [
        (["--note", "G2"], "G2.wav", "PCM_24"),
        (["--note", "c#1", "-p", "five-string", "--format", "flac", "--bits", "16"], "C#1.flac", "PCM_16"),
        (["song.mid", "--format", "ogg"], "song.ogg", "VORBIS"),
        (["song.mid", "--bits", "float", "--channel", "1", "-q", "live", "--tail", "100ms"], "song.wav", "FLOAT"),
        (["song.mid", "-o", "x.FLAC", "--modes", "1e2", "--contact-rate", "1.5MHz"], "x.FLAC", "PCM_24"),
    ],
)
def test_names_and_formats(
    fake: type[FakeEngine], run: Run, tmp_path: Path, arguments: list[str], file: str, subtype: str
) -> None:
    (tmp_path / "song.mid").write_bytes(GOOD)
    assert run("render", *arguments)[0] == 0
    assert soundfile.info(file).subtype == subtype


def test_stems_add_up_to_the_mix_bit_for_bit(fake: type[FakeEngine], run: Run) -> None:
    assert run("render", "--note", "E1", "--stems", "--bits", "float", "--gain", "-3dB", "-o", "e.wav")[0] == 0
    stems = [soundfile.read(f"e.{name}.wav", dtype="float32")[0] for name in "EADG"]
    total = stems[0].copy()
    for stem in stems[1:]:
        total += stem
    assert total.tobytes() == soundfile.read("e.wav", dtype="float32")[0].tobytes()
    assert np.max(np.abs(stems[0])) == pytest.approx(0.1 * 10 ** (-3 / 20), rel=1e-3)


def test_clipping_is_said(fake: type[FakeEngine], run: Run) -> None:
    fake.peak = 1.0
    err = run("render", "--note", "E1", "--gain", "2")[2]
    assert "samples clipped: try --gain -1" in err


def test_a_motion_that_was_scaled_back_is_said(fake: type[FakeEngine], run: Run) -> None:
    assert "scaled back" not in run("render", "--note", "E1")[2]
    fake.weakened = 3
    assert ", 3 times a motion was scaled back" in run("render", "--note", "E1")[2]


def test_a_sound_that_is_not_a_number(fake: type[FakeEngine], run: Run, tmp_path: Path) -> None:
    fake.peak = float("nan")
    assert "not finite" in refusal(run, "render", "--note", "E1", status=1) and not list(tmp_path.iterdir())


def test_all_presets(fake: type[FakeEngine], run: Run, tmp_path: Path) -> None:
    from livebass.preset.load import preset_names

    status, _, err = run("render", "--all-presets", "demos", "--format", "flac", "--rate", 22050)
    assert status == 0
    assert sorted(p.name for p in (tmp_path / "demos").iterdir()) == sorted(f"{n}.flac" for n in preset_names())
    assert err.count("\n") == len(preset_names())


def test_presets(run: Run, tmp_path: Path) -> None:
    listed = cli_text(run, "presets", "list")
    assert "jazz-finger" in listed and "slap" in listed
    (tmp_path / "mine.toml").write_text(cli_text(run, "presets", "show", "slap"))
    assert "good" in cli_text(run, "presets", "check", tmp_path / "mine.toml")
    assert cli_text(run, "presets", "check", "paper-g").endswith(", string G, 20 frets\n")
    assert "scale_length" in cli_text(run, "presets", "keys")


def test_simulate(run: Run, tmp_path: Path) -> None:
    arguments = ["--apex", "3.6mm", "--at", "0.64", "--duration", "20 ms", "-q", "live", "-o", tmp_path / "d"]
    status, _, err = run("simulate", *arguments)
    assert status == 0, err
    assert {p.name for p in (tmp_path / "d").iterdir()} == {"displacement.wav", "contacts.csv", "result.npz"}


def test_bench(monkeypatch: pytest.MonkeyPatch, run: Run, tmp_path: Path) -> None:
    bench = SimpleNamespace(bench_render=lambda _: {"engine": 0.2}, table=lambda result: f"table {result}")
    monkeypatch.setitem(sys.modules, "livebass.lab.bench.render", bench)
    monkeypatch.setattr("livebass.compiling.library.is_cached", lambda: True)
    assert "table" in cli_text(run, "bench", "render", "--json", tmp_path / "b.json")
    assert json.loads((tmp_path / "b.json").read_text()) == {"engine": 0.2}
    refusal(run, "bench", "render", "--json", tmp_path, status=1)


@pytest.mark.parametrize(
    "arguments",
    [["--help"], *(pytest.param(a, marks=pytest.mark.slow) for a in (["render", "--help"], ["--version"])),
     ["play", "--help"], ["presets", "list"]],
)  # fmt: skip
def test_help_starts_fast_and_without_kernels(arguments: list[str]) -> None:
    code = (
        "import sys; from livebass.cli import main as cli; status = cli.run(sys.argv[1:]);"
        "sys.exit(status or ('numba' in sys.modules) * 9)"
    )
    done = python(code, *arguments, timeout=60)
    assert (done.returncode, done.stderr) == (0, "") and done.stdout


def test_the_version_says_what_a_bug_report_needs(run: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    version, system, packages = cli_text(run, "--version").splitlines()
    assert version == f"livebass, version {__version__}", "programs may read this line"
    assert f"Python {platform.python_version()}, kernels {store.level()}" in system and platform.system() in system
    named = dict(package.split(" ") for package in packages.split(", "))
    assert named["numpy"] == np.__version__ and named["numba"] == metadata.version("numba")
    assert "soundfile" in named and "pytest" not in named and "matplotlib" not in named

    def unknown(name: str) -> NoReturn:
        raise metadata.PackageNotFoundError(name)

    monkeypatch.setattr(store, "level", store.level.__wrapped__)  # not as it was found before
    monkeypatch.setenv("LIVEBASS_LEVEL", "sparc")
    monkeypatch.setattr(metadata, "requires", unknown)  # a source tree that was never installed
    version, system, packages = cli_text(run, "--version").split("\n")[:3]
    assert "no kernels: LIVEBASS_LEVEL must be" in system and packages == ""


def test_a_note_loads_no_compiler_and_no_reader_of_music(tmp_path: Path) -> None:
    code = (
        "import sys; from livebass.cli import main as cli; status = cli.run(sys.argv[1:]);"
        "print(sorted({'numba', 'llvmlite', 'livebass.score.reading', 'zipfile', 'csv'} & set(sys.modules)))"
    )
    note = ["render", "--note", "E2", "--duration", "0.1", "--tail", "0", "-q", "live", "-o", "e.wav"]
    done = python(code, *note)
    assert done.stdout == "[]\n" and (tmp_path / "e.wav").exists(), done.stderr


def test_the_module_runs() -> None:
    done = command("render", "--note", "H2")
    assert_one_clear_line(done.returncode, done.stderr, (2,))
    done = command()
    assert done.returncode == 2 and "Commands:" in done.stderr


@pytest.mark.parametrize("script", ["example_note.py", "example_song.py"])
def test_examples_run(tmp_path: Path, script: str) -> None:
    line = [sys.executable, str(ROOT / "tools" / script)]
    done = subprocess.run(line, cwd=tmp_path, capture_output=True, text=True, timeout=300)
    assert (done.returncode, done.stderr) == (0, "")
    assert done.stdout


def test_a_file_is_played_on_the_bass_it_asks_for(run: Run, tmp_path: Path) -> None:
    """Its first program chooses the preset, unless an option names one; unknown programs leave the default."""
    for number, (programs, options, expected) in enumerate(
        (
            (b"\x24", (), "slap"),
            (b"\x24\x21\x21", ("-p", "muted"), "muted"),
            (b"\x24\x24\x10", (), "slap"),
            (b"\x27", (), "jazz-finger"),
            (b"\x18", (), "jazz-finger"),
        )
    ):
        file, heard, wanted = (tmp_path / f"{number}{ending}" for ending in (".mid", ".wav", "-wanted.wav"))
        file.write_bytes(song(*[b"\x00\xc0" + bytes([program]) + NOTE for program in programs]))
        how = ("-q", "live", "--tail", "0", "--channel", "1")
        assert run("render", file, "-o", heard, *how, *options)[0] == 0
        assert run("render", file, "-o", wanted, *how, "-p", expected)[0] == 0
        assert heard.read_bytes() == wanted.read_bytes(), (programs, expected)


def test_a_program_in_mid_file_changes_the_bass(run: Run, tmp_path: Path) -> None:
    """It changes at its frame, keeping the controllers; the old bass's strings ring out."""
    louder = b"\x00\xb0\x07\x40"
    (tmp_path / "a.mid").write_bytes(song(b"\x00\xc0\x21", louder, NOTE, b"\x81\x70\xc0\x24", NOTE))
    (tmp_path / "b.mid").write_bytes(song(b"\x00\xc0\x21", louder, NOTE))
    (tmp_path / "c.mid").write_bytes(song(b"\x00\xc0\x24", louder, NOTE))
    how = ("-q", "live", "--bits", "float")
    sounds = {}
    for name in "abc":
        status, _, err = run("render", tmp_path / f"{name}.mid", "-o", f"{name}.wav", *how)
        assert status == 0
        sounds[name] = soundfile.read(f"{name}.wav", dtype="float32")[0]
        if name == "a":
            said, summary = err.splitlines()
            assert said.endswith("a.mid: program 37 at 0.5 s: played on slap from there") and ": 2 notes (" in summary
    n = min(len(sounds["b"]), 24_000) - 960  # its end fades out
    assert np.array_equal(sounds["a"][:n], sounds["b"][:n])
    rest, alone = sounds["a"][24_000:], sounds["c"]
    n = min(len(rest), len(alone)) - 960
    assert np.abs(alone).max() > 0.01 and np.abs(rest[:n] - alone[:n]).max() < 2e-3, (
        "a string rings out, a finger leaves"
    )
    assert np.abs(sounds["b"]).max() > 0.01
    listed = cli_text(run, "render", tmp_path / "a.mid", "--list").splitlines()
    assert len(listed) == 3 and listed[-1] == "jazz-finger, slap from 0.5 s"
    assert len(cli_text(run, "render", tmp_path / "a.mid", "--list", "-p", "slap").splitlines()) == 2
    with_stems = run("render", tmp_path / "a.mid", "-o", "s.wav", "--stems", *how)
    stems = [soundfile.read(f"s.{name}.wav", dtype="float32")[0] for name in "EADG"]
    assert with_stems[0] == 0 and np.array_equal(stems[0] + stems[1] + stems[2] + stems[3], sounds["a"])


def test_key_switches_are_listed_and_notes_without_a_string_counted(run: Run, tmp_path: Path) -> None:
    """A controller with six strings plays a bass of four: its two lowest channels have no string."""
    mode, played = b"\x00\xb0\x7e\x06", b"\x00\x94\x28\x64\x00\x95\x28\x64\x00\x93\x1c\x64"
    (tmp_path / "six.mid").write_bytes(song(b"\x00\xc0\x21", mode, played))
    assert ": 1 note (0 transposed, 2 dropped)" in run("render", tmp_path / "six.mid", "-o", "six.wav", "-q", "live")[2]
    switch = b"\x00\x90\x0a\x64\x10\x80\x0a\x40"
    (tmp_path / "keys.mid").write_bytes(song(b"\x00\xc0\x21", switch, switch, NOTE, b"\x00\x90\x0c\x64"))
    head, row = cli_text(run, "render", tmp_path / "keys.mid", "--list").splitlines()
    assert head.split() == ["channel", "track", "program", "notes", "switches", "range", "played"]
    assert row.split() == ["1", "-", "34", "1", "3", "E2", "yes", "bass", "program"]
    _, row = cli_text(run, "render", tmp_path / "keys.mid", "--list", "--keys", "modo-12").splitlines()
    assert row.split()[3:8] == ["3", "1", "A#-1", "to", "E2"]
    assert ", 3 key switches, " in run("render", tmp_path / "keys.mid", "-o", "keys.wav", "-q", "live")[2]


def test_the_list_of_presets_has_their_programs(run: Run) -> None:
    lines = {line.split()[0]: line.split()[1:3] for line in cli_text(run, "presets", "list").splitlines()}
    assert [lines[name][0] for name in ("upright", "fretless", "slap", "slap-impulse")] == ["33", "36", "37", "38"]
    assert not lines["muted"][0].isdigit() and not lines["one-contact"][0].isdigit()


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (["--note", "B0"], "--note B0: Jazz bass, fingers has E1 to D#4; -p five-string plays it"),
        (["--note", "D1"], "Jazz bass, fingers has E1 to D#4; -p drop-d plays it"),
        (["--note", "E1", "-p", "paper-g"], "has G2 to D#4; -p jazz-finger plays it"),
        (["--note", "A0", "-p", "five-string"], "has B0 to D#4; no preset that comes with livebass has it"),
        (["--note", "E4"], "has E1 to D#4; -p five-string-active plays it"),
        (["--note", "C#5"], "has E1 to D#4; no preset that comes with livebass has it"),
        (["--note", "E1", "--capo", "3"], "Jazz bass, fingers has G1 to D#4; -p jazz-finger plays it"),
        (["--note", "C1", "--tuning", "drop-d"], "Jazz bass, fingers has D1 to D#4; -p five-string plays it"),
        (["--note", "E1", "--tuning", "dropped"], "'--tuning': must be notes from the lowest string on"),
        (["--note", "E1", "--a4", "500"], "'--a4': must be from 380 to 480 Hz, not '500'"),
        (["--note", "E1", "--temperament", "jsut"], "'--temperament': must be equal, just, pythagorean"),
        (["--note", "E1", "--temperament", "1,2,300"], "'--temperament': must be equal, just, pythagorean"),
        (["--note", "E1", "--capo", "-1"], "'--capo': must be a whole number from 0 to 31, not -1"),
    ],
)
def test_a_note_that_the_bass_does_not_have_is_refused(
    run: Run, tmp_path: Path, arguments: list[str], says: str
) -> None:
    assert says in refusal(run, "render", *arguments, status=2) and not list(tmp_path.iterdir())


def test_a_low_b_sounds_as_one(run: Run, tmp_path: Path) -> None:
    file = tmp_path / "b.wav"
    assert run("render", "--note", "B0", "-p", "five-string", "-q", "live", "--duration", "1s", "-o", file)[0] == 0
    sound, rate = soundfile.read(file)
    spectrum = np.abs(np.fft.rfft(sound[: 2 * rate // 3] * np.hanning(2 * rate // 3), 8 * rate))
    assert 20 + np.argmax(spectrum[20 * 8 : 45 * 8]) / 8 == pytest.approx(30.87, abs=0.3)


@pytest.mark.parametrize(
    ("options", "says"),
    [
        (["--tuning", "E1 A1"], '--tuning "E1 A1": 2 notes for 4 strings, E1 A1 D2 G2, in jazz-finger.toml'),
        (["--temperament", "-1,2"], '--temperament "-1,2": 2 values; there must be 12, C first, or one'),
        (["--capo", "20"], "--capo must be from 0 to 19, as the neck has 20 frets, not 20, in jazz-finger.toml"),
    ],
)
@pytest.mark.parametrize("command", [["render", "--note", "G2"], ["play"], ["export", "sfz", "--size"]])
def test_a_tuning_that_does_not_fit_is_one_clear_line(
    run: Run, tmp_path: Path, command: list[str], options: list[str], says: str
) -> None:
    assert says in refusal(run, *command, "-p", "jazz-finger", *options, status=1) and not list(tmp_path.iterdir())


def test_options_tune_as_the_keys_of_a_file_do(run: Run, tmp_path: Path) -> None:
    text = cli_text(run, "presets", "show", "slap").replace(
        "[neck]", 'tuning = "drop-d"\ncapo = 1\na4 = 432\ntemperament = "just"\n[neck]', 1
    )
    (tmp_path / "mine.toml").write_text(text)
    note = ("render", "--note", "D#1", "-q", "live", "--duration", "100ms", "--tail", "0", "-o")
    assert run(*note, tmp_path / "a.wav", "-p", tmp_path / "mine.toml")[0] == 0
    options = ("--tuning", "drop-d", "--capo", "1", "--a4", "432Hz", "--temperament", "Just")
    assert run(*note, tmp_path / "b.wav", "-p", "slap", *options)[0] == 0
    assert (tmp_path / "a.wav").read_bytes() == (tmp_path / "b.wav").read_bytes()
    default = ("-p", tmp_path / "mine.toml", "--tuning", "standard", "--capo", "0", "--a4", "440")
    assert "has E1 to" in refusal(run, *note, "c.wav", *default, status=2)


def test_a_string_is_not_written_into_a_tuned_preset(run: Run, tmp_path: Path) -> None:
    """The string is measured as it sounds: the preset's tuning keys would tune it once more."""
    text = cli_text(run, "presets", "show", "slap").replace("[neck]", "capo = 1\na4 = 442\n[neck]", 1)
    (tmp_path / "mine.toml").write_text(text)
    err = refusal(run, "identify", "a.wav", "-p", "./mine.toml", "-o", "new.toml", status=2)
    assert "mine.toml: its capo, a4 would tune the new string again: leave out -o" in err


def low_song(*notes: int) -> bytes:
    return song(b"\x00\xc0\x21", *(b"\x00\x90" + bytes([n, 100, 0x60, 0x80, n, 0]) for n in notes))


@pytest.mark.parametrize(
    ("notes", "options", "says"),
    [
        ((28, 40), (), "dBFS\n"),
        ((27, 40), (), ", 1 note lies below E1 and sounds an octave higher; -p drop-d plays it\n"),
        ((23, 26, 40), (), ", 2 notes lie below E1 and sound an octave higher; -p five-string plays them\n"),
        ((23, 24), ("-p", "five-string"), "dBFS\n"),
        ((28, 30), ("-p", "paper-g"), ", 2 notes lie below G2 and sound octaves higher; -p jazz-finger plays them\n"),
        ((27, 40), ("-p", "drop.toml"), ", 1 note lies below E1 and is left out; -p drop-d plays it\n"),
    ],
)
def test_the_summary_says_which_notes_lie_too_low(
    fake: type[FakeEngine], run: Run, tmp_path: Path, notes: tuple[int, ...], options: tuple[str, ...], says: str
) -> None:
    (tmp_path / "song.mid").write_bytes(low_song(*notes))
    text = cli_text(run, "presets", "show", "jazz-finger").replace("[player]", '[player]\nout_of_range = "drop"', 1)
    (tmp_path / "drop.toml").write_text(text)
    status, _, err = run("render", "song.mid", "-o", "out.wav", *options)
    assert status == 0 and err.endswith(says), err
    line = f"song.mid: {says[2:]}" if says.startswith(", ") else ""
    _, _, err = run("play", "--file", "song.mid", "--log", "nowhere/log", *options)  # an error before it plays
    assert err.startswith(f"{line}livebass: error: nowhere/log"), err


def test_the_summary_counts_key_switches_of_another_instrument(
    fake: type[FakeEngine], run: Run, tmp_path: Path
) -> None:
    switch = b"\x00\x90\x60\x64\x05\x80\x60\x00"
    for count, said in ((1, "1 key switch"), (2, "2 key switches")):
        (tmp_path / "song.mid").write_bytes(song(b"\x00\xc0\x21", *[switch + NOTE] * count))
        status, _, err = run("render", "song.mid", "-o", "out.wav")
        assert status == 0 and err.endswith(f"dBFS, {said} of another instrument left out\n"), err


def test_a_file_is_listed(run: Run, tmp_path: Path) -> None:
    (tmp_path / "song.mid").write_bytes(low_song(28, 40))
    (tmp_path / "piano.mid").write_bytes(song(b"\x00\xff\x03\x05Piano\x00\x90\x3c\x64\x10\x80\x3c\x00"))
    head, row = cli_text(run, "render", "song.mid", "--list").splitlines()
    assert head.split() == ["channel", "track", "program", "notes", "range", "played"]
    assert row.split() == ["1", "-", "34", "2", "E1", "to", "E2", "yes", "bass", "program"]
    for options, why in (((), "the only part"), (("--channel", "1"), "as asked for")):
        row = cli_text(run, "render", "piano.mid", "--list", *options).splitlines()[1]
        assert row.split() == ["1", "Piano", "-", "1", "C4", "yes", *why.split()]
    assert sorted(p.name for p in tmp_path.iterdir()) == ["piano.mid", "song.mid"]
    refusal(run, "render", "--note", "E1", "--list", status=2)


def test_what_a_file_lacks_is_said_before_it_is_played(fake: type[FakeEngine], run: Run, tmp_path: Path) -> None:
    named = song(b"\x00\xff\x03\x06E-Bass", NOTE)
    (tmp_path / "named.mid").write_bytes(named[:10] + b"\0\3" + named[12:])
    (tmp_path / "synth.mid").write_bytes(song(b"\x00\xc0\x26", NOTE))
    (tmp_path / "slap.mid").write_bytes(song(b"\x00\xc0\x24", NOTE))
    (tmp_path / "finger.mid").write_bytes(song(b"\x00\xc0\x21", NOTE))
    _, _, err = run("render", "named.mid", "-o", "out.wav")
    first, second, summary = err.splitlines()
    assert first == "named.mid: has 1 of the 3 tracks that its header promises"
    assert second.endswith('33 to 40: plays the track called "E-Bass"') and summary.startswith("out.wav: ")
    _, _, err = run("render", "synth.mid", "-o", "out.wav")
    first, _ = err.splitlines()
    assert first == "synth.mid: program 39 chooses no bass, 33 to 38 do: played on jazz-finger"
    assert run("render", "slap.mid", "-o", "out.wav")[2].startswith("slap.mid: program 37: played on slap\n")
    for options in (("synth.mid", "-p", "muted"), ("slap.mid", "-p", "muted"), ("finger.mid",)):
        _, _, err = run("render", *options, "-o", "out.wav")
        assert len(err.splitlines()) == 1


def test_options_of_the_hands_reach_the_bass(
    run: Run, fake: type[FakeEngine], monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    """Also for every preset of --all-presets; the techniques' phrases press the keys of the usual map."""
    played: list[Instrument] = []

    class Listening(fake):  # type: ignore[misc, valid-type]
        def __init__(self, instrument: Instrument, *rest: object, **more: object) -> None:
            played.append(instrument)
            super().__init__(instrument, *rest, **more)

    monkeypatch.setattr(render_module, "Engine", Listening)
    hands = ("--keys", "modo-12", "--velocity-curve", "0.5", "--wheel", "slide", "--no-noise", "-q", "live")
    for source in (("--note", "E1"), ("--demo",), ("--demo", "techniques")):
        assert run("render", *source, *hands, "-o", tmp_path / "a.wav")[0] == 0
    maps = [bass.player.keys.name for bass in played]
    assert maps == ["modo-12", "modo-12", "modo"]
    assert run("render", "--all-presets", tmp_path / "all", *hands)[0] == 0
    assert len(played) > 6 and {bass.player.keys.name for bass in played[3:]} == {"modo-12"}
    assert {(bass.player.velocity_curve, bass.player.wheel) for bass in played} == {(0.5, "slide")}
    assert {getattr(bass.player, name) for bass in played for name in NOISES} == {OFF}
    played.clear()
    assert run("render", "--note", "E1", "-o", tmp_path / "a.wav")[0] == 0
    assert played == [load_preset("jazz-finger")]
