"""A moving stop on the brute-force string: against springs, against the modes of the shorter length, against frets."""

from __future__ import annotations

import dataclasses
import math
from itertools import pairwise

import numpy as np
import pytest
from support import strings
from support.costs import slow
from support.modal import Modal, bare_string, from_rest, hammer_string, handover, modal, shorten, third_octaves

from livebass.lab.reference.hands import Finger, Path, Stop, follow, hammer, hold_still, landing
from livebass.lab.reference.playing import Played, play
from livebass.lab.reference.solver import solve
from livebass.model.instrument import Pluck
from livebass.model.trial import Trial, initial_amplitudes
from livebass.rows.arrays import Floats

RATE = 96000.0
HEARD = 0.15  # m from the saddle
LIGHT = 1e-9  # inharmonicity of a string that does not bend past its stop


@pytest.mark.parametrize("path", [hammer(-1e-3, 0.5), landing(-1e-3, 2e-3)], ids=["hammer", "landing"])
@pytest.mark.parametrize("begin, velocity", [(0.0, 0.0), (2e-3, 1.0), (2e-3, -3.0), (-3e-3, -0.2)])
def test_a_path_begins_as_the_string_moves_and_ends_at_rest(path: Path, begin: float, velocity: float) -> None:
    time = np.arange(200_000) * 1e-7
    b = path(time, begin, velocity)
    assert b[0] == pytest.approx(begin, abs=1e-12)
    assert (b[1] - b[0]) / 1e-7 == pytest.approx(velocity, abs=2e-3)
    assert b[-1] == -1e-3 and np.abs(np.diff(b)).max() <= 1e-7 * max(3.0, 2 * abs(velocity))
    in_parts = np.concatenate([path(part, begin, velocity) for part in np.split(time, 20)])
    np.testing.assert_array_equal(in_parts, b)


def test_a_hammer_comes_at_its_speed_and_stops_dead() -> None:
    """From rest its mean speed is half its final one; a slow one is made faster."""
    b = hammer(-1e-3, 0.5)(np.arange(90_000) * 1e-7, 1e-3, 0.0)
    speeds = np.diff(b) / 1e-7
    np.testing.assert_allclose(speeds[[40_000, 79_998]], [-0.25, -0.5], rtol=1e-4)
    assert (speeds[80_000:] == 0.0).all()
    assert hammer(-1e-3, 1e-3)(np.array([31e-3, 32e-3]), 1e-3, 0.0) == pytest.approx([-0.877e-3, -1e-3], abs=1e-6)
    np.testing.assert_array_equal(
        follow(np.array([0.0, 1.0]), np.array([0.0, 2.0]))(np.array([0.5, 3.0]), 9, 9), [1, 2]
    )


def with_spring(s: Modal, stop: Stop) -> Floats:
    row = s.shape(stop.place, stop.width)
    return s.matrix(np.zeros((s.k.size, s.k.size)), stop.stiffness * np.outer(row, row))


@pytest.mark.usefixtures("discrete")
@pytest.mark.parametrize("stiffness", [1e3, 1e5])
def test_a_spring_is_solved_to_second_order(stiffness: float) -> None:
    """A stop that holds the string in place, against the eigenvalues of the string with that spring."""
    stop = Stop(0.11, hold_still(0.0), stiffness=stiffness)

    def trial(rate: float) -> Trial:
        return strings.tiny(contact_rate=rate, output_rate=1e4, duration=0.01, lossless=True)

    s = modal(trial(1e5).speaking, 23, lossless=True)
    matrix, times = with_spring(s, stop), np.arange(trial(1e5).samples) / 1e4
    errors = []
    for rate in (4e5, 8e5, 16e5):
        moved = play(trial(rate), [stop], frets=False).displacement_m[0]
        exact = from_rest(s, matrix, initial_amplitudes(trial(rate)), 1 / rate, times)[0] @ s.shape(0.28)
        errors.append(np.abs(moved - exact).max() / np.abs(exact).max())
    assert errors[-1] < 3e-3, errors
    for coarse, fine in pairwise(errors):
        assert 3.4 < coarse / fine < 4.6, errors


