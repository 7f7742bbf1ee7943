"""The letters of the plugins' window."""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path

import pytest
from support.places import TOOLS

from livebass.plugin.build import C


def test_letters_are_those_of_the_font(monkeypatch: pytest.MonkeyPatch) -> None:
    """The tool's output from the font bundled with matplotlib, whose licence is beside it."""
    matplotlib = pytest.importorskip("matplotlib")
    pytest.importorskip("fontTools")
    monkeypatch.syspath_prepend(str(TOOLS))
    header: Callable[[Path], str] = __import__("glyphs").header
    fonts = Path(matplotlib.get_data_path()) / "fonts/ttf"
    assert header(fonts / "DejaVuSans.ttf") == (C / "picture/glyphs.h").read_text()
    assert (C / "picture/DEJAVU.txt").read_text() == (fonts / "LICENSE_DEJAVU").read_text()
    sys.modules.pop("glyphs", None)
