"""Modes of a speaking string: frequencies and dampings (eqs. 8 to 11), shapes (eq. 3), and plucks in them.

kernels/string/law.py has the laws of frequencies and dampings.

Bending stiffness follows one of two laws (`String.stiffness_law`), with B = pi^2 E I / (T L^2):

- "hinged", a stiff string on hinges. nu_j = j f0 sqrt(1 + B j^2). The fraction B j^2 / (1 + B j^2) of a mode's elastic
  energy is in bending, and only that fraction has loss, at the viscoelastic angle. The shape that a finger holds has
  1 / (1 + B j^2) of a triangle's amplitudes: it is no sharper than sqrt(E I / T).
- "paper", eqs. 8 and 11 of the paper and its triangle, all of first order in B j^2: nu_j = j f0 (1 + B j^2 / 2) is its
  fit to one G string. It holds for B j^2 below about 0.04 and is sharp beyond, by 16 cents at 2 kHz and 117 at 5 kHz on
  an E string.

Equation numbers: Issanchou et al. (2018).
"""

from __future__ import annotations

import math
from dataclasses import replace
from functools import lru_cache

import numpy as np

from livebass.kernels.string import law
from livebass.model.instrument import Pluck, Speaking
from livebass.model.neck import detuning, flat, neck_damping
from livebass.rows.arrays import Floats
from livebass.rows.parts import TURNED_MODES

CARRIED = 0.45  # of the contact rate: the highest mode that a bass plays (kernels.string.modal.MAX_TURN)


def frequencies(s: Speaking, count: int, across: bool = False) -> Floats:
    """Eigenfrequencies nu_j of modes j = 1 to `count`, (count,), Hz: the measured ones, if any, then the law.

    across: of v, which may have a law of its own. Measured frequencies belong to u; v differs from them by the law.

    At j = 862 the two stiffness laws differ by a factor of 2.7. The law "paper" takes the neck's term in eq. 8 at
    omega_{0,j}; for its sign see model/neck.py. With turned axes these are the frequencies of u and v without their
    exchange.
    """
    if not law.are_turned(s):
        return _along(s, count, across)[0].copy()
    nu, other = (_along(s, count, axis)[0] for axis in (across, not across))
    return np.asarray(np.sqrt(nu**2 + math.sin(s.axes_turned) ** 2 * (other**2 - nu**2)))


def dampings(s: Speaking, count: int, across: bool = False) -> Floats:
    """The damping law: coefficients sigma_j of modes j = 1 to `count`, (count,), 1/s.

    The measured ones, if any, then pi nu_j / Q_j of eqs. 9 to 11; the string's extra damping is added to all. The law
    "paper" follows the published data: evaluated at j f0 and constant above `CLAMP_WAVENUMBER`, with only the neck's
    part at the frequency of the mode itself. across: of v; `dampings_across` derives its measured dampings. With
    turned axes these are the dampings of u and v without their exchange.
    """
    if not law.are_turned(s):
        return _along(s, count, across)[1].copy()
    own, other = (_along(s, count, axis)[1] for axis in (across, not across))
    return np.asarray(own + math.sin(s.axes_turned) ** 2 * (other - own))


@lru_cache(maxsize=16)  # callers want frequencies and dampings of the same modes, and of both axes
def _along(s: Speaking, count: int, across: bool) -> tuple[Floats, Floats]:
    """nu_j (Hz) and sigma_j (1/s) of modes 1 to `count` along the axis a of the neck, or b if `across`, (count,).

    Do not change the arrays: they are kept for the next caller.
    """
    printed = count if s.paper_law else min(count, measured_modes(s))
    nu = _frequencies_along(s, printed, across)
    sigma = _dampings_along(s, nu, across)
    if printed == count:
        return nu, sigma
    ring, decay = _ringing(s, np.arange(printed + 1.0, count + 1), across)
    return np.append(nu, np.hypot(ring, decay)), np.append(sigma, 2 * math.pi * decay)


def measured_modes(s: Speaking) -> int:
    """Counts the modes up to the last with a measured frequency or damping."""
    return max(len(s.string.measured_frequencies), len(s.string.measured_dampings)) if s.stop == 0 else 0


