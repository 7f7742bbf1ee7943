"""Writes the tables and sentences that the code determines into README.md and the handbook.

Keys and controllers come from livebass/rows/techniques.py, waveforms from livebass/lab/bench/waveform_figures.py.
"""

from __future__ import annotations

import re
from pathlib import Path

from livebass.cli.midi_help import meaning
from livebass.lab.bench.waveform_figures import waveform_rows, waveform_sentence
from livebass.model.keymap import MODO, named_keys
from livebass.rows.techniques import BUTTONS, TECHNIQUE_ROWS, Technique
from livebass.rows.units import pitch_name
from livebass.system.extras import USES

ROOT = Path(__file__).parents[1]
WORDS = 6  # first words that identify a sentence


def controller_of(row: Technique) -> str:
    """The controller of a technique in the default map, or nothing."""
    return ", ".join(str(number) for number, symbol in MODO.controllers if symbol == row.symbol)


def table(*rows: tuple[str, ...]) -> str:
    """A Markdown table; the first row is its header."""
    lines = [re.sub(r"\|  (?=\|)", "| ", f"| {' | '.join(row)} |") for row in rows]
    return "\n".join([lines[0], "|---" * len(rows[0]) + "|", *lines[1:]])


def technique_table() -> str:
    """The handbook's table of techniques, with their keys and controllers in the default map."""
    rows = [(row.trigger, named_keys(row.modo), controller_of(row), meaning(row)) for row in TECHNIQUE_ROWS.values()]
    return table(("", "key", "controller", "technique"), *(row for row in rows if row[1] or row[2]))


def short_table() -> str:
    """README's table: keys and controllers of the techniques that have buttons on the page, in the default map.

    Hosts name keys in two ways: 60 is C4, or C3.
    """
    rows: list[tuple[str, ...]] = [("technique", "key", "C4 is 60", "C3 is 60", "controller")]
    for row in (TECHNIQUE_ROWS[button.symbol] for button in BUTTONS):
        key = f"{row.trigger} {' '.join(map(str, row.modo))}" if row.modo else ""
        named = (" ".join(f"{pitch_name(k)}{k // 12 - below}" for k in row.modo) for below in (1, 2))
        rows.append((row.name, key, *named, controller_of(row)))
    return table(*rows)


def waveform_table() -> str:
    """The handbook's table of waveform distances from `reference`, by quality."""
    return table(*waveform_rows())


def extras_table() -> str:
    """The handbook's table of what needs extras."""
    return table(("for", "extras"), *((what, f"`{extras}`") for what, extras in USES))


TABLES = {
    "README.md": (short_table,),
    "livebass/help/playing.md": (technique_table,),
    "livebass/help/cost.md": (waveform_table,),
    "livebass/help/install.md": (extras_table,),
}
SENTENCES = {"README.md": (waveform_sentence,)}  # one line each


def main() -> None:
    """Replaces the table with the same head as each table, and the line with the same start as each sentence."""
    for name, tables in TABLES.items():
        file = ROOT / name
        text = file.read_text()
        for table in tables:
            wanted = table()
            head = wanted.split("\n")[0]
            found = re.findall(rf"^{re.escape(head)}\n(?:\|.*\n)*", text, re.MULTILINE)
            if len(found) != 1:
                raise SystemExit(f"{name}: {len(found)} tables begin with {head}; there has to be one")
            text = text.replace(found[0], f"{wanted}\n")
        for sentence in SENTENCES.get(name, ()):
            begin = " ".join(sentence().split()[:WORDS])
            text, count = re.subn(
                rf"^{re.escape(begin)} .*$", sentence().replace("\\", r"\\"), text, flags=re.MULTILINE
            )
            if count != 1:
                raise SystemExit(f"{name}: {count} lines begin with {begin}; there has to be one")
        file.write_text(text)


if __name__ == "__main__":
    main()
