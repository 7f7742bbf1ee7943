"""Where things lie in memory: rows of the working set of a sounding string, rows of its operators, records.

All rows of a working set have the same constant length `ROW`, so that the compiler knows every distance and
vectorises the loops of `rows.py` without checks. ROW is an odd number of cache lines: rows do not collide in
the cache.
"""

import numpy as np

ROW = 1048  # float64; the most modes, and the most contact points, of one string
NEAR = 4  # contact rows the innermost loop takes at once
MOST_NEAR = 32  # contact points solved together in one fine step
BLOCK = 16  # modes are woken and dropped in blocks

# Working set: state, coefficients of the tuned string, contact points, scratch
Q, P = 0, 1  # modal displacement; modal momentum scaled to one fine step (rows.py)
Q_OLD, P_OLD = 2, 3  # the state before a trial step
FINE_A, FINE_B = 4, 5
FRAME = 6  # three rows A, B, G: one audio frame
FRAME_1 = 9  # one fine step more, where frames are not whole numbers of steps
SUB = 12  # a part of a frame
KAPPA = 15  # P of a unit modal velocity
OMEGA, SIGMA = 16, 17  # rad/s (damped), 1/s
PACE = 18  # 1 / KAPPA: modal velocity is PACE P - SIGMA q
SHAPE = 19  # modal amplitudes of the pluck in preparation
STRIKE = 20  # modal velocity per frame of the strike in progress
FINGER = 21  # factor per frame of the finger that touches
CLEARANCE, CLEARANCE_NOW = 22, 23  # m: last known, and the one just computed
KNOWN, DUE = 24, 25  # fine step at which CLEARANCE was true; before which no contact is possible
ETA, ETA_OLD = 26, 27  # m: penetration at this step, at the one before
STAMP = 28  # fine step for which ETA, ETA_OLD hold
FORCE, FORCE_OLD, PENDING = 29, 30, 31
NEAR_PHI = 32  # MOST_NEAR rows: shapes at the points solved now
COUPLING = NEAR_PHI + MOST_NEAR  # W between them, in rows of MOST_NEAR
SOLVE = COUPLING + 1  # two rows: workspace of contact.py
NEXT = SOLVE + 2  # fine step at which a point of a board is looked at again; at which it was last; how often in a row
LOOKED, STREAK = NEXT + 1, NEXT + 2
GROUPS = NEXT + 3  # of points of a board: four parts of GROUP_ROOM (board.py)
WORK_ROWS = GROUPS + 1
WHOLE, LONGER, PART = 0, 1, 2  # the leaps of a slot: one frame; one fine step more; a part of a frame
LEAP = np.dtype([(name, "f8", (ROW,)) for name in "abg"])


def _row(name):
    return (name, "f8", (ROW,))


WORK = np.dtype(
    [
        _row("q"),
        _row("p"),
        _row("q_before"),
        _row("p_before"),
        _row("fine_a"),
        _row("fine_b"),
        ("leaps", LEAP, (3,)),
        _row("kappa"),
        _row("omega"),
        _row("sigma"),
        _row("pace"),
        _row("held"),
        _row("strike"),
        _row("finger"),
        _row("clearance"),
        _row("clearance_now"),
        _row("known_at"),
        _row("due"),
        _row("eta"),
        _row("eta_before"),
        _row("solved_at"),
        _row("force"),
        _row("force_before"),
        _row("pending"),
        ("near_shape", "f8", (MOST_NEAR, ROW)),
        _row("coupling"),
        ("solver", "f8", (2 * ROW,)),
        _row("next_look"),
        _row("last_look"),
        _row("streak"),
        ("group_due", "f8", (128,)),
        ("group_known_at", "f8", (128,)),
        ("group_clear", "f8", (128,)),
        ("group_clear_now", "f8", (128,)),
        ("_rest", "f8", (ROW - 512,)),
    ]
)
GROUP, GROUP_ROOM = 16, 128  # points

# Operators of one string at one fret, in a pool shared by all: the first rows go to the working set at a pluck
OP_COPIED = 15  # rows FINE_A .. PACE, in that order
OP_HEIGHT, OP_POSITION = 15, 16  # per contact point
OP_TAP = 17  # a row a pickup; or without one, two rows: weights of Q and of P, for each phase

