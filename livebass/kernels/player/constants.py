"""The fixed parts of a performer: PLAYER, the hands; STROKE, the plucking finger or pick; KEY_MAP, the keys."""

from dataclasses import astuple

import numpy as np

from livebass.rows.parts import Pick, PlayerNumbers
from livebass.rows.row import TINY, Word, record, words
from livebass.rows.techniques import ACTIONS, FUNCTIONS

KEYS = 128
CONTROLLERS = 128

PLAYER_WORDS = words(PlayerNumbers)
PLAYER = record(PLAYER_WORDS)

# What keys and controllers do, as numbers from techniques.py
KEY_MAP_WORDS = [
    Word("action", "i8", 0, ACTIONS - 1, (KEYS,)),
    Word("value", "i8", 0, KEYS - 1, (KEYS,)),
    Word("function", "i8", 0, FUNCTIONS - 1, (CONTROLLERS,)),
    Word("over_notes", "i8", 0, 1),  # 1: keys switch even if the bass has their notes
]
KEY_MAP = record(KEY_MAP_WORDS)

# One row per way to pluck. For widths, releases, place, angle and `nearer`, 0 means the player's own value.
STROKE_WORDS = [
    *words(Pick),
    Word("gentler", "f8", 0.0, 10.0),  # a shorter string's force is scaled by its part of the length to this power
    # Every other stroke: shift towards the saddle (m), factors for apex and release, angle (rad; 0: the same)
    Word("other_nearer", "f8", -1.0, 1.0),
    Word("other_level", "f8", TINY, 10.0),
    Word("other_release", "f8", 0.0, 10.0),
    Word("other_angle", "f8", -1.6, 1.6),
    # 1: strokes alternate down and up. 0: index and middle finger alternate (identical if the player is even); a finger
    # that moves on to a lower string rakes it without alternating.
    Word("two_ways", "i8", 0, 1),
]
STROKE = record(STROKE_WORDS)
FINGER, PICK, NAIL, POP = range(4)
STROKES = 4
# Estimates. A pick's tip bends and slips off where flesh rolls; a pop pulls the string up. A pick's place and release
# times are set so that notes brighten by 4 dB from velocity 30 to 60 and again to 90, and click 8 dB more than a
# finger's at velocity 30. A pickup hears v with its sign: a mirrored up-stroke would be far quieter than a down-stroke,
# so it lifts the string more than a down-stroke does. A hand plays a shorter string more gently:
# near the body, where a pickup lies under the string's middle and no fret damps its fundamental, the same force would
# sound up to 8 dB louder; a pop, which loses most to the frets, up to 15 dB.
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
