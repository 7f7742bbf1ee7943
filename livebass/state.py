"""What sounding strings and the performer remember; the only place of the engine that allocates."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from livebass import board, frets
from livebass import layout as at
from livebass.circuit import digital
from livebass.instrument import Instrument, String
from livebass.operators import Operator, Rates, pickups_under
from livebass.performer import PERFORMER, reset_controllers

BLOCKER_HZ = 6.0  # DC blocker's corner
GAIN_TIME = 6e-3  # s, how fast volume follows its controller


@dataclass
class Pool:
    """Operators of all strings and frets: records (strings, frets + 1), and their memory."""

    records: NDArray[np.void]
    memory: NDArray[np.float64]


@dataclass
class Voice:
    """One string's state and workspace, as `voice.run` takes it."""

    string: NDArray[np.void]  # (1,) layout.STRING
    log: NDArray[np.int64]  # (n, 2)

    @property
    def record(self) -> NDArray[np.void]:
        return self.string["voice"]

    @property
    def slots(self) -> NDArray[np.void]:
        return self.string["slots"][0]

    @property
    def work(self) -> NDArray[np.void]:
        return self.string["work"][0]


def gather(operators: list[list[Operator]]) -> Pool:
    """One pool of operators given by string and fret; each was built with its own offset."""
    size = sum(op.memory.size for row in operators for op in row)
    memory = np.zeros(size)
    records = np.zeros((len(operators), len(operators[0])), at.OPERATOR)
    offset = 0
    for i, row in enumerate(operators):
        for k, op in enumerate(row):
            memory[offset : offset + op.memory.size] = op.memory.ravel()
            records[i, k] = op.record
            records[i, k]["start"] = offset
            offset += op.memory.size
    return Pool(records, memory)


def new_voice(rates: Rates, log: int = 0, over_board: bool = False) -> Voice:
    """A silent string, its displacement the output, with room for `log` contacts."""
    string = np.zeros(1, at.STRING)
    v, slots = string["voice"], string["slots"][0]
    v["over_frets"], v["over_board"] = frets.player(), board.player() if over_board else 0
    v["numerator"], v["denominator"], v["rate"] = rates.numerator, rates.denominator, rates.rate
    v["bend"] = v["tuned"] = v["gain"] = v["gain_wanted"] = 1.0
    v["b"][0, 0] = v["a"][0, 0] = 1.0
    v["block"] = math.exp(-2 * math.pi * BLOCKER_HZ / rates.rate)
    v["gain_pole"] = 1.0 - math.exp(-1.0 / (GAIN_TIME * rates.rate))
    slots["hand"] = slots["ratio"] = 1.0
    return Voice(string, np.zeros((log, 2), np.int64))


def instrument_voice(instrument: Instrument, string: String, rates: Rates, over_board: bool = False) -> Voice:
    """`string` of `instrument`, with its pickups, circuit and the player's times; maybe `over_board`."""
    output, player = instrument.output, instrument.player
    pickups = pickups_under(output, string.name)
    voice = new_voice(rates, over_board=over_board)
    v = voice.record
    v["pickups"] = len(pickups)
    for i, pickup in enumerate(pickups):
        v["decay"][0, i] = 1.0 / pickup.decay_length
        v["mix"][0, i] = pickup.level * string.level
        v["across"][0, i] = pickup.across
    if not pickups:
        v["across"][0, 0] = output.across
    if pickups:
        v["b"][0], v["a"][0] = digital(output.coil, rates.rate)
    v["b"][0] *= output.gain
    v["pull"] = round(player.pull_time * rates.rate)
    v["strike"] = max(1, round(player.strike_time * rates.rate))
    return voice


def new_performer(instrument: Instrument, frets: int, seed: int = 0) -> NDArray[np.void]:
    """(1,) `performer.PERFORMER` for `instrument` with `frets` frets a string; `seed` of its unevenness."""
    p = np.zeros(1, PERFORMER)
    player = instrument.player
    count = len(instrument.strings)
    p["strings"], p["frets"] = count, frets
    p["open"][0, :count] = [s.open_note for s in instrument.strings]
    p["key"] = -1
    p["volume"] = 1.0
    p["place"] = 1
    p["range"] = player.bend_range
    p["usual_position"], p["nearest"], p["farthest"] = (
        player.pluck_position,
        player.pluck_nearest,
        player.pluck_farthest,
    )
    p["softest"], p["hardest"], p["greatest"] = player.softest, player.hardest, player.greatest_apex
    p["slapped"] = player.slapped_strings if player.technique == "slap" else 0
    p["strike_position"], p["strike_force"] = player.strike_position, player.strike_force
    p["hand_damping"] = player.hand_damping
    p["unevenness"], p["seed"] = player.unevenness, seed & 0x7FFF_FFFF_FFFF_FFFF
    p["drop"] = player.out_of_range == "drop"
    p["position_controller"] = player.position_controller
    reset_controllers(p[0])
    return p
