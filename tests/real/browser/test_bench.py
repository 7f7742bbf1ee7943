"""The page's bench: its changes match a preset with the same keys, byte for byte, and are kept."""

from __future__ import annotations

import base64
import json
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from support.browser import COPIED, INSIDE, MADE_HERE, OFFLINE, chromium, firefox, open_page, wait
from support.command import Run
from support.costs import quick
from support.wasm import QUANTUM, RATE, messages_of

from livebass import QUALITIES, load_preset, render_to_array, score_of
from livebass.engine.render import mixed
from livebass.plugin.instrument import image_file
from livebass.preset.build import PresetError
from livebass.web.bench import Source, bench
from livebass.web.export import export_page
from livebass.web.link import check_link

# The page's saved preset, and the instrument file it builds, for a bass with these values
MADE = """
const [name, values, done] = arguments;
(async () => {
  const own = benches.get(name), kept = own.slots;
  own.slots = {A: {}, B: {}};
  try {
    own.setAll(values);
    const bytes = new Uint8Array(await player.fileOf(name));
    let text = "";
    for (let k = 0; k < bytes.length; k += 32768) text += String.fromCharCode(...bytes.subarray(k, k + 32768));
    done({toml: own.toml(), file: btoa(text)});
  } catch (error) {
    done({toml: own.toml(), error: error.message});
  } finally {
    own.slots = kept;
  }
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


def made(page: Any, name: str, values: dict[str, float]) -> tuple[str, bytes | str]:
    """The page's saved preset of a bass with these values; and its instrument file, or the error."""
    found = page.execute_async_script(MADE, name, values)
    return found["toml"], found["error"] if "error" in found else base64.b64decode(found["file"])


def each_slider(name: str) -> Iterator[dict[str, float]]:
    """Bench values with one slider moved, each to two places."""
    for slider in sliders(name):
        span = slider["most"] - slider["least"]
        for part in (0.3, 0.62):
            value = round(slider["least"] + part * span, 2)
            moved = {slider["symbol"]: float(round(value)) if slider["symbol"] == "fret" else value}
            yield moved | ({"fret": 7.0} if slider["symbol"] == "fret_height" else {})


# The bench's messages in `page`
STATE = "const b = bench(); return [b.slot, b.values, b.before.length, b.after.length, $('said').textContent]"


def sliders(name: str) -> list[dict[str, Any]]:
    found = bench(load_preset(name), Source(name))
    assert found
    return list(found["sliders"])


@pytest.mark.parametrize("name", quick(BASSES, ["fretless", "paper-bass"]))
def test_each_slider_makes_the_instrument_file_of_the_saved_preset(page: Any, tmp_path: Path, name: str) -> None:
    """Moved to one of its places on every second bass, to the other one on the next."""
    default, refused = image_file(load_preset(name)), []
    for values in list(each_slider(name))[BASSES.index(name) % 2 :: 2]:
        toml, file = made(page, name, values)
        (tmp_path / "saved.toml").write_text(toml)
        if isinstance(file, str):  # an unplayable neck, here as there
            with pytest.raises(PresetError, match=re.escape(file)):
                load_preset(tmp_path / "saved.toml")
            refused.append(values)
            continue
        assert file == image_file(load_preset(tmp_path / "saved.toml")), (values, toml)
        assert (file == default) == ("fret" in values and len(values) == 1), values
    assert not refused
    toml, file = made(page, name, {"action": -2.0, "neck_relief": -1.0, "fret": 7, "fret_height": 1.5})
    assert isinstance(file, str) and "stands" in file


@pytest.mark.slow
def test_firefox_makes_the_same_file(page: Any, tmp_path: Path) -> None:
    values = {"action": -0.9, "fret": 7, "fret_height": 0.12, "gauge": 10, "wear": 200, "pickup_2_place": 9.04}
    values |= {"pickup_1_height": -1, "neck_resonance": 7.14}
    function, arguments = "(function () {" + MADE + "})", json.dumps(["jazz-finger", values], sort_keys=True)
    with firefox(tmp_path / "profile") as driver:
        driver.get(page.home)
        ready = INSIDE + "(async () => { while (!player.ready) await new Promise(done => setTimeout(done, 20)); })()"
        driver.run(f"{ready}.then(() => 'ready')")
        found = driver.run(f"new Promise(done => {function}(...{arguments}, made => done(JSON.stringify(made))))")
    assert made(page, "jazz-finger", values) == (json.loads(found)["toml"], base64.b64decode(json.loads(found)["file"]))


def test_all_at_once_is_the_saved_preset(page: Any, tmp_path: Path) -> None:
    for name in BASSES:
        values: dict[str, float] = {}
        for one in each_slider(name):
            values |= {symbol: value for symbol, value in one.items() if symbol not in values}
        values |= {"action": 0.5, "neck_relief": 0.1}
        toml, file = made(page, name, values)
        (tmp_path / "saved.toml").write_text(toml)
        assert file == image_file(load_preset(tmp_path / "saved.toml")), (name, toml)


