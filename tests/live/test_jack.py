"""The live path through a real JACK server with the dummy driver, which the fixture starts and ends."""

from __future__ import annotations

import os
import re
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import soundfile
from support.jack import JACK_PERIOD, JACK_RATE, livebass, wait_for
from support.live import QUICK, offline

from livebass import load_preset
from livebass.bench.jack import AudioProbe, MidiProbe
from livebass.live.synth import LiveBass, Synth
from livebass.live.thread.ring import unread

RATE, PERIOD = JACK_RATE, JACK_PERIOD


@contextmanager
def slap_bass() -> Iterator[Any]:
    """A client of the server that plays the slap bass."""
    from livebass.live.outputs import JackOutput

    output = JackOutput("livebass", lambda rate: Synth(rate, adaptive=False), connect=False)
    output.synth.switch_to(LiveBass(load_preset("slap"), QUICK, output.synth.rate))
    output.start()
    time.sleep(0.5)
    try:
        yield output
    finally:
        output.close()


@pytest.fixture
def bass(server: SimpleNamespace) -> Iterator[Any]:
    with slap_bass() as output:
        yield output


@pytest.mark.parametrize("offset", [0, 1, 100, PERIOD - 1])
def test_notes_come_out_at_their_frame_as_rendered(server: SimpleNamespace, offset: int) -> None:
    heard = np.zeros(0, np.float32)
    for _ in range(6):  # a machine that stops for a while costs the server whole periods
        with slap_bass() as bass:
            heard = heard_note(server, bass, offset)
        if len(heard) >= 4 * PERIOD:
            break
    assert len(heard) >= 4 * PERIOD, "the server lost periods"
    expected = offline("slap", [(offset, 0x90, 40, 110)], len(heard))
    assert not heard[: offset + 1].any() and np.abs(expected).max() > 0.01
    assert np.array_equal(heard, expected)


def heard_note(server: SimpleNamespace, bass: Any, offset: int) -> np.ndarray:
    """Returns what `bass` plays from the period of a note at `offset` on, up to the first period the server lost."""
    audio, midi = AudioProbe(keep=True), MidiProbe()
    try:
        for probe in (audio, midi):
            probe.client.activate()
        bass.client.connect(bass.outputs[0], audio.port)
        bass.client.connect(midi.port, bass.midi)
        time.sleep(0.5)
        midi.send(offset, 0x90, 40, 110)
        wait_for(lambda: midi.sent, 5)
        time.sleep(0.4)
    finally:
        for probe in (audio, midi):
            probe.close()
    assert midi.sent is not None
    start = midi.sent - offset
    periods = {frame: sound for frame, sound in audio.periods if frame >= start}
    whole = []
    while start + len(whole) * PERIOD in periods:
        whole.append(periods[start + len(whole) * PERIOD])
    return np.concatenate([np.zeros(0, np.float32), *whole])


def test_a_busy_interpreter_loses_nothing(server: SimpleNamespace, bass: Any) -> None:
    """Counts the server's frames that the synth did not play, idle and with Python hogging the processor.

    A Python callback loses most of them; other work on the machine may cost any callback some.
    """
    seconds = 2.0

    def lost(work: Any) -> int:
        begin = bass.client.frame_time, bass.synth.frame
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            work()
        return int(bass.client.frame_time - begin[0]) - (bass.synth.frame - begin[1])

    idle = lost(lambda: time.sleep(0.05))
    busy = lost(lambda: re.match(r"(a+)+$", "a" * 18 + "b"))
    assert busy <= max(idle, 0) + 0.15 * seconds * RATE, f"{busy} frames lost, {idle} when idle"


def test_nothing_sounds_by_itself(server: SimpleNamespace, bass: Any) -> None:
    audio = AudioProbe(keep=True)
    audio.client.activate()
    bass.client.connect(bass.outputs[1], audio.port)
    time.sleep(0.3)
    audio.close()
    assert len(audio.periods) > 5 and not any(sound.any() for _, sound in audio.periods)


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT, signal.SIGHUP])
def test_a_take_survives_the_signal_that_ends_it(server: SimpleNamespace, tmp_path: Path, number: int) -> None:
    take = tmp_path / "take.wav"
    log = tmp_path / "log"
    song = tmp_path / "song.mid"
    mido = pytest.importorskip("mido")
    track = mido.MidiTrack([mido.Message("program_change", program=33)])
    for note in (28, 33, 38, 43) * 20:
        track += [mido.Message("note_on", note=note, velocity=120), mido.Message("note_off", note=note, time=200)]
    midi = mido.MidiFile()
    midi.tracks.append(track)
    midi.save(song)
    process = livebass("play", "--backend", "jack", "-p", "slap", "--file", song, "--record", take, "--log", log)
    try:
        wait_for(lambda: log.exists() and "playing" in log.read_text(), 60)
        time.sleep(1.5)
        process.send_signal(number)
        _, err = process.communicate(timeout=20)
    finally:
        process.kill()
    assert process.returncode == 0, err
    sound, rate = soundfile.read(take)
    assert rate == RATE and len(sound) > RATE // 2
    assert np.abs(sound).max() > 0.05
    assert sorted(os.listdir(tmp_path)) == ["log", "song.mid", "take.wav"]
    assert "underruns" in err and "Traceback" not in err


