"""The promises of the plugins in all formats, tested in our hosts: one list for CLAP, VST3 and LV2."""

from __future__ import annotations

import itertools
import os
import re
import shutil
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from support.costs import quick
from support.hosts import FORMATS, HOSTS, PLACE, TUNING, VIBRATO, Event, Expression, Host
from support.plugins import DAMAGES, NO_THREADS, PRESETS, RATE, hard_score, helpers, midi_score, mono, render_preset
from support.scores import SWITCH_KEYS
from support.states import bass_of, without_instrument
from support.tabs import as_gp, hard_tab

from livebass import load_preset, score_of
from livebass.cli.hands import SOUND, Loader
from livebass.engine.render import mix_strings
from livebass.live.parameters import NUMBERS, PARAMETERS
from livebass.model.keymap import MODO
from livebass.plugin import bundle
from livebass.plugin.systems import SYSTEMS, this_system
from livebass.rows.arrays import Floats
from livebass.rows.techniques import PARAMETER_ROWS, PICKED, POPS, STROKE_OF, TECHNIQUE_ROWS
from livebass.score.reading import read_score
from livebass.tab.reading import TabRequest, arrange

pytestmark = pytest.mark.skipif(this_system().name != "linux-x86_64", reason="hosts by ctypes")
JAZZ, SLAP, _, FRETLESS = range(4)  # of PRESETS
MPE = [(0, bytes(m)) for m in ([0xB0, 101, 0], [0xB0, 100, 6], [0xB0, 6, 15])]
HEARD = 1e-3  # above the noise of the electronics
KEYS = {symbol: key for key, symbol, _ in MODO.keys}
STROKES = {symbol: STROKE_OF[row.number] for symbol, row in TECHNIQUE_ROWS.items() if STROKE_OF[row.number]}
SWITCHED = [p.symbol for p in PARAMETERS if p.group == "Techniques" and p.symbol != "detach"]  # it has no key here
ACTION = PARAMETER_ROWS["action"].number
SWITCHES = {10: "Ghost notes", 12: "Hammer-on", 16: "String E"}


def on(key: int, velocity: int = 64, channel: int = 0) -> bytes:
    return bytes([0x90 | channel, key, velocity])


def off(key: int, channel: int = 0) -> bytes:
    return bytes([0x80 | channel, key, 0])


