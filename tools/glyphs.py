"""Writes livebass/plugin/c/picture/glyphs.h: outlines of a font's letters, for the text in the plugin's window.

    python tools/glyphs.py FONT.ttf

Each point has a byte for x, a byte for y, and a bit that tells whether it is on the curve. Contours that differ only in
their place stand once: a letter's contours are numbers of those, with a distance. The present outlines are matplotlib's
DejaVu Sans; its licence is beside them, in DEJAVU.txt.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from pathlib import Path

from fontTools.pens.recordingPen import DecomposingRecordingPen
from fontTools.ttLib import TTFont

TO = Path(__file__).parents[1] / "livebass/plugin/c/picture/glyphs.h"
LETTERS = [*range(0x20, 0x7F), *range(0xA1, 0xAD), *range(0xAE, 0x100)]  # the visible part of Latin 1
EM, DOWN, LEFT = 170, 48, 16  # units in an em; y and x may be as low as -DOWN and -LEFT
Point = tuple[int, int, bool]  # x, y, on the curve


def outline(font: TTFont, letter: int) -> tuple[int, list[list[Point]]]:
    """Returns a letter's advance and its contours."""
    glyphs, name = font.getGlyphSet(), font.getBestCmap()[letter]
    pen = DecomposingRecordingPen(glyphs)
    glyphs[name].draw(pen)
    contours: list[list[Point]] = []

    def add(place: tuple[float, float], on: bool) -> None:
        x, y = (round(value * EM / font["head"].unitsPerEm) for value in place)
        contours[-1].append((x + LEFT, y + DOWN, on))

    for what, places in pen.value:
        if what == "qCurveTo":
            for place in places[:-1]:
                add(place, False)
            add(places[-1], True)
        elif what in ("moveTo", "lineTo"):
            if what == "moveTo":
                contours.append([])
            add(places[0], True)
        else:
            assert what in ("closePath", "endPath"), what
    assert all(0 <= n < 256 for contour in contours for x, y, _ in contour for n in (x, y)), chr(letter)
    return round(glyphs[name].width * EM / font["head"].unitsPerEm), contours


def shared(letters: list[list[list[Point]]]) -> tuple[list[list[Point]], list[tuple[int, int, int]]]:
    """Returns the different contours of letters, and each contour as one of them, by number, and how far it moves."""
    different: dict[tuple[Point, ...], tuple[int, list[Point]]] = {}  # by their points from the first one on
    placed = []
    for contour in (contour for contours in letters for contour in contours):
        x, y, _ = contour[0]
        number, first = different.setdefault(
            tuple((px - x, py - y, on) for px, py, on in contour), (len(different), contour)
        )
        placed.append((number, x - first[0][0], y - first[0][1]))
    return [contour for _, contour in different.values()], placed


def rows(values: list[int]) -> list[str]:
    """Formats numbers as lines."""
    return [f"    {', '.join(map(str, values[k : k + 24]))}," for k in range(0, len(values), 24)]


def tuples(values: Sequence[tuple[int, ...]]) -> list[str]:
    """Formats tuples of numbers as lines."""
    return [
        f"    {', '.join(f'{{{str(value)[1:-1]}}}' for value in values[k : k + 12])},"
        for k in range(0, len(values), 12)
    ]


def header(file: Path) -> str:
    """Returns the text of glyphs.h for the font in a file."""
    font = TTFont(file)
    found = [outline(font, letter) for letter in LETTERS]
    contours, placed = shared([contours for _, contours in found])
    points = [point for contour in contours for point in contour]
    bits = [on for *_, on in points] + [False] * (-len(points) % 8)
    high = max(y for contour in found[LETTERS.index(ord("x"))][1] for _, y, _ in contour) - DOWN
    sizes = {"GLYPHS": len(found), "GLYPH_EM": EM, "GLYPH_DOWN": DOWN, "GLYPH_LEFT": LEFT, "GLYPH_X_HEIGHT": high}
    lines = [
        f"/* Outlines of {font['name'].getDebugName(4)}, written by tools/glyphs.py; their licence: DEJAVU.txt. */",
        f"enum {{ {', '.join(f'{name} = {value}' for name, value in sizes.items())} }};",
        "static const uint8_t glyph_advances[GLYPHS] = {", *rows([advance for advance, _ in found]), "};",
        "static const uint8_t glyph_counts[GLYPHS] = { /* contours */", *rows([len(own) for _, own in found]), "};",
        "static const struct {", "    uint8_t number; /* of the contour below */", "    int8_t x, y; /* it is moved */",
        "} glyph_contours[] = {", *tuples(placed), "};",
        "static const uint8_t contour_counts[] = { /* points */", *rows([len(own) for own in contours]), "};",
        "static const uint8_t contour_points[][2] = {", *tuples([(x, y) for x, y, _ in points]), "};",
        "static const uint8_t contour_bits[] = { /* of eight points a byte: 1: on the curve */",
        *rows([sum(bit << k for k, bit in enumerate(bits[at : at + 8])) for at in range(0, len(bits), 8)]),
        "};", "",
    ]  # fmt: skip
    return "\n".join(lines)


def main() -> None:
    """Writes the outlines of the font named on the command line."""
    TO.write_text(header(Path(sys.argv[1])))


if __name__ == "__main__":
    main()
