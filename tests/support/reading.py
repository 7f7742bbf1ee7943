"""The contents of a MIDI file as read by Python and by the page, in the same words."""

from __future__ import annotations

import base64
import json
import re
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np

from livebass.kernels.score.smf import FOREIGN
from livebass.model.instrument import Instrument
from livebass.score.low_keys import with_low_notes, without_foreign_switches
from livebass.score.reading import ScoreError, read_parts, read_score
from livebass.score.score import MIN_RATE
from livebass.score.sentences import ERRORS
from support.node import run

RATE = 48000
PART = ("port", "channel", "track", "name", "notes", "switches", "chosen", "lowest", "highest", "why")
PAGE_READS = """
import {Kernels} from "./kernels.js";
import {AUTO, Song} from "./song.js";

export const run = (instance, files, bass, rate, coarse, fields) => files.map(file => {
  const data = Uint8Array.from(atob(file), c => c.charCodeAt(0)).buffer, kernels = new Kernels(instance());
  try {
    const song = new Song(data, rate, kernels), rows = song.messages(AUTO, bass);
    const parts = new Song(data, coarse, kernels).partsOn(bass);
    return {
      refused: rows.length ? "" : "no bass notes", remarks: song.remarks, end: song.found("end"),
      left: song.fitted(AUTO, bass).leftOut,
      messages: Array.from({length: rows.length / 4}, (_, k) => [...rows.subarray(4 * k, 4 * k + 4)]),
      parts: parts.map(({drums, programs, banks, ...part}) =>
        [...fields.map(name => part[name]), drums, programs.join(), banks.join()]),
    };
  } catch (error) {
    return {refused: error.message};
  }
});
"""


def read_by_python(file: Path, bass: Instrument) -> dict[str, Any]:
    """The messages, parts and remarks that `render` would play on `bass`, or why it refuses the file."""
    found: dict[str, Any] = {"refused": ""}
    raised = 0
    try:
        score = with_low_notes(read_score(file, RATE).on_one_bass(), bass)
        raised = with_low_notes(read_score(file, MIN_RATE).on_one_bass(), bass).raised
        frames = score.frames.astype(np.int32).tolist()  # the page has no more bits
        found["messages"] = [[f, *m] for f, m in zip(frames, score.messages.tolist(), strict=True)]
        found |= {"remarks": [re.sub("; --.*", "", line) for line in score.remarks], "end": score.file_end}
        found["left"] = without_foreign_switches(read_score(file, RATE).on_one_bass(), bass).left_out
    except ScoreError as error:
        text = str(error).removeprefix(f"{file}: ")
        if re.fullmatch("is an? .*, not a MIDI file.*", text):  # of which kind, only Python says
            text = ERRORS[FOREIGN]
        found["refused"] = "no bass notes" if text.startswith("no bass notes") else text
        if found["refused"] != "no bass notes":
            return found
    parts = read_parts(file, switches=() if raised else bass.switches)
    found["parts"] = [
        [*(getattr(part, name) for name in PART), part.is_drums,
         *(",".join(map(str, numbers)) for numbers in (part.programs, part.banks))]
        for part in parts
    ]  # fmt: skip
    return found


def read_by_page(files: Iterable[bytes], bass: Instrument) -> list[dict[str, Any]]:
    """Reads each file by the page's scripts, in node, into the form of `read_by_python`."""
    reported = {"range": bass.note_range, "switches": sorted(bass.switches)}
    packed = [base64.b64encode(data).decode() for data in files]
    found: list[dict[str, Any]] = run(PAGE_READS, packed, reported, RATE, MIN_RATE, PART)
    return found


def plain(found: Any) -> str:
    """What is found, without letters that only some decoders know."""
    return json.dumps(found, ensure_ascii=False).replace("\N{REPLACEMENT CHARACTER}", " ")


def differences(by_python: dict[str, Any], by_page: dict[str, Any]) -> list[str]:
    """A line for each thing that the page reads differently."""
    return [
        f"{name}: {wanted!r:.600} is {by_page.get(name)!r:.600} on the page"
        for name, wanted in by_python.items()
        if plain(by_page.get(name)) != plain(wanted)
    ]
