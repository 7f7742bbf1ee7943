#!/usr/bin/env python3
"""Compares two checkouts of livebass: does the same input give the same bytes, and how fast?

    python tools/compare.py OTHER_CHECKOUT            compare sounds and results byte for byte
    python tools/compare.py OTHER_CHECKOUT --speed    compare speed, running both in turn

Both run with this Python and its packages, each in its own processes, through the command line and the public
interface. Compared are: a 30 s random MIDI file with bends, pedals and controllers in several presets; random takes in
each MIDI mode, with key switches and controllers; the demo of every preset in each quality; the instrument files of all
presets; scores played by the page's module; the paper's cases A, B, C, oblique and fretless, and its statements. The
exit status is 1 if something differs. Equality holds per kind of processor: compare on one machine.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import os
import resource
import statistics
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator
from pathlib import Path

import mido
import numpy as np

HERE = Path(__file__).resolve().parent.parent
QUALITIES = ("live", "studio", "reference")
CASES = {
    "A": ["--apex", "0.87mm", "--contact-rate", "4MHz"],
    "B": ["--apex", "3.6mm", "--contact-rate", "8MHz"],
    "C": ["--apex", "7.8mm", "--contact-rate", "16MHz"],
    "oblique": ["--apex", "3.8mm", "--angle", "35deg", "--contact-rate", "8MHz"],
}
SONGS = (
    ("jazz-finger", "live"), ("slap", "studio"), ("fretless", "live"), ("paper-bass", "live"), ("muted", "reference"),
    ("flatwound", "live"), ("precision-finger", "studio"),
)  # fmt: skip

TAKES = (
    ("jazz-finger", "alike"), ("slap", "strings"), ("fretless", "mpe"), ("flatwound", "alike"), ("slap", "alike"),
    ("jazz-finger", "strings"), ("precision-finger", "mpe"), ("five-string", "alike"),
)  # fmt: skip


def random_song(path: Path, seconds: float = 30.0, seed: int = 9) -> None:
    """Writes a MIDI file of random notes, bends, pedal, volume and pluck positions."""
    rng = np.random.default_rng(seed)
    track = mido.MidiTrack([mido.Message("program_change", program=33)])
    held: list[int] = []
    ticks = 960  # ticks a second at 120 beats a minute and 480 ticks a beat
    times = np.sort(rng.integers(0, int(seconds * ticks), 320))
    for wait in np.diff(times, prepend=0).tolist():
        kind = int(rng.integers(0, 12))
        if kind < 6 or not held:
            held.append(int(rng.integers(26, 66)))
            message = mido.Message("note_on", note=held[-1], velocity=int(rng.integers(1, 128)))
        elif kind < 9:
            message = mido.Message("note_off", note=held.pop(int(rng.integers(0, len(held)))))
        elif kind < 10:
            message = mido.Message("pitchwheel", pitch=int(rng.integers(-8192, 8192)))
        else:
            control = int(rng.choice([7, 11, 16, 64, 64, 120, 121]))
            message = mido.Message("control_change", control=control, value=int(rng.integers(0, 128)))
        track.append(message.copy(time=wait))
    mido.MidiFile(type=0, tracks=[track], ticks_per_beat=480).save(str(path))


def random_techniques(path: Path, mode: str, seconds: float = 20.0, seed: int = 5) -> None:
    """Writes a MIDI file, marked as a take, of random notes with key switches, controllers, wheels and pressure.

    mode: "alike" for one channel, "strings" for mode 4 with one channel per string, "mpe" for one channel per note.
    """
    rng = np.random.default_rng(seed)
    track = mido.MidiTrack([mido.MetaMessage("text", text="as played by livebass")])
    track.append(mido.Message("program_change", program=33))
    channels = {"alike": [0], "strings": [0, 1, 2, 3], "mpe": list(range(1, 9))}[mode]
    if mode == "strings":
        track.append(mido.Message("control_change", control=126, value=4))
    elif mode == "mpe":
        track += [mido.Message("control_change", control=c, value=v) for c, v in ((101, 0), (100, 6), (6, 8))]
    held: list[tuple[int, int]] = []
    ticks = 960
    times = np.sort(rng.integers(ticks // 10, int(seconds * ticks), 420))
    for wait in np.diff(times, prepend=0).tolist():
        kind, channel = int(rng.integers(0, 20)), int(rng.choice(channels))
        if kind < 8 or not held:
            note = int(rng.integers(0, 20)) if kind < 3 and channel == 0 else int(rng.integers(28, 64))
            held.append((channel, note))
            velocity = int(rng.integers(1, 128))
            message = mido.Message("note_on", channel=channel, note=note, velocity=velocity)
        elif kind < 14:
            channel, note = held.pop(int(rng.integers(0, len(held))))
            velocity = int(rng.integers(0, 128))
            message = mido.Message("note_off", channel=channel, note=note, velocity=velocity)
        elif kind < 16:
            message = mido.Message("pitchwheel", channel=channel, pitch=int(rng.integers(-8192, 8192)))
        elif kind < 17:
            message = mido.Message("aftertouch", channel=channel, value=int(rng.integers(0, 128)))
        else:
            numbers = [1, 3, 4, 5, 7, 9, 11, 16, 17, 18, 64, 65, 68, 74, *range(103, 110)]
            value = int(rng.integers(0, 128))
            message = mido.Message("control_change", channel=channel, control=int(rng.choice(numbers)), value=value)
        track.append(message.copy(time=wait))
    mido.MidiFile(type=0, tracks=[track], ticks_per_beat=480).save(str(path))


def livebass(
    checkout: Path, *arguments: object, program: str | None = None, fine: tuple[int, ...] = (0,), **environment: str
) -> str:
    """Runs a checkout's command line, or `program`, and returns its output. Exits if its status is not in `fine`."""
    start = ["-c", program] if program else ["-m", "livebass"]
    env = {**os.environ, "PYTHONPATH": str(checkout), **environment}
    line = [sys.executable, *start, *map(str, arguments)]
    done = subprocess.run(line, env=env, cwd=checkout, capture_output=True, text=True, check=False)
    if done.returncode not in fine:
        sys.exit(f"{checkout}: {' '.join(line[1:4])} ...: status {done.returncode}: {done.stderr.strip()}")
    return done.stdout


