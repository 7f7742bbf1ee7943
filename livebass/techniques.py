"""What a player asks for: techniques that keys switch, functions of controllers, parameters of hosts, by number."""

# Parameters that hosts move while the bass plays, and their limits; 0 is always "as the bass itself has it". The sound
# of the gain is the synth's (block.py).
GAIN_DB, TONE_POT, PLUCK_POSITION, DYNAMICS, TECHNIQUE, HAND_DAMPING, UNEVENNESS, BEND_RANGE, PARAMETERS = range(9)
LEAST = (-60.0, -1.0, -1.0, -12.0, 0.0, -1.0, -1.0, 0.0)
MOST = (20.0, 1.0, 1.0, 12.0, 3.0, 1.0, 1.0, 24.0)
OWN, PLUCKED, THUMB_ON_TWO, THUMB_ON_ALL = range(4)  # values of TECHNIQUE

# Key switches, by the key map of the bass. Those of the first row, the strokes, DETACH and LEFT_SLAP hold while the
# key is held, the last of WITH_FINGERS, WITH_PICK and WITH_THUMB until the next of them, STOP_ALL and HAND_AT happen at
# once. The value of ON_STRING is a pitch class of an open string, that of HAND_AT a fret.
NO_SWITCH, ON_STRING, GHOST, LEGATO, HARMONIC, TAP, PALM, SLIDE, VIBRATO = range(9)
WITH_FINGERS, WITH_PICK, WITH_THUMB, STOP_ALL, DOWN_STROKE, UP_STROKE, HAND_AT, DETACH, LEFT_SLAP, ACTIONS = range(
    9, 19
)
# Controllers, likewise by the key map; from CC_PARAMETER on they move the parameters above
NO_FUNCTION, CC_PLACE, CC_VOLUME, CC_EXPRESSION, CC_LET_RING, CC_VIBRATO, CC_PALM, CC_SLIDE = range(8)
CC_LEGATO, CC_BEND, CC_HAND, CC_BLEND, CC_PARAMETER = range(8, 13)
FUNCTIONS = CC_PARAMETER + PARAMETERS
LEARNED = 102  # the controller that moves parameter 0 in every map, unless it says otherwise, and so on
