"""Prints how near `livebass identify` comes to recordings of open strings, compared with the shipped presets.

python tools/identified.py open-e.wav [open-e-again.wav ...] -p jazz-finger
python tools/identified.py --list strings.txt         # one string per line: PRESET RECORDING ...

For each string it prints the distance (dB) over 1 s and over 3 s from the first recording to the identified preset, to
the initial preset and to the nearest shipped one, each at the best of four velocities, and the median of
ln(T60 of the render / T60 of the recording) over partials 1 to 24. As in `livebass compare`, the distance is the mean
difference of third-octave levels over time.
"""

from __future__ import annotations

import argparse
import math
import shlex
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

import numpy as np
from errors import clear_errors

from livebass.engine.render import render_to_array
from livebass.lab.comparison.distance import HOP, WINDOW, between, shape
from livebass.lab.comparison.measures import attack
from livebass.lab.comparison.ringing import ringing
from livebass.lab.identification.identify import identify
from livebass.lab.identification.partials import find_takes, read_recording
from livebass.lab.identification.preset_text import new_preset
from livebass.model.instrument import Instrument
from livebass.model.quality import QUALITIES
from livebass.preset.load import load_preset, preset_names
from livebass.rows.arrays import Floats
from livebass.score.score import single_note

VELOCITIES = (30, 60, 90, 120)
SPANS = (1.0, 3.0)  # s
RATE = 44_100  # Hz, of renders
PARTIALS = 24  # their T60 are compared


def played(bass: Instrument, note: int, velocity: int, seconds: float) -> Floats:
    """Returns the note as `bass` plays it, (n,)."""
    score = single_note(note, velocity, seconds + 0.3, RATE)
    return np.asarray(render_to_array(bass, score, QUALITIES["live"], tail=0.0).sum(axis=0))


@dataclass(frozen=True)
class Near:
    """A preset's distances (dB) from a recording, one for each of SPANS, and the velocity of each."""

    distances: tuple[float, ...]
    velocities: tuple[int, ...]


def nearness(notes: dict[int, Floats], recorded: Floats) -> Near:
    """Compares notes, by velocity, with a recorded note; a recording shorter than a span is compared whole."""
    whole = WINDOW + (len(recorded) - 1) * HOP
    found = [min((between(x, recorded, min(span, whole)), v) for v, x in notes.items()) for span in SPANS]
    return Near(tuple(d for d, _ in found), tuple(v for _, v in found))


def shapes(notes: dict[int, Floats]) -> dict[int, Floats]:
    """Returns the notes' levels."""
    return {v: shape(sound, RATE, SPANS[-1]) for v, sound in notes.items()}


def notes_of(bass: Instrument, note: int) -> dict[int, Floats]:
    """Returns `note` as `bass` plays it, by velocity."""
    return {v: played(bass, note, v, max(SPANS)) for v in VELOCITIES}


@lru_cache
def shipped_notes(preset: str, note: int) -> dict[int, Floats] | None:
    """Returns the levels of a shipped preset's `notes_of`; None if it lacks the note."""
    bass = load_preset(preset)
    low, high = bass.note_range
    return shapes(notes_of(bass, note)) if low <= note <= high else None


def ln_t60(sound: Floats, recorded: tuple[Floats, int], f0: float) -> float:
    """Returns the median of ln(T60 of `sound` / recorded T60) over the partials that both have."""
    mine, real = (
        {round(nu / f0): t for nu, t in zip(rings.frequency, rings.t60, strict=True)}
        for rings in (ringing(samples, rate, f0) for samples, rate in ((sound, RATE), recorded))
    )
    both = [j for j in mine if j in real and j <= PARTIALS]
    return float(np.median([math.log(mine[j] / real[j]) for j in both])) if both else math.nan


def row(preset: str, paths: Sequence[Path], folder: Path) -> tuple[str, ...]:
    """Identifies the string in `paths`, starting from `preset`; returns the cells of its line."""
    bass = load_preset(preset)
    found = identify(paths, bass)
    file = folder / "identified.toml"
    file.write_text(new_preset(preset, found.string.name, found, paths))
    take = find_takes(read_recording(paths[0]), 0.0, 10.0)[0]
    sound = take.sound[attack(take.sound, take.rate) :]
    recorded = shape(sound, take.rate, SPANS[-1])
    note = found.string.open_note
    mine, start = notes_of(load_preset(str(file)), note), notes_of(bass, note)
    near = nearness(shapes(mine), recorded)
    shipped = {name: nearness(notes, recorded) for name in preset_names() if (notes := shipped_notes(name, note))}
    f0 = found.law.fundamental
    cells = [paths[0].stem, found.string.name, _cell(near), _cell(nearness(shapes(start), recorded))]
    for k in range(len(SPANS)):
        best = min(shipped, key=lambda name: shipped[name].distances[k])
        cells.append(f"{shipped[best].distances[k]:.2f} {best}")
    first = (notes[VELOCITIES[0]] for notes in (mine, start))
    t60 = (ln_t60(x[attack(x, RATE) :], (sound, take.rate), f0) for x in first)
    return (*cells, *(f"{value:+.2f}" for value in t60))


def _cell(near: Near) -> str:
    return " / ".join(f"{d:.2f} v{v}" for d, v in zip(near.distances, near.velocities, strict=True))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("recording", nargs="*", type=Path, help="sound files of one open string")
    parser.add_argument(
        "-p", "--preset", default="jazz-finger", help="name or file to begin from; default: jazz-finger"
    )
    parser.add_argument("--list", type=Path, help="file with a string a line: a preset and its recordings")
    options = parser.parse_args()
    strings = [(options.preset, options.recording)] if options.recording else []
    if options.list:
        lines = [shlex.split(line, comments=True) for line in options.list.read_text().splitlines()]
        strings += [(line[0], [Path(p) for p in line[1:]]) for line in lines if line]
    head = ("recording", "string", "identified 1 s / 3 s", "its start", "shipped 1 s", "shipped 3 s", "ln T60", "start")
    print(" | ".join(head))
    with clear_errors("identified.py"), tempfile.TemporaryDirectory() as folder:
        for preset, paths in strings:
            print(" | ".join(row(preset, paths, Path(folder))), flush=True)


if __name__ == "__main__":
    main()
