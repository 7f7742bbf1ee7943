"""The parts of a bass that the kernels read as numbers, a row each (rows.py): strings, necks, circuit, player.

Words number the fields of a record in kernels. A new number takes the next word, wherever its row stands. Instrument
files (kernels/bass/kept.py) hold numbers by name.
"""

from __future__ import annotations

from dataclasses import KW_ONLY, dataclass

from livebass.rows.row import LARGEST, REQUIRED, TINY, choice, number, result
from livebass.rows.techniques import CABINETS, HIGH_MID, LIMITING, LOW_MID
from livebass.rows.units import OFF

STROKES = ("finger", "pick", "nail", "pop")  # in the order of the performer's numbers
ANSWERING = ("off", "pedal", "always", "held")  # in the order of their numbers, too
NOISES = ("skin_noise", "pick_noise", "release_noise", "floor_noise", "hum", "squeak")  # of the player
SILENT = {**dict.fromkeys(NOISES, OFF), "fretting_noise": 0.0}  # what makes a player without noise
ABOVE_ZERO, NOT_BELOW_ZERO = (TINY, LARGEST), (0.0, LARGEST)
MAX_GRID = 20_000  # steps of a note
# The exchange of u and v over turned axes (kernels/string/turning.py), in the engine as in the reference solver
TURNED_MODES = 64  # modes that exchange: the lowest, whole BLOCKs of the kernels
EXCHANGE_EVERY = 4  # frames between two exchanges
EXCHANGES_AT_ONCE = 2  # in a frame, of those that waited ...
MAX_OWED = 256  # ... and the most that wait


@dataclass(frozen=True, kw_only=True)
class StringLaw:
    """A string's numbers that all its notes share. Words continue in NeckLaw and NoteNumbers."""

    # fmt: off
    linear_density: float = number(REQUIRED, "linear density", "0.1 g/m", "200 g/m", "mass per length",
        word=8, file=(1e-6, 1.0))  # kg/m
    diameter: float = number(REQUIRED, "length", "0.1 mm", "10 mm", "outside",
        word=9, file=(1e-6, 0.1))  # m, for friction with the air (eq. 10)
    viscoelastic_angle: float = number(0.01, "number", "0", "0.5", "delta_ve of eq. 11", word=12, file=NOT_BELOW_ZERO)
    thermoelastic: float = number(6e-6, "number", "0", "0.01",
        "1/Q_te of eq. 9: friction of the windings", word=13, file=NOT_BELOW_ZERO)
    relaxation: float = number(0.0, "number", "0", "0.1",
        "loss that grows steeply up to relaxation_frequency: twice its 1/Q there", word=24, file=NOT_BELOW_ZERO)
    relaxation_frequency: float = number(3000.0, "frequency", "100 Hz", "20 kHz",
        "where that loss is greatest for each cycle", word=25, file=NOT_BELOW_ZERO)
    extra_damping: float = number(0.0, "decay rate", "0 /s", "10000 /s", "damping by a mute, the same for every mode",
        word=14, file=NOT_BELOW_ZERO)
    extra_damping_slope: float = number(0.0, "number", "0", "1",
        "damping by a mute that grows with frequency, 1/s per rad/s", word=15, file=NOT_BELOW_ZERO)
    # fmt: on


@dataclass(frozen=True, kw_only=True)
class StringNumbers(StringLaw):
    """All numbers of a string. The bench holds them; kernels compute its notes from them."""

    # fmt: off
    level: float = number(1.0, "number", "0", "10", "how strongly pickups sense it")  # its steel, its poles
    axial_stiffness: float = number(0.0, "force", "0 N", "1000000 N", "E A: hard notes begin sharp; 0: they do not")
    winding: float = number(0.0, "length", "0 mm", "2 mm", "pitch of a round winding: slides squeak; 0: flat")
    law_fundamental: float = number(0.0, "frequency", "5 Hz", "5000 Hz", "f0 of the law of partials, if measured",
        optional=True)  # 0: from open_note
    tension: float = number(REQUIRED, "force", "5 N", "1000 N", "left out: the tension that gives the pitch",
        optional=True)  # N, nominal: the notes set the pitch
    inharmonicity: float = number(REQUIRED, "number", "0", "0.01",
        "B, see `livebass help physics`; or give core_diameter", optional=True)  # pi^2 E I / (T L^2) of the open string
    # fmt: on


