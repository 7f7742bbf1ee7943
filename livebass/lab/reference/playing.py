"""`play`: a pluck under hands by brute force, with all energies; livebass.lab.reference.stepping has the equations.

A string of N modes cannot bend sharply under a hand: with 862 modes of the G string, a stop is a spring of at most
2e6 N/m, which passes 7 % of a wave at 10 kHz. So hands feel the static compliance of all modes that do not swing, far
beyond the grid's (`YIELDING`). Frets feel only the grid's, as in the paper.

With 800 modes at 4.8 MHz, 0.1 s under a stop and three fingers takes 2 s without frets, and 3 s over 20 frets.
"""

from __future__ import annotations

import dataclasses
import math
import time
from collections.abc import Sequence

import numpy as np

from livebass.lab.reference.hands import Finger, Hand, Mass, Stop
from livebass.lab.reference.laws import ABSENT, CONTACT, FLESH, LINEAR, Laws, absent
from livebass.lab.reference.plan import Modes, Plan, State, at_rest, lay, make_plan, make_state
from livebass.lab.reference.solver import CHUNK
from livebass.lab.reference.stepping import FINGER, MASS, STOP, Ears, Grips, Held, Pace, Sheets, run, stored_energy
from livebass.model import modes
from livebass.model.trial import Trial, initial_amplitudes, initial_amplitudes_across
from livebass.rows.arrays import Floats, Ints
from livebass.rows.bounds import refusal, within

YIELDING = 200_000  # string modes that a hand feels: those that do not swing follow its force at once


@dataclasses.dataclass(frozen=True)
class Balance:
    """The energy of a string with H hands at n times, J; energy taken and put in counts from the beginning."""

    time_s: Floats  # (n,), half a fine step after the samples
    string_j: Floats  # (n,), stored in both polarisations
    frets_j: Floats  # (n,), stored in contact with the frets
    hands_j: Floats  # (H, n), stored in the spring or contact of a hand, and in the motion of a mass
    damping_j: Floats  # (n,), taken by the string's own losses (and by the static compliance of omitted modes)
    friction_j: Floats  # (n,), taken by friction on the frets
    contact_j: Floats  # (n,), taken by the loss of contact with the frets
    taken_j: Floats  # (H, n), taken by a finger, or by the loss of a mass's contact
    put_in_j: Floats  # (H, n), work of a hand, plus energy it brought when it came, less energy it took when it left

    @property
    def stored_j(self) -> Floats:
        """All stored energy, (n,)."""
        return self.string_j + self.frets_j + self.hands_j.sum(0)

    @property
    def closing_j(self) -> Floats:
        """Stored + lost - put in, (n,): constant."""
        return self.stored_j + self.lost_j - self.put_in_j.sum(0)

    @property
    def lost_j(self) -> Floats:
        """All energy taken so far, (n,)."""
        return self.damping_j + self.friction_j + self.contact_j + self.taken_j.sum(0)

    @property
    def error(self) -> float:
        """Deviation of `closing_j` from its first value, relative to the greatest energy stored or taken."""
        closing, maximum = self.closing_j, self.stored_j + self.lost_j
        return float(np.abs(closing - closing[0]).max() / (maximum.max() or 1.0))


@dataclasses.dataclass(frozen=True)
class Played:
    """Motion of a string with H hands: n samples at p places, and k contacts with frets sorted by step, then index."""

    time_s: Floats  # (n,)
    displacement_m: Floats  # (p, n), u
    velocity_m_s: Floats  # (p, n), du/dt
    across_m: Floats | None  # (p, n), v; None: the string never leaves its plane
    across_velocity_m_s: Floats | None  # (p, n)
    hand_force_n: Floats  # (H, n), N on the string, upwards
    hand_height_m: Floats  # (H, n), of a stop's point or a mass; NaN while absent
    balance: Balance
    contact_step: Ints  # (k,), as in livebass.model.trial.Motion
    contact_index: Ints  # (k,)
    contact_rate_hz: float
    wall_s: float  # s of the solver, without compilation
    states: Floats | None = None  # (len(Trial.states), polarisations, 2, modes), as in livebass.model.trial.Motion


