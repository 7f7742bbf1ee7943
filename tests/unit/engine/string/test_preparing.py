"""The kernels' prepared rows and coil filter match the physics in numpy.

Mode shapes at obstacles are taken at grid points: sin(pi j k / N) of integers j k. model.modes.shapes cannot do this,
as a place in metres is rounded.
"""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest
from support.circuit import digital
from support.own_basses import load_preset

from livebass.engine.image import image
from livebass.engine.prepare import Note, Pool, Rates, coil_filter, operators, pickups_under, whole_contact_rate
from livebass.kernels.bass.instrument import COARSE, LIVE
from livebass.kernels.string import operators as rows
from livebass.kernels.string.preparing import FADE_FROM, FADE_TO, SAMPLED, SENSORS
from livebass.kernels.string.records import BLOCK, MAX_NEAR
from livebass.model.instrument import Coil, Output, Speaking, for_modes, speaking
from livebass.model.modes import carried_modes, dampings, dampings_alone, exchange, frequencies, shapes
from livebass.model.neck import Admittance, Resonance
from livebass.model.quality import QUALITIES, Quality, modes_for
from livebass.model.trial import Trial
from livebass.rows.arrays import Floats
from tests.support.played import made_of
from tests.support.strings import g_neck, g_string, paper_g, random_trial, with_own_across

SINGLE = 2.0**-24  # relative error of rounding to float32


def row(pool: Pool, address: int, count: int) -> Floats:
    """`count` float64 of the pool at an address."""
    first = (int(address) - pool.memory.ctypes.data) // rows.DOUBLE
    assert 0 <= first <= first + count <= len(pool.memory)
    return pool.memory[first : first + count]


def mixed_rows(pool: Pool, op: np.void, address: int, count: int) -> Floats:
    """`count` rows of modes at an address, (count, padded): op["split"] of each are float64, the rest float32."""
    split, n = int(op["split"]), int(op["padded"])
    words = split + (n - split) // 2
    made = row(pool, address, count * words).reshape(count, words)
    return np.hstack([made[:, :split], np.ascontiguousarray(made[:, split:]).view(np.float32).astype(float)])


def assert_mixed(made: Floats, wanted: Floats, op: np.void, within: float, name: str) -> None:
    """`assert_same` for rows of modes, (..., modes): rounded to float32 from op["split"] on."""
    assert made.shape == wanted.shape, name
    rounded = np.where(np.arange(wanted.shape[-1]) < int(op["split"]), 0.0, SINGLE * np.abs(wanted))
    error = np.maximum(np.abs(made - wanted) - rounded, 0.0)
    assert error.max(initial=0.0) <= within * np.abs(wanted).max(initial=0.0), f"{name}: {error.max():.1e}"


def assert_same(made: Floats, wanted: Floats, within: float, name: str) -> None:
    """Fails if a number differs by more than `within` of the largest."""
    assert made.shape == wanted.shape, name
    if wanted.size:
        error = np.abs(made - wanted).max() / max(np.abs(wanted).max(), 1e-300)
        assert error <= within, f"{name}: {error:.1e} of the largest, allowed {within:.1e}"


def shapes_on_grid(s: Speaking, count: int) -> Floats:
    """phi_j at the contact points, (points, count)."""
    n, j = s.grid_points, np.arange(1, count + 1)
    k = np.rint(np.asarray(s.contact_position) / s.step).astype(np.int64)
    return np.asarray(np.sqrt(2 / s.length) * np.sin(np.pi * (np.outer(k, j) % (2 * n)) / n))


def fade(s: Speaking, count: int, rate: int) -> Floats:
    """Weights of the modes in the output, (count,); modes above the audio band have none."""
    low, high = FADE_FROM * rate, FADE_TO * rate
    nu = frequencies(s, count)
    return np.where(nu >= high, 0.0, 0.5 + 0.5 * np.cos(np.pi * np.clip((nu - low) / (high - low), 0, 1)))