@dataclass(frozen=True, kw_only=True)
class NeckLaw:
    """A neck's numbers that all its notes share.

    Contact and friction are a force per unit length on one `grid_step`. A stiffness of 1e8 to 1e9 on a grid of 1 mm is
    an effective law for windings, fret, wood and the motion that the modes omit, far softer than steel on steel.
    """

    # fmt: off
    contact_stiffness: float = number(1e13, "number", "1e5", "1e15",
        "K of eq. 6 in SI units: how hard the frets are", word=17, file=(TINY, 1e30))
    contact_exponent: float = number(1.5, "number", "1", "3", "alpha of eq. 6", word=18, file=(1.0, 5.0))
    friction: float = number(900.0, "force per length", "0 N/m", "1000000 N/m",
        "A of eq. 7: how strongly frets hold the string sideways", word=20, file=NOT_BELOW_ZERO, of="across")
    friction_speed: float = number(1e-5, "speed", "0.01 um/s", "1 m/s", "s of eq. 7: a slower point sticks to the fret",
        word=21, file=ABOVE_ZERO, of="across")
    axes_turned: float = number(0.0, "angle", "-90 deg", "90 deg",
        "turns the two directions in which the neck gives way", word=23, file=(-1.6, 1.6), of="across")
    # fmt: on


@dataclass(frozen=True, kw_only=True)
class NeckNumbers(NeckLaw):
    """All numbers of a neck. The bench holds them; kernels compute its notes from them."""

    # fmt: off
    contact_loss: float = number(0.0, "mechanical resistance", "0 N s/m", "10000 N s/m",
        "resistance of a fret that the string presses in by 0.1 mm")
    grid_step: float = number(1e-3, "length", "0.2 mm", "10 mm", "length of string that one fret touches")  # dx
    free_length: float = number(0.0, "length", "10 mm", "1500 mm", "nut to body; left out: 0.6 of the scale",
        optional=True)  # 0: model.neck.FREE_PART of the scale
    stop_conductance: float = number(0.0, "conductance", "0 m/s/N", "0.1 m/s/N",
        "Re Y of fret and finger: what a stopped note loses to them")
    stiffness_across: float = number(1.0, "number", "0.1", "100", "how much stiffer the neck is sideways",
        of="across")
    stop_across: float = number(1.0, "number", "0", "10", "loss of sideways motion, relative to stop_conductance",
        of="across")
    longer_across: float = number(0.0, "length", "-10 mm", "10 mm", "how much longer the string is for sideways motion",
        of="across")
    # fmt: on


@dataclass(frozen=True, kw_only=True)
class NoteNumbers(StringLaw, NeckLaw):
    """The numbers of a string stopped at a fret: the shared ones, and the results for this fret."""

    grid_points: int = result(0, 2, MAX_GRID, "integer")  # N: `length` / N is the grid step dx
    paper_law: int = result(1, 0, 1, "integer")  # 1: String.stiffness_law is "paper", 0: "hinged"
    length: float = result(2, 0.05, 5.0)  # m
    fundamental: float = result(3, 1.0, 20e3)  # Hz, f0 of the frequency law: c / 2L
    damped_fundamental: float = result(4, 0.0, 20e3)  # Hz, base of the damping law
    clamp: float = result(5, 0.0)  # mode number above which the "paper" damping law is constant
    inharmonicity: float = result(6, 0.0, 1.0)  # B for this length
    held_stiffness: float = result(7, 0.0)  # m^2, E I / T in the shape that a finger holds
    tension: float = result(10, 1e-3, 1e5)  # N
    bending: float = result(11, 0.0, 1e3)  # N m^2, E I
    contact_loss: float = result(16, 0.0)  # s/m, c of kernels/string/contact.py
    own_across: int = result(19, 0, 1, "integer")  # 1: v has a neck of its own; 0: it shares u's
    longer_across: float = result(22, -0.1, 0.1)  # fraction of the length that v is longer


