"""An electric bass as frozen values in SI units: strings, necks, pickups, player, and a string stopped at a fret.

Axes: x runs along the string from the nut (0) to the saddle (`length`), u points up, away from the neck, and v across,
along the frets. The open string at rest is u = 0; a fret crown below it has a negative height. Equation numbers:
Issanchou et al. (2018).
"""

from __future__ import annotations

import math
from array import array
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property, lru_cache
from types import SimpleNamespace
from typing import Any

import numpy as np

from livebass.kernels.string import law as modal_law
from livebass.kernels.string.note import BOARD_ROUGH, MADE, gap_under, make_note, set_obstacles, under_tension
from livebass.model.exact import exp2
from livebass.model.keymap import MODO, Curve, KeyMap
from livebass.model.neck import FREE_PART, Admittance, Surface, flat, rows_of, surface_on_grid, wooden_surface
from livebass.rows.arrays import Floats
from livebass.rows.parts import STROKES as STROKES
from livebass.rows.parts import Coil as Coil
from livebass.rows.parts import Knobs, NeckNumbers, NoteNumbers, PlayerNumbers, StringNumbers
from livebass.rows.parts import Pick as Pick
from livebass.rows.row import choice, number, rows
from livebass.rows.techniques import TOP_KEYS

A4_NOTE, A4_HZ = 69, 440.0
LOG_PRESSED = -13.287712379549449  # log2 of 1e-4, m: the penetration at which `Neck.contact_loss` applies
STIFFNESS_LAWS = ("hinged", "paper")  # see model/modes.py


@dataclass(frozen=True)
class String(StringNumbers):
    """One open string between nut and saddle: sections 2.1 and 2.2."""

    name: str
    open_note: int  # MIDI note number
    length: float  # m, nut to saddle
    stiffness_law: str = choice("hinged", STIFFNESS_LAWS, "hinged: f0 j sqrt(1 + B j^2); paper: eq. 8, B j^2 < 0.04")
    measured_frequencies: tuple[float, ...] = ()  # Hz, of the first modes of the open string
    measured_dampings: tuple[float, ...] = ()  # 1/s, of the same modes
    offsets: tuple[float, ...] = ()  # cents, (12,): notes relative to equal temperament at A4_HZ, C first; empty: 0
    slack: float = 1.0  # pull of a given force, relative to before tuning
    own_note: int | None = None  # open note before tuning and capo; None: open_note
    shifted: int = 0  # semitones by which the bench has tuned it ...
    retuned: float = 1.0  # ... and the factor of its pitch

    def frequency(self, note: int) -> float:
        """Frequency (Hz) of a MIDI note number as tuned on this string."""
        return self.frequency_before(note - self.shifted) * self.retuned

    def frequency_before(self, note: int) -> float:
        """`frequency` before the bench tuned the string."""
        hertz = note_frequency(note)
        return hertz * exp2(self.offsets[note % 12] / 1200) if self.offsets else hertz

    @property
    def called(self) -> int:
        """Pitch class of its key switch: its open note before tuning and capo."""
        return (self.open_note if self.own_note is None else self.own_note) % 12

    @property
    def nominal_fundamental(self) -> float:
        """c / 2L of the open string, Hz."""
        return math.sqrt(self.tension / self.linear_density) / (2 * self.length)


@dataclass(frozen=True)
class Neck(NeckNumbers):
    """The frets or the board under one string, the law of contact with them (eq. 6), and how the neck yields."""

    fret_positions: tuple[float, ...]  # m from the nut, ascending, fret 1 first
    fret_heights: tuple[float, ...]  # m relative to the open string at rest, negative is below
    admittance: Admittance = field(default_factory=Admittance)  # Y_nut of eqs. 8 and 9
    surface: Surface = ()  # board under the string, crowns included; empty: the string can only touch the crowns
    fretless: bool = False  # the fret positions only mark where notes are stopped
    capo: float = 0.0  # m from the nut to a capo: places count from it, heights from its stopped string; 0: none

    def fret_text(self, *frets: int, board: str = "the board") -> str:
        """Names frets, as "fret 9" or "frets 5 to 8, 12"; without frets, the places that they stand for.

        These are "the board 412 mm from the nut", or from the capo; `board`: the words before the place.
        """
        from livebass.report.text import run_text  # imports csv, which playing does not need

        if not self.fretless:
            return f"fret{'s' * (len(frets) > 1)} {run_text(frets)}"
        end = "the capo" if self.capo else "the nut"
        return f"{board} {run_text(frets, self._place_text)} mm from {end}".lstrip()

    def note_text(self, fret: int) -> str:
        """Names the note at a fret, 0 for the open string: "open", "fret 9" or "at 412 mm from the nut"."""
        return self.fret_text(fret, board="at") if fret else "open"

    def stop_text(self, fret: int) -> str:
        """Names the end of a string that is stopped at a fret, 0 for the open string: the nut, a fret or the stop."""
        return self.fret_text(fret, board="the stop") if fret else "the nut"

    def _place_text(self, fret: int) -> str:
        return f"{self.fret_positions[fret - 1] * 1e3:.0f}" if fret else "0"

    @property
    def pressing(self) -> float:
        """The force that presses the string by 0.1 mm into a fret, N."""
        return self.contact_stiffness * self.grid_step * exp2(self.contact_exponent * LOG_PRESSED)

    @property
    def loss(self) -> float:
        """The loss c of Hunt and Crossley, s/m: f = K eta^alpha (1 + c eta') resists by `contact_loss` at 0.1 mm."""
        return self.contact_loss / self.pressing

    @property
    def own_across(self) -> bool:
        """True if motion across has a law of its own."""
        return (self.stiffness_across, self.stop_across, self.longer_across) != (1.0, 1.0, 0.0)


