"""Lines about a MIDI file or a note beside the bass that is to play it: parts, programs, notes out of range."""

from __future__ import annotations

from pathlib import Path

import click
import numpy as np

from livebass.model.instrument import Instrument
from livebass.preset.load import preset_with
from livebass.preset.programs import PROGRAMS
from livebass.report.text import columns
from livebass.score import NOTE_ON, Score, read_parts
from livebass.units import note_name


def remarks(score: Score, preset: str | None, usual: str) -> list[str]:
    """Lines to say about a file before it is played on `preset`; None: on what its program chooses, or on `usual`."""
    lines = list(score.remarks)
    if preset is None and score.program is not None:
        number = score.program + 1
        chosen = PROGRAMS.get(number)
        if chosen is None:
            ends = f"{min(PROGRAMS)} to {max(PROGRAMS)}"
            lines.append(f"program {number} chooses no bass, {ends} do: played on {usual}")
        elif chosen != usual:
            lines.append(f"program {number}: played on {chosen}")
    return lines


def check_range(bass: Instrument, note: int, usual: str) -> None:
    """Raises UsageError for a note that `bass` does not have, and names a preset that has it, if possible `usual`."""
    lowest, highest = bass.note_range
    if not lowest <= note <= highest:
        other = preset_with(note, usual)
        hint = f"-p {other} plays it" if other else "no preset that comes with livebass has it"
        ends = f"{note_name(lowest)} to {note_name(highest)}"
        raise click.UsageError(f"--note {note_name(note)}: {bass.name} has {ends}; {hint}")


def too_low(bass: Instrument, score: Score, usual: str) -> list[str]:
    """A line about the notes of a file below the lowest string, if any, and which preset plays them."""
    notes = score.messages[score.messages[:, 0] == NOTE_ON, 1]
    lowest = bass.note_range[0]
    switches = [key for key, *_ in bass.player.keys.keys]
    below = sorted(notes[(notes < lowest) & ~np.isin(notes, switches)].tolist())
    if not below:
        return []
    one = len(below) == 1
    if bass.player.out_of_range == "drop":
        become = "is left out" if one else "are left out"
    else:
        become = f"sound{'s' * one} {'an octave' if lowest - below[0] <= 12 else 'octaves'} higher"
    text = f"{len(below)} note{' lies' if one else 's lie'} below {note_name(lowest)} and {become}"
    for number, note in enumerate(below):
        if other := preset_with(note, usual):
            reached = len(below) - number
            which = f"{reached} of them" if number else "it" if one else "them"
            return [f"{text}; -p {other} plays {which}"]
    return [text]


def parts_table(midi: Path, channel: str | int) -> str:
    """The parts of a MIDI file as a table: channel, track, programs, notes, range, and what `channel` would play."""
    rows = [("channel", "track", "program", "notes", "range", "played")]
    for part in read_parts(midi, channel):
        programs = "drums" if part.is_drums else " ".join(map(str, part.programs)) or "-"
        played = "yes" if part.chosen == part.notes else f"{part.chosen} of them" if part.chosen else "no"
        rows.append((str(part.channel), part.name or "-", programs, str(part.notes), part.range, played))
    return "\n".join(line.rstrip() for line in columns(rows, left=len(rows[0])))
