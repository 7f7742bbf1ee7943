"""A glide on a bare board: equal to the exact motion of a string with a moving end, and without tones of its own."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from itertools import pairwise

import numpy as np
import pytest
from support.costs import slow
from support.live import Load, bass_of, offline, played_ahead, synth_and_device
from support.modal import third_octaves
from support.quiet import without_noise
from support.scores import in_blocks

from livebass import QUALITIES, Score, load_preset
from livebass.engine.engine import Engine
from livebass.engine.prepare import Note, Rates, new_voice, operators, play_frames
from livebass.kernels.string.preparing import SENSORS
from livebass.kernels.string.records import EVENT, GLIDE, PLUCK
from livebass.live.thread import block
from livebass.model.instrument import Speaking, speaking
from livebass.model.neck import Admittance
from livebass.rows.arrays import Floats

RATE = 48000
MODES = 400
SENSOR = 0.09  # m from the saddle
BEGIN = 0.05  # s of the glide
APEX, PLACE, WIDTH = 2e-3, 0.19, 6e-3  # m, of the pluck; the place is from the saddle
A_FRET = 22e-3  # s


def row_of_strings(name: str) -> list[Speaking]:
    """Ideal strings of `fretless` at all semitones: no stiffness, nothing yields, the board is far below."""
    bass = without_noise("fretless")
    i = bass.string_index(name)
    far = tuple((x, h - 0.05) for x, h in bass.necks[i].surface)
    neck = dataclasses.replace(bass.necks[i], surface=far, admittance=Admittance(), stop_conductance=0.0)
    string = dataclasses.replace(bass.strings[i], inharmonicity=0.0)
    whole = speaking(string, neck, 0)
    row = [speaking(string, neck, fret) for fret in range(21)]
    f0 = [whole.fundamental * whole.length / s.length for s in row]
    return [dataclasses.replace(s, fundamental=f, damped_fundamental=f) for s, f in zip(row, f0, strict=True)]


def glide(row: list[Speaking], first: int, last: int, seconds: float, partials: int = MODES) -> Floats:
    """The engine's u (n,) at SENSOR of a string plucked at `first` that glides to `last` from BEGIN on.

    After the pluck it keeps `partials` partials.
    """
    rates = Rates(RATE, 960_000)
    notes = [
        Note(s, round(MODES * s.length / row[0].length), ((s.length - SENSOR,), (s.length - SENSOR,))) for s in row
    ]
    pool = operators([notes], SENSORS, rates, lossless=True, playable=True)
    voice = new_voice(rates)
    voice.record["raw"], voice.record["fretless"], voice.record["saddle"][:] = 1, 1, SENSOR
    events = np.zeros(2, EVENT)
    events["frame"], events["kind"], events["fret"] = (0, round(BEGIN * RATE)), (PLUCK, GLIDE), (first, last)
    events["apex"][0], events["place"][0], events["width"][0] = APEX, row[first].length - PLACE, WIDTH
    events["seconds"][1] = A_FRET
    out = np.zeros(round(seconds * RATE))
    play_frames(voice, pool.records[0], events[:1], out[:1])
    for name in ("q", "p"):
        voice.slots["u"]["low"][name][:, partials:] = 0.0
    play_frames(voice, pool.records[0], events[1:], out[1:])
    return out


def way(row: list[Speaking], first: int, last: int) -> tuple[Callable[[Floats], Floats], float]:
    """Length (m) of the string at times (s), and the glide's duration (s)."""
    begin, end = row[first].length, row[last].length
    seconds = max(A_FRET * abs(last - first), 40e-3)

    def length(t: Floats) -> Floats:
        z = np.clip((t - BEGIN) / seconds, 0, 1)
        return begin + (end - begin) * z * z * (3 - 2 * z)

    return length, seconds


