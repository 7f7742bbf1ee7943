"""The performer's records: a stroke is its row and nothing else, and controls fully survive a change of bass."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray
from support.own_basses import load_preset

from livebass import QUALITIES, preset_names
from livebass.engine.engine import Engine
from livebass.engine.prepare import bass_numbers, new_performer, take_message
from livebass.kernels.player.constants import FINGER, NAIL, PICK, POP, STANDARD, STROKE
from livebass.kernels.player.controls import follow_performer
from livebass.kernels.player.performer import CONTROLS, MAX_EVENTS
from livebass.kernels.string.records import EVENT

OWN = {  # the player's number replacing a 0 in a row
    "soft_width": "rounding_soft", "hard_width": "rounding", "soft_release": "release_time_soft",
    "hard_release": "release_time", "place": "pluck_position", "angle": "pluck_angle", "nearer": "nearer_when_hard",
}  # fmt: skip


@pytest.mark.parametrize("preset", preset_names())
def test_rows_of_strokes_are_the_standard_ones_with_the_players_numbers(preset: str) -> None:
    bass, given = load_preset(preset), STANDARD.copy()
    for name, value in vars(bass.player.pick).items():
        given[name][PICK] = value
    p = new_performer(bass_numbers(bass, [], 12))[0]
    for stroke in (FINGER, PICK, NAIL, POP):
        for name in STROKE.names or ():
            own = OWN.get(name)
            if own and given[name.replace("soft", "hard")][stroke] == 0:
                assert p["strokes"][name][stroke] == getattr(bass.player, own), (stroke, name)
            else:
                assert p["strokes"][name][stroke] == given[name][stroke], (stroke, name)


@pytest.mark.parametrize("stroke", [PICK, NAIL, POP])
@pytest.mark.parametrize("unevenness", [0.0, 0.1])
def test_a_stroke_is_its_row(stroke: int, unevenness: float) -> None:
    """Fingers with a pick's row pluck like a pick, down and up, even where fingers would rake."""
    bass = load_preset("jazz-finger")
    bass = replace(bass, player=replace(bass.player, unevenness=unevenness, pluck_angle=0.3, nearer_when_hard=0.01))
    engine = Engine(bass, QUALITIES["live"], 48_000)

    def played(number: int, row: int) -> NDArray[np.void]:
        p = new_performer(engine.numbers, 3)
        p["stroke"], p["strokes"][0, number] = number, p["strokes"][0, row]
        events, count = np.zeros(8 * MAX_EVENTS, EVENT), 0
        for k, string in enumerate((3, 2, 1, 1, 0, 2)):
            note = (0x90, bass.strings[string].open_note + 3 * k, 30 + 15 * k)
            count = take_message(p, engine.pool.records, 1000 * k, note, events, count)
        return events[:count]

    one, other = played(FINGER, stroke), played(stroke, stroke)
    assert len(one) == 6 and one.tobytes() == other.tobytes() != played(FINGER, FINGER).tobytes()


def test_controls_outlive_a_change_of_bass_whole() -> None:
    old, new = (new_performer(bass_numbers(load_preset(name), [], 12)) for name in ("jazz-finger", "slap"))
    for k, name in enumerate(CONTROLS.names or (), 1):
        if name != "adjusted":
            old["controls"][name] = k
    follow_performer(new.ctypes.data, old.ctypes.data)
    assert new["controls"].tobytes() == old["controls"].tobytes()
    assert new["player"].tobytes() != old["player"].tobytes() and new["notes"] == 0


@pytest.mark.parametrize("key", [9, 14, 16])  # of the strings A, D and E
def test_a_string_whose_key_is_held_is_played_after_a_change_of_bass(key: int) -> None:
    old, new = (Engine(load_preset(name), QUALITIES["live"], 48_000) for name in ("jazz-finger", "slap"))
    note, events = 45, np.zeros(2 * MAX_EVENTS, EVENT)  # available on E, A, D and G
    wanted = [string.called for string in load_preset("slap").strings].index(key % 12)

    def string_of_note() -> int:
        p = new_performer(new.numbers)
        follow_performer(p.ctypes.data, old.performer.ctypes.data)
        assert take_message(p, new.pool.records, 0, (0x90, note, 60), events, 0) >= 1
        return int(events["string"][0])

    default = string_of_note()
    take_message(old.performer, old.pool.records, 0, (0x90, key, 100), events, 0)
    assert string_of_note() == wanted != default
    take_message(old.performer, old.pool.records, 0, (0x80, key, 0), events, 0)
    assert string_of_note() == default
