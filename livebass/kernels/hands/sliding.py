"""The left hand moving along and across the string: slides, bends, vibrato.

`string` is a STRING, `ops` the operators of its frets. [audio thread]
"""

import numpy as np

from livebass.compiling import jit
from livebass.kernels.hands import damping, scrape
from livebass.kernels.hands.fretting import GENTLY, change_fret, stands_at
from livebass.kernels.hands.pulling import end_pull
from livebass.kernels.machine.elementary import cos, exp, exp2, sin, square
from livebass.kernels.string import glide
from livebass.kernels.string.slot import highest_frequency, tune_slot, wake_slot

SLIDING_HAND = 0.5  # m/s, of a finger crossing a crown
SLIDE_TIME = 22e-3  # s per fret, of a hand
ONSET = 0.6  # s for a vibrato to deepen by a semitone
LIFTED = 3.5  # nepers that a lifting finger takes from a note until the end of its slide
BEND_FRAMES = 128  # frames between pitch bend updates, one string after another ...
BEND_SPEED = 400.0  # ... at semitones/s no faster than this


@jit
def follow_bend(string, ops):
    """Tunes the string towards the bend, at most at BEND_SPEED: faster, the string would gain energy."""
    voice = string.voice
    maximum = exp2(BEND_SPEED * BEND_FRAMES / (12.0 * voice.rate))
    voice.tuned = min(max(voice.bend, voice.tuned / maximum), voice.tuned * maximum)
    for k in range(2):
        slot = string.slots[k]
        if slot.on:
            op = glide.current_operator(string, ops, k)
            tune_slot(slot, op, voice.tuned, highest_frequency(voice))
            wake_slot(slot, op, voice.step)


@jit
def set_vibrato(voice, depth, rate):
    """Begins or ends a vibrato of `depth` semitones at `rate` Hz."""
    if voice.depth == 0.0 and depth > 0.0:
        voice.phase = 0.0
    voice.depth_wanted = depth
    voice.waver = rate


@jit
def is_vibrating(voice):
    """True if the string is in vibrato, or was until now."""
    return voice.depth > 0.0 or voice.depth_wanted > 0.0


@jit
def vibrato_tension(voice, slot):
    """The relative increase of a string's tension by vibrato in this frame.

    It is the square of the frequency ratio, less one: upwards from a fret, both ways on a board. Open strings have
    none.
    """
    maximum = 1.0 / (ONSET * voice.rate)
    voice.depth += min(max(voice.depth_wanted - voice.depth, -maximum), maximum)
    voice.phase += voice.waver / voice.rate
    voice.phase -= np.floor(voice.phase)
    if slot.fret == 0:
        return 0.0
    turn = 2 * np.pi * voice.phase
    up = sin(turn) if voice.fretless else 1.0 - cos(turn)
    return exp2(voice.depth * up / 12.0) - 1.0


@jit
def begin_slide(string, ops, fret, seconds):
    """Begins to slide to `fret`, `seconds` per fret: over the crowns, or along a board."""
    voice = string.voice
    voice.slide_every = np.int64(np.rint(seconds * voice.rate))
    voice.slide_left = 0
    voice.scraped = 0.0
    voice.landing = 0
    voice.lift_damping = 0.0
    voice.lifting = 0.0
    if string.slots[voice.slot].on and glides(voice):
        glide.begin_glide(string, ops, ops[fret].length, voice.slide_every)
    voice.slide_to = fret


@jit
def begin_timed_slide(string, ops, event):
    """Begins a slide that lasts the event's seconds, or as long as a hand needs; with a value, the finger lifts."""
    voice = string.voice
    slot = string.slots[voice.slot]
    frets = max(abs(event.fret - slot.fret), 1)
    begin_slide(string, ops, event.fret, max(event.seconds / frets, SLIDE_TIME))
    if slot.on and not glides(voice):
        voice.striking = 0
        scrape.fit_winding(voice, slot, ops[slot.fret])
        voice.slide_left = voice.slide_every
    voice.lift_damping = event.value
    if event.value > 0.0:
        voice.lifting = 2.0 * LIFTED / square(float(max(frets * voice.slide_every, 1)))


@jit
def glides(voice):
    """True if a finger slides on the string without steps."""
    return voice.fretless and voice.denominator == 1


@jit
def follow_slide(string, ops):
    """Moves the sliding finger by one frame."""
    voice = string.voice
    slot = string.slots[voice.slot]
    if voice.lifting > 0.0:
        slot.hand *= exp(-voice.lifting)
    if not slot.on or stands_at(slot, voice.slide_to):
        end_slide(string, ops)
    elif glides(voice):
        follow_glide(string, ops)
    else:
        follow_frets(string, ops)


@jit
def end_slide(string, ops):
    """Ends the slide, and the note if the finger lifts."""
    voice = string.voice
    voice.slide_to = -1
    damping.end_note(string, ops, voice.lift_damping)


@jit
def follow_frets(string, ops):
    """Moves the sliding finger over the next crown when it is time; until then it scrapes."""
    voice = string.voice
    slot = string.slots[voice.slot]
    up = voice.slide_to > slot.fret
    beside = slot.fret + 1 if up else slot.fret - 1
    if voice.slide_left > 0:
        distance = abs(ops[slot.fret].length - ops[beside].length)
        scrape.scrape(voice, slot, distance / voice.slide_every)
        voice.slide_left -= 1
        return
    if slot.moving:
        return
    end_pull(string, ops)
    held = 0.0 if voice.lifting > 0.0 else 1.0
    change_fret(string, ops, beside, SLIDING_HAND if up else GENTLY, held)
    scrape.fit_winding(voice, string.slots[voice.slot], ops[beside])
    voice.slide_left = voice.slide_every - 1


@jit
def follow_glide(string, ops):
    """Moves the gliding finger towards the next length, hands over when it is time, and ends at its fret."""
    voice = string.voice
    slot = string.slots[voice.slot]
    if slot.moving and not slot.between:
        return
    if voice.slide_left == 0:
        end_pull(string, ops)
        if voice.glide_frame >= voice.glide_frames:
            change_fret(string, ops, voice.slide_to, GENTLY, 0.0)
            end_slide(string, ops)
            return
        voice.slide_left = min(glide.period(voice), voice.glide_frames - voice.glide_frame)
        glide.hand_over(string, ops, glide.length_at(voice, voice.glide_frame + voice.slide_left))
        scrape.fit_winding(voice, string.slots[voice.slot], glide.between(string, voice.slot).op)
    scrape.scrape(voice, string.slots[voice.slot], glide.steer_ends(string))
    voice.glide_frame += 1
    voice.slide_left -= 1
