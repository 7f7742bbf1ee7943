"""Idle strings that answer on basses that people play: sign and reach by brute force, and the hands that mute them."""

from __future__ import annotations

import ctypes
from collections.abc import Sequence
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from scipy.linalg import expm
from support.coupled import Coupled
from support.levels import db
from support.messages import Message, control, on, send_now
from support.motion import answering_lines, still_modes
from support.own_basses import FRETTED, load_preset
from support.played import event
from support.quiet import ALONE, without_noise
from support.strings import even, linear

from livebass import QUALITIES
from livebass.engine.engine import Engine
from livebass.engine.prepare import Voice, modal_row, play_frames
from livebass.kernels.string import answers
from livebass.kernels.string.answers import EVERY, exchanged, rotate_answers, set_flow
from livebass.kernels.string.records import BLOCK, EVENT, IDLE, MAX_ANSWERS, PLUCK, UNKNOWN
from livebass.model.instrument import speaking
from livebass.rows.arrays import Floats

RATE = 48000


@cache
def prepared(preset: str, free: bool = True, when: str = "always") -> Engine:
    """A bass whose open strings answer; `free` as brute force has it: linear, one direction, clear of the frets."""
    bass = even(load_preset(preset))
    if free:
        bass = linear(bass, axes_turned=0.0, stiffness_across=1.0, longer_across=0.0)
    return Engine(replace(bass, player=replace(bass.player, answering=when)), QUALITIES["live"], RATE)


def complex_answers(voice: Voice, idle: int) -> Floats:
    """`answering_lines` of string `idle`."""
    a = voice.string["answers"][0]
    return np.asarray(answering_lines(voice)[: int(a["count"])][a["string"][: int(a["count"])] == idle])


def both(preset: str, sounding: int, fret: int, idle: int, seconds: float) -> tuple[Floats, Floats]:
    """Answers (modes,) of the engine and of brute force `seconds` after a pluck."""
    engine = prepared(preset).another()
    voice, ops = engine.voices[sounding], engine.pool.records[sounding]
    place = float(ops[fret]["length"]) - 0.15
    pluck = np.concatenate([event(IDLE, value=1 << idle), event(PLUCK, fret, apex=1e-3, place=place)])
    play_frames(voice, ops, pluck, np.zeros(int(voice.record["pull"][0]) + 2))
    u = voice.slots[int(voice.record["slot"][0])]["u"]
    brute = Coupled(engine.instrument, sounding, fret, [idle])
    q, p, pace = (modal_row(u, name)[: brute.modes] for name in ("q", "p", "pace"))
    still = np.zeros(brute.modes), np.zeros(brute.modes)
    wanted = brute.phasors((q, pace * p - u["sigma"][: brute.modes] * q), still, seconds)[0, 0]
    play_frames(voice, ops, np.zeros(0, EVENT), np.zeros(round(seconds * RATE)))
    found = complex_answers(voice, idle)[: brute.modes]
    return found, wanted[: len(found)]


@pytest.mark.parametrize("preset", FRETTED)
@pytest.mark.parametrize(("sounding", "fret", "idle"), [(0, 7, 1), (1, 7, 0), (2, 2, 1)])
def test_strings_answer_in_phase_and_from_afar(preset: str, sounding: int, fret: int, idle: int) -> None:
    """All that is within 20 dB of the loudest answer: its level within 5 dB, its phase within 25 degrees.

    B and its partials on the E string lie 7 Hz and more from those of the A string, which answers all the same.
    """
    found, wanted = both(preset, sounding, fret, idle, 0.5)
    strong = np.abs(wanted) > 0.1 * np.abs(wanted).max()
    both_ways = np.vdot(wanted[strong], found[strong])
    size = [float(np.linalg.norm(answers[strong])) for answers in (found, wanted)]
    assert abs(db(size[0] / size[1])) < 5 and both_ways.real > 0.9 * size[0] * size[1], (size, both_ways)


@pytest.mark.parametrize("preset", FRETTED)
def test_a_pickup_hears_the_speed_of_an_answer(preset: str) -> None:
    """Of q = exp(-sigma t) cos(omega t) that is -sigma q + omega y."""
    for voice in prepared(preset, free=False).voices:
        a = voice.string["answers"][0]
        heard = np.flatnonzero((a["omega"] > 0) & (np.abs(a["of_y"]) > 1e-3 * np.abs(a["of_y"]).max()))
        damped = a["of_q"][heard] / a["of_y"][heard]
        assert heard.size > 20 and np.allclose(damped, -a["sigma"][heard] / a["omega"][heard], rtol=1e-5)


