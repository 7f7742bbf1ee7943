"""How far one quality sounds from another: 24 notes over strings and neck, soft to hard, compared two by two.

Two figures a note, both of the sound in the `SPAN` seconds after the finger or thumb has let go: the error of the
characteristic frequency, eq. 14 of Issanchou et al. (2018), and the log-spectral distance. They tell how bright the
sound is and where its energy lies. Later samples, and details, differ even between one contact rate and the next:
contacts amplify the smallest difference.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from livebass.analysis.sound import RANGE, characteristic_frequencies, spectrogram
from livebass.arrays import Floats
from livebass.bench.measure import Result, Row
from livebass.engine.engine import Engine
from livebass.model.instrument import Instrument
from livebass.model.quality import QUALITIES, Quality

NOTE_ON, NOTE_OFF, CONTROL, ALL_SOUND_OFF = 0x90, 0x80, 0xB0, 120  # status bytes of channel 1, and a controller
SPAN = 0.3  # s of each note
GAP = 0.05  # s of silence between notes
FRETS = (0, 2, 5, 7, 9, 12)
VELOCITIES = (20, 45, 64, 85, 106, 127)


def even(bass: Instrument) -> Instrument:
    """Returns `bass` with a player whose every stroke is alike."""
    return replace(bass, player=replace(bass.player, unevenness=0.0))


def distance(
    bass: Instrument,
    quality: Quality,
    other: Quality = QUALITIES["reference"],
    rate: int = 48_000,
    frets: tuple[int, ...] = FRETS,
) -> Result:
    """Compares `quality` with `other` on every string of `bass` at `frets`, one velocity each: over six frets, all six.

    The player is `even`. "each" has a row for each note: "frequency" is its `frequency_error`, "spectrum_db" and
    "heard_db" its `log_spectral_distance`. The same keys of the result hold means over the notes, "worst_frequency" the
    largest error, "notes" their number. Raises ValueError for an instrument that `Engine` cannot play. [main thread]
    """
    bass = even(bass)
    notes: list[Row] = []
    for i, string in enumerate(bass.strings):
        alone = replace(bass, strings=(string,), necks=(bass.necks[i],))
        play = [(fret, VELOCITIES[(5 * k + 2 * i + 5) % 6]) for k, fret in enumerate(frets)]
        pairs = zip(_sounds(alone, quality, rate, play), _sounds(alone, other, rate, play), strict=True)
        for (fret, velocity), (one, two) in zip(play, pairs, strict=True):
            spectrum, heard = log_spectral_distance(one, two, rate)
            figures = {"frequency": frequency_error(one, two, rate), "spectrum_db": spectrum, "heard_db": heard}
            notes.append({"string": string.name, "fret": fret, "velocity": velocity, **figures})

    def values(key: str) -> list[float]:
        return [note[key] for note in notes]

    return {
        "span_s": SPAN,
        "notes": len(notes),
        "frequency": float(np.mean(values("frequency"))),
        "worst_frequency": max(values("frequency")),
        "spectrum_db": float(np.mean(values("spectrum_db"))),
        "heard_db": float(np.mean(values("heard_db"))),
        "each": notes,
    }


def _sounds(bass: Instrument, quality: Quality, rate: int, play: list[tuple[int, int]]) -> list[Floats]:
    """SPAN s of each (fret, velocity) on the only string of `bass`, from the moment the finger or thumb has let go."""
    engine = Engine(bass, quality, rate, workers=1)
    player = bass.player
    struck = player.technique == "slap" and player.slapped_strings > 0
    held = round((player.strike_time if struck else player.pull_time) * rate)
    out = []

    def send(*message: int) -> None:
        engine.send(np.array([engine.frame]), np.array([message], np.uint8))

    for fret, velocity in play:
        send(NOTE_ON, bass.strings[0].open_note + fret, velocity)
        engine.process(held)
        out.append(engine.process(round(SPAN * rate))[0])
        send(CONTROL, ALL_SOUND_OFF, 0)
        engine.process(round(GAP * rate))
    return out


def frequency_error(sound: Floats, other: Floats, rate: int) -> float:
    """Returns the relative error of the characteristic frequency of `sound`, median over frames in which both sound.

    sound, other (n,), at `rate` (Hz). Raises ValueError if there is no such frame.
    """
    nu, wanted = characteristic_frequencies(sound, rate), characteristic_frequencies(other, rate)
    both = np.isfinite(nu) & np.isfinite(wanted)
    if not both.any():
        raise ValueError("nothing sounds: there is nothing to compare")
    return float(np.median(np.abs(nu - wanted)[both] / wanted[both]))


def log_spectral_distance(sound: Floats, other: Floats, rate: int) -> tuple[float, float]:
    """Returns the root mean square over bins of the difference of two spectra in dB, mean over frames: two values.

    Both spectra are raised to RANGE below the loudest bin of `other`. The first value is over all bins, the second
    without those, frame by frame, in which both are that low: silence is no agreement. sound, other (n,), at `rate`
    (Hz). Raises ValueError if `other` is silent.
    """
    a, b = spectrogram(sound, rate), spectrogram(other, rate)
    if not b.any():
        raise ValueError("nothing sounds: there is nothing to compare")
    floor = b.max() * 10 ** (-RANGE / 20)
    squared = (20 * np.log10(np.maximum(a, floor) / np.maximum(b, floor))) ** 2
    heard = np.maximum((np.maximum(a, b) > floor).sum(axis=1), 1)
    return float(np.sqrt(squared.mean(axis=1)).mean()), float(np.sqrt(squared.sum(axis=1) / heard).mean())
