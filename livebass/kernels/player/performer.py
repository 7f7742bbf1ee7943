"""The performer turns MIDI messages into events of the strings: which string and fret, how hard, when a note stops.

It decides when the message arrives, from what was played so far: a file and a keyboard give the same performance, and
the same input always the same one. One record, PERFORMER, holds all it remembers; p is that record. [audio thread]
"""

import numpy as np

from livebass.compiling import entry, jit
from livebass.kernels.hands.techniques import grazing
from livebass.kernels.machine.elementary import chance, cos, exp2, log2, power
from livebass.kernels.machine.native import record_at, records_at
from livebass.kernels.string.records import (
    BEND,
    BLEND,
    CUT,
    EVENT,
    GAIN,
    GLIDE,
    HAMMER,
    HAND,
    IDLE,
    MOST_NEAR,
    OPERATOR,
    PLUCK,
    PULL_OFF,
    STRIKE_EVENT,
    THROW,
    TONE,
    TOUCH_EVENT,
    TOUCHES,
    WAVER,
)
from livebass.kernels.string.touch import impedance
from livebass.techniques import (
    ACTIONS,
    BEND_RANGE,
    CC_BEND,
    CC_BLEND,
    CC_EXPRESSION,
    CC_HAND,
    CC_LEGATO,
    CC_LET_RING,
    CC_PALM,
    CC_PARAMETER,
    CC_PLACE,
    CC_SLIDE,
    CC_VIBRATO,
    CC_VOLUME,
    DETACH,
    DOWN_STROKE,
    DYNAMICS,
    GAIN_DB,
    GHOST,
    HAND_AT,
    HAND_DAMPING,
    HARMONIC,
    LEAST,
    LEFT_SLAP,
    LEGATO,
    MOST,
    NO_FUNCTION,
    NO_SWITCH,
    ON_STRING,
    PALM,
    PARAMETERS,
    PLUCK_POSITION,
    PLUCKED,
    SLIDE,
    STOP_ALL,
    TAP,
    TECHNIQUE,
    THUMB_ON_ALL,
    THUMB_ON_TWO,
    TONE_POT,
    UNEVENNESS,
    UP_STROKE,
    VIBRATO,
    WITH_FINGERS,
    WITH_PICK,
    WITH_THUMB,
)

MOST_STRINGS = 8
FREE, HELD, PEDALLED = 0, 1, 2
HAND_SPAN = 3  # frets beyond the first finger
LEAST_PLUCK, LEAST_STRIKE = 0.47, 0.12  # of the length: no nearer to the stop; the middle itself has no even partials
MOST_PLACE = 0.99  # of the length
LEAST_GRAZE = 1e-4  # m, where a string lies on a fret
UNEVEN_PLACE = 0.1  # m, for an unevenness of 1
MOST_EVENTS = 8 * MOST_STRINGS  # one message gives at most so many: reset-controllers
MOST_RANGE = 96  # semitones of pitch bend; the fine part of the range comes on top ...
MOST_BEND = 97.0  # ... and no bend goes farther
LEAST_FORCE = 1e-3  # multiple of the grazing apex: a curve cannot start at zero
# The left hand that slaps the strings: fret, kg, half width (m) and stiffness (N/m^1.5) of its fingers
LEFT_FRET, LEFT_MASS, LEFT_WIDTH, LEFT_STIFFNESS = 7, 0.06, 15e-3, 3e5
LEFT_SPEED = 0.5  # of that by which a pluck of the same force moves the string
FASTEST_STRIKE = 8.0  # m/s: no hand is faster
MOST_UNEVENNESS = 0.5
KEYS = 128
CONTROLLERS = 128

# What plucks, with half widths (m), release times (s), place (part of the open string), angle (rad), and how far it
# lifts the string from the neck, over a finger. 0: the player's own, as all are of a finger. Estimates: the tip of a
# pick bends and slips off where flesh rolls; a pop pulls the string up. A pick's place and release times are such that
# notes brighten by 4 dB from velocity 30 to 60 and to 90, and click by 8 dB more than a finger's at the least of these.
FINGER, PICK, NAIL, POP = range(4)
STROKES = 4
SOFT_WIDTH, HARD_WIDTH = (0.0, 1.5e-3, 2.5e-3, 3e-3), (0.0, 1e-3, 2e-3, 2.5e-3)
SOFT_RELEASE, HARD_RELEASE = (0.0, 240e-6, 400e-6, 300e-6), (0.0, 12e-6, 40e-6, 30e-6)
STROKE_PLACE, STROKE_ANGLE, STROKE_LIFT = (0.0, 0.94, 0.0, 0.70), (0.0, 0.8, 0.0, 0.2), (1.0, 0.75, 1.0, 1.7)
PICK_NEARER = 60e-3  # m, of a hard stroke, not a soft one
# Of a stroke that goes up, not down: m, factor, rad. A pickup hears v with its sign: mirrored, a stroke up would be
# 2.7 dB under one down; it lifts the string out of that more than one down does.
UP_NEARER, UP_LEVEL, UP_ANGLE = 3e-3, 0.89, -0.5
# The middle finger plucks otherwise than the index, which it follows; of an even player they are the same
MIDDLE_NEARER, MIDDLE_LEVEL, MIDDLE_RELEASE = 4e-3, 0.933, 0.9  # m, factors
RAKE = 80e-3  # s within which a finger goes on to a lower string, by which it does not take turns
UNEVEN_TIP, UNEVEN_ANGLE = 1.6, 0.5  # part of width and release, rad, for an unevenness of 1
MORE_CHANCE = 1 << 40  # chances beyond those of force and place
# A hand plays a shorter string more gently, by this power of its part of the open length: the same force would be heard
# up to 8 dB louder near the body, where a pickup lies under the middle of the string and no fret takes its fundamental;
# that of a pop, which frets take most from, up to 15 dB.
GENTLER, THUMB_GENTLER = (0.5, 0.5, 0.5, 0.8), 0.2  # likewise of the speed of a thumb with a mass
PRESSED_APEX = 0.8  # of the way down to the frets that a stroke towards the neck may pull the string

VOLUME_LAW = 40.0 * 0.30102999566398120  # dB when a volume controller doubles
BEND_UP = 2.0  # semitones of the controller that bends upwards
BEND_STARTS = 3  # it bends once it has been lower: a file that sets a portamento time by it does not bend
PEDAL = 64  # at 0 it lets go in every map that gives it no other function
SHIFTS = 0.6  # semitones off its fret at which a wheel that slides changes frets: with half a one it would jitter
# What the channels mean: nothing; one each for every string (mode 4 of MIDI); one for each note (MPE)
ALL_ALIKE, STRING_A_CHANNEL, NOTE_A_CHANNEL = range(3)
CHANNELS = 16
# When idle strings may answer those that sound: no hand rests on them never, while the pedal is down, or always
NEVER, WITH_PEDAL, ALWAYS = range(3)
ANSWERS_WHEN = 3
MONO_STEP = 2  # semitones
GUITAR_RANGE, MPE_RANGE = 12.0, 48.0  # semitones of a channel's wheel, until RPN 0 says another range
STACK = 4  # keys held on one string that it goes back to, one after the other
OVER = 1e-9  # signal below which a bass that rings out has ended
FADE = 0.03  # s of fade-out of a bass that rings out, once another one or an overload needs its place

