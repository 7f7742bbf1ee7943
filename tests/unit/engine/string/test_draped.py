"""A string that frets out lies on higher crowns at rest: against brute force from there, and laws of every string."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from support.messages import messages_of
from support.own_basses import load_preset
from support.played import FRETS_OUT, RATE, Played, event, lowered
from support.scores import busy_score, play_in_blocks

from livebass import Instrument, Quality
from livebass.engine.engine import Engine
from livebass.engine.prepare import modal_row
from livebass.engine.solve import solve_trial
from livebass.kernels.string.records import BEND, CUT, EVENT, HAMMER, PLUCK
from livebass.lab.reference.plan import at_rest, make_plan
from livebass.lab.reference.solver import solve
from livebass.model.instrument import Pluck, speaking
from livebass.model.rest import lies_on
from livebass.model.trial import Trial

G, FRET, ON = 3, 9, 20
QUICK = Quality("quick", 150, 384e3)


@cache
def low(action: float = 0.7) -> Instrument:
    """jazz-finger with `action` mm under its E: notes fret out on fret 20."""
    return lowered(load_preset("jazz-finger"), action)


def trial(apex: float, angle: float = 0.0, seconds: float = 0.02, **changed: float) -> Trial:
    bass = low()
    s = replace(speaking(bass.strings[G], bass.necks[G], FRET), **changed)  # type: ignore[arg-type]
    pluck = Pluck(apex, 0.78 * s.length, angle=angle)
    return Trial(s, pluck, s.grid_points - 1, 8e6, RATE, seconds, sensor=s.length - 0.1)


@pytest.mark.parametrize(("apex", "angle"), [(20e-6, 0.0), (0.3e-3, 0.6), (2e-3, 0.6)])
def test_the_engine_finds_the_contacts_of_brute_force_from_rest(apex: float, angle: float) -> None:
    of = trial(apex, angle)
    assert max(of.speaking.contact_height) > 50e-6 and of.speaking.stop == FRET
    ours, theirs = solve_trial(of), solve(of, energy_every=1000)
    assert np.array_equal(ours.contact_step, theirs.contact_step) and ours.contact_step.size
    assert np.array_equal(ours.contact_index, theirs.contact_index)
    assert np.abs(ours.displacement_m - theirs.displacement_m).max() < 1e-12
    assert theirs.energy_j is not None
    assert np.all(np.diff(theirs.energy_j) < 0.0)


def test_without_a_pluck_it_lies_still_where_statics_puts_it() -> None:
    of = trial(1e-12)
    rest, s = at_rest(make_plan(of)), of.speaking
    moved = solve(replace(of, sensor=s.contact_position[-1])).displacement_m
    assert np.ptp(moved) < 1e-10
    assert s.contact_height[-1] - 40e-6 < moved[0] < s.contact_height[-1] - 10e-6, "it presses into the crown"
    string = Played("jazz-finger" + FRETS_OUT, G, "reference")
    string.play(event(PLUCK, FRET, apex=1e-12, place=0.4))
    string.let_ring(0.01)
    q = modal_row(string.slot()["u"], "q")[: of.modes]
    assert np.abs(q - rest[: q.size]).max() < 1e-6 * np.abs(rest).max()


@pytest.mark.parametrize("ratio", [1.0, 1.12])
def test_a_note_that_never_moved_is_over_at_once(ratio: float) -> None:
    """The string lies still in every tuning, so its note ends: modes that the crowns hold would never die."""
    string = Played("jazz-finger" + FRETS_OUT, G)
    string.record["bend"] = string.record["tuned"] = ratio
    string.record["pull"] = 1
    string.play(event(PLUCK, FRET, apex=1e-12, place=0.4))
    string.let_ring(0.5)
    assert not string.slot()["on"] and string.record["still"]


def test_a_choked_note_dies_away_to_silence() -> None:
    string = Played("jazz-finger" + FRETS_OUT, G)
    string.play(event(PLUCK, FRET, apex=2e-3, place=0.4))
    string.let_ring(0.2)
    assert string.slot()["on"] and string.slot()["touching"] > 20
    string.let_ring(20.0)  # across the neck it rings longer: friction stops it like a finger
    assert not string.slot()["on"] and string.record["still"]


def total(string: Played) -> float:
    """Energy (J) of a string and of its contacts."""
    slot = string.slot()
    op, u = string.ops[int(slot["fret"])], slot["u"]
    step = float(op["push"] / op["weight"])  # m, dx: push is dt^2 dx / mu
    eta = np.maximum(np.where(u["solved_at"] == string.record["step"], u["eta"], 0.0)[: int(op["points"])], 0.0)
    alpha = float(op["exponent"])
    return string.energy() + step * float(op["stiffness"]) / (alpha + 1) * float(np.sum(eta ** (alpha + 1)))


def test_hands_that_cut_a_note_take_its_energy_down_to_that_of_rest() -> None:
    """They pull the string to where it lies, not to the line from the pressed fret to the saddle."""
    string, none = Played("jazz-finger" + FRETS_OUT, G, "reference"), np.zeros(0, EVENT)
    string.record["stretch"] = 0.0
    string.play(event(PLUCK, FRET, apex=0.1e-3, place=0.4))
    string.let_ring(0.06)
    string.play(event(CUT))
    before = total(string)
    began, least = before, before
    while string.slot()["on"] and string.frame < RATE // 2:
        string.play(none)
        if string.slot()["on"]:
            least = total(string)
            assert least < before + 1e-4 * began
            before = min(before, least)
    assert not string.slot()["on"]
    rest = Played("jazz-finger" + FRETS_OUT, G, "reference")
    rest.record["stretch"] = 0.0
    rest.play(event(PLUCK, FRET, apex=1e-12, place=0.4))
    rest.let_ring(0.002)
    assert least == pytest.approx(total(rest), rel=1e-3)


def test_a_finger_that_comes_down_presses_the_string_on_the_crown() -> None:
    """Hammered on, the string ends where one plucked there from rest does."""
    string = Played("jazz-finger" + FRETS_OUT, G)
    string.play(event(PLUCK, 0, apex=0.3e-3, place=0.6))
    string.let_ring(0.05)
    string.play(event(HAMMER, FRET, speed=1.0))
    string.let_ring(0.4)
    slot = string.slot()
    crown = string.ops[FRET]["points"] - 1
    assert slot["fret"] == FRET and slot["on"] and not slot["moving"] and slot["sunk"] == 0
    assert slot["u"]["eta"][crown] == pytest.approx(25e-6, abs=5e-6)


def test_it_follows_a_bend() -> None:
    string = Played("jazz-finger" + FRETS_OUT, G)
    string.play(event(PLUCK, FRET, apex=1e-3, place=0.4))
    for value in (1.06, 1.12, 0.9, 1.0):
        string.play(event(BEND, value=value))
        string.let_ring(0.1)
        assert string.record["tuned"] == pytest.approx(value)
    crown = string.ops[FRET]["points"] - 1
    assert string.slot()["u"]["eta"][crown] == pytest.approx(25e-6, abs=5e-6)
    assert string.record["weakened"] == 0


def test_splitting_a_block_anywhere_changes_nothing() -> None:
    score, bass = busy_score(), low(0.55)

    def played(sizes: list[int]) -> np.ndarray:
        return play_in_blocks(Engine(bass, QUICK, score.rate), messages_of(score), score.end_frame, sizes)

    whole = played([10**9])
    assert np.isfinite(whole).all() and np.abs(whole).max(axis=1).all()
    for sizes in ([1] * 1000 + [score.end_frame // 2], [63], [1000, 1, 63, 64, 65, 7]):
        assert np.array_equal(played(sizes), whole), sizes


def test_the_operators_point_that_carries_the_string_is_that_of_statics() -> None:
    bass = low(0.55)
    engine = Engine(bass, QUICK, RATE)
    found = 0
    for i, (string, neck) in enumerate(zip(bass.strings, bass.necks, strict=True)):
        for fret, op in enumerate(engine.pool.records[i]):
            on = lies_on(string, neck, fret)
            assert op["draped"] == (on - fret if on != fret else 0), (string.name, fret)
            found += on != fret
    assert found > 20
