"""`livebass play`: takes, log, status line, preset switches, the terminal, and machines without sound."""

from __future__ import annotations

import gc
import json
import logging
import os
import platform
import signal
import subprocess
import sys
import threading
import weakref
from dataclasses import replace
from functools import partial
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
import soundfile
from support.command import Run, assert_one_clear_line, module_paths, python_output, refusal, run_python
from support.costs import quick, slow
from support.fakejack import PERIOD, fake_jack
from support.hands import of_any
from support.jack import wait_for
from support.live import (
    QUICK,
    RATE,
    bass_of,
    jack_session,
    next_line,
    offline,
    performer_of,
    play,
    played_on,
    session_of,
    synth_and_device,
)
from support.messages import messages_of

from livebass import QUALITIES, Instrument, Quality, load_preset, preset_names
from livebass.cli.console import Console, LogFile, log_to
from livebass.cli.help import page_text
from livebass.engine.image import image
from livebass.files.whole import OutputError
from livebass.live import keyboard, session, terminal
from livebass.live.desk import LEAD, Desk
from livebass.live.fake import FakeDevice
from livebass.live.jack import JackOutput
from livebass.live.keyboard import DIGITS, NOTES, STROKES, WAYS, TerminalKeys
from livebass.live.midi import let_go
from livebass.live.portaudio import PortAudioOutput
from livebass.live.presets import PresetSwitch
from livebass.live.recording import MidiRecorder, Recorder
from livebass.live.session import Session
from livebass.live.settings import Settings, Summary
from livebass.live.status import Status
from livebass.live.synth import Gauge, LiveBass, Meters, Reading, Synth, median_load, strings
from livebass.live.thread.records import HISTOGRAM
from livebass.model.keymap import MODO, MODO_12
from livebass.preset.programs import PROGRAMS
from livebass.rows.techniques import PARAMETER
from livebass.score.phrases import demo_score
from livebass.score.score import MIN_RATE, Score, score_of
from livebass.system.extras import install

# ---- switching presets during play


FINGER, PICK, SLAP = 33, 34, 36  # General MIDI programs as sent, from 0
NO_SERVER = {"JACK_DEFAULT_SERVER": "nobody"}


def test_a_program_change_brings_its_preset_and_keeps_the_controllers() -> None:
    synth, device = synth_and_device("jazz-finger")
    changes = PresetSwitch(synth, "jazz-finger", QUALITIES["live"])
    messages = ((0xB0, 7, 64), (0xB0, 11, 100), (0xE0, 0, 96), (0xB0, 64, 127), (0xB0, 16, 127))
    for message in (*messages, (0xB0, 101, 0), (0xB0, 100, 0), (0xB0, 6, 4)):
        synth.send(*message)
    synth.send(0xC0, SLAP)
    device.block(64)
    old = bass_of(synth)
    assert next_line(changes, device) == "preset slap, quality live"
    new = bass_of(synth)
    assert new is not old
    device.block(64)
    for name in ("volume", "expression", "wheel", "pedal"):
        assert of_any(new.engine.performer)[name] == of_any(old.engine.performer)[name] != 0
    for v in new.engine.voices:
        assert v.record["gain"][0] == pytest.approx((64 * 100 / 127**2) ** 2)
        assert v.record["tuned"][0] == pytest.approx(2 ** (4 * 0.5 / 12), rel=1e-3)
    assert new.engine.performer["position"] == new.engine.performer["player"]["pluck_farthest"]
    changes.close()


def test_programs_choose_the_bass_that_fits_and_others_are_said_once(caplog: pytest.LogCaptureFixture) -> None:
    caplog.set_level(logging.INFO, "livebass")
    assert set(PROGRAMS.values()) <= set(preset_names()) and list(PROGRAMS) == [33, 34, 35, 36, 37, 38]
    synth, device = synth_and_device("jazz-finger")
    changes = PresetSwitch(synth, "jazz-finger", QUALITIES["live"])
    for message in ((0xB0, 0, 1), (0xC0, 0), (0xC0, 9), (0xC0, 0), (0xC0, 9)):
        synth.send(*message)
        device.block(64)
        assert changes.turn() is None
    assert changes.wanted == changes.playing == ("jazz-finger", "live")
    assert caplog.messages == [f"program {number} chooses no bass: 33 to 38 do" for number in (1, 10)]
    for number, name in PROGRAMS.items():
        synth.send(0xC0, number - 1)
        device.block(64)
        changes._answer_program_changes()
        assert changes.wanted == (name, "live")
    changes.close()


def test_the_last_wish_counts() -> None:
    synth, device = synth_and_device("jazz-finger")
    changes = PresetSwitch(synth, "jazz-finger", QUALITIES["live"])
    for _ in range(3):
        changes.next_preset()
        changes.turn()
    changes.next_quality()
    assert next_line(changes, device).endswith("quality studio")
    names = preset_names()
    assert changes.playing == (names[(names.index("jazz-finger") + 3) % len(names)], "studio")
    changes.close()


