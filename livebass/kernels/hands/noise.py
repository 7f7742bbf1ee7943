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
- Knock: from 130 Hz to the player's `release_cutoff`, at once when a hand ends a note, fading by e in KNOCK_TIME, by
  20 dB in 51 ms. Hands land alike on medium and hard notes. Below FAINT of a medium pluck's motion they come more
  gently, in proportion, so a knock never stands far above the note it ends; a string at rest gets none. Notes that are
  cut, or ended by another note on the same string, do not knock. No two releases are alike: with a `release_spread` of
  1 the knock is up to UNLIKE dB louder or softer; it fades 0.8 to 1.9 times as fast, and the hand is as much firmer.
- Rub: 350 to 2000 Hz, a finger of the fretting hand that comes down or leaves (player/placing.py). It sets out quickly,
  slows down and comes to rest. It passes windings at up to RUB_SPEED, which give WINDINGS of the power, and noise gives
  the rest; the power follows the speed. On a flat string there is only noise.

Levels: from notes and release noises of five real electric basses. 30 ms rms over that of a medium note: a release's
1.5 to 4 kHz -36 dB (80 % of takes: -45 to -28) and all of it -8 dB, in 76 releases of a Killer KB-Simmony; -20 dB (-25
to -14) and -10 dB in 28 of a Squier Jazz Bass. Rubs, 25 fretting noises of the first bass: -20 to -31 dB, centroid 0.8
to 2.5 kHz, within 6 dB of the loudest 10 ms for 37 to 125 ms. All are CC0: Karoryfer's fashionbass and growlybass.

Each frame draws a random number from the seed and the count of noise frames so far: a note sounds the same whenever it
is played, and no two notes are alike.
[audio thread]
"""

import numpy as np

from livebass.compiling import jit
from livebass.kernels.machine.elementary import chance, exp, exp2, square
from livebass.kernels.machine.noise import EVEN, amplitude, clear_band, next_of_band, tune_band
from livebass.kernels.string import modal

SKIN_BAND, SKIN_TIME = (800.0, 5000.0), 3.5e-3  # Hz; s
CLICK_BAND, CLICK_TIME, LANDING = (1200.0, 6000.0), 1.5e-3, 0.3
KNOCK_LOWEST, KNOCK_HIGHEST, KNOCK_TIME = 130.0, 1300.0, 22e-3  # the second without a cutoff
QUICKER, EITHER_WAY, UNLIKE = 0.3, 0.62, 4.5  # octaves, in the mean and to either side of it; dB to either side
RUB_BAND, RUB_SPEED, RUB_LEVEL = (350.0, 2000.0), 0.7, 0.02  # ; m/s; over the medium pluck's corner speed
WINDINGS = 0.7  # of a rub's power
RUB_FADE = 3e-3  # s: what is left when another finger begins, or the last one has stopped
SKEWED = 6.75  # the greatest speed of x (1 - x)^2 is 1 / SKEWED, at x = 1/3
LATER = 0.32  # level of a medium note 1 s after its onset, over its corner's speed
FAINT = 0.15  # rms speed of the string over a medium pluck's corner speed
INAUDIBLE = 1e-6  # m/s
APART, CLICKS_APART, RUBS_APART, ENDINGS_APART = 1 << 41, 3 << 40, 1 << 42, 5 << 40  # random numbers beyond all others


@jit
def tune_noises(voice, cutoff):
    """Sets the bands of the string's noises, silent; `cutoff` (Hz): of the knock, 0: the usual one."""
    tune_noise(voice.skin, SKIN_BAND, SKIN_TIME, voice.rate)
    tune_noise(voice.click, CLICK_BAND, CLICK_TIME, voice.rate)
    highest = cutoff if cutoff >= KNOCK_LOWEST else KNOCK_HIGHEST
    tune_noise(voice.knock, (KNOCK_LOWEST, highest), KNOCK_TIME, voice.rate)
    tune_band(voice.rub.band, RUB_BAND[0], RUB_BAND[1], voice.rate)


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
def haste_of_ending(voice):
    """How much quicker than usual the hand is that ends the string's present note: a factor; each call is a note."""
    voice.endings += 1
    if voice.release_spread == 0.0:
        return 1.0
    drawn = chance(voice.seed, ENDINGS_APART + 2 * voice.endings)
    return exp2(voice.release_spread * (QUICKER + EITHER_WAY * drawn))


