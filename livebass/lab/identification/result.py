"""An identified string: laws and losses from its partials, and the resulting string and neck."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from livebass.lab.identification.across import Across, Own, across, fit_own, heard_of_both
from livebass.lab.identification.common_partials import Heard
from livebass.lab.identification.fit import Law, Losses, fit_laws, fit_losses, rigid_neck
from livebass.lab.identification.glide import Glide
from livebass.lab.identification.onset import Onset
from livebass.lab.identification.partials import Found, RecordingError, Take
from livebass.model.instrument import Instrument, Neck, String, speaking
from livebass.model.modes import dampings, frequencies, impedance
from livebass.model.neck import Admittance, Resonance
from livebass.rows.arrays import Ints
from livebass.rows.units import cents, note_name


@dataclass(frozen=True)
class Identified:
    """An open string identified from recordings by `identify`."""

    string: String  #: the base preset's, with everything measured and fitted
    conductance: tuple[tuple[float, float], ...]  #: (Hz, m/s/N) of the neck under it; empty: none found
    partials: tuple[Found, ...]
    law: Law  #: describes the partials better ...
    other: Law  #: ... than this one
    takes: tuple[Take, ...]
    rejected: int  #: takes of another pitch, too short, or without enough partials
    missing: tuple[int, ...]  #: partials below the highest, not found or doubtful: `string` takes values from the laws
    doubts: tuple[str, ...]  #: a sentence each: material left out or changed in the recordings, and the reason
    glides: tuple[Glide | None, ...]  #: of the takes: the initial sharpness; already removed from the partials
    across: Across | None  #: how v differs from u; None: no partial is two lines
    own: Own | None  #: the law of v for a preset; None: keep the base preset's
    level_across: float  #: v over u in the base preset; the dampings of `string` are those of u that match it
    #: pluck, pickups and tone from the levels of partials; None: not requested, or impossible
    onset: Onset | None = None


def numbers(found: Sequence[Found]) -> Ints:
    return np.array([p.number for p in found], np.int64)


def laws_of(found: Sequence[Found], base: String) -> tuple[Law, Law]:
    return fit_laws(numbers(found), np.array([p.frequency for p in found]), base)


def check_pitch(string: String, frequency: float, all_strings: str = "") -> None:
    if abs(cents(frequency / string.frequency(string.open_note))) > 100:
        strings = (
            f"the open strings ({all_strings})" if all_strings else f"the open string ({note_name(string.open_note)})"
        )
        raise RecordingError(
            f"the note is {frequency:.2f} Hz, more than a semitone from {strings}; only open strings can be "
            "identified; for another tuning give --string and --note"
        )


def nearest_string(bass: Instrument, frequency: float) -> String:
    """Returns the string of `bass` tuned nearest to `frequency` (Hz); raises RecordingError beyond a semitone."""
    best = min(bass.strings, key=lambda s: abs(cents(frequency / s.frequency(s.open_note))))
    check_pitch(best, frequency, ", ".join(f"{s.name} {note_name(s.open_note)}" for s in bass.strings))
    return best


def tune_string(base: String, law: Law, note: int | None) -> String:
    """`base` with the f0 and B found, and the tension that they need, as in table 1 of the paper."""
    string = replace(base, open_note=base.open_note if note is None else note)
    check_pitch(string, law.fundamental)
    tension = base.linear_density * (2 * base.length * law.fundamental) ** 2
    return replace(
        string, tension=tension, inharmonicity=law.inharmonicity, stiffness_law=law.stiffness_law,
        law_fundamental=law.fundamental,
        relaxation=0.0, extra_damping=0.0, extra_damping_slope=0.0, measured_frequencies=(), measured_dampings=(),
    )  # fmt: skip


def _losses(fitted: String, neck: Neck, found: Sequence[Found], level: float) -> tuple[Losses, Own | None]:
    """The losses of u, and the law of v if it explains the partials of two lines; else audible losses, and None."""
    number, deviation = numbers(found), np.array([p.damping_u for p in found]) / 2
    heard = fit_losses(fitted, neck, number, np.array([p.damping for p in found]), deviation)
    if level == 0:
        return heard, None
    of_u = np.array([p.damping if p.v is None else p.u.damping for p in found])
    losses = fit_losses(fitted, neck, number, of_u, deviation)
    lossy = _lossy(fitted, losses)
    own = fit_own(lossy, _neck_with(neck, lossy, losses.admittance, None), found)
    return (losses, own) if own else (heard, None)


def _lossy(string: String, losses: Losses) -> String:
    return replace(
        string, diameter=losses.diameter, viscoelastic_angle=losses.viscoelastic_angle,
        thermoelastic=losses.thermoelastic,
    )  # fmt: skip


def _neck_with(neck: Neck, string: String, y: Admittance, own: Own | None) -> Neck:
    """A neck with only `y` under the open `string`, and with the law of v found, or the law of `neck`."""
    stiffness, longer = (own.stiffness, own.longer) if own else (neck.stiffness_across, neck.longer_across)
    return replace(rigid_neck(string), admittance=y, stiffness_across=stiffness, longer_across=longer)


def with_modes(string: String, neck: Neck, found: Sequence[Found], level: float, own: Own | None) -> String:
    """The string with its measured modes; missing ones follow its laws, so there is no gap."""
    s, count = speaking(string, neck, 0), found[-1].number
    nu, sigma = frequencies(s, count), dampings(s, count)
    for p in found:
        nu[p.number - 1] = p.frequency
    for j in missing(found):  # the law's value may not lie between the neighbours
        below = nu[j - 2] if j > 1 else 0.0
        above = next(p for p in found if p.number > j)
        if not below < nu[j - 1] < above.frequency:
            nu[j - 1] = below + (above.frequency - below) / (above.number - j + 1)
    sigma[numbers(found) - 1] = heard_of_both(s, found, level, own is not None)
    return replace(string, measured_frequencies=tuple(map(float, nu)), measured_dampings=tuple(map(float, sigma)))


def missing(found: Sequence[Found]) -> tuple[int, ...]:
    """The partials below the highest that were not found."""
    have = {p.number for p in found}
    return tuple(j for j in range(1, found[-1].number + 1) if j not in have)


def identified_string(
    base: String, neck: Neck, laws: tuple[Law, Law], found: Sequence[Found], level: float, heard: Heard, rejected: int
) -> Identified:
    """The string `base` over its `neck` by the `laws` of its partials, without pluck, pickups and tone.

    level: v over u in the base preset. `base` already has the tension of its law.
    """
    losses, own = _losses(base, neck, found, level)
    string, neck = _lossy(base, losses), _neck_with(neck, base, losses.admittance, own)
    s = speaking(string, neck, 0)
    return Identified(
        string=with_modes(string, neck, found, level, own),
        conductance=losses.conductance,
        partials=tuple(found),
        law=laws[0],
        other=laws[1],
        takes=tuple(note.take for note in heard.notes),
        rejected=rejected,
        missing=missing(found),
        doubts=heard.doubts,
        glides=tuple(note.glide for note in heard.notes),
        across=across(found, impedance(s), s.fundamental),
        own=own,
        level_across=level,
    )


def with_resonances(result: Identified, bass: Instrument, resonances: Sequence[Resonance]) -> Identified:
    """Returns `result`, found with `bass`, with the law of v and the dampings of u for a neck of `resonances`."""
    base = bass.neck(result.string.name)
    y, found = Admittance(tuple(resonances)), result.partials
    unmeasured = replace(result.string, measured_frequencies=(), measured_dampings=())
    own = fit_own(unmeasured, _neck_with(base, unmeasured, y, None), found) if result.level_across else None
    sigma = np.array(result.string.measured_dampings)
    s = speaking(unmeasured, _neck_with(base, unmeasured, y, own), 0)
    sigma[numbers(found) - 1] = heard_of_both(s, found, result.level_across, own is not None)
    return replace(result, string=replace(result.string, measured_dampings=tuple(map(float, sigma))), own=own)
