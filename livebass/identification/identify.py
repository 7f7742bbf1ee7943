"""Identifies a plucked open string from recordings, and writes what was found as text, JSON, CSV or a preset.

After section 3.2 of C. Issanchou et al. (2018): frequencies and dampings of the partials by a high-resolution method
over several takes, then the models of section 2.2 through them.
"""

from __future__ import annotations

import math
import os
import tomllib
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from livebass.analysis.motion import t60
from livebass.arrays import Ints
from livebass.engine.prepare import pickups_under
from livebass.identification.across import Across, Own, across, fit_own, heard_of_both, level_across
from livebass.identification.doubts import doubtful, left_out, other_note, without_clipping
from livebass.identification.fit import FEW, Law, Losses, NeckFit, fit_laws, fit_losses, rigid_neck
from livebass.identification.glide import Glide, glide_of, straightened
from livebass.identification.limits import check
from livebass.identification.lines import Line
from livebass.identification.onset import Onset, fit_onset, rounded, third_octaves
from livebass.identification.partials import (
    Found,
    Partial,
    RecordingError,
    Take,
    combine,
    find_takes,
    pitch_of,
    read_recording,
    track,
)
from livebass.identification.treatment import compressed, cuts, is_fade, shared_gain, without_fade, without_loops
from livebass.model.instrument import Instrument, Neck, String, note_frequency, speaking
from livebass.model.modes import dampings, frequencies, impedance
from livebass.model.neck import Admittance, Resonance
from livebass.preset.build import Builder
from livebass.preset.checks import RESONANCE_KEYS, TABLE_KEYS
from livebass.preset.keys import quoted
from livebass.preset.load import load_preset, preset_source
from livebass.preset.source import PresetError
from livebass.report.text import columns, csv_text, json_text, plain
from livebass.units import cents, note_name, note_number, one_line

PITCHES = (25.0, 500.0)  # Hz, if neither note nor string is given
SEMITONE = 2 ** (1 / 12)
PERIODS = 20  # of a take, at least
FEWEST = 4  # partials of a take
SPREAD = 0.02  # of f0: partials that scatter more about those of a stiff string are not of one string
STIFFEST = 5e-4  # B of a low B string is 3e-4


@dataclass(frozen=True)
class Identified:
    """An open string as recordings tell it."""

    string: String  # of the base preset, with everything measured and fitted
    conductance: tuple[tuple[float, float], ...]  # (Hz, m/s/N) of the neck under it; empty: none found
    partials: tuple[Found, ...]
    law: Law  # that describes the partials better ...
    other: Law  # ... than this one
    takes: tuple[Take, ...]
    rejected: int  # takes of another pitch, too short, or without enough partials
    missing: tuple[int, ...]  # partials below the highest, not found or in doubt: `string` has values of the laws
    doubts: tuple[str, ...]  # a sentence each: what in the recordings was left out, or done to them, and why
    glides: tuple[Glide | None, ...]  # of the takes: how sharp each begins; taken out of what the partials are
    across: Across | None  # how v differs from u; None: no partial is two lines
    own: Own | None  # the law of v for a preset; None: it keeps that of the base preset
    level_across: float  # of v over u in the base preset; the dampings of `string` are those of u that go with it
    onset: Onset | None = (
        None  # pluck, pickups and tone by the levels of partials; None: not asked for, or not possible
    )


