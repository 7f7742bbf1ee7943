"""Runs by their law: how modes move in a quartet and in a long run, what pickups sense, what fingers take after."""

from __future__ import annotations

import ctypes
from dataclasses import dataclass

import numpy as np
import pytest
from support.own_basses import AS_SHIPPED, FRETTED
from support.played import RATE, Played, event

from livebass.engine.prepare import modal_row
from livebass.kernels.string.records import BEND, BLOCK, EVENT, GAIN, HAND, LONG_RUN, LOW, PLUCK, QUARTET, ROW, THERE
from livebass.kernels.string.slot import REST_EVERY
from livebass.rows.arrays import Complexes, Floats

NOTHING = np.zeros(0, EVENT)
STRETCHED = 10.0  # times as much tension by the motion as on the bass, so that it is far above rounding


def sounding(preset: str, i: int = 0, rings: float = 0.02, apex: float = 0.4e-3) -> Played:
    """String `i`, moving in both directions and clear of its frets; it begins a quartet with its next frame."""
    string = Played(preset, i)
    string.play(event(PLUCK, apex=apex, place=0.8 * float(string.ops[0]["length"]), angle=0.4))
    string.let_ring(rings)
    to_left(string, 0)
    return string


def play_frame(string: Played) -> None:
    """Plays the next frame; it begins no long run."""
    string.slot()["gentle"] = 0
    string.play(NOTHING)


def to_left(string: Played, left: int) -> None:
    """Plays on until so many frames of a quartet are left; 0: it has ended."""
    for _ in range(200):
        play_frame(string)
        if string.record["left"] == left and (left > 0 or string.slot()["fourth"] == 0):
            return
    raise AssertionError("there is no quartet")


@dataclass
class Motion:
    """The modes of u and v, (2, modes): amplitudes A = q - i (q' + sigma q) / omega, with their laws."""

    amplitude: Complexes
    omega: Floats
    sigma: Floats

    def after(self, frames: int) -> Complexes:
        """The amplitudes after so many frames without any force."""
        return np.asarray(self.amplitude * np.exp((1j * self.omega - self.sigma) * frames / RATE))

    def velocity(self, amplitude: Complexes) -> Floats:
        return np.asarray(((1j * self.omega - self.sigma) * amplitude).real)


def motion_of(string: Played, suffix: str = "") -> Motion:
    """The motion of a string now, or with the suffix _before at the begin of its quartet."""
    slot, n = string.slot(), int(string.ops[0]["modes"])
    found = []
    for name, active in (("u", slot["active"]), ("v", slot["v_active"])):
        w = slot[name]
        q, p = (modal_row(w, row + suffix)[:n] for row in "qp")
        omega, sigma, kappa = (w[row][:n].copy() for row in ("omega", "sigma", "kappa"))
        amplitude = q - 1j * p / (kappa * omega)
        amplitude[int(active) :] = 0.0
        found.append((amplitude, omega, sigma))
    return Motion(*(np.stack(rows) for rows in zip(*found, strict=True)))


