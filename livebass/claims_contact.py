"""Claims of section 4.1 about when and where the string meets the frets."""

from __future__ import annotations

import math

import numpy as np

from livebass.claims_expect import AtLeast, AtMost, Claim, Exactly, Falling, Near, Nears, Rising, Value
from livebass.claims_measure import (
    difference,
    first_contact,
    first_fret,
    first_time,
    fret_times,
    frets,
    phase,
    set_frets,
    set_sizes,
)
from livebass.claims_runs import Run
from livebass.modal_motion import string_shape


def second_hit(run: Run) -> Value:
    """When fret 1 is met again after the first set."""
    times = fret_times(run, 1)
    return first_time(times[times > run.sets[0].time_s[-1]]) if run.sets else math.nan


def released(run: Run) -> list[float]:
    """Greatest displacement along u and along v at the release, m."""
    states = run.motion.states
    if states is None or states.shape[1] < 2:
        return [math.nan, math.nan]
    s = run.trial.speaking
    return [float(string_shape(s, q, np.linspace(0, s.length, 1000)).max()) for q in states[0, :, 0]]


def angle(run: Run) -> Value:
    """Angle between the plane of the pluck and (xOy), degrees."""
    up, across = released(run)
    return math.degrees(math.atan2(up, across))


def across_over_up(run: Run) -> Value:
    """v over u, root mean squares."""
    v = run.motion.across_m
    return math.nan if v is None else float(np.std(v) / np.std(run.motion.displacement_m))


def offset_across(run: Run) -> Value:
    """Mean of v over the last 0.2 s, part of its greatest."""
    v = run.motion.across_m
    return math.nan if v is None else float(abs(v[-round(0.2 * run.rate) :].mean()) / np.abs(v).max())


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
)  # fmt: skip