def test_a_sounding_line_turns_fades_and_is_heard_by_both_parts() -> None:
    """q - i y turns by cos + i sin, faded, in a frame; before that a pickup hears a part of q and a part of y."""
    rng, n = np.random.default_rng(1), 5
    a = prepared(FRETTED[0]).another().voices[0].string["answers"].view(np.recarray)[0]
    for name in ("q", "y", "heard_q", "heard_y", "now_cosine", "now_sine"):
        a[name][:n] = rng.uniform(-1.0, 1.0, n)
    line, turn = a.q[:n] - 1j * a.y[:n], a.now_cosine[:n] + 1j * a.now_sine[:n]
    heard = a.heard_q[:n] @ line.real - a.heard_y[:n] @ line.imag
    assert rotate_answers.py_func(a, n) == pytest.approx(heard, rel=1e-5)
    assert np.allclose(a.q[:n] - 1j * a.y[:n], line * turn, rtol=1e-5)


@pytest.mark.parametrize("z", [0.1 + 0.03j, -0.08j, -0.09, 0.06 - 0.08j])
def test_two_lines_exchange_by_the_exact_flow_of_their_coupling(z: complex) -> None:
    """A_j' = G r A_i, A_i' = (G / r) A_j, for a time with G t = z, to the sixth order of a small z."""
    r, lines, flow = 1.7, np.array([0.3 - 0.8j, -0.5 + 0.4j]), np.zeros(8)
    set_flow(flow, z.real, z.imag, r)
    q, y, x, other = exchanged(flow, lines[0].real, lines[0].imag, lines[1].real, lines[1].imag)
    wanted = expm(np.array([[0, z / r], [z * r, 0]])) @ lines
    assert np.allclose([q + 1j * y, x + 1j * other], wanted, rtol=0, atol=2e-7)


@pytest.mark.parametrize("preset", [*FRETTED, "five-string"])
def test_idle_strings_are_linked_where_the_neck_joins_their_lines(preset: str) -> None:
    """Lines of two strings along one axis, by Im G over the difference and both losses: a tenth and more."""
    made, links = prepared(preset, free=False), 0
    listed = []  # of each string, by string, axis and number from the lowest: where its list has that line
    for voice in made.voices:
        a = voice.string["answers"][0]
        keys = [(int(a["string"][g]), int(a["across"][g])) for g in range(int(a["count"]))]
        listed.append({(*key, keys[:g].count(key)): g for g, key in enumerate(keys)})
    for i, voice in enumerate(made.voices):
        a, wanted = voice.string["answers"][0], {}
        lines = {key: g for key, g in listed[i].items() if a["omega"][g] > 0}
        for (t, across, _), g in lines.items():
            op = made.pool.records[t][0]
            admittance = (ctypes.c_double * (2 * int(op["answering"]))).from_address(int(op["answers"]))
            for (other, axis, k), h in lines.items():
                if other <= t or axis != across:
                    continue
                tension = [made.instrument.strings[n].tension / made.instrument.strings[n].length for n in (t, other)]
                pull = -np.sqrt(tension[0] * tension[1]) * admittance[2 * listed[t][other, axis, k] + 1]
                away = abs(a["omega"][g] - a["omega"][h]) + a["sigma"][g] + a["sigma"][h]
                if abs(abs(pull) / away - 0.1) > 1e-3:
                    wanted[min(g, h), max(g, h)] = abs(pull) > 0.1 * away
        found = {(int(g), int(h)) for g, h in a["link_ends"][: int(a["links"])]}
        assert {ends for ends in found if ends in wanted} == {ends for ends, linked in wanted.items() if linked}, i
        assert len(found) == int(a["links"])
        links += len(found)
    assert links > 0


@pytest.mark.parametrize("preset", FRETTED)
def test_hands_that_mute_an_idle_string_are_two_dashpots_and_the_rest_nearby(preset: str) -> None:
    """A mode of shape s loses 3 N s/m s^2 / (mu L) at 17 and 25 % of the string, and 12 /s; resting hands a part."""
    made = prepared(preset, free=False)
    part = made.instrument.player.resting_hand / 3.0
    for i, voice in enumerate(made.voices):
        a = voice.string["answers"][0]
        for t in {*range(len(made.voices))} - {i}:
            lines = np.flatnonzero((a["string"] == t) & (np.arange(MAX_ANSWERS) < a["count"]) & (a["omega"] > 0))
            along = lines[a["across"][lines] == 0]
            string, j = made.instrument.strings[t], np.arange(1, along.size + 1)
            shapes = sum(np.sin(j * np.pi * place) ** 2 for place in (0.17, 0.25))
            rate = 12.0 + 3.0 / (string.linear_density * string.length) * shapes
            assert along.size > 3 and np.allclose(-RATE * np.log(a["muted"][along]), rate, rtol=1e-5)
            assert np.allclose(-RATE * np.log(a["rested"][along]), part * rate, rtol=1e-5, atol=1e-6)


