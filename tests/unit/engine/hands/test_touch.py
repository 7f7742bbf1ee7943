"""Touch: notes brighten with force and dull from the attack on, no two strokes are alike, a pick clicks."""

from __future__ import annotations

import itertools
from itertools import pairwise

import numpy as np
import pytest
from support.costs import KINDS, of_each_kind, quick
from support.own_basses import load_preset
from support.played import event
from support.quiet import without_noise
from support.strings import even

from livebass import QUALITIES, preset_names
from livebass.engine.engine import Engine
from livebass.engine.prepare import Voice, bass_numbers, pickup_voices, play_frames, take_message
from livebass.kernels.player import performer
from livebass.kernels.player.constants import FINGER, NAIL, PICK, POP, STANDARD
from livebass.kernels.string.records import EVENT, GAIN, PLUCK
from livebass.model.instrument import Instrument, Player, note_frequency
from livebass.rows.arrays import Floats
from livebass.rows.units import decibels

RATE = 44100
FINGERS = ("jazz-finger", "precision-finger", "flatwound", "five-string", "six-string", "drop-d", "fretless", "muted")
FRETS = (0, 5, 12)
VELOCITIES = (30, 60, 90)
BRIGHT = 700.0, 3000.0  # Hz
GROWTH = 4.0, 2.0  # dB, between these velocities, in order; of the worst note, and ...
PICK_GROWTH = 3.8  # ... of the worst note of a pick
MEDIAN_GROWTH = 5.0, 3.5  # ... of a typical note; real basses grow by 8 to 21 dB from soft to medium notes
MIN_DULLING = 0.65  # centroid at 20 ms over the centroid at 100 ms of the worst note; ...
DULLING = 1.02, 3.5  # ... and of a typical note; in real basses 1.1 to 1.9
# dB, at least, of a pick over a finger, 2 to 8 kHz; over a finger by the bridge, or on a pick's bass
CLICK, CLICK_NEAR = 8.0, 0.0
PAPER = ("paper-g", "paper-bass", "paper-fretless")
PLAYERS = sorted(set(preset_names()) - set(PAPER))  # the paper's finger is a wire, as narrow as a pick
OVER_FRETS = sorted(set(preset_names()) - {"fretless", "paper-fretless", "upright"})
POPPED = sorted(set(OVER_FRETS) - {"precision-pick", "short-scale"})  # a pick pops nothing
# dB, at most, of the peak of a straight-up pop over the loudest finger note's, across: with the same apex a finger that
# pulls 70 degrees off the vertical moves the string 9.3 dB less towards the pickups
POP_OVER = 10.5
FARTHER = 1.15  # factor, at least, by which a soft pop lifts the string above a finger's, where it can
# dB of a note's fundamental 9 ms after a finger takes its string: in front of the bridge pickup, and by it, where the
# string gives a finger less to take
OLD_NOTE, OLD_NOTE_NEAR, NEAR = -20.0, -8.0, 0.85
TAKEN = 9e-3  # s


class Hand:
    """A bass whose strings and frets can each be plucked alone, from rest."""

    def __init__(self, bass: Instrument, stroke: int = FINGER, seed: int = 0) -> None:
        self.bass, self.engine = bass, Engine(bass, QUALITIES["live"], RATE, seed=seed)
        self.engine.performer["stroke"] = stroke
        self.pull = bass.player.pull_time

    def strokes(self, i: int, fret: int, velocity: int, count: int = 1) -> np.ndarray:
        """The plucks, (count,) EVENT, of `count` equal notes on one string."""
        alone = self.engine.performer.copy()
        alone["strings"], alone["open"][0, 0], alone["slapped"] = 1, self.bass.strings[i].open_note, 0
        events = np.zeros(count + performer.MAX_EVENTS, EVENT)
        key, ops = self.bass.strings[i].open_note + fret, self.engine.pool.records[i : i + 1]
        for k in range(count):
            assert take_message(alone, ops, 0, (0x90, key, velocity), events, k) == k + 1
        assert (events[:count]["kind"] == PLUCK).all()
        return events[:count]

    def string(self, i: int) -> Voice:
        """String `i` at rest."""
        numbers = bass_numbers(self.bass, (), self.engine.frets)
        return pickup_voices(numbers, self.bass.output.coil, self.engine.rates)[i]

    def sound(self, i: int, event: np.ndarray, seconds: float = 0.31) -> Floats:
        """The signal of string `i` from note-on to `seconds` after the finger lets go."""
        out = np.zeros(round((self.pull + seconds) * RATE))
        play_frames(self.string(i), self.engine.pool.records[i], event, out)
        return out

    def note(self, i: int, fret: int, velocity: int) -> Floats:
        return self.sound(i, self.strokes(i, fret, velocity))

    def fundamental(self, i: int, fret: int) -> float:
        return note_frequency(self.bass.strings[i].open_note + fret)


