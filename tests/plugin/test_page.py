"""The page as the editor of the CLAP plugin: a host shows it in a web view, and passes messages on."""

from __future__ import annotations

import base64
import ctypes as c
from collections.abc import Callable, Iterator
from contextlib import closing
from pathlib import Path
from typing import Any
from urllib.parse import unquote, urlsplit

import numpy as np
import pytest
from support.browser import PATIENCE, chromium
from support.clap import WEBVIEW, Plugin
from support.window import GUI, WINDOW

from livebass import load_preset
from livebass.arrays import Floats
from livebass.live.parameters import PARAMETERS
from livebass.live.thread.look import LOOK, STRING_LOOK
from livebass.plugin import clap
from livebass.plugin.bundle import EDITOR
from livebass.web.editor import editor_page

BASSES = ("jazz-finger", "fretless")
NUMBERS = {p.symbol: k for k, p in enumerate(PARAMETERS)}
SEE, MOVE, NOTE, UNDO, SWAP = (float(k) for k in range(5))
BASSES_TOLD, SEEN = 0, 1
BEGIN, MOVED, END = 0.0, 1.0, 2.0
GESTURE_BEGIN, GESTURE_END = 7, 8
HEAD = np.dtype([("kind", "i8"), ("side", "i8"), ("rate", "f8"), ("values", "f8", (len(PARAMETERS),))])
BLOCK = 512
HOST = """<!doctype html><style>body { margin: 0 } iframe { border: 0; width: 1200px; height: 900px }</style>
<iframe id="view"></iframe>
<script>
const said = [];
addEventListener("message", ({data}) => said.push(btoa(String.fromCharCode(...new Uint8Array(data)))));
const {contentWindow} = document.getElementById("view");
const bytes = text => Uint8Array.from(atob(text), c => c.charCodeAt(0));
const tell = texts => { for (const text of texts) contentWindow.postMessage(bytes(text).buffer, "*"); };
</script>"""


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The plugin in a folder whose name needs care, with its page."""
    made = tmp_path_factory.mktemp("clap") / "läb #1 %20"
    basses = {name: load_preset(name) for name in BASSES}
    clap.write_bundle(basses, made, more={EDITOR: editor_page(basses)})
    return made


@pytest.fixture
def plugin(folder: Path) -> Iterator[Plugin]:
    with closing(Plugin(folder, web=True)) as made:
        yield made


def say(plugin: Plugin, *numbers: float) -> bool:
    """Says something as the page does; returns whether the plugin understood it."""
    data = np.array(numbers).tobytes()
    return bool(plugin.extension("webview/3", WEBVIEW).receive(plugin.handle, data, len(data)))


def seen(plugin: Plugin) -> tuple[Any, bytes]:
    """What the plugin tells of itself, and the bytes of its look."""
    plugin.sent.clear()
    assert say(plugin, SEE, 0)
    (told,) = plugin.sent
    head = np.frombuffer(told[: HEAD.itemsize], HEAD)[0]
    assert head["kind"] == SEEN
    return head, told[HEAD.itemsize :]


def opened(plugin: Plugin) -> Any:
    """Opens the page as the plugin's window; returns its GUI."""
    gui = plugin.extension("gui", GUI)
    assert gui.supported(plugin.handle, b"webview", False) and not gui.supported(plugin.handle, b"webview", True)
    assert gui.create(plugin.handle, b"webview", False)
    assert not gui.set_scale(plugin.handle, 2.0)
    assert gui.set_parent(plugin.handle, c.addressof(WINDOW(b"webview", 0)))
    assert gui.show(plugin.handle)
    return gui


def address(plugin: Plugin) -> str:
    """Where the plugin says that its page is; "": nowhere."""
    ask = plugin.extension("webview/3", WEBVIEW).uri
    length = ask(plugin.handle, None, 0)
    text, short = c.create_string_buffer(max(length, 1)), c.create_string_buffer(b"#" * 8)
    assert ask(plugin.handle, text, length) == length
    assert ask(plugin.handle, short, 4) == length and short.raw[4:8] == b"####"
    return text.value.decode()


def test_the_page_is_offered_to_hosts_that_show_pages(folder: Path, tmp_path: Path) -> None:
    with closing(Plugin(folder, web=True)) as plugin, closing(Plugin(folder)) as other:
        assert Path(unquote(urlsplit(address(plugin)).path)).read_bytes() == (folder / EDITOR).read_bytes()
        assert urlsplit(address(plugin)).scheme == "file" and not urlsplit(address(plugin)).netloc
        gui = opened(plugin)
        gui.destroy(plugin.handle)
        assert not gui.show(plugin.handle)
        assert gui.create(plugin.handle, b"x11", False)  # the window is there as before
        gui.destroy(plugin.handle)
        assert not other.extension("gui", GUI).supported(other.handle, b"webview", False)
    clap.write_bundle({"slap": load_preset("slap")}, tmp_path / "plain")
    with closing(Plugin(tmp_path / "plain", web=True)) as plain:
        assert plain.extension("webview/3", WEBVIEW).uri(plain.handle, None, 0) <= 0
        assert not plain.extension("gui", GUI).supported(plain.handle, b"webview", False)


