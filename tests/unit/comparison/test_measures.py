"""Figures of notes built to have them, and of sounds without any."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import cache

import numpy as np
import pytest
from support.costs import quick

from livebass.lab.comparison import distance, measure
from livebass.lab.comparison.measures import EARLY, FLOOR_KEYS, LATE, SHARE_KEYS
from livebass.lab.comparison.ringing import ringing
from livebass.rows.arrays import Floats

RATE = 44_100
F0 = 65.4
TIME = np.arange(3 * RATE) / RATE


def note(
    f0: float = F0, count: int = 24, t60: float = 8.0, cents: Callable[[Floats], Floats] | None = None,
    level: Callable[[int, Floats], Floats] | None = None, seconds: float = 3.0,
) -> Floats:  # fmt: skip
    """A note of `count` partials, each 2 dB below the last; `cents` by time, `level` by number and time."""
    t = TIME[: round(seconds * RATE)]
    frequency = f0 * 2 ** ((cents(t) if cents else 0 * t) / 1200)
    turns = np.cumsum(frequency) / RATE
    sound = np.zeros(t.size)
    for j in range(1, count + 1):
        strength = 10 ** (-0.1 * (j - 1)) * (level(j, t) if level else 1.0)
        sound += strength * np.sin(2 * math.pi * j * turns + j**2)
    sound *= 10 ** (-3 * t / t60)
    return 0.2 * sound / np.abs(sound).max()


def test_decay_and_levels() -> None:
    """A T60 of 8 s is 7.5 dB a second, in every octave."""
    found = measure(note(), RATE, F0)
    for key in ("t60_50", "t60_100", "t60_200", "t60_400", "t60_800"):
        assert found[key] == pytest.approx(8.0, rel=0.01), key
    assert found["level_1s"] == pytest.approx(-7.5, abs=0.3) and found["level_2s"] == pytest.approx(-15, abs=0.3)
    assert found["t60_scatter"] < 0.01 and found["wobble"] < 0.02
    assert found["peak"] == pytest.approx(20 * math.log10(0.2), abs=0.01)
    assert found.pitch == pytest.approx(F0, rel=1e-4)
    assert math.isnan(found["t60_3200"]) and "no partial" in found.missing["t60_3200"]


@cache
def wide(seconds: float) -> Floats:
    """Partials up to 6 kHz with T60 of 6 s, from 800 Hz on 3 s."""

    def level(j: int, t: Floats) -> Floats:
        return 10 ** (0.06 * (j - 1)) * 10 ** (-3 * t / (6.0 if j * F0 < 800 else 3.0))

    sound = note(count=90, t60=1e9, level=level, seconds=seconds)  # each partial 0.8 dB below the last
    sound.flags.writeable = False
    return sound


def in_noise(floor: float, seed: int, seconds: float = 3.0) -> Floats:
    """`wide`, in white noise `floor` dB below the first of its partials."""
    sound = wide(seconds)
    first = 2 * abs(np.mean(sound[:RATE] * np.exp(-2j * math.pi * F0 * TIME[:RATE])))
    noise = np.random.default_rng(seed).normal(size=sound.size)
    return sound + first * 10 ** (-floor / 20) * noise / math.sqrt(2)


@pytest.mark.parametrize(
    ("floor", "drowned", "seed"),
    quick(
        [(*floor, seed) for floor in ((60.0, 0), (25.0, 1), (5.0, 2)) for seed in range(4)],
        always=[(60.0, 0, 0), (25.0, 1, 1), (25.0, 1, 2), (5.0, 2, 3)],
    ),
)
def test_decay_over_a_noise_floor(floor: float, drowned: int, seed: int) -> None:
    """Bands that stand over the noise tell T60 as without it; bands that drown tell none.

    A window of 61 ms hears a partial 31 dB over the sum of white noise: from 1.6 to 3.2 kHz partials begin 19 to 39 dB
    below the first, so 10 dB over a floor of -25 dB at most of them, and of -5 dB at few; above that, at none.
    """
    octaves = {50: 6.0, 100: 6.0, 200: 6.0, 400: 6.0, 800: 3.0, 1600: 3.0, 3200: 3.0}
    for seconds in (1.6, 3.0):  # as the fit hears it, and as `compare` does
        found = measure(in_noise(floor, seed, seconds), RATE, F0)
        for k, (low, t60) in enumerate(octaves.items()):
            key = f"t60_{low}"
            if k < len(octaves) - drowned:
                assert found[key] == pytest.approx(t60, rel=0.12), (key, seconds)
            else:
                assert math.isnan(found[key]) and "over the noise" in found.missing[key], (key, seconds, found[key])


def test_noise_alone_does_not_decay() -> None:
    """One partial in noise, and noise that fades out with it: no other octave tells a T60."""
    for seed in range(6):
        noise = np.random.default_rng(seed).normal(size=TIME.size)
        for fading in (np.ones(TIME.size), np.clip(1.2 - TIME / 2.5, 0, 1)):
            sound = fading * (note(count=1, t60=6.0) + 0.01 * noise)
            found = measure(sound, RATE, F0)
            told = {key for key in found if key.startswith("t60_") and not math.isnan(found[key])}
            assert told == {"t60_50"}, (seed, told)


@pytest.mark.parametrize("f0", [41.2, 65.4, 130.8])
def test_glide_of_ten_cents(f0: float) -> None:
    """Ten cents until 0.5 s, none later: each partial shows them early and late."""
    found = measure(note(f0, cents=lambda t: np.where(t < 0.5, 10.0, 0.0)), RATE, f0)
    for key in ("glide_early", "glide_late", *(f"glide_late_{j}" for j in range(1, 6))):
        assert found[key] == pytest.approx(10.0, abs=0.3), key
    still = measure(note(f0), RATE, f0)
    assert abs(still["glide_early"]) < 0.1 and abs(still["glide_late"]) < 0.1


def test_glide_that_fades() -> None:
    """A glide that halves between the two windows measures half in the later one."""
    found = measure(note(cents=lambda t: 40 * 2 ** (-t / 0.1)), RATE, F0)
    assert 1.8 < found["glide_early"] / found["glide_late"] < 2.4


@pytest.mark.parametrize("f0", [41.2, 49.0, 73.4, 98.0])
def test_a_glide_is_that_of_its_times_whatever_the_pitch(f0: float) -> None:
    """Low notes have longer windows with the same middle: a fading glide measures the same there."""

    def cents(t: Floats) -> Floats:
        return 40 * np.exp(-t / 0.1)

    found = measure(note(f0, cents=cents), RATE, f0, only=("glide_early", "glide_late"))
    for key, ends in (("glide_early", EARLY), ("glide_late", LATE)):
        assert found[key] == pytest.approx(float(np.mean(cents(np.linspace(*ends, 999)))), rel=0.04), key


def test_beats_are_wobble() -> None:
    """Partials beating by 6 dB up and down deviate by 6 / sqrt(2) in the median; others by nothing."""

    def beating(j: int, t: Floats) -> Floats:
        return 10 ** (6 * np.sin(2 * math.pi * 4 * t + j) / 20) if j >= 5 else 1 + 0 * t

    assert measure(note(130.8, level=beating), RATE, 130.8)["wobble"] == pytest.approx(6 / math.sqrt(2), rel=0.25)
    assert measure(note(130.8), RATE, 130.8)["wobble"] < 0.05


def test_a_dip_of_the_fundamental() -> None:
    """It is told where the fundamental alone dips, by how much, and not where it swells or the others dip."""

    def dipping(number: int, depth: float) -> Callable[[int, Floats], Floats]:
        return lambda j, t: np.where(j == number, 10 ** (depth / 20 * np.exp(-(((t - 0.9) / 0.12) ** 2))), 1.0)

    deep, swell, other = (
        measure(note(level=dipping(number, depth)), RATE, F0) for number, depth in ((1, -12.0), (1, 12.0), (2, -12.0))
    )
    assert deep["dip"] == pytest.approx(-10, abs=2) and -5 < swell["dip"] < -1 and other["dip"] > -0.2
    assert measure(note(), RATE, F0)["dip"] > -0.05


def test_drift_of_the_fundamental() -> None:
    """A frequency that sways by 5 cents to either side strays by 5 / sqrt(2); one that stands, by nothing."""
    swaying = measure(note(cents=lambda t: 5 * np.sin(2 * math.pi * 3 * t)), RATE, F0)
    assert swaying["drift"] == pytest.approx(5 / math.sqrt(2), rel=0.15)
    assert measure(note(), RATE, F0)["drift"] < 0.05


def test_lines_between_partials() -> None:
    """Another string at -40 dB of the note's power is a line of -40 dB; no line is far below."""
    sound = note(t60=60.0)
    power = np.mean(sound[round(0.3 * RATE) : round(1.3 * RATE)] ** 2)
    line = math.sqrt(2 * power * 1e-4) * np.sin(2 * math.pi * 98 * TIME)
    assert measure(sound + line, RATE, F0)["lines"] == pytest.approx(-40, abs=1)
    assert measure(sound, RATE, F0)["lines"] < -80


