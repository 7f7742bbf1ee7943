"""The notes of a recorded bass: pitch, string, layer of force, and doubts about the recording.

A string is told by its name in the name of a file, such as stringE_open_soft_take1.flac, or by the order of a guided
recording (guide.py). Otherwise strings.py finds it by inharmonicity.
"""

from __future__ import annotations

import hashlib
import math
import re
from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from os import PathLike
from pathlib import Path
from typing import NamedTuple

import numpy as np

from livebass.lab.comparison.measures import attack, begins_late
from livebass.lab.comparison.names import NOTE, SILENCE
from livebass.lab.comparison.notes import Note, key_of, measure_notes, strings_of_key
from livebass.lab.fitting.guide import Step
from livebass.lab.identification.doubts import clipped_tops
from livebass.lab.identification.partials import RecordingError
from livebass.model.instrument import Instrument
from livebass.rows.units import note_name, one_line

SHORTEST = 1.3  # s of a note
FEWEST = 6  # different notes, counted by pitch, string and layer
NORMALIZED = 2.0  # dB from one layer to the next, at the most, if levels were set by layer


class Place(NamedTuple):
    """A note to play: all takes of it are alike."""

    key: int  # MIDI
    string: str  # its name; "": at the lowest fret
    rank: int  # of the layer, 0 the softest


@dataclass(frozen=True, eq=False)
class Recorded:
    """The notes of one bass, played by one technique."""

    name: str
    technique: str
    takes: dict[Place, tuple[Note, ...]]
    layers: tuple[str, ...]  # names, from soft to hard
    releases: tuple[Note, ...]
    quiet: tuple[Note, ...]  # recordings of the electronics alone
    normalized: bool  # the levels of layers tell nothing
    doubts: tuple[str, ...]
    digest: str


def read_notes(
    paths: Sequence[str | PathLike[str]], technique: str | None = None, guide: Sequence[Step] = ()
) -> Recorded:
    """Reads the notes of files and folders; `guide`: the steps of a guided recording, in order.

    Raises RecordingError, one line, if there are too few notes or only one pitch.
    """
    left_out: list[str] = []
    notes = measure_notes(paths, technique, left_out)
    doubts = [f"no note with a pitch is heard in {_some(left_out)}"] if left_out else []
    plucked = [n for n in notes if n.kind == NOTE]
    plucked, said = _of_one_technique(plucked)
    doubts += said
    label = one_line(str(paths[0]))
    short = [n for n in plucked if n.sound.size - attack(n.sound, n.rate) < SHORTEST * n.rate]
    if short:
        doubts.append(f"{len(short)} notes are shorter than {SHORTEST:g} s and not used, such as {_of(short[0])}")
    plucked = [n for n in plucked if n not in short]
    strings, guided, said = _strings(plucked, guide)
    doubts += said
    plucked = guided or plucked
    takes: dict[Place, list[Note]] = {}
    for note, string in zip(plucked, strings, strict=True):
        takes.setdefault(Place(key_of(note), string, note.rank), []).append(note)
    if len(takes) < FEWEST:
        raise RecordingError(
            f"{label}: {len(takes)} different notes of {SHORTEST:g} s: at least {FEWEST} are needed, at several "
            "pitches and forces; `livebass fit --guide` says what to play"
        )
    if len({place.key for place in takes}) == 1:
        only = note_name(next(iter(takes)).key)
        raise RecordingError(f"{label}: all notes are {only}; at least two pitches are needed, better one per string")
    order = {n.rank: n.dynamic for n in plucked}
    ranks = {rank: k for k, rank in enumerate(sorted(order))}  # without the layers of what is left out
    made = {p._replace(rank=ranks[p.rank]): tuple(found) for p, found in sorted(takes.items())}
    layers = tuple(order[rank] for rank in ranks)
    normalized, said = _levels(made, layers)
    return Recorded(
        Path(paths[0]).resolve().stem, plucked[0].technique, made, layers,
        _of_kind(notes, "release"), _of_kind(notes, SILENCE), normalized,
        (*doubts, *said, *_defects(plucked)), _digest(made),
    )  # fmt: skip


