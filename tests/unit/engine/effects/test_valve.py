"""The valve stage against filters, spline and circuit of scipy, whatever its knobs do."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest
from scipy.interpolate import CubicHermiteSpline
from scipy.optimize import brentq
from scipy.signal import bilinear, lfilter, sosfilt
from support.effects import RATE, Amp
from support.levels import sine

from livebass.kernels.effects import compressor, valve
from livebass.kernels.effects.records import CURVE, DOUBLINGS, KNOBS
from livebass.rows.arrays import Floats
from livebass.rows.techniques import EFFECTS

FILTERS = (valve.BRANCHES, valve.SECOND_BRANCHES, *[valve.LAST_BRANCHES] * (DOUBLINGS - 2))


def allpasses(x: Floats, coefficients: Any) -> Floats:
    """`x` through sections (a + z^-2) / (1 + a z^-2)."""
    return np.asarray(sosfilt([[a, 0.0, 1.0, 1.0, 0.0, a] for a in coefficients], x))


def half_band(x: Floats, coefficients: Any) -> Floats:
    """Half the sum of two branches of allpasses, the second a sample late."""
    late = np.concatenate([[0.0], x[:-1]])
    return 0.5 * (allpasses(x, coefficients[::2]) + allpasses(late, coefficients[1::2]))


def doubled(x: Floats, coefficients: Any) -> Floats:
    """`x` at twice the rate."""
    between = np.zeros(2 * x.size)
    between[::2] = 2.0 * x
    return half_band(between, coefficients)


def halved(x: Floats, coefficients: Any) -> Floats:
    """`x` at half the rate."""
    return half_band(x, coefficients)[1::2]


@dataclass(frozen=True)
class Stage:
    """The valve with the curve of an EFFECTS, on frames of given drive (n,)."""

    curve: Floats
    drive: Floats

    def driven(self, x: Floats) -> Floats:
        """V after the valve, at any multiple of the rate."""
        volts = np.repeat(self.volts, x.size // self.volts.size) * x
        cell = 2 * valve.FARTHEST / (CURVE - 1)
        points = np.linspace(-valve.FARTHEST, valve.FARTHEST, CURVE)
        cubic = CubicHermiteSpline(points, self.curve, np.gradient(self.curve, cell))
        return np.asarray(cubic(np.clip(volts, points[1], points[-3])))

    @property
    def volts(self) -> Floats:
        """At the grid for full scale: from CLEAN to DRIVEN, in equal ratios."""
        return np.asarray(np.exp((1 - self.drive) * np.log(0.35) + self.drive * np.log(16.0)))

    def toned(self, y: Floats) -> Floats:
        """V after the valve at the audio rate, levelled, through the tone stack."""
        level = (self.volts / 0.35) ** 0.4 / (60.0 * self.volts)
        b, a = (np.array(row) for row in valve.tone_stack())
        return np.asarray(lfilter(*bilinear(b[::-1], a[::-1], RATE), level * y))

    def plain(self, x: Floats) -> Floats:
        """Without a clean part: at twice the rate."""
        return self.toned(halved(self.driven(doubled(x, valve.BRANCHES)), valve.BRANCHES))

    def blended(self, x: Floats, clean: Floats) -> Floats:
        """Beside the clean sound, of which the part is `clean` (n,)."""
        for filters in FILTERS:
            x = doubled(x, filters)
        y = self.driven(x)
        for filters in FILTERS[::-1]:
            x, y = halved(x, filters), halved(y, filters)
        return clean * x + (1.0 - clean) * self.toned(y)


def followed(wanted: Floats, begin: float) -> Floats:
    """A knob on its way: by an exponential with its time constant, and there once it is near; nan: it stays."""
    found, now = np.empty(wanted.size), begin
    for j, target in enumerate(wanted):
        target = now if np.isnan(target) else target
        now += (target - now) * (1.0 - np.exp(-1.0 / (20e-3 * RATE)))
        now = found[j] = target if abs(target - now) < compressor.THERE else now
    return found


def runs(on: Any) -> list[slice]:
    """The unbroken runs of frames that are on."""
    edges = np.flatnonzero(np.diff(np.concatenate([[0], on.astype(int), [0]])))
    return [slice(*pair) for pair in edges.reshape(-1, 2)]


def of_moving_knobs(x: Floats, drive: Floats, clean: Floats, curve: Floats) -> tuple[Floats, Floats]:
    """The sound (n,) for requested knobs (n,), and where the stage is heard; it begins off.

    The stage fades in and out, as does the blend within it. What begins takes its knobs at once, and filters at rest.
    """
    wet = followed((drive > 0) * 1.0, 0.0)
    out = x.copy()
    for on in runs(wet > 0):
        drives = followed(np.where(drive[on] > 0, drive[on], np.nan), drive[on][0])
        fine = followed((clean[on] > 0) * 1.0, float(clean[on][0] > 0))
        cleans, sound = followed(clean[on], clean[on][0]), x[on]
        made = np.zeros(sound.size)
        for part in runs(fine < 1):
            made[part] = Stage(curve, drives[part]).plain(sound[part]) * (1 - fine[part])
        for part in runs(fine > 0):
            made[part] += Stage(curve, drives[part]).blended(sound[part], cleans[part]) * fine[part]
        out[on] += wet[on] * (made - sound)
    return out, wet > 0


def noise(count: int) -> Floats:
    """Lows and highs that drive the valve off its curve's ends, and quiet parts."""
    t = np.arange(count) / RATE
    return 0.4 * np.random.default_rng(5).standard_normal(count) * (1.05 + np.sin(2 * np.pi * 30 * t))


