"""The order in which the bars of a piece sound: repeats, endings, and jumps by signs.

After a jump only repeats that say so are played again, and of several endings the last one. Each jump is taken once. A
jump in a bar that closes a repeat waits until the bar is heard for the last time.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, field, replace

from livebass.tab.model import MAX_BARS, Bar, UnreadableTab

SEGNO, DOUBLE_SEGNO, CODA, DOUBLE_CODA, FINE, CAPO = "segno", "segno segno", "coda", "double coda", "fine", "capo"
# Signs of a bar. Targets are places; jumps lead to a place, and from there on to another one.
TARGETS = (SEGNO, DOUBLE_SEGNO, CODA, DOUBLE_CODA, FINE)
GOALS = {"": "", " al coda": CODA, " al double coda": DOUBLE_CODA, " al fine": FINE}
JUMPS = {
    f"da {place}{ending}": (place, goal) for place in (CAPO, SEGNO, DOUBLE_SEGNO) for ending, goal in GOALS.items()
}
TO_CODA = {"da coda": CODA, "da double coda": DOUBLE_CODA}
STANDARD = {"dc": "dacapo", "ds": "dasegno", "dalsegno": "dasegno", "tocoda": "dacoda"}
_BY_LETTERS = {sign.replace(" ", ""): sign for sign in (*TARGETS, *JUMPS, *TO_CODA)}


def sign_of(text: str) -> str | None:
    """The sign that a file calls "DaSegnoAlFine" or "Dal Segno al Fine"; None: unknown."""
    letters = "".join(c for c in text.lower() if c.isalpha())
    for word, standard in STANDARD.items():
        letters = standard + letters[len(word) :] if letters.startswith(word) else letters
    return _BY_LETTERS.get(letters)


@dataclass
class _Repeat:
    """A repeat that is being played. If several closing bars have endings, it counts passes through all of it."""

    opens: int
    closes: list[int]
    passes: int  # in all; 0: each closing bar counts its own
    taken: dict[int, int] = field(default_factory=dict)  # jumps back, by closing bar

    def turn(self, at: int) -> int:
        """The number of the pass, from 1, at bar `at`."""
        if self.passes:
            return 1 + sum(self.taken.values())
        return 1 + self.taken.get(next((close for close in self.closes if close >= at), self.closes[-1]), 0)

    def goes_back(self, at: int, plays: int, heard: bool) -> bool:
        """Counts the arrival at the closing bar `at`, `heard` or left out; True: from here back to the beginning."""
        last = self.passes if self.passes and heard else plays if not self.passes or at == self.closes[-1] else 0
        if self.turn(at) >= last:
            return False
        self.taken[at] = self.taken.get(at, 0) + 1
        if not self.passes:
            self.taken.update((close, 0) for close in self.closes if close < at)
        return True


def order(bars: Sequence[Bar]) -> list[int]:
    """The numbers of the bars, from 0, as they sound. Raises UnreadableTab for more than MAX_BARS steps."""
    inner, again = inner_repeats(bars), Counter[int]()
    plays = {close: bars[close].plays for close in inner}
    bars = [
        replace(bar, opens=bar.opens and k not in inner.values(), plays=1 if k in inner else bar.plays)
        for k, bar in enumerate(bars)
    ]
    endings, closes, played = _endings(bars), _closes(bars), list[int]()
    active = list[_Repeat]()
    goal: str | None = None  # after a jump: where to go on
    jumped: set[tuple[int, str]] = set()
    at = steps = 0
    while at < len(bars):
        bar, steps = bars[at], steps + 1
        if steps > MAX_BARS:
            raise UnreadableTab(f"its repeats and jumps make more than {MAX_BARS} bars")
        opens = at in closes and (goal is None or any(bars[close].after_jump for close in closes[at]))
        if opens and all(repeat.opens != at for repeat in active):
            active.append(_Repeat(at, closes[at], _passes(endings, closes[at])))
        if goal is not None and not active:
            heard = not endings[at] or not _is_followed(bars, at, max(endings[at]))
        else:
            heard = not (active and endings[at]) or active[-1].turn(at) in endings[at]
        if heard:
            played.append(at)
        if heard and goal is None and again[at] + 1 < plays.get(at, 1):
            again[at] += 1
            at = inner[at]
            continue
        again[at] = 0
        back = _back(active, bar, at, heard) if _is_heard_again(active, at, endings[at]) else None
        jump = _jump(bars, at, goal, jumped) if back is None else None
        if jump is not None:
            (at, goal), active = jump, []
            continue
        if goal == FINE and FINE in bar.signs:
            break
        back = _back(active, bar, at, heard) if back is None else back
        if back is None and active and bar.plays > 1 and at >= active[-1].closes[-1]:
            active.pop()
        at = at + 1 if back is None else back
    return played


def _back(active: Sequence[_Repeat], bar: Bar, at: int, heard: bool) -> int | None:
    """The bar at which the innermost active repeat begins again after bar `at`; None: it does not."""
    goes = bool(active) and bar.plays > 1 and active[-1].goes_back(at, bar.plays, heard)
    return active[-1].opens if goes else None


def _is_heard_again(active: Sequence[_Repeat], at: int, endings: frozenset[int]) -> bool:
    """True if another pass of the innermost repeat plays bar `at`, which has these endings, once more."""
    return bool(active) and (not endings or active[-1].turn(at) < max(endings))


def inner_repeats(bars: Sequence[Bar]) -> dict[int, int]:
    """The repeats within an ending: the opening bar by the closing one. They are played each time it is."""
    found = {}
    for opens, bar in enumerate(bars):
        if not (bar.opens and bar.endings):
            continue
        for close in range(opens, len(bars)):
            if bars[close].endings != bar.endings or (close > opens and bars[close].opens):
                break
            if bars[close].plays > 1:
                around = (*bars[max(opens - 1, 0) : opens], *bars[close + 1 : close + 2])
                if any(other.endings == bar.endings for other in around):
                    found[close] = opens
                break
    return found


def _endings(bars: Sequence[Bar]) -> list[frozenset[int]]:
    """The passes that play each bar; empty: all. An ending lasts until the next one, or the end of a repeat."""
    found, now = [], frozenset[int]()
    for bar in bars:
        now = bar.endings or (frozenset() if bar.opens else now)
        found.append(now)
        now = frozenset() if bar.plays > 1 else now
    return found


def _passes(endings: Sequence[frozenset[int]], closes: Sequence[int]) -> int:
    """The passes of a repeat whose closing bars end at least two endings; 0: it is another repeat."""
    if sum(bool(endings[close]) for close in closes) < 2:
        return 0
    return max(max(each, default=0) for each in endings[closes[0] : closes[-1] + 2])


def _closes(bars: Sequence[Bar]) -> dict[int, list[int]]:
    """The closing bars of each repeat, by its opening bar. A close without an opening repeats from the first bar."""
    found: dict[int, list[int]] = {}
    stack: list[int] = []
    opened = 0  # of the stack, by signs
    for at, bar in enumerate(bars):
        if bar.opens or not stack:
            if stack and found[stack[-1]]:
                opened -= bars[stack.pop()].opens
            stack.append(at)
            opened += bar.opens
            found[at] = []
        if bar.plays > 1:
            found[stack[-1]].append(at)
            if opened > 1:
                opened -= bars[stack.pop()].opens
    return {at: closing for at, closing in found.items() if closing}


def _is_followed(bars: Sequence[Bar], at: int, ending: int) -> bool:
    """True if a later ending than `ending` follows its bars, which include `at`."""
    for last, bar in zip(bars[at:], bars[at + 1 :], strict=False):
        if bar.endings or last.plays > 1:
            return max(bar.endings, default=0) > ending
    return False


def _jump(
    bars: Sequence[Bar], at: int, goal: str | None, jumped: set[tuple[int, str]]
) -> tuple[int, str | None] | None:
    """The bar to which a sign of bar `at` leads, and the goal from there on; None: the next bar."""
    for sign in sorted(bars[at].signs):
        if goal is not None and TO_CODA.get(sign) == goal:
            place = _find(bars, goal, range(at, len(bars)), range(at, -1, -1))
            if place is not None:
                return place, None
        if goal is None and sign in JUMPS and (at, sign) not in jumped:
            target, after = JUMPS[sign]
            place = 0 if target == CAPO else _find(bars, target, range(at, -1, -1), range(at, len(bars)))
            if place is not None:
                jumped.add((at, sign))
                return place, after
    return None


def _find(bars: Sequence[Bar], sign: str, *ways: range) -> int | None:
    """The nearest bar with a sign, in the first of the `ways` that has it."""
    return next((at for way in ways for at in way if sign in bars[at].signs), None)
