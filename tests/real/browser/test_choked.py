"""A note that frets out: the page says so, lights the fret that the string lies on, and draws it from there."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import pytest
from support.browser import chromium, open_page, start_sound, wait

from livebass import load_preset
from livebass.web.export import export_page

AT_REST = "return !building.now && !building.wanted && !player.next"
LOWEST_STRING = -1e3 * load_preset("jazz-finger").necks[0].fret_heights[11]  # mm of action
# Presses the G string at fret 9; keeps what flashes
PRESS = """
window.flashed = new Set();
const light = see.light.bind(see);
see.light = (hit, ...more) => { flashed.add(`${hit.string} ${hit.fret}`); light(hit, ...more); };
const cell = document.querySelector("button[data-string='3'][data-fret='9']");
press("test", +cell.dataset.note, 20, performance.now(), cell);
"""
# The height (m) at which the drawn string begins, and that of the crown of fret 20
DRAWN = """
let begins;
see.eachString(({string, fret, u}) => { if (string === 3 && fret === 9) [begins] = u; });
return [begins, chosenBass().strings[3].heights[19]];
"""


@pytest.fixture  # anew for each test: a string that still rings from another's notes repeats none
def page(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Any]:
    folder = tmp_path_factory.mktemp("choked")
    file = export_page({"jazz-finger": load_preset("jazz-finger")}, folder / "page", single=True)
    with chromium(folder / "profile", loggingPrefs={"browser": "ALL"}) as driver:
        open_page(driver, file.as_uri())
        start_sound(driver)
        yield driver


@pytest.mark.parametrize("action", [0.70, 0.55, 0.50])
def test_the_line_says_that_a_note_frets_out_and_on_which_fret(page: Any, action: float) -> None:
    page.execute_script("onBench(() => bench().setAll({action: arguments[0]}))", round(action - LOWEST_STRING, 2))
    wait(lambda: page.execute_script(AT_REST))
    assert page.execute_script("return $('bench-action').parentElement.querySelector('output').textContent") == (
        f"{action:.2f} mm"
    )
    page.execute_script(PRESS)
    says = "G string, fret 9 frets out: it lies on fret 20. Raise the action to free it."
    wait(lambda: page.execute_script("return $('seen').textContent") == says)
    assert "3 20" in page.execute_script("return [...flashed]")
    begins, crown = page.execute_script(DRAWN)
    assert begins == pytest.approx(crown, abs=5e-6)
    page.execute_script("release('test', performance.now())")
    page.execute_script("onBench(() => bench().reset())")
    wait(lambda: page.execute_script(AT_REST))
    page.execute_script("playSame()")
    same = "it lies on fret 20 before, 0 contacts now."
    wait(lambda: page.execute_script("return $('seen').textContent").endswith(same))
    page.execute_script(PRESS)
    wait(
        lambda: page.execute_script("return $('seen').textContent").startswith("G string, fret 9: it touches nothing.")
    )
    page.execute_script("release('test', performance.now())")
