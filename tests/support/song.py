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


def song_of(notes: list[int], length: int = 240, program: int = 33) -> list[Any]:
    """A bass with consecutive notes, as from `notes_of`."""
    begin = [mido.MetaMessage("track_name", name="Bass"), mido.Message("program_change", program=program, channel=2)]
    return begin + notes_of(notes, length)


def notes_of(notes: list[int], length: int = 240, channel: int = 2) -> list[Any]:
    """Consecutive notes of `length` ticks (480 a quarter) each."""
    kinds = (("note_on", 90, 0), ("note_off", 64, length))
    return [mido.Message(on, note=n, velocity=v, channel=channel, time=t) for n in notes for on, v, t in kinds]
