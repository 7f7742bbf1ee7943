"""Claims of section 4.1: cases A, B, C and the oblique pluck at the frets, in the spectrum and in pitch."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from livebass.lab.analysis.motion import Solved, first_of, states_of, string_shape
from livebass.lab.paper.claims import expect, runs
from livebass.lab.paper.claims.expect import Claim, Value, each
from livebass.lab.paper.claims.null import DRAWS, SEED, SETS_SHUFFLED
from livebass.rows.arrays import Floats

EARLY = 0.1  # s
SHOWN = 0.6  # s, of the spectrograms in figures 5 and 9
PROMINENCE = 3.0  # dB
PARTIALS = 40  # up to 4 kHz
IN_TUNE = 0.05  # relative distance of a partial from the paper's frequency, at most
NOISE = 2e-3  # relative: the YIN fundamental of a string without contacts varies less
RAISED = 0.1  # share of the energy in high modes that counts as an ongoing transfer


def second_hit(run: Solved) -> Value:
    """Time of the first contact with fret 1 after the first set, s."""
    times = runs.fret_times(run, 1)
    return first_of(times[times > run.contacts.time_s[run.sets[0][-1]]]) if run.sets else math.nan


def at_release(run: Solved) -> list[float]:
    """Greatest displacement along u and along v at the release, m."""
    s = run.trial.speaking
    return [float(string_shape(s, q, np.linspace(0, s.length, 1000)).max()) for q in states_of(run)[0, :, 0]]


def angle(run: Solved) -> Value:
    """Angle between the plane of the pluck and (xOy), degrees."""
    up, across = at_release(run)
    return math.degrees(math.atan2(up, across))


def across_over_up(run: Solved) -> Value:
    """v over u, root mean squares."""
    return float(np.std(run.displacement(across=True)) / np.std(run.motion.displacement_m))


def offset_across(run: Solved) -> Value:
    """Mean of v over the last 0.2 s, relative to its greatest value."""
    v = run.displacement(across=True)
    return float(abs(v[-round(0.2 * run.rate) :].mean()) / np.abs(v).max())


def enrichment(run: Solved) -> Value:
    """Greatest share of the energy in high modes, relative to the share at the release."""
    share = runs.high_share(run)
    return float(share.max() / share[0])


def transfer_end(run: Solved) -> float:
    """Last time at which high modes have more than `RAISED` of the energy, s."""
    over = np.flatnonzero(runs.high_share(run) > RAISED)
    return float(over[-1] * runs.STATES_EVERY / run.rate) if over.size else 0.0


def highest_centroid(run: Solved) -> float:
    """The highest characteristic frequency of the first 0.1 s, Hz."""
    time, nu = runs.centroid(run)
    return float(nu[time < EARLY].max())


def min_ratio(above: Solved, below: Solved) -> Value:
    """Least ratio of the characteristic frequencies of `above` and `below` over all times."""
    return float((runs.centroid(above)[1] / runs.centroid(below)[1]).min())


def variation(run: Solved) -> Value:
    """Range of the fundamental over the whole signal, relative to its last value."""
    nu = run.pitch.frequency_hz
    return float(np.ptp(nu) / nu[-1])


def stairs(run: Solved) -> Value:
    """Fundamental at each set of contacts except the first, Hz."""
    return runs.fundamental_at(run, runs.set_times(run)[1:])


def zones(run: Solved, *frequencies: float) -> list[float]:
    """Levels of u in bands of 500 Hz over their two neighbours, within the duration of the spectrograms, dB."""
    return runs.contrasts(run.motion.displacement_m, run.rate, frequencies, 500, 0, SHOWN)


def random_zones(claim: Claim, _: Value, run: Solved) -> float:
    """Share of bands anywhere from 0.75 to 7.75 kHz that meet the expectation."""
    levels = zones(run, *np.random.default_rng(SEED).uniform(750, 7750, DRAWS).tolist())
    return float(np.mean([claim.expects.holds(level) for level in levels]))


def extremes(run: Solved, sign: int) -> tuple[Floats, Floats]:
    """The first `PARTIALS` partials, Hz, and the peaks of v among them by `PROMINENCE` (sign 1), or the dips (-1)."""
    from scipy.signal import find_peaks

    nu, level = runs.partial_levels(run, run.displacement(across=True), PARTIALS, 0, SHOWN)
    return nu, nu[find_peaks(sign * level, prominence=PROMINENCE)[0]]


def nearest(found: Floats, about: Sequence[float]) -> list[float]:
    """Returns, for each of `about`, the nearest value of `found`; NaN if nothing was found."""
    return [float(found[np.argmin(np.abs(found - f))]) if found.size else math.nan for f in about]


def random_partials(sign: int) -> expect.Null:
    """Frequencies drawn evenly over the partials, instead of the paper's."""

    def rate(claim: Claim, _: Value, run: Solved) -> float:
        rng, (nu, found) = np.random.default_rng(SEED), extremes(run, sign)
        drawn = rng.uniform(nu[0], nu[-1], size=(DRAWS, len(claim.expects.centres))).tolist()
        return float(np.mean([expect.Nears(tuple(f), IN_TUNE).holds(nearest(found, f)) for f in drawn]))

    return expect.Null("other frequencies up to 4 kHz in place of the paper's", rate)


