"""Prints how near `livebass identify` comes to recordings of open strings, beside the shipped presets.

python tools/identified.py open-e.wav [--with open-e-again.wav] -p jazz-finger
python tools/identified.py --list strings.txt         # a string a line: [PRESET] RECORDING ...

For each string: the distance (dB) over 1 s and over 3 s from its first recording to the identified preset, to the
preset it began from and to the nearest shipped one, each at the best of four velocities, and the median of
ln(T60 of the render / T60 of the recording) over partials 1 to 24. The distance is that of levels in third octaves over
time, as loud as each other, in a range of 60 dB.
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

from livebass.arrays import Floats
from livebass.comparison.ringing import ringing
from livebass.engine.render import render_to_array
from livebass.identification.identify import identify, new_preset
from livebass.identification.partials import find_takes, read_recording
from livebass.model.instrument import Instrument
from livebass.model.quality import QUALITIES
from livebass.preset.load import load_preset, preset_names
from livebass.score.score import single_note

VELOCITIES = (30, 60, 90, 120)
SPANS = (1.0, 3.0)  # s
RATE = 44_100  # Hz, of renders
LOWEST, BANDS = 40.0, 24  # Hz, centre of the first third octave, and how many: up to 8 kHz
DEPTH = 60.0  # dB below the loudest cell
WINDOW, HOP = 0.1, 0.025  # s
PARTIALS = 24  # whose T60 are compared


def third_octaves(sound: Floats, rate: float, seconds: float) -> Floats:
    """Returns the levels (frames, BANDS), dB, of the first `seconds` of a sound (n,) that begins with its attack."""
    size, hop = round(WINDOW * rate), round(HOP * rate)
    padded = 4 * 2 ** math.ceil(math.log2(size))
    count = round((seconds - WINDOW) / HOP)
    needed = (count - 1) * hop + size
    sound = np.pad(sound[:needed], (0, max(0, needed - sound.size)))
    frames = sound[np.arange(count)[:, None] * hop + np.arange(size)] * np.hanning(size)
    power = np.abs(np.fft.rfft(frames, padded)) ** 2
    edges = LOWEST * 2 ** ((np.arange(BANDS + 1) - 0.5) / 3)
    places = np.round(edges * padded / rate).astype(int)
    below = np.concatenate([np.zeros((count, 1)), np.cumsum(power, axis=1)], axis=1)
    return np.asarray(10 * np.log10(below[:, places[1:]] - below[:, places[:-1]] + 1e-20))


def distance(a: Floats, b: Floats) -> float:
    """Returns the root mean square difference (dB) of levels `a` and `b` (frames, bands), each louder or softer."""
    a, b = a - a.max(), b - b.max()
    heard = (a > -DEPTH) | (b > -DEPTH)
    a, b = np.maximum(a, -DEPTH), np.maximum(b, -DEPTH)
    off = (a - b)[heard]
    return float(np.std(off))


def played(bass: Instrument, note: int, velocity: int, seconds: float) -> Floats:
    """Returns the note as `bass` plays it, from its attack on, (n,)."""
    score = single_note(note, velocity, seconds + 0.3, RATE)
    sound = render_to_array(bass, score, QUALITIES["live"], tail=0.0).sum(axis=0)
    return from_attack(sound, RATE)


def from_attack(sound: Floats, rate: int) -> Floats:
    """Returns `sound` (n,) from 5 ms before it first reaches a fifth of its peak."""
    first = int(np.argmax(np.abs(sound) > 0.2 * np.abs(sound).max()))
    return sound[max(0, first - round(0.005 * rate)) :]


@dataclass(frozen=True)
class Near:
    """How near a preset is to a recording: distances (dB), one for each of SPANS, and the velocity of each."""

    distances: tuple[float, ...]
    velocities: tuple[int, ...]


def nearness(notes: dict[int, Floats], recorded: tuple[Floats, int]) -> Near:
    """Compares notes, by velocity, with a recorded one (samples, rate)."""
    found = []
    for span in SPANS:
        length = min(span, recorded[0].size / recorded[1])
        heard = third_octaves(*recorded, length)
        found.append(min((distance(third_octaves(x, RATE, length), heard), v) for v, x in notes.items()))
    return Near(tuple(d for d, _ in found), tuple(v for _, v in found))


def notes_of(bass: Instrument, note: int) -> dict[int, Floats]:
    """Returns `note` as `bass` plays it, by velocity."""
    return {v: played(bass, note, v, max(SPANS)) for v in VELOCITIES}


@lru_cache
def shipped_notes(preset: str, note: int) -> dict[int, Floats] | None:
    """`notes_of` a shipped preset; None if it lacks the note."""
    bass = load_preset(preset)
    low, high = bass.note_range
    return notes_of(bass, note) if low <= note <= high else None


def ln_t60(sound: Floats, recorded: tuple[Floats, int], f0: float) -> float:
    """Returns the median of ln(T60 of `sound` / T60 recorded) over the partials that both have."""
    mine, real = (
        {round(nu / f0): t for nu, t in zip(rings.frequency, rings.t60, strict=True)}
        for rings in (ringing(samples, rate, f0) for samples, rate in ((sound, RATE), recorded))
    )
    both = [j for j in mine if j in real and j <= PARTIALS]
    return float(np.median([math.log(mine[j] / real[j]) for j in both])) if both else math.nan


def row(preset: str, paths: Sequence[Path], folder: Path) -> tuple[str, ...]:
    """Identifies the string of `paths` from `preset`, and returns the cells of its line."""
    bass = load_preset(preset)
    found = identify(paths, bass)
    file = folder / "identified.toml"
    file.write_text(new_preset(preset, found.string.name, found, paths))
    take = find_takes(read_recording(paths[0]), 0.0, 10.0)[0]
    recorded = from_attack(take.sound, take.rate), take.rate
    note = found.string.open_note
    mine, start = notes_of(load_preset(str(file)), note), notes_of(bass, note)
    near = nearness(mine, recorded)
    shipped = {name: nearness(notes, recorded) for name in preset_names() if (notes := shipped_notes(name, note))}
    f0 = found.law.fundamental
    cells = [paths[0].stem, found.string.name, _cell(near), _cell(nearness(start, recorded))]
    for k in range(len(SPANS)):
        best = min(shipped, key=lambda name: shipped[name].distances[k])
        cells.append(f"{shipped[best].distances[k]:.2f} {best}")
    t60 = (ln_t60(notes[VELOCITIES[0]], recorded, f0) for notes in (mine, start))
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
