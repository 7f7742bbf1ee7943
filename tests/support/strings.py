"""Strings, basses and trials: the measured G string of Issanchou et al. (2018), and seeded random ones."""

from __future__ import annotations

import dataclasses
import math
from typing import Any

import numpy as np

from livebass.model import modes
from livebass.model.instrument import (
    Effects,
    Instrument,
    Neck,
    Output,
    Player,
    Pluck,
    Speaking,
    String,
    frets_from_geometry,
    speaking,
)
from livebass.model.neck import Admittance, Resonance
from livebass.model.trial import Trial
from support.quiet import without_noise

# First 34 modes of the open G string as published with siconos-tutorials, examples/mechanics/Music,
# Apache-2.0.
FREQUENCIES = (
    97.97319798, 196.4633581, 294.640159, 393.0242695, 491.3615084, 589.8908659, 688.258847, 786.6015726,
    885.3537435, 983.9705421, 1082.61417, 1181.132809, 1281.301803, 1379.93154, 1478.702673, 1578.27744,
    1677.68542, 1777.164147, 1877.178133, 1976.994232, 2076.837602, 2177.096765, 2278.00361, 2378.52936,
    2478.490936, 2580.483649, 2682.072545, 2783.634986, 2885.431731, 2987.265367, 3089.800123, 3192.715507,
    3295.333261, 3398.555176,
)  # fmt: skip  # Hz
DAMPINGS = (
    0.1964190303, 0.1380532245, 1.648686774, 0.4588354669, 1.42287901, 0.6834789123, 0.4033669222,
    3.506936363, 0.4599322937, 0.5703603859, 1.158989366, 0.949282015, 2.065624006,
    0.6619617052, 2.383837921, 2.324507479,
    2.06238037, 1.001426903, 1.618008726, 1.722606366, 1.917098798, 2.631595809, 1.688182462, 2.929739078,
    4.362003108, 4.624351203, 3.414597667, 3.437114955, 4.225804703, 4.239978732, 3.764060412, 4.825022556,
    5.510425224, 5.472601047,
)  # fmt: skip  # 1/s
FRETS_MM = (48, 94, 137, 178, 216, 253, 287, 319, 350, 379, 406, 432, 456, 479, 501, 521, 540, 558, 576, 591)
HEIGHTS_MM = (
    -0.63, -0.88, -1.13, -1.33, -1.58, -1.73, -1.88, -1.98, -2.13, -2.18, -2.23,
    -2.33, -2.33, -2.33, -2.33, -2.33, -2.33, -2.335, -2.335, -2.335,
)  # fmt: skip


def g_string() -> String:
    """The open G string of section 4 of the paper, with its published modes."""
    return String(
        name="G",
        open_note=43,
        length=0.863,
        linear_density=6.69e-3,
        tension=191.6,
        diameter=1.14e-3,
        inharmonicity=3.5e-5,
        stiffness_law="paper",
        law_fundamental=97.976,
        measured_frequencies=FREQUENCIES,
        measured_dampings=DAMPINGS,
    )


def g_neck(stiffness: float = 1e13) -> Neck:
    """The neck with the paper's measured frets."""
    return Neck(tuple(x / 1e3 for x in FRETS_MM), tuple(h / 1e3 for h in HEIGHTS_MM), contact_stiffness=stiffness)


def paper_g(stiffness: float = 1e13) -> Speaking:
    """The paper's open G string over its 20 frets; 863 grid steps."""
    return speaking(g_string(), g_neck(stiffness), 0)


def paper_bass() -> Instrument:
    """A bass with only the measured G string."""
    return Instrument("paper", "the measured G string", (g_string(),), (g_neck(),), Output(), Player())


def pluck(apex: float = 3.6e-3, position: float = 0.64) -> Pluck:
    """A pluck of `apex` at `position` (m); case B of the paper by default."""
    return Pluck(apex, position)


