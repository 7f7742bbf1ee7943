"""A second polarisation with its own law: its frequencies, dampings and beats, in tune in every technique."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable

import numpy as np
import pytest
from scipy.signal import lfilter
from support.agreement import assert_agree
from support.costs import quick
from support.motion import free_modes
from support.own_basses import load_preset
from support.played import RATE, YIELDS, Played, event
from support.strings import case_b, g_neck, g_string, oblique, with_own_across, yielding

from livebass.engine.prepare import modal_row, play_frames
from livebass.engine.solve import solve_trial
from livebass.kernels.string.records import BEND, EVENT, GLIDE, HAMMER, PLUCK, PULL_OFF, TOUCH_EVENT, WAVER
from livebass.model import modes
from livebass.model.instrument import Neck, Speaking, String, speaking
from livebass.model.neck import Admittance, Resonance, bending_shape
from livebass.rows.arrays import Floats

PARTIALS = 5
NONE = np.zeros(0, EVENT)


def test_v_has_the_frequencies_and_dampings_of_its_own_neck() -> None:
    """In an oblique pluck without contacts, v is the free motion of `modes` across."""
    s = with_own_across(speaking(g_string(), g_neck(), 0))
    trial = dataclasses.replace(oblique(case_b(modes=60, duration=0.3), 1.2, 1e-3), speaking=s)
    motion, t = solve_trial(trial), np.arange(trial.samples) / trial.output_rate
    nu, sigma = modes.frequencies(s, 60, across=True), modes.dampings(s, 60, across=True)
    assert np.all(np.abs(nu / modes.frequencies(s, 60) - 1) > 1e-5) and np.all(sigma != modes.dampings(s, 60))
    q = np.sin(1.2) * modes.pluck_amplitudes(s, 60, trial.pluck, across=True)
    place = trial.sensor if trial.sensor_v is None else trial.sensor_v
    exact = free_modes(s, q, t, across=True) @ modes.shapes(s, 60, np.array([place]))[0]
    assert motion.across_m is not None and motion.contact_step.size == 0
    assert np.abs(motion.across_m - exact).max() < 1e-6 * np.abs(exact).max()


def test_a_v_that_is_as_u_changes_nothing() -> None:
    """An own law with the same numbers gives the same motion, but for rounding."""
    trial = oblique(case_b(300, 1e6, duration=0.05), 0.8, 4e-3)
    s = dataclasses.replace(trial.speaking, own_across=True)
    plain, same = solve_trial(trial), solve_trial(dataclasses.replace(trial, speaking=s))
    assert plain.across_m is not None and same.across_m is not None
    for one, other in ((plain.displacement_m, same.displacement_m), (plain.across_m, same.across_m)):
        assert np.abs(one - other).max() < 1e-12 * np.abs(one).max()


@pytest.mark.parametrize("string", [None, g_string()], ids=["by the law", "measured"])
def test_brute_force_agrees_where_it_touches(string: String | None) -> None:
    s = with_own_across(speaking(g_string(), g_neck(3e8), 0))
    s = dataclasses.replace(s, string=string or s.string)
    trial = dataclasses.replace(oblique(case_b(duration=0.012), 1.0, 6e-3), speaking=s)
    assert assert_agree(dataclasses.replace(trial, sensor_v=s.length - 0.03), "v of its own, frets that give way")


# ---- the meaning of a neck's numbers


def neck_with(y: Admittance, **given: float) -> Neck:
    """The paper's neck with the admittance `y`."""
    return dataclasses.replace(g_neck(), admittance=y, stop_conductance=2e-3, **given)


BACK = Admittance((Resonance(45.0, 30.0, 1.1), Resonance(270.0, 40.0, 0.6, 2), Resonance(80.0, 15.0, 3.0, 0)))
TABLE = Admittance((), tuple((f, 1e-3 * (2 + np.sin(f / 40)), 5e-4 * np.cos(f / 70)) for f in range(20, 900, 7)))


