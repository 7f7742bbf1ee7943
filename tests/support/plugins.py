"""Shared by the tests of plugins: a score, and the sound `livebass render` makes of scores."""

from __future__ import annotations

import functools
import hashlib
import os
import re
import subprocess
import tempfile
from collections.abc import Callable, Iterator
from contextlib import suppress
from pathlib import Path
from types import ModuleType

import mido
import numpy as np
import pytest

from livebass import QUALITIES, load_preset, render_to_array, score_of
from livebass.compiling import store
from livebass.engine.render import mix_strings
from livebass.kernels.bass.kept import FORMAT
from livebass.plugin import build
from livebass.plugin.header import header
from livebass.plugin.instrument import file_of
from livebass.plugin.systems import this_system
from livebass.rows.arrays import Floats
from livebass.score.reading import read_score
from livebass.score.score import Score
from livebass.system.cores import core_count
from support.kept import read_kept
from support.needs import tool

RATE = 48000
PRESETS = ("jazz-finger", "slap", "paper-bass", "fretless")
TAIL = 0.1  # s
MAX_BYTES = 1_220_000  # of a release for Windows, the largest; to be less: 950 kB were wanted
EXPORTED = ["GetPluginFactory", "ModuleEntry", "ModuleExit", "clap_entry", "lv2_descriptor", "lv2ui_descriptor"]
NO_THREADS = pytest.mark.skipif(
    this_system().ending != "so" or core_count() < 2, reason="plugins have no threads of their own here"
)
FADE = 0.02  # s, of render's fade-out at the end
NOTES = [(0.05 * k, 0.3, 28 + 5 * (k % 4) + k // 4, 127 - 8 * k) for k in range(12)]
DAMAGES = {
    "cut": lambda data: data[:-8],
    "empty": lambda data: b"",
    "changed": lambda data: data[:900] + b"?" + data[901:],
    "of a later format": lambda data: file_of(read_kept(data), "9.1", FORMAT + 1),
    "of an older version": lambda data: b"LIVEBASS" + data[8:],
}


@pytest.fixture(scope="module", autouse=True)
def no_instruments_of_the_user(tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    """Plugins find an empty folder in place of the user's; a folder of tests imports this into its conftest."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("XDG_DATA_HOME", str(tmp_path_factory.mktemp("data")))
        yield


def write_bundle(plugin: ModuleType, folder: Path) -> Path:
    """Writes a bundle of PRESETS, by the module of a format, into `folder`; returns the bundle."""
    plugin.write_bundle({name: load_preset(name) for name in PRESETS}, folder)
    return folder


def kept_product(name: str, make: Callable[[Path], bytes]) -> bytes:
    """Returns the product of `make`: of the plugins' C and kernels and the files beside this one, with kernels.h.

    Kept where the plugins' binary is.
    """

    def made() -> bytes:
        with tempfile.TemporaryDirectory() as folder:
            build.emit(Path(folder), [system], [build.PLUGIN])
            Path(folder, "kernels.h").write_text(header(system.levels))
            return make(Path(folder))

    system, place = this_system(), store.directory(f"plugin-{build.digest()}")
    files = sorted(file for file in Path(__file__).parent.iterdir() if file.suffix in (".py", ".c", ".h"))
    digest = hashlib.sha256(b"".join(file.read_bytes() for file in files)).hexdigest()[:16]
    return store.kept_or_made(place / f"{name}-{digest}" if place else None, made)


def sources(folder: Path, host: str) -> list[str]:
    """The compiler's arguments for the plugins' C, the kernels in `folder` and HOST.c beside this file."""
    system = this_system()
    objects = [folder / build.object_name(build.PLUGIN, level, system) for level in system.levels]
    files = [*sorted(build.C.rglob("*.c")), Path(__file__).with_name(f"{host}.c"), *objects]
    return [f"-I{folder}", f"-I{build.C}", *map(str, files)]


@functools.cache
def checked_binary() -> bytes:
    """The plugins' binary for this system, built to abort on a broken thread rule (thread.h)."""
    system = this_system()
    return kept_product(
        "checked", lambda folder: build.link(folder, system, build.compiler(system), ["-DLB_CHECK_THREADS"])
    )


def c_host(folder: Path, name: str, *flags: str) -> Path:
    """Compiles NAME.c beside this file with the plugins' C and kernels into `folder`; returns the program."""

    def make(place: Path) -> bytes:
        command = [*build.compiler(this_system()), "-std=gnu11", *flags, *sources(place, name)]
        subprocess.run([*command, "-o", place / name, "-lm", "-lpthread"], check=True)
        return (place / name).read_bytes()

    made = folder / name
    made.write_bytes(kept_product("".join([name, *flags]), make))
    made.chmod(0o700)
    return made


def helpers() -> int:
    """The number of real-time threads in this process: the plugins' helpers that play strings."""
    policies = []
    for number in os.listdir("/proc/self/task"):
        with suppress(ProcessLookupError):
            policies.append(os.sched_getscheduler(int(number)) & ~os.SCHED_RESET_ON_FORK)
    return policies.count(os.SCHED_FIFO)


def check_binary(file: Path) -> None:
    """Checks that the plugins' binary is small, needs no Python and exports only the formats' entries."""
    code = file.read_bytes()
    assert len(code) < MAX_BYTES
    for word in (b"Py_", b"PyErr", b"NRT_", b"numba", b"libpython"):
        assert word not in code, word
    listed = subprocess.run([tool("nm"), "-D", "--defined-only", file], capture_output=True, text=True)
    assert sorted(re.findall(r" [A-Z] (\w+)", listed.stdout)) == EXPORTED


@functools.cache
def hard_score(rate: int = RATE, notes: int = len(NOTES)) -> Score:
    """Hard notes on all strings, faster than they decay."""
    return score_of(NOTES[:notes], rate)


def messages_in_s(score: Score) -> list[tuple[bytes, float]]:
    """A score for pedalboard, (message, time in s); a quarter of a frame late, as it rounds down."""
    return [(m.tobytes(), (f + 0.25) / score.rate) for f, m in zip(score.frames.tolist(), score.messages, strict=True)]


@functools.cache
def render_preset(preset: str, score: Score, quality: str = "live", gain: float = 1.0, tail: float = TAIL) -> Floats:
    """The sound of `livebass render`, (strings, n) float32, without its faded end."""
    sound = render_to_array(load_preset(preset), score, QUALITIES[quality], tail=tail)
    sound = (sound * gain).astype(np.float32)[:, : -round(FADE * score.rate)]
    sound.flags.writeable = False  # kept for the next test
    return sound


def mono(preset: str, score: Score, quality: str = "live", gain: float = 1.0) -> Floats:
    """The mono sound of `livebass render`."""
    return mix_strings(render_preset(preset, score, quality, gain))


def midi_score(path: Path) -> Score:
    """Writes a MIDI file with bends, pedal and expression on two channels; reads it as `livebass render` does.

    One channel is tuned, its wheel has another range, and each key sounds on both for a while.
    """
    track = mido.MidiTrack()
    for controls in (((101, 0), (100, 2), (6, 66)), ((101, 0), (100, 0), (6, 5))):
        track += [mido.Message("control_change", channel=5, control=k, value=x, time=1) for k, x in controls]
    for k in range(8):
        key, channel, other = 30 + 7 * (k % 4), 5 * (k % 2), 5 - 5 * (k % 2)
        track.append(mido.Message("note_on", channel=channel, note=key, velocity=60 + 8 * k, time=11))
        track.append(mido.Message("control_change", channel=channel, control=64, value=127 * (k // 2 % 2), time=7))
        for bend in (1500, 4000, 0):
            track.append(mido.Message("pitchwheel", channel=channel, pitch=bend, time=9))
        track.append(mido.Message("note_on", channel=other, note=key, velocity=50, time=3))
        track.append(mido.Message("control_change", channel=channel, control=11, value=90 + k, time=3))
        track.append(mido.Message("pitchwheel", channel=other, pitch=900 * k, time=9))
        track.append(mido.Message("note_off", channel=channel, note=key, time=5))
        track.append(mido.Message("note_off", channel=other, note=key, time=5))
    mido.MidiFile(type=0, ticks_per_beat=480, tracks=[track]).save(path)
    return read_score(path, RATE, "all")