def test_an_export_with_a_page_is_replaced_by_another(folder: Path) -> None:
    assert clap.is_bundle(list(folder.iterdir()))


def test_it_tells_the_page_its_basses_values_and_what_its_strings_do(plugin: Plugin) -> None:
    gui = opened(plugin)
    assert say(plugin, SEE, 1)
    basses, first = plugin.sent
    assert np.frombuffer(basses[:8], np.int64)[0] == BASSES_TOLD
    names = [line.split("\t") for line in basses[8:].decode().splitlines()]
    assert names == [[name, load_preset(name).name] for name in BASSES]
    assert np.frombuffer(first[:8], np.int64)[0] == SEEN
    assert say(plugin, NOTE, 1, 0, 33, 0.9)
    sound = play(plugin, 20)
    head, look = seen(plugin)
    assert head["rate"] == plugin.rate and not head["side"]
    assert [plugin.value(k) for k in range(len(PARAMETERS))] == head["values"].tolist()
    strings = len(load_preset("jazz-finger").strings)
    offset = LOOK.fields["string"][1] if LOOK.fields else 0
    assert len(look) == offset + strings * STRING_LOOK.itemsize
    held = np.frombuffer(look[offset:], STRING_LOOK)
    assert held["fret"][0] == 5 and held["key"][0] == 33 and held["sight"]["slot"]["on"][0].any()
    assert np.abs(sound).max() > 0.02
    gui.destroy(plugin.handle)
    before = seen(plugin)[1]
    play(plugin, 20)
    assert seen(plugin)[1] == before, "a closed page has looks taken"


def test_what_is_done_on_the_page_is_told_to_the_host(plugin: Plugin) -> None:
    tone, action = NUMBERS["tone"], NUMBERS["action"]
    for phase in (BEGIN, MOVED, END):
        assert say(plugin, MOVE, tone, 0.5, phase)
    assert plugin.value(tone) == 0.5
    play(plugin, 1)
    assert plugin.gestures == [(tone, GESTURE_BEGIN), (tone, GESTURE_END)] and (tone, 0.5) in plugin.told
    for phase in (BEGIN, MOVED, END):
        assert say(plugin, MOVE, action, 99.0, phase)
    assert plugin.value(action) == PARAMETERS[action].most
    assert say(plugin, UNDO) and plugin.value(action) == 0.0
    assert say(plugin, UNDO) and plugin.value(tone) == 0.0
    assert say(plugin, SWAP) and seen(plugin)[0]["side"] == 1


def test_a_page_that_is_closed_lets_go(plugin: Plugin) -> None:
    """Of keys that are held, and of a slider in the middle of a move."""
    tone, gui = NUMBERS["tone"], opened(plugin)
    assert (
        say(plugin, NOTE, 1, 0, 33, 0.9) and say(plugin, MOVE, tone, 0.0, BEGIN) and say(plugin, MOVE, tone, 0.5, MOVED)
    )
    sound = play(plugin, 40)
    gui.destroy(plugin.handle)
    ended = play(plugin, 40)
    assert np.abs(ended[-BLOCK:]).max() < 0.01 * np.abs(sound[-BLOCK:]).max()
    assert plugin.gestures == [(tone, GESTURE_BEGIN), (tone, GESTURE_END)] and plugin.value(tone) == 0.5


def test_what_it_does_not_understand_changes_nothing(plugin: Plugin) -> None:
    wrong: list[tuple[float, ...]] = [
        (), (5.0,), (-1.0,), (0.5,), (np.nan,), (SEE,), (MOVE, 0, 0), (MOVE, -1, 0, MOVED), (MOVE, 99, 0, MOVED),
        (MOVE, 0, np.nan, MOVED), (MOVE, 0, np.inf, MOVED), (MOVE, 0, 0, 3), (MOVE, 0.5, 0, MOVED), (UNDO, 0),
        (NOTE, 1, 0, 128, 1), (NOTE, 1, 0, -1, 1), (NOTE, 1, 64, 33, 1), (NOTE, 1, -2, 33, 1), (NOTE, 1, 0, 33, 1.5),
        (NOTE, 1, 0, 33, np.nan), (NOTE, 1, 0, 33, 1, 0),
    ]  # fmt: skip
    before = [plugin.value(k) for k in range(len(PARAMETERS))]
    for numbers in wrong:
        assert not say(plugin, *numbers), numbers
    receive = plugin.extension("webview/3", WEBVIEW).receive
    assert not any(receive(plugin.handle, bytes(n), n) for n in (1, 7, 9, 33))
    assert not plugin.sent and [plugin.value(k) for k in range(len(PARAMETERS))] == before
    assert not play(plugin, 8).any()


