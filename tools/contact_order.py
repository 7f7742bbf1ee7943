"""Compares steps of contact: the project's, of order 2, with compositions of order 4 and with steps of adaptive length.

python tools/contact_order.py paper-g G 3.6mm 640mm      # case B; 7.8mm: case C
python tools/contact_order.py jazz-finger E 4.5mm 800mm

`scheme` is livebass.reference.solver. `hold` moves the modes exactly under a force that is constant for the step h, by
eq. 6 over this one step: also exact without force, with an energy that never rises, but it keeps q and dq/dt alone, so
that steps of any length follow each other. `kick` is Strang's splitting: the exact motion for h/2, the momentum of the
contact, again h/2. `triple` (Yoshida 1990) and `fivefold` (Suzuki 1990) repeat a step three and five times, once
backwards, for order 4. `adaptive` is `hold` whose h, 1/16 us to the longest named, is halved until no point that
touches, or is about to, moves more than a limit. A pass moves all modes once; passes count in windows of 5 us in
which the string touches.

The converged motion is `fivefold hold` at the highest rate. Errors are the greatest so far at the sensor, in % of the
greatest displacement; `found` counts its contacts that have one within 5 us at the same fret. `drift` is of the energy
without losses, `rise` the most it rises between two samples of 20 us with them, both relative, `scheme` at its rate.
"""

from __future__ import annotations

import argparse
import dataclasses
import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from errors import clear_errors

from livebass.arrays import Floats, Ints
from livebass.compiling.by_numba import counted
from livebass.model.trial import Setup, Trial, checked_trial, initial_amplitudes, speaking_string
from livebass.preset.load import load_preset
from livebass.reference.laws import Laws, contacts, potential, solve_forces
from livebass.reference.plan import Plan, make_plan
from livebass.reference.solver import solve
from livebass.reference.stepping import dot
from livebass.units import quantity

OUTPUT = 50_000  # Hz
WINDOW = 4  # windows a sample
FINEST = 16e6  # Hz, of the adaptive step
LENGTHS = tuple(2.0**level for level in range(6))  # of the adaptive step, in finest ones
NEAR = 5e-6  # s, within which contacts are the same
TIMES = 5, 20, 60  # ms
ROOT = 1 / (4 - 4 ** (1 / 3))
CUBE = 1 / (2 - 2 ** (1 / 3))
PARTS = {"": (1.0,), "triple ": (CUBE, 1 - 2 * CUBE, CUBE), "fivefold ": (ROOT, ROOT, 1 - 4 * ROOT, ROOT, ROOT)}
RATES = 8e6, 4e6, 2e6, 1e6, 5e5
LIMITS = 2e-7, 1e-6, 5e-6  # m


class Leap(NamedTuple):
    """The exact motion of N modes for a time h, of either sign, and what a force constant for h adds at P points."""

    h: float  # s
    qq: Floats  # (N,) the map of (q, dq/dt)
    qp: Floats
    pq: Floats
    pp: Floats
    moved: Floats  # (N,) q by 1 m^1.5/s^2
    coupling: Floats  # (P, P) m per N/m
    laws: Laws


class Result(NamedTuple):
    """How a string moved: n samples from 0 on, w windows."""

    displacement: Floats  # (n,) m
    energy: Floats  # (n,) J
    time: Floats  # (k,) s, of contacts
    fret: Ints  # (k,)
    passes: Floats  # (w,)
    touched: Ints  # (w,) 1: a contact at the end of a step


def make_leap(trial: Trial, plan: Plan, h: float) -> Leap:
    """The leap of `trial` for h seconds."""
    sigma, omega = plan.u.sigma, plan.u.omega
    square = sigma**2 + omega**2
    e, c, s = np.exp(-sigma * h), np.cos(omega * h), np.sin(omega * h) / omega
    moved = (-np.expm1(-sigma * h) + 2 * e * np.sin(omega * h / 2) ** 2 - e * sigma * s) / square
    loss = trial.speaking.contact_loss / h
    laws = contacts(plan.height.size, plan.stiffness, plan.exponent, loss)
    coupling = plan.dx / plan.density * (plan.shape * moved) @ plan.shape.T
    return Leap(h, e * (c + sigma * s), e * s, -e * square * s, e * (c - sigma * s), moved, coupling, laws)


