"""A tablature on the page: what it shows, plays and repeats; and one that the page's own server reads."""

from __future__ import annotations

import json
import urllib.error
import urllib.request
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from support.browser import chromium, open_page, wait
from support.command import Run
from support.tabs import as_gp5, beats, note, tab

from livebass.cli.hands import SOUND, Loader
from livebass.preset.load import load_preset
from livebass.tab.model import NATURAL, Tab
from livebass.tab.reading import Asked, arranged
from livebass.web.export import page_files
from livebass.web.serve import OPENS, PageServer
from livebass.web.tab import Opener, tab_data

RATE = 48000
LOAD = Loader(dict.fromkeys(SOUND))
SENT = """
  globalThis.sent = [];
  const send = player.send.bind(player);
  player.send = (time, midi, string, frame) => {
    sent.push([frame / player.context.sampleRate, ...midi]);
    send(time, midi, string, frame);
  };
"""


def song() -> Tab:
    """Four bars; the second has a hammer-on, a pop and a harmonic."""
    signs = note(3, 7, technique="pop"), note(2, 12, harmonic=NATURAL, node=12.0)
    piece = tab(
        beats(note(0, 3), note(0, 5)), beats(note(1, 5, hammer=True), note(1, 7), *signs),
        beats(note(2, 5)), beats(note(0, 0)), tuning=(26, 33, 38, 43), bpm=240.0,
    )  # fmt: skip
    piece.bars[1].name = "Riff"
    return piece


@pytest.fixture(scope="module")
def driver(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Any]:
    with chromium(tmp_path_factory.mktemp("chromium") / "profile") as driver:
        driver.set_window_size(1600, 1000)  # all frets are there
        yield driver


@pytest.fixture(scope="module")
def page(driver: Any) -> Iterator[str]:
    made = arranged(as_gp5(song()), Path("song.gp5"), Asked(), LOAD)
    data = {"tab": tab_data(made, "song.gp5", "jazz-finger"), "opens": OPENS}
    basses = {"jazz-finger": made.bass}
    files = page_files(basses, "live", more=data)
    with PageServer(files, opens=Opener(basses, files, LOAD).open) as server:
        yield server.address


def buttons(driver: Any) -> dict[str, Any]:
    return {button.text: button for button in driver.find_elements("css selector", "#tab button")}


def shown(driver: Any) -> list[str]:
    return str(driver.execute_script('return document.querySelector("#tab pre").textContent')).splitlines()


def marks(driver: Any) -> list[tuple[str, int, int]]:
    """(text, row, column) of each mark on the neck."""
    script = "m => [m.textContent, Number(m.style.gridRowStart), Number(m.style.gridColumnStart)]"
    found = driver.execute_script(f'return [...document.querySelectorAll(".due")].map({script})')
    return [tuple(mark) for mark in found]


def test_bars_are_shown_as_text_and_on_the_neck(driver: Any, page: str) -> None:
    open_page(driver, page)
    heads, *strings, _ = wait(lambda: shown(driver))
    assert heads.split() == ["1", "2", "Riff"] and [line[0] for line in strings] == ["G", "D", "A", "D"]
    assert strings[3].startswith("D |-3---------5-----") and "P7" in strings[0] and "h7" in strings[2]
    assert "<12>" in strings[1]
    assert marks(driver) == [("3", 4, 4), ("5", 4, 6)]
    buttons(driver)["›"].click()
    wait(lambda: shown(driver)[0].split()[0] == "2")
    assert marks(driver) == [("5", 3, 6), ("h7", 3, 8), ("P7", 1, 8), ("<12>", 2, 13)]