def identify(
    recordings: str | os.PathLike[str] | Sequence[str | os.PathLike[str]],
    bass: Instrument,
    *,
    string: str | None = None,
    note: int | None = None,
    f0: float | None = None,
    modes: int = 60,
    start: float = 0.02,
    duration: float = 5.0,
    channel: int | None = None,
    only_string: bool = False,
) -> Identified:
    """Identifies the open string that is plucked, alone, in every note of the `recordings`, one or several sound files.

    string: its name in `bass`; by default the one tuned nearest. note (MIDI) or f0 (Hz, to a semitone): its pitch; by
    default it is found. modes: the most partials to look for. start, duration: each note is used from `start` (s) after
    its attack, for `duration` (s) at most. channel: from 1; by default the loudest. only_string: pluck, pickups and
    tone are left as `bass` has them.

    Returns an `Identified`: `partials`, each with frequency (Hz), damping (1/s), their uncertainties and `t60` (s);
    `law` with f0 (Hz) and B; `string`, that of `bass` as measured; `doubts`, a sentence for each thing left out. Raises
    ValueError with one line for values that are not allowed and, as RecordingError, for recordings that cannot be used.
    Needs SciPy: pip install 'livebass[analysis]'. [main thread]
    """
    check(modes, start, duration, channel, f0)
    if note is not None and f0 is not None:
        raise ValueError("note and f0 are both given: one of them is enough")
    paths = [Path(r) for r in ([recordings] if isinstance(recordings, str | os.PathLike) else recordings)]
    known = None if string is None else bass.strings[_index(bass, string)]
    hint = f0 or (note_frequency(note) if note is not None else None)
    if hint is None and known is not None:
        hint = known.frequency(known.open_note)
    takes, pitch, all_takes, doubts = _takes(paths, start, duration, channel, hint)
    tracks = [(take, track(take.sound, take.rate, pitch, modes)) for take in takes]
    good = [(take, partials) for take, partials in tracks if _plausible(partials, pitch)]
    if not good:
        raise RecordingError(_why_not([partials for _, partials in tracks], paths, pitch))
    heard = [_steady(take, partials, pitch, modes) for take, partials in good]
    good, gains = _unfaded([(take, partials) for take, partials, _ in heard], pitch, modes)
    doubts += gains
    beside = [other_note(take, partials, pitch) for take, partials in good]
    doubts += [left_out(take, other, beside=True) for (take, _), other in zip(good, beside, strict=True) if other]
    glides = tuple(each[2] for each, other in zip(heard, beside, strict=True) if not other)
    good = [each for each, other in zip(good, beside, strict=True) if not other]
    if not good:
        raise RecordingError(f"{doubts[-1]}; only a string that sounds alone can be identified")
    found = combine([partials for _, partials in good])
    base = known or nearest_string(bass, pitch)
    strange, more = doubtful(found, base, _laws(found, base)[0])
    found = [p for p in found if p.number not in strange]
    law, other = _laws(found, base)
    neck = bass.necks[bass.strings.index(base)]
    fitted = _tuned(base, law, note)
    level = level_across(bass, base.name)
    losses, own = _losses(fitted, neck, found, level)
    takes = [take for take, _ in good]
    result = _identified(
        fitted, _neck_with(neck, fitted, Admittance(table=_table(losses)), own), losses, found, (law, other), takes,
        all_takes - len(good), (*doubts, *more), glides, own, level,
    )  # fmt: skip
    if only_string:
        return result
    onset = fit_onset(speaking(result.string, neck, 0), bass, found, third_octaves(takes), start)
    return replace(result, onset=onset)


def _steady(take: Take, partials: list[Partial], pitch: float, modes: int) -> tuple[Take, list[Partial], Glide | None]:
    """The take and its partials without the glide that they share, and that glide."""
    glide = glide_of(take, partials, pitch)
    if glide is None:
        return take, partials, None
    steady = straightened(take, glide)
    again = track(steady.sound, steady.rate, pitch, modes)
    return (steady, again, glide) if _plausible(again, pitch) else (take, partials, None)


def _unfaded(
    good: Sequence[tuple[Take, list[Partial]]], pitch: float, modes: int
) -> tuple[list[tuple[Take, list[Partial]]], list[str]]:
    """The takes and their partials without fades, and sentences about these and about compressors."""
    kept, said = [], []
    for take, partials in good:
        gain = shared_gain(take, partials, pitch)
        if gain is not None and is_fade(gain, take):
            shorter, why = without_fade(take, gain)
            again = track(shorter.sound, shorter.rate, pitch, modes)
            if _plausible(again, pitch):
                take, partials = shorter, again
            said.append(why)
        elif gain is not None:
            said.append(compressed(take, gain))
        kept.append((take, partials))
    return kept, said


def _index(bass: Instrument, string: str) -> int:
    """Index of the string of that name; ValueError, which lists those there are."""
    try:
        return bass.string_index(string)
    except LookupError as error:
        raise ValueError(error.args[0]) from None


def nearest_string(bass: Instrument, frequency: float) -> String:
    """Returns the string of `bass` tuned nearest to `frequency` (Hz); raises RecordingError beyond a semitone."""
    best = min(bass.strings, key=lambda s: abs(cents(frequency / s.frequency(s.open_note))))
    _check_pitch(best, frequency, ", ".join(f"{s.name} {note_name(s.open_note)}" for s in bass.strings))
    return best


