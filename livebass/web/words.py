"""Gives the page the words and encodings of Python's reader of MIDI files, and the sentences for what kernels find."""

from __future__ import annotations

import json

from livebass.files.kinds import MIDI_ENDINGS, TAB_ENDINGS
from livebass.rows.units import note_name
from livebass.score import reading, sentences, smf, tracknames

WORDS = {
    "names": {
        "bass": tracknames.BASS_WORD,
        "other": tracknames.OTHER_WORD,
        "drums": tracknames.DRUM_WORD,
        "telling": tracknames.TELLING_WORD,
    },
    "game": {
        "track": tracknames.GAME_TRACK,
        "minimum": tracknames.MIN_GAME,
        "refusal": tracknames.GAME_REFUSAL,
    },
    "endings": {"midi": MIDI_ENDINGS, "tab": TAB_ENDINGS},
    "encodings": list(tracknames.ENCODINGS.values()),
    "longestName": smf.LONGEST_NAME,
    "take": reading.TAKE,
    "errors": sentences.ERRORS,
    "remarks": {**sentences.REMARKS, **sentences.CHOICE},
    "reasons": sentences.REASONS,
    "noBass": sentences.NO_BASS,
    "tooLong": sentences.TOO_LONG,
    "tooMuch": sentences.TOO_MUCH,
    "notes": [note_name(note) for note in range(128)],
}


def words() -> str:
    """Returns a line of JavaScript that defines WORDS."""
    return f"const WORDS = {json.dumps(WORDS, separators=(',', ':'))};\n"
