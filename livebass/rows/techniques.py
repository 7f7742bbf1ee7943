"""The player's choices, a row each: techniques that keys switch, functions of controllers, parameters of hosts.

A row is a statement: it returns the number that the kernels read, and adds its description to a table. Key maps and
their files, `play --controllers`, the tables of README and handbook, number keys, page, OSC and plugins follow from
these tables. A symbol in two tables has one effect: vibrato, for example, by a key or a controller.

Numbers count rows and stand in instrument files, and in projects and automation of hosts: add a new technique or
parameter last of its kind. A new function moves CC_PARAMETER: instrument files get another version.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

# --- techniques, by key switches of the bass's key map ---

HOLD, PRESS = "hold", "press"  # while the key is down; from the press until another key ends it
FRETS = 24  # with keys that call the left hand
TOP_KEYS = 113  # from here on up no bass has notes: its keys switch in any tuning


@dataclass(frozen=True)
class Technique:
    """A technique of a key."""

    number: int
    symbol: str  # in files
    name: str  # in hosts, on the page, in a terminal; {} is its value: a string's open note, a fret
    trigger: str  # HOLD or PRESS
    modo: tuple[int, ...]  # its keys in the map of MODO BASS ...
    modo_12: tuple[int, ...]  # ... and in modo-12
    help: str


TECHNIQUE_ROWS: dict[str, Technique] = {}
NO_SWITCH = 0


def technique(symbol: str, name: str, trigger: str, modo: tuple[int, ...], modo_12: tuple[int, ...], does: str) -> int:
    """Adds a row to TECHNIQUE_ROWS; returns its number."""
    number = NO_SWITCH + 1 + len(TECHNIQUE_ROWS)
    TECHNIQUE_ROWS[symbol] = Technique(number, symbol, name, trigger, modo, modo_12, does)
    return number


ON_STRING = technique(  # its value is the pitch class of the open string and of the key
    "string", "String {}", HOLD, (0, 9, 11, 14, 16, 19), (12, 21, 23, 26, 28, 31), "play on this string"
)
GHOST = technique("ghost", "Ghost notes", HOLD, (10,), (22,), "ghost notes, muted by the left hand")
LEGATO = technique("legato", "Hammer-on", HOLD, (12,), (24,), "hammer on and pull off overlapping notes")
HARMONIC = technique(
    "harmonic", "Harmonics", HOLD, (17,), (29,),
    "harmonics, natural if an open string has the note, else an octave higher",
)  # fmt: skip
TAP = technique("tap", "Tapping", HOLD, (2,), (14,), "tapping: notes are hammered on, even from silence")
PALM = technique("palm_mute", "Palm mute", HOLD, (3,), (17,), "palm mute")
SLIDE = technique("slide", "Slide", HOLD, (4,), (16,), "slide between overlapping notes")
VIBRATO = technique("vibrato", "Vibrato", HOLD, (6,), (18,), "vibrato")
WITH_FINGERS = technique("finger", "Fingers", PRESS, (13,), (25,), "play with fingers")
WITH_PICK = technique("pick", "Pick", PRESS, (15,), (27,), "play with a pick")
WITH_THUMB = technique("slap", "Thumb", PRESS, (18,), (30,), "play with thumb and pops")
STOP_ALL = technique("stop_all", "Stop all strings", PRESS, (8,), (20,), "damp all strings")
DOWN_STROKE = technique("down_stroke", "Down stroke", HOLD, (1,), (13,), "only down strokes, or only the index finger")
UP_STROKE = technique("up_stroke", "Up stroke", HOLD, (5,), (15,), "only up strokes, or only the middle finger")
HAND_AT = technique(  # its value is the fret, fret 1 for the first key
    "hand", "Hand at fret {}", PRESS, (), tuple(range(89, 89 + FRETS)), "move the left hand to a fret"
)
DETACH = technique(
    "detach", "Stop on release", HOLD, (), (32,), "a released key stops its string, without pull-off or let ring"
)
LEFT_SLAP = technique(
    "left_slap", "Left-hand slap", HOLD, (7,), (19,), "slap the strings with the left hand, a clack without pitch"
)
THUMB_ON_ALL_STRINGS = technique("thumb_on_all", "Thumb on all", PRESS, (20, 113), (113,), "thumb on all strings")
POPS_ON_ALL = technique("pop_on_all", "Pops on all", PRESS, (21, 114), (114,), "pops on all strings")
ARTIFICIAL = technique(  # partial 2 of the fretted string; the next two rows are partials 3 and 4
    "artificial", "Artificial harmonics", HOLD, (22, 115), (115,), "artificial harmonics, an octave above the fret"
)
technique("artificial_12th", "Artificial 12ths", HOLD, (116,), (116,), "artificial harmonics, a twelfth above the fret")
technique(
    "artificial_15th", "Artificial 15ths", HOLD, (117,), (117,), "artificial harmonics, two octaves above the fret"
)
ARTIFICIALS = 3
PINCH = technique(
    "pinch", "Pinch harmonics", HOLD, (118,), (118,), "pinch harmonics, partial 3 to 8 by the plucking place"
)
SLIDE_OFF_DOWN = technique(
    "slide_off_down", "Slide off down", HOLD, (119,), (119,), "a released note slides down five frets and fades"
)
SLIDE_OFF_UP = technique(
    "slide_off_up", "Slide off up", HOLD, (120,), (120,), "a released note slides up five frets and fades"
)
LET_RING = technique("let_ring", "Let ring", HOLD, (), (), "released notes ring on")
ACTIONS = NO_SWITCH + 1 + len(TECHNIQUE_ROWS)

# --- functions of controllers ---

CHANNEL_MODES = 120  # from here on no controllers
RPN = (6, 38, 98, 99, 100, 101)  # controllers by which MIDI sets ranges ...
RESERVED = (*RPN, 96, 97)  # ... and steps them: they come in sequences
LEARNED = 102  # controller of parameter 0, unless a map gives it another function; the next ones follow


@dataclass(frozen=True)
class Function:
    """A controller's function."""

    number: int
    symbol: str  # in files
    controllers: tuple[int, ...]  # its controllers in the shipped maps
    help: str
    field: str = ""  # of the performer, not 0 while it is on
    pressed: int = 127  # the value that a button sends


