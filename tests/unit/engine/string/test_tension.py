"""Tension that follows the motion, and the motion too small to count."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from support.motion import scale_motion
from support.own_basses import FRETTED, PLAYED, load_preset
from support.played import RATE, Played, event, single_frames
from support.strings import even, far_from_frets

from livebass import QUALITIES
from livebass.engine.engine import Engine
from livebass.engine.prepare import Voice, modal_row, play_frames
from livebass.kernels.bass.instrument import BEYOND
from livebass.kernels.string.records import BEND, BLOCK, EVENT, GAIN, HAND, PLUCK

LOOK = 64  # frames
MINIMUM = 1e-7  # of the tension


def tension_added(string: Played) -> float:
    """The tension added by the motion, relative to the tension."""
    slot = string.voice.slots[int(string.record["slot"])]
    op = string.ops[int(slot["fret"])]
    slope = 0.0
    for name, count in (("u", int(slot["active"])), ("v", int(slot["v_active"]))):
        bent = np.arange(1, count + 1) * np.pi / float(op["length"]) * modal_row(slot[name], "q")[:count]
        slope += float(bent @ bent)
    return float(string.record["stretch"]) * slope * float(op["weight"]) / float((op["fine"] * op["speed"]) ** 2)


def pluck(string: Played, apex: float) -> None:
    place = 0.8 * float(string.ops[0]["length"])
    string.play(event(PLUCK, 0, apex=apex, place=place, width=2e-3, seconds=1e-4, angle=0.5))
    while string.hands()[0]:
        string.play(np.zeros(0, EVENT))


@pytest.mark.parametrize("quality", ["live", "studio", "reference"])
@pytest.mark.parametrize("preset", ["jazz-finger", "slap"])
def test_tension_is_left_out_of_small_motion_alone(preset: str, quality: str) -> None:
    """With float64 modes it never is; a hand ends it."""
    string = Played(preset, 3, quality)
    pluck(string, 1e-3)
    slot = string.voice.slots[int(string.record["slot"])]
    none, out, steady = np.zeros(0, EVENT), np.zeros(LOOK), []
    rings, lasts = round(0.2 * RATE / LOOK), round(0.59 * RATE / LOOK)
    for k in range(lasts):
        now = none
        if k == rings:
            now = event(HAND, value=30.0)  # /s
            now["frame"] = int(string.record["frame"])
        play_frames(string.voice, string.ops, now, out)
        if not slot["on"]:
            break
        steady.append(bool(slot["steady"]))
        if steady[-1]:
            assert tension_added(string) < MINIMUM
    assert len(steady) == lasts and not any(steady[:rings])
    assert steady[-1] == (quality != "reference")
    string.frame = int(string.record["frame"])
    pluck(string, 1e-3)
    assert not slot["steady"]


@pytest.mark.parametrize("preset", PLAYED)
@pytest.mark.parametrize("i", [0, 3])
def test_a_wide_swing_is_sharp_as_a_stretched_string_is(preset: str, i: int) -> None:
    """Duffing's law: swinging in its fundamental by A alone, the string gains 3 E A k^4 A^2 / (16 l mu omega) rad/s."""
    bass, swing, seconds = even(far_from_frets(load_preset(preset), axes_turned=0.0)), 4e-3, 0.25
    slack = replace(bass, strings=tuple(replace(s, axial_stiffness=0.0) for s in bass.strings))
    ends = []
    for instrument in (bass, slack):
        engine = Engine(instrument, QUALITIES["studio"], RATE)
        voice, ops = engine.voices[i], engine.pool.records[i]
        play_frames(voice, ops, event(PLUCK, apex=1e-3, place=0.4), np.zeros(round(0.02 * RATE)))
        slot = voice.slots[int(voice.record["slot"][0])]
        scale_motion(slot, 0.0)
        low = slot["u"]["low"]
        low["q"][0] = swing
        play_frames(voice, ops, np.zeros(0, EVENT), np.zeros(round(seconds * RATE)))
        omega = float(slot["u"]["omega"][0])
        ends.append(complex(low["q"][0], -low["pace"][0] * low["p"][0] / omega))
    string, loss = bass.strings[i], 2 * np.log(swing / abs(ends[1]))
    stretch = string.axial_stiffness / (2 * (string.length + BEYOND))
    square = swing**2 * (1 - np.exp(-loss)) / loss  # on average
    wanted = 3 / 8 * stretch * (np.pi / string.length) ** 4 * square / (string.linear_density * omega)
    gained = np.angle(ends[0] / ends[1]) / seconds
    assert wanted * seconds > 0.1 and abs(gained / wanted - 1) < 0.02, (gained, wanted)


