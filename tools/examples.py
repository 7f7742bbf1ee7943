"""Writes the files that README.md's commands use: song.mid and song.musicxml, a bass line, and cabinet.wav.

python tools/examples.py [folder]
"""

from __future__ import annotations

import sys
from pathlib import Path

import mido
import numpy as np
import soundfile

from livebass.rows.units import pitch_name

BAR = (28, 28, 40, 38, 28, 31, 33, 34)  # MIDI notes: E1 E1 E2 D2 E1 G1 A1 A#1
BARS = 4
FRETTED = ((4, 0), (4, 0), (2, 2), (2, 0), (4, 0), (4, 3), (3, 0), (3, 1))  # their strings, 1 is G, and frets
STRINGS = (("E", 1), ("A", 1), ("D", 2), ("G", 2))  # their open notes, the lowest first
EIGHTH, TEMPO, PROGRAM = 240, 96, 33  # ticks; beats a minute; General MIDI's fingered bass, from 0
RATE, LENGTH = 48_000, 0.05  # Hz, s


def song(place: Path) -> None:
    """Writes four bars of eighth notes, ten seconds, getting louder."""
    track = mido.MidiTrack()
    track.append(mido.MetaMessage("set_tempo", tempo=mido.bpm2tempo(TEMPO)))
    track.append(mido.MetaMessage("track_name", name="Bass"))
    track.append(mido.Message("program_change", program=PROGRAM))
    for k, key in enumerate(BAR * BARS):
        track.append(mido.Message("note_on", note=key, velocity=50 + 2 * k, time=EIGHTH // 8 if k else 0))
        track.append(mido.Message("note_off", note=key, velocity=64, time=EIGHTH * 7 // 8))
    mido.MidiFile(tracks=[track], ticks_per_beat=2 * EIGHTH, type=0).save(place)


def tablature(place: Path) -> None:
    """Writes the same bars as a tablature in MusicXML."""
    tuning = "".join(
        f'<staff-tuning line="{line}"><tuning-step>{step}</tuning-step><tuning-octave>{octave}</tuning-octave>'
        "</staff-tuning>"
        for line, (step, octave) in enumerate(STRINGS, 1)
    )
    notes = "".join(
        f"<note><pitch><step>{name[0]}</step><alter>{len(name) - 1}</alter><octave>{key // 12 - 1}</octave></pitch>"
        f"<duration>1</duration><voice>1</voice><type>eighth</type><notations><technical><string>{string}</string>"
        f"<fret>{fret}</fret></technical></notations></note>"
        for key, (string, fret) in zip(BAR, FRETTED, strict=True)
        for name in [pitch_name(key)]
    )
    head = (
        "<attributes><divisions>2</divisions><time><beats>4</beats><beat-type>4</beat-type></time>"
        "<clef><sign>TAB</sign><line>5</line></clef>"
        f"<staff-details><staff-lines>{len(STRINGS)}</staff-lines>{tuning}</staff-details></attributes>"
        f'<direction><sound tempo="{TEMPO}"/></direction>'
    )
    bars = "".join(f'<measure number="{k + 1}">{"" if k else head}{notes}</measure>' for k in range(BARS))
    place.write_text(
        '<?xml version="1.0" encoding="UTF-8"?>\n<score-partwise version="4.0"><part-list>'
        '<score-part id="P1"><part-name>Bass</part-name></score-part></part-list>'
        f'<part id="P1">{bars}</part></score-partwise>\n',
        encoding="utf-8",
    )


def cabinet(place: Path) -> None:
    """Writes a rough single-speaker cabinet response: resonances at 70 and 900 Hz, nothing above 4 kHz."""
    t = np.arange(round(LENGTH * RATE)) / RATE
    found = sum(
        level * np.exp(-decay * t) * np.sin(2 * np.pi * hertz * t)
        for hertz, decay, level in ((70, 180, 0.1), (900, 2500, 0.5), (2600, 6000, 0.5))
    )
    soundfile.write(place, 0.2 * found, RATE, subtype="FLOAT")


def main() -> None:
    folder = Path(sys.argv[1]) if len(sys.argv) > 1 else Path()
    song(folder / "song.mid")
    tablature(folder / "song.musicxml")
    cabinet(folder / "cabinet.wav")


if __name__ == "__main__":
    main()
