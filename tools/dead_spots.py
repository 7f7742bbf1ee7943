"""Draws a bass's dead spots: how long the fundamental of every note rings (T60), by string and fret.

python tools/dead_spots.py jazz-finger dead-spots.png
"""

from __future__ import annotations

import argparse

import matplotlib as mpl
import numpy as np

mpl.use("Agg")  # needs no display

import matplotlib.pyplot as plt
from errors import clear_errors

from livebass.lab.analysis.motion import t60
from livebass.model.instrument import Instrument, speaking
from livebass.model.modes import dampings, frequencies
from livebass.preset.load import load_preset


def decays(bass: Instrument, string: int) -> tuple[list[float], list[float]]:
    """Returns the fundamental's frequency (Hz) and T60 (s), by fret."""
    neck = bass.necks[string]
    notes = [speaking(bass.strings[string], neck, k) for k in range(len(neck.fret_positions) + 1)]
    return [float(frequencies(s, 1)[0]) for s in notes], [float(t60(dampings(s, 1))[0]) for s in notes]


def draw(bass: Instrument, picture: str) -> None:
    """Draws T60 over frets and over frequency, and the neck's conductance at some frets."""
    figure, axes = plt.subplots(3, 1, figsize=(9, 10), layout="constrained")
    by_fret, by_note, neck = axes
    for i, string in enumerate(bass.strings):
        nu, seconds = decays(bass, i)
        by_fret.semilogy(seconds, "o-", markersize=4, label=string.name)
        by_note.loglog(nu, seconds, "o-", markersize=4, label=string.name)
    by_fret.set(xlabel="fret", ylabel="T60 of the fundamental (s)", title=bass.name)
    by_note.set(xlabel="Hz", ylabel="T60 of the fundamental (s)")
    for axis in (by_fret.yaxis, by_note.yaxis, by_note.xaxis):
        axis.set_major_formatter("{x:g}")
        axis.set_minor_formatter("{x:g}")
    by_fret.set_xticks(range(0, len(bass.necks[0].fret_positions) + 1, 2))
    grid = np.geomspace(30, 4000, 3000)
    for fret in (k for k in (0, 3, 5, 7, 12) if k <= len(bass.necks[-1].fret_positions)):
        conductance = speaking(bass.strings[-1], bass.necks[-1], fret).admittance.at(grid).real
        neck.semilogx(grid, conductance * 1e3, label=f"fret {fret}" if fret else "nut")
    neck.set(xlabel="Hz", ylabel="conductance of the neck (mm/s/N)")
    for axis in axes:
        axis.legend()
        axis.grid(alpha=0.3)
    figure.savefig(picture, dpi=110)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("preset", nargs="?", default="jazz-finger", help="name or file; default: jazz-finger")
    parser.add_argument("picture", nargs="?", default="dead-spots.png", help="default: dead-spots.png")
    options = parser.parse_args()
    with clear_errors("dead_spots.py"):
        draw(load_preset(options.preset), options.picture)


if __name__ == "__main__":
    main()
