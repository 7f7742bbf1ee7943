"""The LV2 plugin in our host plays exactly what `livebass render` renders, and behaves as hosts expect."""

from __future__ import annotations

import functools
import os
import re
import shutil
import subprocess
import threading
import time
from contextlib import closing
from dataclasses import replace
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pytest
from support import plugins
from support.command import python
from support.costs import quick
from support.lv2 import Plugin
from support.needs import tool
from support.plugins import NOTES, RATE

from livebass import load_preset, score_of
from livebass.engine.render import mix_strings
from livebass.kernels.player.performer import MAX_STRINGS
from livebass.live.parameters import OUTPUTS, PARAMETERS
from livebass.model.keymap import MODO, MODO_12
from livebass.plugin.build import compiler
from livebass.plugin.instrument import write_instrument
from livebass.plugin.lv2 import STRINGS, URI, write_bundle, write_preset
from livebass.plugin.systems import this_system
from livebass.preset.sounds import sounds_of
from livebass.rows.arrays import Floats
from livebass.rows.techniques import SLIDER_ROWS, event
from livebass.score.score import Score

PRESETS = ("jazz-finger", "slap", "paper-bass", "fretless", "five-string", "six-string")
TAIL = 0.5  # s


@pytest.fixture(scope="module")
def bundle(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("lv2") / "livebass.lv2"
    write_bundle({name: load_preset(name) for name in PRESETS}, folder)
    return folder


@pytest.fixture
def plugin(bundle: Path, lend: Any) -> Plugin:
    return lend(Plugin(bundle))  # type: ignore[no-any-return]


def stems(preset: str, score: Score, gain: float = 1.0) -> Floats:
    """The stems of `livebass render --stems`, float32 (strings, n), without their faded end."""
    return plugins.render_preset(preset, score, gain=gain, tail=TAIL)


def render(preset: str, score: Score, gain: float = 1.0) -> Floats:
    """The sound of `livebass render`."""
    return mix_strings(stems(preset, score, gain))


@functools.cache
def hard(preset: str, rate: int = RATE) -> tuple[Score, Floats]:
    """Hard notes on all strings, faster than they decay, and their rendered sound; a board takes long."""
    count = 2 if preset == "fretless" else len(NOTES) if rate == RATE else 4
    score = score_of(NOTES[:count], rate)
    return score, render(preset, score)


def state_of(plugin: Plugin, instrument: str, quality: int = 0, seed: int = 0) -> dict[int, tuple[bytes, int]]:
    """A state in the form of a preset in the host's menu."""
    long = plugin.number("http://lv2plug.in/ns/ext/atom#Long")
    text = plugin.number("http://lv2plug.in/ns/ext/atom#String")
    return {
        plugin.number(f"{URI}#bass"): (instrument.encode() + b"\0", text),
        plugin.number(f"{URI}#quality"): (quality.to_bytes(8, "little"), long),
        plugin.number(f"{URI}#seed"): (seed.to_bytes(8, "little"), long),
    }


def keep(plugin: Plugin) -> dict[int, tuple[bytes, int]]:
    """What a state says in the form of a preset."""
    return {key: value for key, value in plugin.save().items() if key in state_of(plugin, "")}


@pytest.mark.parametrize("preset", quick(["five-string", "six-string"], ["six-string"]))
def test_five_and_six_strings_have_an_output_each(bundle: Path, lend: Any, preset: str) -> None:
    """The second plugin plays the stems of `render --stems`; their sum is the first plugin's sound bit for bit."""
    plugin, score = lend(Plugin(bundle, index=1, outputs=MAX_STRINGS)), score_of(NOTES, RATE)
    wanted = stems(preset, score)
    assert plugin.restore(state_of(plugin, preset)) == 0
    outs = plugin.play(score, wanted.shape[1], (300, 2000, 7))
    assert np.array_equal(outs[: len(wanted)], wanted)
    assert not outs[len(wanted) :].any()
    assert np.array_equal(mix_strings(outs), hard(preset)[1])


def test_running_ahead_and_freewheeling_change_nothing(plugin: Plugin) -> None:
    """The switch makes the worker prepare the bass again, with memory for it."""
    score, wanted = hard("jazz-finger")
    plugin.block(64)
    plugin.controls["running_ahead"].value = 1.0
    plugin.block(64)
    assert len(plugin.jobs) == 1
    plugin.work()
    plugin.block(64)
    plugin.work()
    assert plugin.restore(plugin.save()) == 0  # fresh, and it still runs ahead
    assert np.array_equal(plugin.play(score, len(wanted), (64,)), wanted)
    assert plugin.restore(plugin.save()) == 0
    half = 64 * 200
    first = plugin.play(score, half, (64,))
    assert not plugin.jobs
    plugin.controls["freewheeling"].value = 1.0
    plugin.controls["relief"].value = 1.0
    first = np.concatenate([first, plugin.play(score, len(wanted) - len(first), (64,), start=half)])
    assert np.array_equal(first, wanted)


def test_freewheeling_waits_for_a_bass_that_the_worker_is_loading(bundle: Path) -> None:
    """An export that begins while a session's bass is built plays that bass from its first note."""

    def played(pause: float | None) -> Floats:
        with closing(Plugin(bundle)) as host:
            host.block(64)
            host.controls["action"].value = 0.5
            host.block(64)
            worker = threading.Thread(target=host.work)
            worker.start()
            if pause is None:
                worker.join()
            else:
                time.sleep(pause)
            host.controls["freewheeling"].value = 1.0
            sound = host.play(plugins.hard_score(notes=4), RATE // 4, (64,))
            worker.join()
            return sound

    wanted = played(None)
    assert np.abs(wanted).max() > 0.1
    for pause in (0.0, 5e-4, 1e-3, 2e-3, 5e-3):
        assert np.array_equal(played(pause), wanted), pause


NEEDED = {  # by controls without effect on hard fretted notes
    "bend_range": [(0, bytes([0xE0, 0, 96])), (0, bytes([0x90, 40, 100]))],
    "avoid_open": [(0, bytes([0x90, 33, 100]))],  # the open A
    "limiter": [(0, bytes([0x90, key, 127])) for key in (28, 33, 38, 43)],
    "detach": [(0, bytes([0xB0, 64, 127])), (0, bytes([0x90, 40, 100])), (4000, bytes([0x80, 40, 64]))],
}


BESIDE = {  # other controls without which a control has no effect
    "clean_blend": {"drive": 0.9}, "eq_low_mid_frequency": {"eq_low_mid": 9.0},
    "eq_high_mid_frequency": {"eq_high_mid": 9.0},
}  # fmt: skip
BY_SYMBOL = {p.symbol: p for p in PARAMETERS}


def test_the_controls_move_the_sound(plugin: Plugin) -> None:
    """Each has an effect, some on notes or beside controls that they need; NaN and values out of range do no harm;
    defaults restore all.
    """
    score, wanted = hard("jazz-finger")
    wanted = wanted[: 3 * RATE // 4]
    for p in (p for p in PARAMETERS if event(p)):
        for symbol, value in BESIDE.get(p.symbol, {}).items():
            plugin.controls[symbol].value = value
        plugin.plugin.activate(plugin.handle)
        default = plugin.block(RATE // 2, NEEDED[p.symbol]) if p.symbol in NEEDED else wanted
        if p.symbol in BESIDE:
            default = plugin.play(score, len(wanted))
        plugin.controls[p.symbol].value = p.minimum if p.minimum else p.maximum
        plugin.plugin.activate(plugin.handle)
        changed = plugin.block(RATE // 2, NEEDED[p.symbol]) if p.symbol in NEEDED else plugin.play(score, len(wanted))
        assert not np.array_equal(changed, default), p.symbol
        for value in (np.nan, np.inf, -np.inf, 1e30):
            plugin.controls[p.symbol].value = value
            assert np.isfinite(plugin.block(64)).all()
        for symbol in (p.symbol, *BESIDE.get(p.symbol, {})):
            plugin.controls[symbol].value = BY_SYMBOL[symbol].default
        plugin.plugin.activate(plugin.handle)
        assert np.array_equal(plugin.play(score, len(wanted) // 3), wanted[: len(wanted) // 3]), p.symbol
    for p in (p for p in PARAMETERS if not event(p) and p.symbol not in SLIDER_ROWS):
        for value in (np.nan, np.inf, -1.0, 1e30):
            plugin.controls[p.symbol].value = value
            assert np.isfinite(plugin.block(64)).all()
    assert not plugin.jobs and not plugin.logged


def test_the_users_own_instruments_come_after_the_bundles(own: Path, bundle: Path, lend: Any) -> None:
    """By name; one named like a bundled instrument is left out."""
    own.mkdir(parents=True)
    for name, preset in (("mine", "muted"), ("a-bass", "slap"), ("slap", "muted")):
        write_instrument(load_preset(preset), own / f"{name}.lbass")
    (own / "note.txt").write_text("no instrument")
    plugin = lend(Plugin(bundle))
    score, wanted = hard("muted")
    for number, name in ((len(PRESETS), b"a-bass\0"), (len(PRESETS) + 1, b"mine\0"), (1, b"slap\0")):
        plugin.controls["bass"].value = number
        settle(plugin)
        assert plugin.save()[plugin.number(f"{URI}#bass")][0] == name
    plugin.controls["bass"].value = len(PRESETS) + 2  # there is no such bass: nothing changes
    plugin.block(64)
    assert not plugin.jobs and not plugin.logged
    assert plugin.restore(state_of(plugin, "mine")) == 0
    assert np.array_equal(plugin.play(score, len(wanted)), wanted)


def test_tools_of_lv2_find_no_fault(bundle: Path, tmp_path: Path) -> None:
    """lv2_validate reads the Turtle; lv2info finds both plugins and every preset, including the user's own."""
    write_preset("mine", 'My "own"', tmp_path / "livebass-mine.lv2")
    shutil.copytree(bundle, tmp_path / bundle.name)
    env = os.environ | {"LV2_PATH": f"{tmp_path}:/usr/lib/lv2"}
    files = [str(file) for file in (*bundle.glob("*.ttl"), *(tmp_path / "livebass-mine.lv2").glob("*.ttl"))]
    done = subprocess.run([tool("lv2_validate", "LV2"), *files], env=env, capture_output=True, text=True, timeout=60)
    assert done.returncode == 0 and "Found 0 errors" in done.stdout + done.stderr, done.stdout + done.stderr
    for uri in (URI, STRINGS):
        reported = subprocess.run([tool("lv2info", "LV2"), uri], env=env, capture_output=True, text=True, timeout=60)
        assert reported.returncode == 0, reported.stderr
        for word in (*(load_preset(name).name for name in PRESETS), 'My "own"', "Pluck position"):
            assert word in reported.stdout, word
        assert re.search(r"Author:\s+livebass", reported.stdout)


def test_a_host_runs_it(bundle: Path) -> None:
    """lv2bench plays a second of silence with each plugin."""
    env = os.environ | {"LV2_PATH": f"{bundle.parent}:/usr/lib/lv2"}
    for uri in (URI, STRINGS):
        done = subprocess.run(
            [tool("lv2bench", "LV2"), "-n", "48000", uri], env=env, capture_output=True, text=True, timeout=60
        )
        assert done.returncode == 0 and uri in done.stdout, done.stdout + done.stderr


def test_a_session_is_stronger_than_the_ports(bundle: Path, plugin: Plugin, lend: Any) -> None:
    """Studio quality and a seed too, in a plugin whose ports disagree."""
    assert plugin.restore(state_of(plugin, "slap", quality=1, seed=7)) == 0
    state = plugin.save()
    assert keep(plugin) == state_of(plugin, "slap", quality=1, seed=7)
    other = lend(Plugin(bundle))
    other.uris[:] = plugin.uris
    assert other.restore(state) == 0 and other.save() == state
    score = score_of(NOTES[:3], RATE)
    other.controls["quality"].value = 0.0
    assert np.array_equal(other.play(score, 4800), plugin.play(score, 4800))
    assert not other.jobs


def test_the_turtle_tells_what_lists_and_automation_need(bundle: Path, tmp_path: Path) -> None:
    """Basses of one title told apart, outputs named by their strings, no automation of values the worker changes."""
    basses = {"slap": load_preset("slap"), "other": load_preset("slap")}
    write_bundle(basses, tmp_path / "livebass.lv2")
    for file in ("livebass.ttl", "presets.ttl"):
        text = (tmp_path / "livebass.lv2" / file).read_text()
        assert 'rdfs:label "Slap" ' in text and 'rdfs:label "Slap (other)" ' in text
    write_preset("mine", "Slap", tmp_path / "mine")
    assert 'rdfs:label "Slap (mine)"' in (tmp_path / "mine/presets.ttl").read_text()
    ports = (bundle / "livebass.ttl").read_text().split("lv2:index")
    names = [name for port in ports if "AudioPort" in port for name in re.findall(r'lv2:name "(.*?)"', port)]
    assert names == ["Out", *OUTPUTS]
    fixed = [s for port in ports if "notAutomatic" in port for s in re.findall(r'lv2:symbol "(.*?)"', port)]
    assert fixed == 2 * ["bass", "quality", "running_ahead", "relief", "cores"]


def test_ports_and_presets_begin_in_the_quality_of_the_list(tmp_path: Path, lend: Any) -> None:
    basses = {name: load_preset(name) for name in ("jazz-finger", "slap")}
    write_bundle(basses, tmp_path / "livebass.lv2", qualities={"jazz-finger": "studio"})
    ports = (tmp_path / "livebass.lv2" / "livebass.ttl").read_text().split("lv2:index")
    default = [re.findall("lv2:default (.*?) ", port) for port in ports if 'lv2:symbol "quality"' in port]
    assert default == [["1"], ["1"]]
    presets = (tmp_path / "livebass.lv2" / "presets.ttl").read_text()
    by_bass = {"jazz-finger": "1", "slap": "0"}
    wanted = [*by_bass.values(), *by_bass.values()]  # mono, strings; then the factory sounds
    wanted += [quality for _ in range(2) for bass, quality in by_bass.items() for _ in sounds_of(bass)]
    assert re.findall(r'"quality" ; pset:value (\d)', presets) == wanted
    assert re.findall(r'#quality> "(\d)"', presets) == wanted
    plugin = lend(Plugin(tmp_path / "livebass.lv2"))
    assert plugin.save()[plugin.number(f"{URI}#quality")][0] == (1).to_bytes(8, "little")


def test_names_of_keys_follow_the_bass(tmp_path: Path) -> None:
    """Names of the playing bass, in a document under a name unique to this instance."""
    slap = load_preset("slap")
    basses = {"default": slap, "other": replace(slap, player=replace(slap.player, keys=MODO_12))}
    write_bundle(basses, bundle := tmp_path / "livebass.lv2")
    plugin = Plugin(bundle)
    plugin.block(64)
    assert not plugin.renamed

    def shown() -> dict[int, str]:
        document = ElementTree.fromstring(plugin.midnam())
        assert document.findtext(".//Model") == plugin.midnam("model")
        assert {e.get("NameSet") for e in document.iter("ChannelNameSetAssign")} == {"Bass"}
        assert len(list(document.iter("AvailableChannel"))) == 16
        return {int(e.get("Number", -1)): e.get("Name", "") for e in document.iter("Note")}

    assert sorted(shown()) == sorted(key for key, *_ in MODO.keys)
    plugin.controls["bass"].value = 1.0
    settle(plugin)
    plugin.block(64)
    assert plugin.renamed == 1
    other = shown()
    assert sorted(other) == sorted(key for key, *_ in MODO_12.keys)
    assert (other[22], other[32], other[112]) == ("Ghost notes", "Stop on release", "Hand at fret 24")
    assert Plugin(bundle).midnam("model") != plugin.midnam("model")


def test_the_port_changes_the_bass_through_the_worker(plugin: Plugin) -> None:
    plugin.block(64, [(0, bytes([0x90, 40, 100]))])
    for number, name in [(1, b"slap\0"), (2, b"paper-bass\0"), (0, b"jazz-finger\0")]:
        plugin.controls["bass"].value = number
        plugin.block(64)
        assert len(plugin.jobs) == 1
        plugin.block(64)  # the old bass plays on while the worker is busy
        assert len(plugin.jobs) == 1
        plugin.work()
        for _ in range(2 * RATE // 512):
            plugin.block(512, [(0, bytes([0x90, 40, 100])), (100, bytes([0x80, 40, 0]))])
            plugin.work()
        assert plugin.save()[plugin.number(f"{URI}#bass")][0] == name
    assert not plugin.logged


def test_a_restored_bass_stays_when_another_port_moves(plugin: Plugin) -> None:
    """The port `bass` stays at 0 meanwhile; the same holds for a restored quality and the port `bass`."""
    assert plugin.restore(state_of(plugin, "slap")) == 0
    plugin.block(64)
    plugin.controls["quality"].value = 1.0
    settle(plugin)
    assert keep(plugin) == state_of(plugin, "slap", quality=1)
    assert plugin.restore(state_of(plugin, "slap", quality=1)) == 0
    plugin.controls["quality"].value = 0.0
    plugin.block(64)
    plugin.controls["bass"].value = 2.0
    settle(plugin)
    assert keep(plugin) == state_of(plugin, "paper-bass", quality=1)


@pytest.mark.parametrize("loaded", [False, True])
def test_a_late_worker_does_not_override_a_session(plugin: Plugin, loaded: bool) -> None:
    """The session is restored before or after the worker loads the port's bass."""
    plugin.block(64)
    plugin.controls["bass"].value = 1.0
    plugin.block(64)
    assert len(plugin.jobs) == 1
    if loaded:
        plugin.work()
    assert plugin.restore(state_of(plugin, "jazz-finger")) == 0
    settle(plugin)
    assert keep(plugin) == state_of(plugin, "jazz-finger")
    plugin.controls["bass"].value = 2.0
    settle(plugin)
    assert keep(plugin) == state_of(plugin, "paper-bass")


@pytest.mark.parametrize("restored", [False, True])
def test_a_job_that_the_host_drops_is_given_again_once_it_is_active(plugin: Plugin, restored: bool) -> None:
    if restored:
        assert plugin.restore(state_of(plugin, "slap")) == 0
    plugin.block(64)
    plugin.controls["bass"].value = 2.0
    plugin.block(64)
    assert len(plugin.jobs) == 1
    plugin.jobs.clear()
    plugin.plugin.deactivate(plugin.handle)
    plugin.plugin.activate(plugin.handle)
    settle(plugin)
    assert keep(plugin) == state_of(plugin, "paper-bass")


def settle(plugin: Plugin) -> None:
    """Plays on until a change of bass is complete."""
    for _ in range(60):
        plugin.block(1024)
        plugin.work()


def test_without_a_worker_it_says_so_and_plays_its_first_bass(bundle: Path, lend: Any) -> None:
    plugin, (score, wanted) = lend(Plugin(bundle, worker=False)), hard("jazz-finger")
    assert len(plugin.logged) == 1 and "has no worker" in plugin.logged[0]
    plugin.controls["bass"].value = 1.0
    assert np.array_equal(plugin.play(score, 9600), wanted[:9600])


def test_messages_that_are_cut_short_are_ignored(bundle: Path) -> None:
    """Whatever is missing: a note-on without its velocity is no note-off, nor is a volume without its value 0."""
    note, late = (0, bytes([0x90, 40, 100])), (2000, bytes([0x90, 43, 100]))
    whole = [bytes([status, 40 if status < 0xB0 else 7, 0]) for status in (0x90, 0x80, 0xA0, 0xB0, 0xE0)]
    program = bytes([0xC0, 36])
    cut = [message[:n] for message in [*whole, program] for n in range(len(message))]

    def played(messages: list[bytes]) -> Floats:
        with closing(Plugin(bundle)) as plugin:
            plugin.controls["freewheeling"].value = 1.0
            return plugin.block(9000, [note, *((1000 + k, m) for k, m in enumerate(messages)), late])

    plain = played([])
    assert np.array_equal(played(cut), plain)
    for message in (whole[0], whole[1], whole[3], whole[4]):
        assert not np.array_equal(played([message]), plain), message
    assert np.array_equal(played([bytes([0x90, 200, 100]), bytes([0xB0, 7, 200])]), plain), "no data bytes"


def test_a_state_whose_instrument_is_damaged_is_kept(tmp_path: Path) -> None:
    """One line reports it, the old bass plays on, and the session keeps its own."""
    copy = tmp_path / "livebass.lv2"
    write_bundle({"jazz-finger": load_preset("jazz-finger"), "slap": load_preset("slap")}, copy)
    (copy / "slap.lbass").write_bytes((copy / "slap.lbass").read_bytes()[:-8])
    score, wanted = hard("jazz-finger")
    with closing(Plugin(copy)) as plugin:
        state = state_of(plugin, "slap", quality=1, seed=7)
        assert plugin.restore(state) == 0 and keep(plugin) == state
        assert np.array_equal(plugin.play(score, len(wanted)), wanted)
        assert len(plugin.logged) == 1 and "slap.lbass" in plugin.logged[0] and keep(plugin) == state


def test_the_binary_is_small_and_exports_what_hosts_ask_for(bundle: Path) -> None:
    """All formats have the same one."""
    plugins.check_binary(bundle / "livebass.so")


def in_python(script: str, bundle: Path, **environment: str) -> str:
    """The output of a script run in its own process, with the bundle as its argument."""
    done = python(script, bundle, env=environment)
    assert done.returncode == 0, (done.returncode, done.stderr)
    return done.stdout


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
    assert int(in_python(SHARING, bundle)) < 300_000 * 19 / 20  # kB


RESTORING = """
import sys, threading
from pathlib import Path
import numpy as np
from support.lv2 import Plugin
plugin, ended, sounds = Plugin(Path(sys.argv[1])), threading.Event(), []
def play():
    for k in range(10**9):
        sounds.append(plugin.block(2048, [(5, bytes([0x90, 28 + k % 30, 127]))]))
        if ended.is_set():
            return
first = plugin.save()
thread = threading.Thread(target=play)
thread.start()
name, (text, kind) = next((key, value) for key, value in first.items() if value[0] == b"jazz-finger\\0")
for k in range(20):
    assert plugin.restore(first | {name: ((b"slap", b"jazz-finger")[k % 2] + b"\\0", kind)}) == 0
ended.set()
thread.join()
sound = np.concatenate(sounds)
assert np.isfinite(sound).all() and np.abs(sound).max() > 0.1 and not plugin.logged, plugin.logged
plugin.close()
"""


def test_a_host_may_restore_while_it_plays(bundle: Path) -> None:
    """It must not, but Ardour does when a preset is chosen."""
    in_python(RESTORING, bundle)


TRAP = """
#include <stdint.h>
#include "counting.h"
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
plugin.controls["running_ahead"].value = plugin.controls["relief"].value = 1.0
for k in range(3 * 48000 // 512):
    plugin.block(512)
    plugin.work()
run = plugin.plugin.run
class Trapped:
    connect = plugin.plugin.connect
    def run(self, handle, frames):
        trap.run_inside(ctypes.cast(run, ctypes.c_void_p), ctypes.c_void_p(handle), ctypes.c_uint32(frames))
plugin.plugin = Trapped()
for k in range(400):
    for number, control in enumerate(("gain", "tone", "pluck_position", "dynamics", "technique", "bend_range")):
        plugin.controls[control].value = (k + number) % 3
    plugin.controls["freewheeling"].value = k // 50 % 2
    plugin.block(64, [(5, bytes([0x90, 28 + k % 30, 127])), (40, bytes([0xE0, 0, k % 128]))])
assert not plugin.logged
print(ctypes.c_int.in_dll(trap, "allocations").value)
"""


def test_run_allocates_nothing(bundle: Path, tmp_path: Path) -> None:
    source, trap = tmp_path / "trap.c", tmp_path / "trap.so"
    source.write_text(TRAP)
    include = Path(plugins.__file__).parent
    subprocess.run([*compiler(this_system()), "-shared", "-fPIC", f"-I{include}", "-o", trap, source], check=True)
    assert in_python(TRAPPED, bundle, LD_PRELOAD=str(trap)) == "0\n"