FUNCTION_ROWS: dict[str, Function] = {}
NO_FUNCTION = 0


def function(symbol: str, controllers: tuple[int, ...], does: str, field: str = "", pressed: int = 127) -> int:
    """Adds a row to FUNCTION_ROWS; returns its number."""
    number = NO_FUNCTION + 1 + len(FUNCTION_ROWS)
    FUNCTION_ROWS[symbol] = Function(number, symbol, controllers, does, field, pressed)
    return number


CC_PLACE = function("place", (3,), "plucking place, from the neck (0) to the bridge (127)")
CC_VOLUME = function("volume", (7,), "volume")
CC_EXPRESSION = function("expression", (11,), "expression, a second volume")
CC_LET_RING = function(
    "let_ring", (64,),
    "from 64: released notes ring on; with player.answering idle strings ring along", "pedal",
)  # fmt: skip
CC_VIBRATO = function("vibrato", (1,), "vibrato", "vibrato")
CC_PALM = function("palm_mute", (9,), "palm mute, from none (0) over loose (1) to tight (127)", "palm", pressed=76)
CC_SLIDE = function("slide", (65,), "from 64: overlapping notes slide", "sliding")
CC_LEGATO = function("legato", (68,), "from 64: overlapping notes are hammered on and pulled off", "legato")
BEND_STARTS = 3  # bends only after a lower value: a file that uses it as portamento time does not bend
CC_BEND = function("bend", (5,), f"bend up, by up to 2 semitones, after it has been below {BEND_STARTS}")
CC_HAND = function("hand", (4,), "place of the left hand, from the first fret (0) to the last frets (127)")
CC_BLEND = function(
    "blend", (18,), "pickup blend, from neck only (0) to bridge only (127); 64 is the bass's own", "blend"
)
SLIDE_STEP = 0.025  # s
CC_SLIDE_TIME = function(
    "slide_time", (19,), f"time of each slide, in steps of {1e3 * SLIDE_STEP:g} ms; 0, or too little: 22 ms a fret"
)
CC_PARAMETER = NO_FUNCTION + 1 + len(FUNCTION_ROWS)  # from here on: the playing parameters