def hand_shape(trial: Trial, hand: Hand, count: int) -> Floats:
    """s_j = phi_j(x) exp(-(k_j a)^2 / 2) of a hand of half-width a at x, modes 1 to `count`, (count,), m^-0.5."""
    k = np.arange(1, count + 1) * (math.pi / trial.speaking.length)
    shape = modes.shapes(trial.speaking, count, np.array([hand.place]))[0]
    return np.asarray(shape * np.exp(-((k * hand.width) ** 2) / 2))


def _plan(plan: Plan, trial: Trial, hands: Sequence[Hand], sign: Floats) -> Plan:
    """The plan of `trial` with one more point for each hand, after the contact points."""
    s, count = trial.speaking, trial.modes
    full = s.grid_points - 1
    rows = np.array([hand_shape(trial, hand, full) for hand in hands]).reshape(len(hands), full) * sign[:, None]
    places = modes.shapes(s, full, np.asarray(s.contact_position))
    omega = 2 * math.pi * modes.frequencies(s, full)
    every = np.vstack([places, rows])
    left_out = every[:, count:] / omega[count:]
    compliance = s.step / s.string.linear_density * left_out @ left_out.T
    coupling = plan.dt**2 / s.string.linear_density * s.step * (every[:, :count] @ every[:, :count].T) + compliance
    points = plan.height.size  # these are as without hands
    compliance[:points, :points], coupling[:points, :points] = plan.compliance, plan.coupling
    finest = max(full, YIELDING)
    finer = np.array([hand_shape(trial, hand, finest)[full:] for hand in hands]).reshape(len(hands), finest - full)
    finer /= 2 * math.pi * modes.frequencies(s, finest)[full:]
    yields = s.step / s.string.linear_density * (finer @ finer.T) * np.outer(sign, sign)
    compliance[points:, points:] += yields
    coupling[points:, points:] += yields
    for h, hand in enumerate(hands):
        if isinstance(hand, Mass):
            coupling[points + h, points + h] += plan.dt**2 * plan.dx / hand.mass
    return plan._replace(
        shape=np.ascontiguousarray(np.vstack([plan.shape, rows[:, :count]])),
        height=np.concatenate([plan.height, np.zeros(len(hands))]),
        coupling=coupling,
        compliance=compliance,
    )


def _state(plan: Plan, points: int, amplitudes: Floats) -> State:
    """The state at step 0 from q and dq/dt, (polarisations, 2, N); only the last rows of `plan` are hands."""
    second = amplitudes[1] if plan.across.size else np.zeros((2, 0))
    frets = plan._replace(shape=plan.shape[:points], height=plan.height[:points])
    state = make_state(frets, amplitudes[0, 0], second[0], amplitudes[0, 1], second[1])
    row, zero = plan.shape[points:], np.zeros(plan.height.size - points)

    def joined(contacts: Floats, hands: Floats) -> Floats:
        return np.concatenate([contacts, hands])

    q, d, e, f = state.q, state.d, state.q_across, state.d_across
    v = (row @ e, row @ (e - f)) if plan.across.size else (zero, zero)
    return state._replace(
        eta=joined(state.eta, -row @ q),
        eta_before=joined(state.eta_before, -row @ (q - d)),
        force=joined(state.force, zero),
        force_before=joined(state.force_before, zero),
        v=joined(state.v, v[0]),
        v_before=joined(state.v_before, v[1]),
        friction=joined(state.friction, zero),
        friction_before=joined(state.friction_before, zero),
    )


