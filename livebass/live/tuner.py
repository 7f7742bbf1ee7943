"""The tuner: finds the pitch, and shows it as the nearest note and a deviation. [main thread]"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from livebass.model.instrument import A4_HZ, A4_NOTE
from livebass.rows.units import note_name
from livebass.sound.analysis import fundamental, partial

LOWEST, HIGHEST = 26.0, 700.0  # Hz
FRAME = 0.08  # s, two periods of the lowest
QUIET = 1e-3  # of full scale: a quieter peak is ignored
FIRST = 3  # partials used for the pitch; stiffness and fret contact sharpen the higher ones
BRIGHT = 300.0  # Hz; above it the first guess attenuates the sound, by 12 dB an octave
WEAK = 0.02  # relative amplitude below which a partial is skipped
STRAY = 60.0  # cents from the first guess: a partial farther off belongs to something else


def frequency_of(sound: NDArray[np.float32], rate: int) -> float:
    """The pitch at the end of `sound` (n,), Hz; NaN if it is quiet, too short, or has no single pitch.

    It is the frequency of the first partial; if that is weak, the frequency of the second or third divided by its
    number. The period of the sound without its upper partials identifies the first.
    """
    if sound.size < FRAME * rate or float(np.abs(sound).max()) < QUIET:
        return math.nan
    samples = np.asarray(sound, np.float64)
    rough = _period(samples, rate)
    if math.isnan(rough) or samples.size * rough < 4 * rate:
        return rough
    found = [partial(samples, rate, number * rough) for number in range(1, FIRST + 1)]
    minimum = WEAK * max(level for _, level in found)
    number, frequency = next((n, f) for n, (f, level) in enumerate(found, 1) if level >= minimum)
    pitch = frequency / number
    return pitch if abs(1200 * math.log2(max(pitch, 1.0) / rough)) < STRAY else math.nan


def _period(samples: NDArray[np.float64], rate: int) -> float:
    """A first guess of the pitch, Hz, from the last FRAME of `samples` without BRIGHT sound; NaN if there is none."""
    spectrum = np.fft.rfft(samples)
    spectrum /= 1 + (np.fft.rfftfreq(samples.size, 1 / rate) / BRIGHT) ** 2
    dull = np.fft.irfft(spectrum, samples.size)[-round(FRAME * rate) :]
    return float(fundamental(dull, rate, LOWEST, HIGHEST, hop=1.0).frequency_hz[-1])


def tuning(frequency: float, a4: float = A4_HZ) -> tuple[str, float] | None:
    """The note nearest to a frequency (Hz), and its deviation in cents, if A4 is at `a4` Hz; None for NaN."""
    if not frequency > 0:
        return None
    number = A4_NOTE + 12 * math.log2(frequency / a4)
    nearest = min(max(round(number), 0), 127)
    return note_name(nearest), 100 * (number - nearest)


def tuning_text(frequency: float, a4: float = A4_HZ) -> str:
    """`A1 +3 cents` for the tuner's display, or `-`; and the pitch of A unless it is 440 Hz."""
    found = tuning(frequency, a4)
    text = f"{found[0]} {round(found[1]):+d} cents" if found else "-"
    return text if a4 == A4_HZ else f"{text} (A = {a4:g} Hz)"