# Fingers by number (records.TOUCHES): the palm has the first three, harmonics the last, ghost notes the last two. Half
# their widths are standard deviations (touch.py): 2.3 and 3.5 mm those of fingertips that touch 8 and 12 mm evenly.
PALM_PLACES = (12e-3, 25e-3, 38e-3)  # m from the saddle
PALM_WIDTH = 5e-3  # m, half
GUEST_THUMB = 0.38  # part of a strike's depth on a bass whose level is that of fingers
# In all, in impedances of the string, as those that follow. By the eigenvalues of the damped string the fundamental
# dies soonest under the tight one; a firmer palm clamps the string, and lets it ring before the clamp.
LIGHT_PALM, TIGHT_PALM = 0.4, 13.0
KEY_PALM = 0.6  # of the way between them, by the key switch
GHOST_FRETS = (-0.6, 1.6)  # from the fret: where the fingers of a ghost note lie
GHOST_RESISTANCE, GHOST_WIDTH, GHOST_FORCE = 1.5, 3.5e-3, 0.7  # ; m, half; part of the force
GHOST_PLACE = 5  # fret at which an open string is damped for a ghost note
HARMONICS = (12, 19, 24, 28, 31)  # semitones above the open string of its harmonics 2 to 6
# The finger on a node of theirs: firm enough to end what has no node there soonest, by the eigenvalues of the damped
# string (at the middle 2 takes all that comes), for so many periods that 60 dB of it are gone, and at least NODE_TIME
NODE_RESISTANCE, NODE_PERIODS = (2.0, 1.7, 1.7, 1.8, 1.6), (2.0, 3.0, 6.0, 9.0, 13.0)
NODE_WIDTH, NODE_TIME = 2.3e-3, 65e-3  # m, half; s
HAMMER_SPEED = 0.36  # speed of a finger that hammers over that by which a pluck of the same force moves the string
HAMMER_LANDING = 4e-3  # s in which the finger that hammers damps a string that sounds
TAP_LIFTING = 0.5e-3  # s in which fingers leave a string that is tapped
# m across, by which the finger of a pull-off takes the string along: to the side where pickups hear it with what the
# string does as it leaves its fret, not against that
LEAST_PULL, MOST_PULL = 0.1e-3, 0.9e-3
SLIDE_TIME = 22e-3  # s a fret
VIBRATO_DEPTH, VIBRATO_RATE = 0.4, 5.6  # semitones at most; Hz

PERFORMER = np.dtype(
    [
        ("strings", "i8"),
        ("frets", "i8"),
        ("open", "i8", (MOST_STRINGS,)),
        ("called", "i8", (MOST_STRINGS,)),  # pitch class by which key switches call it
        ("slack", "f8", (MOST_STRINGS,)),  # how far a force pulls it, over how far before it was tuned
        ("state", "i8", (MOST_STRINGS,)),
        ("key", "i8", (MOST_STRINGS,)),  # the key that plays the string, -1: none since all-off
        ("fret", "i8", (MOST_STRINGS,)),
        ("age", "i8", (MOST_STRINGS,)),
        ("clock", "i8"),
        ("place", "i8"),  # fret of the first finger
        ("pedal", "i8"),
        ("wheel", "f8"),  # -1 to 1
        ("range", "f8"),  # semitones
        ("wheel_slides", "i8"),  # 1: the wheel slides along the frets ...
        ("shift", "i8"),  # ... and has got so many frets from those of the notes
        ("bend_up", "f8"),  # semitones, by the controller ...
        ("bend_ready", "i8"),  # ... once it has been below BEND_STARTS
        ("parameter", "i8"),  # RPN selected, 16383: none
        ("volume", "f8"),
        ("expression", "f8"),
        ("level", "f8"),  # of the parameter gain, where a controller of the bass's own moves that
        ("tone", "f8"),  # of the tone pot, -1 to 1; 0: as the bass has it
        ("blend", "f8"),  # of the pickups, -1 the one nearest to the neck alone, 1 the bridge's; 0: as the bass has it
        ("position", "f8"),  # fraction of the open string
        ("string_bend", "f8", (MOST_STRINGS,)),  # semitones, of one string, besides the wheel's ...
        ("note_bend", "f8", (MOST_STRINGS,)),  # ... and of the note that it plays
        ("note_vibrato", "f8", (MOST_STRINGS,)),  # 0 to 1, of the note that it plays
        ("string_of", "i8", (KEYS,)),  # that the next note of each key is played on; -1: the performer chooses
        ("place_of", "f8", (KEYS,)),  # of the next note of each key, as PLUCK_POSITION; NaN: none of its own
        ("dynamics", "f8"),  # factor of every note's force
        # techniques
        ("switch", "i8", (KEYS,)),  # what each key switches, and ...
        ("switch_value", "i8", (KEYS,)),  # ... its value
        ("over_notes", "i8"),  # 1: keys switch although the bass has their notes
        ("controller", "i8", (CONTROLLERS,)),  # function of each controller
        ("pressed", "i8", (KEYS,)),  # how many note-ons hold each key that switches
        ("switched", "i8", (ACTIONS,)),  # keys held, of each action
        ("forced", "i8"),  # string that all notes are played on while its key is held; -1: none
        ("palm", "f8"),  # 0 to 1, by the controller ...
        ("palm_set", "f8"),  # ... and by `set_amount`
        ("legato", "i8"),  # 1: by the controller
        ("sliding", "i8"),  # 1: by the controller
        ("vibrato", "f8"),  # likewise ...
        ("vibrato_set", "f8"),  # ... likewise
        ("stack", "i8", (MOST_STRINGS, STACK)),  # keys held on a string under the one that plays, the last on top
        ("stacked", "i8", (MOST_STRINGS,)),
        # channels
        ("mode", "i8"),  # ALL_ALIKE, STRING_A_CHANNEL or NOTE_A_CHANNEL
        ("first_channel", "i8"),  # of those that have a string or notes of their own ...
        ("channels", "i8"),  # ... and how many
        ("mono", "i8"),  # 1: overlapping notes at most MONO_STEP semitones apart are legato
        ("channel_range", "f8"),  # semitones
        ("channel_wheel", "f8", (CHANNELS,)),  # -1 to 1
        ("channel_place", "f8", (CHANNELS,)),  # of the channel's next note, as PLUCK_POSITION; NaN: none of its own
        ("channel_string", "i8", (CHANNELS,)),  # that the channel's last note is played on; -1: none
        ("latest", "i8"),  # string of the last note; -1: it was left out
        ("placed", "f8"),  # the position that the controllers' reset goes back to
        ("ranged", "f8"),  # semitones, the range until a controller sets another
        ("adjusted", "f8", (PARAMETERS,)),  # the parameters' values; 0: as the bass has it
        # the player: constants, and what parameters make of them
        ("usual_position", "f8"),
        ("usual_slapped", "i8"),
        ("usual_damping", "f8"),
        ("usual_unevenness", "f8"),
        ("usual_range", "f8"),
        ("nearest", "f8"),
        ("farthest", "f8"),
        ("softest", "f8"),
        ("hardest", "f8"),
        ("greatest", "f8"),
        ("slapped", "i8"),
        ("strike_position", "f8"),
        ("strike_force", "f8"),
        ("strike_softest", "f8"),  # m/s
        ("strike_hardest", "f8"),
        ("thumb_mass", "f8"),  # kg; 0: the thumb strikes by an impulse
        ("hand_damping", "f8"),
        ("unevenness", "f8"),
        ("seed", "i8"),
        ("drop", "i8"),
        ("part", "f8", (KEYS,)),  # by velocity: part of the way from the softest to the hardest note
        ("stroke", "i8"),  # FINGER, PICK, NAIL or POP
        ("other", "i8"),  # 1: the next stroke is the middle finger's, or goes up
        ("stroked", "i8"),  # the string of the last stroke ...
        ("stroked_at", "i8"),  # ... and its frame
        ("rounding", "f8"),  # m, of a finger, at the hardest ...
        ("rounding_soft", "f8"),  # ... and at the softest; 0: the same
        ("release", "f8"),  # s, likewise
        ("release_soft", "f8"),
        ("nearer", "f8"),  # m: the hardest are plucked nearer to the saddle than the softest
        ("angle", "f8"),  # rad
        ("answering", "i8"),  # NEVER, WITH_PEDAL or ALWAYS
        ("idle", "i8"),  # strings that may answer, a bit each, as the strings have been told
        ("ghost_below", "i8"),  # velocity under which a note is a ghost note
        # counters
        ("notes", "i8"),
        ("transposed", "i8"),
        ("dropped", "i8"),
        ("stolen", "i8"),
    ],
    align=True,
)


