"""The noise of hands: its level, bands and duration, and its independence of the way it is computed."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from support.costs import quick
from support.kept import image_made, read_kept
from support.levels import db, rms
from support.live import QUICK, offline, played_ahead, synth_and_device
from support.messages import messages_of, send, send_now
from support.motion import mode_speeds, scale_motion
from support.own_basses import AS_SHIPPED, FRETTED, PLAYED, load_preset
from support.played import Played, event
from support.scores import busy_score, play_in_blocks
from support.strings import even

from livebass import QUALITIES, Instrument, Score, render_to_array, score_of
from livebass.compiling import jit
from livebass.engine.basses import Basses
from livebass.engine.engine import Engine
from livebass.engine.image import image_of
from livebass.engine.prepare import play_frames
from livebass.kernels.hands.noise import next_rub
from livebass.kernels.string.frame import string_at
from livebass.kernels.string.records import HAND, PLUCK, RUBBING
from livebass.live.thread.block import is_still
from livebass.plugin.instrument import file_of, instrument_file
from livebass.rows.arrays import Floats
from livebass.rows.techniques import LEARNED, TONE_POT
from livebass.rows.units import OFF

RATE = 48000
NOISES = {"skin_noise": -14.0, "pick_noise": -30.0, "release_noise": 0.0}
ALL = {**NOISES, "floor_noise": -40.0, "hum": -40.0, "release_spread": 1.0, "fretting_noise": 10.0}


def note(velocity: int, preset: str = "jazz-finger", seconds: float = 1.0, **player: float) -> Floats:
    """A note of the second string at 0.1 s, ended after `seconds`."""
    made = even(preset, **player)
    score = score_of([(0.1, seconds, made.strings[1].open_note + 5, velocity)], RATE)
    return np.asarray(render_to_array(made, score, QUALITIES["live"], tail=0.5).sum(axis=0))


def band(x: Floats, low: float, high: float) -> Floats:
    """The part of `x` from `low` to `high` Hz."""
    spectrum = np.fft.rfft(x, 2 * x.size)
    nu = np.arange(spectrum.size) * RATE / (2 * x.size)
    return np.asarray(np.fft.irfft(spectrum * ((nu >= low) & (nu < high)))[: x.size])


def loudest(x: Floats, seconds: float) -> float:
    """The greatest rms of `seconds`."""
    n = round(seconds * RATE)
    return float(np.sqrt(np.convolve(x**2, np.ones(n) / n, "valid").max()))


def takes(velocity: int, seeds: int = 6, preset: str = "jazz-finger", **noise: float) -> list[Floats]:
    """The noise alone of a note, one per seed."""
    with_noise, made = even(preset, **noise), even(preset)
    key = made.strings[1].open_note + 5
    score = score_of([(0.1, 1.0, key, velocity)], RATE)
    silent = render_to_array(made, score, QUALITIES["live"], tail=0.5).sum(axis=0)
    engine = Engine(with_noise, QUALITIES["live"], RATE)
    blocks = (list(engine.another(seed).play(score, 0.5)) for seed in range(seeds))
    return [np.concatenate(block, axis=1).sum(axis=0) - silent for block in blocks]


# Level


@pytest.mark.parametrize(("velocity", "level"), [(60, -38.0), (90, -20.0), (127, -14.0)])
def test_skin_is_as_loud_as_of_real_players(velocity: int, level: float) -> None:
    peak = float(np.abs(note(velocity)).max())
    heard = np.median([db(loudest(x[: round(0.2 * RATE)], 2e-3) / peak) for x in takes(velocity, skin_noise=-14.0)])
    assert abs(heard - level) < 3.5


def test_skin_is_a_burst_of_highs_with_the_release() -> None:
    sounds = takes(127, skin_noise=-14.0)
    power = np.mean([x**2 for x in sounds], axis=0)
    begun = np.flatnonzero(power > 1e-12)[0]
    pull = round(load_preset("jazz-finger").player.pull_time * RATE)
    assert begun >= 0.1 * RATE - 1  # with the pull, not before
    at = round(0.1 * RATE) + pull
    n = round(1e-3 * RATE)
    levels = [power[at + k * n : at + (k + 1) * n].mean() for k in range(1, 12)]
    fall = -np.polyfit(np.arange(11) * 1e-3, np.log(levels) / 2, 1)[0]
    assert 1 / fall == pytest.approx(3.5e-3, rel=0.2)
    before = power[at - pull : at].mean()
    assert 0.0 < before < power[at : at + pull].mean()
    inside = sum(float(np.sum(band(x, 600.0, 5000.0) ** 2)) for x in sounds)
    assert inside > 0.8 * sum(float(np.sum(x**2)) for x in sounds)


@pytest.mark.parametrize("velocity", [30, 64, 127])
def test_a_pick_clicks_as_it_lands_and_as_it_lets_go(velocity: int) -> None:
    """As loud as the key says, under notes of any force; the second click is louder."""
    peak = float(np.abs(note(velocity, "precision-pick")).max())
    sounds = takes(velocity, preset="precision-pick", pick_noise=-30.0)
    assert abs(np.median([db(loudest(x, 2e-3) / peak) for x in sounds]) + 30.0) < 4.0
    power = np.mean([x**2 for x in sounds], axis=0)
    pull = round(load_preset("precision-pick").player.pull_time * RATE)
    first, between, second, after = (
        power[round(0.1 * RATE) + n :][: RATE // 1000].mean() for n in (0, pull - RATE // 1000, pull, 4 * pull)
    )
    assert second > 2 * first > 20 * between and second > 1000 * after
    inside = sum(float(np.sum(band(x, 1000.0, 6000.0) ** 2)) for x in sounds)
    assert inside > 0.8 * sum(float(np.sum(x**2)) for x in sounds)


def test_a_finger_and_a_pick_without_its_own_noise_make_skin_noise() -> None:
    finger = [note(100, skin_noise=-14.0, pick_noise=level) for level in (OFF, -30.0)]
    assert np.array_equal(*finger) and not np.array_equal(finger[0], note(100))
    pick = [note(100, "precision-pick", **noise) for noise in ({}, {"skin_noise": -14.0})]
    assert not np.array_equal(*pick)


def test_the_knock_of_a_release_is_within_6_db_of_recordings() -> None:
    """Peak relative to the note's after 1 s: +4 to +11 dB in recordings; 130 to 1300 Hz; 20 dB less in 30 to 90 ms."""
    sounds = takes(64, release_noise=0.0)
    played = note(64, seconds=1.2)
    rest = float(np.abs(played[round(1.1 * RATE) : round(1.2 * RATE)]).max())
    over = np.median([db(float(np.abs(x).max()) / rest) for x in sounds])
    assert -2.0 <= over <= 17.0
    assert not any(x[: round(1.1 * RATE) - 1].any() for x in sounds)
    spectrum = np.sum([np.abs(np.fft.rfft(x)) ** 2 for x in sounds], axis=0)
    nu = np.fft.rfftfreq(sounds[0].size, 1 / RATE)
    assert 130.0 <= spectrum @ nu / spectrum.sum() <= 1350.0
    assert spectrum[(nu > 100.0) & (nu < 1600.0)].sum() > 0.7 * spectrum.sum()
    power = np.mean([x**2 for x in sounds], axis=0)[round(1.1 * RATE) :]
    n = round(5e-3 * RATE)
    fall = [power[k * n : (k + 1) * n].mean() for k in range(24)]
    late = next(k for k in range(24) if fall[k] < 0.01 * max(fall)) * 5
    assert 30 <= late <= 90


