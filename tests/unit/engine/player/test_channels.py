"""Controllers belong to their channel, and a note keeps its channel's. With one channel nothing changes."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray
from support.hands import Hands, bass, bass_tuned
from support.messages import Message, control, off, on, wheel

from livebass.engine.prepare import bass_numbers, follow_performer, new_performer
from livebass.kernels.player import performer, words
from livebass.kernels.string import records as at
from livebass.rows import techniques

FREE, HELD, PEDALLED = performer.FREE, performer.HELD, performer.PEDALLED
E, A, D, G = range(4)  # strings ...
OPEN = (28, 33, 38, 43)  # ... and their notes
STRINGS_FROM_1, MPE = ((0xB0, 126, 4),), ((0xB0, 101, 0), (0xB0, 100, 6), (0xB0, 6, 5))


def by(channel: int, *messages: Message) -> list[Message]:
    """The same messages on a channel, 0 to 15."""
    return [(status | channel, first, second) for status, first, second in messages]


def rpn(number: int, whole: int, fine: int | None = None) -> list[Message]:
    return [control(101, 0), control(100, number), control(6, whole)] + [
        control(38, x) for x in (fine,) if x is not None
    ]


def two(instrument: object = None) -> Hands:
    """E1 sounds on channel 1, A1 on channel 2."""
    hands = Hands(instrument)  # type: ignore[arg-type]
    hands(*by(0, on(OPEN[E])), *by(1, on(OPEN[A])))
    return hands


def last_numbers(events: NDArray[np.void], kind: int) -> dict[int, float]:
    """The last number of a kind sent to each string."""
    return {int(e["string"]): float(e["value"]) for e in events if e["kind"] == kind}


def semitones(events: NDArray[np.void]) -> dict[int, float]:
    return {i: 12 * np.log2(ratio) for i, ratio in last_numbers(events, at.BEND).items()}


MOVES: list[tuple[str, list[Message], int, float]] = [
    ("wheel", [wheel(8191)], at.BEND, 2 ** (2 / 12)),
    ("bend upwards", [control(5, 0), control(5, 127)], at.BEND, 2 ** (2 / 12)),
    ("fine tuning", rpn(1, 96, 0), at.BEND, 2 ** (0.5 / 12)),
    ("fine tuning, 14 bits", rpn(1, 0, 64), at.BEND, 2 ** ((64 / 8192 - 1) / 12)),
    ("coarse tuning", rpn(2, 62), at.BEND, 2 ** (-2 / 12)),
    ("bend range", [wheel(-8192), *rpn(0, 5, 50)], at.BEND, 2 ** (-5.5 / 12)),
    ("volume", [control(7, 64)], at.GAIN, (64 / 127) ** 2),
    ("expression", [control(11, 32)], at.GAIN, (32 / 127) ** 2),
    ("vibrato", [control(1, 127)], at.WAVER, 0.4),
]
MOVED = pytest.mark.parametrize(("messages", "kind", "value"), [m[1:] for m in MOVES], ids=[m[0] for m in MOVES])


@MOVED
def test_a_channel_moves_its_own_note(messages: list[Message], kind: int, value: float) -> None:
    """It also moves unplayed strings, which may get its next note."""
    assert last_numbers(two()(*by(1, *messages)), kind) == pytest.approx({A: value, D: value, G: value})
    assert last_numbers(two()(*by(0, *messages)), kind) == pytest.approx({E: value, D: value, G: value})
    assert last_numbers(two()(*by(9, *messages)), kind) == pytest.approx({D: value, G: value})


@MOVED
def test_what_comes_before_a_note_is_there_when_it_begins(messages: list[Message], kind: int, value: float) -> None:
    """Also on a string last played by another channel; that channel's next note has its own values again."""
    hands = two()
    hands(*by(0, off(OPEN[E])), *by(1, *messages))
    events = hands(*by(1, on(OPEN[E])))
    assert [int(e["kind"]) for e in events] == [kind, at.PLUCK] and last_numbers(events, kind) == pytest.approx(
        {E: value}
    )
    assert [int(e["kind"]) for e in hands(*by(1, off(OPEN[E]), on(OPEN[E])))] == [at.HAND, at.PLUCK], "told already"
    default = {at.BEND: 1.0, at.GAIN: 1.0, at.WAVER: 0.0}[kind]
    assert last_numbers(hands(*by(1, off(OPEN[E])), *by(0, on(OPEN[E]))), kind) == {E: default}