def test_basses_that_were_replaced_are_gone(monkeypatch: pytest.MonkeyPatch) -> None:
    """After each change of preset and quality only one bass is alive, without waiting for the garbage collector."""
    made: list[weakref.ref[object]] = []

    class Watched(LiveBass):
        def __init__(self, instrument: Instrument, quality: Quality, rate: int) -> None:
            super().__init__(instrument, quality, rate)
            parts = (self, self.engine, *self.engine.pools, self.engine.voices[0], self.memory)
            made.extend(weakref.ref(part) for part in parts)

    monkeypatch.setattr("livebass.live.best_quality.LiveBass", Watched)
    monkeypatch.setattr("livebass.engine.engine.image", image)  # tests keep the operators of some basses
    rate = MIN_RATE
    synth = Synth(rate)
    synth.switch_to(LiveBass(load_preset("slap"), QUICK, rate))
    device = FakeDevice(synth)
    changes = PresetSwitch(synth, "slap", QUICK)
    changes.qualities = {name: replace(QUICK, name=name) for name in ("quick", "other")}
    threads = []
    gc.collect()
    gc.disable()
    try:
        for k in range(6):
            changes.next_preset()
            while changes.wanted[0] not in ("jazz-finger", "muted", "slap"):
                changes.next_preset()
            if k % 2:
                changes.next_quality()
            synth.send(0x90, 40, 90)
            next_line(changes, device)
            synth.panic()

            def rung_out() -> bool:
                device.block(64)
                changes.turn()
                return not synth.ringing

            wait_for(rung_out)
            changes._thread.submit(int).result()  # the thread drops its prepared bass
            assert sum(part() is not None for part in made) == len(made) // (k + 1) == 6
            threads.append(threading.active_count())
    finally:
        gc.enable()
    assert len(set(threads)) == 1
    changes.close()


@pytest.mark.skipif(platform.libc_ver()[0] != "glibc", reason="another C library")
def test_freed_memory_is_returned() -> None:
    """glibc alone would keep the second block, since it raises its thresholds when the first one is freed."""
    code = """if True:
        import numpy as np
        from livebass.live.presets import return_freed_memory
        def memory():  # MB
            return int(open("/proc/self/statm").read().split()[1]) / 256
        return_freed_memory()
        for _ in range(2):
            before, block = memory(), np.ones(24 << 17)
            between = [np.ones(1 << 10) for _ in range(100)]
            full = memory()
            del block
            print(full - before, memory() - before)
    """
    for line in python_output("-c", code).splitlines():
        full, after = map(float, line.split())
        assert full > 23 and after < 4, line


def test_a_preset_that_cannot_be_loaded_is_a_line(tmp_path: Path) -> None:
    synth, device = synth_and_device("jazz-finger")
    file = tmp_path / "mine.toml"
    changes = PresetSwitch(synth, str(file), QUALITIES["live"])
    changes.next_quality()
    assert "no such file" in next_line(changes, device)
    assert changes.turn() is None and changes.wanted == changes.playing == (str(file), "live")
    changes.next_preset()
    assert next_line(changes, device) == f"preset {preset_names()[0]}, quality live"
    changes.close()


def test_every_bass_of_a_session_is_tuned_alike() -> None:
    synth, device = synth_and_device("jazz-finger")
    drop_d = partial(load_preset, tuning="drop-d", capo=1, a4=432)
    changes = PresetSwitch(synth, "jazz-finger", QUALITIES["live"], drop_d)
    changes.choose("slap")
    assert next_line(changes, device) == "preset slap, quality live"
    bass = bass_of(synth).engine.instrument
    assert bass == load_preset("slap", tuning="drop-d", capo=1, a4=432) and bass.a4 == 432
    changes.load = partial(load_preset, tuning="E1 A1 D2 G2")
    changes.choose("five-string")
    assert "4 notes for 5 strings" in next_line(changes, device)
    changes.close()