def test_hiss() -> None:
    """White noise of -40 dB of the note's power has 6 of 22.05 kHz of it from 10 to 16 kHz."""
    sound = note(t60=60.0)
    power = np.mean(sound[round(0.4 * RATE) : round(0.6 * RATE)] ** 2)
    noise = math.sqrt(power * 1e-4) * np.random.default_rng(7).normal(size=sound.size)
    assert measure(sound + noise, RATE, F0)["hiss"] == pytest.approx(-40 + 10 * math.log10(6 / 22.05), abs=1)
    assert "nothing is known" in measure(sound[::2], RATE / 2, F0).missing["hiss"]


def test_the_floor_over_frequency() -> None:
    """White noise of -70 dB per kHz under a note: every band says so; noise that falls has other figures."""
    sound = note()
    loud = 10 * math.log10(np.mean(sound[: round(0.3 * RATE)] ** 2))
    white = np.random.default_rng(4).normal(size=sound.size)
    white *= 10 ** ((loud - 70.0) / 20) * math.sqrt(RATE / 2000)
    found = measure(sound + white, RATE, F0, only=FLOOR_KEYS)
    assert [found[key] for key in FLOOR_KEYS] == pytest.approx([-70.0] * 5, abs=1.0)
    nu = np.fft.rfftfreq(white.size, 1 / RATE)
    red = np.fft.irfft(np.fft.rfft(white) / np.maximum(nu / 1000, 0.1), white.size)  # -6 dB per octave
    falling = measure(sound + red, RATE, F0, only=FLOOR_KEYS)
    assert falling["floor_4000"] - falling["floor_1500"] == pytest.approx(20 * math.log10(2600 / 5800), abs=1.5)
    assert found["floor_10000"] > falling["floor_10000"] + 20
    assert measure(0.1 * (sound + white), RATE, F0, only=FLOOR_KEYS)["floor_500"] == pytest.approx(found["floor_500"])
    slow = measure((sound + white)[::2], RATE / 2, F0, only=FLOOR_KEYS)
    assert "nothing is known" in slow.missing["floor_10000"] and slow["floor_4000"] > -75
    assert "1.5 s are needed" in measure(sound[: round(1.4 * RATE)], RATE, F0).missing["floor_500"]


