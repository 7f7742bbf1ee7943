"""Styles of Yamaha keyboards: which channel is the bass, in which section.

A style is a MIDI file of one track, which plays an accompaniment section by section, each behind a marker with its
name. The chunk CASM behind the track says, for the sections that a CSEG in it names, to which part of the keyboard each
channel goes. Several may be the bass: variants for different chords, of which the keyboard plays one. Source: P.
Wierzba and M. Bedesem, "Style files: introduction and details", for SFF1 (Ctab) and SFF2 (Ctb2).
"""

import numpy as np

from livebass.compiling import SMALL, compiled
from livebass.kernels.machine.native import bytes_at
from livebass.kernels.player.performer import CHANNELS
from livebass.kernels.score.memory import NONE, file_at, texts_at
from livebass.kernels.score.smf import CHUNK_HEAD, number_at

jit = compiled(attributes=SMALL)

CSEG, SDEC, CTAB, CTB2 = (int.from_bytes(name) for name in (b"CSEG", b"Sdec", b"Ctab", b"Ctb2"))
BASS = 10  # the keyboard's part, and its channel if nothing assigns one
PART = 9  # byte of a Ctab that tells it; byte 0 is the channel
COMMA, SPACE = 0x2C, 0x20
MAX_CASM, MAX_TEXTS = 1 << 16, 1 << 10  # bytes; texts of a style: more are no style, and could take minutes


@jit
def is_style(score):
    """True if the file is a style."""
    file = file_at(score.file)
    return file.tracks == 1 and 0 < file.casm_size <= MAX_CASM and file.texts <= MAX_TEXTS


@jit
def bass_channel(score, section, sounding):
    """The channel of the bass in a section, of its variants the first, and their number.

    section: the number of its TEXT, or NONE. sounding: the channels with notes there, a bit each; others do not count.
    NONE: the bass has no notes.
    """
    file = file_at(score.file)
    data, size = bytes_at(score.data + file.casm, file.casm_size), file.casm_size
    first, variants, found, own, at = np.int64(NONE), 0, False, False, np.int64(0)
    while section != NONE and at + CHUNK_HEAD <= size:
        kind, body = number_at(data, at, 4), min(number_at(data, at + 4, 4), size - at - CHUNK_HEAD)
        at += CHUNK_HEAD
        if kind == CSEG:  # its chunks follow
            continue
        if kind == SDEC:
            own = names_section(score, data, at, at + body, section)
            found = found or own
        elif own and kind in (CTAB, CTB2) and body > PART and data[at + PART] == BASS:
            channel = np.int64(data[at])
            if channel < CHANNELS and (sounding >> channel) & 1 == 1:
                sounding &= ~(np.int64(1) << channel)
                first = channel if first == NONE else first
                variants += 1
        at += body
    if not found and (sounding >> BASS) & 1 == 1:
        return np.int64(BASS), 1
    return first, variants


@jit
def names_section(score, data, at, end, section):
    """True if the list of names from byte `at` to `end` has that of a section."""
    file = file_at(score.file)
    text = texts_at(file.text_rows, file.texts)[section]
    name, begin = bytes_at(score.data + text.at, text.size), at
    for k in range(at, end + 1):
        if k == end or data[k] == COMMA:
            if is_same(data, begin, k, name, np.int64(text.size)):
                return True
            begin = k + 1
    return False


@jit
def is_same(data, begin, end, name, size):
    """True if the bytes from `begin` to `end` are a name, but for spaces and zeros behind them."""
    while end > begin and data[end - 1] in (0, SPACE):
        end -= 1
    while size > 0 and name[size - 1] in (0, SPACE):
        size -= 1
    same = 0
    while same < min(size, end - begin) and data[begin + same] == name[same]:
        same += 1
    return same > 0 and same == size and begin + same == end