performer_at, events_at, operators_at = record_at(PERFORMER), records_at(EVENT), records_at(OPERATOR, 2)


@entry("int64(int64, int64, int64, int64, int64, int64, int64, int64, int64)")
def take_message(p, ops, frame, status, first, second, events, room, count):
    """C function: `message` for addresses; there is room for `room` events."""
    performer = performer_at(p)
    operators = operators_at(ops, performer.strings, performer.frets + 1)
    return message(performer, operators, frame, status, first, second, events_at(events, room), count)


@entry("int64(int64, int64, int64, int64, int64, int64, int64, int64, int64, int64, int64)")
def take_message_ringing(p, ops, player, told, told_count, frame, status, first, second, events, room):
    """C function: `ring_on` for addresses, with events from the first on; there is room for `room` of them."""
    performer = performer_at(p)
    operators = operators_at(ops, performer.strings, performer.frets + 1)
    start = np.int64(0)
    return ring_on(
        performer, operators, performer_at(player), events_at(told, told_count), start, told_count, frame, status,
        first, second, events_at(events, room), start,
    )  # fmt: skip


@jit
def reset_controllers(p):
    """Sets pedal, wheel, expression, RPN and pluck position as when new; palm and vibrato as a host has set them."""
    p.pedal = 0
    p.wheel = 0.0
    p.expression = 1.0
    p.bend_up = 0.0
    p.bend_ready = 0
    p.parameter = 16383
    p.position = p.placed
    p.palm = p.palm_set
    p.legato = 0
    p.sliding = 0
    p.vibrato = p.vibrato_set
    for i in range(MOST_STRINGS):
        p.string_bend[i] = 0.0
        p.note_bend[i] = 0.0
        p.note_vibrato[i] = 0.0


@jit
def held(number, value):
    """The value of parameter `number`, held within its limits; NaN is as usual."""
    if np.isnan(value):
        return 0.0
    return min(max(value, LEAST[number]), MOST[number])


@jit
def place(p, x):
    """Position for PLUCK_POSITION `x`: -1 nearest to the bridge, 1 farthest from it, 0 the usual one."""
    if x < 0.0:
        return p.usual_position - x * (p.farthest - p.usual_position)
    return p.usual_position + x * (p.nearest - p.usual_position)


@jit
def set_parameter(p, frame, number, value, events, count):
    """Sets parameter `number`, of those that the player has, to a value that is `held`; returns the new count."""
    adjust(p, number, value)
    if number == TONE_POT:
        for i in range(p.strings):
            count = emit(events, count, frame, TONE, i, 0, value, 0.0)
    elif number == BEND_RANGE:
        count = tell_bend(p, frame, events, count)
    return count


@jit
def adjust(p, number, value):
    """`set_parameter` for the player alone."""
    p.adjusted[number] = value
    if number == TONE_POT:
        p.tone = value
    elif number == PLUCK_POSITION:
        p.placed = place(p, value)
        p.position = p.placed
    elif number == DYNAMICS:
        p.dynamics = power(10.0, value / 20.0)
    elif number == TECHNIQUE:
        which = np.int64(np.rint(value))
        p.slapped = p.usual_slapped
        if which == PLUCKED:
            p.slapped = 0
        elif which == THUMB_ON_TWO:
            p.slapped = min(2, p.strings)
        elif which == THUMB_ON_ALL:
            p.slapped = p.strings
        if p.slapped > 0:
            p.stroke = POP
        elif p.stroke == POP:
            p.stroke = FINGER
    elif number == HAND_DAMPING:
        p.hand_damping = p.usual_damping * power(10.0, value)
    elif number == UNEVENNESS:
        p.unevenness = p.usual_unevenness
        if value != 0.0:
            p.unevenness = min(max(p.usual_unevenness + value, 0.0), MOST_UNEVENNESS)
    elif number == BEND_RANGE:
        p.ranged = p.usual_range if value == 0.0 else max(value, 1.0)
        p.range = p.ranged


@jit
def take_over(p, old):
    """Sets controllers and parameters of a bass that has not played as they stand at `old`, the performer before it."""
    for number in range(GAIN_DB + 1, PARAMETERS):
        adjust(p, number, old.adjusted[number])
    p.volume = old.volume
    p.expression = old.expression
    p.level = old.level
    p.blend = old.blend
    p.pedal = old.pedal
    p.wheel = old.wheel
    p.parameter = old.parameter
    p.bend_up = old.bend_up
    p.bend_ready = old.bend_ready
    if old.range != old.ranged:
        p.range = old.range
    if p.wheel_slides:
        p.shift = np.int64(np.rint(p.wheel * p.range))
    if old.position != old.placed and old.farthest != old.nearest:
        part = (old.position - old.nearest) / (old.farthest - old.nearest)
        p.position = p.nearest + (p.farthest - p.nearest) * part
    p.palm = old.palm
    p.palm_set = old.palm_set
    p.legato = old.legato
    p.sliding = old.sliding
    p.vibrato = old.vibrato
    p.vibrato_set = old.vibrato_set
    p.mode = old.mode
    p.mono = old.mono
    p.first_channel = old.first_channel
    p.channels = old.channels
    p.channel_range = old.channel_range
    for channel in range(CHANNELS):
        p.channel_wheel[channel] = old.channel_wheel[channel]
        p.channel_place[channel] = old.channel_place[channel]
        p.channel_string[channel] = -1
    for i in range(MOST_STRINGS):
        p.string_bend[i] = old.string_bend[i]
    for key in range(KEYS):
        if p.switch[key] == old.switch[key] and p.switch_value[key] == old.switch_value[key]:
            p.pressed[key] = old.pressed[key]
            p.switched[p.switch[key]] += p.pressed[key]
            if p.pressed[key] > 0 and p.switch[key] == ON_STRING:
                p.forced = string_called(p, p.switch_value[key])
        p.string_of[key] = old.string_of[key]
        p.place_of[key] = old.place_of[key]


@entry("void(int64, int64)")
def follow_performer(p, old):
    """C function: `take_over` for addresses."""
    take_over(performer_at(p), performer_at(old))


@jit
def held_bend(semitones):
    """A bend, held within what there is; NaN is none."""
    return 0.0 if np.isnan(semitones) else min(max(semitones, -MOST_BEND), MOST_BEND)


@jit
def bend_string(p, frame, i, semitones, events, count):
    """Bends string `i` by so many semitones, besides what the wheel does; returns the new count of events."""
    if i >= p.strings:
        return count
    p.string_bend[i] = held_bend(semitones)
    return emit(events, count, frame, BEND, i, 0, bend_ratio(p, i), 0.0)


@jit
def bend_note(p, frame, key, semitones, events, count):
    """Bends the string that played `key` last, until it plays another note; returns the new count of events."""
    last = string_of_key(p, key)
    if last < 0:
        return count
    p.note_bend[last] = held_bend(semitones)
    return emit(events, count, frame, BEND, last, 0, bend_ratio(p, last), 0.0)


@jit
def string_of_key(p, key):
    """Returns the string that played `key` last; -1: there is none."""
    last = -1
    for i in range(p.strings):
        if p.key[i] == key and (last < 0 or p.age[i] > p.age[last]):
            last = i
    return last