@MOVED
@pytest.mark.parametrize("channel", [0, 6, 15])
def test_one_channel_moves_all_strings(channel: int, messages: list[Message], kind: int, value: float) -> None:
    """Any channel gives the same events; a host's values and a change of bass reach any channel."""
    line = [on(OPEN[E]), *messages, on(OPEN[A]), off(OPEN[E]), on(OPEN[E])]
    first, other = Hands(), Hands()
    assert first(*line).tobytes() == other(*by(channel, *line)).tobytes()
    assert last_numbers(first(*messages), kind) == pytest.approx(dict.fromkeys(range(4), value))


def test_a_released_note_keeps_its_channel() -> None:
    hands = two()
    hands(*by(0, off(OPEN[E])))
    assert semitones(hands(*by(1, wheel(8191)))) == pytest.approx({A: 2, D: 2, G: 2})
    assert semitones(hands(*by(0, wheel(8191)))) == pytest.approx({E: 2, D: 2, G: 2})


def test_the_pedal_holds_the_notes_of_its_channel() -> None:
    hands = two()
    hands(*by(1, control(64, 127)), *by(0, off(OPEN[E])), *by(1, off(OPEN[A])))
    assert hands.strings("state")[:2] == [FREE, PEDALLED]
    assert len(hands(*by(0, control(64, 0)))) == 0
    assert last_numbers(hands(*by(1, control(64, 0))), at.HAND).keys() == {A}


def by_string(*before: Message) -> Hands:
    """MIDI mode 4 on channels 1 to 4, after these messages: G2 sounds on channel 1, D2 on channel 2."""
    hands = Hands()
    hands(*before, *STRINGS_FROM_1, *by(0, on(OPEN[G])), *by(1, on(OPEN[D])))
    return hands


@pytest.mark.parametrize("early", [False, True], ids=["after the mode", "before the mode"])
def test_the_pedal_of_a_strings_channel_holds_that_string(early: bool) -> None:
    hands = by_string(*by(0, control(64, 127)) * early)
    hands(*by(0, control(64, 127)) * (not early), *by(1, off(OPEN[D])), *by(0, off(OPEN[G])))
    assert hands.strings("state")[:4] == [FREE, FREE, FREE, PEDALLED]
    hands(*by(1, on(OPEN[D]), off(OPEN[D]), control(64, 0)))
    assert hands.strings("state")[:4] == [FREE, FREE, FREE, PEDALLED], "another string's pedal does not end it"
    assert last_numbers(hands(*by(0, control(64, 0))), at.HAND).keys() == {G}


def test_the_pedal_of_a_channel_without_a_string_holds_all() -> None:
    hands = by_string()
    hands(*by(9, control(64, 127)), *by(1, off(OPEN[D])), *by(0, off(OPEN[G])))
    assert hands.strings("state")[:4] == [FREE, FREE, PEDALLED, PEDALLED]
    assert last_numbers(hands(*by(9, control(64, 0))), at.HAND).keys() == {D, G}


def test_after_mode_4_a_pedal_that_stayed_down_holds_all_again() -> None:
    hands = by_string()
    hands(*by(0, control(64, 127)), (0xB0, 127, 0), *by(3, on(OPEN[A]), off(OPEN[A])))
    assert hands.strings("state")[A] == FREE, "channels have their own pedals there"
    hands(*by(0, on(OPEN[A]), off(OPEN[A])))
    assert hands.strings("state")[A] == PEDALLED


