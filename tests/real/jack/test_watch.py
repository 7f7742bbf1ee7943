"""A browser shows the strings that play elsewhere: in this process, and in a terminal."""

from __future__ import annotations

import signal
from pathlib import Path
from types import SimpleNamespace

import pytest
from support.browser import INSIDE, PATIENCE, chromium, firefox, wait
from support.jack import playing
from support.song import midi_file, song_of
from support.watched import watched


def test_a_page_shows_the_strings_that_play_elsewhere(tmp_path: Path) -> None:
    with watched() as (made, synth), chromium(tmp_path / "profile") as page:
        page.get(made.address)
        wait(lambda: "plays, in livebass play" in page.find_element("id", "said").text)
        page.execute_script(INSIDE)
        page.execute_script(
            "window.flashed = new Set(); const flash = see.flash.bind(see);"
            "see.flash = (hit, now) => { flashed.add(hit.fret); flash(hit, now); }"
        )
        # a page on a busy machine may miss a note
        wait(lambda: synth.send(0x90, 33, 127) and page.execute_script("return flashed.size") > 0)
        wait(lambda: "A string" in page.execute_script("return $('seen').textContent"))
        assert not page.find_element("id", "piano").is_displayed()
        assert page.execute_script("return see.view && see.read(1, 0, 'on') + see.read(1, 1, 'on')") > 0
        made.close()
        wait(lambda: "play has ended" in page.find_element("id", "said").text)
        assert page.execute_script("return player.context === undefined")


@pytest.mark.slow
def test_firefox_sees_what_a_terminal_plays(server: SimpleNamespace, tmp_path: Path) -> None:
    """`livebass play --watch` prints an address; its page shows each string's motion in the song, and the end."""
    song = tmp_path / "song.mid"
    song.write_bytes(midi_file(song_of([28, 33, 38, 43] * 20, 720)))
    arguments = ("--backend", "jack", "-p", "jazz-finger", "--file", song, "--loop")
    with playing("--watch", "--no-settings", *arguments) as process:
        assert process.stdout
        address = process.stdout.readline().strip()
        with firefox(tmp_path / "profile") as page:
            page.get(address)

            def reported(place: str) -> str:
                return page.run(f"Promise.resolve(document.getElementById('{place}').textContent)")

            wait(lambda: "plays, in livebass play" in reported("said"))
            seen: set[str] = set()
            wait(lambda: seen.add(reported("seen")[:8]) or seen >= {f"{name} string" for name in "EADG"})
            process.send_signal(signal.SIGINT)
            wait(lambda: "play has ended" in reported("said"))
        _, said = process.communicate(timeout=PATIENCE)
        assert process.returncode == 0 and "Traceback" not in said, said