OPERATOR = np.dtype(
    [
        ("start", "i8"),  # offset in the pool
        ("phi", "i8"),  # row of the shapes at the contact points; a ROW each, for a board `padded` numbers each
        ("coupling", "i8"),  # row of W, m of u at a point per unit f, a row a point; MOST_NEAR further R, the same
        # for the modes left out
        ("modes", "i8"),
        ("padded", "i8"),  # modes, up to a whole BLOCK
        ("tap_modes", "i8"),  # up to a whole BLOCK: the taps have no weight above
        ("points", "i8"),
        ("diagonal", "i8"),  # W couples no points ...
        ("weight", "f8"),  # ... and this is its diagonal, where there are more than MOST_NEAR: a board
        ("steps", "i8"),  # whole fine steps a frame
        ("parts", "i8"),  # a contact frame is cut in so many parts (0: in none) ...
        ("part_steps", "i8"),  # ... of so many fine steps, and a rest
        ("fine", "f8"),  # s, the fine step
        ("push", "f8"),  # dt^2 dx / mu: modal step of a unit f
        ("friction", "f8"),  # A of eq. 7, N/m
        ("slip", "f8"),  # m, 2 dt s: slower than that a point sticks
        ("stiffness", "f8"),  # K
        ("exponent", "f8"),  # alpha
        ("length", "f8"),  # m
        ("speed", "f8"),  # m/s of transverse waves, 2 L f0
        ("graze", "f8"),  # m, a pluck amplitude to use where there is no obstacle
    ],
    align=True,
)

SLOT = np.dtype(
    [
        ("on", "i8"),  # 0 silent, 1 sounding
        ("fading", "i8"),  # the string left this note: linear, quickly damped
        ("fret", "i8"),
        ("active", "i8"),  # modes not known to be dead, whole BLOCKs
        ("across", "i8"),  # v, the second polarisation, has its working set ready ...
        ("swaying", "i8"),  # ... and so many modes of it are not known to be dead; 0: v rests
        ("touching", "i8"),  # contacts begun since the pluck
        ("due", "i8"),  # fine step before which no point needs a look
        ("quiet", "i8"),  # no contact possible before the next event
        ("ratio", "f8"),  # frequencies relative to the operators: pitch bend
        ("heard", "i8"),  # modes that the audio rate can carry, up to a whole BLOCK
        ("fastest", "f8"),  # m/s no point of the string exceeds
        ("hand", "f8"),  # factor per frame, 1 where no hand is on the string
        ("safety", "f8"),  # `fastest` over the root mean square velocity
    ],
    align=True,
)

VOICE = np.dtype(
    [
        ("over_frets", "i8"),  # address of frets.player
        ("over_board", "i8"),  # of board.player, where a string may go over a board
        ("frame", "i8"),
        ("step", "i8"),  # fine steps since the start: ceil(frame * numerator / denominator)
        ("numerator", "i8"),
        ("denominator", "i8"),
        ("rate", "f8"),  # audio, Hz
        ("slot", "i8"),  # the one that plays
        ("pulling", "i8"),  # frames left until the finger lets go
        ("pull", "i8"),  # frames of a pull
        ("striking", "i8"),  # frames left of the thumb's push
        ("strike", "i8"),
        ("fingering", "i8"),  # frames left of the finger damping
        ("bend", "f8"),  # frequency ratio wanted ...
        ("tuned", "f8"),  # ... and the one it has got to
        ("turn", "i8"),  # frames by which this string follows a bend before the others
        ("logged", "i8"),  # contacts begun, also beyond the log's length
        ("pickups", "i8"),  # 0: the displacement itself
        ("held", "f8", (4,)),  # displacement at each of the shape the finger holds
        ("held_across", "f8", (4,)),  # the same of v
        ("across", "f8", (4,)),  # how strongly each senses v, of u
        ("decay", "f8", (4,)),  # 1/m of each pickup
        ("mix", "f8", (4,)),
        ("b", "f8", (4,)),  # output filter
        ("a", "f8", (4,)),
        ("z", "f8", (4,)),
        ("block", "f8"),  # DC blocker: pole ...
        ("block_in", "f8"),  # ... and memory
        ("block_out", "f8"),
        ("gain", "f8"),
        ("gain_wanted", "f8"),
        ("gain_pole", "f8"),
    ],
    align=True,
)
VOICE_SLOTS = 2
POLARISATIONS = 2  # the working set of slot k is k for u, VOICE_SLOTS + k for v

EVENT = np.dtype(
    [("frame", "i8"), ("kind", "i4"), ("string", "i4"), ("fret", "i4"), ("x", "f8"), ("y", "f8")],
    align=True,
)
PLUCK, STRIKE_EVENT, HAND, BEND, GAIN, CUT = 1, 2, 3, 4, 5, 6

STRING = np.dtype(
    [
        ("voice", VOICE),
        ("slots", SLOT, (VOICE_SLOTS,)),
        ("work", WORK, (POLARISATIONS * VOICE_SLOTS,)),  # of slot k: k for u, VOICE_SLOTS + k for v
        ("scratch", "i8", (4, ROW)),  # indices of contact points
        ("taps", "f8", (8,)),  # what is sensed at a frame
    ],
    align=True,
)