@pytest.mark.usefixtures("discrete")
def test_one_sided_stop_under_the_string_is_a_fret() -> None:
    """A fret of K dx N/m and exponent 1, whatever the others' places."""
    trial = strings.tiny(exponent=1.0, stiffness=1e9, duration=0.02)
    s = trial.speaking
    place, height = s.contact_position[1], s.contact_height[1]
    fewer = dataclasses.replace(
        s, contact_fret=s.contact_fret[::2], contact_position=s.contact_position[::2],
        contact_height=s.contact_height[::2],
    )  # fmt: skip
    fret = solve(trial)
    stop = Stop(place, hold_still(height), stiffness=1e9 * s.step, side=-1)
    played = play(dataclasses.replace(trial, speaking=fewer), [stop])
    maximum = np.abs(fret.displacement_m).max()
    np.testing.assert_allclose(played.displacement_m[0], fret.displacement_m, rtol=0, atol=1e-10 * maximum)
    assert played.hand_force_n.max() > 1 and played.hand_force_n.min() >= 0
    pressing = play(trial, [Stop(place, hold_still(0.3e-3), side=1, stiffness=1e6)])
    assert pressing.hand_force_n.min() < -1 and pressing.hand_force_n.max() <= 0


@dataclasses.dataclass(frozen=True)
class Stroke:
    """A string's modes before its left hand moves; brute force with `modes` of them at `rate`."""

    inharmonicity: float = LIGHT
    fret: int = 5
    modes: int = 400
    rate: float = 2.4e6
    seconds: float = 0.1
    apex: float = 3e-3
    quiet: float = 0.3  # s since the pluck

    @property
    def trial(self) -> Trial:
        s = bare_string(self.inharmonicity)
        pluck = Pluck(self.apex, 0.8 * s.length)
        return Trial(s, pluck, self.modes, self.rate, RATE, self.seconds, s.length - HEARD)

    @property
    def place(self) -> float:
        return bare_string().length * (1 - 2 ** (-self.fret / 12))

    @property
    def fingers(self) -> list[Finger]:
        """The flesh behind the stop, which silences the motion there."""
        behind = ((0.31 * self.place, 4e-3), (0.74 * self.place, 4e-3), (self.place - 8e-3, 1.5e-3))
        return [Finger(place, 2.0, width, landing=0.0) for place, width in behind]

    def lengths(self, count: int) -> tuple[Modal, Modal]:
        """The string in `count` modes, and its rest beyond the stop."""
        long = modal(self.trial.speaking, count)
        return long, shorten(long, self.place, round(count * (1 - self.place / long.length)))


def polygon(path: Path) -> Path:
    """`path`, straight between samples."""

    def straight(time: Floats, begin: float, velocity: float) -> Floats:
        grid = np.arange(1000) / RATE
        return np.interp(time, grid, path(grid, begin, velocity))

    return straight


def hammer_on(stroke: Stroke, path: Path, stiffness: float = 1e8) -> tuple[Played, Floats, Floats]:
    """A hammer-on by brute force, and its u and du/dt by the modes of the shorter length, both at `HEARD`."""
    trial, path = stroke.trial, polygon(path)
    long, short = stroke.lengths(stroke.modes)
    q, v = long.after(initial_amplitudes(trial), np.zeros(stroke.modes), stroke.quiet)
    stop = Stop(stroke.place, path, stiffness=stiffness)
    played = play(trial, [stop, *stroke.fingers], frets=False, begin=np.array([[q, v]]))
    return played, *hammer_string(long, short, q, v, path, trial.sensor, trial.samples, RATE)


