"""Two phrases in E minor to hear a preset by: soft and hard notes, every string, a bend, repeated notes."""

from __future__ import annotations

from livebass.score import Score, score_of
from livebass.units import note_number

TEMPO = 112.0  # quarter notes per minute
STYLES = ("finger", "slap")

# One row a note: (start in sixteenths, length in sixteenths, note, velocity). Velocities under 40 leave the
# frets alone, those above 110 strike most of them: the phrase has both, so that a spectrogram shows it.
FINGER = (
    (0, 3, "E1", 36), (4, 1.5, "E1", 52), (6, 1.5, "G1", 60), (8, 3, "A1", 48), (12, 1, "B1", 66),
    (13, 1, "B1", 72), (14, 1, "D2", 80), (15, 1, "D#2", 70),
    (16, 3, "E2", 92), (19, 1, "E1", 45), (20, 1, "E1", 64), (21, 1, "E1", 80), (22, 1, "E1", 96),
    (23, 1, "E1", 108), (24, 2, "G2", 88), (26, 2, "F#2", 76), (28, 2, "D2", 72), (30, 2, "B1", 64),
    (32, 2.5, "C2", 84), (35, 1, "G2", 92), (36, 1, "C3", 100), (37, 2.5, "B2", 88),
    (40, 4, "D3", 116), (44, 1, "B2", 84), (45, 1, "G2", 76), (46, 1, "D2", 70), (47, 1, "A1", 66),
    (48, 3, "E1", 124), (51, 1, "E1", 58), (52, 1, "G1", 96), (53, 1, "A1", 100), (54, 2, "B1", 118),
    (56, 8, "E1", 30),
)  # fmt: skip
# Half-way through the held D3 the wheel rises by a tone and comes back: (sixteenth, position).
FINGER_BENDS = tuple((40.5 + k / 8, min(k, 28 - k) / 14) for k in range(29))

SLAP = (
    (0, 1, "E1", 112), (2, 1, "E1", 100), (3, 0.7, "E2", 118), (4, 1, "E1", 106), (6, 0.7, "D2", 112),
    (7, 0.7, "E2", 120), (8, 1, "G1", 110), (10, 1, "G1", 98), (11, 0.7, "G2", 118), (12, 1, "A1", 112),
    (13, 0.7, "A2", 116), (14, 1, "A#1", 104), (15, 0.7, "B1", 110),
    *((16 + k, 0.7, note, 96 + 26 * (k % 4 == 0) + 14 * (k % 4 == 3)) for k, note in enumerate(
        ("E1", "E1", "E2", "D2", "E1", "G1", "G2", "E2", "E1", "E1", "D2", "E2", "A1", "A2", "B1", "B2"))),
    (32, 3, "C2", 34), (36, 3, "G1", 42), (40, 3, "A1", 50), (44, 1, "B1", 62), (45, 1, "B1", 74),
    (46, 1, "B1", 88), (47, 1, "B1", 104),
    (48, 1, "E1", 124), (50, 1, "E1", 108), (51, 0.7, "E2", 122), (52, 0.7, "G2", 124), (54, 1, "D2", 100),
    (55, 1, "D#2", 104), (56, 8, "E1", 127),
)  # fmt: skip
SLAP_BENDS = tuple((58 + k / 8, -min(k, 16 - k) / 16) for k in range(17))


def demo_score(rate: int, style: str = "finger") -> Score:
    """A phrase of about eight seconds at `rate` Hz, as a player with that `style` would play it.

    Raises ValueError for a style that is not in STYLES.
    """
    if style not in STYLES:
        raise ValueError(f"style {style!r}: allowed are {', '.join(STYLES)}")
    rows, bends = (SLAP, SLAP_BENDS) if style == "slap" else (FINGER, FINGER_BENDS)
    sixteenth = 60 / TEMPO / 4
    return score_of(
        [
            (at * sixteenth, length * sixteenth, note_number(name), velocity)
            for at, length, name, velocity in rows
        ],
        rate,
        [(at * sixteenth, position) for at, position in bends],
        name=f"demo, {style}",
    )
