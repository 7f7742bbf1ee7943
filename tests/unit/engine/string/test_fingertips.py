"""A finger that lies on a string: how it lands, lifts, moves on and changes its pressure, frame by frame."""

from __future__ import annotations

import numpy as np
import pytest
from support.own_basses import FRETTED
from support.played import RATE, TURNED, Played, event

from livebass.compiling import jit
from livebass.engine.prepare import modal_row
from livebass.kernels.string.frame import operator_at, string_at
from livebass.kernels.string.records import BLOCK, LOW, PLUCK, ROW, TOUCH_EVENT
from livebass.kernels.string.touch import begin_touch, damp_by_touches, follow_ramp, lift_touch, ramp_touch
from livebass.rows.arrays import Floats

FIRM, WIDTH, FINGER = 0.4, 4e-3, 1  # N s/m; m, half; which finger
LANDING, LIFTING = 5e-3, 15e-3  # s, of a finger whose event says no times


def lay(place: float = 0.2, resistance: float = FIRM, width: float = WIDTH, seconds: float = 0.0) -> np.ndarray:
    """The event of a finger that lands `place` m from the saddle, or with no resistance lifts."""
    return event(TOUCH_EVENT, finger=FINGER, place=place, resistance=resistance, width=width, seconds=seconds)


def pressures(string: Played, frames: int) -> Floats:
    """The finger's resistance (N s/m) after each of the next frames, (frames,)."""
    found = np.empty(frames)
    for k in range(frames):
        string.play(event(PLUCK)[:0])
        found[k] = string.record["touches"][FINGER]["resistance"]
    return found


def ramp(begin: float, end: float, seconds: float, frames: int) -> Floats:
    """A straight line over `seconds` from its first frame on, (frames,), then `end`."""
    part = np.minimum(np.arange(1, frames + 1) / (seconds * RATE), 1.0)
    made: Floats = begin + (end - begin) * part
    return made


@pytest.fixture(params=FRETTED)
def string(request: pytest.FixtureRequest) -> Played:
    """A string that sounds."""
    played = Played(request.param, 0)
    played.play(event(PLUCK, apex=1e-3, place=0.2))
    return played


def test_it_lands_and_lifts_on_straight_lines(string: Played) -> None:
    frames = round(1.5 * LIFTING * RATE)
    string.play(lay())
    first = float(string.record["touches"][FINGER]["resistance"])
    assert first == pytest.approx(FIRM / (LANDING * RATE))
    assert pressures(string, frames) == pytest.approx(ramp(first, FIRM + first, LANDING, frames).clip(max=FIRM))
    string.play(lay(resistance=0.0))
    first = FIRM - FIRM / (LIFTING * RATE)
    assert pressures(string, frames) == pytest.approx(ramp(first, first - FIRM, LIFTING, frames).clip(min=0), abs=1e-12)


def test_it_lifts_by_itself_after_its_time_and_in_the_time_of_its_event(string: Played) -> None:
    stays, frames = 8e-3, round(30e-3 * RATE)
    string.play(lay(seconds=stays))
    found = pressures(string, frames)
    still = np.flatnonzero(found == FIRM)
    assert still[-1] == round(stays * RATE) - 3, "the next frame lifts it"
    assert np.diff(found[still[-1] :])[:100] == pytest.approx(-FIRM / (LIFTING * RATE))
    string.play(lay())
    pressures(string, frames)
    string.play(lay(resistance=0.0, seconds=4e-3))
    assert np.flatnonzero(pressures(string, frames) < 1e-12)[0] == round(4e-3 * RATE) - 2


@pytest.mark.parametrize("place, width, lands", [(0.2, WIDTH, False), (0.21, WIDTH, True), (0.2, 2 * WIDTH, True)])
def test_at_another_place_it_lands_again_and_at_the_same_it_stays(
    string: Played, place: float, width: float, lands: bool
) -> None:
    string.play(lay())
    pressures(string, round(2 * LANDING * RATE))
    string.play(lay(place, 1.5 * FIRM, width))
    now = float(string.record["touches"][FINGER]["resistance"])
    step = 1.5 * FIRM / (LANDING * RATE)
    assert now == pytest.approx(step if lands else FIRM + step)


@jit
def begin(string: int, resistance: float, seconds: float, landing: float) -> None:
    begin_touch(string_at(string).voice, FINGER, 0.2, resistance, WIDTH, seconds, landing)


@jit
def ramp_from(string: int, resistance: float, seconds: float) -> None:
    ramp_touch(string_at(string).voice, FINGER, resistance, seconds)


@jit
def lift(string: int, seconds: float) -> None:
    lift_touch(string_at(string).voice, FINGER, seconds)


