"""Claims of sections 4.2.1 and 4.2.2: dispersion and the plucking point."""

from __future__ import annotations

import math

from livebass.claims_expect import AtLeast, Claim, Covers, Exactly, Falling, Near, Rising, Value
from livebass.claims_measure import (
    count,
    first_time,
    fret_times,
    frets,
    glide_end,
    longest_pause,
    phase,
    set_frets,
    set_sizes,
    set_times,
)
from livebass.claims_runs import Run

AFTER = slice(2, 8)  # the third to the eighth set


def earlier(run: Run, other: Run) -> Value:
    """By how much the sets of `other` begin before those of `run`, from the third on, s."""
    return [a - b for a, b in zip(set_times(run)[AFTER], set_times(other)[AFTER], strict=False)]


def mean_size(run: Run) -> float:
    """Frets a set from the third to the eighth."""
    return sum(set_sizes(run)[AFTER]) / (AFTER.stop - AFTER.start)


def first_set_size(run: Run) -> int:
    """Frets of the first set."""
    return len(set_frets(run, 1))


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
)  # fmt: skip
