"""Reads the impulse response of a cabinet or a room from a sound file, and says in one line why it cannot."""

from __future__ import annotations

import os
import stat

import numpy as np

from livebass.audiofile import sound_name
from livebass.kernels.effects.records import LEAST_RATE, LONGEST, MOST_RATE
from livebass.model.instrument import Response
from livebass.preset.source import PresetError

LOUDEST = 100.0  # of a sample; full scale is 1
SILENT = 1e-6  # of the loudest sample: what is quieter at the end is left out


def load_response(path: str | os.PathLike[str]) -> Response:
    """The impulse response in a mono sound file of at most LONGEST s, as loud as the file has it. Raises PresetError.

    What comes after the last sample above SILENT is left out.
    """
    import soundfile

    name = os.fspath(path)
    try:
        found = os.stat(name).st_mode
        if not stat.S_ISREG(found):
            what = "a directory" if stat.S_ISDIR(found) else "not a regular file"
            raise PresetError(f"{name}: is {what}; a response is a sound file")
        with soundfile.SoundFile(sound_name(name)) as file:
            rate = file.samplerate
            _check(name, rate, file.channels, file.frames)
            samples = file.read(dtype="float64")
    except PresetError:
        raise
    except FileNotFoundError:
        raise PresetError(f"{name}: no such file") from None
    except soundfile.LibsndfileError as error:
        raise PresetError(f"{name}: not a sound file: {error.error_string}") from None
    except OSError as error:
        raise PresetError(f"{name}: cannot be read: {error.strerror}") from None
    except ValueError:
        raise PresetError(f"{name}: not a file name") from None
    if not np.isfinite(samples).all():
        raise PresetError(f"{name}: sample {int(np.argmin(np.isfinite(samples)))} is not a finite number")
    loudest = float(np.max(np.abs(samples), initial=0.0))
    if not 0.0 < loudest <= LOUDEST:
        why = f"its loudest sample is {loudest:g}, allowed up to {LOUDEST:g}" if loudest else "is silent"
        raise PresetError(f"{name}: {why}")
    end = int(np.flatnonzero(np.abs(samples) > SILENT * loudest)[-1]) + 1
    return Response(rate, samples[:end].astype("<f8").tobytes())


def _check(name: str, rate: int, channels: int, count: int) -> None:
    """Raises PresetError for a sound file that is no response."""
    if channels != 1:
        raise PresetError(f"{name}: has {channels} channels; a response is mono")
    if not LEAST_RATE <= rate <= MOST_RATE:
        raise PresetError(f"{name}: has {rate} Hz; allowed are {LEAST_RATE} to {MOST_RATE} Hz")
    if count > LONGEST * rate:
        raise PresetError(f"{name}: lasts {count / rate:.3g} s; a response lasts {LONGEST:g} s at most")
