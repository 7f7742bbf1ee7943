"""Hands on the brute-force string: their common properties, and their energy."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest
from support import strings
from support.costs import quick
from support.strings import oblique

from livebass.lab.reference.hands import Finger, Hand, Mass, Stop, hammer, hold_still, landing, lift
from livebass.lab.reference.playing import Played, play
from livebass.lab.reference.solver import solve
from livebass.model import modes
from livebass.model.trial import Trial, initial_amplitudes_across

CLOSED = 1e-11  # of the energy turned over; measured at most 8e-13

FINGERS = (
    Finger(0.1, 2.0, start=4e-3, end=15e-3, landing=1e-3, lifting=3e-3),
    Finger(0.03, 8.0, width=0.0, landing=0.0, end=8e-3, lifting=0.0),
)
STOPS = (
    Stop(0.08, landing(-0.4e-3, 2e-3), start=4e-3, end=20e-3, across=landing(0.0, 1e-3)),
    Stop(0.04, hammer(-0.3e-3, 1.0), start=6e-3, side=1),
    Stop(0.12, hold_still(-0.6e-3), end=9e-3, side=-1, stiffness=1e6),
)
MASSES = (
    Mass(0.2, 2.0, start=3e-3, force=lift(1.5, 3e-3), end=24e-3),
    Mass(0.26, 1.0, height=4e-3, loss=0.0, mass=5e-3, exponent=2.3, stiffness=1e8),
)
SETS: dict[str, tuple[Hand, ...]] = {
    "fingers": FINGERS, "stops": STOPS, "masses": MASSES, "all": (*MASSES, *STOPS, *FINGERS),
}  # fmt: skip


def rough(modes: int = 23, rate: float = 2e5) -> Trial:
    """A coarse string plucked obliquely over three frets, one sample per fine step."""
    return oblique(strings.tiny(modes=modes, contact_rate=rate, duration=0.03), 0.6, 3e-3)


def yielding(trial: Trial, stiffness: float, loss: float) -> Trial:
    """`trial` over frets of the given K that lose `loss` s/m, with an own law for v."""
    made = strings.losing(trial, stiffness, loss)
    return dataclasses.replace(made, speaking=strings.with_own_across(made.speaking))


@pytest.mark.parametrize("angle", [0.0, 0.6])
@pytest.mark.parametrize("modes", [23, 12])
def test_hands_that_do_not_come_change_nothing(angle: float, modes: int) -> None:
    trial = oblique(strings.tiny(modes=modes), angle, 3e-3)
    late = [dataclasses.replace(hand, start=1.0, end=2.0) for hand in SETS["all"]]
    with_none, played = solve(trial), play(trial, late)
    np.testing.assert_array_equal(played.displacement_m[0], with_none.displacement_m)
    np.testing.assert_array_equal(played.contact_step, with_none.contact_step)
    np.testing.assert_array_equal(played.contact_index, with_none.contact_index)
    assert with_none.contact_step.size and not played.hand_force_n.any() and not played.balance.taken_j.any()
    if angle:
        assert played.across_m is not None and with_none.across_m is not None
        # sums over points coupled by friction have more terms
        np.testing.assert_allclose(played.across_m[0], with_none.across_m, rtol=0, atol=1e-15)


@pytest.mark.parametrize("frets", [True, False])
@pytest.mark.parametrize("modes", [23, 12])
@pytest.mark.parametrize("name", SETS)
def test_the_balance_closes(name: str, modes: int, frets: bool) -> None:
    played = play(rough(modes), SETS[name], frets=frets)
    balance = played.balance
    assert bool(played.contact_step.size) == frets
    assert balance.error < CLOSED, f"{balance.error:.1e} of the energy is missing, allowed {CLOSED:.0e}"
    turned = balance.stored_j.max() + balance.taken_j.sum(0)[-1]
    for taken in (*balance.taken_j, balance.damping_j, balance.friction_j):
        assert np.diff(taken).min() > -1e-15 * turned, "nothing but hands may give energy"
    for hand, taken, given in zip(SETS[name], balance.taken_j, balance.put_in_j, strict=True):
        lossy = isinstance(hand, Finger) or (isinstance(hand, Mass) and hand.loss > 0)
        assert (taken[-1] > 1e-6) == lossy
        assert not (isinstance(hand, Finger) and given.any())


LOSSY = ((23, 1e13, 1.0), (12, 1e10, 3.0), (23, 1e8, 100.0), (12, 1e8, 1e5))  # modes, stiffness, loss of frets


@pytest.mark.parametrize(
    ("name", "modes", "stiffness", "loss"),
    quick(
        [(name, *frets) for name in SETS for frets in LOSSY],
        always=[(name, *LOSSY[(k + other) % 4]) for k, name in enumerate(SETS) for other in (0, 2)],
    ),
)
def test_the_balance_closes_over_frets_that_lose(name: str, modes: int, stiffness: float, loss: float) -> None:
    played = play(yielding(rough(modes), stiffness, loss), SETS[name])
    balance = played.balance
    assert played.contact_step.size > 3
    assert balance.error < CLOSED, f"{balance.error:.1e} of the energy is missing, allowed {CLOSED:.0e}"
    turned = balance.stored_j.max() + balance.taken_j.sum(0)[-1]
    for taken in (*balance.taken_j, balance.damping_j, balance.friction_j, balance.contact_j):
        assert np.diff(taken).min() > -1e-15 * turned, "nothing but hands may give energy"
    assert balance.contact_j[-1] > 1e-3 * balance.stored_j[0]


def test_without_hands_frets_that_lose_are_those_of_the_solver() -> None:
    trial = yielding(rough(12), 1e10, 3.0)
    with_none, played = solve(trial), play(trial)
    np.testing.assert_array_equal(played.displacement_m[0], with_none.displacement_m)
    np.testing.assert_array_equal(played.contact_step, with_none.contact_step)
    assert played.across_m is not None and with_none.across_m is not None
    np.testing.assert_allclose(played.across_m[0], with_none.across_m, rtol=0, atol=1e-15)


@pytest.mark.parametrize("name", SETS)
def test_the_balance_closes_over_the_paper_s_frets(name: str) -> None:
    def moved(hand: Hand) -> Hand:
        return dataclasses.replace(hand, place=hand.place * 2.5)

    trial = oblique(strings.case_b(300, 768e3, 0.03, 48000.0), 0.5, 3.6e-3)
    played = play(trial, [moved(hand) for hand in SETS[name]])
    assert played.contact_step.size > 30 and played.balance.friction_j[-1] > 1e-5
    assert played.balance.error < CLOSED


def random_hands(seed: int, length: float, duration: float) -> list[Hand]:
    """One to five seeded random hands of any kind and place; some may overlap."""
    rng = np.random.default_rng(seed)

    def one() -> Hand:
        place, start = length * rng.uniform(0.02, 0.98), duration * rng.choice([0.0, rng.uniform(0, 0.8)])
        end = start + duration * rng.uniform(0.05, 1)
        width = float(rng.choice([0.0, rng.uniform(0, 0.02)]))
        when = {"place": place, "start": start, "end": end, "width": width}
        match rng.integers(3):
            case 0:
                landing_, lifting = rng.uniform(0, 0.01, 2)
                return Finger(resistance=10 ** rng.uniform(-2, 3), landing=landing_, lifting=lifting, **when)
            case 1:
                height, speed, side = rng.uniform(-2e-3, 0), rng.uniform(0.1, 3), int(rng.integers(-1, 2))
                across = landing(rng.uniform(-1e-3, 1e-3), 2e-3) if rng.random() < 0.5 else None
                stiffness = 10 ** rng.uniform(4, 9)
                return Stop(path=hammer(height, speed), side=side, across=across, stiffness=stiffness, **when)
            case _:
                loss, power = rng.uniform(0, 2), float(rng.choice([1.0, 1.5, 2.5]))
                stiffness, mass = 10 ** rng.uniform(3, 6) * 300 ** (2 * power - 3), 10 ** rng.uniform(-3, -1)
                return Mass(speed=rng.uniform(0, 4), mass=mass, stiffness=stiffness, exponent=power, loss=loss, **when)

    return [one() for _ in range(rng.integers(1, 6))]


@pytest.mark.parametrize("seed", range(12))
def test_the_balance_closes_with_random_hands(seed: int) -> None:
    rng = np.random.default_rng(100 + seed)
    modes, rate = int(rng.integers(8, 24)), 10 ** rng.uniform(4.8, 6)
    trial = oblique(strings.tiny(modes=modes, contact_rate=rate, duration=0.02), rng.uniform(0, 1.5), 3e-3)
    if seed % 2:
        trial = yielding(trial, 10 ** rng.uniform(8, 13), 10 ** rng.uniform(-2, 3))
    hands = random_hands(seed, trial.speaking.length, trial.duration)
    balance = play(trial, hands, frets=bool(rng.random() < 0.7)).balance
    assert balance.error < CLOSED, f"{hands}: {balance.error:.1e}"
    assert np.diff(balance.taken_j).min(initial=0.0) > -1e-14 * balance.stored_j.max()
    assert np.isfinite(balance.stored_j).all()


def test_the_second_polarisation_moves_as_the_first_without_frets() -> None:
    """Fingers and stops act equally on both, and friction needs frets."""
    hands = [*FINGERS, dataclasses.replace(STOPS[0], path=landing(0.0, 1e-3))]
    played = play(rough(), hands, frets=False)
    assert played.across_m is not None and played.across_velocity_m_s is not None
    for u, v in ((played.displacement_m, played.across_m), (played.velocity_m_s, played.across_velocity_m_s)):
        np.testing.assert_allclose(v, math.tan(0.6) * u, rtol=0, atol=1e-11 * np.abs(u).max())


@pytest.mark.usefixtures("discrete")
def test_friction_that_never_slides_is_a_finger_on_a_fret() -> None:
    """With frets in permanent contact, eq. 7 below its speed s is a dashpot of A dx / s, whatever else is held."""
    trial = strings.tiny(stiffness=1e5, duration=0.01, lossless=True)
    maximum, speed = 500.0, 10.0
    s = dataclasses.replace(trial.speaking, contact_height=(1e-6,) * 3, friction=maximum, friction_speed=speed)
    trial = oblique(dataclasses.replace(trial, speaking=s), math.pi / 2, 3e-3)
    hands: list[Hand] = [FINGERS[0], dataclasses.replace(STOPS[0], path=hold_still(0.0), side=1)]
    fingers = [Finger(x, maximum * s.step / speed, width=0.0, landing=0.0) for x in s.contact_position]
    rubbed, held_down = play(trial, hands), play(trial, [*hands, *fingers], frets=False)
    assert rubbed.across_m is not None and held_down.across_m is not None
    np.testing.assert_allclose(rubbed.across_m, held_down.across_m, rtol=0, atol=1e-12)
    free = play(trial, hands, frets=False).across_m
    assert free is not None and np.abs(free - rubbed.across_m).max() > 1e-4
    assert rubbed.balance.friction_j[-1] == pytest.approx(held_down.balance.taken_j[2:, -1].sum(), rel=1e-9)


def test_without_hands_the_motion_is_that_of_the_solver() -> None:
    trial = oblique(strings.case_b(100, 768e3, 0.02, 48000.0), 0.7, 4e-3)
    motion = solve(trial)
    played = play(dataclasses.replace(trial, states=(0, 200)), listen=[trial.sensor, 0.3])
    np.testing.assert_array_equal(played.displacement_m[0], motion.displacement_m)
    assert played.across_m is not None and motion.across_m is not None
    np.testing.assert_array_equal(played.across_m[0], motion.across_m)
    assert played.displacement_m.shape == (2, trial.samples) and played.states is not None
    assert played.states.shape == (2, 2, 2, 100)


@pytest.mark.parametrize("sensor", [0.28, 0.1])
def test_velocity_is_what_displacement_does(sensor: float) -> None:
    played = play(strings.tiny(contact_rate=4e5, duration=5e-3), SETS["all"], listen=[sensor])
    u, velocity = played.displacement_m[0], played.velocity_m_s[0]
    middle = (u[2:] - u[:-2]) / 2 * 4e5
    assert np.abs(velocity[1:-1] - middle).max() < 0.01 * np.abs(velocity).max()


@pytest.mark.parametrize("angle", [0.0, 0.6])
def test_a_string_goes_on_from_its_state(angle: float) -> None:
    """A contact-free state fully describes a string."""
    trial = oblique(strings.tiny(contact_rate=4e5, output_rate=4e4, duration=0.02), angle, 0.3e-3)
    hands = (Finger(0.1, 1.0, landing=0.0, end=5e-3, lifting=0.0), Finger(0.2, 1.0, start=12e-3, lifting=0.0))
    whole = play(dataclasses.replace(trial, states=(400,)), hands)
    assert whole.states is not None
    later = dataclasses.replace(hands[1], start=2e-3)
    rest = play(dataclasses.replace(trial, duration=0.01), [later], begin=whole.states[0])
    maximum = np.abs(whole.displacement_m).max()
    np.testing.assert_allclose(rest.displacement_m, whole.displacement_m[:, 400:], rtol=0, atol=1e-10 * maximum)
    if angle:
        assert rest.across_m is not None and whole.across_m is not None
        np.testing.assert_allclose(rest.across_m, whole.across_m[:, 400:], rtol=0, atol=1e-10 * maximum)


def test_same_hands_same_bits() -> None:
    def once() -> Played:
        return play(rough(), SETS["all"])

    first, second = once(), once()
    np.testing.assert_array_equal(first.displacement_m, second.displacement_m)
    np.testing.assert_array_equal(first.balance.stored_j, second.balance.stored_j)


@pytest.mark.parametrize(
    "make, named",
    [
        (lambda: Finger(0.1, -1.0), "resistance"),
        (lambda: Finger(0.1, 1.0, start=2.0, end=1.0), "end"),
        (lambda: Finger(0.1, 1.0, width=math.nan), "width"),
        (lambda: Stop(0.1, hold_still(0.0), side=2), "side"),
        (lambda: Stop(0.1, hold_still(0.0), stiffness=-1.0), "stiffness"),
        (lambda: Mass(0.1, 1.0, mass=0.0), "Mass"),
        (lambda: Mass(0.1, 1.0, exponent=0.5), "exponent"),
        (lambda: play(rough(), [Finger(0.4, 1.0)]), "place of a Finger must be between 0 and 300 mm, not 400 mm"),
        (lambda: play(rough(), [Mass(0.2, 1.0, height=-1e-3)]), "height of a Mass"),
        (lambda: play(rough(), listen=[-0.1]), "place to listen must be from 0 to 300 mm, not -100 mm"),
        (lambda: play(rough(), begin=np.zeros((1, 2, 23))), "begin"),
        (lambda: play(strings.tiny(output_rate=44100.0)), "contact rate"),
    ],
)
def test_what_is_not_allowed_is_named(make: object, named: str) -> None:
    with pytest.raises(ValueError, match=named):
        make()  # type: ignore[operator]


def test_the_velocity_of_v_is_that_of_its_own_modes() -> None:
    trial = yielding(rough(12), 1e10, 3.0)
    s, played = trial.speaking, play(trial, frets=False)
    nu, sigma = modes.frequencies(s, 12, across=True), modes.dampings(s, 12, across=True)
    omega = np.sqrt((2 * math.pi * nu) ** 2 - sigma**2)
    q = initial_amplitudes_across(trial) * modes.shapes(s, 12, np.array([trial.sensor]))[0]
    t = played.time_s[:, None]
    exact = (-np.exp(-sigma * t) * (omega + sigma**2 / omega) * np.sin(omega * t)) @ q
    assert played.across_velocity_m_s is not None
    assert np.abs(played.across_velocity_m_s[0] - exact).max() < 1e-9 * np.abs(exact).max()
