"""The noise floor of a bass: the noise of its electronics and the hum of its coils. It follows the volume but no note.

The noise is white up to `floor_cutoff`: coil, tone pot and cable filter the strings, not the preamplifier behind them.
Below `floor_corner` its flicker is louder: the density is 1 + corner / frequency times that of the white noise, within
1 dB, by shelves of 6 dB two octaves apart.

It belongs to the whole bass, so no string has to stay awake for it. `mix.mix_strings` and `Engine` add it to the lowest
string's signal, so the strings' signals add up to the mix. It opens with the first frame in which a string is louder
than OPENS, stays for HOLD after the last such frame, through rests, and fades within FADE: a bass that nobody plays is
silent. When a panic cuts the strings, it fades without HOLD. It depends only on the frame and the strings' signals,
random numbers included, so block sizes do not matter. Checks for sounding strings ignore it: it prolongs no tail. When
another bass has taken over, it fades at once.

The hum is the mains' frequency with harmonics up to HARMONICS. Harmonic k has the amplitude 1 / k if it is odd, and
EVEN / k if it is even: an estimate. [audio thread]
"""

import numpy as np

from livebass.compiling import entry, jit
from livebass.kernels.bass.records import SHELVES, bass_at
from livebass.kernels.machine.elementary import chance, cos, exp, sin
from livebass.kernels.machine.native import floats_at, records_at
from livebass.kernels.machine.noise import amplitude, clear_band, next_of_band, tune_band
from livebass.kernels.string.records import CUT, DOUBLE, EVENT, GAIN

LOWEST = 40.0  # Hz
DULL = 3000.0  # Hz, the cutoff of instrument files that have none
HARMONICS, EVEN = 15, 0.3
HUM_RMS = np.sqrt(0.5 * sum(((1.0 if k % 2 else EVEN) / k) ** 2 for k in range(1, HARMONICS + 1)))  # of `hum_wave`
OPENS = 1e-6  # of full scale
HOLD, FADE = 4.0, 0.5  # s
NOTE = 0.32  # level of a medium note's first 0.3 s, over the signal of the string's speed at the pluck
APART = 1 << 42  # random numbers beyond all others
NEVER = 1 << 62  # a frame

events_at = records_at(EVENT)


@jit
def make_floor(f, player, note, rate, gain_pole, seed):
    """Makes a bass's noise floor in a zeroed FLOOR, by the levels (dB) of a PLAYER over a medium note.

    `note` is the signal of that note's pluck speed, `rate` in Hz.
    """
    f.level = amplitude(player.floor_noise) * NOTE * note
    f.hum = amplitude(player.hum) * NOTE * note / HUM_RMS
    f.mains = player.mains / rate
    f.seed = seed
    f.hold = np.int64(HOLD * rate)
    f.fade = np.int64(FADE * rate)
    f.gain = 1.0
    f.gain_wanted = 1.0
    f.gain_pole = gain_pole
    f.closes = NEVER
    tune_band(f.band, LOWEST, player.floor_cutoff if player.floor_cutoff >= LOWEST else DULL, rate)
    corner = player.floor_corner
    for k in range(SHELVES):
        f.flicker[k].pole = 1.0 - exp(-np.pi * corner / rate)
        corner *= 0.25


@jit
def play_floor(f, loud, events, count):
    """Replaces `loud`, (n,), the strings' loudness in each of the next frames, by the floor.

    `events[:count]` are the bass's events in these frames, by frame: the floor follows their volume.
    """
    k = 0
    for j in range(loud.shape[0]):
        while k < count and events[k].frame <= f.frame:
            take_event(f, events[k])
            k += 1
        if f.frame >= f.closes:
            f.left = min(f.left, f.fade)
        elif loud[j] > OPENS:
            f.left = f.hold + f.fade
        elif f.frame < f.cut:
            f.left = min(f.left, f.fade)
        loud[j] = next_of_floor(f)
        f.frame += 1
    while k < count:
        take_event(f, events[k])
        k += 1


@jit
def take_event(f, event):
    """Takes the volume, or the cut of a string, from an event."""
    if event.kind == GAIN and event.string == 0:
        f.gain_wanted = event.value
    elif event.kind == CUT:
        f.cut = event.frame + f.fade


@jit
def next_of_floor(f):
    """Returns the next sample of the floor."""
    if f.left == 0:
        f.gain = f.gain_wanted
        return 0.0
    f.gain += f.gain_pole * (f.gain_wanted - f.gain)
    x = next_of_band(f.band, chance(f.seed, APART + f.heard))
    for k in range(SHELVES):
        shelf = f.flicker[k]
        shelf.low_pass += shelf.pole * (x - shelf.low_pass)
        x += shelf.low_pass
    x *= f.level * f.gain
    if f.hum > 0.0:
        x += f.hum * f.gain * hum_wave(f.mains * f.heard)
    f.heard += 1
    if f.left < f.fade:
        x *= f.left / f.fade
    f.left -= 1
    if f.left == 0:
        f.heard = 0
        clear_band(f.band)
        for k in range(SHELVES):
            f.flicker[k].low_pass = 0.0
    return x


@jit
def hum_wave(turns):
    """The hum after `turns` periods of the mains; its first harmonic has the amplitude 1."""
    angle = 2 * np.pi * (turns - np.floor(turns))
    twice, before, now, x = 2.0 * cos(angle), 0.0, sin(angle), 0.0
    for k in range(1, HARMONICS + 1):
        x += (1.0 if k % 2 else EVEN) / k * now
        before, now = now, twice * now - before
    return x


@entry("void(int64, int64, int64, int64, int64, int64, int64)")
def add_floor(bass, sounds, strings, floor, frames, events, count):
    """C function: adds the floor of the BASS at an address to its first string, and writes it to `floor`.

    The addresses are those of float64 (strings, frames), of float64 (frames,), and of EVENT (count,), by frame.
    """
    first, made = floats_at(sounds, frames), floats_at(floor, frames)
    for j in range(frames):
        made[j] = abs(first[j])
    for i in range(1, strings):
        string = floats_at(sounds + DOUBLE * frames * i, frames)
        for j in range(frames):
            made[j] = max(made[j], abs(string[j]))
    play_floor(bass_at(bass).floor, made, events_at(events, count), count)
    for j in range(frames):
        first[j] += made[j]
