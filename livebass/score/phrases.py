"""Demo phrases for presets."""

from __future__ import annotations

from livebass.rows.bounds import one_of
from livebass.rows.units import note_number
from livebass.score.score import Score, score_of

# The demo phrases, in E minor: soft and hard notes on every string, a bend, repeated notes.
TEMPO = 112.0  # quarter notes per minute
STYLES = ("finger", "slap", "techniques")

# One row per note: (start in sixteenths, length in sixteenths, note, velocity). At velocities below 40 the string does
# not reach the frets, above 110 it hits most of them: the phrase has both, to show in a spectrogram.
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
# During the held D3 the wheel rises by a tone and comes back: (sixteenth, position).
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
    """Returns a phrase to try a bass with.

    Args:
        rate: Sample rate of the frames in the score, Hz.
        style: "finger" or "slap", about nine seconds each; or "techniques", one phrase for each technique, about 26 s.

    Raises:
        ValueError: Another style.

    Example:
        >>> demo_score(48000, "slap").notes
        43
    """
    one_of("style", style, STYLES)
    if style == "techniques":
        return techniques_score(rate)
    rows, bends = (SLAP, SLAP_BENDS) if style == "slap" else (FINGER, FINGER_BENDS)
    sixteenth = 60 / TEMPO / 4
    return score_of(
        [(at * sixteenth, length * sixteenth, note_number(name), velocity) for at, length, name, velocity in rows],
        rate,
        [(at * sixteenth, position) for at, position in bends],
        name=f"demo, {style}",
    )


# One phrase per technique: its name, the key switch held meanwhile (None: none), the controllers before it (number,
# value), and its notes: start and length in eighths, note, velocity. Legato notes overlap.
Phrase = tuple[str, int | None, tuple[tuple[int, int], ...], tuple[tuple[float, float, str, int], ...]]
TECHNIQUES: tuple[Phrase, ...] = (
    ("fingers", 13, (), ((0, 1, "E1", 60), (1, 1, "G1", 70), (2, 1, "A1", 80), (3, 2, "E2", 100))),
    ("hammer-on and pull-off", 12, (), (
        (0, 3.9, "A1", 80), (1, 1, "B1", 70), (3, 0.9, "B1", 70), (4, 4, "D2", 80), (5, 1, "E2", 80),
        (6.5, 1, "F#2", 90))),
    ("trill", 12, (), ((0, 6, "A2", 80), *((1 + k / 2, 0.25, "B2", 80) for k in range(8)))),
    ("tapping", 2, (), ((0, 0.9, "E2", 80), (1, 0.9, "B2", 100), (2, 0.9, "E3", 110), (3, 2, "G2", 100))),
    ("slides", 4, (), ((0, 4, "E2", 90), (1.5, 2.4, "B2", 90), (4, 4, "B2", 90), (5.5, 2.4, "F#2", 90))),
    ("vibrato", None, ((1, 127),), ((0, 6, "D3", 90),)),
    ("bend", None, ((1, 0),), ((0, 6, "D3", 90),)),
    ("palm mute, loose", None, ((9, 25),), tuple((k, 0.9, n, 90) for k, n in enumerate(("E1", "G1", "A1")))),
    ("palm mute, tight", None, ((9, 110),), tuple((k, 0.9, n, 90) for k, n in enumerate(("E1", "G1", "A1", "E2")))),
    ("ghost notes", 10, ((9, 0),), tuple((k / 2, 0.4, n, 90) for k, n in enumerate(("A1", "A1", "E2", "A1", "E2")))),
    ("left-hand slap", 7, (), tuple((k / 2, 0.4, n, 100) for k, n in enumerate(("E1", "E1", "A1", "D2")))),
    ("natural harmonics", 17, (), ((0, 2, "G3", 90), (1, 2, "D3", 90), (2, 2, "A2", 90), (3, 3, "D4", 90))),
    ("artificial harmonics", 17, (), ((0, 2, "F#2", 90), (2, 3, "B2", 100))),
    ("let ring", None, ((64, 127),), ((0, 0.5, "E1", 80), (1, 0.5, "B1", 70), (2, 0.5, "G2", 70), (3, 0.5, "D3", 70))),
    ("thumb and pops", 18, ((64, 0),), (
        (0, 0.5, "E1", 110), (1, 0.4, "E2", 110), (1.5, 0.4, "E1", 90), (2, 0.5, "A1", 110), (3, 0.5, "G2", 120))),
    ("pick", 15, (), ((0, 0.5, "E1", 90), (0.5, 0.5, "E1", 80), (1, 1, "G1", 100), (2, 2, "A1", 110))),
    ("a finger's last word", 13, (), ((0, 6, "E1", 60),)),
)  # fmt: skip
WHEELS = {"bend": tuple((1 + k / 8, min(k, 24 - k, 8) / 8) for k in range(25))}  # (eighth, position) in a phrase


def techniques_score(rate: int) -> Score:
    """The phrases of TECHNIQUES one after the other at `rate` Hz, a fifth of a second apart."""
    eighth, at = 0.25, 0.1  # s
    notes: list[tuple[float, float, int, int]] = []
    controls: list[tuple[float, int, int]] = []
    bends: list[tuple[float, float]] = []
    for called, switch, before, phrase in TECHNIQUES:
        length = max(start + long for start, long, _, _ in phrase) * eighth
        if switch is not None:
            notes.append((at, length + 0.05, switch, 100))
        controls += [(at, number, value) for number, value in before]
        notes += [
            (at + 0.02 + start * eighth, long * eighth, note_number(name), velocity)
            for start, long, name, velocity in phrase
        ]
        bends += [(at + start * eighth, position) for start, position in WHEELS.get(called, ())]
        at += length + 0.25
    return score_of(notes, rate, bends, name="demo, techniques", controls=controls)
