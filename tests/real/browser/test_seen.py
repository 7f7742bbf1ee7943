"""The page as a person sees it: it opens moving, fits one view, shows hits where they are, and says what happens."""

from __future__ import annotations

import base64
import time
from typing import Any

import pytest
from support.browser import look_inside, open_page, resize, seen_by, start_sound, wait
from support.song import midi_file, song_of

MOVES = "return [see.replay !== undefined, see.replay?.at ?? 0, player.context.state, $('seen').textContent]"
ONE_VIEW = (1280, 800)  # px


@pytest.fixture
def page(browser: Any, whole: str) -> Any:
    """The fresh page."""
    browser.get("about:blank")
    browser.get_log("browser")
    browser.get(whole)
    look_inside(browser)
    return browser


# Draws; returns the columns of a canvas in which something bright and warm is drawn, in CSS px: sparks
SPARKS = """
const sparks = id => {
  pictures.draw();
  const c = $(id), {width, height} = c, found = new Set();
  const {data} = c.getContext('2d').getImageData(0, 0, width, height);
  for (let k = 0; k < width * height; k++)
    if (data[4 * k + 3] > 200 && data[4 * k] > data[4 * k + 2] + 60) found.add(k % width);
  return [...found].sort((a, b) => a - b).map(x => x * c.clientWidth / width);
};
"""


def pixels(driver: Any, canvas: str) -> list[int]:
    return list(driver.execute_script(f"{SPARKS}; return sparks(arguments[0])", canvas))


def test_it_opens_with_a_moving_string_that_hits_frets_before_any_gesture(page: Any) -> None:
    wait(lambda: page.execute_script("return see.flashes.size"))
    assert page.get_log("browser") == [], "nothing at all is written to the console"
    wait(lambda: len(pixels(page, "strings")) > 4)
    shown, before, sound, said = page.execute_script(MOVES)
    assert shown and sound == "suspended" and said == "This string is computed, not recorded. Press it."
    wait(lambda: page.execute_script("return see.replay.at") != before)
    assert not page.find_element("id", "power").is_displayed()


def test_where_motion_is_not_wanted_it_opens_with_a_still_and_an_offer(browser: Any, whole: str) -> None:
    browser.get("about:blank")
    with seen_by(browser, prefers_reduced_motion="reduce"):
        open_page(browser, whole)
        wait(lambda: browser.execute_script("return see.flashes.size"))
        at = browser.execute_script("return see.replay.at")
        time.sleep(0.3)
        assert browser.execute_script("return see.replay.at") == at > 0 and len(pixels(browser, "strings")) > 4
        assert "press Replay" in browser.find_element("id", "seen").text
        browser.find_element("id", "again").click()
        wait(lambda: browser.execute_script("return state.rolling && see.replay.at > 0"))


def test_the_first_press_in_the_middle_of_a_string_hits_frets_until_somebody_played_softly_and_hard(page: Any) -> None:
    """At the middle of its lane, as strangers press; then the place in the lane says how hard."""
    force = (
        "const [string, fret, part] = arguments, e = $('neck').querySelector("
        "`button[data-string='${string}'][data-fret='${fret}']`);"
        "const {left, top, width, height} = e.getBoundingClientRect();"
        "const how = {clientX: left + width / 2, clientY: top + part * height, bubbles: true, pointerId: 7};"
        "e.dispatchEvent(new PointerEvent('pointerdown', how)); const {velocity} = held.get('pointer7');"
        "e.dispatchEvent(new PointerEvent('pointerup', how)); return velocity"
    )
    assert [page.execute_script(force, string, 9, 0.5) for string in range(4)] == [127] * 4
    hits = page.execute_async_script(
        "const [done] = arguments, {strings, name} = bassCalled('jazz-finger');"
        "player.fileOf(name).then(file => Promise.all(strings.map(({note}, string) =>"
        " move({performed: {string, note: note + 9, velocity: 127}}, file))))"
        ".then(made => done(made.map(({contacts}) => contacts.length)))"
    )
    assert min(hits) > 0
    assert page.execute_script(force, 1, 9, 0.1) < 50  # whoever plays softly is heard softly
    assert page.execute_script(force, 1, 9, 0.5) == 127
    assert page.execute_script(force, 1, 9, 0.95) > 110
    assert 60 < page.execute_script(force, 1, 9, 0.5) < 90


# Presses and releases a place on the neck at the same moment; resolves when its note was heard and a hit
# is seen, to its fret and the number of columns with sparks
TAP = f"""
{SPARKS}
const [string, fret, done] = arguments;
const cell = document.querySelector(`button[data-string="${{string}}"][data-fret="${{fret}}"]`);
const {{left, top, width, height}} = cell.getBoundingClientRect();
const how = {{clientX: left + width / 2, clientY: top + height / 2, bubbles: true, pointerId: 7}};
let peak = 0;
player.on("report", told => {{ peak = Math.max(peak, told.peak); }});
const look = () => {{
  const hit = [...see.flashes.values()].filter(flash => flash.string === string && flash.fret > fret);
  if (peak < 0.01 || see.note.string !== string || !hit.length) return requestAnimationFrame(look);
  done([see.note.fret, sparks("strings").length]);
}};
for (const kind of ["pointerdown", "pointerup"]) cell.dispatchEvent(new PointerEvent(kind, how));
look();
"""


