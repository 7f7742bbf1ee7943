"""Turned axes: u and v exchange energy. The motion is that of the coupled modes, and no exchange adds energy."""

from __future__ import annotations

import ctypes
import dataclasses
from typing import Any

import numpy as np
import pytest
from scipy.linalg import expm
from support.agreement import assert_agree
from support.costs import quick
from support.messages import send_now
from support.motion import free_modes
from support.own_basses import FRETTED, PLAYED, load_preset
from support.played import TURNED, Played, event
from support.strings import case_b, even, far_from_frets, g_neck, g_string, linear, oblique, with_own_across, yielding

from livebass import QUALITIES
from livebass.compiling import jit
from livebass.engine.engine import Engine
from livebass.engine.prepare import Voice, modal_row, play_frames
from livebass.engine.solve import solve_trial
from livebass.kernels.string.frame import operator_at, string_at
from livebass.kernels.string.records import BEND, LOW, PLUCK, THERE
from livebass.kernels.string.turning import along_axis, amplitude_soon, rms_velocity_soon, set_flow
from livebass.lab.reference.solver import solve
from livebass.model import modes
from livebass.model.instrument import Speaking, speaking
from livebass.model.trial import Trial
from livebass.rows.arrays import Floats
from livebass.rows.parts import EXCHANGE_EVERY

MODES = 60
RATE = 48000
FEW = 24  # modes, of a string's lowest


@jit
def lines_along(operator: int, across: bool, omega: Any, sigma: Any) -> None:
    """Fills `omega` (rad/s) and `sigma` (1/s) of an operator's modes along an axis."""
    for j in range(len(omega)):
        omega[j], sigma[j] = along_axis(operator_at(operator), j, across)


@jit
def update_flow(string: int, k: int, operator: int) -> None:
    """Brings the flow of slot `k` of a STRING up to date for an operator."""
    set_flow(string_at(string).voice, string_at(string).slots[k], operator_at(operator))


@jit
def bounds(string: int, k: int, operator: int, frames: int) -> Any:
    """`rms_velocity_soon` and `amplitude_soon` of slot `k` of a STRING."""
    voice, slot, op = string_at(string).voice, string_at(string).slots[k], operator_at(operator)
    return rms_velocity_soon(voice, slot, op, frames), amplitude_soon(voice, slot, op, frames)


def turn(s: Speaking, degrees: float) -> Speaking:
    return dataclasses.replace(with_own_across(s), axes_turned=np.radians(degrees))


def turned_trial(degrees: float, angle: float, duration: float, apex: float = 1e-3, **numbers: Any) -> Trial:
    """A pluck of the paper's G string at `angle` (rad), its axes turned."""
    trial = oblique(case_b(duration=duration, **numbers), angle, apex)
    return dataclasses.replace(trial, speaking=turn(speaking(g_string(), g_neck(3e8), 0), degrees))


def coupled_motion(trial: Trial, t: Floats) -> tuple[Floats, Floats]:
    """u and v at their sensors from the free motion along the axes of the neck."""
    s, n = trial.speaking, trial.modes
    plain = dataclasses.replace(s, axes_turned=0.0)
    c, e = np.cos(s.axes_turned), np.sin(s.axes_turned)
    u = np.cos(trial.pluck.angle) * modes.pluck_amplitudes(s, n, trial.pluck)
    v = np.sin(trial.pluck.angle) * modes.pluck_amplitudes(s, n, trial.pluck, across=True)
    a, b = free_modes(plain, c * u + e * v, t), free_modes(plain, c * v - e * u, t, across=True)
    place = trial.sensor if trial.sensor_v is None else trial.sensor_v
    of_u, of_v = modes.shapes(s, n, np.array([trial.sensor, place]))
    return (c * a - e * b) @ of_u, (e * a + c * b) @ of_v