# Symbols of the functions that act on their controller's channel only. A button for the whole bass sends them on every
# channel.
OF_CHANNEL = ("volume", "expression", "let_ring", "vibrato", "bend")

# --- parameters that hosts move ---

# Kinds of events that set a parameter's value (kernels/player/words.py has the others): a playing parameter; the amount
# of a controller's function; a knob of the effects, 0 to 1; a technique that is latched (1) or not (0); a player's
# setting
PARAMETER, AMOUNT, EFFECT, SWITCHED, SETTING = 1, 6, 9, 10, 11

MAX_BASSES = 128  # in a plugin
SWITCH = ("off", "on")


@dataclass(frozen=True)
class Parameter:
    """A value that hosts, page and OSC set while the bass plays. Its number is its id."""

    number: int
    symbol: str
    name: str
    group: str  # under which hosts show it
    minimum: float
    maximum: float
    default: float
    unit: str  # "", dB or semitones; for bench sliders mm, %, deg, 1/s or pF
    whole: bool  # whole numbers only
    points: tuple[str, ...]  # names of the values 0, 1 ...


PARAMETER_ROWS: dict[str, Parameter] = {}
RENAMED: dict[str, str] = {}  # symbols of older versions, which states, sounds and links may have: {old: new}


def parameter(
    symbol: str,
    name: str,
    group: str,
    limits: tuple[float, float] = (0.0, 1.0),
    unit: str = "",
    points: tuple[str, ...] = (),
    default: float = 0.0,
    whole: bool = False,
) -> int:
    """Adds a row to PARAMETER_ROWS; returns its number."""
    number, whole = len(PARAMETER_ROWS), whole or bool(points)
    PARAMETER_ROWS[symbol] = Parameter(number, symbol, name, group, *limits, default, unit, whole, points)
    return number


def playing_parameter(
    symbol: str,
    name: str,
    group: str,
    limits: tuple[float, float],
    does: str,
    unit: str = "",
    points: tuple[str, ...] = (),
    controllers: tuple[int, ...] = (),
) -> int:
    """Adds a playing parameter and its controllers' row. Its usual value, 0, keeps the bass's own."""
    number = parameter(symbol, name, group, limits, unit, points, whole=unit == "semitones")
    function(symbol, controllers, does)
    return number