def test_the_shortest_tap_plucks_a_note_that_sounds_and_is_drawn(page: Any) -> None:
    start_sound(page)
    for string, fret in ((0, 9), (1, 5), (2, 7), (3, 3)):
        at, sparks = page.execute_async_script(TAP, string, fret)
        assert at == fret and sparks > 4
        wait(lambda: " contact" in page.find_element("id", "seen").text)


def test_a_second_tap_is_not_cut_by_the_end_of_the_first(page: Any) -> None:
    start_sound(page)
    sent = page.execute_async_script(
        "const [done] = arguments, sent = [], begin = performance.now();"
        "player.on('sent', ([status, note], time) => {"
        "  if (sent.push([status, note, time - begin]) === 4) done([sent, SHORTEST]); });"
        "for (const at of [0, 30]) { press('a', 33, 100, begin + at); release('a', begin + at + 5); }"
    )
    events, shortest = sent
    kinds, notes, times = zip(*events, strict=True)
    assert kinds == (0x90, 0x80, 0x90, 0x80) and set(notes) == {33}
    assert times == pytest.approx((0, 30, 30, 30 + shortest), abs=1e-6)
    assert page.execute_script("return held.size") == 0


def test_neck_side_view_last_note_and_bench_are_in_one_view(page: Any) -> None:
    with resize(page, *ONE_VIEW):
        parts = page.execute_script(
            "return ['neck', 'seen', 'side', 'note', 'bench-action'].map(id => $(id).getBoundingClientRect().toJSON())"
        )
        for part in parts:
            assert part["top"] >= 0 and part["bottom"] <= ONE_VIEW[1] and part["right"] <= ONE_VIEW[0], parts
        neck, _, side, note, _ = parts
        assert side["height"] > 1.4 * note["height"] and side["width"] == pytest.approx(neck["width"], abs=2)
        crowns = "const {frets} = bassCalled('jazz-finger').strings[0];"
        crowns += "return frets.map(place => pictures.place(place) + $('strings').getBoundingClientRect().left)"
        wires = "return [...document.querySelectorAll('.fret[data-string=\"0\"]')]"
        wires += ".map(cell => cell.getBoundingClientRect().right)"
        assert page.execute_script(crowns) == pytest.approx(page.execute_script(wires), abs=0.5)


def test_an_embedded_page_is_neck_side_view_action_and_replay(page: Any, whole: str) -> None:
    with resize(page, 600, 340):
        open_page(page, f"{whole}?embed#like=jazz-finger&action=-1.4")
        wait(lambda: page.execute_script("return see.replay !== undefined"))
        shown = "return [...document.querySelectorAll('main :is(canvas, input, select, output, button:not(#neck *))')]"
        shown += ".filter(e => e.checkVisibility() && e.clientWidth).map(e => e.id || e.textContent)"
        assert page.execute_script(shown) == ["strings", "side", "again", "1.00 mm", "bench-action"]
        for name in ("neck", "seen", "side", "again", "bench-action"):
            box = page.execute_script("return $(arguments[0]).getBoundingClientRect().toJSON()", name)
            assert 0 <= box["top"] < box["bottom"] <= 340 and 0 <= box["left"] < box["right"] <= 600, (name, box)
        assert page.execute_script("return [bench().values.action, $('said').textContent]") == [-1.4, ""]
        tall = page.execute_script("return $('neck').clientHeight")
        page.execute_script("chooseBass(paperBass().name)")  # it has one string
        assert page.execute_script("return $('neck').clientHeight") == pytest.approx(tall, abs=2)


def test_a_note_is_told_with_hits_that_a_busy_machine_reports_late(page: Any) -> None:
    before, after = page.execute_script(
        "const told = [], s = new see.constructor(PAGE.sight, note => told.push(note.contacts.length), () => {});"
        "s.setBass(chosenBass()); const late = 900 + 0.6 * s.rate;"
        "const take = (frame, contacts, notes) => s.take({sight: new ArrayBuffer(8), frame, contacts, notes});"
        "take(1000, [], [0, 3, 900]); s.follow(1000, 0); s.follow(late, 0); const before = [...told];"
        "take(late, [0, 5, 5000, 1], []); s.follow(late, 0); return [before, told]"
    )
    assert before == [] and after == [1]


@pytest.mark.parametrize("width", [390, 844, 1280])
def test_a_hit_is_drawn_at_its_fret_or_not_at_all(page: Any, width: int) -> None:
    """Frets that the neck does not show are in the side view alone."""
    with resize(page, width, 844):
        wait(lambda: page.execute_script("return see.replay !== undefined"))
        page.execute_script("backToNow(); see.view = undefined")
        count = page.execute_script("return +$('neck').dataset.count")
        for fret in (2, 5, 12, 18):
            page.execute_script(
                "see.flashes.clear();"
                "see.flash({string: 0, fret: arguments[0], frame: 0, speed: 4}, performance.now() + 1e5)",
                fret,
            )
            drawn = pixels(page, "strings")
            if fret > count:
                assert drawn == []
            else:
                wire = page.execute_script(
                    "return document.querySelector(`.fret[data-string='0'][data-fret='${arguments[0]}']`)"
                    ".getBoundingClientRect().right - $('strings').getBoundingClientRect().left",
                    fret,
                )
                assert (drawn[0] + drawn[-1]) / 2 == pytest.approx(wire, abs=2)
            assert pixels(page, "side"), "each is in the side view"


