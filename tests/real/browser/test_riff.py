"""A shared link holds the last notes that somebody played; whoever opens it can hear them."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
from support.browser import COPIED, MADE_HERE, errors, open_page, start_sound, wait

from livebass import load_preset
from livebass.web.bench import Source
from livebass.web.link import check_link

DRAWN = """const done = arguments[0];
see.needed = true;
requestAnimationFrame(() => requestAnimationFrame(() => done([see.moment, [...see.shapes.u].map(x => 1e3 * x)])));"""
PLAYED = [(0, 28, 90, 300), (400, 33, 60, 200), (700, 35, 127, 500)]  # ms, key, velocity, ms


@pytest.fixture(scope="module", autouse=True)
def no_errors(browser: Any) -> Iterator[None]:
    yield
    assert not errors(browser)


def open_sounding(browser: Any, address: str) -> None:
    open_page(browser, address)
    browser.execute_script(COPIED)
    start_sound(browser)


def test_a_link_holds_the_last_notes_and_plays_them(browser: Any, whole: str) -> None:
    open_sounding(browser, whole)
    browser.execute_script(
        "pluckWith(STROKES.find(({symbol}) => symbol === 'pick')); const now = performance.now();"
        "for (const [begin, key, velocity, length] of arguments[0]) {"
        "  player.send(now + begin, [0x90, key, velocity]); player.send(now + begin + length, [0x80, key, 0]);"
        "} onBench(() => bench().setAll({action: -0.5})); $('link').click()",
        PLAYED,
    )
    link = wait(lambda: browser.execute_script("return window.copied"))
    riff = "_".join(".".join(map(str, note)) for note in PLAYED)
    made = browser.execute_script(MADE_HERE)
    assert link == f"like=jazz-finger&action=-0.5&riff={riff}&stroke=pick&{made}"
    check_link(link, {"jazz-finger": load_preset("jazz-finger")}, {"jazz-finger": Source("jazz-finger")})
    open_page(browser, f"{whole}#{link}")
    assert browser.execute_script("return [bench().values.action, state.stroke.symbol]") == [-0.5, "pick"]
    browser.execute_script("window.heard = []; player.on('sight', ({notes}) => heard.push(...notes))")
    browser.find_element("id", "riff").click()
    wait(lambda: browser.execute_script("return heard.length") == 9)
    frames = np.array(browser.execute_script("return heard")).reshape(-1, 3)[:, 2]
    rate = browser.execute_script("return player.context.sampleRate")
    assert np.allclose((frames - frames[0]) / rate, [0, 0.4, 0.7], atol=1e-3)


def test_a_link_shows_the_moment_of_the_last_note(browser: Any, whole: str) -> None:
    open_sounding(browser, whole)
    browser.execute_script("press('test', 31, 127, performance.now())")
    wait(lambda: browser.execute_script("return kept.note"))
    browser.execute_script("release('test'); $('again').click()")
    wait(lambda: browser.execute_script("return kept.replay && see.replay === kept.replay"))
    browser.execute_script("state.rolling = false; goTo(700); $('link').click()")
    moment, before = browser.execute_async_script(DRAWN)
    link = wait(lambda: browser.execute_script("return window.copied"))
    assert f"&moment=0.31.127.{1000 * moment:.0f}" in link
    check_link(link, {"jazz-finger": load_preset("jazz-finger")}, {"jazz-finger": Source("jazz-finger")})
    assert "rang" not in link
    open_page(browser, f"{whole}#{link}")
    wait(lambda: browser.execute_script("return see.replay && !state.rolling"))
    hits = browser.execute_script("return see.replay.hits.length")
    assert browser.find_element("id", "seen").text == f"A friend's note, in its first 0.1 s: {hits} contacts."
    shown, after = browser.execute_async_script(DRAWN)
    assert shown == pytest.approx(moment, abs=0.03)  # ms: a frame
    assert np.abs(np.subtract(before, after)).max() < 0.02 < np.abs(before).max()  # mm
    open_page(browser, f"{whole}#like=jazz-finger&moment=9.31.127.5")
    wait(lambda: "the link's moment is not shown" in browser.find_element("id", "said").text.lower())


def test_a_moment_of_a_string_that_still_rang_says_that_it_plays_alone(browser: Any, whole: str) -> None:
    open_sounding(browser, whole)
    for note in (28, 31):
        browser.execute_script("kept.note = undefined; press('test', arguments[0], 127, performance.now())", note)
        wait(lambda: browser.execute_script("return kept.note"))
        browser.execute_script("release('test')")
    browser.execute_script("$('again').click()")
    wait(lambda: browser.execute_script("return kept.replay && see.replay === kept.replay"))
    browser.execute_script("$('link').click()")
    link = wait(lambda: browser.execute_script("return window.copied"))
    assert "&rang=1" in link
    assert "the string still rang" in browser.find_element("id", "said").text
    check_link(link, {"jazz-finger": load_preset("jazz-finger")}, {"jazz-finger": Source("jazz-finger")})
    open_page(browser, f"{whole}#{link}")
    wait(lambda: "A friend's note" in browser.find_element("id", "seen").text)
    assert "It plays alone, from rest" in browser.find_element("id", "seen").text