def _check_pitch(string: String, frequency: float, all_strings: str = "") -> None:
    if abs(cents(frequency / string.frequency(string.open_note))) > 100:
        strings = (
            f"the open strings ({all_strings})" if all_strings else f"the open string ({note_name(string.open_note)})"
        )
        raise RecordingError(
            f"the note is {frequency:.2f} Hz, more than a semitone from {strings}; only open strings can be "
            "identified; for another tuning give --string and --note"
        )


def _takes(
    paths: Sequence[Path], start: float, duration: float, channel: int | None, hint: float | None
) -> tuple[list[Take], float, int, list[str]]:
    """The takes of one pitch that are long enough, that pitch (Hz), the number of all takes, and doubts."""
    if not paths:
        raise RecordingError("no recording")
    takes: list[Take] = []
    count, doubts = 0, []
    cut: dict[int, list[str]] = {}
    for path in paths:
        recording = read_recording(path, channel)
        new = find_takes(recording, start, duration)
        if not new:
            raise RecordingError(f"{path}: {recording.sound.size / recording.rate:.3g} s, too short or without a note")
        count += len(new)
        new, clipping = without_clipping(recording, new)
        new, loops = without_loops(new)
        takes += new
        doubts += clipping + loops
        cut |= {id(take): cuts(recording, take, start) for take in new}
    if not takes:
        raise RecordingError(doubts[-1])
    low, high = (hint / SEMITONE, hint * SEMITONE) if hint else PITCHES
    pitches = [pitch_of(take, low, high) for take in takes]
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
    others = [t for t, p in zip(takes, pitches, strict=True) if not p or abs(cents(p / pitch)) >= 100]
    doubts += [left_out(take, pitch_of(take, *PITCHES), beside=False) for take in others]
    long = [t for t in good if t.duration_s * pitch >= PERIODS]
    if not long:
        longest = max(t.duration_s for t in good)
        why = f"too short: {PERIODS} periods, {PERIODS / pitch:.2g} s, are needed"
        raise RecordingError(f"{good[0].name}: {longest:.3g} s of note, {why}")
    return long, pitch, count, [*doubts, *(said for take in long for said in cut[id(take)])]


def _plausible(partials: Sequence[Partial], pitch: float) -> bool:
    """True if these are partials of one stiff string: enough of them, near its law, and not only every second."""
    low = [p for p in partials if p.number <= 12]
    if len(partials) < FEWEST or len(low) < 3 or math.gcd(*(p.number for p in low)) > 1:
        return False
    squared = np.array([p.number**2 for p in low], dtype=np.float64)
    ratio = np.array([p.frequency / p.number for p in low]) / pitch
    slope = np.polyfit(squared, ratio, 1)[0]  # B / 2
    return bool(np.ptp(ratio - min(max(slope, 0.0), STIFFEST / 2) * squared) < SPREAD)


def _why_not(tracks: Sequence[Sequence[Partial]], paths: Sequence[Path], pitch: float) -> str:
    name, most = paths[0], max(len(partials) for partials in tracks)
    if most < FEWEST:
        partials = f"{most} partial{'s' * (most != 1)}"
        return f"{name}: {partials} of a string near {pitch:.2f} Hz, {FEWEST} are needed: noise, or no plucked string"
    return f"{name}: what sounds is not one string near {pitch:.2f} Hz; give its pitch with --note or --f0"


def _numbers(found: Sequence[Found]) -> Ints:
    return np.array([p.number for p in found], np.int64)


def _laws(found: Sequence[Found], base: String) -> tuple[Law, Law]:
    return fit_laws(_numbers(found), np.array([p.frequency for p in found]), base)


def _tuned(base: String, law: Law, note: int | None) -> String:
    """`base` with the f0 and B found, and the tension that they need, as in table 1 of the paper."""
    string = replace(base, open_note=base.open_note if note is None else note)
    _check_pitch(string, law.fundamental)
    tension = base.linear_density * (2 * base.length * law.fundamental) ** 2
    return replace(
        string, tension=tension, inharmonicity=law.inharmonicity, stiffness_law=law.stiffness_law,
        law_fundamental=law.fundamental,
        extra_damping=0.0, extra_damping_slope=0.0, measured_frequencies=(), measured_dampings=(),
    )  # fmt: skip


