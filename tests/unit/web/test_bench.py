"""The page's bench, in node: what it writes of its sliders, and the basses and the sound that they make."""

from __future__ import annotations

import json
import random
import re
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from support import node
from support.costs import quick
from support.presets import load_text
from support.wasm import RATE

from livebass import QUALITIES, load_preset, render_to_array, score_of
from livebass.engine.render import mix_strings
from livebass.model.instrument import Effects
from livebass.plugin.instrument import image_file
from livebass.preset.build import PresetError
from livebass.preset.load import preset_names
from livebass.preset.revisions import present
from livebass.rows.techniques import SLIDER_ROWS
from livebass.web.bench import Source, bench
from livebass.web.link import check_link

BASSES = ("jazz-finger", "slap", "fretless", "paper-bass", "five-string-active")
ON_PAGE = {name: load_preset(name) for name in BASSES}, {name: Source(name) for name in BASSES}
SLAP, JAZZ = (ON_PAGE[0][name].name for name in ("slap", "jazz-finger"))
SOFT = [(0.2 * k, 0.18, 33 + 5 * (k % 3), 25) for k in range(4)]  # as in test_module.py: nothing is chaotic
CASES = 1000
HIT = [(0.05, 0.8, 47, 127)]  # fret 4 of the G string at full force
CLOSE = 1e-6  # of full scale; the largest found, 4.3e-7, is from the single precision of long runs
READ = "const {name, values, played} = Bench.fromLink(arguments[0], benches); return [name, values, played]"


@pytest.fixture(scope="module")
def page(tmp_path_factory: pytest.TempPathFactory) -> Iterator[node.Page]:
    with node.page(ON_PAGE[0], tmp_path_factory.mktemp("page")) as page:
        yield page


def sliders(name: str) -> list[dict[str, Any]]:
    found = bench(load_preset(name), Source(name))
    assert found
    return list(found["sliders"])


def test_a_bass_as_it_was_exported_keeps_what_was_given(tmp_path: Path) -> None:
    """The export options for tuning, hands and effects are in the preset that the page saves."""
    source = Source("jazz-finger", {"tuning": "drop-d", "a4": 442.0})
    bass = load_preset("jazz-finger", **source.given)
    bass = replace(bass, player=replace(bass.player, floor_noise=-200.0, wheel="slide"), effects=Effects(drive=0.25))
    found = bench(bass, source)
    assert found and {"gauge", "tension", "action"} <= {slider["symbol"] for slider in found["sliders"]}
    text = ["like = " + json.dumps(found["like"])]
    for section, keys in found["head"].items():
        text += [f"[{section}]"] * bool(section) + [f"{name} = {value}" for name, value in keys.items()]
    assert load_text(tmp_path, "\n".join(text)) == bass
    assert bench(load_preset("slap"), source) is None


def test_sliders_are_those_that_change_the_bass_and_say_what_it_has() -> None:
    found = {slider["symbol"]: slider for slider in sliders("jazz-finger")}
    assert len(found) == len(SLIDER_ROWS)
    assert [found["action"][name] for name in ("own", "ownUnit")] == [2.4, "mm"]
    assert [found["neck_relief"]["own"], found["nut_height"]["own"], found["cable"]["own"]] == [0.3, 0.5, 700.0]
    assert [found[f"pickup_{k}_place"]["own"] for k in (1, 2)] == [152.4, 60.96]
    assert found["pickup_2_height"]["name"] == "Bridge pickup: height" and found["fret"]["maximum"] == 20
    assert not {"fret", "fret_height"} & {slider["symbol"] for slider in sliders("fretless")}
    assert not any(s["group"] == "Pickups" or s["symbol"] == "contact_loss" for s in sliders("paper-bass"))
    for row in SLIDER_ROWS.values():
        p = row.parameter
        assert p.minimum <= p.default == 0 < p.maximum and row.step < p.maximum - p.minimum


def each_slider(name: str) -> Iterator[dict[str, float]]:
    """Bench values with one slider moved, each to two places."""
    for slider in sliders(name):
        span = slider["maximum"] - slider["minimum"]
        for part in (0.3, 0.62):
            value = round(slider["minimum"] + part * span, 2)
            moved = {slider["symbol"]: float(round(value)) if slider["symbol"] == "fret" else value}
            yield moved | ({"fret": 7.0} if slider["symbol"] == "fret_height" else {})


