"""The basses that a score or a note chooses, and lines about them: programs, notes out of range."""

from __future__ import annotations

from collections.abc import Callable

import click
import numpy as np

from livebass.cli.take_bass import bass_line
from livebass.kernels.player.messages import NOTE_ON
from livebass.model.instrument import Instrument
from livebass.preset.load import preset_with
from livebass.preset.programs import PROGRAMS
from livebass.rows.units import note_name
from livebass.score.low_keys import with_low_notes, without_foreign_switches
from livebass.score.score import Score

MAX_REMARKS, LONGEST_REMARK = 100, 1000  # lines, and characters of one


def programs_of(score: Score) -> dict[int, str]:
    """The presets that programs, from 0, choose in a score: those named by a take, else General MIDI's."""
    if score.basses:
        return {bass.program: bass.preset for bass in score.basses}
    return {number - 1: name for number, name in PROGRAMS.items()}


def preset_of(score: Score | None, default: str) -> str:
    """The preset that a file begins with, by its program or named by a take, else the default one."""
    return default if score is None or score.program is None else programs_of(score).get(score.program, default)


def basses_of(
    score: Score, default: str, load: Callable[[str], Instrument]
) -> tuple[Instrument, dict[int, Instrument]]:
    """The bass that a file begins with, and the ones that its program changes choose, by program from 0."""
    known = programs_of(score)
    names = {program: known[program] for _, program in score.changes if program in known}
    first = preset_of(score, default)
    basses = {name: load(name) for name in dict.fromkeys([first, *names.values()])}
    return basses[first], {program: basses[name] for program, name in names.items()}


def later_presets(score: Score, default: str) -> list[tuple[float, int, str | None]]:
    """(time s, program from 1, preset) of each change of bass in mid-file; preset None: it chooses no bass."""
    known = programs_of(score)
    now, found = preset_of(score, default), list[tuple[float, int, str | None]]()
    for frame, program in score.changes:
        preset = known.get(program)
        if preset is None or preset != now:
            found.append((frame / score.rate, program + 1, preset))
            now = preset or now
    return found


def remarks(score: Score, preset: str | None, default: str) -> list[str]:
    """Messages before a file is played on `preset`; None: on the presets its programs choose, or on `default`."""
    lines = _remarks(score, preset, default)
    shown = [
        line if len(line) <= LONGEST_REMARK else f"{line[: LONGEST_REMARK - 3]}..." for line in lines[:MAX_REMARKS]
    ]
    return [*shown, f"and {len(lines) - MAX_REMARKS} more remarks"] if len(lines) > MAX_REMARKS else shown


def _remarks(score: Score, preset: str | None, default: str) -> list[str]:
    lines = list(score.remarks)
    if preset is not None:
        return lines
    if score.basses:
        return lines + _take_remarks(score, default)
    none = f"chooses no bass, {min(PROGRAMS)} to {max(PROGRAMS)} do"
    first = preset_of(score, default)
    if score.program is not None and score.program + 1 not in PROGRAMS:
        lines.append(f"program {score.program + 1} {none}: played on {default}")
    elif score.program is not None and first != default:
        lines.append(f"program {score.program + 1}: played on {first}")
    said = set()
    for seconds, program, chosen in later_presets(score, default):
        if chosen is not None:
            lines.append(f"program {program} at {seconds:.1f} s: played on {chosen} from there")
        elif program not in said:
            said.add(program)
            lines.append(f"program {program} at {seconds:.1f} s {none}: the bass before plays on")
    return lines


def _take_remarks(score: Score, default: str) -> list[str]:
    """Lines about the basses that a take names, except one that would play it anyway."""
    basses = {bass.program: bass for bass in reversed(score.basses)}
    first = basses.get(-1 if score.program is None else score.program)
    lines = [f"played on {bass_line(first)}"] if first and (first.preset != default or first.given) else []
    for seconds, program, _ in later_presets(score, default):
        lines.append(f"played on {bass_line(basses[program - 1])} from {seconds:.1f} s on")
    return lines


def check_range(bass: Instrument, note: int, default: str) -> None:
    """Raises UsageError for a note that `bass` lacks; names a preset that has it, preferably `default`."""
    lowest, highest = bass.note_range
    if not lowest <= note <= highest:
        other = preset_with(note, default)
        hint = f"-p {other} plays it" if other else "no preset that comes with livebass has it"
        ends = f"{note_name(lowest)} to {note_name(highest)}"
        raise click.UsageError(f"--note {note_name(note)}: {bass.name} has {ends}; {hint}")


def beyond_range(bass: Instrument, score: Score, default: str) -> list[str]:
    """Lines about key switches of another instrument, and notes below the lowest string and who plays them."""
    score, lowest = without_foreign_switches(score, bass), bass.note_range[0]
    count = score.left_out
    lines = [f"{count} key switch{'es' * (count != 1)} of another instrument left out"] if count else []
    notes = score.messages[score.messages[:, 0] & 0xF0 == NOTE_ON, 1]
    if not with_low_notes(score, bass).raised:
        notes = notes[~np.isin(notes, list(bass.switches))]
    below = sorted(notes[notes < lowest].tolist())
    if not below:
        return lines
    one = len(below) == 1
    if bass.player.out_of_range == "drop":
        become = "is left out" if one else "are left out"
    else:
        become = f"sound{'s' * one} {'an octave' if lowest - below[0] <= 12 else 'octaves'} higher"
    text = f"{len(below)} note{' lies' if one else 's lie'} below {note_name(lowest)} and {become}"
    for number, note in enumerate(below):
        if other := preset_with(note, default):
            reached = len(below) - number
            which = f"{reached} of them" if number else "it" if one else "them"
            return [*lines, f"{text}; -p {other} plays {which}"]
    return [*lines, text]
