"""Prepares the memory of the kernels: operators of a speaking string at its rates, strings, the performer.

In the engine, only this file allocates memory for the kernels.
"""

from __future__ import annotations

import math
from array import array
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from livebass.kernels.bass.instrument import BEYOND, INSTRUMENT, whole_steps
from livebass.kernels.bass.strings import connect_string, rest_string, settle_string
from livebass.kernels.bass.strings import new_performer as make_performer
from livebass.kernels.effects.records import MIN_RATE
from livebass.kernels.pickup import coil
from livebass.kernels.pickup.coil import COIL
from livebass.kernels.player import controls, messages
from livebass.kernels.player.constants import PICK, STANDARD
from livebass.kernels.player.performer import PERFORMER
from livebass.kernels.player.words import KIND_BIT, STATUS
from livebass.kernels.string import board, frets, preparing
from livebass.kernels.string.preparing import FROZEN, NOTE, OVERDAMPED, PREPARING
from livebass.kernels.string.records import BETWEEN, CONTACT, DOUBLE, MAX_NEAR, OPERATOR, ROW, STRING, VOICE_SLOTS
from livebass.kernels.voice import run_string
from livebass.model.answers import answering_modes
from livebass.model.instrument import Coil, Instrument, Output, Pickup, Player, Speaking, String
from livebass.model.keymap import velocity_parts
from livebass.model.modes import CARRIED
from livebass.model.quality import MAX_MODES, QUALITIES, Quality
from livebass.rows.arrays import Floats
from livebass.rows.bounds import refusal, within
from livebass.rows.parts import Knobs, NoteNumbers, Pick
from livebass.rows.row import rows, words
from livebass.rows.techniques import FUNCTION_ROWS, TECHNIQUE_ROWS

MAX_PHASES = 2000
LINE = 8  # float64 in a cache line


@dataclass(frozen=True)
class Rates:
    """Audio rate and contact rate (Hz); `numerator` fine steps make `denominator` frames."""

    rate: int
    contact_rate: int

    def __post_init__(self) -> None:
        if self.contact_rate < self.rate:
            raise refusal("contact rate", f"at least the audio rate, {self.rate} Hz", f"{self.contact_rate} Hz")
        if self.denominator > MAX_PHASES:
            raise ValueError(
                f"contact rate {self.contact_rate} Hz: its ratio to {self.rate} Hz is not simple enough;"
                f" {whole_contact_rate(self.contact_rate, self.rate)} Hz is"
            )

    @property
    def denominator(self) -> int:
        return self.rate // math.gcd(self.rate, self.contact_rate)

    @property
    def numerator(self) -> int:
        return self.contact_rate // math.gcd(self.rate, self.contact_rate)


def whole_contact_rate(contact_rate: float, rate: int) -> int:
    """Smallest whole multiple of the audio rate that is not below `contact_rate` (Hz)."""
    return rate * int(whole_steps(contact_rate, rate))


Rows = tuple[tuple[float, ...], ...]


@dataclass(frozen=True)
class Note:
    """One string at one fret as kernels prepare it: the number of modes, and their taps."""

    speaking: Speaking
    modes: int
    taps: Rows  # of the kind given to `operators`


@dataclass
class Pool:
    """Operators of all strings and frets, and the memory whose addresses they hold."""

    records: NDArray[np.void]  # (strings, frets + 1) records.OPERATOR
    memory: Floats


def pickups_under(output: Output, name: str) -> tuple[Pickup, ...]:
    """Pickups that sense the string `name`; none if the output is the displacement itself."""
    if output.kind == "displacement":
        return ()
    return tuple(p for p in output.pickups if p.senses(name))


def pickup_taps(s: Speaking, output: Output) -> Rows:
    """The taps of `s` under its pickups: place (m from the stop) and aperture (m) of each."""
    return tuple((s.length - p.position, p.aperture) for p in pickups_under(output, s.string.name))


