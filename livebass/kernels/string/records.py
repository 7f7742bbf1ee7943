"""The kernels' records: a string with its slots and their working sets, its operators, events.

Memory is named, never addressed by arithmetic: `slot.u.eta[m]`, `op.points`, `w.low.leaps[WHOLE].a[j]`. Index j counts
modes, m contact points. All rows of a working set have the same constant length ROW: the compiler knows every distance
and vectorises the loops of modal.py without run-time checks. ROW is an odd number of cache lines, so rows do not
collide in the cache.
"""

from collections.abc import Mapping
from typing import Any

import numpy as np

from livebass.kernels.machine.noise import BAND
from livebass.rows.parts import EXCHANGE_EVERY, TURNED_MODES

ROW = 1048  # the most modes, and the most contact points, of one string
DOUBLE, SINGLE = 8, 4  # bytes
SPACING = DOUBLE * ROW  # bytes from one row of modes to the next
MAX_NEAR = 32  # contact points solved together in one fine step
MAX_PICKUPS = 4  # or sensors, of one string
LINE = 64  # bytes of a cache line
BATCH = 16  # frames filtered together
BLOCK = 16  # modes woken and dropped together
GROUP, GROUP_ROOM = 16, 128  # contact points in a group of a board; maximum number of groups
UNKNOWN = -1  # a step number: never
RING_ON = 1 << 30  # in `idle`: hands that move do not mute these strings
MAX_ANSWERING = 128  # modes of other strings that may answer one string ...
MAX_ANSWERS = 2 * MAX_ANSWERING  # ... and their lines, along both axes
LOW = TURNED_MODES  # float64 modes in qualities that are not exact: whole BLOCKs
NOTHING: Mapping[str, int] = {}
BETWEEN_ROWS = 9 + 9 + 4 + 1  # coefficients of operators.py for u and v, a tap for each pickup or sensor, exchange


def _row(name: str, kind: str = "f8") -> tuple[str, str, tuple[int]]:
    return name, kind, (ROW,)


def _answers(name: str, kind: str = "f8") -> tuple[str, str, tuple[int]]:
    return name, kind, (MAX_ANSWERS,)