def _losses(fitted: String, neck: Neck, found: Sequence[Found], level: float) -> tuple[Losses, Own | None]:
    """The losses of u, and the law of v where it explains the partials of two lines; else losses as heard, and None."""
    number, deviation = _numbers(found), np.array([p.damping_u for p in found]) / 2
    heard = fit_losses(fitted, neck, number, np.array([p.damping for p in found]), deviation)
    if level == 0:
        return heard, None
    of_u = np.array([p.damping if p.v is None else p.u.damping for p in found])
    losses = fit_losses(fitted, neck, number, of_u, deviation)
    lossy = _lossy(fitted, losses)
    own = fit_own(lossy, _neck_with(neck, lossy, Admittance(table=_table(losses)), None), found)
    return (losses, own) if own else (heard, None)


def _lossy(string: String, losses: Losses) -> String:
    return replace(
        string, diameter=losses.diameter, viscoelastic_angle=losses.viscoelastic_angle,
        thermoelastic=losses.thermoelastic,
    )  # fmt: skip


def _table(losses: Losses) -> tuple[tuple[float, float, float], ...]:
    return tuple((nu, y, 0.0) for nu, y in losses.conductance)


def _neck_with(neck: Neck, string: String, y: Admittance, own: Own | None) -> Neck:
    """A neck with `y` alone under the open `string`, and with the law of v found, or with that of `neck`."""
    stiffness, longer = (own.stiffness, own.longer) if own else (neck.stiffness_across, neck.longer_across)
    return replace(rigid_neck(string), admittance=y, stiffness_across=stiffness, longer_across=longer)


def _identified(
    fitted: String, neck: Neck, losses: Losses, found: list[Found], laws: tuple[Law, Law], takes: list[Take],
    rejected: int, doubts: tuple[str, ...], glides: tuple[Glide | None, ...], own: Own | None, level: float,
) -> Identified:  # fmt: skip
    """The result, with measured modes without a gap: partials that were not found follow the laws."""
    fitted = _lossy(fitted, losses)
    count = found[-1].number
    s = speaking(fitted, neck, 0)
    nu, sigma = frequencies(s, count), dampings(s, count)
    for p in found:
        nu[p.number - 1] = p.frequency
    have = {p.number for p in found}
    missing = tuple(j for j in range(1, count + 1) if j not in have)
    for j in missing:  # the law's value may not lie between the neighbours
        below = nu[j - 2] if j > 1 else 0.0
        above = next(p.frequency for p in found if p.number > j)
        gap = next(p.number for p in found if p.number > j) - j + 1
        if not below < nu[j - 1] < above:
            nu[j - 1] = below + (above - below) / gap
    sigma[_numbers(found) - 1] = heard_of_both(s, found, level, own is not None)
    string = replace(fitted, measured_frequencies=tuple(map(float, nu)), measured_dampings=tuple(map(float, sigma)))
    aside = across(found, impedance(s), s.fundamental)
    return Identified(
        string, losses.conductance, tuple(found), *laws, tuple(takes), rejected, missing, doubts, glides, aside, own,
        level,
    )  # fmt: skip


def with_resonances(result: Identified, bass: Instrument, resonances: Sequence[Resonance]) -> Identified:
    """Returns `result`, found with `bass`, with the law of v and the dampings of u for a neck of `resonances`."""
    base = bass.necks[bass.string_index(result.string.name)]
    y, found = Admittance(tuple(resonances)), result.partials
    unmeasured = replace(result.string, measured_frequencies=(), measured_dampings=())
    own = fit_own(unmeasured, _neck_with(base, unmeasured, y, None), found) if result.level_across else None
    sigma = np.array(result.string.measured_dampings)
    s = speaking(unmeasured, _neck_with(base, unmeasured, y, own), 0)
    sigma[_numbers(found) - 1] = heard_of_both(s, found, result.level_across, own is not None)
    return replace(result, string=replace(result.string, measured_dampings=tuple(map(float, sigma))), own=own)


MARK = "identified"
WIDTH_LIMITS, RELEASE_LIMITS = (0.5e-3, 50e-3), (1e-6, 10e-3)  # m, s, that a preset allows
COLUMNS = (
    "partial", "frequency_hz", "frequency_u95_hz", "damping_per_s", "damping_u95_per_s", "q", "t60_s", "level_db",
    "takes", "law_frequency_hz", "u_frequency_hz", "u_damping_per_s", "u_t60_s", "v_frequency_hz", "v_damping_per_s",
    "v_t60_s", "v_over_u_db",
)  # fmt: skip


def rows(result: Identified) -> list[dict[str, float | None]]:
    """Returns a row for each partial, by `COLUMNS`; None is no value. u95: expanded uncertainty, 95 %."""
    law = result.law.frequency(np.array([p.number for p in result.partials]))
    return [
        dict(zip(COLUMNS, plain(_row(p, float(nu))), strict=True)) for p, nu in zip(result.partials, law, strict=True)
    ]