def digest(path: Path) -> str:
    """Hashes a file's bytes; for an .npz, its arrays without the computing time."""
    h = hashlib.sha256()
    if path.suffix == ".npz":
        with np.load(path) as data:
            for key in sorted(set(data.files) - {"wall_s"}):
                h.update(key.encode() + str(data[key].dtype).encode() + str(data[key].shape).encode())
                h.update(np.ascontiguousarray(data[key]).tobytes())
    else:
        h.update(path.read_bytes())
    return h.hexdigest()[:16]


def outputs(checkout: Path, song: Path, folder: Path, quick: bool) -> Iterator[tuple[str, str]]:
    """Yields (name, hash) of every output compared."""
    for quality in QUALITIES[: 1 if quick else 3]:
        into = folder / quality
        livebass(checkout, "render", "--all-presets", into, "-q", quality)
        yield from ((f"demo {quality} {f.name}", digest(f)) for f in sorted(into.iterdir()))
    for preset, quality in SONGS[: 3 if quick else None]:
        out = folder / f"song-{preset}.wav"
        livebass(checkout, "render", song, "-p", preset, "-q", quality, "--format", "wav", "--bits", "float", "-o", out)
        yield f"song {quality} {preset}", digest(out)
    for preset, mode in TAKES[: 3 if quick else None]:
        take, out = song.with_name(f"{mode}.mid"), folder / f"take-{mode}-{preset}.wav"
        livebass(checkout, "render", take, "-p", preset, "--format", "wav", "--bits", "float", "-o", out)
        yield f"take {mode} {preset}", digest(out)
    for name, found in json.loads(livebass(checkout, program=FILES)).items():
        yield f"instrument file {name}", found
    for name, found in json.loads(livebass(checkout, program=PAGE)).items():
        yield f"page {name}", found
    for name, options in CASES.items():
        into = folder / f"case-{name}"
        livebass(checkout, "simulate", "-p", "paper-g", "--at", "0.64", "--analyse", *options, "-o", into)
        yield from ((f"case {name} {f.name}", digest(f)) for f in sorted(into.iterdir()))
    into = folder / "fretless"
    fretless = ["-p", "paper-fretless", "--apex", "3.6mm", "--at", "0.64", "--duration", "300ms"]
    livebass(checkout, "simulate", *fretless, "-o", into)
    yield from ((f"case fretless {f.name}", digest(f)) for f in sorted(into.iterdir()))
    if not quick:
        livebass(checkout, "study", "claims", "--json", folder / "claims.json", fine=(0, 1))  # 1: some fail
        yield "study claims --json", digest(folder / "claims.json")