@pytest.mark.parametrize("name", quick(BASSES, ["paper-bass"]))
def test_each_slider_makes_the_instrument_file_of_the_saved_preset(page: node.Page, tmp_path: Path, name: str) -> None:
    """Moved to one of its places on every second bass, to the other one on the next."""
    default = image_file(load_preset(name))
    for values in list(each_slider(name))[BASSES.index(name) % 2 :: 2]:
        toml, file = page.made(name, values)
        assert file == image_file(load_text(tmp_path, toml)), (values, toml)
        assert (file == default) == ("fret" in values and len(values) == 1), values


def test_a_neck_that_cannot_be_played_is_refused_as_in_a_preset(page: node.Page, tmp_path: Path) -> None:
    values = {"action": -2.0, "neck_relief": -1.0, "fret": 7, "fret_height": 1.5}
    for name in ("jazz-finger", "fretless"):
        with pytest.raises(ValueError, match="stands") as refused:
            page.made(name, values)
        with pytest.raises(PresetError, match=re.escape(str(refused.value))):
            load_text(tmp_path, page.toml(name, values))


# Moves each slider of a bass to both ends; returns those that stop before, where, and whether a step beyond is playable
TO_THE_ENDS = """
const [name, values] = arguments, bench = benches.get(name), stops = [];
const isPlayable = async values => {
  const {stops, slid} = bench;
  bench.stops = []; // which else hold the values back
  try { fileOf(name, values); } catch (error) { return false; } finally { Object.assign(bench, {stops, slid}); }
  return true;
};
for (const {symbol, minimum, maximum, step} of bench.controls.values()) {
  for (const end of [minimum, maximum]) {
    if (!await isPlayable(values)) throw new Error("the beginning cannot be played");
    bench.played.A = {...values};
    bench.stops = [];
    bench.settle();
    bench.set(symbol, end);
    if (await isPlayable(bench.values)) continue;
    const wanted = {...values, [symbol]: end}, found = await bench.lastPlayable(wanted, isPlayable);
    bench.setAll(wanted);
    bench.stopAt(found);
    const stop = bench.value(symbol), stands = bench.link(), beyond = {...wanted, [symbol]: stop + found.way * step};
    bench.set(symbol, end);
    const stays = bench.link() === stands;
    bench.set(symbol, values[symbol] ?? 0);
    const returns = bench.value(symbol) === (values[symbol] ?? 0);
    const playable = [wanted, {...wanted, [symbol]: stop}, beyond];
    stops.push([symbol, end, stop, step, stays, returns]);
    for (const each of playable) stops.at(-1).push(await isPlayable(each));
  }
}
return stops;
"""


def check_stops(page: node.Page, name: str, values: dict[str, float]) -> set[str]:
    """Moves all sliders of a bass to both ends; returns those that stop before."""
    stops = page.run(TO_THE_ENDS, name, values)
    for symbol, end, stop, step, stays, returns, at_end, at_stop, beyond in stops:
        assert (at_end, at_stop, beyond) == (False, True, False), (symbol, end, stop)
        assert stays and returns and abs(stop - values.get(symbol, 0)) < abs(end - values.get(symbol, 0)) - step / 2
    return {symbol for symbol, *_ in stops}


@pytest.mark.parametrize(
    ("name", "values"), [("jazz-finger", {}), ("fretless", {}), ("slap", {"fret": 7, "fret_height": 0.3})]
)
def test_a_slider_stops_at_the_last_neck_that_can_be_played(
    page: node.Page, name: str, values: dict[str, float]
) -> None:
    assert "action" in check_stops(page, name, values)


@pytest.mark.slow
def test_all_sliders_of_all_basses_stop_there(tmp_path: Path) -> None:
    with node.page({name: load_preset(name) for name in preset_names()}, tmp_path) as page:
        stopped = [name for name in preset_names() if check_stops(page, name, {})]
    assert len(stopped) > 5


def test_all_at_once_is_the_saved_preset(page: node.Page, tmp_path: Path) -> None:
    for name in BASSES:
        values: dict[str, float] = {}
        for one in each_slider(name):
            values |= {symbol: value for symbol, value in one.items() if symbol not in values}
        values |= {"action": 0.5, "neck_relief": 0.1}
        toml, file = page.made(name, values)
        assert file == image_file(load_text(tmp_path, toml)), (name, toml)