@dataclass(frozen=True)
class Coil:
    """The circuit of a pickup: its coil, volume and tone pots, and the cable."""

    # fmt: off
    inductance: float = number(4.0, "inductance", "0.01 H", "50 H", "pickup", word=0, file=ABOVE_ZERO)
    resistance: float = number(7500.0, "resistance", "1 ohm", "100 kohm", "pickup", word=1, file=ABOVE_ZERO)
    capacitance: float = number(600e-12, "capacitance", "1 pF", "100 nF", "winding and cable", word=2, file=ABOVE_ZERO)
    volume_pot: float = number(250e3, "resistance", "1 kohm", "10 Mohm", "whole track", word=3, file=ABOVE_ZERO)
    tone_pot: float = number(250e3, "resistance", "1 kohm", "10 Mohm", "whole track", word=4, file=ABOVE_ZERO)
    tone_capacitor: float = number(47e-9, "capacitance", "10 pF", "10 uF", "behind the tone pot",
        word=5, file=ABOVE_ZERO)
    tone: float = number(1.0, "number", "0", "1", "0 closed, 1 open", word=6)
    # fmt: on


@dataclass(frozen=True, kw_only=True)
class PlayerNumbers:
    """The numbers of a `model.instrument.Player`, which documents them, and its choices, also numbers in kernels."""

    # fmt: off
    technique: str = choice("pluck", ("pluck", "slap"), "slap: thumb on the low strings, pops on the high ones",
        record="slap")  # the thumb strikes the lower strings, a finger pops those above
    stroke: str = choice("finger", STROKES, "what plucks; the widths below are a finger's",
        record="stroke", of="pluck")  # pick, nail and pop have widths and release times of their own
    slapped_strings: int = number(0, "integer", "0", "8",
        "how many of the lowest the thumb strikes; left out: half of them",
        word=27, optional=True)  # from the lowest, that the thumb strikes
    pluck_position: float = number(0.74, "number", "0.01", "0.99",
        "place of the pluck: fraction of the open string, from the nut",
        word=6, file=(0, 1), of="pluck")  # fraction of the open string from the nut
    pluck_nearest: float = number(0.55, "number", "0.01", "0.99", "the same with its controller at 0 ...",
        word=7, file=(0, 1), of="pluck")
    pluck_farthest: float = number(0.93, "number", "0.01", "0.99", "... and at 127", word=8, file=(0, 1), of="pluck")
    pluck_angle: float = number(0.0, "angle", "-89 deg", "89 deg",
        "direction of the pull: 0 straight up, 90 deg across", word=4, file=(-1.6, 1.6), of="pluck")
    angle_when_hard: float = number(0.0, "angle", "-89 deg", "89 deg", "added to it for the hardest notes",
        word=29, file=(-1.6, 1.6), of="pluck")
    nearer_when_hard: float = number(0.0, "length", "0 mm", "200 mm",
        "how much nearer to the saddle the hardest notes are", word=20, file=(-1, 1), of="pluck")
    rounding: float = number(5e-3, "length", "0.5 mm", "50 mm", "half width of the finger, at velocity 127 ...",
        word=2, file=(0, 1), of="pluck")  # standard deviation of the Gaussian that rounds the corner
    rounding_soft: float = number(0.0, "length", "0 mm", "50 mm", "... and at velocity 1; 0 mm: the same",
        word=16, file=(0, 1), of="pluck")
    release_time: float = number(0.0, "time", "0 us", "10 ms", "how gradually it lets go, at velocity 127 ...",
        word=17, file=(0, 1), of="pluck")  # see modes.pluck_amplitudes
    release_time_soft: float = number(0.0, "time", "0 us", "10 ms", "... and at velocity 1; 0 us: the same",
        word=18, file=(0, 1), of="pluck")
    release_speed: float = number(0.0, "speed", "0 m/s", "10 m/s",
        "speed of the finger as it lets go, at greatest_apex",
        word=19, file=(0, 100), of="pluck")  # in proportion to the apex
    softest: float = number(0.08, "number", "0", "100", "force at velocity 1; 1: the open string grazes a fret",
        word=9, file=(0, 1e3))
    hardest: float = number(4.5, "number", "0", "100", "force at velocity 127", word=10, file=(0, 1e3))
    greatest_apex: float = number(0.010, "length", "0.1 mm", "30 mm",
        "farthest pull of the string: approached, never reached", word=11, file=(1e-6, 1))
    unevenness: float = number(0.0, "number", "0", "0.5", "how much strength and place differ from note to note",
        word=15, file=(0, 1))  # notes differ by up to this fraction in strength, and this times 10 cm in place
    strike_position: float = number(0.68, "number", "0.01", "0.99", "place of the thumb, as pluck_position",
        word=12, file=(0, 1), of="thumb")
    strike_force: float = number(1.0, "number", "0.01", "10", "depth of a strike, relative to a pluck of that velocity",
        word=13, file=(0, 1e3), of="thumb impulse")  # of the same velocity
    strike_width: float = number(0.02, "length", "1 mm", "100 mm", "width of the thumb",
        word=3, file=(0, 1), of="thumb impulse")
    strike_time: float = number(1.5e-3, "time", "0.1 ms", "20 ms", "how long the thumb stays on the string",
        word=1, file=(0, 10), of="thumb impulse")
    thumb_mass: float = number(0.0, "mass", "0 kg", "0.1 kg",
        "mass of a thumb that bounces; 0: the thumb is an impulse", word=23, file=(0, 10), of="thumb")
    strike_softest: float = number(0.5, "speed", "10 mm/s", "8 m/s", "speed of a thumb with a mass at velocity 1",
        word=21, file=(1e-3, 100), of="bounce")
    strike_hardest: float = number(3.5, "speed", "10 mm/s", "8 m/s", "speed of a thumb with a mass at velocity 127",
        word=22, file=(1e-3, 100), of="bounce")
    thumb_width: float = number(5e-3, "length", "1 mm", "50 mm", "half the width that touches the string",
        word=24, file=(0, 1), of="bounce")
    thumb_stiffness: float = number(7e5, "number", "0", "1e8", "stiffness of its flesh, N/m^1.5",
        word=25, of="bounce")
    thumb_loss: float = number(0.35, "number", "0", "10", "loss of its flesh, s/m, by Hunt and Crossley",
        word=26, file=(0, 1e3), of="bounce")
    pull_time: float = number(2e-3, "time", "0.1 ms", "100 ms", "how long the finger pulls before it lets go",
        word=0, file=(0, 10), of="pluck")
    hand_damping: float = number(90.0, "decay rate", "0 /s", "10000 /s", "how firmly a hand stops a note",
        word=14, file=(0, 1e6))
    palm_resistance: float = number(0.0, "mechanical resistance", "0 N s/m", "100 N s/m",
        "firmness of a palm or foam that always rests on the strings", word=34)
    palm_pressed: float = number(20.0, "mechanical resistance", "0.001 N s/m", "100 N s/m",
        "firmness of the palm when its controller presses it hardest", word=35, of="palm")
    palm_place: float = number(25e-3, "length", "1 mm", "200 mm", "middle of the palm, from the saddle",
        word=36, file=(0, 1), of="palm")
    palm_width: float = number(8e-3, "length", "1 mm", "50 mm", "half the width that touches the strings",
        word=37, file=(0, 1), of="palm")  # standard deviation of its Gaussian pressure
    skin_noise: float = number(OFF, "level", "-200 dB", "20 dB",
        "finger on windings in the hardest pluck, relative to its peak",
        word=30, of="pluck")  # rms at its loudest
    pick_noise: float = number(OFF, "level", "-200 dB", "20 dB",
        "clicks of a pick, relative to the pluck's peak; off: skin_noise",
        word=38, of="pluck pick")  # rms at its loudest, of any force
    release_noise: float = number(OFF, "level", "-200 dB", "40 dB",
        "knock of a releasing hand, relative to a medium note after 1 s", word=31)  # rms at its loudest
    release_cutoff: float = number(1300.0, "frequency", "150 Hz", "20 kHz",
        "up to where that knock is loud; recorded ones: 500 to 900 Hz",
        word=43, file=NOT_BELOW_ZERO, of="release")
    release_spread: float = number(0.0, "number", "0", "2",
        "how much the ends of notes differ in speed and level; 1: as recorded", word=44)
    fretting_noise: float = number(0.0, "number", "0", "10",
        "fingers that come down or leave between notes; 1: as recorded", word=45)
    floor_noise: float = number(OFF, "level", "-200 dB", "0 dB", "noise of the electronics, relative to a medium note",
        word=33)  # rms
    floor_cutoff: float = number(3000.0, "frequency", "100 Hz", "20 kHz",
        "up to where that noise is level; a preamplifier: 20 kHz", word=42, file=NOT_BELOW_ZERO, of="floor")
    floor_corner: float = number(0.0, "frequency", "0 Hz", "10 kHz",
        "where flicker noise is as loud as that; louder below; 0: none", word=46, file=NOT_BELOW_ZERO, of="floor")
    hum: float = number(OFF, "level", "-200 dB", "0 dB", "mains hum of single coils, relative to a medium note",
        word=39)  # rms
    mains: float = number(50.0, "frequency", "40 Hz", "70 Hz", "frequency of that hum", word=40, of="hum")
    resting_hand: float = number(0.0, "mechanical resistance", "0 N s/m", "100 N s/m",
        "firmness of a hand that rests on strings that answer", word=41, of="answers")
    squeak: float = number(0.0, "level", "-200 dB", "20 dB", "fingers sliding on round windings, relative to normal",
        word=32)
    answering: str = choice("off", ANSWERING, "when idle strings ring along; held: with the pedal or a held note",
        record="answering")  # when idle strings may answer sounding ones
    bend_range: float = number(2.0, "number", "0", "96", "range of the pitch bend in semitones", word=5)
    out_of_range: str = choice("transpose", ("transpose", "drop"),
        "what to do with notes the bass does not have", record="drop")
    position_controller: int = number(16, "controller", "0", "119", "MIDI controller of the pluck position",
        of="pluck")  # in addition to the one in `keys`
    ghost_below: int = number(0, "integer", "0", "128", "notes below this velocity are ghost notes", word=28)
    wheel: str = choice("bend", ("bend", "slide"), "the pitch wheel bends, or slides over the frets",
        record="wheel_slides")
    # fmt: on


