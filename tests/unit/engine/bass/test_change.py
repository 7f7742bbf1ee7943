"""One kernel changes a bass: Python, the plugins and the page get the same image for every slider."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from support.costs import quick
from support.kept import Refused, image_made, slider_values
from support.own_basses import load_preset
from support.wasm import Bare

from livebass.kernels.bass.change import MIN_CAPACITANCE, make_change
from livebass.model.bench import change_bass
from livebass.model.instrument import Effects, Instrument, Pick
from livebass.plugin.instrument import image_file, instrument_file
from livebass.rows.techniques import FRETS, SLIDER_ROWS

BASSES = (
    "jazz-finger",
    "fretless",
    "paper-bass",
    "slap",
    "five-string-active",
    "precision-finger",
    "upright",
    "paper-g",
)


def natively(file: bytes, values: dict[str, float]) -> bytes | int:
    """The kernel's image, as a plugin makes it, or the status of its failure."""
    try:
        return image_made(file, values)
    except Refused as refused:
        kernel, state = refused.args
        assert kernel == make_change
        return int(state)


def by_python(bass: Instrument, values: dict[str, float]) -> bytes:
    """The image of the changed bass; empty if its neck cannot be played."""
    try:
        return image_file(change_bass(bass, values))
    except ValueError:
        return b""


def places() -> list[dict[str, float]]:
    """Bench values with each slider moved to two places, and with many moved at once."""
    made = []
    for symbol, row in SLIDER_ROWS.items():
        p = row.parameter
        for part in (0.3, 0.62):
            value = round(p.minimum + part * (p.maximum - p.minimum), 2)
            made.append({symbol: value, "fret": 7.0} if symbol == "fret_height" else {symbol: value})
    all_at_once = {symbol: round(row.parameter.maximum / 8, 2) for symbol, row in SLIDER_ROWS.items()}
    return [*made, all_at_once | {"fret": 5.0}, {"fret": 7.0, "fret_height": 1.5, "action": -1.5}]


@pytest.mark.parametrize("name", quick(BASSES, BASSES[3:]))
def test_python_plugins_and_page_make_the_same_image(name: str) -> None:
    bass = load_preset(name)
    file, own, moved = instrument_file(bass), image_file(bass), 0
    for values in places():
        wanted, page = by_python(bass, values), Bare().changed(file, slider_values(values))
        native = natively(file, values)
        assert native == page
        assert native == wanted or (not wanted and isinstance(native, int)), values
        moved += native != own
    assert moved > 14


def test_sliders_at_rest_change_nothing() -> None:
    for name in BASSES:
        bass = load_preset(name)
        assert change_bass(bass, {}) == bass and natively(instrument_file(bass), {}) == image_file(bass)


def test_a_file_with_strokes_and_effects_keeps_them() -> None:
    bass = load_preset("jazz-finger")
    bass = replace(bass, player=replace(bass.player, pick=Pick(place=0.9)), effects=Effects(drive=0.25))
    for values in ({"gauge": 10.0}, {"action": -0.5}):
        made = natively(instrument_file(bass), values)
        assert made == image_file(change_bass(bass, values)) != image_file(bass)


def test_action_moves_the_strings_in_proportion() -> None:
    """Halved at the lowest string, it is halved at every string, and the hand stays."""
    bass = load_preset("jazz-finger")
    low = change_bass(bass, {"action": -1.2})
    gaps = [-neck.fret_heights[11] for neck in low.necks]
    assert gaps == pytest.approx([1.2e-3, 1.1e-3, 1.05e-3, 1.0e-3])
    assert low.grazed == bass.necks and change_bass(low, {"nut_height": 0.1}).grazed == bass.necks
    assert [neck.fret_heights[0] for neck in low.necks] == [neck.fret_heights[0] for neck in bass.necks]


def test_a_percentage_is_of_what_each_string_has() -> None:
    bass = load_preset("jazz-finger")
    necks = tuple(replace(neck, contact_loss=100.0 + 50 * i) for i, neck in enumerate(bass.necks))
    strings = tuple(replace(string, relaxation=2e-3) for string in bass.strings)
    bass = replace(bass, strings=strings)
    made = change_bass(replace(bass, necks=necks), {"contact_loss": 100.0, "wear": 50.0, "finger_width": 100.0})
    assert [neck.contact_loss for neck in made.necks] == [200.0, 300.0, 400.0, 500.0]
    for old, new in zip(bass.strings, made.strings, strict=True):
        assert new.thermoelastic == pytest.approx(1.5 * old.thermoelastic)
        assert new.relaxation == pytest.approx(3e-3)
    assert made.player.rounding == 2 * bass.player.rounding
    assert made.player.rounding_soft == 2 * bass.player.rounding_soft


def test_a_thicker_string_has_the_same_pitch() -> None:
    bass = load_preset("jazz-finger")
    thick = change_bass(bass, {"gauge": 20.0, "tension": 10.0})
    for old, new in zip(bass.strings, thick.strings, strict=True):
        assert new.nominal_fundamental == pytest.approx(old.nominal_fundamental)
        assert new.diameter == pytest.approx(1.2 * old.diameter)
        assert new.tension == pytest.approx(1.2**2 * 1.1 * old.tension)
        stiffness = [s.inharmonicity * s.tension for s in (old, new)]
        assert stiffness[1] == pytest.approx(1.2**4 * stiffness[0])


def test_one_fret_is_lifted_and_a_pickup_stays_where_there_is_room() -> None:
    bass = load_preset("jazz-finger")
    made = change_bass(bass, {"fret": 7.0, "fret_height": 0.12, "pickup_2_place": -60.0, "pickup_1_height": 1.0})
    for old, new in zip(bass.necks, made.necks, strict=True):
        raised = [b - a for a, b in zip(old.fret_heights, new.fret_heights, strict=True)]
        assert raised == pytest.approx([0.12e-3 * (k == 6) for k in range(len(raised))], abs=1e-12)
    neck, bridge = made.output.pickups
    assert neck.position == bass.output.pickups[0].position and bridge.position == bridge.aperture / 2
    assert neck.level > 1.2 * bass.output.pickups[0].level
    assert change_bass(bass, {"cable": -500.0}).output.coil.capacitance >= MIN_CAPACITANCE
    assert change_bass(bass, {"fret": float(FRETS), "fret_height": 1.0}) == bass  # it has no such fret


def test_values_count_in_hundredths() -> None:
    """Plugin hosts keep values in float32."""
    bass = load_preset("jazz-finger")
    assert change_bass(bass, {"action": float(np.float32(-0.9))}) == change_bass(bass, {"action": -0.9})