class _Player:
    """A string and its hands during play: brings hands and takes them away between runs of fine steps."""

    def __init__(self, trial: Trial, hands: Sequence[Hand], begin: Floats | None) -> None:
        count, points = len(hands), len(trial.speaking.contact_position)
        sign = np.array([1.0 if isinstance(h, Stop) and h.side < 0 else -1.0 for h in hands])
        self.hands, self.points = hands, points
        alone = make_plan(trial)
        self.plan = _plan(alone, trial, hands, sign)
        rest = np.zeros(trial.modes)
        if begin is None:
            rest, begin = at_rest(alone), np.zeros((2, 2, trial.modes))
            begin[0, 0], begin[1, 0] = initial_amplitudes(trial), initial_amplitudes_across(trial)
        self.state = _state(self.plan, points, begin)
        lay(self.plan, self.state, rest)
        room = points + count
        frets = np.arange(room) < points
        self.laws = Laws(
            np.where(frets, CONTACT, ABSENT), np.where(frets, self.plan.stiffness, 0.0),
            np.where(frets, self.plan.exponent, 1.0), np.where(frets, self.plan.loss, 0.0),
        )  # fmt: skip
        self.across = absent(room)
        kind = [FINGER if isinstance(h, Finger) else STOP if isinstance(h, Stop) else MASS for h in hands]
        mass = np.array([h.mass if isinstance(h, Mass) else 0.0 for h in hands])
        y, move, across, across_before, taken, put_in = np.zeros((6, count))
        kinds = np.array(kind, dtype=np.int64)
        self.grips = Grips(kinds, sign, mass, y, move, across, across_before, taken, put_in, np.zeros(3))
        self.string = Held(self.plan, self.laws, self.across, self.state, self.grips)
        rate = trial.contact_rate
        self.on = [round(h.start * rate) for h in hands]
        ends = [h.end + h.lifting if isinstance(h, Finger) else h.end for h in hands]
        self.off = [round(end * rate) if math.isfinite(end) else None for end in ends]
        self.begun = [(0.0, 0.0, 0.0, 0.0)] * count  # u and du/dt, v and dv/dt as a hand came

    def next_turn(self, step: int) -> int:
        """The next step after `step` at which a hand comes or leaves; far away if none does."""
        return min((n for n in (*self.on, *self.off) if n is not None and n > step), default=2**62)

    def turn(self, step: int) -> None:
        """Takes away the hands that end at `step` and brings those that begin there, with their energy."""
        for h, hand in enumerate(self.hands):
            if step == self.off[h]:
                before = self._energy()
                self._leave(h)
                self.grips.put_in[h] += self._energy() - before
            if step == self.on[h]:
                before = self._energy()
                self._come(h, hand)
                self.grips.put_in[h] += self._energy() - before

    def _energy(self) -> float:
        """All energy stored half a step ago, J."""
        energy = np.empty(2 + len(self.hands))
        stored_energy(self.string, energy)
        return float(energy.sum())

    def _leave(self, h: int) -> None:
        m, state, grips = self.points + h, self.state, self.grips
        self.laws.kind[m] = self.across.kind[m] = ABSENT
        state.eta[m] -= grips.sign[h] * grips.y[h]
        state.eta_before[m] -= grips.sign[h] * (grips.y[h] - grips.move[h])
        grips.y[h] = grips.move[h] = grips.across[h] = grips.across_before[h] = 0.0

    def _come(self, h: int, hand: Hand) -> None:
        m, dt, state, grips = self.points + h, self.plan.dt, self.state, self.grips
        sign = grips.sign[h]
        u, before = -sign * state.eta[m], -sign * state.eta_before[m]
        v, v_before = sign * state.v[m], sign * state.v_before[m]
        self.begun[h] = (u, (u - before) / dt, v, (v - v_before) / dt)
        oblique = self.plan.across.size > 0
        law, dx = self.laws, self.plan.dx
        law.loss[m], law.exponent[m] = 0.0, 1.0
        if isinstance(hand, Finger):
            law.kind[m], law.stiffness[m] = LINEAR, 0.0
            self.across.kind[m] = LINEAR if oblique else ABSENT
            return
        law.stiffness[m] = hand.stiffness / dx
        if isinstance(hand, Stop):
            law.kind[m] = LINEAR if hand.side == 0 else FLESH
            y = float(hand.path(np.zeros(1), *self.begun[h][:2])[0])
            move = u - before  # its spring is not strained when it comes
            if hand.across is not None and oblique:
                self.across.kind[m], self.across.stiffness[m] = LINEAR, hand.stiffness / dx
                grips.across[h] = float(hand.across(np.zeros(1), *self.begun[h][2:])[0])
                grips.across_before[h] = grips.across[h] - (v - v_before)
        else:
            law.kind[m], law.exponent[m], law.loss[m] = FLESH, hand.exponent, hand.loss / (2 * dt)
            y = u if hand.height is None else hand.height
            move = -hand.speed * dt
            if y < u:
                rule = f"at least that of the string, {u * 1e3:g} mm"
                raise refusal("height of a Mass", rule, f"{y * 1e3:g} mm")
        grips.y[h], grips.move[h] = y, move
        state.eta[m] += sign * y
        state.eta_before[m] += sign * (y - move)

    def drive(self, first: int, last: int) -> Floats:
        """Returns the hands' motion in steps `first` to `last` - 1, for u and for v: see `stepping.run`."""
        instants = np.arange(first, last, dtype=np.float64) * self.plan.dt
        inputs = np.zeros((2, last - first, len(self.hands)))
        for h, hand in enumerate(self.hands):
            if not self.on[h] <= first:
                continue
            since = instants - self.on[h] * self.plan.dt
            if isinstance(hand, Finger):
                inputs[0, :, h] = hand.resistances(instants)
            elif isinstance(hand, Stop):
                u, speed, v, v_speed = self.begun[h]
                inputs[0, :, h] = hand.path(since + self.plan.dt, u, speed)
                if hand.across is not None:
                    inputs[1, :, h] = hand.across(since + self.plan.dt, v, v_speed)
            elif hand.force is not None:
                inputs[0, :, h] = hand.force(since)
        return inputs


