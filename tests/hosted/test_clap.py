"""The CLAP plugin in our host plays exactly what `livebass render` renders, and behaves as hosts expect."""

from __future__ import annotations

import ctypes as c
import os
import resource
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import closing, contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from support.clap import (
    MONO,
    NOTE_PORT,
    PORTS,
    PRESSURE,
    STRINGS,
    Library,
    Plugin,
    choke,
    counting_host,
    expression,
    midi,
    note_off,
    note_on,
    tuning,
    value,
)
from support.command import python
from support.plugins import NO_THREADS, PRESETS, RATE, hard_score, helpers, mono, write_bundle
from support.states import bass_of, read, without_instrument
from support.states import state_of as state_written

from livebass import QUALITIES, Instrument, __version__, load_preset
from livebass.engine.engine import Engine
from livebass.live.parameters import OUTPUTS, PARAMETERS
from livebass.model.instrument import Effects, Response
from livebass.plugin import clap
from livebass.plugin.bundle import distinct_titles
from livebass.plugin.instrument import write_instrument
from livebass.plugin.systems import this_system
from livebass.rows.arrays import Floats
from livebass.rows.techniques import PARAMETER_ROWS

GAIN, TONE, POSITION, DYNAMICS, TECHNIQUE, DAMPING, UNEVENNESS, BEND_RANGE, BASS, QUALITY, AHEAD, RELIEF = range(12)
OVERLOAD = 500
PALM, VIBRATO, COMPRESSION, DRIVE, CORES = range(12, 17)
ACTION, GAUGE = (next(p.number for p in PARAMETERS if p.symbol == symbol) for symbol in ("action", "gauge"))
pytestmark = pytest.mark.usefixtures("thread_checks")
NO_HELPERS = "one core plays: threads of the plugin's own need real-time priority, which the system refuses"