@pytest.mark.parametrize("fret", [0, 5, 12])
def test_a_stiffer_neck_bends_at_higher_frequencies(fret: float) -> None:
    """With the mass it has: sqrt(2.5) times as high. The whole bass moves the same on any neck."""
    given = {"stiffness_across": 2.5, "stop_across": 0.3}
    s = speaking(g_string(), neck_with(BACK, **given), int(fret))
    part = [bending_shape(r.shape, (0.863 - s.length) / (0.6 * 0.863)) ** 2 for r in BACK.resonances]
    nu = np.linspace(20, 900, 400)
    wanted = np.full(nu.shape, 2e-3 * 0.3 if fret else 0.0, np.complex128)
    for r, felt in zip(BACK.resonances, part, strict=True):
        if felt:
            own = 2 * np.pi * r.frequency * (np.sqrt(2.5) if r.shape else 1.0)
            omega = 2 * np.pi * nu
            wanted += felt * 1j * omega / r.mass / (own**2 - omega**2 + 1j * omega * own / r.quality)
    assert s.own_across and np.abs(s.admittance_across.at(nu) - wanted).max() < 1e-9 * np.abs(wanted).max()
    assert s.admittance == speaking(g_string(), neck_with(BACK), int(fret)).admittance


def test_a_measured_neck_is_one_of_resonances_that_are_higher() -> None:
    """Y of a neck vibrating h times as high is Y(nu / h) / h, for resonances and tables."""
    bending = Admittance(BACK.resonances[:2])
    nu = np.arange(2.0, 3000.0, 0.25)
    table = Admittance(
        (), tuple((f, y.real, y.imag) for f, y in zip(nu.tolist(), bending.at(nu).tolist(), strict=True))
    )
    requested = np.linspace(30, 1500, 500)
    for fret in (0, 4):
        if fret:  # a table has no shapes: it counts by the first one
            bending = Admittance(tuple(dataclasses.replace(r, shape=1) for r in bending.resonances))
        ours, theirs = (
            speaking(g_string(), neck_with(y, stiffness_across=2.0), fret).admittance_across.at(requested)
            for y in (table, bending)
        )
        assert np.abs(ours - theirs).max() < 0.02 * np.abs(theirs).max()


@pytest.mark.parametrize("y", [BACK, TABLE, Admittance()], ids=["resonances", "table", "rigid"])
@pytest.mark.parametrize("capo", [0.0, g_neck().fret_positions[1]], ids=["open", "capo"])
def test_v_is_longer_stiffer_and_stopped_by_itself(y: Admittance, capo: float) -> None:
    """Frequencies and dampings of v, by eqs. 8 and 9 with v's own neck."""
    given = {"stiffness_across": 1.7, "stop_across": 0.3, "longer_across": 1.5e-3, "capo": capo}
    string = dataclasses.replace(g_string(), measured_frequencies=(), measured_dampings=())
    for fret in (0, 3):
        s = speaking(string, neck_with(y, **given), fret)
        plain = speaking(string, neck_with(y, capo=capo), fret)
        j = np.arange(1, 41)
        assert np.array_equal(modes.frequencies(s, 40), modes.frequencies(plain, 40))
        assert np.array_equal(modes.dampings(s, 40), modes.dampings(plain, 40))
        z, at = modes.impedance(s), j * s.fundamental
        bare = modes.frequencies(plain, 40) + z / np.pi * s.fundamental * np.imag(s.admittance.at(at))
        nu = (bare - z / np.pi * s.fundamental * np.imag(s.admittance_across.at(at))) / (1 + 1.5e-3 / s.length)
        ours = modes.frequencies(s, 40, across=True)
        assert np.abs(ours / nu - 1).max() < 1e-13
        more = np.real(s.admittance_across.at(ours)) - np.real(s.admittance.at(modes.frequencies(s, 40)))
        sigma = modes.dampings(s, 40) + 2 * z * s.fundamental * more
        assert modes.dampings(s, 40, across=True) == pytest.approx(sigma, rel=1e-11)
        stopped = fret > 0 or capo > 0
        assert s.admittance_across.stop == pytest.approx(2e-3 * 0.3 if stopped else 0.0)


