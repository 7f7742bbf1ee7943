"""Records the steps of a guide through an audio input, a file for each note."""

from __future__ import annotations

import io
import math
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import soundfile

from livebass.files.whole import Transaction
from livebass.lab.fitting.guide import SECONDS, SILENCE, Step
from livebass.live.device_errors import OutputLost, one_line
from livebass.live.guards import silenced_stderr
from livebass.live.portaudio import sounddevice
from livebass.report.progress import Say
from livebass.rows.arrays import Floats

RATE = 48_000  # Hz
BLOCK = 2_400  # frames, 50 ms
BEFORE = 2  # blocks kept before a note
STOPPED = 1.0  # s after the note, for the hand
ABOVE = 20.0  # dB over the silence: a note begins
LOUDEST = 10 ** (-1 / 20)  # of full scale: louder counts as clipped
FAINTEST = 10 ** (-45 / 20)  # of full scale, the peak of a usable note
SILENCE_FILE = "silence.flac"

Read = Callable[[], Floats]  # the next BLOCK frames


@contextmanager
def opened_input() -> Iterator[Read]:
    """A function that reads the default audio input, its first channel. Raises OutputLost without one."""
    sd: Any = sounddevice()
    try:
        with silenced_stderr():
            stream = sd.InputStream(samplerate=RATE, blocksize=BLOCK, channels=1, dtype="float32")
            stream.start()
    except (sd.PortAudioError, ValueError) as error:
        raise OutputLost(
            f"no audio input to record from: {one_line(error)}; record by other means, as `livebass fit --guide` says"
        ) from None
    try:
        yield lambda: np.asarray(stream.read(BLOCK)[0][:, 0], np.float64)
    finally:
        stream.close()


def record(steps: Sequence[Step], folder: Path, read: Read, say: Say) -> int:
    """Records every step whose file is not yet in `folder`, and the silence first; returns the number of new files.

    Asks again for a note that clips or is too faint.
    """
    say("silence: damp all strings and wait")
    quiet = np.concatenate([read() for _ in range(math.ceil(SILENCE * RATE / BLOCK))])
    new = 0
    if not (folder / SILENCE_FILE).exists():
        _save(folder / SILENCE_FILE, quiet)
        new += 1
    level = max(float(np.abs(quiet).max()), 1e-5) * 10 ** (ABOVE / 20)
    for k, step in enumerate(steps, 1):
        if (folder / step.file).exists():
            continue
        say(f"{k} of {len(steps)}: {step.title}: play, let it ring {SECONDS:g} s, stop it")
        while (problem := _problem(sound := _note(read, level))) is not None:
            say(f"{problem}; play it again")
        _save(folder / step.file, sound)
        new += 1
    return new


def _note(read: Read, level: float) -> Floats:
    """Waits until all is quieter than `level`, then for a note; returns it, with a little of the silence before."""
    blocks: list[Floats] = [read()]
    while np.abs(blocks[-1]).max() >= level:
        blocks = [read()]
    while np.abs(blocks[-1]).max() < level:
        blocks = [*blocks[-BEFORE:], read()]
    blocks += [read() for _ in range(math.ceil((SECONDS + STOPPED) * RATE / BLOCK))]
    return np.concatenate(blocks)


def _problem(sound: Floats) -> str | None:
    """The defect of a recorded note; None if it is fine."""
    peak = float(np.abs(sound).max())
    if peak > LOUDEST:
        return "this clips: turn the input down"
    if peak < FAINTEST:
        return f"this peaks at {20 * math.log10(peak):.0f} dBFS: turn the input up"
    return None


def _save(path: Path, sound: Floats) -> None:
    data = io.BytesIO()
    soundfile.write(data, sound, RATE, format="FLAC", subtype="PCM_24")
    with Transaction() as files:
        files.write(path, data.getvalue())
