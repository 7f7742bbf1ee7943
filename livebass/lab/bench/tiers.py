"""`livebass bench fidelity`: how far qualities are from `reference` to the ear, by preset and stroke.

Plays the notes of fidelity.py and gives, for each preset, and for each stroke of a guest on it:

- the number of contacts that begin, over that of `reference`;
- the bias in third-octave bands: the difference in level, the median over the plucks of a note, then over notes. A
  note counts in a band if `reference` is at most FAINTEST below its loudest band there. A band of fewer than FEWEST
  notes has none;
- with the extra `hear`, the mean opinion score of Zimtohrli (lab/comparison/hearing.py) between the same plucks of
  both: 5 means that nobody hears a difference.

`reference` by other plucks shows what chance gives.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from livebass.lab.bench.fidelity import (
    PLUCKS,
    SPAN,
    Heard,
    Note,
    distance,
    forces,
    guest_notes,
    play_plucks,
    representative_notes,
    waveforms,
)
from livebass.lab.bench.live import NULL, comparison_lines
from livebass.lab.bench.measure import Result, Row, heading, machine_line
from livebass.lab.comparison import hearing
from livebass.model.quality import QUALITIES
from livebass.report.progress import Say, silent
from livebass.report.text import columns
from livebass.rows.arrays import Floats
from livebass.sound.analysis import loudness, resample

CENTRES = 1000.0 * 10.0 ** (np.arange(-14, 13) / 10)  # Hz: the third-octave bands of IEC 61260-1, 40 Hz to 16 kHz
EDGE = 10.0**0.05  # of a band's upper edge over its centre
RISE = 2e-3  # s
FAINTEST = 60.0  # dB
FEWEST = 3  # notes
MAX_BIAS = 0.5  # dB, in any band
MAX_CONTACTS = 0.05  # of those of `reference`, more or fewer


@dataclass(frozen=True)
class Extent:
    """Extent of a comparison."""

    presets: tuple[str, ...] = ()  # their notes and their guests'; empty: all
    qualities: tuple[str, ...] = tuple(name for name in QUALITIES if name != "reference")
    plucks: int = PLUCKS  # per note
    notes: tuple[Note, ...] | None = None  # instead of those


ALL = Extent()


def bench_fidelity(hear: bool = False, progress: Say = silent, extent: Extent = ALL) -> Result:
    """Compares qualities with `reference`, in some four minutes. `progress` gets each next step.

    "fidelity" and "waveforms" are those of `bench_live`. "tiers" has for each quality, and for `reference` by other
    plucks, the rows of `by_preset`. Raises LookupError if `hear` lacks its extra, and the errors of `load_preset`.
    [main thread]
    """
    mos = hearing.judge() if hear else None
    result = heading()
    notes = notes_of(extent.presets) if extent.notes is None else list(extent.notes)
    reference, plucks = QUALITIES["reference"], forces(extent.plucks)
    progress(f"{len(notes)} notes, {len(plucks)} plucks each, in reference")
    wanted = play_plucks(notes, reference, plucks)
    fidelity, near, tiers = {}, {}, {}
    for quality in [*extent.qualities, NULL]:
        progress("reference against itself" if quality == NULL else f"{quality} against reference")
        if quality == NULL:
            sounds = play_plucks(notes, reference, forces(extent.plucks, other=True))
        else:
            sounds = play_plucks(notes, QUALITIES[quality], plucks)
            near[quality] = waveforms(notes, sounds, wanted)
        fidelity[quality] = distance(notes, sounds, wanted)
        tiers[quality] = by_preset(notes, sounds, wanted, mos)
    return result | {"span_s": SPAN, "fidelity": fidelity, "waveforms": near, "tiers": tiers}


def notes_of(presets: Sequence[str]) -> list[Note]:
    """Returns the notes to compare, of `presets` and of the guests on them; of all if there are none."""
    return [
        *representative_notes(presets or None),
        *(note for note in guest_notes() if not presets or note.preset in presets),
    ]


def by_preset(
    notes: Sequence[Note], sounds: Sequence[Heard], wanted: Sequence[Heard],
    mos: Callable[[Floats, Floats], float] | None = None,
) -> list[Row]:  # fmt: skip
    """Compares `sounds` of `notes` with the `wanted` ones: a row for each preset, and for each stroke of guests on it.

    A row has "preset", "stroke", "notes"; "contacts" and "contacts_wanted", the numbers over all plucks; "bands", the
    `bias` by band, each with "hz", "db" and "notes"; "worst_band" of these, None without any. With `mos`, the judge of
    two sounds at `hearing.RATE`, also "mos", the median over notes, and "worst_mos", of the worst note. A note's score
    is the median over its plucks.
    """
    rows: list[Row] = []
    for preset, stroke in dict.fromkeys((note.preset, note.stroke) for note in notes):
        mine = [k for k, note in enumerate(notes) if (note.preset, note.stroke) == (preset, stroke)]
        bands = bias([(sounds[k].sounds, wanted[k].sounds, notes[k].rate) for k in mine])
        row: Row = {
            "preset": preset, "stroke": stroke, "notes": len(mine),
            "contacts": sum(sum(sounds[k].started) for k in mine),
            "contacts_wanted": sum(sum(wanted[k].started) for k in mine),
            "bands": bands, "worst_band": max(bands, key=lambda band: abs(band["db"]), default=None),
        }  # fmt: skip
        if mos is not None:
            scores = [score(mos, sounds[k].sounds, wanted[k].sounds, notes[k].rate) for k in mine]
            row |= {"mos": float(np.median(scores)), "worst_mos": min(scores)}
        rows.append(row)
    return rows


def bias(pairs: Sequence[tuple[Floats, Floats, int]]) -> list[Row]:
    """The bias of notes by band, lowest first: "hz", "db" and the number of "notes" in it.

    Each of `pairs` is a note: its sounds and the wanted ones, (plucks, n) each, and their rate, Hz.
    """
    differences = np.full((len(pairs), len(CENTRES)), np.nan)
    for k, (sounds, wanted, rate) in enumerate(pairs):
        levels, right = band_levels(sounds, rate), band_levels(wanted, rate)
        usual = np.median(right, axis=0)
        heard = usual >= usual.max() - FAINTEST
        differences[k, heard] = np.median(levels[:, heard] - right[:, heard], axis=0)
    found = []
    for hz, difference in zip(CENTRES, differences.T, strict=True):
        present = difference[np.isfinite(difference)]
        if present.size >= min(FEWEST, len(pairs)) and present.size:
            found.append({"hz": float(hz), "db": float(np.median(present)), "notes": int(present.size)})
    return found


def band_levels(sounds: Floats, rate: int) -> Floats:
    """Levels of `sounds`, (plucks, n), in the bands of CENTRES: dB, (plucks, bands); -inf for none.

    The sounds rise within RISE and fade to their end, each by half a Hann window: their attacks count almost in full.
    """
    count = sounds.shape[1]
    window = 0.5 + 0.5 * np.cos(math.pi * np.arange(count) / count)
    rise = round(RISE * rate)
    window[:rise] *= 0.5 - 0.5 * np.cos(math.pi * np.arange(rise) / rise)
    power = np.abs(np.fft.rfft(sounds * window)) ** 2
    edges = np.concatenate([CENTRES / EDGE, CENTRES[-1:] * EDGE]) * count / rate
    sums = np.concatenate([np.zeros((len(power), 1)), np.cumsum(power, axis=1)], axis=1)
    bins = np.minimum(np.ceil(edges).astype(int), power.shape[1])
    with np.errstate(divide="ignore"):
        return np.asarray(10 * np.log10(np.diff(sums[:, bins], axis=1)))


def score(mos: Callable[[Floats, Floats], float], sounds: Floats, wanted: Floats, rate: int) -> float:
    """The median MOS of a note's sounds beside the wanted ones, (plucks, n) each at `rate` (Hz), equally amplified."""
    found = []
    for one, other in zip(sounds, wanted, strict=True):
        gain = 10 ** ((hearing.LOUDNESS - loudness(other, rate)) / 20)
        at = [
            each * gain if rate == hearing.RATE else resample(each * gain, rate, hearing.RATE) for each in (one, other)
        ]
        found.append(mos(*at))
    return float(np.median(found))


