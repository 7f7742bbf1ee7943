"""The tuner: the pitch of what sounds, as the nearest note and how far it is off. [main thread]"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from livebass.analysis.sound import fundamental
from livebass.model.instrument import A4_HZ, A4_NOTE
from livebass.units import note_name

LOWEST, HIGHEST = 26.0, 700.0  # Hz
QUIET = 1e-3  # full scale: a peak below is not listened to


def frequency_of(sound: NDArray[np.float32], rate: int) -> float:
    """The pitch at the end of `sound` (n,), Hz; NaN if it is quiet, too short, or of no one pitch."""
    if not sound.size or float(np.abs(sound).max()) < QUIET:
        return math.nan
    try:
        return float(fundamental(np.asarray(sound, np.float64), rate, LOWEST, HIGHEST, hop=1.0).frequency_hz[-1])
    except ValueError:  # there has not been enough sound yet
        return math.nan


def tuning(frequency: float, a4: float = A4_HZ) -> tuple[str, float] | None:
    """The note next to a frequency (Hz), and by how many cents that is higher, if A4 is at `a4` Hz; None for NaN."""
    if not frequency > 0:
        return None
    number = A4_NOTE + 12 * math.log2(frequency / a4)
    nearest = min(max(round(number), 0), 127)
    return note_name(nearest), 100 * (number - nearest)


def tuning_text(frequency: float, a4: float = A4_HZ) -> str:
    """`A1 +3 cents` for the tuner's display, or `-`; and which A it goes by, unless that is 440 Hz."""
    found = tuning(frequency, a4)
    text = f"{found[0]} {round(found[1]):+d} cents" if found else "-"
    return text if a4 == A4_HZ else f"{text} (A = {a4:g} Hz)"
