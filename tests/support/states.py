"""States that hosts keep, as C's lb_state, for tests that change them."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from livebass.live.parameters import PARAMETERS
from livebass.plugin.state import STATE, sealed
from livebass.techniques import CHANNEL_MODES


def read(state: bytes) -> NDArray[np.void]:
    """A copy of a state's record, (1,)."""
    return np.frombuffer(state, STATE).copy()


def with_sides(state: bytes, side: int, aside: Mapping[int, float]) -> bytes:
    """A state with other values, by parameter number, on the side that does not play."""
    made = read(state)
    made["side"] = side
    for number, value in aside.items():
        made["values"][0, number, 1] = value
    return sealed(made)


def with_fewer(state: bytes, parameters: int) -> bytes:
    """A state of a plugin that has only the first parameters."""
    made = read(state)
    made["count"] = parameters
    end = STATE.itemsize - 8 - 16 * (len(PARAMETERS) - parameters)
    return sealed(np.frombuffer(made.tobytes()[:end] + bytes(8), np.int64))


def with_learned(state: bytes, learned: Mapping[int, int]) -> bytes:
    """A state with the parameters, by number, that controllers have learned."""
    made = read(state)
    made["learned"] = [1 + learned[k] if k in learned else 0 for k in range(CHANNEL_MODES)]
    return sealed(made)