FILES = """
import hashlib, json
from livebass import load_preset, preset_names
from livebass.kernels.bass.instrument import FILE
from livebass.plugin import instrument
image = getattr(instrument, "image_file", instrument.instrument_file)  # older versions kept the image itself
first = FILE.fields["name"][1]  # older ones had other words before it
print(json.dumps({n: hashlib.sha256(image(load_preset(n))[first:-8]).hexdigest()[:16] for n in preset_names()}))
"""
PAGE = """
import hashlib, json, runpy, sys
sys.path.insert(0, "tests")
test = runpy.run_path("tests/unit/web/test_module.py")
songs = {n: test["score_of"](test[n], test["RATE"]) for n in ("HARD", "TECHNIQUES")}
print(json.dumps({f"{preset} {name}": hashlib.sha256(test["in_wasm"](preset, score).tobytes()).hexdigest()[:16]
                  for preset in ("jazz-finger", "slap") for name, score in songs.items()}))
"""
TIMING = """
import sys, time, json
from livebass import Engine, QUALITIES, load_preset, score_of
def seconds(preset, quality, notes):
    bass, taken = load_preset(preset), []
    for _ in range(4):
        engine = Engine(bass, QUALITIES[quality], 48000, workers=1)
        score = score_of(notes, 48000)
        began = time.process_time()
        frames = sum(block.shape[1] for block in engine.play(score, 0.0))
        taken.append((time.process_time() - began) / (frames / 48000))
    return min(taken[1:])
four = [(0.5 * k, 0.45, note, 127) for k in range(4) for note in (28, 33, 38, 43)]
print(json.dumps({
    "case B's string, hard, reference": seconds("paper-g", "reference", [(0.0, 1.0, 43, 110)]),
    "case B's string, hard, live": seconds("paper-g", "live", [(0.0, 1.0, 43, 110)]),
    "four strings, live": seconds("slap", "live", four),
    "four strings, studio": seconds("jazz-finger", "studio", four),
    "fretless, live": seconds("fretless", "live", [(0.0, 0.5, 45, 110), (0.5, 0.5, 52, 100)]),
    "paper's fretless, reference": seconds("paper-fretless", "reference", [(0.0, 0.3, 43, 60)]),
}))
"""


def timings(checkout: Path) -> dict[str, float]:
    """Returns processor time per second of sound, the best of three runs in one process."""
    return dict(json.loads(livebass(checkout, program=TIMING)))


def compile_time(checkout: Path, folder: Path) -> float:
    """Returns the processor time (s) of a first note with an empty kernel cache, minus a second note's."""
    spent = []
    for _ in range(2):
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        note = ["render", "--note", "G2", "--duration", "0.1", "-o", folder / "note.wav"]
        livebass(checkout, *note, NUMBA_CACHE_DIR=str(folder / "cache"))
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
        spent.append(after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime)
    return spent[0] - spent[1]


def compare_outputs(other: Path, quick: bool) -> bool:
    """Prints a line for each output; returns whether all are equal."""
    equal = True
    with tempfile.TemporaryDirectory() as place:
        song = Path(place) / "song.mid"
        random_song(song)
        for mode in {mode for _, mode in TAKES}:
            random_techniques(song.with_name(f"{mode}.mid"), mode)
        results = []
        for name, checkout in (("other", other), ("this", HERE)):
            folder = Path(place) / name
            folder.mkdir()
            results.append(dict(outputs(checkout, song, folder, quick)))
    for name in sorted({*results[0], *results[1]}):
        a, b = (r.get(name, "missing") for r in results)
        equal = equal and a == b
        print(f"{'same  ' if a == b else 'DIFFERS'}  {a}  {b if a != b else '':16}  {name}")
    print("all outputs are equal" if equal else "outputs differ")
    return equal


def compare_speed(other: Path, runs: int) -> None:
    """Runs both checkouts in turn, `runs` times; prints the medians and their ratio."""
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place)
        take: dict[Path, list[dict[str, float]]] = {other: [], HERE: []}
        timings(other), timings(HERE)  # compile first
        for _ in range(runs):
            for checkout, found in take.items():
                found.append(timings(checkout))
        median: Callable[[Path, str], float] = lambda c, name: statistics.median(run[name] for run in take[c])  # noqa: E731
        print(f"{'s of work per s of sound':34}{'other':>10}{'this':>10}{'ratio':>8}")
        for name in take[HERE][0]:
            a, b = median(other, name), median(HERE, name)
            print(f"{name:34}{a:10.5f}{b:10.5f}{b / a:8.3f}")
        compiles: dict[Path, list[float]] = {other: [], HERE: []}
        for k in range(3):
            for checkout, each in compiles.items():
                into = folder / f"compile-{k}-{checkout == HERE}"
                into.mkdir()
                each.append(compile_time(checkout, into))
        a, b = (statistics.median(compiles[c]) for c in (other, HERE))
        print(f"{'first compile, s':34}{a:10.2f}{b:10.2f}{b / a:8.3f}")


def main() -> int:
    """Runs the comparison that the arguments ask for."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("other", type=Path, help="the checkout to compare with, such as a git worktree")
    parser.add_argument("--speed", action="store_true", help="compare speed instead of bytes")
    parser.add_argument("--runs", type=int, default=5, help="runs of each checkout for --speed (default 5)")
    parser.add_argument("--quick", action="store_true", help="fewer outputs: one quality, three presets, no statements")
    arguments = parser.parse_args()
    other = arguments.other.resolve()
    if not (other / "livebass" / "__init__.py").is_file():
        parser.error(f"{other}: no checkout of livebass")
    if arguments.speed:
        compare_speed(other, arguments.runs)
        return 0
    return 0 if compare_outputs(other, arguments.quick) else 1


if __name__ == "__main__":
    sys.exit(main())
