"""Guitar Pro 6 to 8: tracks and notes without strings, two notes of one number, and files that repeat themselves."""

from __future__ import annotations

import re

import pytest
from support.tabs import as_gpif, beats, note, play, tab

from livebass.tab.gpif import MAX_AGAIN, read_gpif
from livebass.tab.model import LEGATO, Tab, UnreadableTab

OPENS = (28, 33, 38, 43)
PLACE = re.compile(r'<Property name="String"><String>(\d+)</String></Property><Property name="Fret"><Fret>(\d+)</Fret>')


def keyboard(piece: Tab, form: str, program: int = 38) -> bytes:
    """The piece for a synthesizer: pitches in place of strings and frets, as Guitar Pro 7 or 6 writes them."""

    def pitch(found: re.Match[str]) -> str:
        key = OPENS[int(found[1])] + int(found[2])
        if form == "7":
            return f'<Property name="Midi"><Number>{key}</Number>'
        octave = f'<Property name="Octave"><Number>{key // 12}</Number></Property>'
        return f'{octave}<Property name="Tone"><Step>{key % 12}</Step>'

    text = PLACE.sub(pitch, as_gpif(piece).decode()).replace("electricBass", "synthBass")
    text = re.sub(r'<Property name="Tuning">.*?</Property>', "", text)
    return re.sub(r"<Program>\d+<", f"<Program>{program}<", text).encode()


@pytest.mark.parametrize("form", ["6", "7"])
def test_a_synthesizer_bass_plays_by_pitch(form: str) -> None:
    piece = tab(beats(note(0, 0), note(1, 3), (note(0, 3), note(2, 5)), note(3, 2)))
    found = read_gpif(keyboard(piece, form))
    assert found.tracks[0].tuning == OPENS and not found.tracks[0].tabbed
    keys = sorted((s.time, OPENS[s.string] + s.fret) for s in play(found).strokes)
    assert keys == [(0.0, 28), (0.5, 36), (1.0, 31), (1.0, 43), (1.5, 45)]


def test_ties_and_slides_of_a_keyboard_keep_their_string() -> None:
    tied, slide = note(1, 3, tie=True), note(1, 3, slides=frozenset([LEGATO]))
    piece = tab(beats(note(1, 3), tied, slide, note(1, 7)))
    strokes = play(read_gpif(keyboard(piece, "7"))).strokes
    assert [(s.time, s.string, s.fret) for s in strokes] == [
        (0, 1, 3),
        (1, 1, 3),
        (pytest.approx(1.375, abs=0.1), 1, 7),
    ]


def test_notes_below_e_have_five_strings() -> None:
    text = keyboard(tab(beats(note(0, 0))), "7").replace(b"<Number>28<", b"<Number>24<")
    assert read_gpif(text).tracks[0].tuning == (23, *OPENS)


@pytest.mark.parametrize("string", ["-0.5", "3.5"])
def test_a_note_between_strings_is_counted(string: str) -> None:
    """As in the drums of alphaTab's faulty.gp, which another program wrote."""
    text = as_gpif(tab(beats(note(0, 0), note(1, 2)))).replace(b"<String>1<", b"<String>%b<" % string.encode())
    song = play(read_gpif(text))
    assert [stroke.string for stroke in song.strokes] == [0] and song.lacks == {"note beyond the strings": 1}


def test_of_two_notes_with_one_number_the_one_with_a_string_plays() -> None:
    """Guitar Pro 8.1 writes some notes again, as an articulation without string and fret."""
    text = as_gpif(tab(beats(note(0, 0), note(1, 2), note(2, 4), note(3, 5)))).decode()
    twin = '<Note id="{}"><Properties><Property name="ConcertPitch"/></Properties></Note>'
    for k in (3, 1):
        place = text.find("</Note>", text.find(f'<Note id="{k}">')) + len("</Note>")
        text = text[:place] + twin.format(k) + text[place:]
    assert [(s.string, s.fret) for s in play(read_gpif(text.encode())).strokes] == [(0, 0), (1, 2), (2, 4), (3, 5)]


def test_a_file_may_not_repeat_itself_without_end() -> None:
    """Voices, beats and notes are named by number: a small file made 611 MB."""
    text = as_gpif(tab(*[beats(note(0, 0))] * 4)).decode()
    beat = re.search(r"<Beats>(\d+)</Beats>", text)
    assert beat and read_gpif(text.encode())
    text = text.replace(beat[0], f"<Beats>{(beat[1] + ' ') * (MAX_AGAIN // 2 + 20)}</Beats>")
    with pytest.raises(UnreadableTab, match=f"repeats more than {MAX_AGAIN} beats and notes"):
        read_gpif(text.encode())