def in_a_zone(*before: Message) -> Hands:
    """An MPE zone of channels 2 to 6, after these messages: E1 sounds on channel 2, A1 on channel 3."""
    hands = Hands()
    hands(*before, *MPE, *by(1, on(OPEN[E])), *by(2, on(OPEN[A])))
    return hands


@pytest.mark.parametrize("early", [False, True], ids=["after the zone", "before the zone"])
def test_in_a_zone_the_pedal_of_a_notes_channel_holds_its_notes(early: bool) -> None:
    """MPE has the pedal on the master's channel; some senders repeat it on those of the notes."""
    hands = in_a_zone(*by(1, control(64, 127)) * early)
    hands(*by(1, control(64, 127)) * (not early), *by(1, off(OPEN[E])), *by(2, off(OPEN[A])))
    assert hands.strings("state")[:2] == [PEDALLED, FREE]
    hands(*by(2, on(OPEN[A]), off(OPEN[A]), control(64, 0)))
    assert hands.strings("state")[:2] == [PEDALLED, FREE], "another note's pedal does not end it"
    assert last_numbers(hands(*by(1, control(64, 0))), at.HAND).keys() == {E}


def test_in_a_zone_the_pedal_of_the_master_holds_all() -> None:
    hands = in_a_zone()
    hands(*by(0, control(64, 127)), *by(1, control(64, 127), control(64, 0), off(OPEN[E])), *by(2, off(OPEN[A])))
    assert hands.strings("state")[:2] == [PEDALLED, PEDALLED], "a note's channel does not lift the master's pedal"
    assert last_numbers(hands(*by(0, control(64, 0))), at.HAND).keys() == {E, A}


def test_in_a_zone_a_string_is_its_last_notes() -> None:
    """A channel that played the string before does not hold it."""
    hands = in_a_zone()
    hands(*by(1, off(OPEN[E])), *by(4, on(OPEN[E])), *by(1, control(64, 127)), *by(4, off(OPEN[E])))
    assert hands.strings("state")[E] == FREE


@pytest.mark.parametrize(("start", "one"), [(in_a_zone, 1), (by_string, 1)], ids=["notes", "strings"])
def test_a_reset_of_a_notes_channel_leaves_the_whole_bass(start: Callable[[], Hands], one: int) -> None:
    hands, whole = start(), 0 if start is in_a_zone else 9
    hands(*by(whole, control(64, 127), wheel(8191), control(9, 127)), *by(one, wheel(4096), control(64, 127)))
    string = int(np.flatnonzero([bend != 0 for bend in hands.p["controls"]["string_bend"]])[0])
    palm = hands.p["controls"]["palm"]
    events = hands(*by(one, control(121)))
    assert semitones(events) == pytest.approx(dict.fromkeys(range(4), 2.0)), "its own bend ends"
    assert hands.p["controls"]["palm"] == palm
    hands(*by(one, off(OPEN[string])))
    assert hands.strings("state")[string] == PEDALLED
    assert {string} == last_numbers(hands(*by(whole, control(121))), at.HAND).keys()


def test_idle_strings_answer_while_the_pedal_of_any_channel_is_down() -> None:
    hands = two(bass(answering="pedal"))
    assert last_numbers(hands(*by(2, control(64, 127))), at.IDLE) == dict.fromkeys(range(4), 0b1100 | at.RING_ON)
    assert not last_numbers(hands(*by(0, control(64, 127), control(64, 0))), at.IDLE)
    assert last_numbers(hands(*by(2, control(64, 0))), at.IDLE) == dict.fromkeys(range(4), 0)


ON_A = words.joined({words.STRING: A, words.FRET: 3, words.VELOCITY: 80})
STROKE = words.STROKE, ON_A, float(words.joined({words.LOUDER: words.NO_DYNAMICS}))
PALMED = words.STROKE, ON_A | words.joined({words.PALMED: 1}), STROKE[2]
REST = words.STRING_REST, A, 0.0
PALM_AMOUNT = techniques.AMOUNT, techniques.CC_PALM


