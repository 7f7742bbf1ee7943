"""The string that a hand pulls on the page: its shape, its limits, its sound, and its text in links."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
from support import node

from livebass import QUALITIES, load_preset
from livebass.engine.solve import output_signal
from livebass.model.trial import (
    PluckRequest,
    Trial,
    checked_trial,
    in_quality,
    initial_amplitudes,
    speaking_string,
)  # fmt: skip

BASS, STRING, FRET, RATE = "jazz-finger", 1, 3, 48000
PULLS = [
    (4e-3, 0.5, 0.0),
    (1.5e-3, 0.65, 0.7),
    (2e-3, 0.2, 0.0),
    (-1.2e-3, 0.4, 0.0),
    (-1e-3, 0.6, 0.7),
]  # apex, m; place, m from the stop; angle, rad
# Of full scale. `simulate` kicks the string with the tension of each frame, the page with that of four: 2e-5 without a
# contact. Contacts amplify that: a dozen to 2e-4, 39 to 8.5e-4, less than a pluck harder by a ten-thousandth does
CLOSE = (2e-3, 3e-4, 1e-4, 1e-3, 1e-3)
HOLD = """
const [hold, name, rate] = arguments, found = ask({hold, file: fileOf(name, {}), tier: 0, rate});
return {...found, weights: [...found.weights]};
"""
LET_GO = """
const [pulled, name, rate] = arguments;
const how = {tier: 0, rate, before: 240, frames: 480, heard: rate / 2};
const {sound, first, frame} = ask({pulled, file: fileOf(name, {}), ...how});
return [base64(new Uint8Array(sound.buffer)), first, frame];
"""
TESTED = """import {Held, pullText, readPull} from "./pulled.js";
export const tested = {Held, pullText, readPull};
globalThis.heldOf = (length, hardest, crowns) =>
  new Held({length, weights: new Float64Array(9), hardest, farthest: 6e-3}, crowns);
Object.assign(globalThis, tested);
"""


@pytest.fixture(scope="module")
def page(tmp_path_factory: pytest.TempPathFactory) -> Iterator[node.Page]:
    basses = {name: load_preset(name) for name in (BASS, "slap")}
    with node.page(basses, tmp_path_factory.mktemp("page")) as page:
        yield page


@pytest.fixture(scope="module")
def hands() -> Iterator[node.Node]:
    with node.node("test.js", {"test.js": TESTED}) as found:
        yield found


def trial_of(apex: float, place: float, angle: float) -> Trial:
    """What `simulate` solves for these numbers, as finely as the page."""
    bass = load_preset(BASS)
    s = speaking_string(bass, bass.strings[STRING].name, FRET)
    request = PluckRequest(apex=apex, at=place, angle=angle, duration=0.5)
    return checked_trial(bass, s, request, *in_quality(s, QUALITIES["live"]), RATE)


@pytest.mark.parametrize(("pull", "close"), list(zip(PULLS, CLOSE, strict=True)))
def test_a_pull_sounds_as_simulated_with_the_same_numbers(
    page: node.Page, pull: tuple[float, float, float], close: float
) -> None:
    apex, place, angle = pull
    pulled = {"string": STRING, "fret": FRET, "apex": apex, "place": place, "angle": angle}
    text, first, frame = page.run(LET_GO, pulled, BASS, RATE)
    sound = np.frombuffer(node.base64.b64decode(text), np.float32)
    wanted = output_signal(trial_of(apex, place, angle), load_preset(BASS).output)[: len(sound)]
    assert first == frame == 0  # from the release on
    assert np.abs(sound - wanted).max() < close < 0.01 < np.abs(wanted).max()


def test_nobody_pulls_a_string_into_its_frets() -> None:
    """Simulated, the farthest pull towards the frets is where the held string meets one."""
    s = trial_of(1e-3, 0.4, 0.0).speaking
    x, height = np.array(s.contact_position), np.array(s.contact_height)
    part = np.where(x < 0.4, x / 0.4, (s.length - x) / (s.length - 0.4))
    lowest = (height / part).max()
    assert trial_of(lowest + 1e-6, 0.4, 0.0).pluck.apex < -1e-3
    for apex in (lowest - 1e-6, 0.0, 0.04):
        with pytest.raises(ValueError, match="apex"):
            trial_of(apex, 0.4, 0.0)


def held(page: node.Page, string: int, fret: int, name: str) -> dict[str, Any]:
    found: dict[str, Any] = page.run(HOLD, {"string": string, "fret": fret, "note": 36}, name, RATE)
    return found


def test_the_held_shape_is_that_of_the_simulation(page: node.Page, hands: node.Node) -> None:
    found = held(page, STRING, FRET, BASS)
    script = "const [held, place, xs] = arguments; return new Held(held, []).shape(place, xs)"
    for apex, place, _ in PULLS:
        trial = trial_of(apex, place, 0.0)
        length, q = trial.speaking.length, initial_amplitudes(trial)
        x = np.linspace(0, length, 81)
        wanted = math.sqrt(2 / length) * np.sin(np.outer(x, np.arange(1, len(q) + 1)) * np.pi / length) @ q
        assert np.allclose(apex * np.array(hands.run(script, found, place, x.tolist())), wanted, atol=1e-9)
        assert 0.9 < wanted[np.abs(wanted).argmax()] / apex < 1  # a finger rounds the corner


def test_a_player_s_hardest_pluck_is_that_of_the_highest_velocity(page: node.Page) -> None:
    """A player who strikes has none; the bench's slider moves it."""
    found = held(page, STRING, FRET, BASS)
    assert found["farthest"] == load_preset(BASS).player.greatest_apex
    assert 1e-3 < found["hardest"]["apex"] < found["farthest"] and 0.3 < found["hardest"]["place"] < found["length"]
    harder = page.run(
        "return ask({hold: {string: 1, fret: 3, note: 36}, file: fileOf('jazz-finger', {hardest: 40}), tier: 0,"
        " rate: 48000}).hardest"
    )
    assert harder["apex"] > 1.1 * found["hardest"]["apex"]
    assert held(page, 0, 0, "slap").get("hardest") is None