@jit
def vibrate_note(p, frame, key, amount, events, count):
    """Sets the vibrato of the string that played `key` last, 0 to 1, until its next note; returns the new count.

    The bass's own vibrato is the least. NaN is none.
    """
    i = string_of_key(p, key)
    if i < 0:
        return count
    p.note_vibrato[i] = min(max(amount, 0.0), 1.0) if not np.isnan(amount) else 0.0
    return emit(events, count, frame, WAVER, i, 0, string_vibrato(p, i), VIBRATO_RATE)


@jit
def cut_note(p, frame, key, events, count):
    """Ends the sound of the strings that played `key`, whatever the pedal does; returns the new count of events."""
    for i in range(p.strings):
        if p.key[i] == key:
            p.state[i] = FREE
            p.key[i] = -1
            p.stacked[i] = 0
            count = emit(events, count, frame, CUT, i, 0, 0.0, 0.0)
    forget_key(p, key, np.int64(-1))
    return count


@jit
def place_note(p, key, x):
    """Has the next note of `key` plucked at a place of its own, given as PLUCK_POSITION."""
    if key < KEYS:
        p.place_of[key] = x if np.isnan(x) else held(PLUCK_POSITION, x)


@jit
def emit(events, count, frame, kind, string, fret, x, y):
    """Writes event number `count`; returns the new count."""
    e = events[count]
    e.frame = frame
    e.kind = kind
    e.string = string
    e.fret = fret
    e.x = x
    e.y = y
    e.z = 0.0
    e.t = 0.0
    e.w = 0.0
    return count + 1


@jit
def lay(events, count, frame, string, finger, place, resistance, width, seconds):
    """Writes the event of a finger that is laid on a string at `place` (m from the saddle); returns the new count."""
    emit(events, count, frame, TOUCH_EVENT, string, finger, place, resistance)
    events[count].z = width
    events[count].t = seconds
    return count + 1


@jit
def string_note(p, key, i):
    """Has the next note of `key` played on string `i`, where that has it."""
    if key < KEYS:
        p.string_of[key] = np.int64(i) if 0.0 <= i < p.strings else -1


@jit
def has_note(p, i, note):
    """True if string `i`, which may be -1, has `note`."""
    return i >= 0 and 0 <= note - p.open[i] <= p.frets


@jit
def choose_string(p, note):
    """Returns the string for `note`, -1 if none has it: free ones first, then near positions, then the oldest."""
    best = -1
    least = np.inf
    for i in range(p.strings):
        fret = note - p.open[i]
        if fret < 0 or fret > p.frets:
            continue
        cost = 0.4 * fret
        if fret > 0:
            away = max(p.place - fret, fret - p.place - HAND_SPAN, 0)
            cost += 2.5 * away
        if p.state[i] != FREE:
            same = p.key[i] >= 0 and p.open[i] + p.fret[i] == note
            # a string that sounds is only taken for its own note, or where no other can play this one
            cost += -1000.0 if same else 1000.0 - 1e-6 * (p.clock - p.age[i])
        if cost < least:
            least = cost
            best = i
    return best


@jit
def reach(p, fret):
    """Moves the hand as little as lets a finger reach `fret`."""
    if fret > 0:
        if fret < p.place:
            p.place = fret
        elif fret > p.place + HAND_SPAN:
            p.place = fret - HAND_SPAN


@jit
def stop_string(p, i, frame, events, count):
    """Stops string `i` with the hand."""
    p.state[i] = FREE
    p.stacked[i] = 0
    return emit(events, count, frame, HAND, i, p.fret[i], p.hand_damping, 0.0)


@jit
def over_body(open_op, op, place, aside, least):
    """Distance (m) from the stop of a hand over the body at `place` (fraction of the open string), `aside` m off it.

    Kept on the string, and no nearer to the stop than the part `least` of the length.
    """
    where = op.length - (1.0 - place) * open_op.length + aside
    return min(max(where, least * op.length), MOST_PLACE * op.length)


@jit
def soft_limit(x, most):
    """Soft limit: about x when small, increasing, always below `most`."""
    return x / np.sqrt(np.sqrt(1.0 + (x / most) ** 4))


@jit
def strength(p, part):
    """Force of the hand at `part` of the way from the softest to the hardest, in those that graze a fret (`pull`)."""
    softest = max(p.softest, LEAST_FORCE)
    return p.dynamics * softest * power(p.hardest / softest, part)


@jit
def pull(open_op, op, where, gentler):
    """Returns the apex (m) at `where` (m from the stop) of the force that has the open string just graze a fret.

    That is a pluck of the open string as far from the saddle. The same force pulls a shorter string less far, as
    x (L - x) / L, and hands play it by the power `gentler` of its length.
    """
    x = open_op.length - (op.length - where)
    part = op.length / open_op.length
    apex = max(grazing(open_op, x), LEAST_GRAZE)
    return apex * where / (x * part) * power(part, gentler)


@jit
def speed_of_pluck(p, op, i, force):
    """Speed (m/s) at which the corner of a pluck by `force` passes along the open string `i`: c F / T."""
    x = over_body(op, op, p.usual_position, 0.0, LEAST_PLUCK)
    return p.slack[i] * force * pull(op, op, x, 0.0) * op.length / (x * (op.length - x)) * op.speed


@jit
def note_on(p, ops, frame, key, velocity, events, count):
    """Plays a key: chooses string, force and place; returns the new count of events."""
    low, high = note_range(p)
    own_place, own_string = p.place_of[key], p.string_of[key]
    p.latest = -1
    p.place_of[key] = np.nan
    p.string_of[key] = -1
    i, node = -1, 0
    if p.switched[HARMONIC] > 0:
        i, node = natural_harmonic(p, key, own_string)
    note = key
    if node == 0:  # harmonics reach beyond the last fret
        note = folded(key, low, high)
        if p.switched[HARMONIC] > 0 and note != key:
            i, node = natural_harmonic(p, note, own_string)
    if note < low or (note != key and p.drop):
        p.dropped += 1
        return count
    overlaps = p.mode == STRING_A_CHANNEL and has_note(p, own_string, note) and p.state[own_string] == HELD
    legato = (overlaps or p.legato or p.switched[LEGATO] > 0) and p.switched[HARMONIC] == 0
    slides = p.sliding or p.switched[SLIDE] > 0
    if overlaps and i < 0:
        i = own_string
    if i < 0 and (legato or slides):
        i = sounding_string(p, note)
    if i < 0 and p.mono:
        i = sounding_string(p, note)
        if i >= 0 and abs(note - p.open[i] - p.fret[i]) > MONO_STEP:
            i = -1
    tied = i >= 0 and node == 0
    if i < 0:
        i = own_string if has_note(p, own_string, note) else p.forced if has_note(p, p.forced, note) else -1
    if i < 0:
        i = choose_string(p, note)
    if i < 0:
        p.dropped += 1
        return count
    if note != key:
        p.transposed += 1
    fret = 0 if node > 0 else note - p.open[i]
    before = p.fret[i]
    if tied:
        push_key(p, i)
    else:
        p.stacked[i] = 0
        if p.state[i] != FREE and p.key[i] != key:
            p.stolen += 1
    if own_string < 0:
        for k in range(p.strings):
            if k != i and p.state[k] != FREE and p.key[k] == key:  # it is played on another string now
                count = stop_string(p, k, frame, events, count)
    reach(p, fret)
    p.notes += 1
    p.clock += 1
    p.state[i] = HELD
    p.key[i] = key
    p.fret[i] = fret
    p.age[i] = p.clock
    p.latest = i
    if p.note_bend[i] != 0.0:
        p.note_bend[i] = 0.0
        count = emit(events, count, frame, BEND, i, 0, bend_ratio(p, i), 0.0)
    if p.note_vibrato[i] != 0.0:
        p.note_vibrato[i] = 0.0
        count = emit(events, count, frame, WAVER, i, 0, vibrato_depth(p), VIBRATO_RATE)
    tapped = p.switched[TAP] > 0 and fret > 0
    part, stop, before = p.part[velocity], shifted(p, fret), shifted(p, before)
    if tapped:
        return tap(p, ops, i, stop, part, frame, events, count)
    if tied and stop != before:
        return press(p, ops, i, before, stop, part, frame, slides, events, count)
    ghost = p.switched[GHOST] > 0 or velocity < p.ghost_below
    return stroke(p, ops, i, stop, node, part, ghost, own_place, frame, events, count)


