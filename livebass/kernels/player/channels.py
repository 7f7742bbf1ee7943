"""A string follows the controllers of the channel that played it last. [audio thread]

A channel's messages set its own record (performer.CHANNEL) and the whole bass's record, ANY. Strings that have not
been played yet follow ANY; while channels have a meaning (MPE, MIDI mode 4), all strings do. So if everything comes on
one channel, it applies to all strings. A channel with notes of its own, of an MPE zone or a string in MIDI mode 4, has
a pedal for these notes alone.
"""

from livebass.compiling import jit
from livebass.kernels.player.performer import ALL_ALIKE, ANY, STRING_A_CHANNEL
from livebass.rows.techniques import LET_RING


@jit
def followed_channel(p, i):
    """Returns the channel whose record string `i` follows, or ANY."""
    channel = p.hands.channel[i]
    return ANY if channel < 0 or p.controls.mode != ALL_ALIKE else channel


@jit
def record_of(p, i):
    """Returns the record that string `i` follows."""
    return p.controls.channel[followed_channel(p, i)]


@jit
def follows(p, i, channel):
    """True if string `i` obeys `channel`. All strings obey ANY."""
    which = followed_channel(p, i)
    return channel == ANY or which in (channel, ANY)


@jit
def leading(p, channel):
    """Returns the record that gives a message of `channel` its meaning, such as the selected RPN."""
    return p.controls.channel[channel if p.controls.mode == ALL_ALIKE else ANY]


@jit
def has_own_notes(p, channel):
    """True for a channel of an MPE zone, and if MIDI mode 4 gives `channel` a string."""
    return p.controls.mode != ALL_ALIKE and 0 <= channel - p.controls.first_channel < p.controls.channels


@jit
def owner_of(p, i):
    """Returns the channel whose own note string `i` played last, or that alone has the string; or ANY."""
    channel = p.hands.channel[i]
    if p.controls.mode == STRING_A_CHANNEL:
        channel = p.controls.first_channel + p.strings - 1 - i  # the highest string has the first channel
    return channel if has_own_notes(p, channel) else ANY


@jit
def rings_on(p, i):
    """True if string `i` rings on after its release: its channel's pedal is down, or the whole bass lets ring."""
    owner = owner_of(p, i)
    own = owner != ANY and p.controls.channel[owner].pedal != 0
    return own or record_of(p, i).pedal != 0 or p.switched[LET_RING] > 0


@jit
def pedal_is_down(p):
    """True if any channel's pedal is down, but for those of single notes, or the whole bass lets ring."""
    if p.switched[LET_RING] > 0:
        return True
    if p.controls.mode != ALL_ALIKE:
        return p.controls.channel[ANY].pedal != 0
    pedals = 0
    for channel in range(ANY + 1):
        pedals |= p.controls.channel[channel].pedal
    return pedals != 0
