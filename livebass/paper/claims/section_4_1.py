"""Claims of section 4.1: contacts with the frets, spectrum and pitch in cases A, B and C, and the oblique pluck."""

from __future__ import annotations

import math

import numpy as np

from livebass.analysis.motion import Solved, string_shape
from livebass.paper.claims.expect import AtLeast, AtMost, Between, Claim, Exactly, Falling, Near, Nears, Rising, Value
from livebass.paper.claims.runs import (
    STATES_EVERY,
    centroid,
    centroid_at,
    contrast,
    difference,
    first_contact,
    first_fret,
    first_time,
    fret_times,
    frets,
    frets_and_pitch,
    fundamental_at,
    high_share,
    partial_levels,
    phase,
    set_frets,
    set_sizes,
    set_times,
)

EARLY = 0.1  # s
SHOWN = 0.6  # s, of the spectrograms in figures 5 and 9
PROMINENCE = 3.0  # dB
NOISE = 2e-3  # relative: the range of the fundamental by YIN of a string without contacts stays below
RAISED = 0.1  # share of the energy in high modes that counts as a transfer in progress


def second_hit(run: Solved) -> Value:
    """Time of the first contact with fret 1 after the first set, s."""
    times = fret_times(run, 1)
    return first_time(times[times > run.contacts.time_s[run.sets[0][-1]]]) if run.sets else math.nan


def released(run: Solved) -> list[float]:
    """Greatest displacement along u and along v at the release, m."""
    states = run.motion.states
    if states is None or states.shape[1] < 2:
        return [math.nan, math.nan]
    s = run.trial.speaking
    return [float(string_shape(s, q, np.linspace(0, s.length, 1000)).max()) for q in states[0, :, 0]]


def angle(run: Solved) -> Value:
    """Angle between the plane of the pluck and (xOy), degrees."""
    up, across = released(run)
    return math.degrees(math.atan2(up, across))


def across_over_up(run: Solved) -> Value:
    """v over u, root mean squares."""
    v = run.motion.across_m
    return math.nan if v is None else float(np.std(v) / np.std(run.motion.displacement_m))


def offset_across(run: Solved) -> Value:
    """Mean of v over the last 0.2 s, relative to its greatest value."""
    v = run.motion.across_m
    return math.nan if v is None else float(abs(v[-round(0.2 * run.rate) :].mean()) / np.abs(v).max())


def enrichment(run: Solved) -> Value:
    """Greatest share of the energy in high modes over the share at the release."""
    share = high_share(run)
    return float(share.max() / share[0])


def transfer_end(run: Solved) -> float:
    """Last time at which high modes have more than `RAISED` of the energy, s."""
    over = np.flatnonzero(high_share(run) > RAISED)
    return float(over[-1] * STATES_EVERY / run.rate) if over.size else 0.0


def highest_centroid(run: Solved) -> float:
    """The highest characteristic frequency of the first 0.1 s, Hz."""
    time, nu = centroid(run)
    return float(nu[time < EARLY].max())


def least_ratio(above: Solved, below: Solved) -> Value:
    """Characteristic frequency of `above` over that of `below`, the least over all times."""
    return float((centroid(above)[1] / centroid(below)[1]).min())


def variation(run: Solved) -> Value:
    """Range of the fundamental over the whole signal, relative to its last value."""
    nu = run.pitch.frequency_hz
    return float(np.ptp(nu) / nu[-1])


def stairs(run: Solved) -> Value:
    """Fundamental at each set of contacts but the first, Hz."""
    return fundamental_at(run, set_times(run)[1:])


def zone(run: Solved, frequency: float) -> Value:
    """Level of u in a band of 500 Hz over its two neighbours, in the time that the spectrograms show, dB."""
    return contrast(run.motion.displacement_m, run.rate, frequency, 500, 0, SHOWN)


def extremes_across(run: Solved, about: tuple[float, ...], sign: int) -> Value:
    """The partials of v nearest to `about` that stand out upwards (sign 1) or downwards (-1) by `PROMINENCE`, Hz."""
    from scipy.signal import find_peaks

    if run.motion.across_m is None:
        return [math.nan for _ in about]
    nu, level = partial_levels(run, run.motion.across_m, 40, 0, SHOWN)
    found = nu[find_peaks(sign * level, prominence=PROMINENCE)[0]]
    return [float(found[np.argmin(np.abs(found - f))]) if found.size else math.nan for f in about]