def operators(
    notes: list[list[Note]], kind: int, rates: Rates, *, lossless: bool = False, playable: bool = False
) -> Pool:
    """Makes the operators of `notes`, given by string and fret, with taps of a `kind` (kernels.preparing).

    playable: omits modes that the contact rate cannot carry, and puts a board on the grid that the others need
    (`carried` and `for_modes`). All numbers are float64. Raises ValueError for more modes or contact points than the
    kernels take, or a rate that freezes a mode.
    """
    given, numbers = note_numbers([note for row in notes for note in row], playable)
    numbers.append(0.0)  # an empty array has no address
    records = np.zeros((len(notes), len(notes[0])), OPERATOR)
    work = np.zeros(1, PREPARING)
    work["notes"], work["operators"], work["count"] = given.ctypes.data, records.ctypes.data, len(given)
    work["numbers"], _ = numbers.buffer_info()
    work["taps"], work["lossless"], work["exact"], work["apart"] = kind, lossless, True, len(notes[0])
    work["rate"], work["contact_rate"] = rates.rate, rates.contact_rate
    work["numerator"], work["denominator"] = rates.numerator, rates.denominator
    work["carried"] = CARRIED if playable else math.inf
    preparing.measure_operators(work.ctypes.data)
    memory, table = zeroed_lines(int(work["words"][0])), np.zeros(int(work["table_words"][0]))
    work["memory"], work["table"] = memory.ctypes.data, table.ctypes.data
    state = preparing.fill_operators(work.ctypes.data)
    if state == OVERDAMPED:
        raise ValueError("damping is above critical for a mode: lower the extra damping")
    if state == FROZEN:
        raise ValueError(f"contact rate {rates.contact_rate} Hz: a mode stands still at this rate; take another")
    return Pool(records, memory)


def note_numbers(notes: Sequence[Note], playable: bool) -> tuple[NDArray[np.void], array[float]]:
    """Makes a NOTE, (n,), from each of `notes`, and the numbers that they point into.

    Raises ValueError for more modes or contact points than the kernels take.
    """
    given, numbers = np.zeros(len(notes), NOTE), array("d")
    for k, note in enumerate(notes):
        _check(note, playable)
        _give(given[k], note, numbers, playable)
    return given, numbers


def _check(note: Note, playable: bool) -> None:
    """Raises ValueError for a note with more modes or contact points than the kernels take."""
    s, count = note.speaking, note.modes
    within("modes", count, 1, min(MAX_MODES, s.grid_points - 1))
    points = len(s.contact_position)
    if points > MAX_NEAR and not playable and (count < s.grid_points - 1 or points > ROW):
        raise ValueError(f"{points} contact points, {count} modes: a board needs a grid of one step more than modes")


def _give(to: NDArray[np.void], note: Note, numbers: array[float], playable: bool) -> None:
    """Fills the NOTE `to`, and appends its lists to `numbers`."""
    s, string = note.speaking, note.speaking.string
    on_grid = playable and s.surface
    lists: dict[str, Iterable[tuple[float, ...]]] = {
        "resonances": ((r.frequency, r.quality, r.mass) for r in s.admittance.resonances),
        "table": s.admittance.table,
        "resonances_across": ((r.frequency, r.quality, r.mass) for r in s.admittance_across.resonances if s.own_across),
        "table_across": s.admittance_across.table if s.own_across else (),
        "frequencies": ((nu,) for nu in string.measured_frequencies if s.stop == 0),
        "dampings": ((sigma,) for sigma in string.measured_dampings if s.stop == 0),
        "obstacles": () if on_grid else zip(s.contact_position, s.contact_height, strict=True),
        "surface": s.surface if on_grid else (),
        "taps": note.taps,
    }
    to["modes"] = note.modes
    to["stop"], to["stop_across"] = s.admittance.stop, s.admittance_across.stop
    for name in rows(NoteNumbers):
        to[name] = getattr(s, name)
    for name, listed in lists.items():
        to[name], count = len(numbers), 0
        for items in listed:
            numbers.extend(items)
            count += 1
        to[f"{name}_count"] = count


