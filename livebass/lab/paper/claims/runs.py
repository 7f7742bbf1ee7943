"""The runs used by the claims, the paper's cases and variations of them, and measurements in a run.

Times in s, frequencies in Hz, levels in dB. A measurement that a run does not yield is NaN, which no claim passes.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from livebass.lab.analysis.motion import Solved, first_mode, first_of, modal_energies, state_samples, states_of
from livebass.lab.paper.cases import CASES, Case, raise_fret, soften
from livebass.lab.paper.solving import Job, solve_all
from livebass.lab.reference import solver as reference
from livebass.model import modes
from livebass.model.quality import MAX_MODES
from livebass.model.trial import Motion, Trial
from livebass.rows.arrays import Floats
from livebass.sound.analysis import characteristic_frequencies, frame_times, relative_variation, spectrogram

STATES_EVERY = 512  # output samples between saved states of the modes, 10 ms
SHORT = 0.02  # s of brute force: the first two sets of contacts of case B
ENERGY_EVERY = 50  # fine steps
SHAPE_TIMES = (3.5e-3, 3.9e-3, 4.1e-3, 4.3e-3, 4.7e-3)  # s, of figure 8
APEX, PLACE, ROUNDING = (-5e-5, 5e-5), (-8e-3, 4e-3), (2e-3, 6e-3)  # m, left open by the paper for a pluck
SEED = 2018


@dataclass(frozen=True)
class Pull:
    """A pluck that the paper may have made: it gives apexes to 0.1 mm, places to 1 cm, and no rounding."""

    apex: float  # m, added to the paper's apex
    place: float  # m, added to the paper's place
    rounding: float  # m

    def of(self, case: Case) -> Case:
        """`case` with this pluck."""
        apex, position = case.apex + self.apex, case.position + self.place
        return replace(case, apex=apex, position=position, rounding=self.rounding)


def pulls(count: int) -> list[Pull]:
    """The first `count` of the plucks, evenly spread over the range left open; always the same."""
    minimum, maximum = np.array([APEX, PLACE, ROUNDING]).T
    random = np.random.default_rng(SEED).random((count, 3))
    return [Pull(*map(float, row)) for row in minimum + random * (maximum - minimum)]


def _with_energy(trial: Trial) -> Motion:
    return reference.solve(trial, energy_every=ENERGY_EVERY)


def _finer(points: int) -> Case:
    """Case B on a grid of `points` steps, with one mode fewer, at a rate that carries the highest."""
    rate = 16e6 if points <= FINEST else 24e6
    length = CASES["b"].speaking().length
    return replace(CASES["b"], contact_rate=rate, neck=lambda neck: replace(neck, grid_step=length / points))


B, C = CASES["b"], CASES["c"]
FINEST = MAX_MODES + 1  # steps of the finest grid that the engine accepts
ENGINE: dict[str, Case] = CASES | {
    "b-twice": replace(B, contact_rate=16e6, duration=0.2),
    "b-coarse": replace(B, contact_rate=512e3, duration=0.2),
    "b-finer": _finer(FINEST),
    "b-shapes": replace(B, duration=SHAPE_TIMES[-1]),
    "c-twice": replace(C, contact_rate=32e6, duration=0.4),
    "c-far": replace(  # its frets are 30 mm lower, out of reach
        C, contact_rate=512e3, neck=lambda neck: replace(neck, fret_heights=tuple(h - 0.03 for h in neck.fret_heights))
    ),
    "b-tilted": replace(B, angle=math.radians(1)),
    "b-fret-12": replace(B, duration=0.2, neck=raise_fret(12, 1e-4)),
    "oblique-free": replace(CASES["oblique"], neck=lambda neck: replace(neck, friction=0.0)),
    **{f"bridge-{mm:g}": replace(CASES["near-bridge"], apex=mm / 1e3) for mm in (1.5, 2.5, 5)},
    **{f"k{n}": replace(CASES["soft"], neck=soften(10.0**n)) for n in (12, 11, 10)},
}
BRUTE: dict[str, tuple[Case, bool]] = {  # the beginning of case B by brute force, with its energy; bool: without losses
    "energy": (B, True),
    "energy-losses": (B, False),
    "energy-1MHz": (replace(B, contact_rate=1.024e6), True),
    "energy-102kHz": (replace(B, contact_rate=102_400), True),
    "b-half-step": (_finer(2 * B.speaking().grid_points), False),
}


def job(name: str, pull: Pull | None = None) -> Job:
    """The trial and solver of the run called `name`; runs of the engine use `pull` if given."""
    if name in BRUTE:
        case, lossless = BRUTE[name]
        return Job(replace(replace(case, duration=SHORT).trial(), lossless=lossless), _with_energy)
    trial = (pull.of(ENGINE[name]) if pull else ENGINE[name]).trial()
    if name == "b-shapes":
        return Job(replace(trial, states=state_samples(trial, 1, SHAPE_TIMES)))
    return Job(replace(trial, states=tuple(range(0, trial.samples, STATES_EVERY))))


def solve(
    names: Iterable[str], workers: int | None = None, step: Callable[[], None] = lambda: None
) -> dict[str, Solved]:
    """Solve the runs called `names`, each once: see `solve_all`. [main thread]"""
    jobs = {name: job(name) for name in names}
    solved = solve_all(jobs.values(), workers, step)
    return {name: solved[one] for name, one in jobs.items()}


WINDOW = 2048  # samples at 51.2 kHz, 40 ms
PERIODS, FILLED = 4, -30.0  # of the fundamental in a window; dB: a perturbed spectrum has more between its partials
SHOWN_HZ = 8000.0  # of the paper's spectrograms
HIGH_MODES = 20  # contacts raise the energy of the modes above this one, over 2 kHz


def first_contact(run: Solved) -> float:
    """Time of the first contact."""
    return first_of(run.contacts.time_s)


def first_fret(run: Solved) -> int:
    """The fret that the string meets first, 0 if none."""
    return int(run.contacts.fret[0]) if run.contacts.fret.size else 0


def phase(run: Solved) -> float:
    """Time from the first contact to the last."""
    return float(np.ptp(run.contacts.time_s)) if run.contacts.time_s.size else 0.0


def frets(run: Solved, start: float = 0.0, end: float = math.inf) -> list[int]:
    """The frets that the string meets from `start` to `end`, ascending."""
    c = run.contacts
    return sorted({int(f) for f in c.fret[(c.time_s >= start) & (c.time_s <= end)]})


def set_frets(run: Solved, number: int) -> list[int]:
    """The frets that the string meets in a set, ascending; 1 is the first set."""
    return sorted(set(run.contacts.fret[run.sets[number - 1]].tolist())) if number <= len(run.sets) else []


def set_sizes(run: Solved) -> list[int]:
    """Number of frets in each set."""
    return [len(set(run.contacts.fret[s].tolist())) for s in run.sets]


def set_times(run: Solved) -> list[float]:
    """Time of the first contact of each set."""
    return [float(run.contacts.time_s[s[0]]) for s in run.sets]


def fret_times(run: Solved, fret: int) -> Floats:
    """Times of all contacts with a fret."""
    return run.contacts.time_s[run.contacts.fret == fret]


def count(run: Solved, start: float, end: float) -> int:
    """Number of contacts from `start` to `end`."""
    t = run.contacts.time_s
    return int(np.count_nonzero((t >= start) & (t <= end)))


def longest_pause(run: Solved) -> list[float]:
    """Start and end of the longest time between two contacts."""
    t = run.contacts.time_s
    if t.size < 2:
        return [math.nan, math.nan]
    i = int(np.argmax(np.diff(t)))
    return [float(t[i]), float(t[i + 1])]


def fundamental_at(run: Solved, times: list[float]) -> list[float]:
    """Fundamental frequency at `times`; before the first frame, at 12.5 ms, that frame's value."""
    p = run.pitch
    return [float(f) for f in np.interp(times, p.time_s, p.frequency_hz)]


