"""States of the plugins, as hosts of CLAP and VST3 keep them: lb_state of c/instance.h, written by c/state.c."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from livebass.kernels.bass.check import checksum
from livebass.live.parameters import PARAMETERS
from livebass.techniques import CHANNEL_MODES

MAGIC, VERSION = b"LBSTATE\n", 4
HEAD = [
    ("magic", "S8"), ("version", "i8"), ("seed", "i8"), ("count", "i8"), ("bass", "S64"),
    ("learned", "u1", (CHANNEL_MODES,)), ("side", "i8"),
]  # fmt: skip
STATE = np.dtype([*HEAD, ("values", "f8", (len(PARAMETERS), 2)), ("checksum", "u8")])


def state_of(bass: str, values: Mapping[str, float]) -> bytes:
    """Returns the state of a new instance that plays `bass`, by short name, with these parameters, by symbol."""
    made = np.zeros(1, STATE)
    made["magic"], made["version"], made["count"], made["bass"] = MAGIC, VERSION, len(PARAMETERS), bass.encode()
    for p in PARAMETERS:
        made["values"][0, p.number] = values.get(p.symbol, p.usual), p.usual
    return sealed(made)


def sealed(words: NDArray[Any]) -> bytes:
    """A state with a valid checksum."""
    whole = np.frombuffer(words.tobytes(), np.int64).copy()
    whole[-1:] = np.array([checksum(whole.ctypes.data, len(whole) - 1)], np.uint64).view(np.int64)
    return whole.tobytes()