def case_b(
    modes: int = 862,
    contact_rate: float = 8e6,
    duration: float = 0.06,
    output_rate: float = 44100.0,
    lossless: bool = False,
) -> Trial:
    """Case B of the paper: plucked 3.6 mm at 0.64 m, heard 9 mm from the saddle."""
    s = paper_g()
    return Trial(s, pluck(), modes, contact_rate, output_rate, duration, s.length - 9e-3, lossless)


def tiny(
    points: int = 24, modes: int = 23, contact_rate: float = 2e5, duration: float = 0.01,
    stiffness: float = 1e12, exponent: float = 1.5, lossless: bool = False, output_rate: float = 0.0,
) -> Trial:  # fmt: skip
    """A short coarse string over three frets, for slow solvers."""
    string = String(
        "T", 60, 0.3, linear_density=5e-3, tension=5e-3 * (0.6 * 440 * 2 ** (-9 / 12)) ** 2, diameter=1e-3,
        inharmonicity=2e-4, extra_damping=0.0 if lossless else 20.0,
    )  # fmt: skip
    contact = {"contact_stiffness": stiffness, "contact_exponent": exponent, "grid_step": 0.3 / points}
    neck = Neck((0.05, 0.1, 0.15), (-0.5e-3, -0.7e-3, -0.9e-3), **contact)
    s = speaking(string, neck, 0)
    return Trial(s, Pluck(3e-3, 0.2), modes, contact_rate, output_rate or contact_rate, duration, 0.28, lossless)


def oblique(trial: Trial, angle: float, apex: float) -> Trial:
    """`trial` plucked by `apex` (m) at `angle` (rad) from the normal of the board."""
    return dataclasses.replace(trial, pluck=dataclasses.replace(trial.pluck, angle=angle, apex=apex))


def losing(trial: Trial, stiffness: float, loss: float) -> Trial:
    """`trial` over frets of `stiffness` (K, SI) that lose `loss` s/m."""
    s = dataclasses.replace(trial.speaking, contact_stiffness=stiffness, contact_loss=loss)
    return dataclasses.replace(trial, speaking=s)


def with_own_across(s: Speaking) -> Speaking:
    """`s` with its own neck stiffness across, and v a little longer."""
    back = Admittance((Resonance(110.0, 20.0, 0.4), Resonance(730.0, 30.0, 0.3)), (), 1e-3)
    across = Admittance((Resonance(180.0, 20.0, 0.4), Resonance(1210.0, 30.0, 0.3)), (), 4e-4)
    string = dataclasses.replace(s.string, measured_frequencies=(), measured_dampings=())
    return dataclasses.replace(
        s, string=string, admittance=back, own_across=True, admittance_across=across, longer_across=4e-4
    )


def yielding(bass: Instrument, longer: float = 2e-3) -> Instrument:
    """`bass` over frets that yield and lose, on necks that are stiffer across, v longer by `longer` (m)."""
    own = {"stiffness_across": 3.0, "stop_across": 0.4, "longer_across": longer}
    necks = tuple(dataclasses.replace(n, contact_stiffness=3e8, contact_loss=15.0, **own) for n in bass.necks)
    return dataclasses.replace(bass, necks=necks)


def turn_axes(bass: Instrument, degrees: float = 40.0) -> Instrument:
    """`yielding(bass)`, the axes of its necks turned: u and v exchange energy."""
    bass = yielding(bass)
    necks = tuple(dataclasses.replace(n, axes_turned=math.radians(degrees)) for n in bass.necks)
    return dataclasses.replace(bass, necks=necks)


def even(bass: str | Instrument = "jazz-finger", **player: Any) -> Instrument:
    """A preset, or a bass, whose player plays every note alike and without noise; `player` sets further numbers."""
    return without_noise(bass, **{"unevenness": 0.0, "release_spread": 0.0, **player})


def behind(bass: Instrument, **effects: Any) -> Instrument:
    """`bass` with these effects after it."""
    return dataclasses.replace(bass, effects=Effects(**effects))


