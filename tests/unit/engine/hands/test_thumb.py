"""The thumb: a mass that strikes the string. Against brute force, its energy, and the requirements of a slap."""

from __future__ import annotations

import dataclasses
from itertools import pairwise

import numpy as np
import pytest
from support.costs import slow
from support.modal import third_octaves
from support.own_basses import load_preset
from support.pitch import pitch
from support.played import event
from support.quiet import without_noise
from support.scores import in_blocks
from support.strings import even, paper_g

import livebass
from livebass import QUALITIES, score_of
from livebass.engine.engine import Engine
from livebass.engine.prepare import Pool, Voice, modal_row, play_frames
from livebass.engine.solve import trial_voice
from livebass.kernels.string.records import CONTACT, EVENT, THERE, THROW
from livebass.lab.bench.fidelity import string_alone
from livebass.model import modes
from livebass.model.instrument import Pluck, Speaking, for_modes, note_frequency, speaking
from livebass.model.trial import Trial
from livebass.rows.arrays import Floats

RATE = 48000
MASS, WIDTH, STIFFNESS, LOSS = 0.03, 5e-3, 7e5, 0.35  # SI
LIFTED, LIFT = 3e-3, 1.5  # s, N


def strike(speed: float, place: float, fret: int = 0, **mass: float) -> np.ndarray:
    """The event of a thumb at `speed` m/s, `place` m from the stop, (1,)."""
    thumb = {"mass": MASS, "width": WIDTH, "stiffness": STIFFNESS} | mass
    return event(THROW, fret, speed=speed, place=place, **thumb)


def slap(preset: str = "slap", i: int = 0, **player: float) -> Engine:
    """String `i` of `preset` alone, with an even thumb."""
    bass = even(preset, technique="slap", slapped_strings=len(load_preset(preset).strings), **player)
    return Engine(string_alone(bass, i), QUALITIES["live"], RATE, workers=1)


def note(engine: Engine, velocity: int, seconds: float, fret: int = 0) -> Floats:
    """The sound of one note from rest."""
    engine = engine.another()
    key = engine.instrument.strings[0].open_note + fret
    engine.send(np.array([0]), np.array([[0x90, key, velocity]], np.uint8))
    return engine.process(round(seconds * RATE))[0]


# Against brute force


def brute(trial: Trial, speed: float, place: float) -> Floats:
    """u at the sensor of `trial`, each sample, from eq. 12 at every fine step with all points and the thumb at once."""
    s, count, dt = trial.speaking, trial.modes, 1 / trial.contact_rate
    sigma, natural = modes.dampings(s, count), 2 * np.pi * modes.frequencies(s, count)
    turn = np.sqrt(natural**2 - sigma**2) * dt
    c, ct = 2 * np.exp(-sigma * dt) * np.cos(turn), np.exp(-2 * sigma * dt)
    k = np.arange(1, count + 1) * np.pi / s.length
    thumb = np.sqrt(2 / s.length) * np.sin(k * place) * np.exp(-((k * WIDTH) ** 2) / 2)
    shape = np.vstack([modes.shapes(s, count, np.asarray(s.contact_position)), -thumb])
    points, dx = len(shape) - 1, s.step
    every = modes.shapes(s, s.grid_points - 1, np.asarray(s.contact_position))[:, count:]
    left_out = every / (2 * np.pi * modes.frequencies(s, s.grid_points - 1)[count:])
    push = dt**2 / s.string.linear_density * dx
    give = push * shape @ shape.T
    give[:points, :points] += dx / s.string.linear_density * left_out @ left_out.T
    give[points, points] += dt**2 * dx / MASS
    hard = np.append(np.full(points, s.contact_stiffness), STIFFNESS / dx)
    loss = np.append(np.zeros(points), LOSS / (2 * dt))

    def law(before: Floats, r: Floats, hard: Floats, loss: Floats) -> tuple[Floats, Floats]:
        after, middle = np.maximum(before + r, 0), np.maximum(before + r / 2, 0)
        r = np.where(np.abs(r) < 1e-16, 1e-16, r)
        held = after > 0
        f = hard / 2.5 * (after**2.5 - np.maximum(before, 0) ** 2.5) / r
        slope = (hard * after**1.5 - f) / r
        near = held & (before > 0) & (np.abs(r) < 1e-5 * before)
        f = np.where(near, hard * middle**1.5, f)
        slope = np.where(near, 0.75 * hard * np.sqrt(middle), slope)
        f += loss * hard * middle**1.5 * r
        slope += loss * hard * (middle**1.5 + 0.75 * np.sqrt(middle) * r)
        return np.where(f > 0, f, 0.0), np.where(f > 0, np.maximum(slope, 0), 0.0)

    u, before = np.zeros(count), np.zeros(count)
    z, z_before = 0.0, speed * dt
    height = np.append(np.asarray(s.contact_height), 0.0)
    eta = height.copy()
    eta_before = np.append(np.asarray(s.contact_height), -z_before)
    sensor, out = modes.shapes(s, count, np.array([trial.sensor]))[0], []
    per = round(trial.contact_rate / trial.output_rate)
    for n in range(per * (trial.samples - 1) + 1):
        if n % per == 0:
            out.append(sensor @ u)
        free = c * u - ct * before
        flying = 2 * z - z_before + (dt**2 / MASS * LIFT if n * dt >= LIFTED - dt / 2 else 0.0)
        height[points] = -flying
        wanted = height - shape @ free - eta_before
        at = np.flatnonzero((eta_before + wanted > 0) | (eta_before > 0))
        f = np.zeros(points + 1)
        while at.size:
            r = wanted[at].copy()
            for _ in range(50):
                f[at], slope = law(eta_before[at], r, hard[at], loss[at])
                rest = r - wanted[at] + give[np.ix_(at, at)] @ f[at]
                step = np.linalg.solve(np.eye(at.size) + give[np.ix_(at, at)] * slope, rest)
                r -= step
                if np.abs(step).max() < 1e-17 + 1e-12 * np.abs(r).max():
                    break
            pressed = np.flatnonzero(eta_before + wanted - give @ f > 0)
            if np.isin(pressed, at).all():
                break
            at = np.union1d(at, pressed)
        u, before = free + push * shape.T @ f, u
        z, z_before = flying + dt**2 * dx / MASS * f[points], z
        eta, eta_before = eta_before + wanted - give @ f, eta
    return np.array(out)


