"""Phones: neck, sentence, one slider and both traces on one screen, and the same pluck when the slider is let go."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import pytest
from support.browser import COPIED, errors, open_page, resize, wait

SIZES = [(360, 800), (390, 844), (844, 390), (667, 375), (640, 320)]
PARTS = "return ['neck', 'seen', 'side', 'one-bar', 'bench-action'].map(id => $(id).getBoundingClientRect().toJSON())"
SLID = (
    "const [symbol, value] = arguments, slider = $(`bench-${symbol}`); slider.value = value;"
    "for (const kind of ['input', 'change']) slider.dispatchEvent(new Event(kind, {bubbles: true}))"
)


@pytest.fixture(params=SIZES, ids=str)
def page(browser: Any, whole: str, request: pytest.FixtureRequest) -> Iterator[Any]:
    """The fresh page on a phone; any error in it fails the test."""
    open_page(browser, whole)
    with resize(browser, *request.param):
        wait(lambda: browser.execute_script("return see.replay !== undefined && !$('one-bar').hidden"))
        yield browser
    assert not errors(browser)


def test_cause_and_effect_are_on_one_screen_and_the_same_pluck_plays_by_itself(page: Any) -> None:
    wide, tall = page.execute_script("return [innerWidth, innerHeight]")
    page.find_element("css selector", "h1").click()
    page.execute_script("press('test', 31, 120, performance.now())")
    wait(lambda: page.execute_script("return kept.note !== undefined && see.note.wasReported"))
    page.execute_script("release('test')")
    before = page.execute_script(PARTS)
    page.execute_script(SLID, "action", -1.1)
    wait(lambda: "The same pluck" in page.find_element("id", "seen").text)
    assert page.execute_script("return see.other !== undefined && hearing.sources.length") == 2
    parts = page.execute_script(PARTS)
    for part in parts:
        assert part["top"] >= 0 and part["bottom"] <= tall and part["right"] <= wide, parts
    neck, seen, side, bar, slider = parts
    assert neck["bottom"] <= seen["top"] + 1 and seen["bottom"] <= side["top"] + 1 and side["bottom"] <= bar["top"]
    assert slider["height"] >= 40 and slider["width"] > 90
    assert [p["top"] for p in before] == pytest.approx([p["top"] for p in parts], abs=1)
    assert page.execute_script("return scrollY") == 0


def test_share_is_in_sight_and_under_the_finger(browser: Any, whole: str) -> None:
    open_page(browser, whole)
    browser.execute_script(COPIED)
    at = "const {x, y, width, height} = $('send').getBoundingClientRect(); "
    at += "return document.elementFromPoint(x + width / 2, y + height / 2)?.id"
    for size in (*SIZES, (640, 400)):
        with resize(browser, *size):
            wait(lambda: not browser.execute_script("return $('one-bar').hidden"))
            assert browser.execute_script(at) == "send", size
            covered = "const [a, b] = ['send', 'bench-action'].map(id => $(id).getBoundingClientRect());"
            covered += "return a.left < b.right && b.left < a.right && a.top < b.bottom && b.top < a.bottom"
            assert not browser.execute_script(covered), size
            browser.find_element("id", "send").click()
            wait(lambda: browser.execute_script("return (window.copied || '').includes('like=jazz-finger')"))
            browser.execute_script("window.copied = ''; $('said').textContent = ''")
    assert browser.execute_script("return getComputedStyle($('send')).display") == "none"


def test_a_riff_of_a_link_adds_no_row_and_a_story_leaves_the_side_view_in_sight(page: Any) -> None:
    tops = "return ['neck', 'seen', 'side', 'one-bar'].map(id => Math.round($(id).getBoundingClientRect().top))"
    before = page.execute_script(tops)
    page.execute_script("$('riff').hidden = $('same').hidden = false")
    assert page.execute_script(tops) == before
    page.execute_script("$('riff').hidden = $('same').hidden = true; document.body.classList.add('in-story')")
    page.execute_script("$('story').hidden = false; $('story-at').textContent = '1 / 6'")
    neck, _, side, bar = page.execute_script(tops)
    assert [neck, bar] == [before[0], before[3]] and bar - side >= 64
    assert page.execute_script("return document.documentElement.scrollWidth <= innerWidth")


def test_the_steps_of_a_story_move_nothing_and_leave_the_side_view_in_sight(page: Any) -> None:
    tall = page.execute_script("return innerHeight")
    tops = []
    for at in range(page.execute_script("return PAGE.stories[0].steps.length")):
        page.execute_async_script("showStep(PAGE.stories[0], arguments[0]).then(arguments[1])", at)
        box, bar = page.execute_script("return ['side', 'one-bar'].map(id => $(id).getBoundingClientRect().toJSON())")
        assert box["bottom"] <= bar["top"] < tall
        tops.append(box["top"])
    assert len(tops) > 3 and max(tops) - min(tops) < 1


def test_the_name_of_a_bass_is_whole(page: Any) -> None:
    """The list shows as much of a name as its longest common ones need; browsers keep some px for its arrow."""
    room = (
        "const list = $('bass'), style = getComputedStyle(list), {paddingLeft, paddingRight} = style;"
        "const sheet = document.createElement('canvas').getContext('2d');"
        "sheet.font = `${style.fontSize} ${style.fontFamily}`;"
        "return list.clientWidth - parseFloat(paddingLeft) - parseFloat(paddingRight)"
        " - sheet.measureText('Jazz bass, fingers').width"
    )
    assert page.execute_script(room) > 18


def test_the_slider_in_sight_is_chosen_or_the_one_moved_last(page: Any) -> None:
    where = "return [...$('one-row').querySelectorAll('input')].map(e => e.dataset.symbol)"
    assert page.execute_script(where) == ["action"]
    page.execute_script("$('one').value = 'gauge'; $('one').onchange()")
    assert page.execute_script(where) == ["gauge"]
    page.execute_script("$('bench-fold').open = true")
    wait(lambda: page.execute_script("return $('one-bar').hidden"))
    rows = "return [...$('bench-controls').querySelectorAll('input')].map(e => e.dataset.symbol)"
    symbols = page.execute_script(rows)
    page.execute_script("showBench()")
    assert symbols == page.execute_script(rows) and "gauge" in symbols  # it is back in its place
    page.execute_script(SLID, "nut_height", 0.2)
    page.execute_script("$('bench-fold').open = false")
    wait(lambda: page.execute_script(where) == ["nut_height"])
    assert page.find_element("css selector", "#one-row output").text.endswith("mm")
    page.execute_script("chooseBass('fretless')")
    wait(lambda: len(page.execute_script(where)) == 1)
