"""The players of a comparison's page in a browser: by keys, one at a time."""

from __future__ import annotations

from pathlib import Path

import pytest
from support.browser import chromium, wait
from support.heard import REAL, heard_page


@pytest.fixture(scope="module")
def page(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return heard_page(tmp_path_factory.mktemp("heard"))


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
