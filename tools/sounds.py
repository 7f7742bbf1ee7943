"""Renders the sounds of README and the site, docs/sounds/*.ogg, from their scores in docs/sounds/sounds.toml.

python tools/sounds.py [folder]

The same sources and the same libvorbis give the same bytes, on all processors of one kind.
"""

from __future__ import annotations

import argparse
import io
import tempfile
import tomllib
from pathlib import Path
from typing import Any

import numpy as np
import soundfile
from numpy.typing import NDArray

from livebass import load_preset, loudness, quality_with, render_to_file, score_of
from livebass.cli.demos import ready_for
from livebass.rows.techniques import TECHNIQUE_ROWS
from livebass.rows.units import note_number
from livebass.score.score import Score
from livebass.sound.audiofile import CHUNK, OGG_SERIAL, read_sound, with_ogg_serial

TABLE = Path(__file__).parents[1] / "docs" / "sounds" / "sounds.toml"
RATE, SECONDS = 48_000, 5.0  # of a file
QUALITY, LOUDNESS = "studio", -25.0  # and LUFS
FADE = 0.25  # s, at the end
COMPRESSION = 0.2  # of the Vorbis encoder, 0 to 1; needs soundfile 0.13
BEFORE = 0.01  # s: a technique's key is pressed so long before its note


def sounds() -> list[dict[str, Any]]:
    """Returns the rows of sounds.toml, in playing order."""
    return list(tomllib.loads(TABLE.read_text("utf-8"))["sound"])


def score(sound: dict[str, Any]) -> Score:
    """Returns the score of a row: its notes, and the key switches of their techniques."""
    sixteenth, played = 15.0 / sound["tempo"], []
    for at, length, name, velocity, *technique in sound["notes"]:
        start, long = BEFORE + at * sixteenth, length * sixteenth
        played.append((start, long, note_number(name), velocity))
        if technique:
            (key,) = TECHNIQUE_ROWS[technique[0]].modo
            played.append((start - BEFORE, long + BEFORE, key, 100))
    return score_of(played, RATE, name=sound["title"])


def rendered(sound: dict[str, Any], quality: str = QUALITY) -> NDArray[np.float64]:
    """Returns a row's sound (n,) at RATE, SECONDS long, full scale 1; it ends in a fade."""
    with tempfile.TemporaryDirectory() as folder:
        made = Path(folder) / "sound.wav"
        bass = ready_for("techniques", load_preset(sound["preset"]))  # with keys that switch techniques
        render_to_file(bass, score(sound), made, quality=quality_with(quality), rate=RATE, bits="float", tail=SECONDS)
        whole = read_sound(made, "sound", 10 * SECONDS, (RATE, RATE)).samples[: round(SECONDS * RATE), 0]
    fade = round(FADE * RATE)
    whole[-fade:] *= np.cos(np.linspace(0, np.pi / 2, fade)) ** 2
    return whole * 10 ** ((LOUDNESS - loudness(whole, RATE)) / 20)


def encoded(sound: NDArray[np.float64]) -> bytes:
    """Returns a sound (n,) as an Ogg Vorbis file."""
    file = io.BytesIO()
    with soundfile.SoundFile(
        file, "w", RATE, 1, "VORBIS", format="OGG", compression_level=COMPRESSION
    ) as writer:  # fmt: skip
        for start in range(0, len(sound), CHUNK):
            writer.write(sound[start : start + CHUNK])
    return with_ogg_serial(file.getvalue(), OGG_SERIAL)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path, nargs="?", default=TABLE.parent)
    folder = parser.parse_args().folder
    try:
        for sound in sounds():
            (folder / sound["file"]).write_bytes(encoded(rendered(sound)))
    except OSError as error:
        raise SystemExit(f"{error.filename}: {error.strerror}") from None


if __name__ == "__main__":
    main()