def switched(technique: int, value: float) -> tuple[int, int, float]:
    """The event that switches a technique on (1) or off (0)."""
    return techniques.SWITCHED, technique, value


@pytest.mark.parametrize("mutes", [True, False])
@pytest.mark.parametrize(
    ("lay", "lift"),
    [
        ([control(9, 1)], [control(9, 0)]),
        ([(*PALM_AMOUNT, 0.5)], [(*PALM_AMOUNT, 0.0)]),
        ([switched(techniques.PALM, 1.0)], [switched(techniques.PALM, 0.0)]),
        ([PALMED], [STROKE]),
        ([PALMED], [REST]),
        ([switched(techniques.GHOST, 1.0), on(40)], [switched(techniques.GHOST, 0.0), on(40)]),
        ([switched(techniques.LEFT_SLAP, 1.0), on(40)], [off(40)]),
    ],
)  # fmt: skip
def test_a_hand_across_the_strings_mutes_the_idle_ones(lay: list[Message], lift: list[Message], mutes: bool) -> None:
    """From the moment it lies there until it lifts, even under the pedal; it brings no answers to a bass without."""
    hands = Hands(bass(answering="always" if mutes else "off"))
    assert last_numbers(hands(control(64, 127)), at.IDLE) == (
        dict.fromkeys(range(4), 0b1111 | at.RING_ON) if mutes else {}
    )
    assert last_numbers(hands(*lay), at.IDLE) == (dict.fromkeys(range(4), 0) if mutes else {})
    hands(*lift)
    idle = sum(1 << i for i, state in enumerate(hands.strings("state")) if state == FREE)
    assert hands.p["idle"] == (idle | at.RING_ON if mutes else 0)


def test_a_palm_that_a_tablature_left_does_not_come_back_with_a_key() -> None:
    hands = Hands(bass(answering="always"))
    hands(PALMED, (words.STROKE_END, words.joined({words.STRING: A}), 0.0))
    hands(on(36))
    assert hands.string_of(36) == A and hands.p["idle"] & 0b1111 == 0b1101


def test_a_reset_is_of_its_channel_and_leaves_tuning_range_and_volume() -> None:
    """As RP-015 requires."""
    hands = two()
    for channel in (0, 1):
        hands(*by(channel, *rpn(0, 4), *rpn(1, 96, 0), *rpn(2, 65), control(7, 64), control(11, 64), wheel(8191)))
        hands(*by(channel, control(1, 90), control(64, 127)))
    hands(*by(0, off(OPEN[E])), *by(1, off(OPEN[A])))
    events = hands(*by(1, control(121)))
    assert semitones(events) == pytest.approx({A: 1.5, D: 1.5, G: 1.5}), "tuning stays"
    assert last_numbers(events, at.GAIN) == pytest.approx(dict.fromkeys((A, D, G), (64 / 127) ** 2)), (
        "so does the volume"
    )
    assert last_numbers(events, at.WAVER) == {A: 0.0, D: 0.0, G: 0.0} and last_numbers(events, at.HAND).keys() == {A}
    assert hands.strings("state")[:2] == [PEDALLED, FREE]
    assert semitones(hands(*by(1, wheel(8191))))[A] == pytest.approx(5.5), "and the range"
    assert not semitones(hands(*by(1, control(6, 9)))), "no parameter is selected"
    assert semitones(hands(*by(0, control(6, 60))))[E] == pytest.approx(0.5 - 4 + 4), "on the other channel one is"


@pytest.mark.parametrize(("number", "kind"), [(120, at.CUT), (123, at.HAND), (124, at.HAND), (127, at.HAND)])
def test_all_off_is_of_its_channel(number: int, kind: int) -> None:
    hands = two()
    assert {A} <= {int(e["string"]) for e in hands(*by(1, control(number))) if e["kind"] == kind} <= {A, D, G}
    assert hands.strings("state")[:2] == [HELD, FREE]
    assert last_numbers(hands(*by(0, off(OPEN[E]))), at.HAND).keys() == {E}