def set_slider(page: Any, symbol: str, *values: float) -> None:
    """Moves a slider to each of `values`, then releases it."""
    page.execute_script(
        "const slider = $(`bench-${arguments[0]}`);"
        "for (const value of arguments[1]) { slider.value = value; slider.dispatchEvent(new Event('input')); }"
        "slider.dispatchEvent(new Event('change'))",
        symbol,
        values,
    )


def begin(page: Any) -> None:
    page.find_element("css selector", "h1").click()  # browsers want a gesture
    page.execute_script("player.sound()")
    wait(lambda: page.execute_script("return player.playing"))


def state(page: Any) -> Any:
    """The slot of the bench, its values, the counts of undo and redo steps, and its message."""
    return page.execute_script(STATE)


@pytest.fixture
def opened(page: Any) -> Iterator[Any]:
    """A fresh page; any error in it fails the test."""
    page.get("about:blank")
    page.get_log("browser")
    open_page(page, page.home)
    yield page
    assert not [line for line in page.get_log("browser") if line["level"] in ("SEVERE", "WARNING")]


HEARD = f"""
const [name, values, score, frames, rate, done] = arguments;
benches.get(name).setAll(values);
({OFFLINE})(name, score, frames, rate).then(sound => done([benches.get(name).toml(), sound]));
"""
SOFT = [(0.2 * k, 0.18, 33 + 5 * (k % 3), 25) for k in range(4)]  # as in test_module.py: nothing is chaotic
HIT = [(0.05, 0.8, 47, 127)]  # fret 4 of the G string at full force
CLOSE = 3e-7  # of full scale; the largest found, 1.8e-7, is from the single precision of answering strings


def test_the_sound_of_each_slider_is_that_of_a_render_of_the_saved_preset(opened: Any, tmp_path: Path) -> None:
    """Of every second slider: each makes the file of the saved preset (above). Those that change frets are tested by a
    note that hits them: lossy contact is not chaotic.
    """
    heights = {"action", "neck_relief", "nut_height", "fret_height", "contact_loss"}
    usual: dict[bool, Any] = {}
    moved = [values for values in each_slider("jazz-finger") if list(values) != ["fret"]][::4]
    for hit, values in [(False, {}), (True, {}), *((bool(heights & set(values)), values) for values in moved)]:
        score = score_of(HIT if hit else SOFT, RATE)
        frames = RATE // 2 // QUANTUM * QUANTUM
        toml, text = opened.execute_async_script(HEARD, "jazz-finger", values, messages_of(score), frames, RATE)
        sound = np.frombuffer(base64.b64decode(text), np.float32)
        (tmp_path / "saved.toml").write_text(toml)
        bass = load_preset(tmp_path / "saved.toml")
        wanted = np.clip(mixed(render_to_array(bass, score, QUALITIES["live"], tail=0.0).astype(np.float32)), -1, 1)
        assert np.abs(sound - wanted[: len(sound)]).max() <= CLOSE < 0.01 < np.abs(sound).max(), values
        assert not values or np.abs(sound - usual[hit]).max() > 1e-6, values
        usual.setdefault(hit, sound)


def test_a_lower_action_buzzes_under_the_same_hand(opened: Any) -> None:
    """The page's sound has more above 1 kHz at the same pluck: the saved preset keeps the hand."""
    score, high = score_of([(0.0, 0.9, 43, 110)], RATE), []
    for action in (1.6, -1.4):
        given = messages_of(score), RATE // QUANTUM * QUANTUM, RATE
        text = opened.execute_async_script(HEARD, "jazz-finger", {"action": action}, *given)[1]
        spectrum = np.abs(np.fft.rfft(np.frombuffer(base64.b64decode(text), np.float32))) ** 2
        high.append(spectrum[1000:].sum() / spectrum.sum())
    assert high[1] > 1.6 * high[0]


def test_links_bring_the_bench_back(opened: Any) -> None:
    for name in BASSES:
        values = dict(pair for one in list(each_slider(name))[::2] for pair in one.items())
        opened.execute_script("$('bass').value = arguments[0]; $('bass').dispatchEvent(new Event('change'))", name)
        opened.execute_script("onBench(() => bench().setAll(arguments[0]))", values)
        link, toml = opened.execute_script("return [location.hash, bench().toml()]")
        assert link.startswith(f"#like={name}&") and link.count("&") == len(values)
        check_link(opened.home + link, *ON_PAGE)
        opened.get("about:blank")
        open_page(opened, opened.home + link)
        assert opened.execute_script("return [$('bass').value, bench().toml(), location.hash]") == [name, toml, link]
        assert state(opened)[4] == "The bass is as the link says."
    opened.execute_script("location.hash = '#like=slap&action=-0.5'")  # as if pasted
    wait(lambda: opened.execute_script("return $('bass').value === 'slap' && bench().values.action === -0.5"))


