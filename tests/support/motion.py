"""The motion of a string that plays, mode by mode."""

from __future__ import annotations

import numpy as np

from livebass.arrays import Floats
from livebass.engine.prepare import Voice


def mode_speeds(string: Voice, count: int) -> Floats:
    """The amplitude of each of the lowest modes (count,), as a velocity (m^1.5/s), of both polarisations."""
    slot, total = string.slots[int(string.record["slot"][0])], np.zeros(count)
    for w, active in ((slot["u"], True), (slot["v"], int(slot["v_active"]) > 0)):
        if active:
            q, p, pace, sigma, omega = (w[name][:count] for name in ("q", "p", "pace", "sigma", "omega"))
            total += (omega * q) ** 2 + (pace * p - sigma * q) ** 2
    return np.sqrt(total)
