"""Fretless boards and whole profiles: the engine agrees with brute force, and presets describe them."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np
import pytest
from support.costs import quick
from support.own_basses import load_preset
from support.places import SHARED
from support.scores import busy_score, in_blocks
from support.strings import g_neck, g_string, losing, with_own_across

from livebass import Instrument, PresetError, Quality
from livebass.engine.engine import Engine
from livebass.engine.solve import solve_trial
from livebass.kernels.string import records as at
from livebass.lab.paper import cases as paper_cases
from livebass.lab.reference.solver import solve
from livebass.model.instrument import Pluck, Speaking, for_modes, note_frequency, on_grid, speaking
from livebass.model.modes import grazing_apex
from livebass.model.neck import fretted_surface, height_at
from livebass.model.trial import Trial

COARSE = 160  # grid steps of a string, few for a fast brute force
DATA = SHARED / "fretless_neck.csv"


def fretless(points: int = COARSE, fret: int = 0, above: float = 0.0) -> Speaking:
    """The measured fretless string on a grid of `points` steps, with its board raised by `above` (m)."""
    bass = load_preset("paper-fretless")
    s = on_grid(speaking(bass.strings[0], bass.necks[0], fret), points)
    return dataclasses.replace(s, contact_height=tuple(min(h + above, 0.0) for h in s.contact_height))


def trial(s: Speaking, apex: float, angle: float = 0.0, rate: float = 1e6, duration: float = 0.03) -> Trial:
    pluck = Pluck(apex, 0.74 * s.length, angle=angle)
    return Trial(s, pluck, s.grid_points - 1, rate, 50_000.0, duration, s.length - 9e-3)


def with_v(trial: Trial) -> Trial:
    """`trial` with its own law for v."""
    return dataclasses.replace(trial, speaking=with_own_across(trial.speaking))


CASES = {
    "open": trial(fretless(), 3.6e-3),
    "hard": trial(fretless(), 9e-3),
    "oblique": trial(fretless(), 3.6e-3, 0.8),
    "higher": trial(fretless(above=1e-3), 2e-3, 0.3),
    "stopped": trial(fretless(130, fret=5), 3e-3, 0.2),
    "few points": trial(fretless(60, fret=17), 2e-3),
    "coarse steps": trial(fretless(), 3.6e-3, 0.4, rate=100_000.0),
    "loses": losing(trial(fretless(), 4e-3, 0.4), 1e10, 10.0),
    "soft, loses": losing(trial(fretless(), 9e-3), 3e8, 50.0),
    "loses much": losing(trial(fretless(130, fret=5), 4e-3, 0.3, rate=300_000.0), 1e8, 1000.0),
    "loses, v of its own": with_v(losing(trial(fretless(), 4e-3, 1.1), 1e9, 30.0)),
}


@pytest.mark.parametrize("name", CASES)
def test_the_engine_is_brute_force_over_a_board(name: str) -> None:
    """Contacts are at the same points and steps, and both polarisations agree."""
    requested = CASES[name]
    fast, slow = solve_trial(requested), solve(requested)
    assert slow.contact_step.size > 30 and (len(requested.speaking.contact_fret) > at.MAX_NEAR) == (
        name != "few points"
    )
    assert np.array_equal(fast.contact_step, slow.contact_step)
    assert np.array_equal(fast.contact_index, slow.contact_index)
    assert np.abs(fast.displacement_m - slow.displacement_m).max() < 1e-7 * np.abs(slow.displacement_m).max()
    if requested.pluck.angle:
        assert fast.across_m is not None and slow.across_m is not None
        assert np.abs(fast.across_m - slow.across_m).max() < 1e-8 * np.abs(slow.across_m).max()
        assert np.abs(slow.across_m).max() > 1e-5


@pytest.mark.slow
def test_the_paper_s_resolution_over_its_fretless_board() -> None:
    """Brute force agrees at 8 MHz with 862 modes, over the first set of contacts."""
    requested = dataclasses.replace(paper_cases.CASES["fretless"].trial(), duration=4.2e-3)
    assert len(requested.speaking.contact_position) == 603 and requested.modes == 862
    fast, slow = solve_trial(requested), solve(requested)
    assert slow.contact_step.size > 100
    assert np.array_equal(fast.contact_step, slow.contact_step)
    assert np.array_equal(fast.contact_index, slow.contact_index)
    assert np.abs(fast.displacement_m - slow.displacement_m).max() < 1e-9 * np.abs(slow.displacement_m).max()


@pytest.mark.parametrize(
    ("stiffness", "loss"),
    quick([(1e10, 0.0), (1e10, 10.0), (1e9, 30.0), (3e8, 50.0), (1e8, 1000.0)], always=[(1e10, 0.0), (3e8, 50.0)]),
)
def test_energy_never_rises_over_a_board(stiffness: float, loss: float) -> None:
    """Losses, friction and contact only take energy."""
    motion = solve(losing(trial(fretless(), 4e-3, 0.7), stiffness, loss), energy_every=4)
    assert motion.energy_j is not None and motion.contact_step.size > 20
    assert np.diff(motion.energy_j).max() < 1e-12 * motion.energy_j[0]
    assert motion.energy_j[-1] < 0.99 * motion.energy_j[0]


def test_wood_between_frets_is_only_touched_where_frets_leave_it() -> None:
    """A string moves the same over a profile with high crowns as over the crowns alone; low crowns expose the wood."""
    string, neck = g_string(), g_neck()
    x, h = neck.fret_positions, neck.fret_heights
    hit = {}
    for above in (2e-3, 5e-5):
        surface = fretted_surface(x, h, above, 0.6)
        s = speaking(string, dataclasses.replace(neck, surface=surface), 0)
        assert [f for f in s.contact_fret if f] == list(range(1, 21)) and s.grid_points == 863
        requested = Trial(s, Pluck(3.6e-3, 0.64), 862, 4e6, 50_000.0, 0.015, 0.854)
        motion = solve_trial(requested)
        hit[above] = np.asarray(s.contact_fret)[motion.contact_index]
    crowns = speaking(string, neck, 0)
    alone = solve_trial(Trial(crowns, Pluck(3.6e-3, 0.64), 862, 4e6, 50_000.0, 0.015, 0.854))
    assert hit[2e-3].tolist() == np.asarray(crowns.contact_fret)[alone.contact_index].tolist() and hit[2e-3].all()
    assert (hit[5e-5] == 0).sum() > 10


def test_grids_follow_the_modes_and_the_board() -> None:
    bass = load_preset("paper-fretless")
    s = speaking(bass.strings[0], bass.necks[0], 0)
    assert s.grid_points == 863 and for_modes(s, 862) is s
    coarse = for_modes(s, 399)
    assert coarse.grid_points == 400 and len(coarse.contact_position) == int(0.603 / coarse.step)
    table = np.array(s.surface)
    exact = np.interp(coarse.contact_position, table[:, 0], table[:, 1])
    assert np.abs(np.asarray(coarse.contact_height) - exact).max() < 60e-6
    assert sorted(f for f in coarse.contact_fret if f) == list(range(1, 21))
    for k in (1, 12, 20):
        place = coarse.contact_position[coarse.contact_fret.index(k)]
        assert abs(place - 0.863 * (1 - 2 ** (-k / 12))) <= coarse.step / 2 + 1e-9
    crowns = load_preset("paper-g")
    plain = speaking(crowns.strings[0], crowns.necks[0], 0)
    assert for_modes(plain, 300) is plain


@pytest.mark.parametrize("preset", ["fretless", "paper-fretless"])
def test_a_board_is_as_far_away_on_every_grid(preset: str) -> None:
    """The apex that just grazes the board hardly depends on the number of modes."""
    bass = load_preset(preset)
    for fret in range(20):
        s = speaking(bass.strings[-1], bass.necks[-1], fret)
        exact = grazing_apex(on_grid(s, 5000), 0.74 * s.length)
        for modes in (150, 400, 600, 862):
            grid = for_modes(s, round(modes * s.length / bass.strings[-1].length))
            assert grazing_apex(grid, 0.74 * s.length) == pytest.approx(exact, rel=0.1), (fret, modes)


@pytest.mark.parametrize("modes", [1, 8, 20])
def test_few_modes_leave_a_board_without_points_near_its_end(modes: int) -> None:
    engine = Engine(load_preset("fretless"), Quality("few", modes, 96e3), 48000)
    assert engine.pool.records["points"].min() == 0


@pytest.mark.skipif(not DATA.exists(), reason="published data that lives outside the project")
def test_the_board_is_the_published_one() -> None:
    published = np.genfromtxt(DATA, delimiter=",", names=True)
    bass = load_preset("paper-fretless")
    s = speaking(bass.strings[0], bass.necks[0], 0)
    there = published["height_mm"] > -5
    assert np.abs(np.asarray(s.contact_height) * 1e3 - published["height_mm"][there]).max() < 1.1e-3


def test_the_laboratory_string_meets_its_point_twice_a_period() -> None:
    """Plucked away from its only contact point, the string returns to it within a period and touches nothing else."""
    case = paper_cases.CASES["one-contact"]
    motion = solve_trial(dataclasses.replace(case.trial(), duration=0.05))
    assert motion.contact_step.size > 8 and set(motion.contact_index) == {0}
    period = 1 / 195.7372
    assert motion.contact_time_s[0] < period
    slow = solve(dataclasses.replace(case.trial(), duration=4e-3))
    fast = solve_trial(dataclasses.replace(case.trial(), duration=4e-3))
    assert np.array_equal(fast.contact_step, slow.contact_step) and slow.contact_step.size


# ---- as an instrument


def test_splitting_a_block_changes_nothing_on_a_fretless_bass() -> None:
    score = busy_score()
    whole = in_blocks(score, [10**9], "fretless")
    assert np.abs(whole).max(axis=1).all()
    assert np.array_equal(in_blocks(score, [1000, 1, 63, 64, 65, 7], "fretless"), whole)


def test_a_fretless_note_is_in_tune_where_no_fret_is() -> None:
    bass = load_preset("fretless")
    for string, neck in zip(bass.strings, bass.necks, strict=True):
        for fret in (0, 7, 20):
            s = speaking(string, neck, fret)
            assert s.stop == fret and s.contact_stiffness == neck.contact_stiffness < 1e10
            assert s.fundamental == pytest.approx(note_frequency(string.open_note + fret), rel=5e-3)
            assert min(s.contact_height, default=0) < 0 <= 1e-9 - max(s.contact_height, default=0)


# ---- presets


def make(tmp_path: Path, neck: str) -> Instrument:
    file = tmp_path / "mine.toml"
    file.write_text(
        f'name = "mine"\n[neck]\nscale_length = "34 in"\n{neck}\n[[string]]\nname = "G"\nopen_note = "G2"\n'
        'linear_density = "6.69 g/m"\ndiameter = "1.14 mm"\ninharmonicity = 3.5e-5\n[output]\nkind = "displacement"\n'
    )
    return load_preset(file)


MEASURED = 'profile_positions = ["10 mm", "300 mm", "650 mm"]\nprofile_heights = ["-0.3 mm", "-1.8 mm", "-2.8 mm"]'


def test_boards_by_geometry_and_by_measurement(tmp_path: Path) -> None:
    bowed = make(tmp_path, 'obstacle = "board"\nrelief = "0.4 mm"').necks[0]
    flat = make(tmp_path, 'obstacle = "board"\nrelief = "0 mm"').necks[0]
    plain = make(tmp_path, 'relief = "0.4 mm"').necks[0]
    assert plain.surface == () and bowed.fret_heights == plain.fret_heights
    for x, h in zip(plain.fret_positions, plain.fret_heights, strict=True):
        assert height_at(bowed.surface, x) == pytest.approx(h, abs=1e-7)
    slopes = np.diff([h for _, h in flat.surface]) / np.diff([x for x, _ in flat.surface])
    assert np.ptp(slopes) < 1e-9, "a board without relief is flat"
    measured = make(tmp_path, f'obstacle = "board"\n{MEASURED}').necks[0]
    assert len(measured.surface) == 3 and len(measured.fret_positions) == 20
    assert measured.fret_heights[11] == pytest.approx(-1.8e-3 - 1e-3 * (0.4318 - 0.3) / 0.35, abs=1e-6)
    profile = make(tmp_path, 'obstacle = "profile"\nfret_height = "0.8 mm"\nboard_end = "720 mm"').necks[0]
    assert profile.surface[-1][0] == 0.72
    between = (plain.fret_positions[4] + plain.fret_positions[5]) / 2
    depth = height_at(plain.surface or profile.surface, between)
    assert depth == pytest.approx(np.interp(between, profile.fret_positions, profile.fret_heights) - 0.8e-3, abs=1e-6)


@pytest.mark.parametrize(
    "neck, said",
    [
        ('obstacle = "wood"', "neck.obstacle"),
        ('board_end = "700 mm"', "only if neck.obstacle is profile or board"),
        (MEASURED, "only if neck.obstacle is profile or board"),
        ('obstacle = "board"\nfret_height = "1 mm"', "a board has no frets"),
        ('obstacle = "board"\nlift = {6 = "1 mm"}', "a board has no frets"),
        ('obstacle = "board"\nboard_end = "100 mm"', "before the saddle, 863.6 mm"),
        (f'obstacle = "board"\naction = "2 mm"\n{MEASURED}', "not allowed together with a measured profile"),
        (f'obstacle = "board"\nboard_end = "700 mm"\n{MEASURED}', "not allowed together with a measured profile"),
        (f'obstacle = "profile"\n{MEASURED}', "needs the heights of its crowns"),
        ('obstacle = "board"\nprofile_positions = ["1 mm", "700 mm"]\nprofile_heights = ["-1 mm"]', "one for each"),
        ('obstacle = "board"\nprofile_positions = ["1 mm"]\nprofile_heights = ["-1 mm"]', "1 place; a profile needs"),
        ('obstacle = "board"\nprofile_positions = ["9 mm", "7 mm"]\nprofile_heights = ["-1 mm", "-1 mm"]', "ascend"),
        ('obstacle = "board"\nprofile_positions = ["99 mm", "700 mm"]\nprofile_heights = ["-1 mm", "-1 mm"]', "begin"),
        ('obstacle = "board"\nnut_height = "0.1 mm"', "the board stands"),
    ],
)
def test_a_board_that_cannot_be_is_one_line(tmp_path: Path, neck: str, said: str) -> None:
    with pytest.raises(PresetError, match=said) as error:
        make(tmp_path, neck)
    assert "\n" not in str(error.value) and "mine.toml" in str(error.value)
