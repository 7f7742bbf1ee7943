"""The amp behind the DI: drive with a clean blend, equaliser, cabinets, limiter. At rest nothing changes."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy.special import j1
from support.costs import quick
from support.effects import CHOICES, RATE, Amp
from support.levels import sine
from support.strings import behind

from livebass import Quality, load_preset, score_of
from livebass.engine.engine import Engine
from livebass.kernels.effects import boxes, limiter, valve
from livebass.kernels.effects.boxes import BOXES, Cabinet
from livebass.kernels.effects.records import PATHS, SECTIONS
from livebass.rows.techniques import EFFECTS as KNOBS
from livebass.rows.techniques import HIGH_MIDS, LOW_MIDS, knob_of

LIGHT = Quality("light", 60, 192e3)


def decibel(gain: Any) -> np.ndarray:
    return 20 * np.log10(np.abs(gain))


def noise(count: int, seed: int = 1) -> np.ndarray:
    return np.random.default_rng(seed).standard_normal(count)


def cuts(count: int, seed: int, maximum: int) -> list[int]:
    """Sizes of blocks, without the last one."""
    sizes = np.random.default_rng(seed).integers(1, maximum, count)
    return sizes[np.cumsum(sizes) < count].tolist()


def knobs_of(count: int, **requested: float) -> np.ndarray:
    """Knobs of hosts, (knobs, count), all at 0 but these."""
    knobs = np.zeros((len(KNOBS), count))
    for name, value in requested.items():
        knobs[KNOBS.index(name)] = value
    return knobs


# --- drive beside a clean sound ---


def products(size: float, **own: float) -> float:
    """dB of the strongest inharmonic product under a tone of 5 kHz."""
    count = RATE // 5
    out = Amp(**own, limiter="off").play(sine(5000.0, 1.2, RATE, size))[-count:]
    spectrum = np.abs(np.fft.rfft(out * np.blackman(count)))
    hertz = np.arange(len(spectrum)) * RATE / count
    tone = spectrum[np.abs(hertz - 5000) < 30].max()
    others = np.min(np.abs(hertz[:, None] - np.array([0.0, 5000, 10_000, 15_000, 20_000])), axis=1) > 60
    return float(20 * np.log10(spectrum[others].max() / tone))


@pytest.mark.parametrize("clean", quick([0.05, 0.5], [0.5]))
@pytest.mark.parametrize("drive", quick([0.5, 0.8, 1.0], [1.0]))
def test_the_aliases_of_the_drive_are_inaudible(drive: float, clean: float) -> None:
    for size in (0.1, 0.5, 1.0):
        assert products(size, drive=drive, clean_blend=clean) < -70


def test_clean_and_driven_sound_arrive_in_phase() -> None:
    """Where the valve does not distort, driven over clean is the tone stack alone, so the two do not comb."""
    hertz = np.array([31.0, 82.0, 250.0, 1000.0, 4000.0, 9000.0, 15_000.0])
    clean, most = (Amp(drive=1e-3, clean_blend=c).gain(hertz) for c in (1.0, 1e-9))
    assert np.abs(decibel(clean)).max() < 1e-3, "an allpass"
    one = Amp(drive=0.5).record
    z = np.exp(2j * np.pi * hertz / RATE)
    stack = np.polyval(one["tone_b"][::-1], 1 / z) / np.polyval(one["tone_a"][::-1], 1 / z)
    level = most[1] / clean[1] / stack[1]
    assert abs(level.imag) < 0.01 * level.real
    assert np.abs(most / clean / stack / level - 1).max() < 0.02
    half = Amp(drive=1e-3, clean_blend=0.5).gain(hertz)
    assert np.abs(half - 0.5 * (clean + most)).max() < 1e-3
    assert (decibel(half) > decibel(0.5 * np.maximum(np.abs(clean), np.abs(most))) - 0.1).all(), "nothing cancels"


def test_a_clean_blend_keeps_the_lows() -> None:
    """Loud highs drive the valve so far that it swallows the lowest partial; a blend brings it back."""

    def partial(out: np.ndarray, f: float) -> float:
        t = np.arange(RATE) / RATE
        return float(abs(np.sum(out[-RATE:] * np.exp(-2j * np.pi * f * t))) * 2 / RATE)

    t = np.arange(2 * RATE) / RATE
    sound = 0.15 * np.sin(2 * np.pi * 41 * t) + 0.6 * np.sin(2 * np.pi * 700 * t)
    driven, blended = (Amp(drive=1.0, clean_blend=c, limiter="off").play(sound) for c in (1e-9, 0.6))
    assert partial(blended, 41) > 1.4 * partial(driven, 41)
    assert partial(blended, 2100) > 0.02, "the drive stays"


# --- equaliser ---


def bell(hertz: np.ndarray, centre: float, level: float) -> np.ndarray:
    """The equaliser's bell, over frequency as the trapezoidal rule warps it."""
    s = 1j * np.tan(np.pi * hertz / RATE) / np.tan(np.pi * centre / RATE)
    a = 10 ** (level / 40)
    return (s * s + s * a / 0.8 + 1) / (s * s + s / (0.8 * a) + 1)