@jit
def note_range(p):
    """Returns the lowest and the highest note of the bass."""
    low = p.open[0]
    high = p.open[0]
    for i in range(p.strings):
        low = min(low, p.open[i])
        high = max(high, p.open[i] + p.frets)
    return low, high


@jit
def folded(note, low, high):
    """Returns `note` moved by octaves to `high` or below and, if that range has an octave, to `low` or above."""
    while note < low:
        note += 12
    while note > high:
        note -= 12
    return note


@jit
def shifted(p, fret):
    """Returns the fret at which a note of `fret` is stopped, by the wheel if that slides. Open strings stay open."""
    if fret == 0 or p.shift == 0:
        return fret
    return min(max(fret + p.shift, 1), p.frets)


@jit
def sounding_string(p, note):
    """Returns the string that was played last of those held that have `note`; -1: there is none.

    The string whose key is held goes before.
    """
    last = -1
    if has_note(p, p.forced, note) and p.state[p.forced] == HELD:
        return p.forced
    for i in range(p.strings):
        if p.state[i] == HELD and has_note(p, i, note) and (last < 0 or p.age[i] > p.age[last]):
            last = i
    return last


@jit
def natural_harmonic(p, note, wanted):
    """Returns a string of which `note` is a natural harmonic, free ones first, and its number; -1, 0: there is none.

    It is on the string `wanted` only, if that is one; the string whose key is held goes before.
    """
    best, number = -1, 0
    for n in range(len(HARMONICS)):
        for i in range(p.strings):
            fits = (wanted < 0 or i == wanted) and note - p.open[i] == HARMONICS[n]
            if fits and i == p.forced:
                return i, n + 2
            if fits and (best < 0 or (p.state[best] != FREE and p.state[i] == FREE)):
                best, number = i, n + 2
    return best, number


@jit
def push_key(p, i):
    """Remembers the key that string `i` plays under the one that it is to play now."""
    n = p.stacked[i]
    if n == STACK:
        for k in range(1, STACK):
            p.stack[i, k - 1] = p.stack[i, k]
        n -= 1
    p.stack[i, n] = p.key[i]
    p.stacked[i] = n + 1


@jit
def forget_key(p, key, own):
    """Takes a key that was released from under those that play, on string `own` only if that is not -1."""
    for i in range(p.strings):
        if own >= 0 and i != own:
            continue
        kept = 0
        for k in range(p.stacked[i]):
            if p.stack[i, k] != key:
                p.stack[i, kept] = p.stack[i, k]
                kept += 1
        p.stacked[i] = kept


@jit
def press(p, ops, i, before, fret, part, frame, slides, events, count):
    """Has string `i` go from fret `before` to `fret` by the left hand: hammer-on, pull-off or slide.

    `part` is of the way from the softest to the hardest.
    """
    if slides:
        return emit(events, count, frame, GLIDE, i, fret, SLIDE_TIME, 0.0)
    if fret > before:
        finger = HAMMER_SPEED * speed_of_pluck(p, ops[i, 0], i, strength(p, part))
        return emit(events, count, frame, HAMMER, i, fret, finger, HAMMER_LANDING)
    return emit(events, count, frame, PULL_OFF, i, fret, -(LEAST_PULL + (MOST_PULL - LEAST_PULL) * part), 0.0)


@jit
def tap(p, ops, i, fret, part, frame, events, count):
    """Has string `i` hammered down to `fret`, whatever it does: fingers that ended its last note come off."""
    for k in range(TOUCHES):
        count = lay(events, count, frame, i, k, 0.0, 0.0, 0.0, TAP_LIFTING)
    count = press(p, ops, i, -1, fret, part, frame, False, events, count)
    if p.palm > 0.0 or p.switched[PALM] > 0:
        count = lay_palm(p, ops, i, frame, events, count)
    return count


@jit
def stroke(p, ops, i, fret, node, part, ghost, own_place, frame, events, count):
    """Plucks or strikes string `i` at `fret`, at `part` of the way from the softest to the hardest.

    `node`: the number of a natural harmonic, on whose node a finger lies; 0: none.
    """
    ghost = ghost or p.switched[LEFT_SLAP] > 0
    left = p.switched[LEFT_SLAP] > 0 and ops[i, 0].points <= MOST_NEAR  # a mass over a board takes too long to compute
    stop = 0 if ghost else fret
    op = ops[i, stop]
    force = strength(p, part)
    force *= 1.0 + p.unevenness * chance(p.seed, 2 * p.notes)
    if ghost and not left:
        force *= GHOST_FORCE
    aside = UNEVEN_PLACE * p.unevenness * chance(p.seed, 2 * p.notes + 1)
    if left:
        speed = LEFT_SPEED * speed_of_pluck(p, ops[i, 0], i, STROKE_LIFT[p.stroke] * force)
        where = op.length - ops[i, min(LEFT_FRET, p.frets)].length
        count = emit(events, count, frame, THROW, i, stop, soft_limit(speed, FASTEST_STRIKE), where)
        e = events[count - 1]
        e.z = LEFT_MASS
        e.t = LEFT_WIDTH
        e.w = LEFT_STIFFNESS
    elif i < p.slapped and node == 0:
        where = over_body(ops[i, 0], op, p.strike_position, aside, LEAST_STRIKE)
        if p.thumb_mass > 0.0:
            speed = p.strike_softest * power(p.strike_hardest / p.strike_softest, part)
            speed *= p.dynamics * (1.0 + p.unevenness * chance(p.seed, 2 * p.notes)) * (GHOST_FORCE if ghost else 1.0)
            speed *= power(op.length / ops[i, 0].length, THUMB_GENTLER)
            if op.points == 0:  # at the last fret no other stops the thumb: it comes no deeper than a hand pulls
                give = where * (op.length - where) / op.length / (impedance(op) * op.speed)  # m/N, of the string
                speed = soft_limit(speed, p.greatest / np.sqrt(give * p.thumb_mass))
            count = emit(events, count, frame, THROW, i, stop, soft_limit(speed, FASTEST_STRIKE), where)
        else:
            depth = p.strike_force * np.sqrt(p.slack[i])  # the thumb gives every string the same speed
            depth *= soft_limit(force * max(grazing(ops[i, 0], 0.5 * ops[i, 0].length), LEAST_GRAZE), p.greatest)
            if p.usual_slapped == 0:
                depth *= GUEST_THUMB
            count = emit(events, count, frame, STRIKE_EVENT, i, stop, depth, where)
    else:
        position = place(p, own_place) if not np.isnan(own_place) else p.position
        touched = node if node > 0 else 2 if p.switched[HARMONIC] > 0 else 0
        count = pluck(p, ops[i, 0], op, i, stop, force, position, aside, touched, frame, events, count)
        if touched > 0:
            count = lay_on_node(op, i, touched, frame, events, count)
    if p.palm > 0.0 or p.switched[PALM] > 0:
        count = lay_palm(p, ops, i, frame, events, count)
    if ghost:
        at = float(LEFT_FRET if left else fret if fret > 0 else GHOST_PLACE)
        for k in range(2):
            finger_place = ops[i, 0].length * exp2(-(at + GHOST_FRETS[k]) / 12.0)
            resistance = GHOST_RESISTANCE * impedance(op)
            count = lay(events, count, frame, i, 2 + k, finger_place, resistance, GHOST_WIDTH, 0.0)
    return count


