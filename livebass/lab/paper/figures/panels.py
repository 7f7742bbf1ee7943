"""Panels of the figures, drawn as in Issanchou et al. (2018). Needs matplotlib."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from livebass.lab.analysis.motion import Solved
from livebass.model.instrument import Speaking
from livebass.rows.arrays import Floats
from livebass.sound.analysis import RANGE, Spectrogram

MANY = 5000  # points of a line or a cloud; beyond that an SVG holds it as pixels
COLOURS = ("tab:red", "black", "tab:blue", "tab:orange", "tab:green", "tab:purple")
LEGEND_ROOM = 150  # characters over a figure of usual width
MARKERS = ("o", ".", "x", "+", "D", "s")


def spectrogram(axis: Any, shown: Spectrogram, top_hz: float, until_s: float | None = None) -> Any:
    """Draw levels over time (s) and frequency (kHz); returns the image for `level_bar`."""
    step = float(shown.time_s[1] - shown.time_s[0]) if shown.time_s.size > 1 else 2 * float(shown.time_s[0])
    keep = shown.frequency_hz <= top_hz + shown.frequency_hz[1]
    half = shown.frequency_hz[1] / 2
    image = axis.imshow(
        shown.level_db[:, keep].T, origin="lower", aspect="auto", cmap="magma", vmin=-RANGE, vmax=0.0,
        interpolation="bilinear",
        extent=(
            shown.time_s[0] - step / 2, shown.time_s[-1] + step / 2,
            -half / 1e3, (shown.frequency_hz[keep][-1] + half) / 1e3,
        ),
    )  # fmt: skip
    axis.set(xlabel="time (s)", ylabel="frequency (kHz)", ylim=(0, top_hz / 1e3))
    axis.set_xlim(shown.time_s[0] - step / 2, min(until_s or np.inf, shown.time_s[-1] + step / 2))
    return image


def level_bar(drawn: Any, image: Any, axes: Any) -> None:
    """Add the colour bar of spectrograms; its 0 dB is the loudest point of each."""
    drawn.colorbar(image, ax=axes, label="level (dB, 0: the loudest)", pad=0.01)


def contacts(axis: Any, solved: Solved, label: str, number: int = 0) -> None:
    """Draw a mark for each contact with a fret or a place of a board."""
    time_s = solved.motion.contact_time_s
    where = solved.contact_place if solved.over_board else solved.contacts.fret
    filled = MARKERS[number] in "x+."
    axis.scatter(
        time_s, where, s=26 if MARKERS[number] == "." else 16, marker=MARKERS[number], label=label, linewidths=0.8,
        rasterized=time_s.size > MANY, color=COLOURS[number] if filled else None,
        facecolors=None if filled else "none", edgecolors=None if filled else COLOURS[number],
    )  # fmt: skip
    axis.set_xlabel("time (s)")
    if solved.over_board:
        axis.set(ylabel="place of contact (m)", ylim=(0, max(solved.speaking.contact_position)))
    else:
        last = max(solved.speaking.contact_fret)
        axis.set(ylabel="fret number", ylim=(0, last + 1), yticks=range(0, last + 1, 5))


def variation(axis: Any, time_s: Floats, variation: Floats, label: str, number: int = 0) -> None:
    """Draw the relative variation of the fundamental, for a separate axis at the right."""
    axis.plot(time_s, variation, color=COLOURS[number], linewidth=1.2, label=label)
    axis.set(ylabel="relative frequency variation")


def neck(axis: Any, s: Speaking, shapes: Sequence[Floats] = ()) -> None:
    """Draw fret crowns or the board, and string shapes over them, each u (m) at even points from end to end."""
    x, height = np.asarray(s.contact_position), np.asarray(s.contact_height) * 1e3
    axis.plot(x, height, color="black", linewidth=0.8)
    crowns = np.asarray(s.contact_fret) > 0
    axis.vlines(x[crowns], -6.0, height[crowns], color="black", linewidth=0.6)
    for k, shape in enumerate(shapes):
        axis.plot(np.linspace(0, s.length, len(shape)), shape * 1e3, color=("tab:blue", *COLOURS)[k])
    axis.axhline(0.0, color="grey", linewidth=0.5, linestyle=":")
    axis.set(xlabel="x (m)", ylabel="u (mm)", xlim=(0, s.length))


def displacement(axis: Any, time_s: Floats, moved: Floats, name: str = "u", number: int = 0) -> None:
    """Draw the displacement at a sensor, mm."""
    axis.plot(time_s, moved * 1e3, color=COLOURS[number], linewidth=0.7, rasterized=time_s.size > MANY)
    axis.set(xlabel="time (s)", ylabel=f"{name} (mm)", xlim=(time_s[0], time_s[-1]))


def legend(*axes: Any) -> None:
    """Draw one legend above superimposed axes."""
    pairs = [axis.get_legend_handles_labels() for axis in axes]
    handles = [h for pair in pairs for h in pair[0]]
    labels = [label for pair in pairs for label in pair[1]]
    limit = max(1, min(4, LEGEND_ROOM // (6 + max(map(len, labels), default=0))))  # 6: the line or mark before it
    axes[0].legend(
        handles, labels, fontsize="small", loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=min(limit, len(labels)),
        frameon=False,
    )  # fmt: skip