GAIN_DB = playing_parameter(
    "gain", "Gain", "Sound", (-60.0, 20.0), "gain, from silence to 0 dB", "dB"
)  # the least is silence
TONE_POT = playing_parameter(
    "tone", "Tone", "Sound", (-1.0, 1.0), "tone pot, from closed (0) to open (127); 64 is the bass's own",
    controllers=(17,),
)  # fmt: skip
PLUCK_POSITION = playing_parameter(
    "pluck_position", "Pluck position", "Playing", (-1.0, 1.0),
    "place of the pluck, from nearest to the bridge (0) to farthest from it (127)",
)  # fmt: skip
DYNAMICS = playing_parameter(
    "dynamics", "Dynamics", "Playing", (-12.0, 12.0), "force of every note, -12 to 12 dB", "dB"
)
OWN, PLUCKED, THUMB_ON_TWO, THUMB_ON_ALL, FINGERS, PICKED, THUMB, POPS = range(8)  # values of TECHNIQUE
TECHNIQUE = playing_parameter(
    "technique", "Stroke", "Playing", (float(OWN), float(POPS)),
    "in four ranges: the bass's own, plucked, thumb on two strings, thumb on all",
    points=(
        "the bass's own", "plucked", "thumb on two strings", "thumb on all", "fingers", "pick", "thumb", "pops on all",
    ),
)  # fmt: skip
# The value that each technique of a stroke gives it; other techniques: OWN
_STROKES = {
    WITH_FINGERS: FINGERS, WITH_PICK: PICKED, WITH_THUMB: THUMB, THUMB_ON_ALL_STRINGS: THUMB_ON_ALL, POPS_ON_ALL: POPS,
}  # fmt: skip
STROKE_OF = tuple(_STROKES.get(action, OWN) for action in range(ACTIONS))
HAND_DAMPING = playing_parameter(
    "hand_damping", "Hand damping", "Playing", (-1.0, 1.0), "hand that stops a note, from a tenth to ten times as firm"
)
UNEVENNESS = playing_parameter(
    "unevenness", "Unevenness", "Playing", (-1.0, 1.0), "unevenness from note to note, from less to more"
)
BEND_RANGE = playing_parameter(
    "bend_range", "Bend range", "Playing", (0.0, 24.0),
    "range of the pitch bend, 0 (the bass's own) to 24 semitones", "semitones",
)  # fmt: skip
LEARNABLE = tuple(PARAMETER_ROWS)  # symbols of playing parameters: kernels hold them, controllers learn them
PARAMETERS = len(LEARNABLE)
FUNCTIONS = CC_PARAMETER + PARAMETERS
MINIMUM = tuple(row.minimum for row in PARAMETER_ROWS.values())
MAXIMUM = tuple(row.maximum for row in PARAMETER_ROWS.values())

parameter("bass", "Bass", "Sound", limits=(0.0, MAX_BASSES - 1.0), whole=True)  # in the order of the shelf
parameter("quality", "Quality", "Processor", points=("live", "studio"))
parameter("running_ahead", "Look-ahead", "Processor", points=SWITCH)
parameter("relief", "Relief under overload", "Processor", points=SWITCH, default=1.0)  # never offline
parameter("palm_mute", "Palm mute", "Playing")  # functions of controllers move these two amounts, too
parameter("vibrato", "Vibrato", "Playing")
for knob in ("compression", "drive"):  # of the effects behind the DI; the amp's have rows below
    parameter(knob, knob.capitalize(), "Effects")
parameter("cores", "Cores", "Processor", limits=(1.0, 4.0), default=1.0, whole=True)  # with threads of its own

# --- bench sliders: they change the bass itself (kernels/bass/change.py) ---


@dataclass(frozen=True)
class Slider:
    """A change relative to the bass as it is: 0 changes nothing. Its values are hundredths of the unit."""

    parameter: Parameter
    step: float  # of the page's slider
    help: str

    @property
    def factor(self) -> bool:
        """True if it multiplies the bass's value; otherwise it adds to it."""
        return self.parameter.unit == "%"


SLIDER_ROWS: dict[str, Slider] = {}


def slider(
    symbol: str,
    name: str,
    group: str,
    limits: tuple[float, float],
    unit: str,
    step: float,
    does: str,
    points: tuple[str, ...] = (),
) -> int:
    """Adds a slider, also a parameter of hosts; returns its number among the sliders."""
    parameter(symbol, name, group, limits, unit, points, whole=step == 1.0 and not unit)
    SLIDER_ROWS[symbol] = Slider(PARAMETER_ROWS[symbol], step, does)
    return len(SLIDER_ROWS) - 1