@dataclass(frozen=True)
class Pick:
    """A pick's down strokes. Its up strokes differ from them as with the usual pick."""

    # fmt: off
    soft_width: float = number(1.5e-3, "length", "0.1 mm", "50 mm",
        "half the width that touches the string, at velocity 1 ...", word=0, file=(0, 1))
    hard_width: float = number(1e-3, "length", "0.1 mm", "50 mm", "... and at 127", word=1, file=(0, 1))
    soft_release: float = number(240e-6, "time", "1 us", "10 ms", "how gradually it lets go, at velocity 1 ...",
        word=2, file=(0, 1))
    hard_release: float = number(12e-6, "time", "1 us", "10 ms", "... and at 127", word=3, file=(0, 1))
    place: float = number(0.94, "number", "0.01", "0.99", "place of the pluck, as player.pluck_position",
        word=4, file=(0, 1))
    angle: float = number(0.8, "angle", "-89 deg", "89 deg", "direction of its pull; 0: player.pluck_angle",
        word=5, file=(-1.6, 1.6))
    nearer: float = number(60e-3, "length", "0 mm", "200 mm",
        "how much nearer the hardest are; 0: player.nearer_when_hard", word=6, file=(-1, 1))
    lift: float = number(0.75, "number", "0.1", "4", "how far it lifts the string, relative to a finger",
        word=7, file=(TINY, 10))
    # fmt: on