@pytest.mark.parametrize("degrees", [35.0, -55.0, 90.0])
def test_the_motion_is_that_along_the_axes(degrees: float) -> None:
    """Free motion over several beats; with the axes turned the other way it is another motion."""
    trial = turned_trial(degrees, 0.3, 1.5, modes=MODES)
    motion = solve_trial(trial)
    assert motion.contact_step.size == 0 and motion.across_m is not None
    u, v = coupled_motion(trial, motion.time_s)
    assert np.abs(motion.displacement_m - u).max() < 2e-3 * np.abs(u).max()
    assert np.abs(motion.across_m - v).max() < 2e-3 * np.abs(v).max()
    if degrees != 90.0:
        back = dataclasses.replace(trial, speaking=turn(trial.speaking, -degrees))
        assert np.abs(coupled_motion(back, motion.time_s)[0] - u).max() > 0.1 * np.abs(u).max()


def test_a_pluck_along_an_axis_stays_on_it() -> None:
    """Along axis a, u and v keep their ratio: no beat."""
    trial = turned_trial(35.0, np.radians(35.0), 1.0, modes=MODES)
    motion = solve_trial(dataclasses.replace(trial, sensor_v=trial.sensor))
    assert motion.across_m is not None
    assert np.abs(motion.across_m - np.tan(trial.pluck.angle) * motion.displacement_m).max() < 3e-3 * 1e-3


@pytest.mark.parametrize(("degrees", "angle"), quick([(35.0, 0.0), (35.0, 1.2), (-55.0, 0.4)], [(-55.0, 0.4)]))
def test_brute_force_agrees_where_it_touches(degrees: float, angle: float) -> None:
    """Also at a rate at which samples lie between two fine steps, and where nothing but the exchange moves v."""
    trial = turned_trial(degrees, angle, 0.02, apex=6e-3, contact_rate=4e6)
    assert assert_agree(dataclasses.replace(trial, sensor_v=trial.speaking.length - 0.03), f"{degrees} deg, {angle}")


@pytest.mark.parametrize("lossless", [False, True])
def test_no_exchange_adds_energy(lossless: bool) -> None:
    """Hard contact included. Without losses only friction takes energy, and plucked up hardly any."""
    trial = turned_trial(-55.0, 0.0 if lossless else 0.4, 0.02, apex=6e-3, contact_rate=2e6, lossless=lossless)
    motion = solve(trial, energy_every=16)
    assert motion.contact_step.size > 50 and motion.energy_j is not None
    energy = motion.energy_j / motion.energy_j[0]
    assert np.diff(energy).max() < 1e-11
    assert energy[-1] > (0.9999 if lossless else 0.5)


# On presets that people play


def plucked(preset: str, seconds: float, semitones: float = 0.0, i: int = 0) -> tuple[Voice, np.void]:
    """String `i`, `seconds` after a pluck along axis a, soon bent, clear of its frets; and its operator."""
    bass = even(far_from_frets(load_preset(preset)))
    engine = Engine(bass, QUALITIES["live"], RATE)
    voice, ops = engine.voices[i], engine.pool.records[i]
    pull = event(PLUCK, apex=5e-4, place=0.75, angle=bass.necks[i].axes_turned)
    bend = event(BEND, value=2 ** (semitones / 12))
    bend["frame"] = RATE // 100
    play_frames(voice, ops, np.concatenate([pull, bend]), np.zeros(round(seconds * RATE)))
    return voice, ops[0]


def amplitudes(w: np.void) -> Floats:
    """q - i (dq/dt + sigma q) / omega of the lowest modes of u or v, (FEW,)."""
    q, p, pace = (modal_row(w, name)[:FEW] for name in ("q", "p", "pace"))
    return np.asarray(q - 1j * pace * p / w["omega"][:FEW])


