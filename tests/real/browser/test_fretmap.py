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
