"""Replays: the last note on the bass that played it, whatever has changed since, and its pluck on a changed bass."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
from support.browser import SAVED, errors, open_page, saved_file, wait

# The replay's contacts, [fret, frame, speed], from the release on
HITS = "return see.replay.hits.filter(h => h.frame >= see.replay.frame).map(h => [h.fret, h.frame, h.speed])"
STRING, FRET = 0, 3


@pytest.fixture
def page(browser: Any, whole: str) -> Iterator[Any]:
    """The fresh page after a hard note; any error in it fails the test."""
    open_page(browser, whole)
    browser.find_element("css selector", "h1").click()
    browser.execute_script(
        "const [string, fret] = arguments, note = bassCalled('jazz-finger').strings[string].note + fret;"
        "const cell = $('neck').querySelector(`[data-string='${string}'][data-fret='${fret}']`);"
        "press('test', note, 120, performance.now(), cell)",
        STRING,
        FRET,
    )
    wait(lambda: browser.execute_script("return kept.note !== undefined && see.note.wasReported"))
    browser.execute_script("release('test')")
    yield browser
    assert not errors(browser)


def show(page: Any, button: str) -> list[list[float]]:
    """Presses a button that shows a replay; returns its contacts."""
    page.execute_script("if (see.replay) backToNow()")
    page.find_element("id", button).click()
    wait(lambda: page.execute_script("return see.replay !== undefined"))
    hits: list[list[float]] = page.execute_script(HITS)
    return hits


def lower(page: Any, by: float) -> None:
    page.execute_script("onBench(() => bench().setAll({action: -arguments[0]}))", by)
    wait(lambda: page.execute_script("return !building.now && !player.next"))


def test_after_a_change_the_replay_is_still_the_note_that_was_played(page: Any) -> None:
    first = show(page, "again")
    lower(page, 1.2)
    wait(lambda: page.execute_script("return player.names.size === 1"))  # the bass that played it is gone
    assert show(page, "again") == first
    page.find_element("id", "undo").click()
    wait(lambda: page.execute_script("return !building.now && !player.next"))
    assert show(page, "again") == first


def test_the_same_pluck_on_the_changed_bass_is_drawn_over_the_old_one_and_both_are_heard(page: Any) -> None:
    old = show(page, "again")
    assert not page.find_element("id", "same").is_displayed()
    lower(page, 1.2)
    new = show(page, "same")
    wait(lambda: "The same pluck" in page.find_element("id", "seen").text)
    before, sounds, said = page.execute_script(
        "return [see.other.hits.filter(h => h.frame >= see.other.frame).map(h => [h.fret, h.frame, h.speed]),"
        " hearing.sources.map(({buffer}) => [...buffer.getChannelData(0).subarray(0, 40000)]), $('seen').textContent]"
    )
    assert before == old and len(new) > 1.5 * len(old)
    assert said == f"The same pluck, in its first 0.1 s: {len(old)} contacts before, {len(new)} contacts now."
    assert len(sounds) == 2 and min(np.abs(sound).max() for sound in sounds) > 0.01
    assert np.abs(np.subtract(*sounds)).max() > 0.01
    blue = "pictures.draw(); const c = $('side'), {data} = c.getContext('2d').getImageData(0, 0, c.width, c.height);"
    blue += "let count = 0; for (let k = 0; k < data.length; k += 4) count += data[k + 2] > data[k] + 60; return count"
    assert page.execute_script(blue) > 100
    page.find_element("id", "now").click()
    assert page.execute_script(blue) == 0


def test_a_new_bass_that_is_the_old_one_makes_the_same_motion(page: Any) -> None:
    """From rest, events alone make the motion, bit for bit."""
    same = page.execute_async_script(
        "const [done] = arguments, {recalled, file} = kept.note;"
        "Promise.all([false, true].map(changed => move({recalled, changed}, file))).then(([a, b]) =>"
        " done(['rows', 'across', 'slots', 'sound'].map(name => a[name].every((x, k) => x === b[name][k]))))"
    )
    assert same == [True] * 4


def test_the_next_note_ends_the_replay(page: Any) -> None:
    show(page, "again")
    page.execute_script("press('test', 33, 100, performance.now())")
    wait(lambda: page.execute_script("return see.replay === undefined && see.note.string !== undefined"))
    page.execute_script("release('test')")


def test_a_clip_has_pictures_and_the_notes_sound(page: Any) -> None:
    """Two tracks: the sound begins with the note at speed."""
    show(page, "again")
    page.execute_script(SAVED + "$('slow').value = 0.5; $('slow').oninput()")
    page.find_element("id", "clip").click()
    wait(lambda: page.execute_script("return saved.length === 1"))
    data, name = saved_file(page)
    tracks = page.execute_async_script(
        "const [done] = arguments, context = new OfflineAudioContext(1, 48000, 48000);"
        "saved[0][0].arrayBuffer().then(bytes => context.decodeAudioData(bytes)).then("
        "sound => done([sound.duration, sound.getChannelData(0).reduce((a, b) => Math.max(a, Math.abs(b)), 0)]),"
        "error => done(String(error)))"
    )
    assert isinstance(tracks, list), tracks
    assert tracks[0] > 3 and tracks[1] > 0.02 and name.rpartition(".")[2] in ("mp4", "webm")
    assert len(data.getvalue()) > 5000
