"""Browsers without a window: Chromium through its driver, Firefox through its own protocol."""

from __future__ import annotations

import base64
import functools
import http.server
import io
import json
import os
import re
import shutil
import subprocess
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from livebass.lab.bench.jack import end_process
from support.jack import wait_for as wait
from support.needs import missing, package, tool

PATIENCE = 120.0  # s that a test waits for a page; machines of checks are slow and busy
# Makes the exports of the page's modules, which leave no global names, available to a test's scripts; messages stay.
# Bytes go to a test by `inBase64`
INSIDE = 'dispatchEvent(new CustomEvent("livebass", {detail: all => { Object.assign(globalThis, all); }}));'
INSIDE += "clearTimeout(saying.timer); saying.lasts = 1e9; globalThis.inBase64 = bytes => { let text = ''; "
INSIDE += "for (let k = 0; k < bytes.length; k += 32768) text += String.fromCharCode(...bytes.subarray(k, k + 32768)); "
INSIDE += "return btoa(text); };"
# What the page copies is kept in `copied`
COPIED = "Object.defineProperty(navigator, 'clipboard', {value: {writeText: async text => { window.copied = text; }}})"
# How a link ends that was made on the page's chosen bass
MADE_HERE = "return `made=${chosenBass().made}&revision=${chosenBass().revision}`"
# A function of the page: plays a score, and returns the samples in base64
OFFLINE = """
(async (name, score, frames, rate) => {
  while (!player.ready) await new Promise(done => setTimeout(done, 20));
  const context = new OfflineAudioContext(1, frames, rate);
  const node = await player.makeNode(context, {bass: await player.build(name, rate), score, channels: 1});
  node.connect(context.destination);
  return inBase64(new Uint8Array((await context.startRendering()).getChannelData(0).buffer));
})
"""

# Keeps the page's saved files, as [blob, name], instead of downloading them
SAVED = """
window.saved = [];
const blobs = new Map(), make = URL.createObjectURL;
URL.createObjectURL = blob => {
  const address = make.call(URL, blob);
  blobs.set(address, blob);
  return address;
};
HTMLAnchorElement.prototype.click = function () { saved.push([blobs.get(this.href), this.download]); };
"""


@contextmanager
def chromium(profile: Path, **capabilities: Any) -> Iterator[Any]:
    """A Chromium driver; both end by process id. Skips the test if there is none."""
    places = [tool(name, "BROWSER") for name in ("chromium", "chromedriver")]
    package("selenium", "BROWSER")
    from selenium import webdriver

    options = webdriver.ChromeOptions()
    options.binary_location = places[0]
    for option in (
        "headless=new", "no-sandbox", "disable-gpu", "no-first-run", "disable-background-networking",
        "disable-component-update", "disable-sync", "disable-dev-shm-usage", f"user-data-dir={profile}",
    ):  # fmt: skip
        options.add_argument(f"--{option}")
    for name, value in capabilities.items():
        options.set_capability(f"goog:{name}", value)
    driver = webdriver.Chrome(options, webdriver.ChromeService(places[1]))
    try:
        driver.set_page_load_timeout(PATIENCE)
        driver.set_script_timeout(PATIENCE)
        yield driver
    finally:
        driver.quit()


class Firefox:
    """A Firefox controlled by WebDriver BiDi over a web socket."""

    def __init__(self, socket: Any) -> None:
        self.socket, self.number = socket, 0
        self.ask("session.new", capabilities={})
        self.context = self.ask("browsingContext.getTree")["contexts"][0]["context"]

    def ask(self, method: str, **parameters: Any) -> Any:
        """Sends a command; returns its result."""
        self.number += 1
        self.socket.send(json.dumps({"id": self.number, "method": method, "params": parameters}))
        while (answer := json.loads(self.socket.recv())).get("id") != self.number:
            pass
        assert answer["type"] == "success", answer
        return answer["result"]

    def get(self, url: str) -> None:
        self.ask("browsingContext.navigate", context=self.context, url=url, wait="complete")

    def run(self, script: str) -> str:
        """Returns the text to which the promise `script` resolves."""
        found = self.ask("script.evaluate", expression=script, target={"context": self.context}, awaitPromise=True)
        assert found["type"] == "success", found
        return str(found["result"]["value"])


