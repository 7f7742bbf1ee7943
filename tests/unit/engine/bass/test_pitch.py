"""Every string and fret of every preset plays in tune, measured on its sound."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest
from support.costs import of_each_kind
from support.messages import control, on
from support.pitch import pitch
from support.quiet import without_noise
from support.strings import one_string

from livebass import load_preset, preset_names, quality_with
from livebass.engine.engine import Engine
from livebass.kernels.player.performer import MAX_STRINGS
from livebass.model.instrument import Instrument, note_frequency, speaking
from livebass.rows.arrays import Floats
from livebass.rows.units import cents

RATE = 22050
IN_TUNE = 6.0  # cents: a note between the lines of u and v is the ear's choice


def frets(bass: Instrument, string: int, seconds: float) -> Iterator[Floats]:
    """Yields the sound (n,) of each fret of `string`, played softly after silence."""
    engine = Engine(one_string(bass, string), quality_with("live", modes=80, contact_rate=200e3), RATE)
    for fret in range(engine.frets + 1):
        engine.send(np.array([engine.frame]), np.array([on(bass.strings[string].open_note + fret, 40)], np.uint8))
        (sound,) = engine.process(int(seconds * RATE))
        assert engine.voices[0].note()[0] == fret
        yield sound
        engine.send(np.array([engine.frame]), np.array([control(120)], np.uint8))
        engine.process(RATE // 10)
        assert not engine.sounding()


@pytest.mark.parametrize("name", of_each_kind(preset_names()))
def test_within_some_cents_of_equal_temperament(name: str) -> None:
    bass = without_noise(load_preset(name))
    assert len(bass.strings) <= MAX_STRINGS
    worst = 0.0
    for i, (string, neck) in enumerate(zip(bass.strings, bass.necks, strict=True)):
        for fret, sound in enumerate(frets(bass, i, 0.9)):
            assert speaking(string, neck, fret).stop == fret, "a higher fret chokes the note"
            expected = note_frequency(string.open_note + fret)
            off = cents(pitch(sound[int(0.1 * RATE) :], RATE, expected) / expected)
            assert abs(off) < IN_TUNE, f"{name}, string {string.name}, fret {fret}: {off:+.2f} cents"
            worst = max(worst, abs(off))
    assert worst > 0


def test_the_measure_finds_a_quarter_of_a_cent() -> None:
    t = np.arange(int(0.8 * RATE)) / RATE
    for note in (28, 43, 63):
        expected = note_frequency(note)
        detuned = expected * 2 ** (1.5 / 1200)
        sound = np.exp(-3 * t) * (np.sin(2 * np.pi * detuned * t) + 2 * np.sin(2 * np.pi * 2.001 * detuned * t + 1))
        assert abs(cents(pitch(sound, RATE, expected) / expected) - 1.5) < 0.25
