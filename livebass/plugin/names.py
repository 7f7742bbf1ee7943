"""Compiles the patterns of track names (tracknames.py) for the plugins' C: each becomes a program of a small machine.

The machine (instance/names.c) goes through the program and the characters of a name, and goes back where a way ends
nowhere. Jumps are relative to their own place.
"""

from __future__ import annotations

# Steps: the character that follows; one of `n` ranges, which follow as pairs; go on, or by the jump; the jump; not the
# program up to the jump; not one of `n` ranges before; the end of the name; found
CHARACTER, RANGES, EITHER, JUMP, NOT_AHEAD, NOT_BEHIND, END, FOUND = range(8)
STEPS = {
    "CHARACTER": CHARACTER, "RANGES": RANGES, "EITHER": EITHER, "JUMP": JUMP, "NOT_AHEAD": NOT_AHEAD,
    "NOT_BEHIND": NOT_BEHIND, "END": END, "FOUND": FOUND,
}  # fmt: skip
CLASSES = {"w": "09AZaz__", "s": "\t\r  "}  # pairs; only ASCII: see tracknames.py


def program(pattern: str, whole: bool = False) -> list[int]:
    """Returns the program of a regular expression; `whole`: it must end where the name ends.

    The expression has characters, `.`, `\\w`, `\\s`, sets, groups, alternatives, `?`, `*`, `(?!...)` and `(?<![...])`.
    Raises ValueError for any other.
    """
    reader = _Reader(pattern)
    steps = reader.alternatives()
    if reader.at < len(pattern):
        raise ValueError(f"{pattern}: character {reader.at}: not a pattern of a name")
    return [*steps, *([END] if whole else []), FOUND]


class _Reader:
    """Reads an expression."""

    def __init__(self, text: str) -> None:
        self.text, self.at = text, 0

    def _takes(self, what: str) -> bool:
        found = self.text.startswith(what, self.at)
        self.at += len(what) * found
        return found

    def alternatives(self) -> list[int]:
        first = list[int]()
        while self.at < len(self.text) and self.text[self.at] not in "|)":
            first += self._repeated()
        if not self._takes("|"):
            return first
        others = self.alternatives()
        return [EITHER, len(first) + 4, *first, JUMP, len(others) + 2, *others]

    def _repeated(self) -> list[int]:
        steps = self._one()
        if self._takes("?"):
            return [EITHER, len(steps) + 2, *steps]
        if self._takes("*"):
            return [EITHER, len(steps) + 4, *steps, JUMP, -len(steps) - 2]
        return steps

    def _one(self) -> list[int]:
        if self._takes("(?:"):
            return self._closed(self.alternatives())
        if self._takes("(?!"):
            steps = self.alternatives()
            return self._closed([NOT_AHEAD, len(steps) + 3, *steps, FOUND])
        if self._takes("(?<!"):
            self._takes("[")
            return self._closed([NOT_BEHIND, *self._ranges()])
        if self._takes("["):
            return [RANGES, *self._ranges()]
        if self._takes("."):
            return [RANGES, 1, 0, 0x10FFFF]
        if self.text[self.at] in "(){}+*?^$":
            raise ValueError(f"{self.text}: character {self.at}: not a pattern of a name")
        pairs = self._pairs()
        return [CHARACTER, pairs[0]] if pairs[0] == pairs[-1] else [RANGES, len(pairs) // 2, *pairs]

    def _closed(self, steps: list[int]) -> list[int]:
        if not self._takes(")"):
            raise ValueError(f"{self.text}: character {self.at}: a group without its end")
        return steps

    def _pairs(self) -> list[int]:
        """The ranges of a character or a class."""
        if not self._takes("\\"):
            self.at += 1
            return [ord(self.text[self.at - 1])] * 2
        self.at += 1
        letter = self.text[self.at - 1]
        return [ord(c) for c in CLASSES.get(letter, 2 * letter)]

    def _ranges(self) -> list[int]:
        """The number of ranges of a set, and their pairs, up to the set's end."""
        pairs = list[int]()
        while not self._takes("]"):
            one = self._pairs()
            if self.text[self.at] == "-" and self.text[self.at + 1] != "]":
                self.at += 1
                one[1] = self._pairs()[1]
            pairs += one
        return [len(pairs) // 2, *pairs]