def assert_coefficients(
    pool: Pool, op: np.void, s: Speaking, rates: Rates, across: bool = False, lossless: bool = False
) -> None:
    """Fails if the coefficients of the modes of u, or of v, if `across`, differ from those in numpy."""
    n, count, dt = int(op["padded"]), int(op["modes"]), 1 / rates.contact_rate
    sigma = np.zeros(count) if lossless else dampings_alone(s, count, across)
    omega = np.sqrt((2 * np.pi * frequencies(s, count, across=across)) ** 2 - sigma**2)
    es = np.exp(-sigma * dt) * np.sin(omega * dt)
    steps = rates.numerator // rates.denominator
    wanted = {
        rows.KEPT: np.exp(-2 * sigma * dt),
        rows.SPRING: np.expm1(-sigma * dt) ** 2 + 4 * np.exp(-sigma * dt) * np.sin(omega * dt / 2) ** 2,
        rows.PACE: omega / es,
    }
    leaps = 3 if rates.denominator > 1 else 2 if op["parts"] else 1  # no more than the rates need
    for which, k in enumerate([steps, int(op["part_steps"]), steps + 1][:leaps]):
        damp = np.exp(-sigma * k * dt)
        wanted[rows.LEAPS + 3 * which] = damp * np.cos(omega * k * dt)
        wanted[rows.LEAPS + 3 * which + 1] = damp * np.sin(omega * k * dt) / es
        wanted[rows.LEAPS + 3 * which + 2] = damp * np.sin(omega * k * dt) * es
    assert int(op["leaps"]) == leaps and sorted(wanted) == list(range(rows.LEAPS + 3 * leaps))
    wide = {rows.KAPPA: es / omega, rows.OMEGA: omega, rows.SIGMA: sigma}
    assert sorted(wide) == list(range(rows.WIDE_ROWS))
    address = int(op["coefficients_v" if across else "coefficients"])
    coefficients = row(pool, address, rows.WIDE_ROWS * n).reshape(-1, n)
    mixed = mixed_rows(pool, op, address + coefficients.nbytes, len(wanted))
    rest = np.zeros(rows.WIDE_ROWS)
    rest[[rows.KAPPA, rows.OMEGA]] = 1.0
    assert (coefficients[:, count:] == rest[:, None]).all() and (mixed[rows.KEPT, count:] == 1).all()
    assert not np.delete(mixed, rows.KEPT, axis=0)[:, count:].any()
    for k, numbers in wide.items():
        assert_same(coefficients[k, :count], numbers, 1e-13, f"coefficients {k}, across: {across}")
    for k, numbers in wanted.items():
        assert_mixed(mixed[k, :count], numbers, op, 1e-13, f"mixed {k}, across: {across}")


