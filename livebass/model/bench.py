"""A bass on the bench: the numbers from which kernels compute its notes, and its changes by sliders.

kernels/bass/bench.py has the record and computes the notes, kernels/bass/change.py changes it.
"""

from __future__ import annotations

from array import array
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from livebass.kernels.bass.bench import BENCH, fill_bench, measure_bench
from livebass.kernels.bass.change import MAX_SLACK, move_bench
from livebass.kernels.bass.instrument import TIERS
from livebass.kernels.string.note import CROWN_ABOVE, MADE
from livebass.kernels.string.preparing import NOTE
from livebass.model.answers import answering_modes
from livebass.model.instrument import Instrument, Neck, Output, Pickup, String, on_bench
from livebass.model.neck import flat, rows_of
from livebass.model.quality import MAX_MODES, Quality
from livebass.rows.arrays import Floats
from livebass.rows.techniques import SLIDER_ROWS, SLIDERS

# Numbers that sliders move: in a BENCH_STRING, in a BENCH per string or pickup, and in the player
OF_STRING = (
    "diameter", "linear_density", "tension", "inharmonicity", "viscoelastic_angle", "thermoelastic", "relaxation",
    "extra_damping", "axial_stiffness", "law_fundamental",
)  # fmt: skip
OF_PLAYER = ("rounding", "rounding_soft", "pluck_angle", "softest", "hardest")

Rows = tuple[tuple[float, ...], ...]
Notes = tuple[NDArray[np.void], NDArray[np.int64], Floats]


@dataclass(frozen=True)
class Bench:
    """A bass as its maker sets it up: a BENCH and the numbers of its lists. Both may change."""

    record: NDArray[np.void]  # (1,)
    numbers: Floats
    names: tuple[str, ...]  # of the strings
    necks: tuple[Neck, ...]  # before a change: their frets stay where they are

    def notes(self) -> Notes:
        """The notes: NOTE (strings, frets + 1), their modes in each tier, and the numbers of their lists.

        The record holds their addresses. Raises ValueError for an unplayable neck.
        """
        bench = self.record
        strings, frets = (int(bench[name][0]) for name in ("strings", "frets"))
        made = np.zeros((strings, frets + 1), NOTE)
        modes = np.zeros((TIERS, *made.shape), np.int64)
        bench["numbers"], bench["notes"], bench["modes"] = (a.ctypes.data for a in (self.numbers, made, modes))
        measure_bench(bench.ctypes.data)
        listed = np.zeros(int(bench["room"][0]))
        bench["lists"] = listed.ctypes.data
        state = int(fill_bench(bench.ctypes.data))
        if state != MADE:
            raise ValueError(stands_above(bench[0], state, self.names, self.necks))
        return made, modes, listed[: int(bench["used"][0])]


def bench_of(instrument: Instrument, qualities: Sequence[Quality]) -> Bench:
    """Puts a bass on the bench, with the frets that every string has, and one tier per quality."""
    bench, numbers, output = np.zeros(1, BENCH), array("d"), instrument.output
    to, answering = bench[0], answering_modes(instrument)
    to["strings"], to["frets"], to["most_modes"] = len(instrument.strings), instrument.frets, MAX_MODES
    to["tiers"][: len(qualities)] = [quality.modes or 0 for quality in qualities]
    for i, (string, neck) in enumerate(zip(instrument.strings, instrument.necks, strict=True)):
        row = to["string"][i]
        given, lists = on_bench(string, neck, any(answering))
        for name, value in vars(given).items():
            row[name] = value + len(numbers) if f"{name}_count" in vars(given) else value
        numbers.extend(lists)
        taps: Rows = tuple((p.position, p.aperture) for p in output.pickups if p.senses(string.name))
        if output.kind == "displacement":
            taps = (output.sensor,), (output.sensor_v,)
        row["taps"], row["taps_count"], row["tap_width"] = len(numbers), len(taps), len(taps[0]) if taps else 1
        numbers.extend(flat(taps))
        row["answering_modes"], row["open_note"], row["retuned"] = answering[i], string.open_note, 1.0
        to["contact_loss"][i], to["pressing"][i] = neck.contact_loss, neck.pressing
    to["tap"] = -1
    to["pickups"] = 0 if output.kind == "displacement" else len(output.pickups)
    for p, pickup in enumerate(output.pickups[: to["pickups"]]):
        to["position"][p], to["aperture"][p] = pickup.position, pickup.aperture
        to["decay_length"][p], to["pickup_level"][p] = pickup.decay_length, pickup.level
        for i, string in enumerate(instrument.strings):
            if pickup.senses(string.name):
                to["tap"][p, i] = sum(other.senses(string.name) for other in output.pickups[:p])
    to["capacitance"], to["a4"] = output.coil.capacitance, instrument.a4
    for name in OF_PLAYER:
        to[name] = getattr(instrument.player, name)
    return Bench(bench, np.array(numbers), tuple(string.name for string in instrument.strings), instrument.necks)