def test_a_loop_repeats_its_bars_at_its_tempo_and_a_pause_leaves_nothing(driver: Any, page: str) -> None:
    open_page(driver, page)
    driver.execute_script(SENT)
    driver.execute_script("""
      const [first, last, tempo] = document.querySelectorAll("#tab input");
      for (const [input, value, kind] of [[first, 2, "change"], [last, 2, "change"], [tempo, 125, "input"]]) {
        input.value = value;
        input.dispatchEvent(new Event(kind));
      }
    """)
    buttons(driver)["Play"].click()
    notes = "return sent.filter(m => (m[1] & 0xf0) === 0x90 && m[2] > 24 && m[2] < 110).map(m => [m[0], m[1], m[2]])"
    found = wait(lambda: len(got := driver.execute_script(notes)) >= 9 and got)
    assert [row[1:] for row in found[:5]] == [[0x92, 38], [0x92, 40], [0x90, 50], [0x91, 50], [0x92, 38]]
    assert found[4][0] - found[0][0] == pytest.approx(4 * 0.25 / 1.25, abs=0.03), "a bar of 240 beats a minute at 125 %"
    wait(lambda: driver.execute_script('return document.querySelectorAll(".due.now").length'))
    buttons(driver)["Pause"].click()
    ended = driver.execute_script("return sent")
    held: set[tuple[int, int]] = set()
    for _, status, *data in ended:
        if status & 0xF0 == 0x90:
            held.add((status & 15, data[0]))
        elif status & 0xF0 == 0x80:
            held.discard((status & 15, data[0]))
    assert not held and ended[-1][1:] == [0xB0, 127, 0]


def test_a_dropped_tablature_is_read_by_the_server(driver: Any, page: str, tmp_path: Path) -> None:
    open_page(driver, page)
    piece = tab(beats(note(0, 0), note(4, 2)), tuning=(21, 28, 33, 38, 43))
    (tmp_path / "low.gp5").write_bytes(as_gp5(piece))
    (tmp_path / "bad.gp5").write_bytes(as_gp5(piece)[:1000])
    field = driver.find_element("id", "song-file")
    field.send_keys(str(tmp_path / "low.gp5"))
    wait(lambda: "low.gp5" in driver.execute_script('return document.getElementById("tab").textContent'))
    assert driver.execute_script('return document.getElementById("bass").value') == "five-string-2"
    assert [line[0] for line in shown(driver)[1:-1]] == ["G", "D", "A", "E", "A"]
    wait(lambda: driver.execute_script("return player.next === undefined || player.next.name") is not False)
    field.send_keys(str(tmp_path / "bad.gp5"))
    wait(lambda: "bad.gp5: is damaged" in driver.find_element("id", "song-text").text)


def test_the_server_opens_files_for_its_own_page_only(page: str) -> None:
    own = {"Origin": page.rstrip("/")}
    for headers, data, status in [
        ({}, b"", 403), ({"Origin": "http://example.com"}, b"", 403), (own, b"hello", 422), (own, as_gp5(song()), 200),
    ]:  # fmt: skip
        request = urllib.request.Request(f"{page}{OPENS}?name=a.gp5", data, headers)
        try:
            with urllib.request.urlopen(request) as answer:
                assert answer.status == status and json.load(answer)["bass"] == "jazz-finger"
        except urllib.error.HTTPError as error:
            assert error.code == status
            assert status == 403 or error.read().decode() == "a.gp5: is not a tablature"


def test_a_page_is_exported_with_its_tablature_and_bass(run: Run, tmp_path: Path) -> None:
    (tmp_path / "song.gp5").write_bytes(as_gp5(song()))
    status, _, err = run("export", "web", "--tab", str(tmp_path / "song.gp5"), "-o", str(tmp_path / "page"), "--single")
    assert status == 0 and "plays track 1" in err, err
    html = (tmp_path / "page" / "livebass.html").read_text("utf-8")
    data = json.loads(html.split('id="page">')[1].split("</script>")[0])
    assert [bass["name"] for bass in data["basses"]] == ["jazz-finger"]
    assert [string["note"] for string in data["basses"][0]["strings"]] == [26, 33, 38, 43]
    assert data["tab"]["bars"][1] == [1.0, 2, "Riff"] and data["tab"]["strokes"][1] == [0.25, 0.5, 0, 5, "pluck"]
    status, _, err = run("export", "web", "--track", "2", "-o", str(tmp_path / "other"))
    assert status == 2 and "--track is for a --tab" in err


def test_the_bass_of_the_page_plays_a_tablature_in_its_tuning() -> None:
    basses = {"jazz-finger": load_preset("jazz-finger")}
    files: dict[str, bytes] = {}
    opener = Opener(basses, files, LOAD)
    assert opener.open(as_gp5(tab(beats(note(0, 3)))), "a.gp5")["bass"] == "jazz-finger" and not files
    assert opener.open(as_gp5(song()), "b.gp5")["shown"]["title"].endswith("D1 A1 D2 G2")
    assert opener.open(as_gp5(song()), "b.gp5")["bass"] == "jazz-finger-2" and len(files) == 1
