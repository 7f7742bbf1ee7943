"""Sound through PipeWire and PulseAudio. Fixtures start and end them, with a null sink and their own folders."""

from __future__ import annotations

import os
import signal
import subprocess
import tempfile
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from functools import partial
from pathlib import Path

import numpy as np
import pytest
import soundfile
from support.command import BASS, NOTE, song
from support.costs import quick
from support.jack import PATIENCE, livebass, playing, wait_for, wait_for_log, wait_for_take
from support.jack import end as end_of_play
from support.needs import tool

from livebass.sound.analysis import fundamental

LIFE = "900"  # s, longest life of a server


@contextmanager
def start(*command: str) -> Iterator[subprocess.Popen[bytes]]:
    """A server and its children, ended by their process group."""
    process = subprocess.Popen(
        ["timeout", LIFE, *command], stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
        start_new_session=True,
    )  # fmt: skip
    try:
        yield process
    finally:
        end(process)


def end(process: subprocess.Popen[bytes]) -> None:
    for number in (signal.SIGTERM, signal.SIGKILL):
        if process.poll() is None:
            os.killpg(process.pid, number)
            try:
                process.wait(5)
            except subprocess.TimeoutExpired:
                continue


def does(*command: str) -> bool:
    """True if a command to the servers succeeds."""
    try:
        return subprocess.run(command, capture_output=True, timeout=20, check=False).returncode == 0
    except subprocess.TimeoutExpired:
        return False


@contextmanager
def folder(*needed: str) -> Iterator[Path]:
    """A folder for the sockets and settings of one desktop; the environment names it meanwhile."""
    for name in needed:
        tool(name, "DESKTOP")
    with ExitStack() as ends, pytest.MonkeyPatch.context() as environment:
        here = Path(ends.enter_context(tempfile.TemporaryDirectory(prefix="lb-")))  # short: socket names have a limit
        for name in ("XDG_RUNTIME_DIR", "XDG_CONFIG_HOME", "XDG_STATE_HOME", "PULSE_RUNTIME_PATH"):
            environment.setenv(name, str(here))
        for name in ("PULSE_SERVER", "PIPEWIRE_REMOTE", "PIPEWIRE_LATENCY", "DISPLAY", "DBUS_SESSION_BUS_ADDRESS"):
            environment.delenv(name, raising=False)
        (here / "client.conf").write_text("autospawn = no\n")
        environment.setenv("PULSE_CLIENTCONFIG", str(here / "client.conf"))
        environment.setenv("JACK_DEFAULT_SERVER", "nobody")
        yield here


PULSEAUDIO = (
    *("pulseaudio", "-n", "--daemonize=no", "--exit-idle-time=-1", "--use-pid-file=no"),
    *("-L", "module-native-protocol-unix", "-L", "module-null-sink sink_name=speakers"),
)


@contextmanager
def pipewire() -> Iterator[None]:
    """PipeWire with its session manager, without a PulseAudio server yet."""
    needed = ("pipewire", "wireplumber", "pipewire-pulse", "pw-jack", "pw-metadata", "pactl", "dbus-run-session")
    with folder(*needed), start("pipewire"):
        wait_for(lambda: does("pw-cli", "info", "0"))
        with start("dbus-run-session", "--", "wireplumber"):
            yield


@contextmanager
def pulse(*command: str) -> Iterator[subprocess.Popen[bytes]]:
    """A server of the PulseAudio kind."""
    with start(*command) as process:
        wait_for(lambda: does("pactl", "info"))
        yield process


def steady_song(path: Path, seconds: int) -> Path:
    """An A at 110 Hz, four times a second."""
    path.write_bytes(song(BASS, *[NOTE.replace(b"\x28", b"\x2d").replace(b"\x64", b"\x50")] * 4 * seconds))
    return path


def assert_in_tune(file: Path) -> None:
    sound, rate = soundfile.read(file)
    assert np.abs(sound).max() > 0.01, file.name
    heard = fundamental(sound, rate, 50.0, 300.0, hop=0.02).frequency_hz
    assert np.nanmedian(heard) == pytest.approx(110.0, rel=0.01), file.name


def test_pipewire_changes_its_rate_and_its_sink(tmp_path: Path) -> None:
    """The notes stay in tune, the sound goes to the new speakers, and the period stays the one asked for."""
    log, tune = tmp_path / "log", steady_song(tmp_path / "song.mid", 600)
    says = partial(wait_for_log, log)
    arguments = ("--file", tune, "--record", tmp_path / "take.wav", "--log", log, "--block", 512, "--latency", "50ms")
    with pipewire(), pulse("pipewire-pulse"):
        assert does("pactl", "load-module", "module-null-sink", "sink_name=speakers")
        with playing(*arguments, under="pw-jack") as process:
            says("--latency: PipeWire decides that itself", "livebass, 48000 Hz, about 10.7 ms", process=process)
            wait_for_take(tmp_path / "take.wav", 1.5)
            for rate in (96000, 48000):
                assert does("pw-metadata", "-n", "settings", "0", "clock.force-rate", str(rate))
                says(f"now runs at {rate} Hz", f"the sound goes into {tmp_path}/take-{rate}.wav", process=process)
                wait_for_take(tmp_path / f"take-{rate}.wav", 1.5, rate=rate)
            assert does("pactl", "unload-module", "module-null-sink")
            says("speakers Audio/Sink sink is gone", process=process)
            assert does("pactl", "load-module", "module-null-sink", "sink_name=headphones")
            says("playing into headphones Audio/Sink sink", process=process)
            err = end_of_play(process, signal.SIGINT)
    assert process.returncode == 0 and "Traceback" not in err, err
    assert sorted(file.name for file in tmp_path.glob("*.wav")) == ["take-48000.wav", "take-96000.wav", "take.wav"]
    for file in tmp_path.glob("*.wav"):
        assert_in_tune(file)


@pytest.mark.parametrize("server", quick(["pulseaudio", "pipewire-pulse"], ["pipewire-pulse"]))
def test_a_sound_server_that_ends_is_waited_for(server: str, tmp_path: Path) -> None:
    """PortAudio and alsa-lib wait, and would print much on stderr. The song goes on, and ends the session."""
    log, take, tune = tmp_path / "log", tmp_path / "take.wav", steady_song(tmp_path / "song.mid", 6)
    command = PULSEAUDIO if server == "pulseaudio" else ("pipewire-pulse",)
    with folder("pulseaudio", "pactl") if server == "pulseaudio" else pipewire():
        with pulse(*command) as running:
            process = livebass("play", "--file", tune, "--record", take, "--log", log)
            wait_for_log(log, "playing through", process=process)
            assert real_time_threads(process.pid) or "no real-time priority" in log.read_text()
            end(running)
        try:
            wait_for_log(log, "is gone, waiting for it", process=process)
            with pulse(*command):
                wait_for_log(log, "playing through", times=2, process=process)
                _, err = process.communicate(timeout=PATIENCE)
        finally:
            process.kill()
    assert process.returncode == 0 and "Traceback" not in err, err
    assert "ALSA lib" not in err and "Expression" not in err, err
    assert_in_tune(take)


def real_time_threads(process: int) -> list[int]:
    """The threads of a process with real-time priority."""
    threads = [int(task.name) for task in Path(f"/proc/{process}/task").iterdir()]
    return [t for t in threads if os.sched_getscheduler(t) & ~os.SCHED_RESET_ON_FORK == os.SCHED_FIFO]