def test_key_switches_and_palm_are_the_whole_basss() -> None:
    hands = Hands(switches=True)
    hands(*by(0, on(OPEN[E])), *by(1, on(OPEN[A]), on(6)))
    assert hands.p["switched"][techniques.VIBRATO] == 1
    assert {int(e["string"]) for e in hands(*by(1, control(9, 80))) if e["kind"] == at.TOUCH_EVENT} == {E, A}
    assert last_numbers(hands(*by(3, control(123))), at.WAVER) == dict.fromkeys(range(4), 0.0), (
        "any channel lets go of keys"
    )


# One key on two channels


def test_a_unison_of_two_channels_sounds_on_two_strings() -> None:
    """Each ends with its own note-off."""
    hands = Hands()
    first, second = (int(hands(*by(c, on(45)))[-1]["string"]) for c in (0, 1))
    assert (first, second) == (G, D) and hands.p["stolen"] == 0
    assert semitones(hands(*by(1, wheel(8191)))).keys() >= {D} and G not in semitones(hands(*by(1, wheel(0))))
    assert last_numbers(hands(*by(0, off(45))), at.HAND).keys() == {G}
    assert last_numbers(hands(*by(1, off(45))), at.HAND).keys() == {D}
    again = Hands()
    again(*by(0, on(45), on(45)), *by(1, on(45), on(45)))
    assert again.strings("state") == [FREE, FREE, HELD, HELD], "struck again each stays on its string"


def test_the_last_string_is_taken_over_and_an_old_end_does_not_cut_it() -> None:
    hands = Hands(bass_tuned([40]))
    hands(*by(0, on(45)), *by(1, on(45)))
    assert hands.strings("channel") == [1] and hands.p["stolen"] == 1
    assert len(hands(*by(0, off(45)))) == 0
    assert last_numbers(hands(*by(1, off(45))), at.HAND).keys() == {0}


def test_rather_the_same_note_is_taken_over_than_another() -> None:
    hands = Hands(bass_tuned([40, 45], 5))
    hands(*by(0, on(44)), *by(0, on(47)), *by(1, on(47)))
    assert hands.strings("key") == [44, 47] and hands.strings("channel") == [0, 1]


def test_a_key_that_ends_on_another_channel_ends() -> None:
    hands = two()
    assert last_numbers(hands(*by(5, off(OPEN[E]))), at.HAND).keys() == {E}
    assert len(hands(*by(0, off(OPEN[E])))) == 0


def test_the_first_end_of_a_channel_ends_its_key_however_often_it_was_struck() -> None:
    hands = Hands()
    hands(*by(3, on(33), on(33)))
    assert last_numbers(hands(*by(3, off(33))), at.HAND).keys() == {A} and len(hands(*by(3, off(33)))) == 0


def test_a_string_goes_back_to_the_channel_of_the_key_under_the_last() -> None:
    """Another channel hammers on and bends; pulled off again, the string is unbent."""
    hands = Hands()
    hands(*by(1, wheel(4096)), *by(0, on(45)), control(68, 127))
    assert semitones(hands(*by(1, on(47)))) == pytest.approx({G: 1.0}, abs=1e-3)
    events = hands(*by(1, off(47)))
    assert semitones(events) == {G: 0.0} and events[-1]["kind"] == at.PULL_OFF
    hands(*by(1, on(47)), *by(0, off(45)))
    assert last_numbers(hands(*by(1, off(47))), at.HAND).keys() == {G}


# A wheel that slides


def test_a_wheel_that_slides_shifts_its_channel_alone() -> None:
    hands = Hands(bass(wheel="slide"))
    hands(*by(0, on(31)), *by(1, on(36)))
    events = hands(*by(1, wheel(8191)))
    assert [(int(e["kind"]), int(e["string"]), int(e["fret"])) for e in events] == [(at.GLIDE, A, 5)]
    assert hands(*by(0, off(31), on(31)))[-1]["fret"] == 3 and hands(*by(1, off(36), on(36)))[-1]["fret"] == 5
    assert hands(*by(0, off(31)), *by(1, on(31)))[-1]["fret"] == 5


