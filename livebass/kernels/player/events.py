"""Writes the strings' events, one after another, to `p.out`. [audio thread]

String `i` gets the event at the frame of the message. records.EVENT describes the fields.
"""

from livebass.compiling import jit
from livebass.kernels.machine.native import record_at, words_at
from livebass.kernels.string.records import EVENT, GLIDE, PLUCK, RUBBING, THROW, TIMED_GLIDE, TOUCH_EVENT, WAVER

event_at = record_at(EVENT)
EVENT_BYTES, EVENT_WORDS = EVENT.itemsize, EVENT.itemsize // 8


@jit
def next_event(p, i, kind):
    """Begins the next event and returns it; all fields but frame, string and kind are 0."""
    address = p.out.events + EVENT_BYTES * p.out.count
    words_at(address, EVENT_WORDS)[:] = 0
    p.out.count += 1
    e = event_at(address)
    e.frame = p.out.frame
    e.string = i
    e.kind = kind
    return e


@jit
def send_pluck(p, i, fret, apex, place, width, release, angle):
    """Plucks the string; returns the event, still without skin noise."""
    e = next_event(p, i, PLUCK)
    e.wait = p.hands.late
    e.fret = fret
    e.apex = apex
    e.place = place
    e.width = width
    e.seconds = release
    e.angle = angle
    return e


@jit
def send_throw(p, i, fret, speed, place, mass, width, stiffness):
    """Throws a mass on the string: the thumb's if the last three arguments are 0."""
    e = next_event(p, i, THROW)
    e.wait = p.hands.late
    e.fret = fret
    e.speed = speed
    e.place = place
    e.mass = mass
    e.width = width
    e.stiffness = stiffness


@jit
def send_slide(p, i, fret, seconds):
    """Slides to `fret`, taking `seconds` per fret."""
    e = next_event(p, i, GLIDE)
    e.fret = fret
    e.seconds = seconds


@jit
def send_timed_slide(p, i, fret, seconds, damping):
    """Slides to `fret` in `seconds`; with a `damping`, 1/s, the finger lifts on the way, and the note ends there."""
    e = next_event(p, i, TIMED_GLIDE)
    e.fret = fret
    e.seconds = seconds
    e.value = damping


@jit
def send_touch(p, i, finger, place, resistance, width, seconds):
    """Lays a finger on the string, or lifts it."""
    e = next_event(p, i, TOUCH_EVENT)
    e.finger = finger
    e.place = place
    e.resistance = resistance
    e.width = width
    e.seconds = seconds


@jit
def send_rub(p, i, level, seconds, wait):
    """Rubs a finger of the fretting hand along the string for `seconds`, after `wait` s; `level` 0: it stays."""
    e = next_event(p, i, RUBBING)
    e.value = level
    e.seconds = seconds
    e.wait = wait


@jit
def send_vibrato(p, i, depth, rate):
    """Sets the string's vibrato."""
    e = next_event(p, i, WAVER)
    e.value = depth
    e.rate = rate


@jit
def send_value(p, i, kind, value):
    """Sends the string an event whose only number is its value."""
    next_event(p, i, kind).value = value


@jit
def send_value_to_all(p, kind, value):
    """Sends every string an event whose only number is its value."""
    for i in range(p.strings):
        send_value(p, i, kind, value)
