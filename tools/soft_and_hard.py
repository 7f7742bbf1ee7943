"""Draws README.md's picture: an open string plucked softly and hard, as spectrograms and as hits on the frets.

python tools/soft_and_hard.py docs/soft-and-hard.png
"""

from __future__ import annotations

import argparse
import io
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
from numpy.typing import NDArray

mpl.use("Agg")  # needs no display

import matplotlib.pyplot as plt
from PIL import Image  # matplotlib needs it too

from livebass import load_preset
from livebass.engine.solve import output_signal, solve_trial
from livebass.model.modes import grazing_apex
from livebass.model.trial import PluckRequest, checked_trial, speaking_string
from livebass.sound.analysis import spectrogram_db

PRESET, STRING = "jazz-finger", "G"
PLUCKS = (("softly", 40), ("hard", 120))  # and MIDI velocity
SECONDS, TOP_HZ, RANGE_DB = 0.6, 6000.0, 60.0
RATE, STEPS = 48_000, 200  # Hz; contact steps a sample
WINDOW, HOP = 2048, 128  # samples
COLOURS = 256  # in the file


def plucked(velocity: int) -> tuple[float, NDArray[np.float64], NDArray[np.float64], NDArray[np.int64]]:
    """Returns a pluck's apex (m), the pickups' sound (n,), and the time (s) and fret of each hit, (k,)."""
    bass = load_preset(PRESET)
    s = speaking_string(bass, STRING, 0)
    player = bass.player
    at = player.pluck_position * s.length
    force = player.softest * (player.hardest / player.softest) ** ((velocity - 1) / 126)  # as for a note
    apex = min(force * grazing_apex(s, at), player.greatest_apex)
    requested = PluckRequest(STRING, apex=apex, at=at, duration=SECONDS + WINDOW / RATE)
    trial = checked_trial(bass, s, requested, None, STEPS * RATE, RATE)
    motion = solve_trial(trial)
    fret = np.asarray(trial.speaking.contact_fret)[motion.contact_index]
    before = np.zeros(WINDOW // 2)  # the string at rest; the release is in the middle of the first window
    return apex, np.concatenate([before, output_signal(trial, bass.output)]), motion.contact_time_s, fret


def draw(picture: Path) -> None:
    """Writes the PNG `picture`."""
    plt.rcParams |= {"font.size": 10, "axes.spines.top": False, "axes.spines.right": False}
    figure, axes = plt.subplots(
        2, 2, figsize=(9, 4.6), sharex=True, sharey="row", height_ratios=(3, 2), layout="constrained"
    )
    image: Any = None
    for (above, below), (how, velocity) in zip(axes.T, PLUCKS, strict=True):
        apex, sound, time_s, fret = plucked(velocity)
        shown = spectrogram_db(sound, RATE, WINDOW, HOP, RANGE_DB)
        image = above.pcolormesh(
            shown.time_s - WINDOW / 2 / RATE, shown.frequency_hz / 1e3, shown.level_db.T,
            cmap="magma", vmin=-RANGE_DB, vmax=0.0, shading="gouraud", rasterized=True,
        )  # fmt: skip
        above.set(title=f"{how}: pulled {apex * 1e3:.1f} mm", ylim=(0, TOP_HZ / 1e3))
        below.plot(time_s, fret, linestyle="none", marker="o", markersize=2.5, markeredgewidth=0, color="#b5367a")
        below.set(xlabel="time (s)", xlim=(0, SECONDS), ylim=(0, 20.9), yticks=(1, 5, 10, 15, 20))
        below.grid(axis="y", alpha=0.25)
        hits = f"{time_s.size} hits" if time_s.size else "no fret is touched"
        below.text(0.98, 0.93, hits, transform=below.transAxes, ha="right", va="top")
    axes[0, 0].set_ylabel("frequency (kHz)")
    axes[1, 0].set_ylabel("fret that is hit")
    figure.colorbar(image, ax=axes[0], label="dB", pad=0.01)
    drawn = io.BytesIO()
    figure.savefig(drawn, dpi=140)
    Image.open(drawn).convert("RGB").quantize(COLOURS).save(picture, "PNG", optimize=True)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("picture", type=Path)
    picture = parser.parse_args().picture
    try:
        draw(picture)
    except OSError as error:
        raise SystemExit(f"{picture}: {error.strerror}") from None


if __name__ == "__main__":
    main()
