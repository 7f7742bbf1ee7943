"""The VST3 plugin in pedalboard, a JUCE host, plays exactly what `livebass render` renders."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Sequence
from ctypes import c_uint8
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from support import states
from support import vst3 as low
from support.needs import package
from support.plugins import PRESETS, RATE, hard_score, messages_in_s, midi_score, mono, write_bundle

from livebass import load_preset
from livebass.live.parameters import GROUPS, OUTPUTS, PARAMETERS
from livebass.model.keymap import MODO, MODO_12
from livebass.plugin import vst3
from livebass.rows.arrays import Floats
from livebass.rows.techniques import PARAMETER_ROWS
from livebass.score.score import Score

MONO, STRINGS = "livebass", "livebass strings"
GAIN, TONE, BASS, QUALITY, CORES = 0, 1, 8, 9, 16
CONTROLLERS, VOLUME, EXPRESSION, SUSTAIN, BEND = 1000, 7, 11, 64, 129  # hidden parameters
OVERLOAD = 500
Make = Callable[..., low.Plugin]
ACTION = next(p.number for p in PARAMETERS if p.symbol == "action")


@pytest.fixture(scope="module")
def bundle(thread_checks: None, tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_bundle(vst3, tmp_path_factory.mktemp("vst3") / "livebass.vst3")


@pytest.fixture
def make(bundle: Path, lend: Any) -> Make:
    """Makes plugins in our own host, of the usual bundle."""
    return lambda *arguments, **more: lend(low.Plugin(bundle, *arguments, **more))


@pytest.fixture
def plugin(bundle: Path) -> Any:
    return load(bundle)


def load(bundle: Path, name: str = MONO) -> Any:
    """One plugin of a bundle in the host, which waits for a while until it hears middle C."""
    made = package("pedalboard", "").load_plugin(str(bundle), plugin_name=name, initialization_timeout=0.5)
    made.relief_under_overload = False  # tests do not run in real time
    return made


def play(plugin: Any, score: Score, frames: int, size: int = 512, reset: bool = True) -> Floats:
    """Plays `frames` of a score in blocks of `size`."""
    return plugin.process(messages_in_s(score), (frames + 0.25) / score.rate, score.rate, 1, size, reset)[0]


def test_a_host_made_with_juce_plays_what_is_rendered(plugin: Any, tmp_path: Path) -> None:
    """MIDI files too, in blocks of one frame: it passes on one controller value per block, at its beginning."""
    score, midi = hard_score(), midi_score(tmp_path / "a.mid")
    wanted = mono("slap", score)
    plugin.bass = "Slap"
    for size in (64, 8192):
        assert np.array_equal(play(plugin, score, len(wanted), size), wanted), size
    wanted = mono("slap", midi)
    assert np.array_equal(play(plugin, midi, len(wanted), 1), wanted)


def test_parameters_and_presets_are_listed(plugin: Any) -> None:
    listed = [p for p in plugin.parameters.values() if p.name in [q.name for q in PARAMETERS]]
    assert sorted(p.name for p in listed) == sorted(p.name for p in PARAMETERS)  # this host lists them by group
    assert plugin.parameters["bass"].valid_values == [load_preset(name).name for name in PRESETS]
    assert plugin.stroke == "preset" and plugin.gain_db == 0 and plugin.bend_range_semitones == 2
    plugin.stroke, plugin.gain_db = "thumb on all", -7.5
    assert plugin.stroke == "thumb on all" and plugin.gain_db == pytest.approx(-7.5)


def test_bass_and_cores_are_not_automatable(make: Make) -> None:
    """A value between 0 and 1 would mean another bass after an instrument is added. The bass is the list's program."""
    plugin = make(low.STRINGS)
    flags = {number: info.flags for number, info in plugin.parameters().items() if number < len(PARAMETERS)}
    assert [number for number, x in flags.items() if not x & low.CAN_AUTOMATE] == [BASS, CORES]
    assert flags[BASS] == low.IS_LIST | low.IS_PROGRAM_CHANGE
    assert plugin.outputs_called() == list(OUTPUTS)


def of_two_key_maps(folder: Path) -> Path:
    """A bundle whose second bass has another key map."""
    slap = load_preset("slap")
    basses = {"default": slap, "other": replace(slap, player=replace(slap.player, keys=MODO_12))}
    vst3.write_bundle(basses, folder / "livebass.vst3")
    return folder / "livebass.vst3"


