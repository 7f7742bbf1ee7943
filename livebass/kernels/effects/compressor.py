"""A one-knob compressor: threshold, ratio and make-up gain follow the knob. [audio thread]

Feed-forward, with a soft knee; a decoupled peak detector (Giannoulis, Massberg and Reiss 2012) smooths the reduction in
dB: it falls back with RELEASE, and rises with ATTACK. With the knob at 0 the sound is unchanged, bit for bit.
"""

from livebass.compiling import jit
from livebass.kernels.machine.elementary import exp, exp2, log2

ATTACK, RELEASE = 5e-3, 0.15  # s
RATIO = 5.0  # the knob's addition to a ratio of 1
THRESHOLD, LOWER = -8.0, 20.0  # dB of full scale with the knob at 0, and the amount by which the knob lowers it
KNEE = 6.0  # dB, whole width
MADE_UP = 0.5  # part of the reduction at full scale that the make-up gain restores
FOLLOWS = 20e-3  # s, time constant of the effects' knobs ...
THERE = 1e-4  # ... which jump to the target once this near
DB = 6.020599913279624  # of a factor of 2
QUIETEST = 1e-12  # of full scale: the lowest meaningful level


@jit
def threshold_of(knob):
    """The threshold, dB of full scale."""
    return THRESHOLD - LOWER * knob


@jit
def slope_of(knob):
    """Returns the reduction per dB above the threshold: 1 - 1 / ratio."""
    return RATIO * knob / (1.0 + RATIO * knob)


@jit
def reduction_of(knob, level):
    """The reduction, dB, for a steady level (dB of full scale)."""
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
    """The next value of a knob that moves to `wanted` by `step` of the way."""
    value += step * (wanted - value)
    return wanted if abs(wanted - value) < THERE else value


@jit
def compress(e, requested, n):
    """Compresses n frames of an EFFECTS' sound; the knob is `requested`, (n,), or the bass's own where that is 0."""
    step = 1.0 - exp(-1.0 / (FOLLOWS * e.rate))
    attack, release = exp(-1.0 / (ATTACK * e.rate)), exp(-1.0 / (RELEASE * e.rate))
    for j in range(n):
        wanted = requested[j] if requested[j] > 0.0 else e.own_compression
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
    """Resets the compressor."""
    e.held = 0.0
    e.reduction = 0.0