def trial_of(
    preset: str, name: str, fret: int, count: int, rate: float, seconds: float, lossless: bool = False
) -> Trial:
    bass = without_noise(preset)
    i = bass.string_index(name)
    s = for_modes(speaking(bass.strings[i], bass.necks[i], fret), count)
    return Trial(s, Pluck(0.0, 0.5), min(count, s.grid_points - 1), rate, RATE, seconds, s.length - 0.15, lossless)


def thumb_voice(trial: Trial) -> tuple[Voice, Pool]:
    """A string for `trial`, and its operator's pool, which must stay alive."""
    state, pool = trial_voice(trial)
    state.record["thumb_loss"] = 0.0 if trial.lossless else LOSS
    return state, pool


@pytest.mark.parametrize(
    ("preset", "name", "fret", "speed", "seconds"),
    [
        ("slap-impulse", "E", 0, 2.0, 0.012),
        slow("slap-impulse", "E", 0, 3.5, 0.1),
        slow("slap-impulse", "A", 5, 1.0, 0.1),
        slow("slap-impulse", "G", 12, 2.0, 0.1),
    ],
)
def test_a_slap_is_that_of_brute_force(preset: str, name: str, fret: int, speed: float, seconds: float) -> None:
    """Brute force has the thumb in every fine step. In a rattle a thousandth more speed makes 1 dB."""
    trial = trial_of(preset, name, fret, 200, 384e3, seconds)
    place = trial.speaking.length - 0.3 * load_preset(preset).strings[0].length
    state, pool = thumb_voice(trial)
    fast = np.zeros(trial.samples)
    play_frames(state, pool.records[0], strike(speed, place), fast)
    exact = brute(trial, speed, place)
    assert state.note()[1] > 10
    first = round(0.01 * RATE)
    error = np.abs(fast - exact)[:first].max() / np.abs(exact).max()
    assert error < 0.01, error
    if seconds >= 0.1:
        levels = [third_octaves(np.gradient(motion), RATE) for motion in (fast, exact)]
        one, other = (np.maximum(level - level.max(), -30.0) for level in levels)
        apart = np.abs(one - other).mean()
        assert apart < 1.5, apart


# Energy


def energy(state: Voice, op: np.void, s: Speaking) -> Floats:
    """Energy of string, obstacles and thumb by the scheme's own invariant, J, (3,)."""
    slot = state.slots[int(state.record["slot"][0])]
    u, t, n = slot["u"], slot["thumb"], int(op["modes"])
    mu, dt = s.string.linear_density, float(op["fine"])
    string = (
        mu / (2 * dt**2) * np.sum(modal_row(u, "p")[:n] ** 2 + (u["kappa"] * u["omega"] * modal_row(u, "q"))[:n] ** 2)
    )
    points = int(op["points"])
    now = (u["solved_at"] == state.record["step"])[:points]
    deep = [np.maximum(u[name][:points][now], 0) for name in ("eta", "eta_before")]
    frets = s.step * s.contact_stiffness / 2.5 * sum(np.sum(eta**2.5) for eta in deep) / 2
    flying = float(t["mass"] * t["speed"] ** 2 / 2 + t["energy"]) if t["on"] == THERE else 0.0
    return np.array([string, frets, flying])


