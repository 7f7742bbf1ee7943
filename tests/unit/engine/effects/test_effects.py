"""Effects after the DI: convolution against numpy, the compressor's curve, the valve's law, no changed bit when off."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from support.costs import quick
from support.effects import InMemory

from livebass.compiling import jit
from livebass.kernels.effects import chain, compressor, convolution
from livebass.kernels.effects.fourier import fill_turns, transform
from livebass.kernels.effects.records import KNOBS, LATE, PART, TURNS, effects_at

RATE = 44_100


@jit
def record_of(address: int) -> Any:
    return effects_at(address)


@jit
def convolve_part(address: int, sound: Any, place: int) -> None:
    """Convolves frames of float64 in place, without the other effects and without rounding to float32."""
    e = effects_at(address)
    for j in range(len(sound)):
        e.sound[j] = sound[j]
    e.idle = 0
    convolution.convolve(e, place, len(sound))
    for j in range(len(sound)):
        sound[j] = e.sound[j]


class Chain(InMemory):
    """The effects of a bass."""

    def __init__(self, compression: float = 0.0, drive: float = 0.0, response: Any = (), given: int = RATE) -> None:
        super().__init__(RATE, compression, drive, response, given)

    def convolve(self, sound: Any) -> np.ndarray:
        """The response alone, in float64 (n,)."""
        out = np.array(sound, float)
        for at in range(0, len(out), PART):
            convolve_part(self.address, out[at : at + PART], 0)
        return out


def noise(count: int, seed: int = 1) -> np.ndarray:
    return np.random.default_rng(seed).standard_normal(count)


def cabinet(count: int) -> np.ndarray:
    return noise(count, 2) * np.exp(-np.arange(count) / (0.2 * count))


def cuts(count: int, seed: int, maximum: int) -> list[int]:
    """Sizes of blocks, without the last one."""
    sizes = np.random.default_rng(seed).integers(1, maximum, count)
    return sizes[np.cumsum(sizes) < count].tolist()


# --- convolution ---


def test_the_transform_is_that_of_fourier() -> None:
    cosines, sines = np.zeros(PART), np.zeros(PART)
    fill_turns(cosines, sines)
    real, imaginary = noise(TURNS, 3), noise(TURNS, 4)
    exact = np.fft.fft(real + 1j * imaginary)
    transform(real, imaginary, cosines, sines)
    assert np.abs(real + 1j * imaginary - exact).max() < 1e-13 * np.abs(exact).max()


@pytest.mark.parametrize("taps", [1, 2, PART, PART + 1, 2 * PART, 3 * PART - 1, RATE // 2, RATE])
def test_convolution_is_exact_and_has_no_latency(taps: int) -> None:
    response, sound = cabinet(taps), noise(40 * PART)
    exact = np.convolve(sound, response)[: len(sound)]
    found = Chain(response=response).convolve(sound)
    assert np.abs(found - exact).max() < 1e-12 * np.abs(exact).max()


def test_a_response_of_one_sample_changes_nothing() -> None:
    sound = noise(3000).astype(np.float32)
    assert np.array_equal(Chain(response=[1.0]).play(sound), sound)


@pytest.mark.parametrize("given", [22_050, 48_000, 96_000])
def test_a_response_at_another_rate_has_the_same_gain(given: int) -> None:
    """Its frequency response stays the same up to 0.4 of the slower rate, and comes LATE samples of that rate later."""
    t = np.arange(given // 20) / given
    response = np.exp(-t / 4e-3) * np.sin(2 * np.pi * 700 * t) / given * 5000 + (t == 0) * 0.3
    sound = np.zeros(RATE // 4)
    sound[0] = 1.0
    found = Chain(response=response, given=given).convolve(sound)
    late, slower = LATE / min(given, RATE), min(given, RATE)
    for hertz in (0.0, 50.0, 700.0, 2000.0, 0.2 * slower, 0.4 * slower):
        turn = 2j * np.pi * hertz
        wanted = np.sum(response * np.exp(-turn * (t + late)))
        got = np.sum(found * np.exp(-turn * np.arange(len(found)) / RATE))
        assert abs(got - wanted) < 2e-3 * np.abs(response).sum(), hertz


# --- all effects ---

ON: dict[str, dict[str, Any]] = {
    "compressor": {"compression": 0.7},
    "valve": {"drive": 0.6},
    "short": {"response": cabinet(90)},
    "response": {"response": cabinet(9000)},
    "all": {"compression": 0.5, "drive": 0.4, "response": cabinet(3000)},
}


@pytest.mark.parametrize("kind", quick(ON, ["valve", "all"]))
def test_splitting_blocks_changes_nothing(kind: str) -> None:
    sound = 0.3 * noise(20_000).astype(np.float32)
    sound[9000:10_000] = 0.0
    whole = Chain(**ON[kind]).play(sound)
    assert not np.array_equal(whole, sound)
    for maximum in (2, 70, 3000):
        assert np.array_equal(Chain(**ON[kind]).play(sound, cuts(len(sound), maximum, maximum)), whole), maximum


def test_off_is_off() -> None:
    one, sound = Chain(), noise(5000).astype(np.float32)
    assert np.array_equal(one.play(sound), sound) and not one.flags.any()


def test_knobs_that_a_host_moves_change_nothing_before_and_after() -> None:
    """They act, gradually, from the frame where they leave 0 until they are back at 0, however blocks are split."""
    sound, knobs = 0.2 * noise(40_000), np.zeros((KNOBS, 40_000))
    knobs[0, 3000:12_345] = 0.5
    knobs[1, 7000:20_000] = 0.8
    one = Chain()
    out = one.play(sound, knobs=knobs)
    given = sound.astype(np.float32)
    assert np.array_equal(out[:3000], given[:3000]) and np.array_equal(out[-10_000:], given[-10_000:])
    assert set(np.flatnonzero(one.flags)) == set(range(3000, int(np.flatnonzero(one.flags)[-1]) + 1))
    assert 20_000 < np.flatnonzero(one.flags)[-1] < 30_000
    other = Chain()
    assert np.array_equal(other.play(sound, cuts(40_000, 5, 900), knobs), out)
    assert np.array_equal(other.flags, one.flags)
    steps = np.abs(np.diff(Chain().play(np.full(40_000, 0.1), knobs=knobs)))
    assert steps.max() < 2e-3, "a click"


def test_knobs_stand_where_they_are_from_the_first_frame() -> None:
    sound, requested = 0.2 * noise(4000), np.zeros((KNOBS, 4000))
    requested[:2] = [[0.3], [0.6]]
    wanted = Chain(compression=0.3, drive=0.6).play(sound)
    for own in (0.0, 0.9):
        assert np.array_equal(Chain(compression=own).play(sound, knobs=requested), wanted)


@pytest.mark.parametrize("kind", ON)
def test_silence_becomes_silence_and_then_all_is_as_new(kind: str) -> None:
    one = Chain(**ON[kind])
    first = one.play(0.3 * noise(PART))
    settles = int(one.record["settles"]) // PART * PART + 2 * PART
    rest = one.play(np.zeros(settles))
    assert not rest[-PART:].any() and one.record["idle"] == 1
    assert chain.rings(record_of(one.address)) == 0
    again = one.play(0.3 * noise(PART))
    assert np.array_equal(first, again)
    assert not np.array_equal(first, np.zeros(PART))


@pytest.mark.parametrize("kind", ON)
@pytest.mark.parametrize("size", [1e-38, 1.0, 1e6])
def test_whatever_comes_the_sound_is_finite(kind: str, size: float) -> None:
    for sound in (size * noise(5000), np.full(5000, size), np.full(5000, -size)):
        out = Chain(**ON[kind]).play(sound)
        assert np.isfinite(out).all()
        assert not (np.abs(out[out != 0.0]) < np.finfo(np.float32).tiny).any(), "denormal numbers are slow"


# --- compressor ---


def steady(knob: float, level: float) -> float:
    """dB of the output for a steady level (dB of full scale), after 2 s."""
    out = Chain(compression=knob).play(np.full(2 * RATE, 10 ** (level / 20)))
    return 20 * np.log10(float(out[-1]))


@pytest.mark.parametrize("knob", [0.1, 0.5, 1.0])
def test_the_static_curve_of_the_compressor(knob: float) -> None:
    """Its threshold, ratio, knee and make-up gain match the handbook."""
    threshold, slope = -8 - 20 * knob, 5 * knob / (1 + 5 * knob)
    made_up = 0.5 * slope * -threshold if threshold < -3 else 0.0
    for level in (-60.0, threshold - 3.1, threshold + 3.0, -2.0, 0.0):
        over = max(0.0, level - threshold)
        assert steady(knob, level) == pytest.approx(level + made_up - slope * over, abs=1e-3)
    assert steady(knob, threshold) == pytest.approx(threshold + made_up - slope * 6 / 8, abs=1e-3)
    curve = [steady(knob, level) for level in np.arange(-40, 1, 4.0)]
    assert (np.diff(curve) > 0).all(), "louder stays louder"


def test_attack_and_release_of_the_compressor() -> None:
    """The reduction reaches 1 - 1/e of its final value within the attack, and falls to 1/e of it within the release."""
    knob, low, high = 0.5, 10 ** (-60 / 20), 1.0
    sound = np.concatenate([np.full(RATE // 10, low), np.full(RATE, high), np.full(RATE, low)])
    gain = 20 * np.log10(Chain(compression=knob).play(sound) / sound)
    reduction = gain[0] - gain
    rise = np.argmax(reduction[RATE // 10 :] > (1 - np.exp(-1)) * reduction.max()) / RATE
    after = reduction[RATE // 10 + RATE :]
    fall = np.argmax(after < np.exp(-1) * reduction.max()) / RATE
    assert rise == pytest.approx(compressor.ATTACK, rel=0.02)
    assert fall == pytest.approx(compressor.RELEASE + compressor.ATTACK, rel=0.02)
