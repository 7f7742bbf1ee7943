"""Judges notes by a model of hearing: each beside the nearest real note of its pitch.

Zimtohrli (J. Alakuijala and others, github.com/google/zimtohrli) filters both sounds as the ear does and compares them;
it maps their difference to the mean opinion score (MOS) that people would give: 5 for no audible difference, 1 for a
bad one. Both notes begin with their attack, last equally long and are equally loud, as it expects of speech and music.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import PurePath
from typing import Any

import numpy as np

from livebass.lab.comparison.distance import between
from livebass.lab.comparison.listening import excerpt
from livebass.lab.comparison.notes import Note
from livebass.lab.comparison.summary import Bass, same_pitch
from livebass.report.picture import check_installed
from livebass.report.progress import Progress, steps
from livebass.report.text import columns, json_text
from livebass.rows.arrays import Floats
from livebass.rows.units import cents, note_name
from livebass.sound.analysis import loudness, resample

RATE = 48_000  # Hz, of the model
SECONDS = 2.0  # of a note
SHORTEST = 0.25  # s: shorter notes are not judged
LOUDNESS = -23.0  # LUFS
CANDIDATES = 8  # real notes, the nearest by their levels over time and bands, that the model hears for each note


@dataclass(frozen=True)
class Nearest:
    """A note and the real note that sounds most like it."""

    note: str
    pitch: float  # Hz
    dynamic: str
    real: str  # the bass
    real_note: str
    mos: float  # 1 to 5

    @property
    def title(self) -> str:
        """The note's name and dynamic."""
        return f"{note_name(round(69 + cents(self.pitch / 440) / 100))} {self.dynamic}".strip()


@dataclass(frozen=True)
class Ear:
    """One bass as the model hears it."""

    bass: str
    nearest: tuple[Nearest, ...]  # for each note that a real bass has, too

    @property
    def mos(self) -> float:
        """The median over its notes; NaN without any."""
        return float(np.median([n.mos for n in self.nearest])) if self.nearest else math.nan

    def lines(self) -> list[str]:
        """Returns lines that say it, a line per pitch and dynamic with its best take."""
        if not self.nearest:
            return [f"{self.bass}: no other real bass has its pitches"]
        scores = [n.mos for n in self.nearest]
        spread = f"{min(scores):.2f} to {max(scores):.2f}"
        head = f"{self.bass}: MOS {self.mos:.2f} in the median of {len(scores)} notes, {spread}"
        best: dict[tuple[int, str], Nearest] = {}
        for each in sorted(self.nearest, key=lambda n: -n.mos):
            best.setdefault((round(cents(each.pitch / 440) / 100), each.dynamic), each)
        rows = [(f"  {n.title}", f"{n.mos:.2f}", n.real, n.real_note) for _, n in sorted(best.items())]
        return [head, *columns(rows, 1)]


@dataclass(frozen=True)
class Hearing:
    """Basses as the model hears them."""

    basses: tuple[Ear, ...]

    def table(self) -> str:
        """Returns it as text."""
        return "\n\n".join("\n".join(each.lines()) for each in self.basses)

    def json(self) -> str:
        """Returns it as JSON."""
        return json_text({"basses": [
            {"name": e.bass, "mos": e.mos, "notes": [vars(n) for n in e.nearest]} for e in self.basses
        ]})  # fmt: skip


def check_hearing() -> None:
    """Raises LookupError, one line that says how to get it, without the model."""
    check_installed("--hear", "hear", ("zimtohrli", "scipy.signal"))


def judge() -> Callable[[Floats, Floats], float]:
    """Returns the model: the MOS of two sounds, (n,) each, at RATE. Raises LookupError without the extra `hear`."""
    check_hearing()
    import zimtohrli

    distance = zimtohrli.Pyohrli().distance
    return lambda one, other: float(zimtohrli.mos_from_zimtohrli(distance(one, other)))


def hearing(basses: Sequence[Bass], progress: Progress | None = None) -> Hearing:
    """Returns each bass beside the real ones among them, without itself, tracked by `progress`.

    Raises LookupError without the extra `hear`.
    """
    mos = judge()
    step = steps(progress, max(1, sum(len(bass.notes) for bass in basses)))
    made: dict[int, Floats] = {}

    def sound(note: Note) -> Floats:
        if id(note) not in made:
            made[id(note)] = _heard(note)
        return made[id(note)]

    found = []
    for bass in basses:
        real = [(other, note) for other in basses if not other.rendered and other.name != bass.name
                for note in other.notes]  # fmt: skip
        nearest = []
        for note in bass.notes:
            alike = [(other, n) for other, n in real if same_pitch(n.pitch, note.pitch)]
            alike.sort(key=partial(_apart, note))
            scores = []
            for other, n in alike[:CANDIDATES]:
                count = min(sound(note).size, sound(n).size)
                if count >= SHORTEST * RATE:
                    scores.append((mos(sound(note)[:count], sound(n)[:count]), other, n))
            if scores:
                best, other, n = max(scores, key=lambda score: score[0])
                nearest.append(
                    Nearest(_stem(note), note.pitch, note.dynamic, other.title, _stem(n), best)
                )  # fmt: skip
            step()
        found.append(Ear(bass.title, tuple(nearest)))
    return Hearing(tuple(found))


def _apart(note: Note, pair: tuple[Any, Note]) -> float:
    apart = between(note.shape, pair[1].shape)
    return math.inf if math.isnan(apart) else apart


def _heard(note: Note) -> Floats:
    """Returns a note from its attack on, at RATE and LOUDNESS."""
    sound = excerpt(note, SECONDS)
    if note.rate != RATE:
        sound = resample(sound, note.rate, RATE)
    level = loudness(sound, RATE)
    return sound * 10 ** ((LOUDNESS - level) / 20) if math.isfinite(level) else sound


def _stem(note: Note) -> str:
    return PurePath(note.name).stem
