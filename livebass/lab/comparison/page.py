"""The page of a comparison: notes to hear, spectrograms, decays, bands and the table, in one file."""

from __future__ import annotations

import base64
import math
from collections.abc import Sequence
from itertools import pairwise
from typing import Any

import numpy as np

from livebass import __version__
from livebass.lab.comparison import listening
from livebass.lab.comparison.comparing import NOTHING, Compared, Comparison
from livebass.lab.comparison.measures import BAND_KEYS, attack
from livebass.lab.comparison.ringing import OCTAVES
from livebass.lab.comparison.rows import ALL, BANDS, HARD, ROWS, SOFT
from livebass.lab.comparison.summary import same_pitch
from livebass.report.page import html_page
from livebass.report.picture import figure, image, shown_text
from livebass.rows.units import cents, note_name
from livebass.sound.analysis import spectrogram_db

MAXIMUM = 4  # basses in a picture
PITCHES = 3  # with spectrograms
LONGEST, HIGHEST, RANGE = 1.5, 8000.0, 70.0  # s, Hz, dB of a spectrogram
STEP = 0.02  # s, for a level over time
COLOURS = ("#1f4e79", "#c55a11", "#548235", "#7030a0")


def page(comparison: Comparison, title: str = "", above: str = "") -> str:
    """Returns the page as HTML, pictures included. Needs matplotlib and Jinja2.

    title: by default the names of the basses; above: HTML that comes first.
    """
    shown = _basses_to_draw(comparison)
    heard = listening.rows(shown)
    drawn = [*_spectrograms(shown), _levels(shown), _decays(shown), _bands(shown)]
    names = [each.bass.title for each in comparison.basses]
    return html_page(
        "livebass.lab.comparison", "comparison.html",
        version=__version__, title=title or " beside ".join(names), above=above, names=names,
        figures=[{"png": base64.b64encode(png).decode(), "caption": caption} for png, caption in drawn],
        heard=heard, count=sum(len(c.bass.notes) for c in shown if not c.bass.rendered), maximum=listening.MAXIMUM,
        rows=[_row(comparison, row) for row in comparison.rows()],
        distances=[
            (each.bass.title, title, NOTHING if math.isnan(f.value) else f"{f.value:.1f}")
            for each in comparison.basses for title, f in each.to_real
        ],
        notes=[f"{each.bass.title}: {_count_notes(each)}" for each in comparison.basses],
    )  # fmt: skip


