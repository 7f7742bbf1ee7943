"""Gives the page the numbers, words and encodings of Python's reader of MIDI files."""

from __future__ import annotations

import json

from livebass import kits, techniques, tracknames
from livebass.kernels.player import messages
from livebass.kernels.player.performer import CHANNELS
from livebass.kernels.score import choosing, cleaning, lines, low_keys, programs, spread, times
from livebass.score import reading, sentences, smf
from livebass.units import note_name

RULE = {
    "words": {
        "bass": tracknames.BASS_WORD,
        "other": tracknames.OTHER_WORD,
        "drums": tracknames.DRUM_WORD,
        "telling": tracknames.TELLING_WORD,
    },
    "game": {
        "track": tracknames.GAME_TRACK,
        "least": tracknames.LEAST_GAME,
        "refusal": tracknames.GAME_REFUSAL,
    },
    "encodings": list(tracknames.ENCODINGS.values()),
    "longestName": smf.LONGEST_NAME,
    "errors": sentences.ERRORS,
    "remarks": sentences.REMARKS,
    "channels": CHANNELS,
    "drums": kits.DRUMS,
    "melodic": kits.MELODIC,
    "bassPrograms": list(programs.BASS_PROGRAMS),
    "tempo": times.DEFAULT_TEMPO,
    "longestRest": lines.LONGEST_REST,
    "lastNote": lines.LAST_NOTE,
    "bank": kits.BANK,
    "portamentoTime": lines.PORTAMENTO_TIME,
    "bendStarts": techniques.BEND_STARTS,
    "gm2Drums": kits.GM2_DRUMS,
    "gm2Melodic": kits.GM2_MELODIC,
    "xgDrums": kits.XG_DRUMS,
    "take": reading.TAKE,
    "release": messages.RELEASE,
    "brief": cleaning.BRIEF,
    "longest": lines.LONGEST,
    "place": {
        "lowest": spread.LOWEST,
        "highest": spread.HIGHEST,
        "middle": spread.MIDDLE,
        "most": spread.MOST,
    },
    "mostBasses": choosing.MOST_BASSES,
    "together": choosing.TOGETHER,
    "same": choosing.SAME,
    "leastSame": choosing.LEAST,
    "overlap": spread.OVERLAP,
    "spread": {
        "mostOverlap": spread.MOST_OVERLAP,
        "leastBent": spread.LEAST_BENT,
        "mostStaying": spread.MOST_STAYING,
        "timbre": messages.BRIGHTNESS,
    },
    "low": {
        "deepest": low_keys.DEEPEST,
        "short": low_keys.SHORT,
        "most": low_keys.MOST,
        "far": low_keys.FAR,
    },
    "notes": [note_name(note) for note in range(128)],
}


def rule() -> str:
    """Returns a line of JavaScript that defines RULE."""
    return f"const RULE = {json.dumps(RULE, separators=(',', ':'))};\n"
