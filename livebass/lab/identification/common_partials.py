"""The partials of one string in several takes, and the steps that leave out foreign material."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from livebass.lab.identification.doubts import left_out, other_note
from livebass.lab.identification.glide import Glide, glide_of, straighten
from livebass.lab.identification.partials import Partial, RecordingError, Take, track
from livebass.lab.identification.takes import Takes
from livebass.lab.identification.treatment import compressor_doubt, is_fade, shared_gain, without_fade

FEWEST = 4  # partials of a take
SPREAD = 0.02  # of f0: partials that scatter more about a stiff string's are not of one string
STIFFEST = 5e-4  # B of a low B string is 3e-4


def plausible(partials: Sequence[Partial], pitch: float) -> bool:
    """True if these can be partials of one stiff string: enough of them, near its law, and not only every second."""
    low = [p for p in partials if p.number <= 12]
    if len(partials) < FEWEST or len(low) < 3 or math.gcd(*(p.number for p in low)) > 1:
        return False
    squared = np.array([p.number**2 for p in low], dtype=np.float64)
    ratio = np.array([p.frequency / p.number for p in low]) / pitch
    slope = np.polyfit(squared, ratio, 1)[0]  # B / 2
    return bool(np.ptp(ratio - min(max(slope, 0.0), STIFFEST / 2) * squared) < SPREAD)


class Note(NamedTuple):
    """A take and its partials."""

    take: Take
    partials: list[Partial]
    glide: Glide | None = None  # removed from both


@dataclass(frozen=True)
class Heard:
    """The notes of one string at one pitch, and doubts about them."""

    pitch: float  # Hz
    modes: int  # partials to look for
    notes: tuple[Note, ...]
    doubts: tuple[str, ...]

    def note(self, take: Take, glide: Glide | None = None) -> Note | None:
        """The note in a take; None if its partials do not belong to one string."""
        partials = track(take.sound, take.rate, self.pitch, self.modes)
        return Note(take, partials, glide) if plausible(partials, self.pitch) else None


def find_partials(takes: Takes, modes: int) -> Heard:
    """Follows the partials of takes. Raises RecordingError if no take is of one string."""
    tracks = [(take, track(take.sound, take.rate, takes.pitch, modes)) for take in takes.takes]
    good = tuple(Note(take, partials) for take, partials in tracks if plausible(partials, takes.pitch))
    if good:
        return Heard(takes.pitch, modes, good, tuple(takes.doubts))
    name, maximum = takes.takes[0].name, max(len(partials) for _, partials in tracks)
    if maximum < FEWEST:
        partials = f"{maximum} partial{'s' * (maximum != 1)} of a string near {takes.pitch:.2f} Hz"
        raise RecordingError(f"{name}: {partials}, {FEWEST} are needed: noise, or no plucked string")
    why = f"what sounds is not one string near {takes.pitch:.2f} Hz; give its pitch with --note or --f0"
    raise RecordingError(f"{name}: {why}")


def steady(heard: Heard) -> Heard:
    """Removes from each note the glide that its partials share."""

    def straight(note: Note) -> Note:
        glide = glide_of(note.take, note.partials, heard.pitch)
        return (glide and heard.note(straighten(note.take, glide), glide)) or note

    return replace(heard, notes=tuple(map(straight, heard.notes)))


def cut_fades(heard: Heard) -> Heard:
    """Cuts off fades; doubts name them, and compressors."""
    notes, doubts = [], list(heard.doubts)
    for note in heard.notes:
        gain = shared_gain(note.take, note.partials, heard.pitch)
        if gain is not None and is_fade(gain, note.take):
            shorter, why = without_fade(note.take, gain)
            doubts.append(why)
            note = heard.note(shorter, note.glide) or note
        elif gain is not None:
            doubts.append(compressor_doubt(note.take, gain))
        notes.append(note)
    return replace(heard, notes=tuple(notes), doubts=tuple(doubts))


def alone(heard: Heard) -> Heard:
    """Leaves out notes that contain another one. Raises RecordingError if none remain."""
    beside = [(note, other_note(note.take, note.partials, heard.pitch)) for note in heard.notes]
    doubts = (*heard.doubts, *(left_out(note.take, other, beside=True) for note, other in beside if other))
    notes = tuple(note for note, other in beside if not other)
    if not notes:
        raise RecordingError(f"{doubts[-1]}; only a string that sounds alone can be identified")
    return replace(heard, notes=notes, doubts=doubts)