def _basses_to_draw(comparison: Comparison) -> Sequence[Compared]:
    """Returns the basses to draw; never drops all rendered ones."""
    rendered = [c for c in comparison.basses if c.bass.rendered]
    real = [c for c in comparison.basses if not c.bass.rendered]
    count = max(MAXIMUM - len(rendered), MAXIMUM // 2) if rendered else MAXIMUM
    return [*real[:count], *rendered[: MAXIMUM - len(real[:count])]]


def _count_notes(each: Compared) -> str:
    by_dynamic: dict[str, int] = {}
    for note in sorted(each.bass.notes, key=lambda n: n.rank):
        by_dynamic[note.dynamic] = by_dynamic.get(note.dynamic, 0) + 1
    return ", ".join(f"{count} {name}" for name, count in by_dynamic.items())


def _row(comparison: Comparison, row: Any) -> dict[str, Any]:
    cells = []
    for each in comparison.basses:
        found = each.figure(row)
        known = not math.isnan(found.value)
        cells.append({
            "value": row.shown(found.value) if known else NOTHING if row.of(each.bass.technique) else "",
            "verdict": row.verdict(found.value, each.bass.technique) if known else "",
            "reason": found.reason,
        })  # fmt: skip
    return {
        "title": row.title, "when": "" if row.when == ALL else row.when, "unit": row.unit,
        "real": comparison.ranges(row), "cells": cells,
    }  # fmt: skip


def _spectrograms(shown: Sequence[Compared]) -> list[tuple[bytes, str]]:
    """One picture for each of a few pitches of the first bass: soft and hard, basses side by side."""
    first = sorted(shown[0].bass.notes, key=lambda n: n.pitch)
    pitches = [first[i].pitch for i in sorted({0, len(first) // 2, len(first) - 1})][:PITCHES]
    return [_pitch(shown, pitch) for pitch in dict.fromkeys(pitches)]


def _pitch(shown: Sequence[Compared], pitch: float) -> tuple[bytes, str]:
    drawn = figure(3.2 * len(shown) + 0.6, 5.2)
    axes = drawn.subplots(2, len(shown), squeeze=False, sharex=True, sharey=True)
    for row, when in enumerate((SOFT, HARD)):
        for column, each in enumerate(shown):
            ax = axes[row][column]
            ax.set_title(shown_text(f"{when}: {each.bass.title}"), fontsize=8)
            found = [n for n in each.bass.dynamic(when) if same_pitch(n.pitch, pitch)]
            if not found:
                ax.text(0.5, 0.5, "no such note", ha="center", va="center", transform=ax.transAxes, fontsize=8)
                continue
            note = found[0]
            sound = note.sound[attack(note.sound, note.rate) :][: round(LONGEST * note.rate)]
            seen = spectrogram_db(sound, note.rate, range_db=RANGE)
            inside = seen.frequency_hz <= HIGHEST
            ax.pcolormesh(seen.time_s, seen.frequency_hz[inside] / 1e3, seen.level_db.T[inside], cmap="magma",
                          vmin=-RANGE, vmax=0, rasterized=True)  # fmt: skip
    for ax in axes[-1]:
        ax.set_xlabel("s")
    for line in axes:
        line[0].set_ylabel("kHz")
    name = note_name(round(69 + cents(pitch / 440) / 100))
    return image(drawn), f"Spectrograms of {name}, {RANGE:g} dB below the loudest"


def _levels(shown: Sequence[Compared]) -> tuple[bytes, str]:
    drawn = figure(9.6, 3.4)
    for ax, when in zip(drawn.subplots(1, 2, sharey=True), (SOFT, HARD), strict=True):
        for colour, each in zip(COLOURS, shown, strict=False):
            notes = each.bass.dynamic(when)
            if not notes:
                continue
            levels = [_level(n.sound[attack(n.sound, n.rate) :], n.rate) for n in notes]
            length = min(map(len, levels))
            middle = np.median([level[:length] for level in levels], axis=0)
            ax.plot(np.arange(length) * STEP, middle, color=colour, label=shown_text(each.bass.title))
        ax.set_title(f"level, {when} notes", fontsize=9)
        ax.set_xlabel("s")
        ax.set_ylim(-45, 2)
        ax.grid(alpha=0.3)
    drawn.axes[0].set_ylabel("dB re the peak")
    drawn.axes[1].legend(fontsize=8)
    return image(drawn), "How the level falls, median over notes"


def _level(sound: Any, rate: float) -> Any:
    """Levels over time, dB re the loudest, (frames,)."""
    n = round(STEP * rate)
    power = np.mean(sound[: sound.size // n * n].reshape(-1, n) ** 2, axis=1)
    return 10 * np.log10(np.maximum(power / power.max(), 1e-12))


def _decays(shown: Sequence[Compared]) -> tuple[bytes, str]:
    drawn = figure(9.6, 4.0)
    ax = drawn.subplots()
    for colour, each in zip(COLOURS, shown, strict=False):
        rings = [n.measures.ringing for n in each.bass.notes]
        ax.scatter(np.concatenate([r.frequency for r in rings]), np.concatenate([r.t60 for r in rings]), s=5,
                   color=colour, alpha=0.25, linewidths=0)  # fmt: skip
        middles = [low * math.sqrt(2) for low in OCTAVES[:-1]]
        t60 = [each.figures[f"t60_{low:.0f}", ALL].value for low in OCTAVES[:-1]]
        ax.plot(middles, t60, "o-", color=colour, label=shown_text(each.bass.title))
    real = {row.key: row.range_of(shown[0].bass.technique) for row in ROWS}
    for low, high in pairwise(OCTAVES):
        limits = real[f"t60_{low:.0f}"]
        if limits:
            ax.fill_between([low, high], limits.low, limits.high, color="#888", alpha=0.2, linewidth=0)
    ax.set(xscale="log", yscale="log", xlabel="Hz", ylabel="T60, s", xlim=(OCTAVES[0] / 1.5, OCTAVES[-1]))
    ax.set_ylim(0.3, 60)
    ax.grid(alpha=0.3, which="both")
    ax.legend(fontsize=8)
    return image(drawn), "T60 of partials, and medians by octave; grey: real basses"


def _bands(shown: Sequence[Compared]) -> tuple[bytes, str]:
    drawn = figure(9.6, 3.8)
    place = np.arange(len(BAND_KEYS))
    real = {(row.key, row.when): row.range_of(shown[0].bass.technique) for row in ROWS}
    for ax, when in zip(drawn.subplots(1, 2, sharey=True), (SOFT, HARD), strict=True):
        for colour, each in zip(COLOURS, shown, strict=False):
            values = [f.value if (f := each.figures.get((key, when))) else math.nan for key in BAND_KEYS]
            ax.plot(place, values, "o-", color=colour, label=shown_text(each.bass.title))
        for k, key in enumerate(BAND_KEYS):
            limits = real[key, when]
            if limits:
                ax.fill_between([k - 0.4, k + 0.4], limits.low, limits.high, color="#888", alpha=0.2, linewidth=0)
        ax.set_title(f"{when} notes", fontsize=9)
        ax.set_xticks(place, BANDS, fontsize=7)
        ax.grid(alpha=0.3)
    drawn.axes[0].set_ylabel("dB re the fundamental")
    drawn.axes[0].legend(fontsize=8)
    return image(drawn), "Bands over the fundamental in the first 0.3 s; grey: real basses"