def frets_and_pitch(run: Solved) -> float:
    """Correlation, over all sets but the first, of the number of frets with the fundamental; NaN for few sets."""
    nu = fundamental_at(run, set_times(run)[1:])
    return float(np.corrcoef(set_sizes(run)[1:], nu)[0, 1]) if len(nu) > 2 else math.nan


def glide_size(run: Solved) -> float:
    """The greatest variation of the fundamental, relative to the first eigenfrequency (figures 7 and 13)."""
    return float(np.nanmax(relative_variation(run.pitch.frequency_hz, first_mode(run))))


def glide_end(run: Solved, part: float) -> float:
    """Last time at which the fundamental exceeds its mean from 0.9 s on by more than `part` of it."""
    p = run.pitch
    final = float(np.nanmean(p.frequency_hz[p.time_s > 0.9]))
    over = np.flatnonzero(~(p.frequency_hz <= final * (1 + part)))
    return float(p.time_s[over[-1]]) if over.size else 0.0


def centroid(run: Solved) -> tuple[Floats, Floats]:
    """Centre of each frame (s) and its characteristic frequency (Hz, eq. 14), in the frames of `analysis.sound`."""
    nu = characteristic_frequencies(run.motion.displacement_m, run.rate)
    return frame_times(nu.size, run.rate), nu


