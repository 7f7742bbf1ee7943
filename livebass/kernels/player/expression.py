"""How notes that sound are shaped: bend, vibrato, volume, and a wheel that slides along the frets. [audio thread]"""

import numpy as np

from livebass.compiling import jit
from livebass.kernels.machine.elementary import exp2, squared
from livebass.kernels.player.events import send_bend, send_gain, send_slide, send_vibrato
from livebass.kernels.player.fingering import stopped_at, string_of_key
from livebass.kernels.player.performer import FREE
from livebass.techniques import VIBRATO

MOST_BEND = 97.0  # semitones: no bend goes farther than the largest range and its fine part
SHIFTS = 0.6  # semitones off its fret at which a wheel that slides changes frets: with half a one it would jitter
SLIDE_TIME = 22e-3  # s a fret
VIBRATO_DEPTH, VIBRATO_RATE = 0.4, 5.6  # semitones at most; Hz


@jit
def wheel_of(first, second):
    """Position of a pitch wheel, -1 to 1."""
    wheel = ((second << 7) | first) - 8192
    return wheel / 8192.0 if wheel < 0 else wheel / 8191.0


@jit
def limited_bend(semitones):
    """A bend, held within what there is; NaN is none."""
    return 0.0 if np.isnan(semitones) else min(max(semitones, -MOST_BEND), MOST_BEND)


@jit
def bend_ratio(p, i):
    """Frequencies of string `i` relative to those without a bend."""
    controls = p.controls
    wheel = 0.0 if p.wheel_slides else controls.wheel * p.range
    semitones = wheel + controls.bend_up + (controls.string_bend[i] + p.hands.note_bend[i])
    return exp2(min(max(semitones, -MOST_BEND), MOST_BEND) / 12.0)


@jit
def send_bends(p):
    """Sends the bend to every string."""
    for i in range(p.strings):
        send_bend(p, i, bend_ratio(p, i))


@jit
def bend_string(p, i, semitones):
    """Bends string `i` by so many semitones, besides what the wheel does."""
    if i < p.strings:
        p.controls.string_bend[i] = limited_bend(semitones)
        send_bend(p, i, bend_ratio(p, i))


@jit
def bend_note(p, key, semitones):
    """Bends the string that played `key` last, until it plays another note."""
    i = string_of_key(p, key)
    if i >= 0:
        p.hands.note_bend[i] = limited_bend(semitones)
        send_bend(p, i, bend_ratio(p, i))


@jit
def follow_wheel(p):
    """Slides the fretted strings that are played to the fret that the wheel is at, if that has changed."""
    wanted = p.controls.wheel * p.range
    if not p.wheel_slides or abs(wanted - p.hands.shift) <= SHIFTS:
        return
    p.hands.shift = np.int64(np.rint(wanted))
    for i in range(p.strings):
        if p.hands.state[i] != FREE and p.hands.fret[i] > 0:
            send_slide(p, i, stopped_at(p, p.hands.fret[i]), SLIDE_TIME)


@jit
def loudness(p):
    """Gain of volume and expression, by the square as General MIDI asks."""
    return squared(p.controls.volume * p.controls.expression) * p.controls.level


@jit
def send_gains(p):
    """Sends volume and expression to every string."""
    for i in range(p.strings):
        send_gain(p, i, loudness(p))


@jit
def vibrato_depth(p):
    """Returns the depth of the vibrato, semitones."""
    return VIBRATO_DEPTH * max(p.controls.vibrato, 1.0 if p.switched[VIBRATO] > 0 else 0.0)


@jit
def string_vibrato(p, i):
    """Returns the depth of the vibrato of string `i`, semitones: the bass's or its note's, whichever is more."""
    return max(vibrato_depth(p), VIBRATO_DEPTH * p.hands.note_vibrato[i])


@jit
def send_vibratos(p):
    """Sends depth and rate of the vibrato to every string."""
    for i in range(p.strings):
        send_vibrato(p, i, string_vibrato(p, i), VIBRATO_RATE)


@jit
def vibrate_note(p, key, amount):
    """Sets the vibrato of the string that played `key` last, 0 to 1, until its next note.

    The bass's own vibrato is the least. NaN is none.
    """
    i = string_of_key(p, key)
    if i >= 0:
        p.hands.note_vibrato[i] = min(max(amount, 0.0), 1.0) if not np.isnan(amount) else 0.0
        send_vibrato(p, i, string_vibrato(p, i), VIBRATO_RATE)


@jit
def end_note_expression(p, i):
    """Takes bend and vibrato of the note before from string `i`."""
    if p.hands.note_bend[i] != 0.0:
        p.hands.note_bend[i] = 0.0
        send_bend(p, i, bend_ratio(p, i))
    if p.hands.note_vibrato[i] != 0.0:
        p.hands.note_vibrato[i] = 0.0
        send_vibrato(p, i, vibrato_depth(p), VIBRATO_RATE)
