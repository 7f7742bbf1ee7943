"""Energy over random techniques: only hands add any, and no more than to a string at rest.

The energy is the scheme's own invariant, eq. 12 of Issanchou et al. (2018), in frames without a pushing fret, plus the
tension's (kernels/string/tension.py).
"""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from support.costs import quick, slow
from support.own_basses import load_preset
from support.played import FRETS_OUT, RATE, RINGS_ON, TURNED, YIELDS, Played, event

from livebass.engine.prepare import play_frames
from livebass.kernels.hands import fretting
from livebass.kernels.string.records import (
    BEND,
    EVENT,
    GLIDE,
    HAMMER,
    HAND,
    MAX_NEAR,
    PLUCK,
    PULL_OFF,
    STRIKE_EVENT,
    THROW,
    TOUCH_EVENT,
    WAVER,
)
from livebass.model.instrument import Pluck, Speaking, speaking
from livebass.model.modes import frequencies, pluck_amplitudes

EVERY = 500  # average frames between techniques
# Wavering of the energy by tension, over its least so far. In single frames the kick follows the motion, which puts the
# energy off by up to dT/T omega h / 2 either way, 4.2e-4 on slap; runs are kicked in their middle: quartets waver
# less, and long runs come only where tension is small
RIPPLE = 8e-4
ROUNDING = 1e-11
# Rounding error of the sums and products of a float32 leap, relative to its result: |a q| + |b P| + their sum, half a
# unit of the last place each, with |cos| + |sin| <= 2^0.5
LEAP_ROUNDING = (1.0 + 2.0**0.5) * 2.0**-24
IDLE = 1e-9  # J
PALM = (12e-3, 25e-3, 38e-3)  # m from the saddle
TECHNIQUES = ("pluck", "pop", "slap", "hammer", "tap", "pull", "slide", "touch", "palm", "bend", "vibrato", "end")
PLUCKS, LEFT_HAND = ("pluck", "pop", "slap"), ("hammer", "tap", "pull", "slide", "end")
LEFT_HAND_J = 20e-3  # J; a hammer-on of 2.5 m/s adds 13 mJ to a string at rest, lowered by a finger with up to 6
SLACK = 1.2  # of the energy: a motion that changes length keeps its energy to some percent
STRINGS = (("jazz-finger", 0), ("jazz-finger", 3), ("slap", 1), ("five-string", 2), ("paper-bass", 2), ("fretless", 0))
YIELDING = (("jazz-finger" + YIELDS, 2), ("slap" + YIELDS, 0), ("fretless" + YIELDS, 1))
EXCHANGING = (("jazz-finger" + TURNED, 2), ("slap" + TURNED, 0), ("fretless" + TURNED, 1))


