"""The modes of a note: frequencies (eq. 8) and damping (eqs. 9 to 11), for kernels and for Python.

Neck and saddle need not give way most along u. Their own directions, a and b, may be turned by `axes_turned` from u
towards v: a = c u + s v, b = c v - s u, c and s its cosine and sine. `frequency` and `damping` are the laws along a and
b. Stiffness and damping of u and v follow from turning the axes: `turned_frequency` and `turned_damping` have the
diagonal, and `exchange` the rest, which makes u and v exchange energy (turning.py).

A `note` is a NOTE (preparing.py) or any object with its fields; its lists lie in `numbers`. Modes `j` count from 1. All
functions but `admittance` and its callers also take arrays. model/modes.py and model/neck.py explain the physics.
Equation numbers: Issanchou et al. (2018). [any thread]
"""

import numpy as np

from livebass.compiling import shared
from livebass.kernels.machine.elementary import cos, sin

AIR_VISCOSITY = 1.8e-5  # kg/m/s, eta_air of eq. 10
AIR_DENSITY = 1.2  # kg/m3, rho_air
CLAMP_WAVENUMBER = 800 / 0.863  # modes per metre; above this the published damping is constant
SQUARE_PI = np.pi**2


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
    """1/Q at `nu` (Hz) without the neck: air, viscoelastic and thermoelastic losses."""
    mu = note.linear_density
    boundary = np.sqrt(np.pi * AIR_VISCOSITY * AIR_DENSITY * nu)
    friction = 2.0 * np.pi * AIR_VISCOSITY + 2.0 * np.pi * note.diameter * boundary
    air = friction / (2.0 * np.pi * mu * nu)
    product = 4.0 * SQUARE_PI * mu * note.bending / (note.tension * note.tension) * (nu * nu)
    if note.paper_law:
        return air + product * note.viscoelastic_angle + note.thermoelastic
    square = 2.0 * product / (1.0 + np.sqrt(1.0 + 4.0 * product))  # B j^2, as `product` is B j^2 (1 + B j^2)
    return air + note.viscoelastic_angle * square / (1.0 + square) + note.thermoelastic


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
    """nu_j, Hz, along a, or along b if `across`: eq. 8, or measured.

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
    """sigma_j, 1/s, along a, or along b if `across`, at `nu` (Hz): eqs. 9 to 11, or measured.

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
def are_turned(note):
    """True if u and v exchange energy."""
    return note.own_across != 0 and note.axes_turned != 0.0


@shared
def turned_frequency(note, numbers, j, across):
    """nu_j (Hz) of u, or of v if `across`, without their exchange."""
    nu = frequency(note, numbers, j, across)
    if not are_turned(note):
        return nu
    other = frequency(note, numbers, j, not across)
    part = sin(note.axes_turned)
    return np.sqrt(nu * nu + part * part * (other * other - nu * nu))


@shared
def axis_damping(note, numbers, j, across):
    """sigma_j (1/s) along a, or along b if `across`, at its own frequency."""
    return damping(note, numbers, j, frequency(note, numbers, j, across), across)


@shared
def turned_damping(note, numbers, j, nu, across):
    """sigma_j (1/s) of u, or of v if `across`, at `nu` (Hz), their `turned_frequency`, without their exchange."""
    if not are_turned(note):
        return damping(note, numbers, j, nu, across)
    part = sin(note.axes_turned)
    own, other = axis_damping(note, numbers, j, across), axis_damping(note, numbers, j, not across)
    return own + part * part * (other - own)


@shared
def min_damping(note, numbers, j):
    """The smaller sigma_j (1/s) of both axes: no direction has less."""
    return min(axis_damping(note, numbers, j, False), axis_damping(note, numbers, j, True))


@shared
def exchange(note, numbers, j):
    """The rate e (rad/s) at which mode `j` of u and of v exchange amplitudes, and Delta: turning.py.

    Delta is the damping of u, of v, and d between them (1/s), above `min_damping`.
    """
    a, b = frequency(note, numbers, j, False), frequency(note, numbers, j, True)
    u, v = turned_frequency(note, numbers, j, False), turned_frequency(note, numbers, j, True)
    sine, cosine = sin(note.axes_turned), cos(note.axes_turned)
    rate = sine * cosine * np.pi * (a * a - b * b) / np.sqrt(u * v)
    more = axis_damping(note, numbers, j, False) - axis_damping(note, numbers, j, True)
    part = cosine if more > 0.0 else sine  # of the axis with the greater damping
    own = part * part * abs(more)
    return rate, own, abs(more) - own, sine * cosine * more