def string_of(bass: Instrument, place: Place) -> int | None:
    """The index of the string that plays a place on this bass, or None."""
    able = strings_of_key(bass, place.key)
    if place.string:
        i = _string_index(bass, place.string)
        return i if i in able else None
    return max(able, key=lambda i: bass.strings[i].open_note, default=None)


def _string_index(bass: Instrument, string: str) -> int:
    """The index of the string with this name, or this number from the highest one; -1: there is none."""
    names = [s.name.casefold() for s in bass.strings]
    if string.casefold() in names:
        return names.index(string.casefold())
    return len(names) - int(string) if re.fullmatch(r"[0-9]{1,2}", string) and 1 <= int(string) <= len(names) else -1


def _of(note: Note) -> str:
    return one_line(Path(note.name).name)


def _some(files: Sequence[str]) -> str:
    more = f" and {len(files) - 1} more" if len(files) > 1 else ""
    return one_line(Path(files[0]).name) + more


def _of_one_technique(notes: list[Note]) -> tuple[list[Note], list[str]]:
    counts = Counter(n.technique for n in notes)
    if len(counts) < 2:
        return notes, []
    maximum, count = counts.most_common(1)[0]
    said = f"{len(notes) - count} notes played otherwise than by {maximum} are not used: --technique chooses"
    return [n for n in notes if n.technique == maximum], [said]


def _strings(notes: Sequence[Note], guide: Sequence[Step]) -> tuple[list[str], list[Note], list[str]]:
    """The name of each note's string, "" if unknown; the notes as the guide tells them, if it does; doubts."""
    named = [n.string for n in notes]
    files = {n.name for n in notes}
    if guide and len(files) == 1 and not any(named):
        heard, wanted = [key_of(n) for n in notes], [step.key for step in guide]
        if heard == wanted:
            guided = [
                replace(n, dynamic=step.force, rank=step.rank, open=step.fret == 0)
                for n, step in zip(notes, guide, strict=True)
            ]
            return [step.string for step in guide], guided, []
    missing = len(named) - sum(map(bool, named))
    if not missing:
        return named, [], []
    which = "of all notes" if missing == len(named) else f"of {missing} of {len(named)} notes"
    return (
        named,
        [],
        [f"the strings {which} are found by their inharmonicity: a name such as stringE_fret05_soft tells them"],
    )


def _levels(takes: dict[Place, tuple[Note, ...]], layers: Sequence[str]) -> tuple[bool, list[str]]:
    """True if the levels of the layers tell nothing, and then a doubt."""
    if len(layers) < 2:
        return True, [f"all notes have one force, {layers[0]}: how the bass answers the hand is as in the base preset"]
    levels = [
        float(np.median([_level(n) for p, notes in takes.items() if p.rank == rank for n in notes]))
        for rank in range(len(layers))
    ]
    growth = float(min(np.diff(levels)))
    if (levels[-1] - levels[0]) / (len(layers) - 1) >= NORMALIZED and growth > 0:
        return False, []
    shown = ", ".join(f"{name} {level - levels[0]:+.1f} dB" for name, level in zip(layers, levels, strict=True))
    return True, [f"the layers hardly grow in level ({shown}): normalised or compressed. Levels are not fitted"]


def _level(note: Note) -> float:
    start = attack(note.sound, note.rate)
    return 10 * math.log10(float(np.mean(note.sound[start:][: round(0.3 * note.rate)] ** 2)) + 1e-30)


def _defects(notes: Sequence[Note]) -> list[str]:
    clipped = [n for n in notes if clipped_tops(n.sound).size]
    late = [n for n in notes if begins_late(n.sound, n.rate)]
    kinds = (("clip", clipped, "as played"), ("begin within the attack", late, "fitted"))
    return [
        f"{len(found)} notes {what}, such as {_of(found[0])}: their attack is not {how}"
        for what, found, how in kinds
        if found
    ]


def _of_kind(notes: Iterable[Note], kind: str) -> tuple[Note, ...]:
    return tuple(n for n in notes if n.kind == kind)


def _digest(takes: dict[Place, tuple[Note, ...]]) -> str:
    digest = hashlib.sha256()
    for place, notes in takes.items():
        for note in notes:
            digest.update(repr((*place, note.rate, note.technique)).encode())
            digest.update(np.ascontiguousarray(note.sound, np.float32).tobytes())
    return digest.hexdigest()[:12]
