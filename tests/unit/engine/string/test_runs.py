"""Many frames at once: as single frames, to the limits of what the ear could tell; and looks ahead."""

from __future__ import annotations

import ctypes

import numpy as np
import pytest
from support.levels import db
from support.live import offline, played_ahead
from support.motion import mode_speeds
from support.own_basses import FRETTED, load_preset
from support.played import RATE, Played, event, single_frames

from livebass.engine.prepare import modal_row, play_frames
from livebass.kernels.string.records import EVENT, HAND, LONG_RUN, PLUCK, QUARTET
from livebass.rows.arrays import Floats

FIRST = RATE // 5  # frames, of a note
NONE = np.zeros(0, EVENT)


def note(string: Played, apex: float, fret: int = 0) -> np.ndarray:
    length = float(string.ops[fret]["length"])
    part = length / float(string.ops[0]["length"])
    return event(PLUCK, fret, apex=part * apex, place=0.8 * length, angle=0.4)


def sound(preset: str, i: int, apex: float, fret: int, singly: bool) -> tuple[Floats, int]:
    """The first frames of a note, and the number of its contacts."""
    string, out = Played(preset, i), np.zeros(FIRST)
    events = note(string, apex, fret)
    if singly:
        events = np.concatenate([events, single_frames(1, FIRST)])
    play_frames(string.voice, string.ops, events, out)
    return out, int(string.record["logged"])


@pytest.mark.parametrize("preset", FRETTED)
@pytest.mark.parametrize(("apex", "maximum", "median"), [(0.4e-3, -60.0, -68.0), (1.5e-3, -45.0, -55.0)])
def test_they_sound_as_single_frames(preset: str, apex: float, maximum: float, median: float) -> None:
    """Clear of the frets down to rounding; on them by what contact makes of it. The string hits them as often."""
    apart = []
    for i in (0, 3):
        for fret in (0, 7):
            (many, hits), (one, wanted) = (sound(preset, i, apex, fret, singly) for singly in (False, True))
            assert not np.array_equal(many, one), "many at once"
            assert abs(hits - wanted) <= 1 and (hits > 0) == (apex > 1e-3)
            apart.append(db(float(np.linalg.norm(many - one) / np.linalg.norm(one))))
    assert max(apart) < maximum and np.median(apart) < median, apart


@pytest.mark.parametrize("preset", FRETTED)
@pytest.mark.parametrize(("i", "fret"), [(0, 5), (3, 0), (1, 12)])
def test_an_ended_note_dies_as_under_three_dashpots_a_finger(preset: str, i: int, fret: int) -> None:
    """One dashpot a finger, every fourth frame: as many dB in 60 ms, within 2 % if stopped, and 5 % if open."""
    levels = []
    for settled in (True, False):
        string = Played(preset, i)
        string.play(note(string, 0.5e-3, fret))
        string.let_ring(0.2)
        string.play(event(HAND, value=90.0))
        string.let_ring(0.03)
        if not settled:
            string.record["touches"]["lifts"] = RATE  # fingers that will lift some time do not lie still
        begin = float(np.linalg.norm(mode_speeds(string.voice, 24)))
        string.let_ring(0.06)
        levels.append(db(float(np.linalg.norm(mode_speeds(string.voice, 24))) / begin))
    one, three = levels
    assert one != three < -20
    assert one / three == pytest.approx(1.0, abs=0.05 if fret == 0 else 0.02)


@pytest.mark.parametrize("preset", FRETTED)
def test_a_string_that_ran_ahead_comes_back_into_the_midst_of_a_run(preset: str) -> None:
    """It sounds as rendered, bit for bit, whichever frame of a run it was saved in."""
    bass, frames = load_preset(preset), 8192
    messages = [(k, 0x90, key, 60) for k, key in enumerate((28, 33, 38, 43))]
    messages += [(3000 + 97 * k, 0xB0, 7, 60 + k) for k in range(40)]
    assert np.array_equal(played_ahead(bass, messages, frames), offline(bass, messages, frames))


