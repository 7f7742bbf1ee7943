"""A map of a neck: what a standard pluck does at every string and fret, and where a string frets out.

Each note is played by the bass's own player on strings at rest, as a MIDI note of one velocity on that string, and
held. The map counts its contacts in a stated time from the release, or from a thumb's strike, and says how long they
go on: buzz that lasts.

Each note is computed by itself, in threads of this process, in other processes or on a Dask cluster: the same map.
"""

from __future__ import annotations

import hashlib
import threading
from collections.abc import Callable, Generator, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import closing
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from typing import TYPE_CHECKING, Any

import numpy as np

from livebass.engine.engine import Engine
from livebass.engine.prepare import play_frames
from livebass.kernels.player.words import NOTE_STRING, word_of
from livebass.kernels.string.records import PLUCK
from livebass.lab.experiment.grid import Axis, program, varied
from livebass.live.thread.sight import see_contact
from livebass.model.instrument import Instrument
from livebass.model.quality import QUALITIES, Quality
from livebass.model.rest import lies_on
from livebass.report.picture import figure, image, shown_text
from livebass.report.text import columns, csv_text
from livebass.rows.arrays import Floats
from livebass.rows.bounds import within
from livebass.system.cores import core_count

if TYPE_CHECKING:
    from livebass.lab.experiment.workers import Compute

RATE = 48_000  # Hz
VELOCITY, DURATION = 100, 0.5  # of the standard pluck; s that its contacts are counted
NOTE_ON, PIECE = 0x90, 2400  # frames played between two reads of the contacts
LOG = 4096  # contacts that a string keeps until they are read
MAX_MAPS = 1000  # of one sweep
LETTERS = "AB"  # of maps side by side
PANELS = (("contacts", "contacts in {:g} s", 1.0), ("lasts", "last contact, ms after the release", 1e3))
LIGHT = 0.6  # part of the greatest value from which numbers are white


@dataclass(frozen=True)
class Cell:
    """One note of a map: a string at a fret, and its contacts."""

    string: str  #: its name
    fret: int  #: that is pressed; 0 is open
    on: int  #: fret that the string lies on at rest: `fret`, or a higher one that chokes the note
    contacts: int  #: so often the string meets a fret or the board
    hardest: float  #: fret that it hits hardest, over a board m from the nut; NaN without contacts
    speed: float  #: m/s, of that hit; 0 without contacts
    lasts: float  #: s from the release to the last contact; 0 without contacts


@dataclass(frozen=True)
class FretMap:
    """A bass's neck. `fret_map` returns it."""

    name: str  #: of the bass
    velocity: int
    duration: float  #: s
    strings: tuple[tuple[Cell, ...], ...]  #: from the lowest, each from its open note up
    fretless: bool = False  #: a cell's `fret` is a place on a bare board, so many semitones up

    @property
    def steps(self) -> str:
        """Names what a row of the table stands for, and a column of the picture."""
        return "semitone" if self.fretless else "fret"

    def values(self, quantity: str) -> Floats:
        """A quantity of every cell, such as "contacts": (strings, frets + 1)."""
        return np.array([[getattr(cell, quantity) for cell in row] for row in self.strings], np.float64)


class _Watched(Engine):
    contacts = LOG


@dataclass(frozen=True, eq=False)
class Note:
    """One note of a map, as a point of a sweep."""

    bass: Instrument
    string: int  # from the lowest
    fret: int
    velocity: int
    duration: float  # s
    quality: Quality

    @property
    def name(self) -> str:
        """For messages."""
        place = self.bass.necks[self.string].note_text(self.fret)
        return f"{self.bass.name}: string {self.bass.strings[self.string].name} {place}"

    @property
    def work(self) -> Note:
        """Itself: a worker solves it."""
        return self

    @cached_property
    def digest(self) -> str:
        """Of everything that the result depends on."""
        return hashlib.sha256(f"{program()}\n{self!r}".encode()).hexdigest()[:32]


def solve_note(note: Note) -> dict[str, float]:
    """The numbers of a note's `Cell`, in any process or thread. Raises ValueError for a neck that nobody could play."""
    with PREPARING:
        engine = _prepared(note.bass, note.quality).another()
    return _played(engine, note.string, note.fret, note.velocity, note.duration)


PREPARING = threading.Lock()


@lru_cache(maxsize=2)
def _prepared(bass: Instrument, quality: Quality) -> _Watched:
    """An engine, kept from one note to the next."""
    return _Watched(bass, quality, RATE)