@jit
def follow(string: int, rate: float) -> None:
    follow_ramp(string_at(string).voice.touches[FINGER], rate)


@pytest.mark.parametrize("seconds, frames", [(0.0, 1.0), (0.5 / RATE, 1.0), (1.5 / RATE, 1.5), (4e-3, 4e-3 * RATE)])
def test_a_ramp_takes_its_time_or_at_least_a_frame(seconds: float, frames: float) -> None:
    string = Played("jazz-finger", 0)
    address, t = string.voice.string.ctypes.data, string.record["touches"][FINGER]
    begin(address, FIRM, 0.0, seconds)
    assert (t["resistance"], t["wanted"], t["lifts"]) == (0.0, FIRM, -1) and t["ramp"] == pytest.approx(FIRM / frames)
    for now in (0.1 * FIRM, 1.5 * FIRM):
        ramp_from(address, now, seconds)
        assert t["resistance"] == now and t["ramp"] == pytest.approx(abs(FIRM - now) / frames)
    lift(address, seconds)
    assert t["wanted"] == 0.0 and t["ramp"] == pytest.approx(1.5 * FIRM / frames)
    begin(address, FIRM, seconds, LANDING)
    assert t["lifts"] == (max(round(frames), 1) if seconds else -1)
    begin(address, 0.0, seconds, LANDING)
    assert t["ramp"] == pytest.approx(1.5 * FIRM / (frames if seconds else LIFTING * RATE))


@pytest.mark.parametrize("rate, frames", [(50.0, 1.0), (100.0, 1.5), (RATE, LIFTING * RATE)])
def test_when_its_time_is_over_it_lifts(rate: float, frames: float) -> None:
    string = Played("jazz-finger", 0)
    address, t = string.voice.string.ctypes.data, string.record["touches"][FINGER]
    t["resistance"], t["wanted"], t["lifts"] = FIRM, FIRM, 2
    for left in (1, -1):
        assert t["resistance"] == FIRM
        follow(address, rate)
        assert t["lifts"] == left
    assert t["wanted"] == 0.0 and t["resistance"] == pytest.approx(FIRM * (1 - 1 / frames), abs=1e-15)


# What fingers take from the modes


@jit
def damp(string: int, k: int, operator: int) -> None:
    """Damps slot `k` of a STRING with its fingers for a frame."""
    damp_by_touches(string_at(string).voice, string_at(string).slots[k], operator_at(operator))