@pytest.mark.parametrize("level", [-15.0, -4.0, 9.0, 15.0])
def test_bells_have_their_gain_at_their_frequency(level: float) -> None:
    for name, centre in (("eq_low_mid", 400.0), ("eq_low_mid", 630.0), ("eq_high_mid", 2000.0), ("eq_high_mid", 5e3)):
        hertz = np.array([20.0, centre / 2, centre, 1.7 * centre, 15_000.0])
        found = Amp(**{name: level, f"{name}_frequency": centre}, limiter="off").gain(hertz)
        assert decibel(found)[2] == pytest.approx(level, abs=0.01)
        assert np.abs(found / bell(hertz, centre, level) - 1).max() < 3e-3


@pytest.mark.parametrize("level", [-15.0, -4.0, 9.0, 15.0])
def test_shelves_have_their_gain_at_the_ends(level: float) -> None:
    bass = decibel(Amp(eq_bass=level, limiter="off").gain(np.array([0.0, 80.0, 2000.0])))
    treble = decibel(Amp(eq_treble=level, limiter="off").gain(np.array([80.0, 4000.0, 20_000.0])))
    assert bass == pytest.approx([level, level / 2, 0], abs=0.08)
    assert treble == pytest.approx([0, level / 2, level], abs=0.08)


def test_the_frequencies_of_hosts_are_those_of_presets() -> None:
    hertz = np.array([100.0, 500.0, 1500.0, 4000.0])
    for knob, level, centres in (
        ("eq_low_mid_frequency", "eq_low_mid", LOW_MIDS), ("eq_high_mid_frequency", "eq_high_mid", HIGH_MIDS),
    ):  # fmt: skip
        for number, centre in enumerate(centres, 1):
            assert knob_of(knob, number) == centre
            wanted = Amp(**{level: 6.0, knob: centre}).play(0.1 * noise(500))
            knobs = knobs_of(500, **{level: 6.0, knob: number})
            assert np.array_equal(Amp(**{level: -3.0}).play(0.1 * noise(500), knobs=knobs), wanted)
    assert (
        np.abs(Amp(eq_low_mid=6.0).gain(hertz) / Amp(eq_low_mid=6.0, eq_low_mid_frequency=400.0).gain(hertz) - 1).max()
        == 0
    )


# --- cabinets ---


def design(cabinet: Cabinet, hertz: np.ndarray) -> np.ndarray:
    """The curve (dB) that a cabinet is meant to have: Small's box, the cone's peaks, pistons at their places."""
    driver, s, k = cabinet.driver, 2j * np.pi * hertz, 2 * np.pi * hertz / 343
    ts = 1 / (2 * np.pi * driver.resonance)
    ratio, q = driver.compliance / cabinet.volume, driver.q
    if cabinet.tuning:
        tb, ql = 1 / (2 * np.pi * cabinet.tuning), 7.0
        a3, a2, a1 = (
            tb * tb * ts / q + tb * ts * ts / ql,
            (ratio + 1) * tb * tb + tb * ts / (ql * q) + ts * ts,
            tb / ql + ts / q,
        )
        top = s**4 * (tb * ts) ** 2
        out = top / (top + s**3 * a3 + s**2 * a2 + s * a1 + 1)
    else:
        tc, qc = ts / np.sqrt(ratio + 1), q * np.sqrt(ratio + 1)
        out = s**2 * tc**2 / (s**2 * tc**2 + s * tc / qc + 1)
    ring = 1800.0 * 0.5 / (2 * np.pi * driver.radius)
    for times, level, of in boxes.BREAK_UP:
        p = s / (2 * np.pi * ring * times)
        out = out * (p * p + p * 10 ** (level / 20) / of + 1) / (p * p + p / of + 1)
    end = s / (2 * np.pi * ring * driver.radius / driver.coil)
    out = out / ((end**2 + 2 * np.sin(np.pi / 8) * end + 1) * (end**2 + 2 * np.cos(np.pi / 8) * end + 1))
    paths, weights = np.zeros(len(hertz), complex), 0.0
    for column in range(cabinet.columns):
        for row in range(cabinet.rows):
            away = np.hypot(
                cabinet.apart * (column - cabinet.before[0]) - cabinet.beside,
                cabinet.apart * (row - cabinet.before[1]) - cabinet.above,
            )
            far = np.hypot(away, cabinet.distance)
            x = np.maximum(k * driver.radius * away / far, 1e-9)
            paths += 2 * j1(x) / x * np.exp(-1j * k * far) / far
            weights += 1 / far
    return decibel(out * paths / weights)