@pytest.fixture(scope="module")
def folder(thread_checks: None, tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_bundle(clap, tmp_path_factory.mktemp("clap") / "livebass")


def test_other_programs_bring_no_relief(folder: Path) -> None:
    """Relief counts the time that the plugin's thread works, not that of a program on the same core."""
    cores = os.sched_getaffinity(0)
    os.sched_setaffinity(0, [min(cores)])
    try:
        with subprocess.Popen([sys.executable, "-c", "while True: pass"]) as other, closing(Plugin(folder)) as plugin:
            plugin.set(RELIEF, 1.0)
            plugin.block(128, [note_on(28, 0.5)])  # one string: whatever the machine, it needs far less than a block
            until = time.monotonic() + 2
            while time.monotonic() < until:
                plugin.block(128)
            other.kill()
            assert not [value for number, value in plugin.reported if number == OVERLOAD]
    finally:
        os.sched_setaffinity(0, cores)


def test_effects_of_an_instrument_and_of_a_host_are_those_of_a_render(tmp_path: Path, lend: Any) -> None:
    samples = np.exp(-np.arange(9000) / 900) * np.cos(np.arange(9000.0)) / 9
    jazz = load_preset("jazz-finger")
    own = replace(jazz, effects=Effects(0.4, 0.3, Response(44100, samples.tobytes())))
    clap.write_bundle({"own": own, "plain": jazz}, tmp_path / "livebass")
    score = hard_score()

    def wanted(bass: Instrument) -> Floats:
        engine = Engine(bass, QUALITIES["live"], RATE)
        engine.send(score.frames, score.messages)
        mix = engine.process_with_mix(RATE)[1]
        assert mix is not None and np.abs(mix).max() > 0.01
        return mix

    plugin = lend(Plugin(tmp_path / "livebass"))
    first = wanted(own)
    for sizes in ((512,), (1000, 1, 77)):
        plugin.plugin.reset(plugin.handle)
        assert np.array_equal(plugin.play(score, RATE, sizes), first), sizes
    plugin = lend(Plugin(tmp_path / "livebass", active=False))
    assert plugin.load_preset("plain")
    plugin.set(COMPRESSION, 0.5)
    plugin.set(DRIVE, 0.25)
    state = plugin.save()
    plugin = lend(Plugin(tmp_path / "livebass", active=False))
    assert plugin.load(state)
    plugin.activate()
    assert np.array_equal(plugin.play(score, RATE), wanted(replace(jazz, effects=Effects(0.5, 0.25))))


@contextmanager
def paper_bass(folder: Path) -> Iterator[Plugin]:
    """A plugin of a bass whose strings do not answer each other."""
    with closing(Plugin(folder, name=STRINGS)) as plugin:
        assert plugin.load_preset("paper-bass")
        yield plugin


def test_notes_of_one_key_on_two_channels_are_told_apart(folder: Path) -> None:
    """By channel or id; with neither, all notes of the key are meant."""

    def played(*events: tuple[int, Any]) -> Floats:
        notes = [note_on(45, 0.5, 7), note_on(45, 0.5, 8, channel=3)]  # the second one is on the D string
        with paper_bass(folder) as plugin:
            return plugin.play([*((0, note) for note in notes), *events], 6000)

    plain = played()
    for first, by_id, both in (
        (note_off(45), note_off(-1, 7), note_off(45, channel=-1)),
        (choke(45), None, choke(45, channel=-1)),
        (tuning(1.0, 45), tuning(1.0, number=7), tuning(1.0, 45, channel=-1)),
        (expression(PRESSURE, 1.0, 45), expression(PRESSURE, 1.0, number=7), expression(PRESSURE, 1.0, 45, channel=-1)),
    ):
        moved = played((1000, first))
        assert np.array_equal(moved[2], plain[2]) and not np.array_equal(moved[3], plain[3])
        assert by_id is None or np.array_equal(played((1000, by_id)), moved)
        everything = played((1000, both))
        assert np.array_equal(everything[3], moved[3]) and not np.array_equal(everything[2], plain[2])
    off = played((1000, note_off(45, channel=3)))
    assert np.array_equal(off[3], plain[3]) and not np.array_equal(off[2], plain[2])
    assert np.array_equal(played((1000, note_off(-1, channel=3)), (1001, note_on(28, 0.5)))[2], off[2])
    everything = played((1000, note_off(-1, channel=-1)))
    assert np.array_equal(everything[2], off[2]) and not np.array_equal(everything[3], plain[3])


def test_a_preset_has_every_value_as_its_bass_has_it(folder: Path) -> None:
    """Including the values its bass is built by; the processor's values stay."""
    with closing(Plugin(folder, active=False)) as plugin:
        moved = [p for p in PARAMETERS if p.symbol not in ("bass", "cores")]
        for p in moved:
            plugin.set(p.number, p.minimum if p.minimum != p.default else p.maximum)
        assert plugin.load_preset("slap")
        stay = {"quality", "running_ahead", "relief"}
        other = {p.symbol for p in moved if plugin.value(p.number) != p.default}
        assert other == {p.symbol for p in moved if p.symbol in stay and plugin.value(p.number) != p.default}
        assert {"running_ahead", "relief"} <= other


def test_two_plugins_and_their_presets_are_listed(folder: Path) -> None:
    library = Library(folder)
    assert library.plugins() == [(MONO, "livebass"), (STRINGS, "livebass strings")]
    titles = [load_preset(name).name for name in PRESETS]
    basses = [listed for listed in library.presets() if listed[1]]  # the others are factory sounds
    assert basses == [(t, name, [MONO, STRINGS]) for t, name in zip(titles, PRESETS, strict=True)]


def test_basses_of_one_title_are_told_apart(tmp_path: Path, own: Path, lend: Any) -> None:
    """The first one has the plain title; the names, which sessions save, stay the same."""
    basses = {"slap": load_preset("slap"), "other": load_preset("slap"), "paper-g": load_preset("paper-g")}
    clap.write_bundle(basses, tmp_path / "livebass")
    own.mkdir(parents=True)
    for name in ("a", "mine"):
        write_instrument(load_preset("slap"), own / f"{name}.lbass")
    titles = ["Slap", "Slap (other)", basses["paper-g"].name, "Slap (a)", "Slap (mine)"]
    assert distinct_titles(basses) == titles[:3]
    plugin = lend(Plugin(tmp_path / "livebass", active=False))
    listed = plugin.library.presets()
    assert [(title, key) for title, key, _ in listed if key] == list(zip(titles, [*basses, "a", "mine"], strict=True))
    assert [plugin.text(BASS, number) for number in range(5)] == titles
    assert [plugin.value_of(BASS, text) for text in titles] == list(range(5))
    plugin.set(BASS, 4)
    assert bass_of(plugin.save()) == "mine"


def test_notes_may_come_as_clap_has_them_or_as_midi(folder: Path) -> None:
    with closing(Plugin(folder, active=False)) as plugin:
        port = NOTE_PORT()
        assert plugin.extension("note-ports", PORTS).get(plugin.handle, 0, True, c.addressof(port))
        assert (port.supported, port.preferred) == (7, 1)


def test_outputs_of_strings_say_which_they_are(folder: Path, lend: Any) -> None:
    plugin = lend(Plugin(folder, name=STRINGS, active=False))
    assert plugin.outputs_called() == list(OUTPUTS) and OUTPUTS[0] == "String 1 (lowest)" and len(OUTPUTS) == 8


def test_parameters_are_those_of_the_table(plugin: Plugin) -> None:
    *found, overload = plugin.params()
    assert (overload.id, overload.name, overload.flags & 1 << 3, overload.flags & 1 << 5) == (500, b"Overload", 8, 0)
    assert plugin.value(500) == 0 and plugin.text(500, 2) == "2"
    assert [p.module.decode() for p in found] == [p.group for p in PARAMETERS]
    plugin.set(RELIEF, 1.0)
    assert [p.name.decode() for p in found] == [p.name for p in PARAMETERS]
    for wanted, p in zip(PARAMETERS, found, strict=True):
        maximum = len(PRESETS) - 1 if wanted.symbol == "bass" else wanted.maximum
        assert (p.minimum, p.maximum) == (wanted.minimum, maximum)
        assert p.default == plugin.value(p.id) == wanted.default
    assert plugin.text(BASS, 1) == "Slap" and plugin.value_of(BASS, "fretless") == 3
    assert plugin.text(TECHNIQUE, 2) == "thumb on two strings" and plugin.text(GAIN, -3.5) == "-3.5 dB"
    assert plugin.value_of(GAIN, "loud") is None
    plugin.set(GAIN, 100.0)
    assert plugin.value(GAIN) == 20.0
    plugin.set(GAIN, float("nan"))
    assert plugin.value(GAIN) == 0.0


def test_values_are_shown_in_the_units_of_musicians(plugin: Plugin) -> None:
    """As the bass then is, not as what was added to it; a text that a musician types is read back."""
    whole = load_preset(PRESETS[0])
    gap, strings, pickup = -1e3 * whole.necks[0].fret_heights[11], whole.strings, whole.output.pickups[0]
    thin, thick = (1120 / 25.4e-3 * strings[k].diameter for k in (-1, 0))
    player, length = whole.player, 1e3 * strings[0].length
    shown = (
        (ACTION, -0.4, f"{gap - 0.4:.2f} mm at fret 12"), (GAUGE, 12, f".{thin:03.0f}-.{thick:03.0f}"),
        (PARAMETER_ROWS["pickup_1_place"].number, 5, f"{1e3 * pickup.position + 5:.0f} mm from the bridge"),
        (PARAMETER_ROWS["tension"].number, 0, f"{strings[0].tension / 9.80665:.1f} kg on the lowest string"),
        (PARAMETER_ROWS["pickup_height"].number, 0.25, "+0.25 mm"), (PARAMETER_ROWS["fret"].number, 0, "none"),
        (BEND_RANGE, 0, f"{player.bend_range:g} semitones (preset)"), (BEND_RANGE, 7, "7 semitones"),
        (DAMPING, 1.0, f"{690 / player.hand_damping:.0f} ms to silence"),
        (POSITION, -1, f"{length * (1 - player.pluck_farthest):.0f} mm from the bridge"), (UNEVENNESS, 1.0, "50 %"),
    )  # fmt: skip
    for number, given, text in shown:
        assert plugin.text(number, given) == text
        read = plugin.value_of(number, text)
        assert read is not None and plugin.text(number, read).split("-.")[-1] == text.split("-.")[-1]
    assert plugin.value_of(ACTION, "1.9") == pytest.approx(1.9 - gap, abs=0.005)
    assert plugin.value_of(GAUGE, ".110") == plugin.value_of(GAUGE, "110") == pytest.approx(4.76, abs=0.05)
    plugin.set(GAUGE, 10.0)  # a thicker string is tighter
    assert plugin.text(shown[3][0], 0) == f"{1.21 * strings[0].tension / 9.80665:.1f} kg on the lowest string"


def test_every_parameter_is_on_a_page_of_its_group(plugin: Plugin) -> None:
    pages = plugin.pages()
    assert sorted(number for numbers in pages.values() for number in numbers) == list(range(len(PARAMETERS)))
    assert all(1 <= len(numbers) <= 8 for numbers in pages.values())
    for name, numbers in pages.items():
        group = name.rstrip(" 123456789")
        assert {PARAMETERS[number].group for number in numbers} == {group}
        assert (name == group) == (sum(p.group == group for p in PARAMETERS) <= 8)


def test_a_choke_ends_a_note_under_the_pedal(folder: Path, lend: Any) -> None:
    plugin = lend(Plugin(folder, name=STRINGS))
    events = [(0, midi(bytes([0xB0, 64, 127]))), (0, note_on(33, 0.9)), (0, note_on(28, 0.9)), (9600, choke(33))]
    out = plugin.play(events, RATE)
    peak = np.abs(out[1, :9600]).max()
    assert np.abs(out[1, 14400:]).max() < 1e-3 * peak and np.abs(out[0, 14400:]).max() > 0.05 * peak


def test_the_host_hears_of_a_program_change(plugin: Plugin) -> None:
    """By General MIDI, counted from 0."""
    plugin.offline()
    for program, bass in ((36, 1), (32, 1), (35, 3), (99, 3), (33, 0)):  # 32 is flatwound's
        plugin.block(64, [midi(bytes([0xC0, program]))])
        assert plugin.value(BASS) == bass, program
        plugin.block(64)
    assert [x for number, x in plugin.reported if number == BASS] == [1, 3, 0]


def test_it_sleeps_when_no_string_moves(folder: Path, lend: Any) -> None:
    """After waking it sounds as if it had not slept."""

    def played(sleeps: bool) -> Floats:
        plugin = lend(Plugin(folder))
        out = [plugin.block(512)]
        assert plugin.asleep
        out.append(plugin.block(9600, [note_on(40, 0.8)]))
        assert not plugin.asleep
        plugin.block(512, [choke(40)])
        rest = 0
        while not plugin.asleep:
            plugin.block(4800)
            rest += 1
            assert rest < 600
        for _ in range(0 if sleeps else 7):
            assert not plugin.block(480).any()
        out.append(plugin.block(9600, [note_on(45, 0.8)]))
        return np.concatenate(out)

    assert np.array_equal(played(True), played(False))


def test_notes_go_by_their_ids(folder: Path) -> None:
    """The id 0 is like any other, an id may be used again, and it alone can release a note."""

    def played(*events: tuple[int, Any], reset: bool = False) -> Floats:
        with paper_bass(folder) as plugin:
            if reset:
                plugin.play([(0, note_on(60, 0.5, 3))], 512)
                plugin.plugin.reset(plugin.handle)
            return plugin.play([(0, note_on(28, 0.5, 3)), (512, note_on(33, 0.5, 0)), *events], 9600)

    plain, bend = played(), tuning(2.0, 33)
    bent = played((1000, bend))
    assert np.array_equal(bent[0], plain[0]) and not np.array_equal(bent[1], plain[1])
    assert np.array_equal(played((1000, tuning(2.0, number=0))), bent)
    assert np.array_equal(played((1000, tuning(2.0, number=0)), reset=True), bent)
    off = played((1000, note_off(33)))
    assert np.array_equal(off[0], plain[0]) and not np.array_equal(off[1], plain[1])
    assert np.array_equal(played((1000, note_off(-1, 0))), off)
    assert np.array_equal(played((1000, note_off(-1, 9))), plain)  # there is no such note
    both = played((1000, note_off(-1)))
    assert np.array_equal(both[1], off[1]) and not np.array_equal(both[0], plain[0])
    again = [(1000, note_off(33)), (2000, note_on(28, 0.7, 0))]  # a lower key with a higher one's id
    assert np.array_equal(played(*again, (3000, tuning(2.0, number=0))), played(*again, (3000, tuning(2.0, 28))))


@pytest.mark.parametrize(("number", "controller"), [(PALM, 9), (VIBRATO, 1)], ids=["palm_mute", "vibrato"])
def test_palm_mute_and_vibrato_do_what_their_controllers_do(folder: Path, number: int, controller: int) -> None:
    def played(*more: tuple[int, Any]) -> Floats:
        with closing(Plugin(folder)) as plugin:
            return plugin.play([(0, note_on(40, 0.8)), *more, (40000, note_off(40))], RATE, (480,))

    moved = played((4800, midi(bytes([0xB0, controller, 127]))), (30000, midi(bytes([0xB0, controller, 0]))))
    assert np.array_equal(played((4800, value(number, 1.0)), (30000, value(number, 0.0))), moved)
    assert not np.array_equal(moved, played())


def test_a_state_that_is_none_is_refused_with_one_line(plugin: Plugin) -> None:
    state = plugin.save()
    later = read(state)
    later[""] |= {"format": "2", "made": '"9.1"'}
    wrong = {
        b"": "not one of this plugin", b"?" * len(state): "not one of this plugin", state[:-1]: "damaged",
        state + b"\0": "damaged", state[:300] + b"\1" + state[301:]: "damaged", state[:60]: "damaged",
        state_written(later): f"was made by livebass 9.1; this one, {__version__}, cannot read it",
        b"LBSTATE\n" + bytes(900): "was made by a livebass before 0.1.0",
    }  # fmt: skip
    plugin.set(GAIN, -3.0)
    for data, reason in wrong.items():
        plugin.logged.clear()
        assert not plugin.load(data)
        assert len(plugin.logged) == 1 and reason in plugin.logged[0] and "\n" not in plugin.logged[0]
    assert plugin.value(GAIN) == -3.0


def test_a_preset_takes_the_place_of_a_missing_bass(plugin: Plugin, tmp_path: Path, lend: Any) -> None:
    """Everything else is taken over, and the name is saved again until another bass is chosen."""
    numbers = (GAIN, TONE, POSITION, DYNAMICS, TECHNIQUE, DAMPING, UNEVENNESS, BEND_RANGE, PALM, VIBRATO, BASS, QUALITY)
    changes = dict(zip(numbers, (-6.0, -0.5, 0.7, 5.0, 3, 0.4, 0.3, 12, 0.6, 0.8, 3, 1), strict=True))
    for number, wanted in changes.items():
        plugin.set(number, wanted)
    basses = {name: load_preset(name) for name in ("slap", "jazz-finger")}
    clap.write_bundle(basses, tmp_path / "livebass")
    other, state = lend(Plugin(tmp_path / "livebass", active=False)), without_instrument(plugin.save())
    assert other.load(state) and other.rescanned
    assert other.load(other.save())
    assert other.logged == ["the session's instrument is not installed: fretless"]
    assert {number: other.value(number) for number in changes} == {**changes, BASS: 0}
    other.set(BASS, 0)  # it was 0 already
    assert plugin.load(other.save()) and without_instrument(plugin.save()) == state
    other.set(BASS, 1)
    assert plugin.load(other.save()) and plugin.value(BASS) == PRESETS.index("jazz-finger")
    assert other.load(state) and other.load_preset("jazz-finger")
    assert plugin.load(other.save()) and plugin.value(BASS) == PRESETS.index("jazz-finger")


def test_the_quality_follows_the_bass_until_it_is_moved(tmp_path: Path, lend: Any) -> None:
    """A session keeps the quality; without a word in the list it is live."""
    names = ["jazz-finger", "slap", "fretless"]
    basses = {name: load_preset(name) for name in names}
    clap.write_bundle(basses, tmp_path / "plain")
    clap.write_bundle(basses, tmp_path / "fine", qualities={"jazz-finger": "studio", "slap": "live"})
    assert (tmp_path / "fine" / "instruments.txt").read_text() == "jazz-finger studio\nslap\nfretless\n"
    plugin, other = (lend(Plugin(tmp_path / name)) for name in ("fine", "plain"))
    assert plugin.value(QUALITY) == plugin.params()[QUALITY].default == 1 and other.value(QUALITY) == 0
    score = hard_score(notes=3)
    sound = mono("jazz-finger", score, "studio")
    assert np.array_equal(plugin.play(score, len(sound)), sound) and not plugin.reported
    state = plugin.save()
    assert other.load(state) and other.value(QUALITY) == 1, "the session has its own"
    plugin.block(64, [value(BASS, 1)])
    assert plugin.value(QUALITY) == 0 and plugin.reported == [(QUALITY, 0.0)]
    plugin.set(QUALITY, 1)
    plugin.set(BASS, 2)
    plugin.block(64)
    assert plugin.value(QUALITY) == 1 and len(plugin.reported) == 1, "the user has moved it"
    assert plugin.load(state) and (plugin.value(BASS), plugin.value(QUALITY)) == (0, 1)
    plugin.set(QUALITY, 0)
    assert other.load(plugin.save()) and plugin.load(other.save()) and plugin.value(QUALITY) == 0


def test_the_main_thread_changes_the_bass(plugin: Plugin) -> None:
    notes = [note_on(40, 0.8), midi(bytes([0x80, 40, 0]))]
    notes[1].time = 100
    plugin.block(512, notes)
    for number, title in [(1, "Slap"), (3, "Fretless jazz bass"), (0, "Jazz bass, fingers")]:
        plugin.block(512, [value(BASS, number)])
        assert plugin.requested == 1
        plugin.block(512)  # the old bass plays on
        assert plugin.requested == 1
        for _ in range(40):
            plugin.work()
            assert np.isfinite(plugin.block(512, notes)).all()
        assert plugin.text(BASS, plugin.value(BASS)) == title
    assert not plugin.logged and not plugin.requested


def test_a_flood_of_values_of_what_the_bass_is_built_by_ends_as_its_last(plugin: Plugin) -> None:
    """Offline: a block holds more values than there are places."""
    plugin.offline()
    events = [value(ACTION if k % 2 else GAUGE, 0.01 * k) for k in range(41)]
    for k, event in enumerate(events):
        event.time = 10 * k
    assert np.isfinite(plugin.block(512, events)).all()
    assert (plugin.value(ACTION), plugin.value(GAUGE)) == (0.39, 0.4) and not plugin.logged


@pytest.mark.parametrize(("preset", "name"), [("slap", MONO), ("paper-bass", STRINGS), ("fretless", MONO)])
def test_threads_of_the_host_change_no_bit(folder: Path, preset: str, name: str) -> None:
    """For any number of threads and any blocks, even if the host declines, or has none."""
    score = hard_score(notes=4 if preset == "fretless" else 12)

    def played(pool: int, sizes: tuple[int, ...]) -> tuple[Floats, Plugin]:
        plugin = Plugin(folder, name=name, active=False, pool=pool)
        assert plugin.load_preset(preset)
        plugin.activate()
        sound = plugin.play(score, RATE // 2, sizes)
        plugin.close()
        return sound, plugin

    alone, plugin = played(-1, (512,))
    assert np.abs(alone).max() > 0.1 and not plugin.tasks
    for pool, sizes in [(2, (512,)), (4, (4096, 3, 100)), (3, (64,)), (0, (512,))]:
        sound, plugin = played(pool, sizes)
        assert np.array_equal(sound, alone), (pool, sizes)
        assert plugin.tasks and {*plugin.tasks} <= {2, 3, 4}, "a thread for one string is none too many"
        assert (plugin.helped > 0.005) == (pool > 0)


def test_offline_the_hosts_threads_are_not_asked(folder: Path, lend: Any) -> None:
    plugin, score = lend(Plugin(folder, pool=2)), hard_score()
    wanted = mono("jazz-finger", score)
    plugin.offline()
    assert np.array_equal(plugin.play(score, len(wanted)), wanted) and not plugin.tasks


def test_the_hosts_threads_play_on_after_a_reset_and_another_bass(folder: Path, lend: Any) -> None:
    plugin, score = lend(Plugin(folder, pool=2)), hard_score()
    plugin.set(CORES, 4)
    for _ in range(2):
        plugin.tasks.clear()
        assert np.array_equal(plugin.play(score, RATE // 2), mono("jazz-finger", score)[: RATE // 2])
        assert plugin.tasks and not plugin.requested and not helpers(), "none of the plugin's own besides"
        plugin.plugin.reset(plugin.handle)
    plugin.set(BASS, 1)
    plugin.block(64)
    plugin.work()
    plugin.tasks.clear()
    plugin.play(score, RATE)
    assert plugin.tasks


REFUSED = """
import os, sys
from pathlib import Path
from support.clap import Plugin
from support.plugins import helpers
plugin = Plugin(Path(sys.argv[1]))
os.setuid(os.getuid() or 65534)
plugin.set(16, 2)
for _ in range(3):
    plugin.block(64)
    plugin.work()
assert not helpers()
print(*plugin.logged, sep="\\n")
"""


@NO_THREADS
@pytest.mark.skipif(resource.getrlimit(resource.RLIMIT_RTPRIO)[0] > 0, reason="everyone may have real-time priority")
def test_without_real_time_priority_it_says_so_once_and_plays_alone(folder: Path) -> None:
    assert python(REFUSED, folder, check=True).stdout == NO_HELPERS + "\n"


@pytest.mark.skipif(this_system().ending != "so", reason="glibc's names of malloc")
def test_process_allocates_nothing(folder: Path, tmp_path: Path) -> None:
    """It does not lock either: a counting C host sends random events, changes of bass and states."""
    host = counting_host(tmp_path)
    for seed, pool in (("1", "0"), ("2", "3")):
        done = subprocess.run([host, folder / "livebass.clap", "1", seed, pool], capture_output=True, text=True)
        assert done.returncode == 0, done.stderr
        blocks, allocations, greatest = done.stdout.split()
        assert int(blocks) > 50 and allocations == "0" and 0 < float(greatest) < 1000
    written = [tmp_path / name for name in ("a.raw", "b.raw")]  # the clock changes nothing: the same in every run
    for path in written:
        subprocess.run([host, folder / "livebass.clap", "1", "2", "2", path], check=True, capture_output=True)
    assert written[0].stat().st_size > 100_000 and written[0].read_bytes() == written[1].read_bytes()