# Hosts and a change of bass


@given(st.integers(0, 15), st.integers(-8192, 8191), st.integers(0, 127))
def test_a_change_of_bass_keeps_every_channel(channel: int, bend: int, volume: int) -> None:
    old = two()
    old(*by(channel, wheel(bend), control(7, volume), *rpn(0, 7), *rpn(2, 66)))
    new = new_performer(bass_numbers(bass("slap"), [], 20))
    follow_performer([], new, old.record)
    assert new["controls"]["channel"].tobytes() == old.record["controls"]["channel"].tobytes()


def test_another_basss_range_is_that_of_channels_that_have_none_of_their_own() -> None:
    old = two()
    old(*by(3, *rpn(0, 7)))
    new = new_performer(bass_numbers(bass("slap", bend_range=5.0), [], 20))
    follow_performer([], new, old.record)
    ranges = new["controls"]["channel"]["range"][0].tolist()
    assert ranges == [7.0 if channel in (3, performer.ANY) else 5.0 for channel in range(performer.CHANNELS + 1)]


def test_a_controller_for_a_parameter_is_the_whole_basss() -> None:
    hands = two()
    hands(*by(0, wheel(8191)), *by(1, wheel(8191)))
    assert semitones(hands(*by(1, control(techniques.LEARNED + techniques.BEND_RANGE, 127)))) == pytest.approx(
        dict.fromkeys(range(4), 24)
    )


# Modes


@pytest.mark.parametrize("zone", [STRINGS_FROM_1, MPE], ids=["strings", "notes"])
def test_while_channels_mean_something_the_others_are_for_the_whole_bass(zone: Sequence[Message]) -> None:
    """A bend of one string then bends all, whoever played before, even as the mode begins."""
    hands = two()
    hands(*by(8, wheel(8191)))
    events = hands(*zone)
    assert semitones(events) == pytest.approx({E: 2, A: 2}), "they have not heard it yet"
    hands((0x91, 38, 90))
    assert last_numbers(hands(*by(8, control(7, 64))), at.GAIN) == pytest.approx(
        dict.fromkeys(range(4), (64 / 127) ** 2)
    )
    assert semitones(hands(*by(9, wheel(0)))).keys() == {E, A, D, G}


@pytest.mark.parametrize("zone", [STRINGS_FROM_1, MPE], ids=["strings", "notes"])
@pytest.mark.parametrize("number", [1, 2])
def test_in_a_zone_channels_outside_it_tune_the_bass(zone: Sequence[Message], number: int) -> None:
    hands = Hands()
    hands(*zone, (0x91, 38, 90))
    assert not semitones(hands(*by(1, *rpn(number, 70, 0))))
    assert len(set(semitones(hands(*by(9, *rpn(number, 70, 0)))).values())) == 1


@pytest.mark.parametrize("zone", [STRINGS_FROM_1, MPE], ids=["strings", "notes"])
def test_a_mode_that_begins_tells_one_channel_nothing_new(zone: Sequence[Message]) -> None:
    hands = Hands()
    hands(wheel(3000), control(7, 50), on(OPEN[E]), control(1, 50))
    assert not {at.BEND, at.GAIN, at.WAVER} & {int(e["kind"]) for e in hands(*zone)}


@pytest.mark.parametrize(("string", "number"), [(0, 2), (1, 3), (3, 5), (3, 6), (0, 7), (2, 8)])
def test_harmonics_beyond_the_last_fret_sound_on_the_string_of_their_channel(string: int, number: int) -> None:
    hands = Hands(switches=True)
    key = OPEN[string] + (0, 0, 12, 19, 24, 28, 31, 34, 36)[number]
    events = hands((0xB0, 126, 6), on(17), (0x90 | (3 - string), key, 90))
    pluck = next(e for e in events if e["kind"] == at.PLUCK)
    assert (pluck["string"], pluck["fret"], hands.p["dropped"]) == (string, 0, 0)
    assert last_numbers(hands((0x80 | (3 - string), key, 0)), at.HAND).keys() == {string}
    hands((0x80, 17, 0), (0x90, 74, 90), (0x95, key, 90))
    assert hands.p["dropped"] == 2, "beyond the last fret, and beyond the last string"
    hands(on(17), (0x90, 73, 90))
    assert hands.p["dropped"] == 3, "no harmonic of this string"