@pytest.mark.parametrize("rate", quick([44_100, 48_000, 96_000, 192_000], [44_100]))
@pytest.mark.parametrize("name", BOXES)
def test_cabinets_have_the_response_of_their_design(name: str, rate: int) -> None:
    hertz = np.geomspace(20, 8000, 150)
    found = decibel(Amp(rate, cabinet=name, limiter="off").gain(hertz))
    assert np.abs(found - design(BOXES[name], hertz)).max() < 2


def test_boxes_follow_small() -> None:
    """A closed box raises resonance and Q by one factor; a vented one has the frequencies of vent and driver."""
    ten = BOXES["closed-4x10"]
    ((hertz, q),) = boxes.high_passes(ten)
    assert (hertz / 66.3, q / 0.444) == pytest.approx((2**0.5, 2**0.5))
    polynomial = boxes.vented_box(BOXES["vented-1x15"])
    roots = np.roots(polynomial[::-1])
    wanted = sorted((abs(r) / (2 * np.pi), abs(r) / (-2 * r.real)) for r in roots if r.imag > 0)
    assert sorted(boxes.high_passes(BOXES["vented-1x15"]))[1] == pytest.approx(wanted[-1], rel=1e-9)
    product = np.prod([f for f, _ in boxes.high_passes(BOXES["vented-1x15"])])
    assert product == pytest.approx(43.0 * 35.0), "the frequencies of vent and driver"


def test_every_path_fits_at_the_highest_rate() -> None:
    one = Amp(192_000).record
    assert one["reach"].max() < PATHS
    assert one["paths"].sum(axis=1) == pytest.approx(1.0)
    assert one["sections"].max() <= SECTIONS


def test_cabinets_fade_into_each_other() -> None:
    """In the middle both sound; no frame is a click; afterwards the second one sounds alone, bit for bit."""
    sound = 0.1 * np.sin(2 * np.pi * 110 * np.arange(30_000) / RATE)
    knobs = knobs_of(30_000, cabinet=2.0)
    knobs[KNOBS.index("cabinet"), 10_000:] = 4.0
    out = Amp().play(sound, knobs=knobs)
    first, second = (Amp(cabinet=name).play(sound) for name in ("closed-4x10", "vented-1x15"))
    assert np.array_equal(out[:10_000], first[:10_000])
    assert np.abs(out[-5000:] - second[-5000:]).max() < 1e-6
    bends, usual = np.abs(np.diff(out, 2)), np.abs(np.diff(second, 2))[5000:].max()
    assert bends[10_000:20_000].max() < 3 * usual, "a click"


# --- limiter ---


def test_below_its_ceiling_the_limiter_changes_no_bit() -> None:
    sound = (0.89 * np.sin(np.arange(20_000) / 50)).astype(np.float32)
    one = Amp(limiter="on")
    assert np.array_equal(one.play(sound), sound) and not one.flags.any()


@pytest.mark.parametrize("size", [0.9, 2.0, 30.0])
def test_nothing_leaves_the_limiter_above_its_ceiling(size: float) -> None:
    for sound in (size * noise(20_000), size * np.sin(np.arange(20_000) / 150)):
        out = Amp(limiter="on").play(sound)
        assert np.abs(out).max() <= np.float32(limiter.CEILING) * (1 + 1e-6)
        assert np.abs(out).max() > 0.88


