"""Harmonics, measured on the modes: modes without a node under the finger go, the others stay."""

from __future__ import annotations

import numpy as np
import pytest
from support.hands import loaded
from support.messages import send_now
from support.motion import mode_speeds
from support.played import event
from support.quiet import engine

from livebass.engine.prepare import Voice, play_frames
from livebass.kernels.player import fingering, touches
from livebass.kernels.string.records import PLUCK, TOUCH_EVENT
from livebass.model.keymap import MODO
from livebass.rows.arrays import Floats

RATE = 48000
STRINGS = [("five-string", 0), ("jazz-finger", 0), ("jazz-finger", 3)]
NUMBERS = range(2, 9)
MEASURED = 48  # modes
SWITCHES = {(action, value): key for key, action, value in MODO.keys}


def speeds(string: Voice) -> Floats:
    """The amplitude of each mode (MEASURED,), as a velocity, of both polarisations."""
    return mode_speeds(string, MEASURED)


def rest(preset: str, i: int, number: int) -> float:
    """The time (s) for which the finger lies on the node."""
    period = 2 * float(engine(preset).pool.records[i, 0]["length"]) / float(engine(preset).pool.records[i, 0]["speed"])
    return max(touches.NODE_TIME, touches.NODE_PERIODS[number - 2] * period)


def play(
    preset: str, i: int, above: int, velocity: int, times: list[float], technique: str = "harmonic"
) -> tuple[Floats, int]:
    """`speeds` (times, MEASURED) at `times` after the release of a harmonic, played by keys on string `i`; its fret.

    The key is `above` semitones above the open string.
    """
    player = engine(preset)
    key = player.instrument.strings[i].open_note
    keys = [SWITCHES["string", key % 12], SWITCHES[technique, 0], key + above]
    send_now(player, *[(0x90, k, velocity) for k in keys])
    found, at = [], 0
    for t in times:
        frame = round((player.instrument.player.pull_time + t) * RATE)
        player.process(frame - at)
        at = frame
        found.append(speeds(player.voices[i]))
    assert [v.sounding() for v in player.voices] == [k == i for k in range(len(player.voices))]
    return np.array(found), player.voices[i].note()[0]


def natural(preset: str, i: int, number: int, velocity: int, times: list[float]) -> Floats:
    """`play` for the natural harmonic `number`."""
    speed, fret = play(preset, i, fingering.HARMONICS[number - 2], velocity, times)
    assert fret == 0
    return speed


def others(speed: Floats, number: int, maximum: int = MEASURED) -> Floats:
    """dB by time: the strongest mode up to `maximum` without a node there, relative to the harmonic's strongest."""
    j = np.arange(1, MEASURED + 1)
    kept = j % number == 0
    return 20 * np.log10(speed[:, ~kept & (j <= maximum)].max(axis=1) / speed[:, kept].max(axis=1))


@pytest.mark.parametrize(("preset", "i"), STRINGS)
@pytest.mark.parametrize("velocity", [30, 80])
def test_odd_partials_are_gone_30_ms_after_the_release(preset: str, i: int, velocity: int) -> None:
    """At fret 12, for 8 partials: 60 dB, as required; 35 for a low B, where a wave from the bridge takes longer."""
    (level,) = others(natural(preset, i, 2, velocity, [0.03]), 2, 8)
    assert level < (-35 if preset == "five-string" else -60), level


@pytest.mark.parametrize("number", NUMBERS)
@pytest.mark.parametrize(("preset", "i"), STRINGS)
def test_only_the_harmonic_is_left_and_the_others_do_not_come_back(preset: str, i: int, number: int) -> None:
    """They are 60 dB below the harmonic when the finger lifts (55 for the 7th and 8th), and never rise from there."""
    lifted = rest(preset, i, number) + 0.02
    speed = natural(preset, i, number, 80, [lifted, lifted + 0.3, lifted + 1.0])
    assert others(speed, number)[0] < (-60 if number < 7 else -55), others(speed, number)
    gone = np.arange(1, MEASURED + 1) % number > 0
    assert speed[1:, gone].max() < 1.1 * speed[0, gone].max()


