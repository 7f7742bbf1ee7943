"""Draws a sound file: waveform above, spectrogram over 70 dB below.

python tools/spectrogram.py demo.wav demo.png --top 8000 --title "slap"
"""

from __future__ import annotations

import argparse
from pathlib import Path

import matplotlib as mpl
import numpy as np
import soundfile

mpl.use("Agg")  # needs no display

import matplotlib.pyplot as plt

RANGE_DB = 70
WINDOW_S, OVERLAP = 0.012, 0.75  # short enough to tell an attack from the note that follows


def draw(sound_file: Path, picture: Path, top_hz: float, title: str) -> None:
    """Writes `picture` (PNG, PDF or SVG by its name) of `sound_file`, up to `top_hz`."""
    sound, rate = soundfile.read(sound_file, always_2d=True)
    mono = sound.mean(axis=1)
    window = max(64, round(WINDOW_S * rate))
    if len(mono) < window:
        raise SystemExit(f"{sound_file}: shorter than {WINDOW_S * 1e3:.0f} ms, too short for a picture")
    figure, (above, below) = plt.subplots(
        2, 1, figsize=(12, 7), sharex=True, height_ratios=(1, 3), layout="constrained"
    )
    above.plot(np.arange(len(mono)) / rate, mono, linewidth=0.4, color="black")
    above.set(ylabel="full scale", ylim=(-1, 1), title=title or sound_file.name)
    power, _, _, image = below.specgram(
        mono + 1e-12, NFFT=window, Fs=rate, noverlap=round(window * OVERLAP), pad_to=4 * window, cmap="magma"
    )
    loudest = 10 * np.log10(power.max())
    image.set_clim(loudest - RANGE_DB, loudest)
    below.set(xlabel="s", ylabel="Hz", xlim=(0, len(mono) / rate), ylim=(0, min(top_hz, rate / 2)))
    figure.colorbar(image, ax=below, label="dB", pad=0.01)
    figure.savefig(picture, dpi=110)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("sound", type=Path, help="WAV, FLAC or Ogg file")
    parser.add_argument("picture", type=Path, nargs="?", help="PNG, PDF or SVG; default: the sound's name, .png")
    parser.add_argument("--top", type=float, default=10_000.0, metavar="HZ", help="highest frequency shown")
    parser.add_argument("--title", default="", help="default: the sound's name")
    options = parser.parse_args()
    picture = options.picture or options.sound.with_suffix(".png")
    try:
        draw(options.sound, picture, options.top, options.title)
    except (OSError, RuntimeError, ValueError) as error:  # soundfile raises a RuntimeError
        raise SystemExit(f"{options.sound}: {error}") from None


if __name__ == "__main__":
    main()
