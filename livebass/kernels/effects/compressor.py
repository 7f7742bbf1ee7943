"""A compressor with one knob: threshold, ratio and make-up gain follow it. [audio thread]

Feed-forward, with a soft knee; the reduction in dB is smoothed by a decoupled detector of peaks (Giannoulis, Massberg
and Reiss 2012): it falls back by RELEASE, and rises by ATTACK. At 0 of the knob it is not there, bit for bit.
"""

from livebass.compiling import jit
from livebass.kernels.machine.elementary import exp, exp2, log2

ATTACK, RELEASE = 5e-3, 0.15  # s
RATIO = 5.0  # what the knob adds to a ratio of 1
THRESHOLD, LOWER = -8.0, 20.0  # dB of full scale with the knob at 0, and how far the knob lowers it
KNEE = 6.0  # dB, whole width
MADE_UP = 0.5  # part of the reduction at full scale that the make-up gain gives back
FOLLOWS = 20e-3  # s, how fast the knobs of effects are followed ...
THERE = 1e-4  # ... until they are so near
DB = 6.020599913279624  # of a factor of 2
QUIETEST = 1e-12  # of full scale: below that a level means nothing


@jit
def threshold_of(knob):
    """The threshold, dB of full scale."""
    return THRESHOLD - LOWER * knob


@jit
def slope_of(knob):
    """Returns what is taken away of each dB above the threshold: 1 - 1 / ratio."""
    return RATIO * knob / (1.0 + RATIO * knob)


@jit
def reduction_of(knob, level):
    """The reduction, dB, of a steady level (dB of full scale)."""
    over = level - threshold_of(knob)
    if over <= -0.5 * KNEE:
        return 0.0
    if over < 0.5 * KNEE:
        over = (over + 0.5 * KNEE) * (over + 0.5 * KNEE) / (2.0 * KNEE)
    return slope_of(knob) * over


@jit
def make_up_of(knob):
    """The make-up gain, dB."""
    return MADE_UP * reduction_of(knob, 0.0)


@jit
def follow_knob(value, wanted, step):
    """The next value of a knob that is to go to `wanted`, `step` of the way."""
    value += step * (wanted - value)
    return wanted if abs(wanted - value) < THERE else value


@jit
def compress(e, asked, n):
    """Compresses n frames of the sound of an EFFECTS; the knob is `asked`, (n,), or the bass's own where that is 0."""
    step = 1.0 - exp(-1.0 / (FOLLOWS * e.rate))
    attack, release = exp(-1.0 / (ATTACK * e.rate)), exp(-1.0 / (RELEASE * e.rate))
    for j in range(n):
        wanted = asked[j] if asked[j] > 0.0 else e.own_compression
        if e.compression != wanted:
            e.compression = follow_knob(e.compression, wanted, step)
        if e.compression == 0.0:
            silence_compressor(e)
            continue
        x = e.sound[j]
        now = reduction_of(e.compression, DB * log2(max(abs(x), QUIETEST)))
        e.held = max(now, now + release * (e.held - now))
        e.reduction = e.held + attack * (e.reduction - e.held)
        e.sound[j] = x * exp2((make_up_of(e.compression) - e.reduction) / DB)
        e.heard[j] = 1.0


@jit
def silence_compressor(e):
    """Forgets all input."""
    e.held = 0.0
    e.reduction = 0.0
