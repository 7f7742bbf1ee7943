"""The order of bars. Most cases and results are those of the player of alphaTab (MPL-2), which is a reference."""

from __future__ import annotations

from fractions import Fraction

import pytest

from livebass.tab.model import MAX_BARS, Bar, Tempo, UnreadableTab
from livebass.tab.order import order
from livebass.tab.tempos import Tempos

# Bars by sign: "|:" opens, ":|3" closes and plays 3 times, "[1,3]" are endings, other words a sign ("_" for a space)
CASES = {
    "|: :|2 . ": "0 1 0 1 2",
    "|: :|4 .": "0 1 0 1 0 1 0 1 2",
    ". :|2": "0 1 0 1",
    "|: . :|2 |::|3": "0 1 2 0 1 2 3 3 3",
    "|: [1,3] [2] :|4 .": "0 1 0 2 3 0 1 0 4",
    "|:[1] [2] [3] . [1] [2] [3] . [1,3] [2]:|3": "0 4 8 1 5 9 2 3 6 7 8",
    ". |: :|2 . . :|2 . |: :|2 . .": "0 1 2 1 2 3 4 5 1 2 1 2 3 4 5 6 7 8 7 8 9 10",
    "|: |: :|2 . :|2 . |: |: :|2 . :|2":
        "0 1 2 1 2 3 4 0 1 2 1 2 3 4 5 6 7 8 7 8 9 10 6 7 8 7 8 9 10",
    "|: [1] [2]:|2 |: [1] [2,3,4]:|4 .": "0 1 0 2 3 4 3 5 3 5 3 5 6",
    "|: :|2 da_capo .": "0 1 0 1 2 0 1 2 3",
    "|: :|2 fine da_capo_al_fine .": "0 1 0 1 2 3 0 1 2",
    "|: :|2 da_coda da_capo_al_coda coda": "0 1 0 1 2 3 0 1 2 4",
    "|: :|2 da_double_coda da_capo_al_double_coda double_coda": "0 1 0 1 2 3 0 1 2 4",
    "|: :|2 segno |::|2 da_segno .": "0 1 0 1 2 3 3 4 2 3 4 5",
    "|: :|2 . segno |::|2 da_coda . . da_segno_al_coda . coda . |::|2":
        "0 1 0 1 2 3 4 4 5 6 7 8 3 4 5 10 11 12 12",
    "|: :|2 . segno |::|2 da_coda . . da_segno_al_coda . . . |::|2":
        "0 1 0 1 2 3 4 4 5 6 7 8 3 4 5 6 7 8 9 10 11 12",
    "|: :|2 . segno |::|2 fine . . da_segno_al_fine . .": "0 1 0 1 2 3 4 4 5 6 7 8 3 4 5",
    "|: :|2 . |::|2 da_segno_segno . |::|2": "0 1 0 1 2 3 3 4 5 6 6",
    "|: segno |::|2 da_coda . da_segno_al_coda . coda :|2 . |::|2": "0 1 2 2 3 4 5 1 2 3 7 8 9 10 10",
    # our own: endings that each close, and the last ending after a jump
    "|: . [1,2]:|3 [3]:|2 [4]": "0 1 2 0 1 2 0 1 3 0 1 4",
    "|: . . [1,3]:|4 . [2,4]:|4": "0 1 2 3 0 1 2 4 5 0 1 2 3 0 1 2 4 5",
    "|: [1]:|2 [2] da_capo": "0 1 0 2 3 0 2 3",
    # as Guitar Pro 8 and MuseScore play them: issues 2858, 2884 and 2885 of alphaTab
    "|: da_coda da_capo_al_coda:|2 coda": "0 1 2 0 1 2 0 1 3",
    "|: da_capo:|3 .": "0 1 0 1 0 1 0 1 2",
    "|: [1]da_capo:|2 [2]": "0 1 0 2",
    "|: [1]:|2 [2]da_capo:|2": "0 1 0 2 0 2",
    ". da_coda coda da_capo_al_coda .": "0 1 2 3 0 1 2 3 4",
    "|: [1]:|2 [2]:|2 .": "0 1 0 2 3",
}  # fmt: skip


def bars(text: str) -> list[Bar]:
    found = []
    for word in text.split():
        bar = Bar(Fraction(4), opens="|:" in word)
        word = word.replace("|:", "", 1) if not word.startswith("|::|") else word[2:]
        if ":|" in word:
            word, plays = word.split(":|")
            bar.plays = int(plays)
        if word.startswith("["):
            endings, word = word[1:].split("]")
            bar.endings = frozenset(map(int, endings.split(",")))
        if word not in ("", "."):
            bar.signs = frozenset([word.replace("_", " ")])
        found.append(bar)
    return found


@pytest.mark.parametrize("text", CASES)
def test_bars_play_in_this_order(text: str) -> None:
    assert " ".join(map(str, order(bars(text)))) == CASES[text]


def test_endless_repeats_are_refused() -> None:
    with pytest.raises(UnreadableTab, match=f"make more than {MAX_BARS} bars"):
        order(bars("|: " * 20 + ":|99 " * 20))


def test_a_tempo_before_the_first_bar_is_that_of_the_beginning() -> None:
    before = Tempos([(Fraction(-2), Tempo(Fraction(-2), 90.0))])
    assert before.seconds(Fraction(3)) == pytest.approx(2.0, abs=1e-5)