def exact(row: list[Speaking], first: int, last: int, seconds: float) -> Floats:
    """u (n,) at SENSOR of the same string, by the solution of the wave equation over a changing length l(t).

    With x from the saddle u = a(t - x / c) - a(t + x / c), and a(t + l / c) = a(t - l / c) at the moving end, which
    reflects arriving waves (d'Alembert 1747, Moore 1970).
    """
    length, _ = way(row, first, last)
    begin = row[first].length
    c = 2 * row[0].length * row[0].fundamental
    j = np.arange(1, MODES * 10 // 9 + 1)
    k = j * np.pi / begin
    x = begin - PLACE
    q = APEX * begin / (x * PLACE) * (2 / begin) * np.sin(k * x) / k**2 * np.exp(-((k * WIDTH) ** 2) / 2)
    q *= (-1.0) ** (j - 1) / 2
    times = np.linspace(-0.02, seconds + 0.02, 100_001)
    arrive = times + length(times) / c

    def wave(y: Floats) -> Floats:
        y = y.copy()
        while (late := y > begin / c).any():
            t = np.interp(y[late], arrive, times)
            for _ in range(3):  # Newton: the time of leaving the end
                speed = (length(t + 1e-7) - length(t - 1e-7)) / 2e-7
                t -= (t + length(t) / c - y[late]) / (1 + speed / c)
            y[late] = t - length(t) / c
        return np.concatenate([-np.sin(np.outer(part * c, k)) @ q for part in np.array_split(y, 20)])

    t = np.arange(round(seconds * RATE)) / RATE
    return np.asarray(wave(t - SENSOR / c) - wave(t + SENSOR / c))


@pytest.mark.parametrize(
    ("name", "first", "last"),
    [("G", 2, 7), ("G", 7, 2), ("G", 4, 3), slow("E", 0, 12), ("E", 12, 3)],
)
def test_a_glide_is_that_of_a_string_whose_end_moves(name: str, first: int, last: int) -> None:
    """Third octaves of the velocity during the glide and after, bands within 40 dB; required are 2.5 dB."""
    row = row_of_strings(name)
    _, takes = way(row, first, last)
    seconds = BEGIN + takes + 0.1
    ours, theirs = (np.diff(w) * RATE for w in (glide(row, first, last, seconds), exact(row, first, last, seconds)))
    ends = [0, round(BEGIN * RATE), round((BEGIN + takes) * RATE), len(ours)]
    for begin, end in pairwise(ends):
        a, b = (third_octaves(w[begin:end], RATE) for w in (ours, theirs))
        loud = b > b.max() - 40
        apart = np.abs(a - b)[loud]
        assert apart.mean() < 1.25, apart


@pytest.mark.parametrize(("name", "first", "last"), [("G", 2, 7), ("G", 7, 2), ("E", 5, 3)])
def test_a_glide_has_no_tones_at_the_rate_of_its_hand_overs(name: str, first: int, last: int) -> None:
    """Three partials below 1 kHz: all else above, and at multiples of 1 kHz beside them, is 60 dB down."""
    row = row_of_strings(name)
    _, takes = way(row, first, last)
    sound = np.diff(glide(row, first, last, BEGIN + takes, partials=3))[round(BEGIN * RATE) :]
    levels = 20 * np.log10(np.abs(np.fft.rfft(sound * np.blackman(sound.size))))
    frequency = np.fft.rfftfreq(sound.size, 1 / RATE)
    assert frequency[np.argmax(levels)] < 500
    assert levels[frequency > 950].max() < levels.max() - 60


def sliding_notes(seed: int, seconds: float) -> list[tuple[int, int, int, int]]:
    """Messages (frame, status, first, second) that slide, and interrupt slides with all other kinds."""
    rng = np.random.default_rng(seed)
    frames = np.sort(rng.integers(10, round(seconds * RATE), round(60 * seconds))).tolist()
    messages = [(0, 0xB0, 65, 127), (0, 0xB0, 1, 100), (1, 0x90, 45, 100)]
    for frame in frames:
        kind, key = int(rng.integers(0, 20)), int(rng.integers(28, 63))
        value = int(rng.integers(1, 128))
        rare = {
            0: (0xB0, 120, 0), 1: (0xB0, 123, 0), 2: (0xE0, 0, value), 3: (0x90, 12, 100), 4: (0x80, 12, 0),
            5: (0xB0, 65, 0), 6: (0xB0, 9, value), 7: (0xB0, 68, value),
        }  # fmt: skip
        messages.append((frame, *rare.get(kind, (0x80 if kind < 11 else 0x90, key, value))))
        if kind in (0, 1, 5):  # continues
            messages += [(frame + 5, 0xB0, 65, 127), (frame + 6, 0x90, key, 110)]
    return sorted(messages)


@pytest.mark.parametrize("preset", ["fretless", "paper-fretless"])
def test_blocks_may_be_split_while_fingers_glide(preset: str) -> None:
    notes = sliding_notes(3, 0.6)
    score = Score(
        np.array([n[0] for n in notes]), np.array([n[1:] for n in notes], np.uint8), 30_000, len(notes), "glides", RATE
    )
    whole = in_blocks(score, [10**9], preset)
    assert np.isfinite(whole).all() and whole.any()
    for sizes in ([64], [1000, 1, 63, 65, 7]):
        assert np.array_equal(in_blocks(score, sizes, preset), whole), sizes


def test_running_ahead_changes_no_glide() -> None:
    notes = sliding_notes(4, 0.8)
    sizes = np.random.default_rng(1).choice([1, 17, 64, 129], 1000).tolist()
    assert np.array_equal(played_ahead("fretless", notes, RATE, sizes), offline("fretless", notes, RATE))


@pytest.mark.parametrize("seed", [5, slow(6), slow(7)])
def test_whatever_interrupts_a_glide_the_sound_is_sane(seed: int) -> None:
    """Finite, within full scale without a limiter, no motion scaled back, silent after panic."""
    synth, device = synth_and_device("fretless", adaptive=False)
    for frame, *message in sliding_notes(seed, 3.0):
        while frame >= synth.frame + 64:
            assert np.abs(device.block(64)).max() < 1
        assert synth.send(*message, frame=frame)
    assert np.abs(device.block(4800)).max() < 1
    assert [int(v.record["weakened"][0]) for v in bass_of(synth).engine.voices] == [0] * 4
    synth.panic()
    device.block(RATE)
    assert not device.block(RATE).any() and synth.meters().faults == 0


def test_operators_may_change_while_a_finger_glides() -> None:
    """Overload swaps in coarse ones, and back."""
    synth, device = synth_and_device("fretless")
    load, bass = Load(synth), bass_of(synth)
    for message in ((0xB0, 65, 127), (0x90, 19, 100), (0x90, 45, 100)):
        synth.send(*message)
    device.block(9600)
    synth.send(0x90, 55, 100)
    device.block(3000)
    assert int(bass.engine.voices[3].slots["between"].any())
    load.share = 0.9
    for _ in range(bass.engine.strings):
        device.block(64)
    load.share = 0.0
    assert 3 in bass.coarse_strings
    assert 0 < np.abs(device.block(3000)).max() < 0.5
    block.return_to_clock(synth.address)
    assert not bass.coarse_strings
    assert 0 < np.abs(device.block(3000)).max() < 0.5
    assert not bass.engine.voices[3].slots["between"][int(bass.engine.voices[3].record["slot"][0])]


@pytest.mark.parametrize(("preset", "glides"), [("jazz-finger", False), ("fretless", True)])
def test_only_strings_that_glide_have_memory_for_it(preset: str, glides: bool) -> None:
    engine = Engine(load_preset(preset), QUALITIES["live"], RATE)
    assert [bool(voice.string["between"][0]) for voice in engine.voices] == engine.strings * [glides]
