"""Preset files that tests write, and strings for them."""

from __future__ import annotations

from pathlib import Path

from livebass import Instrument, load_preset

STRING_A = """\
[[string]]
name = "A"
open_note = "A1"
linear_density = "23.88 g/m"
tension = "215.5 N"
diameter = "0.085 in"
"""
STRING_G = """\
[[string]]
name = "G"
open_note = "G2"
linear_density = "6.69 g/m"
diameter = "1.14 mm"
"""


def load_text(folder: Path, text: str | bytes, name: str = "mine.toml") -> Instrument:
    """The bass of a preset file with this text, written into `folder`."""
    (folder / name).write_bytes(text if isinstance(text, bytes) else text.encode())
    return load_preset(folder / name)