def test_what_was_measured_is_of_u() -> None:
    """v differs as the law says, in frequency and, beyond the string's own loss, in damping."""
    s = with_own_across(speaking(g_string(), g_neck(), 0))
    measured = dataclasses.replace(s, string=g_string())
    far = modes.frequencies(s, 34, across=True) - modes.frequencies(s, 34) / (1 + s.longer_across)
    away = modes.frequencies(measured, 34, across=True) - modes.frequencies(measured, 34) / (1 + s.longer_across)
    assert away == pytest.approx(far, rel=1e-6)
    u, v = (modes.dampings(measured, 34, across=across) for across in (False, True))
    takes = [
        2 * modes.impedance(s) * s.fundamental * np.real(y.at(modes.frequencies(measured, 34, across=across)))
        for across, y in ((False, s.admittance), (True, s.admittance_across))
    ]
    law = modes.law_frequencies(measured, np.arange(1.0, 35))
    alone = np.minimum(np.pi * law * modes.loss_factor(measured, law), u)
    assert u == pytest.approx(g_string().measured_dampings, rel=1e-12)
    assert v == pytest.approx(np.maximum(u - takes[0], alone) + takes[1], rel=1e-12)
    assert 5 < np.count_nonzero(u - takes[0] > alone) < 30  # both cases occur
    assert np.all(v > 0)


@pytest.mark.parametrize("part", [0.0, 0.1, 1.0])
def test_v_loses_at_least_what_its_neck_takes(part: float) -> None:
    """However low the measured losses of u: v never grows, and loses its neck's share."""
    few = tuple(part * sigma for sigma in g_string().measured_dampings)
    s = with_own_across(speaking(g_string(), g_neck(), 0))
    s = dataclasses.replace(s, string=dataclasses.replace(g_string(), measured_dampings=few))
    taken = 2 * modes.impedance(s) * s.fundamental * np.real(s.felt(True).at(modes.frequencies(s, 34, across=True)))
    v = modes.dampings(s, 34, across=True)
    assert np.all(taken > 0) and np.all(v >= taken) and np.all(v <= (few + taken) * (1 + 1e-12))
    assert np.any(modes.dampings(s, 34) < taken)  # so the test covers modes whose u loses less


@pytest.mark.parametrize("partial", [1, 5])
def test_a_pluck_at_45_degrees_beats_as_its_frequencies_say(partial: int) -> None:
    """The sum of both polarisations swells and fades |nu_v - nu_u| times a second."""
    s = dataclasses.replace(with_own_across(speaking(g_string(), g_neck(), 0)), longer_across=9e-3)
    trial = dataclasses.replace(case_b(40, 96e3, duration=8.0, output_rate=4000.0, lossless=True), speaking=s)
    motion = solve_trial(oblique(trial, np.pi / 4, 0.5e-3))
    assert motion.across_m is not None and motion.contact_step.size == 0
    u, v = (modes.frequencies(s, partial, across=across)[-1] for across in (False, True))
    t, beat = motion.time_s, abs(v - u)
    assert beat > 0.4
    window = np.exp(-(np.linspace(-3, 3, 401) ** 2) / 2)
    carried = (motion.displacement_m + motion.across_m) * np.exp(-2j * np.pi * u * t)
    swell = np.abs(np.convolve(carried, window / window.sum(), "same"))[400:-400] ** 2
    swell -= swell.mean()
    times = t[400:-400]
    found = np.linspace(0.9, 1.1, 401) * beat
    there = [abs(np.sum(swell * np.hanning(swell.size) * np.exp(-2j * np.pi * f * times))) for f in found]
    assert found[int(np.argmax(there))] == pytest.approx(beat, rel=0.02)


# ---- in the hands of a player


def own_cents(preset: str, i: int, fret: int) -> Floats:
    """Model's distance (cents) of v from u in its lowest partials, (PARTIALS,)."""
    name = preset.removesuffix(YIELDS)
    bass = yielding(load_preset(name))
    s = speaking(bass.strings[i], bass.necks[i], fret)
    return cents(_damped(s, True), _damped(s, False))


