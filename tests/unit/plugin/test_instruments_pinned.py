"""The release's instrument files, pinned: the bytes of each preset's numbers.

A change of the model, a preset or the file layout changes them. If it is meant, write the new ones:
`python tests/unit/plugin/test_instruments_pinned.py > tests/unit/plugin/instruments.json`. All numbers are the same on
every system, except the masses of the neck's resonances behind a fret: bending shapes use the C library's sines and
exponentials.
With and without fused multiply-add, glibc's give the same files.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import pytest

from livebass import load_preset, preset_names
from livebass.kernels.bass.change import NAME_PLACE
from livebass.kernels.bass.instrument import WORD
from livebass.model.instrument import Instrument, Neck, String
from livebass.model.neck import Admittance, Resonance, fretted_surface
from livebass.plugin.instrument import image_file

PINNED = json.loads((Path(__file__).parent / "instruments.json").read_text())
TABLE = ((30.0, 1e-4, 2e-4), (90.0, 3e-3, -1e-3), (140.0, 1e-3, 4e-4), (700.0, 2e-4, -3e-4))


def change(
    preset: str, neck: Callable[[Neck], Neck] | None = None, string: Callable[[String], String] | None = None,
    answering: str = "off",
) -> Instrument:  # fmt: skip
    """A preset with other necks, strings, or answers."""
    bass = load_preset(preset)
    return replace(
        bass,
        necks=tuple(map(neck, bass.necks)) if neck else bass.necks,
        strings=tuple(map(string, bass.strings)) if string else bass.strings,
        player=replace(bass.player, answering=answering),
    )


def choking(neck: Neck) -> Neck:
    """A neck whose eighth fret is so high that it stops the notes below."""
    heights = list(neck.fret_heights)
    heights[7] = 0.2 * heights[7]
    return replace(neck, fret_heights=tuple(heights))


def add_profile(neck: Neck) -> Neck:
    """A neck with wood between its frets."""
    x, h = neck.fret_positions, neck.fret_heights
    return replace(neck, surface=fretted_surface(x, h, 0.9e-3, x[-1] + 0.02))


BASSES: dict[str, Callable[[], Instrument]] = {
    **{name: lambda name=name: load_preset(name) for name in preset_names()},  # type: ignore[misc]
    "one-contact": lambda: load_preset("one-contact"),
    "tuned, capo, a4, cents": lambda: load_preset(
        "six-string", tuning="drop-a", capo=3, a4=432, temperament=[float(k) for k in range(12)]
    ),
    "just": lambda: load_preset("jazz-finger", temperament="just"),
    "down, capo": lambda: load_preset("flatwound", tuning="half-step-down", capo=2),
    "fretless, pythagorean": lambda: load_preset("fretless", tuning="drop-d", temperament="pythagorean"),
    "measured modes, capo": lambda: load_preset("paper-g", capo=5),
    "measured modes, just": lambda: load_preset("paper-bass", temperament="just", a4=436),
    "answering": lambda: change("slap", answering="always"),
    "answering, five strings": lambda: change("five-string", answering="pedal"),
    "choking": lambda: change("jazz-finger", choking),
    "profile": lambda: change("precision-finger", add_profile),
    "table": lambda: change("slap", lambda n: replace(n, admittance=Admittance(table=TABLE), free_length=0.45)),
    "table, answering": lambda: change("paper-bass", lambda n: replace(n, admittance=Admittance(table=TABLE)), None,
                                        "always"),
    "few resonances": lambda: change(
        "slap", lambda n: replace(n, admittance=Admittance((Resonance(80, 9, 1.2, 0), Resonance(190, 20, 0.7, 2)))),
    ),
    "rigid": lambda: change("muted", lambda n: replace(n, admittance=Admittance(), stop_conductance=0.0)),
    "board, paper, mute": lambda: change(
        "fretless", None, lambda s: replace(s, extra_damping=30.0, extra_damping_slope=2e-3, stiffness_law="paper")
    ),
}  # fmt: skip


def digest(name: str) -> str:
    """A part of the SHA-256 of an image without its first words and checksum."""
    return hashlib.sha256(image_file(BASSES[name]())[NAME_PLACE:-WORD]).hexdigest()[:16]


@pytest.mark.parametrize("name", BASSES)
def test_the_file_is_the_pinned_one(name: str) -> None:
    assert digest(name) == PINNED[name]


if __name__ == "__main__":
    print(json.dumps({name: digest(name) for name in BASSES}, indent=2))