def _row(p: Found, law: float) -> tuple[float, ...]:
    q = math.pi * p.frequency / p.damping  # section 2.2
    v = p.v or Line(math.nan, math.nan, math.nan)
    return (
        p.number, p.frequency, p.frequency_u, p.damping, p.damping_u, q, p.t60, p.level_db, p.takes, law,
        p.u.frequency, p.u.damping, float(t60(p.u.damping)), v.frequency, v.damping, float(t60(v.damping)),
        20 * math.log10(v.amplitude / p.u.amplitude),
    )  # fmt: skip


def partials_csv(result: Identified) -> str:
    """Returns the partials as comma-separated values under a head."""
    return csv_text(COLUMNS, ([None if v is None else f"{v:.9g}" for v in row.values()] for row in rows(result)))


def identified_json(result: Identified, resonances: Sequence[Resonance] = ()) -> str:
    """Returns everything as JSON; keys carry their units."""
    s, law = result.string, result.law
    data = {
        "string": s.name,
        "open_note": note_name(s.open_note),
        "f0_hz": law.fundamental,
        "inharmonicity": law.inharmonicity,
        "stiffness_law": law.stiffness_law,
        "law_deviation": law.deviation,
        "law_from_partial": law.first,
        "law_misfit": law.misfit,
        "other_law_misfit": result.other.misfit,
        "tension_n": s.tension,
        "linear_density_kg_per_m": s.linear_density,
        "diameter_m": s.diameter,
        "viscoelastic_angle": s.viscoelastic_angle,
        "thermoelastic": s.thermoelastic,
        "conductance": [{"frequency_hz": nu, "conductance_m_per_s_per_n": y} for nu, y in result.conductance],
        "resonances": [{"frequency_hz": r.frequency, "q": r.quality, "mass_kg": r.mass} for r in resonances],
        "onset": _onset_data(result.onset),
        "across": _across_data(result.across, result.own),
        "glides": [
            [{"part": part, "time_s": time} for part, time in glide.parts] if glide else [] for glide in result.glides
        ],
        "missing_partials": list(result.missing),
        "rejected_takes": result.rejected,
        "doubts": list(result.doubts),
        "takes": [{"file": t.name, "start_s": t.start_s, "duration_s": t.duration_s} for t in result.takes],
        "partials": rows(result),
    }
    return json_text(data)


def _onset_data(found: Onset | None) -> dict[str, Any] | None:
    """Pluck, pickups and tone, for JSON."""
    if found is None:
        return None
    return {
        "pluck_from_saddle_m": found.place,
        "rounding_m": found.rounding,
        "release_s": found.release,
        "pickups": [{"position_m": p.position, "level": p.level} for p in found.pickups],
        "tone": found.tone,
        "misfit_db": found.misfit,
        "preset_misfit_db": found.before,
        "doubts": list(found.doubts),
    }


def _across_data(v: Across | None, own: Own | None) -> dict[str, Any] | None:
    """Returns the law of v for JSON: v less u in each key, and the keys of a preset; None if there is none."""
    if v is None:
        return None
    return {
        "detuning": v.detuning,
        "detuning_spread": v.detuning_spread,
        "damping_per_s": v.damping,
        "damping_spread_per_s": v.damping_spread,
        "stiffness_across": own.stiffness if own else None,
        "longer_across_m": own.longer if own else None,
        "misfit": own.misfit if own else None,
        "partials": [
            {
                "partial": d.number,
                "frequency_hz": d.frequency,
                "detuning": d.detuning,
                "damping_per_s": d.damping,
                "conductance_m_per_s_per_n": d.conductance,
                "susceptance_m_per_s_per_n": d.susceptance,
            }
            for d in v.partials
        ],
    }