@pytest.mark.parametrize("preset", FRETTED)
def test_hands_mute_the_idle_strings_only_as_they_pass(preset: str) -> None:
    """They take 60 ms to another fret; after that what is left of an answer rings on."""
    engine = prepared(preset, free=False, when="held").another()
    send_now(engine, (0x90, 9, 100), (0x90, 40, 100))
    engine.process(RATE)
    send_now(engine, (0x80, 40, 64), (0x90, 9, 100), (0x90, 41, 100))
    level = []
    for seconds in (0.01, 0.04, 0.03, 0.06):
        engine.process(round(seconds * RATE))
        level.append(db(float(np.linalg.norm(complex_answers(engine.voices[1], 0)))))
    assert level[1] < level[0] - 10 and level[2] > level[1] + 3, np.diff(level)


@cache
def shipped(preset: str, answers: bool) -> Engine:
    bass = without_noise(preset if answers else preset + ALONE)
    return Engine(bass, QUALITIES["live"], RATE)


def levels(preset: str, answers: bool, start: float, messages: Sequence[Message]) -> Floats:
    """dB of partials 1 to 8 of the open G string in 0.1 s from `start` (s) on, after messages at once."""
    engine = shipped(preset, answers).another()
    send_now(engine, *messages)
    engine.process(round(start * RATE))
    heard = engine.process(RATE // 10).sum(axis=0)
    spectrum = np.abs(np.fft.rfft(heard * np.hanning(heard.size), 4 * heard.size))
    width = RATE / (4 * heard.size)
    near = [spectrum[int(0.96 * j * G_HZ / width) : int(1.04 * j * G_HZ / width) + 2].max() for j in range(1, 9)]
    return np.array([db(float(x)) for x in near])


ON_G, PEDAL, G, G_HZ = on(19, 100), control(64, 127), 43, 98.0
PALMS = {"controller": [control(9, 127)], "key": [on(3)], "after": [on(G, 80), control(9, 127)]}
GHOSTS = {"ghost": [on(10)], "left slap": [on(7)]}


@pytest.mark.parametrize("preset", FRETTED)
@pytest.mark.parametrize("how", [*PALMS, *GHOSTS])
@pytest.mark.parametrize("pedal", [False, True])
def test_a_palm_and_a_ghost_note_mute_the_idle_strings(preset: str, how: str, pedal: bool) -> None:
    """A note is as short as on a bass whose strings do not answer; left free, they answer far above it."""
    held = (PALMS | GHOSTS)[how]
    start = 0.8 if how in PALMS else 0.25
    stroke = [] if how == "after" else [on(G, 80)]
    sounds = [levels(preset, answers, start, [*[PEDAL] * pedal, ON_G, *held, *stroke]) for answers in (True, False)]
    assert np.abs(sounds[0] - sounds[1]).max() < 3, sounds


@pytest.mark.parametrize("preset", FRETTED)
def test_a_pickup_hears_a_line_as_far_as_its_axis_points_towards_it(preset: str) -> None:
    """Along a = c u + s v a line moves u by c and v by s, along b by -s and c; pickups hear v in part."""
    made = prepared(preset, free=False)
    turned, across = made.instrument.necks[0].axes_turned, made.instrument.output.pickups[0].across
    wanted = (np.cos(turned) * across - np.sin(turned)) / (np.cos(turned) + np.sin(turned) * across)
    for voice in made.voices:
        a = voice.string["answers"][0]
        heard = np.where(a["omega"] > 0, a["of_y"] / np.maximum(a["omega"], 1), 0)
        for string in np.unique(a["string"][: int(a["count"])]):
            own = np.flatnonzero((a["string"] == string) & (np.arange(MAX_ANSWERS) < a["count"]))
            along, beside = heard[own[a["across"][own] == 0]], heard[own[a["across"][own] == 1]]
            loud = np.abs(along) > 1e-2 * np.abs(along).max()
            assert loud.sum() > 3 and np.allclose(beside[loud] / along[loud], wanted, rtol=1e-4), string


@pytest.mark.parametrize(("preset", "lower", "key"), [("slap as shipped", 0, 52), ("jazz-finger as shipped", 1, 57)])
def test_idle_strings_pass_answers_on_where_their_lines_meet(preset: str, lower: int, key: int) -> None:
    """Partial 4 of a string and 3 of the next, which the G set off: coupled by the neck at the nut, by Im Y."""
    made = prepared(preset, free=False)
    bass = replace(made.instrument, player=replace(made.instrument.player, resting_hand=0.0, palm_resistance=0.0))
    engine = Engine(bass, QUALITIES["live"], RATE)
    send_now(engine, (0x90, 19, 100), (0x90, key, 100))
    engine.process(RATE // 2)
    send_now(engine, (0x80, key, 64))
    engine.process(RATE)
    voice, seconds = engine.voices[3], 3 * EVERY * 128 / RATE
    assert not voice.slots["on"].any()
    a = voice.string["answers"][0]
    first, second = (speaking(bass.strings[i], bass.necks[i], 0) for i in (lower, lower + 1))
    for k in range(2):
        g, h = (np.flatnonzero((a["string"] == lower + i) & (a["across"] == k))[j] for i, j in ((0, 3), (1, 2)))
        nut = first.felt(bool(k)).at(np.array([float(a["omega"][g]) / (2 * np.pi)]))[0].imag
        rate = -1j * nut * np.sqrt(first.tension / first.length * second.tension / second.length)
        r = np.sqrt(a["density"][g] / a["density"][h]) * a["omega"][g] / a["omega"][h]
        own = [complex(-a["sigma"][x], a["omega"][x]) for x in (g, h)]
        free = np.exp(np.array(own) * seconds)
        flow = expm(seconds * np.array([[own[0], rate / r], [rate * r, own[1]]]))
        before = answering_lines(voice)[[g, h]]
        engine.process(round(seconds * RATE))
        found = answering_lines(voice)[[g, h]]
        error = np.abs(found - flow @ before).max()
        assert error < 0.05 * np.abs(before).max() and error < 0.3 * np.abs(found - free * before).max(), (k, error)


def test_the_line_nearest_to_a_frequency_is_found_among_all(monkeypatch: pytest.MonkeyPatch) -> None:
    """Below the lowest and above the highest, too, where no other line is asked for."""
    lines = 2 * np.pi * 55.0 * np.arange(1, 41) * np.sqrt(1 + 1e-4 * np.arange(1, 41) ** 2)

    def line(_slot: object, _op: object, i: int, _across: bool) -> tuple[float, float]:
        assert 0 <= i < lines.size
        return float(lines[i]), 1.0

    monkeypatch.setattr(answers, "sounding_line", line)
    monkeypatch.setattr(answers, "modes_along_axes", lambda _op: lines.size)
    for omega in [0.0, 2 * lines[-1], *np.random.default_rng(1).uniform(0.5 * lines[0], 1.1 * lines[-1], 200)]:
        nearest = int(np.abs(lines - omega).argmin())
        assert answers.nearest_line.py_func(None, None, False, omega) == (nearest, lines[nearest])


@pytest.mark.parametrize("preset", FRETTED)
def test_an_answer_wakes_a_mode_that_had_died(preset: str) -> None:
    """A string of which only the lowest modes move moves higher up, too, when a line there gives it motion."""
    engine = prepared(preset).another()
    voice, ops = engine.voices[0], engine.pool.records[0]
    place = float(ops[7]["length"]) - 0.15
    pluck = np.concatenate([event(IDLE, value=2), event(PLUCK, 7, apex=1e-3, place=place)])
    play_frames(voice, ops, pluck, np.zeros(RATE // 2))
    slot, a = voice.slots[int(voice.record["slot"][0])], voice.string["answers"][0]
    still_modes(slot["u"], BLOCK)
    a["q"], a["y"] = 0.0, 0.0
    play_frames(voice, ops, np.zeros(0, EVENT), np.zeros(RATE // 4))
    assert slot["active"] == BLOCK
    pair = int(np.flatnonzero(a["pair_mode"][: int(a["pairs"])] >= BLOCK)[0])
    line, mode, k = int(a["pair_answer"][pair]), int(a["pair_mode"][pair]), int(voice.record["answering"][0])
    assert a["place"][line] == UNKNOWN
    voice.record["answering"] = k + 1
    a["place"][line], a["line"][k], a["q"][k], a["damped_for"] = k, line, 1e-4, UNKNOWN
    play_frames(voice, ops, np.zeros(0, EVENT), np.zeros(2 * EVERY))
    woken = modal_row(slot["u"], "q")[mode]
    play_frames(voice, ops, np.zeros(0, EVENT), np.zeros(1))
    assert slot["active"] > mode and modal_row(slot["u"], "q")[mode] != woken != 0
