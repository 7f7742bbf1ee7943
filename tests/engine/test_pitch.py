"""Every string and fret of every bass plays in tune, measured on its sound."""

from __future__ import annotations

import math

import numpy as np
import pytest

from livebass import load_preset, preset_names, quality_with
from livebass.arrays import Floats
from livebass.engine.engine import Engine
from livebass.kernels.performer import MOST_STRINGS
from livebass.model.instrument import Instrument, note_frequency, speaking

RATE = 22050
IN_TUNE = 2.0  # cents


def pitch(sound: Floats, rate: int, expected: float) -> float:
    """Frequency (Hz) of the partial near `expected`: phase of two Hann windows an overlap apart.

    Its decay is measured the same way and taken out, so that windows do not leak.
    """
    length = len(sound) * 2 // 3
    shift = len(sound) - length
    apart = shift / rate
    t = np.arange(len(sound)) / rate
    probe = np.hanning(length) * np.exp(-2j * math.pi * expected * t[:length])
    growth = 0.0
    for _ in range(4):
        still = sound * np.exp(growth * t)
        ratio = np.sum(still[shift:] * probe) / np.sum(still[:length] * probe)
        growth -= math.log(abs(ratio)) / apart
    turn = np.angle(ratio * np.exp(-2j * math.pi * expected * apart))
    return float(expected + turn / (2 * math.pi * apart))


def cents(frequency: float, reference: float) -> float:
    return 1200 * math.log2(frequency / reference)


def play_frets(bass: Instrument, fret: int, seconds: float) -> Floats:
    """(strings, n): the note at `fret` of every string, softly; the pitch of what a string does when left alone."""
    engine = Engine(bass, quality_with("live", modes=80, contact_rate=200e3), RATE)
    assert engine.strings <= MOST_STRINGS
    out = []
    for i, string in enumerate(bass.strings):
        # the other strings sound already: only this one is left to play the note
        engine.performer[0]["state"] = 1
        engine.performer[0]["state"][i] = 0
        note = string.open_note + fret
        engine.send(np.array([engine.frame]), np.array([[0x90, note, 40]], np.uint8))
        assert engine.performer[0]["fret"][i] == fret
        out.append(engine.process(int(seconds * RATE))[i])
    return np.array(out)


@pytest.mark.parametrize("name", preset_names())
def test_within_two_cents_of_equal_temperament(name: str) -> None:
    bass = load_preset(name)
    worst = 0.0
    for fret in range(len(bass.necks[0].fret_positions) + 1):
        sounds = play_frets(bass, fret, 0.9)
        for string, neck, sound in zip(bass.strings, bass.necks, sounds, strict=True):
            assert speaking(string, neck, fret).stop == fret, "a higher fret chokes the note"
            expected = note_frequency(string.open_note + fret)
            off = cents(pitch(sound[int(0.1 * RATE) :], RATE, expected), expected)
            assert abs(off) < IN_TUNE, f"{name}, string {string.name}, fret {fret}: {off:+.2f} cents"
            worst = max(worst, abs(off))
    assert worst > 0


def test_the_measure_finds_a_quarter_of_a_cent() -> None:
    t = np.arange(int(0.8 * RATE)) / RATE
    for note in (28, 43, 63):
        expected = note_frequency(note)
        detuned = expected * 2 ** (1.5 / 1200)
        sound = np.exp(-3 * t) * (np.sin(2 * np.pi * detuned * t) + 2 * np.sin(2 * np.pi * 2.001 * detuned * t + 1))
        assert abs(cents(pitch(sound, RATE, expected), expected) - 1.5) < 0.25
