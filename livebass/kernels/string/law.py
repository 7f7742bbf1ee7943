"""The modes of a note: frequencies (eq. 8) and damping (eqs. 9 to 11, and a relaxation), for kernels and for Python.

Eqs. 8 and 9 take the neck's admittance at a real frequency. That holds while the string loses far less than the neck's
resonances do. The law "paper" and measured modes follow them as printed. The law "hinged" solves string and neck as one
system (`ringing`): s = s_j - 2 f0 mu c (1 + B j^2) Y(s), with s_j of the string on a rigid neck, and Y at the complex s
itself. Eqs. 8 and 9 are the first step of its solution. Near a resonance it has two solutions, as both string and neck
move in both; a mode takes the one that moves the string more.

Neck and saddle need not give way most along u. Their own directions, a and b, may be turned by `axes_turned` from u
towards v: a = c u + s v, b = c v - s u, c and s its cosine and sine. `along` is the law along a and b. Stiffness and
damping of u and v follow from turning the axes: `turned_frequency` and `turned_damping` have the diagonal, and
`exchange` the rest, which makes u and v exchange energy (turning.py).

A `note` is a NOTE (preparing.py) or any object with its fields; its lists lie in `numbers`. Modes `j` count from 1. All
functions but `admittance`, `ringing` and their callers also take arrays. model/modes.py and model/neck.py explain the
physics. Equation numbers: Issanchou et al. (2018). [any thread]
"""

import numpy as np

from livebass.compiling import shared
from livebass.kernels.machine.elementary import cos, sin

AIR_VISCOSITY = 1.8e-5  # kg/m/s, eta_air of eq. 10
AIR_DENSITY = 1.2  # kg/m3, rho_air
CLAMP_WAVENUMBER = 800 / 0.863  # modes per metre; above this the published damping is constant
SQUARE_PI = np.pi**2
ROUNDS = 30  # of `approach`; most modes need 3 to 5
NEAR_ENOUGH = 1e-12  # of the frequency
TINY = 1e-300  # keeps a division by zero finite


@shared
def stretch_ratio(paper_law, inharmonicity, j):
    """nu_j / (j f0) on a rigid neck."""
    square = inharmonicity * (j * j)
    return 1.0 + square / 2.0 if paper_law else np.sqrt(1.0 + square)


@shared
def impedance(linear_density, length, fundamental):
    """mu c of a string, kg/s."""
    return 2.0 * linear_density * length * fundamental


@shared
def resonance(f, quality, mass, nu):
    """Re and Im of one resonance's admittance (Hz, Q, kg) at `nu` (Hz), over nu, m/N."""
    off = f * f - nu * nu
    width = nu * f / quality
    part = 1.0 / (2.0 * np.pi * mass * (off * off + width * width))
    return width * part, off * part


@shared
def detuning(susceptance, impedance, j):
    """Relative shift of mode `j` by the neck, its term in nu_j / (j f0), from Im Y at its frequency."""
    return -impedance / (np.pi * j) * susceptance


@shared
def neck_damping(conductance, impedance, fundamental):
    """Damping (1/s) of a mode by the neck, its term in sigma_j, from Re Y at its frequency."""
    return 2.0 * fundamental * impedance * conductance


@shared
def damped_at(note, j):
    """The frequency (Hz) at which to evaluate the damping law."""
    if note.paper_law:
        return np.minimum(j, note.clamp) * note.damped_fundamental
    return j * note.damped_fundamental * stretch_ratio(0, note.inharmonicity, j)


@shared
def loss_factor(note, nu):
    """1/Q at `nu` (Hz) without the neck: air, viscoelastic and thermoelastic losses, and the relaxation.

    The relaxation is the internal friction of a standard linear solid, 1/Q = Delta x / (1 + x^2) with x = nu / nu_r
    (A. S. Nowick and B. S. Berry, Anelastic Relaxation in Crystalline Solids, 1972): dampings grow as nu^2 below nu_r
    and are constant above.
    """
    mu = note.linear_density
    boundary = np.sqrt(np.pi * AIR_VISCOSITY * AIR_DENSITY * nu)
    friction = 2.0 * np.pi * AIR_VISCOSITY + 2.0 * np.pi * note.diameter * boundary
    air = friction / (2.0 * np.pi * mu * nu)
    product = 4.0 * SQUARE_PI * mu * note.bending / (note.tension * note.tension) * (nu * nu)
    at = note.relaxation_frequency
    relaxing = note.relaxation * (nu * at / (nu * nu + at * at))
    if note.paper_law:
        return air + product * note.viscoelastic_angle + note.thermoelastic + relaxing
    square = 2.0 * product / (1.0 + np.sqrt(1.0 + 4.0 * product))  # B j^2, as `product` is B j^2 (1 + B j^2)
    return air + note.viscoelastic_angle * square / (1.0 + square) + note.thermoelastic + relaxing


