"""Basses to compare: notes in folders and files, and the same notes played by presets."""

from __future__ import annotations

import os
from collections import Counter
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import TypedDict, Unpack

from livebass.lab.comparison.comparing import Comparison, compare_basses
from livebass.lab.comparison.notes import measure_notes, own_technique, render_notes
from livebass.lab.comparison.summary import Bass, basses
from livebass.lab.comparison.telling import example
from livebass.preset.load import load_preset
from livebass.report.progress import Progress
from livebass.rows.units import one_line

Place = str | os.PathLike[str]


class Playing(TypedDict, total=False):
    """How presets play the notes."""

    quality: str
    velocities: Sequence[int] | None
    takes: int
    seed: int


def compare(
    real: Sequence[Place],
    presets: Sequence[str] = (),
    beside: Sequence[Place] = (),
    *,
    technique: str | None = None,
    progress: Progress | None = None,
    **how: Unpack[Playing],
) -> Comparison:
    """Compares notes of real basses with rendered ones, figure by figure, as `livebass compare` does.

    Args:
        real: Sound files of single notes, or folders of them. Each folder is a bass, single files are another. Words
            in names tell dynamics and technique, see `livebass compare --help`.
        presets: Presets that play the same notes, by name or path.
        beside: Recordings to compare in place of presets.
        technique: Of all notes: "fingers", "pick", "slap", "pop" or "mute"; None: of recordings by their names, of
            a preset its own.
        progress: Gets the fraction done, 0 to 1.

    Keyword Args:
        quality: Of the presets' strings, a key of QUALITIES; "studio" by default.
        velocities: Of a preset, soft to hard; by default as many as the dynamics of `real`.
        takes: How often a preset plays each note; 2 by default.
        seed: Of the players' unevenness.

    Returns:
        The comparison: `table()` and `json()` write it.

    Raises:
        ValueError: A file is no sound, no note is heard, or a preset has none of the pitches.
    """
    found, _ = read_basses(real, beside, technique)
    if all(bass.rendered for bass in found):
        raise ValueError(f"{real[0] if real else 'nothing'}: no plucked note is heard")
    found += play_presets(presets, found, technique=technique, taken=[*real, *beside], **how)
    return compare_basses(found, progress)


def read_basses(
    recordings: Sequence[Place], beside: Iterable[Place] = (), technique: str | None = None
) -> tuple[list[Bass], list[str]]:
    """Returns the basses in files and folders, and the files in which no note with a pitch is heard."""
    real, other = [Path(path) for path in recordings], [Path(path) for path in beside]
    folders, files = [path for path in real if path.is_dir()], [path for path in real if not path.is_dir()]
    names, left_out, found = names_of([*folders, *other]), list[str](), list[Bass]()
    for name, paths in [*([("recordings", files)] if files else []), *((names[path], [path]) for path in folders)]:
        found += basses(name, measure_notes(paths, technique, left_out))
    for path in other:
        found += basses(names[path], measure_notes([path], technique, left_out), rendered=True)
    return found, left_out


def play_presets(
    presets: Sequence[str],
    like: Sequence[Bass],
    *,
    technique: str | None,
    taken: Sequence[Place] = (),
    **how: Unpack[Playing],
) -> list[Bass]:
    """Returns the presets that play the notes of the real ones among the basses `like`, or an example's.

    Each plays the notes of its own technique, if there are any. taken: files and folders, whose names no preset gets.
    Raises ValueError for a preset without any of the pitches.
    """
    notes = [note for bass in like if not bass.rendered for note in bass.notes] or example()
    names, found = names_of([*map(Path, taken), *map(Path, presets)]), list[Bass]()
    for preset in presets:
        bass = load_preset(preset)
        own = technique or own_technique(bass)
        alike = [note for note in notes if note.technique == own] or notes
        made = render_notes(bass, alike, technique=own, **how)
        if not made:
            raise ValueError(f"{preset}: it has none of the pitches of {taken[0] if taken else 'the example'}")
        found += basses(names[Path(preset)], made, rendered=True)
    return found


def names_of(paths: Sequence[Path]) -> dict[Path, str]:
    """Names basses by the last part of their folders, files and presets, or by the whole path where two are equal."""
    short = {path: one_line(path.resolve().name if path.is_dir() else path.stem) for path in paths}
    taken = Counter(short.values())
    return {path: name if taken[name] == 1 else one_line(os.fspath(path)) for path, name in short.items()}