@dataclass(frozen=True)
class Pickup:
    """A magnetic pickup under all strings or some, such as half of a split coil."""

    position: float  # m from the saddle
    aperture: float = number(0.02, "length", "0 mm", "100 mm", "length of string it senses")
    decay_length: float = number(4e-3, "length", "0.5 mm", "50 mm", "height over which its field falls by a factor e")
    level: float = number(1.0, "number", "-10", "10", "in the mix; negative: reversed")
    across: float = number(
        0.3, "number", "-10", "10", "how strongly it senses sideways motion, relative to motion up", of="across"
    )  # the field changes less along the frets
    strings: tuple[str, ...] = ()  # names of the strings it senses; empty: all

    def senses(self, name: str) -> bool:
        """True if it is under the string called `name`."""
        return not self.strings or name in self.strings


@dataclass(frozen=True)
class Output:
    """Turns the motion of the strings into a signal: through pickups, or as the displacement at a sensor."""

    kind: str = choice("pickups", ("pickups", "displacement"), "magnetic pickups, or displacement at the sensor")
    pickups: tuple[Pickup, ...] = (Pickup(0.09),)
    coil: Coil = field(default_factory=Coil)
    sensor: float = number(0.009, "length", "1 mm", "500 mm", "displacement sensor, from the saddle", of="sensor")
    sensor_v: float = number(0.018, "length", "1 mm", "500 mm", "the same for sideways motion", of="sensor across")
    across: float = number(0.0, "number", "-10", "10", "level of sideways motion in displacement", of="sensor across")
    gain: float = number(1.0, "number", "0", "1e9", "signal per volt, or per metre of displacement")


@dataclass(frozen=True, kw_only=True)
class Player(PlayerNumbers):
    """Turns notes into plucks. Strengths are forces of the hand: 1 makes the open string graze a fret."""

    pick: Pick = field(default_factory=Pick)
    keys: KeyMap = MODO  # functions of MIDI controllers and of keys below the notes
    velocity_curve: Curve = "linear"  # from velocity to force: model/keymap.py


@dataclass(frozen=True)
class Response:
    """An impulse response, of a cabinet or a room."""

    rate: int  # Hz
    samples: bytes = field(repr=False)  # float64, unchanged from the file; 1: as loud as without it
    normalized: bool = False  # scaled to leave the loudness of a bass unchanged
    remark: str = field(default="", compare=False)  # one line for the player about how the file was read

    @property
    def count(self) -> int:
        """Number of samples."""
        return len(self.samples) // 8

    @cached_property
    def played(self) -> bytes:
        """The samples to play, float64."""
        return self.cut(True) if self.normalized else self.samples

    def cut(self, normalized: bool = False) -> bytes:
        """The samples without silence, float64; `normalized`: scaled to leave the loudness of a bass unchanged.

        If the response lasts too long, or is `normalized`, everything before the sound counts as silence, too.
        """
        from livebass.kernels.effects.response import cut_response

        samples = array("d", self.samples)
        place, count = samples.buffer_info()
        return samples[: cut_response(place, count, float(self.rate), int(normalized))].tobytes()


@dataclass(frozen=True)
class Effects(Knobs):
    """The effects on the mix of all strings after the DI: compressor, valve stage, impulse response. Default: off."""

    response: Response | None = None


