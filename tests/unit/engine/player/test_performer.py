"""The performer turns MIDI messages into plucks, strikes, hands, bends and gains on strings and frets."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st
from numpy.typing import NDArray
from support.hands import STRINGS, Hands, bass, bass_tuned, engine_of, loaded
from support.messages import Message, control, off, on, wheel

from livebass.engine.prepare import new_performer
from livebass.kernels.player import controls, fingering, performer, strokes
from livebass.kernels.player.constants import FINGER, STANDARD
from livebass.kernels.player.expression import MAX_BEND
from livebass.kernels.string import records as at
from livebass.model.instrument import Instrument, speaking
from livebass.model.modes import grazing_apex
from livebass.rows import techniques

PLUCKED = ("jazz-finger", "precision-finger", "flatwound", "muted")
AUDIBLE = (*PLUCKED, "slap-impulse")
OPEN = (28, 33, 38, 43)
LOWEST, HIGHEST, FRETS = 28, 63, 20
RPN_RANGE = ((0xB0, 101, 0), (0xB0, 100, 0))
NO_RPN = 16383
FREE, HELD, PEDALLED = performer.FREE, performer.HELD, performer.PEDALLED


def kinds(events: NDArray[np.void]) -> list[tuple[int, int]]:
    """(kind, string) of each event."""
    return [(int(e["kind"]), int(e["string"])) for e in events]


def hands_on(*strings: int) -> list[tuple[int, int]]:
    return [(at.HAND, i) for i in strings]


def ratios(events: NDArray[np.void]) -> float:
    """The frequency ratio of `events` that bend all strings alike."""
    assert kinds(events) == [(at.BEND, i) for i in range(4)]
    assert len(set(events["value"].tolist())) == 1
    return float(events["value"][0])


def gains(events: NDArray[np.void]) -> float:
    assert kinds(events) == [(at.GAIN, i) for i in range(4)]
    assert len(set(events["value"].tolist())) == 1
    return float(events["value"][0])


messages = st.one_of(
    st.builds(on, st.integers(LOWEST, HIGHEST), st.integers(1, 127)),
    st.builds(on, st.integers(0, 127), st.integers(0, 127)),
    st.builds(off, st.integers(LOWEST, HIGHEST)),
    st.builds(control, st.sampled_from([64, 64, 120, 121, 123]), st.sampled_from([0, 127])),
)


# Strings and frets


@pytest.mark.parametrize("key", range(LOWEST, HIGHEST + 1))
def test_a_first_note_goes_to_its_lowest_fret(key: int) -> None:
    string, fret = Hands().plays(key)
    assert OPEN[string] + fret == key
    assert fret == min(key - note for note in OPEN if 0 <= key - note <= FRETS)


@pytest.mark.parametrize(
    ("line", "tab"),
    [
        ("first position", "E0 E1 E2 E3 E4 A0 A1 A2 A3 A4 D0 D1 D2 D3 D4 G0 G1 G2 G3 G4"),
        ("walk", "E0 E3 E4 A0 A2 A3 D0 D2 G0 D2 D0 A3 A2 A0 E3 E0"),
        ("octaves", "A0 G2 A0 G2 A3 G5 A3 G5 E3 G0 E3 G0"),
        ("high", "G12 G14 G16 G17 G16 G14"),
    ],
)
def test_lines_a_bassist_knows(line: str, tab: str) -> None:
    keys = [OPEN[STRINGS.index(place[0])] + int(place[1:]) for place in tab.split()]
    assert Hands().tab(keys) == tab


@given(st.lists(st.integers(LOWEST, HIGHEST), max_size=40))
def test_the_hand_moves_as_little_as_needed(keys: list[int]) -> None:
    hands = Hands()
    for key in keys:
        place = int(hands.p["hands"]["place"])
        _, fret = hands.plays(key)
        hands(off(key))
        moved = int(hands.p["hands"]["place"])
        if fret == 0:
            assert moved == place
        else:
            assert moved <= fret <= moved + fingering.HAND_SPAN
            assert abs(moved - place) == max(place - fret, fret - place - fingering.HAND_SPAN, 0)


@given(st.lists(st.tuples(st.integers(LOWEST, HIGHEST), st.booleans()), max_size=40))
@example([(60, False), (50, False)])  # high up, D17 is nearer than the lower G7
def test_a_note_in_reach_is_played_there(keys: list[tuple[int, bool]]) -> None:
    hands = Hands()
    for key, keep in keys:
        place = int(hands.p["hands"]["place"])

        def near(fret: int, place: int = place) -> bool:
            return fret == 0 or place <= fret <= place + fingering.HAND_SPAN

        states = hands.strings("state")
        frets = [key - OPEN[i] for i in range(4) if states[i] == FREE and 0 <= key - OPEN[i] <= FRETS]
        again = any(s != FREE and k == key for s, k in zip(states, hands.strings("key"), strict=True))
        string, fret = hands.plays(key)
        if frets and not again:
            assert states[string] == FREE
            assert near(fret) or not any(near(f) for f in frets)
        if not keep:
            hands(off(key))


@given(st.lists(messages, max_size=60))
@example([on(k) for k in (45, 46, 47, 48, 49)])
@example([on(38), on(40), off(38), on(43), on(45)])
def test_no_string_is_taken_while_another_can_play(sequence: list[Message]) -> None:
    hands = Hands()
    for m in sequence:
        states, frets, keys = hands.strings("state"), hands.strings("fret"), hands.strings("key")
        notes, stolen = int(hands.p["notes"]), int(hands.p["stolen"])
        events = hands(m)
        if hands.p["notes"] == notes:
            assert hands.p["stolen"] == stolen
            continue
        (event,) = events
        i = int(event["string"])
        note = OPEN[i] + int(event["fret"])
        assert (note - m[1]) % 12 == 0
        if states[i] != FREE and OPEN[i] + frets[i] != note:
            able = [k for k in range(4) if 0 <= note - OPEN[k] <= FRETS]
            assert all(states[k] != FREE for k in able)
        again = [k for k in range(4) if states[k] != FREE and OPEN[k] + frets[k] == note]
        assert again in ([], [i]), "a note goes back to the string that sounds it"
        assert hands.p["stolen"] - stolen == (states[i] != FREE and keys[i] != m[1])
        for k in range(4):
            if k != i:
                assert (hands.strings("state")[k], hands.strings("key")[k]) == (states[k], keys[k])


def test_the_string_taken_is_the_one_in_the_lowest_place() -> None:
    hands = Hands()
    assert [hands.plays(k) for k in (43, 38, 33, 28)] == [(3, 0), (2, 0), (1, 0), (0, 0)]
    assert hands.plays(45) == (3, 2)
    assert hands.p["stolen"] == 1
    assert kinds(hands(off(43))) == []
    assert kinds(hands(off(45))) == hands_on(3)


def test_of_far_places_the_lowest_is_taken_before_the_nearest() -> None:
    """G1 is four frets below the hand, A11 three above it; ten frets outweigh one of a shift. D6 is taken."""
    hands = Hands()
    hands.p["hands"]["place"] = 5
    assert hands.plays(45) == (2, 7)
    assert hands.plays(44) == (3, 1)


@pytest.mark.parametrize("again", [False, True])
def test_the_oldest_string_is_taken_of_two_alike(again: bool) -> None:
    hands = Hands(bass_tuned([40, 40]))
    assert [hands.plays(45)[0], hands.plays(47)[0]] == [0, 1]
    if again:
        assert hands.plays(45)[0] == 0
    assert hands.plays(44)[0] == (1 if again else 0)


def test_a_note_struck_again_stays_on_its_string() -> None:
    """It stays there even if a lower place is free and nearer now."""
    hands = Hands()
    assert hands.tab([43]) == "G0" and hands.plays(45) == (2, 7)
    hands(off(43), on(29))
    assert hands.p["hands"]["place"] == 1
    assert hands.plays(45) == (2, 7)


@given(st.lists(messages, max_size=40), st.integers(0, 40))
def test_same_messages_same_events_however_sent(sequence: list[Message], cut: int) -> None:
    def events(*parts: list[Message]) -> list[list[tuple[float, ...]]]:
        engine = engine_of(bass())
        engine.performer = new_performer(engine.numbers)
        engine._pending = [np.zeros(0, at.EVENT) for _ in range(4)]
        frame = 0
        for part in parts:
            frames = np.arange(frame, frame + len(part), dtype=np.int64) * 7
            engine.send(frames, np.array(part, np.uint8).reshape(-1, 3))
            frame += len(part)
        return [p.tolist() for p in engine._pending]

    whole = events(sequence)
    assert events(sequence) == whole
    assert events(sequence[:cut], sequence[cut:]) == whole


# Notes outside the bass's range


@pytest.mark.parametrize("key", [*range(LOWEST), *range(HIGHEST + 1, 128)])
def test_out_of_range(key: int) -> None:
    hands = Hands()
    string, fret = hands.plays(key)
    note = OPEN[string] + fret
    assert (note - key) % 12 == 0
    assert not LOWEST <= note - 12 * int(math.copysign(1, note - key)) <= HIGHEST, "the nearest octave"
    assert [int(hands.p[k]) for k in ("notes", "transposed", "dropped")] == [1, 1, 0]
    assert kinds(hands(off(key))) == hands_on(string)

    hands = Hands(bass(out_of_range="drop"))
    assert kinds(hands(on(key), off(key))) == []
    assert [int(hands.p[k]) for k in ("notes", "transposed", "dropped")] == [0, 0, 1]


@given(st.lists(st.integers(0, 127), max_size=60), st.sampled_from(["drop", "transpose"]))
@example([60, 30, 19, 14], "transpose")  # 19 and 14 become 31 and 26, which are on no string
def test_every_note_on_is_counted_once(keys: list[int], option: str) -> None:
    hands = Hands(bass_tuned([20, 62], frets=5, out_of_range=option))
    hands(*[on(key) for key in keys])
    assert hands.p["notes"] + hands.p["dropped"] == len(keys)
    there = [key for key in keys if 20 <= key <= 25 or 62 <= key <= 67]
    assert hands.p["transposed"] == hands.p["notes"] - len(there)
    assert option == "transpose" or hands.p["notes"] == len(there)


# Force and place


@pytest.mark.parametrize("preset", AUDIBLE)
def test_velocity_to_apex(preset: str) -> None:
    instrument = bass(preset)
    maximum = instrument.player.greatest_apex
    for string in range(4):
        hands = Hands(instrument, string)
        for fret in range(FRETS):
            events = [hands.first(OPEN[string] + fret, v) for v in range(1, 128)]
            assert {(int(e["string"]), int(e["fret"])) for e in events} == {(0, fret)}
            if events[0]["kind"] == at.THROW:
                speed, player = [float(e["speed"]) for e in events], instrument.player
                assert speed[0] == pytest.approx(player.strike_softest, rel=0.1)
                assert speed[126] == pytest.approx(player.strike_hardest, rel=0.1)
                assert all(a < b for a, b in pairwise(speed)), (string, fret)
                continue
            less = instrument.player.strike_force if events[0]["kind"] == at.STRIKE_EVENT else 1.0
            apex = [float(e["apex"]) / less for e in events]
            assert all(a < b < maximum for a, b in pairwise(apex)), (string, fret)
            assert apex[0] > 0 and apex[126] <= maximum
            if events[0]["kind"] == at.STRIKE_EVENT:
                continue  # a thumb's impulse acts as the string decides
            if hands.p["stroke"] == FINGER:
                player, e = instrument.player, events[63]
                force = player.softest * (player.hardest / player.softest) ** (63 / 126)
                wanted = force * even_apex(instrument, string, fret, float(e["place"]))
                assert apex[63] == pytest.approx(wanted / (1 + (wanted / maximum) ** 4) ** 0.25, rel=1e-6)


def even_apex(instrument: Instrument, string: int, fret: int, where: float) -> float:
    """Apex (m), on a stopped string, of the force that makes the open string graze a fret, equally far from the saddle.

    A force pulls by x (L - x) / L, and hands play a shorter string more gently, by the root of its length.
    """
    open_string, stopped = (speaking(instrument.strings[string], instrument.necks[string], f) for f in (0, fret))
    from_saddle = stopped.length - where
    give = [s.length / ((s.length - from_saddle) * from_saddle) for s in (open_string, stopped)]
    gently = (stopped.length / open_string.length) ** STANDARD["gentler"][FINGER]
    return grazing_apex(open_string, open_string.length - from_saddle) * give[0] / give[1] * gently


def test_techniques() -> None:
    slap = loaded("slap-impulse")
    found = [Hands(slap, i)(on(OPEN[i] + 5))[0]["kind"] for i in range(4)]
    assert found == [at.STRIKE_EVENT] * 2 + [at.PLUCK] * 2
    assert [Hands(None, i)(on(OPEN[i] + 5))[0]["kind"] for i in range(4)] == [at.PLUCK] * 4


def test_a_curve_from_zero_is_a_number() -> None:
    hands = Hands(bass(softest=0.0))
    apex = [float(hands.first(40, v)["apex"]) for v in (1, 2, 64, 127)]
    assert all(math.isfinite(a) for a in apex) and apex == sorted(set(apex))


def test_unevenness_is_chance_within_its_bounds_and_that_of_the_seed() -> None:
    def played(seed: int, unevenness: float = 0.1) -> np.ndarray:
        hands = Hands(bass(unevenness=unevenness, nearer_when_hard=0.0))
        hands.p["seed"] = seed
        return np.array([[(e := hands(on(40))[0])["apex"], e["place"]] for _ in range(400)])

    even, one = played(1, 0.0), played(1)
    assert np.ptp(even, axis=0).max() == 0
    assert np.array_equal(one, played(1)) and not np.array_equal(one, played(2))
    index, middle = one[::2], one[1::2]
    assert middle[:, 0].mean() < index[:, 0].mean() and middle[:, 1].mean() > index[:, 1].mean() + 2e-3
    force = index[:, 0] / even[0, 0] - 1
    aside = index[:, 1] - even[0, 1]
    assert 0.05 < force.max() < 0.35 and -0.35 < force.min() < -0.05, "the place counts too"
    assert 0.009 < aside.max() <= 0.0101 and -0.0101 <= aside.min() < -0.009
    assert abs(np.corrcoef(aside[1:], aside[:-1])[0, 1]) < 0.15
    assert abs(aside.mean()) < 1e-3


def test_controller_16_moves_the_hand_over_the_body() -> None:
    player = bass().player
    hands = Hands(bass(nearer_when_hard=0.0))
    open_length, length = float(hands.ops[0, 0]["length"]), float(hands.ops[0, 3]["length"])
    from_saddle = []
    for place, m in [
        (player.pluck_position, control(10, 0)),
        (player.pluck_nearest, control(16, 0)),
        ((player.pluck_nearest + player.pluck_farthest) / 2, control(16, 64)),
        (player.pluck_farthest, control(16, 127)),
    ]:
        assert kinds(hands(m)) == []
        event = hands.first(28)
        assert event["place"] / open_length == pytest.approx(place, abs=8e-3)
        from_saddle.append(open_length - event["place"])
        event = hands.first(31)
        assert (event["string"], event["fret"]) == (0, 3)
        assert length - event["place"] == pytest.approx(from_saddle[-1], rel=1e-9), "as far from the saddle"
    assert from_saddle[1] > from_saddle[2] > from_saddle[3]


def test_controller_74_of_mpe_is_brighter_the_higher() -> None:
    """A note of an MPE zone is plucked nearer to the saddle, like all notes by controller 16."""
    places = []
    for value in (0, 64, 127):
        hands = Hands(bass())
        hands((0xB0, 101, 0), (0xB0, 100, 6), (0xB0, 6, 4), (0xB1, 74, value))
        (event,) = [e for e in hands((0x91, 33, 90)) if e["kind"] == at.PLUCK]
        places.append(float(event["place"]))
    assert places[0] + 0.02 < places[1] < places[2] - 0.02


@pytest.mark.parametrize("value", [0, 16, 64, 127])
@pytest.mark.parametrize("preset", AUDIBLE)
def test_every_place_is_on_the_string(preset: str, value: int) -> None:
    """Every position controller plucks every fretted string well away from its ends."""
    for string in range(4):
        hands = Hands(loaded(preset), string)
        hands(control(16, value))
        for fret in range(FRETS + 1):
            (event,) = hands(on(OPEN[string] + fret))
            assert 0.99 * strokes.MIN_STRIKE < event["place"] / hands.ops[0, fret]["length"] < 0.991


# Ends of notes


def test_note_off_stops_its_string_only() -> None:
    hands = Hands()
    hands(on(33), on(43))
    (event,) = hands(off(33))
    assert (event["kind"], event["string"]) == (at.HAND, 1)
    assert event["value"] == bass().player.hand_damping
    assert hands.strings("state") == [FREE, FREE, FREE, HELD]
    assert kinds(hands(off(33), off(40))) == [], "an end without a note"


def test_note_on_of_velocity_0_is_a_note_off() -> None:
    hands = Hands()
    hands(on(33))
    assert kinds(hands((0x90, 33, 0))) == hands_on(1)
    assert hands.p["notes"] == 1


def test_a_key_pressed_twice_ends_once() -> None:
    """A note-off may be lost or, as with pads, never sent between two note-ons: no note hangs."""
    hands = Hands()
    assert [hands.plays(45), hands.plays(45)] == [(3, 2)] * 2
    assert hands.p["stolen"] == 0
    assert kinds(hands(off(45))) == hands_on(3) and kinds(hands(off(45))) == []
    assert hands.strings("state") == [FREE] * 4


def test_a_chord_of_128_notes() -> None:
    hands = Hands()
    events = hands(*[on(key) for key in range(128)])
    assert {kind for kind, _ in kinds(events)} == {at.PLUCK} and len(events) == 128
    assert [int(hands.p[k]) for k in ("notes", "dropped", "transposed")] == [128, 0, 92]
    assert hands.p["stolen"] == 124
    assert hands.strings("state") == [HELD] * 4
    ends = hands(*[off(key) for key in range(128)])
    assert sorted(kinds(ends)) == hands_on(0, 1, 2, 3)
    assert hands.strings("state") == [FREE] * 4


def test_sustain_pedal() -> None:
    hands = Hands()
    hands(on(33), on(38), control(64, 127))
    assert kinds(hands(off(33))) == []
    assert hands.strings("state") == [FREE, PEDALLED, HELD, FREE]
    assert kinds(hands(control(64, 64))) == [], "still down"
    assert kinds(hands(control(64, 63))) == hands_on(1)
    assert hands.strings("state") == [FREE, FREE, HELD, FREE]
    assert kinds(hands(control(64, 0))) == []
    assert kinds(hands(off(38))) == hands_on(2)


def test_a_pedalled_note_struck_again_is_held() -> None:
    hands = Hands()
    hands(control(64, 127), on(33), off(33))
    assert hands.plays(33) == (1, 0)
    assert kinds(hands(control(64, 0))) == [], "the finger holds it now"
    assert kinds(hands(off(33))) == hands_on(1)


def test_the_pedal_holds_no_note_that_ended_before() -> None:
    hands = Hands()
    hands(on(33), off(33))
    assert kinds(hands(control(64, 127), control(64, 0))) == []


def test_a_pedalled_string_is_not_taken_while_another_can_play() -> None:
    hands = Hands()
    hands(control(64, 127), on(38), off(38))
    assert hands.plays(40) == (1, 7)


@pytest.mark.parametrize("number", [123, 124, 125, 126, 127])
def test_all_notes_off(number: int) -> None:
    hands = Hands()
    hands(on(33), on(43))
    assert kinds(hands(control(number))) == hands_on(1, 3)
    assert hands.strings("state") == [FREE] * 4
    hands(on(33), control(64, 127))
    assert kinds(hands(control(number))) == [], "the pedal holds"
    assert kinds(hands(control(64, 0))) == hands_on(1)


@pytest.mark.parametrize("value", [0, 32, 64, 127])
def test_a_hand_that_was_moved_is_as_far_between_the_ends_of_another_bass(value: int) -> None:
    old = Hands(bass(pluck_nearest=0.9, pluck_farthest=0.6))
    new = Hands(bass(pluck_nearest=0.95, pluck_farthest=0.75, pluck_position=0.8))
    controls.follow_performer(new.record.ctypes.data, old.record.ctypes.data)
    assert new.p["position"] == 0.8, "a hand that was not moved goes where this bass is plucked"
    old(control(16, value))
    controls.follow_performer(new.record.ctypes.data, old.record.ctypes.data)
    assert new.p["position"] == pytest.approx(0.95 - 0.2 * value / 127, rel=1e-12)


def test_all_sound_off() -> None:
    hands = Hands()
    hands(on(33), on(38), control(64, 127), off(33))
    assert kinds(hands(control(120))) == [(at.CUT, i) for i in range(4)]
    assert hands.strings("state") == [FREE] * 4
    assert kinds(hands(off(38), control(64, 0))) == [], "nothing is left to stop"


def test_reset_controllers_as_rp_015_says() -> None:
    hands = Hands()
    hands(*RPN_RANGE, control(6, 12), control(38, 50), control(7, 50), control(11, 20), control(16, 0), wheel(4000))
    hands(control(64, 127), on(33), on(38), off(33))
    events = hands(control(121))
    by_kind = {k: events[events["kind"] == k] for k in (at.BEND, at.GAIN, at.HAND, at.WAVER, at.TOUCH_EVENT)}
    assert len(events) == sum(map(len, by_kind.values()))
    assert ratios(by_kind[at.BEND]) == 1.0
    assert gains(by_kind[at.GAIN]) == pytest.approx((50 / 127) ** 2), "expression is reset, volume is not"
    assert kinds(by_kind[at.HAND]) == hands_on(1), "the pedal goes up; keys stay down"
    assert (hands.any["pedal"], hands.any["rpn"], hands.any["expression"]) == (0, NO_RPN, 1.0)
    assert hands.any["range"] == 12.5, "no registered parameter is reset"
    assert hands.p["position"] == bass().player.pluck_position
    assert kinds(hands(control(6, 5))) == [], "no parameter is selected"


# Wheel and range


def test_pitch_bend() -> None:
    hands = Hands()
    assert ratios(hands(wheel(0))) == 1.0
    assert ratios(hands(wheel(8191))) == pytest.approx(2 ** (2 / 12), rel=1e-15)
    assert ratios(hands(wheel(-8192))) == pytest.approx(2 ** (-2 / 12), rel=1e-15)
    assert ratios(hands(wheel(-4096))) == pytest.approx(2 ** (-1 / 12), rel=1e-15)
    reported = [ratios(hands(wheel(w))) for w in range(-8192, 8192, 500)]
    assert reported == sorted(set(reported))


def test_bend_range() -> None:
    hands = Hands()
    hands(wheel(8191))
    assert kinds(hands(*RPN_RANGE)) == []
    assert ratios(hands(control(6, 12))) == pytest.approx(2.0), "at once"
    assert ratios(hands(control(38, 50))) == pytest.approx(2 ** (12.5 / 12))
    assert ratios(hands(control(6, 7))) == pytest.approx(2 ** (7.5 / 12)), "the fine part stays"
    assert ratios(hands(control(38, 0))) == pytest.approx(2 ** (7 / 12))
    assert ratios(hands(control(6, 0))) == 1.0
    assert ratios(hands(control(6, 127))) == pytest.approx(256.0), "at most eight octaves"
    assert ratios(hands(control(38, 127))) == pytest.approx(2 ** (96.99 / 12)), "at most 99 cents"


@pytest.mark.parametrize(
    "deselect",
    [
        [control(101, 127), control(100, 127)],  # null
        [control(100, 127), control(101, 127)],
        [control(100, 5)],  # depth of the modulation
        [control(101, 1)],
        [control(99, 0)],  # not registered
        [control(98, 0)],
        [control(99, 0), control(98, 0)],
        [control(98, 0), control(100, 0)],  # half a selection
    ],
)
def test_data_entry_is_for_the_range_only_when_selected(deselect: list[Message]) -> None:
    hands = Hands()
    assert kinds(hands(control(6, 12), control(38, 12))) == [], "nothing selected yet"
    hands(*RPN_RANGE, *deselect)
    assert kinds(hands(control(6, 12), control(38, 12))) == []
    assert hands.any["range"] == 2.0
    hands(control(100, 0), control(101, 0))
    assert len(hands(control(6, 12))) == 4, "selected in the other order"


# Volume and ignored messages


def test_volume_and_expression() -> None:
    hands = Hands()
    assert gains(hands(control(7, 64))) == pytest.approx((64 / 127) ** 2)
    assert gains(hands(control(11, 32))) == pytest.approx((64 * 32 / 127**2) ** 2)
    assert gains(hands(control(7, 127))) == pytest.approx((32 / 127) ** 2)
    assert gains(hands(control(11, 127))) == 1.0
    assert gains(hands(control(11, 0))) == 0.0


@pytest.mark.parametrize(
    "message",
    [
        *[(0x00, 40, 90), (0x7F, 40, 90), (0x90, 128, 90), (0x90, 40, 128), (0x80, 255, 0), (0xE0, 0, 200)],
        *[(0xB0, 7, 200), (0xB0, 200, 7), (0xF0, 40, 90), (0xF8, 0, 0), (0xFF, 0, 0)],
        *[(0xA0, 33, 90), (0xC0, 33, 0), (0xD0, 90, 0)],  # poly pressure, program, pressure
        *[control(2, 90), control(10, 0), control(122, 0), control(96, 0), control(97, 0)],
    ],
)
def test_what_is_passed_over(message: Message) -> None:
    hands = Hands()
    hands(on(33), *RPN_RANGE)
    before = hands.p.copy()
    assert kinds(hands(message)) == []
    before["out"] = hands.p["out"]  # the destination of its events
    assert hands.p.tobytes() == before.tobytes()


@pytest.mark.parametrize("channel", range(16))
def test_any_channel(channel: int) -> None:
    hands = Hands()
    assert kinds(hands((0x90 | channel, 33, 90))) == [(at.PLUCK, 1)]
    assert kinds(hands((0x80 | channel, 33, 0))) == hands_on(1)


STRINGS_FROM_1 = (0xB0, 126, 6)  # more channels than strings: 5 and 6 have no string
MPE = ((0xB0, 101, 0), (0xB0, 100, 6), (0xB0, 6, 5))


def test_notes_of_channels_without_a_string_are_counted() -> None:
    hands = Hands()
    assert kinds(hands(STRINGS_FROM_1, (0x94, 33, 90), (0x95, 28, 90), (0xE4, 0, 90), (0xD5, 90, 0))) == []
    assert (hands.p["dropped"], hands.p["notes"]) == (2, 0)
    assert kinds(hands((0x84, 33, 0), (0x93, 28, 90))) == [(at.PLUCK, 0), (at.BEND, 0)]
    assert kinds(hands((0xB4, 123, 0))) == hands_on(0), "what is no note is for the bass on these channels, too"
    assert (hands.p["dropped"], hands.p["notes"]) == (2, 1)


def test_a_key_on_two_strings_ends_on_the_string_of_its_channel() -> None:
    hands = Hands()
    hands((0xB0, 126, 4), (0x91, 45, 90), (0x90, 45, 90))
    assert hands.strings("state") == [FREE, FREE, HELD, HELD]
    assert kinds(hands((0x81, 45, 0))) == hands_on(2)
    assert kinds(hands((0x90, 45, 0))) == hands_on(3)


def test_a_pull_off_of_a_string_of_its_own_leaves_the_others_their_keys() -> None:
    hands = Hands()
    hands((0xB0, 126, 4), (0x91, 45, 90), (0x91, 47, 90), (0x90, 45, 90), (0x90, 47, 90))
    assert kinds(hands((0x80, 45, 0))) == [] and kinds(hands((0x81, 47, 30))) == [(at.PULL_OFF, 2)]
    assert kinds(hands((0x80, 47, 30))) == hands_on(3), "45 is let go there"


@pytest.mark.parametrize("zone", [((0xB0, 126, 4),), MPE], ids=["strings", "notes"])
def test_keys_switch_on_channels_of_their_own(zone: tuple[Message, ...]) -> None:
    hands = Hands(switches=True)
    assert kinds(hands(*zone, (0x91, 10, 90))) == [] and hands.p["switched"][techniques.GHOST] == 1
    assert kinds(hands((0x91, 38, 90)))[0] == (at.PLUCK, 2) and hands.p["notes"] == 1
    assert kinds(hands((0x81, 10, 0))) == [] and hands.p["switched"][techniques.GHOST] == 0
    assert hands.p["dropped"] == hands.p["transposed"] == 0


def test_the_range_of_a_master_is_its_own() -> None:
    """RPN 0 on a channel with notes sets their range; on the master, the range of the wheel that bends them all."""
    hands = Hands()
    hands(*MPE, (0xB1, 101, 0), (0xB1, 100, 0), (0xB1, 6, 24), (0xB1, 38, 50), (0xB0, 6, 5), (0xB0, 38, 0))
    assert (hands.p["controls"]["channel_range"], hands.any["range"]) == (24.5, 5.0)
    hands((0x91, 38, 90), (0x92, 43, 90))
    (event,) = hands((0xE1, 127, 127))
    assert (event["kind"], event["string"]) == (at.BEND, 2) and event["value"] == pytest.approx(2 ** (24.5 / 12))
    bends = hands((0xE0, 127, 127))
    assert 12 * np.log2(bends["value"]) == pytest.approx([5, 5, 29.5, 5])


# Anything


def check(hands: Hands, events: NDArray[np.void]) -> None:
    p, count = hands.p, int(hands.p["strings"])
    states, keys, frets = hands.strings("state"), hands.strings("key"), hands.strings("fret")
    assert set(states) <= {FREE, HELD, PEDALLED}
    assert all(-1 <= k <= 127 for k in keys) and all(0 <= f <= FRETS for f in frets)
    channels = hands.strings("channel")
    held = [(c, k) for c, k, s in zip(channels, keys, states, strict=True) if s != FREE]
    assert len(set(held)) == len(held) and all(key >= 0 for _, key in held), "a key of a channel sounds on one string"
    followed = [performer.ANY if c < 0 or p["controls"]["mode"] else c for c in channels]
    assert all(s != PEDALLED or p["controls"]["channel"][c]["pedal"] for s, c in zip(states, followed, strict=True))
    assert 1 <= p["hands"]["place"] <= FRETS and 0.0 < p["position"] < 1.0
    for channel in p["controls"]["channel"]:
        assert 0.0 <= channel["range"] <= performer.MAX_RANGE + 0.99 and -1.0 <= channel["wheel"] <= 1.0
        assert 0.0 <= channel["volume"] <= 1.0 and 0.0 <= channel["expression"] <= 1.0
        assert 0 <= channel["rpn"] <= NO_RPN
    for e in events:
        assert 0 <= e["string"] < count and 0 <= e["fret"] <= FRETS
        assert all(np.isfinite(e[name]) for name in at.EVENT.names or ())
        if e["kind"] in (at.PLUCK, at.STRIKE_EVENT):
            assert 0.0 < e["apex"] <= p["player"]["greatest_apex"]
            assert 0.0 < e["place"] < hands.ops[e["string"], e["fret"]]["length"]
        elif e["kind"] == at.THROW:
            assert 0.0 < e["speed"] <= 8.0 and 0.0 < e["place"] < hands.ops[e["string"], e["fret"]]["length"]
        elif e["kind"] == at.BEND:
            assert abs(12 * math.log2(e["value"])) < MAX_BEND + 1e-9
        elif e["kind"] == at.GAIN:
            assert 0.0 <= e["value"] <= 1.0
        elif e["kind"] == at.TOUCH_EVENT:
            assert 0 <= e["finger"] < at.TOUCHES and 0.0 <= e["resistance"] < 100.0
            assert e["place"] > 0.0 or e["resistance"] == 0.0
        elif e["kind"] == at.HAMMER:
            assert 0.003 < e["speed"] < 30.0  # m/s, give or take 12 dB
        elif e["kind"] in (at.TONE, at.BLEND):
            assert -1.0 <= e["value"] <= 1.0
        elif e["kind"] == at.IDLE:
            assert 0 <= e["value"] < 2**count
        else:
            assert e["kind"] in (at.HAND, at.CUT, at.PULL_OFF, at.GLIDE, at.TIMED_GLIDE, at.WAVER)


any_message = st.one_of(
    messages,
    st.tuples(st.just(0xB0), st.sampled_from([6, 38, 98, 99, 100, 101]), st.sampled_from([0, 0, 12, 127])),
    st.tuples(st.integers(0, 255), st.integers(0, 255), st.integers(0, 255)),
)
EIGHT = bass_tuned([28, 33, 38, 43, 48, 53, 58, 63])
RING = [m for s in EIGHT.strings for m in (on(s.open_note), off(s.open_note))]


@given(st.lists(any_message, max_size=60), st.sampled_from([bass(), loaded("slap-impulse"), EIGHT]))
@example([control(64, 127), *RING, control(121)], EIGHT)
@example([on(2, 1), on(29, 1)], bass())  # the softest possible tap
def test_any_bytes_leave_the_performer_sane(sequence: list[Message], instrument: Instrument) -> None:
    hands = Hands(instrument, switches=True)
    for m in sequence:
        check(hands, hands(m))