@pytest.mark.parametrize("preset", PLAYED)
@pytest.mark.parametrize("semitones", [2.0, 0.0])
def test_bent_or_not_a_pluck_along_an_axis_stays_on_it(preset: str, semitones: float) -> None:
    """Frequencies and exchange rise together with the tension, so that a bend does not turn the axes."""
    voice, _ = plucked(preset, 0.3, semitones)
    slot = voice.slots[int(voice.record["slot"][0])]
    u, v, turned = amplitudes(slot["u"]), amplitudes(slot["v"]), load_preset(preset).necks[0].axes_turned
    across = np.cos(turned) * v - np.sin(turned) * u
    along = np.abs(np.cos(turned) * u + np.sin(turned) * v)
    loud = along > 0.03 * along.max()
    assert loud.sum() > 3 and (np.abs(across) < 0.01 * along)[loud].all(), (np.abs(across) / along)[loud]


@pytest.mark.parametrize("preset", PLAYED)
def test_a_note_by_midi_moves_along_its_axes_from_its_release_on(preset: str) -> None:
    """No exchange is owed from the time that a finger held the string: the motion of `simulate`, not one 4 ms ahead."""
    bass = linear(even(load_preset(preset)))
    bass = dataclasses.replace(bass, player=dataclasses.replace(bass.player, answering="off"))
    engine, frames = Engine(bass, QUALITIES["live"], RATE), 600 * EXCHANGE_EVERY
    send_now(engine, (0x90, bass.strings[-1].open_note, 80))
    voice, turned = engine.voices[-1], bass.necks[-1].axes_turned
    slot = voice.slots[int(voice.record["slot"][0])]

    def along() -> list[Floats]:
        u, v = amplitudes(slot["u"]), amplitudes(slot["v"])
        return [np.cos(turned) * u + np.sin(turned) * v, np.cos(turned) * v - np.sin(turned) * u]

    while not slot["active"]:
        engine.process(1)
    engine.process(EXCHANGE_EVERY - 1)
    assert slot["fourth"] == 0 == slot["owed"]
    begun = along()
    engine.process(frames)
    while voice.record["left"]:  # the motion is that at the end of a run
        engine.process(1)
        frames += 1
    s = dataclasses.replace(speaking(bass.strings[-1], bass.necks[-1], 0), axes_turned=0.0)
    for found, first, across in zip(along(), begun, (False, True), strict=True):
        sigma = modes.dampings(s, FEW, across=across)
        omega = np.sqrt((2 * np.pi * modes.frequencies(s, FEW, across=across)) ** 2 - sigma**2)
        wanted = first * np.exp((1j * omega - sigma) * frames / RATE)
        assert np.abs(found - wanted).max() < 2e-3 * np.abs(np.concatenate(begun)).max(), across


@pytest.mark.parametrize("preset", PLAYED)
def test_an_exchange_is_exact(preset: str) -> None:
    """It is the exponential of the coupled losses and rates, to the last digits."""
    voice, op = plucked(preset, 0.02)
    slot, n = voice.slots[int(voice.record["slot"][0])], int(op["turned"])
    rows = np.array((ctypes.c_double * (4 * n)).from_address(int(op["turning"]))[:]).reshape(4, n)
    assert n == LOW and np.abs(rows).max(axis=1).min() > 0.1, "all of them count"
    found = [slot["flow"][2 * k] + 1j * slot["flow"][2 * k + 1] for k in range(3)]
    for j, (rate, of_u, of_v, across) in enumerate(rows.T):
        wanted = expm(EXCHANGE_EVERY / RATE * np.array([[-of_u, 1j * rate - across], [1j * rate - across, -of_v]]))
        for k, number in enumerate((wanted[0, 0], wanted[1, 1], wanted[0, 1])):
            assert abs(found[k][j] - number) < 1e-15 + 1e-10 * abs(number.imag), (j, k)


