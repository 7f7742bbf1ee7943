"""Reads the impulse response of a cabinet or a room from a sound file; errors are one line."""

from __future__ import annotations

import os

import numpy as np
from numpy.typing import NDArray

from livebass.kernels.effects.records import LONGEST, MAX_RATE, MIN_RATE
from livebass.kernels.effects.response import LEAD, NOTHING, SILENT
from livebass.model.instrument import Response
from livebass.preset.source import PresetError
from livebass.sound.audiofile import SoundError, read_sound

LOUDEST = 100.0  # of a sample in the file; full scale is 1
LONGEST_FILE = 60.0  # s, with its silence
LEVELS = ("normalized", "file")


def load_response(path: str | os.PathLike[str], normalized: bool = True) -> Response:
    """The impulse response in a sound file, at most LONGEST s of sound. Raises PresetError.

    normalized: scale it to leave the loudness of a bass unchanged; else keep the level of the file. Silence at the end
    is cut off; silence before the sound only if `normalized`, or if it is longer than LONGEST. Only the first channel
    that is not silent is used.
    """
    name = os.fspath(path)
    try:
        sound = read_sound(path, "response", LONGEST_FILE, (MIN_RATE, MAX_RATE))
    except SoundError as error:
        raise PresetError(str(error)) from None
    channel, remark = _channel(name, sound.samples)
    samples = sound.samples[:, channel]
    if not np.isfinite(samples).all():
        raise PresetError(f"{name}: sample {int(np.argmin(np.isfinite(samples)))} is not a finite number")
    loudest = float(np.max(np.abs(samples), initial=0.0))
    if loudest < NOTHING:
        raise PresetError(f"{name}: is silent")
    if loudest > LOUDEST and not normalized:
        raise PresetError(f"{name}: its loudest sample is {loudest:g}, allowed up to {LOUDEST:g}")
    end = int(np.flatnonzero(np.abs(samples) > SILENT * loudest)[-1]) + 1
    response = Response(sound.rate, samples[:end].astype("<f8").tobytes(), normalized, remark)
    if response.count > LONGEST * sound.rate:
        response = Response(sound.rate, response.cut(), normalized, remark)
        if response.count > LONGEST * sound.rate:
            lasts = f"{response.count / sound.rate:.3g} s without silence"
            raise PresetError(f"{name}: lasts {lasts}; a response lasts {LONGEST:g} s at most")
    return response


def _channel(name: str, samples: NDArray[np.float64]) -> tuple[int, str]:
    """The channel of a response, (n, channels), to use, from 0; if there are more, also a line that names it."""
    count = samples.shape[1]
    if count == 1:
        return 0, ""
    loudest = np.max(np.abs(samples), axis=0, initial=0.0)
    loudest = np.where(np.isnan(loudest), np.inf, loudest)
    chosen = int(np.argmax(loudest >= LEAD * loudest.max()))
    names = ("left", "right") if count == 2 else tuple(f"channel {k}" for k in range(1, count + 1))
    which = f"the {names[chosen]} one is" if count == 2 else f"{names[chosen]} is"
    why = "" if chosen == 0 else f"; {'the left one' if count == 2 else 'what comes before it'} is silent"
    return chosen, f"{name}: {count} channels; {which} played{why}"