def energies(trial: Trial, speed: float, place: float) -> tuple[Floats, int]:
    """Energy after each frame, (n, 3), and the number of frames with the string pressed on an obstacle."""
    state, pool = thumb_voice(trial)
    ops = pool.records[0]
    thrown, one = strike(speed, place), np.zeros(1)
    values, pressed = [], 0
    for m in range(trial.samples):
        play_frames(state, ops, thrown if m == 0 else thrown[:0], one)
        values.append(energy(state, ops[0], trial.speaking))
        pressed += state.pressed()
    return np.array(values), pressed


def full(seconds: float, lossless: bool) -> tuple[Trial, float]:
    """All modes of a grid over frets, and the thumb's place."""
    s = paper_g()
    trial = Trial(s, Pluck(0.0, 0.5), s.grid_points - 1, 4032e3, RATE, seconds, s.length - 0.15, lossless)
    return trial, 0.7 * s.length


@pytest.mark.parametrize("speed", [1.5, 3.5])
def test_energy_is_constant_without_losses(speed: float) -> None:
    """Until the hand lifts the thumb."""
    trial, place = full(LIFTED - 2 / RATE, True)
    values, pressed = energies(trial, speed, place)
    total = values.sum(axis=1)
    thrown = MASS / 2 * speed**2
    assert (speed < 2 or pressed > 20) and values[:, 0].max() > 0.2 * thrown
    assert np.abs(total / thrown - 1).max() < 3e-5, np.abs(total / thrown - 1).max()
    assert np.diff(total).max() < 1e-8 * thrown, np.diff(total).max() / thrown


@pytest.mark.parametrize("speed", [1.5, 3.5])
def test_energy_never_grows_but_by_the_hand(speed: float) -> None:
    trial, place = full(0.025, False)
    values, pressed = energies(trial, speed, place)
    total, thrown = values.sum(axis=1), MASS / 2 * speed**2
    lifted = round(LIFTED * RATE)
    assert speed < 2 or pressed > 20
    assert np.diff(total[:lifted]).max() < 1e-11 * thrown
    string = values[:, 0] + values[:, 1]
    off = np.flatnonzero(values[:, 2] == 0)
    assert off.size and np.diff(string[off]).max() < 1e-11 * thrown


# Requirements of a slap


@pytest.mark.parametrize("i", range(4))
def test_the_thumb_presses_for_some_milliseconds(i: int) -> None:
    """4 to 8 at a hard slap, longer at a softer one: the design's mass stays for 11 at 1 m/s."""
    engine = slap(i=i)
    for velocity, longest in ((80, 11.0), (100, 9.0), (127, 8.0)):
        e = engine.another()
        e.send(np.array([0]), np.array([[0x90, e.instrument.strings[0].open_note, velocity]], np.uint8))
        voice, last = e.voices[0], 0
        for n in range(round(0.02 * RATE)):
            e.process(1)
            t = voice.slots[int(voice.record["slot"][0])]["thumb"]
            if t["on"] == THERE and t["force"] > 0:
                last = n
        assert 4.0 < last / RATE * 1e3 < longest, (velocity, last / RATE * 1e3)