def random_events(name: str, string: Played, rng: np.random.Generator) -> np.ndarray:
    """The events of a technique, at a random fret, place and strength."""
    whole, fret = string.ops[0], int(rng.integers(0, string.frets + 1))
    length = float(string.ops[fret]["length"])
    impedance = float(whole["fine"] ** 2 / whole["weight"] * whole["speed"])
    firm = float(rng.choice([0.0, 0.4, 1.5, 16.0])) * impedance
    mm = 1e-3
    match name:
        case "pluck":
            apex = rng.uniform(0.2, 5) * mm * length / float(whole["length"])
            place, angle = length * rng.uniform(0.5, 0.95), rng.uniform(-1.2, 1.2)
            return event(PLUCK, fret, apex=apex, place=place, width=5 * mm, seconds=1e-4, angle=angle)
        case "pop":
            apex = rng.uniform(3, 8) * mm * length / float(whole["length"])
            return event(PLUCK, fret, apex=apex, place=0.7 * length, width=2.5 * mm, seconds=3e-5, angle=0.2)
        case "slap" if int(whole["points"]) <= MAX_NEAR and rng.random() < 0.6:
            masses = {
                "mass": rng.uniform(0.01, 0.06), "width": rng.uniform(3, 15) * mm, "stiffness": 10 ** rng.uniform(5, 6),
            }  # fmt: skip
            return event(THROW, fret, speed=rng.uniform(0.5, 4), place=length * rng.uniform(0.3, 0.9), **masses)
        case "slap":
            return event(STRIKE_EVENT, fret, apex=rng.uniform(0.5, 4) * mm, place=length * rng.uniform(0.3, 0.9))
        case "hammer" | "tap":
            return event(HAMMER, fret, speed=rng.uniform(0.3, 2.5))
        case "pull":
            lower = int(rng.integers(0, max(int(string.voice.note()[0]), 1)))
            return event(PULL_OFF, lower, apex=rng.uniform(0.5, 2) * mm)
        case "slide":
            return event(GLIDE, fret, seconds=float(rng.choice([3e-3, 22e-3])))
        case "touch":
            place = float(whole["length"]) * rng.uniform(0.02, 0.6)
            return event(
                TOUCH_EVENT,
                finger=3,
                place=place,
                resistance=firm,
                width=5 * mm,
                seconds=float(rng.choice([0.0, 0.03])),
            )
        case "palm":
            return np.concatenate(
                [event(TOUCH_EVENT, finger=k, place=x, resistance=firm / 3, width=5 * mm) for k, x in enumerate(PALM)]
            )
        case "bend":
            return event(BEND, value=2 ** (float(rng.choice([-2, -1, 0, 0, 1, 2])) / 12))
        case "vibrato":
            return event(WAVER, value=float(rng.choice([0.0] * 7 + [0.4])), rate=5.6)
    return event(HAND, value=90.0)


def own_energy(preset: str, i: int, events: np.ndarray, tuned: float) -> float:
    """Energy (J) that `events` put into a string at rest, bent as far; for a mass, all of its energy."""
    if events[0]["kind"] == THROW:
        return float(events[0]["mass"] * events[0]["speed"] ** 2) / 2
    string, none = Played(preset, i), np.zeros(0, EVENT)
    string.record["bend"] = string.record["tuned"] = tuned
    string.play(events.copy())
    while string.hands()[0]:
        string.play(none)
    return string.energy()


def assert_hands_alone(preset: str, i: int, seconds: float, seed: int) -> tuple[int, int]:
    """Plays random techniques at random frames; returns the number of free frames and of checked work.

    In frames without a working hand the energy exceeds its least since the last work only by the tension's ripple.
    Landing and lifting fingers and palms, and the beginnings of bends and vibratos, do no work either. Plucks and
    strikes add no more to the square root of a moving string's energy than to a string at rest, as in any sum of two
    motions; a left hand adds at most LEFT_HAND_J.
    """
    string, rng = Played(preset, i), np.random.default_rng(seed)
    ripple = RIPPLE if float(string.record["stretch"]) else ROUNDING
    none, minimum, due, free, works_seen = np.zeros(0, EVENT), np.inf, 10, 0, 0
    maximum = np.inf  # J after the work in progress
    for frame in range(round(seconds * RATE)):
        now, name = none, ""
        if frame == due:
            name = str(rng.choice(TECHNIQUES))
            now, due = random_events(name, string, rng), frame + 1 + int(rng.exponential(EVERY))
        before = string.hands()
        string.play(now)
        after = string.hands()
        if before[0] or after[0] or before[1:] != after[1:] or name in PLUCKS or name in LEFT_HAND:
            if name in PLUCKS and np.isfinite(minimum):
                maximum = SLACK * (np.sqrt(minimum) + np.sqrt(own_energy(preset, i, now, after[1]))) ** 2
            elif name in LEFT_HAND and np.isfinite(minimum):
                maximum = SLACK * (np.sqrt(minimum) + np.sqrt(LEFT_HAND_J)) ** 2
            elif before[1] != after[1] or name:
                maximum = np.inf  # a bending arm works too, or two hands work together
            minimum = np.inf
        elif not string.voice.pressed():
            energy = string.energy()
            assert energy <= maximum, (frame, energy, maximum)
            works_seen += bool(np.isfinite(maximum))
            maximum = np.inf
            if np.isfinite(minimum):
                free += 1
                assert energy <= (1 + ripple) * minimum + IDLE * ROUNDING, (frame, name, energy / minimum - 1)
            minimum = min(minimum, energy)
    assert int(string.record["weakened"]) == 0
    return free, works_seen


