"""The modes that count in the hand-over of a motion to another length, and the sums over them."""

from __future__ import annotations

import numpy as np
import pytest
from support.own_basses import FRETTED
from support.played import Played, event, made_of

from livebass.compiling import jit
from livebass.engine.prepare import modal_row
from livebass.kernels.hands import fretting
from livebass.kernels.string import handover
from livebass.kernels.string.records import BLOCK, LOW, OPERATOR, PLUCK, ROW, WORK
from livebass.model.instrument import speaking
from livebass.rows.arrays import Floats

MODES = 8 * BLOCK
SHORTER = 2 ** (-3 / 12)  # part of the length


@jit
def needed(working, n):
    return handover.needed_modes(working[0], n)


@jit
def all_sums(working, n, operators):
    new = working[2]
    handover.all_sums(working[0], working[1], new.q_before, n, new, working[3], new.p_before, operators[0])


def count(q: Floats, p: Floats) -> int:
    """Number of modes handed over, from weighted displacements `q` and velocities `p`, (MODES,) each."""
    working = np.zeros(1, WORK)
    working["q_before"][0, :MODES], working["p_before"][0, :MODES] = q, p
    return int(needed(working, MODES))


def spectrum(blocks: int, above: float = 0.0) -> Floats:
    """Amplitudes of modes, (MODES,): 1 in the first `blocks` blocks, `above` beyond."""
    return np.where(np.arange(MODES) < blocks * BLOCK, 1.0, above)


@pytest.mark.parametrize("places, speeds", [(5, 1), (1, 5), (3, 3), (8, 2), (2, 8), (0, 4), (4, 0)])
def test_modes_with_displacement_or_velocity_are_handed_over(places: int, speeds: int) -> None:
    assert count(spectrum(places), spectrum(speeds)) == BLOCK * max(places, speeds)


def test_modes_that_have_a_part_in_1e14_are_left_out_and_those_that_have_one_in_1e9_are_not() -> None:
    for few, many in ((1e-14, 1e-9), (0.0, 1e-9), (1e-14, 1.0)):
        assert count(spectrum(3, few), spectrum(2, few)) == 3 * BLOCK
        assert count(spectrum(3, few), spectrum(2, many)) == MODES
        assert count(spectrum(3, many), spectrum(2, few)) == MODES


def test_a_string_at_rest_hands_nothing_over() -> None:
    assert count(np.zeros(MODES), np.zeros(MODES)) == 0