def table(result: Identified) -> str:
    """Returns the partials and the laws through them as text."""
    several = len(result.takes) > 1
    shown = [("partial", "Hz", "+-", "1/s", "+-", "T60 s", "dB", "off law", *(["takes"] if several else []))]
    beside = ["its two lines"]
    for row, p in zip(rows(result), result.partials, strict=True):
        off = 1e6 * (p.frequency / (row["law_frequency_hz"] or math.nan) - 1)
        shown.append(
            (
                str(p.number), f"{p.frequency:.4f}", f"{p.frequency_u:.2g}", f"{p.damping:.4g}", f"{p.damping_u:.2g}",
                f"{p.t60:.3g}", f"{p.level_db:.1f}", f"{off:+.0f} ppm", *([str(p.takes)] if several else []),
            )
        )  # fmt: skip
        beside.append("" if p.v is None else f"u {_line(p.u)}; v {_line(p.v)}")
    lines = [f"{line}  {twin}".rstrip() for line, twin in zip(columns(shown, left=0), beside, strict=True)]
    s = result.string
    lines += [
        "+-: 95 %, " + ("scatter over the takes" if several else "from the noise in this one take"),
        f"f0 {result.law.fundamental:.4f} Hz, B {s.inharmonicity:.3g}, from partial {result.law.first} on, "
        f"to {1e6 * result.law.deviation:.0f} ppm; tension {s.tension:.1f} N at {s.linear_density * 1e3:.4g} g/m",
        _which_law(result),
        f"losses: air as diameter {s.diameter * 1e3:.3g} mm, viscoelastic angle {s.viscoelastic_angle:.3g}, "
        f"thermoelastic {s.thermoelastic:.2g}, " + _neck(result),
    ]
    lines += _motion(result)
    if result.missing:
        lines.append(f"not measured: {', '.join(map(str, result.missing))}; the preset takes them from the laws")
    choices = result.onset.doubts if result.onset else ()
    lines += [f"doubt: {doubt}" for doubt in (*result.doubts, *choices)]
    return "\n".join(lines) + "\n"


def _onset(found: Onset) -> list[str]:
    """Says where the string was plucked and heard, and how well that meets the levels."""
    pickups = ", ".join(f"{p.position * 1e3:.0f} mm (level {p.level:.2f})" for p in found.pickups)
    return [
        f"plucked {found.place * 1e3:.0f} mm from the saddle, finger {found.rounding * 1e3:.2g} mm, let go in "
        f"{found.release * 1e6:.0f} us; pickups at {pickups}; tone {found.tone:.2f}: the levels are "
        f"{found.misfit:.1f} dB off, {found.before:.1f} dB by the preset"
    ]


def _line(line: Line) -> str:
    return f"{line.frequency:.3f} Hz, {float(t60(line.damping)):.3g} s"


def _motion(result: Identified) -> list[str]:
    """Says how sharp the takes begin, and how v differs from u."""
    lines = []
    sharp = [glide.cents for glide in result.glides if glide]
    if sharp:
        of = f"{len(sharp)} of {len(result.glides)} takes begin" if len(result.glides) > 1 else "the note begins"
        lines.append(f"{of} {max(sharp):.1f} cents sharp, all partials alike, as its tension falls: taken out")
    if result.onset is not None:
        lines += _onset(result.onset)
    if (v := result.across) is not None:
        lines.append(
            f"{len(v.partials)} partials are two lines: v, across the neck, is {cents(1 + v.detuning):+.2f} cents "
            f"(+- {cents(1 + v.detuning_spread):.2f}) off u, and loses {-v.damping:.3g} /s "
            f"(+- {v.damping_spread:.2g}) less, medians; T60 is that heard of both"
        )
        lines.append(_own(result.own))
    return lines


def _own(own: Own | None) -> str:
    """Says which law of v goes into the preset."""
    if own is None:
        return "v of its own: these lines tell no law, or v is not heard; the preset keeps what it has"
    return (
        f"v of its own: neck {own.stiffness:.3g} times as stiff, string {own.longer * 1e3:+.2f} mm longer across; that "
        f"leaves {100 * own.misfit:.0f} % of detunings and dampings unexplained"
    )


def neck_table(fit: NeckFit) -> str:
    """Returns the resonances, and how well they meet the partials, as text."""
    cells = [(f"{r.frequency:.2f}", f"{r.quality:.1f}", f"{r.mass:.3g}") for r in fit.resonances]
    lines = columns([("neck Hz", "Q", "kg"), *cells], left=0)
    lines.append(
        f"these resonances meet the dampings to {100 * fit.deviation:.1f} % rms; with them the partials lie "
        f"{1e6 * fit.left:.0f} ppm off their law, without {1e6 * fit.scatter:.0f} ppm"
    )
    if fit.below:
        numbers = ", ".join(map(str, fit.below))
        lines.append(f"partials damped less than by the laws of the string alone, which no neck can do: {numbers}")
    return "\n".join(lines) + "\n"


