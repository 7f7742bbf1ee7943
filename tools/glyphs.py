"""Writes livebass/plugin/c/picture/glyphs.h: outlines of a font's letters, for the text in the plugin's window.

    python tools/glyphs.py FONT.ttf

Each point has a byte for x, a byte for y, a bit that tells whether it is on the curve, and a bit that marks the last
point of a contour. The present outlines are matplotlib's DejaVu Sans; its licence is beside them, in DEJAVU.txt.
"""

from __future__ import annotations

import sys
from pathlib import Path

from fontTools.pens.recordingPen import DecomposingRecordingPen
from fontTools.ttLib import TTFont

TO = Path(__file__).parents[1] / "livebass/plugin/c/picture/glyphs.h"
LETTERS = [*range(0x20, 0x7F), *range(0xA1, 0xAD), *range(0xAE, 0x100)]  # the visible part of Latin 1
EM, DOWN, LEFT = 170, 48, 16  # units in an em; y and x may be as low as -DOWN and -LEFT
Point = tuple[int, int, bool, bool]  # x, y, on the curve, last


def outline(font: TTFont, letter: int) -> tuple[int, list[Point]]:
    """Returns a letter's advance and the points of its contours."""
    glyphs, name = font.getGlyphSet(), font.getBestCmap()[letter]
    pen = DecomposingRecordingPen(glyphs)
    glyphs[name].draw(pen)
    points: list[Point] = []

    def add(place: tuple[float, float], on: bool) -> None:
        x, y = (round(value * EM / font["head"].unitsPerEm) for value in place)
        points.append((x + LEFT, y + DOWN, on, False))

    for what, places in pen.value:
        if what in ("closePath", "endPath"):
            points[-1] = (*points[-1][:3], True)
        elif what == "qCurveTo":
            for place in places[:-1]:
                add(place, False)
            add(places[-1], True)
        else:
            assert what in ("moveTo", "lineTo"), what
            add(places[0], True)
    assert all(0 <= n < 256 for x, y, *_ in points for n in (x, y)), chr(letter)
    return round(glyphs[name].width * EM / font["head"].unitsPerEm), points


def rows(values: list[int]) -> list[str]:
    """Formats numbers as lines."""
    return [f"    {', '.join(map(str, values[k : k + 24]))}," for k in range(0, len(values), 24)]


def header(file: Path) -> str:
    """Returns the text of glyphs.h for the font in a file."""
    font = TTFont(file)
    found = [outline(font, letter) for letter in LETTERS]
    points = [point for _, all_points in found for point in all_points]
    bits = [point[2] | point[3] << 1 for point in points]
    bits += [0] * (-len(bits) % 4)
    high = max(y for _, y, *_ in found[LETTERS.index(ord("x"))][1]) - DOWN
    sizes = {"GLYPHS": len(found), "GLYPH_EM": EM, "GLYPH_DOWN": DOWN, "GLYPH_LEFT": LEFT, "GLYPH_X_HEIGHT": high}
    lines = [
        f"/* Outlines of {font['name'].getDebugName(4)}, written by tools/glyphs.py; their licence: DEJAVU.txt. */",
        f"enum {{ {', '.join(f'{name} = {value}' for name, value in sizes.items())} }};",
        "static const uint8_t glyph_advances[GLYPHS] = {", *rows([advance for advance, _ in found]), "};",
        "static const uint8_t glyph_counts[GLYPHS] = { /* points */", *rows([len(points) for _, points in found]), "};",
        "static const uint8_t glyph_points[][2] = {",
        *[f"    {', '.join(f'{{{x}, {y}}}' for x, y, *_ in points[k : k + 12])}," for k in range(0, len(points), 12)],
        "};",
        "static const uint8_t glyph_bits[] = { /* of four points a byte: 1: on the curve, 2: the last of a contour */",
        *rows([sum(bit << 2 * k for k, bit in enumerate(bits[at : at + 4])) for at in range(0, len(bits), 4)]),
        "};", "",
    ]  # fmt: skip
    return "\n".join(lines)


def main() -> None:
    """Writes the outlines of the font named on the command line."""
    TO.write_text(header(Path(sys.argv[1])))


if __name__ == "__main__":
    main()
