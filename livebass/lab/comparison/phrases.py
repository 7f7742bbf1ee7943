"""Compares phrases: recordings of a line or a groove beside presets that play one of the same kind."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from livebass.engine.engine import Engine
from livebass.lab.comparison.comparing import NOTHING
from livebass.lab.comparison.notes import RATE, sounds_in
from livebass.lab.comparison.phrase import Phrase, measure_phrase, spreads
from livebass.lab.comparison.recordings import Place, names_of
from livebass.lab.identification.partials import RecordingError, read_recording
from livebass.model.quality import QUALITIES
from livebass.preset.load import load_preset
from livebass.report.text import columns, json_text
from livebass.rows.arrays import Floats
from livebass.rows.bounds import one_of
from livebass.rows.units import note_number, one_line
from livebass.score.score import score_of

TEMPO = 96.0  # quarter notes per minute
GHOST = 20  # velocity of a ghost note
TAIL = 1.0  # s after the last note

# Four bars each, one row per note: start and length in sixteenths, note, velocity. Notes end before the next one; keys
# return, at about the same force.
LINE = (
    (0, 2.4, "E1", 84), (4, 2.4, "G1", 80), (8, 2.4, "A1", 86), (12, 2.4, "B1", 82),
    (16, 2.4, "C2", 84), (20, 2.4, "B1", 80), (24, 2.4, "A1", 84), (28, 2.4, "G1", 82),
    (32, 2.4, "E1", 86), (36, 2.4, "E2", 84), (40, 2.4, "D2", 80), (44, 2.4, "B1", 84),
    (48, 2.4, "A1", 82), (52, 2.4, "G1", 84), (56, 2.4, "F#1", 80), (60, 2.4, "E1", 86),
)  # fmt: skip
GROOVE = tuple(
    (16 * bar + at, length, note, velocity)
    for bar, root in enumerate(("E1", "E1", "A1", "E1"))
    for at, length, note, velocity in (
        (0, 1.6, root, 96), (3, 0.5, root, GHOST), (4, 0.8, root, 92), (6, 0.8, root, 90), (8, 1.6, root, 94),
        (10, 0.5, root, GHOST), (11, 0.5, root, GHOST), (12, 0.8, "D2", 90), (14, 0.8, "E2", 92),
    )
)  # fmt: skip
KINDS = {"line": LINE, "groove": GROOVE}


class Row(NamedTuple):
    """One line of the table."""

    key: str
    title: str
    unit: str
    digits: int


ROWS = (
    Row("notes", "notes heard", "", 0),
    Row("ends", "ends of notes heard", "", 0),
    Row("end_rate", "   fall", "dB/s", 0),
    Row("end_spread", "   fastest tenth over slowest", "", 2),
    Row("end_burst", "   1.5-4 kHz: peak over 30 ms, re a medium note", "dB", 0),
    Row("end_jump", "   1.5-4 kHz: that peak over the level before", "dB", 0),
    Row("ghosts", "ghost notes heard", "", 0),
    Row("ghost_level", "   level re a medium note", "dB", 0),
    Row("ghost_centroid", "   centroid", "Hz", 0),
    Row("ghost_length", "   length", "ms", 0),
    Row("gaps", "gaps between notes", "", 0),
    Row("between", "   with a sound of their own", "%", 0),
    Row("between_level", "   its level re a medium note", "dB", 0),
    Row("between_centroid", "   its centroid", "Hz", 0),
    Row("between_length", "   its length", "ms", 0),
    Row("repeated_level", "repeated notes: scatter of the level", "dB", 2),
    Row("repeated_centroid", "repeated notes: scatter of the centroid", "%", 1),
)


@dataclass(frozen=True)
class Bass:
    """The phrases of one bass and their figures."""

    name: str
    rendered: bool
    figures: dict[str, float]  # by key of ROWS; NaN: nothing tells it


def figures_of(phrases: Sequence[Phrase]) -> dict[str, float]:
    """Returns the figures of some phrases of one bass together: medians, by key of ROWS."""
    ends = [end for phrase in phrases for end in phrase.ends]
    ghosts = [ghost for phrase in phrases for ghost in phrase.ghosts]
    between = [short for phrase in phrases for short in phrase.between]
    gaps = sum(phrase.gaps for phrase in phrases)
    rates = [end.rate for end in ends]
    slow, fast = np.percentile(rates, [10, 90]) if len(rates) > 2 else (math.nan, math.nan)
    scatter = [spreads(phrase.notes) for phrase in phrases]
    found: dict[str, float] = {
        "notes": sum(len(phrase.notes) for phrase in phrases),
        "ends": len(ends), "end_rate": _median(rates), "end_spread": float(fast / slow),
        "end_burst": _median(end.burst for end in ends), "end_jump": _median(end.jump for end in ends),
        "ghosts": len(ghosts), "gaps": gaps, "between": 100 * len(between) / gaps if gaps else math.nan,
        "repeated_level": _median(level for level, _ in scatter),
        "repeated_centroid": _median(bright for _, bright in scatter),
    }  # fmt: skip
    for name, shorts in (("ghost", ghosts), ("between", between)):
        found[f"{name}_level"] = _median(s.level for s in shorts)
        found[f"{name}_centroid"] = _median(s.centroid for s in shorts)
        found[f"{name}_length"] = 1000 * _median(s.length for s in shorts)
    return found


def _median(values: Iterable[float]) -> float:
    known = [v for v in values if not math.isnan(v)]
    return float(np.median(known)) if known else math.nan


def play_phrase(preset: str, kind: str, quality: str = "studio", seed: int = 0) -> Floats:
    """Returns a phrase of a kind, "line" or "groove", by a preset, (n,) at RATE. Raises PresetError, ValueError."""
    one_of("kind", kind, KINDS)
    one_of("quality", quality, QUALITIES)
    bass = load_preset(preset)
    bass = replace(bass, player=replace(bass.player, ghost_below=GHOST + 1))
    sixteenth = 60 / TEMPO / 4
    notes = [
        (at * sixteenth, length * sixteenth, note_number(name), velocity) for at, length, name, velocity in KINDS[kind]
    ]
    score = score_of(notes, RATE, name=kind)
    engine = Engine(bass, QUALITIES[quality], RATE, seed)
    return np.concatenate([block.sum(axis=0) for block in engine.play(score, TAIL)])


def played_bass(preset: str, kind: str, quality: str = "studio", seed: int = 0) -> Bass:
    """Returns the figures of a preset that plays a phrase of a kind."""
    sound = play_phrase(preset, kind, quality, seed)
    return Bass(one_line(Path(preset).stem), True, figures_of([measure_phrase(sound, RATE)]))


def read_phrases(recordings: Sequence[Place], rendered: bool = False) -> list[Bass]:
    """Returns the basses of recordings: each folder is one, single files together are another.

    Raises RecordingError, one line with the name, for a file or folder in which no note is heard.
    """
    paths = [Path(path) for path in recordings]
    names = names_of([path for path in paths if path.is_dir()])
    files = [path for path in paths if not path.is_dir()]
    sets = [("recordings", files)] if files else []
    sets += [(name, sounds_in(path)) for path, name in names.items()]
    found = []
    for name, each in sets:
        phrases = [_read(file) for file in each]
        if not any(phrase.notes for phrase in phrases):
            raise RecordingError(f"{each[0] if each else name}: no phrase is heard: notes that begin by a stroke")
        found.append(Bass(name, rendered, figures_of(phrases)))
    return found


def _read(file: Path) -> Phrase:
    recording = read_recording(file)
    try:
        return measure_phrase(recording.sound, recording.rate)
    except ValueError as error:
        raise RecordingError(f"{file}: {error}") from None


@dataclass(frozen=True)
class Phrases:
    """Phrases of real basses and rendered ones, compared."""

    kind: str
    basses: tuple[Bass, ...]  # the real ones first

    def range_of(self, row: Row) -> tuple[float, float] | None:
        """Returns the lowest and highest figure of the real basses; None without any."""
        known = [v for b in self.basses if not b.rendered and not math.isnan(v := b.figures[row.key])]
        return (min(known), max(known)) if known else None

    def table(self) -> str:
        """Returns the table: a line per row, a column per bass, beside the range of the real ones."""
        lines = [(self.kind, "unit", "real", *(bass.name for bass in self.basses))]
        for row in ROWS:
            real = self.range_of(row)
            ends = dict.fromkeys(f"{value:z.{row.digits}f}" for value in real or ())
            values = (bass.figures[row.key] for bass in self.basses)
            cells = (NOTHING if math.isnan(value) else f"{value:z.{row.digits}f}" for value in values)
            lines.append((row.title, row.unit, " to ".join(ends) or NOTHING, *cells))
        return "\n".join(line.rstrip() for line in columns(lines, 2))

    def json(self) -> str:
        """Returns everything as JSON."""
        rows: list[dict[str, Any]] = [
            {"key": row.key, "title": row.title.strip(), "unit": row.unit, "real": self.range_of(row)} for row in ROWS
        ]
        basses = [{"name": b.name, "rendered": b.rendered, "figures": b.figures} for b in self.basses]
        return json_text({"phrase": self.kind, "rows": rows, "basses": basses})
