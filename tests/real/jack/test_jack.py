"""Playing through a JACK server: notes at their frame, takes, a server that hangs, PortAudio."""

from __future__ import annotations

import os
import re
import signal
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import soundfile
from support.command import python
from support.jack import JACK_PERIOD, JACK_RATE, PATIENCE, end, playing, wait_for, wait_for_log, wait_for_take
from support.live import QUICK, offline
from support.needs import HANGUP
from support.song import midi_file, song_of

from livebass import load_preset
from livebass.lab.bench.jack import AudioProbe, LostFrames, MidiProbe, new_client
from livebass.live.jack import JackOutput
from livebass.live.synth import LiveBass, Synth

RATE, PERIOD = JACK_RATE, JACK_PERIOD


@contextmanager
def slap_bass() -> Iterator[Any]:
    """A client of the server that plays the slap bass."""
    output = JackOutput("livebass", lambda rate: Synth(rate, adaptive=False), connect=False)
    output.synth.switch_to(LiveBass(load_preset("slap"), QUICK, output.synth.rate))
    try:
        output.start()
        wait_for(lambda: output.synth.frame > RATE // 2)  # a client that has just joined loses periods
        yield output
    finally:
        output.close()


@pytest.fixture
def bass(server: SimpleNamespace) -> Iterator[Any]:
    with slap_bass() as output:
        yield output


def test_notes_come_out_at_their_frame_as_rendered(server: SimpleNamespace) -> None:
    """The other frames of a period are in test_rig.py."""
    offset, end = 100, time.monotonic() + PATIENCE
    while True:
        with slap_bass() as bass:
            heard, disturbed = heard_note(server, bass, offset)
        expected = offline("slap", [(offset, 0x90, 40, 110)], len(heard))
        if len(heard) >= 4 * PERIOD and np.array_equal(heard, expected):
            break
        assert disturbed and time.monotonic() < end, f"{len(heard)} frames are not as rendered"
    assert not heard[:offset].any() and np.abs(expected).max() > 0.01


def heard_note(server: SimpleNamespace, bass: Any, offset: int) -> tuple[np.ndarray, bool]:
    """Returns the sound of `bass` from the period of a note at `offset` up to the listener's first lost period.

    Also returns True if other work on the machine cost any client periods. When the bass loses a period, the server
    repeats the last one.
    """
    audio, midi = AudioProbe(keep=True), MidiProbe()
    try:
        for probe in (audio, midi):
            probe.client.activate()
        bass.client.connect(bass.outputs[0], audio.port)
        bass.client.connect(midi.port, bass.midi)
        wait_for(lambda: len(audio.periods) > 50)
        lost, xruns = LostFrames(bass.client, bass.synth), bass.synth.meters().underruns
        audio.listen()
        midi.send(offset, 0x90, 40, 110)
        wait_for(lambda: midi.sent)
        time.sleep(0.4)
        disturbed = audio.gaps > 0 or lost.read()[1] > PERIOD or bass.synth.meters().underruns > xruns
    finally:
        for probe in (audio, midi):
            probe.close()
    assert midi.sent is not None
    start = midi.sent - offset
    periods = {frame: sound for frame, sound in audio.periods if frame >= start}
    whole: list[np.ndarray] = []
    while start + len(whole) * PERIOD in periods:
        whole.append(periods[start + len(whole) * PERIOD])
    return np.concatenate([np.zeros(0, np.float32), *whole]), disturbed


def test_a_busy_interpreter_loses_nothing(server: SimpleNamespace, bass: Any) -> None:
    """Counts the server's frames not played by the synth, idle and with Python hogging the processor.

    A Python callback loses most of them, each time; other work on the machine may cost any callback a few.
    """
    seconds = 2.0

    def lost(work: Any) -> int:
        frames = LostFrames(bass.client, bass.synth)
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            work()
        return frames.read()[1]

    tries = []
    for _ in range(8):
        idle = lost(lambda: time.sleep(0.05))
        busy = lost(lambda: re.match(r"(a+)+$", "a" * 18 + "b"))
        tries.append((idle, busy))
        if busy <= max(idle, 0) + 0.15 * seconds * RATE:
            return
    raise AssertionError(f"frames lost when idle and when busy: {tries}")


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT, HANGUP])
def test_a_take_survives_the_signal_that_ends_it(server: SimpleNamespace, tmp_path: Path, number: int) -> None:
    take, log, song = (tmp_path / name for name in ("take.wav", "log", "song.mid"))
    song.write_bytes(midi_file(song_of([28, 33, 38, 43] * 20, 200)))
    arguments = ("--backend", "jack", "-p", "slap", "--file", song, "--record", take, "--log", log)
    with playing(*arguments) as process:
        wait_for_log(log, "playing", process=process)
        wait_for_take(take, 1.0)
        err = end(process, number)
    assert process.returncode == 0, err
    sound, rate = soundfile.read(take)
    assert rate == RATE and len(sound) > RATE // 2
    assert np.abs(sound).max() > 0.05
    assert sorted(os.listdir(tmp_path)) == ["log", "song.mid", "take.wav"]
    assert "underruns" in err and "Traceback" not in err


