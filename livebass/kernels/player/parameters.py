"""Parameters, by number (techniques.py), that hosts or controllers move while the bass plays.

0 always means the bass's own value. [audio thread]
"""

import numpy as np

from livebass.compiling import jit
from livebass.kernels.machine.elementary import log2, power
from livebass.kernels.player.channels import record_of
from livebass.kernels.player.constants import CONTROLLERS, FINGER, KEYS, PICK, POP
from livebass.kernels.player.events import send_value_to_all
from livebass.kernels.player.expression import send_bends, send_gains, update_vibrato
from livebass.kernels.player.performer import ANY
from livebass.kernels.player.strokes import position_at
from livebass.kernels.player.touches import touch_palms
from livebass.kernels.string.records import BLEND, TONE
from livebass.rows import techniques

MAX_UNEVENNESS = 0.5
VOLUME_LAW = 40.0 * 0.30102999566398120  # dB per doubling of a volume controller


@jit
def within_limits(number, value):
    """The value of parameter `number`, held within its limits; NaN means 0, the usual."""
    if np.isnan(value):
        return 0.0
    return min(max(value, techniques.MINIMUM[number]), techniques.MAXIMUM[number])


@jit
def set_parameter(p, number, value):
    """Sets the player's parameter `number` to a value within its limits."""
    adjust_player(p, number, value)
    if number == techniques.TONE_POT:
        send_value_to_all(p, TONE, value)
    elif number == techniques.BEND_RANGE:
        send_bends(p, np.int64(ANY))


@jit
def adjust_player(p, number, value):
    """`set_parameter` without the events for the strings."""
    p.controls.adjusted[number] = value
    if number == techniques.TONE_POT:
        p.tone = value
    elif number == techniques.PLUCK_POSITION:
        p.placed = position_at(p, value)
        p.position = p.placed
    elif number == techniques.DYNAMICS:
        p.dynamics = power(10.0, value / 20.0)
    elif number == techniques.TECHNIQUE:
        set_technique(p, np.int64(np.rint(value)))
    elif number == techniques.HAND_DAMPING:
        p.hand_damping = p.player.hand_damping * power(10.0, value)
    elif number == techniques.UNEVENNESS:
        p.unevenness = p.player.unevenness
        if value != 0.0:
            p.unevenness = min(max(p.player.unevenness + value, 0.0), MAX_UNEVENNESS)
    elif number == techniques.BEND_RANGE:
        p.ranged = p.player.bend_range if value == 0.0 else max(value, 1.0)
        for channel in range(ANY + 1):
            p.controls.channel[channel].range = p.ranged


@jit
def set_technique(p, which):
    """Sets the stroke by `which`, a value of TECHNIQUE; strings that the thumb does not strike are then popped."""
    p.slapped = 0
    if which == techniques.OWN or (which == techniques.THUMB and p.default_slapped > 0):
        p.slapped = p.default_slapped
    elif which in (techniques.THUMB, techniques.THUMB_ON_TWO):
        p.slapped = min(2, p.strings)
    elif which == techniques.THUMB_ON_ALL:
        p.slapped = p.strings
    p.stroke = p.default_stroke
    if which == techniques.POPS or p.slapped > 0:
        p.stroke = POP
    elif which == techniques.PICKED:
        p.stroke = PICK
    elif which == techniques.FINGERS or (which == techniques.PLUCKED and p.stroke == POP):
        p.stroke = FINGER


@jit
def set_amount(p, ops, function, amount):
    """Sets palm mute or vibrato, 0 to 1, or the blend, -1 to 1, to `amount`, as its controller does.

    `function`: CC_PALM, CC_VIBRATO or CC_BLEND. NaN means 0.
    """
    controls = p.controls
    minimum = -1.0 if function == techniques.CC_BLEND else 0.0
    amount = min(max(amount, minimum), 1.0) if not np.isnan(amount) else 0.0
    if function == techniques.CC_BLEND and amount != controls.blend:
        controls.blend = amount
        send_value_to_all(p, BLEND, amount)
    if function == techniques.CC_PALM:
        controls.palm_set = amount
        if amount != controls.palm:
            controls.palm = amount
            touch_palms(p, ops)
    if function == techniques.CC_VIBRATO:
        controls.vibrato_set = amount
        others = 0
        for i in range(p.strings):
            others |= (1 if record_of(p, i).vibrato != amount else 0) << i
        for channel in range(ANY + 1):
            controls.channel[channel].vibrato = amount
        for i in range(p.strings):
            if (others >> i) & 1:
                update_vibrato(p, i)


@jit
def place_note(p, key, x):
    """Gives the next note of `key` its own pluck position, in units of PLUCK_POSITION."""
    if key < KEYS:
        p.controls.place_of[key] = x if np.isnan(x) else within_limits(np.int64(techniques.PLUCK_POSITION), x)


@jit
def string_note(p, key, i):
    """Plays the next note of `key` on string `i`, if that string has it."""
    if key < KEYS:
        p.controls.string_of[key] = np.int64(i) if 0.0 <= i < p.strings else -1


@jit
def value_at(number, value):
    """The value of parameter `number` for a controller at `value`, 0 to 127: the middle, 64, is the usual value.

    The gain follows a volume controller, from silence to 0 dB. Parameters whose minimum is 0 run from there to their
    maximum at 127: the bend range in whole numbers. The stroke takes its first four values in equal steps.
    """
    minimum, maximum = techniques.MINIMUM[number], techniques.MAXIMUM[number]
    if number == techniques.GAIN_DB:
        return max(VOLUME_LAW * log2(value / 127.0), minimum) if value > 0 else minimum
    if number == techniques.TECHNIQUE:
        return np.float64(value * (techniques.THUMB_ON_ALL + 1) // CONTROLLERS)
    if number == techniques.BEND_RANGE:
        return np.float64(np.int64(value * maximum / 127.0 + 0.5))
    if minimum == 0.0:
        return value * maximum / 127.0
    if value < 64:
        return minimum * (64 - value) / 64.0
    return maximum * (value - 64) / 63.0


@jit
def turn_parameter(p, number, value):
    """Moves parameter `number` with a controller, as a host would."""
    x = np.float64(np.float32(value_at(number, value)))  # as precise as a host's values
    if number == techniques.GAIN_DB:
        p.controls.level = power(10.0, x / 20.0) if x > techniques.MINIMUM[techniques.GAIN_DB] else 0.0
        send_gains(p, np.int64(ANY))
    else:
        set_parameter(p, number, x)