ACTION = slider(
    "action", "Action", "Neck", (-2.0, 3.0), "mm", 0.05,
    "gap under the lowest string at fret 12; the other strings move in proportion",
)  # fmt: skip
NECK_RELIEF = slider("neck_relief", "Neck relief", "Neck", (-1.0, 1.0), "mm", 0.02, "hollow of the neck at its middle")
NUT_HEIGHT = slider("nut_height", "Nut height", "Neck", (-0.5, 1.5), "mm", 0.02, "gap under the open strings at fret 1")
CONTACT_LOSS = slider(
    "contact_loss", "Fret damping", "Neck", (-100.0, 300.0), "%", 1.0, "what a fret takes from a string that hits it"
)
GAUGE = slider("gauge", "Gauge", "Strings", (-30.0, 40.0), "%", 1.0, "thickness of all strings, at the same pitch")
TENSION = slider(
    "tension", "Tension", "Strings", (-25.0, 30.0), "%", 1.0, "of all strings, which get heavier at the same thickness"
)
WEAR = slider(
    "wear", "Wear", "Strings", (-50.0, 1100.0), "%", 10.0, "losses inside the strings: old strings lose more than new"
)
FOAM = slider("foam", "Foam", "Strings", (0.0, 60.0), "1/s", 0.5, "damping that a mute adds to all strings")
PICKUP_PLACE = slider(
    "pickup_place", "Pickup place", "Pickups", (-60.0, 60.0), "mm", 0.5, "moves all pickups toward the neck"
)
PICKUP_HEIGHT = slider(
    "pickup_height", "Pickup height", "Pickups", (-3.0, 3.0), "mm", 0.05, "moves all pickups toward the strings"
)
CABLE = slider("cable", "Cable", "Pickups", (-500.0, 3000.0), "pF", 10.0, "capacitance of windings and cable")
FINGER_WIDTH = slider(
    "finger_width", "Finger width", "Hand", (-80.0, 200.0), "%", 1.0, "a narrow finger sounds bright, at every velocity"
)
PLUCK_ANGLE = slider(
    "pluck_angle", "Pluck angle", "Hand", (-60.0, 60.0), "deg", 1.0, "turns the pull from straight up to across"
)
HARDEST = slider("hardest", "Hardest pluck", "Hand", (-60.0, 150.0), "%", 1.0, "force at velocity 127")
NECK_RESONANCE = slider(
    "neck_resonance", "Neck resonance", "Neck", (-50.0, 150.0), "%", 0.5,
    "lowest frequency at which the neck bends; notes near it die early",
)  # fmt: skip
NECK_MASS = slider(
    "neck_mass", "Neck mass", "Neck", (-80.0, 200.0), "%", 1.0, "at that resonance: light makes the dead spot deeper"
)
FRET = slider("fret", "Fret", "Neck", (0.0, float(FRETS)), "", 1.0, "the fret that Fret height moves; 0: none")
FRET_HEIGHT = slider("fret_height", "Fret height", "Neck", (-0.5, 1.5), "mm", 0.02, "one fret stands proud, or is worn")
PICKUP_1_PLACE = slider(  # for the first and the second pickup alone, in turn
    "pickup_1_place", "Pickup 1 place", "Pickups", (-60.0, 60.0), "mm", 0.5, "moves this pickup toward the neck"
)
PICKUP_1_HEIGHT = slider(
    "pickup_1_height", "Pickup 1 height", "Pickups", (-3.0, 3.0), "mm", 0.05, "moves this pickup toward the strings"
)
slider("pickup_2_place", "Pickup 2 place", "Pickups", (-60.0, 60.0), "mm", 0.5, "moves this pickup toward the neck")
slider("pickup_2_height", "Pickup 2 height", "Pickups", (-3.0, 3.0), "mm", 0.05, "moves this pickup toward the strings")
OWN_PICKUPS = 2  # number with sliders of their own

# --- techniques that stay on: each that a key holds is also a switch of hosts, unless it has an amount or a value ---

for row in TECHNIQUE_ROWS.values():
    if row.trigger == HOLD and row.symbol not in PARAMETER_ROWS and row.number != ON_STRING:
        parameter(row.symbol, row.name, "Techniques", points=SWITCH)

# --- how the bass is tuned, more sliders; and its player's settings, which the performer reads as each note begins ---