def assert_as_scipy(drive: Floats, clean: Floats, **own: float) -> None:
    """Knobs that a host requests (n,), 0: the bass's `own`."""
    one, x = Amp(limiter="off", **own), noise(drive.size).astype(np.float32)
    knobs = np.zeros((KNOBS, drive.size))
    knobs[EFFECTS.index("drive")], knobs[EFFECTS.index("clean_blend")] = drive, clean
    found = one.play(x, knobs=knobs)
    wanted, heard = of_moving_knobs(
        x.astype(float), drive, np.where(clean > 0, clean, own.get("clean_blend", 0.0)), one.record["curve"]
    )
    assert np.array_equal(one.flags, heard)
    assert np.array_equal(found[~heard], x[~heard])
    np.testing.assert_allclose(found, wanted, rtol=0, atol=1e-6 * np.abs(wanted).max())


@pytest.mark.parametrize("every", [700, 3000])
def test_the_stage_is_its_filters_curve_and_circuit_whatever_its_knobs_do(every: int) -> None:
    """Also as they turn back on their way: on, blended, off, up, plain again, with other blends."""
    drive = np.repeat([0.0, 0.9, 0.0, 0.4, 0.4, 0.4, 0.0, 0.6, 0.6], every)
    clean = np.repeat([0.0, 0.0, 0.3, 0.3, 0.0, 0.8, 0.8, 0.0, 0.5], every)
    assert_as_scipy(drive, clean)
    assert_as_scipy(drive, clean, clean_blend=0.25)


def test_so_it_is_with_knobs_that_arrive() -> None:
    """On, up, blended, more clean, plain again, off, and on once more with a blend from its first frame on."""
    drive = np.repeat([0.0, 0.5, 0.8, 0.8, 0.8, 0.8, 0.0, 0.3, 0.0], 10_000)
    clean = np.repeat([0.0, 0.0, 0.0, 0.4, 0.7, 0.0, 0.0, 0.2, 0.2], 10_000)
    assert_as_scipy(drive, clean)


# The curve and the tone