@jit
def lay_on_node(op, i, number, frame, events, count):
    """Lays a finger on the node of harmonic `number` that is nearest to the stop; returns the new count."""
    place, resistance = op.length - op.length / number, NODE_RESISTANCE[number - 2] * impedance(op)
    seconds = max(NODE_TIME, NODE_PERIODS[number - 2] * 2.0 * op.length / op.speed)
    return lay(events, count, frame, i, 3, place, resistance, NODE_WIDTH, seconds)


@jit
def pluck(p, open_op, op, i, stop, force, position, aside, touched, frame, events, count):
    """Plucks string `i` at `position`, `aside` m off it: the shape, and how it is let go, follow the force.

    `touched`: the harmonic that another finger brings out, whose pluck has a place of its own; 0: none.
    """
    hard = hardness(p, force)
    uneven = 1.0 + UNEVEN_TIP * p.unevenness * chance(p.seed, MORE_CHANCE + 2 * p.notes)
    turned = UNEVEN_ANGLE * p.unevenness * chance(p.seed, MORE_CHANCE + 2 * p.notes + 1)
    shift = aside + (PICK_NEARER if p.stroke == PICK else p.nearer) * (hard - 0.5)
    angle, lift, level = p.angle, STROKE_LIFT[p.stroke], 1.0
    if p.stroke == FINGER:
        width = between(p.rounding_soft, p.rounding, hard)
        release = between(p.release_soft, p.release, hard)
    else:
        width = between(SOFT_WIDTH[p.stroke], HARD_WIDTH[p.stroke], hard)
        release = between(SOFT_RELEASE[p.stroke], HARD_RELEASE[p.stroke], hard)
    if STROKE_PLACE[p.stroke] > 0.0:
        position += STROKE_PLACE[p.stroke] - p.usual_position
    if STROKE_ANGLE[p.stroke] > 0.0:
        angle = STROKE_ANGLE[p.stroke]
        lift *= abs(cos(p.angle)) / cos(angle)
    take_turns(p, op, i, frame)
    if p.other and p.stroke == PICK:
        angle = UP_ANGLE
        shift += UP_NEARER
        level = UP_LEVEL
    elif p.other and p.unevenness > 0.0:
        shift += MIDDLE_NEARER
        level = MIDDLE_LEVEL
        release *= MIDDLE_RELEASE
    p.other = 1 - p.other
    where = over_body(open_op, op, position, shift, LEAST_PLUCK)
    if touched > 0:
        where = min(op.length - 0.5 * op.length / touched + aside, MOST_PLACE * op.length)
    apex = level * p.slack[i] * soft_limit(lift * force * pull(open_op, op, where, GENTLER[p.stroke]), p.greatest)
    if angle != 0.0:
        angle += turned
        if cos(angle) < 0.0:
            apex = min(apex, PRESSED_APEX * max(grazing(op, op.length - where), LEAST_GRAZE) / -cos(angle))
    count = emit(events, count, frame, PLUCK, i, stop, apex, where)
    e = events[count - 1]
    e.z = uneven * width
    e.t = uneven * release
    e.w = angle
    return count


@jit
def take_turns(p, op, i, frame):
    """Sets p.other for the stroke on string `i`: a finger that rakes, on to a lower string, goes on itself."""
    seconds = (frame - p.stroked_at) * op.steps * op.fine
    if p.stroke != PICK and i < p.stroked and seconds <= RAKE:
        p.other = 1 - p.other
    p.stroked = i
    p.stroked_at = frame
    if p.switched[DOWN_STROKE] > 0:
        p.other = 0
    elif p.switched[UP_STROKE] > 0:
        p.other = 1


@jit
def hardness(p, force):
    """How hard a force is, from 0, the player's softest, to 1, the hardest: by its logarithm."""
    softest = max(p.softest, LEAST_FORCE)
    if p.hardest <= softest or force <= softest:
        return 1.0 if force >= p.hardest else 0.0
    return min(log2(force / softest) / log2(p.hardest / softest), 1.0)


@jit
def between(soft, hard, hardness):
    """Returns `soft` at hardness 0 and `hard` at 1, evenly in its logarithm; where `soft` is 0 it is always `hard`."""
    if soft == 0.0 or hard == 0.0:
        return hard
    return hard * power(soft / hard, 1.0 - hardness)


@jit
def lay_palm(p, ops, i, frame, events, count):
    """Lays the palm on string `i` as firmly as it is wanted, or lifts it."""
    amount = max(p.palm, KEY_PALM if p.switched[PALM] > 0 else 0.0)
    firm = LIGHT_PALM * power(TIGHT_PALM / LIGHT_PALM, amount) if amount > 0.0 else 0.0
    resistance = firm / 3.0 * impedance(ops[i, 0])
    for k in range(3):
        count = lay(events, count, frame, i, k, PALM_PLACES[k], resistance, PALM_WIDTH, 0.0)
    return count


@jit
def tell_palm(p, ops, frame, events, count):
    """Lays the palm on every string that is played, or lifts it."""
    for i in range(p.strings):
        if p.state[i] != FREE:
            count = lay_palm(p, ops, i, frame, events, count)
    return count


@jit
def vibrato_depth(p):
    """Returns the depth of the vibrato, semitones."""
    return VIBRATO_DEPTH * max(p.vibrato, 1.0 if p.switched[VIBRATO] > 0 else 0.0)


@jit
def string_vibrato(p, i):
    """Returns the depth of the vibrato of string `i`, semitones: the bass's or its note's, whichever is more."""
    return max(vibrato_depth(p), VIBRATO_DEPTH * p.note_vibrato[i])


@jit
def tell_vibrato(p, frame, events, count):
    """Sends depth and rate of the vibrato to every string."""
    for i in range(p.strings):
        count = emit(events, count, frame, WAVER, i, 0, string_vibrato(p, i), VIBRATO_RATE)
    return count


@jit
def set_amount(p, ops, frame, function, amount, events, count):
    """Sets palm mute or vibrato to `amount`, 0 to 1, as its controller does; returns the new count.

    `function`: CC_PALM or CC_VIBRATO. NaN is none.
    """
    amount = min(max(amount, 0.0), 1.0) if not np.isnan(amount) else 0.0
    if function == CC_PALM:
        p.palm_set = amount
        if amount != p.palm:
            p.palm = amount
            return tell_palm(p, ops, frame, events, count)
    if function == CC_VIBRATO:
        p.vibrato_set = amount
        if amount != p.vibrato:
            p.vibrato = amount
            return tell_vibrato(p, frame, events, count)
    return count


@jit
def turn_switch(p, ops, key, on, frame, events, count):
    """Carries out a key switch that is pressed or released; returns the new count of events."""
    action, before = p.switch[key], p.pressed[key]
    p.pressed[key] = max(before + (1 if on else -1), 0)
    p.switched[action] += p.pressed[key] - before
    if action == ON_STRING:
        string = string_called(p, p.switch_value[key])
        if on:
            p.forced = string
        elif p.forced == string:
            p.forced = -1
    elif action == PALM:
        count = tell_palm(p, ops, frame, events, count)
    elif action == VIBRATO:
        count = tell_vibrato(p, frame, events, count)
    elif on and action == WITH_THUMB:
        p.slapped = p.usual_slapped if p.usual_slapped > 0 else min(2, p.strings)
        p.stroke = POP
    elif on and action in (WITH_FINGERS, WITH_PICK):
        p.slapped = 0
        p.stroke = PICK if action == WITH_PICK else FINGER
    elif on and action == STOP_ALL:
        for i in range(p.strings):
            count = stop_string(p, i, frame, events, count)
    elif on and action == HAND_AT:
        move_hand(p, p.switch_value[key])
    return count


