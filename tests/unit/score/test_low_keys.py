"""Low keys of a file: notes of a low tuning, or key switches."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from support.smf import events, note_of, smf, struck

from livebass import Quality, load_preset, render_to_array
from livebass.score.low_keys import with_low_notes
from livebass.score.reading import read_score
from livebass.score.score import Score, score_of

RATE = 48000
Rows = list[tuple[int, tuple[int, ...]]]


def line(*keys: int, length: int = 200) -> Rows:
    return [(0, (0xC0, 33)), *(row for k, key in enumerate(keys) for row in note_of(0, key, 240 * k, 240 * k + length))]


def read(folder: Path, rows: Rows) -> Score:
    path = folder / "song.mid"
    path.write_bytes(smf(events(*sorted(rows, key=lambda row: row[0]))))
    return read_score(path, RATE)


NOTES = {
    "F#0": (line(18, 30, 18, 18, 25, 30), [30, 30, 30, 30, 25, 30]),
    "E0 and G0": (line(16, 28, 19, 16, 23), [28, 28, 31, 28, 23]),
    "nothing else": (line(18, 17, 16), [30, 29, 28]),
    "one in the middle": (line(30, 28, 18, 25), [30, 28, 30, 25]),
    "legato": (line(18, 30, 18, 25, length=250), [30, 30, 30, 25]),
}
SWITCHES = {
    "held while notes begin": [*line(30, 28, 25, 33), *note_of(0, 17, 230, 700)],
    "brief, before the notes": [*line(30, 28, 25, 33), *note_of(0, 18, 225, 230), *note_of(0, 18, 705, 710)],
    "once, before the first note": [(0, (0xC0, 33)), *note_of(0, 18, 0, 200), *note_of(0, 30, 240, 440)],
    "twice, before the first note": [(0, (0xC0, 33)), *note_of(0, 18, 0, 110), *note_of(0, 18, 120, 230),
                                     *note_of(0, 30, 240, 440), *note_of(0, 28, 480, 680)],
    "lower than any tuning": line(13, 30, 15, 28, 13, 25),
}  # fmt: skip


@pytest.mark.parametrize("name", NOTES)
def test_low_keys_that_look_like_notes_are_notes_an_octave_higher(tmp_path: Path, name: str) -> None:
    rows, keys = NOTES[name]
    score, bass = read(tmp_path, rows), load_preset("five-string")
    fitted = with_low_notes(score, bass)
    assert struck(fitted) == keys and fitted.raised == sum(a != b for a, b in zip(struck(score), keys, strict=True))
    assert fitted.notes == score.notes and np.array_equal(fitted.frames, score.frames)


@pytest.mark.parametrize("name", SWITCHES)
def test_key_switches_stay_what_they_are(tmp_path: Path, name: str) -> None:
    score = read(tmp_path, SWITCHES[name])
    assert with_low_notes(score, load_preset("five-string")) is score


FOREIGN: dict[str, Rows] = {
    "brief, before the notes": [*note_of(0, 24, -40, -10), *note_of(0, 26, 440, 470)],
    "sent twice": 2 * note_of(0, 24, -40, -10) + 2 * note_of(0, 26, 440, 470),
    "sent again before the note": [
        *note_of(0, 24, -90, -70),
        *note_of(0, 24, -40, -10),
        *note_of(0, 26, 360, 380),
        *note_of(0, 26, 440, 470),
    ],
    "sent three times": [row for tick in (-90, -70, -40) for row in note_of(0, 24, tick, tick + 15)],
    "high, at the notes": [*note_of(0, 96, 0, 10), *note_of(0, 97, 720, 730)],
    "high, held": note_of(0, 84, -20, 900),
}
NO_SWITCHES: dict[str, Rows] = {
    "low notes": [*note_of(0, 26, 960, 1160), *note_of(0, 24, 1200, 1400)],
    "brief low notes in a line": [*note_of(0, 26, 960, 1000), *note_of(0, 33, 1080, 1160), *note_of(0, 24, 1200, 1240)],
    "double stops": [*note_of(0, 26, 0, 200), *note_of(0, 26, 240, 440)],
    "a brief double stop": [*note_of(0, 26, 960, 1000), *note_of(0, 33, 960, 1000)],
    "a grace note among low notes": [
        *note_of(0, 26, 440, 470), *note_of(0, 26, 960, 1160), *note_of(0, 24, 1200, 1400),
    ],
    "a drone": note_of(0, 26, -20, 900),
    "brief low notes of a line that ends": [*note_of(0, 26, 960, 1000), *note_of(0, 26, 1080, 1120)],
    "high notes": [*note_of(0, 72, 960, 1160), *note_of(0, 74, 1200, 1400)],
}  # fmt: skip


def shift(rows: Rows) -> Rows:
    return [
        (tick + 100 if message[0] & 0xF0 != 0xC0 else tick, message) for tick, message in [*line(30, 28, 33, 35), *rows]
    ]


@pytest.mark.parametrize("name", FOREIGN)
def test_key_switches_of_another_instrument_are_left_out(tmp_path: Path, name: str) -> None:
    fitted = with_low_notes(read(tmp_path, shift(FOREIGN[name])), load_preset("jazz-finger"))
    alone = read(tmp_path, shift([]))
    assert fitted.left_out == len(FOREIGN[name]) // 2 and fitted.notes == alone.notes == 4
    assert np.array_equal(fitted.messages, alone.messages) and np.array_equal(fitted.frames, alone.frames)


@pytest.mark.parametrize("name", NO_SWITCHES)
def test_notes_beyond_the_range_are_no_switches(tmp_path: Path, name: str) -> None:
    score = read(tmp_path, shift(NO_SWITCHES[name]))
    assert with_low_notes(score, load_preset("jazz-finger")) is score


def test_notes_of_a_program_and_of_a_take_are_left_alone(tmp_path: Path) -> None:
    """They were played on a livebass, where these keys switch."""
    bass = load_preset("five-string")
    made = score_of([(0.25 * k, 0.2, key, 90) for k, key in enumerate((18, 30, 18))], RATE)
    assert with_low_notes(made, bass) is made
    take = read(tmp_path, [(0, (0xFF, 1, 19, *b"as played by livebass"[:19])), *line(18, 30, 18)])
    assert take.foreign
    take = read(tmp_path, [(0, (0xFF, 1, 21, *b"as played by livebass")), *line(18, 30, 18)])
    assert not take.foreign and with_low_notes(take, bass) is take


def test_a_low_note_sounds_as_the_note_an_octave_higher(tmp_path: Path) -> None:
    quality, bass = Quality("light", 40, 192e3), load_preset("five-string")
    low, high = (
        render_to_array(bass, read(tmp_path, line(*keys, length=100)), quality, tail=0.0)
        for keys in ((18, 25, 18), (30, 25, 30))
    )
    assert np.array_equal(low, high) and np.abs(low).max() > 0