@pytest.mark.parametrize(
    ("preset", "i"),
    [slow("jazz-finger", 3), ("slap", 1), ("jazz-finger" + TURNED, 3), ("jazz-finger" + FRETS_OUT, 3)],
)
def test_hands_alone_put_energy_into_a_string(preset: str, i: int) -> None:
    free, works = assert_hands_alone(preset, i, 0.4, 6)
    assert free > 2000 and works > 2


@pytest.mark.slow
@pytest.mark.parametrize(("preset", "i"), STRINGS + YIELDING + EXCHANGING)
@pytest.mark.parametrize("seed", range(2))
def test_they_do_on_every_kind_of_string(preset: str, i: int, seed: int) -> None:
    free, works = assert_hands_alone(preset, i, 0.5, seed)
    assert free > 2000 and works > 1  # a soft hammer is on its way for 32 ms


@pytest.mark.parametrize(("preset", "i"), quick([("jazz-finger", 0), ("slap", 2), ("fretless", 1)], [("slap", 2)]))
def test_fingers_leave_out_what_has_died_and_still_take_energy(preset: str, i: int) -> None:
    """Fingers that end a note damp fewer modes as these die; the energy still falls, to silence."""
    string, none = Played(preset, i), np.zeros(0, EVENT)
    string.record["stretch"] = 0.0  # tension, a symplectic step, lets the energy waver
    string.play(event(PLUCK, 0, apex=0.5e-3, place=0.2, width=5e-3, seconds=1e-4, angle=0.3))
    while string.frame < RATE // 10:
        string.play(none)
    string.play(event(HAND, value=90.0))
    slot, fewer, began, before = string.voice.slots[int(string.record["slot"])], 0, string.energy(), np.inf
    while slot["on"]:
        assert string.frame < RATE
        minimum, alive = before, max(int(slot["active"]), int(slot["v_active"]))
        string.play(none)
        before = string.energy()
        assert before <= (1 + ROUNDING) * minimum
        fingers = string.record["touches"]
        settled = np.all(fingers["resistance"] == fingers["wanted"])
        if alive < slot["touch_modes"].min() and settled and string.record["left"] == 0 and slot["fourth"] == 0:
            fewer += 1
            squares = (slot["touch_shape"][:, 0, :alive] ** 2).sum(axis=1)
            assert np.allclose(slot["touch_square"][:, 0], squares, rtol=1e-9)
    # one in four frames, and late: on an ended note a dashpot moves modes to 2 kHz alone, which die last (64 on slap)
    assert fewer > 50 and before == 0.0 < minimum < 1e-11 * began


def held_energy(s: Speaking, apex: float, x: float) -> float:
    """Energy (J) of the triangle of a string held `apex` m off its line of rest at `x` (m from the stop)."""
    force = s.string.linear_density * (2 * s.length * s.fundamental) ** 2  # N, its tension
    return force / 2 * apex**2 * s.length / (x * (s.length - x))


def plucked_energy(s: Speaking, pluck: Pluck, count: int) -> float:
    """Energy (J) of a pluck in the lowest modes of a string."""
    speed = 2 * np.pi * frequencies(s, count) * pluck_amplitudes(s, count, pluck)
    return 0.5 * s.string.linear_density * float(speed @ speed)