def change_bass(instrument: Instrument, values: Mapping[str, float]) -> Instrument:
    """The bass with sliders at `values`, by symbol, in their units; the hand measures its force as before."""
    bench, given = bench_of(instrument, ()), np.zeros(SLIDERS)
    for k, symbol in enumerate(SLIDER_ROWS):
        given[k] = in_hundredths(values.get(symbol, 0.0))
    bench.record["numbers"] = bench.numbers.ctypes.data
    moved = move_bench(bench.record.ctypes.data, given.ctypes.data)
    to, numbers, strings = bench.record[0], bench.numbers.tolist(), range(len(instrument.strings))
    player: dict[str, Any] = {name: float(to[name]) for name in OF_PLAYER}
    return replace(
        instrument,
        a4=float(to["a4"]),
        strings=tuple(_string(instrument.strings[i], to, i, numbers) for i in strings),
        necks=tuple(_neck(instrument.necks[i], to, i, numbers) for i in strings),
        output=_output(instrument.output, to),
        player=replace(instrument.player, **player),
        grazed=instrument.grazed or (instrument.necks if moved else ()),
    )


def in_hundredths(value: float) -> float:
    """Rounds a slider's value to hundredths of its unit, as plugin hosts return it."""
    return float(np.rint(100 * value) / 100) + 0.0


def _string(string: String, to: np.void, i: int, numbers: list[float]) -> String:
    row = to["string"][i]
    given: dict[str, Any] = {name: float(row[name]) for name in OF_STRING}
    made = replace(string, **given)
    if row["retuned"] == 1.0:
        return made
    shifted, ratio, first = int(row["shifted"]), float(row["retuned"]), int(row["frequencies"])
    return replace(
        made,
        open_note=string.open_note + shifted,
        own_note=string.open_note if string.own_note is None else string.own_note,
        shifted=string.shifted + shifted,
        retuned=string.retuned * ratio,
        slack=min(string.slack / (ratio * ratio), MAX_SLACK),
        measured_frequencies=tuple(numbers[first : first + len(string.measured_frequencies)]),
    )


def _neck(neck: Neck, to: np.void, i: int, numbers: list[float]) -> Neck:
    frets, surface, rows = (int(to["string"][i][name]) for name in ("frets", "surface", "resonances"))
    moved = tuple(
        replace(r, frequency=numbers[rows + 3 * k], mass=numbers[rows + 3 * k + 2])
        for k, r in enumerate(neck.admittance.resonances)
    )
    return replace(
        neck,
        fret_heights=tuple(height for _, height in rows_of(numbers, frets, len(neck.fret_heights))),
        surface=rows_of(numbers, surface, len(neck.surface)),
        contact_loss=float(to["contact_loss"][i]),
        admittance=replace(neck.admittance, resonances=moved),
    )


def _output(output: Output, to: np.void) -> Output:
    def moved(p: int, pickup: Pickup) -> Pickup:
        return replace(pickup, position=float(to["position"][p]), level=float(to["pickup_level"][p]))

    pickups = output.pickups
    if output.kind == "pickups":
        pickups = tuple(moved(p, pickup) for p, pickup in enumerate(pickups))
    return replace(output, pickups=pickups, coil=replace(output.coil, capacitance=float(to["capacitance"])))


def stands_above(bench: np.void, state: int, names: Sequence[str], necks: Sequence[Neck]) -> str:
    """Names the crown or board above a string at rest, from the `state` that `fill_bench` returned."""
    name, neck, stop = names[bench["fault_string"]], necks[bench["fault_string"]], int(bench["fault_fret"])
    above = f"stands {bench['fault_height'] * 1e3:.2f} mm above string {name} at rest"
    if state == CROWN_ABOVE:
        return f"{neck.fret_text(round(bench['fault_place']))} {above}"
    return f"the board {above}, {bench['fault_place'] * 1e3:.0f} mm from {neck.stop_text(stop)}"
