"""Which channel's controllers a string follows: those of the channel that has played it last. [audio thread]

A channel's messages go to its own record (performer.CHANNEL) and to that of the bass as a whole, ANY. Strings that
nobody has played yet, and all strings while channels mean something (MPE, mode 4 of MIDI), follow ANY. So whatever
comes on one channel alone is for all strings.
"""

from livebass.compiling import jit
from livebass.kernels.player.performer import ALL_ALIKE, ANY


@jit
def followed(p, i):
    """Returns the channel whose record string `i` follows, or ANY."""
    channel = p.hands.channel[i]
    return ANY if channel < 0 or p.controls.mode != ALL_ALIKE else channel


@jit
def record_of(p, i):
    """Returns the record that string `i` follows."""
    return p.controls.channel[followed(p, i)]


@jit
def follows(p, i, channel):
    """True if string `i` does what `channel` asks for. All strings do what ANY asks for."""
    which = followed(p, i)
    return channel == ANY or which in (channel, ANY)


@jit
def leading(p, channel):
    """Returns the record that tells what a message of `channel` means: which RPN it has selected, for one."""
    return p.controls.channel[channel if p.controls.mode == ALL_ALIKE else ANY]


@jit
def pedal_is_down(p):
    """True if the pedal of any channel is down."""
    if p.controls.mode != ALL_ALIKE:
        return p.controls.channel[ANY].pedal != 0
    pedals = 0
    for channel in range(ANY + 1):
        pedals |= p.controls.channel[channel].pedal
    return pedals != 0
