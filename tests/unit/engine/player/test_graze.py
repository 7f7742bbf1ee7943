"""The neck whose grazing gauges the hand's force: player.graze_action and related keys."""

from __future__ import annotations

import copy
from typing import Any

import numpy as np
import pytest
from support.costs import slow
from support.own_basses import FOLDER

from livebass import QUALITIES, Instrument
from livebass.engine.engine import Engine
from livebass.engine.image import image_of
from livebass.kernels.bass.instrument import LIVE, STUDIO
from livebass.kernels.string.records import PLUCK
from livebass.model.instrument import speaking
from livebass.model.modes import grazing_apex
from livebass.plugin.instrument import image_file
from livebass.preset.build import Builder
from livebass.preset.load import preset_tables
from livebass.preset.source import PresetError
from livebass.rows.arrays import Floats

ACTION = {"unit": "mm", "values": [2.4, 2.2, 2.1, 2.0]}  # of jazz-finger


def bass_of(preset: str = "jazz-finger", player: dict[str, Any] | None = None, **neck: Any) -> Instrument:
    """A preset with other keys for its player and its neck; None removes a key."""
    own = FOLDER / f"{preset}.toml"
    data = copy.deepcopy(preset_tables(own if own.exists() else preset)[1])
    data["player"] |= player or {}
    data["neck"] = {key: value for key, value in (data["neck"] | neck).items() if value is not None}
    return Builder(preset).instrument(data)


def play(bass: Instrument, velocity: int, frames: int = 0) -> tuple[Floats, int]:
    """The apexes (m) of a note on each string, and the number of contacts of the lowest."""
    engine = Engine(bass, QUALITIES["live"], 48000)
    keys = [string.open_note for string in bass.strings]
    events = engine.play_messages(np.zeros(len(keys), np.int64), np.array([[0x90, key, velocity] for key in keys]))
    engine.process(frames)
    return events["apex"][events["kind"] == PLUCK], engine.voices[0].note()[1]


def test_a_lower_action_buzzes_more_where_the_hand_stays() -> None:
    """E1 at velocity 110: the pull is the same on every neck, so a lower neck makes more contacts."""
    kept = {"graze_action": ACTION}
    necks = [f"{mm} mm" for mm in (3.0, 2.4, 1.5, 1.0)]
    hands = [play(bass_of(player=kept, action=action), 110, 24000) for action in necks]
    contacts = [count for _, count in hands]
    assert contacts == sorted(set(contacts)) and contacts[-1] >= 2 * contacts[1]
    assert all(np.array_equal(apexes, hands[0][0]) for apexes, _ in hands)
    softer = [play(bass_of(action=action), 60)[0] for action in necks[1:]]
    assert (softer[0] > softer[1]).all() and (softer[1] > softer[2]).all(), "without it the hand follows"
    assert play(bass_of(action="1 mm"), 110, 24000)[1] < contacts[-1]


@pytest.mark.parametrize("preset", ["jazz-finger", "fretless", "paper-bass", "slap-impulse"])
def test_the_necks_own_action_changes_nothing(preset: str) -> None:
    data = preset_tables(preset)[1]
    action = data["neck"].get("action")
    if action is None:  # measured: each string's action is its gap at fret 12
        action = {"unit": "m", "values": [-neck.fret_heights[11] for neck in bass_of(preset).necks]}
    for velocity in (20, 90, 127):
        own, other = (play(bass_of(preset, player), velocity)[0] for player in ({}, {"graze_action": action}))
        assert np.allclose(own, other, rtol=1e-12, atol=0) and (preset == "paper-bass" or np.array_equal(own, other))


