"""The site in a browser, on a phone."""

from __future__ import annotations

import json
import time
from pathlib import Path
from typing import Any

from support.browser import chromium, errors, serve, wait
from support.programs import load
from support.site import build

# Elements that reach beyond the window. Code and tables may: each scrolls by itself
WIDE = """
return [...document.querySelectorAll("main *")]
  .filter(e => e.getBoundingClientRect().right > innerWidth + 1 && !e.closest("pre, .pst-scrollable-table-container"))
  .map(e => `${e.tagName} ${e.textContent.slice(0, 40)}`).concat(innerWidth > 390 ? [`window ${innerWidth}`] : []);
"""


def test_a_browser_shows_every_page_on_phones_and_plays(tmp_path: Path) -> None:
    """No page is wider than a phone, logs an error or loads from elsewhere; search finds; the live page sounds."""
    logs = {"browser": "ALL", "performance": "ALL"}
    with (
        chromium(tmp_path / "profile", loggingPrefs=logs) as driver,
        serve(build(load("site"), tmp_path / "site")) as address,
    ):
        size = {"width": 390, "height": 844, "deviceScaleFactor": 1, "mobile": True}
        driver.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", size)
        pages = [file.relative_to(tmp_path / "site").as_posix() for file in sorted(tmp_path.glob("site/**/*.html"))]
        wide = []
        for page in pages:
            driver.get(f"{address}/{page}")
            wide += [f"{page}: {element}" for element in driver.execute_script(WIDE)]
        assert wide == [] and len(pages) > 25
        driver.get(f"{address}/search.html?q=render_to_file")
        wait(lambda: "render_to_file" in driver.find_element("id", "search-results").text)
        driver.get(f"{address}/index.html")
        driver.find_element("css selector", ".open-page a").click()
        wait(lambda: driver.execute_script("return document.querySelector('button.fret[data-fret=\"5\"]')"))
        wait(lambda: level(driver) not in ("", "silent"))
        assert not errors(driver)
        messages = [json.loads(line["message"])["message"] for line in driver.get_log("performance")]
        sent = [m["params"]["request"]["url"] for m in messages if m["method"] == "Network.requestWillBeSent"]
        assert [url for url in sent if url.startswith(("http", "ws")) and not url.startswith(address)] == []


def level(driver: Any) -> str:
    """Presses a fret, and returns what the meter of the live page says a moment later."""
    driver.find_element("css selector", 'button.fret[data-fret="5"]').click()
    time.sleep(0.2)
    return str(driver.find_element("id", "level-text").text)
