"""Measurements of sounds and motions, against closed forms."""

from __future__ import annotations

import numpy as np
import pytest
from support.costs import quick
from support.levels import sine
from support.places import RECORDINGS
from support.ringing import uneven
from support.strings import paper_g, tiny

from livebass.lab.analysis.motion import (
    contact_energy,
    decay_rates,
    energy,
    modal_energies,
    shape_at,
    string_shape,
    t60,
)
from livebass.lab.reference.solver import solve
from livebass.model import modes
from livebass.model.instrument import Pluck, Speaking
from livebass.sound.analysis import (
    PAPER_RATE,
    characteristic_frequencies,
    contactogram,
    fundamental,
    loudness,
    partial,
    relative_variation,
    resample,
    spectrogram,
    spectrogram_db,
)
from livebass.sound.audiofile import read_sound
from livebass.sound.meter import LoudnessMeter

RATE = 48_000


@pytest.fixture(scope="module")
def g_string() -> Speaking:
    return paper_g()


def test_spectrogram_levels() -> None:
    sound = np.concatenate([sine(1500, 0.5), sine(1500, 0.5, amplitude=1e-2), np.zeros(RATE // 2)])
    shown = spectrogram_db(sound, RATE)
    assert shown.level_db.shape == (shown.time_s.size, shown.frequency_hz.size) == spectrogram(sound, RATE).shape
    assert shown.level_db.max() == 0 and shown.level_db.min() == -70
    assert shown.frequency_hz[int(np.argmax(shown.level_db[3]))] == 1500
    for time, level in ((0.2, 0.0), (0.8, -40.0), (1.4, -70.0)):
        frame = int(np.argmin(np.abs(shown.time_s - time)))
        assert shown.level_db[frame].max() == pytest.approx(level, abs=1e-6)
    with pytest.raises(ValueError, match="nothing sounds"):
        spectrogram_db(np.zeros(RATE), RATE)


@pytest.mark.parametrize("rate", [44_100, 48_000, 96_000])
def test_the_characteristic_frequency_at_the_rate_of_the_paper(rate: int) -> None:
    """Two sines, amplitudes 2 and 1: eq. 14 gives (4 nu_1 + nu_2) / 5, whatever the rate of the file."""
    sound = resample(2 * sine(1000, 0.4, rate) + sine(6000, 0.4, rate), rate)
    assert sound.size == pytest.approx(0.4 * PAPER_RATE, abs=1)
    inner = characteristic_frequencies(sound, PAPER_RATE)[2:-3]
    np.testing.assert_allclose(inner, 2000, rtol=2e-3)


def test_contacts_in_sets() -> None:
    seen = contactogram([4e-3, 3.8e-3, 12.5e-3, 13e-3, 20e-3], [0, 11, 3, 4, 1], range(1, 21))
    assert seen.time_s.tolist() == [3.8e-3, 4e-3, 12.5e-3, 13e-3, 20e-3]
    assert seen.fret.tolist() == [12, 1, 4, 5, 2] and np.isnan(seen.release_s).all()
    assert seen.sets().tolist() == [0, 0, 1, 1, 2] and seen.sets(gap=8e-3).tolist() == [0, 0, 1, 1, 1]
    assert contactogram([], [], range(20)).sets().size == 0
    known = contactogram([2e-3, 1e-3], [1, 0], [1, 2], release_s=[3e-3, 4e-3])
    assert known.release_s.tolist() == [4e-3, 3e-3]
    with pytest.raises(ValueError, match=r"2,. times"):
        contactogram([1e-3, 2e-3], [0], range(20))


@pytest.mark.parametrize("frequency", [30.87, 41.2, 98.0, 196.3, 392.0])
def test_the_pitch_of_a_tone(frequency: float) -> None:
    sound = sine(frequency, 0.6) + 0.5 * sine(2 * frequency, 0.6) + 0.7 * sine(3 * frequency, 0.6)
    pitch = fundamental(sound, RATE)
    np.testing.assert_allclose(pitch.frequency_hz, frequency, rtol=2e-4)
    assert pitch.aperiodicity.max() < 0.01


@pytest.mark.parametrize("rate", [44_100, 48_000, 96_000])
@pytest.mark.parametrize(
    "levels_db", [{2: 12}, {2: 20}, {1: -20, 2: 10}, {1: -300, 2: 12}, {3: 20}, {4: 20}, {1: -300}], ids=str
)
def test_a_note_keeps_its_octave_whatever_its_strongest_partial(levels_db: dict[int, float], rate: int) -> None:
    for frequency in (30.87, 41.2, 196.0):
        pitch = fundamental(uneven(frequency, levels_db, 0.25, rate, inharmonicity=4e-4), rate, hop=0.02)
        np.testing.assert_allclose(pitch.frequency_hz, frequency, rtol=0.015)  # upper partials alone are sharp


@pytest.mark.parametrize("levels_db", [{}, {2: 12}, {2: 18}], ids=str)
@pytest.mark.parametrize("glide", [0.5, -0.5])
def test_a_glide_keeps_its_octave(levels_db: dict[int, float], glide: float) -> None:
    pitch = fundamental(uneven(61.7, levels_db, glide=glide), RATE, hop=0.02)
    np.testing.assert_allclose(pitch.frequency_hz, 61.7 * 2 ** (glide * pitch.time_s), rtol=0.02)


@pytest.mark.parametrize("levels_db", [{}, {2: 12}, {2: 20}], ids=str)
def test_a_note_in_noise_keeps_its_octave(levels_db: dict[int, float]) -> None:
    sound = uneven(41.2, levels_db)
    heard = fundamental(sound + 0.01 * np.random.default_rng(2).normal(size=sound.size), RATE, hop=0.02).frequency_hz
    np.testing.assert_allclose(heard[:20], 41.2, rtol=0.01)


def test_a_muted_note_is_not_an_octave_below_where_nothing_repeats() -> None:
    """As its last periods die, any long lag has a dip in the lower partials."""
    note = read_sound(RECORDINGS / "muted-eb.flac", "note", 10.0, (8_000, 400_000))
    for threshold in (0.1, 0.2):
        heard = fundamental(note.samples[:, 0], note.rate, threshold=threshold).frequency_hz
        assert np.nanmin(heard) > 60, threshold
    np.testing.assert_allclose(np.nanmedian(heard), 79.5, rtol=0.01)


def test_a_note_is_not_the_octave_below_that_something_else_whispers() -> None:
    """Hum, or another string that answers, about 30 dB below the fundamental."""
    note = uneven(98.0, {})
    for frequency in (49.0, 50.0, 32.7):
        heard = fundamental(note + sine(frequency, 1.0, RATE, 0.006), RATE, hop=0.02).frequency_hz
        np.testing.assert_allclose(heard[:20], 98.0, rtol=0.01)


def test_loudness_of_tones_and_silence() -> None:
    """The calibration of BS.1770-4: 997 Hz at full scale in one channel is -3.01 LUFS; gates leave silence out."""
    tone = sine(997, 5.0)
    assert loudness(tone, 48_000) == pytest.approx(-3.01, abs=0.06)
    assert loudness(tone / 10, 48_000) == pytest.approx(-23.01, abs=0.06)
    half = np.concatenate([tone, np.zeros(20 * 48_000)])
    assert loudness(half, 48_000) == pytest.approx(loudness(tone, 48_000), abs=0.2)
    assert loudness(np.zeros(48_000), 48_000) == loudness(np.zeros(0), 48_000) == -np.inf
    assert loudness(tone[:4800], 48_000) == pytest.approx(-3.01 - 10 * np.log10(4), abs=0.1), "0.1 s of a block"
    with pytest.raises(ValueError, match="one dimension"):
        loudness(np.zeros((2, 48_000)), 48_000)


@pytest.mark.parametrize(
    ("rate", "seconds"),
    quick([(22_050, 0.5), (22_051, 59.97), (44_100, 60.0), (22_050, 125.37)], [(22_050, 0.5), (22_051, 59.97)]),
)
def test_loudness_in_pieces_is_that_of_the_whole(rate: int, seconds: float) -> None:
    pyloudnorm = pytest.importorskip("pyloudnorm")
    rng, n = np.random.default_rng(3), round(seconds * rate)
    sound = rng.normal(size=n) * np.abs(np.sin(np.arange(n) / rate * 0.7)) ** 3 / 10
    meter, at = LoudnessMeter(rate), 0
    while at < n:
        size = int(rng.integers(1, 3 * rate))
        meter.add(sound[at : at + size].copy())
        at += size
    assert meter.loudness() == pytest.approx(pyloudnorm.Meter(rate).integrated_loudness(sound), abs=1e-9)


def test_a_decaying_partial_beside_another() -> None:
    t = np.arange(9600) / 48_000
    for frequency, decay in ((41.2, 0.5), (98.0, 12.0), (196.0, 3.0)):
        first = 0.3 * np.exp(-decay * t) * np.cos(2 * np.pi * frequency * t + 1)
        second = 0.5 * np.cos(2 * np.pi * 2.001 * frequency * t)
        found, level = partial(first + second, 48_000, frequency * 1.02)
        assert 1200 * np.log2(found / frequency) == pytest.approx(0, abs=0.5)
        assert level == pytest.approx(0.3 * np.exp(-decay * t[-1] / 2), rel=0.05)
    with pytest.raises(ValueError, match="four periods"):
        partial(t, 48_000, 19.0)


def test_the_pitch_of_a_glide_and_of_noise() -> None:
    t = np.arange(RATE) / RATE
    sound = np.sin(2 * np.pi * (98 * t + 3 * (1 - np.exp(-8 * t)) / 8))  # 98 + 3 exp(-8 t) Hz
    pitch = fundamental(sound, RATE, minimum=60)
    expected = 98 + 3 * np.exp(-8 * pitch.time_s)
    np.testing.assert_allclose(pitch.frequency_hz, expected, rtol=1e-3)
    np.testing.assert_allclose(relative_variation(pitch.frequency_hz, 98), expected / 98 - 1, atol=1e-3)
    noise = fundamental(np.random.default_rng(1).normal(size=RATE), RATE)
    assert np.isnan(noise.frequency_hz).mean() > 0.95
    assert np.isnan(fundamental(np.zeros(RATE), RATE).frequency_hz).all()
    for wrong in ({"minimum": 0}, {"minimum": 600}, {"maximum": 20_000}):
        with pytest.raises(ValueError, match="range of the pitch must be"):
            fundamental(sound, RATE, **wrong)
    with pytest.raises(ValueError, match="at least"):
        fundamental(sound[:2000], RATE)


def test_the_shape_of_a_pluck(g_string: Speaking) -> None:
    """With no rounding, a triangle: at its corner (2 / L) sum of sin^2 / k^2 gives the apex."""
    q = modes.pluck_amplitudes(g_string, 20_000, Pluck(3.6e-3, 0.64, 1e-9))
    x = np.array([0.0, 0.32, 0.64, 0.7515, 0.863])
    np.testing.assert_allclose(string_shape(g_string, q, x), [0, 1.8e-3, 3.6e-3, 1.8e-3, 0], atol=1e-6)
    both = string_shape(g_string, np.stack([q, 2 * q]), x)
    np.testing.assert_allclose(both[1], 2 * both[0])


def test_the_shape_later(g_string: Speaking) -> None:
    q, none = modes.pluck_amplitudes(g_string, 200, Pluck(1e-3, 0.64)), np.zeros(200)
    x = np.linspace(0, g_string.length, 50)
    moments = np.array([0.0, 1e-4, 5e-3])
    shape = shape_at(g_string, q, none, moments, x)
    np.testing.assert_allclose(shape[0], string_shape(g_string, q, x))
    step = 1e-7  # released at rest: no velocity, and mu q'' = -mu omega^2 q
    early = shape_at(g_string, q[:5], none[:5], np.array([step]), x)[0]
    force = string_shape(g_string, -((2 * np.pi * modes.frequencies(g_string, 5)) ** 2) * q[:5], x)
    moved = (early - string_shape(g_string, q[:5], x)) / (step**2 / 2)
    np.testing.assert_allclose(moved, force, rtol=1e-2, atol=0.02 * np.abs(force).max())


def test_energy_of_a_triangle(g_string: Speaking) -> None:
    """Without bending, T/2 int u_x^2 = T/2 apex^2 L / (a (L - a)); the modes add up to that plus their bending."""
    s, apex, a = g_string, 1e-3, 0.64
    q = modes.pluck_amplitudes(s, 4000, Pluck(apex, a, 1e-9))
    k = np.arange(1, 4001) * np.pi / s.length
    expected = s.string.tension / 2 * apex**2 * s.length / (a * (s.length - a))
    ideal = s.string.tension / 2 * np.sum((k * q) ** 2)
    assert ideal == pytest.approx(expected, rel=1e-3)
    first = modal_energies(s, q[:34], np.zeros(34))
    omega = 2 * np.pi * modes.frequencies(s, 34)
    np.testing.assert_allclose(first, s.string.linear_density / 2 * (omega * q[:34]) ** 2)
    assert first.sum() < expected
    assert energy(s, q[:34], np.zeros(34)) == pytest.approx(first.sum())  # no fret is touched


def test_the_energy_a_solver_keeps() -> None:
    """The lossless reference solution's own discrete energy equals the energy of its initial amplitudes."""
    trial = tiny(contact_rate=2e6, duration=2e-3, lossless=True)
    motion = solve(trial, energy_every=50)
    assert motion.energy_j is not None
    q = modes.pluck_amplitudes(trial.speaking, trial.modes, trial.pluck)
    assert energy(trial.speaking, q, np.zeros(trial.modes)) == pytest.approx(motion.energy_j[0], rel=1e-3)


def test_contact_energy(g_string: Speaking) -> None:
    """A string pressed 1 um into fret 12 only: K dx / 2.5 * (1 um)^2.5."""
    s = g_string
    where = s.contact_fret.index(12)
    shape = modes.shapes(s, s.grid_points - 1, np.asarray(s.contact_position))
    height = np.asarray(s.contact_height)
    goal = height.copy() + 1e-4
    goal[where] = height[where] - 1e-6
    q = shape.T @ np.linalg.solve(shape @ shape.T, goal)
    expected = s.step * s.contact_stiffness / 2.5 * 1e-6**2.5
    assert contact_energy(s, q) == pytest.approx(expected, rel=1e-6)
    assert contact_energy(s, np.zeros(5)) == 0


def test_decays() -> None:
    t = np.linspace(0, 2, 500)
    sigma = np.array([0.2, 3.0, 40.0])
    energies = np.exp(-2 * np.outer(t, sigma)) * [1e-3, 1e-6, 1e-9]
    np.testing.assert_allclose(decay_rates(t, energies), sigma, rtol=1e-9)
    np.testing.assert_allclose(10 ** (-60 / 20), np.exp(-sigma * t60(sigma)))
    assert t60(0.0) == np.inf and np.isnan(decay_rates(t, np.zeros((500, 1)))).all()
