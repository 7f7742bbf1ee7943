"""Short songs as MIDI files."""

from __future__ import annotations

import io
from typing import Any

import mido


def midi_file(*tracks: list[Any], kind: int = 1) -> bytes:
    file, out = mido.MidiFile(type=kind), io.BytesIO()
    for messages in tracks:
        file.tracks.append(mido.MidiTrack(messages))
    file.save(file=out)
    return out.getvalue()


def song_of(notes: list[int], length: int = 240) -> list[Any]:
    """Consecutive notes of `length` ticks (480 a quarter) each."""
    found = [mido.MetaMessage("track_name", name="Bass"), mido.Message("program_change", program=33, channel=2)]
    for note in notes:
        found += [
            mido.Message("note_on", note=note, velocity=90, channel=2),
            mido.Message("note_off", note=note, channel=2, time=length),
        ]
    return found
