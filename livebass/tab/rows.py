"""From strokes to the rows of a score (kernels/player/words.py): each stroke with its string, fret and technique."""

from __future__ import annotations

from collections import Counter

from livebass.kernels.player import words
from livebass.rows.techniques import NO_SWITCH, OWN, POPS, SLIDE_STEP, TECHNIQUE_ROWS, THUMB_ON_ALL
from livebass.tab.moves import BEGIN, BEND, CONTROL, END, EXPRESSION, LATER, VIBRATO, Moves, ending, following, missing
from livebass.tab.perform import DEAD, HARMONIC, OFF_DOWN, OFF_UP, PINCH, SLIDE, TAP, Performance, Stroke

KINDS = {VIBRATO: words.STRING_VIBRATO, BEND: words.STRING_WHEEL, EXPRESSION: words.STRING_EXPRESSION}
STRUCK = {"slap": THUMB_ON_ALL, "pop": POPS}  # what strikes, by kind of stroke
HELD = {  # techniques, by kind of stroke
    DEAD: "ghost", TAP: "tap", PINCH: "pinch", SLIDE: "slide", OFF_DOWN: "slide_off_down", OFF_UP: "slide_off_up",
    "left slap": "left_slap",
}  # fmt: skip
DIRECTIONS = {"down": words.DOWN, "up": words.UP}
SLOWEST = (1 << words.SLOW[1]) - 1
Tick = tuple[int, int, float]  # kind, number, value


def to_rows(performance: Performance, frets: int, dynamics: float) -> tuple[list[tuple[int, Tick]], Counter[str]]:
    """(tick, event) of a performance in order, on strings with `frets`, and how many of each sign it leaves out.

    `dynamics`, dB, change the force of every stroke.
    """
    tempos, lacks = performance.tempos, Counter(performance.lacks)
    moves, found = Moves(tempos, again=True), list[tuple[int, int, Tick]]()
    for stroke, after in following(performance.strokes):
        if sign := missing(stroke, frets):
            lacks[sign] += 1
            continue
        found += [(move.tick, CONTROL, (KINDS[move.what], stroke.string, move.value)) for move in moves.of(stroke)]
        at, end = tempos.tick(stroke.time), ending(tempos, stroke, after)
        if stroke.kind in (OFF_DOWN, OFF_UP):  # as the exported file, which presses a key switch first
            found.append((at + 1, LATER, _end(stroke)))
            continue
        found.append((at, BEGIN, _begin(stroke, dynamics)))
        if not end.tied:
            found.append((end.tick, END, _end(stroke)))
    return [(at, event) for at, _, event in sorted(found, key=lambda row: row[:2])], lacks


def _begin(stroke: Stroke, dynamics: float) -> Tick:
    number = {
        words.STRING: stroke.string, words.FRET: stroke.fret, words.VELOCITY: stroke.velocity,
        words.PALMED: int(stroke.palm), words.DIRECTION: DIRECTIONS.get(stroke.direction, 0),
        words.WITH: _technique(stroke),
    }  # fmt: skip
    value = {
        words.STRIKES: STRUCK.get(stroke.kind, OWN), words.PARTIAL: stroke.partial if stroke.kind == HARMONIC else 0,
        words.SLOW: min(round(stroke.slow / SLIDE_STEP), SLOWEST),
        words.LOUDER: words.NO_DYNAMICS + round(dynamics / words.DYNAMICS_STEP),
    }  # fmt: skip
    return words.STROKE, words.joined(number), words.joined(value)


def _end(stroke: Stroke) -> Tick:
    off = stroke.kind in (OFF_DOWN, OFF_UP)
    return (
        words.STROKE_END,
        words.joined({words.STRING: stroke.string, words.WITH: _technique(stroke) if off else NO_SWITCH}),
        0.0,
    )


def _technique(stroke: Stroke) -> int:
    return TECHNIQUE_ROWS[HELD[stroke.kind]].number if stroke.kind in HELD else NO_SWITCH
