"""Sine, cosine, exponential, logarithm and power: the same bits in every build, on every processor and system.

The C libraries of Linux, macOS, Windows and browsers round these functions differently, and numpy does so on every kind
of processor; in hard playing, which is chaotic, one such last bit becomes audible. Here they consist of IEEE additions,
multiplications, divisions and comparisons of float64, and of operations on their bits; each of these has one result
everywhere. The operations keep their written order: `jit` compiles without fastmath, so LLVM neither reassociates nor
contracts a product and a sum into one instruction, and LLVM's inlining (`forceinline`) keeps that in callers compiled
with fastmath. `inlined` would not: it compiles a function with its caller's flags.

Results are within one ulp of the exact ones. Worst of some million random arguments, in ulp: sine 0.91 and cosine 0.87
up to 1e6 rad, exp 0.79 and exp2 0.77 (0.71 for normal results), log2 0.50, power 0.99 for exponents in the thousands,
and 0.70 in the contact law. There are hardly any branches and no tables: values are selected, so loops over modes
become vector instructions. Nor is there a fused multiply-add, which older processors and WebAssembly lack: where a
product must keep its lower half, `exact_product` splits the factors. The sign of a NaN is undefined, the sign of a zero
is lost. If the thread treats denormal numbers as zero (native.flush_bits), so do these functions.

tools/elementary.py derives the constants. A trailing digit counts the parts of a number, the highest first, or the
powers of a polynomial. `round_even` adds and subtracts 1.5 * 2^52, whose last bit is worth 1. [any thread]
"""

import numpy as np

from livebass.compiling import compiled, jit
from livebass.kernels.machine.native import bits, from_bits

# LLVM inlines these into their callers: only then do loops over modes become vector instructions.
joined = compiled(forceinline=True)

# pi / 2 in parts of 33, 33, 33 and 53 bits, and 2 / pi
QUARTER0, QUARTER1 = 1.5707963267341256, 6.077100506303966e-11
QUARTER2, QUARTER3 = 2.0222662487111665e-21, 8.4784276603689e-32
TURNS = 0.6366197723675814
# ln 2 in parts of 42 and 53 bits, and of 53 and 53; 1 / ln 2; 1 / 3
LN20, LN21 = 0.6931471805598903, 5.497923018708371e-14
LN2_WHOLE0, LN2_WHOLE1 = 0.6931471805599453, 2.3190468138462996e-17
OCTAVES0, OCTAVES1 = 1.4426950408889634, 2.0355273740931033e-17
THIRD0, THIRD1 = 0.3333333333333333, 1.850371707708594e-17
# sin r = r + r^3 S(r^2) and cos r = 1 - r^2 / 2 + r^4 C(r^2) for |r| <= pi / 4
S0, S1, S2 = -0.16666666666666666, 0.00833333333333095, -0.00019841269836759753
S3, S4, S5 = 2.755731610308511e-06, -2.5051131943226117e-08, 1.5918135633969727e-10
C0, C1, C2 = 0.041666666666666664, -0.0013888888888887398, 2.480158729876634e-05
C3, C4, C5 = -2.7557317272024545e-07, 2.087614632272149e-09, -1.1382635928972848e-11
# exp r = 1 + r + r^2 E(r) for |r| <= ln 2 / 2
E0, E1, E2, E3 = 0.5, 0.1666666666666667, 0.04166666666666668, 0.00833333333332614
E4, E5, E6, E7 = 0.0013888888888879082, 0.00019841269874802992, 2.4801587336423534e-05, 2.7557255422841082e-06
E8, E9, E10 = 2.7557263299268136e-07, 2.5105207497050777e-08, 2.09181302235058e-09
# atanh s = s (1 + s^2 (1 / 3 + s^2 L(s^2))) for s = (m - 1) / (m + 1), 1 / 2 <= m^2 <= 2
L0, L1, L2, L3 = 0.2, 0.14285714285714685, 0.11111111110826934, 0.09090909167899462
L4, L5, L6, L7 = 0.0769229746181797, 0.06667403302047484, 0.058530949094471645, 0.05861811780422839

MAGIC, MAGIC_BITS = 1.5 * 2.0**52, 0x4338000000000000
UPPER = -(1 << 27)  # mask of a float64 without the lower half of its digits
MANTISSA = (1 << 52) - 1
EXPONENT = 1023  # of 1.0
ROOT_HALF = 0x3FE6A09E667F3BCD  # the bits of the square root of 1/2
MIN_NORMAL = 2.0**-1022
RAISE, LAST_BIT = 2.0**54, 2.0**-52  # a power inside a function would be numba's, with Python's errors
FARTHEST = 2.0**50  # argument above which sine and cosine mean nothing


