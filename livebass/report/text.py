"""Results as text: columns for people, CSV and JSON."""

from __future__ import annotations

import csv
import io
import json
import math
import textwrap
from collections.abc import Callable, Iterable, Sequence
from itertools import zip_longest
from typing import Any

import numpy as np


def columns(rows: Sequence[Sequence[str]], left: int = 1) -> list[str]:
    """A line for each row of cells, all of equal length: columns as wide as their widest cell, two spaces apart.

    The first `left` columns are aligned left, the others right.
    """
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    return [
        "  ".join(
            cell.ljust(width) if i < left else cell.rjust(width)
            for i, (cell, width) in enumerate(zip(row, widths, strict=True))
        )
        for row in rows
    ]


def runs(numbers: Iterable[int]) -> list[list[int]]:
    """Splits ascending numbers where one is missing."""
    found: list[list[int]] = []
    for number in numbers:
        if found and number == found[-1][-1] + 1:
            found[-1].append(number)
        else:
            found.append([number])
    return found


def run_text(numbers: Iterable[int], text: Callable[[int], str] = str) -> str:
    """Ascending numbers as runs, such as "5 to 8, 12"; `text` writes each."""
    return ", ".join(text(run[0]) if len(run) == 1 else f"{text(run[0])} to {text(run[-1])}" for run in runs(numbers))


def wrapped_columns(rows: Iterable[Sequence[str]], widths: Sequence[int]) -> list[str]:
    """The lines of rows of cells, each wrapped to the width of its column (characters), aligned left, two spaces apart.

    A word longer than its column is broken.
    """
    lines = []
    for row in rows:
        parts = [textwrap.wrap(cell, width) for cell, width in zip(row, widths, strict=True)]
        for line in zip_longest(*parts, fillvalue=""):
            lines.append("  ".join(part.ljust(width) for part, width in zip(line, widths, strict=True)).rstrip())
    return lines


def csv_text(head: Iterable[str], rows: Iterable[Iterable[Any]]) -> str:
    """Comma-separated values under a header; an empty cell for None, floats with enough digits to restore them."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(head)
    writer.writerows(rows)
    return text.getvalue()


def json_text(data: Any, indent: int = 1, ascii_only: bool = True) -> str:
    """`data` as JSON with a line end, after `plain`."""
    return json.dumps(plain(data), indent=indent, ensure_ascii=ascii_only, allow_nan=False) + "\n"


def plain(value: Any) -> Any:
    """`value` in JSON types: no NumPy scalars and no tuples, keys as text, None for NaN and infinities."""
    if isinstance(value, dict):
        return {str(key): plain(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [plain(item) for item in value]
    if isinstance(value, np.generic):
        value = value.item()
    return None if isinstance(value, float) and not math.isfinite(value) else value
