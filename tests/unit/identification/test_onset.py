"""Pluck, pickups and tone found from notes of basses with known values."""

from __future__ import annotations

import json
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
import soundfile
from support.command import Run, cli_text
from support.costs import quick
from support.own_basses import FOLDER, load_preset
from support.presets import STRING_A

from livebass.engine.solve import output_signal
from livebass.lab.identification.identify import identify
from livebass.lab.identification.onset import can_be_fitted
from livebass.lab.identification.result import Identified
from livebass.lab.identification.tables import table
from livebass.model.instrument import Instrument, Pluck, speaking
from livebass.model.trial import Trial

BASE = FOLDER / "jazz-finger.toml"
RATE, CONTACT_RATE = 48_000, 384_000


def default_bass() -> Instrument:
    """A Jazz Bass plucked near the neck pickup, its pot half open: the sought values lie on either side.

    Its neck takes less than `jazz-finger`'s, which would blur the levels of single partials.
    """
    bass = replace(load_preset("jazz-finger"), necks=load_preset("muted").necks)
    levels = (1.0, 0.8)
    pickups = tuple(replace(p, level=level) for p, level in zip(bass.output.pickups, levels, strict=True))
    player = replace(
        bass.player, pluck_position=0.8, rounding=7e-3, rounding_soft=14e-3, release_time=60e-6, release_time_soft=6e-4
    )
    output = replace(bass.output, pickups=pickups, coil=replace(bass.output.coil, tone=0.8))
    return replace(bass, output=output, player=player)


def other_bass(place: float, rounding: float, pickups: tuple[float, ...], tone: float) -> Instrument:
    """The usual bass with another pluck (m from the saddle, m), pickups (m) and tone."""
    bass = default_bass()
    moved = tuple(replace(p, position=x) for p, x in zip(bass.output.pickups, pickups, strict=True))
    output = replace(bass.output, pickups=moved, coil=replace(bass.output.coil, tone=tone))
    length = bass.strings[0].length
    player = replace(bass.player, pluck_position=1 - place / length, rounding=rounding, rounding_soft=0.0)
    return replace(bass, output=output, player=player)