def fret_map(
    bass: Instrument,
    *,
    velocity: int = VELOCITY,
    duration: float = DURATION,
    quality: Quality = QUALITIES["live"],
    progress: Callable[[float], None] | None = None,
) -> FretMap:
    """Plucks every note of a bass. Call it in the main thread.

    Args:
        bass: The bass.
        velocity: Of the notes, 1 to 127.
        duration: Time from the release in which contacts count, s.
        quality: One of `QUALITIES`.
        progress: Called with the fraction done, 0 to 1.

    Raises:
        ValueError: A value out of its limits, or a neck that nobody could play.
    """
    return fret_maps(notes_of([bass], velocity, duration, quality), in_threads, progress)[0]


def notes_of(
    basses: Sequence[Instrument], velocity: int = VELOCITY, duration: float = DURATION,
    quality: Quality = QUALITIES["live"],
) -> list[Note]:  # fmt: skip
    """Every note of basses, from the lowest string and its open note up. Raises ValueError."""
    within("velocity", velocity, 1, 127, whole=True)
    within("duration", duration, 0.01, 10.0, "s")
    return [
        Note(bass, i, fret, velocity, duration, quality)
        for bass in basses
        for i in range(len(bass.strings))
        for fret in range(bass.frets + 1)
    ]


def varied_basses(preset: str, axes: Sequence[Axis]) -> list[Instrument]:
    """A preset's bass for every combination of its keys' values, named by them. Raises ValueError."""
    found = varied(preset, axes, MAX_MAPS)
    return [replace(bass, name=f"{bass.name}, {name}") for name, bass in found]


def in_threads(notes: Sequence[Note], workers: int | None = None) -> Generator[tuple[Note, dict[str, float]]]:
    """Computes notes in threads of this process, by default one per core; yields each with its result."""
    with ThreadPoolExecutor(workers or core_count()) as pool:
        running = [pool.submit(solve_note, note) for note in notes]
        try:
            yield from ((note, future.result()) for note, future in zip(notes, running, strict=True))
        finally:
            pool.shutdown(cancel_futures=True)


def fret_maps(
    notes: Sequence[Note], compute: Compute, progress: Callable[[float], None] | None = None
) -> list[FretMap]:
    """The maps of `notes`, as `notes_of` gives them, one for each bass.

    Args:
        notes: The notes.
        compute: As in workers.py.
        progress: Called with the fraction done, 0 to 1.
    """
    once = {note.digest: note for note in notes}  # those of equal basses are the same
    found: dict[str, Cell] = {}
    with closing(compute(list(once.values()))) as done:
        for note, values in done:
            string, on, contacts = note.bass.strings[note.string], int(values["on"]), int(values["contacts"])
            measured = [values[name] for name in ("hardest", "speed", "lasts")]
            found[note.digest] = Cell(string.name, note.fret, on, contacts, *measured)
            if progress:
                progress(len(found) / len(once))
    rows: dict[int, dict[int, list[Cell]]] = {}
    for note in notes:
        rows.setdefault(id(note.bass), {}).setdefault(note.string, []).append(found[note.digest])
    first = {id(note.bass): note for note in notes}
    return [
        FretMap(
            note.bass.name,
            note.velocity,
            note.duration,
            tuple(map(tuple, rows[of].values())),
            all(neck.fretless for neck in note.bass.necks),
        )
        for of, note in first.items()
    ]


def _played(engine: Engine, i: int, fret: int, velocity: int, duration: float) -> dict[str, float]:
    """Plays a note on string `i` of a fresh engine."""
    bass, voice = engine.instrument, engine.voices[i]
    string, neck = bass.strings[i], bass.necks[i]
    key = string.open_note + fret
    words = [word_of(NOTE_STRING, key, float(i)), word_of(NOTE_ON, key, velocity)]
    events = engine.play_words(np.zeros(len(words), np.int64), np.array(words, np.int64))
    events = events[events["string"] == i]
    record, contacts = voice.record[0], list[tuple[float, float, float]]()
    release = int(record["pull"]) if PLUCK in events["kind"] else 0
    frames, taken = release + round(duration * engine.rate), 0
    for first in range(0, frames, PIECE):
        events = events[play_frames(voice, engine.pool.records[i], events, np.zeros(min(PIECE, frames - first))) :]
        steps, logged = record["numerator"] / record["denominator"], int(record["logged"])
        for k in range(max(taken, logged - LOG), logged):
            one = voice.log[k % LOG : k % LOG + 1]
            place = see_contact(engine.bass.address, i, one.ctypes.data)
            contacts.append((float(one["speed"][0]), float(place), float(one["step"][0] / steps - release)))
        taken = logged
    speed, hardest, _ = max(contacts, default=(0.0, np.nan, 0.0))
    lasts = max((frame for *_, frame in contacts), default=0.0) / engine.rate
    measured = {"hardest": float(hardest), "speed": speed, "lasts": max(0.0, lasts)}
    return {"on": lies_on(string, neck, fret), "contacts": taken, **measured}