@pytest.mark.parametrize("velocity", [60, 90, 127])
@pytest.mark.parametrize("i", [0, 1])
def test_the_thumb_of_the_shipped_slap_throws_the_string_onto_the_last_frets(i: int, velocity: int) -> None:
    bass = livebass.load_preset("slap")
    engine, log = Engine(bass, QUALITIES["live"], RATE), np.zeros(1000, CONTACT)
    voice = engine.voices[i]
    voice.record["log"], voice.record["log_room"] = log.ctypes.data, len(log)
    engine.send(np.array([0]), np.array([[0x90, bass.strings[i].open_note, velocity]], np.uint8))
    engine.process(RATE // 10)
    hit = log["point"][: int(voice.record["logged"][0])] + 1  # of an open string: frets
    assert hit[0] == bass.frets, "the last fret first"
    assert set(range(1, hit[0] + 1)) - set(hit) <= {1, 2}, "and the wave runs down the neck"


def test_a_thumb_without_stiffness_is_silent() -> None:
    quiet = [np.abs(note(slap(thumb_stiffness=k), 127, 0.1)).max() for k in (7e5, 7e1, 0.0)]
    assert quiet[0] > 20 * quiet[1] > 0 and quiet[2] == 0


@pytest.mark.parametrize("i", [0, 1])
def test_harder_slaps_are_brighter(i: int) -> None:
    """Energy above 2 kHz within 50 ms grows faster than the square of the MIDI velocity."""
    engine, high, velocities = slap(i=i), [], (60, 127)
    for velocity in velocities:
        sound = note(engine, velocity, 0.05)
        spectrum = np.abs(np.fft.rfft(sound)) ** 2
        high.append(spectrum[np.fft.rfftfreq(sound.size, 1 / RATE) > 2000].sum())
    for (a, b), (x, y) in zip(pairwise(high), pairwise(velocities), strict=True):
        assert b / a > (y / x) ** 2, (b / a, (y / x) ** 2)


@pytest.mark.parametrize("i", [0, 1])
def test_a_slap_settles_at_the_pitch_of_a_pluck(i: int) -> None:
    engine = slap(i=i)
    bass = engine.instrument
    pluck = dataclasses.replace(bass, player=dataclasses.replace(bass.player, technique="pluck", hardest=1.0))
    near = 2 * note_frequency(bass.strings[0].open_note)  # E's first partial is weak
    sounds = [note(e, 110, 3.0)[RATE:] for e in (engine, Engine(pluck, QUALITIES["live"], RATE, workers=1))]
    found = [pitch(sound, RATE, near) for sound in sounds]
    assert abs(1200 * np.log2(found[0] / found[1])) < 3, found


def test_anything_may_strike_anywhere() -> None:
    """Random speeds, places and masses, each interrupting the last: the sound is finite, and it ends."""
    rng = np.random.default_rng(5)
    engine = slap()
    for _ in range(6):
        voice, ops = engine.another().voices[0], engine.pool.records[0]
        events = np.zeros(12, EVENT)
        for k in range(12):
            fret = int(rng.integers(0, 20))
            events[k] = strike(
                10 ** rng.uniform(-3, 1), rng.uniform(0, 1) * ops["length"][fret], fret,
                mass=10 ** rng.uniform(-3, -1), width=10 ** rng.uniform(-3, -1.5), stiffness=10 ** rng.uniform(0, 8),
            )[0]  # fmt: skip
        events["frame"] = np.sort(rng.integers(0, 4000, 12))
        out = np.zeros(24000)
        assert play_frames(voice, ops, events, out) == 12
        assert np.isfinite(out).all() and np.abs(out).max() < 100
        assert not voice.slots["thumb"]["on"][voice.slots["on"] > 0].any()


@pytest.mark.parametrize(("i", "mass"), [(0, 1e-3), (3, 0.03), (0, 0.1)])
@pytest.mark.parametrize(("stiffness", "loss", "width"), [(1e8, 10.0, 50e-3), (7e5, 2.0, 50e-3), (1e8, 0.0, 1e-3)])
def test_any_thumb_of_a_preset_lets_go(i: int, mass: float, stiffness: float, loss: float, width: float) -> None:
    """At the limits of the keys, at 8 m/s: the string has no more energy than the thumb had, and is soon free of it."""
    engine = slap(i=i, thumb_loss=loss)
    voice, ops, none = engine.voices[0], engine.pool.records[0], np.zeros(0, EVENT)
    thrown, one, op = strike(8.0, 0.6, mass=mass, width=width, stiffness=stiffness), np.zeros(1), ops[0]
    for n in range(round(0.07 * RATE)):
        play_frames(voice, ops, thrown if n == 0 else none, one)
        slot = voice.slots[int(voice.record["slot"][0])]
        u, m = slot["u"], int(op["padded"])
        total = float(np.sum(modal_row(u, "p")[:m] ** 2 + (u["kappa"] * u["omega"] * modal_row(u, "q"))[:m] ** 2)) / (
            2 * float(op["weight"])
        )
        lifting = 0.5 * mass * (50 * 0.06) ** 2 + mass * 50 * 0.03  # J, at most, by the hand
        assert total < 1.05 * (0.5 * mass * 8.0**2 + lifting), n
    assert not slot["thumb"]["on"]


@pytest.mark.parametrize("x", [np.nan, np.inf, -1.0, 0.0])
def test_no_thumb_comes_at_no_speed(x: float) -> None:
    engine = slap()
    voice, out = engine.voices[0], np.zeros(4800)
    play_frames(voice, engine.pool.records[0], strike(x, 0.6), out)
    assert not out.any() and not voice.sounding()


def test_blocks_change_nothing_while_a_thumb_presses() -> None:
    """Slaps on sounding strings, on other frets, ended under the thumb, and cut."""
    notes = [(0.0, 0.02, 28, 127), (0.021, 0.003, 28, 100), (0.03, 0.1, 33, 90), (0.05, 0.1, 31, 127)]
    score = score_of(notes, RATE)
    whole = in_blocks(score, [10**9], "slap")
    for sizes in ([1], [64], [7, 63, 100]):
        assert np.array_equal(in_blocks(score, sizes, "slap"), whole), sizes