def highs(decay: Callable[[Floats], Floats]) -> Floats:
    """A note with noise whose level over time is `decay`, dB."""
    noise = np.random.default_rng(2).normal(size=TIME.size)
    return 1e-2 * noise * 10 ** (decay(TIME) / 20) + 1e-3 * note(130.8, count=8)


def test_highs_that_bend_and_return() -> None:
    """80 dB/s until 0.4 s and 10 dB/s later bend by 70; the reverse by -70; a burst of 15 dB returns by 15."""
    falls = highs(lambda t: -80 * np.minimum(t, 0.4) - 10 * np.maximum(t - 0.4, 0))
    rests = highs(lambda t: -10 * np.minimum(t, 0.4) - 30 * np.maximum(t - 0.4, 0))
    assert measure(falls, RATE, 130.8)["bend"] == pytest.approx(70, abs=6)
    assert measure(rests, RATE, 130.8)["bend"] == pytest.approx(-20, abs=6)
    burst = highs(lambda t: -20 * t + 15 * ((t > 0.5) & (t < 0.6)))
    again, still = measure(burst, RATE, 130.8), measure(highs(lambda t: -20 * t), RATE, 130.8)
    assert again["returns"] == pytest.approx(15, abs=3) and still["returns"] < 4
    assert measure(highs(lambda t: -20 * t - 15 * ((t > 0.5) & (t < 0.6))), RATE, 130.8)["returns"] > 11  # from a gap


