"""Parameters and other typed events in the synth's rings: frame-exact, in any blocks, ahead of the clock or not.

Default values change nothing at all; whatever a host sends, the sound stays finite.
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from support.levels import rms
from support.live import RATE, offline, run_ahead, synth_and_device
from support.own_basses import load_preset
from support.quiet import without_noise

from livebass import Instrument, Quality
from livebass.engine.prepare import coil_filter
from livebass.kernels.pickup.tone import ABOVE, BELOW, ROW, TONES
from livebass.kernels.player.words import MIDI, NOTE_BEND, NOTE_PLACE, NOTE_STRING, STRING_BEND
from livebass.live.synth import RING, LiveBass, Synth
from livebass.live.thread.ring import push_event, push_message
from livebass.rows import techniques
from livebass.rows.arrays import Floats
from livebass.rows.techniques import AMOUNT, PARAMETER

MOVED = (4, 5, 7, 9, 17, 17, 18, 18, 18, *range(102, 110))  # controllers of hand, bend, volume, palm, tone, blend, ...
LIGHT = Quality("light", 60, 192e3)
Event = tuple[int, int, int, float]  # frame, kind, number or MIDI message, value


def push(synth: Synth, event: Event) -> None:
    frame, kind, number, value = event
    ring = synth.rings[2].ctypes.data
    if kind == MIDI:
        push_message(ring, RING, frame, number & 0xFF, number >> 8 & 0xFF, number >> 16)
    else:
        push_event(ring, RING, frame, kind, number, value)


def midi(frame: int, status: int, first: int, second: int = 0) -> Event:
    return frame, MIDI, status | first << 8 | second << 16, 0.0


def random_events(seed: int, frames: int, count: int) -> list[Event]:
    """Hard notes, bends and typed events of every kind, by frame."""
    rng = np.random.default_rng(seed)
    events: list[Event] = []
    for frame in np.sort(rng.integers(0, frames, count)).tolist():
        key, x = int(rng.integers(28, 60)), float(rng.uniform(-1, 1))
        parameter = int(rng.integers(0, techniques.PARAMETERS))
        minimum, maximum = techniques.MINIMUM[parameter], techniques.MAXIMUM[parameter]
        value = minimum + 0.5 * (x + 1) * (maximum - minimum)
        events += [
            [midi(frame, 0x90, key, int(rng.integers(60, 128))), midi(frame + 2000, 0x80, key)],
            [midi(frame, 0xE0, 0, int(rng.integers(0, 128)))],
            [(frame, PARAMETER, parameter, value)],
            [(frame, PARAMETER, parameter, value)],
            [(frame, PARAMETER, techniques.TONE_POT, x)],
            [(frame, STRING_BEND, int(rng.integers(0, 4)), 2 * x)],
            [(frame, NOTE_PLACE, key, x), midi(frame, 0x90, key, 100)],
            [(frame, NOTE_STRING, key, float(rng.integers(-1, 5))), midi(frame, 0x90, key, 100)],
            [midi(frame, 0x90, key, 100), (frame + 50, NOTE_BEND, key, 3 * x)],
            [midi(frame, 0xB0, int(rng.choice(MOVED)), int(rng.integers(0, 128)))],
            [midi(frame, 0xB0, int(rng.choice(MOVED)), int(rng.integers(0, 128)))],
        ][int(rng.integers(0, 11))]
    return sorted(events, key=lambda event: event[0])


def play(
    events: list[Event], frames: int, sizes: list[int], how: str = "never", preset: str | Instrument = "slap"
) -> Floats:
    """The sound of `frames` frames in blocks of `sizes`, in turn."""
    synth, device = synth_and_device(preset, LIGHT)
    run_ahead(synth, how)
    out, sent, k = [], 0, 0
    while sum(map(len, out)) < frames:
        size = sizes[k % len(sizes)]
        while sent < len(events) and events[sent][0] < synth.frame + size:
            push(synth, events[sent])
            sent += 1
        out.append(device.block(size))
        k += 1
    assert synth.meters().faults == 0
    return np.concatenate(out)[:frames]


@pytest.mark.parametrize("seed", [1, 2])
def test_blocks_and_running_ahead_change_nothing(seed: int) -> None:
    """Tests two laws with events of every kind at any frame."""
    events = random_events(seed, RATE, 150)
    wanted = play(events, RATE, [512])
    assert np.abs(wanted).max() > 0.05
    for sizes in ([64], [37, 700, 1, 2000]):
        assert np.array_equal(play(events, RATE, sizes), wanted), sizes
    for sizes in ([64], [333]):
        assert np.array_equal(play(events, RATE, sizes, "far"), wanted), sizes


def test_usual_values_change_nothing() -> None:
    notes = [(0, 0x90, 40, 120), (9000, 0x90, 47, 90), (20000, 0x80, 40, 0), (30000, 0xE0, 0, 90)]
    events = [midi(*note) for note in notes]
    rng = np.random.default_rng(3)
    for frame in rng.integers(0, RATE, 60).tolist():
        events.append((frame, PARAMETER, frame % techniques.PARAMETERS, 0.0))
        events.append((frame, STRING_BEND, frame % 4, 0.0))
        events.append((frame, AMOUNT, techniques.CC_PALM if frame % 2 else techniques.CC_VIBRATO, 0.0))
    wanted = offline("slap", notes, RATE, LIGHT)
    assert np.array_equal(play(sorted(events, key=lambda e: e[0]), RATE, [256]), wanted)


def brightness(sound: Floats) -> float:
    """Root mean square of the differences, relative to the sound's."""
    return rms(np.diff(sound)) / rms(sound)


