"""A comparison: basses side by side, row by row, as a table and as JSON."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from livebass.lab.comparison.rows import ROWS, Row
from livebass.lab.comparison.summary import Bass, Figure, Figures, apart, by_rank, distances, figures, medians, reason
from livebass.report.progress import Progress, steps
from livebass.report.text import columns, json_text

NOTHING = "—"  # for a missing value


@dataclass(frozen=True)
class Compared:
    """A bass with all its figures."""

    bass: Bass
    figures: Figures
    to_real: tuple[tuple[str, Figure], ...]  # its distance to each other real bass, by title

    def figure(self, row: Row) -> Figure:
        """Returns its figure for a row."""
        if not row.of(self.bass.technique):
            return Figure(math.nan, f"only for {' and '.join(row.techniques)}")
        return self.figures.get((row.key, row.when)) or Figure(math.nan, reason(self.bass, row.when))


@dataclass(frozen=True)
class Comparison:
    """Real basses and rendered ones, compared."""

    basses: tuple[Compared, ...]  # the real ones first

    def table(self) -> str:
        """Returns the table: a line per row, two columns per bass, and the reasons for missing values."""
        reasons: list[str] = []
        lines = [("", "", "unit", "real", *(c for each in self.basses for c in (each.bass.title, "")))]
        last = ""
        for row in self.rows():
            cells = [cell for each in self.basses for cell in self._cells(each, row, reasons)]
            if all(cell in ("", NOTHING) for cell in cells) and not any(
                each.figure(row).reason for each in self.basses
            ):
                continue
            title = row.title if row.title != last else ""
            last = row.title
            lines.append((title, "" if row.when == "all" else row.when, row.unit, self.ranges(row), *cells))
        text = columns(lines, 2)
        text += ["", *self._distances()]
        if reasons:
            text += ["", *(f"{NOTHING} ({_letter(k)})  {said}" for k, said in enumerate(reasons))]
        return "\n".join(line.rstrip() for line in text)

    def rows(self) -> list[Row]:
        """Returns the rows that apply to one of the basses."""
        return [row for row in ROWS if any(row.of(each.bass.technique) for each in self.basses)]

    def _cells(self, each: Compared, row: Row, reasons: list[str]) -> tuple[str, str]:
        if not row.of(each.bass.technique):
            return "", ""
        figure = each.figure(row)
        if math.isnan(figure.value):
            said = f"{figure.reason} ({each.bass.title})"
            if said not in reasons:
                reasons.append(said)
            return f"{NOTHING} ({_letter(reasons.index(said))})", ""
        return row.shown(figure.value), row.verdict(figure.value, each.bass.technique)

    def ranges(self, row: Row) -> str:
        """Returns the range of real basses for a row, as shown; several if techniques differ."""
        found = dict.fromkeys(row.range_of(each.bass.technique) for each in self.basses)
        return " | ".join("" if r is None else f"{row.shown(r.low)} to {row.shown(r.high)}" for r in found).strip(" |")

    def _distances(self) -> list[str]:
        """Returns lines with the distance from each bass to each real one."""
        rows = [
            (f"{each.bass.title} to {title}", NOTHING if math.isnan(f.value) else f"{f.value:.1f} dB")
            for each in self.basses
            for title, f in sorted(each.to_real, key=lambda pair: (math.isnan(pair[1].value), pair[1].value))
        ]
        return ["distance to the nearest note of the same pitch, 1 s, median", *columns(rows)] if rows else []

    def json(self) -> str:
        """Returns everything as JSON: rows with values, verdicts and reasons, figures by dynamic and by note."""
        return json_text({"basses": [_json(each) for each in self.basses]})


def _letter(number: int) -> str:
    """Returns a, b ... z, aa, ab ... for 0, 1 ..."""
    return ("" if number < 26 else _letter(number // 26 - 1)) + chr(ord("a") + number % 26)


def compare_basses(basses: Sequence[Bass], progress: Progress | None = None) -> Comparison:
    """Compares each bass with each real one. Measures all notes, tracked by `progress`."""
    ordered = sorted(basses, key=lambda b: b.rendered)
    real = [b for b in ordered if not b.rendered]
    notes = [n for b in ordered for n in b.notes]
    step = steps(progress, max(1, len(notes)))
    for note in notes:
        note.measures, note.shape  # noqa: B018  # measured here, kept by the note
        step()
    found = []
    for bass in ordered:
        own = figures(bass) | {(key, "all"): figure for key, figure in distances(bass, real).items()}
        found.append(Compared(bass, own, tuple((o.title, apart(bass, o)) for o in real if o is not bass)))
    return Comparison(tuple(found))


def _json(each: Compared) -> dict[str, Any]:
    bass = each.bass
    return {
        "name": bass.name,
        "technique": bass.technique,
        "rendered": bass.rendered,
        "rows": [_row(each, row) for row in ROWS],
        "dynamics": [
            {"dynamic": notes[0].dynamic, "notes": len(notes),
             "medians": {key: figure.value for key, figure in medians(notes).items()}}
            for notes in by_rank(bass.notes)
        ],
        "distances": {title: figure.value for title, figure in each.to_real},
        "notes": [
            {"name": n.name, "pitch_hz": n.pitch, "dynamic": n.dynamic, "figures": dict(n.measures),
             "missing": n.measures.missing}
            for n in bass.notes
        ],
    }  # fmt: skip


def _row(each: Compared, row: Row) -> dict[str, Any]:
    figure, real = each.figure(row), row.range_of(each.bass.technique)
    known = not math.isnan(figure.value)
    return {
        "key": row.key,
        "when": row.when,
        "title": row.title.strip(),
        "unit": row.unit,
        "value": figure.value,
        "reason": figure.reason or None,
        "real": [real.low, real.high] if real else None,
        "real_basses": real.basses if real else 0,
        "real_notes": real.notes if real else 0,
        "verdict": (row.verdict(figure.value, each.bass.technique) or None) if known else None,
    }
