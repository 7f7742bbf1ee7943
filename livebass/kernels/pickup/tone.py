"""The player's tone pot and pickup blend: prefitted filters, and levels.

The row of filters runs from the closed pot, through the bass's own filter in the middle, to the open pot. Between two
filters the reflection coefficients are interpolated: a stable filter's are within -1 and 1, so every filter in between
is stable too. A string follows pot and blend gradually, to avoid clicks. [any thread]
"""

from typing import Any

import numpy as np

from livebass.compiling import inlined, jit
from livebass.kernels.machine.elementary import exp
from livebass.kernels.machine.native import floats_at
from livebass.kernels.pickup.coil import ORDER, fit

BELOW, ABOVE = 32, 16  # filters between the bass's own and the closed pot, and the open pot
TONES = BELOW + 1 + ABOVE
ROW = 3 * (ORDER + 1)  # float64 of a filter: b, a, reflection coefficients and the gain at 0 Hz
FRAMES = 8  # between a string's steps towards the pot
TIME = 6e-3  # s, time constant of the steps ...
SWEEP = 0.05  # s, ... but at least this from the bass's own tone to either end: a pot that opens at once would click
NEAR = 1e-3  # of the way: close enough to jump to the target


@inlined
def filters_at(address):
    """The filters at an address, (TONES * ROW,)."""
    return floats_at(address, TONES * ROW)


@jit
def fit_tones(address, coil, gain):
    """Fits all filters for a COIL that has the bass's own tone; leaves the COIL fitted for that tone."""
    own, filters = coil.tone, filters_at(address)
    for k in range(TONES):
        k = (k + BELOW + 1) % TONES  # the bass's own comes last
        if k <= BELOW:
            coil.tone = own * k / BELOW
        else:
            coil.tone = own + (1.0 - own) * (k - BELOW) / ABOVE
        if k == BELOW:
            coil.tone = own
        fit(coil)
        keep_filter(filters, ROW * k, coil, gain)


@jit
def keep_filter(filters, at, coil, gain):
    """Writes a COIL's filter, times `gain`, to the row of `filters` that begins at `at`."""
    b, a, parts = at, at + ORDER + 1, at + 2 * (ORDER + 1)
    sum_b, sum_a = 0.0, 0.0
    for k in range(ORDER + 1):
        filters[b + k] = coil.b[k] * gain
        filters[a + k] = coil.a[k]
        filters[parts + k] = coil.a[k]
        sum_b += filters[b + k]
        sum_a += coil.a[k]
    for m in range(ORDER, 1, -1):  # Levinson's recursion downwards
        last = filters[parts + m]
        for i in range(1, m // 2 + 1):
            x, y = filters[parts + i], filters[parts + m - i]
            filters[parts + i] = (x - last * y) / (1.0 - last * last)
            filters[parts + m - i] = (y - last * x) / (1.0 - last * last)
    filters[parts] = sum_b / sum_a


@jit
def set_tone(voice, x):
    """Gives a string the filter for the pot at `x`, -1 to 1; 0 is exactly the bass's own."""
    voice.tone = x
    if voice.tones == 0 or voice.pickups == 0:
        return
    filters = filters_at(voice.tones)
    where = BELOW * (x + 1.0) if x <= 0.0 else BELOW + ABOVE * x
    k: Any = min(max(np.int64(where), 0), TONES - 1)
    part = where - k
    b, a, parts = ROW * k, ROW * k + ORDER + 1, ROW * k + 2 * (ORDER + 1)
    if part == 0.0 or k == TONES - 1:
        for i in range(ORDER + 1):
            voice.b[i] = filters[b + i]
            voice.a[i] = filters[a + i]
        return
    sum_b, sum_a = 0.0, 0.0
    for i in range(ORDER + 1):
        voice.b[i] = filters[b + i] + part * (filters[b + ROW + i] - filters[b + i])
        sum_b += voice.b[i]
    for m in range(1, ORDER + 1):  # Levinson's recursion upwards
        last = filters[parts + m] + part * (filters[parts + ROW + m] - filters[parts + m])
        for i in range(1, m // 2 + 1):
            u, v = voice.a[i], voice.a[m - i]
            voice.a[i] = u + last * v
            voice.a[m - i] = v + last * u
        voice.a[m] = last
    for i in range(ORDER + 1):
        sum_a += voice.a[i]
    gain = filters[parts] + part * (filters[parts + ROW] - filters[parts])
    scale = gain * sum_a / sum_b  # low notes keep the circuit's level
    if 0.1 < scale < 10.0:
        for i in range(ORDER + 1):
            voice.b[i] *= scale


@jit
def follow_tone(voice):
    """Moves a string's filter a step towards the wanted tone."""
    step = 1.0 - exp(-FRAMES / (TIME * voice.rate))
    maximum = FRAMES / (SWEEP * voice.rate)
    x = voice.tone + min(max(step * (voice.tone_wanted - voice.tone), -maximum), maximum)
    if abs(voice.tone_wanted - x) < NEAR:
        x = voice.tone_wanted
    set_tone(voice, x)


@jit
def set_blend(voice, x):
    """Gives a string's pickups the levels of the blend `x`, -1 to 1; 0 is exactly the bass's own.

    The pickup at one end fades to nothing as the blend goes to the other end; middle pickups fade half as far.
    """
    voice.blend = x
    nearest, farthest = np.inf, 0.0  # to the saddle, m
    for k in range(voice.pickups):
        nearest = min(nearest, voice.saddle[k])
        farthest = max(farthest, voice.saddle[k])
    for k in range(voice.pickups):
        voice.mix[k] = voice.level[k]
        if x != 0.0 and farthest > nearest:
            place = (voice.saddle[k] - nearest) / (farthest - nearest)  # 0 at the bridge, 1 at the neck
            voice.mix[k] *= 1.0 - (x * place if x > 0.0 else x * (place - 1.0))


@jit
def follow_blend(voice):
    """Moves the levels of a string's pickups a step towards the wanted blend."""
    x = voice.blend + voice.gain_pole * (voice.blend_wanted - voice.blend)
    if abs(voice.blend_wanted - x) < NEAR:
        x = voice.blend_wanted
    set_blend(voice, x)
