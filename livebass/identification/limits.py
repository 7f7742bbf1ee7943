"""Limits of what `identify` is asked, in Python and by the command, which reads them here: this file loads fast."""

from __future__ import annotations

from livebass.bounds import within
from livebass.model.quality import Limits

MODES = (4, 200)  # partials to look for
CHANNELS = (1, 64)
F0 = Limits("frequency", 20, 1000)
START = Limits("time", 0, 10)
DURATION = Limits("time", 0.05, 60)


def check(modes: int, start: float, duration: float, channel: int | None, f0: float | None) -> None:
    """Raises ValueError, which names the value and its limits."""
    for name, count, (least, most) in (("modes", modes, MODES), ("channel", channel, CHANNELS)):
        if count is not None:
            within(name, count, least, most, whole=True)
    START.check("start", start)
    DURATION.check("duration", duration)
    if f0 is not None:
        F0.check("f0", f0)
