"""Recordings of plucked notes, cut into takes: from a little after a note begins to where it is stopped."""

from __future__ import annotations

import math
import stat
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import soundfile
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray

Floats = NDArray[np.float64]

LONGEST = 1200.0  # s of recording
RATES = (8_000, 400_000)  # Hz
SILENCE = 1e-7  # of full scale: less than a bit of 24
FRAME, HOP = 0.030, 0.005  # s, of the level: a frame holds a period of the low E, 24 ms
BEFORE = 0.05  # s: a note is louder than in the time before it ...
RISE, DEEPEST = 10.0, 40.0  # dB ... by so much, and not so much softer than the loudest
CUT = 20.0  # dB below the loudest, at least, a note has that the beginning of the file cuts into
APART = 0.2  # s, from one note to the next
MARGIN = 0.02  # s, left out before the next note
STOP, STEEPER = 12.0, 4.0  # a note is stopped where it falls by so many dB in 0.1 s, so many times as in those before


class RecordingError(ValueError):
    """A recording that cannot be used: one line with the name of the file and the reason."""


@dataclass(frozen=True)
class Recording:
    """One channel of a sound file."""

    name: str
    sound: Floats  # (n,), full scale 1
    rate: int  # Hz


@dataclass(frozen=True)
class Take:
    """A note, from the first sample that is used."""

    name: str  # of the file
    start_s: float  # in the file
    sound: Floats  # (n,)
    rate: int  # Hz

    @property
    def duration_s(self) -> float:
        return self.sound.size / self.rate


def read_recording(path: Path, channel: int | None = None) -> Recording:
    """One channel of a sound file that libsndfile reads (WAV, FLAC, Ogg ...): `channel`, from 1, or the loudest.

    Not the mean: two channels may hold two polarisations or two pickups, out of phase. Raises RecordingError.
    """
    name = str(path)
    try:
        kind = path.stat().st_mode
        if not stat.S_ISREG(kind):
            what = "a directory" if stat.S_ISDIR(kind) else "not a regular file"
            raise RecordingError(f"{name}: is {what}; a recording is a sound file")
        info = soundfile.info(name)
        if not RATES[0] <= info.samplerate <= RATES[1]:
            raise RecordingError(f"{name}: rate {info.samplerate} Hz: allowed are {RATES[0]} to {RATES[1]} Hz")
        if info.frames > LONGEST * info.samplerate:
            raise RecordingError(f"{name}: {info.duration}: allowed are up to {LONGEST / 60:g} minutes")
        sound, rate = soundfile.read(name, dtype="float64", always_2d=True)
    except soundfile.LibsndfileError as error:
        raise RecordingError(f"{name}: cannot be read as sound: {error.error_string}") from None
    except FileNotFoundError:
        raise RecordingError(f"{name}: no such file") from None
    except OSError as error:
        raise RecordingError(f"{name}: cannot be read: {error.strerror or error}") from None
    except ValueError as error:  # a zero byte in the name
        raise error if isinstance(error, RecordingError) else RecordingError(f"{name!r}: not a file name") from None
    if channel is not None and channel > sound.shape[1]:
        raise RecordingError(f"{name}: no channel {channel}, it has {sound.shape[1]}")
    if not np.isfinite(sound).all():
        raise RecordingError(f"{name}: has samples that are not finite numbers")
    if not sound.size:
        raise RecordingError(f"{name}: is empty")
    sound -= sound.mean(axis=0)  # a displacement sensor has an offset
    if np.max(np.abs(sound)) < SILENCE:
        raise RecordingError(f"{name}: is silent")
    chosen = int(np.argmax(np.sum(sound**2, axis=0))) if channel is None else channel - 1
    return Recording(name, np.ascontiguousarray(sound[:, chosen]), int(rate))


def find_takes(recording: Recording, skip: float, longest: float) -> list[Take]:
    """The notes of a recording, each from `skip` (s) after its attack on, and at most `longest` (s) of it."""
    sound, rate = recording.sound, recording.rate
    level = _levels(sound, rate)
    begins = _attacks(sound, rate, level)
    found = []
    for k, begin in enumerate(begins):
        end = begins[k + 1] - MARGIN if k + 1 < len(begins) else sound.size / rate
        start = begin + skip
        end = min(end, _stopped(level, begin, end), start + longest)
        piece = sound[round(start * rate) : max(0, round(end * rate))]
        if piece.size:
            found.append(Take(recording.name, start, piece, rate))
    return found


def _levels(sound: Floats, rate: int) -> Floats:
    """Root mean square of frames FRAME long, HOP apart, in dB of the loudest, at least -150."""
    frame, hop = round(FRAME * rate), round(HOP * rate)
    padded = np.pad(sound, (0, frame))
    power = np.array([np.mean(part**2) for part in sliding_window_view(padded, frame)[: sound.size : hop]])
    return np.asarray(10 * np.log10(np.maximum(power / power.max(), 1e-15)))


def _attacks(sound: Floats, rate: int, level: Floats) -> list[float]:
    """Seconds at which notes begin; the beginning of the file where it begins within one."""
    before = round(BEFORE / HOP)
    padded = np.pad(level, (before, 0), constant_values=-CUT - RISE)
    rise = level - sliding_window_view(padded, before)[: level.size].min(axis=1)
    begins: list[float] = []
    last = -math.inf
    for i in map(int, np.flatnonzero((rise > RISE) & (level > -DEEPEST))):
        if (i - last) * HOP > APART:
            part = np.abs(sound[round(i * HOP * rate) : round((i * HOP + 2 * FRAME) * rate)])
            begins.append(i * HOP + int(np.argmax(part > 0.2 * part.max())) / rate)
        last = i
    return begins


def _stopped(level: Floats, begin: float, end: float) -> float:
    """Seconds at which a hand stops the note that sounds from `begin` to `end`, or `end`."""
    span = round(0.1 / HOP)
    first, last = round(begin / HOP) + 2 * span, min(round(end / HOP), level.size) - span
    for i in range(first, last):
        before, fall = level[i - span] - level[i], level[i] - level[i + span]
        if fall > STOP and fall > STEEPER * max(before, 1.0):
            return i * HOP - FRAME
    return end
