"""Shapes sounding notes: bend, vibrato, volume, and a wheel that slides along the frets. [audio thread]"""

import numpy as np

from livebass.compiling import jit
from livebass.kernels.hands.sliding import SLIDE_TIME
from livebass.kernels.machine.elementary import exp2, square
from livebass.kernels.player.channels import followed_channel, follows, record_of
from livebass.kernels.player.events import send_slide, send_value, send_vibrato
from livebass.kernels.player.fingering import stopped_at, string_of_key
from livebass.kernels.player.performer import ANY, FREE, IN_TUNE
from livebass.kernels.string.records import BEND, GAIN
from livebass.rows.techniques import VIBRATO

MAX_BEND = 97.0  # semitones: the largest range with its fine part
SHIFTS = 0.6  # semitones off the fret at which a sliding wheel changes frets: at 0.5 it would jitter
VIBRATO_DEPTH, VIBRATO_RATE = 0.4, 5.6  # semitones at most; Hz


@jit
def wheel_of(first, second):
    """Position of a pitch wheel, -1 to 1."""
    return wheel_at(((second << 7) | first) - 8192)


@jit
def wheel_at(steps):
    """Position, -1 to 1, of a wheel that is `steps` from its middle, -8192 to 8191."""
    return steps / 8192.0 if steps < 0 else steps / 8191.0


@jit
def limited_bend(semitones):
    """A bend, held within its limits; NaN means no bend."""
    return 0.0 if np.isnan(semitones) else min(max(semitones, -MAX_BEND), MAX_BEND)


@jit
def bend_ratio(p, i):
    """Frequency ratio of string `i`'s bend."""
    channel = record_of(p, i)
    wheel = 0.0 if p.wheel_slides else channel.wheel * channel.range
    tuning = channel.coarse + (channel.fine - IN_TUNE) / float(IN_TUNE)
    semitones = wheel + channel.bend_up + tuning + (p.controls.string_bend[i] + p.hands.note_bend[i])
    return exp2(min(max(semitones, -MAX_BEND), MAX_BEND) / 12.0)


@jit
def update_bend(p, i):
    """Sends string `i` its bend."""
    send_value(p, i, BEND, bend_ratio(p, i))


@jit
def bend_string(p, i, semitones):
    """Bends string `i` by `semitones`, on top of the wheel."""
    if i < p.strings:
        p.controls.string_bend[i] = limited_bend(semitones)
        update_bend(p, i)


@jit
def bend_note(p, channel, key, semitones):
    """Bends the string that played `key` of `channel` last, until it plays another note."""
    i = string_of_key(p, channel, key)
    if i >= 0:
        p.hands.note_bend[i] = limited_bend(semitones)
        update_bend(p, i)


@jit
def follow_wheel(p, channel):
    """Slides the played, fretted strings of `channel` to its wheel's fret, if that has changed."""
    if not p.wheel_slides:
        return
    own, bass = moves_shift(p, channel), moves_shift(p, np.int64(ANY))
    for i in range(p.strings):
        which = followed_channel(p, i)
        moves = bass if which == ANY else own and which == channel
        if moves and p.hands.state[i] != FREE and p.hands.fret[i] > 0:
            send_slide(p, i, stopped_at(p, i, p.hands.fret[i]), SLIDE_TIME)


@jit
def moves_shift(p, which):
    """Shifts the record `which` by whole frets to its wheel; returns False if it is near enough already."""
    wanted = p.controls.channel[which].wheel * p.controls.channel[which].range
    if abs(wanted - p.hands.shift[which]) <= SHIFTS:
        return False
    p.hands.shift[which] = np.int64(np.rint(wanted))
    return True


@jit
def loudness(p, i):
    """Gain of string `i` from volume and expressions, squared as General MIDI asks."""
    channel = record_of(p, i)
    return square(channel.volume * channel.expression * p.controls.string_expression[i]) * p.controls.level


@jit
def update_gain(p, i):
    """Sends string `i` its volume and expression."""
    send_value(p, i, GAIN, loudness(p, i))


@jit
def express_string(p, i, expression):
    """Sets the expression, 0 to 1, of string `i` alone."""
    if i < p.strings:
        p.controls.string_expression[i] = expression
        update_gain(p, i)


@jit
def vibrato_depth(p, i):
    """Returns string `i`'s vibrato depth from channel and key switch, semitones."""
    return VIBRATO_DEPTH * max(record_of(p, i).vibrato, 1.0 if p.switched[VIBRATO] > 0 else 0.0)


@jit
def string_vibrato(p, i):
    """Returns string `i`'s vibrato depth, semitones: the channel's or the note's, whichever is larger."""
    return max(vibrato_depth(p, i), VIBRATO_DEPTH * p.hands.note_vibrato[i])


@jit
def update_vibrato(p, i):
    """Sends string `i` its vibrato's depth and rate."""
    send_vibrato(p, i, string_vibrato(p, i), VIBRATO_RATE)


def for_followers(update):
    """Makes the kernel that calls update(p, i) for every string `i` that follows a channel."""

    def update_followers(p, channel):
        """Updates every string that follows `channel`."""
        for i in range(p.strings):
            if follows(p, i, channel):
                update(p, i)

    update_followers.__qualname__ = f"{update.__name__}_of_followers"
    return jit(update_followers)


send_bends = for_followers(update_bend)
send_gains = for_followers(update_gain)
send_vibratos = for_followers(update_vibrato)


@jit
def take_channel(p, i, channel):
    """Makes string `i` follow `channel` (-1: ANY). Sends bend, gain and vibrato if they change."""
    if p.hands.channel[i] == channel:
        return
    bend, gain, vibrato = bend_ratio(p, i), loudness(p, i), string_vibrato(p, i)
    p.hands.channel[i] = channel
    if bend_ratio(p, i) != bend:
        update_bend(p, i)
    if loudness(p, i) != gain:
        update_gain(p, i)
    if string_vibrato(p, i) != vibrato:
        update_vibrato(p, i)


@jit
def vibrate_note(p, channel, key, amount):
    """Sets the vibrato of the string that played `key` of `channel` last, 0 to 1, until its next note.

    The vibrato is never less than the channel's. NaN means none.
    """
    i = string_of_key(p, channel, key)
    if i >= 0:
        p.hands.note_vibrato[i] = min(max(amount, 0.0), 1.0) if not np.isnan(amount) else 0.0
        update_vibrato(p, i)


@jit
def end_note_expression(p, i):
    """Clears the previous note's bend and vibrato on string `i`."""
    if p.hands.note_bend[i] != 0.0:
        p.hands.note_bend[i] = 0.0
        update_bend(p, i)
    if p.hands.note_vibrato[i] != 0.0:
        p.hands.note_vibrato[i] = 0.0
        update_vibrato(p, i)