def test_a_client_is_closed_if_nothing_can_be_played_at_its_rate(server: SimpleNamespace) -> None:
    def refuse(rate: int) -> Synth:
        raise ValueError("no such rate")

    for _ in range(2):
        with pytest.raises(ValueError, match="no such rate"):
            JackOutput("refused", refuse)
        assert not new_client("probe").get_ports("^refused")
    client = new_client("refused")
    assert client.name == "refused", "the name is free"
    client.close()


def test_the_sound_of_portaudio_is_the_same(server: SimpleNamespace) -> None:
    """PortAudio's JACK host, captured by another client; in its own process, as PortAudio looks for JACK once."""
    program = f"""
import os
import numpy as np
from support.jack import wait_for
from support.live import QUICK, offline
from livebass import load_preset
from livebass.lab.bench.jack import AudioProbe, LostFrames
from livebass.live.portaudio import PortAudioOutput
from livebass.live.synth import LiveBass, Synth

synth = Synth({RATE}, adaptive=False)
synth.switch_to(LiveBass(load_preset("slap"), QUICK, {RATE}))
output = PortAudioOutput(synth, None, {PERIOD}, "low")
audio = AudioProbe(keep=True)
audio.client.activate()
output.start()
ports = audio.client.get_ports(is_output=True, is_audio=True)
audio.client.connect(next(p for p in ports if not p.name.startswith("system")), audio.port)
wait_for(lambda: len(audio.periods) > 100)
audio.gaps = 0
lost, underruns = LostFrames(audio.client, synth), synth.meters().underruns
synth.send(0x90, 40, 110)
wait_for(lambda: audio.first is not None)
heard_before = len(audio.periods)
wait_for(lambda: len(audio.periods) > heard_before + 100)
disturbed = audio.gaps or lost.read()[1] > {PERIOD} or synth.meters().underruns > underruns
sound = np.concatenate([s for _, s in audio.periods])
first = int(np.flatnonzero(sound)[0])
expected = offline("slap", [(0, 0x90, 40, 110)], 8000)
onset = int(np.flatnonzero(expected)[0])
heard = sound[first - onset : first - onset + 8000]
same = np.array_equal(heard, expected)
print("same" if same else "disturbed" if disturbed else f"differs by {{np.abs(heard - expected).max()}}", flush=True)
output.close()
os._exit(0)
"""
    for _ in range(20):  # other work on the machine costs the server periods
        done = python(program, timeout=PATIENCE)
        if done.stdout.strip() != "disturbed":
            break
    assert done.stdout.strip() == "same", done.stdout + done.stderr[-2000:]


@pytest.mark.parametrize("backend", ["jack", "portaudio"])
def test_a_server_that_hangs_does_not_hold_the_take(server: SimpleNamespace, tmp_path: Path, backend: str) -> None:
    """The server is stopped by SIGSTOP: every call to it hangs."""
    take, log = tmp_path / "take.wav", tmp_path / "log"
    with playing("--backend", backend, "--record", take, "--log", log) as process:
        wait_for_log(log, "playing", process=process)
        wait_for_take(take, 0.6)
        server.process.send_signal(signal.SIGSTOP)
        try:
            time.sleep(1.0)
            err = end(process, signal.SIGTERM)
        finally:
            server.process.send_signal(signal.SIGCONT)
    assert "Traceback" not in err and "played" in err
    assert soundfile.info(take).frames > RATE // 2
