"""Every control of the page by mouse, touch and key, and a stranger's first minute."""

from __future__ import annotations

import base64
import time
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import pytest
from support.browser import PATIENCE, chromium, errors, open_page, wait
from support.song import midi_file, song_of

# `snapshot` is everything visible except meters, all choices, and counts of invisible actions: messages to the audio
# thread, files made or asked for. `at` readies a control, and waits until all rests.
WATCH = """
window.deeds = 0;
const {port} = player.node, post = port.postMessage.bind(port), make = URL.createObjectURL;
port.postMessage = (m, t) => { if (!m.spare) deeds++; post(m, t); };
URL.createObjectURL = blob => { deeds++; return make.call(URL, blob); };
addEventListener("click", e => {
  if (e.target.type === "file") e.preventDefault(); // no dialogue
  if (e.target.type === "file") deeds++;
}, true);
window.snapshot = () => {
  const copy = document.body.cloneNode(true);
  const chosen = [...document.querySelectorAll("input, select")].map(e => e.value);
  copy.querySelectorAll("#meters, #pitch, #seen, script").forEach(e => e.remove());
  copy.querySelectorAll(".on").forEach(e => e.classList.remove("on"));
  return JSON.stringify([deeds, location.hash, chosen, document.body.className, copy.innerHTML]);
};
window.at = async (selector, prepare) => {
  const e = () => document.querySelector(selector);
  state.rolling = false;
  hush();
  pauseAll();
  say("");
  await prepare();
  for (const id of ["bench-fold", "map-fold"]) $(id).open = !!e().closest(`#${id} > :not(summary)`);
  e().blur();
  do {
    window.before = snapshot();
    await new Promise(done => setTimeout(done, 40));
  } while (building.now || player.next || before !== snapshot());
  const {left, top, width, height} = e().getBoundingClientRect(), y = top + height / 2, range = e().type === "range";
  const far = range && (e().value - e().min) / (e().max - e().min) > 0.5;
  const x = left + width * (range ? far ? 0.25 : 0.75 : 0.5), hit = document.elementFromPoint(x, y);
  return {x, y, far, type: e().type, free: width > 0 && !e().disabled && (e() === hit || e().contains(hit)),
          tabs: e().tabIndex >= 0 || e().parentElement.id === "neck"};
};
window.differs = async patience => {
  const end = performance.now() + patience;
  while (snapshot() === before && performance.now() < end) await new Promise(done => setTimeout(done, 20));
  return snapshot() !== before;
};
window.own = () => chooseBass("jazz-finger");
const bent = values => { own(); onBench(() => bench().setAll(values)); };
const slowly = async () => {
  if (!see.replay) await showCase(paperBass().cases[0]);
  state.rolling = false;
};
const told = async at => {
  await showStep(PAGE.stories[0], at);
  state.rolling = false;
};
// A note was played before the bench changed.
const noted = async () => {
  own();
  bench().reset();
  $("story").hidden = true;
  if (see.replay) backToNow();
  await player.sound();
  while (player.playing !== "jazz-finger" || player.next) await new Promise(done => setTimeout(done, 20));
  press("test", 28, 100, performance.now());
  while (!kept.note || !see.note.wasReported) await new Promise(done => setTimeout(done, 20));
  release("test");
  bent({action: 0.5});
};
const neckFrom = fret => { own(); state.from = fret; showNeck(); layOut(); };
const [song] = arguments;
const withSong = () => openSong(new File([Uint8Array.from(atob(song), c => c.charCodeAt(0))], "two.mid"));
// What has to be before a control can do something, by its name
window.READY = {
  "undo": () => bent({action: bench().value("action") === 2 ? 2.1 : 2}), "reset": () => bent({foam: 5}),
  "redo": () => { bent({relief: 0.5}); $("undo").click(); },
  "slot-A": () => $("slot-B").click(), "slot-B": () => $("slot-A").click(), "link": () => say(""),
  "newer": () => { own(); onBench(() => { bench().revision = 1; }); },
  "again": slowly, "same": noted, "power": async () => { own(); await player.sound(); },
  "moment": slowly, "picture": slowly, "clip": slowly, "now": slowly,
  "riff": () => offerRiff("#like=jazz-finger&riff=0.28.90.300"),
  "roll": withSong, "loop": withSong, "part": withSong, "response-off": () => { $("response-off").hidden = false; },
  "response-level": () => { $("response-level").hidden = false; },
  "up": () => neckFrom(0), "down": () => neckFrom(3),
  "Side": () => choosePicture("note"), "Last note": () => choosePicture("side"),
  "Spectrum": () => choosePicture("side"), "Fingers, key 1": () => pluckWith(STROKES[1]),
  "story-next": () => told(0), "story-back": () => told(1),
  "case-a": own, "case-b": own, "case-c": own,
};
"""
# A selector and a name of each control; of the many places of neck and piano, the first and last of their kind.
FOUND = """
const path = e => e.id ? `#${e.id}` : e.dataset.key ? `[data-key="${e.dataset.key}"]`
  : e.dataset.fret ? `[data-string="${e.dataset.string}"][data-fret="${e.dataset.fret}"]`
  : `${path(e.parentElement)} > :nth-child(${1 + [...e.parentElement.children].indexOf(e)})`;
const few = ["#neck .open", "#neck .fret", "#piano .white", "#piano .black"].flatMap(place => {
  const all = [...document.querySelectorAll(place)];
  return [all[0], all.at(-1)];
});
return [...document.querySelectorAll("button:not(.skip, #later), select, summary, input:not([type=file])")]
  .filter(e => few.includes(e) || !e.closest("#neck, #piano, #tab, #transport, #one-bar")) // they have their own tests
  .map(e => [path(e), e.id || e.getAttribute("aria-label") || e.textContent]);
"""
AT = "const [selector, name, done] = arguments; at(selector, READY[name] || own).then(done)"
DIFFERS = "const [patience, done] = arguments; differs(patience).then(done)"
HOLD = 0.1  # s of a finger's touch
# Codes and texts
KEYS = {"Enter": (13, "\r"), " ": (32, " "), "ArrowLeft": (37, ""), "ArrowRight": (39, ""), "ArrowDown": (40, "")}