@pytest.mark.parametrize(
    "player, neck, capo",
    [
        ({"graze_action": ACTION}, {"action": "1.2 mm"}, 0),
        ({"graze_action": ACTION}, {"lift": {"7": "0.5 mm"}}, 3),
        ({"graze_relief": "0.3 mm"}, {"relief": "0.8 mm"}, 0),
        ({"graze_nut_height": "0.5 mm"}, {"nut_height": "0.2 mm"}, 3),
        slow({"graze_action": ACTION}, {"action": "1.2 mm"}, 3),
        slow({"graze_action": ACTION}, {"lift": {"7": "0.5 mm"}}, 0),
        slow({"graze_relief": "0.3 mm"}, {"relief": "0.8 mm"}, 3),
        slow({"graze_nut_height": "0.5 mm"}, {"nut_height": "0.2 mm"}, 0),
    ],
)
def test_the_hand_stays_whatever_the_neck_becomes(player: dict[str, Any], neck: dict[str, Any], capo: int) -> None:
    def notes(bass: Instrument) -> Floats:
        return np.array([play(bass, velocity)[0] for velocity in (1, 60, 127)])

    def tables(player: dict[str, Any], **neck: Any) -> Instrument:
        data = copy.deepcopy(preset_tables("jazz-finger")[1]) | {"capo": capo}
        data["player"] |= player
        data["neck"] |= neck
        return Builder("f").instrument(data)

    default, moved, kept = notes(tables({})), notes(tables({}, **neck)), notes(tables(player, **neck))
    assert np.allclose(kept, default, rtol=1e-12, atol=0)
    assert not np.allclose(moved, default, rtol=1e-3, atol=0) or "lift" in neck


def test_files_have_the_hand() -> None:
    """In every tier a file's pool has the heights of the hand's neck, or of its own neck without one."""
    bass = bass_of("fretless", {"graze_action": "3 mm"})
    file = image_of(image_file(bass))
    for tier in (LIVE, STUDIO):
        pool = file.pool(tier, 48000)
        first = pool.records[0, 0]
        rows = [
            pool.memory[(int(first[name]) - pool.memory.ctypes.data) // 8 :][: first["points"]]
            for name in ("heights", "hand_heights")
        ]
        assert (rows[1][250:] < rows[0][250:] - 1e-4).all()
    assert play(bass_of("fretless"), 60)[0][0] < play(bass, 60)[0][0]


@pytest.mark.parametrize(
    "preset, player, says",
    [
        ("jazz-finger", {"graze_action": "0 mm"}, "player.graze_action must be from 0.1 mm to 20 mm"),
        ("jazz-finger", {"graze_action": ["2 mm"]}, "player.graze_action: 1 values for 4 strings"),
        ("jazz-finger", {"graze_relief": "5 mm", "graze_action": "0.1 mm"}, "a fret of this neck stands"),
        ("jazz-finger", {"graze_heights": 1}, "unknown key"),
        ("paper-bass", {"graze_relief": "0.2 mm"}, "not allowed together with a measured neck"),
        ("paper-fretless", {"graze_action": "2 mm"}, "not allowed together with a measured profile"),
    ],
)  # fmt: skip
def test_what_is_wrong_is_said(preset: str, player: dict[str, Any], says: str) -> None:
    with pytest.raises(PresetError, match=r"player\.graze") as error:
        bass_of(preset, player)
    assert says in str(error.value)


def test_grazing_is_by_the_hands_neck() -> None:
    """A force of 1 on the open string grazes the neck that gauges the hand."""
    hand = {"graze_action": "3.3 mm", "unevenness": 0.0, "softest": 1.0, "hardest": 1.0, "greatest_apex": "30 mm"}
    bass = bass_of(player=hand)
    engine = Engine(bass, QUALITIES["live"], 48000)
    event = engine.play_messages(np.zeros(1, np.int64), np.array([[0x90, 28, 60]]))
    event = event[event["kind"] == PLUCK][0]
    neck = speaking(bass.strings[0], bass.grazed[0], 0)
    assert event["apex"] == pytest.approx(grazing_apex(neck, float(event["place"])), rel=1e-3)