def _damped(s: Speaking, across: bool) -> Floats:
    nu, sigma = modes.frequencies(s, PARTIALS, across=across), modes.dampings(s, PARTIALS, across=across)
    return np.sqrt((2 * np.pi * nu) ** 2 - sigma**2)


def cents(a: Floats, b: Floats) -> Floats:
    return np.asarray(1200 * np.log2(a / b))


def pluck(preset: str, i: int, fret: int) -> Played:
    """A string plucked softly at 45 degrees, unbent by tension."""
    string = Played(preset, i)
    string.record["stretch"] = 0.0
    length = float(string.ops[fret]["length"])
    string.play(event(PLUCK, fret, apex=0.1e-3, place=0.79 * length, width=5e-3, seconds=1e-4, angle=np.pi / 4))
    return string


def slot_of(string: Played) -> np.void:
    return string.voice.slots[int(string.record["slot"])]


def heard_cents(string: Played, seconds: float) -> Floats:
    """Audible distance (cents) of v from u, (PARTIALS,), from their modes' turns in `seconds`."""
    total, last = np.zeros((2, PARTIALS)), np.zeros((2, PARTIALS))
    for frame in range(round(seconds * RATE) + 1):
        for k, name in enumerate("uv"):
            w = slot_of(string)[name]
            q, p = (w["low"][row][:PARTIALS] for row in ("q", "p"))
            kappa, omega = (w[row][:PARTIALS] for row in ("kappa", "omega"))
            phase = np.arctan2(-p / (kappa * omega), q)
            if frame:
                total[k] += (phase - last[k]) % (2 * np.pi)
            last[k] = phase
        string.play(NONE)
    return cents(*total[::-1])


GESTURES: dict[str, Callable[[Played], int]] = {}


def gesture(made: Callable[[Played], int]) -> Callable[[Played], int]:
    GESTURES[made.__name__] = made
    return made


@gesture
def held(string: Played) -> int:
    return 2


@gesture
def hammered(string: Played) -> int:
    string.play(event(HAMMER, 7, speed=1.0))
    string.let_ring(0.1)
    return 7


@gesture
def pulled_off(string: Played) -> int:
    string.play(event(PULL_OFF, 0, apex=0.1e-3))
    return 0


@gesture
def slid(string: Played) -> int:
    string.play(event(GLIDE, 5, seconds=22e-3))
    string.let_ring(0.2)
    return 5


@gesture
def bent(string: Played) -> int:
    string.play(event(BEND, value=2 ** (2 / 12)))
    string.let_ring(0.1)
    return 2


@gesture
def in_vibrato(string: Played) -> int:
    string.play(event(WAVER, value=0.3, rate=5.0))
    string.let_ring(0.4)
    return 2


@pytest.mark.parametrize("preset", quick(["jazz-finger" + YIELDS, "fretless" + YIELDS], ["jazz-finger" + YIELDS]))
@pytest.mark.parametrize("name", GESTURES)
def test_v_stays_in_tune_with_u(name: str, preset: str) -> None:
    """In cents of partials 1 to 5, v lies from u as in the model at the technique's last fret."""
    string = pluck(preset, 2, 2)
    string.let_ring(0.05)
    fret = GESTURES[name](string)
    wanted = own_cents(preset, 2, fret)
    assert np.abs(wanted).min() > 0.5
    # a vibrato adds the same tension to both, which is a little more for the slower one
    assert heard_cents(string, 0.4) == pytest.approx(wanted, abs=0.15 if name == "in_vibrato" else 0.05)


