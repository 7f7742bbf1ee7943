"""Key maps, controllers, the pitch wheel and velocity curves: their events on the strings, and their sound."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path

import mido
import numpy as np
import pytest
from numpy.typing import NDArray
from support import hands
from support.hands import FEW
from support.messages import Message, control, off, on, wheel
from support.pitch import pitch
from support.strings import even

from livebass import Instrument, read_score
from livebass.engine.engine import Engine
from livebass.engine.prepare import bass_numbers, fill_key_map
from livebass.kernels.player import fingering, strokes
from livebass.kernels.player.constants import FINGER, KEY_MAP, PICK, POP
from livebass.kernels.string import records
from livebass.live.parameters import NUMBERS
from livebass.model.instrument import note_frequency
from livebass.model.keymap import MAPS, MODO, MODO_12, KeyMap, velocity_parts
from livebass.rows import techniques
from livebass.rows.arrays import Floats
from livebass.rows.techniques import FUNCTION_ROWS, LEARNABLE, LEARNED, PARAMETER_ROWS, TECHNIQUE_ROWS

RATE = 48000
TICKS = 20  # of a bar of the MIDI file
KEY, HIGHER = 45, 48  # an A found on every string, and a C above it
SLIDES_OFF = ("slide_off_down", "slide_off_up")
HARMONICS = ("artificial", "artificial_12th", "artificial_15th", "pinch")
TOP = {name: key for key, name, _ in MODO.keys if key >= techniques.TOP_KEYS}


Hands = partial(hands.Hands, switches=True)


def of(events: NDArray[np.void], kind: int) -> NDArray[np.void]:
    """The events of a kind."""
    return events[events["kind"] == kind]


def sound(instrument: Instrument, messages: Sequence[tuple[int, Message]], frames: int, size: int = 0) -> Floats:
    """The strings' mix (frames,) of messages at frames, in blocks of `size`; 0: in one."""
    engine = Engine(instrument, FEW, RATE, workers=1)
    engine.send(np.array([f for f, _ in messages]), np.array([m for _, m in messages], np.uint8))
    size = size or frames
    blocks = [engine.process(min(size, frames - at)) for at in range(0, frames, size)]
    return np.concatenate(blocks, axis=1).sum(axis=0)


# Maps


def test_numbers_in_files_and_projects_stay() -> None:
    """New rows come after the existing ones."""
    switched = "string ghost legato harmonic tap palm_mute slide vibrato finger pick slap stop_all"
    switched += " down_stroke up_stroke hand detach left_slap thumb_on_all pop_on_all artificial artificial_12th"
    switched += " artificial_15th pinch slide_off_down slide_off_up let_ring"
    moved = "place volume expression let_ring vibrato palm_mute slide legato bend hand blend slide_time"
    hosted = "gain tone pluck_position dynamics technique hand_damping unevenness bend_range"
    for first, symbols, rows in (
        (1, switched, TECHNIQUE_ROWS),
        (1, f"{moved} {hosted}", FUNCTION_ROWS),
        (0, f"{hosted} bass quality running_ahead relief palm_mute vibrato", PARAMETER_ROWS),
    ):
        assert [*rows][: len(symbols.split())] == symbols.split()
        assert [row.number for row in rows.values()] == [*range(first, first + len(rows))]
        assert all(symbol == row.symbol for symbol, row in rows.items())
    assert [techniques.GHOST, techniques.LEFT_SLAP, techniques.CC_BLEND, techniques.BEND_RANGE] == [2, 17, 11, 7]
    assert techniques.LEARNED == 102 and len(PARAMETER_ROWS["technique"].points) == techniques.POPS + 1


@pytest.mark.parametrize("keys", MAPS.values(), ids=MAPS)
def test_a_key_and_a_controller_do_one_thing(keys: KeyMap) -> None:
    assert len({key for key, *_ in keys.keys}) == len(keys.keys)
    assert len({number for number, _ in keys.controllers}) == len(keys.controllers)