@counted
def rotate(leap: Leap, q: Floats, p: Floats, q_new: Floats, p_new: Floats) -> None:
    """Moves the modes without force."""
    for j in range(q.size):
        a, b = q[j], p[j]
        q_new[j] = leap.qq[j] * a + leap.qp[j] * b
        p_new[j] = leap.pq[j] * a + leap.pp[j] * b


@counted
def hold(
    plan: Plan, leap: Leap, q: Floats, p: Floats, eta: Floats, q_new: Floats, p_new: Floats, after: Floats
) -> bool:
    """Moves the modes by `leap` under the contact of eq. 6 over this step. Returns False if it is not solved."""
    rotate(leap, q, p, q_new, p_new)
    points = eta.size
    free, force = np.empty(points), np.zeros(points)
    for m in range(points):
        free[m] = plan.height[m] - dot(plan.shape[m], q_new)
        after[m] = free[m]
    if free.max() <= 0 and eta.max() <= 0:
        return True
    if not solve_forces(leap.coupling, free, eta, leap.laws, force, after):
        return False
    for m in range(points):
        if force[m] != 0:
            a = plan.dx / plan.density * force[m]
            for j in range(q.size):
                push = a * plan.shape[m, j]
                q_new[j] += leap.moved[j] * push
                p_new[j] += leap.qp[j] * push
    return True


@counted
def kick(plan: Plan, half: Leap, loss: float, q: Floats, p: Floats, eta: Floats) -> None:
    """Moves the modes by Strang's splitting, in place; points do not feel each other. Writes eta at the kick."""
    rotate(half, q, p, q, p)
    h = 2 * half.h
    for m in range(eta.size):
        eta[m] = plan.height[m] - dot(plan.shape[m], q)
    for m in range(eta.size):
        if eta[m] > 0:
            force = plan.stiffness * eta[m] ** plan.exponent
            # by the mean speed in the kick; with all modes a row of Phi has the square 1 / dx
            speed = -dot(plan.shape[m], p)
            force *= max(1 + loss * speed, 0.0) / (1 + force * loss * h / (2 * plan.density))
            for j in range(q.size):
                p[j] += h * plan.dx / plan.density * force * plan.shape[m, j]
    rotate(half, q, p, q, p)


@counted
def energy_of(plan: Plan, q: Floats, p: Floats, eta: Floats) -> float:
    """Energy of string and contact, J."""
    total = 0.0
    for j in range(q.size):
        total += p[j] * p[j] + (plan.u.sigma[j] ** 2 + plan.u.omega[j] ** 2) * q[j] * q[j]
    total *= plan.density / 2
    for m in range(eta.size):
        total += plan.dx * potential(eta[m], plan.stiffness, plan.exponent)
    return total


@counted
def note(eta: Floats, after: Floats, at: float, window: int, result: Result, found: int) -> int:
    """Writes the contacts that begin in a step, the middle of which is `at`, and returns how many there are by now."""
    for m in range(eta.size):
        if after[m] > 0:
            result.touched[window] = 1
            if eta[m] <= 0 and found < result.time.size:
                result.time[found], result.fret[found] = at, m
                found += 1
        eta[m] = after[m]
    return found


