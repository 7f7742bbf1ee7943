"""The picture: shapes as in `simulate`, contacts as in their list; looking changes nothing."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray
from support.live import RATE, feed, run_ahead, synth_and_device
from support.played import FRETS_OUT, event, made_of
from support.wasm import Module, sound_hash

from livebass import QUALITIES, Quality, load_preset, score_of
from livebass.engine.engine import Engine
from livebass.engine.image import Bass
from livebass.engine.prepare import play_frames
from livebass.engine.solve import pluck_event, solve_trial
from livebass.kernels.bass.instrument import LIVE
from livebass.kernels.string.records import GLIDE, PLUCK
from livebass.lab.analysis.motion import string_shape
from livebass.lab.paper.cases import CASES
from livebass.live.fake import FakeDevice
from livebass.live.synth import LiveBass, Synth
from livebass.live.thread.sight import SIGHT, see_bass
from livebass.model.bench import change_bass
from livebass.model.instrument import Pluck
from livebass.model.rest import lies_on, rests
from livebass.plugin.instrument import image_file
from livebass.rows.arrays import Floats

HARD = [(0.06 * k, 0.25, 28 + 5 * (k % 4) + 5 * (k // 4) % 12, 127 - 5 * k) for k in range(12)]


def view_of(bass: int, strings: int) -> NDArray[np.void]:
    """The view of the bass at an address, (strings,) SIGHT."""
    sights = np.zeros(strings, SIGHT)
    see_bass(bass, sights.ctypes.data)
    return sights


def shape(slot: np.void, x: Floats, name: str = "u") -> Floats:
    """The shape (m) of a slot at `x` (n,), m from its stop."""
    n, length = int(slot["modes"]), float(slot["length"])
    waves = np.sin(np.outer(x, np.arange(1, n + 1)) * np.pi / length)
    end = slot["stop"] if name == "u" else slot["stop_across"]
    return np.sqrt(2 / length) * waves @ slot[name][:n].astype(float) + end * (1 - x / length)


@pytest.mark.parametrize("quality", ["live", "reference"])
def test_case_b_is_drawn_as_it_is_simulated(quality: str) -> None:
    """1, 3.8 and 5 ms after the release, within 20 um of the shape with all modes at 8 MHz, for any width of modes."""
    rate, times = 50_000, np.array([1e-3, 3.8e-3, 5e-3])
    trial = CASES["b"].trial(rate)
    trial = replace(trial, duration=5.2e-3, states=tuple(np.rint(times * rate).astype(int).tolist()))
    wanted = solve_trial(trial).states
    assert wanted is not None
    engine = Engine(load_preset("paper-g"), QUALITIES[quality], rate)
    voice, ops = engine.voices[0], engine.pool.records[0]
    voice.record["pull"] = 0
    x = np.linspace(0, trial.speaking.length, 501)
    played = 0
    for k, at in enumerate(trial.states):
        events = pluck_event(trial.pluck) if k == 0 else pluck_event(trial.pluck)[:0]
        events["width"] = trial.pluck.rounding
        play_frames(voice, ops, events, np.zeros(at - played))
        played = at
        (sight,) = view_of(engine.bass.address, 1)
        assert sight["frame"] == at and sight["logged"] == voice.record["logged"][0]
        slot = sight["slot"][voice.record["slot"][0]]
        exact = string_shape(trial.speaking, wanted[k, 0, 0], x)
        assert abs(shape(slot, x) - exact).max() < 20e-6, times[k]
        assert abs(exact).max() > 1e-3


def test_a_finger_that_pulls_is_seen() -> None:
    """u and v follow the hand up to the apex, and go on from there."""
    bass = load_preset("jazz-finger")
    engine = Engine(bass, QUALITIES["live"], RATE)
    pluck = Pluck(3e-3, 0.6, angle=0.6)
    events = pluck_event(pluck)
    events["angle"], events["width"] = pluck.angle, 2e-3
    voice, ops = engine.voices[0], engine.pool.records[0]
    pull, apexes = int(voice.record["pull"][0]), []
    for k in range(pull + 1):
        play_frames(voice, ops, events[:1] if k == 0 else events[:0], np.zeros(1))
        (sight,) = view_of(engine.bass.address, 4)[:1]
        slot = sight["slot"][voice.record["slot"][0]]
        apexes.append([shape(slot, np.array([0.6]), name)[0] for name in "uv"])
    up, across = np.array(apexes).T
    assert (np.diff(up[:pull]) >= 0).all() and up[0] < 1e-5 < 2e-3 < up[-1] < 3e-3
    assert np.allclose(across, np.tan(0.6) * up, rtol=0.02, atol=1e-6)


@pytest.mark.parametrize("preset", ["jazz-finger", "fretless", "slap"])
def test_seeing_changes_no_sample(preset: str) -> None:
    """Natively, in blocks of 64, with strings running ahead; slides and bends among the notes."""
    sounds = []
    for looks in (False, True):
        synth, device = synth_and_device(preset, Quality("live", 150, 240e3))
        run_ahead(synth, "far")
        feed(synth, score_of(HARD[:6], RATE))
        sound, sights = [], np.zeros(8, SIGHT)
        for _ in range(300):
            sound.append(device.block(64).copy())
            if looks and synth.record["bass"][0]:
                see_bass(int(synth.record["bass"][0]), sights.ctypes.data)
        sounds.append(np.concatenate(sound))
        if looks:
            assert sights["slot"]["on"].any() and sights["slot"]["u"].any()
    assert np.array_equal(*sounds) and abs(sounds[0]).max() > 1e-2


def test_it_says_which_fret_a_string_lies_on() -> None:
    """Over frets and over a board, which a gliding finger presses elsewhere."""
    bare = load_preset("fretless")
    low = change_bass(bare, {"action": -1.15})
    for bass, slides in ((made_of("jazz-finger" + FRETS_OUT), False), (low, False), (bare, True)):
        string, neck = bass.strings[3], bass.necks[3]
        fret = 0 if slides else max(rests(string, neck, bass.frets))
        engine = Engine(bass, QUALITIES["live"], RATE)
        voice, ops = engine.voices[3], engine.pool.records[3]
        play_frames(voice, ops, event(PLUCK, fret, apex=1e-3, place=0.2), np.zeros(2000))
        if slides:
            play_frames(voice, ops, event(GLIDE, 5, seconds=22e-3), np.zeros(2000))
        sight = view_of(engine.bass.address, 4)[3]
        slot = sight["slot"][voice.record["slot"][0]]
        assert slot["on"] and slot["lies"] == (0 if slides else lies_on(string, neck, fret)), bass.name


def test_a_page_sees_and_hears_the_same() -> None:
    """In WebAssembly: the same samples with and without a look, and the records described by the layout."""
    sounds = []
    for looks in (False, True):
        module = Module(image_file(load_preset("jazz-finger")), RATE)
        for frame, message in zip(*(lambda s: (s.frames, s.messages))(score_of(HARD[:6], RATE)), strict=True):
            module.send(int(frame), *map(int, message))
        sights = module.place(4 * SIGHT.itemsize)
        sound = []
        for _ in range(80):
            sound.append(module.play(128))
            if looks:
                module.call("see_bass", module.bass, sights)
        sounds.append(np.concatenate(sound))
    assert sound_hash(sounds[0]) == sound_hash(sounds[1])
    drawn = module.bytes(sights, 4 * SIGHT.itemsize).view(SIGHT)
    assert (drawn["frame"] == 80 * 128).all() and drawn["slot"]["u"].any()


class Watched(LiveBass):
    """A bass for the audio thread that keeps its strings' contacts."""

    def __init__(self, *given: object) -> None:
        super().__init__(*given)  # type: ignore[arg-type]
        e = self.engine
        e.bass = e.image.bass(LIVE, e.rate, e.seed, e.pools, e.play_string, contacts=1024)
        self.memory, self.record = e.bass.memory, e.bass.record
        e.voices, e.performer = e.bass.voices, e.bass.performer
        self.record["frame"] = -1