def one_note(
    number: int, value: float, preset: str = "jazz-finger", kind: int = PARAMETER, velocity: int = 100
) -> Floats:
    """A note from 4800 to 24000, after an event."""
    events = [(100, kind, number, value), midi(4800, 0x90, 33, velocity), midi(24000, 0x80, 33)]
    return play(events, 36000, [512], preset=preset)


def test_every_parameter_does_what_it_says() -> None:
    default = one_note(techniques.GAIN_DB, 0.0)
    assert np.allclose(
        one_note(techniques.GAIN_DB, -6.0)[12000:], default[12000:] * 10 ** (-6 / 20), rtol=1e-4, atol=1e-9
    )
    assert np.abs(one_note(techniques.GAIN_DB, -60.0)[12000:]).max() < 1e-18
    tones = [brightness(one_note(techniques.TONE_POT, x, velocity=120)) for x in (-1.0, -0.5, 0.0, 1.0)]
    assert tones == sorted(tones) and tones[0] < 0.6 * tones[-1]
    forces = [rms(one_note(techniques.DYNAMICS, x)) for x in (-12.0, 0.0, 12.0)]
    assert forces == sorted(forces) and forces[0] < 0.6 * forces[1]
    assert not np.array_equal(one_note(techniques.TECHNIQUE, techniques.THUMB_ON_ALL), default)
    assert np.array_equal(one_note(techniques.TECHNIQUE, techniques.PLUCKED), default)
    tails = [rms(one_note(techniques.HAND_DAMPING, x)[30000:]) for x in (1.0, 0.0, -1.0)]
    assert max(tails[:2]) < 0.05 * tails[2], "of either hand only what is faint is left"
    assert not np.array_equal(one_note(techniques.UNEVENNESS, 1.0), one_note(techniques.UNEVENNESS, -1.0))
    assert np.array_equal(one_note(NOTE_PLACE, 0.0), default)
    assert np.array_equal(one_note(33, 1.0, kind=NOTE_PLACE), one_note(techniques.PLUCK_POSITION, 1.0))
    bent = play(
        [(0, PARAMETER, techniques.BEND_RANGE, 12.0), midi(1, 0xE0, 127, 127), midi(99, 0x90, 33, 90)], RATE, [512]
    )
    assert np.array_equal(bent, play([(0, STRING_BEND, 1, 12.0), midi(99, 0x90, 33, 90)], RATE, [512]))


@pytest.mark.parametrize(("function", "controller"), [(techniques.CC_PALM, 9), (techniques.CC_VIBRATO, 1)])
def test_an_amount_is_what_its_controller_does(function: int, controller: int) -> None:
    note, ends = midi(100, 0x90, 40, 100), (24000, 36000)
    moved = play([note, *(midi(at, 0xB0, controller, v) for at, v in zip(ends, (127, 0), strict=True))], RATE, [512])
    for maximum in (1.0, 7.0):
        set_ = [note, *((at, AMOUNT, function, x) for at, x in zip(ends, (maximum, 0.0), strict=True))]
        for how, sizes in (("never", [512]), ("far", [64])):
            assert np.array_equal(play(set_, RATE, sizes, how), moved), (how, sizes)
    assert not np.array_equal(moved, play([note], RATE, [512]))


