"""Nothing moves under the finger: layout shifts, as browsers count them, while the page loads and at dropouts."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from support.browser import INSIDE, open_page, resize, serve, wait

from livebass.lab.paper.cases import PRESET

SIZES = [(360, 800), (390, 844), (844, 390), (1280, 800), (1920, 1080)]
ZOOMED = (640, 400)  # a small laptop at 200 %
LINKS = ["#story=buzz&step=2", "#case=a", f"#like={PRESET}", "#like=slap&action=-2", "?embed", "?embed#story=paper"]
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
SLOW = {"offline": False, "latency": 40, "downloadThroughput": 1_500_000, "uploadThroughput": 1_500_000}  # bytes/s
FAST = {"offline": False, "latency": 0, "downloadThroughput": -1, "uploadThroughput": -1}
STEP = "const [k, done] = arguments; showStep(PAGE.stories[0], k).then(done)"
PLACE = "const {left, top} = $('story-next').getBoundingClientRect(); return `${left} ${top}`"
DRAWN = "requestAnimationFrame(() => requestAnimationFrame(arguments[0]))"  # what has changed is on the screen


@pytest.fixture(scope="module")
def address(pages: dict[bool, Path]) -> Iterator[str]:
    with serve(pages[False].parent) as address:
        yield address


@pytest.fixture(scope="module")
def whole_address(whole: str) -> Iterator[str]:
    """The page in one file, served."""
    folder, name = whole.removeprefix("file://").rsplit("/", 1)
    with serve(Path(folder)) as address:
        yield f"{address}/{name}"


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


def load(watched: Any, address: str, width: int, height: int) -> Any:
    """Loads the page in a window of a size, until its string moves; returns the shifts till then."""
    size = {"width": width, "height": height, "deviceScaleFactor": 1, "mobile": width < 900}
    watched.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", size)
    watched.get("about:blank")
    watched.get(address)
    watched.execute_script(INSIDE)
    wait(lambda: watched.execute_script("return player.ready && see.replay !== undefined"))
    watched.execute_async_script(DRAWN)
    return watched.execute_script("return shifts")


@pytest.mark.parametrize(("width", "height"), SIZES)
def test_nothing_moves_while_the_page_loads_nor_at_dropouts(
    watched: Any, address: str, width: int, height: int
) -> None:
    loading = load(watched, f"{address}/index.html", width, height)
    assert loading["sum"] < MOST, loading["moved"]
    report = {"load": 0.1, "peak": 0.1, "overload": 0, "faults": 0, "held": [-1, -1, -1, -1]}
    watched.execute_script("Object.defineProperty(player.context, 'playbackStats', {value: {underrunEvents: 0}})")
    for count, overload in ((0, 0), (1, 0), (489, 0), (489, 1)):
        watched.execute_script("player.context.playbackStats.underrunEvents = arguments[0]", count)
        watched.execute_script("showMeters(arguments[0])", report | {"overload": overload})
        watched.execute_async_script(DRAWN)
    after = watched.execute_script("return shifts")
    assert after["sum"] - loading["sum"] < MOST, after["moved"]


@pytest.mark.parametrize(("width", "height"), [SIZES[0], SIZES[3]])
def test_nothing_moves_in_one_file_whatever_its_link_shows(
    watched: Any, whole_address: str, width: int, height: int
) -> None:
    for link in LINKS:
        loading = load(watched, f"{whole_address}{link}", width, height)
        assert loading["sum"] < MOST, (link, loading["moved"])


@pytest.mark.parametrize(("width", "height"), [*SIZES[1:3], ZOOMED])
def test_the_button_to_the_next_step_of_a_story_stays(browser: Any, whole: str, width: int, height: int) -> None:
    """Whatever the length of its sentence."""
    open_page(browser, whole)
    with resize(browser, width, height):
        open_page(browser, f"{whole}#story=buzz")
        places = set()
        for k in range(browser.execute_script("return PAGE.stories[0].steps.length")):
            browser.execute_async_script(STEP, k)
            places.add(browser.execute_script(PLACE))
        assert len(places) == 1, places
        assert browser.execute_script("return document.documentElement.scrollWidth") <= width
        assert browser.execute_script("return getComputedStyle($('same')).display") == "none"


def test_in_a_narrow_article_the_name_covers_no_slider(browser: Any, whole: str) -> None:
    open_page(browser, whole)
    with resize(browser, 360, 340):
        open_page(browser, f"{whole}?embed")
        right = "return $('bench-action').parentElement.querySelector('output').getBoundingClientRect().right"
        name = "return document.querySelector('h1').getBoundingClientRect().left"
        assert 0 < browser.execute_script(right) <= browser.execute_script(name)