def draw(bass: Bass, i: int, frame: int, taken: int) -> list[tuple[int, ...]]:
    """The contacts of string `i` read when `frame` of the bass is heard, by a reader that has taken `taken`."""
    voice = bass.voices[i]
    v, log = voice.record[0], voice.log
    end = frame * int(v["numerator"])
    entries = [log[k % len(log)] for k in range(taken, int(v["logged"]))]
    return [tuple(e.tolist()) for e in entries if e["step"] <= end]


@pytest.mark.parametrize("how", ["never", "far"])
def test_flashes_are_the_contacts(how: str) -> None:
    """A reader with its own index, who waits until a contact is heard, draws each contact once, and no others.

    Strings that run ahead are taken back by unforeseen events.
    """
    bass, quality = load_preset("paper-bass"), Quality("live", 150, 336e3)
    synth = Synth(RATE)
    live = Watched(bass, quality, RATE)
    synth.switch_to(live)
    run_ahead(synth, how)
    device, score = FakeDevice(synth), score_of(HARD[:8], RATE)
    fed, ahead = 0, 0
    flashes: list[list[tuple[int, ...]]] = [[] for _ in range(4)]
    for k in range(240):
        until = int(np.searchsorted(score.frames, 64 * (k + 1)))  # a keyboard: no message is known before its block
        feed(synth, replace(score, frames=score.frames[:until], messages=score.messages[:until]), fed)
        fed = until
        device.block(64)
        for i in range(4):
            ahead = max(ahead, int(live.engine.voices[i].record["frame"][0]) - 64 * (k + 1))
            flashes[i] += draw(live.engine.bass, i, 64 * (k + 1), len(flashes[i]))
    assert (ahead > 0) == (how == "far")
    engine = Engine(bass, quality, RATE)
    engine.bass = engine.image.bass(LIVE, RATE, 0, engine.pools, contacts=1 << 14)
    engine.voices, engine.performer = engine.bass.voices, engine.bass.performer
    early = score.frames < 240 * 64
    engine.send(score.frames[early], score.messages[early])
    engine.process(240 * 64)
    wanted = [[tuple(e.tolist()) for e in v.log[: int(v.record["logged"][0])]] for v in engine.voices]
    assert flashes == wanted and min(map(len, wanted)) > 10