def test_the_curve_of_the_valve_is_that_of_a_triode() -> None:
    """Koren's law for a 12AX7 with its load line, solved by scipy; the grid current flows through its resistor."""
    one = Amp(drive=0.5).record

    def plate(volts: float) -> float:
        grid = volts - 68 / 70 * 0.15 * np.logaddexp(0, volts / 0.15)

        def excess(v: float) -> float:
            drawn = v / 600 * np.logaddexp(0, 600 * (1 / 100 + grid / np.sqrt(300 + v * v)))
            return float(v + 100e3 * 2 * drawn**1.4 / 1060 - 250)

        return float(brentq(excess, 1e-9, 250, xtol=1e-12))

    volts = np.linspace(-16, 16, CURVE)
    for k in range(0, CURVE, 64):
        assert one["curve"][k] == pytest.approx(plate(-1.3) - plate(-1.3 + volts[k]), rel=1e-12, abs=4e-9)
    assert one["curve"][CURVE // 2] == 0.0 and (np.diff(one["curve"]) > -1e-9).all()
    middle = CURVE // 2
    gain = (one["curve"][middle + 1] - one["curve"][middle - 1]) / (2 * (volts[1] - volts[0]))
    assert gain == pytest.approx(valve.GAIN, rel=0.05)


def test_the_curve_between_its_points_is_a_cubic_and_level_beyond() -> None:
    """Catmull and Rom's cubic is exact for parabolas. The curve ends one cell before its last points."""
    cell = 2 * valve.FARTHEST / (CURVE - 1)
    points = np.linspace(-valve.FARTHEST, valve.FARTHEST, CURVE)

    def parabola(volts: np.ndarray) -> np.ndarray:
        return 3.0 + volts * (2.0 - 0.1 * volts)

    volts = np.random.default_rng(1).uniform(points[1], points[-3], 200)
    volts[:4] = points[1], points[1] + 0.3 * cell, points[-3] - 0.3 * cell, points[-3]
    found = [valve.triode(parabola(points), v) for v in volts]
    np.testing.assert_allclose(found, parabola(volts), rtol=1e-12, atol=1e-11)
    for far, end in ((-1e3, points[1]), (points[0], points[1]), (points[-1], points[-3]), (1e3, points[-3])):
        assert valve.triode(parabola(points), far) == pytest.approx(parabola(end), abs=1e-11), "level beyond the end"


def stack(hertz: np.ndarray) -> np.ndarray:
    """The tone stack's gain by its nodes: input through C1 and R4, output at the wiper of the treble's track."""
    low, mid, high = valve.LOW, valve.MIDDLE, valve.HIGH
    out = []
    for f in hertz:
        s = 2j * np.pi * f
        admittances = [  # nodes: 0 ground, 1 top of treble, 2 behind R4, 3 top of bass, 4 top of middle, 5 wiper
            ("in", 1, s * valve.C1), ("in", 2, 1 / valve.R4), (2, 3, s * valve.C2), (2, 6, s * valve.C3),
            (1, 5, 1 / ((1 - high) * valve.R1)), (5, 3, 1 / (high * valve.R1)),
            (3, 4, 1 / (low * valve.R2)), (4, 6, 1 / ((1 - mid) * valve.R3)), (6, 0, 1 / (mid * valve.R3)),
        ]  # fmt: skip
        matrix, right = np.zeros((6, 6), complex), np.zeros(6, complex)
        for a, b, y in admittances:
            for x, z in ((a, b), (b, a)):
                if x in ("in", 0):
                    continue
                matrix[x - 1, x - 1] += y
                if z == "in":
                    right[x - 1] += y
                elif z != 0:
                    matrix[x - 1, z - 1] -= y
        out.append(np.linalg.solve(matrix, right)[4])
    return np.array(out)


def test_the_tone_stack_is_the_passive_circuit() -> None:
    one = Amp(drive=0.5).record
    hertz = np.array([20.0, 50.0, 100.0, 300.0, 600.0, 1500.0, 3000.0, 9000.0, 20_000.0])
    z = np.exp(2j * np.pi * hertz / RATE)
    digital = np.polyval(one["tone_b"][::-1], 1 / z) / np.polyval(one["tone_a"][::-1], 1 / z)
    shifted = RATE / np.pi * np.tan(np.pi * hertz / RATE)  # by the bilinear transform, 1.5 % at 3 kHz
    wanted = stack(shifted) / np.abs(stack(np.array([valve.UNITY])))
    assert np.abs(digital / wanted - 1).max() < 1e-9
    assert abs(np.sum(one["tone_b"])) < 1e-12 * np.abs(one["tone_b"]).max(), "no direct current"
    assert np.abs(np.roots(one["tone_a"])).max() < 1.0


def test_a_quiet_sound_goes_through_the_valve_in_its_tone_alone() -> None:
    """At a low drive a low level is not distorted, and keeps its loudness at UNITY."""
    out = Amp(drive=1e-3).play(sine(100.0, 1.0, RATE, 1e-3))[RATE // 2 :]
    spectrum = np.abs(np.fft.rfft(out * np.hanning(len(out))))
    f = 100 * len(out) // RATE
    assert 4 / len(out) * spectrum[f] / 1e-3 == pytest.approx(1.0, rel=0.03)
    assert spectrum[2 * f - 3 : 2 * f + 4].max() < 2e-3 * spectrum[f]


def products(drive: float, size: float) -> tuple[float, float]:
    """dB of the strongest inharmonic product, and of the second harmonic, under a tone of 5 kHz."""
    count = RATE // 5
    out = Amp(drive=drive).play(sine(5000.0, 1.2, RATE, size))[-count:]
    spectrum = np.abs(np.fft.rfft(out * np.blackman(count)))
    hertz = np.arange(len(spectrum)) * RATE / count
    tone = spectrum[np.abs(hertz - 5000) < 30].max()
    others = np.min(np.abs(hertz[:, None] - np.array([0.0, 5000, 10_000, 15_000, 20_000])), axis=1) > 60
    second = spectrum[np.abs(hertz - 10_000) < 30].max()
    return 20 * np.log10(spectrum[others].max() / tone), 20 * np.log10(second / tone)


@pytest.mark.parametrize("drive, alias", [(0.5, -115.0), (0.7, -54.0), (1.0, -36.0)])
def test_aliases_of_the_valve(drive: float, alias: float) -> None:
    found, second = products(drive, 0.5)
    assert found < alias
    assert second > -60, "it is not symmetric"
