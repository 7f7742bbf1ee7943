"""Figures of matplotlib, made without pyplot so that no display is asked for, and the files made of them."""

from __future__ import annotations

import io
from typing import Any

from livebass.units import one_line

DPI = 110
CHANGING = {"png": "Software", "svg": "Date"}  # metadata that would differ between two files of the same figure


def check_matplotlib(needed: str) -> None:
    """Raise LookupError with the line `needed` where matplotlib is not installed."""
    try:
        import matplotlib.figure  # noqa: F401
    except ImportError:
        raise LookupError(needed) from None


def shown_text(text: str) -> str:
    """`text`, in which there may be names, for a figure: one line, and no formula between two $."""
    return one_line(text).replace("$", r"\$")


def figure(width: float, height: float) -> Any:
    """An empty `matplotlib.figure.Figure` of that size in inches."""
    from matplotlib.figure import Figure

    return Figure(figsize=(width, height), layout="constrained")


def image(drawn: Any, kind: str = "png", dpi: float = DPI) -> bytes:
    """The PNG or SVG file of a figure; the same figure gives the same bytes.

    `dpi` is that of a PNG, and of what an SVG holds as pixels.
    """
    import matplotlib as mpl

    data = io.BytesIO()
    with mpl.rc_context({"svg.hashsalt": "livebass"}):
        drawn.savefig(data, format=kind, dpi=dpi, metadata={CHANGING[kind]: None})
    return data.getvalue()