def test_a_hand_stops_at_the_hardest_pluck_and_before_the_frets(hands: node.Node) -> None:
    script = "const [hardest, crowns, ...at] = arguments; return heldOf(1, hardest, crowns).grip(...at)"
    hardest = {"apex": 3e-3, "place": 0.5}
    assert hands.run(script, hardest, [], 0.5, 9e-3) == {"place": 0.5, "apex": 3e-3, "stop": "hardest"}
    near = hands.run(script, hardest, [], 0.9, 9e-3)  # with the same force
    assert near["apex"] == pytest.approx(3e-3 * 0.09 / 0.25, abs=1e-6) and near["stop"] == "hardest"
    assert hands.run(script, None, [], 0.5, 9e-3)["apex"] == pytest.approx(6e-3)
    assert hands.run(script, hardest, [], 0.5, 1.2344e-3) == {"place": 0.5, "apex": pytest.approx(1.234e-3), "stop": ""}
    down = hands.run(script, hardest, [[0.25, 1e-3], [0.5, 2.5e-3]], 0.5, -9e-3)  # the first stops it at 2 mm
    assert down["apex"] == pytest.approx(-0.8 * 2e-3) and down["stop"] == "frets"
    assert [hands.run(script, hardest, [], x, 0)["place"] for x in (-1, 2)] == pytest.approx([0.01, 0.99])


def test_a_pull_in_a_link_comes_back(hands: node.Node) -> None:
    script = "return [pullText(arguments[0]), readPull(pullText(arguments[0]))]"
    for apex in (2.944e-3, -1.5e-4):
        pull = {"string": 2, "fret": 12, "place": 0.3217, "apex": apex, "angle": math.radians(40)}
        text, read = hands.run(script, pull)
        assert text == f"2.12.3217.{1e6 * apex:.0f}.40" and read == pytest.approx(pull)
    for text in ("", "1.2.3", "2.12.3217.2944.400", "x.1.2.3.4"):
        assert hands.run("return readPull(arguments[0]) ?? null", text) is None