def zeroed_lines(count: int) -> Floats:
    """Zeros, (count,), aligned to a cache line: rows of whole lines are read fastest."""
    room = np.zeros(count + LINE)
    first = -(room.ctypes.data // room.itemsize) % LINE
    return room[first : first + count]


def coil_filter(circuit: Coil, rate: float) -> tuple[Floats, Floats]:
    """Coefficients (b, a), each (4,), of the filter at `rate` Hz that models the circuit, by `fit_coil`."""
    work = np.zeros(1, COIL)
    fill(work[0], circuit)
    work["rate"] = rate
    coil.fit_coil(work.ctypes.data)
    return work["b"][0], work["a"][0]


SEEDS = 0x7FFF_FFFF_FFFF_FFFF  # the bits of a seed: kernels take int64


def modal_row(w: np.void, name: str) -> Floats:
    """A row of modes in a working set, a WORK, in float64, (ROW,). Above its modes it is not defined."""
    split = int(w["split"])
    with np.errstate(invalid="ignore"):
        return np.concatenate([w["low"][name][:split], w["high"][name][: ROW - split].astype(float)])


@dataclass
class Voice:
    """One string's state and workspace for `voice.run`, and the log of contacts whose address it holds."""

    string: NDArray[np.void]  # (1,) records.STRING
    log: NDArray[np.void]  # (n,) records.CONTACT, a ring
    between: NDArray[np.void] | None = None  # (VOICE_SLOTS,) records.BETWEEN, if the string does not lie in a bass

    @property
    def record(self) -> NDArray[np.void]:
        """The string's VOICE, (1,)."""
        return self.string["voice"]

    @property
    def slots(self) -> NDArray[np.void]:
        """Its slots, (VOICE_SLOTS,)."""
        return self.string["slots"][0]

    def sounding(self) -> bool:
        """True if the string moves or others answer it."""
        return bool(self.slots["on"].any() or self.record["answering"][0])

    def note(self) -> tuple[int, int]:
        """The last note's fret, and the number of contacts since."""
        slot = self.slots[self.record["slot"][0]]
        return int(slot["fret"]), int(slot["touching"])

    def modal_state(self) -> tuple[Floats, Floats]:
        """q and P of u, (VOICE_SLOTS, ROW) each, for tests."""
        q, p = ([modal_row(w, name) for w in self.slots["u"]] for name in ("q", "p"))
        return np.array(q), np.array(p)

    def pressed(self) -> bool:
        """True if a contact point pushes the last note at its current fine step."""
        u = self.slots[self.record["slot"][0]]["u"]
        now, deep = u["solved_at"] == self.record["step"], (u["eta"] > 0) | (u["eta_before"] > 0)
        return bool(np.any(now & deep))

    def remembered(self) -> Floats:
        """Memory of the output filters and of the DC blocker."""
        v = self.record[0]
        return np.array([v["block_in"], v["block_out"], *v["z"]])


def play_frames(
    voice: Voice, ops: NDArray[np.void], events: NDArray[np.void], out: Floats, across: Floats | None = None
) -> int:
    """Plays out.shape[0] frames of a string by `kernels.voice.run`; returns the number of events used.

    ops (frets + 1,), events (n,), by frame; out (frames,) and across (frames,) are filled.
    """
    return int(
        run_string(
            voice.string.ctypes.data, ops.ctypes.data, len(ops) - 1, events.ctypes.data, len(events), out.ctypes.data,
            0 if across is None else across.ctypes.data, len(out),
        )
    )  # fmt: skip


def take_message(
    p: NDArray[np.void],
    ops: NDArray[np.void],
    frame: int,
    message: tuple[int, int, float],
    events: NDArray[np.void],
    count: int,
) -> int:
    """Passes a message to the performer `p` (1,); returns the new count.

    ops (strings, frets + 1); `message`: three bytes of MIDI, or an event's kind, number and value (`words.Row`); events
    (n,) are filled from `count` on.
    """
    p["out"] = frame, events.ctypes.data, count
    first, second, third = message
    if first < STATUS:
        messages.take_event(p.ctypes.data, ops.ctypes.data, first << KIND_BIT | second, third)
    else:
        messages.take_message(p.ctypes.data, ops.ctypes.data, first, second, third)
    return int(p["out"]["count"][0])


def follow_performer(voices: Sequence[Voice], p: NDArray[np.void], old: NDArray[np.void]) -> None:
    """Copies the controllers of `old` (1,) to the performer `p` (1,) and its strings, which are at rest."""
    controls.follow_performer(p.ctypes.data, old.ctypes.data)
    for i, voice in enumerate(voices):
        settle_string(voice.string.ctypes.data, p.ctypes.data, i)


def is_heavy(quality: Quality) -> bool:
    """True if `quality` needs more than the tier `live` with frets: most of a processor's time."""
    light = QUALITIES["live"]
    return quality.modes is None or quality.modes > (light.modes or 0) or quality.contact_rate > light.contact_rate


def instrument_numbers(
    strings: Sequence[String],
    output: Output,
    player: Player,
    tiers: Sequence[Quality] = (),
    frets: int = 0,
    answering: Sequence[int] = (),
    fretless: Sequence[bool] = (),
) -> NDArray[np.void]:
    """Makes the INSTRUMENT, (1,), of these strings with output and player, in `tiers` of quality.

    answering: number of modes of each string that may answer the others (model.answers); empty: none.
    `fretless`: for each string, whether a finger slides along it without steps; empty: on none.
    """
    made = np.zeros(1, INSTRUMENT)
    to = made[0]
    to["strings"], to["frets"] = len(strings), frets
    to["sensed"], to["gain"], to["carried"] = output.kind == "displacement", output.gain, CARRIED
    to["part"] = velocity_parts(player.velocity_curve)
    fill_key_map(to["key_map"], player)
    fill_choices(to, player)
    to["answering_modes"][: len(answering)] = answering
    for k, quality in enumerate(tiers):
        to["tiers"][k] = quality.contact_rate, is_heavy(quality)
    fill(to["circuit"], output.coil)
    fill(to["player"], player)
    to["strokes"] = STANDARD
    fill(to["strokes"][PICK], player.pick)
    for i, string in enumerate(strings):
        pickups = pickups_under(output, string.name)
        to["open_note"][i], to["pickups"][i] = string.open_note, len(pickups)
        to["slack"][i] = string.slack
        to["called"][i] = string.called
        to["stretch"][i] = string.axial_stiffness / (2 * (string.length + BEYOND))
        to["winding"][i] = string.winding
        to["fretless"][i] = i < len(fretless) and fretless[i]
        for k, pickup in enumerate(pickups):
            to["decay"][i, k] = 1.0 / pickup.decay_length
            to["mix"][i, k] = pickup.level * string.level
            to["across"][i, k] = pickup.across
            to["saddle"][i, k] = pickup.position
            to["aperture"][i, k] = pickup.aperture
        if not pickups:
            to["across"][i, 0] = output.across
            to["saddle"][i, :2] = output.sensor, output.sensor_v
    return made


def fill(to: Any, source: Coil | Player | Pick | Knobs) -> None:
    """Fills a record with the rows of `source` that have a word in it."""
    for word in words(type(source)):
        to[word.name] = getattr(source, word.name)


def fill_choices(to: Any, source: Player | Knobs) -> None:
    """Fills a record with the choices of `source`, by number."""
    for name, row in rows(type(source)).items():
        if row.record:
            to[row.record] = row.choices.index(getattr(source, name))


def fill_key_map(to: NDArray[np.void], player: Player) -> None:
    """Fills a KEY_MAP with the player's keys and controllers."""
    to["over_notes"] = player.keys.over_notes
    for key, name, value in player.keys.keys:
        to["action"][key], to["value"][key] = TECHNIQUE_ROWS[name].number, value
    for number, name in player.keys.functions(player.position_controller).items():
        to["function"][number] = FUNCTION_ROWS[name].number


def bass_numbers(instrument: Instrument, tiers: Sequence[Quality], frets: int) -> NDArray[np.void]:
    """Makes the INSTRUMENT, (1,), of a bass with `frets` frets per string, in `tiers` of quality."""
    bass = instrument
    fretless = [neck.fretless for neck in bass.necks]
    answering = answering_modes(bass)
    numbers = instrument_numbers(bass.strings, bass.output, bass.player, tiers, frets, answering, fretless)
    fill(numbers, bass.effects)
    fill_choices(numbers, bass.effects)
    response = bass.effects.response
    numbers["response_rate"] = response.rate if response else MIN_RATE
    numbers["response_count"] = len(response.played) // DOUBLE if response else 0
    if bass.over_board:
        numbers["player"]["thumb_mass"] = 0.0  # it would press the string onto hundreds of points
    return numbers


def new_voice(rates: Rates, log: int = 0) -> Voice:
    """Makes a silent string whose output is its displacement, with room for `log` contacts."""
    string, between = (
        zeroed_lines(n * of.itemsize // DOUBLE).view(of) for n, of in ((1, STRING), (VOICE_SLOTS, BETWEEN))
    )
    voice = Voice(string, np.zeros(log, CONTACT), between)
    rest_string(
        voice.string.ctypes.data, rates.rate, rates.numerator, rates.denominator, frets.over_frets.address,
        board.over_board.address,
    )  # fmt: skip
    string["between"] = between.ctypes.data
    voice.record["log"], voice.record["log_room"] = voice.log.ctypes.data, log
    return voice


def pickup_voices(numbers: NDArray[np.void], circuit: Coil, rates: Rates) -> list[Voice]:
    """Makes the silent strings of an INSTRUMENT, with the player's hand, over pickups with that `circuit`."""
    made = [new_voice(rates) for _ in range(int(numbers["strings"][0]))]
    fitted = np.zeros(1, COIL)
    fitted["b"], fitted["a"] = coil_filter(circuit, rates.rate)
    for i, voice in enumerate(made):
        connect_string(voice.string.ctypes.data, numbers.ctypes.data, i, fitted.ctypes.data)
    return made


def new_performer(numbers: NDArray[np.void], seed: int = 0) -> NDArray[np.void]:
    """Makes the performer, (1,) PERFORMER, of an INSTRUMENT; `seed`: for its unevenness."""
    p = np.zeros(1, PERFORMER)
    make_performer(p.ctypes.data, numbers.ctypes.data, seed & SEEDS)
    return p
