"""A comparison's page of made-up notes."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import soundfile

RATE = 22_050
REAL = {"E1_pp": (41.2, 0.05), "E1_ff": (41.2, 0.4), "A1_ff": (55.0, 0.3)}  # names: pitch (Hz), level
OURS = {"E1_soft": (41.2, 0.2), "E1_hard": (41.2, 0.9), "A1_hard": (55.0, 0.02)}


def note(pitch: float, level: float, bright: float) -> Any:
    """A second of a plucked string, after some silence: partials that decay."""
    t = np.arange(RATE) / RATE
    partials = [np.exp(-(1 + k / 4) * t) * np.sin(2 * np.pi * k * pitch * t) / k**bright for k in range(1, 12)]
    sound = np.sum(partials, axis=0)
    return np.concatenate([np.zeros(RATE // 5), level * sound / np.abs(sound).max()])


def heard_page(folder: Path) -> Path:
    """Compares the notes of REAL with those of OURS, in `folder`; returns the page."""
    from livebass.cli.main import run

    for name, notes, bright in (("real", REAL, 1.0), ("ours", OURS, 1.2)):
        (folder / name).mkdir()
        for stem, (pitch, level) in notes.items():
            soundfile.write(folder / name / f"{stem}.wav", note(pitch, level, bright), RATE, subtype="FLOAT")
    place = folder / "page.html"
    assert run(["compare", str(folder / "real"), "--beside", str(folder / "ours"), "-o", str(place)]) == 0
    return place
