"""A note begins, goes on to another key and ends. [audio thread]"""

import numpy as np

from livebass.compiling import jit
from livebass.kernels.player.events import emit
from livebass.kernels.player.expression import VIBRATO_RATE, bend_ratio, vibrato_depth
from livebass.kernels.player.fingering import (
    choose_string,
    folded,
    has_note,
    natural_harmonic,
    note_range,
    reach,
    shifted,
    sounding_string,
)
from livebass.kernels.player.performer import FREE, HELD, PEDALLED, STACK, STRING_A_CHANNEL
from livebass.kernels.player.strokes import press, stroke, tap
from livebass.kernels.string.records import BEND, CUT, HAND, WAVER
from livebass.techniques import DETACH, GHOST, HARMONIC, LEGATO, SLIDE, TAP

MONO_STEP = 2  # semitones


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
def stop_string(p, i, frame, events, count):
    """Stops string `i` with the hand."""
    p.state[i] = FREE
    p.stacked[i] = 0
    return emit(events, count, frame, HAND, i, p.fret[i], p.hand_damping, 0.0)


@jit
def release(p, i, frame, events, count):
    """Lets go of a held note; the pedal may still hold it."""
    if p.pedal:
        p.state[i] = PEDALLED
        return count
    return stop_string(p, i, frame, events, count)


@jit
def all_notes_off(p, frame, events, count):
    """Releases every held note."""
    for i in range(p.strings):
        p.stacked[i] = 0
        if p.state[i] == HELD:
            count = release(p, i, frame, events, count)
    return count


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
