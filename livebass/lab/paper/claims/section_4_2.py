"""Claims of section 4.2: dispersion, the plucking point, the neck's adjustment and the stiffness of the contact."""

from __future__ import annotations

import math

from livebass.lab.analysis.motion import Solved, first_of
from livebass.lab.paper.claims import expect, runs
from livebass.lab.paper.claims.expect import Claim, Value, each
from livebass.lab.paper.claims.null import SETS_SHUFFLED

EARLY = 0.1  # s
AFTER = slice(2, 8)  # the third to the eighth set
HIGHEST = 60  # modes above this one are over 6 kHz


def earlier(run: Solved, other: Solved) -> Value:
    """Lead of the sets of `other` over the sets of `run`, from the third to the eighth, s."""
    return [a - b for a, b in zip(runs.set_times(run)[AFTER], runs.set_times(other)[AFTER], strict=False)]


def mean_size(run: Solved) -> float:
    """Mean number of frets in the third to the eighth set."""
    return sum(runs.set_sizes(run)[AFTER]) / (AFTER.stop - AFTER.start)


def first_set_size(run: Solved) -> int:
    """Number of frets in the first set."""
    return len(runs.set_frets(run, 1))


def gap_12(run: Solved) -> float:
    """Gap under the string at fret 12, m."""
    s = run.trial.speaking
    return -s.contact_height[s.contact_fret.index(12)]


def turns(run: Solved) -> Value:
    """Numbers of maxima and of minima of the fundamental up to 0.8 s with a prominence of 1 Hz or more."""
    from scipy.signal import find_peaks

    p = run.pitch
    nu = p.frequency_hz[p.time_s < 0.8]
    return [len(find_peaks(sign * nu, prominence=1.0)[0]) for sign in (1, -1)]


def highest_level(run: Solved) -> float:
    """Mean energy above 6 kHz over the first 0.1 s, relative to the total energy at the release, dB."""
    e = runs.energies(run)
    return 10 * math.log10(e[1:11, HIGHEST:].sum(axis=1).mean() / e[0].sum())


def by_contacts(*solved: Solved) -> Value:
    """Greatest fraction of the energy above mode 20 in the first 0.1 s, by the number of contacts in that time."""
    return [float(runs.high_share(run)[:11].max()) for run in sorted(solved, key=lambda run: runs.count(run, 0, EARLY))]


