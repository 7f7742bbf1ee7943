"""The paper's cases on the page: from a link, slow and silent; from a button, with sound."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from support.browser import INSIDE, chromium, errors, wait

from livebass import load_preset
from livebass.engine.solve import solve_trial
from livebass.lab.paper.cases import CASES, PLAYED, PRESET
from livebass.lab.paper.figures.studies import PLAYER, run_studies
from livebass.lab.paper.figures.study import Findings, Study
from livebass.web.bench import Source
from livebass.web.export import export_page

TIMES = (1e-3, 3.8e-3, 5e-3)  # s after the release
MADE = """
const {rows, slots, hits, first, frame} = see.replay;
return {rows: [...rows], slots: [...slots], hits, first, frame};
"""
SOUNDS = "return player.sounding && hearing.sources[0]?.buffer.length > player.context.sampleRate"


@pytest.fixture(scope="module")
def page(browser: Any, whole: str) -> Iterator[Any]:
    browser.get(f"{whole}#case=b")
    browser.execute_script(INSIDE)
    yield browser
    assert not errors(browser)


def replay(page: Any, says: str) -> dict[str, Any]:
    """The page's slow replay, once it shows the case `says`."""
    wait(lambda: says in page.find_element("id", "seen").text)
    made: dict[str, Any] = page.execute_script(MADE)
    return made


@pytest.mark.slow
def test_a_link_shows_case_b_as_it_is_simulated(page: Any) -> None:
    made = replay(page, "Case B: 3.6 mm")
    assert page.execute_script("return [$('bass').value, player.sounding]") == [PRESET, False]
    rate = int(page.execute_script("return player.context.sampleRate"))
    trial = CASES["b"].trial(rate)
    samples = np.rint(np.array(TIMES) * rate).astype(int)
    trial = replace(trial, duration=5.5e-3, states=tuple(samples.tolist()))
    states = solve_trial(trial).states
    assert states is not None
    rows = np.array(made["rows"]).reshape(len(made["slots"]) // 4, -1)
    x = np.linspace(0, trial.speaking.length, 401)
    for sample, state in zip(samples, states, strict=True):
        k = made["frame"] - made["first"] + sample - 1  # the view after a frame is its row
        assert made["slots"][4 * k] == pytest.approx(trial.speaking.length)
        drawn, wanted = (
            np.sqrt(2 / trial.speaking.length)
            * np.sin(np.outer(x, np.arange(1, len(q) + 1)) * np.pi / trial.speaking.length)
            @ q
            for q in (rows[k], state[0, 0])
        )
        assert abs(drawn - wanted).max() < 20e-6 < 1e-3 < abs(wanted).max()


def test_buttons_play_and_show_the_cases(page: Any) -> None:
    """A touches no fret, C more than B; each is heard, and leaves the bench and the keys unchanged."""
    counts = {}
    for name in PLAYED:
        page.find_element("id", f"case-{name}").click()
        counts[name] = len(replay(page, CASES[name].title)["hits"])
        wait(lambda: page.execute_script(SOUNDS))
        peak = page.execute_script(
            "return hearing.sources[0].buffer.getChannelData(0).reduce((a, b) => Math.max(a, Math.abs(b)), 0)"
        )
        assert 1e-3 < peak < 4
    assert counts["a"] == 0 < 20 < counts["b"] < counts["c"]
    page.find_element("id", "now").click()
    assert page.execute_script("return see.replay === undefined")


def test_a_case_that_there_is_not_is_told(page: Any) -> None:
    page.execute_script("location.hash = '#case=z'")
    wait(lambda: "no case of this page: case=z" in page.find_element("id", "said").text)


def test_a_study_opened_from_disk_shows_and_plays_its_case(tmp_path: Path) -> None:
    bass = load_preset(PRESET)
    export_page({PRESET: bass}, (tmp_path / PLAYER).parent, True, sources={PRESET: Source(PRESET)}, element=True)
    run_studies([Study("b", "B", "4.1", "a table", lambda duration: {}, lambda motions: Findings())], tmp_path)
    with chromium(tmp_path / "profile", loggingPrefs={"browser": "ALL"}) as driver:
        driver.get((tmp_path / "index.html").as_uri())
        frame = wait(lambda: driver.find_elements("css selector", "live-bass iframe"))[0]
        driver.execute_script("arguments[0].scrollIntoView()", frame)
        driver.switch_to.frame(frame)
        wait(lambda: driver.find_elements("css selector", "body.embed"))
        driver.execute_script(INSIDE)
        assert len(replay(driver, "Case B: 3.6 mm")["hits"]) > 20
        assert driver.find_element("id", "side").is_displayed()
        driver.find_element("css selector", 'button[data-string="0"][data-fret="3"]').click()
        wait(lambda: "fret 3: " in driver.find_element("id", "seen").text)
        assert driver.execute_script("return player.sounding")
        assert driver.get_log("browser") == []
