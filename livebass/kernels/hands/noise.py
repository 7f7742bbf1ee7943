"""Noise of the hands on top of the string's motion: skin or pick in a pluck, the knock of a release.

All are added to the string speed that every pickup senses, ahead of coil, tone and volume. A displacement sensor feels
them as waves that the saddle, at a distance x, reflects: a speed s moves it by 2 x s / c. In reality a fingertip
slipping off a winding is a noise force at its place, and a landing hand knocks on string, fret and neck. As forces they
would cost a pass over all modes in every noisy frame; the string would ring on with them, some 20 dB below, and each
pickup would hear them through its own comb. This model omits that.

- Skin: 0.8 to 5 kHz. It grows while the finger pulls, peaks as the finger lets go, and fades by e in SKIN_TIME. The
  performer sets its level, which grows with force (player/strokes.py).
- Pick: 1.2 to 6 kHz, two clicks, as it lands on the string and as it lets go. Each fades by e in CLICK_TIME; the first
  is LANDING of the second. Their level is in proportion to the force. With this noise a pick makes none of skin.
- Knock: 130 to 1300 Hz, at once when a hand ends a note, fading by e in KNOCK_TIME, by 20 dB in 51 ms. Hands land alike
  on medium and hard notes. Below FAINT of a medium pluck's motion they come more gently, in proportion, so a knock
  never stands far above the note it ends; a string at rest gets none. Notes that are cut, or ended by another note on
  the same string, do not knock.

Levels: from notes and release noises of five real electric basses. Each frame draws a random number from the
seed and the count of noise frames so far: a note sounds the same whenever it is played, and no two notes are alike.
[audio thread]
"""

import numpy as np

from livebass.compiling import jit
from livebass.kernels.machine.elementary import chance, exp
from livebass.kernels.machine.noise import clear_band, next_of_band, tune_band
from livebass.kernels.string import modal

SKIN_BAND, SKIN_TIME = (800.0, 5000.0), 3.5e-3  # Hz; s
CLICK_BAND, CLICK_TIME, LANDING = (1200.0, 6000.0), 1.5e-3, 0.3
KNOCK_BAND, KNOCK_TIME = (130.0, 1300.0), 22e-3
LATER = 0.32  # level of a medium note 1 s after its onset, over its corner's speed
FAINT = 0.15  # rms speed of the string over a medium pluck's corner speed
INAUDIBLE = 1e-6  # m/s
APART, CLICKS_APART = 1 << 41, 3 << 40  # random numbers beyond all others


@jit
def tune_noises(voice):
    """Sets the bands of the string's noises, silent."""
    tune_noise(voice.skin, SKIN_BAND, SKIN_TIME, voice.rate)
    tune_noise(voice.click, CLICK_BAND, CLICK_TIME, voice.rate)
    tune_noise(voice.knock, KNOCK_BAND, KNOCK_TIME, voice.rate)


@jit
def tune_noise(noise, ends, seconds, rate):
    """Sets a NOISE between two `ends` (Hz) that fades by e within `seconds`."""
    tune_band(noise.band, ends[0], ends[1], rate)
    noise.fade = exp(-1.0 / (seconds * rate))
    noise.speed = 0.0
    noise.growth = 0.0


@jit
def begin_skin(voice, speed):
    """Begins a pluck's noise, which grows to `speed` (m/s, rms) until the finger lets go."""
    voice.skin.growth = speed / max(voice.pull, 1)
    if voice.pull == 0:
        voice.skin.speed += speed


@jit
def begin_click(voice, speed):
    """Lands a pick, which clicks again, at `speed` (m/s, rms), when it lets go; 0: none does."""
    voice.click.speed = max(voice.click.speed, LANDING * speed)
    voice.click.growth = speed


@jit
def knock_string(voice, slot, op):
    """Begins the knock of a hand that ends a slot's note."""
    if voice.landing_noise > 0.0:
        square = modal.speed_square(slot.u, slot.active) + modal.speed_square(slot.v, slot.v_active)
        moving = np.sqrt(square / op.length) / (FAINT * voice.medium)
        voice.knock.speed = max(voice.knock.speed, min(moving, 1.0) * voice.landing_noise)


@jit
def is_noisy(voice):
    """True if a noise of the hands sounds."""
    return voice.skin.speed > 0.0 or voice.click.speed > 0.0 or voice.knock.speed > 0.0


@jit
def end_noise(noise):
    noise.speed = 0.0
    noise.growth = 0.0
    clear_band(noise.band)


@jit
def is_pulling(voice):
    """True while the finger pulls the string, after its wait on it."""
    return 0 < voice.pulling <= voice.pull


@jit
def hear_hands(voice, y):
    """Adds this frame's noises to each pickup's speed in `y`, which follows its displacement, or to a sensor's."""
    skin, click, knock = voice.skin, voice.click, voice.knock
    x = 0.0
    if is_pulling(voice):
        skin.speed += skin.growth
    if skin.speed > 0.0:
        x += skin.speed * next_of_band(skin.band, chance(voice.seed, APART + 2 * skin.frames))
        skin.frames += 1
        if voice.pulling == 0:
            fade_noise(skin)
    if voice.pulling == 0 and click.growth > 0.0:
        click.speed += click.growth
        click.growth = 0.0
    if click.speed > 0.0:
        x += click.speed * next_of_band(click.band, chance(voice.seed, CLICKS_APART + click.frames))
        click.frames += 1
        if click.growth > 0.0:
            click.speed *= click.fade
        else:
            fade_noise(click)
    if knock.speed > 0.0:
        x += knock.speed * next_of_band(knock.band, chance(voice.seed, APART + 2 * knock.frames + 1))
        knock.frames += 1
        fade_noise(knock)
    if x != 0.0:
        for i in range(voice.pickups):
            y[2 * i + 1] += x
        if voice.pickups == 0:
            y[0] += voice.lever * x


@jit
def fade_noise(noise):
    """Fades a NOISE by a frame."""
    noise.speed *= noise.fade
    if not INAUDIBLE < noise.speed < np.inf:
        end_noise(noise)