def on_lines(fields: list[Any], within: Mapping[str, int] = NOTHING) -> np.dtype[Any]:
    """A record of whole cache lines; fields of a line or more begin on one.

    Access to a vector across two lines takes twice as long. `within`: fields that share memory, with their offsets.
    """
    offsets, end = [], 0
    for field in fields:
        size = np.dtype([field], align=True).itemsize
        begin = within.get(field[0], -(-end // LINE) * LINE if size >= LINE else end)
        offsets.append(begin)
        end = max(end, begin + size)
    return _record(fields, offsets, -(-end // LINE) * LINE)


def _with_spacing(fields: list[Any]) -> np.dtype[Any]:
    """A record of rows, and of records of rows, whose rows begin SPACING apart."""
    offsets, end = [], 0
    for field in fields:
        offsets.append(end)
        end += max(SPACING, np.dtype([field]).itemsize)
    return _record(fields, offsets, end)


def _record(fields: list[Any], offsets: list[int], size: int) -> np.dtype[Any]:
    names, formats = [field[0] for field in fields], [np.dtype([field])[0] for field in fields]
    return np.dtype({"names": names, "formats": formats, "offsets": offsets, "itemsize": size}, align=True)


def _rows_of_modes(kind: str) -> np.dtype[Any]:
    """One polarisation's mode rows that frames and fine steps read and write, in numbers of one kind.

    float32 rows are as far apart as float64 rows, which may share their memory.
    """
    # k fine steps at once, free: q <- a q + b P, P <- a P - g q
    leap = _with_spacing([_row("a", kind), _row("b", kind), _row("g", kind)])
    span = _with_spacing(
        [_row("pull", kind), _row("give", kind)]
    )  # taken from P, in halves, and added to q (quartet.py)
    return _with_spacing(
        [
            _row("q", kind),  # displacement
            _row("p", kind),  # P, momentum scaled to one fine step; d during fine steps (modal.py)
            _row("q_before", kind),  # the state before a trial step
            _row("p_before", kind),
            _row("kept", kind),  # one fine step: d <- kept d - spring q ...
            _row("spring", kind),  # ... and q <- q + d
            ("leaps", leap, (4,)),
            _row("pace", kind),  # 1 / kappa: modal velocity is pace P - sigma q
            _row("kappa", kind),
            _row("tense", kind),  # j^2 kappa, j from 1: what tension takes from P per displacement (tension.py)
            # for many frames at once (runs.py): velocity after a frame, from q and from P ...
            _row("later_q", kind),
            _row("later_p", kind),
            _row("kick", kind),  # ... what tension takes from P in a frame ...
            ("spans", span, (2,)),  # ... in a quartet, and in a long run
            _row("sigma", kind),
        ]
    )


LOW_ROWS, HIGH_ROWS = _rows_of_modes("f8"), _rows_of_modes("f4")
WHOLE, PART, LONGER = 0, 1, 2  # leaps: one frame; part of a frame; one fine step more, if frames are no whole steps
TWO, EIGHT = LONGER, 3  # if they are: two frames; eight
QUARTET = EXCHANGE_EVERY  # frames that a string takes at once; then u and v exchange energy
LONG_RUN = 4 * QUARTET  # frames that a held string takes at once (runs.py)
FOUR, MANY = 0, 1  # `spans` of a quartet and of a long run; leaps[TWO + FOUR] and leaps[TWO + MANY] are half of each

# Newton's method for several contact points at once (contact.py)
SOLVER = np.dtype(
    [
        ("coupling", "f8", (MAX_NEAR, MAX_NEAR)),  # W between the points solved for ...
        ("wanted", "f8", (MAX_NEAR,)),  # ... r* at each ...
        ("old", "f8", (MAX_NEAR,)),  # ... and eta^{n-1}
        ("matrix", "f8", (MAX_NEAR, MAX_NEAR)),
        ("residual", "f8", (MAX_NEAR,)),
        ("slope", "f8", (MAX_NEAR,)),  # df/dr
        ("law", "f8", (MAX_NEAR,)),  # f
        ("r", "f8", (MAX_NEAR,)),  # eta^{n+1} - eta^{n-1}
        ("place", "i8", (MAX_NEAR,)),  # of the solved points, among those near
    ],
    align=True,
)

# The working set of one polarisation: u, away from the neck, or v, across it
WORK = on_lines(
    [
        # modes: those below `split` are in `low`, the others in `high`, which begins with mode `split`
        ("low", LOW_ROWS),
        ("high", HIGH_ROWS),  # in the memory behind the first LOW modes of `low`: it has no modes unless `split` is LOW
        ("split", "i8"),
        ("spanned", "i8"),  # 1: the coefficients for many frames at once belong to the others; 2: the weights, too
        # for a long run (long_run.py), of all modes: velocity now and a frame later, their law, and weights at pickups
        _row("speed", "f4"),
        _row("later", "f4"),
        _row("turn", "f4"),
        _row("fall", "f4"),
        ("weights", "f4", (MAX_PICKUPS, ROW)),
        # the modes' other rows, which events read, in float64. Coefficients: the operator's (operators.py), or tuned
        _row("q"),  # workspace of an event: state (modal.widen) ...
        _row("p"),
        _row("q_before"),  # ... and results
        _row("p_before"),
        _row("kappa"),  # P of a unit modal velocity
        _row("omega"),  # rad/s, damped
        _row("sigma"),  # 1/s
        _row("held"),  # amplitudes of the shape that a finger holds
        _row("strike"),  # velocity per frame of the strike in progress
        _row("finger"),  # factor per frame of the plucking or striking finger
        # contact points: clearances. Clearance is u above the obstacle, m; for u only
        _row("clearance"),  # last known
        _row("clearance_now"),  # at the end of the trial step
        _row("height"),  # of the obstacle: the operator's, or lower while it rises after a stop has moved (stop.py)
        _row("known_at", "i8"),  # fine step of `clearance`
        _row("due", "i8"),  # fine step before which no contact is possible
        ("group_due", "i8", (GROUP_ROOM,)),  # for groups of a board's points: the same ...
        ("group_known_at", "i8", (GROUP_ROOM,)),
        ("group_clearance", "f8", (GROUP_ROOM,)),  # ... lower bound, from the group's highest point
        ("group_clearance_now", "f8", (GROUP_ROOM,)),  # 0: not checked
        # contact points: the forces of eqs. 6, 7 and 12
        _row("eta"),  # penetration at this step, m; of u ...
        _row("eta_before"),  # ... and at the step before
        _row("moved"),  # displacement at this step, m; of v ...
        _row("moved_before"),  # ... and at the step before
        _row("solved_at", "i8"),  # fine step of these four
        _row("free"),  # displacement at the next step, without its force
        _row("wanted"),  # r* of eq. 12
        _row("force"),
        _row("force_before"),
        _row("pending"),  # forces for the next pass over the modes
        _row("next_watch", "i8"),  # fine step of a near point's next watch ...
        _row("last_watched", "i8"),  # ... and of the last one ...
        _row("watched_steps", "i8"),  # ... and number of watched steps in a row
        ("coupling", "f8", (MAX_NEAR, MAX_NEAR)),  # W between contact points over frets
        ("solver", SOLVER),
    ],
    within={"high": DOUBLE * LOW},
)

# Everything that moves the modes of one string at one fret. The rows lie in a pool that all operators share; each is as
# long as the modes or points need (operators.py).
OPERATOR = np.dtype(
    [
        ("coefficients", "i8"),  # address of the coefficients of u's modes, a row each ...
        ("coefficients_v", "i8"),  # ... and of v's: the same, unless v has its own law
        ("taps", "i8"),  # address of the pickups' weights, a row each; without pickups, of q and of P for each phase
        ("shapes", "i8"),  # address of the mode shapes at the contact points, a row each
        ("heights", "i8"),  # address: m, of each contact point
        ("hand_heights", "i8"),  # address: the heights that the hand measures its force by (strokes.py)
        ("positions", "i8"),  # address: m from the stop, of each contact point
        ("coupling", "i8"),  # address of W: m of u at a point per unit f at another; a board has none
        ("left_out", "i8"),  # address of R: the same by the omitted modes, static
        ("draped", "i8"),  # 1 + the last contact point that carries the string at rest (draped.py); 0: none does ...
        ("yields", "i8"),  # ... and the address of its static compliance at the points: m at one per unit f at another
        ("answers", "i8"),  # address of the nut's Re Y and Im Y (m/s/N) from this stop, for each line that may answer
        ("answering", "i8"),  # ... and their number
        ("turning", "i8"),  # address of the rates at which u and v exchange amplitudes (operators.exchange_row) ...
        ("turned", "i8"),  # ... and the number of modes that do, at most LOW; 0: the neck's axes are u and v
        ("axes", "f8", (2,)),  # cosine and sine of the angle from u to the neck's axis a (law.py)
        ("modes", "i8"),
        ("padded", "i8"),  # modes, rounded up to a whole BLOCK
        ("leaps", "i8"),  # number of leaps with coefficients
        ("shared", "i8"),  # 1: its shapes are those of the string before, at the same fret
        ("split", "i8"),  # number of float64 modes in the pool's rows, the others are float32; whole BLOCKs
        ("tap_modes", "i8"),  # rounded up to a whole BLOCK: the taps have no weight above
        ("points", "i8"),  # contact points; more than MAX_NEAR: a board
        ("diagonal", "i8"),  # W couples no points ...
        ("weight", "f8"),  # ... and this is its diagonal
        ("steps", "i8"),  # whole fine steps per frame
        ("parts", "i8"),  # number of parts that a contact frame is cut into (0: none) ...
        ("part_steps", "i8"),  # ... and fine steps per part; a rest remains
        ("fine", "f8"),  # s, the fine step
        ("push", "f8"),  # dt^2 dx / mu: modal step of a unit f
        ("friction", "f8"),  # A of eq. 7, N/m
        ("slip", "f8"),  # m, 2 dt s: a slower point sticks
        ("stiffness", "f8"),  # K
        ("exponent", "f8"),  # alpha
        ("loss", "f8"),  # 1/m, c / (2 dt) of a contact (contact.py)
        ("length", "f8"),  # m
        ("speed", "f8"),  # m/s of transverse waves, 2 L f0
        ("graze", "f8"),  # m, grazing pluck amplitude if there is no obstacle
        ("held_stiffness", "f8"),  # m^2, E I / T in the shape a finger holds; 0: a triangle
    ],
    align=True,
)

# A finger or the palm on a string (touch.py)
TOUCHES = 4  # per string
DASHPOTS = 3  # per touch
TOUCH = np.dtype(
    [
        ("place", "f8"),  # m from the saddle
        ("width", "f8"),  # m, half: standard deviation of its Gaussian pressure
        ("resistance", "f8"),  # N s/m, R now ...
        ("wanted", "f8"),  # ... and its target; 0: it lifts
        ("ramp", "f8"),  # N s/m per frame towards the target
        ("lifts", "i8"),  # frames until it lifts by itself; -1: it stays
    ],
    align=True,
)

# The displacement of the string's end at its stop, along u or v (stop.py)
STOP = np.dtype(
    [
        ("place", "f8"),  # b, m from rest
        ("speed", "f8"),  # b', m/s, through the present frame
        ("away", "f8"),  # b at the start of the path ...
        ("first", "f8"),  # ... and b' ...
        ("wanted", "f8"),  # ... and the finger's speed on arrival; 0: it comes to rest gently
        ("frame", "i8"),  # of the path ...
        ("blend", "i8"),  # ... and its number of frames
    ],
    align=True,
)

# A mass that strikes the string from above: the thumb, or a left-hand finger (thumb.py)
THUMB = np.dtype(
    [
        ("on", "i8"),  # NONE, COMING or THERE
        ("wait", "i8"),  # frames until it comes
        ("frames", "i8"),  # since it came
        ("place", "f8"),  # m from the saddle
        ("mass", "f8"),  # kg
        ("width", "f8"),  # m, half the contact width
        ("stiffness", "f8"),  # N/m^1.5, of its flesh
        ("loss", "f8"),  # s/m, of Hunt and Crossley
        ("speed", "f8"),  # m/s, upwards
        ("height", "f8"),  # m over the string at rest
        ("energy", "f8"),  # J, in its flesh
        # of this frame:
        ("force", "f8"),  # N
        ("depth", "f8"),  # m of the string in its flesh at the start
        ("friction", "f8"),  # N/m, of the loss
        ("foreseen", "f8"),  # m, growth of the depth without frets ...
        ("pushed", "f8"),  # ... and the frets' addition in the last frame
    ],
    align=True,
)
NONE, COMING, THERE = range(3)

# One sounding note of a string
SLOT = on_lines(
    [
        ("on", "i8"),  # 0 silent, 1 sounding
        ("moving", "i8"),  # the stop moves: contact is off
        ("between", "i8"),  # 1: a glide, with string.between, an operator for a length between two frets (glide.py)
        ("sunk", "i8"),  # number of obstacles below their heights
        ("stop_u", STOP),
        ("stop_v", STOP),
        ("offset", "f8"),  # m at the stop, from the new rest line to the old, still fading out ...
        ("offset_speed", "f8"),  # ... and its speed, m/s
        ("fret", "i8"),
        ("active", "i8"),  # modes of u not known to be dead, whole BLOCKs
        ("v_ready", "i8"),  # v's working set is ready ...
        ("v_active", "i8"),  # ... and its number of modes not known to be dead; 0: v rests
        ("fourth", "i8"),  # frames, 0 to 3, since the last quartet, or since the string began to move
        ("owed", "i8"),  # exchanges of u and v that wait because the string presses on something
        ("gentle", "i8"),  # 1: they pass on so little that a long run may come before one (turning.py)
        ("touching", "i8"),  # contacts begun since the pluck
        ("due", "i8"),  # fine step before which no point needs a check
        ("quiet", "i8"),  # fine step before which no contact is possible without an event
        ("doubted", "i8"),  # fine step before which nobody looks far ahead again (looks.py) ...
        ("doubtful", "i8"),  # ... and the point that the last look in doubt could not exclude, checked first
        ("ratio", "f8"),  # frequencies relative to the operators: pitch bend
        ("heard", "i8"),  # modes that the audio rate can carry, rounded up to a whole BLOCK
        ("fastest", "f8"),  # m/s, upper bound for all points of the string
        ("steady", "i8"),  # 1: its motion adds negligible tension
        ("hand", "f8"),  # factor per frame, 1 if no hand is on the string
        ("safety", "f8"),  # `fastest` over the root mean square velocity
        ("thumb", THUMB),
        ("still", "i8"),  # looks in a row that found a draped string at rest (draped.py)
        ("answer_speed", "f8"),  # sum of squared velocity amplitudes that answers could give back, m^3/s^2 ...
        ("answer_sum", "f8"),  # ... and of amplitudes, m^1.5
        ("u", WORK),
        ("v", WORK),
        # workspace of one frame: lists of contact points
        _row("suspects", "i8"),  # that may touch within the frame
        _row("checked", "i8"),  # with known clearance at the end of the frame
        _row("near", "i8"),  # that may touch within a part of the frame
        _row("watched", "i8"),  # in this fine step ...
        _row("friction_points", "i8"),  # ... and in v
        ("coupled", "i8"),  # key of u.coupling: the address of W ...
        ("coupled_ratio", "f8"),  # ... and `ratio`
        _row("rest"),  # u's modal amplitudes at rest if crowns carry the string: draped.py
        # turned axes: recomputed for another operator or tuning
        ("flow", "f8", (6, LOW)),  # of an exchange: what u keeps, v keeps, and passes on, complex (turning.py) ...
        ("long_flow", "f8", (6, LOW)),  # ... the same for a long run ...
        ("flow_scale", "f8", (4, LOW)),  # ... and kappa omega of u and v, and their inverses ...
        ("flow_key", "f8", (4,)),  # ... and its key: operator, its length and fine step, tuning
        # touching fingers: recomputed when their places change
        ("touch_shape", "f8", (TOUCHES, DASHPOTS, ROW)),  # mode shapes at the dashpots of each ...
        ("touch_shape_high", "f4", (TOUCHES, DASHPOTS, ROW)),  # the same for modes in `high` ...
        ("touch_square", "f8", (TOUCHES, DASHPOTS)),  # ... the sums of their squares, 1/m ...
        ("touch_product", "f8", (TOUCHES, DASHPOTS)),  # ... and of products of two of them: 0 1, 0 2, 1 2 ...
        ("touch_products_for", "i8", (TOUCHES,)),  # ... over this many modes ...
        ("touch_modes", "i8", (TOUCHES,)),  # ... and the number of modes that the finger moves
        ("touch_key", "f8", (TOUCHES, 4)),  # key of these: place, width, operator, whether the note has ended
        ("touch_factor", "f8", (TOUCHES, DASHPOTS)),  # c of each dashpot ...
        ("touch_factor_key", "f8", (TOUCHES,)),  # ... and the resistance that is its key; 0: none
        ("touch_kept", "f8"),  # factor per frame for waves wholly on the fingers ...
        ("touch_decay", "f8"),  # ... and minus its logarithm
        # thumb: the same
        _row("thumb_shape"),
        _row("thumb_yield"),  # c: how far each mode yields to a constant force, m^0.5/N ...
        _row("thumb_reach"),  # ... and each contact point, m/N
        _row("thumb_heights"),  # of the contact points, while the thumb presses
        ("thumb_give", "f8"),  # m/N that the string yields within a frame
        ("thumb_modes", "i8"),  # number of modes that it moves
        ("thumb_key", "f8", (4,)),  # key of all these: place, width, operator, tuning
    ]
)
SLOT_STATE = SLOT.fields["u"][1] // 8  # type: ignore[index]  # 8-byte fields of a slot before its working sets

# A hand noise, as speed of the string under the pickups (hands/noise.py)
NOISE = np.dtype(
    [
        ("speed", "f8"),  # m/s, rms, now ...
        ("growth", "f8"),  # ... its growth per frame of a pull ...
        ("fade", "f8"),  # ... and its fading factor per frame
        ("band", BAND),
        ("frames", "i8"),  # number of frames in which it has sounded
    ],
    align=True,
)

# A finger of the fretting hand that rubs along the string as it comes down or leaves (hands/noise.py)
RUB = np.dtype(
    [
        ("level", "f8"),  # m/s, rms, at its loudest ...
        ("speed", "f8"),  # ... and now
        ("wait", "i8"),  # frames until it begins
        ("frames", "i8"),  # that it takes; 0: no finger moves ...
        ("frame", "i8"),  # ... and those that are done
        ("passed", "f8"),  # part of a winding that the finger has passed
        ("band", BAND),
        ("drawn", "i8"),  # number of random numbers so far
    ],
    align=True,
)

VOICE = np.dtype(
    [
        # the bass: set before it plays
        ("over_frets", "i8"),  # address of frets.over_frets
        ("over_board", "i8"),  # of board.over_board, if a string may go over a board
        ("numerator", "i8"),
        ("denominator", "i8"),
        ("rate", "f8"),  # audio, Hz
        ("raw", "i8"),  # 1: the output is the displacement itself, without filters
        ("rounding", "f8"),  # m, of a pluck's corner ...
        ("release", "f8"),  # ... s, how gradually the finger lets go ...
        ("angle", "f8"),  # ... and rad, from u towards v, for plucks without their own values
        ("follow", "f8"),  # 1/s: the finger's speed as it lets go, over the apex
        ("pull", "i8"),  # frames of a pull
        ("strike_width", "f8"),  # m
        ("strike", "i8"),  # frames of the thumb's push
        ("thumb_mass", "f8"),  # kg ...
        ("thumb_width", "f8"),  # ... m ...
        ("thumb_stiffness", "f8"),  # ... N/m^1.5 ...
        ("thumb_loss", "f8"),  # ... and s/m, of a thumb with a mass
        ("saddle", "f8", (4,)),  # m, distance of each pickup or sensor from the saddle
        ("stretch", "f8"),  # N/m, growth of tension with the integral of the squared slope; 0: constant tension
        ("fretless", "i8"),  # 1: slides and vibrato work as on a board
        ("winding", "f8"),  # m, pitch of the winding; 0: flatwound, fingers make no noise on it
        ("squeak", "f8"),  # level of that noise, 1 as usual
        ("wound", "f8"),  # m, pitch of the winding, whatever the squeak's level
        ("seed", "i8"),  # for the hand noises
        ("medium", "f8"),  # m/s, speed of the open string after a medium pluck
        ("lever", "f8"),  # s, displacement at a sensor without pickups over the speed of a wave that passes it
        ("landing_noise", "f8"),  # m/s, rms, of a hand that ends a note; 0: none
        ("release_spread", "f8"),  # how much ends of notes differ, 0: not at all
        ("pickups", "i8"),  # 0: the displacement itself
        ("across", "f8", (4,)),  # each pickup's sensitivity to v, relative to u
        ("aperture", "f8", (4,)),  # m of string that each senses
        ("decay", "f8", (4,)),  # 1/m of each pickup
        ("level", "f8", (4,)),  # level of each pickup in the signal, the bass's own
        ("tones", "i8"),  # address of the filters for all positions of the tone pot (tone.py); 0: only one filter
        ("block", "f8"),  # the DC blocker's pole
        ("gain_pole", "f8"),
        ("log", "i8"),  # address of a ring of CONTACT, one per new contact ...
        ("log_room", "i8"),  # ... and its size, 0: none are kept
        ("reports", "i8"),  # address of a REPORTS and a ring of EVENT (reports.py) ...
        ("report_room", "i8"),  # ... and its size in events, 0: none are kept
        # what the pots make of it, and what has been reported
        ("mix", "f8", (4,)),  # level of each pickup now
        ("b", "f8", (4,)),  # output filter
        ("a", "f8", (4,)),
        ("logged", "i8"),  # contacts so far: the last is at (logged - 1) % log_room
        ("report_count", "i8"),  # events since the string was still
        # the state: another version of the bass takes it over (live/thread/carry.py)
        ("frame", "i8"),
        ("step", "i8"),  # fine steps since the start: ceil(frame * numerator / denominator)
        ("left", "i8"),  # frames that are left of a run, whose motion is done (runs.py) ...
        ("length", "i8"),  # ... of this many frames, QUARTET or LONG_RUN ...
        ("run", "f8", (8, LONG_RUN)),  # ... and displacement and velocity at each pickup in all its frames
        ("slot", "i8"),  # the playing slot
        ("pulling", "i8"),  # frames left until the finger lets go
        ("pulse", "f8"),  # `safety` for the next pluck
        ("striking", "i8"),  # frames left of the thumb's push
        ("fingering", "i8"),  # frames left of the finger damping
        ("touches", TOUCH, (TOUCHES,)),
        ("bend", "f8"),  # frequency ratio wanted ...
        ("tuned", "f8"),  # ... and reached so far
        ("turn", "i8"),  # frames, this string's phase in the cycle in which strings follow a bend
        ("depth", "f8"),  # semitones, of the vibrato, ...
        ("depth_wanted", "f8"),  # ... its target, ...
        ("waver", "f8"),  # ... its rate, Hz, ...
        ("phase", "f8"),  # ... and its phase, 0 to 1
        ("landing", "i8"),  # frames until a landing finger ...
        ("hammer_to", "i8"),  # ... presses the string down to this fret ...
        ("hammer", "f8"),  # ... at this speed, m/s; 0 frames: none lands
        ("slide_to", "i8"),  # target fret of a slide; -1: none
        ("slide_every", "i8"),  # frames per fret ...
        ("slide_left", "i8"),  # ... and frames left until the next fret, or the next hand-over of a glide
        ("lift_damping", "f8"),  # 1/s, by the hand after a slide that lifts the finger; 0: the finger stays ...
        ("lifting", "f8"),  # ... and the growth of its damping per frame, nepers
        ("glide_from", "f8"),  # m, length at the start of a glide ...
        ("glide_to", "f8"),  # ... and at its end, ...
        ("glide_frames", "i8"),  # ... its frames ...
        ("glide_frame", "i8"),  # ... and the frames done
        ("scraped", "f8"),  # windings that the finger has passed since it last fell off one
        ("skin", NOISE),
        ("click", NOISE),  # of a pick; `growth`: its second click, until it lets go
        ("knock", NOISE),
        ("endings", "i8"),  # number of notes that a hand has ended
        ("rub", RUB),
        ("wait", "i8"),  # frames that the last stroke's finger or thumb waits on the string ...
        ("waiting", "i8"),  # ... and those that are left
        ("ends_in", "i8"),  # frames until a note that was released while its stroke waited ends; 0: none does ...
        ("ends_by", "f8"),  # ... and its hand's damping
        ("idle", "i8"),  # strings neither played nor muted, a bit each: they may answer (answers.py); and RING_ON
        ("answered_fret", "i8"),  # of the last note that they answered ...
        ("hands_until", "i8"),  # ... and the frame until which hands that moved to another mute them
        ("answering", "i8"),  # number of modes that answer
        ("cut", "i8"),  # 1: all sound is off until the next note, including answers
        ("weakened", "i8"),  # number of times the motion was scaled back to a string's limit (slot.limit_motion)
        ("held", "f8", (4,)),  # displacement of the held shape at each pickup
        ("held_across", "f8", (4,)),  # the same for v
        ("blend_wanted", "f8"),  # -1, the neck pickup alone, to 1, the bridge pickup; 0: the bass's own ...
        ("blend", "f8"),  # ... and the blend that `mix` has reached
        ("woken", "i8"),  # frame of the first event since the string was still
        ("begun", "i8"),  # frame of the first note since neither slot sounded: exchanges count from it
        ("still", "i8"),  # 1: at rest; every frame gives the same sample until the next event
        ("tone_wanted", "f8"),  # -1 to 1 ...
        ("tone", "f8"),  # ... and the tone that the filter has reached
        ("z", "f8", (4,)),
        ("block_in", "f8"),  # memory of the DC blocker
        ("block_out", "f8"),
        ("gain", "f8"),
        ("gain_wanted", "f8"),
    ],
    align=True,
)
VOICE_STATE = VOICE.fields["frame"][1] // 8  # type: ignore[index]  # 8-byte fields of a voice before its state
VOICE_SLOTS = 2

# The start of a contact
CONTACT = np.dtype(
    [
        ("step", "i8"),  # fine step of the string
        ("point", "i8"),  # contact point of the operator: operators.place_of
        ("fret", "i8"),  # that is pressed
        ("speed", "f8"),  # m/s, of impact
    ],
    align=True,
)

MAX_LINKS = 64  # pairs of idle strings' lines that pass answers on

# The lines of other strings that may answer one string, string after string (answers.py)
ANSWERS = np.dtype(
    [
        ("count", "i8"),
        # those that sound, voice.answering of them, in the order in which they began; zeros above
        _answers("q", "f4"),  # m^1.5: displacement ...
        _answers("y", "f4"),  # ... and (velocity + sigma q) / omega
        _answers("line", "i8"),  # which line each is
        # workspace: recomputed when another begins or the hands change
        _answers("heard_q", "f4"),  # of_q and of_y of each ...
        _answers("heard_y", "f4"),
        _answers("now_cosine", "f4"),  # ... and one frame, damped by the hands
        _answers("now_sine", "f4"),
        ("damped_for", "i8"),  # key of these two
        # all lines
        _answers("place", "i8"),  # in the rows above; UNKNOWN: silent
        ("own_density", "f8"),  # kg/m, of the sounding string
        _answers("string", "i8"),
        _answers("across", "i8"),  # 0: along axis a of the neck, 1: along b
        _answers("omega"),  # rad/s; 0: no such mode
        _answers("sigma"),  # 1/s
        _answers("density"),  # kg/m
        _answers("stiffness"),  # N/m, tension over length
        _answers("of_q", "f4"),  # weights in the signal before the filters
        _answers("of_y", "f4"),
        _answers("cosine"),  # one frame: q <- cosine q + sine y, y <- cosine y - sine q
        _answers("sine"),
        _answers("muted"),  # factor per frame of the hands on an idle string ...
        _answers("rested"),  # ... and of those on one that answers
        # lines of idle strings that pass answers on to each other, and one exchange of each, as below
        ("links", "i8"),
        ("link_ends", "i8", (MAX_LINKS, 2)),
        ("link_flow", "f8", (MAX_LINKS, 6)),
        # workspace: recomputed when the hands or the sounding fret change
        ("pairs", "i8"),
        ("pairs_for", "i8", (2,)),  # key of these: operator, idle strings ...
        ("pairs_ratio", "f8"),  # ... and bend
        _answers("pair_answer", "i8"),
        _answers("pair_mode", "i8"),
        _answers("pair_real"),  # G, 1/s
        _answers("pair_imaginary"),
        _answers("pair_effect"),  # |G| over the difference of the lines
        _answers("pair_share"),  # of the losses of both that Re G needs ...
        _answers("pair_allowed"),  # ... and factor by which Re G keeps within them
        # one exchange of a pair: cosh, sinh times r, sinh over r, complex; the scale of P and its inverse, for u and
        # for v; how much u and v move along the axis, and how much v moves with it
        ("flow", "f8", (MAX_ANSWERS, 13)),
    ],
    align=True,
)

# An operator for a length between two frets, made while a finger glides along a board (glide.py): `leaps` is 1
BETWEEN = on_lines(
    [
        ("op", OPERATOR),
        _row("slope"),  # modes' weights in the slope at the stop, as a fingertip feels it ...
        ("slope_modes", "i8"),  # ... and the number of modes with any
        ("rows", "f8", (BETWEEN_ROWS * ROW,)),  # coefficients and taps of the operator
    ]
)

# One string with everything that its kernels touch
STRING = on_lines(
    [
        ("voice", VOICE),
        ("between", "i8"),  # address: BETWEEN (VOICE_SLOTS,), of each slot; 0: no finger glides on this string
        ("slots", SLOT, (VOICE_SLOTS,)),
        ("answers", ANSWERS),
        ("taps", "f8", (8,)),  # workspace: displacement and velocity at each pickup
        ("batch", "f8", (8, BATCH)),  # the same for frames that wait for the filters ...
        ("answer", "f8", (BATCH,)),  # ... the answering strings' signal ...
        ("flux", "f8", (BATCH,)),  # ... gradient of a pickup's flux, relative to rest ...
        ("mixed", "f8", (BATCH,)),  # ... and the signal before the filters
    ]
)

EVENT = np.dtype(
    [
        ("frame", "i8"),
        ("kind", "i4"),
        ("string", "i4"),
        ("fret", "i8"),
        ("finger", "i8"),  # of a touch: which finger lies on the string or lifts
        # Numbers of its kind; all others are 0
        ("apex", "f8"),  # m, of a pluck; of a pull-off, across the neck; of a strike, the depth of its push
        ("place", "f8"),  # m from the stop; of a touch, from the saddle
        ("speed", "f8"),  # m/s, of a thrown mass, of a hammering finger, and of a pluck's noise
        ("width", "f8"),  # m, half the contact width; 0: the player's finger or thumb
        ("angle", "f8"),  # rad, of a pluck, from u towards v; 0: the player's
        # How gradually a pluck lets go, 0: the player's value; time until a touch lifts, 0: it stays; time for which a
        # hammering finger first damps the string; time per fret of a slide, or of a whole timed slide; of a rub
        ("seconds", "f8"),
        ("mass", "f8"),  # kg, thrown, and ...
        ("stiffness", "f8"),  # ... N/m^1.5, of its flesh; 0: the thumb's
        ("resistance", "f8"),  # N s/m, of a touch
        # The single number of other kinds. BEND: frequency ratio; HAND: damping, 1/s; WAVER: semitones; IDLE: strings
        # that may answer, a bit each; GAIN, TONE, BLEND: that value; TIMED_GLIDE: as HAND if the finger lifts, else 0.
        # Of a pluck: m/s, the noise of a pick. RUBBING: level, 1 is as recorded, 0: the finger stays
        ("value", "f8"),
        ("rate", "f8"),  # Hz, of a vibrato
        ("wait", "f8"),  # s, for which a stroke's finger or thumb waits on the string, or until a finger rubs
    ],
    align=True,
)
(
    PLUCK, STRIKE_EVENT, HAND, BEND, GAIN, CUT, TONE, TOUCH_EVENT, HAMMER, PULL_OFF, GLIDE, WAVER, THROW, BLEND,
    IDLE, TIMED_GLIDE, RUBBING,
) = range(1, 18)  # fmt: skip
