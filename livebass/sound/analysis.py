"""Spectrogram, characteristic frequency and pitch of a sound, and contacts on frets over time.

Sounds are (n,) arrays in any unit, rates in Hz, times in s from the first sample. Sources: C. Issanchou et al. (2018),
eq. 14 and figures 5 to 7; for the pitch YIN, A. de Cheveigne and H. Kawahara, J. Acoust. Soc. Am. 111 (2002),
1917-1930, steps 2 to 5. These are: the squared difference of the sound and itself a lag later, summed over a window;
divided by its mean over all shorter lags; its first dip below a threshold; a parabola through the lowest three points.
Step 6, the best local estimate, is omitted: it smooths over time and would lose a glide. One threshold for all sounds
takes a note an octave up if its second partial is far above the first. So the dip must also be one of the deepest, as
P. McLeod and G. Wyvill, A smarter way to find pitch, Proc. ICMC 2005, 138-141, take the first peak near the highest.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import ArrayLike

from livebass.rows.arrays import Floats, Ints
from livebass.rows.bounds import refusal
from livebass.sound.meter import LoudnessMeter

WINDOW, HOP = 2048, 512  # samples at 48 kHz: 43 ms, 1.8 periods of the low E
RANGE = 70.0  # dB, of the paper's spectrograms
PAPER_RATE = 51_200  # Hz, to which the paper resamples before eq. 14


def spectrogram(sound: Floats, rate: float, window: int | None = None, hop: int | None = None) -> Floats:
    """Amplitudes (frames, bins) of Hann windows of `window` samples, `hop` samples apart; bin k is k rate / window Hz.

    Default: `WINDOW` and `HOP` at 48 kHz, and the same times at other rates. Raises ValueError for a sound of more than
    one dimension or shorter than a window, and for a rate that is not above 0.
    """
    window, hop = _frames(rate, window, hop)
    sound = _one_channel(sound)
    if sound.size < window:
        raise ValueError(f"{sound.size / rate:.3g} s of sound: at least {window / rate:.3g} s are needed")
    return np.abs(np.fft.rfft(sliding_window_view(sound, window)[::hop] * np.hanning(window + 1)[:-1]))


@dataclass(frozen=True)
class Spectrogram:
    """Levels over time and frequency, as in figure 5 of the paper."""

    time_s: Floats  #: (frames,), the middle of each window
    frequency_hz: Floats  #: (bins,)
    level_db: Floats  #: (frames, bins), 0 is the loudest; cut off at the bottom of the range


def spectrogram_db(
    sound: Floats, rate: float, window: int | None = None, hop: int | None = None, range_db: float = RANGE
) -> Spectrogram:
    """Computes a short-time spectrogram in dB below its loudest bin.

    Args:
        sound: (n,), in any unit.
        rate: Hz.
        window: Length of the Hann windows, samples; by default 43 ms.
        hop: Distance of the windows, samples; by default 11 ms.
        range_db: Levels are cut off this far below the loudest bin, dB.

    Raises:
        ValueError: Silence, less than a window, more than one dimension, or a rate that is not above 0.

    Example:
        >>> tone = np.sin(2 * np.pi * 1000 * np.arange(24000) / 48000)
        >>> found = spectrogram_db(tone, 48000)
        >>> found.level_db.shape, float(found.level_db.max())
        ((43, 1025), 0.0)
    """
    window, hop = _frames(rate, window, hop)
    amplitude = spectrogram(sound, rate, window, hop)
    loudest = float(amplitude.max())
    if not loudest > 0:
        raise ValueError("nothing sounds: there is no level to refer to")
    level = 20 * np.log10(np.maximum(amplitude / loudest, 10 ** (-range_db / 20)))
    return Spectrogram(frame_times(len(level), rate, window, hop), np.arange(level.shape[1]) * rate / window, level)


def characteristic_frequencies(sound: Floats, rate: float, window: int | None = None, hop: int | None = None) -> Floats:
    """Computes the characteristic frequency over time, the mean frequency weighted by squared amplitude.

    This is eq. 14 of the paper. The mean goes up to rate / 2, the paper's to 25.6 kHz: use `resample` first for that.

    Args:
        sound: (n,), in any unit.
        rate: Hz.
        window: As in `spectrogram_db`.
        hop: As in `spectrogram_db`.

    Returns:
        Hz, (frames,); NaN for a silent frame.

    Raises:
        ValueError: Less than a window, more than one dimension, or a rate that is not above 0.

    Example:
        >>> tone = np.sin(2 * np.pi * 1000 * np.arange(24000) / 48000)
        >>> characteristic_frequencies(tone, 48000)[:2].round(3)
        array([1000., 1000.])
    """
    power = spectrogram(sound, rate, window, hop) ** 2
    nu = np.linspace(0.0, rate / 2, power.shape[1])
    total = power.sum(axis=1)
    return np.divide(power @ nu, total, out=np.full(len(total), np.nan), where=total > 0)


def frame_times(count: int, rate: float, window: int | None = None, hop: int | None = None) -> Floats:
    """The middle of each of `count` frames of the spectrogram, s, (count,)."""
    window, hop = _frames(rate, window, hop)
    return np.asarray((np.arange(count, dtype=np.float64) * hop + window / 2) / rate)


def resample(sound: Floats, rate: int, to: int = PAPER_RATE) -> Floats:
    """Resamples a sound with SciPy's polyphase filter. Needs SciPy: ``pip install 'livebass[analysis]'``.

    Args:
        sound: (n,), in any unit.
        rate: Its rate, Hz.
        to: The new rate, Hz; by default the paper's.

    Raises:
        ValueError: Rates that are not whole and positive.

    Example:
        >>> resample(np.ones(480), 48000).shape
        (512,)
    """
    if rate < 1 or to < 1 or rate != int(rate) or to != int(to):
        raise refusal("rates", "whole and positive", f"{rate:g} Hz and {to:g} Hz")
    from scipy.signal import resample_poly

    shared = int(np.gcd(int(rate), int(to)))
    return np.asarray(resample_poly(sound, int(to) // shared, int(rate) // shared), dtype=np.float64)


@dataclass(frozen=True)
class Contactogram:
    """The contacts of a string with its frets (figure 7 of the paper), ordered by time, then as given."""

    time_s: Floats  #: (k,), when the string meets the fret
    fret: Ints  #: (k,)
    release_s: Floats  #: (k,), when it leaves the fret; NaN if unknown

    def sets(self, gap: float = 4e-3) -> Ints:
        """Numbers the sets of contacts, one set per period of the string.

        A string swings down to the frets once per period: half a period, 5 ms at 98 Hz, is free of contacts.

        Args:
            gap: A time without a new contact that ends a set, s.

        Returns:
            Number of each contact's set, from 0, (k,).
        """
        return np.concatenate([[0], np.cumsum(np.diff(self.time_s) >= gap)])[: self.time_s.size].astype(np.int64)


def contactogram(
    contact_time_s: ArrayLike, contact_index: ArrayLike, frets: ArrayLike, release_s: ArrayLike | None = None
) -> Contactogram:
    """Returns the contacts of a motion by time and fret.

    Args:
        contact_time_s: Time of each contact, s, (k,).
        contact_index: Obstacle of each contact, (k,): an index into `frets`.
        frets: Fret of each obstacle (`Speaking.contact_fret`).
        release_s: Time at which each contact ends, s, (k,), if known.

    Raises:
        ValueError: Arrays of different lengths.

    Example:
        >>> found = contactogram([0.002, 0.001], [1, 0], frets=[5, 6])
        >>> found.time_s, found.fret
        (array([0.001, 0.002]), array([5, 6]))
    """
    time, index = np.asarray(contact_time_s, np.float64), np.asarray(contact_index, np.int64)
    release = np.full(time.shape, np.nan) if release_s is None else np.asarray(release_s, np.float64)
    if not time.shape == index.shape == release.shape or time.ndim != 1:
        raise ValueError(f"contacts: {time.shape} times, {index.shape} indices and {release.shape} releases")
    order = np.argsort(time, kind="stable")
    return Contactogram(time[order], np.asarray(frets, np.int64)[index][order], release[order])


def _one_channel(sound: ArrayLike) -> Floats:
    """`sound` as floats (n,); ValueError for more dimensions."""
    samples = np.asarray(sound, np.float64)
    if samples.ndim != 1:
        raise refusal("sound", "of one dimension", f"of shape {samples.shape}: sum over strings or choose one")
    return samples


def _frames(rate: float, window: int | None, hop: int | None) -> tuple[int, int]:
    """Length and hop of the windows in samples. Raises ValueError if they are not above 0."""
    if not 0 < rate < math.inf:
        raise refusal("rate", "above 0", f"{rate:g} Hz")
    if any(count is not None and count < 1 for count in (window, hop)):
        raise refusal("window and hop", "at least 1 sample", f"{window} and {hop}")
    return window or round(WINDOW * rate / 48_000), hop or round(HOP * rate / 48_000)


THRESHOLD = 0.1  # of the normalised difference: a tenth of the power may be aperiodic
SHALLOW = 4.0  # times the deepest dip: a higher dip is passed over ...
FAINT = 0.008  # ... unless it is lower than this: 24 dB below the rest, other strings and the body may answer
ROUGH = 0.3  # of the normalised difference, at most, where a deeper dip counts: a muted thump has such dips anywhere
OPEN, STEEP = 2.0, 8  # the low-pass filter for that: corner over the frequency of the first dip, at least; order
DECAY_STEPS = 4  # of the fixed point that finds a partial's frequency and decay
CHUNK = 256  # frames at a time, to bound the memory


@dataclass(frozen=True)
class Pitch:
    """The fundamental frequency, frame by frame. `fundamental` returns it."""

    time_s: Floats  #: (frames,), the middle of each frame's samples
    frequency_hz: Floats  #: (frames,), NaN where no lag is below the threshold
    aperiodicity: Floats  #: (frames,), normalised difference at the lag found, or its minimum: 0 periodic, 1 noise


def fundamental(
    sound: Floats,
    rate: float,
    minimum: float = 25.0,
    maximum: float = 500.0,
    hop: float = 5e-3,
    window: float | None = None,
    threshold: float | None = THRESHOLD,
) -> Pitch:
    """Measures the fundamental frequency over time by YIN.

    Source: A. de Cheveigne and H. Kawahara, J. Acoust. Soc. Am. 111 (2002), 1917-1930, steps 2 to 5. Lags are
    multiples of a sample, refined to about a thousandth of one. The first dip below the threshold is passed over if a
    later one is four times as deep in the lower partials: a second, third or fourth partial may be 20 dB above the
    others, and the fundamental may be missing.

    Args:
        sound: (n,), in any unit.
        rate: Hz.
        minimum: Lowest frequency, Hz.
        maximum: Highest frequency, Hz.
        hop: Time between two frames, s.
        window: Time over which the difference is summed, s; by default 1 / minimum. A frame is that long plus the
            longest lag.
        threshold: Of the normalised difference. None takes the deepest dip, for sounds too rough for any threshold and
            limits within an octave.

    Raises:
        ValueError: Limits other than 0 < minimum < maximum < rate / 4, or a sound shorter than a frame.

    Example:
        >>> low_e = np.sin(2 * np.pi * 41.2 * np.arange(24000) / 48000)
        >>> float(np.median(fundamental(low_e, 48000).frequency_hz).round(3))
        41.2
    """
    if not 0 < minimum < maximum < rate / 4:
        raise refusal(
            "range of the pitch", f"ascending between 0 and {rate / 4:g} Hz", f"{minimum:g} to {maximum:g} Hz"
        )
    longest, shortest = math.ceil(rate / minimum) + 1, max(2, math.floor(rate / maximum))
    width, step = max(2, round((window or 1 / minimum) * rate)), max(1, round(hop * rate))
    sound = _one_channel(sound)
    if sound.size < width + longest:
        raise ValueError(f"{sound.size / rate:.3g} s of sound: at least {(width + longest) / rate:.3g} s are needed")
    frames = sliding_window_view(sound, width + longest)[::step]
    lag, rest = np.empty((2, len(frames)))

    @cache
    def dulled(corner: float) -> Floats:
        return sliding_window_view(_dulled(sound, corner), width + longest)[::step]

    for part in (slice(i, i + CHUNK) for i in range(0, len(frames), CHUNK)):
        lag[part], rest[part], normal = _lags(frames[part], width, longest, shortest, threshold)
        if threshold is not None:
            _pass_over_shallow(lag[part], rest[part], normal, dulled, part, width)
    middle: Floats = (np.arange(len(frames), dtype=np.float64) * step + (width + longest) / 2) / rate
    return Pitch(middle, rate / lag, rest)


def partial(sound: ArrayLike, rate: float, near: float) -> tuple[float, float]:
    """The partial of `sound` (n,) near a frequency (Hz): its frequency, Hz, and its amplitude at the middle.

    Uses its phase shift between two Hann windows of two thirds of the sound. Over the sound it must differ from the
    next partial by more than three turns, and from `near` by less than a sixth of that. A decay is removed first:
    windows of a decaying sound leak. Raises ValueError for fewer than four periods.
    """
    samples = _one_channel(sound)
    if not 0 < near < rate / 2 or samples.size * near < 4 * rate:
        raise ValueError(f"a partial near {near:g} Hz in {samples.size / rate:.3g} s of sound: four periods are needed")
    length = 2 * samples.size // 3
    shift = samples.size - length
    t = np.arange(samples.size) / rate
    apart, growth = shift / rate, 0.0
    found, level = near, 0.0
    for _ in range(DECAY_STEPS):
        window = np.hanning(length) * np.exp(-2j * math.pi * found * t[:length])
        still = samples * np.exp(-growth * (t - t[-1] / 2))
        before, after = np.sum(still[:length] * window), np.sum(still[shift:] * window)
        level = 4 * abs(before) / length
        if not before or not after:
            break
        turn = after / before * np.exp(-2j * math.pi * found * apart)
        growth += math.log(abs(turn)) / apart
        found += float(np.angle(turn)) / (2 * math.pi * apart)
    return found, level


def loudness(sound: ArrayLike, rate: int) -> float:
    """Measures the integrated loudness by ITU-R BS.1770-4.

    Args:
        sound: (n,), full scale 1.
        rate: Hz.

    Returns:
        LUFS; -inf for silence.

    Raises:
        ValueError: More than one dimension.

    Example:
        >>> tone = np.sin(2 * np.pi * 997 * np.arange(48000) / 48000)
        >>> round(loudness(tone, 48000), 2)
        -3.05
    """
    meter = LoudnessMeter(rate)
    meter.add(_one_channel(sound))
    return meter.loudness()


def relative_variation(frequency_hz: Floats, reference_hz: float) -> Floats:
    """Returns (nu(t) - nu_r) / nu_r, as in figure 7 of the paper.

    Args:
        frequency_hz: nu(t), Hz, of any shape.
        reference_hz: nu_r, Hz; in the paper the first eigenfrequency.

    Example:
        >>> relative_variation(np.array([98.0, 99.0]), 98.0).round(4)
        array([0.    , 0.0102])
    """
    return (np.asarray(frequency_hz, np.float64) - reference_hz) / reference_hz


def _lags(
    frames: Floats, width: int, longest: int, shortest: int, threshold: float | None
) -> tuple[Floats, Floats, Floats]:
    """Period in samples, NaN if there is none, and the normalised difference there, (frames,) each, and at all lags."""
    difference, normal = _differences(frames, width, longest)
    lag, rest = np.full(len(frames), np.nan), np.ones(len(frames))
    for i, d in enumerate(normal):
        minimum = float(d[shortest:longest].min())
        k = _dip(d, shortest, longest, np.nextafter(minimum, 2) if threshold is None else threshold)
        lag[i], rest[i] = (np.nan, minimum) if k is None else (_bottom(difference[i], k), d[k])
    return lag, rest, normal


def _pass_over_shallow(
    lag: Floats, rest: Floats, normal: Floats, dulled: Callable[[float], Floats], part: slice, width: int
) -> None:
    """Replaces the periods of `lag` by longer ones whose dips are much deeper, and `rest` by `normal` there.

    These frames are a `part` of all. `dulled` removes what is above a corner (1/samples) from all. Higher partials are
    not harmonic: they hide how deep a dip is, and one of them may fit a period that the string does not have.
    """
    longest = normal.shape[1] - 1
    octave = np.ceil(2 * np.log2(OPEN / lag)) / 2  # in halves, so that few corners are needed
    for each in np.unique(octave[np.isfinite(octave)]):
        which = np.flatnonzero(octave == each)
        for i, difference, d in zip(which, *_differences(dulled(2.0**each)[part][which], width, longest), strict=True):
            near = round(9 / 8 * lag[i])  # what is left out may have shifted the dip
            limit = max(FAINT, SHALLOW * float(d[near:longest].min(initial=1.0)))
            later = _dip(d, near, longest, limit) if d[2 * round(lag[i]) - near : near].min() >= limit else None
            if later is not None and normal[i, later] < ROUGH:
                lag[i], rest[i] = _bottom(difference, later), normal[i, later]


def _dip(normal: Floats, shortest: int, longest: int, threshold: float) -> int | None:
    """The lowest lag of the first dip of `normal` (lags,) that goes below `threshold`; None without one."""
    below = np.flatnonzero(normal[shortest:longest] < threshold)
    if not below.size:
        return None
    k = shortest + int(below[0])
    while k + 1 < longest and normal[k + 1] < normal[k]:
        k += 1
    return k


def _bottom(difference: Floats, k: int) -> float:
    """The lag at the bottom of the parabola through the `difference` at lags `k` - 1 to `k` + 1."""
    bend = difference[k - 1] - 2 * difference[k] + difference[k + 1]
    return float(k + (0.5 * (difference[k - 1] - difference[k + 1]) / bend if bend > 0 else 0.0))


def _dulled(sound: Floats, corner: float) -> Floats:
    """`sound` (n,) without what is above `corner` (1/samples), and without delay."""
    spectrum = np.fft.rfft(sound)
    spectrum /= 1 + (np.fft.rfftfreq(sound.size) / corner) ** STEEP
    return np.fft.irfft(spectrum, sound.size)


def _differences(frames: Floats, width: int, longest: int) -> tuple[Floats, Floats]:
    """The squared difference of each frame and itself a lag later, and the same normalised, (frames, lags) each."""
    size = 1 << (frames.shape[1] - 1).bit_length()  # up to the longest lag, nothing wraps around
    spectrum = np.fft.rfft(frames, size)
    cross = np.fft.irfft(spectrum * np.conj(np.fft.rfft(frames[:, :width], size)), size)[:, : longest + 1]
    running = np.cumsum(np.pad(frames**2, ((0, 0), (1, 0))), axis=1)
    energy = running[:, width : width + longest + 1] - running[:, : longest + 1]
    difference = np.maximum(energy[:, :1] + energy - 2 * cross, 0.0)  # eqs. 6 and 7
    difference[difference < 1e-12 * energy[:, :1]] = 0.0  # rounding
    mean = np.cumsum(difference[:, 1:], axis=1) / np.arange(1, longest + 1)
    normal = np.ones_like(difference)  # eq. 8
    np.divide(difference[:, 1:], mean, out=normal[:, 1:], where=mean > 0)
    return difference, normal