def table(maps: Sequence[FretMap]) -> str:
    """Maps as text, a line for each fret: contacts, and ms that they last; or the fret that the string lies on.

    Two maps are side by side, more one below the other.
    """
    if len(maps) > len(LETTERS):
        return "\n".join(table([one]) for one in maps)
    cells = [row for one in maps for row in one.strings]
    names = [""] if len(maps) == 1 else [f"{letter}: " for letter in LETTERS]
    titles = [
        f"{name}{one.name}: contacts in {one.duration:g} s at velocity {one.velocity}, and how long they last"
        for name, one in zip(names, maps, strict=False)
    ]
    beside = [name[:1] for name, one in zip(names, maps, strict=False) for _ in one.strings]
    head = [maps[0].steps, *(f"{row[0].string} {which}".strip() for row, which in zip(cells, beside, strict=True))]
    lines = [
        [f"{fret or 'open'}", *(_text(row[fret]) if fret < len(row) else "" for row in cells)]
        for fret in range(max(map(len, cells)))
    ]
    return "\n".join([*titles, *(line.rstrip() for line in columns([head, *lines]))]) + "\n"


def _text(cell: Cell) -> str:
    if cell.on != cell.fret:
        return f"lies on {cell.on}"
    return f"{cell.contacts} {1e3 * cell.lasts:4.0f} ms" if cell.contacts else "-"


def csv(maps: Sequence[FretMap]) -> str:
    """Maps as comma-separated values, a row for each string and fret."""
    head = ["bass", "string", "fret", "lies_on", "contacts", "hardest", "hardest_speed_m_per_s", "lasts_s"]
    rows = []
    for one in maps:
        for cell in (cell for row in one.strings for cell in row):
            hardest = None if np.isnan(cell.hardest) else cell.hardest
            where = [one.name, cell.string, cell.fret, cell.on]
            rows.append([*where, cell.contacts, hardest, cell.speed, cell.lasts])
    return csv_text(head, rows)


def picture(maps: Sequence[FretMap], kind: str = "png") -> bytes:
    """A PNG or SVG of maps side by side: contacts above, how long they last below; choked notes are dark."""
    frets, count = (max(one.values("contacts").shape[k] for one in maps) for k in (1, 0))
    drawn = figure(1.6 + 0.42 * frets * len(maps), 1.2 + 2 * (0.9 + 0.34 * count))
    grid = drawn.subplots(len(PANELS), len(maps), squeeze=False)
    for panels, (quantity, title, scale) in zip(grid, PANELS, strict=True):
        most = max(1.0, *(scale * one.values(quantity).max() for one in maps))
        for panel, one in zip(panels, maps, strict=True):
            mesh = _draw(panel, one, scale * one.values(quantity), most)
            panel.set_title(shown_text(f"{one.name}: {title.format(one.duration)}"), fontsize="small")
        drawn.colorbar(mesh, ax=list(panels))
    why = f"velocity {maps[0].velocity}; dark: the note frets out, and lies on the {maps[0].steps} named"
    drawn.suptitle(shown_text(why), fontsize="small")
    return image(drawn, kind)


def _draw(panel: Any, one: FretMap, shown: Floats, most: float) -> Any:
    """Draws `shown`, (strings, frets + 1), with colours up to `most`; returns what the colour bar needs."""
    from matplotlib.patches import Rectangle

    mesh = panel.imshow(shown, cmap="YlOrRd", vmin=0, vmax=most, aspect="auto", origin="lower")
    panel.set(xlabel=one.steps, xticks=range(shown.shape[1]))
    panel.set_yticks(range(len(one.strings)), [row[0].string for row in one.strings])
    for y, row in enumerate(one.strings):
        for x, cell in enumerate(row):
            text, colour = "", "white" if shown[y, x] > LIGHT * most else "black"
            if cell.on != cell.fret:
                panel.add_patch(Rectangle((x - 0.5, y - 0.5), 1, 1, color="0.25"))
                text, colour = f"→{cell.on}", "white"
            elif cell.contacts:
                text = f"{shown[y, x]:.0f}"
            panel.text(x, y, text, ha="center", va="center", fontsize=6, color=colour)
    return mesh
