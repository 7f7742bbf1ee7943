"""The performer: PERFORMER, the record of all that a bass's player remembers. In this package p is that record.

The performer turns MIDI messages into string events: which string and fret, how hard, when a note stops. It decides as
each message arrives, only from what was played so far: a file and a keyboard give the same performance, and the same
input always gives the same result. [audio thread]
"""

import numpy as np

from livebass.kernels.machine.native import record_at, records_at
from livebass.kernels.player.constants import KEY_MAP, KEYS, PLAYER, STROKE, STROKES
from livebass.kernels.string.records import OPERATOR
from livebass.rows.techniques import ACTIONS, PARAMETERS, SETTINGS

MAX_STRINGS = 8
FREE, HELD, PEDALLED = 0, 1, 2
MAX_EVENTS = 9 * MAX_STRINGS  # per message at most: reset-controllers
GUITAR_RANGE, MPE_RANGE = 12.0, 48.0  # semitones of the wheel of a string or a channel, until RPN 0 sets another
MAX_RANGE = 96  # semitones of pitch bend; the fine part of the range comes on top ...
# Meaning of the channels: none; one per string (MIDI mode 4); one per note (MPE)
ALL_ALIKE, STRING_A_CHANNEL, NOTE_A_CHANNEL = range(3)
CHANNELS = 16
ANY = CHANNELS  # instead of a channel: the whole bass
# When idle strings may answer sounding ones (no hand rests on them): never, while the pedal is down, always
NEVER, WITH_PEDAL, ALWAYS, WHILE_HELD = range(4)
ANSWERS_WHEN = 4
STACK = 4  # held keys that one string can go back to, one after another
OVER = 1e-9  # signal below which a bass that rings out has ended
FADE = 0.03  # s: a bass that rings out fades in this time when another bass or an overload needs its place

# Set by the messages of one channel
CHANNEL = np.dtype(
    [
        ("volume", "f8"),
        ("expression", "f8"),
        ("pedal", "i8"),
        ("wheel", "f8"),  # -1 to 1
        ("range", "f8"),  # semitones, of the wheel
        ("bend_up", "f8"),  # semitones, by the controller ...
        ("bend_ready", "i8"),  # ... once it has been below BEND_STARTS
        ("vibrato", "f8"),  # 0 to 1
        ("fine", "i8"),  # tuning, 0 to 16383, a semitone to either side of IN_TUNE
        ("coarse", "i8"),  # tuning, semitones
        ("rpn", "i8"),  # selected; NO_RPN: none
    ],
    align=True,
)
NO_RPN = 16383
IN_TUNE = 8192

# Kept when the bass changes
CONTROLS = np.dtype(
    [
        ("channel", CHANNEL, (CHANNELS + 1,)),  # the last, ANY, holds the latest value from any channel outside a zone
        ("level", "f8"),  # the gain parameter, if one of the bass's own controllers moves it
        ("blend", "f8"),  # of the pickups: -1 the neck pickup alone, 1 the bridge pickup alone; 0: the bass's own blend
        ("palm", "f8"),  # 0 to 1, by the controller ...
        ("palm_set", "f8"),  # ... and by `set_amount`
        ("vibrato_set", "f8"),  # 0 to 1, of all channels, by `set_amount`
        ("legato", "i8"),  # 1: by the controller
        ("sliding", "i8"),  # 1: by the controller
        ("latched", "i8", (ACTIONS,)),  # 1: the technique is on without a key
        ("slide_time", "f8"),  # s, of a whole slide; 0: SLIDE_TIME per fret
        ("string_bend", "f8", (MAX_STRINGS,)),  # semitones, of one string, on top of the wheel
        ("string_expression", "f8", (MAX_STRINGS,)),  # factor for one string, by its own channel
        ("string_of", "i8", (KEYS,)),  # string for each key's next note; -1: the performer chooses
        ("place_of", "f8", (KEYS,)),  # of each key's next note, as PLUCK_POSITION; NaN: none of its own
        ("adjusted", "f8", (PARAMETERS,)),  # the parameters' values; 0: the bass's own
        ("settings", "f8", (SETTINGS,)),  # of the player, by number; 0: none
        # channels
        ("mode", "i8"),  # ALL_ALIKE, STRING_A_CHANNEL or NOTE_A_CHANNEL
        ("first_channel", "i8"),  # first channel with its own string or notes ...
        ("channels", "i8"),  # ... and how many
        ("mono", "i8"),  # 1: overlapping notes at most MONO_STEP semitones apart are legato
        ("channel_range", "f8"),  # semitones
        ("channel_wheel", "f8", (CHANNELS,)),  # -1 to 1
        ("channel_place", "f8", (CHANNELS,)),  # of the channel's next note, as PLUCK_POSITION; NaN: none of its own
    ],
    align=True,
)