@pytest.mark.parametrize("number", NUMBERS)
@pytest.mark.parametrize(("preset", "i"), STRINGS)
def test_the_finger_spares_the_harmonic(preset: str, i: int, number: int) -> None:
    """Its partials up to 8, plucked where all move a little: the finger takes under 2 dB of each in 150 ms."""
    level = []
    for firm in (0.0, touches.NODE_RESISTANCE[number - 2]):
        player = engine(preset)
        string, op = player.voices[i], player.pool.records[i, 0]
        length, speed = float(op["length"]), float(op["speed"])
        impedance = float(op["fine"]) ** 2 / float(op["weight"]) * speed
        pluck = event(PLUCK, apex=1e-3, place=0.77 * length, width=5e-3)
        finger = event(
            TOUCH_EVENT, finger=touches.NODE_FINGER, place=length - length / number, width=touches.NODE_WIDTH,
            resistance=firm * impedance, seconds=rest(preset, i, number),
        )  # fmt: skip
        play_frames(string, player.pool.records[i], np.concatenate([pluck, finger]), np.zeros(round(0.154 * RATE)))
        level.append(20 * np.log10(speeds(string)))
    kept = [j for j in range(1, 9) if j % number == 0]
    lost = [float(level[0][j - 1] - level[1][j - 1]) for j in kept]
    assert max(lost) < 2, lost


def is_natural(preset: str, i: int, fret: int) -> bool:
    """True if that note is a natural harmonic of any string, which then replaces the artificial one."""
    opens = [s.open_note for s in loaded(preset).strings]
    return any(opens[i] + fret - note in fingering.HARMONICS[: fingering.UNCALLED] for note in opens)


ARTIFICIAL = [(*s, fret) for s in STRINGS for fret in (1, 2, 3, 5, 8, 10, 11) if not is_natural(*s, fret)]


@pytest.mark.parametrize(("preset", "i", "fret"), ARTIFICIAL)
def test_an_artificial_harmonic_is_the_octave_of_its_fret(preset: str, i: int, fret: int) -> None:
    """Odd partials are 30 dB below the octave, as required; measured: 44 at 30 ms, 85 at 0.1 and 0.3 s.

    At full force it swings against frets, which revive odd ones: the first 8 partials' stay 30 dB below.
    """
    soft = (44, 85, 85), MEASURED
    for velocity, (minimum, maximum) in ((30, soft), (80, soft), (127, ((30, 30, 30), 8))):
        speed, stopped = play(preset, i, fret, velocity, [0.03, 0.1, 0.3])
        assert stopped == fret and (np.argmax(speed, axis=1) == 1).all()
        assert (others(speed, 2, maximum) < -np.array(minimum)).all(), (velocity, others(speed, 2, maximum))


@pytest.mark.parametrize("fret", [2, 7, 12])
@pytest.mark.parametrize(("technique", "number"), [("artificial", 2), ("artificial_12th", 3), ("artificial_15th", 4)])
@pytest.mark.parametrize("i", [0, 3])
def test_artificial_harmonics_have_keys_of_their_own(i: int, technique: str, number: int, fret: int) -> None:
    """At fret 7 and 12, too, where the key of all harmonics means natural ones."""
    speed, stopped = play("jazz-finger", i, fret, 80, [0.15], technique)
    assert stopped == fret and int(np.argmax(speed[0])) + 1 == number
    assert others(speed, number, 8)[0] < -30, others(speed, number, 8)


@pytest.mark.parametrize(("i", "fret"), [(0, 3), (3, 5)])
def test_a_pinch_leaves_its_partial(i: int, fret: int) -> None:
    (speed,), stopped = play("jazz-finger", i, fret, 100, [0.5], "pinch")
    number = int(np.argmax(speed)) + 1
    assert stopped == fret and 3 <= number <= 8 and others(speed[None], number, 8)[0] < -30


def test_harmonics_reach_beyond_the_last_fret() -> None:
    """The G string of 20 frets ends at 63; its harmonics 4 to 6 are at 67, 71 and 74."""
    for number, key in ((4, 67), (5, 71), (6, 74)):
        player = engine("jazz-finger")
        send_now(player, (0x90, 17, 100), (0x90, key, 90))
        player.process(RATE // 2)
        speed = speeds(player.voices[3])
        assert int(np.argmax(speed)) + 1 == number and player.report().transposed == 0


def test_a_key_that_calls_a_string_has_its_harmonic() -> None:
    """E4 is the 3rd harmonic of A and the 4th of E."""
    for switch, i, number in ((None, 1, 3), (16, 0, 4), (9, 1, 3)):
        player = engine("jazz-finger")
        send_now(player, *[(0x90, k, 90) for k in (switch, 17, 52) if k is not None])
        player.process(RATE // 2)
        assert player.voices[i].sounding() and int(np.argmax(speeds(player.voices[i]))) + 1 == number