def _pace(of: Modes, dt: float) -> Pace:
    """Coefficients of modal velocities for fine steps of `dt` s."""
    turn, shrink = of.omega * dt, of.sigma * dt
    pace = of.omega / (2 * np.sin(turn))
    return Pace(2 * pace * np.sinh(shrink) - of.sigma, pace * np.exp(shrink), pace * np.exp(-shrink))


def _ears(trial: Trial, plan: Plan, listen: Sequence[float] | None) -> Ears:
    """Listening places. Raises ValueError for a place off the string, and for rates that do not fit."""
    s, every = trial.speaking, round(trial.contact_rate / trial.output_rate)
    if abs(every * trial.output_rate - trial.contact_rate) > 1e-9 * trial.contact_rate:
        rule = f"a multiple of the output rate, {trial.output_rate:g} Hz"
        raise refusal("contact rate", rule, f"{trial.contact_rate:g} Hz")
    across = trial.sensor if trial.sensor_v is None else trial.sensor_v
    places = [trial.sensor] if listen is None else list(listen)
    over = [across] if listen is None else places
    for place in (*places, *over):
        within("place to listen", place * 1e3, 0, s.length * 1e3, "mm")
    return Ears(
        step=every * np.arange(trial.samples),
        offset=np.zeros(trial.samples),
        place=modes.shapes(s, trial.modes, np.array(places)),
        place_across=modes.shapes(s, trial.modes, np.array(over)),
        u=_pace(plan.u, plan.dt),
        v=_pace(plan.v, plan.dt),
        states=np.array(trial.states, dtype=np.int64),
        every=every,
    )