@shared
def bending_stiffness(inharmonicity, tension, length):
    """E I of a string's core, N m^2: B = pi^2 E I / (T L^2)."""
    return inharmonicity * tension * (length * length) / SQUARE_PI


@shared
def held_part(paper_law, inharmonicity, length):
    """E I / T (m^2) for the shape that a finger holds; 0 for the law "paper", whose shape is a triangle."""
    part = length / np.pi
    return 0.0 if paper_law else inharmonicity * (part * part)


@shared
def clamped_mode(length):
    """The mode number from which the law "paper" has constant damping."""
    return max(1.0, np.floor(CLAMP_WAVENUMBER * length))


@shared
def admittance(note, numbers, nu, across):
    """Re Y and Im Y (m/s/N) of the neck at `nu` (Hz), as felt by u, or by v if `across`."""
    if across and note.own_across:
        y = sum_resonances(numbers, note.resonances_across, note.resonances_across_count, note.stop_across, nu)
        a, b = interpolate_rows(numbers, note.table_across, note.table_across_count, 1.0, nu)
    else:
        y = sum_resonances(numbers, note.resonances, note.resonances_count, note.stop, nu)
        a, b = interpolate_rows(numbers, note.table, note.table_count, 1.0, nu)
    return y[0] + a, y[1] + b


@shared
def sum_resonances(numbers, first, count, stop, nu):
    """Re Y and Im Y (m/s/N) of `count` resonances, rows (Hz, Q, kg) from `first` on, plus a stop."""
    real = 0.0
    imaginary = 0.0
    for i in range(count):
        row = first + 3 * i
        width, off = resonance(numbers[row], numbers[row + 1], numbers[row + 2], nu)
        real += width
        imaginary += off
    return stop + nu * real, nu * imaginary


@shared
def interpolate_rows(numbers, first, count, part, nu):
    """`part` times Re Y and Im Y (m/s/N), interpolated in `count` rows (Hz, Re Y, Im Y) from `first`; 0 outside."""
    if count == 0 or not numbers[first] <= nu <= numbers[first + 3 * (count - 1)]:
        return 0.0, 0.0
    i = 0
    while i < count - 1 and numbers[first + 3 * (i + 1)] <= nu:
        i += 1
    row = first + 3 * i
    a = part * numbers[row + 1]
    b = part * numbers[row + 2]
    if i < count - 1:
        x = nu - numbers[row]
        step = numbers[row + 3] - numbers[row]
        a += (part * numbers[row + 4] - a) / step * x
        b += (part * numbers[row + 5] - b) / step * x
    return a, b


@shared
def frequency(note, numbers, j, across):
    """nu_j, Hz, along a, or along b if `across`: eq. 8 as printed, or measured.

    b has the measured frequency of a, shifted by its own neck and length.
    """
    nu = j * note.fundamental
    through = impedance(note.linear_density, note.length, note.fundamental)
    own = across and note.own_across
    if j <= note.frequencies_count:
        found = numbers[note.frequencies + j - 1]
        if own:
            aside = detuning(admittance(note, numbers, nu, True)[1], through, j)
            found += nu * (aside - detuning(admittance(note, numbers, nu, False)[1], through, j))
    else:
        aside = detuning(admittance(note, numbers, nu, across)[1], through, j)
        found = nu * (stretch_ratio(note.paper_law, note.inharmonicity, float(j)) + aside)
    return found / (1.0 + note.longer_across) if own else found


@shared
def damping(note, numbers, j, nu, across):
    """sigma_j, 1/s, along a, or along b if `across`, at `nu` (Hz): eqs. 9 to 11 as printed, or measured.

    b has the measured damping of a, with the neck's damping of a replaced by its damping of b; the string itself loses
    no less than by its own law, or than measured if that is less.
    """
    law = damped_at(note, float(j))
    own = across and note.own_across
    sigma = 0.0
    if j <= note.dampings_count and not own:
        sigma = numbers[note.dampings + j - 1]
    else:
        through = impedance(note.linear_density, note.length, note.fundamental)
        sigma = np.pi * law * loss_factor(note, law)
        if j <= note.dampings_count:
            found = numbers[note.dampings + j - 1]
            y = admittance(note, numbers, frequency(note, numbers, j, False), False)[0]
            sigma = max(found - neck_damping(y, through, note.fundamental), min(found, sigma))
        sigma += neck_damping(admittance(note, numbers, nu, across)[0], through, note.fundamental)
    return sigma + note.extra_damping + note.extra_damping_slope * 2.0 * np.pi * law


