"""Tablature in sound: strings, pitches and onsets by stems; a MIDI file of it is the same music."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from support.pitch import pitch
from support.tabs import as_gp, as_gp5, as_gpx, as_musicxml, beats, note, tab

from livebass.cli.hands import SOUND, Loader
from livebass.engine.engine import Engine
from livebass.engine.render import render_to_array
from livebass.model.instrument import note_frequency
from livebass.model.quality import QUALITIES
from livebass.preset.load import load_preset
from livebass.rows.arrays import Floats
from livebass.score.reading import read_score
from livebass.score.score import Score
from livebass.tab.model import ARTIFICIAL, LEGATO, NATURAL, OUT_DOWN, SHIFT, Tab
from livebass.tab.reading import TabRequest, arrange, read_tab, score_of_tab

RATE = 48000
LIVE = QUALITIES["live"]


def load() -> Loader:
    return Loader(dict.fromkeys(SOUND))


def score_of(piece: Tab, **requested: object) -> Score:
    return score_of_tab(as_gp5(piece), Path("song.gp5"), RATE, TabRequest(**requested), load())  # type: ignore[arg-type]


def sound_of(piece: Tab) -> Floats:
    """The sound of each string on the bass that the tablature chooses."""
    score = score_of(piece)
    bass = load_preset(score.basses[0].preset, tuning=score.basses[0].given.get("tuning"))
    return render_to_array(bass, score.on_one_bass(), LIVE, tail=0.0)


def level(sound: Floats, begin: float, end: float) -> float:
    """dB."""
    return float(10 * np.log10(np.mean(sound[round(begin * RATE) : round(end * RATE)] ** 2) + 1e-30))


def cents_off(sound: Floats, begin: float, end: float, key: float) -> float:
    part, hertz = sound[round(begin * RATE) : round(end * RATE)], note_frequency(key)
    return 1200 * float(np.log2(pitch(part, RATE, hertz) / hertz))


def test_notes_sound_on_their_strings_in_tune_and_in_time() -> None:
    tuning = (24, 31, 36, 41)
    sound = sound_of(tab(beats(note(0, 5), note(3, 2), note(1, 7), note(2, 0)), tuning=tuning))
    for k, (string, fret) in enumerate([(0, 5), (3, 2), (1, 7), (2, 0)]):
        begin = 0.5 * k
        assert abs(cents_off(sound[string], begin + 0.1, begin + 0.45, tuning[string] + fret)) < 20
        if k:
            assert level(sound[string], 0, begin) < -75, "silent before its note"
        assert level(sound[string], begin, begin + 0.005) > -60


def test_a_hammer_a_slide_and_a_bend_arrive_at_their_pitch() -> None:
    slow = beats(note(1, 5, hammer=True), note(1, 7), note(2, 5, slides=frozenset([LEGATO])), note(2, 9))
    sound = sound_of(tab(slow, beats(note(3, 5, bend=((0.0, 0.0), (0.25, 2.0), (1.0, 2.0))))))
    assert abs(cents_off(sound[1], 0.65, 0.98, 33 + 7)) < 20
    assert abs(cents_off(sound[2], 1.51, 1.95, 38 + 9)) < 20
    assert abs(cents_off(sound[3], 2.2, 2.48, 43 + 5 + 2)) < 10


@pytest.mark.parametrize("fret, node, semitones", [(12, 12.0, 12), (7, 7.0, 19), (5, 5.0, 24), (4, 4.0, 28)])
def test_natural_harmonics_sound_over_the_open_string(fret: int, node: float, semitones: int) -> None:
    sound = sound_of(tab(beats(note(1, fret, harmonic=NATURAL, node=node))))[1]
    assert abs(cents_off(sound, 0.1, 0.45, 33 + semitones)) < 20
    assert level(sound, 0.1, 0.45) > -60


@pytest.mark.parametrize("fret", [5, 7, 12])
def test_an_artificial_harmonic_sounds_an_octave_higher(fret: int) -> None:
    sound = sound_of(tab(beats(note(1, fret, harmonic=ARTIFICIAL, node=12.0))))[1]
    assert abs(cents_off(sound, 0.1, 0.45, 33 + fret + 12)) < 20


def test_techniques_differ_in_sound() -> None:
    def of(string: int = 0, **signs: object) -> Floats:
        return sound_of(tab(beats(note(string, 3, **signs))))[string]

    plain, dead, accent, ghost = of(), of(dead=True), of(accent=1), of(ghost=True)
    assert level(dead, 0.1, 0.15) < level(plain, 0.1, 0.15) - 20
    assert level(ghost, 0, 0.2) < level(plain, 0, 0.2) < level(accent, 0, 0.2)
    slapped = {technique: of(technique=technique) for technique in ("slap", "tap")}
    assert not np.array_equal(slapped["slap"], plain) and not np.array_equal(slapped["tap"], plain)
    assert not np.array_equal(slapped["slap"], of(technique="pop")), "a pop on the lowest string"
    assert not np.array_equal(of(3, technique="slap"), of(3, technique="pop")), "the thumb on the highest"


SONG = tab(
    beats(note(0, 3, technique="slap"), note(2, 5, hammer=True), note(2, 7, palm=True), [note(1, 5), note(3, 4)]),
    beats(note(0, 3, dead=True), note(3, 7, bend=((0.0, 0.0), (1.0, 2.0))), note(3, 5, vibrato=1.0)),
)


# Each stroke alone, with every technique that the map `modo` has keys for
ALONE = tab(
    beats(note(0, 3, technique="slap"), note(2, 5, hammer=True), note(2, 7, palm=True), note(1, 5, technique="pop")),
    beats(note(0, 3, dead=True), note(3, 7, bend=((0.0, 0.0), (0.5, 2.0), (1.0, -1.0))), note(3, 5, vibrato=1.0)),
    beats(note(2, 5, slides=frozenset([LEGATO])), note(2, 9, slides=frozenset([SHIFT])), note(2, 4), note(1, 3)),
    beats(note(1, 12, harmonic=NATURAL, node=12.0), note(1, 5, harmonic=ARTIFICIAL, node=12.0), note(1, 7, ghost=True)),
    beats(note(0, 9, technique="tap"), note(0, 7, slides=frozenset([OUT_DOWN])), note(3, 9, accent=2), note(0, 0)),
)


def test_every_format_gives_the_same_score() -> None:
    first = score_of(SONG)
    for kind, write in {"gpx": as_gpx, "gp": as_gp}.items():
        score = score_of_tab(write(SONG), Path(f"song.{kind}"), RATE, TabRequest(), load())
        assert score.strokes == first.strokes and score.beats == first.beats
    same = score_of(tab(beats(note(0, 3), note(2, 5))))
    xml = as_musicxml(tab(beats(note(0, 3), note(2, 5))))
    assert score_of_tab(xml, Path("song.xml"), RATE, TabRequest(), load()).strokes == same.strokes


def test_an_exported_midi_file_has_the_same_sound(tmp_path: Path) -> None:
    """To the bit, if no two strokes begin together: a key switch would reach both."""
    song = arrange(as_gp5(ALONE), Path("song.gp5"), TabRequest(), load())
    (tmp_path / "song.mid").write_bytes(song.exported()[0])
    score, again = song.score(RATE), read_score(tmp_path / "song.mid", RATE)
    assert score.end_frame == again.end_frame and score.file_end == again.file_end
    assert [replace(bass, program=33) for bass in score.basses] == list(again.basses), "the file has its program, too"
    here, there = (render_to_array(song.bass, each.on_one_bass(), LIVE, tail=0.1) for each in (score, again))
    assert np.abs(here).max() > 0.05 and np.array_equal(here, there)


def test_a_score_has_the_beats_of_its_bars() -> None:
    assert score_of(SONG).beats == tuple((24000 * k, k % 4 == 0) for k in range(8))


def test_python_reads_a_tablature_and_its_bass(tmp_path: Path) -> None:
    file = tmp_path / "song.gp5"
    file.write_bytes(as_gp5(tab(beats(note(0, 3)), beats(note(1, 5)), tuning=(24, 31, 36, 41), capo=2)))
    bass, score = read_tab(file, RATE, bars=range(1, 2), dynamics=-3.0)
    assert [string.open_note for string in bass.strings] == [26, 33, 38, 43] and score.notes == 1
    bass, _ = read_tab(file, RATE, track="1", preset="flatwound", tuning="drop-d", capo=0)
    assert [string.open_note for string in bass.strings] == [26, 33, 38, 43] and "lat" in bass.name
    for wrong in ({"track": "2"}, {"bars": range(5, 6)}, {"bars": range(0)}, {"dynamics": 40.0}, {"preset": "none"}):
        with pytest.raises(ValueError, match=r"^[^\n]+$"):
            read_tab(file, RATE, **wrong)  # type: ignore[arg-type]


def test_no_note_of_a_score_is_dropped_or_moved() -> None:
    score = score_of(SONG)
    engine = Engine(load_preset("jazz-finger"), LIVE, RATE)
    for _ in engine.play(score.on_one_bass()):
        pass
    report = engine.report()
    assert (report.notes, report.transposed, report.dropped) == (8, 0, 0)
