"""The LV2 plugin in a host of ours plays what `livebass render` renders, bit for bit, and does as hosts expect."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from support.lv2 import Plugin

from livebass import QUALITIES, demo_score, load_preset, render_to_array, score_of
from livebass.arrays import Floats
from livebass.engine.render import mixed
from livebass.plugin.build import compiler
from livebass.plugin.lv2 import URI, write_bundle
from livebass.plugin.systems import this_system
from livebass.score import Score

RATE = 48000
PRESETS = ("jazz-finger", "slap", "paper-bass", "fretless")
MOST_BYTES = 700_000
TAIL = 0.5  # s; render fades its last 20 ms
NOTES = [(0.05 * k, 0.3, 28 + 5 * (k % 4) + k // 4, 127 - 8 * k) for k in range(12)]


@pytest.fixture(scope="module")
def bundle(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("lv2") / "livebass.lv2"
    write_bundle({name: load_preset(name) for name in PRESETS}, folder)
    return folder


@pytest.fixture
def plugin(bundle: Path) -> Iterator[Plugin]:
    made = Plugin(bundle)
    yield made
    made.close()


def rendered(preset: str, score: Score, quality: str = "live", gain: float = 1.0) -> Floats:
    """The sound of `livebass render`, float32, without its end, which is faded out."""
    sound = render_to_array(load_preset(preset), score, QUALITIES[quality], tail=TAIL)
    return mixed((sound * gain).astype(np.float32))[: -round(0.02 * score.rate)]


def state_of(plugin: Plugin, instrument: str, quality: int = 0, seed: int = 0) -> dict[int, tuple[bytes, int]]:
    """A state as a preset of the host's menu holds it."""
    long = plugin.number("http://lv2plug.in/ns/ext/atom#Long")
    text = plugin.number("http://lv2plug.in/ns/ext/atom#String")
    return {
        plugin.number(f"{URI}#bass"): (instrument.encode() + b"\0", text),
        plugin.number(f"{URI}#quality"): (quality.to_bytes(8, "little"), long),
        plugin.number(f"{URI}#seed"): (seed.to_bytes(8, "little"), long),
    }


@pytest.mark.parametrize("preset", PRESETS)
@pytest.mark.parametrize("sizes", [(1,), (17,), (512,), (4096, 3, 100)], ids=str)
def test_it_plays_what_is_rendered_bit_for_bit(plugin: Plugin, preset: str, sizes: tuple[int, ...]) -> None:
    """Hard notes on all strings, faster than they die away."""
    score = score_of(NOTES, RATE)
    wanted = rendered(preset, score)
    assert plugin.restore(state_of(plugin, preset)) == 0
    assert np.array_equal(plugin.play(score, len(wanted), sizes), wanted)
    assert np.abs(wanted).max() > 0.1


@pytest.mark.parametrize("rate", [44100, 96000])
def test_so_it_does_at_other_rates(bundle: Path, rate: int) -> None:
    plugin, score = Plugin(bundle, rate), score_of(NOTES, rate)
    wanted = rendered("jazz-finger", score)
    assert np.array_equal(plugin.play(score, len(wanted)), wanted)
    plugin.close()


def test_bends_and_controllers(plugin: Plugin) -> None:
    score = demo_score(RATE, "slap")
    wanted = rendered("slap", score)
    assert plugin.restore(state_of(plugin, "slap")) == 0
    assert np.array_equal(plugin.play(score, len(wanted)), wanted)


def test_nothing_is_cut_at_full_scale(plugin: Plugin) -> None:
    plugin.controls["gain"].value = 20.0
    score = score_of(NOTES, RATE)
    wanted = rendered("jazz-finger", score, gain=10.0)
    assert np.abs(wanted).max() > 1.5
    assert np.array_equal(plugin.play(score, len(wanted)), wanted)


def test_a_session_brings_its_sound_back(bundle: Path, plugin: Plugin) -> None:
    """Studio quality and a seed too, in a plugin whose ports say something else."""
    assert plugin.restore(state_of(plugin, "slap", quality=1, seed=7)) == 0
    state = plugin.save()
    assert state == state_of(plugin, "slap", quality=1, seed=7)
    other = Plugin(bundle)
    other.uris[:] = plugin.uris
    assert other.restore(state) == 0 and other.save() == state
    score = score_of(NOTES[:3], RATE)
    assert np.array_equal(other.play(score, 4800), plugin.play(score, 4800))
    assert not other.jobs
    other.close()
    assert plugin.restore(state_of(plugin, "missing")) != 0
    assert plugin.logged == ["missing: the session's instrument is not among those installed"]


