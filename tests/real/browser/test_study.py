"""The paper's figures in a browser."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from support.browser import chromium
from support.studies import SHORT, shortened


@pytest.fixture(scope="module")
def done(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, dict[str, Any]]:
    return shortened(tmp_path_factory.mktemp("study") / "new" / "paper")


def test_a_browser_shows_all_of_it(done: tuple[Path, dict[str, Any]], tmp_path: Path) -> None:
    """Opened from disk: every picture has a size, every player a duration."""
    directory, result = done
    with chromium(tmp_path / "profile") as driver:
        driver.get((directory / "index.html").as_uri())
        widths, durations = driver.execute_async_script("""
            const told = arguments[arguments.length - 1], players = [...document.querySelectorAll("audio")];
            const known = player => player.readyState >= 1 || player.error ? Promise.resolve()
                : new Promise(done => ["loadedmetadata", "error"].forEach(name => player.addEventListener(name, done)));
            Promise.all(players.map(known)).then(() => told([
                [...document.images].map(image => image.naturalWidth), players.map(player => player.duration)]));
        """)
        assert len(widths) == sum(len(s["figures"]) for s in result["studies"].values()) and min(widths) > 300
        assert durations == pytest.approx([SHORT] * 3, abs=0.01)
        assert driver.title and not [m for m in driver.get_log("browser") if m["level"] == "SEVERE"]