def test_an_exchange_is_exact_far_above_the_rates_of_necks() -> None:
    """With a tenth of the amplitudes exchanged at once: the error is that of the first term that its series leaves."""
    voice, op = plucked(PLAYED[0], 0.02)
    k, n, time = int(voice.record["slot"][0]), int(op["turned"]), EXCHANGE_EVERY / RATE
    rows = np.array((ctypes.c_double * (4 * n)).from_address(int(op["turning"]))[:]).reshape(4, n)
    rows *= 0.1 / np.abs(time * (1j * rows[0] - rows[3])).max()
    made = np.array([op])
    made["turning"] = rows.ctypes.data
    update_flow(voice.string.ctypes.data, k, made.ctypes.data)
    found = [voice.slots[k]["flow"][2 * i] + 1j * voice.slots[k]["flow"][2 * i + 1] for i in range(3)]
    for j, (rate, of_u, of_v, across) in enumerate(rows.T):
        passed = 1j * rate - across
        wanted = expm(time * np.array([[-of_u, passed], [passed, -of_v]]))
        z = abs((of_u - of_v) ** 2 / 4 + passed**2) * time**2
        for row, number in zip(found, (wanted[0, 0], wanted[1, 1], wanted[0, 1]), strict=True):
            assert abs(row[j] - number) < 2e-15 + 1.1 * z**4 / 40320, j


@pytest.mark.parametrize("change", ["turning", "length", "ratio", "fine"])
def test_the_flow_is_up_to_date_and_computed_once(change: str) -> None:
    """Whether other rates come in memory of their own or, in a glide, with another length; bent; at another rate."""
    voice, op = plucked(PLAYED[0], 0.02)
    k, made = int(voice.record["slot"][0]), np.array([op])
    slot, count = voice.slots[k], 4 * int(op["turned"])
    rates = np.array((ctypes.c_double * count).from_address(int(op["turning"]))[:])
    made["turning"] = rates.ctypes.data

    def flow() -> list[Floats]:
        update_flow(voice.string.ctypes.data, k, made.ctypes.data)
        return [slot["flow"].copy(), slot["flow_scale"].copy()]

    before = flow()
    slot["flow"][0, 0] = 7.0
    assert flow()[0][0, 0] == 7.0
    others = 1.1 * rates
    if change == "turning":
        made["turning"] = others.ctypes.data
    elif change == "length":
        rates[:], made["length"] = others, 1.1 * made["length"]
    elif change == "ratio":
        slot["ratio"] *= 1.1
    else:
        made["fine"] *= 1.1
    found = flow()
    slot["flow_key"][:] = 0.0
    for now, fresh in zip(found, flow(), strict=True):
        assert np.array_equal(now, fresh)
    assert not np.allclose(found[0], before[0], rtol=1e-6, atol=0)


@pytest.mark.parametrize("preset", [name for name in FRETTED if name.startswith("slap")])
@pytest.mark.parametrize("key", [28, 33, 31])
def test_nothing_moves_v_while_a_thumb_presses_the_string_straight_down(preset: str, key: int) -> None:
    """An exchange then would put energy into the thumb. Once it is off, the exchanges owed set in."""
    engine = Engine(even(load_preset(preset)), QUALITIES["live"], RATE)
    send_now(engine, (0x90, key, 100))
    voice = engine.voices[0 if key < 33 else 1]
    pressed = 0
    for _ in range(round(0.05 * RATE)):
        engine.process(1)
        slot = voice.slots[int(voice.record["slot"][0])]
        if slot["thumb"]["on"] == THERE:
            pressed += 1
            assert slot["v_active"] == 0 or not np.abs(amplitudes(slot["v"])).any()
    assert pressed > 4e-3 * RATE and np.abs(amplitudes(slot["v"])).max() > 2e-6


