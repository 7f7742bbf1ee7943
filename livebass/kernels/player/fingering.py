"""Chooses a note's string and fret (`choose_string`) and moves the left hand. [audio thread]"""

import numpy as np

from livebass.compiling import jit
from livebass.kernels.player.channels import followed_channel, follows
from livebass.kernels.player.performer import FREE, HELD
from livebass.rows.techniques import AVOID_OPEN, HAND_POSITION

HAND_SPAN = 3  # frets beyond the first finger
# The cheapest string is chosen. Costs: per fret, per fret beyond the hand, and for taking a sounding string, less for
# older notes. A sounding string is only taken for its own note, or if no other string can play this one.
FRET_COST, MOVE_COST, TAKEN_COST, AGE_GAIN = 0.4, 2.5, 1000.0, 1e-6
OPEN_COST = 200.0  # of an open string that the player avoids
SHARED_COST = 500.0  # of a string that sounds this note for another channel: both sound if a string is free
HARMONICS = (12, 19, 24, 28, 31, 34, 36)  # semitones of harmonics 2 to 8 above the open string
UNCALLED = 5  # of these sound on any string, the others on a string that the player chose


@jit
def choose_string(p, channel, note):
    """Returns the string for `note` of `channel`, -1: none has it. Prefers free, then near, then oldest strings.

    Near is the hand, or the place of HAND_POSITION. With AVOID_OPEN a string is open only if no free one has the note.
    """
    hands, place = p.hands, np.int64(p.controls.settings[HAND_POSITION])
    if place == 0:
        place = hands.place
    best = -1
    minimum = np.inf
    for i in range(p.strings):
        fret = note - p.open[i]
        if fret < 0 or fret > p.frets:
            continue
        cost = FRET_COST * fret
        if fret > 0:
            away = max(place - fret, fret - place - HAND_SPAN, 0)
            cost += MOVE_COST * away
        elif p.controls.settings[AVOID_OPEN] > 0.0:
            cost += OPEN_COST
        if hands.state[i] != FREE:
            same = hands.key[i] >= 0 and p.open[i] + hands.fret[i] == note
            if same:
                cost += -TAKEN_COST if follows(p, i, channel) else SHARED_COST
            else:
                cost += TAKEN_COST - AGE_GAIN * (hands.clock - hands.age[i])
        if cost < minimum:
            minimum = cost
            best = i
    return best


@jit
def has_note(p, i, note):
    """True if string `i`, which may be -1, has `note`."""
    return i >= 0 and 0 <= note - p.open[i] <= p.frets


@jit
def sounding_string(p, note):
    """Returns the held string played last that has `note`; -1: none.

    The string whose key switch is held takes precedence.
    """
    hands = p.hands
    last = -1
    if has_note(p, p.forced, note) and hands.state[p.forced] == HELD:
        return p.forced
    for i in range(p.strings):
        if hands.state[i] == HELD and has_note(p, i, note) and (last < 0 or hands.age[i] > hands.age[last]):
            last = i
    return last


@jit
def natural_harmonic(p, note, wanted):
    """Returns a string that has `note` as a natural harmonic, free ones first, and its number; -1, 0: none.

    Only string `wanted` counts, unless it is -1; the string whose key switch is held takes precedence. The 7th and the
    8th only sound on one of these strings.
    """
    state = p.hands.state
    best, number = -1, 0
    for n in range(len(HARMONICS)):
        for i in range(p.strings):
            fits = (wanted < 0 or i == wanted) and note - p.open[i] == HARMONICS[n]
            fits = fits and (n < UNCALLED or i in (wanted, p.forced))
            if fits and i == p.forced:
                return i, n + 2
            if fits and (best < 0 or (state[best] != FREE and state[i] == FREE)):
                best, number = i, n + 2
    return best, number


@jit
def string_of_key(p, channel, key):
    """Returns the string that played `key` of `channel` last; -1: none. ANY: any channel."""
    last = -1
    for i in range(p.strings):
        if p.hands.key[i] == key and follows(p, i, channel) and (last < 0 or p.hands.age[i] > p.hands.age[last]):
            last = i
    return last


@jit
def string_called(p, pitch_class):
    """Returns the highest string that this pitch class calls; the lowest of all if it calls none."""
    for i in range(p.strings - 1, -1, -1):
        if p.called[i] == pitch_class:
            return i
    return 0


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
def fold_note(note, low, high):
    """Returns `note` moved by octaves to `high` or below and, if the range spans an octave, to `low` or above."""
    while note < low:
        note += 12
    while note > high:
        note -= 12
    return note


@jit
def reach_fret(p, fret):
    """Moves the hand just far enough for a finger to reach `fret`."""
    if fret > 0:
        if fret < p.hands.place:
            p.hands.place = fret
        elif fret > p.hands.place + HAND_SPAN:
            p.hands.place = fret - HAND_SPAN


@jit
def move_hand(p, fret):
    """Moves the left hand so that its first finger is at `fret`, as far as the neck goes."""
    p.hands.place = min(max(fret, 1), max(p.frets - HAND_SPAN, 1))


@jit
def stopped_at(p, i, fret):
    """Returns the fret that stops string `i` for a note of `fret`, shifted by a sliding wheel. Open strings stay."""
    shift = p.hands.shift[followed_channel(p, i)]
    if fret == 0 or shift == 0:
        return fret
    return min(max(fret + shift, 1), p.frets)
