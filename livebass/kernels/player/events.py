"""Writes the strings' events, one after another, to `p.out`. [audio thread]

String `i` gets the event at the frame of the message. records.EVENT describes the fields.
"""

from livebass.compiling import jit
from livebass.kernels.machine.native import record_at, words_at
from livebass.kernels.string.records import (
    BEND,
    BLEND,
    CUT,
    EVENT,
    GAIN,
    GLIDE,
    HAMMER,
    HAND,
    IDLE,
    PLUCK,
    PULL_OFF,
    STRIKE_EVENT,
    THROW,
    TONE,
    TOUCH_EVENT,
    WAVER,
)

event_at = record_at(EVENT)
EVENT_BYTES, EVENT_WORDS = EVENT.itemsize, EVENT.itemsize // 8


@jit
def next_event(p, i):
    """Begins the next event and returns it; all fields but frame and string are 0."""
    address = p.out.events + EVENT_BYTES * p.out.count
    words, e = words_at(address, EVENT_WORDS), event_at(address)
    for k in range(EVENT_WORDS):
        words[k] = 0
    p.out.count += 1
    e.frame = p.out.frame
    e.string = i
    return e


@jit
def send_pluck(p, i, fret, apex, place, width, release, angle):
    """Plucks the string; returns the event, still without skin noise."""
    e = next_event(p, i)
    e.kind = PLUCK
    e.fret = fret
    e.apex = apex
    e.place = place
    e.width = width
    e.seconds = release
    e.angle = angle
    return e


@jit
def send_strike(p, i, fret, depth, place):
    """Strikes the string with an impulse."""
    e = next_event(p, i)
    e.kind = STRIKE_EVENT
    e.fret = fret
    e.apex = depth
    e.place = place


@jit
def send_throw(p, i, fret, speed, place, mass, width, stiffness):
    """Throws a mass on the string: the thumb's if the last three arguments are 0."""
    e = next_event(p, i)
    e.kind = THROW
    e.fret = fret
    e.speed = speed
    e.place = place
    e.mass = mass
    e.width = width
    e.stiffness = stiffness


@jit
def send_hammer(p, i, fret, speed, landing):
    """Hammers the string down to `fret`."""
    e = next_event(p, i)
    e.kind = HAMMER
    e.fret = fret
    e.speed = speed
    e.seconds = landing


@jit
def send_pull_off(p, i, fret, deflection):
    """Pulls the finger off, down to `fret`."""
    e = next_event(p, i)
    e.kind = PULL_OFF
    e.fret = fret
    e.apex = deflection


@jit
def send_slide(p, i, fret, seconds):
    """Slides to `fret`, taking `seconds` per fret."""
    e = next_event(p, i)
    e.kind = GLIDE
    e.fret = fret
    e.seconds = seconds


@jit
def send_touch(p, i, finger, place, resistance, width, seconds):
    """Lays a finger on the string, or lifts it."""
    e = next_event(p, i)
    e.kind = TOUCH_EVENT
    e.finger = finger
    e.place = place
    e.resistance = resistance
    e.width = width
    e.seconds = seconds


@jit
def send_stop(p, i, fret, damping):
    """Damps the string's note at `fret` with the hands."""
    e = next_event(p, i)
    e.kind = HAND
    e.fret = fret
    e.value = damping


@jit
def send_cut(p, i):
    """Silences the string."""
    next_event(p, i).kind = CUT


@jit
def send_vibrato(p, i, depth, rate):
    """Sets the string's vibrato."""
    e = next_event(p, i)
    e.kind = WAVER
    e.value = depth
    e.rate = rate


@jit
def send_bend(p, i, ratio):
    """Bends the string."""
    e = next_event(p, i)
    e.kind = BEND
    e.value = ratio


@jit
def send_gain(p, i, gain):
    """Sets the string's volume."""
    e = next_event(p, i)
    e.kind = GAIN
    e.value = gain


@jit
def send_tone(p, i, tone):
    """Turns the tone pot."""
    e = next_event(p, i)
    e.kind = TONE
    e.value = tone


@jit
def send_blend(p, i, blend):
    """Blends the pickups."""
    e = next_event(p, i)
    e.kind = BLEND
    e.value = blend


@jit
def send_idle(p, i, strings):
    """Tells the string which strings are neither played nor muted, a bit each."""
    e = next_event(p, i)
    e.kind = IDLE
    e.value = float(strings)
