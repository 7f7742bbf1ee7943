"""Nothing moves under the finger: layout shifts, as browsers count them, while the page loads and at dropouts."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from support.browser import INSIDE, serve, wait

SIZES = [(360, 800), (390, 844), (844, 390), (1280, 800), (1920, 1080)]
MOST = 0.05
# Adds up the shifts, and names what moved
WATCH = """
window.shifts = {sum: 0, moved: []};
new PerformanceObserver(list => {
  for (const {value, sources} of list.getEntries()) {
    shifts.sum += value;
    shifts.moved.push([value, ...sources.map(({node}) => node?.id || node?.className || node?.nodeName)]);
  }
}).observe({type: "layout-shift", buffered: true});
"""
SLOW = {"offline": False, "latency": 40, "downloadThroughput": 500_000, "uploadThroughput": 500_000}  # bytes/s
FAST = {"offline": False, "latency": 0, "downloadThroughput": -1, "uploadThroughput": -1}
DRAWN = "requestAnimationFrame(() => requestAnimationFrame(arguments[0]))"  # what has changed is on the screen


@pytest.fixture(scope="module")
def address(pages: dict[bool, Path]) -> Iterator[str]:
    with serve(pages[False].parent) as address:
        yield address


@pytest.fixture
def watched(browser: Any) -> Iterator[Any]:
    """A browser on a slow network that adds up layout shifts."""
    added = browser.execute_cdp_cmd("Page.addScriptToEvaluateOnNewDocument", {"source": WATCH})
    browser.execute_cdp_cmd("Network.enable", {})
    browser.execute_cdp_cmd("Network.emulateNetworkConditions", SLOW)
    try:
        yield browser
    finally:
        browser.execute_cdp_cmd("Network.emulateNetworkConditions", FAST)
        browser.execute_cdp_cmd("Page.removeScriptToEvaluateOnNewDocument", added)
        browser.execute_cdp_cmd("Emulation.clearDeviceMetricsOverride", {})


@pytest.mark.parametrize(("width", "height"), SIZES)
def test_nothing_moves_while_the_page_loads_nor_at_dropouts(
    watched: Any, address: str, width: int, height: int
) -> None:
    size = {"width": width, "height": height, "deviceScaleFactor": 1, "mobile": width < 900}
    watched.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", size)
    watched.get("about:blank")
    watched.get(f"{address}/index.html")
    watched.execute_script(INSIDE)
    wait(lambda: watched.execute_script("return player.ready && see.replay !== undefined"))
    watched.execute_async_script(DRAWN)
    loading = watched.execute_script("return shifts")
    assert loading["sum"] < MOST, loading["moved"]
    report = {"load": 0.1, "peak": 0.1, "overload": 0, "faults": 0, "held": [-1, -1, -1, -1]}
    watched.execute_script("Object.defineProperty(player.context, 'playbackStats', {value: {underrunEvents: 0}})")
    for count, overload in ((0, 0), (1, 0), (489, 0), (489, 1)):
        watched.execute_script("player.context.playbackStats.underrunEvents = arguments[0]", count)
        watched.execute_script("showMeters(arguments[0])", report | {"overload": overload})
        watched.execute_async_script(DRAWN)
    after = watched.execute_script("return shifts")
    assert after["sum"] - loading["sum"] < MOST, after["moved"]