def test_the_pluck_position_goes_from_the_bridge_over_the_usual_one_away_from_it() -> None:
    player = load_preset("jazz-finger").player
    wanted = {-1.0: player.pluck_farthest, 0.0: player.pluck_position, 1.0: player.pluck_nearest}
    for x, place in wanted.items():
        synth, device = synth_and_device("jazz-finger", LIGHT)
        push(synth, (0, PARAMETER, techniques.PLUCK_POSITION, x))
        push(synth, midi(1, 0xB0, 121))  # a reset of the controllers returns to it
        device.block(64)
        assert synth.bass and synth.bass.engine.performer["position"][0] == place


def test_a_note_place_is_for_one_note() -> None:
    notes = [midi(4800, 0x90, 33, 100), midi(24000, 0x90, 33, 100)]
    placed = play([(0, NOTE_PLACE, 33, 1.0), *notes], RATE, [512], preset="jazz-finger")
    default = play(notes, RATE, [512], preset="jazz-finger")
    always = play([(0, PARAMETER, techniques.PLUCK_POSITION, 1.0), *notes], RATE, [512], preset="jazz-finger")
    assert np.array_equal(placed[:24000], always[:24000]) and not np.array_equal(placed[:24000], default[:24000])
    assert not np.array_equal(placed[24000:], always[24000:])


def test_the_bend_of_a_note_ends_with_it() -> None:
    """The other strings keep their pitch, and so does the next note of the string."""
    notes = [midi(100, 0x90, 33, 100), midi(100, 0x90, 43, 100), midi(24000, 0x90, 33, 100)]
    bend = (100, NOTE_BEND, 33, 3.0)
    synth, device = synth_and_device("jazz-finger", LIGHT)
    for event in (*notes[:2], bend, (100, NOTE_BEND, 70, 1.0)):
        push(synth, event)
    device.block(4800)
    assert synth.bass
    ratios = [float(v.record["bend"][0]) for v in synth.bass.engine.voices]
    assert ratios == [1.0, pytest.approx(2 ** (3 / 12), rel=1e-12), 1.0, 1.0]
    push(synth, notes[2])
    device.block(24000)
    assert [float(v.record["bend"][0]) for v in synth.bass.engine.voices] == [1.0] * 4


def test_a_note_is_played_on_the_string_that_it_names_where_that_has_it() -> None:
    """A2 is on every string of four; a missing string leaves the choice unchanged."""
    notes = [midi(100, 0x90, 45, 100)]
    default = play(notes, 4800, [512])
    sounds = [play([(100, NOTE_STRING, 45, float(i)), *notes], 4800, [512]) for i in range(4)]
    assert [np.array_equal(sound, default) for sound in sounds] == [False, False, False, True]
    assert len({sound.tobytes() for sound in sounds}) == 4
    for i in (-1.0, 9.0, np.nan):
        assert np.array_equal(play([(100, NOTE_STRING, 45, i), *notes], 4800, [512]), default)
    low = [(100, NOTE_STRING, 30, 3.0), midi(100, 0x90, 30, 100)]  # not on the G string
    assert np.array_equal(play(low, 4800, [512]), play(low[1:], 4800, [512]))
    again = play([(100, NOTE_STRING, 45, 0.0), *notes, midi(2400, 0x90, 45, 100)], 4800, [512])
    assert np.array_equal(again[:2400], sounds[0][:2400]) and not np.array_equal(again[2400:], sounds[0][2400:])