CLAIMS = (
    Claim(
        "a-no-contact", "4.1",
        "a sufficiently small maximal initial displacement (0.87 mm) so that no contact occurs",
        "contacts in case A",
        "", Exactly(0), ("a",), lambda run: int(run.contacts.fret.size),
    ),
    Claim(
        "abc-contacts", "4.1",
        "two others cases, labeled B and C, imply contacts between the string and a large number of frets",
        "frets met in B and C",
        "", AtLeast(10), ("b", "c"), lambda *runs: [len(frets(run)) for run in runs],
    ),
    Claim(
        "v-negligible", "4.1",
        "The string is excited along the (Oz) polarisation only [...]. The measured displacement along (Oy) is found "
        "to be negligible",
        "v over u, case B plucked 1 degree off the vertical",
        "", AtMost(0.05), ("b-tilted",), across_over_up,
    ),
    Claim(
        "b-first-contact", "4.1.1",
        "The first set of collisions occurs around 4 × 10^-3 s",
        "first contact of case B",
        "s", Near(4e-3, 0.1), ("b",), first_contact,
    ),
    Claim(
        "b-first-set", "4.1.1",
        "and the string hits 12 frets",
        "frets of the first set, case B",
        "", Exactly(tuple(range(1, 13))), ("b",), lambda run: set_frets(run, 1),
    ),
    Claim(
        "b-first-fret", "4.1.1",
        "the string first collides with the twelfth fret",
        "fret met first, case B",
        "", Exactly(12), ("b",), first_fret,
    ),
    Claim(
        "b-second-set", "4.1.1",
        "During the second set of collisions, the string touches frets 2 to 11",
        "frets of the second set, case B",
        "", Exactly(tuple(range(2, 12))), ("b",), lambda run: set_frets(run, 2),
    ),
    Claim(
        "b-fewer", "4.1.1",
        "Globally, less and less frets are hit",
        "frets in each set, case B",
        "", Falling(0.25), ("b",), set_sizes,
    ),
    Claim(
        "b-fret-1", "4.1.1",
        "the first fret is hit at the first collision, and a second time long after, around 0.05 s",
        "fret 1 after the first set, case B",
        "s", Near(0.05, 0.1), ("b",), second_hit,
    ),
    Claim(
        "b-phase", "4.1.1",
        "as long as contacts occur. This phenomenon lasts about 0.09 s",
        "first contact to last, case B",
        "s", Near(0.09, 0.15), ("b",), phase,
    ),
    Claim(
        "b-sensitive", "4.1.1",
        "the obtained sound is very sensitive to the height of the frets",
        "relative change of case B, fret 12 up by 0.1 mm, 0 to 0.12 s",
        "", AtLeast(0.1), ("b-fret-12", "b"), lambda changed, run: difference(changed, run, 0, 0.12),
    ),
    Claim(
        "c-first-set", "4.1.2",
        "During the first set of collisions, all the 20 frets are now hit",
        "frets of the first set, case C",
        "", Exactly(tuple(range(1, 21))), ("c",), lambda run: set_frets(run, 1),
    ),
    Claim(
        "c-more-frets", "4.1.2",
        "more frets collide with the string for a higher excitation amplitude",
        "frets met in cases A, B and C",
        "", Rising(), ("a", "b", "c"), lambda *runs: [len(frets(run)) for run in runs],
    ),
    Claim(
        "c-fewer", "4.2.2",
        "a global decrease of the number of hit frets arises. This behaviour is similar to cases B and C",
        "frets in each set, case C",
        "", Falling(0.25), ("c",), set_sizes,
    ),
    Claim(
        "oblique-angle", "4.1.3",
        "an angle of about 55 degrees between the excitation plane and (xOy)",
        "angle at the release",
        "deg", Near(55, 0.02), ("oblique",), angle,
    ),
    Claim(
        "oblique-pluck", "4.1.3",
        "u_0,max = 3.1 mm along (Oz) and v_0,max = 2.2 mm along (Oy)",
        "greatest u and v at the release",
        "m", Nears((3.1e-3, 2.2e-3), 0.02), ("oblique",), released,
    ),
    Claim(
        "oblique-rest", "2.1",
        "such a friction force only allows one equilibrium position",
        "mean of v over the last 0.2 s, part of its greatest",
        "", AtMost(0.01), ("oblique",), offset_across,
    ),
    Claim(
        "a-centroid", "4.1.1",
        "In case A, νc slightly decreases in time",
        "nu_c at 0.95 s over that at 0.05 s",
        "", Between(0.5, 0.98), ("a",), lambda run: centroid_at(run, 0.95) / centroid_at(run, 0.05),
    ),
    Claim(
        "b-energy", "4.1.1",
        "a large amount of energy is transmitted to higher modes",
        "part of the energy above mode 20: greatest over at the release, case B",
        "", AtLeast(5), ("b",), enrichment,
    ),
    Claim(
        "b-4500", "4.1.1",
        "some reinforced spectral zones can be clearly identified, for instance around 4500 Hz",
        "4250 to 4750 Hz over the bands beside it, case B, 0 to 0.6 s",
        "dB", AtLeast(3), ("b",), lambda run: zone(run, 4500),
    ),
    Claim(
        "abc-centroid", "4.1.1",
        "In cases B and C, the spectral enrichment occurring in the first instants is clearly visible, and more "
        "pronounced in case C",
        "greatest nu_c of the first 0.1 s, cases A, B, C",
        "Hz", Rising(0.5), ("a", "b", "c"), lambda *runs: [highest_centroid(run) for run in runs],
    ),
    Claim(
        "b-starts-high", "4.1.1",
        "the period at the very beginning of the signal seems to be shorter than in case A",
        "fundamental at the beginning, cases A and B",
        "Hz", Rising(0.05), ("a", "b"), lambda *runs: [fundamental_at(run, [0.0])[0] for run in runs],
    ),
    Claim(
        "b-glide", "4.1.1",
        "the fundamental frequency is higher than in the rest of the signal [...] a substantial frequency glide",
        "fundamental at the beginning over that at 0.5 s, case B",
        "", AtLeast(1.05), ("b",), lambda run: fundamental_at(run, [0.0])[0] / fundamental_at(run, [0.5])[0],
    ),
    Claim(
        "b-stairs", "4.1.1",
        "a decrease of the fundamental frequency arises each time the neck is hit",
        "fundamental at each set of contacts, case B",
        "Hz", Falling(NOISE), ("b",), stairs,
    ),
    Claim(
        "b-frets-pitch", "4.1.1",
        "the smaller the number of hit frets is, the lower the frequency is",
        "correlation of both over the sets, case B",
        "", AtLeast(0.8), ("b",), frets_and_pitch,
    ),
    Claim(
        "c-energy", "4.1.2",
        "the energy transfer to high frequencies is more substantial than in case B",
        "greatest part of the energy above mode 20, cases B and C",
        "", Rising(0.2), ("b", "c"), lambda *runs: [float(high_share(run).max()) for run in runs],
    ),
    Claim(
        "c-energy-longer", "4.1.2",
        "[the energy transfer] lasts longer",
        "until when modes above 20 have a tenth of the energy, cases B and C",
        "s", Rising(0.2), ("b", "c"), lambda *runs: [transfer_end(run) for run in runs],
    ),
    Claim(
        "c-centroid", "4.1.2",
        "much higher characteristic frequencies during the whole signal",
        "nu_c of C over that of B, the least of 1 s",
        "", AtLeast(1.2), ("c", "b"), least_ratio,
    ),
    Claim(
        "c-stairs", "4.1.2",
        "The staircase-like behaviour of the fundamental frequency is also retrieved",
        "fundamental at each set of contacts, case C",
        "Hz", Falling(0.01), ("c",), stairs,
    ),
    Claim(
        "glide-a", "4.1.2",
        "the pitch glide is only driven by the contact times",
        "relative range of the fundamental, case A",
        "", AtMost(NOISE), ("a",), variation,
    ),
    Claim(
        "glide-c-far", "4.1.2",
        "and not by the geometrical nonlinearity",
        "relative range of the fundamental, case C with the frets out of reach",
        "", AtMost(NOISE), ("c-far",), variation,
    ),
    Claim(
        "oblique-low", "4.1.3",
        "for the horizontal displacement v, a low energy for the frequency about 2400 Hz",
        "the partial nearest to it that is 3 dB weaker than those beside it",
        "Hz", Nears((2400,), 0.05), ("oblique",), lambda run: extremes_across(run, (2400,), -1),
    ),
    Claim(
        "oblique-zones", "4.1.3",
        "and reinforced frequencies around 600, 900 and 1400 Hz are observed",
        "the partials nearest to these that are 3 dB stronger than those beside them",
        "Hz", Nears((600, 900, 1400), 0.05), ("oblique",), lambda run: extremes_across(run, (600, 900, 1400), 1),
    ),
)  # fmt: skip