def test_a_level_more_is_a_level_more() -> None:
    quiet = note(100)
    one = note(100, skin_noise=-20.0, release_noise=-10.0) - quiet
    more = note(100, skin_noise=-14.0, release_noise=-4.0) - quiet
    assert np.allclose(more, 10 ** (6 / 20) * one, atol=1e-5) and np.abs(one).max() > 1e-4


def endings(bass: Instrument, count: int = 12) -> list[tuple[float, float]]:
    """Level (m/s) and time (s) of the knocks that end notes one after another on a string."""
    engine = Engine(bass, QUALITIES["live"], RATE)
    key, found = bass.strings[1].open_note + 3, []
    for _ in range(count):
        send_now(engine, (0x90, key, 64))
        engine.process(RATE // 10)
        send_now(engine, (0x80, key, 64))
        engine.process(1)
        knock = engine.voices[1].record["knock"][0]
        fade = -np.log(knock["fade"]) * RATE
        found.append((float(knock["speed"] * np.exp(fade / RATE)), 1 / fade))
        engine.process(RATE // 2)
    return found


def test_ends_of_notes_differ_as_the_spread_says() -> None:
    """Level and time are drawn for each note; without a spread, all are alike."""
    alike = np.array(endings(even(release_noise=0.0)))
    assert alike == pytest.approx(np.tile([alike[0, 0], 22e-3], (len(alike), 1)), rel=1e-6)
    for spread in (0.5, 1.0):
        differ = np.array(endings(even(release_noise=0.0, release_spread=spread))) / alike
        levels, octaves = 20 * np.log10(differ[:, 0]), -np.log2(differ[:, 1])
        assert 4.5 * spread < np.ptp(levels) < 9.0 * spread and np.abs(levels).max() < 4.51 * spread
        assert 0.6 * spread < np.ptp(octaves) < 1.24 * spread
        assert octaves.min() > -0.33 * spread and octaves.max() < 0.93 * spread


def test_a_hand_is_as_much_firmer_as_it_is_quicker() -> None:
    bass = even(release_noise=0.0, release_spread=1.0)
    engine, key = Engine(bass, QUALITIES["live"], RATE), bass.strings[1].open_note
    found = []
    for _ in range(6):
        send_now(engine, (0x90, key, 64))
        engine.process(RATE // 10)
        send_now(engine, (0x80, key, 64))
        engine.process(RATE // 2)
        voice = engine.voices[1].record
        found.append(float(-voice["touches"][0, 1]["wanted"] / np.log(voice["knock"]["fade"][0])))
    assert found == pytest.approx([found[0]] * 6, rel=1e-6)


def test_a_cutoff_takes_the_highs_from_a_knock() -> None:
    """An octave: 1.5 to 4 kHz falls by 12 dB, less what the rest gains, as the level stays."""
    heard = []
    for cutoff in (300.0, 600.0):
        sounds = takes(64, release_noise=0.0, release_cutoff=cutoff)
        heard.append((np.median([rms(band(x, 1500.0, 4000.0)) for x in sounds]), np.median([rms(x) for x in sounds])))
    highs, whole = (db(float(bright / dull)) for dull, bright in zip(*heard, strict=True))
    assert 5.0 < highs < 10.0 and abs(whole) < 2.0


ROUND_AND_FLAT = ("jazz-finger" + AS_SHIPPED, "flatwound" + AS_SHIPPED)
FINGERS = {"fretting_noise": 1.0}


def fingers(messages: list[tuple[int, int, int, int]], preset: str = "jazz-finger", seconds: float = 2.0) -> Floats:
    """The fretting hand alone in a performance."""
    sounds = []
    for noise in (FINGERS, {}):
        engine = Engine(even(preset, **noise), QUICK, RATE)
        send(engine, messages)
        sounds.append(engine.process(round(seconds * RATE)))
    return np.asarray((sounds[0] - sounds[1]).sum(axis=0))


def moved(preset: str, gap: float = 0.4) -> list[tuple[int, int, int, int]]:
    """A fretted note at 0.1 s that ends at 0.5 s, and one elsewhere `gap` s later."""
    made = load_preset(preset)
    first, second = made.strings[0].open_note + 3, made.strings[1].open_note + 3
    again = round((0.5 + gap) * RATE)
    return [(RATE // 10, 0x90, first, 64), (RATE // 2, 0x80, first, 64), (again, 0x90, second, 64)]


@pytest.mark.parametrize("preset", ["jazz-finger", "flatwound", "upright"])
def test_a_finger_rubs_without_a_click(preset: str) -> None:
    """It leaves after its note, and comes down with the next one: each begins at 0 and ends before 0.3 s are over."""
    sound = fingers(moved(preset, 0.6), preset)
    at = [round(0.5 * RATE), round(1.1 * RATE)]
    assert not sound[: at[0]].any() and sound[at[0] : at[1]].any() and sound[at[1] :].any()
    assert not sound[at[0] : at[0] + round(0.11 * RATE)].any()
    for begin in (np.flatnonzero(sound)[0], at[1]):
        part = sound[begin : begin + round(0.3 * RATE)]
        n = RATE // 1000
        power = np.array([float(np.mean(part[k * n : (k + 1) * n] ** 2)) for k in range(len(part) // n)])
        assert power[0] < 0.5 * power.max() and power[-20:].max() < 1e-6 * power.max()
        half = len(power) // 2
        assert power[:half].sum() > power[half:].sum()


def test_round_windings_whistle_and_flat_strings_only_rub() -> None:
    """A finger passes windings one after another, so that its sound has a pitch: 1 to 4 kHz, over 20 ms."""
    standing_out = []
    for name in ROUND_AND_FLAT:
        sound, found = fingers(moved(name, 0.6), name)[round(1.12 * RATE) :], []
        for k in range(4):
            part = sound[k * RATE // 100 :][: RATE // 50] * np.hanning(RATE // 50)
            power = np.abs(np.fft.rfft(part)) ** 2
            heard = power[20:80]  # bins of 50 Hz
            found.append(heard.max() / np.median(heard))
        standing_out.append(np.median(found))
    assert standing_out[0] > 2 * standing_out[1], standing_out


def test_all_sound_off_ends_a_rub() -> None:
    messages = [*moved("jazz-finger"), (round(0.93 * RATE), 0xB0, 120, 0)]
    sound = fingers(messages)
    assert (
        np.abs(sound[round(0.92 * RATE) : round(0.93 * RATE)]).max() > 1e3 * np.abs(sound[round(0.97 * RATE) :]).max()
    )
    waits = [*moved("jazz-finger")[:2], (round(0.55 * RATE), 0xB0, 120, 0)]
    assert not fingers(waits).any()


def test_an_older_file_has_no_new_sounds_of_hands() -> None:
    """A file without the keys reads 0 for each, and plays, bit for bit, as with their defaults."""
    new = ("release_cutoff", "release_spread", "fretting_noise")
    bass = even(release_noise=0.0)
    fields = read_kept(instrument_file(even(release_noise=0.0, fretting_noise=1.0, release_spread=1.0)))
    old = {name: value for name, value in fields.items() if name.removeprefix("instrument.player.") not in new}
    assert len(old) == len(fields) - 3
    player = image_of(image_made(file_of(old))).numbers["player"]
    assert all(player[name][0] == 0 for name in new)
    sounds = []
    for cutoff in (0.0, 1300.0):
        engine = Engine(replace(bass, player=replace(bass.player, release_cutoff=cutoff)), QUICK, RATE)
        send(engine, moved("jazz-finger"))
        sounds.append(engine.process(2 * RATE))
    assert np.array_equal(*sounds)


# Frame by frame


SPEED, CLICK = 0.02, 0.05  # m/s, of skin and pick


def speeds(string: Played, frames: int, name: str) -> Floats:
    """The rms speed (m/s) of a noise after each of the next frames, (frames,)."""
    found = np.empty(frames)
    for k in range(frames):
        string.play(event(PLUCK)[:0])
        found[k] = string.record[name]["speed"]
    return found


def plucked(pull: int, wait: int) -> Played:
    """A string that a finger with a pick begins to pull: a frame of `wait + pull` has passed."""
    string = Played("jazz-finger", 1)
    string.record["pull"] = pull
    string.play(event(PLUCK, apex=1e-4, place=0.2, speed=SPEED, value=CLICK, wait=wait / RATE))
    return string


def assert_follows(found: Floats, wanted: Floats) -> None:
    """Noises of less than 1 um/s are none."""
    assert found == pytest.approx(np.where(wanted > 1e-6, wanted, 0.0), rel=1e-9, abs=0)
    assert found[-1] == 0.0 and found[found > 0].min() < 1.03e-6


@pytest.mark.parametrize("pull, wait", [(0, 0), (1, 0), (96, 0), (96, 50)])
def test_skin_grows_as_the_finger_pulls_and_fades_as_it_has_let_go(pull: int, wait: int) -> None:
    string = plucked(pull, wait)
    found = np.concatenate([[string.record["skin"]["speed"]], speeds(string, wait + pull + 2000, "skin")])
    t = np.arange(1, found.size + 1) - (wait if pull else 0)
    grown = np.clip(t / pull, 0.0, 1.0) if pull else 1.0
    assert_follows(found, SPEED * grown * np.exp(-np.maximum(t - pull, 0) / (3.5e-3 * RATE)))


@pytest.mark.parametrize("pull, wait", [(0, 0), (1, 0), (96, 0), (96, 50)])
def test_a_pick_clicks_as_it_lands_and_more_as_it_lets_go(pull: int, wait: int) -> None:
    string = plucked(pull, wait)
    found = np.concatenate([[string.record["click"]["speed"]], speeds(string, wait + pull + 2000, "click")])
    t, fades = np.arange(1, found.size + 1), 1.5e-3 * RATE
    after = t - pull - (wait if pull else 0)
    second = np.where(after > 0, CLICK * np.exp(-np.maximum(after, 0) / fades), 0.0)
    assert_follows(found, 0.3 * CLICK * np.exp(-t / fades) + second)


@pytest.mark.parametrize("wait", [0, 700])
def test_a_finger_that_rubs_sets_out_quickly_and_comes_to_rest(wait: int) -> None:
    """Its power follows its speed, which is greatest after a third of its time; what is left fades in 3 ms."""
    string, seconds = Played("jazz-finger", 1), 0.05
    frames = round(seconds * RATE)
    string.play(event(RUBBING, value=1.5, seconds=seconds, wait=wait / RATE))
    found = np.concatenate([[string.record["rub"]["speed"]], speeds(string, wait + frames + 3000, "rub")])
    x = np.clip((np.arange(found.size) + 1 - wait) / frames, 0.0, 1.0)
    level = 1.5 * 0.02 * float(string.record["medium"]) * np.sqrt(x * (1 - x) ** 2 * 27 / 4)
    wanted = np.empty(found.size)
    for k, now in enumerate(level):
        wanted[k] = max(now, wanted[k - 1] * np.exp(-1 / (3e-3 * RATE)) if k else 0.0)
    assert_follows(found, wanted)
    assert string.record["rub"]["frames"] == 0
    string.play(event(RUBBING, value=1.0, seconds=seconds, wait=0.1))
    string.play(event(RUBBING, value=0.0))
    assert not speeds(string, round(0.2 * RATE), "rub").any(), "it stays"


def test_a_finger_that_comes_down_takes_the_rest_of_the_last_rub_along() -> None:
    """While it waits, what sounds fades."""
    string = Played("jazz-finger", 1)
    string.play(event(RUBBING, value=1.0, seconds=0.1))
    sounds = speeds(string, 500, "rub")[-1]
    string.play(event(RUBBING, value=1.0, seconds=0.1, wait=0.1))
    assert speeds(string, 100, "rub") == pytest.approx(sounds * np.exp(-np.arange(2, 102) / (3e-3 * RATE)))


@jit
def rub_on(string: int, out: Any) -> None:
    """The next frames of a finger's rub on a STRING, m/s."""
    for k in range(len(out)):
        out[k] = next_rub(string_at(string).voice)


def test_windings_and_noise_share_the_power_of_a_rub() -> None:
    """A finger passes windings at up to 0.7 m/s, and is as loud as on a flat string; the windings have 0.7 of it."""
    pitch, seconds, heard = 4e-3, 20.0, []  # a wide pitch, so that many lines lie in the band
    x = np.arange(2, 8 * RATE + 2) / (seconds * RATE)
    moving = x * (1 - x) ** 2 * 27 / 4
    for wound in (0.0, pitch):
        string = Played("jazz-finger", 0)
        string.record["wound"] = wound
        string.play(event(RUBBING, value=1.0, seconds=seconds))
        out, passed = np.empty(x.size), []
        for part in out.reshape(-1, 1000):
            rub_on(string.voice.string.ctypes.data, part)
            passed.append(float(string.record["rub"]["passed"]))
        heard.append(out / float(string.record["rub"]["level"]))
    assert [rms(sound) for sound in heard] == pytest.approx([np.sqrt(moving.mean())] * 2, rel=0.05)
    turned = (np.array(passed) - 0.7 / pitch * np.cumsum(moving)[999::1000] / RATE) % 1.0
    assert np.minimum(turned, 1.0 - turned).max() < 0.01 and max(passed) < 1.0, "of a winding"
    noise_alone = heard[0] @ heard[1] / (heard[0] @ heard[0])  # the random numbers are the same
    assert noise_alone == pytest.approx(np.sqrt(0.3), rel=0.05)


@pytest.mark.parametrize("rate", [44_100, 96_000])
@pytest.mark.parametrize("cutoff, highest", [(900.0, 900.0), (130.0, 130.0), (100.0, 1300.0), (0.0, 1300.0)])
def test_bands_have_their_corners(rate: int, cutoff: float, highest: float) -> None:
    """A cutoff below the knock's lowest is none."""
    bass = even()
    engine = Engine(replace(bass, player=replace(bass.player, release_cutoff=cutoff)), QUICK, rate)
    ends = {"skin": (800.0, 5000.0), "click": (1200.0, 6000.0), "knock": (130.0, highest), "rub": (350.0, 2000.0)}
    for name, corners in ends.items():
        band = engine.voices[0].record[name]["band"][0]
        assert [-np.log1p(-band[end]) * rate / (2 * np.pi) for end in ("down", "up")] == pytest.approx(corners), name


def test_a_knock_at_0_db_is_as_loud_as_a_medium_note_after_1_s() -> None:
    """In the mean over basses, within 3 dB."""
    part, found = slice(round(1.1 * RATE), round(1.13 * RATE)), []
    for preset in PLAYED:
        knock = np.median([rms(x[part]) for x in takes(64, preset=preset, release_noise=0.0)])
        found.append(db(float(knock) / rms(note(64, preset, seconds=1.2)[part])))
    assert abs(np.mean(found)) < 3


# Conditions without noise


def test_off_is_as_without_the_keys() -> None:
    plain = note(120)
    assert np.array_equal(plain, note(120, skin_noise=OFF, release_noise=OFF))
    assert not np.array_equal(plain, note(120, **NOISES))


def test_a_hand_does_not_knock_on_a_string_at_rest() -> None:
    made = even("muted", release_noise=0.0)
    engine = Engine(made, QUALITIES["live"], RATE)
    key = made.strings[1].open_note
    engine.send(np.array([0]), np.array([[0x90, key, 40]], np.uint8))
    for _ in range(40):
        engine.process(RATE // 2)
        if not engine.sounding():
            break
    assert not engine.sounding()
    engine.process(RATE)
    engine.send(np.array([engine.frame]), np.array([[0x80, key, 40]], np.uint8))
    assert not engine.process(RATE).any()


def test_the_next_note_on_the_string_ends_one_without_a_knock() -> None:
    made, quiet = even(release_noise=0.0), even()
    key = made.strings[0].open_note + 3
    notes = [(0.1, 0.6, key, 100), (0.5, 0.4, key + 1, 100)]  # the string is taken while the first is held
    sounds = [render_to_array(b, score_of(notes, RATE), QUALITIES["live"], tail=0.4) for b in (made, quiet)]
    knock = (sounds[0] - sounds[1]).sum(axis=0)
    assert not knock[: round(0.85 * RATE)].any()
    assert knock[round(0.85 * RATE) :].any()  # a hand ends the second one


def test_a_note_that_has_all_but_died_ends_with_less() -> None:
    loud, faint = (loudest((note(100, seconds=s, release_noise=0.0) - note(100, seconds=s))[-RATE // 2 :], 0.01)
                   for s in (0.3, 20.0))  # fmt: skip
    assert 0.0 < faint < 0.1 * loud


@pytest.mark.parametrize("preset", PLAYED)
@pytest.mark.parametrize(("motion", "part"), [(0.3, 1.0), (0.15, 1.0), (0.075, 0.5), (0.015, 0.1)])
def test_a_hand_knocks_alike_on_all_notes_but_faint_ones(preset: str, motion: float, part: float) -> None:
    """Its full level from 0.15 of a medium pluck's speed on, and below that in proportion to the string's."""
    engine = Engine(even(preset, release_noise=0.0), QUALITIES["live"], RATE)
    voice, ops = engine.voices[1], engine.pool.records[1]
    play_frames(voice, ops, event(PLUCK, apex=1e-4, place=0.6), np.zeros(RATE // 5))
    wanted, slot = motion * float(voice.record["medium"][0]), voice.slots[int(voice.record["slot"][0])]
    speed = float(np.linalg.norm(mode_speeds(voice, int(slot["active"]))) / np.sqrt(ops[0]["length"]))
    scale_motion(slot, wanted / speed)
    release = event(HAND, value=90.0)
    release["frame"] = RATE // 5
    play_frames(voice, ops, release, np.zeros(1))
    knock = float(voice.record["knock"]["speed"][0] / voice.record["landing_noise"][0])
    assert knock == pytest.approx(part, rel=0.02)


def test_noise_ends() -> None:
    """No trace is left in the string: filters and noises are at rest, and the string is still."""
    engine = Engine(even(**NOISES, fretting_noise=1.0), QUICK, RATE)
    send(engine, [(0, 0x90, 31, 64), (4800, 0x80, 31, 64), (9600, 0x90, 36, 127), (24000, 0x80, 36, 64)])
    engine.process(4 * RATE)
    assert not engine.sounding() and not engine.process(RATE).any()
    for voice in engine.voices:
        assert voice.record["still"][0] == 1
        for name in ("skin", "click", "knock", "rub"):
            assert voice.record[name]["speed"][0] == 0.0
            assert not voice.record[name]["band"]["low_pass"].any()


def test_a_displacement_sensor_feels_noise_as_loud_as_its_keys_say() -> None:
    """Skin under a hard note's peak, the knock over a note after 1 s, the floor under a medium note."""
    hard, medium, late = note(127, "upright"), note(64, "upright"), note(64, "upright", seconds=1.2)
    early = slice(0, round(0.2 * RATE))
    skin = [loudest(x[early], 2e-3) for x in takes(127, preset="upright", skin_noise=-14.0)]
    assert abs(db(float(np.median(skin) / np.abs(hard).max())) + 14.0) < 3.5
    knock = [float(np.abs(x).max()) for x in takes(64, preset="upright", release_noise=0.0)]
    rest = float(np.abs(late[round(1.1 * RATE) : round(1.2 * RATE)]).max())
    assert -2.0 <= db(float(np.median(knock)) / rest) <= 17.0
    floor = (note(64, "upright", floor_noise=-50.0) - medium)[RATE // 2 : RATE]
    assert abs(db(rms(floor) / rms(medium[round(0.1 * RATE) : round(0.4 * RATE)])) + 50.0) < 2.0


# The floor


FLOOR = {"floor_noise": -65.0}
PLUCKED = (PLAYED[0], *FRETTED[1:])  # levels refer to a medium pluck; slap strikes its low strings


def floor_of(
    messages: list[tuple[int, int, int, int]],
    seconds: float,
    rate: int = RATE,
    preset: str = "jazz-finger",
    **player: float,
) -> Floats:
    """The floor alone in a performance."""
    sounds = []
    for made in (even(preset, **FLOOR, **player), even(preset, **player)):
        engine = Engine(made, QUICK, rate)
        send(engine, messages)
        sounds.append(engine.process(round(seconds * rate)))
    return np.asarray((sounds[0] - sounds[1]).sum(axis=0))


@pytest.mark.parametrize("preset", PLUCKED)
def test_the_floor_is_as_far_under_a_medium_note_as_it_says(preset: str) -> None:
    medium = note(64, preset)[round(0.1 * RATE) : round(0.4 * RATE)]
    white: dict[str, Any] = {"preset": preset, "floor_cutoff": 3e3, "floor_corner": 0.0}
    noise = floor_of([(0, 0x90, 38, 64)], 2.0, **white)[RATE // 2 :]
    assert abs(db(rms(noise) / rms(medium)) + 65.0) < 4.5
    louder = floor_of([(0, 0x90, 38, 127), (0, 0x90, 28, 127)], 2.0, **white)[RATE // 2 :]
    assert rms(louder) == pytest.approx(rms(noise), rel=0.01)  # independent of notes
    parts = [rms(band(noise, low, high)) / rms(noise) for low, high in ((40.0, 1500.0), (6000.0, 20000.0))]
    assert parts[0] > 0.5 and parts[1] < 0.3


def density(noise: Floats, rate: int, middle: float) -> float:
    """The power of noise per kHz, dB, over half an octave."""
    power = 2 * np.abs(np.fft.rfft(noise)) ** 2 / (noise.size * rate)
    nu = np.arange(power.size) * rate / noise.size
    return float(10 * np.log10(1000 * power[(nu > middle / 2**0.25) & (nu < middle * 2**0.25)].mean()))


@pytest.mark.parametrize("rate", [44_100, 48_000, 96_000])
def test_the_floor_of_a_preamplifier_is_level_at_every_rate(rate: int) -> None:
    """Its power spreads over 18 kHz, whatever the rate; below 3 kHz, a cutoff there has it all."""
    noise, dull = (floor_of([(0, 0x90, 38, 64)], 2.0, rate, floor_cutoff=cutoff)[rate // 2 :] for cutoff in (20e3, 3e3))
    level = [density(noise, rate, middle) for middle in (250.0, 500.0, 1e3, 2e3, 4e3, 8e3, 16e3)]
    assert max(level) - min(level) < 5.0
    assert level[2] == pytest.approx(db(rms(note(64)[RATE // 10 : 2 * RATE // 5])) - 65.0 - 10 * np.log10(18), abs=2.0)
    assert density(dull, rate, 8e3) < density(dull, rate, 500.0) - 12.0


@pytest.mark.parametrize(
    ("corner", "rate"),
    quick(
        [(corner, rate) for corner in (300.0, 1500.0, 5000.0) for rate in (44_100, 96_000)],
        always=[(300.0, 96_000), (1500.0, 44_100), (5000.0, 44_100)],
    ),
)
def test_flicker_noise_is_louder_below_its_corner(corner: float, rate: int) -> None:
    """By 1 + corner / frequency, within 1 dB and what chance adds to half an octave of noise."""
    flat, rising = (
        floor_of([(0, 0x90, 38, 64)], 4.0, rate, floor_cutoff=20e3, floor_corner=c)[rate // 2 :] for c in (0.0, corner)
    )
    for middle in (125.0, 250.0, 500.0, 1e3, 2e3, 4e3, 8e3, 16e3):
        louder = density(rising, rate, middle) - density(flat, rate, middle)
        assert louder == pytest.approx(10 * np.log10(1 + corner / middle), abs=1.2), middle


def test_the_tone_pot_filters_the_strings_and_not_the_floor() -> None:
    opened, closed = (
        floor_of([(0, 0x90, 38, 64), (RATE // 4, 0xB0, LEARNED + TONE_POT, value)], 1.0, floor_cutoff=20e3)
        for value in (127, 0)
    )
    assert rms(opened) > 0 and np.abs(opened - closed).max() < 1e-9 * np.abs(opened).max()


def test_the_floor_of_an_older_file_has_the_old_cutoff() -> None:
    """An instrument file without `floor_cutoff` reads as 0 and plays, bit for bit, as with 3 kHz."""
    bass = even(**FLOOR)
    fields = read_kept(instrument_file(bass))
    old = {name: value for name, value in fields.items() if name != "instrument.player.floor_cutoff"}
    assert len(old) == len(fields) - 1 and image_of(image_made(file_of(old))).numbers["player"]["floor_cutoff"][0] == 0
    messages = [(0, 0x90, 38, 64)]
    older, odd, newer = (floor_of(messages, 1.0, floor_cutoff=cutoff) for cutoff in (0.0, 1e-300, 3e3))
    assert np.array_equal(older, newer) and np.array_equal(odd, newer) and rms(older) > 0


@pytest.mark.parametrize(("preset", "mains"), [*zip(PLUCKED, (50.0, 60.0, 50.0), strict=True)])
def test_the_hum_is_that_of_the_mains(preset: str, mains: float) -> None:
    """As far under a medium note as it says; nothing lies between its harmonics."""
    medium = note(64, preset)[round(0.1 * RATE) : round(0.4 * RATE)]
    once, never = even(preset, hum=-60.0, mains=mains), even(preset)
    sounds = []
    for made in (once, never):
        engine = Engine(made, QUICK, RATE)
        assert not engine.process(RATE // 10).any()
        engine.send(np.array([engine.frame]), np.array([[0x90, 38, 64]], np.uint8))
        sounds.append(engine.process(2 * RATE).sum(axis=0))
    hum = (sounds[0] - sounds[1])[RATE:]
    assert abs(db(rms(hum) / rms(medium)) + 60.0) < 4.5
    power = np.abs(np.fft.rfft(hum)) ** 2  # bins of 1 Hz
    lines = power[round(mains) :: round(mains)]
    assert lines[:15].sum() > 0.999 * power.sum() and lines[0] > lines[2] > lines[1] > lines[15] * 1e6


def test_the_floor_follows_the_volume() -> None:
    quarter = floor_of([(0, 0x90, 38, 100), (RATE, 0xB0, 7, 50)], 2.0)
    full, turned = quarter[RATE // 2 : RATE], quarter[3 * RATE // 2 :]
    whole = floor_of([(0, 0x90, 38, 100)], 2.0)
    assert np.array_equal(quarter[:RATE], whole[:RATE]) and rms(full) > 0
    engine = Engine(even(), QUICK, RATE)
    engine.send(np.array([0]), np.array([[0xB0, 7, 50]], np.uint8))
    engine.process(1)
    ratio = float(engine.voices[0].record["gain_wanted"][0])
    assert 0.0 < ratio < 0.5 and np.allclose(turned, ratio * whole[3 * RATE // 2 :], rtol=1e-6, atol=1e-15)


def test_the_floor_lasts_through_rests_and_ends() -> None:
    engine = Engine(even(**FLOOR), QUICK, RATE)
    assert not engine.process(RATE).any()  # nobody has played yet
    engine.send(np.array([RATE, RATE + 4800]), np.array([[0x90, 40, 100], [0x80, 40, 64]], np.uint8))
    engine.process(2 * RATE)
    assert not engine.sounding()
    rest = engine.process(RATE)
    assert rest[0].any() and not rest[1:].any()
    engine.process(4 * RATE)
    assert not engine.process(RATE).any()


def test_a_panic_takes_the_floor_along() -> None:
    """In blocks of any sizes, whichever string it ends; one that sounds before or after keeps the floor as usual."""
    panic, note = (
        [(0, 0x90, 40, 100), (RATE, 0xB0, 120, 0)],
        [(RATE + 200, 0x90, 45, 100), (RATE + 30200, 0x80, 45, 64)],
    )
    of_one_string = [(0, 0xB0, 126, 4), (0, 0x92, 40, 100), (RATE, 0xB2, 120, 0)]  # a channel a string: the A
    for messages, ends in ((panic, True), (panic + note, False), (of_one_string, True)):
        once = []
        for size in (RATE, 777):
            engine = Engine(even(**FLOOR), QUICK, RATE)
            sound = play_in_blocks(engine, messages, 3 * RATE, [size])
            once.append(sound)
            assert sound[:, RATE // 2 : RATE].any() and sound[0, RATE : RATE + RATE // 5].any()
            assert sound[:, RATE + RATE * 9 // 10 :].any() != ends
        assert np.array_equal(*once)


def test_a_render_ends_with_its_tail_with_a_floor_too() -> None:
    key = even().strings[1].open_note
    score = score_of([(0.0, 0.3, key, 100)], RATE)
    sounds = [render_to_array(b, score, QUALITIES["live"]) for b in (even(), even(**FLOOR), even(floor_noise=0.0))]
    assert sounds[0].shape == sounds[1].shape == sounds[2].shape
    assert np.abs(sounds[2][:, -RATE // 10 : -RATE // 20]).max() > 1e-3  # louder than the threshold of silence


def test_a_synth_with_a_floor_is_still_once_it_has_faded() -> None:
    synth, device = synth_and_device(even(**FLOOR), adaptive=False)
    device.block(512)
    assert is_still(synth.address) == 1
    assert synth.send(0x90, 40, 100, frame=512) and synth.send(0x80, 40, 64, frame=2000)
    still = []
    for _ in range(7 * RATE // 4800):
        heard = device.block(4800)
        still.append(int(is_still(synth.address)))
        assert still[-1] == 0 or not device.block(64).any()
    assert heard.any() == (not still[-1]) and still[0] == still[20] == 0 and still[-1] == 1


def test_another_bass_takes_the_floor_over() -> None:
    """The old bass's floor fades within half a second, although its string rings on; the level stays."""
    here, there = even(**FLOOR), even("precision-finger")
    messages = [(0, 0xB0, 64, 127), (10, 0x90, 28, 100), (RATE, 0xC0, 33, 0), (RATE, 0x90, 45, 60)]
    once = []
    for size in (RATE * 3, 777):
        sounds = []
        for floor in (True, False):
            basses = Basses(Engine(here if floor else even(), QUICK, RATE), {33: there})
            sounds.append(play_in_blocks(basses, messages, 3 * RATE, [size]))
        noise = sounds[0] - sounds[1]
        assert noise[0, RATE // 2 : RATE].any() and noise[0, RATE : RATE + RATE // 4].any()
        assert np.abs(noise[:, round(1.51 * RATE) :]).max() < 1e-12
        once.append(sounds[0])
    assert np.array_equal(*once)


# Independence of the computation


def play(made: Instrument, score: Score, sizes: list[int], seed: int = 0) -> Floats:
    """The strings of `score` in blocks of `sizes`, over and over."""
    return play_in_blocks(Engine(made, QUICK, score.rate, seed), messages_of(score), score.end_frame, sizes)


@pytest.mark.parametrize("preset", ["jazz-finger", "precision-pick"])
def test_blocks_of_any_sizes_play_the_same(preset: str) -> None:
    score, made = busy_score(RATE), even(preset, **ALL)
    whole = play(made, score, [score.end_frame])
    assert np.isfinite(whole).all()
    assert not np.array_equal(whole, play(even(preset), score, [score.end_frame]))
    for sizes in ([1, 500, 33], [4096]):
        assert np.array_equal(whole, play(made, score, sizes))


def test_a_seed_is_one_noise() -> None:
    score, made = score_of([(0.0, 0.3, 40, 120), (0.1, 0.3, 40, 120)], RATE), even(**ALL)
    one, same, other = (play(made, score, [512], seed) for seed in (1, 1, 2))
    assert np.array_equal(one, same) and not np.array_equal(one, other)
    ours, theirs = one.sum(axis=0) - note_of(score), other.sum(axis=0) - note_of(score)
    assert abs(float(np.corrcoef(ours, theirs)[0, 1])) < 0.3


def note_of(score: Score) -> Floats:
    return np.asarray(play(even(), score, [512]).sum(axis=0))


@pytest.mark.parametrize(
    "preset", quick(["slap", "jazz-finger", "fretless", "precision-pick"], ["slap", "precision-pick"])
)
def test_strings_that_ran_ahead_come_back_to_the_same_noise(preset: str) -> None:
    made, total, messages = even(preset, **ALL), 2 * RATE, messages_of(busy_score(RATE))
    assert np.array_equal(played_ahead(made, messages, total), offline(made, messages, total))