def test_program_changes_neither_click_nor_stall(tmp_path: Path) -> None:
    """A held note rings on while other basses are prepared and chosen: no click, no gap, no long block."""
    take = tmp_path / "take.wav"
    session = jack_session("jazz-finger", connect=False, record=take)
    switched: list[int] = []  # frames

    def play(synth: Synth) -> None:
        played_on(synth, 0.5)
        for program in (SLAP, PICK, FINGER):
            synth.send(0x90, 28, 40)
            played_on(synth, 0.3)
            before = synth.bass
            synth.send(0xC0, program)
            wait_for(lambda before=before: synth.bass is not before)  # type: ignore[misc]
            switched.append(synth.frame)
            played_on(synth, 0.3)
            synth.send(0x80, 28, 0)
            played_on(synth, 0.3)

    with fake_jack(runs=True) as server:
        summary = session_of(session, play)
    assert summary.lost is None and summary.meters.faults == 0 and summary.meters.lost == 0
    assert np.mean(np.array(server.took) > PERIOD / RATE) < 0.01, "processor time of a period"
    sound = soundfile.read(take)[0]
    assert np.isfinite(sound).all() and np.abs(sound).max() > 0.005
    jumps = np.abs(np.diff(sound))
    for frame in switched:
        around = slice(frame - 2400, frame + 4800)
        assert jumps[around].max() < 2 * jumps[frame - 12000 : frame - 2400].max()
        assert np.all([np.abs(part).max() > 1e-4 for part in np.split(sound[around], 6)])


# ---- takes


def test_a_take_is_there_whatever_ends_the_session(tmp_path: Path) -> None:
    synth, device = synth_and_device()
    synth.send(0x90, 40, 110)
    heard = []
    with pytest.raises(RuntimeError), Recorder(tmp_path / "take.wav", synth) as take:
        for _ in range(50):
            heard.append(device.block(256))
            take.turn()
        heard.append(device.block(256))
        raise RuntimeError
    assert take.kept == tmp_path / "take.wav"
    assert os.listdir(tmp_path) == ["take.wav"]
    sound = soundfile.read(tmp_path / "take.wav")[0]
    assert np.abs(sound - np.concatenate(heard)).max() < 2**-22


