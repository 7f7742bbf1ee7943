"""The sounds of the fretting hand between notes: fingers that come down on another fret, and fingers that leave.

A finger comes down with the stroke of its note: live playing cannot know a note earlier, and files and tablatures
follow the same rule. The finger sounds if it was elsewhere, or has left meanwhile, and if the hand has had HAND_TIME
since its last note: a chord is one movement. The first note of all makes no sound, as the hand is ready for it; nor do
hammer-ons, pull-offs, slides, taps, ghost notes, open strings and harmonics. A finger that has ended a note leaves the
string after a while if the hand stops no other note before. Levels and times are drawn from the seed and the note's
count. hands/noise.py makes the sound, and says how it was measured. [audio thread]
"""

from livebass.compiling import SMALL, compiled
from livebass.kernels.machine.elementary import chance
from livebass.kernels.machine.noise import amplitude
from livebass.kernels.player.events import send_rub
from livebass.kernels.player.performer import FREE

jit = compiled(attributes=SMALL)

HAND_TIME = 80e-3  # s
SHORT, LONG, FARTHEST = 90e-3, 220e-3, 7  # s that a finger moves, to a place nearby and from so many frets away
BY_CHANCE = 0.4  # part of the difference between these that is drawn
UNEQUAL = 4.0  # dB to either side
LEAVES, LEAVES_LATER = 0.12, 0.1  # s after a note: at least, and drawn on top
LEAVING = -6.0  # dB, of a finger that leaves, over one that comes down
PLACES_APART, DRAWS = 1 << 43, 4  # random numbers beyond all others; of a note


@jit
def place_finger(p, op, i, fret):
    """Brings a finger down on `fret` of string `i`, whose stroke this is; `op`: the open string's operator."""
    hands, frame = p.hands, p.out.frame
    if p.player.fretting_noise <= 0.0 or fret == 0:
        return
    second = op.steps * op.fine  # of a frame
    to = 1 + i * (p.frets + 1) + fret
    there = hands.placed == to
    if there and hands.leaves_after > 0.0:
        there = (frame - hands.eased_at) * second < hands.leaves_after
    ready = hands.placed == 0 or there or (frame - hands.placed_at) * second < HAND_TIME
    away = abs(fret - (hands.placed - 1) % (p.frets + 1))
    for k in range(p.strings):
        if (hands.leaving >> k) & 1:
            send_rub(p, k, 0.0, 0.0, 0.0)
    hands.placed, hands.placed_at = to, frame
    hands.leaves_after, hands.leaving = 0.0, 0
    if not ready:
        draw = PLACES_APART + DRAWS * hands.age[i]
        far = (1.0 - BY_CHANCE) * min(away / FARTHEST, 1.0) + BY_CHANCE * (0.5 + 0.5 * chance(p.seed, draw))
        level = p.player.fretting_noise * amplitude(UNEQUAL * chance(p.seed, draw + 1))
        send_rub(p, i, level, SHORT + (LONG - SHORT) * far, 0.0)


@jit
def lift_finger(p, i):
    """Lets the finger leave string `i`, whose note a hand ends now, after a while."""
    hands = p.hands
    if p.player.fretting_noise <= 0.0 or hands.state[i] == FREE or hands.fret[i] == 0 or (hands.ghosted >> i) & 1:
        return
    draw = PLACES_APART + DRAWS * hands.age[i] + 2
    wait = LEAVES + LEAVES_LATER * (0.5 + 0.5 * chance(p.seed, draw))
    send_rub(p, i, p.player.fretting_noise * amplitude(LEAVING + UNEQUAL * chance(p.seed, draw + 1)), SHORT, wait)
    hands.eased_at, hands.leaves_after = p.out.frame, wait
    hands.leaving |= 1 << i