def test_key_switches_are_names_of_pitches_too(tmp_path: Path, lend: Any) -> None:
    """As key switches of the chosen bass, and as pitch names of every program."""
    plugin = lend(low.Plugin(of_two_key_maps(tmp_path)))
    default, second = ({key for key, *_ in keys.keys} for keys in (MODO, MODO_12))
    found = plugin.switches()
    assert set(found) == default and (found[10], found[12], found[16]) == ("Ghost notes", "Hammer-on", "String E")
    names = [plugin.pitches_called(program) for program in range(2)]
    assert names[0] == found and set(names[1]) == second and names[1][32] == "Stop on release"
    plugin.block(64, points=[(BASS, 0, 1.0)])
    assert plugin.switches() == names[1]


def test_the_host_is_told_of_other_key_switches(tmp_path: Path, lend: Any) -> None:
    """Once per bass, in its own thread, when the switches are already the new bass's."""
    plugin = lend(low.Plugin(of_two_key_maps(tmp_path)))
    reported, here = low.Handler(plugin), (low.SWITCHES_CHANGED, threading.get_ident())
    values = (low.VALUES_CHANGED, here[1])
    names = [plugin.pitches_called(program) for program in range(2)]
    first = plugin.save()
    for active in (True, False):
        plugin.set(BASS, 1.0)
        assert reported.restarts.pop() == here and plugin.switches() == names[1]
        plugin.set(BASS, 1.0)
        plugin.set(0, 0.5)
        assert plugin.load(plugin.save()) and reported.restarts.pop() == values
        assert plugin.load(first)
        assert reported.restarts.pop() == here and reported.restarts.pop() == values and plugin.switches() == names[0]
        if active:
            plugin.block(64, points=[(BASS, 0, 1.0)])
            assert not reported.restarts, "the audio thread is none for that"
            plugin.set(BASS, 1.0)
            assert reported.restarts.pop() == here
            assert plugin.load(first) and reported.restarts.pop() == here and reported.restarts.pop() == values
            assert plugin.component.call(11, c_uint8(0)) == 0
    assert not reported.restarts and not reported.edits