def test_the_second_map_is_an_octave_above_the_first() -> None:
    """Except palm mute and strokes, which exchange keys, and keys that would be notes there; the top keys are alike."""
    low, top = ({row for row in MODO.keys if (row[0] >= techniques.TOP_KEYS) == high} for high in (False, True))
    moved = low - {(key - 12, name, value) for key, name, value in MODO_12.keys}
    assert {name for _, name, _ in moved} == {"palm_mute", "up_stroke", "thumb_on_all", "pop_on_all", "artificial"}
    assert top == {row for row in MODO_12.keys if row[0] > 112}
    called = {key: value for key, name, value in MODO.keys if name == "string"}
    assert called == {0: 0, 9: 9, 11: 11, 14: 2, 16: 4, 19: 7}
    assert [(key, value) for key, name, value in MODO_12.keys if name == "hand"] == [(88 + n, n) for n in range(1, 25)]
    strings = {key for key, name, _ in MODO_12.keys if name == "string"}
    places = {name: key for key, name, _ in MODO_12.keys if name not in ("string", "hand")}
    assert strings == {12, 21, 23, 26, 28, 31}
    assert places.items() >= {"ghost": 22, "legato": 24, "finger": 25, "pick": 27, "harmonic": 29, "slap": 30}.items()


def phrases(keys: KeyMap) -> Iterator[tuple[int, str, int, list[Message]]]:
    """For each switch of a map: its key, technique and value, and the notes played while it is held."""
    for key, name, value in keys.keys:
        if name in ("legato", "slide"):
            yield key, name, value, [on(key), on(KEY), on(HIGHER), off(KEY), off(HIGHER), off(key)]
        elif name == "stop_all":
            yield key, name, value, [on(KEY), on(key), off(key), off(KEY)]
        else:
            yield key, name, value, [on(key), on(KEY), off(KEY), off(key)]


def midi_file(path: Path, keys: KeyMap) -> list[tuple[str, int]]:
    """Writes a MIDI file with a bar for each switch of a map; returns the purpose of each bar."""
    track, bars = mido.MidiTrack([mido.Message("program_change", program=33)]), []
    for _, name, value, messages in phrases(keys):
        bars.append((name, value))
        for k, message in enumerate(messages):
            gap = TICKS - len(messages) + 1 if k == len(messages) - 1 else 1
            track.append(mido.Message.from_bytes(message, time=gap if k else 1))
    mido.MidiFile(type=0, ticks_per_beat=50, tracks=[track]).save(path)
    return bars


def memory(record: NDArray[np.void]) -> bytes:
    """A performer's whole memory, except the destination of events."""
    kept = record.copy()
    kept["out"] = 0
    return kept.tobytes()


def is_played(name: str, value: int, events: NDArray[np.void], stroke: int) -> bool:
    """True if `events` of a phrase show the technique; `stroke` is the plucking stroke."""
    plucked, touched = of(events, records.PLUCK), of(events, records.TOUCH_EVENT)["finger"].tolist()
    hammered, struck = len(of(events, records.HAMMER)), len(of(events, records.STRIKE_EVENT))
    strings = {4: 0, 9: 1, 2: 2, 7: 3}  # by pitch class; no C, no B
    return {
        "string": plucked["string"].tolist() == [strings.get(value, 0)],
        "ghost": plucked["fret"].tolist() == [0] and touched == [2, 3],
        "legato": len(plucked) == 1 and hammered == 1,
        "harmonic": len(plucked) == 1 and touched == [3],
        "tap": len(plucked) == 0 and hammered == 1,
        "palm_mute": len(plucked) == 1 and set(touched) == {0, 1, 2},
        "slide": len(plucked) == 1 and len(of(events, records.GLIDE)) == 1,
        "vibrato": len(plucked) == 1 and max(of(events, records.WAVER)["value"], default=0) > 0.3,
        "finger": len(plucked) == 1 and stroke == FINGER,
        "pick": len(plucked) == 1 and stroke == PICK,
        "left_slap": len(of(events, records.THROW)) == 1 and touched == [2, 3],
        "slap": struck == 1 and stroke == POP,
        "thumb_on_all": struck == 1,
        "pop_on_all": len(plucked) == 1 and stroke == POP,
        **dict.fromkeys(HARMONICS, len(plucked) == 1 and plucked["fret"][0] > 0 and touched == [3]),
        **dict.fromkeys(SLIDES_OFF, events["kind"].tolist() == [records.PLUCK, records.TIMED_GLIDE]),
        "stop_all": len(plucked) == 1 and of(events, records.HAND)["string"].tolist() == [0, 1, 2, 3],
    }.get(name, len(plucked) + struck == 1)


