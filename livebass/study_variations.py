"""Section 4.1.3 and 4.2: oblique pluck, no dispersion, plucking points, necks, soft frets."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from livebass import study_draw as draw
from livebass import study_measure as measure
from livebass.paper_cases import CASES
from livebass.study_cases import (
    SHOWN_S,
    TOP_HZ,
    ZOOMS,
    add_data,
    contacts_picture,
    spectrogram_picture,
)
from livebass.study_parts import Findings, Picture, Solved

PLUCKED = ("near-bridge", "middle", "near-nut")
NECKS = ("neck", "half-straight", "straight", "sixth-fret")


def oblique(motions: Mapping[str, Solved]) -> Findings:
    """Figure 9: both polarisations."""
    solved = motions["oblique"]
    found = _gathered({"oblique": solved})
    drawn = draw.figure(11, 8)
    upper, lower = drawn.subfigures(2, 1)
    rows = upper.subplots(2, 3, squeeze=False)
    for axes, across in zip(rows, (False, True), strict=True):
        time_s, moved = solved.motion.time_s, solved.displacement(across)
        for axis, (start, end) in zip(axes, ZOOMS, strict=True):
            seen = (time_s >= start) & (time_s <= end)
            if seen.any():
                draw.displacement_panel(axis, time_s[seen], moved[seen], "v" if across else "u", 2 * across)
            else:
                axis.set_axis_off()
    axes = lower.subplots(1, 2)
    for axis, across in zip(axes, (False, True), strict=True):
        image = draw.spectrogram_panel(axis, measure.spectrum(solved, across), TOP_HZ, SHOWN_S)
        axis.set_title("v, across the neck" if across else "u, away from the neck")
    draw.level_bar(lower, image, list(axes))
    caption = "Displacements along u and v, 9 and 18 mm from the bridge, and their spectrograms (figure 9)"
    found.pictures.append(Picture("polarisations", caption, drawn))
    found.pictures.append(contacts_picture("contacts", {"oblique": solved}))
    return found


def dispersion(motions: Mapping[str, Solved]) -> Findings:
    """Figures 7a and 10: case B with its harmonics in tune."""
    named = {"with dispersion": motions["b"], "without dispersion": motions["harmonic"]}
    found = _gathered(motions)
    found.pictures = [
        contacts_picture("contacts", named),
        spectrogram_picture("spectrogram", "Without dispersion", motions["harmonic"], glide=False),
    ]
    found.tables.append(measure.sets_table(named))
    return found


def plucking_point(motions: Mapping[str, Solved]) -> Findings:
    """Figure 11."""
    found = _gathered({name: motions[name] for name in PLUCKED})
    titled = {CASES[name].title: motions[name] for name in PLUCKED}
    found.pictures = [
        _spectrograms("spectrograms", titled, "figure 11"),
        contacts_picture("contacts", titled, until_s=_end(titled), zooms=False, pitch=False),
        contacts_picture("first-contacts", titled, until_s=0.016, zooms=False, pitch=False),
    ]
    found.tables.append(measure.sets_table(titled, 4))
    return found


def neck(motions: Mapping[str, Solved]) -> Findings:
    """Figure 12."""
    found = _gathered({name: motions[name] for name in NECKS})
    titled = {CASES[name].title: motions[name] for name in NECKS}
    rattling = {title: solved for title, solved in titled.items() if solved.motion.contact_step.size}
    found.pictures.append(_spectrograms("spectrograms", titled, "figure 12"))
    if rattling:
        found.pictures.append(contacts_picture("contacts", rattling, until_s=min(0.12, _end(titled)), zooms=False))
        found.tables.append(measure.sets_table(rattling, 4))
    return found


def stiffness(motions: Mapping[str, Solved]) -> Findings:
    """Figure 13: K = 1e9."""
    named = {"K = 1e9": motions["soft"], "K = 1e13": motions["b"]}
    found = _gathered(motions)
    found.pictures = [
        spectrogram_picture("spectrogram", "K = 1e9", motions["soft"], glide=True),
        contacts_picture("contacts", {"K = 1e9": motions["soft"]}),
        contacts_picture("contacts-compared", named, zooms=False),
    ]
    found.tables.append(measure.sets_table(named))
    return found


def _gathered(motions: Mapping[str, Solved]) -> Findings:
    """Data, sounds and numbers of several cases."""
    found = Findings()
    for name, solved in motions.items():
        add_data(found, name, CASES[name].title, solved)
    told = {CASES[name].title: numbers for name, numbers in found.numbers.items()}
    found.tables.insert(0, measure.numbers_table(told))
    return found


def _spectrograms(name: str, motions: Mapping[str, Solved], like: str) -> Picture:
    """A spectrogram each, and under it what the string was before its release."""
    drawn = draw.figure(4 * len(motions), 6)
    axes = drawn.subplots(2, len(motions), height_ratios=(2, 1), squeeze=False)
    for (above, below), (title, solved) in zip(axes.T, motions.items(), strict=True):
        image = draw.spectrogram_panel(above, measure.spectrum(solved), TOP_HZ)
        above.set_title(title, fontsize="medium")
        draw.neck_panel(below, solved.speaking, [measure.initial_shape(solved)])
        below.set_ylim(-5, 5)
    draw.level_bar(drawn, image, list(np.ravel(axes[0])))
    return Picture(name, f"Spectrograms, 70 dB; the string before its release, and the neck ({like})", drawn)


def _end(motions: Mapping[str, Solved]) -> float:
    return max(solved.trial.duration for solved in motions.values())
