"""The recorded note of a real bass beside the computed one: both are heard, and one is drawn over the other."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from support.browser import open_page, wait

# How many px of the drawn picture are blue, and how many amber, in a dark page
DRAWN = """
const {data} = $("both").getContext("2d").getImageData(0, 0, $("both").width, $("both").height), found = [0, 0];
for (let k = 0; k < data.length; k += 4) {
  if (data[k + 3] < 200) continue;
  if (data[k + 2] > data[k] + 60) found[0]++;
  if (data[k] > data[k + 2] + 60) found[1]++;
}
return found;
"""


@pytest.fixture(scope="module")
def page(browser: Any, pages: dict[bool, Path]) -> Any:
    open_page(browser, pages[True].as_uri())
    return browser


def test_both_notes_are_heard_equally_loud_and_both_spectra_are_seen(page: Any) -> None:
    assert not page.find_element("id", "recorded").is_displayed()
    page.find_element("id", "real").click()
    blue, amber = wait(lambda: (found := page.execute_script(DRAWN)) and min(found) and found)
    assert blue > 300 and amber > 300 and page.find_element("id", "recorded").is_displayed()
    assert "public domain (CC0)" in page.find_element("id", "recorded-text").text
    rms = """
    return hearing.sources.map(({buffer}) => {
      const sound = buffer.getChannelData(0).subarray(0, 32768);
      return Math.sqrt(sound.reduce((sum, x) => sum + x * x, 0) / sound.length);
    });
    """
    heard = wait(lambda: page.execute_script(rms))
    assert np.allclose(heard, 0.07, rtol=0.01) and len(heard) == 2


def test_a_press_shows_at_once_that_it_computes_and_plays(page: Any) -> None:
    """However long the worker takes: here until the test lets it go."""
    open_page(page, page.current_url)
    page.execute_script(
        "const {ask} = workshop, held = new Promise(done => { window.go = done; });"
        "workshop.ask = async (...all) => { await held; return ask.apply(workshop, all); }"
    )

    def shows(name: str) -> list[Any]:
        """Whether a button is pressed, whether it is busy, its text then, and the number of sounds."""
        return list(
            page.execute_script(
                "const e = $(arguments[0]), {content} = getComputedStyle(e, '::after');"
                "return [e.ariaPressed, e.ariaBusy, content, hearing.sources.length]",
                name,
            )
        )

    page.find_element("id", "real").click()
    assert shows("real") == ["true", "true", '"computing …"', 0]
    page.find_element("id", "hear-computed").click()
    assert shows("hear-computed")[:2] == ["true", "true"] and shows("real")[0] == "false"
    page.execute_script("go()")
    wait(lambda: shows("hear-computed") == ["true", None, "none", 1])
    wait(lambda: shows("hear-computed") == ["false", None, "none", 1])  # it was heard
    page.find_element("id", "hear-recorded").click()
    page.execute_async_script(  # a second press, while it sounds
        "const [done] = arguments, press = () => {"
        "  if (!hearing.sources.length) return setTimeout(press, 5); $('hear-recorded').click(); done(); }; press()"
    )
    assert shows("hear-recorded") == ["false", None, "none", 0]