@dataclass(frozen=True)
class Knobs:
    """The knobs of the effects behind the DI; with these values they change nothing."""

    # fmt: off
    compression: float = number(0.0, "number", "0", "1", "compression of the mix, 0 (off) to 1", word=0)
    drive: float = number(0.0, "number", "0", "1", "valve stage with a tone stack, 0 (off) to 1", word=1)
    _: KW_ONLY
    clean_blend: float = number(0.0, "number", "0", "1", "clean part beside the drive, keeps the lows", word=2)
    eq_bass: float = number(0.0, "level", "-15 dB", "15 dB", "equaliser: shelf below 80 Hz", word=3)
    eq_low_mid: float = number(0.0, "level", "-15 dB", "15 dB", "equaliser: low mid", word=4)
    eq_low_mid_frequency: float = number(LOW_MID, "frequency", "100 Hz", "1000 Hz", "equaliser: centre of the low mid",
        word=5, file=(0, 1000))  # 0, in older files: LOW_MID
    eq_high_mid: float = number(0.0, "level", "-15 dB", "15 dB", "equaliser: high mid", word=6)
    eq_high_mid_frequency: float = number(HIGH_MID, "frequency", "500 Hz", "5000 Hz",
        "equaliser: centre of the high mid", word=7, file=(0, 5000))
    eq_treble: float = number(0.0, "level", "-15 dB", "15 dB", "equaliser: shelf above 4 kHz", word=8)
    cabinet: str = choice(CABINETS[0], CABINETS, "cabinet, computed from its loudspeakers", record="cabinet")
    limiter: str = choice(LIMITING[0], LIMITING, "limiter at -1 dBFS; amp: with equaliser, blend or cabinet",
        record="limiter")
    # fmt: on
