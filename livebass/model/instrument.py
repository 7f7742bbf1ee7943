"""An electric bass as frozen values in SI units: strings, necks, pickups, player, and a string stopped at a fret.

Axes: x runs along the string from the nut (0) to the saddle (`length`), u points up, away from the neck, and v across,
along the frets. The open string at rest is u = 0; a fret crown below it has a negative height. Equation numbers:
Issanchou et al. (2018).
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property, lru_cache
from types import SimpleNamespace

import numpy as np

from livebass.arrays import Floats
from livebass.kernels.bass import bench
from livebass.kernels.bass.bench import BOARD_ROUGH
from livebass.kernels.string import law as modal
from livebass.model.keymap import MODO, PLACE, Curve, KeyMap
from livebass.model.neck import FREE_PART, Admittance, Surface, flat, rows_of, surface_on_grid

A4_NOTE, A4_HZ = 69, 440.0
STIFFNESS_LAWS = ("hinged", "paper")  # see model/modes.py
STROKES = ("finger", "pick", "nail", "pop")  # in the order of the performer's numbers
ANSWERING = ("off", "pedal", "always")  # likewise


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
    stiffness_law: str = "hinged"  # or "paper": how B acts on partials, losses and the held shape, see model/modes.py
    viscoelastic_angle: float = 0.01  # delta_ve of eq. 11
    thermoelastic: float = 6e-6  # 1/Q_te of eq. 9
    extra_damping: float = 0.0  # 1/s, added to every mode: mute, tape, palm
    extra_damping_slope: float = 0.0  # dimensionless, 1/s added per rad/s of the mode
    level: float = 1.0  # how strongly pickups sense it: its steel, and how high their poles are set
    axial_stiffness: float = 0.0  # N, E A: large motion stretches the string, which raises its tension; 0: it does not
    winding: float = 0.0  # m, pitch of a round winding, on which a finger that slides squeaks; 0: it is flat or plain
    law_fundamental: float = 0.0  # Hz, f0 of the law of partials if measured; 0: from open_note
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
    contact_stiffness: float = 1e13  # K of eq. 6, SI: force per unit length on one `grid_step`
    contact_exponent: float = 1.5  # alpha of eq. 6
    grid_step: float = 1e-3  # m, dx: frets sit on this grid, and a fret pushes on one step of it
    admittance: Admittance = field(default_factory=Admittance)  # Y_nut of eqs. 8 and 9
    free_length: float = 0.0  # m, from the nut to the body; 0: FREE_PART of the scale
    stop_conductance: float = 0.0  # m/s/N, of a fret and the finger behind it; added to Re Y of stopped notes
    friction: float = 900.0  # N/m, A of eq. 7: force per unit length on one `grid_step`
    friction_speed: float = 1e-5  # m/s, s of eq. 7
    surface: Surface = ()  # board under the string, crowns included; empty: the string can touch the crowns only
    fretless: bool = False  # the fret positions are but places where notes are stopped
    capo: float = 0.0  # m from the nut to a capo: places count from it, heights from the string that it stops; 0: none


@dataclass(frozen=True)
class Coil:
    """The circuit of a pickup: its coil, volume and tone pots, and the cable."""

    inductance: float = 4.0  # H
    resistance: float = 7500.0  # ohm
    capacitance: float = 600e-12  # F, winding and cable
    volume_pot: float = 250e3  # ohm
    tone_pot: float = 250e3  # ohm, full resistance
    tone_capacitor: float = 47e-9  # F
    tone: float = 1.0  # position of the tone pot, 0 (closed) to 1 (open)


@dataclass(frozen=True)
class Pickup:
    """A magnetic pickup under all strings, or under some, as half of a split coil is."""

    position: float  # m from the saddle
    aperture: float = 0.02  # m, length of string it senses
    decay_length: float = 4e-3  # m: the flux gradient falls e times when the string rises by this
    level: float = 1.0  # in the mix; negative: reversed
    across: float = 0.15  # sensitivity to v over that to u: the field changes less along the frets
    strings: tuple[str, ...] = ()  # names of those it senses; empty: all


@dataclass(frozen=True)
class Output:
    """How the motion of the strings becomes a signal: through pickups, or as the displacement at a sensor."""

    kind: str = "pickups"  # or "displacement"
    pickups: tuple[Pickup, ...] = (Pickup(0.09),)
    coil: Coil = field(default_factory=Coil)
    sensor: float = 0.009  # m from the saddle, for u in "displacement"
    sensor_v: float = 0.018  # m from the saddle, for v
    across: float = 0.0  # level of v in "displacement"
    gain: float = 1.0  # signal per m/s of the pickups, or per m of displacement


@dataclass(frozen=True)
class Pick:
    """A pick of the player's own; where a number is None it is as the usual pick."""

    soft_width: float | None = None  # m, half of what touches the string, at the softest ...
    hard_width: float | None = None  # ... and at the hardest
    soft_release: float | None = None  # s, how gradually it lets go, likewise
    hard_release: float | None = None
    place: float | None = None  # over the body, fraction of the open string from the nut
    angle: float | None = None  # rad, of its pull, from straight away from the neck
    nearer: float | None = None  # m: the hardest strokes are nearer to the saddle than the softest
    lift: float | None = None  # how far it lifts the string from the neck, over a finger