@pytest.mark.parametrize(("high", "low"), [(2, 0), (4, 2), (5, 2), (7, 0), (12, 5), (10, 3)])
@pytest.mark.parametrize(
    ("preset", "i"),
    [("jazz-finger", 0), slow("jazz-finger", 1), slow("jazz-finger", 2), ("slap", 3)],
)
def test_a_pull_off_adds_what_the_finger_held_and_its_pluck(preset: str, i: int, high: int, low: int) -> None:
    """Energy after = short string's before + triangle's held on the fret + finger's pluck.

    To 3 %, also on E, where the corner of the triangle bends most. The finger of a pull-off pulls the string only
    across the neck, while the fret held it upright: these add as energies, not as displacements. No fret is hit.
    """
    bass, none = load_preset(preset), np.zeros(0, EVENT)
    s = speaking(bass.strings[i], bass.necks[i], low)
    for deflection, moment in ((0.5e-3, 4800), (2e-3, 5077)):
        string = Played(preset, i)
        length, count = float(string.ops[high]["length"]), int(string.ops[low]["modes"])
        string.play(event(PLUCK, high, apex=1.5e-3, place=length - 0.17, width=5e-3, seconds=1e-4, angle=0.7))
        while string.frame < moment:
            string.play(none)
        before, x = string.energy(), s.length - length
        crown = s.contact_height[int(np.argmin(np.abs(np.array(s.contact_position) - x)))]
        finger = Pluck(deflection, x, fretting.PULLING_FINGER)
        wanted = before + held_energy(s, crown, x) + plucked_energy(s, finger, count)
        string.play(event(PULL_OFF, low, apex=deflection))
        assert string.voice.note() == (low, 0)
        assert string.energy() == pytest.approx(wanted, rel=0.03), (string.energy() / wanted - 1, deflection)


def max_of_leap(w: np.void, op: np.void, leap: int) -> float:
    """The greatest factor of a leap on a float32 mode, by the energy's own norm: P over b^0.5 beside q."""
    modes, split = int(op["modes"]), int(op["split"])
    a, b, g = (w["high"]["leaps"][leap][name][: modes - split].astype(float) for name in "abg")
    turn = (w["kappa"] * w["omega"])[split:modes]
    moves = a != 0.0
    assert moves.any()
    leaps = np.stack([a, b * turn, -g / turn, a], axis=1)[moves].reshape(-1, 2, 2)
    return float(np.linalg.norm(leaps, 2, axis=(1, 2)).max())


def of_float32(w: np.void, op: np.void) -> np.ndarray:
    """The energy of each float32 mode, in its own units."""
    modes, split = int(op["modes"]), int(op["split"])
    q, p = (w["high"][name][: modes - split].astype(float) for name in "qp")
    return p**2 + ((w["kappa"] * w["omega"])[split:modes] * q) ** 2


@pytest.mark.parametrize(
    ("preset", "quality"),
    [slow("jazz-finger", "live"), ("jazz-finger", "studio"), ("fretless", "live"), slow("fretless", "studio")],
)
def test_no_mode_of_float32_grows_where_nothing_is_lost(preset: str, quality: str) -> None:
    """No leap of any length, and no rounding in one, makes a mode grow; so none grows in half a minute."""
    seconds = 30
    string = Played(preset + RINGS_ON, 1, quality)
    string.record["stretch"] = 0.0  # tension, a symplectic step, lets the energy waver
    op = string.ops[0]
    place = 0.3 * float(op["length"])
    string.play(event(PLUCK, 0, apex=3e-4, place=place, width=2e-3, seconds=1e-4, angle=0.5))
    none = np.zeros(0, EVENT)
    while string.hands()[0]:
        string.play(none)
    slot = string.voice.slots[int(string.record["slot"])]
    w, modes = slot["u"], int(op["modes"])
    assert 0 < int(op["split"]) < modes and float(w["sigma"][:modes].max()) < 1e-6
    for leap, name in itertools.product(range(int(op["leaps"])), "uv"):
        assert max_of_leap(slot[name], op, leap) < 1.0 - LEAP_ROUNDING, (leap, name)
    began, before = string.energy(), of_float32(w, op)
    for _ in range(seconds * 100):
        play_frames(string.voice, string.ops, none, np.zeros(RATE // 100))
        now = of_float32(w, op)
        assert np.all(now <= before)
        before = now
    assert 0.9 < string.energy() / began < 1.0 + ROUNDING * seconds
    string.play(event(BEND, value=1.03))
    play_frames(string.voice, string.ops, none, np.zeros(RATE))
    assert string.hands()[1] == 1.03
    for leap, name in itertools.product(range(int(op["leaps"])), "uv"):
        assert max_of_leap(slot[name], op, leap) < 1.0 - LEAP_ROUNDING, (leap, name)