def test_no_value_does_harm() -> None:
    """NaN means the default, other values are clamped to their limits, and unknown numbers and kinds are ignored."""
    rng = np.random.default_rng(5)
    events = []
    values = (np.nan, np.inf, -np.inf, 1e30, -1e30, 1e-40, 3.7)
    for frame in range(0, RATE, 300):
        kind, number = int(rng.integers(0, 256)), int(rng.integers(0, 256))
        kind = int(rng.choice([PARAMETER, STRING_BEND, NOTE_PLACE, NOTE_BEND, NOTE_STRING, AMOUNT, kind or 9]))
        number = number if rng.random() < 0.2 else int(rng.integers(0, techniques.PARAMETERS))
        events.append((frame, kind, number, float(rng.choice(values))))
        events.append(midi(frame, 0x90, 28 + frame // 300 % 30, 110))
    sound = play(events, RATE, [512])
    assert np.isfinite(sound).all() and np.abs(sound).max() > 0.1
    notes = [midi(100, 0x90, 33, 100)]
    strange = [(0, PARAMETER, k, np.nan) for k in range(techniques.PARAMETERS)]
    strange += [(0, PARAMETER, 200, 1.0), (0, 77, 1, 1.0)]
    strange += [(0, AMOUNT, techniques.CC_PALM, np.nan), (0, AMOUNT, techniques.CC_VIBRATO, -3.0), (0, AMOUNT, 99, 1.0)]
    assert np.array_equal(play([*strange, *notes], 4800, [512]), play(notes, 4800, [512]))


@pytest.mark.parametrize("preset", ["jazz-finger", "flatwound"])
@pytest.mark.parametrize("rate", [44100, 192000])
def test_the_tone_pot_is_stable_at_every_setting(preset: str, rate: int) -> None:
    """All filters, intermediate ones too, have their poles inside the unit circle; the middle is the bass's own."""
    bass = load_preset(preset)
    coil, gain = bass.output.coil, bass.output.gain
    live = LiveBass(bass, LIGHT, rate)
    place = (int(live.record["tones"][0]) - live.address) // 8
    rows = live.memory[place : place + TONES * ROW].reshape(TONES, ROW)
    assert np.array_equal(rows[BELOW, :4], live.engine.voices[0].record["b"][0])
    for k, tone in ((0, 0.0), (BELOW, coil.tone), (TONES - 1, 1.0)):
        b, a = coil_filter(coil.__class__(**{**vars(coil), "tone": tone}), rate)
        assert np.array_equal(rows[k, :4], b * gain) and np.array_equal(rows[k, 4:8], a), tone
    assert np.abs(rows[:, 9:12]).max() < 1
    assert ABOVE + BELOW + 1 == TONES
    for low, high in pairwise(rows):
        for part in (0.0, 0.3, 0.7):
            a = np.ones(1)
            for last in low[9:12] + part * (high[9:12] - low[9:12]):
                a = np.append(a, 0.0) + last * np.append(a, 0.0)[::-1]
            assert np.abs(np.roots(a)).max() < 1
            if part == 0.0:
                assert np.allclose(a, low[4:8], rtol=1e-6, atol=1e-9)


def test_the_tone_moves_without_a_click() -> None:
    """Turning the pot under a ringing note adds no jump beyond the note's own."""
    note = midi(0, 0x90, 28, 120)
    default = play([note], RATE, [512], preset="jazz-finger")
    turns = [(24000, PARAMETER, techniques.TONE_POT, -1.0), (36000, PARAMETER, techniques.TONE_POT, 1.0)]
    turned = play([note, *turns], RATE, [512], preset="jazz-finger")
    assert np.array_equal(turned[:24000], default[:24000])
    steps, limit = np.abs(np.diff(turned[20000:])), np.abs(np.diff(default[20000:])).max()
    assert steps.max() < 1.2 * limit


@pytest.mark.parametrize("preset", ["slap", "paper-bass"])
def test_strings_that_are_still_play_on_as_if_they_had_been_computed(preset: str) -> None:
    """Compared with strings that a repeated controller keeps awake; tone and bend move in between."""
    bass = without_noise(preset)
    low = bass.strings[0].open_note
    events = [midi(0, 0x90, low, 100), midi(4000, 0xB0, 120), (30000, PARAMETER, techniques.TONE_POT, -0.5),
              midi(31000, 0xE0, 0, 100), midi(70077, 0x90, low, 120), midi(70900, 0x90, low + 5, 120)]  # fmt: skip
    often = [midi(frame, 0xB0, 7, 127) for frame in range(0, 2 * RATE, 40)]
    wanted = play(sorted(events + often, key=lambda e: e[0]), 2 * RATE, [512], preset=bass)
    for how, sizes in (("never", [512]), ("never", [100, 7]), ("far", [64])):
        assert np.array_equal(play(events, 2 * RATE, sizes, how, bass), wanted), (how, sizes)
    assert not wanted[56000:70000].any() and wanted[70077:].any()
