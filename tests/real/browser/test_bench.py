"""The page's bench: its changes match a preset with the same keys, byte for byte, and are kept."""

from __future__ import annotations

import base64
import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from support.browser import INSIDE, chromium, firefox, open_page, resize, start_sound, wait
from support.command import Run

from livebass import load_preset
from livebass.plugin.instrument import image_file
from livebass.web.bench import Source
from livebass.web.export import export_page
from livebass.web.link import check_link

# The page's saved preset, and the instrument file it builds, for a bass with these values
MADE = """
const [name, values, done] = arguments;
(async () => {
  const own = benches.get(name);
  own.setAll(values);
  done({toml: own.toml(), file: inBase64(new Uint8Array(await player.fileOf(name)))});
})();
"""
BASSES = ("jazz-finger", "slap", "fretless", "paper-bass", "five-string-active")
ON_PAGE = {name: load_preset(name) for name in BASSES}, {name: Source(name) for name in BASSES}


@pytest.fixture(scope="module")
def page(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Any]:
    folder = tmp_path_factory.mktemp("bench")
    file = export_page({name: load_preset(name) for name in BASSES}, folder / "page", single=True)
    with chromium(folder / "profile", loggingPrefs={"browser": "ALL"}) as driver:
        driver.home = file.as_uri()
        open_page(driver, driver.home)
        yield driver


@pytest.mark.slow
def test_firefox_makes_the_file_of_the_saved_preset(page: Any, tmp_path: Path) -> None:
    values = {"action": -0.9, "fret": 7, "fret_height": 0.12, "gauge": 10, "wear": 200, "pickup_2_place": 9.04}
    values |= {"pickup_1_height": -1, "neck_resonance": 7.14}
    function, arguments = "(function () {" + MADE + "})", json.dumps(["jazz-finger", values], sort_keys=True)
    with firefox(tmp_path / "profile") as driver:
        driver.get(page.home)
        ready = INSIDE + "(async () => { while (!player.ready) await new Promise(done => setTimeout(done, 20)); })()"
        driver.run(f"{ready}.then(() => 'ready')")
        found = json.loads(
            driver.run(f"new Promise(done => {function}(...{arguments}, made => done(JSON.stringify(made))))")
        )
    (tmp_path / "saved.toml").write_text(found["toml"])
    assert base64.b64decode(found["file"]) == image_file(load_preset(tmp_path / "saved.toml"))


def set_slider(page: Any, symbol: str, *values: float) -> None:
    """Moves a slider to each of `values`, then releases it."""
    move = "const slider = $(`bench-${arguments[0]}`);"
    move += "for (const value of arguments[1]) { slider.value = value; slider.dispatchEvent(new Event('input')); }"
    page.execute_script(f"{move} slider.dispatchEvent(new Event('change'))", symbol, values)


def state(page: Any) -> Any:
    """The slot of the bench, its values, the counts of undo and redo steps, and its message."""
    return page.execute_script(
        "const b = bench(); return [b.slot, b.values, b.before.length, b.after.length, $('said').textContent]"
    )


@pytest.fixture
def opened(page: Any) -> Iterator[Any]:
    """A fresh page; any error in it fails the test."""
    page.get("about:blank")
    page.get_log("browser")
    open_page(page, page.home)
    yield page
    assert not [line for line in page.get_log("browser") if line["level"] in ("SEVERE", "WARNING")]


def test_a_link_brings_the_bench_back(opened: Any) -> None:
    opened.execute_script("chooseBass('fretless'); onBench(() => bench().setAll({action: 0.5, gauge: 10}))")
    link, toml = opened.execute_script("return [location.hash, bench().toml()]")
    assert link == "#like=fretless&action=0.5&gauge=10"
    open_page(opened, opened.home + link)
    assert opened.execute_script("return [$('bass').value, bench().toml(), location.hash]") == ["fretless", toml, link]
    assert state(opened)[4] == "The bass is as the link says."
    opened.execute_script("location.hash = '#like=slap&action=-0.5'")  # as if pasted
    wait(lambda: opened.execute_script("return $('bass').value === 'slap' && bench().values.action === -0.5"))