@pytest.mark.parametrize(
    "link, says",
    [
        ("like=none&action=2", "the link names no bass of this page that can be changed: like=none"),
        ("action=2", "the link names no bass of this page that can be changed: action=2"),
        ("like=jazz-finger&fret=21", "the link says fret = 21: it must be from 0 to 20"),
        ("like=jazz-finger&action=99", "the link says action = 99: it must be from -2 to 3 mm"),
        ("like=jazz-finger&wear=", "the link says wear = : it must be from -50 to 1100 %"),
        ("like=jazz-finger&action=NaN", "the link says action = NaN: it must be from -2 to 3 mm"),
        ("like=jazz-finger&blend=1.5", "the link says blend = 1.5: it must be from -1 to 1"),
        ("like=jazz-finger&action=%3Cb%3E", "the link says action = <b>: it must be from -2 to 3 mm"),
    ],
)
def test_a_bad_link_is_told_in_a_line_and_the_preset_plays(opened: Any, link: str, says: str) -> None:
    with pytest.raises(ValueError, match=re.escape(says)):
        check_link(link, *ON_PAGE)
    opened.get("about:blank")
    open_page(opened, f"{opened.home}#{link}")
    slot, values, *_, said = state(opened)
    assert (slot, values) == ("A", {}) and said.startswith(says) and said.endswith(". The bass is unchanged.")
    assert "\n" not in said and opened.execute_script("return $('bass').value") == "jazz-finger"
    begin(opened)


def test_what_others_added_to_a_link_is_ignored_and_said(opened: Any) -> None:
    link = "#like=jazz-finger&action=-0.5&fbclid=IwAR1&utm_source=mail"
    check_link(link, *ON_PAGE)
    opened.get("about:blank")
    open_page(opened, opened.home + link)
    assert state(opened)[1] == {"action": -0.5}
    assert state(opened)[4] == "The bass is as the link says. Ignored: fbclid, utm_source."


def test_links_and_presets_hold_the_playing_as_plugins_do(opened: Any, tmp_path: Path) -> None:
    played = {"blend": 0.5, "velocity_curve": -0.25, "hand_position": 7, "avoid_open": 1, "humanise_time": 12}
    link = "like=jazz-finger&" + "&".join(f"{symbol}={value}" for symbol, value in played.items())
    check_link(link, *ON_PAGE)
    opened.get("about:blank")
    open_page(opened, f"{opened.home}#{link}")
    assert opened.execute_script("return movedControls()") == played
    texts = opened.execute_script("return arguments[0].map(symbol => $(`${symbol}-text`).textContent)", list(played))
    assert texts == ["to the bridge", "softer touch", "fret 7", "yes", "up to 12 ms late"]
    file = tmp_path / "mine.toml"
    file.write_text(opened.execute_script("return bench().toml(movedControls())"))
    assert dict(load_preset(str(file)).played) == played
    opened.get("about:blank")
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
    for other, told in ((made, ""), ("0" * 8, f" {says}")):
        link = f"#like=slap&action=-0.5&made={other}"
        check_link(link, *ON_PAGE)
        opened.get("about:blank")
        open_page(opened, opened.home + link)
        assert state(opened)[1] == {"action": -0.5} and state(opened)[4] == f"The bass is as the link says.{told}"


def test_a_message_is_in_sight_wherever_the_page_is_scrolled(opened: Any) -> None:
    size = {"width": 390, "height": 844, "deviceScaleFactor": 1, "mobile": True}
    opened.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", size)
    try:
        opened.get("about:blank")
        open_page(opened, f"{opened.home}#like=jazz-finger&action=99")
        for y in (0, 1e6):
            opened.execute_script("scrollTo(0, arguments[0])", y)
            said = opened.find_element("id", "said")
            box = opened.execute_script("return $('said').getBoundingClientRect().toJSON()")
            assert "action = 99" in said.text and 0 <= box["top"] < box["bottom"] <= 844 and box["right"] <= 390
    finally:
        opened.execute_cdp_cmd("Emulation.clearDeviceMetricsOverride", {})


def test_the_chosen_bass_is_there_again_after_a_reload(opened: Any) -> None:
    opened.execute_script("chooseBass('slap')")
    opened.refresh()
    opened.execute_script(INSIDE)
    assert opened.execute_script("return [$('bass').value, location.hash, bench().changed]") == [
        "slap", "#like=slap", False,
    ]  # fmt: skip