def _which_law(result: Identified) -> str:
    """Says which law of partials was taken, and how far all of them lie off it and off the other."""
    better, other = result.law, result.other
    if len(result.partials) <= FEW:
        return f"law of partials: {better.stiffness_law}, as in the preset, {len(result.partials)} partials do not tell"
    of = f"{1e6 * better.misfit:.0f} ppm off on average, by {other.stiffness_law} {1e6 * other.misfit:.0f}"
    return f"law of partials: {better.stiffness_law}, all partials {of}"


def _neck(result: Identified) -> str:
    if not result.conductance:
        return "nothing left for the neck"
    nu, most = max(result.conductance, key=lambda pair: pair[1])
    return f"the neck takes most at {nu:.0f} Hz, {most * 1e3:.3g} mm/s/N"


def new_preset(
    base: str, old: str, result: Identified, sources: Sequence[Path], resonances: Sequence[Resonance] = ()
) -> str:
    """Returns the text of preset `base` with its string `old` as identified from the files `sources`.

    The neck under it has the `resonances`, or, without any, a table of the conductance found at the partials.
    Everything else stays, comments included. Raises PresetError if the result is no valid preset: the laws damp a mode
    beyond critical, or a pitch is out of order. Needs tomlkit: pip install 'livebass[analysis]'.
    """
    import tomlkit

    label, text = preset_source(base)
    document: Any = tomlkit.parse(text)
    if "like" in document:
        why = "an identified string is written into a preset that says all itself"
        raise PresetError(f"{label}: like = {quoted(document['like'])}: {why}")
    target: Any = next(s for s in document["string"] if s["name"].casefold() == old.casefold())
    s = result.string
    files, rest = ", ".join(one_line(p.name) for p in sources), one_line(label)
    for name in ("core_diameter", "core_modulus", "stiffness_ratio", "extra_damping", "extra_damping_slope"):
        target.pop(name, None)

    below = _cut_end(target)
    for name, value in _values(s, target["open_note"]).items():
        _put(target, name, value)
    _put_neck(document, target, result, resonances)
    if below:
        target.value.body.extend((None, item) for item in below)
    if result.onset is not None:
        _put_onset(document, load_preset(base), old, result.onset)
    document["description"] = f"String {old} identified from {files}; the rest is {rest}"[:500]
    head = f"# String {old} is identified from {files}, where marked so. The rest is {rest}.\n"
    done = head + tomlkit.dumps(document)
    parsed = tomllib.loads(done)
    Builder("the identified preset").instrument(parsed)
    if parsed != document.unwrap():  # a value that ended up in a comment would go unnoticed
        raise ArithmeticError(f"{label}: the new preset did not come out as it was meant")
    return done


def _cut_end(table: Any) -> list[Any]:
    """Removes and returns the blank lines and comments that end a table: they belong to the next one."""
    body = getattr(table.value, "body", [])
    cut: list[Any] = []
    while body and body[-1][0] is None:
        cut.insert(0, body.pop()[1])
    return cut


def _put(target: Any, name: str, value: str) -> None:
    """Sets a key of a table to a value in TOML, with the comment MARK."""
    import tomlkit

    target[name] = tomlkit.parse(f"x = {value}")["x"]
    target[name].comment(MARK)
    target[name].trivia.comment_ws, target[name].trivia.trail = "  ", "\n"


def _put_neck(document: Any, string: Any, result: Identified, resonances: Sequence[Resonance]) -> None:
    """Sets the neck under this string alone; to a rigid one if nothing was found and the preset had something."""
    values = _neck_keys(document, string, result, resonances)
    if values and "neck" not in string:
        import tomlkit

        string["neck"] = tomlkit.table()
    if values.keys() & (TABLE_KEYS | RESONANCE_KEYS):
        for name in TABLE_KEYS | RESONANCE_KEYS:
            string["neck"].pop(name, None)
    for name, value in values.items():
        _put(string["neck"], name, value)


def _neck_keys(document: Any, string: Any, result: Identified, resonances: Sequence[Resonance]) -> dict[str, str]:
    """Keys of the neck under this string with their values in TOML."""
    pairs = result.conductance
    given = {**document.get("neck", {}), **string.get("neck", {})}
    if not pairs and given.keys() & {"conductance_values", "resonance_masses"}:
        pairs = ((result.law.fundamental, 0.0),)
    keys = _resonance_keys(resonances) if resonances else _table_keys(pairs) if pairs else {}
    if result.own is not None:
        keys["longer_across"] = f'"{result.own.longer * 1e3:.4g} mm"'
        if pairs or resonances:
            keys["stiffness_across"] = f"{result.own.stiffness:.4g}"
    return keys


