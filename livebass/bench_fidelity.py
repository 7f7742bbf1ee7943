"""How far a quality tier is from another, heard: 24 notes over strings and neck, soft to hard, compared two by two.

Two numbers a note, both of the audio signal in the first `SPAN` seconds from the moment the finger has let go:
the error of the characteristic frequency, eq. 14 of Issanchou et al. (2018), and the log-spectral distance. Later
than that, and in detail, hard notes differ between tiers and between one contact rate and the next, as contacts
amplify the smallest difference; what is compared is how bright the sound is and where its energy lies.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from livebass.analysis import RANGE, characteristic_frequencies, spectrogram
from livebass.engine import Engine
from livebass.instrument import Instrument
from livebass.motion import Floats
from livebass.quality import QUALITIES, Quality

SPAN = 0.3  # s of each note
FRETS = (0, 2, 5, 7, 9, 12)
VELOCITIES = (20, 45, 64, 85, 106, 127)
NOTE_ON, CONTROL, ALL_SOUND_OFF = 0x90, 0xB0, 120
GAP = 0.05  # s between notes, silent


@dataclass(frozen=True)
class NoteDistance:
    """One note in two tiers."""

    string: str
    fret: int
    velocity: int
    frequency: float  # relative error of the characteristic frequency, median over the frames of a spectrogram
    spectrum_db: float  # log-spectral distance over all bins
    heard_db: float  # the same over the bins in which either sound is within RANGE: no bin is equal for being silent


@dataclass(frozen=True)
class Distance:
    """All notes."""

    notes: tuple[NoteDistance, ...]

    @property
    def frequency(self) -> float:
        """Mean over the notes."""
        return float(np.mean([n.frequency for n in self.notes]))

    @property
    def worst_frequency(self) -> float:
        return max(n.frequency for n in self.notes)

    @property
    def spectrum_db(self) -> float:
        return float(np.mean([n.spectrum_db for n in self.notes]))

    @property
    def heard_db(self) -> float:
        return float(np.mean([n.heard_db for n in self.notes]))


def distance(
    bass: Instrument,
    quality: Quality,
    other: Quality = QUALITIES["reference"],
    rate: int = 48_000,
    frets: tuple[int, ...] = FRETS,
) -> Distance:
    """`quality` from `other` on every string of `bass` at `frets`, one velocity each: over six, all there are.

    The player's unevenness is left out. Raises ValueError for what `Engine` cannot play. [main thread]
    """
    even = replace(bass, player=replace(bass.player, unevenness=0.0))
    notes = []
    for i, string in enumerate(bass.strings):
        alone = replace(even, strings=(string,), necks=(bass.necks[i],))
        play = [(fret, VELOCITIES[(5 * k + 2 * i + 5) % 6]) for k, fret in enumerate(frets)]
        pairs = zip(_sounds(alone, quality, rate, play), _sounds(alone, other, rate, play), strict=True)
        for (fret, velocity), (one, two) in zip(play, pairs, strict=True):
            spectrum, heard = log_spectral_distance(one, two, rate)
            error = frequency_error(one, two, rate)
            notes.append(NoteDistance(string.name, fret, velocity, error, spectrum, heard))
    return Distance(tuple(notes))


def _sounds(bass: Instrument, quality: Quality, rate: int, play: list[tuple[int, int]]) -> list[Floats]:
    """SPAN s of each (fret, velocity) on the only string of `bass`, from the moment the finger or thumb is gone."""
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
    """Relative error of the characteristic frequency of `sound`, median over the frames in which both sound."""
    nu, wanted = characteristic_frequencies(sound, rate), characteristic_frequencies(other, rate)
    both = np.isfinite(nu) & np.isfinite(wanted)
    if not both.any():
        raise ValueError("nothing sounds: there is nothing to compare")
    return float(np.median(np.abs(nu - wanted)[both] / wanted[both]))


def log_spectral_distance(sound: Floats, other: Floats, rate: int) -> tuple[float, float]:
    """Root mean square over bins of the difference of two spectra in dB, then the mean over frames, dB.

    Both are raised to RANGE below the loudest bin of `other`. The second value leaves out, frame by frame, the bins in
    which both are as low as that: there two sounds would agree by being silent. Raises ValueError where `other` is.
    """
    a, b = spectrogram(sound, rate), spectrogram(other, rate)
    if not b.any():
        raise ValueError("nothing sounds: there is nothing to compare")
    floor = b.max() * 10 ** (-RANGE / 20)
    squared = (20 * np.log10(np.maximum(a, floor) / np.maximum(b, floor))) ** 2
    heard = np.maximum((np.maximum(a, b) > floor).sum(axis=1), 1)
    return float(np.sqrt(squared.mean(axis=1)).mean()), float(np.sqrt(squared.sum(axis=1) / heard).mean())
