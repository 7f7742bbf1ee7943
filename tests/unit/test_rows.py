"""Each number is defined once: a row makes its preset key, checks, default, record, filler and file limits."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from itertools import pairwise

import numpy as np
import pytest

from livebass.engine.prepare import fill
from livebass.model.instrument import Player
from livebass.preset import idle, keys
from livebass.preset.keys import DATACLASSES, KEYS, check_value, limits_of
from livebass.rows.parts import Coil, NeckLaw, PlayerNumbers, StringLaw
from livebass.rows.row import BYTES, Limit, Word, choice, limits, number, record, rows, table, words

NEXT = len(words(PlayerNumbers))  # the word of the next new number


@dataclass(frozen=True, kw_only=True)
class Longer(Player):
    """A player with one more number."""

    nail_length: float = number(0.002, "length", "0 mm", "10 mm", "beyond the tip", word=NEXT, of="pluck")
    nails: int = number(4, "integer", "0", "5", "how many", word=NEXT + 1, file=(0, 9))


def test_a_row_is_all_that_a_new_number_of_the_player_needs(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(DATACLASSES, "player", Longer)
    made = {key.name: key for key in keys._rows("player")}
    key = made["nail_length"]
    assert (key.section, key.default, key.meaning) == ("player", "2 mm", "beyond the tip")
    assert limits_of(key) == "from 0 mm to 10 mm" and check_value(key, "3 mm") == 0.003
    with pytest.raises(ValueError, match="must be from 0 mm to 10 mm"):
        check_value(key, "11 mm")
    assert made["nails"].default == 4
    assert "nail_length" in idle._group("pluck", "", lambda bass, part: True)[0].keys

    layout, player = record(words(Longer)), record(words(Player))
    assert layout.itemsize == player.itemsize + 2 * BYTES
    assert layout.fields is not None and layout.fields["nail_length"] == (np.dtype(float), player.itemsize)
    assert layout["nails"] == np.int64
    to = np.zeros(1, layout)
    fill(to[0], Longer(nail_length=0.005, thumb_mass=0.02))
    assert to["nail_length"] == 0.005 and to["nails"] == 4 and to["thumb_mass"] == 0.02

    found = limits([Word("frets", "i8", 0, 9), Word("player", words(Longer))])
    assert found[-2:] == [
        Limit("player.nail_length", 1 + NEXT, 1, 0, False, 0.0, 0.01),
        Limit("player.nails", 2 + NEXT, 1, 0, True, 0, 9),
    ]


@pytest.mark.parametrize("section", DATACLASSES)
def test_each_row_is_a_key_of_its_section(section: str) -> None:
    named = rows(DATACLASSES[section])
    assert named
    in_order = [key.name for key in KEYS if key.section == section and key.name in named]
    assert in_order == list(named)


@pytest.mark.parametrize("cls", [Coil, Player, StringLaw, NeckLaw])
def test_the_limits_of_a_file_take_in_those_of_a_preset(cls: type) -> None:
    for name, row in rows(cls).items():
        if row.word is not None:
            (file_min, file_max), (minimum, maximum) = row.limits, replace(row, file=None).limits
            assert file_min <= minimum <= maximum <= file_max, name
            assert file_min <= getattr(cls, name, minimum) <= file_max, name


def test_words_count_on_and_each_is_of_one_row() -> None:
    @dataclass(frozen=True)
    class Gap(Coil):
        more: float = number(0.0, "number", "0", "1", "", word=8)

    @dataclass(frozen=True)
    class Twice(Coil):
        more: float = number(0.0, "number", "0", "1", "", word=6)

    for cls in (Gap, Twice):
        with pytest.raises(ValueError, match=f"{cls.__name__}: words must count from 0"):
            words(cls)


def test_limits_follow_each_other_and_know_the_strings() -> None:
    inner = [Word("rate", "f8", 1.0, 2.0), Word("heavy", "i8", 0, 1)]
    given = [Word("tiers", inner, shape=(2,)), Word("open", "i8", 0, 9, (8,)), Word("mix", "f8", shape=(8, 4))]
    found = limits(given, 8)
    assert [limit.name for limit in found] == ["tiers.rate", "tiers.heavy"] * 2 + ["open", "mix"]
    assert all(a.first + a.size == b.first for a, b in pairwise(found))
    assert record(given).itemsize == BYTES * (found[-1].first + found[-1].size)
    assert [limit.each for limit in found] == [0, 0, 0, 0, 1, 4]
    assert table(found)[4].tolist() == [4, 8, 1, 1, 0, 9]


def test_a_choice_counts_in_its_order() -> None:
    @dataclass(frozen=True)
    class Made:
        way: str = choice("up", ("down", "up"), "where to", record="way_number")

    assert Made().way == "up" and rows(Made)["way"].choices == ["down", "up"]
    assert [f.name for f in fields(Made)] == ["way"]