def band(x: Floats, low: float, high: float) -> float:
    """Level (dB) of `x` between two frequencies (Hz)."""
    window = np.hanning(2 * len(x))[len(x) :]  # the signal begins at rest
    power = np.abs(np.fft.rfft(x * window, 4 * RATE)) ** 2
    return float(10 * np.log10(power[round(4 * low) : round(4 * high)].sum()))


def brightness(x: Floats, fundamental: float) -> float:
    """Level (dB) of BRIGHT relative to the fundamental, in 0.3 s."""
    heard = x[: round(0.3 * RATE)]
    return band(heard, *BRIGHT) - band(heard, 0.75 * fundamental, 1.4 * fundamental)


def centroid(x: Floats, at: float) -> float:
    """Centroid of the power (Hz) in the 40 ms around `at` (s)."""
    half = round(0.02 * RATE)
    middle = round(at * RATE)
    power = np.abs(np.fft.rfft(x[middle - half : middle + half] * np.hanning(2 * half), 4 * RATE)) ** 2
    return float((power * np.arange(power.size)).sum() / power.sum() / 4)


def grown(hand: Hand, frets: tuple[int, ...] = FRETS) -> Floats:
    """The brightening of each note between successive VELOCITIES, (notes, 2), dB."""
    notes = [(i, fret) for i in range(len(hand.bass.strings)) for fret in frets]
    levels = [[brightness(hand.note(*note, v), hand.fundamental(*note)) for v in VELOCITIES] for note in notes]
    return np.diff(levels, axis=1)


def dulling(hand: Hand, frets: tuple[int, ...] = FRETS) -> Floats:
    """Centroid at 20 ms over the centroid at 100 ms of each note at velocity 127, (notes,)."""
    sounds = [hand.note(i, fret, 127) for i in range(len(hand.bass.strings)) for fret in frets]
    return np.array([centroid(x, hand.pull + 0.02) / centroid(x, hand.pull + 0.1) for x in sounds])


@pytest.mark.parametrize("name", of_each_kind(FINGERS))
def test_notes_brighten_with_force(name: str) -> None:
    growth = grown(Hand(even(name)))
    assert (growth.min(axis=0) >= GROWTH).all(), f"{name}: {growth.min(axis=0).round(1)} dB, asked: {GROWTH}"
    assert (np.median(growth, axis=0) >= MEDIAN_GROWTH).all(), f"{name}: {np.median(growth, axis=0).round(1)} dB"


@pytest.mark.parametrize("name", of_each_kind(FINGERS))
def test_hard_notes_dull_from_the_attack_on(name: str) -> None:
    """A cone, as in recordings: their losses on the frets let them rattle only for moments."""
    ratio = dulling(Hand(even(name)))
    typical = float(np.median(ratio))
    assert DULLING[0] < typical < DULLING[1], f"{name}: centroid at 20 ms {typical:.2f} times that at 100 ms"
    assert ratio.min() >= MIN_DULLING, f"{name}: {ratio.min():.2f}"


@pytest.mark.parametrize("name", ["jazz-finger", "precision-finger"])
def test_so_do_those_of_a_pick(name: str) -> None:
    hand = Hand(even(name), PICK)
    growth, ratio = grown(hand), dulling(hand)
    assert (np.median(growth, axis=0) >= PICK_GROWTH).all()
    assert np.median(ratio) > 0.9  # recordings: 1.1


def click_of(name: str) -> float:
    """The least click of a pick over the finger of a preset, dB."""
    player = load_preset(name).player
    return CLICK if player.pluck_position < NEAR and player.stroke == "finger" else CLICK_NEAR


@pytest.mark.parametrize(
    ("name", "velocity"),
    quick(
        itertools.product(("jazz-finger", "precision-finger", "flatwound"), (60, 90, 110)),
        always=[("jazz-finger", 110), ("precision-finger", 60), ("flatwound", 90)],
    ),
)
def test_a_pick_clicks(name: str, velocity: int) -> None:
    """2 to 8 kHz of the first 20 ms, both at equal level of the fundamental."""
    bass = even(name)
    finger, pick = Hand(bass), Hand(bass, PICK)
    over = []
    for i in range(len(finger.bass.strings)):
        f0 = finger.fundamental(i, 5)
        click = []
        for hand in (pick, finger):
            x = hand.note(i, 5, velocity)
            click.append(band(x[: round(0.02 * RATE)], 2000, 8000) - band(x, 0.75 * f0, 1.4 * f0))
        over.append(click[0] - click[1])
    assert min(over) >= click_of(name)