@pytest.mark.parametrize("split, near", [(MODES, 1e-14), (LOW, 1e-6)])
def test_sums_lose_no_digits_to_differences(split: int, near: float) -> None:
    """Each sum, compared to its largest part: in float32 as near as float32 can be."""
    rng, j = np.random.default_rng(4), np.arange(MODES)
    weights = rng.standard_normal((4, MODES)) / (1.0 + j) ** 2
    squares, wanted = (np.pi * (1.0 + j)) ** 2, (np.pi / SHORTER * (1.0 + j)) ** 2
    working, op = np.zeros(4, WORK), np.zeros(1, OPERATOR)
    op["modes"], op["padded"], op["split"] = MODES, MODES, split
    for k, row in enumerate(weights):
        working["q_before" if k % 2 == 0 else "p_before"][k // 2, :MODES] = row
    working["q_before"][2, :MODES], working["p_before"][2, :MODES] = squares, wanted
    all_sums(working, MODES, op)
    for k, row in enumerate(weights):
        parts = row / (wanted[:, None] - squares)
        found = working["q" if k % 2 == 0 else "p"][2 + k // 2, :MODES]
        off = np.abs(found - parts.sum(axis=1)) / np.abs(parts).max(axis=1)
        assert off.max() < near, k


@jit
def corner(working, operators, at, longer):
    handover.fill_corner(working[0].q, working[0].p, operators[at], operators[longer])


@pytest.mark.parametrize("preset", FRETTED)
@pytest.mark.parametrize("fret", [3, 12])
def test_a_string_that_a_finger_held_was_in_balance(preset: str, fret: int) -> None:
    """It is stiff, and one force at the finger holds it: on each mode, in proportion to the shape there."""
    string, count = Played(preset, 0, "reference"), 200
    working, length = np.zeros(1, WORK), float(string.ops[0]["length"])
    corner(working, string.ops, fret, 0)
    string.play(event(PLUCK, apex=1e-4, place=0.7))
    omega = string.voice.slots[int(string.record["slot"])]["u"]["omega"][:count]
    assert omega[-1] > 1.2 * count * omega[0], "it is stiff"
    at_finger = np.sin(np.arange(1, ROW + 1) * np.pi / length * (length - float(string.ops[fret]["length"])))
    shape, clear = working["p"][0], np.abs(at_finger[:count]) > 0.1
    force = (omega**2 * shape[:count] / at_finger[:count])[clear]
    assert np.abs(force / force[0] - 1).max() < 0.03
    assert 0.9 < np.sqrt(2 / length) * at_finger @ shape < 1.0, "for a corner of 1 m"


@jit
def crown(operators, at, s):
    return handover.crown_height(operators[at], s)


@pytest.mark.parametrize("preset", FRETTED)
@pytest.mark.parametrize("fret", [0, 5])
def test_the_obstacle_beside_a_place_is_the_nearest_crown(preset: str, fret: int) -> None:
    string, bass = Played(preset, 0, "reference"), made_of(preset)
    stopped = speaking(bass.strings[0], bass.necks[0], fret)
    x, heights = np.asarray(stopped.contact_position), np.asarray(stopped.contact_height)
    places = np.linspace(0.01, 0.7 * float(string.ops[fret]["length"]), 40)
    wanted = [heights[np.argmin(np.abs(x - place))] for place in places]
    assert [crown(string.ops, fret, s) for s in places] == pytest.approx(wanted, rel=1e-12)
    assert np.ptp(wanted) > 5e-4


@jit
def change(strings, operators, fret):
    fretting.change_fret(strings[0], operators, fret, fretting.GENTLY, 0.0)


def motion_of(string: Played, polarisation: str) -> Floats:
    """Displacement and velocity (m, m/s) of the sounding string's modes, (2, modes), as mode shapes of unit square."""
    slot = string.voice.slots[int(string.record["slot"])]
    row, count = slot[polarisation], int(string.ops[int(slot["fret"])]["modes"])
    q, p, kappa, sigma = (np.array(modal_row(row, name)[:count], np.float64) for name in ("q", "p", "kappa", "sigma"))
    return np.array([q, p / kappa - sigma * q])


def shape_of(motion: Floats, length: float, x: Floats) -> Floats:
    """Displacement and velocity at `x`, m from the stop, (2, points)."""
    j = np.arange(1, motion.shape[1] + 1)
    made: Floats = np.sqrt(2 / length) * motion @ np.sin(np.outer(j, np.pi / length * x))
    return made


@pytest.mark.parametrize("preset", FRETTED)
@pytest.mark.parametrize("fret, to", [(0, 12), (0, 5), (12, 0), (7, 3), (12, 5)])
def test_the_motion_handed_over_is_the_projection_of_the_old_one(preset: str, fret: int, to: int) -> None:
    """A shorter string swings over the line to its stop; a longer one lies still behind the old stop.

    From fret 0 to 12 every mode of the shorter string is one of the longer: these have sums of their own.
    """
    string = Played(preset, 0, "reference")
    string.play(event(PLUCK, apex=3e-4, place=0.3, fret=fret, angle=0.7))
    for _ in range(700):
        string.play(event(PLUCK)[:0])
    old_length, length = (float(string.ops[k]["length"]) for k in (fret, to))
    before = {w: motion_of(string, w) for w in ("u", "v")}
    change(string.voice.string, string.ops, to)
    x, count = np.linspace(0.0, length, 20001), 40
    shapes = np.sqrt(2 / length) * np.sin(np.outer(np.arange(1, count + 1), np.pi / length * x))
    s = old_length - length
    for name, old in before.items():
        wanted = shape_of(old, old_length, np.clip(x + s, 0.0, old_length))
        if s > 0.0:
            wanted -= wanted[:, :1] * (1 - x / length)
        wanted = (wanted[:, None] * shapes).sum(axis=2) * (x[1] - x[0])
        found = motion_of(string, name)[:, :count]
        off = np.abs(found - wanted).max(axis=1) / np.abs(wanted).max(axis=1)
        assert np.all(np.abs(wanted).max(axis=1) > 1e-7) and off.max() < 1e-4, (name, off)


@jit
def let_go(strings, operators, fret, held):
    fretting.change_fret(strings[0], operators, fret, fretting.GENTLY, held)


@pytest.mark.parametrize("preset", FRETTED)
@pytest.mark.parametrize("fret, to", [(5, 0), (12, 5)])
def test_a_string_let_go_begins_where_and_as_fast_as_the_finger_held_it(preset: str, fret: int, to: int) -> None:
    """Up from the crown and across the neck, but for what stiffness rounds off its corner."""
    held_up, held_across, ends = np.array([-2e-4, 0.3]), np.array([1e-4, -0.2]), []
    for held in (1.0, 0.0):
        string = Played(preset, 0, "reference")
        string.play(event(PLUCK, apex=3e-4, place=0.3, fret=fret, angle=0.7))
        for _ in range(700):
            string.play(event(PLUCK)[:0])
        slot = string.slot()
        for stop, (place, speed) in (("stop_u", held_up), ("stop_v", held_across)):
            slot[stop]["place"], slot[stop]["speed"] = place, speed
        length = float(string.ops[to]["length"])
        s = length - float(string.ops[fret]["length"])
        let_go(string.voice.string, string.ops, to, held)
        ends.append([shape_of(motion_of(string, w), length, np.array([s]))[:, 0] for w in ("u", "v")])
    wanted = np.array([held_up + np.array([crown(string.ops, to, s), 0.0]), held_across])
    part = (np.array(ends[0]) - ends[1]) / wanted
    assert (part > 0.9).all() and (part < 1.0).all(), part