class Touched:
    """A string that sounds over fret 5, and fingers that damp it while it does not move."""

    def __init__(self, angle: float, rings: int = 300) -> None:
        self.string = Played("jazz-finger" + TURNED, 1)
        self.string.play(event(PLUCK, 5, apex=1e-3, place=0.2, angle=angle, width=1e-3))
        for _ in range(rings):
            self.string.play(event(PLUCK)[:0])
        self.op = self.string.ops[5:6]
        self.k = int(self.string.record["slot"])
        self.slot = self.string.voice.slots[self.k]

    def lay(self, i: int, place: float, firm: float, width: float, landing: bool) -> None:
        """Lays finger `i`, landed or on its way to twice the resistance."""
        t = self.string.record["touches"][i]
        t["place"], t["width"], t["resistance"], t["lifts"] = place, width, firm, -1
        t["wanted"], t["ramp"] = 2 * firm if landing else firm, 0.0

    def rest_above(self, modes: int) -> None:
        """Stops all but the lowest `modes`, a whole number of BLOCKs."""
        for name, active in (("u", "active"), ("v", "v_active")):
            for row in ("q", "p"):
                self.slot[name]["low"][row][modes:LOW] = 0.0
                self.slot[name]["high"][row][: ROW - LOW] = 0.0
            self.slot[active] = min(int(self.slot[active]), modes)

    def motion(self) -> list[Floats]:
        """q and P of u and v, (modes,) each; still ones are 0."""
        found = []
        for name, count in (("u", "active"), ("v", "v_active")):
            for row in ("q", "p"):
                whole = modal_row(self.slot[name], row)[: int(self.op["modes"][0])]
                whole[int(self.slot[count]) :] = 0.0
                found.append(whole)
        return found

    def damped(self) -> list[Floats]:
        """The motion a frame later."""
        damp(self.string.voice.string.ctypes.data, self.k, self.op.ctypes.data)
        return self.motion()

    def by_law(self, motion: list[Floats], fingers: list[tuple[float, float, float]], active: int) -> list[Floats]:
        """The same by sums over modes, for fingers (place from the saddle, N s/m, half width) on `active` modes."""
        op = self.op[0]
        length, speed, fine, modes = float(op["length"]), float(op["speed"]), float(op["fine"]), int(op["modes"])
        j, kappa = np.arange(1, modes + 1), self.slot["u"]["kappa"][:modes]
        frame, density = 1 / RATE, fine**2 / float(op["weight"])
        q_u, p_u, q_v, p_v = (row.copy() for row in motion)
        firm_in_all, above = 0.0, 0
        for place, firm, width in fingers:
            reached = min(4.5 / width, 2 * np.pi * 8e3 / speed) * length / np.pi
            n = min(-(-int(reached + 1) // BLOCK) * BLOCK, active, modes)
            for aside, part in ((0.0, 2 / 3), (3**0.5, 1 / 6), (-(3**0.5), 1 / 6)):
                x = np.clip(length - place - aside * width, 0.0, length)
                s = np.sqrt(2 / length) * np.sin(j * np.pi * x / length) * kappa / fine
                s[n:] = 0.0
                r = part * firm * frame / density
                c = r / max(1 + r * (s @ s) / 2, r * (s @ s))
                p_u -= c * (s @ p_u) * s
                p_v -= c * (s @ p_v) * s
            firm_in_all, above = firm_in_all + firm, max(above, n)
        fades = np.where(j > above, np.exp(-firm_in_all * frame / (2 * density * length)), 1.0)
        return [fades * row for row in (q_u, p_u, q_v, p_v)]


def assert_alike(found: list[Floats], wanted: list[Floats], before: list[Floats]) -> None:
    """To float32 in the higher modes."""
    for ours, theirs, begun in zip(found, wanted, before, strict=True):
        assert np.abs(ours[:64] - theirs[:64]).max() <= 1e-9 * np.abs(begun).max()
        highs = np.abs(np.concatenate([begun[64:], theirs[64:]])).max()
        assert np.abs(ours[64:] - theirs[64:]).max() <= 3e-7 * highs


FINGERS = [(0.2, 0.4, 4e-3), (0.03, 2.0, 8e-3), (0.3, 50.0, 1e-5), (0.405, 0.05, 3e-2)]


@pytest.mark.parametrize("angle", [0.0, 0.4, np.pi / 2])
@pytest.mark.parametrize("fingers", [*[[one] for one in FINGERS], FINGERS])
@pytest.mark.parametrize("landing", [False, True])
@pytest.mark.parametrize("few", [False, True])
def test_a_finger_is_three_dashpots_and_takes_the_highs_evenly(
    angle: float, fingers: list[tuple[float, float, float]], landing: bool, few: bool
) -> None:
    """One after another, by the implicit midpoint rule; in every frame while it lies, and after it has moved on.

    Only one that lands or lifts moves modes that rest.
    """
    string = Touched(angle)
    if few:
        string.rest_above(2 * BLOCK)
    modes = int(string.op["modes"][0])
    for _ in range(3):
        for i, finger in enumerate(fingers):
            string.lay(i, *finger, landing)
        for _ in range(2):
            before = string.motion()
            active = modes if landing else max(int(string.slot["active"]), int(string.slot["v_active"]))
            assert_alike(string.damped(), string.by_law(before, fingers, active), before)
        fingers = [(place + 0.01, 1.1 * firm, 1.2 * width) for place, firm, width in fingers]


def test_what_a_finger_needs_is_computed_once() -> None:
    """While it lies, shapes, their products, the parts that it takes and what the highs keep are only read."""
    string = Touched(0.4)
    string.lay(0, *FINGERS[0], landing=False)
    string.damped()
    marked = [
        string.slot[name].reshape(-1) for name in ("touch_shape", "touch_product", "touch_square", "touch_factor")
    ]
    for row in marked:
        row[0] = 7.0
    string.slot["touch_kept"] = 0.5
    string.damped()
    assert [row[0] for row in marked] == [7.0] * 4 and string.slot["touch_kept"] == 0.5


@pytest.mark.parametrize("angle", [0.0, 0.4])
def test_a_finger_damps_a_string_that_moves_up_and_down_alone(angle: float) -> None:
    """As on a string that moves both ways: its modes fall by more than half in a tenth of a second."""
    string = Played("paper-bass", 3)
    string.play(event(PLUCK, apex=1e-4, place=0.5, angle=angle))
    string.let_ring(0.02)
    assert bool(string.slot()["v_active"]) == (angle > 0.0)
    before = np.abs(modal_row(string.slot()["u"], "q")[:8]).sum()
    string.play(lay())
    string.let_ring(0.1)
    assert np.abs(modal_row(string.slot()["u"], "q")[:8]).sum() < 0.5 * before