def attack_over_fundamental(x: Floats, fundamental: float) -> tuple[float, float]:
    """Levels (dB) of the fundamental, and of 2 to 8 kHz in the first 20 ms."""
    return band(x, 0.75 * fundamental, 1.4 * fundamental), band(x[: round(0.02 * RATE)], 2000, 8000)


@pytest.mark.parametrize("name", quick(PLAYERS, ["jazz-finger", "precision-pick"]))
def test_a_pick_clicks_over_a_finger_whose_fundamental_is_as_loud(name: str) -> None:
    """At any velocity, for any hand: compared with a softer finger note of an equally loud fundamental.

    A hand that pulls hard strings up rattles them: at equal velocity it may be as bright as a pick.
    """
    finger, pick = (Hand(even(name), stroke) for stroke in (FINGER, PICK))
    minimum = np.inf
    for i in range(len(finger.bass.strings)):
        f0 = finger.fundamental(i, 5)
        levels = [attack_over_fundamental(finger.note(i, 5, v), f0) for v in range(1, 128, 9)]
        for velocity in (30, 45, 60, 90, 127):
            fundamental, click = attack_over_fundamental(pick.note(i, 5, velocity), f0)
            above = max(next((k for k, level in enumerate(levels) if level[0] >= fundamental), len(levels) - 1), 1)
            (low, under), (high, over) = levels[above - 1 : above + 1]
            minimum = min(minimum, click - under - (over - under) * (fundamental - low) / (high - low))
    assert minimum >= click_of(name), f"{name}: {minimum:.1f} dB"


@pytest.mark.parametrize("name", of_each_kind(OVER_FRETS))
def test_a_pop_starts_no_higher_than_the_greatest_apex(name: str) -> None:
    """On any string and fret, so it is not much louder than the loudest other note of the bass."""
    finger, pop = (Hand(even(name), stroke) for stroke in (FINGER, POP))
    notes = [(i, fret) for i in range(len(pop.bass.strings)) for fret in (0, 5, 12, 17, 20) if fret <= pop.engine.frets]
    for i, fret in notes:
        assert pop.strokes(i, fret, 127)["apex"][0] <= pop.bass.player.greatest_apex, (i, fret)
        popped, plucked = (hand.strokes(i, fret, 20)[0] for hand in (pop, finger))
        lifted, wanted = (float(e["apex"] * np.cos(e["angle"])) for e in (popped, plucked))
        assert lifted > FARTHER * wanted, (i, fret, lifted, wanted)
    loudest = [max(float(np.abs(hand.note(*note, 127)).max()) for note in notes) for hand in (finger, pop)]
    over = decibels(loudest[1] / loudest[0])
    assert over <= POP_OVER, f"{name}: {over:.1f} dB"


@pytest.mark.parametrize("name", of_each_kind(PLAYERS))
def test_the_centroid_rises_with_velocity_below_all_contact(name: str) -> None:
    hand = Hand(even(name))
    for i in range(len(hand.bass.strings)):
        heard = [centroid(hand.note(i, 5, velocity), hand.pull + 0.02) for velocity in (15, 30, 45, 60)]
        assert all(soft < hard for soft, hard in pairwise(heard)), (i, heard)


@pytest.mark.parametrize("name", of_each_kind(POPPED))
def test_a_pop_hits_a_fret_within_a_half_period(name: str) -> None:
    """Half a period of the note, from the release on, not before. Softer pops clear all frets, high up first.

    Few frets are left near the body, and a force that reached them would be far louder than the notes below.
    """
    hand = Hand(even(name), POP)
    for i in range(len(hand.bass.strings)):
        for velocity, frets in ((80, (0, 3)), (100, (0, 3, 7)), (127, (0, 3, 7, 12))):
            for fret in frets:
                string, ops = hand.string(i), hand.engine.pool.records[i]
                play_frames(string, ops, hand.strokes(i, fret, velocity), np.zeros(round(hand.pull * RATE)))
                assert string.note() == (fret, 0)
                half = np.zeros(int(RATE / hand.fundamental(i, fret) / 2))
                play_frames(string, ops, np.zeros(0, EVENT), half)
                assert string.note()[1] > 0, (i, fret, velocity)