def test_v_stays_in_tune_on_the_way_of_a_glide() -> None:
    """Between two frets it moves from the first one's cents to the second's, without a step."""
    preset = "fretless" + YIELDS
    string, between, last = pluck(preset, 2, 2), 0, own_cents(preset, 2, 2)
    string.let_ring(0.05)
    of = np.array([own_cents(preset, 2, fret) for fret in range(2, 10)])
    string.play(event(GLIDE, 9, seconds=30e-3))
    for _ in range(round(0.3 * RATE)):
        string.play(NONE)
        slot = slot_of(string)
        now = cents(slot["v"]["omega"][:PARTIALS], slot["u"]["omega"][:PARTIALS])
        assert np.all(now > of.min(axis=0) - 0.02) and np.all(now < of.max(axis=0) + 0.02)
        assert np.abs(now - last).max() < 0.15
        between, last = between + bool(slot["between"]), now
    assert between > 5000 and last == pytest.approx(of[-1], abs=0.02)


def energy_across(string: Played) -> float:
    """Energy (J) of v, by the invariant of eq. 12."""
    slot = slot_of(string)
    op, n = string.ops[int(slot["fret"])], int(slot["v_active"])
    q, p = (modal_row(slot["v"], row)[:n] for row in ("q", "p"))
    kappa, omega = (slot["v"][row][:n] for row in ("kappa", "omega"))
    return float(p @ p + (kappa * omega * q) @ (kappa * omega * q)) / (2 * float(op["weight"]))


@pytest.mark.parametrize("resistance", [1e-3, 0.1, 3.0, 100.0, 1e5])
@pytest.mark.parametrize("places", [(0.2,), (0.05, 0.06, 0.061, 0.3)])
def test_fingers_only_take_from_v(places: tuple[float, ...], resistance: float) -> None:
    """Though they are fitted to the modes of u."""
    string, maximum = pluck("jazz-finger" + YIELDS, 1, 0), np.inf
    string.let_ring(0.01)
    before = energy_across(string)
    touches = [event(TOUCH_EVENT, finger=k, place=x, resistance=resistance, width=4e-3) for k, x in enumerate(places)]
    string.play(np.concatenate(touches))
    for _ in range(3000):
        string.play(NONE)
        now = energy_across(string)
        assert now <= (1 + 1e-12) * maximum
        maximum = min(maximum, now)
    assert maximum < before
    assert slot_of(string)["v_active"] > 0


# Sensed by displacement, one sensor of u and one of v


def sense(level: float, raw: bool, before: int = 1000, after: int = 1000) -> tuple[Floats, Floats, Played]:
    """Output, and v if `raw`, (before + after,) each, of a string of the paper's bass: a pluck, then a hammer-on."""
    string = Played("paper-bass", 1)
    string.record["across"][0], string.record["raw"] = level, raw
    place = 0.7 * float(string.ops[0]["length"])
    pluck = event(PLUCK, apex=1e-5, place=place, width=5e-3, seconds=1e-4, angle=0.9)
    hammer = event(HAMMER, 5, speed=1.0)
    hammer["frame"] = before
    out, across = np.zeros((2, before + after))
    play_frames(string.voice, string.ops, np.concatenate([pluck, hammer]), out, across)
    return out, across, string


@pytest.mark.parametrize("level", [0.0, 0.6, -2.0])
def test_output_of_sensors_is_u_and_v_at_its_level(level: float) -> None:
    u, v, _ = sense(level, raw=True)
    heard, _, string = sense(level, raw=False)
    assert np.abs(v[:1000]).max() > np.abs(u[:1000]).max() > 1e-7
    r = string.record
    signal = lfilter([1.0, -1.0], [1.0, -float(r["block"])], lfilter(r["b"], r["a"], u + level * v))
    assert np.abs(heard - float(r["gain"]) * signal).max() < 1e-12 * np.abs(signal).max()


def test_the_sensor_of_u_does_not_jump_when_a_finger_comes_down() -> None:
    """It senses the string from its line of rest, which changes at that moment."""
    u, _, string = sense(0.0, raw=True, after=10)
    line = float(string.record["saddle"][0] / string.ops[5]["length"] * slot_of(string)["offset"])
    assert abs(line) > 5e-6
    assert np.abs(np.diff(u[-20:])).max() < 0.02 * abs(line)
