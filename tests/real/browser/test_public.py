"""A page on a public server: its address in all that others get, its use offline, and its element for articles."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from support.browser import COPIED, MADE_HERE, open_page, serve, start_sound, wait

from livebass import load_preset
from livebass.web.bench import Source
from livebass.web.export import export_page, is_page
from livebass.web.link import check_link
from livebass.web.modules import text
from livebass.web.public import ELEMENT

ADDRESS = "https://example.org/bass/"


def export(folder: Path, single: bool, **more: Any) -> Path:
    return export_page({"slap": load_preset("slap")}, folder, single, sources={"slap": Source("slap")}, more=more)


def copied_link(driver: Any, page: str) -> str:
    open_page(driver, page)
    driver.execute_script(f"{COPIED}; navigator.share = undefined; onBench(() => bench().setAll({{action: -0.5}}));")
    driver.execute_script("$('link').click()")
    return str(wait(lambda: driver.execute_script("return window.copied")))


def test_a_public_address_is_in_link_poster_and_previews(browser: Any, tmp_path: Path) -> None:
    page = export(tmp_path / "page", True, address=ADDRESS)
    html = page.read_text("utf-8")
    for tag in (f'<meta property="og:url" content="{ADDRESS}">', '<meta name="description" content="An '):
        assert html.count(tag) == 1
    link = copied_link(browser, page.as_uri())
    assert link == f"{ADDRESS}#like=slap&action=-0.5&" + browser.execute_script(MADE_HERE)
    assert browser.find_element("id", "said").text == "The link is copied."
    browser.execute_script(
        "window.drawn = []; pictures.poster = (sheet, title, foot) => { drawn.push(foot); };"
        "$('picture').disabled = false; see.note ||= {string: 0, fret: 3}; $('picture').click()"
    )
    assert browser.execute_script("return drawn[0]").endswith(f"not recorded. {ADDRESS}")


def test_without_one_a_link_is_a_fragment_with_words_how_to_open_it(browser: Any, tmp_path: Path) -> None:
    page = export(tmp_path / "page", True)
    assert "og:" not in page.read_text("utf-8")
    link = copied_link(browser, page.as_uri())
    assert link == "like=slap&action=-0.5&" + browser.execute_script(MADE_HERE)
    check_link(link, {"slap": load_preset("slap")}, {"slap": Source("slap")})
    said = browser.find_element("id", "said").text
    assert "Others open it with livebass page --link and the link in quotes" in said and len(said) < 130


def test_what_other_sites_add_to_an_address_is_ignored_and_told(browser: Any, tmp_path: Path) -> None:
    page = export(tmp_path / "page", True)
    open_page(browser, f"{page.as_uri()}?fbclid=IwAR&utm_medium=x#like=slap&action=-0.5&utm_source=mail")
    assert browser.execute_script("return bench().values.action") == -0.5
    said = browser.find_element("id", "said").text
    assert said == "The bass is as the link says. Ignored: utm_source, fbclid, utm_medium."


def test_an_export_plays_offline_once_it_was_open(browser: Any, tmp_path: Path) -> None:
    export(tmp_path / "page", False)
    with serve(tmp_path / "page") as address:
        open_page(browser, f"{address}/?fbclid=1")
        wait(lambda: browser.execute_async_script("navigator.serviceWorker.ready.then(() => arguments[0](true))"))
    open_page(browser, f"{address}/#like=slap&action=-0.5")
    assert browser.execute_script("return bench().values.action") == -0.5
    start_sound(browser)
    assert browser.execute_script("return player.playing") == "slap"
    export(tmp_path / "page", False, address=ADDRESS)
    with serve(tmp_path / "page", int(address.rpartition(":")[2])):
        open_page(browser, f"{address}/")
        assert browser.execute_script("return PAGE.address") == ADDRESS, "a newer export is seen at once"


@pytest.mark.parametrize("single", [False, True])
def test_an_article_shows_the_page_by_an_element(browser: Any, tmp_path: Path, single: bool) -> None:
    export(tmp_path / "bass", single)
    (tmp_path / "bass" / ELEMENT).write_text(text(ELEMENT))
    assert is_page(list((tmp_path / "bass").iterdir()))
    name = "livebass.html" if single else ""
    (tmp_path / "article.html").write_text(
        '<!doctype html><title>a</title><script src="bass/embed.js"></script>'
        f'<live-bass page="{name}" link="like=slap&amp;action=-0.5"></live-bass>'
    )
    with serve(tmp_path) as address:
        browser.get(f"{address}/article.html")
        browser.switch_to.frame(browser.find_element("css selector", "live-bass iframe"))
        wait(lambda: browser.execute_script("return document.body.classList.contains('embed')"))
        assert browser.execute_script("return location.href") == f"{address}/bass/{name}?embed#like=slap&action=-0.5"
        assert browser.execute_script("return document.documentElement.clientHeight") == 340
        browser.switch_to.default_content()


def test_a_chosen_bass_without_a_bench_is_there_again_after_a_reload(browser: Any, tmp_path: Path) -> None:
    capo = load_preset("slap", capo=2)
    page = export_page({"slap": load_preset("slap"), "mine": capo, "other": capo}, tmp_path / "page", True).as_uri()
    open_page(browser, page)
    browser.execute_script("chooseBass('other')")
    browser.refresh()
    open_page(browser, page)
    assert browser.execute_script("return [$('bass').value, see.bass.name]") == ["other", "other"]
    browser.execute_script("chooseBass('slap')")
    browser.refresh()
    open_page(browser, page)
    assert browser.execute_script("return $('bass').value") == "slap"