def motion(hand: Hand, i: int, fret: int, starts: tuple[float, ...], until: float) -> complex:
    """The fundamental of string `i`, q + i dq/dt / omega (m^1.5), after soft notes at `starts` (s)."""
    string = hand.string(i)
    events = np.repeat(hand.strokes(i, fret, 30), len(starts))
    events["frame"] = [round(t * RATE) for t in starts]
    stop = event(GAIN, value=1.0)  # in the midst of a run the motion is that at its end
    stop["frame"] = round(until * RATE) - 1
    events = np.concatenate([events, stop])
    play_frames(string, hand.engine.pool.records[i], events, np.zeros(round(until * RATE)))
    w = string.slots[string.record["slot"][0]]["u"]
    q, p, pace, sigma = (float(w["low"][name][0]) for name in ("q", "p", "pace", "sigma"))
    return complex(q, (pace * p - sigma * q) / float(w["omega"][0]))


@pytest.mark.parametrize(
    ("name", "fret"),
    quick(
        itertools.product(preset_names(), (0, 2, 5, 9, 12)),
        always=[*itertools.product(KINDS, (0, 9)), *(("jazz-finger", fret) for fret in (2, 5, 12))],
    ),
)
def test_a_finger_takes_the_old_fundamental_away(name: str, fret: int) -> None:
    """The remainder on any string: the difference between a note plucked again and one from silence."""
    hand = Hand(even(name))
    again = 0.2
    for i in range(len(hand.bass.strings)):
        both, new, old = (motion(hand, i, fret, starts, again + TAKEN) for starts in ((0.0, again), (again,), (0.0,)))
        left = decibels(abs(both - new) / abs(old))
        maximum = OLD_NOTE if hand.bass.player.pluck_position < NEAR else OLD_NOTE_NEAR
        assert left <= maximum, f"string {i}: {left:.1f} dB"


@pytest.mark.parametrize("stroke", [FINGER, PICK, NAIL, POP])
def test_equal_notes_differ_and_a_seed_repeats_them(stroke: int) -> None:
    bass = without_noise("jazz-finger")
    first, again, other = (Hand(bass, stroke, seed).strokes(1, 5, 90, 16) for seed in (1, 1, 2))
    assert first.tobytes() == again.tobytes() != other.tobytes()
    for field in ("apex", "place", "width", "seconds", "angle"):
        assert len(set(first[field].tolist())) == 16, field
    hand = Hand(bass, stroke, 1)
    assert len({hand.sound(1, first[k : k + 1], 0.02).tobytes() for k in range(16)}) == 16


def test_index_and_middle_finger_take_turns() -> None:
    """The middle finger plucks nearer to the saddle, a little softer, and lets go sooner."""
    events = Hand(load_preset("jazz-finger")).strokes(0, 5, 90, 200)
    index, middle = events[::2], events[1::2]
    nearer = middle["place"].mean() - index["place"].mean()
    assert nearer == pytest.approx(STANDARD["other_nearer"][FINGER], abs=2e-3)
    assert middle["apex"].mean() < index["apex"].mean()
    assert middle["seconds"].mean() < 0.95 * index["seconds"].mean()


@pytest.mark.parametrize(
    ("line", "fingers"),
    [
        ([(3, 0), (2, 60), (1, 120)], [0, 0, 0]),  # quickly to lower strings: a rake
        ([(3, 0), (2, 100), (1, 200)], [0, 1, 0]),  # later
        ([(1, 0), (2, 60), (3, 120)], [0, 1, 0]),  # to higher strings
        ([(1, 0), (1, 60), (0, 120)], [0, 1, 1]),  # the same string
    ],
)
def test_a_finger_that_rakes_does_not_take_turns(line: list[tuple[int, int]], fingers: list[int]) -> None:
    """Lists the finger of each note, 1 for the middle one; (string, ms) of the notes."""
    bass = without_noise("jazz-finger")
    engine, used = Engine(bass, QUALITIES["live"], RATE), []
    for i, ms in line:
        events = np.zeros(performer.MAX_EVENTS, EVENT)
        note = (0x90, bass.strings[i].open_note, 90)
        assert take_message(engine.performer, engine.pool.records, round(ms * RATE / 1000), note, events, 0) == 1
        assert events["string"][0] == i
        used.append(1 - int(engine.performer["hands"]["other"][0]))
    assert used == fingers