def test_a_session_names_its_bass(bundle: Path, plugin: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """It stays the same in a longer list in another order."""
    assert list(PRESETS[:2]) == ["jazz-finger", "slap"]
    plugin.bass, plugin.tone = "Slap", "7.5 of 10"
    copy = tmp_path / "livebass.vst3"
    names = ("paper-g", "slap", "muted", "jazz-finger", "five-string", "drop-d")
    vst3.write_bundle({name: load_preset(name) for name in names}, copy)
    other = load(copy)
    other.raw_state = plugin.raw_state
    tones = [p.parameters["tone"].raw_value for p in (plugin, other)]
    assert other.bass == "Slap" and tones[0] == tones[1] != 0.5
    score = hard_score()
    assert np.array_equal(play(other, score, 9600), play(plugin, score, 9600))


def test_a_session_in_a_host_made_with_juce_plays_as_before(bundle: Path, plugin: Any) -> None:
    """With a pick, a muting palm and an action of 1.4 mm."""
    score, own, plain = hard_score(), plugin.raw_state, play(plugin, hard_score(), 9600)
    plugin.stroke, plugin.palm_mute, plugin.action = "pick", "50 %", "1.40 mm at fret 12"
    wanted, state = play(plugin, score, 9600), plugin.raw_state
    assert not np.array_equal(wanted, plain)
    other = load(bundle)
    for kept, sound in ((state, wanted), (own, plain)):
        other.raw_state = kept
        assert np.array_equal(play(other, score, 9600), sound)


def test_an_rpn_is_selected_before_its_data(make: Make) -> None:
    """In one frame, by a host whose data queue comes first and which deselects the RPN afterwards."""

    def played(queues: Sequence[tuple[int, int]], bend: float = 0.5) -> Floats:
        plugin = make(low.STRINGS, low.OFFLINE)
        points = [(CONTROLLERS + k, 0, x / 127) for k, x in queues] + [(plugin.mapped(2, BEND), 1000, bend)]
        return plugin.block(4096, [low.note_on(35, 0.5, 1, 0, 1), low.note_on(40, 0.5, 2, 0, 2)], points)[:, 0]

    turned = ((6, 15), (100, 6), (100, 127), (101, 0), (101, 127))
    plain, bent = played(turned), played(turned, 0.52)
    assert np.array_equal(bent[1], plain[1]) and not np.array_equal(bent[2], plain[2])
    assert not np.array_equal(played((), 0.52)[2], bent[2])  # without MPE its range is 2 semitones


def test_a_host_made_with_juce_plays_mpe(plugin: Any) -> None:
    """As MIDI, which it turns into parameter points."""
    keys = (35, 45)

    def played(*bends: float) -> list[float]:
        """The pitches of two notes, semitones from their keys, with wheels that bend by `bends`."""
        set_up = [bytes([0xB0, number, x]) for number, x in ((101, 0), (100, 6), (6, 15))]
        notes = [bytes([0x91 + k, key, 70]) for k, key in enumerate(keys)]
        wheels = [8192 + round(8192 * bend / 48) for bend in bends]
        moves = [bytes([0xE1 + k, wheel & 127, wheel >> 7]) for k, wheel in enumerate(wheels)]
        messages = [(message, (1 + 100 * k) / RATE) for k, message in enumerate([*set_up, *notes, *moves])]
        out = plugin.process(messages, 1.0, RATE, 1, 64, True)[0][12000:]
        spectrum, found = np.abs(np.fft.rfft(out * np.hanning(len(out)), 1 << 19)), []
        for key in keys:
            f = 440 * 2 ** ((key - 69) / 12)
            first, last = (round(x * f * (1 << 19) / RATE) for x in (0.92, 1.09))
            peak = first + int(np.argmax(spectrum[first:last]))
            found.append(12 * float(np.log2(peak * RATE / (1 << 19) / f)))
        return found

    plain = played(0.0, 0.0)
    assert np.subtract(played(1.0, -1.0), plain) == pytest.approx([1.0, -1.0], abs=0.05)
    assert np.subtract(played(1.0, 0.0), plain) == pytest.approx([1.0, 0.0], abs=0.05)


def test_offline_it_plays_what_it_plays_in_real_time(make: Make) -> None:
    """As long as overload relieves no string; relief is on by default."""
    score = [low.note_on(28 + 5 * k, 0.9, k, 300 * k) for k in range(4)]

    def played(mode: int) -> tuple[Floats, list[tuple[int, float]]]:
        plugin = make(low.STRINGS, mode, relief=True)
        assert plugin.default(low.RELIEF) == 1.0
        out = np.concatenate([plugin.block(4096, score if k == 0 else ()) for k in range(4)], axis=-1)
        return out, plugin.reported

    wanted, reported = played(low.OFFLINE)
    assert wanted.any() and not reported
    until, found, reported = time.monotonic() + 30, *played(low.REAL_TIME)
    while reported and time.monotonic() < until:  # wait for a busy machine
        found, reported = played(low.REAL_TIME)
    assert not reported and np.array_equal(found, wanted)


def test_overload_is_told_by_a_parameter_that_cannot_be_set(make: Make) -> None:
    """The number of relieved strings, in one-frame blocks with a hundred notes; offline none is."""
    chord = [low.note_on(28 + k % 20, 1.0, k) for k in range(100)]
    offline = make(mode=low.OFFLINE, relief=True)
    info = offline.parameters()[OVERLOAD]
    assert (info.flags, info.steps, low.wide(info.title)) == (low.IS_READ_ONLY, 8, "Overload")
    assert list(offline.parameters())[-1] == OVERLOAD
    assert [offline.text(OVERLOAD, k / 8) for k in (0, 1, 8)] == ["0", "1", "8"] and offline.default(OVERLOAD) == 0.0
    for _ in range(20):
        offline.block(1, chord)
    assert not offline.reported
    plugin = make(relief=True)
    for _ in range(20):
        plugin.block(1, chord)
    assert plugin.reported[0] == (OVERLOAD, 1 / 8)
    until = time.monotonic() + 30
    while plugin.reported[-1][1] and time.monotonic() < until:
        plugin.block(4096)
    assert plugin.reported[-1] == (OVERLOAD, 0.0)


def test_blocks_of_zeros_are_called_silent(make: Make) -> None:
    plugin = make(low.STRINGS, low.OFFLINE)
    heard = []
    for k in range(120):
        events = {3: [low.note_on(40, 0.5, 1, 4000)], 4: [low.note_off(40, 1)]}.get(k, [])
        heard.append(bool(plugin.block(4096, events).any()))
        assert plugin.silent != heard[-1], k
    assert heard[3] and not heard[2] and not heard[119]


def test_parameters_come_in_groups(make: Make) -> None:
    """Except the bass, which is in the program list."""
    plugin = make()
    units, found = plugin.units(), plugin.parameters()
    assert list(units.values()) == [("livebass", -1, 1), *((group, 0, -1) for group in (*GROUPS, "MIDI"))]
    for number, p in enumerate(PARAMETERS):
        assert units[found[number].unit][0] == ("livebass" if number == BASS else p.group), p.symbol
    assert units[found[OVERLOAD].unit][0] == PARAMETERS[low.RELIEF].group
    assert {units[p.unit][0] for number, p in found.items() if number > OVERLOAD} == {"MIDI"}


def test_hosts_add_the_units(make: Make) -> None:
    """Except to sliders, whose texts have them."""
    plugin = make()
    found = plugin.parameters()
    for symbol, value, text, unit in (
        ("gain", 0.75, "0.0", "dB"), ("bend_range", 7 / 24, "7", "semitones"), ("pickup_height", 0.5, "preset", ""),
        ("pickup_height", 0.75, "+1.50 mm", ""),
        ("wear", 0.5, "625 %", ""),
    ):  # fmt: skip
        number = PARAMETER_ROWS[symbol].number
        assert (plugin.text(number, value), low.wide(found[number].unit_name)) == (text, unit)


def test_a_note_with_the_id_0_is_tuned(make: Make) -> None:
    def played(number: int) -> Floats:
        plugin = make(mode=low.OFFLINE)
        out = [plugin.block(1000, [low.note_on(33, 0.5, number)]), plugin.block(4000, [low.tuning(1.0, number)])]
        return np.concatenate(out, axis=-1)

    assert np.array_equal(played(0), played(7))


def test_controllers_stand_as_the_synth_has_them(make: Make) -> None:
    """Moving each to its default changes nothing."""

    def played(points: list[tuple[int, int, float]]) -> Floats:
        plugin = make(mode=low.OFFLINE)
        return plugin.block(4000, [low.note_on(33, 0.5, 1)], points)

    plugin = make()
    default = {number: plugin.default(CONTROLLERS + number) for number in (VOLUME, EXPRESSION, SUSTAIN, BEND)}
    assert default == {VOLUME: 1.0, EXPRESSION: 1.0, SUSTAIN: 0.0, BEND: 0.5}
    assert np.array_equal(played([(CONTROLLERS + k, 0, x) for k, x in default.items()]), played([]))


@pytest.mark.parametrize(
    ("number", "value"), [(VOLUME, 0.25), (EXPRESSION, 0.5), (1, 1.0), (BEND, 0.9), (SUSTAIN, 1.0)]
)
def test_controllers_move_the_notes_of_their_channel(make: Make, number: int, value: float) -> None:
    """Each channel has its own, as parameters that no host shows."""

    def played(channel: int) -> Floats:
        plugin = make(low.STRINGS, low.OFFLINE)
        notes = [low.note_on(35, 0.5, 1, 0, 1), low.note_on(40, 0.5, 2, 0, 2)]
        points = [(plugin.mapped(channel, number), 500, value)] if channel >= 0 else []
        return plugin.block(4000, [*notes, low.note_off(35, 1, 600, 1), low.note_off(40, 2, 600, 2)], points)[:, 0]

    plain = played(-1)
    maximum = 0.05 * np.abs(plain).max() if number == SUSTAIN else 0.0  # strings answer while a pedal is down
    for channel, moved, other in ((1, 1, 2), (2, 2, 1)):
        sound = played(channel)
        assert np.abs(sound[other] - plain[other]).max() <= maximum and not np.array_equal(sound[moved], plain[moved])
    assert all(np.abs(played(c)[1:3] - plain[1:3]).max() <= maximum for c in (0, 15))  # the first has the bass's floor


def test_every_controller_of_every_channel_has_a_hidden_parameter(make: Make) -> None:
    """Ids are permanent: sessions use them."""
    plugin = make()
    known, ids = plugin.parameters(), {(c, n): plugin.mapped(c, n) for c in range(16) for n in range(BEND + 1)}
    assert len(set(ids.values())) == len(ids) and set(ids.values()) <= set(known)
    assert {known[number].flags for number in ids.values()} == {low.IS_HIDDEN}
    assert all(ids[0, n] == CONTROLLERS + n for n in range(128) if n != 74)
    assert [ids[c, n] for c in range(16) for n in (BEND, 128, 74)] == list(range(2000, 2048))
    assert ids[1, 0] == 3128 and ids[15, 127] == 5047
    assert [known[ids[7, n]].default for n in (VOLUME, EXPRESSION, SUSTAIN)] == [1.0, 1.0, 0.0]


def test_a_thread_of_the_plugin_changes_the_bass_in_real_time(make: Make) -> None:
    def beginning(plugin: low.Plugin) -> Floats:
        """The first sound of a note, played fresh."""
        assert plugin.processor.call(8, c_uint8(0)) == plugin.processor.call(8, c_uint8(1)) == 0
        return plugin.block(1000, [low.note_on(40, 0.9, 1)])[0, 0]

    offline, wanted = make(mode=low.OFFLINE), []
    for number in range(3):
        offline.block(1, points=[(BASS, 0, number / 3)])
        wanted.append(beginning(offline))
    assert not np.array_equal(wanted[0], wanted[1]) and not np.array_equal(wanted[1], wanted[2])
    plugin = make()
    assert plugin.programs() == [load_preset(name).name for name in PRESETS]
    assert plugin.expressions() == [
        (low.TUNING, "Tuning"), (low.EXPRESSION_VIBRATO, "Vibrato"), (low.BRIGHTNESS, "Plucking place"),
    ]  # fmt: skip
    assert plugin.physical() == [low.TUNING, low.BRIGHTNESS, low.EXPRESSION_VIBRATO] and plugin.needs() == 0
    for number in (1, 2, 0):
        plugin.block(64, [low.note_on(40, 0.9, 1)], [(BASS, 0, number / 3)])
        until = time.monotonic() + 30
        while not np.array_equal(beginning(plugin), wanted[number]) and time.monotonic() < until:
            for _ in range(30):  # the basses cross-fade in between
                assert np.isfinite(plugin.block(256, [low.note_on(45, 0.9, 1)])).all()
                time.sleep(0.002)
        assert time.monotonic() < until


def test_the_host_hears_of_the_quality_that_follows_the_bass(tmp_path: Path, lend: Any) -> None:
    basses = {name: load_preset(name) for name in ("jazz-finger", "slap")}
    vst3.write_bundle(basses, tmp_path / "livebass.vst3", qualities={"jazz-finger": "studio"})
    plugin = lend(low.Plugin(tmp_path / "livebass.vst3"))
    assert plugin.default(QUALITY) == 1
    plugin.block(64)
    assert not plugin.reported
    plugin.block(64, points=[(BASS, 0, 1.0)])
    plugin.block(64)
    assert plugin.reported == [(QUALITY, 0.0)], "it follows the bass"


def test_a_block_without_frames_tells_values(make: Make) -> None:
    """Including values the bass is built by."""
    minimum, maximum = PARAMETERS[ACTION].minimum, PARAMETERS[ACTION].maximum
    plugin = make(mode=low.OFFLINE)
    plugin.block(0, points=[(ACTION, 0, 0.7)])
    action = states.values_of(plugin.save())["action"]
    assert action == pytest.approx(minimum + 0.7 * (maximum - minimum), abs=0.01)


def test_stereo_is_twice_the_same(make: Make) -> None:
    plugin = make()
    assert not plugin.set_speakers([low.MONO_SPEAKER] * 2)
    assert plugin.set_speakers([low.STEREO_SPEAKERS])
    out = plugin.block(2000, [low.note_on(40, 0.9, 1)], channels=2)
    assert out.any() and np.array_equal(out[0, 0], out[0, 1])
    apart = make(low.STRINGS)
    assert not apart.set_speakers([low.STEREO_SPEAKERS] * apart.outputs)
    assert apart.set_speakers([low.MONO_SPEAKER] * apart.outputs)