@pytest.mark.parametrize("keys", MAPS.values(), ids=MAPS)
def test_midi_made_for_modo_plays_as_written(keys: KeyMap, tmp_path: Path) -> None:
    """A file with each key switch, read as in `render`: each switch asks for its technique, and none is a note."""
    bars = midi_file(tmp_path / "modo.mid", keys)
    score = read_score(tmp_path / "modo.mid", 8000)
    played = [tuple(map(int, m)) for m in score.messages[score.messages[:, 0] != 0xC0]]
    hands, at = Hands(even(keys=keys)), 0
    for _, name, value, messages in phrases(keys):
        events = hands(*played[at : at + len(messages)])
        at += len(messages)
        assert is_played(name, value, events, int(hands.p["stroke"])), (name, value, events)
    assert at == len(played) and hands.p["transposed"] == hands.p["dropped"] == 0
    assert hands.p["notes"] == sum(2 if name in ("legato", "slide") else 1 for name, _ in bars)


@pytest.mark.parametrize("keys", MAPS.values(), ids=MAPS)
def test_strokes_go_where_their_keys_say(keys: KeyMap) -> None:
    hands, key_of = Hands(even(keys=keys)), {name: key for key, name, _ in keys.keys}
    hands(on(key_of["pick"]), off(key_of["pick"]))
    free = [round(float(of(hands(on(45), off(45)), records.PLUCK)["angle"][0]), 12) for _ in range(4)]
    down, up = sorted({round(angle, 12) for angle in free}, reverse=True)
    assert down > 0 > up and free in ([down, up] * 2, [up, down] * 2)
    for key, angle in ((key_of["down_stroke"], down), (key_of["up_stroke"], up)):
        hands(on(key))
        held = [round(float(of(hands(on(45), off(45)), records.PLUCK)["angle"][0]), 12) for _ in range(3)]
        assert held == [angle] * 3
        hands(off(key))


@pytest.mark.parametrize("before", [(), (control(64, 127),)], ids=["bare", "pedal"])
def test_a_key_let_go_stops_its_string_while_detach_is_held(before: tuple[Message, ...]) -> None:
    hands = Hands(even(keys=MODO_12))
    hands(*before, on(24), on(KEY), on(HIGHER), on(32))
    stopped = hands(off(HIGHER))
    assert stopped["kind"].tolist() == [records.HAND] and not len(hands(off(KEY)))
    hands(off(32), on(KEY), on(HIGHER))
    assert hands(off(HIGHER))["kind"].tolist() == [records.PULL_OFF]
    assert hands(off(KEY))["kind"].tolist() == ([] if before else [records.HAND])


def test_the_hand_goes_to_its_key_or_controller() -> None:
    hands = Hands(even(keys=MODO_12))
    hands(on(88 + 12), off(88 + 12))
    assert hands.p["hands"]["place"] == 12
    assert of(hands(on(55)), records.PLUCK)[["string", "fret"]].tolist() == [(3, 12)]
    hands(on(88 + 24), off(88 + 24))
    assert hands.p["hands"]["place"] == 20 - fingering.HAND_SPAN, "as far as the neck goes"
    for value, place in ((0, 1), (127, 17)):
        hands(control(4, value))
        assert hands.p["hands"]["place"] == place


def test_keys_go_before_notes_where_a_map_says_so() -> None:
    low = bass_numbers(even(keys=MODO_12), [], 20)["open_note"][0, 0]
    assert low == 28
    assert not len(Hands(even(keys=MODO_12))(on(28))), "E string"
    before = replace(MODO_12, over_notes=False)
    assert len(Hands(even(keys=before))(on(28))) == 1, "a note"


def test_the_top_keys_switch_in_any_tuning() -> None:
    """A bass so low that key 20 is a note has its thumb on key 113, even after a change of bass."""
    low = even()
    strings = tuple(replace(string, open_note=string.open_note - 10) for string in low.strings)
    low = replace(low, strings=strings)
    assert not {18, 20} & low.switches and TOP.keys() <= {name for k, name, _ in MODO.keys if k in low.switches}
    hands = Hands(low)
    assert len(of(hands(on(20), off(20)), records.PLUCK)) == 1 and hands.p["slapped"] == 0
    assert not len(hands(on(TOP["thumb_on_all"]))) and hands.p["slapped"] == 4


