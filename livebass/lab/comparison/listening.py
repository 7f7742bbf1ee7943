"""Notes to listen to: each real one beside the nearest note of every other bass, equally loud."""

from __future__ import annotations

import base64
import io
import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import PurePath

import numpy as np
import soundfile

from livebass.lab.comparison.comparing import Compared
from livebass.lab.comparison.distance import between
from livebass.lab.comparison.measures import attack
from livebass.lab.comparison.notes import Note
from livebass.lab.comparison.summary import same_pitch
from livebass.rows.arrays import Floats
from livebass.rows.units import cents, note_name
from livebass.sound.analysis import loudness

MAXIMUM = 24  # real notes on a page
LONGEST = 3.0  # s of a note
LEAD, FADE = 0.02, 0.05  # s, kept before the attack, and faded out at the end
CEILING = 10 ** (-0.3 / 20)  # peak of a note


@dataclass(frozen=True)
class Heard:
    """One audio player of the page."""

    bass: str
    name: str  # of the note, as its file
    flac: str  # base64
    moved: float | None = None  # dB of gain to match loudness; None: the real one
    distance: float = math.nan  # dB from the real one, over the first second; NaN if a note is shorter


@dataclass(frozen=True)
class Row:
    """A real note and the nearest notes of other basses."""

    title: str
    players: tuple[Heard, ...]  # the real one first
    lowered: float = 0.0  # dB of attenuation common to all, which avoids clipping


def rows(shown: Sequence[Compared]) -> list[Row]:
    """Returns the rows of up to MAXIMUM notes of the real basses, by pitch and from soft to hard.

    The rendered basses stand beside them; if there are none, the other real basses beside the first.
    """
    real, others = [c for c in shown if not c.bass.rendered], [c for c in shown if c.bass.rendered]
    if not others:
        real, others = list(shown[:1]), list(shown[1:])
    notes = sorted(((n, c) for c in real for n in c.bass.notes), key=lambda pair: (pair[0].pitch, pair[0].rank))
    if len(notes) > MAXIMUM:
        notes = [notes[round(k)] for k in np.linspace(0, len(notes) - 1, MAXIMUM)]
    return [_row(note, each, others) for note, each in notes]


def _row(real: Note, of: Compared, others: Sequence[Compared]) -> Row:
    cut = excerpt(real)
    players = [(of.bass.title, real, cut, 0.0, math.nan)]
    for other in others:
        found = [n for n in other.bass.notes if same_pitch(n.pitch, real.pitch)]
        if found:
            note = min(found, key=lambda n: (_apart(real, n), abs(n.rank - real.rank)))
            sound = excerpt(note)
            gain = _loudness_apart(cut, real.rate, sound, note.rate)
            players.append((other.bass.title, note, sound * 10 ** (gain / 20), gain, between(real.shape, note.shape)))
    lower = min(1.0, *(CEILING / max(float(np.abs(sound).max()), 1e-9) for _, _, sound, _, _ in players))
    return Row(
        title=f"{note_name(round(69 + cents(real.pitch / 440) / 100))} {real.dynamic}".strip(),
        players=tuple(
            Heard(bass, PurePath(note.name).stem, _flac(sound * lower, note.rate), gain if k else None, distance)
            for k, (bass, note, sound, gain, distance) in enumerate(players)
        ),
        lowered=20 * math.log10(lower),
    )


def _apart(a: Note, b: Note) -> float:
    """The distance of two notes, dB; infinite if unknown."""
    found = between(a.shape, b.shape)
    return math.inf if math.isnan(found) else found


def excerpt(note: Note, longest: float = LONGEST) -> Floats:
    """Returns a note from its attack on, `longest` (s) at most, faded so the end does not click, (n,)."""
    begin = max(0, attack(note.sound, note.rate) - round(LEAD * note.rate))
    sound = np.array(note.sound[begin:][: round(longest * note.rate)], np.float64)
    fade = min(round(FADE * note.rate), sound.size)
    sound[sound.size - fade :] *= np.linspace(1, 0, fade)
    return sound


def _loudness_apart(a: Floats, rate_a: int, b: Floats, rate_b: int) -> float:
    """The dB by which `a` is louder than `b` (BS.1770), over their common time; 0 if one is silent."""
    seconds = min(a.size / rate_a, b.size / rate_b)
    found = [loudness(sound[: round(seconds * rate)], rate) for sound, rate in ((a, rate_a), (b, rate_b))]
    return found[0] - found[1] if all(map(math.isfinite, found)) else 0.0


def _flac(sound: Floats, rate: int) -> str:
    """A 16-bit FLAC file, which every browser plays; base64."""
    file = io.BytesIO()
    soundfile.write(file, sound, rate, format="FLAC", subtype="PCM_16")
    return base64.b64encode(file.getvalue()).decode()