def play(
    trial: Trial,
    hands: Sequence[Hand] = (),
    listen: Sequence[float] | None = None,
    frets: bool = True,
    begin: Floats | None = None,
) -> Played:
    """The motion of `trial` under `hands` by brute force, with all energies, each sample.

    listen: places, m from the stop; None: the sensors of `trial`. frets: False removes the obstacles. begin: q and
    dq/dt at time 0, (polarisations, 2, modes), as in `states` of `Motion` and `Played`; None: plucked, at rest. The
    second polarisation exists if `trial` is oblique, whatever `begin` holds.

        stop = Stop(0.094, hammer(-0.9e-3, 1.2), start=0.3, end=0.5, across=landing(0.0, 2e-3))
        played = play(trial, [stop, Finger(0.086, 3.0, start=0.3), Mass(0.6, 2.0, force=lift(1.5, 3e-3))], listen=[0.7])
        played.velocity_m_s[0], played.hand_force_n[0], played.balance.error

    Raises ValueError for an invalid hand, place or rate, for a mass that would begin inside the string, and for an
    overdamped mode; ArithmeticError if the equation of the forces does not converge.
    """
    s = trial.speaking
    if not frets:
        s = dataclasses.replace(s, contact_fret=(), contact_position=(), contact_height=())
        trial = dataclasses.replace(trial, speaking=s)
    for hand in hands:
        if not 0 < hand.place < s.length:
            rule = f"between 0 and {s.length * 1e3:g} mm"
            raise refusal(f"place of a {type(hand).__name__}", rule, f"{hand.place * 1e3:g} mm")
    polarisations = 2 if trial.oblique else 1
    if begin is not None and begin.shape != (polarisations, 2, trial.modes):
        raise refusal("begin", f"of shape {(polarisations, 2, trial.modes)}", begin.shape)
    player = _Player(trial, hands, begin)
    ears, samples, count = _ears(trial, player.plan, listen), trial.samples, len(hands)
    heard, per_hand = (ears.place.shape[0], 2, samples), (count, samples)
    sheets = Sheets(
        displacement=np.zeros(heard), velocity=np.zeros(heard),
        states=np.zeros((len(trial.states), 2, 2, trial.modes)), force=np.zeros(per_hand), height=np.zeros(per_hand),
        total=np.zeros(samples), stored=np.zeros((2 + count, samples)), lost=np.zeros((3, samples)),
        taken=np.zeros(per_hand), put_in=np.zeros(per_hand),
        onset=np.zeros((CHUNK * player.points // 2 + player.points, 2), dtype=np.int64),
    )  # fmt: skip
    found: list[Ints] = []

    def step(first: int, last: int) -> None:
        number = run(player.string, player.drive(first, last), first, last, ears, sheets)
        if number < 0:
            raise ArithmeticError(f"the forces at step {-number} did not converge")
        found.append(sheets.onset[:number].copy())

    step(0, 0)  # compiles now: wall_s does not count it
    start, first, end = time.perf_counter(), 0, trial.steps + 1
    while first < end:
        player.turn(first)
        last = min(first + CHUNK, player.next_turn(first), end)
        step(first, last)
        first = last
    contacts = np.concatenate(found)
    contacts = contacts[contacts[:, 0] <= trial.steps]
    instants = np.arange(samples) / trial.output_rate
    return Played(
        time_s=instants,
        displacement_m=sheets.displacement[:, 0],
        velocity_m_s=sheets.velocity[:, 0],
        across_m=sheets.displacement[:, 1] if polarisations == 2 else None,
        across_velocity_m_s=sheets.velocity[:, 1] if polarisations == 2 else None,
        hand_force_n=sheets.force,
        hand_height_m=sheets.height,
        balance=Balance(
            instants + player.plan.dt / 2, sheets.stored[0], sheets.stored[1], sheets.stored[2:],
            sheets.lost[0], sheets.lost[1], sheets.lost[2], sheets.taken, sheets.put_in,
        ),
        contact_step=contacts[:, 0].copy(),
        contact_index=contacts[:, 1].copy(),
        contact_rate_hz=trial.contact_rate,
        wall_s=time.perf_counter() - start,
        states=sheets.states[:, :polarisations] if trial.states else None,
    )  # fmt: skip