@pytest.mark.parametrize(("name", "kind"), [("thumb_on_all", records.STRIKE_EVENT), ("pop_on_all", records.PLUCK)])
def test_thumb_and_pops_play_every_string(name: str, kind: int) -> None:
    hands = Hands()
    hands(on(TOP[name]), off(TOP[name]))
    assert [hands(on(key))[0]["kind"] for key in (28, 33, 38, 43)] == [kind] * 4
    hands(on(18), off(18))
    assert [hands(on(key))[0]["kind"] for key in (28, 43)] == [records.STRIKE_EVENT, records.PLUCK]
    hands(on(TOP[name]), on(13))
    assert hands.p["stroke"] == FINGER and hands(on(43))[0]["kind"] == records.PLUCK


def test_a_pinch_is_the_partial_under_the_hand() -> None:
    """The thumb touches where the hand plucks: nearer to the bridge is higher. It plucks even where it would strike."""
    hands, found = Hands(), []
    hands(on(TOP["pinch"]))
    for place in (127, 80, 60, 0):
        pluck, touch = hands(control(3, place), on(31))[:2]
        length = hands.ops[0, 3]["length"]
        found.append(length / (length - touch["place"]))
        assert pluck["place"] == pytest.approx(length - length / found[-1] + strokes.PINCH_THUMB)
    assert found == pytest.approx(np.rint(found)) and found == sorted(found, reverse=True)
    assert [round(x) for x in found] == [8, 5, 4, 3]
    hands(on(TOP["thumb_on_all"]))
    assert hands(on(31))["kind"].tolist() == [records.PLUCK, records.TOUCH_EVENT]


@pytest.mark.parametrize("name", HARMONICS)
def test_harmonics_of_fretted_notes_are_never_legato(name: str) -> None:
    hands = Hands()
    hands(control(68, 127), on(KEY), on(TOP[name]))
    assert records.PLUCK in hands(on(HIGHER))["kind"]


def test_a_slide_lasts_as_long_as_its_controller_says() -> None:
    hands = Hands()
    hands(control(65, 127), control(19, 40), on(45))
    (slide,) = hands(on(52))
    assert (slide["kind"], slide["seconds"], slide["value"]) == (records.TIMED_GLIDE, pytest.approx(1.0), 0.0)
    (back,) = hands(off(52))
    assert (back["kind"], back["fret"]) == (records.TIMED_GLIDE, slide["fret"] - 7)
    for message in (control(19, 0), control(121)):
        hands(control(65, 127), control(19, 40), message, control(65, 127))
        assert hands(on(52), off(52))["kind"].tolist() == [records.GLIDE] * 2


@pytest.mark.parametrize(("name", "fret"), [("slide_off_down", 7), ("slide_off_up", 17)])
def test_a_note_slides_off(name: str, fret: int) -> None:
    """By five frets, as far as there are any, in the time of a slide; an open string just ends."""
    hands = Hands()
    hands(on(19), on(55), on(TOP[name]))
    (slide,) = hands(off(55))
    assert (slide["kind"], slide["fret"]) == (records.TIMED_GLIDE, fret)
    assert slide["seconds"] == pytest.approx(5 * 22e-3) and slide["value"] == hands.p["hand_damping"]
    hands(control(19, 20), control(68, 127), on(45), on(61))
    (slide,) = hands(off(61))
    assert slide["fret"] == (13 if fret == 7 else 20) and slide["seconds"] == pytest.approx(0.5)
    assert not len(hands(off(45))) and hands(on(43), off(43))["kind"].tolist() == [records.PLUCK, records.HAND]


def test_new_ways_to_play_sound_the_same_in_blocks_of_any_size() -> None:
    messages, at = [(0, control(19, 4)), (0, control(65, 127))], 0
    for name, key in TOP.items():
        messages += [(at, on(key)), (at, on(45)), (at + 3000, on(50)), (at + 5000, off(50)), (at + 5500, off(45))]
        messages += [(at + 6000, off(key))]
        at += 6000 + 7 * len(name)
    whole, plain = (sound(even(), [m for m in messages if keys or m[1][1] < 100], at) for keys in (True, False))
    assert not np.array_equal(whole, plain)
    for size in (1000, 333):
        assert np.array_equal(sound(even(), messages, at, size), whole)


