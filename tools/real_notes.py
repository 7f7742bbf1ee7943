"""Makes the tables of real basses from recordings: livebass/lab/comparison/ranges.csv and notes.csv.

    python tools/real_notes.py FOLDER
    python tools/real_notes.py FOLDER --rows floor_     add new rows to ranges.csv

FOLDER holds one folder of single notes for each section of tools/real_notes.toml, which says where they come from.
ranges.csv has a line for each row of `livebass compare` and technique: the lowest and the highest median of a bass, and
the number of basses and notes behind them. A bass with one dynamic counts as hard, unless it is played with fingers:
there are enough hard notes of these. notes.csv has the figures of each note that is in the public domain. `--rows`
writes the rows of ranges.csv whose keys begin so, by the recordings that FOLDER has, and leaves all others.
"""

from __future__ import annotations

import argparse
import csv
import io
import math
import tomllib
from collections import defaultdict
from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path
from typing import Any

from livebass.lab.comparison.groups import FIGURES, note_row
from livebass.lab.comparison.notes import measure_notes
from livebass.lab.comparison.rows import ALL, ROWS
from livebass.lab.comparison.summary import Bass, basses, distances, figures

HERE = Path(__file__).parent
PLACE = HERE.parent / "livebass" / "lab" / "comparison"
FEWEST = 2  # basses behind a range
LEVELS = {"level", "level_span", "level_growth", "between_rise", "take_level"}
ATTACK = {"centroid_20", "centroid_fall", "fundamental_fall", "snap", "thump"}


def read(folder: Path, name: str, info: dict[str, Any]) -> Bass:
    """Returns the notes of one set of recordings as a bass."""
    notes = [replace(n, technique=info["technique"]) for n in measure_notes([folder / name])]
    (bass,) = basses(name, notes)
    return bass


def skipped(key: str, info: dict[str, Any]) -> bool:
    """Returns whether a set of recordings cannot tell a figure."""
    if not info.get("levels", True) and key in LEVELS:
        return True
    return not info.get("attack", True) and (key in ATTACK or key.startswith("octave_"))


def ranges(sets: dict[str, Any], found: dict[str, Bass]) -> Iterable[list[Any]]:
    """Yields the lines of ranges.csv."""
    values: dict[tuple[str, str, str], list[tuple[float, str, int]]] = defaultdict(list)
    for name, bass in found.items():
        others = [b for other, b in found.items() if sets[other]["bass"] != sets[name]["bass"]]
        own = figures(bass) | {(key, ALL): figure for key, figure in distances(bass, others).items()}
        for row in ROWS:
            figure = own.get((row.key, row.when))
            one_dynamic = len(bass.ranks) == 1 and bass.technique == "fingers" and row.when != ALL
            if figure is None or math.isnan(figure.value) or one_dynamic or skipped(row.key, sets[name]):
                continue
            info = (figure.value, sets[name]["bass"], len(bass.dynamic(row.when)))
            values[row.key, row.when, bass.technique].append(info)
    for (key, when, technique), each in sorted(values.items()):
        medians, names = [value for value, _, _ in each], {bass for _, bass, _ in each}
        if len(names) >= FEWEST:
            low, high, count = min(medians), max(medians), sum(count for _, _, count in each)
            yield [key, when, technique, f"{low:.4g}", f"{high:.4g}", len(names), count]


def notes(sets: dict[str, Any], found: dict[str, Bass]) -> Iterable[list[Any]]:
    """Yields the lines of notes.csv."""
    for name, bass in found.items():
        if sets[name].get("shipped"):
            for note in bass.notes:
                values = note_row(note)
                info = ["" if math.isnan(v) or skipped(key, sets[name]) else f"{v:.4g}"
                        for key, v in zip(FIGURES, values, strict=True)]  # fmt: skip
                yield [name, sets[name]["bass"], bass.technique, round(note.pitch, 2), note.rank, *info]


def write(path: Path, head: list[str], lines: Iterable[list[Any]]) -> None:
    """Writes a table."""
    text = io.StringIO()
    table = csv.writer(text, lineterminator="\n")
    table.writerow(head)
    table.writerows(lines)
    path.write_text(text.getvalue(), "utf-8")
    print(f"{path}: {text.getvalue().count(chr(10)) - 1} lines")


def main() -> None:
    """Reads the recordings and writes both tables."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path, help="the folder of all recordings")
    parser.add_argument("--rows", metavar="BEGINNING", help="only the rows of ranges.csv whose keys begin so")
    options = parser.parse_args()
    folder, rows = options.folder, options.rows
    sets = tomllib.loads((HERE / "real_notes.toml").read_text("utf-8"))
    there = [name for name in sets if (folder / name).is_dir()]
    missing = sets.keys() - there
    if missing and (rows is None or not there):
        parser.error(f"{folder}: has no folder {', '.join(sorted(missing))}")
    found = {name: read(folder, name, sets[name]) for name in there}
    made = list(ranges(sets, found))
    if rows is None:
        write(PLACE / "notes.csv", ["set", "bass", "technique", "pitch", "rank", *FIGURES], notes(sets, found))
    else:
        made = [line for line in made if line[0].startswith(rows)]
        with (PLACE / "ranges.csv").open(encoding="utf-8", newline="") as file:
            made += [line for line in list(csv.reader(file))[1:] if not line[0].startswith(rows)]
    head = ["key", "when", "technique", "low", "high", "basses", "notes"]
    write(PLACE / "ranges.csv", head, sorted(made, key=lambda line: line[:3]))


if __name__ == "__main__":
    main()