@pytest.fixture(scope="module")
def browser(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Any]:
    profile = tmp_path_factory.mktemp("chromium") / "profile"
    with chromium(profile, loggingPrefs={"browser": "ALL"}) as driver:
        driver.execute_cdp_cmd("Browser.setDownloadBehavior", {"behavior": "deny"})
        yield driver


@contextmanager
def opened(driver: Any, address: str, width: int, height: int, touch: bool) -> Iterator[None]:
    """The fresh page in a window of `width` by `height` px, on a touch screen or not; no error may occur in it."""
    size = {"width": width, "height": height, "deviceScaleFactor": 1, "mobile": touch}
    driver.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", size)
    driver.execute_cdp_cmd("Emulation.setTouchEmulationEnabled", {"enabled": touch})
    try:
        open_page(driver, address)
        wait(lambda: driver.execute_script("return !!player.node && player.next === undefined"))
        yield
        assert not errors(driver)
    finally:
        driver.execute_cdp_cmd("Emulation.setTouchEmulationEnabled", {"enabled": False})
        driver.execute_cdp_cmd("Emulation.clearDeviceMetricsOverride", {})


def act(driver: Any, means: str, selector: str, here: dict[str, Any], hold: float = 0.0) -> None:
    """Uses a control as a hand does; a touch lasts at least `hold` s."""
    at = {"x": here["x"], "y": here["y"]}
    if means == "key":
        driver.execute_script("document.querySelector(arguments[0]).focus()", selector)
        arrow = "ArrowLeft" if here["far"] else "ArrowRight"
        key = {"range": arrow, "checkbox": " ", "select-one": "ArrowDown"}.get(here["type"], "Enter")
        code, text = KEYS[key]
        given = {"key": key, "code": key, "windowsVirtualKeyCode": code, "text": text}
        for kind in ("keyDown" if text else "rawKeyDown", "keyUp"):
            driver.execute_cdp_cmd("Input.dispatchKeyEvent", {"type": kind, **given})
    elif here["type"] == "select-one":  # its menu is no part of the page
        choose(driver, selector)
    elif means == "mouse":
        for kind in ("mousePressed", "mouseReleased"):
            driver.execute_cdp_cmd("Input.dispatchMouseEvent", {"type": kind, "button": "left", "clickCount": 1, **at})
    else:
        for kind, points in (("touchStart", [at]), ("touchEnd", [])):
            driver.execute_cdp_cmd("Input.dispatchTouchEvent", {"type": kind, "touchPoints": points})
            time.sleep(hold if points else 0)


def choose(driver: Any, selector: str) -> None:
    """Chooses another entry of a list."""
    from selenium.webdriver.support.select import Select

    chosen = Select(driver.find_element("css selector", selector))
    chosen.select_by_index(0 if chosen.options[0] != chosen.first_selected_option else 1)