def ahead(string: Played, slot: np.void, op: np.void, frames: Floats) -> Floats:
    """Displacements (m) at the contact points so many `frames` ahead of the begin of a quartet, free, (points, n)."""
    u, n = slot["u"], int(op["modes"])
    q, p = (modal_row(u, name)[:n] for name in ("q_before", "p_before"))
    omega, sigma, kappa = u["omega"][:n], u["sigma"][:n], u["kappa"][:n]
    turned = np.exp(np.outer(1j * omega - sigma, frames / RATE))
    amplitude = q - 1j * p / (kappa * omega)
    points = int(op["points"])
    places = np.array((ctypes.c_double * points).from_address(int(op["positions"]))[:])
    waves = np.arange(1, n + 1) * np.pi / float(op["length"])
    shapes = np.sqrt(2 / float(op["length"])) * np.sin(np.outer(places, waves))
    return np.asarray(shapes @ (amplitude[:, None] * turned).real)


@pytest.mark.parametrize("preset", FRETTED)
@pytest.mark.parametrize("apex", [3e-3, 1e-3])
def test_a_look_ahead_never_overlooks_a_contact(preset: str, apex: float) -> None:
    """Where it says that the string is clear, its free motion is, at every quarter of a frame; and it says so often.

    Be it for a long run, or, after a stronger pluck, for a quartet.
    """
    string, clear = Played(preset, 0), {QUARTET: 0, LONG_RUN: 0}
    string.play(note(string, apex))
    for k in range(RATE // 4):
        string.play(NONE)
        slot = string.slot()
        op = string.ops[int(slot["fret"])]
        if string.record["left"] != string.record["length"] - 1:
            continue
        begun = int(string.record["step"]) - int(op["steps"])
        seen, rest = divmod(int(slot["due"]) - begun, int(op["steps"]))
        if rest == 0 and seen in clear and (seen == QUARTET or k % 7 == 0):
            motion = ahead(string, slot, op, np.arange(0, seen, 0.25))
            assert (motion - slot["u"]["height"][: int(op["points"]), None]).min() > 0.0
            clear[seen] += 1
    assert clear[LONG_RUN] > 20 and (clear[QUARTET] > 20 or apex < 2e-3), clear


@pytest.mark.parametrize("preset", FRETTED)
def test_modes_that_turn_by_more_than_a_radian_a_frame_feel_no_tension(preset: str) -> None:
    """The others do: those that turn by less than 2 rad in a quartet as by kicks, the rest in between by their turn."""
    string, begins, ends = Played(preset, 0), 0, []
    string.play(note(string, 0.5e-3))
    while string.record["left"] != QUARTET - 1:
        string.play(NONE)
        begins += 1
    for much in (1e3, 0.0):
        string = Played(preset, 0)
        string.play(note(string, 0.5e-3))
        string.let_ring((begins - 1) / RATE)
        string.record["stretch"] *= much
        string.play(NONE)
        assert string.record["left"] == QUARTET - 1
        u = string.slot()["u"]
        ends.append([modal_row(u, name).copy() for name in ("q", "p")])
    n = int(string.ops[0]["modes"])
    turn, kw = u["omega"][:n] / RATE, (u["kappa"] * u["omega"])[:n]
    (q, p), (q_free, p_free) = ([row[:n] for row in end] for end in ends)
    moved = (q != q_free) | (p != p_free)
    assert moved[turn < 0.9].all() and not moved[turn > 1.0].any()
    size, size_free = np.hypot(kw * q, p), np.hypot(kw * q_free, p_free)
    between = (turn < 0.99) & (QUARTET * turn > 2.0) & (size_free > 1e-5 * size_free.max())
    assert size[between] == pytest.approx(size_free[between], rel=1e-3), "a turn keeps the amplitude"
    angle = np.angle((kw * q - 1j * p)[between] / (kw * q_free - 1j * p_free)[between])
    law = np.arange(1, n + 1)[between] ** 2 / u["omega"][:n][between]
    assert angle == pytest.approx(law * (angle @ law) / (law @ law), rel=0.02) and angle.max() > 1e-4
