"""The players of a comparison's page: a real note and another bass's nearest, equally loud, in a browser."""

from __future__ import annotations

import base64
import io
import re
from pathlib import Path

import numpy as np
import pytest
import soundfile
from support.command import Run, cli_text
from support.heard import REAL, heard_page

from livebass import loudness


@pytest.fixture(scope="module")
def page(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return heard_page(tmp_path_factory.mktemp("heard"))


def test_ours_are_as_loud_as_the_real_ones_and_the_page_says_what_was_moved(page: Path) -> None:
    html = page.read_text()
    found = re.findall(r'<figure><audio [^>]*base64,([^"]+)"></audio>\s*<figcaption>([^<]+)</figcaption>', html)
    assert len(found) == 2 * len(REAL) and len(html) < 2_000_000
    sounds = [soundfile.read(io.BytesIO(base64.b64decode(data))) for data, _ in found]
    for (real, rate), (ours, _), (_, says) in zip(sounds[::2], sounds[1::2], found[1::2], strict=True):
        assert loudness(ours, rate) == pytest.approx(loudness(real, rate), abs=0.1)
        assert np.abs(real).max() < 1 and np.abs(ours).max() < 1
        assert re.search(r"ours.*: [EA]1_(soft|hard), moved by [+-]\d+\.\d dB", says)
    moved = [float(re.search(r"moved by (\S+) dB", says)[1]) for _, says in found[1::2]]  # type: ignore[index]
    assert moved[-1] == pytest.approx(20 * np.log10(0.3 / 0.02), abs=3), "the quiet A is made louder"


def test_without_another_bass_the_real_notes_are_there_alone(run: Run, page: Path, tmp_path: Path) -> None:
    cli_text(run, "compare", page.parent / "real", "-o", tmp_path / "alone.html")
    html = (tmp_path / "alone.html").read_text()
    assert html.count("<audio") == len(REAL) and "moved by" not in html