def play_singly(voice: Voice, ops: np.ndarray, pluck: np.ndarray, change: Callable[[float], float]) -> None:
    """Plays 50 ms of a pluck by single frames, and one more after a change of `stretch`."""
    frame, events = 0, np.concatenate([pluck, single_frames(1, RATE)])
    while frame < RATE // 20 or voice.slots[int(voice.record["slot"][0])]["fourth"] not in (1, 2):
        events = events[play_frames(voice, ops, events[:1], np.zeros(1)) :]
        frame += 1
    voice.record["stretch"] = change(float(voice.record["stretch"][0]))
    play_frames(voice, ops, events[:1], np.zeros(1))


@pytest.mark.parametrize("preset", PLAYED)
def test_only_modes_that_turn_by_less_than_a_radian_a_frame_are_stretched(preset: str) -> None:
    """In whole blocks, by their own frequencies: a stiff string has fewer of them than an ideal one."""
    made, ends = Engine(even(far_from_frets(load_preset(preset))), QUALITIES["live"], RATE), []
    for part in (1.0, 0.0):
        voice = made.another().voices[0]
        pluck = event(PLUCK, apex=2e-3, place=0.8, width=1e-3, seconds=1e-5)
        play_singly(voice, made.pool.records[0], pluck, lambda stretch, part=part: part * stretch)
        slot = voice.slots[int(voice.record["slot"][0])]
        ends.append(modal_row(slot["u"], "p")[: int(slot["active"])])
    stretched = 1 + int(np.flatnonzero(ends[0] != ends[1])[-1])
    omega = slot["u"]["omega"]
    assert stretched % BLOCK == 0 and omega[stretched - 1] < RATE < omega[stretched + BLOCK - 1]


@pytest.mark.parametrize("preset", PLAYED)
def test_the_tension_grows_by_a_fifth_at_most(preset: str) -> None:
    """However far the string swings: the kick of a frame is that of a fifth of the tension."""
    made, ends = Engine(even(far_from_frets(load_preset(preset))), QUALITIES["live"], RATE), []
    for much in (1e9, 0.0):
        voice = made.another().voices[0]
        pluck = event(PLUCK, apex=2e-3, place=0.7)
        play_singly(voice, made.pool.records[0], pluck, lambda _, much=much: much)
        low = voice.slots[int(voice.record["slot"][0])]["u"]["low"]
        ends.append((low["pace"][:8] * low["p"][:8], low["q"][:8].copy()))
    op = made.pool.records[0, 0]
    wave = np.arange(1, 9) * np.pi / float(op["length"])
    wanted = -0.2 * (float(op["speed"]) * wave) ** 2 * ends[1][1] / RATE
    assert ends[0][0] - ends[1][0] == pytest.approx(wanted, rel=1e-3)


@pytest.mark.parametrize("preset", FRETTED)
@pytest.mark.parametrize("octaves", [0, 5])
def test_a_vibrato_tightens_the_string_for_modes_that_turn_by_at_most_two_radians_a_frame(
    preset: str, octaves: int
) -> None:
    """In whole blocks; bent so far that the audio rate carries less than two blocks, for the lowest 8 modes."""
    depth, phase, ends = 0.5, 0.3, []
    for vibrates in (True, False):
        string = Played(preset, 0)
        string.play(event(PLUCK, 2, apex=5e-4, place=0.7, width=1e-3, seconds=1e-5, angle=0.4))
        string.play(event(BEND, value=2.0**octaves))
        string.let_ring(0.2 if octaves else 0.003)
        while string.slot()["fourth"] not in (1, 2):  # after which u and v do not exchange
            string.play(event(GAIN, value=1.0))
        if vibrates:
            string.record["depth"] = string.record["depth_wanted"] = depth
            string.record["phase"], string.record["waver"] = phase, 0.0
        string.play(event(GAIN, value=1.0))
        slot, op = string.slot(), string.ops[2]
        ends.append([[modal_row(slot[w], row) for w in "uv"] for row in ("q", "p", "pace")])
    (q, p, pace), (_, p_still, _) = (np.array(end) for end in ends)
    turn = slot["u"]["omega"][: int(op["modes"])] / RATE
    few = 8 if octaves else int(np.searchsorted(turn, 2.0)) // BLOCK * BLOCK
    changed = np.flatnonzero((p != p_still).any(axis=0))
    assert changed[-1] == few - 1 and turn[few - 1] < 2.0
    wave = np.arange(1, few + 1) * np.pi / float(op["length"])
    tighter = 2 ** (depth * (1 - np.cos(2 * np.pi * phase)) / 12) - 1
    wanted = -tighter * (float(op["speed"]) * 2**octaves * wave) ** 2 * q[:, :few] / RATE
    found = (pace * (p - p_still))[:, :few]
    assert np.abs(found - wanted).max() < 1e-4 * np.abs(wanted).max()
