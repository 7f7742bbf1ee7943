"""Claims of section 4.2: dispersion, the plucking point, the neck's adjustment and the stiffness of the contact."""

from __future__ import annotations

import math

from livebass.analysis.motion import Solved
from livebass.paper.claims.expect import (
    AtLeast,
    Between,
    Claim,
    Covers,
    Each,
    Exactly,
    Falling,
    Near,
    Nears,
    Rising,
    Value,
)
from livebass.paper.claims.runs import (
    centroid_at,
    count,
    energies,
    first_contact,
    first_time,
    fret_times,
    frets,
    frets_and_pitch,
    fundamental_at,
    glide_end,
    longest_pause,
    phase,
    set_frets,
    set_sizes,
    set_times,
)

AFTER = slice(2, 8)  # the third to the eighth set
HIGHEST = 60  # the modes above this one are over 6 kHz


def earlier(run: Solved, other: Solved) -> Value:
    """Lead of the sets of `other` over those of `run`, from the third to the eighth, s."""
    return [a - b for a, b in zip(set_times(run)[AFTER], set_times(other)[AFTER], strict=False)]


def mean_size(run: Solved) -> float:
    """Mean number of frets in the third to the eighth set."""
    return sum(set_sizes(run)[AFTER]) / (AFTER.stop - AFTER.start)


def first_set_size(run: Solved) -> int:
    """Number of frets in the first set."""
    return len(set_frets(run, 1))


def gap_12(run: Solved) -> float:
    """The gap d_12 between the string at rest and fret 12, m."""
    s = run.trial.speaking
    return -s.contact_height[s.contact_fret.index(12)]


def turns(run: Solved) -> Value:
    """Numbers of maxima and of minima of the fundamental up to 0.8 s that stand out by 1 Hz or more."""
    from scipy.signal import find_peaks

    p = run.pitch
    nu = p.frequency_hz[p.time_s < 0.8]
    return [len(find_peaks(sign * nu, prominence=1.0)[0]) for sign in (1, -1)]


def highest_level(run: Solved) -> float:
    """Mean energy above 6 kHz over the first 0.1 s, relative to the whole energy at the release, dB."""
    e = energies(run)
    return 10 * math.log10(e[1:11, HIGHEST:].sum(axis=1).mean() / e[0].sum())