@dataclass(frozen=True)
class Instrument:
    """A bass: strings from the lowest to the highest, a neck for each, output and player."""

    name: str
    description: str
    strings: tuple[String, ...]
    necks: tuple[Neck, ...]
    output: Output
    player: Player
    a4: float = A4_HZ  #: Hz, of the A above middle C
    effects: Effects = field(default_factory=Effects)
    grazed: tuple[Neck, ...] = ()  #: grazed by the player's force 1, one per string; empty: its own
    played: tuple[tuple[str, float], ...] = ()  #: parameters that play it (techniques.py), by symbol, and their values

    @property
    def switches(self) -> frozenset[int]:
        """The keys that switch instead of sounding: those in its map outside its notes, or that override notes."""
        keys = self.player.keys
        return frozenset(k for k, *_ in keys.keys if keys.over_notes or not self.note_range[0] <= k < TOP_KEYS)

    @property
    def frets(self) -> int:
        """The highest fret that every string has."""
        return min(len(neck.fret_positions) for neck in self.necks)

    @property
    def note_range(self) -> tuple[int, int]:
        """Its lowest and highest MIDI note: every string plays up to the highest fret that all have."""
        return self.strings[0].open_note, max(string.open_note for string in self.strings) + self.frets

    @property
    def loss(self) -> float:
        """The least `Neck.loss`, s/m, of all strings, or of the strings over a board, if any."""
        return min(neck.loss for neck in self.necks if bool(neck.surface) == self.over_board)

    @property
    def over_board(self) -> bool:
        """True if any string lies over a board instead of frets."""
        return any(neck.surface for neck in self.necks)

    def string_index(self, name: str) -> int:
        """Returns the index of the string called `name`, in any case.

        Raises:
            LookupError: There is no such string; the message lists the names.
        """
        names = [s.name for s in self.strings]
        for i, have in enumerate(names):
            if have.casefold() == name.casefold():
                return i
        raise LookupError(f"string {name!r}: this bass has {', '.join(names)}")

    def neck(self, name: str) -> Neck:
        """Returns the neck under the string called `name`, in any case. Raises LookupError, as `string_index`."""
        return self.necks[self.string_index(name)]


@dataclass(frozen=True)
class Pluck:
    """A pluck: a triangle, rounded by the finger and by a stiff string itself (model/modes.py), and its release."""

    apex: float  # m, height of the corner before rounding
    position: float  # m from the stop
    rounding: float = 5e-3  # m, standard deviation
    angle: float = 0.0  # rad, from u towards v
    release: float = 0.0  # s, how gradually the finger lets go
    speed: float = 0.0  # m/s, of the finger, and of the corner, as it lets go


@dataclass(frozen=True, kw_only=True)
class Speaking(NoteNumbers):
    """The sounding part of a string, from the pressed fret (or the nut) to the saddle, and its P obstacles."""

    string: String
    fret: int  # as requested; 0 is open
    stop: int  # fret at which it ends: `fret`, or on a board a place beyond that is high enough to choke the note
    contact_fret: tuple[int, ...]  # (P,) fret number of each obstacle; 0: wood
    contact_position: tuple[float, ...]  # (P,) x_m, m from the stop, on the grid
    contact_height: tuple[float, ...]  # (P,) g, m; positive: above the line from the stop, it carries the string
    admittance: Admittance  # of the neck at the stop
    admittance_across: Admittance  # the same for motion across, if `own_across`
    surface: Surface = ()  # of the board, in m from the stop and m above the string at rest

    def felt(self, across: bool) -> Admittance:
        """The admittance of the neck at the stop for u, or for v, if `across`."""
        return self.admittance_across if across and self.own_across else self.admittance

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
    x = [length * (1 - exp2(-k / 12)) for k in range(1, count + 1)]
    rows = flat((xi, 0.0) for xi in x)
    gap = [gap_under(rows, 0, count, k, action, relief, nut_height) for k in range(count)]
    raised = lift or {}
    return tuple(x), tuple(raised.get(k + 1, 0.0) - g for k, g in enumerate(gap))


def tilt(x: Sequence[float], heights: Sequence[float], action: float) -> tuple[float, ...]:
    """Tilts measured `heights` (n,) of frets at `x` (n,), all in m, about the first fret to another `action`."""
    pivot = min(12, len(x)) - 1
    reach = (x[pivot] - x[0]) or 1.0
    lower = action + heights[pivot]
    return tuple(h - lower * (xi - x[0]) / reach for xi, h in zip(x, heights, strict=True))


