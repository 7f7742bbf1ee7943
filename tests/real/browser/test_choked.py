"""A note that frets out: the page says so, lights the fret that the string lies on, and draws the string over it."""

from __future__ import annotations

import re
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
const [fret] = arguments;
window.flashed = new Set();
const light = see.light.bind(see);
see.light = (hit, ...more) => { flashed.add(`${hit.string} ${hit.fret}`); light(hit, ...more); };
const cell = document.querySelector(`button[data-string='3'][data-fret='${fret}']`);
press("test", +cell.dataset.note, 20, performance.now(), cell);
"""
WITH = r"it lies on fret 20(, with \d+ contacts?)?"
SAYS = re.compile(rf"G string, fret 9 frets out: {WITH}, and dies away at D♯4\. Raise the action to free it\.")
SAME = re.compile(rf"{WITH} before, 0 contacts now\.$")
# The height (m) at which the drawn string begins, and that of a fret's crown
DRAWN = """
const [pressed, on] = arguments;
let begins;
see.eachString(({string, fret, u}) => { if (string === 3 && fret === pressed) [begins] = u; });
return [begins, chosenBass().strings[3].heights[on - 1]];
"""

# All that the page says, to eyes and ears
SAID = """
const said = [...document.querySelectorAll("*")].flatMap(e => [e.ariaLabel, e.title]);
return [document.body.innerText, ...said.filter(Boolean)].join("\\n");
"""
NAMED = re.compile(r".*\bfrets? \d.*", re.IGNORECASE)


@pytest.fixture  # anew for each test: a string that still rings from another's notes repeats none
def page(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Any]:
    folder, name = tmp_path_factory.mktemp("choked"), getattr(request, "param", "jazz-finger")
    file = export_page({name: load_preset(name)}, folder / "page", single=True)
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
    page.execute_script(PRESS, 9)
    wait(lambda: SAYS.fullmatch(page.execute_script("return $('seen').textContent")))
    assert "3 20" in page.execute_script("return [...flashed]")
    begins, crown = page.execute_script(DRAWN, 9, 9)
    assert begins == pytest.approx(crown, abs=5e-6)
    page.execute_script("release('test', performance.now())")
    page.execute_script("onBench(() => bench().reset())")
    wait(lambda: page.execute_script(AT_REST))
    page.execute_script("playSame()")
    wait(lambda: SAME.search(page.execute_script("return $('seen').textContent")))
    page.execute_script(PRESS, 9)
    wait(
        lambda: page.execute_script("return $('seen').textContent").startswith("G string, fret 9: it touches nothing.")
    )
    page.execute_script("release('test', performance.now())")


def test_stories_and_friends_say_it_too(page: Any) -> None:
    action = round(0.7 - LOWEST_STRING, 2)
    step = {"says": "Low: {hits}.", "bass": "jazz-finger", "notes": [[3, 9, 20]], "values": {"action": action}}
    page.execute_async_script(
        "const [step, done] = arguments; showStep({name: 'low', steps: [step]}, 0).then(done)", step
    )
    assert re.fullmatch(rf"Low: {WITH}\.", page.execute_script("return $('seen').textContent"))
    open_page(page, page.current_url.split("#")[0] + f"#like=jazz-finger&action={action}&moment=3.52.20.20000")
    said = re.compile(rf"A friend's note, in its first 0.1 s: {WITH}\.")
    wait(lambda: said.fullmatch(page.execute_script("return $('seen').textContent")))


@pytest.mark.parametrize("page", ["fretless"], indirect=True)
def test_over_a_bare_board_it_says_the_place(page: Any) -> None:
    bare = load_preset("fretless").necks[3]
    pressed, place = (bare.fret_text(fret, board="at") for fret in (15, 20))
    page.execute_script("onBench(() => bench().setAll({action: -1.15}))")
    wait(lambda: page.execute_script(AT_REST))
    page.execute_script("state.from = 8; showNeck()")
    page.execute_script(PRESS, 15)
    says = f"G string {pressed} frets out: it lies on {bare.fret_text(20)}"
    wait(lambda: page.execute_script("return $('seen').textContent").startswith(says))
    flashed = page.execute_script("return [...flashed].map(hit => hit.split(' ').map(Number))")
    assert any(hit == [3, pytest.approx(bare.fret_positions[19], abs=1e-6)] for hit in flashed), (place, flashed)
    begins, board = page.execute_script(DRAWN, 15, 20)
    assert begins == pytest.approx(board, abs=5e-6)
    page.execute_script("release('test', performance.now())")
    label = "return document.querySelector(\"button[data-string='3'][data-fret='15']\").ariaLabel"
    assert page.execute_script(label) == f"G string {pressed}, A♯3"
    page.execute_script("PAGE.map.seconds = 0.02; $('map-fold').open = true; $('map-neck').click()")
    wait(lambda: page.execute_script("return document.querySelectorAll('#maps td').length"))
    titles = page.execute_script("return [...document.querySelectorAll('#maps td')].map(cell => cell.title)")
    assert f"G string {pressed}: frets out, it lies on {bare.fret_text(20)}" in titles
    assert not [
        line for line in NAMED.findall("\n".join([page.execute_script(SAID), *titles])) if "gap under" not in line
    ]
