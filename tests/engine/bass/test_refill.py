"""Notes that are changed in place are those of a bass built anew, bit for bit."""

from __future__ import annotations

import copy
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from support.wasm import QUANTUM, Module, messages_of

from livebass import QUALITIES, Instrument, score_of
from livebass.arrays import Floats
from livebass.engine.engine import Engine
from livebass.engine.image import Bench, Image, bench_of, frets_of, image
from livebass.engine.prepare import Pool
from livebass.kernels.bass.bench import BENCH, NOT_BY_GEOMETRY, SET, set_neck
from livebass.kernels.bass.check import GOOD, check_file
from livebass.kernels.bass.instrument import LIVE, TIERS
from livebass.kernels.bass.pool import POOL, fill_pool, measure_pool
from livebass.kernels.bass.refill import NO_ROOM, OTHER_PLACES, keep_hand, keep_notes, refill_notes, take_heights
from livebass.kernels.string.note import MADE
from livebass.kernels.string.preparing import DONE, NOTE
from livebass.plugin.instrument import instrument_file, tiers
from livebass.preset.build import Builder
from livebass.preset.load import preset_tables

RATE = 48000
ACTION = {"unit": "mm", "values": [2.4, 2.2, 2.1, 2.0]}  # of jazz-finger
Change = Callable[[Bench], None]


def bass_of(preset: str, changes: dict[str, dict[str, Any]]) -> Instrument:
    """A preset with other keys: by table, or by the name of a string, or "pickup" for the first of them."""
    data = copy.deepcopy(preset_tables(preset)[1])
    for table, keys in changes.items():
        strings = {string["name"]: string for string in data["string"]}
        to = strings[table] if table in strings else data[table][0] if table == "pickup" else data[table]
        to |= keys
    return Builder(preset).instrument(data)