def far_from_frets(bass: Instrument, **neck: float) -> Instrument:
    """`bass` with frets and board out of reach; `neck` sets numbers of its necks."""

    def lower(n: Neck) -> Neck:
        heights, surface = tuple(h - 0.03 for h in n.fret_heights), tuple((x, h - 0.03) for x, h in n.surface)
        return dataclasses.replace(n, fret_heights=heights, surface=surface, **neck)

    return dataclasses.replace(bass, necks=tuple(lower(n) for n in bass.necks))


def linear(bass: Instrument, **neck: float) -> Instrument:
    """`far_from_frets`, with constant tension."""
    bass = far_from_frets(bass, **neck)
    return dataclasses.replace(bass, strings=tuple(dataclasses.replace(s, axial_stiffness=0.0) for s in bass.strings))


def one_string(bass: Instrument, i: int) -> Instrument:
    """`bass` with only its string `i`, so that a key is a fret; it keeps its slap."""
    player = dataclasses.replace(bass.player, slapped_strings=max(0, min(1, bass.player.slapped_strings - i)))
    return dataclasses.replace(bass, strings=(bass.strings[i],), necks=(bass.necks[i],), player=player)


def random_trial(seed: int, duration: float = 0.03) -> Trial:
    """A seeded random string, fret, neck, pluck and pair of rates, which brute force solves in less than 2 s.

    Plucks reach 1.2 to 5 times the apex that grazes a fret; one in three sets of modes is full.
    """
    rng = np.random.default_rng(seed)
    length, density = rng.uniform(0.6, 0.9), math.exp(rng.uniform(math.log(3e-3), math.log(4e-2)))
    note, dead = int(rng.integers(28, 56)), float(rng.choice([0.0, 0.0, 15.0]))
    tension = density * (2 * length * 440 * 2 ** ((note - 69) / 12)) ** 2
    stiffness = 10 ** rng.uniform(-5, -3.7)
    string = String(
        "R", note, length, linear_density=density, tension=tension, diameter=rng.uniform(5e-4, 2.6e-3),
        inharmonicity=stiffness, extra_damping=dead,
    )  # fmt: skip
    count = int(rng.integers(12, 25))
    x, h = frets_from_geometry(
        length, count, rng.uniform(1.2e-3, 3e-3), rng.uniform(0, 4e-4), rng.uniform(3e-4, 8e-4),
        {int(rng.integers(1, count)): rng.uniform(0, 1e-4)},
    )  # fmt: skip
    law = {
        "contact_stiffness": 10 ** rng.uniform(9, 14),
        "contact_exponent": float(rng.choice([1.5, 1.5, 1.5, 1.3, 2.0])),
        "grid_step": float(rng.choice([1e-3, 1e-3, 1.5e-3])),
    }
    neck = Neck(x, h, **law)
    s = speaking(string, neck, int(rng.integers(0, 10)))
    position = s.length * rng.uniform(0.5, 0.95)
    apex = min(modes.grazing_apex(s, position) * rng.uniform(1.2, 5), 0.010)
    full = rng.random() < 1 / 3
    number = s.grid_points - 1 if full else int(rng.integers(s.grid_points // 4, s.grid_points - 1))
    # above twice the highest mode, which keeps the interpolation between fine steps well posed
    minimum = max(3e5, 2.1 * modes.frequencies(s, number)[-1])
    output = float(rng.choice([22050.0, 44100.0, 48000.0, 96000.0]))
    rate = math.exp(rng.uniform(math.log(minimum), math.log(max(8e6, minimum))))
    simple = output if rng.random() < 0.5 else 1000.0
    rate = simple * math.ceil(rate / simple)
    sensor = s.length - rng.uniform(0.005, 0.1)
    return Trial(s, Pluck(apex, position, rng.uniform(3e-3, 1e-2)), number, rate, output, duration, sensor)
