"""Finds single notes: in recordings, by their pitch and the words in their names, or by rendering a preset.

Words in the name of a file, and of the folders that contain it below the given one, tell its dynamic (pp p mp mf f
ff, soft medium hard, v1 or v100, or a number that grows with the level), its technique (fingers, pick, slap, pop or
mute), its string, whether that is open or stopped, and other kinds of sound (release, scrape, and dead notes and
harmonics, which are not compared): names.py. If no name tells the dynamic, the level does.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from os import PathLike, fspath
from pathlib import Path

import numpy as np

from livebass.engine.engine import Engine
from livebass.lab.comparison.distance import shape
from livebass.lab.comparison.measures import Measures, measure
from livebass.lab.comparison.names import (
    DEFAULT_TECHNIQUE,
    NOTE,
    SILENCE,
    TECHNIQUES,
    info_of_name,
    is_quiet,
    strength,
    words_of,
)
from livebass.lab.identification.partials import Recording, RecordingError, find_takes, pitch_of, read_recording
from livebass.model.instrument import Instrument, note_frequency
from livebass.model.quality import QUALITIES
from livebass.preset.load import load_preset
from livebass.rows.arrays import Floats
from livebass.rows.bounds import either, one_of, refusal, within
from livebass.rows.units import cents
from livebass.score.score import score_of

SOUNDS = {".wav", ".flac", ".ogg", ".aif", ".aiff"}
OTHERS = {".mp3", ".m4a", ".aac", ".wma", ".opus", ".caf", ".webm", ".mp4"}  # of a folder with none of SOUNDS
PITCHES = (25.0, 500.0)  # Hz, for recordings
BEFORE = 0.03  # s to keep before the attack of a note
LONGEST = 6.0  # s of a note
SHORTEST = 0.1  # s of a note
SPREAD = 6.0  # dB from the softest to the loudest notes: less counts as one dynamic
VELOCITIES = (30, 127)  # of the softest and the hardest dynamic
ONLY = 100  # velocity, if there is one dynamic
HELD = 3.5  # s, for a rendered note
RELEASED, AFTER = 1.0, 0.3  # s: the release of a note rendered for its release; the time kept after it
RATE = 48_000  # Hz, for rendered notes


@dataclass(frozen=True, eq=False)
class Note:
    """One note, or one noise of a hand."""

    name: str  # of the file or the rendered note
    sound: Floats  # (n,), full scale 1
    rate: int  # Hz
    pitch: float  # Hz; 0 without pitch
    technique: str = DEFAULT_TECHNIQUE
    kind: str = NOTE  # or another of names.KINDS
    dynamic: str = ""  # its name; "" if not yet known
    rank: int = 0  # of the dynamic, 0 the softest
    place: str = ""  # words of the name other than dynamic and take: equal for notes of one key
    open: bool | None = None  # whether the string is open; None: unknown
    string: str = ""  # as the name tells it (names.py)

    @cached_property
    def measures(self) -> Measures:
        """The figures of the note."""
        return measure(self.sound, self.rate, self.pitch)

    @cached_property
    def shape(self) -> Floats:
        """Its levels over time and bands."""
        return shape(self.sound, self.rate)


def measure_notes(
    paths: Iterable[str | PathLike[str]], technique: str | None = None, left_out: list[str] | None = None
) -> list[Note]:
    """Returns the notes of recordings, sound files or folders of them, each with `measures`.

    technique: fingers, pick, slap, pop or mute; by default taken from names, else fingers. A file may hold several
    notes of one dynamic. Files of a folder without a pitched note are skipped, and named in `left_out`. Raises
    RecordingError, one line with the name, for a file that cannot be read, for a folder without sound files and, if
    nothing else is given, for a file without a pitched note.
    """
    notes: list[Note] = []
    for each in paths:
        path = Path(fspath(each))
        files = sounds_in(path) if path.is_dir() else [path]
        if not files:
            raise RecordingError(f"{path}: has no sound file, such as {either(sorted(SOUNDS))}")
        unheard = []
        found: list[Note] = []
        for file in files:
            parts = (file.stem,) if file == path else file.relative_to(path).with_suffix("").parts
            heard = _of_file(file, parts, technique)
            found += heard
            unheard += [] if heard else [str(file)]
        if not found:
            raise RecordingError(
                f"{path}: no note of {SHORTEST:g} s with a pitch of {PITCHES[0]:g} to {PITCHES[1]:g} Hz is heard in it"
            )
        notes += found
        if left_out is not None:
            left_out += unheard
    return _by_dynamics(notes)


def sounds_in(folder: Path) -> list[Path]:
    """Returns the sound files in a folder and its subfolders, sorted."""
    files = sorted(folder.rglob("*"))
    return [p for p in files if p.suffix.lower() in SOUNDS] or [p for p in files if p.suffix.lower() in OTHERS]


def _of_file(file: Path, parts: Sequence[str], technique: str | None) -> list[Note]:
    names = info_of_name(parts)
    recording = read_recording(file, silent=True)
    first = Note(
        str(file), recording.sound, recording.rate, 0.0, technique or names.technique, names.kind,
        dynamic=names.dynamic, place=names.place, string=names.string, open=names.open,
    )  # fmt: skip
    if names.kind != NOTE:
        return [first]
    heard = _with_pitch(recording, first) if recording.sound.any() else []
    return heard or ([replace(first, kind=SILENCE)] if is_quiet(parts[-1]) else [])


def _with_pitch(recording: Recording, first: Note) -> list[Note]:
    notes = []
    end = 0.0
    for take in find_takes(recording, 0.0, LONGEST):
        begin, end = max(take.start_s - BEFORE, end), take.start_s + take.duration_s
        pitch = pitch_of(take, *PITCHES) if take.duration_s >= SHORTEST else None
        if pitch is not None:
            sound = recording.sound[round(begin * take.rate) : round(end * take.rate)]
            notes.append(replace(first, sound=sound, pitch=pitch))
    return notes


def _by_dynamics(notes: list[Note]) -> list[Note]:
    """Sets the dynamic and its rank of each note: by names if all have one, else by numbers, else by level."""
    plucked = [n for n in notes if n.kind == NOTE]
    if not plucked:
        return notes
    if not all(n.dynamic for n in plucked):
        names = _dynamic_numbers(plucked) or _by_level(plucked)
        plucked = [replace(n, dynamic=name) for n, name in zip(plucked, names, strict=True)]
    order = sorted({n.dynamic for n in plucked}, key=strength)
    plucked = [replace(n, rank=order.index(n.dynamic)) for n in plucked]
    return plucked + [n for n in notes if n.kind != NOTE]


def _level(note: Note) -> float:
    start = note.sound[: round(0.5 * note.rate)]
    return 10 * math.log10(float(np.mean(start**2)) + 1e-30)


def _dynamic_numbers(notes: Sequence[Note]) -> list[str] | None:
    """Returns the number in each name with which the level grows at every pitch, if all have such a number."""
    words = [[w for w in words_of(Path(n.name).stem) if w.isdigit()] for n in notes]
    count = {len(w) for w in words}
    if len(count) != 1 or not count - {0}:
        return None
    levels = np.array([_level(n) for n in notes])
    best: tuple[float, list[str]] | None = None
    for i in range(count.pop()):
        numbers = np.array([float(w[i]) for w in words])
        if not 2 <= len(set(numbers)) <= 16:
            continue
        grown = [
            np.sign(levels[b] - levels[a])
            for a in range(len(notes))
            for b in range(len(notes))
            if numbers[a] < numbers[b] and abs(cents(notes[a].pitch / notes[b].pitch)) < 50
        ]
        if len(grown) >= 2 and np.mean(grown) > 0.8 and (best is None or np.mean(grown) > best[0]):
            best = float(np.mean(grown)), [str(int(n)) for n in numbers]
    return best and best[1]


def _by_level(notes: Sequence[Note]) -> list[str]:
    """Returns soft, medium and hard by thirds of the level range, or one name for all if it is small."""
    levels = np.array([_level(n) for n in notes])
    low, high = float(levels.min()), float(levels.max())
    if high - low < SPREAD:
        return ["hard"] * len(notes)
    return [("soft", "medium", "hard")[min(2, int(3 * (level - low) / (high - low)))] for level in levels]


def render_notes(
    preset: str | Instrument,
    like: Sequence[Note],
    *,
    velocities: Sequence[int] | None = None,
    takes: int = 2,
    quality: str = "studio",
    technique: str | None = None,
    seed: int = 0,
) -> list[Note]:
    """Returns notes of a preset, a name, file or bass: the pitches and number of dynamics of `like`, `takes` of each.

    technique: by which the notes are compared, by default the preset's own. velocities: of the dynamics, from soft to
    hard; by default from 30 to 127 over the dynamics of `like`. Each note is played alone, by a player with its own
    `seed`; one per pitch is released after 1 s. Pitches that the bass cannot play are skipped. Raises PresetError, and
    ValueError for an invalid quality, velocity or number of takes.
    """
    bass = load_preset(preset) if isinstance(preset, str) else preset
    one_of("quality", quality, QUALITIES)
    plucked = [n for n in like if n.kind == NOTE]
    count = 1 + max((n.rank for n in plucked), default=0)
    speeds = list(velocities) if velocities is not None else spread_velocities(count)
    within("takes", takes, 1, 16, whole=True)
    if not speeds or any(not 1 <= v <= 127 for v in speeds) or sorted(speeds) != speeds:
        raise refusal("velocities", "from 1 to 127, from soft to hard", speeds)
    engine = Engine(bass, QUALITIES[quality], RATE, seed)
    played = technique or own_technique(bass)
    keys = sorted({key_of(n) for n in plucked})
    keys = [key for key in keys if strings_of_key(bass, key)]
    notes = []
    for key in keys:
        for rank, velocity in enumerate(speeds):
            for take in range(takes):
                number = seed + 1 + take + takes * (rank + len(speeds) * key)
                sound, is_open = play_alone(engine.another(number), key, velocity)
                notes.append(
                    Note(f"{bass.name} {key} v{velocity}", sound, RATE, note_frequency(key), played, "note",
                         f"v{velocity}", rank, str(key), is_open)
                )  # fmt: skip
        middle = speeds[len(speeds) // 2]
        sound, _ = play_alone(engine.another(seed), key, middle, RELEASED, AFTER)
        released = sound[round(RELEASED * RATE) :]
        notes.append(Note(f"{bass.name} {key} released", released, RATE, note_frequency(key), played, "release",
                          f"v{middle}", place=str(key)))  # fmt: skip
    return notes


def spread_velocities(count: int) -> list[int]:
    """Returns the velocities of `count` dynamics, from soft to hard."""
    return [ONLY] if count == 1 else [round(float(v)) for v in np.linspace(*VELOCITIES, count)]


def strings_of_key(bass: Instrument, key: int) -> list[int]:
    """Returns the indices of the strings that have `key`."""
    both = enumerate(zip(bass.strings, bass.necks, strict=True))
    return [i for i, (s, n) in both if 0 <= key - s.open_note <= len(n.fret_positions)]


def own_technique(bass: Instrument) -> str:
    """Returns the technique of a bass by itself, one of names.TECHNIQUES; pops of a slapped bass count as slaps."""
    player = bass.player
    if player.technique == "slap":
        return "slap"
    if player.palm_resistance > 0:
        return "mute"
    return player.stroke if player.stroke in TECHNIQUES else DEFAULT_TECHNIQUE


def key_of(note: Note) -> int:
    """Returns the MIDI number of the nearest key."""
    return round(69 + cents(note.pitch / 440) / 100)


def play_alone(engine: Engine, key: int, velocity: int, held: float = HELD, tail: float = 0.0) -> tuple[Floats, bool]:
    """Returns one note, `held` (s) plus a `tail` (s), strings summed, (n,); and whether the string is open."""
    score = score_of([(0.0, held, key, velocity)], RATE)
    events = engine.another(engine.seed).play_messages(score.frames, score.messages)
    sound = np.concatenate([block.sum(axis=0) for block in engine.play(score, tail)])
    return sound, not events["fret"].any()