class Workshop:
    """A bass as a page holds it: its file, its pool and its bench, which may be changed."""

    def __init__(self, bass: Instrument) -> None:
        quality = QUALITIES["live"].for_contact(bass.loss, bass.over_board)
        self.image: Image = image(bass, quality)
        self.bench = bench_of(bass, [quality] * TIERS, frets_of(bass))
        self.pool = np.zeros(1, POOL)
        self.pool["file"], self.pool["tier"], self.pool["rate"] = self.image.address, LIVE, RATE
        measure_pool(self.pool.ctypes.data)
        room = np.zeros(int(self.pool["bytes"][0]) // 8 + 8)
        self.memory = room[-(room.ctypes.data // 8) % 8 :][: int(self.pool["bytes"][0]) // 8]
        self.pool["memory"] = self.memory.ctypes.data
        assert fill_pool(self.pool.ctypes.data) == DONE
        self.notes = len(bass.strings) * (frets_of(bass) + 1)

    def keep(self, change: Change) -> int:
        """Changes the bench, and the file by it."""
        change(self.bench)
        kept = self.bench.notes()  # the bench has their addresses
        state = int(keep_notes(self.bench.record.ctypes.data, self.image.address))
        assert len(kept[0]) and check_file(self.image.address, 8 * int(self.image.head["words"])) == GOOD
        return state


def rows(pool: Pool) -> list[Floats]:
    """The rows of each operator."""
    made = []
    for op in pool.records.ravel():
        first = int(op["coefficients"])
        place, size = first - pool.memory.ctypes.data, int(op["answers"]) + 16 * int(op["answering"]) - first
        made.append(pool.memory[place // 8 : (place + size) // 8].copy())
    return made


def same(a: list[Floats], b: list[Floats]) -> bool:
    return all(np.array_equal(x, y) for x, y in zip(a, b, strict=True))


def own_pool(shop: Workshop) -> Pool:
    """The pool of a workshop as Python has pools."""
    made = shop.image.pool(LIVE, RATE)
    size = made.records.nbytes
    return Pool(shop.memory.view(np.uint8)[:size].view(made.records.dtype).reshape(made.records.shape), shop.memory)


def lowered(i: int, action: float, relief: float, nut: float, lifts: list[float] | None = None) -> Change:
    def change(bench: Bench) -> None:
        raised = np.array(lifts or [0.0])
        to = bench.record.ctypes.data
        bench.record["numbers"] = bench.numbers.ctypes.data
        assert set_neck(to, i, action, relief, nut, raised.ctypes.data if lifts else 0) == SET

    return change


def with_number(i: int, **values: float) -> Change:
    def change(bench: Bench) -> None:
        for name, value in values.items():
            bench.record["string"][0, i][name] = value

    return change


def moved_pickup(bench: Bench) -> None:
    for string in bench.record["string"][0][: int(bench.record["strings"][0])]:
        bench.numbers[int(string["taps"]) : int(string["taps"]) + 2] = 0.1, 0.03


LIFT = [0.0] * 6 + [0.1e-3] + [0.0] * 13
HANDS = {"graze_action": ACTION, "graze_relief": "0.3 mm", "graze_nut_height": "0.5 mm"}
HEIGHTS: list[tuple[str, dict[str, dict[str, Any]], Change]] = [
    ("jazz-finger", {"E": {"neck": {"action": "1.6 mm"}}, "player": HANDS}, lowered(0, 1.6e-3, 0.3e-3, 0.5e-3)),
    ("jazz-finger", {"G": {"neck": {"relief": "0.6 mm", "nut_height": "0.4 mm"}}, "player": HANDS},
     lowered(3, 2e-3, 0.6e-3, 0.4e-3)),
    ("jazz-finger", {"A": {"neck": {"lift": {"7": "0.1 mm"}}}, "player": HANDS},
     lowered(1, 2.2e-3, 0.3e-3, 0.5e-3, LIFT)),
    ("fretless", {"D": {"neck": {"action": "2.3 mm", "relief": "0.2 mm"}},
                  "player": {"graze_action": {"unit": "mm", "values": [1.8, 1.8, 1.9, 1.8]}, "graze_relief": "0.3 mm"}},
     lowered(2, 2.3e-3, 0.2e-3, 0.4e-3)),
]  # fmt: skip
OTHERS: list[tuple[str, dict[str, dict[str, Any]], Change]] = [
    ("jazz-finger", {"A": {"viscoelastic_angle": 0.02, "extra_damping": "3 /s"}},
     with_number(1, viscoelastic_angle=0.02, extra_damping=3.0)),
    ("jazz-finger", {"neck": {"contact_stiffness": 3e8, "contact_exponent": 1.7, "friction": "500 N/m"}}, lambda bench:
     [with_number(i, contact_stiffness=3e8, contact_exponent=1.7, friction=500.0,
                  contact_loss=bass_of("jazz-finger", {"neck": {"contact_stiffness": 3e8, "contact_exponent": 1.7}})
                  .necks[i].loss)(bench) for i in range(4)] and None),
    ("flatwound", {"G": {"tension": "190 N"}}, lambda bench: with_number(3, tension=190.0)(bench)),
    ("flatwound", {"G": {"diameter": "1.3 mm"}}, with_number(3, diameter=1.3 * 1e-3)),
    ("jazz-finger", {"pickup": {"position": "100 mm", "aperture": "30 mm"}}, moved_pickup),
]  # fmt: skip


@pytest.mark.parametrize(("preset", "keys", "change"), HEIGHTS)
def test_heights_written_are_those_of_a_bass_built_anew(
    preset: str, keys: dict[str, dict[str, Any]], change: Change
) -> None:
    """And the sound is the same, by the same hand: every row and every sample."""
    usual = bass_of(preset, {})
    shop, wanted = Workshop(usual), bass_of(preset, keys)
    anew = image(wanted, QUALITIES["live"].for_contact(wanted.loss, wanted.over_board)).pool(LIVE, RATE)
    assert not same(rows(own_pool(shop)), rows(anew))
    assert shop.keep(change) == DONE
    assert take_heights(shop.pool.ctypes.data, 0, shop.notes) == DONE
    ours, others = own_pool(shop), anew
    assert same(rows(ours), rows(others))
    engines = Engine(usual, QUALITIES["live"], RATE), Engine(wanted, QUALITIES["live"], RATE)
    engines[0].pools = [ours]
    engines[0]._begin(0)
    for engine in engines:
        keys_played = [string.open_note + 3 * k for k, string in enumerate(wanted.strings)]
        engine.send(np.zeros(4, np.int64), np.array([[0x90, key, 120] for key in keys_played], np.uint8))
    assert np.array_equal(*(engine.process(6000) for engine in engines))


@pytest.mark.parametrize(("preset", "keys", "change"), HEIGHTS + OTHERS)
def test_notes_filled_anew_are_those_of_a_bass_built_anew(
    preset: str, keys: dict[str, dict[str, Any]], change: Change
) -> None:
    shop, wanted = Workshop(bass_of(preset, {})), bass_of(preset, keys)
    quality = QUALITIES["live"].for_contact(wanted.loss, wanted.over_board)
    made = image(wanted, quality)
    anew = made.pool(LIVE, RATE)
    state = shop.keep(change)
    assert state == DONE
    before, numbers = rows(own_pool(shop)), [n for n in anew.records.dtype.names or () if n in NUMBERS]
    unlike = own_pool(shop).records["stiffness"] != anew.records["stiffness"]
    assert refill_notes(shop.pool.ctypes.data, 0, shop.notes) == DONE
    ours = own_pool(shop)
    assert same(rows(ours), rows(anew)) and (unlike.any() or not same(before, rows(anew)))
    assert all(np.array_equal(ours.records[name], anew.records[name]) for name in numbers)


NUMBERS = ("modes", "points", "friction", "slip", "stiffness", "exponent", "loss", "length", "speed", "held_stiffness")


def test_a_fret_that_chokes_notes_and_one_that_does_so_no_more() -> None:
    """Notes become shorter, and longer again: not by heights alone, but where notes are filled anew."""
    shop = Workshop(bass_of("jazz-finger", {}))
    usual, file = rows(own_pool(shop)), shop.image.words.copy()
    choking = bass_of("jazz-finger", {"A": {"neck": {"lift": {"7": "0.9 mm"}}}, "player": HANDS})
    high = [0.0] * 6 + [0.9 * 1e-3] + [0.0] * 13
    assert shop.keep(lowered(1, 2.2e-3, 0.3e-3, 0.5e-3, high)) == DONE
    assert take_heights(shop.pool.ctypes.data, 0, shop.notes) == OTHER_PLACES
    assert refill_notes(shop.pool.ctypes.data, 21, 21) == DONE
    anew = image(choking, QUALITIES["live"].for_contact(choking.loss, False)).pool(LIVE, RATE)
    assert same(rows(own_pool(shop)), rows(anew)) and np.unique(anew.records["length"][1]).size < 21
    assert shop.keep(lowered(1, 2.2e-3, 0.3e-3, 0.5e-3)) == DONE
    assert refill_notes(shop.pool.ctypes.data, 21, 21) == DONE
    assert same(rows(own_pool(shop)), usual)
    assert np.array_equal(shop.image.words.view(np.int64), file.view(np.int64))


def row(pool: Pool, op: np.void, name: str) -> Floats:
    """The heights of an operator's contact points, or those of the hand."""
    first = (int(op[name]) - pool.memory.ctypes.data) // 8
    return pool.memory[first : first + int(op["points"])].copy()


def test_measured_heights_are_written_one_by_one() -> None:
    """Frets that were filed, of a neck with measured heights: the hand stays on the open string."""
    usual = bass_of("paper-bass", {})
    filed = tuple(h - 0.1e-3 * (k in (4, 9)) for k, h in enumerate(usual.necks[1].fret_heights))
    wanted = replace(
        usual, necks=tuple(replace(n, fret_heights=filed) if i == 1 else n for i, n in enumerate(usual.necks))
    )
    shop, anew = Workshop(usual), image(wanted, QUALITIES["live"]).pool(LIVE, RATE)
    old = shop.image.pool(LIVE, RATE)

    def change(bench: Bench) -> None:
        first, count = (int(bench.record["string"][0, 1][name]) for name in ("frets", "frets_count"))
        bench.numbers[first + 1 : first + 2 * count : 2] = filed

    assert shop.keep(change) == DONE and take_heights(shop.pool.ctypes.data, 0, shop.notes) == DONE
    ours = own_pool(shop)
    for i, fret in np.ndindex(ours.records.shape):
        op = ours.records[i, fret]
        assert np.array_equal(row(ours, op, "heights"), row(anew, anew.records[i, fret], "heights"))
        if fret == 0:
            assert np.array_equal(row(ours, op, "hand_heights"), row(old, old.records[i, 0], "heights"))
    assert not np.array_equal(row(ours, ours.records[1, 0], "heights"), row(old, old.records[1, 0], "heights"))


def test_a_pool_built_anew_keeps_the_hand() -> None:
    """Of a file that was changed in place: every row is that of the bass whose preset says which hand."""
    preset, keys, change = HEIGHTS[0]
    old, new = Workshop(bass_of(preset, {})), Workshop(bass_of(preset, {}))
    assert new.keep(change) == DONE
    measure_pool(new.pool.ctypes.data)
    assert fill_pool(new.pool.ctypes.data) == DONE
    wanted = bass_of(preset, keys)
    anew = image(wanted, QUALITIES["live"].for_contact(wanted.loss, False)).pool(LIVE, RATE)
    assert not same(rows(own_pool(new)), rows(anew))
    assert keep_hand(new.pool.ctypes.data, old.pool.ctypes.data) == DONE
    assert same(rows(own_pool(new)), rows(anew))
    other = Workshop(bass_of("five-string", {}))
    assert keep_hand(new.pool.ctypes.data, other.pool.ctypes.data) == OTHER_PLACES


def test_what_takes_more_room_is_left_as_it_is() -> None:
    """Modes that the contact rate could not carry before; and another number of frets."""
    low = bass_of("jazz-finger", {"A": {"core_diameter": "1.25 mm", "diameter": "1.3 mm"}})
    shop = Workshop(low)
    pool = rows(own_pool(shop))
    assert shop.keep(with_number(1, inharmonicity=1e-5)) == DONE
    assert refill_notes(shop.pool.ctypes.data, 21, 21) == NO_ROOM
    assert same(rows(own_pool(shop)), pool)
    other = Workshop(bass_of("jazz-finger", {"neck": {"frets": 18}}))
    file = shop.image.words.copy()
    other.bench.notes()
    assert keep_notes(other.bench.record.ctypes.data, shop.image.address) == NO_ROOM
    assert np.array_equal(shop.image.words.view(np.int64), file.view(np.int64))


def test_a_crown_above_the_string_is_refused() -> None:
    shop = Workshop(bass_of("jazz-finger", {}))
    high = [0.0] * 20
    high[7] = 6e-3
    with pytest.raises(ValueError, match=r"fret 8 stands .* above string E at rest"):
        shop.keep(lowered(0, 2.4e-3, 0.3e-3, 0.5e-3, high))


def test_what_is_not_by_geometry_is_said() -> None:
    for preset, capo in (("jazz-finger", 2), ("paper-fretless", 0)):
        data = copy.deepcopy(preset_tables(preset)[1]) | {"capo": capo}
        bench = Workshop(Builder("f").instrument(data)).bench
        bench.record["numbers"] = bench.numbers.ctypes.data
        assert set_neck(bench.record.ctypes.data, 0, 2e-3, 3e-4, 5e-4, 0) == NOT_BY_GEOMETRY


def test_a_page_lowers_a_neck_as_python_does() -> None:
    """In WebAssembly: heights by the kernels, written while it plays, sound as the file of the same numbers."""
    action, hand = {"unit": "mm", "values": [1.6, 1.6, 1.6, 1.6]}, {"graze_action": ACTION}
    usual, low = bass_of("jazz-finger", {}), bass_of("jazz-finger", {"neck": {"action": action}, "player": hand})
    data, score = instrument_file(usual), score_of([(0.1, 0.1, 30, 120), (0.15, 0.1, 36, 110)], RATE)
    page, anew = Module(data), Module(instrument_file(low))
    bench = bench_of(usual, tiers(usual), frets_of(usual))
    page.play(QUANTUM * 10)
    anew.play(QUANTUM * 10)
    at = page.place(len(bench.data()))
    page.bytes(at, len(bench.data()))[:] = np.frombuffer(bench.data(), np.uint8)
    page.set(BENCH, at, numbers=at + BENCH.itemsize)
    for i in range(4):
        assert page.call("set_neck", at, i, 1.6e-3, 0.3e-3, 0.5e-3, 0) == SET
    page.call("measure_bench", at)
    lists = page.place(8 * int(page.record(BENCH, at)["room"]))
    page.set(BENCH, at, notes=page.place(84 * NOTE.itemsize), modes=page.place(8 * TIERS * 84), lists=lists)
    assert page.call("fill_bench", at) == MADE
    assert page.call("keep_notes", at, page.file) == DONE
    for pool in page.pools:
        assert page.call("take_heights", pool, 0, 84) == DONE
    for module in (page, anew):
        for message in messages_of(score):
            module.send(*message)
    sounds = [module.play(QUANTUM * 90) for module in (page, anew)]
    assert np.array_equal(*sounds) and abs(sounds[0]).max() > 0.05
    plain = Module(data)
    for message in messages_of(score):
        plain.send(*message)
    assert not np.array_equal(plain.play(QUANTUM * 100)[QUANTUM * 10 :], sounds[0])


def test_a_bench_is_bytes() -> None:
    bench = Workshop(bass_of("jazz-finger", {})).bench
    data = bench.data()
    assert len(data) == bench.record.nbytes + bench.numbers.nbytes < 24_000
    assert np.frombuffer(data[bench.record.nbytes :]).tolist() == bench.numbers.tolist()