def test_a_map_of_ones_own() -> None:
    own = KeyMap("own", ((100, "ghost", 0),), ((20, "vibrato"), (21, "let_ring"), (16, "volume")), over_notes=True)
    hands = Hands(even(keys=own))
    assert not len(hands(control(1, 127))) and of(hands(control(20, 127)), records.WAVER)["value"].max() > 0.3
    assert len(of(hands(control(16, 64)), records.GAIN)) == 4, "the map goes before the usual position controller"
    assert len(hands(on(10), off(10))) > 0, "a note an octave or two below"
    hands(on(100))
    assert of(hands(on(45)), records.PLUCK)["fret"].tolist() == [0]
    hands(control(21, 127))
    assert not len(of(hands(off(45)), records.HAND))
    assert len(of(hands(control(64, 0)), records.HAND)) >= 1, "pedal up on 64 lets go in every map"


def test_the_position_controller_of_a_preset_is_one_more() -> None:
    def places(**player: object) -> list[int]:
        made = np.zeros(1, KEY_MAP)
        fill_key_map(made[0], even(**player).player)
        return np.flatnonzero(made["function"][0] == techniques.CC_PLACE).tolist()

    assert places() == [3, 16] and places(position_controller=20) == [3, 20]
    assert places(position_controller=9) == [3, 9], "in place of palm mute"


def test_all_notes_off_releases_keys_that_switch() -> None:
    for number in (120, 123):
        hands = Hands()
        hands(on(10), on(3), on(9))
        assert len(of(hands(control(number)), records.TOUCH_EVENT)) == 0, "nothing sounds"
        assert hands.p["forced"] == -1 and not hands.p["switched"].any()
        events = hands(on(45))
        assert len(events) == 1 and events[0]["fret"] > 0


@pytest.mark.parametrize("preset", ["jazz-finger", "slap", "precision-pick"])
def test_the_basss_own_stroke_comes_back(preset: str) -> None:
    hands = Hands(even(preset))
    own = {name: int(hands.p[name]) for name in ("stroke", "slapped")}
    for key in (key for key, name, _ in MODO.keys if techniques.STROKE_OF[TECHNIQUE_ROWS[name].number]):
        hands(on(key), off(key), control(LEARNED + techniques.TECHNIQUE, 0))
        assert {name: int(hands.p[name]) for name in own} == own


@pytest.mark.parametrize("preset", ["jazz-finger", "slap"])
def test_the_usual_map_leaves_files_as_they_were(preset: str) -> None:
    """Controllers meant for synths: those not in the map do nothing."""
    hands = Hands(even(preset))
    taken = {number for number, _ in MODO.controllers} | {6, 16, 38, *range(98, 110), *range(120, 128)}
    before = memory(hands.record)
    for number in set(range(128)) - taken:
        for value in (127, 0, 64):
            assert not len(hands(control(number, value)))
    assert before == memory(hands.record)


# Velocity


def test_a_linear_curve_is_the_straight_line() -> None:
    parts = velocity_parts("linear")
    assert parts[1:] == [(velocity - 1) / 126 for velocity in range(1, 128)]
    assert velocity_parts(1.0) == velocity_parts(((1.0, 1.0), (127.0, 127.0))) == parts


def test_curves_rise_from_softest_to_hardest() -> None:
    soft, linear, hard = (velocity_parts(curve) for curve in ("soft", "linear", "hard"))
    for parts in (soft, linear, hard):
        assert parts[1] == 0 and parts[127] == 1 and parts[1:] == sorted(parts[1:])
    assert all(a > b > c for a, b, c in zip(soft[2:127], linear[2:127], hard[2:127], strict=True))


def test_points_of_a_curve() -> None:
    parts = velocity_parts(((20.0, 40.0), (64.0, 90.0)))
    assert parts[1] == parts[20] == 39 / 126 and parts[64] == parts[127] == 89 / 126
    assert parts[42] == pytest.approx((65 - 1) / 126)
    assert set(velocity_parts(((1.0, 100.0),))[1:]) == {99 / 126}, "every velocity is alike"


def test_a_curve_is_how_hard_a_note_is() -> None:
    straight, curved = Hands(), Hands(even(velocity_curve=((1.0, 1.0), (64.0, 90.0), (127.0, 127.0))))
    for played, meant in ((64, 90), (1, 1), (127, 127)):
        one, other = (hands(on(45, v), off(45))["apex"][0] for hands, v in ((curved, played), (straight, meant)))
        assert one == other