def note_frequency(note: float) -> float:
    """Frequency (Hz) of a MIDI note number in equal temperament; fractions allowed."""
    return A4_HZ * exp2((note - A4_NOTE) / 12)


@lru_cache(maxsize=1024)
def speaking(string: String, neck: Neck, fret: int) -> Speaking:
    """`string` over `neck`, stopped at `fret` (0: open), with the obstacles between the stop and the saddle.

    A note is in tune (`String.frequency`) wherever its fret lies, as with a compensated saddle; a note with an offset
    of its own gets another tension. If a crown nearer the saddle stands above the line from the pressed fret to the
    saddle, the string lies on that crown (model/rest.py); on a board it ends there. The neck shifts each mode
    differently (law.py): the first one is in tune.
    kernels/string/note.py computes the note.

    Raises ValueError for a fret the neck does not have, and if a fret stands above the open string at rest, or the
    board above the sounding one.
    """
    count = len(neck.fret_positions)
    if not 0 <= fret <= count:
        raise ValueError(f"fret {fret}: this neck has {'places' if neck.fretless else 'frets'} 0 to {count}")
    given, numbers = on_bench(string, neck)
    note, lists = SimpleNamespace(), [0.0] * (3 * len(numbers) + 2)
    stop, state, crown, height, behind = make_note(given, numbers, fret, note, lists, 0)
    if state != MADE:
        raise ValueError(f"{neck.fret_text(crown)} stands {height * 1e3:.2f} mm above string {string.name} at rest")
    surface = rows_of(lists, note.surface, note.surface_count)
    set_obstacles(given, numbers, stop, note, lists, behind)  # over a board, too
    obstacles = rows_of(lists, behind, note.obstacles_count)
    first = given.parts + stop * (len(neck.admittance.resonances) + 1)
    law: dict[str, Any] = {
        name: (int if row.kind == "integer" else float)(getattr(note, name)) for name, row in rows(NoteNumbers).items()
    }
    s = Speaking(
        string=_tuned_for(string, string.open_note + stop),
        fret=fret,
        stop=stop,
        contact_fret=tuple(range(stop + 1, count + 1)),
        contact_position=tuple(x for x, _ in obstacles),
        contact_height=tuple(h for _, h in obstacles),
        admittance=_admittance_at_stop(neck.admittance, numbers[first:], note, lists),
        admittance_across=_admittance_at_stop(neck.admittance, numbers[first:], note, lists, across=True),
        surface=surface,
        **law,
    )
    return on_grid(s, s.grid_points, neck.stop_text(s.stop)) if neck.surface else s


@lru_cache(maxsize=256)
def on_bench(string: String, neck: Neck, answering: bool = False) -> tuple[SimpleNamespace, list[float]]:
    """`string` and `neck` as a BENCH_STRING, and the numbers of its lists; without taps.

    answering: include the numbers that answering strings need.
    """
    numbers: list[float] = []
    given = SimpleNamespace(answering_modes=0, tap_width=1, length=string.length, capo=int(neck.capo > 0))
    vars(given).update({name: getattr(string, name) for name in rows(StringNumbers)})
    vars(given).update({name: getattr(neck, name) for name in rows(NeckNumbers)})
    given.contact_loss = neck.loss
    given.own_across, given.higher_across = int(neck.own_across), math.sqrt(neck.stiffness_across)
    given.stop_conductance_across = neck.stop_conductance * neck.stop_across
    given.paper_law = int(string.stiffness_law == "paper")
    y, free = neck.admittance, neck.free_length or FREE_PART * string.length
    given.nut_conductance, given.bowed = y.stop, int(_is_bowed(neck))
    places, taken = (0.0, *neck.fret_positions), len(y.resonances) + 1
    felt = [y.parts(neck.capo + x, free) if neck.capo + x else (1.0,) * taken for x in places]
    lists: dict[str, Iterable[tuple[float, ...]]] = {
        "pitches": [
            (string.frequency(n), _ratio(string, n)) for n in range(string.open_note, string.open_note + len(places))
        ],
        "frets": zip(neck.fret_positions, neck.fret_heights, strict=True),
        "resonances": ((r.frequency, r.quality, r.mass) for r in y.resonances),
        "bending": ((float(r.shape > 0),) for r in y.resonances),
        "parts": ((part * part,) for row in felt for part in row),
        "nut_parts": (
            (part,) for x in places * answering for part in y.parts(string.length - (string.length - x), free)
        ),
        "table": y.table,
        "frequencies": ((nu,) for nu in string.measured_frequencies),
        "dampings": ((sigma,) for sigma in string.measured_dampings),
        "surface": neck.surface,
        "taps": (),
    }
    for name, of in lists.items():
        listed = list(of)
        vars(given).update({name: len(numbers), f"{name}_count": len(listed)})
        numbers.extend(flat(listed))
    return given, numbers


