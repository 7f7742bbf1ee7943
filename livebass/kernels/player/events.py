"""The events that the performer sends to the strings: one written after the other. [audio thread]"""

from livebass.compiling import jit
from livebass.kernels.string.records import TOUCH_EVENT


@jit
def emit(events, count, frame, kind, string, fret, x, y):
    """Writes event number `count`; returns the new count."""
    e = events[count]
    e.frame = frame
    e.kind = kind
    e.string = string
    e.fret = fret
    e.x = x
    e.y = y
    e.z = 0.0
    e.t = 0.0
    e.w = 0.0
    return count + 1


@jit
def lay(events, count, frame, string, finger, place, resistance, width, seconds):
    """Writes the event of a finger that is laid on a string at `place` (m from the saddle); returns the new count."""
    emit(events, count, frame, TOUCH_EVENT, string, finger, place, resistance)
    events[count].z = width
    events[count].t = seconds
    return count + 1
