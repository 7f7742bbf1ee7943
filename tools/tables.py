"""Writes the tables of keys and controllers into README.md and the handbook, from livebass/techniques.py."""

from __future__ import annotations

import re
from pathlib import Path

from livebass.cli.messages import TABLES

ROOT = Path(__file__).parents[1]


def main() -> None:
    """Puts each table where one with the same head stands."""
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
        file.write_text(text)


if __name__ == "__main__":
    main()