def clearances(run: Solved) -> Value:
    """Distance of the string from the nearest fret at the `SHAPE_TIMES` except 4.3 ms, m; negative: pressed into it."""
    _, x, (shapes,) = run.shapes(runs.SHAPE_TIMES)
    s = run.trial.speaking
    over = (np.interp(s.contact_position, x, shape) - s.contact_height for shape in np.delete(shapes, 3, axis=0))
    return [float(gap.min()) for gap in over]


def first_set(run: Solved) -> Value:
    """Start and end of the first set of contacts, s."""
    return run.contacts.time_s[run.sets[0][[0, -1]]].tolist() if run.sets else [math.nan, math.nan]


CLAIMS = (
    Claim(
        "a-no-contact", "4.1", "A pluck of 0.87 mm, case A, touches no fret",
        "contacts in case A", "", expect.Exactly(0), expect.PAPER, ("a",), lambda run: int(run.contacts.fret.size),
    ),
    Claim(
        "abc-contacts", "4.1", "In cases B and C many frets are met",
        "frets met in B and C", "", expect.AtLeast(10), expect.OURS, ("b", "c"), each(lambda run: len(runs.frets(run))),
    ),
    Claim(
        "v-negligible", "4.1", "After a vertical pull the string hardly moves sideways",
        "v over u, case B plucked 1 degree off the vertical", "", expect.AtMost(0.05), expect.OURS, ("b-tilted",),
        across_over_up,
    ),
    Claim(
        "b-first-contact", "4.1.1, fig. 7a", "Case B: the string reaches the frets after some 4 ms",
        "first contact of case B", "s", expect.Near(4e-3, 0.1), expect.PAPER, ("b",), runs.first_contact,
    ),
    Claim(
        "b-first-set", "4.1.1, fig. 7a", "Case B: twelve frets, the first to the twelfth, are in the first set",
        "frets of the first set, case B", "", expect.Exactly(tuple(range(1, 13))), expect.PAPER,
        ("b",), lambda run: runs.set_frets(run, 1),
    ),
    Claim(
        "b-first-fret", "4.1.1, fig. 7a", "Case B: fret 12 is the first to be met",
        "fret met first, case B", "", expect.Exactly(12), expect.PAPER, ("b",), runs.first_fret,
    ),
    Claim(
        "b-shape-times", "4.1.1, fig. 8", "Case B: the shapes drawn for 3.5 to 4.7 ms enclose the first set",
        "start and end of the first set, case B", "s", expect.Between(3.5e-3, 4.7e-3), expect.PAPER, ("b",), first_set,
    ),
    Claim(
        "b-shapes", "4.1.1, fig. 8", "Case B: the string nears the frets at 3.5 ms, lies on them at 3.9 and 4.1 ms, "
        "and is off again at 4.7 ms", "distance from the nearest fret at 3.5, 3.9, 4.1 and 4.7 ms, case B",
        "m", expect.Each((expect.AtLeast(1e-5), expect.AtMost(1e-5), expect.AtMost(1e-5), expect.AtLeast(1e-5))),
        expect.OURS, ("b-shapes",), clearances,
    ),
    Claim(
        "b-second-set", "4.1.1, fig. 7a", "Case B: frets 2 to 11 are in the second set",
        "frets of the second set, case B", "", expect.Exactly(tuple(range(2, 12))), expect.PAPER,
        ("b",), lambda run: runs.set_frets(run, 2),
    ),
    Claim(
        "b-fewer", "4.1.1, fig. 7a", "Case B: by and large each set has fewer frets than the one before",
        "frets in each set, case B", "", expect.Falling(0.25), expect.DIRECTION, ("b",), runs.set_sizes,
    ),
    Claim(
        "b-fret-1", "4.1.1, fig. 7a", "Case B: fret 1 is met in the first set and then not until about 0.05 s",
        "fret 1 after the first set, case B", "s", expect.Near(0.05, 0.1), expect.ONE_PLUCK, ("b",), second_hit,
    ),
    Claim(
        "b-phase", "4.1.1, fig. 5", "Case B: contacts go on for about 0.09 s",
        "first contact to last, case B", "s", expect.Near(0.09, 0.15), expect.ONE_PLUCK, ("b",), runs.phase,
    ),
    Claim(
        "step-half", "4.1.1", "A finer grid changes nothing that matters: half the step",
        "case B at 0.5 mm by brute force against 1 mm, 0 to 20 ms, relative", "", expect.AtMost(0.1), expect.PAPER,
        ("b-half-step", "b"), lambda finer, run: runs.difference(finer, run, 0, 0.02),
    ),
    Claim(
        "step-finer", "4.1.1", "A finer grid changes nothing that matters: nu_c moves by less than the 0.2 by which "
        "paper and recording differ",
        "greatest relative change of nu_c over 1 s, case B at 0.84 mm against 1 mm", "", expect.AtMost(0.2),
        expect.PAPER, ("b-finer", "b"), runs.greatest_change,
    ),
    Claim(
        "step-frets", "4.1.1", "A finer grid changes less than a fret of another height does",
        "relative change of case B, 0 to 0.12 s: grid of 0.84 mm; fret 12 up by 0.1 mm", "", expect.Rising(),
        expect.DIRECTION, ("b-finer", "b-fret-12", "b"),
        lambda *solved: [runs.difference(run, solved[-1], 0, 0.12) for run in solved[:-1]],
    ),
    Claim(
        "b-sensitive", "4.1.1", "The height of a fret has much influence on the sound",
        "relative change of case B, fret 12 up by 0.1 mm, 0 to 0.12 s", "", expect.AtLeast(0.1), expect.OURS,
        ("b-fret-12", "b"), lambda changed, run: runs.difference(changed, run, 0, 0.12),
    ),
    Claim(
        "c-first-set", "4.1.2, fig. 7b", "Case C: the first set has all 20 frets",
        "frets of the first set, case C", "", expect.Exactly(tuple(range(1, 21))), expect.PAPER,
        ("c",), lambda run: runs.set_frets(run, 1),
    ),
    Claim(
        "c-more-frets", "4.1.2, fig. 7b", "The harder the pluck, the more frets are met",
        "frets met in cases A, B and C", "", expect.Rising(), expect.DIRECTION,
        ("a", "b", "c"), each(lambda run: len(runs.frets(run))),
    ),
    Claim(
        "c-fewer", "4.2.2, fig. 7b", "Case C: by and large each set has fewer frets than the one before",
        "frets in each set, case C", "", expect.Falling(0.25), expect.DIRECTION, ("c",), runs.set_sizes,
    ),
    Claim(
        "oblique-angle", "4.1.3", "The oblique pluck goes up at about 55 degrees",
        "angle at the release", "deg", expect.Near(55, 0.02), expect.SETUP, ("oblique",), angle,
    ),
    Claim(
        "oblique-pluck", "4.1.3, fig. 9", "The oblique pluck is 3.1 mm up and 2.2 mm across",
        "greatest u and v at the release", "m", expect.Nears((3.1e-3, 2.2e-3), 0.02), expect.SETUP, ("oblique",),
        at_release,
    ),
    Claim(
        "oblique-rest", "2.1, eq. 7", "Under this friction the string comes to rest in one place only, the middle",
        "mean of v over the last 0.2 s, part of its greatest", "", expect.AtMost(0.01), expect.OURS, ("oblique",),
        offset_across,
    ),
    Claim(
        "a-centroid", "4.1.1, fig. 6", "Case A: the characteristic frequency falls a little",
        "nu_c at 0.95 s over that at 0.05 s", "", expect.Between(0.5, 0.98), expect.OURS,
        ("a",), lambda run: runs.centroid_at(run, 0.95) / runs.centroid_at(run, 0.05),
    ),
    Claim(
        "b-energy", "4.1.1, fig. 5", "Case B: contacts bring much energy into high modes",
        "part of the energy above mode 20: greatest over at the release, case B", "", expect.AtLeast(5), expect.OURS,
        ("b",), enrichment,
    ),
    Claim(
        "b-4500", "4.1.1, fig. 5", "Case B: the spectrum has bands that stand out, one of them near 4.5 kHz",
        "4250 to 4750 Hz over the bands beside it, case B, 0 to 0.6 s", "dB", expect.AtLeast(3), expect.OURS,
        ("b",), lambda run: zones(run, 4500)[0], null=expect.Null("other bands from 0.75 to 7.75 kHz", random_zones),
    ),
    Claim(
        "abc-centroid", "4.1.1, fig. 6", "The spectrum grows richer at first in case B, and more so in case C",
        "greatest nu_c of the first 0.1 s, cases A, B, C", "Hz", expect.Rising(0.5), expect.DIRECTION,
        ("a", "b", "c"), each(highest_centroid),
    ),
    Claim(
        "b-starts-high", "4.1.1, fig. 4", "Case B begins with shorter periods than case A",
        "fundamental at the beginning, cases A and B", "Hz", expect.Rising(0.05), expect.DIRECTION,
        ("a", "b"), each(lambda run: runs.fundamental_at(run, [0.0])[0]),
    ),
    Claim(
        "b-glide", "4.1.1, fig. 7a", "Case B: the fundamental begins high and glides down by a good deal",
        "fundamental at the beginning over that at 0.5 s, case B", "", expect.AtLeast(1.05), expect.OURS,
        ("b",), lambda run: runs.fundamental_at(run, [0.0])[0] / runs.fundamental_at(run, [0.5])[0],
    ),
    Claim(
        "b-glide-size", "4.1.1, fig. 7a", "Case B: the glide is of the size of the axis, whose last mark is 0.2",
        "greatest relative variation of the fundamental, case B; within half a mark", "", expect.Near(0.2, 0.25),
        expect.AXIS, ("b",), runs.glide_size,
    ),
    Claim(
        "b-stairs", "4.1.1, fig. 7a", "Case B: with each set of contacts the fundamental goes down a step",
        "fundamental at each set of contacts, case B", "Hz", expect.Falling(NOISE), expect.DIRECTION, ("b",), stairs,
    ),
    Claim(
        "b-frets-pitch", "4.1.1, fig. 7a", "Case B: the fundamental follows the number of frets in a set",
        "correlation of both over the sets, case B", "", expect.AtLeast(0.8), expect.OURS,
        ("b",), runs.frets_and_pitch, null=SETS_SHUFFLED,
    ),
    Claim(
        "c-energy", "4.1.2, fig. 5", "High modes get more energy in case C than in case B",
        "greatest part of the energy above mode 20, cases B and C", "", expect.Rising(0.2), expect.DIRECTION,
        ("b", "c"), each(lambda run: float(runs.high_share(run).max())),
    ),
    Claim(
        "c-energy-longer", "4.1.2, fig. 5", "High modes keep that energy longer in case C than in case B",
        "until when modes above 20 have a tenth of the energy, cases B and C", "s", expect.Rising(0.2),
        expect.DIRECTION, ("b", "c"), each(transfer_end),
    ),
    Claim(
        "c-centroid", "4.1.2, fig. 6", "The characteristic frequency of case C is well above that of case B throughout",
        "nu_c of C over that of B, the least of 1 s", "", expect.AtLeast(1.2), expect.OURS, ("c", "b"), min_ratio,
    ),
    Claim(
        "c-glide-size", "4.1.2, fig. 7b", "Case C: the glide is of the size of the axis, whose last mark is 0.3",
        "greatest relative variation of the fundamental, case C; within half a mark", "", expect.Near(0.3, 1 / 6),
        expect.AXIS, ("c",), runs.glide_size,
    ),
    Claim(
        "c-stairs", "4.1.2, fig. 7b", "Case C: the fundamental goes down in steps as in case B",
        "fundamental at each set of contacts, case C", "Hz", expect.Falling(0.01), expect.DIRECTION, ("c",), stairs,
    ),
    Claim(
        "glide-a", "4.1.2", "Without contacts the pitch does not glide",
        "relative range of the fundamental, case A", "", expect.AtMost(NOISE), expect.OURS, ("a",), variation,
    ),
    Claim(
        "glide-c-far", "4.1.2", "Large amplitudes alone make no glide",
        "relative range of the fundamental, case C with the frets out of reach", "", expect.AtMost(NOISE), expect.OURS,
        ("c-far",), variation,
    ),
    Claim(
        "oblique-low", "4.1.3, fig. 9", "Oblique pluck: v is weak near 2400 Hz",
        "the partial nearest to it that is 3 dB weaker than those beside it", "Hz", expect.Nears((2400,), IN_TUNE),
        expect.PAPER, ("oblique",), lambda run: nearest(extremes(run, -1)[1], (2400,)), null=random_partials(-1),
    ),
    Claim(
        "oblique-zones", "4.1.3, fig. 9", "Oblique pluck: v is strong near 600, 900 and 1400 Hz",
        "the partials nearest to these that are 3 dB stronger than those beside them",
        "Hz", expect.Nears((600, 900, 1400), IN_TUNE), expect.PAPER,
        ("oblique",), lambda run: nearest(extremes(run, 1)[1], (600, 900, 1400)), null=random_partials(1),
    ),
)  # fmt: skip