def test_a_bad_link_is_told_in_a_line_and_the_preset_plays(opened: Any) -> None:
    open_page(opened, f"{opened.home}#like=slap&action=%3Cb%3E")
    slot, values, *_, said = state(opened)
    assert (slot, values) == ("A", {})
    assert said == "the link says action = <b>: it must be from -2 to 3 mm. The bass is unchanged."
    assert opened.execute_script("return $('bass').value") == "jazz-finger"
    start_sound(opened)


def test_links_and_presets_hold_the_playing_as_plugins_do(opened: Any, tmp_path: Path) -> None:
    played = {"blend": 0.5, "velocity_curve": -0.25, "hand_position": 7, "avoid_open": 1, "humanise_time": 12}
    link = "like=jazz-finger&" + "&".join(f"{symbol}={value}" for symbol, value in played.items())
    check_link(link, *ON_PAGE)
    open_page(opened, f"{opened.home}#{link}")
    assert opened.execute_script("return movedControls()") == played
    texts = opened.execute_script("return arguments[0].map(symbol => $(`${symbol}-text`).textContent)", list(played))
    assert texts == ["to the bridge", "softer touch", "fret 7", "yes", "up to 12 ms late"]
    file = tmp_path / "mine.toml"
    file.write_text(opened.execute_script("return bench().toml(movedControls())"))
    assert dict(load_preset(str(file)).played) == played
    open_page(opened, opened.home)
    assert opened.execute_script("return movedControls()") == {}
    opened.find_element("id", "preset-file").send_keys(str(file))
    wait(lambda: opened.execute_script("return movedControls()") == played)
    assert opened.find_element("id", "blend").is_displayed()
    opened.execute_script("chooseBass('paper-bass')")  # it has no pickup
    assert opened.find_element("id", "tone").is_displayed() and not opened.find_element("id", "blend").is_displayed()


def test_a_link_from_another_version_of_its_bass_says_so(opened: Any) -> None:
    made = opened.execute_script("return bassCalled('slap').made")
    says = "It was made on another version of this bass, and may sound different now."
    for other, reported in ((made, ""), ("0" * 8, f" {says}")):
        link = f"#like=slap&action=-0.5&made={other}"
        check_link(link, *ON_PAGE)
        open_page(opened, opened.home + link)
        assert state(opened)[1] == {"action": -0.5} and state(opened)[4] == f"The bass is as the link says.{reported}"


def test_a_message_is_in_sight_wherever_the_page_is_scrolled(opened: Any) -> None:
    with resize(opened, 390, 844):
        open_page(opened, f"{opened.home}#like=jazz-finger&action=99")
        for y in (0, 1e6):
            opened.execute_script("scrollTo(0, arguments[0])", y)
            said = opened.find_element("id", "said")
            box = opened.execute_script("return $('said').getBoundingClientRect().toJSON()")
            assert "action = 99" in said.text and 0 <= box["top"] < box["bottom"] <= 844 and box["right"] <= 390


def test_the_chosen_bass_is_there_again_after_a_reload(opened: Any) -> None:
    opened.execute_script("chooseBass('slap')")
    opened.refresh()
    opened.execute_script(INSIDE)
    assert opened.execute_script("return [$('bass').value, location.hash, bench().changed]") == [
        "slap", "#like=slap", False,
    ]  # fmt: skip


def test_undo_redo_reset_and_two_benches(opened: Any) -> None:
    set_slider(opened, "action", 0.5, 0.8, 1.5)  # one step
    set_slider(opened, "foam", 0.5)
    assert state(opened)[:4] == ["A", {"action": 1.5, "foam": 0.5}, 2, 0]

    def press(name: str) -> list[Any]:
        opened.execute_script("$(arguments[0]).click()", name)
        return list(state(opened)[:4])

    assert press("undo") == ["A", {"action": 1.5}, 1, 1]
    assert press("undo") == ["A", {}, 0, 2] and not opened.find_element("id", "undo").is_enabled()
    assert opened.execute_script("return location.hash") == ""
    assert press("redo") == ["A", {"action": 1.5}, 1, 1]
    assert press("slot-B")[:2] == ["B", {}]
    set_slider(opened, "neck_relief", 0.8)
    assert press("slot-A")[:2] == ["A", {"action": 1.5}] and press("slot-B")[:2] == ["B", {"neck_relief": 0.8}]
    assert opened.find_element("id", "slot-B").get_attribute("aria-pressed") == "true"
    assert press("reset")[:2] == ["B", {}] and press("undo")[:2] == ["B", {"neck_relief": 0.8}]
    assert press("undo")[:2] == ["B", {}] and press("undo") == ["A", {}, 0, 3]
    assert press("redo")[:2] == ["A", {"action": 1.5}]


