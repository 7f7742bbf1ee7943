"""Prepares the memory of the kernels: operators of a speaking string at its rates, strings, the performer.

This is the only place of the engine that allocates what the kernels work on.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from livebass.arrays import Floats
from livebass.kernels import board, frets
from livebass.kernels.operators import COEFFICIENT_ROWS, FINE_A, FINE_B, KAPPA, LEAPS, OMEGA, PACE, SIGMA
from livebass.kernels.performer import PERFORMER, reset_controllers
from livebass.kernels.records import LONGER, MOST_NEAR, OPERATOR, PART, ROW, STRING, WHOLE
from livebass.kernels.slot import padded
from livebass.model.circuit import digital
from livebass.model.instrument import Instrument, Output, Pickup, Player, Speaking, String
from livebass.model.modes import dampings, frequencies, grazing_apex, held_stiffness, shapes
from livebass.model.quality import MOST_MODES

PART_TIME = 5.2e-6  # s, length of the parts a contact frame is cut into ...
LEAST_PART = 16  # ... but so many fine steps at least: to look costs as much as some steps
TAPER = (0.40, 0.46)  # of the audio rate: modes fade from the output between these
MOST_PHASES = 2000


@dataclass(frozen=True)
class Rates:
    """Audio rate and contact rate (Hz); `numerator` fine steps make `denominator` frames."""

    rate: int
    contact_rate: int

    def __post_init__(self) -> None:
        if self.contact_rate < self.rate:
            raise ValueError(f"contact rate {self.contact_rate} Hz: allowed is the audio rate {self.rate} Hz or more")
        if self.denominator > MOST_PHASES:
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
    return rate * max(1, math.ceil(contact_rate / rate - 1e-9))


@dataclass(frozen=True)
class Operator:
    """An operator record and its share of the pool: weights of taps, then mode shapes at the contact points."""

    record: NDArray[np.void]  # () records.OPERATOR, without addresses
    memory: dict[str, Floats]  # by the name of the address


def pickups_under(output: Output, name: str) -> tuple[Pickup, ...]:
    """Pickups that sense the string `name`; none where the output is the displacement itself."""
    if output.kind == "displacement":
        return ()
    return tuple(p for p in output.pickups if not p.strings or name in p.strings)


def pickup_rows(s: Speaking, output: Output, count: int, rate: int) -> Floats:
    """(pickups, count) weights of modal displacements at each pickup, m^-0.5; modes above the audio band fade out."""
    fade = _fade(s, count, rate)
    k = np.arange(1, count + 1) * (math.pi / s.length)
    rows = [
        # a Gaussian window as wide as a rectangle of the aperture
        shapes(s, count, np.array([s.length - p.position]))[0] * np.exp(-((k * p.aperture) ** 2) / 24) * fade
        for p in pickups_under(output, s.string.name)
    ]
    return np.array(rows).reshape(len(rows), count)


def sensor_rows(s: Speaking, places: tuple[float, float], count: int, rate: int) -> Floats:
    """(4, count) weights of q and P for u at the first of `places` (m from the stop), for v at the second."""
    u, v = shapes(s, count, np.array(places)) * _fade(s, count, rate)
    return np.array([u, np.zeros(count), v, np.zeros(count)])


def sampled_rows(s: Speaking, places: tuple[float, float], count: int, rates: Rates, lossless: bool = False) -> Floats:
    """(4 phases, count) weights of q and P for u, then for v, at each phase a frame can have between two fine steps.

    Every mode is heard, whatever the audio rate carries.
    """
    return np.concatenate([_sampled(s, place, count, rates, lossless) for place in places])


def _sampled(s: Speaking, place: float, count: int, rates: Rates, lossless: bool) -> Floats:
    weights = shapes(s, count, np.array([place]))[0]
    sigma, omega, es = _motion(s, count, rates, lossless)
    rows = []
    for i in range(rates.denominator):
        ahead = (-i * rates.numerator) % rates.denominator / rates.denominator / rates.contact_rate  # s
        growth = np.exp(sigma * ahead)
        rows += [growth * np.cos(omega * ahead) * weights, -growth * np.sin(omega * ahead) / es * weights]
    return np.array(rows)


def _fade(s: Speaking, count: int, rate: int) -> Floats:
    nu = frequencies(s, count)
    low, high = TAPER[0] * rate, TAPER[1] * rate
    fade = 0.5 + 0.5 * np.cos(np.pi * np.clip((nu - low) / (high - low), 0, 1))
    fade[nu >= high] = 0.0
    return np.asarray(fade)


def _motion(s: Speaking, count: int, rates: Rates, lossless: bool) -> tuple[Floats, Floats, Floats]:
    """sigma (1/s), damped omega (rad/s) and E sin(omega dt) of each mode."""
    dt = 1.0 / rates.contact_rate
    sigma = np.zeros(count) if lossless else dampings(s, count)
    omega = 2 * np.pi * frequencies(s, count)
    if np.any(sigma >= omega):
        raise ValueError("damping is above critical for a mode: lower the extra damping")
    damped = np.sqrt(omega**2 - sigma**2)
    if np.min(np.abs(np.sin(damped * dt))) < 1e-9:
        raise ValueError(f"contact rate {rates.contact_rate} Hz: a mode stands still at it, take another one")
    return sigma, damped, np.exp(-sigma * dt) * np.sin(damped * dt)


def operator(
    s: Speaking, count: int, rates: Rates, taps: Floats, *, lossless: bool = False, graze: float = 0.0
) -> Operator:
    """Builds the operator of `count` modes heard through `taps` (rows, count); `gather` gives it its place.

    Raises ValueError for more modes or contact points than the kernels take, or a rate that freezes a mode.
    """
    if not 1 <= count <= min(MOST_MODES, s.grid_points - 1):
        raise ValueError(f"modes {count}: allowed are 1 to {min(MOST_MODES, s.grid_points - 1)} for this length")
    points = len(s.contact_position)
    board = points > MOST_NEAR
    if board and (count < s.grid_points - 1 or points > ROW):
        raise ValueError(f"{points} contact points, {count} modes: a board needs a grid of one step more than modes")
    dt = 1.0 / rates.contact_rate
    sigma, w_d, es = _motion(s, count, rates, lossless)
    steps = rates.numerator // rates.denominator
    parts = min(round(steps * dt / PART_TIME), steps // LEAST_PART)
    if parts < 2:
        parts = 0
    part_steps = steps // max(parts, 1)

    n = padded(count)
    record = np.zeros((), OPERATOR)
    record["modes"], record["padded"] = count, n
    heard = np.flatnonzero(np.any(taps != 0, axis=0))
    record["tap_modes"] = padded(int(heard[-1]) + 1) if heard.size else 0
    record["points"], record["diagonal"] = points, count == s.grid_points - 1
    record["weight"] = dt**2 / s.string.linear_density
    record["steps"], record["parts"], record["part_steps"] = steps, parts, part_steps
    dx_mu = s.step / s.string.linear_density
    record["fine"], record["push"] = dt, dt**2 * dx_mu
    record["friction"], record["slip"] = s.friction, 2 * dt * s.friction_speed
    record["stiffness"], record["exponent"] = s.contact_stiffness, s.contact_exponent
    record["length"], record["speed"] = s.length, 2 * s.length * s.fundamental
    record["graze"], record["held_stiffness"] = graze, held_stiffness(s)

    rows = np.zeros((COEFFICIENT_ROWS, n))
    # the modes that fill up the last block stay zero and must not divide by zero
    rows[[KAPPA, OMEGA, FINE_A]] = 1.0
    rows[FINE_A, :count] = np.exp(-sigma * dt) * np.cos(w_d * dt)
    rows[FINE_B, :count] = es**2
    for which, k in ((WHOLE, steps), (LONGER, steps + 1), (PART, part_steps)):
        damp_k = np.exp(-sigma * k * dt)
        a, b, g = rows[LEAPS + 3 * which : LEAPS + 3 * which + 3, :count]
        a[:] = damp_k * np.cos(w_d * k * dt)
        b[:] = damp_k * np.sin(w_d * k * dt) / es
        g[:] = damp_k * np.sin(w_d * k * dt) * es
    rows[KAPPA, :count], rows[PACE, :count] = es / w_d, w_d / es
    rows[OMEGA, :count], rows[SIGMA, :count] = w_d, sigma

    phi = shapes(s, s.grid_points - 1, np.asarray(s.contact_position))[:, :count]
    wide = np.zeros((len(taps) + points, n))
    wide[: len(taps), :count], wide[len(taps) :, :count] = taps, phi
    parts_of_pool = {
        "coefficients": rows,
        "taps": wide[: len(taps)],
        "shapes": wide[len(taps) :],
        "heights": np.asarray(s.contact_height),
        "positions": np.asarray(s.contact_position),
        "coupling": np.zeros(0) if board else dt**2 * dx_mu * phi @ phi.T,
        "left_out": np.zeros(0) if board else static_compliance(s, count),
    }
    return Operator(record, parts_of_pool)


def static_compliance(s: Speaking, count: int) -> Floats:
    """R (points, points), m per unit force per length: static compliance of the modes left out, between points."""
    full = s.grid_points - 1
    if count >= full:
        return np.zeros((len(s.contact_position),) * 2)
    phi = shapes(s, full, np.asarray(s.contact_position))[:, count:]
    omega = 2 * np.pi * frequencies(s, full)[count:]
    return np.asarray(s.step / s.string.linear_density * (phi / omega**2) @ phi.T)


def usual_grazing_apex(s: Speaking, position: float) -> float:
    """`grazing_apex` at a fraction `position` of the length; for a last fret, a fixed share of the length."""
    least = grazing_apex(s, position * s.length)
    return least if math.isfinite(least) else 2e-3 * s.length


BLOCKER_HZ = 6.0  # DC blocker's corner
GAIN_TIME = 6e-3  # s, how fast volume follows its controller


@dataclass
class Pool:
    """Operators of all strings and frets, and the memory whose addresses they hold."""

    records: NDArray[np.void]  # (strings, frets + 1) records.OPERATOR
    memory: Floats


@dataclass
class Voice:
    """One string's state and workspace, as `voice.run` takes it, and the log of contacts whose address it holds."""

    string: NDArray[np.void]  # (1,) records.STRING
    log: NDArray[np.int64]  # (n, 2): fine step and point

    @property
    def record(self) -> NDArray[np.void]:
        """The string's VOICE, (1,)."""
        return self.string["voice"]

    @property
    def slots(self) -> NDArray[np.void]:
        """Its slots, (VOICE_SLOTS,)."""
        return self.string["slots"][0]

    def sounding(self) -> bool:
        """True if the string moves."""
        return bool(self.slots["on"].any())

    def note(self) -> tuple[int, int]:
        """The fret of the note that was played last, and how many contacts began since."""
        slot = self.slots[self.record["slot"][0]]
        return int(slot["fret"]), int(slot["touching"])

    def modal_state(self) -> tuple[Floats, Floats]:
        """Views of q and P of u, (VOICE_SLOTS, ROW) each, for tests to look into or to spoil."""
        return self.slots["u"]["q"], self.slots["u"]["p"]

    def pressed(self) -> bool:
        """True if a contact point pushes the note that was played last, at the fine step it has got to."""
        u = self.slots[self.record["slot"][0]]["u"]
        now, deep = u["solved_at"] == self.record["step"], (u["eta"] > 0) | (u["eta_before"] > 0)
        return bool(np.any(now & deep))

    def remembered(self) -> Floats:
        """Memory of the output filters and of the DC blocker."""
        v = self.record[0]
        return np.array([v["block_in"], v["block_out"], *v["z"]])


