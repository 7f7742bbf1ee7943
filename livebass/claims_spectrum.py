"""Claims of section 4.1 about spectrum and pitch: energy in high modes, characteristic frequency, glide."""

from __future__ import annotations

import math

import numpy as np

from livebass.claims_expect import AtLeast, AtMost, Between, Claim, Falling, Rising, Value
from livebass.claims_measure import centroid_at, contrast, frets_and_pitch, fundamental_at, high_share, set_times
from livebass.claims_runs import STATES_EVERY, Run

EARLY = 0.1  # s
RAISED = 0.1  # part of the energy in high modes that counts as a transfer in progress


def enrichment(run: Run) -> Value:
    """Greatest part of the energy in high modes over that at the release."""
    share = high_share(run)
    return float(share.max() / share[0])


def transfer_end(run: Run) -> float:
    """Until when high modes have `RAISED` of the energy, s."""
    over = np.flatnonzero(high_share(run) > RAISED)
    return float(over[-1] * STATES_EVERY / run.rate) if over.size else 0.0


def highest_centroid(run: Run) -> float:
    """The highest characteristic frequency of the first 0.1 s, Hz."""
    time, nu = run.centroid
    return float(nu[time < EARLY].max())


def least_ratio(above: Run, below: Run) -> Value:
    """Characteristic frequency of one over that of the other, the least of all times."""
    return float((above.centroid[1] / below.centroid[1]).min())


def variation(run: Run) -> Value:
    """Range of the fundamental over the whole signal, relative."""
    nu = run.pitch.frequency_hz
    return float(np.ptp(nu) / nu[-1])


def stairs(run: Run) -> Value:
    """Fundamental at each set of contacts but the first, Hz."""
    return fundamental_at(run, set_times(run)[1:])


def zone(run: Run, frequency: float) -> Value:
    """Level of 500 Hz of u over the bands beside it, 0.02 to 0.3 s, dB."""
    return contrast(run.motion.displacement_m, run.rate, frequency, 500, 0.02, 0.3)


def zones_across(run: Run, frequencies: tuple[float, ...]) -> Value:
    """The same with 200 Hz of v, 0.02 to 0.6 s."""
    v = run.motion.across_m
    return [math.nan if v is None else contrast(v, run.rate, nu, 200, 0.02, 0.6) for nu in frequencies]


CLAIMS = (
    Claim(
        "a-centroid", "4.1.1",
        "In case A, nu_c slightly decreases in time",
        "nu_c at 0.95 s over that at 0.05 s",
        "", Between(0.5, 0.98), ("a",), lambda run: centroid_at(run, 0.95) / centroid_at(run, 0.05),
    ),
    Claim(
        "b-energy", "4.1.1",
        "a large amount of energy is transmitted to higher modes",
        "part of the energy above mode 20: greatest over at the release, case B",
        "", AtLeast(5), ("b",), enrichment,
    ),
    Claim(
        "b-4500", "4.1.1",
        "some reinforced spectral zones can be clearly identified, for instance around 4500 Hz",
        "4250 to 4750 Hz over the bands beside it, case B, 0.02 to 0.3 s",
        "dB", AtLeast(3), ("b",), lambda run: zone(run, 4500),
    ),
    Claim(
        "abc-centroid", "4.1.1",
        "In cases B and C, the spectral enrichment occurring in the first instants is clearly visible, and more "
        "pronounced in case C",
        "greatest nu_c of the first 0.1 s, cases A, B, C",
        "Hz", Rising(0.5), ("a", "b", "c"), lambda *runs: [highest_centroid(run) for run in runs],
    ),
    Claim(
        "b-starts-high", "4.1.1",
        "the period at the very beginning of the signal seems to be shorter than in case A",
        "fundamental at the beginning, cases A and B",
        "Hz", Rising(0.05), ("a", "b"), lambda *runs: [fundamental_at(run, [0.0])[0] for run in runs],
    ),
    Claim(
        "b-glide", "4.1.1",
        "the fundamental frequency is higher than in the rest of the signal [...] a substantial frequency glide",
        "fundamental at the beginning over that at 0.5 s, case B",
        "", AtLeast(1.05), ("b",), lambda run: fundamental_at(run, [0.0])[0] / fundamental_at(run, [0.5])[0],
    ),
    Claim(
        "b-stairs", "4.1.1",
        "a decrease of the fundamental frequency arises each time the neck is hit",
        "fundamental at each set of contacts, case B",
        "Hz", Falling(), ("b",), stairs,
    ),
    Claim(
        "b-frets-pitch", "4.1.1",
        "the smaller the number of hit frets is, the lower the frequency is",
        "correlation of both over the sets, case B",
        "", AtLeast(0.8), ("b",), frets_and_pitch,
    ),
    Claim(
        "c-energy", "4.1.2",
        "the energy transfer to high frequencies is more substantial than in case B",
        "greatest part of the energy above mode 20, cases B and C",
        "", Rising(0.2), ("b", "c"), lambda *runs: [float(high_share(run).max()) for run in runs],
    ),
    Claim(
        "c-energy-longer", "4.1.2",
        "[the energy transfer] lasts longer",
        "until when modes above 20 have a tenth of the energy, cases B and C",
        "s", Rising(0.2), ("b", "c"), lambda *runs: [transfer_end(run) for run in runs],
    ),
    Claim(
        "c-centroid", "4.1.2",
        "much higher characteristic frequencies during the whole signal",
        "nu_c of C over that of B, the least of 1 s",
        "", AtLeast(1.2), ("c", "b"), least_ratio,
    ),
    Claim(
        "c-stairs", "4.1.2",
        "The staircase-like behaviour of the fundamental frequency is also retrieved",
        "fundamental at each set of contacts, case C",
        "Hz", Falling(0.01), ("c",), stairs,
    ),
    Claim(
        "glide-a", "4.1.2",
        "the pitch glide is only driven by the contact times",
        "relative range of the fundamental, case A",
        "", AtMost(2e-3), ("a",), variation,
    ),
    Claim(
        "glide-c-far", "4.1.2",
        "and not by the geometrical nonlinearity",
        "relative range of the fundamental, case C with the frets out of reach",
        "", AtMost(2e-3), ("c-far",), variation,
    ),
    Claim(
        "oblique-low", "4.1.3",
        "for the horizontal displacement v, a low energy for the frequency about 2400 Hz",
        "2300 to 2500 Hz over the bands beside it",
        "dB", AtMost(-2), ("oblique",), lambda run: zones_across(run, (2400,)),
    ),
    Claim(
        "oblique-zones", "4.1.3",
        "and reinforced frequencies around 600, 900 and 1400 Hz are observed",
        "200 Hz about these over the bands beside them",
        "dB", AtLeast(2), ("oblique",), lambda run: zones_across(run, (600, 900, 1400)),
    ),
)  # fmt: skip