def test_a_muted_note_falls() -> None:
    """A T60 of 0.6 s is 20 dB in 0.2 s."""
    assert measure(note(t60=0.6, count=6), RATE, F0)["fall_time"] == pytest.approx(0.2, abs=0.02)
    assert "less than 20 dB" in measure(note(t60=30.0), RATE, F0).missing["fall_time"]


def test_noise_between_partials() -> None:
    """White noise: each band has its share, whatever the partials; a clean note stays below a floor."""
    rng = np.random.default_rng(1)
    clean = note(130.8, t60=60.0)
    noise = 1e-3 * rng.normal(size=clean.size)
    found, quiet = measure(clean + noise, RATE, 130.8), measure(clean, RATE, 130.8)
    power = 10 * math.log10(np.mean(clean[round(0.3 * RATE) : round(0.5 * RATE)] ** 2))
    for key, width in (("between_200", 300), ("between_500", 1000), ("between_1500", 2500)):
        expected = -60 + 10 * math.log10(width / (RATE / 2)) - power
        assert found[key] == pytest.approx(expected, abs=2.5), key
        assert quiet[key] < found[key] - 10, key
    louder = measure(2 * (clean + noise), RATE, 130.8)
    assert louder["between_level"] - found["between_level"] == pytest.approx(20 * math.log10(2), abs=1e-6)
    assert quiet["between_50ms"] < -40
    rattling = clean + 0.3 * rng.normal(size=clean.size) * np.exp(-TIME / 0.2)
    assert measure(rattling, RATE, 130.8)["between_50ms"] > -10


def test_bands_and_centroids() -> None:
    """Two partials of known levels give the bands over the fundamental and the centroid."""
    sound = 0.3 * np.sin(2 * math.pi * 100 * TIME) + 0.03 * np.sin(2 * math.pi * 1000 * TIME)
    found = measure(sound, RATE, 100.0)
    assert found["band_700"] == pytest.approx(-20, abs=0.1) and found["growth"] == pytest.approx(-20, abs=0.1)
    assert found["band_low"] < -25 and found["band_300"] < -35
    assert found["centroid_100"] == pytest.approx((100 + 1000 / 100) / 1.01, rel=0.05)
    assert found["fundamental_fall"] == pytest.approx(0, abs=0.3)


def test_fundamental_that_falls() -> None:
    """A fundamental that falls by 12 dB in 80 ms, beside partials that stay."""

    def level(j: int, t: Floats) -> Floats:
        return np.where(j == 1, 10 ** (-0.6 * np.clip((t - 0.02) / 0.08, 0, 1)), 1.0)

    assert measure(note(130.8, level=level, t60=60), RATE, 130.8)["fundamental_fall"] == pytest.approx(-12, abs=1)


def test_high_bands_that_fall() -> None:
    """Noise of 2 to 8 kHz that falls by 20 dB in 0.1 s is 20 dB lower 0.1 s after its peak, 40 dB after 0.2 s."""
    noise = np.random.default_rng(2).normal(size=TIME.size) * 10 ** (-TIME / 0.1)
    found = measure(noise + 1e-3 * note(), RATE, F0)
    assert found["high_100"] == pytest.approx(-20, abs=3) and found["high_200"] == pytest.approx(-40, abs=3)
    assert found["snap"] == pytest.approx(24, abs=4)


def test_thump_before_the_note() -> None:
    """A burst at 63 Hz in the first 30 ms, 12 dB above a note of 1 kHz."""
    sound = 0.1 * np.sin(2 * math.pi * 1000 * TIME)
    sound[: round(0.03 * RATE)] += 0.4 * np.sin(2 * math.pi * 63 * TIME[: round(0.03 * RATE)])
    found = measure(sound, RATE, 100.0)
    assert found["thump"] == pytest.approx(12.3, abs=1) and max(SHARE_KEYS, key=found.__getitem__) == "octave_62"


def test_what_a_short_note_does_not_tell() -> None:
    """A note of 0.7 s has an attack, but no levels after 1 s and no glides; the reason names the missing length."""
    found = measure(note(seconds=0.7), RATE, F0)
    assert math.isfinite(found["centroid_20"]) and math.isfinite(found["band_300"])
    for key in ("level_1s", "level_2s", "glide_early", "glide_late_3"):
        assert math.isnan(found[key]) and "0.70 s long" in found.missing[key], key
    assert set(found.missing) == {key for key in found if math.isnan(found[key])}