CONCERT_PITCH = slider(
    "concert_pitch", "A4", "Strings", (-25.0, 26.0), "Hz", 0.1, "pitch of the A above middle C, by all strings' tension"
)


class Tuned(NamedTuple):
    """A tuning by name: how far every string goes, and how much further the string with this open note does."""

    name: str
    by: int  # semitones
    dropped: int | None = None  # MIDI
    further: int = 0  # semitones down


B0, E1 = 23, 28  # open notes, MIDI
TUNINGS = {
    "standard": Tuned("as it is", 0),
    "half-step-down": Tuned("half a step down", -1),
    "whole-step-down": Tuned("a whole step down", -2),
    "drop-d": Tuned("drop D", 0, E1, 2),
    "drop-db": Tuned("drop D flat", -1, E1, 2),
    "drop-c": Tuned("drop C", -2, E1, 2),
    "drop-b": Tuned("drop B", -3, E1, 2),
    "drop-a": Tuned("drop A", 0, B0, 2),
    "bead": Tuned("BEAD", -5),
    "tenor": Tuned("tenor, ADGC", 5),
}
NAMED_TUNING = slider(
    "named_tuning", "Tuning", "Strings", (0.0, len(TUNINGS) - 1.0), "", 1.0,
    "strings go up or down by their tension; a drop needs its string",
    tuple(row.name for row in TUNINGS.values()),
)  # fmt: skip
SLIDERS = len(SLIDER_ROWS)
TUNED_BY = tuple(row.by for row in TUNINGS.values())
TUNED_DROPPED = tuple(row.dropped or -1 for row in TUNINGS.values())
TUNED_FURTHER = tuple(row.further for row in TUNINGS.values())
SETTING_ROWS: dict[str, Parameter] = {}


def setting(
    symbol: str,
    name: str,
    minimum: float,
    maximum: float,
    unit: str = "",
    points: tuple[str, ...] = (),
    whole: bool = False,
) -> int:
    """Adds a setting of the player; returns its number among the settings. Its usual value, 0, changes nothing."""
    parameter(symbol, name, "Playing", (minimum, maximum), unit, points, whole=whole)
    SETTING_ROWS[symbol] = PARAMETER_ROWS[symbol]
    return len(SETTING_ROWS) - 1


parameter("blend", "Pickup blend", "Pickups", limits=(-1.0, 1.0))  # a controller's function moves it, too
VELOCITY_CURVE = setting("velocity_curve", "Velocity curve", -1.0, 1.0)  # soft to hard
HUMANISE_TIME = setting("humanise_time", "Humanise time", 0.0, 30.0, "ms")  # a stroke comes up to this late
HUMANISE_FORCE = setting("humanise_force", "Humanise force", 0.0, 6.0, "dB")  # strokes differ by up to this
HAND_POSITION = setting("hand_position", "Hand position", 0.0, float(FRETS), whole=True)  # fret; 0: where it is
AVOID_OPEN = setting("avoid_open", "Avoid open strings", 0.0, 1.0, points=SWITCH)
SETTINGS = len(SETTING_ROWS)
MIN_SETTINGS = tuple(row.minimum for row in SETTING_ROWS.values())
MAX_SETTINGS = tuple(row.maximum for row in SETTING_ROWS.values())

# --- the amp: more knobs of the effects behind the DI; 0 keeps the bass's own ---

EQ_LIMIT = 15.0  # dB
BASS_CORNER, TREBLE_CORNER = 80.0, 4000.0  # Hz, of the two shelves
LOW_MIDS, HIGH_MIDS = (160.0, 250.0, 400.0, 630.0, 1000.0), (800.0, 1250.0, 2000.0, 3150.0, 5000.0)  # Hz, by name
LOW_MID, HIGH_MID = 400.0, 2000.0  # Hz, unless a preset or a knob says otherwise
CABINETS = ("none", "closed-4x10", "closed-8x10", "vented-1x15")
LIMITING = ("amp", "off", "on")  # amp: while equaliser, clean blend or a cabinet is on
OF_BASS = "the bass's own"


