"""Every slider of the page at both ends: what it shows is what plays, and a link made there opens and plays."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import pytest
from support.browser import COPIED, chromium, errors, open_page, start_sound, wait
from support.costs import quick

from livebass import load_preset
from livebass.preset.load import preset_names
from livebass.web.bench import Source
from livebass.web.export import export_page

# `toEnds(bass)`: moves each slider of the page as a hand does, to both ends and back; returns what each end shows, and
# what was made and sent there. `toEnd(bass, side)`: moves all of them to one end, and copies the link.
MOVE = """
const sent = [], {port} = player.node, post = port.postMessage.bind(port);
port.postMessage = (message, moved) => { if (message.parameter) sent.push(message.parameter); post(message, moved); };
const sleep = ms => new Promise(done => setTimeout(done, ms));
const rests = async () => {
  do await sleep(1); while (building.now || building.wanted || player.next || !player.playing);
};
const all = () => [...document.querySelectorAll('input[type="range"]')]
  .filter(e => !e.parentElement.hidden && !e.closest("#replay"));
const put = async (slider, value) => {
  slider.value = value;
  for (const kind of ["input", "change"]) slider.dispatchEvent(new Event(kind, {bubbles: true}));
  await rests();
};
const textOf = slider => slider.parentElement.querySelector("output").textContent;
const takenBy = async symbol => new Promise(done => {
  const changes = player.changes;
  player.on("playing", playing => { if (player.changes === changes) done(playing.values[symbol]); });
});
const choose = async bass => {
  chooseBass(bass);
  for (const symbol of CONTROLS) moveControl(symbol, PAGE.parameters[symbol].defaultValue);
  onBench(() => bench()?.reset());
  await rests();
};
window.toEnds = async bass => {
  const found = [];
  await choose(bass);
  for (const slider of all()) {
    const {id, value, dataset: {symbol}} = slider;
    for (const side of ["min", "max"]) {
      const wanted = slider[side];
      say("");
      sent.length = 0;
      await put(slider, wanted);
      const shown = {id, wanted: +wanted, value: +slider.value, text: textOf(slider), said: $("said").textContent};
      if (symbol) Object.assign(shown, {
        bench: bench().value(symbol), played: [...player.basses.values()].at(-1).label, link: bench().link(),
      });
      else if (CONTROLS.includes(id)) {
        const [kind, number, heard] = sent.at(-1), {event} = PAGE.parameters[id];
        Object.assign(shown, {sent: kind === event[0] && number === event[1] ? heard : undefined});
        if (["gain", "tone", "blend", "pluck_position"].includes(id)) shown.taken = await takenBy(id);
      }
      found.push(shown);
      await put(slider, symbol ? 0 : value);
    }
  }
  return found;
};
window.toEnd = async (bass, side) => {
  await choose(bass);
  for (const slider of all()) if (slider.id !== "gain") await put(slider, slider[side]);
  window.copied = "";
  $("link").click();
  while (!copied) await sleep(5);
  return [copied, bench().values, movedControls()];
};
window.hear = async () => {
  let peak = 0;
  player.on("report", told => { peak = Math.max(peak, told.peak); });
  const {note} = chosenBass().strings[0];
  press("test", note + 3, 100, performance.now());
  for (let k = 0; k < 500 && !(peak > 1e-5); k++) await sleep(10);
  release("test");
  return peak;
};
"""
SMOOTH = {"gain": 1e-3, "tone": 1e-6, "blend": 1e-6, "pluck_position": 1e-6}  # how near the audio thread's values are
QUICK = ("jazz-finger", "fretless")


@pytest.fixture(scope="module")
def page(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Any]:
    """A sounding page with all basses."""
    folder = tmp_path_factory.mktemp("ends")
    basses = {name: load_preset(name) for name in preset_names()}
    file = export_page(basses, folder / "page", True, sources={name: Source(name) for name in basses})
    with chromium(folder / "profile", loggingPrefs={"browser": "ALL"}) as driver:
        driver.home = file.as_uri()
        yield driver


def opened(page: Any, link: str = "") -> None:
    """Opens the page, with a link's text; it sounds."""
    open_page(page, f"{page.home}#{link}" if link else page.home)
    page.execute_script(COPIED)
    start_sound(page)
    page.execute_script(MOVE)


def run(page: Any, call: str, *given: Any) -> Any:
    """Returns what a function of the page promises."""
    return page.execute_async_script(f"const done = [...arguments].pop(); {call}(...arguments).then(done)", *given)


@pytest.mark.parametrize("name", quick(preset_names(), QUICK))
def test_each_slider_plays_what_it_shows_at_both_ends(page: Any, name: str) -> None:
    opened(page)
    found = run(page, "toEnds", name)
    assert {"gain", "tone", "cabinet", "force", "hand_position", "pull-apex"} < {one["id"] for one in found}
    for one in found:
        assert one["text"] and not any(bad in one["text"] for bad in ("NaN", "undefined", "null", "Infinity")), one
        if "bench" in one:
            assert abs(one["bench"] - one["value"]) < 1e-9 and one["played"] == one["link"], one
            assert one["value"] == one["wanted"] or " stops at " in one["said"], one
        else:
            assert one["value"] == one["wanted"], one
            assert one.get("sent", one["value"]) == one["value"], one
        if "taken" in one:
            assert one["taken"] == pytest.approx(one["value"], abs=SMOOTH[one["id"]]), one
    assert not errors(page)


def test_the_hand_stays_on_the_neck(page: Any) -> None:
    """A bass with fewer frets takes the hand down to its last one."""
    opened(page)
    hand = "return [+$('hand_position').value, +$('hand_position').max, $('hand_position-text').textContent]"
    page.execute_script("chooseBass('six-string'); moveControl('hand_position', 24)")
    assert page.execute_script(hand) == [24, 24, "fret 24"]
    page.execute_script("chooseBass('jazz-finger')")
    assert page.execute_script(hand) == [20, 20, "fret 20"]
    page.execute_script("chooseBass('six-string')")
    assert page.execute_script(hand) == [20, 24, "fret 20"]
    assert not errors(page)


@pytest.mark.parametrize("side", ["min", "max"])
@pytest.mark.parametrize("name", quick(preset_names(), QUICK))
def test_a_link_made_at_the_ends_opens_and_plays(page: Any, name: str, side: str) -> None:
    opened(page)
    link, values, played = run(page, "toEnd", name, side)
    assert len(values) > 5 and len(played) > 5
    opened(page, link)
    assert page.execute_script("return [$('bass').value, bench().values, movedControls()]") == [name, values, played]
    assert "as the link says" in page.find_element("id", "said").text
    wait(lambda: page.execute_script("return player.playing") == name)
    assert run(page, "hear") > 1e-5
    assert not errors(page)