@counted
def run(
    plan: Plan,
    leaps: tuple[Leap, ...],
    per: int,
    loss: float,
    kicks: bool,
    limit: float,
    longest: int,
    q: Floats,
    result: Result,
) -> int:
    """Fills `result`; `per` steps a sample, the finest if `limit` (m) is not zero. Returns the contacts, -1: unsolved.

    leaps: the parts of a step, or half of each if it `kicks`; with a limit, its lengths, up to leaps[longest].
    """
    count, points = q.size, plan.height.size
    p, q_new, p_new, after, eta = np.zeros(count), np.empty(count), np.empty(count), np.empty(points), np.empty(points)
    solved = np.empty(points)
    for m in range(points):
        eta[m] = plan.height[m] - dot(plan.shape[m], q)
    now = eta.copy()  # between the parts of a step
    found, level, n = 0, 0, 0
    unit = 1 / (OUTPUT * per)
    while True:
        if n % per == 0:
            result.displacement[n // per] = dot(plan.sensor, q)
            for m in range(points):
                solved[m] = plan.height[m] - dot(plan.shape[m], q)
            result.energy[n // per] = energy_of(plan, q, p, solved)
            if n // per == result.energy.size - 1:
                return found
        window = n * WINDOW // per
        if limit > 0:
            level = min(level + 1, longest)
            while n % (1 << level) or n % per + (1 << level) > per:
                level -= 1
            while True:
                result.passes[window] += 1
                if not hold(plan, leaps[level], q, p, eta, q_new, p_new, after):
                    return -1
                most = 0.0
                for m in range(points):
                    r = abs(after[m] - eta[m])
                    if max(after[m], eta[m]) > -r:
                        most = max(most, r)
                if most <= limit or level == 0:
                    break
                level -= 1
            q[:], p[:] = q_new, p_new
        elif kicks:
            for half in leaps:
                kick(plan, half, loss, q, p, after)
        else:
            for leap in leaps:
                if not hold(plan, leap, q, p, now, q_new, p_new, after):
                    return -1
                q[:], p[:], now[:] = q_new, p_new, after
        if limit == 0:
            result.passes[window] += len(leaps)
        found = note(eta, after, (n + (1 << level) / 2) * unit, window, result, found)
        n += 1 << level


def moved(
    trial: Trial, rate: float, parts: Sequence[float], kicks: bool = False, limit: float = 0.0, longest: int = 0
) -> Result | None:
    """How `trial` moves by steps of one of the new kinds; None if the contact of a step is not solved."""
    plan = make_plan(trial)
    lengths = [part / rate / (2 if kicks else 1) for part in parts]
    leaps = tuple(make_leap(trial, plan, h) for h in lengths)
    samples, room = trial.samples, 100_000
    windows = samples * WINDOW
    rest = np.zeros(windows), np.zeros(windows, dtype=np.int64)
    result = Result(np.zeros(samples), np.zeros(samples), np.zeros(room), np.zeros(room, dtype=np.int64), *rest)
    per = round(rate / OUTPUT)
    count = run(plan, leaps, per, trial.speaking.contact_loss, kicks, limit, longest, initial_amplitudes(trial), result)
    return None if count < 0 else result._replace(time=result.time[:count], fret=result.fret[:count])


def of_scheme(trial: Trial, rate: float) -> Result:
    """How `trial` moves by the scheme of livebass.reference.solver, one pass a step; windows are left out."""
    motion = solve(dataclasses.replace(trial, contact_rate=rate), round(rate / OUTPUT))
    assert motion.energy_j is not None
    middle = motion.contact_time_s - 0.5 / rate
    passes = np.full(trial.samples * WINDOW, rate / OUTPUT / WINDOW)
    return Result(motion.displacement_m, motion.energy_j, middle, motion.contact_index, passes, np.zeros(0, np.int64))


class Row(NamedTuple):
    """A row of the table."""

    step: str
    rate: str
    passes: float  # a ms
    errors: tuple[float, ...]  # %, at TIMES
    contacts: str
    drift: str
    rise: float

    def __str__(self) -> str:
        errors = " | ".join(f"{error:.2g}" for error in self.errors)
        shown = f"{self.step} | {self.rate} | {self.passes:.0f} | {errors} | {self.contacts}"
        return f"| {shown} | {self.drift} | {self.rise:.0e} |"


def compared(step: str, rate: str, result: Result, best: Result, still: Result | None = None) -> Row:
    """Prints and returns the row of `result` beside the converged motion `best`; `still`: without losses."""
    ends = [round(ms * 1e-3 * OUTPUT) + 1 for ms in TIMES]
    off = 100 * np.abs(result.displacement - best.displacement) / np.abs(best.displacement).max()
    near = [np.abs(result.time[result.fret == m] - at) < NEAR for at, m in zip(best.time, best.fret, strict=True)]
    contacts_found = f"{result.time.size}, {sum(map(np.any, near))} of {best.time.size}"
    passes = result.passes[best.touched > 0].sum() * OUTPUT / 1e3 / (best.energy.size - 1)
    drift = "" if still is None else f"{np.abs(still.energy / still.energy[0] - 1).max():.0e}"
    rise = max(np.diff(result.energy).max() / result.energy[0], 0.0)
    row = Row(step, rate, passes, tuple(float(off[:end].max()) for end in ends), contacts_found, drift, rise)
    print(row, flush=True)
    return row


def needed(rows: Sequence[Row], error: float, at: int) -> float:
    """Passes a ms for `error` at TIMES[at] by `rows`, finest first; straight lines between logarithms. NaN: more."""
    finer: Row | None = None
    for row in rows:
        if not row.errors[at] <= error:
            if finer is None:
                return math.nan
            part = math.log(error / finer.errors[at]) / math.log(row.errors[at] / finer.errors[at])
            return math.exp(math.log(finer.passes) * (1 - part) + math.log(row.passes) * part)
        finer = row
    return math.nan if finer is None else finer.passes


def table(trial: Trial, best_rate: float) -> None:
    """Prints the tables of a trial."""
    best = moved(trial, best_rate, PARTS["fivefold "])
    if best is None:
        raise ValueError("the converged motion is not found: a contact is not solved")
    print(f"{best.time.size} contacts; windows with contact: {100 * best.touched.mean():.1f} %\n")
    print("| step | rate, or longest | passes/ms | " + " | ".join(f"{ms} ms, %" for ms in TIMES), end="")
    print(" | contacts, found | drift | rise |\n|---|---|---|---|---|---|---|---|---|")
    still = dataclasses.replace(trial, lossless=True, duration=trial.duration / 3)
    still = dataclasses.replace(still, speaking=dataclasses.replace(still.speaking, contact_loss=0.0))
    harder = dataclasses.replace(trial, pluck=dataclasses.replace(trial.pluck, apex=trial.pluck.apex * 1.001))
    compared("`scheme`, 0.1 % harder", "8 MHz", of_scheme(harder, 8e6), best)
    compared("`scheme`", f"{2 * best_rate / 1e6:g} MHz", of_scheme(trial, 2 * best_rate), best)
    kinds = {
        "`scheme`": [compared("`scheme`", shown(r), of_scheme(trial, r), best, of_scheme(still, r)) for r in RATES]
    }
    for prefix, kicks in (("", False), ("", True), ("triple ", False), ("fivefold ", False), ("fivefold ", True)):
        name, parts = f"`{prefix}{'kick' if kicks else 'hold'}`", PARTS[prefix]
        for rate in RATES:
            result = moved(trial, rate, parts, kicks)
            if result is None:
                print(f"| {name} | {shown(rate)} | not solved |", flush=True)
                break
            row = compared(name, shown(rate), result, best, moved(still, rate, parts, kicks))
            kinds.setdefault(name, []).append(row)
    for limit in LIMITS:
        for longest in range(1, len(LENGTHS)):
            result = moved(trial, FINEST, LENGTHS, limit=limit, longest=longest)
            if result is not None:
                name, most = f"`adaptive` {limit * 1e6:g} um", f"{1e6 * LENGTHS[longest] / FINEST:g} us"
                lossless = moved(still, FINEST, LENGTHS, limit=limit, longest=longest)
                kinds.setdefault(name, []).append(compared(name, most, result, best, lossless))
    print(
        "\nPasses a ms for the error of `scheme` at 8 MHz, and at 4 MHz, after " + ", ".join(map(str, TIMES)) + " ms:\n"
    )
    for name, rows in kinds.items():
        each = [[needed(rows, goal.errors[i], i) for i in range(len(TIMES))] for goal in kinds["`scheme`"][:2]]
        print(f"{name}: " + "; ".join(", ".join(f"{x:.0f}" for x in those) for those in each))


def shown(rate: float) -> str:
    """A rate for people."""
    return f"{rate / 1e6:g} MHz"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("preset")
    parser.add_argument("string")
    parser.add_argument("apex")
    parser.add_argument("at")
    parser.add_argument("--duration", type=float, default=0.06, help="s; default: 0.06")
    parser.add_argument("--best", type=float, default=16e6, help="rate of the converged motion, Hz; default: 16e6")
    o = parser.parse_args()
    with clear_errors("contact_order.py"):
        bass = load_preset(o.preset)
        apex, at = (float(quantity(text, "length")) for text in (o.apex, o.at))
        s = speaking_string(bass, o.string, 0)
        table(checked_trial(bass, s, Setup(apex=apex, at=at, duration=o.duration), 8e6, OUTPUT), o.best)


if __name__ == "__main__":
    main()