@dataclass(frozen=True)
class Player:
    """How notes become plucks. Strengths are forces of the hand over that by which the open string grazes a fret."""

    technique: str = "pluck"  # or "slap": the thumb strikes the lower strings, a finger pops those above
    pick: Pick = Pick()
    stroke: str = "finger"  # or "pick", "nail", "pop", which have widths and release times of their own
    slapped_strings: int = 0  # number of strings, from the lowest, that the thumb strikes
    pluck_position: float = 0.74  # place over the body, fraction of the open string from the nut
    pluck_nearest: float = 0.55  # the same for controller value 0 ...
    pluck_farthest: float = 0.93  # ... and 127
    nearer_when_hard: float = 0.0  # m, the hardest notes are plucked nearer to the saddle than the softest
    rounding: float = 5e-3  # m, standard deviation of the Gaussian that rounds the corner, at velocity 127 ...
    rounding_soft: float = 0.0  # ... and at velocity 1; 0: the same
    release_time: float = 0.0  # s, how gradually the finger lets go (modes.pluck_amplitudes), at velocity 127 ...
    release_time_soft: float = 0.0  # ... and at velocity 1; 0: the same
    release_speed: float = 0.0  # m/s of the finger as it lets go at `greatest_apex`; in proportion to the apex
    pluck_angle: float = 0.0  # rad, of the pull, from straight away from the neck
    softest: float = 0.08  # force of a pluck at velocity 1 ...
    hardest: float = 4.5  # ... and at velocity 127
    greatest_apex: float = 0.010  # m, approached but never exceeded
    unevenness: float = 0.0  # notes differ by up to this part in strength and by this times 10 cm in place
    strike_position: float = 0.68  # place of the thumb over the body, as pluck_position
    strike_force: float = 1.0  # depth of a strike over the apex of a pluck of the same velocity
    strike_width: float = 0.02  # m, of the thumb
    strike_time: float = 1.5e-3  # s the thumb stays on the string
    thumb_mass: float = 0.0  # kg, of a thumb that bounces; 0: the strike is an impulse of the three above
    strike_softest: float = 0.5  # m/s, of a thumb with a mass at velocity 1 ...
    strike_hardest: float = 3.5  # ... and at velocity 127
    thumb_width: float = 5e-3  # m, half of what touches the string
    thumb_stiffness: float = 7e5  # N/m^1.5, of its contact with the string
    thumb_loss: float = 0.35  # s/m, of that contact
    pull_time: float = 2e-3  # s the finger takes to displace the string before it lets go
    hand_damping: float = 90.0  # 1/s, by the hand that stops a note
    answering: str = "off"  # or "pedal", "always": when idle strings may answer those that sound
    bend_range: float = 2.0  # semitones
    out_of_range: str = "transpose"  # or "drop": what becomes of notes the bass does not have
    position_controller: int = PLACE  # MIDI controller of the pluck position, besides that of `keys`
    keys: KeyMap = MODO  # what MIDI keys below the notes, and controllers, do
    velocity_curve: Curve = "linear"  # how hard a velocity is played: model/keymap.py
    ghost_below: int = 0  # notes of a velocity below are ghost notes
    wheel: str = "bend"  # or "slide": the pitch wheel slides along the frets


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

    @cached_property
    def note(self) -> SimpleNamespace:
        """The numbers of its NOTE (kernels/string/preparing.py), without the lists, for the law of the modes."""
        string, paper = self.string, int(self.string.stiffness_law == "paper")
        measured = self.stop == 0 and string.law_fundamental
        return SimpleNamespace(
            grid_points=self.grid_points,
            paper_law=paper,
            length=self.length,
            fundamental=self.fundamental,
            damped_fundamental=string.nominal_fundamental if measured else self.fundamental,
            clamp=float(modal.clamped_mode(self.length)),
            inharmonicity=self.inharmonicity,
            linear_density=string.linear_density,
            diameter=string.diameter,
            tension=string.tension,
            bending=modal.bending_stiffness(string.inharmonicity, string.tension, string.length),
            viscoelastic_angle=string.viscoelastic_angle,
            thermoelastic=string.thermoelastic,
            extra_damping=string.extra_damping,
            extra_damping_slope=string.extra_damping_slope,
            held_stiffness=modal.held_part(paper, self.inharmonicity, self.length),
            contact_stiffness=self.contact_stiffness,
            contact_exponent=self.contact_exponent,
            friction=self.friction,
            friction_speed=self.friction_speed,
            stop=self.admittance.stop,
        )


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
    in tune. kernels/bass/bench.py makes the note.

    Raises ValueError for a fret the neck does not have, and if a fret or the board stands above the string at rest.
    """
    count = len(neck.fret_positions)
    if not 0 <= fret <= count:
        raise ValueError(f"fret {fret}: this neck has frets 0 to {count}")
    given, numbers = on_bench(string, neck)
    note, lists = SimpleNamespace(), [0.0] * (3 * len(numbers) + 2)
    stop, state, crown, height, behind = bench.make_note(given, numbers, fret, note, lists, 0)
    if state != bench.MADE:
        raise ValueError(f"fret {crown} stands {height * 1e3:.2f} mm above string {string.name} at rest")
    surface = rows_of(lists, note.surface, note.surface_count)
    bench.set_obstacles(given, numbers, stop, note, lists, behind)  # over a board, too
    obstacles = rows_of(lists, behind, note.obstacles_count)
    first = given.parts + stop * (len(neck.admittance.resonances) + 1)
    s = Speaking(
        string=_tuned_for(string, string.open_note + stop),
        fret=fret,
        stop=stop,
        length=note.length,
        fundamental=float(note.fundamental),
        inharmonicity=note.inharmonicity,
        grid_points=note.grid_points,
        contact_fret=tuple(range(stop + 1, count + 1)),
        contact_position=tuple(x for x, _ in obstacles),
        contact_height=tuple(h for _, h in obstacles),
        contact_stiffness=neck.contact_stiffness,
        contact_exponent=neck.contact_exponent,
        admittance=_felt(neck.admittance, numbers[first:], note, lists),
        friction=neck.friction,
        friction_speed=neck.friction_speed,
        surface=surface,
    )
    return on_grid(s, s.grid_points) if neck.surface else s


@lru_cache(maxsize=256)
def on_bench(string: String, neck: Neck, answering: bool = False) -> tuple[SimpleNamespace, list[float]]:
    """`string` and `neck` as a BENCH_STRING, and the numbers of its lists; without taps.

    answering: with what strings need that answer each other.
    """
    numbers: list[float] = []
    given = SimpleNamespace(answering_modes=0, tap_width=1, capo=int(neck.capo > 0))
    given.paper_law = int(string.stiffness_law == "paper")
    for source, names in ((string, FROM_STRING), (neck, FROM_NECK)):
        vars(given).update({name: getattr(source, name) for name in names})
    y, free = neck.admittance, neck.free_length or FREE_PART * string.length
    given.nut_conductance = y.stop
    places, taken = (0.0, *neck.fret_positions), len(y.resonances) + 1
    felt = [y.parts(neck.capo + x, free) if neck.capo + x else (1.0,) * taken for x in places]
    lists: dict[str, Iterable[tuple[float, ...]]] = {
        "pitches": [
            (string.frequency(n), _ratio(string, n)) for n in range(string.open_note, string.open_note + len(places))
        ],
        "frets": zip(neck.fret_positions, neck.fret_heights, strict=True),
        "resonances": ((r.frequency, r.quality, r.mass) for r in y.resonances),
        "parts": ((part**2,) for row in felt for part in row),
        "nut_parts": (
            (part,) for x in places * answering for part in y.parts(string.length - (string.length - x), free)
        ),
        "table": y.table,
        "frequencies": ((nu,) for nu in string.measured_frequencies),
        "dampings": ((sigma,) for sigma in string.measured_dampings),
        "surface": neck.surface,
        "taps": (),
    }
    for name, rows in lists.items():
        listed = list(rows)
        vars(given).update({name: len(numbers), f"{name}_count": len(listed)})
        numbers.extend(flat(listed))
    return given, numbers


FROM_STRING = (
    "length", "linear_density", "tension", "diameter", "inharmonicity", "viscoelastic_angle", "thermoelastic",
    "extra_damping", "extra_damping_slope", "law_fundamental",
)  # fmt: skip
FROM_NECK = ("contact_stiffness", "contact_exponent", "friction", "friction_speed", "grid_step", "stop_conductance")


def _felt(y: Admittance, parts: Sequence[float], note: SimpleNamespace, lists: list[float]) -> Admittance:
    """The admittance at the stop of `note`, of a neck with `y` at its nut; `parts` of y are felt there."""
    felt = (r for r, part in zip(y.resonances, parts, strict=False) if part)
    masses = lists[note.resonances + 2 : note.resonances + 3 * note.resonances_count : 3]
    table = [tuple(lists[k : k + 3]) for k in range(note.table, note.table + 3 * note.table_count, 3)]
    resonances = tuple(replace(r, mass=mass) for r, mass in zip(felt, masses, strict=True))
    return Admittance(resonances, tuple(table), note.stop)  # type: ignore[arg-type]


def tensioned(string: String, ratio: float) -> String:
    """`string` under the tension at which it sounds `ratio` times as high: T r^2, B / r^2, as E I stays.

    Measured modes follow nu^2 + (r^2 - 1) (j f0)^2, as tension is the only part of a mode's stiffness that changes;
    their damping stays.
    """
    square, f0 = ratio * ratio, string.law_fundamental or string.nominal_fundamental
    tension, inharmonicity = bench.under_tension(string.tension, string.inharmonicity, ratio)
    measured = (math.sqrt(nu**2 + (square - 1) * (j * f0) ** 2) for j, nu in enumerate(string.measured_frequencies, 1))
    return replace(
        string,
        tension=tension,
        inharmonicity=inharmonicity,
        law_fundamental=string.law_fundamental * ratio,
        measured_frequencies=tuple(measured),
    )


def _ratio(string: String, note: int) -> float:
    """How many times as high `string` must be tuned for `note` to have its own offset."""
    if not string.offsets:
        return 1.0
    cents = string.offsets[note % 12] - string.offsets[string.open_note % 12]
    return 2.0 ** (cents / 1200) if cents else 1.0


def _tuned_for(string: String, note: int) -> String:
    """`string` as its open note would have to be tuned for `note` to have its own offset."""
    ratio = _ratio(string, note)
    return tensioned(string, ratio) if ratio != 1.0 else string


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
    for x, number in zip(s.contact_position, s.contact_fret, strict=True):
        k = round((x - place[0]) / step) if number and place.size else -1
        if 0 <= k < place.size:
            frets[k] = number
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
    return np.asarray(modal.stretched(law == "paper", inharmonicity, mode))
