"""A link of an earlier revision plays as it did, and one click takes the present bass."""

from __future__ import annotations

import base64
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from support.browser import chromium, look_inside, open_page, serve, wait

from livebass import load_preset
from livebass.plugin.instrument import image_file
from livebass.preset import revisions
from livebass.preset.load import _as_shipped
from livebass.web.export import export_page

EARLIER = {"neck.relief": "0.5 mm", "player.hardest": 2.5}
LINK = "like=slap&tone=-0.5&revision=1"
FILE = "const [done] = arguments; player.fileOf('slap').then(file => done(inBase64(new Uint8Array(file))))"


@pytest.fixture(scope="module")
def images(tmp_path_factory: pytest.TempPathFactory) -> tuple[dict[int, bytes], Path, Path]:
    """The images of slap's revisions, as if there were two; and a page in a folder, and in one file."""
    folder = tmp_path_factory.mktemp("revised")
    with pytest.MonkeyPatch.context() as patch:
        kept = {**revisions.revisions()["slap"], "revision": 2, "before": {"1": {"digest": "", "changed": EARLIER}}}
        made = revisions.revisions() | {"slap": kept}
        patch.setattr(revisions, "revisions", lambda: made)
        patch.setattr("livebass.web.export.revisions", lambda: made)
        _as_shipped.cache_clear()
        basses = {name: load_preset(name) for name in ("jazz-finger", "slap")}
        files = [export_page(basses, folder / name, single) for name, single in (("folder", False), ("single", True))]
        found = {number: image_file(load_preset(f"slap@{number}")) for number in (1, 2)}
    _as_shipped.cache_clear()
    return found, *files


@pytest.fixture(scope="module", params=["folder", "single"])
def opened(images: Any, request: Any, tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[Any, str]]:
    _, folder, single = images
    with chromium(tmp_path_factory.mktemp("profile")) as driver, serve(folder.parent) as address:
        yield driver, f"{address}/index.html" if request.param == "folder" else single.as_uri()


def open_link(driver: Any, address: str, link: str) -> str:
    """Opens a link; returns what the page says."""
    open_page(driver, f"{address}#{link}")
    return str(driver.execute_script("return $('said').textContent"))


def image(driver: Any) -> bytes:
    return base64.b64decode(driver.execute_async_script(FILE))


def newer(driver: Any) -> Any:
    return driver.find_element("id", "newer")


def test_an_earlier_revision_plays_until_the_present_one_is_taken(opened: Any, images: Any) -> None:
    (driver, address), (found, *_) = opened, images
    said = open_link(driver, address, LINK)
    assert "plays as it did: Update takes the new one" in said
    assert image(driver) == found[1] != found[2] and newer(driver).is_displayed()
    assert driver.execute_script("return location.hash") == "#like=slap&revision=1"
    driver.refresh()
    look_inside(driver)
    assert image(driver) == found[1]
    newer(driver).click()
    wait(lambda: driver.execute_script("return !building.now"))
    assert image(driver) == found[2] and not newer(driver).is_displayed()
    assert driver.execute_script("return location.hash") == "#like=slap"


def test_links_name_the_revision(opened: Any) -> None:
    driver, address = opened
    open_page(driver, address)
    shared = "const {benches} = globalThis; return benches.get('slap').bass.revision"
    assert driver.execute_script(shared) == 2
    said = open_link(driver, address, "like=slap&action=-0.2&revision=2&format=1")
    assert said == "The bass is as the link says." and not newer(driver).is_displayed()