@jit
def release_switches(p, ops, frame, events, count):
    """Releases all key switches; returns the new count of events."""
    for key in range(KEYS):
        p.pressed[key] = 0
    palm, vibrato = p.switched[PALM], p.switched[VIBRATO]
    for action in range(ACTIONS):
        p.switched[action] = 0
    p.forced = -1
    if palm > 0:
        count = tell_palm(p, ops, frame, events, count)
    if vibrato > 0:
        count = tell_vibrato(p, frame, events, count)
    return count


@jit
def move_hand(p, fret):
    """Moves the left hand so that its first finger is at `fret`, as far as the neck goes."""
    p.place = min(max(fret, 1), max(p.frets - HAND_SPAN, 1))


@jit
def string_called(p, pitch_class):
    """Returns the highest string that is called by this pitch class; the lowest of all where none is."""
    for i in range(p.strings - 1, -1, -1):
        if p.called[i] == pitch_class:
            return i
    return 0


@jit
def release(p, i, frame, events, count):
    """Lets go of a held note; the pedal may still hold it."""
    if p.pedal:
        p.state[i] = PEDALLED
        return count
    return stop_string(p, i, frame, events, count)


@jit
def note_off(p, ops, frame, key, velocity, own, events, count):
    """Releases the strings that the key holds; only string `own` if that is not -1.

    The first note-off ends a key, however often it was struck: to wait for as many note-offs as there were note-ons
    would leave a note hanging whenever one is lost, as pads and MIDI guitars that strike again without one do.
    """
    for i in range(p.strings):
        if p.state[i] == HELD and p.key[i] == key and (own < 0 or i == own):
            if p.switched[DETACH] > 0:
                count = stop_string(p, i, frame, events, count)
            elif p.stacked[i] > 0:
                count = go_back_to_key(p, ops, i, frame, velocity, events, count)
            else:
                count = release(p, i, frame, events, count)
    forget_key(p, key, own)
    return count


@jit
def go_back_to_key(p, ops, i, frame, velocity, events, count):
    """Has string `i` play on with the key that is still held under the one released: pull-off, or hammer-on."""
    p.stacked[i] -= 1
    key = p.stack[i, p.stacked[i]]
    before = shifted(p, p.fret[i])
    p.key[i] = key
    p.fret[i] = max(folded(key, p.open[i], p.open[i] + p.frets) - p.open[i], 0)
    slides, part = p.sliding or p.switched[SLIDE] > 0, (max(velocity, 1) - 1) / 126.0
    return press(p, ops, i, before, shifted(p, p.fret[i]), part, frame, slides, events, count)


@jit
def all_notes_off(p, frame, events, count):
    """Releases every held note."""
    for i in range(p.strings):
        p.stacked[i] = 0
        if p.state[i] == HELD:
            count = release(p, i, frame, events, count)
    return count


@jit
def bend_ratio(p, i):
    """Frequencies of string `i` relative to those without a bend."""
    wheel = 0.0 if p.wheel_slides else p.wheel * p.range
    semitones = wheel + p.bend_up + (p.string_bend[i] + p.note_bend[i])
    return exp2(min(max(semitones, -MOST_BEND), MOST_BEND) / 12.0)


@jit
def tell_bend(p, frame, events, count):
    """Sends the bend to every string."""
    for i in range(p.strings):
        count = emit(events, count, frame, BEND, i, 0, bend_ratio(p, i), 0.0)
    return count


@jit
def tell_slide(p, frame, events, count):
    """Slides the fretted strings that are played to the fret that the wheel is at, if that has changed."""
    wanted = p.wheel * p.range
    if not p.wheel_slides or abs(wanted - p.shift) <= SHIFTS:
        return count
    p.shift = np.int64(np.rint(wanted))
    for i in range(p.strings):
        if p.state[i] != FREE and p.fret[i] > 0:
            count = emit(events, count, frame, GLIDE, i, shifted(p, p.fret[i]), SLIDE_TIME, 0.0)
    return count


@jit
def loudness(p):
    """Gain of volume and expression, by the square as General MIDI asks."""
    return (p.volume * p.expression) ** 2 * p.level


@jit
def tell_gain(p, frame, events, count):
    """Sends volume and expression to every string."""
    for i in range(p.strings):
        count = emit(events, count, frame, GAIN, i, 0, loudness(p), 0.0)
    return count


