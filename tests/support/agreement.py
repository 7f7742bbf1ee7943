"""The engine against brute force: how far two motions agree, and how far they can."""

from __future__ import annotations

import dataclasses

import numpy as np

from livebass.engine.solve import solve_trial
from livebass.lab.reference.solver import solve
from livebass.model.trial import Motion, Trial
from livebass.rows.arrays import Floats

AGREED = 1e-8  # of the largest displacement; regular motion agrees to 5e-11


NUDGES = (1e-13, -1e-13, 1e-12, -1e-12, 1e-11, -1e-11)  # of the apex; the engine's rounding is worth 1e-13 to 5e-12


DEPARTED = 1e-9  # of the largest displacement, where two runs of brute force count as two motions


def difference(a: Motion, b: Motion) -> Floats:
    """|a - b| at each sample, relative to the largest displacement; the greater of the two polarisations."""
    result = np.abs(a.displacement_m - b.displacement_m) / np.abs(b.displacement_m).max()
    if a.across_m is None or b.across_m is None:
        assert a.across_m is b.across_m
        return result
    return np.maximum(result, np.abs(a.across_m - b.across_m) / np.abs(b.across_m).max())


def same_contacts_until(a: Motion, b: Motion) -> float:
    """The fine step of the first contact that differs in its point, or by more than one step; inf if none does."""
    count = min(a.contact_step.size, b.contact_step.size)
    other = np.abs(a.contact_step[:count] - b.contact_step[:count]) > 1
    other |= a.contact_index[:count] != b.contact_index[:count]
    first = int(np.argmax(other)) if other.any() else count
    return min((m.contact_step[first] for m in (a, b) if m.contact_step.size > first), default=np.inf)


def agreed_until(a: Motion, b: Motion, within: float) -> int:
    """The number of samples up to which `a` has the contacts of `b` and lies `within` of it."""
    apart = np.flatnonzero(~(difference(a, b) <= within))  # or NaN
    samples = int(apart[0]) if apart.size else b.time_s.size
    step = same_contacts_until(a, b)
    return samples if step == np.inf else min(samples, int(np.searchsorted(b.time_s, step / b.contact_rate_hz)))


def predictable(trial: Trial, brute: Motion, enough: int = 0) -> int:
    """The number of samples up to which any solver must give the motion `brute`, whatever its rounding.

    A string that rattles thousands of times is chaotic: a change in the twelfth digit of its pluck soon gives another
    motion. Rounding is such a change, and differs between kinds of processor. So brute force runs again with the pluck
    nudged up and down, by the size of rounding and more. The motion is predictable until the first of these twins
    departs from it or touches another point. Once that happens at or before `enough` samples, no further twin is
    solved.
    """
    until = brute.time_s.size
    for nudge in NUDGES:
        if until <= enough:
            break
        pluck = dataclasses.replace(trial.pluck, apex=trial.pluck.apex * (1 + nudge))
        until = min(until, agreed_until(solve(dataclasses.replace(trial, pluck=pluck)), brute, DEPARTED))
    return until


def assert_agree(trial: Trial, name: str, minimum: float = 1.0, within: float = AGREED, touches: bool = True) -> bool:
    """The engine gives the contacts and the motion of brute force for as long as they are predictable.

    They must be predictable for the share `minimum` of the samples. Returns True if they agree to the end.
    """
    engine, brute = solve_trial(trial), solve(trial)
    assert brute.contact_step.size > 0 or not touches, name
    until = agreed_until(engine, brute, within)
    if until == trial.samples:
        return True
    requested = predictable(trial, brute, enough=0 if minimum else until)
    apart = difference(engine, brute)[: until + 1].max()
    assert until >= requested, (
        f"{name}: as brute force for {until} samples of {requested}, then {apart:.1e} or another contact"
    )
    assert requested >= minimum * trial.samples, f"{name}: predictable for {requested} samples of {trial.samples} only"
    return False
