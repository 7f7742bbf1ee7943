"""Notes that no tuning brings to their pitch: `presets check` names these, with their string, fret and cents."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import pytest
from support.command import Run, cli_text
from support.costs import of_each_kind
from support.whole import lines

from livebass import Instrument, load_preset, preset_names
from livebass.model.instrument import speaking
from livebass.model.neck import Admittance, Resonance
from livebass.preset.checks import wolves


def with_a_light_neck(preset: str, part: float, folder: Path) -> Path:
    """A preset whose lowest bending resonance has `part` of its mass."""
    resonances = load_preset(preset).necks[0].admittance.resonances
    lowest = min((r for r in resonances if r.shape), key=lambda r: r.frequency)
    masses = [f"{r.mass * (part if r is lowest else 1.0)} kg" for r in resonances]
    file = folder / "light.toml"
    file.write_text(f'like = "{preset}"\nname = "Light"\n[neck]\nresonance_masses = {masses}\n'.replace("'", '"'))
    return file


def nearest_line(bass: Instrument, i: int, fret: int) -> float:
    """Cents from a note's pitch to the nearer of its fundamental's two lines, by string and neck as one system."""
    s = speaking(bass.strings[i], bass.necks[i], fret)
    pitch = 2 * math.pi * bass.strings[i].frequency(bass.strings[i].open_note + fret)
    found = lines(s, 1)
    assert found.share[0] > 0.5, "both are strong"
    return min((1200 * math.log2(line.imag[0] / pitch) for line in (found.first, found.second)), key=abs)


@pytest.mark.parametrize(
    ("preset", "part", "wolf", "cents"),
    [("jazz-finger", 0.2, ("G", 6), 7), ("slap", 0.25, ("G", 6), 12), ("short-scale", 0.2, ("G", 5), 24)],
)
def test_a_light_neck_has_a_wolf(
    run: Run, tmp_path: Path, preset: str, part: float, wolf: tuple[str, int], cents: int
) -> None:
    file = with_a_light_neck(preset, part, tmp_path)
    bass = load_preset(file)
    [(string, fret, off)] = wolves(bass)
    assert (string, fret) == wolf and off == pytest.approx(-cents, abs=0.5)
    assert nearest_line(bass, bass.string_index(string), fret) == pytest.approx(off, abs=3)
    [line] = [line for line in cli_text(run, "presets", "check", str(file)).splitlines() if "resonates" in line]
    assert f"{file.name}: {string} at fret {fret} ({cents} cents flat): " in line, line


@pytest.mark.parametrize("name", of_each_kind(preset_names()))
def test_no_shipped_preset_has_one(name: str) -> None:
    assert not wolves(load_preset(name))


@pytest.mark.parametrize(("part", "cents"), [(0.99, 35), (1.01, -38)])
def test_a_resonance_pushes_a_fundamental_away(part: float, cents: int) -> None:
    """One below the pitch pushes the stronger line up, one above it down."""
    bass = load_preset("jazz-finger")
    pitch = bass.strings[3].frequency(bass.strings[3].open_note)
    neck = replace(bass.necks[3], admittance=Admittance((Resonance(part * pitch, 40.0, 0.3, 0),)))
    [(string, fret, off)] = wolves(replace(bass, strings=bass.strings[3:], necks=(neck,)))
    assert (string, fret) == ("G", 0) and off == pytest.approx(cents, abs=1)