CLAIMS = (
    Claim(
        "harmonic-third-set", "4.2.1",
        "From the third set of contacts (i.e. from about 0.02 s)",
        "third set of case B",
        "s", Near(0.02, 0.1), ("b",), lambda run: set_times(run)[2] if len(run.sets) > 2 else math.nan,
    ),
    Claim(
        "harmonic-earlier", "4.2.1",
        "[from then on] contacts arise earlier when dispersion is discarded",
        "by how much, sets 3 to 8",
        "s", AtLeast(1e-6), ("b", "harmonic"), earlier,
    ),
    Claim(
        "harmonic-longer", "4.2.1",
        "contacts arise over a longer duration",
        "first contact to last, with dispersion and without",
        "s", Rising(0.2), ("b", "harmonic"), lambda *runs: [phase(run) for run in runs],
    ),
    Claim(
        "harmonic-phase", "4.2.1",
        "the time interval in which contacts occur [...] lasts about 0.15 s",
        "first contact to last without dispersion",
        "s", Near(0.15, 0.1), ("harmonic",), phase,
    ),
    Claim(
        "harmonic-frets", "4.2.1",
        "the number of hit frets decreases less rapidly than in the case with dispersion",
        "frets a set, sets 3 to 8, with dispersion and without",
        "", Rising(0.1), ("b", "harmonic"), lambda *runs: [mean_size(run) for run in runs],
    ),
    Claim(
        "harmonic-glide", "4.2.1",
        "Consequently the pitch glide also lasts longer",
        "until when the fundamental is 0.5 % over its last value, with dispersion and without",
        "s", Rising(0.2), ("b", "harmonic"), lambda *runs: [glide_end(run, 0.005) for run in runs],
    ),
    Claim(
        "point-phases", "4.2.2",
        "the length of the overall contact time interval, which is shorter in case b [middle] and longer in case c "
        "[near the nut]",
        "first contact to last: middle, near bridge, near nut",
        "s", Rising(0.2), ("middle", "near-bridge", "near-nut"), lambda *runs: [phase(run) for run in runs],
    ),
    Claim(
        "bridge-fewer", "4.2.2",
        "plucked near the bridge [...] some frets collide at the beginning, before a global decrease of the number of "
        "hit frets",
        "frets in each set",
        "", Falling(0.25), ("near-bridge",), set_sizes,
    ),
    Claim(
        "middle-fewer", "4.2.2",
        "[the same] in the middle of the string",
        "frets in each set",
        "", Falling(0.25), ("middle",), set_sizes,
    ),
    Claim(
        "nut-first", "4.2.2",
        "plucked near the nut [...] Some frets are hit at the beginning",
        "frets of the first set",
        "", AtLeast(2), ("near-nut",), first_set_size,
    ),
    Claim(
        "nut-last-fret", "4.2.2",
        "their number then quickly reduces to one (the last fret)",
        "frets met from 0.03 to 0.25 s",
        "", Exactly((20,)), ("near-nut",), lambda run: frets(run, 0.03, 0.25),
    ),
    Claim(
        "nut-silence", "4.2.2",
        "until no contact arises anymore between 0.25 and 0.35 s",
        "longest time between two contacts",
        "s", Covers(0.25, 0.35), ("near-nut",), longest_pause,
    ),
    Claim(
        "nut-growth", "4.2.2",
        "After this time, many contacts appear",
        "contacts from 0.35 to 0.6 s, 0.6 to 0.8 s, 0.8 to 1 s",
        "", Rising(), ("near-nut",), lambda run: [count(run, *t) for t in ((.35, .6), (.6, .8), (.8, 1))],
    ),
    Claim(
        "nut-fret-2", "4.2.2",
        "the first contact between the string and the second fret occurs at time 0.85 s",
        "first time of fret 2",
        "s", Near(0.85, 0.01), ("near-nut",), lambda run: first_time(fret_times(run, 2)),
    ),
    Claim(
        "neck-gaps", "4.2.3",
        "d_12 = 2.3 mm [...] 2 mm [...] In this case, d_12 = 1.8 mm",
        "gap at fret 12: measured neck, half straightened, straight",
        "m", Nears((2.3e-3, 2e-3, 1.8e-3), 0.05), ("neck", "half-straight", "straight"),
        lambda *runs: [gap_12(run) for run in runs],
    ),
    Claim(
        "neck-no-contact", "4.2.3",
        "a 1.8 mm maximal initial displacement, at 60 cm from the nut, so that there is no contact with the measured "
        "fretboard",
        "contacts",
        "", Exactly(0), ("neck",), lambda run: int(run.contacts.fret.size),
    ),
    Claim(
        "half-contact", "4.2.3",
        "When reducing the curvature, collisions arise",
        "contacts, neck half straightened",
        "", AtLeast(1), ("half-straight",), lambda run: int(run.contacts.fret.size),
    ),
    Claim(
        "straight-earlier", "4.2.3",
        "In the case of a straight fretboard, contacts arise earlier",
        "first contact: straight, half straightened",
        "s", Rising(), ("straight", "half-straight"), lambda *runs: [first_contact(run) for run in runs],
    ),
    Claim(
        "straight-more", "4.2.3",
        "more frets are hit at the beginning",
        "frets of the first set: half straightened, straight",
        "", Rising(), ("half-straight", "straight"), lambda *runs: [len(set_frets(run, 1)) for run in runs],
    ),
    Claim(
        "straight-glide", "4.2.3",
        "therefore the frequency glide starts from a higher frequency",
        "fundamental at the beginning: neck, half straightened, straight",
        "Hz", Rising(0.01), ("neck", "half-straight", "straight"),
        lambda *runs: [fundamental_at(run, [0.0])[0] for run in runs],
    ),
    Claim(
        "straight-higher", "4.2.3",
        "On spectrograms, higher frequencies are involved",
        "nu_c at 0.05 s: neck, half straightened, straight",
        "Hz", Rising(0.1), ("neck", "half-straight", "straight"),
        lambda *runs: [centroid_at(run, 0.05) for run in runs],
    ),
    Claim(
        "straight-longer", "4.2.3",
        "the highly perturbed zone at the beginning lasts longer",
        "first contact to last: half straightened, straight",
        "s", Rising(0.2), ("half-straight", "straight"), lambda *runs: [phase(run) for run in runs],
    ),
    Claim(
        "sixth-frets", "4.2.3",
        "the sixth fret would be raised by 0.5 mm [...] contacts with the sixth fret",
        "frets met",
        "", Exactly((6,)), ("sixth-fret",), frets,
    ),
    Claim(
        "sixth-longer", "4.2.3",
        "contacts with the sixth fret greatly alter the resulting sound, not only during the attack transient",
        "first contact to last: straight, sixth fret raised",
        "s", Rising(0.2), ("straight", "sixth-fret"), lambda *runs: [phase(run) for run in runs],
    ),
    Claim(
        "sixth-alters", "4.2.3",
        "greatly alter the resulting sound, not only during the attack transient but also in the full length",
        "nu_c over that with the measured neck at 0.1 s and 0.9 s",
        "", Each((AtLeast(1.5), AtLeast(1.05))), ("sixth-fret", "neck"),
        lambda run, neck: [centroid_at(run, t) / centroid_at(neck, t) for t in (0.1, 0.9)],
    ),
    Claim(
        "soft-phase", "4.2.4",
        "the contact period which then lasts several tenths of seconds (K = 1e9)",
        "first contact to last",
        "s", Between(0.3, 0.9), ("soft",), phase,
    ),
    Claim(
        "soft-longer", "4.2.4",
        "The smoother the contact is, the longer the time period with contacts lasts",
        "first contact to last, K = 1e13, 1e12, 1e11, 1e10, 1e9",
        "s", Rising(), ("b", "k12", "k11", "k10", "soft"), lambda *runs: [phase(run) for run in runs],
    ),
    Claim(
        "soft-decrease", "4.2.4",
        "an overall decrease [of the fundamental] during about 0.8 s",
        "until when the fundamental is 0.1 % over its last value",
        "s", Near(0.8, 0.2), ("soft",), lambda run: glide_end(run, 0.001),
    ),
    Claim(
        "soft-turns", "4.2.4",
        "The fundamental frequency estimation presents successive increases and decreases",
        "maxima and minima that stand out by 1 Hz, up to 0.8 s",
        "", AtLeast(3), ("soft",), turns,
    ),
    Claim(
        "soft-frets-pitch", "4.2.4",
        "an evolution strongly related to the number of frets colliding with the string",
        "correlation of both over the sets",
        "", AtLeast(0.8), ("soft",), frets_and_pitch,
    ),
    Claim(
        "soft-highest", "4.2.4",
        "Since contacts are smoother than for K = 10^13, highest modes have less energy",
        "energy above 6 kHz, first 0.1 s: K = 1e9, K = 1e13",
        "dB", Rising(), ("soft", "b"), lambda *runs: [highest_level(run) for run in runs],
    ),
)  # fmt: skip
