"""Sorts numbers, stably and in the memory that it is given, and counts them."""

import numpy as np

from livebass.compiling import SMALL, compiled

jit = compiled(attributes=SMALL)


@jit
def sort_by(order, spare, keys, count):
    """Sorts `order`, `count` places in `keys`, by their key; equal ones keep their order. `spare` is workspace."""
    width = 1
    while width < count:
        for start in range(0, count, 2 * width):
            merge(order, spare, keys, start, min(start + width, count), min(start + 2 * width, count))
        width *= 2


@jit
def merge(order, spare, keys, start, middle, stop):
    """Merges two sorted runs of `order`, from `start` and from `middle`."""
    if middle >= stop or keys[order[middle - 1]] <= keys[order[middle]]:
        return
    for k in range(start, middle):
        spare[k] = order[k]
    a, b, to = start, middle, start
    while a < middle:
        if b < stop and keys[order[b]] < keys[spare[a]]:
            order[to] = order[b]
            b += 1
        else:
            order[to] = spare[a]
            a += 1
        to += 1


@jit
def fill_order(order, count):
    """Sets `order` to 0, 1, 2 and so on."""
    for k in range(count):
        order[k] = k


@jit
def count_below(values, count, limit):
    """How many of the first `count` of the ascending `values` are less than `limit`."""
    low, high = np.int64(0), np.int64(count)
    while low < high:
        half = (low + high) >> 1
        if values[half] < limit:
            low = half + 1
        else:
            high = half
    return low


@jit
def twice_median(counts, total):
    """Twice the median of `total` numbers from 0 to 127, given how often each occurs."""
    return nth(counts, (total - 1) // 2) + nth(counts, total // 2)


@jit
def nth(counts, n):
    """The number `n`, from 0, in ascending order."""
    number, left = 0, n
    while left >= counts[number]:
        left -= counts[number]
        number += 1
    return number
