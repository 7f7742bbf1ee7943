"""Plays an SFZ file through sfizz, the player in the package pysfizz, with MIDI notes at any frame."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

import numpy as np

from support.needs import package

BLOCK = 480  # frames
PLAYER_VOLUME = -7.36  # dB of every sample through sfizz (pysfizz 0.1.3), whatever the SFZ file says


def through_sfizz(sfz: Path, notes: Iterable[tuple[float, float, int, int]], rate: int, seconds: float) -> np.ndarray:
    """The left channel (n,) of (start s, length s, note, velocity), played by sfizz in `seconds` at full volume.

    A copy of the SFZ file loads all samples into memory: loading while playing may leave a gap, by chance.
    """
    pysfizz = package("pysfizz")
    in_memory = sfz.with_name(f"memory-{sfz.name}")
    in_memory.write_text(sfz.read_text().replace("<control>", "<control>\nhint_ram_based=1"))
    try:
        player = pysfizz.Synth(rate, BLOCK)
        assert player.load_sfz_file(in_memory), f"{sfz}: refused by sfizz"
    finally:
        in_memory.unlink()
    synth = player._synth  # its own methods play one note at a time
    events = []
    for start, length, note, velocity in notes:
        events.append((round(start * rate), synth.note_on, note, velocity))
        events.append((round((start + length) * rate), synth.note_off, note, 0))
    events.sort(key=lambda e: e[0])
    blocks = []
    for begin in range(0, round(seconds * rate), BLOCK):
        while events and events[0][0] < begin + BLOCK:
            frame, act, note, velocity = events.pop(0)
            act(frame - begin, note, velocity)
        blocks.append(np.array(synth.render_block()[0], np.float64))
    return np.concatenate(blocks) / 10 ** (PLAYER_VOLUME / 20)
