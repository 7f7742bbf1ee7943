"""Gives the page the numbers, words and encodings of Python's reader of MIDI files."""

from __future__ import annotations

import json

from livebass import kits, techniques, tracknames
from livebass.score import choosing, lines, low_keys, reading, score, sentences, smf, spread
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
    "channels": score.CHANNELS,
    "drums": kits.DRUMS,
    "melodic": kits.MELODIC,
    "bassPrograms": list(lines.BASS_PROGRAMS),
    "tempo": lines.DEFAULT_TEMPO,
    "longestRest": lines.LONGEST_REST,
    "lastNote": lines.LAST_NOTE,
    "bank": kits.BANK,
    "portamentoTime": lines.PORTAMENTO_TIME,
    "bendStarts": techniques.BEND_STARTS,
    "gm2Drums": kits.GM2_DRUMS,
    "gm2Melodic": kits.GM2_MELODIC,
    "xgDrums": kits.XG_DRUMS,
    "take": reading.TAKE,
    "release": score.RELEASE,
    "brief": score.BRIEF,
    "longest": score.LONGEST,
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
        "timbre": spread.TIMBRE,
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
