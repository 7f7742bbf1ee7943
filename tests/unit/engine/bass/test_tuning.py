"""The sound of tuned basses: pitch, force of plucks, strings kept at their tuning, key switches."""

from __future__ import annotations

import numpy as np
import pytest
from support.messages import on
from support.own_basses import load_preset
from support.pitch import pitch

from livebass import QUALITIES, quality_with, render_to_array, score_of
from livebass.engine.engine import Engine
from livebass.engine.prepare import take_message
from livebass.kernels.string.records import EVENT, PLUCK
from livebass.model.instrument import Instrument
from livebass.rows.arrays import Floats
from livebass.rows.units import cents

RATE = 22050
SMALL = quality_with("live", modes=60, contact_rate=200e3)


def sound(bass: Instrument, note: int, velocity: int = 40) -> Floats:
    """All strings (strings, n)."""
    return render_to_array(bass, score_of([(0.0, 0.9, note, velocity)], RATE), SMALL, tail=0.0)


@pytest.mark.parametrize(
    "keys",
    [{"a4": 432}, {"tuning": "drop-c"}, {"capo": 4}, {"temperament": [5.0 * (k % 5) - 10 for k in range(12)]}],
    ids=str,
)
def test_notes_are_in_tune(keys: dict[str, object]) -> None:
    bass = load_preset("jazz-finger", **keys)  # type: ignore[arg-type]
    for string in bass.strings:
        for note in (string.open_note, string.open_note + 3):
            heard = sound(bass, note)
            i = int(np.argmax(np.abs(heard).max(axis=1)))
            expected = bass.strings[i].frequency(note)
            assert abs(cents(pitch(heard[i, RATE // 10 :], RATE, expected) / expected)) < 2, (string.name, note)


def apex(bass: Instrument, string: int, velocity: int) -> float:
    """The apex (m) of a pluck of an open string."""
    engine = Engine(bass, SMALL, RATE)
    events = np.zeros(64, EVENT)
    note = bass.strings[string].open_note
    count = take_message(engine.performer, engine.pool.records, 0, on(note, velocity), events, 0)
    (x,) = events["apex"][:count][events["kind"][:count] == PLUCK]
    return float(x)


@pytest.mark.parametrize("velocity", [1, 60, 127])
def test_the_same_force_pulls_a_slack_string_farther(velocity: int) -> None:
    default, dropped = load_preset("jazz-finger"), load_preset("jazz-finger", tuning="drop-d")
    assert apex(dropped, 0, velocity) / apex(default, 0, velocity) == pytest.approx(2 ** (4 / 12))
    assert apex(dropped, 1, velocity) == apex(default, 1, velocity)


def test_strings_that_are_not_tuned_keep_every_bit() -> None:
    default, dropped = load_preset("slap"), load_preset("slap", tuning="drop-d")
    for note in (33, 45):
        assert np.array_equal(sound(default, note, 120)[1:], sound(dropped, note, 120)[1:])


def test_key_switches_call_strings_by_their_own_notes() -> None:
    """Key 9 is for the A string, whatever its tuning, and 19 for the G string."""
    bass = load_preset("jazz-finger", tuning="half-step-down", capo=2)
    for key, wanted in ((16, 0), (9, 1), (14, 2), (19, 3)):
        engine = Engine(bass, SMALL, RATE)
        note = bass.strings[3].open_note + 1
        engine.send(np.zeros(2, np.int64), np.array([on(key), on(note)], np.uint8))
        heard = engine.process(RATE // 20)
        assert int(np.argmax(np.abs(heard).max(axis=1))) == wanted


def test_the_slackest_strings_bear_the_hardest_notes() -> None:
    """A fourth down, and the lowest possible A: no motion is scaled back."""
    bass = load_preset("slap", tuning="bead", a4=380)
    engine = Engine(bass, QUALITIES["live"], 48000)
    keys = [string.open_note + fret for string in bass.strings for fret in (0, 7)]
    heard = np.concatenate(
        list(engine.play(score_of([(0.1 * k, 0.2, key, 127) for k, key in enumerate(keys)], 48000), 0.0)), 1
    )
    assert np.isfinite(heard).all() and engine.report().weakened == 0
