#!/usr/bin/env python3
"""Compares the processor time of this checkout with another's, in turns, and prints the ratio for each job.

    git worktree add ../before COMMIT
    python tools/interleave.py ../before                  every job, the least of three runs each
    python tools/interleave.py ../before --runs 9 slap    jobs whose name contains "slap"

Both run with this Python. Their kernels are compiled first. Turns and the least time make the ratio steady on a machine
with other work; the times themselves are not.
"""

from __future__ import annotations

import argparse
import os
import random
import resource
import subprocess
import sys
import tempfile
from pathlib import Path

import mido

HERE = Path(__file__).resolve().parent.parent
TICKS, TEMPO = 480, 500_000  # a quarter note; microseconds each
Notes = list[tuple[float, float, int, int]]  # s, s, key, velocity


def slap_line(rng: random.Random) -> Notes:
    """A minute of sixteenths at 110 beats/min."""
    keys = (28, 31, 33, 35, 36, 40, 43, 45, 47, 48)
    return [(0.136 * k, 0.12, rng.choice(keys), rng.randint(50, 127)) for k in range(441)]


def walking_line(rng: random.Random) -> Notes:
    """Half a minute of quarter notes."""
    keys = (28, 31, 33, 35, 36, 38, 40, 41, 43)
    return [(0.45 * k, 0.4, rng.choice(keys), rng.randint(60, 100)) for k in range(67)]


JOBS = {
    "a minute of slap, live": (slap_line, "slap", "live"),
    "a minute of slap, studio": (slap_line, "slap", "studio"),
    "half a minute of walking line, live": (walking_line, "jazz-finger", "live"),
    "half a minute of walking line, studio": (walking_line, "jazz-finger", "studio"),
    "the same on a board, live": (walking_line, "fretless", "live"),
    "one note, live": (lambda _: [(0.0, 2.5, 33, 80)], "jazz-finger", "live"),
    "one note, reference": (lambda _: [(0.0, 2.5, 33, 80)], "jazz-finger", "reference"),
}


def write_midi(path: Path, notes: Notes) -> None:
    """Writes a MIDI file of notes."""
    track = mido.MidiTrack([mido.MetaMessage("set_tempo", tempo=TEMPO)])
    begins = [(begin, key, velocity) for begin, _, key, velocity in notes]
    ends = [(begin + length, key, 0) for begin, length, key, _ in notes]
    now = 0
    for seconds, key, velocity in sorted(begins + ends):
        tick = round(mido.second2tick(seconds, TICKS, TEMPO))
        track.append(mido.Message("note_on", note=key, velocity=velocity, time=tick - now))
        now = tick
    mido.MidiFile(ticks_per_beat=TICKS, tracks=[track]).save(path)


def run(tree: Path, *arguments: str) -> float:
    """Runs livebass from a tree; returns its processor time, s."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    environment = {**os.environ, "PYTHONPATH": str(tree)}
    subprocess.run(
        [sys.executable, "-m", "livebass", *arguments], cwd=tree, env=environment, check=True, stdout=subprocess.DEVNULL
    )
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("other", type=Path, help="the other checkout")
    parser.add_argument("--runs", type=int, default=3, help="of each job in each checkout; the least time counts (3)")
    parser.add_argument("jobs", nargs="*", default=[""], metavar="TEXT", help="only jobs whose name contains it")
    given = parser.parse_intermixed_args()
    trees = [given.other.resolve(), HERE]
    with tempfile.TemporaryDirectory() as folder:
        song, sound = Path(folder) / "song.mid", Path(folder) / "sound.wav"
        for name, (line, preset, quality) in JOBS.items():
            if not any(text in name for text in given.jobs):
                continue
            write_midi(song, line(random.Random(1)))
            arguments = ["render", str(song), "-o", str(sound), "--preset", preset, "--quality", quality]
            for tree in trees:
                run(tree, *arguments)  # compiles
            times = [[run(tree, *arguments) for tree in trees] for _ in range(given.runs)]
            other, own = map(min, zip(*times, strict=True))
            print(f"{name:40}{other:7.2f} s {own:7.2f} s {own / other:6.2f}", flush=True)


if __name__ == "__main__":
    main()
