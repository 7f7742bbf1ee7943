"""From ticks to frames, in integers: times do not drift over hours, and all shells round alike.

A time is a number of seconds and a rest, in us times ticks per quarter note. Times later than FARTHEST are FARTHEST.
"""

from livebass.compiling import SMALL, compiled
from livebass.kernels.score.memory import file_at, segments_at, tempos_at

jit = compiled(attributes=SMALL)

DEFAULT_TEMPO = 500_000  # us per quarter note, until a file sets another
MICRO = 1_000_000
FARTHEST = 1 << 42  # s


@jit
def find_times(score):
    """Finds the time at which each tempo of the file begins."""
    file = file_at(score.file)
    tempos, segments = tempos_at(score.tempos, file.tempos), segments_at(score.segments, file.tempos + 1)
    last = segments[0]
    last.tick, last.seconds, last.rest, last.us = 0, 0, 0, DEFAULT_TEMPO
    for k in range(file.tempos):
        row, before = segments[k + 1], segments[k]
        row.seconds, row.rest = later(before, tempos[k].tick, file.per_quarter * MICRO)
        row.tick, row.us = tempos[k].tick, tempos[k].us
    score.segment = 0


@jit
def later(segment, tick, whole):
    """Seconds and rest at `tick` of a segment; `whole`: the rest that makes a second."""
    if whole == 0:
        return segment.seconds, segment.rest
    ticks = tick - segment.tick
    rest = ticks % whole * segment.us + segment.rest
    return min(segment.seconds + ticks // whole * segment.us + rest // whole, FARTHEST), rest % whole


@jit
def frame_of(score, tick):
    """The nearest frame to `tick`; fastest in ascending order."""
    file, rate = file_at(score.file), score.rate
    if file.per_quarter == 0:
        over, under = file.per_second[0], file.per_second[1]
        return min(tick // over * under, FARTHEST) * rate + (2 * (tick % over) * under * rate + over) // (2 * over)
    segments = segments_at(score.segments, file.tempos + 1)
    if segments[score.segment].tick > tick:
        score.segment = 0
    while score.segment < file.tempos and segments[score.segment + 1].tick <= tick:
        score.segment += 1
    whole = file.per_quarter * MICRO
    seconds, rest = later(segments[score.segment], tick, whole)
    return seconds * rate + (2 * rest * rate + whole) // (2 * whole)
