"""Three shortened studies of the paper."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from livebass.lab.paper.figures.studies import choose_studies, run_studies

NAMES = ["linear", "a", "oblique"]
SHORT = 0.1  # s


def shortened(directory: Path) -> tuple[Path, dict[str, Any]]:
    """Makes three shortened studies: their directory, and their reports."""
    reported: list[float] = []
    result = run_studies(
        choose_studies(NAMES), directory, duration=SHORT, workers=2, progress=reported.append,
        json_file=directory.parent.parent / "all.json",
    )  # fmt: skip
    assert reported == sorted(reported) and reported[-1] == 1 and len(reported) == 5  # two motions, three studies
    return directory, result
