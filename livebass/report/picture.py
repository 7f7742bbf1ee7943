"""matplotlib figures, made without pyplot to need no display, and files made from them."""

from __future__ import annotations

import importlib
import io
from collections.abc import Iterable
from typing import Any

from livebass.rows.units import one_line
from livebass.system.extras import install

DPI = 110
CHANGING = {"png": "Software", "svg": "Date"}  # metadata that would differ between two files of the same figure


def check_plots(what: str, after: str = "") -> None:
    """Raises LookupError if a library of the extra `plots` is missing: one line that `what` needs it, then `after`."""
    check_installed(what, "plots", ("matplotlib.figure", "jinja2"), after)


def check_installed(what: str, extras: str, modules: Iterable[str], after: str = "") -> None:
    """Raises LookupError if one of `modules` cannot be imported: `what` needs it, and how to install `extras`."""
    for module in modules:
        try:
            importlib.import_module(module)
        except ImportError:
            raise LookupError(f"{what} needs {module.partition('.')[0]}: {install(extras)}{after}") from None


def shown_text(text: str) -> str:
    """`text`, perhaps with names, for a figure: one line, and no formula between two $."""
    return one_line(text).replace("$", r"\$")


def figure(width: float, height: float) -> Any:
    """An empty `matplotlib.figure.Figure` of that size in inches."""
    from matplotlib.figure import Figure

    return Figure(figsize=(width, height), layout="constrained")


def image(drawn: Any, kind: str = "png", dpi: float = DPI) -> bytes:
    """The PNG or SVG file of a figure; the same figure gives the same bytes.

    `dpi` is for a PNG, and for the pixel parts of an SVG.
    """
    import matplotlib as mpl

    data = io.BytesIO()
    with mpl.rc_context({"svg.hashsalt": "livebass"}):
        drawn.savefig(data, format=kind, dpi=dpi, metadata={CHANGING[kind]: None})
    return data.getvalue()
