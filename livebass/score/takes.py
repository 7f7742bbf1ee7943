"""The basses and the strokes of a take: texts in its MIDI file, each where its bass or stroke starts to play.

A text is MARK and a JSON object. That of a bass has "format" unless it is 1, "preset", a name or a path, "file", what a
preset file held when it played, and the options of `livebass play` that changed the bass. That of a tablature's event
has "stroke": its kind, number and value (kernels/player/words.py), whole numbers. This file does not trust the texts:
any file may contain them.
"""

from __future__ import annotations

import json
import re
from bisect import bisect_right
from collections.abc import Iterable, Mapping
from dataclasses import replace
from operator import itemgetter

import numpy as np

from livebass.files.formats import FORMATS, KEY
from livebass.kernels.player.performer import MAX_STRINGS
from livebass.kernels.player.words import STRING, STRING_REST, STROKE, STROKE_END, Row, field
from livebass.kernels.score.memory import PROGRAM
from livebass.score.score import Score, TakenBass
from livebass.score.smf import MARK

LONGEST = 1 << 16  # characters of a text
MAX_BASSES = 1000  # texts that name basses
LAST_PROGRAM = 127
STROKES = "stroke"
STROKE_TEXT = re.compile(re.escape(MARK) + rf'{{"{STROKES}": "(1[2-7]) (\d{{1,7}}) (-?\d{{1,8}})"}}')


def text_of(preset: str, given: Mapping[str, str], file: str = "") -> str:
    """The ASCII text that names a bass: `preset` is a name or a path, `given` options by name.

    file: the text of a preset file; left out if it is too long.
    """
    text = MARK + json.dumps({"preset": preset, **({"file": file} if file else {}), **given})
    return text if len(text) <= LONGEST or not file else text_of(preset, given)


def text_of_stroke(kind: int, number: int, value: float) -> str:
    """The ASCII text of a tablature's event."""
    return MARK + json.dumps({STROKES: f"{kind} {number} {round(value)}"})


def strokes_of(texts: Iterable[tuple[int, str]], end: int) -> tuple[Row, ...]:
    """The tablature's events in `texts` (frame, text); strokes that are still held end at frame `end`."""
    read = ((frame, STROKE_TEXT.fullmatch(text)) for frame, text in texts)
    found: list[Row] = [(frame, int(match[1]), int(match[2]), int(match[3])) for frame, match in read if match]
    held = dict.fromkeys(range(MAX_STRINGS), False)
    for _, kind, number, _ in found:
        if kind in (STROKE, STROKE_END, STRING_REST):
            held[field(number, STRING)] = kind == STROKE
    return (*found, *((end, STROKE_END, string, 0.0) for string, is_held in held.items() if is_held))


def with_basses(score: Score, texts: Iterable[tuple[int, str]]) -> Score:
    """`score`, of a take, with the basses that its `texts` (frame, text) name, instead of its programs.

    Each preset gets a program: the file's, unless another preset has it. Useless texts become a remark, and so do
    those beyond MAX_BASSES; if all are useless, the score keeps its programs.
    """
    basses, remarks = list[TakenBass](), list(score.remarks)
    programs: dict[str, int] = {}
    useless = list[float]()  # texts, by their times
    named = [(frame, text) for frame, text in texts if not STROKE_TEXT.fullmatch(text)]
    if len(named) > MAX_BASSES:
        remarks.append(f"of {len(named)} texts that name basses only the first {MAX_BASSES} count")
    own = [(-1, score.program), *score.changes]  # programs of the file
    for frame, text in named[:MAX_BASSES]:
        stored = _stored_bass(text)
        if stored is not None and stored[0] not in programs:
            there = own[bisect_right(own, frame, key=itemgetter(0)) - 1][1]
            free = [program for program in range(LAST_PROGRAM, -1, -1) if program not in programs.values()]
            if free:
                programs[stored[0]] = there if there in free else free[0]
        if stored is None or stored[0] not in programs:
            useless.append(frame / score.rate)
        else:
            basses.append(TakenBass(frame, programs[stored[0]], *stored))
    if useless:
        remarks.append(_left_out(useless))
    if not basses:
        return replace(score, remarks=tuple(remarks))
    kept = score.on_one_bass()
    changes = basses[1:] if basses[0].frame == 0 else basses
    places = np.searchsorted(kept.frames, [bass.frame for bass in changes])  # a bass plays notes at its own frame
    rows = np.array([(PROGRAM, bass.program, 0) for bass in changes], np.uint8).reshape(-1, 3)
    return replace(
        kept,
        frames=np.insert(kept.frames, places, [bass.frame for bass in changes]),
        messages=np.insert(kept.messages, places, rows, axis=0),
        program=basses[0].program if basses[0].frame == 0 else score.program,
        basses=tuple(basses),
        remarks=tuple(remarks),
    )


def _left_out(useless: list[float]) -> str:
    """Says that the texts at these times (s) are left out."""
    first, others = f"a text at {useless[0]:.1f} s", len(useless) - 1
    if not others:
        return f"{first}, which names no bass, is left out"
    return f"{first} and {others} other text{'s' if others > 1 else ''}, which name no bass, are left out"


def _stored_bass(text: str) -> tuple[str, dict[str, str], str] | None:
    """The preset, the options and the preset's text in a text; None if invalid."""
    if len(text) > LONGEST:
        return None
    try:
        stored = json.loads(text.removeprefix(MARK))
    except (ValueError, RecursionError):
        return None
    if not isinstance(stored, dict) or not all(isinstance(value, str) for value in stored.values()):
        return None
    number = stored.pop(KEY, "1")
    if not re.fullmatch(r"[0-9]{1,9}", number) or int(number) > FORMATS["take"]:
        return None
    preset, file = stored.pop("preset", ""), stored.pop("file", "")
    return (preset, stored, file) if preset else None
