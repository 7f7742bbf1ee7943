"""A finger that slides along a wound string scrapes: it squeaks at the rate of passing windings, plus noise.

The end of the fingertip falls off one winding after another: it pushes the string for a frame each time it has moved by
the winding's pitch, give or take JITTER. Between pushes there is noise. A force F over a frame h gives mode j the
velocity F h / mu phi_j. w.strike holds a winding's velocities: no thumb strikes a string while a finger slides.
[audio thread]
"""

import numpy as np

from livebass.compiling import jit
from livebass.kernels.machine.elementary import chance, sin_cos
from livebass.kernels.string import modal

TIP = 8e-3  # m, from the stop to the end of the fingertip
PUSH = 0.02  # m/s, of one winding, as a force over the string's impedance: an estimate, 0.02 to 0.05 N
JITTER = 0.2  # of the pitch
NOISE = 0.55  # of a push, times the square root of pushes per frame: 10 dB under them, as the noise is uniform


@jit
def fit_winding(voice, slot, op):
    """Computes one winding's modal velocities for the string's present length."""
    if voice.winding <= 0.0:
        return
    sine, cosine = sin_cos(np.pi / op.length * TIP)
    before, now = 0.0, voice.squeak * PUSH * op.steps * op.fine * op.speed * np.sqrt(2 / op.length) * sine
    for j in range(op.padded):
        slot.u.strike[j] = now if j < op.modes else 0.0
        before, now = now, 2.0 * cosine * now - before


@jit
def scrape(voice, slot, distance):
    """Scrapes for one frame, in which the finger moves `distance` m."""
    if voice.winding <= 0.0 or distance <= 0.0:
        return
    passed = distance / voice.winding
    force = NOISE * np.sqrt(passed) * chance(voice.turn, 2 * voice.frame)
    voice.scraped += passed
    if voice.scraped >= 1.0:
        voice.scraped -= 1.0 + JITTER * chance(voice.turn, 2 * voice.frame + 1)
        force += 1.0
    slot.active = max(slot.active, slot.heard)
    modal.add_strike(slot.u, slot.heard, slot.u.strike, force)