def test_the_sound_of_portaudio_is_the_same(server: SimpleNamespace) -> None:
    """PortAudio's JACK host, captured by another client; in a process of its own, as PortAudio looks for JACK once."""
    program = f"""
import sys, time
import numpy as np
sys.path.insert(0, {str(Path(__file__).parents[1])!r})
from support.live import QUICK, offline
from livebass import load_preset
from livebass.bench.jack import AudioProbe
from livebass.live.outputs import PortAudioOutput
from livebass.live.synth import LiveBass, Synth

synth = Synth({RATE}, adaptive=False)
synth.switch_to(LiveBass(load_preset("slap"), QUICK, {RATE}))
output = PortAudioOutput(synth, None, {PERIOD}, "low")
audio = AudioProbe(keep=True)
audio.client.activate()
output.start()
ports = audio.client.get_ports(is_output=True, is_audio=True)
audio.client.connect(next(p for p in ports if not p.name.startswith("system")), audio.port)
time.sleep(0.5)
synth.send(0x90, 40, 110)
time.sleep(0.6)
sound = np.concatenate([s for _, s in audio.periods])
first = int(np.flatnonzero(sound)[0])
expected = offline("slap", [(0, 0x90, 40, 110)], 8000)
onset = int(np.flatnonzero(expected)[0])
heard = sound[first - onset : first - onset + 8000]
print("same" if np.array_equal(heard, expected) else f"differs by {{np.abs(heard - expected).max()}}", flush=True)
output.close()
import os
os._exit(0)
"""
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, timeout=120, check=False)
    assert done.stdout.strip() == "same", done.stdout + done.stderr[-2000:]


@pytest.mark.parametrize("backend", ["jack", "portaudio"])
def test_a_server_that_hangs_does_not_hold_the_take(server: SimpleNamespace, tmp_path: Path, backend: str) -> None:
    """The server is stopped by SIGSTOP: every call to it hangs."""
    take = tmp_path / "take.wav"
    process = livebass("play", "--backend", backend, "--record", take)
    assert process.stderr is not None
    try:
        while "playing" not in process.stderr.readline():
            assert process.poll() is None
        time.sleep(1.5)
        server.process.send_signal(signal.SIGSTOP)
        time.sleep(1.0)
        process.send_signal(signal.SIGTERM)
        _, err = process.communicate(timeout=30)
    finally:
        server.process.send_signal(signal.SIGCONT)
        process.kill()
    assert "Traceback" not in err and "played" in err
    assert soundfile.info(take).frames > RATE // 2


def test_a_server_that_goes_away_ends_the_session(server: SimpleNamespace, tmp_path: Path) -> None:
    """Through JACK and through PortAudio, which then hangs. The last test, as it ends the server."""
    names = ("jack", "portaudio")
    takes, logs = ([tmp_path / f"{name}.{ending}" for name in names] for ending in ("wav", "log"))
    processes = [
        livebass("play", "--backend", name, "--record", take, "--log", log)
        for name, take, log in zip(names, takes, logs, strict=True)
    ]
    try:
        wait_for(lambda: all(log.exists() and "playing" in log.read_text() for log in logs), 60)
        time.sleep(0.5)
        server.process.send_signal(signal.SIGTERM)
        server.process.wait(5)
        for process, take in zip(processes, takes, strict=True):
            _, err = process.communicate(timeout=20)
            assert process.returncode == 1
            assert f"is gone; {take} is complete" in err.splitlines()[-1] and "Traceback" not in err
            assert soundfile.info(take).frames > 0
    finally:
        for process in processes:
            process.kill()


def test_without_a_server_it_says_so() -> None:
    pytest.importorskip("jack")
    process = livebass("play", "--backend", "jack", env={**os.environ, "JACK_DEFAULT_SERVER": "nobody"})
    _, err = process.communicate(timeout=30)
    assert process.returncode == 1
    lines = err.splitlines()
    assert lines[-1].startswith("livebass: error: JACK") and "server" in lines[-1]
    assert all(line.startswith(("livebass:", "compiling")) for line in lines)


def test_threads_may_send_together() -> None:
    synth = Synth(RATE)
    threads = [threading.Thread(target=lambda: [synth.send(0x90, 40, 1) for _ in range(500)]) for _ in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert len(unread(synth.rings[0])) == 2000
