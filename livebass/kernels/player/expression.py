"""Bends, vibrato, volume and slides of the strings, by wheel, controllers and notes. [audio thread]"""

import numpy as np

from livebass.compiling import jit
from livebass.kernels.machine.elementary import exp2
from livebass.kernels.player.events import emit
from livebass.kernels.player.fingering import shifted
from livebass.kernels.player.performer import FREE
from livebass.kernels.string.records import BEND, GAIN, GLIDE, WAVER
from livebass.techniques import VIBRATO

MOST_BEND = 97.0  # ... and no bend goes farther
SHIFTS = 0.6  # semitones off its fret at which a wheel that slides changes frets: with half a one it would jitter
SLIDE_TIME = 22e-3  # s a fret
VIBRATO_DEPTH, VIBRATO_RATE = 0.4, 5.6  # semitones at most; Hz


@jit
def held_bend(semitones):
    """A bend, held within what there is; NaN is none."""
    return 0.0 if np.isnan(semitones) else min(max(semitones, -MOST_BEND), MOST_BEND)


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
def wheel_of(first, second):
    """Position of a pitch wheel, -1 to 1."""
    wheel = ((second << 7) | first) - 8192
    return wheel / 8192.0 if wheel < 0 else wheel / 8191.0