def test_a_string_is_broken_where_the_neck_is(page: Any) -> None:
    """Between the last fret shown and the body nothing is drawn, rather than a string in a false place."""
    with resize(page, 390, 844):
        gap = page.execute_script(
            "const {left} = $('strings').getBoundingClientRect(), at = e => e.getBoundingClientRect();"
            "const frets = document.querySelectorAll('.fret[data-string=\"0\"]');"
            "return [at([...frets].at(-1)).right - left, at(document.querySelector('.body')).left - left]"
        )
        assert gap[1] - gap[0] > 8
        columns = page.execute_script(
            "pictures.draw(); const {width, height} = $('strings'), found = [];"
            "const {data} = $('strings').getContext('2d').getImageData(0, 0, width, height);"
            "for (let k = 3; k < data.length; k += 4) found[(k >> 2) % width] ||= data[k] > 0;"
            "return found"
        )
        assert not any(columns[round(gap[0]) + 5 : round(gap[1]) - 5])
        assert all(columns[round(gap[0]) - 60 : round(gap[0])])


def test_the_neck_shows_motion_along_the_frets_and_the_side_view_motion_towards_them(page: Any) -> None:
    wait(lambda: page.execute_script("return see.replay !== undefined"))
    found = page.execute_script(
        "state.rolling = false; goTo(see.replay.frame - see.replay.first); let shape;"
        "see.eachString(({u, v}) => { shape = {u: [...u], v: [...v]}; });"
        "see.replay.across.fill(0); see.needed = true; pictures.draw();"
        "const flat = $('strings').toDataURL(); see.replay.rows.fill(0); see.needed = true; pictures.draw();"
        "return [shape, flat === $('strings').toDataURL()]"
    )
    shape, same = found
    assert max(shape["u"]) > 5e-4 and max(map(abs, shape["v"])) > 1e-4
    assert same, "u moves nothing on the neck"


def test_the_last_notes_picture_shows_every_moment_of_its_replay(page: Any) -> None:
    wait(lambda: page.execute_script("return see.replay !== undefined"))
    drawn = page.execute_script(
        "state.rolling = false; const last = see.replay.length - 1, begin = see.replay.frame - see.replay.first;"
        "return [0, 2, 4, 7, 8].map(k => begin + (last - begin) * k / 8).map(frame => {"
        "  goTo(frame); pictures.draw(); return $('note').toDataURL(); })"
    )
    assert len(set(drawn)) == len(drawn)


def test_a_sentence_of_two_lines_moves_nothing(page: Any) -> None:
    """Notes change the sentence while somebody aims at a control."""
    found = (
        "$('same').hidden = false; $('seen').textContent = arguments[0]; const text = document.createRange();"
        "text.selectNodeContents($('seen'));"
        "return [text.getClientRects().length, $('side').getBoundingClientRect().top]"
    )
    same = "The same pluck, in its first 0.1 s: 29 contacts before, 109 contacts now."
    hardest = "A string, fret 2: 68 contacts; it hits fret 4 hardest."
    for width, height, longer in ((*ONE_VIEW, same), (390, 844, hardest)):
        with resize(page, width, height):
            (one, before), (two, after) = (page.execute_script(found, said) for said in ("Press it.", longer))
            assert (one, two) == (1, 2) and abs(after - before) < 0.5


@pytest.mark.parametrize("text", ["100%", "200%"])
def test_a_phone_fits_large_text_and_the_longest_names(page: Any, text: str) -> None:
    """With the bench open, a story, a song, and a message, all named by 180 letters without a gap."""
    song = base64.b64encode(midi_file(song_of([28], 480))).decode()
    with resize(page, 390, 844):
        page.execute_script(
            "const [song, size] = arguments, name = 'a'.repeat(180);"
            "document.documentElement.style.fontSize = size; $('bench-fold').open = true;"
            "openSong(new File([Uint8Array.from(atob(song), c => c.charCodeAt(0))], name)); say(name, true);"
            "$('response-text').textContent = $('midi-text').textContent = name; showStep(PAGE.stories[0], 0)",
            song,
            text,
        )
        wait(lambda: "aaa" in page.find_element("id", "song-text").text)
        wait(lambda: page.execute_script("return document.documentElement.scrollWidth") <= 390)


def test_the_bench_is_a_few_keys_away(page: Any) -> None:
    from selenium.webdriver.common.action_chains import ActionChains
    from selenium.webdriver.common.keys import Keys

    for key in (Keys.TAB, Keys.ENTER):
        ActionChains(page).send_keys(key).perform()
    assert page.switch_to.active_element.get_attribute("id") == "bench-action"