def _is_bowed(neck: Neck) -> bool:
    """True for a bare board along the parabola of its places, as boards by geometry are."""
    x, h = neck.fret_positions, neck.fret_heights
    return len(x) > 2 and bool(neck.surface) and neck.surface == wooden_surface(x, h, neck.surface[-1][0], bowed=True)


def _admittance_at_stop(
    y: Admittance, parts: Sequence[float], note: SimpleNamespace, lists: list[float], across: bool = False
) -> Admittance:
    """The admittance at the stop of `note`, on a neck with `y` at its nut; `parts`: fractions of y felt there."""
    own = across and note.own_across
    first, count = (
        (note.resonances_across, note.resonances_across_count) if own else (note.resonances, note.resonances_count)
    )
    row, rows = (note.table_across, note.table_across_count) if own else (note.table, note.table_count)
    felt = [r for r, part in zip(y.resonances, parts, strict=False) if part]
    numbers = [lists[k : k + 3] for k in range(first, first + 3 * count, 3)]
    table = tuple(tuple(lists[k : k + 3]) for k in range(row, row + 3 * rows, 3))
    resonances = tuple(replace(r, frequency=f, mass=m) for r, (f, _, m) in zip(felt, numbers, strict=True))
    return Admittance(resonances, table, note.stop_across if own else note.stop)  # type: ignore[arg-type]


def tension_string(string: String, ratio: float) -> String:
    """`string` tensioned to sound `ratio` times as high: T r^2, B / r^2, as E I stays.

    Measured modes follow nu^2 + (r^2 - 1) (j f0)^2: only the tension part of a mode's stiffness changes. Their damping
    stays.
    """
    square, f0 = ratio * ratio, string.law_fundamental or string.nominal_fundamental
    tension, inharmonicity = under_tension(string.tension, string.inharmonicity, ratio)
    measured = (
        math.sqrt(nu * nu + (square - 1) * ((j * f0) * (j * f0))) for j, nu in enumerate(string.measured_frequencies, 1)
    )
    return replace(
        string,
        tension=tension,
        inharmonicity=inharmonicity,
        law_fundamental=string.law_fundamental * ratio,
        measured_frequencies=tuple(measured),
    )


def _ratio(string: String, note: int) -> float:
    """Frequency ratio by which to retune `string` to give `note` its own offset."""
    if not string.offsets:
        return 1.0
    note, before = note - string.shifted, string.open_note - string.shifted
    cents = string.offsets[note % 12] - string.offsets[before % 12]
    return exp2(cents / 1200) if cents else 1.0


def _tuned_for(string: String, note: int) -> String:
    """`string` retuned to give `note` its own offset."""
    ratio = _ratio(string, note)
    return tension_string(string, ratio) if ratio != 1.0 else string


def on_grid(s: Speaking, points: int, stopped: str = "the stop") -> Speaking:
    """`s` over its board on a grid of `points` steps, with a contact point all along the board.

    Contact with a board needs one grid step more than modes: then Phi Phi^T is diagonal, and the force at each point
    has an equation of its own (eq. 12). A fret is its nearest grid point. Raises ValueError if the board stands above
    the string at rest; `stopped` names the string's stop there.
    """
    step = s.length / points
    place, height = surface_on_grid(s.surface, s.length, points)
    for x, h in zip(place.tolist(), height.tolist(), strict=True):
        if h > BOARD_ROUGH:
            where = f"{x * 1e3:.0f} mm from {stopped}"
            raise ValueError(f"the board stands {h * 1e3:.2f} mm above string {s.string.name} at rest, {where}")
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
    """`s` on the grid that `count` modes need: count + 1 steps over a board; over frets `s` itself."""
    return on_grid(s, count + 1) if s.surface and count + 1 != s.grid_points else s


def stretch_ratio(law: str, inharmonicity: float, mode: Floats) -> Floats:
    """Returns nu_j / (j f0) of modes `mode` (n,) on a rigid neck, (n,); law: a `String.stiffness_law`.

    "hinged": sqrt(1 + B j^2), a stiff string on hinges (Fletcher 1964). "paper": 1 + B j^2 / 2, eq. 8 as printed, a
    fit to one G string, valid for B j^2 below about 0.04.
    """
    return np.asarray(modal_law.stretch_ratio(law == "paper", inharmonicity, mode))