def test_a_pick_goes_down_and_up() -> None:
    events = Hand(load_preset("jazz-finger"), PICK).strokes(0, 5, 90, 16)
    down, up = events[::2], events[1::2]
    assert (down["angle"] > 0.5).all() and (up["angle"] < -0.3).all()
    even_hand = Hand(even("jazz-finger"), PICK)
    down, up = even_hand.strokes(0, 5, 60, 2)
    assert -0.5 < decibels(up["apex"] / down["apex"]) < 0.5
    assert up["place"] - down["place"] == pytest.approx(STANDARD["other_nearer"][PICK])


def test_shape_and_place_follow_the_force() -> None:
    """From velocity 1 to 127 within the player's limits, evenly in the logarithm."""
    bass = even("jazz-finger")
    player, hand = bass.player, Hand(bass)
    soft, middle, hard = (hand.strokes(0, 5, velocity)[0] for velocity in (1, 64, 127))
    for field, minimum, maximum in (
        ("width", player.rounding, player.rounding_soft),
        ("seconds", player.release_time, player.release_time_soft),
    ):  # fmt: skip
        assert soft[field] == pytest.approx(maximum) and hard[field] == pytest.approx(minimum)
        assert middle[field] == pytest.approx(np.sqrt(minimum * maximum))
    assert hard["place"] - soft["place"] == pytest.approx(player.nearer_when_hard)
    assert middle["place"] - soft["place"] == pytest.approx(player.nearer_when_hard / 2)


def test_a_stroke_towards_the_neck_stays_above_the_frets() -> None:
    """A rest stroke pulls the string down: the held triangle must not reach a fret."""
    bass = even("jazz-finger", pluck_angle=np.radians(110.0), softest=1.0, hardest=50.0, greatest_apex=0.03)
    hand = Hand(bass)
    for i in range(4):
        for fret in FRETS:
            (event,) = hand.strokes(i, fret, 127)
            op = hand.engine.pool.records[i, fret]
            length, place = float(op["length"]), float(event["place"])
            down = -np.cos(event["angle"]) * event["apex"]
            assert down > 0
            neck, scale = bass.necks[i], bass.strings[i].length
            stop = scale - length
            for x, h in zip(neck.fret_positions, neck.fret_heights, strict=True):
                if x > stop + 1e-6:
                    at = x - stop
                    shape = at / place if at < place else (length - at) / (length - place)
                    crown = 0.0 if fret == 0 else neck.fret_heights[fret - 1]
                    clearance = crown * (1 - at / length) - h
                    assert down * shape <= 0.81 * clearance


@pytest.mark.parametrize("name", PAPER)
def test_the_papers_pluck_stays_a_triangle(name: str) -> None:
    player = load_preset(name).player
    assert (player.release_time, player.rounding_soft, player.release_speed) == (0, 0, 0)
    assert (player.nearer_when_hard, player.stroke) == (0, "finger")
    events = Hand(load_preset(name)).strokes(0, 0, 30, 4)
    assert np.unique(events).size == 1 and events[0]["width"] == player.rounding and events[0]["seconds"] == 0


def test_a_finger_that_moves_as_it_lets_go_does_not_jump() -> None:
    """Through the release, the string goes on at the finger's speed."""
    steps = []
    for speed in (0.0, 2.0):
        hand = Hand(even("jazz-finger", release_speed=speed, pluck_angle=0.0, greatest_apex=2e-3))
        numbers = bass_numbers(hand.bass, (), hand.engine.frets)
        string = pickup_voices(numbers, hand.bass.output.coil, hand.engine.rates)[2]
        pull = round(hand.bass.player.pull_time * RATE)
        out = np.zeros(2 * pull)
        play_frames(string, hand.engine.pool.records[2], hand.strokes(2, 5, 30), out)
        steps.append(float(np.abs(np.diff(out)).max()))
    assert steps[1] < 1.5 * steps[0]


def test_the_default_player_has_one_touch() -> None:
    """A preset without touch settings keeps its sound."""
    player = Player()
    assert player.release_time == player.release_time_soft == player.rounding_soft == player.nearer_when_hard == 0.0


def test_a_pick_is_about_as_loud_as_a_finger() -> None:
    """It lifts the string as far from the neck; its fundamental is weaker, as it plays nearer to the saddle."""
    for velocity in VELOCITIES:
        finger, pick = (Hand(even("jazz-finger"), s).note(1, 5, velocity) for s in (FINGER, PICK))
        assert abs(decibels(np.sqrt((pick**2).mean())) - decibels(np.sqrt((finger**2).mean()))) < 9.0
