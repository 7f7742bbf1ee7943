"""The page's stories: what each step says is what its note does."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
from support.browser import errors, open_page, wait

SHOWN = (
    "return [$('story-at').textContent, $('seen').textContent, see.replay?.hits.map(h => h.fret) ?? [], location.hash]"
)


@pytest.fixture(scope="module")
def page(browser: Any) -> Iterator[Any]:
    yield browser
    assert not errors(browser)


def step(page: Any, count: int) -> tuple[str, list[int]]:
    """The sentence and the frets hit of the step that the page now shows, the `count`-th."""
    wait(lambda: page.execute_script(SHOWN)[0].startswith(f"{count} /") and "…" not in page.execute_script(SHOWN)[1])
    _, said, frets, link = page.execute_script(SHOWN)
    assert "{" not in said and link.endswith(f"&step={count}")
    return said, frets


def test_the_first_story_shows_what_it_says(page: Any, whole: str) -> None:
    open_page(page, whole)
    assert not page.find_element("id", "story").is_displayed()
    wait(lambda: page.execute_script("return state.repeats"))  # the page's first note, until somebody asks for more
    page.find_element("id", "story-buzz").click()
    soft, none = step(page, 1)
    assert not page.execute_script("return state.repeats")
    assert none == [] and soft.endswith("over its frets: it touches nothing.")
    counts = []
    for at in range(2, 6):
        page.find_element("id", "story-next").click()
        said, frets = step(page, at)
        counts.append(len(frets))
        assert f"{len(frets)} contacts" in said
        if at == 4:
            assert frets.count(7) > len(frets) / 2 > 0
        wait(lambda: page.execute_script("return hearing.sources.length") == 1)
    hard, low, high, slap = counts
    assert 5 < hard < 2.5 * hard < low and high >= 3 and slap > 30
    page.find_element("id", "story-back").click()
    assert step(page, 4)[1].count(7) > 2
    for at in (5, 6):
        page.find_element("id", "story-next").click()
        step(page, at)
    assert page.execute_script("return [see.replay === undefined, $('bass').value, bench().values]") == [
        True, "jazz-finger", {},
    ]  # fmt: skip
    page.find_element("id", "story-next").click()
    wait(lambda: not page.find_element("id", "story").is_displayed())
    assert page.execute_script("return location.hash") == ""


def test_a_link_opens_a_step_in_silence(page: Any, whole: str) -> None:
    open_page(page, f"{whole}#story=buzz&step=3")
    said, frets = step(page, 3)
    assert len(frets) > 40 and "fret buzz" in said
    assert page.execute_script("return [player.sounding, bench().values.action]") == [False, -1.4]
    page.execute_script("location.hash = '#story=paper&step=3'")
    wait(lambda: page.execute_script("return $('bass').value") == "fretless")
    page.execute_script("location.hash = '#story=paper&step=9'")
    wait(lambda: "no step of a story on this page: paper, 9" in page.find_element("id", "said").text)


def test_a_dead_spot_dies_first(page: Any, whole: str) -> None:
    """The second story's claim: the fundamental of fret 6 fades more than twice as fast as that of fret 5."""
    open_page(page, f"{whole}#story=paper&step=2")
    step(page, 2)
    sounds, rate = page.execute_async_script(
        "const [done] = arguments, {notes} = PAGE.stories[1].steps[1], {strings} = bassCalled('jazz-finger');"
        "player.fileOf('jazz-finger').then(file => Promise.all(notes.map(([string, fret, velocity]) =>"
        " move({performed: {string, note: strings[string].note + fret, velocity}}, file))))"
        ".then(made => done([made.map(({sound}) => [...sound]), player.context.sampleRate]))"
    )

    def fundamental(sound: list[float], note: int, at: float) -> float:
        """The level of a note's fundamental from `at` s on, dB."""
        part = np.array(sound)[round(at * rate) :][: round(0.15 * rate)]
        turns = np.exp(-2j * np.pi * 440 * 2 ** ((note - 69) / 12) * np.arange(part.size) / rate)
        return float(20 * np.log10(abs(np.sum(part * np.hanning(part.size) * turns))))

    dead, default = (
        fundamental(sound, note, 0.1) - fundamental(sound, note, 0.9)
        for sound, note in zip(sounds, (49, 48), strict=True)
    )
    assert dead > 2.2 * default > 4, (dead, default)


def test_a_note_of_ones_own_in_a_story_stays_and_can_be_compared(page: Any, whole: str) -> None:
    """What a step computes does not replace it; the step's own pluck needs no comparison."""
    open_page(page, whole)
    page.find_element("id", "story-buzz").click()
    step(page, 1)
    wait(lambda: page.execute_script("return player.playing"))
    page.execute_script("$('story-next').click()")
    wait(lambda: page.execute_script("return $('story-at').textContent") == "2 / 6")
    page.execute_script("press('test', 31, 120, performance.now())")
    wait(lambda: page.execute_script("return $('seen').textContent").startswith("E string, fret 3: "))
    page.execute_script("release('test', performance.now())")
    wait(lambda: page.execute_script("return kept.note !== undefined && !building.now && !building.wanted"))
    assert page.execute_script("return [see.replay === undefined, $('story-at').textContent]") == [True, "2 / 6"]
    page.execute_script("onBench(() => bench().setAll({action: -1}))")
    wait(lambda: page.find_element("id", "same").is_displayed())
    page.find_element("id", "story-next").click()
    step(page, 3)
    assert not page.find_element("id", "same").is_displayed()
