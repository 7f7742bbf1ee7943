"""Instrument files as plugins read them: kernels make the image of a bass."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from livebass.kernels.bass.change import CHANGE, make_change, measure_change
from livebass.kernels.bass.check import GOOD, check_file
from livebass.kernels.bass.kept import HEAD_WORDS
from livebass.rows.techniques import SLIDER_ROWS


class Refused(Exception):
    """The kernels refuse a file; `args`: the kernel and its status."""


def slider_values(values: Mapping[str, float]) -> list[float]:
    """The values of all sliders, by symbol; 0: not moved."""
    return [values.get(symbol, 0.0) for symbol in SLIDER_ROWS]


def image_made(file: bytes, values: Mapping[str, float] = {}, unknown: list[int] | None = None) -> bytes:
    """The image that plays an instrument file, changed by sliders. Raises Refused.

    `unknown` gets the number of its fields that the kernels do not know.
    """
    data, change = np.frombuffer(file, np.uint8).copy(), np.zeros(1, CHANGE)
    change["file"], change["size"] = data.ctypes.data, len(file)
    change["value"][0] = slider_values(values)
    if state := measure_change(change.ctypes.data) - GOOD:
        raise Refused(measure_change, state)
    if unknown is not None:
        unknown.append(int(change["unknown"][0]))
    memory = np.full(int(change["bytes"][0]) // 8, np.nan)
    change["memory"] = memory.ctypes.data
    if state := int(make_change(change.ctypes.data)):
        raise Refused(make_change, state)
    first, count = (int(change["made"][0]) - memory.ctypes.data) // 8, int(change["words"][0])
    made = memory[first : first + count]
    if state := check_file(made.ctypes.data, made.nbytes) - GOOD:
        raise Refused(check_file, state)
    return made.tobytes()


def read_kept(file: bytes) -> dict[str, bytes]:
    """The fields of an instrument file, by name."""
    words, at, found = np.frombuffer(file, np.int64), HEAD_WORDS, dict[str, bytes]()
    while at < len(words) - 1:
        name = words[at + 1 : at + 1 + words[at]].tobytes().rstrip(b"\0").decode()
        at += 1 + int(words[at])
        found[name] = words[at + 1 : at + 1 + words[at]].tobytes()
        at += 1 + int(words[at])
    return found
