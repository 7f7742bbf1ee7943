"""Measures how long commands of an installed release wheel take from start to end, beside FluidSynth.

    .venv/bin/python tools/wheel_times.py VENV/bin/livebass --runs 10

A note, a minute of slap bass and the export of plugins; FluidSynth (`apt install fluidsynth fluid-soundfont-gm`)
renders the same note and the same file. All take turns, so that they have the same share of a busy machine.
"""

from __future__ import annotations

import argparse
import os
import resource
import shutil
import statistics
import subprocess
import tempfile
import time
from pathlib import Path

import mido

FONT = Path("/usr/share/sounds/sf2/FluidR3_GM.sf2")
BAR = (28, 28, 40, 28, 31, 43, 33, 45, 28, 40, 28, 38, 33, 45, 35, 47)  # sixteenths of a slap line
BEATS, TICKS = 110, 480  # a minute; a beat


def write_midi(path: Path, notes: list[tuple[int, int, int]]) -> None:
    """Writes notes (key, velocity, ticks) one after the other, for General MIDI's Slap Bass 1."""
    track = mido.MidiTrack([mido.MetaMessage("set_tempo", tempo=mido.bpm2tempo(BEATS))])
    track.append(mido.Message("program_change", program=36))
    for key, velocity, ticks in notes:
        track.append(mido.Message("note_on", note=key, velocity=velocity))
        track.append(mido.Message("note_off", note=key, time=ticks))
    mido.MidiFile(type=0, ticks_per_beat=TICKS, tracks=[track]).save(path)


def main() -> None:
    """Runs all commands in turns and prints the median and the least time of each."""
    parser = argparse.ArgumentParser(description="Measures commands of an installed wheel beside FluidSynth.")
    parser.add_argument("livebass", type=Path, help="the command, in the environment in which the wheel is installed")
    parser.add_argument("--runs", type=int, default=10, help="default: 10")
    given = parser.parse_args()
    program, fluid = str(given.livebass.resolve()), ["fluidsynth", "-ni", "-r", "48000", "-F"]
    with tempfile.TemporaryDirectory() as folder:
        note, slap, out = Path(folder, "note.mid"), Path(folder, "slap.mid"), str(Path(folder, "out.wav"))
        write_midi(note, [(43, 100, round(3 * BEATS / 60 * TICKS))])
        write_midi(slap, [(BAR[k % 16], 90 + 37 * k % 38, TICKS // 4) for k in range(BEATS * 4)])
        commands = {
            "render --note G2": [program, "render", "--note", "G2", "-o", out],
            "FluidSynth, that note": [*fluid, out, str(FONT), str(note)],
            "render slap.mid -q live": [program, "render", str(slap), "-q", "live", "-o", out],
            "FluidSynth, slap.mid": [*fluid, out, str(FONT), str(slap)],
            **{f"export {kind}": [program, "export", kind, "-o", folder] for kind in ("lv2", "clap", "vst3")},
        }
        if not (shutil.which("fluidsynth") and FONT.exists()):
            commands = {name: command for name, command in commands.items() if not name.startswith("Fluid")}
        times: dict[str, list[tuple[float, float]]] = {name: [] for name in commands}
        for _ in range(given.runs):
            for name, command in commands.items():
                began, before = time.perf_counter(), processor_time()
                subprocess.run(
                    command, check=True, cwd=folder, env={"HOME": folder, "PATH": os.environ["PATH"]},
                    stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
                )  # fmt: skip
                times[name].append((time.perf_counter() - began, processor_time() - before))
    print(f"{'':26}{'median':>8}{'least':>8}{'processor':>11}   (s, {given.runs} runs)")
    for name, found in times.items():
        wall, processor = zip(*found, strict=True)
        print(f"{name:26}{statistics.median(wall):8.2f}{min(wall):8.2f}{statistics.median(processor):11.2f}")


def processor_time() -> float:
    """The time (s) that the processors worked for the processes that ended: other work changes it little."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


if __name__ == "__main__":
    main()