def test_it_works_from_the_keyboard_and_has_a_name_for_everything(opened: Any) -> None:
    from selenium.webdriver.common.keys import Keys

    for element in opened.find_elements("css selector", "#bench :is(button, input, summary):not([hidden])"):
        if element.value_of_css_property("display") != "none":  # on other screens
            assert element.accessible_name, element.get_attribute("outerHTML")
    slider = opened.find_element("id", "bench-action")
    slider.send_keys(Keys.ARROW_LEFT, Keys.ARROW_LEFT)
    assert state(opened)[1] == {"action": -0.1}
    assert slider.get_attribute("aria-valuetext") == "2.30 mm, the preset has 2.40 mm"
    assert opened.execute_script("return location.hash") == "#like=jazz-finger&action=-0.1"
    slider.send_keys(Keys.DELETE)
    assert state(opened)[1] == {} and slider.get_attribute("aria-valuetext") == "2.40 mm"
    opened.find_element("id", "bench-fret").send_keys(*[Keys.ARROW_RIGHT] * 5)
    opened.find_element("id", "bench-fret_height").send_keys(Keys.ARROW_RIGHT)
    assert state(opened)[1] == {"fret": 5, "fret_height": 0.02}
    opened.find_element("id", "bench-foam").send_keys("a")  # letters still play
    wait(lambda: opened.execute_script("return player.sounding"))


def test_what_is_changed_is_heard_without_a_gap_and_the_stroke_stays(opened: Any) -> None:
    """A dragged slider is heard while the note rings: basses in between carry it on, and the newest value wins."""
    start_sound(opened)
    opened.execute_script(
        "pluckWith(STROKES.find(one => one.symbol === 'pick')); window.rang = []; const [first] = player.names.keys();"
        "player.on('report', ({bass, peak}) => { if (bass !== first) rang.push(peak); })"
    )
    count = "window.made = []; const before = workshop.ask.bind(workshop);"
    count += " workshop.ask = (m, t) => { if (m.change) made.push(m.change); return before(m, t); };"
    opened.execute_script(count)
    opened.execute_script("press('test', 33, 100, performance.now())")
    opened.execute_async_script(
        "const done = arguments[0], slider = $('bench-action'); let k = 0;"
        "const drag = () => { slider.value = -0.004 * ++k; slider.dispatchEvent(new Event('input'));"
        " if (k < 300) return setTimeout(drag, 4);"
        " slider.dispatchEvent(new Event('change')); done(); }; drag();"
    )
    wait(lambda: opened.execute_script("return !building.now && !building.wanted && !player.next"))
    found = opened.execute_script("return made.map(([[number, value]]) => value)")
    assert 2 <= len(found) <= 60 and found[-1] == pytest.approx(-1.2)
    wait(lambda: opened.execute_script("return player.names.size === 1"))
    wait(lambda: opened.execute_script("return rang.length") > 5)
    assert max(opened.execute_script("return rang")[2:]) > 1e-3, "the note rings on"
    assert opened.execute_script("return state.stroke.symbol") == "pick"
    reported = "const done = arguments[0], {port} = player.node, old = port.onmessage; port.onmessage = e =>"
    reported += "{ old(e); if (e.data.playing) done([e.data.playing.pluckedWith, e.data.faults]); }"
    # the page informs the new bass once it learns of it
    wait(lambda: opened.execute_async_script(reported) == ["pick", 0])
    heights = opened.execute_script("return bassCalled('jazz-finger').strings[0].heights[11]")
    assert heights == pytest.approx(-1.2e-3, abs=1e-9)
    opened.execute_script("release('test')")