def _ringing(s: Speaking, j: Floats, across: bool) -> tuple[Floats, Floats]:
    """`law.ringing` of the modes `j` (n,): Hz, and 1/s over 2 pi, (n,) each."""
    nu, decay, rate = law.alone(s, j, across)
    y = s.felt(across)
    of_table = replace(y, resonances=()).at(nu)  # and of the stop
    still = law.rings_at(nu - rate * of_table.imag, decay + rate * of_table.real)
    count = len(y.resonances)
    if not count:
        return still
    numbers = flat((r.frequency, r.quality, r.mass) for r in y.resonances)
    near, at = law.nearest(numbers, 0, count, still), still
    columns, others = np.reshape(numbers, (count, 3)).T[..., None], rate * (np.arange(count)[:, None] != near[0])
    for _ in range(law.ROUNDS):
        before = at
        real, imaginary = law.resonating(*columns, before)[:2]  # all resonances at once, summed in their order
        ring, decay = np.subtract.reduce([still[0], *(others * imaginary)]), np.add.reduce([still[1], *(others * real)])
        at = law.approach(numbers, (0, 0), rate, (ring, decay), near, before)
        if np.all(abs(at[0] - before[0]) + abs(at[1] - before[1]) < law.NEAR_ENOUGH * nu):
            break
    return at


def _frequencies_along(s: Speaking, count: int, across: bool) -> Floats:
    """Frequencies of modes 1 to `count` along a, or b if `across`, (count,), Hz: eq. 8 as printed, or measured."""
    j = np.arange(1.0, count + 1)
    nu = j * s.fundamental * (law.stretch_ratio(s.paper_law, s.inharmonicity, j) + neck_detuning(s, count))
    if s.stop == 0:
        known = np.asarray(s.string.measured_frequencies[:count])
        nu[: known.size] = known
    return frequencies_across(s, j, nu) if across and s.own_across else nu


def frequencies_across(s: Speaking, number: Floats, nu: Floats) -> Floats:
    """Frequencies of v (n,), Hz, in modes `number` (n,) whose u has the frequencies `nu` (n,), Hz.

    v differs by the shifts of the two necks, and is lower by its greater length.
    """
    at = number * s.fundamental
    u, v = (detuning(s.felt(across).at(at), impedance(s), number) for across in (False, True))
    return np.asarray((nu + at * (v - u)) / (1 + s.longer_across))


def exchange(s: Speaking, count: int) -> tuple[Floats, Floats]:
    """The exchange of modes 1 to `count` of u and v: kernels/string/turning.py.

    Returns its rates e (count,), rad/s, and the damping matrices Delta (count, 2, 2), 1/s, above that of the axis with
    the lower damping.
    """
    if not law.are_turned(s):
        return np.zeros(count), np.zeros((count, 2, 2))
    nu, (a, b) = zip(*(_along(s, count, across) for across in (False, True)), strict=True)
    u, v = (frequencies(s, count, across=across) for across in (False, True))
    sine, cosine = math.sin(s.axes_turned), math.cos(s.axes_turned)
    axes = np.array([[cosine, sine], [-sine, cosine]])  # rows: a and b in u and v
    more = np.stack([a, b], axis=1) - np.minimum(a, b)[:, None]
    rate = math.pi * sine * cosine * (nu[0] ** 2 - nu[1] ** 2) / np.sqrt(u * v)
    return rate, np.einsum("ki,jk,kl->jil", axes, more, axes)


def dampings_alone(s: Speaking, count: int, across: bool) -> Floats:
    """`dampings` without the part that the exchange of u and v takes, (count,), 1/s."""
    sigma = dampings(s, count, across=across)
    more = exchange(s, min(count, TURNED_MODES))[1][:, int(across), int(across)]
    sigma[: more.size] -= more
    return sigma


def _dampings_along(s: Speaking, ringing_at: Floats, across: bool) -> Floats:
    """Dampings (n,), 1/s, of modes at `ringing_at` (n,), Hz, from the first, along a, or b if `across`, as printed."""
    count = ringing_at.size
    nu = law_frequencies(s, np.arange(1.0, count + 1))
    sigma = math.pi * nu * loss_factor(s, nu) + neck_damping(s.felt(across).at(ringing_at), impedance(s), s.fundamental)
    if s.stop == 0:
        known = np.asarray(s.string.measured_dampings[:count])
        if across and s.own_across and known.size:
            of_u = _frequencies_along(s, known.size, False)
            known = dampings_across(s, np.arange(1.0, known.size + 1), of_u, ringing_at[: known.size], known)
        sigma[: known.size] = known
    return sigma + s.extra_damping + s.extra_damping_slope * 2 * math.pi * nu