def assert_operator(pool: Pool, op: np.void, s: Speaking, count: int, rates: Rates, lossless: bool = False) -> None:
    """Fails if coefficients, contact points, mode shapes, W or R differ from numpy's."""
    n, points, dt = -(-count // BLOCK) * BLOCK, len(s.contact_position), 1 / rates.contact_rate
    assert (op["modes"], op["padded"], op["points"]) == (count, n, points)
    assert op["diagonal"] == (count == s.grid_points - 1)
    steps = rates.numerator // rates.denominator
    assert (op["coefficients_v"] != op["coefficients"]) == s.own_across
    for across in (False, True):
        assert_coefficients(pool, op, s, rates, across, lossless)
    if s.own_across and s.axes_turned:
        rate, more = exchange(s, int(op["turned"]))
        wanted = np.array([rate, more[:, 0, 0], more[:, 1, 1], more[:, 0, 1]])
        wanted[1:] *= not lossless
        made = row(pool, op["turning"], wanted.size).reshape(wanted.shape)
        for k in range(len(wanted)):
            assert_same(made[k], wanted[k], 1e-9, f"exchange {k}")
    assert_same(row(pool, op["positions"], points), np.asarray(s.contact_position), 1e-15, "positions")
    assert_same(row(pool, op["heights"], points), np.asarray(s.contact_height), 1e-13, "heights")
    made = mixed_rows(pool, op, op["shapes"], points)
    phi = shapes_on_grid(s, s.grid_points - 1)
    assert_mixed(made[:, :count], phi[:, :count], op, 4e-15, "mode shapes")
    assert not made[:, count:].any()
    if points and points <= MAX_NEAR:
        dx_mu = s.step / s.string.linear_density
        w = dt**2 * dx_mu * made[:, :count] @ made[:, :count].T
        full = 2 * np.pi * frequencies(s, s.grid_points - 1)[count:]
        r = dx_mu * (phi[:, count:] / full**2) @ phi[:, count:].T
        assert_same(row(pool, op["coupling"], points**2).reshape(points, -1), w, 1e-13, "W")
        assert_same(row(pool, op["left_out"], points**2).reshape(points, -1), r, 1e-13, "R")
    scalars = {
        "weight": dt**2 / s.string.linear_density,
        "steps": steps,
        "fine": dt,
        "push": dt**2 * s.step / s.string.linear_density,
        "friction": s.friction,
        "slip": 2 * dt * s.friction_speed,
        "stiffness": s.contact_stiffness,
        "exponent": s.contact_exponent,
        "loss": s.contact_loss / (2 * dt),
        "length": s.length,
        "speed": 2 * s.length * s.fundamental,
        "graze": 2e-3 * s.length,
        "held_stiffness": s.held_stiffness,
    }
    for name, value in scalars.items():
        assert op[name] == pytest.approx(value, rel=1e-15), name
    longest = steps * dt / 5.2e-6
    assert op["parts"] == (min(round(longest), steps // 16) if min(round(longest), steps // 16) >= 2 else 0)
    assert op["part_steps"] == steps // max(int(op["parts"]), 1)


def taps_of(pool: Pool, op: np.void, count: int) -> Floats:
    made = mixed_rows(pool, op, op["taps"], count)
    heard = np.flatnonzero(made.any(axis=0))
    assert op["tap_modes"] == (-(-(int(heard[-1]) + 1) // BLOCK) * BLOCK if heard.size else 0)
    assert not made[:, int(op["modes"]) :].any()
    return made[:, : int(op["modes"])]


def pickup_rows(s: Speaking, output: Output, count: int, rate: int) -> Floats:
    """(pickups, count) weights of modal displacements at each pickup: a Gaussian window for its aperture."""
    k = np.arange(1, count + 1) * (math.pi / s.length)
    rows = [
        shapes(s, count, np.array([s.length - p.position]))[0]
        * np.exp(-((k * p.aperture) ** 2) / 24)
        * fade(s, count, rate)
        for p in pickups_under(output, s.string.name)
    ]
    return np.array(rows).reshape(len(rows), count)


def sensor_rows(s: Speaking, places: list[float], count: int, rate: int) -> Floats:
    """(4, count) weights of q and of P for u at the first of `places` (m from the stop), for v at the second."""
    u, v = shapes(s, count, np.array(places)) * fade(s, count, rate)
    return np.array([u, np.zeros(count), v, np.zeros(count)])


def sampled_rows(trial: Trial, place: float, rates: Rates, across: bool) -> Floats:
    """(2 phases, modes) weights of q and of P at `place` of u, or of v, at each phase of a frame between fine steps."""
    s, count, dt = trial.speaking, trial.modes, 1 / rates.contact_rate
    sigma = np.zeros(count) if trial.lossless else dampings_alone(s, count, across)
    omega = np.sqrt((2 * np.pi * frequencies(s, count, across=across)) ** 2 - sigma**2)
    es, weights = np.exp(-sigma * dt) * np.sin(omega * dt), shapes(s, count, np.array([place]))[0]
    made = []
    for i in range(rates.denominator):
        ahead = (-i * rates.numerator) % rates.denominator / rates.denominator * dt  # s
        growth = np.exp(sigma * ahead) * weights
        made += [growth * np.cos(omega * ahead), -growth * np.sin(omega * ahead) / es]
    return np.array(made)


@pytest.mark.parametrize(
    "preset, quality, rate",
    [
        ("jazz-finger", "live", 48000),
        ("precision-finger", "studio", 44100),
        ("five-string", "live", 96000),
        ("paper-bass", "studio", 48000),
        ("paper-fretless", "live", 44100),
        ("fretless", "live", 48000),
        ("jazz-finger that yields", "live", 48000),
        ("paper-bass that yields", "live", 44100),
        ("fretless that yields", "live", 48000),
        ("jazz-finger with turned axes", "live", 44100),
    ],
)
def test_a_bass_has_the_rows_of_numpy(preset: str, quality: str, rate: int) -> None:
    bass = made_of(preset)
    tier = QUALITIES[quality].for_contact(bass.loss, bass.over_board)
    rates = Rates(rate, whole_contact_rate(tier.contact_rate, rate))
    pool = image(bass, tier).pool(LIVE, rate)
    for i, (string, neck) in enumerate(zip(bass.strings, bass.necks, strict=True)):
        for fret in (0, 1, 7, 20):
            s, op = speaking(string, neck, fret), pool.records[i, fret]
            count = carried_modes(s, modes_for(tier, s.length, string.length, s.grid_points), rates.contact_rate)
            s = for_modes(s, count)
            assert_operator(pool, op, s, count, rates)
            if bass.output.kind == "displacement":
                places = [s.length - bass.output.sensor, s.length - bass.output.sensor_v]
                assert_mixed(taps_of(pool, op, 4), sensor_rows(s, places, count, rate), op, 1e-12, "sensors")
            else:
                wanted = pickup_rows(s, bass.output, count, rate)
                assert_mixed(taps_of(pool, op, len(wanted)), wanted, op, 1e-12, "pickups")


def test_the_pool_is_as_long_as_modes_and_points() -> None:
    """Strings share shapes, and there are no leaps that the rates do not need; a v of its own has rows too."""
    bass = load_preset("jazz-finger")
    made = image(bass, QUALITIES["live"], Quality("coarse", 150, 192e3))
    fine, coarse = made.pool(LIVE, 48000), made.pool(COARSE, 48000)
    assert sum(pool.records.nbytes + pool.memory.nbytes for pool in (fine, coarse)) < 6e6
    assert (fine.records["shapes"] == fine.records["shapes"][0]).all()
    ends = np.sort(fine.records["coefficients"], axis=None)
    assert (ends % 64 == 0).all()
    assert 0 < ends[0] - fine.memory.ctypes.data < 1e6 and np.diff(ends).min() > 0


@pytest.mark.parametrize("seed", range(12))
def test_a_trial_has_the_rows_of_numpy(seed: int) -> None:
    """Non-integer ratios of rates, places off the grid, no losses, a neck that yields, a v of its own."""
    trial, rng = random_trial(seed), np.random.default_rng(seed)
    y = Admittance(
        tuple(Resonance(*row) for row in ((40.0, 20.0, 2.0), (210.0, 35.0, 0.7), (1500.0, 50.0, 0.4))[: seed % 4]),
        ((20.0, 1e-3, 2e-4), (300.0, 5e-3, -1e-3), (301.0, 1e-3, 0.0), (9000.0, 2e-3, 1e-4)) if seed % 3 else (),
        1e-4 if seed % 2 else 0.0,
    )
    law = {"paper_law": int(seed % 5 == 0), "inharmonicity": 1e-6, "extra_damping_slope": 1e-4}
    law |= {"relaxation": seed * 1e-3, "relaxation_frequency": 2500.0}
    s = dataclasses.replace(trial.speaking, **law, admittance=y, contact_loss=seed * 7.0)
    if seed % 2:
        across = Admittance((Resonance(60.0, 25.0, 1.3),), tuple((1.7 * f, *y) for f, *y in y.table), 3e-5)
        s = dataclasses.replace(s, own_across=True, admittance_across=across, longer_across=1e-3)
    trial = dataclasses.replace(trial, speaking=s, lossless=seed % 4 == 3, sensor_v=float(rng.uniform(0.01, s.length)))
    rates = Rates(int(trial.output_rate), int(trial.contact_rate))
    assert trial.sensor_v is not None
    note = Note(s, trial.modes, ((trial.sensor,), (trial.sensor_v,)))
    pool = operators([[note]], SAMPLED, rates, lossless=trial.lossless)
    op = pool.records[0, 0]
    assert_operator(pool, op, s, trial.modes, rates, trial.lossless)
    made = taps_of(pool, op, 4 * rates.denominator).reshape(2, -1, trial.modes)
    for mine, place, across in zip(made, (trial.sensor, trial.sensor_v), (False, True), strict=True):
        wanted = sampled_rows(trial, place, rates, across)
        assert_same(mine[::2], wanted[::2], 1e-12, "weights of q")
        assert_same(mine[1::2], wanted[1::2], 1e-12, "weights of P")


@pytest.mark.parametrize("part", [0.0, 1.0, 30.0])
def test_measured_modes_of_v_lose_to_its_own_neck(part: float) -> None:
    """Whatever was measured: the engine's coefficients match the model's."""
    string = dataclasses.replace(
        g_string(), measured_dampings=tuple(part * sigma for sigma in g_string().measured_dampings)
    )
    s = dataclasses.replace(with_own_across(speaking(g_string(), g_neck(), 0)), string=string)
    rates = Rates(48000, 768000)
    pool = operators([[Note(s, 60, ((0.8,), (0.8,)))]], SAMPLED, rates)
    assert_operator(pool, pool.records[0, 0], s, 60, rates, False)
    assert np.all(dampings(s, 34, across=True) != dampings(s, 34))


def test_obstacles_off_the_grid_are_where_they_are() -> None:
    s = paper_g()
    s = dataclasses.replace(s, contact_position=tuple(x + 0.3e-3 for x in s.contact_position))
    pool = operators([[Note(s, 300, ((0.8,), (0.8,)))]], SENSORS, Rates(48000, 768000))
    op = pool.records[0, 0]
    made = row(pool, op["shapes"], 20 * int(op["padded"])).reshape(20, -1)[:, :300]
    phi = shapes(s, s.grid_points - 1, np.asarray(s.contact_position))
    assert_same(made, phi[:, :300], 1e-12, "mode shapes")
    left = phi[:, 300:] / (2 * np.pi * frequencies(s, s.grid_points - 1)[300:]) ** 2 @ phi[:, 300:].T
    r = row(pool, op["left_out"], 400).reshape(20, 20)
    assert_same(r, s.step / s.string.linear_density * left, 1e-12, "R")


@pytest.mark.parametrize("seed", range(8))
def test_a_board_has_its_points_from_end_to_end_and_crowns_where_they_are_nearest(seed: int) -> None:
    """A straight board with ends on the grid, and crowns narrower than a grid step, some above the string."""
    rng, bass = np.random.default_rng(seed), load_preset("fretless")
    s, modes = speaking(bass.strings[0], bass.necks[0], 0), int(rng.integers(60, 400))
    step = s.length / (modes + 1)
    first, last = int(rng.integers(2, 9)), modes - int(rng.integers(1, 20))
    wanted = np.linspace(-1e-3, -3e-3, last - first + 1)
    ends = first * step, last * step
    knots = [(ends[0], wanted[0]), (ends[1], wanted[-1])]
    for k in sorted(rng.choice(np.arange(first + 1, last), 12, replace=False)):
        x, top = (k + rng.choice([-1, 1]) * rng.uniform(0.2, 0.45)) * step, rng.uniform(-0.9e-3, 0.2e-3)
        knots += [(x + side * step, np.interp(x + side * step, ends, wanted[[0, -1]])) for side in (-0.04, 0.04)]
        knots.append((x, top))
        wanted[k - first] = min(top, 0.0)
    board = tuple((float(x), float(h)) for x, h in sorted(knots))
    note = Note(dataclasses.replace(s, surface=board), modes, ((0.8,), (0.8,)))
    pool = operators([[note]], SENSORS, Rates(48000, 960_000), playable=True)
    op = pool.records[0, 0]
    assert (op["modes"], op["points"]) == (modes, last - first + 1)
    assert_same(row(pool, op["positions"], wanted.size), np.arange(first, last + 1) * step, 1e-15, "positions")
    assert_same(row(pool, op["heights"], wanted.size), wanted, 1e-12, "heights")


def test_what_cannot_be_prepared_is_refused() -> None:
    s, taps = paper_g(), ((0.8,), (0.8,))
    for count in (0, s.grid_points):
        with pytest.raises(ValueError, match=f"^modes must be from 1 to 862, not {count}"):
            operators([[Note(s, count, taps)]], SENSORS, Rates(48000, 768000))
    mute = dataclasses.replace(s, extra_damping=1e4)
    with pytest.raises(ValueError, match="above critical"):
        operators([[Note(mute, 100, taps)]], SENSORS, Rates(48000, 768000))
    known = dataclasses.replace(s.string, measured_frequencies=(48000.0,), measured_dampings=())
    still = dataclasses.replace(s, string=known)
    with pytest.raises(ValueError, match="stands still"):
        operators([[Note(still, 1, taps)]], SENSORS, Rates(48000, 96000), lossless=True)


def random_coil(rng: np.random.Generator) -> Coil:
    """A coil that a preset may have; one in three has its tone pot closed, one in three open."""
    limits = ((0.1, 20), (100, 1e5), (1e-11, 1e-8), (1e4, 1e7), (1e4, 1e7), (1e-10, 1e-6))
    parts = (math.exp(rng.uniform(math.log(minimum), math.log(maximum))) for minimum, maximum in limits)
    return Coil(*parts, tone=float(rng.choice([0.0, 1.0, rng.uniform(1e-6, 1)])))


@pytest.mark.parametrize("rate", [22050, 44100, 48000, 96000, 192000])
def test_the_coil_has_the_filter_of_numpy(rate: int) -> None:
    rng = np.random.default_rng(rate)
    for coil in [Coil(), Coil(tone=0.0), *(random_coil(rng) for _ in range(100))]:
        made, wanted = coil_filter(coil, rate), digital(coil, rate)
        assert_same(made[0], wanted[0], 1e-11, f"numerator of {coil}")
        assert_same(made[1], wanted[1], 1e-12, f"denominator of {coil}")