def assert_alike(played: Played, velocity: Floats, mean: float, worst: float, within: float, depth: float = 50) -> None:
    """Third octaves of the first 100 ms agree within `depth` dB of the loudest; so does the wave of 20 ms."""
    brute, long, short = played.velocity_m_s[0], round(0.1 * RATE), round(0.02 * RATE)
    levels, expected = third_octaves(brute[:long], RATE), third_octaves(velocity[:long], RATE)
    heard = levels > levels.max() - depth
    apart = np.abs(levels - expected)[heard]
    wave = np.linalg.norm(brute[:short] - velocity[:short]) / np.linalg.norm(velocity[:short])
    print(f"mean {apart.mean():.2f} dB, worst {apart.max():.2f} dB of {heard.sum()} bands, wave {wave:.4f}")
    assert apart.mean() < mean and apart.max() < worst, (apart.mean(), apart.max())
    assert wave < within, wave
    assert played.balance.error < 1e-11, played.balance.error


PATHS = {"landing": landing(-0.9e-3, 2e-3), "hammer": hammer(-0.9e-3, 1.2)}


@pytest.mark.parametrize("path, fret", [("landing", 12), ("hammer", 2), slow("landing", 2), slow("hammer", 5)])
def test_hammer_on_in_motion(fret: int, path: str) -> None:
    """A string that does not bend past its stop moves as in the modes of the shorter length."""
    played, _, velocity = hammer_on(Stroke(fret=fret), PATHS[path])
    assert_alike(played, velocity, 0.2, 1.0, 0.04)


def test_hammer_on_at_rest() -> None:
    """A tap: all sound comes from the hand."""
    played, u, velocity = hammer_on(Stroke(apex=0.0), PATHS["hammer"])
    assert_alike(played, velocity, 0.2, 1.0, 0.04)
    assert np.abs(played.displacement_m[0] - u).max() < 0.02 * np.abs(u).max()
    balance = played.balance
    assert 1e-4 < balance.put_in_j[0, -1] < 1e-2
    assert balance.stored_j[-1] == pytest.approx(
        balance.put_in_j[0, -1] - balance.damping_j[-1] - balance.taken_j[1:, -1].sum(), rel=1e-9
    )


@pytest.mark.slow
@pytest.mark.parametrize("fret", [2, 5])
@pytest.mark.parametrize("path", PATHS)
def test_hammer_on_of_a_stiff_string(fret: int, path: str) -> None:
    """800 modes at 4.8 MHz; a little of a real string's bending passes its stop."""
    played, _, velocity = hammer_on(Stroke(3.5e-5, fret, 800, 4.8e6), PATHS[path])
    assert_alike(played, velocity, 1.0, 1.5, 0.15, 35)


def test_hammer_on_of_a_stiff_string_in_fewer_modes() -> None:
    played, _, velocity = hammer_on(Stroke(3.5e-5, 5), PATHS["landing"])
    assert_alike(played, velocity, 1.0, 1.5, 0.15, 35)


def test_stiffness_modes_and_rate_converge() -> None:
    """10^8 N/m, 400 modes and 2.4 MHz are enough: a stiffer spring, more modes, shorter steps change less than 1 %."""
    stroke, path = Stroke(3.5e-5, seconds=0.01), PATHS["landing"]

    def brute(stroke: Stroke, stiffness: float) -> Floats:
        return hammer_on(stroke, path, stiffness)[0].velocity_m_s[0]

    chosen = brute(stroke, 1e8)
    softer = [np.linalg.norm(brute(stroke, k) - chosen) for k in (1e6, 1e7)]
    assert softer[0] > 5 * softer[1]
    for finer in (brute(stroke, 1e9), brute(dataclasses.replace(stroke, modes=600, rate=4.8e6), 1e8)):
        assert np.linalg.norm(finer - chosen) < 0.01 * np.linalg.norm(chosen)