@pytest.fixture(scope="module")
def places(thread_checks: None, tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    """A bundle of PRESETS for each format."""
    folder = tmp_path_factory.mktemp("promises")
    made = {name: HOSTS[name].write(folder / name) for name in FORMATS}
    return {**made, "clap-midi": made["clap"]}


@pytest.fixture
def make(kind: str, places: dict[str, Path], lend: Any) -> Any:
    """Makes a host, of the usual bundle or one in another folder."""
    return lambda place=places[kind], **more: lend(HOSTS[kind](place, **more))


@pytest.fixture
def host(make: Any) -> Host:
    return make()  # type: ignore[no-any-return]


every_format = pytest.mark.parametrize("kind", FORMATS)
one_format = pytest.mark.parametrize("kind", quick(FORMATS, ["clap"]))  # where the formats share the code
every_host = pytest.mark.parametrize("kind", HOSTS)
with_expressions = pytest.mark.parametrize("kind", ["clap", "vst3"])  # LV2 has only MIDI


# --- the sound ---

SIZES: dict[str, Sequence[tuple[int, ...]]] = {
    "jazz-finger": [(4096, 3, 100)], "slap": [(512,), (17,), (64,)], "paper-bass": [(1, 999)], "fretless": [(511,)],
}  # fmt: skip
# The shells treat all basses alike
ALWAYS = [*itertools.product(PRESETS[:1], HOSTS), *itertools.product(PRESETS, ["clap"])]


@pytest.mark.parametrize(("preset", "kind"), quick(itertools.product(PRESETS, HOSTS), ALWAYS))
def test_it_plays_what_is_rendered_bit_for_bit(host: Host, preset: str) -> None:
    """In blocks of any size."""
    score = hard_score(notes=2 if preset == "fretless" else 12)
    wanted = mono(preset, score)
    assert np.abs(wanted).max() > 0.1
    host.choose(PRESETS.index(preset))
    for sizes in SIZES[preset]:
        host.renew()
        assert np.array_equal(host.play(score, len(wanted), sizes), wanted), sizes


@pytest.mark.parametrize(
    ("kind", "rate"),
    quick(itertools.product(FORMATS, [44100, 96000, 192000]), [("clap", 44100), ("vst3", 96000), ("lv2", 192000)]),
)
def test_so_it_does_at_other_rates(make: Any, rate: int) -> None:
    score = hard_score(rate, notes=4)
    wanted = mono("jazz-finger", score)
    assert np.array_equal(make(rate=rate).play(score, len(wanted)), wanted)


@every_host
def test_a_midi_file_is_rendered_alike(host: Host, tmp_path: Path) -> None:
    """With bends, pedal and expression, on two channels that hold the same keys."""
    score = midi_score(tmp_path / "a.mid")
    wanted = mono("jazz-finger", score)
    assert np.array_equal(host.play(score, len(wanted), (64,)), wanted)


@every_host
def test_a_tablature_is_rendered_alike(host: Host, tmp_path: Path) -> None:
    midi, _ = arrange(as_gp(hard_tab()), Path("song.gp"), TabRequest(), Loader(dict.fromkeys(SOUND))).exported()
    (tmp_path / "song.mid").write_bytes(midi)
    score = read_score(tmp_path / "song.mid", RATE).on_one_bass()
    wanted = mono("jazz-finger", score)
    assert np.abs(wanted).max() > 0.1
    assert np.array_equal(host.play(score, len(wanted), (64,)), wanted)


@every_format
def test_sliders_stop_where_strings_would_lie_on_the_neck(make: Any) -> None:
    """The host learns the value, which a session keeps; the bass is the one with that value."""
    host = make(offline=True)
    host.play([], 64, (64,), [(0, "action", -2.0)])
    lowest = host.play(PLAYED, 9600)
    assert sum("fret 20 would stand" in line for line in host.lines("")) <= 1
    if not isinstance(host, HOSTS["lv2"]):  # it cannot tell its host
        reported = [value for number, value in host.plugin.reported if number == ACTION]
        action = reported[-1] * 5 - 2 if isinstance(host, HOSTS["vst3"]) else reported[-1]
        assert -2 < action < 0
        assert np.array_equal(make(offline=True).play(PLAYED, 9600, points=[(0, "action", action)]), lowest)
    default = make(offline=True).play(PLAYED, 9600)
    assert np.isfinite(lowest).all() and not np.array_equal(lowest, default)


@every_format
def test_an_output_a_string(make: Any) -> None:
    """Its outputs are the stems of `render --stems`; their sum is the other plugin's sound."""
    host, score = make(apart=True), hard_score()
    wanted = render_preset("jazz-finger", score)
    outs = host.play(score, wanted.shape[1], (300, 2000, 7))
    assert np.array_equal(outs[: len(wanted)], wanted) and not outs[len(wanted) :].any()
    assert np.array_equal(mix_strings(outs), mono("jazz-finger", score))


@every_format
def test_sound_is_not_cut_at_full_scale(host: Host) -> None:
    score = hard_score()
    wanted = mono("jazz-finger", score, gain=10.0)
    assert np.abs(wanted).max() > 1.5
    assert np.array_equal(host.play(score, len(wanted), points=[(0, "gain", 20.0)]), wanted)


@every_format
def test_switched_off_and_on_it_is_as_new(host: Host) -> None:
    score = hard_score()
    first = host.play(score, RATE // 2)
    host.renew()
    assert first.any() and np.array_equal(host.play(score, RATE // 2), first)


@every_format
def test_running_ahead_changes_no_bit(host: Host) -> None:
    score = hard_score()
    wanted = mono("jazz-finger", score)
    host.play([], 64, (64,), [(0, "running_ahead", 1.0)])
    host.work()
    host.renew()
    assert np.array_equal(host.play(score, len(wanted), (64,)), wanted)


@every_format
def test_offline_a_changed_bass_is_built_within_a_block(make: Any) -> None:
    """At the value's frame; with LV2, whose ports take one value per block, at the block."""

    def played(sizes: tuple[int, ...]) -> Floats:
        notes = [(0, on(33, 110)), (3100, on(40, 110))]
        return make(offline=True).play(notes, 6000, sizes, [(3000, "action", 0.4), (3000, "gauge", 5.0)])  # type: ignore

    whole = played((3000,))
    assert np.abs(whole[3200:]).max() > 0.01
    for sizes in ((500,), (3000, 1, 2999)):
        assert np.array_equal(played(sizes), whole), sizes
    plain = make(offline=True).play([(0, on(33, 110)), (3100, on(40, 110))], 6000)
    assert np.array_equal(plain[:3000], whole[:3000]) and not np.array_equal(plain[3100:], whole[3100:])


@one_format
def test_held_notes_go_on_while_sliders_of_the_bench_move(make: Any) -> None:
    """Action, gauge and a pickup in turn, thirty times a second; and a released key still ends its note."""
    notes = [(0, on(28, 115)), (0, on(38, 115)), (RATE, off(38))]
    moves = [("action", -0.4), ("gauge", 8.0), ("pickup_place", 12.0)]
    points = [(12_288 + 1536 * k, moves[k % 3][0], moves[k % 3][1] * (1 - k / 15)) for k in range(30)]
    default, moved = (make(offline=True).play(notes, 2 * RATE, (512,), given) for given in ([], points))
    assert np.array_equal(default[:12_288], moved[:12_288]) and not np.array_equal(default, moved)
    levels = [[np.sqrt(np.mean(x[k * RATE // 4 :][: RATE // 4] ** 2)) for k in range(2, 8)] for x in (default, moved)]
    assert np.all(np.abs(20 * np.log10(np.array(levels[1]) / levels[0])) < 6.0), levels
    near = np.add.outer([at for at, *_ in points], np.arange(-3, 128))  # at other times lower frets are hit
    steps, as_before = (np.abs(np.diff(x, 3))[near].max() for x in (moved, default))
    assert steps < 1.5 * as_before


# --- notes ---


@every_host
def test_two_strings_in_unison_both_end(make: Any) -> None:
    """One key on two channels, a string each, as guitars send MIDI: in any order, and one of them twice."""

    def played(*events: tuple[int, bytes]) -> Floats:
        host = make(apart=True)
        return host.play([(0, on(45, 100, 1)), (100, on(45, 100, 2)), *events], 2 * RATE)  # type: ignore[no-any-return]

    held = played()
    peaks = np.abs(held).max(axis=1)
    strings = np.flatnonzero(peaks > 0.1 * peaks.max()).tolist()
    assert len(strings) == 2
    late = slice(3 * RATE // 2, None)
    assert all(np.abs(held[k, late]).max() > 1e-3 for k in strings)
    for order in ((1, 2), (2, 1)):
        both = played(*((RATE // 2 + 1000 * k, off(45, channel)) for k, channel in enumerate(order)))
        assert all(np.abs(both[k, late]).max() < 0.01 * np.abs(held[k, late]).max() for k in strings)
        one = played((RATE // 2, off(45, order[0])))
        kept = sorted(np.abs(one[k, late]).max() / np.abs(held[k, late]).max() for k in strings)
        assert kept[0] < 0.4 and 0.8 < kept[1] < 1.25, "the other one rings on, and the first answers it"


@every_host
def test_channels_bend_apart_and_pressure_vibrates_one_string(make: Any) -> None:
    """Each MPE channel has its own wheel and pressure: channel 3 moves only its own string."""

    def played(*moves: tuple[int, bytes]) -> Floats:
        notes = [*MPE, (10, on(35, 64, 1)), (10, on(40, 64, 2))]
        return make(apart=True).play([*notes, *moves], 9600)  # type: ignore[no-any-return]

    plain = played()
    for message in (bytes([0xE2, 0, 66]), bytes([0xD2, 127])):
        moved = played((1000, message))
        assert np.array_equal(moved[1], plain[1]) and not np.array_equal(moved[2], plain[2]), message


def pitch(sound: Floats, low: float = 50.0, high: float = 70.0) -> float:
    """The frequency (Hz) of the highest peak between `low` and `high`."""
    spectrum = np.abs(np.fft.rfft(sound * np.hanning(len(sound)), 1 << 19))
    first, last = (round(f * (1 << 19) / RATE) for f in (low, high))
    return float((first + np.argmax(spectrum[first:last])) * RATE / (1 << 19))


@with_expressions
def test_tuning_of_a_note_bends_its_string_alone(make: Any) -> None:
    """The second of two notes; the string's next note sounds at its own pitch."""

    def played(*more: Event) -> Floats:
        notes = [(0, on(28)), (0, on(33)), (24000, off(33)), (24000, on(35))]
        return make(apart=True).play([*notes, *more], RATE, (500,))  # type: ignore[no-any-return]

    plain, bent = played(), played((4800, Expression(TUNING, 0, 33, 1.0)))
    assert np.array_equal(plain[0], bent[0]) and not np.array_equal(plain[1], bent[1])
    for span, semitones in ((slice(7200, 23500), 1), (slice(30000, 48000), 0)):
        assert pitch(bent[1][span]) / pitch(plain[1][span]) == pytest.approx(2 ** (semitones / 12), abs=2e-3)


@with_expressions
def test_expressions_do_what_mpe_does(make: Any) -> None:
    """Vibrato acts like the channel's pressure; brightness, like controller 74, places the note it begins with."""

    def played(*events: Event) -> Floats:
        return make(apart=True).play([*MPE, *events], 9600)  # type: ignore[no-any-return]

    notes = [(10, on(35, 64, 1)), (10, on(40, 64, 2))]
    pressed = played(*notes, (1000, bytes([0xD2, 127])))
    assert np.array_equal(played(*notes, (1000, Expression(VIBRATO, 2, 40, 1.0))), pressed)
    bright = played((9, bytes([0xB1, 74, 127])), (10, on(33, 64, 1)))
    assert np.array_equal(played((10, on(33, 64, 1)), (10, Expression(PLACE, 1, 33, 1.0))), bright)
    assert not np.array_equal(played((10, on(33, 64, 1))), bright)


@with_expressions
def test_notes_are_heard_in_time_under_a_flood_of_expressions(make: Any) -> None:
    """Several per frame: no note or release is lost or late, and the last tuning stays."""

    def played(*tunings: Event) -> Floats:
        notes = [(0, on(33, 114)), (3000, on(28, 114)), (3500, off(28)), (4090, on(38, 114))]
        ends = [(13000, off(33)), (13000, off(38))]
        events = sorted([*notes, *tunings], key=lambda event: event[0])
        return make(apart=True).play([*events, *ends], 65000, (4096, *[500] * 200))  # type: ignore[no-any-return]

    flood = [(k, Expression(TUNING, 0, 33, 0.5 + k % 7 / 10)) for k in range(10, 4090) for _ in range(3)]
    plain, flooded = played(), played(*flood, (4092, Expression(TUNING, 0, 33, 0.0)))
    for string, onset in ((0, 3000), (2, 4090)):
        begin = [int(np.flatnonzero(np.abs(out[string]) > HEARD)[0]) for out in (plain, flooded)]
        assert onset <= begin[0] < onset + 200 and abs(begin[1] - begin[0]) <= 128, string
    assert np.abs(flooded[:, -9600:]).max() < 1e-3 < np.abs(flooded[:, :9000]).max()
    span = slice(5500, 12500)
    assert 1200 * np.log2(pitch(flooded[1, span], 45) / pitch(plain[1, span], 45)) == pytest.approx(0, abs=8)


VALUES = {
    "gain": -6.0, "tone": -0.5, "pluck_position": 0.7, "dynamics": 5.0, "technique": 3.0, "hand_damping": 0.4,
    "unevenness": 0.3, "bend_range": 12.0, "palm_mute": 0.6, "vibrato": 0.8, "compression": 0.5, "drive": 0.9,
    "clean_blend": 0.5, "eq_bass": 6.0, "eq_low_mid": -6.0, "eq_high_mid": 5.0, "eq_treble": -4.0, "cabinet": 3.0,
}  # fmt: skip


@with_expressions
def test_values_are_heard_at_their_frames(make: Any) -> None:
    """Block size changes nothing, and each value has an effect."""

    def played(values: dict[str, float], sizes: tuple[int, ...] = (512,)) -> Floats:
        score = hard_score()
        events = [(0, bytes([0xE0, 0, 80])), *zip(score.frames.tolist(), map(bytes, score.messages), strict=True)]
        points = [(7000 + 511 * k, symbol, x) for k, (symbol, x) in enumerate(values.items())]
        return make(offline=True).play(events, 3 * RATE // 4, sizes, points)  # type: ignore[no-any-return]

    default, together = played({}), played(VALUES)
    for sizes in ((32,), (1000, 1, 77)):
        assert np.array_equal(played(VALUES, sizes), together), sizes
    for symbol, x in VALUES.items():
        beside = {"drive": 0.9} if symbol == "clean_blend" else {}
        one, without = played(beside | {symbol: x}), played(beside) if beside else default
        assert np.array_equal(one[:7000], default[:7000]) and not np.array_equal(one, without), symbol


@pytest.mark.parametrize("kind", ["clap", "clap-midi", "lv2"])
def test_a_program_change_chooses_a_bass_that_is_there(host: Host) -> None:
    """By General MIDI, counted from 0. VST3 has its own programs."""
    score = hard_score(notes=2)
    for program, bass in ((36, SLAP), (32, SLAP), (99, SLAP), (33, JAZZ)):  # 32 is flatwound's
        host.play([(0, bytes([0xC0, program]))], 64, (64,))
        for _ in range(60):
            host.play([], 1024)
            host.work()
        host.renew()
        assert np.array_equal(host.play(score, RATE // 4), mono(PRESETS[bass], score)[: RATE // 4]), program


@every_format
def test_hosts_show_what_keys_switch(host: Host) -> None:
    if hasattr(host.plugin, "midnam"):
        document = host.plugin.midnam()
        found = {int(n): name for n, name in re.findall(r'<Note Number="(\d+)" Name="(.*?)"/>', document)}
    else:
        found = getattr(host.plugin, "notes_called", None) or host.plugin.switches
        found = found()
    assert sorted(found) == sorted(SWITCH_KEYS) and all(found.values())
    assert {key: found[key] for key in SWITCHES} == SWITCHES


# --- sessions ---


def moved_host(make: Any, bass: int = SLAP) -> Host:
    """A fresh host with a chosen bass, quality and tone."""
    host: Host = make()
    host.choose(bass)
    host.play([], 64, (64,), [(0, "quality", 1.0), (0, "tone", 0.5), (0, "gain", 3.0)])
    host.work()
    host.renew()
    return host


def name(state: Any) -> str:
    """The name of the bass in a state of CLAP or VST3, or by keys in LV2's."""
    if isinstance(state, bytes):
        return bass_of(state)
    (found,) = (p for p in (*PRESETS, "missing") if f"{p}\0".encode() in [value for value, _ in state.values()])
    return found


def alone(state: Any) -> Any:
    """A state that names its bass and does not keep it, as factory presets."""
    if isinstance(state, bytes):
        return without_instrument(state)
    return {key: (value, kind) for key, (value, kind) in state.items() if not value.startswith(b"livebass")}


@every_format
def test_a_session_brings_its_sound_back(make: Any) -> None:
    host, other = moved_host(make), make()
    score, state = hard_score(notes=4), host.save()
    assert name(state) == "slap" and other.load(state) and other.save() == state
    other.renew()
    points = [(0, p.symbol, x) for p, x in ((PARAMETERS[0], 3.0), (PARAMETERS[1], 0.5))]  # LV2 hosts restore ports
    sound = host.play(score, 9600, points=points)
    assert sound.any() and np.array_equal(other.play(score, 9600, points=points), sound)


HELD = {"palm_mute": 0.6, "legato": 1.0, "let_ring": 1.0}
PLAYED: list[Event] = [(100, on(33, 110)), (2500, on(35, 90)), (2900, off(33)), (5000, off(35)), (5100, on(47, 120))]


@every_format
def test_what_plays_outlasts_sessions_and_resets(make: Any, kind: str) -> None:
    """A stroke that a key chose, and techniques that are switched on; the host learns of the stroke."""

    def sound(host: Host, **more: float) -> Floats:
        return host.play(PLAYED, 9600, points=[(0, symbol, x) for symbol, x in (HELD | more).items()])  # type: ignore

    host, other = make(), make()
    wanted = sound(make(), technique=PICKED)
    assert not np.array_equal(wanted, sound(make()))
    host.play([(0, on(KEYS["pick"])), (32, off(KEYS["pick"]))], 64, (64,), [(0, s, x) for s, x in HELD.items()])
    if kind != "lv2":
        reported = [value for number, value in host.plugin.reported if number == NUMBERS["technique"]]
        assert reported == [PICKED / (POPS if kind == "vst3" else 1)]
    host.play([], 64, (64,))
    state = host.save()
    assert other.load(state) and np.array_equal(sound(other), wanted)
    for _ in "once", "again":
        host.renew()
        assert np.array_equal(sound(host), wanted)
    host.play([(0, on(KEYS["finger"]))], 64, (64,))
    assert host.load(state)
    host.renew()
    assert np.array_equal(sound(host), wanted)


@every_format
def test_a_project_plays_as_before_and_its_bounce_as_it_was_heard(make: Any, kind: str) -> None:
    """With a pick, a muting palm and an action of 1.4 mm."""
    lower = 1.4 + 1e3 * load_preset(PRESETS[0]).necks[0].fret_heights[11]
    points: list[tuple[int, str, float]] = [(0, "technique", PICKED), (0, "palm_mute", 0.5), (0, "action", lower)]

    def sound(offline: bool = False, state: Any = None, points: Any = points) -> tuple[Floats, Any]:
        host = make(offline=offline)
        assert state is None or host.load(state)
        host.play([], 64, (64,), points if state is None or kind == "lv2" else ())  # LV2 hosts restore ports
        host.work()
        host.renew()
        return host.play(PLAYED, 9600), host.save()

    wanted, state = sound()
    for k in range(len(points)):
        assert not np.array_equal(sound(points=points[:k] + points[k + 1 :])[0], wanted)
    for offline in (False, True):
        assert np.array_equal(sound(offline, state)[0], wanted)


@pytest.mark.parametrize("kind", ["clap"])
@pytest.mark.parametrize("symbol", [*STROKES, *SWITCHED])
def test_a_key_and_a_value_of_hosts_do_the_same(make: Any, symbol: str) -> None:
    """The end of all notes releases keys alone."""
    key = KEYS.get(symbol)
    pressed = [(0, bytes([0xB0, 64, 127]) if key is None else on(key))]
    point = (0, "technique", float(STROKES[symbol])) if symbol in STROKES else (0, symbol, 1.0)
    by_value = make().play(PLAYED, 9600, points=[point])
    assert np.array_equal(by_value, make().play([*pressed, *PLAYED], 9600))
    if symbol != "finger":
        assert not np.array_equal(by_value, make().play(PLAYED, 9600))
    ended = [(0, bytes([0xB0, 123, 0])), *PLAYED]
    assert np.array_equal(make().play(ended, 9600, points=[point]), by_value)


@every_format
def test_a_session_that_is_saved_at_once_has_the_bass_that_was_chosen(host: Host) -> None:
    """Before the host has loaded it; with LV2, whose port it is, before the next block."""
    host.play([], 64, (64,), [(0, "bass", float(SLAP))])
    assert name(host.save()) == "slap"
    if isinstance(host, HOSTS["lv2"]):
        host.plugin.controls["bass"].value = float(FRETLESS)
        assert name(host.save()) == "fretless"


@every_format
def test_a_state_with_another_bass_says_which(kind: str, make: Any, tmp_path: Path, capfd: Any) -> None:
    """Only once; all else is taken over, and the name is saved again until another bass is chosen."""
    state = alone(moved_host(make, FRETLESS).save())
    folder = tmp_path / HOSTS[kind].folder
    HOSTS[kind].module.write_bundle({name: load_preset(name) for name in ("slap", "jazz-finger")}, folder)
    capfd.readouterr()
    other = make(folder)
    for _ in "once", "again":
        assert other.load(state) and name(other.save()) == "fretless"
    said = other.lines(capfd.readouterr().err)
    assert len(said) == 1 and said[0].endswith("the session's instrument is not installed: fretless")
    other.play([], 64, (64,))
    back = make()
    assert back.load(other.save()) and alone(back.save()) == state
    other.choose(1)
    assert name(other.save()) == "jazz-finger"


@every_format
@pytest.mark.parametrize("damage", DAMAGES.values(), ids=DAMAGES)
def test_a_damaged_instrument_is_refused_with_one_line(
    kind: str, make: Any, places: dict[str, Path], tmp_path: Path, capfd: Any, damage: Any
) -> None:
    """The old bass plays on, and a session keeps the name."""
    folder = tmp_path / HOSTS[kind].folder
    shutil.copytree(places[kind], folder)
    (file,) = folder.rglob("slap.lbass")
    file.write_bytes(damage(file.read_bytes()))
    host, score = make(folder), hard_score(notes=2)
    wanted = mono("jazz-finger", score)
    capfd.readouterr()
    host.play([], 64, (64,), [(0, "bass", float(SLAP))])
    host.work()
    until, said = time.monotonic() + 30, []
    while not said and time.monotonic() < until:
        said += host.lines(capfd.readouterr().err)
        host.play([], 64, (64,))
    assert len(said) == 1 and re.search(r"slap\.lbass: ", said[0])
    assert ("made by livebass 9.1; this one, " in said[0]) == (damage is DAMAGES["of a later format"])
    assert ("made by an older livebass: export it again" in said[0]) == (damage is DAMAGES["of an older version"])
    assert np.array_equal(host.play(score, len(wanted)), wanted)
    assert name(host.save()) == "slap"


@pytest.mark.parametrize("kind", ["clap", "lv2"])
def test_without_its_first_instrument_it_does_not_start(
    kind: str, make: Any, places: dict[str, Path], tmp_path: Path
) -> None:
    """It does not start with none either; one line names the missing one. VST3 is not active then."""
    folder = tmp_path / HOSTS[kind].folder
    shutil.copytree(places[kind], folder)
    (folder / "instruments.txt").write_text("slap\n")
    (folder / "slap.lbass").write_bytes(b"damaged")
    with pytest.raises(RuntimeError, match=r"^[^;]*slap\.lbass: [^;]*$"):
        make(folder)
    (folder / "instruments.txt").unlink()
    with pytest.raises(RuntimeError, match="there is no instrument"):
        make(folder)


@every_format
def test_a_new_instance_begins_in_the_quality_of_the_list(kind: str, make: Any, tmp_path: Path) -> None:
    folder, score = tmp_path / HOSTS[kind].folder, hard_score(notes=3)
    basses = {name: load_preset(name) for name in ("jazz-finger", "slap")}
    HOSTS[kind].module.write_bundle(basses, folder, qualities={"jazz-finger": "studio"})
    host = make(folder)
    if kind == "lv2":  # its ports begin with the bundle's values
        host.plugin.controls["quality"].value = 1.0
    wanted = mono("jazz-finger", score, "studio")
    assert np.array_equal(host.play(score, len(wanted)), wanted)


@every_format
def test_bundles_of_ours_alone_are_replaced(kind: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Whatever their system."""
    monkeypatch.setattr(bundle, "binary", lambda system: b"code")
    write, folder, basses = HOSTS[kind].module.write_bundle, tmp_path / "livebass", {"paper-g": load_preset("paper-g")}
    for system in SYSTEMS.values():
        write(basses, folder, system)
        (listed,) = folder.rglob("instruments.txt")
        assert listed.read_text() == "paper-g\n"
        assert [file.read_bytes() for file in folder.rglob("*") if file.is_file()].count(b"code") == 1
    diary = listed.with_name("diary.txt")
    diary.write_text("dear diary")
    with pytest.raises(OSError, match="holds other files"):
        write(basses, folder)
    assert diary.exists()


# --- threads ---


@NO_THREADS
@every_format
def test_threads_of_its_own_change_no_bit_and_end(make: Any, capfd: Any) -> None:
    """None while the host renders, and none while the plugin is off. The audio thread starts none: that may wait."""
    host, score = make(), hard_score(notes=4)
    wanted, maximum = mono("jazz-finger", score), (os.cpu_count() or 1) - 1

    def become(count: int) -> None:
        """Waits until there are so many."""
        host.play([], 64, (64,))
        host.work()
        until = time.monotonic() + 10
        while helpers() != count and time.monotonic() < until:
            if host.lines(capfd.readouterr().err):
                pytest.skip("the system refuses them real-time priority")
            time.sleep(0.01)
            host.play([], 64, (64,))  # a plugin that no host calls has none
            host.work()
        assert helpers() == count

    for cores in (2, 4, 1, 2):
        host.play([], 64, (64,), [(0, "cores", float(cores))])
        become(min(cores - 1, maximum))
        host.renew()
        assert np.array_equal(host.play(score, len(wanted), (64,)), wanted), cores
    for offline in (True, False):
        host.offline(offline)
        become(0 if offline else min(1, maximum))
    host.switch(False)
    assert helpers() == 0
    host.switch(True)
    become(min(1, maximum))
    host.close()
    assert helpers() == 0
    host.close = lambda: None


# --- floods ---


@with_expressions
def test_notes_are_heard_under_dense_automation(make: Any) -> None:
    """A block has more values than the plugin takes: no note is lost, and each parameter ends at its last value."""
    symbols = ("gain", "dynamics", "unevenness", "hand_damping")

    def played(points: list[tuple[int, str, float]]) -> Floats:
        host = make(offline=True)
        notes = [(0, on(33)), (4000, on(28)), (4090, off(33)), (4090, off(28)), (96000, on(33))]
        return host.play(notes, 100800, (4096,), points)  # type: ignore[no-any-return]

    dense = [(k, symbols[k % 4], 0.0) for k in range(4000)]
    last = [(4091, "gain", -1.0)]
    out, plain = played(dense + last), played(last)
    assert np.abs(out[88000:96000]).max() < 1e-3 < np.abs(out[:4000]).max()
    assert np.abs(out[96000:]).max() > 0.01
    assert np.allclose(out[96000:], plain[96000:], rtol=0, atol=1e-5)


def test_chords_are_played_on_free_strings(places: dict[str, Path], lend: Any) -> None:
    """All hosts choose the same strings."""
    score = score_of([(0.01, 0.3, 28 + k % 36, 40 + k % 80) for k in range(128)], RATE)
    wanted = mono("jazz-finger", score)
    for kind, host in HOSTS.items():
        assert np.array_equal(lend(host(places[kind])).play(score, len(wanted), (64,)), wanted), kind
