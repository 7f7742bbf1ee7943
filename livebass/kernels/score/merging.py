"""Sorts rows of a score by their first word, a tick or a frame. [any thread]"""

from livebass.compiling import SMALL, compiled
from livebass.kernels.machine.native import words_at

jit = compiled(attributes=SMALL)


@jit
def sort_rows(address, count, width, spare):
    """Sorts `count` rows of `width` words at `address`: equal ones keep their order.

    `spare` is the address of as much memory; rows that are in order do not use it. Rows in `k` ascending runs, such as
    those of k tracks, take log2 k passes.
    """
    rows, own = words_at(address, count * width), words_at(spare, count * width)
    runs = 2
    while runs > 1:
        runs, begin = 0, 0
        while begin < count:
            middle = run_end(rows, begin, count, width)
            end = run_end(rows, middle, count, width)
            if end > middle:
                merge(rows, begin, middle, end, width, own)
            begin = end
            runs += 1


@jit
def run_end(rows, begin, count, width):
    """The end of the ascending run that begins at a row."""
    end = begin + 1
    while end < count and rows[width * end] >= rows[width * (end - 1)]:
        end += 1
    return min(end, count)


@jit
def merge(rows, begin, middle, end, width, own):
    """Merges two neighbouring runs; `own` has room for the first."""
    left, right, to = 0, width * middle, width * begin
    size = width * (middle - begin)
    for k in range(size):
        own[k] = rows[to + k]
    while left < size:
        if right < width * end and rows[right] < own[left]:
            for k in range(width):
                rows[to + k] = rows[right + k]
            right += width
        else:
            for k in range(width):
                rows[to + k] = own[left + k]
            left += width
        to += width