def note_of(bass: Instrument, string: int) -> np.ndarray:
    """A softly plucked note of the open string, with noise at -80 dB before and under it."""
    s = speaking(bass.strings[string], bass.necks[string], 0)
    at = bass.player.pluck_position * s.length
    trial = Trial(
        s,
        Pluck(2e-4, at, bass.player.rounding, release=100e-6),
        200,
        CONTACT_RATE,
        RATE,
        3.0,
        s.length - bass.output.sensor,
    )
    sound = output_signal(trial, bass.output)
    sound = np.concatenate([np.zeros(RATE // 4), 0.5 / np.abs(sound).max() * sound])
    return sound + np.random.default_rng(1).normal(scale=5e-5, size=sound.size)


CASES = {
    "near the bridge": (1, 0.09, 4e-3, (0.16, 0.055), 1.0),
    "over the neck": (3, 0.24, 9e-3, (0.15, 0.07), 0.3),
    "dark": (0, 0.14, 7e-3, (0.15, 0.06), 0.02),
}


@cache
def find_onset(case: str, folder: Path) -> Identified:
    string, place, rounding, pickups, tone = CASES[case]
    path = folder / f"{case}.wav"
    soundfile.write(path, note_of(other_bass(place, rounding, pickups, tone), string), RATE, subtype="FLOAT")
    return identify(path, default_bass(), modes=40)


@pytest.mark.parametrize("case", quick(CASES, ["near the bridge"]))
def test_pluck_pickups_and_tone(case: str, tmp_path: Path) -> None:
    _, place, rounding, pickups, tone = CASES[case]
    onset = find_onset(case, tmp_path).onset
    assert onset is not None and onset.misfit < 3.5 < 8.0 < onset.before
    assert onset.place == pytest.approx(place, abs=3e-3)
    assert [p.position for p in onset.pickups] == pytest.approx(pickups, abs=6e-3)
    levels = [p.level for p in onset.pickups]
    assert levels[1] / levels[0] == pytest.approx(0.8, rel=0.05)
    # tone or rounding, which dim high partials alike: the preset decides, with a doubt
    known = abs(np.log((onset.tone + 0.02) / (tone + 0.02))) < 0.3 and onset.rounding == pytest.approx(
        rounding, rel=0.3
    )
    assert known or any("a choice: a tone of " in doubt for doubt in onset.doubts)


def test_a_finger_may_be_as_dark_as_a_tone(tmp_path: Path) -> None:
    """The tone is almost closed; an open one under a wider finger is as dark, and the doubt states the truth."""
    onset = find_onset("dark", tmp_path).onset
    assert onset is not None and onset.tone > 0.4
    assert any("a tone of 0.02 under a finger of 7 mm is as dark as" in doubt for doubt in onset.doubts)


@pytest.mark.slow
def test_the_preset_gets_them(run: Run, tmp_path: Path) -> None:
    """The written preset plays the other bass's note, and keeps everything else."""
    string, place, rounding, pickups, tone = CASES["near the bridge"]
    path, mine = tmp_path / "a.wav", tmp_path / "mine.toml"
    soundfile.write(path, note_of(other_bass(place, rounding, pickups, tone), string), RATE, subtype="FLOAT")
    out = cli_text(run, "identify", path, "-p", BASE, "--modes", 40, "-o", mine, "--json", tmp_path / "a.json")
    assert "plucked 9" in out or "plucked 8" in out
    said = json.loads((tmp_path / "a.json").read_text())["onset"]
    assert all(f"doubt: {doubt}" in out for doubt in said["doubts"])
    made, base = load_preset(str(mine)), load_preset("jazz-finger")
    length = base.strings[string].length
    assert (1 - made.player.pluck_position) * length == pytest.approx(said["pluck_from_saddle_m"], abs=1e-4)
    assert [p.position for p in made.output.pickups] == pytest.approx(
        [p["position_m"] for p in said["pickups"]], abs=1e-4
    )
    assert made.output.coil.tone == pytest.approx(said["tone"], abs=5e-3)
    width = (made.player.rounding * made.player.rounding_soft) ** 0.5
    assert width == pytest.approx(said["rounding_m"], rel=1e-2)
    assert made.strings[2] == base.strings[2] and made.necks[2] == base.necks[2]
    alone = tmp_path / "alone.toml"
    cli_text(run, "identify", path, "-p", BASE, "--modes", 40, "--only-string", "-o", alone)
    kept = load_preset(str(alone))
    assert (kept.output, kept.player) == (base.output, base.player)
    assert kept.strings[string].measured_dampings == made.strings[string].measured_dampings


MINIMAL = f"""
name = "Small"
[neck]
scale_length = "34 in"
{STRING_A}core_diameter = "0.020 in"
[[pickup]]
position = "90 mm"
"""


def test_a_preset_of_few_words_gets_them(run: Run, tmp_path: Path) -> None:
    """A preset without coil, output and player."""
    _, place, rounding, pickups, tone = CASES["near the bridge"]
    path, small, mine = tmp_path / "a.wav", tmp_path / "small.toml", tmp_path / "mine.toml"
    soundfile.write(path, note_of(other_bass(place, rounding, pickups, tone), 1), RATE, subtype="FLOAT")
    small.write_text(MINIMAL)
    cli_text(run, "identify", path, "-p", small, "--modes", 20, "-o", mine)
    made, base = load_preset(str(mine)), load_preset(str(small))
    assert len(made.output.pickups) == 1 and made.output.pickups[0].position != base.output.pickups[0].position
    assert made.player.pluck_position != base.player.pluck_position and made.player.release_time > 0


def test_what_the_preset_cannot_have() -> None:
    """A slapped bass, or one with a displacement sensor, keeps its own."""
    assert can_be_fitted(load_preset("jazz-finger"), "A")
    assert not can_be_fitted(load_preset("slap"), "A")
    assert not can_be_fitted(load_preset("paper-g"), "G")


@pytest.mark.slow
def test_one_pickup_leaves_a_choice(tmp_path: Path) -> None:
    """A lone pickup's comb looks like the pluck's: their assignment is a doubt."""
    bass = default_bass()
    one = replace(bass, output=replace(bass.output, pickups=bass.output.pickups[:1]))
    played = replace(one, player=replace(one.player, pluck_position=1 - 0.1 / one.strings[1].length, rounding=2e-3))
    path = tmp_path / "a.wav"
    soundfile.write(path, note_of(played, 1), RATE, subtype="FLOAT")
    result = identify(path, one, modes=40)
    assert result.onset is not None and result.onset.place == pytest.approx(0.1, abs=0.012)
    doubt = result.onset.doubts[0]
    assert doubt.startswith("the levels leave a choice: plucked 1") and f"doubt: {doubt}\n" in table(result)