# State of the hands: the left frets, the right plucks
HANDS = np.dtype(
    [
        ("state", "i8", (MAX_STRINGS,)),  # FREE, HELD or PEDALLED
        ("key", "i8", (MAX_STRINGS,)),  # the key that plays the string, -1: none since all-off
        ("fret", "i8", (MAX_STRINGS,)),
        ("channel", "i8", (MAX_STRINGS,)),  # that played the string last; -1: none, or in a zone
        ("age", "i8", (MAX_STRINGS,)),  # the clock when its note began
        ("clock", "i8"),  # counts notes
        ("stack", "i8", (MAX_STRINGS, STACK)),  # keys held on a string under the sounding one, the last on top
        ("stack_channel", "i8", (MAX_STRINGS, STACK)),  # ... and their channels
        ("stacked", "i8", (MAX_STRINGS,)),
        ("holding", "i8", (KEYS,)),  # channels that hold each key, a bit each
        ("note_bend", "f8", (MAX_STRINGS,)),  # semitones, of its current note, on top of all other bends
        ("note_vibrato", "f8", (MAX_STRINGS,)),  # 0 to 1, of its current note
        ("place", "i8"),  # fret of the first finger
        ("shift", "i8", (CHANNELS + 1,)),  # frets by which a sliding wheel has moved away from the notes' frets
        ("latest", "i8"),  # string of the last note; -1: it was dropped
        ("channel_string", "i8", (CHANNELS,)),  # string of the channel's last note; -1: none
        ("other", "i8"),  # 1: the next stroke is the middle finger's, or goes up
        ("late", "f8"),  # s, by which the present stroke waits
        ("stroked", "i8"),  # the string of the last stroke ...
        ("stroked_at", "i8"),  # ... and its frame
        ("ghosted", "i8"),  # strings whose last stroke was a ghost note, a bit each
        # of the fretting hand (placing.py)
        ("placed", "i8"),  # 1 + the string and fret where a finger came down last; 0: nowhere yet ...
        ("placed_at", "i8"),  # ... and its frame
        ("eased_at", "i8"),  # frame at which it ended a note ...
        ("leaves_after", "f8"),  # ... and the time after which it leaves the string, s; 0: it stays
        ("leaving", "i8"),  # strings that fingers have left or are about to, a bit each
        # of a tablature's strokes
        ("struck_at", "i8", (MAX_STRINGS,)),  # frame of the last one
        ("palmed", "i8"),  # strings on which their palm lies, a bit each
        ("string_vibrato", "f8", (MAX_STRINGS,)),  # 0 to 127
    ],
    align=True,
)

# Where events go
OUT = np.dtype(
    [
        ("frame", "i8"),  # of the current message
        ("events", "i8"),  # address: EVENT, with room for MAX_EVENTS more
        ("count", "i8"),  # events written
    ],
    align=True,
)

PERFORMER = np.dtype(
    [
        # the bass
        ("strings", "i8"),
        ("frets", "i8"),
        ("open", "i8", (MAX_STRINGS,)),
        ("called", "i8", (MAX_STRINGS,)),  # pitch class that calls it from key switches
        ("slack", "f8", (MAX_STRINGS,)),  # how far a force pulls it, relative to before it was tuned
        ("player", PLAYER),
        ("strokes", STROKE, (STROKES,)),
        ("key_map", KEY_MAP),
        ("part", "f8", (KEYS,)),  # by velocity: 0 the softest note, 1 the hardest
        ("default_stroke", "i8"),  # of the bass
        ("default_slapped", "i8"),  # how many strings the player's thumb strikes, from the lowest
        ("wheel_slides", "i8"),  # 1: the wheel slides along the frets
        ("answering", "i8"),  # NEVER, WITH_PEDAL, ALWAYS or WHILE_HELD
        ("drop", "i8"),  # 1: notes out of range are dropped
        ("seed", "i8"),
        # the player's state, as set by controllers, parameters and key switches
        ("position", "f8"),  # of a pluck, fraction of the open string
        ("placed", "f8"),  # the position after a controller reset
        ("ranged", "f8"),  # semitones, the range of a channel's wheel until a controller sets another
        ("dynamics", "f8"),  # factor for every note's force
        ("tone", "f8"),  # of the tone pot, -1 to 1; 0: the bass's own
        ("hand_damping", "f8"),
        ("unevenness", "f8"),
        ("slapped", "i8"),  # strings that the thumb strikes
        ("stroke", "i8"),  # FINGER, PICK, NAIL or POP
        ("pressed", "i8", (KEYS,)),  # how many note-ons hold each key switch
        ("switched", "i8", (ACTIONS,)),  # held keys per action, and 1 if it is latched
        ("forced", "i8"),  # string that plays all notes while its key is held; -1: none
        ("controls", CONTROLS),
        ("hands", HANDS),
        ("idle", "i8"),  # strings that may answer, a bit each, as last sent to the strings
        ("out", OUT),
        # counters
        ("notes", "i8"),
        ("transposed", "i8"),
        ("dropped", "i8"),
        ("stolen", "i8"),
    ],
    align=True,
)


performer_at, operators_at = record_at(PERFORMER), records_at(OPERATOR, 2)