@shared
def along(note, numbers, j, across):
    """nu_j (Hz) and sigma_j (1/s) along a, or along b if `across`."""
    if is_printed(note, j):
        nu = frequency(note, numbers, j, across)
        return nu, damping(note, numbers, j, nu, across)
    nu, decay = ringing(note, numbers, j, across)
    return np.sqrt(nu * nu + decay * decay), 2.0 * np.pi * decay


@shared
def is_printed(note, j):
    """True if mode `j` follows eqs. 8 and 9 as printed: by the law "paper", or because it was measured."""
    return note.paper_law != 0 or j <= max(note.frequencies_count, note.dampings_count)


@shared
def ringing(note, numbers, j, across):
    """The frequency (Hz) and the decay (1/s, over 2 pi) with which mode `j` rings along a, or along b if `across`."""
    nu, decay, rate = alone(note, float(j), across)
    if across and note.own_across:
        y = interpolate_rows(numbers, note.table_across, note.table_across_count, 1.0, nu)
        first, count, stop = note.resonances_across, note.resonances_across_count, note.stop_across
    else:
        y = interpolate_rows(numbers, note.table, note.table_count, 1.0, nu)
        first, count, stop = note.resonances, note.resonances_count, note.stop
    still = rings_at(nu - rate * y[1], decay + rate * (stop + y[0]))
    if count == 0:
        return still
    near = nearest(numbers, first, count, still)
    at = still
    for _ in range(ROUNDS):
        before = at
        at = approach(numbers, (first, count), rate, still, near, before)
        if abs(at[0] - before[0]) + abs(at[1] - before[1]) < NEAR_ENOUGH * nu:
            break
    return at


@shared
def alone(note, j, across):
    """Mode `j` on a rigid neck by the law "hinged": its eigenfrequency (Hz) and its decay (1/s, over 2 pi).

    Also returns the rate 2 f0 mu c (1 + B j^2) / (2 pi), Hz per m/s/N, at which the neck's admittance changes them.
    """
    law = damped_at(note, j)
    decay = law * (0.5 * loss_factor(note, law) + note.extra_damping_slope) + note.extra_damping / (2.0 * np.pi)
    ratio = stretch_ratio(0, note.inharmonicity, j)
    nu = j * note.fundamental * ratio
    if across and note.own_across:
        nu = nu / (1.0 + note.longer_across)
    through = impedance(note.linear_density, note.length, note.fundamental)
    return nu, decay, note.fundamental * through * ratio * ratio / np.pi


@shared
def rings_at(nu, decay):
    """The frequency (Hz) at which a mode of eigenfrequency `nu` (Hz) rings, 0 if it creeps; and its `decay`."""
    square = nu * nu - decay * decay
    return np.sqrt(0.5 * (square + abs(square))), decay


@shared
def moving(numbers, row, at):
    """`resonating` for the resonance at `row`."""
    return resonating(numbers[row], numbers[row + 1], numbers[row + 2], at)


@shared
def resonating(f, quality, mass, at):
    """Re and Im (m/s/N) of one resonance's admittance (Hz, Q, kg) for a motion that rings and decays `at` (Hz).

    Also returns how steep it is there, by any measure.
    """
    nu, decay = at
    off = f * f - nu * nu + decay * (decay - f / quality)
    width = nu * (f / quality - 2.0 * decay)
    part = 1.0 / (2.0 * np.pi * mass * (off * off + width * width + TINY))
    return part * (nu * width - decay * off), part * (nu * off + decay * width), part