@jit
def turned(number, value):
    """The value of parameter `number` for a controller at `value`, 0 to 127: the middle, 64, is as usual.

    The gain is that of a volume controller, from silence to 0 dB. Parameters that begin at 0 go from there to the most
    at 127: the bend range in whole numbers, the technique in equal parts.
    """
    least, most = LEAST[number], MOST[number]
    if number == GAIN_DB:
        return max(VOLUME_LAW * log2(value / 127.0), least) if value > 0 else least
    if number == TECHNIQUE:
        return np.float64(value * (np.int64(most) + 1) // CONTROLLERS)
    if number == BEND_RANGE:
        return np.float64(np.int64(value * most / 127.0 + 0.5))
    if least == 0.0:
        return value * most / 127.0
    if value < 64:
        return least * (64 - value) / 64.0
    return most * (value - 64) / 63.0


@jit
def turn_parameter(p, frame, number, value, events, count):
    """Moves parameter `number` by a controller, as a host would; returns the new count of events."""
    x = np.float64(np.float32(turned(number, value)))  # as precise as those of a host
    if number == GAIN_DB:
        p.level = power(10.0, x / 20.0) if x > LEAST[GAIN_DB] else 0.0
        return tell_gain(p, frame, events, count)
    return set_parameter(p, frame, number, x, events, count)


@jit
def control(p, ops, frame, number, value, events, count):
    """Carries out a control change: by the map of the bass, and else as MIDI has it."""
    what = p.controller[number]
    if what >= CC_PARAMETER:
        count = turn_parameter(p, frame, what - CC_PARAMETER, value, events, count)
    elif what == CC_PLACE:
        p.position = p.nearest + (p.farthest - p.nearest) * value / 127.0
    elif what == CC_VOLUME:
        p.volume = value / 127.0
        count = tell_gain(p, frame, events, count)
    elif what == CC_EXPRESSION:
        p.expression = value / 127.0
        count = tell_gain(p, frame, events, count)
    elif what == CC_LET_RING or (what == NO_FUNCTION and number == PEDAL and value < 64):
        p.pedal = 1 if value >= 64 else 0
        if not p.pedal:
            for i in range(p.strings):
                if p.state[i] == PEDALLED:
                    count = stop_string(p, i, frame, events, count)
    elif what == CC_VIBRATO:
        p.vibrato = value / 127.0
        count = tell_vibrato(p, frame, events, count)
    elif what == CC_PALM:
        p.palm = value / 127.0
        count = tell_palm(p, ops, frame, events, count)
    elif what == CC_SLIDE:
        p.sliding = 1 if value >= 64 else 0
    elif what == CC_LEGATO:
        p.legato = 1 if value >= 64 else 0
    elif what == CC_BEND:
        p.bend_ready = 1 if value < BEND_STARTS else p.bend_ready
        if p.bend_ready:
            p.bend_up = BEND_UP * value / 127.0
            count = tell_bend(p, frame, events, count)
    elif what == CC_HAND:
        move_hand(p, 1 + value * (p.frets - HAND_SPAN - 1) // 127)
    elif what == CC_BLEND:
        p.blend = (value - 64) / 64.0 if value < 64 else (value - 64) / 63.0
        for i in range(p.strings):
            count = emit(events, count, frame, BLEND, i, 0, p.blend, 0.0)
    elif number == 101:
        p.parameter = (value << 7) | (p.parameter & 127)
    elif number == 100:
        p.parameter = (p.parameter & ~127) | value
    elif number == 98 or number == 99:
        p.parameter = 16383
    elif number == 6 and p.parameter == 0:
        p.range = float(min(value, MOST_RANGE)) + (p.range - np.floor(p.range))
        count = tell_bend(p, frame, events, count)
    elif number == 38 and p.parameter == 0:
        p.range = np.floor(p.range) + min(value, 99) / 100.0
        count = tell_bend(p, frame, events, count)
    elif number == 120:
        for i in range(p.strings):
            p.state[i] = FREE
            p.key[i] = -1
            p.stacked[i] = 0
            count = emit(events, count, frame, CUT, i, 0, 0.0, 0.0)
        count = release_switches(p, ops, frame, events, count)
    elif number == 121:
        reset_controllers(p)
        count = tell_slide(p, frame, events, count)
        count = tell_bend(p, frame, events, count)
        count = tell_gain(p, frame, events, count)
        count = tell_vibrato(p, frame, events, count)
        count = tell_palm(p, ops, frame, events, count)
        for i in range(p.strings):
            if p.state[i] == PEDALLED:
                count = stop_string(p, i, frame, events, count)
    elif number >= 123:
        count = all_notes_off(p, frame, events, count)
        count = release_switches(p, ops, frame, events, count)
    return count


@jit
def set_mode(p, mode, first, channels):
    """Gives channels a meaning: `channels` of them from `first` on."""
    p.mode = mode if channels > 1 else ALL_ALIKE
    p.first_channel = first
    p.channels = channels
    p.channel_range = MPE_RANGE if mode == NOTE_A_CHANNEL else GUITAR_RANGE
    for channel in range(CHANNELS):
        p.channel_wheel[channel] = 0.0
        p.channel_place[channel] = np.nan
        p.channel_string[channel] = -1
    for i in range(MOST_STRINGS):
        p.string_bend[i] = 0.0


@jit
def own_message(p, ops, frame, status, first, second, events, count):
    """A message of a channel that has a string, or notes, of its own; returns the new count, -1: it is for the bass."""
    channel, kind = status & 0x0F, status & 0xF0
    i = p.channel_string[channel]
    if p.mode == STRING_A_CHANNEL:
        i = max(p.strings - 1 - (channel - p.first_channel), -1)  # the highest string has the first channel
    if (kind == 0x80 or kind == 0x90) and is_switch(p, first):
        return np.int64(-1)
    if p.mode == STRING_A_CHANNEL and (kind == 0x80 or (kind == 0x90 and second == 0)):
        if i < 0:
            return count
        return note_off(p, ops, frame, first, second if kind == 0x80 else 64, i, events, count)
    if kind == 0x90 and second > 0:
        if p.mode == STRING_A_CHANNEL:
            if not has_note(p, i, first):  # none has any on a channel without a string
                p.dropped += 1
                return count
            p.string_of[first] = i
        if not np.isnan(p.channel_place[channel]):
            p.place_of[first] = p.channel_place[channel]
        count = note_on(p, ops, frame, first, second, events, count)
        p.channel_string[channel] = p.latest
        if p.latest >= 0:
            count = bend_string(p, frame, p.latest, p.channel_wheel[channel] * p.channel_range, events, count)
        return count
    if kind == 0xE0:
        p.channel_wheel[channel] = wheel_of(first, second)
        if i < 0:
            return count
        return bend_string(p, frame, i, p.channel_wheel[channel] * p.channel_range, events, count)
    if kind == 0xD0 or (kind == 0xB0 and p.controller[first] == CC_VIBRATO):
        pressure = first if kind == 0xD0 else second
        if i < 0:
            return count
        return emit(events, count, frame, WAVER, i, 0, VIBRATO_DEPTH * pressure / 127.0, VIBRATO_RATE)
    if kind == 0xB0 and first == 74:
        p.channel_place[channel] = 1.0 - second / 63.5  # up is brighter, nearer to the bridge
        return count
    if kind == 0xB0 and p.parameter == 0 and (first == 6 or first == 38):  # RPN 0 on any other channel is the bass's
        whole = float(min(second, MOST_RANGE)) if first == 6 else np.floor(p.channel_range)
        p.channel_range = whole + (
            min(second, 99) / 100.0 if first == 38 else p.channel_range - np.floor(p.channel_range)
        )
        return count
    return np.int64(-1)


@jit
def wheel_of(first, second):
    """Position of a pitch wheel, -1 to 1."""
    wheel = ((second << 7) | first) - 8192
    return wheel / 8192.0 if wheel < 0 else wheel / 8191.0


@jit
def is_switch(p, key):
    """True if `key` switches: if the map has it, and the bass has no such note or the map goes before notes."""
    return p.switch[key] != NO_SWITCH and (p.over_notes != 0 or key < note_range(p)[0])


@jit
def tell_idle(p, frame, events, count):
    """Tells every string which ones nobody plays or mutes, where that has changed: they may answer (answers.py)."""
    idle = 0
    if p.answering == ALWAYS or (p.answering == WITH_PEDAL and p.pedal):
        for i in range(p.strings):
            if p.state[i] == FREE:
                idle |= 1 << i
    if idle == p.idle:
        return count
    p.idle = idle
    for i in range(p.strings):
        count = emit(events, count, frame, IDLE, i, 0, float(idle), 0.0)
    return count


@jit
def message(p, ops, frame, status, first, second, events, count):
    """One channel message at `frame`; writes events from index `count` on and returns the new count.

    ops (strings, frets + 1) are the operators; `events` needs MOST_EVENTS places free. Anything that is not a channel
    message with data bytes of 0 to 127 is ignored.
    """
    count = carry_out(p, ops, frame, status, first, second, events, count)
    return tell_idle(p, frame, events, count)


@jit
def ring_on(p, ops, player, told, before, after, frame, status, first, second, events, count):
    """`message` for a bass that rings out while `player` plays: it starts no note; returns the new count.

    `player` has turned the message into the events told[before:after]: a string that is plucked or struck there is
    damped here, by its tuning.
    """
    if not (status & 0xF0 == 0x90 and second > 0):
        return message(p, ops, frame, status, first, second, events, count)
    for k in range(before, after):
        event = told[k]
        if event.kind in (PLUCK, STRIKE_EVENT, THROW):
            for i in range(p.strings):
                if p.open[i] == player.open[event.string]:
                    count = stop_string(p, i, frame, events, count)
    return count


@jit
def carry_out(p, ops, frame, status, first, second, events, count):
    """`message`, but for the strings that may answer."""
    if status < 0x80 or status > 0xEF or first > 127 or second > 127:
        return count
    kind, channel = status & 0xF0, status & 0x0F
    if p.mode != ALL_ALIKE and p.first_channel <= channel < p.first_channel + p.channels:
        after = own_message(p, ops, frame, status, first, second, events, count)
        if after >= 0:
            return after
    if kind == 0xB0 and first >= 126:
        p.mono = first == 126 and second < 2
        set_mode(p, STRING_A_CHANNEL if first == 126 else ALL_ALIKE, channel, min(second, CHANNELS - channel))
    if kind == 0xB0 and first == 6 and p.parameter == 6:  # the zone of MPE whose master is this channel
        members = min(second, CHANNELS - 1)
        set_mode(p, NOTE_A_CHANNEL, 1 if channel == 0 else CHANNELS - 1 - members, members)
        return count
    if (kind == 0x80 or kind == 0x90) and is_switch(p, first):
        return turn_switch(p, ops, first, kind == 0x90 and second > 0, frame, events, count)
    if kind == 0x90 and second > 0:
        return note_on(p, ops, frame, first, second, events, count)
    if kind == 0x80 or kind == 0x90:
        return note_off(p, ops, frame, first, second if kind == 0x80 else 64, np.int64(-1), events, count)
    if kind == 0xB0:
        return control(p, ops, frame, first, second, events, count)
    if kind == 0xE0:
        p.wheel = wheel_of(first, second)
        if p.wheel_slides:
            return tell_slide(p, frame, events, count)
        return tell_bend(p, frame, events, count)
    return count
