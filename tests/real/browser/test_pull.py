"""The string pulled by hand in the side view: it is where the hand is, and sounds as simulated."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
from support.browser import COPIED, errors, open_page, resize, wait

from livebass import QUALITIES, load_preset
from livebass.model.trial import PluckRequest, checked_trial, in_quality, initial_amplitudes, speaking_string

BASS, STRING, FRET = "jazz-finger", 0, 3
PLACE, HEIGHT = 0.52, 2.6e-3  # m from the stop, m over the open string's rest line
# The side view's px of a place (m from the nut) and a height (m), in the window
POINT = (
    "const {left, top} = $('side').getBoundingClientRect(), {x, y} = pictures.sidePoint(...arguments);"
    "return {x: left + x, y: top + y}"
)
SHOW = "see.leave(); see.begin({string: arguments[0], fret: arguments[1], contacts: []})"
PULLED = "const {pulled} = kept.note; return [pulled.place, pulled.apex, pulled.angle]"


@pytest.fixture
def page(browser: Any, whole: str) -> Iterator[Any]:
    """The fresh page, whose side view shows a string at rest; any error in it fails the test."""
    open_page(browser, whole)
    with resize(browser, 1280, 800):
        wait(lambda: browser.execute_script("return see.replay !== undefined"))
        browser.execute_script(f"backToNow(); {SHOW}", STRING, FRET)
        browser.find_element("css selector", "h1").click()
        yield browser
    assert not errors(browser)


def touch(page: Any, kind: str, point: dict[str, float], *, by: str = "mouse") -> None:
    """Moves a pointer of the browser itself."""
    if by == "touch":
        kinds = {"mousePressed": "touchStart", "mouseMoved": "touchMove", "mouseReleased": "touchEnd"}
        points = [] if kind == "mouseReleased" else [point]
        page.execute_cdp_cmd("Input.dispatchTouchEvent", {"type": kinds[kind], "touchPoints": points})
        return
    how = {"type": kind, "button": "left", "buttons": 0 if kind == "mouseReleased" else 1, "clickCount": 1}
    page.execute_cdp_cmd("Input.dispatchMouseEvent", how | point)


def pull(page: Any, place: float, height: float, by: str = "mouse") -> dict[str, float]:
    """Presses on the string and pulls it; returns the hand's point once the string follows it."""
    page.execute_script("$('side').scrollIntoView({block: 'center'})")
    stop = page.execute_script(
        "return bassCalled($('bass').value).strings[arguments[0]].frets[arguments[1] - 1]", STRING, FRET
    )
    touch(page, "mousePressed", page.execute_script(POINT, stop + place, 0), by=by)
    begin = page.execute_script(POINT, stop + place, 0)
    touch(page, "mouseMoved", {"x": begin["x"], "y": begin["y"] - 8}, by=by)
    wait(lambda: page.execute_script("return see.held !== undefined"))
    hand: dict[str, float] = page.execute_script(POINT, stop + place, height)  # in the picture's new scale
    touch(page, "mouseMoved", hand, by=by)
    arrived = "return Math.abs(hand.at.y + $('side').getBoundingClientRect().top - arguments[0]) < 0.6"
    wait(lambda: page.execute_script(arrived, hand["y"]))  # browsers round a touch
    return hand


def let_go(page: Any, hand: dict[str, float], by: str = "mouse") -> None:
    touch(page, "mouseReleased", hand, by=by)
    wait(lambda: page.execute_script("return see.replay !== undefined && kept.note?.pulled !== undefined"))


@pytest.mark.parametrize("by", ["mouse", "touch"])
def test_the_string_at_release_is_where_the_hand_is(page: Any, by: str) -> None:
    hand = pull(page, PLACE, HEIGHT, by)
    held = page.execute_script("return {...see.held, u: 0, v: 0}")
    at = page.execute_script(POINT, held["place"] + bass_stop(), held["height"])
    assert math.dist((at["x"], at["y"]), (hand["x"], hand["y"])) < 1
    wanted = page.execute_script(
        "const [x, y] = arguments, {left, top} = $('side').getBoundingClientRect();"
        "return pictures.sideAt(x - left, y - top)",
        hand["x"], hand["y"],
    )  # fmt: skip
    assert abs(held["height"] - wanted["height"]) < 20e-6
    let_go(page, hand, by)
    place, apex, angle = page.execute_script(PULLED)
    bass = load_preset(BASS)
    s = speaking_string(bass, bass.strings[STRING].name, FRET)
    requested = PluckRequest(apex=apex, at=place, angle=angle, duration=0.01)
    trial = checked_trial(bass, s, requested, *in_quality(s, QUALITIES["live"]), 48000)
    q = initial_amplitudes(trial)
    k = np.arange(1, len(q) + 1) * np.pi / trial.speaking.length
    crown = bass.necks[STRING].fret_heights[FRET - 1]
    height = math.sqrt(2 / trial.speaking.length) * np.sin(k * place) @ q + crown * (1 - place / trial.speaking.length)
    assert abs(height - wanted["height"]) < 20e-6 < 1e-3 < height
    said = page.find_element("id", "seen").text
    assert said.startswith(f"E string: pulled {1e3 * apex:.2f} mm, {1e3 * place:.0f} mm from fret 3: "), said
    drawn = page.execute_script("see.goTo(0, 1); pictures.draw(); return pictures.sidePoint(0, 0).y")
    before = page.execute_script("const {top} = $('side').getBoundingClientRect(); return top + arguments[0]", drawn)
    assert before == pytest.approx(page.execute_script(POINT, 0, 0)["y"], abs=0.5)  # the picture keeps its scale