def greatest_change(run: Solved, other: Solved) -> float:
    """The greatest relative difference of the characteristic frequencies of `run` and `other`, over 1 s."""
    return float(np.abs(centroid(run)[1] / centroid(other)[1] - 1).max())


def centroid_at(run: Solved, time: float) -> float:
    """Characteristic frequency (eq. 14) at a time."""
    return float(np.interp(time, *centroid(run)))


def contrasts(
    sound: Floats, rate: float, frequencies: Sequence[float], width: float, start: float, end: float
) -> list[float]:
    """Levels of bands around `frequencies` over the mean of equally wide neighbours, from `start` to `end`, dB."""
    power = spectrogram(sound[round(start * rate) : round(end * rate)], rate, WINDOW, WINDOW // 4) ** 2
    mean, nu = power.mean(axis=0), np.arange(power.shape[1]) * rate / WINDOW

    def level(middle: float) -> float:
        return 10 * math.log10(mean[(nu >= middle - width / 2) & (nu < middle + width / 2)].sum())

    return [level(f) - (level(f - width) + level(f + width)) / 2 for f in frequencies]


def perturbed_end(run: Solved) -> float:
    """End of the perturbed zone of the spectrogram, s: the centre of its last frame whose gaps are `FILLED`.

    The power halfway between the partials up to 8 kHz relative to the partials; -50 dB for a string without contacts.
    In windows of four periods each partial has zeros there, halfway to its neighbours.
    """
    nu = modes.frequencies(run.trial.speaking, math.ceil(SHOWN_HZ / run.trial.speaking.fundamental) + 1)
    nu = nu[: int(np.searchsorted(nu, SHOWN_HZ)) + 1]
    window, hop = round(PERIODS * run.rate / nu[0]), WINDOW // 8
    frames = sliding_window_view(run.motion.displacement_m, window)[::hop] * np.hanning(window + 1)[:-1]
    t = np.arange(window) / run.rate

    def power(frequencies: Floats) -> Floats:
        found: Floats = (np.abs(frames @ np.exp(-2j * math.pi * np.outer(t, frequencies))) ** 2).sum(axis=1)
        return found

    filled = np.flatnonzero(power((nu[1:] + nu[:-1]) / 2) > 10 ** (FILLED / 10) * power(nu[:-1]))
    return float((filled[-1] * hop + window / 2) / run.rate) if filled.size else 0.0


def partial_levels(run: Solved, sound: Floats, partials: int, start: float, end: float) -> tuple[Floats, Floats]:
    """Frequencies (Hz) of the first partials and the mean levels (dB) of `sound` around them from `start` to `end`."""
    power = spectrogram(sound[round(start * run.rate) : round(end * run.rate)], run.rate, WINDOW, WINDOW // 4) ** 2
    nu = modes.frequencies(run.trial.speaking, partials + 1)
    edges = np.concatenate([[nu[0] / 2], (nu[1:] + nu[:-1]) / 2]) * WINDOW / run.rate
    sums = np.add.reduceat(power.mean(axis=0), np.ceil(edges).astype(np.int64))[:-1]
    return nu[:-1], np.asarray(10 * np.log10(sums))


def energies(run: Solved) -> Floats:
    """Energy of each mode of u every 10 ms, J, (times, modes)."""
    states = states_of(run)
    return modal_energies(run.trial.speaking, states[:, 0, 0], states[:, 0, 1])


def high_share(run: Solved, above: int = HIGH_MODES) -> Floats:
    """Fraction of the energy in the modes above the number `above`, every 10 ms."""
    e = energies(run)
    return np.asarray(e[:, above:].sum(axis=1) / e.sum(axis=1))


def difference(run: Solved, other: Solved, start: float, end: float) -> float:
    """Root mean square difference of the displacement at the sensor, relative to `other`."""
    here = slice(round(start * run.rate), round(end * run.rate))
    x, y = run.motion.displacement_m[here], other.motion.displacement_m[here]
    return float(np.linalg.norm(x - y) / np.linalg.norm(y))


def energy_drift(run: Solved) -> float:
    """Greatest change of the energy, relative to the first value."""
    e = run.motion.energy_j
    return float(np.abs(e / e[0] - 1).max()) if e is not None else math.nan


def energy_steps(run: Solved) -> Floats:
    """Changes of the energy from each value to the next, relative to the first."""
    e = run.motion.energy_j
    return np.diff(e) / e[0] if e is not None else np.full(1, math.nan)