@jit
def knock_string(voice, slot, op, haste):
    """Begins the knock of a hand that ends a slot's note, and fades `haste` times as fast as usual."""
    if voice.landing_noise > 0.0:
        square = modal.speed_square(slot.u, slot.active) + modal.speed_square(slot.v, slot.v_active)
        moving = np.sqrt(square / op.length) / (FAINT * voice.medium)
        level = min(moving, 1.0) * voice.landing_noise
        if voice.release_spread > 0.0:
            drawn = chance(voice.seed, ENDINGS_APART + 2 * voice.endings + 1)
            level *= amplitude(UNLIKE * voice.release_spread * drawn)
        voice.knock.speed = max(voice.knock.speed, level)
        voice.knock.fade = exp(-haste / (KNOCK_TIME * voice.rate))


@jit
def begin_rub(voice, event):
    """Begins the rub of a finger that the event describes, after its wait; with no level, the finger stays."""
    rub = voice.rub
    if event.value <= 0.0:
        keep_finger(voice)
        return
    rub.level = event.value * RUB_LEVEL * voice.medium
    rub.wait = np.int64(np.rint(event.wait * voice.rate))
    rub.frames = max(np.int64(np.rint(event.seconds * voice.rate)), 1)
    rub.frame = 0


@jit
def keep_finger(voice):
    """Keeps a finger that waits to leave where it is."""
    if voice.rub.wait > 0:
        end_rub(voice)


@jit
def end_rub(voice):
    """Stops the finger, now or after its wait."""
    voice.rub.wait = 0
    voice.rub.frames = 0


@jit
def next_rub(voice):
    """The next frame of a finger's rub, m/s."""
    rub = voice.rub
    if rub.wait > 0:
        rub.wait -= 1
        if rub.speed == 0.0:
            return 0.0
    elif rub.frame < rub.frames:
        rub.frame += 1
    rub.speed *= exp(-1.0 / (RUB_FADE * voice.rate))
    x = 0.0
    if rub.wait == 0 and rub.frame < rub.frames:
        part = rub.frame / rub.frames
        moving = SKEWED * part * square(1.0 - part)  # of the greatest speed
        rub.speed = max(rub.speed, rub.level * np.sqrt(moving))
        if voice.wound > 0.0:
            passed = RUB_SPEED / (voice.wound * voice.rate)
            rub.passed += moving * passed
            if rub.passed >= 1.0:
                rub.passed -= 1.0
                x = rub.speed * np.sqrt(WINDINGS / (EVEN * passed * moving))
    rest = 1.0 - WINDINGS if voice.wound > 0.0 else 1.0
    x += rub.speed * np.sqrt(rest) * chance(voice.seed, RUBS_APART + rub.drawn)
    rub.drawn += 1
    heard = next_of_band(rub.band, x)
    if rub.wait == 0 and rub.frame >= rub.frames and not INAUDIBLE < rub.speed < np.inf:
        rub.speed, rub.frames, rub.passed = 0.0, 0, 0.0
        clear_band(rub.band)
    return heard


@jit
def is_rubbing(voice):
    """True while a finger of the fretting hand moves, or waits to."""
    return voice.rub.frames > 0 or voice.rub.speed > 0.0


@jit
def is_noisy(voice):
    """True if a noise of the hands sounds, or is about to."""
    return voice.skin.speed > 0.0 or voice.click.speed > 0.0 or voice.knock.speed > 0.0 or is_rubbing(voice)


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
    if is_rubbing(voice):
        x += next_rub(voice)
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
