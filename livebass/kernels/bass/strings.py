"""Makes the strings and the player of an INSTRUMENT. [any thread]"""

import numpy as np

from livebass.compiling import SMALL, compiled, entry
from livebass.kernels.bass.instrument import WORD, copy_words, instrument_at
from livebass.kernels.hands.noise import LATER, tune_noises
from livebass.kernels.hands.sliding import BEND_FRAMES, set_vibrato
from livebass.kernels.machine.elementary import exp
from livebass.kernels.machine.native import copy_record, record_address, record_at, records_at
from livebass.kernels.machine.noise import amplitude
from livebass.kernels.pickup import tone
from livebass.kernels.pickup.coil import CIRCUIT, COIL
from livebass.kernels.player.constants import KEYS
from livebass.kernels.player.controls import make_controls
from livebass.kernels.player.expression import VIBRATO_RATE, bend_ratio, loudness, vibrato_depth
from livebass.kernels.player.performer import performer_at
from livebass.kernels.player.strokes import fill_strokes, force_at, speed_of_corner
from livebass.kernels.string import answers
from livebass.kernels.string.records import MAX_PICKUPS, OPERATOR, STRING, VOICE_SLOTS

jit = compiled(attributes=SMALL)

MEDIUM, MEDIUM_PLACE = 0.5, 0.74  # 0 softest note, 1 hardest; part of the open string from the nut
BLOCKER_HZ = 6.0  # DC blocker's corner
GAIN_TIME = 6e-3  # s, how fast volume follows its controller
string_at = record_at(STRING)
operators_at = records_at(OPERATOR, 2)
coil_at = record_at(COIL)
CIRCUIT_BYTES = CIRCUIT.itemsize


@entry("void(int64, float64, int64, int64, int64, int64)", SMALL)
def rest_string(string, rate, numerator, denominator, over_frets, over_board):
    """Makes a silent string in the zeroed STRING at an address; its output is its displacement.

    `numerator` fine steps make `denominator` frames; over_frets and over_board are addresses of C functions.
    """
    reset_string(string_at(string), rate, numerator, denominator, over_frets, over_board)


@jit
def reset_string(string, rate, numerator, denominator, over_frets, over_board):
    """`rest_string` for a record."""
    voice = string.voice
    voice.over_frets = over_frets
    voice.over_board = over_board
    voice.numerator = numerator
    voice.denominator = denominator
    voice.rate = rate
    voice.bend = 1.0
    voice.slide_to = -1
    voice.tuned = 1.0
    voice.gain = 1.0
    voice.gain_wanted = 1.0
    voice.b[0] = 1.0
    voice.a[0] = 1.0
    voice.block = exp(-2 * np.pi * BLOCKER_HZ / rate)
    voice.gain_pole = 1.0 - exp(-1.0 / (GAIN_TIME * rate))
    for k in range(VOICE_SLOTS):
        string.slots[k].hand = 1.0
        string.slots[k].ratio = 1.0


@entry("void(int64, int64, int64, int64)", SMALL)
def connect_string(string, instrument, i, coil):
    """Gives a string at rest an INSTRUMENT's pickups and hand for string `i`, and a COIL's filter."""
    connect_pickups(string_at(string), instrument_at(instrument), i, coil_at(coil))


@jit
def connect_pickups(string, instrument, i, coil):
    """`connect_string` for records."""
    voice, player = string.voice, instrument.player
    voice.pickups = instrument.pickups[i]
    voice.stretch = instrument.stretch[i]
    voice.squeak = amplitude(player.squeak)
    voice.winding = instrument.winding[i] if voice.squeak > 0.0 else 0.0
    voice.wound = instrument.winding[i]
    voice.fretless = instrument.fretless[i]
    for k in range(MAX_PICKUPS):
        voice.decay[k] = instrument.decay[i, k]
        voice.mix[k] = instrument.mix[i, k]
        voice.level[k] = voice.mix[k]
        voice.across[k] = instrument.across[i, k]
        voice.saddle[k] = instrument.saddle[i, k]
        voice.aperture[k] = instrument.aperture[i, k]
    if voice.pickups > 0:
        for k in range(4):
            voice.b[k] = coil.b[k]
            voice.a[k] = coil.a[k]
    for k in range(4):
        voice.b[k] *= instrument.gain
    voice.pull = np.int64(np.rint(player.pull_time * voice.rate))
    voice.strike = max(1, np.int64(np.rint(player.strike_time * voice.rate)))
    voice.rounding = player.rounding
    voice.strike_width = player.strike_width
    voice.release = player.release_time
    voice.thumb_mass = player.thumb_mass
    voice.thumb_width = player.thumb_width
    voice.thumb_stiffness = player.thumb_stiffness
    voice.thumb_loss = player.thumb_loss
    voice.angle = player.pluck_angle
    voice.follow = player.release_speed / player.greatest_apex
    tune_noises(voice, player.release_cutoff)
    voice.release_spread = player.release_spread
    voice.turn = i * BEND_FRAMES // instrument.strings


