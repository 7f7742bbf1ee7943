"""Another version of the same bass carries on the notes that ring: sliders of the bench move while one plays."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cache

import numpy as np
import pytest
from support.costs import quick
from support.live import QUICK, RATE
from support.own_basses import FOLDER
from support.quiet import without_noise

from livebass import load_preset
from livebass.engine.prepare import Voice, modal_row
from livebass.live.fake import FakeDevice
from livebass.live.synth import LiveBass, Synth
from livebass.model.instrument import Instrument
from livebass.rows.arrays import Floats

CHANGED: dict[str, dict[str, float]] = {
    "as it is": {},
    "pickups": {"pickup_place": 6.0, "cable": 200.0, "finger_width": 20.0, "hardest": 10.0},
    "low": {"action": -0.9},
    "high": {"action": 1.0, "neck_relief": 0.1},
    "thick": {"gauge": 15.0},
    "thin": {"gauge": -12.0},
    "tight": {"tension": 10.0},
    "old": {"wear": 200.0},
    "lossy": {"contact_loss": 60.0},
    "fret": {"fret": 7, "fret_height": 0.3},
}
EXACT = ("as it is", "pickups")
NOTES = ((28, 127), (38, 120))  # they touch frets for half a second
BLOCK = 64
Version = Callable[[str], LiveBass]


@pytest.fixture(scope="module")
def version(tmp_path_factory: pytest.TempPathFactory) -> Version:
    """A version of the jazz bass of the tests, its axes turned, without noise."""
    folder = tmp_path_factory.mktemp("bench")
    own = (FOLDER / "jazz-finger.toml").as_posix()

    @cache
    def instrument(name: str) -> Instrument:
        file = folder / f"{name.replace(' ', '-')}.toml"
        values = "\n".join(f"{key} = {value}" for key, value in CHANGED[name].items())
        neck = '[neck]\nlonger_across = "2 mm"\naxes_turned = "40 deg"'
        file.write_text(f'like = "{own}"\n{neck}\n[player]\nanswering = "held"\n[bench]\n{values}\n')
        return without_noise(load_preset(file))

    def bass(name: str) -> LiveBass:
        made = LiveBass(instrument(name), QUICK, RATE)
        made.record["of"] = 1
        return made

    return bass


class Playing:
    """A synth whose bass is replaced by its versions while it plays."""

    def __init__(self, bass: LiveBass) -> None:
        self.synth = Synth(RATE, adaptive=False)
        self.synth.record["clock"] = 0
        self.synth.switch_to(bass)
        self.device = FakeDevice(self.synth)

    def play(self, frames: int) -> Floats:
        sound = [self.device.block(BLOCK) for _ in range(frames // BLOCK)]
        self.synth.release_faded()
        return np.concatenate(sound)

    def become(self, bass: LiveBass) -> None:
        self.synth.release_faded()
        assert not self.synth.switching
        self.synth.switch_to(bass)

    @property
    def voices(self) -> Sequence[Voice]:
        assert self.synth.bass is not None
        return self.synth.bass.engine.voices

    def energy(self) -> float:
        """Energy (J) of all strings without the share stored in contacts and in tension."""
        assert self.synth.bass is not None
        total = 0.0
        for voice, ops in zip(self.voices, self.synth.bass.engine.pool.records, strict=True):
            for slot in voice.slots[voice.slots["on"] == 1]:
                op = ops[int(slot["fret"])]
                for axis in ("u", "v"):
                    w, n = slot[axis], int(slot["active" if axis == "u" else "v_active"])
                    q, p = modal_row(w, "q")[:n], modal_row(w, "p")[:n] / np.maximum(w["kappa"][:n], 1e-300)
                    density = float(op["fine"]) ** 2 / float(op["weight"])
                    total += density / 2 * float(p @ p + (w["omega"][:n] * q) @ (w["omega"][:n] * q))
        return total


def begin(bass: LiveBass, seconds: float) -> Playing:
    playing = Playing(bass)
    for note, velocity in NOTES:
        playing.synth.send(0x90, note, velocity)
    playing.play(int(seconds * RATE))
    return playing


@pytest.fixture(scope="module")
def unchanged(version: Version) -> Callable[[float], Floats]:
    """The half second from a moment (s) of the notes, without a change."""
    return cache(lambda when: begin(version("as it is"), when).play(RATE // 2))


@pytest.mark.parametrize("name", EXACT)
def test_what_moves_no_string_leaves_its_motion_alone(version: Version, name: str) -> None:
    """Bit for bit, in the middle of contact and of an exchange between the axes."""
    one, other = begin(version("as it is"), 0.05), begin(version("as it is"), 0.05)
    one.become(version(name))
    sound = [each.play(RATE // 4) for each in (one, other)]
    assert name != "as it is" or np.abs(sound[0] - sound[1]).max() < 1e-7, "only the rounding of a fade"
    touched = 0
    for a, b in zip(one.voices, other.voices, strict=True):
        assert a.slots["on"].tolist() == b.slots["on"].tolist()
        for mine, its in zip(a.slots, b.slots, strict=True):
            touched += int(its["touching"]) * int(its["on"])
            for axis, field in (("u", "active"), ("v", "v_active")) if its["on"] else ():
                n = int(its[field])
                for row in "qp":
                    assert np.array_equal(modal_row(mine[axis], row)[:n], modal_row(its[axis], row)[:n])
    assert touched > 20


@pytest.mark.parametrize("name", [name for name in CHANGED if name not in EXACT])
@pytest.mark.parametrize("when", quick([0.02, 0.3], [0.3]))
def test_a_note_rings_on_without_a_click(
    version: Version, unchanged: Callable[[float], Floats], name: str, when: float
) -> None:
    """The third difference is at most twice the greatest of the same moments without the change."""
    one = begin(version("as it is"), when)
    one.become(version(name))
    sound, default = one.play(RATE // 2), unchanged(when)
    now = slice(0, RATE // 50)
    assert np.abs(np.diff(sound, 3))[now].max() < 2.0 * np.abs(np.diff(default, 3))[now].max()
    levels = [20 * np.log10(np.sqrt(np.mean(x[-RATE // 10 :] ** 2))) for x in (sound, default)]
    assert levels[0] > levels[1] - 9.0
    assert not np.array_equal(sound, default), "the change is heard"


def test_no_storm_of_changes_adds_energy(version: Version) -> None:
    """Each change leaves at most the energy that the strings had, and so does a second of them."""
    playing = begin(version("as it is"), 0.05)
    random, names, first = np.random.default_rng(5), list(CHANGED), playing.energy()
    for _ in range(24):
        before = playing.energy()
        playing.become(version(names[random.integers(len(names))]))
        playing.play(BLOCK)
        assert playing.energy() < 1.01 * before, "contacts may give back what they held"
        playing.play(10 * BLOCK)
    assert 1e-3 * first < playing.energy() < first


def test_hands_hold_on(version: Version) -> None:
    """A released key ends the note that another version began; pedal, bend and strings are as they were."""
    playing = begin(version("as it is"), 0.1)
    for message in ((0xB0, 64, 127), (0xE0, 0, 96), (0x80, 38, 0)):
        playing.synth.send(*message)
    playing.play(RATE // 10)
    playing.become(version("low"))
    playing.play(RATE // 10)
    on = [bool(voice.slots["on"].any()) for voice in playing.voices]
    assert on == [True, False, True, False], "the pedal holds the D string"
    assert float(playing.voices[0].record["tuned"][0]) == pytest.approx(2 ** (1 / 12), rel=1e-2)
    playing.synth.send(0xB0, 64, 0)
    playing.synth.send(0x90, 29, 100)
    playing.play(RATE)
    on = [bool(voice.slots["on"].any()) for voice in playing.voices]
    assert on[0] and not on[2], "fret 1 of the E string plays, the D string has ended"
    playing.synth.send(0x80, 29, 0)
    playing.synth.send(0x80, 28, 0)
    playing.play(2 * RATE)
    assert not any(voice.slots["on"].any() for voice in playing.voices)


def test_blocks_change_nothing(version: Version) -> None:
    """Frames of a fade are the same wherever a block ends."""
    sounds = []
    for size in (64, 16):
        playing = begin(version("as it is"), 0.05)
        playing.become(version("thick"))
        sounds.append(np.concatenate([playing.device.block(size) for _ in range(RATE // 10 // size // 4 * 4)]))
    n = min(map(len, sounds))
    assert np.array_equal(sounds[0][:n], sounds[1][:n])


@pytest.mark.parametrize("size", [64, 16])
def test_a_change_in_silence_is_as_if_it_had_always_been(version: Version, size: int) -> None:
    """Even for a note of the same frame, whatever the blocks."""
    playing, other = Playing(version("as it is")), Playing(version("thick"))
    sounds = []
    for one in (playing, other):
        one.play(RATE // 10)
        if one is playing:
            one.become(version("thick"))
        one.synth.send(0x90, 33, 110)
        sounds.append(np.concatenate([one.device.block(size) for _ in range(RATE // 4 // size)]))
    assert np.array_equal(*sounds) and sounds[0].any()


def test_a_bass_of_another_file_rings_out_as_before(version: Version) -> None:
    playing, other = begin(version("as it is"), 0.1), version("low")
    other.record["of"] = 2
    playing.become(other)
    playing.play(RATE // 10)
    assert not any(voice.slots["on"].any() for voice in playing.voices) and playing.synth.ringing
