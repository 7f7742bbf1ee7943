"""Lines that play drums: channel 10, unless names, banks and system exclusive messages say otherwise.

Banks: 120 and 121 of General MIDI 2; 126 and 127 of XG, but not after a GS reset. System exclusive: rhythm parts of GS,
part modes of XG.
"""

import numpy as np

from livebass.compiling import SMALL, compiled
from livebass.kernels.machine.native import bytes_at
from livebass.kernels.player.performer import CHANNELS
from livebass.kernels.score.memory import NONE, lines_of, sent_at, tracks_of

jit = compiled(attributes=SMALL)

DRUMS = 9  # the channel of General MIDI, from 0
BANK = 0  # the controller that selects the most significant byte of a bank, and its values:
GM2_DRUMS, GM2_MELODIC, XG_DRUMS = 120, 121, (126, 127)
MELODIC = 3  # keys of a track called bass on the channel of drums that make it a bass: a bass drum has one or two
GENERAL, ROLAND, YAMAHA = 0, 1, 2  # standards


@jit
def reset_kits(score):
    """Begins a pass over the messages."""
    lines, score.exclusive = lines_of(score), 0
    for k in range(score.lines_count):
        lines[k].kit, lines[k].system = NONE, GENERAL


@jit
def has_drums(score, line, frame, track):
    """True if a note of `line` and `track` at `frame`, in ascending order, plays drums."""
    sent = sent_at(score.sent_exclusives, score.exclusives_count)
    while score.exclusive < score.exclusives_count and sent[score.exclusive].frame <= frame:
        take_exclusive(score, sent[score.exclusive])
        score.exclusive += 1
    lines, bank = lines_of(score), line.bank
    system = lines[line.home].system
    if bank == GM2_DRUMS or (bank in XG_DRUMS and system != ROLAND):
        return True
    if bank == GM2_MELODIC or (system == YAMAHA and bank != NONE):
        return False
    kit = lines[line.home + line.channel].kit
    return kit == 1 if kit != NONE else line.channel == DRUMS and tracks_of(score)[track].bass == 0


@jit
def take_exclusive(score, sent):
    """Takes a system exclusive message."""
    data, size = bytes_at(score.data + sent.at, sent.size), sent.size
    if size >= 3 and data[0] == 0x7E and data[2] == 0x09:
        reset_port(score, sent.home, GENERAL)
    elif size >= 4 and data[0] == 0x41 and data[2] == 0x42 and data[3] == 0x12:
        take_roland(score, sent.home, data, size)
    elif size >= 3 and data[0] == 0x43 and data[2] == 0x4C:
        take_yamaha(score, sent.home, data, size)


@jit
def take_roland(score, home, data, size):
    """Takes a message of GS: a reset, or the mode of a part."""
    if size >= 7 and data[4] == 0x40 and data[5] == 0x00 and data[6] == 0x7F:
        reset_port(score, home, ROLAND)
    elif size > 7 and data[4] == 0x40 and data[5] & 0xF0 == 0x10 and data[6] == 0x15:
        part = np.int64(data[5]) & 0x0F
        channel = part
        if part == 0:
            channel = np.int64(DRUMS)
        elif part <= DRUMS:
            channel = part - 1
        lines_of(score)[home + channel].kit = 1 if data[7] != 0 else 0


@jit
def take_yamaha(score, home, data, size):
    """Takes a message of XG: a reset, or the mode of a part."""
    if size >= 6 and data[3] == 0x00 and data[4] == 0x00 and data[5] == 0x7E:
        reset_port(score, home, YAMAHA)
    elif size > 6 and data[3] == 0x08 and data[4] < CHANNELS and data[5] == 0x07:
        lines_of(score)[home + np.int64(data[4])].kit = 1 if data[6] != 0 else 0


@jit
def reset_port(score, home, system):
    """Sets the standard of a port; its channels start again."""
    lines = lines_of(score)
    lines[home].system = system
    for channel in range(CHANNELS):
        lines[home + channel].kit = NONE