def test_a_file_that_begins_within_the_note() -> None:
    """Without an attack it has only the decay figures."""
    sound = note(count=1)[round(1.003 / 65.4 * RATE) + 90 :]
    found = measure(sound, RATE, F0)
    for key in ("centroid_20", "thump", "snap", "fundamental_fall", "octave_62"):
        assert found.missing[key] == "the recording begins within the note", key
    assert math.isfinite(found["level_1s"])


def test_silence_before_a_note_does_not_count() -> None:
    sound = note()
    later = np.concatenate([np.zeros(4410), sound])
    a, b = measure(sound, RATE, F0), measure(later, RATE, F0)
    assert list(a) == list(b) and a.figures == pytest.approx(b.figures, nan_ok=True)


def test_the_same_note_has_the_same_figures() -> None:
    a, b = (measure(note(), RATE, 1.02 * F0) for _ in range(2))
    assert repr(a.figures) == repr(b.figures) and a.missing == b.missing


def test_only_some_figures() -> None:
    """The same as in a full run; an unknown name is refused with a list of the known ones."""
    sound = note()
    every, some = measure(sound, RATE, F0), measure(sound, RATE, F0, only=["centroid_20", "t60_100"])
    assert {"centroid_20", "t60_100"} <= set(some) < set(every)
    assert all(some[key] == pytest.approx(every[key], nan_ok=True) for key in some)
    assert not measure(sound, RATE, F0, only=["snap"]).ringing.number.size
    with pytest.raises(ValueError, match=r"figure must be .*snap.*, not 'snapp'"):
        measure(sound, RATE, F0, only=["snapp"])


@pytest.mark.parametrize(
    ("sound", "rate", "pitch", "why"),
    [
        (np.zeros(RATE), RATE, 100.0, "nothing sounds"),
        (np.zeros((2, RATE)), RATE, 100.0, "one dimension"),
        (np.full(RATE, np.nan), RATE, 100.0, "not finite"),
        (np.ones(100), RATE, 100.0, "at least 0.05 s"),
        (np.ones(RATE), 4000, 100.0, "rate must be at least 8000 Hz"),
        (np.ones(RATE), RATE, 5.0, "pitch must be from 20 to 700 Hz"),
        (np.ones(RATE), RATE, math.nan, "pitch must be from 20 to 700 Hz"),
    ],
)
def test_sounds_that_cannot_be_measured(sound: Floats, rate: float, pitch: float, why: str) -> None:
    with pytest.raises(ValueError, match=why):
        measure(sound, rate, pitch)


def test_partials_that_waver() -> None:
    """`ringing` numbers the partials, and gives each one's deviation from its line."""
    found = ringing(note(130.8, count=12), RATE, 130.8)
    assert found.number.tolist() == list(range(1, 13))


def test_partials_that_lie_ever_closer() -> None:
    """Their line leads below 0 Hz: nobody looks for partials there."""
    places = [(j, F0 * j * (1 - j**2 / 1000)) for j in range(1, 8)]
    sound = sum(np.sin(2 * math.pi * nu * TIME + j) for j, nu in places) * np.exp(-2 * TIME)
    assert ringing(sound, RATE, F0).number.tolist() == list(range(1, 8))


def test_distances() -> None:
    """None to itself, however loud; 6 dB in half of the bands is 3 dB from their mean, and none with free bands."""
    sound = np.random.default_rng(3).normal(size=2 * RATE) * np.exp(-np.arange(2 * RATE) / RATE)
    assert distance(sound, 0.1 * sound, RATE) == pytest.approx(0, abs=1e-9)
    spectrum = np.fft.rfft(sound)
    nu = np.arange(spectrum.size) * RATE / sound.size
    tilted = np.fft.irfft(spectrum * np.where(nu > 566, 2.0, 1.0))  # half of 24 bands from 40 Hz to 8 kHz
    assert distance(sound, tilted, RATE) == pytest.approx(3.01, abs=0.25)
    assert distance(sound, tilted, RATE, equalized=True) < 0.4
    assert math.isnan(distance(sound, sound, RATE, 2.5))
    longer = np.repeat(sound, 2)
    assert distance(longer, longer, 2 * RATE, other_rate=2 * RATE) == 0
