"""Three shortened studies of the paper."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from livebass.lab.paper.figures.studies import chosen, run_studies

NAMES = ["linear", "a", "oblique"]
SHORT = 0.1  # s


def shortened(directory: Path) -> tuple[Path, dict[str, Any]]:
    """Makes three shortened studies: their directory, and their reports."""
    told: list[float] = []
    result = run_studies(
        chosen(NAMES), directory, duration=SHORT, workers=2, progress=told.append,
        json_file=directory.parent.parent / "all.json",
    )  # fmt: skip
    assert told == sorted(told) and told[-1] == 1 and len(told) == 5  # two motions, three studies
    return directory, result