@joined
def round_even(x):
    """Returns `x` rounded to an integer, ties to even, for |x| < 2^51."""
    return (x + MAGIC) - MAGIC


@joined
def two_to(k):
    """Returns 2^k for an integer -1023 < k < 1024."""
    return from_bits((bits(k + MAGIC) + EXPONENT) << 52)


@joined
def square(x):
    """Returns x^2."""
    return x * x


@joined
def upper(x):
    """Returns `x` cut to 26 binary digits; the rest has 27."""
    return from_bits(bits(x) & UPPER)


@joined
def exact_product(a, b):
    """Returns a * b rounded, and the rounding error (Dekker 1971)."""
    a1, b1 = upper(a), upper(b)
    a2, b2 = a - a1, b - b1
    p = a * b
    return p, (((a1 * b1 - p) + a1 * b2) + a2 * b1) + a2 * b2


@joined
def difference(a, b):
    """Returns a - b rounded, and the rounding error (Knuth, Moeller)."""
    d = a - b
    back = d - a
    return d, (a - (d - back)) - (b + back)


@joined
def quarter_turn(x):
    """Returns sine and cosine of the rest of `x` (rad) after whole quarter turns, and bits that count these turns.

    pi / 2 has four parts (Cody and Waite): up to 2^20 quarter turns the first three products are exact. Above that the
    argument is off by about one rounding of `x`; from FARTHEST on it is zero.
    """
    x = x if abs(x) < FARTHEST else x * 0.0
    counted = x * TURNS + MAGIC
    k = counted - MAGIC
    t, rest = difference(x - k * QUARTER0, k * QUARTER1)
    t, rest_2 = difference(t, k * QUARTER2)
    rest += rest_2 - k * QUARTER3
    r = t + rest
    low = (t - r) + rest
    z = r * r
    z2 = z * z
    odd = (S0 + S1 * z) + z2 * ((S2 + S3 * z) + z2 * (S4 + S5 * z))
    even = (C0 + C1 * z) + z2 * ((C2 + C3 * z) + z2 * (C4 + C5 * z))
    sine = r + (z * (r * odd) + low * (1.0 - 0.5 * z))
    half = 0.5 * z
    near = 1.0 - half
    cosine = near + (((1.0 - near) - half) + (z2 * even - r * low))
    return sine, cosine, bits(counted)


@joined
def sin_of(sine, cosine, quarters):
    """Returns the sine from the three results of `quarter_turn`."""
    x = cosine if quarters & 1 else sine
    return from_bits(bits(x) ^ ((quarters & 2) << 62))


@joined
def sin_cos(x):
    """Returns sine and cosine of `x` (rad)."""
    sine, cosine, quarters = quarter_turn(x)
    return sin_of(sine, cosine, quarters), sin_of(sine, cosine, quarters + 1)


@joined
def sin(x):
    """Returns the sine of `x` (rad)."""
    sine, cosine, quarters = quarter_turn(x)
    return sin_of(sine, cosine, quarters)


@joined
def cos(x):
    """Returns the cosine of `x` (rad)."""
    sine, cosine, quarters = quarter_turn(x)
    return sin_of(sine, cosine, quarters + 1)


@joined
def exp_of(high, low, k):
    """Returns exp(high + low) 2^k, |high| <= ln 2 / 2, for an integer -2046 < k < 2047; 2^k in two factors."""
    z = high * high
    z2 = z * z
    first = (E0 + E1 * high) + z * (E2 + E3 * high)
    second = (E4 + E5 * high) + z * (E6 + E7 * high)
    third = (E8 + E9 * high) + z * E10
    w = z * (first + z2 * (second + z2 * third)) + low
    t = 1.0 + high
    half = round_even(0.5 * k)
    return (t + ((high - (t - 1.0)) + w)) * two_to(half) * two_to(k - half)


@joined
def exp_of_parts(x, rest):
    """Returns exp(x + rest), -1400 < x < 1400, `rest` small; infinite or zero if it does not fit."""
    k = round_even(x * OCTAVES0)
    near = x - k * LN20
    less = k * LN21 - rest
    high = near - less
    return exp_of(high, (near - high) - less, k)