@contextmanager
def firefox(profile: Path) -> Iterator[Firefox]:
    """A Firefox, ended by its process id. Skips the test if there is none."""
    place = shutil.which("firefox-esr") or shutil.which("firefox")
    if not place:
        missing("Firefox", "firefox-esr", "BROWSER")
    websocket = package("websocket", "BROWSER")

    profile.mkdir()
    with subprocess.Popen(
        [place, "--headless", "--no-remote", "--profile", profile, "--remote-debugging-port", "0", "about:blank"],
        stderr=subprocess.PIPE, stdout=subprocess.DEVNULL, text=True, env=os.environ | {"HOME": str(profile)},
    ) as process:  # fmt: skip
        try:
            assert process.stderr
            address = next(m[1] for line in process.stderr if (m := re.search(r"BiDi listening on (ws://\S+)", line)))
            threading.Thread(target=process.stderr.read, daemon=True).start()  # discards its output
            socket = websocket.create_connection(f"{address}/session", timeout=PATIENCE, suppress_origin=True)
            yield Firefox(socket)
            socket.close()
        finally:
            end_process(process, 10.0)


@contextmanager
def serve(folder: Path, port: int = 0) -> Iterator[str]:
    """Serves a folder on this machine while the block lasts; gives the address. `port` 0: any free one."""

    class Quiet(http.server.SimpleHTTPRequestHandler):
        def log_message(self, *_: Any) -> None:
            pass

    with http.server.ThreadingHTTPServer(("127.0.0.1", port), functools.partial(Quiet, directory=folder)) as server:
        threading.Thread(target=server.serve_forever, daemon=True).start()
        yield f"http://127.0.0.1:{server.server_port}"
        server.shutdown()


def errors(driver: Any) -> list[dict[str, Any]]:
    """The errors that pages of Chromium have logged since the last look at its log."""
    return [line for line in driver.get_log("browser") if line["level"] == "SEVERE"]


def open_page(driver: Any, address: str) -> None:
    """Opens the page of an export anew, ready to start and open to scripts."""
    driver.get("about:blank")
    driver.get(address)
    look_inside(driver)


def look_inside(driver: Any) -> None:
    """Opens a page that has just been loaded to scripts, once it is ready to start."""
    driver.execute_script(INSIDE)
    wait(lambda: driver.execute_script("return player.ready"))


def start_sound(driver: Any) -> None:
    """Makes a page sound; browsers want a gesture before."""
    driver.find_element("css selector", "h1").click()
    driver.execute_script("player.sound()")
    wait(lambda: driver.execute_script("return player.playing"))


def stop_clock(driver: Any) -> None:
    """Opens the page anew with an audio thread whose clock stands: on any machine it sees no load."""
    source = "const own = AudioWorklet.prototype, add = own.addModule; own.addModule = async function (address) {"
    source += " await add.call(this, 'data:text/javascript,Date.now = () => 0'); return add.call(this, address); }"
    added = driver.execute_cdp_cmd("Page.addScriptToEvaluateOnNewDocument", {"source": source})
    driver.refresh()
    look_inside(driver)
    driver.execute_cdp_cmd("Page.removeScriptToEvaluateOnNewDocument", added)


@contextmanager
def seen_by(driver: Any, **features: str) -> Iterator[None]:
    """Makes the page see media features of a user, such as forced_colors="active"."""
    given = [{"name": name.replace("_", "-"), "value": value} for name, value in features.items()]
    driver.execute_cdp_cmd("Emulation.setEmulatedMedia", {"features": given})
    try:
        yield
    finally:
        driver.execute_cdp_cmd("Emulation.setEmulatedMedia", {"features": []})


@contextmanager
def resize(driver: Any, width: int, height: int) -> Iterator[None]:
    """Makes the page see a window of a size in px."""
    sizes = {"width": width, "height": height, "deviceScaleFactor": 1, "mobile": width < 500}
    driver.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", sizes)
    try:
        fits = "return innerWidth === arguments[0] && $('neck').clientWidth === state.width"
        wait(lambda: driver.execute_script(fits, width))
        yield
    finally:
        driver.execute_cdp_cmd("Emulation.clearDeviceMetricsOverride", {})


def saved_file(driver: Any) -> tuple[io.BytesIO, str]:
    """The first of the files kept by SAVED, and its name."""
    data, name = driver.execute_async_script(
        "const [done] = arguments, reader = new FileReader();"
        "reader.onload = () => done([reader.result, saved[0][1]]); reader.readAsDataURL(saved[0][0])"
    )
    return io.BytesIO(base64.b64decode(data.partition(",")[2])), name
