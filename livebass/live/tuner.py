"""The tuner: the pitch of what sounds, as the nearest note and how far it is off. [main thread]"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from livebass.analysis.sound import fundamental, partial
from livebass.model.instrument import A4_HZ, A4_NOTE
from livebass.units import note_name

LOWEST, HIGHEST = 26.0, 700.0  # Hz
FRAME = 0.08  # s, two periods of the lowest
QUIET = 1e-3  # full scale: a peak below is not listened to
FIRST = 3  # partials that a pitch is read from; stiffness and contact with frets pull those above sharp
BRIGHT = 300.0  # Hz, above which the first guess leaves sound out, by 12 dB an octave
WEAK = 0.02  # of the strongest: the amplitude of a partial that is passed over
STRAY = 60.0  # cents from the first guess: a partial that is farther off belongs to something else


def frequency_of(sound: NDArray[np.float32], rate: int) -> float:
    """The pitch at the end of `sound` (n,), Hz; NaN if it is quiet, too short, or of no one pitch.

    It is the frequency of the first partial, or that of the second or third by their numbers if those below are weak.
    Which one is the first says the period of the sound without its upper partials.
    """
    if sound.size < FRAME * rate or float(np.abs(sound).max()) < QUIET:
        return math.nan
    samples = np.asarray(sound, np.float64)
    rough = _period(samples, rate)
    if math.isnan(rough) or samples.size * rough < 4 * rate:
        return rough
    found = [partial(samples, rate, number * rough) for number in range(1, FIRST + 1)]
    least = WEAK * max(level for _, level in found)
    number, frequency = next((n, f) for n, (f, level) in enumerate(found, 1) if level >= least)
    pitch = frequency / number
    return pitch if abs(1200 * math.log2(max(pitch, 1.0) / rough)) < STRAY else math.nan


def _period(samples: NDArray[np.float64], rate: int) -> float:
    """A first guess of the pitch, Hz: of the last FRAME of `samples`, without what is BRIGHT; NaN if there is none."""
    spectrum = np.fft.rfft(samples)
    spectrum /= 1 + (np.fft.rfftfreq(samples.size, 1 / rate) / BRIGHT) ** 2
    dull = np.fft.irfft(spectrum, samples.size)[-round(FRAME * rate) :]
    return float(fundamental(dull, rate, LOWEST, HIGHEST, hop=1.0).frequency_hz[-1])


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