@joined
def exp(x):
    """Returns e^x: infinity from 709.79 on, denormal below -708.4, zero below -745.14."""
    x = 710.0 if x > 710.0 else x
    x = -746.0 if x < -746.0 else x
    return exp_of_parts(x, 0.0)


@joined
def exp2(x):
    """Returns 2^x, exact for integers: infinity from 1024 on, denormal below -1022, zero from -1075 on."""
    x = 1025.0 if x > 1025.0 else x
    x = -1076.0 if x < -1076.0 else x
    k = round_even(x)
    high, low = exact_product(x - k, LN2_WHOLE0)
    return exp_of(high, low + (x - k) * LN2_WHOLE1, k)


@joined
def log_parts(x):
    """Returns k and ln m in two parts, accurate to 2^-63 of it: x = 2^k m and 1 / 2 <= m^2 < 2, for finite x > 0."""
    tiny = x < MIN_NORMAL
    x = x * RAISE if tiny else x
    word = bits(x) + ((EXPONENT << 52) - ROOT_HALF)
    m = from_bits((word & MANTISSA) + ROOT_HALF)
    # not a conversion: its instruction waits for its register's last value, and calls would not overlap
    k = from_bits((word >> 52) + MAGIC_BITS) - (MAGIC + EXPONENT + 54.0 if tiny else MAGIC + EXPONENT)
    # s = (m - 1) / (m + 1) and its rounding error
    top = m - 1.0
    under = m + 1.0
    inverse = 1.0 / under
    s = top * inverse
    s1, d1 = upper(s), upper(under)
    s2, d2 = s - s1, under - d1
    left = (((top - s1 * d1) - s1 * d2) - s2 * d1) - s2 * d2
    s_low = (left - s * (m - (under - 1.0))) * inverse
    # s^2 and s^3
    z, z_low = exact_product(s, s)
    z_low += 2.0 * s * s_low
    cube, cube_low = exact_product(s, z)
    cube_low += s * z_low + s_low * z
    z2 = z * z
    rest = ((L0 + L1 * z) + z2 * (L2 + L3 * z)) + (z2 * z2) * ((L4 + L5 * z) + z2 * (L6 + L7 * z))
    p = THIRD0 + z * rest
    p_low = ((THIRD0 - p) + z * rest) + THIRD1
    u, u_low = exact_product(cube, p)
    u_low += cube * p_low + cube_low * p
    high = s + u
    low = ((s - high) + u) + (s_low + u_low)
    return k, 2.0 * high, 2.0 * low


@jit
def log2(x):
    """Returns the binary logarithm of `x`, exact for powers of 2: -infinity at zero, NaN below."""
    k, high, low = log_parts(x)
    w, w_low = exact_product(high, OCTAVES0)
    w_low += high * OCTAVES1 + low * OCTAVES0
    y = k + w
    y += ((k - y) + w) + w_low
    y = x if x == np.inf else y
    y = -np.inf if x == 0.0 else y
    return y if x >= 0.0 else np.nan


@jit
def power(x, y):
    """Returns x^y for x >= 0, and NaN below: 0^y is 0, 1 or infinity for y > 0, = 0 or < 0, and 1^y is 1."""
    k, high, low = log_parts(x)
    # ln x in two parts: k LN20 is exact, and larger than ln m or zero
    whole = k * LN20
    ln = whole + high
    ln_low = ((whole - ln) + high) + (low + k * LN21)
    ln = x if x == np.inf else ln
    ln = -np.inf if x == 0.0 else ln
    ln = ln if x >= 0.0 else np.nan
    p, p_low = exact_product(y, ln)
    p_low += y * ln_low
    p_low = p_low if abs(p) < 746.0 else 0.0  # NaN where p is infinite
    p = 746.0 if p > 746.0 else p
    p = -746.0 if p < -746.0 else p
    z = exp_of_parts(p, p_low)
    z = 1.0 if x == 1.0 else z
    return 1.0 if y == 0.0 else z


@jit
def chance(seed, count):
    """Pseudo-random number from -1 to 1 for `seed` and `count`: SplitMix64 (Steele, Lea, Flood 2014)."""
    z = np.uint64(seed) + np.uint64(count) * np.uint64(0x9E3779B97F4A7C15)
    z = (z ^ (z >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    z = (z ^ (z >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    z = z ^ (z >> np.uint64(31))
    return np.float64(z >> np.uint64(11)) * LAST_BIT - 1.0