@pytest.mark.parametrize(
    "means, width, every",
    [
        pytest.param("mouse", 700, 1, marks=pytest.mark.slow),
        ("touch", 390, 3),
        pytest.param("touch", 390, 1, marks=pytest.mark.slow),
        pytest.param("key", 700, 1, marks=pytest.mark.slow),
    ],
)
def test_every_control_does_something_by(browser: Any, whole: str, means: str, width: int, every: int) -> None:
    """In a window tall enough for everything, and in one so narrow that it has tabs and a part of the neck.

    Quickly, each third control.
    """
    bass, drums = song_of([28, 31]), song_of([36])
    song = base64.b64encode(midi_file(bass, [m.copy(channel=9) if not m.is_meta else m for m in drums])).decode()
    with opened(browser, whole, width, 4800, means == "touch"):
        browser.find_element("css selector", "h1").click()  # browsers want a gesture before a sound
        wait(lambda: browser.execute_script("return see.replay !== undefined"))
        browser.execute_script(WATCH, song)
        found, dead = browser.execute_script(FOUND), []
        assert len(found) > 75
        for selector, name in found[::every]:
            for _ in range(3):  # where the machine is busy, a touch can last so long that it is no tap
                here = browser.execute_async_script(AT, selector, name)
                if not here["free"] or (means == "key" and not here["tabs"]):
                    continue
                act(browser, means, selector, here)
                if browser.execute_async_script(DIFFERS, 150 * PATIENCE):
                    break
            else:
                dead.append((name, here))
        assert not dead


def tap(driver: Any, selector: str, part: float = 0.5, hold: float = 0.0) -> None:
    """Touches a control for `hold` s, at the fraction `part` of its height from its top."""
    box = driver.execute_script(
        "const e = document.querySelector(arguments[0]); if (e.getBoundingClientRect().bottom > innerHeight"
        " || e.getBoundingClientRect().top < 0) e.scrollIntoView({block: 'center'});"
        "const {x, y, width, height} = e.getBoundingClientRect(); return {x, y, width, height};",
        selector,
    )
    at = {"x": box["x"] + box["width"] / 2, "y": box["y"] + part * box["height"]}
    act(driver, "touch", selector, {**at, "type": "button"}, hold)


def test_a_strangers_first_minute_on_a_phone(browser: Any, whole: str) -> None:
    """Open, touch, hear, see a fret flash, lower the action, hear it buzz, send the link."""
    fret = '[data-string="2"][data-fret="2"]'
    with opened(browser, whole, 390, 844, True):
        browser.execute_script(
            "window.flashed = new Set(); window.peak = 0; const flash = see.flash.bind(see);"
            "see.flash = (hit, now) => { flashed.add(hit.fret); flash(hit, now); };"
            "player.on('report', told => { peak = Math.max(peak, told.peak); });"
        )

        def contacts() -> int:
            """The contacts of a note's first 50 ms, while the finger surely stays; the page shows all."""
            browser.execute_script("$('seen').textContent = ''")
            tap(browser, fret, 0.95, 5 * HOLD)
            wait(lambda: browser.execute_script("return $('seen').textContent"))
            words, after = browser.execute_script(
                "const {contacts, frame} = see.note;"
                "return [$('seen').textContent, contacts.map(hit => hit.frame - frame)]"
            )
            assert int(words.split()[4]) > 0
            return sum(frames < 0.05 * 48000 for frames in after)

        before = contacts()  # the first touch starts the sound
        assert browser.execute_script("return peak") > 0.01
        assert browser.execute_script("return see.note.string") == 2  # however near the next string
        assert before > 0 and all(at > 2 for at in browser.execute_script("return [...flashed]"))
        tap(browser, "#bench summary")
        wait(lambda: browser.execute_script("return $('bench-fold').open"))
        browser.execute_script("$('bench-action').scrollIntoView({block: 'center'})")
        slider = browser.execute_script("return $('bench-action').getBoundingClientRect().toJSON()")
        where = {"x": slider["x"] + 0.12 * slider["width"], "y": slider["y"] + slider["height"] / 2, "type": "range"}
        act(browser, "touch", "#bench-action", where)
        wait(lambda: browser.execute_script("return bench().values.action < 2 && !building.now && !player.next"))
        wait(lambda: "The same pluck" in browser.execute_script("return $('seen').textContent"))  # played by itself
        tap(browser, "#bench summary")
        wait(lambda: not browser.execute_script("return $('bench-fold').open"))
        after = contacts()
        assert after > 2 * before, (before, after)
        link, toml = browser.execute_script("return [location.href, bench().toml()]")
        assert "#like=jazz-finger&action=" in link
    with opened(browser, link, 1280, 800, False):
        assert browser.execute_script("return bench().toml()") == toml
        assert "The bass is as the link says." in browser.find_element("id", "said").text