AT_REST = "return !building.now && !building.wanted && !player.next"


def test_a_neck_that_cannot_be_played_is_told_and_the_bass_before_goes_on(opened: Any) -> None:
    start_sound(opened)
    opened.execute_script("onBench(() => bench().setAll({gauge: 5}))")
    wait(lambda: opened.execute_script(AT_REST))
    opened.execute_script("onBench(() => bench().setAll({fret: 7, fret_height: 1.5, action: -1.9}))")
    wait(lambda: "cannot be played" in state(opened)[4] and opened.execute_script(AT_REST))
    says = "This neck cannot be played: fret 7 stands 0.86 mm above string E at rest. The bass is as it was."
    assert state(opened)[1] == {"gauge": 5} and state(opened)[4] == says
    assert opened.execute_script("return location.hash") == "#like=jazz-finger&gauge=5"
    wait(lambda: opened.execute_script("return [...player.basses.values()].at(-1).label") == "like=jazz-finger&gauge=5")


@pytest.mark.parametrize("name", ["jazz-finger", "fretless", "slap"])
def test_a_slider_stops_where_the_neck_does_and_its_link_plays(opened: Any, name: str) -> None:
    opened.execute_script("chooseBass(arguments[0])", name)
    start_sound(opened)
    wait(lambda: opened.execute_script(AT_REST))
    to_the_end = "const slider = $('bench-action'); slider.value = slider.min; slider.oninput(); slider.onchange()"
    for _ in range(2):  # the second time it does not have to try
        opened.execute_script(to_the_end)
        wait(lambda: opened.execute_script("return bench().value('action') > -2"))
    wait(lambda: opened.execute_script(AT_REST))
    said, shown, value, there, link, label = opened.execute_script(
        "return [$('said').textContent, $('bench-action').parentElement.querySelector('output').textContent,"
        " bench().value('action'), +$('bench-action').value, location.hash, [...player.basses.values()].at(-1).label]"
    )
    assert said.startswith(f"Action stops at {shown}: beyond it ") and "above string" in said
    assert value == there and link == f"#{label}" == f"#like={name}&action={value}"
    open_page(opened, opened.home + link)
    start_sound(opened)
    assert state(opened)[1] == {"action": value} and state(opened)[4] == "The bass is as the link says."


def test_a_link_to_a_neck_that_cannot_be_played_plays_the_preset_and_says_so(opened: Any) -> None:
    open_page(opened, f"{opened.home}#like=slap&action=-2")
    wait(lambda: "cannot be played" in state(opened)[4])
    assert "stands" in state(opened)[4] and state(opened)[4].endswith("The bass is the preset's.")
    start_sound(opened)
    assert opened.execute_script("return [player.playing, bench().link()]") == ["slap", "like=slap"]


def test_the_preset_is_saved_as_a_file_that_the_commands_take(opened: Any, tmp_path: Path, run: Run) -> None:
    opened.execute_cdp_cmd("Browser.setDownloadBehavior", {"behavior": "allow", "downloadPath": str(tmp_path)})
    opened.execute_script("onBench(() => bench().setAll({action: -0.9, fret: 7, fret_height: 0.12, gauge: 10}))")
    opened.find_element("id", "save").click()
    file = tmp_path / "jazz-finger-bench.toml"
    wait(file.exists)
    assert file.read_text() == opened.execute_script("return bench().toml()")
    status, out, err = run("presets", "check", file)
    assert status == 0 and "good; Jazz bass, fingers" in out and "no note" not in out, err
    assert "jazz-finger-bench.toml" in state(opened)[4]


