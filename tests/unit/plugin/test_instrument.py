"""Images hold a whole bass, for any rate; damaged ones are refused, and accepted ones cannot crash."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from support.command import module_paths, python_output
from support.costs import of_each_kind, slow

from livebass import QUALITIES, load_preset, preset_names
from livebass.engine.engine import Engine
from livebass.engine.image import image, image_of
from livebass.engine.prepare import Pool, new_performer
from livebass.kernels.bass.check import DAMAGED, FOREIGN, GOOD, check_file, checksum
from livebass.kernels.bass.instrument import COARSE, FILE, INSTRUMENT_WORDS, LIVE, STUDIO, TIERS, WORD
from livebass.kernels.effects.records import EFFECTS, LATE
from livebass.kernels.player.constants import FINGER, PICK, POP, STANDARD
from livebass.kernels.player.performer import MAX_STRINGS
from livebass.kernels.string.preparing import NOTE, NOTE_WORDS
from livebass.model.instrument import Effects, Response
from livebass.model.keymap import MODO_12, velocity_parts
from livebass.plugin.instrument import image_file, tiers
from livebass.plugin.lv2 import write_bundle
from livebass.rows.parts import Pick
from livebass.rows.row import Limit, limits
from livebass.rows.techniques import GHOST

ADDRESSES = (
    "coefficients",
    "coefficients_v",
    "taps",
    "shapes",
    "heights",
    "hand_heights",
    "positions",
    "coupling",
    "left_out",
    "yields",
    "answers",
    "turning",
)


def assert_same_pool(made: Pool, wanted: Pool) -> None:
    """Fails if an operator or a number of its rows differs in any bit."""
    for name in wanted.records.dtype.names:
        if name not in ADDRESSES:
            assert np.array_equal(made.records[name], wanted.records[name]), name
    first, places = (pool.records["coefficients"][0, 0] for pool in (made, wanted))
    made_rows, rows = (
        p.memory[(int(at) - p.memory.ctypes.data) // WORD :] for p, at in ((made, first), (wanted, places))
    )
    assert np.array_equal(made_rows, rows) and rows.size > 1000
    for name in ADDRESSES:
        assert np.array_equal(made.records[name] - first, wanted.records[name] - places), name


@pytest.mark.parametrize("preset", of_each_kind(preset_names()))
def test_the_file_makes_the_pool_of_the_engine(preset: str) -> None:
    """At the usual rate in each tier, at others in the light ones: bit for bit."""
    bass = load_preset(preset)
    file = image_of(image_file(bass))
    assert file.name == bass.name and file.string_names == [s.name for s in bass.strings]
    for tier, rate in ((LIVE, 48000), (STUDIO, 48000), (COARSE, 48000), (LIVE, 44100), (COARSE, 192000)):
        assert_same_pool(file.pool(tier, rate), image(bass, tiers(bass)[tier]).pool(LIVE, rate))


@pytest.mark.parametrize("preset", ["slap", "paper-bass", "fretless"])
def test_the_file_has_the_numbers_of_the_engine(preset: str) -> None:
    bass = load_preset(preset)
    numbers, wanted = image_of(image_file(bass)).numbers, Engine(bass, QUALITIES["live"], 48000).numbers
    for name in wanted.dtype.names:
        if name != "tiers":
            assert np.array_equal(numbers[name], wanted[name]), name
    assert numbers["tiers"][0, LIVE] == wanted["tiers"][0, 0]


def test_a_tuned_bass_is_written_as_it_is_played() -> None:
    """Six strings at other tensions, behind a capo: numbers and operators, bit for bit."""
    bass = load_preset("six-string", tuning="drop-a", capo=3, a4=432, temperament=[float(k) for k in range(12)])
    file, engine = image_of(image_file(bass)), Engine(bass, QUALITIES["live"], 48000)
    for name in ("open_note", "slack", "called", "strings", "frets"):
        assert np.array_equal(file.numbers[name], engine.numbers[name]), name
    assert file.numbers["slack"][0, 0] > 1.2 and file.numbers["called"][0, :2].tolist() == [11, 4]
    assert_same_pool(file.pool(LIVE, 48000), engine.pool)


@pytest.fixture(scope="module")
def whole() -> bytes:
    """The file of a small bass."""
    return image_file(load_preset("paper-g"))


def check(data: bytes) -> int:
    """GOOD, or why a file with these bytes is refused."""
    made = image_of(data)  # it holds the memory
    return int(check_file(made.address, len(data)))


def seal(words: np.ndarray) -> bytes:
    """The words of a file, with a valid checksum."""
    total = int(checksum(words.ctypes.data, len(words) - 1))
    return words[:-1].tobytes() + total.to_bytes(WORD, "little")


def test_damaged_files_are_refused(whole: bytes) -> None:
    assert check(whole) == GOOD
    for data in (b"", b"LIVEBASS", whole[: FILE.itemsize], b"RIFF" + whole[4:], whole[:-1], whole + b"\0" * 7):
        assert check(data) == FOREIGN
    for data in (whole[:-WORD], whole + b"\0" * WORD, whole[:-800] + whole[-792:]):
        assert check(data) == DAMAGED
    rng = np.random.default_rng(5)
    for place in rng.integers(2 * WORD, len(whole), 200).tolist():
        damaged = bytearray(whole)
        damaged[place] ^= 1 << int(rng.integers(0, 8))
        assert check(bytes(damaged)) == DAMAGED


def test_what_is_accepted_cannot_crash(whole: bytes) -> None:
    """Random words under a valid checksum: refused, or prepared without a crash."""
    rng = np.random.default_rng(6)
    first = FILE.fields["instrument"][1] // WORD
    accepted = 0
    for k in range(300):
        words = np.frombuffer(whole, np.int64).copy()
        until = FILE.itemsize // WORD if k % 3 == 0 else (FILE.itemsize + 4 * NOTE.itemsize) // WORD
        place = int(rng.integers(first, until if k % 3 < 2 else len(words) - 1))
        nonsense = [-1, 0, 1, 2, 1 << 40, -(1 << 62), int(rng.integers(-1 << 62, 1 << 62))]
        floats = [-1.0, 0.0, 1e-300, 1e300, np.nan, np.inf, float(rng.normal())]
        word = nonsense[k % 7] if k % 2 else int(np.array(floats[k % 7]).view(np.int64))
        words[place] = word
        if check(seal(words)) != GOOD:
            continue
        accepted += 1
        file = image_of(seal(words))
        for tier in range(TIERS):
            try:
                file.pool(tier, 48000)
            except ValueError as error:
                assert "cannot be played" in str(error)
    assert 20 < accepted < 280


FUZZ = """
import faulthandler, sys
from pathlib import Path
import numpy as np
from livebass.kernels.bass.check import checksum
from livebass.kernels.bass.kept import HEAD_WORDS
from support.kept import Refused, image_made
from support.lv2 import Plugin
faulthandler.enable()
bundle, cases = Path(sys.argv[1]), int(sys.argv[2])
files = [np.frombuffer((bundle / f"{name}.lbass").read_bytes(), np.int64) for name in sys.argv[3:]]
(bundle / "instruments.txt").write_text("fuzzed\\n")
accepted = 0
floats = [np.nan, np.inf, -np.inf, -1.0, 0.0, 1e-300, 1e-12, 0.5, 1.0, 3.0, 1e3, 1e6, 1e14, 1e300]
integers = [-1, 0, 1, 2, 3, 7, 64, 127, 1000, 1 << 31, 1 << 40, -(1 << 62)]
for case in range(cases):
    rng = np.random.default_rng([9, case])
    words = files[case % len(files)].copy()
    for _ in range(int(rng.integers(1, 4))):
        place = int(rng.integers(HEAD_WORDS, rng.choice([len(words) // 3, len(words) - 1])))
        number = words[place : place + 1].view(float)
        how = int(rng.integers(3))
        if how == 0:
            words[place] = rng.choice(integers)
        elif how == 1:
            number[0] = rng.choice(floats)
        else:
            number[0] *= 10.0 ** rng.uniform(-4, 4)
    words[-1] = np.uint64(checksum(words.ctypes.data, len(words) - 1)).view(np.int64)
    try:
        image_made(words.tobytes())
    except Refused:
        continue
    (bundle / "fuzzed.lbass").write_bytes(words.tobytes())
    try:
        plugin = Plugin(bundle)
    except RuntimeError as error:
        assert "cannot be played" in str(error), error
        continue
    accepted += 1
    for key, force in ((28, 127), (43, 127), (67, 1), (50, 90)):
        messages = [(0, [0x90, key, force]), (60, [0xE0, 0, key]), (100, [0xB0, 16, key])]
        assert np.isfinite(plugin.block(150, [(at, bytes(message)) for at, message in messages])).all(), case
    plugin.controls["tone"].value, plugin.controls["technique"].value = -0.7, 3.0
    assert np.isfinite(plugin.block(150, [(0, bytes([0x80, 43, 0])), (9, bytes([0x90, 43, 100]))])).all(), case
    plugin.close()
print(accepted)
"""


@pytest.mark.parametrize("cases, presets", [(60, ["paper-g", "slap"]), slow(300, ["paper-g", "slap", "fretless"])])
def test_what_is_accepted_plays_without_a_crash(cases: int, presets: list[str], tmp_path: Path) -> None:
    """Files with a few random words, in a plugin: refused, or played with finite sound."""
    bundle = tmp_path / "livebass.lv2"
    write_bundle({name: load_preset(name) for name in presets}, bundle)
    accepted = int(python_output("-c", FUZZ, bundle, cases, *presets, env=module_paths()))
    assert 0.3 * cases < accepted < 0.8 * cases


INSTRUMENT_PLACE = FILE.fields["instrument"][1]
# Each number's place in a file, once for each string of the bass, and its limits
NUMBERS = [(INSTRUMENT_PLACE, limit) for limit in limits(INSTRUMENT_WORDS, MAX_STRINGS)]
NUMBERS += [(FILE.itemsize, limit) for limit in limits(NOTE_WORDS)]


@pytest.mark.parametrize("place, limit", NUMBERS, ids=lambda value: getattr(value, "name", ""))
def test_each_number_has_its_limits(place: int, limit: Limit, whole: bytes) -> None:
    """A file beyond them is refused; places after the bass's own strings have no limits."""
    strings = 1  # on paper-g
    for k in {0, (limit.each * strings or limit.size) - 1}:
        words = np.frombuffer(whole, np.int64).copy()
        number = words[place // WORD + limit.first + k :][:1]
        absurd = (limit.minimum - 1, limit.maximum + 1, 1 << 40, -(1 << 62))
        if not limit.whole:
            number = number.view(float)
            absurd = (
                np.nextafter(limit.minimum, -np.inf),
                np.nextafter(limit.maximum, np.inf),
                np.nan,
                np.inf,
                -np.inf,
            )
        for value in absurd:
            number[0] = value
            assert check(seal(words)) == DAMAGED, (k, value)
    if limit.each:
        words = np.frombuffer(whole, np.int64).copy()
        words[place // WORD + limit.first + limit.each * strings] = 1 << 62
        assert check(seal(words)) == GOOD


@pytest.mark.parametrize("name", ["circuit", "player", "key_map", "part", "slap", "drop", "stroke", "wheel_slides"])
def test_limits_themselves_are_allowed(name: str, whole: bytes) -> None:
    for place, limit in NUMBERS:
        if limit.name.partition(".")[0] == name and place == INSTRUMENT_PLACE:
            for value in (limit.minimum, limit.maximum):
                words = np.frombuffer(whole, np.int64).copy()
                number = words[place // WORD + limit.first :][: limit.size]
                (number if limit.whole else number.view(float))[:] = value
                assert check(seal(words)) == GOOD, (limit.name, value)


def test_too_many_answers_are_refused(whole: bytes) -> None:
    """No string may answer more modes of others than kernels take, whether or not those strings exist."""
    words = np.frombuffer(image_file(load_preset("jazz-finger")), np.int64).copy()
    numbers = words.view(np.uint8)[: FILE.itemsize].view(FILE)["instrument"]
    numbers["answering_modes"][0, :4] = 64
    assert check(seal(words)) == DAMAGED


OWN_PICK = Pick(soft_width=1.2e-3, hard_width=0.8e-3, place=0.9, angle=0.3, nearer=0.04, lift=0.9)


def test_a_pick_of_ones_own_is_in_the_file_and_is_played() -> None:
    bass = load_preset("precision-finger")
    own = replace(bass, player=replace(bass.player, pick=OWN_PICK))
    file = image_of(image_file(own))
    pools = [file.pool(tier, 48000) for tier in (LIVE, COARSE)]
    rows = file.bass(LIVE, 48000, 0, pools).performer["strokes"][0]
    given = {name: value for name, value in vars(OWN_PICK).items() if value is not None}
    assert {name: float(rows[name][PICK]) for name in given} == given
    assert rows["soft_release"][PICK] == STANDARD["soft_release"][PICK]
    assert rows["hard_width"][FINGER] == bass.player.rounding and rows["lift"][POP] == STANDARD["lift"][POP]
    engines = [Engine(one, QUALITIES["live"], 48000) for one in (bass, own)]
    assert np.array_equal(engines[1].performer["strokes"][0], rows)
    assert not np.array_equal(engines[0].performer["strokes"][0], rows)


HALL = Response(32_000, np.cos(np.arange(1000.0)).tobytes())


def test_effects_are_in_the_file_and_behind_the_bass() -> None:
    bass = load_preset("precision-finger")
    own = replace(bass, effects=Effects(0.25, 0.75, HALL))
    plain, data = image_file(bass), image_file(own)
    assert data[FILE.itemsize : len(plain) - WORD] == plain[FILE.itemsize : -WORD], "all else is the same"
    assert data[len(plain) - WORD : -WORD] == HALL.played
    file = image_of(data)
    made = file.bass(LIVE, 48000, 0, [file.pool(tier, 48000) for tier in (LIVE, COARSE)])
    effects = made.memory.view(np.uint8)[made.effects - made.address :][: EFFECTS.itemsize].view(EFFECTS)[0]
    assert (effects["own_compression"], effects["own_drive"], effects["rate"]) == (0.25, 0.75, 48000)
    assert effects["taps"] == 1500 + 2 * LATE * 1.5
    assert (effects["own_gain"] == 0).all() and effects["own_cabinet"] == effects["own_limiter"] == 0
    amp = Effects(
        clean_blend=0.5, eq_bass=1.0, eq_low_mid=2.0, eq_high_mid=-3.0, eq_treble=4.0, eq_low_mid_frequency=250.0,
        eq_high_mid_frequency=3e3, cabinet="vented-1x15", limiter="off",
    )  # fmt: skip
    file = image_of(image_file(replace(bass, effects=amp)))
    made = file.bass(LIVE, 48000, 0, [file.pool(tier, 48000) for tier in (LIVE, COARSE)])
    effects = made.memory.view(np.uint8)[made.effects - made.address :][: EFFECTS.itemsize].view(EFFECTS)[0]
    assert effects["own_gain"].tolist() == [1, 2, -3, 4] and effects["own_centre"].tolist() == [250, 3000]
    assert (effects["own_clean"], effects["own_cabinet"], effects["own_limiter"]) == (0.5, 3, 1)
    rows = made.performer["strokes"][0]
    assert np.array_equal(rows, Engine(bass, QUALITIES["live"], 48000).performer["strokes"][0])
    picked = replace(own, player=replace(bass.player, pick=OWN_PICK))
    assert Engine(picked, QUALITIES["live"], 48000).performer["strokes"][0]["lift"][PICK] == OWN_PICK.lift


def test_no_sample_of_a_response_may_be_absurd() -> None:
    words = np.frombuffer(image_file(replace(load_preset("paper-g"), effects=Effects(0.25, 0.75, HALL))), np.int64)
    for wrong in (np.nan, np.inf):
        changed = words.copy()
        changed[-2] = np.array(wrong).view(np.int64)
        assert check(seal(changed)) == DAMAGED
    short = np.delete(words, -2)
    short[1] -= 1
    assert check(seal(short)) == DAMAGED, "a sample is missing"


def test_a_file_has_the_players_keys_and_velocities() -> None:
    bass = load_preset("jazz-finger")
    bass = replace(bass, player=replace(bass.player, keys=MODO_12, velocity_curve="hard", wheel="slide"))
    numbers = image_of(image_file(bass)).numbers[0]
    pressed = np.flatnonzero(numbers["key_map"]["action"])
    assert pressed.tolist() == sorted(key for key, *_ in MODO_12.keys)
    assert numbers["part"].tolist() == velocity_parts("hard") and numbers["wheel_slides"] == 1
    p = new_performer(numbers.reshape(1))[0]
    assert p["key_map"]["action"][22] == GHOST and p["key_map"]["over_notes"] and p["part"][64] == numbers["part"][64]