def bass_stop() -> float:
    return float(load_preset(BASS).necks[STRING].fret_positions[FRET - 1])


def test_a_pull_is_heard_as_the_worker_made_it(page: Any) -> None:
    """tests/unit/web/test_pull.py compares that with `simulate`."""
    page.execute_script("$('pull-angle').value = 40")
    let_go(page, pull(page, PLACE, HEIGHT))
    assert math.degrees(page.execute_script(PULLED)[2]) == pytest.approx(40)
    wait(lambda: page.execute_script("return hearing.sources.length === 1 && player.sounding"))
    same = "const {sound} = see.replay, heard = hearing.sources[0].buffer.getChannelData(0);"
    same += "const fades = heard.length - 0.15 * player.context.sampleRate;"
    same += "return heard.length === sound.length && heard.every((x, k) => k >= fades || x === sound[k])"
    same += " && Math.max(...sound.slice(0, 9999))"
    assert 0.01 < page.execute_script(same) <= 1
    end = "const {buffer} = hearing.sources[0]; return [buffer.duration, buffer.getChannelData(0).at(-1)]"
    assert page.execute_script(end) == [pytest.approx(4.0), 0], "it rings, and does not break off"


def test_a_pull_stops_where_the_player_or_a_fret_stops_it_and_says_so(page: Any) -> None:
    pull(page, 0.68, 0.012)
    wait(lambda: "pulls no harder" in page.find_element("id", "seen").text)
    highest = page.execute_script("return hand.grip.apex")
    force = "const {hardest, length} = hand.taken.held, give = x => x * (length - x);"
    force += "return hardest.apex * give(arguments[0]) / give(hardest.place)"
    place = page.execute_script("return hand.grip.place")
    assert highest == pytest.approx(page.execute_script(force, place), abs=2e-6) and 0 < highest < 0.03
    deep = page.execute_script(POINT, bass_stop() + 0.68, -0.01)
    touch(page, "mouseMoved", deep)
    wait(lambda: "no farther down" in page.find_element("id", "seen").text)
    lowest = page.execute_script("return hand.grip.apex")
    clear = "const {u, length} = see.held, {frets, heights, length: whole} = bassCalled('jazz-finger').strings[0];"
    clear += "const at = x => u[Math.round(160 * (x - whole + length) / length)];"
    clear += "return Math.min(...frets.slice(3).map((x, k) => at(x) - heights[k + 3]))"
    assert lowest < 0 < page.execute_script(clear)
    touch(page, "mouseReleased", deep)
    wait(lambda: "towards the frets" in page.find_element("id", "seen").text)


def test_keys_pull_the_string_by_numbers(page: Any) -> None:
    page.execute_script("$('pull-apex').focus()")
    page.switch_to.active_element.send_keys("\ue014")  # to the right
    wait(lambda: page.execute_script("return see.held !== undefined"))
    assert page.find_element("id", "pull-apex-text").text == "2.05 mm"
    page.find_element("id", "pull").send_keys("\ue007")
    wait(lambda: page.execute_script("return see.replay !== undefined"))
    assert page.execute_script(PULLED) == pytest.approx([0.6, 2.05e-3, 0])
    page.execute_script("press('test', 33, 100, performance.now())")
    wait(lambda: page.execute_script("return see.replay === undefined && see.held === undefined"))


def test_the_same_pull_on_a_changed_bass_and_from_its_link(browser: Any, page: Any, whole: str) -> None:
    page.execute_script(COPIED)
    let_go(page, pull(page, PLACE, HEIGHT))
    hits, sound = page.execute_script("return [see.replay.contacts, [...see.replay.sound.slice(0, 2000)]]")
    page.find_element("id", "link").click()
    wait(lambda: page.execute_script("return window.copied"))
    link = page.execute_script("return copied")
    page.execute_script("backToNow(); onBench(() => bench().setAll({action: -1}))")
    wait(lambda: page.execute_script("return !building.now && !player.next"))
    page.find_element("id", "same").click()
    wait(lambda: "The same pluck" in page.find_element("id", "seen").text)
    assert page.execute_script("return see.other.contacts") == hits
    open_page(browser, f"{whole}#{link.partition('#')[2] or link}")
    wait(lambda: "pulled" in browser.find_element("id", "seen").text)
    assert browser.execute_script("return [see.replay.contacts, [...see.replay.sound.slice(0, 2000)]]") == [hits, sound]


def test_a_thumb_pulls_on_a_phone(page: Any) -> None:
    with resize(page, 390, 844):
        page.execute_script(SHOW, STRING, FRET)
        hand = pull(page, 0.3, 1.5e-3, "touch")
        let_go(page, hand, "touch")
        assert page.execute_script(PULLED)[0] == pytest.approx(0.3, abs=2e-3)
