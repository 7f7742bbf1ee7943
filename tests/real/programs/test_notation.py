"""Songs of ours through MuseScore 3.2.3, TuxGuitar 1.5.6 and FluidSynth 2.3.1, the versions of Debian 12."""

from __future__ import annotations

import os
import subprocess
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest
import soundfile
from support.needs import missing, tool
from support.places import SUPPORT
from support.tabs import as_gp5, beats, note, tab

from livebass import fundamental
from livebass.cli.hands import SOUND, Loader
from livebass.model.instrument import note_frequency
from livebass.rows.units import cents
from livebass.tab.model import LEGATO, NATURAL
from livebass.tab.reading import TabRequest, arrange, parse

TUXGUITAR, SOUNDS = Path("/usr/share/tuxguitar"), Path("/usr/share/sounds/sf2/TimGM6mb.sf2")
Written = tuple[Fraction, int, int, int]  # place in its bar, key, string, fret
BENT = ((0.0, 0.0), (0.5, 2.0), (1.0, 2.0))
SONG = tab(  # a technique a bar
    beats(note(0, 3), note(1, 5), note(2, 7), note(3, 9)),
    beats(note(1, 3, hammer=True), note(1, 5), note(1, 5, hammer=True), note(1, 3)),
    beats(note(1, 3, slides=frozenset([LEGATO])), note(1, 7), note(2, 3), note(2, 7)),
    beats(note(2, 7, bend=BENT), note(2, 7), note(3, 7), note(3, 5)),
    beats(note(0, 3, dead=True), note(0, 3), note(1, 3, ghost=True), note(1, 3)),
    beats(note(0, 3, palm=True), note(0, 5), [note(1, 5), note(3, 2)], None),
    beats(
        note(0, 3, technique="slap"), note(3, 5, technique="pop"), note(2, 5), note(1, 12, harmonic=NATURAL, node=12.0)
    ),
)


def musescore(source: Path, made: Path) -> None:
    environment = os.environ | {"QT_QPA_PLATFORM": "offscreen"}
    subprocess.run([tool("mscore3"), "-o", made, source], env=environment, check=True, capture_output=True, timeout=200)


def tuxguitar(source: Path, made: Path) -> None:
    tool("javac")
    jars = [*TUXGUITAR.glob("lib/*.jar"), *TUXGUITAR.glob("plugins/*.jar")] or missing("TuxGuitar", "tuxguitar")
    command = ["java", "-cp", os.pathsep.join(map(str, jars)), SUPPORT / "TuxGuitar.java", source, made]
    subprocess.run(command, check=True, capture_output=True, timeout=200)


def written(data: bytes) -> list[list[Written]]:
    """The notes of each bar of the first track."""
    track = parse(data).tracks[0]
    return [
        sorted((b.at, track.tuning[n.string] + n.fret, n.string, n.fret) for b in voice for n in b.notes)
        for voices in track.bars
        for voice in voices[:1]
    ]


def kept(data: bytes) -> set[str]:
    """The signs that a file has."""
    return {s for bar in parse(data).tracks[0].bars for v in bar for b in v for n in b.notes for s in n.signs}


def test_musescore_keeps_pitches_and_times_of_guitar_pro(tmp_path: Path) -> None:
    """MuseScore 3.2.3 writes no tablature of a Guitar Pro file: it loses strings, frets and most techniques."""
    (tmp_path / "song.gp5").write_bytes(as_gp5(SONG))
    musescore(tmp_path / "song.gp5", tmp_path / "song.musicxml")
    data = (tmp_path / "song.musicxml").read_bytes()
    ours = written(as_gp5(SONG))
    assert [[n[:2] for n in bar] for bar in written(data)[:6]] == [[n[:2] for n in bar] for bar in ours[:6]]
    assert "slide legato" in kept(data) and not kept(data) & {"bend", "palm mute", "slap", "pop", "hammer", "ghost"}


def test_tuxguitar_keeps_strings_frets_and_times_of_guitar_pro(tmp_path: Path) -> None:
    """TuxGuitar 1.5.6 writes MusicXML an octave high, which livebass undoes, and without any technique."""
    (tmp_path / "song.gp5").write_bytes(as_gp5(SONG))
    tuxguitar(tmp_path / "song.gp5", tmp_path / "song.musicxml")
    data = (tmp_path / "song.musicxml").read_bytes()
    assert written(data)[:6] == written(as_gp5(SONG))[:6] and not kept(data)


def exported(tmp_path: Path, plain: bool) -> Path:
    song = arrange(as_gp5(SONG), Path("song.gp5"), TabRequest(), Loader(dict.fromkeys(SOUND)))
    (made := tmp_path / "song.mid").write_bytes(song.exported(plain)[0])
    return made


def test_musescore_reads_a_plain_file_as_one_staff_of_the_right_bass(tmp_path: Path) -> None:
    musescore(exported(tmp_path, plain=True), tmp_path / "song.musicxml")
    text = (tmp_path / "song.musicxml").read_text()
    assert text.count("<score-part ") == 1 and "<midi-program>34</midi-program>" in text
    assert "<part-name>Fingered Bass, Bass</part-name>" in text
    bars = [[n[:2] for n in bar] for bar in written(text.encode())]
    assert bars[:6] == [[n[:2] for n in bar] for bar in written(as_gp5(SONG))[:6]], (
        "sounding pitch, slides as two notes"
    )


def test_tuxguitar_reads_a_plain_file_on_the_strings_of_a_bass(tmp_path: Path) -> None:
    tuxguitar(exported(tmp_path, plain=True), tmp_path / "song.musicxml")
    assert parse((tmp_path / "song.musicxml").read_bytes()).tracks[0].tuning == (28, 33, 38, 43)


@pytest.mark.parametrize("plain", [False, True])
def test_fluidsynth_bends_by_two_semitones(tmp_path: Path, plain: bool) -> None:
    if not SOUNDS.exists():
        missing("a General MIDI sound font", "timgm6mb-soundfont")
    file, sound = exported(tmp_path, plain), tmp_path / "song.wav"
    command = [tool("fluidsynth"), "-ni", "-q", "-r", "48000", "-F", sound, SOUNDS, file]
    subprocess.run(command, check=True, capture_output=True, timeout=200)
    samples, rate = soundfile.read(sound)
    bent = samples.mean(axis=1)[round(6.3 * rate) : round(6.45 * rate)]
    track = fundamental(bent, rate, minimum=60.0, maximum=300.0)
    assert abs(cents(float(np.nanmedian(track.frequency_hz)) / note_frequency(45 + 2))) < 15