@shared
def nearest(numbers, first, count, at):
    """The resonance that the motion `at` (ringing, decay in Hz) is nearest to: whose admittance is steepest there.

    Returns its place in the list, one over its mass (kg), and ringing and decay (Hz) of its poles, the nearer first.
    """
    none = 0.0 * at[0]
    place, steepest = none, none
    f, quality, light = none + numbers[first], none + numbers[first + 1], none + 1.0 / numbers[first + 2]
    for i in range(count):
        row = first + 3 * i
        steep = moving(numbers, row, at)[2]
        more = (steep > steepest) * 1.0
        steepest = steepest + more * (steep - steepest)
        place = place + more * (i - place)
        f = f + more * (numbers[row] - f)
        quality = quality + more * (numbers[row + 1] - quality)
        light = light + more * (1.0 / numbers[row + 2] - light)
    decay = f / (2.0 * quality)
    square = f * f - decay * decay
    rings = (square > 0.0) * 1.0  # else it creeps: two real poles
    apart = np.sqrt(abs(square))
    ring, creep = rings * apart, (1.0 - rings) * apart
    return place, light, (ring, decay + creep), (-ring, decay - creep)


@shared
def approach(numbers, rows, rate, still, near, at):
    """A step from `at` towards the line of a string that rings `still` (ringing, decay in Hz) without resonances.

    The admittances at `at` of all resonances but the one `near` stay as they are, and so does that one's residue:
    this leaves a quadratic equation. rows: the first and the number of the resonances.
    """
    place, light, pole, other = near
    nu, decay = still
    for i in range(rows[1]):
        real, imaginary, _ = moving(numbers, rows[0] + 3 * i, at)
        part = rate * (i != place)
        nu = nu - part * imaginary
        decay = decay + part * real
    x, y = other[1] - at[1], at[0] - other[0]
    scale = rate * light / (2.0 * np.pi * (x * x + y * y + TINY))
    half, up = 0.5 * (pole[1] - decay), 0.5 * (nu - pole[0])
    real, imaginary = complex_root(
        half * half - up * up - scale * (at[0] * y - at[1] * x), 2.0 * half * up - scale * (at[0] * x + at[1] * y)
    )
    sign = 1.0 - 2.0 * (half * real + up * imaginary < 0.0)  # of the root nearer to the string without this resonance
    return 0.5 * (nu + pole[0]) + sign * imaginary, 0.5 * (decay + pole[1]) - sign * real


@shared
def complex_root(real, imaginary):
    """Re and Im of a square root of a complex number."""
    size = np.sqrt(real * real + imaginary * imaginary)
    greater = np.sqrt(0.5 * (size + abs(real)))
    smaller = 0.5 * imaginary / (greater + TINY)
    positive = (real >= 0.0) * 1.0
    return positive * greater + (1.0 - positive) * smaller, positive * smaller + (1.0 - positive) * greater


@shared
def are_turned(note):
    """True if u and v exchange energy."""
    return note.own_across != 0 and note.axes_turned != 0.0


@shared
def lines_of(note, modes):
    """Number of lines of so many modes: each has one, or one along each axis if these are turned."""
    return modes * (1 + are_turned(note))


@shared
def both_axes(note, numbers, j):
    """nu_j (Hz) along a and along b, then sigma_j (1/s) along a and along b."""
    nu, sigma = along(note, numbers, j, False)
    if note.own_across == 0:
        return nu, nu, sigma, sigma
    nu_across, sigma_across = along(note, numbers, j, True)
    return nu, nu_across, sigma, sigma_across


@shared
def turned_frequency(note, axes, across):
    """nu_j (Hz) of u, or of v if `across`, without their exchange, from `both_axes`."""
    nu, other = (axes[1], axes[0]) if across else (axes[0], axes[1])
    if not are_turned(note):
        return nu
    part = sin(note.axes_turned)
    return np.sqrt(nu * nu + part * part * (other * other - nu * nu))


@shared
def turned_damping(note, axes, across):
    """sigma_j (1/s) of u, or of v if `across`, without their exchange, from `both_axes`."""
    own, other = (axes[3], axes[2]) if across else (axes[2], axes[3])
    if not are_turned(note):
        return own
    part = sin(note.axes_turned)
    return own + part * part * (other - own)


@shared
def exchange(note, axes):
    """The rate e (rad/s) at which u and v exchange a mode's amplitudes, and Delta, from `both_axes`: turning.py.

    Delta is the damping of u, of v, and d between them (1/s), above the smaller one of both axes.
    """
    u, v = turned_frequency(note, axes, False), turned_frequency(note, axes, True)
    sine, cosine = sin(note.axes_turned), cos(note.axes_turned)
    rate = sine * cosine * np.pi * (axes[0] * axes[0] - axes[1] * axes[1]) / np.sqrt(u * v)
    more = axes[2] - axes[3]
    part = cosine if more > 0.0 else sine  # of the axis with the greater damping
    own = part * part * abs(more)
    return rate, own, abs(more) - own, sine * cosine * more