@pytest.mark.parametrize("preset", PLAYED)
@pytest.mark.parametrize("degrees", [-55.0, 0.0, 70.0])
def test_the_lines_along_the_axes_are_those_of_the_neck(preset: str, degrees: float) -> None:
    """However they are turned, u, v and their exchange tell the frequencies and dampings of either axis."""
    bass = yielding(even(load_preset(preset)))
    neck = dataclasses.replace(bass.necks[1], axes_turned=np.radians(degrees), stiffness_across=1.7)
    engine = Engine(dataclasses.replace(bass, necks=(neck,) * len(bass.necks)), QUALITIES["live"], RATE)
    fret = 5
    plain = dataclasses.replace(speaking(bass.strings[1], neck, fret), axes_turned=0.0)
    op, omega, sigma = engine.pool.records[1][fret : fret + 1], np.empty(FEW), np.empty(FEW)
    for across in (False, True) if degrees else (False,):
        lines_along(op.ctypes.data, across, omega, sigma)
        damped = modes.dampings(plain, FEW, across=across)
        assert sigma == pytest.approx(damped, rel=1e-6)
        natural = 2 * np.pi * modes.frequencies(plain, FEW, across=across)
        assert omega == pytest.approx(np.sqrt(natural**2 - damped**2), rel=1e-6)


def known(slot: np.void, step: int) -> bool:
    """True if penetrations of either polarisation are known at fine step `step`."""
    return any((slot[name]["solved_at"] == step).any() for name in ("u", "v"))


@pytest.mark.parametrize("preset", PLAYED)
def test_after_an_exchange_the_string_is_elsewhere(preset: str) -> None:
    """So no penetration is known that was solved before it, as on a string that touched its frets and is clear."""
    string, exchanged, solved = Played(preset + TURNED, 0), 0, 0
    string.play(event(PLUCK, apex=6e-3, place=0.2, angle=0.3))
    slot = string.voice.slots[int(string.record["slot"])]
    for _ in range(round(0.03 * RATE)):
        due = int(slot["owed"]) + (int(slot["fourth"]) == EXCHANGE_EVERY - 1)
        string.play(event(PLUCK)[:0])
        step = int(string.record["step"])
        if int(slot["owed"]) < due:
            assert not known(slot, step)
            exchanged += int(slot["due"]) <= step
        solved += known(slot, step)
    assert exchanged > 10 and solved > 10


def velocity_and_amplitude(slot: np.void, length: float) -> Floats:
    """Root mean square velocity (m/s) and sum of modal amplitudes (m^1.5) of u, (2,)."""
    n, u = int(slot["active"]), slot["u"]
    q, p, pace = (modal_row(u, name)[:n] for name in ("q", "p", "pace"))
    omega, sigma, kappa = (u[name][:n] for name in ("omega", "sigma", "kappa"))
    velocity = np.linalg.norm(np.hypot(omega * q, pace * p - sigma * q)) / np.sqrt(length)
    return np.array([velocity, np.hypot(q, p / (kappa * omega)).sum()])


@pytest.mark.parametrize("frames", [240, 2400])
def test_what_v_brings_to_u_soon_is_bounded(frames: int) -> None:
    """By hardly more than comes: after a pluck across the neck, u grows from rest."""
    string = Played("jazz-finger" + TURNED, 0)
    string.play(event(PLUCK, apex=1e-3, place=0.2, angle=np.pi / 2))
    for _ in range(200):
        string.play(event(PLUCK)[:0])
    k, op = int(string.record["slot"]), string.ops[0:1]
    slot, length = string.voice.slots[k], float(op["length"][0])

    def soon(count: int) -> Floats:
        return np.array(bounds(string.voice.string.ctypes.data, k, op.ctypes.data, count))

    bound, begun = soon(frames), velocity_and_amplitude(slot, length)
    slot["owed"] += frames // EXCHANGE_EVERY
    assert np.array_equal(soon(0), bound), "exchanges owed are to come, too"
    slot["owed"] -= frames // EXCHANGE_EVERY
    slot["answer_speed"] = 3e-6
    assert soon(frames)[0] ** 2 == pytest.approx(bound[0] ** 2 + 3e-6 / length), "as are answers"
    slot["answer_speed"] = 0.0
    bound[1] += begun[1]
    for _ in range(frames):
        string.play(event(PLUCK)[:0])
        assert (velocity_and_amplitude(slot, length) <= bound).all()
    assert (velocity_and_amplitude(slot, length) > 0.8 * bound).all()
