"""Code that the binary shares between processor levels gives the same results on all of them."""

from __future__ import annotations

import re
from functools import cache

from livebass.compiling import SMALL, emitter, lowering
from livebass.plugin.header import ENTRIES, entries_of, lowest

DEFINITION = re.compile(r'^define [^@\n]*@(?:"([^"]+)"|([\w.$]+))\(.*?^}', re.MULTILINE | re.DOTALL)
# Flags that let LLVM round differently, depending on a level's instructions
FREE = re.compile(r"= [^@\n]*\b(?:fast|reassoc|contract|arcp|afn)\b")


@cache
def definitions() -> dict[str, str]:
    """All functions of the kernels' program by name."""
    return {match[1] or match[2]: match[0] for match in DEFINITION.finditer(emitter.program())}


def free(entry: str) -> list[str]:
    """The functions reached from an entry whose rounding LLVM is free to choose."""
    reached, waiting = {f"lb_{entry}"}, [f"lb_{entry}"]
    while waiting:
        found = {name for name in lowering.names_in(definitions()[waiting.pop()]) if name in definitions()}
        waiting += found - reached
        reached |= found
    return [name for name in reached if FREE.search(definitions()[name])]


def test_what_all_levels_share_has_the_same_numbers_on_each() -> None:
    """Nothing in it is reassociated or contracted; much of the playing code is."""
    for level in emitter.LEVELS:
        own = entries_of(level)
        shared = [entry for entry in ENTRIES if entry not in own]
        assert bool(shared) == (level != lowest(level))
        assert {entry.name: free(entry.name) for entry in shared if free(entry.name)} == {}
    assert all(entry.attributes == SMALL for entry in ENTRIES if entry not in entries_of("x86-64-v3"))
    assert len(free("process")) > 20 and free("over_frets")