def dampings_across(s: Speaking, number: Floats, nu: Floats, nu_across: Floats, measured: Floats) -> Floats:
    """Dampings of v (n,), 1/s, in modes `number` (n,) whose u has the dampings `measured` (n,).

    nu, nu_across (n,): frequencies of u and v, Hz. Replaces the neck's part in u by its part in v. If the neck's part
    is nearly all of the measured damping, or more, the rest is the string's own law, but at most the measured value:
    there v may lose more than u even on a neck that treats both alike.
    """
    law = law_frequencies(s, number)
    alone = math.pi * law * loss_factor(s, law)
    u, v = (
        neck_damping(s.felt(across).at(at), impedance(s), s.fundamental)
        for across, at in ((False, nu), (True, nu_across))
    )
    return np.asarray(np.maximum(measured - u, np.minimum(measured, alone)) + v)


def law_frequencies(s: Speaking, mode: Floats, fundamental: float | None = None) -> Floats:
    """Returns the frequencies (Hz), (n,), at which the damping law is taken for `mode` (n,) over `fundamental` (Hz).

    Default: f0, or, if f0 was measured, c / 2L of the tension in the table, which the published dampings follow.
    """
    s = s if fundamental is None else replace(s, damped_fundamental=fundamental)
    return np.asarray(law.damped_at(s, mode))


def loss_factor(s: Speaking, nu: Floats) -> Floats:
    """1/Q at the frequencies `nu` (Hz) of `law_frequencies`, shaped as nu, without the neck.

    Friction with the air (eq. 10), the viscoelastic term (eq. 11), the thermoelastic one (eq. 9) and the relaxation.
    """
    return np.asarray(law.loss_factor(s, nu))


def impedance(s: Speaking) -> float:
    """Wave impedance mu c of the string, kg/s, with c = 2 L f0."""
    return float(law.impedance(s.linear_density, s.length, s.fundamental))


def neck_detuning(s: Speaking, count: int, across: bool = False) -> Floats:
    """Relative shift of modes 1 to `count` by the neck, (count,): the last term of eq. 8, as part of nu_j / (j f0).

    across: of v.
    """
    j = np.arange(1, count + 1)
    return detuning(s.felt(across).at(j * s.fundamental), impedance(s), j)


def shapes(s: Speaking, count: int, x: Floats) -> Floats:
    """Mode shapes phi_j(x) = sqrt(2/L) sin(j pi x / L) at `x` (m from the stop), (len(x), count), m^-0.5: eq. 3."""
    j = np.arange(1, count + 1)
    return np.sqrt(2 / s.length) * np.sin(np.outer(np.asarray(x), j) * (math.pi / s.length))


def pluck_amplitudes(s: Speaking, count: int, pluck: Pluck, across: bool = False) -> Floats:
    """Modal amplitudes q_j(0), (count,), m^1.5, of `pluck` in the modes of u, or of v, if `across`; without its angle.

    A triangle, rounded by the finger and, by the law "hinged", by the string's own stiffness: the static shape under a
    force at one point has (c k_j / omega_j)^2 = 1 / (1 + B j^2) of a triangle's amplitudes.

    A gradual release weakens each by `release_loss`.
    """
    k = np.arange(1, count + 1) * (math.pi / s.length)  # rad/m
    a = pluck.position
    bend = pluck.apex * s.length / (a * (s.length - a))  # change of slope at the corner
    corner = np.exp(-((k * pluck.rounding) ** 2) / 2) / (1 + s.held_stiffness * k**2)
    if pluck.release:
        corner /= release_loss(frequencies(s, count, across=across), pluck.release)
    return np.asarray(math.sqrt(2 / s.length) * bend * np.sin(k * a) / k**2 * corner)


def release_loss(nu: Floats, release: float) -> Floats:
    """Factor by which a finger that lets go within about tau = `release` (s) weakens modes at `nu` (Hz).

    1 + (omega tau)^2, as if its force ended along exp(-|t| / tau) / (2 tau).
    """
    return np.asarray(1 + (2 * math.pi * nu * release) ** 2)


def grazing_apex(s: Speaking, position: float) -> float:
    """The apex (m) of a pluck at `position` (m from the stop) at which the string just reaches a fret.

    An ideal string plucked at `position` swings down to the mirror image, a triangle with its corner at L - position.
    Infinite if there is no obstacle.
    """
    a = s.length - position
    minimum = math.inf
    for x, height in zip(s.contact_position, s.contact_height, strict=True):
        shape = x / a if x < a else (s.length - x) / (s.length - a)
        minimum = min(minimum, -height / shape)
    return minimum


def carried_modes(s: Speaking, count: int, contact_rate: float) -> int:
    """Number of the first `count` modes that lie below `CARRIED` of the contact rate (Hz), at least 1.

    Higher modes turn too far in a fine step for contact to follow. Static compliance replaces them.
    """
    return max(1, int(np.count_nonzero(frequencies(s, count) < CARRIED * contact_rate)))