def _frequency(symbol: str, name: str, centres: tuple[float, ...]) -> None:
    """Adds the row of a middle band's centre frequency."""
    parameter(symbol, name, "Amp", (0.0, float(len(centres))), points=(OF_BASS, *(f"{f:g} Hz" for f in centres)))


def _chosen(symbol: str, choices: tuple[str, ...]) -> None:
    """Adds the row of a choice."""
    parameter(symbol, symbol.capitalize(), "Amp", (0.0, float(len(choices))), points=(OF_BASS, *choices))


parameter("clean_blend", "Clean blend", "Amp")  # part of the clean sound beside the drive
parameter("eq_bass", "EQ bass", "Amp", (-EQ_LIMIT, EQ_LIMIT), "dB")
parameter("eq_low_mid", "EQ low mid", "Amp", (-EQ_LIMIT, EQ_LIMIT), "dB")
_frequency("eq_low_mid_frequency", "Low mid frequency", LOW_MIDS)
parameter("eq_high_mid", "EQ high mid", "Amp", (-EQ_LIMIT, EQ_LIMIT), "dB")
_frequency("eq_high_mid_frequency", "High mid frequency", HIGH_MIDS)
parameter("eq_treble", "EQ treble", "Amp", (-EQ_LIMIT, EQ_LIMIT), "dB")
_chosen("cabinet", CABINETS)
_chosen("limiter", LIMITING)
EFFECTS = tuple(p.symbol for p in PARAMETER_ROWS.values() if p.group in ("Effects", "Amp"))  # by number
MIN_EFFECTS = tuple(PARAMETER_ROWS[knob].minimum for knob in EFFECTS)
MAX_EFFECTS = tuple(PARAMETER_ROWS[knob].maximum for knob in EFFECTS)
CHOICES: dict[str, tuple[float, ...] | tuple[str, ...]] = {  # what a knob's values from 1 on stand for in presets
    "eq_low_mid_frequency": LOW_MIDS, "eq_high_mid_frequency": HIGH_MIDS, "cabinet": CABINETS, "limiter": LIMITING,
}  # fmt: skip


def knob_of(symbol: str, value: float) -> float | str:
    """Returns what a preset writes for a knob's value, which is not 0: "closed-4x10" for 2 of the knob `cabinet`."""
    return CHOICES[symbol][round(value) - 1] if symbol in CHOICES else value


def event(p: Parameter) -> tuple[int, int] | None:
    """Returns kind and number of the event that sets a parameter; None for one that no event sets."""
    if p.symbol in LEARNABLE:
        return PARAMETER, p.number
    if p.symbol in EFFECTS:
        return EFFECT, EFFECTS.index(p.symbol)
    if p.symbol in SETTING_ROWS:
        return SETTING, list(SETTING_ROWS).index(p.symbol)
    if p.symbol in TECHNIQUE_ROWS and p.points:
        return SWITCHED, TECHNIQUE_ROWS[p.symbol].number
    return (AMOUNT, FUNCTION_ROWS[p.symbol].number) if p.symbol in FUNCTION_ROWS else None


# --- number keys of the page and of a terminal ---


class Button(NamedTuple):
    """A number key, 1 to 9 or 0."""

    symbol: str
    name: str
    value: int  # sent to its controller; 0: it has a key instead
    strikes: bool  # it selects what plucks, until the next one; others turn on and off


def button(symbol: str) -> Button:
    """The number key of a technique."""
    row, moved = TECHNIQUE_ROWS[symbol], FUNCTION_ROWS.get(symbol)
    return Button(symbol, row.name, moved.pressed if moved else 0, row.trigger == PRESS)


BUTTONS = tuple(
    map(button, ("finger", "pick", "slap", "palm_mute", "ghost", "harmonic", "legato", "slide", "vibrato", "let_ring"))
)
