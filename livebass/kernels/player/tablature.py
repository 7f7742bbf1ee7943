"""Plays by strings, as a tablature is written: each stroke has its string, fret and technique. [audio thread]

Nothing here depends on the key map, and a stroke's technique reaches no other string. `word` and `value` are an event's
(words.py).
"""

import numpy as np

from livebass.compiling import SMALL, compiled
from livebass.kernels.machine.elementary import power
from livebass.kernels.player import expression, words
from livebass.kernels.player.events import send_vibrato
from livebass.kernels.player.fingering import stopped_at
from livebass.kernels.player.notes import end_held, sound_string, take_string_for
from livebass.kernels.player.parameters import set_technique
from livebass.kernels.player.performer import FREE, GUITAR_RANGE, HELD
from livebass.kernels.player.touches import touch_palm
from livebass.rows.techniques import ACTIONS, DOWN_STROKE, FUNCTION_ROWS, OWN, SLIDE_STEP, TECHNIQUE, UP_STROKE

jit = compiled(attributes=SMALL)

PALM = FUNCTION_ROWS["palm_mute"].pressed / 127.0  # of a palm-muted stroke
MAX_PARTIAL = 8
MAX_VALUE = float(1 << 24)  # below it a float32 holds every whole number


@jit
def play_by_string(p, ops, kind, word, value):
    """Handles an event of the kinds STROKE to STRING_REST; one for a string that the bass lacks does nothing."""
    i = words.field(word, words.STRING) if kind in (words.STROKE, words.STROKE_END) else word & words.NUMBER
    if i >= p.strings or np.isnan(value):
        return
    if kind == words.STROKE:
        begin_stroke(p, ops, i, word, value)
    elif kind == words.STROKE_END:
        end_stroke(p, ops, i, words.field(word, words.WITH))
    elif kind == words.STRING_WHEEL:
        expression.bend_string(p, i, expression.wheel_at(value) * GUITAR_RANGE)
    elif kind == words.STRING_VIBRATO:
        vibrate_string(p, i, value)
    elif kind == words.STRING_EXPRESSION:
        expression.express_string(p, i, value / 127.0)
    elif kind == words.STRING_REST:
        rest_string(p, ops, i)


@jit
def begin_stroke(p, ops, i, word, value):
    """Plays a stroke on string `i`; if its note still sounds, the left hand leads on to the fret."""
    fret, technique = words.field(word, words.FRET), words.field(word, words.WITH)
    bits = np.int64(value) if 0.0 <= value < MAX_VALUE else np.int64(0)
    partial, strikes = words.field(bits, words.PARTIAL), words.field(bits, words.STRIKES)
    if bits == 0 or fret > p.frets or technique >= ACTIONS or partial == 1 or partial > MAX_PARTIAL:
        p.dropped += 1
        return
    dynamics, slide_time, palm = p.dynamics, p.controls.slide_time, p.controls.palm
    move_palm(p, ops, words.field(word, words.PALMED))
    louder = words.DYNAMICS_STEP * (words.field(bits, words.LOUDER) - words.NO_DYNAMICS)  # dB
    p.dynamics = dynamics * power(10.0, louder / 20.0)
    p.controls.slide_time = SLIDE_STEP * words.field(bits, words.SLOW)
    if strikes != OWN:
        set_technique(p, strikes)
    hold(p, technique, words.field(word, words.DIRECTION), 1)
    take_stroke(p, ops, i, fret, partial, words.field(word, words.VELOCITY))
    hold(p, technique, words.field(word, words.DIRECTION), -1)
    if strikes != OWN:
        set_technique(p, np.int64(np.rint(p.controls.adjusted[TECHNIQUE])))
    p.hands.palmed |= words.field(word, words.PALMED) << i
    p.dynamics, p.controls.slide_time, p.controls.palm = dynamics, slide_time, palm


@jit
def take_stroke(p, ops, i, fret, partial, velocity):
    """Gives string `i` to a stroke at `fret`, and sounds it."""
    hands = p.hands
    before = np.int64(-1)
    if hands.state[i] == HELD and partial == 0:
        before = stopped_at(p, i, hands.fret[i])
    elif hands.state[i] != FREE:
        p.stolen += 1
    hands.stacked[i], hands.struck_at[i] = 0, p.out.frame
    take_string_for(p, i, fret, p.open[i] + fret)
    expression.end_note_expression(p, i)
    expression.take_channel(p, i, np.int64(-1))
    sound_string(p, ops, i, before, partial, velocity, np.nan)


@jit
def hold(p, technique, direction, more):
    """Counts `more` of what holds a stroke's technique and direction."""
    p.switched[technique] += more
    if direction == words.DOWN:
        p.switched[DOWN_STROKE] += more
    elif direction == words.UP:
        p.switched[UP_STROKE] += more


@jit
def move_palm(p, ops, palm):
    """Lays the palm of a stroke (1) on all played strings, or lifts it (0) where it lies.

    Strings struck in the same frame keep theirs: in a chord each string is muted or not.
    """
    hands = p.hands
    if palm:
        p.controls.palm = PALM
    for k in range(p.strings):
        if hands.state[k] == FREE:
            hands.palmed &= ~(1 << k)  # its next stroke lifts all fingers
        elif (hands.palmed >> k) & 1 != palm and hands.struck_at[k] != p.out.frame:
            hands.palmed ^= 1 << k
            touch_palm(p, ops, k)


@jit
def vibrate_string(p, i, value):
    """Sets the vibrato of string `i`, 0 to 127; the same one again does not begin anew."""
    if value != p.hands.string_vibrato[i]:
        p.hands.string_vibrato[i] = value
        send_vibrato(p, i, expression.VIBRATO_DEPTH * value / 127.0, expression.VIBRATO_RATE)


@jit
def end_stroke(p, ops, i, technique):
    """Ends the stroke that string `i` plays, if any, with a `technique`: for example, it slides off."""
    if p.hands.state[i] != HELD or p.hands.channel[i] >= 0 or technique >= ACTIONS:
        return
    slide_time = p.controls.slide_time
    p.controls.slide_time = 0.0
    p.switched[technique] += 1
    end_held(p, ops, i, np.int64(0))
    p.switched[technique] -= 1
    p.controls.slide_time = slide_time


@jit
def rest_string(p, ops, i):
    """Ends the stroke of string `i`, and what moves it."""
    end_stroke(p, ops, i, np.int64(0))
    if p.controls.string_bend[i] != 0.0:
        expression.bend_string(p, i, 0.0)
    if p.controls.string_expression[i] != 1.0:
        expression.express_string(p, i, 1.0)
    vibrate_string(p, i, 0.0)
    if (p.hands.palmed >> i) & 1:
        p.hands.palmed ^= 1 << i
        if p.hands.state[i] != FREE:  # a hand that ends the note stays on the string
            touch_palm(p, ops, i)