def gather(operators: list[list[Operator]]) -> Pool:
    """Gathers the operators, given by string and fret, in one pool."""
    memory = np.concatenate([part.ravel() for row in operators for op in row for part in op.memory.values()])
    records = np.zeros((len(operators), len(operators[0])), OPERATOR)
    address = memory.ctypes.data
    for i, row in enumerate(operators):
        for k, op in enumerate(row):
            records[i, k] = op.record
            for name, part in op.memory.items():
                records[i, k][name] = address
                address += part.nbytes
    return Pool(records, memory)


def new_voice(rates: Rates, log: int = 0, over_board: bool = False) -> Voice:
    """Makes a silent string whose output is its displacement, with room for `log` contacts."""
    voice = Voice(np.zeros(1, STRING), np.zeros((log, 2), np.int64))
    v, slots = voice.record, voice.slots
    v["over_frets"], v["over_board"] = frets.over_frets(), board.over_board() if over_board else 0
    v["log"], v["log_room"] = voice.log.ctypes.data, log
    v["numerator"], v["denominator"], v["rate"] = rates.numerator, rates.denominator, rates.rate
    v["bend"] = v["tuned"] = v["gain"] = v["gain_wanted"] = 1.0
    v["b"][0, 0] = v["a"][0, 0] = 1.0
    v["block"] = math.exp(-2 * math.pi * BLOCKER_HZ / rates.rate)
    v["gain_pole"] = 1.0 - math.exp(-1.0 / (GAIN_TIME * rates.rate))
    slots["hand"] = slots["ratio"] = 1.0
    return voice


def pickup_voice(string: String, output: Output, player: Player, rates: Rates, over_board: bool = False) -> Voice:
    """Makes a silent string under its pickups, with their circuit and the player's hand; maybe `over_board`."""
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
    v["rounding"], v["strike_width"], v["angle"] = player.rounding, player.strike_width, player.pluck_angle
    return voice


def new_performer(instrument: Instrument, frets: int, seed: int = 0) -> NDArray[np.void]:
    """Makes the performer, (1,) PERFORMER, of `instrument` with `frets` frets a string; `seed` of its unevenness."""
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