def test_soft_notes_are_ghost_notes_where_a_preset_says_so() -> None:
    hands = Hands(even(ghost_below=30))
    assert len(of(hands(on(45, 29), off(45)), records.TOUCH_EVENT)) == 2
    assert not len(of(hands(on(45, 30), off(45)), records.TOUCH_EVENT))


# The wheel and the bend


def test_a_wheel_that_slides_goes_over_frets() -> None:
    hands = Hands(even(wheel="slide"))
    fret = int(hands(on(48))["fret"][0])
    hands(on(33))  # the open A stays as it is
    for value, by in ((4096, [1]), (5000, []), (8191, [2]), (7000, []), (0, [0]), (-8192, [-2]), (0, [0])):
        events = hands(wheel(value))
        assert events["kind"].tolist() == [records.GLIDE] * len(by)
        assert (events["fret"] - fret).tolist() == by, value
    hands(wheel(8191))
    assert int(hands(off(48), on(49))[-1]["fret"]) == fret + 3, "a new note is stopped where the hand is"
    assert of(hands(control(121)), records.GLIDE)["fret"].tolist() == [fret + 1]


def test_a_wheel_that_slides_does_not_jitter_between_frets() -> None:
    """Half way between two frets it stays where it is."""
    hands = Hands(even(wheel="slide"))
    fret = int(hands(on(48))["fret"][0])

    def at(semitones: float) -> list[int]:
        return [int(f) - fret for f in hands(wheel(round(semitones / 2 * 8191)))["fret"]]

    assert [at(s) for s in (0.45, 0.55, 0.45, 0.55)] == [[]] * 4
    assert [at(s) for s in (0.65, 0.55, 0.45, 0.55, 1.55, 1.45)] == [[1], [], [], [], [], []]
    assert [at(s) for s in (0.35, 0.45)] == [[0], []]


# Legato


@pytest.mark.parametrize(
    ("by", "kind"),
    [(1, records.HAMMER), (2, records.HAMMER), (3, records.PLUCK), (-2, records.PULL_OFF), (-3, records.PLUCK)],
)
def test_in_mono_mode_overlapping_notes_near_each_other_are_legato(by: int, kind: int) -> None:
    """Controller 126 with one voice: up to two semitones. Wider intervals and single notes are plucked."""
    hands = Hands()
    hands(control(126, 1))
    (first,) = hands(on(50))
    (second,) = hands(on(50 + by))
    assert (first["kind"], second["kind"]) == (records.PLUCK, kind)
    assert kind == records.PLUCK or second["string"] == first["string"]
    hands(control(123), control(127, 0), on(50))
    assert hands(on(51))["kind"].tolist() == [records.PLUCK], "not in poly mode"
    hands(control(126, 1), on(50), off(50))
    assert of(hands(on(51)), records.PLUCK).size == 1, "they do not overlap"


def test_a_string_goes_back_to_four_keys_that_are_still_held() -> None:
    """Each is pulled off to the one before; a fifth is forgotten, and the string is stopped."""
    hands = Hands()
    hands(control(68, 127))
    frets = [int(hands(on(key))["fret"][0]) for key in range(44, 50)]
    assert frets == [1, 2, 3, 4, 5, 6]
    for key, fret in zip((49, 48, 47, 46), (5, 4, 3, 2), strict=True):
        (event,) = hands(off(key))
        assert (event["kind"], event["fret"]) == (records.PULL_OFF, fret)
    assert hands(off(45))["kind"].tolist() == [records.HAND]


def test_a_slide_by_the_wheel_sounds_at_its_note() -> None:
    """Two semitones up, staircase and all: the last note is within 5 cents."""
    instrument = even("jazz-finger", wheel="slide")
    messages = [(0, on(45, 60)), (12000, wheel(8191))]
    x, near = sound(instrument, messages, 2 * RATE), note_frequency(47)
    assert abs(1200 * np.log2(pitch(x[RATE:], RATE, near) / near)) < 5
    assert np.array_equal(x, sound(instrument, messages, 2 * RATE, 777)), "in any blocks"


