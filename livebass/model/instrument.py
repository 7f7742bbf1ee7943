"""An electric bass as frozen values in SI units: strings, necks, pickups, player, and a string stopped at a fret.

Axes: x runs along the string from the nut (0) to the saddle (`length`), u points up, away from the neck, and v across,
along the frets. The open string at rest is u = 0; a fret crown below it has a negative height. Equation numbers:
Issanchou et al. (2018).
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from functools import lru_cache

import numpy as np

from livebass.arrays import Floats
from livebass.model.keymap import MODO, Curve, KeyMap
from livebass.model.neck import FREE_PART, Admittance, Surface, detuning, neck_damping, surface_beyond, surface_on_grid
from livebass.parts import STROKES as STROKES
from livebass.parts import Coil as Coil
from livebass.parts import PlayerNumbers
from livebass.rows import choice, number

A4_NOTE, A4_HZ = 69, 440.0
STIFFNESS_LAWS = ("hinged", "paper")  # see model/modes.py
ROUNDING = 1e-9  # m, by which a crown may stand above the string at rest and still count as level with it
BOARD_ROUGH = 20e-6  # m, by which a board may stand above the string at rest; it is pressed flat
MOST_DETUNING = 0.05  # relative shift of a mode by the neck: beyond, eq. 8 fails, as it is of first order


@dataclass(frozen=True)
class String:
    """One open string between nut and saddle: sections 2.1 and 2.2."""

    name: str
    open_note: int  # MIDI note number
    length: float  # m, nut to saddle
    linear_density: float  # kg/m
    tension: float  # N, nominal: the pitch itself is set by the notes, see `speaking`
    diameter: float  # m, outside, for friction with the air (eq. 10)
    inharmonicity: float  # B = pi^2 E I / (T L^2), open string
    stiffness_law: str = choice("hinged", STIFFNESS_LAWS, "f0 j sqrt(1 + B j^2); eq. 8, for B j^2 < 0.04")
    viscoelastic_angle: float = number(0.01, "number", "0", "0.5", "delta_ve of eq. 11")
    thermoelastic: float = number(6e-6, "number", "0", "0.01", "1/Q_te of eq. 9")
    extra_damping: float = number(0.0, "decay rate", "0 /s", "10000 /s", "a mute, on every mode")
    extra_damping_slope: float = number(0.0, "number", "0", "1", "1/s added per rad/s of the mode")
    level: float = number(1.0, "number", "0", "10", "how strongly pickups sense it")  # its steel, its poles
    axial_stiffness: float = number(0.0, "force", "0 N", "1000000 N", "E A: hard notes begin sharp; 0: they do not")
    winding: float = number(0.0, "length", "0 mm", "2 mm", "pitch of a round winding: slides squeak; 0: flat")
    law_fundamental: float = number(
        0.0, "frequency", "5 Hz", "5000 Hz", "f0 of the law of partials if measured", optional=True
    )  # 0: from open_note
    measured_frequencies: tuple[float, ...] = ()  # Hz, of the first modes of the open string
    measured_dampings: tuple[float, ...] = ()  # 1/s, of the same modes
    offsets: tuple[float, ...] = ()  # cents, (12,): notes over equal temperament at A4_HZ, C first; empty: none
    slack: float = 1.0  # how far a force pulls it, over how far before it was tuned
    own_note: int | None = None  # open note before tuning and capo; None: open_note

    def frequency(self, note: int) -> float:
        """Frequency (Hz) to which a MIDI note number is tuned on this string."""
        hertz = note_frequency(note)
        return hertz * 2.0 ** (self.offsets[note % 12] / 1200) if self.offsets else hertz

    @property
    def called(self) -> int:
        """Pitch class by which key switches call it: that of its note before tuning and capo."""
        return (self.open_note if self.own_note is None else self.own_note) % 12

    @property
    def nominal_fundamental(self) -> float:
        """c / 2L of the open string, Hz."""
        return math.sqrt(self.tension / self.linear_density) / (2 * self.length)


@dataclass(frozen=True)
class Neck:
    """The frets or the board under one string, the law of a contact with them (eq. 6), and how the neck gives way."""

    fret_positions: tuple[float, ...]  # m from the nut, ascending, fret 1 first
    fret_heights: tuple[float, ...]  # m relative to the open string at rest, negative is below
    # contact and friction: force per unit length on one `grid_step`
    contact_stiffness: float = number(1e13, "number", "1e5", "1e15", "K of eq. 6, SI")
    contact_exponent: float = number(1.5, "number", "1", "3", "alpha of eq. 6")
    grid_step: float = number(1e-3, "length", "0.2 mm", "10 mm", "length of string that a fret pushes on")  # dx
    friction: float = number(900.0, "force per length", "0 N/m", "1000000 N/m", "A of eq. 7", of="across")
    friction_speed: float = number(
        1e-5, "speed", "0.01 um/s", "1 m/s", "s of eq. 7: slower, a point sticks", of="across"
    )
    admittance: Admittance = field(default_factory=Admittance)  # Y_nut of eqs. 8 and 9
    free_length: float = number(
        0.0, "length", "10 mm", "1500 mm", "nut to body; left out: 0.6 of the scale", optional=True
    )  # 0: FREE_PART of the scale
    stop_conductance: float = number(0.0, "conductance", "0 m/s/N", "0.1 m/s/N", "Re Y of a stop, on stopped notes")
    surface: Surface = ()  # board under the string, crowns included; empty: the string can touch the crowns only
    fretless: bool = False  # the fret positions are but places where notes are stopped
    capo: float = 0.0  # m from the nut to a capo: places count from it, heights from the string that it stops; 0: none


@dataclass(frozen=True)
class Pickup:
    """A magnetic pickup under all strings, or under some, as half of a split coil is."""

    position: float  # m from the saddle
    aperture: float = number(0.02, "length", "0 mm", "100 mm", "length of string it senses")
    decay_length: float = number(4e-3, "length", "0.5 mm", "50 mm", "rise that weakens the flux e times")
    level: float = number(1.0, "number", "-10", "10", "in the mix; negative: reversed")
    across: float = number(
        0.15, "number", "-10", "10", "how strongly it senses motion across, of motion up", of="across"
    )  # the field changes less along the frets
    strings: tuple[str, ...] = ()  # names of those it senses; empty: all


@dataclass(frozen=True)
class Output:
    """How the motion of the strings becomes a signal: through pickups, or as the displacement at a sensor."""

    kind: str = choice("pickups", ("pickups", "displacement"), "magnetic, or the string at the sensor")
    pickups: tuple[Pickup, ...] = (Pickup(0.09),)
    coil: Coil = field(default_factory=Coil)
    sensor: float = number(0.009, "length", "1 mm", "500 mm", "displacement sensor, from the saddle", of="sensor")
    sensor_v: float = number(0.018, "length", "1 mm", "500 mm", "the same for the motion across", of="sensor across")
    across: float = number(0.0, "number", "-10", "10", "level of the motion across in displacement", of="sensor across")
    gain: float = number(1.0, "number", "0", "1e9", "signal per volt, or per metre of displacement")


@dataclass(frozen=True, kw_only=True)
class Player(PlayerNumbers):
    """How notes become plucks. Strengths are forces of the hand over that by which the open string grazes a fret."""

    keys: KeyMap = MODO  # what MIDI keys below the notes, and controllers, do
    velocity_curve: Curve = "linear"  # how hard a velocity is played: model/keymap.py


@dataclass(frozen=True)
class Instrument:
    """A bass: strings from the lowest to the highest, a neck for each, output and player."""

    name: str
    description: str
    strings: tuple[String, ...]
    necks: tuple[Neck, ...]
    output: Output
    player: Player
    a4: float = A4_HZ  # Hz, of the A above middle C

    @property
    def note_range(self) -> tuple[int, int]:
        """The lowest and the highest MIDI note it has: every string is played up to the last fret that all have."""
        frets = min(len(neck.fret_positions) for neck in self.necks)
        return self.strings[0].open_note, max(string.open_note for string in self.strings) + frets

    @property
    def over_board(self) -> bool:
        """True if any string is over a board instead of frets."""
        return any(neck.surface for neck in self.necks)

    def string_index(self, name: str) -> int:
        """Index of the string called `name`, in any case. Raises LookupError, which lists the names there are."""
        names = [s.name for s in self.strings]
        for i, have in enumerate(names):
            if have.casefold() == name.casefold():
                return i
        raise LookupError(f"string {name!r}: this bass has {', '.join(names)}")


@dataclass(frozen=True)
class Pluck:
    """A pluck: a triangle, rounded by the finger and by a stiff string itself (model/modes.py), and its release."""

    apex: float  # m, height of the corner before rounding
    position: float  # m from the stop
    rounding: float = 5e-3  # m, standard deviation
    angle: float = 0.0  # rad, from u towards v
    release: float = 0.0  # s, how gradually the finger lets go
    speed: float = 0.0  # m/s, of the finger, and of the corner, as it lets go


@dataclass(frozen=True)
class Speaking:
    """The part of a string that sounds, from the pressed fret (or the nut) to the saddle, and its P obstacles."""

    string: String
    fret: int  # asked for; 0 is open
    stop: int  # fret the string rests on: one beyond `fret` if it stands so high that it chokes the note
    length: float  # m
    fundamental: float  # Hz, f0 of the frequency law: c / 2L
    inharmonicity: float  # B for this length
    grid_points: int  # N: `length` / N is the grid step dx
    contact_fret: tuple[int, ...]  # (P,) fret number of each obstacle; 0: wood
    contact_position: tuple[float, ...]  # (P,) x_m, m from the stop, on the grid
    contact_height: tuple[float, ...]  # (P,) g, m; negative: below the string at rest
    contact_stiffness: float  # K of eq. 6
    contact_exponent: float  # alpha of eq. 6
    admittance: Admittance  # of the neck at the stop
    friction: float  # N/m, A of eq. 7
    friction_speed: float  # m/s, s of eq. 7
    surface: Surface = ()  # of the board, in m from the stop and m above the string at rest

    @property
    def step(self) -> float:
        """Grid step dx, m."""
        return self.length / self.grid_points


def frets_from_geometry(
    length: float, count: int, action: float, relief: float, nut_height: float, lift: dict[int, float] | None = None
) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """Positions (m from the nut) and crown heights (m), each (count,), of the frets under a string of `length` (m).

    In m, `action` is the gap under the open string at fret 12, `nut_height` the gap at fret 1, `relief` the depth of
    the hollow between the first and the last fret, at its middle, and `lift` raises frets by number.
    """
    x = [length * (1 - 2 ** (-k / 12)) for k in range(1, count + 1)]
    where = [(xi - x[0]) / (x[-1] - x[0]) if count > 1 else 0.0 for xi in x]
    bow = [4 * relief * s * (1 - s) for s in where]
    pivot = min(12, count) - 1
    last = nut_height + (action - bow[pivot] - nut_height) / (where[pivot] or 1.0)
    gap = [nut_height + (last - nut_height) * s + b for s, b in zip(where, bow, strict=True)]
    raised = lift or {}
    return tuple(x), tuple(raised.get(k + 1, 0.0) - g for k, g in enumerate(gap))


def note_frequency(note: float) -> float:
    """Frequency (Hz) of a MIDI note number in equal temperament; fractions allowed."""
    return A4_HZ * 2.0 ** ((note - A4_NOTE) / 12)


@lru_cache(maxsize=1024)
def speaking(string: String, neck: Neck, fret: int) -> Speaking:
    """`string` over `neck`, stopped at `fret` (0: open), with the obstacles between the stop and the saddle.

    A note is in tune (`String.frequency`) wherever its fret is exactly, as a compensated saddle would do; one with an
    offset of its own has another tension. If a crown nearer the saddle stands above the line from the pressed fret to
    the saddle, the string rests on that crown. The neck shifts each mode by a different part (eq. 8): the first one is
    in tune.

    Raises ValueError for a fret the neck does not have, and if a fret or the board stands above the string at rest.
    """
    count = len(neck.fret_positions)
    if not 0 <= fret <= count:
        raise ValueError(f"fret {fret}: this neck has frets 0 to {count}")
    x, h, total = neck.fret_positions, neck.fret_heights, string.length
    stop = fret
    if fret:
        stop = max(range(fret, count + 1), key=lambda k: (h[k - 1] / (total - x[k - 1]), -k))
    string = _tuned_for(string, string.open_note + stop)
    x_stop, h_stop = (x[stop - 1], h[stop - 1]) if stop else (0.0, 0.0)
    length = total - x_stop
    points = max(8, round(length / neck.grid_step))
    step = length / points
    crowns = tuple(range(stop + 1, count + 1))
    heights = tuple(h[k - 1] - h_stop * (total - x[k - 1]) / length for k in crowns)
    places = tuple(round((x[k - 1] - x_stop) / step) * step for k in crowns)
    for k, height in zip(crowns, heights, strict=True):
        if height > ROUNDING:
            raise ValueError(f"fret {k} stands {height * 1e3:.2f} mm above string {string.name} at rest")
    surface = surface_beyond(neck.surface, x_stop, h_stop, total)
    stiffness = string.inharmonicity * (total / length) ** 2
    admittance = neck.admittance.moved(neck.capo + x_stop, neck.free_length or FREE_PART * total)
    if stop or neck.capo:
        admittance = replace(admittance, stop=neck.stop_conductance)
    if stop == 0 and string.law_fundamental:
        fundamental = string.law_fundamental
    else:
        note = string.frequency(string.open_note + stop)
        mass = 2 * string.linear_density * length  # kg
        mute = string.extra_damping / (2 * math.pi) + string.extra_damping_slope * note  # Hz
        if admittance.stop:
            mute += float(neck_damping(admittance.at(note), mass * note, note)) / (2 * math.pi)
        sounds = math.hypot(note, mute)  # tuned higher, as a damped mode rings lower than its eigenfrequency
        stretch = float(stretched(string.stiffness_law, stiffness, np.ones(1))[0])
        fundamental = _tuned(sounds, stretch, mass, admittance)
    s = Speaking(
        string=string,
        fret=fret,
        stop=stop,
        length=length,
        fundamental=fundamental,
        inharmonicity=stiffness,
        grid_points=points,
        contact_fret=crowns,
        contact_position=places,
        contact_height=tuple(min(height, 0.0) for height in heights),
        contact_stiffness=neck.contact_stiffness,
        contact_exponent=neck.contact_exponent,
        admittance=admittance,
        friction=neck.friction,
        friction_speed=neck.friction_speed,
        surface=surface,
    )
    return on_grid(s, points) if neck.surface else s


def tensioned(string: String, ratio: float) -> String:
    """`string` under the tension at which it sounds `ratio` times as high: T r^2, B / r^2, as E I stays.

    Measured modes follow nu^2 + (r^2 - 1) (j f0)^2, as tension is the only part of a mode's stiffness that changes;
    their damping stays.
    """
    square, f0 = ratio**2, string.law_fundamental or string.nominal_fundamental
    measured = (math.sqrt(nu**2 + (square - 1) * (j * f0) ** 2) for j, nu in enumerate(string.measured_frequencies, 1))
    return replace(
        string,
        tension=string.tension * square,
        inharmonicity=string.inharmonicity / square,
        law_fundamental=string.law_fundamental * ratio,
        measured_frequencies=tuple(measured),
    )


def _tuned_for(string: String, note: int) -> String:
    """`string` as its open note would have to be tuned for `note` to have its own offset."""
    if not string.offsets:
        return string
    cents = string.offsets[note % 12] - string.offsets[string.open_note % 12]
    return tensioned(string, 2.0 ** (cents / 1200)) if cents else string


def on_grid(s: Speaking, points: int) -> Speaking:
    """`s` over its board on a grid of `points` steps, with a contact point wherever there is board.

    Contact with a board needs a grid with one step more than there are modes: then Phi Phi^T is diagonal, and the force
    at each point has an equation of its own (eq. 12). A fret is the grid point next to it. Raises ValueError if the
    board stands above the string at rest.
    """
    step = s.length / points
    place, height = surface_on_grid(s.surface, s.length, points)
    for x, h in zip(place.tolist(), height.tolist(), strict=True):
        if h > BOARD_ROUGH:
            why = f"the board stands {h * 1e3:.2f} mm above string {s.string.name} at rest, {x * 1e3:.0f} mm from"
            raise ValueError(f"{why} {f'fret {s.stop}' if s.stop else 'the nut'}")
    frets = np.zeros(place.size, np.int64)
    for x, fret in zip(s.contact_position, s.contact_fret, strict=True):
        k = round((x - place[0]) / step) if fret and place.size else -1
        if 0 <= k < place.size:
            frets[k] = fret
    return replace(
        s,
        grid_points=points,
        contact_fret=tuple(frets.tolist()),
        contact_position=tuple(place.tolist()),
        contact_height=tuple(np.minimum(height, 0.0).tolist()),
    )


def for_modes(s: Speaking, count: int) -> Speaking:
    """`s` on the grid that `count` modes need: over a board one of count + 1 steps, over frets `s` as it is."""
    return on_grid(s, count + 1) if s.surface and count + 1 != s.grid_points else s


def stretched(law: str, inharmonicity: float, mode: Floats) -> Floats:
    """Returns nu_j / (j f0) of modes `mode` (n,) on a rigid neck, (n,); law: a `String.stiffness_law`.

    "hinged": sqrt(1 + B j^2), the stiff string on hinges (Fletcher 1964). "paper": 1 + B j^2 / 2, eq. 8 as printed, a
    fit to one G string that holds for B j^2 below about 0.04.
    """
    square = inharmonicity * mode**2
    return np.asarray(1 + square / 2 if law == "paper" else np.sqrt(1 + square))


def _tuned(sounds: float, stretch: float, mass: float, admittance: Admittance) -> float:
    """f0 (Hz) for a first mode at `sounds` (Hz). mass: 2 mu L, kg, so that mu c is mass times f0.

    stretch: nu_1 / f0 on a rigid neck.
    """
    fundamental = sounds / stretch
    if not admittance:
        return fundamental
    for _ in range(8):  # fixed-point iteration; each pass gains digits, as the neck's part is small
        aside = float(detuning(admittance.at(fundamental), mass * fundamental, 1))
        aside = min(max(aside, -MOST_DETUNING), MOST_DETUNING)
        before, fundamental = fundamental, sounds / (stretch + aside)
        if abs(fundamental / before - 1) < 1e-12:
            break
    return fundamental
