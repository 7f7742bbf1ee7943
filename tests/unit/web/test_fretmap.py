"""The page's fret map against `livebass map`."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest
from support import node

from livebass import load_preset
from livebass.lab.experiment.fretmap import DURATION, RATE, VELOCITY, fret_maps, in_threads, notes_of

BASSES = ("jazz-finger", "slap", "fretless")
BUZZ = """
const [name, buzz, rate, action] = arguments;
return ask({buzz, file: fileOf(name, action ? {action} : {}), tier: 0, rate});
"""


@pytest.fixture(scope="module")
def page(tmp_path_factory: pytest.TempPathFactory) -> Iterator[node.Page]:
    with node.page({name: load_preset(name) for name in BASSES}, tmp_path_factory.mktemp("page")) as page:
        yield page


@pytest.mark.parametrize("name", BASSES)
def test_the_pages_cells_are_those_of_the_library(page: node.Page, name: str) -> None:
    """Contact can be chaotic, and the two round differently: nine notes in ten are the same."""
    bass, frames = load_preset(name), round(DURATION * RATE)
    frets, ends, same = [0, 1, 5, 9, 15], (0, len(bass.strings) - 1), []
    notes = [note for note in notes_of([bass]) if note.string in ends and note.fret in frets]
    (made,) = fret_maps(notes, in_threads)
    for i, cells in zip(ends, made.strings, strict=True):
        given = {"string": i, "open": bass.strings[i].open_note, "frets": frets, "velocity": VELOCITY, "frames": frames}
        for cell, found in zip(cells, page.run(BUZZ, name, given, RATE, 0), strict=True):
            hardest = np.nan if found.get("hardest") is None else found["hardest"]
            wanted = (cell.contacts, cell.hardest, cell.speed, cell.lasts)
            measured = (found["contacts"], hardest, found["speed"], found["last"] / RATE)
            same.append(measured == pytest.approx(wanted, rel=1e-6, abs=1e-6, nan_ok=True))
    assert np.mean(same) >= 0.9, same
    assert made.values("contacts").sum() > 300


def test_a_higher_neck_touches_less(page: node.Page) -> None:
    given = {"string": 0, "open": 28, "frets": [0, 5, 12], "velocity": VELOCITY, "frames": 4800}
    low, high = (sum(cell["contacts"] for cell in page.run(BUZZ, "jazz-finger", given, RATE, mm)) for mm in (-0.5, 2))
    assert low > 1.5 * high