def test_the_sound_of_each_slider_is_that_of_a_render_of_the_saved_preset(page: node.Page, tmp_path: Path) -> None:
    """Of every third slider: each makes the file of the saved preset (above). Those that change frets are tested by a
    note that hits them: lossy contact is not chaotic.
    """
    heights = {"action", "neck_relief", "nut_height", "fret_height", "contact_loss"}
    default: dict[bool, Any] = {}
    moved = [values for values in each_slider("jazz-finger") if list(values) != ["fret"]][::6]
    for hit, values in [(False, {}), (True, {}), *((bool(heights & set(values)), values) for values in moved)]:
        score = score_of(HIT if hit else SOFT, RATE)
        sound = page.sound("jazz-finger", values, score, RATE // 2)
        bass = load_text(tmp_path, page.toml("jazz-finger", values))
        strings = render_to_array(bass, score, QUALITIES["live"], tail=0.0).astype(np.float32)
        wanted = np.clip(mix_strings(strings), -1, 1)
        assert np.abs(sound - wanted[: len(sound)]).max() <= CLOSE < 0.01 < np.abs(sound).max(), values
        assert not values or np.abs(sound - default[hit]).max() > 1e-6, values
        default.setdefault(hit, sound)


def test_a_lower_action_buzzes_under_the_same_hand(page: node.Page) -> None:
    """The page's sound has more above 1 kHz at the same pluck: the saved preset keeps the hand."""
    high = []
    for action in (1.6, -1.4):
        sound = page.sound("jazz-finger", {"action": action}, score_of([(0.0, 0.9, 43, 110)], RATE), RATE)
        spectrum = np.abs(np.fft.rfft(sound)) ** 2
        high.append(spectrum[1000:].sum() / spectrum.sum())
    assert high[1] > 1.6 * high[0]


@pytest.mark.parametrize("name", BASSES)
def test_links_and_presets_bring_the_bench_back(page: node.Page, name: str) -> None:
    """Some sliders, each at any of its places other than the preset's; Python's reader of links takes them, too."""
    rng, rows, cases = random.Random(1), sliders(name), []
    for _ in range(CASES):
        values = {}
        for row in rng.sample(rows, rng.randint(0, len(rows))):
            steps = 1 if row["points"] else 100
            values[row["symbol"]] = rng.randint(round(row["minimum"] * steps), round(row["maximum"] * steps)) / steps
        cases.append({symbol: value for symbol, value in values.items() if value})
    found = page.run(
        "const [name, cases] = arguments, bench = benches.get(name);"
        "const of = ({name, values, played}) => [name, values, played];"
        "return cases.map(values => { bench.setAll(values); const link = bench.link(); return ["
        "  link, of(Bench.fromLink(link, benches)), of(Bench.fromToml(bench.toml(), benches))]; })",
        name, cases,
    )  # fmt: skip
    assert [two for _, *two in found] == [[[name, values, {}]] * 2 for values in cases]
    assert [link.count("&") for link, *_ in found] == [len(values) for values in cases]
    for link, *_ in found[:3]:
        check_link(link, *ON_PAGE)


@pytest.mark.parametrize(
    "link, says",
    [
        ("like=none&action=2", "the link names no bass of this page that can be changed: like=none"),
        ("action=2", "the link names no bass of this page that can be changed: action=2"),
        ("like=jazz-finger&fret=21", "the link says fret = 21: it must be from 0 to 20"),
        ("like=jazz-finger&action=99", "the link says action = 99: it must be from -2 to 3 mm"),
        ("like=jazz-finger&wear=", "the link says wear = : it must be from -50 to 1100 %"),
        ("like=jazz-finger&action=NaN", "the link says action = NaN: it must be from -2 to 3 mm"),
        ("like=jazz-finger&blend=1.5", "the link says blend = 1.5: it must be from -1 to 1"),
        ("like=jazz-finger&action=%3Cb%3E", "the link says action = <b>: it must be from -2 to 3 mm"),
        ("like=slap&revision=99", f"the link is of revision 99 of {SLAP}, which has revisions up to {present('slap')}"),
        (
            "like=jazz-finger&revision=0",
            f"the link is of revision 0 of {JAZZ}, which has revisions up to {present('jazz-finger')}",
        ),
        ("like=slap&format=2", "made for a later livebass: this page reads format 1"),
    ],
)
def test_a_bad_link_is_told_in_a_line(page: node.Page, link: str, says: str) -> None:
    with pytest.raises(ValueError, match=f"^{re.escape(says)}") as reported:
        page.run(READ, link)
    assert "\n" not in str(reported.value)
    with pytest.raises(ValueError, match=re.escape(says.partition(":")[0])):
        check_link(link, *ON_PAGE)


@pytest.mark.parametrize(
    "text, says",
    [
        ('like = "slap"\n[bench]\naction = 9', "the preset says action = 9: it must be from -2 to 3 mm"),
        ('like = "slap"\n[neck]\naction = "2 mm"', "they have no such line: action"),
        ('like = "kazoo"', 'this page does not have or cannot change: "kazoo"'),
        ('name = "Slap"', "they have no such line: name"),
        ("", "the preset does not say which bass it is like"),
        ("format = 2", "made for a later livebass: this page reads format 1"),
    ],
)
def test_a_bad_preset_is_told_in_a_line(page: node.Page, text: str, says: str) -> None:
    with pytest.raises(ValueError, match=re.escape(says)) as reported:
        page.run("return Bench.fromToml(arguments[0], benches)", text)
    assert "\n" not in str(reported.value)


def test_a_link_names_an_earlier_revision_that_the_page_has(page: node.Page) -> None:
    read = (
        "const {bass, page} = benches.get('slap');"
        "const all = new Map([['slap', new Bench({...bass, revision: 2, earlier: [1]}, page)]]);"
        "const {revision = null} = Bench.fromLink(arguments[0], all); return revision"
    )
    assert [page.run(read, f"like=slap&revision={number}") for number in (1, 2)] == [1, None]
    for number in ("3", "0", "x"):
        says = f"revision {number} of {SLAP}, which has revisions up to 2 on this page"
        with pytest.raises(ValueError, match=f"^the link is of {says}$"):
            page.run(read, f"like=slap&revision={number}")


def test_a_slider_that_had_another_name_is_found(page: node.Page, monkeypatch: pytest.MonkeyPatch) -> None:
    """In links and presets, and Python's reader of links finds it, too."""
    renamed = {"string_height": "action"}  # as if it had been called so
    monkeypatch.setattr("livebass.web.bench.RENAMED", renamed)
    basses, sources = {"slap": load_preset("slap")}, {"slap": Source("slap")}
    with_old_name = (
        "const {of, bass, page} = benches.get('slap');"
        "const old = new Map([['slap', new Bench({...bass, bench: {...of, renamed: arguments[1]}}, page)]]);"
    )
    link, toml = "like=slap&string_height=-0.2&tone=0.25", 'like = "slap"\n\n[bench]\nstring_height = -0.2\n'
    check_link(link, basses, sources)
    with pytest.raises(ValueError, match="the link says action = 99"):
        check_link("like=slap&string_height=99", basses, sources)
    found = page.run(with_old_name + "return Bench.fromLink(arguments[0], old)", link, renamed)
    assert found["values"] == {"action": -0.2} and found["played"] == {"tone": 0.25}
    found = page.run(with_old_name + "return Bench.fromToml(arguments[0], old)", toml, renamed)
    assert found["values"] == {"action": -0.2}


def test_undo_and_redo_go_to_the_states_between(page: node.Page) -> None:
    """All the way back both benches are empty; all the way on again they are as they were."""
    rng, cases = random.Random(2), []
    for _ in range(CASES):
        steps = [
            *(("set", rng.choice(["action", "foam", "gauge"]), rng.randint(-20, 30) / 10) for _ in range(12)),
            *((rng.choice(["settle", "reset", "undo", "undo", "redo"]),) for _ in range(12)),
            *(("choose", rng.choice("AB")) for _ in range(4)),
        ]
        cases.append(rng.sample(steps, rng.randint(1, len(steps))))
    found = page.run(
        "const {bass, page} = benches.get('slap');"
        "return arguments[0].map(steps => {"
        "  const bench = new Bench(bass, page), all = () => JSON.parse(JSON.stringify(bench.slots));"
        "  for (const [name, ...given] of steps) bench[name](...given);"
        "  while (bench.redo());"
        "  const last = all(), undoable = bench.before.length; let undone = 0;"
        "  while (bench.undo()) undone++;"
        "  const first = all();"
        "  while (bench.redo());"
        "  return [undone, undoable, first, last, all()]; })",
        cases,
    )  # fmt: skip
    assert max(undoable for _, undoable, *_ in found) > 10
    for undone, undoable, first, last, again in found:
        assert undone == undoable and first == {"A": {}, "B": {}} and again == last
