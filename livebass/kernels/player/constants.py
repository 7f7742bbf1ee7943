"""What a performer is made of and never changes: PLAYER, the hands; STROKE, what plucks; KEY_MAP, what keys do."""

from dataclasses import astuple

import numpy as np

from livebass.parts import Pick, PlayerNumbers
from livebass.rows import TINY, Word, record, words
from livebass.techniques import ACTIONS, FUNCTIONS

KEYS = 128
CONTROLLERS = 128

PLAYER_WORDS = words(PlayerNumbers)
PLAYER = record(PLAYER_WORDS)

# What keys and controllers do: numbers of techniques.py
KEY_MAP_WORDS = [
    Word("action", "i8", 0, ACTIONS - 1, (KEYS,)),
    Word("value", "i8", 0, KEYS - 1, (KEYS,)),
    Word("function", "i8", 0, FUNCTIONS - 1, (CONTROLLERS,)),
    Word("over_notes", "i8", 0, 1),  # 1: keys switch although the bass has their notes
]
KEY_MAP = record(KEY_MAP_WORDS)

# What plucks: a row each. Widths, releases, place, angle and `nearer` of 0 are the player's own.
STROKE_WORDS = [
    *words(Pick),
    Word("gentler", "f8", 0.0, 10.0),  # power of its part of the length by which a shorter string is played more gently
    # Every other stroke: nearer to the saddle (m), factors of apex and release, angle (rad; 0: the same)
    Word("other_nearer", "f8", -1.0, 1.0),
    Word("other_level", "f8", TINY, 10.0),
    Word("other_release", "f8", 0.0, 10.0),
    Word("other_angle", "f8", -1.6, 1.6),
    # 1: it goes down and up in turn. 0: index and middle finger take turns, alike if the player is even; one that goes
    # on to a lower string rakes, by itself.
    Word("two_ways", "i8", 0, 1),
]
STROKE = record(STROKE_WORDS)
FINGER, PICK, NAIL, POP = range(4)
STROKES = 4
# Estimates. The tip of a pick bends and slips off where flesh rolls; a pop pulls the string up. A pick's place and
# release times are such that notes brighten by 4 dB from velocity 30 to 60 and to 90, and click by 8 dB more than a
# finger's at the least of these. A pickup hears v with its sign: mirrored, a stroke up would be far under one down;
# it lifts the string out of that more than one down does. A hand plays a shorter string more gently: the same force
# would be heard up to 8 dB louder near the body, where a pickup lies under the middle of the string and no fret takes
# its fundamental; that of a pop, which frets take most from, up to 15 dB.
_MIDDLE = (4e-3, 0.933, 0.9, 0.0)  # the middle finger, which follows the index
STANDARD = np.array(
    [
        (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.5, *_MIDDLE, 0),  # FINGER
        (*astuple(Pick()), 0.5, 3e-3, 1.0, 1.0, -0.5, 1),  # PICK
        (2.5e-3, 2e-3, 400e-6, 40e-6, 0.0, 0.0, 0.0, 1.0, 0.5, *_MIDDLE, 0),  # NAIL
        (3e-3, 2.5e-3, 300e-6, 30e-6, 0.70, 0.2, 0.0, 1.7, 0.8, *_MIDDLE, 0),  # POP
    ],
    STROKE,
)