def test_controller_5_bends_upwards() -> None:
    hands = Hands()
    assert not len(hands(control(5, 64))), "a portamento time"
    hands(control(5, 0))
    for value in (127, 40):
        bends = of(hands(control(5, value)), records.BEND)
        assert len(bends) == 4 and set(bends["value"]) == {2 ** (2 * value / 127 / 12)}
    both = of(hands(wheel(8191)), records.BEND)["value"][0]
    assert both == pytest.approx(2 ** ((2 + 80 / 127) / 12))
    assert set(of(hands(control(121)), records.BEND)["value"]) == {1.0}


# Tone and pickups


def test_tone_and_blend_reach_every_string_and_no_key_is_needed() -> None:
    hands = Hands()
    for number, kind in ((17, records.TONE), (18, records.BLEND)):
        for value, x in ((0, -1.0), (64, 0.0), (127, 1.0)):
            events = of(hands(control(number, value)), kind)
            assert events["string"].tolist() == [0, 1, 2, 3] and set(events["value"]) == {x}


@pytest.mark.parametrize(("value", "off_pickup"), [(0, "bridge"), (127, "neck")])
def test_the_blend_leaves_one_pickup(value: int, off_pickup: str) -> None:
    instrument = even()
    pickups = sorted(instrument.output.pickups, key=lambda p: p.position)
    assert len(pickups) == 2
    gone = pickups[0 if off_pickup == "bridge" else -1]
    one = tuple(replace(p, level=0.0) if p is gone else p for p in instrument.output.pickups)
    alone = replace(instrument, output=replace(instrument.output, pickups=one))
    notes = [(100, on(45, 100)), (9000, off(45))]
    assert np.array_equal(sound(instrument, [(0, control(18, value)), *notes], 12000), sound(alone, notes, 12000))
    assert np.array_equal(sound(instrument, [(0, control(18, 64)), *notes], 12000), sound(instrument, notes, 12000))


@pytest.mark.parametrize("number", [17, 18])
def test_tone_and_blend_move_without_a_click(number: int) -> None:
    """Swept end to end and switched at once: no step exceeds the note's own; blocks of any size sound the same."""
    notes = [(0, on(45, 100))]
    still = sound(even(), notes, 24000)
    moves = [(6000 + 100 * k, control(number, k)) for k in range(0, 128, 4)] + [(20000, control(number, 0))]
    moved = sound(even(), notes + moves, 24000)
    assert not np.array_equal(still, moved)
    assert np.abs(np.diff(moved[5000:])).max() < 1.2 * np.abs(np.diff(still[:5000])).max()
    for size in (1000, 333):
        assert np.array_equal(sound(even(), notes + moves, 24000, size), moved)


def test_a_closed_tone_pot_is_darker() -> None:
    notes = [(100, on(45, 100))]
    dark, bright = (sound(even(), [(0, control(17, value)), *notes], 12000) for value in (0, 127))
    assert np.abs(np.diff(dark)).max() < 0.5 * np.abs(np.diff(bright)).max()


@pytest.mark.parametrize("symbol", LEARNABLE)
def test_every_parameter_has_a_controller(symbol: str) -> None:
    hands = Hands()
    number = LEARNED + NUMBERS[symbol]
    before = memory(hands.record)
    hands(control(number, 100))
    assert before != memory(hands.record)


def test_the_left_hand_slaps() -> None:
    """A mass on the strings about fret 7, with fingers on them: a clack without ringing partials."""
    hands = Hands(even())
    hands(on(7))
    events = hands(on(33))
    (throw,) = of(events, records.THROW)
    ops = hands.ops[int(throw["string"])]
    assert throw["fret"] == 0 and throw["place"] == pytest.approx(ops["length"][0] - ops["length"][7])
    assert throw["mass"] == strokes.LEFT_MASS and len(of(events, records.TOUCH_EVENT)) == 2
    hands(off(7))
    assert len(of(hands(on(35)), records.PLUCK)) == 1
    x = np.abs(sound(even(), [(0, on(7, 100)), (100, on(33, 110))], RATE // 2))
    peak, rest = x[: RATE // 10].max(), x[RATE // 5 : RATE // 3].max()
    plucked = np.abs(sound(even(), [(100, on(33, 110))], RATE // 10)).max()
    assert 0.8 < peak / plucked < 1.1 and rest < 0.05 * peak, (peak, plucked, rest)