def test_the_limiter_keeps_the_shape_of_later_waves_and_lets_go() -> None:
    t = np.arange(RATE) / RATE
    sound = 2.0 * np.sin(2 * np.pi * 31 * t)
    sound[RATE // 2 :] *= 0.05
    out = Amp(limiter="on").play(sound)
    loud = slice(2000, RATE // 2 - 100)
    ratio = (out[loud] / sound[loud])[np.abs(sound[loud]) > 0.1]
    assert np.ptp(ratio) < 1e-5, "one gain"
    held = RATE // 2 + int(limiter.WINDOW * RATE * 0.9)
    assert out[held] == pytest.approx(ratio[0] * sound[held], abs=1e-6)
    rest = (0.1 * np.sin(np.arange(3 * RATE) / 100)).astype(np.float32)
    one = Amp(limiter="on")
    one.play(sound)
    out = one.play(rest)
    assert not np.array_equal(out[: RATE // 4], rest[: RATE // 4])
    assert np.array_equal(out[RATE:], rest[RATE:])


def test_the_limiter_comes_with_the_amp_unless_told() -> None:
    loud = 0.99 * np.sin(np.arange(8000) / 30)
    assert np.abs(Amp(compression=0.1, drive=0.3).play(3 * loud)).max() > 0.9, "as older sounds"
    for own in ({"eq_bass": 12.0}, {"eq_treble": 1.0}, {"drive": 0.9, "clean_blend": 0.5}, {"cabinet": "vented-1x15"}):
        assert np.abs(Amp(**own).play(3 * loud)).max() < 0.8913, own
        assert np.abs(Amp(**own, limiter="off").play(3 * loud)).max() > 0.9, own
    assert np.abs(Amp(limiter="on").play(loud)).max() < 0.8913


@pytest.mark.parametrize(
    "amp", [{"eq_bass": 6.0}, {"cabinet": "closed-8x10"}, {"drive": 0.6, "clean_blend": 0.4}], ids=str
)
@pytest.mark.parametrize("preset", quick(["jazz-finger", "slap", "five-string", "upright"], ["jazz-finger"]))
def test_four_hard_notes_do_not_clip(preset: str, amp: dict[str, Any]) -> None:
    bass = behind(load_preset(preset), **amp)
    engine = Engine(bass, LIGHT, RATE)
    score = score_of([(0.01 * k, 1.0, s.open_note, 127) for k, s in enumerate(bass.strings)], RATE)
    engine.send(score.frames, score.messages)
    mix = engine.process_with_mix(RATE // 2)[1]
    assert mix is not None and 0.3 < np.abs(mix).max() < 1


# --- all ---

ON: dict[str, dict[str, Any]] = {
    "blend": {"drive": 0.6, "clean_blend": 0.4},
    "equaliser": {"eq_bass": 5.0, "eq_low_mid": -6.0, "eq_high_mid": 3.0, "eq_treble": -9.0},
    "cabinet": {"cabinet": "closed-8x10"},
    "vented": {"cabinet": "vented-1x15"},
    "limiter": {"limiter": "on"},
    "all": {
        "compression": 0.4,
        "drive": 0.5,
        "clean_blend": 0.3,
        "eq_bass": 4.0,
        "eq_high_mid": 4.0,
        "cabinet": "closed-4x10",
    },
}


@pytest.mark.parametrize("kind", ON)
def test_splitting_blocks_changes_nothing(kind: str) -> None:
    sound = 0.5 * noise(20_000).astype(np.float32)
    sound[9000:10_000] = 0.0
    one = Amp(**ON[kind])
    whole = one.play(sound)
    assert not np.array_equal(whole, sound)
    for maximum in (2, 70, 3000):
        other = Amp(**ON[kind])
        assert np.array_equal(other.play(sound, cuts(len(sound), maximum, maximum)), whole), maximum
        assert np.array_equal(other.flags, one.flags)


def test_flat_is_bypass_in_every_bit() -> None:
    sound = noise(5000).astype(np.float32)
    one = Amp(eq_low_mid_frequency=250.0, eq_high_mid_frequency=800.0, clean_blend=0.7)
    assert np.array_equal(one.play(sound), sound) and not one.flags.any()
    knobs = knobs_of(5000, eq_low_mid_frequency=1.0, eq_high_mid_frequency=5.0, cabinet=1.0, limiter=2.0)
    one = Amp(limiter="on")
    assert np.array_equal(one.play(sound, knobs=knobs), sound) and not one.flags.any()


def test_knobs_that_a_host_moves_do_not_click_and_leave_nothing() -> None:
    """They act from the frame where they leave 0, however blocks are split, and after them every bit is as before."""
    count = 110_000
    sound = 0.2 * noise(count).astype(np.float32)
    knobs = knobs_of(count)
    for k, (name, value) in enumerate(
        {
            "eq_bass": 9.0,
            "eq_low_mid": -12.0,
            "eq_treble": 6.0,
            "cabinet": 3.0,
            "clean_blend": 0.5,
            "drive": 0.4,
        }.items()
    ):
        knobs[KNOBS.index(name), 3000 + 1111 * k : 20_000 + 777 * k] = value
    knobs[KNOBS.index("eq_low_mid_frequency"), 8000:9000] = 5.0
    one = Amp()
    out = one.play(sound, knobs=knobs)
    assert np.array_equal(out[:3000], sound[:3000]) and np.array_equal(out[-20_000:], sound[-20_000:])
    assert not np.array_equal(out[3000:3100], sound[3000:3100])
    other = Amp()
    assert np.array_equal(other.play(sound, cuts(count, 5, 900), knobs), out)
    assert np.array_equal(other.flags, one.flags)
    level = np.full(count, 0.1)
    assert np.abs(np.diff(Amp().play(level, knobs=knobs))).max() < 2e-3, "a click"


@pytest.mark.parametrize("kind", ON)
def test_knobs_stand_where_they_are_from_the_first_frame(kind: str) -> None:
    sound, requested = 0.2 * noise(4000), dict(ON[kind])
    for name, choices in CHOICES.items():
        if name in requested:
            requested[name] = 1 + choices.index(requested[name])
    wanted = Amp(**ON[kind]).play(sound)
    assert np.array_equal(Amp().play(sound, knobs=knobs_of(4000, **requested)), wanted)


@pytest.mark.parametrize("kind", [kind for kind in ON if kind != "limiter"])
def test_silence_becomes_silence_and_then_all_is_as_new(kind: str) -> None:
    one = Amp(**ON[kind])
    first = one.play(0.3 * noise(128))
    rest = one.play(np.zeros(int(one.record["settles"]) // 128 * 128 + 256))
    assert not rest[-128:].any() and one.record["idle"] == 1
    assert np.array_equal(first, one.play(0.3 * noise(128)))


@pytest.mark.parametrize("kind", ON)
@pytest.mark.parametrize("size", [1e-38, 1.0, 1e6])
def test_whatever_comes_the_sound_is_finite(kind: str, size: float) -> None:
    for sound in (size * noise(5000), np.full(5000, size), np.full(5000, -size)):
        one = Amp(**ON[kind])
        out = one.play(sound)
        assert np.isfinite(out).all()
        changed = out[one.flags != 0.0]
        assert not (np.abs(changed[changed != 0.0]) < np.finfo(np.float32).tiny).any(), "denormal numbers are slow"


@pytest.mark.parametrize("kind", ON)
def test_no_state_becomes_denormal(kind: str) -> None:
    one = Amp(**ON[kind])
    one.play(0.5 * noise(1000))
    for _ in range(60):
        one.play(np.zeros(512))
        for name in ("band_state", "section_state", "fine_up", "fine_down", "clean_down", "fine_tone", "cut"):
            states = np.abs(one.record[name])
            assert not ((states > 0) & (states < np.finfo(float).tiny)).any(), name


def test_the_valve_without_a_clean_part_is_as_it_was() -> None:
    """Older projects play the stage at twice the rate: its filters, by hand."""
    sound = 0.5 * noise(300).astype(np.float32)
    one = Amp(drive=0.6)
    found, e = one.play(sound), one.record
    up, down, tone, out = np.zeros((8, 2)), np.zeros((8, 2)), np.zeros(3), []
    for x in sound.astype(float):
        even = valve.triode(e["curve"], e["volts"] * valve.branch(up, 0, x))
        odd = valve.triode(e["curve"], e["volts"] * valve.branch(up, 1, x))
        y = 0.5 * e["level"] * (valve.branch(down, 0, odd) + valve.branch(down, 1, even))
        b, a = e["tone_b"], e["tone_a"]
        out.append(b[0] * y + tone[0])
        tone[:] = b[1] * y - a[1] * out[-1] + tone[1], b[2] * y - a[2] * out[-1] + tone[2], b[3] * y - a[3] * out[-1]
    assert found == pytest.approx(np.array(out), rel=1e-6, abs=1e-7)
