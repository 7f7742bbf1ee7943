"""The law of v written by `livebass identify`: found in the engine's renders, left out where there is none."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import soundfile
import tomlkit
from support.costs import quick
from support.own_basses import FOLDER, load_preset
from support.quiet import without_noise

from livebass.engine.render import render_to_array
from livebass.lab.identification.across import fit_own, heard_of_both, level_across
from livebass.lab.identification.identify import identify
from livebass.lab.identification.lines import Line
from livebass.lab.identification.partials import Found
from livebass.lab.identification.preset_text import new_preset
from livebass.lab.identification.result import Identified
from livebass.lab.identification.tables import table
from livebass.model import modes
from livebass.model.instrument import Instrument, speaking
from livebass.model.neck import Admittance
from livebass.model.quality import QUALITIES
from livebass.preset.load import preset_source
from livebass.score.score import single_note

RATE = 48_000
# This neck takes equally from all modes up to 900 Hz; v, on a stiffer one, loses less there.
LEVEL = tuple((float(nu), 12e-3 * min(1.0, math.exp((900 - nu) / 150)), 0.0) for nu in range(10, 3000, 10))


@cache
def bass(stiffness: float, longer: float, neck: bool = True, angle: float = 0.8) -> Instrument:
    """Jazz-finger, plucked aslant, whose E string has the given law of v, and whose pickups sense mostly v."""
    base = load_preset("jazz-finger")
    own = {"stiffness_across": stiffness, "longer_across": longer, "stop_across": 1.0}
    y = Admittance((), LEVEL) if neck else Admittance()
    necks = (replace(base.necks[0], admittance=y, **own), *base.necks[1:])
    pickups = tuple(replace(p, across=0.8) for p in base.output.pickups)
    made = replace(base, necks=necks, output=replace(base.output, pickups=pickups))
    return without_noise(made, pluck_angle=angle, angle_when_hard=0.0, unevenness=0.0)


def listen(folder: Path, played: Instrument, by: Instrument | None = None) -> Identified:
    """Renders a soft E of 4.5 s and identifies it from `by`."""
    score = single_note(played.strings[0].open_note, 20, 4.5, RATE)
    sound = render_to_array(played, score, QUALITIES["live"], tail=0.0).sum(axis=0)
    soundfile.write(folder / "e.wav", 0.3 * sound / np.abs(sound).max(), RATE, subtype="FLOAT")
    return identify(folder / "e.wav", by or bass(1.0, 0.0), modes=24, only_string=True)


@pytest.mark.parametrize(
    ("stiffness", "longer", "near"),
    quick([(4.0, 2e-3, 0.1e-3), (4.0, -2e-3, 0.1e-3), (9.0, 1e-3, 0.4e-3)], [(4.0, -2e-3, 0.1e-3)]),
)
def test_the_law_of_a_rendered_string_is_found(tmp_path: Path, stiffness: float, longer: float, near: float) -> None:
    """Starting from a bass with v like u: stiffness within a fifth, signed length within 0.1 mm.

    Lines closer to each other than their width determine less: 0.4 mm.
    """
    result = listen(tmp_path, bass(stiffness, longer))
    own = result.own
    assert own is not None and own.misfit < 0.2
    assert own.stiffness == pytest.approx(stiffness, rel=0.2)
    assert own.longer == pytest.approx(longer, abs=near)
    assert result.across is not None and np.sign(result.across.detuning) == -np.sign(longer)
    assert f"{own.longer * 1e3:+.2f} mm longer across" in table(result)
    two = [p for p in result.partials if p.v]
    ours = [result.string.measured_dampings[p.number - 1] for p in two]
    assert abs(np.median(np.log(np.array(ours) / [p.u.damping for p in two]))) < 0.1  # u's own, not the audible one


def test_the_preset_beats_and_decays_as_the_string_did(tmp_path: Path) -> None:
    """The identified preset has both lines: their beat within 5 %, their dampings within a fifth."""
    document: Any = tomlkit.parse(preset_source(str(FOLDER / "jazz-finger.toml"))[1])
    document["player"] |= {"pluck_angle": f"{math.degrees(0.8)} deg", "angle_when_hard": "0 deg"}
    for pickup in document["pickup"]:
        pickup["across"] = 0.8
    base, played = tmp_path / "base.toml", bass(4.0, 2e-3)
    base.write_text(tomlkit.dumps(document))
    result = listen(tmp_path, played, load_preset(str(base)))
    (tmp_path / "mine.toml").write_text(new_preset(str(base), "E", result, [tmp_path / "e.wav"]))
    made = load_preset(str(tmp_path / "mine.toml"))
    assert made.necks[0].own_across and made.necks[1] == load_preset(str(base)).necks[1]
    mine, real = (speaking(b.strings[0], b.necks[0], 0) for b in (made, played))
    at = [p.number - 1 for p in result.partials if p.v]
    assert len(at) > 8
    beats = [(modes.frequencies(s, 24) - modes.frequencies(s, 24, across=True))[at] for s in (mine, real)]
    np.testing.assert_allclose(*beats, rtol=0.05)
    for across in (False, True):
        ours, theirs = (modes.dampings(s, 24, across=across)[at] for s in (mine, real))
        np.testing.assert_allclose(ours, theirs, rtol=0.2)


SINGLE = {"v as u": (1.0, 0.0), "rigid": (1.0, 0.0, False), "straight up": (4.0, 2e-3, True, 0.0)}


@pytest.mark.parametrize("case", quick(SINGLE, ["v as u"]))
def test_single_lines_write_nothing(tmp_path: Path, case: str) -> None:
    result = listen(tmp_path, bass(*SINGLE[case]))
    assert result.own is None and not any(p.v for p in result.partials)
    text, shipped = new_preset("jazz-finger", "E", result, [tmp_path / "e.wav"]), preset_source("jazz-finger")[1]
    for key in ("stiffness_across", "longer_across"):
        assert text.count(key) == shipped.count(key)
    assert "v of its own" not in table(result)


def twins(law: float, longer: float, numbers: tuple[int, ...]) -> list[Found]:
    """Partials of two lines on the neck LEVEL by the given law, as in the model."""
    own = bass(law, longer)
    s = speaking(own.strings[0], own.necks[0], 0)
    both = [(modes.frequencies(s, 40, across=v), modes.dampings(s, 40, across=v)) for v in (False, True)]
    lines = [[Line(float(nu[j - 1]), float(sigma[j - 1]), 0.5) for nu, sigma in both] for j in numbers]
    return [Found(j, u.frequency, u.damping, 0.0, 0.0, 0.0, 1, u, v) for j, (u, v) in zip(numbers, lines, strict=True)]


def test_the_law_from_exact_lines() -> None:
    plain = bass(1.0, 0.0)
    found = twins(3.0, -1.5e-3, (2, 3, 5, 8, 9, 12))
    own = fit_own(plain.strings[0], plain.necks[0], found)
    assert own is not None and own.misfit < 0.01
    assert own.stiffness == pytest.approx(3.0, rel=0.01) and own.longer == pytest.approx(-1.5e-3, abs=1e-6)
    assert fit_own(plain.strings[0], plain.necks[0], found[:2]) is None  # too few
    swapped = [
        replace(p, u=replace(p.v, damping=p.u.damping), v=replace(p.u, damping=p.v.damping)) for p in found if p.v
    ]
    other = fit_own(plain.strings[0], plain.necks[0], swapped)
    assert other is not None and other.longer == pytest.approx(1.5e-3, abs=1e-5)  # sharper, not flatter


def test_lines_without_a_law_write_nothing() -> None:
    """Above as often as below, and a neck that cannot take v's losses."""
    plain = bass(1.0, 0.0, False)
    found = twins(3.0, 0.0, (2, 3, 5, 8, 9, 12))
    for k, p in enumerate(found):
        assert p.v is not None
        found[k] = replace(p, v=replace(p.v, frequency=p.u.frequency * (1 + (-1) ** k * 2e-3)))
    assert fit_own(plain.strings[0], plain.necks[0], found) is None


