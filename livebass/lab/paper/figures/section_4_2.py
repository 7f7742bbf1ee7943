"""Section 4.2: figures 10 to 13, influences on the sound: dispersion, the plucking point, the neck, the frets."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from livebass.lab.analysis.motion import Solved
from livebass.lab.paper.cases import CASES
from livebass.lab.paper.figures import measure, panels
from livebass.lab.paper.figures.section_4_1 import TOP_HZ, figure_5, figure_7
from livebass.lab.paper.figures.study import Findings, Picture
from livebass.report.picture import figure

PLUCKED = ("near-bridge", "middle", "near-nut")
NECKS = ("neck", "half-straight", "straight", "sixth-fret")


def dispersion(motions: Mapping[str, Solved]) -> Findings:
    """The study `dispersion`: figures 7a and 10, case B with dispersion and with harmonic partials."""
    titled = {"with dispersion": motions["b"], "without dispersion": motions["harmonic"]}
    found = measure.gather(motions)
    found.pictures = [
        figure_7("contacts", "Figure 7a", titled),
        figure_5("spectrogram", "Without dispersion", motions["harmonic"], glide=False),
    ]
    found.tables.append(measure.sets_table(titled))
    return found


def plucking_point(motions: Mapping[str, Solved]) -> Findings:
    """The study `plucking-point`: figure 11, spectrograms and first shapes for three points, and their contacts."""
    found = measure.gather({name: motions[name] for name in PLUCKED})
    titled = {CASES[name].title: motions[name] for name in PLUCKED}
    found.pictures = [
        _spectrograms(titled, "figure 11"),
        figure_7("contacts", "The whole time", titled, until_s=_end(titled), zooms=False, pitch=False),
        figure_7("first-contacts", "The first 16 ms", titled, until_s=0.016, zooms=False, pitch=False),
    ]
    found.tables.append(measure.sets_table(titled, 4))
    return found


def neck(motions: Mapping[str, Solved]) -> Findings:
    """The study `neck`: figure 12, spectrograms over four necks, and the contacts with those that the string meets."""
    found = measure.gather({name: motions[name] for name in NECKS})
    titled = {CASES[name].title: motions[name] for name in NECKS}
    found.pictures = [_spectrograms(titled, "figure 12")]
    rattling = {title: solved for title, solved in titled.items() if solved.motion.contact_step.size}
    if rattling:
        end = min(0.12, _end(titled))
        found.pictures.append(figure_7("contacts", "Necks that the string meets", rattling, until_s=end, zooms=False))
        found.tables.append(measure.sets_table(rattling, 4))
    return found


def stiffness(motions: Mapping[str, Solved]) -> Findings:
    """The study `stiffness`: figure 13, soft frets, and their contacts compared with those of hard frets."""
    titled = {"K = 1e9": motions["soft"], "K = 1e13": motions["b"]}
    found = measure.gather(motions)
    found.pictures = [
        figure_5("spectrogram", "K = 1e9", motions["soft"]),
        figure_7("contacts", "K = 1e9", {"K = 1e9": motions["soft"]}),
        figure_7("contacts-compared", "Soft frets and hard ones", titled, zooms=False),
    ]
    found.tables.append(measure.sets_table(titled))
    return found


def _spectrograms(motions: Mapping[str, Solved], number: str) -> Picture:
    """The spectrogram of each motion, and below it the string before its release."""
    drawn = figure(4 * len(motions), 6)
    axes = drawn.subplots(2, len(motions), height_ratios=(2, 1), squeeze=False)
    for (above, below), (title, solved) in zip(axes.T, motions.items(), strict=True):
        image = panels.spectrogram(above, measure.spectrum(solved), TOP_HZ)
        above.set_title(title, fontsize="medium")
        panels.neck(below, solved.speaking, [measure.initial_shape(solved)])
        below.set_ylim(-5, 5)
    panels.level_bar(drawn, image, list(np.ravel(axes[0])))
    caption = f"Spectrograms, 70 dB; the string before its release, and the neck ({number})"
    return Picture("spectrograms", caption, drawn)


def _end(motions: Mapping[str, Solved]) -> float:
    """The longest duration, s."""
    return max(solved.trial.duration for solved in motions.values())