def _put_onset(document: Any, bass: Instrument, string: str, onset: Onset) -> None:
    """Sets the pluck, the pickups under `string`, the tone and the gain, as far as they differ from those of `bass`."""
    import tomlkit

    length = bass.strings[bass.string_index(string)].length
    width, release = rounded(bass.player)
    player = {"pluck_position": f"{1 - onset.place / length:.4g}"}
    wider, slower = onset.rounding / width, onset.release / release if release else 0.0
    for name in ("rounding", "rounding_soft"):
        if value := getattr(bass.player, name) * wider:
            player[name] = _quantity(value, 1e-3, "mm", WIDTH_LIMITS)
    if slower:
        for name in ("release_time", "release_time_soft"):
            if value := getattr(bass.player, name) * slower:
                player[name] = _quantity(value, 1e-6, "us", RELEASE_LIMITS)
    else:
        player["release_time"] = _quantity(onset.release, 1e-6, "us", RELEASE_LIMITS)
    tables = {
        "player": player,
        "coil": {"tone": f"{onset.tone:.3g}"},
        "output": {"gain": f"{bass.output.gain * onset.gain:.4g}"},
    }
    for table, values in tables.items():
        if table not in document:
            document[table] = tomlkit.table()
        below = _cut_end(document[table])
        for name, value in values.items():
            _put(document[table], name, value)
        if below:
            document[table].value.body.extend((None, item) for item in below)
    ours = pickups_under(bass.output, string)
    under = [k for k, pickup in enumerate(bass.output.pickups) if any(pickup is p for p in ours)]
    for k, pickup in zip(under, onset.pickups, strict=True):
        below = _cut_end(document["pickup"][k])
        _put(document["pickup"][k], "position", f'"{pickup.position * 1e3:.4g} mm"')
        _put(document["pickup"][k], "level", f"{pickup.level:.4g}")
        if below:
            document["pickup"][k].value.body.extend((None, item) for item in below)


def _quantity(value: float, unit: float, name: str, limits: tuple[float, float]) -> str:
    return f'"{min(max(value, limits[0]), limits[1]) / unit:.4g} {name}"'


def _table_keys(pairs: Sequence[tuple[float, float]]) -> dict[str, str]:
    nu = _array("Hz", [x for x, _ in pairs], ".6g")
    return {
        "conductance_frequencies": nu,
        "conductance_values": _array("mm/s/N", [y * 1e3 for _, y in pairs], ".4g"),
    }


def _resonance_keys(resonances: Sequence[Resonance]) -> dict[str, str]:
    return {
        "resonance_frequencies": _array("Hz", [r.frequency for r in resonances], ".6g"),
        "resonance_qualities": f"[{', '.join(f'{r.quality:.3g}' for r in resonances)}]",
        "resonance_masses": _array("kg", [r.mass for r in resonances], ".3g"),
        "resonance_shapes": f"[{', '.join(str(r.shape) for r in resonances)}]",
    }


def _values(s: String, open_note: Any) -> dict[str, str]:
    """Keys of the string with their values in TOML."""
    note = {} if note_number(open_note) == s.open_note else {"open_note": f'"{note_name(s.open_note)}"'}
    return note | {
        "tension": f'"{s.tension:.6g} N"',
        "diameter": f'"{s.diameter * 1e3:.4g} mm"',
        "inharmonicity": f"{s.inharmonicity:.5g}",
        "stiffness_law": f'"{s.stiffness_law}"',
        "viscoelastic_angle": f"{s.viscoelastic_angle:.4g}",
        "thermoelastic": f"{s.thermoelastic:.3g}",
        "law_fundamental": f'"{s.law_fundamental:.6f} Hz"',
        "measured_frequencies": _array("Hz", s.measured_frequencies, ".9g"),
        "measured_dampings": _array("/s", s.measured_dampings, ".6g"),
    }


def _array(unit: str, values: Sequence[float], digits: str) -> str:
    """An array of quantities of one unit in TOML, eight a line."""
    shown = [format(v, digits) for v in values]
    lines = ["    " + ", ".join(shown[i : i + 8]) + ",\n" for i in range(0, len(shown), 8)]
    return f'{{unit = "{unit}", values = [\n{"".join(lines)}]}}'