def test_both_lines_are_heard_as_the_partial_was() -> None:
    """With the preset's law of v, u of a single line is damped to make both lines decay as the partial did."""
    own = bass(4.0, 2e-3)
    s = speaking(own.strings[0], own.necks[0], 0)
    found = [replace(p, v=None, damping=d) for p, d in zip(twins(4.0, 2e-3, (2, 5, 9)), (1.5, 2.0, 4.0), strict=True)]
    level = 0.4
    sigma = heard_of_both(s, found, level, False)
    for p, ours in zip(found, sigma, strict=True):
        t = np.linspace(0, math.log(10) * 1.5 / p.damping, 2000)
        string = replace(s.string, measured_frequencies=(p.frequency,) * p.number, measured_dampings=(ours,) * p.number)
        one = replace(s, string=string)
        nu, slow = (f(one, p.number, across=True)[-1] for f in (modes.frequencies, modes.dampings))
        wave = np.exp(-ours * t) + level * np.exp((2j * math.pi * (nu - p.frequency) - slow) * t)
        assert -np.polyfit(t, np.log(np.abs(wave)), 1)[0] == pytest.approx(p.damping, rel=0.1)
    assert heard_of_both(s, found, 0.0, False) == pytest.approx([1.5, 2.0, 4.0])


def test_how_loud_v_is() -> None:
    base = load_preset("jazz-finger")
    player, sensed = base.player, base.output.pickups[0].across
    assert {p.across for p in base.output.pickups} == {sensed}
    half = player.pluck_angle + player.angle_when_hard / 2
    assert level_across(base, "E") == pytest.approx(sensed * math.tan(half))
    assert level_across(bass(2.0, 0.0, True, 0.0), "E") == 0
    assert level_across(replace(base, player=replace(player, technique="slap")), "E") == 0
    assert level_across(load_preset("paper-g"), "G") == 0
    picked = replace(base, player=replace(player, stroke="pick"))
    assert level_across(picked, "E") == pytest.approx(sensed * math.tan(player.pick.angle))