def test_a_link_from_this_computer_alone_says_how_to_open_it(opened: Any) -> None:
    opened.execute_script(f"{COPIED}; onBench(() => bench().setAll({{action: -0.5}})); $('link').click()")
    wait(lambda: "livebass page --link" in state(opened)[4])
    link = "like=jazz-finger&action=-0.5&" + opened.execute_script(MADE_HERE)
    assert opened.execute_script("return copied") == link
    check_link(link, *ON_PAGE)


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
    begin(opened)
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
    told = "const done = arguments[0], {port} = player.node, old = port.onmessage;"
    told += "port.onmessage = e => { old(e); if (e.data.playing) done([e.data.playing.pluckedWith, e.data.faults]); }"
    wait(lambda: opened.execute_async_script(told) == ["pick", 0])  # the page informs the new bass once it learns of it
    heights = opened.execute_script("return bassCalled('jazz-finger').strings[0].heights[11]")
    assert heights == pytest.approx(-1.2e-3, abs=1e-9)
    opened.execute_script("release('test')")


def test_a_neck_that_cannot_be_played_is_told_and_the_bass_before_goes_on(opened: Any) -> None:
    begin(opened)
    bass = opened.execute_script("return [...player.names.keys()]")
    opened.execute_script("onBench(() => bench().setAll({fret: 7, fret_height: 1.5, action: -1.9}))")
    wait(lambda: "stands" in opened.find_element("id", "said").text)
    assert "fret 7 stands 0.86 mm above string E at rest" in opened.find_element("id", "said").text
    assert opened.execute_script("return [...player.names.keys()]") == bass
    opened.execute_script("$('undo').click()")
    wait(lambda: opened.execute_script("return !building.now && !player.next"))


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
    for text, says in {
        'like = "slap"\n[bench]\naction = 9': "the preset says action = 9: it must be from -2 to 3 mm",
        'like = "slap"\n[neck]\naction = "2 mm"': "they have no such line: action",
        'like = "kazoo"': 'this page does not have or cannot change: "kazoo"',
        'name = "Slap"': "they have no such line: name",
    }.items():
        file.write_text(text)
        opened.find_element("id", "preset-file").send_keys(str(file))
        wait(lambda: says in state(opened)[4])  # noqa: B023
        assert state(opened)[1] == {"action": -0.5, "gauge": 10} and "\n" not in state(opened)[4]


def test_fingers_have_room_on_a_phone(opened: Any) -> None:
    size = {"width": 390, "height": 844, "deviceScaleFactor": 1, "mobile": True}
    opened.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", size)
    try:
        open_page(opened, opened.home + "?phone")
        assert not opened.execute_script("return $('bench-fold').open")
        bar = "const {top, bottom} = $('bench').getBoundingClientRect(); return [top, bottom, innerHeight]"
        top, bottom, height = opened.execute_script(bar)  # the folded bar is visible from the beginning
        assert 40 <= bottom - top <= 60 and bottom <= height + 1
        opened.execute_script("$('bench-fold').open = true")
        top, bottom, height = opened.execute_script(bar)
        assert bottom <= height + 1 and bottom - top <= 0.62 * height
        found = "return [...document.querySelectorAll('#bench :is(button, input, select, summary)')].filter("
        found += "e => !e.hidden).map(e => [e.id || e.textContent, e.getBoundingClientRect().height])"
        assert all(height >= 44 for _, height in opened.execute_script(found)), opened.execute_script(found)
        assert opened.execute_script("return document.documentElement.scrollWidth") == 390
    finally:
        opened.execute_cdp_cmd("Emulation.clearDeviceMetricsOverride", {})


def test_every_wish_ends_up_in_the_bass_that_plays(opened: Any, tmp_path: Path) -> None:
    """In silence too: the file of the audio thread's bass equals the saved preset's."""
    begin(opened)
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
    text = "const bytes = new Uint8Array(player.basses.get([...player.names.keys()][0]).file); let text = '';"
    text += (
        "for (let k = 0; k < bytes.length; k += 32768) text += String.fromCharCode(...bytes.subarray(k, k + 32768));"
    )
    found, toml = opened.execute_script(text + "return [btoa(text), bench().toml()]")
    (tmp_path / "saved.toml").write_text(toml)
    assert "action" in toml and "pickup" not in toml
    assert base64.b64decode(found) == image_file(load_preset(tmp_path / "saved.toml"))
    assert opened.execute_script(places) == [pytest.approx(0.1524), pytest.approx(0.06096)]
    crown = "return bassCalled('jazz-finger').strings[0].heights[11]"
    assert opened.execute_script(crown) == pytest.approx(-1.6e-3, abs=1e-9)
    opened.execute_script("$('reset').click()")
    wait(lambda: opened.execute_script(crown) == pytest.approx(-2.4e-3, abs=1e-9))