def pull_off(stroke: Stroke, height: float, hold: float = 5e-3) -> tuple[Played, Floats]:
    """A stop holds the string at `height` for `hold` s and releases it; and du/dt by handing over the motion."""
    trial, samples = stroke.trial, round(hold * RATE)
    long, short = stroke.lengths(stroke.modes)
    s = trial.speaking
    over = handover(long, short)
    # the shape of a string held at `height`, and the motion beyond
    slope = height * s.length / (stroke.place * (s.length - stroke.place))
    straight = math.sqrt(2 / s.length) * slope * np.sin(long.k * stroke.place) / long.k**2
    straight *= (long.natural[0] / long.k[0] * long.k / long.natural) ** 2
    q = short.shape(0.6 * short.length) / short.k**2 * 5e-3 * np.exp(-((short.k * 5e-3) ** 2) / 2)
    played = play(
        trial, [Stop(stroke.place, hold_still(height), end=hold)], frets=False,
        begin=np.array([[over.T @ q + straight, np.zeros(stroke.modes)]]),
    )  # fmt: skip
    x, pace = short.after(q, np.zeros(q.size), hold)
    x, pace = over.T @ x + straight, over.T @ pace
    heard, velocity = long.shape(trial.sensor), np.zeros(trial.samples - samples)
    for i in range(velocity.size):
        velocity[i] = heard @ pace
        x, pace = long.after(x, pace, 1 / RATE)
    parts = "displacement_m", "velocity_m_s", "hand_force_n", "hand_height_m"
    late = {name: getattr(played, name)[:, samples:] for name in parts}
    return dataclasses.replace(played, **late), velocity


@pytest.mark.parametrize("fret, height", [(5, -0.9e-3), (12, -2e-3), (2, 0.0)])
def test_pull_off(fret: int, height: float) -> None:
    played, velocity = pull_off(Stroke(fret=fret, seconds=0.105), height)
    assert_alike(played, velocity, 0.1, 0.5, 0.01)
    assert not played.hand_force_n[0, 1:].any() and np.isnan(played.hand_height_m[0, 1:]).all()


@pytest.mark.slow
@pytest.mark.parametrize("fret, height", [(5, -0.9e-3), (2, 0.0)])
def test_pull_off_of_a_stiff_string(fret: int, height: float) -> None:
    played, velocity = pull_off(Stroke(3.5e-5, fret, 800, 4.8e6, 0.105), height)
    assert_alike(played, velocity, 1.0, 3.0, 0.15, 35)


def test_the_force_on_a_stop_at_rest_is_the_tension_over_the_bend() -> None:
    """T h L / (x (L - x)), though the string has only 40 modes."""
    s = bare_string(LIGHT)
    trial = Trial(s, Pluck(0.0, s.length / 2), 40, 1e5, 1000.0, 0.2, s.length / 2)
    place, height = 0.3 * s.length, -1e-3
    quiet = [Finger(x * s.length, 1.2, landing=0.0) for x in (0.13, 0.21, 0.52, 0.67)]
    played = play(trial, [Stop(place, landing(height, 0.02)), *quiet], frets=False)
    force = s.string.linear_density * (2 * s.length * s.fundamental) ** 2 * height / (place * (1 - 0.3))
    assert played.hand_force_n[0, -1] == pytest.approx(force, rel=1e-4)
    assert played.balance.put_in_j[0, -1] > 0.99 * force * height / 2


@pytest.mark.usefixtures("discrete")
def test_a_stop_holds_the_second_polarisation_where_it_is_told() -> None:
    trial = strings.oblique(strings.tiny(contact_rate=8e5, output_rate=8e4), 1.0, 2e-3)
    free = play(trial, [Stop(0.1, landing(-0.2e-3, 1e-3))], listen=[0.1], frets=False)
    both = play(trial, [Stop(0.1, landing(-0.2e-3, 1e-3), across=landing(0.0, 1e-3))], listen=[0.1], frets=False)
    assert free.across_m is not None and both.across_m is not None
    late = free.time_s > 1.1e-3
    assert np.abs(free.across_m[0, late]).max() > 1e-3 > 1e-6 > np.abs(both.across_m[0, late]).max()
    np.testing.assert_allclose(both.displacement_m[0, late], -0.2e-3, rtol=0, atol=1e-6)
    np.testing.assert_array_equal(both.displacement_m, free.displacement_m)
