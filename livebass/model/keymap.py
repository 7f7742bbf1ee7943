"""What MIDI keys and controllers do besides playing notes: the key maps of MODO BASS, and the curves of velocity.

A bass carries its map, `Player.keys`, so that files, live playing, plugins and the page follow the same one. Maps of
one's own come from TOML files (preset/keymap.py).
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

# Techniques that keys switch, in the order of the performer's numbers: name, and how one asks for it
SWITCHES = {
    "string": "hold: notes are played on this string",
    "ghost": "hold: ghost notes",
    "legato": "hold: overlapping notes are hammered on and pulled off",
    "harmonic": "hold: harmonics",
    "tap": "hold: notes are tapped",
    "palm_mute": "hold: palm mute",
    "slide": "hold: overlapping notes slide",
    "vibrato": "hold: vibrato",
    "finger": "press: fingers from now on",
    "pick": "press: a pick from now on",
    "slap": "press: thumb and pops from now on",
    "stop_all": "press: all strings are damped",
    "down_stroke": "hold: every stroke goes down, or is the index finger's",
    "up_stroke": "hold: every stroke goes up, or is the middle finger's",
    "hand": "press: the left hand goes to a fret",
    "detach": "hold: a key let go stops its string, without pull-off or let ring",
    "left_slap": "hold: the left hand slaps the strings, a clack without pitch",
}
# Functions of controllers, likewise; those from "gain" on are the parameters of hosts
FUNCTIONS = {
    "place": "where the string is plucked, from the neck (0) to the bridge (127)",
    "volume": "volume",
    "expression": "expression, as volume",
    "let_ring": "from 64 on: notes ring on after they are let go",
    "vibrato": "vibrato",
    "palm_mute": "palm mute, from none (0) over loose (1) to tight (127)",
    "slide": "from 64 on: overlapping notes slide",
    "legato": "from 64 on: overlapping notes are hammered on and pulled off",
    "bend": "bend upwards, up to 2 semitones, once it has been below 3",
    "hand": "where the left hand is, from the first fret (0) to the last ones (127)",
    "blend": "pickups, from the one at the neck alone (0) to the one at the bridge alone (127)",
    "gain": "gain, from silence to 0 dB",
    "tone": "tone pot, from closed (0) to open (127)",
    "pluck_position": "place of the pluck, from nearest to the bridge (0) to farthest from it (127)",
    "dynamics": "force of every note, -12 to 12 dB",
    "technique": "in four parts: as the bass has it, plucked, thumb on two strings, thumb on all",
    "hand_damping": "hand that stops a note, from a tenth to ten times as firm",
    "unevenness": "unevenness from note to note, from less to more",
    "bend_range": "range of the pitch bend, 0 (as the bass has it) to 24 semitones",
}
PARAMETERS = tuple(FUNCTIONS)[tuple(FUNCTIONS).index("gain") :]  # in the order of their numbers
LEARNED = 102  # the controller that is gain's in every map that gives it no other function; the next ones follow
RESERVED = (6, 38, *range(96, 102))  # controllers that MIDI has for ranges (RPN)
CONTROLLERS = 120  # those beyond are channel modes
KEYS = 128
CURVES = {"linear": 1.0, "soft": 0.6, "hard": 1.6}  # exponents
Curve = str | float | tuple[tuple[float, float], ...]  # a name, an exponent, or points: velocity played, velocity meant


@dataclass(frozen=True)
class KeyMap:
    """What keys and controllers do."""

    name: str
    keys: tuple[tuple[int, str, int], ...]  # key, a name of SWITCHES, and its value: a pitch class, or a fret
    controllers: tuple[tuple[int, str], ...]  # controller, and a name of FUNCTIONS
    over_notes: bool = False  # keys switch although the bass has their notes


CONTROLLERS_OF_MODO = (
    (1, "vibrato"), (3, "place"), (4, "hand"), (5, "bend"), (7, "volume"), (9, "palm_mute"), (11, "expression"),
    (17, "tone"), (18, "blend"), (64, "let_ring"), (65, "slide"), (68, "legato"),
)  # fmt: skip
MODO = KeyMap(
    "modo",
    (
        (0, "string", 0), (2, "tap", 0), (3, "palm_mute", 0), (4, "slide", 0), (6, "vibrato", 0), (7, "left_slap", 0),
        (8, "stop_all", 0),
        (9, "string", 9), (10, "ghost", 0), (11, "string", 11), (12, "legato", 0), (13, "finger", 0),
        (14, "string", 2), (15, "pick", 0), (16, "string", 4), (17, "harmonic", 0), (18, "slap", 0), (19, "string", 7),
    ),
    CONTROLLERS_OF_MODO,
)  # fmt: skip
# An octave higher, with stroke keys where palm mute would be, and the fret of the hand
MODO_12 = KeyMap(
    "modo-12",
    (
        (12, "string", 0), (13, "down_stroke", 0), (14, "tap", 0), (15, "up_stroke", 0), (16, "slide", 0),
        (17, "palm_mute", 0), (18, "vibrato", 0), (19, "left_slap", 0), (20, "stop_all", 0),
        (21, "string", 9), (22, "ghost", 0),
        (23, "string", 11), (24, "legato", 0), (25, "finger", 0), (26, "string", 2), (27, "pick", 0),
        (28, "string", 4), (29, "harmonic", 0), (30, "slap", 0), (31, "string", 7),
        (32, "detach", 0),
        *((88 + fret, "hand", fret) for fret in range(1, 25)),
    ),
    CONTROLLERS_OF_MODO,
    over_notes=True,
)  # fmt: skip
MAPS = {keys.name: keys for keys in (MODO, MODO_12)}


def velocity_parts(curve: Curve) -> list[float]:
    """How hard each velocity, 0 to 127, is played: the part of the way from the softest note (0) to the hardest (1).

    Between points, and from velocity 1 and up to 127, goes a straight line.
    """
    if isinstance(curve, tuple):
        points = [(1.0, curve[0][1]), *curve, (127.0, curve[-1][1])]
        return [_between(points, velocity) for velocity in range(KEYS)]
    exponent = CURVES[curve] if isinstance(curve, str) else curve
    parts = [max(velocity - 1, 0) / 126.0 for velocity in range(KEYS)]
    return parts if exponent == 1.0 else [part**exponent for part in parts]


def _between(points: list[tuple[float, float]], velocity: int) -> float:
    """The part for `velocity` on the line through `points`."""
    (x, y), (x_next, y_next) = next((a, b) for a, b in pairwise(points) if velocity <= b[0] or b is points[-1])
    where = (velocity - x) / (x_next - x) if x_next > x else 1.0
    return min(max((y + max(where, 0.0) * (y_next - y) - 1) / 126.0, 0.0), 1.0)
