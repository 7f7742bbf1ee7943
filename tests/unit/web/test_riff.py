"""Riffs in links, in node: the notes that somebody played, as text and back, and the frames at which they sound."""

from __future__ import annotations

import random
from collections.abc import Iterator
from typing import Any

import pytest
from support.node import Node, node

# What the riff's module uses of the page's others; `sent` plays a message, `messages` are those of the offered riff
OTHERS = {
    "page.js": "export const elements = new Map();\nexport const said = [];\n"
    "export function $(name) { if (!elements.has(name)) elements.set(name, {}); return elements.get(name); }\n"
    "export const make = () => ({});\nexport const say = text => said.push(text);\n",
    "line.js": "export const told = [];\nexport const tell = text => told.push(text);\n",
    "player.js": "export const player = {context: {sampleRate: 48000}, on: (_, keep) => { player.sent = keep; }};\n",
    "techniques.js": 'export const STROKES = [{symbol: "pick"}];\nexport const plucked = [];\n'
    "export const pluckWith = stroke => plucked.push(stroke.symbol);\n",
    "transport.js": "export const made = [];\n"
    "export class Transport {\n  constructor(how) { made.push(this); this.messages = how.messages; }\n"
    "  open(_, seconds) { this.seconds = seconds; }\n}\n",
    "tested.js": 'import {offerRiff, readRiff, riffParts} from "./riff.js";\nimport {$, said} from "./page.js";\n'
    'import {player} from "./player.js";\nimport {plucked} from "./techniques.js";\n'
    'import {made} from "./transport.js";\nimport {told} from "./line.js";\n'
    "export const tested = {offerRiff, readRiff, riffParts, $, said, told, player, plucked, transport: made[0]};\n",
}
PLAY = """
let time = arguments[1] ?? 0;
for (const [begin, key, velocity, length] of arguments[0]) {
  player.sent([0x90, key, velocity], time + begin);
  player.sent([0x80, key, 0], time + begin + length);
}
return riffParts().riff;
"""


@pytest.fixture
def riffs() -> Iterator[Node]:
    """A page for each test, as a page keeps the last riff."""
    with node("tested.js", OTHERS) as found:
        found.run("Object.assign(globalThis, tested)")
        yield found


def of(notes: list[tuple[int, ...]]) -> str:
    return "_".join(".".join(map(str, note)) for note in notes)


def test_the_last_notes_come_back_from_a_link(riffs: Node) -> None:
    """Sixteen at most, from the first after a pause on; each plays at its frame."""
    rng, time = random.Random(1), 0
    for _ in range(300):
        notes, begin = [], 0
        for _ in range(rng.randint(1, 20)):
            notes.append((begin, rng.randint(20, 127), rng.randint(1, 127), rng.randint(0, 2900)))
            begin += rng.randint(1, 3000)
        time += 100_000  # ms: the next riff begins
        last = notes[-16:]
        kept = [(begin - last[0][0], *rest) for begin, *rest in last]
        assert riffs.run(PLAY, notes, time) == of(kept)
        assert riffs.run("return readRiff(arguments[0])", of(kept)) == [list(note) for note in kept]
        riffs.run("offerRiff(arguments[0])", f"#riff={of(kept)}&stroke=pick")
        says = "A friend's notes on this bass: play the riff, or press a string."
        assert riffs.run("return [$('riff').hidden, plucked.at(-1), told.at(-1)]") == [False, "pick", says]
        messages: list[Any] = riffs.run("return [...transport.messages()]")
        rows = [messages[k : k + 4] for k in range(0, len(messages), 4)]
        wanted = [[48 * begin, 0x90, key, velocity] for begin, key, velocity, _ in kept]
        wanted += [[48 * (begin + length), 0x80, key, 0] for begin, key, _, length in kept]
        assert sorted(rows) == sorted(wanted) and [row[0] for row in rows] == sorted(row[0] for row in wanted)
        assert riffs.run("return transport.seconds") == max(begin + length for begin, *_, length in kept) / 1000


def test_key_switches_are_no_notes(riffs: Node) -> None:
    assert riffs.run(PLAY, [(0, 4, 100, 100), (10, 40, 100, 100)]) == "0.40.100.100"


@pytest.mark.parametrize(
    "riff", ["", "x", "0.28.90", "0.28.200.9", "0.28.90.9_", "99999.28.90.9", "_".join(["0.1.1.1"] * 17)]
)
def test_a_bad_riff_is_told_and_not_offered(riffs: Node, riff: str) -> None:
    riffs.run("offerRiff(arguments[0])", f"#like=jazz-finger&riff={riff}")
    hidden, said, told = riffs.run("return [$('riff').hidden, said.at(-1), told.length]")
    assert hidden and not told and said == f"the link's riff cannot be read: {riff[:30]}."
