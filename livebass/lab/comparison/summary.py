"""Sums up the figures of many notes: by bass and dynamic, and as distances between basses."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import combinations, pairwise

import numpy as np

from livebass.lab.comparison.distance import SPANS, between
from livebass.lab.comparison.names import NOTE, TECHNIQUES
from livebass.lab.comparison.notes import Note
from livebass.lab.comparison.ringing import OCTAVES
from livebass.lab.comparison.rows import ALL, HARD, MEDIUM, ROWS, SOFT
from livebass.rows.units import cents

SAME = 50.0  # cents: notes of one pitch
FEWEST = 3  # partials needed for a T60
KNOCK = 0.3  # s that contain the peak of a release
RELEASED = 20.0  # dB, by which a release falls
EXTREME = {"dip": 10.0, "returns": 90.0}  # percentiles over notes, beside the median
RATIO = (200.0, 1600.0)  # Hz, for T60 stopped / open


@dataclass(frozen=True)
class Bass:
    """The notes of one bass, played by one technique."""

    name: str
    technique: str
    rendered: bool
    notes: tuple[Note, ...]  # plucked
    releases: tuple[Note, ...] = ()

    @property
    def ranks(self) -> list[int]:
        return sorted({n.rank for n in self.notes})

    def dynamic(self, when: str) -> list[Note]:
        """Returns the SOFT, MEDIUM or HARD notes: of the first, a middle and the last dynamic; or ALL.

        A single dynamic counts as HARD; with two there is no MEDIUM.
        """
        ranks = self.ranks
        if when == ALL:
            return list(self.notes)
        chosen = {HARD: ranks[-1:], SOFT: ranks[:1] if len(ranks) > 1 else [],
                  MEDIUM: ranks[(len(ranks) - 1) // 2 :][:1] if len(ranks) > 2 else []}[when]  # fmt: skip
        return [n for n in self.notes if n.rank in chosen]

    @property
    def title(self) -> str:
        """Its name and technique; a rendered bass is "as" the technique."""
        return f"{self.name} as {self.technique}" if self.rendered else f"{self.name}, {self.technique}"


@dataclass(frozen=True)
class Figure:
    """A figure of a bass: its value, or NaN for a `reason`."""

    value: float
    reason: str = ""


RELEASE_KEYS = ("knock", "knock_centroid", "release_time")
Figures = dict[tuple[str, str], Figure]  # by key and SOFT, MEDIUM, HARD or ALL


def basses(name: str, notes: Sequence[Note], rendered: bool = False) -> list[Bass]:
    """Returns the basses of notes, one per technique; noises of the hand belong to all of them."""
    releases = tuple(n for n in notes if n.kind == "release")
    found = []
    for technique in TECHNIQUES:
        plucked = tuple(n for n in notes if n.kind == NOTE and n.technique == technique)
        if plucked:
            found.append(Bass(name, technique, rendered, plucked, releases))
    return found


def summary(notes: Sequence[Note]) -> dict[str, dict[str, float]]:
    """Returns the median of every figure by dynamic, over the plucked notes of one technique of one bass.

    Keys are the names of the dynamics, plus "soft" for the softest and "hard" for the hardest, which are the same if
    there is one. A figure that no note shows is NaN.
    """
    layers = by_rank([n for n in notes if n.kind == NOTE])
    found = {layer[0].dynamic: {key: figure.value for key, figure in medians(layer).items()} for layer in layers}
    if found:
        names = list(found)
        found.setdefault(SOFT, found[names[0]])
        found.setdefault(HARD, found[names[-1]])
    return found


def by_rank(notes: Sequence[Note]) -> list[list[Note]]:
    """Returns the notes of each dynamic, from soft to hard."""
    return [[n for n in notes if n.rank == rank] for rank in sorted({n.rank for n in notes})]


def medians(notes: Sequence[Note]) -> dict[str, Figure]:
    """Returns the median of every figure over the notes that show it, or the commonest reason why none does."""
    return {
        key: _median((n.measures[key] for n in notes), (n.measures.missing.get(key, "") for n in notes))
        for key in notes[0].measures
    }


def figures(bass: Bass) -> Figures:
    """Returns all figures of a bass that need no other bass."""
    found: Figures = {}
    for when in (SOFT, MEDIUM, HARD):
        notes = bass.dynamic(when)
        if notes:
            found |= {(key, when): figure for key, figure in medians(notes).items()}
            for key, percent in EXTREME.items():
                valid = [v for n in notes if not math.isnan(v := n.measures[key])]
                found[f"{key}_90", when] = Figure(float(np.percentile(valid, percent))) if valid else found[key, when]
    of_all = {
        **_t60(bass), "t60_scatter": medians(bass.notes)["t60_scatter"], **_growth(bass), **_takes(bass),
        **_release(bass),
        "touch_distance": _apart(_pairs(bass.dynamic(SOFT), bass.dynamic(HARD)), "no pitch both soft and hard"),
    }  # fmt: skip
    return found | {(key, ALL): figure for key, figure in of_all.items()}


def outside(found: Figures, technique: str) -> dict[tuple[str, str], float]:
    """Returns the distance of figures from the range of real basses, by key and when, in the unit of each row.

    Positive above, negative below, 0 inside; rows without a range or a value are left out.
    """
    off = {}
    for row in ROWS:
        real, figure = row.range_of(technique), found.get((row.key, row.when))
        if real is not None and figure is not None and not math.isnan(figure.value):
            off[row.key, row.when] = max(0.0, figure.value - real.high) + min(0.0, figure.value - real.low)
    return off


def reason(bass: Bass, when: str) -> str:
    """Returns why a bass has no notes that are SOFT or MEDIUM."""
    count = len(bass.ranks)
    return "one dynamic, taken for hard" if count == 1 else f"{count} dynamics, none {when}"


def _median(values: Iterable[float], reasons: Iterable[str] = (), why: str = "no note tells it") -> Figure:
    valid = [v for v in values if not math.isnan(v)]
    if valid:
        return Figure(float(np.median(valid)))
    said = Counter(r for r in reasons if r)
    return Figure(math.nan, said.most_common(1)[0][0] if said else why)


def _t60(bass: Bass) -> dict[str, Figure]:
    """T60 by octave over all partials of stopped notes, or of all if open ones are unknown; stopped / open."""
    known = any(n.open is not None for n in bass.notes) and any(not n.open for n in bass.notes)
    stopped = [n for n in bass.notes if not n.open] if known else list(bass.notes)

    def t60(notes: Sequence[Note], low: float, high: float) -> Figure:
        together = np.concatenate([np.zeros(0), *(n.measures.ringing.between(low, high) for n in notes)])
        if together.size < FEWEST:
            return Figure(math.nan, f"fewer than {FEWEST} partials that decay clearly over the noise")
        return Figure(float(np.median(together)))

    found = {f"t60_{low:.0f}": t60(stopped, low, high) for low, high in pairwise(OCTAVES)}
    opened = [n for n in bass.notes if n.open]
    ratio = Figure(math.nan, "not told which strings are open" if not known else "no open notes")
    if known and opened:
        ends = [(low, high) for low, high in pairwise(OCTAVES) if RATIO[0] <= low and high <= RATIO[1]]
        ratio = _median((t60(stopped, *e).value / t60(opened, *e).value for e in ends), why="too few partials")
    return found | {"t60_ratio": ratio}


def _growth(bass: Bass) -> dict[str, Figure]:
    """Growth of figures at the same pitch: from the softest dynamic to the next, and from soft notes to hard ones."""
    soft, hard, ranks = bass.dynamic(SOFT), bass.dynamic(HARD), bass.ranks
    louder = [n for n in bass.notes if n.rank in ranks[1:2]]
    found = {}
    for name, key, notes, why in (
        ("growth", "growth", louder, "no pitch in both dynamics"),
        ("level_growth", "level", louder, "no pitch in both dynamics"),
        ("level_span", "level", hard, "no pitch both soft and hard"),
        ("between_rise", "between_level", hard, "no pitch both soft and hard"),  # at 0.4 s
    ):
        growth = (b.measures[key] - a.measures[key] for a, b in _pairs(soft, notes))
        found[name] = _median(growth, why=why if len(ranks) > 1 else "one dynamic")
    return found


def _pairs(some: Sequence[Note], others: Sequence[Note]) -> list[tuple[Note, Note]]:
    """The pairs of one of some notes and one of others at the same pitch."""
    return [(a, b) for a in some for b in others if _same(a, b)]


def same_pitch(a: float, b: float) -> bool:
    """Returns whether two pitches (Hz) belong to the same note."""
    return abs(cents(a / b)) < SAME


def _same(a: Note, b: Note) -> bool:
    return same_pitch(a.pitch, b.pitch)


def _takes(bass: Bass) -> dict[str, Figure]:
    """Scatter of the level between takes of one pitch and dynamic, and their distance."""
    pairs = [(a, b) for a, b in combinations(bass.notes, 2) if a.rank == b.rank and _same(a, b)]
    if not pairs:
        alone = Figure(math.nan, "one take of each note")
        return {"take_level": alone, "take_distance": alone}
    level = [abs(a.measures["level"] - b.measures["level"]) / math.sqrt(2) for a, b in pairs]
    return {"take_level": _median(level), "take_distance": _apart(pairs)}


def _apart(pairs: Sequence[tuple[Note, Note]], why: str = "") -> Figure:
    short = f"no notes of {SPANS[0]:g} s"
    return _median((between(a.shape, b.shape) for a, b in pairs), why=short if pairs else why)


def _release(bass: Bass) -> dict[str, Figure]:
    """Peak of a release relative to its note after 1 s, its centroid, and the time in which it falls by 20 dB."""
    if not bass.releases:
        return dict.fromkeys(RELEASE_KEYS, Figure(math.nan, "no release is among the recordings"))
    over, middle, time = [], [], []
    for release in bass.releases:
        alike = [n for n in bass.notes if n.place == release.place] or list(bass.notes)
        alike = [n for n in alike if n.dynamic == release.dynamic] or alike
        rest = [_peak(n, 1.0, 1.1) for n in alike if n.sound.size > 1.2 * n.rate]
        part = release.sound[: round(KNOCK * release.rate)]
        loud = float(np.abs(part).max(initial=0.0))
        if not loud > 0:
            continue
        time.append(_falls(release))
        power = np.abs(np.fft.rfft(part * np.hanning(2 * part.size)[part.size :])) ** 2
        middle.append(float(power @ np.arange(power.size) * release.rate / part.size / power.sum()))
        if rest:
            over.append(20 * math.log10(loud) - float(np.median(rest)))
    values = {"knock": over, "knock_centroid": middle, "release_time": time}
    why = {"knock": "no note of 1.2 s", "knock_centroid": "silent releases", "release_time": "cut releases"}
    return {key: _median(values[key], why=why[key]) for key in RELEASE_KEYS}


def _falls(release: Note) -> float:
    """Returns the time (ms) from the peak of a release until it stays 20 dB below; NaN if it is cut before."""
    n = max(1, round(0.01 * release.rate))
    total = np.cumsum(np.concatenate([[0.0], release.sound**2]))
    power = total[n:] - total[:-n]
    top = int(np.argmax(power[: round(KNOCK * release.rate)]))
    last = int(np.flatnonzero(power[top:] >= power[top] * 10 ** (-RELEASED / 10))[-1])
    return 1000 * last / release.rate if top + last + 1 < power.size else math.nan


def _peak(note: Note, begin: float, end: float) -> float:
    start = next(iter(np.flatnonzero(np.abs(note.sound) >= 0.03 * np.abs(note.sound).max())), 0)
    part = note.sound[start + round(begin * note.rate) : start + round(end * note.rate)]
    return 20 * math.log10(max(float(np.abs(part).max(initial=0.0)), 1e-15))


def distances(bass: Bass, real: Sequence[Bass]) -> dict[str, Figure]:
    """Returns the distances of the notes of a bass from other real basses, by name of the figure."""
    others = [n for other in real if other.name != bass.name for n in other.notes]
    touch = {id(n): _when(other, n) for other in real for n in other.notes}
    why = "no other real bass" if not others else "no pitch in common"

    nearest = partial(_nearest, bass.notes, others, why=why)

    def alike(note: Note, other: Note) -> bool:
        return _same(note, other) and _when(bass, note) == touch[id(other)]

    return {
        "nearest_1s": nearest(SPANS[0]), "nearest_2s": nearest(SPANS[1]),
        "nearest_equalized": nearest(SPANS[1], equalized=True), "alike_1s": nearest(SPANS[0], allowed=alike),
    }  # fmt: skip


def _when(bass: Bass, note: Note) -> str:
    ranks = bass.ranks
    return HARD if note.rank == ranks[-1] else SOFT if note.rank == ranks[0] else MEDIUM


def apart(bass: Bass, other: Bass) -> Figure:
    """Returns the median distance from the notes of a bass to the nearest of another one, at the same pitch."""
    return _nearest(bass.notes, other.notes)


def _nearest(
    notes: Sequence[Note], others: Sequence[Note], seconds: float = SPANS[0], equalized: bool = False,
    allowed: Callable[[Note, Note], bool] = _same, why: str = "no pitch in common",
) -> Figure:  # fmt: skip
    """The median distance from notes to the nearest one allowed among others."""
    minimum = []
    for note in notes:
        apart = (between(note.shape, o.shape, seconds, equalized) for o in others if allowed(note, o))
        minimum.append(min((d for d in apart if not math.isnan(d)), default=math.nan))
    return _median(minimum, why=why)