CLAIMS = (
    Claim(
        "harmonic-third-set", "4.2.1, fig. 7a", "Case B: the third set of contacts begins near 0.02 s",
        "third set of case B", "s", expect.Near(0.02, 0.1), expect.PAPER,
        ("b",), lambda run: runs.set_times(run)[2] if len(run.sets) > 2 else math.nan,
    ),
    Claim(
        "harmonic-earlier", "4.2.1, fig. 7a", "Without dispersion the sets come earlier, from the third on",
        "by how much, sets 3 to 8", "s", expect.AtLeast(1e-6), expect.DIRECTION, ("b", "harmonic"), earlier,
    ),
    Claim(
        "harmonic-longer", "4.2.1, fig. 7a", "Without dispersion contacts go on for longer",
        "first contact to last, with dispersion and without", "s", expect.Rising(0.2), expect.DIRECTION,
        ("b", "harmonic"), each(runs.phase),
    ),
    Claim(
        "harmonic-phase", "4.2.1, fig. 10", "Without dispersion contacts go on for about 0.15 s",
        "first contact to last without dispersion", "s", expect.Near(0.15, 0.1), expect.ONE_PLUCK, ("harmonic",),
        runs.phase,
    ),
    Claim(
        "harmonic-frets", "4.2.1, fig. 7a", "Without dispersion the sets lose their frets more slowly",
        "frets a set, sets 3 to 8, with dispersion and without", "", expect.Rising(0.1), expect.DIRECTION,
        ("b", "harmonic"), each(mean_size),
    ),
    Claim(
        "harmonic-glide", "4.2.1, fig. 7a", "Without dispersion the glide takes longer",
        "until when the fundamental is 0.5 % over its last value, with dispersion and without",
        "s", expect.Rising(0.2), expect.DIRECTION, ("b", "harmonic"), each(lambda run: runs.glide_end(run, 0.005)),
    ),
    Claim(
        "point-phases", "4.2.2, fig. 11d",
        "A pluck in the middle has the shortest time of contacts, one at the nut the longest",
        "first contact to last: middle, near bridge, near nut", "s", expect.Rising(0.2), expect.DIRECTION,
        ("middle", "near-bridge", "near-nut"), each(runs.phase),
    ),
    Claim(
        "bridge-fewer", "4.2.2, fig. 11d", "Plucked near the bridge: by and large each set has fewer frets",
        "frets in each set", "", expect.Falling(0.25), expect.DIRECTION, ("near-bridge",), runs.set_sizes,
    ),
    Claim(
        "middle-fewer", "4.2.2, fig. 11d", "Plucked in the middle: by and large each set has fewer frets",
        "frets in each set", "", expect.Falling(0.25), expect.DIRECTION, ("middle",), runs.set_sizes,
    ),
    Claim(
        "bridge-highs", "4.2.2, fig. 11a", "Plucked near the bridge: the more contacts, the more highs",
        "greatest part of the energy above mode 20, plucks of 1.5, 2.5, 3.6 and 5 mm in the order of their contacts "
        "in 0.1 s", "", expect.Rising(), expect.DIRECTION, ("bridge-1.5", "bridge-2.5", "near-bridge", "bridge-5"),
        by_contacts,
    ),
    Claim(
        "nut-first", "4.2.2, fig. 11d", "Plucked near the nut: several frets are met at first",
        "frets of the first set", "", expect.AtLeast(2), expect.OURS, ("near-nut",), first_set_size,
    ),
    Claim(
        "nut-last-fret", "4.2.2, fig. 11d", "Plucked near the nut: soon only the last fret is met",
        "frets met from 0.03 to 0.25 s", "", expect.Exactly((20,)), expect.PAPER,
        ("near-nut",), lambda run: runs.frets(run, 0.03, 0.25),
    ),
    Claim(
        "nut-silence", "4.2.2, fig. 11d", "Plucked near the nut: from 0.25 to 0.35 s nothing is touched",
        "longest time between two contacts", "s", expect.Covers(0.25, 0.35), expect.ONE_PLUCK, ("near-nut",),
        runs.longest_pause,
    ),
    Claim(
        "nut-growth", "4.2.2, fig. 11d", "Plucked near the nut: after that, contacts grow in number",
        "contacts from 0.35 to 0.6 s, 0.6 to 0.8 s, 0.8 to 1 s", "", expect.Rising(), expect.DIRECTION,
        ("near-nut",), lambda run: [runs.count(run, *t) for t in ((.35, .6), (.6, .8), (.8, 1))],
    ),
    Claim(
        "nut-fret-2", "4.2.2, fig. 11d", "Plucked near the nut: fret 2 is met as late as 0.85 s",
        "first time of fret 2", "s", expect.Near(0.85, 0.01), expect.ONE_PLUCK,
        ("near-nut",), lambda run: first_of(runs.fret_times(run, 2)),
    ),
    Claim(
        "neck-gaps", "4.2.3, fig. 12", "Fret 12 is 2.3 mm under the string, then 2 mm and 1.8 mm",
        "gap at fret 12: measured neck, straightened to 2 mm, straight",
        "m", expect.Nears((2.3e-3, 2e-3, 1.8e-3), 0.05), expect.SETUP, ("neck", "half-straight", "straight"),
        each(gap_12),
    ),
    Claim(
        "neck-no-contact", "4.2.3, fig. 12a", "A pluck of 1.8 mm at 0.6 m does not touch the neck as it was measured",
        "contacts", "", expect.Exactly(0), expect.PAPER, ("neck",), lambda run: int(run.contacts.fret.size),
    ),
    Claim(
        "half-contact", "4.2.3, fig. 12e", "The same pluck touches a neck that is straightened to 2 mm",
        "contacts, neck straightened to 2 mm", "", expect.AtLeast(1), expect.PAPER,
        ("half-straight",), lambda run: int(run.contacts.fret.size),
    ),
    Claim(
        "straight-earlier", "4.2.3, fig. 12e", "It touches a straight neck sooner",
        "first contact: straight, straightened to 2 mm", "s", expect.Rising(), expect.DIRECTION,
        ("straight", "half-straight"), each(runs.first_contact),
    ),
    Claim(
        "straight-more", "4.2.3, fig. 12e", "The straight neck is met by more frets at first",
        "frets of the first set: straightened to 2 mm, straight", "", expect.Rising(), expect.DIRECTION,
        ("half-straight", "straight"), each(lambda run: len(runs.set_frets(run, 1))),
    ),
    Claim(
        "straight-glide", "4.2.3, fig. 12e", "The straighter the neck, the higher the glide begins",
        "fundamental at the beginning: neck, straightened to 2 mm, straight", "Hz", expect.Rising(0.01),
        expect.DIRECTION, ("neck", "half-straight", "straight"), each(lambda run: runs.fundamental_at(run, [0.0])[0]),
    ),
    Claim(
        "straight-higher", "4.2.3, fig. 12a-c", "The straighter the neck, the more highs",
        "nu_c at 0.05 s: neck, straightened to 2 mm, straight", "Hz", expect.Rising(0.1), expect.DIRECTION,
        ("neck", "half-straight", "straight"), each(lambda run: runs.centroid_at(run, 0.05)),
    ),
    Claim(
        "straight-longer", "4.2.3, fig. 12b-c", "Over the straight neck the spectrogram is perturbed for longer",
        "until when the power between the partials is within 30 dB of theirs: straightened to 2 mm, straight",
        "s", expect.Rising(0.2), expect.DIRECTION, ("half-straight", "straight"), each(runs.perturbed_end),
    ),
    Claim(
        "sixth-frets", "4.2.3, fig. 12e", "With fret 6 up by 0.5 mm it is fret 6 that is met",
        "frets met", "", expect.Exactly((6,)), expect.PAPER, ("sixth-fret",), runs.frets,
    ),
    Claim(
        "sixth-longer", "4.2.3, fig. 12e", "With fret 6 up, contacts go on beyond the attack",
        "first contact to last: straight, sixth fret raised", "s", expect.Rising(0.2), expect.DIRECTION,
        ("straight", "sixth-fret"), each(runs.phase),
    ),
    Claim(
        "sixth-alters", "4.2.3, fig. 12d", "With fret 6 up the sound is another one, in the attack and to its end",
        "nu_c over that with the measured neck at 0.1 s and 0.9 s", "",
        expect.Each((expect.AtLeast(1.5), expect.AtLeast(1.05))), expect.OURS, ("sixth-fret", "neck"),
        lambda run, neck: [runs.centroid_at(run, t) / runs.centroid_at(neck, t) for t in (0.1, 0.9)],
    ),
    Claim(
        "soft-phase", "4.2.4, fig. 13", "With K = 1e9 contacts go on for some tenths of a second",
        "first contact to last", "s", expect.Between(0.3, 0.9), expect.OURS, ("soft",), runs.phase,
    ),
    Claim(
        "soft-longer", "4.2.4", "The softer the frets, the longer contacts go on",
        "first contact to last, K = 1e13, 1e12, 1e11, 1e10, 1e9", "s", expect.Rising(), expect.DIRECTION,
        ("b", "k12", "k11", "k10", "soft"), each(runs.phase),
    ),
    Claim(
        "soft-decrease", "4.2.4, fig. 13b", "With K = 1e9 the fundamental comes down over about 0.8 s",
        "until when the fundamental is 0.1 % over its last value", "s", expect.Near(0.8, 0.2), expect.ONE_PLUCK,
        ("soft",), lambda run: runs.glide_end(run, 0.001),
    ),
    Claim(
        "soft-glide-size", "4.2.4, fig. 13b", "K = 1e9: the glide is of the size of the axis, whose last mark is 0.2",
        "greatest relative variation of the fundamental; within half a mark", "", expect.Near(0.2, 0.25), expect.AXIS,
        ("soft",), runs.glide_size,
    ),
    Claim(
        "soft-turns", "4.2.4, fig. 13b", "With K = 1e9 the fundamental rises and falls several times on its way",
        "maxima and minima that stand out by 1 Hz, up to 0.8 s", "", expect.AtLeast(3), expect.OURS, ("soft",), turns,
    ),
    Claim(
        "soft-frets-pitch", "4.2.4, fig. 13b", "With K = 1e9 the fundamental follows the number of frets in a set",
        "correlation of both over the sets", "", expect.AtLeast(0.8), expect.OURS,
        ("soft",), runs.frets_and_pitch, null=SETS_SHUFFLED,
    ),
    Claim(
        "soft-highest", "4.2.4, fig. 13a", "With K = 1e9 the highest modes get less energy than with K = 1e13",
        "energy above 6 kHz, first 0.1 s: K = 1e9, K = 1e13", "dB", expect.Rising(), expect.DIRECTION,
        ("soft", "b"), each(highest_level),
    ),
)  # fmt: skip
