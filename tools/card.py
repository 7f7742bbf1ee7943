"""Draws livebass/web/card.png, the picture that messengers and networks show beside a link to the page.

python tools/card.py

A hard pluck of a Jazz bass's E string, from the side: the string at a few moments after the release, and the crowns
of the frets that it hits.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from livebass import QUALITIES, load_preset, simulate
from livebass.report.picture import figure, image
from livebass.web.public import CARD_SIZE, GROUND

PICTURE = Path(__file__).parents[1] / "livebass" / "web" / "card.png"
MOMENTS = [float(t) for t in np.linspace(0.2e-3, 8e-3, 14)]  # s after the release
DPI = 100
INK, AMBER, CROWN = "#f1e8db", "#f0a93b", "#b9aa98"


def main() -> None:
    bass = load_preset("jazz-finger")
    neck = bass.necks[0]
    solved = simulate(bass, string="E", apex=4.5e-3, at=0.7, duration=0.02, shape_at=MOMENTS, quality=QUALITIES["live"])
    _, x, (u, _) = solved.shapes(MOMENTS)
    width, height = (pixels / DPI for pixels in CARD_SIZE)
    drawn = figure(width, height)
    drawn.set_facecolor(GROUND)
    axes = drawn.add_subplot()
    axes.set_facecolor(GROUND)
    axes.axis("off")
    for place, crown in zip(neck.fret_positions, neck.fret_heights, strict=True):
        axes.plot([1e3 * place] * 2, [-6.0, 1e3 * crown], color=CROWN, linewidth=3, solid_capstyle="round")
    for k, shape in enumerate(u):
        last = k == len(u) - 1
        axes.plot(
            1e3 * x,
            1e3 * shape,
            color=AMBER,
            linewidth=4 if last else 1.6,
            alpha=1.0 if last else 0.2 + 0.5 * k / len(u),
        )
    axes.set_ylim(-6.0, 9.5)
    axes.text(0.03, 0.93, "livebass", color=INK, fontsize=54, fontstyle="italic", fontfamily="serif", fontweight="bold",
              transform=axes.transAxes, va="top")  # fmt: skip
    axes.text(0.03, 0.74, "An electric bass, computed as you play: its strings hit the frets.", color=INK, fontsize=23,
              transform=axes.transAxes, va="top")  # fmt: skip
    PICTURE.write_bytes(image(drawn, dpi=DPI))


if __name__ == "__main__":
    main()
