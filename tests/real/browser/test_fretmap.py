"""The fret map on the page: two set-ups beside each other."""

from __future__ import annotations

from typing import Any

from support.browser import errors, open_page, seen_by, wait

CELLS = (
    "const all = (e, selector) => [...e.querySelectorAll(selector)];"
    "return all(document, '#maps table').map(table =>"
    " all(table, 'tbody tr').map(row => all(row, 'td').map(cell => cell.textContent)))"
)


def map_neck(page: Any, count: int) -> list[list[list[str]]]:
    """Maps the neck, which makes `count` maps; returns their cells, the highest string first."""
    page.find_element("id", "map-neck").click()
    return mapped(page, count)


def mapped(page: Any, count: int) -> list[list[list[str]]]:
    """The cells of `count` maps, once the newest one is made."""
    wait(lambda: page.execute_script("return $('map-neck').textContent") == "Map the neck")
    found: list[list[list[str]]] = page.execute_script(CELLS)
    assert len(found) == count
    return found


def test_a_lower_action_is_mapped_beside_the_preset(browser: Any, whole: str) -> None:
    from selenium_axe_python import Axe

    open_page(browser, whole)
    browser.execute_script("$('map-fold').open = true")
    (first,) = map_neck(browser, 1)
    assert len(first) == 4 and {len(row) for row in first} == {21}
    assert not any("→" in cell for row in first for cell in row)
    browser.execute_script("onBench(() => bench().setAll({action: 0.7 - bench().controls.get('action').own}))")
    lower, again = map_neck(browser, 2)
    assert again == first
    assert lower[0][9] == "→20"
    assert 20 < sum(cell.isdigit() for row in lower for cell in row) < sum(c.isdigit() for row in first for c in row)
    captions = browser.execute_script("return [...document.querySelectorAll('#maps caption')].map(c => c.textContent)")
    assert "Action" in captions[0] and "Action" not in captions[1]
    for scheme in ("light", "dark"):
        with seen_by(browser, prefers_color_scheme=scheme):
            axe = Axe(browser)
            axe.inject()
            found = axe.run(context="'#map'")
            assert not found["violations"], axe.report(found["violations"])
    assert not errors(browser)


def test_a_second_press_stops_the_map(browser: Any, whole: str) -> None:
    open_page(browser, whole)
    browser.execute_script("$('map-fold').open = true; $('map-neck').click(); $('map-neck').click()")
    assert browser.execute_script("return [$('map-neck').textContent, $('map-text').textContent]") == [
        "Map the neck",
        "",
    ]
    assert len(map_neck(browser, 1)) == 1
    assert not errors(browser)


# Maps with so many cores; returns the cells, the workers begun and those left
WITH_CORES = """
const [cores, done] = arguments, begun = [], left = new Set(), own = Worker;
Object.defineProperty(navigator, "hardwareConcurrency", {value: cores, configurable: true});
window.Worker = class extends own {
  constructor(...how) { super(...how); begun.push(this); left.add(this); }
  terminate() { left.delete(this); super.terminate(); }
};
$("map-neck").click();
const wait = setInterval(() => {
  if ($("map-neck").textContent !== "Map the neck") return;
  clearInterval(wait);
  window.Worker = own;
  const cells = [...document.querySelector("#maps table").querySelectorAll("td")].map(cell => cell.textContent);
  done([cells, begun.length, left.size]);
}, 50);
"""


def test_it_is_the_same_map_by_one_worker_or_several(browser: Any, whole: str) -> None:
    """They are of half the cores, and all end with the map, which costs the bench no time."""
    open_page(browser, whole)
    browser.execute_script("$('map-fold').open = true; PAGE.map.seconds = 0.05")
    alone, *workers = browser.execute_async_script(WITH_CORES, 2)
    assert workers == [1, 0] and any(cell.isdigit() for cell in alone)
    assert browser.execute_async_script(WITH_CORES, 7) == [alone, 3, 0]
    assert browser.execute_async_script(WITH_CORES, 64) == [alone, 4, 0]
    assert not errors(browser)


def test_a_high_seventh_fret_shows(browser: Any, whole: str) -> None:
    """However soon it is mapped: every string pressed below it lies on it, and notes above it are as before."""
    open_page(browser, whole)
    browser.execute_script("$('map-fold').open = true; PAGE.map.seconds = 0.05")
    (before,) = map_neck(browser, 1)
    browser.execute_script("onBench(() => bench().setAll({fret: 7, fret_height: 0.3})); $('map-neck').click()")
    high, again = mapped(browser, 2)
    assert again == before
    assert [row[6] for row in high] == ["→7"] * 4 and not any("→" in cell for row in before for cell in row)
    assert [row[8:] for row in high] == [row[8:] for row in before]
    said = "return [$('maps').querySelector('td.choked').title, $('maps').querySelector('caption').textContent]"
    assert browser.execute_script(said) == [
        "G string, fret 6: frets out, it lies on fret 7",
        "Jazz bass, fingers, Fret 7, Fret height +0.30 mm",
    ]
    assert not errors(browser)