HEAD = ("from reference", "preset", "notes", "contacts", "more", "bias", "at")
HEARD = ("MOS", "worst")
EXPLAINED = (
    f"contacts: that begin in the first {SPAN:g} s, over all plucks, in reference; more: in the quality",
    f"bias: the largest of any third-octave band, median over notes; not of bands {FAINTEST:g} dB below the loudest",
    f"wanted: contacts within {MAX_CONTACTS:.0%}, no bias above {MAX_BIAS:g} dB",
)
JUDGED = "MOS: by a model of hearing (Zimtohrli), median and worst note; 5: nobody hears a difference"


def table(result: Result) -> str:
    """Returns the figures of `bench_fidelity` as text."""
    tiers = result["tiers"]
    judged = any("mos" in row for rows in tiers.values() for row in rows)
    rows = [(quality, *_cells(row)) for quality, found in tiers.items() for row in found]
    head = HEAD + HEARD * judged
    return "\n".join([
        *comparison_lines(result), *columns([head, *rows], left=2), *EXPLAINED, *([JUDGED] if judged else []), "",
        machine_line(result),
    ])  # fmt: skip


def _cells(row: Row) -> tuple[str, ...]:
    ours, right, band = row["contacts"], row["contacts_wanted"], row["worst_band"]
    return (
        f"{row['preset']}, {row['stroke']}" if row["stroke"] else row["preset"],
        str(row["notes"]),
        str(right),
        f"{ours / right - 1:+.1%}" if right else f"{ours:+d}" if ours else "",
        f"{band['db']:+.2f} dB" if band else "",
        _hertz(band["hz"]) if band else "",
        *((f"{row['mos']:.2f}", f"{row['worst_mos']:.2f}") if "mos" in row else ()),
    )


def _hertz(hz: float) -> str:
    return f"{hz / 1e3:.3g} kHz" if hz >= 1000 else f"{hz:.3g} Hz"