def play(plugin: Plugin, blocks: int) -> Floats:
    return np.concatenate([plugin.block(BLOCK) for _ in range(blocks)])


class View:
    """A page in a browser, which a host passes messages of; the plugin plays meanwhile."""

    def __init__(self, driver: Any, plugin: Plugin, place: Path) -> None:
        self.driver, self.plugin, self.peak = driver, plugin, 0.0
        place.write_text(HOST, "utf-8")
        driver.get(place.as_uri())
        driver.execute_script("document.getElementById('view').src = arguments[0]", address(plugin))

    def pass_on(self) -> None:
        """Passes on what the page has said, and what the plugin answers."""
        receive = self.plugin.extension("webview/3", WEBVIEW).receive
        for text in self.driver.execute_script("return said.splice(0)"):
            data = base64.b64decode(text)
            assert receive(self.plugin.handle, data, len(data)), np.frombuffer(data)
        answers = [base64.b64encode(data).decode() for data in self.plugin.sent]
        self.plugin.sent.clear()
        self.driver.execute_script("tell(arguments[0])", answers)
        self.peak = float(np.abs(play(self.plugin, 2)).max())
        self.plugin.work()

    def run(self, script: str, *arguments: Any) -> Any:
        """Runs a script in the page."""
        self.driver.switch_to.frame("view")
        try:
            return self.driver.execute_script(script, *arguments)
        finally:
            self.driver.switch_to.default_content()

    def until(self, condition: Callable[[], Any]) -> Any:
        """Passes messages on until a condition holds; returns its value."""
        for _ in range(round(20 * PATIENCE)):
            self.pass_on()
            if found := condition():
                return found
        raise AssertionError("the page did not get there")


def test_a_browser_shows_it_and_edits_by_it(plugin: Plugin, tmp_path: Path) -> None:
    opened(plugin)
    with chromium(tmp_path / "profile", loggingPrefs={"browser": "ALL"}) as driver:
        view = View(driver, plugin, tmp_path / "host.html")
        text = "return [...document.getElementById('bass').options].map(option => option.text)"
        view.until(lambda: view.run("return plugin?.name") == "jazz-finger")
        assert view.run(text) == [load_preset(name).name for name in BASSES]
        down = """document.querySelector('#neck [data-string="0"][data-fret="3"]').dispatchEvent(
            new KeyboardEvent("keydown", {key: "Enter", bubbles: true}))"""
        view.run("document.getElementById('force').value = 127; " + down)
        view.until(lambda: view.peak > 0.05)
        view.until(lambda: view.run("return see.view && see.read(0, 0, 'on') + see.read(0, 1, 'on') > 0"))
        view.until(lambda: view.run("return see.note.string === 0 && see.note.fret === 3 && see.note.contacts.length"))
        view.until(lambda: view.run("return document.querySelectorAll('#neck .on[data-string=\"0\"]').length"))
        view.run(down.replace("keydown", "keyup"))
        view.until(lambda: not view.run("return document.querySelectorAll('#neck .on').length"))
        slide = """const slider = document.getElementById(arguments[0]); slider.value = arguments[1];
            slider.dispatchEvent(new Event('input')); slider.dispatchEvent(new Event('change'))"""
        view.run(slide, "knob-action", 0.5)
        view.until(lambda: plugin.value(NUMBERS["action"]) == pytest.approx(0.5, abs=0.01))
        plugin.set(NUMBERS["tone"], -0.5)
        view.until(lambda: abs(float(view.run("return $('knob-tone').value")) + 0.5) < 0.01)
        view.run("[...document.querySelectorAll('#ways button')].find(b => b.textContent.startsWith('Palm')).click()")
        view.until(lambda: view.run("return document.querySelectorAll('#ways [aria-pressed=true]').length"))
        view.run("$('bass').selectedIndex = 1; $('bass').dispatchEvent(new Event('change'))")
        view.until(lambda: view.run("return plugin.name") == "fretless")
        assert plugin.value(NUMBERS["bass"]) == 1 and view.run("return $('bass').value") == "fretless"
        view.until(lambda: view.run("return document.getElementById('neck').classList.contains('fretless')"))
        assert not [entry for entry in driver.get_log("browser") if entry["level"] == "SEVERE"]