def test_the_port_changes_the_bass_through_the_worker(plugin: Plugin) -> None:
    plugin.block(64, [(0, bytes([0x90, 40, 100]))])
    for number, name in [(1, b"slap\0"), (3, b"fretless\0"), (0, b"jazz-finger\0")]:
        plugin.controls["bass"].value = number
        plugin.block(64)
        assert len(plugin.jobs) == 1
        plugin.block(64)  # the bass before plays on while the worker is busy
        assert len(plugin.jobs) == 1
        plugin.work()
        for _ in range(2 * RATE // 512):
            plugin.block(512, [(0, bytes([0x90, 40, 100])), (100, bytes([0x80, 40, 0]))])
            plugin.work()
        assert plugin.save()[plugin.number(f"{URI}#bass")][0] == name
    assert not plugin.logged


def test_activate_makes_it_as_new(plugin: Plugin) -> None:
    score = score_of(NOTES, RATE)
    first = plugin.play(score, RATE)
    plugin.plugin.deactivate(plugin.handle)
    plugin.plugin.activate(plugin.handle)
    assert np.array_equal(plugin.play(score, RATE), first)


def test_without_a_worker_it_plays_its_first_bass(bundle: Path) -> None:
    plugin, score = Plugin(bundle, worker=False), score_of(NOTES, RATE)
    plugin.controls["bass"].value = 1.0
    assert np.array_equal(plugin.play(score, 9600), rendered("jazz-finger", score)[:9600])
    plugin.close()


@pytest.mark.parametrize(
    "damage", [lambda data: data[:-8], lambda data: b"", lambda data: data[:900] + b"?" + data[901:]]
)
def test_a_damaged_instrument_is_refused_with_one_line(bundle: Path, tmp_path: Path, damage: object) -> None:
    copy = tmp_path / "livebass.lv2"
    write_bundle({"slap": load_preset("slap")}, copy)
    data = (copy / "slap.lbass").read_bytes()
    (copy / "slap.lbass").write_bytes(damage(data))  # type: ignore[operator]
    with pytest.raises(RuntimeError, match="livebass"):
        Plugin(copy)
    (copy / "slap.lbass").unlink()
    with pytest.raises(RuntimeError, match="livebass"):
        Plugin(copy)


def test_the_binary_is_small_and_exports_what_hosts_ask_for(bundle: Path) -> None:
    code = (bundle / "livebass.so").read_bytes()
    assert len(code) < MOST_BYTES
    for word in (b"Py_", b"PyErr", b"NRT_", b"numba", b"libpython"):
        assert word not in code, word
    listed = subprocess.run(["nm", "-D", "--defined-only", bundle / "livebass.so"], capture_output=True, text=True)
    entries = ["GetPluginFactory", "ModuleEntry", "ModuleExit", "clap_entry", "lv2_descriptor"]
    assert sorted(re.findall(r" [A-Z] (\w+)", listed.stdout)) == entries


SHARING = """
import resource, sys
from pathlib import Path
from support.lv2 import Plugin
first = Plugin(Path(sys.argv[1]))
first.block(64)
before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
more = [Plugin(Path(sys.argv[1])) for _ in range(19)]
for plugin in more:
    plugin.block(64)
print(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before)
for plugin in [first, *more]:
    plugin.close()
"""


def test_instances_share_their_pool(bundle: Path) -> None:
    done = subprocess.run(
        [sys.executable, "-c", SHARING, bundle], capture_output=True, text=True,
        env=os.environ | {"PYTHONPATH": os.pathsep.join(filter(None, sys.path))},
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    assert int(done.stdout) < 300_000 * 19 / 20  # kB


TRAP = """
#define _GNU_SOURCE
#include <dlfcn.h>
#include <stddef.h>
#include <stdint.h>
static __thread int inside;
int allocated;
extern void *__libc_malloc(size_t), *__libc_calloc(size_t, size_t), *__libc_realloc(void *, size_t);
extern void __libc_free(void *);
void *malloc(size_t n) { allocated += inside; return __libc_malloc(n); }
void *calloc(size_t n, size_t m) { allocated += inside; return __libc_calloc(n, m); }
void *realloc(void *p, size_t n) { allocated += inside; return __libc_realloc(p, n); }
void free(void *p) { allocated += inside; __libc_free(p); }
void run_inside(void (*run)(void *, uint32_t), void *handle, uint32_t frames) {
    inside = 1;
    run(handle, frames);
    inside = 0;
}
"""
TRAPPED = """
import ctypes, sys
from pathlib import Path
from support.lv2 import Plugin
trap = ctypes.CDLL(None)
plugin = Plugin(Path(sys.argv[1]))
run = plugin.plugin.run
class Trapped:
    connect = plugin.plugin.connect
    def run(self, handle, frames):
        trap.run_inside(ctypes.cast(run, ctypes.c_void_p), ctypes.c_void_p(handle), ctypes.c_uint32(frames))
plugin.plugin = Trapped()
for k in range(400):
    plugin.block(64, [(5, bytes([0x90, 28 + k % 30, 127])), (40, bytes([0xE0, 0, k % 128]))])
assert not plugin.logged
print(ctypes.c_int.in_dll(trap, "allocated").value)
"""


def test_run_allocates_nothing(bundle: Path, tmp_path: Path) -> None:
    (tmp_path / "trap.c").write_text(TRAP)
    trap = tmp_path / "trap.so"
    subprocess.run([*compiler(this_system()), "-shared", "-fPIC", "-o", trap, tmp_path / "trap.c"], check=True)
    done = subprocess.run(
        [sys.executable, "-c", TRAPPED, bundle], capture_output=True, text=True,
        env=os.environ | {"PYTHONPATH": os.pathsep.join(filter(None, sys.path)), "LD_PRELOAD": str(trap)},
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    assert done.stdout == "0\n"