def test_a_take_of_nothing_leaves_nothing(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    with Recorder(tmp_path / "take.wav", Synth(RATE)):
        pass
    assert not os.listdir(tmp_path) and "nothing was recorded" in caplog.messages[0]
    for bad, error in (("take.mp3", ValueError), ("nowhere/take.wav", OutputError)):
        with pytest.raises(error):
            Recorder(tmp_path / bad, Synth(RATE))
    assert not os.listdir(tmp_path)


@pytest.mark.parametrize("ending", quick(["wav", "flac"], ["flac"]))
def test_a_full_disk_ends_the_take_not_the_session(tmp_path: Path, ending: str) -> None:
    """In the playing process no file may grow beyond 100 kB."""
    program = """
import json, logging, resource, signal, sys
from pathlib import Path
from support.live import synth_and_device
from livebass.live.fake import FakeDevice
from livebass.live.recording import Recorder
signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
synth, device = synth_and_device()
said, handler = [], logging.Handler()
handler.emit = lambda record: said.append(record.getMessage())
logging.getLogger("livebass").addHandler(handler)
resource.setrlimit(resource.RLIMIT_FSIZE, (100_000, 100_000))
with Recorder(Path(sys.argv[1]), synth) as take:
    for k in range(2000):
        if k % 20 == 0:
            synth.send(0x90, 40, 127)
        sound = device.block(256)
        take.turn()
print(json.dumps([said, bool(sound.any()), str(take.kept)]))
"""
    file = tmp_path / f"take.{ending}"
    said, sounds, kept = json.loads(python_output("-c", program, file, env=module_paths()))
    assert "cannot be written" in said[0] and "playing goes on" in said[0] and sounds
    assert "are kept" in said[1] and kept == str(file) and len(said) == 2
    sound, _ = soundfile.read(file)
    assert np.abs(sound).max() > 0.05 and len(sound) > 25000
    assert os.listdir(tmp_path) == [file.name]


def test_what_was_played_is_kept_as_a_midi_file(tmp_path: Path, run: Run) -> None:
    """`render` gives the sound's take, sample for sample, and finds the bass by itself."""
    sound, notes, again = tmp_path / "take.wav", tmp_path / "take.mid", tmp_path / "again.wav"
    session = jack_session("slap", QUALITIES["live"], connect=False, record=sound, record_midi=notes)

    def play(synth: Synth) -> None:
        for message in ((0xC0, 0, 0), (0x92, 28, 60), (0xE2, 0, 80), (0xB2, 7, 90), (0x92, 40, 110), (0xD2, 5, 0)):
            synth.send(*message)
            played_on(synth, 0.1)
        synth.send(0x82, 28, 0)
        synth.send(0x92, 43, 0)
        played_on(synth, 0.6)

    with fake_jack(runs=True):
        summary = session_of(session, play)
    assert summary.meters.messages == 8 and summary.meters.overload == 0
    status, _, err = run("render", notes, "-q", "live", "--tail", "1s", "-o", again)
    assert status == 0 and "2 notes" in err, err
    one, two = soundfile.read(sound)[0], soundfile.read(again)[0]
    n = min(len(one), len(two)) - RATE // 20
    assert np.abs(one).max() > 0.02 and n > RATE // 2
    assert np.array_equal(one[:n], two[:n])


def test_a_midi_take_has_the_changes_of_preset(tmp_path: Path) -> None:
    """As General MIDI programs, on the channel of the notes; programs that choose no bass are left out."""
    mido = pytest.importorskip("mido")
    take = tmp_path / "take.mid"
    session = jack_session("jazz-finger", connect=False, record_midi=take)

    def play(synth: Synth) -> None:
        synth.send(0x93, 28, 60)
        synth.send(0xC0, 5)
        played_on(synth, 0.2)
        before = synth.bass
        synth.send(0xC0, SLAP)
        wait_for(lambda: synth.bass is not before)
        played_on(synth, 0.2)
        synth.send(0x93, 40, 60)
        played_on(synth, 0.2)

    with fake_jack(runs=True):
        session_of(session, play)
    events = [(m.type, m.channel, m.dict().get("program", m.dict().get("note"))) for m in mido.MidiFile(take)
              if not m.is_meta]  # fmt: skip
    assert events == [
        ("program_change", 3, FINGER), ("note_on", 3, 28), ("program_change", 3, SLAP), ("note_on", 3, 40),
    ]  # fmt: skip


def test_a_midi_take_that_cannot_be_is_an_error_before_anything_sounds(tmp_path: Path) -> None:
    with pytest.raises(OutputError, match="nowhere"):
        MidiRecorder(tmp_path / "nowhere" / "take.mid", Synth(RATE), "slap")
    with MidiRecorder(tmp_path / "take.mid", Synth(44_100), "mine.toml"):
        pass
    assert (tmp_path / "take.mid").stat().st_size


def test_a_rate_that_changes_is_followed(tmp_path: Path) -> None:
    """The bass is prepared for the new rate, the score goes on, and the sound goes into a new take.

    This server only reports a changed rate: PipeWire really changes it in tests/real/jack/test_desktop.py.
    """
    take = tmp_path / "take.wav"

    def read(rate: int) -> Score:
        return score_of([(0.25 * k, 0.2, 33, 100) for k in range(200)], rate)

    session = jack_session("slap", connect=False, record=take, read=read)
    rates: list[int] = []

    def play(synth: Synth) -> None:
        synth.send(0xB0, 7, 80)
        synth.set_value(PARAMETER, 1, -0.5)  # the tone
        played_on(synth, 0.6)
        assert isinstance(session.output, JackOutput)
        for rate in (44100, RATE):
            before = session.output.synth
            heard = before.frame / before.rate  # it plays on until the other one is ready
            session.output._change_rate(rate)
            wait_for(lambda rate=rate: session.output.synth.rate == rate)  # type: ignore[misc]
            now = session.output.synth
            rates.append(rate)
            assert now.bass is not None and of_any(now.bass.engine.performer)["volume"] == 80 / 127
            assert now.value(PARAMETER, 1) == -0.5 and now.record["gain_target"][0] == 1
            assert now.frame / rate > heard - 0.01, "the time goes on"
            wait_for(lambda now=now: now.meters().peak > 0.01)  # type: ignore[misc]
            played_on(now, 0.8)

    with fake_jack(runs=True):
        summary = session_of(session, play)
    assert rates == [44100, RATE] and summary.lost is None and summary.meters.messages > 5
    assert {file.name: soundfile.info(file).samplerate for file in tmp_path.iterdir()} == {
        "take.wav": RATE, "take-44100.wav": 44100, "take-48000.wav": RATE,
    }  # fmt: skip


# ---- log and status


def test_a_log_is_added_to_as_it_goes(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    path, logger = tmp_path / "log.txt", logging.getLogger("livebass")
    for k in range(2):
        log = LogFile(path)
        logger.addHandler(log)
        logger.warning("line %d", k)
        assert path.read_text().count("\n") == k + 1
        log.close()
        logger.warning("nothing")
        logger.removeHandler(log)
    assert all(line[:2] == "20" and "  line " in line for line in path.read_text().splitlines())
    full = LogFile(Path("/dev/full"))
    logger.addHandler(full)
    caplog.clear()
    for _ in range(2):
        logger.warning("line")
    logger.removeHandler(full)
    assert [m for m in caplog.messages if m != "line"] == [
        "/dev/full: cannot be written: No space left on device: the log ends here"
    ]


def test_a_session_can_be_listened_to(caplog: pytest.LogCaptureFixture) -> None:
    """The lines of `livebass play` are records of the logger "livebass"."""
    caplog.set_level(logging.INFO, "livebass")
    console = Console(quiet=True)
    with log_to(console, None):
        logging.getLogger("livebass.live.session").info("playing")
    assert caplog.messages == ["playing"] and console not in logging.getLogger("livebass").handlers


def test_a_log_that_cannot_be_is_one_line_before_anything_sounds(run: Run, tmp_path: Path) -> None:
    for path in (tmp_path, tmp_path / "nowhere" / "log", "a\0b"):
        with pytest.raises(OutputError, match="cannot be written"):
            LogFile(Path(path))
    refusal(run, "play", "--log", tmp_path / "nowhere" / "log", status=1)


def test_what_libraries_print_is_no_line_of_ours() -> None:
    """In any thread, under a terminal's status line; Python's own lines appear, in order."""
    program = """
import os, sys, threading
from livebass.live.guards import own_stderr, silenced_stderr

def chatter():
    os.write(2, b"Expression failed\\n")

print("one", file=sys.stderr)
with own_stderr():
    chatter()
    print("two", file=sys.stderr)
    with silenced_stderr():
        print("three", file=sys.stderr)
    beside = threading.Thread(target=chatter)
    beside.start()
    beside.join()
print("four", file=sys.stderr)
os.write(2, b"five\\n")
os.close(2)
with own_stderr():
    pass
"""
    done = run_python("-c", program)
    assert done.returncode == 0 and done.stderr.splitlines() == ["one", "two", "three", "four", "five"], done.stderr


@pytest.mark.parametrize(
    ("arguments", "style"),
    [
        (("--demo", "-p", "slap"), "slap"),
        (("--demo", "-p", "fretless", "--tempo", "80%"), "finger"),
        (("--demo", "techniques", "--keys", "modo-12"), "techniques"),
    ],
    ids=" ".join,
)
def test_the_demo_plays_without_a_file_or_a_keyboard(
    run: Run, monkeypatch: pytest.MonkeyPatch, arguments: tuple[str, ...], style: str
) -> None:
    """On a fake device: the phrase of `render`, its first notes as the engine renders them."""
    taken: list[Settings] = []

    class Ready(Session):
        def run(self) -> Summary:
            taken.append(self.settings)
            raise ValueError("ready")

    monkeypatch.setattr(session, "Session", Ready)
    status, _, err = run("play", "--no-settings", "--backend", "portaudio", *arguments)
    assert status == 1 and err.endswith("livebass: error: ready\n"), err
    (settings,) = taken
    assert settings.read and settings.midi is None
    score, phrase = settings.read(RATE), demo_score(RATE, style)
    assert np.array_equal(score.frames, phrase.frames) and np.array_equal(score.messages, phrase.messages)
    assert style != "techniques" or settings.instrument.player.keys == MODO == settings.load("slap").player.keys
    desk = Desk()
    _, device = synth_and_device(settings.instrument, adaptive=False, desk=desk)
    desk.load(score)
    desk.rolling = True
    lead = round(LEAD * RATE)
    heard = play(device, lead + RATE, 256)[lead:]
    expected = offline(settings.instrument, [m for m in messages_of(score) if m[1] & 0xF0 != 0xC0], RATE)
    assert np.abs(heard).max() > 0.01 and np.allclose(heard, expected, rtol=1e-4, atol=1e-6)


def test_a_demo_and_a_file_are_one_too_many(run: Run) -> None:
    err = refusal(run, "play", "--demo", "--file", "song.mid", status=2)
    assert "--file and --demo" in err


def test_devices_lists_devices_alone() -> None:
    """No library output from any thread, and no names of library functions."""
    program = """
import os, threading
from livebass.cli.main import run
from livebass.live import jack, portaudio, systemmidi

def chatter(*_):
    os.write(2, b"JackShmReadWritePtr: skipping unlock\\n")
    beside = threading.Thread(target=os.write, args=(2, b"server is not running\\n"))
    beside.start()
    beside.join()

class Rtmidi:
    get_compiled_apis = staticmethod(lambda: [2, 3])
    get_api_name = staticmethod({2: "alsa", 3: "jack"}.get)
    def MidiIn(api, name):
        os.write(2, b"ALSA lib seq_hw.c\\n")
        raise RuntimeError(f"MidiInAlsa::initialize: {api} {name}")

jack.jack_server = chatter
portaudio.output_names = lambda: chatter() or {}
systemmidi.rtmidi_library = lambda: Rtmidi
raise SystemExit(run(["devices"]))
"""
    done = run_python("-c", program, env=NO_SERVER)
    assert done.returncode == 0 and not done.stderr, done.stderr
    heading, last = done.stdout.splitlines()[-2:]
    assert heading == "MIDI inputs (--midi)"
    assert last == "  none: no MIDI ports: no JACK server, and no answer from ALSA's sequencer"


def test_the_median_load() -> None:
    counts = np.zeros(HISTOGRAM, np.int64)
    assert median_load(counts) == 0
    counts[24], counts[40] = 10, 9
    assert 0.25 < median_load(counts) < 0.25 * 2**0.25
    counts[40] = 11
    assert 4 < median_load(counts) < 4 * 2**0.25


def test_the_status_says_what_plays_and_what_is_wrong() -> None:
    synth, device = synth_and_device("slap", adaptive=False)  # the machine may be busy
    gauge = Gauge(synth)
    synth.send(0x90, 30, 127)
    play(device, 40 * 64)
    assert strings(synth) == "F#1(E:2*)"
    synth.send(0x90, 40, 110)
    play(device, 4 * 64)
    assert strings(synth) == "F#1(E:2*) E2(D:2*)"
    reading = gauge.read()
    assert 0 < reading.median <= gauge.worst
    assert "OVERLOAD" not in reading.text() and "underruns 0" in reading.text() and " dBFS" in reading.text()
    synth.record["overload"], synth.record["faults"] = 2, 5
    device.block(64, flags=4)
    text = gauge.read().text()
    assert "OVERLOAD: 2 strings coarse" in text and "underruns 1" in text and "faults 5" in text


@pytest.mark.parametrize(
    ("peak", "shown"),
    [
        (0.0, "[            ]   silent"), (1e-4, "[            ] -80 dBFS"), (0.001001, "[#           ] -60 dBFS"),
        (0.5, "[########### ]  -6 dBFS"), (1.0, "[############]   0 dBFS"), (1.5, "[############]   4 dBFS"),
    ],
)  # fmt: skip
def test_the_status_begins_with_a_meter(peak: float, shown: str) -> None:
    assert Reading(Meters(0, 0, 0, 0, 0, 0.0, peak, 0, 0, 0, 0), 0.1).meter() == shown


def test_underruns_at_a_low_load_say_what_helps(caplog: pytest.LogCaptureFixture) -> None:
    """Once, not for a few underruns, nor for underruns caused by the bass itself."""
    synth, device = synth_and_device("slap")
    session = Session(Settings(load_preset("slap"), QUICK))
    session.output = SimpleNamespace(advice=lambda: "take --block 256")  # type: ignore[assignment]
    status = Status(session, None, Gauge(synth))  # type: ignore[arg-type]

    def underruns(count: int, load: float) -> None:
        for _ in range(count):
            device.block(64, flags=4)
        synth.record["load_worst"] = load
        status.advise(status.read(), 5.0)

    for count, load in ((2, 0.1), (5, 0.9), (0, 0.1)):
        underruns(count, load)
    assert not caplog.messages
    for _ in range(3):
        underruns(2, 0.1)
    assert len(caplog.messages) == 1 and caplog.messages[0].endswith("take --block 256")
    assert caplog.messages[0].startswith("4 underruns")


def test_advice_names_only_blocks_that_there_are() -> None:
    for block, portaudio, pipewire in (
        (128, "take --block 256 or --latency 20ms", "set PIPEWIRE_LATENCY=256/48000, or take --block 256"),
        (1024, "take --latency 43ms", "set PIPEWIRE_LATENCY=2048/48000"),
    ):
        card = SimpleNamespace(block=block, latency=block / 48000)
        assert PortAudioOutput.advice(card) == portaudio  # type: ignore[arg-type]
        client = SimpleNamespace(block=block, rate=48000, pipewire=True)
        assert JackOutput.advice(client) == pipewire  # type: ignore[arg-type]


def test_the_status_line_names_preset_velocity_and_octave() -> None:
    synth, _ = synth_and_device("slap")
    session = Session(Settings(load_preset("slap"), QUICK))
    session.output = SimpleNamespace(synth=synth)  # type: ignore[assignment]
    presets = SimpleNamespace(playing=("basses/mine.toml", "live"))
    keys = SimpleNamespace(active=True, velocity=90, octave=3, ways="ghost, slide")
    status = Status(session, presets, Gauge(synth), keys)  # type: ignore[arg-type]
    line = status.line(status.read())
    assert line.startswith("[            ]   silent   -   mine   load") and line.endswith(
        "velocity 90, octave 3   ghost, slide"
    )


# ---- the terminal


def test_keys_are_notes_and_more() -> None:
    sent: list[tuple[int, ...]] = []
    others: list[str] = []
    keys = TerminalKeys(lambda *m: sent.append(m), lambda: others.append("panic"), {"\t": lambda: others.append("tab")})
    for key in "zx=q ]Z!\t?":
        keys.press(key)
    assert sent == [
        (0x90, 28, 100), (0x80, 28, 0), (0x90, 30, 100), (0x80, 30, 0), (0x90, 40, 110), (0x80, 40, 0), (0x90, 40, 110),
    ]  # fmt: skip
    assert others == ["panic", "tab"]
    assert not {*NOTES, *STROKES, *WAYS} & set("[]-=!()<> \t\r\n") and not {*STROKES, *WAYS} & {*NOTES}
    sent.clear()
    for key in "qQwERp":  # everything between the white keys of the upper row
        keys.press(key)
    assert [m[1] - 52 for m in sent[1::2]] == [0, 1, 2, 5, 6, 16]


def typed_messages(*texts: str, seconds: float = 0.0) -> list[tuple[int, ...]]:
    """The messages from a terminal for `texts`, `seconds` apart by the test's own clock."""
    sent: list[tuple[int, ...]] = []
    keys = TerminalKeys(lambda *m: sent.append(m), lambda: None)
    with pytest.MonkeyPatch.context() as clock:
        for k, text in enumerate(texts):
            clock.setattr(terminal, "time", SimpleNamespace(monotonic=lambda k=k: 1e3 + k * seconds))
            keys._hear(text)
    return sent


ON, OFF = (0x90, 28, 100), (0x80, 28, 0)


def test_a_key_that_the_terminal_repeats_is_one_note() -> None:
    assert typed_messages(*"zzzz") == [ON]
    assert typed_messages(*"zxz") == [ON, OFF, (0x90, 30, 100), (0x80, 30, 0), ON], "another key was between"
    assert typed_messages(*"zz", seconds=0.12) == [ON, OFF, ON], "struck twice"
    assert typed_messages("==z") == [(0x90, 28, 120)], "a held key that changes the velocity"


def test_a_terminal_that_reports_releases_ends_notes_by_them() -> None:
    """The kitty keyboard protocol: two keys held together, repeats, capitals, function keys and split sequences."""
    here = "\x1b[?0u"
    assert typed_messages("z", "\x1b[122;1:3u") == [ON], "not asked for yet"
    assert typed_messages(here, "\x1b[122u", "\x1b[122;1:2u", "\x1b[120;1:1u", "\x1b[122;1:3u", "\x1b[120;1:3u") == [
        ON, (0x90, 30, 100), OFF, (0x80, 30, 0),
    ]  # fmt: skip
    assert typed_messages(here, "\x1b[122:90;2:1u", "\x1b[122;1:3u", "\x1b[1;1:3A", "\x1b[57441;2u") == [ON, OFF]
    assert typed_messages(here + "\x1b[12", "2;", "1u\x1b[122;1:3u") == [ON, OFF]
    assert typed_messages(here, "\x1b[122;3u", "\x1b[122;5u"[:0], "\x1b[99999999u") == [], "with Alt, and no character"
    interrupted: list[int] = []
    before = signal.signal(signal.SIGINT, lambda number, frame: interrupted.append(number))
    try:
        typed_messages(here, "\x1b[99;5u", "\x1b[99;5:3u")
    finally:
        signal.signal(signal.SIGINT, before)
    assert interrupted == [signal.SIGINT], "Ctrl-C is a key there"


def test_number_keys_are_the_techniques_of_the_handbook() -> None:
    """The page has them too: tests/unit/web/test_export.py."""
    assert [*STROKES, *WAYS] == [*DIGITS] == [*"1234567890"]
    page, names = page_text("playing"), [button.name.lower() for button in DIGITS.values()]
    for keys, some in (("`1`, `2`, `3`", names[:3]), ("`4` to `7`", names[3:7]), ("`8`, `9`, `0`", names[7:])):
        assert f"| {keys} | {', '.join(some)}" in page
    assert all(f"{key} {name};" in keyboard.HELP for key, name in zip(DIGITS, names, strict=True))


def test_what_belongs_to_channels_is_switched_on_every_one() -> None:
    """Keyboard notes on any channel vibrate and ring on; a keyboard that disappears releases them all."""
    for key, controller in (("9", 1), ("0", 64)):
        sent = typed_messages(key, key, seconds=1.0)
        assert sent == [(0xB0 | channel, controller, value) for value in (127, 0) for channel in range(16)]
    synth, device = synth_and_device("jazz-finger")
    for channel in (2, 9):
        synth.send(0xB0 | channel, 64, 127)
        synth.send(0x90 | channel, 28 + channel, 90)
    device.block(64)
    state = performer_of(synth)["hands"]["state"]
    assert sorted(state[:4].tolist()) == [0, 0, 1, 1]
    let_go(synth)
    device.block(64)
    assert not state.any()


def test_panic_ends_notes_of_every_channel_and_their_controllers() -> None:
    synth, device = synth_and_device("jazz-finger")
    synth.keep_messages()
    for channel in (0, 7, 15):
        for message in ((0xB0, 64, 127), (0xB0, 11, 9), (0xE0, 0, 99), (0x90, 28 + channel, 90)):
            synth.send(message[0] | channel, *message[1:])
    device.block(64)
    synth.played()
    synth.panic()
    device.block(64)
    assert [m[1:] for m in synth.played()] == [(0xB0 | c, number, 0) for number in (120, 121) for c in range(16)]
    p = performer_of(synth)
    assert not p["hands"]["state"].any()
    for name, default in (("pedal", 0), ("expression", 1.0), ("wheel", 0.0)):
        assert (p["controls"]["channel"][name] == default).all(), name


def test_a_technique_is_latched_by_its_number_and_lasts_while_held_where_releases_are_told() -> None:
    on, off = (0xB0, 65, 127), (0xB0, 65, 0)
    assert typed_messages(*"8z8", seconds=1.0) == [on, ON, off]
    assert typed_messages(*"2z", seconds=1.0) == [(0x90, 15, 64), (0x80, 15, 0), ON]
    assert typed_messages(*"56!", seconds=1.0) == [(0x90, 10, 64), (0x90, 17, 64), (0x80, 10, 0), (0x80, 17, 0)]
    assert typed_messages("\x1b[?0u", "\x1b[56u", "\x1b[122u", "\x1b[56;1:3u", "\x1b[122;1:3u") == [on, ON, off, OFF]
    keys = TerminalKeys(lambda *m: None, lambda: None)
    for key in "947":
        keys.press(key)
    assert keys.ways == "palm mute, hammer-on, vibrato"


def test_techniques_follow_the_key_map_of_the_bass(caplog: pytest.LogCaptureFixture) -> None:
    caplog.set_level(logging.INFO, "livebass")
    sent: list[tuple[int, ...]] = []
    keys = TerminalKeys(lambda *m: sent.append(m), lambda: None, key_map=lambda: MODO_12)
    keys.press("5")
    assert sent == [(0x90, 22, 64)]
    nothing = replace(MODO_12, keys=(), controllers=())
    keys = TerminalKeys(lambda *m: sent.append(m), lambda: None, key_map=lambda: nothing)
    for key in "158":
        keys.press(key)
    assert len(sent) == 1 and not keys.ways
    assert caplog.messages == [
        f"{name}: the bass that plays has no key for it" for name in ("finger", "ghost", "slide")
    ]


def test_a_technique_key_is_heard() -> None:
    """A note muted by its number key has half the sound of an open one after a fifth of a second."""
    energy = []
    for typed_first in ("", "4"):
        synth, device = synth_and_device("jazz-finger")
        keys = TerminalKeys(synth.send, synth.panic)
        for key in typed_first + "z":
            keys.press(key)
        device.block(RATE // 5)
        energy.append(float(np.square(device.block(RATE // 5), dtype=np.float64).sum()))
    assert energy[1] < energy[0] / 2


def test_a_system_without_single_keys_says_so(
    monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    """Windows has no termios."""
    monkeypatch.setitem(sys.modules, "termios", None)
    monkeypatch.setattr(os, "isatty", lambda fd: True)
    with TerminalKeys(lambda *m: None, lambda: None) as keys:
        keys.read()
    assert not keys.active and len(caplog.messages) == 1 and "computer keyboard" in caplog.messages[0]


# ---- machines without sound


def without(code: str, *arguments: object) -> subprocess.CompletedProcess[str]:
    """Runs the command line after `code`, without a JACK server."""
    program = f"import sys, ctypes.util\n{code}\nfrom livebass.cli import main as cli\ncli.main(sys.argv[1:])"
    return run_python("-c", program, *arguments, stdin=subprocess.DEVNULL, env=NO_SERVER)


NO_EXTRA = "for name in ('sounddevice', 'supriya_midi', 'jack'): sys.modules[name] = None"
NO_LIBRARY = "ctypes.util.find_library = lambda name: None"


@pytest.mark.parametrize(
    ("code", "backend", "says"),
    [
        (NO_EXTRA, "auto", install("live")),
        slow(NO_EXTRA, "jack", install("live")),
        (NO_LIBRARY, "auto", "apt install libportaudio2"),
        (NO_LIBRARY, "jack", "apt install libjack-jackd2-0"),
        ("", "auto", "start a JACK server"),
        slow("", "portaudio", "start a JACK server"),
        slow("", "jack", "start one"),
    ],
)
def test_a_machine_without_sound_says_what_to_do(code: str, backend: str, says: str) -> None:
    if not code and backend != "jack" and "channels" in without("", "devices").stdout:
        pytest.skip("there is sound here")
    done = without(code, "play", "--backend", backend)
    assert_one_clear_line(done.returncode, done.stderr, (1,))
    assert says in done.stderr


def test_without_sound_devices_and_render_still_work(tmp_path: Path) -> None:
    done = without(NO_EXTRA, "devices")
    assert done.returncode == 0 and done.stdout.count("none") == 3 and done.stderr == ""
    done = without(NO_EXTRA, "render", "--note", "E1", "--tail", "0", "-q", "live", "-o", tmp_path / "a.wav")
    assert done.returncode == 0, done.stderr