def test_a_preset_that_a_page_or_a_plugin_saved_opens(opened: Any, tmp_path: Path) -> None:
    file = tmp_path / "Slap 1.toml"
    values = "[bench]\naction = -0.5\ngauge = 10\n\n[plugin]\ntone = -0.5\ntechnique = 5\nghost = 1\n"
    file.write_text(f'# livebass\nlike = "slap"\n\n{values}')
    opened.find_element("id", "preset-file").send_keys(str(file))
    wait(lambda: "Slap 1.toml" in state(opened)[4])
    assert state(opened)[1] == {"action": -0.5, "gauge": 10} and state(opened)[4] == "The bass is as Slap 1.toml says."
    assert opened.execute_script("return [$('bass').value, $('tone').value, location.hash]") == [
        "slap", "-0.5", "#like=slap&action=-0.5&gauge=10"
    ]  # fmt: skip
    pressed = opened.execute_script("return [...WAYS, ...STROKES].filter(one => one.button.ariaPressed === 'true')")
    assert [one["symbol"] for one in pressed] == ["ghost", "pick"]
    toml = opened.execute_script("return bench().toml()")
    assert toml == 'like = "slap"\n\n[bench]\naction = -0.5\ngauge = 10\n'
    file.write_text('name = "Slap"')
    opened.find_element("id", "preset-file").send_keys(str(file))
    wait(lambda: "they have no such line: name" in state(opened)[4])
    assert state(opened)[1] == {"action": -0.5, "gauge": 10}


def test_fingers_have_room_on_a_phone(opened: Any) -> None:
    with resize(opened, 390, 844):
        open_page(opened, opened.home + "?phone")
        assert not opened.execute_script("return $('bench-fold').open")
        bar = "const {top, bottom} = $('bench').getBoundingClientRect(); return [top, bottom, innerHeight]"
        top, bottom, height = opened.execute_script(bar)  # folded, with one slider: visible from the beginning
        assert 80 <= bottom - top <= 105 and bottom <= height + 1
        opened.execute_script("$('bench-fold').open = true")
        top, bottom, height = opened.execute_script(bar)
        assert bottom <= height + 1 and bottom - top <= 0.62 * height
        found = "return [...document.querySelectorAll('#bench :is(button, input, select, summary)')].filter("
        found += "e => e.offsetParent).map(e => [e.id || e.textContent, e.getBoundingClientRect().height])"
        assert all(height >= 44 for _, height in opened.execute_script(found)), opened.execute_script(found)
        assert opened.execute_script("return document.documentElement.scrollWidth") == 390


def test_every_wish_ends_up_in_the_bass_that_plays(opened: Any, tmp_path: Path) -> None:
    """In silence too: the file of the audio thread's bass equals the saved preset's."""
    start_sound(opened)
    opened.find_element("id", "power").click()
    wait(lambda: opened.execute_script("return player.context.state === 'suspended'"))
    for action in (-0.2, -0.5, -0.8):
        set_slider(opened, "action", action)
    opened.execute_script("$('slot-B').click()")
    set_slider(opened, "pickup_2_place", 19.0)
    places = "return bassCalled('jazz-finger').pickups.map(pickup => pickup.position)"
    wait(lambda: opened.execute_script(places) == [pytest.approx(0.1524), pytest.approx(0.07996)])
    opened.execute_script("$('slot-A').click()")
    wait(lambda: opened.execute_script("return !building.now && !player.next"))
    opened.execute_script("player.sound()")
    wait(lambda: opened.execute_script("return player.context.state === 'running' && player.names.size === 1"))
    file = "inBase64(new Uint8Array(player.basses.get([...player.names.keys()][0]).file))"
    found, toml = opened.execute_script(f"return [{file}, bench().toml()]")
    (tmp_path / "saved.toml").write_text(toml)
    assert "action" in toml and "pickup" not in toml
    assert base64.b64decode(found) == image_file(load_preset(tmp_path / "saved.toml"))
    assert opened.execute_script(places) == [pytest.approx(0.1524), pytest.approx(0.06096)]
    crown = "return bassCalled('jazz-finger').strings[0].heights[11]"
    assert opened.execute_script(crown) == pytest.approx(-1.6e-3, abs=1e-9)
    opened.execute_script("$('reset').click()")
    wait(lambda: opened.execute_script(crown) == pytest.approx(-2.4e-3, abs=1e-9))
