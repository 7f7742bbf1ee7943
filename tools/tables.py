"""Writes the tables and sentences that the code determines into README.md and the handbook.

Keys and controllers come from livebass/techniques.py, waveforms from livebass/bench/measured.py.
"""

from __future__ import annotations

import re
from pathlib import Path

from livebass.cli.messages import SENTENCES, TABLES

ROOT = Path(__file__).parents[1]
WORDS = 6  # first words that identify a sentence


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