@jit
def fit_noises(string, i, instrument, p, ops, seed):
    """Gives the connected string `i` of an INSTRUMENT the performer's hand noise; `seed` seeds it."""
    voice = string.voice
    voice.seed = seed + i
    voice.medium = 0.5 * speed_of_corner(p, ops[i, 0], i, force_at(p, MEDIUM), MEDIUM_PLACE * ops[i, 0].length)
    voice.lever = 2.0 * voice.saddle[0] / ops[i, 0].speed if voice.pickups == 0 else 0.0
    voice.landing_noise = LATER * voice.medium * amplitude(instrument.player.release_noise)


@jit
def signal_of_medium(voice):
    """Signal of a medium pluck: of the string's speed below the coil's resonance, or of a sensor's displacement."""
    level, top, bottom = voice.lever, 0.0, 0.0
    for k in range(voice.pickups):
        level += abs(voice.level[k])
    for k in range(4):
        top += voice.b[k]
        bottom += voice.a[k]
    return voice.medium * level * top / bottom


@entry("void(int64, int64, int64, int64)", SMALL)
def connect_answers(string, i, instrument, ops):
    """Gives the connected string `i` of an INSTRUMENT the others' answers; ops: address of all operators."""
    bass = instrument_at(instrument)
    answers.fill_answers(string_at(string), i, bass, operators_at(ops, bass.strings, bass.frets + 1))


@entry("void(int64, int64, int64)", SMALL)
def settle_string(string, performer, i):
    """C function: `set_controls` for the address of a STRING, string `i` of the PERFORMER at an address."""
    set_controls(string_at(string).voice, performer_at(performer), i)


@jit
def set_controls(voice, p, i):
    """Sets the voice of string `i`, at rest, to its performer's controllers, without a ramp."""
    voice.gain_wanted = loudness(p, i)
    voice.gain = voice.gain_wanted
    voice.bend = bend_ratio(p, i)
    voice.tuned = voice.bend
    voice.tone_wanted = p.tone
    if voice.tone != voice.tone_wanted:
        tone.set_tone(voice, voice.tone_wanted)
    voice.blend_wanted = p.controls.blend
    tone.set_blend(voice, voice.blend_wanted)
    set_vibrato(voice, vibrato_depth(p, i), VIBRATO_RATE)


@jit
def take_circuit(coil, instrument, rate):
    """Gives a COIL the parts of the instrument's circuit and the rate (Hz)."""
    copy_words(record_address(instrument.circuit), record_address(coil), CIRCUIT_BYTES // WORD)
    coil.rate = rate


@entry("void(int64, int64, int64)", SMALL)
def new_performer(performer, instrument, seed):
    """Makes an INSTRUMENT's player in the zeroed PERFORMER at an address; `seed` seeds its unevenness."""
    make_performer(performer_at(performer), instrument_at(instrument), seed)


@jit
def make_performer(p, instrument, seed):
    """`new_performer` for records."""
    p.strings = instrument.strings
    p.frets = instrument.frets
    for i in range(instrument.strings):
        p.open[i] = instrument.open_note[i]
        p.slack[i] = instrument.slack[i]
        p.called[i] = instrument.called[i]
    copy_record(p.player, instrument.player)
    copy_record(p.key_map, instrument.key_map)
    fill_strokes(p, instrument.strokes)
    p.hands.key[:] = -1
    for velocity in range(KEYS):
        p.part[velocity] = instrument.part[velocity]
    p.default_slapped = p.player.slapped_strings if instrument.slap else 0
    p.wheel_slides = instrument.wheel_slides
    p.answering = instrument.answering
    p.drop = instrument.drop
    p.seed = seed & np.int64(0x7FFF_FFFF_FFFF_FFFF)
    p.placed = p.player.pluck_position
    p.ranged = p.player.bend_range
    p.dynamics = 1.0
    p.hand_damping = p.player.hand_damping
    p.unevenness = p.player.unevenness
    p.slapped = p.default_slapped
    p.default_stroke = p.stroke = instrument.stroke
    p.forced = -1
    p.hands.place = 1
    make_controls(p)
