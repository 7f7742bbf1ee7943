"""The fret that a pressed string lies on at rest: its own, or a higher one whose crown stands in its way and chokes it.

Statics. At rest a taut string over crowns takes the shortest way above them: the upper convex hull of the pressed
crown, the crowns beyond, and the saddle. Bending stiffness only rounds the corners, over sqrt(E I / T), some
millimetres. The last crown carries most of it, with the force T (h / x + h / (L - x)) of a corner h high: 0.1 N on a
very low bass, where a finger presses with ten. So a pluck lifts the string off, it hits crowns as it comes back, and
what is left dies away at the pitch of that crown, at the rate at which the crown's loss takes energy: the crown resists
with c times its force (kernels/string/contact.py). kernels/string/draped.py computes it. A bare board is taken to hold
the string like a finger: the note then sounds as the place that it lies on (kernels/string/note.py).
"""

from __future__ import annotations

from types import SimpleNamespace
from typing import NamedTuple

from livebass.kernels.string.note import resting_on
from livebass.model.instrument import Instrument, Neck, String
from livebass.model.neck import flat


class Choked(NamedTuple):
    """A note that frets out: the string, pressed at a fret, lies on a higher one at rest."""

    string: str  # its name
    fret: int  # that is pressed ...
    on: int  # ... and that it lies on
    frequency: float  # Hz, at which it dies away; over a board, that sounds


def lies_on(string: String, neck: Neck, fret: int) -> int:
    """The fret that `string` lies on at rest when pressed at `fret`: that one, or a higher one that chokes it."""
    crowns = flat(zip(neck.fret_positions, neck.fret_heights, strict=True))
    given = SimpleNamespace(length=string.length, frets=0, frets_count=len(neck.fret_positions))
    return int(resting_on(given, crowns, fret))


def rests(string: String, neck: Neck, frets: int) -> dict[int, int]:
    """The frets, up to `frets`, at which `string` frets out, each with the fret that it lies on."""
    return {fret: on for fret in range(1, frets + 1) if (on := lies_on(string, neck, fret)) != fret}


def choked(bass: Instrument) -> tuple[Choked, ...]:
    """The notes of `bass` that fret out, string by string, by fret."""
    return tuple(
        Choked(string.name, fret, on, string.frequency(string.open_note + on))
        for string, neck in zip(bass.strings, bass.necks, strict=True)
        for fret, on in rests(string, neck, bass.frets).items()
    )
