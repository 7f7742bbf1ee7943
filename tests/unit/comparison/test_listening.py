"""The players of a comparison's page: a real note and another bass's nearest, equally loud, in a browser."""

from __future__ import annotations

import base64
import io
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import soundfile
from support.browser import chromium, wait
from support.command import Run, cli_text

from livebass import loudness

RATE = 22_050
REAL = {"E1_pp": (41.2, 0.05), "E1_ff": (41.2, 0.4), "A1_ff": (55.0, 0.3)}  # names: pitch (Hz), level
OURS = {"E1_soft": (41.2, 0.2), "E1_hard": (41.2, 0.9), "A1_hard": (55.0, 0.02)}


def note(pitch: float, level: float, bright: float) -> Any:
    """A second of a plucked string, after some silence: partials that decay."""
    t = np.arange(RATE) / RATE
    partials = [np.exp(-(1 + k / 4) * t) * np.sin(2 * np.pi * k * pitch * t) / k**bright for k in range(1, 12)]
    sound = np.sum(partials, axis=0)
    return np.concatenate([np.zeros(RATE // 5), level * sound / np.abs(sound).max()])


@pytest.fixture(scope="module")
def page(tmp_path_factory: pytest.TempPathFactory) -> Path:
    from livebass.cli.main import run

    folder = tmp_path_factory.mktemp("heard")
    for name, notes, bright in (("real", REAL, 1.0), ("ours", OURS, 1.2)):
        (folder / name).mkdir()
        for stem, (pitch, level) in notes.items():
            soundfile.write(folder / name / f"{stem}.wav", note(pitch, level, bright), RATE, subtype="FLOAT")
    place = folder / "page.html"
    assert run(["compare", str(folder / "real"), "--beside", str(folder / "ours"), "-o", str(place)]) == 0
    return place


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


def test_a_browser_plays_them_from_the_keyboard_one_at_a_time(page: Path, tmp_path: Path) -> None:
    with chromium(tmp_path / "profile") as driver:
        driver.get(page.as_uri())
        state = "return [...document.querySelectorAll('audio')].map(a => [a.duration, a.error, a.ariaLabel, a.paused])"
        wait(lambda: all(duration for duration, *_ in driver.execute_script(state)))
        players = driver.execute_script(state)
        assert len(players) == 2 * len(REAL) and all(0.5 < d < 3.1 and error is None for d, error, *_ in players)
        assert players[0][2] == "E1 pp: real, fingers" and len({label for _, _, label, _ in players}) == len(players)
        driver.execute_script(
            "window.begun = [];"
            "for (const a of document.querySelectorAll('audio')) a.onplaying = () => begun.push(a.ariaLabel)"
        )
        first, second = driver.find_elements("css selector", "audio")[:2]
        driver.execute_script("arguments[0].focus()", first)
        first.send_keys(" ")
        wait(lambda: driver.execute_script("return begun.length === 1"))
        second.send_keys(" ")
        wait(lambda: driver.execute_script("return begun.length === 2 && arguments[0].paused", first))


def test_without_another_bass_the_real_notes_are_there_alone(run: Run, page: Path, tmp_path: Path) -> None:
    cli_text(run, "compare", page.parent / "real", "-o", tmp_path / "alone.html")
    html = (tmp_path / "alone.html").read_text()
    assert html.count("<audio") == len(REAL) and "moved by" not in html