def stretched(string: Played, motion: Motion, frames: int = QUARTET) -> Complexes:
    """The amplitudes half of `frames` on, with the tension of all of them: each mode as by kicks, or by a turn.

    dT = stretch int (slope)^2 acts on the mode j as the force -dT k^2 q per mass; it kicks those of float64 that
    turn by less than 2 rad in these frames, and turns the others, up to a radian a frame, by dT k^2 / (2 mu omega) a
    second.
    """
    amplitude = motion.after(frames // 2)
    _, force, _ = force_of(string, amplitude, motion)
    turn = turns(string, motion)
    is_kicked = (frames * turn < 2.0) & (np.arange(len(turn)) < int(string.slot()["u"]["split"]))
    kick = 1j * force * frames / RATE / motion.omega * amplitude.real
    ahead = np.exp(0.5j * force / motion.omega * frames / RATE)
    return np.asarray(np.where(is_kicked, amplitude + kick, np.where(turn < 1.0, amplitude * ahead, amplitude)))


def turns(string: Played, motion: Motion) -> Floats:
    """By how much each mode turns in a frame (rad), (modes,); an unbent string's, if these turn faster."""
    op = string.ops[int(string.slot()["fret"])]
    wave = np.arange(1, motion.omega.shape[1] + 1) * np.pi / float(op["length"])
    return np.asarray(np.maximum(motion.omega[0], wave * float(op["speed"])) / RATE)


def force_of(string: Played, amplitude: Complexes, motion: Motion) -> tuple[Floats, Floats, int]:
    """Wave numbers (1/m), dT k^2 / mu (1/s^2) of the tension that the modes add, (modes,), and how many of them do."""
    op = string.ops[int(string.slot()["fret"])]
    wave = np.arange(1, amplitude.shape[1] + 1) * np.pi / float(op["length"])
    few = int(np.searchsorted(turns(string, motion), 1.0)) // BLOCK * BLOCK
    slope = float((wave[:few] ** 2 * amplitude.real[:, :few] ** 2).sum())
    return wave, float(string.record["stretch"]) * slope * float(op["weight"] / op["fine"] ** 2) * wave**2, few


def weights(string: Played, i: int) -> Floats:
    """The modes' weights at pickup `i`, (modes,)."""
    op = string.ops[int(string.slot()["fret"])]
    split, padded, n = int(op["split"]), int(op["padded"]), int(op["modes"])
    begin = int(op["taps"]) + i * (8 * split + 4 * (padded - split))
    low = (ctypes.c_double * split).from_address(begin)[:]
    high = (ctypes.c_float * (padded - split)).from_address(begin + 8 * split)[:]
    found = np.concatenate([low, high])[:n]
    found[int(string.slot()["heard"]) :] = 0.0
    return found


def assert_near(found: Floats | Complexes, wanted: Floats | Complexes, part: float) -> None:
    """Equal to `part` of the greatest of the row."""
    assert np.abs(found - wanted).max() < part * np.abs(wanted).max()


@pytest.mark.parametrize("preset", FRETTED)
@pytest.mark.parametrize("i", [0, 3])
@pytest.mark.parametrize("much", [0.0, STRETCHED])
def test_each_mode_moves_and_is_sensed_by_its_own_law(preset: str, much: float, i: int) -> None:
    """Free, by its frequency and damping alone; with tension, by that of all four frames in their middle.

    To the rounding of float32, or to the square of what tension moves. Pickups sense u's and v's velocities in each
    frame, and u's displacement in every second; in between it is half way.
    """
    string = sounding(preset, i)
    string.record["stretch"] *= much
    play_frame(string)
    assert string.record["left"] == QUARTET - 1
    before, now = motion_of(string, "_before"), motion_of(string)
    middle = Motion(stretched(string, before), before.omega, before.sigma)
    low = int(string.slot()["u"]["split"])
    bound = 1e-10 if much == 0.0 else 2e-6
    for k in range(2):
        assert_near(now.amplitude[k, :low], middle.after(2)[k, :low], bound)
        assert_near(now.amplitude[k, low:], middle.after(2)[k, low:], 1e-6)
        if much:
            moved = middle.after(2)[k] - before.after(4)[k]
            assert_near((now.amplitude - before.after(4))[k, :low], moved[:low], 0.02)
    path = [before.after(0), before.after(1), middle.after(0), middle.after(1), middle.after(2)]
    for k in range(int(string.record["pickups"])):
        weight, across = weights(string, k), float(string.record["across"][k])
        sensed = [weight @ (before.velocity(a)[0] + across * before.velocity(a)[1]) for a in path[:4]]
        assert_near(string.record["run"][2 * k + 1][:QUARTET], np.array(sensed), 3e-6)
        there = [weight[:low] @ a[0, :low].real for a in path]
        between = [there[0], (there[0] + there[2]) / 2, there[2], (there[2] + there[4]) / 2]
        assert_near(string.record["run"][2 * k][:QUARTET], np.array(between), bound + 1e-9)


@pytest.mark.parametrize("preset", ["jazz-finger", "slap"])
def test_only_modes_that_turn_by_less_than_a_radian_a_frame_stretch_the_string(preset: str) -> None:
    """A fast mode is as steep as the swing, and the string moves as without the tension that would come of it."""
    ends = []
    for steep in (False, True):
        string = sounding(preset)
        string.record["stretch"] *= STRETCHED
        slot = string.slot()
        turn = slot["u"]["omega"][: int(slot["active"])] / RATE
        fast = int(np.searchsorted(turn, 1.5))
        assert 1.0 < turn[fast] < 2.0
        if steep:
            slot["u"]["high"]["q"][fast - LOW] = np.abs(slot["u"]["low"]["q"][0]) / (fast + 1)
        play_frame(string)
        assert string.record["left"] == QUARTET - 1
        ends.append(motion_of(string).amplitude[:, :LOW])
    np.testing.assert_array_equal(ends[0], ends[1])


@pytest.mark.parametrize("preset", FRETTED)
def test_under_a_hand_it_fades_by_its_factor_in_each_frame(preset: str) -> None:
    string = sounding(preset)
    string.record["stretch"] = 0.0
    string.play(event(HAND, value=600.0))
    string.let_ring(0.02)
    to_left(string, 0)
    play_frame(string)
    assert string.record["left"] == QUARTET - 1
    before, now, hand = motion_of(string, "_before"), motion_of(string), float(string.slot()["hand"])
    low, faded = int(string.slot()["u"]["split"]), hand ** np.arange(QUARTET + 1)
    assert hand < 0.999
    assert_near(now.amplitude, faded[4] * before.after(4), 1e-6)
    path = [faded[k] * before.after(k) for k in range(QUARTET + 1)]
    for i in range(int(string.record["pickups"])):
        weight, across = weights(string, i), float(string.record["across"][i])
        sensed = [weight @ (before.velocity(a)[0] + across * before.velocity(a)[1]) for a in path[:4]]
        assert_near(string.record["run"][2 * i + 1][:QUARTET], np.array(sensed), 3e-6)
        there = [weight[:low] @ a[0, :low].real for a in path]
        between = [there[0], (there[0] + there[2]) / 2, there[2], (there[2] + there[4]) / 2]
        assert_near(string.record["run"][2 * i][:QUARTET], np.array(between), 1e-9)


@pytest.mark.parametrize("preset", FRETTED)
@pytest.mark.parametrize("heard", [2 * BLOCK, LOW + BLOCK])
def test_modes_that_no_pickup_hears_move_by_their_law_too(preset: str, heard: int) -> None:
    """Whether the lowest of them is float64 or float32: the string may touch its frets with them."""
    string = sounding(preset, rings=0.006)
    string.record["stretch"] = 0.0
    slot = string.slot()
    slot["heard"] = heard
    assert min(slot["active"], slot["v_active"]) > LOW + 2 * BLOCK
    play_frame(string)
    assert string.record["left"] == QUARTET - 1
    before, now = motion_of(string, "_before"), motion_of(string)
    for modes in (slice(heard), slice(heard, None)):
        assert_near(now.amplitude[:, modes], before.after(4)[:, modes], 1e-6)


@pytest.mark.parametrize("preset", FRETTED)
@pytest.mark.parametrize("ended", [False, True])
def test_modes_that_rest_are_left_alone(preset: str, ended: bool) -> None:
    """They cost nothing, neither in a quartet nor by fingers after it: what stands in their place stays there."""
    string = sounding(preset)
    if ended:
        string.play(event(HAND, value=1.0))
        string.let_ring(0.02)
        to_left(string, 0)
    slot, marked = string.slot(), []
    first = max(int(slot["active"]), int(slot["v_active"]), LOW) - LOW
    for w in ("u", "v"):
        for row in "qp":
            marked.append(slot[w]["high"][row][first:])
            marked[-1][:] = 1.0
    to_left(string, QUARTET - 1)
    to_left(string, 0)
    assert max(int(slot["active"]), int(slot["v_active"])) <= LOW + first
    assert all((row == 1.0).all() for row in marked)


@pytest.mark.parametrize("preset", FRETTED)
@pytest.mark.parametrize("much", [0.0, STRETCHED])
@pytest.mark.parametrize("done", [1, 2, 3])
def test_an_event_finds_the_string_where_single_frames_bring_it(preset: str, much: float, done: int) -> None:
    """From the quartet's begin, with the tension of each frame; and the rest of the four frames follows singly."""
    string = sounding(preset)
    string.record["stretch"] *= much
    play_frame(string)
    assert string.record["left"] == QUARTET - 1
    before = motion_of(string, "_before")
    for _ in range(done - 1):
        play_frame(string)
    string.play(event(GAIN, value=1.0))
    assert string.record["left"] == 0 and string.slot()["fourth"] == (done + 1) % QUARTET
    wanted = before
    for _ in range(done + 1):
        wanted = Motion(kicked(string, Motion(wanted.after(1), wanted.omega, wanted.sigma)), before.omega, before.sigma)
    if done + 1 < QUARTET:  # then u and v exchange
        assert_near(motion_of(string).amplitude, wanted.amplitude, 1e-6)


def kicked(string: Played, motion: Motion) -> Complexes:
    """The amplitudes after the kick of a single frame by the tension that the motion adds."""
    wave, force, few = force_of(string, motion.amplitude, motion)
    return np.asarray(
        motion.amplitude
        + np.where(np.arange(len(wave)) < few, 1j * force / RATE / motion.omega * motion.amplitude.real, 0.0)
    )


# A long run


def to_long_run(string: Played) -> None:
    """Plays the first frame of a long run."""
    while string.record["left"] or string.slot()["fourth"] or frames_to_rest(string) < LONG_RUN:
        play_frame(string)
    string.slot()["gentle"] = 1
    string.play(NOTHING)
    assert string.record["left"] == LONG_RUN - 1


def frames_to_rest(string: Played) -> int:
    return REST_EVERY - (int(string.record["frame"]) - int(string.record["woken"])) % REST_EVERY


def steadily_kicked(string: Played, motion: Motion, frames: int) -> list[Complexes]:
    """The amplitudes in each of so many frames if each is kicked by the tension in the middle of a long run."""
    _, force, _ = force_of(string, motion.after(LONG_RUN // 2), motion)
    force = np.where(turns(string, motion) < 1.0, force, 0.0)
    path = [motion.amplitude]
    for _ in range(frames):
        after = Motion(path[-1], motion.omega, motion.sigma).after(1)
        path.append(np.asarray(after + 1j * force / RATE / motion.omega * after.real))
    return path


@pytest.mark.parametrize("preset", FRETTED)
@pytest.mark.parametrize("i", [0, 3])
@pytest.mark.parametrize("much", [0.0, STRETCHED])
def test_each_mode_moves_and_is_sensed_in_a_long_run(preset: str, much: float, i: int) -> None:
    """As a quartet, for four times as long; its velocities are those of single frames with one tension for all.

    u's displacement is that of every second frame, and lies half way in between.
    """
    string = sounding(preset, i)
    string.record["stretch"] *= much
    to_long_run(string)
    before, now = motion_of(string, "_before"), motion_of(string)
    middle = Motion(stretched(string, before, LONG_RUN), before.omega, before.sigma)
    low = int(string.slot()["u"]["split"])
    bound = 1e-10 if much == 0.0 else 3e-5
    for k in range(2):
        assert_near(now.amplitude[k, :low], middle.after(8)[k, :low], bound)
        assert_near(now.amplitude[k, low:], middle.after(8)[k, low:], 3e-6 if much == 0.0 else 3e-5)
        if much:
            moved = middle.after(8)[k] - before.after(16)[k]
            assert_near((now.amplitude - before.after(16))[k, :low], moved[:low], 0.03)
    path = steadily_kicked(string, before, LONG_RUN)
    for k in range(int(string.record["pickups"])):
        weight, across = weights(string, k), float(string.record["across"][k])
        sensed = [weight @ (before.velocity(a)[0] + across * before.velocity(a)[1]) for a in path[:LONG_RUN]]
        assert_near(string.record["run"][2 * k + 1], np.array(sensed), 1e-4)
        there = [weight[:low] @ path[n][0, :low].real for n in range(0, LONG_RUN + 1, 2)]
        between = np.interp(np.arange(LONG_RUN), np.arange(0, LONG_RUN + 1, 2), there)
        assert_near(string.record["run"][2 * k], between, 1e-9 if much == 0.0 else 1e-3)


def exchanged(string: Played, amplitude: Complexes, rows: str) -> Complexes:
    """The amplitudes after an exchange by these rows of the slot."""
    slot, low, found = string.slot(), LOW, amplitude.copy()
    kept_u, kept_v, passed = (slot[rows][2 * k] + 1j * slot[rows][2 * k + 1] for k in range(3))
    of_u, of_v = (slot["u"]["kappa"] * slot["u"]["omega"])[:low], (slot["v"]["kappa"] * slot["v"]["omega"])[:low]
    u, v = of_u * amplitude[0, :low], of_v * amplitude[1, :low]
    found[0, :low], found[1, :low] = (kept_u * u + passed * v) / of_u, (kept_v * v + passed * u) / of_v
    return found


@pytest.mark.parametrize("preset", FRETTED)
def test_after_a_long_run_u_and_v_exchange_for_all_its_frames(preset: str) -> None:
    string = sounding(preset)
    to_long_run(string)
    wanted = motion_of(string)
    for _ in range(LONG_RUN - 1):
        string.play(NOTHING)
    assert string.record["left"] == 0 == string.slot()["fourth"] == string.slot()["owed"]
    after = exchanged(string, wanted.amplitude, "long_flow")
    assert np.abs(after - wanted.amplitude).max() > 1e-6 * np.abs(after).max()
    assert_near(motion_of(string).amplitude, after, 1e-12)


@pytest.mark.parametrize("preset", FRETTED)
@pytest.mark.parametrize("much", [0.0, STRETCHED])
@pytest.mark.parametrize("done", [1, 2, 3, 4, 6, 7, 8, 12, 15])
def test_an_event_finds_a_long_run_where_quartets_bring_it(preset: str, much: float, done: int) -> None:
    """With their exchanges; and the rest, up to three frames, where single frames do."""
    string = sounding(preset)
    string.record["stretch"] *= much
    to_long_run(string)
    before = motion_of(string, "_before")
    for _ in range(done - 1):
        string.play(NOTHING)
    string.slot()["gentle"] = 0
    string.play(event(GAIN, value=1.0))

    def four(motion: Motion) -> Motion:
        return Motion(
            Motion(stretched(string, motion), before.omega, before.sigma).after(2), before.omega, before.sigma
        )

    def exchange(motion: Motion) -> Motion:
        return Motion(exchanged(string, motion.amplitude, "flow"), before.omega, before.sigma)

    wanted, singly = before, done % QUARTET
    for _ in range(done // QUARTET):
        wanted = exchange(four(wanted))
    if not singly:  # another quartet begins
        wanted = four(wanted)
    for _ in range(singly + 1 if singly else 0):
        wanted = Motion(kicked(string, Motion(wanted.after(1), before.omega, before.sigma)), before.omega, before.sigma)
    if singly == QUARTET - 1:
        wanted = exchange(wanted)
    assert string.record["left"] == (0 if singly else QUARTET - 1)
    assert_near(motion_of(string).amplitude, wanted.amplitude, 1e-6 if much == 0.0 else 1e-5)


@pytest.mark.parametrize("preset", FRETTED)
def test_a_long_run_comes_only_before_a_gentle_exchange(preset: str) -> None:
    """What it would pass on is 66 dB below the motion, or 48, and 18 below its partials above 1.5 kHz.

    Every 64 frames that is asked again.
    """
    seen = set()
    for i in range(4):
        for fret in (0, 3, 5, 7, 9, 12):
            string = Played(preset, i)
            length = float(string.ops[fret]["length"])
            string.play(event(PLUCK, fret, apex=0.3e-3, place=0.8 * length, angle=0.4))
            string.let_ring(0.05)
            while frames_to_rest(string) != 1:
                string.play(NOTHING)
            assert string.record["left"] in (0, 1)
            string.play(NOTHING)
            slot, motion = string.slot(), motion_of(string)
            size = (np.abs(motion.omega * motion.amplitude)[:, :LOW] ** 2).sum(axis=0)
            passed = (slot["long_flow"][4:] ** 2).sum(axis=0)
            first = int(3000 * length / float(string.ops[fret]["speed"]))
            share = 10 * np.log10(passed @ size / size.sum())
            below = share - 10 * np.log10(size[first:].sum() / size.sum())
            if min(abs(share + 66), abs(share + 48), abs(below + 18)) > 0.1:
                assert slot["gentle"] == (share < -66 or (share < -48 and below < -18)), (share, below)
            seen.add((share < -66, share < -48, below < -18))
    assert len(seen) > 1


@pytest.mark.parametrize("preset", FRETTED)
def test_a_string_that_rings_moves_in_long_runs_and_an_ended_one_in_quartets(preset: str) -> None:
    string, lengths = sounding(preset, rings=0.3), []
    string.slot()["gentle"] = 1
    for ended in (False, True):
        if ended:
            string.play(event(HAND, value=1.0))
            string.let_ring(0.02)
        seen = []
        for _ in range(4 * REST_EVERY):
            string.play(NOTHING)
            string.slot()["gentle"] = 1
            seen.append(int(string.record["length"]) if string.record["left"] else 0)
        lengths.append(seen)
    assert lengths[0].count(LONG_RUN) > 0.8 * len(lengths[0]) and LONG_RUN not in lengths[1]
    assert lengths[1].count(QUARTET) > 0.5 * len(lengths[1])


# Where one may begin


@pytest.mark.parametrize("preset", FRETTED)
@pytest.mark.parametrize(
    "work", ["pulling", "waiting", "striking", "fingering", "landing", "ends_in", "depth", "depth_wanted"]
)
def test_none_begins_while_a_hand_works(preset: str, work: str) -> None:
    string = sounding(preset)
    string.record[work] = 5
    play_frame(string)
    assert string.record["left"] == 0
    free = sounding(preset)
    play_frame(free)
    assert free.record["left"] == QUARTET - 1


@pytest.mark.parametrize("preset", FRETTED)
def test_none_begins_under_a_finger_that_lies_on_a_note_that_goes_on(preset: str) -> None:
    """It has three dashpots, which act in each frame."""
    string = sounding(preset)
    string.record["touches"][0]["resistance"] = string.record["touches"][0]["wanted"] = 0.01
    string.record["touches"][0]["place"], string.record["touches"][0]["width"] = 0.2, 4e-3
    play_frame(string)
    assert string.record["left"] == 0


@pytest.mark.parametrize("preset", FRETTED)
@pytest.mark.parametrize(("ratio", "begins"), [(2.1, False), (1.9, True), (0.55, True), (0.45, False)])
def test_none_begins_on_a_string_that_is_bent_by_more_than_an_octave(preset: str, ratio: float, begins: bool) -> None:
    string = sounding(preset, rings=0.0, apex=1e-5)
    string.play(event(BEND, value=ratio))
    string.let_ring(0.1)
    assert float(string.slot()["ratio"]) == pytest.approx(ratio)
    seen = 0
    for _ in range(100):
        play_frame(string)
        seen += int(string.record["left"])
    assert (seen > 0) == begins


@pytest.mark.parametrize("preset", FRETTED)
@pytest.mark.parametrize("waits", [1, 2, 3])
def test_none_goes_on_over_the_frame_in_which_dead_modes_are_dropped(preset: str, waits: int) -> None:
    """Every 64 frames from the first event on, wherever the string's fourths fall."""
    string, quartets = Played(preset, 0), 0
    string.record["pull"] += waits
    string.let_ring(waits / RATE)
    string.play(event(PLUCK, apex=0.4e-3, place=0.6, angle=0.4))
    woken = int(string.record["woken"])
    for _ in range(RATE // 20):
        play_frame(string)
        quartets += int(string.record["left"]) == 1
        assert string.record["left"] == 0 or (int(string.record["frame"]) - woken) % REST_EVERY != 0
    assert quartets > 100 and woken == waits


# Fingers on an ended note

Finger = tuple[float, float, float]  # m from the saddle; N s/m; m, half its width
LAID: tuple[tuple[str, list[Finger]], ...] = (
    ("two fingers", [(0.2, 0.4, 4e-3), (0.31, 2.0, 12e-3)]),
    ("the same", [(0.2, 0.4, 4e-3), (0.31, 2.0, 12e-3)]),
    ("one presses harder", [(0.2, 50.0, 4e-3), (0.31, 2.0, 12e-3)]),
    ("one elsewhere", [(0.23, 50.0, 4e-3), (0.31, 2.0, 12e-3)]),
    ("one wider", [(0.23, 50.0, 4e-3), (0.31, 2.0, 30e-3)]),
    ("the first lifted", [(0.23, 0.0, 4e-3), (0.31, 2.0, 30e-3)]),
    ("beyond the end", [(0.23, 0.0, 4e-3), (9.0, 2.0, 30e-3)]),
    ("a needle", [(0.23, 0.3, 1e-5), (9.0, 0.0, 30e-3)]),
    ("four", [(0.23, 0.3, 4e-3), (0.1, 0.1, 3e-2), (0.3, 0.2, 8e-3), (0.4, 0.1, 2e-2)]),
    ("three of them", [(0.23, 0.3, 4e-3), (0.1, 0.0, 3e-2), (0.3, 0.2, 8e-3), (0.4, 0.1, 2e-2)]),
    ("none", [(0.23, 0.0, 4e-3), (9.0, 0.0, 30e-3)]),
)


def rows_of(string: Played) -> list[Floats]:
    """q and P of u and v, (modes,) each; still ones are 0."""
    slot, n, found = string.slot(), int(string.ops[0]["modes"]), []
    for name, active in (("u", "active"), ("v", "v_active")):
        for row in "qp":
            found.append(modal_row(slot[name], row)[:n])
            found[-1][int(slot[active]) :] = 0.0
    return found


def fingered(string: Played, rows: list[Floats], fingers: list[Finger], active: int) -> list[Floats]:
    """The same after the fingers' four frames by sums over modes, of which `active` may move.

    A dashpot takes c (s P) s, c = r / max(1 + r |s|^2 / 2, r |s|^2), r = R h / mu, of the lowest modes; a wave of k
    loses what exp(-(k a)^2 / 2), the average under the finger, misses of it.
    """
    op = string.ops[0]
    length, speed, fine, n = float(op["length"]), float(op["speed"]), float(op["fine"]), len(rows[0])
    j, kappa, density = np.arange(1, n + 1), string.slot()["u"]["kappa"][:n], fine**2 / float(op["weight"])
    (q_u, p_u, q_v, p_v), kept = (row.copy() for row in rows), np.ones(n)
    for place, firm, width in fingers:
        felt = np.exp(-((j * np.pi / length * width) ** 2) / 2)
        reached = min(4.5 / max(width, 1e-4), 2 * np.pi * 2e3 / speed) * length / np.pi
        few = min(-(-int(reached + 1) // BLOCK) * BLOCK, active)
        s = np.sqrt(2 / length) * np.sin(j * np.pi * max(length - place, 0.0) / length) * felt * kappa / fine
        s[few:] = 0.0
        r = firm * QUARTET / RATE / density
        c = r / max(1 + r * (s @ s) / 2, r * (s @ s))
        p_u, p_v = p_u - c * (s @ p_u) * s, p_v - c * (s @ p_v) * s
        kept /= 1 + r / (2 * length) * (1 - felt**2)
    return [kept * row for row in (q_u, p_u, q_v, p_v)]


@pytest.mark.parametrize("preset", [*FRETTED, "five-string" + AS_SHIPPED])  # whose fingers move modes of float32, too
@pytest.mark.parametrize("few", [False, True])
def test_fingers_on_an_ended_note_are_a_dashpot_each_after_a_quartet(preset: str, few: bool) -> None:
    """However many lie there, wherever they move, and whether the highest modes have died."""
    string = sounding(preset)
    string.play(event(HAND, value=1.0))
    string.let_ring(0.02)
    slot, touches = string.slot(), string.record["touches"]
    for said, fingers in LAID:
        touches["resistance"], touches["wanted"], touches["lifts"] = 0.0, 0.0, -1
        to_left(string, 1)
        for finger, (place, firm, width) in zip(touches, fingers, strict=False):
            finger["place"], finger["width"], finger["resistance"], finger["wanted"] = place, width, firm, firm
        if few:
            stop_modes_above(slot, 2 * BLOCK)
        before, active = rows_of(string), max(int(slot["active"]), int(slot["v_active"]))
        slot["thumb"]["on"] = THERE  # u and v do not exchange
        play_frame(string)
        slot["thumb"]["on"], slot["owed"] = 0, 0
        wanted = fingered(string, before, [finger for finger in fingers if finger[1]], active)
        for now, then in zip(rows_of(string), wanted, strict=True):
            assert np.abs(now - then)[:LOW].max() < 1e-9 * np.abs(then).max(), said
            assert np.abs(now - then)[LOW:].max(initial=0.0) <= 1e-6 * np.abs(then[LOW:]).max(), said


@pytest.mark.parametrize("preset", ["jazz-finger", "slap", "paper-bass"])
@pytest.mark.parametrize("frames", [41, 42, 43])
def test_quartets_count_from_the_release(preset: str, frames: int) -> None:
    """However long the finger holds the string, and also where it moves straight up and down alone."""
    string = Played(preset, 0)
    string.record["pull"] = frames
    string.play(event(PLUCK, apex=1e-3, place=0.5, angle=0.0))
    while string.slot()["active"] == 0:
        play_frame(string)
        assert string.frame <= frames + 1
    counted = []
    for k in range(1, 2 * QUARTET + 1):
        counted.append((k - int(string.slot()["fourth"]) - string.record["left"]) % QUARTET)
        play_frame(string)
    assert counted[:QUARTET] == [0] * QUARTET, counted


@pytest.mark.parametrize("preset", FRETTED)
@pytest.mark.parametrize("ended", [False, True])
def test_in_between_quartets_fingers_act_on_a_note_that_goes_on_alone(preset: str, ended: bool) -> None:
    string = sounding(preset)
    if ended:
        string.play(event(HAND, value=1.0))
        string.let_ring(0.02)
        to_left(string, 0)
        play_frame(string)
    string.record["stretch"] = 0.0
    before, finger = motion_of(string, "_before" if ended else ""), string.record["touches"][0]
    finger["place"], finger["width"], finger["resistance"], finger["wanted"] = 0.2, 4e-3, 0.4, 0.4
    string.play(event(GAIN, value=1.0))
    frames = 2 if ended else 1
    assert string.record["left"] == 0 and string.slot()["fourth"] == frames
    free = float(string.slot()["hand"]) ** frames * before.after(frames)
    damped = np.abs(motion_of(string).amplitude - free).max() / np.abs(free).max()
    assert damped < 1e-6 if ended else damped > 1e-5


@pytest.mark.parametrize("preset", FRETTED)
def test_after_a_quartet_fingers_act_on_an_ended_note_alone(preset: str) -> None:
    """On one that goes on they have acted in each frame."""
    string = sounding(preset)
    to_left(string, 1)
    finger = string.record["touches"][0]
    finger["place"], finger["width"], finger["resistance"], finger["wanted"] = 0.2, 4e-3, 0.4, 0.4
    before = motion_of(string)
    string.slot()["thumb"]["on"] = THERE  # u and v do not exchange
    play_frame(string)
    assert string.record["left"] == 0
    np.testing.assert_array_equal(motion_of(string).amplitude, before.amplitude)


def stop_modes_above(slot: np.void, few: int) -> None:
    """Stops all but the lowest modes, a whole number of BLOCKs."""
    for name, active in (("u", "active"), ("v", "v_active")):
        for row in "qp":
            slot[name]["low"][row][few:LOW] = 0.0
            slot[name]["high"][row][: ROW - LOW] = 0.0
        slot[active] = min(int(slot[active]), few)


# Looks ahead


def clear_above(string: Played, m: int, ahead: int) -> float:
    """The height (m) of contact point `m` above which a string in motion might touch it within so many frames `ahead`.

    By the law of looks.py.
    """
    slot, op, motion = string.slot(), string.ops[int(string.slot()["fret"])], motion_of(string)
    n, speed, length = int(slot["u"]["split"]), float(op["speed"]), float(op["length"])
    place = (ctypes.c_double * int(op["points"])).from_address(int(op["positions"]))[m]
    shape = np.sqrt(2 / length) * np.sin(np.arange(1, n + 1) * np.pi / length * place)
    least = min(float(shape @ motion.after(frames)[0, :n].real) for frames in (0, ahead // 2, ahead))
    size, omega = np.abs(motion.amplitude[0]), motion.omega[0]
    slope = (float(slot["fastest"]) / (float(slot["safety"]) * speed)) ** 2 * length
    density = float(op["fine"] ** 2 / op["weight"])
    tighter = min(float(string.record["stretch"]) * slope / (density * speed**2), 0.2)
    swing = (ahead / 2 / RATE) ** 2 / 8 * float(size[:n] @ omega[:n] ** 2)
    later = ahead / RATE * tighter / 2 * float(size[:n] @ omega[:n])
    return least - 10e-6 - np.sqrt(2 / length) * (swing + later + float(size[n:].sum()))


@pytest.mark.parametrize("preset", FRETTED)
@pytest.mark.parametrize("much", [1.0, 1e3, 1e9])
@pytest.mark.parametrize("m", [3, 17])
@pytest.mark.parametrize("suspect", [0, 5, 17])
def test_a_string_is_clear_by_what_acceleration_tension_and_high_modes_may_move(
    preset: str, much: float, m: int, suspect: int
) -> None:
    """A twentieth of a micrometre decides, whichever point is checked first. Then the points wait for 16 frames.

    Or else the next look so far waits for 8, and one that sees a quartet ahead decides alike, for 4 frames.
    """
    for far, room in ((True, 0.05e-6), (True, -0.05e-6), (False, 0.05e-6), (False, -0.05e-6)):
        string = sounding(preset, rings=0.006, apex=1e-3)
        slot, step, steps = string.slot(), int(string.record["step"]), int(string.ops[0]["steps"])
        string.record["stretch"] *= much
        slot["u"]["height"] = -1.0
        slot["u"]["height"][m] = clear_above(string, m, 16 if far else 4) - room
        slot["due"] = slot["quiet"] = step
        slot["doubted"] = step if far else step + steps
        slot["doubtful"] = suspect
        play_frame(string)
        if far and room > 0.0:
            assert string.record["left"] == QUARTET - 1 and slot["due"] == step + 16 * steps
        elif far:
            assert slot["due"] != step + 16 * steps and slot["doubted"] == step + 8 * steps and slot["doubtful"] == m
        elif room > 0.0:
            assert string.record["left"] == QUARTET - 1 and slot["due"] == step + 4 * steps
        else:
            assert string.record["left"] == 0 and slot["doubtful"] == m