def test_a_string_of_its_own_swells_alone() -> None:
    """By controller 11, under the bass's volume and until a reset; a mode that ends leaves the bass's expression."""
    hands = Hands()
    hands(*STRINGS_FROM_1)
    assert last_numbers(hands(*by(2, control(11, 64))), at.GAIN) == pytest.approx({A: (64 / 127) ** 2})
    both = last_numbers(hands(*by(9, control(7, 100))), at.GAIN)
    assert both == pytest.approx({i: (100 / 127 * (64 / 127 if i == A else 1)) ** 2 for i in range(4)})
    new = new_performer(bass_numbers(bass("slap"), [], 20))
    follow_performer([], new, hands.record)
    assert new["controls"]["string_expression"].tobytes() == hands.record["controls"]["string_expression"].tobytes()
    for end in (by(2, control(121)), [control(127, 0)]):
        hands(*by(2, control(11, 0)))
        assert last_numbers(hands(*end), at.GAIN)[A] == pytest.approx((100 / 127) ** 2)
        hands(*STRINGS_FROM_1)


@pytest.mark.parametrize("before", [(), ((0x92, 40, 90),)], ids=["silence", "a note"])
def test_a_tap_hammers_on_from_nowhere(before: Sequence[Message]) -> None:
    hands = Hands(switches=True)
    hands(*STRINGS_FROM_1, *before, on(2))
    kinds = hands((0x92, 38, 90))["kind"].tolist()
    assert kinds.count(at.HAMMER) == 1 and at.PLUCK not in kinds


# Anything


any_message = st.one_of(
    st.builds(on, st.integers(28, 63), st.integers(1, 127)),
    st.builds(off, st.integers(28, 63)),
    st.builds(wheel, st.integers(-8192, 8191)),
    st.builds(
        control,
        st.sampled_from([1, 5, 6, 7, 11, 38, 64, 68, 96, 100, 101, 120, 121, 123]),
        st.sampled_from([0, 2, 64, 127]),
    ),
)


@given(st.lists(st.tuples(st.integers(0, 2), any_message), max_size=50), st.sampled_from(["bend", "slide"]))
def test_strings_are_always_as_the_channel_that_they_follow(
    sequence: list[tuple[int, Message]], wheel_does: str
) -> None:
    """The last bend, gain and vibrato sent to each string are its channel's, whatever came before."""
    hands = Hands(bass(wheel=wheel_does))
    last: dict[int, dict[int, float]] = {at.BEND: {}, at.GAIN: {}, at.WAVER: {}}
    default = {at.BEND: 1.0, at.GAIN: 1.0, at.WAVER: 0.0}
    for channel, message in sequence:
        events = hands(*by(channel, message))
        for kind, values in last.items():
            values |= last_numbers(events, kind)
    for i, channel in enumerate(hands.strings("channel")):
        of = hands.p["controls"]["channel"][channel if channel >= 0 else performer.ANY]
        bend = 0.0 if wheel_does == "slide" else of["wheel"] * of["range"]
        bend += of["bend_up"] + of["coarse"] + (of["fine"] - performer.IN_TUNE) / performer.IN_TUNE
        wanted = {
            at.BEND: 2 ** (np.clip(bend, -97, 97) / 12),
            at.GAIN: (of["volume"] * of["expression"]) ** 2,
            at.WAVER: 0.4 * of["vibrato"],
        }
        for kind, value in wanted.items():
            assert last[kind].get(i, default[kind]) == pytest.approx(value), (i, kind)
