"""A plucked open string, identified from recordings: its partials, f0 and B, and what its losses are.

Section 3.2 of C. Issanchou et al. (2018): the frequencies and dampings of the partials by a high-resolution method over
several takes, then the models of section 2.2 through them.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from livebass import modes as modal
from livebass.admittance import Admittance
from livebass.combine import Found, combine
from livebass.instrument import Instrument, Neck, String, note_frequency, speaking
from livebass.partials import Partial, track
from livebass.string_fit import Law, Losses, fit_law, fit_losses
from livebass.takes import RecordingError, Take, find_takes, read_recording
from livebass.units import cents, note_name
from livebass.yin import fundamental

Floats = NDArray[np.float64]

PITCHES = (25.0, 500.0)  # Hz, looked for where nothing is known
SEMITONE = 2 ** (1 / 12)
PERIODS = 20  # a take has at least as many
FEWEST = 4  # partials
SPREAD = 0.02  # of f0: partials that scatter more belong to something else


@dataclass(frozen=True)
class Identified:
    """An open string as it was heard."""

    string: String  # of the base preset with all that was measured and fitted
    conductance: tuple[tuple[float, float], ...]  # (Hz, m/s/N) of the neck under it; empty: none found
    partials: tuple[Found, ...]
    law: Law
    takes: tuple[Take, ...]
    rejected: int  # takes of another pitch, too short, or without enough partials
    missing: tuple[int, ...]  # partials below the highest that were not found: `string` has the law's values


def identify(
    paths: Sequence[Path],
    bass: Instrument,
    *,
    string: str | None = None,
    note: int | None = None,
    f0: float | None = None,
    modes: int = 60,
    start: float = 0.02,
    duration: float = 5.0,
    channel: int | None = None,
) -> Identified:
    """The open string that is plucked, alone, in every note of the recordings `paths`.

    string: name of the one of `bass` it is; left out, the one that is tuned nearest. note (MIDI) or f0 (Hz, to a
    semitone): its pitch, which is found if neither is given. modes: the most partials looked for. Each note is used
    from `start` (s) after its attack for `duration` (s) at most; channel, from 1, or None for the loudest. Raises
    ValueError, one line, for a recording that cannot be used, and LookupError for a string the bass has not. Needs
    SciPy. [main thread]
    """
    known = bass.strings[bass.string_index(string)] if string is not None else None
    hint = f0 or (note_frequency(note) if note is not None else None)
    if hint is None and known is not None:
        hint = note_frequency(known.open_note)
    takes, pitch, all_takes = _takes(paths, start, duration, channel, hint)
    tracks = [(take, track(take.sound, take.rate, pitch, modes)) for take in takes]
    good = [(take, partials) for take, partials in tracks if _plausible(partials, pitch)]
    if not good:
        raise RecordingError(_why_not([partials for _, partials in tracks], paths, pitch))
    found = combine([partials for _, partials in good])
    base = known or nearest_string(bass, pitch)
    law = fit_law(_numbers(found), np.array([p.frequency for p in found]), base.inharmonicity)
    neck = bass.necks[bass.strings.index(base)]
    fitted = _tuned(base, law, note)
    losses = fit_losses(
        fitted, neck, _numbers(found), np.array([p.damping for p in found]), np.array([p.damping_u for p in found]) / 2
    )
    return _identified(fitted, losses, found, law, [take for take, _ in good], all_takes - len(good))


def nearest_string(bass: Instrument, frequency: float) -> String:
    """The string of `bass` whose open note is nearest to `frequency` (Hz). RecordingError beyond a semitone."""
    best = min(bass.strings, key=lambda s: abs(cents(frequency / note_frequency(s.open_note))))
    _check_pitch(best, frequency, ", ".join(f"{s.name} {note_name(s.open_note)}" for s in bass.strings))
    return best


def _check_pitch(string: String, frequency: float, all_strings: str = "") -> None:
    if abs(cents(frequency / note_frequency(string.open_note))) > 100:
        are = f"are {all_strings}" if all_strings else f"is {note_name(string.open_note)}"
        raise RecordingError(
            f"the note is {frequency:.2f} Hz, more than a semitone from an open string, which {are}; only open strings "
            "can be identified; for another tuning give --string and --note"
        )


def _takes(
    paths: Sequence[Path], start: float, duration: float, channel: int | None, hint: float | None
) -> tuple[list[Take], float, int]:
    """All takes long enough of one pitch, that pitch, Hz, and how many takes there are."""
    if not paths:
        raise RecordingError("no recording")
    takes: list[Take] = []
    for path in paths:
        recording = read_recording(path, channel)
        new = find_takes(recording, start, duration)
        if not new:
            raise RecordingError(f"{path}: {recording.sound.size / recording.rate:.3g} s, too short or without a note")
        takes += new
    low, high = (hint / SEMITONE, hint * SEMITONE) if hint else PITCHES
    pitches = [_pitch(take, low, high) for take in takes]
    if not any(pitches):
        near = f" within a semitone of {hint:.2f} Hz" if hint else ""
        needed = max(3.0, PERIODS * 0.1) / low
        if max(t.duration_s for t in takes) < needed:
            longest = max(t.duration_s for t in takes)
            raise RecordingError(f"{takes[0].name}: {longest:.3g} s of note, too short: {PERIODS} periods are needed")
        raise RecordingError(f"{takes[0].name}: no pitch{near}: noise, several notes at once, or not this string")
    heard = np.array([p for p in pitches if p])
    alike = np.abs(np.log(heard[:, None] / heard)) < math.log(SEMITONE)
    pitch = float(np.median(heard[alike[np.argmax(alike.sum(axis=0))]]))  # of most takes
    good = [t for t, p in zip(takes, pitches, strict=True) if p and abs(cents(p / pitch)) < 100]
    long = [t for t in good if t.duration_s * pitch >= PERIODS]
    if not long:
        longest = max(t.duration_s for t in good)
        why = f"too short: {PERIODS} periods, {PERIODS / pitch:.2g} s, are needed"
        raise RecordingError(f"{good[0].name}: {longest:.3g} s of note, {why}")
    return long, pitch, len(takes)


def _pitch(take: Take, low: float, high: float) -> float | None:
    """Median pitch of the first 1.5 s, Hz, or None."""
    try:
        heard = fundamental(take.sound[: round(1.5 * take.rate)], take.rate, low, high, threshold=0.2).frequency_hz
    except ValueError:  # too short
        return None
    heard = heard[np.isfinite(heard)]
    return float(np.median(heard)) if heard.size else None


def _plausible(partials: Sequence[Partial], pitch: float) -> bool:
    """Whether these are partials of one string: enough, near multiples of one frequency, and not only even ones."""
    low = [p for p in partials if p.number <= 12]
    if len(partials) < FEWEST or len(low) < 3 or math.gcd(*(p.number for p in low)) > 1:
        return False
    ratio = np.array([p.frequency / p.number for p in low])
    return bool(np.ptp(ratio) < SPREAD * pitch)


def _why_not(tracks: Sequence[Sequence[Partial]], paths: Sequence[Path], pitch: float) -> str:
    name, most = paths[0], max(len(partials) for partials in tracks)
    if most < FEWEST:
        partials = f"{most} partial{'s' * (most != 1)}"
        return f"{name}: {partials} of a string near {pitch:.2f} Hz, {FEWEST} are needed: noise, or no plucked string"
    return f"{name}: what sounds is not one string near {pitch:.2f} Hz; give its pitch with --note or --f0"


def _numbers(found: Sequence[Found]) -> NDArray[np.int64]:
    return np.array([p.number for p in found], np.int64)


def _tuned(base: String, law: Law, note: int | None) -> String:
    """`base` with the f0 and B found; its tension is what they need, as in table 1 of the paper."""
    string = replace(base, open_note=base.open_note if note is None else note)
    _check_pitch(string, law.fundamental)
    tension = base.linear_density * (2 * base.length * law.fundamental) ** 2
    return replace(
        string, tension=tension, inharmonicity=law.inharmonicity, law_fundamental=law.fundamental,
        extra_damping=0.0, extra_damping_slope=0.0, measured_frequencies=(), measured_dampings=(),
    )  # fmt: skip


def _identified(
    fitted: String, losses: Losses, found: list[Found], law: Law, takes: list[Take], rejected: int
) -> Identified:
    """Measured modes without a gap: what was not found follows the law."""
    fitted = replace(
        fitted, diameter=losses.diameter, viscoelastic_angle=losses.viscoelastic_angle,
        thermoelastic=losses.thermoelastic,
    )  # fmt: skip
    table = Admittance(table=tuple((nu, y, 0.0) for nu, y in losses.conductance))
    neck = Neck((fitted.length / 2,), (-1.0,), admittance=table)  # any frets: the open string has none
    count = found[-1].number
    s = speaking(fitted, neck, 0)
    frequencies, dampings = modal.frequencies(s, count), modal.dampings(s, count)
    for p in found:
        frequencies[p.number - 1], dampings[p.number - 1] = p.frequency, p.damping
    have = {p.number for p in found}
    missing = tuple(j for j in range(1, count + 1) if j not in have)
    for j in missing:  # between neighbours a law's value may not fit
        below = frequencies[j - 2] if j > 1 else 0.0
        above = next(p.frequency for p in found if p.number > j)
        gap = next(p.number for p in found if p.number > j) - j + 1
        if not below < frequencies[j - 1] < above:
            frequencies[j - 1] = below + (above - below) / gap
    string = replace(
        fitted, measured_frequencies=tuple(map(float, frequencies)), measured_dampings=tuple(map(float, dampings))
    )
    return Identified(string, losses.conductance, tuple(found), law, tuple(takes), rejected, missing)
